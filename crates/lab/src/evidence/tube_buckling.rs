//! Buckling in a tube: the push at which a wire that lies in a soft tube starts to snake.

use endowire_core::Result;

use super::{Compared, Kind, Line, Study};
use crate::Row;
use crate::contact::{BENDING, MODULUS, buckling_load};
use crate::cylinder::{Lying, snaking};

/// The study in words.
pub const STUDY: Study = Study {
    name: "tube-buckling",
    title: "Buckling of a wire in a soft tube",
    question: "At which push does a wire that lies in a tube start to snake, and how much earlier if the wall is soft?",
    data: "Laws. A rod with bending stiffness EI and play r that a force w per length presses to the wall of a rigid tube snakes at 2 √(EI w/r) (Dawson and \
           Paslay, J. Pet. Technol. 1984); a rod without play in a springy wall of modulus k at 2 √(EI k) (Hetényi 1946). Sideways, the wall and the way up \
           around the tube are two springs in series: with both, 2 √(EI/(r/w + 1/k)).",
    computed: "A rod of six half-waves in a cylinder, pinned at its ends, with w and EI as units and walls into which it is pressed by 0 to 3 times its play: the \
               load at which its equilibrium ceases to be stable; and a rod pressed into a flat springy floor, which is without play.",
    not_shown: "Measured loads. Experiments on a beam between springy walls (J. Appl. Mech. 2024;91:061004) have a wall that moves as a whole, which this \
                program has not. Nor what follows: the helix into which a longer push winds the rod is compared in C1 of `endowire verify`, with and without \
                friction. A vessel is not straight, and there the push itself is what presses the wire to the wall.",
};

/// Depth to which the rod is pressed into the wall, over its play.
const DEPTHS: [f64; 7] = [0.001, 0.1, 0.25, 0.5, 1.0, 2.0, 3.0];
/// Half-waves of the rod: ends of a whole number of them do not change the load.
const HALF_WAVES: f64 = 6.0;
/// Vertices around the cylinder.
const AROUND: u32 = 64;
/// Largest error: of a polygon for a circle, and of elements an eighth of a half-wave long.
const BOUND: f64 = 1e-2;

/// Load over that of a rigid tube without the factor of 2, by the law.
fn law(depth: f64) -> f64 {
    2.0 / (1.0 + depth).sqrt()
}

/// The same, computed: weight and play are 1, so the depth is 1/k, and a half-wave is longer in a soft wall.
fn load(depth: f64) -> Result<f64> {
    let longer = (1.0 + depth).sqrt().sqrt();
    snaking(Lying { half_waves: HALF_WAVES * longer, around: AROUND, weight: 1.0, modulus: 1.0 / depth })
}

/// Compares the loads for walls from rigid to soft.
///
/// # Errors
/// A rod without an equilibrium.
pub fn study() -> Result<Compared> {
    let loads = DEPTHS.map(load).into_iter().collect::<Result<Vec<_>>>()?;
    let quantity = "F/√(EI w/r)";
    let row = |(depth, found): (&f64, &f64)| {
        Row::relative(&format!("pressed in by {depth} of the play"), quantity, *found, law(*depth), BOUND)
    };
    let mut rows: Vec<Row> = DEPTHS.iter().zip(&loads).map(row).collect();
    let without_play = buckling_load(80)? / (BENDING * MODULUS).sqrt();
    rows.push(Row::relative("no play, springy wall", "F/√(EI k)", without_play, 2.0, BOUND));
    let most = DEPTHS[DEPTHS.len() - 1];
    let curve = (0..=60).map(|k| most * f64::from(k) / 60.0);
    Ok(Compared {
        rows,
        lines: vec![
            Line {
                name: "computed".to_owned(),
                kind: Kind::Values,
                points: DEPTHS.iter().zip(&loads).map(|(depth, load)| [*depth, *load]).collect(),
            },
            Line {
                name: "law, 2 √(EI/(r/w + 1/k))".to_owned(),
                kind: Kind::Law,
                points: curve.map(|depth| [depth, law(depth)]).collect(),
            },
        ],
        axes: ["depth in the wall w/k over play r", "load at which it snakes F/√(EI w/r)"],
        is_logarithmic: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_soft_wall_lets_a_rod_snake_as_early_as_two_springs_in_series_say() {
        for depth in [0.001, 1.0] {
            let found = load(depth).unwrap();
            assert!(Row::relative("", "", found, law(depth), BOUND).pass, "{depth}: {found}");
            // The twins: the rigid tube's law, and a wall that is softer by a twentieth, are off.
            let other = if depth < 0.1 { law(0.1) } else { law(0.0) };
            assert!(!Row::relative("", "", found, other, BOUND).pass, "{depth}: {found}");
            assert!(depth < 0.1 || !Row::relative("", "", found, law(1.05 * depth), BOUND).pass);
        }
    }
}
