//! Data of the page of a run.

use endowire_core::device::{Device, Stack};
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
use endowire_core::{Result, Vec3};
use endowire_recording::StepRow;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::vessel::Vessel;

/// Largest number of nodes in all shapes together: a page of a few megabytes.
pub const MOST_NODES: usize = 120_000;

/// The document of the page.
#[derive(Debug, Serialize)]
pub struct Run {
    /// Content of `summary.json` of a recording, or part of it.
    pub summary: Value,
    /// Names of the instruments, innermost first.
    pub instruments: Vec<String>,
    /// The vessel.
    #[serde(flatten)]
    pub vessel: Vessel,
    /// Shapes, in order of steps; at least one.
    pub steps: Vec<Moment>,
    /// Numbers, in order of steps; the last step is that of the last shape.
    pub series: Series,
    /// Events.
    pub events: Vec<Event>,
    /// Pictures.
    pub frames: Vec<Frame>,
    /// Devices, friction and wall: names and values for people.
    pub setup: Vec<[String; 2]>,
    /// Other runs to compare it with.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<Run>,
}

/// Devices and wall of a run in words: what a comparison of runs is about.
///
/// # Errors
/// A device file that cannot be read.
pub fn setup<M: MethodChoice + DeserializeOwned + Default>(
    scene: &SceneOf<M>,
    stack: &Stack,
) -> Result<Vec<[String; 2]>> {
    let files = scene.device_files()?;
    let name = |index: usize| files.get(index).and_then(Option::as_ref).map(|(_, file)| file.name.as_str());
    let devices = stack.instruments().iter().enumerate();
    let mut lines: Vec<[String; 2]> =
        devices.map(|(index, one)| [one.name.clone(), device_words(name(index), &one.device)]).collect();
    let wall = &scene.vessel.wall;
    let regions = match wall.region.len() {
        0 => String::new(),
        1 => ", another in a region".to_owned(),
        count => format!(", others in {count} regions"),
    };
    lines.push(["friction coefficient".to_owned(), format!("{}{regions}", wall.friction)]);
    lines.push(["wall modulus".to_owned(), format!("{} N/mm²{regions}", wall.modulus_n_per_mm2)]);
    Ok(lines)
}

/// A device by its name and its extreme sizes.
fn device_words(name: Option<&str>, device: &Device) -> String {
    let stiffnesses = device.sections().iter().map(|one| (one.softest_nmm2(), one.bending_stiffness_nmm2));
    let (low, high) = stiffnesses.fold((f64::MAX, 0.0f64), |(low, high), ei| (low.min(ei.0), high.max(ei.1)));
    let range = |low: f64, high: f64, digits: usize| match high - low > 0.005 * high {
        true => format!("{low:.digits$}–{high:.digits$}"),
        false => format!("{high:.digits$}"),
    };
    let diameters = range(2.0 * device.min_radius_mm(), 2.0 * device.max_radius_mm(), 2);
    let digits = if high < 10.0 { 3 } else { 0 };
    let name = name.filter(|name| !name.is_empty()).map_or_else(String::new, |name| format!("{name}: "));
    format!(
        "{name}{diameters} mm thick, EI {} N·mm², {:.0} mm long",
        range(low, high, digits),
        device.length_mm()
    )
}

/// The shape at a step.
#[derive(Debug, Clone, Serialize)]
pub struct Moment {
    pub(crate) step: usize,
    /// Coordinates x y z of the line, sheath first, in hundredths of a millimetre.
    line: Vec<i32>,
    /// Length of each instrument along the line, as a fraction of it.
    shares: Vec<f32>,
    /// Positions and forces of contacts: hundredths of a millimetre, and newtons.
    contacts: Vec<([i32; 3], [f32; 3])>,
}

impl Moment {
    /// The shape after a step, from the line of all instruments, sheath first (mm), their inserted lengths (mm), and
    /// positions (mm) and forces (N) of contacts.
    pub fn new(
        step: usize,
        line_mm: &[Vec3],
        inserted_mm: &[f64],
        contacts: impl Iterator<Item = (Vec3, Vec3)>,
    ) -> Self {
        let whole_mm = inserted_mm.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let contact = |(at_mm, force_n): (Vec3, Vec3)| {
            (scaled(&at_mm, 100.0), [force_n.x, force_n.y, force_n.z].map(|x| x as f32))
        };
        Self {
            step,
            line: line_mm.iter().flat_map(|p| scaled(p, 100.0)).collect(),
            shares: inserted_mm.iter().map(|mm| (mm / whole_mm) as f32).collect(),
            contacts: contacts.map(contact).collect(),
        }
    }

    /// Number of nodes of the line.
    pub(crate) fn nodes(&self) -> usize {
        self.line.len() / 3
    }
}

pub(crate) fn scaled(point_mm: &Vec3, per_mm: f64) -> [i32; 3] {
    [point_mm.x, point_mm.y, point_mm.z].map(|x| (x * per_mm).round() as i32)
}

/// The columns; each is drawn as a curve.
#[derive(Debug, Serialize)]
pub struct Series {
    step: Vec<usize>,
    time_s: Vec<Option<f64>>,
    inserted_mm: Vec<f64>,
    rotation_deg: Vec<Option<f64>>,
    /// Angle by which the tip is behind the hand.
    tip_lag_deg: Vec<Option<f64>>,
    push_force_n: Vec<f64>,
    torque_nmm: Vec<f64>,
    energy_mj: Vec<Option<f64>>,
    wall_mj: Vec<Option<f64>>,
    vessel_mj: Vec<Option<f64>>,
    max_penetration_mm: Vec<Option<f64>>,
    vessel_displacement_mm: Vec<Option<f64>>,
    wall_force_sum_n: Vec<Option<f64>>,
    wall_force_largest_n: Vec<Option<f64>>,
    wall_force_tip_n: Vec<Option<f64>>,
    imbalance: Vec<Option<f64>>,
}

impl Series {
    /// The columns of rows, in order of steps.
    pub fn of(rows: &[StepRow]) -> Self {
        Self {
            step: rows.iter().map(|row| row.step).collect(),
            time_s: rows.iter().map(|row| row.time_s).collect(),
            inserted_mm: rows.iter().map(|row| row.inserted_mm).collect(),
            rotation_deg: rows.iter().map(|row| row.rotation_rad.map(f64::to_degrees)).collect(),
            tip_lag_deg: rows
                .iter()
                .map(|row| Some((row.rotation_rad? - row.tip_rotation_rad?).to_degrees()))
                .collect(),
            push_force_n: rows.iter().map(|row| row.push_force_n).collect(),
            torque_nmm: rows.iter().map(|row| row.torque_nmm).collect(),
            energy_mj: rows.iter().map(StepRow::energy_mj).collect(),
            wall_mj: rows.iter().map(|row| row.wall_mj).collect(),
            vessel_mj: rows.iter().map(|row| row.vessel_mj).collect(),
            max_penetration_mm: rows.iter().map(|row| row.max_penetration_mm).collect(),
            vessel_displacement_mm: rows.iter().map(|row| row.vessel_displacement_mm).collect(),
            wall_force_sum_n: rows.iter().map(|row| row.wall_force_sum_n).collect(),
            wall_force_largest_n: rows.iter().map(|row| row.wall_force_largest_n).collect(),
            wall_force_tip_n: rows.iter().map(|row| row.wall_force_tip_n).collect(),
            imbalance: rows.iter().map(|row| row.imbalance).collect(),
        }
    }
}

/// An event in a step.
#[derive(Debug, Serialize)]
pub struct Event {
    /// Number of the step.
    pub step: usize,
    /// Kind of the event.
    pub what: &'static str,
    /// Description for people.
    pub text: String,
}

/// The events that follow from rows.
pub fn events(rows: &[StepRow]) -> Vec<Event> {
    let mut events = Vec::new();
    let mut out = None;
    for row in rows {
        let mut happened =
            |what: &'static str, text: String| events.push(Event { step: row.step, what, text });
        if row.jumped {
            happened("jumped", format!("at {:.1} mm: let go of energy", row.inserted_mm));
        }
        if let (Some(opening), None) = (row.left_through, out) {
            happened("left", format!("at {:.1} mm: the tip is out of opening {opening}", row.inserted_mm));
        }
        if row.converged == Some(false) {
            happened("not converged", format!("at {:.1} mm: the step found no equilibrium", row.inserted_mm));
        }
        if row.relaxations.is_some_and(|count| count > 0) {
            // What is not recorded, or is nothing, gets no number.
            let left = row.imbalance.filter(|left| *left > 0.0);
            let left = left.map_or_else(String::new, |left| format!(", {left:.1e} out of balance"));
            happened("last resort", format!("at {:.1} mm: left to come to rest{left}", row.inserted_mm));
        }
        out = row.left_through;
    }
    events
}

/// A picture of a step.
#[derive(Debug, Serialize)]
pub struct Frame {
    /// Number of the step.
    pub step: usize,
    /// Name of the view.
    pub view: String,
    /// The picture as PNG, in Base64.
    pub png: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_came_to_rest_in_balance_is_reported_without_a_number() {
        let text = "step,advance_mm,rotate_rad,inserted_mm,nodes,tip_x_mm,tip_y_mm,tip_z_mm,push_force_n,torque_nmm,jumped,relaxations,imbalance
                    3,0,0,12,0,0,0,0,0,0,false,1,
";
        let file = std::env::temp_dir().join(format!("endowire-report-{}.csv", std::process::id()));
        std::fs::write(&file, text.replace("                    ", "")).unwrap();
        let rows: Vec<StepRow> = endowire_recording::table::read(&file).unwrap();
        std::fs::remove_file(&file).unwrap();
        let row = |imbalance: Option<f64>| StepRow { imbalance, ..rows[0].clone() };
        for imbalance in [None, Some(0.0)] {
            assert_eq!(events(&[row(imbalance)])[0].text, "at 12.0 mm: left to come to rest");
        }
        let twin = &events(&[row(Some(2e-4))])[0].text;
        assert_eq!(twin, "at 12.0 mm: left to come to rest, 2.0e-4 out of balance");
    }
}
