//! Frames of a recording or a scene, with the options of the command line.

mod plane;
mod wishes;

use std::path::{Path, PathBuf};

use endowire_core::insertion::Tally;
use endowire_core::vessel::{Displacement, Wall};
use endowire_methods::Scene;
use endowire_recording::npz::write_map;
use endowire_viewer::{
    Animation, DeviceView, Frames, InjectionSpec, Labels, Mask, Mode, Moment, Pace, PathLengths, Pushed,
    Renderer, Seen, View, ViewSpec,
};
use serde::Serialize;

use crate::args::{FrameArgs, ViewChoice};
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::frames::tomogram_holds;
use crate::output::manifest::Manifest;
use crate::output::{print_json, tell, to_json, whole};
use crate::scenes;
use plane::{Plane, write_dicom};
pub(super) use wishes::MOST_FRAMES;

/// One state to draw.
pub(super) struct Still<'a> {
    /// Beginning of its file names.
    pub(super) name: String,
    pub(super) moment: Moment<'a>,
}

/// The JSON document of `render` and `fluoro`.
#[derive(Debug, Serialize)]
pub(super) struct Written {
    /// Backend that drew the frames.
    pub(super) renderer: String,
    /// Folder of the frames.
    pub(super) folder: PathBuf,
    /// All files; those in the folder with relative paths.
    pub(super) files: Vec<PathBuf>,
    /// Statistics of the steps before the frames, if any were carried out.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub(super) went: Option<Went>,
}

/// Statistics of steps.
#[derive(Debug, Serialize)]
pub(super) struct Went {
    /// Number of steps.
    pub(super) steps: usize,
    #[serde(flatten)]
    pub(super) tally: Tally,
}

impl Written {
    /// Prints the result: a JSON document on stdout, or a line of text.
    pub(super) fn tell(&self, json: bool) -> Result<(), Failure> {
        if json {
            return print_json(self);
        }
        let remarks = self.went.as_ref().and_then(|went| went.tally.remarks(went.steps));
        let remarks = remarks.map_or_else(String::new, |remarks| format!("; {remarks}"));
        let (files, folder) = (self.files.len(), self.folder.display());
        tell(format_args!("{files} files by {} in {folder}{remarks}", self.renderer));
        Ok(())
    }
}

/// Forces below this are rounding, N: the view takes no smaller scale.
const LEAST_FORCE_N: f64 = 1e-6;

/// The frames to draw with the options of the command line, checked before anything is computed.
pub(super) struct Plan<'a> {
    args: &'a FrameArgs,
    command: &'static str,
    /// File of the scene.
    scene_file: PathBuf,
    spec: ViewSpec,
    pushed: Pushed,
    folder: PathBuf,
    frames: usize,
    pace: Pace,
    manifest: Manifest,
}

impl<'a> Plan<'a> {
    /// Plans `frames` frames, or those of a turn with a given speed, of a scene. They go to `folder`, where they will
    /// replace those of an earlier call of the same command.
    pub(super) fn new(
        command: &'static str,
        args: &'a FrameArgs,
        (path, scene): (&Path, &Scene),
        default: ViewChoice,
        folder: PathBuf,
        frames: usize,
    ) -> Result<Self, Failure> {
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
        args.animate.as_deref().map_or(Ok(()), Animation::check_name)?;
        let spec = wishes::wished(ViewSpec::of_scene(scene, path)?, args, default)?;
        spec.validate().map_err(|e| in_options(args, path, e.into()))?;
        let pushed = Pushed::new(scene, &spec).map_err(in_scene)?;
        let frames = wishes::frames_of_turn(args, spec.frames_per_s)?.unwrap_or(frames);
        // Devices of a scene rest, and move with a vessel alone.
        let rests = command == "fluoro" && scene.vessel.motion.is_empty();
        wishes::check(args, &spec, frames, rests)?;
        std::fs::create_dir_all(&folder).map_err(|e| {
            Failure::Input(format!("--out {}: {e}; name a folder that can be made", folder.display()))
        })?;
        let manifest = Manifest::begin(&folder, command).map_err(|e| Failure::write(&folder, &e))?;
        let pace = Pace::even(spec.frames_per_s);
        let scene_file = path.to_owned();
        Ok(Self { args, command, scene_file, spec, pushed, folder, frames, pace, manifest })
    }

    /// Sets the times of the frames, instead of a constant rate.
    pub(super) fn at(self, times_s: &[f64]) -> Self {
        Self { pace: Pace::of(times_s, self.spec.frames_per_s), ..self }
    }

    /// Draws forces up to this one, N, to one scale in all frames, unless the view gives another.
    pub(super) fn with_forces_up_to(mut self, largest_n: f64) -> Self {
        let scale = &mut self.spec.camera.force_n;
        *scale = scale.or((largest_n >= LEAST_FORCE_N).then_some(largest_n));
        self
    }

    /// Refuses pictures whose files are there already and are not ours, by the beginnings of their names.
    pub(super) fn check_free(&self, mut names: impl Iterator<Item = String>) -> Result<(), Failure> {
        let views = [(View::ThreeD, "3d"), (View::Fluoro, "fluoro")];
        let views: Vec<_> = views.into_iter().filter(|(view, _)| self.spec.wants(*view)).collect();
        names.try_for_each(|name| {
            views.iter().try_for_each(|(_, view)| {
                let checked = self.manifest.check(&picture_name(&name, view));
                checked.map_err(|e| Failure::write(&self.folder, &e))
            })
        })
    }

    /// Makes room for the pictures, now that all that they need is there.
    fn replace_earlier(&mut self) -> Result<(), Failure> {
        let replaced = self.manifest.replace().map_err(|e| Failure::write(&self.folder, &e))?;
        if replaced > 0 {
            let (command, folder) = (self.command, self.folder.display());
            tell(format_args!(
                "endowire: replaces {replaced} files of an earlier endowire {command} in {folder}"
            ));
        }
        Ok(())
    }

    /// Number of frames to draw.
    pub(super) fn frames(&self) -> usize {
        self.frames
    }

    /// Frames per second.
    pub(super) fn frames_per_s(&self) -> f64 {
        self.spec.frames_per_s
    }
}

/// The failure with its place: the option that gave the value, or else the scene file.
fn in_options(args: &FrameArgs, scene_file: &Path, failure: Failure) -> Failure {
    match wishes::at_fault(args, &failure.to_string()) {
        Some(option) => failure.at(option),
        None => failure.at(scene_file.display()),
    }
}

/// Draws the frames of a plan.
pub(super) struct Studio<'a> {
    plan: Plan<'a>,
    wall: Wall,
    /// The plane of fluoroscopy and of the 3D view, and the second plane, if there is one.
    planes: Vec<Plane>,
    drawn: usize,
    animation: Option<Animation>,
    files: Vec<PathBuf>,
}

impl<'a> Studio<'a> {
    /// Prepares the frames of a vessel; `injections` are added to those of the scene.
    pub(super) fn new(
        mut plan: Plan<'a>,
        wall: Wall,
        injections: impl IntoIterator<Item = InjectionSpec>,
        seen: (&Scene, &Cache),
    ) -> Result<Self, Failure> {
        let planes = Self::prepare(&mut plan, &wall, injections, seen);
        let planes = planes.map_err(|e| in_options(plan.args, &plan.scene_file, e.into()))?;
        if let Some(held) = planes.first().and_then(|plane| tomogram_holds(&plane.renderer)) {
            tell(format_args!("endowire: {held}"));
        }
        plan.replace_earlier()?;
        Ok(Self { plan, wall, planes, drawn: 0, animation: None, files: vec![] })
    }

    /// The planes of a plan, to which `injections` are added.
    fn prepare(
        plan: &mut Plan<'a>,
        wall: &Wall,
        injections: impl IntoIterator<Item = InjectionSpec>,
        (scene, store): (&Scene, &Cache),
    ) -> endowire_core::Result<Vec<Plane>> {
        let mut injections = injections.into_iter().peekable();
        if plan.spec.wants(View::Fluoro) {
            scenes::let_medium_flow(&mut plan.spec, scene, store)?;
            // The script of a recording may be that of another file.
            if injections.peek().is_some() {
                plan.spec.take_centreline(scene, store)?;
            }
        }
        plan.spec.injection.extend(injections);
        Plane::all(&plan.spec, wall)
    }

    /// Whether states before the one that is drawn matter.
    pub(super) fn follows_tip(&self) -> bool {
        self.plan.spec.injects_at_tip()
    }

    /// Passes on the position of the instruments in a state that is not drawn.
    pub(super) fn follow_tip(
        &mut self,
        Seen { shape, inserted_mm, time_s }: Seen<'_>,
        displacement: Option<&Displacement>,
    ) -> Result<(), Failure> {
        if let Some(tip_mm) = self.plan.pushed.tip_at_rest_mm(shape, inserted_mm, displacement) {
            self.planes.iter_mut().try_for_each(|plane| plane.renderer.follow_tip(time_s, tip_mm))?;
        }
        Ok(())
    }

    /// Position of the next frame between the first and the last, 0 to 1.
    fn part(&self) -> f64 {
        self.drawn as f64 / self.plan.frames.max(2).saturating_sub(1) as f64
    }

    /// A message if the only frame is a subtraction of nothing.
    fn empty(&self, time_s: f64) -> Option<String> {
        let spec = &self.plan.spec;
        let subtracts = spec.wants(View::Fluoro) && spec.xray.mode == Mode::Dsa && self.plan.frames == 1;
        let injected = spec.injection.iter().any(|one| one.start_s < time_s);
        (subtracts && !injected).then(|| {
            format!(
                "view.xray.mode = dsa: the picture is empty: a subtraction shows what was added since its first frame, this is the only \
                 one, and nothing is injected before {time_s} s: draw several frames, or one during an injection"
            )
        })
    }

    /// Draws a state and writes the requested files.
    pub(super) fn draw(&mut self, still: &Still) -> Result<(), Failure> {
        if let Some(empty) = self.empty(still.moment.frame.time_s) {
            tell(format_args!("endowire: {empty}"));
        }
        let drawn = self.draw_all(still);
        self.check_there()?;
        drawn
    }

    /// Fails if the folder of the frames has vanished, which explains any other failure.
    fn check_there(&self) -> Result<(), Failure> {
        if self.plan.manifest.is_there() {
            return Ok(());
        }
        Err(Failure::Computation(format!(
            "{}: was removed or replaced while frames were drawn, and those before with it: draw them again",
            self.plan.folder.display()
        )))
    }

    fn draw_all(&mut self, still: &Still) -> Result<(), Failure> {
        let views = still.moment.devices(&mut self.plan.pushed)?;
        let orbited = match self.plan.args.orbit.filter(|_| self.plan.spec.wants(View::ThreeD)) {
            Some(orbit_deg) => Some(self.orbited(orbit_deg, &views, still)?),
            None => None,
        };
        let turn_deg = self.plan.args.turn.map(|turn_deg| turn_deg * self.part());
        let mut three_d = None;
        let mut fluoro = Vec::with_capacity(self.planes.len());
        let wanted = orbited.is_none() || self.plan.spec.wants(View::Fluoro);
        for plane in self.planes.iter_mut().filter(|_| wanted) {
            // A mask of a new position of the C-arm is taken where the vessel is now.
            plane.renderer.set(&still.moment)?;
            plane.turn(&views, turn_deg)?;
            let frames = plane.renderer.draw(&mut self.plan.pushed, &still.moment)?;
            three_d = three_d.or(frames.three_d);
            if let (Some(image), true) = (&frames.fluoro, self.plan.args.dicom.is_some()) {
                plane.keep(image.clone());
            }
            fluoro.push((plane.ending, frames.fluoro));
        }
        for (ending, image) in fluoro.iter().skip(1) {
            if let Some(image) = image {
                let path = self.file(&format!("{}_fluoro{ending}.png", still.name))?;
                image.write_png(&path)?;
            }
        }
        let first = fluoro.into_iter().next().and_then(|(_, image)| image);
        let three_d = orbited.flatten().or(three_d);
        self.write(still, &Frames { three_d, fluoro: first })?;
        for plane in 0..self.planes.len() {
            self.write_data(still, plane, &views)?;
        }
        self.drawn += 1;
        Ok(())
    }

    /// The 3D view of an orbiting camera.
    fn orbited(
        &self,
        orbit_deg: f64,
        views: &[DeviceView],
        still: &Still,
    ) -> Result<Option<endowire_viewer::Image>, Failure> {
        let mut spec = ViewSpec { views: vec![View::ThreeD], ..self.plan.spec.clone() };
        (spec.camera.turn_deg, spec.camera.orbit_deg) = (orbit_deg * self.part(), Some(orbit_deg));
        let mut orbiting = Renderer::of_wall(&spec, &self.wall)?;
        orbiting.set(&still.moment)?;
        Ok(orbiting.render_at(views, still.moment.frame)?.three_d)
    }

    /// Writes the frames of the first plane, separately and side by side, and adds them to the animation.
    fn write(&mut self, still: &Still, frames: &Frames) -> Result<(), Failure> {
        for (view, image) in [("3d", &frames.three_d), ("fluoro", &frames.fluoro)] {
            if let Some(image) = image {
                let path = self.file(&picture_name(&still.name, view))?;
                image.write_png(&path)?;
            }
        }
        let both = match (&frames.three_d, &frames.fluoro) {
            (Some(left), Some(right)) => Some(left.beside(right)),
            _ => None,
        };
        if let Some(both) = &both {
            let path = self.file(&format!("{}_both.png", still.name))?;
            both.write_png(&path)?;
        }
        if let (Some(path), Some(shown)) =
            (&self.plan.args.animate, both.as_ref().or(frames.three_d.as_ref()).or(frames.fluoro.as_ref()))
        {
            let mut animation = match self.animation.take() {
                Some(animation) => animation,
                None => Animation::new(path, shown, self.plan.frames as u32, self.plan.pace.clone())?,
            };
            animation.push(shown)?;
            self.animation = Some(animation);
        }
        Ok(())
    }

    /// Writes labels and arrays of a plane.
    fn write_data(&mut self, still: &Still, plane: usize, views: &[DeviceView]) -> Result<(), Failure> {
        let ending = self.planes[plane].ending;
        if self.plan.args.labels {
            let contacts: Vec<_> = still.moment.contacts.iter().map(|c| c.position_mm).collect();
            let mut labels = self.planes[plane].renderer.labels(views, &contacts)?;
            let shown = self.plan.pushed.shown(still.moment.inserted_mm);
            labels.devices.iter_mut().zip(shown).for_each(|(label, shown)| label.shown = Some(shown));
            let path = self.file(&format!("{}_mask{ending}.png", still.name))?;
            labels.mask.write_png(&path)?;
            for (name, mask) in masks(&labels) {
                let path = self.file(&format!("{}_{name}{ending}.png", still.name))?;
                mask.image().write_png(&path)?;
            }
            let path = self.file(&format!("{}_labels{ending}.json", still.name))?;
            whole::write_bytes(&path, (to_json(&labels)? + "\n").as_bytes())
                .map_err(|e| Failure::write(&path, &e))?;
        }
        if self.plan.args.raw {
            let renderer = &mut self.planes[plane].renderer;
            let paths = renderer.path_lengths_at(views, still.moment.frame.time_s)?;
            let left = renderer.transmission_at(views, still.moment.frame.time_s)?;
            let line: Vec<f32> = left.iter().map(|t| -t.ln()).collect();
            for (name, map) in maps(&paths, &line) {
                let path = self.file(&format!("{}_{name}{ending}.npy", still.name))?;
                write_map(&path, paths.width as usize, map).map_err(|e| Failure::write(&path, &e))?;
            }
        }
        Ok(())
    }

    /// Path of a file in the folder, which is added to the list.
    fn file(&mut self, name: &str) -> Result<PathBuf, Failure> {
        self.plan.manifest.add(name).map_err(|e| Failure::write(&self.plan.folder, &e))?;
        self.files.push(name.into());
        Ok(self.plan.folder.join(name))
    }

    /// Completes animation and DICOM series.
    pub(super) fn finish(mut self) -> Result<Written, Failure> {
        let ended = self.end();
        self.check_there()?;
        ended?;
        let renderer = self.planes.first().map(|plane| plane.renderer.backend().to_owned());
        let (renderer, folder) = (renderer.unwrap_or_default(), self.plan.folder);
        Ok(Written { renderer, folder, files: self.files, went: None })
    }

    fn end(&mut self) -> Result<(), Failure> {
        if let (Some(animation), Some(path)) = (self.animation.take(), &self.plan.args.animate) {
            animation.finish()?;
            self.files.push(path.clone());
        }
        for plane in 0..self.planes.len() {
            let held = self.planes[plane].renderer.last_image_hold().filter(|_| self.plan.args.hold);
            if let Some(image) = held {
                let path = self.file(&format!("hold{}.png", self.planes[plane].ending))?;
                image.write_png(&path)?;
            }
        }
        if let Some(path) = &self.plan.args.dicom {
            let step_deg =
                self.plan.args.turn.unwrap_or(0.0) / self.plan.frames.max(2).saturating_sub(1) as f64;
            self.files.extend(write_dicom(&self.planes, path, step_deg, &self.plan.pace)?);
        }
        Ok(())
    }
}

/// Name of the file of a view.
fn picture_name(still: &str, view: &str) -> String {
    format!("{still}_{view}.png")
}

/// The available arrays of a frame, with names.
fn maps<'a>(paths: &'a PathLengths, line: &'a Vec<f32>) -> Vec<(String, &'a Vec<f32>)> {
    let mut maps = vec![("line_integral".to_owned(), line)];
    for (name, map) in [
        ("body_mm", &paths.body_mm),
        ("bone_mm", &paths.bone_mm),
        ("lung_mm", &paths.lung_mm),
        ("lumen_mm", &paths.lumen_mm),
        ("contrast_mm", &paths.contrast_mm),
    ] {
        if !map.is_empty() {
            maps.push((name.to_owned(), map));
        }
    }
    maps.extend(paths.devices_mm.iter().map(|(material, map)| (format!("{material}_mm"), map)));
    maps
}

/// Masks of a frame, with names: the vessel, each of several instruments, and each of several parts.
fn masks(labels: &Labels) -> Vec<(String, &Mask)> {
    let mut named: Vec<(String, &Mask)> =
        labels.vessel.iter().map(|mask| ("mask_vessel".to_owned(), mask)).collect();
    for (k, device) in (1..).zip(&labels.devices) {
        if labels.devices.len() > 1 {
            named.push((format!("mask_{k}"), &device.mask));
        }
        named.extend((1..).zip(&device.parts).map(|(j, part)| (format!("mask_{k}_part_{j}"), &part.mask)));
    }
    named
}
