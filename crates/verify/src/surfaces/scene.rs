//! A cell as a scene, to be run, rendered and modified separately.

use std::fmt::Write;

use super::{Cell, Surface};
use endowire_core::Result;

impl Cell {
    /// The scene file of the cell, with which `endowire run` repeats the insertion.
    ///
    /// # Errors
    /// A wire that cannot be made.
    pub fn scene(&self, surface: &Surface) -> Result<String> {
        let place = &surface.places[self.wire];
        let path = std::path::absolute(&surface.path).unwrap_or_else(|_| surface.path.clone());
        let mut text = String::new();
        let mut line = |line: std::fmt::Arguments<'_>| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{line}");
        };
        let list = |v: [f64; 3]| format!("[{:?}, {:?}, {:?}]", v[0], v[1], v[2]);
        line(format_args!("# {}", self.name_in(surface)));
        line(format_args!("name = \"surface_cell\"\n\n[vessel]"));
        line(format_args!("file = {}", toml::Value::from(path.to_string_lossy().into_owned())));
        line(format_args!("unit_mm = {:?}", surface.frame.unit_mm));
        if let Some(axes) = surface.frame.axes {
            line(format_args!("axes = {:?}", axes.name()));
        }
        line(format_args!("\n[vessel.wall]"));
        line(format_args!(
            "modulus_n_per_mm2 = {:?}\nfriction = {:?}",
            self.modulus_n_per_mm2, self.friction
        ));
        for section in place.wire.device(surface.length_mm)?.sections() {
            line(format_args!("\n[[device.section]]"));
            line(format_args!("length_mm = {:?}\nradius_mm = {:?}", section.length_mm, section.radius_mm));
            line(format_args!("bending_stiffness_nmm2 = {:?}", section.bending_stiffness_nmm2));
            let [a, b] = section.rest_curvature_per_mm;
            if (a, b) != (0.0, 0.0) {
                line(format_args!("rest_curvature_per_mm = [{a:?}, {b:?}]"));
            }
        }
        line(format_args!("\n[sheath]\nposition_mm = {}", list(place.sheath.position_mm.into())));
        line(format_args!("direction = {}", list(place.sheath.direction.into())));
        if let Some(towards) = place.sheath.bends_towards {
            line(format_args!("bends_towards = {}", list(towards.into())));
        }
        line(format_args!("\n[method]\nname = \"kirchhoff\"\nelement_mm = {:?}", self.element_mm));
        line(format_args!("\n[[script]]"));
        let script = self.script(surface);
        for (key, value) in [
            ("advance_mm", script.advance_mm),
            ("rotate_deg", script.rotate_deg),
            ("step_mm", script.step_mm),
            ("step_deg", script.step_deg),
        ] {
            if let Some(value) = value {
                line(format_args!("{key} = {value:?}"));
            }
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::surface::straight_tube;
    use crate::surfaces::{cells, surfaces_in};
    use endowire_core::Vec3;
    use endowire_core::insertion::script_commands;
    use endowire_core::scene::Scene;
    use endowire_core::vessel::{NoStore, PatientAxes, SurfaceMesh};

    /// A mesh in VTK's legacy format.
    fn vtk(mesh: &SurfaceMesh) -> String {
        let mut text = "# vtk DataFile Version 3.0\na tube\nASCII\nDATASET POLYDATA\n".to_owned();
        text += &format!("POINTS {} double\n", mesh.vertices_mm.len());
        mesh.vertices_mm.iter().for_each(|v| text += &format!("{} {} {}\n", v.x, v.y, v.z));
        text += &format!("POLYGONS {} {}\n", mesh.triangles.len(), 4 * mesh.triangles.len());
        mesh.triangles.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
        text
    }

    #[test]
    fn the_scene_of_a_cell_is_the_cell() {
        let tube = straight_tube(30.0);
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("tube.vtk"), vtk(&tube)).unwrap();
        std::fs::write(folder.path().join("tube.toml"), "axes = \"RAS\"").unwrap();
        let surface = Surface::read(&surfaces_in(folder.path()).unwrap()[0], &NoStore).unwrap();
        // x and y of LPS have the opposite sign: front and back are swapped.
        let turned =
            |mesh: &SurfaceMesh| mesh.vertices_mm.iter().map(|v| Vec3::new(-v.x, -v.y, v.z)).collect();
        let [given, there]: [Vec<Vec3>; 2] = [turned(&tube), surface.wall.mesh().vertices_mm.clone()];
        let apart_mm =
            |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart_mm(&given, &there) < 1e-9 && apart_mm(&tube.vertices_mm, &there) > 1.0);
        for cell in cells(surface.places.len(), false) {
            let path = folder.path().join("cell.toml");
            std::fs::write(&path, cell.scene(&surface).unwrap()).unwrap();
            let scene = Scene::read(&path).unwrap();
            assert_eq!(scene.vessel.axes, Some(PatientAxes::Ras));
            let place = &surface.places[cell.wire];
            let device = scene.device().unwrap();
            assert_eq!(device, place.wire.device(surface.length_mm).unwrap());
            let sheath = scene.sheath(&surface.wall).unwrap();
            assert!((sheath.direction - place.sheath.direction).norm() < 1e-15);
            assert_eq!(sheath.position_mm, place.sheath.position_mm);
            assert_eq!(scene.vessel.wall, cell.properties());
            let list = scene.commands(&device).unwrap();
            assert_eq!(list, script_commands(&[cell.script(&surface)], &device).unwrap());
            assert!((list[0].advance_mm - cell.increment_mm).abs() < 1e-12);
            assert!((list[0].rotate_rad.to_degrees() - cell.turn_deg).abs() < 1e-9);
        }
    }
}
