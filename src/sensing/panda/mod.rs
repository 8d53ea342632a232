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
    parts: Vec<PartMesh<Arc<RenderMesh>>>,
}

/// The mesh of a part: in storage its levels of detail, since its surface has no textures.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct PartMesh<M> {
    /// Index of the link in the articulation; `None` for the base.
    link: Option<usize>,
    name: String,
    mesh: M,
}

impl RobotMeshes {
    /// Builds the meshes of all parts, or takes them from `cache`.
    ///
    /// # Errors
    /// A part has no surface. This is a bug in this module.
    pub fn new(cache: &DiskCache) -> Result<Self, CameraError> {
        // They follow from the code alone.
        let parts = cache.get("robot", &(), Self::build)?;
        let part = |PartMesh { link, name, mesh }: PartMesh<Vec<Lod>>| PartMesh {
            link,
            name,
            mesh: Arc::new(RenderMesh::from_levels(mesh)),
        };
        Ok(Self { parts: parts.into_iter().map(part).collect() })
    }

    fn build() -> Result<Vec<PartMesh<Vec<Lod>>>, CameraError> {
        let visuals = visuals();
        let part = |link, name: &str, mesh: RenderMesh| {
            let levels = (0..mesh.level_count()).map(|index| mesh.level(index).cloned());
            Ok(PartMesh { link, name: name.to_owned(), mesh: levels.collect::<Result<_, CameraError>>()? })
        };
        let mut parts = vec![arm::base()];
        parts.extend(arm::links());
        parts.push(hand::hand());
        parts.extend(Side::BOTH.map(hand::finger));
        let mut meshes = Vec::new();
        for RobotPart { link, name, solids } in parts {
            meshes.push(part(link, name, RenderMesh::from_solids(name, &solids, &visuals)?)?);
        }
        for (side, name) in Side::BOTH.into_iter().zip(["left gel", "right gel"]) {
            let (link, visual) = (Some(panda::finger_link(side)), &visuals[SENSOR_GEL..]);
            let mesh = RenderMesh::from_mesh(name, &hand::gel(side), visual, &DiskCache::DISABLED)?;
            meshes.push(part(link, name, mesh.with_coarser_levels()?)?);
        }
        Ok(meshes)
    }

    /// The objects to draw for the articulation `articulation`, whose base is at `base_w` (world). All
    /// have the same `segmentation_id`.
    pub fn objects(
        &self,
        articulation: ArticulationId,
        base_w: Pose,
        segmentation_id: u16,
    ) -> Vec<RenderObject> {
        let object = |part: &PartMesh<Arc<RenderMesh>>| RenderObject {
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
