//! One picture of one state: what is drawn, and the light on it.

use crate::sensing::camera::{
    Attachment, RenderScene,
    lens::Lens,
    raster::binning::TileBins,
    raster::sample_buffer::NONE,
    render::interpolate::{MOVING, MeshInstance, PixelRays, TRIANGLE_BITS, thing_of, triangle_of},
    shade::shading::{DirectAndAmbient, OcclusionEllipsoid, SurfaceSamples, open_sky},
    shade::shadow::ShadowMap,
    simd::{F8, V8},
};

/// What a pass needs to know.
pub(crate) struct RenderPass<'a> {
    pub stage: &'a RenderScene,
    pub lens: &'a Lens,
    pub rays: PixelRays,
    /// Each thing, or none if it is out of sight.
    pub drawn: &'a [Option<MeshInstance<'a>>],
    pub fixed_blobs: &'a [OcclusionEllipsoid],
    pub moving_blobs: &'a [OcclusionEllipsoid],
    pub moving_shadow: &'a ShadowMap,
}

impl RenderPass<'_> {
    /// Adds the triangles of the things that move, or of those that do not.
    pub(crate) fn show(&self, moving: bool, screen: &mut TileBins) {
        for (i, (thing, drawn)) in self.stage.objects.iter().zip(self.drawn).enumerate() {
            let moves = !matches!(thing.attachment, Attachment::Fixed(_));
            if let Some(drawn) = drawn.as_ref().filter(|_| moves == moving) {
                let first = (i as u32) << TRIANGLE_BITS | if moving { MOVING } else { 0 };
                screen.add(self.lens, &drawn.posed.positions, &drawn.level.triangles, first);
            }
        }
    }

    /// Object number of a triangle; 0 for none.
    pub(crate) fn object(&self, id: u32) -> u16 {
        if id == NONE { 0 } else { self.stage.objects[thing_of(id)].segmentation_id }
    }

    /// What tells surfaces apart that are not to be blended before they are lit.
    pub(crate) fn surface(&self, id: u32) -> (usize, u32) {
        if id == NONE {
            return (usize::MAX, 0);
        }
        let thing = thing_of(id);
        let patch = self.drawn[thing].as_ref().map(|drawn| drawn.level.patches[triangle_of(id)]);
        (thing, patch.unwrap_or(0))
    }

    /// Illumination from points under what is fixed.
    #[inline(always)]
    pub(crate) fn under_fixed(&self, points: &SurfaceSamples) -> DirectAndAmbient {
        let to_eye = (V8::splat(&self.rays.eye) - points.p).unit();
        let light = &self.stage.light;
        let mut split = light.split(points, to_eye);
        let (fine, wide) = (&self.stage.fixed_shadow, self.stage.wide_shadow.as_ref());
        split.direct = split.direct * light.unshadowed_afar(points.p, &points.n, fine, wide);
        split.ambient = split.ambient * open_sky(self.fixed_blobs, points.p, points.n, points.thing);
        split
    }

    /// Shares of the key light and of the sky that what moves leaves at points.
    #[inline(always)]
    pub(crate) fn under_moving(&self, points: &SurfaceSamples) -> (F8, F8) {
        let key = self.stage.light.unshadowed(points.p, &points.n, self.moving_shadow);
        (key, open_sky(self.moving_blobs, points.p, points.n, points.thing))
    }

    /// Radiance where nothing is, at eight pixels.
    pub(crate) fn nothing(&self, x: F8, y: F8) -> V8 {
        self.stage.light.sky(self.rays.up(x, y))
    }
}
