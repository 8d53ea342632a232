//! The mechanics: soft bodies, rigid bodies, joint trees, contact, and the one solve that moves them all.
//!
//! Knows no Lua, no files and no images.

pub mod contact;
pub mod fem;
pub mod joints;
pub mod rigid;
pub mod solver;
pub mod sparse;
