//! What the robot senses in a simulation: pictures, touch and forces, each a pure function of a [`Frame`], computed when
//! somebody looks, then or later.

use std::sync::Arc;

use super::{
    sensor_assets::SensorAssets,
    simulation::{Simulation, joint_frame},
};
use crate::{
    geometry::{Pose, Vec3},
    physics::{
        ArticulationId, BodyId, ColliderId, ContactPartner,
        fem::FemModel,
        world::{ContactPatch, Frame},
    },
    policy::{PadForce, TactileFrame},
    robot::{RobotSpec, Side, pads, panda},
    scene::{Asset, Body, Camera, Scene},
    sensing::{
        camera::{self, CameraError, FrameView, RenderObject, RenderScene, RenderedImage},
        tactile::{
            ContactError, GelScratch, PadWrench, SkinMesh, SubstrateCompliance, TactileContact,
            TactileReading, TactileSensorError, TactileSkin, TactileSpec, Taxels, patch_friction,
        },
    },
};

/// Why something cannot be sensed.
#[derive(Debug, thiserror::Error)]
pub enum SensingError {
    /// A picture cannot be drawn.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The tactile sensor cannot be made.
    #[error(transparent)]
    Sensor(#[from] TactileSensorError),
    /// A touch cannot be worked out.
    #[error(transparent)]
    Field(#[from] ContactError),
    /// What a script set is wrong.
    #[error("{at}: {source}")]
    Set {
        /// File and line.
        at: String,
        /// What is wrong.
        source: Box<SensingError>,
    },
    /// Two pictures have one name.
    #[error(
        "camera {camera}: name: {picture:?} is a picture of {owner} already; give the camera another name"
    )]
    Name {
        /// The camera.
        camera: String,
        /// The name of the picture.
        picture: String,
        /// Whose picture it is.
        owner: String,
    },
    /// There is no such camera.
    #[error("there is no camera {name:?}; the scene has {have}")]
    NoCamera {
        /// The name.
        name: String,
        /// Names of those there are.
        have: String,
    },
    /// A soft body and its skin do not belong together.
    #[error("{0}: its surface lies outside of its voxel mesh; build both from one shape")]
    Skin(String),
}

impl SensingError {
    /// The same error with the place in the script that set the camera.
    pub(super) fn set_by(self, camera: &Camera) -> Self {
        match &camera.set_at {
            Some(at) => Self::Set { at: at.clone(), source: Box::new(self) },
            None => self,
        }
    }
}

/// An object of the scene as the sensors know it.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) name: String,
    asset: Arc<Asset>,
    pub(super) body: BodyId,
    start_w: Pose,
    /// Its frame in that of its link, if it has one.
    pub(super) offset: Pose,
    colliders: Vec<ColliderId>,
    rest: Option<Arc<FemModel>>,
}

/// The sensors of one simulation.
#[derive(Debug)]
pub struct SensorSuite {
    scene: Arc<Scene>,
    spec: TactileSpec,
    pub(super) robot: RobotSpec,
    pub(super) articulation: ArticulationId,
    pub(super) parts: Vec<Part>,
    assets: SensorAssets,
    stage: Option<Arc<RenderScene>>,
    eye: camera::Renderer,
    touch: GelScratch,
}

/// A copy draws the same scene with a working memory of its own, which it fills when it first looks.
impl Clone for SensorSuite {
    fn clone(&self) -> Self {
        Self {
            scene: self.scene.clone(),
            spec: self.spec.clone(),
            robot: self.robot.clone(),
            articulation: self.articulation,
            parts: self.parts.clone(),
            assets: self.assets.clone(),
            stage: self.stage.clone(),
            eye: camera::Renderer::default(),
            touch: GelScratch::default(),
        }
    }
}

/// Taxels along x and y of the force maps: squares of a millimetre.
const TAXELS: [usize; 2] = [25, 21];
/// Number of the robot in segmentations; objects count from 1 in the order of the scene, the parts of each after
/// it.
pub const ROBOT: u16 = 1000;

impl SensorSuite {
    /// The sensors of `sim`; nothing is computed yet.
    pub fn new(sim: &Simulation, spec: &TactileSpec, assets: &SensorAssets) -> Self {
        let part = |object: &super::ObjectInstance| Part {
            name: object.name.clone(),
            asset: object.asset.clone(),
            body: object.body,
            start_w: object.start_w,
            offset: joint_frame(object).inverse(),
            colliders: object.colliders.clone(),
            rest: match object.body {
                BodyId::Soft(body) => Some(sim.world.soft(body).state.model.clone()),
                _ => None,
            },
        };
        Self {
            scene: sim.scene.clone(),
            spec: spec.clone(),
            robot: sim.robot.spec.clone(),
            articulation: sim.robot.articulation,
            parts: sim.objects.iter().map(part).collect(),
            assets: assets.clone(),
            stage: None,
            eye: camera::Renderer::default(),
            touch: GelScratch::default(),
        }
    }

    /// All that the sensors need of the present state.
    pub fn frame(sim: &Simulation) -> Frame {
        sim.world.snapshot(&sim.robot.pads)
    }

    /// The scene's camera of a name.
    ///
    /// # Errors
    /// There is none.
    pub fn camera(&self, name: &str) -> Result<&Camera, SensingError> {
        self.scene.camera(name).ok_or_else(|| SensingError::NoCamera {
            name: name.to_owned(),
            have: self.scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    /// The scene's cameras.
    pub fn cameras(&self) -> &[Camera] {
        &self.scene.cameras
    }

    /// What `camera` sees. One that stands inside of something sees what is beyond it, and the picture says so: things may
    /// get around a camera in the course of an episode, and that must not end it.
    ///
    /// # Errors
    /// A number of the camera or light out of range, a thing that cannot be drawn.
    pub fn render(&mut self, frame: &Frame, camera: &Camera) -> Result<RenderedImage, SensingError> {
        let stage = match self.stage.take() {
            Some(stage) => stage,
            None => Arc::new(self.build()?),
        };
        let picture = self.eye.render(&stage, &self.view(frame), camera);
        self.stage = Some(stage);
        picture.map_err(|error| SensingError::from(error).set_by(camera))
    }

    /// Everything that is drawn, for [`render`]; made when somebody first looks.
    ///
    /// # Errors
    /// A thing that cannot be drawn, a number of the light out of range.
    pub fn render_scene(&mut self) -> Result<&RenderScene, SensingError> {
        let stage = match self.stage.take() {
            Some(stage) => stage,
            None => Arc::new(self.build()?),
        };
        Ok(self.stage.insert(stage))
    }

    fn build(&self) -> Result<RenderScene, CameraError> {
        RenderScene::new(self.things()?, self.scene.lighting.clone())
    }

    /// The robot with nothing around it.
    pub(super) fn robot_alone(&self) -> Result<RenderScene, CameraError> {
        let things = self.assets.robot()?.objects(self.articulation, self.scene.base_w, ROBOT);
        RenderScene::new(things.into_iter().collect(), self.scene.lighting.clone())
    }

    /// The object that a point of the world is inside of where the objects start.
    pub(super) fn around(&self, point_w: &nalgebra::Point3<f64>) -> Option<&str> {
        let inside = |part: &&Part| {
            part.asset.shape.distance(&part.start_w.inverse_transform_point(point_w).coords) < 0.0
        };
        self.parts.iter().find(inside).map(|part| part.name.as_str())
    }

    /// What pictures need of a state.
    pub fn view<'a>(&self, frame: &'a Frame) -> FrameView<'a> {
        let hand_w = frame.links[self.articulation.index()][panda::HAND_LINK] * panda::hand_in_link();
        FrameView::new(frame, Some(hand_w))
    }

    /// The same for a camera where somebody put it, before anything has moved.
    ///
    /// # Errors
    /// As [`SensorSuite::render`]; also if the camera stands inside of something.
    pub fn render_unobstructed(
        &mut self,
        frame: &Frame,
        camera: &Camera,
    ) -> Result<RenderedImage, SensingError> {
        let picture = self.render(frame, camera)?;
        match &picture.inside {
            None => Ok(picture),
            Some(object) => {
                let inside = CameraError::Inside { camera: camera.name.clone(), object: object.clone() };
                Err(SensingError::from(inside).set_by(camera))
            }
        }
    }

    /// What the left and right finger feel.
    ///
    /// # Errors
    /// The sensor cannot be made, or a number of the state is none.
    pub fn tactile_readings(&mut self, frame: &Frame) -> Result<[TactileReading; 2], SensingError> {
        let left = self.tactile_reading(frame, Side::Left)?;
        Ok([left, self.tactile_reading(frame, Side::Right)?])
    }

    /// The same as a policy gets it.
    ///
    /// # Errors
    /// As [`SensorSuite::tactile_readings`].
    pub fn tactile_frames(&mut self, frame: &Frame) -> Result<[TactileFrame; 2], SensingError> {
        let both = self.tactile_readings(frame)?;
        let untouched = self.assets.sensor(&self.spec)?.untouched_image.clone();
        Ok(both.map(|reading| TactileFrame::new(reading.image, untouched.clone(), reading.markers)))
    }

    /// True forces on the left and right gel.
    pub fn pad_forces(frame: &Frame) -> [PadForce; 2] {
        let pad = pads::PadSurface::default();
        [0, 1].map(|side| match frame.patches.get(side) {
            Some(patch) => PadForce {
                wrench: PadWrench::from_patch(patch),
                taxels: Taxels::from_patch(patch, &pad, TAXELS),
            },
            None => PadForce { wrench: PadWrench::default(), taxels: Taxels::empty(&pad, TAXELS) },
        })
    }

    /// What one finger feels.
    ///
    /// # Errors
    /// As [`SensorSuite::tactile_readings`].
    pub fn tactile_reading(&mut self, frame: &Frame, side: Side) -> Result<TactileReading, SensingError> {
        let sensor = self.assets.sensor(&self.spec)?;
        let index = usize::from(side == Side::Right);
        let none = ContactPatch { collider: ColliderId::new(0), points: Vec::new() };
        // What touches the very rim alone, where no cell of the grid has its centre, cannot be seen.
        let inside = |p: &Vec3| sensor.gel.pad.edge_distance(p.x, p.y) < -sensor.gel.cell;
        let patch = frame.patches.get(index).filter(|patch| patch.points.iter().any(|p| inside(&p.p_p)));
        let patch = patch.unwrap_or(&none);
        let pad_w =
            frame.links[self.articulation.index()][panda::finger_link(side)] * pads::pad_pose_in_finger(side);
        let mut placed: Vec<(Arc<TactileSkin>, Vec<Vec3>)> = Vec::new();
        let mut substrate = None;
        for part in self.parts.iter().filter(|part| part.presses(patch)) {
            let mesh = part.rest.as_ref().map(|rest| &rest.mesh);
            let skin = self.assets.skin(&part.name, &part.asset, mesh)?;
            let mut vertices = Vec::new();
            let w_p = pad_w.inverse();
            match part.body {
                BodyId::Soft(body) => skin.place_soft(frame.soft(body), &w_p, &mut vertices),
                BodyId::Rigid(body) => skin.place_rigid(&(w_p * frame.rigid(body)), &mut vertices),
                BodyId::Link(link) => {
                    skin.place_rigid(&(w_p * frame.link(link) * part.offset), &mut vertices)
                }
                BodyId::World | BodyId::Kinematic(_) => {
                    skin.place_rigid(&(w_p * part.start_w), &mut vertices)
                }
            }
            placed.push((skin, vertices));
            substrate = part.substrate();
        }
        let skins: Vec<SkinMesh> = placed
            .iter()
            .map(|(skin, vertices)| SkinMesh { vertices, triangles: skin.triangles() })
            .collect();
        let contact = TactileContact {
            wrench: PadWrench::from_patch(patch),
            skins: &skins,
            friction: patch_friction(patch).unwrap_or(self.robot.pads.static_mu),
            substrate: if placed.len() == 1 { substrate } else { None },
        };
        Ok(sensor.read(&contact, &mut self.touch)?)
    }

    /// Everything that is drawn.
    fn things(&self) -> Result<Vec<RenderObject>, CameraError> {
        let draw = |(index, part): (usize, &Part)| {
            let voxels = part.rest.as_ref().map(|rest| &rest.mesh);
            let (body, pose_in_body) = match part.body {
                BodyId::Soft(_) | BodyId::Rigid(_) => (part.body, Pose::identity()),
                BodyId::Link(_) => (part.body, part.offset),
                BodyId::World | BodyId::Kinematic(_) => (BodyId::World, part.start_w),
            };
            Ok(RenderObject {
                name: part.name.clone(),
                segmentation_id: index as u16 + 1,
                mesh: self.assets.model(&part.name, &part.asset, voxels)?,
                body,
                pose_in_body,
                casts_shadow: true,
            })
        };
        let mut things: Vec<RenderObject> =
            self.parts.iter().enumerate().map(draw).collect::<Result<_, _>>()?;
        things.extend(self.assets.robot()?.objects(self.articulation, self.scene.base_w, ROBOT));
        Ok(things)
    }
}

impl Part {
    /// Whether any point of a patch is its own.
    fn presses(&self, patch: &ContactPatch) -> bool {
        patch.points.iter().any(|point| match point.partner {
            ContactPartner::Soft(id) => self.body == BodyId::Soft(id),
            ContactPartner::Collider(id) => self.colliders.contains(&id),
        })
    }

    /// Compliance of a soft body to a gel in ridges too fine for its elements.
    fn substrate(&self) -> Option<SubstrateCompliance> {
        let (Body::Soft(material), Some(rest)) = (&self.asset.body, &self.rest) else { return None };
        let modulus = material.youngs_pa / (1.0 - material.poisson * material.poisson);
        Some(SubstrateCompliance { modulus, resolved: 2.0 * rest.mesh.edge })
    }
}

/// All that was to be seen of a rollout, to be drawn later.
#[derive(Debug)]
pub struct StateRecording {
    /// The sensors.
    pub sensors: SensorSuite,
    /// The settled state and the state after each control step.
    pub frames: Vec<Frame>,
    /// The target's deformation in each frame, % of the diagonal; `None` for a rigid one.
    pub d_pct: Vec<Option<f64>>,
}
