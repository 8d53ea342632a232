//! Contact: what surfaces are made of, where they meet, and what they remember.

mod collider;
mod detect;
pub mod manifold;
mod memory;

pub use collider::{Collider, ColliderId, Friction, Layer, Mover, Surface};
pub use detect::{Candidate, Moving, detect};
pub use memory::{Memory, Slot};
