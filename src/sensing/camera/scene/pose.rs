//! Things in the world: their vertices and normals where a state puts them.

use crate::geometry::Pose;
use crate::sensing::camera::{
    Attachment, CameraError, FrameView, RenderObject, V3,
    mesh::render_mesh::{Lod, accumulate},
};

/// Vertices and normals of a level in the world.
#[derive(Clone, Debug, Default)]
pub(crate) struct PosedMesh {
    pub positions: Vec<V3>,
    pub normals: Vec<V3>,
}

/// A rigid placement in single precision: rows of the rotation, and the translation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rigid {
    rotation: nalgebra::Matrix3<f32>,
    translation: V3,
}

impl Rigid {
    pub(crate) fn of(pose: &Pose) -> Self {
        Self {
            rotation: pose.rotation.to_rotation_matrix().matrix().cast(),
            translation: pose.translation.vector.cast(),
        }
    }

    pub(crate) fn turn(&self, v: &V3) -> V3 {
        self.rotation * v
    }

    pub(crate) fn point(&self, p: &V3) -> V3 {
        self.rotation * p + self.translation
    }
}

fn finite(pose: &Pose) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
}

impl PosedMesh {
    /// A level of a rigid thing at `pose`.
    pub(crate) fn rigid(level: &Lod, pose: &Pose, name: &str) -> Result<Self, CameraError> {
        let mut posed = Self::default();
        posed.place(level, pose, name)?;
        Ok(posed)
    }

    fn place(&mut self, level: &Lod, pose: &Pose, name: &str) -> Result<(), CameraError> {
        if !finite(pose) {
            let reason = "a pose that is not a number".to_owned();
            return Err(CameraError::State { name: name.to_owned(), reason });
        }
        let at = Rigid::of(pose);
        self.positions.clear();
        self.positions.extend(level.positions.iter().map(|p| at.point(p)));
        self.normals.clear();
        self.normals.extend(level.normals.iter().map(|n| at.turn(n)));
        Ok(())
    }

    /// A level of any moving thing as `view` has it.
    pub(crate) fn update(
        &mut self,
        thing: &RenderObject,
        level: &Lod,
        view: &FrameView,
    ) -> Result<(), CameraError> {
        let Attachment::Soft(body) = thing.attachment else {
            return self.place(level, &frame_of(thing, view)?, &thing.name);
        };
        let missing = |reason: String| CameraError::State { name: thing.name.clone(), reason };
        let nodes = view.nodes.get(body).ok_or_else(|| missing(format!("no soft body {body}")))?;
        if level.embedding.len() != level.positions.len() {
            return Err(missing("nodes for it, but its model is embedded in none".to_owned()));
        }
        if level.embedding.iter().any(|(of, _)| of.iter().any(|&n| n as usize >= nodes.len())) {
            return Err(missing(format!("{} nodes, fewer than its model names", nodes.len())));
        }
        if nodes.iter().any(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(missing("a node position that is not a number".to_owned()));
        }
        self.positions.clear();
        self.positions.extend(level.embedding.iter().map(|(of, weights)| {
            let mut p = V3::zeros();
            for (&node, weight) in of.iter().zip(weights) {
                p += nodes[node as usize].cast::<f32>() * *weight;
            }
            p
        }));
        self.normals.resize(self.positions.len(), V3::zeros());
        accumulate(&self.positions, &level.triangles, &mut self.normals);
        Ok(())
    }
}

/// Frame of a rigid thing in the world.
fn frame_of(thing: &RenderObject, view: &FrameView) -> Result<Pose, CameraError> {
    let missing = |reason: String| CameraError::State { name: thing.name.clone(), reason };
    match thing.attachment {
        Attachment::Fixed(pose) => Ok(pose),
        Attachment::Rigid(body) => {
            view.rigid.get(body).copied().ok_or_else(|| missing(format!("no rigid body {body}")))
        }
        Attachment::Link { tree, link, offset } => {
            let frame = view.links.get(tree).and_then(|links| links.get(link));
            Ok(frame.ok_or_else(|| missing(format!("no link {link} of tree {tree}")))? * offset)
        }
        Attachment::Soft(body) => Err(missing(format!("soft body {body}, which has no frame"))),
    }
}
