//! Names in comparisons and experiments, used both by their arguments and by their implementation.

use endowire_methods::NAMES;

/// The compared methods: all methods, ours first, and two variants of the paper's: with unit tangents and the planes
/// of triangles, and as printed.
pub const CANDIDATES: [&str; NAMES.len() + 2] = {
    let [ours, dense, banded, rest @ ..] = NAMES;
    let [a, b, c, d, e, f] = rest;
    [ours, dense, banded, TRIANGLE, PRINTED, a, b, c, d, e, f]
};
/// The paper's method with unit tangents and the planes of triangles.
pub const TRIANGLE: &str = "li2011-banded-triangle";
/// The paper's method as printed: free tangents and the planes of triangles.
pub const PRINTED: &str = "li2011-banded-printed";

/// Names of the cases, the unit of their errors, and the error at which speeds are compared.
pub const CASES: [(&str, &str, f64); 5] = [
    ("cantilever-1", "L", 1e-4),
    ("cantilever-10", "L", 1e-4),
    ("soft-tube", "mm", 0.1),
    ("curved-tube", "mm", 0.1),
    ("arch", "mm", 0.1),
];

/// Targets in the aortic arch, in the order of their rows in its centre-line table.
pub const ARCH_TARGETS: [&str; 4] = ["ascending aorta", "innominate", "left carotid", "left subclavian"];
/// Targets in the hepatic arteries.
pub const HEPATIC_TARGETS: [&str; 5] =
    ["aorta", "splenic", "gastroduodenal", "right hepatic", "left hepatic"];

/// Names of all targets.
pub fn targets() -> impl Iterator<Item = &'static str> {
    ARCH_TARGETS.into_iter().chain(HEPATIC_TARGETS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_a_candidate() {
        assert!(NAMES.iter().all(|name| CANDIDATES.contains(name)));
        assert_eq!(CANDIDATES.len(), NAMES.len() + 2);
    }
}
