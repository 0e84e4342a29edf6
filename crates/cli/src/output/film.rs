//! Animations of a recording's frames. They are made from the files at the end, so that they are complete even if the
//! run was interrupted and resumed.

use std::path::{Path, PathBuf};

use endowire_viewer::{Animation, Image, Pace};

use super::tell;
use crate::failure::Failure;

/// Writes FOLDER/film.KIND from `frames`, whose paths are relative to the folder, with the views of a step side by
/// side. Returns its name; `None` without frames.
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
    let first = side_by_side(folder, first)?;
    let mut film = Animation::new(folder.join(&name), &first, steps.len() as u32, Pace::even(frames_per_s))?;
    film.push(&first)?;
    steps[1..].iter().try_for_each(|step| film.push(&side_by_side(folder, step)?))?;
    film.finish()?;
    Ok(Some(name))
}

/// The step number in the name of a frame, step_NUMBER_VIEW.png.
fn step_of(frame: &str) -> Option<&str> {
    frame.rsplit('/').next()?.split('_').nth(1)
}

/// The pictures of a step, side by side.
fn side_by_side(folder: &Path, step: &[String]) -> endowire_core::Result<Image> {
    let mut paths = step.iter().map(|name| -> PathBuf { folder.join(name) });
    let first = Image::read_png(paths.next().unwrap_or_default())?;
    paths.try_fold(first, |left, path| Ok(left.beside(&Image::read_png(path)?)))
}
