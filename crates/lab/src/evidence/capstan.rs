//! Friction in a bend: what a force against the tip costs the hand.

use std::f64::consts::FRAC_PI_2;

use endowire_core::Result;

use super::{Compared, Kind, Line, Study};
use crate::{Row, on_bench};

/// The study in words.
pub const STUDY: Study = Study {
    name: "capstan",
    title: "Friction in a bend",
    question: "How much more does the hand push than what arrives at the tip behind a bend of 90°?",
    data: "The law of the capstan, e^(µθ) (Euler 1769, Eytelwein), which holds for a flexible wire.",
    computed: "A wire of EI 10 N·mm² is pushed through a tube of radius 50 mm with 0.1 mm of play, and 1 N set against its tip behind the bend: the increase \
               of the push force over the force at the tip.",
    not_shown: "Whether Coulomb's law with one coefficient describes a coated wire in an artery. Where bending counts, as in the first millimetres after a bend \
                begins, the force is larger than the law says: 2 % at µ 0.3.",
};

/// Compares the ratio of forces for several coefficients.
///
/// # Errors
/// A step that could not be carried out.
pub fn study() -> Result<Compared> {
    let frictions = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3];
    let row = |friction: &f64| {
        let row = on_bench::capstan_row(*friction, *friction)?;
        Ok(Row { name: format!("µ = {friction}"), ..row })
    };
    let rows = frictions.iter().map(row).collect::<Result<Vec<_>>>()?;
    let computed = frictions.iter().zip(&rows).map(|(friction, row)| [*friction, row.computed]).collect();
    let exact = (0..=30).map(|k| 0.01 * f64::from(k)).map(|mu| [mu, libm::exp(mu * FRAC_PI_2)]).collect();
    Ok(Compared {
        rows,
        lines: vec![
            Line { name: "computed".to_owned(), kind: Kind::Computed, points: computed },
            Line { name: "capstan, e^(µθ)".to_owned(), kind: Kind::Law, points: exact },
        ],
        axes: ["coefficient of friction", "force of the hand over force at the tip"],
        is_logarithmic: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ratio_is_that_of_the_capstan() {
        let rows = study().unwrap().rows;
        assert!(rows.iter().all(|row| row.pass) && rows.len() == 6, "{rows:?}");
    }
}
