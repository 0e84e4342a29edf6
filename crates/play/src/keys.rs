//! Key bindings for windows and pages. A key is identified by its position on the keyboard, the `code` of UI Events:
//! `"ArrowUp"`, `"KeyC"`.

use std::collections::BTreeSet;

use endowire_core::device::Stack;
use endowire_viewer::Mode;

use crate::lab::BLADES_IN;
use crate::pad::Pad;
use crate::session::IdleKey;
use crate::{Input, USUAL_DEG_PER_S, USUAL_MM_PER_S, USUAL_STEER_PER_S};

/// Keys and their effects, for display; F1 and Esc are handled by the window or page.
pub const KEYS: &[(&str, &str)] = &[
    ("up, down", "push, pull (hold)"),
    ("left, right", "turn (hold)"),
    ("A, S (hold); W", "bend the tip that is steered, either way; straight"),
    ("Shift / Ctrl with these", "coarse (four times) / fine (a fifth)"),
    ("Tab, 1 to 9", "next instrument, instrument by number"),
    ("0", "all instruments together"),
    ("Space, C, V, B (hold)", "fluoroscopy, cine, DSA, roadmap"),
    ("Enter", "fluoroscopy on or off without holding"),
    ("I, Shift I", "inject 5 ml, 20 ml of contrast medium"),
    ("D", "detach the coil of the instrument in the hand"),
    ("J L, O K", "C-arm RAO LAO, cranial caudal, by 5°"),
    ("drag the live picture", "move the table"),
    ("+ -, wheel", "magnify"),
    ("Q E", "blades in and out"),
    ("drag the 3D view, wheel", "turn it; with Shift or the right button: move it; magnify"),
    ("P, Shift P", "show the script, have it rest; moving takes over"),
    ("Backspace, Shift Backspace", "undo the last motion, do it again"),
];

/// Keys of each of [`KEYS`] that may be idle, and whether they are meant with Shift.
const CODES: [&[(&str, bool)]; KEYS.len()] = [
    &[],
    &[],
    &[("KeyA", false), ("KeyS", false), ("KeyW", false)],
    &[],
    &[("Tab", false)],
    &[],
    &[("KeyB", false)],
    &[],
    &[],
    &[("KeyD", false)],
    &[("KeyJ", false), ("KeyL", false), ("KeyO", false), ("KeyK", false)],
    &[],
    &[("Equal", false), ("Minus", false)],
    &[("KeyQ", false), ("KeyE", false)],
    &[],
    &[("KeyP", false), ("KeyP", true)],
    &[("Backspace", false), ("Backspace", true)],
];

/// Which keys of a line of [`KEYS`] would do nothing now, and why, in words; `None` if all do something.
pub fn idle_words(line: usize, idle: &[IdleKey]) -> Option<String> {
    let of = |(code, shift): &(&str, bool)| idle.iter().find(|key| key.code == *code && key.shift == *shift);
    let found: Vec<&IdleKey> = CODES.get(line)?.iter().filter_map(of).collect();
    let named = |key: &&IdleKey| {
        let name = match key.code {
            "Equal" => "+",
            "Minus" => "-",
            code => code.strip_prefix("Key").unwrap_or(code),
        };
        format!("{}{name}", if key.shift { "Shift " } else { "" })
    };
    let groups = found.chunk_by(|a, b| a.why == b.why);
    let words = groups.map(|keys| {
        let names: Vec<String> = keys.iter().map(named).collect();
        format!("{}: {}", names.join(", "), keys[0].why)
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| words.join("; "))
}

/// Modifier keys.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Modifiers {
    /// Shift: four times as fast, or the alternative meaning of a key.
    pub shift: bool,
    /// Ctrl: a fifth of the speed.
    pub control: bool,
}

/// State of the keyboard and the gamepad.
#[derive(Debug)]
pub struct Keys {
    instruments: Vec<String>,
    /// Which of them are steered.
    steered: Vec<bool>,
    /// The selected instrument; `None` for all.
    chosen: Option<usize>,
    /// Keys that are held, of those that act while held.
    down: BTreeSet<&'static str>,
    /// Of the keyboard, and of the gamepad.
    modifiers: [Modifiers; 2],
    /// Fractions of the usual speeds requested by the gamepad's sticks.
    leans: [f64; 3],
    /// Whether the beam is locked on.
    locked: bool,
    open: f64,
}

/// Keys that move instruments while held.
const ARROWS: [&str; 4] = ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"];
/// Keys that bend a steered tip while held, towards −1 and 1.
const BENDS: [&str; 2] = ["KeyA", "KeyS"];
/// Keys that act as pedals while held.
const PEDALS: [&str; 4] = ["Space", "KeyC", "KeyV", "KeyB"];

impl Keys {
    /// The initial state, without held keys, for a session with the instruments of this stack.
    pub fn of(stack: &Stack) -> Self {
        let each = stack.instruments().iter();
        let (names, steered) = each.map(|one| (one.name.clone(), one.device.is_steerable())).unzip();
        Self { steered, ..Self::new(names) }
    }

    /// The same for instruments of these names, innermost first, of which none is steered.
    pub fn new(instruments: Vec<String>) -> Self {
        Self {
            steered: vec![false; instruments.len()],
            instruments,
            chosen: Some(0),
            down: BTreeSet::new(),
            modifiers: [Modifiers::default(); 2],
            leans: [0.0; 3],
            locked: false,
            open: 1.0,
        }
    }

    /// Handles a change of modifier keys, which changes the speeds.
    pub fn modify(&mut self, modifiers: Modifiers) -> Vec<Input> {
        self.modifiers[0] = modifiers;
        self.going()
    }

    /// Handles a change of the gamepad's state.
    pub fn pad(&mut self, before: &Pad, now: &Pad) -> Vec<Input> {
        let (asked, bent) = ((self.modifiers[1], self.leans), self.bending());
        (self.modifiers[1], self.leans) = (now.modifiers(), now.leans());
        let keys = now.keys_since(before);
        let mut inputs: Vec<Input> =
            keys.into_iter().flat_map(|(key, down)| self.key(key, down, false)).collect();
        if asked != (self.modifiers[1], self.leans) {
            inputs.extend(self.going());
            if bent && !self.bending() {
                inputs.extend(self.steering());
            }
        }
        inputs
    }

    fn shift(&self) -> bool {
        self.modifiers.iter().any(|held| held.shift)
    }

    /// Releases all held keys, because the window has lost the keyboard focus. Other sources of input are not
    /// affected.
    pub fn let_go(&mut self) -> Vec<Input> {
        let held = |keys: &[&str]| keys.iter().any(|key| self.down.contains(key));
        let (moves, bends, shines) = (held(&ARROWS), held(&BENDS), self.locked || held(&PEDALS));
        self.down.clear();
        self.locked = false;
        let mut inputs = if moves { self.moving() } else { vec![] };
        if bends {
            inputs.extend(self.steering());
        }
        if shines {
            inputs.push(Input::Pedal { down: false, mode: None });
        }
        inputs
    }

    /// Handles a key that goes down, repeats while held (`again`), or goes up; other keys have no effect.
    pub fn key(&mut self, code: &str, down: bool, again: bool) -> Vec<Input> {
        if let Some(held) = ARROWS.into_iter().chain(BENDS).chain(PEDALS).find(|held| *held == code) {
            if down {
                self.down.insert(held)
            } else {
                self.down.remove(held)
            };
        }
        self.inputs(code, down, again)
    }

    fn inputs(&mut self, code: &str, down: bool, again: bool) -> Vec<Input> {
        let press = down && !again;
        match code {
            "ArrowUp" | "ArrowDown" | "ArrowLeft" | "ArrowRight" if !again => self.moving(),
            "KeyA" | "KeyS" if !again => self.steering(),
            "KeyW" if press => {
                BENDS.iter().for_each(|key| {
                    self.down.remove(key);
                });
                self.steer(Some(0.0), self.scale() * USUAL_STEER_PER_S, true)
            }
            "Space" | "KeyC" | "KeyV" | "KeyB" if !again => {
                self.locked = false;
                let mode = match code {
                    "Space" => Mode::Fluoro,
                    "KeyC" => Mode::Cine,
                    "KeyV" => Mode::Dsa,
                    _ => Mode::Roadmap,
                };
                vec![Input::Pedal { down, mode: Some(mode) }]
            }
            "Enter" if press => {
                self.locked = !self.locked;
                vec![Input::Pedal { down: self.locked, mode: Some(Mode::Fluoro) }]
            }
            "Tab" if press => {
                self.choose(Some(self.chosen.map_or(0, |index| (index + 1) % self.instruments.len())))
            }
            "KeyP" if press && self.shift() => vec![Input::Stop {}],
            "KeyP" if press => vec![Input::Script {}],
            "Backspace" if press && self.shift() => vec![Input::Redo {}],
            "Backspace" if press => vec![Input::Undo {}],
            "KeyI" if press => {
                let ml = if self.shift() { 20.0 } else { 5.0 };
                vec![Input::Inject { ml, ml_per_s: ml }]
            }
            "KeyD" if press => vec![Input::Detach { instrument: None }],
            "KeyJ" if down => vec![Input::TurnCArm { lao_deg: -5.0, cra_deg: 0.0 }],
            "KeyL" if down => vec![Input::TurnCArm { lao_deg: 5.0, cra_deg: 0.0 }],
            "KeyO" if down => vec![Input::TurnCArm { lao_deg: 0.0, cra_deg: 5.0 }],
            "KeyK" if down => vec![Input::TurnCArm { lao_deg: 0.0, cra_deg: -5.0 }],
            "Equal" | "NumpadAdd" if down => vec![Input::Zoom { factor: 1.25 }],
            "Minus" | "NumpadSubtract" if down => vec![Input::Zoom { factor: 0.8 }],
            "KeyQ" if down => self.blades(-0.1),
            "KeyE" if down => self.blades(0.1),
            _ if press => digit(code).map_or_else(Vec::new, |number| self.choose_number(number)),
            _ => vec![],
        }
    }

    fn blades(&mut self, by: f64) -> Vec<Input> {
        self.open = (self.open + by).clamp(BLADES_IN, 1.0);
        vec![Input::Collimate { width: self.open, height: self.open }]
    }

    fn choose_number(&mut self, number: usize) -> Vec<Input> {
        match number {
            0 => self.choose(None),
            _ if number <= self.instruments.len() => self.choose(Some(number - 1)),
            _ => vec![],
        }
    }

    /// Selects an instrument and stops the previous one.
    fn choose(&mut self, index: Option<usize>) -> Vec<Input> {
        self.chosen = index;
        let select = index.map(|index| Input::Select { instrument: self.instruments[index].clone() });
        std::iter::once(Input::Stop {}).chain(select).chain(self.going()).collect()
    }

    /// Factor of the usual speeds.
    fn scale(&self) -> f64 {
        let control = self.modifiers.iter().any(|held| held.control);
        match (self.shift(), control) {
            (true, false) => 4.0,
            (false, true) => 0.2,
            _ => 1.0,
        }
    }

    /// Share of a speed that two keys and a stick ask for.
    fn axis(&self, plus: &str, minus: &str, lean: f64) -> f64 {
        let keys = f64::from(self.down.contains(plus)) - f64::from(self.down.contains(minus));
        (keys + lean).clamp(-1.0, 1.0)
    }

    /// The instruments in the hand.
    fn hands(&self) -> impl Iterator<Item = (usize, &String)> {
        self.instruments.iter().enumerate().filter(|(index, _)| self.chosen.is_none_or(|c| c == *index))
    }

    /// The motion commanded by arrow keys and sticks.
    fn moving(&self) -> Vec<Input> {
        let scale = self.scale();
        let mm_per_s = scale * USUAL_MM_PER_S * self.axis("ArrowUp", "ArrowDown", self.leans[0]);
        let deg_per_s = scale * USUAL_DEG_PER_S * self.axis("ArrowRight", "ArrowLeft", self.leans[1]);
        let each = self.hands();
        each.map(|(_, name)| Input::Move { instrument: Some(name.clone()), mm_per_s, deg_per_s }).collect()
    }

    /// The motion commanded, with the steering if it is asked for.
    fn going(&self) -> Vec<Input> {
        let steering = if self.bending() { self.steering() } else { vec![] };
        self.moving().into_iter().chain(steering).collect()
    }

    /// Whether a key is held that bends a tip.
    fn bend_is_down(&self) -> bool {
        BENDS.iter().any(|key| self.down.contains(key))
    }

    /// Whether a tip is asked to bend.
    fn bending(&self) -> bool {
        self.bend_is_down() || self.leans[2] != 0.0
    }

    /// The steering commanded by keys and stick: to the largest bend as long as they ask for it.
    fn steering(&self) -> Vec<Input> {
        let share = self.axis(BENDS[1], BENDS[0], self.leans[2]);
        let to = (share != 0.0).then_some(share.signum());
        self.steer(to, self.scale() * USUAL_STEER_PER_S * share.abs(), self.bend_is_down())
    }

    /// Steers what is in the hand. Others than steered instruments are asked only if one is selected and a key asks, so
    /// that its user learns why nothing bends.
    fn steer(&self, to: Option<f64>, per_s: f64, by_key: bool) -> Vec<Input> {
        let each = self.hands().filter(|(index, _)| self.steered[*index] || by_key && self.chosen.is_some());
        let per_s = to.map(|_| per_s);
        each.map(|(_, name)| Input::Steer { instrument: Some(name.clone()), to, per_s }).collect()
    }
}

fn digit(code: &str) -> Option<usize> {
    code.strip_prefix("Digit")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(name: &str, mm_per_s: f64, deg_per_s: f64) -> Input {
        Input::Move { instrument: Some(name.to_owned()), mm_per_s, deg_per_s }
    }

    #[test]
    fn idle_keys_are_told_on_their_line() {
        for ((keys, _), codes) in KEYS.iter().zip(CODES) {
            for (code, _) in codes {
                let name = match *code {
                    "Equal" => "+",
                    "Minus" => "-",
                    code => code.strip_prefix("Key").unwrap_or(code),
                };
                assert!(keys.contains(name), "{code}: {keys}");
            }
        }
        let idle = |code, shift, why: &str| IdleKey { code, shift, why: why.to_owned() };
        let line = |keys: &str| KEYS.iter().position(|line| line.0.contains(keys)).unwrap();
        let both =
            [idle("Backspace", false, "nothing was done yet"), idle("Backspace", true, "nothing was undone")];
        let words = idle_words(line("Backspace"), &both).unwrap();
        assert_eq!(words, "Backspace: nothing was done yet; Shift Backspace: nothing was undone");
        let blind = ["KeyA", "KeyS", "KeyW"].map(|code| idle(code, false, "no tip here is steered"));
        assert_eq!(idle_words(line("A, S"), &blind).unwrap(), "A, S, W: no tip here is steered");
        // The twin: another line, and none that is idle.
        assert_eq!(idle_words(line("Tab"), &both), None);
        assert_eq!(idle_words(line("Backspace"), &[]), None);
    }

    #[test]
    fn arrows_move_what_is_chosen_as_long_as_they_are_down() {
        let mut keys = Keys::new(vec!["wire".to_owned(), "catheter".to_owned()]);
        assert_eq!(keys.key("ArrowUp", true, false), [moved("wire", 10.0, 0.0)]);
        assert!(keys.key("ArrowUp", true, true).is_empty());
        assert_eq!(keys.modify(Modifiers { shift: false, control: true }), [moved("wire", 2.0, 0.0)]);
        assert_eq!(keys.key("ArrowLeft", true, false), [moved("wire", 2.0, -18.0)]);
        // Selecting another instrument stops the previous one.
        let changed = keys.key("Tab", true, false);
        let select = Input::Select { instrument: "catheter".to_owned() };
        assert_eq!(changed, [Input::Stop {}, select, moved("catheter", 2.0, -18.0)]);
        keys.modify(Modifiers::default());
        keys.key("ArrowLeft", false, false);
        let all = keys.key("Digit0", true, false);
        assert_eq!(all, [Input::Stop {}, moved("wire", 10.0, 0.0), moved("catheter", 10.0, 0.0)]);
        assert_eq!(keys.let_go(), [moved("wire", 0.0, 0.0), moved("catheter", 0.0, 0.0)]);
        // Motion from another source is not stopped when no key is held.
        assert!(keys.let_go().is_empty());
        assert_eq!(
            keys.modify(Modifiers { shift: true, control: false }),
            [moved("wire", 0.0, 0.0), moved("catheter", 0.0, 0.0)]
        );
    }

    #[test]
    fn tips_bend_where_they_are_steered_and_a_selected_wire_says_that_it_is_not() {
        let mut keys = Keys::new(vec!["wire".to_owned(), "catheter".to_owned()]);
        keys.steered[1] = true;
        let bent = |name: &str, to: Option<f64>, per_s: Option<f64>| Input::Steer {
            instrument: Some(name.to_owned()),
            to,
            per_s,
        };
        // The wire is asked as long as a key is down, to be refused.
        assert_eq!(keys.key("KeyS", true, false), [bent("wire", Some(1.0), Some(0.5))]);
        assert!(keys.key("KeyS", true, true).is_empty() && keys.key("KeyS", false, false).is_empty());
        keys.key("Tab", true, false);
        assert_eq!(keys.key("KeyA", true, false), [bent("catheter", Some(-1.0), Some(0.5))]);
        let fine = Modifiers { shift: false, control: true };
        assert_eq!(keys.modify(fine), [moved("catheter", 0.0, 0.0), bent("catheter", Some(-1.0), Some(0.1))]);
        // Both keys together hold it.
        assert_eq!(keys.key("KeyS", true, false), [bent("catheter", None, None)]);
        keys.key("KeyS", false, false);
        assert_eq!(keys.let_go(), [bent("catheter", None, None)]);
        assert!(keys.let_go().is_empty());
        keys.modify(Modifiers::default());
        // Straight at the usual rate; keys that were down no longer count.
        keys.key("KeyA", true, false);
        assert_eq!(keys.key("KeyW", true, false), [bent("catheter", Some(0.0), Some(0.5))]);
        assert_eq!(keys.key("KeyW", false, false), []);
        // All together: those that are steered.
        keys.key("Digit0", true, false);
        assert_eq!(keys.key("KeyS", true, false), [bent("catheter", Some(1.0), Some(0.5))]);
    }

    #[test]
    fn pedals_are_held_or_locked() {
        let mut keys = Keys::new(vec!["device".to_owned()]);
        let pedal = |down, mode| [Input::Pedal { down, mode: Some(mode) }];
        assert_eq!(keys.key("KeyC", true, false), pedal(true, Mode::Cine));
        assert_eq!(keys.key("KeyC", false, false), pedal(false, Mode::Cine));
        assert_eq!(keys.key("Enter", true, false), pedal(true, Mode::Fluoro));
        assert_eq!(keys.key("Enter", true, false), pedal(false, Mode::Fluoro));
        assert_eq!(keys.key("Digit7", true, false), []);
        let up = [Input::Pedal { down: false, mode: None }];
        for key in ["Enter", "KeyV"] {
            keys.key(key, true, false);
            assert_eq!(keys.let_go(), up);
            assert!(keys.let_go().is_empty());
        }
        assert!(keys.key("F1", true, false).is_empty() && keys.key("Digit", true, false).is_empty());
    }
}
