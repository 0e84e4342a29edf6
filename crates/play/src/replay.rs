//! The inputs of a session, from which it can be repeated to the bit: a record that was changed afterwards is found.

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::TICKS_PER_S;
use crate::input::Input;
use crate::session::Session;

/// Longest session that is repeated: a day.
const MOST_TICKS: u64 = 24 * 3600 * TICKS_PER_S as u64;

/// All that hands did in a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inputs {
    /// Number of its ticks.
    ticks: u64,
    /// Limit of linear solves in a tick ([`Session::with_ticks`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    solves: Option<usize>,
    /// Each input with the number of ticks before it.
    inputs: Vec<(u64, Input)>,
}

impl Inputs {
    pub(crate) fn of(ticks: u64, solves: Option<usize>, inputs: &[(u64, Input)]) -> Self {
        Self { ticks, solves, inputs: inputs.to_vec() }
    }

    /// Repeats them in a session at its start, which must be of the same scene.
    ///
    /// # Errors
    /// [`Error::Parameter`] for inputs that no session has: out of order, beyond its end, or more than a day of them;
    /// and for a script, which is not the work of hands.
    pub fn repeat_in(&self, session: Session) -> Result<Session> {
        self.check()?;
        let mut session = match self.solves {
            Some(solves) => session.with_ticks(solves)?,
            None => session,
        };
        let mut next = self.inputs.iter().peekable();
        for tick in 0..=self.ticks {
            while let Some((_, input)) = next.next_if(|(at, _)| *at == tick) {
                // What was refused then is refused now.
                let _ = session.apply(input);
            }
            if tick < self.ticks {
                session.tick();
            }
        }
        Ok(session)
    }

    fn check(&self) -> Result<()> {
        if self.ticks > MOST_TICKS {
            let remedy = format!("a session of more than a day, {MOST_TICKS} ticks, is not repeated");
            return Err(Error::parameter("inputs.ticks", self.ticks, remedy));
        }
        let mut before = 0;
        for (index, (tick, input)) in self.inputs.iter().enumerate() {
            let key = || format!("inputs.inputs[{index}]");
            if *tick < before || *tick > self.ticks {
                let remedy = format!("must be from {before} to {}, in order of time", self.ticks);
                return Err(Error::parameter(key(), tick, remedy));
            }
            if matches!(input, Input::Script {}) {
                let remedy = "a script was shown: what it did is not the work of hands, and is not verified";
                return Err(Error::parameter(key(), "script", remedy));
            }
            before = *tick;
        }
        Ok(())
    }
}
