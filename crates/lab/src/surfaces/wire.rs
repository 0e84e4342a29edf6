//! The wires of the matrix.

use endowire_core::Result;
use endowire_core::device::{Device, Section};

/// A guidewire: a stiff shaft that tapers to a floppy, curved tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    /// Outer radius, mm.
    pub radius_mm: f64,
    /// Bending stiffness of the shaft, N·mm².
    pub shaft_nmm2: f64,
    /// Bending stiffness of the floppy part behind the curve, N·mm².
    pub floppy_nmm2: f64,
    /// Bending stiffness of the curved tip, N·mm².
    pub tip_nmm2: f64,
    /// Length of the curved tip, mm.
    pub curved_mm: f64,
}

/// Radius of the curve of a tip, mm: a J of 3 mm.
const CURVE_MM: f64 = 3.0;
/// Length of the floppy part behind the curve, mm.
const FLOPPY_MM: f64 = 25.0;
/// Length of the taper from floppy to stiff, mm.
const TAPER_MM: f64 = 60.0;
/// Number of its sections, each stiffer than the one before by the same factor.
const TAPER_SECTIONS: usize = 6;

/// A 0.014″ coronary or neurovascular wire: a solid steel shaft of 0.36 mm has EI = 158 N·mm² (E = 200 kN/mm², I =
/// πr⁴/4); its tip is a coil on a thin core with a bend of 95°; and a 0.035″ J-wire: a coil on a core with a J of
/// 135°.
pub const WIRES: [Wire; 2] = [
    Wire { radius_mm: 0.178, shaft_nmm2: 150.0, floppy_nmm2: 1.0, tip_nmm2: 0.3, curved_mm: 5.0 },
    Wire { radius_mm: 0.445, shaft_nmm2: 500.0, floppy_nmm2: 5.0, tip_nmm2: 5.0, curved_mm: 7.0 },
];

impl Wire {
    /// A wire of another radius: built like the one of [`WIRES`] nearest to it, with the stiffness of a solid wire,
    /// proportional to the fourth power of the radius.
    pub(crate) fn of_radius(radius_mm: f64) -> Self {
        let away = |w: &Self| (w.radius_mm / radius_mm).ln().abs();
        let [thin, thick] = WIRES;
        let like = if away(&thin) <= away(&thick) { thin } else { thick };
        let scale = (radius_mm / like.radius_mm).powi(4);
        Self {
            radius_mm,
            shaft_nmm2: scale * like.shaft_nmm2,
            floppy_nmm2: scale * like.floppy_nmm2,
            tip_nmm2: scale * like.tip_nmm2,
            curved_mm: like.curved_mm,
        }
    }

    /// Diameter in inches, as wires are sold: `0.014`.
    pub fn name(&self) -> String {
        format!("{:.3}", 2.0 * self.radius_mm / 25.4)
    }

    /// The device with this total length, including its soft end.
    ///
    /// # Errors
    /// A length out of range.
    pub fn device(&self, length_mm: f64) -> Result<Device> {
        let straight = |length: f64, stiffness: f64| Section::straight(length, self.radius_mm, stiffness);
        let curvature = [1.0 / CURVE_MM.max(self.radius_mm), 0.0];
        let mut sections = vec![
            Section { rest_curvature_per_mm: curvature, ..straight(self.curved_mm, self.tip_nmm2) },
            straight(FLOPPY_MM, self.floppy_nmm2),
        ];
        let share = |k: usize| k as f64 / (TAPER_SECTIONS + 1) as f64;
        sections.extend((1..=TAPER_SECTIONS).map(|k| {
            let stiffness = self.floppy_nmm2 * (self.shaft_nmm2 / self.floppy_nmm2).powf(share(k));
            straight(TAPER_MM / TAPER_SECTIONS as f64, stiffness)
        }));
        sections.push(straight(length_mm, self.shaft_nmm2));
        Device::new(sections)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wires_are_named_in_inches_and_stiffen_towards_the_shaft() {
        assert_eq!(WIRES.map(|w| w.name()), ["0.014", "0.035"]);
        for wire in WIRES {
            assert_eq!(Wire::of_radius(wire.radius_mm), wire);
            let device = wire.device(100.0).unwrap();
            assert!(device.is_shaped() && device.length_mm() > 100.0);
            let stiffness: Vec<f64> = device.sections().iter().map(|s| s.bending_stiffness_nmm2).collect();
            assert!(stiffness.is_sorted(), "{stiffness:?}");
        }
        let between = Wire::of_radius(0.23);
        assert!(between.shaft_nmm2 > WIRES[0].shaft_nmm2 && between.curved_mm == WIRES[0].curved_mm);
    }
}
