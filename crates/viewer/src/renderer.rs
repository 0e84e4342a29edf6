//! From a scene to frames: chooses an engine, prepares the wanted views, draws.

#[cfg(feature = "gpu")]
mod later;
mod path_lengths;

use std::sync::Arc;

use endowire_core::vessel::{Displacement, SurfaceMesh, Wall};
use endowire_core::{Error, Result, Vec3};

use crate::c_arm::CArm;
use crate::cpu;
use crate::device::{DeviceView, RefinedDevice};
use crate::engine::{Engines, PathEngine};
use crate::fluoro::{Afterglow, Anatomy, Brightness, Fluoroscope, FrameTime, Kept, Sequence, labels};
use crate::gpu;
use crate::output::{Image, Labels};
use crate::scene::Setup;
use crate::spec::{Backend, CArmSpec, View, ViewSpec};
use crate::tails::Filled;
use crate::three_d::{ContactView, Solids, annotate, draw_markers};
use crate::xray::{Exposure, PathLengths};

/// The frames of one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frames {
    /// The 3D view, if wanted; 8-bit RGBA.
    pub three_d: Option<Image>,
    /// The fluoroscopic view, if wanted; 8-bit grey.
    pub fluoro: Option<Image>,
}

/// Draws the wanted views of devices in a vessel.
pub struct Renderer {
    setup: Setup,
    engines: Engines,
    /// Created with the first frame.
    fluoro: Option<(Fluoroscope, Sequence)>,
    /// Reusable data of the previous view.
    kept: Option<Kept>,
    /// Lengths of the central rays, computed when first needed.
    central: Option<Anatomy>,
    /// The last path lengths and their transmission.
    transmitted: Option<(PathLengths, Vec<f32>)>,
    contacts: Vec<ContactView>,
    is_cpu: bool,
    next_frame: u64,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("backend", &self.engines.name).finish_non_exhaustive()
    }
}

impl Renderer {
    /// Prepares the views of `spec`; data constant between frames are computed with the first one. The fluoroscopic
    /// view needs a **closed** wall with outward triangles (cap the openings); the 3D view shows any.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an invalid `spec`, a vessel that is not between source and detector, missing files,
    /// or `backend = gpu` without a suitable adapter; [`Error::Mesh`] for a wall that is open, wound inconsistently
    /// or inside out; [`Error::Content`] for an unusable centre line or tomogram.
    pub fn new(spec: &ViewSpec, wall: &SurfaceMesh) -> Result<Self> {
        Self::of_setup(Setup::new(spec, wall)?)
    }

    /// As [`Self::new`], for a wall with openings: the 3D view shows them closed, and in the beam contrast medium
    /// fades beyond them, as if vessels continued into invisibly fine branches. Contrast medium flows along a centre
    /// line computed from the wall if `spec` has none.
    ///
    /// # Errors
    /// As [`Self::new`], and a wall from which no centre line can be computed if one is needed.
    pub fn of_wall(spec: &ViewSpec, wall: &Wall) -> Result<Self> {
        let mut spec = spec.clone();
        if spec.wants(View::Fluoro) && !spec.injection.is_empty() {
            spec.find_centreline(wall)?;
        }
        let closed = Arc::new(wall.closed_mesh());
        Self::of_setup(Setup::filled(&spec, closed, Arc::new(Filled::with_tails(wall)))?)
    }

    fn of_setup(setup: Setup) -> Result<Self> {
        let (engines, is_cpu) = engines(&setup)?;
        Ok(Self {
            setup,
            engines,
            fluoro: None,
            kept: None,
            central: None,
            transmitted: None,
            contacts: vec![],
            is_cpu,
            next_frame: 0,
        })
    }

    /// Name of the engine for display: "CPU reference", or the graphics interface and adapter. Includes the reason if
    /// a wanted graphics processor is not used, and changes if the CPU takes over after an adapter was lost.
    pub fn backend(&self) -> &str {
        &self.engines.name
    }

    /// The C-arm of the fluoroscopic view, if wanted: projects points exactly like the frames.
    pub fn c_arm(&self) -> Option<&CArm> {
        self.setup.c_arm.as_ref()
    }

    /// Position of a point in the 3D view, pixels from the left and from the top; `None` without that view, and for
    /// points behind the camera.
    pub fn three_d_pixel(&self, point_mm: &Vec3) -> Option<[f64; 2]> {
        let camera = self.setup.camera.as_ref()?;
        let view = camera.in_view(point_mm);
        (view[2] < 0.0).then(|| camera.pixel_of(view, 1))
    }

    /// Fraction of the vessel's surface contained in the tomogram of its patient, 0 to 1; `None` without a tomogram,
    /// or fluoroscopy.
    pub fn vessel_held(&self) -> Option<f64> {
        self.setup.patient.vessel_held()
    }

    /// The specification of the renderer.
    pub fn spec(&self) -> &ViewSpec {
        &self.setup.spec
    }

    /// Draws the wanted views as the next frame at its time according to `frames_per_s`. Fluoroscopy omits parts of a
    /// device that are not between source and detector.
    ///
    /// # Errors
    /// As [`Self::render_at`].
    pub fn render(&mut self, devices: &[DeviceView]) -> Result<Frames> {
        self.render_at(devices, self.next_frame())
    }

    /// Number and time of the next frame, according to `frames_per_s`.
    pub fn next_frame(&self) -> FrameTime {
        let frame = self.next_frame;
        FrameTime { frame, time_s: frame as f64 / self.setup.spec.frames_per_s }
    }

    /// Draws the wanted views of a moment: its number seeds the noise, its time determines the contrast medium.
    ///
    /// In subtraction modes the first frame also takes the mask: the scene and the devices at that time, before any
    /// injection.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a device with values that are not finite, a time that is not finite, or a roadmap
    /// without an injection.
    pub fn render_at(&mut self, devices: &[DeviceView], moment: FrameTime) -> Result<Frames> {
        self.render_pulse(devices, &[], moment)
    }

    /// As [`Self::render_at`], with devices that move during exposure: fluoroscopy is the mean over the instants of
    /// `pulse` ([`crate::Pushed::pulse`]), or of `devices` if there are none; the 3D view shows `devices`.
    ///
    /// # Errors
    /// As [`Self::render_at`].
    pub fn render_pulse(
        &mut self,
        devices: &[DeviceView],
        pulse: &[Vec<DeviceView>],
        moment: FrameTime,
    ) -> Result<Frames> {
        if !moment.time_s.is_finite() {
            return Err(Error::parameter("time_s", moment.time_s, "must be finite"));
        }
        let in_beam = |views: &[DeviceView]| self.setup.in_beam(views);
        let pulse: Vec<_> = match pulse {
            [] => vec![in_beam(devices)?],
            instants => instants.iter().map(|views| in_beam(views)).collect::<Result<_>>()?,
        };
        let devices = RefinedDevice::all(devices)?;
        let contacts = std::mem::take(&mut self.contacts);
        let frames = self.with_fallback(|setup, engines, fluoro, kept| {
            let solids = Solids {
                devices: &devices,
                contacts: &contacts,
                scale_n: setup.spec.camera.force_n,
                c_arm: setup.shown_arm.as_ref(),
            };
            if engines.three_d.is_none() {
                engines.three_d = setup.camera.as_ref().map(|camera| cpu::three_d(camera, setup.wall_now()));
            }
            let mut three_d = engines.three_d.as_mut().map(|engine| engine.frame(&solids)).transpose()?;
            if let (Some(image), Some(camera)) = (&mut three_d, &setup.camera) {
                annotate(image, camera, &setup.spec.camera, &contacts);
            }
            let fluoro = match &setup.c_arm {
                Some(c_arm) => {
                    let (scope, sequence, paths) = prepared(setup, engines, fluoro, kept)?;
                    scope.breathe(setup, Some(moment.time_s), paths)?;
                    let mut image = sequence.next(scope, &pulse, moment)?;
                    if setup.spec.c_arm.markers {
                        draw_markers(&mut image, c_arm.right_and_up());
                    }
                    Some(image)
                }
                None => None,
            };
            Ok(Frames { three_d, fluoro })
        });
        self.contacts = contacts;
        let frames = frames?;
        self.next_frame = moment.frame + 1;
        Ok(frames)
    }

    /// Turns the C-arm within a run: the next frame is from another position, with subtraction of a mask taken there
    /// with it, or by [`Self::take_mask`], as in a run with the same motion. Body and flow are kept, and so is the
    /// detector's memory of the last frame.
    ///
    /// # Errors
    /// As [`Self::new`] for the position, and [`Error::Parameter`] without the fluoroscopic view. Then the C-arm does
    /// not move.
    pub fn turn_c_arm(&mut self, place: &CArmSpec) -> Result<()> {
        let spec = ViewSpec { c_arm: place.clone(), ..self.setup.spec.clone() };
        self.c_arm().ok_or_else(no_fluoro)?;
        let stored = self.show(&spec)?.map(Sequence::into_afterglow);
        self.go_on_from(stored)
    }

    /// A renderer of another view of the same vessel, sharing common data.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn beside(&self, spec: &ViewSpec) -> Result<Self> {
        Self::of_setup(self.setup.beside(spec)?.of_own_run())
    }

    /// Reports the tip position of the innermost instrument with a lumen at a moment that is not drawn, in the vessel
    /// at rest: medium injected `at_tip` follows the tip. Frames report it themselves; between moments its path is
    /// straight. If another position was reported for that moment, this and later reports are discarded.
    ///
    /// # Errors
    /// [`Error::Parameter`] for values that are not finite.
    pub fn follow_tip(&mut self, time_s: f64, place_mm: Vec3) -> Result<()> {
        for (name, value) in [("time_s", time_s), ("place_mm", place_mm.sum())] {
            if !value.is_finite() {
                return Err(Error::parameter(name, value, "must be finite"));
            }
        }
        if let Some(flow) = &self.setup.flow {
            flow.follow_tip(time_s, place_mm);
        }
        Ok(())
    }

    /// Draws another view of the same vessel from now on, like a new renderer, but keeps common data: if the C-arm
    /// has the same position, the lengths of its rays.
    ///
    /// # Errors
    /// As [`Self::new`]. Then the view is unchanged.
    pub fn change(&mut self, spec: &ViewSpec) -> Result<()> {
        self.show(spec).map(drop)
    }

    /// As [`Self::change`]; returns the memory of the detector and the masks of the previous view.
    fn show(&mut self, spec: &ViewSpec) -> Result<Option<Sequence>> {
        let setup = self.setup.beside(spec)?;
        let before = &self.setup.spec;
        let same =
            before.views == spec.views && before.size_px == spec.size_px && before.backend == spec.backend;
        // The camera is at a position where it sees the beam.
        let camera = !spec.wants(View::ThreeD) || (before.camera == spec.camera && !spec.camera.c_arm);
        let engines = if same && camera { None } else { Some(engines(&setup)?) };
        let (scope, sequence) = self.fluoro.take().unzip();
        let kept = scope.map(Fluoroscope::into_kept).or_else(|| self.kept.take());
        self.kept = kept.and_then(|kept| kept.between(&self.setup, &setup));
        self.setup = setup;
        (self.central, self.transmitted) = (None, None);
        if let Some(engines) = engines {
            (self.engines, self.is_cpu) = engines;
        }
        Ok(sequence)
    }

    /// Displaces the vessel, or returns it to rest. C-arm, camera and beam are unchanged, and masks are kept: a
    /// subtraction shows the displacement.
    ///
    /// # Errors
    /// As [`Self::render_at`].
    pub fn move_vessel(&mut self, displacement: Option<&Displacement>) -> Result<()> {
        if self.setup.displacement() == displacement {
            return Ok(());
        }
        self.setup.move_vessel(displacement);
        (self.kept, self.central, self.transmitted) = (None, None, None);
        if self.is_cpu {
            self.engines.forget_wall();
        } else if self.setup.camera.is_some() {
            (self.engines, self.is_cpu) = engines(&self.setup)?;
        }
        if self.fluoro.is_none() {
            return Ok(());
        }
        self.with_fallback(|setup, engines, fluoro, kept| {
            let (scope, _, paths) = prepared(setup, engines, fluoro, kept)?;
            scope.move_vessel(setup, paths)
        })
    }

    /// Computes data constant between frames now instead of with the first frame.
    ///
    /// # Errors
    /// As [`Self::render_at`].
    pub fn prepare(&mut self) -> Result<()> {
        match self.c_arm() {
            Some(_) => self.with_fallback(|setup, engines, fluoro, kept| {
                prepared(setup, engines, fluoro, kept).map(drop)
            }),
            None => Ok(()),
        }
    }

    /// Prepares the next frame of a detector with the memory of another position, if any.
    fn go_on_from(&mut self, stored: Option<Afterglow>) -> Result<()> {
        let Some(stored) = stored else { return Ok(()) };
        self.with_fallback(|setup, engines, fluoro, kept| {
            prepared(setup, engines, fluoro, kept)?.1.go_on_from(stored.clone());
            Ok(())
        })
    }

    /// Shows contacts and their forces in the 3D frames from now on.
    pub fn show_contacts(&mut self, contacts: &[ContactView]) {
        self.contacts.clear();
        self.contacts.extend_from_slice(contacts);
    }

    /// Retakes the mask of a subtraction: the scene with the current `devices`, before any injection.
    ///
    /// # Errors
    /// As [`Self::render_at`], and [`Error::Parameter`] without the fluoroscopic view.
    pub fn take_mask(&mut self, devices: &[DeviceView]) -> Result<()> {
        let devices = [self.setup.in_beam(devices)?];
        self.with_fallback(|setup, engines, fluoro, kept| {
            let (scope, sequence, _) = prepared(setup, engines, fluoro, kept)?;
            sequence.take_mask(scope, &devices)
        })
    }

    /// The exposure at which fluoroscopy settles; `None` before its first frame. Labels have that of their frame.
    pub fn exposure(&self) -> Option<Exposure> {
        self.fluoro.as_ref().map(|(scope, _)| scope.exposure)
    }

    /// State of the automatic brightness control (`xray.brightness_s`), for [`Self::brighten`]; `None` before the
    /// first frame, and where exposure is held.
    pub fn brightness(&self) -> Option<Brightness> {
        self.fluoro.as_ref()?.1.brightness()
    }

    /// Goes on from the brightness that another view of the same run had, or this one before it changed.
    ///
    /// # Errors
    /// As [`Self::prepare`].
    pub fn brighten(&mut self, state: Brightness) -> Result<()> {
        if self.c_arm().is_none() {
            return Ok(());
        }
        self.with_fallback(|setup, engines, fluoro, kept| {
            prepared(setup, engines, fluoro, kept)?.1.brighten(state);
            Ok(())
        })
    }

    /// The last image hold: a weighted mean of the last frames, the newest weighing most. `None` before the first
    /// frame.
    pub fn last_image_hold(&self) -> Option<Image> {
        let (scope, sequence) = self.fluoro.as_ref()?;
        sequence.hold(scope)
    }

    /// Mask and last frame of a subtraction as the detector read them, for [`crate::Angiogram::mask`]: 16 bits,
    /// proportional to the logarithm of the signal. `None` in other modes, and before the first frame.
    pub fn unsubtracted(&self) -> Option<[Image; 2]> {
        let (scope, sequence) = self.fluoro.as_ref()?;
        sequence.unsubtracted(scope)
    }

    /// Labels of a fluoroscopic frame of these devices, with contacts at the given positions.
    ///
    /// # Errors
    /// As [`Self::render_at`], and [`Error::Parameter`] without the fluoroscopic view.
    pub fn labels(&mut self, devices: &[DeviceView], contacts_mm: &[Vec3]) -> Result<Labels> {
        let of_scope = self.with_fallback(|setup, engines, fluoro, kept| {
            let (scope, sequence, _) = prepared(setup, engines, fluoro, kept)?;
            Ok((
                setup.lumen.then(|| scope.vessel(setup.wall_now(), &setup.filled_now().surface)),
                sequence.exposure(&scope.exposure),
            ))
        })?;
        let c_arm = self.setup.c_arm.as_ref().ok_or_else(no_fluoro)?;
        labels(&self.setup, c_arm, devices, contacts_mm, of_scope)
    }

    /// Runs `job`; if an adapter fails in it, switches to the CPU and runs it again.
    fn with_fallback<T>(
        &mut self,
        job: impl Fn(&Setup, &mut Engines, &mut Option<(Fluoroscope, Sequence)>, Option<&Kept>) -> Result<T>,
    ) -> Result<T> {
        if !self.is_cpu && self.engines.are_forked() {
            self.hand_over("it does not outlive a fork");
        }
        match job(&self.setup, &mut self.engines, &mut self.fluoro, self.kept.as_ref()) {
            Err(Error::Computation(reason)) if !self.is_cpu => {
                self.hand_over(&reason);
                job(&self.setup, &mut self.engines, &mut self.fluoro, self.kept.as_ref())
            }
            done => done,
        }
    }

    /// Switches to the CPU.
    fn hand_over(&mut self, reason: &str) {
        let mut engines = cpu::engines(self.setup.c_arm.is_some());
        engines.name = format!("{} ({} failed: {reason})", engines.name, self.engines.name);
        self.engines = engines;
        self.is_cpu = true;
    }
}

/// The engines for a set-up, and whether they are the CPU's.
fn engines(setup: &Setup) -> Result<(Engines, bool)> {
    let nothing = setup.c_arm.is_none() && setup.camera.is_none();
    let mut refused = None;
    let on_gpu = match setup.spec.backend {
        Backend::Cpu => None,
        _ if nothing => None,
        Backend::Auto => gpu::engines(setup, false).map_err(|reason| refused = Some(reason)).ok(),
        Backend::Gpu => Some(gpu::engines(setup, true).map_err(|reason| {
            Error::parameter("view.backend", "gpu", format!("{reason}; use \"auto\" or \"cpu\""))
        })?),
    };
    let is_cpu = on_gpu.is_none();
    let mut engines = on_gpu.unwrap_or_else(|| cpu::engines(setup.c_arm.is_some()));
    if let Some(reason) = refused {
        engines.name = format!("{} ({reason})", engines.name);
    }
    Ok((engines, is_cpu))
}

/// The fluoroscopic view, created if needed, and the engine for its rays.
fn prepared<'a>(
    setup: &Setup,
    engines: &'a mut Engines,
    fluoro: &'a mut Option<(Fluoroscope, Sequence)>,
    kept: Option<&Kept>,
) -> Result<(&'a mut Fluoroscope, &'a mut Sequence, &'a mut dyn PathEngine)> {
    let paths = engines.paths.as_mut().ok_or_else(no_fluoro)?.as_mut();
    let (scope, sequence) = match fluoro {
        Some(made) => made,
        none => {
            let c_arm = setup.c_arm.as_ref().ok_or_else(no_fluoro)?;
            let scope = Fluoroscope::new(setup, c_arm, kept, paths)?;
            let sequence = Sequence::new(&setup.spec, &scope);
            none.insert((scope, sequence))
        }
    };
    Ok((scope, sequence, paths))
}

fn no_fluoro() -> Error {
    Error::parameter("view.views", "without fluoro", "this belongs to the fluoroscopic view; add \"fluoro\"")
}

#[cfg(test)]
#[path = "renderer_tests.rs"]
mod tests;
