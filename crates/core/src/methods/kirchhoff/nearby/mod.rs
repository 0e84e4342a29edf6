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
//! which slips from where the part began, remembers. Each parameter has two states, a little below and above; these are the only
//! derivatives that are kept. The right-hand side is the difference of R, at the same x, between both sides.
//!
//! ∂R/∂x = K + U is more than Newton's matrix K: within a Newton step the normal forces of friction, the drag of blood and the forces
//! between instruments are lagged. Here R contains them as they are at x ([`Search::assemble`](super::search::Search::assemble)). So
//!
//! ```text
//! (1 + K⁻¹U) dx/dp = K⁻¹b
//! ```
//!
//! is solved by [`gmres`](crate::solve::gmres), where U v is a difference along v of what forces that follow have more than those that stay as they are at
//! x. All else cancels in it to the last digits, which K⁻¹ would make a thousand times larger: the rod is that much stiffer along itself
//! and against the wall than across. For the same reason it is the error of the motion that is made small, not that of the forces. Without
//! lagged forces Newton's factors suffice.
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
//! Commands that are recorded (`recorded`, `reverse`) are linearised part by part in `linear`, where derivatives go in both directions.
//!
//! Forces and energies are read out at both states, and differenced. A part that ended in a jump, or in which friction was
//! anchored anew, has no derivative.

mod columns;
mod command;
mod forces;
mod linear;
mod numbers;
mod read;
mod readings;
mod recorded;
mod remembered;
mod reverse;
mod sparse;

use std::sync::Arc;

use super::Environment;
use super::carried::{Passage, taken_along};
use super::configuration::{Configuration, Start};
use super::hands::{Hand, steered};
use super::part::{Effort, Found, Limits};
use super::state::{KirchhoffState, UnderWay};
use super::substep::{Attempt, Part};
use super::workspace::Tools;
use crate::device::Stack;
use crate::methods::{Parameter, Parts, Slope, Surroundings, Together};
use crate::solve::Neighbourhood;
use crate::{Error, Result, Vec3};
use forces::{go, longest_mm, rows, spins};

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

/// The scene and the state where one parameter is a little less, or more.
#[derive(Debug)]
struct Side {
    /// Change of the parameter.
    by: f64,
    scene: Scene,
    at: Configuration,
    /// At the end of the part that is followed.
    next: Configuration,
}

/// The states beside a command.
pub(super) struct Nearby {
    parameters: Vec<Together>,
    sides: Vec<[Side; 2]>,
    /// Whether one side of a parameter has another mesh.
    cut: Vec<bool>,
    /// Hands at the start of the first command, and at its end; none in those that follow.
    first: Option<[Vec<Hand>; 2]>,
    /// Whether no part was followed yet.
    begins: bool,
    next: Configuration,
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

impl Nearby {
    /// Beside a command, the first one, from a state to those hands.
    ///
    /// # Errors
    /// A parameter that does not exist there, or has no derivative.
    pub(super) fn new(
        environment: &Environment<'_>,
        from: Start<'_>,
        target: Vec<Hand>,
        by: &[Together],
    ) -> Result<Self> {
        let at = || Configuration { mesh: from.mesh.clone(), state: Arc::new(from.state.clone()) };
        let side = |together: &Together, by: f64| {
            let scene = Scene::new(&environment.surroundings, together, by)?;
            Ok::<Side, Error>(Side { by, scene, at: at(), next: at() })
        };
        let mut sides = Vec::with_capacity(by.len());
        for together in by {
            let step = STEP * scale(environment, together)?;
            sides.push([side(together, -step)?, side(together, step)?]);
        }
        Ok(Self {
            parameters: by.to_vec(),
            sides,
            cut: vec![false; by.len()],
            first: Some([from.state.hands.clone(), target]),
            begins: true,
            next: at(),
        })
    }

    /// Beside the next command.
    pub(super) fn go_on(self) -> Self {
        Self { first: None, ..self }
    }

    /// Derivatives at the end of the command.
    pub(super) fn slopes(&self, end: &KirchhoffState) -> Vec<Slope> {
        let all = self.sides.iter().zip(&self.cut);
        all.map(|(sides, cut)| read::slope(sides, end, *cut)).collect()
    }
}

/// What goes with the parts of a command.
pub(super) trait Follows<const C: usize> {
    /// Follows an accepted part from `was`, to `end`, with the passage of a moving vessel; in the last one of a command, in which
    /// hands come to their target, forces and energies are read too.
    ///
    /// # Errors
    /// [`Error::Computation`] where there is no derivative.
    fn follow(
        &mut self,
        tools: &mut Tools<C>,
        environment: &Environment<'_>,
        on: (Start<'_>, Option<Passage<'_>>),
        solved: (Attempt<'_>, &Found),
        to: (&KirchhoffState, &[Hand]),
    ) -> Result<()>;
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

impl<const C: usize> Follows<C> for Nearby {
    fn follow(
        &mut self,
        tools: &mut Tools<C>,
        environment: &Environment<'_>,
        (was, passage): (Start<'_>, Option<Passage<'_>>),
        (attempt, found): (Attempt<'_>, &Found),
        (end, target): (&KirchhoffState, &[Hand]),
    ) -> Result<()> {
        check_smooth(&attempt, found)?;
        let under_way = resumed(&attempt.part, end);
        let part = Part { resumed: Some(&under_way), ..attempt.part };
        let mut end = End { state: end, spins: Vec::new() };
        let own = steered(environment.surroundings.stack, attempt.hands);
        let nominal_start = taken_along(was, passage);
        let nominal = Acting {
            environment: environment.steered(&own),
            materials: None,
            start: nominal_start.as_ref().map_or(was, |state| Start { mesh: was.mesh, state }),
            attempt: Attempt { part, left: passage.map(|passage| (was, passage)), ..attempt },
        };
        let is_last = attempt.hands == target && attempt.part.to == 1.0;
        // Friction in the sheath's mouth follows from the force there in the part before.
        let reads = is_last || environment.surroundings.sheath.friction > 0.0;
        let progress =
            self.first.as_ref().map_or(1.0, |first| progress(first, attempt.hands, attempt.part.to));
        let Self { parameters, sides, cut, begins, next, .. } = self;
        let assembled = tools.beside(&nominal, &end, next, |search, lagged, _| {
            search.assemble(lagged, true);
            let lags = search.lags(lagged);
            let is_regular = search.newton.factor(search.elements, search.supports).is_some();
            (rows(search), lags, is_regular)
        });
        let Some(((at_end, lags, true), slid)) = assembled else { return Err(singular()) };
        end.spins = spins(&end.state.rod, &slid);
        let most_mm = STICKING * tools.friction.stick_mm();
        // Where all sides begin in the same state they may come nearer.
        let begins = std::mem::take(begins);
        for ((together, sides), cut) in parameters.iter().zip(sides).zip(cut) {
            let mut may_come_nearer = begins;
            let (hands, way) = loop {
                let hands = [0, 1].map(|k| moved(together, attempt.hands, sides[k].by * progress));
                let mut forces = [at_end.clone(), at_end.clone()];
                for ((side, forces), hands) in sides.iter_mut().zip(&mut forces).zip(&hands) {
                    let there = side.with(environment, (hands, passage), part, |beside, _| {
                        tools.beside(beside, &end, next, |search, lagged, _| {
                            search.assemble(lagged, false);
                            rows(search)
                        })
                    });
                    match there {
                        Some((there, _)) => *forces = there,
                        // The mesh there is another one.
                        None => (side.by, *cut) = (0.0, true),
                    }
                    std::mem::swap(&mut side.next, next);
                }
                let between = sides[1].by - sides[0].by;
                if between == 0.0 {
                    let remedy = "the mesh changes on both sides: give a slightly other command";
                    return Err(together[0].0.refused(remedy));
                }
                let right: Vec<f64> =
                    forces[0].iter().zip(&forces[1]).map(|(less, more)| (less - more) / between).collect();
                let way = tools.respond((&nominal, &end), (&right, lags, most_mm), next)?;
                let by = most_mm / longest_mm::<C>(&way).max(f64::MIN_POSITIVE);
                let is_near = sides.iter().all(|side| side.by.abs() <= by);
                if is_near || !std::mem::take(&mut may_come_nearer) {
                    break (hands, way);
                }
                for side in sides.iter_mut().filter(|side| side.by != 0.0) {
                    side.by = by.copysign(side.by);
                    side.scene = Scene::new(&environment.surroundings, together, side.by)?;
                }
            };
            for (side, hands) in sides.iter_mut().zip(&hands) {
                let by = side.by;
                if by == 0.0 {
                    tools.beside(&nominal, &end, next, |search, lagged, _| search.assemble(lagged, false));
                    tools.finish(&nominal, (nominal.environment, reads), (&way, 0.0), next);
                } else {
                    std::mem::swap(&mut side.next, next);
                    side.with(environment, (hands, passage), part, |beside, own| {
                        if reads {
                            tools.beside(beside, &end, next, |search, lagged, triads| {
                                go(search, &search.state.clone(), (&way, by), triads);
                                search.assemble(lagged, false);
                            });
                        }
                        tools.finish(beside, (own, reads), (&way, by), next);
                    });
                }
                std::mem::swap(&mut side.at, next);
            }
        }
        tools.friction.set_coefficient(environment.surroundings.properties.largest_friction());
        Ok(())
    }
}

impl Side {
    /// Calls `what` with this side in a part, and with the environment in which its forces are read.
    fn with<T>(
        &self,
        environment: &Environment<'_>,
        on: (&[Hand], Option<Passage<'_>>),
        part: Part<'_>,
        what: impl FnOnce(&Acting<'_>, Environment<'_>) -> T,
    ) -> T {
        self.scene.with(environment, (self.at.start(), on), part, what)
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
