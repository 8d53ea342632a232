//! The tactile history of both fingers in one picture, as SoftVTBench's policies take it.

use std::borrow::Borrow;

use image::{RgbImage, imageops};
use serde::{Deserialize, Serialize};

use crate::sensing::scaling::scaled;

/// Frames of history a finger.
pub const CELLS: usize = 8;
/// Cells along an edge, and pixels along the edge of a cell.
const EDGE: usize = 4;
const CELL: u32 = 56;

/// Where the fingers' frames go, oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MosaicLayout {
    /// Left finger in the upper two rows, right finger in the lower two (the soft suites).
    #[default]
    Rows,
    /// Left finger in the left two columns, right finger in the right two (the rigid suites).
    Columns,
}

/// A finger's picture as it stands in the mosaic: 56 × 56.
pub fn mosaic_cell(picture: &RgbImage) -> RgbImage {
    scaled(picture, CELL, CELL)
}

/// 4 × 4 cells: the last 8 of the left and of the right finger, by [`mosaic_cell`]. `history` is oldest first, left and
/// right; a shorter one is filled up in front with its oldest cell; an empty one leaves the picture black.
pub fn mosaic<T: Borrow<RgbImage>>(history: [&[T]; 2], layout: MosaicLayout) -> RgbImage {
    let mut picture = RgbImage::new(EDGE as u32 * CELL, EDGE as u32 * CELL);
    for (finger, cells) in history.into_iter().enumerate() {
        for place in 0..CELLS {
            let Some(cell) = cells.get((place + cells.len()).saturating_sub(CELLS)) else { continue };
            let (column, row) = match layout {
                MosaicLayout::Rows => (place % EDGE, 2 * finger + place / EDGE),
                MosaicLayout::Columns => (2 * finger + place % 2, place / 2),
            };
            let corner = [column, row].map(|at| i64::from(CELL) * at as i64);
            imageops::replace(&mut picture, cell.borrow(), corner[0], corner[1]);
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    fn cells(from: u8, count: u8) -> Vec<RgbImage> {
        (0..count).map(|i| mosaic_cell(&RgbImage::from_pixel(320, 240, Rgb([from + i, 0, 0])))).collect()
    }

    fn red(picture: &RgbImage, column: u32, row: u32) -> u8 {
        picture.get_pixel(56 * column + 20, 56 * row + 30)[0]
    }

    #[test]
    fn the_left_finger_is_above_and_time_runs_to_the_right() {
        let (left, right) = (cells(10, 8), cells(50, 8));
        let picture = mosaic([&left, &right], MosaicLayout::Rows);
        assert_eq!(picture.dimensions(), (224, 224));
        assert_eq!([red(&picture, 0, 0), red(&picture, 3, 0), red(&picture, 0, 1)], [10, 13, 14]);
        assert_eq!([red(&picture, 0, 2), red(&picture, 3, 3)], [50, 57]);
        let picture = mosaic([&left, &right], MosaicLayout::Columns);
        assert_eq!([red(&picture, 1, 0), red(&picture, 0, 1), red(&picture, 2, 0)], [11, 12, 50]);
    }

    #[test]
    fn a_short_history_starts_with_its_oldest_frame_and_a_long_one_keeps_its_last() {
        let (short, long) = (cells(10, 3), cells(50, 20));
        let picture = mosaic([&short, &long], MosaicLayout::Rows);
        let upper: Vec<u8> = (0..8).map(|i| red(&picture, i % 4, i / 4)).collect();
        assert_eq!(upper, [10, 10, 10, 10, 10, 10, 11, 12]);
        assert_eq!([red(&picture, 0, 2), red(&picture, 3, 3)], [62, 69]);
    }
}
