//! The least bent way through a tube: how far the lumen lets a device cut bends.
//!
//! Least ∫κ² of a line through evenly spaced points, each of which may be so far from its place of the centre line: a convex problem, by
//! the alternating direction method of multipliers (Boyd et al., Foundations and Trends in Machine Learning 3, 2011, section 5).

use crate::banded::{BandMatrix, Factor};
use crate::{Error, Result, Vec3};

/// Weight of the condition that the line is in the tube, over that of bending between neighbouring points.
const PENALTY: f64 = 1e-3;
/// Rounds at most, and how near to the tube the line then is, over the distance of points.
const ROUNDS: usize = 3000;
const NEAR: f64 = 1e-4;

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
    (0..3 * count).for_each(|row| matrix.add(row, row, PENALTY));
    let mut factor = Factor::new(3 * count);
    factor.factor(&matrix).map_err(|error| Error::Computation(format!("the least bent way: {error}")))?;

    let (mut inside, mut price) = (points.to_vec(), vec![Vec3::zeros(); count]);
    let mut line = inside.clone();
    let mut unknowns = vec![0.0; 3 * count];
    for _ in 0..ROUNDS {
        for (wanted, (x, u)) in unknowns.chunks_exact_mut(3).zip(inside.iter().zip(&price)) {
            wanted.copy_from_slice(((x - u) * PENALTY).as_slice());
        }
        factor.solve(&mut unknowns);
        line.iter_mut()
            .zip(unknowns.chunks_exact(3))
            .for_each(|(x, found)| *x = Vec3::from_column_slice(found));
        let mut farthest_mm = 0.0_f64;
        for k in 0..count {
            let wanted = line[k] + price[k];
            let within = points[k] + (wanted - points[k]).cap_magnitude(room_mm[k]);
            farthest_mm = farthest_mm.max((line[k] - within).norm()).max((within - inside[k]).norm());
            inside[k] = within;
            price[k] = wanted - within;
        }
        if farthest_mm <= NEAR * spacing_mm {
            break;
        }
    }
    Ok(line)
}
