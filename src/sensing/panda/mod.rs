//! Meshes of the Franka Emika Panda with its hand and two GelSight Minis.
//!
//! The robot is modelled from primitives with public dimensions instead of loading the vendor's meshes: no licensed
//! file is copied, the model takes a few kilobytes of source, and its meshes are generated deterministically.

mod arm;
mod hand;
mod solid;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::camera::{CameraError, Lod, RenderMesh, RenderObject, RenderSolid};
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::Pose;
use softvt_physics::{ArticulationId, BodyId, LinkId};
use softvt_robot::{Side, panda};
use softvt_scene::Visual;

// Indices into `visuals`.
const WHITE_SHELL: usize = 0;
const BLACK_PLASTIC: usize = 1;
const GREY_PLASTIC: usize = 2;
const BARE_METAL: usize = 3;
const SENSOR_CASE: usize = 4;
const SENSOR_GEL: usize = 5;

/// Solids that move together.
#[derive(Clone, Debug)]
struct RobotPart {
    /// Index of the link in the articulation; `None` for the base.
    link: Option<usize>,
    name: &'static str,
    /// In the frame of the link.
    solids: Vec<RenderSolid>,
}

impl RobotPart {
    fn new(link: Option<usize>, name: &'static str, solids: Vec<RenderSolid>) -> Self {
        Self { link, name, solids }
    }
}

/// Materials of the robot, by the indices above.
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

/// The meshes of the robot. They take a few tenths of a second to build and can be shared by all episodes.
#[derive(Clone, Debug)]
pub struct RobotMeshes {
    parts: Vec<PartMesh>,
}

#[derive(Clone, Debug)]
struct PartMesh {
    /// Index of the link in the articulation; `None` for the base.
    link: Option<usize>,
    name: String,
    mesh: Arc<RenderMesh>,
}

/// A part as it is stored: its surface has no textures.
#[derive(Serialize, Deserialize)]
struct PartLevels {
    link: Option<usize>,
    name: String,
    levels: Vec<Lod>,
}

impl RobotMeshes {
    /// Builds the meshes of all parts, or takes them from `cache`.
    ///
    /// # Errors
    /// A part has no surface. This is a bug in this module.
    pub fn new(cache: &DiskCache) -> Result<Self, CameraError> {
        // They follow from the code alone.
        let levels = cache.get("robot", &(), || Self::build()?.levels())?;
        let part = |part: PartLevels| PartMesh {
            link: part.link,
            name: part.name,
            mesh: Arc::new(RenderMesh::from_levels(part.levels)),
        };
        Ok(Self { parts: levels.into_iter().map(part).collect() })
    }

    /// The levels of detail of all parts.
    fn levels(self) -> Result<Vec<PartLevels>, CameraError> {
        let levels = |PartMesh { link, name, mesh }| {
            let levels = (0..mesh.level_count()).map(|index| mesh.level(index).cloned());
            Ok(PartLevels { link, name, levels: levels.collect::<Result<_, _>>()? })
        };
        self.parts.into_iter().map(levels).collect()
    }

    fn build() -> Result<Self, CameraError> {
        let visuals = visuals();
        let mut parts = vec![arm::base()];
        parts.extend(arm::links());
        parts.push(hand::hand());
        parts.extend(Side::BOTH.map(hand::finger));
        let mut meshes = Vec::new();
        for RobotPart { link, name, solids } in parts {
            let mesh = RenderMesh::from_solids(name, &solids, &visuals)?;
            meshes.push(PartMesh { link, name: name.to_owned(), mesh: Arc::new(mesh) });
        }
        for (side, name) in Side::BOTH.into_iter().zip(["left gel", "right gel"]) {
            let (link, visual) = (Some(panda::finger_link(side)), &visuals[SENSOR_GEL..]);
            let mesh = RenderMesh::from_mesh(name, &hand::gel(side), visual, &DiskCache::DISABLED)?;
            let mesh = mesh.with_coarser_levels()?;
            meshes.push(PartMesh { link, name: name.to_owned(), mesh: Arc::new(mesh) });
        }
        Ok(Self { parts: meshes })
    }

    /// The objects to draw for the articulation `articulation`, whose base is at `base_w` (world). All
    /// have the same `segmentation_id`.
    pub fn objects(
        &self,
        articulation: ArticulationId,
        base_w: Pose,
        segmentation_id: u16,
    ) -> Vec<RenderObject> {
        let object = |part: &PartMesh| RenderObject {
            name: format!("panda {}", part.name),
            segmentation_id,
            mesh: part.mesh.clone(),
            body: part.link.map_or(BodyId::World, |index| BodyId::Link(LinkId { articulation, index })),
            pose_in_body: if part.link.is_some() { Pose::identity() } else { base_w },
            casts_shadow: true,
        };
        self.parts.iter().map(object).collect()
    }
}
