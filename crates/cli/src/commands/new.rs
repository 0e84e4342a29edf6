//! `endowire new`: creates a folder with a scene to start from.

use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_core::device::DeviceFile;
use endowire_core::vessel::{
    Lumen, NoStore, Resolution, SurfaceFrame, SurfaceMesh, SweptVessel, Wall, WallQuery, anatomy, survey,
    wall_hints,
};

use crate::args::NewArgs;
use crate::failure::Failure;
use crate::output::{tell, whole};

/// Copies of `wire_035_hydrophilic_angled.toml` and `microwire_014_shaped.toml` of `assets/devices`, with their radii,
/// mm, the thickest first; a test compares them.
const WIRES: [(&str, f64); 2] = [
    (include_str!("../../templates/wire.toml"), 0.4445),
    (include_str!("../../templates/microwire.toml"), 0.1778),
];
/// Thickness of septa that the survey counts, mm; it is not used here.
const SEPTUM_MM: f64 = 1.0;
/// Depth of the sheath's mouth inside an opening, mm, in vessels that are wide enough.
const DEPTH_MM: f64 = 2.0;
/// Room around a device at the sheath's mouth, in its radii, from which a scene is made.
const ROOM: f64 = 1.1;
/// First and second push of the script, mm, in vessels that are long enough, and as parts of the way ahead.
const PUSHES: [(f64, f64); 2] = [(60.0, 0.4), (30.0, 0.2)];
/// Longest step, mm, and number of steps of the first push.
const STEP_MM: f64 = 2.0;
const STEPS: f64 = 20.0;
/// Number of triangles of a built-in vessel.
const TRIANGLES: usize = 20_000;

/// A vessel for the new scene.
struct Vessel {
    /// Lines of the `[vessel]` table.
    table: String,
    wall: Wall,
    pose: &'static str,
}

/// Where the sheath of the new scene is.
struct Start {
    /// Lines of the `[sheath]` table.
    table: String,
    /// Distance of its mouth from the wall, mm.
    room_mm: f64,
    /// Length of the way ahead, mm, as far as it is known without a centre line.
    ahead_mm: f64,
}

/// Creates the folder.
pub(crate) fn new(args: &NewArgs) -> Result<(), Failure> {
    let folder = &args.dir;
    let refuse = |what: String| Failure::Input(format!("{}: {what}", folder.display()));
    let holds = std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if holds {
        return Err(refuse("holds files: name a folder that is not there, or empty".to_owned()));
    }
    let device = args.device.as_deref().map(own_device).transpose()?;
    std::fs::create_dir_all(folder).map_err(|e| refuse(e.to_string()))?;
    let vessel = vessel(&args.vessel, args.frame.into(), folder)?;
    let in_vessel = |what: String| Failure::Input(format!("{}: {what}", args.vessel.display()));
    let start = start(&vessel.wall)?.ok_or_else(|| {
        in_vessel("is closed, and no place inside is far enough from the wall: cut its ends off".to_owned())
    })?;
    let device = fitting(device, start.room_mm).map_err(in_vessel)?;
    let name =
        folder.file_name().map_or_else(|| "scene".to_owned(), |name| name.to_string_lossy().into_owned());
    let write = |file: &str, text: &str| {
        let path = folder.join(file);
        whole::write_bytes(&path, text.as_bytes()).map_err(|e| Failure::write(&path, &e))
    };
    write("device.toml", &device)?;
    write("scene.toml", &scene(&name, &vessel, &start))?;
    let scene = folder.join("scene.toml");
    let scene = scene.display();
    tell(format_args!("made {scene}; now:\n  endowire run {scene}\n  endowire play {scene}"));
    Ok(())
}

/// The text of a device file, and its largest radius, mm.
fn own_device(path: &Path) -> Result<(String, f64), Failure> {
    let radius_mm = DeviceFile::read(path)?.device.max_radius_mm();
    let text =
        std::fs::read_to_string(path).map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
    Ok((text, radius_mm))
}

/// The device given, or the thickest wire of the catalogue that fits where the wall is this far away; or why none does.
fn fitting(given: Option<(String, f64)>, room_mm: f64) -> Result<String, String> {
    let fits = |radius_mm: f64| ROOM * radius_mm < room_mm;
    if let Some((text, radius_mm)) = given {
        return match fits(radius_mm) {
            true => Ok(text),
            false => Err(format!(
                "the wall is {room_mm:.3} mm from the middle of the lumen where the device would come in, and its radius is \
                 {radius_mm:.3} mm: give a thinner one, or the unit of the file (--unit-mm)"
            )),
        };
    }
    let thinnest_mm = WIRES[WIRES.len() - 1].1;
    WIRES.into_iter().find(|(_, radius_mm)| fits(*radius_mm)).map(|(text, _)| text.to_owned()).ok_or_else(|| {
        format!(
            "the wall is {room_mm:.3} mm from the middle of the lumen where a device would come in, and the thinnest wire that a new \
             scene can have has a radius of {thinnest_mm:.3} mm: give a thinner one (--device), or the unit of the file (--unit-mm)"
        )
    })
}

/// The inlet of a vessel, or a place in a closed one; `None` if it has none.
fn start(wall: &Wall) -> Result<Option<Start>, Failure> {
    let query = WallQuery::new(wall)?;
    let room_mm = |x: &Vec3| query.nearest(x, f64::INFINITY).map_or(0.0, |near| near.distance_mm);
    let list = |v: [f64; 3]| format!("{v:?}");
    let Some(inlet) = wall.inlet() else {
        let found = survey(wall, SEPTUM_MM).start;
        return Ok(found.map(|found| Start {
            table: format!(
                "# The vessel is closed: a place inside, and the direction with the longest free way.\n\
                 [sheath]\nposition_mm = {}\ndirection = {}",
                list(found.position_mm),
                list(found.direction)
            ),
            room_mm: found.clearance_mm,
            ahead_mm: found.free_mm,
        }));
    };
    let depth_mm = DEPTH_MM.min(inlet.radius_mm);
    let mouth_mm = inlet.centre_mm - inlet.direction * depth_mm;
    let away = wall.mesh().vertices_mm.iter().map(|x| (x - mouth_mm).norm());
    let openings: Vec<String> = (wall.openings().iter())
        .map(|one| {
            let at = one.centre_mm;
            let digits = if one.radius_mm < 1.0 { 3 } else { 1 };
            format!(
                "#   {}: radius {:.digits$} mm at [{:.0}, {:.0}, {:.0}]",
                one.index, one.radius_mm, at.x, at.y, at.z
            )
        })
        .collect();
    let table = format!(
        "# Openings of the vessel:\n{}\n[sheath]\nopening = {}\ndepth_mm = {depth_mm:?}",
        openings.join("\n"),
        inlet.index
    );
    Ok(Some(Start { table, room_mm: room_mm(&mouth_mm), ahead_mm: away.fold(0.0, f64::max) }))
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
    for hint in wall_hints(&wall, frame.unit_mm) {
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

/// The text of the scene.
fn scene(name: &str, vessel: &Vessel, start: &Start) -> String {
    let [first_mm, second_mm] = PUSHES.map(|(most_mm, part)| rounded(most_mm.min(part * start.ahead_mm)));
    let step_mm = rounded(STEP_MM.min(first_mm / STEPS));
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

{sheath}

[method]
name = "kirchhoff"
element_mm = 4.0

[[script]]                # what the hand does: in, a turn, and on
advance_mm = {first_mm:?}
step_mm = {step_mm:?}

[[script]]
rotate_deg = 90.0

[[script]]
advance_mm = {second_mm:?}
step_mm = {step_mm:?}

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
        sheath = start.table,
        pose = vessel.pose,
    )
}

/// Rounded to two digits.
fn rounded(mm: f64) -> f64 {
    format!("{mm:.1e}").parse().unwrap_or(mm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wires_have_the_radii_that_are_said_of_them() {
        let folder = tempfile::tempdir().unwrap();
        for (text, radius_mm) in WIRES {
            let path = folder.path().join("wire.toml");
            std::fs::write(&path, text).unwrap();
            let (_, read_mm) = own_device(&path).unwrap();
            assert!((read_mm - radius_mm).abs() < 1e-3, "{read_mm}");
        }
    }

    #[test]
    fn the_thickest_wire_that_fits_is_taken() {
        let of = |room_mm: f64| fitting(None, room_mm).map(|text| text.contains("microwire"));
        assert_eq!((of(4.0), of(0.45), of(0.3)), (Ok(false), Ok(true), Ok(true)));
        assert!(of(0.1).unwrap_err().contains("0.178 mm"));
        let own = |room_mm: f64| fitting(Some(("mine".to_owned(), 1.0)), room_mm);
        assert_eq!(own(2.0).unwrap(), "mine");
        assert!(own(1.0).unwrap_err().contains("its radius is 1.000 mm"));
    }

    #[test]
    fn lengths_have_two_digits() {
        assert_eq!([60.0, 12.34, 0.0123, 2.0].map(rounded), [60.0, 12.0, 0.012, 2.0]);
    }
}
