//! Judging: deformation, drop and slip, goal, safety, statistics. Small pure functions on plain numbers.
