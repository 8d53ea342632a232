//! Rasterisation: projected triangles are binned by screen tile, then drawn into buffers of samples.

pub(crate) mod binning;
pub(crate) mod sample_buffer;

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
