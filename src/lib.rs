//! softvt: a safety-aware visuo-tactile manipulation benchmark for soft objects that runs on an ordinary CPU.
//!
//! Each module is a crate, `softvt-geometry` to `softvt-cli`; this crate re-exports them. They form layers, and each
//! uses only those before it: [`geometry`] → [`physics`] → [`scene`], [`robot`] → [`sensing`], [`evaluation`] →
//! [`runs`], [`benchmark`] → [`policy`] → [`rollout`] → [`dataset`] → [`report`], [`script`], [`serve`] → [`runner`]
//! → [`cli`]. `docs/architecture.md` draws them and follows one episode. All of them may use [`text`] (numbers and text
//! in messages), [`files`] (atomic files), [`npy`] (numpy files), [`parallel`] (jobs on threads), [`cancel`] (requests
//! to stop), [`episode_id`], [`range`] (ranges of numbers) and [`settings`](mod@settings) (the declaration of
//! settings). [`sensing`] also uses [`signal`] (Fourier transforms, resizing of images).
//!
//! Examples: a dropped cube and a squeezed cube in [`physics::world`], distances in [`geometry::shape`], kinematics
//! in [`robot`], a rendered image in [`sensing::camera`], a tactile image in [`sensing::tactile`], the verdict on
//! an episode in [`evaluation::judge`], a run of a suite in [`runner`]. `docs/library.md` has them together.
//!
//! All features are on by default; `docs/library.md` has a table of them. Without any, [`rollout`] is the topmost
//! layer.
//!
//! Units are SI throughout; a name carries its unit where it is not SI or not obvious. Frames are suffixes:
//! `_w` world, `_b` robot base, `_h` hand, `_p` pad, `_o` object.
// The modules of switched-off features are named above all the same.
#![cfg_attr(not(feature = "cli"), allow(rustdoc::broken_intra_doc_links))]

#[doc(inline)]
pub use softvt_benchmark as benchmark;
#[cfg(feature = "cli")]
#[doc(inline)]
pub use softvt_cli as cli;
#[doc(inline)]
pub use softvt_common::{cancel, disk_cache, episode_id, files, npy, parallel, range, settings, text};
#[cfg(feature = "record")]
#[doc(inline)]
pub use softvt_dataset as dataset;
#[doc(inline)]
pub use softvt_evaluation as evaluation;
#[doc(inline)]
pub use softvt_geometry as geometry;
#[cfg(feature = "video")]
#[doc(inline)]
pub use softvt_media as media;
#[doc(inline)]
pub use softvt_physics as physics;
#[doc(inline)]
pub use softvt_policy as policy;
#[cfg(feature = "video")]
#[doc(inline)]
pub use softvt_report as report;
#[doc(inline)]
pub use softvt_robot as robot;
#[doc(inline)]
pub use softvt_rollout as rollout;
#[cfg(feature = "runner")]
#[doc(inline)]
pub use softvt_runner as runner;
#[doc(inline)]
pub use softvt_runs as runs;
#[doc(inline)]
pub use softvt_scene as scene;
#[cfg(feature = "lua")]
#[doc(inline)]
pub use softvt_script as script;
#[doc(inline)]
pub use softvt_sensing as sensing;
#[cfg(feature = "serve")]
#[doc(inline)]
pub use softvt_serve as serve;
#[doc(inline)]
pub use softvt_signal as signal;
#[cfg(feature = "watch")]
#[doc(inline)]
pub use softvt_watch as watch;

/// The examples of the page.
#[cfg(all(doctest, feature = "runner"))]
#[doc = include_str!("../docs/library.md")]
struct LibraryPage;
