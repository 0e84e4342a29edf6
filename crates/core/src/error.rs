//! Errors, worded so that the reader knows which input to change.

use std::path::{Path, PathBuf};

use crate::Vec3;

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Every error of the core names the input at fault, its value if there is one, and how to correct it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file was read, but its content is unusable.
    #[error("{}: {reason}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and how to correct it.
        reason: String,
    },
    /// A value is out of its range or contradicts another.
    #[error("{name} = {value}: {remedy}")]
    Parameter {
        /// The parameter, as the user writes it (`device.radius_mm`).
        name: String,
        /// The value given.
        value: String,
        /// What would be valid.
        remedy: String,
    },
    /// This crate was built without what is needed.
    #[error("{what} needs the feature {feature:?} of endowire-core: build with it")]
    Feature {
        /// What needs it, as the user writes it (`method.self_contact = true`).
        what: String,
        /// The feature.
        feature: &'static str,
    },
    /// A surface mesh is unsuitable as a vessel wall.
    #[error("mesh: {0}")]
    Mesh(String),
    /// A computation did not reach its result.
    #[error("{0}")]
    Computation(String),
    /// It was to be stopped ([`Simulation::stop_when`](crate::insertion::Simulation::stop_when)); nothing has changed.
    #[error("stopped before an equilibrium was found")]
    Stopped,
    /// The device can go no farther: not a failure, but where the way ends.
    #[error("{0}")]
    End(PhysicalEnd),
}

/// Why a device can go no farther.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PhysicalEnd {
    /// The tip has left the vessel and is too far beyond the opening, where the anatomy is unknown.
    Left {
        /// Number of the opening.
        opening: usize,
        /// Distance of the device's farthest point beyond its plane, mm.
        beyond_mm: f64,
        /// Largest distance allowed, mm.
        limit_mm: f64,
    },
    /// The vessel is narrower than the device.
    Blocked {
        /// Where, mm.
        position_mm: Vec3,
        /// Half of the width there, mm.
        lumen_radius_mm: f64,
        /// Radius of the device there, mm.
        device_radius_mm: f64,
    },
}

impl std::fmt::Display for PhysicalEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Left { opening, beyond_mm, limit_mm } => write!(
                f,
                "the device has left the vessel through opening {opening} by {beyond_mm:.1} mm, and beyond {limit_mm} mm nothing \
                 is known: stop the script earlier or use a vessel that goes on"
            ),
            Self::Blocked { position_mm, lumen_radius_mm, device_radius_mm } => write!(
                f,
                "blocked at [{:.2}, {:.2}, {:.2}]: half of the room there is {lumen_radius_mm:.3} mm, and the device has a \
                 radius of {device_radius_mm:.3} mm: stop the script earlier or use a thinner device",
                position_mm.x, position_mm.y, position_mm.z
            ),
        }
    }
}

/// Numbers of at most this many characters are printed unchanged.
const SHORT: usize = 6;

impl Error {
    /// A [`Error::Parameter`] from anything printable.
    pub fn parameter(
        name: impl std::fmt::Display,
        value: impl std::fmt::Display,
        remedy: impl Into<String>,
    ) -> Self {
        // Hundreds of digits would hide what is wrong with a number.
        let text = value.to_string();
        let value = if text.len() > SHORT { text.parse().map_or(text, number) } else { text };
        Self::Parameter { name: name.to_string(), value, remedy: remedy.into() }
    }

    /// A [`Error::File`] for `path`.
    pub fn file(path: &Path, source: std::io::Error) -> Self {
        Self::File { path: path.to_path_buf(), source }
    }

    /// A [`Error::Content`] for `path`.
    pub fn content(path: &Path, reason: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), reason: reason.into() }
    }

    /// A [`Error::Feature`].
    pub(crate) fn feature(feature: &'static str, what: impl std::fmt::Display) -> Self {
        Self::Feature { what: what.to_string(), feature }
    }

    /// Whether the input is at fault (in contrast to a computation that failed on valid input).
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::Computation(_) | Self::Stopped | Self::End(_))
    }
}

/// Formats a number for messages, with an exponent instead of many zeros.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || (1e-4..1e9).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// The known name most similar to an unknown one; `None` if there are no names.
pub fn nearest_name<'a>(known: impl Iterator<Item = &'a str>, wrong: &str) -> Option<&'a str> {
    let alike = |name: &str| strsim::jaro_winkler(name, wrong);
    known.max_by(|a, b| alike(a).total_cmp(&alike(b)))
}

/// Formats a vector for messages.
pub(crate) fn vector(v: &Vec3) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

/// Checks that `value` is finite and in (0, limit].
///
/// # Errors
/// A [`Error::Parameter`] naming `name`.
pub fn in_range(name: &str, value: f64, limit: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 && value <= limit {
        return Ok(());
    }
    Err(Error::parameter(name, value, format!("must be a number above 0 and at most {limit}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_readable() {
        let shown = |value: f64| Error::parameter("a", value, "b").to_string();
        assert_eq!(shown(1e300), "a = 1e300: b");
        assert_eq!(shown(-2.5e-300), "a = -2.5e-300: b");
        assert_eq!(shown(123_456.789), "a = 123456.789: b");
        assert_eq!(shown(0.0), "a = 0: b");
        assert_eq!(shown(f64::INFINITY), "a = inf: b");
        assert_eq!(Error::parameter("a", "12 steps", "b").to_string(), "a = 12 steps: b");
        assert_eq!(vector(&crate::Vec3::new(1e200, 0.5, 0.0)), "[1e200, 0.5, 0]");
    }
}
