//! Errors of shape construction and validation.

/// Invalid number or profile of a shape.
#[allow(missing_docs, reason = "the messages describe the variants")]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    #[error("{kind}: {field} is {value} m; give a finite length above 0")]
    Size { kind: &'static str, field: &'static str, value: f64 },
    #[error("{kind}: {field} is {value}; {hint}")]
    Number { kind: &'static str, field: &'static str, value: f64, hint: &'static str },
    #[error("{kind}: has no parts; give at least one")]
    Empty { kind: &'static str },
    #[error("profile: has {corners} corners; give at least 3")]
    ProfileSize { corners: usize },
    #[error("profile: corner {index} is ({r}, {z}); give finite numbers, and r ≥ 0 for a lathe")]
    ProfilePoint { index: usize, r: f64, z: f64 },
    #[error(
        "profile: corner ({r}, {z}) is given twice in a row; leave one out (the last joins the first by itself)"
    )]
    ProfileRepeat { r: f64, z: f64 },
    #[error("profile: encloses no area; go around the cross-section, not along a line")]
    ProfileArea,
    #[error("profile: its edges cross each other; list the corners in order around the cross-section")]
    ProfileCrossing,
}
