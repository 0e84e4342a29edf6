//! A wire in a dirty surface lies where it lies in the clean one: the mesh is no part of the physics.
//!
//! Clean walls are spoiled in ten ways (`endowire_tests::spoiled`), and the same wire goes the same way into both. The long run:
//! `cargo test --release -p endowire-tests --test validation spoiled_surfaces:: -- --ignored --nocapture`.

#![allow(clippy::print_stdout, reason = "tables are printed")]

use std::collections::BTreeMap;

use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::Sheath;
use endowire_core::vessel::{
    CentrelineNode, CentrelineTree, GeneratedWall, Resolution, SurfaceMesh, anatomy,
};
use endowire_tests::spoiled::{self, Spoil, WAYS, deviation_mm};
use endowire_tests::twin::{Inserted, Push, apart_mm};

/// How far the wall that is felt may be from the surface that is given, mm: the default limit of the wall's own conditioning. To be
/// replaced by the deviation that a wall reports of itself.
const FELT_MM: f64 = 0.1;
/// What the shape may depart beyond the deviations of the surface, mm.
const SHAPE_MM: f64 = 0.05;
/// What the push force may depart, as a part of that in the clean wall.
const FORCE: f64 = 0.05;
/// Surfaces that are nearer than this, mm, are one geometry. Farther apart, the force may be any between those in clean walls that are
/// wider and narrower by the deviation: a force depends on where the wall is.
const SAME_MM: f64 = 0.02;
/// How much finer than others a mesh is that gets decimated to a fiftieth of its triangles.
const FINER: f64 = 0.4;

/// A vessel through which a wire finds one way only.
struct Course {
    name: &'static str,
    /// Its centre line, wider by so much, mm.
    tree: fn(f64) -> CentrelineTree,
    edge_mm: f64,
    stiffness_nmm2: f64,
    length_mm: f64,
}

const COURSES: [Course; 3] = [
    Course { name: "curved tube", tree: curved_tube, edge_mm: 1.2, stiffness_nmm2: 10.0, length_mm: 180.0 },
    Course { name: "arch", tree: arch, edge_mm: 2.5, stiffness_nmm2: 50.0, length_mm: 270.0 },
    Course { name: "fork in a bend", tree: fork, edge_mm: 1.0, stiffness_nmm2: 10.0, length_mm: 100.0 },
];

fn widened(nodes: &[CentrelineNode], by_mm: f64) -> CentrelineTree {
    let wider = |n: &CentrelineNode| CentrelineNode { radius_mm: n.radius_mm + by_mm, ..*n };
    CentrelineTree::new(nodes.iter().map(wider).collect()).unwrap()
}

fn curved_tube(by_mm: f64) -> CentrelineTree {
    widened(anatomy::tree("curved_tube").unwrap().nodes(), by_mm)
}

/// The aorta without its branches, from the descending aorta through the arch: no wire catches on an ostium by luck.
fn arch(by_mm: f64) -> CentrelineTree {
    let tree = anatomy::tree("aortic_arch").unwrap();
    let trunk = tree.nodes().iter().enumerate().take_while(|(i, n)| n.parent == i.checked_sub(1));
    widened(&trunk.map(|(_, n)| *n).collect::<Vec<_>>(), by_mm)
}

/// A bend with a branch on its inner side; a wire leans on the outer one.
fn fork(by_mm: f64) -> CentrelineTree {
    let bend_mm = 40.0;
    let mut nodes: Vec<CentrelineNode> = Vec::new();
    let mut add = |position_mm: Vec3, radius_mm: f64, parent: Option<usize>| {
        nodes.push(CentrelineNode { position_mm, radius_mm, parent });
    };
    for k in 0..=15 {
        add(Vec3::z() * (2.0 * f64::from(k)), 4.0, (k as usize).checked_sub(1));
    }
    for k in 1..=24 {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_2 / 24.0).sin_cos();
        add(Vec3::new(bend_mm * (1.0 - cos), 0.0, 30.0 + bend_mm * sin), 4.0, Some(14 + k as usize));
    }
    for k in 1..=15 {
        add(Vec3::new(bend_mm + 2.0 * f64::from(k), 0.0, 30.0 + bend_mm), 4.0, Some(38 + k as usize));
    }
    // From the middle of the bend towards its centre.
    let inwards = Vec3::new(1.0, 0.0, -1.0).normalize();
    let from = Vec3::new(bend_mm, 0.0, 30.0) - inwards * bend_mm;
    add(from + inwards * 10.0, 2.0, Some(15 + 12));
    add(from + inwards * 18.0, 2.0, Some(55));
    add(from + inwards * 26.0, 2.0, Some(56));
    widened(&nodes, by_mm)
}

/// A course with its clean wall, and the wire in it.
struct Clean {
    course: &'static Course,
    mesh: SurfaceMesh,
    push: Push,
    inserted: Inserted,
}

impl Course {
    fn wall(&self, by_mm: f64, edge_mm: f64) -> GeneratedWall {
        GeneratedWall::new(&(self.tree)(by_mm), Resolution::EdgeMm(edge_mm)).unwrap()
    }

    fn clean(&'static self) -> Clean {
        let made = self.wall(0.0, self.edge_mm);
        let push = Push {
            sheath: Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap(),
            wire: Device::uniform(self.length_mm + 10.0, 0.445, self.stiffness_nmm2).unwrap(),
            length_mm: self.length_mm,
            step_mm: 1.0,
        };
        let mesh = made.wall.mesh().clone();
        let inserted = push.insert(&mesh).unwrap();
        Clean { course: self, mesh, push, inserted }
    }
}

/// How a wire in another surface compares.
struct Compared {
    deviation_mm: f64,
    apart_mm: f64,
    force_n: f64,
    /// Departure of the force, as a part of the clean one.
    force_off: f64,
}

impl Compared {
    fn passes(&self) -> bool {
        self.apart_mm <= self.deviation_mm + FELT_MM + SHAPE_MM && self.force_off <= FORCE
    }
}

impl Clean {
    /// Inserts into `surface`, that is `deviation_mm` from the clean one.
    fn compare(&self, surface: &SurfaceMesh, deviation_mm: f64) -> Result<Compared, String> {
        let inserted = self.push.insert(surface)?;
        let clean = self.inserted.push_force_n;
        let (mut low, mut high) = (clean, clean);
        if deviation_mm > SAME_MM {
            for by_mm in [-deviation_mm, deviation_mm] {
                let wall = self.course.wall(by_mm, self.course.edge_mm).wall;
                let force = self.push.insert(wall.mesh())?.push_force_n;
                (low, high) = (low.min(force), high.max(force));
            }
        }
        let force_n = inserted.push_force_n;
        let off = (low - force_n).max(force_n - high).max(0.0);
        Ok(Compared {
            deviation_mm,
            apart_mm: apart_mm(&inserted.points, &self.inserted.points),
            force_n,
            force_off: off / clean.abs(),
        })
    }

    /// Spoils the wall and compares; prints the row, and tells what failed.
    fn spoiled(&self, (name, spoil): (&str, Spoil), seed: u64) -> Option<String> {
        let base = if name == "decimated" {
            self.course.wall(0.0, FINER * self.course.edge_mm).wall.mesh().clone()
        } else {
            self.mesh.clone()
        };
        let surface = spoil(&base, seed);
        let deviation = deviation_mm(&surface, &self.mesh);
        let row = match self.compare(&surface, deviation) {
            Ok(c) => format!(
                "{} apart {:.3} mm (may {:.3}), force {:.4} N, clean {:.4} N, off by {:.1} % (may {:.0} %)",
                if c.passes() { "pass" } else { "FAIL" },
                c.apart_mm,
                deviation + FELT_MM + SHAPE_MM,
                c.force_n,
                self.inserted.push_force_n,
                100.0 * c.force_off,
                100.0 * FORCE
            ),
            Err(reason) => format!("FAIL {reason}"),
        };
        let row = format!(
            "{:<15} {name:<14} seed {seed}: {:>6} triangles, {deviation:.3} mm off: {row}",
            self.course.name,
            surface.triangles.len()
        );
        println!("{row}");
        row.contains(": FAIL").then_some(row)
    }
}

fn all(courses: &'static [Course], seeds: std::ops::RangeInclusive<u64>) {
    let mut failed = Vec::new();
    let mut rows = 0;
    for course in courses {
        let clean = course.clean();
        for way in WAYS {
            for seed in seeds.clone() {
                rows += 1;
                failed.extend(clean.spoiled(way, seed));
            }
        }
    }
    println!("{} of {rows} pass", rows - failed.len());
    assert!(failed.is_empty(), "{} of {rows} fail:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn a_wire_in_a_spoiled_tube_lies_where_it_lies_in_the_clean_one() {
    all(&COURSES[..1], 1..=1);
}

#[test]
#[ignore = "minutes"]
fn a_wire_in_any_spoiled_vessel_lies_where_it_lies_in_the_clean_one() {
    all(&COURSES, 1..=3);
}

/// Why the wide arch cannot be held to the deviation: in it a wire lies on the outer wall, along which it is free to move, as a ball in a
/// bowl. Waves of a tenth of a millimetre, smooth and evenly meshed, move it by several times as much.
#[test]
#[ignore = "minutes"]
fn smooth_waves_move_a_wire_in_a_wide_arch_by_several_times_their_height() {
    const HEIGHT_MM: f64 = 0.1;
    let most = |course: &'static Course| {
        let clean = course.clean();
        let mut most = 0.0f64;
        for wavelength_mm in [15.0, 30.0, 60.0] {
            for k in 0..3 {
                let mut surface = clean.mesh.clone();
                for v in &mut surface.vertices_mm {
                    v[(k + 1) % 3] += HEIGHT_MM * (v[k] / wavelength_mm * std::f64::consts::TAU).sin();
                }
                let c = clean.compare(&surface, deviation_mm(&surface, &clean.mesh)).unwrap();
                println!(
                    "{:<15} waves of {wavelength_mm:>2} mm along {}, {:.3} mm off: apart {:.3} mm, force {:.4} N",
                    course.name,
                    ["x", "y", "z"][k],
                    c.deviation_mm,
                    c.apart_mm,
                    c.force_n
                );
                most = most.max(c.apart_mm);
            }
        }
        most
    };
    let [tube, arch] = [&COURSES[0], &COURSES[1]].map(most);
    // In a tube as wide as a few devices the wire goes where the wall goes.
    assert!(tube < HEIGHT_MM + FELT_MM + SHAPE_MM, "{tube}");
    assert!(arch > HEIGHT_MM + FELT_MM + SHAPE_MM, "{arch}");
}

#[test]
fn another_mesh_of_the_same_vessel_passes_and_another_vessel_does_not() {
    let clean = COURSES[0].clean();
    assert!(clean.inserted.push_force_n > 0.0);
    let other = COURSES[0].wall(0.0, 0.9).wall.mesh().clone();
    let deviation = deviation_mm(&other, &clean.mesh);
    assert!(deviation < 0.1, "{deviation}");
    let same = clean.compare(&other, deviation).unwrap();
    assert!(same.passes(), "{:.3} mm apart, force off by {:.3}", same.apart_mm, same.force_off);
    // A tube that is wider or narrower: the shape tells.
    for by_mm in [-0.5, 0.5] {
        let wall = COURSES[0].wall(by_mm, 1.2).wall;
        let measured = deviation_mm(wall.mesh(), &clean.mesh);
        assert!((measured - 0.5).abs() < 0.12, "{measured}");
        let twin = clean.compare(wall.mesh(), 0.0).unwrap();
        assert!(twin.apart_mm > FELT_MM + SHAPE_MM && !twin.passes(), "{} mm apart", twin.apart_mm);
    }
    // A tube of tighter bend: the force tells, which hangs on the curvature (1/0.9² for 1/0.9).
    let mut tighter = clean.mesh.clone();
    tighter.vertices_mm.iter_mut().for_each(|v| *v *= 0.9);
    let twin = clean.compare(&tighter, 0.0).unwrap();
    assert!(twin.force_off > FORCE && !twin.passes(), "force off by {}", twin.force_off);
}

/// Shortest and longest edge, mm, and least height of a triangle over its longest edge.
fn extremes(mesh: &SurfaceMesh) -> (f64, f64, f64) {
    let (mut short, mut long, mut thin) = (f64::MAX, 0.0f64, f64::MAX);
    for index in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(index);
        let edges = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
        let longest = edges.into_iter().fold(0.0, f64::max);
        short = edges.into_iter().fold(short, f64::min);
        long = long.max(longest);
        thin = thin.min((b - a).cross(&(c - a)).norm() / (longest * longest));
    }
    (short, long, thin)
}

/// Edges of one triangle alone.
fn open_edges(mesh: &SurfaceMesh) -> usize {
    let mut count = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *count.entry((from.min(to), from.max(to))).or_insert(0) += 1;
        }
    }
    count.values().filter(|triangles| **triangles == 1).count()
}

#[test]
fn every_way_spoils_what_it_says_and_keeps_the_geometry() {
    let base = COURSES[0].wall(0.0, 1.2).wall.mesh().clone();
    let (short, long, thin) = extremes(&base);
    for (name, spoil) in WAYS {
        let surface = spoil(&base, 1);
        assert_eq!(surface, spoil(&base, 1), "{name} is the same every time");
        assert_ne!(surface, spoil(&base, 2), "{name} is another for another seed");
        let deviation = deviation_mm(&surface, &base);
        let (shortest, longest, thinnest) = extremes(&surface);
        println!(
            "{name:<14} {:>6} triangles, {deviation:.4} mm off, edges {shortest:.4} to {longest:.2} mm, thinnest {thinnest:.1e}, \
             {} open edges",
            surface.triangles.len(),
            open_edges(&surface)
        );
        let bound = match name {
            "flips" => 1e-12,
            "slivers" => 1e-9,
            "noise 0.05 mm" | "dirt" => 0.0501,
            "torn" => 0.4,
            "overlaps" => 0.12,
            "decades" => 0.25,
            "noise 0.3 mm" => 0.301,
            "folds" => 0.6,
            // A fiftieth of these triangles is too few for the tube: edges of its diameter.
            _ => 5.0,
        };
        assert!(deviation <= bound, "{name}: {deviation}");
        let (before, after) = (base.triangles.len(), surface.triangles.len());
        match name {
            "decades" => assert!(longest / shortest > 1e3 && shortest < 0.1 * short, "{shortest} {longest}"),
            "slivers" => assert!(thinnest < 0.02 * thin && after > before),
            "flips" => {
                let turned = base.triangles.iter().zip(&surface.triangles).filter(|(a, b)| a != b).count();
                assert!(turned > before / 4);
            }
            "torn" => assert!(open_edges(&surface) > open_edges(&base) + 30 && after < before),
            "overlaps" | "dirt" => assert!(after > before),
            "decimated" => assert!(after <= before / 25 && longest > 2.0 * long, "{after} of {before}"),
            _ => assert_eq!(after, before),
        }
    }
    // Not one of the ways alone: seeds differ.
    assert_ne!(spoiled::noise(&base, 1, 0.1), base);
}
