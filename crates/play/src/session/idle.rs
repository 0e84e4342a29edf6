//! Keys that would do nothing now, for windows and pages, which show them as unavailable.

use serde::Serialize;

use super::Session;
use crate::hand::Hand;
use crate::input::Input;

/// A key that would do nothing now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct IdleKey {
    /// Its `code`, as [`crate::Keys::key`] takes it.
    pub code: &'static str,
    /// Whether it is the key with Shift.
    pub shift: bool,
    /// Why.
    pub why: String,
}

impl Session {
    /// The keys that would do nothing, or be refused, in the current state.
    pub(super) fn idle_keys(&self) -> Vec<IdleKey> {
        let mut idle = vec![];
        let mut tell = |code, shift, why: Option<&str>| {
            idle.extend(why.map(|why| IdleKey { code, shift, why: why.to_owned() }));
        };
        let instruments = self.simulation.stack().instruments();
        tell("Tab", false, (instruments.len() == 1).then_some("there is one instrument alone"));
        let steered = instruments.iter().any(|one| one.device.is_steerable());
        for code in ["KeyA", "KeyS", "KeyW"] {
            tell(code, false, (!steered).then_some("no tip here is steered"));
        }
        let no_angiogram = self.lab.fluoro().injection.is_empty();
        tell("KeyB", false, no_angiogram.then_some("a roadmap shows an angiogram: inject first"));
        // What is still on its way may be out of its catheter then.
        let rests = !self.simulation.report().is_under_way();
        let kept = rests.then(|| self.simulation.check_detach(self.selected).err()).flatten();
        tell("KeyD", false, kept.map(|error| error.to_string()).as_deref());
        let examined = self.check_in_exam(&Input::Undo {}).is_err().then_some("this is an exam");
        tell("KeyP", false, examined.or_else(|| self.no_script()));
        let moves = self.demonstrates() || self.hands.iter().any(|hand| *hand != Hand::default());
        tell("KeyP", true, (!moves).then_some("nothing moves"));
        let [done, undone] = [self.history.steps() > 0, self.history.has_undone()];
        tell("Backspace", false, examined.or((!done).then_some("nothing was done yet")));
        tell("Backspace", true, examined.or((!undone).then_some("nothing was undone")));
        for (code, why) in self.lab.ends() {
            tell(code, false, Some(why));
        }
        idle
    }

    /// Why there is no script to show, if so.
    fn no_script(&self) -> Option<&'static str> {
        match (&self.demonstration, self.script.as_ref().is_none_or(|script| script.is_empty())) {
            (Some(shown), _) => (!shown.paused).then_some("the script is being shown"),
            (None, true) => Some("the scene has no script"),
            (None, false) => (self.history.steps() > 0)
                .then_some("the script begins where the scene does: go back there first"),
        }
    }
}
