//! Injection through a sleeve against a pin: the force of the hand turns round.

use endowire_core::Result;
use endowire_core::statics::{End, EndKind, StaticCase};

use super::{Compared, Kind, Line, Study};
use crate::{Row, unit_rod};

/// The study in words.
pub const STUDY: Study = Study {
    name: "reversal",
    title: "Injection against a pin: the force of the hand turns round",
    question: "Does the force of the hand fall, and turn into a pull, as a wire that is stopped at its tip is fed through a sheath?",
    data: "Bosi, Misseroni, Dal Corso and Bigoni 2015 (arXiv 1509.05812), who name guidewires, predict the reversal and report it from experiments. Compared \
           are values of the first mode for an inextensible rod that were computed independently of this program, by shooting to 10⁻¹¹.",
    computed: "A rod of length ℓ, clamped in a frictionless sleeve and pinned at the distance d: the force of the hand in units of EI/d².",
    not_shown: "The measured points themselves, which are not compared. Friction in the sleeve, and the sideways snap of a wire that has room, are left out.",
};

/// Length over distance, and force of the hand times d²/EI.
const FORCES: [(f64, f64); 9] = [
    (1.002, 20.044_986_49),
    (1.01, 19.473_689_15),
    (1.05, 16.876_075_52),
    (1.1, 14.150_716_19),
    (1.2, 10.014_090_16),
    (1.5, 3.523_159_28),
    (2.0, 0.122_814_59),
    (2.25, -0.443_901_75),
    (3.0, -0.908_991_46),
];
/// Elements of the rod.
const ELEMENTS: usize = 64;

/// Force of the hand for a length, at the distance 1 with EI 1.
fn force(length: f64) -> Result<f64> {
    let mut case = StaticCase {
        end: End { kind: EndKind::Pinned, position: Some([1.0, 0.0, 0.0]), ..End::default() },
        ..unit_rod(ELEMENTS)
    };
    case.rod.length = length;
    case.rod.section[0].until = length;
    Ok(case.solve()?.checked()?.push_force.unwrap_or(f64::NAN))
}

/// Compares the force for all lengths.
///
/// # Errors
/// A rod without an equilibrium.
pub fn study() -> Result<Compared> {
    let row = |(length, expected): (f64, f64)| {
        let found = force(length)?;
        // Relative to the largest force: it passes through zero.
        let error = (found - expected).abs() / FORCES[0].1;
        Ok(Row::with_error(&format!("ℓ/d = {length}"), "F d²/EI", found, expected, error, 1e-4))
    };
    let rows = FORCES.into_iter().map(row).collect::<Result<Vec<_>>>()?;
    let lengths = (0..=100).map(|k| 1.002 + 2.0 * f64::from(k) / 100.0);
    let computed = lengths.map(|length| Ok([length, force(length)?])).collect::<Result<Vec<_>>>()?;
    Ok(Compared {
        rows,
        lines: vec![
            Line { name: "computed".to_owned(), kind: Kind::Computed, points: computed },
            Line {
                name: "independent values".to_owned(),
                kind: Kind::Values,
                points: FORCES.map(|(length, force)| [length, force]).to_vec(),
            },
        ],
        axes: ["length in front of the sheath over distance of the pin", "force of the hand F d²/EI"],
        is_logarithmic: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_turns_round_as_computed_elsewhere() {
        let rows = study().unwrap().rows;
        assert!(rows.iter().all(|row| row.pass), "{rows:?}");
        assert!(rows[0].computed > 0.0 && rows[rows.len() - 1].computed < 0.0);
        // The twin: a length that is 1 % off is seen.
        assert!((force(1.2 * 1.01).unwrap() - FORCES[4].1).abs() / FORCES[0].1 > 1e-3);
    }
}
