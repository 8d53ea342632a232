//! Validation of the numbers of a shape.

use super::{
    displacement::{Bumps, Displacement, Ramp, Ridges},
    error::ShapeError,
    tree::Shape,
};
use crate::geometry::Vec3;

impl Shape {
    /// Validates all numbers of the tree.
    ///
    /// # Errors
    /// The first invalid number, with its value and a hint.
    pub fn validate(&self) -> Result<(), ShapeError> {
        match self {
            Self::Box { half } => sizes("box", "half extent", half),
            Self::Sphere { radius } => size("sphere", "radius", *radius),
            Self::Ellipsoid { radii } => sizes("ellipsoid", "semi-axis", radii),
            Self::Capsule { radius, half_length } => {
                size("capsule", "radius", *radius)?;
                at_least_zero("capsule", "half length of the straight part", *half_length)
            }
            Self::Cylinder { radius, half_height } => {
                size("cylinder", "radius", *radius)?;
                size("cylinder", "half height", *half_height)
            }
            Self::Torus { major, minor } => {
                size("torus", "minor radius", *minor)?;
                let hint = "give a major radius larger than the minor one";
                ensure(major.is_finite() && major > minor, "torus", "major radius", *major, hint)
            }
            Self::Prism { half_length, .. } => size("prism", "half length", *half_length),
            Self::Lathe(_) | Self::Mesh(_) => Ok(()),
            _ => self.validate_composite(),
        }
    }

    /// [`Shape::validate`] for shapes with parts.
    fn validate_composite(&self) -> Result<(), ShapeError> {
        match self {
            Self::Placed { shape, pose } => {
                let offset = pose.translation.vector;
                finite("move", "offset", offset.sum() + pose.rotation.coords.sum())?;
                shape.validate()
            }
            Self::Scaled { shape, scale } => {
                let hint = "give a finite factor above 0";
                let worst = scale.min();
                ensure(worst > 0.0 && scale.sum().is_finite(), "scale", "factor", worst, hint)?;
                shape.validate()
            }
            Self::Rounded { shape, radius } => {
                at_least_zero("round", "radius", *radius)?;
                shape.validate()
            }
            Self::Shell { shape, thickness } => {
                size("shell", "thickness", *thickness)?;
                shape.validate()
            }
            Self::Union(parts) => all("union", parts),
            Self::Intersect(parts) => all("intersection", parts),
            Self::Subtract { from, cut } => from.validate().and_then(|()| cut.validate()),
            Self::SmoothUnion { parts, blend } => {
                size("smooth union", "blend", *blend)?;
                all("smooth union", parts)
            }
            Self::SmoothSubtract { from, cut, blend } => {
                size("smooth subtraction", "blend", *blend)?;
                from.validate().and_then(|()| cut.validate())
            }
            Self::Twist { shape, rate, .. } => {
                finite("twist", "rate", *rate)?;
                shape.validate()
            }
            Self::Bend { shape, along, towards, curvature } => {
                finite("bend", "curvature", *curvature)?;
                let axis = towards.index() as f64;
                ensure(
                    along != towards,
                    "bend",
                    "towards axis",
                    axis,
                    "bend towards another axis than along",
                )?;
                shape.validate()
            }
            Self::Displace { shape, reliefs } => {
                reliefs.iter().try_for_each(Displacement::validate)?;
                shape.validate()
            }
            Self::Paint { shape, region, .. } => {
                region.as_ref().map_or(Ok(()), |region| region.validate())?;
                shape.validate()
            }
            _ => Ok(()),
        }
    }
}

impl Displacement {
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

fn all(kind: &'static str, parts: &[Shape]) -> Result<(), ShapeError> {
    if parts.is_empty() {
        return Err(ShapeError::Empty { kind });
    }
    parts.iter().try_for_each(Shape::validate)
}
