//! Three-point bending of wires, against published flexural moduli.

use endowire_core::Result;
use endowire_core::device::Device;

use super::{Compared, Kind, Line, Study};
use crate::Row;
use crate::bench::bend::BendTest;

/// The study in words.
pub const STUDY: Study = Study {
    name: "bending",
    title: "Three-point bending of catalogue wires",
    question: "Would a three-point bending test of the catalogue's stiff wires read what was measured on such wires?",
    data: "Flexural moduli of intact 0.035 inch wires (Harrison et al., J Endovasc Ther 2011;18:797–801): Amplatz 9.5, stiff 17, super stiff 60.3, Lunderquist \
           158.4 GPa; times π d⁴/64 with d = 0.889 mm, which is assumed: the abstract does not state the diameters.",
    computed: "The bench's test, span 20 mm, in the body of each wire; and along the wires, for the figure.",
    not_shown: "The catalogue takes the stiffness of these bodies from the same source: agreement shows that the test reads what a file says, not that the file is \
                right. The tapers towards the tip are estimates that nobody has measured here.",
};

/// Wires of the catalogue with the flexural modulus of their bodies, GPa.
pub const WIRES: [(&str, f64); 4] = [
    ("wire_035_standard", 9.5),
    ("wire_035_stiff", 17.0),
    ("wire_035_amplatz_super_stiff", 60.3),
    ("wire_035_lunderquist", 158.4),
];
/// Diameter of the wires, mm.
const DIAMETER_MM: f64 = 0.889;
/// Length that the figure shows, mm.
const SHOWN_MM: f64 = 320.0;

/// Bends the bodies of [`WIRES`], given with their names in the same order.
///
/// # Errors
/// A device that is too short.
pub fn study(wires: &[(String, Device)]) -> Result<Compared> {
    let test = BendTest::default();
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for ((name, device), (_, modulus_gpa)) in wires.iter().zip(WIRES) {
        let expected = 1e3 * modulus_gpa * std::f64::consts::PI * DIAMETER_MM.powi(4) / 64.0;
        let body_mm = 0.6 * device.length_mm();
        let found = test.rigidity(device, body_mm)?;
        rows.push(Row::relative(name, "rigidity of the body, N·mm²", found.rigidity_nmm2, expected, 5e-3));
        let places = (0..100).map(|k| 0.5 * test.span_mm + SHOWN_MM * f64::from(k) / 100.0);
        let along = places
            .filter(|at_mm| test.reaches(device, *at_mm))
            .map(|at_mm| test.rigidity(device, at_mm).map(|found| [found.from_tip_mm, found.rigidity_nmm2]));
        lines.push(Line { name: name.clone(), kind: Kind::Computed, points: along.collect::<Result<_>>()? });
    }
    Ok(Compared {
        rows,
        lines,
        axes: ["distance from the tip, mm", "rigidity F L³/(48 δ), N·mm²"],
        is_logarithmic: true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_published_modulus_is_read_and_another_is_seen() {
        let wire = |ei: f64| ("wire".to_owned(), Device::uniform(1500.0, 0.5 * DIAMETER_MM, ei).unwrap());
        assert!(study(&[wire(291.3)]).unwrap().rows[0].pass);
        assert!(!study(&[wire(300.0)]).unwrap().rows[0].pass);
    }
}
