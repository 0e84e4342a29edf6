//! Scenes with settings of a command line, and convergence of their runs.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use endowire_core::error::nearest_name;
use endowire_core::insertion::Tally;
use endowire_methods::{Scene, Setting, scene_with};
use endowire_recording::{About, Recording};
use endowire_viewer::ViewSpec;

use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::tell;

/// Reads a scene with overridden keys.
pub(crate) fn read(path: &Path, settings: &[Setting]) -> Result<Scene, Failure> {
    let scene = with_any_device(path, settings)?;
    let other =
        settings.iter().find(|setting| ["device", "device.file"].contains(&&*setting.key.to_string()));
    if let Some(setting) = other
        && !ViewSpec::of_scene(&scene, path)?.device.is_empty()
    {
        return Err(Failure::Input(format!(
            "--set {setting}: [[view.device]] of {} says what its own device is made of, and this is another: leave out those tables",
            path.display()
        )));
    }
    Ok(scene)
}

/// The same for callers that ignore the materials that the scene gives for its own device, when another device
/// replaces it.
pub(crate) fn with_any_device(path: &Path, settings: &[Setting]) -> Result<Scene, Failure> {
    Ok(scene_with(path, settings, |scene| ViewSpec::of_scene(scene, path).map(drop))?)
}

/// Reads the scene of a recording again, from `scene` if given, with the settings of the run and `more`; also returns
/// its path.
pub(crate) fn of_recording(
    about: &About,
    scene: Option<&Path>,
    more: &[Setting],
) -> Result<(PathBuf, Scene), Failure> {
    let Some(path) = scene.or(about.scene_file.as_deref()) else {
        let text = "the recording names no scene: give it by --scene, a scene with the vessel and the devices of the recording";
        return Err(Failure::Input(text.to_owned()));
    };
    let path = path.to_path_buf();
    let recorded = about.set.iter().map(|text| text.parse::<Setting>());
    let mut settings = recorded.collect::<Result<Vec<_>, _>>()?;
    settings.extend_from_slice(more);
    let scene = read(&path, &settings)?;
    Ok((path, scene))
}

/// Reads a recording; with its scene given, its summary may be damaged or missing.
pub(crate) fn recording(folder: &Path, scene: Option<&Path>) -> Result<Recording, Failure> {
    let recording =
        scene.map_or_else(|| Recording::read(folder), |scene| Recording::read_in(folder, scene))?;
    tell_left_out(folder, recording.left_out());
    Ok(recording)
}

/// Tables of a scene that decide how a run goes.
const OF_THE_RUN: [&str; 2] = ["script", "method"];

/// Refuses settings that change nothing of a recorded run.
pub(crate) fn check_recorded(settings: &[Setting]) -> Result<(), Failure> {
    match settings.iter().find(|setting| OF_THE_RUN.contains(&setting.key.begins())) {
        Some(setting) => Err(Failure::Input(format!(
            "--set {setting}: the run is recorded, and its {} has no effect any more: leave it out, or run the scene again (endowire \
             run)",
            setting.key.begins()
        ))),
        None => Ok(()),
    }
}

/// How the scene file `path` in which a recording is shown differs from that of its run in `dir`; `given` is that file if
/// it was named. Nothing is said of a scene or a script that cannot be read any more.
pub(crate) fn other_than_recorded(
    about: &About,
    dir: &Path,
    given: Option<&Path>,
    path: &Path,
) -> Result<Option<String>, Failure> {
    let Some(recorded) = &about.scene_hash else { return Ok(None) };
    // Without the settings of now, which are meant to differ, and with the script of the run.
    let Ok((_, mut as_it_was)) = of_recording(about, given, &[]) else { return Ok(None) };
    if let Some(script) = &about.script_file
        && as_it_was.take_script(script).is_err()
    {
        return Ok(None);
    }
    if Provenance::of_scene(&as_it_was, &[])?.scene_hash() == recorded {
        return Ok(None);
    }
    let name = about.scene.as_ref().filter(|name| **name != as_it_was.name);
    let (path, dir) = (path.display(), dir.display());
    Ok(Some(match (given, name) {
        (Some(_), Some(name)) => format!(
            "--scene {path}: this is the scene {:?}, and the run in {dir} was recorded in {name:?}: vessel and devices are those of \
             {path}",
            as_it_was.name
        ),
        (Some(_), None) => format!(
            "--scene {path}: it or a file it names is not as it was when the run in {dir} was recorded: vessel and devices are those \
             of {path}"
        ),
        (None, _) => format!("{path} or a file it names has changed since the run in {dir} was recorded"),
    }))
}

/// Reads a scene with overridden keys, and with the script of a file, if one is given, instead of its own.
pub(crate) fn with_script(
    path: &Path,
    settings: &[Setting],
    script: Option<&Path>,
) -> Result<Scene, Failure> {
    let mut scene = read(path, settings)?;
    let Some(file) = script else { return Ok(scene) };
    if let Some(setting) = settings.iter().find(|setting| setting.key.begins() == "script") {
        return Err(Failure::Input(format!(
            "--set {setting}: the script is that of --script {}: change its lines there",
            file.display()
        )));
    }
    scene.take_script(file)?;
    Ok(scene)
}

/// Lets contrast medium flow along the vessel's centre line, from the places that the scene gives, which must be in the
/// vessel. The centre line is extracted if there is medium and the scene names none.
pub(crate) fn let_medium_flow(
    view: &mut ViewSpec,
    scene: &Scene,
    store: &Cache,
) -> endowire_core::Result<()> {
    let flows = !view.injection.is_empty() || scene.script.iter().any(|line| line.inject.is_some());
    if !flows {
        return Ok(());
    }
    view.take_centreline(scene, store)?;
    view.check_places()
}

/// Reports what was repaired on the surface, and that the centre line was extracted from it, if one was needed and the
/// scene names none.
pub(crate) fn tell_found(path: &Path, scene: &Scene) {
    for note in scene.repair_notes() {
        tell(format_args!("{}: {note}", path.display()));
    }
    let Some(tree) = scene.found_centreline() else { return };
    let targets: Vec<&str> = tree.targets().iter().map(|target| target.name.as_str()).collect();
    tell(format_args!(
        "{}: the centre line is found in the surface, {} points to {}; vessel.centreline names a table in its place",
        path.display(),
        tree.nodes().len(),
        targets.join(", ")
    ));
}

/// Top-level tables and keys of a scene file.
const TOP: [&str; 9] =
    ["vessel", "device", "instrument", "sheath", "method", "script", "view", "seed", "name"];

/// Tells what is not shown of a run that was killed.
pub(crate) fn tell_left_out(folder: &Path, left_out: Option<&str>) {
    if let Some(what) = left_out {
        tell(format_args!("endowire: {}: {what}: read up to the last whole step", folder.display()));
    }
}

/// Splits texts `KEY=VALUE` for frames into those of the scene, and those of its table `view`, whose keys are
/// relative to that table. A key of one of several tables, as `injection[0].at_mm`, is set in the scene.
pub(crate) fn of_scene_and_view(texts: &[String]) -> Result<(Vec<Setting>, Vec<&str>), Failure> {
    let (mut of_scene, mut of_view) = (Vec::new(), Vec::new());
    for text in texts {
        let key = text.split('=').next().unwrap_or_default().trim();
        let first = key.split(['.', '[']).next().unwrap_or_default();
        // `device` is a key of the view too, a list.
        if TOP.contains(&first) && key != "device" {
            of_scene.push(text.parse()?);
        } else if key.contains('[') {
            of_scene.push(format!("view.{text}").parse()?);
        } else {
            of_view.push(text.as_str());
        }
    }
    Ok((of_scene, of_view))
}

/// Fails if steps did not converge and this was not allowed; `kept` says where all steps are saved.
pub(crate) fn check_converged(
    place: impl Display,
    tally: &Tally,
    steps: usize,
    allowed: bool,
    kept: impl Display,
) -> Result<(), Failure> {
    match tally.first_unconverged_step {
        Some(first) if !allowed => Err(Failure::Computation(format!(
            "{place}: {} of {steps} steps found no equilibrium, the first step {first}: take shorter steps (step_mm), shorter elements or another \
             method, or give --allow-unconverged to take them as they are ({kept})",
            tally.unconverged_steps
        ))),
        _ => Ok(()),
    }
}

/// The file that `which` means: itself, or the file of that name in `folder`, which holds files of the kind `what`.
pub(crate) fn named(which: &Path, folder: &str, what: &str) -> Result<PathBuf, Failure> {
    if which.is_file() {
        return Ok(which.to_path_buf());
    }
    let file = file_of(which, folder);
    if file.is_file() {
        return Ok(file);
    }
    let known = files(Path::new(folder)).unwrap_or_default();
    let stems = known.iter().filter_map(|path| path.file_stem()?.to_str());
    let nearest = nearest_name(stems, &which.display().to_string())
        .map_or_else(String::new, |name| format!("; did you mean {name}?"));
    Err(Failure::Input(format!("{}: is no file and no {what} of {folder}{nearest}", which.display())))
}

/// The file of a name in a folder.
pub(crate) fn file_of(name: &Path, folder: &str) -> PathBuf {
    Path::new(folder).join(format!("{}.toml", name.display()))
}

/// TOML files of a folder, sorted by name.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let unusable = |e: std::io::Error| Failure::Input(format!("{}: {e}: name a folder", folder.display()));
    let entries = std::fs::read_dir(folder).map_err(unusable)?;
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>().map_err(unusable)?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    Ok(paths)
}

/// Refuses settings of keys of `[view]` that change nothing in what a command draws; those of single tables of a list
/// are let pass.
///
/// # Errors
/// Names the setting, and what to do instead.
pub(crate) fn refuse_settings(settings: &[Setting], without_effect: &[(&str, &str)]) -> Result<(), Failure> {
    for text in settings.iter().map(ToString::to_string) {
        let Some(key) = text.strip_prefix("view.") else { continue };
        let is_about = |other: &str| key.strip_prefix(other).is_some_and(|rest| rest.starts_with(['=', '.']));
        if let Some((_, remedy)) = without_effect.iter().find(|(other, _)| is_about(other)) {
            return Err(Failure::Input(format!("--set {text}: {remedy}")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_the_scene_and_of_its_view_are_reported_apart() {
        let texts = [
            "c_arm.sid_mm=1000",
            "vessel.wall.friction=0.1",
            "device=[]",
            "device.part[0].length_mm=6",
            "seed = 3",
            "injection[0].at_mm=[1, 2, 3]",
        ];
        let texts = texts.map(str::to_owned);
        let (of_scene, of_view) = of_scene_and_view(&texts).unwrap();
        assert_eq!(of_view, ["c_arm.sid_mm=1000", "device=[]"]);
        let keys: Vec<String> = of_scene.iter().map(|setting| setting.key.to_string()).collect();
        assert_eq!(
            keys,
            ["vessel.wall.friction", "device.part[0].length_mm", "seed", "view.injection[0].at_mm"]
        );
    }

    #[test]
    fn steps_without_an_equilibrium_fail_unless_they_are_allowed() {
        let tally = Tally { unconverged_steps: 2, first_unconverged_step: Some(7), ..Tally::default() };
        let reported = check_converged("a.toml", &tally, 9, false, "all are kept").unwrap_err().to_string();
        assert!(
            reported.starts_with("a.toml: 2 of 9 steps found no equilibrium, the first step 7: "),
            "{reported}"
        );
        assert!(reported.contains("--allow-unconverged"), "{reported}");
        assert!(check_converged("a.toml", &tally, 9, true, "").is_ok());
        assert!(check_converged("a.toml", &Tally::default(), 9, false, "").is_ok());
    }
}
