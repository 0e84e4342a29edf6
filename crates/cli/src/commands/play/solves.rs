//! Limit of linear solves per tick.

use std::fmt;
use std::num::NonZeroUsize;
use std::str::FromStr;

use endowire_play::TICK_SOLVES;

/// Linear solves per tick; `None` if each tick ends in equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Solves(pub(super) Option<usize>);

impl Default for Solves {
    fn default() -> Self {
        Self(Some(TICK_SOLVES))
    }
}

impl fmt::Display for Solves {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(solves) => solves.fmt(f),
            None => f.write_str("all"),
        }
    }
}

impl FromStr for Solves {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" {
            return Ok(Self(None));
        }
        let solves: Result<NonZeroUsize, _> = text.parse();
        solves.map(|solves| Self(Some(solves.get()))).map_err(|_| "give a number above 0, or all".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_has_some_solves_or_all_that_it_takes() {
        assert_eq!("12".parse(), Ok(Solves(Some(12))));
        assert_eq!("all".parse(), Ok(Solves(None)));
        for wrong in ["0", "-1", "2.5", ""] {
            assert!(wrong.parse::<Solves>().is_err(), "{wrong}");
        }
        for one in [Solves::default(), Solves(None)] {
            assert_eq!(one.to_string().parse(), Ok(one));
        }
    }
}
