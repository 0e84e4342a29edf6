//! `endowire bench bend`: three-point bending.

use endowire_core::device::Part;
use endowire_lab::bench::bend::{BendPoint, BendTest, Rigidity};
use serde::Serialize;

use super::output::{Document, Shown, Table, Tested, as_flag, give, legend, names, of_device};
use crate::args::BendArgs;
use crate::commands::device::table::digits;
use crate::commands::lab::devices::{self, NamedDevice};
use crate::commands::lab::parallel::in_parallel;
use crate::failure::Failure;
use crate::output::curves::{Curve, Curves, Panel, Scale, Stroke, colour};
use crate::output::progress;
use crate::output::provenance::Provenance;

/// Number of places along each device at which the rigidity is measured for the picture.
const PLACES: usize = 120;
/// Length of the shaft that is shown beside the graded end, in spans.
const SHAFT_SPANS: f64 = 3.0;

#[derive(Serialize)]
struct Settings {
    span_mm: f64,
    deflection_mm: f64,
}

/// The results of a device.
#[derive(Serialize)]
struct Bent {
    parts: Vec<PartBent>,
    /// Rigidity along the device, tip first.
    along: Vec<Rigidity>,
    /// Place of the force–deflection curve, mm from the tip; `None` if the device is shorter than the span.
    at_mm: Option<f64>,
    points: Vec<BendPoint>,
}

/// A part, measured in its middle.
#[derive(Serialize)]
struct PartBent {
    part: String,
    from_mm: f64,
    to_mm: f64,
    /// EI of its cross-section in the middle, from the device file.
    bending_stiffness_nmm2: f64,
    /// Place of the load, mm from the tip; `None` where the device ends within half a span.
    at_mm: Option<f64>,
    /// F L³/(48 δ) there.
    rigidity_nmm2: Option<f64>,
    /// Whether the part is as long as the span, so that its neighbours have no part in the result.
    fills_span: bool,
    /// Whether it has a rest shape, which is left out.
    shaped: bool,
}

/// Bends every device.
pub(super) fn bend(args: &BendArgs) -> Result<(), Failure> {
    let devices = devices::read_all(&args.devices)?;
    let test = BendTest { span_mm: args.span_mm, deflection_mm: args.deflection_mm };
    test.check().map_err(as_flag)?;
    let shown_mm = devices.iter().map(graded_mm).fold(0.0, f64::max) + SHAFT_SPANS * test.span_mm;
    let bar = progress::bar(devices.len(), "device");
    let bent = in_parallel(devices.len(), None, |index| {
        let bent = measured(&test, &devices[index], shown_mm, args.at_mm);
        bar.inc(1);
        bent
    });
    bar.finish_and_clear();
    let each = bent.into_iter().zip(&devices);
    let bent = each.map(|(r, device)| r.map_err(|e| of_device(e, device))).collect::<Result<Vec<_>, _>>()?;
    let names = names(&devices);
    let shown = shown(&names, &bent, &test);
    let inputs: Vec<&[u8]> = devices.iter().map(|device| device.input.as_slice()).collect();
    let tested = devices.iter().zip(names).zip(bent);
    let document = Document {
        provenance: Provenance::new(&inputs, 0),
        test: "bend",
        settings: Settings { span_mm: test.span_mm, deflection_mm: test.deflection_mm },
        devices: tested
            .map(|((device, name), result)| Tested { device: device.stem.clone(), name, result })
            .collect(),
    };
    give(&args.output, &document, &shown)
}

/// Length from the tip up to where the last section begins, mm.
fn graded_mm(device: &NamedDevice) -> f64 {
    let sections = device.file.device.sections();
    sections.iter().rev().skip(1).map(|section| section.length_mm).sum()
}

fn measured(
    test: &BendTest,
    named: &NamedDevice,
    shown_mm: f64,
    at_mm: Option<f64>,
) -> endowire_core::Result<Bent> {
    let device = &named.file.device;
    let parts = named.file.parts.iter().map(|part| PartBent::of(test, part, named));
    let parts = parts.collect::<endowire_core::Result<Vec<_>>>()?;
    let half_mm = 0.5 * test.span_mm;
    let last_mm = shown_mm.min(device.length_mm() - half_mm);
    let place = |k: usize| half_mm + (last_mm - half_mm) * k as f64 / (PLACES - 1) as f64;
    let along = (0..PLACES).map(place).filter(|at_mm| test.reaches(device, *at_mm));
    let along = along.map(|at_mm| test.rigidity(device, at_mm)).collect::<endowire_core::Result<Vec<_>>>()?;
    let longest = named.file.parts.iter().max_by(|a, b| length_mm(a).total_cmp(&length_mm(b)));
    let longest_mm = longest.map(middle_mm).filter(|at_mm| test.reaches(device, *at_mm));
    let at_mm = at_mm.or(longest_mm);
    let points = at_mm.map_or_else(|| Ok(vec![]), |at_mm| test.forces(device, at_mm))?;
    Ok(Bent { parts, along, at_mm, points })
}

fn length_mm(part: &Part) -> f64 {
    part.from_tip_mm[1] - part.from_tip_mm[0]
}

fn middle_mm(part: &Part) -> f64 {
    0.5 * (part.from_tip_mm[0] + part.from_tip_mm[1])
}

impl PartBent {
    fn of(test: &BendTest, part: &Part, named: &NamedDevice) -> endowire_core::Result<Self> {
        let at_mm = Some(middle_mm(part)).filter(|at_mm| test.reaches(&named.file.device, *at_mm));
        let rigidity = at_mm.map(|at_mm| test.rigidity(&named.file.device, at_mm)).transpose()?;
        let [from_mm, to_mm] = part.from_tip_mm;
        Ok(Self {
            part: part.name.clone(),
            from_mm,
            to_mm,
            bending_stiffness_nmm2: part.at(0.5).bending_stiffness_nmm2,
            at_mm,
            rigidity_nmm2: rigidity.map(|rigidity| rigidity.rigidity_nmm2),
            fills_span: length_mm(part) >= test.span_mm,
            shaped: part.sections().iter().any(|section| section.rest_curvature_per_mm != [0.0; 2]),
        })
    }

    fn remark(&self) -> String {
        let mut remarks = Vec::new();
        if self.at_mm.is_none() {
            remarks.push("too near an end for the supports");
        } else if !self.fills_span {
            remarks.push("shorter than the span: with its neighbours");
        }
        if self.shaped {
            remarks.push("tested as if straight");
        }
        remarks.join("; ")
    }
}

fn shown(names: &[String], bent: &[Bent], test: &BendTest) -> Shown {
    let panel = |title: String, across: &str, up: &str, scale: Scale, of: fn(&Bent) -> Vec<[f64; 2]>| Panel {
        title,
        across: across.to_owned(),
        up: up.to_owned(),
        scale,
        curves: bent
            .iter()
            .enumerate()
            .map(|(index, one)| Curve { colour: colour(index), stroke: Stroke::Solid, points: of(one) })
            .collect(),
        bands: vec![],
    };
    let dash = || "–".to_owned();
    let rows = names.iter().zip(bent).flat_map(|(name, one)| {
        one.parts.iter().map(move |part| {
            vec![
                name.clone(),
                part.part.clone(),
                format!("{:.1}", part.from_mm),
                format!("{:.1}", part.to_mm),
                part.at_mm.map_or_else(dash, |mm| format!("{mm:.1}")),
                part.rigidity_nmm2.map_or_else(dash, |ei| digits(ei, 4)),
                digits(part.bending_stiffness_nmm2, 4),
                part.remark(),
            ]
        })
    });
    let readings = names.iter().zip(bent).flat_map(|(name, one)| {
        let along = one.along.iter().map(move |r| {
            vec![
                name.clone(),
                "rigidity".to_owned(),
                r.from_tip_mm.to_string(),
                String::new(),
                String::new(),
                r.rigidity_nmm2.to_string(),
            ]
        });
        let forces = one.points.iter().map(move |p| {
            vec![
                name.clone(),
                "force".to_owned(),
                one.at_mm.map_or_else(String::new, |mm| mm.to_string()),
                p.deflection_mm.to_string(),
                p.force_n.to_string(),
                String::new(),
            ]
        });
        along.chain(forces)
    });
    let places =
        names.iter().zip(bent).filter_map(|(name, one)| Some(format!("{name}: {:.0} mm", one.at_mm?)));
    let title = format!("Three-point bending, span {} mm", test.span_mm);
    Shown {
        about: vec![
            format!(
                "A length of the device lies on two supports {} mm apart and is pressed down halfway between them. It pivots on one support and slides along \
                 the other. Flexural rigidity is F L³/(48 δ) at a deflection of a five-hundredth of the span: EI of a uniform length.",
                test.span_mm
            ),
            "Within a taper the stiffer side counts more than the average: the rigidity differs from EI under the load. The rest shape of curved parts is left \
             out."
                .to_owned(),
        ],
        table: Table {
            columns: vec!["device", "part", "from mm", "to mm", "at mm", "rigidity N·mm²", "EI N·mm²", "remark"],
            rows: rows.collect(),
        },
        readings: Table {
            columns: vec!["device", "reading", "from_tip_mm", "deflection_mm", "force_n", "rigidity_nmm2"],
            rows: readings.collect(),
        },
        curves: Curves {
            title: title.clone(),
            panels: vec![
                panel(
                    "Flexural rigidity along the device".to_owned(),
                    "distance from the tip, mm",
                    "rigidity F L³/(48 δ), N·mm²",
                    Scale::Logarithmic,
                    |one| one.along.iter().map(|r| [r.from_tip_mm, r.rigidity_nmm2]).collect(),
                ),
                panel(
                    "Force over deflection".to_owned(),
                    "deflection, mm",
                    "force, N",
                    Scale::Linear,
                    |one| one.points.iter().map(|p| [p.deflection_mm, p.force_n]).collect(),
                ),
            ],
            legend: legend(names),
            notes: vec![format!("force over deflection is measured so far from the tip: {}", places.collect::<Vec<_>>().join(", "))],
        },
        title,
        troubles: vec![],
    }
}
