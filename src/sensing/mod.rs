//! What the robot senses: pure functions of a state and a scene; made only when someone looks.

pub mod camera;
pub mod panda;
pub mod scaling;
pub mod tactile;
