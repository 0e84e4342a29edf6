//! Which pictures are to be learnt from and which to be tested on: by anatomy, so that no vessel is in both.

use super::draw::{Draw, What};

/// Part of the anatomies that is for tests, and as much again for validation.
const FOR_TESTS: f64 = 0.15;

/// `train`, `val` or `test` for each of these vessels, by their names: the same for the same vessel. One alone is for
/// training, of two one is for tests, and from three on at least one is for validation and one for tests.
pub(super) fn splits(vessels: &[String], seed: u64) -> Vec<&'static str> {
    let mut different: Vec<&String> = vec![];
    vessels.iter().for_each(|vessel| {
        if !different.contains(&vessel) {
            different.push(vessel);
        }
    });
    let count = different.len();
    let held = ((FOR_TESTS * count as f64).round() as usize).max(1);
    let draw = Draw::new(seed);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&k| draw.of(k).word(What::Split));
    let tests = if count > 1 { held } else { 0 };
    let validation = if count > 2 { held } else { 0 };
    let of = |vessel: &String| {
        let number = different.iter().position(|other| *other == vessel);
        let place = order.iter().position(|&k| Some(k) == number).unwrap_or(count);
        match place {
            place if place < tests => "test",
            place if place < tests + validation => "val",
            _ => "train",
        }
    };
    vessels.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vessel_is_in_one_part_and_each_part_has_its_share() {
        let names = |count: usize| (0..count).map(|k| format!("vessel {}", k / 2)).collect::<Vec<_>>();
        let count = |splits: &[&str], part: &str| splits.iter().filter(|s| **s == part).count();
        // Two scenes of each of twenty vessels.
        let of_many = splits(&names(40), 7);
        assert_eq!(["train", "val", "test"].map(|part| count(&of_many, part)), [28, 6, 6]);
        assert!(of_many.chunks(2).all(|pair| pair[0] == pair[1]));
        assert_ne!(of_many, splits(&names(40), 8));
        assert_eq!(splits(&names(2), 7), ["train"; 2]);
        let of_two = splits(&names(4), 7);
        assert_eq!((count(&of_two, "train"), count(&of_two, "test")), (2, 2));
        let of_three = splits(&names(6), 7);
        assert_eq!(["train", "val", "test"].map(|part| count(&of_three, part)), [2; 3]);
    }
}
