//! Derivatives of commands one after the other.

use std::sync::Arc;

use super::super::command::Driven;
use super::super::configuration::Start;
use super::super::hands::lengths;
use super::super::workspace::Workspace;
use super::super::{Environment, Kirchhoff, write_line};
use super::Nearby;
use super::read::margin;
use crate::methods::{Gradient, Move, StepReport, Surroundings, Timed, Together};
use crate::shape::Shape;
use crate::{Error, Result};

impl<const C: usize> Kirchhoff<C> {
    /// Checks that commands from here have derivatives.
    ///
    /// # Errors
    /// A vessel that yields, loops that touch, detached coils, and earlier commands that are not done.
    pub(super) fn check_differentiable(&self, surroundings: &Surroundings<'_>) -> Result<()> {
        if surroundings.course.is_some() {
            let remedy = "derivatives of a vessel that yields are not there: leave it out";
            return Err(Error::parameter("vessel.yielding", "given", remedy));
        }
        if self.options.self_contact || !self.state.coils.is_empty() {
            let remedy = "gradients know no contact between loops, and no coils: set it to false";
            return Err(Error::parameter("method.self_contact", self.options.self_contact, remedy));
        }
        if self.state.unfinished.is_some() {
            let remedy = "earlier commands are not done: finish them, or drop them with forget";
            return Err(Error::parameter("gradient", "behind", remedy));
        }
        Ok(())
    }

    /// Derivatives of what commands lead to.
    ///
    /// # Errors
    /// As [`Method::gradients`](crate::methods::Method::gradients).
    pub(in super::super) fn gradients_of(
        &self,
        surroundings: &Surroundings<'_>,
        ((commands, times_s), by): (Timed<'_>, &[Together]),
        checked: &dyn Fn(&StepReport, &[Move]) -> Result<()>,
    ) -> Result<Vec<Gradient>> {
        self.check_differentiable(surroundings)?;
        let mut surroundings = *surroundings;
        let environment = Environment::new(&surroundings, &self.surface, &self.options);
        let (mut state, mut report) = (Arc::clone(&self.state), StepReport::clone(&self.report));
        let mut workspace = Workspace::<C>::new(&environment, &state);
        let mut nearby: Option<Nearby> = None;
        let mut gradients = Vec::with_capacity(commands.len());
        for (moves, time_s) in commands.iter().zip(times_s) {
            checked(&report, moves)?;
            surroundings.time_s = [surroundings.time_s[1], *time_s];
            let still = !surroundings.moves() && !surroundings.fields_change();
            let environment = Environment::new(&surroundings, &self.surface, &self.options);
            workspace.way.begin(surroundings.stack, (&state.hands, &[]), moves);
            let target = workspace.way.target.clone();
            if workspace.way.is_done()
                && still
                && let Some(last) = gradients.last()
            {
                let mut same = Gradient::clone(last);
                same.report.rest();
                gradients.push(same);
                continue;
            }
            if (workspace.way.is_done() && still) || lengths(&target).all(|inserted_mm| inserted_mm == 0.0) {
                let remedy = "nothing moves, or nothing is in: give a command that moves what is in";
                return Err(Error::parameter("gradient.moves", moves.len(), remedy));
            }
            let begun = match nearby.take() {
                Some(nearby) => nearby.go_on(),
                None => {
                    let from = Start { mesh: &workspace.mesh, state: &state };
                    Nearby::new(&environment, from, target, by)?
                }
            };
            let beside = nearby.insert(begun);
            let driven =
                workspace.carry_out_beside(&environment, &state, (moves, usize::MAX), Some(&mut *beside))?;
            let Driven::Moved(took) = driven else {
                return Err(Error::Computation("gradient: the command has no end".to_owned()));
            };
            let end = workspace.now.start();
            took.write(&environment, end, &mut report);
            if report.is_under_way() || !report.converged {
                return Err(Error::Computation(
                    "gradient: the command does not end in equilibrium".to_owned(),
                ));
            }
            let mut shape = Shape::default();
            write_line(end.state, &end.mesh.from_tip_mm, &mut shape);
            let (slopes, margin) = (beside.slopes(end.state), margin(end));
            gradients.push(Gradient { report: report.clone(), shape, slopes, margin });
            state = Arc::clone(&workspace.now.state);
            std::mem::swap(&mut workspace.mesh, &mut workspace.now.mesh);
            surroundings.fields[0] = surroundings.fields[1];
        }
        Ok(gradients)
    }
}
