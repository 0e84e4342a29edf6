//! Stiffness and friction of a vessel's wall, uniform or by region.

use std::cell::OnceCell;

use serde::{Deserialize, Serialize};

use crate::error::{in_range, number, vector};
use crate::vessel::{LARGEST_DEVIATION_MM, Lumen, Pieces, Wall, WallQuery, WallStore};
use crate::{Error, Result, Vec3};

/// Largest foundation modulus, N/mm².
const LARGEST_MODULUS: f64 = 1e9;
/// Largest coefficient of friction, far above any in a vessel.
const LARGEST_FRICTION: f64 = 2.0;
/// Largest radius of a region, mm: it contains any vessel.
const LARGEST_RADIUS_MM: f64 = 1e6;
/// Default width over which the wall changes at the edge of a region, mm. Contact points are about a diameter apart,
/// and a much narrower transition would fall between two of them.
const TRANSITION_MM: f64 = 2.0;
/// Largest distance of a place from the piece that it names, mm: farther away it may be meant for another one.
const PIECE_MM: f64 = 1.0;

/// Default for the largest distance of the contact surface from the given one, mm: less than a scanner resolves.
const DEVIATION_MM: f64 = 0.1;

/// The wall of a vessel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WallProperties {
    /// Foundation modulus k, N/mm²: force per length and depth.
    pub modulus_n_per_mm2: f64,
    /// Coulomb coefficient μ of friction between device and wall; 0 is frictionless and costs nothing.
    pub friction: f64,
    /// How far smoothing may move the surface, mm; at most a twentieth of the lumen's local radius. The resulting
    /// distance of the contact surface is measured by [`ContactSurface::deviation`](super::ContactMesh::deviation). 0 uses the
    /// given mesh, for surfaces whose meshes are known to be good.
    pub deviation_mm: f64,
    /// Regions with other properties; later ones override earlier ones.
    pub region: Vec<WallRegion>,
}

impl Default for WallProperties {
    /// Order of magnitude of an artery's modulus, frictionless.
    fn default() -> Self {
        Self { modulus_n_per_mm2: 1.0, friction: 0.0, deviation_mm: DEVIATION_MM, region: Vec::new() }
    }
}

/// The wall inside a sphere (a stent, an aneurysm), given by `centre_mm` and `radius_mm`, or a connected piece of it (a thrombus, a
/// flap), given by `piece_at_mm`. Absent properties stay unchanged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WallRegion {
    /// Centre of the sphere, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_mm: Option<[f64; 3]>,
    /// Radius of the sphere, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// A place in the piece or within a millimetre of its surface, mm. Where a body holds the place, it is that body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub piece_at_mm: Option<[f64; 3]>,
    /// Width over which the wall changes, mm, half of it on each side of the sphere; if absent, 2 or the radius,
    /// whichever is less. The transition extends over at least one edge of the mesh. A piece has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transition_mm: Option<f64>,
    /// Foundation modulus, N/mm².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modulus_n_per_mm2: Option<f64>,
    /// Coefficient of friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
}

/// Where a region is, without its properties.
enum Place {
    Sphere(Sphere),
    /// The piece named by a place.
    Piece(Vec3),
}

struct Sphere {
    centre_mm: Vec3,
    radius_mm: f64,
    width_mm: f64,
}

impl Sphere {
    /// 1 inside, 0 outside, smooth between.
    fn share(&self, x: &Vec3) -> f64 {
        let reach_mm = self.radius_mm + 0.5 * self.width_mm;
        let inside = reach_mm - (x - self.centre_mm).norm();
        let t = if inside >= self.width_mm { 1.0 } else { (inside / self.width_mm).max(0.0) };
        t * t * (3.0 - 2.0 * t)
    }
}

impl WallRegion {
    /// A sphere or a piece; `None` if it is neither, or both.
    fn place(&self) -> Option<Place> {
        match (self.centre_mm, self.radius_mm, self.piece_at_mm) {
            (Some(centre_mm), Some(radius_mm), None) => {
                let width_mm = self.transition_mm.unwrap_or(TRANSITION_MM.min(radius_mm));
                Some(Place::Sphere(Sphere { centre_mm: centre_mm.into(), radius_mm, width_mm }))
            }
            (None, None, Some(at_mm)) => Some(Place::Piece(at_mm.into())),
            _ => None,
        }
    }

    /// For each vertex of a wall, 1 inside the region, 0 outside, and between these at its edge.
    fn shares(&self, query: &WallQuery, pieces: &OnceCell<Pieces>) -> Vec<f64> {
        let mesh = query.mesh();
        match self.place() {
            Some(Place::Sphere(sphere)) => mesh.vertices_mm.iter().map(|x| sphere.share(x)).collect(),
            Some(Place::Piece(at)) => {
                let pieces = pieces.get_or_init(|| Pieces::of(mesh));
                let piece = pieces.at(query, &at).map_or(u32::MAX, |(piece, _)| piece);
                pieces.vertices_of(piece, mesh).into_iter().map(|of| f64::from(u8::from(of))).collect()
            }
            None => vec![0.0; mesh.vertices_mm.len()],
        }
    }
}

impl WallProperties {
    /// Whether there is friction anywhere.
    pub(crate) fn has_friction(&self) -> bool {
        self.largest_friction() > 0.0
    }

    /// Largest coefficient of friction of all regions.
    pub fn largest_friction(&self) -> f64 {
        self.region.iter().filter_map(|r| r.friction).fold(self.friction, f64::max)
    }

    /// ln(k/k₀), with k₀ the modulus outside all regions, and the coefficient of friction at every vertex of a wall.
    ///
    /// The logarithm is blended because moduli differ by powers of ten: between walls of 10⁻³ and 10⁴ N/mm² each
    /// decade takes the same part of the transition. Blended linearly, the modulus would rise a thousandfold within
    /// the first ten-thousandth of it, and the range in which a Newton step is reliable, k/|∇k|, would be smallest
    /// where the wall is softest.
    pub(crate) fn at_vertices(&self, query: &WallQuery) -> Vec<(f64, f64)> {
        // Counted only where a region is a piece.
        let pieces = OnceCell::new();
        let mut values = vec![(0.0, self.friction); query.mesh().vertices_mm.len()];
        let blended =
            |was: f64, own: f64, share: f64| if share == 1.0 { own } else { was + (own - was) * share };
        for region in &self.region {
            let shares = region.shares(query, &pieces);
            for ((ln_modulus, friction), share) in
                values.iter_mut().zip(shares).filter(|(_, share)| *share > 0.0)
            {
                if let Some(modulus) = region.modulus_n_per_mm2 {
                    *ln_modulus = blended(*ln_modulus, libm::log(modulus / self.modulus_n_per_mm2), share);
                }
                if let Some(own) = region.friction {
                    *friction = blended(*friction, own, share);
                }
            }
        }
        values
    }

    /// Rejects regions, for a method that supports only a uniform wall.
    ///
    /// # Errors
    /// Any region.
    pub fn refuse_regions(&self, method: &str) -> Result<()> {
        if self.region.is_empty() {
            return Ok(());
        }
        Err(Error::parameter(
            "vessel.wall.region",
            format!("{} given", self.region.len()),
            format!(
                "{method} knows one wall for the whole vessel: leave regions out or use the method kirchhoff"
            ),
        ))
    }

    /// Checks the values outside regions.
    ///
    /// # Errors
    /// Values out of range.
    pub(crate) fn check_outside_regions(&self) -> Result<()> {
        in_range("vessel.wall.modulus_n_per_mm2", self.modulus_n_per_mm2, LARGEST_MODULUS)?;
        check_friction("vessel.wall.friction", self.friction)?;
        if (0.0..=LARGEST_DEVIATION_MM).contains(&self.deviation_mm) {
            return Ok(());
        }
        let remedy = format!("must be from 0 (surface as it is meshed) to {LARGEST_DEVIATION_MM}");
        Err(Error::parameter("vessel.wall.deviation_mm", self.deviation_mm, remedy))
    }

    /// Checks all values, and that every region contains part of the wall of `lumen`, whose mesh comes from `store`
    /// if there are any.
    ///
    /// # Errors
    /// Values out of range; a region that is neither a sphere nor a piece, changes nothing, or contains nothing.
    pub(crate) fn check(&self, lumen: &Lumen, store: &dyn WallStore) -> Result<()> {
        self.check_outside_regions()?;
        for (index, region) in self.region.iter().enumerate() {
            let name = format!("vessel.wall.region[{index}]");
            let key = |key: &str| format!("{name}.{key}");
            for (of, place) in [("centre_mm", region.centre_mm), ("piece_at_mm", region.piece_at_mm)] {
                if let Some(place) =
                    place.map(Vec3::from).filter(|place| place.iter().any(|c| !c.is_finite()))
                {
                    return Err(Error::parameter(key(of), vector(&place), "must be finite numbers"));
                }
            }
            if let Some(modulus) = region.modulus_n_per_mm2 {
                in_range(&key("modulus_n_per_mm2"), modulus, LARGEST_MODULUS)?;
            }
            if let Some(friction) = region.friction {
                check_friction(&key("friction"), friction)?;
            }
            if region.modulus_n_per_mm2.is_none() && region.friction.is_none() {
                return Err(Error::parameter(name, "{}", "give modulus_n_per_mm2, friction or both"));
            }
            let wall = || lumen.wall(store);
            match region.place() {
                Some(Place::Sphere(sphere)) => check_sphere(&name, &sphere, region.transition_mm, wall()?)?,
                Some(Place::Piece(at)) if region.transition_mm.is_none() => {
                    check_piece(&key("piece_at_mm"), &at, wall()?)?;
                }
                Some(Place::Piece(_)) => {
                    let remedy = "a piece has no edge where it could change: leave transition_mm out";
                    return Err(Error::parameter(
                        key("transition_mm"),
                        region.transition_mm.unwrap_or(0.0),
                        remedy,
                    ));
                }
                None => {
                    let given = [
                        ("centre_mm", region.centre_mm.is_some()),
                        ("radius_mm", region.radius_mm.is_some()),
                        ("piece_at_mm", region.piece_at_mm.is_some()),
                    ];
                    let given: Vec<&str> = given.iter().filter(|(_, is)| *is).map(|(key, _)| *key).collect();
                    let given = if given.is_empty() { "no place".to_owned() } else { given.join(" and ") };
                    let remedy =
                        "give centre_mm and radius_mm of a sphere, or piece_at_mm, a place on a piece";
                    return Err(Error::parameter(name, given, remedy));
                }
            }
        }
        Ok(())
    }
}

/// Checks that a sphere holds a vertex of a wall.
fn check_sphere(name: &str, sphere: &Sphere, transition_mm: Option<f64>, wall: &Wall) -> Result<()> {
    let key = |key: &str| format!("{name}.{key}");
    let radius_mm = sphere.radius_mm;
    in_range(&key("radius_mm"), radius_mm, LARGEST_RADIUS_MM)?;
    if let Some(transition_mm) = transition_mm
        && !(0.0..=2.0 * radius_mm).contains(&transition_mm)
    {
        let radius = number(radius_mm);
        let remedy = format!("must be from 0 to twice the region's radius of {radius} mm");
        return Err(Error::parameter(key("transition_mm"), transition_mm, remedy));
    }
    let away = |v: &Vec3| (v - sphere.centre_mm).norm();
    let nearest = wall.mesh().vertices_mm.iter().map(away).fold(f64::MAX, f64::min);
    if nearest > radius_mm {
        return Err(Error::parameter(
            key("radius_mm"),
            radius_mm,
            format!(
                "reaches no vertex of the wall: the nearest is {nearest:.3} mm from centre_mm = {}; move the centre \
                 or enlarge the radius",
                vector(&sphere.centre_mm)
            ),
        ));
    }
    Ok(())
}

/// Checks that a place names a piece of a wall.
fn check_piece(name: &str, at: &Vec3, wall: &Wall) -> Result<()> {
    let named = Pieces::of(wall.mesh()).at(&WallQuery::new(wall)?, at);
    let away_mm = named.map_or(f64::INFINITY, |(_, away_mm)| away_mm);
    if away_mm <= PIECE_MM {
        return Ok(());
    }
    let remedy = format!(
        "is in no body and {away_mm:.3} mm from the nearest surface: give a place in the piece or within {PIECE_MM} mm of it; \
         `endowire vessel check` lists one for each piece"
    );
    Err(Error::parameter(name, vector(at), remedy))
}

/// Largest force of a valve on an instrument, N.
const LARGEST_VALVE_N: f64 = 100.0;

/// Checks the force of a valve.
pub(crate) fn check_valve(name: &str, force_n: f64) -> Result<()> {
    if (0.0..=LARGEST_VALVE_N).contains(&force_n) {
        return Ok(());
    }
    let remedy = format!("must be a force from 0 (none) to {LARGEST_VALVE_N} N");
    Err(Error::parameter(name, force_n, remedy))
}

/// Checks a Coulomb coefficient.
pub(crate) fn check_friction(name: &str, friction: f64) -> Result<()> {
    if (0.0..=LARGEST_FRICTION).contains(&friction) {
        return Ok(());
    }
    Err(Error::parameter(
        name,
        friction,
        format!("must be a Coulomb coefficient from 0 (none) to {LARGEST_FRICTION}"),
    ))
}
