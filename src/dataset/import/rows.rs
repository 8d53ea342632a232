//! Rows of numbers out of foreign files, checked as far as they can be without knowing what they mean.

use rust_hdf5::DatatypeMessage;

use super::super::{DatasetError, TaskFile, hdf5::NumberType};

/// The key of a data set, as messages name it.
pub(super) fn key(demo: usize, name: &str) -> String {
    format!("/data/demo_{demo}/{name}")
}

/// Something that is wrong with a data set.
pub(super) fn wrong(file: &TaskFile, demo: usize, name: &str, what: String) -> DatasetError {
    DatasetError::content(file.path(), key(demo, name), what)
}

/// A data set of N finite floating-point numbers a step.
///
/// # Errors
/// It is not there, or of another shape, or of other numbers; `steps` is how many rows it must have, if that is known.
pub(super) fn rows<const N: usize>(
    file: &TaskFile,
    demo: usize,
    name: &str,
    steps: Option<usize>,
) -> Result<Vec<[f64; N]>, DatasetError> {
    let data = file.dataset(demo, name)?;
    let shape = data.shape();
    let fits = matches!(shape[..], [rows, width] if width == N && rows > 0 && steps.is_none_or(|steps| steps == rows));
    if !fits {
        let first = steps.map_or("steps".to_owned(), |steps| steps.to_string());
        let what = format!("expected the shape ({first}, {N}), got {shape:?}");
        return Err(wrong(file, demo, name, what));
    }
    let (numbers, _) = numbers(file, demo, name)?;
    Ok(numbers.as_chunks::<N>().0.to_vec())
}

/// The same, if it is there.
///
/// # Errors
/// As [`rows`], but for its absence.
pub(super) fn if_there<const N: usize>(
    file: &TaskFile,
    demo: usize,
    name: &str,
    steps: usize,
) -> Result<Option<Vec<[f64; N]>>, DatasetError> {
    file.has(demo, name).then(|| rows(file, demo, name, Some(steps))).transpose()
}

/// Finite floating-point numbers of any shape, and the shape.
///
/// # Errors
/// It is not there, or of other numbers.
pub(super) fn numbers(
    file: &TaskFile,
    demo: usize,
    name: &str,
) -> Result<(Vec<f64>, Vec<usize>), DatasetError> {
    let data = file.dataset(demo, name)?;
    let shape = data.shape();
    if !matches!(NumberType::of(file.path(), &key(demo, name), &data)?, NumberType::F64 | NumberType::F32) {
        let got = match data.datatype() {
            Ok(DatatypeMessage::FloatingPoint { size, .. }) => format!("float{}", 8 * size),
            Ok(DatatypeMessage::FixedPoint { .. }) => "integers".to_owned(),
            _ => "something else".to_owned(),
        };
        let what = format!("expected numbers of type float32 or float64, got {got}");
        return Err(wrong(file, demo, name, what));
    }
    let (numbers, width) = file.doubles(demo, name)?;
    if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
        let (step, place, width) = (at / width.max(1), at % width.max(1), numbers[at]);
        return Err(wrong(file, demo, name, format!("step {step}, number {place}: {width} is not finite")));
    }
    Ok((numbers, shape))
}
