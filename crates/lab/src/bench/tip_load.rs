//! Tip load: the force with which a tip that sticks out of a holder resists a surface that is pressed against it.

use std::f64::consts::PI;

use endowire_core::device::Device;
use endowire_core::insertion::{Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{
    CentrelineNode, CentrelineTree, MotionMode, Resolution, SweptVessel, VesselMotion, Waveform,
};
use endowire_core::{Error, Result, Vec3};
use serde::Serialize;

use super::push::advance;
use super::{NEWTONS_PER_GRAM_FORCE, check_friction, check_positive};

/// The surface is the inside of a tube so wide that it is flat: over a centimetre it deviates from a plane by 0.05 mm
/// across the tube, by nothing along it. Radius and length, mm.
const SURFACE_RADIUS_MM: f64 = 1000.0;
const SURFACE_LENGTH_MM: f64 = 4000.0;
const SURFACE_POINTS: usize = 40;
/// Foundation modulus of the surface, N/mm²: rigid for any tip.
const MODULUS_N_PER_MM2: f64 = 1e3;
/// Elements of the free length.
const ELEMENTS: f64 = 24.0;
/// Number of points per free length at which the foremost point of a shaped tip is looked for.
const FOREMOST: f64 = 400.0;
/// Stroke, as a part of the free length, at which a straight tip's buckling load is read: the force has then risen by
/// 0.05 % after it.
const BUCKLED: f64 = 1e-3;
/// Drop of the force after its first maximum, relative to it, from which the tip has given way.
const GIVES_WAY: f64 = 1e-3;

/// Settings of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipLoadTest {
    /// Length between holder and tip, mm.
    pub free_length_mm: f64,
    /// How far the surface is moved towards the holder from where it touches, mm.
    pub stroke_mm: f64,
    /// Coefficient of friction of the surface. Without friction the tip slides away freely; a tip that is exactly
    /// straight and held by friction carries up to eight times as much.
    pub friction: f64,
    /// Number of readings.
    pub readings: usize,
}

impl Default for TipLoadTest {
    fn default() -> Self {
        Self { free_length_mm: 10.0, stroke_mm: 2.0, friction: 0.0, readings: 40 }
    }
}

/// A reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TipLoadPoint {
    /// Stroke of the surface from where it touches, mm.
    pub stroke_mm: f64,
    /// Force on the surface, N.
    pub force_n: f64,
    /// How far the tip has moved sideways, mm.
    pub sideways_mm: f64,
}

/// Result of the test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TipLoad {
    /// The readings, from no stroke on.
    pub points: Vec<TipLoadPoint>,
    /// Force at which the free length buckles, N, if it is straight; `None` for a shaped one, which bends from the
    /// beginning.
    pub buckling_n: Option<f64>,
    /// Tip load: the largest force within the stroke, N.
    pub tip_load_n: f64,
    /// The same in grams-force.
    pub tip_load_gf: f64,
    /// Stroke at the largest force, mm.
    pub at_stroke_mm: f64,
    /// Stroke from which the tip has given way: the force has fallen. `None` if it rises throughout.
    pub gives_way_mm: Option<f64>,
    /// Readings that are no equilibrium.
    pub unconverged: usize,
    /// Why the test ended early; `None` if it did not.
    pub ended: Option<String>,
}

impl TipLoadTest {
    /// Presses the surface against the tip of `device`.
    ///
    /// # Errors
    /// Settings out of range, and a device shorter than the free length.
    pub fn run(&self, device: &Device) -> Result<TipLoad> {
        self.check(device)?;
        let mut simulation = self.simulation(device)?;
        let out = advance(&mut simulation, self.free_length_mm, self.free_length_mm / 4.0, |_| ());
        out.map_err(Error::Computation)?;
        let rest_mm = tip_mm(&simulation);
        let mut points = vec![TipLoadPoint { stroke_mm: 0.0, force_n: 0.0, sideways_mm: 0.0 }];
        let (mut unconverged, mut ended) = (0, None);
        let buckled = BUCKLED * self.free_length_mm / self.stroke_mm;
        let even = (1..=self.readings).map(|reading| reading as f64 / self.readings as f64);
        for part in std::iter::once(buckled).chain(even.skip_while(|part| *part <= buckled)) {
            if let Err(error) = simulation.step_until(&[], Some(time_s(part))) {
                ended = Some(error.to_string());
                break;
            }
            unconverged += usize::from(simulation.report().has_failed());
            let contacts = simulation.report().contacts.iter();
            let moved_mm = tip_mm(&simulation) - rest_mm;
            points.push(TipLoadPoint {
                stroke_mm: self.stroke_mm * part,
                force_n: -contacts.map(|contact| contact.total_n().x).sum::<f64>(),
                sideways_mm: libm::hypot(moved_mm.y, moved_mm.z),
            });
        }
        let is_straight =
            device.rest_shape(self.free_length_mm, self.free_length_mm).tangents.iter().all(|t| t.z == 1.0);
        let buckling_n = points.get(1).filter(|_| is_straight).map(|point| point.force_n);
        Ok(TipLoad { buckling_n, unconverged, ended, ..TipLoad::of(points) })
    }

    fn check(&self, device: &Device) -> Result<()> {
        check_friction(self.friction)?;
        check_positive("free_length_mm", self.free_length_mm, 200.0, "mm")?;
        check_positive(
            "stroke_mm",
            self.stroke_mm,
            0.5 * self.free_length_mm,
            "mm, half of the free length",
        )?;
        if self.stroke_mm <= BUCKLED * self.free_length_mm {
            let remedy = format!(
                "must be above {} mm, a thousandth of the free length",
                BUCKLED * self.free_length_mm
            );
            return Err(Error::parameter("stroke_mm", self.stroke_mm, remedy));
        }
        if !(1..=10_000).contains(&self.readings) {
            return Err(Error::parameter("readings", self.readings, "must be 1 to 10000"));
        }
        if device.length_mm() <= self.free_length_mm {
            let remedy = format!("must be less than the length of the device, {} mm", device.length_mm());
            return Err(Error::parameter("free_length_mm", self.free_length_mm, remedy));
        }
        Ok(())
    }

    /// The device in its holder, which points along +x at the surface.
    fn simulation(&self, device: &Device) -> Result<Simulation> {
        let motion = MotionMode {
            waveform: Waveform::Breathing,
            period_s: Some(PERIOD_S),
            phase: 0.0,
            displacement_mm: [-self.stroke_mm, 0.0, 0.0],
            turn: None,
            still: None,
            within: None,
        };
        let shape = device.rest_shape(self.free_length_mm, self.free_length_mm / FOREMOST);
        let foremost = |(from_tip_mm, p): (&f64, &Vec3)| p.z + device.section_at(*from_tip_mm).radius_mm;
        let reach_mm = shape.from_tip_mm.iter().zip(&shape.positions_mm).map(foremost).fold(0.0, f64::max);
        let holder = Vec3::new(SURFACE_RADIUS_MM - reach_mm, 0.0, 0.0);
        // Shaped tips bend along the tube, in which the surface is flat.
        let sheath = Sheath::new(holder, Vec3::x())?.bending_towards(Vec3::z())?;
        let properties = WallProperties {
            modulus_n_per_mm2: MODULUS_N_PER_MM2,
            friction: self.friction,
            ..WallProperties::default()
        };
        let method = KirchhoffOptions {
            element_mm: self.free_length_mm / ELEMENTS,
            // The force of a bow that rolls along the surface passes from one point of contact to the next.
            contact_spacing_radii: 0.25,
            tolerance: 1e-8,
            ..KirchhoffOptions::default()
        };
        Simulation::builder(surface()?, device.clone(), sheath)
            .properties(properties)
            .motion(VesselMotion::new(&[motion])?)
            .method(&method)
            .build()
    }
}

/// Period of the surface's motion, s; nothing depends on it.
const PERIOD_S: f64 = 2.0;

/// Time at which the surface has made this part of its stroke, by the waveform sin⁴(π t/period).
fn time_s(part: f64) -> f64 {
    libm::asin(part.sqrt().sqrt()) * PERIOD_S / PI
}

fn surface() -> Result<SweptVessel> {
    let node = |row: usize| CentrelineNode {
        position_mm: Vec3::z() * SURFACE_LENGTH_MM * (row as f64 / SURFACE_POINTS as f64 - 0.5),
        radius_mm: SURFACE_RADIUS_MM,
        parent: row.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..=SURFACE_POINTS).map(node).collect())?;
    let resolution = Resolution::fitting(&tree);
    SweptVessel::new(tree, resolution)
}

fn tip_mm(simulation: &Simulation) -> Vec3 {
    simulation.shape().tip_mm().unwrap_or_default()
}

impl TipLoad {
    fn of(points: Vec<TipLoadPoint>) -> Self {
        let largest = points.iter().max_by(|a, b| a.force_n.total_cmp(&b.force_n));
        let (at_stroke_mm, tip_load_n) = largest.map_or((0.0, 0.0), |p| (p.stroke_mm, p.force_n));
        let mut most_n = 0.0f64;
        let falls = points.iter().find(|point| {
            most_n = most_n.max(point.force_n);
            point.force_n < (1.0 - GIVES_WAY) * most_n
        });
        Self {
            buckling_n: None,
            gives_way_mm: falls.map(|point| point.stroke_mm),
            tip_load_n,
            tip_load_gf: tip_load_n / NEWTONS_PER_GRAM_FORCE,
            at_stroke_mm,
            unconverged: 0,
            ended: None,
            points,
        }
    }
}
