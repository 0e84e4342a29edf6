//! The openings of a wall, through which blood and devices pass.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::SurfaceMesh;
use super::generate::any_perpendicular;
use super::topology::{EdgeTable, EdgeUse, NONE};
use crate::Vec3;

/// Length of the straight extension of an opening, mm, if nothing is in the way.
pub(super) const MOST_BEYOND_MM: f64 = 32.0;
/// Length of the extensions of two openings, mm, that round free space about both need not allow, if they do not meet.
const LEAST_BEYOND_MM: f64 = 3.0;
/// Radius of the free space around an extension's axis, in radii of the opening.
const FREE_RADII: f64 = 1.1;
/// Part of the way to what is in front of an opening that its extension may take.
const HALFWAY: f64 = 0.5;
/// Distance from a rim, in radii of the opening, within which the wall is the vessel's own: it may curl over its rim.
pub(super) const OWN_RIM: f64 = 0.25;
/// Length of an extension, as a fraction of its opening's radius, below which there is none: the wall touches the
/// opening, and no cap fits between the two.
const FLAT: f64 = 0.01;
/// Circles on each disc of an extension, and points on each, with which two extensions are compared.
const CIRCLES: usize = 3;
const AROUND: usize = 24;
/// Discs of an extension that are compared.
const DISCS: usize = 5;
/// Smallest radius of the default opening for devices, as a fraction of the widest one's: narrower ones are branches.
const TRUNK: f64 = 0.4;

/// An open end of a wall: one closed loop of edges that belong to a single triangle each.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening {
    /// Its index: largest radius first, then by centre (x, then y, then z). Radii and coordinates that differ by
    /// rounding count as equal, so that a vessel's centre line, its mesh and a file of this have the same numbers.
    pub index: usize,
    /// Centre in mm: mean of the loop, each vertex weighted by the length of its edges.
    pub centre_mm: Vec3,
    /// Mean distance of the loop from the centre, mm, with the same weights: exact for a polygon inscribed in a
    /// circle.
    pub radius_mm: f64,
    /// Unit vector along the loop's vector area, pointing out of the vessel. A device is pushed in against it.
    pub direction: Vec3,
    /// The loop's vertices, in the order in which triangles of a cap would traverse them; empty without a mesh.
    pub boundary: Vec<u32>,
    /// Possible length of a straight extension of the vessel, mm, before it meets the vessel or another extension; 0
    /// where the vessel touches the opening.
    pub beyond_mm: f64,
}

impl Opening {
    /// Centre, radius and direction of a loop of vertices; `index` stays 0.
    fn of_loop(mesh: &SurfaceMesh, boundary: Vec<u32>) -> Self {
        let at = |k: usize| mesh.vertices_mm[boundary[k % boundary.len()] as usize];
        let count = boundary.len();
        let weight = |k: usize| (at(k + 1) - at(k)).norm() + (at(k) - at(k + count - 1)).norm();
        let total: f64 = (0..count).map(weight).sum::<f64>().max(f64::MIN_POSITIVE);
        let centre_mm = (0..count).map(|k| weight(k) * at(k)).sum::<Vec3>() / total;
        let radius_mm = (0..count).map(|k| weight(k) * (at(k) - centre_mm).norm()).sum::<f64>() / total;
        let area: Vec3 = (0..count).map(|k| (at(k) - centre_mm).cross(&(at(k + 1) - centre_mm)) / 2.0).sum();
        // A slit encloses no area; any unit vector will do.
        let direction = area.try_normalize(1e-12 * radius_mm * radius_mm).unwrap_or_else(Vec3::x);
        Self { index: 0, centre_mm, radius_mm, direction, boundary, beyond_mm: MOST_BEYOND_MM }
    }

    /// The end of a tube without a mesh. `index` stays 0.
    pub(super) fn at_end(centre_mm: Vec3, radius_mm: f64, direction: Vec3) -> Self {
        Self { index: 0, centre_mm, radius_mm, direction, boundary: Vec::new(), beyond_mm: MOST_BEYOND_MM }
    }

    /// Length of the boundary, mm.
    pub(crate) fn boundary_length_mm(&self, mesh: &SurfaceMesh) -> f64 {
        let count = self.boundary.len();
        let at = |k: usize| mesh.vertices_mm[self.boundary[k % count] as usize];
        (0..count).map(|k| (at(k + 1) - at(k)).norm()).sum()
    }

    /// Distance of `x` beyond the opening's plane, and from its axis, mm.
    pub fn beyond_and_off_axis_mm(&self, x: &Vec3) -> (f64, f64) {
        let offset = x - self.centre_mm;
        let beyond_mm = offset.dot(&self.direction);
        (beyond_mm, (offset - self.direction * beyond_mm).norm())
    }

    /// How far its rim, which may be oblique, reaches beyond its plane, mm.
    pub(super) fn rim_mm(&self, mesh: &SurfaceMesh) -> f64 {
        let at = |v: &u32| self.beyond_and_off_axis_mm(&mesh.vertices_mm[*v as usize]).0;
        self.boundary.iter().map(at).fold(0.0, f64::max)
    }

    /// Whether a sample point of another opening's round extension of this length lies in its own; `around` has cosine
    /// and sine of the points on a circle.
    fn meets(&self, other: &Self, length_mm: f64, around: &[[f64; 2]; AROUND]) -> bool {
        let u = any_perpendicular(&other.direction);
        let v = other.direction.cross(&u);
        let is_inside = |x: &Vec3| {
            let (along, lateral) = self.beyond_and_off_axis_mm(x);
            along > 0.0 && along < length_mm && lateral < self.radius_mm
        };
        let place = |n: usize| {
            let (disc, circle, k) = (n / (CIRCLES * AROUND), n / AROUND % CIRCLES, n % AROUND);
            let [cos, sin] = around[k];
            let radius_mm = other.radius_mm * circle as f64 / (CIRCLES - 1) as f64;
            let along_mm = length_mm * disc as f64 / (DISCS - 1) as f64;
            let across = u * cos + v * sin;
            other.centre_mm + other.direction * along_mm + across * radius_mm
        };
        (0..DISCS * CIRCLES * AROUND).any(|n| is_inside(&place(n)))
    }

    /// The triangles that close the opening: a fan around its centre, facing out.
    pub(crate) fn cap(&self, mesh: &SurfaceMesh) -> impl Iterator<Item = [Vec3; 3]> {
        let at = |k: usize| mesh.vertices_mm[self.boundary[k % self.boundary.len()] as usize];
        (0..self.boundary.len()).map(move |k| [at(k), at(k + 1), self.centre_mm])
    }

    /// Adds a stretch of wall to the mesh of the opening, straight on for `by_mm`; the opening at its end.
    pub(super) fn drawn_out(&self, mesh: &mut SurfaceMesh, by_mm: f64) -> Self {
        let way = self.direction * by_mm;
        let first = mesh.vertices_mm.len() as u32;
        let ring: Vec<Vec3> = self.boundary.iter().map(|v| mesh.vertices_mm[*v as usize] + way).collect();
        let boundary: Vec<u32> = (first..).take(ring.len()).collect();
        mesh.vertices_mm.extend(ring);
        for k in 0..boundary.len() {
            let next = (k + 1) % boundary.len();
            let (a, b) = (self.boundary[k], self.boundary[next]);
            mesh.triangles.extend([[a, b, boundary[next]], [a, boundary[next], boundary[k]]]);
        }
        Self { boundary, centre_mm: self.centre_mm + way, ..self.clone() }
    }

    /// Adds that fan to the mesh of the opening; it shares the loop's vertices.
    pub(crate) fn close(&self, mesh: &mut SurfaceMesh) {
        let centre = mesh.vertices_mm.len() as u32;
        mesh.vertices_mm.push(self.centre_mm);
        let next = self.boundary.iter().cycle().skip(1);
        mesh.triangles.extend(self.boundary.iter().zip(next).map(|(&a, &b)| [a, b, centre]));
    }
}

/// The default opening for devices, as in [`Wall::inlet`](super::Wall::inlet).
pub(super) fn inlet(openings: &[Opening]) -> Option<&Opening> {
    let widest_mm = openings.iter().map(|opening| opening.radius_mm).fold(0.0, f64::max);
    let trunks = openings.iter().filter(|opening| opening.radius_mm >= TRUNK * widest_mm);
    trunks.min_by(|a, b| a.centre_mm.z.total_cmp(&b.centre_mm.z))
}

/// Shortens the extensions of openings, whose rims reach so far beyond their planes, so that they meet neither each
/// other nor the wall. Round free space is kept about each where there is room for it; where the wall touches an
/// opening there is no extension at all.
///
/// `wall` calls its last argument with sample points of the wall near the opening of this number, and whether they are
/// of the stretch that ends there.
pub(super) fn keep_apart(
    wall: impl Fn(usize, &Opening, &mut dyn FnMut(Vec3, bool)),
    rims_mm: &[f64],
    openings: &mut [Opening],
) {
    let mut beyond = apart_from_others(openings);
    for (opening, beyond) in openings.iter_mut().zip(&beyond) {
        // What is farther away is not looked at.
        opening.beyond_mm = *beyond;
    }
    for (number, (opening, beyond)) in openings.iter().zip(&mut beyond).enumerate() {
        if *beyond < FLAT * opening.radius_mm {
            continue;
        }
        let rim_mm = rims_mm[number];
        let free = FREE_RADII * opening.radius_mm;
        wall(number, opening, &mut |x, is_of_end| {
            let (along, lateral) = opening.beyond_and_off_axis_mm(&x);
            if lateral >= free {
                return;
            }
            let before = along - rim_mm;
            let is_behind = before <= if is_of_end { 0.0 } else { -FLAT * opening.radius_mm };
            let from_rim = libm::hypot(lateral - opening.radius_mm, before);
            let is_own = is_behind || (is_of_end && from_rim <= OWN_RIM * opening.radius_mm);
            // Rims may be oblique.
            if along > free || !is_own {
                let half = if is_own { 0.0 } else { HALFWAY * before };
                *beyond = (along - free).max(half).min(*beyond);
            }
        });
    }
    for (opening, beyond) in openings.iter_mut().zip(beyond) {
        opening.beyond_mm = if beyond < FLAT * opening.radius_mm { 0.0 } else { beyond };
    }
}

/// Lengths of the extensions with which they do not meet each other.
fn apart_from_others(openings: &[Opening]) -> Vec<f64> {
    let mut beyond = vec![MOST_BEYOND_MM; openings.len()];
    let around = std::array::from_fn(|k| {
        let angle = TAU * k as f64 / AROUND as f64;
        [libm::cos(angle), libm::sin(angle)]
    });
    for (i, a) in openings.iter().enumerate() {
        for (j, b) in openings.iter().enumerate().skip(i + 1) {
            let free = FREE_RADII * (a.radius_mm + b.radius_mm);
            // Neighbours may be as close as they are at the openings.
            let least = free.min((a.centre_mm - b.centre_mm).norm() * (1.0 - 1e-9));
            let is_apart = |length: f64| apart(a, b, length) >= least;
            let is_free = |length: f64| !a.meets(b, length, &around) && !b.meets(a, length, &around);
            // Most pairs shorten neither, because others have done so before.
            let now_mm = beyond[i].max(beyond[j]);
            if is_apart(now_mm) || (now_mm <= LEAST_BEYOND_MM && is_free(now_mm)) {
                continue;
            }
            let mut length_mm = longest(MOST_BEYOND_MM, is_apart);
            if length_mm < LEAST_BEYOND_MM {
                length_mm = length_mm.max(longest(LEAST_BEYOND_MM, is_free));
            }
            beyond[i] = length_mm.min(beyond[i]);
            beyond[j] = length_mm.min(beyond[j]);
        }
    }
    beyond
}

/// The largest length up to this one that is allowed, if all shorter ones are.
fn longest(most: f64, allowed: impl Fn(f64) -> bool) -> f64 {
    if allowed(most) {
        return most;
    }
    let (mut low, mut high) = (0.0, most);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if allowed(middle) { low = middle } else { high = middle }
    }
    low
}

/// Smallest distance between the straight extensions of this length of two openings, mm: Ericson, *Real-Time
/// Collision Detection*, 2005, section 5.1.9, for unit directions.
fn apart(a: &Opening, b: &Opening, length_mm: f64) -> f64 {
    let (d, e, r) = (a.direction, b.direction, a.centre_mm - b.centre_mm);
    let (cos, c, f) = (d.dot(&e), d.dot(&r), e.dot(&r));
    let within = |t: f64| t.clamp(0.0, length_mm);
    let sine_squared = 1.0 - cos * cos;
    let s = if sine_squared > 1e-12 { within((cos * f - c) / sine_squared) } else { 0.0 };
    let t = within(cos * s + f);
    let s = within(cos * t - c);
    (r + d * s - e * t).norm()
}

/// Largest cosine of the angle between the directions of openings that face each other.
const OPPOSITE: f64 = -0.8;
/// Smallest ratio of the radii of such openings.
const ALIKE: f64 = 0.7;

/// Fraction of the radius by which the two parts of such a vessel may overlap.
const OVERLAP: f64 = 0.25;

/// Distance, in radii of the larger one, up to which openings of one axis face each other; how far from the axis they may be,
/// in the same radii, and the largest cosine between them.
const ON_ONE_AXIS: (f64, f64, f64) = (3.0, 0.5, -0.95);

/// Pairs of openings of similar size that face each other: at a distance of at most the larger radius, or farther on one
/// axis.
pub(super) fn facing(openings: &[Opening]) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    for (i, a) in openings.iter().enumerate() {
        // The largest come first.
        for b in openings[i + 1..].iter().take_while(|b| b.radius_mm >= ALIKE * a.radius_mm) {
            let offset = b.centre_mm - a.centre_mm;
            // The ends of a short tube face away from each other.
            let is_before = offset.dot(&a.direction) >= -OVERLAP * a.radius_mm;
            let cosine = a.direction.dot(&b.direction);
            let (far, aside, straight) = ON_ONE_AXIS;
            let (_, off_axis_mm) = a.beyond_and_off_axis_mm(&b.centre_mm);
            let is_near = offset.norm() <= a.radius_mm && cosine <= OPPOSITE;
            let is_in_line = offset.norm() <= far * a.radius_mm
                && off_axis_mm <= aside * a.radius_mm
                && cosine <= straight;
            if is_before && (is_near || is_in_line) {
                pairs.push([a.index, b.index]);
            }
        }
    }
    pairs
}

/// Differences of radii, relative to them, and of coordinates of centres, relative to the radius, up to which they
/// are equal: a rim of triangles is measured to about a thousandth, and files are rounded.
const EQUAL: [f64; 4] = [2e-3, 1e-2, 1e-2, 1e-2];

/// What openings are ordered by, as in [`Opening::index`].
fn keys(opening: &Opening) -> [f64; 4] {
    let centre_mm = &opening.centre_mm;
    [-opening.radius_mm, centre_mm.x, centre_mm.y, centre_mm.z]
}

/// The numbers of openings in their order.
fn in_order(openings: &[Opening]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..openings.len()).collect();
    // By exact values first: these decide if all are equal.
    for key in (0..EQUAL.len()).rev() {
        order.sort_by(|a, b| keys(&openings[*a])[key].total_cmp(&keys(&openings[*b])[key]));
    }
    arrange(&mut order, openings, 0);
    order
}

/// Sorts openings by a key, and those of which it is equal by the next ones.
fn arrange(order: &mut [usize], openings: &[Opening], key: usize) {
    let Some(equal) = EQUAL.get(key) else { return };
    let value = |index: usize| keys(&openings[index])[key];
    order.sort_by(|a, b| value(*a).total_cmp(&value(*b)));
    let mut rest = order;
    while let Some(&first) = rest.first() {
        let most = value(first) + equal * openings[first].radius_mm;
        let count = rest.iter().take_while(|index| value(**index) <= most).count().max(1);
        let (alike, others) = rest.split_at_mut(count);
        arrange(alike, openings, key + 1);
        rest = others;
    }
}

/// Sets the indices of openings.
pub(super) fn number(openings: &mut Vec<Opening>) {
    *openings = numbered(openings, &in_order(openings));
}

/// The openings in this order, with their indices.
fn numbered(openings: &[Opening], order: &[usize]) -> Vec<Opening> {
    let numbers = order.iter().enumerate();
    numbers.map(|(index, number)| Opening { index, ..openings[*number].clone() }).collect()
}

/// Boundary loops of a consistently oriented mesh.
#[derive(Debug)]
pub(crate) struct Boundary {
    /// The openings, with indices.
    pub(crate) openings: Vec<Opening>,
    /// For each opening the triangle with its first edge.
    pub(crate) first_triangle: Vec<u32>,
    /// The triangle across each side of each; empty without open edges.
    pub(super) across: Vec<[u32; 3]>,
    /// Open edges that form no loop, because they end at a non-manifold edge.
    pub(crate) stray_edges: usize,
}

/// Joins all open edges of `mesh`, whose edges are in `table`, into loops.
///
/// Where two sheets touch in a vertex, the walk goes around it through the triangles between the incoming and the
/// outgoing edge and so stays on its sheet; where two holes of one sheet touch (a figure eight), the loop is split
/// there.
pub(crate) fn boundary(mesh: &SurfaceMesh, table: &EdgeTable) -> Boundary {
    let triangles = &mesh.triangles;
    let single = |uses: &[EdgeUse]| if let [only] = uses { Some((only.triangle, only.side)) } else { None };
    let mut open: Vec<(u32, u8)> = table.edges().filter_map(single).collect();
    open.sort_unstable();
    let across = if open.is_empty() { Vec::new() } else { table.neighbours(triangles.len()) };
    let mut visited = vec![false; open.len()];
    let mut loops = Vec::new();
    let mut stray_edges = 0;
    for (index, start) in open.iter().enumerate() {
        if visited[index] {
            continue;
        }
        let mut walked = Vec::new();
        let mut edge = *start;
        let closed = loop {
            match open.binary_search(&edge) {
                Ok(place) if !visited[place] => visited[place] = true,
                Ok(_) => break edge == *start,
                Err(_) => break false,
            }
            walked.push(triangles[edge.0 as usize][edge.1 as usize]);
            edge = match next_open_edge(triangles, &across, edge) {
                Some(next) => next,
                None => break false,
            };
        };
        if !closed {
            stray_edges += walked.len();
            continue;
        }
        for mut simple in simple_loops(&walked) {
            if simple.len() < 3 {
                stray_edges += simple.len();
                continue;
            }
            simple.reverse();
            loops.push((Opening::of_loop(mesh, simple), start.0));
        }
    }
    loops.sort_by(|(a, _), (b, _)| a.boundary.cmp(&b.boundary));
    let (found, first): (Vec<Opening>, Vec<u32>) = loops.into_iter().unzip();
    let order = in_order(&found);
    let first_triangle = order.iter().map(|k| first[*k]).collect();
    Boundary { openings: numbered(&found, &order), first_triangle, across, stray_edges }
}

/// Splits a closed walk at vertices it passes more than once.
fn simple_loops(walked: &[u32]) -> Vec<Vec<u32>> {
    let mut loops = Vec::new();
    let mut path: Vec<u32> = Vec::new();
    let mut place: BTreeMap<u32, usize> = BTreeMap::new();
    for &vertex in walked {
        if let Some(&earlier) = place.get(&vertex) {
            let cut = path.split_off(earlier);
            for v in &cut {
                place.remove(v);
            }
            loops.push(cut);
        }
        place.insert(vertex, path.len());
        path.push(vertex);
    }
    loops.push(path);
    loops
}

/// The open edge that starts at the head of open edge `from`, found by turning around that vertex within the surface.
fn next_open_edge(triangles: &[[u32; 3]], across: &[[u32; 3]], from: (u32, u8)) -> Option<(u32, u8)> {
    let vertex = triangles[from.0 as usize][(from.1 as usize + 1) % 3];
    let mut triangle = from.0;
    // A fan has at most as many triangles as the mesh: the bound stops walks around damaged vertices.
    for _ in 0..=triangles.len() {
        let corners = triangles[triangle as usize];
        let side = corners.iter().position(|&v| v == vertex)?;
        let beyond = across[triangle as usize][side];
        if beyond == NONE {
            return Some((triangle, side as u8));
        }
        triangle = beyond;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{splitmix64, unit};

    fn square_grid(n: usize, keep: impl Fn(usize, usize) -> bool) -> SurfaceMesh {
        let mut mesh = SurfaceMesh::default();
        for y in 0..=n {
            for x in 0..=n {
                mesh.vertices_mm.push(Vec3::new(x as f64, y as f64, 0.0));
            }
        }
        let id = |x: usize, y: usize| (y * (n + 1) + x) as u32;
        for y in 0..n {
            for x in 0..n {
                if keep(x, y) {
                    mesh.triangles.push([id(x, y), id(x + 1, y), id(x, y + 1)]);
                    mesh.triangles.push([id(x + 1, y), id(x + 1, y + 1), id(x, y + 1)]);
                }
            }
        }
        mesh
    }

    #[test]
    fn holes_that_touch_in_one_vertex_stay_two_loops() {
        // Two missing squares on a diagonal share the vertex (2, 2); the outer border is the third loop.
        let mesh = square_grid(5, |x, y| (x, y) != (1, 1) && (x, y) != (2, 2));
        let found = boundary(&mesh, &EdgeTable::new(&mesh.triangles));
        let lengths: Vec<usize> = found.openings.iter().map(|o| o.boundary.len()).collect();
        assert_eq!(lengths, [20, 4, 4]);
        assert_eq!(found.stray_edges, 0);
        assert!((found.openings[1].centre_mm - Vec3::new(1.5, 1.5, 0.0)).norm() < 1e-12);
        assert!((found.openings[2].centre_mm - Vec3::new(2.5, 2.5, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn the_mean_radius_of_an_inscribed_polygon_is_its_circle() {
        let mesh = square_grid(1, |_, _| true);
        let found = boundary(&mesh, &EdgeTable::new(&mesh.triangles));
        assert!((found.openings[0].radius_mm - 0.5_f64.sqrt()).abs() < 1e-15);
        // The sheet faces +z, so its cap faces −z.
        assert!((found.openings[0].direction + Vec3::z()).norm() < 1e-15);
    }

    /// An opening of radius 1 on the x axis.
    fn opening(x: f64, direction: Vec3) -> Opening {
        Opening::at_end(Vec3::x() * x, 1.0, direction.normalize())
    }

    /// Sample points of a wall that ends at all openings.
    fn wall(places: &[Vec3]) -> impl Fn(usize, &Opening, &mut dyn FnMut(Vec3, bool)) {
        move |_, _, see| places.iter().for_each(|x| see(*x, true))
    }

    #[test]
    fn openings_that_differ_by_rounding_are_numbered_by_their_places() {
        let numbers = |radii: [f64; 4], off: f64| -> Vec<f64> {
            let places = [(9.0, 0.0), (-9.0, off), (0.0, -4.0 * off), (0.0, 5.0)];
            let mut all: Vec<Opening> = (places.iter().zip(radii))
                .map(|((x, y), radius)| Opening::at_end(Vec3::new(*x + off, *y, 0.0), radius, Vec3::z()))
                .collect();
            number(&mut all);
            assert!(all.iter().enumerate().all(|(k, opening)| opening.index == k));
            all.iter().map(|opening| (opening.centre_mm.x + opening.centre_mm.y).round()).collect()
        };
        let exact = numbers([2.0, 2.0, 3.0, 2.0], 0.0);
        assert_eq!(exact, [0.0, -9.0, 5.0, 9.0]);
        for off in [-1e-3, 1e-9, 1e-3] {
            assert_eq!(numbers([2.0 - off, 2.0, 3.0, 2.0 + off], off), exact, "{off}");
        }
        // Openings of different sizes go by these.
        assert_eq!(numbers([2.1, 2.0, 3.0, 2.05], 0.0), [0.0, 9.0, 5.0, -9.0]);
    }

    #[test]
    fn what_is_drawn_out_of_two_openings_stays_apart() {
        let beyond = |mesh: &[Vec3], turned: f64| {
            let mut pair =
                [opening(-5.0, Vec3::new(turned, 0.0, 1.0)), opening(5.0, Vec3::new(-turned, 0.0, 1.0))];
            keep_apart(wall(mesh), &[0.0; 2], &mut pair);
            pair.map(|o| o.beyond_mm)
        };
        let nothing = [];
        assert_eq!(beyond(&nothing, 0.0), [MOST_BEYOND_MM; 2]);
        assert_eq!(beyond(&nothing, -0.2), [MOST_BEYOND_MM; 2]);
        // They approach to 2.2 mm after 7.8 mm / √2 each.
        let met = 7.8 / 2.0_f64.sqrt();
        assert!(
            beyond(&nothing, 1.0).iter().all(|mm| (mm - met).abs() < 1e-3),
            "{:?}",
            beyond(&nothing, 1.0)
        );
        // A vertex of the vessel 10 mm above the first.
        let vessel = [Vec3::new(-5.0, 0.5, 10.0)];
        let [first, second] = beyond(&vessel, 0.0);
        assert!((first - 8.9).abs() < 1e-12 && second == MOST_BEYOND_MM, "{first} {second}");
        // Half a millimetre in front of it: half of that, since an extension through the vessel would be felt in it.
        let vessel = [Vec3::new(-5.0, 0.5, 0.5)];
        assert_eq!(beyond(&vessel, 0.0), [0.25, MOST_BEYOND_MM]);
        // The vessel's own wall at the rim is not in the way.
        let vessel = [Vec3::new(-5.0, 1.05, 0.1)];
        assert_eq!(beyond(&vessel, 0.0), [MOST_BEYOND_MM; 2]);
    }

    #[test]
    fn many_openings_in_a_heap_are_shortened_as_pair_by_pair() {
        // Places and directions without order, as of triangles that share no vertices.
        let at =
            |k: usize, n: usize| Vec3::from_fn(|i, _| unit(splitmix64(7, (6 * k + 3 * n + i) as u64)) - 0.5);
        let heap = |count: usize| -> Vec<Opening> {
            let one = |k: usize| Opening::at_end(6.0 * at(k, 0), 0.4, at(k, 1).normalize());
            (0..count).map(one).collect()
        };
        let all = heap(40);
        let mut alone = vec![MOST_BEYOND_MM; all.len()];
        for i in 0..all.len() {
            for j in i + 1..all.len() {
                let pair = apart_from_others(&[all[i].clone(), all[j].clone()]);
                (alone[i], alone[j]) = (alone[i].min(pair[0]), alone[j].min(pair[1]));
            }
        }
        let together = apart_from_others(&all);
        let off = together.iter().zip(&alone).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-4 && alone.iter().any(|mm| *mm < LEAST_BEYOND_MM), "{off}: {alone:?}");
        // Two thousand take a moment; tested pair by pair they took minutes.
        let clock = std::time::Instant::now();
        assert_eq!(apart_from_others(&heap(2000)).len(), 2000);
        let took_s = clock.elapsed().as_secs_f64();
        assert!(took_s < 20.0, "{took_s} s");
    }

    #[test]
    fn what_is_drawn_out_of_openings_that_face_each_other_meets_in_the_middle() {
        for (gap, most) in [(1.0, 0.5), (4.0, 2.0), (7.0, LEAST_BEYOND_MM)] {
            let mut pair = [opening(0.0, Vec3::x()), opening(gap, -Vec3::x())];
            keep_apart(wall(&[]), &[0.0; 2], &mut pair);
            for found in pair.map(|o| o.beyond_mm) {
                assert!(found <= most && found > 0.99 * most, "{found} of a gap of {gap}");
            }
        }
    }
}
