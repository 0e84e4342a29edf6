//! A vessel that divides.

use endowire_core::Vec3;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, Target};

/// A trunk of 100 mm along x that divides into branches of 50 mm towards +y, the left one, and −y.
pub(crate) fn tree() -> CentrelineTree {
    let node = |x: f64, y: f64, radius_mm: f64, parent| CentrelineNode {
        position_mm: Vec3::new(x, y, 0.0),
        radius_mm,
        parent,
    };
    let nodes = vec![
        node(0.0, 0.0, 5.0, None),
        node(100.0, 0.0, 5.0, Some(0)),
        node(100.0, 50.0, 3.0, Some(1)),
        node(100.0, -50.0, 3.0, Some(1)),
    ];
    let target = |name: &str, row| Target { name: name.to_owned(), row };
    CentrelineTree::new(nodes).unwrap().with_targets(vec![target("left", 2), target("right", 3)]).unwrap()
}
