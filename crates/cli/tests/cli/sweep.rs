//! Sweeps: killed at any moment and gone on with, in shards, with values that do not fit.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::time::Instant;

use crate::common::{assets, endowire, said};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

/// A wire pushed a little way into a tube, and a sweep of 24 runs of it, some of which must fail: a device as thick as the tube.
fn small(folder: &Path) -> PathBuf {
    let vessel = assets().join("vessels/curved_tube.stl");
    let scene = format!(
        "[vessel]\nfile = {vessel:?}\n[[device.section]]\nlength_mm = 100.0\nradius_mm = 0.445\nbending_stiffness_nmm2 = 5.0\n\
         [sheath]\nposition_mm = [0.0, 0.0, 1.0]\ndirection = [0.0, 0.0, 1.0]\n[method]\nname = \"kirchhoff\"\nelement_mm = 4.0\n\
         [[script]]\nadvance_mm = 60.0\nstep_mm = 2.0\n"
    );
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    let sweep = "scene = \"scene.toml\"\nseed = 5\nsamples = 4\n\
         [[axis]]\nkey = \"device.section[0].radius_mm\"\nlist = [0.3, 0.445, 40.0]\n\
         [[axis]]\nkey = \"vessel.wall.friction\"\ngrid = { from = 0.0, to = 0.2, count = 2 }\n\
         [[axis]]\nkey = \"device.section[0].bending_stiffness_nmm2\"\nlatin = { from = 1.0, to = 100.0, log = true }\n\
         [[axis]]\nkey = \"seed\"\nrandom = { from = 1, to = 1000, integer = true }\n";
    let path = folder.join("sweep.toml");
    std::fs::write(&path, sweep).unwrap();
    path
}

fn sweep(file: &Path, out: &Path, more: &[&str]) -> Output {
    endowire()
        .args(["sweep".as_ref(), file, "--out".as_ref(), out])
        .args(["--json"])
        .args(more)
        .output()
        .unwrap()
}

fn table(file: &Path, out: &Path, more: &[&str]) -> Vec<u8> {
    let output = sweep(file, out, more);
    assert!(output.status.success(), "{}", said(&output));
    std::fs::read(out.join("runs.parquet")).unwrap()
}

/// Blocks of the guide's chapter in a language, or of a file.
fn blocks(info: &str) -> Vec<String> {
    let guide = include_str!("../../../../docs/guide/12-sweeps.md");
    let parts = guide.split("\n```").filter_map(|block| block.strip_prefix(info)?.strip_prefix('\n'));
    parts.map(str::to_owned).collect()
}

#[cfg(unix)]
#[test]
fn the_recipes_of_the_guide_give_the_table_of_one_piece() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    std::os::unix::fs::symlink(assets(), root.join("assets")).unwrap();
    for (name, info) in [("tube.toml", "toml"), ("sweep.toml", "toml"), ("array.sh", "text")] {
        std::fs::write(root.join(name), &blocks(&format!("{info} file={name}"))[0]).unwrap();
    }
    let whole = table(&root.join("sweep.toml"), &root.join("out/whole"), &[]);
    let program = Path::new(env!("CARGO_BIN_EXE_endowire")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let shell = |command: &str, task: &str| {
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", command]).current_dir(root).env("PATH", &path);
        shell.env("SLURM_ARRAY_TASK_ID", task).env("SLURM_ARRAY_TASK_COUNT", "4");
        let output = shell.output().unwrap();
        assert!(output.status.success(), "{command}: {}", said(&output));
    };
    let consoles = blocks("console").join("\n");
    let merge = |out: &str| {
        let line = consoles.lines().find(|line| line.contains(&format!("merge {out}"))).unwrap();
        shell(&line[line.find("endowire").unwrap()..], "");
    };
    for task in ["3", "1", "4", "2"] {
        shell("sh array.sh", task);
    }
    merge("out/array");
    let parallel = consoles.lines().find(|line| line.starts_with("$ parallel")).unwrap();
    let (command, tasks) = parallel.split_once(" ::: ").unwrap();
    // What parallel does on each machine.
    let command = &command[command.find("endowire").unwrap()..];
    tasks.split(' ').for_each(|task| shell(&command.replace("{}", task), ""));
    merge("out/parallel");
    for name in ["array.parquet", "parallel.parquet"] {
        assert!(std::fs::read(root.join(name)).unwrap() == whole, "{name}");
    }
}

/// The rows of a table as text, each with names and values.
fn rows(path: &Path) -> Vec<Vec<(String, Field)>> {
    let reader = SerializedFileReader::new(std::fs::File::open(path).unwrap()).unwrap();
    let rows = reader.get_row_iter(None).unwrap();
    rows.map(|row| row.unwrap().get_column_iter().map(|(n, f)| (n.clone(), f.clone())).collect()).collect()
}

fn cell<'a>(row: &'a [(String, Field)], name: &str) -> &'a Field {
    &row.iter().find(|(column, _)| column == name).unwrap_or_else(|| panic!("{name}")).1
}

#[test]
fn a_row_for_each_run_also_where_it_failed() {
    let folder = tempfile::tempdir().unwrap();
    let file = small(folder.path());
    let out = folder.path().join("out");
    table(&file, &out, &[]);
    let rows = rows(&out.join("runs.parquet"));
    assert_eq!(rows.len(), 24);
    let mut stiffnesses = BTreeSet::new();
    for (number, row) in rows.iter().enumerate() {
        assert_eq!(*cell(row, "run"), Field::Long(number as i64));
        let radius = [0.3, 0.445, 40.0][number / 8];
        assert_eq!(*cell(row, "device.section[0].radius_mm"), Field::Double(radius));
        assert_eq!(*cell(row, "vessel.wall.friction"), Field::Double([0.0, 0.2][number / 4 % 2]));
        assert!(matches!(cell(row, "seed"), Field::Long(1..=1000)));
        match cell(row, "device.section[0].bending_stiffness_nmm2") {
            Field::Double(value) => stiffnesses.insert(format!("{value}")),
            other => panic!("{other}"),
        };
        if number < 16 {
            assert_eq!(*cell(row, "steps"), Field::Long(30));
            assert_eq!(*cell(row, "field_mj"), Field::Double(0.0), "without a field");
            assert_eq!(
                (cell(row, "inserted_mm"), cell(row, "failure")),
                (&Field::Double(60.0), &Field::Null)
            );
        } else {
            assert_eq!((cell(row, "inserted_mm"), cell(row, "steps")), (&Field::Null, &Field::Long(0)));
            assert!(matches!(cell(row, "failure"), Field::Str(text) if text.contains("radius_mm = 40")));
        }
    }
    // The same four draws in every combination of lists and grids.
    assert_eq!(stiffnesses.len(), 4);
}

#[test]
fn a_sweep_that_is_killed_again_and_again_gives_the_table_of_one_that_was_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = small(folder.path());
    let start = Instant::now();
    let whole = table(&file, &folder.path().join("whole"), &["--jobs", "1"]);
    let length = start.elapsed();
    let out = folder.path().join("killed");
    for kill in 0..20u32 {
        let mut child = endowire()
            .args(["sweep".as_ref(), file.as_path(), "--out".as_ref(), &out])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // From at once to half of the time that all takes, in an order without order.
        std::thread::sleep(length * (kill * 7 % 20) / 40);
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(table(&file, &out, &[]) == whole);
    let journal = std::fs::read_to_string(out.join("runs.jsonl")).unwrap();
    assert_eq!(journal.lines().count(), 1 + 24, "nothing twice");
    // Once more: there is nothing to do.
    let again = sweep(&file, &out, &[]);
    let reported: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(
        (&reported["done"], &reported["earlier"], &reported["failed"]),
        (&24.into(), &24.into(), &8.into())
    );
}

#[test]
fn a_line_without_an_end_is_done_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = small(folder.path());
    let out = folder.path().join("out");
    let whole = table(&file, &out, &[]);
    let journal = out.join("runs.jsonl");
    let text = std::fs::read(&journal).unwrap();
    let head = text.iter().position(|byte| *byte == b'\n').unwrap();
    for end in [0, head / 2, head, head + 1, head + 40, text.len() - 1, text.len()] {
        std::fs::write(&journal, &text[..end]).unwrap();
        assert!(table(&file, &out, &[]) == whole, "cut at {end}");
    }
    // What is damaged otherwise is reported.
    std::fs::write(&journal, [&text[..head + 1], b"{}\n"].concat()).unwrap();
    let output = sweep(&file, &out, &[]);
    let said = said(&output);
    assert!(output.status.code() == Some(2) && said.contains("line 2: the key `"), "{said}");
}

#[test]
fn shards_in_any_order_give_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = small(folder.path());
    let whole = table(&file, &folder.path().join("whole"), &[]);
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    for (shard, out) in [("1/3", &a), ("2/3", &b), ("3/3", &a)] {
        let output = sweep(&file, out, &["--shard", shard]);
        assert!(output.status.success(), "{}", said(&output));
    }
    assert!(a.join("runs-1-of-3.parquet").exists() && a.join("runs-3-of-3.jsonl").exists());
    let merged = folder.path().join("merged.parquet");
    let merge = |folders: &[&PathBuf]| {
        endowire().args(["sweep", "merge"]).args(folders).arg("--out").arg(&merged).output().unwrap()
    };
    for order in [[&a, &b], [&b, &a]] {
        let output = merge(&order);
        assert!(output.status.success(), "{}", said(&output));
        assert!(std::fs::read(&merged).unwrap() == whole);
    }
    let output = merge(&[&b]);
    let said = said(&output);
    assert!(output.status.code() == Some(2), "{said}");
    assert!(said.contains("16 of 24 runs are missing, run 0 the first"), "{said}");
}

#[test]
fn recordings_are_those_of_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = small(folder.path());
    let text = std::fs::read_to_string(&file).unwrap().replace("samples", "record = \"shapes\"\nsamples");
    std::fs::write(&file, text.replace("[0.3, 0.445, 40.0]", "[0.3]")).unwrap();
    let out = folder.path().join("out");
    table(&file, &out, &[]);
    let ours = out.join("recordings/000003");
    let alone = folder.path().join("alone");
    let scene = out.join("recordings/000003.toml");
    let output =
        endowire().args(["run".as_ref(), scene.as_path(), "--out".as_ref(), &alone]).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    for name in ["steps.csv", "shapes.npz"] {
        assert!(
            std::fs::read(ours.join(name)).unwrap() == std::fs::read(alone.join(name)).unwrap(),
            "{name}"
        );
    }
    let summary = |folder: &Path| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.join("summary.json")).unwrap()).unwrap()
    };
    let (mut ours, mut alone) = (summary(&ours), summary(&alone));
    for summary in [&mut ours, &mut alone] {
        for changing in ["step_time_s", "wall_time_s", "frames", "renderer"] {
            summary.as_object_mut().unwrap().remove(changing);
        }
    }
    assert_eq!(ours, alone);
}

#[test]
fn what_is_wrong_with_a_sweep_is_reported_on_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = small(folder.path());
    let good = std::fs::read_to_string(&file).unwrap();
    for (from, to, reported) in [
        ("vessel.wall.friction", "vessel.wall.frction", "did you mean `friction`?"),
        ("vessel.wall.friction", "vessel.wall.frction", "sweep.toml: axis[1]: vessel.wall.frction = 0"),
        (
            "[0.3, 0.445, 40.0]",
            "[0.3, \"thick\"]",
            "device.section[0].radius_mm = \"thick\": radius_mm: must be a number, not the text \"thick\"",
        ),
        (
            "section[0].radius_mm",
            "section[1].radius_mm",
            "the scene has 1 in that list, and [0] is the first",
        ),
        ("samples = 4", "", "samples = none: an axis is drawn"),
        ("samples = 4", "samples = 0", "samples = 0: must be 1 to 1000000"),
        ("samples = 4", "samples = 400000", "axis = 2400000 runs: at most 1000000"),
        (
            "from = 1.0, to = 100.0",
            "from = 0.0, to = 100.0",
            "axis[2].latin.from = 0: must be above 0 where log",
        ),
        ("latin = {", "lattin = {", "did you mean `latin`?"),
        ("vessel.wall.friction", "seed", "axis[3].key = seed: is the key of another axis too"),
        (
            "[[axis]]",
            "[[axis]]\nkey = \"vessel.wall\"\nlist = [{ modulus_n_per_mm2 = 1.0 }]\n[[axis]]",
            "axis[2].key = vessel.wall.friction: overlaps with that of another axis, vessel.wall: keep one",
        ),
        (
            "[[axis]]",
            "[set]\n\"device.section[0].length_mm\" = 200.0\n[[axis]]\nkey = \"device.section\"\nlist = [[]]\n[[axis]]",
            "axis[0].key = device.section: with device.section[0].length_mm in it is given in [set] too",
        ),
        ("vessel.wall.friction", "view.every", "a view changes no row: give record = \"frames\""),
        ("[[axis]]", "[set]\nseed = 1\n[[axis]]", "axis[3].key = seed: is given in [set] too"),
        ("scene = \"scene.toml\"", "scene = \"scne.toml\"", "scne.toml: No such file"),
        ("samples = 4", "samples = 4\nrecord = \"films\"", "unknown name `films`"),
    ] {
        assert!(good.contains(from), "{from}");
        std::fs::write(&file, good.replacen(from, to, 1)).unwrap();
        let output = sweep(&file, &folder.path().join("out"), &[]);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(reported) && said.trim_end().lines().count() == 1, "{reported}: {said}");
    }
    // Rows of another sweep are not mixed with.
    std::fs::write(&file, &good).unwrap();
    let out = folder.path().join("out");
    table(&file, &out, &[]);
    std::fs::write(&file, good.replace("seed = 5", "seed = 6")).unwrap();
    let said = String::from_utf8_lossy(&sweep(&file, &out, &[]).stderr).into_owned();
    assert!(said.contains("has rows of another sweep"), "{said}");
}
