//! The inside of a wall: distances from it, and spheres that fill its middle.

use rustc_hash::FxHashMap;

use crate::vessel::{NO_NEIGHBOUR, Nearest, Wall, WallQuery};
use crate::{Result, Vec3};

/// Thickness of an opening's plane, in radii of the opening: rims are not quite flat.
const PLANE_RADII: f64 = 0.02;
/// Largest number of pieces per side into which a triangle is divided: for meshes with long triangles along thin
/// vessels.
const MOST_PIECES: f64 = 12.0;
/// Spheres are dropped if their centre is closer than this to that of another one of similar size, in its radii.
const CLOSEST_RADII: f64 = 0.3;
/// Distance of rays' starts from the wall, relative to its size.
const OFF: f64 = 1e-7;
/// Number of chords tried for a sphere: one from the wall, and one from the position of the wall nearest to its
/// middle.
const CHORDS: usize = 2;

/// A sphere without points of the wall inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::vessel) struct Sphere {
    pub(in crate::vessel) centre_mm: Vec3,
    pub(in crate::vessel) radius_mm: f64,
}

/// The lumen of a wall, for queries.
pub(super) struct Lumen<'a> {
    pub(super) wall: &'a Wall,
    query: WallQuery,
    /// The opening of each vertex on a rim.
    opening_of: FxHashMap<u32, usize>,
    /// The triangle across each side of each triangle.
    across: Vec<[u32; 3]>,
    size_mm: f64,
    /// How much larger a sphere must be, mm, for each millimetre by which a line is moved to it in its cross-section. At
    /// a fork that section runs along a branch, in which all spheres are about as large. 0 for a tree, whose lines are
    /// always found so.
    pub(super) stray_cost: f64,
}

impl<'a> Lumen<'a> {
    pub(super) fn new(wall: &'a Wall) -> Result<Self> {
        let query = WallQuery::new(wall)?;
        query.prepare();
        let rims = wall.openings().iter().enumerate();
        let opening_of = rims.flat_map(|(k, o)| o.boundary.iter().map(move |v| (*v, k))).collect();
        let size_mm = wall.mesh().used_bounds_mm().map_or(0.0, |(low, high)| (high - low).norm());
        Ok(Self { wall, query, opening_of, across: wall.neighbours(), size_mm, stray_cost: 0.0 })
    }

    /// Distance of a position from the wall, mm; not positive outside the lumen, past an opening, and for NaN.
    pub(super) fn clearance_mm(&self, x: &Vec3) -> f64 {
        self.nearest(x).map_or(f64::NEG_INFINITY, |near| near.distance_mm)
    }

    /// The nearest point of the wall, with a negative distance also past an opening.
    fn nearest(&self, x: &Vec3) -> Option<Nearest> {
        let near = self.query.nearest(x, f64::INFINITY)?;
        let openings = self.wall.openings();
        let beyond = |vertex: &u32| {
            self.opening_of.get(vertex).is_some_and(|&k| {
                openings[k].beyond_and_off_axis_mm(x).0 > PLANE_RADII * openings[k].radius_mm
            })
        };
        match near.rim && self.wall.mesh().triangles[near.triangle as usize].iter().any(beyond) {
            true => Some(Nearest { distance_mm: -near.distance_mm.abs(), ..near }),
            false => Some(near),
        }
    }

    /// Whether the straight way between two positions in the lumen leaves it through an opening.
    pub(super) fn leaves(&self, from: &Vec3, to: &Vec3) -> bool {
        self.wall.openings().iter().any(|opening| {
            let [before, after] = [from, to].map(|x| opening.beyond_and_off_axis_mm(x).0);
            if (before > 0.0) == (after > 0.0) {
                return false;
            }
            let there = from + (to - from) * (before / (before - after));
            opening.beyond_and_off_axis_mm(&there).1 < opening.radius_mm
        })
    }

    /// Whether the straight way between two positions in the lumen stays in it.
    pub(super) fn sees(&self, from: &Vec3, to: &Vec3) -> bool {
        let way = to - from;
        let length_mm = way.norm();
        let Some(direction) = way.try_normalize(OFF * self.size_mm) else { return true };
        !self.leaves(from, to) && self.free_mm(from, &direction).is_none_or(|mm| mm > length_mm)
    }

    /// Distance to the wall along a unit vector, mm; `None` if the path leaves through an opening.
    pub(super) fn free_mm(&self, from: &Vec3, direction: &Vec3) -> Option<f64> {
        self.query.first_met(from, direction, self.size_mm).map(|(mm, _)| mm)
    }

    /// A larger sphere in the middle of the lumen that holds the centre of this one; this one if there is none. Ways
    /// pass by the small sphere about a place near the wall, or do not meet it.
    pub(super) fn about(&self, sphere: &Sphere) -> Sphere {
        let place = sphere.centre_mm;
        let found = self.nearest(&place).and_then(|near| {
            let inward = (place - near.point_mm).try_normalize(OFF * self.size_mm)?;
            self.sphere_about_chord(&near.point_mm, &inward)
        });
        let holds = |about: &Sphere| (about.centre_mm - place).norm() < about.radius_mm;
        found.filter(|about| about.radius_mm > sphere.radius_mm && holds(about)).unwrap_or(*sphere)
    }

    /// Spheres in the middle of the lumen, the largest first: about chords across it from positions all over the
    /// wall, at most `spacing` of their radii apart.
    pub(super) fn spheres(&self, spacing: f64) -> Vec<Sphere> {
        let mesh = self.wall.mesh();
        let mut is_seen = vec![false; mesh.triangles.len()];
        let mut found = Vec::new();
        for t in 0..mesh.triangles.len() {
            if is_seen[t] {
                continue;
            }
            if let Some(sphere) = self.spheres_over(t, spacing, &mut found) {
                self.see_around(t, 0.5 * spacing * sphere.radius_mm, &mut is_seen);
            }
        }
        // Sorting is stable: among equals the one over the first triangle stays.
        found.sort_by(|a, b| b.radius_mm.total_cmp(&a.radius_mm));
        let mut kept = Spheres::default();
        for sphere in found {
            let level = level(sphere.radius_mm);
            let crowded = (level..=level + 1).any(|level| {
                kept.about(sphere.centre_mm, level, CLOSEST_RADII * largest_mm(level)).any(|other| {
                    let other = kept.all[other];
                    (other.centre_mm - sphere.centre_mm).norm() < CLOSEST_RADII * other.radius_mm
                })
            });
            if !crowded {
                kept.push(sphere);
            }
        }
        kept.all
    }

    /// Marks the triangles around one, within `reach_mm` and at most twice that long, as seen.
    fn see_around(&self, triangle: usize, reach_mm: f64, is_seen: &mut [bool]) {
        let mesh = self.wall.mesh();
        let from = mesh.middle(triangle);
        let mut open = vec![triangle];
        while let Some(t) = open.pop() {
            for next in
                self.across[t].into_iter().filter(|next| *next != NO_NEIGHBOUR).map(|next| next as usize)
            {
                if !is_seen[next]
                    && (mesh.middle(next) - from).norm() <= reach_mm
                    && longest_mm(&mesh.corners(next)) <= 2.0 * reach_mm
                {
                    is_seen[next] = true;
                    open.push(next);
                }
            }
        }
    }

    /// Adds the spheres about chords from a triangle, in pieces small compared with the lumen there; for a small
    /// triangle, one sphere.
    fn spheres_over(&self, triangle: usize, spacing: f64, spheres: &mut Vec<Sphere>) -> Option<Sphere> {
        let corners = self.wall.mesh().corners(triangle);
        let [a, b, c] = corners;
        let inward = self.query.inward_normal(triangle as u32);
        let middle = self.sphere_about_chord(&((a + b + c) / 3.0), &inward);
        let pieces = match middle {
            Some(sphere) => {
                (longest_mm(&corners) / (spacing * sphere.radius_mm)).ceil().clamp(1.0, MOST_PIECES)
            }
            None => 2.0,
        };
        if pieces == 1.0 {
            spheres.extend(middle);
            return middle;
        }
        let count = pieces as usize;
        for i in 0..count {
            for j in 0..count - i {
                // Each corner of the subdivision has one piece like the triangle, and most have one upside down.
                for third in [1.0 / 3.0, 2.0 / 3.0].into_iter().take(if i + j + 1 < count { 2 } else { 1 }) {
                    let (u, v) = ((i as f64 + third) / pieces, (j as f64 + third) / pieces);
                    spheres.extend(self.sphere_about_chord(&(a + (b - a) * u + (c - a) * v), &inward));
                }
            }
        }
        None
    }

    /// The sphere about the middle of the chord across the lumen from a position of the wall, or about the middle of
    /// the chord through it from the wall's nearest point, if larger: in a round vessel on the axis.
    fn sphere_about_chord(&self, from: &Vec3, inward: &Vec3) -> Option<Sphere> {
        let off_mm = OFF * self.size_mm;
        let (mut from, mut inward) = (*from, *inward);
        let mut best: Option<Sphere> = None;
        for _ in 0..CHORDS {
            let Some(mm) = self.free_mm(&(from + inward * off_mm), &inward) else { break };
            let centre_mm = from + inward * ((mm + off_mm) / 2.0);
            let near = self.nearest(&centre_mm)?;
            if near.distance_mm <= best.map_or(off_mm, |best| best.radius_mm) {
                break;
            }
            best = Some(Sphere { centre_mm, radius_mm: near.distance_mm });
            (from, inward) = (near.point_mm, near.normal);
        }
        best
    }
}

fn longest_mm([a, b, c]: &[Vec3; 3]) -> f64 {
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

/// Spheres of one level have radii of 2ᴸ to 2ᴸ⁺¹ mm.
fn level(radius_mm: f64) -> i32 {
    libm::log2(radius_mm).floor() as i32
}

/// Upper bound of the radii of spheres of a level.
fn largest_mm(level: i32) -> f64 {
    f64::from(level + 1).exp2()
}

/// Spheres in cells of similar size, for searching near a position.
#[derive(Debug, Default)]
pub(super) struct Spheres {
    pub(super) all: Vec<Sphere>,
    cells: FxHashMap<(i32, [i64; 3]), Vec<usize>>,
    /// Lowest and highest level with spheres.
    levels: Option<(i32, i32)>,
}

impl Spheres {
    pub(super) fn push(&mut self, sphere: Sphere) {
        let level = level(sphere.radius_mm);
        self.cells.entry((level, cell(&sphere.centre_mm, level))).or_default().push(self.all.len());
        self.all.push(sphere);
        self.levels =
            Some(self.levels.map_or((level, level), |(low, high)| (low.min(level), high.max(level))));
    }

    /// The spheres of a level in cells within `reach_mm` of a position, and some others.
    fn about(&self, x: Vec3, level: i32, reach_mm: f64) -> impl Iterator<Item = usize> + '_ {
        let (low, high) = (cell(&x.add_scalar(-reach_mm), level), cell(&x.add_scalar(reach_mm), level));
        (low[0]..=high[0])
            .flat_map(move |i| (low[1]..=high[1]).map(move |j| [i, j]))
            .flat_map(move |[i, j]| (low[2]..=high[2]).map(move |k| [i, j, k]))
            .filter_map(move |at| self.cells.get(&(level, at)))
            .flatten()
            .copied()
    }

    /// Spheres at least about as large as this one that it connects to, not farther apart than the larger radius and
    /// this part of the smaller: a path between their centres stays inside the two.
    pub(super) fn overlapping(&self, sphere: &Sphere, part: f64) -> impl Iterator<Item = usize> + '_ {
        let sphere = *sphere;
        let (_, high) = self.levels.unwrap_or_default();
        (level(sphere.radius_mm)..=high)
            .flat_map(move |level| {
                self.about(
                    sphere.centre_mm,
                    level,
                    largest_mm(level) + part * largest_mm(level).min(2.0 * sphere.radius_mm),
                )
            })
            .filter(move |&other| {
                let other = self.all[other];
                let (small, large) =
                    (sphere.radius_mm.min(other.radius_mm), sphere.radius_mm.max(other.radius_mm));
                (other.centre_mm - sphere.centre_mm).norm() < large + part * small
            })
    }

    /// Of the spheres that contain a position, the one whose surface is the farthest from it.
    pub(super) fn deepest(&self, x: &Vec3) -> Option<usize> {
        let (low, high) = self.levels?;
        let depth_mm = |k: usize| self.all[k].radius_mm - (self.all[k].centre_mm - x).norm();
        (low..=high)
            .flat_map(|level| self.about(*x, level, largest_mm(level)))
            .filter(|&k| depth_mm(k) > 0.0)
            .max_by(|&a, &b| depth_mm(a).total_cmp(&depth_mm(b)).then(b.cmp(&a)))
    }

    /// Of the spheres that contain a position, the one with the nearest centre.
    pub(super) fn holding(&self, x: &Vec3) -> Option<usize> {
        let (low, high) = self.levels?;
        let away_mm = |k: usize| (self.all[k].centre_mm - x).norm();
        (low..=high)
            .flat_map(|level| self.about(*x, level, largest_mm(level)))
            .filter(|&k| away_mm(k) < self.all[k].radius_mm)
            .min_by(|&a, &b| away_mm(a).total_cmp(&away_mm(b)).then(a.cmp(&b)))
    }
}

fn cell(x: &Vec3, level: i32) -> [i64; 3] {
    // Positions are finite, and cells at least a millionth of a millimetre.
    (x / largest_mm(level)).map(|c| c.floor() as i64).into()
}
