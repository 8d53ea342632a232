//! A line of `episodes.jsonl`: the record of an episode, and its SHA-256 as the last key.
//!
//! The digest is of the bytes before the comma in front of its key. It finds a line that was changed or damaged. It is
//! no proof that the simulation gave the record, since a new digest can be computed with a changed line. A replay is.

use std::path::Path;

use super::record::EpisodeRecord;
use softvt_common::{
    digest::sha256_hex,
    files::{FileError, json_lines},
};

/// A line is not the record of an episode as it was written.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    #[error("not an episode record: {0}")]
    Record(#[from] serde_json::Error),
    #[error("it has no record_sha256")]
    NoDigest,
    #[error(
        "its SHA-256 is not the record_sha256 at its end: the line was changed after the episode, or damaged"
    )]
    OtherDigest,
}

/// Text before the digest in a line.
const KEY: &str = ",\"record_sha256\":\"";

/// Text after a record in its line.
fn ending(record: &[u8]) -> String {
    format!("{KEY}{}\"}}", sha256_hex(record))
}

/// The line of a record, with its line break. `path` is its file, for errors.
///
/// # Errors
/// The record cannot be written as JSON.
pub fn write_line(path: &Path, record: &EpisodeRecord) -> Result<String, FileError> {
    let json = json_lines(path, [record])?;
    let record = json.strip_suffix("}\n").unwrap_or(&json);
    Ok(format!("{record}{}\n", ending(record.as_bytes())))
}

/// The record in a line without its line break.
///
/// # Errors
/// The text is not a record, has no digest, or has that of another text.
pub fn read_line(line: &[u8]) -> Result<EpisodeRecord, LineError> {
    let (record, end) = line.split_at(line.len().saturating_sub(ending(b"").len()));
    if end == ending(record).as_bytes() {
        return Ok(serde_json::from_slice(&[record, b"}"].concat())?);
    }
    if end.starts_with(KEY.as_bytes()) {
        return Err(LineError::OtherDigest);
    }
    serde_json::from_slice::<EpisodeRecord>(line)?;
    Err(LineError::NoDigest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;

    #[test]
    fn every_changed_byte_of_a_line_is_found() {
        let record = sample_record();
        let line = write_line(Path::new("episodes.jsonl"), &record).unwrap();
        let line = line.strip_suffix('\n').unwrap().as_bytes();
        assert_eq!(read_line(line).unwrap(), record);
        for at in 0..line.len() {
            let mut changed = line.to_vec();
            changed[at] ^= 1;
            assert!(read_line(&changed).is_err(), "byte {at}");
        }
    }

    #[test]
    fn a_line_is_plain_json_that_begins_with_the_record() {
        let record = sample_record();
        let line = write_line(Path::new("episodes.jsonl"), &record).unwrap();
        let json = serde_json::to_string(&record).unwrap();
        assert!(line.starts_with(json.strip_suffix('}').unwrap()) && line.ends_with("\"}\n"));
        let value: serde_json::Value = serde_json::from_str(&line).unwrap();
        let (last, digest) = value.as_object().unwrap().iter().next_back().unwrap();
        assert_eq!((last.as_str(), digest.as_str().unwrap().len()), ("record_sha256", 64));
        assert!(matches!(read_line(json.as_bytes()), Err(LineError::NoDigest)), "as 0.2.1 wrote it");
    }
}
