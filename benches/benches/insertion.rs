//! An insertion in parts: closest points and smooth distances, the contact surface made from a surface, whole steps against the number
//! of elements, and clones.
#![allow(missing_docs, reason = "the macros of criterion expand to undocumented items")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use endowire_core::contact::{ContactSurface, WallReader};
use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, NoStore, Resolution, WallQuery, anatomy};
use endowire_core::{Error, Result, Vec3};

/// Radius of the wire, mm.
const RADIUS_MM: f64 = 0.445;

/// Length that is inserted before the clock starts, mm: the wire lies along the bends of the curved tube.
const INSERTED_MM: f64 = 160.0;

fn vessel(triangles: usize) -> Result<GeneratedWall> {
    let tree = anatomy::tree("curved_tube")
        .ok_or_else(|| Error::parameter("vessel", "curved_tube", "is not built in"))?;
    GeneratedWall::new(&tree, Resolution::Triangles(triangles))
}

/// A wire of `elements` elements, inserted.
fn inserted(elements: usize, friction: f64) -> Result<Simulation> {
    let made = vessel(20_000)?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0)?;
    let wire = Device::uniform(200.0, RADIUS_MM, 10.0)?;
    let method = KirchhoffOptions { element_mm: INSERTED_MM / elements as f64, ..Default::default() };
    let properties = WallProperties { friction, ..Default::default() };
    let mut simulation =
        Simulation::builder(made.wall, wire, sheath).properties(properties).method(&method).build()?;
    for _ in 0..80 {
        simulation.step(Command::advance(INSERTED_MM / 80.0))?;
    }
    Ok(simulation)
}

/// A query at every place where a wire of 300 nodes may touch: points within its radius of the wall.
fn queries(c: &mut Criterion) {
    let Ok(made) = vessel(20_000) else { return };
    let Ok(query) = WallQuery::new(&made.wall) else { return };
    let mesh = made.wall.mesh();
    let step = (mesh.triangles.len() / 300).max(1);
    let places: Vec<Vec3> = (0..mesh.triangles.len())
        .step_by(step)
        .map(|index| {
            let [a, b, d] = mesh.corners(index);
            (a + b + d) / 3.0 + query.inward_normal(index as u32) * RADIUS_MM
        })
        .collect();
    let properties = WallProperties::default();
    let Ok(felt) = ContactSurface::new(&made.wall, (RADIUS_MM, RADIUS_MM), &properties, &NoStore) else {
        return;
    };
    let mut group = c.benchmark_group(format!("{} contact queries", places.len()));
    group.bench_function("nearest", |b| {
        b.iter(|| places.iter().filter(|x| query.nearest(black_box(x), 3.0).is_some()).count());
    });
    group.bench_function("smooth distance with derivatives", |b| {
        let mut reader = WallReader::new(&felt);
        b.iter(|| {
            for x in &places {
                black_box(reader.read(&felt, black_box(x), 3.0));
            }
        });
    });
    group.finish();
}

fn felt_walls(c: &mut Criterion) {
    let mut group = c.benchmark_group("felt wall of triangles");
    group.sample_size(10);
    for triangles in [20_000, 200_000] {
        let Ok(made) = vessel(triangles) else { continue };
        group.bench_function(BenchmarkId::from_parameter(triangles), |b| {
            b.iter(|| {
                ContactSurface::new(&made.wall, (RADIUS_MM, RADIUS_MM), &WallProperties::default(), &NoStore)
            });
        });
    }
    group.finish();
}

fn steps(c: &mut Criterion) {
    for friction in [0.0, 0.1] {
        let mut group = c.benchmark_group(format!("1 mm in and out, friction {friction}, elements"));
        group.sample_size(10);
        for elements in [50, 100, 300] {
            let Ok(mut simulation) = inserted(elements, friction) else { continue };
            group.bench_function(BenchmarkId::from_parameter(elements), |b| {
                b.iter(|| {
                    let there = simulation.step(Command::advance(1.0)).is_ok();
                    there && simulation.step(Command::retract(1.0)).is_ok()
                });
            });
        }
        group.finish();
    }
}

/// A straight wire that leads by 4 mm in a straight catheter, 512 elements on the line, with these coefficients of friction between them and on the wall.
fn wire_in_catheter([between, wall]: [f64; 2]) -> Result<Simulation> {
    let made = vessel(20_000)?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0)?;
    let one = |name: &str, section: Section| -> Result<Instrument> {
        Ok(Instrument { name: name.to_owned(), device: Device::new(vec![section])?, may_lead: true })
    };
    let catheter = Section { inner_radius_mm: Some(0.3), ..Section::straight(200.0, RADIUS_MM, 10.0) };
    let both = vec![one("wire", Section::straight(230.0, 0.2, 10.0))?, one("catheter", catheter)?];
    let stack = Stack::new(both)?.with_friction(vec![between, 0.0])?;
    let method = KirchhoffOptions { element_mm: INSERTED_MM / 512.0, ..Default::default() };
    let properties = WallProperties { friction: wall, ..Default::default() };
    let mut simulation =
        Simulation::builder(made.wall, stack, sheath).properties(properties).method(&method).build()?;
    for k in 0..82 {
        let command = Command::advance(INSERTED_MM / 80.0);
        let moves = [0, 1].map(|instrument| Move { instrument, command });
        simulation.step_together(&moves[..if k < 80 { 2 } else { 1 }])?;
    }
    Ok(simulation)
}

fn instruments(c: &mut Criterion) {
    let mut group =
        c.benchmark_group("a wire in a catheter 0.25 mm in and out, friction between and on the wall");
    group.sample_size(10);
    for frictions in [[0.0, 0.0], [0.15, 0.0], [0.15, 0.1]] {
        let Ok(mut simulation) = wire_in_catheter(frictions) else { continue };
        group.bench_function(BenchmarkId::from_parameter(format!("{frictions:?}")), |b| {
            b.iter(|| {
                let mut go = |command| simulation.step_together(&[Move { instrument: 0, command }]).is_ok();
                go(Command::advance(0.25)) && go(Command::retract(0.25))
            });
        });
    }
    group.finish();
}

/// A clone as a search over commands makes it, and the state alone, which is taken back by `restore`.
fn clones(c: &mut Criterion) {
    let Ok(simulation) = inserted(199, 0.1) else { return };
    let mut group = c.benchmark_group("copy of 200 nodes");
    group.bench_function("clone", |b| {
        b.iter_with_large_drop(|| black_box(&simulation).clone());
    });
    group.bench_function("state", |b| {
        b.iter_with_large_drop(|| black_box(&simulation).state());
    });
    group.finish();
}

criterion_group!(benches, queries, felt_walls, steps, instruments, clones);
criterion_main!(benches);
