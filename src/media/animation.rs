//! Animated pictures for web pages, which play no video files: PNG files of up to 255 colours that loop.
//!
//! The palette is found by median cut (Heckbert, Color image quantization for frame buffer display, SIGGRAPH 1982),
//! here and not by a crate: those of the image libraries make one palette per frame, with which colours flicker and
//! pixels that stay the same cannot be left out.

use std::time::Duration;

use image::RgbImage;
use png::{BitDepth, BlendOp, ColorType, Encoder};

use super::canvas::Rgb8;

/// Index of the transparent entry of the palette, which shows the pixel of the frame before.
const UNCHANGED: u8 = 255;
/// Bits of a channel that the palette distinguishes.
const BITS: usize = 6;
/// Number of colours that are distinguished.
const BINS: usize = 1 << (3 * BITS);

#[derive(Debug, thiserror::Error)]
pub enum AnimationError {
    #[error("the animation has no frames")]
    Empty,
    #[error("frame {index} of the animation has another size than its still picture")]
    Size { index: usize },
    #[error("cannot encode the animation: {0}")]
    Encoding(#[from] png::EncodingError),
}

/// Encodes frames that are each shown for `each`, the last one for `last`, again and again. Programs that show no
/// animations show the picture `still`.
///
/// # Errors
/// There are no frames, or they differ in size from `still`.
pub fn encode(
    still: &RgbImage,
    frames: &[RgbImage],
    each: Duration,
    last: Duration,
) -> Result<Vec<u8>, AnimationError> {
    if frames.is_empty() {
        return Err(AnimationError::Empty);
    }
    if let Some(index) = frames.iter().position(|frame| frame.dimensions() != still.dimensions()) {
        return Err(AnimationError::Size { index });
    }
    let palette = Palette::new(frames.iter().chain([still]));
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, still.width(), still.height());
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_palette(palette.bytes());
    let mut opacity = [255; 256];
    opacity[usize::from(UNCHANGED)] = 0;
    encoder.set_trns(&opacity[..]);
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_animated(frames.len() as u32, 0)?;
    encoder.set_sep_def_img(true)?;
    encoder.set_blend_op(BlendOp::Over)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&palette.indices(still))?;
    let mut shown: Vec<u8> = Vec::new();
    for (index, frame) in frames.iter().enumerate() {
        let pixels = palette.indices(frame);
        let changed: Vec<u8> = match index {
            0 => pixels.clone(),
            _ => pixels
                .iter()
                .zip(&shown)
                .map(|(new, old)| if new == old { UNCHANGED } else { *new })
                .collect(),
        };
        let duration = if index + 1 == frames.len() { last } else { each };
        writer.set_frame_delay(duration.as_millis().min(u128::from(u16::MAX)) as u16, 1000)?;
        writer.write_image_data(&changed)?;
        shown = pixels;
    }
    writer.finish()?;
    Ok(file)
}

/// Colours of an animation, and the one that is nearest to each colour of its frames.
struct Palette {
    colours: Vec<Rgb8>,
    nearest: Vec<u8>,
}

impl Palette {
    fn new<'a>(pictures: impl Iterator<Item = &'a RgbImage>) -> Self {
        let mut counts = vec![ColourCount::default(); BINS];
        for pixel in pictures.flat_map(|picture| picture.pixels()) {
            counts[bin(pixel.0)].add(pixel.0);
        }
        let used: Vec<ColourCount> = counts.iter().filter(|count| count.pixels > 0).copied().collect();
        let colours: Vec<Rgb8> = median_cut(used, usize::from(UNCHANGED)).iter().map(mean).collect();
        let nearest = |count: &ColourCount| {
            let [r, g, b] = count.mean();
            let distance = |colour: &Rgb8| {
                let [dr, dg, db] = [[r, colour[0]], [g, colour[1]], [b, colour[2]]]
                    .map(|[a, b]| (i32::from(a) - i32::from(b)).pow(2));
                dr + dg + db
            };
            (0..colours.len()).min_by_key(|at| distance(&colours[*at])).unwrap_or(0) as u8
        };
        let nearest = counts.iter().map(|count| if count.pixels > 0 { nearest(count) } else { 0 }).collect();
        Self { colours, nearest }
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.colours.iter().flatten().copied().collect();
        bytes.resize(3 * 256, 0);
        bytes
    }

    fn indices(&self, frame: &RgbImage) -> Vec<u8> {
        frame.pixels().map(|pixel| self.nearest[bin(pixel.0)]).collect()
    }
}

/// Number of a colour among those that are distinguished.
fn bin(colour: Rgb8) -> usize {
    colour.iter().fold(0, |bin, channel| (bin << BITS) | usize::from(channel >> (8 - BITS)))
}

/// Pixels of one of the distinguished colours.
#[derive(Clone, Copy, Default)]
struct ColourCount {
    pixels: u64,
    sums: [u64; 3],
}

impl ColourCount {
    fn add(&mut self, colour: Rgb8) {
        self.pixels += 1;
        self.sums.iter_mut().zip(colour).for_each(|(sum, value)| *sum += u64::from(value));
    }

    fn mean(&self) -> Rgb8 {
        self.sums.map(|sum| (sum / self.pixels.max(1)) as u8)
    }
}

fn mean(colours: &Vec<ColourCount>) -> Rgb8 {
    let mut all = ColourCount::default();
    for count in colours {
        all.pixels += count.pixels;
        all.sums.iter_mut().zip(count.sums).for_each(|(sum, value)| *sum += value);
    }
    all.mean()
}

/// Divides colours into at most `most` boxes: again and again the one with the largest product of its pixels' square
/// root and its extent, at the middle of its longest side.
fn median_cut(colours: Vec<ColourCount>, most: usize) -> Vec<Vec<ColourCount>> {
    let mut boxes = vec![colours];
    while boxes.len() < most {
        let weight = |colours: &Vec<ColourCount>| {
            let pixels: u64 = colours.iter().map(|count| count.pixels).sum();
            (pixels as f64).sqrt() * f64::from(longest_side(colours).extent)
        };
        let heaviest = (0..boxes.len()).max_by(|a, b| weight(&boxes[*a]).total_cmp(&weight(&boxes[*b])));
        let Some(heaviest) = heaviest.filter(|at| weight(&boxes[*at]) > 0.0) else { break };
        let colours = boxes.swap_remove(heaviest);
        let Side { channel, middle, .. } = longest_side(&colours);
        let (low, high) = colours.into_iter().partition(|count| count.mean()[channel] <= middle);
        boxes.extend([low, high]);
    }
    boxes
}

struct Side {
    channel: usize,
    extent: u8,
    middle: u8,
}

fn longest_side(colours: &[ColourCount]) -> Side {
    let side = |channel: usize| {
        let values = || colours.iter().map(|count| count.mean()[channel]);
        let (low, high) = (values().min().unwrap_or(0), values().max().unwrap_or(0));
        Side { channel, extent: high - low, middle: low + (high - low) / 2 }
    };
    // The first one of equals.
    [2, 1, 0].map(side).into_iter().max_by_key(|side| side.extent).unwrap_or_else(|| side(0))
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{AnimationDecoder, Rgb, codecs::png::PngDecoder};

    use super::*;

    fn decoded(file: &[u8]) -> Vec<image::Frame> {
        let decoder = PngDecoder::new(Cursor::new(file)).unwrap().apng().unwrap();
        decoder.into_frames().collect_frames().unwrap()
    }

    #[test]
    fn frames_are_decoded_as_they_were_with_their_durations() {
        let frame = |at: u32| {
            RgbImage::from_fn(40, 30, |x, _| if x / 8 == at { Rgb([213, 94, 0]) } else { Rgb([22, 24, 28]) })
        };
        let frames = [frame(0), frame(1), frame(4)];
        let file =
            encode(&frame(2), &frames, Duration::from_millis(100), Duration::from_millis(1500)).unwrap();
        let read = decoded(&file);
        assert_eq!(read.len(), 3);
        for (read, frame) in read.iter().zip(&frames) {
            let same = read.buffer().pixels().zip(frame.pixels()).all(|(a, b)| a.0[..3] == b.0);
            assert!(same, "few colours are kept exactly");
        }
        let still = image::load_from_memory(&file).unwrap().into_rgb8();
        assert_eq!(still, frame(2), "what programs without animations show");
        let milliseconds: Vec<u32> = read.iter().map(|frame| frame.delay().numer_denom_ms().0).collect();
        assert_eq!(milliseconds, [100, 100, 1500]);
    }

    #[test]
    fn many_colours_are_near_to_those_of_the_frame() {
        let frame = RgbImage::from_fn(128, 128, |x, y| Rgb([2 * x as u8, 2 * y as u8, (x + y) as u8]));
        let file = encode(&frame, std::slice::from_ref(&frame), Duration::ZERO, Duration::ZERO).unwrap();
        let read = decoded(&file).remove(0);
        let worst = read
            .buffer()
            .pixels()
            .zip(frame.pixels())
            .flat_map(|(a, b)| a.0.into_iter().zip(b.0).map(|(a, b)| a.abs_diff(b)).collect::<Vec<_>>());
        assert!(worst.max() < Some(24), "16384 colours in 255");
        let still = RgbImage::new(2, 2);
        assert!(encode(&still, &[], Duration::ZERO, Duration::ZERO).is_err());
        let frames = [RgbImage::new(2, 2), RgbImage::new(3, 2)];
        let sizes = encode(&still, &frames, Duration::ZERO, Duration::ZERO);
        assert!(matches!(sizes, Err(AnimationError::Size { index: 1 })));
    }
}
