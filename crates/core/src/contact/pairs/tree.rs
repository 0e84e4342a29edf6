//! A hierarchy of boxes about the elements of a rod, in their order along it.
//!
//! Neighbours along the rod are neighbours in space, so repeated halving of the rod is a good hierarchy. An element
//! lies in the convex hull of its control points; while these move along straight lines, its motion lies in the hull
//! of their motions.

use super::curve::Curve;
use crate::Vec3;
use crate::rod::ElementData;

/// An element, or its displacement: four control points.
pub(super) type Controls = [Vec3; 4];

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
struct Extent {
    low: Vec3,
    high: Vec3,
}

impl Extent {
    const EMPTY: Self = Self {
        low: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        high: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    fn of(points: &Controls) -> Self {
        points.iter().fold(Self::EMPTY, |to, p| Self { low: to.low.inf(p), high: to.high.sup(p) })
    }

    fn with(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Smallest distance of points of two boxes.
    fn distance(&self, other: &Self) -> f64 {
        (self.low - other.high).sup(&(other.low - self.high)).sup(&Vec3::zeros()).norm()
    }

    /// Largest distance of points of two boxes.
    fn span(&self, other: &Self) -> f64 {
        (self.high - other.low).sup(&(other.high - self.low)).norm()
    }
}

/// Boxes about stretches of a rod, and about their motions.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    controls: Vec<Controls>,
    motions: Vec<Controls>,
    /// Boxes of positions and of motions for each half. The children of `i` are 2i + 1 and 2i + 2.
    boxes: Vec<[Extent; 2]>,
    /// Arc lengths at the ends of each element; each rod starts far behind the one before it.
    arcs: Vec<[f64; 2]>,
    /// Whether it is not an element but a gap between two rods.
    breaks: Vec<bool>,
    closed: bool,
    /// Largest number of halvings of an element before its bound is accepted.
    splits: usize,
}

/// Arc length between the end of a rod and the start of the next, mm: more than any reach.
const APART_MM: f64 = 1e3;

/// A stretch of elements, and the index of its box.
type Stretch = (usize, std::ops::Range<usize>);

fn halves((at, range): &Stretch) -> [Stretch; 2] {
    let middle = usize::midpoint(range.start, range.end);
    [(2 * at + 1, range.start..middle), (2 * at + 2, middle..range.end)]
}

/// Arc length of an element, mm; that of a gap between rods keeps them apart.
pub(super) fn arc_mm(element: &ElementData) -> f64 {
    if element.is_break() { APART_MM } else { element.length }
}

impl Tree {
    /// Places the hierarchy at the rods, without a motion.
    pub(super) fn place(&mut self, curve: &Curve<'_>) {
        let n = curve.elements.len();
        (self.closed, self.splits) = (curve.closed, curve.tuning.splits);
        self.controls.clear();
        self.controls.extend((0..n).map(|e| curve.controls(e)));
        self.motions.clear();
        self.motions.resize(n, [Vec3::zeros(); 4]);
        self.arcs.clear();
        self.breaks.clear();
        let mut end = 0.0;
        for e in 0..n {
            let begin = end;
            end += arc_mm(&curve.elements[e]);
            self.arcs.push([begin, end]);
            self.breaks.push(curve.is_break(e));
        }
        self.boxes.clear();
        self.boxes.resize(2 * n.next_power_of_two() * 2, [Extent::EMPTY; 2]);
        self.enclose(&(0, 0..n));
    }

    /// Sets the motion to the rods' positions in another state.
    pub(super) fn move_to(&mut self, curve: &Curve<'_>) {
        for (e, motion) in self.motions.iter_mut().enumerate() {
            let (to, from) = (curve.controls(e), &self.controls[e]);
            *motion = [0, 1, 2, 3].map(|k| to[k] - from[k]);
        }
        self.enclose(&(0, 0..self.controls.len()));
    }

    fn enclose(&mut self, stretch: &Stretch) -> [Extent; 2] {
        let found = if stretch.1.len() <= 1 {
            let e = stretch.1.start;
            let is_one = self.breaks.get(e).is_some_and(|is_break| !is_break);
            let of = |list: &[Controls]| if is_one { Extent::of(&list[e]) } else { Extent::EMPTY };
            [of(&self.controls), of(&self.motions)]
        } else {
            let [a, b] = halves(stretch).map(|half| self.enclose(&half));
            [a[0].with(&b[0]), a[1].with(&b[1])]
        };
        self.boxes[stretch.0] = found;
        found
    }

    /// Arc length from the first node to ξ of an element.
    pub(super) fn arc(&self, e: usize, xi: f64) -> f64 {
        let [begin, end] = self.arcs[e];
        begin + xi * (end - begin)
    }

    /// Whether two elements, the first before the second, are far enough apart along the rod to touch.
    fn may_touch(&self, a: usize, b: usize, apart: f64) -> bool {
        let around = self.arcs[a][0] + self.length() - self.arcs[b][1];
        a + 1 < b
            && self.arcs[b][0] - self.arcs[a][1] >= apart
            && !(self.closed && (a + self.arcs.len() == b + 1 || around < apart))
    }

    /// Total length.
    pub(super) fn length(&self) -> f64 {
        self.arcs.last().map_or(0.0, |last| last[1])
    }

    /// Arc length between two points, the shorter way round for a closed rod.
    pub(super) fn between(&self, a: f64, b: f64) -> f64 {
        let apart = (a - b).abs();
        if self.closed { apart.min(self.length() - apart) } else { apart }
    }

    /// Adds elements (a, b), a before b, that may be nearer to each other than the `reach` of both, at most `longest`,
    /// and are at least `apart` from each other along the rod.
    pub(super) fn near(
        &self,
        longest: f64,
        apart: f64,
        reach: impl Fn(usize, usize) -> f64,
        into: &mut Vec<(usize, usize)>,
    ) {
        into.clear();
        let is_near = |a: &Stretch, b: &Stretch| self.boxes[a.0][0].distance(&self.boxes[b.0][0]) < longest;
        let mut leaf = |a: usize, b: usize| {
            if self.may_touch(a, b, apart)
                && lower_distance(&self.controls[a], &self.controls[b]) < reach(a, b)
            {
                into.push((a, b));
            }
        };
        self.visit_within(&(0, 0..self.controls.len()), &is_near, &mut leaf);
    }

    /// Whether an element, except those of the first rod less than `behind` from its end, comes nearer to a segment
    /// than its `reach`.
    pub(super) fn is_near_segment(
        &self,
        (from, to): (&Vec3, &Vec3),
        behind: f64,
        reach: impl Fn(usize) -> f64,
    ) -> bool {
        let first = self.breaks.iter().position(|is_break| *is_break).unwrap_or(self.breaks.len());
        let length = first.checked_sub(1).map_or(0.0, |last| self.arcs[last][1]);
        let segment = [*from, from + (to - from) / 3.0, to - (to - from) / 3.0, *to];
        let mut others = (0..self.breaks.len())
            .filter(|e| !self.breaks[*e] && (*e > first || length - self.arcs[*e][1] >= behind));
        others.any(|e| is_near(&self.controls[e], &segment, reach(e), self.splits))
    }

    /// Fraction of the motion, at most 1, on which no two points of elements at least `apart` along the rod come
    /// nearer to each other by more than half their distance.
    pub(super) fn safe_part(&self, apart: f64) -> f64 {
        let part = std::cell::Cell::new(1.0f64);
        let is_near = |a: &Stretch, b: &Stretch| {
            let ([x, v], [y, w]) = (&self.boxes[a.0], &self.boxes[b.0]);
            x.distance(y) < 2.0 * part.get() * v.span(w)
        };
        let mut leaf = |a: usize, b: usize| {
            if self.may_touch(a, b, apart) {
                let one = (self.controls[a], self.motions[a]);
                let other = (self.controls[b], self.motions[b]);
                part.set(safe_part(&one, &other, part.get(), self.splits));
            }
        };
        self.visit_within(&(0, 0..self.controls.len()), &is_near, &mut leaf);
        part.get()
    }

    /// Pairs of elements within a stretch.
    fn visit_within(
        &self,
        stretch: &Stretch,
        is_near: &dyn Fn(&Stretch, &Stretch) -> bool,
        leaf: &mut dyn FnMut(usize, usize),
    ) {
        if stretch.1.len() <= 1 {
            return;
        }
        let [a, b] = halves(stretch);
        self.visit_within(&a, is_near, leaf);
        visit_between(&a, &b, is_near, leaf);
        self.visit_within(&b, is_near, leaf);
    }
}

/// Pairs of elements of two stretches.
fn visit_between(
    a: &Stretch,
    b: &Stretch,
    is_near: &dyn Fn(&Stretch, &Stretch) -> bool,
    leaf: &mut dyn FnMut(usize, usize),
) {
    if !is_near(a, b) {
        return;
    }
    if a.1.len() == 1 && b.1.len() == 1 {
        leaf(a.1.start, b.1.start);
    } else if a.1.len() >= b.1.len() {
        halves(a).iter().for_each(|half| visit_between(half, b, is_near, leaf));
    } else {
        halves(b).iter().for_each(|half| visit_between(a, half, is_near, leaf));
    }
}

/// Fraction of a motion that brings no two points of two curves nearer by more than half their distance; at most
/// `part`.
fn safe_part(a: &(Controls, Controls), b: &(Controls, Controls), part: f64, splits: usize) -> f64 {
    let span = Extent::of(&a.1).span(&Extent::of(&b.1));
    let distance = lower_distance(&a.0, &b.0);
    if distance >= 2.0 * part * span {
        return part;
    }
    let loose = bulge(&a.0) + bulge(&b.0) + 1e-12 * span;
    if splits == 0 || distance > 8.0 * loose {
        return (0.5 * distance.max(0.0) / span).min(part);
    }
    let halves = |c: &(Controls, Controls)| {
        let (x, v) = (split(&c.0), split(&c.1));
        [(x[0], v[0]), (x[1], v[1])]
    };
    let mut part = part;
    if bulge(&a.0) >= bulge(&b.0) {
        for half in halves(a) {
            part = safe_part(&half, b, part, splits - 1);
        }
    } else {
        for half in halves(b) {
            part = safe_part(a, &half, part, splits - 1);
        }
    }
    part
}

/// Whether a curve comes nearer to a segment than `reach`, up to its remaining bulge.
fn is_near(curve: &Controls, segment: &Controls, reach: f64, splits: usize) -> bool {
    if lower_distance(curve, segment) >= reach {
        return false;
    }
    splits == 0 || split(curve).iter().any(|half| is_near(half, segment, reach, splits - 1))
}

/// The two halves of a curve (de Casteljau).
fn split([a, b, c, d]: &Controls) -> [Controls; 2] {
    let mid = |p: &Vec3, q: &Vec3| (p + q) * 0.5;
    let (ab, bc, cd) = (mid(a, b), mid(b, c), mid(c, d));
    let (abc, bcd) = (mid(&ab, &bc), mid(&bc, &cd));
    let middle = mid(&abc, &bcd);
    [[*a, ab, abc, middle], [middle, bcd, cd, *d]]
}

/// Upper bound of the distance of a curve from its chord.
fn bulge([a, b, c, d]: &Controls) -> f64 {
    let chord = d - a;
    let square = chord.norm_squared();
    let off = |p: &Vec3| {
        let along = if square > 0.0 { ((p - a).dot(&chord) / square).clamp(0.0, 1.0) } else { 0.0 };
        (p - a - chord * along).norm()
    };
    off(b).max(off(c))
}

/// A lower bound of the distance of two curves.
fn lower_distance(a: &Controls, b: &Controls) -> f64 {
    segments(&a[0], &a[3], &b[0], &b[3]) - bulge(a) - bulge(b)
}

/// Distance of two segments (C. Ericson, *Real-Time Collision Detection*, 2005, section 5.1.9).
fn segments(a0: &Vec3, a1: &Vec3, b0: &Vec3, b1: &Vec3) -> f64 {
    let (u, v, w) = (a1 - a0, b1 - b0, a0 - b0);
    let (a, e, f) = (u.norm_squared(), v.norm_squared(), v.dot(&w));
    let (b, c) = (u.dot(&v), u.dot(&w));
    let det = a * e - b * b;
    let mut s = if det > 1e-14 * a * e { ((b * f - c * e) / det).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = if e > 0.0 { (b * s + f) / e } else { 0.0 };
    if !(0.0..=1.0).contains(&t) {
        t = t.clamp(0.0, 1.0);
        s = if a > 0.0 { ((b * t - c) / a).clamp(0.0, 1.0) } else { 0.0 };
    }
    (w + u * s - v * t).norm()
}

/// Smallest arc length between two touching pieces of a rod: half a turn of its smallest radius.
pub(super) fn half_turn(radius: f64) -> f64 {
    std::f64::consts::PI * radius
}
