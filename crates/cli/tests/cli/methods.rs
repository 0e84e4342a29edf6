//! Every method can be named in a scene: it runs, is recorded and drawn, goes on from its state, and takes its own options alone.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{endowire, said};
use endowire_methods::NAMES;
use serde_json::Value;

/// A wire that meets the wall of a tube with a kink; `{method}` and `{script}` are filled in.
const SCENE: &str = r#"
[vessel]
tree = "tube.csv"
edge_mm = 2.0

[[device.section]]
length_mm = 80.0
radius_mm = 0.5
bending_stiffness_nmm2 = 10.0

[sheath]
position_mm = [1.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]

[method]
{method}

{script}
"#;

const TUBE: &str = "0 0 0 3 -1\n14 0 0 3 0\n22 3 0 3 1\n60 28 0 3 2\n";

/// The script, and its first lines.
const WHOLE: &str =
    "[[script]]\nadvance_mm = 36.0\nstep_mm = 4.0\n\n[[script]]\nretract_mm = 4.0\nstep_mm = 2.0\n";
const PART: &str = "[[script]]\nadvance_mm = 36.0\nstep_mm = 4.0\n";

/// Writes a scene and runs it into the folder `out`.
fn run(folder: &Path, method: &str, script: &str, out: &Path, more: &[&Path]) -> Output {
    let scene: PathBuf = folder.join("scene.toml");
    std::fs::write(folder.join("tube.csv"), TUBE).unwrap();
    std::fs::write(&scene, SCENE.replace("{method}", method).replace("{script}", script)).unwrap();
    // What some of the methods find is no equilibrium; here it is the bits that count.
    let allowed = "--allow-unconverged".as_ref();
    endowire().args(["run".as_ref(), &*scene, "--out".as_ref(), out, allowed]).args(more).output().unwrap()
}

fn done(output: &Output) {
    assert!(output.status.success(), "{}", said(output));
}

fn refused(output: &Output, words: &[&str]) {
    let text = said(output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert_eq!(text.trim_end().lines().count(), 1, "one line is wanted: {text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

#[test]
fn every_method_runs_by_name_is_drawn_and_goes_on_with_the_same_bits() {
    for name in NAMES {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let method = format!("name = \"{name}\"\nelement_mm = 4.0");
        done(&run(folder.path(), &method, PART, &at("part"), &["--save-state".as_ref(), &at("state")]));
        done(&run(folder.path(), &method, WHOLE, &at("whole"), &[]));
        done(&run(folder.path(), &method, WHOLE, &at("rest"), &["--resume".as_ref(), &at("state")]));
        let summary: Value =
            serde_json::from_slice(&std::fs::read(at("whole/summary.json")).unwrap()).unwrap();
        assert_eq!(summary["method"], name);
        assert!((summary["inserted_mm"].as_f64().unwrap() - 32.0).abs() < 1e-9, "{name}: {summary}");
        assert!(summary["energy_mj"]["bend"].as_f64().unwrap() > 1e-3, "{name} is not bent: {summary}");
        let rows = |run: &str, first: usize| -> Vec<String> {
            let table = std::fs::read_to_string(at(run).join("steps.csv")).unwrap();
            table.lines().skip(1 + first).map(str::to_owned).collect()
        };
        assert_eq!(rows("rest", 0), rows("whole", 9), "{name}");
        let render = ["--view", "3d", "--size", "24", "--from", "11"];
        done(&endowire().arg("render").arg(at("whole")).args(render).output().unwrap());
        assert!(std::fs::read_dir(at("whole/render")).unwrap().count() > 0, "{name}");
    }
}

#[test]
fn a_state_of_another_method_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (out, state) = (folder.path().join("out"), folder.path().join("state"));
    let go = |method: &str, option: &str| run(folder.path(), method, WHOLE, &out, &[option.as_ref(), &state]);
    done(&go("name = \"li2011-banded\"", "--save-state"));
    refused(&go("name = \"beam-fem\"", "--resume"), &["the method or its options is not the same"]);
}

#[test]
fn wrong_names_keys_and_values_are_reported_with_the_right_ones() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (method, words) in [
        (
            "name = \"mass-sprin\"",
            &["unknown name `mass-sprin`", "did you mean `mass-spring`?", "`beam-fem-damped`"][..],
        ),
        ("name = \"rigid-links\"\ntimestep = 0.1", &["`timestep`", "did you mean `time_step`?"][..]),
        ("name = \"chord-energy\"\ndamping = 0.1", &["`damping`", "`max_iterations`"][..]),
        ("name = \"beam-fem\"\ndamping = 5.0", &["`damping`", "`axial_ratio`"][..]),
        ("name = \"beam-fem-damped\"\ndamping = 0.0", &["method.damping = 0:", "above 0"][..]),
        ("name = \"mass-spring\"\ntime_step = 1.5", &["method.time_step = 1.5:", "at most 1"][..]),
        ("name = \"mass-spring\"\naxial_ratio = -1.0", &["method.axial_ratio = -1:"][..]),
        ("name = \"discrete-rod\"\nlength_tolerance = nan", &["method.length_tolerance = NaN:"][..]),
        ("name = \"rigid-links\"\nlargest_turn_rad = 4.0", &["method.largest_turn_rad = 4:"][..]),
        ("name = \"chord-energy\"\nmax_iterations = 0", &["method.max_iterations = 0:"][..]),
        ("name = \"chord-energy\"\ntolerance = \"x\"", &["tolerance: must be a number, not the text"][..]),
        ("name = \"discrete-rod\"\nelement_mm = 1e-6", &["method.element_mm"][..]),
    ] {
        refused(&run(folder.path(), method, WHOLE, &out, &[]), words);
    }
}
