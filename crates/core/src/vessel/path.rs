//! The path along a centre line from the inlet to a point of the vessel.

use crate::Vec3;

/// A polyline of centre-line points with the vessel's radius at each, from the inlet on.
#[derive(Debug, Clone, PartialEq)]
pub struct CentrelinePath {
    points: Vec<(Vec3, f64)>,
}

/// The nearest point of a path to a point in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnPath {
    /// Arc length from the inlet, mm.
    pub arc_mm: f64,
    /// Distance from the path, mm.
    pub distance_mm: f64,
    /// The vessel's radius there, the larger of those at the ends of the segment, mm.
    pub radius_mm: f64,
}

/// A segment of a path, with the vessel's radius at both ends.
struct Piece {
    from: Vec3,
    along: Vec3,
    length_mm: f64,
    radii_mm: [f64; 2],
}

/// Largest slope of the radius along a segment in the search for the deepest position.
const STEEPEST: f64 = 0.99;

impl CentrelinePath {
    /// The path through these points with the vessel's radius in mm at each; `None` for fewer than two, or if
    /// consecutive ones coincide.
    pub fn new(points: Vec<(Vec3, f64)>) -> Option<Self> {
        let apart = points.windows(2).all(|pair| (pair[1].0 - pair[0].0).norm() > 0.0);
        (points.len() > 1 && apart).then_some(Self { points })
    }

    /// Its points with the vessel's radius at each, mm.
    pub fn points(&self) -> &[(Vec3, f64)] {
        &self.points
    }

    /// Its length, mm.
    pub fn length_mm(&self) -> f64 {
        self.points.windows(2).map(|pair| (pair[1].0 - pair[0].0).norm()).sum()
    }

    /// Its end, mm.
    pub fn end_mm(&self) -> Vec3 {
        self.points[self.points.len() - 1].0
    }

    /// The smallest radius at its points, mm.
    pub fn least_radius_mm(&self) -> f64 {
        self.points.iter().map(|point| point.1).fold(f64::INFINITY, f64::min)
    }

    /// The point of the path nearest to `x`.
    pub fn nearest(&self, x: &Vec3) -> OnPath {
        let on_piece = |piece: &Piece| {
            let u =
                ((x - piece.from).dot(&piece.along) / (piece.length_mm * piece.length_mm)).clamp(0.0, 1.0);
            let distance_mm = (x - piece.from - piece.along * u).norm();
            let [from_radius_mm, to_radius_mm] = piece.radii_mm;
            OnPath { arc_mm: u * piece.length_mm, distance_mm, radius_mm: from_radius_mm.max(to_radius_mm) }
        };
        self.least(on_piece, |on| on.distance_mm)
    }

    /// The point of the path in whose vessel `x` is deepest, with the smallest difference of distance and local
    /// radius, linear between points. At the mouth of a branch a position in the trunk may be nearer to the branch's
    /// line, but deeper in the trunk.
    pub(crate) fn deepest(&self, x: &Vec3) -> OnPath {
        let on_piece = |piece: &Piece| {
            let &Piece { from, along, length_mm, radii_mm: [from_radius_mm, to_radius_mm] } = piece;
            let slope_mm = to_radius_mm - from_radius_mm;
            // Where the distance grows as fast as the radius: offset from the foot of the perpendicular by the
            // slope's share of the height.
            let foot_mm = (x - from).dot(&along) / length_mm;
            let height_mm = (x - from - along * (foot_mm / length_mm)).norm();
            let sine = (slope_mm / length_mm).clamp(-STEEPEST, STEEPEST);
            let arc_mm = (foot_mm + height_mm * sine / (1.0 - sine * sine).sqrt()).clamp(0.0, length_mm);
            let part = arc_mm / length_mm;
            let distance_mm = (x - from - along * part).norm();
            OnPath { arc_mm, distance_mm, radius_mm: from_radius_mm + slope_mm * part }
        };
        self.least(on_piece, |on| on.distance_mm - on.radius_mm)
    }

    /// Of the points found by `on_piece`, one on each segment with its arc length from there, the first with the
    /// smallest `of`.
    fn least(&self, on_piece: impl Fn(&Piece) -> OnPath, of: impl Fn(&OnPath) -> f64) -> OnPath {
        let mut best = OnPath { arc_mm: 0.0, distance_mm: f64::MAX, radius_mm: 0.0 };
        let mut before_mm = 0.0;
        for pair in self.points.windows(2) {
            let along = pair[1].0 - pair[0].0;
            let piece =
                Piece { from: pair[0].0, along, length_mm: along.norm(), radii_mm: [pair[0].1, pair[1].1] };
            let on = on_piece(&piece);
            if of(&on) < of(&best) {
                best = OnPath { arc_mm: before_mm + on.arc_mm, ..on };
            }
            before_mm += piece.length_mm;
        }
        best
    }

    /// The point at an arc length from the inlet; beyond the end, the end.
    pub fn at(&self, arc_mm: f64) -> Vec3 {
        self.place(arc_mm).0
    }

    /// The point at an arc length from the inlet, and the radius there, linear between points, mm; beyond the end,
    /// the end.
    pub(crate) fn place(&self, mut arc_mm: f64) -> (Vec3, f64) {
        for pair in self.points.windows(2) {
            let piece = pair[1].0 - pair[0].0;
            let length = piece.norm();
            if arc_mm <= length {
                let part = arc_mm / length;
                return (pair[0].0 + piece * part, pair[0].1 + (pair[1].1 - pair[0].1) * part);
            }
            arc_mm -= length;
        }
        self.points[self.points.len() - 1]
    }
}

#[cfg(test)]
mod tests {
    use crate::vessel::anatomy;

    #[test]
    fn points_of_a_path_are_found_on_it() {
        let tree = anatomy::tree("aortic_arch").unwrap();
        let path = tree.path_to(tree.target("left carotid").unwrap().row).unwrap();
        for arc_mm in [0.0, 13.0, 150.0, path.length_mm()] {
            let on = path.nearest(&path.at(arc_mm));
            assert!((on.arc_mm - arc_mm).abs() < 1e-9 && on.distance_mm < 1e-9, "{arc_mm} {on:?}");
        }
        // Beside the mouth of the branch, in the trunk: nearer to the branch's line, and deeper in the trunk.
        let (fork_mm, in_branch_mm) = (path.at(201.0), path.at(224.0));
        let beside = fork_mm + (in_branch_mm - fork_mm) * 0.6;
        let (near, deep) = (path.nearest(&beside), path.deepest(&beside));
        assert!(deep.distance_mm - deep.radius_mm <= near.distance_mm - path.place(near.arc_mm).1 + 1e-9);
        for arc_mm in (0..=3000).map(|k| path.length_mm() * k as f64 / 3000.0) {
            let (place, radius_mm) = path.place(arc_mm);
            let deeper = (place - beside).norm() - radius_mm;
            assert!(deeper >= deep.distance_mm - deep.radius_mm - 1e-6, "{arc_mm} {deeper} {deep:?}");
        }
        assert_eq!(path.at(1e9), path.end_mm());
        assert!(tree.path_to(0).is_none() && tree.path_to(1_000).is_none());
    }
}
