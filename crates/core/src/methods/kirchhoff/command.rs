//! One command: in one sub-step where that will do, in several where it will not, and to where the device comes to rest as it can where
//! the way is lost.

use super::Environment;
use super::blocked::FAR_TOO_LITTLE;
use super::carried::{WallWork, carried};
use super::configuration::Start;
use super::hands::{Way, lengths};
use super::state::KirchhoffState;
use super::step_control::StepControl;
use super::substep::{AT_REST, Attempt, Effort, Found, released_mj};
use super::workspace::{Work, Workspace};
use crate::contact::extension::check_inside;
use crate::device::{Stack, line_mm};
use crate::methods::{InstrumentReport, Move, StepReport};
use crate::{Error, Result};

/// Most sub-steps that one command may be cut into.
const SUBSTEP_LIMIT: usize = 4096;
/// Newton iterations that a command may take in all its sub-steps for every millimetre and every [`WORK_RAD`], those in vain
/// included, before it comes to rest as it can: its cost is bounded.
const WORK: f64 = 280.0;
/// See [`WORK`], rad.
const WORK_RAD: f64 = 0.1;
/// … and never more than so many times what one solution may take.
const WORK_OF_ONE: usize = 10;
/// How often a device that came to rest at the end of its way, but in no equilibrium, is let go on from there with the hand held still.
const AGAIN: usize = 4;
/// What moved by less than this in another last resort, in its least radii, is at rest.
const REST_RADII: f64 = 1e-3;
/// A step is a jump if more than this part of the energy was set free that is stored, or came out of the sheath.
const JUMP: f64 = 0.02;
/// Stored energy below which nothing is called a jump, mJ.
const JUMP_FLOOR_MJ: f64 = 1e-6;

/// What the sub-steps of a command come to.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    substeps: usize,
    relaxations: u32,
    slides: u32,
    imbalance: f64,
    dissipated_mj: f64,
    flow_mj: f64,
}

impl Sum {
    /// Adds a sub-step, in which the device may have come to rest as it can.
    fn add(&mut self, found: &Found) {
        self.slides += found.slides;
        self.dissipated_mj += found.dissipated_mj;
        self.flow_mj += found.flow_mj;
        if found.relaxed {
            self.relaxations += 1;
            self.imbalance = self.imbalance.max(found.residual.max(found.unsettled));
        }
    }

    fn write(&self, report: &mut StepReport) {
        report.substeps = self.substeps as u32;
        (report.relaxations, report.slides) = (self.relaxations, self.slides);
        (report.imbalance, report.dissipated_mj) = (self.imbalance, self.dissipated_mj);
    }
}

impl<const C: usize> Workspace<C> {
    /// Carries out a command from the state `from`, and leaves the new state in `now`.
    ///
    /// # Errors
    /// As [`Method::step`](crate::methods::Method::step).
    pub(super) fn carry_out(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        moves: &[Move],
    ) -> Result<()> {
        let Self { tools, mesh, now, next, most: (elements, points), way, hands } = self;
        now.own(*elements, *points);
        next.own(*elements, *points);
        let surroundings = &environment.surroundings;
        let displacement = |part: f64| surroundings.displacement(part);
        let start_displacement = displacement(0.0);
        let mut displaced = start_displacement.clone();
        way.begin(surroundings.stack, &from.report, moves);
        let (start, target) = (line_mm(lengths(&way.start)), line_mm(lengths(&way.target)));
        if target > start {
            let tip_mm = environment.displaced(displaced.as_ref()).wall().material(&from.tip_mm());
            check_inside(surroundings.wall, &tip_mm, target - start)?;
        }
        let (mut sum, mut balanced) = (Sum::default(), true);
        tools.work = Work::default();
        let most = environment.options.max_iterations;
        let travel = way.travel_mm(WORK_RAD).max(1.0);
        let work = (WORK * travel) as usize;
        let mut control =
            StepControl::new(work.min(WORK_OF_ONE.saturating_mul(most)), from.part_mm);
        let mut moved = false;
        // Progress of the command, 0 to 1: advance and turn go together.
        let mut done = 0.0f64;
        let mut again = AGAIN;
        let thinnest_mm = surroundings.device.min_radius_mm();
        while done < 1.0 || (!balanced && again > 0) {
            // What has come to rest without an equilibrium at the end of its way goes on from there.
            again -= usize::from(done >= 1.0);
            let was = if moved { now.start() } else { Start { mesh, state: from } };
            let rest = 1.0 - done;
            let (effort, part_mm) = control.next(rest * travel);
            let part = part_mm / travel;
            let at_start = environment.displaced(displaced.as_ref());
            if effort != Effort::Usual {
                tools.refuse_narrower(&at_start, was, &way.commands, FAR_TOO_LITTLE)?;
            }
            // A rest that is rounding is none.
            let to = if part >= (1.0 - 1e-9) * rest { 1.0 } else { done + part };
            way.at(to, hands);
            let then = displacement(to);
            let passage = displaced.as_ref().zip(then.as_ref()).filter(|(before, after)| before != after);
            let taken = passage.filter(|_| was.state.rod.elements() > 0).map(|passage| {
                let mut taken = was.state.clone();
                carried(was.mesh, &was.state.rod, passage, &mut taken.rod);
                taken
            });
            let here = taken.as_ref().map_or(was, |state| Start { mesh: was.mesh, state });
            let there = environment.displaced(then.as_ref());
            sum.substeps += 1;
            if line_mm(lengths(hands)) == 0.0 {
                now.withdraw(surroundings.stack, hands);
                tools.write_report(&there, hands, now);
                break;
            }
            let left = passage.map(|passage| (was, passage));
            let attempt = Attempt { hands, effort, left };
            let before = tools.work.iterations;
            let tried = tools.try_step(&there, here, attempt, next, &mut control.budget);
            if std::env::var_os("DEBUG").is_some() {
                #[allow(clippy::print_stderr)]
                { eprintln!("at {:.3} part {part_mm:.3} of {travel:.3} {effort:?} its {} : {}", line_mm(lengths(hands)), tools.work.iterations - before, match &tried { Ok(f) => format!("ok off {:.3} slides {} balanced {} res {:.1e} uns {:.1e}", f.off_prediction, f.slides, f.balanced, f.residual, f.unsettled), Err(l) => l.reason.to_string() }); }
            }
            match tried {
                Ok(found) => {
                    sum.add(&found);
                    // At a crease of the wall forces are those of one side or the other and never in balance; where nothing moves
                    // any more the device is at rest all the same.
                    let rests = done >= 1.0
                        && found.residual <= AT_REST
                        && was.state.rod.farthest_mm(&next.state.rod) <= REST_RADII * thinnest_mm;
                    balanced = found.balanced || rests;
                    check_inside(surroundings.wall, &there.wall().material(&next.state.tip_mm()), 0.0)?;
                    std::mem::swap(now, next);
                    displaced = then;
                    moved = true;
                    done = to;
                    control.succeeded(part_mm, found.off_prediction);
                }
                // From the same place the same comes of it.
                Err(_) if done >= 1.0 => break,
                Err(lost) => {
                    // No equilibrium: if the vessel is too narrow to go on, that is told, here and below.
                    if control.failed(part_mm) || sum.substeps > SUBSTEP_LIMIT {
                        tools.refuse_narrower(&at_start, was, &way.commands, 1.0)?;
                        return Err(Error::Computation(format!(
                            "kirchhoff: no equilibrium between {start:.3} and {target:.3} mm inserted: {}",
                            lost.reason
                        )));
                    }
                }
            }
        }
        if !balanced {
            let there = environment.displaced(displaced.as_ref());
            tools.refuse_narrower(&there, now.start(), &way.commands, 1.0)?;
        }
        let state = now.parts().1;
        state.part_mm = control.part_mm;
        let report = &mut state.report;
        sum.write(report);
        report.converged = balanced;
        report.angles = from.report.angles;
        report.iterations = tools.work.iterations as u32;
        report.nodes_solved = from.report.nodes_solved + tools.work.nodes_solved;
        let passage = start_displacement.as_ref().zip(displaced.as_ref());
        let by_wall = WallWork::new(passage, (&from.report, report)).with_flow(sum.flow_mj);
        report.jumped = jumped(surroundings.stack, (&from.report, report), way, by_wall);
        Ok(())
    }
}

/// Whether energy was set free that the hand had put in.
fn jumped(stack: &Stack, (before, after): (&StepReport, &StepReport), way: &Way, by_wall: WallWork) -> bool {
    // The least that the hand put in on a way without jumps, and the rod did not keep: along one the force stays between
    // what it is at the ends.
    let least = |before: f64, after: f64, way: f64| (before * way).min(after * way);
    let mut work = by_wall.least_mj;
    for (index, (start, target)) in way.start.iter().zip(&way.target).enumerate() {
        let (was, is) = (before.hand(index), after.hand(index));
        let push = |hand: &InstrumentReport| hand.push_force_n.unwrap_or(0.0);
        work += least(push(&was), push(&is), target.inserted_mm - start.inserted_mm)
            + least(was.torque_nmm, is.torque_nmm, way.commands[index].rotate_rad);
    }
    let (energy, now) = (before.energy.total(), after.energy.total());
    let released = released_mj(stack, before, after);
    let lost = work - after.dissipated_mj - (now - energy - released);
    lost > JUMP * energy.max(now).max(released.abs()).max(JUMP_FLOOR_MJ)
}
