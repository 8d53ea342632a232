//! Checks of the transforms and of resizing, outside of the library: see its manifest.

use image::{
    Rgb, RgbImage,
    imageops::{self, FilterType},
};
use proptest::prelude::*;
use softvt_signal::{fourier::PaddedFft, resize::resize};

#[test]
fn the_inverse_of_a_transform_is_the_field() {
    let fft = PaddedFft::new(10, 7, 5);
    assert_eq!((fft.width, fft.height), (16, 12));
    let field: Vec<f32> = (0..70).map(|i| (i as f32 * 0.7).sin()).collect();
    let (mut spectrum, mut buffers) = (fft.spectrum(), fft.buffers());
    fft.forward(&field, &mut spectrum, &mut buffers);
    let mut back = vec![0.0; 70];
    fft.inverse(&mut spectrum, &mut back, &mut buffers);
    for (a, b) in field.iter().zip(&back) {
        assert!((a - b / (16.0 * 12.0)).abs() < 1e-6);
    }
}

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
