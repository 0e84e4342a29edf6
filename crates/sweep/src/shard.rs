//! Shards: parts of a sweep that are carried out independently.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One of `count` parts of a sweep: every `count`-th run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Number of this shard, from 1.
    number: usize,
    /// Number of shards.
    count: usize,
}

impl Default for Shard {
    /// The whole sweep as one shard.
    fn default() -> Self {
        Self { number: 1, count: 1 }
    }
}

impl Shard {
    /// Whether a run belongs to this shard.
    pub(crate) fn has(self, run: usize) -> bool {
        run % self.count == self.number - 1
    }

    /// Name of this shard's file with an extension.
    pub(crate) fn file_name(self, ending: &str) -> String {
        let Self { number, count } = self;
        if count == 1 { format!("{STEM}.{ending}") } else { format!("{STEM}-{number}-of-{count}.{ending}") }
    }
}

/// Common start of the names of files with rows.
pub(crate) const STEM: &str = "runs";

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((number, count)) if number >= 1 && number <= count => Ok(Self { number, count }),
            _ => Err("say which of how many, the first of four being 1/4".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_belongs_to_one_shard() {
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].map(|text| text.parse().unwrap()).into();
        for run in 0..10 {
            assert_eq!(shards.iter().filter(|shard| shard.has(run)).count(), 1);
        }
        assert_eq!(shards[1].file_name("parquet"), "runs-2-of-3.parquet");
        assert_eq!(Shard::default().file_name("jsonl"), "runs.jsonl");
        for wrong in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2"] {
            assert!(wrong.parse::<Shard>().unwrap_err().contains("1/4"), "{wrong}");
        }
    }
}
