//! What is read from the states beside a command: derivatives, and how far they hold.

use super::super::configuration::Start;
use super::super::state::KirchhoffState;
use super::Side;
use crate::Vec3;
use crate::methods::{Energy, Margin, Slope};

/// Derivatives from both sides of a parameter.
pub(super) fn slope(sides: &[Side; 2], end: &KirchhoffState, cut: bool) -> Slope {
    let [less, more] = sides.each_ref().map(|side| &*side.at.state);
    let by = 1.0 / (sides[1].by - sides[0].by);
    let of = |value: &dyn Fn(&KirchhoffState) -> f64| (value(more) - value(less)) * by;
    let positions = less.rod.positions.iter().zip(&more.rod.positions);
    let positions_mm: Vec<Vec3> = positions.map(|(less, more)| (more - less) * by).collect();
    let hands = 0..end.hand_forces.len();
    let push = |k: usize| {
        let jumps = [less, more].iter().any(|state| state.hand_forces[k].jumps);
        (!jumps).then(|| of(&|state| state.hand_forces[k].push_n + state.hand_forces[k].outside_n))
    };
    let same = |state: &KirchhoffState| {
        let points =
            |state: &KirchhoffState| state.touches.iter().map(|(point, _)| *point).collect::<Vec<usize>>();
        points(state) == points(end)
    };
    let whole = same(less) && same(more);
    let force = |k: usize| of(&|state| state.touches[k].1.contact.force_n);
    Slope {
        tip_mm: positions_mm.last().copied().unwrap_or_default(),
        positions_mm,
        push_force_n: hands.clone().map(push).collect(),
        torque_nmm: hands.map(|k| of(&|state| state.hand_forces[k].torque_nmm)).collect(),
        energy: Energy {
            bend: of(&|state| state.energy.bend),
            twist: of(&|state| state.energy.twist),
            wall: of(&|state| state.energy.wall),
            field: of(&|state| state.energy.field),
            tail: of(&|state| state.energy.tail),
            vessel: of(&|state| state.energy.vessel),
        },
        contact_forces_n: if whole { (0..end.touches.len()).map(force).collect() } else { Vec::new() },
        one_sided: cut || !whole,
    }
}

/// How far the next change of a contact is.
pub(super) fn margin(end: Start<'_>) -> Margin {
    let Start { mesh, state } = end;
    let forces = state.touches.iter().map(|(_, touch)| touch.contact.force_n);
    let radii_mm = mesh.points.iter().map(|point| point.potential.radius_mm);
    Margin {
        least_force_n: forces.fold(f64::INFINITY, f64::min),
        least_gap_mm: state.known.gaps_mm(radii_mm).fold(f64::INFINITY, f64::min),
    }
}
