use std::f64::consts::PI;

use proptest::prelude::*;

use super::*;
use crate::vessel::{CentrelineNode, check};

fn tree(rows: &[([f64; 3], f64, i64)]) -> CentrelineTree {
    let node = |&(p, radius_mm, parent): &([f64; 3], f64, i64)| CentrelineNode {
        position_mm: Vec3::from(p),
        radius_mm,
        parent: usize::try_from(parent).ok(),
    };
    CentrelineTree::new(rows.iter().map(node).collect()).unwrap()
}

fn generate(tree: &CentrelineTree, edge_mm: f64) -> GeneratedWall {
    GeneratedWall::new(tree, Resolution::EdgeMm(edge_mm)).unwrap()
}

/// A trunk along z with a thinner branch at the angle given, degrees from the trunk.
fn fork(angle: f64, trunk: f64, branch: f64) -> CentrelineTree {
    let (sin, cos) = angle.to_radians().sin_cos();
    let along = |s: f64| [s * sin, 0.0, 40.0 + s * cos];
    tree(&[
        ([0.0, 0.0, 0.0], trunk, -1),
        ([0.0, 0.0, 40.0], trunk, 0),
        ([0.0, 0.0, 80.0], trunk, 1),
        (along(20.0), branch, 1),
        (along(40.0), branch, 3),
    ])
}

#[test]
fn the_volume_of_a_tube_converges_at_order_two() {
    let tube = tree(&[([1.0, 2.0, 3.0], 4.0, -1), ([11.0, 42.0, -27.0], 4.0, 0)]);
    let exact = PI * 16.0 * 2600.0_f64.sqrt();
    let error = |edge| (generate(&tube, edge).wall.volume_mm3() / exact - 1.0).abs();
    let (coarse, fine) = (error(1.0), error(0.5));
    assert!(coarse < 0.012, "{coarse}");
    assert!((coarse / fine - 4.0).abs() < 0.2, "{coarse} {fine}");
}

#[test]
fn a_coarse_table_of_a_circle_gives_a_smooth_torus() {
    // Pappus: V = π r² · length. Points are 20° apart; the spline's error is about the fourth power of that.
    let rows: Vec<_> = (0..=9)
        .map(|k| {
            let (sin, cos) = (20.0 * f64::from(k)).to_radians().sin_cos();
            ([30.0 * cos, 30.0 * sin, 0.0], 5.0, i64::from(k) - 1)
        })
        .collect();
    let made = generate(&tree(&rows), 0.4);
    let exact = PI * 25.0 * PI * 30.0;
    assert!((made.wall.volume_mm3() / exact - 1.0).abs() < 5e-3);
    assert!(check(made.wall.mesh()).unwrap().is_sound());
}

#[test]
fn a_cone_of_two_points_tapers_evenly() {
    let made = generate(&tree(&[([0.0; 3], 6.0, -1), ([0.0, 0.0, 60.0], 3.0, 0)]), 0.4);
    let exact = PI * 60.0 * (36.0 + 18.0 + 9.0) / 3.0;
    assert!((made.wall.volume_mm3() / exact - 1.0).abs() < 5e-3);
}

#[test]
fn forks_of_every_angle_are_sound_open_at_their_ends_and_closed_by_caps() {
    for (angle, trunk, branch) in [(90.0, 8.0, 4.0), (35.0, 6.0, 3.0), (140.0, 6.0, 3.0), (60.0, 5.0, 5.0)] {
        let made = generate(&fork(angle, trunk, branch), 1.2);
        let report = check(made.wall.mesh()).unwrap();
        assert!(report.is_sound(), "{angle}: {report:?}");
        assert_eq!((report.components, made.ends.len()), (1, 3));
        let closed = check(&made.wall.closed_mesh()).unwrap();
        assert!(closed.watertight && closed.is_sound(), "{angle}: {closed:?}");
        let inlet = &made.wall.openings()[made.inlet];
        assert!((inlet.direction + Vec3::z()).norm() < 1e-9 && inlet.centre_mm.z.abs() < 1e-9);
        assert!((inlet.radius_mm / trunk - 1.0).abs() < 1e-6, "{}", inlet.radius_mm);
        for v in &inlet.boundary {
            assert!(made.wall.mesh().vertices_mm[*v as usize].z.abs() < 1e-12, "the rim lies in its plane");
        }
        assert!(made.wall.contains(&Vec3::new(0.0, 0.0, 40.0)).unwrap());
    }
}

#[test]
fn away_from_forks_the_radius_is_kept_and_the_far_wall_does_not_bulge() {
    for (angle, trunk, branch) in [(90.0, 6.0, 3.0), (50.0, 5.0, 4.9)] {
        let made = generate(&fork(angle, trunk, branch), 1.0);
        let off = |v: &&Vec3| (v.x.hypot(v.y) / trunk - 1.0).abs();
        let far = made.wall.mesh().vertices_mm.iter().filter(|v| v.z < 30.0 || v.x < -0.3 * trunk);
        let worst = far.max_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
        assert!(off(&worst) < 5e-3, "{angle}: {worst} {}", off(&worst));
        // Counter-check: at the bifurcation itself the wall does leave the trunk's cylinder.
        assert!(made.wall.mesh().vertices_mm.iter().any(|v| off(&v) > 0.1));
    }
}

#[test]
fn a_fork_is_rounded_and_not_creased() {
    // The plain union of the two cylinders meets at 90°; in the fillet neighbouring triangles have smaller angles.
    let made = generate(&fork(90.0, 8.0, 4.0), 0.8);
    let mesh = made.wall.mesh();
    let normal = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(&(c - a)).normalize()
    };
    let across = EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len());
    let sharpest = (0..mesh.triangles.len())
        .flat_map(|t| across[t].into_iter().filter(|o| *o != u32::MAX).map(move |o| (t, o as usize)))
        .map(|(t, o)| normal(t).angle(&normal(o)).to_degrees())
        .fold(0.0, f64::max);
    assert!(sharpest < 45.0, "{sharpest}");
}

#[test]
fn a_triangle_count_is_met_and_thin_branches_stay_resolved() {
    let tree = fork(70.0, 12.0, 3.0);
    for wanted in [2_500, 8_000] {
        let made = GeneratedWall::new(&tree, Resolution::Triangles(wanted)).unwrap();
        let count = made.wall.mesh().triangles.len();
        assert!((count as f64 / wanted as f64 - 1.0).abs() < 0.03, "{count}");
        assert!(check(made.wall.mesh()).unwrap().is_sound());
        let thin = made.wall.openings().last().unwrap();
        assert!(thin.boundary.len() >= 8, "{}", thin.boundary.len());
    }
}

#[test]
fn an_end_inside_another_branch_and_a_tight_bend_are_refused_by_row() {
    // The branch is 40 mm long and stays inside a trunk of 41 mm.
    let message =
        GeneratedWall::new(&fork(90.0, 41.0, 3.0), Resolution::EdgeMm(1.0)).unwrap_err().to_string();
    assert!(message.starts_with("centreline row 4"), "{message}");
    let hairpin = tree(&[
        ([0., 0., 0.], 5.0, -1),
        ([0., 0., 30.], 5.0, 0),
        ([2., 0., 32.], 5.0, 1),
        ([4., 0., 0.], 5.0, 2),
    ]);
    let message = GeneratedWall::new(&hairpin, Resolution::EdgeMm(1.0)).unwrap_err().to_string();
    assert!(message.contains("bend radius"), "{message}");
    // No bend is tight here, but the vessel returns to where it was.
    let mut rows: Vec<_> = (0..=18)
        .map(|k| {
            let (sin, cos) = (20.0 * f64::from(k)).to_radians().sin_cos();
            ([30.0 * cos, 30.0 * sin, 0.2 * f64::from(k)], 5.0, i64::from(k) - 1)
        })
        .collect();
    let message = GeneratedWall::new(&tree(&rows), Resolution::EdgeMm(2.0)).unwrap_err().to_string();
    assert!(message.contains("the wall cuts itself near"), "{message}");
    rows.iter_mut().for_each(|row| row.0[2] *= 5.0);
    assert!(GeneratedWall::new(&tree(&rows), Resolution::EdgeMm(2.0)).is_ok());
}

#[test]
fn many_branches_from_one_point_are_meshed_or_refused_with_the_grid_that_was_tried() {
    let star = |count: u32, out_mm: f64| {
        let mut rows = vec![([0.0, 0.0, 0.0], 1.0, -1), ([0.0, 0.0, 6.0], 1.0, 0)];
        rows.extend((0..count).map(|k| {
            let (sin, cos) = (360.0 * f64::from(k) / f64::from(count)).to_radians().sin_cos();
            ([out_mm * cos, out_mm * sin, 9.0], 0.2, 1)
        }));
        GeneratedWall::new(&tree(&rows), Resolution::EdgeMm(0.5))
    };
    // In their narrow angles cells contain two pieces of surface.
    let report = check(star(20, 4.0).unwrap().wall.mesh()).unwrap();
    assert!(report.is_sound() && report.self_intersections == 0, "{report:?}");
    assert_eq!((report.components, report.openings.len()), (1, 21));
    let message = star(40, 6.0).unwrap_err().to_string();
    assert!(message.contains("a grid of 0.1"), "{message}");
}

#[test]
fn samples_are_found_as_by_looking_at_all_of_them() {
    let curved = tree(&[([0., 0., 0.], 0.5, -1), ([5., 0., 20.], 0.7, 0), ([0., 8., 40.], 0.4, 1)]);
    let field = Field::new(curve::branches(&curved).unwrap(), 1.0);
    let samples = &field.branches[0].samples;
    for k in 0..300 {
        let at = f64::from(k);
        let point = Vec3::new(9.0 * at.sin(), 9.0 * (1.7 * at).cos(), 0.15 * at - 2.0);
        let all = |reach: f64| {
            let distance = |k: u32| (samples[k as usize].position - point).norm();
            let nearest = (0..samples.len() as u32).map(distance).fold(f64::INFINITY, f64::min);
            (0..samples.len() as u32).filter(|&k| distance(k) <= nearest + reach).collect::<Vec<u32>>()
        };
        for reach in [0.0, 0.1, 3.0] {
            assert_eq!(field::near(&field.branches[0], &point, reach), all(reach), "{point}");
        }
        let every: Vec<u32> = (0..samples.len() as u32).collect();
        assert_eq!(field::nearest_of(&field.branches[0], &every, &point), all(0.0)[0]);
    }
}

#[test]
fn what_is_left_out_changes_no_bit_of_the_field() {
    let mut rows = vec![([0.0, 0.0, 0.0], 1.0, -1), ([0.0, 0.0, 6.0], 1.0, 0)];
    rows.extend((0..6).map(|k| {
        let (sin, cos) = (60.0 * f64::from(k)).to_radians().sin_cos();
        ([9.0 * cos, 9.0 * sin, 9.0], 0.5, 1)
    }));
    let built_in = ["aortic_arch", "hepatic"].map(|name| crate::vessel::anatomy::tree(name).unwrap());
    let trees = built_in.into_iter().chain([fork(35.0, 6.0, 3.0), fork(90.0, 8.0, 8.0), tree(&rows)]);
    let bits = |v: field::Value| (v.f.to_bits(), v.gradient.map(f64::to_bits), v.radius.to_bits());
    for tree in trees {
        let field = Field::new(curve::branches(&tree).unwrap(), 1.0);
        let mut turn = 0.0_f64;
        let mut direction = || {
            turn += 1.0;
            Vec3::new((1.3 * turn).sin(), (2.1 * turn).cos(), (0.7 * turn * turn).sin())
        };
        for k in 0..2000 {
            let branch = &field.branches[k % field.branches.len()];
            let sample = branch.samples[31 * k % branch.samples.len()];
            let reach = [0.2, 1.0, 4.0][k % 3] * sample.radius;
            let wide_at = sample.position + 1.5 * sample.radius * direction();
            let wide = std::sync::Arc::new(field.local(&wide_at, reach));
            let narrow_at = wide_at + 0.25 * reach * direction();
            let narrow = field.narrowed(&wide, &field.sound(&wide, &narrow_at), 0.5 * reach);
            // In the narrow ball, and beyond it in the wide one.
            for within in [0.25, 0.5] {
                let point = narrow_at + within * 0.6 * reach * direction();
                if (point - wide_at).norm() > reach {
                    continue;
                }
                let all = bits(field.value_of_all(&wide, &point));
                assert_eq!(bits(field.value(&wide, &point)), all, "{point}");
                assert_eq!(bits(field.value(&narrow, &point)), all, "{point}");
            }
        }
    }
}

#[test]
fn absurd_resolutions_are_refused_with_a_reason() {
    let fork = fork(90.0, 8.0, 4.0);
    for edge in [0.0, -1.0, f64::NAN, f64::INFINITY, 9.0, 1e-6, 1e-300] {
        let error = GeneratedWall::new(&fork, Resolution::EdgeMm(edge)).unwrap_err();
        assert!(error.to_string().starts_with("edge_mm = "), "{edge}: {error}");
    }
    for count in [0, usize::MAX, 3] {
        let error = GeneratedWall::new(&fork, Resolution::Triangles(count)).unwrap_err();
        assert!(error.is_input(), "{count}: {error}");
    }
}

#[test]
fn gradients_agree_with_differences_away_from_blends() {
    let curved = tree(&[([0., 0., 0.], 3.0, -1), ([5., 0., 20.], 4.0, 0), ([0., 8., 40.], 2.0, 1)]);
    let field = Field::new(curve::branches(&curved).unwrap(), 1.0);
    let point = Vec3::new(4.0, 5.0, 18.0);
    let value = field.branch_alone(0, &point);
    let step = 1e-5;
    let difference = Vec3::from_fn(|axis, _| {
        let at = |sign: f64| {
            let mut p = point;
            p[axis] += sign * step;
            field.branch_alone(0, &p).f
        };
        (at(1.0) - at(-1.0)) / (2.0 * step)
    });
    assert!((difference - value.gradient).norm() < 1e-6, "{difference} {}", value.gradient);
}

proptest! {
    #![proptest_config(crate::vessel::tests::steady(12))]
    #[test]
    fn any_tree_gives_a_wall_or_an_error_but_never_a_panic(
        rows in prop::collection::vec((prop::array::uniform3(-40.0f64..40.0), 0.5f64..6.0, any::<prop::sample::Index>()), 2..7)
    ) {
        let nodes = rows.iter().enumerate().map(|(row, (p, radius_mm, parent))| CentrelineNode {
            position_mm: Vec3::from(*p), radius_mm: *radius_mm, parent: (row > 0).then(|| parent.index(row)),
        }).collect();
        if let Ok(made) = GeneratedWall::new(&CentrelineTree::new(nodes).unwrap(), Resolution::EdgeMm(2.0)) {
            prop_assert_eq!(made.wall.report().non_manifold_edges, 0);
            prop_assert!(made.wall.volume_mm3() > 0.0);
        }
    }
}

#[test]
fn a_tree_of_thousands_of_branches_is_refused_before_a_grid_is_made() {
    let node = |x: f64, y: f64, radius_mm: f64, parent| crate::vessel::CentrelineNode {
        position_mm: Vec3::new(x, y, 0.0),
        radius_mm,
        parent,
    };
    let mut nodes = vec![node(0.0, 0.0, 4.0, None)];
    nodes.extend((0..6000).map(|k| node(20.0 + 0.02 * f64::from(k), 10.0, 1.0, Some(0))));
    let tree = CentrelineTree::new(nodes).unwrap();
    let error = GeneratedWall::new(&tree, Resolution::EdgeMm(1.0)).unwrap_err().to_string();
    assert!(error.starts_with("centreline rows = 6001: the first "), "{error}");
    assert!(error.contains("at most 5000 branches and 2000000 samples"), "{error}");
}

#[test]
fn a_closed_end_is_half_a_ball_and_no_opening() {
    let (radius, length) = (2.0, 20.0);
    let tube =
        tree(&[([0.0; 3], radius, -1), ([0.0, 0.0, 10.0], radius, 0), ([0.0, 0.0, length], radius, 1)]);
    let open = generate(&tube, 0.3);
    let closed = generate(&tube.clone().with_closed_ends(vec![2]).unwrap(), 0.3);
    assert_eq!((open.ends.len(), closed.ends.len(), closed.wall.openings().len()), (2, 1, 1));
    let (tube_mm3, cap_mm3) = (PI * radius * radius * length, 2.0 / 3.0 * PI * radius.powi(3));
    let off = |found: f64, expected: f64| (found / expected - 1.0).abs();
    assert!(off(closed.wall.volume_mm3(), tube_mm3 + cap_mm3) < 0.01, "{}", closed.wall.volume_mm3());
    assert!(off(closed.wall.volume_mm3(), tube_mm3) > 0.05, "the cap is seen");
    let top = closed.wall.mesh().vertices_mm.iter().map(|v| v.z).fold(0.0, f64::max);
    assert!((top - length - radius).abs() < 0.02, "{top}");
    // Only leaves can be closed.
    for row in [0, 1, 3] {
        let error = tube.clone().with_closed_ends(vec![row]).unwrap_err().to_string();
        assert!(error.contains(&format!("closed end, row = {row}")), "{error}");
    }
}
