//! Guesses at what a user may have meant. They are reported, never applied.

use std::ops::RangeInclusive;

use super::{Opening, Wall, opening, survey};

/// Plausible diagonals of a surface, mm: from a single small artery to a whole body.
const BELIEVED_MM: RangeInclusive<f64> = 5.0..=3000.0;
/// Plausible medians of half the lumen's width, mm: from a distal artery to a wide aneurysm.
const BELIEVED_LUMEN_MM: RangeInclusive<f64> = 1.0..=30.0;
/// Units of files, millimetres each.
const UNITS: [(&str, f64); 5] = [
    ("metres", 1000.0),
    ("centimetres", 10.0),
    ("inches", 25.4),
    ("micrometres", 1e-3),
    ("millimetres", 1.0),
];
/// Usual diagonals of vessels, mm.
const USUAL_MM: RangeInclusive<f64> = 20.0..=1500.0;

/// Space in front of an opening, in radii of it, below which the vessel lies right in front.
const TIGHT_RADII: f64 = 0.1;

/// Hints for the user on a wall that was read with `unit_mm`, one sentence each: on a possibly wrong unit, on openings
/// that face each other, and on openings with the vessel right in front.
pub fn wall_hints(wall: &Wall, unit_mm: f64) -> Vec<String> {
    let (low, high) = wall.mesh().used_bounds_mm().unwrap_or_default();
    let unit = unit_hint((high - low).norm(), survey::median_half_lumen_mm(wall), unit_mm);
    unit.into_iter().chain(opening_hints(wall.openings())).collect()
}

/// One sentence for each pair of openings that face each other, and for each opening without room in front of it.
pub(super) fn opening_hints(openings: &[Opening]) -> impl Iterator<Item = String> {
    facing_hints(openings).chain(tight_hints(openings))
}

/// One sentence for each opening without room in front of it.
fn tight_hints(openings: &[Opening]) -> impl Iterator<Item = String> {
    let tight = openings.iter().filter(|opening| opening.beyond_mm < TIGHT_RADII * opening.radius_mm);
    tight.map(|opening| {
        let at = opening.centre_mm;
        let (where_it_is, what_follows) = match opening.beyond_mm > 0.0 {
            true => ("lies right in front of", "its wall may be felt through the opening"),
            false => ("touches", "forces of the wall are wrong where they touch"),
        };
        format!(
            "the vessel itself {where_it_is} opening {}, at [{:.2}, {:.2}, {:.2}]: {what_follows}; cut the surface farther back \
             there, or move apart what touches",
            opening.index, at.x, at.y, at.z
        )
    })
}

/// One sentence for each pair of openings that face each other.
fn facing_hints(openings: &[Opening]) -> impl Iterator<Item = String> {
    opening::facing(openings).into_iter().map(|[i, j]| {
        let (a, b) = (&openings[i], &openings[j]);
        format!(
            "openings {i} and {j}, of radius {} and {} mm, face each other {} mm apart: the vessel is cut through there, and a device leaves \
             it; join its parts",
            rounded(a.radius_mm),
            rounded(b.radius_mm),
            rounded((a.centre_mm - b.centre_mm).norm())
        )
    })
}

/// A guess at the right unit of a surface with this diagonal and median of half the lumen's width, if known, read
/// with `unit_mm`; `None` if that is plausible or no other unit is more so.
pub(crate) fn unit_hint(diagonal_mm: f64, half_lumen_mm: Option<f64>, unit_mm: f64) -> Option<String> {
    let is_odd = !BELIEVED_MM.contains(&diagonal_mm);
    let is_odd_inside = half_lumen_mm.is_some_and(|mm| !BELIEVED_LUMEN_MM.contains(&mm));
    if !(diagonal_mm > 0.0 && diagonal_mm.is_finite() && (is_odd || is_odd_inside)) {
        return None;
    }
    let measures = |scale: f64| {
        let lumen = half_lumen_mm.map_or_else(String::new, |mm| {
            format!(", half of its lumen {} mm in the median", rounded(mm * scale))
        });
        format!("{} mm across{lumen}", rounded(diagonal_mm * scale))
    };
    let is_usual = |mm: f64| {
        let scale = mm / unit_mm;
        USUAL_MM.contains(&(diagonal_mm * scale))
            && half_lumen_mm.is_none_or(|half| BELIEVED_LUMEN_MM.contains(&(half * scale)))
    };
    match UNITS.iter().find(|(_, mm)| *mm != unit_mm && is_usual(*mm)) {
        Some((name, mm)) => Some(format!(
            "the surface is {}, as it is read; if the file is in {name}, it is {}: then set vessel.unit_mm = {mm} (--unit-mm {mm})",
            measures(1.0),
            measures(mm / unit_mm)
        )),
        None if is_odd => Some(format!(
            "the surface is {}, unlike any vessel: set vessel.unit_mm (--unit-mm) to the millimetres per unit of the file",
            measures(1.0)
        )),
        // A small vessel that is implausible in every other unit.
        None => None,
    }
}

/// Rounded to three digits.
fn rounded(value: f64) -> String {
    let scale = 10_f64.powi(2 - libm::log10(value.abs()).floor() as i32);
    crate::error::number((value * scale).round() / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_opening_with_the_vessel_right_in_front_is_reported() {
        let x = crate::Vec3::x();
        let opening = |beyond_mm: f64| Opening { index: 3, beyond_mm, ..Opening::at_end(x, 3.0, x) };
        let reported: Vec<String> = tight_hints(&[opening(0.2), opening(1.0)]).collect();
        assert!(
            reported.len() == 1 && reported[0].contains("in front of opening 3, at [1.00, 0.00, 0.00]"),
            "{reported:?}"
        );
    }

    #[test]
    fn odd_sizes_get_a_guess_and_usual_ones_none() {
        for (diagonal, lumen, unit, part) in [
            (
                0.34,
                None,
                1.0,
                "0.34 mm across, as it is read; if the file is in metres, it is 340 mm across: then set vessel.unit_mm = 1000 (--unit-mm 1000)",
            ),
            (3.1, None, 1.0, "centimetres, it is 31 mm across: then set vessel.unit_mm = 10"),
            (340_000.0, None, 1000.0, "millimetres, it is 340 mm across: then set vessel.unit_mm = 1 "),
            (1e-9, None, 1.0, "1e-9 mm across, unlike any vessel"),
            (
                6.0,
                Some(0.4),
                1.0,
                "6 mm across, half of its lumen 0.4 mm in the median, as it is read; if the file is in centimetres, it is 60 mm across, \
                 half of its lumen 4 mm",
            ),
            (0.06, Some(0.004), 1.0, "if the file is in metres"),
            (600.0, Some(40.0), 10.0, "if the file is in millimetres, it is 60 mm across"),
        ] {
            let hint = unit_hint(diagonal, lumen, unit).unwrap();
            assert!(hint.contains(part), "{hint}");
        }
        for usual in [6.0, 340.0, 2000.0, 0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(unit_hint(usual, None, 1.0), None);
        }
        for (diagonal, lumen) in [(60.0, 4.0), (340.0, 12.0), (200.0, 0.8)] {
            assert_eq!(unit_hint(diagonal, Some(lumen), 1.0), None);
        }
    }
}
