//! A vessel tree as an implicit surface: negative in the lumen, zero on the wall.
//!
//! Each branch is f = |p − c(s*)| − r(s*), where s* is the foot of p on the centre line: the surface swept by circles
//! of radius r across the curve, exactly as the swept tube. Branches are joined by a smooth minimum of compact
//! support (the cubic polynomial of Quilez, "Smooth minimum"), which changes nothing where the branches differ by
//! more than the blend width, so a vessel keeps its radius away from bifurcations. Where one branch starts inside
//! another, their surfaces are nearly parallel and a plain smooth union would bulge; so the width fades out as the
//! gradients align (Gourmel et al., "A gradient-based implicit blend", ACM TOG 32, 2013).

use std::sync::Arc;

use super::curve::Branch;
use crate::Vec3;

/// Blend width relative to the radius of the thinner branch: gives a fillet of about that radius at a right-angled
/// bifurcation.
pub(in crate::vessel) const BLEND: f64 = 1.4;

/// Cosines of the angle between gradients at which blending begins and is complete: 20° and 60°.
pub(in crate::vessel) const BLEND_COSINES: [f64; 2] = [0.94, 0.5];

/// Length, in radii, over which blending increases behind a closed end. Such an end is hidden inside another branch;
/// if its round cap blended, the other branch would bulge over it.
pub(in crate::vessel) const HIDDEN: f64 = 0.3;

/// Largest number of Newton steps to the foot; from a sample a quarter radius away three are enough.
const FOOT_STEPS: usize = 8;

/// Length of the last Newton step to the foot, in steps of the samples: the remaining error is of the order of its
/// square, which is rounding.
const FOOT: f64 = 1e-7;

/// Relative error of distances used for culling.
const ROUNDING: f64 = 1e-12;

/// The implicit surface of a tree.
#[derive(Debug)]
pub(super) struct Field {
    pub(super) branches: Vec<Branch>,
    /// Length of the straight extension of open ends before a flat end, mm. The mesh is cut at the true end.
    pub(super) extension: f64,
    steepness: f64,
}

/// Value, gradient (approximate where branches blend) and local radius at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Value {
    pub(super) f: f64,
    pub(super) gradient: Vec3,
    pub(super) radius: f64,
    /// Degree of blending: 0 at a hidden end, 1 away from it.
    exposure: f64,
}

/// The relevant part of the tree near a ball: per branch the samples that can be closest to a point of the ball.
#[derive(Debug, Clone)]
pub(super) struct Local {
    parts: Vec<(usize, Vec<u32>)>,
    centre: Vec3,
    reach: f64,
    /// Parts by their values at the centre, smallest first.
    order: Vec<Ranked>,
    /// Upper bound of how far blends of all but the first can lie below their smallest value.
    sag: f64,
    /// The superset for a larger ball.
    wider: Option<Arc<Local>>,
}

/// A part of those near a ball.
#[derive(Debug, Clone, Copy)]
struct Ranked {
    part: usize,
    /// Its value at the centre.
    value: f64,
    /// Upper bound of the width of a blend with it or with one ranked behind it, mm: its radius may be the thinner
    /// one.
    widest: f64,
}

/// Values of the branches near a point.
#[derive(Debug)]
pub(super) struct Sounding {
    at: Vec3,
    /// The nearest sample of each.
    feet: Vec<u32>,
    /// The value of each.
    here: Vec<Value>,
}

/// The smooth minimum of values, in their order.
fn blended(mut values: impl Iterator<Item = Value>) -> Value {
    let none = Value { f: f64::INFINITY, gradient: Vec3::zeros(), radius: 1.0, exposure: 0.0 };
    let first = values.next().unwrap_or(none);
    values.fold(first, smooth_minimum)
}

impl Local {
    fn new(
        branches: &[Branch],
        parts: Vec<(usize, Vec<u32>)>,
        at_centre: &[Value],
        centre: Vec3,
        reach: f64,
    ) -> Self {
        let rank = |(part, value): (usize, &Value)| Ranked {
            part,
            value: value.f,
            widest: BLEND * branches[parts[part].0].thickest,
        };
        let mut order: Vec<Ranked> = at_centre.iter().enumerate().map(rank).collect();
        order.sort_by(|a, b| a.value.total_cmp(&b.value));
        let mut behind = 0.0_f64;
        for ranked in order.iter_mut().rev() {
            behind = behind.max(ranked.widest);
            ranked.widest = behind;
        }
        // Each blend of two lowers the smaller one by at most a sixth of its width.
        let widest =
            order.iter().skip(1).map(|ranked| BLEND * at_centre[ranked.part].radius).fold(0.0, f64::max);
        let sag = widest / 6.0 * parts.len().saturating_sub(2) as f64;
        Self { parts, centre, reach, order, sag, wider: None }
    }

    /// The narrowest set valid at `point`.
    fn around(&self, point: &Vec3) -> &Self {
        let mut local = self;
        while let Some(wider) = &local.wider {
            if (point - local.centre).norm() <= local.reach {
                break;
            }
            local = wider;
        }
        local
    }
}

impl Field {
    pub(super) fn new(branches: Vec<Branch>, extension: f64) -> Self {
        let slopes = branches.iter().flat_map(|b| b.samples.iter().map(|s| s.slope.abs()));
        let steepness = 1.5 + 2.0 * slopes.fold(0.0, f64::max);
        Self { branches, extension, steepness }
    }

    /// An upper bound of the field's slope, for culling.
    pub(super) fn steepness(&self) -> f64 {
        self.steepness
    }

    /// The relevant part within `reach` of `centre`.
    pub(super) fn local(&self, centre: &Vec3, reach: f64) -> Local {
        let mut parts = Vec::new();
        for (index, branch) in self.branches.iter().enumerate() {
            parts.push((index, near(branch, centre, 2.0 * reach)));
        }
        // Branches too far away to blend with anything in the ball are omitted; their samples do not change the
        // value.
        let here: Vec<Value> = parts.iter().map(|part| self.branch_value(part, centre)).collect();
        let least = here.iter().map(|v| v.f).fold(f64::INFINITY, f64::min);
        let slack = 2.0 * self.steepness() * reach;
        let matters = |v: &Value| v.f <= least + slack + BLEND * v.radius;
        let (parts, here): (Vec<_>, Vec<_>) = parts.into_iter().zip(here).filter(|(_, v)| matters(v)).unzip();
        Local::new(&self.branches, parts, &here, *centre, reach)
    }

    /// `wide` restricted to a ball inside its own: the same branches, each omitted or not by its value at a point,
    /// with fewer samples. The field has the same bits.
    pub(super) fn narrowed(&self, wide: &Arc<Local>, sounding: &Sounding, reach: f64) -> Local {
        let Sounding { at, feet, here } = sounding;
        let nearer = |((index, samples), &nearest): (&(usize, Vec<u32>), &u32)| {
            let branch = &self.branches[*index];
            let distance = |k: u32| (branch.samples[k as usize].position - at).norm();
            let limit = distance(nearest) + 2.0 * reach;
            (*index, samples.iter().copied().filter(|&k| distance(k) <= limit).collect())
        };
        let parts = wide.parts.iter().zip(feet).map(nearer).collect();
        Local { wider: Some(Arc::clone(wide)), ..Local::new(&self.branches, parts, here, *at, reach) }
    }

    /// All branches of `local` at a point, one by one.
    pub(super) fn sound(&self, local: &Local, at: &Vec3) -> Sounding {
        let foot = |(index, samples): &(usize, Vec<u32>)| {
            let nearest = nearest_of(&self.branches[*index], samples, at);
            (nearest, self.value_from(*index, nearest, at))
        };
        let (feet, here) = local.parts.iter().map(foot).unzip();
        Sounding { at: *at, feet, here }
    }

    /// The field at `point`, which must be within the reach of `local` or of what is wider.
    pub(super) fn value(&self, local: &Local, point: &Vec3) -> Value {
        let local = local.around(point);
        self.value_of_near(local, point).unwrap_or_else(|| self.value_of_all(local, point))
    }

    /// As [`Self::value`], from all branches of `local`.
    pub(super) fn value_of_all(&self, local: &Local, point: &Vec3) -> Value {
        blended(local.parts.iter().map(|part| self.branch_value(part, point)))
    }

    /// The field from the few branches that reach `point`: if no other branch or blend is near enough to blend with
    /// these, the minimum is bitwise theirs. `None` if more of them are needed.
    fn value_of_near(&self, local: &Local, point: &Vec3) -> Option<Value> {
        let change = self.steepness * (point - local.centre).norm();
        let mut near: [Option<(usize, Value)>; FEW] = [None; FEW];
        let (mut count, mut highest, mut widest) = (0, f64::NEG_INFINITY, 0.0_f64);
        // The smallest value of those omitted, and the largest width of a blend with them.
        let mut others = (f64::INFINITY, 0.0_f64);
        for ranked in &local.order {
            let reached = |f: f64| count == 0 || f - local.sag <= highest + widest.min(ranked.widest);
            let least = ranked.value - change;
            if !reached(least) {
                others = (others.0.min(least), others.1.max(ranked.widest));
                break;
            }
            let value = self.branch_value(&local.parts[ranked.part], point);
            if !reached(value.f) {
                others = (others.0.min(value.f), others.1.max(ranked.widest));
                continue;
            }
            *near.get_mut(count)? = Some((ranked.part, value));
            count += 1;
            highest = highest.max(value.f);
            widest = widest.max(BLEND * value.radius);
        }
        if others.0 - local.sag <= highest + widest.min(others.1) {
            return None;
        }
        near[..count].sort_by_key(|kept| kept.map(|(k, _)| k));
        near.into_iter().flatten().map(|(_, value)| value).reduce(smooth_minimum)
    }

    /// The field of one branch alone, all samples considered.
    pub(super) fn branch_alone(&self, branch: usize, point: &Vec3) -> Value {
        self.branch_value(&(branch, (0..self.branches[branch].samples.len() as u32).collect()), point)
    }

    fn branch_value(&self, (index, samples): &(usize, Vec<u32>), point: &Vec3) -> Value {
        self.value_from(*index, nearest_of(&self.branches[*index], samples, point), point)
    }

    /// The value of a branch, given its nearest sample.
    fn value_from(&self, index: usize, nearest: u32, point: &Vec3) -> Value {
        let branch = &self.branches[index];
        let (low, high) = (branch.root_row.is_some(), branch.leaf_row.is_some());
        let ends =
            (if low { f64::NEG_INFINITY } else { 0.0 }, if high { f64::INFINITY } else { branch.length() });
        let centre = branch.step * f64::from(nearest);
        let mut s = centre;
        let mut course = branch.at_samples[nearest as usize];
        let mut stretch = 1.0;
        for _ in 0..FOOT_STEPS {
            let offset = point - course.position;
            // The derivative of the squared distance; positive near the foot because bends are wider than the vessel.
            stretch = (course.first.norm_squared() - offset.dot(&course.second)).max(0.05);
            let inner = s > 0.0 && s < branch.length();
            let move_by = offset.dot(&course.first) / stretch;
            let limit = if inner { branch.step } else { f64::INFINITY };
            let next = (s + move_by.clamp(-limit, limit)).clamp(ends.0, ends.1);
            let change = (next - s).abs();
            s = next;
            course = branch.course(s);
            if change <= FOOT * branch.step {
                break;
            }
        }
        let (radius, slope) = branch.width(s);
        let offset = point - course.position;
        let distance = offset.norm();
        let radial = distance - radius;
        // Past an open end the tube continues for `extension` and ends flat.
        let beyond = (-s).max(s - branch.length()) - self.extension;
        if beyond > radial {
            let outward = if s < 0.0 { -course.first } else { course.first };
            return Value { f: beyond, gradient: outward, radius, exposure: 1.0 };
        }
        let clamped = (!low && s <= 0.0) || (!high && s >= branch.length());
        let along = if clamped { Vec3::zeros() } else { course.first / stretch };
        let gradient = offset / distance.max(f64::MIN_POSITIVE) - slope * along;
        let from_start = if low { f64::INFINITY } else { s };
        let from_end = if high { f64::INFINITY } else { branch.length() - s };
        let exposure = smooth_step(from_start.min(from_end) / (HIDDEN * radius));
        Value { f: radial, gradient, radius, exposure }
    }
}

/// The samples of a branch at most `slack` farther from `centre` than the nearest one.
pub(super) fn near(branch: &Branch, centre: &Vec3, slack: f64) -> Vec<u32> {
    let distance = |k: usize| (branch.samples[k].position - centre).norm();
    // Samples are `step` apart along the curve, so the distance changes by at most that from one to the next: far
    // ones are skipped in strides too short to miss anything nearer than requested.
    let stride = |excess: f64| ((excess / branch.step) as usize).max(1);
    let (mut nearest, mut k) = (f64::INFINITY, 0);
    while k < branch.samples.len() {
        let here = distance(k);
        nearest = nearest.min(here);
        k += stride((here - nearest) * (1.0 - ROUNDING));
    }
    let limit = nearest + slack;
    let mut samples = Vec::new();
    k = 0;
    while k < branch.samples.len() {
        let here = distance(k);
        if here <= limit {
            samples.push(k as u32);
        }
        k += stride((here - limit) * (1.0 - ROUNDING));
    }
    samples
}

/// Number of samples compared, or branches blended, one by one.
const FEW: usize = 4;

/// The one of `samples` (ascending) nearest to `point`, the first of equals; by bisection, discarding halves that
/// cannot come near enough: along the curve the distance changes by at most `step` from one sample to the next.
pub(super) fn nearest_of(branch: &Branch, samples: &[u32], point: &Vec3) -> u32 {
    fn search(branch: &Branch, samples: &[u32], point: &Vec3, best: &mut (f64, u32)) {
        let distance = |k: u32| (branch.samples[k as usize].position - point).norm();
        let mut look = |k: u32| {
            let here = distance(k);
            if here < best.0 || (here == best.0 && k < best.1) {
                *best = (here, k);
            }
            here
        };
        if samples.len() <= FEW {
            samples.iter().for_each(|&k| {
                look(k);
            });
            return;
        }
        let (before, rest) = samples.split_at(samples.len() / 2);
        let (middle, after) = (rest[0], &rest[1..]);
        let here = look(middle);
        for (half, end) in [(before, before[0]), (after, after[after.len() - 1])] {
            let least = here - branch.step * f64::from(end.abs_diff(middle));
            if least <= best.0 + ROUNDING * here {
                search(branch, half, point, best);
            }
        }
    }
    let mut best = (f64::INFINITY, 0);
    search(branch, samples, point, &mut best);
    best.1
}

/// From 0 at 0 to 1 at 1, with zero slope at both.
fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Cubic polynomial smooth minimum with a width that depends on the angle between the gradients.
fn smooth_minimum(a: Value, b: Value) -> Value {
    let (low, high) = if a.f <= b.f { (a, b) } else { (b, a) };
    let cosine = low.gradient.dot(&high.gradient)
        / (low.gradient.norm() * high.gradient.norm()).max(f64::MIN_POSITIVE);
    let opposed = smooth_step((BLEND_COSINES[0] - cosine) / (BLEND_COSINES[0] - BLEND_COSINES[1]));
    let width = BLEND * low.radius.min(high.radius) * opposed * low.exposure * high.exposure;
    let gap = width - (high.f - low.f);
    if gap <= 0.0 {
        return low;
    }
    let h = gap / width;
    let weight = h * h / 2.0;
    Value {
        f: low.f - h * h * h * width / 6.0,
        gradient: (1.0 - weight) * low.gradient + weight * high.gradient,
        radius: (1.0 - weight) * low.radius + weight * high.radius,
        exposure: (1.0 - weight) * low.exposure + weight * high.exposure,
    }
}
