//! The runs of a centre line: each a beam, which begins at an end of the vessel or at a point of another run.

use super::super::CentrelineTree;
use super::curve::Curve;
use super::spline::Spline;
use crate::Vec3;

/// A run of a centre line, from the root or from a row of an earlier run to a leaf.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    /// Its rows in the tree.
    pub(super) rows: Vec<usize>,
    pub(super) points: Vec<Vec3>,
    pub(super) radii_mm: Vec<f64>,
    /// Arc length from its first row to each, mm.
    pub(super) arcs_mm: Vec<f64>,
    /// The run from which it branches off, and the arc length there, mm; none for the one from the root.
    pub(super) off: Option<(usize, f64)>,
    pub(super) spline: Spline,
    pub(super) curve: Curve,
}

impl Chain {
    /// Its length, mm.
    pub(super) fn length_mm(&self) -> f64 {
        self.arcs_mm[self.arcs_mm.len() - 1]
    }

    /// What is given at its rows, linearly between them, at an arc length.
    pub(super) fn between(&self, s_mm: f64, at_row: impl Fn(usize) -> f64) -> f64 {
        let after = self.arcs_mm.partition_point(|arc| *arc < s_mm).clamp(1, self.arcs_mm.len() - 1);
        let (from, to) = (self.arcs_mm[after - 1], self.arcs_mm[after]);
        let part = ((s_mm - from) / (to - from)).clamp(0.0, 1.0);
        at_row(after - 1) * (1.0 - part) + at_row(after) * part
    }
}

/// The first rows of a run, and the run on which it begins with the arc length there, mm.
type Begun = (Vec<usize>, Option<(usize, f64)>);

/// Divides a tree into runs: at a junction the vessel goes on in the widest branch, of equal ones in the straightest,
/// and the others begin there. `span_mm` says the length of a spline's spans, from the rows of a run.
pub(super) fn chains(tree: &CentrelineTree, span_mm: impl Fn(&[usize]) -> f64) -> Vec<Chain> {
    let (nodes, children) = (tree.nodes(), tree.children());
    // First row, and the run with the place in it where that is.
    let mut begun: Vec<Begun> = children[0].iter().map(|child| (vec![0, *child], None)).collect();
    // Several branches at the root: one run goes on from it, and the others begin on that.
    for other in begun.iter_mut().skip(1) {
        other.1 = Some((0, 0.0));
    }
    let mut all: Vec<Chain> = Vec::new();
    let mut next = 0;
    while next < begun.len() {
        let (mut rows, off) = begun[next].clone();
        let mut later = Vec::new();
        while let [last, here] = rows[rows.len() - 2..] {
            let along = (nodes[here].position_mm - nodes[last].position_mm).normalize();
            let goodness = |child: usize| {
                let ahead = (nodes[child].position_mm - nodes[here].position_mm).normalize();
                (nodes[child].radius_mm, ahead.dot(&along))
            };
            let best = children[here].iter().copied().max_by(|a, b| {
                let (a, b) = (goodness(*a), goodness(*b));
                a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
            });
            let Some(best) = best else { break };
            later.extend(children[here].iter().filter(|child| **child != best).map(|child| (here, *child)));
            rows.push(best);
        }
        let points: Vec<Vec3> = rows.iter().map(|row| nodes[*row].position_mm).collect();
        let mut arcs_mm = vec![0.0];
        for pair in points.windows(2) {
            arcs_mm.push(arcs_mm[arcs_mm.len() - 1] + (pair[1] - pair[0]).norm());
        }
        for (from, child) in later {
            let place = rows.iter().position(|row| *row == from).unwrap_or(0);
            begun.push((vec![from, child], Some((all.len(), arcs_mm[place]))));
        }
        let spline = Spline::new(arcs_mm[arcs_mm.len() - 1], span_mm(&rows));
        let radii_mm: Vec<f64> = rows.iter().map(|row| nodes[*row].radius_mm).collect();
        let curve = Curve::new(&points, &arcs_mm, &radii_mm);
        all.push(Chain { rows, points, radii_mm, arcs_mm, off, spline, curve });
        next += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::CentrelineNode;

    #[test]
    fn the_widest_branch_goes_on_and_the_others_begin_on_it() {
        let node = |x: f64, z: f64, radius_mm: f64, parent: Option<usize>| CentrelineNode {
            position_mm: Vec3::new(x, 0.0, z),
            radius_mm,
            parent,
        };
        let tree = CentrelineTree::new(vec![
            node(0.0, 0.0, 3.0, None),
            node(0.0, 10.0, 3.0, Some(0)),
            node(5.0, 20.0, 1.0, Some(1)),
            node(0.0, 20.0, 2.0, Some(1)),
            node(-5.0, 30.0, 2.0, Some(3)),
            node(0.0, 30.0, 2.0, Some(3)),
        ])
        .unwrap();
        let all = chains(&tree, |_| 4.0);
        let rows: Vec<_> = all.iter().map(|chain| chain.rows.clone()).collect();
        assert_eq!(rows, [vec![0, 1, 3, 5], vec![1, 2], vec![3, 4]]);
        assert_eq!(all[0].off, None);
        assert_eq!((all[1].off, all[2].off), (Some((0, 10.0)), Some((0, 20.0))));
        assert!((all[0].between(15.0, |k| all[0].radii_mm[k]) - 2.5).abs() < 1e-12);
        assert_eq!(all[0].spline.spans(), 8);
    }
}
