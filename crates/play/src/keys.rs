//! What keys do.

use std::collections::HashSet;

use endowire_play::{Input, USUAL_DEG_PER_S, USUAL_MM_PER_S};
use endowire_viewer::Mode;
use winit::keyboard::{KeyCode, ModifiersState};

#[cfg(any(test, feature = "gamepad"))]
use super::pad::Pad;

/// Keys and what they do.
pub(super) const HELP: &[(&str, &str)] = &[
    ("up, down", "push, pull (hold)"),
    ("left, right", "turn (hold)"),
    ("Shift / Ctrl with these", "coarse (four times) / fine (a fifth)"),
    ("Tab, 1 to 9", "next instrument, instrument by number"),
    ("0", "all instruments together"),
    ("Space, C, V, B (hold)", "fluoroscopy, cine, DSA, roadmap"),
    ("Enter", "fluoroscopy on or off without holding"),
    ("I, Shift I", "inject 5 ml, 20 ml of contrast medium"),
    ("J L, O K", "C-arm RAO LAO, cranial caudal, by 5°"),
    ("drag the live picture", "move the table"),
    ("+ -, wheel", "magnify"),
    ("Q E", "blades in and out"),
    ("drag the 3D view", "turn it"),
    ("P, Shift P", "show the script, have it rest; moving takes over"),
    ("Backspace, Shift Backspace", "undo the last motion, do it again"),
    ("F1, Esc", "this help, end"),
];

/// What a key asks of the window itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asked {
    Help,
    Quit,
}

/// Keys that are down, and what they have come to.
pub(super) struct Keys {
    instruments: Vec<String>,
    /// The chosen one; none for all.
    chosen: Option<usize>,
    down: HashSet<KeyCode>,
    /// Shift and their like of the keyboard, and what does the same on a gamepad.
    modifiers: [ModifiersState; 2],
    /// Shares of the usual speeds that the sticks of a gamepad ask for.
    leans: [f64; 2],
    /// Whether the beam stays on.
    locked: bool,
    open: f64,
}

/// Keys that move instruments while they are down, …
const ARROWS: [KeyCode; 4] = [KeyCode::ArrowUp, KeyCode::ArrowDown, KeyCode::ArrowLeft, KeyCode::ArrowRight];
/// … and pedals.
const PEDALS: [KeyCode; 4] = [KeyCode::Space, KeyCode::KeyC, KeyCode::KeyV, KeyCode::KeyB];

impl Keys {
    pub(super) fn new(instruments: Vec<String>) -> Self {
        Self {
            instruments,
            chosen: Some(0),
            down: HashSet::new(),
            modifiers: [ModifiersState::empty(); 2],
            leans: [0.0; 2],
            locked: false,
            open: 1.0,
        }
    }

    /// Hears that Shift and their like have changed: hands go faster or slower.
    pub(super) fn modify(&mut self, modifiers: ModifiersState) -> Vec<Input> {
        self.modifiers[0] = modifiers;
        self.moving()
    }

    /// What a gamepad does that is held otherwise than before.
    #[cfg(any(test, feature = "gamepad"))]
    pub(super) fn pad(&mut self, before: &Pad, now: &Pad) -> Vec<Input> {
        let asked = (self.modifiers[1], self.leans);
        (self.modifiers[1], self.leans) = (now.modifiers(), now.leans());
        let keys = now.keys_since(before);
        let mut inputs: Vec<Input> =
            keys.into_iter().flat_map(|(key, down)| self.key(key, down, false).0).collect();
        if asked != (self.modifiers[1], self.leans) {
            inputs.extend(self.moving());
        }
        inputs
    }

    fn holds(&self, modifier: ModifiersState) -> bool {
        self.modifiers.iter().any(|held| held.contains(modifier))
    }

    /// Lets go of what keys hold: the window has lost the keyboard. What other hands do goes on.
    pub(super) fn let_go(&mut self) -> Vec<Input> {
        let held = |keys: [KeyCode; 4]| keys.iter().any(|key| self.down.contains(key));
        let (moves, shines) = (held(ARROWS), self.locked || held(PEDALS));
        self.down.clear();
        self.locked = false;
        let mut inputs = if moves { self.moving() } else { vec![] };
        if shines {
            inputs.push(Input::Pedal { down: false, mode: None });
        }
        inputs
    }

    /// What a key does that goes down, once more while it is held, or up.
    pub(super) fn key(&mut self, key: KeyCode, down: bool, again: bool) -> (Vec<Input>, Option<Asked>) {
        if down {
            self.down.insert(key);
        } else {
            self.down.remove(&key);
        }
        let asked = match (key, down && !again) {
            (KeyCode::F1, true) => Some(Asked::Help),
            (KeyCode::Escape, true) => Some(Asked::Quit),
            _ => None,
        };
        (self.inputs(key, down, again), asked)
    }

    fn inputs(&mut self, key: KeyCode, down: bool, again: bool) -> Vec<Input> {
        let press = down && !again;
        match key {
            KeyCode::ArrowUp | KeyCode::ArrowDown | KeyCode::ArrowLeft | KeyCode::ArrowRight if !again => {
                self.moving()
            }
            KeyCode::Space | KeyCode::KeyC | KeyCode::KeyV | KeyCode::KeyB if !again => {
                self.locked = false;
                let mode = match key {
                    KeyCode::Space => Mode::Fluoro,
                    KeyCode::KeyC => Mode::Cine,
                    KeyCode::KeyV => Mode::Dsa,
                    _ => Mode::Roadmap,
                };
                vec![Input::Pedal { down, mode: Some(mode) }]
            }
            KeyCode::Enter if press => {
                self.locked = !self.locked;
                vec![Input::Pedal { down: self.locked, mode: Some(Mode::Fluoro) }]
            }
            KeyCode::Tab if press => {
                self.choose(Some(self.chosen.map_or(0, |index| (index + 1) % self.instruments.len())))
            }
            KeyCode::KeyP if press && self.holds(ModifiersState::SHIFT) => vec![Input::Stop {}],
            KeyCode::KeyP if press => vec![Input::Script {}],
            KeyCode::Backspace if press && self.holds(ModifiersState::SHIFT) => vec![Input::Redo {}],
            KeyCode::Backspace if press => vec![Input::Undo {}],
            KeyCode::KeyI if press => {
                let ml = if self.holds(ModifiersState::SHIFT) { 20.0 } else { 5.0 };
                vec![Input::Inject { ml, ml_per_s: ml }]
            }
            KeyCode::KeyJ if down => vec![Input::TurnCArm { lao_deg: -5.0, cra_deg: 0.0 }],
            KeyCode::KeyL if down => vec![Input::TurnCArm { lao_deg: 5.0, cra_deg: 0.0 }],
            KeyCode::KeyO if down => vec![Input::TurnCArm { lao_deg: 0.0, cra_deg: 5.0 }],
            KeyCode::KeyK if down => vec![Input::TurnCArm { lao_deg: 0.0, cra_deg: -5.0 }],
            KeyCode::Equal | KeyCode::NumpadAdd if down => vec![Input::Zoom { factor: 1.25 }],
            KeyCode::Minus | KeyCode::NumpadSubtract if down => vec![Input::Zoom { factor: 0.8 }],
            KeyCode::KeyQ if down => self.blades(-0.1),
            KeyCode::KeyE if down => self.blades(0.1),
            _ if press => digit(key).map_or_else(Vec::new, |number| self.choose_number(number)),
            _ => vec![],
        }
    }

    fn blades(&mut self, by: f64) -> Vec<Input> {
        self.open = (self.open + by).clamp(0.2, 1.0);
        vec![Input::Collimate { width: self.open, height: self.open }]
    }

    fn choose_number(&mut self, number: usize) -> Vec<Input> {
        match number {
            0 => self.choose(None),
            _ if number <= self.instruments.len() => self.choose(Some(number - 1)),
            _ => vec![],
        }
    }

    /// Takes another instrument in the hand; that before rests.
    fn choose(&mut self, index: Option<usize>) -> Vec<Input> {
        self.chosen = index;
        let select = index.map(|index| Input::Select { instrument: self.instruments[index].clone() });
        std::iter::once(Input::Stop {}).chain(select).chain(self.moving()).collect()
    }

    /// What arrows and sticks have hands do now.
    fn moving(&self) -> Vec<Input> {
        let axis = |plus, minus, lean: f64| {
            let keys = f64::from(self.down.contains(&plus)) - f64::from(self.down.contains(&minus));
            (keys + lean).clamp(-1.0, 1.0)
        };
        let scale = match (self.holds(ModifiersState::SHIFT), self.holds(ModifiersState::CONTROL)) {
            (true, false) => 4.0,
            (false, true) => 0.2,
            _ => 1.0,
        };
        let mm_per_s = scale * USUAL_MM_PER_S * axis(KeyCode::ArrowUp, KeyCode::ArrowDown, self.leans[0]);
        let deg_per_s =
            scale * USUAL_DEG_PER_S * axis(KeyCode::ArrowRight, KeyCode::ArrowLeft, self.leans[1]);
        let hands =
            self.instruments.iter().enumerate().filter(|(index, _)| self.chosen.is_none_or(|c| c == *index));
        hands.map(|(_, name)| Input::Move { instrument: Some(name.clone()), mm_per_s, deg_per_s }).collect()
    }
}

fn digit(key: KeyCode) -> Option<usize> {
    let digits = [
        KeyCode::Digit0,
        KeyCode::Digit1,
        KeyCode::Digit2,
        KeyCode::Digit3,
        KeyCode::Digit4,
        KeyCode::Digit5,
        KeyCode::Digit6,
        KeyCode::Digit7,
        KeyCode::Digit8,
        KeyCode::Digit9,
    ];
    digits.iter().position(|digit| *digit == key)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(name: &str, mm_per_s: f64, deg_per_s: f64) -> Input {
        Input::Move { instrument: Some(name.to_owned()), mm_per_s, deg_per_s }
    }

    #[test]
    fn arrows_move_what_is_chosen_as_long_as_they_are_down() {
        let mut keys = Keys::new(vec!["wire".to_owned(), "catheter".to_owned()]);
        assert_eq!(keys.key(KeyCode::ArrowUp, true, false).0, [moved("wire", 10.0, 0.0)]);
        assert!(keys.key(KeyCode::ArrowUp, true, true).0.is_empty());
        assert_eq!(keys.modify(ModifiersState::CONTROL), [moved("wire", 2.0, 0.0)]);
        assert_eq!(keys.key(KeyCode::ArrowLeft, true, false).0, [moved("wire", 2.0, -18.0)]);
        // Changing hands leaves nothing behind that moves.
        let changed = keys.key(KeyCode::Tab, true, false).0;
        let select = Input::Select { instrument: "catheter".to_owned() };
        assert_eq!(changed, [Input::Stop {}, select, moved("catheter", 2.0, -18.0)]);
        keys.modify(ModifiersState::empty());
        keys.key(KeyCode::ArrowLeft, false, false);
        let all = keys.key(KeyCode::Digit0, true, false).0;
        assert_eq!(all, [Input::Stop {}, moved("wire", 10.0, 0.0), moved("catheter", 10.0, 0.0)]);
        assert_eq!(keys.let_go(), [moved("wire", 0.0, 0.0), moved("catheter", 0.0, 0.0)]);
        // What no key holds is another hand's.
        assert!(keys.let_go().is_empty());
        assert_eq!(
            keys.modify(ModifiersState::SHIFT),
            [moved("wire", 0.0, 0.0), moved("catheter", 0.0, 0.0)]
        );
    }

    #[test]
    fn pedals_are_held_or_locked() {
        let mut keys = Keys::new(vec!["device".to_owned()]);
        let pedal = |down, mode| [Input::Pedal { down, mode: Some(mode) }];
        assert_eq!(keys.key(KeyCode::KeyC, true, false).0, pedal(true, Mode::Cine));
        assert_eq!(keys.key(KeyCode::KeyC, false, false).0, pedal(false, Mode::Cine));
        assert_eq!(keys.key(KeyCode::Enter, true, false).0, pedal(true, Mode::Fluoro));
        assert_eq!(keys.key(KeyCode::Enter, true, false).0, pedal(false, Mode::Fluoro));
        assert_eq!(keys.key(KeyCode::Digit7, true, false).0, []);
        let up = [Input::Pedal { down: false, mode: None }];
        for key in [KeyCode::Enter, KeyCode::KeyV] {
            keys.key(key, true, false);
            assert_eq!(keys.let_go(), up);
            assert!(keys.let_go().is_empty());
        }
        assert_eq!(keys.key(KeyCode::F1, true, false).1, Some(Asked::Help));
    }
}
