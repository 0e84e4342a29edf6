//! Walls from centre-line trees.
//!
//! A tree without bifurcations becomes a swept tube ([`sweep`]); one with bifurcations an implicit surface
//! ([`field`]) meshed by surface nets ([`nets`]), smoothed, projected back and cut open at its ends ([`trim`]).

mod cell;
mod coarsen;
pub(super) mod curve;
mod field;
mod nets;
mod sweep;
#[cfg(test)]
mod tests;
mod trim;

use std::f64::consts::TAU;

use super::check::self_intersections;
use super::topology::EdgeTable;
use super::wall::drop_unreferenced;
use super::{CentrelineTree, SurfaceMesh, Wall};
use crate::{Error, Result, Vec3, parallel};
pub(super) use cell::{EDGES, Pieces};
use field::Field;
pub(super) use field::{BLEND, BLEND_COSINES, HIDDEN};
pub(crate) use sweep::any_perpendicular;
use trim::End;
pub(super) use trim::{End as TreeEnd, ends as open_ends};

/// Tolerance of the field in projecting vertices, mm.
const ON_SURFACE_MM: f64 = 1e-10;

/// Guaranteed tolerance of the result, mm.
const GUARANTEED_MM: f64 = 1e-6;

/// Largest number of Newton steps along an approximate gradient: quadratic on plain tubes, nearly so in fillets with
/// adapted step lengths.
const PROJECTION_STEPS: usize = 50;
/// Fraction of the field's value left by a step up to which the next one adapts its length, and the bounds of that
/// adaptation.
const LEFT_AT_MOST: f64 = 0.75;
const SHARE_AT_MOST: f64 = 4.0;

/// Rounds of smoothing: for unchanged nets, and for those that are coarsened. Surface nets leave short edges where
/// the grid grazes the surface; more rounds change little.
const SMOOTHING_ROUNDS: (usize, usize) = (8, 1);

/// Surface nets on a random plane make 1.5 quadrilaterals per grid face area.
const TRIANGLES_PER_FACE: f64 = 3.0;

/// Grid spacing relative to the smallest radius: ten cells around the thinnest vessel, enough for sound bifurcations.
const GRID_PER_RADIUS: f64 = 0.6;

/// Number of grids tried until one gives a manifold, and the factor of their spacings.
const GRID_ATTEMPTS: usize = 6;
const GRID_SHRINK: f64 = 0.95;

/// Number of non-manifold edges that a grid may have by chance.
const CHANCE_FAULTS: usize = 8;

/// Distance from the plane of an end, in cells, beyond which an edge is not cut away with it.
const CLEAR_OF_CUT: f64 = 4.0;

/// Target of coarsening relative to the edge length, chosen to give about the same number of triangles as the plain
/// grid.
const COARSENING: f64 = 1.0;

/// Largest number of triangles attempted: some gigabytes and a minute.
const MOST_TRIANGLES: f64 = 5e6;

/// Number of attempts to reach a triangle count, and the relative error at which they stop.
const COUNT_ATTEMPTS: usize = 5;
const COUNT_TOLERANCE: f64 = 0.02;

/// Resolution of a generated wall.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub enum Resolution {
    /// Typical length of an edge in mm. In a tree with bifurcations, branches too thin for this get shorter edges,
    /// about ten around.
    EdgeMm(f64),
    /// Number of triangles, reached within 2 % if the geometry permits.
    Triangles(usize),
}

impl Resolution {
    /// Edges of a quarter of the tree's smallest radius: 25 triangles around the thinnest vessel.
    pub fn fitting(tree: &CentrelineTree) -> Self {
        Self::EdgeMm(0.25 * tree.nodes().iter().map(|n| n.radius_mm).fold(f64::MAX, f64::min))
    }
}

/// A wall made from a centre-line tree.
///
/// ```
/// use endowire_core::{GeneratedWall, Resolution, anatomy};
///
/// let tree = anatomy::tree("aortic_arch").expect("a built-in anatomy");
/// let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(4.0))?;
/// assert_eq!(vessel.ends.len(), vessel.wall.openings().len());
/// # Ok::<(), endowire_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct GeneratedWall {
    /// The wall, open at the root and at every leaf that is not closed.
    pub wall: Wall,
    /// Index of the opening at the root of the tree.
    pub inlet: usize,
    /// For each open end of the tree, the root first: row in the centre-line table, and opening of the wall.
    pub ends: Vec<(usize, usize)>,
    /// The typical edge length used, mm.
    pub edge_mm: f64,
}

impl GeneratedWall {
    /// Generates the wall of `tree`.
    ///
    /// Without a bifurcation the vertices lie on circles about the centre line (the polygonal lumen is inscribed),
    /// with bifurcations on an implicit surface of the same radius; both within 1e-6 mm. Ends are cut flat across the
    /// centre line.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an edge length that is not positive, larger than the largest radius, or so small that
    /// more than five million triangles would result; for a bend tighter than the vessel is wide; for a branch that
    /// ends inside another one. [`Error::Mesh`] if branches come so close that the grid cannot separate them.
    pub fn new(tree: &CentrelineTree, resolution: Resolution) -> Result<Self> {
        let branches = curve::branches(tree)?;
        check_resolution(&branches, resolution)?;
        match resolution {
            Resolution::EdgeMm(edge_mm) => Self::with_edge(&branches, edge_mm, &mut None),
            Resolution::Triangles(count) => Self::with_count(&branches, count),
        }
    }

    fn with_count(branches: &[curve::Branch], count: usize) -> Result<Self> {
        let mut edge = edge_of_count(branches, count);
        let mut best: Option<(f64, Self)> = None;
        let mut nets = None;
        for _ in 0..COUNT_ATTEMPTS {
            let made =
                Self::with_edge(branches, edge, &mut nets).map_err(|error| of_count(error, count, edge))?;
            let ratio = made.wall.mesh().triangles.len() as f64 / count as f64;
            let miss = (ratio - 1.0).abs();
            if best.as_ref().is_none_or(|(least, _)| miss < *least) {
                best = Some((miss, made));
            }
            if miss <= COUNT_TOLERANCE {
                break;
            }
            edge *= ratio.sqrt();
        }
        best.map(|(_, made)| made).ok_or_else(|| Error::Computation("no mesh was attempted".into()))
    }

    /// `nets` caches the nets of the last grid: in a tree of thin branches many edge lengths share one.
    fn with_edge(branches: &[curve::Branch], edge_mm: f64, nets: &mut Option<TrimmedNets>) -> Result<Self> {
        let grid = checked_grid(branches, edge_mm)?;
        let field = Field::new(branches.to_vec(), 4.0 * grid);
        let ends = trim::ends(branches);
        let mesh = match branches {
            [only] if ends.len() == 2 => {
                let mesh = sweep::tube(only, edge_mm);
                check_apart(&mesh)?;
                mesh
            }
            _ => implicit_mesh(&field, &ends, edge_mm, nets)?,
        };
        let wall = Wall::welded(&mesh)?;
        let ends = match_openings(&wall, &ends, edge_mm)?;
        Ok(Self { inlet: ends[0].1, wall, ends, edge_mm })
    }
}

/// The axes of the walls of `tree`, branch by branch: positions and radii, mm.
#[cfg(test)]
pub(super) fn axes(tree: &CentrelineTree) -> Result<Vec<Vec<(Vec3, f64)>>> {
    let of_samples = |branch: curve::Branch| branch.samples.iter().map(|s| (s.position, s.radius)).collect();
    Ok(curve::branches(tree)?.into_iter().map(of_samples).collect())
}

/// Rejects a tube that intersects itself: between samples of the centre line a bend can be tighter than at them, a
/// polygon of rings folds before its axis does, and a vessel may simply cross itself.
fn check_apart(mesh: &SurfaceMesh) -> Result<()> {
    let found = self_intersections(mesh, 0.0);
    let Some([triangle, _]) = found.first.first() else { return Ok(()) };
    Err(Error::Mesh(wall_cuts_itself(&mesh.corners(*triangle)[0])))
}

/// The error for a tube that intersects itself.
pub(super) fn wall_cuts_itself(at: &Vec3) -> String {
    format!(
        "the wall cuts itself near ({:.2}, {:.2}, {:.2}) mm: the vessel bends tighter than it is wide or runs into itself; \
         smooth the centre line",
        at.x, at.y, at.z
    )
}

/// Rejects an unusable resolution before a mesh is made.
pub(super) fn check_resolution(branches: &[curve::Branch], resolution: Resolution) -> Result<()> {
    match resolution {
        Resolution::EdgeMm(edge_mm) => checked_grid(branches, edge_mm).map(|_| ()),
        Resolution::Triangles(0) => Err(Error::parameter("triangles", 0, "must be positive")),
        Resolution::Triangles(count) => {
            let edge = edge_of_count(branches, count);
            checked_grid(branches, edge).map(|_| ()).map_err(|error| of_count(error, count, edge))
        }
    }
}

/// The approximate edge length for this number of triangles, mm.
fn edge_of_count(branches: &[curve::Branch], count: usize) -> f64 {
    (branch_area(branches) * TRIANGLES_PER_FACE / count as f64).sqrt()
}

/// Reformulates an error of an edge length as one of the requested count.
fn of_count(error: Error, count: usize, edge: f64) -> Error {
    match error {
        Error::Parameter { name, remedy, .. } if name == "edge_mm" => {
            Error::parameter("triangles", count, format!("means edges of {edge:.1e} mm: {remedy}"))
        }
        other => other,
    }
}

/// Grid spacing for an edge length with which the branches can be meshed, mm.
fn checked_grid(branches: &[curve::Branch], edge_mm: f64) -> Result<f64> {
    let largest = branches.iter().flat_map(|b| b.samples.iter().map(|s| s.radius)).fold(0.0, f64::max);
    if edge_mm.is_nan() || edge_mm <= 0.0 || edge_mm > largest {
        let remedy = format!(
            "must be positive and at most the largest radius, {largest:.3} mm, to resolve the vessel"
        );
        return Err(Error::parameter("edge_mm", edge_mm, remedy));
    }
    let grid = edge_mm.min(GRID_PER_RADIUS * smallest_radius(branches));
    let expected = branch_area(branches) * TRIANGLES_PER_FACE / (grid * grid);
    if expected > MOST_TRIANGLES {
        let remedy =
            format!("would need about {expected:.1e} triangles; at most {MOST_TRIANGLES:.0e} are made");
        return Err(Error::parameter("edge_mm", edge_mm, remedy));
    }
    Ok(grid)
}

/// Total area of all branches taken separately, mm².
fn branch_area(branches: &[curve::Branch]) -> f64 {
    branches.iter().map(|b| b.samples.iter().map(|s| TAU * s.radius * b.step).sum::<f64>()).sum()
}

fn smallest_radius(branches: &[curve::Branch]) -> f64 {
    branches.iter().flat_map(|b| b.samples.iter().map(|s| s.radius)).fold(f64::INFINITY, f64::min)
}

/// Target edge length where the vessel has `radius`: thin branches keep about ten edges around.
fn local_edge(edge: f64, radius: f64) -> f64 {
    COARSENING * edge.min(GRID_PER_RADIUS * radius)
}

/// The wall of a tree with bifurcations.
fn implicit_mesh(
    field: &Field,
    ends: &[End],
    edge: f64,
    kept: &mut Option<TrimmedNets>,
) -> Result<SurfaceMesh> {
    for end in ends {
        let local = field.local(&end.centre, 2.0 * end.radius);
        check_end_is_free(end, |x| field.value(&local, x).f)?;
    }
    let spacing = edge.min(GRID_PER_RADIUS * smallest_radius(&field.branches));
    let TrimmedNets { nets, mesh, .. } = match kept.take() {
        Some(known) if known.spacing == spacing => kept.insert(known),
        _ => kept.insert(manifold_nets(
            field,
            ends,
            spacing,
            if spacing < edge { SMOOTHING_ROUNDS.1 } else { SMOOTHING_ROUNDS.0 },
        )?),
    };
    let mut mesh = mesh.clone();
    coarsen::Coarsener { field, nets, ends, edge }.run(&mut mesh);
    drop_unreferenced(&mut mesh);
    let off = |v: &Vec3| nets.with_local(field, v, |local| field.value(local, v)).f.abs();
    let worst = mesh.vertices_mm.iter().map(off).fold(0.0, f64::max);
    if worst > GUARANTEED_MM {
        return Err(Error::Computation(format!(
            "vertices stay {worst:.1e} mm off the implicit surface: branches meet in a crease; choose a smaller edge_mm"
        )));
    }
    Ok(mesh)
}

/// Nets and the mesh made of them.
struct TrimmedNets {
    /// Requested grid spacing, mm.
    spacing: f64,
    nets: nets::Nets,
    mesh: SurfaceMesh,
}

/// Surface nets, cut open, without edges of more than two triangles. Those arise where one piece of surface in a cell
/// crosses a side twice, by chance in the narrow angle of a bifurcation, as do spurious passages; a slightly finer
/// grid avoids them.
fn manifold_nets(field: &Field, ends: &[End], spacing: f64, rounds: usize) -> Result<TrimmedNets> {
    let mut attempt = spacing;
    let mut tried = spacing;
    let (mut fewest, mut has_way_through) = (usize::MAX, false);
    for _ in 0..GRID_ATTEMPTS {
        tried = attempt;
        let mut nets = nets::mesh(field, attempt)?;
        // A passage between branches where the grid has two sheets in one cell may be spurious: then a finer grid has
        // none. For a closed net of quadrilaterals V − E + F is V − F; a tree without loops has 2.
        if nets.has_parted && nets.vertices.len() < nets.quads.len() + 2 {
            if std::mem::replace(&mut has_way_through, true) {
                break;
            }
            attempt *= GRID_SHRINK;
            continue;
        }
        // By chance a few occur, different on another grid; many persistent ones are in the tree. Smoothing does not
        // change them.
        let crowded = crowded_edges(&nets.quads);
        let many = crowded.len();
        if many > CHANCE_FAULTS {
            if many > fewest / 2 {
                break;
            }
            fewest = many;
            attempt *= GRID_SHRINK;
            continue;
        }
        // Cutting removes such edges only near an end and beyond its plane. Smoothing moves them by about a cell.
        let stays = |&(v, _): &(u32, u32)| {
            ends.iter().all(|end| {
                let offset = nets.vertices[v as usize] - end.centre;
                offset.dot(&end.outward) < -CLEAR_OF_CUT * attempt
                    || offset.norm() > 2.0 * (1.2 * end.radius + field.extension + 3.0 * attempt)
            })
        };
        if crowded.iter().any(stays) {
            attempt *= GRID_SHRINK;
            continue;
        }
        even_out(field, &mut nets, rounds);
        let mut mesh = SurfaceMesh {
            vertices_mm: std::mem::take(&mut nets.vertices),
            triangles: Vec::with_capacity(2 * nets.quads.len()),
        };
        for quad in &nets.quads {
            push_polygon(&mesh.vertices_mm, quad, &mut mesh.triangles);
        }
        for end in ends {
            trim::cut(&mut mesh, field, end, attempt);
        }
        drop_unreferenced(&mut mesh);
        if EdgeTable::new(&mesh.triangles).non_manifold() == 0 {
            return Ok(TrimmedNets { spacing, nets, mesh });
        }
        attempt *= GRID_SHRINK;
    }
    Err(Error::Mesh(format!(
        "branches come closer to each other than a grid of {tried:.3} mm resolves; choose a smaller edge_mm"
    )))
}

/// Edges of more than two quadrilaterals.
pub(super) fn crowded_edges(quads: &[[u32; 4]]) -> Vec<(u32, u32)> {
    let edge = |quad: &[u32; 4], k: usize| {
        let (a, b) = (quad[k], quad[(k + 1) % 4]);
        (a.min(b), a.max(b))
    };
    let mut edges: Vec<(u32, u32)> =
        quads.iter().flat_map(|quad| (0..4).map(move |k| edge(quad, k))).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|uses| uses.len() > 2).map(|uses| uses[0]).collect()
}

/// Moves vertices towards the mean of their neighbours along the surface, and back onto it: by one Newton step in
/// each of `rounds`, which leaves less error than the next round's motion, and fully in the end.
fn even_out(field: &Field, nets: &mut nets::Nets, rounds: usize) {
    let mut vertices = std::mem::take(&mut nets.vertices);
    // Gradients near the vertices, from the previous round.
    let mut gradients = vec![Vec3::zeros(); vertices.len()];
    for round in 0..=rounds {
        let mut sum = vec![(Vec3::zeros(), 0.0); vertices.len()];
        for quad in &nets.quads {
            for k in 0..4 {
                let (a, b) = (quad[k] as usize, quad[(k + 1) % 4] as usize);
                sum[a].0 += vertices[b];
                sum[a].1 += 1.0;
            }
        }
        let moved = parallel::map(vertices.len(), |index| {
            let (mut v, (sum, count)) = (vertices[index], sum[index]);
            nets.with_local(field, &vertices[index], |local| {
                if round > 0 && count > 0.0 {
                    let normal = gradients[index].try_normalize(1e-6).unwrap_or_default();
                    let pull = sum / count - v;
                    v += 0.5 * (pull - normal * normal.dot(&pull));
                }
                let gradient = approach(field, local, &mut v, nets.edge).gradient;
                if round == rounds {
                    project(field, local, &mut v, nets.edge);
                }
                (v, gradient)
            })
        });
        (vertices, gradients) = moved.into_iter().unzip();
    }
    nets.vertices = vertices;
}

/// A Newton step along the gradient; returns the value at its start.
fn approach(field: &Field, local: &field::Local, point: &mut Vec3, edge: f64) -> field::Value {
    let value = field.value(local, point);
    *point += newton(&value, edge);
    value
}

fn newton(value: &field::Value, edge: f64) -> Vec3 {
    let step = value.gradient * (-value.f / value.gradient.norm_squared().max(1e-6));
    step.cap_magnitude(0.5 * edge)
}

/// Repeats such steps until the point is on the surface. In fillets, where the gradient is approximate, each is
/// scaled by the factor that the one before it should have had.
fn project(field: &Field, local: &field::Local, point: &mut Vec3, edge: f64) {
    let (mut share, mut before) = (1.0_f64, f64::NAN);
    for _ in 0..PROJECTION_STEPS {
        let value = field.value(local, point);
        if value.f.abs() <= ON_SURFACE_MM {
            break;
        }
        let left = value.f / before;
        if left < LEFT_AT_MOST {
            share = (share / (1.0 - left)).clamp(1.0 / SHARE_AT_MOST, SHARE_AT_MOST);
        }
        before = value.f;
        *point += newton(&value, edge) * share;
    }
}

/// Adds a triangle or a quadrilateral, the latter divided along its shorter diagonal.
pub(super) fn push_polygon(vertices: &[Vec3], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
    match *polygon {
        [a, b, c] => triangles.push([a, b, c]),
        [a, b, c, d] => {
            let length = |i: u32, j: u32| (vertices[i as usize] - vertices[j as usize]).norm();
            if length(a, c) <= length(b, d) {
                triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
        _ => {}
    }
}

/// Number of points tested around an end.
const END_PROBES: usize = 24;

/// Rejects an end that another branch reaches: its rim would not be a clean loop.
pub(super) fn check_end_is_free(end: &End, field: impl Fn(&Vec3) -> f64) -> Result<()> {
    let u = sweep::any_perpendicular(&end.outward);
    let v = end.outward.cross(&u);
    for k in 0..END_PROBES {
        let angle = TAU * k as f64 / END_PROBES as f64;
        let at = end.centre + end.radius * (libm::cos(angle) * u + libm::sin(angle) * v);
        if field(&at) < -1e-3 * end.radius {
            return Err(Error::parameter(
                format!("centreline row {}", end.row),
                format!("({:.3}, {:.3}, {:.3})", end.centre.x, end.centre.y, end.centre.z),
                "this end lies in or touches another branch; let the branch go on until it is clear of it",
            ));
        }
    }
    Ok(())
}

/// Pairs the ends of the tree with the openings of the wall; their numbers and positions must agree.
fn match_openings(wall: &Wall, ends: &[End], edge: f64) -> Result<Vec<(usize, usize)>> {
    let found = wall.openings().len();
    if found != ends.len() {
        return Err(Error::Mesh(format!(
            "the tree has {} open ends, but the wall has {found} openings: branches overlap near an end, or edge_mm = {edge} is too coarse",
            ends.len()
        )));
    }
    ends.iter()
        .map(|end| {
            let distance = |k: &usize| (wall.openings()[*k].centre_mm - end.centre).norm();
            let nearest = (0..found).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
            if distance(&nearest) > 0.5 * end.radius {
                return Err(Error::Mesh(format!(
                    "no opening where centreline row {} ends; choose a smaller edge_mm",
                    end.row
                )));
            }
            Ok((end.row, nearest))
        })
        .collect()
}
