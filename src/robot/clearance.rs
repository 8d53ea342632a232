//! How far the open hand is from things, for planners that must not knock over what they do not grasp.

use super::{
    Side,
    pads::{self, CollisionBox},
    panda,
};
use crate::geometry::{Aabb, Pose, Vec3, shape::Shape};

/// Spacing of the points that stand for the surface of the hand, m. A thing can be nearer than was found by at most
/// 0.71 of it.
const SPACING: f64 = 6e-3;

/// Something that the hand may meet.
#[derive(Clone, Copy, Debug)]
pub struct Obstacle<'a> {
    /// Object frame in the world.
    pub pose_w: Pose,
    /// Its shape, object frame.
    pub shape: &'a Shape,
    /// Bounds of the shape, object frame.
    pub bounds: Aabb,
}

/// Least distance, m, between the hand with its fingers `width` (m) apart and any of the obstacles, and which that is;
/// negative inside. Distances beyond `enough` (m) are not told apart: what is farther than that is not looked at.
///
/// The hand is the boxes that collide in the simulation; the arm is left out.
pub fn clearance(tool_w: &Pose, width: f64, obstacles: &[Obstacle<'_>], enough: f64) -> (f64, Option<usize>) {
    let mut nearest = (enough, None);
    for part in hand(width) {
        let centre_w = tool_w * part.pose;
        for (index, obstacle) in obstacles.iter().enumerate() {
            let to_object = obstacle.pose_w.inverse() * centre_w;
            let half = part.half;
            let reach = Aabb::from_half_extents(half).transformed(&to_object);
            if reach.distance(&obstacle.bounds) >= nearest.0 {
                continue;
            }
            for p in surface_points(&half) {
                let distance = obstacle.shape.distance(&to_object.transform_point(&p.into()).coords);
                if distance < nearest.0 {
                    nearest = (distance, Some(index));
                }
            }
        }
    }
    nearest
}

/// The hand's boxes in the tool frame.
fn hand(width: f64) -> impl Iterator<Item = CollisionBox> {
    let hand_in_tool = panda::tool_in_hand().inverse();
    let link_in_tool = hand_in_tool * panda::hand_in_link().inverse();
    let fingers = Side::BOTH.into_iter().flat_map(move |side| {
        let finger_in_tool = hand_in_tool * panda::finger_in_hand(side, width / 2.0);
        let gel = CollisionBox { half: pads::gel_half(), pose: pads::gel_centre_in_finger(side) };
        let parts = pads::finger_boxes(side).into_iter().chain([gel]);
        parts.map(move |part| CollisionBox { pose: finger_in_tool * part.pose, ..part })
    });
    let palm = pads::hand_boxes().map(move |part| CollisionBox { pose: link_in_tool * part.pose, ..part });
    fingers.chain(palm)
}

/// Points all over the surface of a box, edges and corners included.
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
    use crate::geometry::Quat;

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
    fn a_hand_over_a_floor_is_as_far_from_it_as_its_cases_reach() {
        let floor = Shape::cuboid(Vec3::new(1.0, 1.0, 0.1));
        let (found, which) = clearance(&down(0.0, 0.05), 0.04, &[obstacle(&floor, 0.0, 0.0, -0.05)], 1.0);
        assert!((found - 0.034).abs() < 1e-9, "{found}");
        assert_eq!(which, Some(0));
    }

    #[test]
    fn what_fits_between_the_gels_is_half_the_rest_of_the_width_away() {
        let shape = cube(0.02);
        let at = |width| clearance(&down(0.0, 0.0), width, &[obstacle(&shape, 0.0, 0.0, 0.0)], 1.0).0;
        assert!((at(0.05) - 0.015).abs() < 1e-9, "{}", at(0.05));
        assert!(at(0.016) < 0.0);
    }

    #[test]
    fn a_finger_in_a_neighbour_is_inside_and_the_neighbour_is_named() {
        let (near, far) = (cube(0.03), cube(0.03));
        let obstacles = [obstacle(&far, 0.0, 0.5, 0.0), obstacle(&near, 0.0, -0.05, 0.0)];
        let (found, which) = clearance(&down(0.0, 0.0), 0.08, &obstacles, 1.0);
        assert!(found < -5e-3 && which == Some(1), "{found} {which:?}");
        assert_eq!(clearance(&down(0.4, 0.0), 0.08, &obstacles, 0.1), (0.1, None));
    }
}
