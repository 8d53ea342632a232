//! Distance between the hand and obstacles, for planners that keep clear of objects they do not grasp.

use super::{
    pads::{self, CollisionBox},
    panda,
    spec::Side,
};
use softvt_geometry::{Aabb, Pose, Vec3, shape::Shape};

/// Spacing of the sample points on the surface of the hand, m. The distance found is too large by at most 0.71 of it.
const SPACING: f64 = 6e-3;

/// A shape to keep clear of.
#[derive(Clone, Copy, Debug)]
pub struct Obstacle<'a> {
    /// Object frame in the world frame.
    pub pose_w: Pose,
    /// Shape, object frame.
    pub shape: &'a Shape,
    /// Bounds of the shape, object frame.
    pub bounds: Aabb,
}

/// Distance from the hand to the nearest obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Signed distance, m; negative if they overlap.
    pub distance: f64,
    /// Index of the nearest obstacle; `None` if no obstacle is nearer than the search range.
    pub nearest: Option<usize>,
}

/// Distance between the hand at tool pose `tool_w` (world), its gel apexes `width` (m) apart, and the nearest obstacle.
///
/// Obstacles beyond `range` (m) are skipped: if all are, the distance is `range`. The hand is represented by its
/// collision boxes; the arm is left out.
pub fn clearance(tool_w: &Pose, width: f64, obstacles: &[Obstacle<'_>], range: f64) -> Clearance {
    let mut found = Clearance { distance: range, nearest: None };
    for part in hand_collision_boxes(width) {
        let centre_w = tool_w * part.pose;
        for (index, obstacle) in obstacles.iter().enumerate() {
            let to_object = obstacle.pose_w.inverse() * centre_w;
            let half = part.half;
            let reach = Aabb::from_half_extents(half).transformed(&to_object);
            if reach.distance(&obstacle.bounds) >= found.distance {
                continue;
            }
            for p in surface_points(&half) {
                let distance = obstacle.shape.distance(&to_object.transform_point(&p.into()).coords);
                if distance < found.distance {
                    found = Clearance { distance, nearest: Some(index) };
                }
            }
        }
    }
    found
}

/// Collision boxes of hand and fingers in the tool frame.
fn hand_collision_boxes(width: f64) -> impl Iterator<Item = CollisionBox> {
    let hand_in_tool = panda::tool_in_hand().inverse();
    let link_in_tool = hand_in_tool * panda::hand_in_link().inverse();
    let fingers = Side::BOTH.into_iter().flat_map(move |side| {
        let finger_in_tool = hand_in_tool * panda::finger_in_hand(side, width / 2.0);
        let gel = CollisionBox { half: pads::gel_half(), pose: pads::gel_centre_in_finger(side) };
        let parts = pads::finger_boxes(side).into_iter().chain([gel]);
        parts.map(move |part| CollisionBox { pose: finger_in_tool * part.pose, ..part })
    });
    let palm = panda::hand_boxes().map(move |part| CollisionBox { pose: link_in_tool * part.pose, ..part });
    fingers.chain(palm)
}

/// Grid points on the surface of a box, including its edges and corners.
fn surface_points(half: &Vec3) -> impl Iterator<Item = Vec3> + use<> {
    let half = *half;
    let count: [usize; 3] = std::array::from_fn(|i| (2.0 * half[i] / SPACING).ceil() as usize);
    let at = move |i: usize, k: usize| -half[i] + 2.0 * half[i] * k as f64 / count[i] as f64;
    (0..3).flat_map(move |axis| {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        [-1.0, 1.0].into_iter().flat_map(move |side| {
            (0..=count[u]).flat_map(move |i| {
                (0..=count[v]).map(move |j| {
                    let mut p = Vec3::zeros();
                    (p[axis], p[u], p[v]) = (side * half[axis], at(u, i), at(v, j));
                    p
                })
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::Quat;

    fn down(x: f64, z: f64) -> Pose {
        let turn = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
        Pose::from_parts(Vec3::new(x, 0.0, z).into(), turn)
    }

    fn cube(edge: f64) -> Shape {
        Shape::cuboid(Vec3::repeat(edge))
    }

    fn obstacle(shape: &Shape, x: f64, y: f64, z: f64) -> Obstacle<'_> {
        Obstacle { pose_w: Pose::translation(x, y, z), shape, bounds: shape.bounds() }
    }

    #[test]
    fn clearance_over_a_floor_is_that_of_the_sensor_cases() {
        let floor = Shape::cuboid(Vec3::new(1.0, 1.0, 0.1));
        let found = clearance(&down(0.0, 0.05), 0.04, &[obstacle(&floor, 0.0, 0.0, -0.05)], 1.0);
        assert!((found.distance - 0.034).abs() < 1e-9, "{found:?}");
        assert_eq!(found.nearest, Some(0));
    }

    #[test]
    fn clearance_of_a_centred_cube_is_half_of_the_free_width() {
        let shape = cube(0.02);
        let at = |width| clearance(&down(0.0, 0.0), width, &[obstacle(&shape, 0.0, 0.0, 0.0)], 1.0).distance;
        assert!((at(0.05) - 0.015).abs() < 1e-9, "{}", at(0.05));
        assert!(at(0.016) < 0.0);
    }

    #[test]
    fn a_finger_inside_an_obstacle_has_negative_clearance_to_it() {
        let (near, far) = (cube(0.03), cube(0.03));
        let obstacles = [obstacle(&far, 0.0, 0.5, 0.0), obstacle(&near, 0.0, -0.05, 0.0)];
        let found = clearance(&down(0.0, 0.0), 0.08, &obstacles, 1.0);
        assert!(found.distance < -5e-3 && found.nearest == Some(1), "{found:?}");
        let far = clearance(&down(0.4, 0.0), 0.08, &obstacles, 0.1);
        assert_eq!(far, Clearance { distance: 0.1, nearest: None });
    }
}
