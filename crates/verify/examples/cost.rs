//! cost SCENE [print]
#![allow(clippy::all, clippy::pedantic)]
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;
fn cpu_ms() -> f64 {
    let s = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    s.split_whitespace().next().unwrap().parse::<f64>().unwrap() / 1e6
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let scene = Scene::read(std::path::Path::new(&a[1])).unwrap();
    let t0 = cpu_ms();
    let device = scene.device().unwrap();
    let mut sim = scene.simulation(&NoStore).unwrap();
    println!("setup {:.1} ms", cpu_ms() - t0);
    let mut ms = vec![];
    let (mut its, mut nodes) = (0u64, 0u64);
    let mut slow = (0.0, 0);
    for (k, c) in scene.commands(&device).unwrap().into_iter().enumerate() {
        let t = cpu_ms();
        match sim.step(c) {
            Ok(r) => {
                let d = cpu_ms() - t;
                its += r.iterations as u64;
                let n = r.contacts.len();
                if a.len() > 2 {
                    println!(
                        "{:4} {:7.2} ms its {:4} sub {} slides {} rel {} contacts {} nodes {} jumped {} pen {:.3} push {:.4} im {:.1e}",
                        k + 1,
                        d,
                        r.iterations,
                        r.substeps,
                        r.slides,
                        r.relaxations,
                        n,
                        r.nodes_solved - nodes,
                        r.jumped,
                        r.max_penetration_mm,
                        r.push_force_n,
                        r.imbalance
                    );
                }
                nodes = r.nodes_solved;
                if d > slow.0 {
                    slow = (d, k + 1);
                }
                ms.push(d);
            }
            Err(e) => {
                println!("{} {e}", k + 1);
                break;
            }
        }
    }
    let total: f64 = ms.iter().sum();
    ms.sort_by(|a, b| a.total_cmp(b));
    println!(
        "{} steps total {:.1} ms, mean {:.3} median {:.3} p90 {:.3} max {:.1} at {}, its {} nodes {} us per it {:.2} us per node {:.3}",
        ms.len(),
        total,
        total / ms.len() as f64,
        ms[ms.len() / 2],
        ms[ms.len() * 9 / 10],
        slow.0,
        slow.1,
        its,
        nodes,
        1e3 * total / its as f64,
        1e3 * total / nodes as f64
    );
}
