//! What a user may choose of a vessel made from a label map.

use std::str::FromStr;

use crate::{Error, Result};

/// Which parts of a label become the vessel, where it is not connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Parts {
    /// The one with the most voxels.
    #[default]
    Largest,
    /// All that have at least eight.
    All,
}

/// Which ends of vessels are opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ends {
    /// Those at the picture's border, and those of branches that end within it.
    #[default]
    All,
    /// Only those at the picture's border.
    Border,
    /// None: the surface is closed.
    None,
}

impl FromStr for Parts {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "largest" => Ok(Self::Largest),
            "all" => Ok(Self::All),
            _ => Err(Error::parameter("parts", format!("{text:?}"), "must be largest or all")),
        }
    }
}

impl FromStr for Ends {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "all" => Ok(Self::All),
            "border" => Ok(Self::Border),
            "none" => Ok(Self::None),
            _ => Err(Error::parameter("ends", format!("{text:?}"), "must be all, border or none")),
        }
    }
}

/// How a vessel is made from a label map.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LabelOptions {
    /// The labels that together are the vessel.
    pub labels: Vec<u16>,
    /// Which parts are kept.
    pub parts: Parts,
    /// Which ends are opened.
    pub ends: Ends,
}

impl LabelOptions {
    /// The defaults for these labels.
    pub fn of(labels: &[u16]) -> Self {
        Self { labels: labels.to_vec(), ..Self::default() }
    }
}
