//! `--shard i/n` and `softvt merge`: a run spread over many processes and put together again.

use std::path::{Path, PathBuf};

use crate::{
    cli::{error::CliError, output::print},
    report::{shard_merge, terminal},
};

/// The `index`-th (from 1) of `count` parts of a run: every `count`-th episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    index: usize,
    count: usize,
}

/// Reads a shard such as `2/8`.
///
/// # Errors
/// A fragment for people.
pub(crate) fn parse(word: &str) -> Result<Shard, String> {
    let parts = word.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parts {
        Some((index, count)) if (1..=count).contains(&index) => Ok(Shard { index, count }),
        _ => Err("expected I/N with I in 1..N, such as 2/8".to_owned()),
    }
}

impl Shard {
    /// Whether the `job`-th episode of the whole run (from 0) is in it.
    pub(crate) fn has(&self, job: usize) -> bool {
        job % self.count == self.index - 1
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// Merges shards into a new folder and prints its tables.
///
/// # Errors
/// They do not belong together, or a file cannot be read or written.
pub(crate) fn run(out: &Path, shards: &[PathBuf]) -> Result<(), CliError> {
    let summaries = shard_merge::merge(out, shards).map_err(CliError::input)?;
    summaries.iter().for_each(|summary| print(&terminal::table(summary)));
    crate::text::eprint_line(&format!("softvt: {}", out.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_the_episodes_among_them() {
        let shards: Vec<Shard> = (1..=3).map(|i| parse(&format!("{i}/3")).unwrap()).collect();
        for job in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.has(job)).count(), 1);
        }
        for word in ["0/3", "4/3", "1", "a/b", "1/0", "-1/3"] {
            assert!(parse(word).is_err(), "{word}");
        }
        assert_eq!(shards[1].to_string(), "2/3");
    }
}
