//! Contact points between rigid bodies.
