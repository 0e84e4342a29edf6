//! Gamepads of browsers, by the standard layout of the Gamepad API.

use endowire_play::{Button, Pad};

/// Buttons in the order of the layout; `None` for those that sessions do not use.
const BUTTONS: [Option<Button>; 16] = [
    Some(Button::Lower),
    Some(Button::Right),
    Some(Button::Left),
    Some(Button::Upper),
    Some(Button::LeftBumper),
    Some(Button::RightBumper),
    Some(Button::LeftTrigger),
    Some(Button::RightTrigger),
    Some(Button::Select),
    Some(Button::Start),
    None,
    Some(Button::RightStick),
    Some(Button::CrossUp),
    Some(Button::CrossDown),
    Some(Button::CrossLeft),
    Some(Button::CrossRight),
];

/// State of a gamepad: indices of pressed buttons, and the deflections of the left stick upwards and of the right
/// stick to the right and upwards, −1 to 1.
pub(crate) fn held(pressed: &[u8], [up, right, bend]: [f64; 3]) -> Pad {
    let down = pressed.iter().filter_map(|number| *BUTTONS.get(usize::from(*number))?).collect();
    Pad { up, right, bend, down }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_button_of_a_session_is_one_of_the_layout() {
        for button in Button::ALL {
            assert_eq!(BUTTONS.iter().flatten().filter(|one| **one == button).count(), 1, "{button:?}");
        }
        let pad = held(&[7, 10, 200], [0.5, -1.0, 0.25]);
        assert_eq!((pad.up, pad.right, pad.bend, pad.down), (0.5, -1.0, 0.25, [Button::RightTrigger].into()));
    }
}
