//! What can be seen: things, how they move, and the light on them.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use crate::sensing::camera::{
    CameraError, RenderMesh, scene::pose::PosedMesh, shade::shading::Illumination, shade::shadow::ShadowMap,
    shade::tonemap::ToneMapper,
};
use crate::{
    geometry::{Pose, Vec3},
    physics::world::Frame,
    scene::Lighting,
};

/// What moves a thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Attachment {
    /// Nothing: it stands here in the world.
    Fixed(Pose),
    /// A rigid body, by its index in the state.
    Rigid(usize),
    /// A link of a tree of joints.
    Link {
        /// Index of the tree.
        tree: usize,
        /// Index of the link in it.
        link: usize,
        /// Frame of the thing in the link's.
        offset: Pose,
    },
    /// The nodes of a soft body, by its index; the model must be [`RenderMesh::embedded`].
    Soft(usize),
}

/// One thing to be drawn.
#[derive(Clone, Debug)]
pub struct RenderObject {
    /// Name for error messages.
    pub name: String,
    /// Value of its pixels in segmentation images; 0 is the background.
    pub segmentation_id: u16,
    /// Triangles and materials, shared by all instances.
    pub mesh: Arc<RenderMesh>,
    /// What the object moves with.
    pub attachment: Attachment,
    /// True if the object casts shadows.
    pub casts_shadow: bool,
}

/// All things and the light: immutable, shared by all frames of an episode.
#[derive(Debug)]
pub struct RenderScene {
    pub(crate) objects: Vec<RenderObject>,
    pub(crate) lighting: Lighting,
    /// World forms of the levels of fixed things (empty for others).
    pub(crate) fixed: Vec<Vec<PosedMesh>>,
    pub(crate) fixed_shadow: ShadowMap,
    /// Coarser, for what lies beyond.
    pub(crate) wide_shadow: Option<ShadowMap>,
    pub(crate) light: Illumination,
    pub(crate) tone: ToneMapper,
    /// Tells caches of one stage from those of another.
    pub(crate) key: u64,
}

/// The part of a state that pictures depend on.
#[derive(Clone, Copy, Debug)]
pub struct FrameView<'a> {
    /// Node positions of each soft body, m, world.
    pub nodes: &'a [Vec<Vec3>],
    /// Frames of the rigid bodies, world.
    pub rigid: &'a [Pose],
    /// Link frames of each tree, world.
    pub links: &'a [Vec<Pose>],
    /// The hand frame, world, for cameras mounted there.
    pub hand_w: Option<Pose>,
}

impl<'a> FrameView<'a> {
    /// What pictures need of `frame`, and the hand frame.
    pub fn new(frame: &'a Frame, hand_w: Option<Pose>) -> Self {
        Self { nodes: &frame.nodes, rigid: &frame.rigid, links: &frame.links, hand_w }
    }

    /// Nothing that moves.
    pub fn empty() -> Self {
        Self { nodes: &[], rigid: &[], links: &[], hand_w: None }
    }
}

static NEXT_KEY: AtomicU64 = AtomicU64::new(0);

impl RenderScene {
    /// Gathers things and light, and works out what never changes.
    ///
    /// # Errors
    /// If a number of the light is out of range, a fixed thing's pose is not finite, or there are more than 1000 things.
    pub fn new(objects: Vec<RenderObject>, lighting: Lighting) -> Result<Self, CameraError> {
        check_light(&lighting)?;
        if objects.len() > 1000 {
            return Err(CameraError::RenderMesh {
                name: "the stage".to_owned(),
                reason: format!("{} things; at most 1000 can be drawn, join some", objects.len()),
            });
        }
        let mut fixed = Vec::new();
        for thing in &objects {
            let levels = match &thing.attachment {
                Attachment::Fixed(pose) => {
                    let world = |level| PosedMesh::rigid(level, pose, &thing.name);
                    thing.mesh.levels.iter().map(world).collect::<Result<Vec<_>, _>>()?
                }
                _ => Vec::new(),
            };
            fixed.push(levels);
        }
        let shadow = |map| fixed_shadow(&objects, &fixed, map);
        let fine = shadow(ShadowMap::new(&lighting));
        let wide = wide_radius(&fixed, &lighting).map(|radius| shadow(ShadowMap::around(&lighting, radius)));
        let (light, tone) = (Illumination::new(&lighting), ToneMapper::new(lighting.exposure));
        let key = NEXT_KEY.fetch_add(1, Ordering::Relaxed);
        Ok(Self { objects, lighting, fixed, fixed_shadow: fine, wide_shadow: wide, light, tone, key })
    }

    /// The things, in the order of their drawing.
    pub fn objects(&self) -> &[RenderObject] {
        &self.objects
    }
}

/// The shadows of fixed things.
fn fixed_shadow(things: &[RenderObject], fixed: &[Vec<PosedMesh>], mut map: ShadowMap) -> ShadowMap {
    for (thing, posed) in things.iter().zip(fixed).filter(|(thing, _)| thing.casts_shadow) {
        if let (Some(level), Some(posed)) = (thing.mesh.levels.first(), posed.first()) {
            map.draw(&posed.positions, &level.triangles);
        }
    }
    map.finish();
    map
}

/// The wide shadow map reaches no farther than this, in radii of the fine one: it would get too coarse.
const WIDEST: f32 = 8.0;

/// How far fixed things lie about the middle of the shadows, m, if that is farther than the fine map goes.
fn wide_radius(fixed: &[Vec<PosedMesh>], lighting: &Lighting) -> Option<f32> {
    let (middle, fine) = (lighting.shadow_centre_w.cast::<f32>(), lighting.shadow_radius_m as f32);
    let all = fixed.iter().filter_map(|levels| levels.last()).flat_map(|posed| &posed.positions);
    let farthest = all.map(|p| (p - middle).norm()).fold(0.0, f32::max);
    (farthest > fine).then(|| farthest.min(WIDEST * fine))
}

/// Checks the numbers of the light.
///
/// # Errors
/// The first that is out of its range.
pub fn check_light(light: &Lighting) -> Result<(), CameraError> {
    let wrong = |field, expected, got: String| Err(CameraError::Light { field, expected, got });
    let direction = light.key.direction_w;
    if !(direction.norm() > 1e-9 && direction.norm().is_finite()) {
        return wrong("direction", "a direction", format!("{:?}", direction.as_slice()));
    }
    if !(0.0..=0.5).contains(&light.key.softness_rad) {
        return wrong("softness", "0 to 0.5 rad", light.key.softness_rad.to_string());
    }
    let positive = |x: f64| x >= 0.0 && x.is_finite();
    for (field, values) in [
        ("colour", light.key.colour),
        ("sky_zenith", light.sky.zenith),
        ("sky_horizon", light.sky.horizon),
        ("sky_ground", light.sky.ground),
        ("strength", [light.key.strength; 3]),
        ("sky_strength", [light.sky.strength; 3]),
    ] {
        if !values.into_iter().all(positive) {
            return wrong(field, "numbers from 0", format!("{values:?}"));
        }
    }
    if !(light.exposure > 0.0 && light.exposure.is_finite()) {
        return wrong("exposure", "a number above 0", light.exposure.to_string());
    }
    if !(light.shadow_radius_m > 0.0 && light.shadow_radius_m.is_finite()) {
        return wrong("shadow_radius_m", "a length above 0 m", light.shadow_radius_m.to_string());
    }
    if !light.shadow_centre_w.iter().all(|x| x.is_finite()) {
        return wrong("shadow_centre_w", "a point", format!("{:?}", light.shadow_centre_w.as_slice()));
    }
    Ok(())
}
