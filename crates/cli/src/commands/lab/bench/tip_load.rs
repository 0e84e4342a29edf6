//! `endowire bench tip-load`: a tip against a surface.

use endowire_lab::bench::tip_load::{TipLoad, TipLoadPoint, TipLoadTest};
use serde::Serialize;

use super::output::{Document, Shown, Table, Tested, give, legend, names, of_device, troubles};
use crate::args::TipLoadArgs;
use crate::commands::lab::devices;
use crate::commands::lab::parallel::in_parallel;
use crate::failure::Failure;
use crate::output::curves::{Curve, Curves, Panel, Scale, Stroke, colour};
use crate::output::progress;
use crate::output::provenance::Provenance;

#[derive(Serialize)]
struct Settings {
    free_length_mm: f64,
    stroke_mm: f64,
    friction: f64,
}

/// Presses a surface against the tip of every device.
pub(super) fn tip_load(args: &TipLoadArgs) -> Result<(), Failure> {
    let devices = devices::read_all(&args.devices)?;
    let test = TipLoadTest {
        free_length_mm: args.free_length_mm,
        stroke_mm: args.stroke_mm,
        friction: args.friction,
        ..TipLoadTest::default()
    };
    let bar = progress::bar(devices.len(), "device");
    let loads = in_parallel(devices.len(), None, |index| {
        let load = test.run(&devices[index].file.device);
        bar.inc(1);
        load
    });
    bar.finish_and_clear();
    let each = loads.into_iter().zip(&devices);
    let loads = each.map(|(r, device)| r.map_err(|e| of_device(e, device))).collect::<Result<Vec<_>, _>>()?;
    let names = names(&devices);
    let shown = shown(&names, &loads, &test);
    let inputs: Vec<&[u8]> = devices.iter().map(|device| device.input.as_slice()).collect();
    let tested = devices.iter().zip(names).zip(loads);
    let document = Document {
        provenance: Provenance::new(&inputs, 0),
        test: "tip-load",
        settings: Settings {
            free_length_mm: test.free_length_mm,
            stroke_mm: test.stroke_mm,
            friction: test.friction,
        },
        devices: tested
            .map(|((device, name), result)| Tested { device: device.stem.clone(), name, result })
            .collect(),
    };
    give(&args.output, &document, &shown)
}

fn shown(names: &[String], loads: &[TipLoad], test: &TipLoadTest) -> Shown {
    let panel = |title: &str, up: &str, of: fn(&TipLoadPoint) -> f64| Panel {
        title: title.to_owned(),
        across: "stroke of the surface, mm".to_owned(),
        up: up.to_owned(),
        scale: Scale::Linear,
        curves: loads
            .iter()
            .enumerate()
            .map(|(index, load)| Curve {
                colour: colour(index),
                stroke: Stroke::Solid,
                points: load.points.iter().map(|point| [point.stroke_mm, of(point)]).collect(),
            })
            .collect(),
        bands: vec![],
    };
    let title = format!("Tip load, {} mm free length", test.free_length_mm);
    let rows = names.iter().zip(loads).map(|(name, load)| {
        vec![
            name.clone(),
            load.buckling_n.map_or_else(|| "–".to_owned(), |n| format!("{n:.4}")),
            format!("{:.4}", load.tip_load_n),
            format!("{:.2}", load.tip_load_gf),
            format!("{:.2}", load.at_stroke_mm),
            load.gives_way_mm.map_or_else(|| "–".to_owned(), |mm| format!("{mm:.2}")),
        ]
    });
    let readings = names.iter().zip(loads).flat_map(|(name, load)| {
        load.points.iter().map(move |p| {
            vec![name.clone(), p.stroke_mm.to_string(), p.force_n.to_string(), p.sideways_mm.to_string()]
        })
    });
    Shown {
        about: vec![
            format!(
                "The last {} mm of the device stick out of a holder, straight at a rigid flat surface of friction {}, which moves by {} mm towards the holder \
                 from where it touches the foremost point.",
                test.free_length_mm, test.friction, test.stroke_mm
            ),
            "A straight tip carries its buckling load as soon as it touches; a shaped one bends from the beginning, so that its force grows with the stroke. \
             The tip load is the largest force within the stroke; 1 gf = 9.807 mN. Where the force falls, the tip has given way."
                .to_owned(),
            "Without friction the tip slides away freely and buckles at π²EI/(4L²), if it is uniform. Held by friction, a tip that is exactly straight buckles at \
             up to eight times as much: real tips lie between."
                .to_owned(),
        ],
        table: Table {
            columns: vec!["device", "buckles at N", "tip load N", "tip load gf", "at stroke mm", "gives way at mm"],
            rows: rows.collect(),
        },
        readings: Table {
            columns: vec!["device", "stroke_mm", "force_n", "sideways_mm"],
            rows: readings.collect(),
        },
        curves: Curves {
            title: title.clone(),
            panels: vec![
                panel("Force on the surface", "force, N", |point| point.force_n),
                panel("The tip moves sideways", "way of the tip along the surface, mm", |point| point.sideways_mm),
            ],
            legend: legend(names),
            notes: vec![format!("friction of the surface {}", test.friction)],
        },
        title,
        troubles: names
            .iter()
            .zip(loads)
            .flat_map(|(name, load)| troubles(name, "tip load", load.unconverged, load.ended.as_ref()))
            .collect(),
    }
}
