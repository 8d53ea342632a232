//! Pictures in other sizes.

use fast_image_resize::{
    FilterType, ResizeAlg, ResizeOptions, Resizer,
    images::{TypedImage, TypedImageRef},
    pixels::U8x3,
};
use image::RgbImage;

/// A picture as one of `width` × `height` pixels, by a triangle filter as wide as two pixels of the coarser of both, in
/// integers: the same bytes on every processor. A picture without pixels gives a black one.
pub fn scaled(picture: &RgbImage, width: u32, height: u32) -> RgbImage {
    let mut scaled = RgbImage::new(width, height);
    let from = TypedImageRef::<U8x3>::from_buffer(picture.width(), picture.height(), picture);
    let into = TypedImage::<U8x3>::from_buffer(width, height, &mut scaled);
    let (Ok(from), Ok(mut into)) = (from, into) else { unreachable!("both have their pixels") };
    let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(FilterType::Bilinear));
    // Told the kind of pixels: code for the fourteen others would make a fifth of a build.
    Resizer::new()
        .resize_typed(&from, &mut into, &options)
        .unwrap_or_else(|_| unreachable!("nothing is cropped"));
    scaled
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

        /// Another crate's filter, in floating point; each rounds once a direction.
        #[test]
        fn it_is_the_triangle_filter(
            (width, height, w, h) in (1..330u32, 1..250u32, 1..80u32, 1..80u32), noise in any::<[u32; 3]>(),
        ) {
            let picture = noisy(width, height, noise);
            let wanted = imageops::resize(&picture, w, h, FilterType::Triangle);
            let worst = scaled(&picture, w, h).iter().zip(wanted.iter()).map(|(a, b)| a.abs_diff(*b)).max();
            prop_assert!(worst <= Some(1), "{worst:?}");
        }
    }

    #[test]
    fn nothing_scales_to_black_and_to_nothing() {
        assert_eq!(scaled(&RgbImage::new(0, 5), 2, 2), RgbImage::new(2, 2));
        assert_eq!(scaled(&noisy(5, 5, [1; 3]), 0, 0).len(), 0);
    }
}
