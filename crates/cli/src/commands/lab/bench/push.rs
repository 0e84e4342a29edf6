//! `endowire bench push`: push along a track.

use endowire_lab::bench::push::{PushCurve, PushPoint, PushTest};
use serde::Serialize;

use super::output::{Document, Shown, Table, Tested, give, legend, names, of_device, troubles};
use super::track::{self, TrackDocument};
use crate::args::PushArgs;
use crate::cache::Cache;
use crate::commands::lab::devices;
use crate::commands::lab::parallel::in_parallel;
use crate::failure::Failure;
use crate::output::curves::{Curve, Curves, Panel, Scale, Stroke, colour};
use crate::output::progress;
use crate::output::provenance::Provenance;

#[derive(Serialize)]
struct Settings {
    track: TrackDocument,
    friction: f64,
}

/// The curves of a device.
#[derive(Serialize)]
struct Pushed {
    without_friction: PushCurve,
    with_friction: PushCurve,
}

/// Pushes every device along the track, without friction and with it.
pub(super) fn push(args: &PushArgs) -> Result<(), Failure> {
    let devices = devices::read_all(&args.devices)?;
    let track = track::read(&args.track)?;
    let cache = Cache::new(&args.track.cache);
    let frictions = [0.0, args.track.friction];
    let bar = progress::bar(frictions.len() * devices.len(), "push");
    let curves = in_parallel(frictions.len() * devices.len(), None, |index| {
        let test = PushTest { friction: frictions[index % 2], step_mm: args.step_mm };
        let curve = test.run(&devices[index / 2].file.device, &track.track, &cache);
        bar.inc(1);
        curve
    });
    bar.finish_and_clear();
    let mut curves = curves.into_iter();
    let mut pushed = Vec::new();
    for device in &devices {
        let mut next = || match curves.next() {
            Some(curve) => curve.map_err(|e| of_device(e, device)),
            None => Err(Failure::Computation("a push is missing".to_owned())),
        };
        pushed.push(Pushed { without_friction: next()?, with_friction: next()? });
    }
    let names = names(&devices);
    let shown = shown(&names, &pushed, &track.document, args.track.friction);
    let mut inputs: Vec<Vec<u8>> = devices.iter().map(|device| device.input.clone()).collect();
    inputs.push(track.input);
    let tested = devices.iter().zip(names).zip(pushed);
    let document = Document {
        provenance: Provenance::new(&inputs, 0),
        test: "push",
        settings: Settings { track: track.document, friction: args.track.friction },
        devices: tested
            .map(|((device, name), result)| Tested { device: device.stem.clone(), name, result })
            .collect(),
    };
    give(&args.output, &document, &shown)
}

fn shown(names: &[String], pushed: &[Pushed], track: &TrackDocument, friction: f64) -> Shown {
    let lines = |of: fn(&PushPoint) -> f64| {
        let both = move |(index, p): (usize, &Pushed)| {
            let strokes = [(&p.with_friction, Stroke::Solid), (&p.without_friction, Stroke::Dashed)];
            strokes.map(|(curve, stroke)| Curve {
                colour: colour(index),
                stroke,
                points: curve.points.iter().map(|point| [point.inserted_mm, of(point)]).collect(),
            })
        };
        pushed.iter().enumerate().flat_map(both).collect::<Vec<_>>()
    };
    let panel = |title: &str, up: &str, curves: Vec<Curve>| Panel {
        title: title.to_owned(),
        across: "inserted length, mm".to_owned(),
        up: up.to_owned(),
        scale: Scale::Linear,
        curves,
        bands: track.bands(),
    };
    let title = "Push along the track (trackability)".to_owned();
    let rows = names.iter().zip(pushed).map(|(name, p)| {
        let (with, without) = (&p.with_friction, &p.without_friction);
        let reached_mm = with.points.last().map_or(0.0, |point| point.inserted_mm);
        vec![
            name.clone(),
            format!("{reached_mm:.0}"),
            format!("{:.3}", without.largest_push_n),
            format!("{:.3}", with.largest_push_n),
            format!("{:.0}", with.largest_at_mm),
            format!("{:.3}", without.mean_push_n),
            format!("{:.3}", with.mean_push_n),
            format!("{:.3}", with.largest_tip_force_n),
        ]
    });
    let readings = names.iter().zip(pushed).flat_map(|(name, p)| {
        [&p.without_friction, &p.with_friction].into_iter().flat_map(move |curve| {
            curve.points.iter().map(move |point| {
                vec![
                    name.clone(),
                    curve.friction.to_string(),
                    point.inserted_mm.to_string(),
                    point.push_force_n.to_string(),
                    point.tip_force_n.to_string(),
                ]
            })
        })
    });
    Shown {
        about: vec![
            track.words(),
            format!(
                "The hand pushes the device in at the mouth of the track: dashed without friction, solid with a coefficient of {friction}. Without friction \
                 the force is what it takes to bend the device; a negative force holds back a shaped tip that springs forwards. What friction adds is the \
                 distance between the two curves."
            ),
            "The force at the tip is that of the wall on the tip alone. Every reading is an equilibrium."
                .to_owned(),
        ],
        table: Table {
            columns: vec![
                "device",
                "reached mm",
                "largest push N, µ=0",
                "largest push N",
                "at mm",
                "mean push N, µ=0",
                "mean push N",
                "tip force N",
            ],
            rows: rows.collect(),
        },
        readings: Table {
            columns: vec!["device", "friction", "inserted_mm", "push_force_n", "tip_force_n"],
            rows: readings.collect(),
        },
        curves: Curves {
            title: title.clone(),
            panels: vec![
                panel("Force of the hand", "push force, N", lines(|point| point.push_force_n)),
                panel("Force of the wall on the tip", "force, N", lines(|point| point.tip_force_n)),
            ],
            legend: legend(names),
            notes: vec![
                format!("solid: friction {friction}; dashed: without friction; grey: bends of the track"),
                track.words(),
            ],
        },
        title: format!("{title}, friction {friction}"),
        troubles: names
            .iter()
            .zip(pushed)
            .flat_map(|(name, p)| {
                [("without friction", &p.without_friction), ("with friction", &p.with_friction)]
                    .into_iter()
                    .flat_map(move |(test, curve)| {
                        troubles(name, test, curve.unconverged, curve.ended.as_ref())
                    })
            })
            .collect(),
    }
}
