//! The pictures of one pose of one course, with their labels.

use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_recording::npz::{Array, write_arrays};
use endowire_viewer::{FrameTime, Labels, Moment, Seen, ViewSpec};
use serde::{Deserialize, Serialize};

use super::coco::{Annotation, ImageRow, annotations};
use super::course::Course;
use super::draw::{Draw, What};
use super::spec::Spec;
use crate::failure::Failure;
use crate::output::whole;

/// The list of a shot's files, kept until the dataset is complete.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Part {
    pub(super) images: Vec<ImageRow>,
    pub(super) annotations: Vec<Annotation>,
}

impl Part {
    /// Reads a list; `None` if it is missing or incomplete.
    pub(super) fn read(path: &Path) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(path).ok()?).ok()
    }
}

/// Path of the list of a shot.
pub(super) fn list(folder: &Path, shot: usize) -> PathBuf {
    folder.join("parts").join(format!("{shot:06}.json"))
}

/// Whether a shot is complete: its list, and the files that it names.
pub(super) fn is_whole(folder: &Path, shot: usize) -> bool {
    let there = |image: &ImageRow| {
        [&image.file_name, &image.arrays].into_iter().all(|file| folder.join(file).is_file())
    };
    Part::read(&list(folder, shot)).is_some_and(|part| part.images.iter().all(there))
}

/// Draws the pictures of shot number `shot`, one pose of a course.
pub(super) fn draw(spec: &Spec, course: &Course, shot: usize, folder: &Path) -> Result<Part, Failure> {
    let draw = drawn(spec, shot);
    let views = planes(spec, &course.view, shot);
    let mut renderers = Vec::with_capacity(views.len());
    for view in &views {
        renderers.push(course.renderer.beside(view)?);
    }
    let mut part = Part { images: vec![], annotations: vec![] };
    let mut pushed = course.pushed.clone();
    for m in 0..spec.moments {
        let of = draw.of(m);
        let last = course.moments.len() - 1;
        let progress = of.within(What::Progress, spec.vary.progress);
        let moment = &course.moments[(progress * last as f64).round() as usize];
        let time_s = moment.time_s + of.within(What::Time, spec.vary.time_s);
        let way = course.way_of_tip(moment);
        let before = moment.step.checked_sub(1).map(|before| &course.moments[before]);
        let shown = Moment {
            frame: FrameTime { frame: m as u64, time_s },
            shape: &moment.shape,
            inserted_mm: &moment.inserted_mm,
            coils: &moment.coils,
            contacts: &[],
            displacement: moment.displacement.as_ref(),
            before: before.map(|before| Seen {
                shape: &before.shape,
                inserted_mm: &before.inserted_mm,
                time_s: time_s - (moment.step_time_s - before.step_time_s),
            }),
        };
        let devices = shown.devices(&mut pushed)?;
        let in_line = moment.inserted_mm.iter().enumerate().filter(|(_, mm)| **mm > 0.0).map(|(i, _)| i);
        let drawn = in_line.chain(moment.coils.iter().map(|coil| coil.instrument));
        let drawn: Vec<(usize, &str)> = drawn.map(|i| (i, course.instruments[i].as_str())).collect();
        let names: Vec<String> = drawn.iter().map(|one| one.1.to_owned()).collect();
        let contacts: Vec<Vec3> = moment.contacts.iter().map(|c| c.position_mm).collect();
        for (plane, (renderer, view)) in renderers.iter_mut().zip(&views).enumerate() {
            let id = (shot * spec.moments + m) * spec.views() + plane;
            way.iter().try_for_each(|(then_s, place_mm)| renderer.follow_tip(*then_s, *place_mm))?;
            let Some(image) = renderer.draw(&mut pushed, &shown)?.fluoro else { continue };
            let labels = renderer.labels(&devices, &contacts)?;
            let [file_name, arrays] = [format!("images/{id:07}.png"), format!("arrays/{id:07}.npz")];
            image.write_png(folder.join(&file_name))?;
            let path = folder.join(&arrays);
            write_arrays(&path, &label_arrays(&labels)).map_err(|e| Failure::write(&path, &e))?;
            part.annotations.extend(annotations((id, &image), &labels, &pushed, &drawn)?);
            let angles = view.c_arm.angles_deg();
            part.images.push(ImageRow {
                id,
                pose: shot,
                split: String::new(),
                file_name,
                arrays,
                width: image.width(),
                height: image.height(),
                scene: course.scene.clone(),
                device: course.device.clone(),
                instruments: names.clone(),
                step: moment.step,
                converged: moment.converged,
                step_time_s: moment.step_time_s,
                time_s,
                plane,
                pair: (spec.views() == 2).then_some(id - plane + (1 - plane)),
                primary_deg: angles[0],
                secondary_deg: angles[1],
                kvp: labels.exposure.kvp,
                dose_ngy: labels.exposure.dose_ngy,
                magnification: view.c_arm.magnification,
                width_mm: view.patient.torso.as_ref().map(|torso| torso.width_mm),
                scatter_fraction: view.detector.scatter_fraction,
                contrast_fraction: view.xray.contrast_fraction,
                camera_matrix: labels.camera_matrix,
            });
        }
    }
    let text = serde_json::to_string(&part)
        .map_err(|e| Failure::Computation(format!("labels cannot be written as JSON: {e}")))?;
    let path = list(folder, shot);
    whole::write_bytes(&path, text.as_bytes()).map_err(|e| Failure::write(&path, &e))?;
    Ok(part)
}

/// The random numbers of a shot.
fn drawn(spec: &Spec, shot: usize) -> Draw {
    Draw::new(spec.seed).of(shot)
}

/// The views of a shot's planes: those of its course with the drawn parameters.
pub(super) fn planes(spec: &Spec, of_course: &ViewSpec, shot: usize) -> Vec<ViewSpec> {
    let (vary, draw) = (&spec.vary, drawn(spec, shot));
    let mut view = of_course.clone();
    view.c_arm.primary_deg = draw.within(What::Primary, vary.primary_deg);
    view.c_arm.secondary_deg = draw.within(What::Secondary, vary.secondary_deg);
    view.detector.seed = draw.word(What::Noise);
    let voltages = vary.kvp.as_deref().unwrap_or_default();
    if let Some(&kvp) = voltages.get((draw.unit(What::Voltage) * voltages.len() as f64) as usize) {
        view.xray.kvp = kvp;
    }
    if let Some(range) = vary.magnification {
        view.c_arm.magnification = draw.within(What::Magnification, range);
    }
    if let (Some(range), Some(torso)) = (vary.width_mm, &mut view.patient.torso) {
        torso.width_mm = draw.within(What::Width, range);
    }
    if let Some(range) = vary.scatter_fraction {
        view.detector.scatter_fraction = draw.within(What::Scatter, range);
    }
    if let Some(range) = vary.contrast_fraction {
        view.xray.contrast_fraction = draw.within(What::Contrast, range);
    }
    if let Some(range) = vary.dose_ngy {
        view.detector.dose_ngy = Some(draw.within(What::Dose, range.map(f64::ln)).exp());
    }
    view.biplane_deg = spec.biplane_deg;
    view.planes()
}

/// Labels as arrays.
fn label_arrays(labels: &Labels) -> Vec<Array> {
    let [width, height] = labels.size_px.map(|n| n as usize);
    let bytes = |name: &str, data: Vec<u8>| Array::of_bytes(name, vec![height, width], data);
    // Separate masks, because an instrument does not hide the one inside it.
    let masks = labels.devices.iter().flat_map(|device| device.mask.image().into_data());
    let mut arrays = vec![
        Array::of_bytes("masks", vec![labels.devices.len(), height, width], masks.collect()),
        Array::of_floats("camera_matrix", vec![3, 4], labels.camera_matrix.iter().flatten().copied()),
    ];
    arrays.extend(labels.vessel.as_ref().map(|mask| bytes("vessel", mask.image().into_data())));
    for (k, device) in (1..).zip(&labels.devices) {
        let points = device.centre_line_px.len();
        let line_px = device.centre_line_px.iter().flatten().copied();
        let line_mm = device.centre_line_mm.iter().flatten().copied();
        arrays.push(Array::of_floats(&format!("line_{k}_px"), vec![points, 2], line_px));
        arrays.push(Array::of_floats(&format!("line_{k}_mm"), vec![points, 3], line_mm));
        let shaft_px = device.shaft_px.iter().flatten().copied();
        arrays.push(Array::of_floats(&format!("shaft_{k}_px"), vec![device.shaft_px.len(), 2], shaft_px));
        arrays.push(Array::of_floats(
            &format!("depth_{k}_mm"),
            vec![points],
            device.depth_mm.iter().copied(),
        ));
    }
    arrays
}
