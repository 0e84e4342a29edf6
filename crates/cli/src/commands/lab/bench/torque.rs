//! `endowire bench torque`: torque response.

use endowire_lab::bench::torque::{TorqueResponse, TorqueTest};
use plotters::style::RGBColor;
use serde::Serialize;

use super::output::{Document, Shown, Table, Tested, give, legend, names, of_device, troubles};
use super::track::{self, TrackDocument};
use crate::args::TorqueArgs;
use crate::cache::Cache;
use crate::commands::lab::devices;
use crate::commands::lab::parallel::in_parallel;
use crate::failure::Failure;
use crate::output::curves::{Curve, Curves, Entry, Panel, Scale, Stroke, colour};
use crate::output::progress;
use crate::output::provenance::Provenance;

/// Colour of the ideal.
const IDEAL: RGBColor = RGBColor(150, 150, 150);

#[derive(Serialize)]
struct Settings {
    track: TrackDocument,
    friction: f64,
    turn_deg: f64,
}

/// Turns every device at the end of the track.
pub(super) fn torque(args: &TorqueArgs) -> Result<(), Failure> {
    let devices = devices::read_all(&args.devices)?;
    let track = track::read(&args.track)?;
    let cache = Cache::new(&args.track.cache);
    let test = TorqueTest { friction: args.track.friction, turn_deg: args.turn_deg, step_deg: args.step_deg };
    let bar = progress::bar(devices.len(), "device");
    let responses = in_parallel(devices.len(), None, |index| {
        let response = test.run(&devices[index].file.device, &track.track, &cache);
        bar.inc(1);
        response
    });
    bar.finish_and_clear();
    let each = responses.into_iter().zip(&devices);
    let responses =
        each.map(|(r, device)| r.map_err(|e| of_device(e, device))).collect::<Result<Vec<_>, _>>()?;
    let names = names(&devices);
    let shown = shown(&names, &responses, &track.document, &test);
    let mut inputs: Vec<Vec<u8>> = devices.iter().map(|device| device.input.clone()).collect();
    inputs.push(track.input);
    let tested = devices.iter().zip(names).zip(responses);
    let document = Document {
        provenance: Provenance::new(&inputs, 0),
        test: "torque",
        settings: Settings { track: track.document, friction: test.friction, turn_deg: test.turn_deg },
        devices: tested
            .map(|((device, name), result)| Tested { device: device.stem.clone(), name, result })
            .collect(),
    };
    give(&args.output, &document, &shown)
}

fn shown(names: &[String], responses: &[TorqueResponse], track: &TrackDocument, test: &TorqueTest) -> Shown {
    let mut legend = legend(names);
    legend.push(Entry {
        name: "ideal: the tip turns with the hand".to_owned(),
        colour: IDEAL,
        stroke: Stroke::Dashed,
    });
    let curves = |of: fn(&endowire_lab::bench::torque::TorquePoint) -> f64| {
        let curve = move |(index, response): (usize, &TorqueResponse)| Curve {
            colour: colour(index),
            stroke: Stroke::Solid,
            points: response.points.iter().map(|point| [point.hand_deg, of(point)]).collect(),
        };
        responses.iter().enumerate().map(curve)
    };
    let ideal = |end: f64| Curve {
        colour: IDEAL,
        stroke: Stroke::Dashed,
        points: vec![[0.0, 0.0], [test.turn_deg, end]],
    };
    let panel = |title: &str, up: &str, ideal: Curve, curves: Vec<Curve>| Panel {
        title: title.to_owned(),
        across: "angle of the hand, degrees".to_owned(),
        up: up.to_owned(),
        scale: Scale::Linear,
        curves: std::iter::once(ideal).chain(curves).collect(),
        bands: vec![],
    };
    let title = format!("Torque response at the end of the track, friction {}", test.friction);
    let rows = names.iter().zip(responses).map(|(name, r)| {
        vec![
            name.clone(),
            format!("{:.0}", r.inserted_mm),
            format!("{:.1}", r.mean_lag_deg),
            format!("{:.1}", r.largest_lag_deg),
            format!("{:.1}", r.largest_whip_deg),
            r.whip_at_deg.map_or_else(|| "–".to_owned(), |deg| format!("{deg:.0}")),
            r.jumps.to_string(),
            format!("{:.3}", r.largest_torque_nmm),
        ]
    });
    let readings = names.iter().zip(responses).flat_map(|(name, r)| {
        r.points.iter().map(move |p| {
            vec![name.clone(), p.hand_deg.to_string(), p.tip_deg.to_string(), p.torque_nmm.to_string()]
        })
    });
    Shown {
        about: vec![
            track.words(),
            format!(
                "The tip lies at the end of the track, whose friction is {}. The hand holds the device at the mouth of the track and turns it by {:.0}°; \
                 angles of hand and tip are counted from there, about the device's axis.",
                test.friction, test.turn_deg
            ),
            "Lag is the angle by which the tip is behind the hand. Whip is the angle by which the tip jumps ahead of the hand at once; 0 where it never \
             jumps. Every reading is an equilibrium: a real tip may swing farther in a jump."
                .to_owned(),
        ],
        table: Table {
            columns: vec![
                "device",
                "inserted mm",
                "mean lag °",
                "largest lag °",
                "whip °",
                "at hand °",
                "jumps",
                "torque N·mm",
            ],
            rows: rows.collect(),
        },
        readings: Table {
            columns: vec!["device", "hand_deg", "tip_deg", "torque_nmm"],
            rows: readings.collect(),
        },
        curves: Curves {
            title: title.clone(),
            panels: vec![
                panel(
                    "Tip against hand",
                    "angle of the tip, degrees",
                    ideal(test.turn_deg),
                    curves(|p| p.tip_deg).collect(),
                ),
                panel(
                    "Lag: tip behind hand",
                    "lag, degrees",
                    ideal(0.0),
                    curves(|p| p.hand_deg - p.tip_deg).collect(),
                ),
            ],
            legend,
            notes: vec![track.words()],
        },
        title,
        troubles: names
            .iter()
            .zip(responses)
            .flat_map(|(name, r)| troubles(name, "torque", r.unconverged, r.ended.as_ref()))
            .collect(),
    }
}
