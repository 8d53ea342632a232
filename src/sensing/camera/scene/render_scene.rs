//! Objects and light of a scene, prepared for drawing.

use std::sync::Arc;

use super::pose::PosedMesh;
use crate::{
    geometry::{Pose, Vec3},
    physics::{BodyId, world::WorldSnapshot},
    scene::Lighting,
    sensing::camera::{
        CameraError, RenderMesh,
        shade::{shading::Illumination, shadow::ShadowMap, tonemap::ToneMapper},
    },
};

/// Maximum number of objects of a scene; triangle ids have bits for about as many.
const MAX_OBJECTS: usize = 1000;
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
    /// [embedded](RenderMesh::embedded_in) in it. Kinematic bodies are not supported.
    pub body: BodyId,
    /// Pose of the object in the frame of the body, or in the world; ignored for soft bodies.
    pub pose_in_body: Pose,
    /// True if the object casts shadows.
    pub casts_shadow: bool,
}

impl RenderObject {
    /// True unless the object is fixed in the world.
    pub(crate) fn is_moving(&self) -> bool {
        self.body != BodyId::World
    }
}

/// All objects and the light of a scene, with everything that does not change during an episode precomputed.
///
/// Immutable: one scene can be shared by several [`Renderer`](crate::sensing::camera::Renderer)s.
#[derive(Debug)]
pub struct RenderScene {
    pub(crate) objects: Vec<RenderObject>,
    pub(crate) lighting: Lighting,
    /// World-space levels of detail of each fixed object; empty for moving ones.
    pub(crate) fixed_meshes: Vec<Vec<PosedMesh>>,
    pub(crate) fixed_shadow: ShadowMap,
    /// Coarser shadows of fixed objects beyond the fine map, if there are any.
    pub(crate) wide_shadow: Option<ShadowMap>,
    pub(crate) illumination: Illumination,
    pub(crate) tone_mapper: ToneMapper,
    pub(crate) id: SceneId,
}

/// Identity of a scene. Caches hold a clone, so the address cannot be reused by another scene while they exist.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneId(Arc<()>);

impl PartialEq for SceneId {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// The part of a physics state that images depend on.
#[derive(Clone, Copy, Debug)]
pub struct FrameView<'a> {
    /// Node positions of each soft body, world, m.
    pub nodes: &'a [Vec<Vec3>],
    /// Poses of the rigid bodies, world.
    pub rigid: &'a [Pose],
    /// Link poses of each articulation, world.
    pub links: &'a [Vec<Pose>],
    /// Pose of the robot's hand, world, for cameras mounted on it.
    pub hand_w: Option<Pose>,
}

impl<'a> FrameView<'a> {
    /// Borrows the poses of `frame`.
    pub fn new(frame: &'a WorldSnapshot, hand_w: Option<Pose>) -> Self {
        Self { nodes: &frame.nodes, rigid: &frame.rigid, links: &frame.links, hand_w }
    }

    /// A state without moving bodies.
    pub fn empty() -> Self {
        Self { nodes: &[], rigid: &[], links: &[], hand_w: None }
    }
}

impl RenderScene {
    /// Prepares a scene: poses its fixed objects and draws their shadow maps.
    ///
    /// # Errors
    /// A setting of the light is out of range, the pose of a fixed object is not finite, or there are
    /// more than 1000 objects.
    pub fn new(objects: Vec<RenderObject>, lighting: Lighting) -> Result<Self, CameraError> {
        check_light(&lighting)?;
        if objects.len() > MAX_OBJECTS {
            return Err(CameraError::Mesh {
                name: "the scene".to_owned(),
                reason: format!("{} objects; at most {MAX_OBJECTS} can be drawn, join some", objects.len()),
            });
        }
        let mut fixed_meshes = Vec::new();
        for object in &objects {
            let posed = |lod| PosedMesh::rigid(lod, &object.pose_in_body, &object.name);
            let lods = if object.is_moving() { &[] } else { object.mesh.lods.as_slice() };
            fixed_meshes.push(lods.iter().map(posed).collect::<Result<Vec<_>, _>>()?);
        }
        let draw_shadows = |map| draw_fixed_shadows(&objects, &fixed_meshes, map);
        let fixed_shadow = draw_shadows(ShadowMap::new(&lighting));
        let wide_shadow = wide_shadow_radius(&fixed_meshes, &lighting)
            .map(|radius| draw_shadows(ShadowMap::with_radius(&lighting, radius)));
        Ok(Self {
            illumination: Illumination::new(&lighting),
            tone_mapper: ToneMapper::new(lighting.exposure),
            objects,
            lighting,
            fixed_meshes,
            fixed_shadow,
            wide_shadow,
            id: SceneId::default(),
        })
    }

    /// The objects, in drawing order.
    pub fn objects(&self) -> &[RenderObject] {
        &self.objects
    }
}

fn draw_fixed_shadows(
    objects: &[RenderObject],
    fixed_meshes: &[Vec<PosedMesh>],
    mut map: ShadowMap,
) -> ShadowMap {
    for (object, posed) in objects.iter().zip(fixed_meshes).filter(|(object, _)| object.casts_shadow) {
        if let (Some(lod), Some(posed)) = (object.mesh.lods.first(), posed.first()) {
            map.draw(&posed.positions, &lod.triangles);
        }
    }
    map.finish();
    map
}

/// Radius that contains all fixed objects, m, if the fine shadow map does not.
fn wide_shadow_radius(fixed_meshes: &[Vec<PosedMesh>], lighting: &Lighting) -> Option<f32> {
    let (centre, fine_radius) = (lighting.shadow_centre_w.cast::<f32>(), lighting.shadow_radius_m as f32);
    let positions = fixed_meshes.iter().filter_map(|lods| lods.last()).flat_map(|posed| &posed.positions);
    let farthest = positions.map(|p| (p - centre).norm()).fold(0.0, f32::max);
    (farthest > fine_radius).then(|| farthest.min(MAX_WIDE_RADIUS * fine_radius))
}

/// Validates the settings of the light.
///
/// # Errors
/// The first setting that is out of range.
pub fn check_light(light: &Lighting) -> Result<(), CameraError> {
    let fail = |field, expected, got: String| Err(CameraError::Light { field, expected, got });
    let direction = light.key.direction_w;
    if !(direction.norm() > 1e-9 && direction.norm().is_finite()) {
        return fail("direction", "a direction", format!("{:?}", direction.as_slice()));
    }
    if !(0.0..=0.5).contains(&light.key.softness_rad) {
        return fail("softness", "0 to 0.5 rad", light.key.softness_rad.to_string());
    }
    let is_valid = |x: f64| x >= 0.0 && x.is_finite();
    for (field, values) in [
        ("colour", light.key.colour),
        ("sky_zenith", light.sky.zenith),
        ("sky_horizon", light.sky.horizon),
        ("sky_ground", light.sky.ground),
        ("strength", [light.key.strength; 3]),
        ("sky_strength", [light.sky.strength; 3]),
    ] {
        if !values.into_iter().all(is_valid) {
            return fail(field, "numbers from 0", format!("{values:?}"));
        }
    }
    if !(light.exposure > 0.0 && light.exposure.is_finite()) {
        return fail("exposure", "a number above 0", light.exposure.to_string());
    }
    if !(light.shadow_radius_m > 0.0 && light.shadow_radius_m.is_finite()) {
        return fail("shadow_radius_m", "a length above 0 m", light.shadow_radius_m.to_string());
    }
    if !light.shadow_centre_w.iter().all(|x| x.is_finite()) {
        return fail("shadow_centre_w", "a point", format!("{:?}", light.shadow_centre_w.as_slice()));
    }
    Ok(())
}
