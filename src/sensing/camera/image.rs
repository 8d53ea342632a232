//! The picture.

use image::RgbImage;

/// What a camera sees. Rows run from the top, pixels from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderedImage {
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
    /// The thing that the camera stands inside of, if it does. Surfaces are seen from outside alone, so the picture shows
    /// what is beyond that thing.
    pub inside: Option<String>,
}

impl RenderedImage {
    /// The colours as an image that can be resized, put together and saved.
    pub fn into_rgb_image(self) -> RgbImage {
        // As many bytes as the size asks for, as every picture has.
        RgbImage::from_raw(self.width as u32, self.height as u32, self.rgb).unwrap_or_default()
    }
}
