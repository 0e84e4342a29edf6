//! The least bent path through a tube: how far the lumen lets a device cut bends, and its length then.
//!
//! Minimises ½∫κ² ds of a line through points, each of which may be off its position on the centre line by a given
//! distance, across it: the shape of a uniform wire in a smooth wall, which in a wide bend lies on the outer side,
//! where it is longer and less bent. By the method of Levenberg and Marquardt (Nocedal and Wright, Numerical
//! Optimization, 2006, section 10.3), with springs in place of the wall.

use nalgebra::Matrix3;

use crate::Vec3;
use crate::banded::{BandMatrix, Factor};

/// Points move in planes across a chord of the centre line over this many times their room: at a sharp corner the
/// planes then meet beyond the room, and a line can pass the corner's inner side.
const CHORD_ROOMS: f64 = 1.3;
/// Stiffness of the wall, relative to that of bending between neighbouring points: the line sinks in by some
/// thousandths of their distance.
const WALL: f64 = 10.0;
/// Initial damping, its factors after a step that lowers the energy and one that does not, its minimum, where long
/// lines move as a whole, and its maximum, where no step is left.
const DAMPING: f64 = 1e-3;
const DAMPING_CHANGE: f64 = 8.0;
const DAMPING_RANGE: [f64; 2] = [1e-12, 1e8];
/// A step this short, relative to the distance of points, is the last, if the damping is at most this.
const NEAR: f64 = 1e-3;
const UNDAMPED: f64 = 1e-6;
/// Largest number of steps.
const STEPS: usize = 500;

/// The least bent line whose points are at most `room_mm` from these, `spacing_mm` apart. An even number of points,
/// at least four.
pub(super) fn least_bent(points: &[Vec3], room_mm: &[f64], spacing_mm: f64) -> Vec<Vec3> {
    let last = points.len() - 1;
    let along = |k: usize| {
        let reach = 1 + (CHORD_ROOMS * room_mm[k] / spacing_mm) as usize;
        // Equally far to both sides, so that the chord follows the line near its ends too.
        let reach = reach.min(k.max(1)).min((last - k).max(1));
        let chord = points[(k + reach).min(last)] - points[k.saturating_sub(reach)];
        chord.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vec3::z)
    };
    let along: Vec<Vec3> = (0..points.len()).map(along).collect();
    let tube = Tube { points, along: &along, room_mm, spacing_mm };
    let mut line = points.to_vec();
    let mut energy = tube.energy(&line);
    let mut damping = DAMPING;
    let mut factor = Factor::new(3 * points.len());
    for _ in 0..STEPS {
        let (mut matrix, downhill) = tube.slopes(&line);
        let mut added = 0.0;
        let step = loop {
            (0..3 * points.len()).for_each(|row| matrix.add(row, row, damping - added));
            added = damping;
            // By rounding, the stiffness of the softest modes of a long line may vanish.
            if factor.factor(&matrix).is_ok() {
                let mut step = downhill.clone();
                factor.solve(&mut step);
                let steps = step.chunks_exact(3).map(Vec3::from_column_slice);
                let moved: Vec<Vec3> = line.iter().zip(steps).map(|(x, step)| x + step).collect();
                let lower = tube.energy(&moved);
                if lower < energy {
                    (line, energy) = (moved, lower);
                    break step;
                }
            }
            damping *= DAMPING_CHANGE;
            if damping > DAMPING_RANGE[1] {
                return line;
            }
        };
        let longest_mm = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        if longest_mm <= NEAR * spacing_mm && damping <= UNDAMPED {
            break;
        }
        damping = (damping / DAMPING_CHANGE).max(DAMPING_RANGE[0]);
    }
    line
}

/// The tube around a line.
struct Tube<'a> {
    points: &'a [Vec3],
    /// Normals of the planes in which the points move.
    along: &'a [Vec3],
    room_mm: &'a [f64],
    spacing_mm: f64,
}

/// A point of a line, given the sides towards it and from it.
struct Corner {
    lengths_mm: [f64; 2],
    tangents: [Vec3; 2],
    /// Mean of both lengths, mm.
    mean_mm: f64,
    /// Factor of the angle of the tangent, such that half its square is the energy, in units of the points' distance
    /// cubed.
    scale: f64,
}

impl Corner {
    fn turn(&self) -> Vec3 {
        self.tangents[1] - self.tangents[0]
    }

    /// Derivatives of the scaled angle with respect to both sides.
    fn derivatives(&self) -> [Matrix3<f64>; 2] {
        let turn = self.turn();
        [0, 1].map(|side| {
            let (t, length_mm) = (self.tangents[side], self.lengths_mm[side]);
            let sign = [-1.0, 1.0][side];
            let across = (Matrix3::identity() - t * t.transpose()) * (sign / length_mm);
            // A longer side is less bent by the same angle.
            (across - turn * t.transpose() * (0.25 / self.mean_mm)) * self.scale
        })
    }
}

impl Tube<'_> {
    fn corner(&self, line: &[Vec3], k: usize) -> Corner {
        let sides = [line[k + 1] - line[k], line[k + 2] - line[k + 1]];
        // Coincident points have no direction, and a very large energy.
        let lengths_mm = sides.map(|side| side.norm().max(f64::MIN_POSITIVE.sqrt()));
        let tangents = [sides[0] / lengths_mm[0], sides[1] / lengths_mm[1]];
        let mean_mm = 0.5 * (lengths_mm[0] + lengths_mm[1]);
        Corner { lengths_mm, tangents, mean_mm, scale: self.spacing_mm * (self.spacing_mm / mean_mm).sqrt() }
    }

    /// Distance of a point from its position: the direction along, the distance along it, and the vector across it.
    fn beside(&self, line: &[Vec3], k: usize) -> (Vec3, f64, Vec3) {
        let along = self.along[k];
        let offset = line[k] - self.points[k];
        let along_mm = offset.dot(&along);
        (along, along_mm, offset - along * along_mm)
    }

    /// Energy of bending and springs.
    fn energy(&self, line: &[Vec3]) -> f64 {
        let bent = (0..line.len() - 2).map(|k| {
            let corner = self.corner(line, k);
            (corner.turn() * corner.scale).norm_squared()
        });
        let held = (0..line.len()).map(|k| {
            let (_, along_mm, across) = self.beside(line, k);
            let beyond_mm = (across.norm() - self.room_mm[k]).max(0.0);
            WALL * (along_mm * along_mm + beyond_mm * beyond_mm)
        });
        0.5 * (bent.sum::<f64>() + held.sum::<f64>())
    }

    /// Its Gauss–Newton matrix and negative gradient. Two points form a block of the matrix.
    fn slopes(&self, line: &[Vec3]) -> (BandMatrix<12>, Vec<f64>) {
        let mut matrix = BandMatrix::<12>::zeros(3 * line.len());
        let mut downhill = vec![0.0; 3 * line.len()];
        let mut add = |i: usize, j: usize, block: &Matrix3<f64>| {
            for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
                let (row_at, column_at) = (3 * i + row, 3 * j + column);
                if row_at <= column_at {
                    matrix.add(row_at, column_at, block[(row, column)]);
                }
            }
        };
        let mut pull = |k: usize, force: Vec3| (0..3).for_each(|axis| downhill[3 * k + axis] += force[axis]);
        for k in 0..line.len() - 2 {
            let corner = self.corner(line, k);
            let [before, after] = corner.derivatives();
            let each = [-before, before - after, after];
            for (i, a) in each.iter().enumerate() {
                pull(k + i, -(a.transpose() * corner.turn()) * corner.scale);
                each.iter().enumerate().skip(i).for_each(|(j, b)| add(k + i, k + j, &(a.transpose() * b)));
            }
        }
        for k in 0..line.len() {
            let (along, along_mm, across) = self.beside(line, k);
            add(k, k, &(along * along.transpose() * WALL));
            pull(k, -along * (WALL * along_mm));
            let (off_mm, room_mm) = (across.norm(), self.room_mm[k]);
            if off_mm > room_mm {
                let out = across / off_mm;
                let round = Matrix3::identity() - along * along.transpose() - out * out.transpose();
                add(k, k, &((out * out.transpose() + round * (1.0 - room_mm / off_mm)) * WALL));
                pull(k, -out * (WALL * (off_mm - room_mm)));
            }
        }
        (matrix, downhill)
    }
}
