//! How well a number tells two groups apart.

/// Area under the receiver operating characteristic: the probability that a number of the second group is larger than
/// one of the first, half where they are equal. 1 and 0 tell the groups apart, 0.5 says nothing; NaN for an empty group.
///
/// ```
/// assert_eq!(endowire_assess::auc(&[20.0, 40.0], &[40.0, 90.0]), 0.875);
/// ```
pub fn auc(first: &[f64], second: &[f64]) -> f64 {
    let pairs = first.iter().flat_map(|a| second.iter().map(move |b| (a, b)));
    let wins = pairs.map(|(a, b)| f64::from(u8::from(b > a)) + 0.5 * f64::from(u8::from(a == b)));
    wins.sum::<f64>() / (first.len() * second.len()) as f64
}
