//! The table under a generated body: a plate of carbon fibre, and a rail of aluminium at each side.
//!
//! The plate is part of the skin's surface, as what lets through as much of soft tissue, and the rails part of the bones.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::loft;
use super::trunk::Trunk;

/// Distance of the plate behind the back: a mattress.
const MATTRESS_MM: f64 = 30.0;
/// Soft tissue that absorbs as much as the plate: that of a millimetre of aluminium (IEC 60601-1-3 allows twice that).
const PLATE_MM: f64 = 4.0;
/// Half width and half height of a rail's core.
const RAIL_MM: [f64; 2] = [3.0, 12.0];

impl Trunk {
    /// Adds the plate to the skin and the rails to the bones.
    pub(super) fn table(&self, width_mm: f64, skin: &mut SurfaceMesh, bones: &mut SurfaceMesh) {
        let front = self.back_y() + MATTRESS_MM;
        let [x, y] = [self.spine[0], front + PLATE_MM / 2.0];
        self.along(skin, [x, y], [width_mm / 2.0, PLATE_MM / 2.0]);
        for side in [-1.0, 1.0] {
            self.along(bones, [x + side * (width_mm / 2.0 + RAIL_MM[0] + 1.0), y], RAIL_MM);
        }
    }

    /// Adds a bar of this half width and half height along the body, from below its lower end to above its head.
    fn along(&self, mesh: &mut SurfaceMesh, [x, y]: [f64; 2], half: [f64; 2]) {
        let ring = |z: f64| -> Vec<Vec3> {
            let corners = [[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
            corners.iter().map(|[u, v]| Vec3::new(x + u * half[0], y + v * half[1], z)).collect()
        };
        let [low, high] = self.heights();
        loft(mesh, &[ring(low), ring(0.5 * (low + high)), ring(high)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::check_closed;
    use crate::patient::Body;
    use crate::spec::TorsoSpec;

    #[test]
    fn a_body_on_a_table_has_its_plate_and_rails_behind_its_back() {
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::new(-40.0, -50.0, 0.0), Vec3::new(40.0, 30.0, 300.0)],
            triangles: vec![],
        };
        let [with, without] = [Some(450.0), None]
            .map(|table_mm| Body::new(&TorsoSpec { table_mm, ..TorsoSpec::default() }, &wall));
        for (mesh, bare, part_mm2) in
            [(&with.skin, &without.skin, 1800.0), (&with.bones, &without.bones, 288.0)]
        {
            check_closed(mesh).unwrap();
            let (low, high) = without.skin.bounds_mm().unwrap();
            let length_mm = high.z - low.z;
            let more = mesh.signed_volume_mm3() - bare.signed_volume_mm3();
            assert!((more / (part_mm2 * length_mm) - 1.0).abs() < 0.01, "{more} {length_mm}");
        }
        let back = |body: &Body| body.skin.bounds_mm().unwrap().1.y;
        assert!(back(&with) > back(&without));
    }
}
