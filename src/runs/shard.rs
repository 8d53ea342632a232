//! [`Shard`]: a part of a run, such as 2/8.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// One of `count` parts of a run, numbered from 1: every `count`-th episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// Part `index` of `count`; `None` unless 1 ≤ `index` ≤ `count`.
    pub fn new(index: usize, count: usize) -> Option<Self> {
        (1..=count).contains(&index).then_some(Self { index, count })
    }

    /// True if the shard contains the `job`-th episode of the whole run, counted from 0.
    pub fn contains(&self, job: usize) -> bool {
        job % self.count == self.index - 1
    }

    /// Number of episodes of the shard, of `all` in the whole run.
    pub fn len(&self, all: usize) -> usize {
        (all + self.count - self.index) / self.count
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let shard = word.split_once('/').and_then(|(i, n)| Self::new(i.parse().ok()?, n.parse().ok()?));
        shard.ok_or_else(|| "expected I/N with I in 1..N, such as 2/8".to_owned())
    }
}

impl TryFrom<String> for Shard {
    type Error = String;

    fn try_from(word: String) -> Result<Self, String> {
        word.parse()
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_partition_the_episodes() {
        let shards: Vec<Shard> = (1..=3).map(|i| format!("{i}/3").parse().unwrap()).collect();
        for job in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.contains(job)).count(), 1);
        }
        for word in ["0/3", "4/3", "1", "a/b", "1/0", "-1/3"] {
            assert!(word.parse::<Shard>().is_err(), "{word}");
        }
        assert_eq!(shards[1].to_string(), "2/3");
    }
}
