//! Resizing of RGB images.

use fast_image_resize::{
    FilterType, ResizeAlg, ResizeOptions, Resizer,
    images::{TypedImage, TypedImageRef},
    pixels::U8x3,
};
use image::RgbImage;

/// Resizes `image` to `width` × `height` pixels with a triangle filter two pixels wide, in pixels of the coarser image.
///
/// The filter runs in integers, so the bytes are the same on every processor. An image without pixels
/// gives a black one.
pub fn resize(image: &RgbImage, width: u32, height: u32) -> RgbImage {
    let mut resized = RgbImage::new(width, height);
    let source = TypedImageRef::<U8x3>::from_buffer(image.width(), image.height(), image);
    let target = TypedImage::<U8x3>::from_buffer(width, height, &mut resized);
    let (Ok(source), Ok(mut target)) = (source, target) else { unreachable!("both buffers fit their sizes") };
    let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(FilterType::Bilinear));
    // The typed call instantiates one pixel format; all fifteen would take a fifth of the build time.
    Resizer::new()
        .resize_typed(&source, &mut target, &options)
        .unwrap_or_else(|_| unreachable!("no crop box is set"));
    resized
}
