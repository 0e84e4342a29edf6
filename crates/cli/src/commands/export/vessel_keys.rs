//! The times at which a vessel that moves is written: as many as it takes to show it everywhere else within an error.
//!
//! Programs interpolate linearly between these keys. They begin with the first and the last step; where the vessel is
//! farthest from where it would be shown, a key is added, until that is near enough.

use endowire_core::Vec3;

use super::Run;

/// The vessel is shown within this distance of where it was, mm, far below what is seen of it.
const NEAR_MM: f64 = 0.1;
/// Largest number of vertices at all keys together: 24 MB of numbers in single precision.
const MOST_VERTICES: usize = 2_000_000;
/// Vertices at which distances are measured, evenly from all: neighbours move alike.
const MEASURED: usize = 256;

/// Keys of the vessel.
pub(super) struct VesselKeys {
    /// Rows with their times, s, which increase.
    pub(super) keys: Vec<(usize, f64)>,
    /// The farthest that the vessel was in any step from where it is shown, mm.
    pub(super) error_mm: f64,
}

impl VesselKeys {
    /// Those of a run; none for a vessel that stays where it is.
    pub(super) fn of(run: &Run) -> Self {
        if !run.places.changes() {
            return Self { keys: vec![], error_mm: 0.0 };
        }
        let rows = run.keys(usize::MAX);
        let vertices = run.wall.mesh().vertices_mm.len().max(1);
        let every = vertices.div_ceil(MEASURED);
        let measured = |row: usize| run.vertices_mm(Some(row)).into_iter().step_by(every).collect();
        let moments: Vec<Moment> =
            rows.iter().map(|(row, time_s)| Moment { time_s: *time_s, places_mm: measured(*row) }).collect();
        let (chosen, error_mm) = choose(&moments, (MOST_VERTICES / vertices).max(2));
        Self { keys: chosen.into_iter().map(|index| rows[index]).collect(), error_mm }
    }

    /// What a file has of a vessel that moves, in words; none for one that stays where it is.
    pub(super) fn text(&self) -> Option<String> {
        let count = self.keys.len();
        (count > 0).then(|| {
            format!(
                "the vessel has {count} keys, and between them it is within {:.2} mm of where it was",
                self.error_mm
            )
        })
    }
}

/// Where points of the vessel are at a time.
struct Moment {
    time_s: f64,
    places_mm: Vec<Vec3>,
}

/// The moment that is shown worst between two others, if any lies between, and its distance, mm.
fn worst(moments: &[Moment], from: usize, to: usize) -> Option<(usize, f64)> {
    let [a, b] = [&moments[from], &moments[to]];
    let error_mm = |moment: &Moment| {
        let share = (moment.time_s - a.time_s) / (b.time_s - a.time_s);
        let between = a.places_mm.iter().zip(&b.places_mm).map(|(a, b)| a + (b - a) * share);
        between.zip(&moment.places_mm).map(|(shown, is)| (shown - is).norm()).fold(0.0, f64::max)
    };
    let errors = (from + 1..to).map(|index| (index, error_mm(&moments[index])));
    errors.max_by(|(_, one), (_, other)| one.total_cmp(other))
}

/// Which moments are keys, at most so many, and the largest distance between them, mm.
fn choose(moments: &[Moment], most: usize) -> (Vec<usize>, f64) {
    let Some(last) = moments.len().checked_sub(1) else { return (vec![], 0.0) };
    let mut keys = vec![0, last];
    keys.dedup();
    // What is worst behind each key but the last.
    let mut behind: Vec<Option<(usize, f64)>> =
        keys.windows(2).map(|pair| worst(moments, pair[0], pair[1])).collect();
    loop {
        let far = |known: &Option<(usize, f64)>| known.map_or(0.0, |(_, error_mm)| error_mm);
        let farthest = (0..behind.len()).max_by(|a, b| far(&behind[*a]).total_cmp(&far(&behind[*b])));
        let error_mm = farthest.map_or(0.0, |at| far(&behind[at]));
        let split = farthest.and_then(|at| Some((at, behind[at]?.0)));
        let Some((at, key)) = split.filter(|_| error_mm > NEAR_MM && keys.len() < most) else {
            return (keys, error_mm);
        };
        behind[at] = worst(moments, keys[at], key);
        behind.insert(at + 1, worst(moments, key, keys[at + 1]));
        keys.insert(at + 1, key);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point that swings by 2 mm in a second, seen 40 times a second.
    fn swinging(count: usize) -> Vec<Moment> {
        let at = |k: usize| {
            let time_s = k as f64 / 40.0;
            Moment { time_s, places_mm: vec![Vec3::x() * 2.0 * (std::f64::consts::TAU * time_s).sin()] }
        };
        (0..count).map(at).collect()
    }

    #[test]
    fn keys_are_as_many_as_an_error_takes() {
        let [one, three] = [41, 121].map(|count| choose(&swinging(count), usize::MAX));
        for (keys, error_mm) in [&one, &three] {
            assert!(*error_mm <= NEAR_MM && keys.is_sorted(), "{error_mm}");
        }
        assert!(one.0.len() > 8 && one.0.len() < 20, "{:?}", one.0);
        assert!(three.0.len() > 2 * one.0.len(), "{} for three beats", three.0.len());
        // What is reported of fewer keys is the error that they have.
        let (few, error_mm) = choose(&swinging(121), 5);
        assert!(few.len() == 5 && error_mm > 1.0, "{few:?} {error_mm}");
    }

    #[test]
    fn a_steady_motion_takes_two_keys() {
        let steady = |k: usize| Moment { time_s: k as f64, places_mm: vec![Vec3::z() * k as f64] };
        assert_eq!(choose(&(0..50).map(steady).collect::<Vec<_>>(), usize::MAX).0, [0, 49]);
        assert_eq!(choose(&[steady(0)], usize::MAX), (vec![0], 0.0));
        assert_eq!(choose(&[], usize::MAX), (vec![], 0.0));
    }
}
