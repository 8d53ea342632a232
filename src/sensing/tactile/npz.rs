//! NumPy's `.npy` and `.npz` files, as far as calibration data needs them: plain arrays of numbers in C order.

use std::{
    fs::File,
    io::{BufReader, Read, Seek},
    path::{Path, PathBuf},
};

use zip::result::ZipError;

/// An array.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Lengths, slowest first.
    pub shape: Vec<usize>,
    /// Type as in the file: `u1`, `u2`, `i4`, `i8`, `f4`, `f8`.
    pub kind: String,
    /// The numbers, little endian.
    pub bytes: Vec<u8>,
}

/// Why a file cannot be read; names file and key.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// The file cannot be opened or read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no archive, or lacks the key.
    #[error("{path}: {what}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// Reads the array `key` of the archive `path`.
///
/// # Errors
/// Names the file and, where the file can be opened, the key.
pub fn read_npz(path: &Path, key: &str) -> Result<Array, NpzError> {
    let mut archive = open(path, key)?;
    let keys: Vec<String> =
        archive.file_names().map(|name| name.trim_end_matches(".npy").to_owned()).collect();
    let mut entry = archive.by_name(&format!("{key}.npy")).map_err(|error| match error {
        ZipError::FileNotFound => {
            content(path, format!("no array \"{key}\"; the file has: {}", keys.join(", ")))
        }
        error => content(path, format!("array \"{key}\": {error}")),
    })?;
    read_array(path, key, &mut entry)
}

/// Reads the array `key` of the archive `path`, of one of the types `kinds` and, for one of floating point, all of it
/// finite.
///
/// # Errors
/// As [`read_npz`], or names the type, or the first entry that is no number.
pub fn read_npz_of(path: &Path, key: &str, kinds: &[&str]) -> Result<Array, NpzError> {
    let array = read_npz(path, key)?;
    if !kinds.contains(&array.kind.as_str()) {
        let expected = kinds.join(" or ");
        return Err(content(path, format!("array \"{key}\": expected type {expected}, got {}", array.kind)));
    }
    if let Some((at, value)) = array.values().iter().enumerate().find(|(_, value)| !value.is_finite()) {
        return Err(content(
            path,
            format!("array \"{key}\": entry {at} is {value}; expected a finite number"),
        ));
    }
    Ok(array)
}

/// Reads the array of a `.npy` file.
///
/// # Errors
/// Names the file.
pub fn read_npy(path: &Path) -> Result<Array, NpzError> {
    let file = File::open(path).map_err(|source| NpzError::Io { path: path.into(), source })?;
    read_array(path, "array", &mut BufReader::new(file))
}

fn open(path: &Path, key: &str) -> Result<zip::ZipArchive<impl Read + Seek>, NpzError> {
    let file = File::open(path).map_err(|source| NpzError::Io { path: path.into(), source })?;
    zip::ZipArchive::new(BufReader::new(file))
        .map_err(|e| content(path, format!("not an .npz file, so there is no array \"{key}\": {e}")))
}

fn content(path: &Path, what: String) -> NpzError {
    NpzError::Content { path: path.into(), what }
}

fn read_array(path: &Path, key: &str, from: &mut impl Read) -> Result<Array, NpzError> {
    let broken = |what: &str| content(path, format!("array \"{key}\": {what}"));
    let mut bytes = Vec::new();
    from.read_to_end(&mut bytes).map_err(|e| broken(&format!("cannot be read to its end: {e}")))?;
    if bytes.len() < 12 || &bytes[..6] != b"\x93NUMPY" {
        return Err(broken("not an .npy array"));
    }
    let (start, length) = match bytes[6] {
        1 => (10, usize::from(u16::from_le_bytes([bytes[8], bytes[9]]))),
        _ => (12, u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize),
    };
    let header = bytes.get(start..start + length).and_then(|h| std::str::from_utf8(h).ok());
    let header = header.ok_or_else(|| broken("its header is cut off"))?;
    if header.contains("'fortran_order': True") {
        return Err(broken("is in Fortran order; save it with numpy.ascontiguousarray"));
    }
    let kind = between(header, "'descr': '", "'").unwrap_or_default();
    let kind = kind.trim_start_matches(['<', '|', '=']).to_owned();
    let size = match kind.as_str() {
        "u1" | "i1" => 1,
        "u2" | "i2" => 2,
        "i4" | "f4" => 4,
        "i8" | "f8" => 8,
        _ => return Err(broken(&format!("of type '{kind}'; expected numbers, little endian"))),
    };
    let numbers = between(header, "'shape': (", ")").ok_or_else(|| broken("its header has no shape"))?;
    let shape: Option<Vec<usize>> =
        numbers.split(',').map(str::trim).filter(|n| !n.is_empty()).map(|n| n.parse().ok()).collect();
    let shape = shape.ok_or_else(|| broken("its shape is not readable"))?;
    let count = shape.iter().try_fold(size, |a: usize, &b| a.checked_mul(b));
    bytes.drain(..start + length);
    if count != Some(bytes.len()) {
        return Err(broken(&format!("{} bytes do not fill the shape {shape:?}", bytes.len())));
    }
    Ok(Array { shape, kind, bytes })
}

fn between<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    let rest = &text[text.find(before)? + before.len()..];
    Some(&rest[..rest.find(after)?])
}

impl Array {
    /// The numbers.
    pub fn values(&self) -> Vec<f64> {
        fn each<const N: usize>(bytes: &[u8], of: impl Fn([u8; N]) -> f64) -> Vec<f64> {
            bytes.chunks_exact(N).filter_map(|c| c.try_into().ok()).map(of).collect()
        }
        match self.kind.as_str() {
            "u1" => each(&self.bytes, |b: [u8; 1]| f64::from(b[0])),
            "i1" => each(&self.bytes, |b| f64::from(i8::from_le_bytes(b))),
            "u2" => each(&self.bytes, |b| f64::from(u16::from_le_bytes(b))),
            "i2" => each(&self.bytes, |b| f64::from(i16::from_le_bytes(b))),
            "i4" => each(&self.bytes, |b| f64::from(i32::from_le_bytes(b))),
            "f4" => each(&self.bytes, |b| f64::from(f32::from_le_bytes(b))),
            "i8" => each(&self.bytes, |b| i64::from_le_bytes(b) as f64),
            _ => each(&self.bytes, f64::from_le_bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn arrays_are_read_and_errors_name_file_and_key() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.npz");
        let mut zip = zip::ZipWriter::new(File::create(&path).expect("a file"));
        let options = zip::write::SimpleFileOptions::default();
        zip.start_file("good.npy", options).expect("an entry");
        let header = "{'descr': '<u2', 'fortran_order': False, 'shape': (1, 2), }\n";
        zip.write_all(&npy(header, &[1, 0, 0, 1])).expect("written");
        zip.start_file("odd.npy", options).expect("an entry");
        zip.write_all(&npy("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }\n", &[0]))
            .expect("written");
        zip.finish().expect("finished");
        let array = read_npz(&path, "good").expect("a good array");
        assert_eq!((array.shape.clone(), array.values()), (vec![1, 2], vec![1.0, 256.0]));
        let missing = read_npz(&path, "grad_r").expect_err("no such key").to_string();
        assert!(missing.contains("a.npz: no array \"grad_r\"; the file has: ") && missing.contains("good"));
        let odd = read_npz(&path, "odd").expect_err("objects").to_string();
        assert!(odd.contains("array \"odd\": of type 'O'"), "{odd}");
        assert!(
            read_npz(&folder.path().join("b.npz"), "x").expect_err("no file").to_string().contains("b.npz")
        );
    }
}
