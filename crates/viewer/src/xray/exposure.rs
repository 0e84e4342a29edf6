//! Exposure control: voltage and current that give the wanted dose at the detector.
//!
//! The *thickness* T of a patient is that of soft tissue with the same attenuation in the measuring field, the middle
//! ninth of the image (`Anatomy::reference_mm`). A tube that emits N₀ photons per mm² and mAs at 1 m, of which a
//! fraction n(E) has the energy E behind its filters, gives the air kerma
//!
//! ```text
//! k(U, T) = N₀(U) (1 m / SID)² ∫ n(E) e^{−µ_tissue(E) T} E µ_en(E)/ρ dE     for each mAs
//! ```
//!
//! at the detector; losses in grid and table are neglected. The voltage U is that of the curve at T, in the steps of
//! 5 kV of the spectra; the current I = D / (k τ) then gives the dose D in a pulse of τ. If I exceeds the tube's
//! maximum, the voltage is raised stepwise until it does not, and lowered if I is below its minimum; at the last
//! voltage the current stays at its limit and the dose follows from it. So within the limits the dose is exact behind
//! T of tissue, and in the measuring field as accurate as its median represents the mean.
//!
//! The *entrance* kerma is that at the patient entrance reference point, 150 mm before the isocentre (IEC 60601-2-43),
//! in free air: k(U, 0) / k(U, T) of the dose at the detector, by the inverse square of the distances.
//!
//! N₀ is that of the anode table: SpekPy 2.5, model casim, 12 degrees, photons from 15 keV upwards.

use endowire_core::{Error, Result};
use serde::Serialize;

use super::spectrum::Spectrum;
use crate::material::Material;
use crate::spec::ViewSpec;

/// Photons per mm² and mAs at 1 m, in millions, from 50 to 125 kV in steps of 5.
const OUTPUT: [f64; 16] = [
    1.4202, 1.7007, 1.9877, 2.2794, 2.5749, 2.8829, 3.2033, 3.5354, 3.8658, 4.2082, 4.5494, 4.9052, 5.2574,
    5.6060, 5.9520, 6.2951,
];
const FIRST_KVP: f64 = 50.0;
const STEP_KVP: f64 = 5.0;

/// The exposure of an image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Exposure {
    /// Peak voltage, kV.
    pub kvp: f64,
    /// Air kerma at the detector behind the thickness, per frame.
    pub dose_ngy: f64,
    /// Air kerma at the patient entrance reference point, per frame.
    pub entrance_ngy: f64,
    /// Thickness of soft tissue with the patient's attenuation in the measuring field.
    pub tissue_mm: f64,
    /// Current and length of the pulse; absent without exposure control.
    pub pulse: Option<Pulse>,
}

/// Operation of the tube in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pulse {
    /// Current.
    pub current_ma: f64,
    /// Length.
    pub pulse_ms: f64,
}

impl Exposure {
    /// For a view behind this thickness of tissue.
    ///
    /// # Errors
    /// Values outside the tables.
    pub(crate) fn new(spec: &ViewSpec, tissue_mm: f64) -> Result<Self> {
        let wanted_ngy = spec.detector.dose_ngy.unwrap_or_else(|| spec.xray.mode.dose_ngy());
        let Some(control) = &spec.exposure else {
            let kvp = spec.xray.kvp;
            let entrance_ngy = wanted_ngy * entrance(spec, kvp, tissue_mm)?;
            return Ok(Self { kvp, dose_ngy: wanted_ngy, entrance_ngy, tissue_mm, pulse: None });
        };
        let [least, most] = control.current_ma;
        let pulse_ms = spec.xray.pulse_ms;
        let mut step = ((on_curve(&control.curve, tissue_mm) - FIRST_KVP) / STEP_KVP).round() as usize;
        let mut ngy_per_ma = ngy_per_mas(spec, step, tissue_mm)? * pulse_ms / 1000.0;
        while wanted_ngy > most * ngy_per_ma && step + 1 < OUTPUT.len() {
            step += 1;
            ngy_per_ma = ngy_per_mas(spec, step, tissue_mm)? * pulse_ms / 1000.0;
        }
        while wanted_ngy < least * ngy_per_ma && step > 0 {
            let lower = ngy_per_mas(spec, step - 1, tissue_mm)? * pulse_ms / 1000.0;
            if wanted_ngy > most * lower {
                break;
            }
            (step, ngy_per_ma) = (step - 1, lower);
        }
        let current_ma = (wanted_ngy / ngy_per_ma).clamp(least, most);
        let dose_ngy = current_ma * ngy_per_ma;
        Ok(Self {
            kvp: kvp(step),
            dose_ngy,
            entrance_ngy: dose_ngy * entrance(spec, kvp(step), tissue_mm)?,
            tissue_mm,
            pulse: Some(Pulse { current_ma, pulse_ms }),
        })
    }
}

impl Exposure {
    /// The same at this multiple of the tube's output.
    pub(crate) fn times(&self, gain: f64) -> Self {
        let pulse = self.pulse.map(|pulse| Pulse { current_ma: pulse.current_ma * gain, ..pulse });
        Self { dose_ngy: self.dose_ngy * gain, entrance_ngy: self.entrance_ngy * gain, pulse, ..*self }
    }
}

fn kvp(step: usize) -> f64 {
    FIRST_KVP + STEP_KVP * step as f64
}

/// Linear between the points, constant beyond; they have been checked.
fn on_curve(curve: &[[f64; 2]], at: f64) -> f64 {
    let after = curve.partition_point(|point| point[0] <= at);
    match (after.checked_sub(1).map(|before| curve[before]), curve.get(after)) {
        (Some([x, y]), Some([x1, y1])) => y + (y1 - y) * (at - x) / (x1 - x),
        (Some([_, y]), None) | (None, Some(&[_, y])) => y,
        (None, None) => FIRST_KVP,
    }
}

/// Air kerma at the detector per mAs for a voltage.
fn ngy_per_mas(spec: &ViewSpec, step: usize, tissue_mm: f64) -> Result<f64> {
    let (tube, through) = Spectrum::filtered(kvp(step), spec.xray.aluminium_mm, spec.xray.copper_mm)?;
    let tissue = |e| Material::SoftTissue.attenuation_per_mm(e).unwrap_or(0.0) * tissue_mm;
    let photons_per_mm2 = 1e6 * OUTPUT[step] * through * (1000.0 / spec.c_arm.sid_mm).powi(2);
    Ok(photons_per_mm2 * tube.behind(tissue).kerma_ngy())
}

/// Air kerma at the entrance reference point over that at the detector.
fn entrance(spec: &ViewSpec, kvp: f64, tissue_mm: f64) -> Result<f64> {
    let farther = (spec.c_arm.sid_mm / spec.c_arm.reference_mm()).powi(2);
    if let Some(energy) = spec.xray.energy_kev {
        return Ok(farther * libm::exp(Material::SoftTissue.attenuation_per_mm(energy)? * tissue_mm));
    }
    let (tube, _) = Spectrum::filtered(kvp, spec.xray.aluminium_mm, spec.xray.copper_mm)?;
    let behind = tube.behind(|e| Material::SoftTissue.attenuation_per_mm(e).unwrap_or(0.0) * tissue_mm);
    Ok(farther * tube.kerma_ngy() / behind.kerma_ngy())
}

/// Checks what exposure control requires.
pub(crate) fn check(spec: &ViewSpec) -> Result<()> {
    if spec.exposure.is_none() {
        return Ok(());
    }
    if let Some(energy) = spec.xray.energy_kev {
        let remedy = "one energy has no voltage that [view.exposure] could choose: leave out one of them";
        return Err(Error::parameter("view.xray.energy_kev", energy, remedy));
    }
    if spec.xray.pulse_ms <= 0.0 {
        let remedy = "[view.exposure] needs the length of a pulse: give 3 to 20 ms for fluoroscopy and cine, up to 100 for subtraction";
        return Err(Error::parameter("view.xray.pulse_ms", spec.xray.pulse_ms, remedy));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::{ExposureSpec, Mode};

    fn view(mode: Mode) -> ViewSpec {
        let mut view = ViewSpec { exposure: Some(ExposureSpec::default()), ..ViewSpec::default() };
        (view.xray.mode, view.xray.pulse_ms) = (mode, 8.0);
        view
    }

    /// Reference: SpekPy 2.5 in bins of 0.1 keV with NIST's air, 2.5 mm of aluminium and 0.2 mm of copper at 1 m:
    /// 25.10 µGy/mAs at 80 kV.
    #[test]
    fn a_tube_gives_as_much_as_another_program_says() {
        let mut view = view(Mode::Fluoro);
        view.c_arm.sid_mm = 1000.0;
        let ugy = |view: &ViewSpec| ngy_per_mas(view, 6, 0.0).unwrap() / 1000.0;
        assert!((ugy(&view) / 25.10 - 1.0).abs() < 0.01, "{}", ugy(&view));
        // Counter-check: ten centimetres farther away.
        view.c_arm.sid_mm = 1100.0;
        assert!((ugy(&view) * 1.21 / 25.10 - 1.0).abs() < 0.01 && (ugy(&view) / 25.10 - 1.0).abs() > 0.1);
    }

    #[test]
    fn voltage_follows_the_curve_and_the_current_brings_the_dose() {
        let expected =
            [(50.0, 60.0), (100.0, 60.0), (160.0, 70.0), (205.0, 80.0), (250.0, 90.0), (300.0, 100.0)];
        let mut before = 0.0;
        for (tissue_mm, kvp) in expected {
            let exposure = Exposure::new(&view(Mode::Cine), tissue_mm).unwrap();
            let pulse = exposure.pulse.unwrap();
            assert_eq!(
                (exposure.kvp, exposure.dose_ngy.round()),
                (kvp, 300.0),
                "{tissue_mm} mm: {exposure:?}"
            );
            assert!(pulse.current_ma > before, "more of it for more tissue: {exposure:?}");
            before = pulse.current_ma;
        }
        // Without control nothing changes.
        let fixed = ViewSpec { exposure: None, ..view(Mode::Cine) };
        let exposure = Exposure::new(&fixed, 300.0).unwrap();
        assert_eq!((exposure.kvp, exposure.dose_ngy, exposure.pulse), (80.0, 300.0, None));
    }

    #[test]
    fn the_entrance_kerma_is_what_the_tube_gives_there() {
        // 600 mm from the source, without a patient, by the same current.
        let exposure = Exposure::new(&view(Mode::Cine), 200.0).unwrap();
        let pulse = exposure.pulse.unwrap();
        let mas = pulse.current_ma * pulse.pulse_ms / 1000.0;
        let mut free = view(Mode::Cine);
        free.c_arm.sid_mm = 600.0;
        let step = ((exposure.kvp - FIRST_KVP) / STEP_KVP).round() as usize;
        let expected = mas * ngy_per_mas(&free, step, 0.0).unwrap();
        assert!((exposure.entrance_ngy / expected - 1.0).abs() < 1e-9, "{exposure:?} {expected}");
        // A few hundred times as much as behind the patient, and as many without control at the same voltage.
        assert!((100.0..1000.0).contains(&(exposure.entrance_ngy / exposure.dose_ngy)), "{exposure:?}");
        let mut fixed = ViewSpec { exposure: None, ..view(Mode::Cine) };
        fixed.xray.kvp = exposure.kvp;
        let fixed = Exposure::new(&fixed, 200.0).unwrap();
        let share = |of: &Exposure| of.entrance_ngy / of.dose_ngy;
        assert!((share(&fixed) / share(&exposure) - 1.0).abs() < 1e-9, "{fixed:?} {exposure:?}");
        // Of one energy by its attenuation alone.
        let mut one = ViewSpec { exposure: None, ..view(Mode::Cine) };
        one.xray.energy_kev = Some(60.0);
        let mu = Material::SoftTissue.attenuation_per_mm(60.0).unwrap();
        let ratio = (one.c_arm.sid_mm / 600.0).powi(2) * (200.0 * mu).exp();
        let found = Exposure::new(&one, 200.0).unwrap();
        assert!((found.entrance_ngy / found.dose_ngy / ratio - 1.0).abs() < 1e-9);
    }

    #[test]
    fn at_its_limits_a_tube_first_changes_the_voltage_and_then_the_dose() {
        let of = |tissue_mm: f64, current_ma: [f64; 2]| {
            let mut view = view(Mode::Cine);
            view.exposure = Some(ExposureSpec { current_ma, ..ExposureSpec::default() });
            Exposure::new(&view, tissue_mm).unwrap()
        };
        let free = of(250.0, [0.01, 5000.0]);
        let most = free.pulse.unwrap().current_ma;
        let higher = of(250.0, [0.01, 0.7 * most]);
        assert!(higher.kvp > free.kvp && (higher.dose_ngy - 300.0).abs() < 1e-9, "{higher:?}");
        let too_weak = of(250.0, [0.01, 0.1 * most]);
        assert!(too_weak.kvp == 125.0 && too_weak.dose_ngy < 200.0, "{too_weak:?}");
        let lower = of(250.0, [1.3 * most, 5000.0]);
        assert!(lower.kvp < free.kvp && (lower.dose_ngy - 300.0).abs() < 1e-9, "{lower:?}");
        let too_strong = of(10.0, [1000.0, 5000.0]);
        assert!(too_strong.kvp == 50.0 && too_strong.dose_ngy > 400.0, "{too_strong:?}");
    }

    #[test]
    fn what_no_tube_can_do_is_refused_by_key_and_remedy() {
        let mut cases = vec![];
        let mut case = |change: &dyn Fn(&mut ViewSpec), words: &'static str| {
            let mut view = view(Mode::Fluoro);
            change(&mut view);
            cases.push((view, words));
        };
        case(&|v| v.xray.pulse_ms = 0.0, "view.xray.pulse_ms = 0: [view.exposure] needs the length");
        case(&|v| v.xray.energy_kev = Some(60.0), "view.xray.energy_kev = 60: one energy has no voltage");
        case(&|v| v.xray.pulse_ms = 80.0, "view.xray.pulse_ms = 80: must be a number from 0 to 66.7");
        case(&|v| v.exposure.as_mut().unwrap().curve.clear(), "view.exposure.curve = 0 pairs: give 1 to 100");
        case(&|v| v.exposure.as_mut().unwrap().curve[1][0] = 90.0, "thicknesses must rise");
        case(
            &|v| v.exposure.as_mut().unwrap().curve[1][1] = 200.0,
            "view.exposure.curve (kV) = 200: must be",
        );
        case(&|v| v.exposure.as_mut().unwrap().current_ma = [9.0, 8.0], "view.exposure.current_ma = [9, 8]");
        for (view, words) in cases {
            let error = view.validate().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        assert!(view(Mode::Fluoro).validate().is_ok());
    }
}
