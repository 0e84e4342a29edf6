//! Uniform remeshing of a surface.
//!
//! The contact surface blends quadrics fitted at the vertices of a mesh. That works where a mesh is uniform, and fails
//! where it has slivers, fans, facets much longer than the vessel is wide, or noise; surfaces of real vessels have
//! all of these. Here such a surface gets vertices that depend on its geometry and not on its triangulation:
//!
//! 1. A mesh that is even and smooth already is returned as it is (`evenness`).
//! 2. The lumen's radius and the curvature say how long edges should be (`sizes`).
//! 3. The mesh is split, collapsed, flipped and evened out on the given surface (`remesh`, `corners`,
//!    `reference`).
//! 4. Kinks and noise are faired within the limit (`fairing`, `bumps`); where that leaves curvature, steps 2 to 4 follow with shorter edges,
//!    and so they do where the two surfaces are too far apart (`deviation`).
//! 5. Blades, spikes and folds that no even mesh can hold are cut off (`spikes`), beyond the limit if need be.
//!
//! Small bodies in the lumen are left out of this (`small`). Openings stay open, nothing is welded, and what is not a manifold stays where it is.

mod bumps;
mod corners;
mod deviation;
mod evenness;
mod fairing;
mod reference;
mod remesh;
mod sizes;
mod small;
mod spikes;
#[cfg(test)]
mod tests;

use std::borrow::Cow;

use super::SurfaceMesh;
use super::wall::validate;
use crate::{Error, Result, Vec3};
use corners::Corners;
use evenness::Evenness;
use reference::Reference;
use remesh::Remesher;
use sizes::Wanted;

/// Mean bump, in edges, above which even a uniform mesh is faired. Generated walls have up to 0.004, with eight edges
/// around a tube; noise of a fiftieth of the edges has 0.0065.
const ROUGH: f64 = 0.005;
/// Number of rounds of sizes, triangles and fairing; in each, edges are adapted to the result of the last one.
const ROUNDS: usize = 2;
/// Number of remeshing rounds in the first of these and in later ones.
const REMESHINGS: (usize, usize) = (3, 1);
/// Number of fairing iterations in the last round and in the others.
const ITERATIONS: (usize, usize) = (40, 15);
/// Number of times edges are shortened where the surfaces are farther apart than the limit.
const CORRECTIONS: usize = 1;

/// Largest distance by which a wall may be moved, mm: any vessel is gone.
pub(crate) const LARGEST_DEVIATION_MM: f64 = 10.0;

/// Limits of [`condition`].
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Conditioning {
    /// Largest distance of the conditioned surface from the given one, mm; at most a twentieth of the lumen's local
    /// radius.
    pub deviation_mm: f64,
    /// Target for the largest number of triangles; edges get longer instead.
    pub most_triangles: usize,
}

impl Default for Conditioning {
    fn default() -> Self {
        Self { deviation_mm: 0.1, most_triangles: 400_000 }
    }
}

impl Conditioning {
    fn wanted(&self) -> Wanted {
        Wanted { deviation_mm: self.deviation_mm, most_triangles: self.most_triangles }
    }

    fn check(&self) -> Result<()> {
        if !(self.deviation_mm > 0.0 && self.deviation_mm <= LARGEST_DEVIATION_MM) {
            let remedy = format!(
                "must be above 0 and at most {LARGEST_DEVIATION_MM}: how far the wall may be moved, mm"
            );
            return Err(Error::parameter("deviation_mm", self.deviation_mm, remedy));
        }
        if self.most_triangles == 0 {
            return Err(Error::parameter("most_triangles", 0, "must be positive"));
        }
        Ok(())
    }
}

/// A conditioned surface. The distance of the wall made of it from the given one is measured by
/// [`ContactSurface::deviation`](crate::contact::ContactMesh::deviation).
#[derive(Debug, Clone, PartialEq)]
pub struct Conditioned<'a> {
    /// The mesh, counter-clockwise from outside like the given one; the given one itself if already uniform.
    pub mesh: Cow<'a, SurfaceMesh>,
    /// Whether it differs from the given one.
    pub changed: bool,
    /// Shortest edge, mm.
    pub edge_min_mm: f64,
    /// Median edge, mm.
    pub edge_median_mm: f64,
    /// Longest edge, mm.
    pub edge_max_mm: f64,
    /// Smallest angle of a triangle, radians.
    pub least_angle: f64,
    /// Largest angle between two neighbouring triangles, radians.
    pub largest_turn: f64,
    /// Whether edges are longer than the surface requires, to limit their number.
    pub too_many: bool,
}

impl<'a> Conditioned<'a> {
    fn new(mesh: Cow<'a, SurfaceMesh>, even: &Evenness, too_many: bool) -> Self {
        Self {
            changed: matches!(mesh, Cow::Owned(_)),
            mesh,
            edge_min_mm: even.edge_min_mm,
            edge_median_mm: even.edge_median_mm,
            edge_max_mm: even.edge_max_mm,
            least_angle: even.least_angle,
            largest_turn: even.largest_turn,
            too_many,
        }
    }
}

/// A uniform mesh of `surface`, whose triangles must be counter-clockwise seen from outside the lumen. If it is
/// already uniform, it is returned bit for bit.
///
/// # Errors
/// [`Error::Mesh`] if there are no triangles, an index is out of range or a coordinate is not finite; [`Error::Parameter`] for an
/// option out of its range.
pub fn condition<'a>(surface: &'a SurfaceMesh, options: &Conditioning) -> Result<Conditioned<'a>> {
    options.check()?;
    validate(surface)?;
    let Some((rest, bodies)) = small::apart(surface) else { return Ok(even(surface, options)) };
    let rest = even(&rest, options);
    let mut mesh = rest.mesh.into_owned();
    let first = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.extend(bodies.vertices_mm);
    mesh.triangles.extend(bodies.triangles.into_iter().map(|triangle| triangle.map(|v| v + first)));
    Ok(Conditioned { mesh: Cow::Owned(mesh), changed: true, ..rest })
}

/// [`condition`] of a surface without small bodies.
fn even<'a>(surface: &'a SurfaceMesh, options: &Conditioning) -> Conditioned<'a> {
    let reference = Reference::new(surface);
    let mut corners = Corners::new(surface, options.deviation_mm);
    let even = Evenness::of(&corners, |v| corners.at(v));
    corners.set_normals();
    let mut too_many = sizes::set(&mut corners, &reference, &[], options.wanted());
    if even.is_even() && evenness::is_fine_enough(&corners) && fairing::roughness(&corners) <= ROUGH {
        return Conditioned::new(Cow::Borrowed(surface), &even, false);
    }
    let remesher = Remesher { reference: &reference, most_triangles: options.most_triangles };
    remesher.run(&mut corners, REMESHINGS.0);
    let mut at = faired(&mut corners, &reference, false);
    for round in 1..ROUNDS {
        let curvature = fairing::curvature(&corners, &at);
        too_many = sizes::set(&mut corners, &reference, &curvature, options.wanted());
        remesher.run(&mut corners, REMESHINGS.1);
        at = faired(&mut corners, &reference, round + 1 == ROUNDS);
    }
    for _ in 0..CORRECTIONS {
        let far = deviation::far(&corners, &at, &reference);
        if far.is_empty() || too_many {
            break;
        }
        too_many |= sizes::shorten(&mut corners, &far, options.wanted());
        remesher.run(&mut corners, 1);
        at = faired(&mut corners, &reference, true);
    }
    corners.vertices.iter_mut().zip(&at).for_each(|(vertex, at)| vertex.at = *at);
    spikes::cut(&mut corners);
    let at: Vec<Vec3> = corners.vertices.iter().map(|v| v.at).collect();
    let even = Evenness::of(&corners, |v| at[v as usize]);
    let mesh = corners.surface(|v| at[v as usize]);
    Conditioned::new(Cow::Owned(mesh), &even, too_many)
}

fn faired(corners: &mut Corners, reference: &Reference, last: bool) -> Vec<Vec3> {
    fairing::fair(corners, reference, if last { ITERATIONS.0 } else { ITERATIONS.1 })
}
