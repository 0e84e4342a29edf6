//! The frames of a recording as one moving picture, made of the files at its end: a run that went on after a kill has all of them.

use std::path::{Path, PathBuf};

use endowire_viewer::{Animation, Image, Pace};

use super::{tell, whole};
use crate::failure::Failure;

/// What films are called: one for each of their kinds.
pub(crate) const FILMS: [&str; 4] = ["film.gif", "film.png", "film.apng", "film.mp4"];

/// Writes FOLDER/film.KIND from `frames`, which are relative to the folder, the views of a step side by side. Returns its name; none without
/// frames.
pub(crate) fn write(
    folder: &Path,
    kind: &str,
    frames: &[String],
    frames_per_s: f64,
) -> Result<Option<String>, Failure> {
    let steps: Vec<&[String]> = frames.chunk_by(|a, b| step_of(a) == step_of(b)).collect();
    let name = format!("film.{kind}");
    let Some(first) = steps.first() else {
        tell(format_args!("endowire: no {name} in {}: no frame was drawn", folder.display()));
        return Ok(None);
    };
    // The kind is told by the end of a name, so that what is not whole yet has another beginning.
    let part = folder.join(format!("part-{name}"));
    let made = || -> endowire_core::Result<()> {
        let first = side_by_side(folder, first)?;
        let mut film = Animation::new(&part, &first, steps.len() as u32, Pace::even(frames_per_s))?;
        film.push(&first)?;
        steps[1..].iter().try_for_each(|step| film.push(&side_by_side(folder, step)?))?;
        film.finish()
    };
    let path = folder.join(&name);
    let made = made().map_err(Failure::from);
    let made = made.and_then(|()| std::fs::rename(&part, &path).map_err(|e| Failure::write(&path, &e)));
    if made.is_err() {
        let _ = whole::remove(&part);
    }
    made.map(|()| Some(name))
}

/// The step in the name of a frame, step_NUMBER_VIEW.png.
fn step_of(frame: &str) -> Option<&str> {
    frame.rsplit('/').next()?.split('_').nth(1)
}

/// The pictures of a step.
fn side_by_side(folder: &Path, step: &[String]) -> endowire_core::Result<Image> {
    let mut paths = step.iter().map(|name| -> PathBuf { folder.join(name) });
    let first = Image::read_png(paths.next().unwrap_or_default())?;
    paths.try_fold(first, |left, path| Ok(left.beside(&Image::read_png(path)?)))
}
