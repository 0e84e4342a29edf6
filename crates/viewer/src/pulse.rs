//! X-ray pulses while devices move.
//!
//! A pulse of length τ ends at the time of its frame. The detector accumulates energy, so behind the line integral
//! p(t) of a ray its signal is
//!
//! ```text
//! (1/τ) ∫ S(p(t)) dt,    the mean of signals
//! ```
//!
//! and not the signal of the mean line integral: S decreases like e^{−p}, which is convex, so a thin dark shadow that
//! sweeps over a pixel reduces it by less than its mean thickness would (Jensen), by ½ var p of the signal to lowest
//! order. The integral is computed by the midpoint rule over K equal parts, with K such that no point of a device
//! moves by more than half a pixel from one to the next, the distance of rays within a pixel; at most 32.
//!
//! **Motion.** Between two recorded moments each point of a device moves in a straight line at constant speed. Points
//! are identified by their arc length from the tip of their instrument, which is the same at both: x(s, w) = (1 − w)
//! x₀(s) + w x₁(s). Points inside the sheath at one of them are on the tangent of its mouth. Before the first moment
//! devices are as at that moment. Contrast medium does not move within a pulse.

use endowire_core::Vec3;
use endowire_core::device::line_mm;
use endowire_core::shape::Shape;

use crate::c_arm::CArm;
use crate::device::DeviceView;
use crate::pushed::Pushed;
use crate::renderer::Renderer;
use crate::shaft::SheathMouth;

/// Largest number of parts of a pulse.
const MOST_PARTS: f64 = 32.0;
/// Number of parts per pixel of motion.
const PARTS_PER_PX: f64 = 2.0;
/// Half of the length over which a tangent is computed, mm.
const TANGENT_MM: f64 = 1e-3;

/// The inserted devices at a moment.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The centre line.
    pub shape: &'a Shape,
    /// Inserted length of each instrument.
    pub inserted_mm: &'a [f64],
    /// The moment.
    pub time_s: f64,
}

impl Pushed {
    /// Devices at equally spaced times of the pulse that ends `now`, for a renderer's next frame; `before` is the
    /// last record. Empty if no motion can be resolved: without pulses (`xray.pulse_ms`), without an earlier moment,
    /// or if nothing moves.
    pub fn pulse(
        &self,
        before: Option<Seen<'_>>,
        now: Seen<'_>,
        renderer: &Renderer,
    ) -> Vec<Vec<DeviceView>> {
        let pulse_s = renderer.spec().xray.pulse_ms / 1000.0;
        let (Some(before), Some(arm)) = (before, renderer.c_arm()) else { return vec![] };
        let step_s = now.time_s - before.time_s;
        if !(pulse_s > 0.0 && step_s > 0.0) {
            return vec![];
        }
        // Fraction of the step covered by the pulse.
        let share = (pulse_s / step_s).min(1.0);
        let ways = self.ways(before, now);
        let way_px = ways.iter().map(|way| way.px(arm)).fold(0.0, f64::max) * share;
        if way_px <= 0.0 {
            return vec![];
        }
        let parts = (PARTS_PER_PX * way_px).ceil().clamp(1.0, MOST_PARTS);
        let at = |part: f64| 1.0 - pulse_s * (part + 0.5) / parts / step_s;
        let instant = |part: usize| {
            let shapes: Vec<Shape> = ways.iter().map(|way| way.at(at(part as f64).max(0.0))).collect();
            self.views_of(&shapes, SheathMouth::of_line(now.shape), now.inserted_mm)
        };
        (0..parts as usize).rev().map(instant).collect()
    }

    /// The motion of each inserted instrument from before to now.
    fn ways(&self, before: Seen<'_>, now: Seen<'_>) -> Vec<Way> {
        let [line, line_before] = [now, before].map(|seen| line_mm(seen.inserted_mm.iter().copied()));
        let lengths = now.inserted_mm.iter().zip(before.inserted_mm).filter(|(mm, _)| **mm > 0.0);
        let way = |(mm, mm_before): (&f64, &f64)| {
            let end = now.shape.behind(line - mm);
            let begin = if *mm_before > 0.0 {
                before.shape.behind(line_before - mm_before)
            } else {
                Shape::default()
            };
            Way::new(&begin, &end)
        };
        lengths.map(way).collect()
    }
}

/// Positions of an instrument's points before and now: those inserted at either moment.
struct Way {
    from: Vec<(Vec3, Vec3)>,
    to: Vec<(Vec3, Vec3)>,
    from_tip_mm: Vec<f64>,
}

impl Way {
    fn new(before: &Shape, now: &Shape) -> Self {
        let in_now = now.from_tip_mm.first().copied().unwrap_or(0.0);
        // The part withdrawn since.
        let gone = before.from_tip_mm.iter().filter(|s| **s > in_now);
        let from_tip_mm: Vec<f64> = gone.chain(&now.from_tip_mm).copied().collect();
        let places = |shape: &Shape, other: &Shape| {
            let at = |&s: &f64| place(shape, s).or_else(|| place(other, s)).unwrap_or_default();
            from_tip_mm.iter().map(at).collect::<Vec<_>>()
        };
        Self { from: places(before, now), to: places(now, before), from_tip_mm }
    }

    /// The largest motion of a point on the detector, pixels.
    fn px(&self, arm: &CArm) -> f64 {
        let ways = self.from.iter().zip(&self.to).map(|((from, _), (to, _))| {
            let [a, b] = [arm.project(from), arm.project(to)];
            libm::hypot(a[0] - b[0], a[1] - b[1])
        });
        ways.filter(|way| way.is_finite()).fold(0.0, f64::max)
    }

    fn at(&self, w: f64) -> Shape {
        let mix = |(from, to): (&(Vec3, Vec3), &(Vec3, Vec3))| {
            (from.0 * (1.0 - w) + to.0 * w, from.1 * (1.0 - w) + to.1 * w)
        };
        let (positions_mm, tangents) = self.from.iter().zip(&self.to).map(mix).unzip();
        Shape { positions_mm, tangents, from_tip_mm: self.from_tip_mm.clone() }
    }
}

/// Position and tangent of a point at this distance from the tip; one not yet inserted lies on the line of the first
/// tangent, behind it.
fn place(shape: &Shape, from_tip_mm: f64) -> Option<(Vec3, Vec3)> {
    let (first, start, tangent) =
        (*shape.from_tip_mm.first()?, *shape.positions_mm.first()?, *shape.tangents.first()?);
    if from_tip_mm >= first {
        return Some((start - tangent * (from_tip_mm - first), tangent));
    }
    let [behind, ahead] = [(from_tip_mm + TANGENT_MM).min(first), (from_tip_mm - TANGENT_MM).max(0.0)];
    let way = shape.position_at(ahead)? - shape.position_at(behind)?;
    Some((shape.position_at(from_tip_mm)?, way / (behind - ahead)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An arc of this length of a circle of radius 30 mm that starts at the origin along z.
    fn arc(length_mm: f64) -> Shape {
        let angles = (0..=10).map(|k| f64::from(k) / 10.0 * length_mm / 30.0);
        Shape {
            positions_mm: angles
                .clone()
                .map(|a| Vec3::new(30.0 - 30.0 * a.cos(), 0.0, 30.0 * a.sin()))
                .collect(),
            tangents: angles.clone().map(|a| Vec3::new(a.sin(), 0.0, a.cos())).collect(),
            from_tip_mm: angles.map(|a| length_mm - 30.0 * a).collect(),
        }
    }

    #[test]
    fn points_of_a_device_that_is_pushed_along_its_arc_go_along_it() {
        // A point moves 2 mm along the arc: half-way it is at the middle of a chord, 2²/8·30 mm beside the arc.
        let way = Way::new(&arc(20.0), &arc(22.0));
        let (half, expected) = (way.at(0.5), arc(21.0));
        let tip = half.positions_mm[10];
        assert!((tip - expected.positions_mm[10]).norm() < 0.017 + 1e-3, "{tip}");
        for (k, &from_tip_mm) in half.from_tip_mm.iter().enumerate() {
            let on = match expected.position_at(from_tip_mm) {
                Some(on) if from_tip_mm <= 21.0 => on,
                // Still in the sheath, which is straight.
                _ => Vec3::z() * (21.0 - from_tip_mm),
            };
            assert!((half.positions_mm[k] - on).norm() < 0.02, "{k}: {} {on}", half.positions_mm[k]);
            assert!((half.tangents[k].norm() - 1.0).abs() < 1e-3);
        }
        // At the ends it equals the records; counter-check: half-way it equals neither.
        let off = |a: &Shape, b: &Shape| {
            a.positions_mm.iter().zip(&b.positions_mm).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
        };
        assert!(off(&way.at(1.0), &arc(22.0)) < 1e-9);
        assert!((way.at(0.0).positions_mm[10] - arc(20.0).positions_mm[10]).norm() < 1e-9);
        assert!((tip - arc(22.0).positions_mm[10]).norm() > 0.9);
    }

    #[test]
    fn what_is_withdrawn_is_still_in_before_its_end() {
        let way = Way::new(&arc(22.0), &arc(20.0));
        let half = way.at(0.5);
        // 21 mm are inserted, and points behind the mouth are on its line.
        let mouth = half.position_at(21.0).unwrap();
        assert!(mouth.norm() < 0.02, "{mouth}");
        assert!(half.positions_mm.iter().zip(&half.from_tip_mm).all(|(x, s)| *s <= 21.0 || x.z < 0.01));
        assert!(half.from_tip_mm.windows(2).all(|pair| pair[1] < pair[0]));
        // Counter-check: without them a millimetre at the mouth would be missing.
        let first = half.from_tip_mm.iter().position(|s| *s <= 20.0).unwrap();
        assert!(half.positions_mm[first].norm() > 0.9);
    }
}
