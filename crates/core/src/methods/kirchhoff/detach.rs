//! Detachment of a coil.
//!
//! The front part of the line becomes a rod of its own, without a hand ([`super::joined`]). The pusher is withdrawn,
//! and the rest of the line comes to rest as after any command.

use std::sync::Arc;

use super::command::Driven;
use super::configuration::Configuration;
use super::hands::{Hand, HandForce, lengths};
use super::joined::FreeCoil;
use super::mesh::Mesh;
use super::report::Took;
use super::state::KirchhoffState;
use super::tail::Twist;
use super::transport::transport_together;
use super::workspace::Workspace;
use super::{Environment, meshed};
use crate::device::{LENGTH_SLACK_MM, line_mm};
use crate::methods::{Command, MethodChoice};
use crate::{Error, Result};

/// Refuses a coil that cannot be detached; returns the length of one that can, mm.
pub(super) fn check(environment: &Environment<'_>, from: &KirchhoffState, instrument: usize) -> Result<f64> {
    let stack = environment.surroundings.stack;
    let refused = |remedy: String| {
        let name = stack.instruments().get(instrument).map_or_else(String::new, |one| one.name.clone());
        Err(Error::parameter("detach", format!("{name:?}"), remedy))
    };
    let coil_mm = stack.instruments().get(instrument).map_or(0.0, |one| one.device.coil_mm());
    if coil_mm == 0.0 {
        return refused(
            "is no coil: a device file of kind coil whose first part has a winding is one".into(),
        );
    }
    if from.coils.iter().any(|coil| coil.instrument == instrument) {
        return refused("is detached already: push the next coil".into());
    }
    environment.options.check_detach()?;
    let inserted_mm: Vec<f64> = lengths(&from.hands).collect();
    let left_mm = stack.out_mm(instrument, &inserted_mm) - inserted_mm[instrument];
    if left_mm > LENGTH_SLACK_MM {
        return refused(format!("is not out yet: advance it by {left_mm:.3} mm"));
    }
    Ok(coil_mm)
}

impl<const C: usize> Workspace<C> {
    /// Detaches the coil of an instrument from the state `from`; the new state is in `now`.
    ///
    /// # Errors
    /// As [`Method::detach`](crate::methods::Method::detach).
    pub(super) fn detach(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        instrument: usize,
    ) -> Result<Took> {
        let coil_mm = check(environment, from, instrument)?;
        let stack = environment.surroundings.stack;
        let mut hands = from.hands.clone();
        hands[instrument] = Hand::default();
        // The remaining line, before it comes to rest.
        let mut left = Configuration { mesh: Mesh::default(), state: Arc::new(from.clone()) };
        meshed(environment, &hands, &mut left.mesh);
        let (mesh, state) = left.parts();
        let points = mesh.points.len();
        state.known.keep_last(points, line_mm(lengths(&hands)) - self.mesh.from_tip_mm[0]);
        state.forces.drain(..state.forces.len().saturating_sub(points));
        state.inner_friction.clear();
        state.pairs.clear();
        state.correction.clear();
        state.unfinished = None;
        // Nothing is left of the motion of a coil that has no hand any more.
        state.behind.iter_mut().skip(instrument).take(1).for_each(|own| *own = Command::default());
        state.twists[instrument] = Twist::default();
        state.hand_forces[instrument] = HandForce { jumps: stack.is_several(), ..HandForce::default() };
        if mesh.elements.is_empty() {
            state.withdraw(stack, &hands);
        } else {
            let tail = |instrument: usize, _: f64| state.twists[instrument].mouth_rad;
            let mouth = (&from.rod.frames[0], &from.rod.positions[0]);
            transport_together((&self.mesh, &from.rod), (mesh, mouth), (stack.sets(), tail), &mut state.rod);
            state.move_hands(&hands);
            // The axial force of the coil is gone: in a straight catheter its energy is too small for descent to find
            // that.
            state.rod.tensions.fill(0.0);
        }
        let coil = FreeCoil::from_line(&self.mesh, from, (instrument, self.mesh.nearest_node(coil_mm)));
        Arc::make_mut(&mut state.coils).push(coil);
        let Configuration { mesh, state } = left;
        let was = std::mem::replace(&mut self.mesh, mesh);
        let done = self.carry_out(environment, &state, &[], usize::MAX);
        self.mesh = was;
        let Driven::Moved(took) = done? else {
            return Err(Error::Computation("kirchhoff: what was released does not come to rest".into()));
        };
        // The released energy stays in the coil.
        Ok(took.without_jump())
    }
}
