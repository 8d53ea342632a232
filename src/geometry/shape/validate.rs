//! Validation of the numbers of a shape, and its errors.

use super::{
    displacement::{Bumps, Ramp, Ridges, SurfaceRelief},
    tree::Shape,
};
use crate::Vec3;

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

impl Shape {
    /// Validates all numbers of the tree.
    ///
    /// # Errors
    /// The first invalid number, with its value and a hint.
    pub fn validate(&self) -> Result<(), ShapeError> {
        match self {
            Self::Box { half } => sizes("box", "half extent", half)?,
            Self::Sphere { radius } => size("sphere", "radius", *radius)?,
            Self::Ellipsoid { radii } => sizes("ellipsoid", "semi-axis", radii)?,
            Self::Capsule { radius, half_length } => {
                size("capsule", "radius", *radius)?;
                at_least_zero("capsule", "half length of the straight part", *half_length)?;
            }
            Self::Cylinder { radius, half_height } => {
                size("cylinder", "radius", *radius)?;
                size("cylinder", "half height", *half_height)?;
            }
            Self::Torus { major, minor } => {
                size("torus", "minor radius", *minor)?;
                let hint = "give a major radius larger than the minor one";
                ensure(major.is_finite() && major > minor, "torus", "major radius", *major, hint)?;
            }
            Self::Prism { half_length, .. } => size("prism", "half length", *half_length)?,
            Self::Placed { pose, .. } => {
                finite("move", "offset", pose.translation.vector.sum() + pose.rotation.coords.sum())?;
            }
            Self::Scaled { scale, .. } => {
                let hint = "give a finite factor above 0";
                let worst = scale.min();
                ensure(worst > 0.0 && scale.sum().is_finite(), "scale", "factor", worst, hint)?;
            }
            Self::Rounded { radius, .. } => at_least_zero("round", "radius", *radius)?,
            Self::Shell { thickness, .. } => size("shell", "thickness", *thickness)?,
            Self::Union(parts) => not_empty("union", parts)?,
            Self::Intersect(parts) => not_empty("intersection", parts)?,
            Self::SmoothUnion { parts, blend } => {
                size("smooth union", "blend", *blend)?;
                not_empty("smooth union", parts)?;
            }
            Self::SmoothSubtract { blend, .. } => size("smooth subtraction", "blend", *blend)?,
            Self::Twist { rate, .. } => finite("twist", "rate", *rate)?,
            Self::Bend { along, towards, curvature, .. } => {
                finite("bend", "curvature", *curvature)?;
                let (axis, hint) = (towards.index() as f64, "bend towards another axis than along");
                ensure(along != towards, "bend", "towards axis", axis, hint)?;
            }
            Self::Displace { reliefs, .. } => reliefs.iter().try_for_each(SurfaceRelief::validate)?,
            Self::Subtract { .. } | Self::Paint { .. } | Self::Lathe(_) | Self::Mesh(_) => {}
        }
        self.children().into_iter().try_for_each(Self::validate)
    }
}

impl SurfaceRelief {
    fn validate(&self) -> Result<(), ShapeError> {
        match self {
            Self::Ridges(Ridges { height, pitch, radial_pitch, phase, sharpness, mask, .. }) => {
                finite("ridges", "height", *height)?;
                finite("ridges", "phase", *phase)?;
                let hint = "give a distance other than 0 (infinite for none)";
                for (field, value) in [("pitch", *pitch), ("radial pitch", *radial_pitch)] {
                    ensure(value.abs() > 0.0, "ridges", field, value, hint)?;
                }
                ensure((1.0..=8.0).contains(sharpness), "ridges", "sharpness", *sharpness, "give 1 to 8")?;
                mask.as_ref().map_or(Ok(()), Ramp::validate)
            }
            Self::Bumps(Bumps { height, radius, spacing, mask, .. }) => {
                finite("bumps", "height", *height)?;
                size("bumps", "spacing", *spacing)?;
                let hint = "give a radius above 0, at most half of the spacing";
                ensure(*radius > 0.0 && *radius <= 0.5 * spacing, "bumps", "radius", *radius, hint)?;
                mask.as_ref().map_or(Ok(()), Ramp::validate)
            }
        }
    }
}

impl Ramp {
    fn validate(&self) -> Result<(), ShapeError> {
        let span = self.to - self.from;
        ensure(span.is_finite() && span != 0.0, "mask", "to − from", span, "give two different finite places")
    }
}

fn ensure(
    good: bool,
    kind: &'static str,
    field: &'static str,
    value: f64,
    hint: &'static str,
) -> Result<(), ShapeError> {
    if good { Ok(()) } else { Err(ShapeError::Number { kind, field, value, hint }) }
}

fn size(kind: &'static str, field: &'static str, value: f64) -> Result<(), ShapeError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(ShapeError::Size { kind, field, value }) }
}

fn sizes(kind: &'static str, field: &'static str, values: &Vec3) -> Result<(), ShapeError> {
    values.iter().try_for_each(|value| size(kind, field, *value))
}

fn at_least_zero(kind: &'static str, field: &'static str, value: f64) -> Result<(), ShapeError> {
    ensure(value.is_finite() && value >= 0.0, kind, field, value, "give a finite length, 0 or more")
}

fn finite(kind: &'static str, field: &'static str, value: f64) -> Result<(), ShapeError> {
    ensure(value.is_finite(), kind, field, value, "give a finite number")
}

fn not_empty(kind: &'static str, parts: &[Shape]) -> Result<(), ShapeError> {
    if parts.is_empty() { Err(ShapeError::Empty { kind }) } else { Ok(()) }
}
