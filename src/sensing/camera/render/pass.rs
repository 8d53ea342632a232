//! Everything that drawing one image needs: the visible meshes, and the light on them.

use super::interpolate::{MeshInstance, PixelRays};
use crate::sensing::camera::{
    lens::Lens,
    raster::{NO_TRIANGLE, binning::TileBins, first_triangle_id, object_index, triangle_index},
    scene::render_scene::RenderScene,
    shade::{
        occlusion::{OcclusionEllipsoid, sky_visibility},
        shading::{DirectAndAmbient, SurfaceSamples},
        shadow::ShadowMap,
    },
    simd::{Vec3x8, f32x8},
};

/// The inputs of one image.
pub(crate) struct RenderPass<'a> {
    pub(crate) scene: &'a RenderScene,
    pub(crate) lens: &'a Lens,
    pub(crate) rays: PixelRays,
    /// By object; `None` if it is out of view.
    pub(crate) instances: &'a [Option<MeshInstance<'a>>],
    pub(crate) fixed_occluders: &'a [OcclusionEllipsoid],
    pub(crate) moving_occluders: &'a [OcclusionEllipsoid],
    pub(crate) moving_shadow: &'a ShadowMap,
}

/// Identity of a smooth surface.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct SurfaceId {
    /// Index of the object; `usize::MAX` for the background.
    object: usize,
    smoothing_group: u32,
}

impl RenderPass<'_> {
    /// Adds the triangles of the moving objects, or of the fixed ones.
    pub(crate) fn bin_objects(&self, moving: bool, bins: &mut TileBins) {
        for (i, (object, instance)) in self.scene.objects.iter().zip(self.instances).enumerate() {
            if let Some(instance) = instance.as_ref().filter(|_| object.is_moving() == moving) {
                let first_id = first_triangle_id(i, moving);
                bins.add(self.lens, &instance.posed.positions, &instance.lod.triangles, first_id);
            }
        }
    }

    /// Value of a triangle's object in segmentation images; 0 for none.
    pub(crate) fn segmentation_id(&self, id: u32) -> u16 {
        if id == NO_TRIANGLE { 0 } else { self.scene.objects[object_index(id)].segmentation_id }
    }

    /// The smooth surface that a triangle belongs to. Only samples of one surface are averaged before shading.
    pub(crate) fn surface(&self, id: u32) -> SurfaceId {
        if id == NO_TRIANGLE {
            return SurfaceId { object: usize::MAX, smoothing_group: 0 };
        }
        let object = object_index(id);
        let group = self.instances[object].as_ref().map(|i| i.lod.smoothing_groups[triangle_index(id)]);
        SurfaceId { object, smoothing_group: group.unwrap_or(0) }
    }

    /// Radiance of points that only fixed objects shadow and occlude.
    #[inline(always)]
    pub(crate) fn shade_under_fixed(&self, samples: &SurfaceSamples) -> DirectAndAmbient {
        let to_eye = (Vec3x8::splat(&self.rays.eye) - samples.p).normalized();
        let illumination = &self.scene.illumination;
        let mut radiance = illumination.shade(samples, to_eye);
        let (fine, wide) = (&self.scene.fixed_shadow, self.scene.wide_shadow.as_ref());
        radiance.direct =
            radiance.direct * illumination.key_visibility_cascaded(samples.p, &samples.n, fine, wide);
        radiance.ambient =
            radiance.ambient * sky_visibility(self.fixed_occluders, samples.p, samples.n, samples.object);
        radiance
    }

    /// Fractions of the key light and of the sky that moving objects leave visible.
    #[inline(always)]
    pub(crate) fn visibility_under_moving(&self, samples: &SurfaceSamples) -> (f32x8, f32x8) {
        let key = self.scene.illumination.key_visibility(samples.p, &samples.n, self.moving_shadow);
        (key, sky_visibility(self.moving_occluders, samples.p, samples.n, samples.object))
    }

    /// Radiance of the background at eight points (x, y) of the image.
    pub(crate) fn background_radiance(&self, x: f32x8, y: f32x8) -> Vec3x8 {
        self.scene.illumination.sky_radiance(self.rays.direction_z(x, y))
    }
}
