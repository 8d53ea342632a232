//! Validation of the mechanics against closed forms and the independent static reference of `tests/reference`.
//!
//! Every module holds experiments and the tests that assert their results; `examples/validation/` prints the same
//! experiments as tables.

mod beam;
#[path = "../bodies/mod.rs"]
mod bodies;
mod camera;
mod drives;
mod element;
mod extremes;
mod free;
mod friction;
mod gel;
mod jointed;
mod light;
mod pad;
mod rigid;
mod rows;
#[path = "../physics_contact/solids.rs"]
mod solids;
mod statics;
mod support;
mod time_step;
mod truth;
mod verdicts;
