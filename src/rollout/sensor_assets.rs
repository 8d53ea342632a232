//! How things look and feel to the sensors: drawn models, fine skins, the tactile sensor. Made when somebody first looks.

use std::sync::Arc;

use super::{sensors::SensingError, shared_cache::SharedCache};
use crate::{
    geometry::voxel::VoxelMesh,
    scene::Asset,
    sensing::{
        camera::{CameraError, RenderMesh},
        panda::RobotMeshes,
        tactile::{TactileSensor, TactileSkin, TactileSpec},
    },
};

/// Shared by all episodes of a run; what was not used for long is forgotten and made again when it is asked for.
#[derive(Clone, Debug, Default)]
pub struct SensorAssets {
    models: SharedCache<Arc<Asset>, Arc<RenderMesh>>,
    skins: SharedCache<Arc<Asset>, Arc<TactileSkin>>,
    sensors: SharedCache<TactileSpec, Arc<TactileSensor>>,
    robot: SharedCache<(), Arc<RobotMeshes>>,
}

impl SensorAssets {
    /// The drawn form of an asset; `mesh` is that of its soft body.
    pub(super) fn model(
        &self,
        name: &str,
        asset: &Arc<Asset>,
        mesh: Option<&VoxelMesh>,
    ) -> Result<Arc<RenderMesh>, CameraError> {
        let same = |known: &Arc<Asset>| alike(known, asset) && known.visuals == asset.visuals;
        self.models.get(asset, same, || {
            let model = match mesh {
                None => RenderMesh::from_shape(name, &asset.shape, &asset.visuals)?,
                Some(mesh) => RenderMesh::from_deformable_shape(name, &asset.shape, &asset.visuals)?
                    .embedded_in(name, mesh)?,
            };
            Ok(Arc::new(model))
        })
    }

    /// The skin of an asset that presses on gels.
    pub(super) fn skin(
        &self,
        name: &str,
        asset: &Arc<Asset>,
        mesh: Option<&VoxelMesh>,
    ) -> Result<Arc<TactileSkin>, SensingError> {
        self.skins.get(
            asset,
            |known| alike(known, asset),
            || {
                let skin = match mesh {
                    None => TactileSkin::of_shape(&asset.shape),
                    Some(mesh) => TactileSkin::of_soft(&asset.shape, mesh)
                        .ok_or_else(|| SensingError::Skin(name.to_owned()))?,
                };
                Ok(Arc::new(skin))
            },
        )
    }

    /// The drawn form of the robot.
    pub(super) fn robot(&self) -> Result<Arc<RobotMeshes>, CameraError> {
        self.robot.get(&(), |()| true, || Ok(Arc::new(RobotMeshes::new()?)))
    }

    /// The tactile sensor of these numbers.
    pub(super) fn sensor(&self, spec: &TactileSpec) -> Result<Arc<TactileSensor>, SensingError> {
        self.sensors.get(spec, |known| known == spec, || Ok(Arc::new(TactileSensor::new(spec)?)))
    }
}

/// Whether two assets have one surface, at rest and moved.
fn alike(a: &Asset, b: &Asset) -> bool {
    a.shape == b.shape && a.body == b.body
}
