//! Several instruments that lie in one another, from the scene to the pictures.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{endowire, reported, said, scene_text, text};
use serde_json::Value;

/// The wire in the vertebral catheter, with small pictures of the end alone; each change replaces a piece of the text.
fn scene(folder: &Path, changes: &[(&str, &str)]) -> PathBuf {
    let mut text = scene_text("arch_vertebral.toml", &[("[320, 320]", "[32, 24]")]);
    for (piece, other) in changes {
        assert!(text.contains(piece), "{piece}");
        text = text.replacen(piece, other, 1);
    }
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn run(arguments: &[&Path]) -> Output {
    endowire().arg("run").args(arguments).output().unwrap()
}

/// Rows of a table, each a list of texts, without the head.
fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn a_wire_leads_a_catheter_into_the_arch_and_is_withdrawn() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path(), &[]);
    let out = folder.path().join("out");
    let output = run(&[&scene, "--out".as_ref(), &out]);
    assert!(output.status.success(), "{}", said(&output));

    let summary: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert!(summary["converged"].as_bool().unwrap() && summary["steps"] == 155, "{summary}");
    let reported =
        |k: usize| (summary["instruments"][k]["name"].as_str(), &summary["instruments"][k]["inserted_mm"]);
    assert_eq!(reported(0).0.zip(reported(1).0), Some(("wire", "catheter")));
    assert_eq!((reported(0).1.as_f64(), reported(1).1.as_f64().map(f64::round)), (Some(0.0), Some(200.0)));

    let rows = rows(&out.join("instruments.csv"));
    assert_eq!(rows.len(), 2 * 155);
    let number = |row: &[String], column: usize| row[column].parse::<f64>().unwrap();
    // Where the catheter waits for the wire to go on: it is felt where the wire is not bare.
    let (wire, catheter) = (&rows[2 * 79], &rows[2 * 79 + 1]);
    assert_eq!((wire[1].as_str(), catheter[1].as_str()), ("wire", "catheter"));
    assert!((number(wire, 4) - 220.0).abs() < 1e-9 && (number(catheter, 4) - 160.0).abs() < 1e-9);
    assert!((number(wire, 14) - 60.0).abs() < 1e-9 && (number(catheter, 14) - 160.0).abs() < 1e-9);
    let apart: f64 = (9..12).map(|c| (number(wire, c) - number(catheter, c)).powi(2)).sum();
    assert!((50.0..60.0).contains(&apart.sqrt()), "{apart}");

    let frames = folder.path().join("frames");
    let render: [&Path; 7] = [
        "render".as_ref(),
        &out,
        "--from=80".as_ref(),
        "--to=80".as_ref(),
        "--view=both".as_ref(),
        "--out".as_ref(),
        &frames,
    ];
    let output = endowire().args(render).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert!(frames.join("step_000080_3d.png").exists() && frames.join("step_000080_fluoro.png").exists());
}

#[test]
fn a_run_of_several_instruments_goes_on_as_if_it_had_been_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (whole, part, state) = (at("whole"), at("part"), at("state"));
    let withdrawal = "[[script]]\ninstrument = \"wire\"\nwithdraw = true\nstep_mm = 4.0\n";
    let output = run(&[
        &scene(folder.path(), &[(withdrawal, "")]),
        "--out".as_ref(),
        &part,
        "--save-state".as_ref(),
        &state,
    ]);
    assert!(output.status.success(), "{}", said(&output));
    let with_friction = scene(folder.path(), &[("inserted_mm = 60.0", "friction = 0.1\ninserted_mm = 60.0")]);
    let output = run(&[&with_friction, "--out".as_ref(), &at("none"), "--resume".as_ref(), &state]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("the device is not the same"), "{}", said(&output));
    let scene = scene(folder.path(), &[]);
    assert!(run(&[&scene, "--out".as_ref(), &whole]).status.success());
    let output = run(&[&scene, "--out".as_ref(), &part, "--resume".as_ref(), &state]);
    assert!(output.status.success(), "{}", said(&output));
    for name in ["steps.csv", "instruments.csv", "shapes.npz"] {
        assert!(
            std::fs::read(whole.join(name)).unwrap() == std::fs::read(part.join(name)).unwrap(),
            "{name}"
        );
    }
}

#[test]
fn what_instruments_cannot_do_is_reported_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let name = "instrument = \"catheter\"\nadvance_mm = 40.0";
    for (piece, other, reported) in [
        (
            name,
            "instrument = \"cathter\"\nadvance_mm = 40.0",
            "script[2].instrument = \"cathter\": did you mean \"catheter\"?",
        ),
        (name, "advance_mm = 40.0", "script[2].instrument = none: say which one moves: wire, catheter"),
        (name, "instrument = \"catheter\"\nadvance_mm = 900.0", "script[2].advance_mm = 900: in its step"),
        (
            "inserted_mm = 60.0",
            "inserted_mm = 2601.0",
            "instrument[0].inserted_mm = 2601: must be 0 to its length",
        ),
        (
            "inserted_mm = 60.0",
            "inserted_mm = 60.0\nmay_lead = true",
            "instrument[0].may_lead = true: nothing lies in the first instrument",
        ),
        ("inserted_mm = 60.0", "inserted = 60.0", "did you mean `inserted_mm`?"),
        (
            "wire_035_hydrophilic_angled.toml",
            "catheter_6f_judkins_left_4.toml",
            "wire.radius_mm = 1: the lumen of \"catheter\" has radius 0.508 mm",
        ),
        (
            "inserted_mm = 40.0",
            "inserted_mm = 40.0\nmay_lead = false",
            "script[3]: in its step 6, catheter.inserted_mm = 200: must not lead",
        ),
        ("[sheath]", "[device]\n[sheath]", "instrument = 2: [device] is given too: keep one of the two"),
        (
            "name = \"catheter\"",
            "name = \"wire\"",
            "instrument[1].name = \"wire\": every instrument has a name of its own",
        ),
        ("[view.xray]", "[[view.device]]\n[view.xray]", "view.device = 1: describes one device"),
        ("name = \"kirchhoff\"", "name = \"mass-spring\"", "pushes one device and no more"),
    ] {
        let output = run(&[&scene(folder.path(), &[(piece, other)]), "--out".as_ref(), &out]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(reported), "{reported}: {}", said(&output));
        assert!(!out.exists(), "{reported}");
    }
}

#[test]
fn what_a_coil_fills_of_a_sac_is_reported_step_by_step_and_by_a_run_that_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |line: &str, sac: &str| {
        let text = scene_text(
            "coil.toml",
            &[
                ("advance_mm = 60.0\nstep_mm = 0.5", line),
                ("dome_mm = [2.0, 6.0, 36.0]", sac),
                ("element_mm = 0.75", "element_mm = 1.0"),
                ("views = [\"3d\", \"fluoro\"]", "views = []"),
            ],
        );
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, text).unwrap();
        file
    };
    let dome = "dome_mm = [2.0, 6.0, 36.0]";
    let file = scene("advance_mm = 6.0\nstep_mm = 0.5", dome);
    let (out, state) = (folder.path().join("out"), folder.path().join("state"));
    let run = |more: &[&str]| {
        let mut args = vec!["run", text(&file), "--out", text(&out), "--save-state", text(&state), "--json"];
        args.extend(more);
        reported(&endowire().args(&args).output().unwrap())
    };
    let first = run(&[]);
    let table = || -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(out.join("packing.csv")).unwrap();
        let number = |cell: &str| cell.parse().unwrap_or(f64::from(u8::from(cell == "true")));
        text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
    };
    assert_eq!(table().len(), 12);
    let packing = &first["packing"];
    let diameter_mm = 0.0125 * 25.4;
    let inside_mm = 6.0 - packing["outside_mm"].as_f64().unwrap();
    let expected = std::f64::consts::FRAC_PI_4 * diameter_mm * diameter_mm * inside_mm;
    let density = packing["density"].as_f64().unwrap();
    assert!((density * packing["sac_mm3"].as_f64().unwrap() / expected - 1.0).abs() < 1e-6, "{packing}");
    assert_eq!(packing["herniated_steps"], 0);
    assert!(table().windows(2).all(|pair| pair[0][2] < pair[1][2]));
    // More of the same script, from where it was.
    scene("advance_mm = 8.0\nstep_mm = 0.5", dome);
    let second = run(&["--resume", text(&state)]);
    assert_eq!(table().len(), 16);
    assert!(second["packing"]["density"].as_f64().unwrap() > density);
    // Nothing more of it, into a folder without the earlier rows.
    let other = folder.path().join("other");
    let args = ["run", text(&file), "--resume", text(&state), "--out", text(&other), "--json"];
    let third = reported(&endowire().args(args).output().unwrap());
    assert_eq!(third["packing"]["density"], second["packing"]["density"]);
    // A place that is not in the vessel, by its key.
    scene("advance_mm = 6.0\nstep_mm = 0.5", "dome_mm = [90.0, 6.0, 36.0]");
    let refused = endowire().args(["run", text(&file), "--out", text(&out)]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("vessel.sac.dome_mm = "), "{}", said(&refused));
}
