//! Entry of a device into a surface.

use serde::Serialize;

use endowire_core::Vec3;
use endowire_core::insertion::Sheath;
use endowire_core::vessel::{Wall, WallQuery};

/// How a sheath was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// It was given.
    Given,
    /// The wall's inlet, or the largest opening that admits the device; its index.
    Opening(usize),
    /// A position inside: there is no opening to enter.
    Inside,
}

impl std::fmt::Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Given => f.write_str("given"),
            Self::Opening(k) => write!(f, "opening {k}"),
            Self::Inside => f.write_str("found inside"),
        }
    }
}

/// Number of openings tried: a torn surface has thousands, and a suitable one is among the largest.
const OPENINGS_TRIED: usize = 8;
/// Number of triangles from which a search inside starts.
const RAYS: usize = 512;
/// Number of positions inside that are examined closely.
const PLACES: usize = 48;
/// Number of directions tried at a position.
const DIRECTIONS: usize = 256;
/// Angles from the best direction at which others are then tried, rad.
const SPREADS_RAD: [f64; 3] = [0.1, 0.04, 0.015];
/// Clearance of a suitable position, as a fraction of the largest found: the widest position is often in a sac
/// without continuation.
const WIDE: f64 = 0.5;

/// Distance of the wall from a sheath's mouth, mm; `None` outside the vessel or if that is undecidable.
fn room_mm(wall: &Wall, query: &WallQuery, sheath: &Sheath) -> Option<f64> {
    // As tested for an insertion: just in front of the mouth.
    let inside = wall.contains(&(sheath.position_mm + 1e-3 * sheath.direction)).unwrap_or(false);
    let room = query.nearest(&sheath.position_mm, f64::MAX)?.distance_mm.abs();
    inside.then_some(room)
}

/// The wall's inlet, or if a device of `radius_mm` does not fit, the largest opening that admits it.
pub(super) fn at_opening(wall: &Wall, query: &WallQuery, radius_mm: f64) -> Option<(Sheath, Found)> {
    for opening in wall.inlet().into_iter().chain(wall.openings().iter().take(OPENINGS_TRIED)) {
        if opening.radius_mm < radius_mm {
            continue;
        }
        // The usual depth first; an oblique opening needs more.
        for depth_mm in [1.0, opening.radius_mm, 2.0 * opening.radius_mm] {
            let Ok(sheath) = Sheath::at_opening(wall, opening.index, depth_mm) else { continue };
            if room_mm(wall, query, &sheath).is_some_and(|room| room > radius_mm) {
                return Some((sheath, Found::Opening(opening.index)));
            }
        }
    }
    None
}

/// A position inside with a large clearance, and the direction with the longest free path.
///
/// From triangles spread over the surface rays are cast along the inward normal; the middle of the chord to the
/// opposite wall is deep inside. Among positions with enough clearance, the one with the longest path is chosen: it
/// points along a vessel.
pub(super) fn inside(wall: &Wall, query: &WallQuery, radius_mm: f64) -> Option<(Sheath, Found)> {
    let mesh = wall.mesh();
    let (low, high) = mesh.bounds_mm()?;
    let size = (high - low).norm();
    let stride = mesh.triangles.len().div_ceil(RAYS);
    let mut places: Vec<(f64, Vec3)> = Vec::new();
    for triangle in (0..mesh.triangles.len()).step_by(stride) {
        let [a, b, c] = mesh.corners(triangle);
        let normal = query.inward_normal(triangle as u32);
        let from = (a + b + c) / 3.0 + normal * (1e-6 * size);
        let Some(part) = query.crossing(&from, &(from + normal * size), 1.0) else { continue };
        let middle = from + normal * (0.5 * part * size);
        if let Some(near) = query.nearest(&middle, f64::MAX) {
            places.push((near.distance_mm.abs(), middle));
        }
    }
    // Stable: among positions with equal clearance, that of the first triangle.
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    places.retain(|(room, _)| *room > radius_mm);
    let mut widest = None;
    let mut best: Option<(f64, Sheath)> = None;
    let mut looked_at = 0;
    for (room, position_mm) in places {
        if looked_at == PLACES || widest.is_some_and(|widest| room < WIDE * widest) {
            break;
        }
        if !wall.contains(&position_mm).unwrap_or(false) {
            continue;
        }
        looked_at += 1;
        widest = widest.or(Some(room));
        let (way, direction) = longest_way(query, position_mm, size);
        if best.is_none_or(|(longest, _)| way > longest) {
            best = Some((
                way,
                Sheath { position_mm, direction, friction_n: 0.0, friction: 0.0, bends_towards: None },
            ));
        }
    }
    let (_, sheath) = best?;
    room_mm(wall, query, &sheath).filter(|room| *room > radius_mm)?;
    Some((sheath, Found::Inside))
}

/// The direction with the longest free path from a position, and that path as a fraction of `size`.
fn longest_way(query: &WallQuery, from: Vec3, size: f64) -> (f64, Vec3) {
    let way = |direction: Vec3| query.crossing(&from, &(from + direction * size), 1.0).unwrap_or(1.0);
    let mut best = (0.0, Vec3::z());
    let mut look = |direction: Vec3| {
        let found = way(direction);
        if found > best.0 {
            best = (found, direction);
        }
        best.1
    };
    let mut around = Vec3::z();
    for k in 0..DIRECTIONS {
        around = look(sphere(k));
    }
    // Directions are a seventh of a radian apart; a narrow vessel requires finer ones.
    for spread in SPREADS_RAD {
        let middle = around;
        for k in 0..DIRECTIONS / 8 {
            around = look((middle + sphere(8 * k) * spread).normalize());
        }
    }
    best
}

/// Points spread evenly over the unit sphere, on a spiral with the golden angle.
fn sphere(k: usize) -> Vec3 {
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
    let (sin, cos) = (golden * k as f64).sin_cos();
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

    #[test]
    fn a_closed_vessel_is_entered_inside_along_its_course() {
        let open =
            GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.5)).unwrap();
        let query = WallQuery::new(&open.wall).unwrap();
        let (_, found) = at_opening(&open.wall, &query, 0.4).unwrap();
        assert!(matches!(found, Found::Opening(_)));
        assert!(at_opening(&open.wall, &query, 5.0).is_none());

        let closed = Wall::from_surface(&open.wall.closed_mesh()).unwrap();
        assert!(closed.openings().is_empty());
        let query = WallQuery::new(&closed).unwrap();
        assert!(at_opening(&closed, &query, 0.4).is_none());
        let (sheath, found) = inside(&closed, &query, 0.4).unwrap();
        assert_eq!(found, Found::Inside);
        assert!(closed.contains(&sheath.position_mm).unwrap());
        // The longest paths are in the straight leg, along it.
        assert!(sheath.direction.z.abs() > 0.95, "{sheath:?}");
        assert!(inside(&closed, &query, 4.5).is_none(), "nothing so thick fits");
    }
}
