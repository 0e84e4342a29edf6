//! One scene with one device, and the states of its script.

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::input::plain;
use endowire_core::insertion::{DetachedCoil, Step, Tally};
use endowire_core::shape::Shape;
use endowire_core::vessel::Displacement;
use endowire_methods::{Key, Scene, Setting};
use endowire_recording::InjectionRow;
use endowire_viewer::{ContactView, Mode, Pushed, Renderer, View, ViewSpec};
use serde_json::{Map, Value};

use super::shot;
use super::spec::Spec;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::frames::flowing;
use crate::output::tell;
use crate::scenes;

/// A time before all injections, s.
const LONG_BEFORE_S: f64 = -1e6;

/// The state after a step.
pub(super) struct FrameTime {
    pub(super) step: usize,
    /// Whether the step converged.
    pub(super) converged: bool,
    /// End time of the step.
    pub(super) step_time_s: f64,
    /// Origin of the times of injections: the end of the step if the script injects, otherwise 0.
    pub(super) time_s: f64,
    pub(super) shape: Shape,
    pub(super) inserted_mm: Vec<f64>,
    pub(super) contacts: Vec<ContactView>,
    /// Detached coils.
    pub(super) coils: Vec<DetachedCoil>,
    /// Displacement of the vessel, if it moves.
    pub(super) displacement: Option<Displacement>,
}

/// A scene with a device whose script was carried out.
pub(super) struct Course {
    pub(super) scene: String,
    pub(super) device: Option<String>,
    pub(super) instruments: Vec<String>,
    pub(super) view: ViewSpec,
    /// Source of data shared by the renderers of all poses; it draws nothing itself.
    pub(super) renderer: Renderer,
    pub(super) pushed: Pushed,
    /// One per step; the first is before the script.
    pub(super) moments: Vec<FrameTime>,
}

impl Course {
    /// Carries out a scene, whose first shot is `first`. A step that fails ends it; earlier states are kept.
    pub(super) fn run(
        spec: &Spec,
        first: usize,
        file: &Path,
        device: Option<&Path>,
        (settings, cache): (&[Setting], &Cache),
    ) -> Result<Self, Failure> {
        let failed = |e: endowire_core::Error| Failure::from(e).at(file.display());
        let scene = scene(file, device, settings)?;
        let mut view = view(spec, &scene, file, device.is_some())?;
        let pushed = Pushed::new(&scene, &view).map_err(|e| Failure::from(e).at(file.display()))?;
        let script = scene.stack().and_then(|stack| scene.steps(&stack, cache)).map_err(failed)?;
        let mut simulation = scene.simulation(cache).map_err(failed)?;
        let instruments = simulation.stack().instruments().iter().map(|i| i.name.clone()).collect();
        let mut moments = Vec::new();
        let mut run = script.begin();
        let (mut injected, mut step_time_s, mut tally) = (Vec::new(), 0.0, Tally::default());
        loop {
            let report = simulation.report();
            let contacts = report.contacts.iter();
            let contacts = contacts.map(|c| ContactView { position_mm: c.position_mm, force_n: c.total_n() });
            moments.push(FrameTime {
                step: moments.len(),
                // There is nothing to solve before the first step.
                converged: moments.is_empty() || report.converged,
                step_time_s,
                time_s: if script.injects() { step_time_s } else { 0.0 },
                shape: simulation.shape().clone(),
                inserted_mm: report.lengths_mm(),
                contacts: contacts.collect(),
                coils: simulation.coils().to_vec(),
                displacement: simulation.displacement(),
            });
            let step = run.next(&simulation)?.map(Step::into_owned);
            injected.extend(InjectionRow::begun(&run, injected.len(), view.frames_per_s, &simulation));
            let Some(next) = step else { break };
            if let Err(error) = next.carry_out(&mut simulation) {
                let step = moments.len();
                tell(format_args!(
                    "endowire: {}: step {step}: {error}; pictures are of those before",
                    file.display()
                ));
                break;
            }
            run.carried_out();
            tally.count(moments.len(), &simulation);
            step_time_s = next.time_s.unwrap_or(moments.len() as f64 / view.frames_per_s);
        }
        if let (Some(remarks), true) = (tally.remarks(moments.len() - 1), tally.unconverged_steps > 0) {
            tell(format_args!("endowire: {}: {remarks}", file.display()));
        }
        scenes::let_medium_flow(&mut view, &scene, cache).map_err(failed)?;
        view.injection.extend(injected.iter().map(flowing));
        scenes::tell_found(file, &scene);
        view.validate().map_err(failed)?;
        let views = shot::planes(spec, &view, first);
        Ok(Self {
            scene: scene.name.clone(),
            device: device.and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned()),
            instruments,
            renderer: Renderer::of_wall(&views[0], simulation.lumen().wall(cache).map_err(failed)?)?,
            view,
            pushed,
            moments,
        })
    }

    /// Times and material places of the tip up to a state; empty if nothing is injected at the tip. If script lines
    /// inject, time advances with the steps; otherwise the instruments are still at all times.
    pub(super) fn way_of_tip(&self, moment: &FrameTime) -> Vec<(f64, Vec3)> {
        if !self.view.injects_at_tip() {
            return vec![];
        }
        let before = self.moments.iter().filter(|one| one.step < moment.step && one.time_s < moment.time_s);
        let on_the_way = before.chain([moment]).filter_map(|one| {
            let displacement = one.displacement.as_ref();
            Some((one.time_s, self.pushed.tip_at_rest_mm(&one.shape, &one.inserted_mm, displacement)?))
        });
        let mut way: Vec<(f64, Vec3)> = on_the_way.collect();
        // Begins before all times, so that data of other pictures have no effect.
        if let Some(&(_, first_mm)) = way.first() {
            way.insert(0, (LONG_BEFORE_S, first_mm));
        }
        way
    }
}

/// A scene with settings, and with another device if one is given.
fn scene(file: &Path, device: Option<&Path>, settings: &[Setting]) -> Result<Scene, Failure> {
    let bad = |text: String| Failure::Input(text).at(file.display());
    let Some(device) = device else { return scenes::read(file, settings) };
    if !Scene::read(file)?.instrument.is_empty() {
        return Err(bad(
            "devices are given, and the scene has instruments of its own: give it without devices".to_owned(),
        ));
    }
    let device = std::path::absolute(device).map_err(|e| bad(e.to_string()))?;
    let named = toml::Table::from_iter([(
        "file".to_owned(),
        toml::Value::from(device.to_string_lossy().into_owned()),
    )]);
    let key = Key::parse("device")?;
    // The device comes first, because settings may refer to its parts.
    let with_device = [&[Setting { key, value: named.into() }], settings].concat();
    scenes::with_any_device(file, &with_device)
}

/// The view of a scene with the keys of the specification. If another device replaces the scene's own, the materials
/// of the latter are left out.
fn view(spec: &Spec, scene: &Scene, file: &Path, other_device: bool) -> Result<ViewSpec, Failure> {
    let bad =
        |e: serde_json::Error| Failure::Input(format!("view: {}", plain(&e.to_string()))).at(file.display());
    let mut of_scene = ViewSpec::of_scene(scene, file)?;
    if other_device {
        of_scene.device.clear();
    }
    let vessel_moves = of_scene.patient.vessel_moves;
    let mut table = serde_json::to_value(of_scene).map_err(bad)?;
    merge(&mut table, &spec.view);
    let mut view: ViewSpec = serde_json::from_value(table).map_err(bad)?;
    view.patient.vessel_moves = vessel_moves;
    view.views = vec![View::Fluoro];
    // States are drawn at random, so the previous picture is not the previous state.
    (view.detector.lag, view.xray.brightness_s) = (0.0, 0.0);
    view.c_arm.pose = None;
    if let Mode::Dsa | Mode::Roadmap = view.xray.mode {
        // What such a picture shows depends on the moments before it.
        view.xray.mode = Mode::Fluoro;
        tell(format_args!(
            "endowire: {}: pictures of a dataset are live fluoroscopy, whatever view.xray.mode of the scene is",
            file.display()
        ));
    }
    if view.patient.torso.is_none() && spec.vary.width_mm.is_some() {
        let text = "vary.width_mm is that of a generated body, and there is none: give view.patient.torso, or leave it out";
        return Err(Failure::Input(text.to_owned()).at(file.display()));
    }
    if view.exposure.is_some() && spec.vary.kvp.is_some() {
        let text = "vary.kvp and [view.exposure] both say the voltage: leave out one of them";
        return Err(Failure::Input(text.to_owned()).at(file.display()));
    }
    view.validate().map_err(|e| Failure::from(e).at(file.display()))?;
    Ok(view)
}

fn merge(into: &mut Value, from: &Map<String, Value>) {
    if !into.is_object() {
        *into = Value::Object(Map::new());
    }
    for (key, value) in from {
        match value {
            Value::Object(inner) => merge(&mut into[key.as_str()], inner),
            other => into[key.as_str()] = other.clone(),
        }
    }
}
