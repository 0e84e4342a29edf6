//! The cath lab: C-arm, table, collimator, pedal, injector, camera.

use endowire_assess::{BeamMode, BeamState};
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Error, Result, Vec3};
use endowire_viewer::{CameraSpec, InjectionSpec, Mode, Pose, View, ViewSpec};

use crate::TICKS_PER_S;
use crate::meter::Delivered;

/// Fraction of the field that the vessel fills if the scene gives no field.
const FILL: f64 = 0.92;
/// Range of the magnification. Magnification modes of detectors cover fields from about 48 cm down to 11 cm.
const MAGNIFICATION: [f64; 2] = [0.5, 8.0];
/// The same of the 3D view, and how far its middle may go aside, in widths of the whole.
const CAMERA: [f64; 2] = [0.5, 20.0];
const MOST_SHIFT: f64 = 0.5;
/// Largest angles of a C-arm, degrees: LAO and RAO, cranial and caudal.
const MOST_LAO_DEG: f64 = 120.0;
const MOST_CRA_DEG: f64 = 60.0;
/// Longest motion of the table in one input, mm: longer than a patient.
const MOST_TABLE_MM: f64 = 10_000.0;
/// Smallest fraction of the field that the collimator leaves open.
const LEAST_SHARE: f64 = 0.1;
/// The same that a key leaves open.
pub(crate) const BLADES_IN: f64 = 0.2;
/// Frames per second, as in interventional fluoroscopy.
const FRAMES_PER_S: f64 = 30.0;
/// Number of energies that represent the spectrum unless the scene gives it: accurate to 10⁻⁴, at an eighth of the
/// cost.
const ENERGY_BINS: u32 = 8;
/// Largest number of injections kept in the pictures; earlier ones have been washed out.
const MOST_INJECTIONS: usize = 8;

/// The equipment around the patient, and the dose so far. Its configuration is called the room.
#[derive(Debug, Clone)]
pub struct Lab {
    fluoro: ViewSpec,
    three_d: ViewSpec,
    /// Fractions of the field that the collimator leaves open.
    open: [f64; 2],
    bounds_mm: [Vec3; 2],
    down: bool,
    /// Counters that change with `fluoro` and with `three_d`.
    revisions: [u64; 2],
    beam_ticks: u64,
    /// Dose in earlier configurations, and the number of ticks with the beam on in the current one.
    dose: Dose,
    room_ticks: u64,
    /// Exposure of the last frame that was measured, which may be of an earlier configuration.
    last_delivered: Option<Delivered>,
}

/// What tubes have given.
#[derive(Debug, Clone, Copy, Default)]
struct Dose {
    /// Air kerma at the detectors.
    detector_ngy: f64,
    /// Air kerma at the entrance reference points.
    entrance_ngy: f64,
    /// The same times the open area there.
    area_ngymm2: f64,
}

impl std::ops::Add for Dose {
    type Output = Self;

    fn add(self, more: Self) -> Self {
        Self {
            detector_ngy: self.detector_ngy + more.detector_ngy,
            entrance_ngy: self.entrance_ngy + more.entrance_ngy,
            area_ngymm2: self.area_ngymm2 + more.area_ngymm2,
        }
    }
}

impl Lab {
    /// The room of a scene, with a square picture of `side_px` pixels.
    ///
    /// # Errors
    /// As [`ViewSpec::validate`].
    pub(crate) fn new(spec: ViewSpec, side_px: u32, wall: &SurfaceMesh) -> Result<Self> {
        let (low, high) = wall.bounds_mm().ok_or_else(|| Error::Mesh("the wall has no vertices".into()))?;
        let mut fluoro = ViewSpec { views: vec![View::Fluoro], bits: 8, ..spec };
        let before_px = f64::from(fluoro.size_px[0].max(fluoro.size_px[1]));
        fluoro.size_px = [side_px; 2];
        fluoro.frames_per_s = FRAMES_PER_S;
        fluoro.xray.energy_bins = fluoro.xray.energy_bins.or(Some(ENERGY_BINS));
        let arm = &mut fluoro.c_arm;
        [arm.primary_deg, arm.secondary_deg] = arm.angles_deg();
        arm.pose = None;
        arm.isocentre_mm = arm.isocentre_mm.or(Some(((low + high) / 2.0).into()));
        // Fixed, because a detector's field does not change with the pose.
        let fitting_mm = (high - low).amax() / FILL * arm.sid_mm / arm.sod_mm;
        let field_mm = arm.field_mm.or(arm.pixel_mm.map(|pitch| pitch * before_px)).unwrap_or(fitting_mm);
        (arm.field_mm, arm.pixel_mm) = (Some(field_mm), None);
        let three_d = ViewSpec { views: vec![View::ThreeD], ..fluoro.clone() };
        let lab = Self {
            fluoro,
            three_d,
            open: [1.0; 2],
            bounds_mm: [low, high],
            down: false,
            revisions: [0; 2],
            beam_ticks: 0,
            dose: Dose::default(),
            room_ticks: 0,
            last_delivered: None,
        };
        lab.fluoro.planes().iter().try_for_each(ViewSpec::validate)?;
        Ok(lab)
    }

    /// Specification of the fluoroscopic view.
    pub fn fluoro(&self) -> &ViewSpec {
        &self.fluoro
    }

    /// Specification of the 3D view.
    pub fn three_d(&self) -> &ViewSpec {
        &self.three_d
    }

    /// Counters that change with [`Lab::fluoro`] and with [`Lab::three_d`].
    pub fn revisions(&self) -> [u64; 2] {
        self.revisions
    }

    /// Whether the beam is on.
    pub fn is_live(&self) -> bool {
        self.down
    }

    /// Beam-on time, s.
    pub fn beam_s(&self) -> f64 {
        self.beam_ticks as f64 / TICKS_PER_S
    }

    /// Air kerma at the detectors so far, µGy.
    pub fn dose_ugy(&self) -> f64 {
        (self.dose + self.room_dose()).detector_ngy / 1000.0
    }

    /// Air kerma at the entrance reference points so far, µGy; `None` before the beam was on.
    pub fn entrance_ugy(&self) -> Option<f64> {
        self.last_delivered.map(|_| (self.dose + self.room_dose()).entrance_ngy / 1000.0)
    }

    /// Kerma–area product so far, µGy·m².
    pub fn kerma_area_ugym2(&self) -> Option<f64> {
        self.last_delivered.map(|_| (self.dose + self.room_dose()).area_ngymm2 * 1e-9)
    }

    /// Peak voltage, kV: that of the scene until exposure control has chosen one.
    pub fn kvp(&self) -> f64 {
        self.delivered().map_or(self.fluoro.xray.kvp, |frame| frame.kvp)
    }

    /// Current in a pulse, mA.
    pub fn current_ma(&self) -> Option<f64> {
        self.delivered().and_then(|frame| frame.current_ma)
    }

    /// State of the beam from `time_s` on, for assessment.
    pub(crate) fn beam(&self, time_s: f64) -> BeamState {
        let [primary_deg, secondary_deg] = self.fluoro.c_arm.angles_deg();
        BeamState {
            time_s,
            on: self.down,
            frames_per_s: self.fluoro.frames_per_s,
            dose_ngy: self.frame_ngy(),
            field_mm2: self.open_mm2(),
            primary_deg,
            secondary_deg,
            entrance_ngy: self
                .last_delivered
                .map(|frame| self.frame_ngy() * frame.entrance_ngy / frame.frame_ngy),
            entrance_mm2: Some(self.open_mm2() * self.nearer()),
            mode: Some(match self.fluoro.xray.mode {
                Mode::Fluoro => BeamMode::Fluoro,
                Mode::Cine => BeamMode::Cine,
                Mode::Dsa => BeamMode::Dsa,
                Mode::Roadmap => BeamMode::Roadmap,
            }),
        }
    }

    /// Area at the entrance reference point over that at the detector.
    fn nearer(&self) -> f64 {
        let arm = &self.fluoro.c_arm;
        (arm.reference_mm() / arm.sid_mm).powi(2)
    }

    /// Open area at the detector, mm².
    fn open_mm2(&self) -> f64 {
        let arm = &self.fluoro.c_arm;
        let side_mm = arm.field_mm.unwrap_or(0.0) / arm.magnification;
        side_mm * side_mm * self.open[0] * self.open[1]
    }

    /// Dose in the current configuration. One that was not measured counts at the entrance as the one before.
    fn room_dose(&self) -> Dose {
        let detector_ngy = self.frame_ngy() * self.room_ticks as f64 * self.fluoro.frames_per_s / TICKS_PER_S;
        let entrance = self.last_delivered.map_or(0.0, |frame| frame.entrance_ngy / frame.frame_ngy);
        let entrance_ngy = detector_ngy * entrance;
        Dose { detector_ngy, entrance_ngy, area_ngymm2: entrance_ngy * self.open_mm2() * self.nearer() }
    }

    /// Air kerma at the detectors per frame, nGy.
    fn frame_ngy(&self) -> f64 {
        let spec = &self.fluoro;
        let wanted_ngy = || {
            let plane_ngy = spec.detector.dose_ngy.unwrap_or_else(|| spec.xray.mode.dose_ngy());
            plane_ngy * spec.planes().len() as f64
        };
        self.delivered().map_or_else(wanted_ngy, |frame| frame.frame_ngy)
    }

    /// Exposure of a frame in this configuration, once it is measured.
    fn delivered(&self) -> Option<Delivered> {
        self.last_delivered.filter(|frame| frame.revision == self.revisions[0])
    }

    /// Stores the exposure of a frame, if the frame was made in the current configuration.
    pub(crate) fn exposed(&mut self, delivered: Delivered) {
        if delivered.revision == self.revisions[0] {
            self.last_delivered = Some(delivered);
        }
    }

    /// Angles of the second plane, LAO and cranial positive; `None` for a single plane.
    pub fn second_deg(&self) -> Option<[f64; 2]> {
        let second = self.fluoro.biplane_deg.map(|turn_deg| self.fluoro.c_arm.turned(turn_deg));
        second.map(|second| second.angles_deg())
    }

    /// Magnification.
    pub fn magnification(&self) -> f64 {
        self.fluoro.c_arm.magnification
    }

    /// Width of the field of view at the isocentre, mm.
    pub fn field_mm(&self) -> f64 {
        let arm = &self.fluoro.c_arm;
        arm.field_mm.unwrap_or(0.0) / arm.magnification * arm.sod_mm / arm.sid_mm
    }

    /// Advances by one tick.
    pub(crate) fn tick(&mut self) {
        if self.down {
            self.beam_ticks += 1;
            self.room_ticks += 1;
        }
    }

    /// Presses the pedal, in a mode, or releases it.
    pub(crate) fn pedal(&mut self, down: bool, mode: Option<Mode>) -> Result<()> {
        let mode = mode.unwrap_or(self.fluoro.xray.mode);
        if mode == Mode::Roadmap && self.fluoro.injection.is_empty() {
            let remedy = "a roadmap shows an angiogram: inject contrast medium first";
            return Err(Error::parameter("mode", "roadmap", remedy));
        }
        // Each DSA run takes a new mask.
        if self.fluoro.xray.mode != mode || (mode == Mode::Dsa && down && !self.down) {
            self.change(|spec| spec.xray.mode = mode)?;
        }
        self.down = down;
        Ok(())
    }

    /// Injects `ml` from `time_s` on, at `at_mm` in the undisplaced vessel with this wall; returns the injection.
    pub(crate) fn inject(
        &mut self,
        wall: &Wall,
        (ml, ml_per_s): (f64, f64),
        at_mm: Vec3,
        time_s: f64,
    ) -> Result<InjectionSpec> {
        for (name, value) in [("ml", ml), ("ml_per_s", ml_per_s)] {
            if !(0.1..=100.0).contains(&value) {
                return Err(Error::parameter(name, value, "must be a number from 0.1 to 100"));
            }
        }
        self.fluoro.find_centreline(wall)?;
        let bolus = InjectionSpec {
            start_s: time_s,
            duration_s: ml / ml_per_s,
            rate_ml_per_s: ml_per_s,
            at_mm: Some(at_mm.into()),
            at_tip: false,
        };
        self.flow_again([].into_iter(), vec![bolus.clone()])?;
        Ok(bolus)
    }

    /// Removes undone injections from the pictures and adds others.
    pub(crate) fn flow_again<'a>(
        &mut self,
        undone: impl Iterator<Item = &'a InjectionSpec>,
        more: Vec<InjectionSpec>,
    ) -> Result<()> {
        let mut injection = self.fluoro.injection.clone();
        undone.for_each(|one| injection.retain(|other| other != one));
        if injection.len() == self.fluoro.injection.len() && more.is_empty() {
            return Ok(());
        }
        injection.extend(more);
        injection.drain(..injection.len().saturating_sub(MOST_INJECTIONS));
        self.change(|spec| {
            if spec.xray.mode == Mode::Roadmap && injection.is_empty() {
                // A roadmap without an angiogram would be empty.
                spec.xray.mode = Mode::Fluoro;
            }
            spec.injection = injection;
        })
    }

    pub(crate) fn pose(&mut self, pose: Pose) -> Result<()> {
        let angles_deg = [pose.primary_deg(), pose.secondary_deg()];
        for (angle_deg, most_deg) in angles_deg.into_iter().zip([MOST_LAO_DEG, MOST_CRA_DEG]) {
            if angle_deg.abs() > most_deg {
                let remedy = format!(
                    "is out of reach: give at most {MOST_LAO_DEG}° LAO or RAO, and {MOST_CRA_DEG}° CRA or CAU"
                );
                return Err(Error::parameter("pose", String::from(pose), remedy));
            }
        }
        self.angles(angles_deg)
    }

    pub(crate) fn turn_c_arm(&mut self, by_deg: [f64; 2]) -> Result<()> {
        turns(["lao_deg", "cra_deg"], by_deg)?;
        let [lao, cra] = self.fluoro.c_arm.angles_deg();
        self.angles([lao + by_deg[0], cra + by_deg[1]])
    }

    fn angles(&mut self, [lao, cra]: [f64; 2]) -> Result<()> {
        let lao = lao.clamp(-MOST_LAO_DEG, MOST_LAO_DEG);
        let cra = cra.clamp(-MOST_CRA_DEG, MOST_CRA_DEG);
        self.change(|spec| (spec.c_arm.primary_deg, spec.c_arm.secondary_deg) = (lao, cra))
    }

    /// Moves the centre of the field of view over the patient, within the bounds of the vessel, along the picture of
    /// the first or the second plane.
    ///
    /// # Errors
    /// A distance that is too large; the second plane where there is none.
    pub(crate) fn table(&mut self, [right_mm, down_mm]: [f64; 2], second: bool) -> Result<()> {
        within(["right_mm", "down_mm"], [right_mm, down_mm], MOST_TABLE_MM)?;
        let plane = if second { self.second_deg() } else { Some(self.fluoro.c_arm.angles_deg()) };
        let Some(angles_deg) = plane else {
            let remedy = "there is one plane alone: leave it out, or give view.biplane_deg in the scene";
            return Err(Error::parameter("second", true, remedy));
        };
        let [lao, cra] = angles_deg.map(f64::to_radians);
        let right = Vec3::new(lao.cos(), lao.sin(), 0.0);
        let detector = Vec3::new(lao.sin(), -lao.cos(), 0.0) * cra.cos() + Vec3::z() * cra.sin();
        let down = -detector.cross(&right);
        let before = self.fluoro.c_arm.isocentre_mm.map_or_else(Vec3::zeros, Vec3::from);
        let [low, high] = self.bounds_mm;
        let at = (before + right * right_mm + down * down_mm).sup(&low.inf(&before)).inf(&high.sup(&before));
        self.change(|spec| spec.c_arm.isocentre_mm = Some(at.into()))
    }

    pub(crate) fn zoom(&mut self, factor: f64) -> Result<()> {
        check_factor(factor)?;
        let magnification = (self.magnification() * factor).clamp(MAGNIFICATION[0], MAGNIFICATION[1]);
        let open = self.open;
        self.change(|spec| {
            spec.c_arm.magnification = magnification;
            collimate(spec, open);
        })
    }

    pub(crate) fn collimate(&mut self, open: [f64; 2]) -> Result<()> {
        for (name, share) in [("width", open[0]), ("height", open[1])] {
            if !(LEAST_SHARE..=1.0).contains(&share) {
                let remedy = format!("must be a share of the field from {LEAST_SHARE} to 1");
                return Err(Error::parameter(name, share, remedy));
            }
        }
        self.change(|spec| collimate(spec, open))?;
        self.open = open;
        Ok(())
    }

    /// Keys by which C-arm, magnification and blades go no further, and why.
    pub(crate) fn ends(&self) -> Vec<(&'static str, &'static str)> {
        let [lao, cra] = self.fluoro.c_arm.angles_deg();
        let (large, open) = (self.magnification(), self.open);
        let ends = [
            ("KeyJ", lao <= -MOST_LAO_DEG, "the C-arm goes no further"),
            ("KeyL", lao >= MOST_LAO_DEG, "the C-arm goes no further"),
            ("KeyO", cra >= MOST_CRA_DEG, "the C-arm goes no further"),
            ("KeyK", cra <= -MOST_CRA_DEG, "the C-arm goes no further"),
            ("Equal", large >= MAGNIFICATION[1], "the field is as small as it gets"),
            ("Minus", large <= MAGNIFICATION[0], "the field is as large as it gets"),
            ("KeyQ", open.iter().all(|share| *share <= BLADES_IN), "the blades go no further in"),
            ("KeyE", open == [1.0; 2], "the blades are out"),
        ];
        ends.into_iter().filter(|end| end.1).map(|(code, _, why)| (code, why)).collect()
    }

    /// Fractions of the field that the collimator leaves open.
    pub fn open(&self) -> [f64; 2] {
        self.open
    }

    pub(crate) fn turn_camera(&mut self, by_deg: [f64; 2]) -> Result<()> {
        turns(["azimuth_deg", "elevation_deg"], by_deg)?;
        let camera: &mut CameraSpec = &mut self.three_d.camera;
        let azimuth = camera.azimuth_deg.unwrap_or(25.0) + by_deg[0];
        camera.azimuth_deg = Some((azimuth + 180.0).rem_euclid(360.0) - 180.0);
        camera.elevation_deg = Some((camera.elevation_deg.unwrap_or(18.0) + by_deg[1]).clamp(-89.0, 89.0));
        self.revisions[1] += 1;
        Ok(())
    }

    pub(crate) fn zoom_camera(&mut self, factor: f64) -> Result<()> {
        check_factor(factor)?;
        let camera = &mut self.three_d.camera;
        camera.magnification = (camera.magnification * factor).clamp(CAMERA[0], CAMERA[1]);
        self.revisions[1] += 1;
        Ok(())
    }

    /// Moves the middle of the 3D view by shares of its width as it is seen.
    pub(crate) fn move_camera(&mut self, by: [f64; 2]) -> Result<()> {
        within(["right", "up"], by, 10.0)?;
        let camera = &mut self.three_d.camera;
        for (shift, by) in camera.shift.iter_mut().zip(by) {
            *shift = (*shift + by / camera.magnification).clamp(-MOST_SHIFT, MOST_SHIFT);
        }
        self.revisions[1] += 1;
        Ok(())
    }

    /// Draws pictures of this many pixels a side. The dose is that of the same room.
    pub(crate) fn show_at(&mut self, side_px: u32) -> Result<()> {
        let size_px = [side_px; 2];
        ViewSpec { size_px, ..self.fluoro.clone() }.validate()?;
        let before = self.revisions[0];
        (self.fluoro.size_px, self.three_d.size_px) = (size_px, size_px);
        self.revisions.iter_mut().for_each(|revision| *revision += 1);
        if let Some(frame) = self.last_delivered.as_mut().filter(|frame| frame.revision == before) {
            frame.revision = self.revisions[0];
        }
        Ok(())
    }

    /// Changes the fluoroscopic view if the result is valid.
    fn change(&mut self, with: impl FnOnce(&mut ViewSpec)) -> Result<()> {
        let mut spec = self.fluoro.clone();
        with(&mut spec);
        spec.planes().iter().try_for_each(ViewSpec::validate)?;
        self.dose = self.dose + self.room_dose();
        self.room_ticks = 0;
        self.fluoro = spec;
        self.revisions[0] += 1;
        Ok(())
    }
}

/// Sets the collimator at the detector; the fractions refer to the magnified field.
fn collimate(spec: &mut ViewSpec, open: [f64; 2]) {
    let seen_mm = spec.c_arm.field_mm.map(|field| field / spec.c_arm.magnification);
    spec.c_arm.collimation_mm =
        seen_mm.filter(|_| open != [1.0; 2]).map(|seen| open.map(|share| share * seen));
}

fn check_factor(factor: f64) -> Result<()> {
    match (0.1..=10.0).contains(&factor) {
        true => Ok(()),
        false => Err(Error::parameter("factor", factor, "must be a number from 0.1 to 10")),
    }
}

/// Refuses angles of more than a turn.
fn turns(names: [&str; 2], values_deg: [f64; 2]) -> Result<()> {
    within(names, values_deg, 360.0)
}

/// Refuses values that are not at most `most` in either direction.
fn within(names: [&str; 2], values: [f64; 2], most: f64) -> Result<()> {
    match names.into_iter().zip(values).find(|(_, value)| !(-most..=most).contains(value)) {
        None => Ok(()),
        Some((name, value)) => {
            Err(Error::parameter(name, value, format!("must be a number from -{most} to {most}")))
        }
    }
}
