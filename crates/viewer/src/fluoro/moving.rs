//! A body that breathes and whose heart beats, at the cost of a still one.
//!
//! Pictures of the body are made at a few parts of a breath and of a beat, each when it is first needed. Between them
//! lengths of air L and the logarithms of primary signals are linear, which agree, since a signal is nearly the
//! exponential of a length:
//!
//! ```text
//! L = L₀ + Σ wₖ (Lₖ − L₀),    ln S = ln S₀ + Σ wₖ (ln Sₖ − ln S₀)
//! ```
//!
//! Breath and beat are added. Scatter, exposure and window stay those of the body at rest.

use endowire_core::Result;
use rayon::prelude::*;

use super::anatomy::{air_of, finer};
use super::{FEWEST_PIXELS, Fluoroscope, SUBRAYS, Signal};
use crate::engine::PathEngine;
use crate::patient::{Patient, Rhythm};
use crate::scene::Setup;
use crate::spec::Mode;
use crate::xray::{LANES, exp_lanes, ln_lanes};

/// Numbers of pictures of a breath and of a beat, besides that at rest: two and one millimetre apart as a rule. Half as
/// many show borders twice.
const PICTURES: [usize; 2] = [6, 4];

/// The pictures of a body that moves.
#[derive(Debug)]
pub(super) struct Moving {
    rhythm: Rhythm,
    /// Logarithms of primary signal and energy at rest.
    rest: [Vec<f32>; 2],
    pictures: [[Option<Picture>; PICTURES[0]]; 2],
    /// Which pictures make up the current moment: of breath (0) or beat (1), number, weight.
    now: Vec<(usize, usize, f32)>,
    /// Their signal, if it differs from that at rest.
    signal: Option<Signal>,
}

/// A picture of a body that has moved.
#[derive(Debug)]
struct Picture {
    /// Lengths of air on the rays through the middles of pixels.
    central: Vec<f32>,
    /// Differences from rest: of lengths of air on all rays, and of logarithms of primary signal and energy.
    air: Vec<f32>,
    ln: [Vec<f32>; 2],
}

impl Moving {
    /// `None` for a body that does not move, and in subtractions, for which the breath is held.
    pub(super) fn new(setup: &Setup) -> Result<Option<Self>> {
        let shown = matches!(setup.spec.xray.mode, Mode::Fluoro | Mode::Cine);
        let Some(torso) = setup.spec.patient.torso.as_ref().filter(|torso| shown && torso.lungs) else {
            return Ok(None);
        };
        let rhythm = Rhythm::new(torso, &setup.spec.flow)?;
        Ok(Some(Self {
            rhythm,
            rest: Default::default(),
            pictures: Default::default(),
            now: vec![],
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
        self.now.iter().map(|&(of, k, weight)| weight * self.at(of, k).map_or(0.0, |p| p.air[ray])).sum()
    }

    fn at(&self, of: usize, number: usize) -> Option<&Picture> {
        self.pictures[of][number].as_ref()
    }
}

fn logarithms(primaries: &[[f32; 2]]) -> [Vec<f32>; 2] {
    [0, 1].map(|i| {
        let mut values: Vec<f32> = primaries.iter().map(|v| v[i].max(f32::MIN_POSITIVE)).collect();
        ln_lanes(&mut values);
        values
    })
}

/// The pictures that a part of a breath or beat lies between, with their weights; that at rest counts as none.
fn between(part: f64, pictures: usize) -> impl Iterator<Item = (usize, f32)> {
    let place = part.clamp(0.0, 1.0) * pictures as f64;
    let low = place.floor();
    let share = (place - low) as f32;
    let low = low as usize;
    let both = [(low.checked_sub(1), 1.0 - share), (Some(low), share)];
    both.into_iter().filter_map(|(k, weight)| Some((k?, weight))).filter(|(_, weight)| *weight > 0.0)
}

impl Fluoroscope {
    /// Brings the body to its place at a time; without one, and where the vessel moves by its own field, which takes the
    /// body along, to rest.
    pub(crate) fn breathe(
        &mut self,
        setup: &Setup,
        time_s: Option<f64>,
        engine: &mut dyn PathEngine,
    ) -> Result<()> {
        let Some(moving) = &mut self.moving else { return Ok(()) };
        (moving.now, moving.signal) = (vec![], None);
        let Some(time_s) = time_s.filter(|_| setup.displacement().is_none()) else { return Ok(()) };
        let parts = moving.rhythm.parts(time_s);
        let now: Vec<_> = (0..2)
            .flat_map(|of| between(parts[of], PICTURES[of]).map(move |(k, weight)| (of, k, weight)))
            .collect();
        for &(of, number, _) in &now {
            self.take_picture(setup, of, number, engine)?;
        }
        if let Some(moving) = self.moving.as_mut().filter(|_| !now.is_empty()) {
            moving.now = now;
            self.mix();
        }
        Ok(())
    }

    /// The picture of a part of a breath or beat, unless it is known.
    fn take_picture(
        &mut self,
        setup: &Setup,
        of: usize,
        number: usize,
        engine: &mut dyn PathEngine,
    ) -> Result<()> {
        let Some(moving) = &self.moving else { return Ok(()) };
        let Patient::Torso(body) = &*setup.patient else { return Ok(()) };
        if moving.at(of, number).is_some() {
            return Ok(());
        }
        let mut parts = [0.0; 2];
        parts[of] = (number + 1) as f64 / PICTURES[of] as f64;
        let central = air_of(setup, &body.motion.moved(&body.lungs, parts), &self.c_arm, engine)?;
        let mut air = finer(central.clone(), self.c_arm.size_px(), SUBRAYS);
        air.iter_mut().zip(&self.anatomy.lung).for_each(|(air, rest)| *air -= rest);
        if let Some(moving) = &mut self.moving {
            moving.pictures[of][number] = Some(Picture { central, air, ln: Default::default() });
            moving.now = vec![(of, number, 1.0)];
        }
        let mut ln = logarithms(&self.primaries());
        if let Some(moving) = &mut self.moving {
            for (ln, rest) in ln.iter_mut().zip(&moving.rest) {
                ln.iter_mut().zip(rest).for_each(|(ln, rest)| *ln -= rest);
            }
            if let Some(picture) = &mut moving.pictures[of][number] {
                picture.ln = ln;
            }
            moving.now = vec![];
        }
        Ok(())
    }

    /// The signal of the current moment from its pictures.
    fn mix(&mut self) {
        let Some(moving) = &self.moving else { return };
        let mixed = |i: usize| {
            let mut values = moving.rest[i].clone();
            values.par_chunks_mut(FEWEST_PIXELS).enumerate().for_each(|(chunk, values)| {
                let first = chunk * FEWEST_PIXELS;
                for &(of, k, weight) in &moving.now {
                    let Some(picture) = moving.at(of, k) else { continue };
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
            moving.signal = Some(signal);
        }
    }

    /// Adds what the current moment has more than rest to lengths of air at rest on the rays through the middles of pixels.
    pub(crate) fn add_air(&self, lengths: &mut [f32]) {
        let Some(moving) = &self.moving else { return };
        let rest = lengths.to_vec();
        for &(of, k, weight) in &moving.now {
            let Some(picture) = moving.at(of, k) else { continue };
            let moved = picture.central.iter().zip(&rest);
            lengths
                .iter_mut()
                .zip(moved)
                .for_each(|(length, (moved, rest))| *length += weight * (moved - rest));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_lies_between_two_pictures_and_rest_is_none() {
        let of = |part: f64| between(part, 4).collect::<Vec<_>>();
        assert_eq!(of(0.0), []);
        assert_eq!(of(0.125), [(0, 0.5)]);
        assert_eq!(of(0.625), [(1, 0.5), (2, 0.5)]);
        assert_eq!(of(1.0), [(3, 1.0)]);
    }
}
