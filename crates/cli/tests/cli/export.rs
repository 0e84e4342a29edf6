//! A recorded run as files of VTK, read back.

use std::path::{Path, PathBuf};

use crate::common::{assets, endowire, said};
use npyz::NpyFile;

/// Two instruments pushed into a tube.
const SCENE: &str = r#"
[vessel]
file = "VESSEL"
[[instrument]]
name = "wire"
[[instrument.section]]
length_mm = 300.0
radius_mm = 0.2
bending_stiffness_nmm2 = 5.0
[[instrument]]
name = "catheter"
[[instrument.section]]
length_mm = 200.0
radius_mm = 0.6
inner_radius_mm = 0.3
bending_stiffness_nmm2 = 15.0
[sheath]
position_mm = [0.0, 0.0, 1.0]
direction = [0.0, 0.0, 1.0]
[method]
name = "kirchhoff"
element_mm = 5.0
[[script]]
instrument = "wire"
advance_mm = 150.0
step_mm = 10.0
speed_mm_per_s = 20.0
with = [{ instrument = "catheter", advance_mm = 120.0, step_mm = 10.0 }]
[view]
views = []
"#;

/// Numbers of an array of a file.
fn array(text: &str, name: &str, after: &str) -> Vec<f64> {
    let behind = text.split_once(&format!("<{after}>")).unwrap().1;
    let begin = behind.split_once(&format!("Name=\"{name}\"")).unwrap().1.split_once('>').unwrap().1;
    let numbers = begin.split_once("</DataArray>").unwrap().0;
    numbers.split_whitespace().map(|number| number.parse().unwrap()).collect()
}

fn recorded(folder: &Path, name: &str) -> Vec<f64> {
    let mut archive = zip::ZipArchive::new(std::fs::File::open(folder.join("shapes.npz")).unwrap()).unwrap();
    let file = archive.by_name(&format!("{name}.npy")).unwrap();
    NpyFile::new(std::io::BufReader::new(file)).unwrap().into_vec().unwrap()
}

#[test]
fn a_run_is_exported_as_it_was_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let vessel = assets().join("vessels/curved_tube.stl");
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, SCENE.replace("VESSEL", vessel.to_str().unwrap())).unwrap();
    let (run, out) = (folder.path().join("run"), folder.path().join("vtk"));
    let command = |arguments: &[&std::ffi::OsStr]| {
        let output = endowire().args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
    };
    command(&["run".as_ref(), scene.as_ref(), "--out".as_ref(), run.as_ref()]);
    command(&["export".as_ref(), run.as_ref(), "--vtk".as_ref(), out.as_ref()]);

    let series = std::fs::read_to_string(out.join("run.pvd")).unwrap();
    assert_eq!(series.matches("<DataSet ").count(), 15);
    assert!(series.contains("timestep=\"0.5\" part=\"0\" file=\"step_000001.vtp\""), "{series}");
    let text = std::fs::read_to_string(out.join("step_000015.vtp")).unwrap();
    let points = array(&text, "points_mm", "Points");
    let of = array(&text, "instrument", "PointData");
    let offsets = array(&text, "offsets", "Lines");
    assert_eq!((points.len(), offsets.len()), (3 * of.len(), 2));
    // The wire is the whole line, to the bit; the catheter a part of it.
    let positions = recorded(&run, "positions_mm");
    let wire = &points[..3 * offsets[0] as usize];
    assert!(positions.ends_with(wire) && of[..offsets[0] as usize].iter().all(|number| *number == 0.0));
    let radii = array(&text, "radius_mm", "PointData");
    let catheter = offsets[0] as usize..offsets[1] as usize;
    assert!(catheter.clone().all(|k| of[k] == 1.0 && radii[k] == 0.6));
    assert_eq!(array(&text, "from_tip_mm", "PointData")[catheter.start], 120.0);
    // Contacts with their forces.
    let contacts = array(&text, "connectivity", "Verts");
    let forces = array(&text, "contact_force_n", "PointData");
    let wanted = recorded(&run, "contact_forces_n");
    assert!(!contacts.is_empty() && wanted.ends_with(&forces[3 * contacts[0] as usize..]));
    assert!(contacts.iter().all(|k| of[*k as usize] == -1.0));
    let vessel = std::fs::read_to_string(out.join("vessel.vtp")).unwrap();
    let triangles = array(&vessel, "connectivity", "Polys");
    let vertices = array(&vessel, "points_mm", "Points").len() / 3;
    assert!(triangles.len() > 3000 && triangles.iter().all(|k| (*k as usize) < vertices));

    let output =
        endowire().args(["export".as_ref(), out.as_os_str(), "--vtk".as_ref(), out.as_ref()]).output();
    let output = output.unwrap();
    let said = said(&output);
    assert!(output.status.code() == Some(2) && said.contains("folder of a recorded run"), "{said}");
}

#[test]
fn a_vessel_that_moves_is_exported_where_it_is_at_the_end_of_each_step() {
    let folder = tempfile::tempdir().unwrap();
    let tube = folder.path().join("tube.csv");
    std::fs::write(&tube, "0 0 0 4 -1\n0 0 80 4 0\n").unwrap();
    let exported = |motion: &str| {
        let scene = folder.path().join("scene.toml");
        // It is still at the sheath's mouth.
        let still = "still = { centre_mm = [0.0, 0.0, 20.0], radius_mm = 2.0, fade_mm = 30.0 }";
        let moved = format!("{motion}\ndisplacement_mm = [0.0, 0.0, 6.0]\n{still}\n");
        let vessel = format!("tree = {tube:?}\n[[vessel.motion]]\n{moved}");
        let text = SCENE
            .replace("file = \"VESSEL\"\n", &vessel)
            .replace("position_mm = [0.0, 0.0, 1.0]", "position_mm = [0.0, 0.0, 20.0]");
        let text = text.replace("= 150.0", "= 40.0").replace("= 120.0", "= 20.0");
        std::fs::write(&scene, text).unwrap();
        let (run, out) = (folder.path().join("run"), folder.path().join("vtk"));
        let command = |arguments: &[&std::ffi::OsStr]| {
            let output = endowire().args(arguments).output().unwrap();
            assert!(output.status.success(), "{}", said(&output));
        };
        command(&["run".as_ref(), scene.as_ref(), "--out".as_ref(), run.as_ref()]);
        let _ = std::fs::remove_dir_all(&out);
        command(&["export".as_ref(), run.as_ref(), "--vtk".as_ref(), out.as_ref()]);
        out
    };
    // The far end of the tube.
    let highest = |file: &str, out: &Path| {
        let points = array(&std::fs::read_to_string(out.join(file)).unwrap(), "points_mm", "Points");
        points.chunks(3).map(|point| point[2]).fold(f64::NEG_INFINITY, f64::max)
    };
    let out = exported("waveform = \"steady\"");
    assert!((highest("vessel.vtp", &out) - 86.0).abs() < 1e-9, "{}", highest("vessel.vtp", &out));
    let out = exported("waveform = \"breathing\"\nperiod_s = 4.0");
    assert!(!out.join("vessel.vtp").exists());
    let high: Vec<f64> = (1..=4).map(|step| highest(&format!("vessel_{step:06}.vtp"), &out)).collect();
    // Half a second each: at half of the period the breath is in.
    assert!(high[0] > 80.0 && high[1] > high[0] && (high[3] - 86.0).abs() < 1e-9, "{high:?}");
    let series = std::fs::read_to_string(out.join("run.pvd")).unwrap();
    assert!(series.contains("timestep=\"2\" part=\"1\" file=\"vessel_000004.vtp\""), "{series}");
    // In one file it has as many keys as an error takes; the ending may be in any case.
    let (run, glb) = (folder.path().join("run"), folder.path().join("RUN.GLB"));
    let arguments = ["export".as_ref(), run.as_os_str(), "--gltf".as_ref(), glb.as_ref()];
    let said = said(&endowire().args(arguments).output().unwrap());
    let gltf::Gltf { document, .. } = gltf::Gltf::from_slice(&std::fs::read(&glb).unwrap()).unwrap();
    let vessel = document.meshes().next().unwrap().primitives().next().unwrap();
    let keys = vessel.morph_targets().count();
    assert!(
        (2..=4).contains(&keys) && said.contains(&format!("has {keys} keys, and between them it is")),
        "{said}"
    );
}

/// A run of the scene in a folder, exported to a file.
fn exported(folder: &Path, flag: &str, name: &str) -> (PathBuf, PathBuf) {
    let vessel = assets().join("vessels/curved_tube.stl");
    let scene = folder.join("scene.toml");
    std::fs::write(&scene, SCENE.replace("VESSEL", vessel.to_str().unwrap())).unwrap();
    let (run, out) = (folder.join("run"), folder.join(name));
    for arguments in [
        ["run".as_ref(), scene.as_os_str(), "--out".as_ref(), run.as_ref()],
        ["export".as_ref(), run.as_os_str(), flag.as_ref(), out.as_ref()],
    ] {
        let output = endowire().args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
    }
    (run, out)
}

/// Places of the foremost tip after each step, mm.
fn tips(run: &Path) -> Vec<[f64; 3]> {
    let mut table = csv::Reader::from_path(run.join("steps.csv")).unwrap();
    let columns = table.headers().unwrap().clone();
    let at = |name: &str| columns.iter().position(|column| column == name).unwrap();
    let places = ["tip_x_mm", "tip_y_mm", "tip_z_mm"].map(at);
    table.records().map(|row| places.map(|k| row.as_ref().unwrap()[k].parse().unwrap())).collect()
}

/// What the validator of Khronos finds in a file, which `.ci/run` installs; `None` without it.
fn issues(file: &Path) -> Option<serde_json::Value> {
    const VALIDATE: &str = "require('gltf-validator').validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[1]))).then(found => console.log(JSON.stringify(found.issues)))";
    let modules = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../target/gltf-validator/node_modules"));
    if !modules.join("gltf-validator").exists() {
        eprintln!("skipped: gltf-validator is not in {}", modules.display());
        return None;
    }
    let mut node = std::process::Command::new("node");
    let output = node.env("NODE_PATH", modules).args(["-e", VALIDATE]).arg(file).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn the_validator_of_gltf_finds_nothing_in_an_animation() {
    let folder = tempfile::tempdir().unwrap();
    let (_, out) = exported(folder.path(), "--gltf", "run.glb");
    let Some(found) = issues(&out) else { return };
    let counts = |found: &serde_json::Value| [&found["numErrors"], &found["numWarnings"]].map(|n| n.as_u64());
    assert_eq!(counts(&found), [Some(0); 2], "{found}");
    // The twin: places of two numbers.
    let mut bytes = std::fs::read(&out).unwrap();
    let place = bytes.windows(6).position(|part| part == b"\"VEC3\"").unwrap();
    bytes[place + 4] = b'2';
    std::fs::write(&out, bytes).unwrap();
    assert!(counts(&issues(&out).unwrap())[0] > Some(0));
}

#[test]
fn a_run_is_an_animation_that_another_reader_takes() {
    let folder = tempfile::tempdir().unwrap();
    let (run, out) = exported(folder.path(), "--gltf", "run.glb");
    // Read and validated by a crate that knows nothing of ours.
    let bytes = std::fs::read(&out).unwrap();
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = blob.unwrap();
    let data = |_: gltf::Buffer<'_>| Some(&blob[..]);
    let names: Vec<&str> = document.meshes().filter_map(|mesh| mesh.name()).collect();
    assert_eq!(names, ["vessel", "wire", "catheter", "force"]);

    // The first joint of the wire is its tip, in every key; metres, y up.
    let tips = tips(&run);
    let skin = document.skins().find(|skin| skin.name() == Some("wire")).unwrap();
    let tip = skin.joints().next().unwrap().index();
    let animation = document.animations().next().unwrap();
    let channel = animation.channels().find(|channel| {
        let of = channel.target();
        of.node().index() == tip && of.property() == gltf::animation::Property::Translation
    });
    let reader = channel.unwrap().reader(data);
    let times: Vec<f32> = reader.read_inputs().unwrap().collect();
    assert!(times.len() == 15 && (times[0] - 0.5).abs() < 1e-6 && times.is_sorted());
    let Some(gltf::animation::util::ReadOutputs::Translations(places)) = reader.read_outputs() else {
        panic!("no places")
    };
    let places: Vec<[f32; 3]> = places.collect();
    let off_m = |place: &[f32; 3], tip: &[f64; 3]| {
        let there = [tip[0] * 1e-3, tip[2] * 1e-3, -tip[1] * 1e-3];
        place.iter().zip(there).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max)
    };
    let worst_m = places.iter().zip(&tips).map(|(place, tip)| off_m(place, tip)).fold(0.0, f64::max);
    assert!(worst_m < 1e-6, "{worst_m}");
    let twin_m = places.iter().zip(&tips[1..]).map(|(place, tip)| off_m(place, tip)).fold(0.0, f64::max);
    assert!(twin_m > 1e-3, "the next step is elsewhere: {twin_m}");

    // Where the joints are at the end, the skin is as it was modelled: a tube of the wire's radius around them.
    let joints: Vec<[f32; 3]> = skin.joints().map(|joint| joint.transform().decomposed().0).collect();
    let wire = document.meshes().find(|mesh| mesh.name() == Some("wire")).unwrap();
    let tube = wire.primitives().next().unwrap();
    let reader = tube.reader(data);
    let own: Vec<[u16; 4]> = reader.read_joints(0).unwrap().into_u16().collect();
    let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    assert_eq!(skin.reader(data).read_inverse_bind_matrices().unwrap().count(), joints.len());
    for (position, joint) in positions.iter().zip(&own).take(positions.len() - 1) {
        let centre = joints[usize::from(joint[0])];
        let away = position.iter().zip(centre).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt();
        assert!((away - 0.2e-3).abs() < 1e-6, "{away}");
    }
}

#[test]
fn a_run_is_curves_with_time_samples() {
    let folder = tempfile::tempdir().unwrap();
    let (run, out) = exported(folder.path(), "--usd", "run.usda");
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.starts_with("#usda 1.0\n") && text.matches('{').count() == text.matches('}').count());
    let wire = text.split_once("def BasisCurves \"_wire_0\"").unwrap().1;
    let places = wire.split_once("points.timeSamples = {").unwrap().1.split_once("        }\n").unwrap().0;
    let last = places.trim_end().lines().last().unwrap();
    assert_eq!(places.trim().lines().count(), 15);
    let numbers: Vec<f32> = last
        .split_once(": ")
        .unwrap()
        .1
        .split(|c: char| !"0123456789.-e".contains(c))
        .filter_map(|number| number.parse().ok())
        .collect();
    let positions: Vec<f32> = recorded(&run, "positions_mm").iter().map(|mm| *mm as f32).collect();
    assert!(positions.ends_with(&numbers) && numbers.len() > 30);
    assert!(text.contains("vector3f[] primvars:force_n.timeSamples"));
    let arguments = ["export".as_ref(), run.as_os_str(), "--usd".as_ref(), "a.txt".as_ref()];
    let reported = said(&endowire().args(arguments).output().unwrap());
    assert!(reported.contains("--usd a.txt: name a file .usda"), "{reported}");
    let reported = said(&endowire().args(["export".as_ref(), run.as_os_str()]).output().unwrap());
    assert!(reported.contains("<--vtk <DIR>|--gltf <FILE>|--usd <FILE>>"), "{reported}");
}

#[test]
fn tables_with_rows_that_are_missing_are_shown_up_to_a_kill_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (run, out) = exported(folder.path(), "--gltf", "run.glb");
    let page = folder.path().join("page.html");
    let (steps, summary) = (run.join("steps.csv"), run.join("summary.json"));
    let [table, told] = [&steps, &summary].map(|path| std::fs::read_to_string(path).unwrap());
    let usd = folder.path().join("run.usda");
    let each = [
        vec!["export".as_ref(), run.as_os_str(), "--gltf".as_ref(), out.as_ref()],
        vec!["export".as_ref(), run.as_os_str(), "--usd".as_ref(), usd.as_ref()],
        vec!["report".as_ref(), run.as_os_str(), "--out".as_ref(), page.as_ref()],
        vec!["assess".as_ref(), run.as_os_str()],
    ];
    let all = |reported: &str, code: i32| {
        for arguments in &each {
            let output = endowire().args(arguments).output().unwrap();
            let said = said(&output);
            assert!(output.status.code() == Some(code) && said.contains(reported), "{arguments:?} {said}");
        }
    };
    all("", 0);
    let lines: Vec<&str> = table.split_inclusive('\n').collect();
    std::fs::write(&steps, [&lines[..5], &lines[6..]].concat().concat()).unwrap();
    all("steps.csv: line 6: step = 6: comes after step 4: rows are missing", 2);
    std::fs::write(&steps, &table[..table.len() - 9]).unwrap();
    all("steps.csv: step = 14: is the last one, and summary.json counts 15 steps", 2);
    let killed =
        told.replace("\"complete\": true", "\"complete\": false").replace("\"steps\": 15", "\"steps\": 0");
    std::fs::write(&summary, &killed).unwrap();
    all("the row of line 16 of steps.csv is cut: read up to the last whole step", 0);
    // Killed before its first step.
    std::fs::write(&steps, lines[0]).unwrap();
    for arguments in &each[..3] {
        let said = said(&endowire().args(arguments).output().unwrap());
        assert!(said.contains("the run has recorded no step"), "{said}");
    }
}
