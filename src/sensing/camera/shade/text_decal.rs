//! Evaluates text decals on surfaces.

use crate::{geometry::Vec3, scene::TextDecal, sensing::camera::math::V3};

/// Minimum cosine between the normal of a printed surface and the direction of the text.
const MIN_FACING_COSINE: f32 = 0.1;
/// Maximum distance of a printed surface from the cylinder of a wrapped line, in radii of the cylinder.
const MAX_RADIUS_DEVIATION: f64 = 0.5;

/// Fraction of the square of edge `spacing` (m) about `p` (object frame, m) that letters cover, on a
/// surface of normal `n`.
pub(crate) fn coverage(decal: &TextDecal, p: &V3, n: &V3, spacing: f32) -> f32 {
    let Some([right, up]) = text_position(decal, &p.cast(), n) else { return 0.0 };
    let (sin, cos) = decal.line.turn.sin_cos();
    let (x, y) = (right * cos + up * sin, up * cos - right * sin);
    decal.coverage().share(x, y, f64::from(spacing)) as f32
}

/// Position of a surface point relative to the middle of the line, to the right and up as seen by the viewer, m;
/// `None` if the point is outside the printed area.
fn text_position(decal: &TextDecal, p: &Vec3, n: &V3) -> Option<[f64; 2]> {
    let line = &decal.line;
    let middle = Vec3::from(line.at);
    let facing = Vec3::from(line.facing).normalize();
    if let Some(radius) = line.wrap_m {
        let outwards = Vec3::new(p.x, p.y, 0.0);
        let faces_out =
            f64::from(n.x) * p.x + f64::from(n.y) * p.y > f64::from(MIN_FACING_COSINE) * outwards.norm();
        if !faces_out || (outwards.norm() - radius).abs() > MAX_RADIUS_DEVIATION * radius {
            return None;
        }
        let angle = (facing.x * p.y - facing.y * p.x).atan2(facing.x * p.x + facing.y * p.y);
        return Some([radius * angle, p.z - middle.z]);
    }
    let head = if facing.z.abs() > 0.999 { Vec3::y() } else { Vec3::z() };
    let up = (head - facing * facing.dot(&head)).normalize();
    let offset = p - middle;
    let depth = 0.5 * decal.coverage().length_m() + line.height_m;
    let is_printed =
        n.cast::<f64>().dot(&facing) > f64::from(MIN_FACING_COSINE) && offset.dot(&facing).abs() < depth;
    is_printed.then(|| [offset.dot(&up.cross(&facing)), offset.dot(&up)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LabelLine;

    fn value(line: &LabelLine, p: [f64; 3], n: [f32; 3]) -> f32 {
        let p = Vec3::from(p).cast();
        coverage(&TextDecal::new(line.clone()), &p, &n.into(), 5e-4)
    }

    /// Coverage to the left and to the right of the middle; an L has more on its left.
    fn sides(line: &LabelLine, n: [f32; 3], place: impl Fn(f64, f64) -> [f64; 3]) -> [f32; 2] {
        [-1.0, 1.0].map(|side| {
            let all = (1..=12).flat_map(|i| (-12..=12).map(move |j| (f64::from(i), f64::from(j))));
            all.map(|(i, j)| value(line, place(side * i * 5e-4, j * 5e-4), n)).sum()
        })
    }

    #[test]
    fn text_is_upright_and_not_mirrored_seen_from_the_direction_it_faces() {
        let line = |facing: [f64; 3]| LabelLine {
            text: "L".into(),
            height_m: 0.01,
            weight: 0.1,
            at: [0.001, 0.002, 0.003],
            facing,
            ..LabelLine::default()
        };
        // The viewer's right and up for each direction.
        for (n, right, up) in [
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
            ([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ] {
            let facing = line(n.map(f64::from));
            let place = |r: f64, u: f64| std::array::from_fn(|i| facing.at[i] + r * right[i] + u * up[i]);
            let [left, other] = sides(&facing, n, place);
            assert!(left > 1.5 * other && other > 0.5, "{n:?}: {left} {other}");
            let foot = value(&facing, place(0.0, -0.0044), n);
            let head = value(&facing, place(0.0, 0.0044), n);
            assert!(foot > 0.5 && head == 0.0, "{n:?}: the bar of an L is at the bottom: {foot} {head}");
            assert_eq!(value(&facing, place(0.0, -0.0044), n.map(|x: f32| -x)), 0.0, "the back is blank");
        }
    }

    #[test]
    fn a_wrapped_line_follows_the_cylinder_and_turn_rotates_a_line() {
        let line = LabelLine {
            text: "L".into(),
            height_m: 0.01,
            weight: 0.1,
            at: [0.0, 0.0, 0.05],
            facing: [0.0, -2.0, 0.0],
            wrap_m: Some(0.01),
            ..LabelLine::default()
        };
        let n = |turn: f64| [turn.sin() as f32, -turn.cos() as f32, 0.0];
        let place = |r: f64, u: f64| [0.01 * (r / 0.01).sin(), -0.01 * (r / 0.01).cos(), 0.05 + u];
        let ink = |r: f64| {
            let at = |j: i32| value(&line, place(r, f64::from(j) * 4e-4), n(r / 0.01));
            (-14..=14).map(at).sum::<f32>()
        };
        let [left, right] =
            [-1.0, 1.0].map(|side| (1..=12).map(|i| ink(side * f64::from(i) * 5e-4)).sum::<f32>());
        assert!(left > 1.5 * right && right > 0.5, "{left} {right}");
        assert_eq!(value(&line, [0.0, 0.01, 0.05], [0.0, 1.0, 0.0]), 0.0, "the far side is blank");
        let upright = LabelLine { wrap_m: None, facing: [0.0, 0.0, 1.0], at: [0.0; 3], ..line };
        let turned = LabelLine { turn: std::f64::consts::FRAC_PI_2, ..upright.clone() };
        for (r, u) in [(-0.002, 0.003), (0.001, -0.0044), (0.002, 0.002)] {
            let up = [0.0, 0.0, 1.0];
            let before = value(&upright, [r, u, 0.0], up);
            assert!(
                (before - value(&turned, [-u, r, 0.0], up)).abs() < 1e-5,
                "a quarter turn counter-clockwise"
            );
        }
    }
}
