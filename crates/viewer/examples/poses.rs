//! Eight poses of the C-arm about each of three anatomies, a sheet each, written as PNG files.
//!
//! `cargo run --release -p endowire-viewer --example poses -- [FOLDER] [SIDE OF A FRAME IN PIXELS]`

use std::error::Error;
use std::path::{Path, PathBuf};

use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_viewer::{Backend, Renderer, TorsoSpec, View, ViewSpec};

const POSES: [&str; 8] =
    ["AP", "RAO 30", "LAO 40", "LAO 90", "CRA 30", "CAU 30", "RAO 30 CAU 30", "LAO 45 CRA 25"];

/// Frames of a sheet's row.
const COLUMNS: usize = 4;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder: PathBuf = arguments.next().map_or_else(std::env::temp_dir, Into::into);
    let side: u32 = arguments.next().map_or(Ok(256), |text| text.parse())?;
    let vessels = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels");
    // The arch alone in the field; the arteries of the liver, below the diaphragm; the neck above the arch.
    let chest = TorsoSpec::default();
    let abdomen = TorsoSpec { diaphragm_mm: Some(150.0), ..TorsoSpec::default() };
    for (name, vessel, torso, field_mm, isocentre_mm) in [
        ("chest", "aortic_arch.stl", &chest, 420.0, [-17.0, -30.0, 170.0]),
        ("abdomen", "hepatic.stl", &abdomen, 420.0, [0.0, -20.0, 60.0]),
        ("pelvis", "hepatic.stl", &abdomen, 440.0, [0.0, -20.0, -110.0]),
        ("neck", "aortic_arch.stl", &chest, 420.0, [-17.0, -20.0, 390.0]),
    ] {
        let wall = Wall::from_surface(&SurfaceMesh::read(&vessels.join(vessel), 1.0)?)?;
        let sheet = SheetOf { wall: &wall, torso, field_mm, isocentre_mm, side };
        sheet.draw(&folder.join(format!("poses_{name}.png")))?;
    }
    println!("written to {}", folder.display());
    Ok(())
}

/// What all frames of a sheet have in common.
struct SheetOf<'a> {
    wall: &'a Wall,
    torso: &'a TorsoSpec,
    field_mm: f64,
    isocentre_mm: [f64; 3],
    side: u32,
}

impl SheetOf<'_> {
    fn draw(&self, path: &Path) -> Result<(), Box<dyn Error>> {
        let side = self.side as usize;
        let [width, height] = [COLUMNS * side, POSES.len() / COLUMNS * side];
        let mut sheet = vec![0; width * height];
        for (number, pose) in POSES.iter().enumerate() {
            let mut spec = ViewSpec {
                size_px: [self.side; 2],
                views: vec![View::Fluoro],
                backend: Backend::Cpu,
                ..ViewSpec::default()
            };
            spec.c_arm.pose = Some(pose.parse()?);
            spec.c_arm.field_mm = Some(self.field_mm);
            spec.c_arm.isocentre_mm = Some(self.isocentre_mm);
            spec.patient.torso = Some(self.torso.clone());
            spec.xray.contrast_fraction = 0.04;
            let Some(frame) = Renderer::of_wall(&spec, self.wall)?.render(&[])?.fluoro else { continue };
            let [left, top] = [number % COLUMNS * side, number / COLUMNS * side];
            for (row, line) in frame.data().chunks_exact(side).enumerate() {
                let at = (top + row) * width + left;
                sheet[at..at + side].copy_from_slice(line);
            }
        }
        let file = std::io::BufWriter::new(std::fs::File::create(path)?);
        let mut encoder = png::Encoder::new(file, width as u32, height as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header()?.write_image_data(&sheet)?;
        Ok(())
    }
}
