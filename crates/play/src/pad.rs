//! Gamepad bindings: sticks move, rotate and steer the selected instrument, buttons act as keys.

use std::collections::BTreeSet;

use crate::keys::Modifiers;

/// Buttons and sticks with their effects, for display.
pub const PAD: &[(&str, &str)] = &[
    ("left stick, up down", "push, pull, as fast as it leans"),
    ("right stick, left right", "turn, as fast as it leans"),
    ("right stick, up down; pressed", "bend the tip that is steered, as fast as it leans; straight"),
    ("right / left bumper with these", "coarse (four times) / fine (a fifth)"),
    ("right, left trigger (hold)", "fluoroscopy, cine"),
    ("upper, left button (hold)", "DSA, roadmap"),
    ("lower button", "inject 5 ml; 20 ml with the right bumper"),
    ("right button", "undo; do it again with the right bumper"),
    ("cross", "C-arm RAO LAO, cranial caudal, by 5°"),
    ("select, start", "next instrument, fluoroscopy on or off"),
];

/// Deflection below which a stick is in its centre: worn sticks do not return to the centre.
const DEAD_ZONE: f64 = 0.15;

/// A button, by its position: labels differ between makers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "each is where its name says")]
pub enum Button {
    Lower,
    Right,
    Left,
    Upper,
    LeftBumper,
    RightBumper,
    LeftTrigger,
    RightTrigger,
    Select,
    Start,
    CrossLeft,
    CrossRight,
    CrossUp,
    CrossDown,
    RightStick,
}

impl Button {
    /// All buttons.
    pub const ALL: [Self; 15] = [
        Self::Lower,
        Self::Right,
        Self::Left,
        Self::Upper,
        Self::LeftBumper,
        Self::RightBumper,
        Self::LeftTrigger,
        Self::RightTrigger,
        Self::Select,
        Self::Start,
        Self::CrossLeft,
        Self::CrossRight,
        Self::CrossUp,
        Self::CrossDown,
        Self::RightStick,
    ];

    /// The key with the same effect; `None` for the bumpers, which act as Shift and Ctrl.
    fn key(self) -> Option<&'static str> {
        Some(match self {
            Self::Lower => "KeyI",
            Self::Right => "Backspace",
            Self::Left => "KeyB",
            Self::Upper => "KeyV",
            Self::LeftBumper | Self::RightBumper => return None,
            Self::LeftTrigger => "KeyC",
            Self::RightTrigger => "Space",
            Self::Select => "Tab",
            Self::Start => "Enter",
            Self::CrossLeft => "KeyJ",
            Self::CrossRight => "KeyL",
            Self::CrossUp => "KeyO",
            Self::CrossDown => "KeyK",
            Self::RightStick => "KeyW",
        })
    }
}

/// State of a gamepad; untouched if none is connected.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pad {
    /// Deflection of the left stick upwards, −1 to 1.
    pub up: f64,
    /// Deflection of the right stick to the right, −1 to 1.
    pub right: f64,
    /// Deflection of the right stick upwards, −1 to 1.
    pub bend: f64,
    /// Pressed buttons.
    pub down: BTreeSet<Button>,
}

impl Pad {
    /// Fractions of the usual speeds of advance, rotation and steering.
    pub(crate) fn leans(&self) -> [f64; 3] {
        [self.up, self.right, self.bend].map(share)
    }

    /// Modifier keys that the bumpers stand for.
    pub(crate) fn modifiers(&self) -> Modifiers {
        let held = |button| self.down.contains(&button);
        Modifiers { shift: held(Button::RightBumper), control: held(Button::LeftBumper) }
    }

    /// Keys released and pressed since an earlier state.
    pub(crate) fn keys_since(&self, before: &Self) -> Vec<(&'static str, bool)> {
        let up = before.down.difference(&self.down).map(|button| (button, false));
        let down = self.down.difference(&before.down).map(|button| (button, true));
        up.chain(down).filter_map(|(button, is_down)| Some((button.key()?, is_down))).collect()
    }
}

/// Fraction of the speed for a deflection: 0 within the dead zone, 1 at the end, linear in between. It is rounded to
/// hundredths, so that trembling does not change the speed.
fn share(lean: f64) -> f64 {
    let beyond = (lean.abs().clamp(0.0, 1.0) - DEAD_ZONE).max(0.0) / (1.0 - DEAD_ZONE);
    // NaN becomes 0.
    let whole = (100.0 * beyond).round();
    if whole > 0.0 { whole.copysign(lean) / 100.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use endowire_core::device::{Device, Section, Steer};
    use endowire_viewer::Mode;

    use super::*;
    use crate::{Input, Keys};

    fn held(up: f64, right: f64, down: &[Button]) -> Pad {
        Pad { up, right, bend: 0.0, down: down.iter().copied().collect() }
    }

    fn moved(name: &str, mm_per_s: f64, deg_per_s: f64) -> Input {
        Input::Move { instrument: Some(name.to_owned()), mm_per_s, deg_per_s }
    }

    #[test]
    fn speeds_follow_the_sticks_beyond_a_dead_zone() {
        for (lean, speed) in [(0.0, 0.0), (0.149, 0.0), (-0.1, 0.0), (0.575, 0.5), (1.0, 1.0), (-1.0, -1.0)] {
            assert_eq!(share(lean), speed, "{lean}");
        }
        for broken in [f64::NAN, -f64::NAN] {
            assert_eq!(share(broken), 0.0);
        }
        assert_eq!([share(f64::INFINITY), share(-7.0)], [1.0, -1.0]);
        // The twin: without rounding, trembling would change the speed.
        assert_eq!(share(0.5749), share(0.5751));
        let steps: Vec<f64> = (0..=1000).map(|k| share(f64::from(k) / 1000.0)).collect();
        assert!(steps.windows(2).all(|pair| pair[0] <= pair[1]), "what leans more is not slower");
    }

    #[test]
    fn sticks_move_what_is_chosen_finely_and_coarsely() {
        let mut keys = Keys::new(vec!["wire".to_owned(), "catheter".to_owned()]);
        let rest = Pad::default();
        let half = held(0.575, 0.0, &[]);
        assert_eq!(keys.pad(&rest, &half), [moved("wire", 5.0, 0.0)]);
        assert_eq!(keys.pad(&half, &held(0.5749, 0.1, &[])), [], "a tremble is nothing");
        let coarse = held(0.575, -1.0, &[Button::RightBumper]);
        assert_eq!(keys.pad(&half, &coarse), [moved("wire", 20.0, -360.0)]);
        let fine = held(0.575, -1.0, &[Button::LeftBumper]);
        assert_eq!(keys.pad(&coarse, &fine), [moved("wire", 1.0, -18.0)]);
        // The newly selected instrument follows the sticks, and the previous one stops.
        let next = held(0.575, -1.0, &[Button::LeftBumper, Button::Select]);
        let select = Input::Select { instrument: "catheter".to_owned() };
        assert_eq!(keys.pad(&fine, &next), [Input::Stop {}, select, moved("catheter", 1.0, -18.0)]);
        // Disconnecting the gamepad releases everything.
        assert_eq!(keys.pad(&next, &rest), [moved("catheter", 0.0, 0.0)]);
        // Arrow keys and a stick together are not faster than either.
        keys.key("ArrowUp", true, false);
        assert_eq!(keys.pad(&rest, &held(1.0, 0.0, &[])), [moved("catheter", 10.0, 0.0)]);
    }

    #[test]
    fn buttons_are_pedals_and_keys() {
        let mut keys = Keys::new(vec!["device".to_owned()]);
        let rest = Pad::default();
        let mut press = |button: Button, bumper: bool| {
            let bumper = bumper.then_some(Button::RightBumper);
            let with: Vec<Button> = bumper.into_iter().chain([button]).collect();
            let before = held(0.0, 0.0, &with[..with.len() - 1]);
            keys.pad(&rest, &before);
            let inputs = keys.pad(&before, &held(0.0, 0.0, &with));
            let after = keys.pad(&held(0.0, 0.0, &with), &before);
            keys.pad(&before, &rest);
            (inputs, after)
        };
        let pedal = |down, mode| vec![Input::Pedal { down, mode: Some(mode) }];
        for (button, mode) in [
            (Button::RightTrigger, Mode::Fluoro),
            (Button::LeftTrigger, Mode::Cine),
            (Button::Upper, Mode::Dsa),
            (Button::Left, Mode::Roadmap),
        ] {
            assert_eq!(press(button, false), (pedal(true, mode), pedal(false, mode)), "{button:?}");
        }
        let turn = |lao_deg, cra_deg| vec![Input::TurnCArm { lao_deg, cra_deg }];
        for (button, bumper, inputs) in [
            (Button::Lower, false, vec![Input::Inject { ml: 5.0, ml_per_s: 5.0 }]),
            (Button::Lower, true, vec![Input::Inject { ml: 20.0, ml_per_s: 20.0 }]),
            (Button::Right, false, vec![Input::Undo {}]),
            (Button::Right, true, vec![Input::Redo {}]),
            (Button::Start, false, pedal(true, Mode::Fluoro)),
            (Button::Start, false, pedal(false, Mode::Fluoro)),
            (Button::CrossLeft, false, turn(-5.0, 0.0)),
            (Button::CrossRight, false, turn(5.0, 0.0)),
            (Button::CrossUp, false, turn(0.0, 5.0)),
            (Button::CrossDown, false, turn(0.0, -5.0)),
        ] {
            assert_eq!(press(button, bumper), (inputs, vec![]), "{button:?}");
        }
    }

    #[test]
    fn the_right_stick_bends_a_steered_tip_and_leaves_others_alone() {
        let rest = Pad::default();
        let bent = Pad { bend: 0.575, ..Pad::default() };
        let mut plain = Keys::new(vec!["wire".to_owned()]);
        assert_eq!(plain.pad(&rest, &bent), [moved("wire", 0.0, 0.0)]);
        let steer = Some(Steer { plane_deg: 0.0, curvature_per_mm_at_1: 0.02 });
        let tip = Section { steer, ..Section::straight(60.0, 0.9, 60.0) };
        let mut keys = Keys::of(&Device::new(vec![tip]).unwrap().into());
        let steer = |to: Option<f64>, per_s: Option<f64>| Input::Steer {
            instrument: Some("device".to_owned()),
            to,
            per_s,
        };
        let still = moved("device", 0.0, 0.0);
        assert_eq!(keys.pad(&rest, &bent), [still.clone(), steer(Some(1.0), Some(0.25))]);
        assert_eq!(keys.pad(&bent, &rest), [still, steer(None, None)]);
        let pressed = held(0.0, 0.0, &[Button::RightStick]);
        assert_eq!(keys.pad(&rest, &pressed), [steer(Some(0.0), Some(0.5))]);
    }

    #[test]
    fn every_gamepad_button_is_in_the_help() {
        let keys: BTreeSet<_> = Button::ALL.into_iter().filter_map(Button::key).collect();
        assert_eq!(keys.len(), Button::ALL.len() - 2, "bumpers have none, no two have one");
        assert!(PAD.iter().any(|(name, _)| name.contains("bumper")));
    }
}
