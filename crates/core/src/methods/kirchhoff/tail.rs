//! Tails: instruments between the hand and the sheath's mouth, which are straight and twist.
//!
//! Under a torque M a stretch of a tail turns by M c, where c = ∫ ds/GJ. Friction holds a tail at one place, its *grip*: the valve on the
//! hub of the next instrument outside it, or, of the outermost one, the introducer sheath, a radius behind its mouth
//! ([`FrictionTuning::grip_radii`](crate::tuning::FrictionTuning::grip_radii)). With the angles of hand, grip and mouth,
//!
//! ```text
//! φ (hand) ── c₁ ── ψ (grip) ── c₂ ── θ (mouth)
//! E(θ) = min over ψ of  (φ − ψ)²/2c₁ + (ψ − θ)²/2c₂ + F (√(Δ² + r²α²) − |Δ|),    α = ψ − ψₐ
//! ```
//!
//! is an energy beside that of the rod in the body, whose first node may turn: with it the mouth's angle is one more unknown of each
//! instrument with material angles. F is the force of friction, r the radius at the grip, Δ the advance through it in a
//! part of a command and ψₐ the angle at which it would not slip. So the incremental potential has Coulomb's law for the slip
//! (Δ, r α), as everywhere ([`crate::contact::friction`]), but exact: the minimum over ψ needs no regularisation, and E is convex and once differentiable in θ.
//! ψ follows from the balance of torques, whose factor c₁c₂ keeps it finite where the hand is at the grip (c₁ = 0):
//!
//! ```text
//! (φ − ψ)/c₁ − (ψ − θ)/c₂ = t(α) = F r²α/√(Δ² + r²α²)
//! a − b α = p t(α),    a = c₂(φ − ψₐ) + c₁(θ − ψₐ),    b = c₁ + c₂,    p = c₁c₂
//! dE/dθ = −M,    M = (ψ − θ)/c₂ in the body,    M₁ = M + t at the hand
//! d²E/dθ² = (1 + c₁t′)/(b + p t′),    t′ = F r²Δ²/√(Δ² + r²α²)³
//! ```
//!
//! Without friction E = (φ − θ)²/2(c₁ + c₂), a torsional spring. Without advance the grip sticks (α = 0, t′ = ∞) while |a| ≤ p F r, and
//! the mouth feels c₂ alone. While a device is pushed or pulled t′ is small, and what twist the grip has held is let go.
//! An instrument without material angles has M = 0: a = φ − ψₐ, b = 1, p = c₁.
//!
//! # Forces on hands
//!
//! What comes in takes its twist along: the tail gives ½M²/GJ per length at the mouth, by which the push force of a
//! twisted rod ([`super`]) is larger. At the grip the material turns with the mean of the twists on both sides,
//!
//! ```text
//! ψₐ = ψ₀ + ½(M₁ + M)/GJ · Δ    (from the last equilibrium, turned with the hub that holds it)
//! ```
//!
//! so that the torque t of friction works ½(M₁² − M²)/GJ per length, which is just what the two stretches exchange: no other force arises
//! along the line, and the work of the hands is what is stored and what friction F|u| dissipates. The torque t acts backwards on the hub,
//! that is on the hand of the instrument outside.

use serde::{Deserialize, Serialize};

use super::hands::{Hand, ROUNDED_MM};
use super::state::KirchhoffState;
use crate::device::Device;
use crate::methods::Surroundings;
use crate::rod::RodState;

/// A tail, or a part of one, that is shorter than this fraction of an element counts as so long, or as none: angles over
/// its compliance would lose their digits.
pub(super) const LEAST: f64 = 1e-4;

/// How many numbers a [`Twist`] has.
pub(super) const TWIST: usize = 5;

/// What holds a tail by friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) enum Grip {
    #[default]
    Nothing,
    Sheath,
    /// The valve on the hub of this instrument.
    Valve(usize),
}

/// The twist of a tail in an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Twist {
    /// Angle at the sheath's mouth, rad.
    pub(super) mouth_rad: f64,
    /// Angle at the grip, rad.
    grip_rad: f64,
    /// Distance of the grip from the tip, mm.
    grip_mm: f64,
    /// Torque in the body, N·mm.
    body_nmm: f64,
    /// Torque at the hand, N·mm.
    hand_nmm: f64,
    grip: Grip,
}

impl Twist {
    /// Of a tail without torque.
    pub(super) fn relaxed(hand_rad: f64) -> Self {
        Self { mouth_rad: hand_rad, grip_rad: hand_rad, ..Self::default() }
    }

    /// Whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let Self { mouth_rad, grip_rad, grip_mm, body_nmm, hand_nmm, .. } = self;
        [mouth_rad, grip_rad, grip_mm, body_nmm, hand_nmm].into_iter().all(|part| part.is_finite())
    }

    /// Its numbers, in whose changes a later part changes.
    pub(super) fn numbers(&self) -> [f64; TWIST] {
        [self.mouth_rad, self.grip_rad, self.grip_mm, self.body_nmm, self.hand_nmm]
    }

    /// The same with one of its numbers changed by so much.
    pub(super) fn with(mut self, number: usize, by: f64) -> Self {
        let Self { mouth_rad, grip_rad, grip_mm, body_nmm, hand_nmm, .. } = &mut self;
        *[mouth_rad, grip_rad, grip_mm, body_nmm, hand_nmm][number] += by;
        self
    }

    /// Angle, rad, of the material at this distance from the tip, in a tail that is `inserted_mm` long in the body.
    pub(super) fn angle_rad(&self, device: &Device, inserted_mm: f64, from_tip_mm: f64) -> f64 {
        if from_tip_mm <= self.grip_mm {
            return self.mouth_rad + self.body_nmm * device.compliance_per_nmm(inserted_mm, from_tip_mm);
        }
        self.grip_rad + self.hand_nmm * device.compliance_per_nmm(self.grip_mm, from_tip_mm)
    }
}

/// A tail in a part of a command.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tail {
    /// Set of material angles of its instrument, if it has one and is inserted.
    pub(super) set: Option<usize>,
    pub(super) is_in: bool,
    /// φ.
    pub(super) hand_rad: f64,
    /// c₁ and c₂, rad/(N·mm).
    outer_per_nmm: f64,
    inner_per_nmm: f64,
    /// F.
    pub(super) friction_n: f64,
    /// r.
    pub(super) radius_mm: f64,
    /// Δ.
    pub(super) advance_mm: f64,
    /// ψₐ.
    from_rad: f64,
    /// Distance of the grip from the tip, mm.
    grip_mm: f64,
    pub(super) grip: Grip,
    /// Twist and inserted length before the part; no length where it was out, and relaxed.
    pub(super) before: (Twist, f64),
    /// GJ at the mouth, N·mm².
    pub(super) torsion_nmm2: f64,
    /// Stored energy that is lost because the instrument is pulled out, mJ.
    pub(super) let_go_mj: f64,
}

/// A tail at an angle of the mouth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turned {
    /// α.
    pub(super) slip_rad: f64,
    /// M and M₁.
    pub(super) body_nmm: f64,
    pub(super) hand_nmm: f64,
    /// Energy stored in its twist, mJ.
    pub(super) stored_mj: f64,
    /// d²E/dθ², N·mm.
    pub(super) stiffness_nmm: f64,
}

impl Tail {
    /// The tail of instrument `k` in a part from the state `start` to these hands.
    pub(super) fn new(place: &Place<'_>, k: usize) -> Self {
        let Place { surroundings, start, hands, .. } = *place;
        let stack = surroundings.stack;
        let device = &stack.instruments()[k].device;
        let (was, hand, twist) = (start.hands[k], hands[k], start.twists[k]);
        let is_in = was.inserted_mm > 0.0;
        if !is_in && hand.inserted_mm == 0.0 {
            return Self { hand_rad: hand.turn_rad, ..Self::default() };
        }
        let twist = if is_in { twist } else { Twist::relaxed(hand.turn_rad) };
        let grip_mm = place.grip_radii * device.section_at(hand.inserted_mm).radius_mm;
        let has_been = |other: usize| start.hands[other].inserted_mm.max(hands[other].inserted_mm) > 0.0;
        let outside = (k + 1..hands.len()).find(|other| has_been(*other));
        let advanced = |k: usize| hands[k].inserted_mm - start.hands[k].inserted_mm;
        let (grip, friction_n, behind_mm, by) = match outside {
            Some(outer) => {
                let outer_mm = stack.instruments()[outer].device.length_mm() - hands[outer].inserted_mm;
                let hub = [advanced(outer), hands[outer].turn_rad - start.hands[outer].turn_rad];
                (Grip::Valve(outer), stack.valve_n(outer), outer_mm.max(grip_mm), hub)
            }
            None => {
                let sheath = surroundings.sheath;
                let friction_n = sheath.friction_n + sheath.friction * start.across_n;
                (Grip::Sheath, friction_n, grip_mm, [0.0; 2])
            }
        };
        let radius_mm = match grip {
            Grip::Valve(_) => device.section_at(f64::INFINITY).radius_mm,
            _ => device.section_at(hand.inserted_mm).radius_mm,
        };
        let grip = if friction_n > 0.0 { grip } else { Grip::Nothing };
        let advance_mm = advanced(k) - by[0];
        let advance_mm = if advance_mm.abs() > ROUNDED_MM { advance_mm } else { 0.0 };
        if hand.inserted_mm == 0.0 {
            let let_go_mj = twist_mj(&twist, device, was);
            let hand_rad = hand.turn_rad;
            return Self { hand_rad, friction_n, radius_mm, advance_mm, grip, let_go_mj, ..Self::default() };
        }
        let tail_mm = device.length_mm() - hand.inserted_mm;
        let inner_mm = behind_mm.min(tail_mm).max(place.least_mm);
        let grip_mm = hand.inserted_mm + inner_mm;
        let has_outer = tail_mm - inner_mm >= place.least_mm;
        let from_rad = if is_in && grip == twist.grip {
            let mean_nmm = 0.5 * (twist.hand_nmm + twist.body_nmm);
            twist.grip_rad + by[1] + mean_nmm * device.compliance_per_nmm(twist.grip_mm, grip_mm)
        } else {
            twist.angle_rad(device, was.inserted_mm, grip_mm)
        };
        Self {
            set: stack.sets()[k],
            is_in: true,
            hand_rad: hand.turn_rad,
            outer_per_nmm: match has_outer {
                true => device.compliance_per_nmm(grip_mm, device.length_mm()),
                false => 0.0,
            },
            inner_per_nmm: device.compliance_per_nmm(hand.inserted_mm, grip_mm),
            friction_n,
            radius_mm,
            advance_mm,
            from_rad,
            grip_mm,
            grip,
            before: (twist, was.inserted_mm),
            torsion_nmm2: device.section_at(hand.inserted_mm).torsion_nmm2(),
            let_go_mj: 0.0,
        }
    }

    /// t(α) and t′(α).
    fn resists(&self, slip_rad: f64) -> (f64, f64) {
        let around_mm = self.radius_mm * slip_rad;
        let slip_mm = libm::hypot(self.advance_mm, around_mm);
        let most_nmm = self.friction_n * self.radius_mm;
        let part = self.advance_mm / slip_mm;
        (most_nmm * around_mm / slip_mm, most_nmm * self.radius_mm * part * part / slip_mm)
    }

    /// α from a, b and p.
    fn slip_rad(&self, [a, b, p]: [f64; 3]) -> f64 {
        let most_nmm = self.friction_n * self.radius_mm;
        if p * most_nmm == 0.0 {
            return a / b;
        }
        // The friction is at most that of a slip without advance, so this is no farther than α.
        let mut slip_rad = (a.abs() - p * most_nmm).max(0.0) / b;
        if self.advance_mm == 0.0 {
            return slip_rad.copysign(a);
        }
        // t is concave, so Newton's method comes nearer from below until rounding stops it.
        for _ in 0..MOST_ROUNDS {
            let (torque, slope) = self.resists(slip_rad);
            let next = slip_rad + (a.abs() - b * slip_rad - p * torque) / (b + p * slope);
            if next.is_nan() || next <= slip_rad {
                break;
            }
            slip_rad = next;
        }
        slip_rad.copysign(a)
    }

    /// At an angle of the mouth; with `None` for one that turns freely.
    pub(super) fn at(&self, mouth_rad: Option<f64>) -> Turned {
        let (outer, inner, hand) = (self.outer_per_nmm, self.inner_per_nmm, self.hand_rad - self.from_rad);
        let sum = match mouth_rad {
            Some(mouth_rad) => {
                [inner * hand + outer * (mouth_rad - self.from_rad), outer + inner, outer * inner]
            }
            None => [hand, 1.0, outer],
        };
        let slip_rad = self.slip_rad(sum);
        let sticks = self.friction_n > 0.0 && self.advance_mm == 0.0 && slip_rad == 0.0;
        let body_nmm = match mouth_rad {
            Some(mouth_rad) if self.friction_n == 0.0 => (self.hand_rad - mouth_rad) / (outer + inner),
            Some(mouth_rad) => (self.from_rad + slip_rad - mouth_rad) / inner,
            None => 0.0,
        };
        let (hand_nmm, stiffness_nmm) = if sticks {
            let hand_nmm = if outer > 0.0 { hand / outer } else { body_nmm };
            (hand_nmm, 1.0 / inner)
        } else {
            let (torque, slope) = if self.friction_n > 0.0 { self.resists(slip_rad) } else { (0.0, 0.0) };
            (body_nmm + torque, (1.0 + outer * slope) / (sum[1] + sum[2] * slope))
        };
        let stored_mj = 0.5 * (outer * hand_nmm * hand_nmm + inner * body_nmm * body_nmm);
        Turned { slip_rad, body_nmm, hand_nmm, stored_mj, stiffness_nmm }
    }

    /// Energy dissipated at the grip by turning, at least and at most, mJ. A grip that lets go because the device now
    /// advances has had a larger torque before.
    pub(super) fn around_mj(&self, turned: &Turned) -> [f64; 2] {
        let after = (turned.hand_nmm - turned.body_nmm) * turned.slip_rad;
        let (twist, inserted_mm) = &self.before;
        if self.advance_mm == 0.0 || *inserted_mm == 0.0 || twist.grip != self.grip {
            return [after; 2];
        }
        let before = ((twist.hand_nmm - twist.body_nmm) * turned.slip_rad).max(0.0);
        [after, before.max(after)]
    }

    /// E at an angle of the mouth, mJ.
    pub(super) fn energy_mj(&self, turned: &Turned) -> f64 {
        let slip_mm = libm::hypot(self.advance_mm, self.radius_mm * turned.slip_rad);
        turned.stored_mj + self.friction_n * (slip_mm - self.advance_mm.abs())
    }

    /// At the mouth of a rod.
    pub(super) fn on(&self, rod: &RodState) -> Turned {
        self.at(self.set.map(|set| rod.angle(0, set)))
    }

    /// Its twist at the mouth of a rod.
    pub(super) fn twist(&self, rod: &RodState, turned: &Turned) -> Twist {
        let grip_rad = self.from_rad + turned.slip_rad;
        Twist {
            mouth_rad: self.set.map_or(grip_rad, |set| rod.angle(0, set)),
            grip_rad,
            grip_mm: self.grip_mm,
            body_nmm: turned.body_nmm,
            hand_nmm: turned.hand_nmm,
            grip: self.grip,
        }
    }
}

/// Largest number of iterations for the angle at a grip: each squares the error.
const MOST_ROUNDS: usize = 60;

/// Energy stored in the twist of the tail of a hand, mJ.
fn twist_mj(twist: &Twist, device: &Device, hand: Hand) -> f64 {
    let inner = device.compliance_per_nmm(hand.inserted_mm, twist.grip_mm);
    let outer = device.compliance_per_nmm(twist.grip_mm, device.length_mm().max(twist.grip_mm));
    0.5 * (outer * twist.hand_nmm * twist.hand_nmm + inner * twist.body_nmm * twist.body_nmm)
}

/// Where a part leads.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) surroundings: &'a Surroundings<'a>,
    pub(super) start: &'a KirchhoffState,
    pub(super) hands: &'a [Hand],
    pub(super) grip_radii: f64,
    pub(super) least_mm: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.2 and 0.05 rad/(N·mm) behind and before a grip of 0.8 N·mm; the hand at 2 rad, the grip from 1.1 rad.
    fn tail(friction_n: f64, advance_mm: f64) -> Tail {
        Tail {
            is_in: true,
            hand_rad: 2.0,
            outer_per_nmm: 0.2,
            inner_per_nmm: 0.05,
            friction_n,
            radius_mm: 0.4,
            advance_mm,
            from_rad: 1.1,
            ..Tail::default()
        }
    }

    /// E at an angle of the mouth, by search over the angle at the grip.
    fn least_mj(tail: &Tail, mouth_rad: f64) -> f64 {
        let energy = |grip_rad: f64| {
            let around_mm = tail.radius_mm * (grip_rad - tail.from_rad);
            0.5 * (tail.hand_rad - grip_rad).powi(2) / tail.outer_per_nmm
                + 0.5 * (grip_rad - mouth_rad).powi(2) / tail.inner_per_nmm
                + tail.friction_n * (tail.advance_mm.hypot(around_mm) - tail.advance_mm.abs())
        };
        let (mut low, mut high) = (-10.0, 10.0);
        for _ in 0..200 {
            let thirds = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if energy(thirds[0]) < energy(thirds[1]) { high = thirds[1] } else { low = thirds[0] }
        }
        energy(0.5 * (low + high))
    }

    #[test]
    fn a_tail_has_the_least_energy_over_its_grip_and_torques_are_slopes_of_it() {
        let mut sticking = 0;
        for (friction_n, advance_mm) in [(0.0, 0.0), (2.0, 0.0), (2.0, 1e-6), (2.0, 0.3), (2.0, -20.0)] {
            let tail = tail(friction_n, advance_mm);
            for k in 0..60 {
                let mouth_rad = -0.5 + 0.05 * f64::from(k) + 1e-3;
                let energy = |mouth_rad: f64| tail.energy_mj(&tail.at(Some(mouth_rad)));
                let here = tail.at(Some(mouth_rad));
                assert!(
                    (energy(mouth_rad) - least_mj(&tail, mouth_rad)).abs() < 1e-11,
                    "{tail:?} {mouth_rad}"
                );
                let h = 1e-5;
                let slope = (energy(mouth_rad + h) - energy(mouth_rad - h)) / (2.0 * h);
                assert!((slope + here.body_nmm).abs() < 1e-7, "{slope} {here:?}");
                let torque = |mouth_rad: f64| tail.at(Some(mouth_rad)).body_nmm;
                let slope = (torque(mouth_rad - h) - torque(mouth_rad + h)) / (2.0 * h);
                assert!((slope / here.stiffness_nmm - 1.0).abs() < 1e-4, "{slope} {here:?}");
                // What the hand bears and the body does not is the friction, at most F r.
                let held_nmm = here.hand_nmm - here.body_nmm;
                assert!(held_nmm.abs() <= friction_n * 0.4 * (1.0 + 1e-12), "{here:?}");
                let slips = here.slip_rad != 0.0 && friction_n > 0.0;
                assert!(!slips || held_nmm * here.slip_rad > 0.0, "{here:?}");
                sticking += usize::from(friction_n > 0.0 && here.slip_rad == 0.0);
            }
        }
        assert!(sticking > 1, "{sticking}");
    }

    #[test]
    fn the_angle_at_a_grip_is_that_of_the_balance_where_nothing_holds_the_mouth_and_where_the_hand_is_at_it()
    {
        let free = tail(2.0, 0.0).at(None);
        // The hand turns the grip by what the tail does not take.
        assert!((free.slip_rad - (0.9 - 0.2 * 0.8)).abs() < 1e-12 && (free.hand_nmm - 0.8).abs() < 1e-12);
        assert_eq!(free.body_nmm, 0.0);
        let at_hand = Tail { outer_per_nmm: 0.0, ..tail(2.0, 0.0) }.at(Some(1.0));
        assert!((at_hand.slip_rad - 0.9).abs() < 1e-12 && (at_hand.body_nmm - 20.0).abs() < 1e-12);
        assert!((at_hand.hand_nmm - 20.8).abs() < 1e-12);
        // Without friction the two stretches are one.
        let loose = tail(0.0, 0.0).at(Some(1.0));
        assert!((loose.body_nmm - 4.0).abs() < 1e-12 && (loose.hand_nmm - 4.0).abs() < 1e-12);
        assert!((loose.stored_mj - 2.0).abs() < 1e-12 && (loose.stiffness_nmm - 4.0).abs() < 1e-12);
    }
}
