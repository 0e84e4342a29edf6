//! Branches of a centre-line tree as smooth curves with a radius.
//!
//! Points are joined by a natural cubic spline over the chord length (twice continuously differentiable, straight
//! where the points are collinear), radii by the monotone cubic of Fritsch and Carlson, SIAM J. Numer. Anal. 17
//! (1980), which never overshoots. Both are resampled uniformly in arc length; between samples a cubic Hermite is
//! used, whose error of order ds⁴ is far below any mesh.

use std::f64::consts::FRAC_PI_3;

use crate::vessel::CentrelineTree;
use crate::{Error, Result, Vec3};

/// Samples per smallest radius of a branch.
const SAMPLES_PER_RADIUS: f64 = 4.0;

/// Largest number of samples of one branch. A branch 50,000 radii long is an error of units, not a vessel.
const MOST_SAMPLES: f64 = 200_000.0;

/// Largest number of branches of a tree, and of samples of all of them: a larger wall takes minutes and gigabytes.
const MOST_BRANCHES: usize = 5000;
const MOST_SAMPLES_IN_ALL: usize = 2_000_000;

/// Largest angle between a child and its parent for a continuation; beyond, the child is a branch of its own: the
/// spline would bend more tightly than the vessel is wide.
const SHARPEST_CONTINUATION: f64 = FRAC_PI_3;

/// Largest product of curvature and radius. At 1 the inner side of the bend folds over itself.
const TIGHTEST_BEND: f64 = 0.95;

/// Number of arc-length pieces per spline segment; with 3 Gauss points each, lengths are exact to about 1e-9.
const PIECES: usize = 16;

/// A sample of a branch.
#[derive(Debug, Clone, Copy)]
pub(in crate::vessel) struct Sample {
    /// Position, mm.
    pub(in crate::vessel) position: Vec3,
    /// Unit tangent.
    pub(in crate::vessel) tangent: Vec3,
    /// Radius, mm.
    pub(in crate::vessel) radius: f64,
    /// d radius / d arc length.
    pub(in crate::vessel) slope: f64,
}

/// A branch: from the root or a point on its parent's axis to a leaf, or to a sharp bifurcation.
#[derive(Debug, Clone)]
pub(in crate::vessel) struct Branch {
    /// At least two, equally spaced.
    pub(in crate::vessel) samples: Vec<Sample>,
    /// Spacing of samples in mm.
    pub(in crate::vessel) step: f64,
    /// Largest radius, including the straight extensions of its ends, mm.
    pub(in crate::vessel) thickest: f64,
    /// Row of the root, if the branch starts there: an open end.
    pub(in crate::vessel) root_row: Option<usize>,
    /// Row of the leaf, if the branch ends in an open one.
    pub(in crate::vessel) leaf_row: Option<usize>,
    /// The course at each sample, where a search for a foot starts.
    pub(in crate::vessel) at_samples: Vec<Course>,
}

/// Position and derivatives of a centre line at an arc length.
#[derive(Debug, Clone, Copy)]
pub(in crate::vessel) struct Course {
    pub(in crate::vessel) position: Vec3,
    pub(in crate::vessel) first: Vec3,
    pub(in crate::vessel) second: Vec3,
}

/// Position and derivatives at an arc length.
#[derive(Debug, Clone, Copy)]
pub(in crate::vessel) struct Place {
    pub(in crate::vessel) position: Vec3,
    pub(in crate::vessel) first: Vec3,
    pub(in crate::vessel) second: Vec3,
    pub(in crate::vessel) radius: f64,
    pub(in crate::vessel) slope: f64,
}

impl Branch {
    /// Length in mm.
    pub(super) fn length(&self) -> f64 {
        self.step * (self.samples.len() - 1) as f64
    }

    /// The curve at arc length `s`; beyond the ends it continues straight, with the same taper.
    pub(super) fn at(&self, s: f64) -> Place {
        let (Course { position, first, second }, (radius, slope)) = (self.course(s), self.width(s));
        Place { position, first, second, radius, slope }
    }

    /// [`Branch::at`] without the radius.
    pub(super) fn course(&self, s: f64) -> Course {
        if let Some((sample, beyond)) = self.beyond(s) {
            return Course {
                position: sample.position + beyond * sample.tangent,
                first: sample.tangent,
                second: Vec3::zeros(),
            };
        }
        let (a, b, t) = self.between(s);
        let h = self.step;
        let (t2, t3) = (t * t, t * t * t);
        let value = [t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2];
        let first = [3.0 * t2 - 4.0 * t + 1.0, 6.0 * t - 6.0 * t2, 3.0 * t2 - 2.0 * t];
        let second = [6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0];
        // Positions relative to the first sample, so that far-away anatomies lose no digits.
        let chord = b.position - a.position;
        let curve = |w: [f64; 3]| w[1] * chord + h * (w[0] * a.tangent + w[2] * b.tangent);
        Course {
            position: a.position + curve(value),
            first: curve(first) / h,
            second: curve(second) / (h * h),
        }
    }

    /// Radius and its slope at arc length `s`, as in [`Branch::at`].
    pub(super) fn width(&self, s: f64) -> (f64, f64) {
        if let Some((sample, beyond)) = self.beyond(s) {
            let radius = sample.radius + beyond * sample.slope;
            return (radius.clamp(0.5 * sample.radius, 2.0 * sample.radius), sample.slope);
        }
        let (a, b, t) = self.between(s);
        let h = self.step;
        let (t2, t3) = (t * t, t * t * t);
        let value = [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2];
        let first = [6.0 * t2 - 6.0 * t, 3.0 * t2 - 4.0 * t + 1.0, 6.0 * t - 6.0 * t2, 3.0 * t2 - 2.0 * t];
        let radius = |w: [f64; 4]| w[0] * a.radius + w[2] * b.radius + h * (w[1] * a.slope + w[3] * b.slope);
        (radius(value), radius(first) / h)
    }

    /// The end beyond which arc length `s` is, if any, and the distance beyond.
    fn beyond(&self, s: f64) -> Option<(&Sample, f64)> {
        if s < 0.0 {
            return Some((&self.samples[0], s));
        }
        (s > self.length()).then(|| (&self.samples[self.samples.len() - 1], s - self.length()))
    }

    /// The samples around arc length `s`, and the fraction of the way from one to the other.
    fn between(&self, s: f64) -> (&Sample, &Sample, f64) {
        let along = s / self.step;
        let index = (along as usize).min(self.samples.len() - 2);
        (&self.samples[index], &self.samples[index + 1], along - index as f64)
    }
}

/// Divides `tree` into branches. At a bifurcation the widest child (the straightest of equals) continues unless it
/// turns sharply; the others start on the parent's axis with their own radius.
pub(in crate::vessel) fn branches(tree: &CentrelineTree) -> Result<Vec<Branch>> {
    let (nodes, children) = (tree.nodes(), tree.children());
    let mut found: Vec<Branch> = Vec::new();
    let mut samples = 0;
    // (rows, whether the first is only the point where the branch leaves its parent)
    let mut pending = vec![(vec![0], false)];
    while let Some((mut rows, leaves_parent)) = pending.pop() {
        let mut last = rows[rows.len() - 1];
        if rows.len() == 1 && children[last].len() > 1 {
            // At a bifurcation at the root, the first piece is the one to the widest child all the same.
            let widest = continuation(tree, &children[last], None).unwrap_or(children[last][0]);
            pending.extend(children[last].iter().filter(|c| **c != widest).map(|&c| (vec![last, c], true)));
            rows.push(widest);
            last = widest;
        }
        loop {
            let direction =
                rows.len().checked_sub(2).map(|k| nodes[last].position_mm - nodes[rows[k]].position_mm);
            let next = match children[last].as_slice() {
                [] => None,
                [only] => Some(*only),
                many => continuation(tree, many, direction),
            };
            // Reversed, so that branches are in the order of their rows.
            let side = children[last].iter().rev().filter(|c| Some(**c) != next);
            pending.extend(side.map(|&c| (vec![last, c], true)));
            match next {
                Some(row) => rows.push(row),
                None => break,
            }
            last = rows[rows.len() - 1];
        }
        let end = match tree.joined_by(last) {
            _ if !children[last].is_empty() || tree.closed_ends().binary_search(&last).is_ok() => {
                Ending::Round
            }
            // Another branch ends where this one does.
            None if tree.links().iter().any(|link| link.joins == last) => Ending::Round,
            // It ends round within the branch that it joins, as it begins within the one that it leaves.
            Some(joined) => {
                rows.push(joined);
                Ending::Within
            }
            None => Ending::Open,
        };
        found.push(fit(tree, &rows, leaves_parent, end)?);
        samples += found[found.len() - 1].samples.len();
        if found.len() > MOST_BRANCHES || samples > MOST_SAMPLES_IN_ALL {
            let remedy = format!(
                "the first {} branches need {samples} samples of their course, and at most {MOST_BRANCHES} branches and \
                 {MOST_SAMPLES_IN_ALL} samples are taken: leave out thin branches, or check the units",
                found.len()
            );
            return Err(Error::parameter("centreline rows", nodes.len(), remedy));
        }
    }
    Ok(found)
}

/// How a branch ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ending {
    /// By an opening.
    Open,
    /// By a dome.
    Round,
    /// On the axis of another branch.
    Within,
}

/// The child that continues a branch with this direction.
fn continuation(tree: &CentrelineTree, children: &[usize], direction: Option<Vec3>) -> Option<usize> {
    let nodes = tree.nodes();
    let turn = |child: usize| {
        let parent = nodes[child].parent.unwrap_or(0);
        direction.map_or(0.0, |d| d.angle(&(nodes[child].position_mm - nodes[parent].position_mm)))
    };
    let better = |a: &usize, b: &usize| {
        let wider = nodes[*a].radius_mm.total_cmp(&nodes[*b].radius_mm);
        wider.then(turn(*b).total_cmp(&turn(*a))).then(b.cmp(a))
    };
    children.iter().copied().filter(|&c| turn(c) <= SHARPEST_CONTINUATION).max_by(better)
}

/// Fits and resamples the curve through `rows`.
fn fit(tree: &CentrelineTree, rows: &[usize], leaves_parent: bool, ending: Ending) -> Result<Branch> {
    let nodes = tree.nodes();
    let points: Vec<Vec3> = rows.iter().map(|&r| nodes[r].position_mm).collect();
    let mut radii: Vec<f64> = rows.iter().map(|&r| nodes[r].radius_mm).collect();
    if leaves_parent {
        // The branch is as wide at the parent's axis as at its own first point, but never protrudes from the parent's
        // far side.
        radii[0] = radii[0].min(radii[1]);
    }
    if let (Ending::Within, [.., before, end]) = (ending, radii.as_mut_slice()) {
        *end = end.min(*before);
    }
    let spline = Spline::new(&points, &radii);
    let (length, smallest) = (spline.length(), radii.iter().copied().fold(f64::INFINITY, f64::min));
    let count = (length * SAMPLES_PER_RADIUS / smallest).ceil().max(2.0);
    if count > MOST_SAMPLES {
        return Err(Error::parameter(
            format!("centreline row {}, radius", rows[1]),
            smallest,
            format!("a branch {length} mm long cannot be so thin; check the units"),
        ));
    }
    let step = length / count;
    let mut samples = Vec::with_capacity(count as usize + 1);
    for index in 0..=count as usize {
        let (u, segment) = spline.parameter_at(step * index as f64);
        let place = spline.at(segment, u);
        let speed = place.first.norm();
        let curvature = place.first.cross(&place.second).norm() / speed.powi(3);
        if curvature * place.radius >= TIGHTEST_BEND {
            let row = rows[if u > 0.5 * spline.chords[segment] { segment + 1 } else { segment }];
            return Err(Error::parameter(
                format!("centreline row {row}, bend radius in mm"),
                format!("{:.3}", 1.0 / curvature),
                format!(
                    "must exceed the vessel's radius, {:.3} mm here: smooth or thin out the centre line",
                    place.radius
                ),
            ));
        }
        samples.push(Sample {
            position: place.position,
            tangent: place.first / speed,
            radius: place.radius,
            slope: place.slope / speed,
        });
    }
    let mut branch = Branch {
        samples,
        step,
        root_row: (!leaves_parent).then_some(rows[0]),
        leaf_row: (ending == Ending::Open).then_some(rows[rows.len() - 1]),
        at_samples: Vec::new(),
        thickest: 0.0,
    };
    let radii = branch.samples.iter().map(|sample| sample.radius);
    let beyond = [f64::MIN, f64::MAX].map(|s| branch.width(s).0);
    branch.thickest = radii.chain(beyond).fold(0.0, f64::max);
    branch.at_samples = (0..branch.samples.len()).map(|k| branch.course(step * k as f64)).collect();
    Ok(branch)
}

/// A natural cubic spline over chord length, with a monotone cubic for the radius.
struct Spline {
    points: Vec<Vec3>,
    /// Second derivatives at the points.
    moments: Vec<Vec3>,
    radii: Vec<f64>,
    slopes: Vec<f64>,
    chords: Vec<f64>,
    /// Arc length at the start of each piece, and at the end.
    arc: Vec<f64>,
}

impl Spline {
    fn new(points: &[Vec3], radii: &[f64]) -> Self {
        let chords: Vec<f64> = points.windows(2).map(|p| (p[1] - p[0]).norm()).collect();
        let mut spline = Self {
            moments: natural_moments(points, &chords),
            slopes: monotone_slopes(radii, &chords),
            points: points.to_vec(),
            radii: radii.to_vec(),
            arc: vec![0.0],
            chords,
        };
        let mut total = 0.0;
        for segment in 0..spline.chords.len() {
            let piece = spline.chords[segment] / PIECES as f64;
            for k in 0..PIECES {
                total += spline.arc_between(segment, piece * k as f64, piece * (k + 1) as f64);
                spline.arc.push(total);
            }
        }
        spline
    }

    fn length(&self) -> f64 {
        self.arc[self.arc.len() - 1]
    }

    /// Arc length between two parameters of a segment, by 3 Gauss points.
    fn arc_between(&self, segment: usize, from: f64, to: f64) -> f64 {
        let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
        let offset = 0.6_f64.sqrt() * half;
        let speed = |u: f64| self.at(segment, u).first.norm();
        half * (5.0 * speed(middle - offset) + 8.0 * speed(middle) + 5.0 * speed(middle + offset)) / 9.0
    }

    /// Parameter and segment at arc length `s`, by Newton's method from the piece that contains it.
    fn parameter_at(&self, s: f64) -> (f64, usize) {
        let piece = self.arc.partition_point(|&start| start <= s).clamp(1, self.arc.len() - 1) - 1;
        let segment = piece / PIECES;
        let width = self.chords[segment] / PIECES as f64;
        let start = width * (piece % PIECES) as f64;
        let span = (self.arc[piece + 1] - self.arc[piece]).max(f64::MIN_POSITIVE);
        let mut u = start + width * ((s - self.arc[piece]) / span).clamp(0.0, 1.0);
        for _ in 0..3 {
            let miss = self.arc[piece] + self.arc_between(segment, start, u) - s;
            u = (u - miss / self.at(segment, u).first.norm().max(1e-12)).clamp(start, start + width);
        }
        (u, segment)
    }

    /// The spline at parameter `u` (0 to the chord) of a segment.
    fn at(&self, segment: usize, u: f64) -> Place {
        let (h, a, b) = (self.chords[segment], self.points[segment], self.points[segment + 1]);
        let (ma, mb) = (self.moments[segment], self.moments[segment + 1]);
        let slope = (b - a) / h - h / 6.0 * (2.0 * ma + mb);
        let jerk = (mb - ma) / h;
        let (t, width) = (u / h, h);
        let (ra, rb) = (self.radii[segment], self.radii[segment + 1]);
        let (sa, sb) = (self.slopes[segment] * width, self.slopes[segment + 1] * width);
        let (quadratic, cubic) = (3.0 * (rb - ra) - 2.0 * sa - sb, 2.0 * (ra - rb) + sa + sb);
        Place {
            position: a + u * (slope + u * (ma / 2.0 + u / 6.0 * jerk)),
            first: slope + u * (ma + u / 2.0 * jerk),
            second: ma + u * jerk,
            radius: ra + t * (sa + t * (quadratic + t * cubic)),
            slope: (sa + t * (2.0 * quadratic + 3.0 * t * cubic)) / width,
        }
    }
}

/// Second derivatives of the natural cubic spline: a tridiagonal, diagonally dominant system (Thomas algorithm).
pub(in crate::vessel) fn natural_moments(points: &[Vec3], chords: &[f64]) -> Vec<Vec3> {
    let count = points.len();
    let mut moments = vec![Vec3::zeros(); count];
    let mut factor = vec![0.0; count];
    for k in 1..count - 1 {
        let (before, after) = (chords[k - 1], chords[k]);
        let bend = (points[k + 1] - points[k]) / after - (points[k] - points[k - 1]) / before;
        let pivot = 2.0 * (before + after) - before * factor[k - 1];
        factor[k] = after / pivot;
        moments[k] = (6.0 * bend - before * moments[k - 1]) / pivot;
    }
    for k in (1..count - 1).rev() {
        let next = moments[k + 1];
        moments[k] -= factor[k] * next;
    }
    moments
}

/// Slopes of the monotone cubic (Fritsch–Carlson, in Butland's harmonic-mean form); the first and last secants at the
/// ends, so that two points give a cone.
fn monotone_slopes(radii: &[f64], chords: &[f64]) -> Vec<f64> {
    let secant: Vec<f64> = chords.iter().enumerate().map(|(k, h)| (radii[k + 1] - radii[k]) / h).collect();
    let mut slopes = vec![0.0; radii.len()];
    (slopes[0], slopes[radii.len() - 1]) = (secant[0], secant[secant.len() - 1]);
    for k in 1..secant.len() {
        let (a, b) = (secant[k - 1], secant[k]);
        if a * b > 0.0 {
            let (wa, wb) = (2.0 * chords[k] + chords[k - 1], chords[k] + 2.0 * chords[k - 1]);
            slopes[k] = (wa + wb) / (wa / a + wb / b);
        }
    }
    slopes
}
