//! The voxels that are to become a vessel: cut out of a label map, without hollows, part by part.

use std::collections::VecDeque;

/// Voxels of background around the label: faces are looked for from the second voxel on, and the first of them is background.
const MARGIN: usize = 2;

/// Voxels in a box, the first index fastest.
#[derive(Debug, Clone)]
pub(super) struct Mask {
    pub(super) size: [usize; 3],
    /// Index in the picture of the first voxel; negative in the margin.
    pub(super) from: [i64; 3],
    pub(super) inside: Vec<bool>,
}

impl Mask {
    /// The voxels of a picture of this size for which `is_label` holds, with a margin around them; `None` if there is
    /// none.
    pub(super) fn of(picture: [usize; 3], is_label: impl Fn(usize) -> bool) -> Option<Self> {
        let [nx, ny, nz] = picture;
        let (mut low, mut high) = ([usize::MAX; 3], [0; 3]);
        let mut found = false;
        let mut index = 0;
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    if is_label(index) {
                        found = true;
                        for (k, at) in [x, y, z].into_iter().enumerate() {
                            (low[k], high[k]) = (low[k].min(at), high[k].max(at));
                        }
                    }
                    index += 1;
                }
            }
        }
        if !found {
            return None;
        }
        let size = [0, 1, 2].map(|k| high[k] - low[k] + 1 + 2 * MARGIN);
        let from = low.map(|at| at as i64 - MARGIN as i64);
        let mut mask = Self { size, from, inside: vec![false; size.iter().product()] };
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    if is_label((z * ny + y) * nx + x) {
                        let at = [x - low[0], y - low[1], z - low[2]].map(|k| k + MARGIN);
                        let own = mask.index(at);
                        mask.inside[own] = true;
                    }
                }
            }
        }
        Some(mask)
    }

    /// The same voxels with so many more of background on all sides.
    pub(super) fn padded(&self, by: usize) -> Self {
        let size = self.size.map(|n| n + 2 * by);
        let from = self.from.map(|at| at - by as i64);
        let mut padded = Self { size, from, inside: vec![false; size.iter().product()] };
        for (index, _) in self.inside.iter().enumerate().filter(|(_, inside)| **inside) {
            let own = padded.index(self.place(index).map(|k| k + by));
            padded.inside[own] = true;
        }
        padded
    }

    pub(super) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    pub(super) fn place(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [index % nx, index / nx % ny, index / nx / ny]
    }

    /// Number of voxels inside.
    pub(super) fn count(&self) -> usize {
        self.inside.iter().filter(|inside| **inside).count()
    }

    /// The voxels around one, at all of these offsets, that are in the box.
    pub(super) fn around(
        &self,
        index: usize,
        offsets: &'static [[i64; 3]],
    ) -> impl Iterator<Item = usize> + use<'_> {
        let at = self.place(index);
        offsets.iter().filter_map(move |offset| {
            let mut to = [0; 3];
            for k in 0..3 {
                let moved = at[k] as i64 + offset[k];
                if moved < 0 || moved >= self.size[k] as i64 {
                    return None;
                }
                to[k] = moved as usize;
            }
            Some(self.index(to))
        })
    }

    /// Fills what the label encloses, and returns the number of voxels filled. A device in a vessel could not get there,
    /// and contrast medium neither.
    pub(super) fn fill_hollows(&mut self) -> usize {
        let mut outside = vec![false; self.inside.len()];
        // The margin is background, so its first voxel is outside.
        let mut queue = VecDeque::from([0]);
        outside[0] = true;
        while let Some(index) = queue.pop_front() {
            for next in self.around(index, &FACES) {
                if !self.inside[next] && !outside[next] {
                    outside[next] = true;
                    queue.push_back(next);
                }
            }
        }
        let mut filled = 0;
        for (inside, outside) in self.inside.iter_mut().zip(outside) {
            if !*inside && !outside {
                *inside = true;
                filled += 1;
            }
        }
        filled
    }

    /// The number of the part of each voxel, the largest part being 0 and background [`NO_PART`], and the number of
    /// voxels of each part. Voxels that share a face or an edge are of one part.
    pub(super) fn parts(&self) -> (Vec<u32>, Vec<usize>) {
        let mut of = vec![NO_PART; self.inside.len()];
        let mut sizes = Vec::new();
        let mut queue = VecDeque::new();
        for first in 0..self.inside.len() {
            if !self.inside[first] || of[first] != NO_PART {
                continue;
            }
            let part = sizes.len() as u32;
            let mut size = 0;
            of[first] = part;
            queue.push_back(first);
            while let Some(index) = queue.pop_front() {
                size += 1;
                for next in self.around(index, &FACES_AND_EDGES) {
                    if self.inside[next] && of[next] == NO_PART {
                        of[next] = part;
                        queue.push_back(next);
                    }
                }
            }
            sizes.push(size);
        }
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_by_key(|part| std::cmp::Reverse(sizes[*part]));
        let mut rank = vec![0; sizes.len()];
        for (place, part) in order.iter().enumerate() {
            rank[*part] = place as u32;
        }
        for part in of.iter_mut().filter(|part| **part != NO_PART) {
            *part = rank[*part as usize];
        }
        (of, order.into_iter().map(|part| sizes[part]).collect())
    }

    /// Keeps the voxels for which `keep` holds.
    pub(super) fn keep(&mut self, keep: impl Fn(usize) -> bool) {
        for (index, inside) in self.inside.iter_mut().enumerate() {
            *inside &= keep(index);
        }
    }

    /// Fraction of the voxels that have background on both sides along some axis: where a vessel is a single voxel thick.
    pub(super) fn thin_part(&self) -> f64 {
        let strides = [1, self.size[0], self.size[0] * self.size[1]];
        let (mut thin, mut all) = (0_usize, 0_usize);
        for (index, _) in self.inside.iter().enumerate().filter(|(_, inside)| **inside) {
            all += 1;
            thin += usize::from(strides.iter().any(|s| !self.inside[index - s] && !self.inside[index + s]));
        }
        thin as f64 / all.max(1) as f64
    }
}

/// No part.
pub(super) const NO_PART: u32 = u32::MAX;

/// Voxels that share a face.
pub(super) static FACES: [[i64; 3]; 6] =
    [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

/// Voxels that share a face or an edge.
pub(super) static FACES_AND_EDGES: [[i64; 3]; 18] = {
    let mut offsets = [[0; 3]; 18];
    let (mut at, mut n) = (0, 0);
    while n < 27 {
        let offset = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
        let steps = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        if steps == 1 || steps == 2 {
            offsets[at] = offset;
            at += 1;
        }
        n += 1;
    }
    offsets
};
