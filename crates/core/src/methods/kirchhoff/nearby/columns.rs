//! How forces and numbers change with a parameter where the device lies: only what the parameter itself changes is computed.
//!
//! With q the unknowns of the rod, the energy of a part is a sum over elements, contact points, fields and tails, and R = ∂E/∂q. Of the
//! adjoint sum dL/dp = −μ·∂R/∂p + … ([`super::linear`]) only those terms are left that know p. For a section with bending stiffness EI, torsional
//! stiffness GJ and rest curvature κ⁰,
//!
//! ```text
//! Eₑ = ½∫EI |κ − κ⁰|² + GJ τ² ds
//! ∂R/∂EI = ∫ (κ − κ⁰)·∂κ/∂q ds,   ∂R/∂GJ = ∫ τ ∂τ/∂q ds,   ∂R/∂κ⁰ = −∫ EI ∂κ/∂q ds
//! ```
//!
//! as discretised ([`crate::rod`]). Eₑ is linear in EI and GJ, and R in κ⁰: so the difference of the elements' gradients between two values, however far
//! apart, is the derivative to the last digits of one of them, and only elements that the section is in are asked. Where a point presses
//! with N = w k (r − d)|∇d|, the wall's force and N are in proportion to its modulus k, and friction F = μ N g(u) to both:
//!
//! ```text
//! ∂R/∂k = (∇U + F)/k,   ∂R/∂μ = F/μ
//! ```
//!
//! A field's force is linear in its vector. Where the sheath's mouth moves by s the whole device may go with it: elements do not change then, and
//! points have ∂R = ∂(∇U + F)/∂x · s, the rest of dx/dp comes on top. In tails GJ is in the compliance of each stretch ([`super::super::tail`]),
//! which turns the rod at its mouth and where material came in.
//!
//! Other parameters have the difference of all forces between two scenes; so have these where forces between instruments or of blood follow the
//! whole line, and all but sections where push forces of several instruments are read.

use super::super::configuration::Configuration;
use super::super::hands::steered;
use super::super::material::element;
use super::super::tails::Tails;
use super::super::workspace::Tools;
use super::Scene;
use super::numbers::{Around, Found, Numbers, tail_numbers};
use super::remembered::{Entered, Scatter};
use crate::Vec3;
use crate::contact::PressingSlopes;
use crate::device::Stack;
use crate::field::FieldLoad;
use crate::methods::{Parameter, Surroundings};
use crate::rod::element::ElementSystem;
use crate::rod::{Assembly, ElementData, Layout, element_energy, element_gradients, element_system};
use crate::solve::External;

/// Begins the tails on one of two sides.
pub(super) type Begin<'a> = dyn Fn(&mut Tails, usize) + 'a;

/// Derivatives in one number, at the same end.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    /// −∂R/∂p.
    pub(super) right: Vec<f64>,
    /// How all moves along with the mouth; empty where it stays.
    pub(super) along: Vec<f64>,
    pub(super) numbers: Vec<f64>,
    /// Whether it holds on one side only.
    pub(super) one_sided: bool,
}

/// A parameter, with the scenes in which it is a little less and more.
pub(super) struct Beside {
    pub(super) parameter: Parameter,
    pub(super) sides: [(f64, Scene); 2],
}

/// The end of a part itself.
pub(super) struct Local<'a> {
    pub(super) around: &'a Around<'a>,
    pub(super) at: &'a Configuration,
    pub(super) pressing: &'a [PressingSlopes],
    /// Material that has come in, at each point that rubs.
    pub(super) entered: &'a [(usize, Vec<Entered>)],
    pub(super) numbers: &'a Numbers,
    /// Whether energies and push forces are read.
    pub(super) reads: [bool; 2],
}

impl Local<'_> {
    /// The column of a parameter by what it changes itself; none where that is more than this knows.
    pub(super) fn column<const C: usize>(&self, tools: &mut Tools<C>, beside: &Beside) -> Option<Column> {
        let mut to = self.nothing::<C>();
        match beside.parameter {
            Parameter::BendingStiffness { instrument, section }
            | Parameter::TorsionalStiffness { instrument, section }
            | Parameter::RestCurvature { instrument, section, .. } => {
                self.add_section(tools, &beside.sides, (instrument, section), &mut to);
            }
            _ if self.pushes_are_of_the_line() => return None,
            Parameter::WallModulus => self.add_modulus::<C>(&mut to),
            Parameter::WallFriction => self.add_friction::<C>(&mut to),
            Parameter::Field { field, .. } => self.add_field::<C>(&beside.sides, field, &mut to),
            Parameter::EntryPosition { axis } => self.add_shift::<C>(axis, &mut to)?,
            Parameter::Advance { .. }
            | Parameter::Rotation { .. }
            | Parameter::Steering { .. }
            | Parameter::Radius { .. }
            | Parameter::EntryDirection { .. } => return None,
        }
        Some(to)
    }

    /// A column that changes nothing.
    pub(super) fn nothing<const C: usize>(&self) -> Column {
        Column {
            right: vec![0.0; Layout::<C>::dimension(self.at.state.rod.elements())],
            numbers: vec![0.0; self.numbers.len()],
            ..Column::default()
        }
    }

    /// Where the energy is read; none where it is not.
    fn energy(&self) -> Option<usize> {
        (self.around.piece.is_last && self.reads[0]).then(|| self.numbers.energy())
    }

    /// Whether push forces are read that know contacts and fields all along the line: those of several instruments.
    pub(super) fn pushes_are_of_the_line(&self) -> bool {
        self.is_last() && self.reads[1] && self.numbers.instruments > 1
    }

    fn is_last(&self) -> bool {
        self.around.piece.is_last
    }

    /// Of what a section is made of.
    fn add_section<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        sides: &[(f64, Scene); 2],
        (instrument, section): (usize, usize),
        to: &mut Column,
    ) {
        let stacks = sides.each_ref().map(|(_, scene)| steered(&scene.parts.stack, &self.around.piece.hands));
        let between = sides[1].0 - sides[0].0;
        let (mesh, rod) = (&self.at.mesh, &self.at.state.rod);
        let range = self.elements_of(&stacks[0], (instrument, section));
        let count = mesh.inserted_mm.len();
        let data = |side: usize, e: usize| {
            let ends = (mesh.from_tip_mm[e], mesh.from_tip_mm[e + 1]);
            element(&stacks[side], (&mesh.inserted_mm, count), ends, mesh.flush_mm)
        };
        let tilts = |e: &usize| mesh.elements[*e].tilt.is_some();
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let mut add = |e: usize, gradient: &[f64; C]| {
                let rows = &mut to.right[Layout::<C>::BLOCK * e..];
                rows.iter_mut().zip(gradient).for_each(|(row, own)| *row += sign / between * own);
            };
            element_gradients::<C>(
                range.clone(),
                |e| data(side, e),
                rod,
                |e, gradient, _| {
                    if !tilts(&e) {
                        add(e, gradient);
                    }
                },
            );
            for e in range.clone().filter(tilts) {
                let mut own = ElementSystem::<C>::zeros();
                element_system::<C, false>(&data(side, e), &rod.element::<C>(e), 0.0, &mut own);
                add(e, &own.gradient);
            }
        }
        let stored = |e: usize| {
            let [less, more] =
                [0, 1].map(|side| element_energy::<C>(&data(side, e), &rod.element::<C>(e)).total());
            (more - less) / between
        };
        if let Some(energy) = self.energy() {
            to.numbers[energy] += range.clone().map(stored).sum::<f64>();
        }
        if self.is_last() && self.reads[1] {
            self.add_pushes(tools, &stacks, between, &data, &range, to);
        }
        let torsion = stacks
            .each_ref()
            .map(|stack| stack.instruments()[instrument].device.sections()[section].torsion_nmm2());
        if torsion[0] != torsion[1] {
            self.add_tails(tools, &stacks, between, to);
        }
    }

    /// The elements that a section is in.
    fn elements_of(&self, stack: &Stack, (instrument, section): (usize, usize)) -> std::ops::Range<usize> {
        let mesh = &self.at.mesh;
        let sections = stack.instruments()[instrument].device.sections();
        let ahead_mm = mesh.from_tip_mm[0] - mesh.inserted_mm[instrument];
        let begins_mm = ahead_mm + sections[..section].iter().map(|one| one.length_mm).sum::<f64>();
        let ends_mm = if section + 1 == sections.len() {
            f64::INFINITY
        } else {
            begins_mm + sections[section].length_mm
        };
        let (begins_mm, ends_mm) = (begins_mm - mesh.flush_mm, ends_mm + mesh.flush_mm);
        let first = mesh.from_tip_mm[1..].partition_point(|end| *end > ends_mm);
        let last = mesh.from_tip_mm[..mesh.line()].partition_point(|start| *start > begins_mm);
        first.min(last)..last
    }

    /// Of the push forces, which know the sections at the mouth and at ends.
    fn add_pushes<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        stacks: &[std::borrow::Cow<'_, Stack>; 2],
        between: f64,
        data: &dyn Fn(usize, usize) -> ElementData,
        range: &std::ops::Range<usize>,
        to: &mut Column,
    ) {
        // A single device's follows from the section at the mouth alone.
        if self.numbers.instruments == 1 && range.start > 0 {
            return;
        }
        let mut there = self.at.clone();
        let mut read = |side: usize| {
            there
                .parts()
                .0
                .elements
                .iter_mut()
                .enumerate()
                .skip(range.start)
                .take(range.len())
                .for_each(|(e, element)| *element = data(side, e));
            self.around.numbers(tools, &self.around.environment.steered(&stacks[side]), &mut there)
        };
        let (less, more) = (read(0), read(1));
        for k in 0..self.numbers.instruments {
            let push = self.numbers.push(k);
            to.numbers[push] += (more[push] - less[push]) / between;
        }
    }

    /// Of the twist of tails, of instruments of other materials.
    fn add_tails<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        stacks: &[std::borrow::Cow<'_, Stack>; 2],
        between: f64,
        to: &mut Column,
    ) {
        let piece = self.around.piece;
        let begin = |tails: &mut Tails, side: usize| {
            let environment = self.around.environment.steered(&stacks[side]);
            tails.begin(&environment, (&piece.was.state, &piece.hands));
        };
        self.add_twists(tools, (stacks.each_ref().map(|stack| &**stack), &begin), between, to);
    }

    /// Of the twist of tails that begin so on both sides.
    pub(super) fn add_twists<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        (stacks, begin): ([&Stack; 2], &Begin<'_>),
        between: f64,
        to: &mut Column,
    ) {
        let (l, piece, rod) = (Layout::<C>, self.around.piece, &self.at.state.rod);
        let mut spins = vec![0.0; self.entered.len()];
        for (side, sign) in [(0, -1.0 / between), (1, 1.0 / between)] {
            begin(&mut tools.tails, side);
            for tail in tools.tails.each() {
                if let Some(set) = tail.set.filter(|_| tail.is_in) {
                    to.right[l.angle(0, set)] += sign * tail.on(rod).body_nmm;
                }
            }
            for (spin, (_, entered)) in spins.iter_mut().zip(self.entered) {
                for Entered { instrument, from_tip_mm, weight } in entered {
                    let angle = tools.tails.angle_before(stacks[side], *instrument, *from_tip_mm);
                    *spin -= sign * weight * angle;
                }
            }
            let numbers = tail_numbers(tools, &self.around.environment, self.numbers, self.at);
            to.numbers.iter_mut().zip(&numbers).for_each(|(to, own)| *to += sign * own);
        }
        tools.tails.begin(&self.around.environment, (&piece.was.state, &piece.hands));
        let friction = self.pressing.iter().filter_map(|at| Some((at.index, at.friction.as_ref()?)));
        for ((index, friction), spin) in friction.zip(&spins) {
            let (force, moment) = friction.by_spin;
            self.add_at::<C>(index, (force * *spin, moment * spin), to);
        }
    }

    /// Adds a force and a moment at a point, as gradients.
    pub(super) fn add_at<const C: usize>(&self, index: usize, (force, moment): (Vec3, f64), to: &mut Column) {
        let Configuration { mesh, state } = self.at;
        Scatter::at::<C>(&state.rod, mesh, index).add((force, moment), |row, own| to.right[row] -= own);
    }

    /// What a change of the force and the energy at a point adds to the numbers.
    fn add_touch(&self, index: usize, (force_n, energy_mj): (f64, f64), to: &mut Column) {
        if !self.is_last() {
            return;
        }
        if let Ok(k) = self.numbers.touches.binary_search(&index) {
            to.numbers[self.numbers.contact(k)] += force_n;
        }
        if let Some(energy) = self.energy() {
            to.numbers[energy] += energy_mj;
        }
        let (mesh, point) = (&self.at.mesh, &self.at.mesh.points[index]);
        if self.numbers.instruments == 1 && mesh.is_coming_in(point) {
            to.numbers[self.numbers.push(0)] += energy_mj / point.weight_mm;
        }
    }

    /// Of the wall's modulus.
    fn add_modulus<const C: usize>(&self, to: &mut Column) {
        for at in self.pressing {
            let share = 1.0 / self.at.mesh.points[at.index].potential.modulus_n_per_mm2;
            let (force, moment) = at.acts.friction;
            self.add_at::<C>(at.index, ((at.acts.wall + force) * share, moment * share), to);
            self.add_touch(at.index, (at.acts.force_n * share, at.acts.energy_mj * share), to);
        }
    }

    /// Of the coefficient of friction.
    fn add_friction<const C: usize>(&self, to: &mut Column) {
        let share = 1.0 / self.around.environment.surroundings.properties.largest_friction();
        for at in self.pressing {
            let (force, moment) = at.acts.friction;
            self.add_at::<C>(at.index, (force * share, moment * share), to);
        }
    }

    /// Of a field.
    fn add_field<const C: usize>(&self, sides: &[(f64, Scene); 2], field: usize, to: &mut Column) {
        let Configuration { mesh, state } = self.at;
        let between = sides[1].0 - sides[0].0;
        let (environment, energy) = (&self.around.environment, self.energy());
        for ((_, scene), sign) in sides.iter().zip([-1.0 / between, 1.0 / between]) {
            let own = &scene.parts.fields[field..=field];
            let before = if environment.surroundings.fields_change() { &[] } else { own };
            let surroundings = Surroundings { fields: [before, own], ..environment.surroundings };
            let fields = surroundings.fields_at(environment.fields_part);
            let mut load = FieldLoad::new(fields, &mesh.from_tip_mm, &mesh.inserted_mm);
            let mut forces = Assembly::<C>::forces(mesh.elements.len());
            load.linearise(&mesh.elements, &state.rod, &mut forces);
            to.right.iter_mut().zip(&forces.residual).for_each(|(row, own)| *row -= sign * own);
            if let Some(energy) = energy {
                to.numbers[energy] += sign * load.energy_mj(&mesh.elements, &state.rod);
            }
        }
    }

    /// Of a place of the mouth, with which the whole device moves; none in fields that may not be the same everywhere.
    fn add_shift<const C: usize>(&self, axis: usize, to: &mut Column) -> Option<()> {
        let [before, after] = self.around.environment.surroundings.fields;
        if before.iter().chain(after).any(|field| field.spec().is_none()) {
            return None;
        }
        let shift = Vec3::ith(axis, 1.0);
        let nodes = self.at.state.rod.positions.len();
        to.along = vec![0.0; to.right.len()];
        for node in 0..nodes {
            to.along[Layout::<C>.position(node) + axis] = 1.0;
        }
        for node in 0..self.numbers.nodes {
            to.numbers[self.numbers.place(node) + axis] = 1.0;
        }
        for at in self.pressing {
            let (force, moment) = at.by_place;
            self.add_at::<C>(at.index, (force * shift, moment.dot(&shift)), to);
            self.add_touch(at.index, (at.force_n.dot(&shift), at.acts.wall.dot(&shift)), to);
        }
        Some(())
    }
}

/// The column from two sides, of which one may have another mesh; none where both have.
pub(super) fn column(sides: &[(f64, Option<Found>); 2], here: &Found) -> Option<Column> {
    let mut one_sided = false;
    let mut by = [0.0; 2];
    for (by, (step, found)) in by.iter_mut().zip(sides) {
        one_sided |= found.as_ref().is_none_or(|found| !found.same_contacts);
        *by = if found.is_some() { *step } else { 0.0 };
    }
    let whole = if by[1] == by[0] { return None } else { by[1] - by[0] };
    let [less, more] = sides.each_ref().map(|(_, found)| found.as_ref().unwrap_or(here));
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
    Some(Column {
        right: slope(&less.rows, &more.rows, -1.0),
        along,
        numbers: slope(&less.numbers, &more.numbers, 1.0),
        one_sided,
    })
}
