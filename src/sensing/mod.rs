//! Sensor models: pure functions of a scene and a [`WorldSnapshot`](crate::physics::world::WorldSnapshot), evaluated on
//! demand.
//!
//! [`camera`] renders colour, depth and segmentation images, [`tactile`] simulates the GelSight Mini of each finger,
//! and [`panda`] holds the meshes of the robot that the cameras see.

pub mod camera;
pub mod panda;
pub mod tactile;
