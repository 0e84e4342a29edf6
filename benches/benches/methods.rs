//! The field's methods beside ours: the cantilever PL²/EI = 10 from straight, and one increment in the curved tube.
//! Errors are printed by `endowire compare`; here are times alone, for one resolution each.
#![allow(missing_docs, reason = "the macros of criterion expand to undocumented items")]

use criterion::{Criterion, criterion_group, criterion_main};
use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_methods::{AnyMethod, cantilever, static_model};

/// Those that take less than a second for what is asked here.
const FAST: [&str; 5] = ["rigid-links", "mass-spring", "beam-fem-damped", "chord-energy", "discrete-rod"];

fn cantilevers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("cantilever, 32 elements");
    group.sample_size(10);
    for name in FAST {
        let Some(model) = static_model(name) else { continue };
        group.bench_function(name, |b| b.iter(|| cantilever(&*model, 32, Vec3::new(0.0, -10.0, 0.0), 5e-4)));
    }
    group.finish();
}

/// A wire 160 mm in the curved tube.
fn inserted(name: &str) -> endowire_core::Result<Simulation> {
    let tree = anatomy::tree("curved_tube")
        .ok_or_else(|| endowire_core::Error::parameter("vessel", "curved_tube", "is not built in"))?;
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(1.2))?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0)?;
    let wire = Device::uniform(200.0, 0.445, 10.0)?;
    let properties = WallProperties::default();
    let method = AnyMethod::named(name)?.with_element_mm(5.0);
    let mut simulation =
        Simulation::builder(made.wall, wire, sheath).properties(properties).method(&method).build()?;
    for _ in 0..80 {
        simulation.step(Command::advance(2.0))?;
    }
    Ok(simulation)
}

fn increments(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("1 mm in and out of the curved tube");
    group.sample_size(10);
    for name in ["kirchhoff", "rigid-links", "beam-fem-damped", "discrete-rod"] {
        let Ok(mut simulation) = inserted(name) else { continue };
        group.bench_function(name, |b| {
            b.iter(|| {
                let there = simulation.step(Command::advance(1.0)).is_ok();
                there && simulation.step(Command::retract(1.0)).is_ok()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, cantilevers, increments);
criterion_main!(benches);
