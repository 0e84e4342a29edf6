//! Stretches of time, s.

/// Begin and end, s.
pub(crate) type Stretch = (f64, f64);

/// Merges ordered stretches that are at most `gap_s` apart.
pub(crate) fn joined(stretches: impl IntoIterator<Item = Stretch>, gap_s: f64) -> Vec<Stretch> {
    let mut all: Vec<Stretch> = Vec::new();
    for (from_s, to_s) in stretches {
        match all.last_mut() {
            Some(last) if from_s <= last.1 + gap_s => last.1 = last.1.max(to_s),
            _ => all.push((from_s, to_s)),
        }
    }
    all
}

/// The intersection of two ordered lists of stretches.
pub(crate) fn common(a: &[Stretch], b: &[Stretch]) -> Vec<Stretch> {
    let (mut i, mut j) = (0, 0);
    let mut all = Vec::new();
    while let (Some(one), Some(other)) = (a.get(i), b.get(j)) {
        let (from_s, to_s) = (one.0.max(other.0), one.1.min(other.1));
        if to_s > from_s {
            all.push((from_s, to_s));
        }
        if one.1 < other.1 {
            i += 1;
        } else {
            j += 1;
        }
    }
    all
}

/// The longest stretches of at least `at_least_s`, at most `most` of them, in order.
pub(crate) fn longest(mut stretches: Vec<Stretch>, at_least_s: f64, most: usize) -> Vec<Stretch> {
    stretches.retain(|(from_s, to_s)| to_s - from_s >= at_least_s);
    stretches.sort_by(|a, b| (b.1 - b.0).total_cmp(&(a.1 - a.0)));
    stretches.truncate(most);
    stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_are_joined_met_and_chosen() {
        let a = joined([(0.0, 1.0), (1.0, 2.0), (2.3, 3.0), (5.0, 6.0)], 0.0);
        assert_eq!(a, [(0.0, 2.0), (2.3, 3.0), (5.0, 6.0)]);
        assert_eq!(joined(a.clone(), 0.5), [(0.0, 3.0), (5.0, 6.0)]);
        assert_eq!(common(&a, &[(1.0, 2.5), (2.9, 5.5)]), [(1.0, 2.0), (2.3, 2.5), (2.9, 3.0), (5.0, 5.5)]);
        assert_eq!(common(&a, &[]), []);
        assert_eq!(longest(a, 0.8, 1), [(0.0, 2.0)]);
    }
}
