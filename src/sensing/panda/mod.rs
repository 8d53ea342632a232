//! The Franka Emika Panda with its hand and two GelSight Minis, to be drawn: shapes of our own making from public
//! dimensions, moved by the links of the joint tree that physics moves.

mod arm;
mod hand;
mod rounded_plate;
mod solid;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use super::camera::{Attachment, CameraError, RenderMesh, RenderObject, RenderSolid};
use crate::{geometry::Pose, robot::Side, scene::Visual};

/// Numbers of the looks in [`visuals`].
const SHELL: usize = 0;
const DARK: usize = 1;
const GREY: usize = 2;
const METAL: usize = 3;
const CASE: usize = 4;
const GEL: usize = 5;

/// What moves as one.
#[derive(Clone, Debug)]
struct Part {
    /// Index of its link in the tree; the base has none.
    link: Option<usize>,
    name: &'static str,
    /// Its solids, in the frame of the link.
    solids: Vec<RenderSolid>,
}

/// Painted shells, black plastic, grey rings, bare metal, the sensors' anodised cases, and their gels' silvered skins.
fn visuals() -> Vec<Visual> {
    vec![
        Visual::plain([0.68, 0.69, 0.705], 0.34, 0.0),
        Visual::plain([0.035, 0.036, 0.040], 0.38, 0.0),
        Visual::plain([0.20, 0.205, 0.215], 0.42, 0.0),
        Visual::plain([0.62, 0.62, 0.63], 0.32, 1.0),
        Visual::plain([0.022, 0.022, 0.025], 0.46, 0.0),
        Visual::plain([0.44, 0.44, 0.45], 0.42, 0.35),
    ]
}

/// The robot's drawn form, made once and shared by all episodes.
#[derive(Clone, Debug)]
pub struct RobotMeshes {
    parts: Vec<(Option<usize>, &'static str, Arc<RenderMesh>)>,
}

impl RobotMeshes {
    /// Makes all meshes, in a few tenths of a second.
    ///
    /// # Errors
    /// If a part has no surface, which would be a fault of this room.
    pub fn new() -> Result<Self, CameraError> {
        let visuals = visuals();
        let mut parts = vec![arm::base()];
        parts.extend(arm::links());
        parts.push(hand::hand());
        parts.extend(Side::BOTH.map(hand::finger));
        let mut made = Vec::new();
        for part in parts {
            let model = RenderMesh::from_solids(part.name, &part.solids, &visuals)?;
            made.push((part.link, part.name, Arc::new(model)));
        }
        for (side, name) in Side::BOTH.into_iter().zip(["left gel", "right gel"]) {
            let mesh = hand::gel(side);
            let model =
                RenderMesh::from_mesh(name, &mesh, &vec![GEL as u16; mesh.triangles.len()], &visuals)?;
            made.push((Some(crate::robot::panda::finger_link(side)), name, Arc::new(model)));
        }
        Ok(Self { parts: made })
    }

    /// The robot of joint tree number `tree`, its base at `base_w` (world), as object number `segmentation_id` of segmentations.
    pub fn objects(&self, tree: usize, base_w: Pose, segmentation_id: u16) -> Vec<RenderObject> {
        let thing = |(link, name, model): &(Option<usize>, &'static str, Arc<RenderMesh>)| RenderObject {
            name: format!("panda {name}"),
            segmentation_id,
            mesh: model.clone(),
            attachment: match *link {
                None => Attachment::Fixed(base_w),
                Some(link) => Attachment::Link { tree, link, offset: Pose::identity() },
            },
            casts_shadow: true,
        };
        self.parts.iter().map(thing).collect()
    }

    /// How many triangles it has at the finest.
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|(_, _, model)| model.triangle_count()).sum()
    }
}
