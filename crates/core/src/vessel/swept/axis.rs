//! The axis of a branch for contact: its course and radius.
//!
//! The course is the natural cubic spline through the samples from which a mesh is made ([`Branch`]). The branch
//! itself joins them by separate cubics: between those the curvature jumps slightly, and with it the slope of the
//! wall of a tapering branch. Both pass through the same points and differ by the fourth power of the samples'
//! distance.
//!
//! The foot of a point, where its distance from the course is least, decides which circle it is compared with. A
//! search along the course that ends before it yields a circle that passes elsewhere: in a lumen that narrows from
//! there towards the foot a larger one, and the wall appears farther than it is. So a search goes on until it is at a
//! foot, however far away it begins ([`Axis::nearest`], [`Axis::foot`]).
//!
//! Between knots the radius and its slope are polynomials, and so at most as large as the largest of their Bernstein
//! coefficients: for radii a, b and slopes a′, b′ over a length h these are a, a + h a′/3, b − h b′/3, b, and
//! a′, 3 (b − a)/h − a′ − b′, b′.

use crate::Vec3;
use crate::vessel::generate::curve::{Branch, natural_moments};

/// Largest taper of the extension of an open end: its radius changes by at most 4/27 of it.
const STEEPEST: f64 = 0.67;
/// Largest number of Newton steps to the foot of a point: from the nearest knot, an eighth of the radius away, three
/// are enough.
const FOOT_STEPS: usize = 8;
/// Stride, in knots, of the coarse search for the nearest one, where it is unknown by some radii; and number of steps
/// from there.
const COARSE: usize = 16;
/// See [`COARSE`].
const JUMPS: usize = 4;
/// Length of the last of these steps, in distances of the samples: the remaining error is of the order of its square.
const FOOT: f64 = 1e-6;

/// A knot of the spline, and the cubics from there to the next.
#[derive(Debug, Clone, Copy)]
struct Knot {
    position: Vec3,
    /// Derivative of the course, of nearly unit length.
    tangent: Vec3,
    /// Second derivative, 1/mm.
    moment: Vec3,
    /// Third derivative up to the next knot, 1/mm².
    third: Vec3,
    radius: f64,
    /// Slope of the radius.
    slope: f64,
    /// Coefficients of the square and the cube of the distance in the radius.
    flare: [f64; 2],
}

/// The knot nearest to a point, of those about it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct NearKnot {
    /// Its distance, mm.
    pub(super) away: f64,
    pub(super) knot: usize,
    /// An arc length near the foot of the point.
    pub(super) near: f64,
}

/// The kind of an axis's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum End {
    /// A hemisphere: a sac's dome, or an end that is hidden in another branch.
    Round,
    /// Open: the tube continues straight for this length, mm, and ends in a hemisphere out of reach.
    Open(f64),
}

impl End {
    /// Length of the extension, mm.
    fn beyond_mm(self) -> f64 {
        match self {
            Self::Round => 0.0,
            Self::Open(beyond_mm) => beyond_mm,
        }
    }
}

/// Course and radius, with derivatives by arc length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) position: Vec3,
    pub(super) first: Vec3,
    pub(super) second: Vec3,
    pub(super) third: Vec3,
    pub(super) radius: [f64; 3],
}

impl Place {
    /// Shifts it by a small arc length.
    fn shift(&mut self, by: f64) {
        self.position += (self.first + (self.second * 0.5 + self.third * (by / 6.0)) * by) * by;
        self.first += (self.second + self.third * (0.5 * by)) * by;
        self.second += self.third * by;
        let [_, slope, flare] = self.radius;
        self.radius[0] += (slope + 0.5 * flare * by) * by;
        self.radius[1] += flare * by;
    }
}

/// The axis of a branch.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    knots: Vec<Knot>,
    /// Distance of the knots, mm.
    step: f64,
    pub(super) ends: [End; 2],
}

impl Axis {
    pub(super) fn new(branch: &Branch, ends: [End; 2]) -> Self {
        let positions: Vec<Vec3> = branch.samples.iter().map(|sample| sample.position).collect();
        let widths: Vec<(f64, f64)> =
            branch.samples.iter().map(|sample| (sample.radius, sample.slope)).collect();
        Self::through(&positions, &widths, branch.step, ends)
    }

    /// Through positions about `step` mm apart, with the radius there and its slope. At least two.
    pub(super) fn through(positions: &[Vec3], widths: &[(f64, f64)], step: f64, ends: [End; 2]) -> Self {
        let moments = natural_moments(positions, &vec![step; positions.len() - 1]);
        let last = positions.len() - 1;
        let h = step;
        let knots = widths.iter().enumerate().map(|(k, &(radius, slope))| {
            let (next_radius, next_slope) = widths[(k + 1).min(last)];
            let (rise, sa, sb) = (next_radius - radius, slope * h, next_slope * h);
            Knot {
                position: positions[k],
                tangent: spline_slope(positions, &moments, step, k),
                moment: moments[k],
                third: (moments[(k + 1).min(last)] - moments[k]) / h,
                radius,
                slope,
                flare: [(3.0 * rise - 2.0 * sa - sb) / (h * h), (sa + sb - 2.0 * rise) / (h * h * h)],
            }
        });
        Self { knots: knots.collect(), step: h, ends }
    }

    /// Number of knots.
    pub(super) fn len(&self) -> usize {
        self.knots.len()
    }

    /// Distance of the knots, mm.
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// Length without extensions, mm.
    pub(super) fn length(&self) -> f64 {
        self.step * (self.knots.len() - 1) as f64
    }

    pub(super) fn position(&self, knot: usize) -> Vec3 {
        self.knots[knot].position
    }

    pub(super) fn radius(&self, knot: usize) -> f64 {
        self.knots[knot].radius
    }

    /// Whether the axis exists on both sides of a knot, without an extension near it.
    pub(super) fn is_inner(&self, knot: usize) -> bool {
        (knot > 0 || self.ends[0] == End::Round)
            && (knot + 1 < self.knots.len() || self.ends[1] == End::Round)
    }

    /// Upper bounds of the radius, mm, and of the size of its slope, from a knot to the next.
    fn largest(&self, knot: usize) -> (f64, f64) {
        let (a, b) = (&self.knots[knot], &self.knots[knot + 1]);
        let between = [a.radius + self.step * a.slope / 3.0, b.radius - self.step * b.slope / 3.0];
        let slope = 3.0 * (b.radius - a.radius) / self.step - a.slope - b.slope;
        (
            between.into_iter().fold(a.radius.max(b.radius), f64::max),
            [b.slope, slope].into_iter().map(f64::abs).fold(a.slope.abs(), f64::max),
        )
    }

    /// Upper bound of the radius from one knot to another, mm, without extensions.
    pub(super) fn widest(&self, from: usize, to: usize) -> f64 {
        (from..to).map(|knot| self.largest(knot).0).fold(self.radius(to), f64::max)
    }

    /// Upper bound of the slope of this branch's field in its lumen, relative to a distance.
    ///
    /// With the field's gradient u − r′ σ c′, u ⊥ c′, its square is 1 + (r′ σ |c′|)²; in the lumen
    /// 1/σ ≥ |c′|² − r |c″|, and |c′| is nearly 1. The second derivative is linear between knots.
    pub(super) fn steepness(&self) -> f64 {
        let of = |k: usize| {
            let (radius, slope) = self.largest(k);
            let bend = self.knots[k].moment.norm().max(self.knots[k + 1].moment.norm());
            let along = slope / (1.0 - radius * bend).max(0.05);
            (1.0 + along * along).sqrt()
        };
        (0..self.knots.len() - 1).map(of).fold(1.0, f64::max)
    }

    /// The knot nearest to an arc length.
    pub(super) fn knot_at(&self, s: f64) -> usize {
        ((s / self.step).round().max(0.0) as usize).min(self.knots.len() - 1)
    }

    /// Range of arc lengths with a wall.
    pub(super) fn range(&self) -> [f64; 2] {
        [-self.ends[0].beyond_mm(), self.length() + self.ends[1].beyond_mm()]
    }

    /// Course and radius at an arc length.
    pub(super) fn at(&self, s: f64) -> Place {
        let length = self.length();
        if s < 0.0 {
            return self.beyond(0, s, -s);
        }
        if s > length {
            return self.beyond(self.knots.len() - 1, s - length, s - length);
        }
        let k = ((s / self.step) as usize).min(self.knots.len() - 2);
        let Knot { position, tangent, moment, third, radius, slope, flare: [quadratic, cubic] } =
            self.knots[k];
        let u = s - self.step * k as f64;
        // Positions relative to a knot, so that far-away anatomies lose no digits.
        let position = position + (tangent + (moment * 0.5 + third * (u / 6.0)) * u) * u;
        let first = tangent + (moment + third * (0.5 * u)) * u;
        let second = moment + third * u;
        let radius = [
            radius + u * (slope + u * (quadratic + u * cubic)),
            slope + u * (2.0 * quadratic + 3.0 * u * cubic),
            2.0 * quadratic + 6.0 * u * cubic,
        ];
        Place { position, first, second, third, radius }
    }

    /// Straight on from a knot at an end, by `along` along the axis and `way` mm outwards. The taper decreases over a
    /// radius, x(w) = w (1 − w/R)², as in the extensions of surfaces.
    fn beyond(&self, knot: usize, along: f64, way: f64) -> Place {
        let Knot { position, tangent, radius, slope, .. } = self.knots[knot];
        let (outwards, x) = (along.signum(), (way / radius).min(1.0));
        let taper = (slope * outwards).clamp(-STEEPEST, STEEPEST);
        let radius = [
            radius + taper * way * (1.0 - x) * (1.0 - x),
            outwards * taper * (1.0 - x) * (1.0 - 3.0 * x),
            if x < 1.0 { taper * (6.0 * x - 4.0) / radius } else { 0.0 },
        ];
        Place {
            position: position + tangent * along,
            first: tangent,
            second: Vec3::zeros(),
            third: Vec3::zeros(),
            radius,
        }
    }

    /// Arc length of the foot of a point, and the place there: the one towards which its distance decreases from an
    /// arc length.
    pub(super) fn foot(&self, x: &Vec3, near: f64) -> (f64, Place) {
        let ([low, high], length) = (self.range(), self.length());
        let mut s = near.clamp(low, high);
        let mut place = self.at(s);
        let mut is_near = false;
        for _ in 0..FOOT_STEPS {
            let offset = x - place.position;
            let is_inner = s > 0.0 && s < length;
            let limit = if is_inner { self.step } else { f64::INFINITY };
            let change = offset.dot(&place.first) / stretch(&place, &offset);
            if is_inner && change.abs() > self.step && !std::mem::replace(&mut is_near, true) {
                s = self.step * self.follow(x, self.knot_at(s)) as f64;
                place = self.at(s);
                continue;
            }
            let next = (s + change.clamp(-limit, limit)).clamp(low, high);
            let moved = next - s;
            s = next;
            if moved.abs() <= FOOT * self.step {
                place.shift(moved);
                break;
            }
            place = self.at(s);
        }
        (s, place)
    }

    /// A knot near a foot of a point, its distance, mm, and an arc length nearer to the foot, sought from these knots
    /// on: if the foot is beyond them, so is the knot. For a branch that returns to where it was, that of the stretch
    /// whose middle is nearest.
    pub(super) fn nearest(&self, x: &Vec3, from: usize, to: usize) -> NearKnot {
        let away = |k: usize| (self.knots[k].position - x).norm_squared();
        let (mut knot, mut least) = (to, away(to));
        for k in (from..to).step_by(COARSE) {
            let here = away(k);
            if here < least {
                (knot, least) = (k, here);
            }
        }
        // Newton steps, in knots.
        let jump = |k: usize| {
            let Knot { position, tangent, moment, .. } = &self.knots[k];
            let offset = x - position;
            let stretch = (tangent.norm_squared() - offset.dot(moment)).max(0.25);
            offset.dot(tangent) / (stretch * self.step)
        };
        // These come close; single knots cover the rest.
        for _ in 0..JUMPS {
            let by = jump(knot).clamp(-(COARSE as f64), COARSE as f64);
            let next = (knot as f64 + by.round()).clamp(from as f64, to as f64) as usize;
            let here = away(next);
            if here >= least {
                break;
            }
            (knot, least) = (next, here);
        }
        let knot = self.follow(x, knot);
        let near = self.step * (knot as f64 + jump(knot).clamp(-1.0, 1.0));
        NearKnot { away: away(knot).sqrt(), knot, near }
    }

    /// The knot nearest to a point of those about it, following the axis from another.
    pub(super) fn follow(&self, x: &Vec3, from: usize) -> usize {
        let away = |k: usize| (self.knots[k].position - x).norm_squared();
        let mut k = from;
        loop {
            let here = away(k);
            k = match k {
                _ if k + 1 < self.knots.len() && away(k + 1) < here => k + 1,
                _ if k > 0 && away(k - 1) < here => k - 1,
                _ => return k,
            };
        }
    }
}

/// First derivative at a knot of the natural spline through points `step` apart with these second derivatives.
pub(super) fn spline_slope(points: &[Vec3], moments: &[Vec3], step: f64, knot: usize) -> Vec3 {
    let a = knot.min(points.len() - 2);
    let b = a + 1;
    let chord = (points[b] - points[a]) / step;
    let bend = if knot == a { moments[a] * -2.0 - moments[b] } else { moments[a] + moments[b] * 2.0 };
    chord + bend * (step / 6.0)
}

/// Half the second derivative of the squared distance from the axis; positive at a foot, since bends are wider than the vessel.
pub(super) fn stretch(place: &Place, offset: &Vec3) -> f64 {
    (place.first.norm_squared() - offset.dot(&place.second)).max(0.05)
}
