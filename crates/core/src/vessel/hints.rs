//! Guesses at what a user may have meant. They are said, never taken.

/// Diagonals of a surface in mm between which its unit is believed: a single small artery, and a whole body.
const BELIEVED_MM: [f64; 2] = [5.0, 3000.0];
/// Units of files, millimetres each.
const UNITS: [(&str, f64); 4] =
    [("metres", 1000.0), ("centimetres", 10.0), ("inches", 25.4), ("micrometres", 1e-3)];
/// Diagonals of vessels that are usual, mm.
const USUAL_MM: [f64; 2] = [20.0, 1500.0];

/// A guess at the unit of a surface that is `diagonal_mm` across when read with `unit_mm`; none if that may be right.
pub fn unit_hint(diagonal_mm: f64, unit_mm: f64) -> Option<String> {
    if !(diagonal_mm > 0.0 && diagonal_mm.is_finite())
        || (BELIEVED_MM[0]..=BELIEVED_MM[1]).contains(&diagonal_mm)
    {
        return None;
    }
    let mut text = format!("the surface is {} mm across", rounded(diagonal_mm));
    let in_file = diagonal_mm / unit_mm;
    let usual = |mm: f64| (USUAL_MM[0]..=USUAL_MM[1]).contains(&(in_file * mm));
    let guess = UNITS.iter().chain([&("millimetres", 1.0)]).find(|(_, mm)| usual(*mm) && *mm != unit_mm);
    text += &match guess {
        Some((name, mm)) => format!(": if the file is in {name}, set vessel.unit_mm = {mm} (--unit-mm {mm})"),
        None => ", unlike any vessel: set vessel.unit_mm (--unit-mm) to the millimetres per unit of the file"
            .to_owned(),
    };
    Some(text)
}

/// Three digits.
fn rounded(value: f64) -> String {
    let scale = 10_f64.powi(2 - value.abs().log10().floor() as i32);
    crate::error::number((value * scale).round() / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_sizes_get_a_guess_and_usual_ones_none() {
        for (diagonal, unit, part) in [
            (
                0.34,
                1.0,
                "0.34 mm across: if the file is in metres, set vessel.unit_mm = 1000 (--unit-mm 1000)",
            ),
            (3.1, 1.0, "centimetres, set vessel.unit_mm = 10"),
            (340_000.0, 1000.0, "millimetres, set vessel.unit_mm = 1 "),
            (1e-9, 1.0, "1e-9 mm across, unlike any vessel"),
        ] {
            let hint = unit_hint(diagonal, unit).unwrap();
            assert!(hint.contains(part), "{hint}");
        }
        for usual in [6.0, 340.0, 2000.0, 0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(unit_hint(usual, 1.0), None);
        }
    }
}
