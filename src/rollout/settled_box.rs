//! Box about an object that does not rest as its asset is modelled.

use softvt_geometry::{Aabb, Pose, Quat, Vec3, shape::Shape, surface_mesh::SurfaceMesh, voxel::Embedding};
use softvt_physics::fem::FemState;

/// Tilt from which on an object does not rest as modelled, rad.
const MIN_TILT: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Cells along the longest edge of the surface that is measured.
const CELLS: f64 = 32.0;
/// Steps of the search for the narrowest side, rad.
const STEPS: [f64; 2] = [2.0 * std::f64::consts::PI / 180.0, 0.1 * std::f64::consts::PI / 180.0];

/// The upright box, along its narrowest side, about an object that has tilted while it settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettledBox {
    /// Angle between the vertical and the z axis of the object frame, rad.
    pub tilt: f64,
    /// Frame of the box in the object frame: z is up once the object has settled, x along the longer horizontal side.
    pub frame_o: Pose,
    /// Bounds of the settled surface in that frame, m.
    pub bounds: Aabb,
}

impl SettledBox {
    /// The box about a body of `shape` with its frame at `pose_w`, deformed if it is soft. `None` for one that rests as
    /// modelled: the z axis of its frame leans by less than 5°.
    pub fn new(shape: &Shape, pose_w: &Pose, soft: Option<&FemState>) -> Option<Self> {
        let tilt = lean(pose_w, &Vec3::z());
        if tilt < MIN_TILT {
            return None;
        }
        let surface = SurfaceMesh::from_shape(shape, shape.loose_bounds().size().max() / CELLS);
        let embedded = soft.and_then(|body| Some((body, surface.embed(&body.model.mesh)?)));
        let points: Vec<Vec3> = match embedded {
            Some((body, embeddings)) => {
                let at = |embedding: &Embedding| {
                    let nodes = &body.model.mesh.elements[embedding.element as usize];
                    embedding
                        .weights()
                        .iter()
                        .zip(nodes)
                        .map(|(w, &node)| body.x[node as usize] * *w)
                        .sum::<Vec3>()
                };
                embeddings.iter().map(at).collect()
            }
            None => {
                surface.mesh.vertices.iter().map(|v| pose_w.transform_point(&(*v).into()).coords).collect()
            }
        };
        let width = |yaw: f64| {
            let across = Vec3::new(-yaw.sin(), yaw.cos(), 0.0);
            let reach =
                |sign: f64| points.iter().map(|p| sign * p.dot(&across)).fold(f64::NEG_INFINITY, f64::max);
            reach(1.0) + reach(-1.0)
        };
        let narrowest = |middle: f64, step: f64, count: i32| {
            let yaws = (-count..=count).map(|k| middle + step * f64::from(k));
            yaws.map(|yaw| (width(yaw), yaw)).reduce(|best, next| if next.0 < best.0 { next } else { best })
        };
        let coarse = (std::f64::consts::FRAC_PI_2 / STEPS[0]).round() as i32;
        let (_, yaw) = narrowest(0.0, STEPS[0], coarse)?;
        let (_, yaw) = narrowest(yaw, STEPS[1], (STEPS[0] / STEPS[1]).round() as i32)?;
        let upright = Quat::from_axis_angle(&Vec3::z_axis(), yaw);
        let frame_o = Pose::from_parts(Vec3::zeros().into(), pose_w.rotation.inverse() * upright);
        let frame_w = pose_w * frame_o;
        let local: Vec<Vec3> =
            points.iter().map(|p| frame_w.inverse_transform_point(&(*p).into()).coords).collect();
        Some(Self { tilt, frame_o, bounds: Aabb::from_points(&local)? })
    }
}

/// Angle between the vertical and a direction of the object frame, rad.
pub(super) fn lean(pose_w: &Pose, up_o: &Vec3) -> f64 {
    (pose_w.rotation * up_o).angle(&Vec3::z())
}
