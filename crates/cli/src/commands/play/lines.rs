//! The line protocol: each command and each answer is one line of JSON, on stdin and stdout or a socket.

use std::io::{self, BufRead, Read};
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;

use endowire_core::error::nearest_name;
use endowire_core::input::plain;
use endowire_play::{INPUTS, Input, Readout};
use serde::{Deserialize, Serialize};

use super::live::Message;
use crate::output::print;

/// Length limit of a line, bytes.
const LONGEST: u64 = 65_536;

/// Commands to the program rather than to the session.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Order {
    /// Requests the readout.
    Read {},
    /// Advances by ticks of 1/60 s.
    Wait { ticks: u32 },
    /// Writes both views side by side, or the whole window, to a file.
    Picture {
        file: PathBuf,
        #[serde(default)]
        window: bool,
    },
    /// Ends the session.
    Quit {},
}

/// Their names, as `do` has them.
const ORDERS: [&str; 4] = ["wait", "picture", "read", "quit"];

/// A line of the protocol.
#[derive(Debug)]
pub(crate) enum Line {
    Input(Input),
    Order(Order),
}

/// Parses a line, or returns the reason why it is invalid.
fn parse(text: &str) -> Result<Line, String> {
    #[derive(Deserialize)]
    struct Name {
        #[serde(rename = "do")]
        name: String,
    }
    let Name { name } = serde_json::from_str(text)
        .map_err(|e: serde_json::Error| format!("no command: {}", plain(&e.to_string())))?;
    let wrong = |e: serde_json::Error| format!("{name}: {}", plain(&e.to_string()));
    if ORDERS.contains(&name.as_str()) {
        let order = serde_json::from_str(text).map_err(wrong)?;
        return checked(order).map(Line::Order);
    }
    if INPUTS.contains(&name.as_str()) {
        return serde_json::from_str(text).map(Line::Input).map_err(wrong);
    }
    let all: Vec<&str> = INPUTS.into_iter().chain(ORDERS).collect();
    let nearest = nearest_name(all.iter().copied(), &name).unwrap_or_default();
    Err(format!("{name}: is no command: did you mean {nearest:?}? There are {}", all.join(", ")))
}

/// Refuses a picture in a file that would not say what it is.
fn checked(order: Order) -> Result<Order, String> {
    match &order {
        Order::Picture { file, .. }
            if !file.extension().is_some_and(|end| end.eq_ignore_ascii_case("png")) =>
        {
            Err(format!("picture: file = {:?}: must end in .png", file.display().to_string()))
        }
        _ => Ok(order),
    }
}

/// Time in which the last answer can be written, after which the session ends without its being read.
const LAST_ANSWER: Duration = Duration::from_secs(2);

/// Where the answer to a line goes.
#[derive(Debug)]
pub(crate) struct Reply {
    to: Sender<String>,
    /// Disconnected when the answer is written.
    written: Receiver<()>,
}

impl Reply {
    /// Hands over an answer. Its client may have left, which does not matter.
    pub(crate) fn send(&self, answer: String) {
        let _ = self.to.send(answer);
    }

    /// Hands over the last answer, and waits until it is written: the end of the program would overtake it.
    pub(crate) fn send_last(&self, answer: String) {
        self.send(answer);
        let _ = self.written.recv_timeout(LAST_ANSWER);
    }
}

/// The answer to a line.
#[derive(Serialize)]
struct Answer<'a> {
    ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a str>,
    readout: &'a Readout,
}

/// The answer as a line: the current readout, and the error, if any.
pub(crate) fn answer(done: Result<(), String>, readout: &Readout) -> String {
    let error = done.err();
    let answer = Answer { ok: error.is_none(), error: error.as_deref(), readout };
    serde_json::to_string(&answer).unwrap_or_else(|e| format!("{{\"ok\":false,\"error\":\"{e}\"}}"))
}

/// Reads lines until the end; each is answered before the next is read. `allowed` may refuse or change a line; `tell`
/// returns whether its answer was received.
pub(crate) fn read(
    mut from: impl BufRead,
    to: &Sender<Message>,
    allowed: impl Fn(Line) -> Result<Line, String>,
    mut tell: impl FnMut(&str) -> bool,
) {
    while let Ok(Some(text)) = next_line(&mut from) {
        if text.as_ref().is_ok_and(|text| text.trim().is_empty()) {
            continue;
        }
        let line = text.and_then(|text| parse(&text)).and_then(&allowed);
        // `_writing` lives until the answer is written.
        let ((answer, answered), (_writing, written)) = (mpsc::channel(), mpsc::channel());
        if to.send(Message::Line(line, Reply { to: answer, written })).is_err() {
            return;
        }
        match answered.recv() {
            Ok(line) if tell(&line) => {}
            _ => return,
        }
    }
}

/// The next line, or why it is invalid; `None` at the end. A line that is too long is skipped.
fn next_line(from: &mut impl BufRead) -> io::Result<Option<Result<String, String>>> {
    let mut bytes = Vec::new();
    from.by_ref().take(LONGEST).read_until(b'\n', &mut bytes)?;
    if bytes.is_empty() {
        return Ok(None);
    }
    if bytes.len() as u64 == LONGEST && bytes.last() != Some(&b'\n') {
        from.skip_until(b'\n')?;
        return Ok(Some(Err(format!("no command: a line has at most {LONGEST} bytes"))));
    }
    Ok(Some(String::from_utf8(bytes).map_err(|e| format!("no command: {e}"))))
}

pub(crate) fn to_stdout(line: &str) -> bool {
    print(line).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_command_is_reported_all_that_there_are() {
        let reported = parse("{\"do\": \"weit\"}").unwrap_err();
        assert!(reported.starts_with("weit: is no command: did you mean \"wait\"?"), "{reported}");
        for name in INPUTS.into_iter().chain(ORDERS) {
            assert!(reported.contains(name), "{name}");
            // Each is known, whatever keys it needs.
            let reported = parse(&format!("{{\"do\": \"{name}\"}}")).err().unwrap_or_default();
            assert!(!reported.contains("unknown variant") && !reported.contains("no command"), "{reported}");
        }
        // Those of a session are all of them.
        let reported = serde_json::from_str::<Input>("{\"do\": \"x\"}").unwrap_err().to_string();
        assert_eq!(reported.matches('`').count() / 2, INPUTS.len() + 1, "{reported}");
    }

    #[test]
    fn a_picture_is_a_png() {
        let picture = |file: &str| parse(&format!("{{\"do\": \"picture\", \"file\": \"{file}\"}}"));
        assert!(picture("a.png").is_ok() && picture("a.PNG").is_ok());
        assert_eq!(picture("a.jpg").unwrap_err(), "picture: file = \"a.jpg\": must end in .png");
    }
}
