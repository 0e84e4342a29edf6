//! A number that stands for a scene, by which states of other scenes are recognised.

use std::fmt::Debug;

use super::simulation::Environment;
use crate::Vec3;
use crate::random::splitmix64;
use crate::vessel::{CentrelineNode, Lumen};

/// A number that differs between scenes: instruments, sheath, wall, vessel and how it yields. Never 0.
pub(super) fn of(scene: &Environment) -> u64 {
    let parts: [&dyn Debug; 3] = [&scene.stack, &scene.sheath, &scene.properties];
    let known = parts.into_iter().fold(0, |known, part| mixed(known, letters(&format!("{part:?}"))));
    let yields = scene.course.iter().map(|course| format!("{:?}", course.spec()));
    let known = yields.fold(known, |known, spec| mixed(known, letters(&spec)));
    let of_point = |x: &Vec3| [x.x, x.y, x.z].map(f64::to_bits);
    let vessel = match &scene.lumen {
        Lumen::Meshed(meshed) => {
            let mesh = meshed.wall().mesh();
            let known = mixed(known, mesh.vertices_mm.iter().flat_map(of_point));
            mixed(known, mesh.triangles.iter().flatten().map(|v| u64::from(*v)))
        }
        Lumen::Swept(vessel) => {
            let of_node = |node: &CentrelineNode| {
                let [x, y, z] = of_point(&node.position_mm);
                [x, y, z, node.radius_mm.to_bits(), node.parent.map_or(u64::MAX, |row| row as u64)]
            };
            let nodes = vessel.tree().nodes().iter().flat_map(of_node);
            let closed = vessel.tree().closed_ends().iter().map(|row| *row as u64);
            let links = vessel.tree().links().iter().flat_map(|link| [link.row as u64, link.joins as u64]);
            mixed(known, nodes.chain(closed).chain(links))
        }
    };
    vessel.max(1)
}

fn mixed(known: u64, words: impl Iterator<Item = u64>) -> u64 {
    words.fold(known, |known, word| splitmix64(known ^ word, 0))
}

fn letters(text: &str) -> impl Iterator<Item = u64> {
    text.bytes().map(u64::from)
}

#[cfg(test)]
mod tests {
    use crate::device::{Device, Section};
    use crate::insertion::{Command, Sheath, Simulation, WallProperties};
    use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Lumen, Resolution, SweptVessel};

    /// A hooked wire of this stiffness in a tube of this radius.
    fn wire(bending: f64, radius_mm: f64, friction: f64, is_swept: bool, depth_mm: f64) -> Simulation {
        let node = |i: usize| CentrelineNode {
            position_mm: crate::Vec3::z() * (50.0 * i as f64),
            radius_mm,
            parent: i.checked_sub(1),
        };
        let tree = CentrelineTree::new((0..3).map(node).collect()).unwrap();
        let lumen = match is_swept {
            true => Lumen::from(SweptVessel::new(tree, Resolution::EdgeMm(2.0)).unwrap()),
            false => GeneratedWall::new(&tree, Resolution::EdgeMm(2.0)).unwrap().wall.into(),
        };
        let hook = Section { rest_curvature_per_mm: [0.02, 0.0], ..Section::straight(15.0, 0.3, bending) };
        let device = Device::new(vec![hook, Section::straight(80.0, 0.3, bending)]).unwrap();
        let sheath = Sheath::new(crate::Vec3::z() * depth_mm, crate::Vec3::z()).unwrap();
        let properties = WallProperties { friction, deviation_mm: 0.0, ..WallProperties::default() };
        Simulation::builder(lumen, device, sheath).properties(properties).build().unwrap()
    }

    #[test]
    fn states_of_other_scenes_are_refused_and_those_of_the_same_scene_built_again_are_not() {
        for is_swept in [false, true] {
            let mut first = wire(10.0, 4.0, 0.1, is_swept, 1.0);
            first.step(Command::advance(10.0)).unwrap();
            let state = first.state();
            let mut again = wire(10.0, 4.0, 0.1, is_swept, 1.0);
            again.restore(&state).unwrap();
            let on = Command::advance(5.0);
            assert_eq!(again.step(on).unwrap().push_force_n, first.step(on).unwrap().push_force_n);
            let others = [
                wire(11.0, 4.0, 0.1, is_swept, 1.0),
                wire(10.0, 3.9, 0.1, is_swept, 1.0),
                wire(10.0, 4.0, 0.2, is_swept, 1.0),
                wire(10.0, 4.0, 0.1, is_swept, 1.5),
                wire(10.0, 4.0, 0.1, !is_swept, 1.0),
            ];
            for mut other in others {
                let reported = other.restore(&state).unwrap_err().to_string();
                assert!(reported.starts_with("state.scene = "), "{reported}");
                assert_eq!(other.report().inserted_mm, 0.0);
            }
        }
    }
}
