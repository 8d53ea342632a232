//! Things in the world: their vertices and normals where a state puts them.

use super::{
    CameraError, FrameView, Mount, Thing, V3,
    model::{Level, accumulate},
};
use crate::geometry::Pose;

/// Vertices and normals of a level in the world.
#[derive(Clone, Debug, Default)]
pub(super) struct Posed {
    pub positions: Vec<V3>,
    pub normals: Vec<V3>,
}

/// A rigid placement in single precision: rows of the rotation, and the translation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigid {
    rotation: nalgebra::Matrix3<f32>,
    translation: V3,
}

impl Rigid {
    pub(super) fn of(pose: &Pose) -> Self {
        Self {
            rotation: pose.rotation.to_rotation_matrix().matrix().cast(),
            translation: pose.translation.vector.cast(),
        }
    }

    pub(super) fn turn(&self, v: &V3) -> V3 {
        self.rotation * v
    }

    pub(super) fn point(&self, p: &V3) -> V3 {
        self.rotation * p + self.translation
    }
}

fn finite(pose: &Pose) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
}

impl Posed {
    /// A level of a rigid thing at `pose`.
    pub(super) fn rigid(level: &Level, pose: &Pose, name: &str) -> Result<Self, CameraError> {
        let mut posed = Self::default();
        posed.place(level, pose, name)?;
        Ok(posed)
    }

    fn place(&mut self, level: &Level, pose: &Pose, name: &str) -> Result<(), CameraError> {
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
    pub(super) fn update(
        &mut self,
        thing: &Thing,
        level: &Level,
        view: &FrameView,
    ) -> Result<(), CameraError> {
        let Mount::Soft(body) = thing.mount else {
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
fn frame_of(thing: &Thing, view: &FrameView) -> Result<Pose, CameraError> {
    let missing = |reason: String| CameraError::State { name: thing.name.clone(), reason };
    match thing.mount {
        Mount::Fixed(pose) => Ok(pose),
        Mount::Rigid(body) => {
            view.rigid.get(body).copied().ok_or_else(|| missing(format!("no rigid body {body}")))
        }
        Mount::Link { tree, link, offset } => {
            let frame = view.links.get(tree).and_then(|links| links.get(link));
            Ok(frame.ok_or_else(|| missing(format!("no link {link} of tree {tree}")))? * offset)
        }
        Mount::Soft(body) => Err(missing(format!("soft body {body}, which has no frame"))),
    }
}
