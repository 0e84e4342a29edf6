//! Values of a data sheet: one number or a taper, in the unit in the key's name.

use std::f64::consts::PI;
use std::fmt;

use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::{Error, Result};

/// A value along a part: at its end towards the tip and at its other end, linear in between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ends(pub(super) [f64; 2]);

impl Ends {
    /// A constant value.
    pub(super) fn constant(value: f64) -> Self {
        Self([value; 2])
    }

    /// The value at a fraction of the part's length from the end towards the tip.
    pub(super) fn at(self, fraction: f64) -> f64 {
        self.0[0] + (self.0[1] - self.0[0]) * fraction
    }

    pub(super) fn is_taper(self) -> bool {
        self.0[0] != self.0[1]
    }
}

impl fmt::Display for Ends {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_taper() { write!(f, "{:?}", self.0) } else { write!(f, "{}", self.0[0]) }
    }
}

impl<'de> Deserialize<'de> for Ends {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct OneOrTwo;
        impl<'de> Visitor<'de> for OneOrTwo {
            type Value = Ends;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or two of a taper: [towards the tip, at the other end]")
            }

            fn visit_f64<E>(self, value: f64) -> std::result::Result<Ends, E> {
                Ok(Ends::constant(value))
            }

            fn visit_i64<E>(self, value: i64) -> std::result::Result<Ends, E> {
                Ok(Ends::constant(value as f64))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> std::result::Result<Ends, A::Error> {
                let mut next =
                    |at| list.next_element()?.ok_or_else(|| A::Error::invalid_length(at, &OneOrTwo));
                let ends = Ends([next(0)?, next(1)?]);
                match list.next_element::<f64>()? {
                    None => Ok(ends),
                    Some(_) => Err(A::Error::invalid_length(3, &OneOrTwo)),
                }
            }
        }
        deserializer.deserialize_any(OneOrTwo)
    }
}

/// One of the keys that can give a quantity.
pub(super) struct Way {
    /// The key, with its unit.
    pub(super) key: &'static str,
    /// The value in the file.
    pub(super) given: Option<Ends>,
    /// Units of the simulation in one unit of the key.
    pub(super) factor: f64,
}

/// A quantity in units of the simulation, and the key that gave it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quantity {
    pub(super) key: &'static str,
    /// The value in the file, in the unit of the key.
    pub(super) given: Ends,
    pub(super) ends: Ends,
}

/// The quantity given by at most one of `ways`. `limit` is its largest value, in units of the simulation.
///
/// # Errors
/// Two ways given, naming both; a value that is not positive or exceeds the limit, in the unit of its key. Names
/// begin with `place`.
pub(super) fn one_of<const N: usize>(place: &str, ways: [Way; N], limit: f64) -> Result<Option<Quantity>> {
    let mut found: Option<Quantity> = None;
    for Way { key, given, factor } in ways {
        let Some(given) = given else { continue };
        if let Some(first) = found {
            let remedy = format!("{} is given too: keep one of the two", first.key);
            return Err(Error::parameter(format!("{place}.{key}"), given, remedy));
        }
        for value in given.0 {
            crate::error::in_range(&format!("{place}.{key}"), value, limit / factor)?;
        }
        found = Some(Quantity { key, given, ends: Ends(given.0.map(|value| value * factor)) });
    }
    Ok(found)
}

/// Second moment of area of a round tube, π (R⁴ − r⁴)/4 = π (D⁴ − d⁴)/64, mm⁴; of a solid wire with an inner radius of 0.
pub(super) fn second_moment_mm4(radius_mm: f64, inner_radius_mm: f64) -> f64 {
    PI / 4.0 * (radius_mm.powi(4) - inner_radius_mm.powi(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_moments_are_those_of_the_textbooks() {
        // A wire of 0.035 inch: 0.03066 mm⁴. A tube of 2 mm with a bore of 1 mm has 15/16 of the solid rod's π/4 mm⁴.
        assert!((second_moment_mm4(0.4445, 0.0) - 0.030_66).abs() < 1e-5);
        assert!((second_moment_mm4(1.0, 0.5) - 15.0 / 16.0 * PI / 4.0).abs() < 1e-15);
        // Thin walls: π R³ t.
        let thin = second_moment_mm4(1.0, 1.0 - 1e-6);
        assert!((thin / (PI * 1e-6) - 1.0).abs() < 2e-6);
    }

    #[test]
    fn a_value_is_one_number_or_two() {
        #[derive(Debug, Deserialize)]
        struct Table {
            a: Ends,
        }
        let read = |text: &str| toml::from_str::<Table>(text).map(|table| table.a.0);
        assert_eq!(read("a = 2"), Ok([2.0, 2.0]));
        assert_eq!(read("a = 0.5"), Ok([0.5, 0.5]));
        assert_eq!(read("a = [1, 2.5]"), Ok([1.0, 2.5]));
        for bad in ["a = []", "a = [1.0]", "a = [1.0, 2.0, 3.0]", "a = \"1 F\"", "a = [1.0, true]"] {
            assert!(read(bad).is_err(), "{bad}");
        }
        assert!(read("a = \"1 F\"").unwrap_err().message().contains("two of a taper"));
        assert_eq!(Ends([1.0, 3.0]).at(0.25), 1.5);
    }
}
