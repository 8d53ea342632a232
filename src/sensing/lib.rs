//! Sensor models: pure functions of a scene and a [`WorldSnapshot`](softvt_physics::world::WorldSnapshot), evaluated on
//! demand.
//!
//! [`camera`] renders colour, depth and segmentation images, [`tactile`] simulates the GelSight Mini of each finger,
//! and [`panda`] holds the meshes of the robot that the cameras see.
#![warn(missing_docs, unreachable_pub)]

pub mod camera;
pub mod panda;
pub mod tactile;
