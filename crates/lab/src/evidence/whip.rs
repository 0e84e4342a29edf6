//! Whip of a core wire: when a wire that is not straight snaps while it is turned in a bend.

use std::f64::consts::FRAC_PI_2;

use endowire_core::Result;

use super::{Compared, Kind, Line, Study};
use crate::Row;
use crate::bench::torque::TorqueTest;
use crate::whip::in_tube;

/// The study in words.
pub const STUDY: Study = Study {
    name: "whip",
    title: "Whip of a core wire",
    question: "Does a wire that is not quite straight lag and snap when it is turned in a bend, and from which straightness on?",
    data: "In words alone: a whip test of 0.34 mm wire over 1,080° (Fort Wayne Metals, Advanced Materials & Processes, October 2019), in which \
           straight wire lags by a few degrees and poorly straightened wire by tens, with snaps. The dimensions of the fixture are not given. The exact \
           criterion is that of a close-fitting bend: a wire snaps if λ = L √(EI κ₀ κ/GJ) exceeds π/2, with its rest curvature κ₀ and that of the bend, κ, \
           over the length L.",
    computed: "A wire with EI = GJ in a tube of its own rest curvature, with 0.05 mm of play, turned by 1,080°: largest lag and whip for λ from 0.4 to 2.",
    not_shown: "Friction and the twist of the shaft outside the bend, which add to the lag of real wires. No measured curve was available: that good wire lags \
                by degrees and bad wire by tens agrees in kind, not in numbers.",
};

/// Turns of the hand, degrees, and its steps.
const TURN_DEG: f64 = 1080.0;
const STEP_DEG: f64 = 6.0;
/// Clearance of the wire, mm.
const PLAY_MM: f64 = 0.05;
/// λ of the wires: on both sides of π/2.
const LAMBDAS: [f64; 5] = [0.4, 0.8, 1.2, 1.45, 2.0];

/// Turns the wires, and compares whether they snap with the criterion.
///
/// # Errors
/// A step that could not be carried out.
pub fn study() -> Result<Compared> {
    let test = TorqueTest { friction: 0.0, turn_deg: TURN_DEG, step_deg: STEP_DEG };
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for lambda in LAMBDAS {
        let response = test.turn(&mut in_tube(lambda, PLAY_MM)?)?;
        let snaps = f64::from(u8::from(response.largest_whip_deg > 0.0));
        let expected = f64::from(u8::from(lambda > FRAC_PI_2));
        let name = format!(
            "λ = {lambda}: lag {:.1}°, whip {:.0}°",
            response.largest_lag_deg, response.largest_whip_deg
        );
        let off = (snaps - expected).abs();
        rows.push(Row::with_error(&name, "snaps (1) or not (0)", snaps, expected, off, 0.0));
        let points = response.points.iter().map(|point| [point.hand_deg, point.hand_deg - point.tip_deg]);
        lines.push(Line { name: format!("λ = {lambda}"), kind: Kind::Computed, points: points.collect() });
    }
    Ok(Compared {
        rows,
        lines,
        axes: ["angle of the hand, degrees", "tip behind hand, degrees"],
        is_logarithmic: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wires_snap_beyond_the_criterion_and_not_before() {
        let rows = study().unwrap().rows;
        assert!(rows.iter().all(|row| row.pass), "{rows:?}");
        // The twin: both kinds are among them.
        assert!(rows.iter().any(|row| row.computed == 1.0) && rows.iter().any(|row| row.computed == 0.0));
    }
}
