//! Numbers on the command line that mean nothing: each is refused at once, by its option and what was given.

use crate::common::{assets, endowire, said};

#[test]
fn numbers_that_mean_nothing_are_refused_by_option_and_value() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| assets().join(name).to_str().unwrap().to_owned();
    let [scene, tube, wire] =
        ["scenes/curved_tube_exact.toml", "vessels/curved_tube.stl", "devices/wire_035_soft.toml"].map(path);
    let [scene, tube, wire] = [&scene, &tube, &wire].map(String::as_str);
    let surfaces = folder.path().to_str().unwrap();
    for (command, option) in [
        (&["fluoro", scene, "--steps", "0"][..], "--time"),
        (&["fluoro", scene, "--steps", "0", "--turn", "9"], "--deg-per-s"),
        (&["play", scene, "--headless"], "--warn-n"),
        (&["play", scene, "--headless"], "--warn-nmm"),
        (&["compare", "--cases", "cantilever-1"], "--limit-s"),
        (&["experiment", "timing"], "--limit-s"),
        (&["verify", "--surfaces", surfaces], "--limit-s"),
        (&["verify", "--surfaces", surfaces], "--jobs"),
        (&["verify", "--stress"], "--commands"),
        (&["sweep", "none.toml", "--out", "out"], "--jobs"),
        (&["vessel", "check", tube], "--unit-mm"),
        (&["vessel", "check", tube], "--deviation-mm"),
        (&["vessel", "check", tube], "--septum-mm"),
        (&["vessel", "centreline", tube], "--unit-mm"),
        (&["vessel", "generate", tube, "--out", "a.stl"], "--triangles"),
        (&["vessel", "sac", tube, "--dome", "0,0,1"], "--unit-mm"),
        (&["bench", "push", wire], "--step-mm"),
        (&["bench", "bend", wire], "--span-mm"),
    ] {
        for value in ["-1", "nan", "inf", ""] {
            let mut program = endowire();
            let output = program.current_dir(folder.path()).args(command).args([option, value]).output();
            let output = output.unwrap();
            let text = said(&output);
            assert_eq!(output.status.code(), Some(2), "{command:?} {option} {value}: {text}");
            let names = text.contains(option) && text.to_lowercase().contains(value);
            assert!(names && !text.contains("panicked"), "{command:?} {option} {value}: {text}");
        }
    }
    // The twin, and a place that is too far for the arithmetic of surfaces.
    let output = endowire().args(["vessel", "check", tube, "--unit-mm", "1"]).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    for option in ["--deviation-mm", "--septum-mm"] {
        let output = endowire().args(["vessel", "check", tube, option, "1e9"]).output().unwrap();
        let text = said(&output);
        assert!(
            output.status.code() == Some(2) && text.contains(&format!("{option} = 1e9: must be")),
            "{text}"
        );
    }
    for place in ["0,0,1e30", "0,0,nan"] {
        let output = endowire().args(["vessel", "centreline", tube, "--from", place]).output().unwrap();
        let text = said(&output);
        assert!(text.contains(place) && text.contains("finite numbers of at most 1000000 mm"), "{text}");
    }
}
