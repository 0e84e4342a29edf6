//! Ways through a centre line: the shortest, or the shortest that passes a given place.
//!
//! In a tree there is one way to each point. Where branches meet again ([`super::CentrelineLink`]) there are several:
//! the shortest is taken unless a place is given by which it goes. A way over a place that meets no point twice is two
//! ways from that place, to the root and to the target, that have nothing else in common. The shortest such pair is a
//! flow of two units at the least cost (Suurballe, *Networks* 4, 1974), found by two shortest ways in the residual
//! graph.

use std::collections::VecDeque;

use super::centreline::COINCIDENT_MM;
use super::{CentrelinePath, CentrelineTree};
use crate::{Error, Result, Vec3, error};

impl CentrelineTree {
    /// The path from the root to a row, the shortest of several; `None` if the row does not exist or is the root.
    pub fn path_to(&self, row: usize) -> Option<CentrelinePath> {
        let rows = self.rows_to((row > 0).then_some(row)?)?;
        CentrelinePath::new(rows.into_iter().map(|row| self.point(row)).collect())
    }

    /// The path from the root to the point of the line nearest to a position, the shortest of several; `None` if that
    /// is the root.
    pub fn path_to_place(&self, place_mm: &Vec3) -> Option<CentrelinePath> {
        if !self.links().is_empty() {
            let mut graph = Graph::of(self);
            let to = graph.insert(place_mm)?;
            return CentrelinePath::new(graph.points_of(graph.shortest(to)?));
        }
        let (row, end_mm) = self.nearest(place_mm);
        let mut points: Vec<(Vec3, f64)> =
            self.rows_to(row)?.into_iter().map(|row| self.point(row)).collect();
        let (to_mm, to_radius_mm) = points.pop()?;
        let (from_mm, from_radius_mm) = *points.last()?;
        let [along_mm, length_mm] = [end_mm, to_mm].map(|place| (place - from_mm).norm());
        if along_mm > COINCIDENT_MM {
            let part = along_mm / length_mm;
            points.push((end_mm, from_radius_mm + (to_radius_mm - from_radius_mm) * part));
        }
        CentrelinePath::new(points)
    }

    /// The shortest path from the root to the point of the line nearest to `place_mm` that passes the one nearest to
    /// `via_mm`, and no point twice.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming `to` if it is the root, and `via` if no such path exists.
    pub fn path_via(&self, via_mm: &Vec3, place_mm: &Vec3) -> Result<CentrelinePath> {
        let mut graph = Graph::of(self);
        let [via, to] = [via_mm, place_mm].map(|place| graph.insert(place).unwrap_or(0));
        if to == 0 {
            let remedy = "is at the root of the centre line, where the way begins: name another place";
            return Err(Error::parameter("to", error::vector(place_mm), remedy));
        }
        let found = match via == 0 || via == to {
            true => graph.shortest(to),
            false => graph.through(via, to),
        };
        found.and_then(|rows| CentrelinePath::new(graph.points_of(rows))).ok_or_else(|| {
            let remedy = format!(
                "no way to {} leads over there without turning back: give a place on the arm of a ring that is passed on the way, \
                 or none",
                error::vector(place_mm)
            );
            Error::parameter("via", error::vector(via_mm), remedy)
        })
    }

    /// The rows from the root to this one, by the shortest way; `None` if it does not exist.
    pub fn rows_to(&self, row: usize) -> Option<Vec<usize>> {
        self.nodes().get(row)?;
        if !self.links().is_empty() {
            return Graph::of(self).shortest(row);
        }
        let mut rows: Vec<usize> =
            std::iter::successors(Some(row), |row| self.nodes()[*row].parent).collect();
        rows.reverse();
        Some(rows)
    }

    /// For each row whether a way from the root to this row passes it: the shortest, or another by the arms of rings.
    pub fn on_ways_to(&self, row: usize) -> Vec<bool> {
        let mut is_on = vec![false; self.nodes().len()];
        self.rows_to(row).into_iter().flatten().for_each(|row| is_on[row] = true);
        let rings: Vec<Vec<usize>> =
            self.links().iter().map(|link| self.ring(link.row, link.joins)).collect();
        // A ring that a way enters and leaves may be passed by either side, and so on.
        for _ in 0..rings.len() {
            for ring in &rings {
                if ring.iter().filter(|row| is_on[**row]).count() > 1 {
                    ring.iter().for_each(|row| is_on[*row] = true);
                }
            }
        }
        is_on
    }

    /// The rows of the tree between two rows, with both.
    fn ring(&self, mut a: usize, mut b: usize) -> Vec<usize> {
        let mut rows = vec![a, b];
        // Parents have lower numbers.
        while a != b {
            let at = if a > b { &mut a } else { &mut b };
            let Some(before) = self.nodes()[*at].parent else { break };
            *at = before;
            rows.push(before);
        }
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    fn point(&self, row: usize) -> (Vec3, f64) {
        (self.nodes()[row].position_mm, self.nodes()[row].radius_mm)
    }
}

/// Points with radii and their neighbours; the first is the root, and the rows of the tree come first.
struct Graph {
    points: Vec<(Vec3, f64)>,
    beside: Vec<Vec<usize>>,
}

impl Graph {
    fn of(tree: &CentrelineTree) -> Self {
        let points = (0..tree.nodes().len()).map(|row| tree.point(row)).collect();
        Self { points, beside: tree.neighbours() }
    }

    fn length_mm(&self, a: usize, b: usize) -> f64 {
        (self.points[a].0 - self.points[b].0).norm()
    }

    fn points_of(&self, way: Vec<usize>) -> Vec<(Vec3, f64)> {
        way.into_iter().map(|at| self.points[at]).collect()
    }

    /// The point of the line nearest to a position: one that is there, or a new one between two of them. `None` only
    /// for a position that is not finite.
    fn insert(&mut self, place_mm: &Vec3) -> Option<usize> {
        let sides = (0..self.points.len())
            .flat_map(|a| self.beside[a].iter().filter(move |b| a < **b).map(move |b| (a, *b)));
        let on = |(a, b): (usize, usize)| {
            let (from, way) = (self.points[a].0, self.points[b].0 - self.points[a].0);
            let part = ((place_mm - from).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
            ((from + way * part - place_mm).norm(), a, b, part)
        };
        let nearest = sides.map(on).filter(|side| side.0.is_finite());
        let (_, a, b, part) = nearest.min_by(|x, y| x.0.total_cmp(&y.0))?;
        let length_mm = self.length_mm(a, b);
        if part * length_mm <= COINCIDENT_MM {
            return Some(a);
        }
        if (1.0 - part) * length_mm <= COINCIDENT_MM {
            return Some(b);
        }
        let new = self.points.len();
        let ((x, r), (y, s)) = (self.points[a], self.points[b]);
        self.points.push((x + (y - x) * part, r + (s - r) * part));
        self.beside.push(vec![a, b]);
        for (one, other) in [(a, b), (b, a)] {
            self.beside[one].iter_mut().filter(|next| **next == other).for_each(|next| *next = new);
        }
        Some(new)
    }

    /// The shortest way from the root.
    fn shortest(&self, to: usize) -> Option<Vec<usize>> {
        let mut before = vec![None; self.points.len()];
        let mut length_mm = vec![f64::INFINITY; self.points.len()];
        length_mm[0] = 0.0;
        let mut open = VecDeque::from([0]);
        while let Some(at) = open.pop_front() {
            for &next in &self.beside[at] {
                let through_mm = length_mm[at] + self.length_mm(at, next);
                if through_mm < length_mm[next] {
                    (length_mm[next], before[next]) = (through_mm, Some(at));
                    open.push_back(next);
                }
            }
        }
        let mut way: Vec<usize> = std::iter::successors(Some(to), |at| before[*at]).collect();
        way.reverse();
        (way.first() == Some(&0)).then_some(way)
    }

    /// The shortest way from the root over a point to another, all three different, that meets no point twice.
    fn through(&self, via: usize, to: usize) -> Option<Vec<usize>> {
        // Each point is an arc from its entrance to its exit, so that it is passed once.
        let (entrance, exit) = (|at: usize| 2 * at, |at: usize| 2 * at + 1);
        let sink = 2 * self.points.len();
        let mut flow = Flow::new(sink + 1);
        for at in 0..self.points.len() {
            flow.join(entrance(at), exit(at), 0.0);
            for &next in &self.beside[at] {
                flow.join(exit(at), entrance(next), self.length_mm(at, next));
            }
        }
        [0, to].into_iter().for_each(|end| flow.join(exit(end), sink, 0.0));
        let found = (0..2).all(|_| flow.push(exit(via), sink));
        let leave = |at: usize| flow.used(at).filter(|next| *next != sink).map(|next| next / 2).collect();
        let starts: Vec<usize> = found.then(|| leave(exit(via)))?;
        let mut ways = starts.into_iter().map(|start| {
            let onwards = |at: &usize| flow.used(exit(*at)).find(|next| *next != sink).map(|next| next / 2);
            std::iter::successors(Some(start), onwards).collect::<Vec<usize>>()
        });
        let [one, other] = [ways.next()?, ways.next()?];
        let (mut way, rest) = if one.last() == Some(&0) { (one, other) } else { (other, one) };
        way.reverse();
        way.push(via);
        way.extend(rest);
        Some(way)
    }
}

/// Arcs of capacity 1 with costs, and a flow in them.
struct Flow {
    /// End, cost and whether it is free, of each arc; its reverse has the number with the last bit turned.
    arcs: Vec<(usize, f64, bool)>,
    from: Vec<Vec<usize>>,
}

impl Flow {
    fn new(count: usize) -> Self {
        Self { arcs: Vec::new(), from: vec![Vec::new(); count] }
    }

    fn join(&mut self, a: usize, b: usize, cost: f64) {
        self.from[a].push(self.arcs.len());
        self.from[b].push(self.arcs.len() + 1);
        self.arcs.extend([(b, cost, true), (a, -cost, false)]);
    }

    /// The ends of the arcs from here that carry flow.
    fn used(&self, at: usize) -> impl Iterator<Item = usize> + '_ {
        let carries = |arc: &&usize| **arc & 1 == 0 && !self.arcs[**arc].2;
        self.from[at].iter().filter(carries).map(|arc| self.arcs[*arc].0)
    }

    /// Adds a unit of flow along the cheapest way through free arcs; `false` if there is none.
    fn push(&mut self, from: usize, to: usize) -> bool {
        let mut by: Vec<Option<usize>> = vec![None; self.from.len()];
        let mut cost = vec![f64::INFINITY; self.from.len()];
        cost[from] = 0.0;
        let mut open = VecDeque::from([from]);
        while let Some(at) = open.pop_front() {
            for &arc in &self.from[at] {
                let (next, own, is_free) = self.arcs[arc];
                let through = cost[at] + own;
                // Rounding must not make a circle that costs nothing look cheaper each time.
                if is_free && next != from && through < cost[next] - COINCIDENT_MM {
                    (cost[next], by[next]) = (through, Some(arc));
                    open.push_back(next);
                }
            }
        }
        let mut at = to;
        while let Some(arc) = by[at] {
            self.arcs[arc].2 = false;
            self.arcs[arc ^ 1].2 = true;
            at = self.arcs[arc ^ 1].0;
        }
        at == from
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::{CentrelineLink, CentrelineNode};

    /// An inlet of 10 mm, a ring of arms of 20 and 60 mm, and an outlet of 10 mm: rows 0 to 3 and 4 are the short way,
    /// 5 to 8 the long one.
    fn ring() -> CentrelineTree {
        let places = [
            ([0.0, 0.0], None),
            ([10.0, 0.0], Some(0)),
            ([20.0, 0.0], Some(1)),
            ([30.0, 0.0], Some(2)),
            ([40.0, 0.0], Some(3)),
            ([10.0, 10.0], Some(1)),
            ([10.0, 20.0], Some(5)),
            ([30.0, 20.0], Some(6)),
            ([30.0, 10.0], Some(7)),
        ];
        let node = |&([x, y], parent): &([f64; 2], Option<usize>)| CentrelineNode {
            position_mm: Vec3::new(x, y, 0.0),
            radius_mm: 2.0,
            parent,
        };
        let tree = CentrelineTree::new(places.iter().map(node).collect()).unwrap();
        tree.with_links(vec![CentrelineLink { row: 8, joins: 3 }]).unwrap()
    }

    #[test]
    fn the_shortest_arm_is_taken_unless_a_place_on_the_other_is_given() {
        let tree = ring();
        let length_mm = |path: &CentrelinePath| path.length_mm();
        assert_eq!(tree.rows_to(4).unwrap(), [0, 1, 2, 3, 4]);
        // The far end of the long arm is nearer by the link.
        assert_eq!(tree.rows_to(8).unwrap(), [0, 1, 2, 3, 8]);
        assert!((length_mm(&tree.path_to(4).unwrap()) - 40.0).abs() < 1e-12);
        let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        let by = |via: Vec3, to: Vec3| tree.path_via(&via, &to).map(|path| length_mm(&path));
        assert!((by(at(20.0, 21.0), at(40.0, 0.0)).unwrap() - 80.0).abs() < 1e-12);
        assert!((by(at(20.0, 1.0), at(40.0, 0.0)).unwrap() - 40.0).abs() < 1e-12);
        // To a place on the link, from either side.
        assert!((length_mm(&tree.path_to_place(&at(30.5, 4.0)).unwrap()) - 34.0).abs() < 1e-12);
        assert!((by(at(20.0, 20.0), at(30.0, 4.0)).unwrap() - 66.0).abs() < 1e-12);
        // A place on the way and on no ring changes nothing; neither do the ends.
        for via in [at(5.0, 0.0), at(0.0, 0.0), at(40.0, 0.0)] {
            assert!((by(via, at(40.0, 0.0)).unwrap() - 40.0).abs() < 1e-12);
        }
        assert_eq!(tree.on_ways_to(4), [true; 9]);
        assert_eq!(tree.on_ways_to(1), [true, true, false, false, false, false, false, false, false]);
        // Over both arms, and back.
        let around = by(at(20.0, 20.0), at(20.0, 0.0)).unwrap();
        assert!((around - 80.0).abs() < 1e-12, "{around}");
    }

    #[test]
    fn a_way_that_would_turn_back_is_refused() {
        let tree = ring();
        let error = tree.path_via(&Vec3::new(40.0, 0.0, 0.0), &Vec3::new(20.0, 0.0, 0.0)).unwrap_err();
        assert!(error.to_string().starts_with("via = [40, 0, 0]: no way to [20, 0, 0]"), "{error}");
        let error = tree.path_via(&Vec3::new(20.0, 0.0, 0.0), &Vec3::zeros()).unwrap_err();
        assert!(error.to_string().starts_with("to = [0, 0, 0]: is at the root"), "{error}");
        // Without its link there is one way.
        let open = tree.with_links(vec![]).unwrap();
        assert!(open.path_via(&Vec3::new(20.0, 20.0, 0.0), &Vec3::new(40.0, 0.0, 0.0)).is_err());
        assert!((open.path_to(8).unwrap().length_mm() - 60.0).abs() < 1e-12);
    }
}
