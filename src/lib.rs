//! softvt: a safety-aware visuo-tactile manipulation benchmark for soft objects, on an ordinary CPU.
//!
//! The rooms, from the ground up; each may use those before it and none after it:
//! [`geometry`] → [`physics`] → [`scene`], [`robot`] → [`sensing`], [`evaluation`] → [`benchmark`] → [`policy`] → [`rollout`]
//! → [`dataset`] → [`report`] → [`script`] → [`serve`] → [`cli`]. `docs/architecture.md` draws them and follows one episode through.
//!
//! Beside them stands [`message`]: how numbers and text look in what they say.
//!
//! Units are SI throughout; a name carries its unit where it is not SI or not obvious. Frames are suffixes:
//! `_w` world, `_b` robot base, `_h` hand, `_p` pad, `_o` object.
#![warn(missing_docs)]

pub mod benchmark;
pub mod cli;
pub mod dataset;
pub mod evaluation;
pub mod geometry;
pub mod message;
pub mod physics;
pub mod policy;
pub mod report;
pub mod robot;
pub mod rollout;
pub mod scene;
pub mod script;
pub mod sensing;
pub mod serve;
