//! How a generated body moves: the diaphragm goes down with each breath, and with it the lungs' lower parts and the gas
//! below; the borders of the heart go in with each beat. Bones and skin rest.

use endowire_core::vessel::{MotionMode, SurfaceMesh, VesselMotion, Waveform};
use endowire_core::{Result, Vec3};

use super::trunk::step;
use crate::spec::{FlowSpec, TorsoSpec};

/// Heights above the diaphragm up to which lungs go down with it, and below it to which the gas of stomach and bowel
/// does, wholly and not at all, mm.
const WITH_DIAPHRAGM_MM: f64 = 20.0;
const BELOW_MM: [f64; 2] = [60.0, 260.0];
/// Distances from the heart's middle, in its half axes, up to which its border moves, and from which nothing does.
const ABOUT_HEART: [f64; 2] = [1.1, 1.6];

/// The places of a body that move, and how far.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BodyMotion {
    pub(super) breath_mm: f64,
    pub(super) beat_mm: f64,
    pub(super) diaphragm: f64,
    pub(super) apex: f64,
    pub(super) heart: Vec3,
    pub(super) heart_half_mm: Vec3,
}

impl BodyMotion {
    /// The mesh at these parts, 0 to 1, of a breath and of a beat.
    pub(crate) fn moved(&self, mesh: &SurfaceMesh, parts: [f64; 2]) -> SurfaceMesh {
        SurfaceMesh {
            vertices_mm: mesh.vertices_mm.iter().map(|v| self.place(v, parts)).collect(),
            triangles: mesh.triangles.clone(),
        }
    }

    fn place(&self, at: &Vec3, [breath, beat]: [f64; 2]) -> Vec3 {
        let below = self.diaphragm - at.z;
        let with = (1.0 - step(at.z, self.diaphragm + WITH_DIAPHRAGM_MM, self.apex))
            * (1.0 - step(below, BELOW_MM[0], BELOW_MM[1]));
        let from = at - self.heart;
        let about = from.component_div(&self.heart_half_mm).norm();
        let border = 1.0 - step(about, ABOUT_HEART[0], ABOUT_HEART[1]);
        let inwards = from.try_normalize(1e-9).unwrap_or_default() * (-self.beat_mm * beat * border);
        at + inwards - Vec3::z() * (self.breath_mm * breath * with)
    }
}

/// When a body breathes and its heart beats: with the waveforms of vessels that move.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rhythm {
    breath: Option<VesselMotion>,
    beat: Option<VesselMotion>,
}

impl Rhythm {
    pub(crate) fn new(torso: &TorsoSpec, flow: &FlowSpec) -> Result<Self> {
        let wave = |of_mm: f64, waveform: Waveform, period_s: f64| {
            let mode = MotionMode {
                waveform,
                period_s: Some(period_s),
                phase: 0.0,
                // Of one, so that displacements are parts of the whole.
                displacement_mm: [1.0, 0.0, 0.0],
                turn: None,
                still: None,
                within: None,
            };
            if of_mm > 0.0 { VesselMotion::new(&[mode]) } else { Ok(None) }
        };
        Ok(Self {
            breath: wave(torso.breath_mm(), Waveform::Breathing, torso.breath_s)?,
            beat: wave(torso.beat_mm(), Waveform::Heartbeat, 60.0 / flow.heart_rate_per_min)?,
        })
    }

    /// Parts of a breath and of a beat at a time, 0 to 1.
    pub(crate) fn parts(&self, time_s: f64) -> [f64; 2] {
        let part = |of: &Option<VesselMotion>| {
            of.as_ref().map_or(0.0, |motion| motion.at(time_s).place(&Vec3::zeros()).x)
        };
        [part(&self.breath), part(&self.beat)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_diaphragm_goes_down_with_a_breath_the_hearts_border_in_with_a_beat_and_the_apex_stays() {
        let motion = BodyMotion {
            breath_mm: 12.0,
            beat_mm: 4.0,
            diaphragm: 100.0,
            apex: 300.0,
            heart: Vec3::new(20.0, -40.0, 125.0),
            heart_half_mm: Vec3::new(71.0, 48.0, 58.0),
        };
        let moves = |at: Vec3, parts: [f64; 2]| motion.place(&at, parts) - at;
        assert_eq!(moves(Vec3::new(-90.0, 0.0, 90.0), [1.0, 0.0]), -Vec3::z() * 12.0);
        assert_eq!(moves(Vec3::new(-60.0, 0.0, 305.0), [1.0, 1.0]).norm(), 0.0);
        assert_eq!(moves(Vec3::new(0.0, 0.0, -200.0), [1.0, 0.0]).norm(), 0.0);
        let border = Vec3::new(91.0, -40.0, 125.0);
        assert!((moves(border, [0.0, 1.0]) + Vec3::x() * 4.0).norm() < 1e-12);
        assert!((moves(border, [0.0, 0.5]) + Vec3::x() * 2.0).norm() < 1e-12);
        // Counter-check: at rest nothing moves.
        assert_eq!(moves(border, [0.0; 2]).norm(), 0.0);
    }

    #[test]
    fn a_breath_is_in_half_way_and_a_held_one_never() {
        let torso = TorsoSpec::default();
        let rhythm = Rhythm::new(&torso, &FlowSpec::default()).unwrap();
        let half_s = torso.breath_s / 2.0;
        assert!((rhythm.parts(half_s)[0] - 1.0).abs() < 1e-12);
        assert_eq!(rhythm.parts(0.0), [0.0; 2]);
        let beat_s = 60.0 / FlowSpec::default().heart_rate_per_min;
        assert!((rhythm.parts(0.2 * beat_s)[1] - 1.0).abs() < 1e-12);
        let held = TorsoSpec { breath_mm: Some(0.0), beat_mm: Some(0.0), ..torso };
        assert_eq!(Rhythm::new(&held, &FlowSpec::default()).unwrap().parts(half_s), [0.0; 2]);
    }
}
