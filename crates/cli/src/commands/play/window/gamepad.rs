//! Listens to gamepads on another thread, through gilrs, and sends the state of the first one to the window.

use std::time::Duration;

use endowire_play::{Button, Pad};
use gilrs::{Axis, Button as Key, Gamepad, Gilrs};
use winit::event_loop::EventLoopProxy;

use super::Event;

use crate::output::tell;

/// Interval at which the thread checks whether the window was closed.
const PATIENCE: Duration = Duration::from_secs(1);

/// Sends each change to the window until it is closed.
pub(super) fn listen(window: EventLoopProxy<Event>) {
    std::thread::spawn(move || {
        let mut gilrs = match Gilrs::new() {
            Ok(gilrs) => gilrs,
            Err(error) => return tell(format_args!("endowire: gamepads cannot be read: {error}")),
        };
        let mut reported = None;
        loop {
            let now = gilrs.gamepads().next().map(|(_, pad)| (pad.name().to_owned(), held(&pad)));
            if now != reported {
                reported.clone_from(&now);
                if window.send_event(Event::Gamepad(now)).is_err() {
                    return;
                }
            }
            // Events that have arrived by then are combined to one change.
            if gilrs.next_event_blocking(Some(PATIENCE)).is_some() {
                while gilrs.next_event().is_some() {}
            }
        }
    });
}

/// The current state of a gamepad.
fn held(pad: &Gamepad<'_>) -> Pad {
    let down = Button::ALL.into_iter().filter(|button| pad.is_pressed(key(*button))).collect();
    let axes = [Axis::LeftStickY, Axis::RightStickX, Axis::RightStickY];
    let [up, right, bend] = axes.map(|axis| f64::from(pad.value(axis)));
    Pad { up, right, bend, down }
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
        Button::RightStick => Key::RightThumb,
    }
}
