//! Electrodes of an ECG on the skin of the chest, with their leads.
//!
//! They are part of the bones: a stud of metal as what casts the same shadow in compact bone.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::{ellipsoid, smooth, tube};
use super::trunk::Trunk;

/// Distance outside the chest's inner surface, just under the skin's: what is outside the body casts no shadow.
const OUT_MM: f64 = 19.0;
/// Half axes of a stud, and the radius of a lead's core, mm.
const STUD_MM: [f64; 3] = [3.0, 2.6, 3.0];
const LEAD_MM: f64 = 0.5;
/// Electrodes: the side, the angle from the back, and the vertebra at whose height they are.
const PLACES: [(f64, f64, i32); 4] = [(-1.0, 2.35, 2), (1.0, 2.3, 2), (1.0, 1.95, 11), (-1.0, 2.0, 12)];

impl Trunk {
    /// Adds the electrodes, with leads that go down along the skin and out of most pictures.
    pub(super) fn electrodes(&self, mesh: &mut SurfaceMesh) {
        for (number, (side, angle, vertebra)) in (0..).zip(PLACES) {
            let top = self.vertebra(vertebra);
            let at = |down: f64, turn: f64| self.chest_wall(side, top - down, angle + turn, OUT_MM);
            ellipsoid(mesh, at(0.0, 0.0), Vec3::from(STUD_MM));
            // No two leads lie alike.
            let bend = 0.06 * f64::from(number % 3) - 0.05;
            let lead: Vec<(Vec3, f64)> = (0..=9)
                .map(|k| {
                    let part = f64::from(k) / 9.0;
                    let wave = bend * libm::sin(7.0 * part + f64::from(number));
                    (at(4.0 + 330.0 * part, wave - 0.25 * part), LEAD_MM)
                })
                .collect();
            tube(mesh, &smooth(&lead, 0.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::check_closed;
    use crate::spec::TorsoSpec;

    #[test]
    fn electrodes_are_closed_and_on_the_front_of_the_chest() {
        let vertices_mm = vec![Vec3::new(-40.0, -50.0, 0.0), Vec3::new(40.0, 30.0, 300.0)];
        let trunk = Trunk::new(&TorsoSpec::default(), &SurfaceMesh { vertices_mm, triangles: vec![] });
        let mut mesh = SurfaceMesh::default();
        trunk.electrodes(&mut mesh);
        check_closed(&mesh).unwrap();
        // Four studs of 0.1 ml, and leads.
        let ml = mesh.signed_volume_mm3() / 1000.0;
        assert!(ml > 0.4 && ml < 2.0, "{ml}");
        assert!(mesh.vertices_mm.iter().all(|v| v.y < trunk.middle_y + 40.0));
    }
}
