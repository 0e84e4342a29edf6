//! The background of generated bodies in numbers: the slope of its power spectrum, its grey levels, and its noise.
//!
//! `cargo run --release -p endowire-viewer --example background -- [FOLDER FOR SPECTRA AS CSV]`

use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_viewer::{Backend, Renderer, TorsoSpec, View, ViewSpec};

/// Side of a frame, and of the squares whose spectra are averaged, pixels.
const SIDE: usize = 512;
const SQUARE: usize = 128;
/// Field at the detector, and its scale in the isocentre.
const FIELD_MM: f64 = 300.0;
/// Frequencies between which the slope is fitted, per millimetre in the isocentre: structures of 20 to 2 mm.
const FITTED_PER_MM: [f64; 2] = [0.05, 0.5];

fn main() -> Result<(), Box<dyn Error>> {
    let folder: Option<PathBuf> = std::env::args().nth(1).map(Into::into);
    let vessels = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/vessels");
    println!("region        slope   grey at 5 / 25 / 50 / 75 / 95 %    noise of a frame, % of the signal");
    for (name, vessel, diaphragm_mm, isocentre_mm) in [
        ("chest", "aortic_arch.stl", None, [-17.0, -30.0, 170.0]),
        ("upper lungs", "aortic_arch.stl", None, [-17.0, -30.0, 260.0]),
        ("abdomen", "hepatic.stl", Some(150.0), [0.0, -20.0, 60.0]),
        ("pelvis", "hepatic.stl", Some(150.0), [0.0, -20.0, -110.0]),
    ] {
        let wall = Wall::from_surface(&SurfaceMesh::read(&vessels.join(vessel), 1.0)?)?;
        let mut spec = ViewSpec {
            size_px: [SIDE as u32; 2],
            views: vec![View::Fluoro],
            backend: Backend::Cpu,
            ..ViewSpec::default()
        };
        spec.c_arm.field_mm = Some(FIELD_MM);
        spec.c_arm.isocentre_mm = Some(isocentre_mm);
        spec.patient.torso = Some(TorsoSpec { diaphragm_mm, ..TorsoSpec::default() });
        let mut renderer = Renderer::of_wall(&spec, &wall)?;
        let line_integrals: Vec<f64> =
            renderer.transmission_at(&[], 0.0)?.iter().map(|left| -f64::from(*left).ln()).collect();
        let pixel_mm = FIELD_MM / SIDE as f64 * spec.c_arm.sod_mm / spec.c_arm.sid_mm;
        let spectrum = spectrum(&line_integrals, pixel_mm);
        if let Some(folder) = &folder {
            let rows = spectrum.iter().fold("per_mm,power_mm2\n".to_owned(), |mut rows, [f, power]| {
                let _ = writeln!(rows, "{f:.4},{power:.4e}");
                rows
            });
            std::fs::create_dir_all(folder)?;
            std::fs::write(folder.join(format!("{}.csv", name.replace(' ', "_"))), rows)?;
        }
        let greys = greys(&mut renderer)?;
        println!(
            "{name:<12} {:>6.2}   {:>3} / {:>3} / {:>3} / {:>3} / {:>3} {:>28.1}",
            slope(&spectrum),
            greys[0],
            greys[1],
            greys[2],
            greys[3],
            greys[4],
            100.0 * noise(&spec, &wall)?
        );
    }
    Ok(())
}

/// Power per frequency, mm², averaged over squares that overlap by half, each without its mean in a Hann window.
fn spectrum(values: &[f64], pixel_mm: f64) -> Vec<[f64; 2]> {
    let hann: Vec<f64> =
        (0..SQUARE).map(|k| 0.5 - 0.5 * libm::cos(TAU * (k as f64 + 0.5) / SQUARE as f64)).collect();
    let waves: Vec<[f64; 2]> = (0..SQUARE)
        .map(|k| {
            let (sin, cos) = libm::sincos(TAU * k as f64 / SQUARE as f64);
            [cos, sin]
        })
        .collect();
    // By whole cycles of a square.
    let mut power = vec![[0.0, 0.0]; SQUARE / 2];
    let starts = || (0..=SIDE - SQUARE).step_by(SQUARE / 2);
    for (top, left) in starts().flat_map(|top| starts().map(move |left| (top, left))) {
        let at = |y: usize, x: usize| values[(top + y) * SIDE + left + x];
        let mean =
            (0..SQUARE * SQUARE).map(|i| at(i / SQUARE, i % SQUARE)).sum::<f64>() / (SQUARE * SQUARE) as f64;
        // Rows, then columns of half of the result.
        let mut rows = vec![[0.0; 2]; SQUARE * SQUARE / 2];
        for y in 0..SQUARE {
            for u in 0..SQUARE / 2 {
                let sum = (0..SQUARE).fold([0.0; 2], |sum, x| {
                    let value = (at(y, x) - mean) * hann[x] * hann[y];
                    let wave = waves[u * x % SQUARE];
                    [sum[0] + value * wave[0], sum[1] - value * wave[1]]
                });
                rows[y * SQUARE / 2 + u] = sum;
            }
        }
        for u in 0..SQUARE / 2 {
            for v in 0..SQUARE {
                let cycles = libm::hypot(u as f64, v.min(SQUARE - v) as f64).round() as usize;
                if cycles == 0 || cycles >= power.len() {
                    continue;
                }
                let sum = (0..SQUARE).fold([0.0; 2], |sum, y| {
                    let ([a, b], wave) = (rows[y * SQUARE / 2 + u], waves[v * y % SQUARE]);
                    [sum[0] + a * wave[0] + b * wave[1], sum[1] + b * wave[0] - a * wave[1]]
                });
                power[cycles][0] += sum[0] * sum[0] + sum[1] * sum[1];
                power[cycles][1] += 1.0;
            }
        }
    }
    // Of a window whose mean square is 3/8 in each direction.
    let scale = pixel_mm * pixel_mm / (SQUARE * SQUARE) as f64 / (0.375 * 0.375);
    let per_mm = 1.0 / (SQUARE as f64 * pixel_mm);
    (1..power.len()).map(|k| [k as f64 * per_mm, scale * power[k][0] / power[k][1]]).collect()
}

/// Slope of the logarithm of power against that of frequency.
fn slope(spectrum: &[[f64; 2]]) -> f64 {
    let [low, high] = FITTED_PER_MM;
    let points: Vec<[f64; 2]> =
        spectrum.iter().filter(|[f, _]| (low..=high).contains(f)).map(|point| point.map(f64::ln)).collect();
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
    let off = |p: &[f64; 2]| [p[0] - mean[0], p[1] - mean[1]];
    let [xy, xx] = points.iter().map(off).fold([0.0; 2], |sum, [x, y]| [sum[0] + x * y, sum[1] + x * x]);
    xy / xx
}

/// Grey levels of a frame below which these parts of it are.
fn greys(renderer: &mut Renderer) -> Result<[u8; 5], Box<dyn Error>> {
    let frame = renderer.render(&[])?.fluoro.ok_or("no fluoroscopy")?;
    let mut levels = frame.data().to_vec();
    levels.sort_unstable();
    Ok([5, 25, 50, 75, 95].map(|part| levels[(levels.len() - 1) * part / 100]))
}

/// Standard deviation of the signal of a frame, relative to it, in the middle: from two frames of the same body, of
/// sixteen bits in a window that shows all.
fn noise(spec: &ViewSpec, wall: &Wall) -> Result<f64, Box<dyn Error>> {
    const WINDOW: [f64; 2] = [0.0, 20.0];
    let mut spec = ViewSpec { bits: 16, ..spec.clone() };
    spec.xray.window = Some(WINDOW);
    spec.xray.harmonised = 0.0;
    let still =
        TorsoSpec { breath_mm: Some(0.0), beat_mm: Some(0.0), ..spec.patient.torso.unwrap_or_default() };
    spec.patient.torso = Some(still);
    // Without what a frame remembers of the one before.
    spec.detector.lag = 0.0;
    let mut renderer = Renderer::of_wall(&spec, wall)?;
    let mut read = || -> Result<Vec<f64>, Box<dyn Error>> {
        let frame = renderer.render(&[])?.fluoro.ok_or("no fluoroscopy")?;
        let words = frame.data().chunks_exact(2).map(|b| f64::from(u16::from_be_bytes([b[0], b[1]])));
        Ok(words.map(|word| (WINDOW[1] - WINDOW[0]) * word / 65535.0).collect())
    };
    let [first, second] = [read()?, read()?];
    let middle = SIDE / 4..3 * SIDE / 4;
    let pixels = middle.clone().flat_map(|y| middle.clone().map(move |x| y * SIDE + x));
    let squares: Vec<f64> = pixels.map(|i| (first[i] - second[i]).powi(2) / 2.0).collect();
    Ok((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}
