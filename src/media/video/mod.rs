//! Videos: H.264 in MP4, encoded without an external program and playable in browsers.

mod colour;
mod mp4;

use std::path::Path;

use rusty_h264_common::YuvFrame;
use rusty_h264_encoder::{EncodeError, Encoder, EncoderConfig, Preset};
use thiserror::Error;

pub use mp4::VideoInfo;

use softvt_common::files::{self, FileError};

/// Quantiser of the encoder, 0 (lossless) to 51. Images of this benchmark reach about 40 dB.
const QUANTISER: u8 = 22;
/// Frames between two key frames, at which playback can start.
const KEY_INTERVAL: u32 = 40;

#[derive(Debug, Error)]
pub enum VideoError {
    /// The size cannot be encoded: chroma is stored at half the resolution.
    #[error("a video of {0} × {1} pixels cannot be encoded: both must be even, from 16 to 4096")]
    Size(usize, usize),
    #[error("an image of {got} bytes in a video of {width} × {height}: expected {expected}")]
    ImageSize { got: usize, expected: usize, width: usize, height: usize },
    #[error("the encoder failed: {0:?}")]
    Encoder(EncodeError),
    #[error("the video has no frames")]
    Empty,
    #[error(transparent)]
    File(#[from] FileError),
}

/// Encodes a video frame by frame in memory; [`VideoWriter::save`] writes the file.
pub struct VideoWriter {
    encoder: Encoder,
    track: mp4::Track,
    frame: YuvFrame,
}

impl VideoWriter {
    /// Starts a video of `width × height` pixels at `rate` frames per second.
    pub fn new(width: usize, height: usize, rate: u32) -> Result<Self, VideoError> {
        let fits = |size: usize| size.is_multiple_of(2) && (16..=4096).contains(&size);
        if !fits(width) || !fits(height) {
            return Err(VideoError::Size(width, height));
        }
        let mut config = EncoderConfig::baseline(width, height);
        config.qp = QUANTISER;
        config.gop_size = KEY_INTERVAL;
        config.min_keyint = KEY_INTERVAL;
        config.framerate = rate as f32;
        config.preset = Preset::Fast;
        config.level_idc = level(width, height);
        let encoder = Encoder::new(config).map_err(VideoError::Encoder)?;
        Ok(Self {
            encoder,
            track: mp4::Track::new(width, height, rate),
            frame: YuvFrame::black(width, height),
        })
    }

    /// Appends a frame: rows from the top, 3 bytes per pixel, sRGB.
    ///
    /// # Errors
    /// The image has another size, or the encoder fails.
    pub fn push(&mut self, rgb: &[u8]) -> Result<(), VideoError> {
        let (width, height) = (self.frame.width, self.frame.height);
        let expected = 3 * width * height;
        if rgb.len() != expected {
            return Err(VideoError::ImageSize { got: rgb.len(), expected, width, height });
        }
        colour::to_yuv(rgb, &mut self.frame);
        let unit = self.encoder.try_encode(&self.frame).map_err(VideoError::Encoder)?;
        self.track.push(&unit);
        Ok(())
    }

    /// The bytes of the file.
    pub fn finish(self) -> Result<Vec<u8>, VideoError> {
        if self.track.len() == 0 { Err(VideoError::Empty) } else { Ok(self.track.file()) }
    }

    /// Writes the file atomically, creating missing folders.
    ///
    /// # Errors
    /// There are no frames, or the file cannot be written.
    pub fn save(self, path: &Path) -> Result<(), VideoError> {
        Ok(files::replace(path, self.finish()?)?)
    }
}

/// Smallest level that admits this frame size (ITU-T H.264, Table A-1, MaxFS in macroblocks).
fn level(width: usize, height: usize) -> u8 {
    let blocks = width.div_ceil(16) * height.div_ceil(16);
    const LEVELS: [(usize, u8); 6] =
        [(1620, 30), (3600, 31), (5120, 32), (8192, 40), (22080, 50), (36864, 51)];
    LEVELS.iter().find(|(max_blocks, _)| blocks <= *max_blocks).map_or(52, |(_, level)| *level)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image with a moving pattern.
    fn test_image(width: usize, height: usize, at: usize) -> Vec<u8> {
        let wave = |x: f64, y: f64, k: f64| (127.0 + 100.0 * (x * 0.05 * k).sin() * (y * 0.04).cos()) as u8;
        let pixels = (0..width * height).map(|i| ((i % width + at) as f64, (i / width) as f64));
        pixels.flat_map(|(x, y)| [wave(x, y, 1.0), wave(x, y, 0.7), wave(y, x, 1.3)]).collect()
    }

    fn psnr(a: &[u8], b: &[u8]) -> f64 {
        let squares: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
        10.0 * (255.0_f64.powi(2) * a.len() as f64 / squares).log10()
    }

    #[test]
    fn an_independent_decoder_recovers_the_frames_above_36_db() {
        let (width, height) = (224, 224);
        let mut encoder = VideoWriter::new(width, height, 20).unwrap();
        let mut stream = Vec::new();
        let mut frame = YuvFrame::black(width, height);
        for at in 0..5 {
            colour::to_yuv(&test_image(width, height, 2 * at), &mut frame);
            stream.extend(encoder.encoder.try_encode(&frame).unwrap());
        }
        let decoded = rusty_h264_decoder::Decoder::new().decode_stream(&stream).unwrap();
        assert_eq!(decoded.len(), 5);
        for (at, frame) in decoded.iter().enumerate() {
            let quality = psnr(&colour::to_rgb(frame), &test_image(width, height, 2 * at));
            assert!(quality > 36.0, "frame {at}: {quality} dB");
        }
    }

    #[test]
    fn odd_sizes_and_images_of_another_size_are_refused() {
        assert!(matches!(VideoWriter::new(225, 224, 20), Err(VideoError::Size(..))));
        let mut video = VideoWriter::new(32, 32, 20).unwrap();
        assert!(matches!(video.push(&[0; 7]), Err(VideoError::ImageSize { expected: 3072, .. })));
        assert!(matches!(video.finish(), Err(VideoError::Empty)));
    }

    #[test]
    fn the_level_admits_the_frame_size() {
        assert_eq!(level(224, 224), 30);
        assert_eq!(level(1024, 1024), 32);
    }
}
