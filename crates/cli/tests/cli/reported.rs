//! What commands say of how their steps went, and their exit codes: steps without an equilibrium, jumps, what ended a script, forces of the wall.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{document, endowire, reported, said, text};
use serde_json::{Value, json};

/// A wire pushed slantwise into a tube that it leaves in the end.
const SCENE: &str = r#"
[vessel]
tree = "tube.csv"
edge_mm = 2.0

[[device.section]]
length_mm = 120.0
radius_mm = 0.5
bending_stiffness_nmm2 = 10.0

[sheath]
position_mm = [1.0, 0.0, 0.0]
direction = [1.0, 0.4, 0.0]

[method]
name = "kirchhoff"
element_mm = 4.0

[[script]]
advance_mm = 40.0
step_mm = 2.0

[view]
views = []
"#;

/// Steps of this one do not have the time to find an equilibrium once it touches the wall.
const HASTY: [&str; 2] =
    ["--set=method={ name = \"mass-spring\", element_mm = 4.0, max_iterations = 20 }", "--json"];

fn scene(folder: &Path, changes: &[(&str, &str)]) -> PathBuf {
    std::fs::write(folder.join("tube.csv"), "0 0 0 4 -1 near\n60 0 0 4 0 far\n").unwrap();
    let path = folder.join("scene.toml");
    let changed = changes.iter().fold(SCENE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    std::fs::write(&path, changed).unwrap();
    path
}

fn call(command: &str, file: &Path, out: &Path, more: &[&str]) -> Output {
    endowire().args([command, text(file), "--out", text(out)]).args(more).output().unwrap()
}

/// A column of steps.csv.
fn column(out: &Path, name: &str) -> Vec<String> {
    let mut reader = csv::Reader::from_path(out.join("steps.csv")).unwrap();
    let place =
        reader.headers().unwrap().iter().position(|one| one == name).unwrap_or_else(|| panic!("{name}"));
    reader.records().map(|row| row.unwrap()[place].to_owned()).collect()
}

fn numbers(out: &Path, name: &str) -> Vec<f64> {
    column(out, name).iter().map(|text| text.parse().unwrap()).collect()
}

#[test]
fn steps_without_an_equilibrium_end_a_run_with_exit_code_1_unless_they_are_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), &[]);
    let [bad, allowed, good] = ["bad", "allowed", "good"].map(|name| folder.path().join(name));
    let output = call("run", &file, &bad, &HASTY);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let line = said(&output);
    assert_eq!(line.trim_end().lines().count(), 1, "{line}");
    let summary = document(bad.join("summary.json"));
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap(), summary);
    let (count, first) = (&summary["unconverged_steps"], &summary["first_unconverged_step"]);
    assert!(
        line.contains(&format!("{count} of 20 steps found no equilibrium, the first step {first}: ")),
        "{line}"
    );
    assert!(line.contains("--allow-unconverged") && line.contains("all are kept in"), "{line}");
    // All of it is written, and the table says the same.
    assert_eq!((&summary["complete"], &summary["converged"]), (&json!(true), &json!(false)));
    assert_eq!((&summary["steps"], &summary["ended_by"]), (&json!(20), &json!("script")));
    let converged = column(&bad, "converged");
    let unconverged = converged.iter().filter(|one| *one == "false").count();
    assert!(unconverged > 0 && unconverged < 20, "{unconverged}");
    assert_eq!(*count, json!(unconverged));
    assert_eq!(*first, json!(1 + converged.iter().position(|one| one == "false").unwrap()));
    // The same, allowed.
    let output = call("run", &file, &allowed, &[HASTY[0], "--allow-unconverged"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(
        said(&output).contains(&format!("{unconverged} of 20 steps without an equilibrium, the first step"))
    );
    assert_eq!(column(&allowed, "converged"), converged);
    // The twin finds all of them, and needs no leave.
    let output = call("run", &file, &good, &[]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("steps          all in equilibrium, no jump"), "{}", said(&output));
    let summary = document(good.join("summary.json"));
    assert_eq!(summary["unconverged_steps"], 0);
    assert!(summary["first_unconverged_step"].is_null());
    assert!(column(&good, "converged").iter().all(|one| one == "true"));
}

#[test]
fn what_is_counted_goes_on_with_a_run_that_is_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), &[]);
    let [out, whole, state] = ["out", "whole", "state"].map(|name| folder.path().join(name));
    let allowed = [HASTY[0], "--allow-unconverged"];
    assert_eq!(call("run", &file, &whole, &allowed).status.code(), Some(0));
    scene(folder.path(), &[("advance_mm = 40.0", "advance_mm = 30.0")]);
    let part = call("run", &file, &out, &[allowed[0], allowed[1], "--save-state", text(&state)]);
    assert_eq!(part.status.code(), Some(0), "{}", said(&part));
    let file = scene(folder.path(), &[]);
    let rest = call("run", &file, &out, &[HASTY[0], "--resume", text(&state)]);
    assert_eq!(rest.status.code(), Some(1), "{}", said(&rest));
    let [a, b] = [&out, &whole].map(|folder| document(folder.join("summary.json")));
    for key in [
        "unconverged_steps",
        "first_unconverged_step",
        "jumps",
        "relaxations",
        "max_imbalance",
        "max_wall_force",
    ] {
        assert_eq!(a[key], b[key], "{key}");
    }
}

#[test]
fn what_ended_a_script_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let ended = |name: &str, changes: &[(&str, &str)]| {
        let (file, out) = (scene(folder.path(), changes), folder.path().join(name));
        let output = call("run", &file, &out, &[]);
        let summary = document(out.join("summary.json"));
        let page = endowire().args(["report", text(&out)]).output().unwrap();
        assert!(page.status.success(), "{}", said(&page));
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        (output.status.code(), summary, said(&output), page)
    };
    let until = |what: &str| format!("advance_mm = 100.0\nuntil = {{ {what} }}");
    let near = until("tip_within_mm = 8.0, target = \"far\"");
    let (code, summary, said, page) = ended("near", &[("advance_mm = 40.0", &near)]);
    assert_eq!((code, &summary["ended_by"]), (Some(0), &json!("arrived")), "{said}");
    assert_eq!(summary["until"][0]["after_step"], summary["steps"]);
    assert!(said.contains("ended          arrived: script[0]: the tip is at its target"), "{said}");
    assert!(page.contains("\"what\":\"arrived\"") && page.contains("wall_force_tip_n"));
    // A line that follows is what ends it then; the line that arrived is still an event of the page.
    let more = format!("{near}\nstep_mm = 2.0\n[[script]]\nretract_mm = 4.0");
    let (code, summary, said, page) = ended("back", &[("advance_mm = 40.0", &more)]);
    assert_eq!((code, &summary["ended_by"]), (Some(0), &json!("script")), "{said}");
    assert!(summary["until"][0]["after_step"].as_u64() < summary["steps"].as_u64());
    assert!(page.contains("\"what\":\"arrived\"") && !said.contains("ended  "), "{said}");
    let pushed = until("push_force_n = 0.001");
    let (code, summary, said, _) = ended("pushed", &[("advance_mm = 40.0", &pushed)]);
    assert_eq!((code, &summary["ended_by"]), (Some(0), &json!("push_force")), "{said}");
    // The twin: nothing is met, and the tip leaves.
    let (code, summary, said, page) = ended("left", &[("advance_mm = 40.0", "advance_mm = 119.0")]);
    assert_eq!((code, &summary["ended_by"]), (Some(1), &json!("left")), "{said}");
    assert_eq!(summary["failure"]["kind"], "left");
    assert!(
        said.contains("left           the tip is out of opening") && page.contains("\"what\":\"left\""),
        "{said}"
    );
    assert!(!page.contains("\"what\":\"arrived\""));
    // A lumen that becomes narrower than the wire.
    std::fs::write(
        folder.path().join("funnel.csv"),
        "0 0 0 0.8 -1\n20 0 0 0.8 0\n30 0 0 0.2 1\n60 0 0 0.2 2\n",
    )
    .unwrap();
    let rigid = "edge_mm = 0.2\n[vessel.wall]\nmodulus_n_per_mm2 = 1e6\nfriction = 0.5";
    let narrow = [
        ("tube.csv", "funnel.csv"),
        ("edge_mm = 2.0", rigid),
        ("0.4, 0.0]", "0.0, 0.0]"),
        ("nmm2 = 10.0", "nmm2 = 500.0"),
    ];
    let (code, summary, said, page) = ended("blocked", &narrow);
    assert_eq!((code, &summary["ended_by"]), (Some(1), &json!("blocked")), "{said}");
    assert!(page.contains("\"what\":\"blocked\""));
}

#[test]
fn forces_of_the_wall_are_those_of_the_contacts() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (scene(folder.path(), &[]), folder.path().join("out"));
    let summary = reported(&call("run", &file, &out, &["--json"]));
    let mut archive = zip::ZipArchive::new(std::fs::File::open(out.join("shapes.npz")).unwrap()).unwrap();
    let mut array = |name: &str| {
        npyz::NpyFile::new(archive.by_name(&format!("{name}.npy")).unwrap()).unwrap().into_vec::<f64>()
    };
    let (forces, places) = (array("contact_forces_n").unwrap(), array("contact_positions_mm").unwrap());
    let offsets: Vec<i64> =
        npyz::NpyFile::new(archive.by_name("contact_offsets.npy").unwrap()).unwrap().into_vec().unwrap();
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [sum, largest, at_tip] =
        ["wall_force_sum_n", "wall_force_largest_n", "wall_force_tip_n"].map(|name| numbers(&out, name));
    let tips = ["tip_x_mm", "tip_y_mm", "tip_z_mm"].map(|name| numbers(&out, name));
    let (mut most, mut beside) = ([0.0f64; 3], false);
    for step in 0..20 {
        let rows = offsets[step] as usize..offsets[step + 1] as usize;
        let sizes: Vec<f64> = rows.clone().map(|k| norm(&forces[3 * k..3 * k + 3])).collect();
        let tip = |k: &usize| norm(&[0, 1, 2].map(|c| places[3 * k + c] - tips[c][step])) <= 0.5;
        let near: f64 = rows.clone().filter(tip).map(|k| norm(&forces[3 * k..3 * k + 3])).sum();
        beside |= near > 0.0 && near < sizes.iter().sum();
        let expected = [sizes.iter().sum(), sizes.iter().copied().fold(0.0, f64::max), near];
        for (k, (reported, expected)) in
            [sum[step], largest[step], at_tip[step]].iter().zip(expected).enumerate()
        {
            assert!((reported - expected).abs() < 1e-12, "step {step}, {k}: {reported} {expected}");
            most[k] = most[k].max(expected);
        }
    }
    assert!(beside, "the tip presses, and not alone: {most:?}");
    for (k, key) in ["sum_n", "largest_n", "tip_n"].iter().enumerate() {
        assert!((summary["max_wall_force"][key].as_f64().unwrap() - most[k]).abs() < 1e-12, "{key}");
    }
    assert_eq!(summary["wall_force"]["sum_n"].as_f64().unwrap(), sum[19]);
    assert!(numbers(&out, "relaxations").iter().chain(&numbers(&out, "imbalance")).all(|one| *one == 0.0));
}

#[test]
fn a_sweep_counts_runs_with_such_steps_and_has_them_in_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let hasty = "[method]\nname = \"mass-spring\"\nelement_mm = 4.0\nmax_iterations = 20\n";
    scene(folder.path(), &[("[method]\nname = \"kirchhoff\"\nelement_mm = 4.0\n", hasty)]);
    let sweep = folder.path().join("sweep.toml");
    let axis = "scene = \"scene.toml\"\n[[axis]]\nkey = \"method\"\nlist = [{ name = \"kirchhoff\", element_mm = 4.0 }, \
                { name = \"mass-spring\", element_mm = 4.0, max_iterations = 20 }]\n";
    std::fs::write(&sweep, axis).unwrap();
    let out = folder.path().join("out");
    let output = call("sweep", &sweep, &out, &["--json"]);
    let counted = reported(&output);
    assert_eq!((&counted["failed"], &counted["unconverged"]), (&json!(0), &json!(1)));
    assert!(
        said(&output).contains("0 of them failed, 1 have steps without an equilibrium"),
        "{}",
        said(&output)
    );
    let journal = std::fs::read_to_string(out.join("runs.jsonl")).unwrap();
    let rows: Vec<Value> = journal.lines().skip(1).map(|line| serde_json::from_str(line).unwrap()).collect();
    let row = |run: u64| &rows.iter().find(|row| row["run"] == run).unwrap()["outcome"];
    assert_eq!((&row(0)["unconverged_steps"], &row(0)["converged"]), (&json!(0), &json!(true)));
    assert!(row(1)["unconverged_steps"].as_u64() > Some(0) && row(1)["converged"] == false);
    assert!(row(0)["max_wall_force"]["tip_n"].as_f64() > Some(0.0) && row(0)["ended_by"] == "script");
    // As columns, on the page of the sweep too.
    assert!(endowire().args(["report", text(&out)]).output().unwrap().status.success());
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    for name in [
        "wall_force_sum_n",
        "max_wall_force_tip_n",
        "unconverged_steps",
        "relaxations",
        "max_imbalance",
        "ended_by",
    ] {
        assert!(page.contains(&format!("\"{name}\"")), "{name}");
    }
    // The twin has none.
    std::fs::write(&sweep, axis.replace(", max_iterations = 20", "").replace("mass-spring", "kirchhoff"))
        .unwrap();
    let good = call("sweep", &sweep, &folder.path().join("good"), &["--json"]);
    assert_eq!(reported(&good)["unconverged"], 0);
    assert!(!said(&good).contains("without an equilibrium"), "{}", said(&good));
}

#[test]
fn pictures_of_steps_without_an_equilibrium_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), &[]);
    let out = folder.path().join("frames");
    let more = ["--set", "backend=cpu", "--size", "32", HASTY[0]];
    let output = call("fluoro", &file, &out, &[&more[..], &["--json"]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("of 20 steps found no equilibrium")
            && out.join("frame_000000_fluoro.png").exists()
    );
    let written: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(written["unconverged_steps"].as_u64() > Some(0) && written["steps"] == 20, "{written}");
    let allowed = call("fluoro", &file, &out, &[&more[..], &["--allow-unconverged"]].concat());
    assert_eq!(allowed.status.code(), Some(0), "{}", said(&allowed));
    // The twins: without a device, and with one in equilibrium.
    assert!(call("fluoro", &file, &out, &[&more[..], &["--steps", "0"]].concat()).status.success());
    let good = call("fluoro", &file, &out, &[&more[..4], &["--json"]].concat());
    assert_eq!(reported(&good)["unconverged_steps"], 0);

    let spec = folder.path().join("dataset.toml");
    let text = "scenes = [\"scene.toml\"]\nposes = 1\nmoments = 2\n[vary]\nprogress = [0.9, 1.0]\n[view]\nsize_px = [32, 32]\nbackend = \"cpu\"\n";
    std::fs::write(&spec, text).unwrap();
    let data = folder.path().join("data");
    let output = call("dataset", &spec, &data, &HASTY);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("2 of 2 pictures are of steps that found no equilibrium"),
        "{}",
        said(&output)
    );
    let images = document(data.join("annotations.json"))["images"].clone();
    assert_eq!((&images[0]["converged"], &images[1]["converged"]), (&json!(false), &json!(false)));
    // All is there: the call that allows it draws nothing.
    let written = reported(&call("dataset", &spec, &data, &[&HASTY[..], &["--allow-unconverged"]].concat()));
    assert_eq!((&written["drawn"], &written["unconverged"]), (&json!(0), &json!(2)));
    let written = reported(&call("dataset", &spec, &folder.path().join("good"), &["--json"]));
    assert_eq!((&written["drawn"], &written["unconverged"]), (&json!(2), &json!(0)));
}

#[test]
fn a_recording_with_such_steps_is_drawn_with_a_word_on_them() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), &[]);
    let [bad, good] = ["bad", "good"].map(|name| folder.path().join(name));
    assert!(call("run", &file, &bad, &[HASTY[0], "--allow-unconverged"]).status.success());
    assert!(call("run", &file, &good, &[]).status.success());
    let render = |run: &Path| {
        let output = endowire()
            .args([
                "render",
                text(run),
                "--from",
                "20",
                "--size",
                "32",
                "--view",
                "fluoro",
                "--set",
                "backend=cpu",
            ])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", said(&output));
        said(&output)
    };
    assert!(render(&bad).contains("are no equilibria: steps.csv says which"));
    assert!(!render(&good).contains("no equilibria"));
}

#[test]
fn a_session_counts_what_is_done_and_not_what_is_taken_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), &[]);
    let inputs = folder.path().join("inputs.jsonl");
    let mut lines = String::new();
    for _ in 0..40 {
        lines += "{\"do\":\"nudge\",\"mm\":1}\n{\"do\":\"wait\",\"ticks\":1}\n";
    }
    lines += "{\"do\":\"go_to\",\"step\":0}\n{\"do\":\"redo\"}\n{\"do\":\"quit\"}\n";
    std::fs::write(&inputs, lines).unwrap();
    let session = |more: &[&str]| {
        let record = folder.path().join("played.toml");
        let output = endowire()
            .args([
                "play",
                text(&file),
                "--record",
                text(&record),
                "--headless",
                "--size",
                "64",
                "--inputs",
                text(&inputs),
            ])
            .args(more)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", said(&output));
        let answers = String::from_utf8_lossy(&output.stdout).into_owned();
        let counts = answers.lines().map(|line| {
            serde_json::from_str::<Value>(line).unwrap()["readout"]["unconverged_steps"].as_u64().unwrap()
        });
        (counts.collect::<Vec<_>>(), said(&output))
    };
    let (counts, end) = session(&HASTY[..1]);
    let most = counts[79];
    assert!(most > 0 && counts[..80].is_sorted(), "{counts:?}");
    // All is taken back, and carried out again.
    assert_eq!(counts[80], 0);
    assert!(counts[81] <= most && end.contains("steps are recorded in"), "{counts:?} {end}");
    if counts[81] > 0 {
        assert!(end.contains(&format!(", {} without an equilibrium", counts[81])), "{end}");
    }
    let (counts, end) = session(&[]);
    assert!(
        counts.iter().all(|count| *count == 0) && !end.contains("without an equilibrium"),
        "{counts:?} {end}"
    );
}
