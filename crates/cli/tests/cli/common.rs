//! The program under test, and scenes of the assets for it.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{ChildStderr, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

/// `endowire`, with a cache of walls that is the tests' and not the user's.
pub(crate) fn endowire() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_endowire"));
    command.env("ENDOWIRE_CACHE", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"));
    command
}

/// The folder of the workspace.
pub(crate) fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The folder of vessels, devices and scenes.
pub(crate) fn assets() -> PathBuf {
    workspace().join("assets")
}

/// The text of a scene of the assets that can lie anywhere. Each change replaces a piece of it, which must be there.
pub(crate) fn scene_text(name: &str, changes: &[(&str, &str)]) -> String {
    let text = std::fs::read_to_string(assets().join("scenes").join(name)).unwrap();
    let text = text.replace("\"../", &format!("\"{}/", assets().display()));
    changes.iter().fold(text, |text, (piece, other)| {
        assert!(text.contains(piece), "{piece} is not in {name}");
        text.replace(piece, other)
    })
}

/// The curved tube pushed into for 30 mm, with small pictures.
pub(crate) const SHORT: [(&str, &str); 2] =
    [("advance_mm = 200.0", "advance_mm = 30.0"), ("size_px = [640, 640]", "size_px = [96, 64]")];

/// Looks again and again, for a minute at most, until something is so.
pub(crate) fn wait_until(mut done: impl FnMut() -> bool) {
    for _ in 0..6000 {
        if done() {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("waited for a minute");
}

/// What the program says on stderr.
pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// What is in a file.
pub(crate) fn bytes(path: impl AsRef<Path>) -> Vec<u8> {
    std::fs::read(path.as_ref()).unwrap_or_else(|e| panic!("{}: {e}", path.as_ref().display()))
}

/// A file of JSON.
pub(crate) fn document(path: impl AsRef<Path>) -> Value {
    serde_json::from_slice(&bytes(path)).unwrap()
}

/// The JSON that a call has written on stdout, which must have gone well.
pub(crate) fn reported(output: &Output) -> Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A scene of the assets.
pub(crate) fn scene(name: &str) -> PathBuf {
    assets().join("scenes").join(name)
}

/// `endowire play` in a scene of the assets.
pub(crate) fn play(name: &str, record: &Path, more: &[&str]) -> Command {
    let mut command = endowire();
    command
        .args(["play".as_ref(), scene(name).as_os_str(), "--record".as_ref(), record.as_os_str()])
        .args(more);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// A program of `play` that listens.
pub(crate) struct Listening {
    pub(crate) address: String,
    pub(crate) token: String,
}

impl Listening {
    /// What it says of itself.
    pub(crate) fn read(said: &mut BufReader<ChildStderr>) -> Self {
        let mut reported = |begins: &str| {
            let mut line = String::new();
            said.read_line(&mut line).unwrap();
            line.trim().strip_prefix(begins).unwrap_or_else(|| panic!("{line}")).to_owned()
        };
        let address = reported("endowire: listens at ");
        Self { address, token: reported("endowire: the first line of a connection is ") }
    }

    /// A connection that has shown the token.
    pub(crate) fn connect(&self) -> BufReader<TcpStream> {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.write_all(format!("{}\n", self.token).as_bytes()).unwrap();
        BufReader::new(stream)
    }
}
