//! Opens a file on a page: a scene, or a training subject with its scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use endowire_assess::Subject;
use endowire_core::Result;
use endowire_core::file::{Files, InMemory};
use endowire_methods::{Scene, Setting, scene_with_of};
use endowire_viewer::ViewSpec;

/// Size limit of a scene or subject file, bytes.
const LARGEST_TEXT: u64 = 16 << 20;

/// A scene, with the settings and the task of a subject.
#[derive(Debug)]
pub(crate) struct Opened {
    /// File of the scene.
    pub(crate) scene: PathBuf,
    /// Overridden keys of the scene.
    pub(crate) settings: Vec<Setting>,
    /// The subject, if there is one.
    pub(crate) subject: Option<Subject>,
}

impl Opened {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// Errors in a subject, by file and key.
    pub(crate) fn of(files: &InMemory, path: &Path) -> Result<Self> {
        let bytes = files.read(path, LARGEST_TEXT)?;
        // If it is not text, the reader of scenes reports that.
        let text = std::str::from_utf8(&bytes).unwrap_or_default();
        if !Subject::is_meant(text) {
            return Ok(Self { scene: path.to_owned(), settings: vec![], subject: None });
        }
        let subject = Subject::from_toml(text, path)?;
        let settings = subject.set.iter().map(|setting| setting.parse()).collect::<Result<_>>()?;
        Ok(Self { scene: subject.resolve(&subject.scene), settings, subject: Some(subject) })
    }

    /// The script that solves the subject, unless it is the scene's own.
    pub(crate) fn reference(&self) -> Option<PathBuf> {
        let subject = self.subject.as_ref()?;
        Some(subject.resolve(subject.reference.as_ref()?))
    }

    /// Reads the scene.
    ///
    /// # Errors
    /// As [`scene_with_of`].
    pub(crate) fn read(&self, files: &Arc<InMemory>) -> Result<Scene> {
        scene_with_of(files.clone(), &self.scene, &self.settings, |scene| self.view(scene).map(drop))
    }

    /// The `[view]` table of the scene.
    ///
    /// # Errors
    /// As [`ViewSpec::of_scene`].
    pub(crate) fn view(&self, scene: &Scene) -> Result<ViewSpec> {
        ViewSpec::of_scene(scene, &self.scene)
    }
}

/// Paths of the files that the one at `path` needs and that are missing, as far as the available files name them.
///
/// # Errors
/// Names file, line and key of an error in one of them.
pub(crate) fn missing(files: &Arc<InMemory>, path: &Path) -> Result<Vec<PathBuf>> {
    let missing = |mut needed: Vec<PathBuf>| {
        needed.sort();
        needed.dedup();
        needed.retain(|one| !files.0.contains_key(one));
        needed
    };
    let first = missing(vec![path.to_owned()]);
    if !first.is_empty() {
        return Ok(first);
    }
    let opened = Opened::of(files, path)?;
    let own = missing(opened.reference().into_iter().chain([opened.scene.clone()]).collect());
    if !own.is_empty() {
        return Ok(own);
    }
    // A setting may refer to a device file that the scene itself names.
    let plain = missing(Scene::read_of(files.clone(), &opened.scene)?.input_paths());
    if !plain.is_empty() {
        return Ok(plain);
    }
    let scene = opened.read(files)?;
    let mut needed = scene.input_paths();
    needed.extend(opened.view(&scene)?.flow.tree);
    Ok(missing(needed))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A subject from `assets` with all files that it needs, and the files that were missing in each round.
    fn gathered(path: &str) -> (Arc<InMemory>, Vec<Vec<PathBuf>>) {
        let assets = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets"));
        let mut files = Arc::new(InMemory::default());
        let mut rounds = vec![];
        loop {
            let wanted = missing(&files, Path::new(path)).unwrap();
            if wanted.is_empty() {
                return (files, rounds);
            }
            for one in &wanted {
                let bytes = std::fs::read(assets.join(one)).unwrap();
                Arc::make_mut(&mut files).0.insert(one.clone(), bytes);
            }
            rounds.push(wanted);
        }
    }

    #[test]
    fn a_subject_asks_for_its_files_in_rounds_and_opens_with_its_scene() {
        let path = "subjects/straight_tube.toml";
        let (files, rounds) = gathered(path);
        let all: Vec<String> = rounds.concat().iter().map(|one| one.display().to_string()).collect();
        assert!(all.iter().any(|one| one.ends_with("references/straight_tube.toml")), "{all:?}");
        assert!(all.iter().any(|one| one.ends_with("vessels/straight_tube.stl")), "{all:?}");
        let opened = Opened::of(&files, Path::new(path)).unwrap();
        assert_eq!(opened.read(&files).unwrap().name, "straight_tube");
        // A scene opens as itself, without settings.
        let scene = opened.scene.to_str().unwrap();
        let plain = Opened::of(&gathered(scene).0, &opened.scene).unwrap();
        assert!(plain.subject.is_none() && plain.settings.is_empty());
    }

    #[test]
    fn what_is_wrong_in_a_subject_is_reported_with_its_file() {
        let path = Path::new("subjects/own.toml");
        let text = "name = \"a\"\nlevel = 9\ntext = \"b\"\nscene = \"c.toml\"\n[goal]\ntarget = \"d\"\ntip_within_mm = 1.0\n";
        let files = Arc::new(InMemory([(path.to_owned(), text.into())].into()));
        let reported = missing(&files, path).unwrap_err().to_string();
        assert!(reported.starts_with("subjects/own.toml: level = 9"), "{reported}");
    }
}
