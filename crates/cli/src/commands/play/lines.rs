//! The protocol: one line of JSON a command, one line of JSON an answer, on stdin and stdout or a socket.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::mpsc::Sender;

use endowire_play::{Input, Readout};
use serde::{Deserialize, Serialize};

use super::live::Message;
use crate::failure::Failure;
use crate::output::{print, tell};

/// Longest line that is read.
const LONGEST: u64 = 65_536;

/// What is asked of the program and not of the session.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Order {
    /// Asks for the readout alone.
    Read {},
    /// Lets so many sixtieths of a second go by.
    Wait { ticks: u32 },
    /// Writes both views side by side, or the whole window.
    Picture {
        file: PathBuf,
        #[serde(default)]
        window: bool,
    },
    /// Ends the session.
    Quit {},
}

/// One line.
#[derive(Debug)]
pub(crate) enum Line {
    Input(Input),
    Order(Order),
}

/// What a line asks for, or what is wrong with it.
pub(crate) fn parse(text: &str) -> Result<Line, String> {
    #[derive(Deserialize)]
    struct Name {
        #[serde(rename = "do")]
        name: String,
    }
    let Name { name } = serde_json::from_str(text).map_err(|e| format!("no command: {e}"))?;
    match name.as_str() {
        "read" | "wait" | "picture" | "quit" => serde_json::from_str(text).map(Line::Order),
        _ => serde_json::from_str(text).map(Line::Input),
    }
    .map_err(|e| format!("{name}: {e}"))
}

/// The answer to a line.
#[derive(Serialize)]
struct Answer<'a> {
    ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a str>,
    readout: &'a Readout,
}

/// The answer as a line: what is read now, and what was wrong.
pub(crate) fn answer(done: Result<(), String>, readout: &Readout) -> String {
    let error = done.err();
    let answer = Answer { ok: error.is_none(), error: error.as_deref(), readout };
    serde_json::to_string(&answer).unwrap_or_else(|e| format!("{{\"ok\":false,\"error\":\"{e}\"}}"))
}

/// Reads lines until the end and has each answered before the next; what answers cannot be told to has left.
pub(crate) fn read(mut from: impl BufRead, to: &Sender<Message>, mut tell: impl FnMut(&str) -> bool) {
    loop {
        let mut text = String::new();
        match from.by_ref().take(LONGEST).read_line(&mut text) {
            Ok(0) | Err(_) => break,
            Ok(_) if text.trim().is_empty() => continue,
            Ok(_) => {}
        }
        let (reply, answered) = std::sync::mpsc::channel();
        if to.send(Message::Line(text, reply)).is_err() {
            return;
        }
        match answered.recv() {
            Ok(line) if tell(&line) => {}
            _ => break,
        }
    }
    let _ = to.send(Message::Ended);
}

pub(crate) fn to_stdout(line: &str) -> bool {
    print(line).is_ok()
}

/// Takes lines from programs that connect.
pub(crate) fn listen(address: SocketAddr, to: &Sender<Message>) -> Result<(), Failure> {
    let failed = |e: std::io::Error| Failure::Input(format!("--listen {address}: {e}"));
    let listener = TcpListener::bind(address).map_err(failed)?;
    tell(format_args!("endowire: listens at {}", listener.local_addr().map_err(failed)?));
    let to = to.clone();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let to = to.clone();
            std::thread::spawn(move || serve(stream, &to));
        }
    });
    Ok(())
}

/// Answers one program until it leaves; the session goes on.
fn serve(stream: TcpStream, to: &Sender<Message>) {
    let Ok(mut back) = stream.try_clone() else { return };
    // Its end is not that of the session.
    let (own, relayed) = std::sync::mpsc::channel();
    let to = to.clone();
    std::thread::spawn(move || {
        relayed.into_iter().filter(|message| !matches!(message, Message::Ended)).try_for_each(|m| to.send(m))
    });
    read(BufReader::new(stream), &own, |line| writeln!(back, "{line}").is_ok());
}
