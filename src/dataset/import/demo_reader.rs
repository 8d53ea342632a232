//! [`DemoReader`]: arrays of a foreign demonstration, checked for shape, type and finiteness.

use rust_hdf5::DatatypeMessage;

use super::super::{DatasetError, FloatArray, TaskFile};
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_policy::NumberType;

/// One demonstration of a foreign file. Errors of its methods name the file and the key.
#[derive(Clone, Copy)]
pub(super) struct DemoReader<'a> {
    pub file: &'a TaskFile,
    pub demo: usize,
}

impl DemoReader<'_> {
    /// An error about the dataset `name`.
    pub(super) fn error(&self, name: &str, what: impl ToString) -> DatasetError {
        self.file.error(self.demo, name, what)
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.file.has(self.demo, name)
    }

    pub(super) fn shape(&self, name: &str) -> Result<Vec<usize>, DatasetError> {
        self.file.shape(self.demo, name)
    }

    /// Rows of an array of shape (`steps`, N), or (any number of steps, N).
    pub(super) fn rows<const N: usize>(
        &self,
        name: &str,
        steps: Option<usize>,
    ) -> Result<Vec<[f64; N]>, DatasetError> {
        self.require_floats(name)?;
        self.file.rows(self.demo, name, steps)
    }

    /// As [`Self::rows`]; `None` if the array is missing.
    pub(super) fn rows_if_present<const N: usize>(
        &self,
        name: &str,
        steps: usize,
    ) -> Result<Option<Vec<[f64; N]>>, DatasetError> {
        self.has(name).then(|| self.rows(name, Some(steps))).transpose()
    }

    /// A floating-point array of any shape.
    pub(super) fn array(&self, name: &str) -> Result<FloatArray, DatasetError> {
        self.require_floats(name)?;
        self.file.finite_array(self.demo, name)
    }

    fn require_floats(&self, name: &str) -> Result<(), DatasetError> {
        let data = self.file.dataset(self.demo, name)?;
        let number_type = self.file.number_type(self.demo, name, &data)?;
        if matches!(number_type, Some(NumberType::F64 | NumberType::F32)) {
            return Ok(());
        }
        let got = match data.datatype() {
            Ok(DatatypeMessage::FloatingPoint { size, .. }) => format!("float{}", 8 * size),
            Ok(DatatypeMessage::FixedPoint { .. }) => "integers".to_owned(),
            _ => "another type".to_owned(),
        };
        Err(self.error(name, format_args!("expected numbers of type float32 or float64, got {got}")))
    }
}

/// Pose from position (m) and quaternion w x y z of any length but 0; `None` if a number is not finite.
pub(super) fn pose_from_row(row: &[f64]) -> Option<Pose> {
    let q = nalgebra::Quaternion::new(row[3], row[4], row[5], row[6]);
    let position = Vec3::new(row[0], row[1], row[2]);
    let is_valid = q.norm() > 1e-6 && row.iter().all(|x| x.is_finite());
    is_valid.then(|| Pose::from_parts(position.into(), Quat::new_normalize(q)))
}

/// True if a quaternion has length 1 within 1 %.
pub(super) fn is_unit(quaternion: &[f64]) -> bool {
    (quaternion.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() <= 1e-2
}
