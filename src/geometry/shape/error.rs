//! Errors of shape construction and validation.

/// Why a shape cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A size is not positive and finite.
    #[error("{kind}: {field} is {value} m; give a finite length above 0")]
    Size {
        /// The kind of shape.
        kind: &'static str,
        /// The size.
        field: &'static str,
        /// Its value, m.
        value: f64,
    },
    /// A number is outside of its range.
    #[error("{kind}: {field} is {value}; {mend}")]
    Number {
        /// The kind of shape.
        kind: &'static str,
        /// The number.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What would do.
        mend: &'static str,
    },
    /// A combination has no parts.
    #[error("{kind}: has no parts; give at least one")]
    Empty {
        /// The kind of shape.
        kind: &'static str,
    },
    /// Too few corners.
    #[error("profile: has {corners} corners; give at least 3")]
    ProfileSize {
        /// How many.
        corners: usize,
    },
    /// A corner is not finite or lies on the wrong side of the axis.
    #[error("profile: corner {index} is ({r}, {z}); give finite numbers, and r ≥ 0 for a lathe")]
    ProfilePoint {
        /// Index of the corner, from 0.
        index: usize,
        /// First coordinate, m.
        r: f64,
        /// Second coordinate, m.
        z: f64,
    },
    /// Two neighbouring corners coincide.
    #[error(
        "profile: corner ({r}, {z}) is given twice in a row; leave one out (the last joins the first by itself)"
    )]
    ProfileRepeat {
        /// First coordinate, m.
        r: f64,
        /// Second coordinate, m.
        z: f64,
    },
    /// Nothing is enclosed.
    #[error("profile: encloses no area; go around the cross-section, not along a line")]
    ProfileArea,
    /// Edges cross.
    #[error("profile: its edges cross each other; list the corners in order around the cross-section")]
    ProfileCrossing,
}
