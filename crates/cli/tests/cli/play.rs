//! `endowire play`: the protocol, what is recorded, and what it says where there is no display.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};

use crate::common::{assets, endowire};
use serde_json::{Value, json};

fn scene(name: &str) -> PathBuf {
    assets().join("scenes").join(name)
}

fn play(name: &str, record: &Path, more: &[&str]) -> Command {
    let mut command = endowire();
    command
        .args(["play".as_ref(), scene(name).as_os_str(), "--record".as_ref(), record.as_os_str()])
        .args(more);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

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

/// Where the program listens.
fn address(said: &mut BufReader<ChildStderr>) -> String {
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    line.trim().strip_prefix("endowire: listens at ").unwrap_or_else(|| panic!("{line}")).to_owned()
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

/// A display that nobody sees; none where there is no such program.
#[cfg(all(target_os = "linux", feature = "window"))]
struct Display(Child, String);

#[cfg(all(target_os = "linux", feature = "window"))]
impl Display {
    fn open() -> Option<Self> {
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "1400x1000x24"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok()?;
        let mut number = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut number).ok()?;
        Some(Self(child, format!(":{}", number.trim())))
    }
}

#[cfg(all(target_os = "linux", feature = "window"))]
impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs a window on a display that nobody sees, gives it lines with pauses in ms, and has its pace; none where there is no Xvfb. After each
/// line `also` is told the display and the line's number.
#[cfg(all(target_os = "linux", feature = "window"))]
fn paced(scene: &str, record: &Path, lines: &[(Value, u64)], also: impl Fn(&str, usize)) -> Option<Value> {
    let Some(display) = Display::open() else {
        eprintln!("skipped: there is no Xvfb to open a window on");
        return None;
    };
    let mut command = play(scene, record, &["--listen", "127.0.0.1:0", "--json"]);
    let mut child = command.env("DISPLAY", &display.1).env_remove("WAYLAND_DISPLAY").spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut stream = TcpStream::connect(address(&mut said)).unwrap();
    let mut answers = BufReader::new(stream.try_clone().unwrap());
    for (number, (line, pause_ms)) in lines.iter().enumerate() {
        writeln!(stream, "{line}").unwrap();
        let mut answer = String::new();
        answers.read_line(&mut answer).unwrap();
        assert_eq!(serde_json::from_str::<Value>(&answer).unwrap()["ok"], true, "{answer}");
        also(&display.1, number);
        std::thread::sleep(std::time::Duration::from_millis(*pause_ms));
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
#[cfg(all(target_os = "linux", feature = "window"))]
fn a_window_shows_inputs_soon_and_physics_keeps_its_pace() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let mut lines = vec![
        (json!({"do": "pedal", "down": true, "mode": "fluoro"}), 3000),
        (json!({"do": "move", "instrument": "catheter", "mm_per_s": 10, "deg_per_s": 20}), 0),
    ];
    for turn in 0..40 {
        let mm = if turn % 3 == 0 { -0.5 } else { 0.75 };
        lines.push((json!({"do": "nudge", "instrument": "wire", "mm": mm, "deg": 4}), 110));
    }
    lines.push((json!({"do": "quit"}), 0));
    let Some(pace) = paced("arch_vertebral.toml", &record, &lines, |_, _| {}) else { return };
    assert!(pace["ticks_per_s"].as_f64().unwrap() > 55.0, "{pace}");
    assert!(pace["input_to_picture_ms"][0].as_f64().unwrap() <= 100.0, "{pace}");
    assert!(std::fs::read_to_string(&record).unwrap().contains("[[script]]"));
}

#[test]
#[cfg(all(target_os = "linux", feature = "window"))]
fn a_room_that_changes_is_seen_soon_over_a_whole_body_with_contrast_medium() {
    let folder = tempfile::tempdir().unwrap();
    let mut lines = vec![(json!({"do": "pedal", "down": true, "mode": "fluoro"}), 4000)];
    for turn in 0..27 {
        lines.push(match turn % 3 {
            0 => (json!({"do": "turn_c_arm", "lao_deg": 3}), 110),
            1 => (json!({"do": "table", "right_mm": 2, "down_mm": 1}), 110),
            _ => (json!({"do": "collimate", "width": 0.9 - 0.01 * f64::from(turn), "height": 0.8}), 700),
        });
    }
    lines.push((json!({"do": "quit"}), 0));
    let record = folder.path().join("played.toml");
    let Some(pace) = paced("arch_angiography.toml", &record, &lines, |_, _| {}) else { return };
    assert!(pace["ticks_per_s"].as_f64().unwrap() > 55.0, "{pace}");
    assert!(pace["input_to_picture_ms"][0].as_f64().unwrap() <= 100.0, "{pace}");
}

/// Windows of a display are taken off it, put back, and given one of many sizes.
#[cfg(all(target_os = "linux", feature = "window"))]
fn disturb(display: &str, number: usize) {
    use x11rb::connection::Connection;
    use x11rb::protocol::xproto::{ConfigureWindowAux, ConnectionExt};
    const SIZES: [[u32; 2]; 7] =
        [[1, 1], [1400, 20], [37, 900], [640, 480], [3, 3], [3000, 2000], [1280, 860]];
    let (connection, screen) = x11rb::connect(Some(display)).unwrap();
    let root = connection.setup().roots[screen].root;
    let [width, height] = SIZES[number % SIZES.len()];
    for window in connection.query_tree(root).unwrap().reply().unwrap().children {
        let size = ConfigureWindowAux::new().width(width).height(height);
        match number % 4 {
            1 => connection.unmap_window(window),
            2 => connection.map_window(window),
            _ => connection.configure_window(window, &size),
        }
        .unwrap()
        .ignore_error();
    }
    // All of it has been done when there is an answer.
    connection.get_input_focus().unwrap().reply().unwrap();
}

#[test]
#[cfg(all(target_os = "linux", feature = "window"))]
fn a_window_that_is_resized_and_hidden_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let mut lines = vec![(json!({"do": "pedal", "down": true, "mode": "fluoro"}), 1500)];
    lines.extend((0..42).map(|_| (json!({"do": "nudge", "instrument": "wire", "mm": 0.5}), 70)));
    lines.push((json!({"do": "quit"}), 0));
    let Some(pace) = paced("arch_vertebral.toml", &record, &lines, disturb) else { return };
    assert!(pace["ticks_per_s"].as_f64().unwrap() > 55.0, "{pace}");
    // Every nudge is in the script.
    let script: toml::Table = std::fs::read_to_string(&record).unwrap().parse().unwrap();
    let advance = |line: &toml::Value| line.get("advance_mm").and_then(toml::Value::as_float).unwrap_or(0.0);
    let advanced: f64 = script["script"].as_array().unwrap().iter().map(advance).sum();
    assert!((advanced - 21.0).abs() < 1e-9, "{advanced} mm");
}
