//! Every reader of files that a library function reaches, on bytes: what the fuzz targets and the test of damaged files call.

use std::path::Path;

use endowire_assess::{Record, Subject};
use endowire_core::device::Device;
use endowire_core::insertion::{Sheath, Simulation, State};
use endowire_core::statics::{StaticCase, StaticProblem};
use endowire_core::vessel::{
    CentrelineTree, GeneratedWall, LabelOptions, LabelSurface, NoStore, Resolution, SurfaceMesh, anatomy,
};
use endowire_core::{Error, Result, Vec3};
use endowire_lab::surfaces::Sidecar;
use endowire_methods::Scene;
use endowire_sweep::Sweep;
use endowire_viewer::{Backend, CtSpec, Renderer, View, ViewSpec, read_label_map};

fn surface(bytes: &[u8], name: &str) -> Result<()> {
    SurfaceMesh::from_bytes(bytes, Path::new(name), 1.0).map(drop)
}

/// A surface as OBJ.
///
/// # Errors
/// As [`SurfaceMesh::from_bytes`].
pub fn obj(bytes: &[u8]) -> Result<()> {
    surface(bytes, "a.obj")
}

/// A surface as STL, of either kind.
///
/// # Errors
/// As [`SurfaceMesh::from_bytes`].
pub fn stl(bytes: &[u8]) -> Result<()> {
    surface(bytes, "a.stl")
}

/// A surface as PLY, of any kind.
///
/// # Errors
/// As [`SurfaceMesh::from_bytes`].
pub fn ply(bytes: &[u8]) -> Result<()> {
    surface(bytes, "a.ply")
}

/// A surface of VTK's XML format.
///
/// # Errors
/// As [`SurfaceMesh::from_bytes`].
pub fn vtp(bytes: &[u8]) -> Result<()> {
    surface(bytes, "a.vtp")
}

/// A surface of VTK's older format, of either kind.
///
/// # Errors
/// As [`SurfaceMesh::from_bytes`].
pub fn vtk(bytes: &[u8]) -> Result<()> {
    surface(bytes, "a.vtk")
}

/// A session that is assessed.
///
/// # Errors
/// As [`Record::from_session`].
pub fn session(bytes: &[u8]) -> Result<()> {
    Record::from_session(bytes, Path::new("a.session.json")).map(drop)
}

/// A training subject; the files that it names are not opened.
///
/// # Errors
/// As [`Subject::from_toml`].
pub fn subject(bytes: &[u8]) -> Result<()> {
    Subject::from_toml(text(bytes)?, Path::new("a.toml")).map(drop)
}

/// A table of a centre-line tree.
///
/// # Errors
/// As [`CentrelineTree::from_bytes`].
pub fn centreline(bytes: &[u8]) -> Result<()> {
    CentrelineTree::from_bytes(bytes, Path::new("a.csv")).map(drop)
}

/// A scene with what is pushed and its script; the files that it names are not opened.
///
/// # Errors
/// As [`Scene::from_toml`], `SceneOf::stack` and `SceneOf::steps`.
pub fn scene(bytes: &[u8]) -> Result<()> {
    let scene = Scene::from_toml(text(bytes)?, Path::new("a.toml"))?;
    if scene.device.iter().any(|device| device.file.is_some())
        || scene.instrument.iter().any(|i| i.file.is_some())
    {
        return Ok(());
    }
    scene.steps(&scene.stack()?, &NoStore).map(drop)
}

/// A case of rods, up to the problem that would be solved.
///
/// # Errors
/// As [`StaticCase::from_toml`] and [`StaticProblem::new`].
pub fn rod_case(bytes: &[u8]) -> Result<()> {
    StaticProblem::new(&StaticCase::from_toml(text(bytes)?, Path::new("a.toml"))?).map(drop)
}

/// What is said of a surface in the file beside it.
///
/// # Errors
/// As [`Sidecar::from_toml`].
pub fn sidecar(bytes: &[u8]) -> Result<()> {
    Sidecar::from_toml(text(bytes)?, Path::new("a.toml")).map(drop)
}

/// A sweep; its scene is one of the assets.
///
/// # Errors
/// As [`Sweep::from_toml`].
pub fn sweep(bytes: &[u8]) -> Result<()> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/scenes/a.toml"));
    Sweep::from_toml(text(bytes)?, path).map(drop)
}

/// The state of a simulation, restored into one of the same scene.
///
/// # Errors
/// What is no state, and as [`Simulation::restore`].
pub fn state(simulation: &mut Simulation, bytes: &[u8]) -> Result<()> {
    let state: State =
        postcard::from_bytes(bytes).map_err(|e| Error::content(Path::new("state"), e.to_string()))?;
    simulation.restore(&state)
}

/// The simulation that [`state`] restores into: a wire of 100 mm in a coarse straight tube.
///
/// # Errors
/// None, unless what the simulation is made of is refused.
pub fn simulation() -> Result<Simulation> {
    let tree = anatomy::tree("straight_tube")
        .ok_or_else(|| Error::parameter("vessel", "straight_tube", "is not built in"))?;
    let made = GeneratedWall::new(&tree, Resolution::Triangles(1_000))?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
    Simulation::builder(made.wall, Device::uniform(100.0, 0.4, 10.0)?, sheath).build()
}

/// A tomogram (NIfTI of either format), and rays through it.
///
/// # Errors
/// As [`Renderer::new`], and a file that cannot be written for it.
pub fn tomogram(bytes: &[u8]) -> Result<()> {
    let name = format!("endowire-{}-{:?}.nii", std::process::id(), std::thread::current().id());
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, bytes).map_err(|e| Error::content(&path, e.to_string()))?;
    let read = rays_through(&path);
    // What is left in the folder of temporary files is nobody's loss.
    let _ = std::fs::remove_file(&path);
    read
}

/// A label map (NIfTI of either format), and the surface of label 1.
///
/// # Errors
/// As [`read_label_map`] and [`LabelSurface::of`], and a file that cannot be written for it.
pub fn label_map(bytes: &[u8]) -> Result<()> {
    let name = format!("endowire-{}-{:?}-labels.nii", std::process::id(), std::thread::current().id());
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, bytes).map_err(|e| Error::content(&path, e.to_string()))?;
    let made = read_label_map(&path).and_then(|map| {
        LabelSurface::of(&map, &LabelOptions::of(&[1])).map_err(|e| Error::content(&path, e.to_string()))
    });
    let _ = std::fs::remove_file(&path);
    made.map(drop)
}

/// A tomogram of two slices (DICOM), one in each half of the bytes, and rays through it.
///
/// # Errors
/// As [`Renderer::new`], and files that cannot be written for it.
pub fn slices(bytes: &[u8]) -> Result<()> {
    let name = format!("endowire-{}-{:?}", std::process::id(), std::thread::current().id());
    let folder = std::env::temp_dir().join(name);
    let written = std::fs::create_dir_all(&folder).and_then(|()| {
        let (a, b) = bytes.split_at(bytes.len() / 2);
        std::fs::write(folder.join("a.dcm"), a).and_then(|()| std::fs::write(folder.join("b.dcm"), b))
    });
    written.map_err(|e| Error::content(&folder, e.to_string()))?;
    let read = rays_through(&folder);
    let _ = std::fs::remove_dir_all(&folder);
    read
}

fn rays_through(file: &Path) -> Result<()> {
    let (views, backend) = (vec![View::Fluoro], Backend::Cpu);
    let mut spec = ViewSpec { views, backend, size_px: [16, 12], ..ViewSpec::default() };
    spec.patient.ct = Some(CtSpec { file: file.into(), offset_mm: [0.0; 3] });
    let wall = SurfaceMesh::cuboid(Vec3::zeros(), Vec3::repeat(10.0), 10.0);
    Renderer::new(&spec, &wall).and_then(|mut renderer| renderer.path_lengths(&[]).map(drop))
}

fn text(bytes: &[u8]) -> Result<&str> {
    std::str::from_utf8(bytes).map_err(|e| Error::content(Path::new("a.toml"), format!("is no text: {e}")))
}
