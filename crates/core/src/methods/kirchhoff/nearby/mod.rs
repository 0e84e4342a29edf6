//! Derivatives of a command: the states beside it, to which slightly other parameters lead.
//!
//! The end x of each part of a command is an equilibrium of the forces R that depend on the start x₀ of the part, the hands and
//! the scene, all of them on a parameter p. Where contacts keep their status R is smooth, and
//!
//! ```text
//! R(x, x₀, p) = 0:    ∂R/∂x · dx/dp = −(∂R/∂p + ∂R/∂x₀ · dx₀/dp)
//! ```
//!
//! (P. Michaleris, D. A. Tortorelli, C. A. Vidal, *Tangent operators and design sensitivity formulations for transient non-linear
//! coupled problems*, Int. J. Numer. Meth. Eng. 37 (1994)). So derivatives go from part to part as the device does, and friction,
//! which slips from where the part began, remembers. Commands are recorded part by part (`recorded`, `reverse`), and each part is
//! linearised once (`linear`), for derivatives in both directions.
//!
//! ∂R/∂x = K + U is more than Newton's matrix K: within a Newton step the normal forces of friction, the drag of blood and the forces
//! between instruments are lagged. Here R contains them as they are at x ([`Search::assemble`](super::search::Search::assemble)). So
//!
//! ```text
//! (1 + K⁻¹U) dx/dp = K⁻¹b
//! ```
//!
//! is solved by [`gmres`](crate::solve::gmres). It is the error of the motion that is made small, not that of the forces: the rod is a thousand
//! times stiffer along itself and against the wall than across. Without lagged forces Newton's factors suffice.
//!
//! How far a device has spun in a part is measured by the smallest rotation of each of its triads from where the part began, also beside
//! x: of triads that come from x by the smallest rotation it differs by half the product of both rotations, which is of first order in
//! dx/dp.
//!
//! Friction is smooth only on the scale of ε, within which it sticks ([`crate::contact::friction`]): where a point slips by u, a
//! difference over ±h across the slip has an error of h²/2|u|² of the stiffness μN/|u|. All differences are therefore kept within a small
//! part of ε ([`STICKING`]).
//!
//! Where the sheath is elsewhere on a side, R is taken at x moved along: all nodes by the motion of the mouth, the first tangent into
//! the new direction. The motion that balances the difference comes on top.
//!
//! Several parameters that change together, each so much, are one p: dx/dp is then the product of the Jacobian with these changes.
//!
//! A part that ended in a jump, or in which friction was anchored anew, has no derivative.

mod chain;
mod columns;
mod forces;
mod forward;
mod hands;
mod lagging;
mod linear;
mod numbers;
mod readings;
mod recorded;
mod remembered;
mod reverse;
#[cfg(test)]
mod solved;
mod sparse;
mod turned;

use super::Environment;
use super::carried::{Passage, taken_along};
use super::configuration::Start;
use super::hands::{Hand, steered};
use super::part::{Effort, Found, Limits};
use super::state::{KirchhoffState, UnderWay};
use super::substep::{Attempt, Part};
use crate::device::Stack;
use crate::methods::{Parameter, Parts, Surroundings, Together};
use crate::solve::Neighbourhood;
use crate::{Error, Result, Vec3};
pub(super) use recorded::Recorder;

/// Change of a parameter to either side, as a fraction of its scale: differences then have as many digits from rounding as from
/// curvature.
const STEP: f64 = 1e-5;
/// Largest motion h of a node in all differences, as a fraction of the slip ε within which friction sticks. Differences are off by
/// h²/2ε² where a point just slips, a few parts in a million, and much less where it slips farther; with less h rounding adds as much.
const STICKING: f64 = 3e-3;

/// Scale of a field that is nought, T or N/mm.
const WEAK_FIELD: f64 = 1e-3;

/// A scene with other parameters.
#[derive(Debug)]
struct Scene {
    parts: Parts,
    /// Instruments from whose rest shape nodes follow, if that changes: nodes must not move with it.
    nodes: Option<Stack>,
}

/// The end of a part, beside which others are sought.
struct End<'a> {
    state: &'a KirchhoffState,
    /// How the triads from which its spin is measured are turned against those of the slid device, rad, once they are known.
    spins: Vec<f64>,
}

/// What acts in a part on one side.
struct Acting<'a> {
    environment: Environment<'a>,
    /// Instruments, if nodes are those of others.
    materials: Option<&'a Stack>,
    start: Start<'a>,
    attempt: Attempt<'a>,
}

/// Checks that a part has a derivative.
///
/// # Errors
/// A jump.
fn check_smooth(attempt: &Attempt<'_>, found: &Found) -> Result<()> {
    let jumps = attempt.part.effort == Effort::Flight || found.off > 1.0 || found.balance.is_set_free();
    if jumps || found.slides > 0 || found.is_interrupted {
        return Err(Error::Computation(
            "gradient: the command passes a jump, where its result has no derivative: end it before, or begin behind".to_owned(),
        ));
    }
    Ok(())
}

/// A part that goes on from its own end.
fn resumed(part: &Part<'_>, end: &KirchhoffState) -> UnderWay {
    UnderWay {
        part_mm: part.part_mm,
        effort: part.effort,
        state: end.clone(),
        neighbourhood: Neighbourhood::default(),
        shift: 0.0,
        iterations: 0,
    }
}

impl Scene {
    /// The scene where parameters that change together have changed by so much.
    fn new(surroundings: &Surroundings<'_>, together: &Together, by: f64) -> Result<Self> {
        let (parts, nodes) = changed(surroundings, together, by)?;
        Ok(Self { parts, nodes })
    }

    /// Calls `what` with this scene in a part from there, and with the environment in which its forces are read.
    fn with<T>(
        &self,
        environment: &Environment<'_>,
        (was, (hands, passage)): (Start<'_>, (&[Hand], Option<Passage<'_>>)),
        part: Part<'_>,
        what: impl FnOnce(&Acting<'_>, Environment<'_>) -> T,
    ) -> T {
        let start = taken_along(was, passage);
        let Parts { stack, wall, sheath, fields } = &self.parts;
        let fields = &fields[..];
        let own = steered(stack, hands);
        let [before, _] = environment.surroundings.fields;
        // Fields that do not change in the command are other ones before it too.
        let before = if environment.surroundings.fields_change() { before } else { fields };
        let surroundings =
            Surroundings { properties: wall, sheath, fields: [before, fields], ..environment.surroundings };
        let aside = Environment { surroundings, ..*environment };
        let own_environment = aside.steered(&own);
        let others = self.nodes.as_ref().map(|nodes| steered(nodes, hands));
        let limits = Limits { iterations: 0, solves: 0 };
        let beside = Acting {
            environment: others.as_ref().map_or(own_environment, |others| aside.steered(others)),
            materials: others.as_ref().map(|_| &*own),
            start: start.as_ref().map_or(was, |state| Start { mesh: was.mesh, state }),
            attempt: Attempt { part, hands, limits, left: passage.map(|passage| (was, passage)) },
        };
        what(&beside, own_environment)
    }
}

/// How far hands have come in a command from and to these, 0 to 1; without motion `to`.
fn progress([from, target]: &[Vec<Hand>; 2], hands: &[Hand], to: f64) -> f64 {
    let all = from.iter().zip(target).zip(hands);
    let parts = all.flat_map(|((from, target), at)| {
        let values = |hand: &Hand| [hand.inserted_mm, hand.turn_rad, hand.steer];
        let (from, target, at) = (values(from), values(target), values(at));
        [0, 1, 2].map(|k| (target[k] - from[k], at[k] - from[k]))
    });
    let longest = parts.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    longest.filter(|(whole, _)| *whole != 0.0).map_or(to, |(whole, so_far)| so_far / whole)
}

/// The hands where parameters that move some are changed.
fn moved(together: &Together, hands: &[Hand], by: f64) -> Vec<Hand> {
    let mut hands = hands.to_vec();
    for (parameter, weight) in together {
        match *parameter {
            Parameter::Advance { instrument } => hands[instrument].inserted_mm += weight * by,
            Parameter::Rotation { instrument } => hands[instrument].turn_rad += weight * by,
            Parameter::Steering { instrument } => hands[instrument].steer += weight * by,
            _ => {}
        }
    }
    hands
}

/// What parameters change.
fn parts(surroundings: &Surroundings<'_>) -> Parts {
    let Surroundings { stack, properties, sheath, fields: [_, fields], .. } = *surroundings;
    Parts { stack: stack.clone(), wall: properties.clone(), sheath: *sheath, fields: fields.into() }
}

/// That where parameters are changed, and instruments with the rest shape as it is, if that is changed.
fn changed(surroundings: &Surroundings<'_>, together: &Together, by: f64) -> Result<(Parts, Option<Stack>)> {
    let mut there = parts(surroundings);
    let mut nodes = there.clone();
    let mut values = Vec::with_capacity(together.len());
    for (parameter, weight) in together {
        values.extend(parameter.value(&nodes)?.map(|value| (*parameter, value + weight * by)));
    }
    Parameter::set_all(&values, &mut there)?;
    let count = values.len();
    values.retain(|(parameter, _)| !matches!(parameter, Parameter::RestCurvature { .. }));
    Parameter::set_all(&values, &mut nodes)?;
    let reshaped = values.len() < count;
    Ok((there, reshaped.then_some(nodes.stack)))
}

/// The scale of a change of parameters: the one of which it changes most in units of its own.
///
/// # Errors
/// A parameter that does not exist, and no change.
fn scale(environment: &Environment<'_>, together: &Together) -> Result<f64> {
    let mut most: f64 = 0.0;
    for (parameter, weight) in together {
        most = most.max(weight.abs() / own_scale(environment, parameter)?);
    }
    if most > 0.0 && most.is_finite() {
        return Ok(1.0 / most);
    }
    let changes: Vec<f64> = together.iter().map(|(_, weight)| *weight).collect();
    Err(Error::parameter("gradient.along", format!("{changes:?}"), "must be finite, and not all zero"))
}

/// The scale of a parameter.
///
/// # Errors
/// One that does not exist.
fn own_scale(environment: &Environment<'_>, parameter: &Parameter) -> Result<f64> {
    let parts = parts(&environment.surroundings);
    let value = parameter.value(&parts)?;
    let Parts { stack, fields, .. } = &parts;
    Ok(match *parameter {
        Parameter::Advance { .. } | Parameter::EntryPosition { .. } => environment.options.element_mm,
        // The tip then moves as far, however long the device is.
        Parameter::EntryDirection { .. } => environment.options.element_mm / stack.length_mm(),
        Parameter::RestCurvature { instrument, section, .. } => {
            1.0 / stack.instruments()[instrument].device.sections()[section].length_mm
        }
        Parameter::Field { field, .. } => {
            let vector = fields.get(field).and_then(|field| field.spec()).map(|spec| spec.vector());
            let size = vector.map_or(0.0, |vector| Vec3::from(vector).norm());
            if size > 0.0 { size } else { WEAK_FIELD }
        }
        _ => value.unwrap_or(1.0),
    })
}

fn singular() -> Error {
    Error::Computation(
        "gradient: the equilibrium after the command is about to snap, where its derivatives are infinite: end it before".to_owned(),
    )
}
