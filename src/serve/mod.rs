//! Episodes for somebody else to drive over a network: reset, step, render, get and set the state. `docs/serve.md` is the
//! protocol.

mod answer;
mod door;
mod fields;
mod link;
mod offer;
mod request;
mod running;
mod session;
mod space;
mod state;

pub use answer::hello;
pub use door::{Door, serve};
pub use offer::{Offer, Offered, Wanted, split_named};
