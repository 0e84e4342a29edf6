//! From a case to a mesh, supports and loads, and from Newton's result to a solution.

use std::sync::Arc;

use super::case::{EndKind, LoadKind, Section, StartKind, StaticCase};
use super::guess::{self, Between};
use super::loads::Loads;
use super::mesh::{self, ASSUMED_GJ_RATIO};
use super::solution::{Energies, InstrumentSolution, Reaction, Reactions, StaticSolution, TouchSolution};
use super::stack::Stack;
use crate::contact::{Capsule, SelfContact, Touching};
use crate::field::{Field, FieldLoad};
use crate::rod::{Clamp, ElementData, EndAngle, Frame, RodState, Supports, beyond};
use crate::solve::{External, Newton, NewtonOptions, NewtonReport, Together};
use crate::{Error, Result, Vec3};

/// Twist energy, as a fraction of the other energy, above which GJ matters.
const TWIST_MATTERS: f64 = 1e-9;

/// A static problem, ready to solve.
#[derive(Debug, Clone)]
pub struct StaticProblem {
    /// The mesh.
    pub(crate) elements: Vec<ElementData>,
    /// Supports of the ends.
    pub(crate) supports: Supports,
    /// Loads.
    pub(crate) loads: Loads,
    /// Contact between loops of the rod, if modelled.
    pub(crate) touching: Option<SelfContact>,
    /// Initial shape.
    pub initial: RodState,
    /// Number of sets of angles: none where nothing twists.
    pub(crate) angles: usize,
    /// Options of Newton's method.
    pub(crate) options: NewtonOptions,
    /// Number of load steps.
    pub(crate) load_steps: usize,
    gj_given: bool,
    /// The section at the start of a single rod.
    first: Option<Section>,
    /// Instruments, if there are several.
    stack: Option<Stack>,
}

/// Result of the solver, from which [`StaticSolution`] is made.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Final state.
    pub state: RodState,
    /// Supports with their multipliers.
    pub(crate) supports: Supports,
    /// Report of the last load step; its iterations are those of all load steps.
    pub(crate) report: NewtonReport,
    /// Whether every accepted step of every load step lowered the energy.
    pub(crate) monotone: bool,
    /// Elastic energies.
    pub(crate) energy: Energies,
    /// Reaction at the start.
    pub(crate) start: Reaction,
    /// As in [`StaticSolution::push_force`].
    pub(crate) push_force: Option<f64>,
    /// Self-contacts of the rod.
    pub(crate) touching: Vec<Touching>,
    /// Push force and torque of each of several instruments, as in [`InstrumentSolution`].
    pub(crate) instruments: Vec<(Option<f64>, f64)>,
}

impl StaticProblem {
    /// Builds the problem of a case.
    pub fn new(case: &StaticCase) -> Result<Self> {
        case.check()?;
        let length = case.rod.line_length();
        let held = case.load.iter().flat_map(|load| [load.at, load.from, load.to]).flatten();
        let stack = Stack::new(case, held.clone())?;
        let (nodes, elements) = match &stack {
            Some(stack) => stack.mesh(),
            None => {
                let mut breaks: Vec<f64> = vec![0.0, length];
                breaks.extend(case.rod.section.iter().map(|s| s.until.min(length)));
                breaks.extend(held);
                breaks.sort_by(f64::total_cmp);
                breaks.dedup_by(|b, a| *b - *a <= 1e-12 * length);
                let nodes = mesh::nodes(&breaks, &mesh::spread(&breaks, case.rod.elements));
                let elements = mesh::elements(&case.rod, &nodes);
                (nodes, elements)
            }
        };
        let tangent = Vec3::from(case.start.tangent);
        let normal = case.start.normal.map_or_else(
            || if tangent.normalize().y.abs() < 0.9 { Vec3::y() } else { Vec3::z() },
            Vec3::from,
        );
        let frame = Frame::new(tangent, Some(normal));
        let start = Vec3::from(case.start.position);
        let loads = loads(case, &nodes);
        let first = case.rod.section.first().cloned();
        let gj_given = first.as_ref().is_none_or(|section| section.gj.is_some());
        let shaped = elements
            .iter()
            .map(|e| &e.materials[0])
            .any(|m| m.rest_curvature != [[0.0; 2]; 3] || m.rest_twist != [0.0; 3]);
        let holds = matches!(case.end.kind, EndKind::Clamped | EndKind::Guided);
        let clamped = case.start.kind == StartKind::Clamped;
        let turned = holds && clamped && (gj_given || case.end.turns.is_some_and(|t| t != 0.0));
        let twisted = shaped
            || turned
            || !loads.moments.is_empty()
            || loads.followers.iter().any(|(_, f)| f.y != 0.0 || f.z != 0.0);
        let angles = stack.as_ref().map_or(usize::from(twisted), Stack::angles);

        let supports = supports(case, &frame, angles > 0);
        let touching = self_contact(case, &elements);
        let initial = match (&stack, &case.initial) {
            (Some(stack), _) => stack.untwisted(&elements, start, frame),
            (None, Some(shape)) if !shape.points.is_empty() => {
                guess::along(&elements, start, frame, &shape.points)
            }
            (None, Some(shape)) => guess::arc(&elements, start, frame, shape.curvature),
            (None, None) if supports.conditions() > 0 => {
                let (rod, nodes, elements) = (&case.rod, &nodes[..], &elements[..]);
                let (supports, touching) = (&supports, touching.as_ref());
                Between { rod, nodes, elements, start, frame, supports, shaped, touching }.shape()
            }
            (None, None) => guess::rest_shape(&elements, start, frame),
        };
        let (max_iterations, tolerance) = (case.solver.max_iterations, case.solver.tolerance);
        let options = NewtonOptions { max_iterations, tolerance, ..NewtonOptions::default() };
        let load_steps = case.solver.load_steps;
        Ok(Self {
            elements,
            supports,
            loads,
            touching,
            initial,
            angles,
            options,
            load_steps,
            gj_given,
            first,
            stack,
        })
    }

    /// Adds a constant force along the end's tangent that is not scaled by load factors.
    pub fn pulled_by(&mut self, tension: f64) {
        let n = self.elements.len();
        self.loads.constant.push((n, self.initial.frames[n].t * tension));
    }

    /// Solves from the initial shape.
    pub fn solve(&self) -> Result<StaticSolution> {
        let solved = self.solve_state()?;
        Ok(self.solution(&solved))
    }

    /// Begins from a shape: from `start` on, with the frames of the nodes.
    pub fn lay(&mut self, start: Vec3, frames: Vec<Frame>) {
        self.initial = RodState::from_frames(&self.elements, start, frames);
    }

    /// Most iterations of a solve.
    pub fn limit_iterations(&mut self, most: usize) {
        self.options.max_iterations = most;
    }

    /// Solves from the initial shape and returns the state.
    ///
    /// # Errors
    /// A rod that twists without a torsion stiffness.
    pub fn solve_state(&self) -> Result<Solved> {
        self.solve_in(&[])
    }

    /// The same in fields, whose units of length and energy are those of the case. They act in full in all load steps, and are no part of the energies of the
    /// solution, nor of the push forces of several instruments.
    ///
    /// # Errors
    /// See [`StaticProblem::solve_state`].
    pub fn solve_in(&self, fields: &[Arc<dyn Field>]) -> Result<Solved> {
        let solved = by_angles!(self.angles, self.run(fields));
        let energy = &solved.energy;
        if self.angles > 0
            && !self.gj_given
            && energy.twist > TWIST_MATTERS * (energy.total + energy.load.abs())
        {
            return Err(Error::parameter(
                "rod.section.GJ",
                "missing",
                "this case twists the rod: give the torsion stiffness GJ in every section",
            ));
        }
        Ok(solved)
    }

    /// Change of bend by one more Newton step from a solved state: changes of the angle between the end tangents of
    /// the elements, summed along the rod, rad. It measures the distance from the equilibrium of the mesh, whatever
    /// the scale of the residual, and ignores neutral rotations of the whole rod. For loads with a potential.
    pub fn next_bend(&self, solved: &Solved) -> f64 {
        by_angles!(self.angles, self.bend_after(solved))
    }

    fn bend_after<const C: usize>(&self, solved: &Solved) -> f64 {
        let state = &solved.state;
        let mut newton = Newton::<C>::new(self.elements.len());
        let (mut loads, mut touching) = (self.loads.clone(), self.touching.clone());
        let mut outside = outside(&mut loads, &mut touching, None);
        newton.assemble(&self.elements, &solved.supports, &mut outside, state);
        let Some((_, step)) = newton.full_step(&self.elements, &solved.supports) else { return f64::NAN };
        let mut next = state.clone();
        next.advance::<C>(&self.elements, state, step, 1.0);
        let bend = |s: &RodState, e: usize| s.frames[e].t.cross(&s.frames[e + 1].t).norm();
        (0..state.elements()).map(|e| (bend(&next, e) - bend(state, e)).abs()).sum()
    }

    /// What fields do to the rod; none where there are none.
    fn field_load<'a>(&self, fields: &'a [Arc<dyn Field>]) -> Option<FieldLoad<'a>> {
        if fields.is_empty() {
            return None;
        }
        let towards_tip = self.elements.iter().rev().scan(0.0, |sum, element| {
            *sum += element.length;
            Some(*sum)
        });
        let mut from_tip: Vec<f64> = std::iter::once(0.0).chain(towards_tip).collect();
        from_tip.reverse();
        let inserted: Vec<f64> =
            self.stack.iter().flat_map(Stack::instruments).map(|(one, _)| one.inserted).collect();
        Some(FieldLoad::new(fields.iter().map(|field| (&**field, 1.0)), &from_tip, &inserted))
    }

    fn run<const C: usize>(&self, fields: &[Arc<dyn Field>]) -> Solved {
        let mut newton = Newton::<C>::new(self.elements.len());
        let mut state = self.initial.clone();
        let mut supports = self.supports.clone();
        if let (Some(end), true) = (supports.end_angle, supports.start_angles[0]) {
            // Distribute the rotation along the rod: a straight rod is then twisted without a single step.
            supports.begin(&state);
            let target = supports.end_angle.map_or(end.target, |e| e.target);
            let total: f64 = self.elements.iter().map(|e| e.length).sum();
            let change = target - state.angles[self.elements.len()];
            let mut s = 0.0;
            for i in 0..=self.elements.len() {
                state.angles[i] += change * s / total;
                s += self.elements.get(i).map_or(0.0, |e| e.length);
            }
        } else {
            supports.begin(&state);
        }
        let (mut loads, mut touching) = (self.loads.clone(), self.touching.clone());
        let mut field = self.field_load(fields);
        let mut iterations = 0;
        let mut monotone = true;
        let mut last = None;
        for step in 1..=self.load_steps {
            loads.factor = self.loads.factor * step as f64 / self.load_steps as f64;
            let mut outside = outside(&mut loads, &mut touching, field.as_mut());
            let report = newton.solve(&self.elements, &mut supports, &mut outside, &mut state, &self.options);
            iterations += report.iterations;
            monotone &= !loads.is_conservative()
                || newton.steps.iter().all(|s| s.merit_change <= 1e-12 * s.energy_scale);
            let failed = !report.converged;
            last = Some(report);
            if failed {
                break;
            }
        }
        let mut report = last.unwrap_or_else(|| {
            let mut outside = outside(&mut loads, &mut touching, field.as_mut());
            newton.solve(&self.elements, &mut supports, &mut outside, &mut state, &self.options)
        });
        report.iterations = iterations;
        let stored = newton.assembly.energy;
        let energy = Energies {
            bend: stored.bend,
            twist: stored.twist,
            axial: stored.axial,
            total: stored.total(),
            load: loads.value(&self.elements, &state),
        };
        let clamp = Clamp::new::<C>(&newton.start_residual, &state);
        let held = supports.start_tangent;
        let moment = clamp.moment + state.frames[0].t * clamp.torque;
        let start = Reaction {
            force: clamp.force.into(),
            moment: if held { moment.into() } else { [0.0; 3] },
            torque: if held { clamp.torque } else { 0.0 },
        };
        let push_force = self.first.as_ref().filter(|_| held).map(|first| {
            let frame = state.material_frame(0);
            let rest = frame.u * first.rest_curvature[0] + frame.v * first.rest_curvature[1];
            clamp.push_force(&frame.t, first.ei, first.gj.unwrap_or(ASSUMED_GJ_RATIO * first.ei), &rest)
        });
        let instruments = self.hands::<C>(&state, &supports, &mut loads, &clamp);
        let touching = touching.map_or_else(Vec::new, |touching| touching.touching(&self.elements, &state));
        Solved { state, supports, report, monotone, energy, start, push_force, touching, instruments }
    }

    /// Push force and torque of each of several instruments at an equilibrium with these external energies, as in
    /// [`InstrumentSolution`]; empty for a single rod.
    pub(super) fn hands<const C: usize>(
        &self,
        state: &RodState,
        supports: &Supports,
        external: &mut dyn External,
        clamp: &Clamp,
    ) -> Vec<(Option<f64>, f64)> {
        let Some(stack) = &self.stack else { return Vec::new() };
        let sets = stack.instruments().map(|(_, set)| set).enumerate();
        let hand = |(index, set): (usize, Option<usize>)| {
            let force = stack.push_force::<C>(index, state, supports, external);
            (force, set.map_or(0.0, |set| clamp.torques[set]))
        };
        sets.map(hand).collect()
    }

    /// The solution of each of several instruments.
    fn instruments(&self, solved: &Solved) -> Vec<InstrumentSolution> {
        let Some(stack) = &self.stack else { return Vec::new() };
        let tilts = by_angles!(self.angles, self.tilts(stack, &solved.state));
        let each = stack.instruments().zip(&solved.instruments).zip(tilts).enumerate();
        let reported = each.map(|(index, (((instrument, set), (push_force, torque)), tilt))| {
            let tip = stack.tip_node(index);
            InstrumentSolution {
                name: instrument.name.clone(),
                inserted: instrument.inserted,
                tip: solved.state.positions[tip].into(),
                twist: set.map_or(0.0, |set| solved.state.twist_to(tip, set)),
                push_force: *push_force,
                torque: *torque,
                tilt,
            }
        });
        reported.collect()
    }

    /// Tilt at the end of each instrument, rad.
    fn tilts<const C: usize>(&self, stack: &Stack, state: &RodState) -> Vec<f64> {
        let at_end = |index: usize| {
            let e = stack.tip_node(index);
            let data = self.elements.get(e)?;
            beyond(data, &state.element::<C>(e)).map(|(_, tilt)| tilt)
        };
        (0..stack.instruments().count()).map(|index| at_end(index).unwrap_or(0.0)).collect()
    }

    /// The solution of a solved state.
    pub fn solution(&self, solved: &Solved) -> StaticSolution {
        let state = &solved.state;
        let n = self.elements.len();
        let frame = &state.frames[n];
        let m = &solved.supports.multipliers;
        let mut force = Vec3::zeros();
        for (q, value) in solved.supports.end_directions.iter().zip(m) {
            force -= q * *value;
        }
        let moment = -(frame.v * m[3] - frame.u * m[4] + frame.t * m[5]);
        let mut arc = 0.0;
        let mut arc_lengths = vec![0.0];
        for e in &self.elements {
            arc += e.length;
            arc_lengths.push(arc);
        }
        let report = &solved.report;
        let (a, b) = (&state.frames[0].t, &frame.t);
        StaticSolution {
            tip: state.positions[n].into(),
            tip_tangent: frame.t.into(),
            tip_angle: libm::atan2(a.cross(b).norm(), a.dot(b)),
            arc_lengths,
            nodes: state.positions.iter().map(|p| (*p).into()).collect(),
            tangents: state.frames.iter().map(|f| f.t.into()).collect(),
            normals: (0..=n).map(|i| state.material_frame(i).u.into()).collect(),
            twist: if self.angles > 0 && self.stack.is_none() { state.twist() } else { 0.0 },
            tensions: state.tensions.clone(),
            energy: solved.energy,
            reactions: Reactions {
                start: solved.start,
                end: Reaction { force: force.into(), moment: moment.into(), torque: -m[5] },
            },
            push_force: solved.push_force,
            touching: solved.touching.iter().map(TouchSolution::from).collect(),
            instruments: self.instruments(solved),
            iterations: report.iterations,
            residual: report.residual,
            inertia: [report.inertia.positive, report.inertia.negative],
            negative_modes: report.inertia.negative.saturating_sub(report.multipliers),
            stable: report.stable,
            converged: report.converged,
            stop: report.reason.to_string(),
            twisted: self.angles > 0,
            monotone: solved.monotone,
        }
    }
}

/// Loads, and what loops of the rod do to each other, as one.
fn outside<'a>(
    loads: &'a mut Loads,
    touching: &'a mut Option<SelfContact>,
    field: Option<&'a mut FieldLoad<'_>>,
) -> Together<'a, 3> {
    let touching = touching.as_mut().map(|touching| touching as &mut dyn External);
    let field = field.map(|field| field as &mut dyn External);
    Together([Some(loads as &mut dyn External), touching, field])
}

/// Contact between loops of the rod of a case, if modelled.
fn self_contact(case: &StaticCase, elements: &[ElementData]) -> Option<SelfContact> {
    let surface = case.self_contact.as_ref()?;
    let capsule = |element: &ElementData| {
        let rigid = Capsule::rigid(surface.radius, element.bending[1]);
        Capsule { modulus_n_per_mm2: surface.modulus.unwrap_or(rigid.modulus_n_per_mm2), ..rigid }
    };
    let touching = SelfContact::new(elements, elements.iter().map(capsule).collect());
    let closed = case.end.position == Some(case.start.position);
    Some(if closed { touching.closed() } else { touching })
}

/// The loads of a case on the nodes at these arc lengths.
fn loads(case: &StaticCase, nodes: &[f64]) -> Loads {
    let node_at = |s: f64| {
        let mut best = 0;
        for (i, x) in nodes.iter().enumerate() {
            if (x - s).abs() < (nodes[best] - s).abs() {
                best = i;
            }
        }
        best
    };
    let length = nodes[nodes.len() - 1];
    let mut loads = Loads::default();
    for load in &case.load {
        let value = Vec3::from(load.value);
        let at = node_at(load.at.unwrap_or(length));
        match load.kind {
            LoadKind::Force => loads.forces.push((at, value)),
            LoadKind::Moment => loads.moments.push((at, value)),
            LoadKind::Follower => loads.followers.push((at, value)),
            LoadKind::Distributed => loads.distributed.push((
                node_at(load.from.unwrap_or(0.0)),
                node_at(load.to.unwrap_or(length)),
                value,
            )),
        }
    }
    loads
}

/// Supports of the ends of a case whose start has this triad.
fn supports(case: &StaticCase, frame: &Frame, twisted: bool) -> Supports {
    let clamped = case.start.kind == StartKind::Clamped;
    let mut supports = Supports { start_tangent: clamped, start_angles: [clamped; 3], ..Supports::default() };
    if let Some(p) = case.end.position {
        supports.end_position = Vec3::from(p);
        supports.end_directions = match case.end.slide {
            None => vec![Vec3::x(), Vec3::y(), Vec3::z()],
            Some(s) => {
                let across = Frame::new(Vec3::from(s), None);
                vec![across.u, across.v]
            }
        };
    }
    if matches!(case.end.kind, EndKind::Clamped | EndKind::Guided) {
        let end = Frame::new(
            case.end.tangent.map_or(frame.t, Vec3::from),
            Some(case.end.normal.map_or(frame.u, Vec3::from)),
        );
        supports.end_tangent = Some(end.t);
        if twisted {
            let turns = case.end.turns.unwrap_or(0.0);
            supports.end_angle = Some(EndAngle { normal: end.u, turns, target: 0.0 });
        }
    }
    supports
}
