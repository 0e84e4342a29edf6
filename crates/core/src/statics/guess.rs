//! Initial shapes of the solution.

use super::case::Rod;
use super::loads::Loads;
use super::mesh;
use crate::Vec3;
use crate::contact::{SelfContact, Touching};
use crate::rod::quadrature::GAUSS;
use crate::rod::{ElementData, Frame, PLAIN, RodState, Supports, TWISTED};
use crate::solve::{Newton, NewtonOptions};
use std::f64::consts::PI;

/// Largest number of elements of the rod on which shapes between held ends are sought.
const COARSE: usize = 64;
/// Largest number of iterations for one of them.
const ITERATIONS: usize = 100;
/// Error of the end conditions, as a part of the length and of 3 rad, up to which a shape meets them.
const MET: f64 = 1e-6;
/// Only clear improvements, by this part, count: the choice between symmetric shapes must not depend on rounding.
const CLEARLY: f64 = 1e-6;
/// Largest number of crossings that are taken apart, one after the other.
const LIFTS: usize = 8;
/// Distance to which axes are lifted apart there, in touching distances.
const LIFTED: f64 = 1.2;
/// Directions across in which arcs and bows are tried.
const WAYS: u32 = 8;
/// Amplitudes of bows that are tried beside the one that fits the span, rad.
const AMPLITUDES: [f64; 2] = [0.8, 1.6];

/// The rest shape, laid out from the start.
pub(super) fn rest_shape(elements: &[ElementData], start: Vec3, frame: Frame) -> RodState {
    let mut frames = vec![frame];
    let mut material = frame;
    let mut angle = 0.0;
    let mut angles = vec![0.0];
    for data in elements {
        let (mut k, mut twist) = ([0.0; 2], 0.0);
        for (p, point) in GAUSS.iter().enumerate() {
            let material = &data.materials[0];
            k[0] += point.weight * material.rest_curvature[p][0];
            k[1] += point.weight * material.rest_curvature[p][1];
            twist += point.weight * material.rest_twist[p];
        }
        let turn = 0.5 * data.length * twist;
        material = material.turned(turn).transported(k[0] * data.length, k[1] * data.length).turned(turn);
        angle += 2.0 * turn;
        frames.push(material);
        angles.push(angle);
    }
    let mut state = RodState::from_frames(elements, start, frames);
    state.angles = angles;
    state
}

/// Constant curvature along d₁ and d₂ of the start.
pub(super) fn arc(elements: &[ElementData], start: Vec3, frame: Frame, curvature: [f64; 2]) -> RodState {
    let mut frames = vec![frame];
    let mut last = frame;
    for data in elements {
        last = last.transported(curvature[0] * data.length, curvature[1] * data.length);
        frames.push(last);
    }
    RodState::from_frames(elements, start, frames)
}

/// A shape with the directions of the curve through points, at equal fractions of its length.
pub(super) fn along(elements: &[ElementData], start: Vec3, frame: Frame, points: &[[f64; 3]]) -> RodState {
    let points: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p)).collect();
    let arcs: Vec<f64> = std::iter::once(0.0)
        .chain(points.windows(2).scan(0.0, |s, w| {
            *s += (w[1] - w[0]).norm();
            Some(*s)
        }))
        .collect();
    let total: f64 = elements.iter().map(|e| e.length).sum();
    let stretch = arcs[arcs.len() - 1] / total;
    // Chords have the direction of the curve at their middle.
    let middle = |k: usize| 0.5 * (arcs[k] + arcs[k + 1]);
    let last = points.len() - 2;
    let direction = |s: f64| {
        let k = (1..last).find(|k| s < middle(*k)).unwrap_or(last.max(1)).max(1).min(last);
        let chord = |k: usize| (points[k + 1] - points[k]).normalize();
        if last == 0 {
            return chord(0);
        }
        let share = (s - middle(k - 1)) / (middle(k) - middle(k - 1));
        chord(k - 1) * (1.0 - share) + chord(k) * share
    };
    let (mut s, mut frames) = (0.0, vec![frame]);
    for element in elements {
        s += element.length * stretch;
        let t = direction(s);
        frames.push(frames[frames.len() - 1].transported_to(&t.normalize()));
    }
    RodState::from_frames(elements, start, frames)
}

/// A rod whose end is held, and the initial shape of its solution.
pub(super) struct Between<'a> {
    /// The rod of the case.
    pub(super) rod: &'a Rod,
    /// Arc lengths of the nodes.
    pub(super) nodes: &'a [f64],
    /// The mesh.
    pub(super) elements: &'a [ElementData],
    /// Position of the start.
    pub(super) start: Vec3,
    /// Triad of the start.
    pub(super) frame: Frame,
    /// Both supports.
    pub(super) supports: &'a Supports,
    /// Whether the rod has a shape of its own.
    pub(super) shaped: bool,
    /// The rod's surface, if it can touch itself.
    pub(super) touching: Option<&'a SelfContact>,
}

/// An unloaded equilibrium between the ends, as an initial shape.
struct Found {
    shape: RodState,
    /// Whether it touches itself.
    touches: bool,
    /// Whether it is a minimum.
    stable: bool,
    energy: f64,
}

impl Found {
    fn is_better_than(&self, other: &Self) -> bool {
        let rank = |found: &Self| (found.touches, !found.stable);
        rank(self) < rank(other)
            || (rank(self) == rank(other) && self.energy < other.energy - CLEARLY * other.energy.abs())
    }
}

impl Between<'_> {
    /// The rest shape or an arc if one meets the end conditions. Otherwise the rod's equilibrium of least energy, among
    /// those found from several simple shapes without loads, contact and torsion by the end, that does not touch
    /// itself, if need be after its crossings are lifted apart; if all do, the nearest of the simple shapes that does
    /// not.
    pub(super) fn shape(&self) -> RodState {
        let (nearest, least) = self.nearest_arc(self.elements);
        if least <= MET {
            return nearest;
        }
        let every = self.elements.len().div_ceil(COARSE).max(1);
        let last = self.nodes.len() - 1;
        let nodes: Vec<f64> =
            (0..last).step_by(every).chain(std::iter::once(last)).map(|i| self.nodes[i]).collect();
        let coarse = mesh::elements(self.rod, &nodes);
        let seeds = std::iter::once(self.nearest_arc(&coarse).0).chain(self.simple(&coarse));
        let mut best: Option<Found> = None;
        for seed in seeds {
            let found = if self.shaped {
                self.relaxed::<TWISTED>(&coarse, &nodes, seed)
            } else {
                self.relaxed::<PLAIN>(&coarse, &nodes, seed)
            };
            if let Some(found) = found.filter(|f| best.as_ref().is_none_or(|best| f.is_better_than(best))) {
                best = Some(found);
            }
        }
        match best {
            Some(found) if !found.touches => found.shape,
            found => self.nearest_clear().or(found.map(|found| found.shape)).unwrap_or(nearest),
        }
    }

    /// The triad from which shapes begin: a pinned start may first be directed at the end.
    fn first(&self) -> Frame {
        let aim = self.supports.end_position - self.start;
        if !self.supports.start_tangent && self.is_placed() && aim.norm() > 1e-9 * self.length() {
            self.frame.transported_to(&(aim / aim.norm()))
        } else {
            self.frame
        }
    }

    fn is_placed(&self) -> bool {
        self.supports.end_directions.len() == 3
    }

    fn length(&self) -> f64 {
        self.nodes[self.nodes.len() - 1]
    }

    /// How far a shape is from meeting the end conditions.
    fn miss(&self, shape: &RodState) -> f64 {
        let g = self.supports.gaps(shape);
        (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt() / self.length() + 0.3 * libm::hypot(g[3], g[4])
    }

    /// Where a shape touches itself most.
    fn touch(&self, shape: &RodState) -> Option<Touching> {
        let all = self.touching?.clone().touching_at(self.elements, shape);
        all.into_iter().max_by(|a, b| a.penetration_mm.total_cmp(&b.penetration_mm))
    }

    /// The shape, tilted so that stretches which touch pass each other: out of the plane of their tangents, between
    /// the two points one way and beyond them the other, so that the ends stay where they are. A few crossings at most.
    fn lifted(&self, mut shape: RodState) -> RodState {
        for _ in 0..LIFTS {
            let Some(touch) = self.touch(&shape) else { break };
            let mut ends = touch.arcs_mm.map(|arc| arc / self.length());
            let mut apart = touch.positions_mm[1] - touch.positions_mm[0];
            if ends[0] > ends[1] {
                ends.swap(0, 1);
                apart = -apart;
            }
            let [from, to] = ends;
            let node = |x: f64| {
                let place = x * self.length();
                shape.frames[self.nodes.partition_point(|s| *s < place).min(self.elements.len())]
            };
            let across = node(from).t.cross(&node(to).t);
            let up = if across.norm() > 1e-6 { across.normalize() } else { node(from).v };
            let up = if apart.dot(&up) < 0.0 { -up } else { up };
            let lift = LIFTED * (touch.penetration_mm + apart.norm()) - apart.dot(&up);
            // Half waves of the tilt over the stretch between the points and over those beyond them.
            let (between, beyond) = (to - from, from + 1.0 - to);
            let [inside, outside] = [between, beyond].map(|part| 0.5 * PI * lift / (self.length() * part));
            let tilt = |x: f64| {
                if x < from {
                    -outside * libm::sin(PI * x / from)
                } else if x > to {
                    -outside * libm::sin(PI * (1.0 - x) / (1.0 - to))
                } else {
                    inside * libm::sin(PI * (x - from) / between)
                }
            };
            let tilted = shape.frames.iter().zip(self.nodes).map(|(frame, place)| {
                frame.transported_to(&(frame.t + up * tilt(place / self.length())).normalize())
            });
            let tilted = RodState::from_frames(self.elements, self.start, tilted.collect());
            shape = RodState { angles: shape.angles, ..tilted };
        }
        shape
    }

    /// The rest shape or an arc, whichever ends closer, and how far it is from meeting the end conditions.
    fn nearest_arc(&self, elements: &[ElementData]) -> (RodState, f64) {
        let frame = self.first();
        let mut best = rest_shape(elements, self.start, frame);
        let mut least = self.miss(&best);
        for step in 0..=24 {
            let k = f64::from(step) * PI / 12.0 / self.length();
            for way in 0..if step == 0 { 1 } else { WAYS } {
                let (sin, cos) = across(way);
                let trial = arc(elements, self.start, frame, [k * cos, k * sin]);
                let found = self.miss(&trial);
                if found < least - CLEARLY {
                    (best, least) = (trial, found);
                }
            }
        }
        (best, least)
    }

    /// Simple shapes between the ends: the rest shape, and bows from the start's direction to the end's, whose tangent
    /// turns away and back, or one way and then the other.
    fn simple<'a>(&'a self, elements: &'a [ElementData]) -> impl Iterator<Item = RodState> + 'a {
        let frame = self.first();
        let turn = self.supports.end_tangent.map_or((0.0, 0.0), |t| frame.log(&t));
        let span = (self.supports.end_position - self.start).norm();
        let slack = if self.is_placed() { (1.0 - span / self.length()).max(0.0) } else { 0.0 };
        // A bow of amplitude A shortens by A²/4.
        let fitting = 2.0 * slack.sqrt().min(0.7);
        let held = self.supports.start_tangent;
        let once = move |x: f64| if held { libm::sin(PI * x) } else { libm::cos(0.5 * PI * x) };
        let twice = move |x: f64| if held { libm::sin(2.0 * PI * x) } else { libm::cos(PI * x) };
        let bow = move |amplitude: f64, (sin, cos): (f64, f64), doubly: bool| {
            let mut s = 0.0;
            let mut frames = Vec::with_capacity(elements.len() + 1);
            for i in 0..=elements.len() {
                let x = s / self.length();
                let lateral = amplitude * if doubly { twice(x) } else { once(x) };
                frames.push(frame.transported(turn.0 * x + lateral * cos, turn.1 * x + lateral * sin));
                s += elements.get(i).map_or(0.0, |e| e.length);
            }
            RodState::from_frames(elements, self.start, frames)
        };
        let amplitudes = std::iter::once(fitting).chain(AMPLITUDES);
        let each = amplitudes.flat_map(|amplitude| {
            [true, false]
                .into_iter()
                .flat_map(move |doubly| (0..WAYS).map(move |way| (amplitude, doubly, way)))
        });
        std::iter::once(rest_shape(elements, self.start, frame))
            .chain(each.map(move |(amplitude, doubly, way)| bow(amplitude, across(way), doubly)))
    }

    /// The equilibrium of a coarse rod with these nodes without loads, contact, and torsion by its end, found from
    /// `seed`.
    fn relaxed<const C: usize>(
        &self,
        coarse: &[ElementData],
        nodes: &[f64],
        seed: RodState,
    ) -> Option<Found> {
        let mut supports = Supports { end_angle: None, ..self.supports.clone() };
        let options = NewtonOptions { max_iterations: ITERATIONS, ..NewtonOptions::default() };
        let (mut newton, mut state) = (Newton::<C>::new(coarse.len()), seed);
        let report = newton.solve(coarse, &mut supports, &mut Loads::default(), &mut state, &options);
        if !report.converged {
            return None;
        }
        let twists: Vec<f64> = state.carried_twists().zip(&state.angles).map(|(a, b)| a + b).collect();
        let (mut frames, mut angles) = (Vec::with_capacity(self.nodes.len()), Vec::new());
        let mut e = 0;
        for place in self.nodes {
            while e + 1 < coarse.len() && nodes[e + 1] <= *place {
                e += 1;
            }
            let x = (place - nodes[e]) / (nodes[e + 1] - nodes[e]);
            let t = state.frames[e].t * (1.0 - x) + state.frames[e + 1].t * x;
            frames.push(state.frames[if x < 0.5 { e } else { e + 1 }].transported_to(&t.normalize()));
            angles.push(twists[e] * (1.0 - x) + twists[e + 1] * x);
        }
        let mut shape = RodState::from_frames(self.elements, self.start, frames);
        if self.shaped {
            shape.angles = angles;
        }
        let energy = newton.assembly.energy.total();
        let shape = self.lifted(shape);
        Some(Found { touches: self.touch(&shape).is_some(), shape, stable: report.stable, energy })
    }

    /// Of simple shapes that do not touch themselves, the one that is nearest to meeting the end conditions.
    fn nearest_clear(&self) -> Option<RodState> {
        let mut best: Option<(f64, RodState)> = None;
        for shape in self.simple(self.elements) {
            let miss = self.miss(&shape);
            if best.as_ref().is_none_or(|(least, _)| miss < least - CLEARLY) && self.touch(&shape).is_none() {
                best = Some((miss, shape));
            }
        }
        best.map(|(_, shape)| shape)
    }
}

/// Sine and cosine of a direction across.
fn across(way: u32) -> (f64, f64) {
    libm::sincos(f64::from(way) * 2.0 * PI / f64::from(WAYS))
}
