//! Every key of `[view]` on every way to a picture: it changes what is drawn, or is refused by name.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use endowire_viewer::{CtSpec, DevicePart, ExposureSpec, InjectionSpec, PatientSpec, TorsoSpec, ViewSpec};
use rayon::prelude::*;
use serde_json::Value;

use crate::common::{assets, said, scene_text, text};

/// A key, what else is said before and after, and the value that it gets.
type Key = (&'static str, &'static [(&'static str, &'static str)], &'static str);

const BODY: (&str, &str) = ("patient.torso.width_mm", "300.0");
const NOISE: (&str, &str) = ("detector.noise", "true");
const FIELD: (&str, &str) = ("c_arm.field_mm", "300.0");
/// Small differences, in a small field around the device.
const FINE: (&str, &str) = ("bits", "16");
const NEAR: (&str, &str) = ("c_arm.field_mm", "50.0");
const MIDDLE: (&str, &str) = ("c_arm.isocentre_mm", "[0.0, 0.0, 15.0]");

const CHEST: (&str, &str) = ("c_arm.field_mm", "500.0");

/// All keys. Pictures of all backends are the same; one that there is not is refused, and so is a file that is missing.
static KEYS: [Key; 88] = [
    ("size_px", &[], "[40, 30]"),
    ("views", &[], "[\"fluoro\"]"),
    ("every", &[], "3"),
    ("film", &[], "\"gif\""),
    ("biplane_deg", &[], "90.0"),
    ("frames_per_s", &[("xray.pulse_ms", "30.0")], "7.5"),
    ("bits", &[], "16"),
    ("c_arm.pose", &[], "\"LAO 30\""),
    ("c_arm.primary_deg", &[], "30.0"),
    ("c_arm.secondary_deg", &[], "20.0"),
    ("c_arm.sid_mm", &[FIELD], "950.0"),
    ("c_arm.sod_mm", &[FIELD], "650.0"),
    ("c_arm.pixel_mm", &[], "4.0"),
    ("c_arm.field_mm", &[], "90.0"),
    ("c_arm.magnification", &[], "1.5"),
    ("c_arm.rotation_deg", &[], "25.0"),
    ("c_arm.collimation_mm", &[("c_arm.field_mm", "150.0")], "[80.0, 70.0]"),
    ("c_arm.shutter", &[], "\"octagon\""),
    ("c_arm.markers", &[], "true"),
    ("c_arm.isocentre_mm", &[], "[5.0, 10.0, 60.0]"),
    ("xray.mode", &[NOISE], "\"cine\""),
    ("xray.kvp", &[], "60.0"),
    ("xray.pulse_ms", &[], "30.0"),
    ("xray.brightness_s", &[FINE], "0.0"),
    ("xray.aluminium_mm", &[], "15.0"),
    ("xray.copper_mm", &[], "3.0"),
    ("xray.energy_bins", &[FINE], "1"),
    ("xray.energy_kev", &[], "30.0"),
    ("xray.contrast_fraction", &[], "0.4"),
    ("xray.tissue_mm", &[], "250.0"),
    ("xray.csi_mm", &[FINE], "0.05"),
    ("xray.focal_spot_mm", &[FINE, NEAR, MIDDLE], "3.0"),
    ("xray.device_material", &[], "\"platinum\""),
    ("xray.harmonised", &[BODY], "0.0"),
    ("xray.edges", &[FINE, NEAR, MIDDLE], "4.0"),
    ("xray.window", &[], "[0.0, 3.0]"),
    ("exposure.curve", &[("xray.pulse_ms", "5.0")], "[[50.0, 120.0]]"),
    ("exposure.current_ma", &[NOISE, ("xray.pulse_ms", "5.0")], "[0.01, 0.02]"),
    ("detector.dose_ngy", &[NOISE], "2.0"),
    ("detector.noise", &[], "true"),
    ("detector.seed", &[NOISE], "7"),
    ("detector.blur_mm", &[], "3.0"),
    ("detector.electronic_ngy", &[NOISE], "500.0"),
    ("detector.lag", &[NOISE], "0.9"),
    ("detector.scatter_fraction", &[BODY], "0.8"),
    ("patient.torso.width_mm", &[], "250.0"),
    ("patient.torso.depth_mm", &[BODY], "150.0"),
    ("patient.torso.spine_mm", &[BODY], "[15.0, 25.0]"),
    ("patient.torso.diaphragm_mm", &[BODY], "-40.0"),
    ("patient.torso.spine", &[BODY], "false"),
    ("patient.torso.ribs", &[BODY], "false"),
    ("patient.torso.lungs", &[BODY], "false"),
    ("patient.torso.electrodes", &[BODY, FINE, ("c_arm.field_mm", "600.0")], "false"),
    ("patient.torso.table_mm", &[BODY, FINE, ("c_arm.field_mm", "600.0")], "250.0"),
    ("patient.torso.breath_mm", &[BODY, FINE, CHEST, ("patient.torso.breath_s", "1.0")], "0.0"),
    ("patient.torso.breath_s", &[BODY, FINE, CHEST], "1.0"),
    ("patient.torso.beat_mm", &[BODY, FINE, CHEST, ("flow.heart_rate_per_min", "40.0")], "15.0"),
    ("flow.tree", &[], "\"MISSING.csv\""),
    ("flow.inlet_mm", &[], "[0.0, 0.0, 80.0]"),
    ("flow.inflow_ml_per_s", &[], "5.0"),
    ("flow.split_exponent", &[], "11.0"),
    ("flow.pulsatility", &[], "0.0"),
    ("flow.heart_rate_per_min", &[], "200.0"),
    ("flow.tissue_s", &[("flow.tissue_mm", "150.0"), ("flow.inflow_ml_per_s", "20.0")], "0.05"),
    ("flow.tissue_mm", &[("flow.inflow_ml_per_s", "20.0")], "150.0"),
    ("flow.dispersion", &[FINE], "5.0"),
    ("injection[0].start_s", &[], "100.0"),
    ("injection[0].duration_s", &[], "0.05"),
    ("injection[0].rate_ml_per_s", &[], "1.0"),
    ("injection[0].at_mm", &[], "[0.0, 0.0, 20.0]"),
    ("injection[0].at_tip", &[], "true"),
    ("device[0].from_tip_mm", &[], "[0.0, 8.0]"),
    ("device[0].material", &[], "\"platinum\""),
    ("device[0].outer_radius_mm", &[], "1.2"),
    ("device[0].inner_radius_mm", &[], "0.4"),
    ("camera.azimuth_deg", &[], "40.0"),
    ("camera.elevation_deg", &[], "50.0"),
    ("camera.turn_deg", &[], "60.0"),
    ("camera.orbit_deg", &[("camera.turn_deg", "30.0")], "90.0"),
    ("camera.scale_bar", &[], "false"),
    ("camera.markers", &[], "false"),
    ("camera.magnification", &[], "2.0"),
    ("camera.shift", &[], "[0.1, 0.0]"),
    ("camera.c_arm", &[], "true"),
    ("camera.force_n", &[("size_px", "[320, 320]")], "0.5"),
    ("patient.ct.file", &[], "\"MISSING.nii\""),
    ("patient.ct.offset_mm", &[], "[1.0, 0.0, 0.0]"),
    ("backend", &[], "\"graphics\""),
];

/// Pictures of a call by their names, or what it says instead.
type Drawn = Result<BTreeMap<String, Vec<u8>>, String>;

/// A scene with both views, an injection, and a device with a part, in a folder of its own.
fn scene(folder: &Path) -> PathBuf {
    let view = format!(
        "[view]\nsize_px = [48, 48]\nviews = [\"3d\", \"fluoro\"]\nevery = 5\nbackend = \"cpu\"\n\
         detector.noise = false\n[view.flow]\ntree = \"{}/vessels/curved_tube.csv\"\n\
         [[view.injection]]\nstart_s = 0.0\nduration_s = 5.0\nrate_ml_per_s = 10.0\n\
         [[view.device]]\ninner_radius_mm = 0.2\n[view.xray]\n",
        assets().display()
    );
    let changes = [
        ("advance_mm = 220.0\nstep_mm = 1.0", "advance_mm = 30.0\nstep_mm = 3.0"),
        (
            "[[script]]\nrotate_deg = 90.0\nstep_deg = 15.0\n\n[[script]]\nretract_mm = 20.0\nstep_mm = 1.0\n",
            "",
        ),
        ("[view]\nsize_px = [640, 640]\nviews = [\"3d\", \"fluoro\"]\nevery = 40\n\n[view.xray]\n", &view),
        ("element_mm = 2.0", "element_mm = 4.0"),
    ];
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene_text("curved_tube_exact.toml", &changes)).unwrap();
    path
}

/// All pictures below a folder.
fn pictures(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            all.extend(pictures(&path).into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else if [".png", ".gif"].iter().any(|end| name.ends_with(end)) {
            all.insert(name, std::fs::read(&path).unwrap());
        }
    }
    all
}

/// What is said beside a key.
type Beside = &'static [(&'static str, &'static str)];

/// A key on a way.
type Case = (&'static Way, &'static Key);

/// A way to a picture: draws the scene of a folder with these values into another folder.
type Way = (&'static str, fn(&Path, &[String], &Path) -> std::process::Command);

static WAYS: [Way; 5] =
    [("run", run), ("render", render), ("fluoro", fluoro), ("dataset", dataset), ("play", play)];

fn endowire(first: &[&str], values: &[String]) -> std::process::Command {
    let mut command = crate::common::endowire();
    command.args(first);
    for value in values {
        command.args(["--set", value]);
    }
    command
}

fn run(folder: &Path, values: &[String], out: &Path) -> std::process::Command {
    endowire(&["run", text(&folder.join("scene.toml")), "--quiet", "--out", text(out)], values)
}

fn render(folder: &Path, values: &[String], out: &Path) -> std::process::Command {
    let recorded = folder.join("recorded");
    endowire(
        &["render", text(&recorded), "--every", "5", "--animate", "film.png", "--out", text(out)],
        values,
    )
}

fn fluoro(folder: &Path, values: &[String], out: &Path) -> std::process::Command {
    let scene = folder.join("scene.toml");
    endowire(
        &["fluoro", text(&scene), "--steps", "9", "--time", "0.5", "--count", "2", "--out", text(out)],
        values,
    )
}

fn dataset(folder: &Path, values: &[String], out: &Path) -> std::process::Command {
    endowire(&["dataset", text(&folder.join("dataset.toml")), "--out", text(out)], values)
}

fn play(folder: &Path, values: &[String], out: &Path) -> std::process::Command {
    let (scene, inputs, record) =
        (folder.join("scene.toml"), folder.join("inputs.jsonl"), out.join("hand.toml"));
    let inputs = text(&inputs);
    endowire(&["play", text(&scene), "--headless", "--inputs", inputs, "--record", text(&record)], values)
}

fn drawn(way: &Way, folder: &Path, values: &[String]) -> Drawn {
    let out = tempfile::tempdir().unwrap();
    let to = out.path().join("out");
    // Pictures of `play` go to where it is.
    std::fs::create_dir_all(&to).unwrap();
    let output = (way.1)(folder, values, &to).current_dir(&to).output().unwrap();
    if output.status.success() { Ok(pictures(&to)) } else { Err(said(&output)) }
}

/// Whether a way refuses what is said beside a key, so that the key says nothing there either.
fn refuses_beside(said: &str, beside: &[(&str, &str)]) -> bool {
    beside.iter().any(|(key, _)| said.contains(&format!("view.{key}")) && said.contains("--set"))
}

/// Every key on one of the ways, in turn.
#[test]
fn every_key_of_the_view_changes_the_picture_or_is_refused() {
    let cases: Vec<Case> = KEYS.iter().enumerate().map(|(k, key)| (&WAYS[k % WAYS.len()], key)).collect();
    changed_or_refused(&cases);
}

#[test]
#[ignore = "minutes: all keys on all ways"]
fn every_key_of_the_view_changes_the_picture_on_every_way_or_is_refused() {
    let cases: Vec<Case> = WAYS.iter().flat_map(|way| KEYS.iter().map(move |key| (way, key))).collect();
    changed_or_refused(&cases);
}

fn changed_or_refused(cases: &[Case]) {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    std::fs::write(
        folder.path().join("dataset.toml"),
        "scenes = [\"scene.toml\"]\nposes = 1\nmoments = 2\n[vary]\nprogress = [0.8, 1.0]\ntime_s = [0.4, 0.6]\n",
    )
    .unwrap();
    let inputs = "{\"do\": \"pedal\", \"down\": true}\n{\"do\": \"move\", \"mm_per_s\": 40}\n\
                  {\"do\": \"wait\", \"ticks\": 30}\n{\"do\": \"picture\", \"file\": \"a.png\"}\n\
                  {\"do\": \"wait\", \"ticks\": 6}\n{\"do\": \"picture\", \"file\": \"b.png\"}\n";
    std::fs::write(folder.path().join("inputs.jsonl"), inputs).unwrap();
    let recorded = folder.path().join("recorded");
    let output = crate::common::endowire()
        .args(["run", text(&scene), "--quiet", "--set", "view.views=[]", "--out", text(&recorded)])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));

    let set = |(key, value): (&str, &str)| format!("view.{key}={value}");
    // What is said beside a key, once for each way.
    let beside: BTreeMap<(&str, Beside), &Way> =
        cases.iter().map(|(way, key)| ((way.0, key.1), *way)).collect();
    let before: Vec<_> = beside
        .into_par_iter()
        .map(|((name, beside), way)| {
            let values: Vec<String> = beside.iter().map(|one| set(*one)).collect();
            ((name, beside), drawn(way, folder.path(), &values))
        })
        .collect();
    let before: BTreeMap<_, _> = before.into_iter().collect();
    let wrong: Vec<String> = cases
        .par_iter()
        .filter_map(|(way, (key, beside, value))| {
            // A recording has the times of its steps; the rate is that of several frames of one step.
            if way.0 == "render" && *key == "frames_per_s" {
                return None;
            }
            let after: Vec<String> = beside.iter().copied().chain([(*key, *value)]).map(set).collect();
            let (without, with) = (&before[&(way.0, *beside)], drawn(way, folder.path(), &after));
            let last = key.rsplit('.').next().unwrap_or(key);
            match (without, with) {
                (Err(said), Err(_)) if said.contains(last) => None,
                (Err(said), _) if refuses_beside(said, beside) => None,
                (Err(said), _) => Some(format!("{} {key}: before: {said}", way.0)),
                (_, Err(said)) if !said.contains(last) => Some(format!("{} {key}: refused as {said}", way.0)),
                (Ok(without), Ok(with)) if *without == with => {
                    Some(format!("{} {key}: {} pictures, unchanged", way.0, with.len()))
                }
                _ => None,
            }
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
    // The twin: the same values again draw the same.
    for way in &WAYS {
        assert_eq!(drawn(way, folder.path(), &[]), drawn(way, folder.path(), &[]), "{}", way.0);
    }
}

#[test]
fn the_list_of_keys_is_that_of_the_view() {
    let spec = ViewSpec {
        exposure: Some(ExposureSpec::default()),
        patient: PatientSpec {
            torso: Some(TorsoSpec::default()),
            ct: Some(CtSpec { file: PathBuf::new(), offset_mm: [0.0; 3] }),
            vessel_moves: false,
        },
        injection: vec![InjectionSpec {
            start_s: 0.0,
            duration_s: 1.0,
            rate_ml_per_s: 1.0,
            at_mm: None,
            at_tip: false,
        }],
        device: vec![DevicePart::default()],
        ..ViewSpec::default()
    };
    fn leaves(path: &str, value: &Value, found: &mut BTreeSet<String>) {
        match value {
            Value::Object(table) => {
                let of = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
                table.iter().for_each(|(key, value)| leaves(&of(key), value, found));
            }
            Value::Array(tables) if tables.iter().any(Value::is_object) => {
                leaves(&format!("{path}[0]"), &tables[0], found);
            }
            _ => {
                found.insert(path.to_owned());
            }
        }
    }
    let mut found = BTreeSet::new();
    leaves("", &serde_json::to_value(&spec).unwrap(), &mut found);
    let listed: BTreeSet<String> = KEYS.iter().map(|key| key.0.to_owned()).collect();
    let (missing, gone): (Vec<_>, Vec<_>) =
        (found.difference(&listed).collect(), listed.difference(&found).collect());
    assert!(missing.is_empty() && gone.is_empty(), "not in the list: {missing:?}; not in the view: {gone:?}");
}
