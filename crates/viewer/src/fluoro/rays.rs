//! Unscattered photons of a pixel, from its rays and device cells.

use super::{Fluoroscope, RAYS, SUBRAYS};
use crate::cpu::{CELLS, quarter};
use crate::xray::{LANES, Lanes};

/// Difference of line integrals of a pixel's rays below which lengths are averaged before the spectrum.
const ALIKE: f32 = 3e-2;
/// The same for cells, whose variance counts: for evenly spread ones, the neglected term is 0.5⁴/1920, below 10⁻⁴.
const ALIKE_CELLS: f32 = 0.5;

/// Work buffers.
#[derive(Debug, Default)]
pub(super) struct Room {
    lanes: Lanes,
    alike: Vec<Alike>,
    known: Known,
}

/// Cells of a pixel with similar line integrals inside devices.
#[derive(Debug, Default)]
struct Alike {
    /// The first of them.
    first: f32,
    count: f32,
    /// Sums of line integrals and their squares.
    integrals: [f32; 2],
    /// Sums of lengths, by material.
    lengths: Vec<f32>,
}

/// No group.
const NONE: u8 = u8::MAX;

/// The groups of a pixel's cells, by their line integrals.
#[derive(Debug)]
struct Known([u8; KNOWN]);

/// Number of steps of line integrals that are told apart, and of those above zero: beyond them nothing is let through.
const KNOWN: usize = 160;
const ABOVE_ZERO: f32 = 40.0;

impl Default for Known {
    fn default() -> Self {
        Self([NONE; KNOWN])
    }
}

impl Known {
    /// The place of the group for a line integral.
    #[inline]
    fn of(&mut self, integral: f32) -> &mut u8 {
        // Cells without a device are not together with those in which there is some.
        let step = ABOVE_ZERO - integral / ALIKE_CELLS;
        &mut self.0[step.clamp(0.0, (KNOWN - 1) as f32) as usize]
    }
}

impl Fluoroscope {
    /// First ray of a pixel, and number of rays per row.
    pub(super) fn first_ray(&self, pixel: usize) -> (usize, usize) {
        let (width, sub) = (self.c_arm.size_px()[0] as usize, SUBRAYS as usize);
        (pixel / width * sub * width * sub + pixel % width * sub, width * sub)
    }

    /// Signal and energy of the unscattered photons of a pixel without blades, for a fraction of contrast medium in
    /// its lumen and a length of it in tissue.
    pub(super) fn primary(&self, pixel: usize, medium: [f32; 2], room: &mut Room) -> [f32; 2] {
        let (first, stride) = self.first_ray(pixel);
        let rays: [usize; RAYS] =
            std::array::from_fn(|k| first + k / SUBRAYS as usize * stride + k % SUBRAYS as usize);
        let mut layers = [[0.0; 5]; RAYS];
        // A loop is inlined where a map of the array is not, which saves a tenth of the time of an image.
        layers.iter_mut().zip(rays).for_each(|(layers, ray)| *layers = self.layers(ray, medium));
        match (self.alike(&layers), self.devices.place(pixel)) {
            (Some((mean, more)), None) => self.behind(mean, &[], &mut room.lanes).map(|v| more * v),
            (None, None) => self.of_rays(&layers, &mut room.lanes),
            (Some((mean, more)), Some(place)) => {
                self.of_cells((place, 0..CELLS), mean, medium[0], room).map(|v| more * v)
            }
            (None, Some(place)) => {
                let mut sum = [0.0; 2];
                for (ray, layers) in layers.into_iter().enumerate() {
                    let cells = (0..CELLS).filter(move |&cell| quarter(cell) == ray);
                    let behind = self.of_cells((place, cells), layers, medium[0], room);
                    (0..2).for_each(|i| sum[i] += behind[i] / RAYS as f32);
                }
                sum
            }
        }
    }

    /// The mean over rays.
    pub(super) fn of_rays(&self, layers: &[[f32; 5]; RAYS], room: &mut Lanes) -> [f32; 2] {
        let mut sum = [0.0; 2];
        for lengths in layers {
            let behind = self.behind(*lengths, &[], room);
            (0..2).for_each(|i| sum[i] += behind[i]);
        }
        sum.map(|sum| sum / RAYS as f32)
    }

    /// The mean over the cells at a position, whose rays are equal except for devices: similar cells are merged.
    fn of_cells(
        &self,
        (place, cells): (usize, impl Iterator<Item = usize>),
        layers: [f32; 5],
        fraction: f32,
        room: &mut Room,
    ) -> [f32; 2] {
        let maps = self.devices.maps();
        // Attenuation that a device displaces.
        let filling = self.mu[3] + fraction * self.mu[4];
        let mut integrals = [0.0; CELLS];
        for ((_, cells), of) in maps.iter().zip(&self.device_lanes) {
            let more = of.2 - filling;
            integrals.iter_mut().zip(&cells[place]).for_each(|(p, length)| *p += more * length);
        }
        let mut used = 0;
        for cell in cells {
            let p = integrals[cell];
            let known = room.known.of(p);
            if *known == NONE {
                *known = used as u8;
                if used == room.alike.len() {
                    room.alike.push(Alike::default());
                }
                let group = &mut room.alike[used];
                (group.first, group.count, group.integrals) = (p, 0.0, [0.0; 2]);
                group.lengths.clear();
                group.lengths.resize(maps.len(), 0.0);
                used += 1;
            }
            let group = &mut room.alike[*known as usize];
            group.count += 1.0;
            group.integrals[0] += p;
            group.integrals[1] += p * p;
            group.lengths.iter_mut().zip(maps).for_each(|(sum, map)| *sum += map.1[place][cell]);
        }
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        for group in &mut room.alike[..used] {
            *room.known.of(group.first) = NONE;
            let each = 1.0 / group.count;
            group.lengths.iter_mut().for_each(|length| *length *= each);
            let inside: f32 = group.lengths.iter().sum();
            let mut layers = layers;
            layers[3] -= inside;
            layers[4] -= fraction * inside;
            let mean = each * group.integrals[0];
            let variance = (each * group.integrals[1] - mean * mean).max(0.0);
            let weight = group.count * (1.0 + 0.5 * variance);
            let behind = self.behind(layers, &group.lengths, &mut room.lanes);
            (0..2).for_each(|i| sum[i] += weight * behind[i]);
            count += group.count;
        }
        sum.map(|sum| sum / count)
    }

    /// Signal and energy behind lengths in the static anatomy and in the materials of devices.
    #[inline]
    fn behind(&self, lengths: [f32; 5], of_devices: &[f32], room: &mut Lanes) -> [f32; 2] {
        let mut sum = [[0.0; LANES]; 2];
        let still = self.lanes.iter().zip(lengths);
        let devices = self.device_lanes.iter().map(|of| &of.1).zip(of_devices.iter().copied());
        self.beam.add(still.chain(devices).filter(|layer| layer.1 != 0.0), room, &mut sum);
        sum.map(|sum| sum.iter().sum::<f32>())
    }

    /// Lengths of a ray in the static anatomy without devices, as required by [`Beam::add`](crate::xray::Beam::add).
    #[inline]
    pub(super) fn layers(&self, ray: usize, [fraction, tissue_mm]: [f32; 2]) -> [f32; 5] {
        let more_air_mm = self.moving.as_ref().map_or(0.0, |moving| moving.more_air(ray));
        let [tissue, bone, lung, lumen] = self.anatomy.at(ray, more_air_mm);
        let medium = lumen * fraction - self.anatomy.faded(ray) * self.fraction + tissue_mm;
        [tissue - self.beam.reference_mm(), bone, lung, lumen, medium]
    }

    /// If the rays of a pixel differ little: their mean lengths, and the ratio of their mean signal to the signal of
    /// these, 1 + ½ var p at the mean energy. The neglected terms, of third order and due to the spectrum's width,
    /// are below 10⁻⁵: half a step of 16 bits.
    #[inline]
    pub(super) fn alike(&self, layers: &[[f32; 5]; RAYS]) -> Option<([f32; 5], f32)> {
        let mut mean = layers[0];
        layers[1..].iter().for_each(|of| (0..5).for_each(|k| mean[k] += of[k]));
        mean.iter_mut().for_each(|length| *length /= RAYS as f32);
        let mut variance = 0.0;
        for of in layers {
            let (mut off, mut most) = (0.0, 0.0);
            for k in 0..5 {
                let p = self.mu[k] * (of[k] - mean[k]);
                off += p;
                most += p.abs();
            }
            if most > ALIKE / 2.0 {
                return None;
            }
            variance += off * off / RAYS as f32;
        }
        Some((mean, 1.0 + variance / 2.0))
    }
}
