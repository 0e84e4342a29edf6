//! The report of a step, written from the state that it led to and what it took.

use super::Environment;
use super::configuration::Start;
use super::hands::{Hand, lengths};
use super::state::KirchhoffState;
use super::sum::Sum;
use super::workspace::Work;
use crate::contact::extension::left_through;
use crate::device::{Stack, line_mm};
use crate::methods::{InstrumentReport, StepReport};
use crate::shape::largest_turn_rad;
use crate::{Error, Result};

/// What a step or a tick took.
#[derive(Debug)]
pub(super) struct Took {
    pub(super) sum: Sum,
    pub(super) work: Work,
    /// Whether it has ended at an equilibrium.
    pub(super) converged: bool,
}

impl Took {
    /// The same without a jump.
    pub(super) fn without_jump(self) -> Self {
        Self { sum: self.sum.without_jump(), ..self }
    }

    /// Writes the report of the step over that of the step before.
    pub(super) fn write(&self, environment: &Environment<'_>, to: Start<'_>, report: &mut StepReport) {
        self.sum.write(report);
        self.work.write(report);
        report.converged = self.converged;
        write_state(environment, to, report);
    }
}

/// Checks that a restored report is of this state, in what users of a simulation rely on.
pub(super) fn check(report: &StepReport, state: &KirchhoffState) -> Result<()> {
    let hands = report.hands();
    let is_at = |(hand, own): (&InstrumentReport, &Hand)| {
        (hand.inserted_mm, hand.rotation_rad, hand.steer) == (own.inserted_mm, own.turn_rad, own.steer)
    };
    let turns = hands.iter().zip(&state.twists).all(|(hand, tail)| hand.mouth_rotation_rad == tail.mouth_rad);
    let agrees = hands.len() == state.hands.len()
        && hands.iter().zip(&state.hands).all(is_at)
        && turns
        && report.inserted_mm == line_mm(lengths(&state.hands))
        && report.behind == state.behind;
    let remedy = "is of another state: restore one as it was saved";
    if agrees { Ok(()) } else { Err(Error::parameter("state.report", report.inserted_mm, remedy)) }
}

/// Writes what is known of a state into a report.
fn write_state(environment: &Environment<'_>, to: Start<'_>, report: &mut StepReport) {
    let (surroundings, Start { mesh, state }) = (&environment.surroundings, to);
    let stack = surroundings.stack;
    report.inserted_mm = mesh.from_tip_mm[0];
    report.energy = state.energy;
    report.max_penetration_mm = state.deepest_mm();
    let coils = state.coils.iter().map(|coil| &coil.rod);
    let bends_rad =
        coils.chain([&state.rod]).map(|rod| largest_turn_rad(rod.frames.iter().map(|frame| frame.t)));
    report.largest_bend_rad = bends_rad.fold(0.0, f64::max);
    report.contacts.clear();
    report.contacts.extend(state.touches.iter().map(|(_, touch)| touch.contact));
    report.drag_n = state.drag_n;
    report.angles = state.has_angles;
    report.behind.clone_from(&state.behind);
    let displacement = surroundings.displacement(1.0, &state.course_mm);
    let line = state.material_line(environment.displaced(displacement.as_ref()).wall());
    report.left_through = left_through(surroundings.lumen.openings(), line).map(|(opening, _)| opening.index);
    report.instruments.clear();
    report.instruments.extend(instruments(to, stack));
    let inner = report.hand(0);
    (report.rotation_rad, report.mouth_rotation_rad, report.tip_rotation_rad) =
        (inner.rotation_rad, inner.mouth_rotation_rad, inner.tip_rotation_rad);
    let forces = || state.hand_forces.iter();
    report.push_force_n =
        forces().map(|force| force.push_n).sum::<f64>() + forces().map(|force| force.outside_n).sum::<f64>();
    report.torque_nmm = report.instruments.iter().map(|hand| hand.torque_nmm).sum();
}

/// The instruments in a state, the innermost first.
pub(super) fn instruments<'a>(
    Start { mesh, state }: Start<'a>,
    stack: &'a Stack,
) -> impl Iterator<Item = InstrumentReport> + 'a {
    let hands = state.hands.iter().zip(&state.hand_forces).zip(&state.twists);
    hands.zip(stack.sets()).map(move |(((hand, force), tail), set)| {
        let twist = set.filter(|_| hand.inserted_mm > 0.0).map_or(0.0, |set| {
            state.rod.twist_to(mesh.nearest_node(mesh.from_tip_mm[0] - hand.inserted_mm), set)
        });
        InstrumentReport {
            inserted_mm: hand.inserted_mm,
            rotation_rad: hand.turn_rad,
            steer: hand.steer,
            steer_mj: force.steer_mj,
            mouth_rotation_rad: tail.mouth_rad,
            tip_rotation_rad: tail.mouth_rad + twist,
            push_force_n: (!force.jumps).then_some(force.push_n + force.outside_n),
            torque_nmm: force.torque_nmm,
        }
    })
}
