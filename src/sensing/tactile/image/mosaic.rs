//! Tactile history of both fingers as one image, the input of SoftVTBench's policies.

use std::borrow::Borrow;

use image::{RgbImage, imageops};
use serde::{Deserialize, Serialize};

use crate::camera::resize;

/// Images of history per finger.
pub const HISTORY_LENGTH: usize = 8;
/// Cells along an edge of the mosaic.
const CELLS_PER_EDGE: usize = 4;
/// Edge of a cell, px.
const CELL_SIZE: u32 = 56;

/// Arrangement of the cells; each finger's images run from left to right and top to bottom, oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TactileMosaicLayout {
    /// Left finger in the upper two rows, right finger in the lower two (the soft suites).
    #[default]
    Rows,
    /// Left finger in the left two columns, right finger in the right two (the rigid suites).
    Columns,
}

/// Scales an image of a finger to a cell of the mosaic, 56 × 56.
pub fn mosaic_cell(image: &RgbImage) -> RgbImage {
    resize(image, CELL_SIZE, CELL_SIZE)
}

/// Mosaic of 4 × 4 cells ([`mosaic_cell`]), 224 × 224: the last 8 of the left and of the right finger.
///
/// `history` holds the cells of the left and the right finger, oldest first. A shorter history is extended at its
/// start with its oldest cell; an empty one leaves its cells black.
pub fn mosaic<T: Borrow<RgbImage>>(history: [&[T]; 2], layout: TactileMosaicLayout) -> RgbImage {
    let mut image = RgbImage::new(CELLS_PER_EDGE as u32 * CELL_SIZE, CELLS_PER_EDGE as u32 * CELL_SIZE);
    for (finger, cells) in history.into_iter().enumerate() {
        for place in 0..HISTORY_LENGTH {
            let Some(cell) = cells.get((place + cells.len()).saturating_sub(HISTORY_LENGTH)) else {
                continue;
            };
            let (column, row) = match layout {
                TactileMosaicLayout::Rows => (place % CELLS_PER_EDGE, 2 * finger + place / CELLS_PER_EDGE),
                TactileMosaicLayout::Columns => (2 * finger + place % 2, place / 2),
            };
            let corner = [column, row].map(|at| i64::from(CELL_SIZE) * at as i64);
            imageops::replace(&mut image, cell.borrow(), corner[0], corner[1]);
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    fn cells(from: u8, count: u8) -> Vec<RgbImage> {
        (0..count).map(|i| mosaic_cell(&RgbImage::from_pixel(320, 240, Rgb([from + i, 0, 0])))).collect()
    }

    fn red(image: &RgbImage, column: u32, row: u32) -> u8 {
        image.get_pixel(56 * column + 20, 56 * row + 30)[0]
    }

    #[test]
    fn the_left_finger_is_above_and_time_runs_to_the_right() {
        let (left, right) = (cells(10, 8), cells(50, 8));
        let image = mosaic([&left, &right], TactileMosaicLayout::Rows);
        assert_eq!(image.dimensions(), (224, 224));
        assert_eq!([red(&image, 0, 0), red(&image, 3, 0), red(&image, 0, 1)], [10, 13, 14]);
        assert_eq!([red(&image, 0, 2), red(&image, 3, 3)], [50, 57]);
        let image = mosaic([&left, &right], TactileMosaicLayout::Columns);
        assert_eq!([red(&image, 1, 0), red(&image, 0, 1), red(&image, 2, 0)], [11, 12, 50]);
    }

    #[test]
    fn a_short_history_starts_with_its_oldest_frame_and_a_long_one_keeps_its_last() {
        let (short, long) = (cells(10, 3), cells(50, 20));
        let image = mosaic([&short, &long], TactileMosaicLayout::Rows);
        let upper: Vec<u8> = (0..8).map(|i| red(&image, i % 4, i / 4)).collect();
        assert_eq!(upper, [10, 10, 10, 10, 10, 10, 11, 12]);
        assert_eq!([red(&image, 0, 2), red(&image, 3, 3)], [62, 69]);
    }
}
