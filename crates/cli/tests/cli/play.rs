//! `endowire play`: the protocol, what is recorded, and what it says where there is no display.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::process::Child;

use crate::common::{address, endowire, play, scene};
use serde_json::{Value, json};

/// Sends lines, and has the answers.
fn answers(mut child: Child, lines: &[Value]) -> (Vec<Value>, Option<i32>, String) {
    let mut input = child.stdin.take().unwrap();
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    let writing = std::thread::spawn(move || {
        // A program that has ended reads no more.
        let _ = input.write_all(text.as_bytes());
    });
    let output = child.wait_with_output().unwrap();
    writing.join().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    let told = told.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    (told, output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn what_is_played_is_run_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let picture = folder.path().join("seen.png");
    let lines = [
        json!({"do": "move", "instrument": "catheter", "mm_per_s": 20, "deg_per_s": 45}),
        json!({"do": "wait", "ticks": 50}),
        json!({"do": "move", "instrument": "wire", "mm_per_s": 17.3}),
        json!({"do": "wait", "ticks": 40}),
        json!({"do": "stop"}),
        json!({"do": "nudge", "instrument": "wire", "mm": -7.25, "deg": 31}),
        json!({"do": "pedal", "down": true, "mode": "cine"}),
        json!({"do": "wait", "ticks": 30}),
        json!({"do": "picture", "file": picture}),
        json!({"do": "move", "instrument": "nobody"}),
        json!({"do": "jump"}),
        json!({"do": "quit"}),
    ];
    let child = play("arch_vertebral.toml", &record, &["--headless", "--size", "96"]).spawn().unwrap();
    let (told, code, said) = answers(child, &lines);
    assert_eq!((told.len(), code), (lines.len(), Some(0)), "{said}");
    let ok: Vec<bool> = told.iter().map(|answer| answer["ok"].as_bool().unwrap()).collect();
    assert_eq!(ok, [true, true, true, true, true, true, true, true, true, false, false, true]);
    assert!(
        told[9]["error"].as_str().unwrap().contains("nobody")
            && told[10]["error"].as_str().unwrap().contains("jump")
    );
    let end = &told[11]["readout"];
    assert_eq!(
        (&end["step"], &end["lab"]["beam_s"], &end["lab"]["mode"]),
        (&json!(98), &json!(0.5), &json!("cine"))
    );
    assert!(picture.exists() && said.contains("98 steps are recorded in"), "{said}");

    let run = endowire()
        .args([
            "run".as_ref(),
            scene("arch_vertebral.toml").as_os_str(),
            "--script".as_ref(),
            record.as_os_str(),
        ])
        .args(["--json".as_ref(), "--out".as_ref(), folder.path().join("out").as_os_str()])
        .output()
        .unwrap();
    let summary: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!((&summary["steps"], &summary["tip_mm"]), (&end["step"], &end["tip_mm"]));
    for (index, one) in end["instruments"].as_array().unwrap().iter().enumerate() {
        for key in ["inserted_mm", "push_force_n", "torque_nmm"] {
            assert_eq!(summary["instruments"][index][key], one[key], "{key}");
        }
    }
}

#[test]
fn a_session_begins_where_a_script_ends_or_watches_it() {
    let folder = tempfile::tempdir().unwrap();
    let (record, script) = (folder.path().join("played.toml"), folder.path().join("script.toml"));
    std::fs::write(&script, "[[script]]\nadvance_mm = 12.0\nstep_mm = 2.0\nspeed_mm_per_s = 20.0\n").unwrap();
    let read = |how: &str, ticks: u32| {
        let more = ["--headless", "--size", "64", how, "--script", script.to_str().unwrap()];
        let child = play("curved_tube.toml", &record, &more).spawn().unwrap();
        let lines = [
            json!({"do": "wait", "ticks": ticks}),
            json!({"do": "nudge", "mm": 1}),
            json!({"do": "wait", "ticks": 2}),
        ];
        let (told, code, said) = answers(child, &lines);
        assert_eq!(code, Some(0), "{said}");
        let seen =
            |k: usize| (told[k]["readout"]["step"].clone(), told[k]["readout"]["demonstrates"].clone());
        (seen(0), seen(2))
    };
    assert_eq!(read("--after-script", 0), ((json!(6), json!(false)), (json!(7), json!(false))));
    // Three steps of a tenth of a second, then the hand.
    assert_eq!(read("--watch", 18), ((json!(3), json!(true)), (json!(4), json!(false))));
    let recorded = std::fs::read_to_string(&record).unwrap();
    assert!(
        recorded.contains("speed_mm_per_s = 20.0") && recorded.contains("speed_mm_per_s = 60.0"),
        "{recorded}"
    );

    let more = ["--headless", "--watch", "--after-script"];
    let output = play("curved_tube.toml", &record, &more).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_script_file_has_scripts_alone() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("script.toml");
    std::fs::write(&script, "[[script]]\nadvance_mm = 1.0\n[vessel]\n").unwrap();
    let output =
        endowire().arg("run").arg(scene("curved_tube.toml")).arg("--script").arg(&script).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("script.toml") && said.contains("vessel"), "{said}");
}

#[test]
fn a_program_that_leaves_takes_nothing_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let more = ["--headless", "--realtime", "--size", "64", "--listen", "127.0.0.1:0"];
    let mut child = play("curved_tube.toml", &record, &more).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let address = address(&mut said);
    let ask = |stream: &mut BufReader<TcpStream>, line: &str| -> Value {
        stream.get_mut().write_all(line.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_line(&mut answer).unwrap();
        serde_json::from_str(&answer).unwrap()
    };
    let connect = || BufReader::new(TcpStream::connect(&address).unwrap());
    let mut first = connect();
    assert_eq!(ask(&mut first, "{\"do\": \"nudge\", \"mm\": 12.5}\n")["ok"], true);
    // One leaves in the middle of a line, one sends what is no line.
    connect().get_mut().write_all(b"{\"do\": \"st").unwrap();
    connect().get_mut().write_all(&[b'x'; 100_000]).unwrap();
    drop(first);
    let mut second = connect();
    let begun = std::time::Instant::now();
    let mut seen = json!(null);
    while seen != json!(12.5) && begun.elapsed().as_secs() < 20 {
        seen = ask(&mut second, "{\"do\": \"read\"}\n")["readout"]["instruments"][0]["inserted_mm"].clone();
    }
    assert_eq!(seen, json!(12.5));
    assert_eq!(ask(&mut second, "{\"do\": \"wait\", \"ticks\": 1}\n")["ok"], false);
    drop(child.stdin.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let text = std::fs::read_to_string(&record).unwrap();
    assert!(text.contains("advance_mm = 12.0") && text.contains("advance_mm = 0.5"), "{text}");
}

#[test]
#[cfg(target_os = "linux")]
fn without_a_display_it_says_so_and_names_run() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = play("curved_tube.toml", &folder.path().join("played.toml"), &[]);
    let output = command
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("no display") && said.contains("endowire run"), "{said}");
}
