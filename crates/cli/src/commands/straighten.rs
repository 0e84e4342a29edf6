//! `endowire vessel straighten`: what the devices of a scene do to the course of its vessel.

use std::path::{Path, PathBuf};

use endowire_core::Error;
use endowire_core::insertion::{Simulation, Step};
use endowire_core::vessel::{Displacement, Landmark, Straightening, Stretch};
use endowire_methods::Scene;
use endowire_viewer::{FrameTime, Moment, Pushed, Renderer, View, ViewSpec};
use serde::Serialize;

use crate::args::StraightenArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};
use crate::scenes;

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    scene: String,
    steps: usize,
    inserted_mm: Vec<f64>,
    largest_push_force_n: f64,
    vessel_mj: f64,
    #[serde(flatten)]
    straightening: Straightening,
    /// The pictures before and after, if they were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pictures: Vec<PathBuf>,
}

/// Carries out a scene's script and reports on the vessel before and after.
pub(crate) fn straighten(args: &StraightenArgs) -> Result<(), Failure> {
    let in_scene = |e: Error| Failure::from(e).at(args.scene.display());
    let scene = scenes::read(&args.scene, &args.set.set)?;
    if scene.vessel.yielding.is_none() {
        let remedy = "only the wall of this vessel yields: give the table, for example vessel.yielding.preset = \"iliac\"";
        return Err(in_scene(Error::parameter("vessel.yielding", "missing", remedy)));
    }
    let cache = Cache::new(&args.cache);
    let stack = scene.stack().map_err(in_scene)?;
    let script = scene.steps(&stack, &cache).map_err(in_scene)?;
    let mut simulation = scene.simulation(&cache).map_err(in_scene)?;
    let bar = progress::bar(script.len(), "step");
    let (mut run, mut steps, mut largest_n) = (script.begin(), 0, 0.0f64);
    while let Some(step) = run.next(&simulation).map_err(in_scene)?.map(Step::into_owned) {
        let failed =
            |e: Error| Failure::Computation(format!("{}: step {}: {e}", args.scene.display(), steps + 1));
        step.carry_out(&mut simulation).map_err(failed)?;
        run.carried_out();
        steps += 1;
        largest_n = largest_n.max(simulation.report().push_force_n);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let tree = scene.centreline(&cache).map_err(in_scene)?;
    let displacement = simulation.displacement();
    let pictures = match &args.out {
        Some(folder) => draw(&args.scene, &scene, (&simulation, displacement.as_ref()), folder, &cache)?,
        None => Vec::new(),
    };
    let document = Document {
        provenance: Provenance::of_scene(&scene, &args.set.set)?,
        scene: scene.name.clone(),
        steps,
        inserted_mm: simulation.report().lengths_mm(),
        largest_push_force_n: largest_n,
        vessel_mj: simulation.report().energy.vessel,
        straightening: Straightening::of(tree, displacement.as_ref()),
        pictures,
    };
    answer(&document, args.json, || in_words(&document))
}

/// Draws the vessel without devices as it was, and with them as it is, as the scene's `[view]` says; returns the files.
fn draw(
    path: &Path,
    scene: &Scene,
    (simulation, displacement): (&Simulation, Option<&Displacement>),
    folder: &Path,
    cache: &Cache,
) -> Result<Vec<PathBuf>, Failure> {
    let in_scene = |e: Error| Failure::from(e).at(path.display());
    let mut spec = ViewSpec::of_scene(scene, path)?;
    if spec.views.is_empty() {
        spec.views = vec![View::ThreeD, View::Fluoro];
    }
    let wall = simulation.lumen().wall(cache).map_err(in_scene)?;
    std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, &e))?;
    let mut files = Vec::new();
    let nothing = endowire_core::shape::Shape::default();
    let now = (simulation.shape(), simulation.report().lengths_mm(), displacement);
    let were = (&nothing, Vec::new(), None);
    for (name, (shape, inserted_mm, displacement)) in [("before", were), ("after", now)] {
        let mut renderer = Renderer::of_wall(&spec, wall).map_err(in_scene)?;
        let mut pushed = Pushed::new(scene, &spec).map_err(in_scene)?;
        let moment = Moment {
            frame: FrameTime { frame: 0, time_s: simulation.time_s() },
            shape,
            inserted_mm: &inserted_mm,
            coils: &[],
            contacts: &[],
            displacement,
            before: None,
        };
        let frames = renderer.draw(&mut pushed, &moment).map_err(in_scene)?;
        for (view, image) in [("3d", &frames.three_d), ("fluoro", &frames.fluoro)] {
            if let Some(image) = image {
                let file = folder.join(format!("{name}_{view}.png"));
                image.write_png(&file)?;
                files.push(file);
            }
        }
    }
    Ok(files)
}

/// The document for people.
fn in_words(document: &Document) -> String {
    let mut text = format!(
        "{}: {} steps, largest push {:.2} N, the centre line moved by up to {:.1} mm\n\n",
        document.scene,
        document.steps,
        document.largest_push_force_n,
        document.straightening.largest_displacement_mm
    );
    text +=
        &format!("{:<46} {:>17} {:>17} {:>15}\n", "centre line", "length mm", "straight mm", "tortuosity");
    for stretch in &document.straightening.stretches {
        let Stretch { from, to, length_mm, straight_mm, tortuosity } = stretch;
        let way = format!("{from} – {to}");
        text += &format!(
            "{way:<46} {:>7.1} → {:>7.1} {:>7.1} → {:>7.1} {:>6.3} → {:>6.3}\n",
            length_mm.before,
            length_mm.after,
            straight_mm.before,
            straight_mm.after,
            tortuosity.before,
            tortuosity.after
        );
    }
    if document.straightening.stretches.is_empty() {
        text += "(none: the centre line has no named places; name some by targets)\n";
    }
    text += &format!("\n{:<46} {:>12} {:>19}\n", "place", "moved by mm", "angle °");
    for Landmark { name, displacement_mm, angle_deg, .. } in &document.straightening.places {
        let angle =
            angle_deg.map_or(String::new(), |angle| format!("{:>7.1} → {:>7.1}", angle.before, angle.after));
        text += &format!("{name:<46} {displacement_mm:>12.2} {angle:>19}\n");
    }
    for file in &document.pictures {
        text += &format!("\n{}", file.display());
    }
    text.trim_end().to_owned()
}
