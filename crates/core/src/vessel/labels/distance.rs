//! Distances in a mask: from the background, and along the vessel.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::Matrix3;

use super::mask::{FACES_AND_EDGES, Mask};
use crate::Vec3;

/// No voxel.
const NONE: u32 = u32::MAX;

/// The voxels inside a mask, numbered from 0 in the order of their indices.
pub(super) struct Voxels<'a> {
    pub(super) mask: &'a Mask,
    /// Number of each voxel of the box.
    number: Vec<u32>,
    /// Index of each voxel inside.
    pub(super) index: Vec<u32>,
    axes: Matrix3<f64>,
}

impl<'a> Voxels<'a> {
    pub(super) fn of(mask: &'a Mask, axes: Matrix3<f64>) -> Self {
        let (mut number, mut index) = (vec![NONE; mask.inside.len()], Vec::new());
        for (at, _) in mask.inside.iter().enumerate().filter(|(_, inside)| **inside) {
            number[at] = index.len() as u32;
            index.push(at as u32);
        }
        Self { mask, number, index, axes }
    }

    pub(super) fn len(&self) -> usize {
        self.index.len()
    }

    /// Centre of a voxel, mm from the centre of the picture's first one.
    pub(super) fn centre_mm(&self, voxel: u32) -> Vec3 {
        let at = self.mask.place(self.index[voxel as usize] as usize);
        self.axes * Vec3::from_fn(|k, _| (at[k] as i64 + self.mask.from[k]) as f64)
    }

    /// From a voxel to the next one along each axis, mm.
    pub(super) fn axes(&self) -> &Matrix3<f64> {
        &self.axes
    }

    /// The voxels inside that share a face or an edge with this one.
    pub(super) fn around(&self, voxel: u32) -> impl Iterator<Item = u32> {
        let around = self.mask.around(self.index[voxel as usize] as usize, &FACES_AND_EDGES);
        around.map(|index| self.number[index]).filter(|voxel| *voxel != NONE)
    }

    /// Shortest ways within the vessel from the nearest of some voxels, mm; infinite where they are longer than
    /// `limit_mm`.
    pub(super) fn ways_mm(&self, from: &[u32], limit_mm: f64) -> Vec<f32> {
        let mut ways = vec![f32::INFINITY; self.len()];
        // Positive numbers have the order of their bits.
        let mut queue = BinaryHeap::new();
        for voxel in from {
            ways[*voxel as usize] = 0.0;
            queue.push(Reverse((0_u32, *voxel)));
        }
        while let Some(Reverse((bits, voxel))) = queue.pop() {
            let own = f32::from_bits(bits);
            if own > ways[voxel as usize] {
                continue;
            }
            let at = self.centre_mm(voxel);
            for next in self.around(voxel) {
                let way = own + (self.centre_mm(next) - at).norm() as f32;
                if way < ways[next as usize] && f64::from(way) <= limit_mm {
                    ways[next as usize] = way;
                    queue.push(Reverse((way.to_bits(), next)));
                }
            }
        }
        ways
    }

    /// Distance of each voxel's centre from that of the nearest background voxel, less half a voxel, mm: about the radius
    /// of the largest sphere there. What is beyond the picture counts as background: a picture that is cropped to the
    /// label shows nothing else beside it.
    pub(super) fn clearance_mm(&self) -> Vec<f32> {
        let mask = self.mask;
        let sides: [f64; 3] = std::array::from_fn(|k| self.axes.column(k).norm());
        let far = 1e30_f32;
        let mut squares: Vec<f32> =
            mask.inside.iter().map(|inside| if *inside { far } else { 0.0 }).collect();
        let strides = [1, mask.size[0], mask.size[0] * mask.size[1]];
        for axis in 0..3 {
            let length = mask.size[axis];
            let (mut line, mut parabolas) = (vec![0.0; length], Parabolas::default());
            let lines = (0..mask.inside.len()).filter(|index| mask.place(*index)[axis] == 0);
            for first in lines.collect::<Vec<_>>() {
                for k in 0..length {
                    line[k] = f64::from(squares[first + k * strides[axis]]);
                }
                parabolas.lower(&mut line, sides[axis]);
                for k in 0..length {
                    squares[first + k * strides[axis]] = line[k] as f32;
                }
            }
        }
        let half = sides.iter().copied().fold(f64::MAX, f64::min) / 2.0;
        self.index.iter().map(|index| (f64::from(squares[*index as usize]).sqrt() - half) as f32).collect()
    }
}

/// The lower envelope of parabolas: squared distances along a line (Felzenszwalb and Huttenlocher, "Distance transforms
/// of sampled functions", Theory of Computing 8, 2012).
#[derive(Default)]
struct Parabolas {
    /// Places of the lowest ones, and where each begins to be the lowest.
    at: Vec<usize>,
    from: Vec<f64>,
}

impl Parabolas {
    /// Replaces values on a line, `side` apart, by the least of value + distance².
    fn lower(&mut self, line: &mut [f64], side: f64) {
        self.at.clear();
        self.from.clear();
        let square = |k: usize| (k as f64 * side).powi(2);
        for k in 0..line.len() {
            let mut begins = f64::NEG_INFINITY;
            while let (Some(&last), Some(&from)) = (self.at.last(), self.from.last()) {
                let meet = (line[k] + square(k) - line[last] - square(last))
                    / (2.0 * side * (k as f64 - last as f64));
                if meet > from {
                    begins = meet;
                    break;
                }
                self.at.pop();
                self.from.pop();
            }
            self.at.push(k);
            self.from.push(begins);
        }
        let mut lowest = 0;
        let values: Vec<f64> = (0..line.len())
            .map(|k| {
                while lowest + 1 < self.at.len() && self.from[lowest + 1] < k as f64 * side {
                    lowest += 1;
                }
                let nearest = self.at[lowest];
                line[nearest] + ((k as f64 - nearest as f64) * side).powi(2)
            })
            .collect();
        line.copy_from_slice(&values);
    }
}
