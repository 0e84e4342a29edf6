//! Training subjects on the page.

use endowire_play::Input;
use serde_json::{Value, json};

use crate::chromium::Browser;
use crate::{LAPTOP, PHONE, READY, alone, module_of, native};

/// The score that the page has of `session`, as the program has it: without what the page has in words, and with all numbers real ones, as which
/// JavaScript writes some like whole ones.
fn score(browser: &mut Browser) -> Value {
    let text = browser.eval("JSON.stringify(session.score())");
    let mut score: Value = serde_json::from_str(text.as_str().unwrap()).unwrap();
    let keys = score.as_object_mut().unwrap();
    keys.remove("words").unwrap();
    keys.remove("rows").unwrap();
    real(score)
}

fn real(value: Value) -> Value {
    match value {
        Value::Number(number) => json!(number.as_f64().unwrap()),
        Value::Array(all) => all.into_iter().map(real).collect(),
        Value::Object(all) => all.into_iter().map(|(key, value)| (key, real(value))).collect(),
        other => other,
    }
}

#[test]
fn a_score_has_the_programs_bits_in_the_page_in_the_program_and_from_the_sessions_file() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    let begun = [json!({ "do": "pedal", "down": true, "mode": "fluoro" }), json!({ "do": "script" })];
    // A centre line that is found in a surface, and a scene with another vessel.
    for name in ["straight_tube.toml", "left_subclavian_iii.toml"] {
        module_of(&mut browser, &format!("subjects/{name}"), 64);
        browser.eval(&format!(
            "session = session.watched();
             for (const input of {}) session.apply(input);
             while (session.readout().demonstrates) session.tick();",
            json!(begun)
        ));
        let shown = score(&mut browser);
        assert_eq!(shown["passed"], true, "{name}: {shown}");
        let (exam, mut session) = native::subject(name, 64);
        for input in &begun {
            session.apply(&serde_json::from_value::<Input>(input.clone()).unwrap()).unwrap();
        }
        while session.demonstrates() {
            session.tick();
        }
        assert_eq!(shown, real(serde_json::to_value(&*session.score().unwrap()).unwrap()), "{name}");
        let file = browser.eval("session.sessionFile('assets')");
        assert_eq!(shown, real(native::assessed(exam.clone(), file.as_str().unwrap())), "{name}");
        // The twin: a hand that moves otherwise has another score.
        browser.eval("session = opened(); session.apply({ do: 'move', mm_per_s: 20 }); for (let k = 0; k < 60; k++) session.tick()");
        let other = score(&mut browser);
        assert_ne!(other["metrics"], shown["metrics"], "{name}");
        let file = browser.eval("session.sessionFile('assets')");
        assert_eq!(other, real(native::assessed(exam, file.as_str().unwrap())), "{name}");
        // It was recorded in the subject's scene, which `endowire assess` looks at.
        let file: Value = serde_json::from_str(file.as_str().unwrap()).unwrap();
        let scene = file["scene_file"].as_str().unwrap();
        assert!(scene.starts_with("assets/subjects/../scenes/"), "{scene}");
        assert!(file["set"].as_array().is_some_and(|set| !set.is_empty()), "{}", file["set"]);
    }
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

/// Whether a dialog of the page is open.
fn is_open(dialog: &str) -> String {
    format!("Boolean(document.getElementById('{dialog}')?.open)")
}

#[test]
fn a_subject_is_read_done_by_hand_scored_and_saved() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    browser.wait(READY);
    let offered = "document.querySelectorAll('#scenes optgroup[label^=\"Training subjects\"] option').length";
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/subjects");
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    assert_eq!(
        browser.eval(offered),
        files.filter(|path| path.extension().is_some_and(|e| e == "toml")).count()
    );
    browser.eval(
        "(() => {
            const menu = document.getElementById('scenes');
            menu.value = 'subjects/straight_tube.toml';
            menu.dispatchEvent(new Event('change'));
            // What is saved is kept for the test.
            URL.createObjectURL = (blob) => { window.saved = blob.text(); return '#'; };
        })()",
    );
    browser.wait(&is_open("task-dialog"));
    let text = |browser: &mut Browser, id: &str| {
        browser.eval(&format!("document.getElementById('{id}').textContent")).as_str().unwrap().to_owned()
    };
    assert_eq!(text(&mut browser, "task-name"), "A wire through a straight tube (level 1)");
    assert!(text(&mut browser, "task-text").contains("Counts:"));
    assert_eq!(text(&mut browser, "task-goal"), "tip within 8 mm of opening 1");
    assert_eq!(text(&mut browser, "task-limits"), "time 300 s, beam 240 s, wall force 0.2 N");
    assert_eq!(browser.eval("document.querySelectorAll('#task-counts tbody tr').length"), 8);
    // Time stands still while it is read, and pictures go on.
    browser.wait(READY);
    let time_s = "(async () => (await import('./screen.js')).readout.time_s)()";
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(browser.eval(time_s), 0.0);
    browser.eval("document.getElementById('task-go').click()");
    browser.wait("(async () => (await import('./screen.js')).readout.time_s > 0.2)()");
    assert!(text(&mut browser, "to-go").starts_with("to opening 1: "));
    assert_eq!(browser.eval("document.querySelectorAll('#used .used').length"), 3);
    browser.key("Enter", true);
    browser.key("Enter", false);
    browser.key("ArrowUp", true);
    browser.wait(&is_open("score-dialog"));
    browser.key("ArrowUp", false);
    let words = text(&mut browser, "score-words");
    assert!(words.contains("100: the goal is reached after "), "{words}");
    let rows = browser.eval(
        "[...document.querySelectorAll('#score-asked tbody tr')].map((row) => [...row.cells].map((one) => one.firstChild.textContent))",
    );
    browser.eval("document.getElementById('score-save').click()");
    browser.wait("Boolean(window.saved)");
    let file = browser.eval("window.saved");
    let (exam, _) = native::subject("straight_tube.toml", 64);
    let assessed = native::assessed(exam, file.as_str().unwrap());
    assert_eq!(rows.as_array().unwrap().len(), 8);
    for row in rows.as_array().unwrap() {
        let metrics = assessed["metrics"].as_array().unwrap();
        let metric = metrics.iter().find(|metric| metric["title"] == row[1]).unwrap();
        assert_eq!(row[0] == "kept", metric["passed"] == true, "{row} {metric}");
        let value: f64 = row[2].as_str().unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((value - metric["value"].as_f64().unwrap()).abs() <= 5e-4, "{row} {metric}");
    }
    // Once more, at once.
    browser.eval("document.getElementById('try-again').click()");
    browser.wait(&format!("!{} && !{}", is_open("score-dialog"), is_open("task-dialog")));
    browser.wait("(async () => { const { time_s, step } = (await import('./screen.js')).readout; return step === 0 && time_s > 0.1 && time_s < 5; })()");
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn a_subject_is_shown_by_its_reference_and_one_that_does_not_fit_is_reported() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("#scene=subjects/straight_tube.toml", PHONE) else { return };
    browser.wait(&is_open("task-dialog"));
    browser.eval("document.getElementById('watch').click()");
    browser.wait(&is_open("score-dialog"));
    assert_eq!(browser.eval("document.getElementById('score-words').className"), "passed");
    assert_eq!(browser.eval("document.getElementById('score-watched').hidden"), false);
    browser.eval("document.getElementById('score-dialog').close()");
    // One of a teacher, and one with a target that the vessel does not name.
    crate::drop_file(
        &mut browser,
        "harder.toml",
        "(await (await fetch('assets/subjects/straight_tube.toml')).text()).replace('level = 1', 'level = 3')",
    );
    browser.wait(&is_open("task-dialog"));
    browser.wait("document.getElementById('task-name').textContent.endsWith('(level 3)')");
    browser.eval("document.getElementById('task-dialog').close()");
    crate::drop_file(
        &mut browser,
        "own.toml",
        "(await (await fetch('assets/subjects/straight_tube.toml')).text()).replace('opening 1', 'opening 7')",
    );
    browser.wait("document.getElementById('told').textContent.includes('goal.target = \"opening 7\"')");
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn a_session_is_reported_as_one_page_that_needs_nothing_else() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("#scene=scenes/curved_tube_exact.toml", LAPTOP) else { return };
    browser.wait(READY);
    browser.eval("URL.createObjectURL = (blob) => { window.saved = blob.text(); return '#'; }");
    let report = "document.getElementById('save-report').click()";
    // Nothing was done yet.
    browser.eval(report);
    browser.wait("document.getElementById('told').textContent.includes('nothing to report')");
    browser.key("Enter", true);
    browser.key("Enter", false);
    browser.key("ArrowUp", true);
    browser.wait("document.querySelector('.instrument').textContent.match(/([\\d.]+) mm in/)[1] > 20");
    browser.key("ArrowUp", false);
    browser.eval(report);
    browser.wait("Boolean(window.saved)");
    let page = browser.eval("window.saved");
    let page = page.as_str().unwrap();
    let (_, data) = page.split_once("const data = ").unwrap();
    let data: Value = serde_json::from_str(data.split_once(";\n").unwrap().0).unwrap();
    let (steps, shapes) = (&data["summary"]["steps"], data["steps"].as_array().unwrap());
    assert_eq!(&shapes[shapes.len() - 1]["step"], steps);
    browser.wait(&format!("(async () => (await import('./screen.js')).readout.step === {steps})()"));
    assert_eq!(data["series"]["inserted_mm"].as_array().unwrap().len(), steps.as_u64().unwrap() as usize);
    assert_eq!(data["frames"].as_array().unwrap().len(), 2);
    assert!(browser.console.is_empty(), "{:?}", browser.console);
    // From a file, where no other file and no network is.
    let file = tempfile::Builder::new().suffix(".html").tempfile().unwrap();
    std::fs::write(file.path(), page).unwrap();
    browser.call("Page.navigate", &json!({ "url": format!("file://{}", file.path().display()) }));
    browser.wait("Boolean(document.documentElement?.dataset.drawnMs)");
    let reported = browser.eval("document.getElementById('now').textContent");
    assert!(reported.as_str().unwrap().starts_with(&format!("step {steps}: ")), "{reported}");
    browser.wait(
        "[...document.images].length === 2 && [...document.images].every((one) => one.naturalWidth > 100)",
    );
    assert!(
        !page.contains("http:") && !page.contains("https:") && browser.console.is_empty(),
        "{:?}",
        browser.console
    );
}
