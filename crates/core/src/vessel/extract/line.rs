//! Centres a path through the lumen: each point becomes the centre of the largest inscribed sphere of its
//! cross-section.

use std::f64::consts::TAU;

use super::lumen::{Lumen, Sphere};
use crate::{Vec3, parallel};

/// Distance of points, in radii.
const SPACING_RADII: f64 = 0.25;
/// Number of rounds of smoothing, centring and resampling of a line.
const ROUNDS: usize = 2;
/// Smoothing passes per round.
const PASSES: usize = 6;
/// Final smoothing passes, and their steps; the second reverses the shrinkage of the first: Taubin, "A signal
/// processing approach to fair surface design", SIGGRAPH 1995.
const FAIRING: (usize, [f64; 2]) = (12, [0.5, -0.53]);
/// A point is smoothed only if its sphere keeps this fraction of its radius.
const LEAST_LEFT: f64 = 0.97;
/// Number of points before and behind that determine a line's direction.
const TANGENT_POINTS: usize = 2;
/// Steps in a cross-section: the first in radii, the number of halvings, directions, and the largest number of steps
/// of one length.
const FIRST_STEP_RADII: f64 = 0.2;
const HALVINGS: usize = 6;
const DIRECTIONS: usize = 6;
const MOST_STEPS: usize = 4;
/// Angle between the directions of steps of successive lengths.
const TURN: f64 = 0.4;

/// The centre line along a path, whose first and last points may be fixed.
pub(super) fn centred(lumen: &Lumen<'_>, way: &[Sphere], is_fixed: [bool; 2]) -> Vec<Sphere> {
    let mut line = divided(way);
    for _ in 0..ROUNDS {
        for _ in 0..PASSES {
            smooth(&mut line, 0.5);
        }
        line = divided(&in_the_middle(lumen, &line, is_fixed));
    }
    let line = in_the_middle(lumen, &line, is_fixed);
    let mut fair = line.clone();
    for _ in 0..FAIRING.0 {
        FAIRING.1.iter().for_each(|part| smooth(&mut fair, *part));
    }
    parallel::map(line.len(), |k| {
        let radius_mm = lumen.clearance_mm(&fair[k].centre_mm);
        match radius_mm >= LEAST_LEFT * line[k].radius_mm {
            true => Sphere { radius_mm, ..fair[k] },
            false => line[k],
        }
    })
}

/// The line with points at distances proportional to its radius, and its ends.
pub(super) fn divided(line: &[Sphere]) -> Vec<Sphere> {
    let [first, .., last] = line else { return line.to_vec() };
    // Positions are measured in spacings, from the first point on.
    let mut counted = vec![0.0];
    for pair in line.windows(2) {
        let radius_mm = 0.5 * (pair[0].radius_mm + pair[1].radius_mm);
        let spacings = (pair[1].centre_mm - pair[0].centre_mm).norm() / (SPACING_RADII * radius_mm);
        counted.push(counted[counted.len() - 1] + spacings);
    }
    let pieces = counted[counted.len() - 1].ceil().max(1.0);
    let step = counted[counted.len() - 1] / pieces;
    let mut points = vec![*first];
    let mut side = 0;
    for k in 1..pieces as usize {
        let at = step * k as f64;
        while counted[side + 1] < at && side + 2 < line.len() {
            side += 1;
        }
        let part = (at - counted[side]) / (counted[side + 1] - counted[side]).max(f64::MIN_POSITIVE);
        let (a, b) = (line[side], line[side + 1]);
        points.push(Sphere {
            centre_mm: a.centre_mm + (b.centre_mm - a.centre_mm) * part,
            radius_mm: a.radius_mm + (b.radius_mm - a.radius_mm) * part,
        });
    }
    points.push(*last);
    points
}

/// The first point of a line at least a radius away from its first one, or the last: where it comes from, seen from there.
pub(super) fn behind(line: &[Sphere]) -> Option<&Sphere> {
    let first = line.first()?;
    let is_away = |point: &&Sphere| (point.centre_mm - first.centre_mm).norm() >= first.radius_mm;
    line.iter().find(is_away).or(line.last())
}

/// Moves all points except the ends by a fraction of the way to the middle of their neighbours.
fn smooth(line: &mut [Sphere], part: f64) {
    let mut before = line.first().map_or_else(Vec3::zeros, |point| point.centre_mm);
    for k in 1..line.len().saturating_sub(1) {
        let here = line[k].centre_mm;
        line[k].centre_mm += (0.5 * (before + line[k + 1].centre_mm) - here) * part;
        before = here;
    }
}

/// The line with each point moved to the largest sphere in its cross-section.
fn in_the_middle(lumen: &Lumen<'_>, line: &[Sphere], is_fixed: [bool; 2]) -> Vec<Sphere> {
    let last = line.len() - 1;
    parallel::map(line.len(), |k| {
        let (before, after) = (k.saturating_sub(TANGENT_POINTS), (k + TANGENT_POINTS).min(last));
        let along = (line[after].centre_mm - line[before].centre_mm).try_normalize(0.0);
        match along.filter(|_| (k < last || !is_fixed[1]) && (k > 0 || !is_fixed[0])) {
            Some(along) => largest_across(lumen, &line[k], &along),
            None => {
                Sphere { radius_mm: lumen.clearance_mm(&line[k].centre_mm).max(line[k].radius_mm), ..line[k] }
            }
        }
    })
}

/// The largest sphere near one in the plane across a direction, by steps of decreasing length.
fn largest_across(lumen: &Lumen<'_>, sphere: &Sphere, along: &Vec3) -> Sphere {
    let e = along.cross(&Vec3::ith(along.iamin(), 1.0)).normalize();
    let f = along.cross(&e);
    let mut best = Sphere { radius_mm: lumen.clearance_mm(&sphere.centre_mm), ..*sphere };
    let worth_mm = |of: &Sphere| match lumen.stray_cost {
        0.0 => of.radius_mm,
        cost => of.radius_mm - cost * (of.centre_mm - sphere.centre_mm).norm(),
    };
    let mut step_mm = FIRST_STEP_RADII * sphere.radius_mm;
    for halving in 0..HALVINGS {
        for _ in 0..MOST_STEPS {
            let here = best;
            for direction in 0..DIRECTIONS {
                let angle = TAU * direction as f64 / DIRECTIONS as f64 + TURN * halving as f64;
                let centre_mm = here.centre_mm + (e * libm::cos(angle) + f * libm::sin(angle)) * step_mm;
                let tried = Sphere { centre_mm, radius_mm: lumen.clearance_mm(&centre_mm) };
                if worth_mm(&tried) > worth_mm(&best) {
                    best = tried;
                }
            }
            if best == here {
                break;
            }
        }
        step_mm *= 0.5;
    }
    best
}
