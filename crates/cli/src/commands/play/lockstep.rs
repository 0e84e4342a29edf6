//! A session whose time advances only by its inputs: the same lines give the same bits.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use endowire_play::{Pictures, Session, Snapshot};
use endowire_viewer::Image;

use super::lines::{self, Line, Order};
use super::live::Message;
use super::record::Record;
use crate::commands::run::interrupts;
use crate::failure::Failure;

/// Interval at which interrupts are checked.
const PATIENCE: Duration = Duration::from_millis(100);

/// Result of a line.
type Done = Result<(), String>;

/// Answers lines until they end.
pub(crate) fn run(
    mut session: Session,
    mut pictures: Pictures,
    messages: &Receiver<Message>,
    record: &mut Record,
) -> Result<Session, Failure> {
    let interrupted = interrupts();
    while !interrupted.load(Ordering::Relaxed) {
        match messages.recv_timeout(PATIENCE) {
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) | Ok(Message::Ended | Message::Quit) => break,
            Ok(Message::Input(input)) => {
                // A refused input becomes an event of the session.
                let _ = session.apply(&input);
            }
            // Only a window sends its own, which is valid.
            Ok(Message::Side(side_px)) => drop(session.show_at(side_px)),
            Ok(Message::Line(line, reply)) => {
                let quits = matches!(line, Ok(Line::Order(Order::Quit {})));
                let done = match line {
                    Err(refused) => Err(refused),
                    Ok(Line::Input(input)) => session.apply(&input).map_err(|e| e.to_string()),
                    Ok(Line::Order(Order::Read {} | Order::Quit {})) => Ok(()),
                    Ok(Line::Order(Order::Wait { ticks })) => wait(ticks, &mut session, record, interrupted)?,
                    Ok(Line::Order(Order::Picture { file, window })) => {
                        picture(&file, window, &session, &mut pictures)
                    }
                };
                let answer = lines::answer(done, &session.readout());
                if quits {
                    reply.send_last(answer);
                    break;
                }
                reply.send(answer);
            }
        }
        record.keep(&session)?;
    }
    Ok(session)
}

/// Advances by ticks unless interrupted, and saves the record at intervals.
fn wait(
    ticks: u32,
    session: &mut Session,
    record: &mut Record,
    interrupted: &AtomicBool,
) -> Result<Done, Failure> {
    for tick in 0..ticks {
        if interrupted.load(Ordering::Relaxed) {
            return Ok(Err(format!("wait: interrupted after {tick} of {ticks} ticks")));
        }
        session.tick();
        record.keep(session)?;
    }
    Ok(Ok(()))
}

fn picture(file: &Path, window: bool, session: &Session, pictures: &mut Pictures) -> Done {
    let snapshot = session.snapshot();
    let three_d = pictures.three_d(&snapshot).map_err(|e| e.to_string())?;
    let planes = pictures.fluoro(&snapshot).map_err(|e| e.to_string())?;
    if window {
        return whole_window(file, snapshot, planes, &three_d);
    }
    planes
        .iter()
        .rev()
        .fold(three_d, |right, left| left.beside(&right))
        .write_png(file)
        .map_err(|e| e.to_string())
}

#[cfg(feature = "window")]
fn whole_window(file: &Path, snapshot: Snapshot, planes: &[Image], three_d: &Image) -> Done {
    super::window::write(file, snapshot, planes, three_d)
}

#[cfg(not(feature = "window"))]
fn whole_window(_: &Path, _: Snapshot, _: &[Image], _: &Image) -> Done {
    Err("window: this program was built without the feature window: leave it out, or cargo build --release --features window".to_owned())
}
