//! The page of a run: all in one file, and what a browser shows of it.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{endowire, said, scene_text};

/// A run in the curved tube with two frames, and its page.
fn page(folder: &Path) -> PathBuf {
    let changes =
        [("advance_mm = 200.0", "advance_mm = 90.0"), ("size_px = [640, 640]", "size_px = [96, 64]")];
    let text = scene_text("curved_tube.toml", &changes);
    let (scene, run) = (folder.join("short.toml"), folder.join("run"));
    std::fs::write(&scene, text).unwrap();
    let done = endowire().arg("run").arg(&scene).arg("--quiet").arg("--out").arg(&run).output().unwrap();
    assert_eq!((done.status.code(), done.stderr.len()), (Some(0), 0), "{done:?}");
    let reported = endowire().arg("report").arg(&run).output().unwrap();
    assert_eq!(reported.status.code(), Some(0), "{reported:?}");
    run.join("report.html")
}

/// Whether a page names no other place, and is forbidden to load anything from any.
fn loads_nothing(page: &str) -> bool {
    !page.replace("http-equiv", "").contains("http") && page.contains("content=\"default-src 'none'; ")
}

#[test]
fn a_page_is_whole_and_names_where_it_comes_from() {
    let folder = tempfile::tempdir().unwrap();
    let page = page(folder.path());
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.len() < 5_000_000, "{} bytes", text.len());
    for outside in ["http:", "https:", "src=\"", "@import", "/*DATA*/"] {
        assert!(!text.contains(outside), "{outside}");
    }
    let summary = std::fs::read_to_string(folder.path().join("run/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert!(text.contains(summary["scene_hash"].as_str().unwrap()));
    // A folder without a run is reported as such.
    let none = endowire().arg("report").arg(folder.path()).output().unwrap();
    assert_eq!(none.status.code(), Some(2));
    assert!(said(&none).contains("recorded run"));
    let none = endowire().arg("report").arg(folder.path().join("nowhere")).output().unwrap();
    assert!(said(&none).contains("recorded run"), "{}", said(&none));
}

/// The document in a page of a run.
fn data(page: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(page).unwrap();
    let (_, data) = text.split_once("const data = ").unwrap();
    serde_json::from_str(data.split_once(";\n").unwrap().0).unwrap()
}

#[test]
fn a_page_in_another_scene_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let page = page(folder.path());
    let run = folder.path().join("run");
    let report = |scene: &Path| {
        let output = endowire().arg("report").arg(&run).arg("--scene").arg(scene).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        (said(&output), data(&page)["summary"]["other_scene"].clone())
    };
    let other = folder.path().join("other.toml");
    std::fs::write(&other, scene_text("loop.toml", &[])).unwrap();
    let (reported, shown) = report(&other);
    assert!(reported.contains("other.toml: this is the scene \"loop\", and the run in"), "{reported}");
    assert!(shown.as_str().unwrap().contains("recorded in \"curved_tube\""), "{shown}");
    // Changed, and not another.
    let short = std::fs::read_to_string(folder.path().join("short.toml")).unwrap();
    std::fs::write(&other, format!("# a remark\n{short}")).unwrap();
    assert!(report(&other).0.contains("is not as it was when the run in"));
    // The twin: the same scene elsewhere.
    std::fs::write(&other, short).unwrap();
    let (reported, shown) = report(&other);
    assert!(!reported.contains("other.toml") && shown.is_null(), "{reported} {shown}");
    // A run with the script of another file is in its scene too.
    let script = folder.path().join("script.toml");
    std::fs::write(&script, "[[script]]\nadvance_mm = 10.0\nstep_mm = 2.0\n").unwrap();
    let scene = folder.path().join("short.toml");
    let files = ["run".as_ref(), scene.as_os_str(), "--script".as_ref(), script.as_os_str()];
    let again = endowire().args(files).arg("--quiet").arg("--out").arg(&run).output().unwrap();
    assert_eq!(again.status.code(), Some(0), "{}", said(&again));
    let output = endowire().arg("report").arg(&run).output().unwrap();
    assert!(!said(&output).contains("has changed"), "{}", said(&output));
}

#[test]
fn pages_fit_into_narrow_windows_and_tell_an_interrupted_run_as_one() {
    let Some(browser) = browser() else {
        eprintln!("skipped: there is no Chromium to open the page in");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let page = page(folder.path());
    let summary = folder.path().join("run/summary.json");
    let mut reported: serde_json::Value = serde_json::from_slice(&std::fs::read(&summary).unwrap()).unwrap();
    let steps = reported["steps"].as_u64().unwrap();
    (reported["ended_by"], reported["converged"]) = ("interrupted".into(), false.into());
    reported["failure"] =
        serde_json::json!({"step": steps + 1, "reason": "interrupted in it", "kind": "interrupted"});
    reported["renderer"] = "a_name_without_a_space_".repeat(12).into();
    std::fs::write(&summary, reported.to_string()).unwrap();
    assert_eq!(
        endowire().arg("report").arg(folder.path().join("run")).output().unwrap().status.code(),
        Some(0)
    );
    // The page tells how wide it is.
    let text = std::fs::read_to_string(&page).unwrap();
    let script = "<script>document.documentElement.dataset.wide = document.documentElement.scrollWidth + \" \" + innerWidth</script>";
    std::fs::write(&page, text.replace("</body>", &format!("{script}</body>"))).unwrap();
    for width in [1280, 500] {
        let size = format!("--window-size={width},900");
        let url = format!("file://{}", page.display());
        let document = shown_in(browser, folder.path(), &url, &["--dump-dom", &size]);
        let (_, rest) = document.split_once("data-wide=\"").unwrap();
        let [wide, window] = rest.split('"').next().unwrap().split_once(' ').map(|(a, b)| [a, b]).unwrap();
        let [wide, window] = [wide, window].map(|px| px.parse::<u32>().unwrap());
        assert!(wide <= window, "{wide} of {window} pixels");
        assert!(
            document.contains(&format!("interrupted before the end of step {}", steps + 1)),
            "{document}"
        );
        assert!(
            document.contains(&format!("<td>all {steps}</td>")) && !document.contains("<td>converged</td>")
        );
    }
}

#[test]
fn an_experiment_has_a_page_of_its_tables() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("timing");
    let few = ["experiment", "timing", "--nodes", "20", "--repeats", "1", "--methods", "kirchhoff", "--out"];
    assert_eq!(endowire().args(few).arg(&out).output().unwrap().status.code(), Some(0));
    assert_eq!(endowire().arg("report").arg(&out).output().unwrap().status.code(), Some(0));
    let text = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(text.contains("\"columns\":[\"method\"") && text.contains("\"git_revision\""), "{text}");
    assert!(loads_nothing(&text));
}

/// A sweep of three runs in the curved tube, one of which must fail, and its page.
fn sweep_page(folder: &Path) -> PathBuf {
    let changes = [("advance_mm = 200.0", "advance_mm = 20.0"), ("[\"3d\", \"fluoro\"]", "[]")];
    std::fs::write(folder.join("short.toml"), scene_text("curved_tube.toml", &changes)).unwrap();
    let axis = "scene = \"short.toml\"\n[[axis]]\nkey = \"vessel.wall.friction\"\nlist = [0.0, 0.1, -1.0]\n";
    std::fs::write(folder.join("sweep.toml"), axis).unwrap();
    let out = folder.join("swept");
    endowire().arg("sweep").arg(folder.join("sweep.toml")).arg("--out").arg(&out).output().unwrap();
    let reported = endowire().arg("report").arg(&out).output().unwrap();
    assert_eq!(reported.status.code(), Some(0), "{}", said(&reported));
    out.join("report.html")
}

#[test]
fn a_sweep_has_a_page_of_its_runs() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(sweep_page(folder.path())).unwrap();
    let (_, data) = text.split_once("const data = ").unwrap();
    let data: serde_json::Value = serde_json::from_str(data.split_once(";\n").unwrap().0).unwrap();
    let table = &data["tables"][0];
    assert_eq!((&table["name"], &table["count"]), (&"runs".into(), &3.into()));
    let columns: Vec<&str> = table["columns"].as_array().unwrap().iter().filter_map(|c| c.as_str()).collect();
    let value = |row: usize, column: &str| {
        let place = columns.iter().position(|name| *name == column).unwrap_or_else(|| panic!("{columns:?}"));
        table["rows"][row][place].as_str().unwrap().to_owned()
    };
    assert_eq!([0, 1, 2].map(|row| value(row, "vessel.wall.friction")), ["0", "0.1", "-1"]);
    assert!(!value(0, "inserted_mm").is_empty() && value(2, "inserted_mm").is_empty());
    assert_eq!(table["chart"], serde_json::json!(["vessel.wall.friction", "push_force_n"]));
    assert!(value(2, "failure").contains("friction") && value(0, "failure").is_empty(), "the twin");
    assert!(
        !columns.contains(&"left_through")
            && !columns.contains(&"git_revision")
            && !columns.contains(&"seed"),
        "{columns:?}"
    );
    assert!(data["source"].to_string().contains("git_revision"));
    assert!(loads_nothing(&text) && !text.contains("src=\""));
    // A sweep that goes on shows what there is.
    let journal = folder.path().join("swept/runs.jsonl");
    let rows = std::fs::read_to_string(&journal).unwrap();
    let part: String = rows.lines().take(3).map(|line| format!("{line}\n")).collect();
    std::fs::write(&journal, part).unwrap();
    endowire().arg("report").arg(folder.path().join("swept")).output().unwrap();
    let text = std::fs::read_to_string(folder.path().join("swept/report.html")).unwrap();
    assert!(text.contains("runs so far of 3"));
}

#[test]
fn a_browser_shows_the_table_of_a_sweep() {
    let Some(browser) = browser() else {
        eprintln!("skipped: there is no Chromium to open the page in");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let url = format!("file://{}", sweep_page(folder.path()).display());
    let document = shown(browser, folder.path(), &url, "--dump-dom");
    assert!(document.contains("runs: 3 rows") && document.contains(">-1</td>"), "{document}");
    assert!(document.contains("data-drawn-ms"));
}

/// A browser that can do without a window.
fn browser() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    names
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success()))
}

/// Runs the browser on a page.
fn shown(browser: &str, folder: &Path, url: &str, what: &str) -> String {
    shown_in(browser, folder, url, &["--window-size=1000,900", what])
}

/// Runs the browser on a page with these options.
fn shown_in(browser: &str, folder: &Path, url: &str, options: &[&str]) -> String {
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--disable-gpu"]).args(options);
    let profile = format!("--user-data-dir={}", folder.join("profile").display());
    let output = command.args([&profile, url]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Pixels of a picture that are more red than blue: the vessel and contacts.
fn red_pixels(path: &Path) -> (usize, Vec<u8>) {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    let bytes = info.color_type.samples();
    let red = data.chunks_exact(bytes).filter(|pixel| pixel[0] > pixel[2].saturating_add(4)).count();
    (red, data)
}

#[test]
fn a_browser_draws_the_page_soon_and_follows_the_slider() {
    let Some(browser) = browser() else {
        eprintln!("skipped: there is no Chromium to open the page in");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let page = page(folder.path());
    let url = |step: usize| format!("file://{}#step={step}", page.display());
    let mut pictures = Vec::new();
    for (step, said) in [(40, "step 40: 20.0 mm inserted"), (160, "step 160: 80.0 mm inserted")] {
        let document = shown(browser, folder.path(), &url(step), "--dump-dom");
        assert!(document.contains(said), "{said}");
        let (_, rest) = document.split_once("data-drawn-ms=\"").unwrap();
        let drawn_ms: f64 = rest.split('"').next().unwrap().parse().unwrap();
        assert!(drawn_ms < 2000.0, "{drawn_ms} ms");
        let picture = folder.path().join(format!("{step}.png"));
        shown(browser, folder.path(), &url(step), &format!("--screenshot={}", picture.display()));
        let (red, data) = red_pixels(&picture);
        assert!(red > 3000, "{red} pixels of the vessel");
        pictures.push(data);
    }
    let differ = pictures[0].iter().zip(&pictures[1]).filter(|(a, b)| a != b).count();
    assert!(differ > 500, "{differ} values differ");
}

#[test]
fn numbers_of_what_stood_out_are_in_the_picture_and_beside_the_tip() {
    let Some(browser) = browser() else {
        eprintln!("skipped: there is no Chromium to open the page in");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    // The device snaps in the last two samples of several, at one place, and forces are largest there.
    let sample = |k: u32| {
        let (force_n, jumped) = if k >= 19 { (0.3, k % 2 == 1 || k == 20) } else { (0.1, false) };
        serde_json::json!({
            "time_s": f64::from(k), "tip_mm": [0.0, 0.0, 50.0], "wall_force_n": force_n, "tip_force_n": 0.5 * force_n, "jumped": jumped,
            "hands": [{"advance_mm": 5.0, "rotate_rad": 0.0, "inserted_mm": 50.0, "push_force_n": 0.1, "torque_nmm": 0.0}],
        })
    };
    let samples: Vec<serde_json::Value> = (1..=20).map(sample).collect();
    let document = serde_json::json!({
        "scene_file": crate::common::scene("curved_tube.toml"), "set": [],
        "record": {"samples": samples, "injections": [], "beam": null},
    });
    let (session, page) = (folder.path().join("one.session.json"), folder.path().join("page.html"));
    std::fs::write(&session, document.to_string()).unwrap();
    let reported = endowire().arg("assess").arg(&session).arg("--page").arg(&page).output().unwrap();
    assert_eq!(reported.status.code(), Some(0), "{}", said(&reported));
    let text = std::fs::read_to_string(&page).unwrap();
    let script = "<script>for (const id of [\"line\", \"roadmap\"]) document.documentElement.dataset[id] = document.getElementById(id).clientWidth</script>";
    std::fs::write(&page, text.replace("</body>", &format!("{script}</body>"))).unwrap();
    let url = format!("file://{}", page.display());
    let dom = shown_in(browser, folder.path(), &url, &["--dump-dom", "--window-size=420,900"]);
    let value = |begins: &str| {
        let (_, rest) = dom.split_once(begins).unwrap_or_else(|| panic!("{begins} in {dom}"));
        rest.split('"').next().unwrap().to_owned()
    };
    let width = |id: &str| value(&format!("data-{id}=\"")).parse::<f64>().unwrap();
    let of = |id: &str| {
        let (_, canvas) = dom.split_once(&format!("<canvas id=\"{id}\"")).unwrap();
        let (_, numbers) = canvas.split_once("data-numbers=\"").unwrap();
        numbers.split('"').next().unwrap().to_owned()
    };
    let at: Vec<f64> = of("line").split(' ').map(|x| x.parse().unwrap()).collect();
    assert!(at.len() >= 3, "{at:?}");
    assert!(at.iter().all(|x| (9.0..=width("line") - 8.9).contains(x)), "{at:?} of {}", width("line"));
    assert!(at.windows(2).all(|pair| pair[1] - pair[0] > 16.9), "{at:?}");
    // All are of one place: none is far from the others, and none covers another.
    let numbers = of("roadmap");
    let near: Vec<[f64; 2]> = numbers
        .split(' ')
        .map(|at| at.split_once(',').map(|(x, y)| [x, y].map(|v| v.parse().unwrap())).unwrap())
        .collect();
    for (k, one) in near.iter().enumerate() {
        assert!((9.0..width("roadmap") - 9.0).contains(&one[0]), "{numbers}");
        for other in &near[..k] {
            let apart = (one[0] - other[0]).hypot(one[1] - other[1]);
            assert!((16.9..60.0).contains(&apart), "{numbers}");
        }
    }
}
