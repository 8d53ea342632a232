//! Rasterisation: projected triangles are sorted into screen tiles, set up eight at a time, then drawn into buffers of
//! samples, eight samples at a time.
//!
//! Edge functions follow Pineda (A Parallel Algorithm for Polygon Rasterization, 1988). The two triangles of an edge
//! evaluate it identically, so there are neither gaps nor double hits between them.

// Each module uses only those before it: setup, then heights and samples, bins.
mod bins;
mod heights;
mod samples;
mod setup;

pub(crate) use bins::TileBins;
pub(crate) use heights::HeightBuffer;
pub(crate) use samples::{SAMPLE_OFFSETS, SAMPLES_PER_PIXEL, TILE_EDGE, TileSamples};
pub(crate) use setup::TriangleBlock;

/// Corners of a projected triangle, each x, y (pixels from the top left of the image) and reciprocal depth.
pub(crate) type ScreenCorners = [[f32; 3]; 3];

// Sample buffers store one `u32` per sample: a flag for moving objects, the index of the object in the scene and the
// index of the triangle in the object's mesh.

/// Number of bits of a triangle id that hold the index of the triangle in its mesh.
pub(crate) const TRIANGLE_BITS: u32 = 21;
/// Bit set in the ids of triangles of moving objects.
pub(crate) const MOVING_FLAG: u32 = 1 << 31;
/// Id of samples that show no triangle. Its object index is out of range, and its moving flag is clear.
pub(crate) const NO_TRIANGLE: u32 = 0x7FFF_FFFF;

/// Returns the id of the first triangle of an object; the others follow consecutively.
pub(crate) fn first_triangle_id(object: usize, is_moving: bool) -> u32 {
    (object as u32) << TRIANGLE_BITS | if is_moving { MOVING_FLAG } else { 0 }
}

/// Index in the scene of the object that a triangle belongs to.
pub(crate) fn object_index(id: u32) -> usize {
    ((id & !MOVING_FLAG) >> TRIANGLE_BITS) as usize
}

/// Index of a triangle in its mesh.
pub(crate) fn triangle_index(id: u32) -> usize {
    (id & ((1 << TRIANGLE_BITS) - 1)) as usize
}

#[cfg(test)]
mod tests {
    use super::{
        setup::{TriangleBlock, TriangleSetup},
        *,
    };

    fn draw(samples: &mut TileSamples, corners: &ScreenCorners, id: u32) {
        let block = TriangleBlock::new([(corners, id)].into_iter(), &TileSamples::target([0.0; 2]));
        block.triangles().for_each(|t: TriangleSetup| samples.draw(&t));
    }

    /// Triangle ids of all samples: the colours', then the centres'.
    fn ids(samples: &TileSamples) -> Vec<u32> {
        let places = || (0..TILE_EDGE).flat_map(|y| (0..TILE_EDGE).step_by(8).map(move |x| (x, y)));
        let colours = places().flat_map(|(x, y)| samples.colour_ids(x, y));
        colours.chain(places().flat_map(|(x, y)| samples.centres(x, y).0)).collect()
    }

    #[test]
    fn triangles_that_share_an_edge_neither_overlap_nor_leave_a_gap() {
        // A fan around a point that covers the whole square; the coordinates make edges pass through samples too.
        for middle in [[13.0, 17.5], [7.3, 21.9], [16.375, 16.125]] {
            let rim = [[-3.0, -3.0], [16.0, -3.0], [40.0, -3.0], [40.0, 16.0], [40.0, 40.0], [-3.0, 40.0]];
            let mut hits = vec![0; (SAMPLES_PER_PIXEL + 1) * TILE_EDGE * TILE_EDGE];
            for i in 0..rim.len() {
                let mut samples = TileSamples::new(0.0, true, true);
                let [a, b] = [rim[i], rim[(i + 1) % rim.len()]].map(|[x, y]| [x, y, 1.0]);
                draw(&mut samples, &[[middle[0], middle[1], 1.0], a, b], 7);
                hits.iter_mut().zip(ids(&samples)).for_each(|(hits, id)| *hits += i32::from(id == 7));
            }
            assert!(hits.iter().all(|h| *h == 1), "{middle:?}: {hits:?}");
        }
    }

    #[test]
    fn the_number_of_covered_samples_matches_the_area() {
        let mut samples = TileSamples::new(0.0, true, true);
        draw(&mut samples, &[[2.2, 3.1, 1.0], [29.7, 8.4, 1.0], [11.5, 30.3, 1.0]], 1);
        let area = 0.5 * (27.5 * 27.2 - 9.3 * 5.3);
        let count = ids(&samples).iter().filter(|id| **id == 1).count() as f32;
        let count = count / (SAMPLES_PER_PIXEL + 1) as f32;
        assert!((count - area).abs() < 2.0, "{count} pixels, {area} expected");
    }
}
