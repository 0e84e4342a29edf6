//! The contact surface: of a surface, remeshed uniformly, extended beyond its openings, smoothed and ready for queries
//! ([`ContactMesh`]), or of a centre line, which needs no such preparation (`vessel::swept`).
//!
//! A contact point remembers the *piece* of wall next to it: a triangle of the contact mesh, or a position on the centre
//! line. It seeks the wall through space, near a piece ([`Hint::Near`]); once sunk in, it follows the wall from the
//! piece into which it sank ([`Hint::Side`]).

mod deviation;
mod mesh;

use super::Distance;
use super::distance::Nearness;
use super::properties::WallProperties;
use super::regions::{RegionMap, Stiffness};
use crate::tuning::ContactTuning;
use crate::vessel::{ClosestFrom, Lumen, SweptField, Wall, WallStore};
use crate::{Result, Vec3};
pub use mesh::ContactMesh;

/// Reach of the queries of a device's points, mm, given its largest radius and by how much the smooth wall may lie
/// inside flat triangles.
fn reach_mm(thickest_mm: f64, inset_mm: f64, tuning: &ContactTuning) -> f64 {
    (1.0 + tuning.follow + tuning.look_again) * thickest_mm + inset_mm + tuning.look_mm
}

/// A wall prepared for the contact of devices.
#[derive(Debug)]
pub struct ContactSurface {
    source: Source,
    /// Radius of the thinnest piece of the device, mm.
    pub(super) thinnest_mm: f64,
    /// Reach of the queries of the device's points, mm.
    pub(super) reach_mm: f64,
    /// The numbers with which devices touch it.
    pub(super) tuning: ContactTuning,
}

/// The representation of the wall.
#[derive(Debug)]
enum Source {
    Mesh(Box<ContactMesh>),
    /// With the largest radius of the device, mm.
    Swept(SweptField, f64),
}

/// Where to seek the wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hint {
    /// Through space, for a point whose nearest piece is this one or close to it.
    Near(u32),
    /// Along the wall, for a point that has sunk into it at this piece.
    Side(u32),
}

impl Hint {
    /// The piece of the hint.
    pub(super) fn piece(self) -> u32 {
        match self {
            Self::Near(piece) | Self::Side(piece) => piece,
        }
    }
}

/// The piece of wall nearest to a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearPiece {
    /// A lower bound of its distance, mm; negative beyond the wall.
    pub(super) distance_mm: f64,
    /// The piece; `None` past the end of the vessel.
    pub(super) piece: Option<u32>,
    /// What was nearest, also past the end of the vessel.
    pub(super) bound: u32,
}

impl ContactSurface {
    /// Prepares `wall` for devices with these smallest and largest radii, mm, with its uniform mesh from `store`.
    ///
    /// # Errors
    /// As [`ContactMesh::new`].
    pub fn new(
        wall: &Wall,
        (thinnest_mm, thickest_mm): (f64, f64),
        properties: &WallProperties,
        store: &dyn WallStore,
    ) -> Result<Self> {
        let tuning = &ContactTuning::DEFAULT;
        Self::of_wall(wall, (thinnest_mm, thickest_mm), properties, store, tuning)
    }

    /// Prepares the wall of `lumen`. One given by a centre line is used directly, unless the device is thicker than
    /// its lumen somewhere, or it has regions, which are defined on the vertices of a mesh.
    ///
    /// The distance from it has a crest along the axis. A device that fits does not touch the wall there, however
    /// little play it has; one that is thicker is pressed by the crest itself, which the smooth wall of a mesh rounds
    /// off. Where it fits a mesh is no substitute: the depth of its facets is a large part of a small play.
    ///
    /// # Errors
    /// As [`Lumen::wall`] and [`ContactSurface::new`].
    pub fn of(
        lumen: &Lumen,
        radii_mm: (f64, f64),
        properties: &WallProperties,
        store: &dyn WallStore,
    ) -> Result<Self> {
        Self::tuned(lumen, radii_mm, properties, store, &ContactTuning::DEFAULT)
    }

    /// As [`Self::of`], with these numbers.
    pub(crate) fn tuned(
        lumen: &Lumen,
        radii_mm: (f64, f64),
        properties: &WallProperties,
        store: &dyn WallStore,
        tuning: &ContactTuning,
    ) -> Result<Self> {
        match lumen {
            Lumen::Swept(vessel) if properties.region.is_empty() && vessel.least_radius_mm() > radii_mm.1 => {
                let reach_mm = reach_mm(radii_mm.1, 0.0, tuning);
                let source = Source::Swept(vessel.field(reach_mm), radii_mm.1);
                Ok(Self { source, thinnest_mm: radii_mm.0, reach_mm, tuning: *tuning })
            }
            _ => Self::of_wall(lumen.wall(store)?, radii_mm, properties, store, tuning),
        }
    }

    /// As [`Self::new`], with these numbers.
    fn of_wall(
        wall: &Wall,
        (thinnest_mm, thickest_mm): (f64, f64),
        properties: &WallProperties,
        store: &dyn WallStore,
        tuning: &ContactTuning,
    ) -> Result<Self> {
        let mesh = ContactMesh::tuned(wall, thickest_mm, properties, store, tuning)?;
        let (reach_mm, source) = (mesh.reach_mm, Source::Mesh(Box::new(mesh)));
        Ok(Self { source, thinnest_mm, reach_mm, tuning: *tuning })
    }

    /// Its mesh; `None` for a centre line.
    pub(crate) fn mesh(&self) -> Option<&ContactMesh> {
        match &self.source {
            Source::Mesh(mesh) => Some(mesh),
            Source::Swept(..) => None,
        }
    }

    /// Number of its pieces.
    pub(crate) fn pieces(&self) -> usize {
        match &self.source {
            Source::Mesh(mesh) => mesh.query.triangles(),
            Source::Swept(field, _) => field.pieces(),
        }
    }

    /// The piece nearest to `x`; one at `limit_mm` or farther need not be found.
    pub(super) fn nearest(&self, x: &Vec3, limit_mm: f64) -> Option<NearPiece> {
        match &self.source {
            Source::Mesh(mesh) => {
                let near = mesh.query.nearest(x, limit_mm)?;
                let piece = (!near.rim).then_some(near.triangle);
                Some(NearPiece { distance_mm: near.distance_mm, piece, bound: near.triangle })
            }
            Source::Swept(field, _) => {
                let near = field.near(x);
                let is_number = !near.clearance_mm.is_nan();
                let (distance_mm, piece) = (near.clearance_mm, near.piece);
                is_number.then_some(NearPiece { distance_mm, piece: Some(piece), bound: piece })
            }
        }
    }

    /// Distance of `x` from a piece, mm, as a bound of the search; `None` for a centre line, which needs no bound.
    pub(super) fn distance_to(&self, piece: u32, x: &Vec3) -> Option<f64> {
        self.mesh().map(|mesh| mesh.query.distance_to(piece, x))
    }

    /// The piece nearest to `x` within `reach_mm`, with a lower bound of its distance, mm; `None` past the end of the
    /// vessel.
    pub fn nearest_piece(&self, x: &Vec3, reach_mm: f64) -> Option<(u32, f64)> {
        let near = self.nearest(x, reach_mm).filter(|near| near.distance_mm.abs() < reach_mm)?;
        Some((near.piece?, near.distance_mm))
    }

    /// Distance of `x`, whose nearest piece is this one or close to it. `None` where no wall is known there.
    pub fn distance(&self, x: &Vec3, piece: u32) -> Option<Distance> {
        match &self.source {
            Source::Mesh(mesh) => mesh.smooth.distance(x, piece),
            Source::Swept(..) => match self.nearness(x, Hint::Near(piece), f64::INFINITY) {
                Nearness::Within(distance) => Some(distance),
                Nearness::Beyond(_) | Nearness::Clear(_) => None,
            },
        }
    }

    /// Distance of `x`; with derivatives below `limit_mm`.
    pub(crate) fn nearness(&self, x: &Vec3, hint: Hint, limit_mm: f64) -> Nearness {
        let (field, thickest_mm) = match &self.source {
            Source::Mesh(mesh) => return mesh.nearness(x, hint.piece(), limit_mm),
            Source::Swept(field, thickest_mm) => (field, *thickest_mm),
        };
        // Beyond the thickness of any device there is no contact, and the distance need not be exact.
        let closest = match field.closer_than(x, from(hint), limit_mm.max(thickest_mm)) {
            Ok(Some(closest)) => closest,
            Ok(None) => return Nearness::Beyond(self.reach_mm),
            Err(room_mm) => return Nearness::Clear(room_mm),
        };
        let value_mm = closest.distance_mm();
        if value_mm < limit_mm {
            Nearness::Within(Distance { value_mm, gradient: closest.normal(), hessian: closest.hessian() })
        } else {
            Nearness::Beyond(value_mm)
        }
    }

    /// The piece next to `x`, following the wall from one into which it has sunk.
    pub(super) fn follow(&self, side: u32, x: &Vec3) -> u32 {
        match &self.source {
            Source::Mesh(mesh) => mesh.smooth.walk(side, x),
            Source::Swept(field, _) => {
                field.closest(x, ClosestFrom::Side(side)).map_or(side, |found| found.piece())
            }
        }
    }

    /// The piece into which a point at `x` has sunk, given the hint with which it found the wall.
    pub(super) fn side(&self, x: &Vec3, hint: Hint) -> u32 {
        match &self.source {
            Source::Mesh(_) => hint.piece(),
            Source::Swept(field, _) => {
                field.closest(x, from(hint)).map_or(hint.piece(), |found| found.piece())
            }
        }
    }

    /// Distance of `x` from the wall next to it, following from a piece, mm: negative behind it, even if another wall
    /// is nearer.
    pub(super) fn distance_from(&self, piece: u32, x: &Vec3) -> f64 {
        match &self.source {
            Source::Mesh(mesh) => mesh.distance_from(piece, x),
            Source::Swept(..) => self.nearness(x, Hint::Side(piece), f64::NEG_INFINITY).value_mm(),
        }
    }

    /// How far the contact surface lies inside the distance of [`ContactSurface::nearest`] for a piece, mm.
    pub(super) fn inset_mm(&self, piece: u32) -> f64 {
        self.mesh().map_or(0.0, |mesh| mesh.smooth.inset_mm(piece))
    }

    /// The largest of all [`ContactSurface::inset_mm`].
    pub(super) fn deepest_inset_mm(&self) -> f64 {
        self.mesh().map_or(0.0, |mesh| mesh.smooth.deepest_inset_mm())
    }

    /// Where a straight path first meets the wall, as a fraction of it, up to `farthest` times its length.
    pub(super) fn crossing(&self, from: &Vec3, to: &Vec3, farthest: f64) -> Option<f64> {
        match &self.source {
            Source::Mesh(mesh) => mesh.query.crossing(from, to, farthest),
            Source::Swept(field, _) => field.crossing(from, to, farthest),
        }
    }

    /// Whether `x`, though it appears to be in the lumen, is outside it by more than a point may sink.
    ///
    /// What appears as the lumen of a smooth wall may be that of another wall, seen through a thin one, or the far
    /// side of a lumen much narrower than the device. Where facets are coarse the smooth wall lies outside them, and
    /// points between are still in front of their own piece of it: by at most the distance of the smooth wall from
    /// the facets, and ever less, the farther behind the facet. From another wall the distance grows instead. The
    /// wall of a centre line has one lumen.
    pub(super) fn is_beyond(&self, x: &Vec3, sunk_mm: f64) -> bool {
        let Some(mesh) = self.mesh() else { return false };
        mesh.query.nearest(x, self.reach_mm).is_some_and(|flat| {
            if flat.distance_mm >= -(sunk_mm + mesh.smooth.outset_mm(flat.triangle)) {
                return false;
            }
            let here_mm = mesh.distance_from(flat.triangle, x);
            here_mm < 0.0 || here_mm >= mesh.distance_from(flat.triangle, &flat.point_mm)
        })
    }

    /// Distance of `x` from the contact surface, mm, exact up to the reach of a device; not positive outside the lumen, and
    /// any such number deeper outside than `radius_mm`.
    pub(super) fn clearance_mm(&self, x: &Vec3, radius_mm: f64) -> f64 {
        match &self.source {
            Source::Mesh(mesh) => match mesh.query.nearest(x, self.reach_mm) {
                Some(flat) if flat.distance_mm > -radius_mm => {
                    mesh.nearness(x, flat.triangle, f64::NEG_INFINITY).value_mm()
                }
                Some(flat) => flat.distance_mm,
                None => self.reach_mm,
            },
            Source::Swept(field, _) => {
                let near = field.near(x);
                let found = field.closest(x, ClosestFrom::Space(near.piece));
                found.map_or(near.clearance_mm, |found| found.distance_mm())
            }
        }
    }

    /// The wall's modulus at `x`, whose nearest piece is this one or close to it.
    pub(super) fn stiffness(&self, x: &Vec3, piece: Option<u32>) -> Stiffness {
        match self.regions(piece) {
            Some((mesh, regions, triangle)) => regions.stiffness(&mesh.smooth, x, triangle),
            None => Stiffness { factor: 1.0, slope: None },
        }
    }

    /// Coefficient of friction there, relative to the largest.
    pub(super) fn rough(&self, x: &Vec3, piece: Option<u32>) -> f64 {
        self.regions(piece).map_or(1.0, |(mesh, regions, triangle)| regions.rough(&mesh.smooth, x, triangle))
    }

    /// Whether the wall is as stiff and as rough everywhere.
    pub(super) fn is_uniform(&self) -> bool {
        self.mesh().is_none_or(|mesh| mesh.regions.is_none())
    }

    fn regions(&self, piece: Option<u32>) -> Option<(&ContactMesh, &RegionMap, u32)> {
        let mesh = self.mesh()?;
        Some((mesh, mesh.regions.as_ref()?, piece?))
    }
}

/// Where the search for the wall of a centre line begins.
fn from(hint: Hint) -> ClosestFrom {
    match hint {
        Hint::Near(piece) => ClosestFrom::Space(piece),
        Hint::Side(piece) => ClosestFrom::Side(piece),
    }
}
