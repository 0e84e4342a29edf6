//! The sac to be filled by a scene's coils.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::SceneOf;
use crate::methods::MethodChoice;
use crate::vessel::{Lumen, Sac, WallStore};
use crate::{Error, Result, Vec3};

/// `[vessel.sac]`: the sac of an aneurysm; its packing with coils is reported.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SacSpec {
    /// A position in the sac, mm.
    pub dome_mm: [f64; 3],
    /// A position in the artery, mm; if absent, the nearest one of the vessel's centre line.
    pub parent_mm: Option<[f64; 3]>,
}

impl<M: MethodChoice + DeserializeOwned + Default> SceneOf<M> {
    /// The sac of the given vessel; `None` if the scene names none.
    ///
    /// # Errors
    /// As [`Sac::measure`] and, without `parent_mm`, [`SceneOf::centreline`] and [`Sac::on_artery`]; parameters are those of the scene.
    pub fn sac(&self, lumen: &Lumen, store: &dyn WallStore) -> Result<Option<Sac>> {
        let Some(spec) = &self.vessel.sac else { return Ok(None) };
        let (wall, dome_mm) = (lumen.wall(store)?, Vec3::from(spec.dome_mm));
        let sac = match spec.parent_mm {
            Some(parent_mm) => Sac::measure(wall, dome_mm, Vec3::from(parent_mm)),
            None => Sac::on_artery(wall, dome_mm, self.centreline(store)?),
        };
        sac.map(Some).map_err(|error| match error {
            Error::Parameter { name, value, remedy } if ["dome", "parent"].contains(&name.as_str()) => {
                Error::Parameter { name: format!("vessel.sac.{name}_mm"), value, remedy }
            }
            other => other,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::scene::Scene;
    use crate::vessel::NoStore;

    fn scene(sac: &str) -> Scene {
        let vessels = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels");
        let text = format!(
            "vessel = {{ file = {:?}{sac} }}\nsheath.opening = 0\n\
             device.section = [{{ length_mm = 10.0, radius_mm = 0.2, bending_stiffness_nmm2 = 1.0 }}]\n",
            vessels.join("sidewall_aneurysm.stl")
        );
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, text).unwrap();
        Scene::read(&file).unwrap()
    }

    #[test]
    fn a_scene_measures_its_sac_once_a_place_in_it_is_reported() {
        let sac = |text: &str| {
            let scene = scene(text);
            scene.sac(&scene.lumen(&NoStore).unwrap(), &NoStore)
        };
        assert_eq!(sac("").unwrap(), None);
        let reported =
            sac(", sac = { dome_mm = [2.0, 6.0, 35.0], parent_mm = [2.0, 0.0, 36.0] }").unwrap().unwrap();
        let found = sac(", sac = { dome_mm = [2.0, 6.0, 35.0] }").unwrap().unwrap();
        assert!((found.volume_mm3 / reported.volume_mm3 - 1.0).abs() < 0.02, "{found:?} {reported:?}");
        let error = sac(", sac = { dome_mm = [90.0, 6.0, 35.0] }").unwrap_err().to_string();
        assert!(error.starts_with("vessel.sac.dome_mm = "), "{error}");
    }
}
