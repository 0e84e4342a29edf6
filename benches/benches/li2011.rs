//! Both solves of Li et al. 2011 against the number of elements.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use endowire_core::Vec3;
use endowire_methods::li2011::{Chain, Spring, banded, dense};

/// A wire of unit tangents with every other node on a wall.
fn chain(elements: usize) -> Chain {
    let mut chain = Chain::uniform(Vec3::zeros(), Vec3::x(), 200.0, elements, 20.0);
    chain.directions = vec![Vec3::x(); elements];
    for node in (2..=elements).step_by(2) {
        let angle = node as f64;
        let direction = Vec3::new(0.0, angle.cos(), angle.sin());
        chain.springs.push(Spring { node, direction, offset_mm: 0.1, stiffness_n_per_mm: 1.0 });
    }
    chain
}

fn solves(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("li2011");
    group.sample_size(20);
    for elements in [50, 100, 200, 300] {
        let chain = chain(elements);
        let (mut x, mut t) = (Vec::new(), Vec::new());
        let mut workspace = banded::Workspace::default();
        group.bench_function(BenchmarkId::new("banded", elements), |b| {
            b.iter(|| banded::solve(&chain, &mut workspace, &mut x, &mut t));
        });
        group.bench_function(BenchmarkId::new("dense", elements), |b| {
            b.iter(|| dense::solve(&chain, &mut x, &mut t));
        });
    }
    group.finish();
}

criterion_group!(benches, solves);
criterion_main!(benches);
