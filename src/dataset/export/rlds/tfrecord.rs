//! TFRecord files: records with their lengths and checksums, spread over several files.
//!
//! Written here, since the crates for them bring TensorFlow, or an encoder of their own for its messages.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::PathBuf,
};

use crc::{CRC_32_ISCSI, Crc, Table};

use softvt_common::files::{self, FileError};

/// CRC-32C (Castagnoli), as in iSCSI.
static CRC_32C: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISCSI);

/// The checksum that TensorFlow stores: rotated and offset, since checksums of data that contain checksums are weak.
fn masked_checksum(bytes: &[u8]) -> u32 {
    CRC_32C.checksum(bytes).rotate_right(15).wrapping_add(0xa282_ead8)
}

/// Bytes of a record in addition to its content.
const FRAME: usize = 16;

fn write_record(file: &mut impl Write, record: &[u8]) -> io::Result<()> {
    let length = (record.len() as u64).to_le_bytes();
    file.write_all(&length)?;
    file.write_all(&masked_checksum(&length).to_le_bytes())?;
    file.write_all(record)?;
    file.write_all(&masked_checksum(record).to_le_bytes())
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Split {
    pub shard_lengths: Vec<usize>,
    /// Bytes of all records, without lengths and checksums.
    pub bytes: usize,
}

pub(super) struct ShardWriter {
    dir: PathBuf,
    /// Beginning of the names of the files.
    name: String,
    /// Largest size of a file with several records.
    max_bytes: usize,
    shard: Option<Shard>,
    split: Split,
}

struct Shard {
    file: BufWriter<File>,
    path: PathBuf,
    bytes: usize,
    records: usize,
}

impl Shard {
    fn create(path: PathBuf) -> Result<Self, FileError> {
        let file = File::create(&path).map_err(FileError::io("write", &path))?;
        Ok(Self { file: BufWriter::new(file), path, bytes: 0, records: 0 })
    }

    fn add(&mut self, record: &[u8]) -> Result<(), FileError> {
        self.bytes += record.len() + FRAME;
        self.records += 1;
        write_record(&mut self.file, record).map_err(FileError::io("write", &self.path))
    }

    fn finish(mut self) -> Result<(), FileError> {
        self.file.flush().map_err(FileError::io("write", &self.path))
    }
}

impl ShardWriter {
    /// `dir` exists and has no files whose names begin with `name`.
    pub(super) fn new(dir: PathBuf, name: String, max_bytes: usize) -> Self {
        Self { dir, name, max_bytes, shard: None, split: Split::default() }
    }

    /// Path of a file while the number of all files is unknown.
    fn temp_path(&self, index: usize) -> PathBuf {
        self.dir.join(format!("{}-{index:05}", self.name))
    }

    pub(super) fn add(&mut self, record: &[u8]) -> Result<(), FileError> {
        let is_full = |shard: &Shard| shard.bytes + record.len() + FRAME > self.max_bytes;
        if self.shard.as_ref().is_some_and(is_full) {
            self.finish_shard()?;
        }
        let shard = match self.shard.take() {
            Some(shard) => shard,
            None => Shard::create(self.temp_path(self.split.shard_lengths.len()))?,
        };
        self.split.bytes += record.len();
        self.shard.insert(shard).add(record)
    }

    fn finish_shard(&mut self) -> Result<(), FileError> {
        let Some(shard) = self.shard.take() else { return Ok(()) };
        self.split.shard_lengths.push(shard.records);
        shard.finish()
    }

    /// Completes the files and gives them their final names, which tell their number.
    pub(super) fn finish(mut self) -> Result<Split, FileError> {
        self.finish_shard()?;
        let count = self.split.shard_lengths.len();
        for index in 0..count {
            let path = self.dir.join(format!("{}-{index:05}-of-{count:05}", self.name));
            files::persist(&self.temp_path(index), &path)?;
        }
        Ok(self.split)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn checksums_are_those_of_the_specification() {
        // RFC 3720, B.4.
        assert_eq!(CRC_32C.checksum(&[0; 32]), 0x8a91_36aa);
        assert_eq!(CRC_32C.checksum(&[0xff; 32]), 0x62a8_ab43);
        assert_eq!(CRC_32C.checksum(&std::array::from_fn::<u8, 32, _>(|i| i as u8)), 0x46dd_794e);
        assert_eq!(CRC_32C.checksum(b"123456789"), 0xe306_9283);
    }

    #[test]
    fn a_record_has_the_bytes_that_tensorflow_writes() {
        // with tf.io.TFRecordWriter("x") as writer: writer.write(b"softvt")
        let mut bytes = Vec::new();
        write_record(&mut bytes, b"softvt").unwrap();
        assert_eq!(bytes, b"\x06\0\0\0\0\0\0\0si\xd57softvt\xf3\xdd\x03\xfe");
    }

    #[test]
    fn records_are_spread_over_files_that_do_not_grow_beyond_their_limit() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = ShardWriter::new(folder.path().to_owned(), "x-train.tfrecord".to_owned(), 100);
        // The first two fill a file; the one that alone is larger has a file of its own.
        for length in [34, 34, 1, 200, 5] {
            writer.add(&vec![7; length]).unwrap();
        }
        let split = writer.finish().unwrap();
        assert_eq!(split, Split { shard_lengths: vec![2, 1, 1, 1], bytes: 274 });
        let size = |path: PathBuf| fs::metadata(path).unwrap().len();
        let path = |index: usize| folder.path().join(format!("x-train.tfrecord-{index:05}-of-00004"));
        assert_eq!([0, 1, 2, 3].map(|index| size(path(index))), [100, 17, 216, 21]);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    }
}
