//! Rendered camera images; PNG encoding of images.

use std::io::Cursor;

use image::{EncodableLayout, ImageBuffer, ImageError, ImageFormat, PixelWithColorType, RgbImage};

/// Colour, depth and segmentation of one camera view.
///
/// All three arrays are row-major, with rows from the top and pixels from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderedImage {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// sRGB bytes, height × width × 3.
    pub rgb: Vec<u8>,
    /// Depth along the optical axis, m, height × width; infinite in the background.
    pub depth: Vec<f32>,
    /// The [`segmentation_id`](super::RenderObject::segmentation_id) of the object at each pixel, height × width;
    /// 0 in the background.
    pub segmentation: Vec<u16>,
    /// Name of the object that contains the camera, if any. Surfaces are drawn from outside only, so the image shows
    /// the scene without that object.
    pub inside: Option<String>,
}

impl RenderedImage {
    /// Returns the colours as an image of the `image` crate.
    pub fn into_rgb_image(self) -> RgbImage {
        // The renderer always fills width × height × 3 bytes, so the conversion cannot fail.
        RgbImage::from_raw(self.width as u32, self.height as u32, self.rgb).unwrap_or_default()
    }
}

/// Encodes an image as a PNG file.
///
/// # Errors
/// The image is empty, or too large for the format.
pub fn encode_png<P: PixelWithColorType>(
    image: &ImageBuffer<P, Vec<P::Subpixel>>,
) -> Result<Vec<u8>, ImageError>
where
    [P::Subpixel]: EncodableLayout,
{
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
