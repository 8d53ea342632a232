//! Places meshes in the world as a state dictates.

use super::render_scene::{FrameView, RenderObject};
use crate::{
    geometry::Pose,
    physics::BodyId,
    sensing::camera::{
        CameraError,
        math::{RigidTransform, V3, is_finite},
        mesh::lod::{Lod, compute_normals},
    },
};

/// Vertices and normals of a level of detail in the world.
#[derive(Clone, Debug, Default)]
pub(crate) struct PosedMesh {
    pub(crate) positions: Vec<V3>,
    pub(crate) normals: Vec<V3>,
}

impl PosedMesh {
    /// Places a level rigidly at `pose`; `name` appears in errors.
    pub(crate) fn rigid(lod: &Lod, pose: &Pose, name: &str) -> Result<Self, CameraError> {
        let mut posed = Self::default();
        posed.update_rigid(lod, pose, name)?;
        Ok(posed)
    }

    fn update_rigid(&mut self, lod: &Lod, pose: &Pose, name: &str) -> Result<(), CameraError> {
        if !is_finite(pose) {
            let reason = "a pose that is not a number".to_owned();
            return Err(CameraError::State { name: name.to_owned(), reason });
        }
        let to_world = RigidTransform::from_pose(pose);
        self.positions.clear();
        self.positions.extend(lod.positions.iter().map(|p| to_world.transform_point(p)));
        self.normals.clear();
        self.normals.extend(lod.normals.iter().map(|n| to_world.rotate(n)));
        Ok(())
    }

    /// Places a level of a moving object as in the state `view`.
    pub(crate) fn update(
        &mut self,
        object: &RenderObject,
        lod: &Lod,
        view: &FrameView,
    ) -> Result<(), CameraError> {
        let BodyId::Soft(body) = object.body else {
            return self.update_rigid(lod, &rigid_pose(object, view)?, &object.name);
        };
        let missing = |reason: String| state_error(object, reason);
        let nodes =
            view.nodes.get(body.index()).ok_or_else(|| missing(format!("no soft body {}", body.index())))?;
        if lod.embedding.len() != lod.positions.len() {
            return Err(missing("nodes for it, but its mesh is not embedded in a soft body".to_owned()));
        }
        if lod.embedding.iter().any(|vertex| vertex.nodes.iter().any(|&n| n as usize >= nodes.len())) {
            return Err(missing(format!("{} nodes, fewer than its mesh refers to", nodes.len())));
        }
        if nodes.iter().any(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(missing("a node position that is not a number".to_owned()));
        }
        self.positions.clear();
        self.positions.extend(lod.embedding.iter().map(|vertex| {
            let mut p = V3::zeros();
            for (&node, weight) in vertex.nodes.iter().zip(&vertex.weights) {
                p += nodes[node as usize].cast::<f32>() * *weight;
            }
            p
        }));
        self.normals.resize(self.positions.len(), V3::zeros());
        compute_normals(&self.positions, &lod.triangles, &mut self.normals);
        Ok(())
    }
}

fn state_error(object: &RenderObject, reason: String) -> CameraError {
    CameraError::State { name: object.name.clone(), reason }
}

/// Pose of a rigid object in the world.
fn rigid_pose(object: &RenderObject, view: &FrameView) -> Result<Pose, CameraError> {
    let missing = |reason: String| state_error(object, reason);
    let body_w = match object.body {
        BodyId::World => return Ok(object.pose_in_body),
        BodyId::Rigid(id) => {
            let pose = view.rigid.get(id.index()).copied();
            pose.ok_or_else(|| missing(format!("no rigid body {}", id.index())))?
        }
        BodyId::Link(id) => {
            let articulation = id.articulation.index();
            let pose = view.links.get(articulation).and_then(|links| links.get(id.index)).copied();
            pose.ok_or_else(|| missing(format!("no link {} of articulation {articulation}", id.index)))?
        }
        BodyId::Soft(_) | BodyId::Kinematic(_) => {
            return Err(missing("no pose for this kind of body".to_owned()));
        }
    };
    Ok(body_w * object.pose_in_body)
}
