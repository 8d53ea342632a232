//! Visuals that are valid and cannot be seen.

use std::f64::consts::TAU;

use super::{
    Asset, Body, LabelLine, MovingPart,
    decal::TextDecal,
    visual::{Mask, Visual},
};
use softvt_common::text::{format_number, significant};
use softvt_geometry::{Aabb, Vec3, shape::Shape};

impl Asset {
    /// Warnings about visuals and layers that are nowhere on its surface, or that of its parts.
    pub(super) fn visual_warnings(&self) -> Vec<String> {
        let Body::Articulated(parts) = &self.body else { return self.warnings_with_parts(&[]) };
        // Parts without visuals of their own have those of the asset.
        let (same, other): (Vec<&MovingPart>, Vec<&MovingPart>) =
            parts.iter().partition(|part| part.asset.visuals == self.visuals);
        let mut warnings = self.warnings_with_parts(&same);
        for part in other {
            let of_part = part.asset.warnings_with_parts(&[]);
            warnings.extend(of_part.into_iter().map(|warning| format!("part {}: {warning}", part.name)));
        }
        warnings
    }

    /// Warnings about its visuals, which `parts` share.
    fn warnings_with_parts(&self, parts: &[&MovingPart]) -> Vec<String> {
        let shapes = || parts.iter().map(|part| &part.asset.shape).chain([&self.shape]);
        let materials = shapes().map(|shape| usize::from(shape.highest_material()) + 1).max().unwrap_or(1);
        let unpainted = (materials..self.visuals.len()).map(|index| {
            format!(
                "visuals[{}]: no part of its shape is painted with material {index}; paint it: \
                 shape:paint {{ material = {index}, … }}",
                index + 1
            )
        });
        let bounds = shapes().fold(self.shape.loose_bounds(), |all, own| all.merged(&own.loose_bounds()));
        let hidden = self.visuals.iter().enumerate().flat_map(|(index, visual)| {
            let found = hidden_layers(visual, &bounds, &shapes);
            found.into_iter().map(move |warning| format!("visuals[{}].{warning}", index + 1))
        });
        unpainted.chain(hidden).collect()
    }
}

/// Largest period of a pattern in sizes of the shape: a larger one is most likely given in another unit.
const MAX_PERIOD: f64 = 4.0;

fn hidden_layers<'a, S>(visual: &Visual, bounds: &Aabb, shapes: &impl Fn() -> S) -> Vec<String>
where
    S: Iterator<Item = &'a Shape>,
{
    let found = visual.layers.iter().enumerate().filter_map(|(index, layer)| {
        let number = index + 1;
        if layer.opacity == 0.0 && layer.relief_m == 0.0 {
            return Some(format!("layers[{number}]: its opacity is 0, so that it changes nothing"));
        }
        if let Some(wrong) = misplaced(&layer.mask, bounds) {
            return Some(format!("layers[{number}]: {wrong}; lengths are in metres"));
        }
        let line = texts(&layer.mask).into_iter().find(|line| shapes().all(|shape| is_cut(line, shape)))?;
        Some(format!(
            "layers[{number}]: its text {:?} is {} mm long and reaches beyond the surface, where it is cut; make its \
             height smaller or move it",
            line.text,
            significant(1e3 * line.length_m(), 3)
        ))
    });
    found.collect()
}

/// What is wrong with a mask that is the same on all of a shape within `bounds`, though it is made of a place.
fn misplaced(mask: &Mask, bounds: &Aabb) -> Option<String> {
    match mask {
        Mask::Inverse { mask } => misplaced(mask, bounds),
        Mask::Product { masks } => masks.iter().find_map(|mask| misplaced(mask, bounds)),
        Mask::Gradient { axis, from_m, to_m } => {
            let [low, high] = extent(bounds, &Vec3::from(*axis).normalize());
            (from_m.max(*to_m) < low || from_m.min(*to_m) > high).then(|| {
                format!(
                    "its gradient, from {} to {} m, lies outside of the shape, which reaches from {} to {} m along its axis",
                    format_number(*from_m),
                    format_number(*to_m),
                    format_number(low),
                    format_number(high)
                )
            })
        }
        Mask::Inside { shape, soft_m } => {
            let is_apart = !shape.loose_bounds().loosened(*soft_m).intersects(bounds);
            is_apart.then(|| "the shape of its mask lies outside of the shape".to_owned())
        }
        Mask::Text { decal } => (!meets(decal, bounds)).then(|| {
            let [x, y, z] = decal.line.at.map(format_number);
            format!("its text, at ({x}, {y}, {z}) m, is printed beside the shape")
        }),
        Mask::Checker { size_m: period }
        | Mask::Stripes { pitch_m: period, .. }
        | Mask::Specks { spacing_m: period, .. } => {
            let size = bounds.size().max();
            (*period > MAX_PERIOD * size).then(|| {
                format!(
                    "its pattern repeats every {} m, and the shape is {} m long",
                    format_number(*period),
                    significant(size, 3)
                )
            })
        }
        _ => None,
    }
}

/// The lines of text of a mask that are printed as they are.
fn texts(mask: &Mask) -> Vec<&LabelLine> {
    match mask {
        Mask::Text { decal } => vec![&decal.line],
        Mask::Product { masks } => masks.iter().flat_map(|mask| texts(mask)).collect(),
        _ => Vec::new(),
    }
}

/// True if an end of a line of text is beside a shape as its reader sees it, or a wrapped line is longer than its
/// circle.
fn is_cut(line: &LabelLine, shape: &Shape) -> bool {
    let length = line.length_m();
    if let Some(radius) = line.wrap_m {
        return length > TAU * radius;
    }
    let facing = Vec3::from(line.facing).normalize();
    let up = line.up(&facing);
    let (sin, cos) = line.turn.sin_cos();
    let along = cos * up.cross(&facing) + sin * up;
    // The depth to which the renderer prints a line.
    let depth = 0.5 * length + line.height_m;
    let is_beside = |side: f64| {
        let end = Vec3::from(line.at) + 0.5 * side * length * along;
        shape.ray(&(end + depth * facing), &-facing, 2.0 * depth).is_none()
    };
    is_beside(-1.0) || is_beside(1.0)
}

/// Lowest and highest coordinate of a box along an axis.
fn extent(bounds: &Aabb, axis: &Vec3) -> [f64; 2] {
    let (centre, reach) = (bounds.centre().dot(axis), 0.5 * bounds.size().dot(&axis.abs()));
    [centre - reach, centre + reach]
}

/// True if a line of text may be on the surface of a shape within `bounds`.
fn meets(decal: &TextDecal, bounds: &Aabb) -> bool {
    let line = &decal.line;
    let (at, facing) = (Vec3::from(line.at), Vec3::from(line.facing).normalize());
    // Letters are hardly wider than high.
    let reach = line.height_m * (1.0 + 0.5 * line.text.chars().count() as f64);
    let offset = at - bounds.centre();
    if line.wrap_m.is_some() {
        return offset.z.abs() <= 0.5 * bounds.size().z + reach;
    }
    // As seen by the reader; the circle about the box is larger than its outline.
    (offset - offset.dot(&facing) * facing).norm() <= 0.5 * bounds.size().norm() + reach
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Typeface, VisualLayer};
    use softvt_physics::contact::Friction;
    use std::sync::Arc;

    fn warnings(mask: Mask) -> Vec<String> {
        let layer = VisualLayer { mask, albedo: [1.0; 3], roughness: 0.5, opacity: 1.0, relief_m: 0.0 };
        let asset = Asset {
            name: "bun".into(),
            shape: Shape::Box { half: Vec3::new(0.02, 0.03, 0.04) },
            body: Body::Static,
            friction: Friction::default(),
            visuals: vec![Visual::default().with(layer)],
            hints: Default::default(),
        };
        asset.visual_warnings()
    }

    fn text(at: [f64; 3], wrap_m: Option<f64>) -> Mask {
        printed("milk", at, wrap_m)
    }

    fn printed(text: &str, at: [f64; 3], wrap_m: Option<f64>) -> Mask {
        let line = LabelLine {
            text: text.into(),
            typeface: Typeface::Sans,
            height_m: 0.01,
            weight: 0.1,
            at,
            facing: [0.0, -1.0, 0.0],
            turn: 0.0,
            wrap_m,
        };
        Mask::Text { decal: Arc::new(TextDecal::new(line)) }
    }

    #[test]
    fn layers_beside_the_shape_are_doubted() {
        let gradient = |from_m, to_m| Mask::Gradient { axis: [0.0, 0.0, 2.0], from_m, to_m };
        assert_eq!(warnings(gradient(0.03, -0.01)), [""; 0]);
        assert_eq!(
            warnings(Mask::Product { masks: vec![Arc::new(Mask::Whole), Arc::new(gradient(5.0, 30.0))] }),
            [
                "visuals[1].layers[1]: its gradient, from 5 to 30 m, lies outside of the shape, which reaches from -0.04 to 0.04 m \
              along its axis; lengths are in metres"
            ]
        );
        assert_eq!(warnings(text([0.0, -0.03, 0.03], None)), [""; 0], "printed along its direction");
        assert_eq!(warnings(text([0.0, 0.0, 3.0], None)).len(), 1);
        assert_eq!(warnings(text([0.5, 0.0, 0.0], Some(0.02))), [""; 0], "wrapped around the axis");
        assert_eq!(warnings(text([0.0, 0.0, 0.3], Some(0.02))).len(), 1);
        assert_eq!(warnings(Mask::Checker { size_m: 0.01 }), [""; 0]);
        assert_eq!(
            warnings(Mask::Checker { size_m: 10.0 }),
            [
                "visuals[1].layers[1]: its pattern repeats every 10 m, and the shape is 0.08 m long; lengths are in metres"
            ]
        );
        let ball = Arc::new(Shape::Sphere { radius: 0.01 }.translated(Vec3::new(0.0, 0.0, 0.4)));
        assert_eq!(warnings(Mask::Inside { shape: ball, soft_m: 0.0 }).len(), 1);
    }

    #[test]
    fn a_text_that_is_longer_than_its_face_is_doubted() {
        let flat = |text: &str, x| warnings(printed(text, [x, -0.03, 0.0], None));
        assert_eq!(flat("milk", 0.0), [""; 0], "shorter than 40 mm");
        assert_eq!(flat("milk", 0.019).len(), 1);
        let cut = flat("whole milk", 0.0);
        assert!(
            cut[0].starts_with("visuals[1].layers[1]: its text \"whole milk\" is ") && cut.len() == 1,
            "{cut:?}"
        );
        assert!(cut[0].contains(" mm long and reaches beyond the surface, where it is cut; "), "{cut:?}");
        assert_eq!(warnings(printed("whole milk", [0.0; 3], Some(0.02))), [""; 0], "125 mm around");
        assert_eq!(warnings(printed("whole milk", [0.0; 3], Some(0.005))).len(), 1, "31 mm around");
    }

    #[test]
    fn a_visual_without_a_painted_surface_is_doubted() {
        let asset = Asset {
            name: "bun".into(),
            shape: Shape::Sphere { radius: 0.02 },
            body: Body::Static,
            friction: Friction::default(),
            visuals: vec![Visual::default(); 2],
            hints: Default::default(),
        };
        let found = asset.visual_warnings();
        assert!(
            found.len() == 1 && found[0].starts_with("visuals[2]: no part of its shape is painted"),
            "{found:?}"
        );
    }
}
