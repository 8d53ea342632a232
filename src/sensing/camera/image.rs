//! Rendered camera images; resizing and PNG encoding of RGB images.

use std::io::Cursor;

use fast_image_resize::{
    FilterType, ResizeAlg, ResizeOptions, Resizer,
    images::{TypedImage, TypedImageRef},
    pixels::U8x3,
};
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

#[cfg(test)]
mod tests {
    use image::{
        Rgb,
        imageops::{self, FilterType},
    };
    use proptest::prelude::*;

    use super::*;

    fn noisy(width: u32, height: u32, noise: [u32; 3]) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let mixed = |n: u32| x.wrapping_mul(n | 1) ^ y.wrapping_mul(n.rotate_left(9) | 1);
            Rgb(noise.map(|n| mixed(n).wrapping_mul(2_654_435_761).to_be_bytes()[0]))
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// The reference is the floating-point filter of the `image` crate. Each of the two rounds once per direction.
        #[test]
        fn resizing_agrees_with_a_floating_point_triangle_filter(
            (width, height, w, h) in (1..330u32, 1..250u32, 1..80u32, 1..80u32), noise in any::<[u32; 3]>(),
        ) {
            let image = noisy(width, height, noise);
            let expected = imageops::resize(&image, w, h, FilterType::Triangle);
            let worst = resize(&image, w, h).iter().zip(expected.iter()).map(|(a, b)| a.abs_diff(*b)).max();
            prop_assert!(worst <= Some(1), "{worst:?}");
        }
    }

    #[test]
    fn empty_images_resize_to_black_and_empty_sizes_to_empty() {
        assert_eq!(resize(&RgbImage::new(0, 5), 2, 2), RgbImage::new(2, 2));
        assert_eq!(resize(&noisy(5, 5, [1; 3]), 0, 0).len(), 0);
    }
}
