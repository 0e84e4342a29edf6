//! Sums of measures.

/// The sum of values, from 0: the sum of no values is 0, not −0 as with `Iterator::sum`.
pub(crate) fn total(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |sum, value| sum + value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_adds_up_to_zero_without_a_sign() {
        assert!(total([]).is_sign_positive() && total([-0.0]).is_sign_positive());
        assert_eq!(total([1.0, 2.5]), 3.5);
    }
}
