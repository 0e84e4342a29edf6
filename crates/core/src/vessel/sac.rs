//! The sac of an aneurysm: position and width of its neck, and its volume.
//!
//! The neck is the plane with the smallest cross-section between the middle of the sac and the artery: sections of
//! the surface are closed curves, and the one around the path between them has the area A = ½ |Σ xᵢ × xᵢ₊₁|. It is
//! searched for over positions and tilts, coarsely first. The sac is everything connected to that curve on its far
//! side; its volume is the sum of the tetrahedra from a point of the plane, to which the neck itself adds nothing.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{CentrelineNode, CentrelineTree, NO_NEIGHBOUR, Wall, WallQuery};
use crate::rod::Frame;
use crate::{Error, Result, Vec3};

/// Number of positions on the path to the parent artery at which sections are taken.
const PLACES: usize = 48;
/// Largest tilt of a neck against the path, rad, and numbers of rings and spokes of tilts tried.
const LARGEST_TILT: f64 = 0.9;
const TILTS: (usize, usize) = (3, 8);
/// Number of times the pattern of positions and tilts is halved around the best: to a thousandth of the first.
const HALVINGS: usize = 10;
/// Largest number of steps from the dome to the middle of the sac, and their initial length, in clearances.
const CLIMB: (usize, f64) = (60, 0.25);
/// Directions of the steps: to the faces and corners of a cube.
const DIRECTIONS: [[f64; 3]; 14] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0],
    [-1.0, 1.0, 1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [-1.0, -1.0, -1.0],
];

/// A sac and its neck.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sac {
    /// Middle of the neck, mm.
    pub neck_mm: Vec3,
    /// Unit normal of the neck's plane, into the sac.
    pub normal: Vec3,
    /// Area of the neck, mm².
    pub neck_area_mm2: f64,
    /// Diameter of the circle of that area, mm.
    pub neck_diameter_mm: f64,
    /// Volume beyond the neck, mm³.
    pub volume_mm3: f64,
    /// Distance of the farthest position of the wall from the neck's plane, mm.
    pub height_mm: f64,
    /// Diameter of the largest ball found in it, mm.
    pub dome_diameter_mm: f64,
    /// Height over the neck's diameter.
    pub aspect_ratio: f64,
}

/// A candidate plane for the neck: position on the path, and tilts towards two directions across it, rad.
#[derive(Debug, Clone, Copy)]
struct Plane {
    along: f64,
    tilt: [f64; 2],
}

/// The curve in which a plane cuts the wall around the path.
struct Cut {
    points_mm: Vec<Vec3>,
    triangles: Vec<usize>,
    area_mm2: f64,
}

impl Sac {
    /// Measures the sac that contains `dome_mm`, on an artery that contains `parent_mm`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a position outside the lumen, and if no plane between them cuts off a sac without
    /// openings.
    pub fn measure(wall: &Wall, dome_mm: Vec3, parent_mm: Vec3) -> Result<Self> {
        let ball = middle(wall, dome_mm)?;
        Self::beyond_neck(wall, ball, (dome_mm, parent_mm))
    }

    /// As [`Self::measure`], with the artery given by a centre line: its nearest position around which no ball in the
    /// lumen meets the sac's. The line may run through the sac.
    ///
    /// # Errors
    /// As [`Self::measure`]; if the whole line is in the sac.
    pub fn on_artery(wall: &Wall, dome_mm: Vec3, line: &CentrelineTree) -> Result<Self> {
        let ball = middle(wall, dome_mm)?;
        let away_mm = |node: &&CentrelineNode| (node.position_mm - ball.0).norm();
        let outside = line.nodes().iter().filter(|node| away_mm(node) > ball.1 + node.radius_mm);
        let Some(nearest) = outside.min_by(|a, b| away_mm(a).total_cmp(&away_mm(b))) else {
            let mend = "the centre line does not leave the sac: give a place in the artery";
            return Err(Error::parameter("parent", "absent", mend));
        };
        Self::beyond_neck(wall, ball, (dome_mm, nearest.position_mm))
    }

    /// The part beyond the neck between a ball in the sac and the artery.
    fn beyond_neck(
        wall: &Wall,
        (middle_mm, radius_mm): (Vec3, f64),
        (dome_mm, parent_mm): (Vec3, Vec3),
    ) -> Result<Self> {
        let way = parent_mm - middle_mm;
        if way.norm() <= radius_mm {
            let mend = "the artery begins within the sac: give a place in the artery, or another in the sac";
            return Err(Error::parameter("parent", crate::error::vector(&parent_mm), mend));
        }
        let neighbours = wall.neighbours();
        let search = Search { wall, neighbours, middle_mm, way, frame: Frame::new(-way, None) };
        let Some(Neck { plane, cut, beyond }) = search.least() else {
            let mend =
                "no plane between it and the artery cuts off a sac: it has no neck, or an opening of its own";
            return Err(Error::parameter("dome", crate::error::vector(&dome_mm), mend));
        };
        let normal = search.normal(plane);
        let neck_mm = cut.points_mm.iter().sum::<Vec3>() / cut.points_mm.len() as f64;
        let neck_diameter_mm = (4.0 * cut.area_mm2 / std::f64::consts::PI).sqrt();
        Ok(Self {
            neck_mm,
            normal,
            neck_area_mm2: cut.area_mm2,
            neck_diameter_mm,
            volume_mm3: beyond.volume_mm3,
            height_mm: beyond.height_mm,
            dome_diameter_mm: 2.0 * radius_mm,
            aspect_ratio: beyond.height_mm / neck_diameter_mm,
        })
    }
}

/// The middle of the largest ball reached by ascent from a position in the lumen, and its radius, mm.
fn middle(wall: &Wall, dome_mm: Vec3) -> Result<(Vec3, f64)> {
    let query = WallQuery::new(wall)?;
    let reach_mm = wall.mesh().bounds_mm().map_or(0.0, |(low, high)| (high - low).norm());
    let clearance =
        |at: &Vec3| query.nearest(at, reach_mm).filter(|near| near.distance_mm > 0.0 && !near.rim);
    let Some(mut near) = clearance(&dome_mm) else {
        let mend = "must be a place within the sac, in mm";
        return Err(Error::parameter("dome", crate::error::vector(&dome_mm), mend));
    };
    // Where two walls are equally near, the ascent is between their normals: all directions are tried.
    let (mut at, mut step) = (dome_mm, CLIMB.1);
    for _ in 0..CLIMB.0 {
        let steps =
            DIRECTIONS.map(|direction| at + Vec3::from(direction).normalize() * (step * near.distance_mm));
        let better = steps.into_iter().filter_map(|next| Some((next, clearance(&next)?)));
        match better.max_by(|a, b| a.1.distance_mm.total_cmp(&b.1.distance_mm)) {
            Some((next, there)) if there.distance_mm > near.distance_mm => (at, near) = (next, there),
            _ => step *= 0.5,
        }
    }
    Ok((at, near.distance_mm))
}

/// The part beyond a neck.
struct Beyond {
    volume_mm3: f64,
    height_mm: f64,
}

/// A plane that cuts off a sac.
struct Neck {
    plane: Plane,
    cut: Cut,
    beyond: Beyond,
}

struct Search<'a> {
    wall: &'a Wall,
    neighbours: Vec<[u32; 3]>,
    middle_mm: Vec3,
    /// From the middle to the parent artery.
    way: Vec3,
    /// Its tangent points back into the sac.
    frame: Frame,
}

impl Search<'_> {
    fn normal(&self, plane: Plane) -> Vec3 {
        self.frame.transported(plane.tilt[0], plane.tilt[1]).t
    }

    fn place(&self, plane: Plane) -> Vec3 {
        self.middle_mm + self.way * plane.along
    }

    /// The plane of smallest area that cuts off a sac.
    fn least(&self) -> Option<Neck> {
        let mut planes = Vec::new();
        for k in 0..PLACES {
            let along = k as f64 / PLACES as f64;
            planes.push(Plane { along, tilt: [0.0; 2] });
            for ring in 1..=TILTS.0 {
                let size = LARGEST_TILT * ring as f64 / TILTS.0 as f64;
                planes.extend((0..TILTS.1).map(|spoke| {
                    let (sin, cos) = libm::sincos(std::f64::consts::TAU * spoke as f64 / TILTS.1 as f64);
                    Plane { along, tilt: [size * cos, size * sin] }
                }));
            }
        }
        let mut best = planes.into_iter().fold(None, |best, plane| self.better(best, plane))?;
        let (mut part, mut turn) = (1.0 / PLACES as f64, LARGEST_TILT / TILTS.0 as f64);
        for _ in 0..HALVINGS {
            let Plane { along, tilt: [a, b] } = best.plane;
            let around = [
                Plane { along: (along + part).min(1.0), ..best.plane },
                Plane { along: (along - part).max(0.0), ..best.plane },
                Plane { tilt: [a + turn, b], ..best.plane },
                Plane { tilt: [a - turn, b], ..best.plane },
                Plane { tilt: [a, b + turn], ..best.plane },
                Plane { tilt: [a, b - turn], ..best.plane },
            ];
            let before = best.cut.area_mm2;
            for plane in around {
                best = self.better(Some(best), plane)?;
            }
            if best.cut.area_mm2 == before {
                (part, turn) = (0.5 * part, 0.5 * turn);
            }
        }
        Some(best)
    }

    fn better(&self, best: Option<Neck>, plane: Plane) -> Option<Neck> {
        let least = best.as_ref().map_or(f64::INFINITY, |best| best.cut.area_mm2);
        let cut = self.cut(plane).filter(|cut| cut.area_mm2 < least);
        let found = cut.and_then(|cut| Some(Neck { plane, beyond: self.beyond(plane, &cut)?, cut }));
        found.or(best)
    }

    /// Heights of the vertices above a plane.
    fn heights(&self, plane: Plane) -> Vec<f64> {
        let (place, normal) = (self.place(plane), self.normal(plane));
        self.wall.mesh().vertices_mm.iter().map(|v| (v - place).dot(&normal)).collect()
    }

    /// The curve of the plane around the path; `None` if the path is not inside a closed one.
    fn cut(&self, plane: Plane) -> Option<Cut> {
        let (mesh, heights) = (self.wall.mesh(), self.heights(plane));
        let is_above = |v: u32| heights[v as usize] >= 0.0;
        // Maps the edge where a triangle's boundary descends through the plane to the one where it ascends.
        let mut onwards: BTreeMap<(u32, u32), ((u32, u32), usize)> = BTreeMap::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let edges = [0, 1, 2].map(|k| (triangle[k], triangle[(k + 1) % 3]));
            let down = edges.iter().find(|(a, b)| is_above(*a) && !is_above(*b));
            let up = edges.iter().find(|(a, b)| !is_above(*a) && is_above(*b));
            if let (Some(down), Some(up)) = (down, up) {
                onwards.insert(*down, ((up.1, up.0), t));
            }
        }
        let (place, normal) = (self.place(plane), self.normal(plane));
        let frame = Frame::new(normal, None);
        while let Some((&first, _)) = onwards.first_key_value() {
            let (mut at, mut points_mm, mut triangles) = (first, Vec::new(), Vec::new());
            while let Some((next, triangle)) = onwards.remove(&at) {
                let [a, b] = [at.0, at.1].map(|v| (mesh.vertices_mm[v as usize], heights[v as usize]));
                points_mm.push(a.0 + (b.0 - a.0) * (a.1 / (a.1 - b.1)));
                triangles.push(triangle);
                at = next;
            }
            let flat: Vec<[f64; 2]> =
                points_mm.iter().map(|p| [(p - place).dot(&frame.u), (p - place).dot(&frame.v)]).collect();
            if at == first && winds(&flat) {
                let pairs = flat.iter().zip(flat.iter().cycle().skip(1));
                let area_mm2 = 0.5 * pairs.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs();
                return Some(Cut { points_mm, triangles, area_mm2 });
            }
        }
        None
    }

    /// The part connected to a curve above its plane; `None` if that leads to an opening or through the plane again.
    fn beyond(&self, plane: Plane, cut: &Cut) -> Option<Beyond> {
        let (mesh, heights, place) = (self.wall.mesh(), self.heights(plane), self.place(plane));
        let mut seen = vec![false; mesh.triangles.len()];
        let mut open = cut.triangles.clone();
        open.iter().for_each(|&t| seen[t] = true);
        let mut volume_mm3 = 0.0;
        let mut height_mm: f64 = 0.0;
        let mut crossed = 0;
        while let Some(t) = open.pop() {
            let triangle = mesh.triangles[t];
            let above = triangle.map(|v| heights[v as usize] >= 0.0);
            crossed += usize::from(above.contains(&true) && above.contains(&false));
            for k in 0..3 {
                height_mm = height_mm.max(heights[triangle[k] as usize]);
                if above[k] || above[(k + 1) % 3] {
                    let next = self.neighbours[t][k];
                    if next == NO_NEIGHBOUR {
                        return None;
                    }
                    if !std::mem::replace(&mut seen[next as usize], true) {
                        open.push(next as usize);
                    }
                }
            }
            let corners = triangle.map(|v| (mesh.vertices_mm[v as usize] - place, heights[v as usize]));
            volume_mm3 += part_above(&corners);
        }
        (crossed == cut.triangles.len()).then(|| Beyond { volume_mm3: volume_mm3.abs(), height_mm })
    }
}

/// Whether a closed curve winds around the origin.
fn winds(flat: &[[f64; 2]]) -> bool {
    let pairs = flat.iter().zip(flat.iter().cycle().skip(1));
    let crossings = pairs
        .filter(|(a, b)| (a[1] > 0.0) != (b[1] > 0.0) && a[0] + (b[0] - a[0]) * a[1] / (a[1] - b[1]) > 0.0);
    crossings.count() % 2 == 1
}

/// Volume of the tetrahedra from the origin, a point of the plane, to the part of a triangle above the plane.
fn part_above(corners: &[(Vec3, f64); 3]) -> f64 {
    let mut polygon: Vec<Vec3> = Vec::with_capacity(4);
    for k in 0..3 {
        let ((a, above_a), (b, above_b)) = (corners[k], corners[(k + 1) % 3]);
        if above_a >= 0.0 {
            polygon.push(a);
        }
        if (above_a >= 0.0) != (above_b >= 0.0) {
            polygon.push(a + (b - a) * (above_a / (above_a - above_b)));
        }
    }
    (2..polygon.len()).map(|k| polygon[0].dot(&polygon[k - 1].cross(&polygon[k])) / 6.0).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::vessel::{ExtractedCentreline, GeneratedWall, Resolution, anatomy};

    fn measured(name: &str, edge_mm: f64) -> (Sac, f64) {
        let tree = anatomy::tree(name).unwrap();
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm)).unwrap();
        let dome_mm = tree.nodes()[tree.target("dome").unwrap().row].position_mm;
        let parent_mm = tree.nodes()[3].position_mm;
        // Off the middle, like a mouse click.
        let click_mm = dome_mm + Vec3::new(1.0, 0.5, 0.7);
        (Sac::measure(&made.wall, click_mm, parent_mm).unwrap(), made.wall.volume_mm3())
    }

    #[test]
    fn a_sac_is_the_ball_that_it_was_made_of_and_its_neck_is_narrow() {
        let (sac, _) = measured("sidewall_aneurysm", 0.4);
        assert!((sac.dome_diameter_mm - 7.0).abs() < 0.15, "{sac:?}");
        // The artery's fillet widens the tube of 3.2 mm from which it was made.
        assert!((3.2..4.2).contains(&sac.neck_diameter_mm), "{sac:?}");
        assert!(sac.normal.y > 0.95, "{sac:?}");
        // A ball of 7 mm without the cap beyond the neck.
        let cap_mm = 3.5 - (3.5f64.powi(2) - 0.25 * sac.neck_diameter_mm.powi(2)).sqrt();
        let ball_mm3 = 4.0 / 3.0 * PI * 3.5f64.powi(3) - PI * cap_mm * cap_mm * (3.5 - cap_mm / 3.0);
        assert!((sac.volume_mm3 / ball_mm3 - 1.0).abs() < 0.03, "{sac:?} {ball_mm3}");
        assert!((sac.height_mm - (7.0 - cap_mm)).abs() < 0.3, "{sac:?}");
    }

    #[test]
    fn the_neck_hardly_depends_on_the_mesh() {
        let ((coarse, whole_mm3), (fine, _)) =
            (measured("basilar_aneurysm", 0.6), measured("basilar_aneurysm", 0.35));
        assert!((coarse.neck_area_mm2 / fine.neck_area_mm2 - 1.0).abs() < 0.05, "{coarse:?} {fine:?}");
        assert!((coarse.volume_mm3 / fine.volume_mm3 - 1.0).abs() < 0.03, "{coarse:?} {fine:?}");
        // A line from one artery to the other may run through the sac.
        let tree = anatomy::tree("basilar_aneurysm").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(0.6)).unwrap().wall;
        let dome_mm = tree.nodes()[8].position_mm;
        let line = ExtractedCentreline::of(&wall, None, &[]).unwrap().tree;
        let found = Sac::on_artery(&wall, dome_mm, &line).unwrap();
        assert!((found.neck_area_mm2 / coarse.neck_area_mm2 - 1.0).abs() < 0.05, "{found:?}");
        assert!((fine.dome_diameter_mm - 8.0).abs() < 0.2 && fine.volume_mm3 < 0.5 * whole_mm3);
    }

    #[test]
    fn a_place_without_a_sac_is_refused() {
        let tree = anatomy::tree("sidewall_aneurysm").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(0.8)).unwrap().wall;
        let at = |row: usize| tree.nodes()[row].position_mm;
        let refused = |dome, parent| Sac::measure(&wall, dome, parent).unwrap_err().to_string();
        assert!(refused(at(5) + Vec3::new(0.0, 0.0, -1.0), at(2)).contains("no plane"));
        assert!(refused(Vec3::new(50.0, 0.0, 0.0), at(2)).contains("within the sac"));
        assert!(refused(at(10), at(9)).contains("begins within the sac"));
    }
}
