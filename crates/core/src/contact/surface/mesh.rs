//! The contact surface of a surface: remeshed uniformly, extended beyond its openings, smoothed, and ready for queries.

use std::borrow::Cow;

use nalgebra::Matrix3;

use super::reach_mm;
use crate::contact::distance::Nearness;
use crate::contact::extension::extended;
use crate::contact::narrow::Narrow;
use crate::contact::properties::WallProperties;
use crate::contact::regions::RegionMap;
use crate::contact::{Distance, SmoothWall};
use crate::tuning::ContactTuning;
use crate::vessel::{Conditioning, Wall, WallQuery, WallRecipe, WallStore};
use crate::{Result, Vec3, parallel};

/// A mesh prepared for the contact of devices.
#[derive(Debug, Clone)]
pub struct ContactMesh {
    /// Its smooth distance.
    pub(crate) smooth: SmoothWall,
    /// Nearest triangles and clearances.
    pub query: WallQuery,
    /// Modulus and friction, where they are not the same everywhere.
    pub(crate) regions: Option<RegionMap>,
    /// Reach of the queries of the device's points, mm.
    pub(in crate::contact) reach_mm: f64,
    /// Where the lumen is narrow.
    narrow: Option<Narrow>,
}

/// Inset, as a fraction of the thickest radius, above which points over the triangles are sampled too.
const CREST: f64 = 0.3;
/// Number of heights sampled there, and their distance in radii.
const OVER: (u32, f64) = (6, 0.5);

/// Coverage below which the flat triangles contribute.
const COVERED: f64 = 0.15;

/// `wall` as a uniform mesh, or unchanged if it is to be felt as it is meshed.
fn even<'a>(wall: &'a Wall, properties: &WallProperties, store: &dyn WallStore) -> Result<Cow<'a, Wall>> {
    if properties.deviation_mm == 0.0 {
        return Ok(Cow::Borrowed(wall));
    }
    let options = Conditioning { deviation_mm: properties.deviation_mm, ..Conditioning::default() };
    store.wall(&WallRecipe::Even { wall, options }).map(Cow::Owned)
}

impl ContactMesh {
    /// Prepares `wall` for devices up to this radius, mm, with its uniform mesh from `store`.
    ///
    /// # Errors
    /// If the wall has no triangles left to query.
    pub fn new(
        wall: &Wall,
        thickest_mm: f64,
        properties: &WallProperties,
        store: &dyn WallStore,
    ) -> Result<Self> {
        Self::tuned(wall, thickest_mm, properties, store, &ContactTuning::DEFAULT)
    }

    /// As [`Self::new`], with these numbers.
    pub(super) fn tuned(
        wall: &Wall,
        thickest_mm: f64,
        properties: &WallProperties,
        store: &dyn WallStore,
        tuning: &ContactTuning,
    ) -> Result<Self> {
        let surface = extended(&*even(wall, properties, store)?, thickest_mm);
        let surface = Wall::welded(&surface)?;
        let smooth = SmoothWall::new(&surface, thickest_mm);
        let reach_mm = |smooth: &SmoothWall| reach_mm(thickest_mm, smooth.deepest_inset_mm(), tuning);
        let query = WallQuery::new(&surface)?;
        // Otherwise the first step would wait for it.
        query.prepare();
        let regions = if properties.region.is_empty() { None } else { RegionMap::new(&query, properties) };
        let narrow = Narrow::of(&smooth, thickest_mm);
        let mut surface = Self { reach_mm: reach_mm(&smooth), smooth, query, regions, narrow };
        if let Some(narrow) = &surface.narrow {
            surface.smooth.deepen(narrow.insets_mm());
            surface.reach_mm = reach_mm(&surface.smooth);
        }
        let crests = surface.over_crests(thickest_mm);
        surface.smooth.deepen(crests.into_iter().flatten());
        surface.reach_mm = reach_mm(&surface.smooth);
        Ok(surface)
    }

    /// Where its lumen is narrow.
    #[cfg(test)]
    pub(in crate::contact) fn narrow(&self) -> Option<&Narrow> {
        self.narrow.as_ref()
    }

    /// Insets of the smooth wall over triangles where they are large, mm: beside a crest the smooth wall lies farther
    /// above the triangles than on them, and a point counted as free there would suddenly be in contact.
    fn over_crests(&self, thickest_mm: f64) -> Vec<Vec<(u32, f64)>> {
        let crests = self.smooth.inside_of(CREST * thickest_mm);
        let step_mm = OVER.1 * thickest_mm;
        parallel::map(crests.len(), |index| {
            let triangle = crests[index];
            let [a, b, c] = self.query.corners(triangle);
            let (middle, normal) = ((a + b + c) / 3.0, self.query.inward_normal(triangle));
            let places = [middle, (a + middle) * 0.5, (b + middle) * 0.5, (c + middle) * 0.5];
            let over = places
                .into_iter()
                .flat_map(|x| (1..=OVER.0).map(move |k| x + normal * (f64::from(k) * step_mm)));
            over.filter_map(|x| {
                let flat = self.query.nearest(&x, self.reach_mm).filter(|flat| flat.distance_mm > 0.0)?;
                let felt_mm = self.nearness(&x, flat.triangle, f64::NEG_INFINITY).value_mm();
                Some((flat.triangle, flat.distance_mm - felt_mm))
            })
            .collect()
        })
    }

    /// Distance of `x`, given a triangle at or near the nearest; with derivatives below `limit_mm`.
    pub(in crate::contact) fn nearness(&self, x: &Vec3, triangle: u32, limit_mm: f64) -> Nearness {
        let Some(within) = self.narrow.as_ref().and_then(|narrow| narrow.at(x, triangle)) else {
            return self.nearness_of_mesh(x, triangle, limit_mm);
        };
        let found = match within.is_whole() {
            true => within.alone(),
            false => match self.nearness_of_mesh(x, triangle, f64::INFINITY) {
                Nearness::Within(mesh) => within.joined(&mesh),
                Nearness::Beyond(_) | Nearness::Clear(_) => within.alone(),
            },
        };
        if found.value_mm < limit_mm { Nearness::Within(found) } else { Nearness::Beyond(found.value_mm) }
    }

    /// As [`Self::nearness`], of the mesh alone.
    ///
    /// Where quadrics barely reach, the flat triangles replace them gradually: with their coverage C, F = f + λ(C) (d
    /// − f) blends the smooth distance f into that of the triangles, d.
    fn nearness_of_mesh(&self, x: &Vec3, triangle: u32, limit_mm: f64) -> Nearness {
        if let Some((nearness, coverage)) = self.smooth.within(x, triangle, limit_mm)
            && coverage >= COVERED
        {
            return nearness;
        }
        let Some(flat) = self.query.nearest(x, self.reach_mm) else { return Nearness::Beyond(self.reach_mm) };
        let mut found =
            Distance { value_mm: flat.distance_mm, gradient: flat.normal, hessian: Matrix3::zeros() };
        if let Some((smooth, coverage, slope)) = self.smooth.covered(x, triangle) {
            let t = coverage / COVERED;
            let (share, rate) = ((1.0 - t) * (1.0 - t), -2.0 * (1.0 - t) / COVERED);
            let apart = found.value_mm - smooth.value_mm;
            let turn = slope * rate;
            let away = found.gradient - smooth.gradient;
            found = Distance {
                value_mm: smooth.value_mm + share * apart,
                gradient: smooth.gradient + away * share + turn * apart,
                // Without the second derivatives of C, which makes Newton's method slightly slower there.
                hessian: smooth.hessian * (1.0 - share) + turn * away.transpose() + away * turn.transpose(),
            };
        }
        if found.value_mm < limit_mm { Nearness::Within(found) } else { Nearness::Beyond(found.value_mm) }
    }

    /// Distance of `x` from the wall next to it, following from `triangle`, mm: negative behind it, even if another
    /// wall is nearer.
    pub(in crate::contact) fn distance_from(&self, triangle: u32, x: &Vec3) -> f64 {
        self.nearness(x, self.smooth.walk(triangle, x), f64::NEG_INFINITY).value_mm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{splitmix64, unit};
    use crate::vessel::{GeneratedWall, NoStore, Resolution, anatomy};

    #[test]
    fn what_is_free_of_the_triangles_is_free_of_the_smooth_wall() {
        const RADIUS_MM: f64 = 0.445;
        // Coarse, so that the crotches of its forks are crests far inside the triangles.
        let tree = anatomy::tree("aortic_arch").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(6.0)).unwrap().wall;
        let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
        let surface = ContactMesh::new(&wall, RADIUS_MM, &properties, &NoStore).unwrap();
        // With insets measured on the triangles alone.
        let on_them = SmoothWall::new(&Wall::welded(&extended(&wall, RADIUS_MM)).unwrap(), RADIUS_MM);
        let mut pressing = [0, 0];
        for triangle in surface.smooth.inside_of(0.1) {
            let ([a, b, c], normal) =
                (surface.query.corners(triangle), surface.query.inward_normal(triangle));
            for k in 0..60 {
                let [u, v, up] = [0, 1, 2].map(|n| unit(splitmix64(u64::from(triangle), 3 * k + n)));
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let x = a + (b - a) * u + (c - a) * v + normal * (6.0 * RADIUS_MM * up);
                let Some(flat) = surface.query.nearest(&x, surface.reach_mm) else { continue };
                let felt_mm = surface.nearness(&x, flat.triangle, f64::NEG_INFINITY).value_mm();
                for (smooth, count) in [&surface.smooth, &on_them].into_iter().zip(&mut pressing) {
                    let free_mm = flat.distance_mm
                        - (1.0 + ContactTuning::DEFAULT.follow) * RADIUS_MM
                        - smooth.inset_mm(flat.triangle);
                    *count += u32::from(free_mm >= 0.0 && felt_mm < RADIUS_MM);
                }
            }
        }
        assert_eq!(pressing[0], 0);
        assert!(pressing[1] > 10, "{pressing:?}");
    }
}
