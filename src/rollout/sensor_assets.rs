//! Render meshes and tactile skins per asset, and the models of robot and tactile sensor, built on first use.

use std::sync::Arc;

use super::shared_cache::SharedCache;
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::voxel::VoxelMesh;
use softvt_robot::tactile::TactileSpec;
use softvt_scene::{Asset, Camera};
use softvt_sensing::{
    camera::{CameraError, RenderMesh},
    panda::RobotMeshes,
    tactile::{TactileContactError, TactileSensor, TactileSensorError, TactileSkin},
};

/// Data of a sensor cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum SensingError {
    /// An image cannot be rendered.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The tactile sensor cannot be built.
    #[error(transparent)]
    Sensor(#[from] TactileSensorError),
    /// A tactile contact cannot be computed.
    #[error(transparent)]
    Field(#[from] TactileContactError),
    /// An error about a camera that a script has set.
    #[error("{at}: {source}")]
    Set {
        /// File and line of the setting.
        at: String,
        /// The cause.
        source: Box<SensingError>,
    },
    /// Two images have the same name.
    #[error("camera {camera}: name: {image:?} is an image of {owner} already; give the camera another name")]
    Name {
        /// Name of the camera.
        camera: String,
        /// Name of the image.
        image: String,
        /// Owner of the image with that name.
        owner: String,
    },
    /// The scene has no camera of a name.
    #[error("there is no camera {name:?}; the scene has {have}")]
    NoCamera {
        /// Name that no camera has.
        name: String,
        /// Names of the scene's cameras.
        have: String,
    },
    /// A soft body and its skin do not match.
    #[error("{0}: its surface lies outside of its voxel mesh; build both from one shape")]
    Skin(String),
}

impl SensingError {
    /// Adds the place in the script that set the camera.
    pub(super) fn set_by(self, camera: &Camera) -> Self {
        match &camera.set_at {
            Some(at) => Self::Set { at: at.clone(), source: Box::new(self) },
            None => self,
        }
    }
}

/// Meshes and sensor models shared by all episodes of a run; a clone shares the caches.
#[derive(Clone, Debug)]
pub struct SensorAssets {
    meshes: SharedCache<Arc<Asset>, Arc<RenderMesh>>,
    skins: SharedCache<Arc<Asset>, Arc<TactileSkin>>,
    sensors: SharedCache<TactileSpec, Arc<TactileSensor>>,
    robot: SharedCache<(), Arc<RobotMeshes>>,
    disk: DiskCache,
}

/// Maximum number of skins, of some 7 MB each: in suites whose objects vary, no episode needs those of another.
/// Episodes keep their own.
const MAX_SKINS: usize = 8;

impl Default for SensorAssets {
    fn default() -> Self {
        Self::stored_in(DiskCache::default())
    }
}

impl SensorAssets {
    /// Empty caches that keep what takes long in `disk`; by default in the cache of the process.
    pub fn stored_in(disk: DiskCache) -> Self {
        Self {
            meshes: SharedCache::default(),
            skins: SharedCache::of_size(MAX_SKINS),
            sensors: SharedCache::default(),
            robot: SharedCache::default(),
            disk,
        }
    }

    /// Render mesh of an asset; `mesh` is the voxel mesh of a soft body.
    pub(super) fn mesh(
        &self,
        name: &str,
        asset: &Arc<Asset>,
        mesh: Option<&VoxelMesh>,
    ) -> Result<Arc<RenderMesh>, CameraError> {
        let same = |known: &Arc<Asset>| have_same_surface(known, asset) && known.visuals == asset.visuals;
        self.meshes.get(asset, same, || {
            let model = match mesh {
                None => RenderMesh::from_shape(name, &asset.shape, &asset.visuals, &self.disk)?,
                Some(mesh) => {
                    RenderMesh::from_soft_shape(name, &asset.shape, &asset.visuals, mesh, &self.disk)?
                }
            };
            Ok(Arc::new(model))
        })
    }

    /// Tactile skin of an asset: the fine surface mesh that presses into gels.
    pub(super) fn skin(
        &self,
        name: &str,
        asset: &Arc<Asset>,
        mesh: Option<&VoxelMesh>,
    ) -> Result<Arc<TactileSkin>, SensingError> {
        self.skins.get(
            asset,
            |known| have_same_surface(known, asset),
            || {
                let skin = match mesh {
                    None => TactileSkin::from_shape(&asset.shape, &self.disk),
                    Some(mesh) => TactileSkin::from_soft(&asset.shape, mesh, &self.disk)
                        .ok_or_else(|| SensingError::Skin(name.to_owned()))?,
                };
                Ok(Arc::new(skin))
            },
        )
    }

    /// Render meshes of the robot.
    pub(super) fn robot(&self) -> Result<Arc<RobotMeshes>, CameraError> {
        self.robot.get(&(), |()| true, || Ok(Arc::new(RobotMeshes::new(&self.disk)?)))
    }

    /// Tactile sensor of a specification.
    pub(super) fn sensor(&self, spec: &TactileSpec) -> Result<Arc<TactileSensor>, SensingError> {
        self.sensors.get(spec, |known| known == spec, || Ok(Arc::new(TactileSensor::new(spec)?)))
    }
}

/// True if two assets have the same surface, at rest and deformed.
fn have_same_surface(a: &Asset, b: &Asset) -> bool {
    a.shape == b.shape && a.body == b.body
}
