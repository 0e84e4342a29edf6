//! `endowire dataset`: labelled pictures of many scenes, devices, poses, doses and states.
//!
//! A *course* is a scene with a device, carried out once; a *shot* is a pose of a course, with its pictures. Shots
//! are drawn on all cores. Each keeps a list of its files, so that an interrupted call can resume. Everything random
//! depends only on the seed and the number of the shot.

mod coco;
mod course;
mod draw;
mod shot;
mod spec;
mod split;

use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_recording::{Claim, lock_folder};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;

use crate::args::DatasetArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{in_folder, print_json, progress, refuse_recording, tell, to_json, whole};
use crate::scenes;
use coco::{Annotation, Category, ImageRow, categories};
use course::Course;
use shot::Part;
use spec::{NOT_DRAWN, Spec};
use split::splits;

/// Annotations of all pictures.
#[derive(Debug, Serialize)]
struct Document {
    info: Info,
    images: Vec<ImageRow>,
    categories: [Category; 5],
    annotations: Vec<Annotation>,
}

#[derive(Debug, Serialize)]
struct Info {
    description: &'static str,
    #[serde(flatten)]
    provenance: Provenance,
}

/// The JSON document on stdout.
#[derive(Debug, Serialize)]
struct Written {
    #[serde(flatten)]
    provenance: Provenance,
    folder: PathBuf,
    pictures: usize,
    /// Number of pictures drawn by this call; the others existed.
    drawn: usize,
    /// Number of pictures of steps that did not converge.
    unconverged: usize,
    courses: usize,
    simulation_time_s: f64,
    drawing_time_s: f64,
    pictures_per_s: f64,
}

/// Draws the pictures that are missing.
pub(crate) fn dataset(args: &DatasetArgs) -> Result<(), Failure> {
    let spec = Spec::read(&args.spec)?;
    scenes::refuse_settings(&args.set.set, &NOT_DRAWN)?;
    let provenance = provenance(args, &spec)?;
    let folder = &args.out;
    let _claim = claim(&provenance, folder)?;
    let pairs: Vec<_> = spec
        .scenes
        .iter()
        .flat_map(|scene| match spec.devices.is_empty() {
            true => vec![(scene, None)],
            false => spec.devices.iter().map(|device| (scene, Some(device.as_path()))).collect(),
        })
        .collect();
    let shots = pairs.len() * spec.poses;
    let missing = |shot: &usize| !shot::is_whole(folder, *shot);
    let open: Vec<usize> = (0..shots).filter(missing).collect();

    let start = Instant::now();
    let bar = progress::bar(pairs.len(), "scene");
    let run = |(k, (scene, device)): (usize, &(&PathBuf, Option<&Path>))| {
        let wanted = open.iter().any(|shot| shot / spec.poses == k);
        let course = wanted
            .then(|| {
                Course::run(&spec, k * spec.poses, scene, *device, (&args.set.set, &Cache::new(&args.cache)))
            })
            .transpose();
        bar.inc(1);
        course
    };
    let courses: Vec<Option<Course>> = pairs.par_iter().enumerate().map(run).collect::<Result<_, _>>()?;
    bar.finish_and_clear();
    let simulation_time_s = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let bar = progress::bar(open.len(), "pose");
    open.par_iter().try_for_each(|&shot| {
        if let Some(course) = &courses[shot / spec.poses] {
            // A computation error rather than bad input: the folder was writable at the start.
            shot::draw(&spec, course, shot, folder).map_err(Failure::into_computation)?;
        }
        bar.inc(1);
        Ok::<(), Failure>(())
    })?;
    bar.finish_and_clear();
    let drawing_time_s = start.elapsed().as_secs_f64();

    let of_scene = splits(&vessels(args, &spec)?, spec.seed);
    let poses_of_scene = spec.devices.len().max(1) * spec.poses;
    let split = |shot: usize| of_scene[shot / poses_of_scene];
    let unconverged = join(folder, shots, &provenance, split).map_err(Failure::into_computation)?;
    let each = spec.moments * spec.views();
    let drawn = open.len() * each;
    let written = Written {
        provenance,
        folder: folder.clone(),
        pictures: shots * each,
        drawn,
        unconverged,
        courses: pairs.len(),
        simulation_time_s,
        drawing_time_s,
        pictures_per_s: if drawn > 0 { drawn as f64 / drawing_time_s } else { 0.0 },
    };
    if args.json {
        print_json(&written)?;
    } else {
        tell(format_args!(
            "{} pictures in {}, {} of them drawn now: {:.1} a second (simulations took {:.1} s before)",
            written.pictures,
            folder.display(),
            drawn,
            written.pictures_per_s,
            simulation_time_s
        ));
    }
    if unconverged > 0 && !args.convergence.allow_unconverged {
        return Err(Failure::Computation(format!(
            "{}: {unconverged} of {} pictures are of steps that found no equilibrium (\"converged\": false in annotations.json): take \
             shorter steps in the scenes, or give --allow-unconverged to take them as they are (all are kept in {})",
            args.spec.display(),
            written.pictures,
            folder.display()
        )));
    }
    Ok(())
}

/// The vessel of each scene, by the file that it is made of.
fn vessels(args: &DatasetArgs, spec: &Spec) -> Result<Vec<String>, Failure> {
    // Settings of parts refer to devices, which are no anatomy.
    let settings = if spec.devices.is_empty() { args.set.set.as_slice() } else { &[] };
    let vessel = |file: &PathBuf| {
        let scene = scenes::read(file, settings)?;
        let of = scene.vessel.file.as_ref().or(scene.vessel.tree.as_ref());
        Ok(of.map_or_else(|| file.clone(), |of| scene.resolve(of)).display().to_string())
    };
    spec.scenes.iter().map(vessel).collect()
}

/// Provenance of the dataset.
fn provenance(args: &DatasetArgs, spec: &Spec) -> Result<Provenance, Failure> {
    // If devices are given, settings of parts refer to other files.
    let of_scene = if spec.devices.is_empty() { args.set.set.as_slice() } else { &[] };
    let mut paths = vec![args.spec.clone()];
    for scene in &spec.scenes {
        paths.push(scene.clone());
        paths.extend(scenes::read(scene, of_scene)?.input_paths());
    }
    paths.extend(spec.devices.iter().cloned());
    let mut inputs = paths.iter().map(|path| read_input(path)).collect::<Result<Vec<_>, _>>()?;
    inputs.extend(args.set.set.iter().map(|setting| setting.to_string().into_bytes()));
    Ok(Provenance::new(&inputs, spec.seed).with(&args.set.set))
}

/// Folders of a dataset, and the file of all annotations.
const FOLDERS: [&str; 3] = ["images", "arrays", "parts"];
const ANNOTATIONS: &str = "annotations.json";
/// The file that tells whose folder it is.
const MARK: &str = "dataset.json";

/// Why a folder is not free.
const TAKEN: &str =
    "another endowire dataset is drawing into this folder: wait until it has ended, or give another folder";

/// Claims a folder for a dataset until the claim is dropped; it is refused while another call draws into it.
fn claim(provenance: &Provenance, folder: &Path) -> Result<Claim, Failure> {
    // Checked before locking, because the lock would add a file to a folder that is no data set.
    check(provenance, folder)?;
    let made = FOLDERS.iter().try_for_each(|name| std::fs::create_dir_all(folder.join(name)));
    made.map_err(|e| Failure::write(folder, &e))?;
    let claim = lock_folder(folder, TAKEN).map_err(in_folder)?;
    // What a call that was killed has left unfinished.
    let tidied = FOLDERS
        .iter()
        .try_for_each(|name| whole::remove_unfinished_in(&folder.join(name), |_| true))
        .and_then(|()| whole::remove_unfinished_in(folder, |name| name == ANNOTATIONS || name == MARK));
    tidied.map_err(|e| Failure::write(folder, &e))?;
    // Another call may have been faster.
    check(provenance, folder)?;
    let (path, reported) = (folder.join(MARK), to_json(provenance)?);
    if !path.exists() {
        whole::write_bytes(&path, reported.as_bytes()).map_err(|e| Failure::write(&path, &e))?;
    }
    Ok(claim)
}

/// Refuses a folder that contains another dataset, or foreign files with names of a dataset.
fn check(provenance: &Provenance, folder: &Path) -> Result<(), Failure> {
    refuse_recording(folder)?;
    if let Ok(text) = std::fs::read_to_string(folder.join(MARK)) {
        let there: Value = serde_json::from_str(&text).unwrap_or_default();
        if there["scene_hash"] != provenance.scene_hash() {
            return Err(Failure::Input(format!(
                "--out {}: holds another dataset, or this one before its specification or a file it names was changed; give another folder",
                folder.display()
            )));
        }
    } else if let Some(theirs) = taken(folder) {
        return Err(Failure::Input(format!(
            "--out {}: holds no dataset, and files of one would take the place of others ({}): give a new or an empty folder",
            folder.display(),
            theirs.display()
        )));
    }
    Ok(())
}

/// The first path of a dataset that already exists in a folder which is not a dataset.
fn taken(folder: &Path) -> Option<PathBuf> {
    let mut places = FOLDERS.iter().chain([&ANNOTATIONS, &MARK]).map(|name| folder.join(name));
    let is_taken = |path: &PathBuf| match std::fs::read_dir(path) {
        Ok(mut entries) => entries.next().is_some(),
        Err(_) => path.symlink_metadata().is_ok(),
    };
    places.find(is_taken)
}

/// Writes the annotations of all shots; returns the number of pictures of steps that did not converge.
fn join(
    folder: &Path,
    shots: usize,
    provenance: &Provenance,
    split: impl Fn(usize) -> &'static str,
) -> Result<usize, Failure> {
    let info = Info { description: "endowire: simulated fluoroscopy", provenance: provenance.clone() };
    let mut document = Document { info, images: vec![], categories: categories(), annotations: vec![] };
    for shot in 0..shots {
        let path = shot::list(folder, shot);
        let mut part = Part::read(&path).ok_or_else(|| {
            Failure::Computation(format!("{}: is not there any more; run the command again", path.display()))
        })?;
        part.images.iter_mut().for_each(|image| split(shot).clone_into(&mut image.split));
        document.images.extend(part.images);
        document.annotations.extend(part.annotations);
    }
    let text = serde_json::to_string(&document)
        .map_err(|e| Failure::Computation(format!("annotations cannot be written as JSON: {e}")))?;
    let path = folder.join(ANNOTATIONS);
    whole::write_bytes(&path, text.as_bytes()).map_err(|e| Failure::write(&path, &e))?;
    Ok(document.images.iter().filter(|image| !image.converged).count())
}
