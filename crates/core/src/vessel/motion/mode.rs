//! One mode of a motion: region, amplitude and time course.
//!
//! Waveforms, with the phase φ of the period from 0 to 1:
//!
//! ```text
//! breathing   a = sin⁴(πφ)              at rest where it begins, out of breath longer than in
//! heartbeat   a = sin²(πφ/s)  for φ < s = 2/5, else 0     systole, then diastole
//! steady      a = 1
//! ```
//!
//! The first is that of A. E. Lujan, E. W. Larsen, J. M. Balter and R. K. Ten Haken, *A method for incorporating organ motion due to
//! breathing into 3D dose calculations*, Med. Phys. 26 (1999) 715–720, with its exponent 2n = 4.

use nalgebra::{Matrix3, Rotation3, Unit};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

use super::displacement::Affine;
use super::fade::{Around, Fade};
use crate::error::{in_range, vector};
use crate::{Error, Result, Vec3};

/// Fraction of a beat in which the heart contracts.
const SYSTOLE: f64 = 0.4;
/// Longest period, s.
const LONGEST_S: f64 = 1e6;
/// Largest displacement, and largest radius, mm.
const FARTHEST_MM: f64 = 1e4;

/// Time course of a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Waveform {
    /// Out and back, staying out of breath longer than in.
    Breathing,
    /// A beat in two fifths of the period, then rest.
    Heartbeat,
    /// Constant displacement.
    Steady,
}

/// A rotation about an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// A point of the axis, mm.
    pub centre_mm: [f64; 3],
    /// Its direction, any length.
    pub axis: [f64; 3],
    /// Angle, degrees, right-handed.
    pub angle_deg: f64,
}

/// `[[vessel.motion]]`: a displacement, a rotation, or both, with a waveform, in all of the vessel or in a part of
/// it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionMode {
    /// Its time course.
    pub waveform: Waveform,
    /// Its period, s; for all waveforms except `steady`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// Phase at the start, as a fraction of the period, 0 to 1.
    #[serde(default)]
    pub phase: f64,
    /// Largest displacement, mm.
    #[serde(default)]
    pub displacement_mm: [f64; 3],
    /// An additional rotation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn: Option<Turn>,
    /// The region that does not move; everything outside does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub still: Option<Around>,
    /// The region that moves; nothing outside does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<Around>,
}

/// A checked mode.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mode {
    waveform: Waveform,
    period_s: f64,
    phase: f64,
    displacement: Vec3,
    /// Centre, axis and angle in radians.
    turn: Option<(Vec3, Unit<Vec3>, f64)>,
    fade: Option<Fade>,
}

impl MotionMode {
    /// Checks it; `name` is its name in messages.
    pub(super) fn check(&self, name: &str) -> Result<Mode> {
        let key = |key: &str| format!("{name}.{key}");
        let period_s = match (self.waveform, self.period_s) {
            (Waveform::Steady, None) => 1.0,
            (Waveform::Steady, Some(period_s)) => {
                let remedy = "what is steady has no period: leave it out, or choose another waveform";
                return Err(Error::parameter(key("period_s"), period_s, remedy));
            }
            (_, Some(period_s)) => {
                in_range(&key("period_s"), period_s, LONGEST_S)?;
                period_s
            }
            (_, None) => {
                let remedy = "give it, in seconds: about 4 of breathing, about 0.8 of a heartbeat";
                return Err(Error::parameter(key("period_s"), "none", remedy));
            }
        };
        if !(0.0..=1.0).contains(&self.phase) {
            let remedy = "must be a part of the period, from 0 to 1";
            return Err(Error::parameter(key("phase"), self.phase, remedy));
        }
        let displacement = Vec3::from(self.displacement_mm);
        if !(0.0..=FARTHEST_MM).contains(&displacement.norm()) {
            let remedy = format!("must be finite numbers, no farther than {FARTHEST_MM} mm");
            return Err(Error::parameter(key("displacement_mm"), vector(&displacement), remedy));
        }
        let turn = self.turn.map(|turn| turn.check(&key("turn"))).transpose()?;
        if displacement == Vec3::zeros() && turn.is_none() {
            let remedy = "nothing moves in it: give displacement_mm, turn or both";
            return Err(Error::parameter(name, "{}", remedy));
        }
        let fade = match (self.still, self.within) {
            (Some(_), Some(_)) => {
                let remedy = "still is given too: keep one of the two";
                return Err(Error::parameter(key("within"), "given", remedy));
            }
            (Some(around), None) => Some((around, true, "still")),
            (None, Some(around)) => Some((around, false, "within")),
            (None, None) => None,
        };
        let fade = fade.map(|(around, still, table)| {
            around.check(&key(table))?;
            Ok::<_, Error>(Fade { around, still })
        });
        let (waveform, phase) = (self.waveform, self.phase);
        Ok(Mode { waveform, period_s, phase, displacement, turn, fade: fade.transpose()? })
    }
}

impl Turn {
    fn check(&self, name: &str) -> Result<(Vec3, Unit<Vec3>, f64)> {
        let (centre, axis) = (Vec3::from(self.centre_mm), Vec3::from(self.axis));
        if !(0.0..=FARTHEST_MM).contains(&centre.norm()) {
            let remedy = format!("must be finite numbers, no farther than {FARTHEST_MM} mm from the origin");
            return Err(Error::parameter(format!("{name}.centre_mm"), vector(&centre), remedy));
        }
        let Some(axis) = Unit::try_new(axis, f64::MIN_POSITIVE).filter(|a| a.iter().all(|c| c.is_finite()))
        else {
            let remedy = "must be a direction: finite numbers, not all of them 0";
            return Err(Error::parameter(format!("{name}.axis"), vector(&axis), remedy));
        };
        if self.angle_deg == 0.0 || !(-180.0..=180.0).contains(&self.angle_deg) {
            let remedy = "must be an angle from -180 to 180 degrees other than 0";
            return Err(Error::parameter(format!("{name}.angle_deg"), self.angle_deg, remedy));
        }
        Ok((centre, axis, self.angle_deg.to_radians()))
    }
}

impl Around {
    fn check(&self, name: &str) -> Result<()> {
        let centre = Vec3::from(self.centre_mm);
        if !(0.0..=FARTHEST_MM).contains(&centre.norm()) {
            let remedy = format!("must be finite numbers, no farther than {FARTHEST_MM} mm from the origin");
            return Err(Error::parameter(format!("{name}.centre_mm"), vector(&centre), remedy));
        }
        if !(0.0..=FARTHEST_MM).contains(&self.radius_mm) {
            let remedy = format!("must be from 0 to {FARTHEST_MM}");
            return Err(Error::parameter(format!("{name}.radius_mm"), self.radius_mm, remedy));
        }
        in_range(&format!("{name}.fade_mm"), self.fade_mm, FARTHEST_MM)
    }
}

impl Mode {
    /// a(t).
    pub(super) fn amplitude(&self, time_s: f64) -> f64 {
        let phase = (time_s / self.period_s + self.phase).rem_euclid(1.0);
        match self.waveform {
            Waveform::Breathing => libm::sin(PI * phase).powi(4),
            Waveform::Heartbeat if phase < SYSTOLE => libm::sin(PI * phase / SYSTOLE).powi(2),
            Waveform::Heartbeat => 0.0,
            Waveform::Steady => 1.0,
        }
    }

    /// Whether it depends on time.
    pub(super) fn changes(&self) -> bool {
        self.waveform != Waveform::Steady
    }

    /// Whether it moves only a part of the vessel.
    pub(super) fn fades(&self) -> bool {
        self.fade.is_some()
    }

    /// Whether it turns.
    pub(super) fn turns(&self) -> bool {
        self.turn.is_some()
    }

    /// w v at an amplitude.
    pub(super) fn at(&self, amplitude: f64) -> Affine {
        let turned = self.turn.map(|(centre, axis, angle)| {
            let matrix =
                Rotation3::from_axis_angle(&axis, amplitude * angle).into_inner() - Matrix3::identity();
            (matrix, -matrix * centre)
        });
        let (matrix, offset) = turned.unwrap_or_else(|| (Matrix3::zeros(), Vec3::zeros()));
        Affine { matrix, offset: offset + self.displacement * amplitude, fade: self.fade }
    }

    /// Largest |R − I|: it increases with the angle up to half a turn.
    fn turning(&self) -> f64 {
        self.turn.map_or(0.0, |(.., angle)| 2.0 * libm::sin(0.5 * angle.abs()))
    }

    /// Upper bound of |v| within this distance of a position, mm.
    fn fastest_mm(&self, place: &Vec3, within_mm: f64) -> f64 {
        let turned =
            self.turn.map_or(0.0, |(centre, ..)| self.turning() * ((place - centre).norm() + within_mm));
        turned + self.displacement.norm()
    }

    /// Upper bound of |∂(wv)/∂X|.
    pub(super) fn steepest(&self) -> f64 {
        let faded =
            self.fade.map_or(0.0, |fade| fade.steepest() * self.fastest_mm(&fade.centre(), fade.outer_mm()));
        self.turning() + faded
    }

    /// Upper bound of |wv| within this distance of a position, mm.
    pub(super) fn farthest_mm(&self, place: &Vec3, within_mm: f64) -> f64 {
        let weight = self.fade.map_or(1.0, |fade| {
            let rho_mm = (place - fade.centre()).norm();
            fade.at_mm(rho_mm + within_mm).max(fade.at_mm(rho_mm - within_mm))
        });
        weight * self.fastest_mm(place, within_mm)
    }
}
