//! `endowire play`: the protocol, what is recorded, and what it says where there is no display.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::process::Child;

use crate::common::{Listening, endowire, play, said, scene, wait_until};
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
    let reported = String::from_utf8(output.stdout).unwrap();
    let reported = reported.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    (reported, output.status.code(), String::from_utf8(output.stderr).unwrap())
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
    let (reported, code, said) = answers(child, &lines);
    assert_eq!((reported.len(), code), (lines.len(), Some(0)), "{said}");
    let ok: Vec<bool> = reported.iter().map(|answer| answer["ok"].as_bool().unwrap()).collect();
    assert_eq!(ok, [true, true, true, true, true, true, true, true, true, false, false, true]);
    assert!(
        reported[9]["error"].as_str().unwrap().contains("nobody")
            && reported[10]["error"].as_str().unwrap().contains("jump")
    );
    let end = &reported[11]["readout"];
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
        let (reported, code, said) = answers(child, &lines);
        assert_eq!(code, Some(0), "{said}");
        let seen = |k: usize| {
            (reported[k]["readout"]["step"].clone(), reported[k]["readout"]["demonstrates"].clone())
        };
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
fn a_record_is_a_script_and_a_scene_is_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let session = folder.path().join("monday.session.json");
    std::fs::write(&session, "{}").unwrap();
    let output = play("curved_tube.toml", &session, &["--headless"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("monday.session.json: must end in .toml"), "{said}");
    assert_eq!(std::fs::read_to_string(&session).unwrap(), "{}", "it is left as it was");
    let output = endowire().args(["play", "nothing.toml", "--headless"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said.contains("nothing.toml: there is no such file: give a scene") && said.lines().count() == 1,
        "{said}"
    );
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

/// Sends a line, and has the answer.
fn ask(stream: &mut BufReader<TcpStream>, line: &str) -> Value {
    stream.get_mut().write_all(line.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_line(&mut answer).unwrap();
    serde_json::from_str(&answer).unwrap()
}

#[test]
fn a_program_that_leaves_takes_nothing_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let more = ["--headless", "--realtime", "--size", "64", "--listen", "127.0.0.1:0"];
    let mut child = play("curved_tube.toml", &record, &more).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let listening = Listening::read(&mut said);
    let connect = || listening.connect();
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
fn what_a_killed_session_leaves_is_of_one_session_and_its_file_is_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let [session, score] = ["session.json", "score.json"].map(|end| record.with_extension(end));
    // Of an earlier session.
    for file in [&record, &session, &score] {
        std::fs::write(file, "earlier").unwrap();
    }
    let more = ["--headless", "--realtime", "--size", "64"];
    let mut child = play("curved_tube.toml", &record, &more).spawn().unwrap();
    child.stdin.as_mut().unwrap().write_all(b"{\"do\": \"move\", \"mm_per_s\": 5}\n").unwrap();
    let text = |file: &std::path::Path| std::fs::read_to_string(file).unwrap_or_default();
    wait_until(|| text(&session).contains("scene_file"));
    // Another session may record beside it, and not to the same file.
    let second = play("curved_tube.toml", &record, &["--headless"]).output().unwrap();
    let reported = said(&second);
    assert!(
        second.status.code() == Some(2) && reported.contains("another session is being recorded there"),
        "{reported}"
    );
    let beside =
        play("curved_tube.toml", &folder.path().join("other.toml"), &["--headless"]).output().unwrap();
    assert!(beside.status.success(), "{}", said(&beside));
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(text(&record).contains("[[script]]") && !score.exists(), "{}", text(&record));
    let assessed = endowire().arg("assess").arg(&session).arg("--json").output().unwrap();
    assert!(assessed.status.success(), "{}", said(&assessed));
    // Its lock has died with it.
    let again = play("curved_tube.toml", &record, &["--headless"]).output().unwrap();
    assert!(again.status.success(), "{}", said(&again));
}

/// Random lines of bytes from a fixed seed, some of them nearly commands.
fn random_lines(count: usize) -> impl Iterator<Item = Vec<u8>> {
    let mut word = 1_u64;
    let mut next = move || {
        word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (word >> 33) as usize
    };
    let pieces: [&[u8]; 12] = [
        b"{\"do\": \"",
        b"picture",
        b"nudge",
        b"wait",
        b"\"",
        b", \"file\": \"",
        b"../",
        b"/tmp/",
        b".png\"}",
        b"\xff\xfe",
        b"{}",
        b"\0",
    ];
    (0..count).map(move |_| {
        let mut line: Vec<u8> =
            (0..next() % 12).flat_map(|_| pieces[next() % pieces.len()].to_vec()).collect();
        line.extend((0..next() % 40).map(|_| (next() % 256) as u8).filter(|byte| *byte != b'\n'));
        // Never empty, which would have no answer.
        line.push(b'!');
        line
    })
}

/// Files in a folder and below it.
fn files(folder: &std::path::Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

#[test]
fn a_socket_asks_for_its_token_and_writes_into_its_folder_alone() {
    let outer = tempfile::tempdir().unwrap();
    let record = outer.path().join("session/played.toml");
    let more = ["--headless", "--size", "64", "--listen", "0"];
    let mut child = play("curved_tube.toml", &record, &more).current_dir(outer.path()).spawn().unwrap();
    let listening = Listening::read(&mut BufReader::new(child.stderr.take().unwrap()));
    assert!(listening.address.starts_with("127.0.0.1:"), "{}", listening.address);

    // A page that a browser shows may send requests; lines of the protocol in one are not carried out.
    let command =
        "{\"do\": \"picture\", \"file\": \"http.png\"}\n{\"do\": \"nudge\", \"mm\": 5}\n{\"do\": \"quit\"}\n";
    for k in 0..200 {
        let head = format!("Host: {}\r\nContent-Length: {}\r\n\r\n", listening.address, command.len());
        let mut stream = TcpStream::connect(&listening.address).unwrap();
        let begin = ["POST / HTTP/1.1\r\n", "GET / HTTP/1.1\r\n", "", "\n"][k % 4];
        // The connection may be hung up on before all of it is sent.
        let _ = stream.write_all(format!("{begin}{head}{command}").as_bytes());
        let mut reported = String::new();
        let _ = BufReader::new(stream).read_line(&mut reported);
        assert!(
            reported.is_empty() || reported.contains("\"ok\":false") && reported.contains("token"),
            "{reported}"
        );
    }
    let mut known = listening.connect();
    for line in random_lines(10_000) {
        known.get_mut().write_all(&[&line[..], b"\n"].concat()).unwrap();
        let mut reported = String::new();
        known.read_line(&mut reported).unwrap();
        assert!(reported.starts_with("{\"ok\":false"), "{reported} to {}", String::from_utf8_lossy(&line));
    }
    let _ = TcpStream::connect(&listening.address).unwrap().write_all(&[b'x'; 100_000]);
    for place in [
        "/tmp/endowire-outside.png",
        "../outside.png",
        "session/../../outside.png",
        "seen.toml",
        "played.toml",
    ] {
        let reported = ask(&mut known, &format!("{}\n", json!({"do": "picture", "file": place})));
        assert_eq!(reported["ok"], false, "{place}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(outer.path().join("linked.png"), outer.path().join("session/link.png"))
            .unwrap();
        assert_eq!(ask(&mut known, "{\"do\": \"picture\", \"file\": \"link.png\"}\n")["ok"], false);
        std::fs::remove_file(outer.path().join("session/link.png")).unwrap();
    }
    // Its script, beside it the session, and the lock of both.
    let own = |path: &std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        path.parent() == record.parent() && name.trim_start_matches('.').starts_with("played.")
    };
    assert!(files(outer.path()).iter().all(own), "{:?}", files(outer.path()));

    // The twin: what is allowed is done, and the session has not moved before it.
    let reported = ask(&mut known, "{\"do\": \"picture\", \"file\": \"seen.png\"}\n");
    assert_eq!((&reported["ok"], &reported["readout"]["step"]), (&json!(true), &json!(0)));
    assert!(outer.path().join("session/seen.png").exists());
    assert_eq!(ask(&mut known, "{\"do\": \"quit\"}\n")["ok"], true);
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn other_machines_are_listened_to_only_where_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let output =
        play("curved_tube.toml", &record, &["--headless", "--listen", "0.0.0.0:0"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("--allow-remote"), "{said}");
    let more = ["--headless", "--listen", "0.0.0.0:0", "--allow-remote"];
    let mut child = play("curved_tube.toml", &record, &more).spawn().unwrap();
    drop(child.stdin.take());
    assert_eq!(child.wait().unwrap().code(), Some(0), "the twin");
}

#[test]
#[cfg(unix)]
fn a_long_wait_is_interrupted_and_recorded_as_far_as_it_went() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let mut child = play("curved_tube.toml", &record, &["--headless", "--size", "64"]).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    for line in [json!({"do": "move", "mm_per_s": 1}), json!({"do": "wait", "ticks": 4_000_000_000_u32})] {
        input.write_all(format!("{line}\n").as_bytes()).unwrap();
    }
    // Recorded while it goes on: what a kill would leave.
    let begun = std::time::Instant::now();
    while !record.exists() && begun.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    assert!(record.exists());
    let pid = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("steps are recorded") && !said.contains(" 0 steps"), "{said}");
    assert!(std::fs::read_to_string(&record).unwrap().contains("advance_mm"));
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
