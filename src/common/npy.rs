//! NumPy's array files: `.npy` (`numpy.lib.format`) and arrays of an `.npz` archive.
//!
//! Reads arrays of integers and floating-point numbers in C order and little endian; writes format 1.0. The crate
//! `npyz` does the same and more, but brings a second version of `zip`, `pest` and `num-bigint` for little code here.

use std::{
    fmt::{self, Write},
    fs::File,
    io::{BufReader, Read},
    path::Path,
};

use zip::result::ZipError;

const MAGIC: &[u8] = b"\x93NUMPY";
/// NumPy starts the data at a multiple of this, bytes.
const ALIGNMENT: usize = 64;

/// An array in C order (last axis fastest).
///
/// ```
/// use softvt_common::npy::NpyArray;
///
/// let array = NpyArray::from_f64(vec![2, 3], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
/// let back = NpyArray::parse(&array.to_npy())?;
/// assert_eq!((back.dtype.as_str(), back.values()[4]), ("<f8", 4.0));
/// # Ok::<(), softvt_common::npy::NpyError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct NpyArray {
    /// Element type in NumPy's notation: byte order (`<`, `>`, `|`, `=`), kind and bytes per element, as
    /// in `<f4` or `|u1`.
    pub dtype: String,
    /// Lengths of the axes, slowest first.
    pub shape: Vec<usize>,
    /// Raw elements of type `dtype`.
    pub data: Vec<u8>,
}

/// Reason why an array cannot be read; the message of one in an archive names the file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NpyError(String);

impl NpyError {
    pub fn new(path: &Path, reason: impl fmt::Display) -> Self {
        Self(format!("{}: {reason}", path.display()))
    }
}

impl NpyArray {
    /// Array of bytes, such as an image.
    pub fn from_bytes(shape: Vec<usize>, data: Vec<u8>) -> Self {
        Self { dtype: "|u1".to_owned(), shape, data }
    }

    pub fn from_u16(shape: Vec<usize>, values: impl IntoIterator<Item = u16>) -> Self {
        let data = values.into_iter().flat_map(u16::to_le_bytes).collect();
        Self { dtype: "<u2".to_owned(), shape, data }
    }

    pub fn from_f32(shape: Vec<usize>, values: impl IntoIterator<Item = f32>) -> Self {
        let data = values.into_iter().flat_map(f32::to_le_bytes).collect();
        Self { dtype: "<f4".to_owned(), shape, data }
    }

    pub fn from_f64(shape: Vec<usize>, values: impl IntoIterator<Item = f64>) -> Self {
        let data = values.into_iter().flat_map(f64::to_le_bytes).collect();
        Self { dtype: "<f8".to_owned(), shape, data }
    }

    /// Element type without the byte order: `f4`, `u1`.
    pub fn kind(&self) -> &str {
        self.dtype.trim_start_matches(['<', '|', '=', '>'])
    }

    /// Elements as double-precision numbers; empty if [`element_size`] does not support the type.
    pub fn values(&self) -> Vec<f64> {
        let Some(size) = element_size(&self.dtype) else { return Vec::new() };
        self.data.chunks_exact(size).map(|bytes| decode(&self.dtype, bytes)).collect()
    }

    /// Contents of an `.npy` file (format 1.0), byte for byte as NumPy writes them.
    pub fn to_npy(&self) -> Vec<u8> {
        let shape = match self.shape[..] {
            [only] => format!("{only},"),
            _ => self.shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", "),
        };
        let mut header =
            format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({shape}), }}", self.dtype);
        // Magic, version, length of the header, and the final newline.
        let length = MAGIC.len() + 2 + 2 + header.len() + 1;
        let padding = length.next_multiple_of(ALIGNMENT) - length;
        // Writing into a string cannot fail.
        let _ = writeln!(header, "{:padding$}", "");
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(&self.data);
        bytes
    }

    /// Parses the contents of an `.npy` file.
    ///
    /// # Errors
    /// The bytes are not an array, or one of another order, type or length than can be read.
    pub fn parse(bytes: &[u8]) -> Result<Self, NpyError> {
        let error = |reason: &str| NpyError(reason.to_owned());
        let cut_off = || error("its header is cut off");
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| error("not an .npy array"))?;
        let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(cut_off)?;
        let (length, rest) = if version[0] == 1 {
            let (length, rest) = rest.split_first_chunk::<2>().ok_or_else(cut_off)?;
            (usize::from(u16::from_le_bytes(*length)), rest)
        } else {
            let (length, rest) = rest.split_first_chunk::<4>().ok_or_else(cut_off)?;
            (u32::from_le_bytes(*length) as usize, rest)
        };
        let (header, data) = rest.split_at_checked(length).ok_or_else(cut_off)?;
        let header = std::str::from_utf8(header).map_err(|_| error("its header is not text"))?;
        if header.contains("'fortran_order': True") {
            return Err(error("is in Fortran order; save it with numpy.ascontiguousarray"));
        }
        let dtype = between(header, "'descr': '", "'").unwrap_or_default();
        let size = element_size(dtype).filter(|_| !dtype.starts_with('>'));
        let size = size.ok_or_else(|| {
            let kind = dtype.trim_start_matches(['<', '|', '=']);
            NpyError(format!("of type '{kind}'; expected numbers, little endian"))
        })?;
        let lengths = between(header, "'shape': (", ")").ok_or_else(|| error("its header has no shape"))?;
        let lengths = lengths.split(',').map(str::trim).filter(|n| !n.is_empty());
        let shape = lengths.map(|n| n.parse().ok()).collect::<Option<Vec<usize>>>();
        let shape = shape.ok_or_else(|| error("its shape is not readable"))?;
        let expected = shape.iter().try_fold(size, |a: usize, &b| a.checked_mul(b));
        if expected != Some(data.len()) {
            return Err(NpyError(format!("{} bytes do not fill the shape {shape:?}", data.len())));
        }
        Ok(Self { dtype: dtype.to_owned(), shape, data: data.to_vec() })
    }
}

/// Bytes per element of a type in NumPy's notation; `None` if its elements are not real numbers of up to 8 bytes.
pub fn element_size(dtype: &str) -> Option<usize> {
    let known = ["f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"];
    let (order, kind) = dtype.split_at_checked(1)?;
    let size: usize = kind.get(1..)?.parse().ok()?;
    (matches!(order, "<" | ">" | "|" | "=") && known.contains(&kind)).then_some(size)
}

/// One element of a type that [`element_size`] supports, from its bytes.
fn decode(dtype: &str, bytes: &[u8]) -> f64 {
    let mut word = [0; 8];
    word[..bytes.len()].copy_from_slice(bytes);
    if dtype.starts_with('>') {
        word[..bytes.len()].reverse();
    }
    let unsigned = u64::from_le_bytes(word);
    let unused = 64 - 8 * bytes.len() as u32;
    match (&dtype[1..2], bytes.len()) {
        ("f", 2) => half::f16::from_bits(unsigned as u16).to_f64(),
        ("f", 4) => f64::from(f32::from_bits(unsigned as u32)),
        ("f", _) => f64::from_bits(unsigned),
        ("i", _) => ((unsigned << unused) as i64 >> unused) as f64,
        _ => unsigned as f64,
    }
}

/// Reads the array `key` of the archive at `path`.
///
/// # Errors
/// Names the file and, if the file can be opened, the key.
pub fn read_npz(path: &Path, key: &str) -> Result<NpyArray, NpyError> {
    let error = |reason: fmt::Arguments| NpyError::new(path, reason);
    let of_array = |reason: &dyn fmt::Display| error(format_args!("array \"{key}\": {reason}"));
    let file = File::open(path).map_err(|e| error(format_args!("{e}")))?;
    let mut archive = zip::ZipArchive::new(BufReader::new(file))
        .map_err(|e| error(format_args!("not an .npz file, so there is no array \"{key}\": {e}")))?;
    let keys: Vec<String> =
        archive.file_names().map(|name| name.trim_end_matches(".npy").to_owned()).collect();
    let mut entry = archive.by_name(&format!("{key}.npy")).map_err(|e| match e {
        ZipError::FileNotFound => {
            error(format_args!("no array \"{key}\"; the file has: {}", keys.join(", ")))
        }
        e => of_array(&e),
    })?;
    let mut bytes = Vec::new();
    entry.read_to_end(&mut bytes).map_err(|e| of_array(&format_args!("cannot be read to its end: {e}")))?;
    NpyArray::parse(&bytes).map_err(|e| of_array(&e))
}

/// Reads the array `key` of the archive at `path`. Its type must be one of `kinds` (without byte
/// order), its elements finite.
pub fn read_npz_of(path: &Path, key: &str, kinds: &[&str]) -> Result<NpyArray, NpyError> {
    let error = |reason: fmt::Arguments| Err(NpyError::new(path, format_args!("array \"{key}\": {reason}")));
    let array = read_npz(path, key)?;
    if !kinds.contains(&array.kind()) {
        let expected = kinds.join(" or ");
        return error(format_args!("expected type {expected}, got {}", array.kind()));
    }
    if let Some((at, value)) = array.values().iter().enumerate().find(|(_, value)| !value.is_finite()) {
        return error(format_args!("entry {at} is {value}; expected a finite number"));
    }
    Ok(array)
}

/// Text between the first `before` and the next `after`.
fn between<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(before)?;
    rest.split_once(after).map(|(found, _)| found)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn arrays_are_read_and_errors_name_file_and_key() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.npz");
        let mut zip = zip::ZipWriter::new(File::create(&path).expect("a file"));
        let options = zip::write::SimpleFileOptions::default();
        let good = NpyArray { dtype: "<u2".into(), shape: vec![1, 2], data: vec![1, 0, 0, 1] };
        let odd = NpyArray { dtype: "|O".into(), shape: vec![1], data: vec![0] };
        for (name, array) in [("good.npy", &good), ("odd.npy", &odd)] {
            zip.start_file(name, options).expect("an entry");
            zip.write_all(&array.to_npy()).expect("written");
        }
        zip.finish().expect("finished");
        let array = read_npz(&path, "good").expect("a good array");
        assert_eq!((&array, array.values()), (&good, vec![1.0, 256.0]));
        let missing = read_npz(&path, "grad_r").expect_err("no such key").to_string();
        assert!(missing.contains("a.npz: no array \"grad_r\"; the file has: ") && missing.contains("good"));
        let odd = read_npz(&path, "odd").expect_err("objects").to_string();
        assert!(odd.contains("array \"odd\": of type 'O'"), "{odd}");
        assert!(
            read_npz(&folder.path().join("b.npz"), "x").expect_err("no file").to_string().contains("b.npz")
        );
    }

    #[test]
    fn arrays_are_written_as_numpy_writes_them() {
        for (shape, tuple) in [(vec![], "()"), (vec![2], "(2,)"), (vec![2, 3], "(2, 3)")] {
            let count = shape.iter().product();
            let array = NpyArray::from_f64(shape, vec![0.5; count]);
            let bytes = array.to_npy();
            let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {tuple}, }}");
            assert!(bytes.starts_with(b"\x93NUMPY\x01\x00v\x00"), "a header of 118 bytes");
            assert_eq!(&bytes[10..10 + header.len()], header.as_bytes());
            assert_eq!((bytes[127], bytes.len()), (b'\n', 128 + 8 * count));
            assert_eq!(NpyArray::parse(&bytes), Ok(array));
        }
    }

    #[test]
    fn broken_arrays_are_named() {
        let whole = NpyArray::from_f32(vec![2], [1.0, 2.0]).to_npy();
        let error = |bytes: &[u8]| NpyArray::parse(bytes).expect_err("a broken array").to_string();
        assert_eq!(error(b"hello"), "not an .npy array");
        assert_eq!(error(&whole[..9]), "its header is cut off");
        assert_eq!(error(&whole[..whole.len() - 1]), "7 bytes do not fill the shape [2]");
        let big_endian = NpyArray { dtype: ">f8".into(), ..NpyArray::from_f64(vec![1], [1.0]) };
        assert_eq!(error(&big_endian.to_npy()), "of type '>f8'; expected numbers, little endian");
    }
}
