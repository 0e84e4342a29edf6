//! `endowire assess` of several sessions: their order, where measures go, and the page for a browser.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

use crate::common::{assets, document, endowire, play, reported, said, text};

/// A session in the curved tube that takes so long, as `endowire play` writes it; recorded on this day if one is given.
fn session(folder: &Path, name: &str, total_s: f64, day: Option<u64>) -> PathBuf {
    let sample = |part: f64, wall_force_n: f64| {
        json!({
            "time_s": part * total_s, "tip_mm": [0.0, 0.0, 100.0 * part], "wall_force_n": wall_force_n, "tip_force_n": 0.0, "jumped": false,
            "hands": [{"advance_mm": 25.0, "rotate_rad": 0.0, "inserted_mm": 100.0 * part, "push_force_n": 0.1, "torque_nmm": 0.0}],
        })
    };
    let samples: Vec<Value> = [(0.25, 0.1), (0.5, 0.3), (0.75, 0.1), (1.0, 0.1)]
        .iter()
        .map(|(part, n)| sample(*part, *n))
        .collect();
    let mut document = json!({
        "scene_file": assets().join("scenes/curved_tube.toml"), "set": [],
        "record": {"samples": samples, "injections": [], "beam": null},
    });
    if let Some(day) = day {
        document["recorded_unix_s"] = json!(1_790_000_000 + 86_400 * day);
    }
    let file = folder.join(format!("{name}.session.json"));
    std::fs::write(&file, document.to_string()).unwrap();
    file
}

fn assessed(args: &[&str]) -> Value {
    reported(&endowire().arg("assess").args(args).arg("--json").output().unwrap())
}

fn line<'a>(course: &'a Value, name: &str) -> &'a Value {
    course["metrics"].as_array().unwrap().iter().find(|one| one["name"] == name).unwrap()
}

#[test]
fn sessions_are_ordered_by_when_they_were_recorded_and_their_course_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    // By their names they are in another order.
    for (name, total_s, day) in [("b", 40.0, 0), ("a", 30.0, 7), ("d", 24.0, 14), ("c", 20.0, 21)] {
        session(folder.path(), name, total_s, Some(day));
    }
    let all = assessed(&[text(folder.path())]);
    let [course] = all["courses"].as_array().unwrap().as_slice() else { panic!("{all}") };
    let values: Vec<f64> =
        line(course, "total_s")["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert_eq!(values, [40.0, 30.0, 24.0, 20.0]);
    let total = line(course, "total_s");
    assert_eq!(
        (&total["trend"], &total["best"], &total["better"]),
        (&json!("better"), &json!(20.0), &json!("lower"))
    );
    // Slopes of pairs: −10, −8, −20/3, −6, −5, −4.
    let each = total["per_attempt"].as_f64().unwrap();
    assert!((each + 0.5 * (20.0 / 3.0 + 6.0)).abs() < 1e-12, "{each}");
    assert_eq!(line(course, "wall_force_n")["trend"], "none");
    assert_eq!((&course["ordered_by"], &course["score"]), (&json!("recorded"), &Value::Null));
    let order: Vec<&str> =
        all["sessions"].as_array().unwrap().iter().map(|one| one["session"].as_str().unwrap()).collect();
    assert!(order[0].ends_with("b.session.json") && order[3].ends_with("c.session.json"), "{order:?}");
    // One that is named and lies in the folder too is one attempt.
    let twice = assessed(&[text(folder.path()), text(&folder.path().join("a.session.json"))]);
    assert_eq!(twice["courses"], all["courses"]);
    // For people.
    let output = endowire().arg("assess").arg(folder.path()).output().unwrap();
    let table = String::from_utf8(output.stdout).unwrap();
    let row = table.lines().find(|line| line.contains(" total_s ")).unwrap();
    assert!(row.ends_with("s        less is better  -6.33 each, gets better"), "{row}");
}

#[test]
fn a_session_without_a_date_leaves_the_order_as_given() {
    let folder = tempfile::tempdir().unwrap();
    let late = session(folder.path(), "late", 20.0, Some(9));
    let early = session(folder.path(), "early", 40.0, Some(1));
    let undated = session(folder.path(), "undated", 30.0, None);
    let all = assessed(&[text(&late), text(&undated), text(&early)]);
    let course = &all["courses"][0];
    assert_eq!(course["ordered_by"], "given");
    assert_eq!(line(course, "total_s")["values"], json!([20.0, 30.0, 40.0]));
    // Alone it is one session, with no course, as ever.
    let one = assessed(&[text(&undated)]);
    assert!(
        one["metrics"].is_array() && one.get("courses").is_none() && one.get("recorded_unix_s").is_none()
    );
}

#[test]
fn a_page_has_all_of_it_and_nothing_from_a_network() {
    let folder = tempfile::tempdir().unwrap();
    let name = "<img src=x onerror=alert(1)>";
    let first = session(folder.path(), name, 40.0, Some(0));
    let second = session(folder.path(), "second", 30.0, Some(1));
    let page = folder.path().join("page.html");
    let output = endowire().arg("assess").args([&first, &second]).arg("--page").arg(&page).output().unwrap();
    assert!(output.status.success() && said(&output).contains("page.html"), "{}", said(&output));
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(!html.contains("<img") && html.contains("\\u003cimg src=x"), "names are escaped");
    for outside in ["http://", "https://", "src=\"", "@import"] {
        assert!(!html.contains(outside), "{outside}");
    }
    let start = html.find("const data = ").unwrap() + "const data = ".len();
    let data: Value =
        serde_json::from_str(html[start..].lines().next().unwrap().trim_end_matches(';')).unwrap();
    assert_eq!(data["sessions"].as_array().unwrap().len(), 2);
    assert_eq!(
        (data["vessels"].as_array().unwrap().len(), data["courses"].as_array().unwrap().len()),
        (1, 1)
    );
    let shown = &data["sessions"][0];
    assert_eq!(shown["timeline"]["end_s"], 40.0);
    assert_eq!(shown["noticed"][0]["what"], "wall_force");
    assert!(data["vessels"][0]["triangles"].as_array().unwrap().len() > 100);
    // The message about one that cannot be written names it.
    let nowhere = folder.path().join("no/page.html");
    let output = endowire().arg("assess").arg(&first).arg("--page").arg(&nowhere).output().unwrap();
    assert!(!output.status.success() && said(&output).contains("no/page.html"), "{}", said(&output));
}

#[test]
fn a_session_by_the_clock_says_when_and_one_by_its_inputs_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    for (more, by_the_clock) in
        [(&["--headless", "--size", "64"][..], false), (&["--headless", "--realtime", "--size", "64"], true)]
    {
        let mut child = play("curved_tube.toml", &record, more).spawn().unwrap();
        child.stdin.take().unwrap().write_all(b"{\"do\": \"quit\"}\n").unwrap();
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        let recorded = document(folder.path().join("played.session.json")).get("recorded_unix_s").cloned();
        let since_s = recorded.map(|recorded| {
            let now_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs();
            now_s - recorded.as_u64().unwrap()
        });
        assert_eq!(since_s.is_some(), by_the_clock);
        assert!(since_s.is_none_or(|since_s| since_s < 600), "{since_s:?}");
    }
}

#[test]
fn a_session_in_which_nothing_was_done_is_left_out_and_one_alone_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, total_s) in [("a", 40.0), ("c", 20.0)] {
        session(folder.path(), name, total_s, None);
    }
    let mut empty = document(folder.path().join("a.session.json"));
    empty["record"] = json!({"samples": [], "injections": [], "beam": []});
    let nothing = folder.path().join("b.session.json");
    std::fs::write(&nothing, empty.to_string()).unwrap();
    let output = endowire().args(["assess", text(folder.path())]).output().unwrap();
    let left_out = format!("{}: nothing was done in it: it is left out", nothing.display());
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(
        output.status.success() && said(&output).contains(&left_out) && table.contains(&left_out),
        "{table}"
    );
    let all = assessed(&[text(folder.path())]);
    assert_eq!((&all["left_out"], all["sessions"].as_array().unwrap().len()), (&json!([nothing]), 2));
    let output = endowire().args(["assess", text(&nothing)]).output().unwrap();
    assert!(
        output.status.code() == Some(2) && said(&output).contains("nothing was done"),
        "{}",
        said(&output)
    );
}
