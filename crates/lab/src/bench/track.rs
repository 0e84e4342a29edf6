//! The track of a bench: the tube that a device is pushed and turned in.

use std::f64::consts::{FRAC_PI_2, PI};

use endowire_core::device::Device;
use endowire_core::insertion::{Sheath, Simulation, WallProperties};
use endowire_core::vessel::{
    CentrelineNode, CentrelinePath, CentrelineTree, ExtractedCentreline, Lumen, Resolution, SweptVessel,
    Wall, WallStore,
};
use endowire_core::{Error, Result, Vec3};
use serde::Serialize;

/// Radius of the standard track's lumen, mm: every device of the catalogue has at least half a millimetre of play.
pub const LUMEN_RADIUS_MM: f64 = 2.0;
/// The standard track from its mouth to its end. Bend after bend is tighter, the second turns back against the first,
/// and the third leaves the plane of the others: 360° in all.
pub const STANDARD: [Piece; 7] = [
    Piece::Straight { length_mm: 30.0 },
    Piece::Bend { radius_mm: 40.0, angle_rad: FRAC_PI_2, roll_rad: 0.0 },
    Piece::Straight { length_mm: 20.0 },
    Piece::Bend { radius_mm: 25.0, angle_rad: PI, roll_rad: PI },
    Piece::Straight { length_mm: 20.0 },
    Piece::Bend { radius_mm: 15.0, angle_rad: FRAC_PI_2, roll_rad: FRAC_PI_2 },
    Piece::Straight { length_mm: 30.0 },
];
/// Distance between points of a generated centre line, mm.
const SAMPLE_MM: f64 = 1.0;
/// Foundation modulus of the track's wall, N/mm²: a tube of polymer, ten times as stiff as an artery.
const MODULUS_N_PER_MM2: f64 = 10.0;
/// Distance of the sheath's mouth from the opening of a track, mm.
const DEPTH_MM: f64 = 1.0;
/// The tip stays this far from the end of the track, mm, so that it does not leave it.
const BEFORE_END_MM: f64 = 2.0;

/// Radius beyond which a centre line counts as straight, mm, and smallest angle of a bend that is listed, degrees.
const STRAIGHT_MM: f64 = 200.0;
const LEAST_BEND_DEG: f64 = 20.0;

/// A piece of a tube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// A straight length.
    Straight {
        /// Its length, mm.
        length_mm: f64,
    },
    /// An arc.
    Bend {
        /// Radius of its centre line, mm.
        radius_mm: f64,
        /// Its angle, rad.
        angle_rad: f64,
        /// Angle about the tube, rad, by which its plane is turned against that of the first bend, in which 0 is to
        /// the left.
        roll_rad: f64,
    },
}

/// A tube with a mouth, through which devices enter, and the length up to which they are pushed.
#[derive(Debug, Clone)]
pub struct Track {
    lumen: Lumen,
    sheath: Sheath,
    path: CentrelinePath,
}

/// Dimensions of a track.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrackSize {
    /// Length of its centre line, mm.
    pub length_mm: f64,
    /// Least radius of its lumen, mm.
    pub lumen_radius_mm: f64,
    /// Angle through which its centre line turns in all, degrees.
    pub turns_deg: f64,
}

/// The centre line of a tube of these pieces, from the origin along +x, with a lumen of one radius.
///
/// # Errors
/// As [`CentrelineTree::new`].
pub fn tube(pieces: &[Piece], lumen_radius_mm: f64) -> Result<CentrelineTree> {
    let (mut at, mut tangent, mut left) = (Vec3::zeros(), Vec3::x(), Vec3::y());
    let mut points = vec![at];
    for piece in pieces {
        match *piece {
            Piece::Straight { length_mm } => {
                let count = (length_mm / SAMPLE_MM).ceil().max(1.0);
                let step = tangent * (length_mm / count);
                points.extend((1..=count as usize).map(|k| at + step * k as f64));
                at += tangent * length_mm;
            }
            Piece::Bend { radius_mm, angle_rad, roll_rad } => {
                let across = tangent.cross(&left);
                let inwards = left * libm::cos(roll_rad) + across * libm::sin(roll_rad);
                let count = (radius_mm * angle_rad / SAMPLE_MM).ceil().max(1.0);
                let on_arc = |angle: f64| {
                    at + (tangent * libm::sin(angle) + inwards * (1.0 - libm::cos(angle))) * radius_mm
                };
                points.extend((1..=count as usize).map(|k| on_arc(angle_rad * k as f64 / count)));
                // `left` is carried along the arc without twist, so that rolls all count from the first plane.
                let axis = tangent.cross(&inwards);
                let (sin, cos) = libm::sincos(angle_rad);
                let turned = |v: Vec3| v * cos + axis.cross(&v) * sin + axis * (axis.dot(&v) * (1.0 - cos));
                at = on_arc(angle_rad);
                (tangent, left) = (turned(tangent), turned(left));
            }
        }
    }
    let node = |(row, position_mm): (usize, Vec3)| CentrelineNode {
        position_mm,
        radius_mm: lumen_radius_mm,
        parent: row.checked_sub(1),
    };
    CentrelineTree::new(points.into_iter().enumerate().map(node).collect())
}

/// A bend of a track.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bend {
    /// Where it begins, mm along the centre line from the mouth.
    pub from_mm: f64,
    /// Where it ends, mm.
    pub to_mm: f64,
    /// Its least radius, mm.
    pub radius_mm: f64,
    /// Its angle, degrees.
    pub angle_deg: f64,
}

impl Track {
    /// The standard tortuous path.
    ///
    /// # Errors
    /// None in practice: its dimensions are constants.
    pub fn standard() -> Result<Self> {
        Self::of_tree(tube(&STANDARD, LUMEN_RADIUS_MM)?)
    }

    /// The tube that a centre line describes; of several branches, a device is pushed as far as the longest path goes.
    ///
    /// # Errors
    /// As [`SweptVessel::new`].
    pub fn of_tree(tree: CentrelineTree) -> Result<Self> {
        let path = longest_path(&tree)?;
        let resolution = Resolution::fitting(&tree);
        let vessel = SweptVessel::new(tree, resolution)?;
        let inlet = vessel.inlet();
        Self::new(vessel.into(), inlet, path)
    }

    /// A surface, from its inlet; its centre line is extracted.
    ///
    /// # Errors
    /// A surface without openings, or without a centre line.
    pub fn of_wall(wall: Wall) -> Result<Self> {
        let found = ExtractedCentreline::of(&wall, None, &[])?;
        let path = longest_path(&found.tree)?;
        let begins_mm = path.at(0.0);
        let distances = wall.openings().iter().map(|opening| (opening.centre_mm - begins_mm).norm());
        let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index);
        let inlet = nearest.ok_or_else(|| {
            Error::parameter(
                "track",
                "a closed surface",
                "must have an opening through which a device enters",
            )
        })?;
        Self::new(wall.into(), inlet, path)
    }

    fn new(lumen: Lumen, inlet: usize, path: CentrelinePath) -> Result<Self> {
        let sheath = Sheath::at_opening(&lumen, inlet, DEPTH_MM)?;
        Ok(Self { lumen, sheath, path })
    }

    /// Its dimensions.
    pub fn size(&self) -> TrackSize {
        let points = self.path.points();
        let ways: Vec<Vec3> = points.windows(2).map(|pair| (pair[1].0 - pair[0].0).normalize()).collect();
        let turn = |pair: &[Vec3]| libm::atan2(pair[0].cross(&pair[1]).norm(), pair[0].dot(&pair[1]));
        TrackSize {
            length_mm: self.path.length_mm(),
            lumen_radius_mm: self.path.least_radius_mm(),
            turns_deg: ways.windows(2).map(turn).sum::<f64>().to_degrees(),
        }
    }

    /// Its bends: stretches along which the centre line is curved throughout, and turns by 20° or more.
    pub fn bends(&self) -> Vec<Bend> {
        let length_mm = self.path.length_mm();
        // A centre line of points is a polygon: its curvature is that over a few of its sides.
        let side_mm = length_mm / (self.path.points().len() - 1).max(1) as f64;
        let around_mm = side_mm.max(self.path.least_radius_mm());
        let per_mm = |at_mm: f64| {
            let [a, b, c] = [-around_mm, 0.0, around_mm].map(|off_mm| self.path.at(at_mm + off_mm));
            libm::atan2((b - a).cross(&(c - b)).norm(), (b - a).dot(&(c - b))) / around_mm
        };
        let count = ((length_mm - 2.0 * around_mm) / SAMPLE_MM).floor().clamp(0.0, 100_000.0);
        let mut bends: Vec<Bend> = Vec::new();
        let mut open = false;
        for k in 0..=count as usize {
            let at_mm = around_mm + SAMPLE_MM * k as f64;
            let curvature_per_mm = per_mm(at_mm);
            let is_bent = curvature_per_mm > 1.0 / STRAIGHT_MM;
            if is_bent && !open {
                bends.push(Bend { from_mm: at_mm, to_mm: at_mm, radius_mm: STRAIGHT_MM, angle_deg: 0.0 });
            }
            if let Some(bend) = bends.last_mut().filter(|_| is_bent) {
                bend.to_mm = at_mm;
                bend.radius_mm = bend.radius_mm.min(1.0 / curvature_per_mm);
                bend.angle_deg += (curvature_per_mm * SAMPLE_MM).to_degrees();
            }
            open = is_bent;
        }
        bends.retain(|bend| bend.angle_deg >= LEAST_BEND_DEG);
        for bend in &mut bends {
            // Curvature is taken over a stretch that reaches into a bend from before its beginning; where half of it
            // does, the bend begins.
            bend.from_mm += 0.5 * around_mm;
            bend.to_mm = (bend.to_mm - 0.5 * around_mm).max(bend.from_mm);
        }
        bends
    }

    /// Length to which `device` is pushed in, mm: to just before the end of the track, or all of a shorter device.
    pub fn reach_mm(&self, device: &Device) -> f64 {
        let ahead_mm = self.path.length_mm() - DEPTH_MM - BEFORE_END_MM;
        ahead_mm.min(device.length_mm()).max(0.0)
    }

    /// `device` at the mouth of the track, whose wall has this friction.
    ///
    /// # Errors
    /// A device that is too thick for the track.
    pub fn simulation(&self, device: &Device, friction: f64, store: &dyn WallStore) -> Result<Simulation> {
        super::check_friction(friction)?;
        let properties =
            WallProperties { modulus_n_per_mm2: MODULUS_N_PER_MM2, friction, ..WallProperties::default() };
        Simulation::builder(self.lumen.clone(), device.clone(), self.sheath)
            .properties(properties)
            .store(store)
            .build()
    }
}

/// The longest of the paths from the root to the ends.
fn longest_path(tree: &CentrelineTree) -> Result<CentrelinePath> {
    let paths = (1..tree.nodes().len()).filter_map(|row| tree.path_to(row));
    paths
        .max_by(|a, b| a.length_mm().total_cmp(&b.length_mm()))
        .ok_or_else(|| Error::parameter("track", "a single point", "must have a centre line of some length"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_track_has_its_three_bends_and_another_tube_its_own() {
        let track = Track::standard().unwrap();
        let bends = track.bends();
        assert_eq!(bends.len(), 3, "{bends:?}");
        for (bend, (radius_mm, angle_deg)) in bends.iter().zip([(40.0, 90.0), (25.0, 180.0), (15.0, 90.0)]) {
            assert!((bend.radius_mm / radius_mm - 1.0).abs() < 0.02, "{bend:?}");
            assert!((bend.angle_deg - angle_deg).abs() < 4.0, "{bend:?}");
        }
        assert!((track.size().turns_deg - 360.0).abs() < 1.0);
        let tube = endowire_core::vessel::anatomy::tree("curved_tube").unwrap();
        assert_eq!(Track::of_tree(tube).unwrap().bends().len(), 1);
        let straight = endowire_core::vessel::anatomy::tree("straight_tube").unwrap();
        assert!(Track::of_tree(straight).unwrap().bends().is_empty());
    }
}
