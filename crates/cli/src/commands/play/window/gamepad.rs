//! Listens to gamepads on a thread of its own, by gilrs, and tells the window how the first of them is held.

use std::time::Duration;

use endowire_play::{Button, Pad};
use gilrs::{Axis, Button as Key, Gamepad, Gilrs};
use winit::event_loop::EventLoopProxy;

use super::Told;

use crate::output::tell;

/// How soon a window that was closed is noticed.
const PATIENCE: Duration = Duration::from_secs(1);

/// Tells the window of each change until it is closed.
pub(super) fn listen(window: EventLoopProxy<Told>) {
    std::thread::spawn(move || {
        let mut gilrs = match Gilrs::new() {
            Ok(gilrs) => gilrs,
            Err(error) => return tell(format_args!("endowire: gamepads cannot be read: {error}")),
        };
        let mut told = None;
        loop {
            let now = gilrs.gamepads().next().map(|(_, pad)| (pad.name().to_owned(), held(&pad)));
            if now != told {
                told.clone_from(&now);
                if window.send_event(Told::Gamepad(now)).is_err() {
                    return;
                }
            }
            // What has come in by then is one change.
            if gilrs.next_event_blocking(Some(PATIENCE)).is_some() {
                while gilrs.next_event().is_some() {}
            }
        }
    });
}

/// How a gamepad is held now.
fn held(pad: &Gamepad<'_>) -> Pad {
    let down = Button::ALL.into_iter().filter(|button| pad.is_pressed(key(*button))).collect();
    let [up, right] = [Axis::LeftStickY, Axis::RightStickX].map(|axis| f64::from(pad.value(axis)));
    Pad { up, right, down }
}

fn key(button: Button) -> Key {
    match button {
        Button::Lower => Key::South,
        Button::Right => Key::East,
        Button::Left => Key::West,
        Button::Upper => Key::North,
        Button::LeftBumper => Key::LeftTrigger,
        Button::RightBumper => Key::RightTrigger,
        Button::LeftTrigger => Key::LeftTrigger2,
        Button::RightTrigger => Key::RightTrigger2,
        Button::Select => Key::Select,
        Button::Start => Key::Start,
        Button::CrossLeft => Key::DPadLeft,
        Button::CrossRight => Key::DPadRight,
        Button::CrossUp => Key::DPadUp,
        Button::CrossDown => Key::DPadDown,
    }
}
