//! The speed bars of the insertion, medians of many steps. Timing: run by hand, alone, with `--release -- --ignored
//! --nocapture`.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::statics::{StaticCase, StaticProblem};
use endowire_core::vessel::{GeneratedWall, Resolution, WallQuery, anatomy};

/// Seconds of one iteration of a free rod of `n` elements under a load at its tip, median of many solves.
fn free_iteration(n: usize) -> f64 {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cases/tip_force.toml");
    let mut case = StaticCase::from_file(&path).unwrap();
    case.rod.elements = n;
    let problem = StaticProblem::new(&case).unwrap();
    median((0..31).map(|_| {
        let clock = Instant::now();
        let solved = black_box(problem.solve_state().unwrap());
        clock.elapsed().as_secs_f64() / problem.solution(&solved).iterations as f64
    }))
}

/// Seconds of one query at each of `points`, as far as 3 mm, median of many.
fn queries(query: &WallQuery, points: &[Vec3]) -> f64 {
    median((0..101).map(|_| {
        let clock = Instant::now();
        for x in points {
            black_box(query.nearest(black_box(x), 3.0));
        }
        clock.elapsed().as_secs_f64()
    }))
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A wire in a vessel.
struct Case {
    anatomy: &'static str,
    triangles: usize,
    friction: f64,
    element_mm: f64,
    step_mm: f64,
    /// Inserted before the clock starts, and with it.
    from_mm: f64,
    to_mm: f64,
}

#[derive(Debug)]
struct Cost {
    median_s: f64,
    p99_s: f64,
    total_s_per_mm: f64,
    iterations: f64,
    /// Cost of an iteration over that of one of a free rod and as many queries as there are elements.
    ratio: f64,
    tip_mm: Vec3,
}

fn cost(case: &Case) -> Cost {
    let made =
        GeneratedWall::new(&anatomy::tree(case.anatomy).unwrap(), Resolution::Triangles(case.triangles))
            .unwrap();
    let query = WallQuery::new(&made.wall).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0).unwrap();
    let wire = Device::new(vec![Section::straight(30.0, 0.445, 5.0), Section::straight(430.0, 0.445, 50.0)]);
    let method = KirchhoffOptions { element_mm: case.element_mm, ..Default::default() };
    let properties = WallProperties { friction: case.friction, ..Default::default() };
    let mut simulation = Simulation::builder(made.wall, wire.unwrap(), sheath)
        .properties(properties)
        .method(&method)
        .build()
        .unwrap();
    for _ in 0..(case.from_mm / case.step_mm).round() as usize {
        simulation.step(Command::advance(case.step_mm)).unwrap();
    }
    let (mut seconds, mut iterations) = (Vec::new(), Vec::new());
    let count = ((case.to_mm - case.from_mm) / case.step_mm).round() as usize;
    for _ in 0..count {
        let clock = Instant::now();
        let report = simulation.step(Command::advance(case.step_mm)).unwrap();
        seconds.push(clock.elapsed().as_secs_f64());
        iterations.push(f64::from(report.iterations));
    }
    let elements = simulation.shape().positions_mm.len() - 1;
    let unit = free_iteration(elements) + queries(&query, &simulation.shape().positions_mm[1..]);
    let mut sorted = seconds.clone();
    sorted.sort_by(f64::total_cmp);
    let median_s = sorted[count / 2];
    let each = seconds.iter().zip(&iterations).map(|(s, i)| s / i.max(1.0) / unit);
    Cost {
        median_s,
        p99_s: sorted[count * 99 / 100],
        total_s_per_mm: seconds.iter().sum::<f64>() / (case.to_mm - case.from_mm),
        iterations: median(iterations.iter().copied()),
        ratio: median(each),
        tip_mm: simulation.shape().tip_mm().unwrap(),
    }
}

const ARCH: Case = Case {
    anatomy: "aortic_arch",
    triangles: 20_000,
    friction: 0.0,
    element_mm: 1.0,
    step_mm: 0.5,
    from_mm: 225.0,
    to_mm: 300.0,
};

#[test]
#[ignore = "timing"]
fn a_step_in_the_arch_costs_a_few_solves_and_does_not_depend_on_the_mesh() {
    for friction in [0.0, 0.1] {
        let coarse = cost(&Case { friction, ..ARCH });
        let fine = cost(&Case { friction, triangles: 200_000, ..ARCH });
        for (triangles, c) in [(20_000, &coarse), (200_000, &fine)] {
            println!(
                "friction {friction}, {triangles} triangles, 300 elements: median {:.0} µs, p99 / median {:.1}, {} iterations, \
                 iteration / (a free rod's + 300 queries) {:.2}",
                1e6 * c.median_s,
                c.p99_s / c.median_s,
                c.iterations,
                c.ratio
            );
        }
        println!("friction {friction}: 200,000 / 20,000 triangles {:.2}", fine.median_s / coarse.median_s);
    }
}

#[test]
#[ignore = "timing"]
fn a_millimetre_of_a_wire_with_friction() {
    // SOFA BeamAdapter, one thread: ms per mm at 100, 200 and 300 elements.
    for (anatomy, triangles, to_mm) in [("aortic_arch", 20_000, 300.0), ("curved_tube", 4_000, 220.0)] {
        for (elements, peer) in [(100.0, 16.0), (200.0, 29.0), (300.0, 50.0)] {
            let element_mm = 460.0 / elements;
            for step_mm in [0.25, 1.0, 2.0] {
                let case =
                    Case { anatomy, triangles, friction: 0.1, element_mm, step_mm, from_mm: 0.0, to_mm };
                let c = cost(&case);
                println!(
                    "{anatomy}, elements of {element_mm:.2} mm, steps of {step_mm} mm: {:.3} ms/mm, {:.0} times faster than {peer} \
                     ms/mm; tip at {:.3} {:.3} {:.3}",
                    1e3 * c.total_s_per_mm,
                    peer / (1e3 * c.total_s_per_mm),
                    c.tip_mm.x,
                    c.tip_mm.y,
                    c.tip_mm.z
                );
            }
        }
    }
}
