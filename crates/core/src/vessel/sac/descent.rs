//! All sections of a sac across one direction, in one descent.
//!
//! A plane descends along its normal n from the top of the sac. What lies above it and is connected to the top is
//! flooded vertex by vertex, in order of height. With the vector areas aₜ of the parts of triangles above the plane, the
//! divergence theorem gives the area of all sections that bound it:
//!
//! ```text
//! A(h) = Σ n · aₜ(h)
//! ```
//!
//! Between the heights of vertices that is a polynomial of second degree, whose least value is exact. The part above has
//! a single section if it is a disc, V − E + F = 1 for the vertices, edges and triangles that are wholly above. The
//! descent ends with the flood at an opening, at the place given in the artery, or far away.
//!
//! A neck is where the area is least before it rises again, or before the descent ends. Where it falls on in two
//! sections, a bend of the artery is cut off, not a sac. Along a straight neck all planes have the same area: of those
//! whose area exceeds the least by at most [`EQUAL`], the highest is taken, where the sac begins.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::Vec3;
use crate::vessel::{NO_NEIGHBOUR, Wall, WallQuery};

/// Distance from the middle, in radii of the largest ball, beyond which all is artery.
const FAR: f64 = 10.0;
/// Heights are multiples of this part of the radius: equal, or so different that no quotient of differences is
/// rounding alone.
const QUANTUM: f64 = 1.0 / (1 << 20) as f64;
/// Relative rise of the area by which a plane above it is a neck, and relative fall by which it is none.
const RISE: f64 = 0.02;
/// Relative difference up to which areas count as equal.
const EQUAL: f64 = 0.002;

/// The least section found in a descent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Descent {
    /// Height above the middle at which the descent ended, mm; zero if it went beyond.
    short_mm: f64,
    /// Area, mm²; infinite if there is none below the middle.
    pub(super) area_mm2: f64,
    /// Height above the middle of the highest plane whose area counts as equal to that, mm.
    pub(super) level_mm: f64,
}

impl Descent {
    const NONE: Self = Self { short_mm: f64::INFINITY, area_mm2: f64::INFINITY, level_mm: 0.0 };

    /// Lesser areas first; before there are any, descents that came nearer to the middle.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        let of_areas = self.area_mm2.total_cmp(&other.area_mm2);
        self.short_mm.total_cmp(&other.short_mm).then(of_areas)
    }
}

/// The part of a sac beyond a plane.
pub(super) struct Beyond {
    pub(super) area_mm2: f64,
    /// Centroid of the section.
    pub(super) middle_mm: Vec3,
    pub(super) volume_mm3: f64,
    pub(super) height_mm: f64,
}

/// What planes descend on.
pub(super) struct Slope<'a> {
    wall: &'a Wall,
    query: &'a WallQuery,
    neighbours: Vec<[u32; 3]>,
    /// Vector areas of triangles, outwards.
    areas_mm2: Vec<Vec3>,
    /// Triangles of vertex k: those from `first[k]` to `first[k + 1]` in `around`.
    first: Vec<u32>,
    around: Vec<u32>,
    /// Vertices on edges that are open or where the surface turns over, and those far away.
    ends: Vec<bool>,
    middle_mm: Vec3,
    parent_mm: Vec3,
    quantum_mm: f64,
}

/// Work buffers.
#[derive(Default)]
pub(super) struct Room {
    /// Vertices at the border of the flood, highest first.
    next: BinaryHeap<(i64, u32)>,
    /// Vertices that were in `next`, and their heights.
    reached: Vec<u32>,
    heights: Vec<Option<i64>>,
    taken: Vec<bool>,
    /// Number of taken corners of each triangle.
    corners: Vec<u8>,
    /// What they contribute to the area, for triangles with any.
    parts: Vec<[f64; 3]>,
    /// Their sum: coefficients of the area as a polynomial of the height.
    area: [f64; 3],
    /// Twice the Euler characteristic of what is above.
    euler2: i64,
}

/// The least area on the way down.
struct Least {
    /// The area before; zero at first, as where the descent begins is no neck.
    last: f64,
    /// Areas and heights on the way down to what may be a neck, each less than all before.
    pending: Vec<[f64; 2]>,
    /// Area of the best neck, and height of the highest plane of equal area above it.
    best: [f64; 2],
}

impl Least {
    fn pass(&mut self, height: f64, area: f64, single: bool) {
        let pending = self.pending.last().map_or(f64::INFINITY, |pending| pending[0]);
        if single && area < self.last && area < pending {
            self.pending.push([area, height]);
        } else if area > pending * (1.0 + RISE) {
            self.keep();
        } else if !single && area < pending * (1.0 - RISE) {
            self.pending.clear();
        }
        self.last = area;
    }

    fn keep(&mut self) {
        let least = self.pending.last().map_or(f64::INFINITY, |least| least[0]);
        let equal = self.pending.iter().find(|pending| pending[0] <= least * (1.0 + EQUAL));
        if let Some([_, height]) = equal.filter(|_| least < self.best[0]) {
            self.best = [least, *height];
        }
        self.pending.clear();
    }
}

impl<'a> Slope<'a> {
    pub(super) fn new(
        (wall, query): (&'a Wall, &'a WallQuery),
        (middle_mm, radius_mm): (Vec3, f64),
        parent_mm: Vec3,
    ) -> Self {
        let mesh = wall.mesh();
        let neighbours = wall.neighbours();
        let mut first = vec![0; mesh.vertices_mm.len() + 1];
        mesh.triangles.iter().flatten().for_each(|v| first[*v as usize + 1] += 1);
        for v in 0..mesh.vertices_mm.len() {
            first[v + 1] += first[v];
        }
        let (mut place, mut around) = (first.clone(), vec![0; 3 * mesh.triangles.len()]);
        let far_mm = FAR * radius_mm;
        let mut ends: Vec<bool> = mesh.vertices_mm.iter().map(|v| (v - middle_mm).norm() > far_mm).collect();
        for (t, (triangle, across)) in (0..).zip(mesh.triangles.iter().zip(&neighbours)) {
            for k in 0..3 {
                let v = triangle[k] as usize;
                around[place[v] as usize] = t;
                place[v] += 1;
                let onwards = triangle[(k + 1) % 3];
                let is_back =
                    |of: &[u32; 3]| (0..3).any(|j| of[j] == onwards && of[(j + 1) % 3] == triangle[k]);
                if !mesh.triangles.get(across[k] as usize).is_some_and(is_back) {
                    (ends[v], ends[onwards as usize]) = (true, true);
                }
            }
        }
        let area_mm2 = |[a, b, c]: [Vec3; 3]| (b - a).cross(&(c - a)) / 2.0;
        let areas_mm2 = (0..mesh.triangles.len()).map(|t| area_mm2(mesh.corners(t))).collect();
        let quantum_mm = radius_mm * QUANTUM;
        Self { wall, query, neighbours, areas_mm2, first, around, ends, middle_mm, parent_mm, quantum_mm }
    }

    /// Height above the middle.
    fn height(&self, at_mm: &Vec3, normal: &Vec3) -> i64 {
        ((at_mm - self.middle_mm).dot(normal) / self.quantum_mm).round() as i64
    }

    /// The vertex of the wall above a position, and connected to it above any plane below it.
    fn above(&self, at_mm: &Vec3, normal: &Vec3) -> Option<u32> {
        let (_, triangle) = self.query.first_met(at_mm, normal, f64::MAX)?;
        let mesh = self.wall.mesh();
        let height = |v: &u32| mesh.vertices_mm[*v as usize].dot(normal);
        mesh.triangles[triangle as usize].into_iter().max_by(|a, b| height(a).total_cmp(&height(b)))
    }

    /// The least section across a normal that separates the middle from all openings and the artery.
    pub(super) fn descend(&self, normal: &Vec3, room: &mut Room) -> Descent {
        let Some(top) = self.above(&self.middle_mm, normal) else { return Descent::NONE };
        let (parent, parent_height) =
            (self.above(&self.parent_mm, normal), self.height(&self.parent_mm, normal));
        self.clear(room);
        let mut level = self.reach(top, normal, room);
        let mut least = Least { last: 0.0, pending: Vec::new(), best: [f64::INFINITY, 0.0] };
        let mut has_parent = false;
        while let Some((height, v)) = room.next.pop() {
            if height < level {
                let low = if has_parent { height.max(parent_height) } else { height };
                room.between([low, level], &mut least);
                level = low;
                if low > height {
                    break;
                }
            }
            if self.ends[v as usize] {
                break;
            }
            self.take(v, normal, room);
            has_parent |= parent == Some(v);
        }
        least.keep();
        Descent {
            short_mm: level.max(0) as f64 * self.quantum_mm,
            area_mm2: least.best[0],
            level_mm: least.best[1] * self.quantum_mm,
        }
    }

    /// Forgets the flood before: its vertices alone, of a wall that may be large.
    fn clear(&self, room: &mut Room) {
        let mesh = self.wall.mesh();
        room.heights.resize(mesh.vertices_mm.len(), None);
        room.taken.resize(mesh.vertices_mm.len(), false);
        room.corners.resize(mesh.triangles.len(), 0);
        room.parts.resize(mesh.triangles.len(), [0.0; 3]);
        for v in room.reached.drain(..) {
            (room.heights[v as usize], room.taken[v as usize]) = (None, false);
            self.triangles(v).iter().for_each(|t| room.corners[*t as usize] = 0);
        }
        room.next.clear();
        (room.area, room.euler2) = ([0.0; 3], 0);
    }

    /// The triangles of a vertex.
    fn triangles(&self, v: u32) -> &[u32] {
        &self.around[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }

    /// Puts a vertex on the border; its height.
    fn reach(&self, v: u32, normal: &Vec3, room: &mut Room) -> i64 {
        *room.heights[v as usize].get_or_insert_with(|| {
            let height = self.height(&self.wall.mesh().vertices_mm[v as usize], normal);
            room.next.push((height, v));
            room.reached.push(v);
            height
        })
    }

    /// Floods a vertex.
    fn take(&self, v: u32, normal: &Vec3, room: &mut Room) {
        let mesh = self.wall.mesh();
        room.euler2 += 2;
        for &t in self.triangles(v) {
            let triangle = mesh.triangles[t as usize];
            let heights = triangle.map(|corner| self.reach(corner, normal, room) as f64);
            let area_mm2 = self.areas_mm2[t as usize].dot(normal);
            let taken = triangle.map(|corner| corner == v || room.taken[corner as usize]);
            let part = part_above(heights, taken, area_mm2);
            let corners = &mut room.corners[t as usize];
            let before = std::mem::replace(&mut room.parts[t as usize], part);
            let before = if *corners == 0 { [0.0; 3] } else { before };
            (0..3).for_each(|k| room.area[k] += part[k] - before[k]);
            *corners += 1;
            // An edge is counted by its two triangles; a third corner adds two halves of edges, and the triangle.
            room.euler2 -= i64::from(*corners == 2);
        }
        room.taken[v as usize] = true;
    }

    /// The part of the sac beyond a plane; `None` if it has an opening.
    pub(super) fn beyond(&self, normal: &Vec3, level_mm: f64) -> Option<Beyond> {
        let mesh = self.wall.mesh();
        let place = self.middle_mm + normal * level_mm;
        let mut open = self.triangles(self.above(&self.middle_mm, normal)?).to_vec();
        let mut seen = vec![false; mesh.triangles.len()];
        open.iter().for_each(|&t| seen[t as usize] = true);
        let (mut volume_mm3, mut height_mm) = (0.0, 0.0f64);
        let (mut area_mm2, mut moment) = (0.0, Vec3::zeros());
        while let Some(t) = open.pop() {
            let corners = mesh.corners(t as usize).map(|v| (v - place, (v - place).dot(normal)));
            for k in 0..3 {
                height_mm = height_mm.max(corners[k].1);
                if corners[k].1 >= 0.0 || corners[(k + 1) % 3].1 >= 0.0 {
                    let next = self.neighbours[t as usize][k];
                    if next == NO_NEIGHBOUR {
                        return None;
                    }
                    if !std::mem::replace(&mut seen[next as usize], true) {
                        open.push(next);
                    }
                }
            }
            let (polygon, cut) = cut(&corners);
            volume_mm3 += (2..polygon.len())
                .map(|k| polygon[0].dot(&polygon[k - 1].cross(&polygon[k])) / 6.0)
                .sum::<f64>();
            if let [from, to] = cut[..] {
                let part_mm2 = 0.5 * from.cross(&to).dot(normal);
                area_mm2 += part_mm2;
                moment += (from + to) * (part_mm2 / 3.0);
            }
        }
        let middle_mm = place + moment / area_mm2;
        Some(Beyond { area_mm2, middle_mm, volume_mm3, height_mm })
    }
}

impl Room {
    /// Looks for the least area of planes between two heights of vertices, and below the middle.
    fn between(&self, [low, high]: [i64; 2], least: &mut Least) {
        // Heights of vertices are rounded: planes between two multiples have the same vertices above them.
        let (low, high) = (low as f64 + 0.5, (high as f64 - 0.5).min(0.0));
        if low > high {
            return;
        }
        let [a, b, c] = self.area;
        let single = self.euler2 == 2;
        let turn = -b / (2.0 * c);
        for height in [high, turn, low] {
            if height >= low && height <= high {
                least.pass(height, a + height * (b + height * c), single);
            }
        }
    }
}

/// Area of the part of a triangle above a plane, as a polynomial of the plane's height: the corners above it are those
/// taken.
fn part_above(heights: [f64; 3], taken: [bool; 3], area: f64) -> [f64; 3] {
    let alone = match taken.iter().filter(|taken| **taken).count() {
        0 => return [0.0; 3],
        3 => return [area, 0.0, 0.0],
        1 => taken.iter().position(|taken| *taken),
        _ => taken.iter().position(|taken| !taken),
    };
    let k = alone.unwrap_or_default();
    let h = heights[k];
    // The corner beside which the plane passes, and the others.
    let tip = area / ((h - heights[(k + 1) % 3]) * (h - heights[(k + 2) % 3]));
    if !tip.is_finite() {
        // Two corners at one height: both are taken before there is a plane between them.
        return [0.0; 3];
    }
    let tip = [tip * h * h, -2.0 * tip * h, tip];
    if taken[k] { tip } else { [area - tip[0], -tip[1], -tip[2]] }
}

/// The part of a triangle above a plane through the origin, given positions and heights of its corners, and its two
/// points in the plane in the order of its boundary.
fn cut(corners: &[(Vec3, f64); 3]) -> (Vec<Vec3>, Vec<Vec3>) {
    let (mut polygon, mut cut) = (Vec::with_capacity(4), Vec::with_capacity(2));
    for k in 0..3 {
        let ((a, above_a), (b, above_b)) = (corners[k], corners[(k + 1) % 3]);
        if above_a >= 0.0 {
            polygon.push(a);
        }
        if (above_a >= 0.0) != (above_b >= 0.0) {
            let at = a + (b - a) * (above_a / (above_a - above_b));
            polygon.push(at);
            cut.push(at);
        }
    }
    if corners[0].1 < 0.0 {
        // It came up before it went down.
        cut.reverse();
    }
    (polygon, cut)
}
