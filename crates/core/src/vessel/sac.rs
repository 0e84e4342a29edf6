//! The sac of an aneurysm: position and width of its neck, and its volume.
//!
//! The neck is the plane with the least section of the lumen that separates the middle of the sac from the artery and
//! from all openings. For a given normal all planes are compared in one descent (`descent.rs`), so that only the two
//! angles of the normal are left: directions are tried all around, and the best of them improved by nested searches
//! along lines, since the least area has edges where the plane touches the artery. Nothing in that depends on where in
//! the artery a place is given. The volume of the sac is the sum of the tetrahedra from a point of the plane, to which
//! the neck itself adds nothing.

mod descent;
#[cfg(test)]
mod tests;

use serde::Serialize;

use super::{CentrelineNode, CentrelineTree, Wall, WallQuery};
use crate::rod::Frame;
use crate::{Error, Result, Vec3};
use descent::{Descent, Room, Slope};

/// Number of directions tried all around.
const AROUND: usize = 64;
/// Number of the best of them that are improved, and the largest cosine of the angle between them.
const STARTS: (usize, f64) = (2, 0.7);
/// Largest changes of the two angles in the rounds of an improvement, rad, and number of rounds for all starts.
const ROUNDS: ([f64; 3], usize) = ([0.4, 0.06, 0.008], 2);
/// Number of steps of a search along a line, which leave an eighteenth of it, and the part of an interval that each
/// takes off: golden sections.
const LINE: (usize, f64) = (6, 0.381_966_011_250_105_1);
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

/// Area of a neck, over the square of the radius of the largest ball, up to which there is none: rounding.
const NO_NECK: f64 = 1e-9;

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

impl Sac {
    /// Measures the sac that contains `dome_mm`, on an artery that contains `parent_mm`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a position outside the lumen, and if no plane between them cuts off a sac without
    /// openings.
    pub fn measure(wall: &Wall, dome_mm: Vec3, parent_mm: Vec3) -> Result<Self> {
        let query = WallQuery::new(wall)?;
        let ball = middle(&query, dome_mm)?;
        if !query.nearest(&parent_mm, f64::MAX).is_some_and(|near| near.rim || near.distance_mm > 0.0) {
            let remedy = "must be a place within the artery, in mm";
            return Err(Error::parameter("parent", crate::error::vector(&parent_mm), remedy));
        }
        Self::beyond_neck((wall, &query), ball, (dome_mm, parent_mm))
    }

    /// As [`Self::measure`], with the artery given by a centre line: its nearest position around which no ball in the
    /// lumen meets the sac's. The line may run through the sac.
    ///
    /// # Errors
    /// As [`Self::measure`]; if the whole line is in the sac.
    pub fn on_artery(wall: &Wall, dome_mm: Vec3, line: &CentrelineTree) -> Result<Self> {
        let query = WallQuery::new(wall)?;
        let ball = middle(&query, dome_mm)?;
        let away_mm = |node: &&CentrelineNode| (node.position_mm - ball.0).norm();
        let outside = line.nodes().iter().filter(|node| away_mm(node) > ball.1 + node.radius_mm);
        let Some(nearest) = outside.min_by(|a, b| away_mm(a).total_cmp(&away_mm(b))) else {
            let remedy = "the centre line does not leave the sac: give a place in the artery";
            return Err(Error::parameter("parent", "absent", remedy));
        };
        Self::beyond_neck((wall, &query), ball, (dome_mm, nearest.position_mm))
    }

    /// The part beyond the neck between a ball in the sac and the artery.
    fn beyond_neck(
        (wall, query): (&Wall, &WallQuery),
        (middle_mm, radius_mm): (Vec3, f64),
        (dome_mm, parent_mm): (Vec3, Vec3),
    ) -> Result<Self> {
        if (parent_mm - middle_mm).norm() <= radius_mm {
            let remedy =
                "the artery begins within the sac: give a place in the artery, or another in the sac";
            return Err(Error::parameter("parent", crate::error::vector(&parent_mm), remedy));
        }
        let slope = Slope::new((wall, query), (middle_mm, radius_mm), parent_mm);
        let neck =
            least(&slope).and_then(|(normal, level_mm)| Some((normal, slope.beyond(&normal, level_mm)?)));
        let Some((normal, beyond)) = neck else {
            let remedy =
                "no plane between it and the artery cuts off a sac: it has no neck, or an opening of its own";
            return Err(Error::parameter("dome", crate::error::vector(&dome_mm), remedy));
        };
        if beyond.area_mm2 <= NO_NECK * radius_mm * radius_mm {
            let remedy = "is not joined to the artery: no lumen leads from one to the other; unite the two (\"boolean union\") in a \
                          program for meshes";
            return Err(Error::parameter("dome", crate::error::vector(&dome_mm), remedy));
        }
        let neck_diameter_mm = (4.0 * beyond.area_mm2 / std::f64::consts::PI).sqrt();
        Ok(Self {
            neck_mm: beyond.middle_mm,
            normal,
            neck_area_mm2: beyond.area_mm2,
            neck_diameter_mm,
            volume_mm3: beyond.volume_mm3,
            height_mm: beyond.height_mm,
            dome_diameter_mm: 2.0 * radius_mm,
            aspect_ratio: beyond.height_mm / neck_diameter_mm,
        })
    }
}

/// The middle of the largest ball reached by ascent from a position in the lumen, and its radius, mm.
fn middle(query: &WallQuery, dome_mm: Vec3) -> Result<(Vec3, f64)> {
    let reach_mm = query.mesh().bounds_mm().map_or(0.0, |(low, high)| (high - low).norm());
    let clearance =
        |at: &Vec3| query.nearest(at, reach_mm).filter(|near| near.distance_mm > 0.0 && !near.rim);
    let Some(mut near) = clearance(&dome_mm) else {
        let remedy = "must be a place within the sac, in mm";
        return Err(Error::parameter("dome", crate::error::vector(&dome_mm), remedy));
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

/// Normal of the plane of least area, into the sac, and its height above the middle, mm.
fn least(slope: &Slope) -> Option<(Vec3, f64)> {
    let mut room = Room::default();
    let mut tried: Vec<(Vec3, Descent)> = around().map(|n| (n, slope.descend(&n, &mut room))).collect();
    tried.sort_by(|a, b| a.1.order(&b.1));
    let mut starts: Vec<(Vec3, Descent)> = Vec::with_capacity(STARTS.0);
    for (normal, found) in tried {
        if starts.len() < STARTS.0 && starts.iter().all(|start| start.0.dot(&normal) < STARTS.1) {
            starts.push((normal, found));
        }
    }
    let (rounds, of_all) = ROUNDS;
    let mut improve = |start: (Vec3, Descent), rounds: &[f64]| {
        rounds.iter().fold(start, |best, most| improved(slope, best.0, *most, &mut room))
    };
    let all = starts.into_iter().map(|start| improve(start, &rounds[..of_all])).collect::<Vec<_>>();
    let best = all.into_iter().min_by(|a, b| a.1.order(&b.1))?;
    let (normal, found) = improve(best, &rounds[of_all..]);
    found.area_mm2.is_finite().then_some((normal, found.level_mm))
}

/// Directions all around, equally dense: on a spiral with the golden angle between them.
fn around() -> impl Iterator<Item = Vec3> {
    (0..AROUND).map(|k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / AROUND as f64;
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * LINE.1 * k as f64);
        let off = (1.0 - z * z).sqrt();
        Vec3::new(off * cos, off * sin, z)
    })
}

/// The best normal found by turning one by up to an angle: along lines of one direction, the best of each compared
/// along the other. The best of a line follows an edge of the least area wherever it runs.
fn improved(slope: &Slope, normal: Vec3, most: f64, room: &mut Room) -> (Vec3, Descent) {
    let frame = Frame::new(normal, None);
    let mut along = |a: f64| {
        let mut at = |b: f64| slope.descend(&frame.transported(a, b).t, room);
        let middle = at(0.0);
        least_about(middle, most, at, Descent::order)
    };
    let middle = along(0.0);
    let (a, (b, found)) = least_about(middle, most, along, |x, y| x.1.order(&y.1));
    (frame.transported(a, b).t, found)
}

/// Where between −`most` and `most` a function is least, and its value; `middle` is that at zero.
fn least_about<T>(
    middle: T,
    most: f64,
    mut of: impl FnMut(f64) -> T,
    order: impl Fn(&T, &T) -> std::cmp::Ordering,
) -> (f64, T) {
    let (mut low, mut best, mut high) = (-most, (0.0, middle), most);
    for _ in 0..LINE.0 {
        let (below, above) = (best.0 - low, high - best.0);
        let x = best.0 + LINE.1 * if above > below { above } else { -below };
        let value = of(x);
        if order(&value, &best.1).is_lt() {
            *(if x > best.0 { &mut low } else { &mut high }) = best.0;
            best = (x, value);
        } else {
            *(if x > best.0 { &mut high } else { &mut low }) = x;
        }
    }
    best
}
