//! How far a vessel reaches from the spine's middle at each height: lungs leave room for it.

use endowire_core::vessel::SurfaceMesh;

/// Heights are sorted into bins of this size, mm.
const BIN_MM: f64 = 5.0;
/// Bins by which the reach of a place extends up and down, and over which it is averaged.
const EXTENDS: usize = 2;
const AVERAGED: usize = 3;
/// Bins above and below the vessel, in which its reach fades to nothing.
const AROUND: usize = 10;

/// Reach of a vessel by height.
#[derive(Debug, Default)]
pub(super) struct Beside {
    lowest_mm: f64,
    /// To the left, to the right, and forward, mm; 0 where it does not reach beyond the middle.
    reach_mm: Vec<[f64; 3]>,
}

impl Beside {
    /// The reach of a wall from a spine there: left, posterior.
    pub(super) fn new(wall: &SurfaceMesh, spine_mm: [f64; 2]) -> Self {
        let Some((low, high)) = wall.bounds_mm() else { return Self::default() };
        let lowest_mm = low.z - BIN_MM * AROUND as f64;
        let count = ((high.z - low.z) / BIN_MM) as usize + 1 + 2 * AROUND;
        let mut bins = vec![[0.0_f64; 3]; count];
        for place in &wall.vertices_mm {
            let bin = &mut bins[(((place.z - lowest_mm) / BIN_MM) as usize).min(count - 1)];
            let [left, back] = [place.x - spine_mm[0], place.y - spine_mm[1]];
            for (reach, here) in bin.iter_mut().zip([left, -left, -back]) {
                *reach = reach.max(here);
            }
        }
        let around = |k: usize, by: usize| k.saturating_sub(by)..(k + by + 1).min(count);
        let extended: Vec<[f64; 3]> = (0..count)
            .map(|k| {
                let most = |way: usize| around(k, EXTENDS).map(|j| bins[j][way]).fold(0.0, f64::max);
                [0, 1, 2].map(most)
            })
            .collect();
        let averaged = |k: usize| {
            let beside = around(k, AVERAGED);
            let n = beside.len() as f64;
            [0, 1, 2].map(|way| beside.clone().map(|j| extended[j][way]).sum::<f64>() / n)
        };
        Self { lowest_mm, reach_mm: (0..count).map(averaged).collect() }
    }

    /// The reach at a height: left, right, forward.
    pub(super) fn at(&self, z: f64) -> [f64; 3] {
        let place = (z - self.lowest_mm) / BIN_MM - 0.5;
        let of = |k: f64| match k >= 0.0 && (k as usize) < self.reach_mm.len() {
            true => self.reach_mm[k as usize],
            false => [0.0; 3],
        };
        let (low, part) = (place.floor(), place - place.floor());
        let (a, b) = (of(low), of(low + 1.0));
        std::array::from_fn(|way| a[way] + (b[way] - a[way]) * part)
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;

    use super::*;

    #[test]
    fn reach_is_that_of_the_wall_at_its_height_and_nothing_far_away() {
        let place = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
        let wide = (0..80).map(|k| place(40.0, -10.0, f64::from(k)));
        let slim = (80..200).map(|k| place(5.0, -50.0, f64::from(k)));
        let wall = SurfaceMesh { vertices_mm: wide.chain(slim).collect(), triangles: vec![] };
        let beside = Beside::new(&wall, [0.0, 30.0]);
        assert_eq!(beside.at(40.0), [40.0, 0.0, 40.0]);
        assert_eq!(beside.at(140.0), [5.0, 0.0, 80.0]);
        let between = beside.at(85.0)[0];
        assert!(between > 5.0 && between < 40.0, "{between}");
        assert_eq!([beside.at(-80.0), beside.at(300.0)], [[0.0; 3]; 2]);
        assert_eq!(Beside::default().at(0.0), [0.0; 3]);
    }
}
