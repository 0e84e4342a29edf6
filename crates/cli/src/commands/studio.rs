//! Frames with the wishes of the command line: of a recording, or of a scene.

use std::path::{Path, PathBuf};

use endowire_core::Error;
use endowire_core::shape::Shape;
use endowire_core::vessel::Wall;
use endowire_methods::Scene;
use endowire_viewer::{
    Angiogram, Animation, CArm, ContactView, Frames, Image, InjectionSpec, Labels, Mask, Moment, Pushed,
    Renderer, View, ViewSpec,
};
use serde::Serialize;
use serde_json::Value;

use crate::args::{FrameArgs, ViewChoice};
use crate::failure::Failure;
use crate::output::manifest::Manifest;
use crate::output::npz::write_map;
use crate::output::{print_json, tell, to_json};

/// One moment to draw.
pub(super) struct Still<'a> {
    /// Begins the names of its files.
    pub(super) name: String,
    pub(super) moment: Moment,
    pub(super) shape: &'a Shape,
    /// Length in of the device, or of each instrument, mm.
    pub(super) inserted_mm: &'a [f64],
    pub(super) contacts: &'a [ContactView],
}

/// What was written: the JSON document of `render` and `fluoro`.
#[derive(Debug, Serialize)]
pub(super) struct Written {
    /// What drew.
    pub(super) renderer: String,
    /// Folder of the frames.
    pub(super) folder: PathBuf,
    /// Every file, relative to the folder where it lies there.
    pub(super) files: Vec<PathBuf>,
}

impl Written {
    /// Says what was written: the document on stdout, or a line beside it.
    pub(super) fn tell(&self, json: bool) -> Result<(), Failure> {
        if json {
            return print_json(self);
        }
        tell(format_args!("{} files by {} in {}", self.files.len(), self.renderer, self.folder.display()));
        Ok(())
    }
}

/// A hundred turns.
const MOST_ORBIT_DEG: f64 = 36_000.0;

/// Draws frames with the wishes of the command line.
pub(super) struct Studio<'a> {
    args: &'a FrameArgs,
    spec: ViewSpec,
    wall: Wall,
    pushed: Pushed,
    renderer: Renderer,
    second: Option<SecondPlane>,
    folder: PathBuf,
    frames: usize,
    drawn: usize,
    animation: Option<Animation>,
    series: Vec<Image>,
    manifest: Manifest,
    files: Vec<PathBuf>,
}

/// The other plane of a biplane system.
struct SecondPlane {
    renderer: Renderer,
    series: Vec<Image>,
}

impl SecondPlane {
    /// The plane turned by `turn_deg` from that of `spec`.
    fn new(spec: &ViewSpec, turn_deg: f64, wall: &Wall) -> Result<Self, Error> {
        let mut spec = ViewSpec { views: vec![View::Fluoro], ..spec.clone() };
        let [primary_deg, secondary_deg] = spec.c_arm.angles_deg();
        spec.c_arm.pose = None;
        (spec.c_arm.primary_deg, spec.c_arm.secondary_deg) = (primary_deg + turn_deg, secondary_deg);
        Ok(Self { renderer: Renderer::of_wall(&spec, wall)?, series: vec![] })
    }
}

impl<'a> Studio<'a> {
    /// Prepares `frames` frames of a scene with its wall, in `folder`, where they replace those of an earlier call of the same command.
    pub(super) fn new(
        command: &str,
        args: &'a FrameArgs,
        (path, scene, wall): (&Path, &Scene, Wall),
        default: ViewChoice,
        folder: PathBuf,
        frames: usize,
    ) -> Result<Self, Failure> {
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
        args.animate.as_deref().map_or(Ok(()), Animation::check_name)?;
        let spec = wished(ViewSpec::of_scene(scene, path)?, args, default)?;
        let pushed = Pushed::new(scene, &spec).map_err(in_scene)?;
        let renderer = Renderer::of_wall(&spec, &wall).map_err(in_scene)?;
        if let Some(orbit) = args.orbit.filter(|orbit| !(-MOST_ORBIT_DEG..=MOST_ORBIT_DEG).contains(orbit)) {
            let text = format!("--orbit {orbit:e}: give -{MOST_ORBIT_DEG} to {MOST_ORBIT_DEG} degrees");
            return Err(Failure::Input(text));
        }
        let of_fluoro =
            args.dicom.is_some() || args.labels || args.raw || args.hold || args.biplane.is_some();
        if !spec.wants(View::Fluoro) && of_fluoro {
            let text = "--dicom, --labels, --raw, --hold and --biplane belong to fluoroscopy: use --view fluoro or --view both";
            return Err(Failure::Input(text.to_owned()));
        }
        let second = args.biplane.map(|turn_deg| SecondPlane::new(&spec, turn_deg, &wall));
        let second = second.transpose().map_err(|e| Failure::from(e).at("--biplane"))?;
        std::fs::create_dir_all(&folder).map_err(|e| {
            Failure::Input(format!("--out {}: {e}; name a folder that can be made", folder.display()))
        })?;
        let begun = Manifest::begin(&folder, command);
        let (manifest, replaced) = begun.map_err(|e| Failure::write(&folder, &e))?;
        if replaced > 0 {
            tell(format_args!(
                "endowire: replaces {replaced} files of an earlier endowire {command} in {}",
                folder.display()
            ));
        }
        Ok(Self {
            args,
            spec,
            wall,
            pushed,
            renderer,
            second,
            folder,
            frames,
            drawn: 0,
            animation: None,
            series: vec![],
            manifest,
            files: vec![],
        })
    }

    /// Frames a second.
    pub(super) fn frames_per_s(&self) -> f64 {
        self.spec.frames_per_s
    }

    /// Lets medium flow beside that of the scene, before the first frame is drawn.
    pub(super) fn inject(
        &mut self,
        injections: impl IntoIterator<Item = InjectionSpec>,
    ) -> Result<(), Failure> {
        let known = self.spec.injection.len();
        self.spec.injection.extend(injections);
        if self.spec.injection.len() == known || !self.spec.wants(View::Fluoro) {
            return Ok(());
        }
        self.renderer = Renderer::of_wall(&self.spec, &self.wall)?;
        let second = self.args.biplane.map(|turn_deg| SecondPlane::new(&self.spec, turn_deg, &self.wall));
        self.second = second.transpose()?;
        Ok(())
    }

    /// Draws a moment and writes what is wanted of it.
    pub(super) fn draw(&mut self, still: &Still) -> Result<(), Failure> {
        if let (Some(orbit), true) = (self.args.orbit, self.spec.wants(View::ThreeD)) {
            let mut spec = ViewSpec { views: vec![View::ThreeD], ..self.spec.clone() };
            let part = self.drawn as f64 / self.frames.max(2).saturating_sub(1) as f64;
            (spec.camera.turn_deg, spec.camera.orbit_deg) = (orbit * part, Some(orbit));
            let views = self.pushed.views(still.shape, still.inserted_mm);
            let mut orbiting = Renderer::of_wall(&spec, &self.wall)?;
            orbiting.show_contacts(still.contacts);
            let three_d = orbiting.render_at(&views, still.moment)?.three_d;
            let fluoro = match self.spec.wants(View::Fluoro) {
                true => self.renderer.render_at(&views, still.moment)?.fluoro,
                false => None,
            };
            return self.write(still, &Frames { three_d, fluoro });
        }
        let views = self.pushed.views(still.shape, still.inserted_mm);
        self.renderer.show_contacts(still.contacts);
        let frames = self.renderer.render_at(&views, still.moment)?;
        self.write(still, &frames)
    }

    fn write(&mut self, still: &Still, frames: &Frames) -> Result<(), Failure> {
        self.drawn += 1;
        let views = self.pushed.views(still.shape, still.inserted_mm);
        let second = match &mut self.second {
            Some(second) => second.renderer.render_at(&views, still.moment)?.fluoro,
            None => None,
        };
        if let Some(image) = second {
            let path = self.file(&format!("{}_fluoro_b.png", still.name))?;
            image.write_png(&path)?;
            if let (Some(second), true) = (&mut self.second, self.args.dicom.is_some()) {
                second.series.push(image);
            }
        }
        for (view, image) in [("3d", &frames.three_d), ("fluoro", &frames.fluoro)] {
            if let Some(image) = image {
                let path = self.file(&format!("{}_{view}.png", still.name))?;
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
            (&self.args.animate, both.as_ref().or(frames.three_d.as_ref()).or(frames.fluoro.as_ref()))
        {
            let mut animation = match self.animation.take() {
                Some(animation) => animation,
                None => Animation::new(path, shown, self.frames as u32, self.spec.frames_per_s)?,
            };
            animation.push(shown)?;
            self.animation = Some(animation);
        }
        if let (Some(image), true) = (&frames.fluoro, self.args.dicom.is_some()) {
            self.series.push(image.clone());
        }
        if self.args.labels || self.args.raw {
            self.write_data(still)?;
        }
        Ok(())
    }

    /// Labels and arrays.
    fn write_data(&mut self, still: &Still) -> Result<(), Failure> {
        let device = self.pushed.views(still.shape, still.inserted_mm);
        if self.args.labels {
            let contacts: Vec<_> = still.contacts.iter().map(|c| c.position_mm).collect();
            let labels = self.renderer.labels(&device, &contacts)?;
            let path = self.file(&format!("{}_mask.png", still.name))?;
            labels.mask.write_png(&path)?;
            for (name, mask) in masks(&labels) {
                let path = self.file(&format!("{}_{name}.png", still.name))?;
                mask.image().write_png(&path)?;
            }
            let path = self.file(&format!("{}_labels.json", still.name))?;
            std::fs::write(&path, to_json(&labels)? + "\n").map_err(|e| Failure::write(&path, &e))?;
        }
        if self.args.raw {
            let paths = self.renderer.path_lengths_at(&device, still.moment.time_s)?;
            let line: Vec<f32> = self.renderer.transmission(&paths)?.iter().map(|t| -t.ln()).collect();
            let mut maps = vec![("line_integral".to_owned(), &line)];
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
            for (name, map) in maps {
                let path = self.file(&format!("{}_{name}.npy", still.name))?;
                write_map(&path, paths.width as usize, map).map_err(|e| Failure::write(&path, &e))?;
            }
        }
        Ok(())
    }

    /// A file of the folder, noted.
    fn file(&mut self, name: &str) -> Result<PathBuf, Failure> {
        self.manifest.add(name).map_err(|e| Failure::write(&self.folder, &e))?;
        self.files.push(name.into());
        Ok(self.folder.join(name))
    }

    /// Ends animation and series.
    pub(super) fn finish(mut self) -> Result<Written, Failure> {
        if let (Some(animation), Some(path)) = (self.animation.take(), &self.args.animate) {
            animation.finish()?;
            self.files.push(path.clone());
        }
        if let (Some(image), true) = (self.renderer.last_image_hold(), self.args.hold) {
            let path = self.file("hold.png")?;
            image.write_png(&path)?;
        }
        if let (Some(path), Some(c_arm)) = (&self.args.dicom, self.renderer.c_arm()) {
            let first = angiogram(c_arm, &self.spec);
            let second = self.second.as_ref().and_then(|s| Some((s, s.renderer.c_arm()?)));
            self.files.push(path.clone());
            match second {
                None => first.write(path, &self.series)?,
                Some((plane, c_arm)) => {
                    let other = beside(path);
                    let planes = [&first, &angiogram(c_arm, &self.spec)];
                    Angiogram::write_biplane(planes, [path, &other], [&self.series, &plane.series])?;
                    self.files.push(other);
                }
            }
        }
        Ok(Written { renderer: self.renderer.backend().to_owned(), folder: self.folder, files: self.files })
    }
}

/// What a DICOM file says of the frames of a plane.
fn angiogram<'a>(c_arm: &'a CArm, spec: &ViewSpec) -> Angiogram<'a> {
    Angiogram {
        c_arm,
        kvp: spec.xray.kvp,
        frames_per_s: spec.frames_per_s,
        mode: spec.xray.mode,
        contrast: !spec.injection.is_empty() || spec.xray.contrast_fraction > 0.0,
        description: "endowire",
    }
}

/// The file of the second plane: `run.dcm` has `run_b.dcm` beside it.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push("_b");
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Masks of a frame: the vessel, each of several instruments, and each part of one.
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

/// A `[view]` table with the wishes of the command line.
fn wished(mut spec: ViewSpec, args: &FrameArgs, default: ViewChoice) -> Result<ViewSpec, Failure> {
    let choice = args.view.or(spec.views.is_empty().then_some(default));
    if let Some(choice) = choice {
        spec.views = match choice {
            ViewChoice::ThreeD => vec![View::ThreeD],
            ViewChoice::Fluoro => vec![View::Fluoro],
            ViewChoice::Both => vec![View::ThreeD, View::Fluoro],
        };
    }
    if let Some(pose) = args.pose {
        (spec.c_arm.primary_deg, spec.c_arm.secondary_deg) = (0.0, 0.0);
        spec.c_arm.pose = Some(pose);
    }
    spec.xray.mode = args.mode.unwrap_or(spec.xray.mode);
    spec.bits = args.bits.unwrap_or(spec.bits);
    match args.size.as_deref() {
        None => {}
        Some([side]) => spec.size_px = [*side, *side],
        Some([width, height]) => spec.size_px = [*width, *height],
        Some(other) => return Err(Failure::Input(format!("--size {other:?}: give WIDTH or WIDTHxHEIGHT"))),
    }
    if args.set.is_empty() {
        return Ok(spec);
    }
    let failed = |text: String| Failure::Input(format!("--set: {text}"));
    let mut table = serde_json::to_value(&spec).map_err(|e| failed(e.to_string()))?;
    for set in &args.set {
        let (key, value) = set.split_once('=').ok_or_else(|| failed(format!("{set}: say KEY=VALUE")))?;
        // The document that the table is kept in has no such numbers, and no key takes them.
        if value.trim().parse::<f64>().is_ok_and(|v| !v.is_finite()) {
            return Err(failed(format!("view.{} = {}: must be a finite number", key.trim(), value.trim())));
        }
        let value = serde_json::from_str(value).unwrap_or_else(|_| Value::from(value));
        let mut place = &mut table;
        for part in key.trim().split('.') {
            if place.is_null() {
                *place = Value::Object(serde_json::Map::new());
            }
            let Value::Object(members) = place else {
                return Err(failed(format!("{key}: there is nothing inside {part}'s parent")));
            };
            place = members.entry(part).or_insert(Value::Null);
        }
        *place = value;
        // One by one, so that the message names the one at fault.
        serde_json::from_value::<ViewSpec>(table.clone()).map_err(|e| failed(format!("{set}: {e}")))?;
    }
    serde_json::from_value(table).map_err(|e| failed(e.to_string()))
}
