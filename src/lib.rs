//! softvt: a safety-aware visuo-tactile manipulation benchmark for soft objects that runs on an ordinary CPU.
//!
//! The modules form layers. Each may import those before it and none after it:
//! [`geometry`] → [`physics`] → [`scene`], [`robot`] → [`sensing`], [`evaluation`] → [`benchmark`] → [`policy`] → [`rollout`]
//! → [`dataset`] → [`report`] → [`script`] → [`serve`] → [`cli`]. `docs/architecture.md` draws them and follows one episode.
//! All of them may use [`text`], which formats numbers and text for messages, [`files`], which writes files
//! atomically, and [`parallel`], which runs jobs on threads.
//!
//! Units are SI throughout; a name carries its unit where it is not SI or not obvious. Frames are suffixes:
//! `_w` world, `_b` robot base, `_h` hand, `_p` pad, `_o` object.
#![warn(unreachable_pub)]

#[warn(missing_docs)]
pub mod benchmark;
pub mod cli;
pub mod dataset;
#[warn(missing_docs)]
pub mod evaluation;
#[warn(missing_docs)]
pub mod files;
#[warn(missing_docs)]
pub mod geometry;
#[warn(missing_docs)]
pub mod npy;
#[warn(missing_docs)]
pub mod parallel;
#[warn(missing_docs)]
pub mod physics;
#[warn(missing_docs)]
pub mod policy;
pub mod report;
#[warn(missing_docs)]
pub mod robot;
#[warn(missing_docs)]
pub mod rollout;
#[warn(missing_docs)]
pub mod scene;
pub mod script;
#[warn(missing_docs)]
pub mod sensing;
pub mod serve;
#[warn(missing_docs)]
pub mod text;
