//! Survey of a wall: its width, where two vessels almost touch, and a suitable start for a device.

use std::cell::LazyCell;
use std::f64::consts::PI;

use super::boxes::Tree;
use super::mesh::inward_normal;
use super::{SurfaceMesh, Wall};
use crate::Vec3;

/// Largest number of triangles sampled, evenly over the wall.
const SAMPLES: usize = 20_000;
/// Distance of a ray's start from its triangle, relative to the wall's size.
const OFF: f64 = 1e-7;
/// Largest cosine between normals of two sheets back to back.
const BACK_TO_BACK: f64 = -0.5;
/// Triangles this many edges apart do not belong to one sheet bent around a corner.
const STEPS_APART: usize = 8;
/// Number of chords whose middles are tried for a sheath, and of directions there.
const PLACES: usize = 48;
const DIRECTIONS: usize = 200;

/// Width of the lumen: half chords along the inward normals of the wall.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LumenReport {
    /// Smallest half chord in mm.
    pub smallest_mm: f64,
    /// The middle of this chord, mm.
    pub smallest_at_mm: [f64; 3],
    /// First percentile of half chords, mm, which single faulty triangles do not affect.
    pub percentile_1_mm: f64,
    /// Fifth percentile, mm.
    pub percentile_5_mm: f64,
    /// Median half chord, mm.
    pub median_mm: f64,
    /// Number of chords measured.
    pub chords: usize,
}

/// Places where two sheets of the wall are back to back, with a lumen on either side.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SeptaReport {
    /// Thickness below which a septum counts, mm.
    pub below_mm: f64,
    /// Number of triangles sampled.
    pub asked: usize,
    /// Number of these that are part of such a septum.
    pub thin: usize,
    /// Thickness of the thinnest, mm.
    pub thinnest_mm: Option<f64>,
    /// Its position, mm.
    pub thinnest_at_mm: Option<[f64; 3]>,
}

/// A suitable position of a sheath inside the vessel.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct StartReport {
    /// For `sheath.position_mm`.
    pub position_mm: [f64; 3],
    /// For `sheath.direction`: the one with the longest free path.
    pub direction: [f64; 3],
    /// Distance to the wall there, mm.
    pub clearance_mm: f64,
    /// Length of the free path, mm.
    pub free_mm: f64,
}

/// The result of [`survey`]; parts are absent if the wall encloses nothing.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Survey {
    /// The lumen's width.
    pub lumen: Option<LumenReport>,
    /// Thin septa.
    pub septa: SeptaReport,
    /// A suitable start.
    pub start: Option<StartReport>,
}

/// Measures `wall` by rays from up to 20,000 of its triangles. Septa thinner than `septum_mm` are counted.
pub fn survey(wall: &Wall, septum_mm: f64) -> Survey {
    let mesh = wall.mesh();
    let boxes = all_boxes(mesh);
    let size_mm = mesh.used_bounds_mm().map_or(0.0, |(low, high)| (high - low).norm());
    let off_mm = OFF * size_mm;
    // Computed only if needed, since few walls have septa.
    let neighbours = LazyCell::new(|| wall.neighbours());
    let every = mesh.triangles.len().div_ceil(SAMPLES).max(1);
    let mut chords: Vec<(f64, Vec3)> = Vec::new();
    let mut septa =
        SeptaReport { below_mm: septum_mm, asked: 0, thin: 0, thinnest_mm: None, thinnest_at_mm: None };
    for t in (0..mesh.triangles.len()).step_by(every) {
        let (at, inward) = (mesh.middle(t), inward_normal(mesh, t));
        septa.asked += 1;
        if let Some(half) = half_chord(&boxes, mesh, (at, inward), size_mm) {
            chords.push((half, at + inward * half));
        }
        let back = boxes.first_met(mesh, &(at - inward * off_mm), &-inward, septum_mm);
        if let Some((mm, other)) = back
            && inward_normal(mesh, other as usize).dot(&inward) < BACK_TO_BACK
            && !within_steps(&neighbours, t as u32, other)
        {
            septa.thin += 1;
            if septa.thinnest_mm.is_none_or(|thinnest| mm < thinnest) {
                septa.thinnest_mm = Some(mm);
                septa.thinnest_at_mm = Some((at - inward * (mm / 2.0)).into());
            }
        }
    }
    chords.sort_by(|a, b| a.0.total_cmp(&b.0));
    let start = start(wall, &boxes, &chords, size_mm);
    let at = |part: f64| chords[(part * (chords.len() - 1) as f64) as usize].0;
    let lumen = chords.first().map(|(smallest_mm, place)| LumenReport {
        smallest_mm: *smallest_mm,
        smallest_at_mm: (*place).into(),
        percentile_1_mm: at(0.01),
        percentile_5_mm: at(0.05),
        median_mm: at(0.5),
        chords: chords.len(),
    });
    Survey { lumen, septa, start }
}

/// The boxes of all triangles. So few rays are not worth the structures of a query.
fn all_boxes(mesh: &SurfaceMesh) -> Tree {
    Tree::new(mesh, (0..mesh.triangles.len() as u32).collect())
}

/// Half the distance from a position on the wall along its inward normal to the opposite wall, mm.
fn half_chord(boxes: &Tree, mesh: &SurfaceMesh, (at, inward): (Vec3, Vec3), size_mm: f64) -> Option<f64> {
    let off_mm = OFF * size_mm;
    let (mm, _) = boxes.first_met(mesh, &(at + inward * off_mm), &inward, size_mm)?;
    Some((mm + off_mm) / 2.0)
}

/// Largest number of triangles sampled for the median alone.
const FEW_SAMPLES: usize = 1000;

/// Median half chord along inward normals of the wall, mm, as in [`LumenReport`] but from fewer triangles; `None`
/// without any hit.
pub(super) fn median_half_lumen_mm(wall: &Wall) -> Option<f64> {
    let mesh = wall.mesh();
    let boxes = all_boxes(mesh);
    let size_mm = mesh.used_bounds_mm().map_or(0.0, |(low, high)| (high - low).norm());
    let every = mesh.triangles.len().div_ceil(FEW_SAMPLES).max(1);
    let asked = (0..mesh.triangles.len()).step_by(every);
    let chord = |t: usize| half_chord(&boxes, mesh, (mesh.middle(t), inward_normal(mesh, t)), size_mm);
    let mut chords: Vec<f64> = asked.filter_map(chord).collect();
    chords.sort_by(f64::total_cmp);
    chords.get(chords.len().saturating_sub(1) / 2).copied()
}

/// Whether one triangle is reached from the other across a few edges.
fn within_steps(neighbours: &[[u32; 3]], from: u32, to: u32) -> bool {
    let mut reached = vec![from];
    let mut ring = 0;
    for _ in 0..STEPS_APART {
        let end = reached.len();
        for k in ring..end {
            for next in neighbours[reached[k] as usize] {
                if next != super::NO_NEIGHBOUR && !reached.contains(&next) {
                    reached.push(next);
                }
            }
        }
        ring = end;
    }
    reached.contains(&to)
}

/// The middle of a chord that is deepest in the lumen, and the direction with the longest free path.
fn start(wall: &Wall, boxes: &Tree, chords: &[(f64, Vec3)], size_mm: f64) -> Option<StartReport> {
    // Few of the longest, many of the rest: the longest chords may run along the vessel.
    let (mesh, count) = (wall.mesh(), chords.len());
    let step = |k: usize| count - 1 - (count - 1) * k * k / (PLACES * PLACES);
    let mut places: Vec<(f64, Vec3)> = Vec::new();
    for k in 0..PLACES.min(count) {
        let (_, place) = chords[step(k)];
        places.extend(boxes.distance_mm(mesh, &place).map(|clearance_mm| (clearance_mm, place)));
    }
    // An inside test visits all triangles: the deepest positions are tested first.
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (clearance_mm, place) =
        places.into_iter().find(|(_, place)| wall.contains(place).is_ok_and(|inside| inside))?;
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let mut longest = (0.0, Vec3::x());
    for k in 0..DIRECTIONS {
        let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
        let (sin, cos) = libm::sincos(golden * k as f64);
        let across = (1.0 - z * z).sqrt();
        let direction = Vec3::new(across * cos, across * sin, z);
        // A path that leaves through an opening counts as the longest.
        let free = boxes.first_met(mesh, &place, &direction, size_mm).map_or(0.0, |met| met.0);
        if free > longest.0 {
            longest = (free, direction);
        }
    }
    Some(StartReport {
        position_mm: place.into(),
        direction: longest.1.into(),
        clearance_mm,
        free_mm: longest.0,
    })
}
