//! What is kept of rollouts for people and for training: videos.

pub mod video;
