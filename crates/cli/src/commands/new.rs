//! `endowire new`: creates a folder with a scene to start from.

use std::path::{Path, PathBuf};

use endowire_core::device::DeviceFile;
use endowire_core::vessel::{
    Lumen, NoStore, Opening, Resolution, SurfaceFrame, SurfaceMesh, SweptVessel, Wall, anatomy, wall_hints,
};

use crate::args::NewArgs;
use crate::failure::Failure;
use crate::output::{tell, whole};

/// A copy of `assets/devices/wire_035_hydrophilic_angled.toml`; a test compares them.
const WIRE: &str = include_str!("../../templates/wire.toml");
/// Number of triangles of a built-in vessel.
const TRIANGLES: usize = 20_000;

/// A vessel for the new scene.
struct Vessel {
    /// Lines of the `[vessel]` table.
    table: String,
    wall: Wall,
    pose: &'static str,
}

/// Creates the folder.
pub(crate) fn new(args: &NewArgs) -> Result<(), Failure> {
    let folder = &args.dir;
    let refuse = |what: String| Failure::Input(format!("{}: {what}", folder.display()));
    let holds = std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if holds {
        return Err(refuse("holds files: name a folder that is not there, or empty".to_owned()));
    }
    let device = match &args.device {
        Some(path) => {
            DeviceFile::read(path)?;
            std::fs::read_to_string(path).map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?
        }
        None => WIRE.to_owned(),
    };
    std::fs::create_dir_all(folder).map_err(|e| refuse(e.to_string()))?;
    let vessel = vessel(&args.vessel, args.frame.into(), folder)?;
    let opening = vessel.wall.inlet().ok_or_else(|| {
        Failure::Input(format!("{}: has no opening for a sheath: cut its ends off", args.vessel.display()))
    })?;
    let name =
        folder.file_name().map_or_else(|| "scene".to_owned(), |name| name.to_string_lossy().into_owned());
    let write = |file: &str, text: &str| {
        let path = folder.join(file);
        whole::write_bytes(&path, text.as_bytes()).map_err(|e| Failure::write(&path, &e))
    };
    write("device.toml", &device)?;
    write("scene.toml", &scene(&name, &vessel, opening))?;
    let scene = folder.join("scene.toml");
    let scene = scene.display();
    tell(format_args!("made {scene}; now:\n  endowire run {scene}\n  endowire play {scene}"));
    Ok(())
}

/// Copies a vessel or generates a built-in one.
fn vessel(wanted: &Path, frame: SurfaceFrame, folder: &Path) -> Result<Vessel, Failure> {
    let built_in =
        wanted.to_str().and_then(|name| Some((anatomy::tree(name)?, anatomy::description(name)?, name)));
    if let Some((tree, about, name)) = built_in {
        tree.write(&folder.join("vessel.csv"), about)?;
        let pose = if name.starts_with("aortic_arch") { "LAO 40" } else { "AP" };
        let table = format!(
            "tree = \"vessel.csv\"       # a centre line with radii, and names of targets\ntriangles = {TRIANGLES}"
        );
        // The numbers of openings are the same without a mesh.
        let lumen = Lumen::from(SweptVessel::new(tree, Resolution::Triangles(TRIANGLES))?);
        return Ok(Vessel { table, wall: lumen.into_wall(&NoStore)?, pose });
    }
    if !wanted.exists() {
        let names = anatomy::NAMES.join(", ");
        return Err(Failure::Input(format!(
            "--vessel {}: is no file and no built-in anatomy: {names}",
            wanted.display()
        )));
    }
    let wall = Wall::from_surface(&SurfaceMesh::read(wanted, frame)?)?;
    for hint in wall_hints(&wall, frame.unit_mm)? {
        tell(format_args!("{}: {hint}", wanted.display()));
    }
    let mut file = PathBuf::from("vessel");
    file.set_extension(wanted.extension().unwrap_or_default());
    let copied = folder.join(&file);
    std::fs::copy(wanted, &copied).map_err(|e| Failure::write(&copied, &e))?;
    let mut table = format!("file = {:?}", file.display().to_string());
    if frame.unit_mm != 1.0 {
        table += &format!("\nunit_mm = {:?}", frame.unit_mm);
    }
    if let Some(axes) = frame.axes {
        table += &format!("\naxes = {:?}", axes.name());
    }
    Ok(Vessel { table, wall, pose: "AP" })
}

fn scene(name: &str, vessel: &Vessel, entry: &Opening) -> String {
    let openings: Vec<String> = vessel
        .wall
        .openings()
        .iter()
        .map(|one| {
            let at = one.centre_mm;
            format!(
                "#   {}: radius {:.1} mm at [{:.0}, {:.0}, {:.0}]",
                one.index, one.radius_mm, at.x, at.y, at.z
            )
        })
        .collect();
    format!(
        r#"# A device in a vessel. `endowire run` carries the script out, `endowire play` puts the device into your hands.
name = {name:?}
seed = 1

[vessel]
{table}

[vessel.wall]
modulus_n_per_mm2 = 1.0
friction = 0.05

[device]
file = "device.toml"

# Openings of the vessel:
{openings}
[sheath]
opening = {opening}
depth_mm = 2.0

[method]
name = "kirchhoff"
element_mm = 4.0

[[script]]                # what the hand does: in by 60 mm, a turn, and on
advance_mm = 60.0
step_mm = 2.0

[[script]]
rotate_deg = 90.0

[[script]]
advance_mm = 30.0
step_mm = 2.0

[view]
size_px = [512, 512]
views = ["3d", "fluoro"]
every = 20                # a frame each so many steps, and of the last

[view.c_arm]
pose = "{pose}"

[view.xray]
contrast_fraction = 0.04  # a little contrast medium all the time, to see the vessel by
tissue_mm = 200.0
"#,
        table = vessel.table,
        openings = openings.join("\n"),
        opening = entry.index,
        pose = vessel.pose,
    )
}
