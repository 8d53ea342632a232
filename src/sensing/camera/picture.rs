//! The picture and its file.

use std::path::Path;

use super::CameraError;

/// What a camera sees. Rows run from the top, pixels from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// sRGB bytes, height × width × 3.
    pub rgb: Vec<u8>,
    /// Depth along the optical axis, m, height × width; infinite where nothing is.
    pub depth: Vec<f32>,
    /// Object number, height × width; 0 where nothing is.
    pub segmentation: Vec<u16>,
}

impl Picture {
    /// Writes the colours as a PNG file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<(), CameraError> {
        let colour = image::ExtendedColorType::Rgb8;
        image::save_buffer(path, &self.rgb, self.width as u32, self.height as u32, colour).map_err(|error| {
            CameraError::Write { path: path.display().to_string(), reason: error.to_string() }
        })
    }
}
