//! A body that breathes and whose heart beats, at the cost of a still one.
//!
//! Pictures of the body are made at a few parts of a breath, each with a few parts of a beat, when they are first needed.
//! Between them lengths of air L and the logarithms of primary signals are linear in both parts, which agree, since a
//! signal is nearly the exponential of a length:
//!
//! ```text
//! L = L₀ + Σ wₖ (Lₖ − L₀),    ln S = ln S₀ + Σ wₖ (ln Sₖ − ln S₀)
//! ```
//!
//! Each picture has both motions: the differences of a beat lie where the breath has moved the heart's border to, and
//! added to those of another part of the breath they are lines beside it. Scatter, exposure and window stay those of the
//! body at rest.

use endowire_core::Result;
use rayon::prelude::*;

use super::anatomy::{air_of, finer_at};
use super::rays::Room;
use super::{FEWEST_PIXELS, Fluoroscope, SUBRAYS, Signal};
use crate::engine::PathEngine;
use crate::patient::{Patient, Rhythm};
use crate::scene::Setup;
use crate::spec::Mode;
use crate::xray::{LANES, exp_lanes, ln_lanes};

/// Numbers of parts of a breath and of a beat, besides rest: two millimetres apart as a rule. Half as many show borders
/// twice.
const PARTS: [usize; 2] = [6, 2];
/// Number of pictures with rest, which is the first.
const PICTURES: usize = (PARTS[0] + 1) * (PARTS[1] + 1);

/// The pictures of a body that moves.
#[derive(Debug)]
pub(super) struct Moving {
    rhythm: Rhythm,
    size_px: [u32; 2],
    /// Logarithms of primary signal and energy at rest.
    rest: [Vec<f32>; 2],
    pictures: [Option<Picture>; PICTURES],
    /// Noise of the lungs' texture that rays have met.
    noise: Vec<f64>,
    /// What the current moment has more than rest: air on the rays through the middles of pixels; empty at rest.
    air: Vec<f32>,
    /// Its signal, if it differs from that at rest.
    signal: Option<Signal>,
}

/// A picture of a body that has moved: differences from rest.
#[derive(Debug)]
struct Picture {
    /// Of lengths of air on the rays through the middles of pixels.
    air: Vec<f32>,
    /// Of logarithms of primary signal and energy.
    ln: [Vec<f32>; 2],
}

impl Moving {
    /// `None` for a body that does not move, or only with its vessel, and in subtractions, for which the breath is held.
    pub(super) fn new(setup: &Setup) -> Result<Option<Self>> {
        let shown = matches!(setup.spec.xray.mode, Mode::Fluoro | Mode::Cine);
        let (patient, size_px) = (&setup.spec.patient, setup.c_arm.as_ref().map(crate::CArm::size_px));
        let torso = patient.torso.as_ref().filter(|torso| shown && torso.lungs && !patient.vessel_moves);
        let (Some(torso), Some(size_px)) = (torso, size_px) else { return Ok(None) };
        Ok(Some(Self {
            rhythm: Rhythm::new(torso, &setup.spec.flow)?,
            size_px,
            rest: Default::default(),
            pictures: [const { None }; PICTURES],
            noise: vec![],
            air: vec![],
            signal: None,
        }))
    }

    /// Keeps signal and energy of the unscattered photons at rest.
    pub(super) fn rests(&mut self, primaries: &[[f32; 2]]) {
        self.rest = logarithms(primaries);
    }

    /// The signal of the current moment; `None` at rest.
    pub(super) fn signal(&self) -> Option<&Signal> {
        self.signal.as_ref()
    }

    /// Length of air on a ray beyond that at rest.
    #[inline]
    pub(super) fn more_air(&self, ray: usize) -> f32 {
        if self.air.is_empty() { 0.0 } else { finer_at(&self.air, self.size_px, SUBRAYS as usize, ray) }
    }
}

fn logarithms(primaries: &[[f32; 2]]) -> [Vec<f32>; 2] {
    [0, 1].map(|i| {
        let mut values: Vec<f32> = primaries.iter().map(|v| v[i].max(f32::MIN_POSITIVE)).collect();
        ln_lanes(&mut values);
        values
    })
}

/// The pictures that parts of a breath and of a beat lie between, with their weights; that at rest, 0, is left out.
fn between(parts: [f64; 2]) -> Vec<(usize, f32)> {
    let [breath, beat] = [0, 1].map(|of| {
        let place = parts[of].clamp(0.0, 1.0) * PARTS[of] as f64;
        let low = place.floor();
        let share = (place - low) as f32;
        [(low as usize, 1.0 - share), (low as usize + 1, share)]
    });
    let all = breath.into_iter().flat_map(|(k, a)| beat.map(|(j, b)| (k * (PARTS[1] + 1) + j, a * b)));
    all.filter(|&(number, weight)| number > 0 && weight > 0.0).collect()
}

impl Fluoroscope {
    /// Brings the body to its place at a time; without one, and where the vessel is displaced, which takes the body
    /// along, to rest.
    pub(crate) fn breathe(
        &mut self,
        setup: &Setup,
        time_s: Option<f64>,
        engine: &mut dyn PathEngine,
    ) -> Result<()> {
        let Some(moving) = &mut self.moving else { return Ok(()) };
        (moving.air, moving.signal) = (vec![], None);
        let Some(time_s) = time_s.filter(|_| setup.displacement().is_none()) else { return Ok(()) };
        let now = between(moving.rhythm.parts(time_s));
        for &(number, _) in &now {
            self.take_picture(setup, number, engine)?;
        }
        if !now.is_empty() {
            self.mix(&now);
        }
        Ok(())
    }

    /// The picture of parts of a breath and beat, unless it is known.
    fn take_picture(&mut self, setup: &Setup, number: usize, engine: &mut dyn PathEngine) -> Result<()> {
        let Some(moving) = &mut self.moving else { return Ok(()) };
        let Patient::Torso(body) = &*setup.patient else { return Ok(()) };
        if moving.pictures[number].is_some() {
            return Ok(());
        }
        let places = [number / (PARTS[1] + 1), number % (PARTS[1] + 1)];
        let parts = [0, 1].map(|of| places[of] as f64 / PARTS[of] as f64);
        let moved = body.motion.moved(&body.lungs, parts);
        let mut air = air_of(setup, &moved, &self.c_arm, engine, &mut moving.noise)?;
        air.iter_mut().zip(&self.anatomy.lung_of_pixels).for_each(|(air, rest)| *air -= rest);
        moving.air = air;
        let ln = self.changes();
        let Some(moving) = &mut self.moving else { return Ok(()) };
        moving.pictures[number] = Some(Picture { air: std::mem::take(&mut moving.air), ln });
        Ok(())
    }

    /// By how much the logarithms of signal and energy of all pixels differ from rest: not where there is as much air.
    fn changes(&self) -> [Vec<f32>; 2] {
        let Some(moving) = &self.moving else { return Default::default() };
        let changed = |pixel: usize| {
            let (first, stride) = self.first_ray(pixel);
            let rays = [first, first + 1, first + stride, first + stride + 1];
            rays.into_iter().any(|ray| moving.more_air(ray) != 0.0)
        };
        let pixels: Vec<usize> = (0..moving.rest[0].len()).filter(|&pixel| changed(pixel)).collect();
        let drawn = pixels.par_iter().with_min_len(FEWEST_PIXELS);
        let drawn: Vec<[f32; 2]> = drawn
            .map_init(Room::default, |room, &pixel| self.primary(pixel, [self.fraction, 0.0], room))
            .collect();
        let ln = logarithms(&drawn);
        [0, 1].map(|i| {
            let mut all = vec![0.0; moving.rest[i].len()];
            pixels.iter().zip(&ln[i]).for_each(|(&pixel, ln)| all[pixel] = ln - moving.rest[i][pixel]);
            all
        })
    }

    /// Air and signal of the current moment from its pictures.
    fn mix(&mut self, now: &[(usize, f32)]) {
        let Some(moving) = &self.moving else { return };
        let known = || now.iter().filter_map(|&(k, weight)| Some((moving.pictures[k].as_ref()?, weight)));
        let mut air = vec![0.0; moving.rest[0].len()];
        for (picture, weight) in known() {
            air.iter_mut().zip(&picture.air).for_each(|(air, more)| *air += weight * more);
        }
        let mixed = |i: usize| {
            let mut values = moving.rest[i].clone();
            values.par_chunks_mut(FEWEST_PIXELS).enumerate().for_each(|(chunk, values)| {
                let first = chunk * FEWEST_PIXELS;
                for (picture, weight) in known() {
                    let more = &picture.ln[i][first..];
                    values.iter_mut().zip(more).for_each(|(value, more)| *value += weight * more);
                }
                for lanes in values.chunks_mut(LANES) {
                    let mut room = [0.0; LANES];
                    room[..lanes.len()].copy_from_slice(lanes);
                    lanes.copy_from_slice(&exp_lanes(room)[..lanes.len()]);
                }
                for (pixel, value) in (first..).zip(values) {
                    *value = *value * self.c_arm.openness(pixel) as f32 + self.still.scatter.still(pixel)[i];
                }
            });
            values
        };
        let signal = Signal { signal: mixed(0), energy: mixed(1) };
        if let Some(moving) = &mut self.moving {
            (moving.air, moving.signal) = (air, Some(signal));
        }
    }

    /// Adds what the current moment has more than rest to lengths of air at rest on the rays through the middles of pixels.
    pub(crate) fn add_air(&self, lengths: &mut [f32]) {
        let Some(moving) = &self.moving else { return };
        lengths.iter_mut().zip(&moving.air).for_each(|(length, more)| *length += more);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_lies_between_pictures_of_both_motions_and_rest_is_none() {
        assert_eq!(between([0.0; 2]), []);
        assert_eq!(between([1.0 / 12.0, 0.0]), [(3, 0.5)]);
        assert_eq!(between([0.0, 0.75]), [(1, 0.5), (2, 0.5)]);
        assert_eq!(between([1.0, 1.0]), [(PICTURES - 1, 1.0)]);
        // Beside the four of both, none of one motion alone.
        let both = between([0.25, 0.25]);
        assert_eq!(both, [(3, 0.25), (4, 0.25), (6, 0.25), (7, 0.25)]);
    }
}
