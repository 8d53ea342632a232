//! Contact: what surfaces are made of, where they meet, and what they remember.

mod collider;
mod detect;
pub mod manifold;
mod memory;
mod soft_field;
mod solid;

pub use collider::{Collider, ColliderId, Friction, Layer, Mover, Surface};
pub use detect::{Candidate, Moving, Whereabouts, detect};
pub use manifold::ContactPoint;
pub use memory::{Memory, Partner, Slot};
pub use soft_field::{Felt, Pressing, SoftField, detect_soft, may_touch};
pub use solid::{GelSample, Part, Solid};
