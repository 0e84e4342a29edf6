//! A part of a command, linearised: one place for the derivatives by which gradients go forwards and backwards.
//!
//! The end x of a part is an equilibrium of forces R that depend on what is remembered of its start, m₀, on the hands before and after it,
//! and on parameters of the scene, p. With K Newton's matrix, which is symmetric, U what follows from x and is lagged in it,
//! B = ∂R/∂m₀ and the columns b = −∂R/∂p,
//!
//! ```text
//! (K + U) dx = Σ b dp − B dm₀,    dm₁ = (dx + Σ e dp, T (dx, dm₀) + …),    dy = G (dx, dm₀) + Σ g dp
//! ```
//!
//! where e moves all along with the sheath's mouth, T are the twists of the tails and y is what is read at the end of a command. Let L = w·y be a
//! sum of readings. Its Lagrangian is L + Σ over parts of μ·R; stationary in every x and m it gives, from the last part to the first, with
//! the weights x̄ and m̄ of what follows,
//!
//! ```text
//! (K + U)ᵀ μ = x̄,    m̄₀ = −Bᵀ μ + (Tᵀ, Gᵀ) parts,    dL/dp = Σ b·μ + e·x̄ + g·w
//! ```
//!
//! (Michaleris, Tortorelli, Vidal 1994, as above; D. A. Tortorelli, P. Michaleris, *Design sensitivity analysis: overview and review*, Inverse
//! Problems in Engineering 1 (1994)). One solve with the transpose serves any number of parameters. K⁻¹ preconditions both, so they take as
//! many products.
//!
//! What is frozen: contacts that press or not, the mesh's number of nodes, how a command is divided into parts, the last digits of Newton's
//! way. Where the mesh or a contact changes within the difference of a column that column holds on one side only.

use super::super::configuration::{Configuration, Start};
use super::super::hands::Hand;
use super::super::meshed;
use super::super::tail::{TWIST, Twist};
use super::super::workspace::Tools;
use super::forces::{entering, go, rows, spins};
use super::recorded::Piece;
use super::remembered::{Between, Chain, Memory, TAIL_STEP, WRENCH};
use super::sparse::Sparse;
use super::{Acting, End, STEP, STICKING, Scene, own_scale, singular};
use crate::Result;
use crate::contact::{Place, PressingSlopes};
use crate::methods::Parameter;
use crate::methods::kirchhoff::Environment;
use crate::rod::scatter::point_columns;
use crate::rod::{Frame, Layout, RodState};
use crate::solve::{Inverse, gmres};

/// Step of differences in unknowns of the rod.
const UNKNOWN_STEP: f64 = 3e-6;
/// Accuracy of solutions, and the most products for one.
const ACCURACY: (f64, usize) = (1e-13, 120);
/// With a larger residual there is none.
const LEAST_ACCURACY: f64 = 1e-7;

/// What is read, beside places: what costs more.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wanted {
    pub(super) push: bool,
    pub(super) energy: bool,
    /// Motions of the hands.
    pub(super) hands: bool,
}

/// Where the numbers are that are read after a part: the memory of tails, and in the last part of a command places, forces and energy.
#[derive(Debug, Clone, Default)]
pub(super) struct Numbers {
    pub(super) instruments: usize,
    pub(super) nodes: usize,
    /// Contact points that touch.
    pub(super) touches: Vec<usize>,
}

impl Numbers {
    pub(super) fn memory(&self) -> usize {
        TWIST * self.instruments + 1
    }

    pub(super) fn place(&self, node: usize) -> usize {
        self.memory() + 3 * node
    }

    pub(super) fn push(&self, instrument: usize) -> usize {
        self.place(self.nodes) + instrument
    }

    pub(super) fn torque(&self, instrument: usize) -> usize {
        self.push(self.instruments) + instrument
    }

    pub(super) fn energy(&self) -> usize {
        self.torque(self.instruments)
    }

    pub(super) fn contact(&self, k: usize) -> usize {
        self.energy() + 1 + k
    }

    pub(super) fn len(&self) -> usize {
        self.contact(self.touches.len())
    }
}

/// Derivatives in one number, at the same end.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    /// −∂R/∂p.
    right: Vec<f64>,
    /// How all moves along with the mouth; empty where it stays.
    along: Vec<f64>,
    numbers: Vec<f64>,
    /// Whether it holds on one side only.
    pub(super) one_sided: bool,
}

/// A part, linearised.
pub(super) struct Linear<const C: usize> {
    inverse: Inverse<C>,
    lagging: Sparse,
    chain: Chain,
    /// Forces by the angles from which places between instruments slip.
    slipping: Sparse,
    /// How many rows the chain has beyond those of unknowns, and how many of these, the last, are of places between instruments.
    beyond: usize,
    places: usize,
    before: Memory,
    after: Memory,
    pub(super) numbers: Numbers,
    /// Numbers by the unknowns of the rod, then by what is remembered.
    reads: Sparse,
    /// Numbers by the forces on what the mouth holds, and on places beyond.
    mouth: Sparse,
    held: Vec<usize>,
    /// Of each hand, and each of its three motions: by its position before and after the part.
    pub(super) hands: Vec<[Option<[Column; 2]>; 3]>,
    pub(super) scene: Vec<Column>,
}

/// A part beside which forces are taken.
struct Around<'a> {
    environment: Environment<'a>,
    piece: &'a Piece,
    end: End<'a>,
    /// Whether forces at the mouth are read.
    reads: bool,
    touches: Vec<usize>,
}

/// Forces and numbers beside a part.
struct Found {
    rows: Vec<f64>,
    numbers: Vec<f64>,
    along: Option<Vec<f64>>,
    same_contacts: bool,
}

impl Around<'_> {
    /// Forces and numbers at the end of the part in another scene, from another start to other hands; none where the mesh is another one.
    fn found<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        scene: &Scene,
        (start, hands): (Start<'_>, &[Hand]),
        next: &mut Configuration,
    ) -> Option<Found> {
        self.piece.with(&self.environment, scene, (start, hands), |acting, own| {
            let found = tools.beside(acting, &self.end, next, |search, lagged, _| {
                search.assemble(lagged, false);
                rows(search)
            });
            let along = entering::<C>(acting.environment.surroundings.sheath, &self.end.state.rod);
            found.map(|(rows, _)| {
                let numbers = self.numbers(tools, &own, next);
                let touches = next.state.touches.iter().map(|(point, _)| *point);
                Found { rows, numbers, along, same_contacts: touches.eq(self.touches.iter().copied()) }
            })
        })
    }

    /// The numbers that are read after the last assembly.
    fn numbers<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        own: &Environment<'_>,
        next: &mut Configuration,
    ) -> Vec<f64> {
        if self.reads {
            tools.write_forces(own, next);
        }
        let state = &*next.state;
        let mut all = Vec::new();
        for tail in tools.tails.each() {
            let twist = match tail.is_in {
                true => tail.twist(&state.rod, &tail.on(&state.rod)),
                false => Twist::relaxed(tail.hand_rad),
            };
            all.extend(twist.numbers());
        }
        all.push(if self.reads { state.across_n } else { 0.0 });
        if !self.piece.is_last {
            return all;
        }
        all.extend(state.rod.positions.iter().flat_map(|place| place.iter().copied()));
        // What a residual adds to the push force does not change along equilibria.
        let single = state.hand_forces.len() == 1;
        let unbalanced_n = if single { tools.newton.unbalanced_along_n(&state.rod) } else { 0.0 };
        all.extend(state.hand_forces.iter().map(|force| force.push_n + force.outside_n - unbalanced_n));
        all.extend(state.hand_forces.iter().map(|force| force.torque_nmm));
        all.push(state.energy.total());
        let touching = |index: &usize| {
            let found = state.touches.binary_search_by_key(index, |(point, _)| *point);
            found.map_or(0.0, |k| state.touches[k].1.contact.force_n)
        };
        all.extend(self.touches.iter().map(touching));
        all
    }
}

/// What is known at the end of a part itself.
struct AtEnd<const C: usize> {
    rows: Vec<f64>,
    inverse: Inverse<C>,
    pressing: Vec<PressingSlopes>,
    places: Vec<Place>,
    held: Vec<usize>,
    lags: bool,
}

impl<const C: usize> Linear<C> {
    /// Linearises a part, in the motions of the hands and in these scenes, each by so much.
    ///
    /// # Errors
    /// A singular equilibrium.
    pub(super) fn new(
        tools: &mut Tools<C>,
        (environment, piece): (Environment<'_>, &Piece),
        (wanted, scenes): (Wanted, &[[(f64, Scene); 2]]),
        next: &mut Configuration,
    ) -> Result<Self> {
        let nominal = Scene::new(&environment.surroundings, &Vec::new(), 0.0)?;
        let environment = piece.environment(&environment);
        let own_start = piece.was.start();
        let reads = piece.is_last || environment.surroundings.sheath.friction > 0.0;
        let touches = piece.end().touches.iter().map(|(point, _)| *point).collect();
        let end = End { state: piece.end(), spins: Vec::new() };
        let mut around = Around { environment, piece, end, reads, touches };
        let on = (own_start, &piece.hands[..]);
        let (at, slid, here, mut linear) = piece.with(&environment, &nominal, on, |acting, own| {
            let (at, slid) = tools.beside(acting, &around.end, next, at_end::<C>).ok_or_else(singular)?;
            let at = at.ok_or_else(singular)?;
            let between = between(acting, own_start, next, (&around.end, &slid), tools);
            let lagging = between.lagging::<C>(&at.pressing);
            let chain = between.chain::<C>(&at.pressing, &at.places, at.rows.len());
            let before = between.memory::<C>();
            let after = Memory { rows: at.rows.len(), instruments: before.instruments };
            let numbers = Numbers {
                instruments: before.instruments,
                nodes: if piece.is_last { piece.end().rod.positions.len() } else { 0 },
                touches: if piece.is_last { around.touches.clone() } else { Vec::new() },
            };
            let rubbing = at.pressing.iter().filter(|at| at.friction.is_some()).count();
            let linear = Self {
                beyond: WRENCH * rubbing + at.places.len(),
                places: at.places.len(),
                inverse: at.inverse.clone(),
                lagging,
                chain,
                slipping: Sparse::default(),
                before,
                after,
                numbers,
                reads: Sparse::default(),
                mouth: Sparse::default(),
                held: at.held.clone(),
                hands: Vec::new(),
                scene: Vec::new(),
            };
            let numbers = around.numbers(tools, &own, next);
            let here = Found { rows: at.rows.clone(), numbers, along: None, same_contacts: true };
            Ok::<_, crate::Error>((at, slid, here, linear))
        })?;
        linear.read_tails(tools, &around, (&nominal, on), next);
        if piece.is_last {
            linear.read_places();
            linear.read_contacts(&around, next, &at.pressing);
        }
        around.end.spins = spins(&piece.end().rod, &slid);
        if at.lags {
            let dense = piece.with(&environment, &nominal, on, |acting, _| {
                tools.beside(acting, &around.end, next, |search, lagged, triads| {
                    super::forces::lagging_everywhere(search, lagged, triads)
                })
            });
            let ([lagging, slipping], _) = dense.ok_or_else(singular)?;
            (linear.lagging, linear.slipping) = (lagging, slipping);
        }
        if environment.surroundings.sheath.friction > 0.0 || (piece.is_last && wanted.push) {
            linear.read_forces(tools, &around, (&nominal, on), &at, next);
        }
        if piece.is_last && wanted.energy {
            linear.read_energy(tools, &around, (&nominal, on), next);
        }
        let stick_mm = tools.friction.stick_mm();
        if wanted.hands {
            linear.hands = (0..piece.hands.len())
                .map(|instrument| {
                    [0, 1, 2].map(|motion| {
                        let to = (instrument, motion, stick_mm);
                        linear.hand(tools, &around, (&nominal, &here), to, next)
                    })
                })
                .collect();
        }
        for sides in scenes {
            let found = sides.each_ref().map(|(by, scene)| (*by, around.found::<C>(tools, scene, on, next)));
            linear.scene.push(column(&found, &here)?);
        }
        Ok(linear)
    }

    /// Columns by one motion of a hand; none where it has none.
    fn hand(
        &self,
        tools: &mut Tools<C>,
        around: &Around<'_>,
        (nominal, here): (&Scene, &Found),
        (instrument, motion, stick_mm): (usize, usize, f64),
        next: &mut Configuration,
    ) -> Option<[Column; 2]> {
        let (piece, environment) = (around.piece, &around.environment);
        let parameter = [
            Parameter::Advance { instrument },
            Parameter::Rotation { instrument },
            Parameter::Steering { instrument },
        ][motion];
        let device = &environment.surroundings.stack.instruments()[instrument].device;
        if piece.hands[instrument].inserted_mm == 0.0 || (motion == 2 && !device.is_steerable()) {
            return None;
        }
        let scale = own_scale(environment, &parameter).ok()?;
        let radius_mm = if motion == 1 { device.section_at(f64::INFINITY).radius_mm } else { 1.0 };
        let by = (STEP * scale).min(STICKING * stick_mm / radius_mm);
        let start = piece.was.start();
        let moved = |hands: &[Hand], by: f64| super::moved(&vec![(parameter, 1.0)], hands, by);
        let before = [-by, by].map(|by| {
            let mut there = piece.was.clone();
            let (mesh, state) = there.parts();
            state.hands = moved(&state.hands, by);
            if motion == 0 {
                meshed(environment, &state.hands, mesh);
            }
            if mesh.elements.len() != start.mesh.elements.len() || mesh.elements.is_empty() {
                return (by, None);
            }
            state.rod.place(&mesh.elements);
            (by, around.found::<C>(tools, nominal, (there.start(), &piece.hands), next))
        });
        let after = [-by, by].map(|by| {
            let hands = moved(&piece.hands, by);
            (by, around.found::<C>(tools, nominal, (start, &hands), next))
        });
        let before = if start.mesh.elements.is_empty() { None } else { column(&before, here).ok() };
        Some([before.unwrap_or_default(), column(&after, here).ok()?])
    }

    /// The twists of tails after the part, by the angles at the mouth and by what is remembered.
    fn read_tails(
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
            let read = |tools: &mut Tools<C>, next: &mut Configuration| around.numbers(tools, &own, next);
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

    /// Forces of the hands, and across the mouth, by the unknowns of the rod and by the forces on what is held.
    fn read_forces(
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

    /// Places of nodes.
    fn read_places(&mut self) {
        for node in 0..self.numbers.nodes {
            for axis in 0..3 {
                self.reads.add(self.numbers.place(node) + axis, Layout::<C>.position(node) + axis, 1.0);
            }
        }
    }

    /// Normal forces of contacts.
    fn read_contacts(&mut self, around: &Around<'_>, next: &Configuration, pressing: &[PressingSlopes]) {
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
    fn read_energy(
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

    /// dx from the right-hand side, by K + U or its transpose.
    fn solve(&self, right: &[f64], transposed: bool) -> Result<Vec<f64>> {
        let first = self.inverse.times(right);
        if self.lagging.is_empty() {
            return Ok(first);
        }
        let (way, off) = gmres(&first, ACCURACY, |way| {
            let mut lagging = vec![0.0; way.len()];
            if transposed {
                let mut free = way.to_vec();
                self.held.iter().for_each(|row| free[*row] = 0.0);
                self.lagging.add_transposed_times(&free, &mut lagging);
            } else {
                self.lagging.add_times(way, &mut lagging);
                self.held.iter().for_each(|row| lagging[*row] = 0.0);
            }
            let more = self.inverse.times(&lagging);
            way.iter().zip(&more).map(|(way, more)| way + more).collect()
        });
        let found = off <= LEAST_ACCURACY && way.iter().all(|part| part.is_finite());
        if found { Ok(way) } else { Err(singular()) }
    }

    /// What is remembered after the part, and its numbers, by changes of what is remembered before and along columns, each by so much.
    ///
    /// # Errors
    /// A singular equilibrium.
    pub(super) fn forwards(&self, memory: &[f64], along: &[(&Column, f64)]) -> Result<(Vec<f64>, Vec<f64>)> {
        let mut forces = vec![0.0; self.after.rows + self.beyond];
        self.chain.add_times(memory, &mut forces);
        let slips = forces[forces.len() - self.places..].to_vec();
        self.slipping.add_times(&slips, &mut forces);
        let mut right: Vec<f64> = forces[..self.after.rows].iter().map(|force| -force).collect();
        self.held.iter().for_each(|row| right[*row] = 0.0);
        for (column, by) in along {
            right.iter_mut().zip(&column.right).for_each(|(right, own)| *right += by * own);
        }
        let mut all = self.solve(&right, false)?;
        let mut numbers = vec![0.0; self.numbers.len()];
        let mut after = all.clone();
        all.extend_from_slice(memory);
        self.reads.add_times(&all, &mut numbers);
        self.mouth.add_times(&forces, &mut numbers);
        for (column, by) in along {
            after.iter_mut().zip(&column.along).for_each(|(to, own)| *to += by * own);
            numbers.iter_mut().zip(&column.numbers).for_each(|(to, own)| *to += by * own);
        }
        after.extend_from_slice(&numbers[..self.numbers.memory()]);
        Ok((after, numbers))
    }

    /// The weights of what is remembered before, from those of what is remembered after, and of numbers. Calls `tell` for columns.
    ///
    /// # Errors
    /// A singular equilibrium.
    pub(super) fn backwards(&self, after: &[f64], numbers: &[f64]) -> Result<(Vec<f64>, Weighted)> {
        let (way, kept) = after.split_at(self.after.rows);
        let mut numbers = numbers.to_vec();
        numbers.resize(self.numbers.len(), 0.0);
        numbers.iter_mut().zip(kept).for_each(|(to, own)| *to += own);
        let mut all = way.to_vec();
        all.resize(self.after.rows + self.before.len(), 0.0);
        self.reads.add_transposed_times(&numbers, &mut all);
        let mut before = all.split_off(self.after.rows);
        let forces = self.solve(&all, true)?;
        let mut on_rows: Vec<f64> = forces.iter().map(|force| -force).collect();
        self.held.iter().for_each(|row| on_rows[*row] = 0.0);
        on_rows.resize(self.after.rows + self.beyond, 0.0);
        self.mouth.add_transposed_times(&numbers, &mut on_rows);
        let mut slips = vec![0.0; self.places];
        self.slipping.add_transposed_times(&on_rows, &mut slips);
        let first = on_rows.len() - self.places;
        on_rows[first..].iter_mut().zip(&slips).for_each(|(to, slip)| *to += slip);
        self.chain.add_transposed_times(&on_rows, &mut before);
        Ok((before, Weighted { forces, way: way.to_vec(), numbers }))
    }

    /// How much is remembered before.
    pub(super) fn remembers(&self) -> usize {
        self.before.len()
    }

    /// How much is remembered after.
    pub(super) fn leaves(&self) -> usize {
        self.after.len()
    }
}

/// Weights at a part, by which columns count.
pub(super) struct Weighted {
    forces: Vec<f64>,
    way: Vec<f64>,
    numbers: Vec<f64>,
}

impl Weighted {
    /// The derivative along a column.
    pub(super) fn of(&self, column: &Column) -> f64 {
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        dot(&self.forces, &column.right) + dot(&self.way, &column.along) + dot(&self.numbers, &column.numbers)
    }
}

/// The column from two sides, of which one may have another mesh.
///
/// # Errors
/// Another mesh on both sides.
fn column(sides: &[(f64, Option<Found>); 2], here: &Found) -> Result<Column> {
    let (mut one_sided, between) = (false, sides[1].0 - sides[0].0);
    let mut by = [0.0; 2];
    let [less, more] = [&sides[0], &sides[1]];
    for (k, (step, found)) in [less, more].into_iter().enumerate() {
        one_sided |= found.as_ref().is_none_or(|found| !found.same_contacts);
        by[k] = if found.is_some() { *step } else { 0.0 };
    }
    let whole = if by[1] == by[0] { return Err(singular()) } else { by[1] - by[0] };
    debug_assert!(whole <= between);
    let (less, more) = (less.1.as_ref().unwrap_or(here), more.1.as_ref().unwrap_or(here));
    let slope = |less: &[f64], more: &[f64], sign: f64| -> Vec<f64> {
        less.iter().zip(more).map(|(less, more)| sign * (more - less) / whole).collect()
    };
    let along = match (&less.along, &more.along) {
        (None, None) => Vec::new(),
        (less, more) => {
            let count = less.as_ref().or(more.as_ref()).map_or(0, Vec::len);
            let nothing = vec![0.0; count];
            slope(less.as_ref().unwrap_or(&nothing), more.as_ref().unwrap_or(&nothing), 1.0)
        }
    };
    Ok(Column {
        right: slope(&less.rows, &more.rows, -1.0),
        along,
        numbers: slope(&less.numbers, &more.numbers, 1.0),
        one_sided,
    })
}

/// What is known at the end of a part, where its matrix is regular.
fn at_end<const C: usize>(
    search: &mut super::super::search::Search<'_, '_, C>,
    lagged: &super::super::search::Lagged<'_>,
    _: &[Frame],
) -> Option<AtEnd<C>> {
    search.assemble(lagged, true);
    search.newton.factor(search.elements, search.supports)?;
    let pressing = search.contact.slopes(search.elements, search.state);
    let places = search.contact.between().places().to_vec();
    Some(AtEnd {
        rows: rows(search),
        inverse: search.newton.inverse(),
        pressing,
        lags: lagged.flow.is_some() || !places.is_empty(),
        places,
        held: search.supports.held::<C>().into_iter().flatten().collect(),
    })
}

/// The part from its start to its end.
fn between<'a, const C: usize>(
    acting: &'a Acting<'_>,
    before: Start<'a>,
    next: &'a Configuration,
    (end, slid): (&End<'a>, &'a [Frame]),
    tools: &'a Tools<C>,
) -> Between<'a> {
    let rod: &RodState = &end.state.rod;
    Between {
        before,
        mesh: &next.mesh,
        rod,
        slid,
        stack: acting.environment.surroundings.stack,
        tails: &tools.tails,
        passage: acting.attempt.left.map(|(_, passage)| passage),
        motions: &tools.guess.motions,
    }
}
