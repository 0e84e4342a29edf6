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
use super::super::search::{Lagged, Search};
use super::super::workspace::Tools;
use super::chain::{Chain, Memory, WRENCH};
use super::columns::{Beside, Column, Local, column};
use super::forces::{lagging_everywhere, rows, spins};
use super::lagging::add_moments;
use super::numbers::{Around, Found, Numbers, Push, Wanted};
use super::recorded::Piece;
use super::remembered::{Between, Entered};
use super::reverse::motion;
use super::sparse::{Row, Sparse};
use super::{Acting, End, Scene, singular};
use crate::Result;
use crate::contact::{Place, PressingSlopes};
use crate::methods::Together;
use crate::methods::kirchhoff::Environment;
use crate::rod::{Frame, RodState, element_gradients};
use crate::solve::{Inverse, gmres};

/// Accuracy of solutions, and the most products for one.
const ACCURACY: (f64, usize) = (1e-13, 120);
/// With a larger residual there is none.
const LEAST_ACCURACY: f64 = 1e-7;

/// A part, linearised.
pub(super) struct Linear<const C: usize> {
    inverse: Inverse<C>,
    pub(super) lagging: Sparse,
    pub(super) chain: Chain,
    /// Forces by the angles from which places between instruments slip.
    slipping: Sparse,
    /// How many rows the chain has beyond those of unknowns, and how many of these, the last, are of places between instruments.
    beyond: usize,
    places: usize,
    pub(super) before: Memory,
    pub(super) after: Memory,
    pub(super) numbers: Numbers,
    /// Numbers by the unknowns of the rod, then by what is remembered.
    pub(super) reads: Sparse,
    /// Numbers by the forces on what the mouth holds, and on places beyond.
    pub(super) mouth: Sparse,
    pub(super) held: Vec<usize>,
    /// Contact points that rub on the wall.
    pub(super) rubbing: Vec<usize>,
    /// How triads from which spin is measured are turned against those of the slid device, rad.
    pub(super) spins: Vec<f64>,
    /// Whether push forces are read along each direction, not by rows.
    pub(super) pushes_along: bool,
    /// Of each hand, and each of its three motions: by its position before and after the part.
    pub(super) hands: Vec<[Option<[Column; 2]>; 3]>,
    pub(super) scene: Vec<Column>,
}

/// What is known at the end of a part itself.
pub(super) struct AtEnd<const C: usize> {
    rows: Vec<f64>,
    inverse: Inverse<C>,
    pub(super) pressing: Vec<PressingSlopes>,
    pub(super) places: Vec<Place>,
    held: Vec<usize>,
    /// Rows of the matrix of what is held, where they are asked for.
    at_mouth: Vec<(usize, Row)>,
    lags: bool,
}

impl<const C: usize> Linear<C> {
    /// Linearises a part, in the motions of the hands and in parameters of the scene.
    ///
    /// # Errors
    /// A singular equilibrium.
    pub(super) fn new(
        tools: &mut Tools<C>,
        (environment, piece): (Environment<'_>, &Piece),
        (wanted, scenes): (Wanted, &[Beside]),
        next: &mut Configuration,
    ) -> Result<Self> {
        let nominal = Scene::new(&environment.surroundings, &Vec::new(), 0.0)?;
        let environment = piece.environment(&environment);
        let own_start = piece.was.start();
        let grips = environment.surroundings.sheath.friction > 0.0;
        let reads = piece.is_last || grips;
        let pushes_along = piece.is_last && piece.hands.len() > 1 && !grips && wanted.push == Push::Along;
        let reads_mouth = grips || (piece.is_last && wanted.push != Push::Unread && !pushes_along);
        let touches = piece.end().touches.iter().map(|(point, _)| *point).collect();
        let end = End { state: piece.end(), spins: Vec::new() };
        let mut around = Around { environment, piece, end, reads, touches };
        let on = (own_start, &piece.hands[..]);
        let (at, slid, here, entered, mut linear) =
            piece.with(&environment, &nominal, on, |acting, own| {
                let found = tools.beside(acting, &around.end, next, |search, lagged, _| {
                    at_end(search, lagged, reads_mouth)
                });
                let (at, slid) = found.ok_or_else(singular)?;
                let at = at.ok_or_else(singular)?;
                let between = between(acting, own_start, next, (&around.end, &slid), tools);
                let lagging = between.lagging::<C>(&at.pressing);
                let chain = between.chain::<C>(&at.pressing, &at.places, at.rows.len());
                let before = between.memory::<C>();
                let after = Memory { rows: at.rows.len(), instruments: before.instruments };
                let rubbing = at.pressing.iter().filter(|at| at.friction.is_some()).map(|at| at.index);
                let entered: Vec<_> = rubbing.map(|index| (index, between.entered(index))).collect();
                let numbers = Numbers {
                    instruments: before.instruments,
                    nodes: if piece.is_last { piece.end().rod.positions.len() } else { 0 },
                    touches: if piece.is_last { around.touches.clone() } else { Vec::new() },
                };
                let linear = Self {
                    beyond: WRENCH * entered.len() + at.places.len(),
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
                    rubbing: entered.iter().map(|(index, _)| *index).collect(),
                    spins: Vec::new(),
                    pushes_along,
                    hands: Vec::new(),
                    scene: Vec::new(),
                };
                let numbers = around.numbers(tools, &own, next);
                let here = Found { rows: at.rows.clone(), numbers, along: None, same_contacts: true };
                Ok::<_, crate::Error>((at, slid, here, entered, linear))
            })?;
        linear.read_tails(tools, &around, (&nominal, on), next);
        if piece.is_last {
            linear.read_places();
            linear.read_contacts(&around, next, &at.pressing);
        }
        around.end.spins = spins(&piece.end().rod, &slid);
        linear.spins.clone_from(&around.end.spins);
        if at.lags {
            let dense = piece.with(&environment, &nominal, on, |acting, _| {
                tools.beside(acting, &around.end, next, lagging_everywhere)
            });
            let ([lagging, slipping], _) = dense.ok_or_else(singular)?;
            (linear.lagging, linear.slipping) = (lagging, slipping);
        }
        add_moments::<C>(&next.mesh, &at.pressing, &mut linear.lagging);
        if reads_mouth && piece.hands.len() == 1 && !at.lags {
            linear.read_mouth(tools, &around, (&nominal, on), (&at.pressing, &at.at_mouth), next);
        } else if reads_mouth {
            linear.read_forces(tools, &around, (&nominal, on), &at, next);
        }
        let (own, turned) = linear.local_columns(tools, (&around, next), (&at, &entered), (wanted, scenes));
        if piece.is_last && wanted.energy {
            linear.read_energy(tools, &around, (&nominal, on), next);
        }
        let stick_mm = tools.friction.stick_mm();
        if wanted.hands {
            for (instrument, mut turned) in turned.into_iter().enumerate() {
                let mut motions = [None, turned.take(), None];
                for (motion, columns) in
                    motions.iter_mut().enumerate().filter(|(_, columns)| columns.is_none())
                {
                    let to = (instrument, motion, stick_mm);
                    *columns = linear.hand(tools, &around, (&nominal, &here), to, next)?;
                }
                linear.hands.push(motions);
            }
        }
        for (beside, own) in scenes.iter().zip(own) {
            let mut by_sides = || {
                let sides = beside.sides.each_ref();
                let found = sides.map(|(by, scene)| (*by, around.found::<C>(tools, scene, on, next)));
                column(&found, &here)
            };
            let column = own.or_else(&mut by_sides).ok_or_else(singular)?;
            linear.scene.push(column);
        }
        Ok(linear)
    }

    /// Columns of parameters, and of the rotation of each hand, by what they change themselves; none where that is not known.
    fn local_columns(
        &self,
        tools: &mut Tools<C>,
        (around, next): (&Around<'_>, &Configuration),
        (at, entered): (&AtEnd<C>, &[(usize, Vec<Entered>)]),
        (wanted, scenes): (Wanted, &[Beside]),
    ) -> (Vec<Option<Column>>, Vec<Option<[Column; 2]>>) {
        let local = Local {
            around,
            at: next,
            pressing: &at.pressing,
            entered,
            numbers: &self.numbers,
            reads: [wanted.energy, wanted.push != Push::Unread],
        };
        let hands = if wanted.hands { around.piece.hands.len() } else { 0 };
        if at.lags {
            return (vec![None; scenes.len()], vec![None; hands]);
        }
        let columns = scenes.iter().map(|beside| {
            let found = local.column(tools, beside);
            found.map(|column| self.balanced(column))
        });
        let columns = columns.collect();
        let turned = (0..hands).map(|instrument| {
            let found = local.turned(tools, instrument);
            found.map(|columns| columns.map(|column| self.balanced(column)))
        });
        (columns, turned.collect())
    }

    /// A column whose forces on what the mouth holds have become part of what is read there.
    fn balanced(&self, mut column: Column) -> Column {
        let mut at_mouth = vec![0.0; self.after.rows + self.beyond];
        for row in &self.held {
            at_mouth[*row] = -std::mem::take(&mut column.right[*row]);
        }
        self.mouth.add_times(&at_mouth, &mut column.numbers);
        column
    }

    /// dx from the right-hand side, by K + U or its transpose.
    pub(super) fn solve(&self, right: &[f64], transposed: bool) -> Result<Vec<f64>> {
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

    /// What follows from changes of what is remembered before and along columns, each by so much.
    ///
    /// # Errors
    /// A singular equilibrium.
    pub(super) fn forwards(&self, memory: &[f64], along: &[(&Column, f64)]) -> Result<Went> {
        let mut forces = vec![0.0; self.after.rows + self.beyond];
        self.chain.add_times(memory, &mut forces);
        let slips = forces[forces.len() - self.places..].to_vec();
        self.slipping.add_times(&slips, &mut forces);
        let mut right: Vec<f64> = forces[..self.after.rows].iter().map(|force| -force).collect();
        self.held.iter().for_each(|row| right[*row] = 0.0);
        for (column, by) in along {
            right.iter_mut().zip(&column.right).for_each(|(right, own)| *right += by * own);
        }
        let way = self.solve(&right, false)?;
        let mut all = way.clone();
        all.extend_from_slice(memory);
        let (mut after, mut numbers) = (way.clone(), vec![0.0; self.numbers.len()]);
        self.reads.add_times(&all, &mut numbers);
        self.mouth.add_times(&forces, &mut numbers);
        for (column, by) in along {
            after.iter_mut().zip(&column.along).for_each(|(to, own)| *to += by * own);
            numbers.iter_mut().zip(&column.numbers).for_each(|(to, own)| *to += by * own);
        }
        after.extend_from_slice(&numbers[..self.numbers.memory()]);
        Ok(Went { memory: after, numbers, way, forces })
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

    /// Columns of parameters that change together, each by so much; the hands' shares before and after the part are of their command.
    pub(super) fn columns(
        &self,
        together: &Together,
        scenes: &[Beside],
        shares: [f64; 2],
    ) -> Vec<(&Column, f64)> {
        let mut columns = Vec::new();
        for (parameter, weight) in together {
            match motion(parameter) {
                Some((instrument, kind)) => {
                    let own = self.hands[instrument][kind].iter().flatten();
                    columns.extend(own.zip(shares).map(|(column, share)| (column, weight * share)));
                }
                None => {
                    let own =
                        scenes.iter().zip(&self.scene).filter(|(beside, _)| beside.parameter == *parameter);
                    columns.extend(own.map(|(_, column)| (column, *weight)));
                }
            }
        }
        columns
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

/// Derivatives along one direction.
pub(super) struct Went {
    /// Of what is remembered after the part.
    pub(super) memory: Vec<f64>,
    pub(super) numbers: Vec<f64>,
    /// dx, beside what moves along with the mouth.
    pub(super) way: Vec<f64>,
    /// Of the forces at the same x, and of those beyond the unknowns.
    pub(super) forces: Vec<f64>,
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

/// What is known at the end of a part, where its matrix is regular; with the rows of what is held, if those are asked for.
fn at_end<const C: usize>(
    search: &mut Search<'_, '_, C>,
    lagged: &Lagged<'_>,
    reads_mouth: bool,
) -> Option<AtEnd<C>> {
    let held: Vec<usize> = search.supports.held::<C>().into_iter().flatten().collect();
    search.supports.start_free = true;
    search.assemble(lagged, true);
    search.supports.start_free = false;
    let at_mouth = if reads_mouth { unheld(search, &held) } else { Vec::new() };
    search.supports.hold(&mut search.newton.assembly);
    search.newton.factor(search.elements, search.supports)?;
    let pressing = search.contact.slopes(search.elements, search.state);
    let places = search.contact.between().places().to_vec();
    Some(AtEnd {
        rows: rows(search),
        inverse: search.newton.inverse(),
        pressing,
        lags: lagged.flow.is_some() || !places.is_empty(),
        places,
        held,
        at_mouth,
    })
}

/// Rows of the matrix before they are held, without the augmentation γCᵀC of the first element ([`crate::rod::assembly`]).
fn unheld<const C: usize>(search: &Search<'_, '_, C>, held: &[usize]) -> Vec<(usize, Row)> {
    let (matrix, element) = (&search.newton.assembly.matrix, &search.elements[0]);
    let mut stretch = [0.0; C];
    element_gradients::<C>(0..1, |_| *element, search.state, |_, _, own| stretch = *own);
    let gamma = element.augmentation();
    let entry = |row: usize, column: usize| matrix.get(row, column) - gamma * stretch[row] * stretch[column];
    let each = held.iter().map(|row| (*row, (0..C).map(|column| (column, entry(*row, column))).collect()));
    each.collect()
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
