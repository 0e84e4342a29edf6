//! The nearest piece of wall, cached by position.
//!
//! A device takes the same way again and again, and each of its points queries the triangle nearest to it. Space is
//! divided into cubic cells, and the piece nearest to the middle of a cell is found once, for all points in it.
//! Results depend on the cell alone, not on earlier queries.

use crate::Vec3;
use crate::contact::ContactSurface;
use crate::tuning::ContactTuning;

/// Number of cells cached; a power of two. A device of a metre occupies some thousands.
const CELLS: usize = 1 << 14;
/// Largest magnitude of a cell's index.
const FARTHEST: f64 = 1e9;
/// Margin of the search for a piece nearer than a known one, as a fraction of its distance and of the reach: against
/// rounding.
const CLOSE: f64 = 1e-9;
/// Stands for no triangle.
const NONE: u32 = u32::MAX;

/// The wall around a position.
#[derive(Debug, Clone, Copy)]
pub(super) struct Proximity {
    /// The position.
    pub(super) middle: Vec3,
    /// A lower bound of its distance to the wall, mm.
    pub(super) clearance_mm: f64,
    /// The nearest piece; `None` beyond the reach of the query or past the end of the vessel.
    pub(super) piece: Option<u32>,
}

impl Proximity {
    /// A lower bound of the distance from `x` to the wall, mm.
    pub(super) fn clearance(&self, x: &Vec3) -> f64 {
        self.clearance_mm - (x - self.middle).norm()
    }
}

/// A cell that was queried.
#[derive(Debug, Clone, Copy)]
struct Cell {
    key: [i32; 3],
    piece: u32,
    clearance_mm: f64,
}

/// The results for queried cells.
#[derive(Debug, Clone)]
pub(super) struct ProximityCache {
    size_mm: f64,
    reach_mm: f64,
    farther: i32,
    farther_by: f64,
    cells: Vec<Cell>,
    /// The piece that was found last.
    last: u32,
    /// Hierarchy queries since the last count.
    pub(super) queries: u64,
}

impl ProximityCache {
    /// Cells with all points within `radius_mm` of their middle, from which walls are sought up to `reach_mm` away.
    fn new(radius_mm: f64, reach_mm: f64, tuning: &ContactTuning) -> Self {
        let unknown = Cell { key: [i32::MIN; 3], piece: NONE, clearance_mm: 0.0 };
        let size_mm = radius_mm * 2.0 / 3f64.sqrt();
        let ContactTuning { farther, farther_by, .. } = *tuning;
        Self { size_mm, reach_mm, farther, farther_by, cells: vec![unknown; CELLS], last: NONE, queries: 0 }
    }

    /// For the queries of a surface.
    pub(super) fn of(surface: &ContactSurface) -> Self {
        let tuning = &surface.tuning;
        Self::new(tuning.look_again * surface.thinnest_mm, surface.reach_mm, tuning)
    }

    /// The piece nearest to `x` itself.
    fn ask(&mut self, surface: &ContactSurface, x: &Vec3) -> Proximity {
        self.queries += 1;
        // If no wall is near, the point may be far from it on either side. An unlimited query would visit most of the
        // wall; the last piece found is mostly close to the nearest and limits the search. Which of several triangles
        // at equal distance is found does not depend on the limit.
        let found_mm = match self.last {
            NONE => f64::MAX,
            last => {
                let far_mm = surface.distance_to(last, x);
                far_mm.map_or(f64::MAX, |mm| mm * (1.0 + CLOSE) + self.reach_mm * CLOSE)
            }
        };
        let reaches = (0..self.farther).map(|k| self.reach_mm * self.farther_by.powi(k)).chain([f64::MAX]);
        let mut limits =
            reaches.map(|reach_mm| if found_mm < self.farther_by * reach_mm { found_mm } else { reach_mm });
        let nearest = limits.find_map(|limit_mm| surface.nearest(x, limit_mm));
        self.last = nearest.map_or(NONE, |n| n.bound);
        Proximity {
            middle: *x,
            clearance_mm: nearest.map_or(self.reach_mm, |n| n.distance_mm),
            piece: nearest.and_then(|n| n.piece),
        }
    }

    /// The piece nearest to the middle of the cell that contains `x`.
    pub(super) fn around(&mut self, surface: &ContactSurface, x: &Vec3) -> Proximity {
        let at = x.map(|c| (c / self.size_mm).floor());
        // Also false for NaN.
        if !at.iter().all(|c| c.abs() < FARTHEST) {
            return self.ask(surface, x);
        }
        let key: [i32; 3] = [at.x as i32, at.y as i32, at.z as i32];
        let middle = at.map(|c| (c + 0.5) * self.size_mm);
        let slot = slot(key);
        let known = self.cells[slot];
        if known.key == key {
            let piece = (known.piece != NONE).then_some(known.piece);
            return Proximity { middle, clearance_mm: known.clearance_mm, piece };
        }
        let place = self.ask(surface, &middle);
        let piece = place.piece.unwrap_or(NONE);
        self.cells[slot] = Cell { key, piece, clearance_mm: place.clearance_mm };
        place
    }
}

/// Slot of a cell: neighbours are far apart, so that collisions are rare.
fn slot(key: [i32; 3]) -> usize {
    // Odd constants near 2⁶⁴ times the fractional parts of √2, √3 and √5: their multiples spread evenly.
    const MIX: [u64; 3] = [0x6A09_E667_F3BC_C909, 0xBB67_AE85_84CA_A73B, 0x3C6E_F372_FE94_F82B];
    let mixed = key.iter().zip(MIX).fold(0u64, |sum, (k, m)| sum.wrapping_add((*k as u64).wrapping_mul(m)));
    (mixed >> (64 - CELLS.ilog2())) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::WallProperties;
    use crate::vessel::{GeneratedWall, NoStore, Resolution, anatomy};

    fn tube(edge_mm: f64) -> ContactSurface {
        let tree = anatomy::tree("straight_tube").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm)).unwrap().wall;
        let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
        ContactSurface::new(&wall, (0.2, 0.2), &properties, &NoStore).unwrap()
    }

    #[test]
    fn a_cell_is_asked_once_and_answers_as_the_hierarchy_does() {
        let surface = tube(1.0);
        let mut proximity = ProximityCache::new(0.2, 3.0, &ContactTuning::DEFAULT);
        let at = |i: i32| Vec3::new(2.5 * f64::from(i).sin(), 2.5 * f64::from(i).cos(), 0.02 * f64::from(i));
        for i in 0..3000 {
            let x = at(i);
            let place = proximity.around(&surface, &x);
            assert!((x - place.middle).norm() <= 0.2);
            let (nearest, far_mm) = surface.nearest_piece(&place.middle, 3.0).unwrap();
            assert_eq!((place.piece, place.clearance_mm), (Some(nearest), far_mm));
        }
        let asked = proximity.queries;
        assert!(asked <= 3000);
        proximity.around(&surface, &at(2999));
        assert_eq!(proximity.queries, asked);
    }

    #[test]
    fn what_was_found_before_leads_to_the_same_answers() {
        let surface = tube(0.7);
        let mut proximity = ProximityCache::new(0.2, 0.5, &ContactTuning::DEFAULT);
        // On a lattice about the axis many triangles are at equal distance.
        let at =
            |k: i32| Vec3::new(f64::from(k % 7 - 3), f64::from(k / 7 % 7 - 3), f64::from(k / 49 % 40)) * 0.9;
        for k in 0..2000 {
            let x = at(k * 611 % 2000);
            let place = proximity.ask(&surface, &x);
            let fresh = ProximityCache::new(0.2, 0.5, &ContactTuning::DEFAULT).ask(&surface, &x);
            assert_eq!((place.piece, place.clearance_mm), (fresh.piece, fresh.clearance_mm), "{x}");
        }
    }

    #[test]
    fn no_number_is_no_place_and_a_far_wall_is_found() {
        let surface = tube(2.0);
        let mut proximity = ProximityCache::new(0.2, 1.0, &ContactTuning::DEFAULT);
        let place = proximity.around(&surface, &Vec3::repeat(f64::NAN));
        assert!(place.piece.is_none() && place.clearance_mm == 1.0);
        let place = proximity.around(&surface, &Vec3::new(0.0, 0.0, 50.0));
        assert!(place.piece.is_some() && (3.0..4.0).contains(&place.clearance_mm));
    }
}
