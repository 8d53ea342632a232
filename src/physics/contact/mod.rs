//! Contact: where bodies touch and how hard they rub.

pub mod manifold;
