//! Initial shapes of the solution.

use crate::Vec3;
use crate::rod::quadrature::GAUSS;
use crate::rod::{ElementData, Frame, RodState, Supports};
use std::f64::consts::PI;

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

/// A shape that roughly meets the end conditions: the rest shape or an arc, whichever ends closer, bowed if it is too
/// straight for its span.
pub(super) fn towards_end(
    elements: &[ElementData],
    start: Vec3,
    frame: Frame,
    supports: &Supports,
) -> RodState {
    let length: f64 = elements.iter().map(|e| e.length).sum();
    // A pinned start may first be directed at the end.
    let aim = supports.end_position - start;
    let frame = if !supports.start_tangent && supports.end_directions.len() == 3 && aim.norm() > 1e-9 * length
    {
        frame.transported_to(&(aim / aim.norm()))
    } else {
        frame
    };
    let score = |s: &RodState| {
        let g = supports.gaps(s);
        let place = (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt() / length;
        place + 0.3 * libm::hypot(g[3], g[4])
    };
    let mut best = rest_shape(elements, start, frame);
    let mut least = score(&best);
    for step in 0..=24 {
        let k = f64::from(step) * PI / 12.0 / length;
        let ways = if step == 0 { 1 } else { 8 };
        for way in 0..ways {
            let (sin, cos) = libm::sincos(f64::from(way) * PI / 4.0);
            let trial = arc(elements, start, frame, [k * cos, k * sin]);
            let found = score(&trial);
            // Only clear improvements count: the choice between symmetric shapes must not depend on rounding.
            if found < least - 1e-6 {
                (best, least) = (trial, found);
            }
        }
    }
    let straight = best.frames.iter().all(|f| f.t.dot(&frame.t) > 1.0 - 1e-9);
    if straight && supports.end_directions.len() == 3 {
        let slack = (1.0 - aim.norm() / length).max(0.0);
        if slack > 1e-12 {
            // A bow of amplitude A shortens by A²/4.
            let amplitude = 2.0 * slack.sqrt().min(0.7);
            let mut s = 0.0;
            let mut frames = Vec::with_capacity(elements.len() + 1);
            for i in 0..=elements.len() {
                let x = s / length;
                let shape = if supports.start_tangent { libm::sin(2.0 * PI * x) } else { libm::cos(PI * x) };
                frames.push(frame.transported(amplitude * shape, 0.0));
                s += elements.get(i).map_or(0.0, |e| e.length);
            }
            best = RodState::from_frames(elements, start, frames);
        }
    }
    best
}
