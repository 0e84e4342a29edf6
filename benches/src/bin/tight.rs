//! Devices that nearly fill their lumen: a bent tube given by its centre line and by meshes of several finenesses.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin tight [SHARE …] > tight.tsv
//! ```
//!
//! A straight tube continues into a bend. A frictionless wire lies along its outer side, and is pushed with
//! EI/2/(R + play)². A row for each radius of the device, in percent of the lumen's, modulus of the wall and length of
//! edges, in radii of the lumen (0: the centre line): the push force over that, least, mean and largest; the largest
//! deviation of the energy from a line over small steps, relative; reported depth over that of the geometry, least and
//! largest of the pressed places; iterations a step, steps that did not converge, time.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a table is what it is for")]

use std::time::Instant;

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Lumen, Resolution, SweptVessel};
use endowire_core::{Result, Vec3};

/// Radius of the lumen and of its bend, mm.
const LUMEN_MM: f64 = 0.65;
const BEND_MM: f64 = 30.0;
/// Straight part before it, mm.
const STRAIGHT_MM: f64 = 10.0;
/// Bending stiffness, N·mm².
const STIFFNESS_NMM2: f64 = 14.0;
/// Radii of devices, in percent of the lumen's.
const SHARES: [f64; 5] = [75.0, 90.0, 97.0, 99.0, 99.5];
/// Moduli of the wall, N/mm².
const MODULI: [f64; 2] = [1.0, 200.0];
/// Lengths of edges, in radii; the centre line first.
const EDGES: [f64; 4] = [0.0, 0.1, 0.2, 0.4];
/// Steps into the bend, those that are measured, and small ones for the energy: number and length, mm.
const INTO: (usize, f64) = (12, 2.0);
const MEASURED: (usize, f64) = (15, 1.0);
const SMALL: (usize, f64) = (20, 0.025);
/// Depth from which reported depths count, in parts of the largest.
const PRESSED: f64 = 0.3;

/// Axis of the tube.
fn axis(s_mm: f64) -> Vec3 {
    let angle = (s_mm - STRAIGHT_MM) / BEND_MM;
    match angle < 0.0 {
        true => Vec3::new(s_mm, 0.0, 0.0),
        false => Vec3::new(STRAIGHT_MM + BEND_MM * angle.sin(), BEND_MM * (1.0 - angle.cos()), 0.0),
    }
}

/// Distance of a position from that axis, mm.
fn off_axis_mm(x: &Vec3) -> f64 {
    let lateral = match x.x < STRAIGHT_MM {
        true => x.y,
        false => BEND_MM - (x.x - STRAIGHT_MM).hypot(x.y - BEND_MM),
    };
    lateral.hypot(x.z)
}

fn tube() -> Result<CentrelineTree> {
    let rows = (-10..130).map(|k| CentrelineNode {
        position_mm: axis(0.5 * f64::from(k)),
        radius_mm: LUMEN_MM,
        parent: usize::try_from(k + 9).ok(),
    });
    CentrelineTree::new(rows.collect())
}

/// The least, mean and largest of some numbers.
fn spread(all: &[f64]) -> (f64, f64, f64) {
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (least, all.iter().sum::<f64>() / all.len() as f64, most)
}

fn row(lumen: &Lumen, share: f64, modulus: f64, edge: f64) -> Result<()> {
    let radius_mm = 0.01 * share * LUMEN_MM;
    let position_mm = Vec3::zeros();
    let sheath =
        Sheath { position_mm, direction: Vec3::x(), friction: 0.0, friction_n: 0.0, bends_towards: None };
    let properties = WallProperties { modulus_n_per_mm2: modulus, ..WallProperties::default() };
    let method = KirchhoffOptions {
        element_mm: 2.0,
        contact_spacing_radii: 0.25,
        tolerance: 1e-9,
        ..KirchhoffOptions::default()
    };
    let began = Instant::now();
    let wire = Device::uniform(200.0, radius_mm, STIFFNESS_NMM2)?;
    let builder = Simulation::builder(lumen.clone(), wire, sheath).properties(properties).method(&method);
    let mut simulation = builder.build()?;
    let made_s = began.elapsed().as_secs_f64();
    let began = Instant::now();
    let exact_n = STIFFNESS_NMM2 / 2.0 / (BEND_MM + LUMEN_MM - radius_mm).powi(2);
    let (mut pushes, mut iterations, mut off, mut loose) = (Vec::new(), 0, 0, 0);
    for k in 0..INTO.0 + MEASURED.0 {
        let is_measured = k >= INTO.0;
        let report = simulation.step(Command::advance(if is_measured { MEASURED.1 } else { INTO.1 }))?;
        off += u32::from(!report.converged);
        if is_measured {
            pushes.push(report.push_force_n / exact_n);
            iterations += report.iterations;
            loose += report.relaxations;
        }
    }
    let (mut energies, mut ratios) = (Vec::new(), Vec::new());
    for _ in 0..SMALL.0 {
        let report = simulation.step(Command::advance(SMALL.1))?;
        off += u32::from(!report.converged);
        energies.push(report.energy.total());
        let told = |c: &endowire_core::insertion::Contact| c.penetration_mm;
        let deepest = report.contacts.iter().map(told).fold(0.0, f64::max);
        ratios.extend(
            report
                .contacts
                .iter()
                .filter(|c| told(c) > PRESSED * deepest)
                .map(|c| told(c) / (off_axis_mm(&c.position_mm) + radius_mm - LUMEN_MM)),
        );
    }
    let last = energies.len() - 1;
    let line = |k: usize| energies[0] + (energies[last] - energies[0]) * k as f64 / last as f64;
    let ripple = (0..=last).map(|k| (energies[k] - line(k)).abs()).fold(0.0, f64::max) / energies[0];
    let ((low, mean, high), (shallow, _, deep)) = (spread(&pushes), spread(&ratios));
    println!(
        "{share}\t{modulus}\t{edge}\t{low:.3}\t{mean:.3}\t{high:.3}\t{ripple:.1e}\t{shallow:.2}\t{deep:.2}\t{:.1}\t{loose}\t{off}\t{made_s:.2}\t{:.2}",
        f64::from(iterations) / MEASURED.0 as f64,
        began.elapsed().as_secs_f64()
    );
    Ok(())
}

fn main() -> Result<()> {
    let asked: Vec<f64> = std::env::args().skip(1).filter_map(|share| share.parse().ok()).collect();
    let shares = if asked.is_empty() { SHARES.to_vec() } else { asked };
    let tree = tube()?;
    println!(
        "share_%\tmodulus\tedge_radii\tpush_least\tpush_mean\tpush_most\tenergy_off\tdepth_least\tdepth_most\titerations\trelaxations\tunconverged\tmade_s\ttime_s"
    );
    for edge in EDGES {
        let lumen: Lumen = match edge {
            0.0 => SweptVessel::new(tree.clone(), Resolution::EdgeMm(0.2 * LUMEN_MM))?.into(),
            _ => GeneratedWall::new(&tree, Resolution::EdgeMm(edge * LUMEN_MM))?.wall.into(),
        };
        for share in &shares {
            for modulus in MODULI {
                if let Err(error) = row(&lumen, *share, modulus, edge) {
                    println!("{share}\t{modulus}\t{edge}\t{error}");
                }
            }
        }
    }
    Ok(())
}
