//! Searches for the parameters that the papers leave open: shortest time to equilibrium, on the cantilever of the
//! reference cases and on an insertion into the curved tube. Prints, for every method and task, the best sets of a
//! grid, with the defaults.
//!
//! `cargo run --profile dist -p endowire-methods --example tune [METHOD …]`

use std::sync::Arc;
use std::time::{Duration, Instant};

use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_methods::{
    BeamFem, DiscreteRod, Inserted, InsertionOptions, MassSpring, RigidLinks, RodModel, cantilever,
};

/// Time limit of one set, s; slower ones are discarded.
const LIMIT: Duration = Duration::from_secs(4);
/// Number of best sets shown.
const SHOWN: usize = 4;

/// Models keep no state between runs.
type Model = Arc<dyn RodModel>;

/// A set of parameters and its description.
struct Candidate {
    method: &'static str,
    text: String,
    model: Model,
}

fn candidates() -> Vec<Candidate> {
    let mut list: Vec<Candidate> = Vec::new();
    let mut add = |method, text: String, model: Model| list.push(Candidate { method, text, model });
    for time_step in [0.005, 0.015, 0.05, 0.15, 0.25, 0.5, 1.0] {
        for damping in [0.005, 0.015, 0.05, 0.2, 0.6] {
            let model = RigidLinks { time_step, damping, ..RigidLinks::default() };
            let text = format!("time_step {time_step}, damping {damping}");
            add("rigid-links", text, Arc::new(model));
        }
    }
    for axial_ratio in [1.0, 4.0, 16.0, 64.0] {
        for damping in [0.75, 1.5, 3.0, 10.0, 30.0] {
            let model = MassSpring { axial_ratio, damping, max_iterations: 200_000, ..MassSpring::default() };
            let text = format!("axial_ratio {axial_ratio}, damping {damping}");
            add("mass-spring", text, Arc::new(model));
        }
    }
    for damping in [0.0, 20.0, 80.0, 300.0, 3e3, 1e4, 3e4, 1e5] {
        for axial_ratio in [10.0, 100.0, 1000.0] {
            let model = BeamFem { axial_ratio, damping, ..BeamFem::default() };
            let text = format!("axial_ratio {axial_ratio}, damping {damping}");
            add("beam-fem", text, Arc::new(model));
        }
    }
    for time_step in [0.3, 0.6, 0.9] {
        for damping in [0.75, 1.5, 3.0, 10.0, 30.0] {
            let model = DiscreteRod { time_step, damping, max_iterations: 200_000, ..DiscreteRod::default() };
            let text = format!("time_step {time_step}, damping {damping}");
            add("discrete-rod", text, Arc::new(model));
        }
    }
    list
}

/// Time and error of the cantilever at PL²/EI = 10 with 32 elements.
fn bend(model: &dyn RodModel) -> Option<(f64, f64)> {
    const N: usize = 32;
    let clock = Instant::now();
    let solution = cantilever(model, N, Vec3::new(0.0, -10.0, 0.0), 0.5 / (N * N) as f64).ok()?;
    let time_s = clock.elapsed().as_secs_f64();
    let tip = Vec3::new(1.0 - 0.554995597754, -0.810609024880, 0.0);
    solution.converged.then(|| (time_s, (solution.nodes[N] - tip).norm()))
}

/// Time for 160 mm into the curved tube on elements of 5 mm, and number of steps that did not converge.
fn insert(model: &Model, made: &GeneratedWall, sheath: Sheath, wire: &Device) -> Option<(f64, f64)> {
    let (wall, properties) = (made.wall.clone(), WallProperties::default());
    let options = InsertionOptions { element_mm: 5.0, ..InsertionOptions::default() };
    let method = Inserted::new(Arc::clone(model), options);
    let mut simulation = Simulation::builder(wall, wire.clone(), sheath)
        .properties(properties)
        .method(&method)
        .build()
        .ok()?;
    let clock = Instant::now();
    let mut unconverged = 0;
    for _ in 0..80 {
        unconverged += u32::from(!simulation.step(Command::advance(2.0)).ok()?.converged);
        if clock.elapsed() > LIMIT {
            return None;
        }
    }
    Some((clock.elapsed().as_secs_f64(), f64::from(unconverged)))
}

fn main() -> endowire_core::Result<()> {
    let list = candidates();
    let tree = anatomy::tree("curved_tube")
        .ok_or_else(|| endowire_core::Error::parameter("vessel", "curved_tube", "is not built in"))?;
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(0.8))?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0)?;
    let wire = Device::uniform(200.0, 0.445, 10.0)?;
    let asked: Vec<String> = std::env::args().skip(1).collect();
    for method in ["rigid-links", "mass-spring", "beam-fem", "discrete-rod"] {
        if !asked.is_empty() && !asked.iter().any(|name| name == method) {
            continue;
        }
        let own: Vec<&Candidate> = list.iter().filter(|c| c.method == method).collect();
        let show = |task: &str, quantity: &str, run: &dyn Fn(&Candidate) -> Option<(f64, f64)>| {
            let mut found: Vec<(f64, f64, &str)> =
                own.iter().filter_map(|c| run(c).map(|(t, e)| (t, e, c.text.as_str()))).collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
            println!("{method}, {task}: {} of {} sets come to an end", found.len(), own.len());
            for (time_s, value, text) in found.iter().take(SHOWN) {
                println!("  {:>10.3} ms  {quantity} {value:<9.2e} {text}", 1e3 * time_s);
            }
        };
        show("cantilever", "tip error", &|c| bend(&*c.model));
        show("insertion", "unconverged", &|c| insert(&c.model, &made, sheath, &wire));
    }
    Ok(())
}
