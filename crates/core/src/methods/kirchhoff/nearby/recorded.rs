//! Parts of commands as they were carried out, to be linearised later.

use std::sync::Arc;

use super::super::carried::Passage;
use super::super::configuration::{Configuration, Start};
use super::super::hands::Hand;
use super::super::part::Found;
use super::super::state::{KirchhoffState, UnderWay};
use super::super::substep::{Attempt, Part};
use super::{Acting, Scene, check_smooth, progress, resumed};
use crate::Result;
use crate::methods::kirchhoff::Environment;
use crate::vessel::Displacement;

/// A part of a command.
pub(super) struct Piece {
    pub(super) was: Configuration,
    pub(super) hands: Vec<Hand>,
    /// How far the hands have come in the command at its start and end, 0 to 1.
    pub(super) shares: [f64; 2],
    pub(super) is_last: bool,
    /// Its end.
    end: UnderWay,
    to: f64,
    holds_still: bool,
    passage: Option<(Displacement, Displacement)>,
    displacement: Option<Displacement>,
}

impl Piece {
    /// The state at its end.
    pub(super) fn end(&self) -> &KirchhoffState {
        &self.end.state
    }

    /// The environment at its end, in that of its command.
    pub(super) fn environment<'a>(&'a self, command: &Environment<'a>) -> Environment<'a> {
        command.displaced(self.displacement.as_ref()).with_fields_at(self.to)
    }

    /// Calls `what` with a scene in this part, from there to these hands.
    pub(super) fn with<T>(
        &self,
        environment: &Environment<'_>,
        scene: &Scene,
        (start, hands): (Start<'_>, &[Hand]),
        what: impl FnOnce(&Acting<'_>, Environment<'_>) -> T,
    ) -> T {
        let UnderWay { part_mm, effort, .. } = self.end;
        let part =
            Part { effort, part_mm, to: self.to, holds_still: self.holds_still, resumed: Some(&self.end) };
        let passage: Option<Passage<'_>> = self.passage.as_ref().map(|(before, after)| (before, after));
        scene.with(environment, (start, (hands, passage)), part, what)
    }
}

/// Records the parts of a command.
pub(in super::super) struct Recorder {
    /// Hands at its start and at its end.
    way: [Vec<Hand>; 2],
    come: f64,
    pub(super) pieces: Vec<Piece>,
}

impl Recorder {
    /// Of a command between these hands.
    pub(super) fn new(way: [Vec<Hand>; 2]) -> Self {
        Self { way, come: 0.0, pieces: Vec::new() }
    }

    /// Records an accepted part from `was`, to `end`, with the passage of a moving vessel; `target` is where the hands of the command go.
    ///
    /// # Errors
    /// [`Error::Computation`](crate::Error) where there is no derivative.
    pub(in super::super) fn follow(
        &mut self,
        environment: &Environment<'_>,
        (was, passage): (Start<'_>, Option<Passage<'_>>),
        (attempt, found): (Attempt<'_>, &Found),
        (end, target): (&KirchhoffState, &[Hand]),
    ) -> Result<()> {
        check_smooth(&attempt, found)?;
        let Attempt { part, hands, .. } = attempt;
        let come = progress(&self.way, hands, part.to);
        self.pieces.push(Piece {
            was: Configuration { mesh: was.mesh.clone(), state: Arc::new(was.state.clone()) },
            hands: hands.to_vec(),
            shares: [std::mem::replace(&mut self.come, come), come],
            is_last: hands == target && part.to == 1.0,
            end: resumed(&part, end),
            to: part.to,
            holds_still: part.holds_still,
            passage: passage.map(|(before, after)| (before.clone(), after.clone())),
            displacement: environment.displacement.cloned(),
        });
        Ok(())
    }
}
