//! Joint trees: links joined by revolute and prismatic joints, on a fixed base.
