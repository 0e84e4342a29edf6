//! A tick of fixed cost: for those who must have an answer in time.
//!
//! A step ends in the equilibrium that its command leads to, however long that takes. A tick ends when its linear solves are used up. What it has begun
//! to solve for stays with the state, which is the last equilibrium, and the next tick goes on with it; what hands do meanwhile waits, and is the
//! next part of their way as a whole. So ticks follow the path of equilibria that steps follow, in parts as long as their solves make them. Where the path
//! has come to a fold the device is seen on its way to where it comes to rest: as far in each tick as its solves go.
//!
//! A vessel that moves cannot wait. There the device goes as far in each tick as its solves go, at a fold or not.

use super::Environment;
use super::blocked::refuse_wedged;
use super::carried::carried;
use super::command::{AT_REST, REST_RADII, WORK_RAD};
use super::configuration::Start;
use super::extrapolation::Correction;
use super::hands::{Hand, Way, lengths};
use super::search::{LONGEST, MOST_NEAR};
use super::state::{KirchhoffState, Ticking, UnderWay};
use super::step_control::{FOLD_MM, HELD_MM, NEARER};
use super::substep::{Attempt, Effort, Found, Lost};
use super::workspace::Workspace;
use crate::contact::extension::check_inside;
use crate::device::line_mm;
use crate::methods::{Command, Move, StepReport};
use crate::{Error, Result};

/// Most parts that a tick tries: each asks all of the wall once.
const ATTEMPTS: u32 = 3;

/// What a tick has come to.
#[derive(Debug)]
pub(super) enum Ticked {
    /// A new state.
    Moved,
    /// The device is where it was; this is the longest way of the hands in its next part, mm, and what has begun.
    Rests(f64, Ticking),
    /// It cannot follow the vessel in so many solves.
    Overtaken,
}

/// A part of the hands' way, as a tick tries it.
struct Part<'a> {
    effort: Effort,
    /// How far ticks have come with it.
    resumed: Option<&'a UnderWay>,
    /// The longest way of a hand, mm.
    part_mm: f64,
    /// Whether hands hold still while the device moves.
    holds_still: bool,
}

impl<'a> Part<'a> {
    /// Sets `hands` to where they are after the part that follows on what has begun: a part of `longest_mm` at most, or what is under way.
    fn next(
        begun: &'a Ticking,
        (way, longest_mm): (&Way, f64),
        overtaken: bool,
        hands: &mut Vec<Hand>,
    ) -> Self {
        let travel_mm = way.travel_mm(WORK_RAD);
        let part = if travel_mm > longest_mm { longest_mm / travel_mm } else { 1.0 };
        let fresh =
            |effort: Effort| Self { effort, resumed: None, part_mm: part * travel_mm, holds_still: false };
        match begun {
            Ticking::Solving(under_way) => {
                hands.clone_from(&under_way.hands);
                Self { resumed: Some(under_way), part_mm: under_way.part_mm, ..fresh(Effort::Near) }
            }
            Ticking::Moving(1..) => {
                hands.clone_from(&way.start);
                Self { holds_still: true, ..fresh(Effort::Moving) }
            }
            Ticking::Rest | Ticking::Moving(0) => {
                way.at(part, hands);
                let near = matches!(begun, Ticking::Rest) && !overtaken;
                fresh(if near { Effort::Near } else { Effort::Moving })
            }
        }
    }

    /// Whether what was found is none of it: a device that is let go before a fold stays near.
    fn strays(&self, found: &Found) -> bool {
        self.effort == Effort::Moving && !self.holds_still && self.part_mm > FOLD_MM && found.off > 1.0
    }
}

/// Tells of a part what was found, whether the device begins to move from a fold in it, and whether it rests there.
fn tell(report: &mut StepReport, found: &Found, lets_go: bool, rests: bool) {
    (report.slides, report.relaxations) = (found.slides, u32::from(lets_go));
    (report.converged, report.dissipated_mj) = (rests, found.dissipated_mj);
    (report.jump, report.jumped) = (found.jump, found.jump.is_some());
    report.imbalance = if rests { 0.0 } else { found.residual.max(found.unsettled) };
}

impl<const C: usize> Workspace<C> {
    /// Carries out moves, and what earlier ticks left over, from the state `from` in about `solves` linear solves. A new state is left in `now`.
    ///
    /// # Errors
    /// As [`Method::tick`](crate::methods::Method::tick).
    pub(super) fn tick(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        moves: &[Move],
        solves: usize,
    ) -> Result<Ticked> {
        self.begin(environment, from, moves)?;
        let Self { tools, mesh, now, next, way, hands, .. } = self;
        let surroundings = &environment.surroundings;
        let was = Start { mesh, state: from };
        let (before, after) = (surroundings.displacement(0.0), surroundings.displacement(1.0));
        let passage = before.as_ref().zip(after.as_ref()).filter(|(before, after)| before != after);
        let taken = passage.filter(|_| from.rod.elements() > 0).map(|passage| {
            let mut taken = from.clone();
            carried(mesh, &from.rod, passage, &mut taken.rod);
            taken
        });
        let here = taken.as_ref().map_or(was, |state| Start { mesh, state });
        let [at_start, there] = [&before, &after].map(|at| environment.displaced(at.as_ref()));
        let left = passage.map(|passage| (was, passage));
        // What a device with friction does from a part of this length on it may do near by.
        let let_go_mm = if surroundings.properties.has_friction() { HELD_MM } else { FOLD_MM };
        let mut longest_mm = from.stride.part_mm;
        let (rest, fold) = (Ticking::Rest, Ticking::Moving(0));
        let mut begun = if passage.is_some() { &rest } else { &from.tick };
        for attempt in 1..=ATTEMPTS {
            let part = Part::next(begun, (way, longest_mm), passage.is_some(), hands);
            if line_mm(lengths(hands)) == 0.0 {
                now.withdraw(surroundings.stack, hands);
                tools.write_report(&there, hands, now);
                let state = now.parts().1;
                (state.tick, state.report.behind) = (Ticking::Rest, way.rest(hands));
                state.report.converged = true;
                return Ok(Ticked::Moved);
            }
            let Part { effort, resumed, part_mm, holds_still } = part;
            let taken = tools.work;
            let most = resumed.map_or(MOST_NEAR, |under_way| MOST_NEAR - under_way.iterations);
            let solves_left = solves.saturating_sub(taken.solves);
            let attempted = Attempt { hands, effort, most, solves: solves_left, left, resumed };
            let tried = tools.try_step(&there, here, attempted, next);
            let iterations = (tools.work.iterations - taken.iterations).max(1);
            match tried {
                Ok(found) if part.strays(&found) && passage.is_none() => {
                    (longest_mm, begun) = (0.5 * part_mm, &rest);
                }
                Ok(found) => {
                    check_inside(
                        surroundings.lumen.openings(),
                        &there.wall().material(&next.state.tip_mm()),
                        0.0,
                    )?;
                    std::mem::swap(now, next);
                    let state = now.parts().1;
                    let way_mm = here.state.rod.farthest_mm(&state.rod);
                    let lies = way_mm <= REST_RADII * surroundings.device.min_radius_mm();
                    let rests = found.balanced || (holds_still && lies && found.residual <= AT_REST);
                    let so_far = if let Ticking::Moving(so_far) = begun { *so_far } else { 0 };
                    // What does not come to rest is left where it is, and said to be in no equilibrium.
                    let goes_on = effort == Effort::Moving && !rests && so_far + iterations <= LONGEST;
                    state.tick = if goes_on { Ticking::Moving(so_far + iterations) } else { Ticking::Rest };
                    let nearer = effort == Effort::Near && found.off < NEARER;
                    state.stride.part_mm = if nearer { longest_mm.max(2.0 * part_mm) } else { longest_mm };
                    let report = &mut state.report;
                    report.behind = way.rest(hands);
                    if goes_on && report.behind.is_empty() {
                        report.behind.resize(hands.len(), Command::default());
                    }
                    (report.substeps, report.angles) = (attempt, from.report.angles);
                    tell(report, &found, effort == Effort::Moving && !holds_still, rests);
                    tools.work.write(report, from.report.nodes_solved);
                    return Ok(Ticked::Moved);
                }
                Err(Lost::UnderWay) => {
                    let so_far = resumed.map_or(0, |under_way| under_way.iterations);
                    // Beside where it has come to and what is known of the wall there it is nothing yet.
                    let report = StepReport { angles: from.report.angles, ..StepReport::default() };
                    let (correction, stride, tick) = (Correction::default(), from.stride, Ticking::Rest);
                    let state = KirchhoffState { correction, stride, tick, report, ..(*next.state).clone() };
                    let under_way = UnderWay {
                        hands: hands.clone(),
                        part_mm,
                        state,
                        neighbourhood: tools.newton.neighbourhood.clone(),
                        iterations: (so_far + iterations).min(MOST_NEAR - 1),
                    };
                    // Counted once, with the state that it leads to.
                    tools.work.nodes_solved = taken.nodes_solved;
                    return Ok(Ticked::Rests(longest_mm, Ticking::Solving(Box::new(under_way))));
                }
                Err(_) if passage.is_some() => return Ok(Ticked::Overtaken),
                // It stays where it has come to.
                Err(_) if holds_still => return Ok(Ticked::Rests(longest_mm, Ticking::Rest)),
                Err(lost) if effort == Effort::Moving && part_mm <= FOLD_MM => {
                    let told = format!(
                        "kirchhoff: no equilibrium beyond {:.3} mm inserted: {lost}",
                        line_mm(lengths(&way.start))
                    );
                    return Err(Error::Computation(told));
                }
                Err(_) if effort == Effort::Near && part_mm <= let_go_mm => {
                    refuse_wedged(&at_start, was, &way.commands)?;
                    (longest_mm, begun) = (part_mm, &fold);
                }
                Err(_) => (longest_mm, begun) = (0.5 * part_mm, &rest),
            }
            if tools.work.solves >= solves {
                break;
            }
        }
        Ok(Ticked::Rests(longest_mm, begun.clone()))
    }
}
