//! Everything that drawing one image needs: the posed objects, and the light on them.

use super::{interpolate::MeshInstance, moving::MovingObjects};
use crate::camera::{
    error::CameraError,
    lens::Lens,
    math::{Bounds, V3, Vec3x8, f32x8},
    raster::{TileBins, first_triangle_id, object_index, triangle_index},
    scene::{FrameView, RenderObject, RenderScene},
    shade::{
        occlusion::{OcclusionEllipsoid, sky_visibility},
        shading::{DirectAndAmbient, LightBySource, SurfaceSamples},
        shadow::{LightSpacePoints, ShadowMap},
    },
};
use softvt_physics::BodyId;

/// Maximum extent of objects that occlude the sky for others, m; larger ones are floors and walls.
const MAX_OCCLUDER_EXTENT: f32 = 0.35;
/// Factor on the bounding radius in the frustum test: finer levels may exceed the one that casts shadows a little.
const BOUNDS_MARGIN: f32 = 1.1;

/// An object of a scene in the state of an image.
pub(crate) struct PosedObject<'a> {
    pub(crate) object: &'a RenderObject,
    /// The level of detail that casts shadows.
    pub(crate) caster: MeshInstance<'a>,
    /// Bounds of this level, world, m.
    pub(crate) bounds: Bounds,
    /// The level of detail that the image shows; `None` if the object is out of view.
    pub(crate) drawn: Option<MeshInstance<'a>>,
    /// True if the object is left out of the image.
    pub(crate) is_hidden: bool,
    /// False if it is fixed or at rest.
    pub(crate) is_moving: bool,
}

impl<'a> PosedObject<'a> {
    /// Poses the level of detail that casts shadows, and the one for the distance from the camera.
    pub(crate) fn new(
        scene: &'a RenderScene,
        index: usize,
        is_still: bool,
        view: &FrameView,
        lens: &Lens,
        moving: &MovingObjects,
    ) -> Result<Self, CameraError> {
        let (object, is_moving) = (&scene.objects[index], !is_still);
        let mesh = &object.mesh;
        let pose = |level: usize| {
            let lod = mesh.level(level)?;
            let posed = match is_moving {
                true => moving.meshes.get(&scene.objects, index, level, view)?,
                false => scene.still_mesh(index, level)?,
            };
            Ok(MeshInstance { lod, posed })
        };
        let caster_level = mesh.caster()?;
        let caster = pose(caster_level)?;
        let bounds @ [low, high] = caster.posed.bounds;
        let (centre, radius) = ((low + high) * 0.5, 0.5 * (high - low).norm());
        let is_hidden = view.hidden_id != 0 && object.segmentation_id == view.hidden_id;
        let margin = (BOUNDS_MARGIN - 1.0) * radius;
        let is_in_view = || {
            lens.may_see(&centre, BOUNDS_MARGIN * radius) && lens.may_see_any(&caster.posed.positions, margin)
        };
        let drawn = if !is_hidden && is_in_view() {
            let pixel = (lens.depth(&centre) - radius).max(lens.near) / lens.focal;
            let level = mesh.coarsest_where(|lod| lod.is_fine_enough(pixel))?;
            Some(if level == caster_level { caster.clone() } else { pose(level)? })
        } else {
            None
        };
        Ok(Self { object, caster, bounds, drawn, is_hidden, is_moving })
    }

    /// True for small objects that cast shadows, except links of articulations.
    pub(crate) fn is_occluder(&self) -> bool {
        self.object.casts_shadow
            && !self.is_hidden
            && !matches!(self.object.body, BodyId::Link(_))
            && (self.bounds[1] - self.bounds[0]).max() < MAX_OCCLUDER_EXTENT
    }

    /// True if the triangles subtend a solid angle of 4π at a point (Van Oosterom & Strackee, 1983).
    pub(crate) fn contains(&self, point: &V3) -> bool {
        let [low, high] = &self.bounds;
        if (0..3).any(|axis| point[axis] < low[axis] || point[axis] > high[axis]) {
            return false;
        }
        let mut angle = 0.0_f64;
        for t in &self.caster.lod.triangles {
            let [a, b, c] = t.map(|v| (self.caster.posed.positions[v as usize] - point).cast::<f64>());
            let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
            let denominator = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            angle += 2.0 * a.dot(&b.cross(&c)).atan2(denominator);
        }
        // 4π inside and 0 outside, up to rounding.
        angle.abs() > std::f64::consts::TAU
    }
}

/// The inputs of one image.
pub(crate) struct RenderPass<'a> {
    pub(crate) scene: &'a RenderScene,
    pub(crate) lens: &'a Lens,
    pub(crate) objects: &'a [PosedObject<'a>],
    pub(crate) still_occluders: &'a [OcclusionEllipsoid],
    pub(crate) moving_occluders: &'a [OcclusionEllipsoid],
    pub(crate) still_shadow: &'a ShadowMap,
    pub(crate) moving_shadow: &'a ShadowMap,
    pub(crate) channels: Channels,
}

/// Channels of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Channels {
    /// Colour, depth and segmentation.
    All,
    /// Colour alone, which takes less time.
    Colours,
    /// Depth and segmentation alone, sampled at the centres of pixels: several times faster.
    Centres,
}

impl Channels {
    pub(crate) fn has_colours(self) -> bool {
        self != Self::Centres
    }

    pub(crate) fn has_centres(self) -> bool {
        self != Self::Colours
    }
}

/// Eight surface points, and the same in the frame of the fine shadow maps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitSurface<'a> {
    pub(crate) points: &'a SurfaceSamples,
    pub(crate) at: &'a LightSpacePoints,
}

/// Fractions of the light that objects leave.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visibility {
    pub(crate) key: f32x8,
    pub(crate) sky: f32x8,
}

impl RenderPass<'_> {
    /// Value of a triangle's object in segmentation images; 0 for none.
    pub(crate) fn segmentation_id(&self, id: u32) -> u16 {
        self.scene.objects.get(object_index(id)).map_or(0, |object| object.segmentation_id)
    }

    /// The smooth surface that a triangle belongs to: object and smoothing group; `None` for the background. Only
    /// samples of one surface are averaged before shading.
    pub(crate) fn surface(&self, id: u32) -> Option<[usize; 2]> {
        let mesh = self.objects.get(object_index(id))?.drawn.as_ref()?;
        Some([object_index(id), mesh.lod.smoothing_groups[triangle_index(id)] as usize])
    }

    /// Points of the world in the frame of the fine shadow maps.
    #[inline(always)]
    pub(crate) fn in_light_space(&self, p: Vec3x8) -> LightSpacePoints {
        self.moving_shadow.project(p)
    }

    /// Radiance of points that only still objects shadow and occlude.
    #[inline(always)]
    pub(crate) fn shade(&self, surface: &LitSurface) -> DirectAndAmbient {
        self.light(surface).radiance(surface.points.diffuse_albedo())
    }

    /// Light reflected by points that only still objects shadow and occlude.
    #[inline(always)]
    pub(crate) fn light(&self, &LitSurface { points, at }: &LitSurface) -> LightBySource {
        let to_eye = (Vec3x8::splat(&self.lens.eye) - points.p).normalized();
        let illumination = &self.scene.illumination;
        let LightBySource { direct, ambient } = illumination.reflect(points, to_eye);
        let (fine, wide) = (self.still_shadow, self.scene.wide_shadow.as_ref());
        let key = illumination.key_visibility_cascaded(points.p, at, &points.n, fine, wide);
        let sky = sky_visibility(self.still_occluders, points.p, points.n, points.object);
        LightBySource { direct: direct * key, ambient: ambient * sky }
    }

    /// Fractions of the key light and of the sky that moving objects leave.
    #[inline(always)]
    pub(crate) fn moving_visibility(&self, &LitSurface { points, at }: &LitSurface) -> Visibility {
        Visibility {
            key: self.scene.illumination.key_visibility(at, &points.n, self.moving_shadow),
            sky: sky_visibility(self.moving_occluders, points.p, points.n, points.object),
        }
    }

    /// Sorts the triangles of moving objects, still ones, or one kind after the other into tiles.
    pub(crate) fn bin(&self, kinds: &[bool], bins: &mut TileBins) {
        bins.clear(self.lens);
        for &is_moving in kinds {
            for (i, posed) in self.objects.iter().enumerate() {
                if let Some(mesh) = posed.drawn.as_ref().filter(|_| posed.is_moving == is_moving) {
                    let first_id = first_triangle_id(i, is_moving);
                    bins.add(self.lens, &mesh.posed.positions, &mesh.lod.triangles, first_id);
                }
            }
        }
        bins.sort();
    }
}
