//! softvt: a safety-aware visuo-tactile manipulation benchmark for soft objects that runs on an ordinary CPU.
//!
//! The modules form layers. Each may import those before it and none after it: [`geometry`] → [`physics`] →
//! [`scene`], [`robot`] → [`sensing`], [`evaluation`] → [`benchmark`] → [`policy`] → [`rollout`] → [`dataset`] →
//! [`report`] → [`script`] → [`serve`] → [`cli`]. `docs/architecture.md` draws them and follows one episode. All of
//! them may use [`text`] (numbers and text in messages), [`files`] (atomic files), [`npy`] (numpy files) and
//! [`parallel`] (jobs on threads).
//!
//! Examples: a dropped cube and a squeezed cube in [`physics::world`], distances in [`geometry::shape`], kinematics
//! in [`robot`], a rendered image in [`sensing::camera`], a tactile image in [`sensing::tactile`], the verdict on
//! an episode in [`evaluation::judge`].
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
