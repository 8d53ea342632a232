//! Sensors of a simulation and their checks before an episode: images, tactile readings and forces.
//! Each is a pure function of a [`WorldSnapshot`] (a state of the world), so that it can be computed on demand, also
//! after the episode.

mod close_up;
mod error;

use std::{collections::BTreeMap, sync::Arc};

pub use close_up::{CloseUp, strain_colour};
pub use error::SensingError;

use super::{
    asset_cache::AssetCache,
    sensor_noise::SensorSeed,
    simulation::{ObjectInstance, Simulation},
};
use softvt_evaluation::stage::TaskStage;
use softvt_geometry::{Pose, Vec3};
use softvt_physics::{
    ArticulationId, BodyId, ColliderId, ContactPartner,
    world::{ContactPatch, WorldSnapshot},
};
use softvt_policy::{PadForce, RobotState, SensorStreams, TactileFrame};
use softvt_robot::tactile::{OpticsModel, TactileSpec};
use softvt_robot::{RobotSpec, Side, pads, panda};
use softvt_scene::{Camera, CameraMount, ROBOT_SEGMENTATION_ID, Scene};
use softvt_sensing::{
    camera::{
        CameraError, Channels, FrameView, RenderObject, RenderScene, RenderedImage, Renderer, RestState,
        check_cameras, check_light,
    },
    tactile::{
        GelScratch, PadWrench, PlacedSkin, SkinMesh, SubstrateCompliance, TactileContact, TactileReading,
        TactileSkin, Taxels,
    },
};

/// The sensors of one simulation: the scene's cameras, two tactile sensors, and the true forces on the pads.
///
/// Nothing is computed until it is requested. Meshes and skins come from shared [`AssetCache`].
#[derive(Debug)]
pub struct Sensors {
    scene: Arc<Scene>,
    spec: TactileSpec,
    robot: RobotSpec,
    articulation: ArticulationId,
    objects: Vec<ObjectInstance>,
    assets: AssetCache,
    /// Skins of `objects` that have pressed on a gel. Kept here, since many episodes share the cache of the assets.
    skins: Vec<Option<Arc<TactileSkin>>>,
    /// The state in which objects may stay.
    rest: Arc<RestState>,
    render_scene: Option<Arc<RenderScene>>,
    renderer: Renderer,
    close_up_renderer: Renderer,
    gel_scratch: GelScratch,
    seed: SensorSeed,
}

/// A clone shares the meshes but has its own working memory.
impl Clone for Sensors {
    fn clone(&self) -> Self {
        Self {
            scene: self.scene.clone(),
            spec: self.spec.clone(),
            robot: self.robot.clone(),
            articulation: self.articulation,
            objects: self.objects.clone(),
            assets: self.assets.clone(),
            skins: self.skins.clone(),
            rest: self.rest.clone(),
            render_scene: self.render_scene.clone(),
            renderer: Renderer::default(),
            close_up_renderer: Renderer::default(),
            gel_scratch: GelScratch::default(),
            seed: self.seed,
        }
    }
}

/// Suffixes of a camera's name for its colour, depth and segmentation images.
pub const CAMERA_IMAGE_SUFFIXES: [&str; 3] = ["", "_depth", "_segmentation"];
/// Suffixes of a finger's name for its tactile image, and for those with the markers as dots and as arrows.
pub const TACTILE_IMAGE_SUFFIXES: [&str; 3] = ["", "_markers", "_arrows"];
/// Names of the left and right finger's tactile images.
pub const TACTILE_IMAGES: [&str; 2] = ["tactile_left", "tactile_right"];

/// Edge of the images that are rendered as a check only, px.
const TRIAL_EDGE: usize = 16;

/// Taxels of the force maps along x and y, 1 mm each.
const TAXELS: [usize; 2] = [25, 21];

impl Sensors {
    /// The sensors of a simulation. Images take less time for objects that stay in its present state.
    pub fn new(sim: &Simulation, spec: &TactileSpec, assets: &AssetCache) -> Self {
        let WorldSnapshot { nodes, rigid, mut links, .. } = Self::frame(sim);
        // The robot never stays.
        links[sim.robot.articulation.index()].clear();
        Self {
            rest: Arc::new(RestState { nodes, rigid, links }),
            scene: sim.scene.clone(),
            spec: spec.clone(),
            robot: sim.robot.spec.clone(),
            articulation: sim.robot.articulation,
            objects: sim.objects.clone(),
            assets: assets.clone(),
            skins: vec![None; sim.objects.len()],
            render_scene: None,
            renderer: Renderer::default(),
            close_up_renderer: Renderer::default(),
            gel_scratch: GelScratch::default(),
            seed: SensorSeed::default(),
        }
    }

    /// The same sensors with the errors of an episode.
    pub fn with_seed(self, seed: SensorSeed) -> Self {
        Self { seed, ..self }
    }

    pub(super) fn seed(&self) -> SensorSeed {
        self.seed
    }

    /// The current state, with all that sensors need of it.
    pub fn frame(sim: &Simulation) -> WorldSnapshot {
        sim.world.snapshot(&sim.robot.pads)
    }

    /// # Errors
    /// The scene has no camera of that name.
    pub fn camera(&self, name: &str) -> Result<&Camera, SensingError> {
        self.scene.camera(name).ok_or_else(|| SensingError::NoCamera {
            name: name.to_owned(),
            have: self.scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    pub fn cameras(&self) -> &[Camera] {
        &self.scene.cameras
    }

    /// Renders the image of a camera in a state: colour, depth and segmentation. A camera inside an object sees the
    /// scene behind its surface, and `inside` of the image names the object: an episode must not fail because an
    /// object encloses a camera.
    ///
    /// # Errors
    /// A parameter of the camera or the light is out of range, or an object cannot be rendered.
    pub fn render(&mut self, frame: &WorldSnapshot, camera: &Camera) -> Result<RenderedImage, SensingError> {
        self.render_channels(frame, camera, Channels::All)
    }

    /// As [`render`](Self::render), faster, but with the same colours alone: depth and segmentation are empty.
    pub fn render_rgb(
        &mut self,
        frame: &WorldSnapshot,
        camera: &Camera,
    ) -> Result<RenderedImage, SensingError> {
        self.render_channels(frame, camera, Channels::Colours)
    }

    fn render_channels(
        &mut self,
        frame: &WorldSnapshot,
        camera: &Camera,
        channels: Channels,
    ) -> Result<RenderedImage, SensingError> {
        let (render_scene, view) = (self.built_scene()?, self.view(frame));
        let image = self.renderer.render_channels(&render_scene, &view, camera, channels);
        image.map_err(|error| SensingError::from(error).set_by(camera))
    }

    /// As [`render`](Self::render), for a camera that is used once: nothing is kept for its next image.
    pub fn render_once(
        &mut self,
        frame: &WorldSnapshot,
        camera: &Camera,
    ) -> Result<RenderedImage, SensingError> {
        let kept = std::mem::replace(&mut self.renderer, Renderer::without_backgrounds());
        let image = self.render(frame, camera);
        self.renderer = kept;
        image
    }

    /// The meshes and the light that [`render`](Self::render) uses, built on first use.
    ///
    /// # Errors
    /// An object cannot be rendered, or a parameter of the light is out of range.
    pub fn render_scene(&mut self) -> Result<&RenderScene, SensingError> {
        let built = self.built_scene()?;
        Ok(self.render_scene.insert(built))
    }

    /// The same, shared, so that a renderer can be used meanwhile.
    fn built_scene(&mut self) -> Result<Arc<RenderScene>, CameraError> {
        if let Some(built) = &self.render_scene {
            return Ok(built.clone());
        }
        let (objects, lighting) = (self.render_objects()?, self.scene.lighting.clone());
        let built = Arc::new(RenderScene::with_rest(objects, lighting, RestState::clone(&self.rest))?);
        Ok(self.render_scene.insert(built).clone())
    }

    /// The parts of a state that images depend on.
    pub fn view<'a>(&self, frame: &'a WorldSnapshot) -> FrameView<'a> {
        let hand_w = frame.links[self.articulation.index()][panda::HAND_LINK] * panda::hand_in_link();
        FrameView {
            nodes: &frame.nodes,
            rigid: &frame.rigid,
            links: &frame.links,
            hand_w: Some(hand_w),
            ..FrameView::default()
        }
    }

    /// Poses of the scene's cameras in a state, world, in their order.
    pub fn cameras_w(&self, frame: &WorldSnapshot) -> Vec<Pose> {
        let view = self.view(frame);
        self.scene.cameras.iter().map(|camera| camera_w(camera, &view)).collect()
    }

    /// Renders the image of a camera in an initial state, in which it must not be inside an object.
    pub fn render_unobstructed(
        &mut self,
        frame: &WorldSnapshot,
        camera: &Camera,
    ) -> Result<RenderedImage, SensingError> {
        let image = self.render(frame, camera)?;
        match &image.inside {
            None => Ok(image),
            Some(object) => {
                let inside = CameraError::Inside { camera: camera.name.clone(), object: object.clone() };
                Err(SensingError::from(inside).set_by(camera))
            }
        }
    }

    /// Computes the requested streams once in the initial state of an episode, so that errors appear before
    /// its first control step.
    pub fn compute_once(
        &mut self,
        frame: &WorldSnapshot,
        streams: &SensorStreams,
    ) -> Result<(), SensingError> {
        for name in &streams.cameras {
            let camera = self.camera(name)?.clone().with_edge(TRIAL_EDGE);
            self.render_unobstructed(frame, &camera)?;
        }
        if streams.tactile {
            self.tactile_readings(frame)?;
        }
        Ok(())
    }

    /// Checks that no camera of the scene is inside an object in the initial state. It evaluates the shapes of the
    /// objects, which is a hundred times faster than rendering them; only the robot is rendered.
    ///
    /// # Errors
    /// A camera is inside an object, or the robot cannot be rendered.
    pub fn check_camera_positions(&mut self, frame: &WorldSnapshot) -> Result<(), SensingError> {
        let robot = RenderScene::new(self.render_robot()?, self.scene.lighting.clone())?;
        let view = self.view(frame);
        for camera in &self.scene.cameras {
            let eye_w = nalgebra::Point3::from(camera_w(camera, &view).translation.vector);
            let is_around = |object: &&ObjectInstance| {
                object.asset.shape.distance(&object.start_w.inverse_transform_point(&eye_w).coords) < 0.0
            };
            let object = match self.objects.iter().find(is_around) {
                Some(object) => Some(object.name.clone()),
                None => {
                    let image =
                        Renderer::default().render(&robot, &view, &camera.clone().with_edge(TRIAL_EDGE));
                    image.map_err(|error| SensingError::from(error).set_by(camera))?.inside
                }
            };
            if let Some(object) = object {
                let inside = CameraError::Inside { camera: camera.name.clone(), object };
                return Err(SensingError::from(inside).set_by(camera));
            }
        }
        Ok(())
    }

    /// Readings of the left and right tactile sensor in a state.
    ///
    /// # Errors
    /// The sensor cannot be built, or a number of the state is not finite.
    pub fn tactile_readings(&mut self, frame: &WorldSnapshot) -> Result<[TactileReading; 2], SensingError> {
        let left = self.tactile_reading(frame, Side::Left)?;
        Ok([left, self.tactile_reading(frame, Side::Right)?])
    }

    /// Readings of both tactile sensors in the form of observations.
    pub fn tactile_frames(&mut self, frame: &WorldSnapshot) -> Result<[TactileFrame; 2], SensingError> {
        let both = self.tactile_readings(frame)?;
        let untouched = self.assets.sensor(&self.spec)?.untouched_image.clone();
        Ok(both.map(|reading| TactileFrame::new(reading.image, untouched.clone(), reading.markers)))
    }

    /// True forces on the left and right gel.
    pub fn pad_forces(frame: &WorldSnapshot) -> [PadForce; 2] {
        let pad = pads::PadSurface::default();
        [0, 1].map(|side| match frame.patches.get(side) {
            Some(patch) => PadForce {
                wrench: PadWrench::from_patch(patch),
                taxels: Taxels::from_patch(patch, &pad, TAXELS),
            },
            None => PadForce { wrench: PadWrench::default(), taxels: Taxels::empty(&pad, TAXELS) },
        })
    }

    /// Reading of one tactile sensor in a state.
    pub fn tactile_reading(
        &mut self,
        frame: &WorldSnapshot,
        side: Side,
    ) -> Result<TactileReading, SensingError> {
        let sensor = self.assets.sensor(&self.spec)?;
        let index = side.index();
        let none = ContactPatch { collider: ColliderId::new(0), points: Vec::new() };
        // Contact at the very rim, beyond the centres of the outermost grid cells, is not visible.
        let inside = |p: &Vec3| sensor.gel.pad.edge_distance(p.x, p.y) < -sensor.gel.cell;
        let patch = frame.patches.get(index).filter(|patch| patch.points.iter().any(|p| inside(&p.p_p)));
        let patch = patch.unwrap_or(&none);
        let pad_w = self.pads_w(frame)[index];
        let w_p = pad_w.inverse();
        let mut touching: Vec<(&ObjectInstance, Arc<TactileSkin>)> = Vec::new();
        let mut substrate = None;
        for (index, object) in
            self.objects.iter().enumerate().filter(|(_, object)| is_in_contact(object, patch))
        {
            let mesh = object.model.as_ref().map(|model| &model.mesh);
            let skin = match &self.skins[index] {
                Some(skin) => skin.clone(),
                None => {
                    self.skins[index].insert(self.assets.skin(&object.name, &object.asset, mesh)?).clone()
                }
            };
            touching.push((object, skin));
            substrate = substrate_of(object);
        }
        let placed = touching.iter().map(|(object, skin)| match object.body {
            BodyId::Soft(body) => skin.place_soft(frame.soft(body), &w_p),
            BodyId::Rigid(body) => skin.place_rigid(&(w_p * frame.rigid(body))),
            BodyId::Link(link) => {
                skin.place_rigid(&(w_p * frame.link(link) * object.joint_frame_o().inverse()))
            }
            BodyId::World | BodyId::Kinematic(_) => skin.place_rigid(&(w_p * object.start_w)),
        });
        let placed: Vec<PlacedSkin> = placed.collect();
        let skins: Vec<SkinMesh> = placed.iter().map(PlacedSkin::mesh).collect();
        let contact = TactileContact {
            wrench: PadWrench::from_patch(patch),
            skins: &skins,
            points: &patch.points,
            substrate: if placed.len() == 1 { substrate } else { None },
        };
        let mut reading = sensor.read(&contact, &mut self.gel_scratch)?;
        self.seed.apply_wear(&self.spec.wear, side, frame.step, &sensor.untouched_image, &mut reading);
        Ok(reading)
    }

    /// Frames of the pads of the left and right finger in a state, world.
    pub fn pads_w(&self, frame: &WorldSnapshot) -> [Pose; 2] {
        [Side::Left, Side::Right].map(|side| {
            frame.links[self.articulation.index()][panda::finger_link(side)] * pads::pad_pose_in_finger(side)
        })
    }

    /// Base of the robot, world.
    pub fn base_w(&self) -> Pose {
        self.scene.base_w
    }

    /// Names and configurations of all movable objects, in the order of the scene.
    pub fn body_configurations<'a>(
        &'a self,
        frame: &'a WorldSnapshot,
    ) -> impl Iterator<Item = (&'a str, BodyConfiguration<'a>)> {
        self.objects.iter().filter_map(|object| {
            let state = match object.body {
                BodyId::Soft(body) => BodyConfiguration::Nodes(frame.soft(body)),
                BodyId::Rigid(body) => BodyConfiguration::Pose(*frame.rigid(body)),
                BodyId::Link(link) => {
                    BodyConfiguration::Pose(frame.link(link) * object.joint_frame_o().inverse())
                }
                BodyId::World | BodyId::Kinematic(_) => return None,
            };
            Some((object.name.as_str(), state))
        })
    }

    /// Render objects of the scene and the robot.
    fn render_objects(&self) -> Result<Vec<RenderObject>, CameraError> {
        let render_object = |(index, object): (usize, &ObjectInstance)| {
            let voxels = object.model.as_ref().map(|model| &model.mesh);
            let (body, pose_in_body) = match object.body {
                BodyId::Soft(_) | BodyId::Rigid(_) => (object.body, Pose::identity()),
                BodyId::Link(_) => (object.body, object.joint_frame_o().inverse()),
                BodyId::World | BodyId::Kinematic(_) => (BodyId::World, object.start_w),
            };
            Ok(RenderObject {
                name: object.name.clone(),
                segmentation_id: index as u16 + 1,
                mesh: self.assets.mesh(&object.name, &object.asset, voxels)?,
                body,
                pose_in_body,
                casts_shadow: true,
            })
        };
        let mut objects: Vec<RenderObject> =
            self.objects.iter().enumerate().map(render_object).collect::<Result<_, _>>()?;
        objects.extend(self.render_robot()?);
        Ok(objects)
    }

    fn render_robot(&self) -> Result<Vec<RenderObject>, CameraError> {
        let base_w = self.scene.base_w;
        Ok(self
            .assets
            .robot()?
            .objects(self.articulation, base_w, ROBOT_SEGMENTATION_ID)
            .into_iter()
            .collect())
    }
}

/// Pose of a camera, world.
fn camera_w(camera: &Camera, view: &FrameView) -> Pose {
    match (camera.mount, view.hand_w) {
        (CameraMount::Hand, Some(hand_w)) => hand_w * camera.pose,
        _ => camera.pose,
    }
}

/// Checks the sensors of a scene without a simulation: parameters, names and sizes of the cameras, the light, and the
/// table files of the tactile sensor.
///
/// # Errors
/// The first invalid value, with the place in the script that set it.
pub fn check_sensors(scene: &Scene, spec: &TactileSpec, assets: &AssetCache) -> Result<(), SensingError> {
    check_cameras(&scene.cameras)
        .map_err(|(index, error)| SensingError::from(error).set_by(&scene.cameras[index]))?;
    // The files of two images of one name would overwrite each other.
    let mut taken: BTreeMap<String, String> = BTreeMap::new();
    for finger in TACTILE_IMAGES {
        taken.extend(TACTILE_IMAGE_SUFFIXES.map(|kind| (format!("{finger}{kind}"), "a finger".to_owned())));
    }
    for camera in &scene.cameras {
        let names = CAMERA_IMAGE_SUFFIXES.map(|kind| format!("{}{kind}", camera.name));
        if let Some((image, owner)) = names.iter().find_map(|name| taken.get_key_value(name)) {
            let (camera_name, image, owner) = (camera.name.clone(), image.clone(), owner.clone());
            return Err(SensingError::Name { camera: camera_name, image, owner }.set_by(camera));
        }
        taken.extend(names.map(|name| (name, format!("camera {}", camera.name))));
    }
    check_light(&scene.lighting)?;
    // Other optics models read no files.
    if let OpticsModel::Taxim { .. } = spec.optics {
        assets.sensor(spec)?;
    }
    Ok(())
}

/// True if an object has a contact point in a patch.
fn is_in_contact(object: &ObjectInstance, patch: &ContactPatch) -> bool {
    patch.points.iter().any(|point| match point.partner {
        ContactPartner::Soft(id) => object.body == BodyId::Soft(id),
        ContactPartner::Collider(id) => object.colliders.contains(&id),
    })
}

/// Compliance of a soft body to a gel in ridges too fine for its elements.
fn substrate_of(object: &ObjectInstance) -> Option<SubstrateCompliance> {
    let model = object.model.as_ref()?;
    let modulus = model.material.plane_strain_modulus();
    Some(SubstrateCompliance { modulus, resolved: 2.0 * model.mesh.edge })
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyConfiguration<'a> {
    /// Node positions of a soft body, m, world.
    Nodes(&'a [Vec3]),
    /// Pose of the object frame of a rigid body, world.
    Pose(Pose),
}

/// States of an episode, from which images and tactile readings can be computed later.
#[derive(Debug)]
pub struct StateRecording {
    pub sensors: Sensors,
    /// The settled state and the state after each control step.
    pub frames: Vec<WorldSnapshot>,
    /// Readings of the robot's own sensors in these states.
    pub robot: Vec<RobotState>,
    /// The target, as an object of `sensors`.
    pub target: usize,
    /// Deformation in these states; `None` for rigid targets.
    pub deformation: Vec<Option<StateDeformation>>,
    /// Stage of the episode in each state; `None` once all placements have been met.
    pub stages: Vec<Option<TaskStage>>,
}

/// Largest D of a target over the physics steps of a control step; 0 in the settled state. Of several targets, it is
/// that of the one whose D is the largest share of its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateDeformation {
    /// D, % of the settled diagonal.
    pub d_pct: f64,
    /// τ of the target, %; `None` without a limit.
    pub tau_pct: Option<f64>,
}

impl StateDeformation {
    /// The worst of some targets, each with its D and its τ. Targets without a limit come after those with one.
    pub fn worst(targets: impl IntoIterator<Item = (Option<f64>, Option<f64>)>) -> Option<Self> {
        let known = targets.into_iter().filter_map(|(d_pct, tau_pct)| Some(Self { d_pct: d_pct?, tau_pct }));
        let severity = |of: &Self| (of.ratio(), of.d_pct);
        known.reduce(|worst, next| if severity(&next) > severity(&worst) { next } else { worst })
    }

    /// D over τ; `None` without a limit.
    pub fn ratio(&self) -> Option<f64> {
        self.tau_pct.filter(|tau| *tau > 0.0).map(|tau| self.d_pct / tau)
    }

    pub fn is_over(&self) -> bool {
        self.tau_pct.is_some_and(|tau| self.d_pct > tau)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_target_over_its_limit_is_shown_rather_than_the_first_within() {
        let shown =
            StateDeformation::worst([(Some(0.9), Some(1.0)), (Some(0.6), Some(0.5)), (Some(3.0), None)]);
        assert_eq!(shown, Some(StateDeformation { d_pct: 0.6, tau_pct: Some(0.5) }));
        assert!(shown.is_some_and(|of| of.is_over()));
        assert_eq!(StateDeformation::worst([(None, None)]), None, "a rigid target");
    }
}
