//! Axes of a sweep: a key of the scene and its values.

use endowire_core::{Error, Result};
use endowire_methods::Key;
use serde::Deserialize;
use toml::Value;

use crate::draw::Stream;

/// Largest number of values of one axis, and of runs of a sweep.
pub(crate) const RUN_LIMIT: usize = 1_000_000;

/// An `[[axis]]` of a sweep file: a key, and one of list, grid, random and latin.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSpec {
    /// Key of the scene.
    pub key: String,
    /// Given values; combined with all values of all other lists and grids.
    pub list: Option<Vec<Value>>,
    /// Evenly spaced numbers; combined with all values of all other lists and grids.
    pub grid: Option<Grid>,
    /// A number drawn uniformly from a range for each sample.
    pub random: Option<Range>,
    /// A number drawn for each sample, one in each of as many equal parts of a range as there are samples: together
    /// with the other `latin` axes a Latin hypercube.
    pub latin: Option<Range>,
}

/// Evenly spaced numbers.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// First number.
    pub from: f64,
    /// Last number.
    pub to: f64,
    /// How many numbers, at least 2.
    pub count: usize,
    /// Whether the spacing is logarithmic.
    #[serde(default)]
    pub log: bool,
}

/// Range of a drawn number.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Whether the logarithm is drawn uniformly.
    #[serde(default)]
    pub log: bool,
    /// Whether integers are drawn, both ends included.
    #[serde(default)]
    pub integer: bool,
}

/// A key with its values, checked.
#[derive(Debug, Clone)]
pub struct Axis {
    pub(crate) key: Key,
    values: Values,
}

#[derive(Debug, Clone)]
enum Values {
    Listed(Vec<Value>),
    Random(Range, Stream),
    Latin(Range, Stream, Vec<u32>),
}

impl Axis {
    /// The axis of this `index` in a sweep with this seed and number of samples.
    ///
    /// # Errors
    /// Names the key of the sweep file that is missing, out of range or contradicts another.
    pub(crate) fn new(spec: &AxisSpec, index: usize, seed: u64, samples: usize) -> Result<Self> {
        let name = format!("axis[{index}]");
        let key = Key::parse(&spec.key).map_err(|error| inside(&name, error))?;
        let stream = Stream::new(seed, index);
        let values = match (&spec.list, &spec.grid, &spec.random, &spec.latin) {
            (Some(list), None, None, None) => Values::Listed(list.clone()),
            (None, Some(grid), None, None) => Values::Listed(grid.values(&format!("{name}.grid"))?),
            (None, None, Some(range), None) => {
                range.check(&format!("{name}.random"))?;
                Values::Random(*range, stream)
            }
            (None, None, None, Some(range)) => {
                range.check(&format!("{name}.latin"))?;
                Values::Latin(*range, stream, stream.shuffled(samples))
            }
            _ => {
                let remedy = "give one of list, grid, random and latin";
                return Err(Error::parameter(name, format!("{{key = {:?}}}", spec.key), remedy));
            }
        };
        if matches!(&values, Values::Listed(list) if list.is_empty()) {
            return Err(Error::parameter(format!("{name}.list"), "[]", "give at least one value"));
        }
        Ok(Self { key, values })
    }

    /// Number of values that are combined with those of other axes; 1 if values are drawn.
    pub(crate) fn crossed(&self) -> usize {
        match &self.values {
            Values::Listed(list) => list.len(),
            Values::Random(..) | Values::Latin(..) => 1,
        }
    }

    /// Value in a run: the one with index `place` of a list or grid, otherwise the one drawn for `sample`.
    pub(crate) fn value(&self, place: usize, sample: usize) -> Value {
        match &self.values {
            Values::Listed(list) => list[place].clone(),
            Values::Random(range, stream) => range.at(stream.unit(sample)),
            Values::Latin(range, stream, strata) => {
                let within = stream.unit(sample);
                range.at((f64::from(strata[sample]) + within) / strata.len() as f64)
            }
        }
    }

    /// Values that represent the axis in checks: all of a list, the ends of a range.
    pub(crate) fn examples(&self) -> Vec<Value> {
        match &self.values {
            Values::Listed(list) => list.clone(),
            Values::Random(range, _) | Values::Latin(range, ..) => vec![range.at(0.0), range.at(1.0)],
        }
    }
}

/// Prefixes the key in an error with its table.
fn inside(table: &str, error: Error) -> Error {
    match error {
        Error::Parameter { name, value, remedy } => {
            Error::Parameter { name: format!("{table}.{name}"), value, remedy }
        }
        other => other,
    }
}

/// Interpolates between two numbers; `t` runs from 0 to 1.
fn between(from: f64, to: f64, log: bool, t: f64) -> f64 {
    match t {
        // The ends are exact.
        0.0 => from,
        1.0 => to,
        _ if log => from * (t * (to / from).ln()).exp(),
        _ => from + t * (to - from),
    }
}

fn check_ends(name: &str, from: f64, to: f64, log: bool) -> Result<()> {
    for (end, value) in [("from", from), ("to", to)] {
        if !value.is_finite() {
            return Err(Error::parameter(format!("{name}.{end}"), value, "must be a finite number"));
        }
        if log && value <= 0.0 {
            let remedy = "must be above 0 where log = true";
            return Err(Error::parameter(format!("{name}.{end}"), value, remedy));
        }
    }
    Ok(())
}

impl Grid {
    fn values(&self, name: &str) -> Result<Vec<Value>> {
        check_ends(name, self.from, self.to, self.log)?;
        if !(2..=RUN_LIMIT).contains(&self.count) {
            let remedy = format!("must be 2 to {RUN_LIMIT}; for one value give list");
            return Err(Error::parameter(format!("{name}.count"), self.count, remedy));
        }
        let last = (self.count - 1) as f64;
        let value = |k: usize| Value::Float(between(self.from, self.to, self.log, k as f64 / last));
        Ok((0..self.count).map(value).collect())
    }
}

/// Below this bound every integer can be drawn.
const INTEGER_LIMIT: f64 = 9e15;

impl Range {
    fn check(&self, name: &str) -> Result<()> {
        check_ends(name, self.from, self.to, self.log)?;
        if self.from >= self.to {
            let remedy = format!("must be above {name}.from, {}", self.from);
            return Err(Error::parameter(format!("{name}.to"), self.to, remedy));
        }
        for (end, value) in [("from", self.from), ("to", self.to)] {
            if self.integer && (value.fract() != 0.0 || value.abs() > INTEGER_LIMIT) {
                let remedy = format!("must be a whole number up to {INTEGER_LIMIT:e} where integer = true");
                return Err(Error::parameter(format!("{name}.{end}"), value, remedy));
            }
        }
        Ok(())
    }

    /// Value at the fraction `unit` of the range.
    fn at(&self, unit: f64) -> Value {
        if self.integer {
            // Each integer has an interval of the same length, hence the upper end plus one.
            let value = between(self.from, self.to + 1.0, self.log, unit).floor();
            return Value::Integer(value.min(self.to) as i64);
        }
        Value::Float(between(self.from, self.to, self.log, unit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str, samples: usize) -> Result<Axis> {
        Axis::new(&toml::from_str(&format!("key = \"a.b\"\n{text}")).unwrap(), 2, 7, samples)
    }

    fn floats(axis: &Axis, count: usize) -> Vec<f64> {
        (0..count).map(|k| axis.value(k, k).as_float().unwrap()).collect()
    }

    #[test]
    fn grids_have_their_ends_and_even_steps() {
        let even = axis("grid = { from = 0.0, to = 1.0, count = 5 }", 1).unwrap();
        assert_eq!(floats(&even, 5), [0.0, 0.25, 0.5, 0.75, 1.0]);
        let log = axis("grid = { from = 1, to = 100, count = 3, log = true }", 1).unwrap();
        let values = floats(&log, 3);
        assert!((values[1] - 10.0).abs() < 1e-12 && values[0] == 1.0 && values[2] == 100.0, "{values:?}");
    }

    #[test]
    fn a_latin_axis_has_one_value_in_each_part_of_its_range() {
        let axis = axis("latin = { from = -1.0, to = 3.0 }", 40).unwrap();
        let mut parts: Vec<usize> =
            floats(&axis, 40).iter().map(|v| ((v + 1.0) / 4.0 * 40.0).floor() as usize).collect();
        assert_ne!(parts, (0..40).collect::<Vec<_>>());
        parts.sort_unstable();
        assert_eq!(parts, (0..40).collect::<Vec<_>>());
    }

    #[test]
    fn whole_numbers_are_drawn_with_both_ends() {
        let axis = axis("random = { from = 3, to = 5, integer = true }", 900).unwrap();
        let mut counts = [0; 3];
        for sample in 0..900 {
            counts[usize::try_from(axis.value(0, sample).as_integer().unwrap() - 3).unwrap()] += 1;
        }
        // Four standard deviations of 300 in 900.
        assert!(counts.iter().all(|count| (300 - 57..300 + 57).contains(count)), "{counts:?}");
        assert_eq!(axis.examples(), [Value::Integer(3), Value::Integer(5)]);
    }

    #[test]
    fn what_is_wrong_is_reported_with_key_value_and_remedy() {
        for (text, reported) in [
            ("", "axis[2] = {key = \"a.b\"}: give one of list, grid, random and latin"),
            ("list = []", "axis[2].list = []: give at least one value"),
            ("list = [1]\ngrid = { from = 0, to = 1, count = 2 }", "give one of"),
            ("grid = { from = 0, to = 1, count = 1 }", "axis[2].grid.count = 1: must be 2 to"),
            ("grid = { from = 0, to = 1, count = 3, log = true }", "axis[2].grid.from = 0: must be above 0"),
            ("random = { from = 2, to = 1 }", "axis[2].random.to = 1: must be above axis[2].random.from, 2"),
            ("random = { from = nan, to = 1 }", "axis[2].random.from = NaN: must be a finite number"),
            ("latin = { from = 0.5, to = 3, integer = true }", "axis[2].latin.from = 0.5: must be a whole"),
        ] {
            let error = axis(text, 4).unwrap_err().to_string();
            assert!(error.contains(reported), "{error}");
        }
    }
}
