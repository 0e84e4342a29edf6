//! Vessels whose branches meet again: both arms are found, with their lengths and radii.

use std::f64::consts::{PI, TAU};

use super::classes::Classes;
use super::ways::{Beside, Ways};
use super::*;
use crate::vessel::{CentrelineLink, CentrelineNode, CentrelinePath, GeneratedWall, Resolution, SurfaceMesh};

/// Points of a centre line as they are added.
#[derive(Default)]
struct Line(Vec<CentrelineNode>);

impl Line {
    fn add(&mut self, position_mm: Vec3, radius_mm: f64, parent: Option<usize>) -> usize {
        self.0.push(CentrelineNode { position_mm, radius_mm, parent });
        self.0.len() - 1
    }

    /// A branch behind a row; its last row.
    fn branch(&mut self, parent: usize, radius_mm: f64, places: impl IntoIterator<Item = Vec3>) -> usize {
        places.into_iter().fold(parent, |at, place| self.add(place, radius_mm, Some(at)))
    }

    fn tree(self, links: &[[usize; 2]]) -> CentrelineTree {
        let links = links.iter().map(|&[row, joins]| CentrelineLink { row, joins }).collect();
        CentrelineTree::new(self.0).unwrap().with_links(links).unwrap()
    }
}

fn wall(tree: &CentrelineTree, edge_mm: f64) -> Wall {
    GeneratedWall::new(tree, Resolution::EdgeMm(edge_mm)).unwrap().wall
}

fn on_circle(angle: f64, radius_mm: f64) -> Vec3 {
    Vec3::new(radius_mm * angle.cos(), radius_mm * angle.sin(), 0.0)
}

/// A ring of this radius with an inlet at angle 0 and outlets at these angles, all 25 mm long along its radius.
fn ring(ring_mm: f64, lumen_mm: f64, outlets: &[f64]) -> CentrelineTree {
    let mut line = Line::default();
    let inlet = line.add(on_circle(0.0, ring_mm + 25.0), lumen_mm, None);
    let fork = line.branch(inlet, lumen_mm, [on_circle(0.0, ring_mm)]);
    let steps = 36;
    let angle = |k: i32| PI * f64::from(k) / f64::from(steps);
    let first = line.0.len();
    let end = line.branch(fork, lumen_mm, (1..=steps).map(|k| on_circle(angle(k), ring_mm)));
    let other = line.branch(fork, lumen_mm, (1..steps).map(|k| on_circle(-angle(k), ring_mm)));
    for outlet in outlets {
        let k = (outlet / PI * f64::from(steps)).round() as usize;
        line.branch(first + k - 1, lumen_mm, [on_circle(*outlet, ring_mm + 25.0)]);
    }
    line.tree(&[[other, end]])
}

/// The part by which a value is off.
fn off(value: f64, exact: f64) -> f64 {
    (value / exact - 1.0).abs()
}

/// The path over the middle of an arm.
fn by_arm(tree: &CentrelineTree, arm: &str, to: &str) -> CentrelinePath {
    let place = |name: &str| tree.nodes()[tree.target(name).unwrap().row].position_mm;
    tree.path_via(&place(arm), &place(to)).unwrap()
}

#[test]
fn both_arms_of_a_ring_are_found_with_their_lengths_and_radii() {
    let (ring_mm, lumen_mm, outlet) = (15.0, 3.0, TAU / 3.0);
    let wall = wall(&ring(ring_mm, lumen_mm, &[outlet]), 0.6);
    let found = ExtractedCentreline::of(&wall, None, &[]).unwrap();
    let tree = &found.tree;
    assert_eq!((found.rings, tree.links().len()), (Some(1), 1));
    let [short, long] = [ring_mm * outlet, ring_mm * (TAU - outlet)];
    let end = tree.targets()[0].clone();
    let by_short = tree.path_to(end.row).unwrap();
    let by_long = by_arm(tree, "arm 1", &end.name);
    // Paths cut the corners at the forks, by half a radius in all.
    let ways = |scale: f64| {
        [(by_short.length_mm(), short), (by_long.length_mm(), long)]
            .map(|(found, arm)| off(found, scale * (50.0 + arm)))
    };
    let arms = |scale: f64| {
        let arm = |is_long: bool| {
            let mut all = tree.branches().into_iter();
            all.find(|b| b.joins.is_some() == is_long && b.from > 0).unwrap().length_mm
        };
        [off(arm(false), scale * short), off(arm(true), scale * long)]
    };
    // Radii, away from the forks by two of them.
    let axis = |angle: f64| on_circle(angle, ring_mm);
    let forks = [axis(0.0), axis(outlet)];
    let is_clear =
        |node: &&CentrelineNode| forks.iter().all(|fork| (node.position_mm - fork).norm() > 2.0 * lumen_mm);
    let inner: Vec<&CentrelineNode> = tree.nodes().iter().filter(is_clear).collect();
    let radii = |exact: f64| inner.iter().map(|node| off(node.radius_mm, exact)).fold(0.0, f64::max);
    let told = format!("{:?} {:?} {}", ways(1.0), arms(1.0), radii(lumen_mm));
    assert!(arms(1.0).iter().all(|off| *off < 0.01) && ways(1.0).iter().all(|off| *off < 0.015), "{told}");
    assert!(radii(lumen_mm) < 0.02 && inner.len() > 60);
    // The twins: lengths and radii that are 3 % off are seen.
    assert!(ways(1.03).into_iter().chain(arms(1.03)).all(|off| off > 0.01) && radii(1.03 * lumen_mm) > 0.02);
    // Its table says the same, and so does the same wall again.
    let table = tree.table("a ring");
    assert_eq!(CentrelineTree::from_bytes(table.as_bytes(), "ring.csv".as_ref()).unwrap(), *tree);
    assert_eq!(ExtractedCentreline::of(&wall, None, &[]).unwrap(), found);
}

#[test]
fn outlets_on_both_arms_leave_one_arm_to_be_found() {
    let wall = wall(&ring(18.0, 2.0, &[TAU / 6.0, TAU / 3.0]), 0.5);
    let found = ExtractedCentreline::of(&wall, None, &[]).unwrap();
    assert_eq!((found.rings, found.tree.links().len(), found.tree.targets().len()), (Some(1), 1, 3));
    // All the way around: each stretch of the ring is in the line once.
    let on_ring = |row: usize| off(found.tree.nodes()[row].position_mm.norm(), 18.0) < 0.1;
    let branches = found.tree.branches();
    let ring_mm: f64 =
        branches.iter().filter(|b| on_ring(b.to) && on_ring(b.from)).map(|b| b.length_mm).sum();
    assert!(off(ring_mm, TAU * 18.0) < 0.015, "{ring_mm} {branches:?}");
}

/// A straight vessel along z with two loops beside it, which leave and join it obliquely.
fn loops() -> CentrelineTree {
    let mut line = Line::default();
    let root = line.add(Vec3::zeros(), 2.5, None);
    let trunk_end = line.branch(root, 2.5, (1..=26).map(|k| Vec3::z() * (5.0 * f64::from(k))));
    assert_eq!(trunk_end, 26);
    let mut beside = |from: usize, to: usize, side: f64| {
        let (a, b) = (5.0 * from as f64, 5.0 * to as f64);
        let place = |k: u32| {
            let part = f64::from(k) / 16.0;
            Vec3::new(side * (PI * part).sin(), 0.0, a + (b - a) * part)
        };
        let last = line.branch(from, 2.0, (1..16).map(place));
        [last, to]
    };
    let links = [beside(4, 12, 14.0), beside(15, 22, -12.0)];
    line.tree(&links)
}

#[test]
fn two_rings_in_a_row_have_two_arms() {
    let exact = loops();
    let found = ExtractedCentreline::of(&wall(&exact, 0.6), None, &[]).unwrap();
    assert_eq!((found.rings, found.tree.links().len()), (Some(2), 2));
    let end = found.tree.targets()[0].name.clone();
    let straight_mm = found.tree.path_to(found.tree.target(&end).unwrap().row).unwrap().length_mm();
    assert!(off(straight_mm, 130.0) < 0.01, "{straight_mm}");
    for arm in 0..2 {
        let exact_mm = by_row(&exact, exact.links()[arm].row).length_mm();
        // Which of the two is found first is a matter of their lengths.
        let found_mm = ["arm 1", "arm 2"].map(|name| by_arm(&found.tree, name, &end).length_mm());
        assert!(found_mm.iter().any(|mm| off(*mm, exact_mm) < 0.015), "{found_mm:?} {exact_mm}");
    }
}

/// The path to the outlet over a row.
fn by_row(tree: &CentrelineTree, row: usize) -> CentrelinePath {
    tree.path_via(&tree.nodes()[row].position_mm, &tree.nodes()[26].position_mm).unwrap()
}

#[test]
fn what_the_tree_does_not_lead_to_is_followed_as_well() {
    // From the inlet to the first outlet alone: the ring and its other outlet are beyond a stalk.
    let wall = wall(&ring(18.0, 2.0, &[TAU / 3.0]), 0.5);
    let place = |x: f64| CentrelineEnd::Place(Vec3::new(x, 0.0, 0.0));
    let found = ExtractedCentreline::of(&wall, Some(place(40.0)), &[place(24.0)]).unwrap();
    assert_eq!((found.rings, found.tree.links().len()), (Some(1), 1));
    let link = found.tree.links()[0];
    // The whole ring is one arm that ends where it begins, up to two diameters before the fork.
    let arm = found.tree.branches().into_iter().find(|branch| branch.to == link.row).unwrap();
    let more_mm = arm.length_mm - TAU * 18.0;
    assert!((-2.0..=2.0 * 8.0).contains(&more_mm) && arm.joins == Some(arm.from), "{arm:?}");
}

/// A tube of radius 8 mm along z from 0 to 100 mm, with a flap in it from 20 to 80 mm that stops 0.4 mm short of the
/// wall.
fn dissected() -> SurfaceMesh {
    let (around, along) = (48, 60);
    let mut vertices_mm: Vec<Vec3> = Vec::new();
    for ring in 0..=along {
        for k in 0..around {
            let on = on_circle(TAU * f64::from(k) / f64::from(around), 8.0);
            vertices_mm.push(on + Vec3::z() * (100.0 * f64::from(ring) / f64::from(along)));
        }
    }
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for ring in 0..along as u32 {
        for k in 0..around as u32 {
            let at = |ring: u32, k: u32| ring * around as u32 + k % around as u32;
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let (first, across, down) = (vertices_mm.len() as u32, 30, 120);
    for j in 0..=down {
        for i in 0..=across {
            let y = -7.55 + 15.1 * f64::from(i) / f64::from(across);
            vertices_mm.push(Vec3::new(1.0, y, 20.0 + 60.0 * f64::from(j) / f64::from(down)));
        }
    }
    for j in 0..down as u32 {
        for i in 0..across as u32 {
            let at = |i: u32, j: u32| first + j * (across as u32 + 1) + i;
            triangles.extend([
                [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
            ]);
        }
    }
    SurfaceMesh { vertices_mm, triangles }
}

#[test]
fn both_lumina_beside_a_flap_are_in_the_line() {
    let wall = Wall::from_surface(&dissected()).unwrap();
    assert_eq!(wall.report().sheets_in_lumen, 1);
    let found = ExtractedCentreline::of(&wall, None, &[]).unwrap();
    assert_eq!((found.rings, found.tree.links().len()), (Some(1), 1));
    // In the middle one is on either side of the flap, which is half a millimetre thick.
    let beside: Vec<&CentrelineNode> =
        found.tree.nodes().iter().filter(|node| (45.0..55.0).contains(&node.position_mm.z)).collect();
    let of_side = |is_narrow: bool| {
        beside.iter().find(|node| (node.position_mm.x > 1.0) == is_narrow).map_or(0.0, |node| node.radius_mm)
    };
    assert!(off(of_side(true), (8.0 - 1.25) / 2.0) < 0.02, "{}", of_side(true));
    assert!(off(of_side(false), (8.0 + 0.75) / 2.0) < 0.02, "{}", of_side(false));
    for node in &beside {
        assert!(wall.contains(&node.position_mm).unwrap());
    }
    assert!(!wall.contains(&Vec3::new(1.0, 0.0, 50.0)).unwrap());
}

/// A tube of radius 4 mm along z from 0 to 80 mm, of 16 edges around and so many along, with an ellipsoid beside its axis.
fn calcified(x_mm: f64, half_mm: f64, along: u32) -> SurfaceMesh {
    const AROUND: u32 = 16;
    let mut mesh = SurfaceMesh::default();
    for k in 0..=along * AROUND + AROUND - 1 {
        let on = on_circle(TAU * f64::from(k % AROUND) / f64::from(AROUND), 4.0);
        mesh.vertices_mm.push(on + Vec3::z() * (80.0 * f64::from(k / AROUND) / f64::from(along)));
    }
    for ring in 0..along {
        for k in 0..AROUND {
            let at = |ring: u32, k: u32| ring * AROUND + k % AROUND;
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    // An icosahedron, each face in four.
    let sides = [-1.0, 1.0].into_iter().flat_map(|a| [-golden, golden].map(|b| (a, b)));
    let corners: Vec<Vec3> =
        sides.flat_map(|(a, b)| [Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)]).collect();
    let placed =
        |v: Vec3| v.normalize().component_mul(&Vec3::new(1.8, 1.8, half_mm)) + Vec3::new(x_mm, 0.0, 40.0);
    let near = |a: usize, b: usize| (corners[a] - corners[b]).norm() < 2.1;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in (b + 1..12).filter(|c| near(a, b) && near(b, *c) && near(a, *c)) {
                let [p, q, r] = [corners[a], corners[b], corners[c]];
                let (q, r) = if p.dot(&q.cross(&r)) > 0.0 { (q, r) } else { (r, q) };
                for face in [[p, p + q, p + r], [q, q + r, p + q], [r, p + r, q + r], [p + q, q + r, p + r]] {
                    let first = mesh.vertices_mm.len() as u32;
                    mesh.vertices_mm.extend(face.map(placed));
                    mesh.triangles.push([first, first + 1, first + 2]);
                }
            }
        }
    }
    mesh
}

#[test]
fn an_arm_that_begins_where_another_one_ends_leaves_that_end_a_leaf() {
    for (x_mm, half_mm, along) in [(1.7, 4.2, 36), (1.8, 4.0, 40)] {
        let wall = Wall::from_surface(&calcified(x_mm, half_mm, along)).unwrap();
        assert_eq!(wall.report().bodies_in_lumen, 1);
        let tree = ExtractedCentreline::of(&wall, None, &[]).unwrap().tree;
        assert!(!tree.links().is_empty());
        for node in tree.nodes() {
            assert!(node.radius_mm > 0.3 && node.position_mm.xy().norm() < 3.9, "{node:?}");
        }
        let way = tree.path_to(tree.target("opening 1").unwrap().row).unwrap();
        // Beside the body it bends by two millimetres.
        assert!((80.0..82.0).contains(&way.length_mm()), "{}", way.length_mm());
    }
}

/// Spheres of radius 1 at these places, as a complex.
fn rings_of(places: &[Vec3], edges: impl Fn(usize, usize) -> bool) -> Vec<[usize; 2]> {
    let mut spheres = Spheres::default();
    places.iter().for_each(|place| spheres.push(Sphere { centre_mm: *place, radius_mm: 1.0 }));
    let beside =
        (0..places.len()).map(|a| (0..places.len()).filter(|b| a != *b && edges(a, *b)).collect()).collect();
    let beside = Beside(beside);
    let ways = Ways::from(0, &spheres, &beside);
    Classes::new(&beside, &ways).unwrap().rings(&ways)
}

#[test]
fn a_round_of_spheres_is_a_ring_until_it_is_filled() {
    let round: Vec<Vec3> = (0..12).map(|k| on_circle(TAU * f64::from(k) / 12.0, 2.5)).collect();
    let near = |places: &[Vec3], a: usize, b: usize| (places[a] - places[b]).norm() < 1.55;
    let rings = rings_of(&round, |a, b| near(&round, a, b));
    assert_eq!(rings.len(), 1);
    // Half way around, from the first.
    assert!(rings[0].iter().all(|k| (5..=7).contains(k)), "{rings:?}");
    let mut filled = round.clone();
    filled.extend((0..6).map(|k| on_circle(TAU * f64::from(k) / 6.0, 1.3)));
    filled.push(Vec3::zeros());
    assert!(rings_of(&filled, |a, b| near(&filled, a, b)).is_empty());
    // Without the middle one there is a hole again.
    filled.pop();
    assert_eq!(rings_of(&filled, |a, b| near(&filled, a, b)).len(), 1);
}
