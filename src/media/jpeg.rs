//! JPEG files of images.

use image::{RgbImage, codecs::jpeg::JpegEncoder};

/// Encodes an image with a quality of 1 to 100. `None` if an edge is longer than the format allows, 65,535 pixels.
pub fn encode_jpeg(image: &RgbImage, quality: u8) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    // Writing to memory does not fail.
    JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(image).ok()?;
    Some(bytes)
}
