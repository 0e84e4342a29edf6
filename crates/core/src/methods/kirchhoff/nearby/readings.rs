//! How what is read after a part depends on the rod there, on what is remembered and on the forces that hold it.

use super::super::configuration::{Configuration, Start};
use super::super::hands::Hand;
use super::super::tail::TWIST;
use super::super::workspace::Tools;
use super::chain::WRENCH;
use super::forces::{go, longest_mm};
use super::linear::{AtEnd, Linear, Went};
use super::numbers::{Around, mouth_of_one, tail_numbers};
use super::recorded::Piece;
use super::remembered::TAIL_STEP;
use super::sparse::Row;
use super::{End, STICKING, Scene};
use crate::Result;
use crate::contact::PressingSlopes;
use crate::methods::kirchhoff::Environment;
use crate::rod::Layout;
use crate::rod::scatter::point_columns;

/// Longest motion of a node in differences along a direction, mm: push forces of several instruments are differences themselves.
const ALONG_MM: f64 = 1e-4;
/// Step of differences in unknowns of the rod.
const UNKNOWN_STEP: f64 = 3e-6;

impl<const C: usize> Linear<C> {
    /// The twists of tails after the part, by the angles at the mouth and by what is remembered.
    pub(super) fn read_tails(
        &mut self,
        tools: &mut Tools<C>,
        around: &Around<'_>,
        (scene, (start, hands)): (&Scene, (Start<'_>, &[Hand])),
        next: &mut Configuration,
    ) {
        let (l, end) = (Layout::<C>, around.end.state);
        let (rows, count, numbers) = (self.after.rows, start.state.hands.len(), self.numbers.clone());
        let mut kept: Vec<usize> = (0..numbers.memory() - 1).collect();
        if around.piece.is_last {
            kept.extend((0..count).map(|k| numbers.torque(k)));
        }
        // Tails know these from the angle at the mouth; other forces there change with it by the rod as well.
        let of_tails = kept.clone();
        kept.push(numbers.memory() - 1);
        if around.piece.is_last {
            kept.extend((0..count).map(|k| numbers.push(k)).chain([numbers.energy()]));
        }
        around.piece.with(&around.environment, scene, (start, hands), |acting, own| {
            let base = next.state.rod.clone();
            let read = |tools: &Tools<C>, next: &Configuration| tail_numbers(tools, &own, &numbers, next);
            for instrument in 0..count {
                let Some(set) = tools.tails.each()[instrument].set else { continue };
                let mut side = |by: f64, tools: &mut Tools<C>| {
                    next.parts().1.rod.angles[set] = base.angles[set] + by;
                    read(tools, next)
                };
                let (less, more) = (side(-TAIL_STEP, tools), side(TAIL_STEP, tools));
                next.parts().1.rod.angles[set] = base.angles[set];
                for k in &of_tails {
                    self.reads.add(*k, l.angle(0, set), (more[*k] - less[*k]) / (2.0 * TAIL_STEP));
                }
            }
            let mut other = acting.attempt.left.map_or(acting.start, |(was, _)| was).state.clone();
            let each = (0..count).flat_map(|k| (0..TWIST).map(move |number| (k, number)));
            let across = self.before.across();
            for (k, number) in each.chain([(count, 0)]) {
                let mut side = |by: f64, tools: &mut Tools<C>| {
                    let was = (other.twists.clone(), other.across_n);
                    match other.twists.get_mut(k) {
                        Some(twist) => *twist = twist.with(number, by),
                        None => other.across_n += by,
                    }
                    tools.tails.begin(&acting.environment, (&other, acting.attempt.hands));
                    (other.twists, other.across_n) = was;
                    let torques =
                        tools.tails.each().iter().map(|tail| tail.on(&end.rod).body_nmm).collect::<Vec<_>>();
                    (torques, read(tools, next))
                };
                let (less, more) = (side(-TAIL_STEP, tools), side(TAIL_STEP, tools));
                let column = if k < count { self.before.twist(k, number) } else { across };
                for row in &kept {
                    self.reads.add(*row, rows + column, (more.1[*row] - less.1[*row]) / (2.0 * TAIL_STEP));
                }
                for (tail, (less, more)) in tools.tails.each().iter().zip(less.0.iter().zip(&more.0)) {
                    if let Some(set) = tail.set.filter(|_| tail.is_in) {
                        // The tail turns the rod back by its torque.
                        self.chain.add_force(l.angle(0, set), column, -(more - less) / (2.0 * TAIL_STEP));
                    }
                }
            }
            let was = acting.attempt.left.map_or(acting.start, |(was, _)| was);
            tools.tails.begin(&acting.environment, (was.state, acting.attempt.hands));
        });
    }

    /// Forces of the hand of a single device, and across the mouth, by the unknowns of the rod and by the forces on what is held: these follow
    /// from the rows of the mouth.
    pub(super) fn read_mouth(
        &mut self,
        tools: &mut Tools<C>,
        around: &Around<'_>,
        (scene, on): (&Scene, (Start<'_>, &[Hand])),
        (pressing, rows): (&[PressingSlopes], &[(usize, Row)]),
        next: &mut Configuration,
    ) {
        let l = Layout::<C>;
        let mut kept = vec![(0, self.numbers.memory() - 1)];
        if around.piece.is_last {
            kept.push((1, self.numbers.push(0)));
        }
        around.piece.with(&around.environment, scene, on, |_, own| {
            for (row, values) in rows {
                let held = tools.newton.start_residual[*row];
                let sides = [-UNKNOWN_STEP, UNKNOWN_STEP].map(|by| {
                    tools.newton.start_residual[*row] = held + by;
                    mouth_of_one(tools, &own, next)
                });
                tools.newton.start_residual[*row] = held;
                for (k, number) in &kept {
                    let slope = (sides[1][*k] - sides[0][*k]) / (2.0 * UNKNOWN_STEP);
                    self.mouth.add(*number, *row, slope);
                    self.reads.add_row(*number, values, slope);
                    self.reads.add_row(*number, &self.lagging.row(*row), slope);
                }
            }
            let turning = tools.tails.each().first().and_then(|tail| tail.set.filter(|_| tail.is_in));
            if let Some(set) = turning {
                let angle = next.state.rod.angles[set];
                let sides = [-UNKNOWN_STEP, UNKNOWN_STEP].map(|by| {
                    next.parts().1.rod.angles[set] = angle + by;
                    mouth_of_one(tools, &own, next)
                });
                next.parts().1.rod.angles[set] = angle;
                for (k, number) in &kept {
                    let slope = (sides[1][*k] - sides[0][*k]) / (2.0 * UNKNOWN_STEP);
                    self.reads.add(*number, l.angle(0, set), slope);
                }
            }
        });
        let (mesh, rod) = (&next.mesh, &around.end.state.rod);
        let coming_in = pressing.iter().filter(|at| mesh.is_coming_in(&mesh.points[at.index]));
        for at in coming_in.filter(|_| around.piece.is_last) {
            let point = &mesh.points[at.index];
            let (e, xi, _) = point.place();
            for (column, way) in point_columns::<C>(rod, &mesh.elements[e], e, xi) {
                self.reads.add(self.numbers.push(0), column, at.acts.wall.dot(&way) / point.weight_mm);
            }
        }
    }

    /// As [`Self::read_mouth`], of several instruments, whose forces depend on all of the line, and in blood.
    pub(super) fn read_forces(
        &mut self,
        tools: &mut Tools<C>,
        around: &Around<'_>,
        (scene, on): (&Scene, (Start<'_>, &[Hand])),
        at: &AtEnd<C>,
        next: &mut Configuration,
    ) {
        let l = Layout::<C>;
        let numbers = self.numbers.clone();
        let mut kept = vec![numbers.memory() - 1];
        if around.piece.is_last {
            kept.extend((0..numbers.instruments).map(|k| numbers.push(k)));
        }
        // Those of several instruments depend on all of the line.
        let several = numbers.instruments > 1;
        let most = if several { l.support(around.end.state.rod.elements()) } else { 2 * Layout::<C>::BLOCK };
        let unknowns: Vec<usize> = (0..most).collect();
        let step = UNKNOWN_STEP.min(STICKING * tools.friction.stick_mm());
        around.piece.with(&around.environment, scene, on, |acting, own| {
            for unknown in unknowns.iter().filter(|row| !self.held.contains(row)) {
                let sides = [-step, step].map(|by| {
                    tools.beside(acting, &around.end, next, |search, lagged, triads| {
                        let base = search.state.clone();
                        let mut way = vec![0.0; self.after.rows];
                        way[*unknown] = 1.0;
                        go(search, &base, (&way, by), triads);
                        search.assemble(lagged, false);
                    });
                    around.numbers(tools, &own, next)
                });
                for k in &kept {
                    self.reads.add(*k, *unknown, (sides[1][*k] - sides[0][*k]) / (2.0 * step));
                }
            }
            tools.beside(acting, &around.end, next, |search, lagged, _| search.assemble(lagged, false));
            for row in self.held.clone() {
                let held = tools.newton.start_residual[row];
                let sides = [-step, step].map(|by| {
                    tools.newton.start_residual[row] = held + by;
                    around.numbers(tools, &own, next)
                });
                tools.newton.start_residual[row] = held;
                for k in &kept {
                    self.mouth.add(*k, row, (sides[1][*k] - sides[0][*k]) / (2.0 * step));
                }
            }
            if !several {
                return;
            }
            // Friction works where the mesh moves with a hand.
            let mut row = self.after.rows;
            for point in at.pressing.iter().filter(|point| point.friction.is_some()) {
                let found = around.touches.binary_search(&point.index).ok();
                for (k, part) in found.into_iter().flat_map(|k| (0..WRENCH).map(move |part| (k, part))) {
                    let press = |by: f64, next: &mut Configuration| {
                        let (_, touch) = &mut next.parts().1.touches[k];
                        match part {
                            3 => touch.friction_nmm -= by,
                            axis => touch.contact.friction_n[axis] -= by,
                        }
                    };
                    press(-step, next);
                    let less = around.numbers(tools, &own, next);
                    press(2.0 * step, next);
                    let more = around.numbers(tools, &own, next);
                    press(-step, next);
                    for number in &kept {
                        self.mouth.add(*number, row + part, (more[*number] - less[*number]) / (2.0 * step));
                    }
                }
                row += WRENCH;
            }
            for k in 0..at.places.len() {
                let sides = [-1.0, 2.0].map(|by| {
                    tools.friction.between.slip_from(k, by * step);
                    around.numbers(tools, &own, next)
                });
                tools.friction.between.slip_from(k, -step);
                for number in &kept {
                    self.mouth.add(*number, row + k, (sides[1][*number] - sides[0][*number]) / (2.0 * step));
                }
            }
        });
    }

    /// Adds to the numbers along a direction the push forces of several instruments: the difference of both sides of it.
    ///
    /// # Errors
    /// A parameter of the scene that does not exist.
    pub(super) fn read_forces_along(
        &self,
        tools: &mut Tools<C>,
        (environment, piece): (Environment<'_>, &Piece),
        went: &mut Went,
        next: &mut Configuration,
    ) -> Result<()> {
        let nominal = Scene::new(&environment.surroundings, &Vec::new(), 0.0)?;
        let end = End { state: piece.end(), spins: self.spins.clone() };
        let touches = self.numbers.touches.clone();
        let around =
            Around { environment: piece.environment(&environment), piece, end, reads: true, touches };
        let Went { way, forces, .. } = &*went;
        let longest_mm = longest_mm::<C>(way);
        let far = forces.iter().fold(longest_mm, |most, force| most.max(force.abs()));
        let by = ALONG_MM.min(STICKING * tools.friction.stick_mm()) / far.max(f64::MIN_POSITIVE);
        let on = (piece.was.start(), &piece.hands[..]);
        let sides = around.piece.with(&around.environment, &nominal, on, |acting, own| {
            [-by, by].map(|by| {
                tools.beside(acting, &around.end, next, |search, lagged, triads| {
                    go(search, &search.state.clone(), (way, by), triads);
                    search.assemble(lagged, false);
                });
                self.held.iter().for_each(|row| tools.newton.start_residual[*row] += by * forces[*row]);
                let (rubs, slips) = forces[self.after.rows..].split_at(WRENCH * self.rubbing.len());
                for (index, wrench) in self.rubbing.iter().zip(rubs.chunks_exact(WRENCH)) {
                    let Ok(k) = around.touches.binary_search(index) else { continue };
                    let Some((_, touch)) = next.parts().1.touches.get_mut(k) else { continue };
                    (0..3).for_each(|axis| touch.contact.friction_n[axis] -= by * wrench[axis]);
                    touch.friction_nmm -= by * wrench[3];
                }
                for (k, slip) in slips.iter().enumerate() {
                    tools.friction.between.slip_from(k, by * slip);
                }
                around.numbers(tools, &own, next)
            })
        });
        for k in 0..self.numbers.instruments {
            let push = self.numbers.push(k);
            went.numbers[push] += (sides[1][push] - sides[0][push]) / (2.0 * by);
        }
        Ok(())
    }

    /// Places of nodes.
    pub(super) fn read_places(&mut self) {
        for node in 0..self.numbers.nodes {
            for axis in 0..3 {
                self.reads.add(self.numbers.place(node) + axis, Layout::<C>.position(node) + axis, 1.0);
            }
        }
    }

    /// Normal forces of contacts.
    pub(super) fn read_contacts(
        &mut self,
        around: &Around<'_>,
        next: &Configuration,
        pressing: &[PressingSlopes],
    ) {
        let (mesh, rod) = (&next.mesh, &around.end.state.rod);
        for at in pressing {
            let Ok(k) = self.numbers.touches.binary_search(&at.index) else { continue };
            let (e, xi, _) = mesh.points[at.index].place();
            for (column, way) in point_columns::<C>(rod, &mesh.elements[e], e, xi) {
                self.reads.add(self.numbers.contact(k), column, at.force_n.dot(&way));
            }
        }
    }

    /// The energy: by its forces, which are those without tension, friction and drag.
    pub(super) fn read_energy(
        &mut self,
        tools: &mut Tools<C>,
        around: &Around<'_>,
        (scene, on): (&Scene, (Start<'_>, &[Hand])),
        next: &mut Configuration,
    ) {
        let energy = self.numbers.energy();
        around.piece.with(&around.environment, scene, on, |acting, _| {
            let found = tools.beside(acting, &around.end, next, |search, _, _| {
                search.contact.let_slip();
                search.beside[2] = None;
                search.state.tensions.fill(0.0);
                search.assemble_once(false);
                search.newton.assembly.residual.clone()
            });
            let l = Layout::<C>;
            let elements = around.end.state.rod.elements();
            let multipliers: Vec<usize> = (0..elements).map(|e| l.tension(e)).collect();
            let (forces, _) = found.unwrap_or_default();
            for (row, force) in forces.iter().enumerate().take(l.support(elements)) {
                if !multipliers.contains(&row) {
                    self.reads.add(energy, row, *force);
                }
            }
            // What tails store changes with the angles at the mouth.
            for tail in tools.tails.each() {
                let Some(set) = tail.set.filter(|_| tail.is_in) else { continue };
                let angle = around.end.state.rod.angle(0, set);
                let [less, more] = [-TAIL_STEP, TAIL_STEP].map(|by| tail.at(Some(angle + by)).stored_mj);
                self.reads.add(energy, l.angle(0, set), (more - less) / (2.0 * TAIL_STEP));
            }
        });
    }
}
