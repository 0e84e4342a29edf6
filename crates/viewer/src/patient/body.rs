//! A generated body of closed surfaces: skin, bones and air, at adult sizes. It is not anatomically exact: it gives
//! frames the background that eyes and networks expect.
//!
//! Bone is a cortical shell around marrow with a fraction of bone: its length on a ray is that of the outer surface
//! minus (1 − fraction) of the inner one.

use endowire_core::vessel::SurfaceMesh;

use super::loft::loft;
use super::motion::BodyMotion;
use super::texture::Texture;
use super::trunk::Trunk;
use crate::spec::TorsoSpec;

/// Thickness of cortical shells, mm.
const CORTEX_MM: f64 = 1.0;
/// Fraction of bone in marrow: thoracic vertebrae have about 150 mg of mineral per cm³, a tenth of cortical bone.
const MARROW_SHARE: f64 = 0.1;

/// Closed surfaces of a body.
#[derive(Debug, Clone, Default)]
pub(crate) struct Body {
    pub(crate) skin: SurfaceMesh,
    pub(crate) bones: SurfaceMesh,
    pub(crate) marrow: SurfaceMesh,
    pub(crate) lungs: SurfaceMesh,
    pub(crate) texture: Texture,
    pub(crate) motion: BodyMotion,
}

impl Body {
    /// Fraction of the marrow's length that is not bone.
    pub(crate) const NOT_BONE: f64 = 1.0 - MARROW_SHARE;

    /// A body around a vessel with this wall.
    pub(crate) fn new(spec: &TorsoSpec, wall: &SurfaceMesh) -> Self {
        let trunk = Trunk::new(spec, wall);
        let mut body = Self { texture: trunk.texture(), motion: trunk.motion(spec), ..Self::default() };
        loft(&mut body.skin, &trunk.skin());
        for (mesh, inset) in [(&mut body.bones, 0.0), (&mut body.marrow, CORTEX_MM)] {
            if spec.spine {
                trunk.spine(mesh, inset);
                trunk.pelvis(mesh, inset);
                trunk.head(mesh, inset);
            }
            if spec.ribs {
                trunk.ribs(mesh, inset);
                trunk.cartilages(mesh);
                trunk.girdle(mesh, inset);
            }
        }
        if spec.electrodes {
            trunk.electrodes(&mut body.bones);
        }
        if let Some(width_mm) = spec.table_mm {
            trunk.table(width_mm, &mut body.skin, &mut body.bones);
        }
        if spec.lungs {
            trunk.air(&mut body.lungs);
        }
        body
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;

    use super::*;
    use crate::cpu::check_closed;

    /// The corners of an artery's box.
    fn vessel() -> SurfaceMesh {
        let vertices_mm = vec![Vec3::new(-40.0, -50.0, 0.0), Vec3::new(40.0, 30.0, 300.0)];
        SurfaceMesh { vertices_mm, triangles: vec![] }
    }

    fn body() -> Body {
        Body::new(&TorsoSpec::default(), &vessel())
    }

    #[test]
    fn every_surface_is_closed_and_outward_and_has_an_adults_volume() {
        let body = body();
        for (name, mesh, litres) in [
            ("skin", &body.skin, [35.0, 65.0]),
            ("bones", &body.bones, [2.0, 5.0]),
            ("marrow", &body.marrow, [1.0, 3.5]),
            ("lungs", &body.lungs, [2.0, 7.0]),
        ] {
            check_closed(mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
            let volume = mesh.signed_volume_mm3() / 1e6;
            assert!(volume > litres[0] && volume < litres[1], "{name}: {volume} l");
        }
        assert!(body.marrow.signed_volume_mm3() < 0.9 * body.bones.signed_volume_mm3());
    }

    #[test]
    fn bodies_of_all_sizes_that_a_scene_may_give_are_made_and_closed() {
        for width_mm in [100.0, 105.0, 110.0, 113.0, 120.0, 330.0, 800.0] {
            for depth_mm in [80.0, 215.0, 600.0] {
                for (spine_mm, diaphragm_mm) in [
                    (None, None),
                    (Some([500.0, -500.0]), Some(-400.0)),
                    (Some([-500.0, 500.0]), Some(900.0)),
                ] {
                    let spec =
                        TorsoSpec { width_mm, depth_mm, spine_mm, diaphragm_mm, ..TorsoSpec::default() };
                    let body = Body::new(&spec, &vessel());
                    for mesh in [&body.skin, &body.bones, &body.marrow, &body.lungs] {
                        assert!(mesh.vertices_mm.iter().all(|v| v.iter().all(|x| x.is_finite())), "{spec:?}");
                    }
                    check_closed(&body.skin).unwrap_or_else(|e| panic!("{spec:?}: {e}"));
                }
            }
        }
    }

    #[test]
    fn the_back_of_the_head_is_inside_its_skin() {
        let trunk = Trunk::new(&TorsoSpec::default(), &vessel());
        let mut head = SurfaceMesh { vertices_mm: vec![], triangles: vec![] };
        trunk.head(&mut head, 0.0);
        // Behind the mastoids.
        let back = head.vertices_mm.iter().filter(|place| place.y > trunk.spine_y(place.z) + 20.0);
        let back: Vec<&Vec3> = back.collect();
        let outside = back.iter().filter(|place| !trunk.has_in_head(place)).count();
        assert!(back.len() > 100 && outside == 0, "{outside} of {}", back.len());
    }

    #[test]
    fn parts_of_the_body_can_be_left_out() {
        let spec =
            TorsoSpec { spine: false, ribs: false, lungs: false, electrodes: false, ..TorsoSpec::default() };
        let body = Body::new(&spec, &vessel());
        assert!(body.bones.triangles.is_empty() && body.lungs.triangles.is_empty());
        assert!(!body.skin.triangles.is_empty());
    }
}
