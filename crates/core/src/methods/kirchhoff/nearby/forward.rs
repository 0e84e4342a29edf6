//! Derivatives of what recorded commands led to, forwards: along changes of parameters, from part to part as the device went.

use super::super::Environment;
use super::super::workspace::Workspace;
use super::linear::Linear;
use super::numbers::{Numbers, Push, Wanted};
use super::recorded::Piece;
use super::reverse::{Record, motion};
use super::{STEP, scale};
use crate::methods::{Parameter, Passed, Slope, Surroundings, Together};
use crate::{Result, Vec3};

impl<const C: usize> Record<C> {
    /// Slopes of what each command led to, along each change.
    ///
    /// # Errors
    /// As [`Tape::push`](crate::methods::Tape::push).
    pub(super) fn pushed(&self, first: &Surroundings<'_>, along: &[Together]) -> Result<Vec<Vec<Slope>>> {
        if along.is_empty() {
            return Ok(vec![Vec::new(); self.commands.len()]);
        }
        let mut by: Vec<Parameter> = Vec::new();
        for (parameter, _) in along.iter().flatten() {
            if !by.contains(parameter) {
                by.push(*parameter);
            }
        }
        let scenes = self.scenes(first, &by)?;
        let environment = Environment::new(first, &self.surface, &self.options);
        let steps: Vec<f64> =
            along.iter().map(|together| Ok(STEP * scale(&environment, together)?)).collect::<Result<_>>()?;
        let mut workspace = Workspace::<C>::new(&environment, &self.commands[0].from.state);
        let mut next = self.commands[0].from.clone();
        let mut memories: Vec<Vec<f64>> = vec![Vec::new(); along.len()];
        // A part that has a derivative on one side only leaves none on both sides of all that follows.
        let mut cut = vec![false; along.len()];
        let mut all: Vec<Vec<Slope>> = Vec::with_capacity(self.commands.len());
        let hands = by.iter().any(|one| motion(one).is_some());
        let wanted = Wanted { push: Push::Along, energy: true, hands };
        for (command, passed) in self.commands.iter().zip(&self.passed) {
            if command.pieces.as_ref().is_some_and(Vec::is_empty) {
                all.extend(all.last().cloned());
                continue;
            }
            let surroundings = self.surroundings(first, command);
            let environment = Environment::new(&surroundings, &self.surface, &self.options);
            self.with_pieces(&mut workspace, (command, &environment), |workspace, pieces| {
                for piece in pieces {
                    let on = (environment, piece);
                    let linear = Linear::<C>::new(&mut workspace.tools, on, (wanted, &scenes), &mut next)?;
                    let shares = if command.is_first { piece.shares } else { [1.0; 2] };
                    let mut slopes = Vec::with_capacity(along.len());
                    for (((together, step), memory), cut) in
                        along.iter().zip(&steps).zip(&mut memories).zip(&mut cut)
                    {
                        memory.resize(linear.remembers(), 0.0);
                        let columns = linear.columns(together, &scenes, shares);
                        let mut went = linear.forwards(memory, &columns)?;
                        *memory = std::mem::take(&mut went.memory);
                        *cut |= columns.iter().any(|(column, _)| column.one_sided);
                        if linear.pushes_along {
                            linear.read_forces_along(&mut workspace.tools, on, &mut went, &mut next)?;
                        }
                        if piece.is_last {
                            slopes.push(slope(
                                (&went.numbers, &linear.numbers),
                                (piece, passed),
                                (*step, *cut),
                            ));
                        }
                    }
                    if piece.is_last {
                        all.push(slopes);
                    }
                }
                Ok(())
            })?;
        }
        Ok(all)
    }
}

/// Changes of what is read after a command, with a step in which a contact may open.
fn slope(
    (values, numbers): (&[f64], &Numbers),
    (piece, passed): (&Piece, &Passed),
    (step, cut): (f64, bool),
) -> Slope {
    let list = |first: usize, count: usize| values[first..first + count].to_vec();
    let place = |node: usize| Vec3::from_column_slice(&values[numbers.place(node)..][..3]);
    let contact_forces_n = list(numbers.contact(0), numbers.touches.len());
    let positions_mm: Vec<Vec3> = (0..numbers.nodes).map(place).collect();
    let mut pressing = passed.report.contacts.iter().zip(&contact_forces_n);
    let opens = pressing.any(|(contact, slope)| contact.force_n <= step * slope.abs());
    let farthest_mm = positions_mm.iter().map(|way| step * way.norm()).fold(0.0, f64::max);
    let closes = passed.margin.least_gap_mm <= farthest_mm;
    let pushes = piece.end().hand_forces.iter().zip(list(numbers.push(0), numbers.instruments));
    Slope {
        tip_mm: place(numbers.nodes - 1),
        positions_mm,
        push_force_n: pushes.map(|(force, push_n)| (!force.jumps).then_some(push_n)).collect(),
        torque_nmm: list(numbers.torque(0), numbers.instruments),
        energy_mj: values[numbers.energy()],
        contact_forces_n: if opens || closes { Vec::new() } else { contact_forces_n },
        one_sided: cut || opens || closes,
    }
}
