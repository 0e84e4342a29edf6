//! What comparisons and experiments are made of, by name: their arguments list it, and they carry it out.

/// Names of the cases, the unit of their errors, and the error at which speeds are compared.
pub(crate) const CASES: [(&str, &str, f64); 5] = [
    ("cantilever-1", "L", 1e-4),
    ("cantilever-10", "L", 1e-4),
    ("soft-tube", "mm", 0.1),
    ("curved-tube", "mm", 0.1),
    ("arch", "mm", 0.1),
];

/// Ends of the aortic arch that a wire is steered to, in the order of their rows in its centre-line table.
pub(crate) const ARCH_TARGETS: [&str; 4] =
    ["ascending aorta", "innominate", "left carotid", "left subclavian"];
/// Those of the hepatic arteries.
pub(crate) const HEPATIC_TARGETS: [&str; 5] =
    ["aorta", "splenic", "gastroduodenal", "right hepatic", "left hepatic"];

/// Names of all targets.
pub(crate) fn targets() -> impl Iterator<Item = &'static str> {
    ARCH_TARGETS.into_iter().chain(HEPATIC_TARGETS)
}
