//! The least bent way through a tube: how far the lumen lets a device cut bends.
//!
//! Least ∫κ² of a line through evenly spaced points, each of which may be so far from its place of the centre line: a convex problem, by
//! the alternating direction method of multipliers (Boyd et al., Foundations and Trends in Machine Learning 3, 2011, sections 3.4.1 and 5).

use crate::banded::{BandMatrix, Factor};
use crate::{Error, Result, Vec3};

/// Weight of the condition that the line is in the tube, over that of bending between neighbouring points: where it begins, the factor by
/// which it changes, and after how many rounds it may.
const PENALTY: f64 = 1e-5;
const CHANGE: f64 = 2.0;
const CHANGE_ROUNDS: usize = 20;
/// It changes where the line is so many times farther from the tube than the tube's places move in a round, or the other way round.
const UNBALANCED: f64 = 5.0;
/// Rounds at most, and how small both are in the end, over the distance of points.
const ROUNDS: usize = 3000;
const NEAR: f64 = 1e-5;

/// The line nearest to straight whose points are at most `room_mm` from these, `spacing_mm` apart. At least four points, an even number of them.
pub(super) fn least_bent(points: &[Vec3], room_mm: &[f64], spacing_mm: f64) -> Result<Vec<Vec3>> {
    let count = points.len();
    // Second differences, squared and summed. Two points make a block of the matrix.
    let mut matrix = BandMatrix::<12>::zeros(3 * count);
    for k in 1..count - 1 {
        let weights = [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)];
        for (n, (i, a)) in weights.into_iter().enumerate() {
            for (j, b) in &weights[n..] {
                (0..3).for_each(|axis| matrix.add(3 * i + axis, 3 * j + axis, a * b));
            }
        }
    }
    let mut penalty = PENALTY;
    (0..3 * count).for_each(|row| matrix.add(row, row, penalty));
    let mut factor = Factor::new(3 * count);
    let failed = |error| Error::Computation(format!("the least bent way: {error}"));
    factor.factor(&matrix).map_err(failed)?;

    let (mut inside, mut price) = (points.to_vec(), vec![Vec3::zeros(); count]);
    let mut line = inside.clone();
    let mut unknowns = vec![0.0; 3 * count];
    for round in 1..=ROUNDS {
        for (wanted, (x, u)) in unknowns.chunks_exact_mut(3).zip(inside.iter().zip(&price)) {
            wanted.copy_from_slice(((x - u) * penalty).as_slice());
        }
        factor.solve(&mut unknowns);
        line.iter_mut()
            .zip(unknowns.chunks_exact(3))
            .for_each(|(x, found)| *x = Vec3::from_column_slice(found));
        let (mut outside_mm, mut moved_mm) = (0.0_f64, 0.0_f64);
        for k in 0..count {
            let wanted = line[k] + price[k];
            let within = points[k] + (wanted - points[k]).cap_magnitude(room_mm[k]);
            outside_mm = outside_mm.max((line[k] - within).norm());
            moved_mm = moved_mm.max((within - inside[k]).norm());
            inside[k] = within;
            price[k] = wanted - within;
        }
        if outside_mm.max(moved_mm) <= NEAR * spacing_mm {
            break;
        }
        let change = match round % CHANGE_ROUNDS {
            0 if outside_mm > UNBALANCED * moved_mm => CHANGE,
            0 if moved_mm > UNBALANCED * outside_mm => 1.0 / CHANGE,
            _ => continue,
        };
        (0..3 * count).for_each(|row| matrix.add(row, row, penalty * (change - 1.0)));
        penalty *= change;
        price.iter_mut().for_each(|price| *price /= change);
        factor.factor(&matrix).map_err(failed)?;
    }
    Ok(line)
}
