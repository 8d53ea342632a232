//! Visuals that do not show on their shape.

use std::f64::consts::TAU;

use super::mm;
use softvt_common::text::format_number;
use softvt_geometry::{Aabb, Vec3, shape::Shape};
use softvt_scene::{Asset, LabelLine, Mask, MovingPart, Visual};

/// Warnings about visuals and layers that are nowhere on the surface of an asset or its parts.
pub(super) fn visual_warnings(asset: &Asset) -> Vec<String> {
    // Parts without visuals of their own have those of the asset.
    let (same, other): (Vec<&MovingPart>, Vec<&MovingPart>) =
        asset.parts().iter().partition(|part| part.asset.visuals == asset.visuals);
    let shapes: Vec<&Shape> = same.iter().map(|part| &part.asset.shape).chain([&asset.shape]).collect();
    let mut warnings = hidden_visuals(&shapes, &asset.visuals);
    for part in other {
        let of_part = hidden_visuals(&[&part.asset.shape], &part.asset.visuals);
        warnings.extend(of_part.into_iter().map(|warning| format!("part {}: {warning}", part.name)));
    }
    warnings
}

/// Describes the visuals that show nowhere on `shapes`.
fn hidden_visuals(shapes: &[&Shape], visuals: &[Visual]) -> Vec<String> {
    let painted = shapes.iter().map(|shape| usize::from(shape.highest_material()) + 1).max().unwrap_or(1);
    let bounds = shapes.iter().map(|shape| shape.loose_bounds()).reduce(|all, own| all.merged(&own));
    let mut found = Vec::new();
    for (index, visual) in visuals.iter().enumerate() {
        let label = format!("visuals[{}]", index + 1);
        if index >= painted {
            found.push(format!(
                "{label}: no part of the shape is painted with material {index}; use shape:paint"
            ));
        }
        for (number, layer) in (1..).zip(&visual.layers) {
            let wrong = bounds.and_then(|bounds| misplaced(&layer.mask, &bounds));
            let wrong = wrong.or_else(|| cut_text(&layer.mask, shapes));
            found.extend(wrong.map(|wrong| format!("{label}.layers[{number}]: {wrong}")));
        }
    }
    found
}

/// Describes a mask of a place that is the same on all of a shape within `bounds`.
fn misplaced(mask: &Mask, bounds: &Aabb) -> Option<String> {
    let is_beside = match mask {
        Mask::Inverse { mask } => return misplaced(mask, bounds),
        Mask::Product { masks } => return masks.iter().find_map(|mask| misplaced(mask, bounds)),
        Mask::Gradient { axis, from_m, to_m } => {
            let axis = Vec3::from(*axis).normalize();
            let (centre, reach) = (bounds.centre().dot(&axis), 0.5 * bounds.size().dot(&axis.abs()));
            from_m.max(*to_m) < centre - reach || from_m.min(*to_m) > centre + reach
        }
        Mask::Inside { shape, soft_m } => !shape.loose_bounds().loosened(*soft_m).intersects(bounds),
        Mask::Text { decal } => !meets(&decal.line, bounds),
        _ => false,
    };
    is_beside.then(|| {
        let [low, high] = [bounds.min, bounds.max].map(|corner| {
            let [x, y, z] = [corner.x, corner.y, corner.z].map(format_number);
            format!("({x}, {y}, {z})")
        });
        format!("its mask lies beside the shape, which reaches from {low} to {high} m")
    })
}

/// Describes a line of text of which every shape cuts an end off.
fn cut_text(mask: &Mask, shapes: &[&Shape]) -> Option<String> {
    match mask {
        Mask::Product { masks } => masks.iter().find_map(|mask| cut_text(mask, shapes)),
        Mask::Text { decal } if shapes.iter().all(|shape| is_cut(&decal.line, shape)) => Some(format!(
            "its text {:?} is {} mm long and reaches beyond the surface, where it is cut; make its height smaller or move it",
            decal.line.text,
            mm(decal.line.length_m())
        )),
        _ => None,
    }
}

/// True if an end of a line of text is beside a shape as its reader sees it, or a wrapped line is
/// longer than its circle.
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

/// True if a line of text may be on the surface of a shape within `bounds`.
fn meets(line: &LabelLine, bounds: &Aabb) -> bool {
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
    use std::sync::Arc;

    use super::*;
    use softvt_scene::{TextDecal, Typeface, VisualLayer};

    /// The warning about a mask on a box.
    fn warning(mask: Mask) -> Option<String> {
        let layer = VisualLayer { mask, albedo: [1.0; 3], roughness: 0.5, opacity: 1.0, relief_m: 0.0 };
        let shape = Shape::Box { half: Vec3::new(0.02, 0.03, 0.04) };
        let mut found = hidden_visuals(&[&shape], &[Visual::default().with(layer)]);
        assert!(found.len() < 2, "{found:?}");
        found.pop()
    }

    fn text(text: &str, at: [f64; 3], wrap_m: Option<f64>) -> Mask {
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
        assert_eq!(warning(gradient(0.03, -0.01)), None);
        let part = Mask::Product { masks: vec![Arc::new(Mask::Whole), Arc::new(gradient(5.0, 30.0))] };
        let expected = "visuals[1].layers[1]: its mask lies beside the shape, which reaches from (-0.02, -0.03, -0.04) to (0.02, \
                        0.03, 0.04) m";
        assert_eq!(warning(part).as_deref(), Some(expected));
        assert_eq!(warning(text("milk", [0.0, -0.03, 0.03], None)), None, "printed along its direction");
        assert!(warning(text("milk", [0.0, 0.0, 3.0], None)).is_some());
        assert_eq!(warning(text("milk", [0.5, 0.0, 0.0], Some(0.02))), None, "wrapped around the axis");
        assert!(warning(text("milk", [0.0, 0.0, 0.3], Some(0.02))).is_some());
        let ball = Arc::new(Shape::Sphere { radius: 0.01 }.translated(Vec3::new(0.0, 0.0, 0.4)));
        assert!(warning(Mask::Inside { shape: ball, soft_m: 0.0 }).is_some());
    }

    #[test]
    fn a_text_that_is_longer_than_its_face_is_doubted() {
        let flat = |letters: &str, x| warning(text(letters, [x, -0.03, 0.0], None));
        assert_eq!(flat("milk", 0.0), None, "shorter than 40 mm");
        assert!(flat("milk", 0.019).is_some());
        let cut = flat("whole milk", 0.0).expect("cut");
        assert!(cut.starts_with("visuals[1].layers[1]: its text \"whole milk\" is "), "{cut}");
        assert_eq!(warning(text("whole milk", [0.0; 3], Some(0.02))), None, "125 mm around");
        assert!(warning(text("whole milk", [0.0; 3], Some(0.005))).is_some(), "31 mm around");
    }

    #[test]
    fn a_visual_without_a_painted_surface_is_doubted() {
        let found = hidden_visuals(&[&Shape::Sphere { radius: 0.02 }], &vec![Visual::default(); 2]);
        assert_eq!(found, ["visuals[2]: no part of the shape is painted with material 1; use shape:paint"]);
    }
}
