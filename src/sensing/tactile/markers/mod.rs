//! Printed markers of the gel: their positions in the image, and measures of their motion.

mod marker_flow;
mod marker_grid;
#[cfg(test)]
mod tests;

pub use marker_flow::MarkerFlow;
pub use marker_grid::{MARKER_COUNT, MarkerPositions, MarkerStyle, Markers};
