//! What was repaired on a surface, and what in its lumen was taken as a wall: how much, how large and where.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::SurfaceMesh;
use super::topology::DisjointSets;
use crate::{Error, Result, Vec3};

/// Places named in one line of text.
const NAMED: usize = 5;

/// What is repaired on a surface that is read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RepairMode {
    /// All faults of [`RepairReport`](super::RepairReport).
    #[default]
    All,
    /// None: vertices are welded and triangles turned, holes stay open, nothing is dropped, cut or united. A surface that
    /// cannot be a wall without repair is refused.
    None,
}

impl std::str::FromStr for RepairMode {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        match name {
            "all" => Ok(Self::All),
            "none" => Ok(Self::None),
            other => Err(Error::parameter("repair", format!("{other:?}"), "must be \"all\" or \"none\"")),
        }
    }
}

/// Choices for the repair of a surface, [`Wall::repaired`](super::Wall::repaired).
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RepairOptions {
    /// What is repaired.
    pub mode: RepairMode,
    /// Places of holes that are meant, such as fenestrations, mm: the hole nearest to each is not closed.
    pub keep_open_mm: Vec<Vec3>,
}

/// A kind of repair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RepairKind {
    /// Vertices merged across a crack.
    CrackJoined,
    /// Edges of a seam split at the vertices of the other side.
    SeamSewn,
    /// A fin, a second layer or a membrane that hung on the wall by its edges, removed.
    SheetRemoved,
    /// Edges of more than two triangles along which the surface was cut apart.
    EdgeCut,
    /// A piece dropped: outside of the vessel, or a patch that lies on its wall.
    PieceDropped,
    /// The outer skin of a double wall, dropped.
    SkinDropped,
    /// A hole or tear closed.
    HoleClosed,
    /// A hole that is meant, left open.
    HoleKept,
    /// Intersecting or folded triangles cut out and replaced.
    FoldReplaced,
    /// Vessels that grazed each other without being joined: their walls, moved apart.
    MovedApart,
    /// Triangles that still intersect.
    StillCrossing,
    /// A closed body in the lumen, taken as a wall.
    BodyInLumen,
    /// A sheet in the lumen, taken as a thin wall with two sides.
    SheetInLumen,
    /// A part that overlapped another one, united with it.
    PartUnited,
    /// A closed body or a sheet that stands in the wall, of which most is in the lumen, taken off it.
    BodyInWall,
    /// A piece that lies inside another one, left there.
    PieceNested,
    /// A closed piece beside a vessel with openings, not joined to it, left there.
    PieceApart,
}

/// What becomes of a kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Treatment {
    Mended,
    Kept,
    Left,
}

impl RepairKind {
    pub(super) fn treatment(self) -> Treatment {
        match self {
            Self::HoleKept | Self::BodyInLumen | Self::SheetInLumen => Treatment::Kept,
            Self::StillCrossing | Self::PieceNested | Self::PieceApart => Treatment::Left,
            _ => Treatment::Mended,
        }
    }
}

/// One repaired place, or one thing in the lumen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Repair {
    /// What was done.
    pub kind: RepairKind,
    /// Triangles concerned, as they were before; edges of a hole.
    pub triangles: usize,
    /// The middle of their bounding box, mm.
    pub at_mm: [f64; 3],
    /// The sides of their bounding box, mm.
    pub size_mm: [f64; 3],
}

impl Repair {
    /// Of the space between two corners.
    pub(super) fn within(kind: RepairKind, triangles: usize, (low, high): (Vec3, Vec3)) -> Self {
        Self { kind, triangles, at_mm: ((low + high) / 2.0).into(), size_mm: (high - low).into() }
    }

    /// Of these positions.
    pub(super) fn at(kind: RepairKind, triangles: usize, places: impl Iterator<Item = Vec3>) -> Option<Self> {
        let bounds = places.map(|v| (v, v)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))?;
        Some(Self::within(kind, triangles, bounds))
    }

    /// The longest side of its bounding box, mm.
    fn longest_mm(&self) -> f64 {
        self.size_mm.into_iter().fold(0.0, f64::max)
    }
}

/// Size and place in words.
impl std::fmt::Display for Repair {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.at_mm;
        let [a, b, c] = self.size_mm.map(|mm| (mm * 10.0).round() / 10.0 + 0.0);
        write!(f, "{a} × {b} × {c} mm at [{x:.2}, {y:.2}, {z:.2}]")
    }
}

/// One repair for each group of triangles of `mesh`; `group` names that of each, if it is in one.
pub(super) fn of_groups(
    kind: RepairKind,
    mesh: &SurfaceMesh,
    group: impl Fn(usize) -> Option<u32>,
) -> Vec<Repair> {
    let mut groups: BTreeMap<u32, (usize, Vec3, Vec3)> = BTreeMap::new();
    for triangle in 0..mesh.triangles.len() {
        let Some(number) = group(triangle) else { continue };
        let corners = mesh.corners(triangle);
        let (count, low, high) = groups.entry(number).or_insert((0, corners[0], corners[0]));
        *count += 1;
        for corner in &corners {
            (*low, *high) = (low.inf(corner), high.sup(corner));
        }
    }
    groups.into_values().map(|(count, low, high)| Repair::within(kind, count, (low, high))).collect()
}

/// One repair for each group of the triangles of `mesh` with these numbers that share vertices.
pub(super) fn of_triangles(
    kind: RepairKind,
    mesh: &SurfaceMesh,
    triangles: impl IntoIterator<Item = u32>,
) -> Vec<Repair> {
    let mut listed: Vec<u32> = triangles.into_iter().collect();
    listed.sort_unstable();
    listed.dedup();
    if listed.is_empty() {
        return Vec::new();
    }
    let mut sets = DisjointSets::new(mesh.vertices_mm.len());
    for [a, b, c] in listed.iter().map(|t| mesh.triangles[*t as usize]) {
        sets.join(a, b);
        sets.join(b, c);
    }
    let (of_vertex, _) = sets.number();
    let group = |t: usize| {
        let is_listed = listed.binary_search(&(t as u32)).is_ok();
        is_listed.then(|| of_vertex[mesh.triangles[t][0] as usize])
    };
    of_groups(kind, mesh, group)
}

/// Sizes and places of the repairs of one kind, the largest first, as a part of a sentence; empty if there are none.
pub(super) fn named(repairs: &[Repair], kind: RepairKind) -> String {
    let mut those: Vec<&Repair> = repairs.iter().filter(|repair| repair.kind == kind).collect();
    those.sort_by(|a, b| b.longest_mm().total_cmp(&a.longest_mm()));
    let mut text: Vec<String> = those.iter().take(NAMED).map(ToString::to_string).collect();
    if those.len() > NAMED {
        text.push(format!("and {} smaller", those.len() - NAMED));
    }
    text.join(", ")
}
