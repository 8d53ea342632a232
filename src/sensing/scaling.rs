//! Pictures in other sizes.

use fast_image_resize::{FilterType, ResizeAlg, ResizeOptions, Resizer, images::CroppedImageMut};
use image::RgbImage;

/// Scales pictures by a triangle filter that is as wide as two pixels of the coarser of both, in integers: the same bytes on
/// every processor. Keeps its buffers from one picture to the next.
#[derive(Debug, Default)]
pub struct Scaler(Resizer);

impl Scaler {
    /// Puts `picture` into the part `[x, y, width, height]` (pixels) of `into`, which it fills. A picture or a part
    /// without pixels changes nothing.
    ///
    /// # Panics
    /// If the part reaches out of `into`.
    pub fn put(&mut self, picture: &RgbImage, into: &mut RgbImage, [x, y, width, height]: [u32; 4]) {
        if [picture.width(), picture.height(), width, height].contains(&0) {
            return;
        }
        let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(FilterType::Bilinear));
        let part = CroppedImageMut::new(into, x, y, width, height);
        let mut part = part.unwrap_or_else(|error| panic!("{width} × {height} at {x}, {y}: {error}"));
        self.0.resize(picture, &mut part, &options).unwrap_or_else(|_| unreachable!("both are RGB"));
    }
}

/// A picture as one of `width` × `height` pixels; see [`Scaler`].
pub fn scaled(picture: &RgbImage, width: u32, height: u32) -> RgbImage {
    let mut into = RgbImage::new(width, height);
    Scaler::default().put(picture, &mut into, [0, 0, width, height]);
    into
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
    fn nothing_is_changed_around_the_part() {
        let mut into = RgbImage::from_pixel(12, 9, Rgb([7; 3]));
        Scaler::default().put(&noisy(40, 30, [1, 2, 3]), &mut into, [4, 3, 5, 2]);
        let part = imageops::crop_imm(&into, 4, 3, 5, 2).to_image();
        assert_eq!(part, scaled(&noisy(40, 30, [1, 2, 3]), 5, 2));
        let untouched =
            into.enumerate_pixels().filter(|(x, y, _)| !(4..9).contains(x) || !(3..5).contains(y));
        assert_eq!(untouched.filter(|(_, _, pixel)| pixel.0 == [7; 3]).count(), 12 * 9 - 10);
    }

    #[test]
    fn where_there_is_nothing_nothing_changes() {
        assert_eq!(scaled(&RgbImage::new(0, 5), 2, 2), RgbImage::new(2, 2));
        assert_eq!(scaled(&noisy(5, 5, [1; 3]), 0, 0).len(), 0);
    }
}
