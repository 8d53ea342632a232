//! The scene to be drawn: objects, their poses in a state, and the light.

use std::sync::{
    Arc, Mutex, OnceLock, PoisonError,
    atomic::{AtomicU64, Ordering},
};

use nalgebra::Matrix3;

use super::{
    error::CameraError,
    math::{Bounds, V3, bounds_of, is_finite},
    mesh::{
        lod::{Lod, NodeWeights, RelativeNormal, vertex_normals},
        render_mesh::RenderMesh,
    },
    shade::{shading::Illumination, shadow::ShadowMap, tonemap::ToneMapper},
};
use softvt_geometry::{Pose, Vec3};
use softvt_physics::BodyId;
use softvt_scene::{Lighting, MAX_OBJECTS};

/// Maximum radius of the wide shadow map, in radii of the fine one: beyond, it would be too coarse.
const MAX_WIDE_RADIUS: f32 = 8.0;

/// An object to be drawn.
#[derive(Clone, Debug)]
pub struct RenderObject {
    /// Name for error messages.
    pub name: String,
    /// Value of its pixels in segmentation images; 0 is the background.
    pub segmentation_id: u16,
    /// Triangles and materials, shared by all instances.
    pub mesh: Arc<RenderMesh>,
    /// The body that the object moves with. If it is a soft body, the mesh must be
    /// [attached](RenderMesh::from_soft_shape) to it. Kinematic bodies are not supported.
    pub body: BodyId,
    /// Pose of the object in the frame of the body, or in the world; ignored for soft bodies.
    pub pose_in_body: Pose,
    /// True if the object casts shadows.
    pub casts_shadow: bool,
}

impl RenderObject {
    /// True if the object is fixed in the world.
    pub(crate) fn is_fixed(&self) -> bool {
        self.body == BodyId::World
    }
}

/// All objects and the light of a scene, with everything that does not change during an episode precomputed.
///
/// One scene can be shared by several [`Renderer`](super::Renderer)s and threads.
#[derive(Debug)]
pub struct RenderScene {
    pub(crate) objects: Vec<RenderObject>,
    pub(crate) lighting: Lighting,
    rest: RestState,
    /// Levels of detail in the world of each fixed object, and of others at rest, posed on first use.
    still_meshes: PosedMeshes,
    /// Shadows of the fixed objects.
    pub(crate) fixed_shadow: Arc<ShadowMap>,
    /// Coarser shadows of fixed objects beyond the fine map, if there are any.
    pub(crate) wide_shadow: Option<ShadowMap>,
    /// Shadows of the objects that stood still in recent images, if others than the fixed ones did.
    still_shadows: Mutex<Vec<StillShadow>>,
    pub(crate) illumination: Illumination,
    pub(crate) tone_mapper: ToneMapper,
    /// Identifies the scene in the caches of renderers.
    pub(crate) id: u64,
}

/// The part of a [`WorldSnapshot`](softvt_physics::world::WorldSnapshot) that images depend on. The default
/// has no moving bodies.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameView<'a> {
    /// Node positions of each soft body, world, m.
    pub nodes: &'a [Vec<Vec3>],
    /// Poses of the rigid bodies, world.
    pub rigid: &'a [Pose],
    /// Link poses of each articulation, world.
    pub links: &'a [Vec<Pose>],
    /// Pose of the robot's hand, world, for cameras mounted on it.
    pub hand_w: Option<Pose>,
    /// Albedo at the nodes of each soft body, linear RGB, in place of its materials, which count
    /// where it is empty.
    pub node_colours: &'a [Vec<[f32; 3]>],
    /// Segmentation id of objects that are left out of the image, and of the shadows of what moves; 0 for none.
    pub hidden_id: u16,
}

/// A state in which bodies may stay for long, such as the settled one. While they do, images show them as they show
/// fixed objects, which takes less time. Bodies that it lacks are always drawn as moving ones.
#[derive(Clone, Debug, Default)]
pub struct RestState {
    /// Node positions of each soft body, world, m.
    pub nodes: Vec<Vec<Vec3>>,
    /// Poses of the rigid bodies, world.
    pub rigid: Vec<Pose>,
    /// Link poses of each articulation, world.
    pub links: Vec<Vec<Pose>>,
}

/// Maximum change of coordinates of bodies that are drawn at rest, m and of unit quaternions: a hundredth of a pixel of
/// the wrist camera at a distance of 3 cm.
const MAX_REST_DEVIATION: f64 = 1e-6;

impl RestState {
    fn view(&self) -> FrameView<'_> {
        FrameView { nodes: &self.nodes, rigid: &self.rigid, links: &self.links, ..FrameView::default() }
    }

    /// True if a body is in this state, up to [`MAX_REST_DEVIATION`].
    fn holds(&self, body: BodyId, view: &FrameView) -> bool {
        let is_near =
            |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= MAX_REST_DEVIATION);
        let is_same_pose = |rest: Option<&Pose>, now: Option<&Pose>| {
            rest.zip(now).is_some_and(|(rest, now)| {
                is_near(rest.translation.vector.as_slice(), now.translation.vector.as_slice())
                    && is_near(rest.rotation.coords.as_slice(), now.rotation.coords.as_slice())
            })
        };
        match body {
            BodyId::World | BodyId::Kinematic(_) => false,
            BodyId::Soft(id) => {
                let nodes = self.nodes.get(id.index()).zip(view.nodes.get(id.index()));
                nodes.is_some_and(|(rest, now)| {
                    let mut pairs = rest.iter().zip(now);
                    rest.len() == now.len() && pairs.all(|(a, b)| is_near(a.as_slice(), b.as_slice()))
                })
            }
            BodyId::Rigid(id) => is_same_pose(self.rigid.get(id.index()), view.rigid.get(id.index())),
            BodyId::Link(id) => {
                let link = |links: &[Vec<Pose>]| links.get(id.articulation.index())?.get(id.index).copied();
                is_same_pose(link(&self.links).as_ref(), link(view.links).as_ref())
            }
        }
    }
}

/// The shadows of objects that stand still.
#[derive(Debug)]
struct StillShadow {
    /// The objects that stand still, by index.
    is_still: Vec<bool>,
    map: Arc<ShadowMap>,
}

/// Number of sets of still objects whose shadows are kept.
const KEPT_SHADOWS: usize = 4;

impl RenderScene {
    /// Prepares a scene: poses its fixed objects and draws their shadow maps.
    ///
    /// # Errors
    /// A setting of the light is out of range, the pose of a fixed object is not finite, or there are
    /// more than 1000 objects.
    pub fn new(objects: Vec<RenderObject>, lighting: Lighting) -> Result<Self, CameraError> {
        Self::with_rest(objects, lighting, RestState::default())
    }

    /// As [`new`](Self::new), with a state in which bodies may stay.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_rest(
        objects: Vec<RenderObject>,
        lighting: Lighting,
        rest: RestState,
    ) -> Result<Self, CameraError> {
        check_light(&lighting)?;
        // Triangle ids have bits for about as many.
        if objects.len() > MAX_OBJECTS {
            return Err(CameraError::Mesh {
                name: "the scene".to_owned(),
                reason: format!("{} objects; at most {MAX_OBJECTS} can be drawn, join some", objects.len()),
            });
        }
        let still_meshes = PosedMeshes::new(&objects);
        let is_fixed: Vec<bool> = objects.iter().map(RenderObject::is_fixed).collect();
        let casters = still_meshes.casters(&objects, &is_fixed, &rest.view())?;
        let fixed = (0..objects.len()).filter(|&index| is_fixed[index]);
        let bounds =
            fixed.map(|index| still_meshes.get(&objects, index, objects[index].mesh.caster()?, &rest.view()));
        let bounds = bounds.collect::<Result<Vec<_>, _>>()?;
        let fixed_shadow = Arc::new(draw_shadow(ShadowMap::new(&lighting), &casters));
        let wide_shadow = wide_shadow_radius(&bounds, &lighting)
            .map(|radius| draw_shadow(ShadowMap::with_radius(&lighting, radius), &casters));
        // Relaxed: only uniqueness matters.
        static NEXT_ID: AtomicU64 = AtomicU64::new(0);
        Ok(Self {
            illumination: Illumination::new(&lighting),
            tone_mapper: ToneMapper::new(lighting.exposure),
            objects,
            lighting,
            rest,
            still_meshes,
            fixed_shadow,
            wide_shadow,
            still_shadows: Mutex::default(),
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
        })
    }

    /// The objects that stand still in a state, by index: those that are fixed, and those at rest. Objects at rest
    /// appear as moving ones where some are hidden or coloured by their nodes.
    pub(crate) fn still_objects(&self, view: &FrameView) -> Vec<bool> {
        let may_rest = view.hidden_id == 0 && view.node_colours.is_empty();
        let is_still = |o: &RenderObject| o.is_fixed() || may_rest && self.rest.holds(o.body, view);
        self.objects.iter().map(is_still).collect()
    }

    /// The shadows of the objects that stand still.
    pub(crate) fn still_shadow(&self, is_still: &[bool]) -> Result<Arc<ShadowMap>, CameraError> {
        if self.objects.iter().zip(is_still).all(|(object, is_still)| object.is_fixed() == *is_still) {
            return Ok(self.fixed_shadow.clone());
        }
        let mut kept = self.still_shadows.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(index) = kept.iter().position(|known| known.is_still == is_still) {
            // The last ones are kept longest.
            kept[index..].rotate_left(1);
            return Ok(kept[kept.len() - 1].map.clone());
        }
        let casters = self.still_meshes.casters(&self.objects, is_still, &self.rest.view())?;
        let map = Arc::new(draw_shadow(ShadowMap::new(&self.lighting), &casters));
        if kept.len() == KEPT_SHADOWS {
            kept.remove(0);
        }
        kept.push(StillShadow { is_still: is_still.to_vec(), map: map.clone() });
        Ok(map)
    }

    /// The objects, in the order in which they were given.
    pub fn objects(&self) -> &[RenderObject] {
        &self.objects
    }

    /// A level of detail of an object that stands still, in the world.
    pub(crate) fn still_mesh(&self, object: usize, level: usize) -> Result<Arc<PosedMesh>, CameraError> {
        self.still_meshes.get(&self.objects, object, level, &self.rest.view())
    }
}

fn draw_shadow(mut map: ShadowMap, casters: &[(Arc<PosedMesh>, &Lod)]) -> ShadowMap {
    map.draw(casters.iter().map(|(posed, lod)| (posed.positions.as_slice(), lod.triangles.as_slice())));
    map
}

/// Levels of detail of objects in one state, by object and level, posed on first use.
#[derive(Debug)]
pub(crate) struct PosedMeshes(Vec<Vec<OnceLock<Arc<PosedMesh>>>>);

impl PosedMeshes {
    pub(crate) fn new(objects: &[RenderObject]) -> Self {
        let levels = |object: &RenderObject| vec![OnceLock::new(); object.mesh.level_count()];
        Self(objects.iter().map(levels).collect())
    }

    /// Forgets the state.
    pub(crate) fn clear(&mut self) {
        self.0.iter_mut().flatten().for_each(|mesh| _ = mesh.take());
    }

    /// The objects that stand still and cast shadows, at the level of detail that does.
    fn casters<'a>(
        &self,
        objects: &'a [RenderObject],
        is_still: &[bool],
        rest: &FrameView,
    ) -> Result<Vec<(Arc<PosedMesh>, &'a Lod)>, CameraError> {
        let casters = objects.iter().enumerate().filter(|(i, object)| is_still[*i] && object.casts_shadow);
        let posed = |(index, object): (usize, &'a RenderObject)| {
            let level = object.mesh.caster()?;
            Ok((self.get(objects, index, level, rest)?, object.mesh.level(level)?))
        };
        casters.map(posed).collect()
    }

    /// A level of detail of an object; `state` is the same for all.
    pub(crate) fn get(
        &self,
        objects: &[RenderObject],
        index: usize,
        level: usize,
        state: &FrameView,
    ) -> Result<Arc<PosedMesh>, CameraError> {
        let (slot, object) = (&self.0[index][level], &objects[index]);
        if let Some(posed) = slot.get() {
            return Ok(posed.clone());
        }
        let posed = PosedMesh::new(object, object.mesh.level(level)?, state)?;
        Ok(slot.get_or_init(|| Arc::new(posed)).clone())
    }
}

/// Radius that contains all fixed objects, m, if the fine shadow map does not.
fn wide_shadow_radius(fixed: &[Arc<PosedMesh>], lighting: &Lighting) -> Option<f32> {
    let (centre, fine_radius) = (lighting.shadow_centre_w.cast::<f32>(), lighting.shadow_radius_m as f32);
    let positions = fixed.iter().flat_map(|posed| &posed.positions);
    let farthest = positions.map(|p| (p - centre).norm()).fold(0.0, f32::max);
    (farthest > fine_radius).then(|| farthest.min(MAX_WIDE_RADIUS * fine_radius))
}

/// Validates the settings of the light.
///
/// # Errors
/// The first setting that is out of range.
pub fn check_light(light: &Lighting) -> Result<(), CameraError> {
    let require = |is_valid: bool, field, expected, got: String| {
        if is_valid { Ok(()) } else { Err(CameraError::Light { field, expected, got }) }
    };
    // Comparisons with NaN are false.
    let (direction, centre) = (light.key.direction_w, light.shadow_centre_w);
    let is_valid = direction.norm() > 1e-9 && direction.norm().is_finite();
    require(is_valid, "direction", "a direction", format!("{:?}", direction.as_slice()))?;
    let softness = light.key.softness_rad;
    require((0.0..=0.5).contains(&softness), "softness", "0 to 0.5 rad", softness.to_string())?;
    for (field, values) in [
        ("colour", light.key.colour),
        ("sky_zenith", light.sky.zenith),
        ("sky_horizon", light.sky.horizon),
        ("sky_ground", light.sky.ground),
        ("strength", [light.key.strength; 3]),
        ("sky_strength", [light.sky.strength; 3]),
    ] {
        let is_valid = values.iter().all(|&x| x >= 0.0 && x.is_finite());
        require(is_valid, field, "numbers from 0", format!("{values:?}"))?;
    }
    for (field, expected, value) in [
        ("exposure", "a number above 0", light.exposure),
        ("shadow_radius_m", "a length above 0 m", light.shadow_radius_m),
    ] {
        require(value > 0.0 && value.is_finite(), field, expected, value.to_string())?;
    }
    let is_valid = centre.iter().all(|x| x.is_finite());
    require(is_valid, "shadow_centre_w", "a point", format!("{:?}", centre.as_slice()))
}

/// Vertices and normals of a level of detail in the world.
#[derive(Clone, Debug, Default)]
pub(crate) struct PosedMesh {
    pub(crate) positions: Vec<V3>,
    pub(crate) normals: Vec<V3>,
    /// Albedo in place of the materials'; empty for the materials.
    pub(crate) albedo: Vec<V3>,
    /// Bounds of the vertices.
    pub(crate) bounds: Bounds,
}

impl PosedMesh {
    /// Places a level of `object` as in the state `view`.
    fn new(object: &RenderObject, lod: &Lod, view: &FrameView) -> Result<Self, CameraError> {
        let fail = |reason: String| CameraError::State { name: object.name.clone(), reason };
        let body_w = match object.body {
            BodyId::World => None,
            BodyId::Rigid(id) => {
                let pose = view.rigid.get(id.index());
                Some(pose.ok_or_else(|| fail(format!("no rigid body {}", id.index())))?)
            }
            BodyId::Link(id) => {
                let articulation = id.articulation.index();
                let pose = view.links.get(articulation).and_then(|links| links.get(id.index));
                let missing = || fail(format!("no link {} of articulation {articulation}", id.index));
                Some(pose.ok_or_else(missing)?)
            }
            BodyId::Soft(id) => {
                let nodes = view.nodes.get(id.index());
                let nodes = nodes.ok_or_else(|| fail(format!("no soft body {}", id.index())))?;
                let colours = view.node_colours.get(id.index()).map_or(&[][..], Vec::as_slice);
                return Self::embedded(lod, nodes, colours).map_err(fail);
            }
            BodyId::Kinematic(_) => return Err(fail("no pose for this kind of body".to_owned())),
        };
        let pose_w = body_w.map_or(object.pose_in_body, |body_w| body_w * object.pose_in_body);
        if !is_finite(&pose_w) {
            return Err(fail("a pose that is not a number".to_owned()));
        }
        let rotation: Matrix3<f32> = pose_w.rotation.to_rotation_matrix().matrix().cast();
        let translation: V3 = pose_w.translation.vector.cast();
        let positions: Vec<V3> = lod.positions.iter().map(|p| rotation * p + translation).collect();
        Ok(Self {
            bounds: bounds_of(positions.iter().copied()),
            positions,
            normals: lod.normals.iter().map(|n| rotation * n).collect(),
            albedo: Vec::new(),
        })
    }

    /// Places a level that is embedded in a soft body with these nodes, and colours of them if there are any. An
    /// error is the reason why it cannot.
    fn embedded(lod: &Lod, nodes: &[Vec3], colours: &[[f32; 3]]) -> Result<Self, String> {
        if lod.embedding.len() != lod.positions.len() {
            return Err("nodes for it, but its mesh is not embedded in a soft body".to_owned());
        }
        if lod.embedding.iter().any(|vertex| vertex.nodes.iter().any(|&n| n as usize >= nodes.len())) {
            return Err(format!("{} nodes, fewer than its mesh refers to", nodes.len()));
        }
        if nodes.iter().any(|p| !p.iter().all(|x| x.is_finite())) {
            return Err("a node position that is not a number".to_owned());
        }
        let nodes: Vec<V3> = nodes.iter().map(|p| p.cast()).collect();
        let position = |vertex: &NodeWeights| {
            let mut p = V3::zeros();
            for (&node, weight) in vertex.nodes.iter().zip(&vertex.weights) {
                p += nodes[node as usize] * *weight;
            }
            p
        };
        let positions: Vec<V3> = lod.embedding.iter().map(position).collect();
        let mut normals = vertex_normals(&positions, &lod.triangles);
        if !lod.relative_normals.is_empty() {
            let resolve = |(v, relative): (usize, &RelativeNormal)| relative.resolve(v, &positions, &normals);
            normals = lod.relative_normals.iter().enumerate().map(resolve).collect();
        }
        let colour = |vertex: &NodeWeights| {
            let weighted = vertex.nodes.iter().zip(&vertex.weights);
            weighted.map(|(&node, weight)| V3::from(colours[node as usize]) * *weight).sum()
        };
        let albedo = match colours.len() == nodes.len() {
            true => lod.embedding.iter().map(colour).collect(),
            false => Vec::new(),
        };
        Ok(Self { bounds: bounds_of(positions.iter().copied()), positions, normals, albedo })
    }
}
