//! Cached images of the objects that stand still for cameras that do not move. Only pixels that moving objects shadow
//! or occlude are relit.

use super::{
    pass::{LitSurface, RenderPass},
    tile::{PixelTargets, ShadingSink, TILE_PIXELS, TileChannels, TileDisplay},
};
use crate::camera::{
    image::RenderedImage,
    math::{Bounds, LANES, V3, Vec3x8, bounds_of, f32x8},
    raster::TileSamples,
    shade::{
        occlusion::{OcclusionEllipsoid, sky_visibility},
        shading::DirectAndAmbient,
    },
};
use softvt_scene::Camera;

/// The background of a scene for one camera.
#[derive(Debug)]
pub(crate) struct CachedBackground {
    pub(crate) camera: Camera,
    /// The objects that it shows, by index.
    pub(crate) shown: Vec<bool>,
    pub(crate) tiles: Vec<BackgroundTile>,
    pub(crate) image: RenderedImage,
}

/// The objects that stand still in one tile.
#[derive(Debug)]
pub(crate) struct BackgroundTile {
    /// Mean display values without moving objects, 0..=255.
    pub(crate) display: TileChannels,
    /// Mean radiance from the key light.
    direct: TileChannels,
    /// Mean radiance from the sky.
    ambient: TileChannels,
    /// Position of the surface with the greatest share of the pixel, world, m.
    p: TileChannels,
    /// Unit normal of that surface; zero in the background.
    n: TileChannels,
    /// Share of the pixel that this surface has; emptied by [`finish`](Self::finish).
    max_share: Vec<f32>,
    /// Bounds of these surfaces in the world and in the frame of the moving shadows, inverted without any.
    bounds: [Bounds; 2],
    pub(crate) samples: TileSamples,
}

impl BackgroundTile {
    pub(crate) fn new() -> Self {
        Self {
            display: TileChannels::zeros(),
            direct: TileChannels::zeros(),
            ambient: TileChannels::zeros(),
            p: TileChannels::zeros(),
            n: TileChannels::zeros(),
            max_share: vec![0.0; TILE_PIXELS],
            bounds: [bounds_of([]); 2],
            samples: TileSamples::default(),
        }
    }

    /// Stores the samples and computes the bounds. To be called after all surfaces are added.
    pub(crate) fn finish(&mut self, pass: &RenderPass, samples: TileSamples) {
        self.samples = samples;
        self.max_share = Vec::new();
        let is_surface = |i: &usize| (0..3).any(|c| self.n.0[c][*i] != 0.0);
        let points = || (0..TILE_PIXELS).filter(is_surface).map(|i| V3::from_fn(|c, _| self.p.0[c][i]));
        let in_light_space = |p: V3| {
            let at = pass.in_light_space(Vec3x8::splat(&p));
            V3::from([at.u, at.v, at.height_above_ground].map(|x| x.to_array()[0]))
        };
        self.bounds = [bounds_of(points()), bounds_of(points().map(in_light_space))];
    }

    /// Finds the moving objects that may occlude the sky for this tile; `None` if they take no light from it at all.
    pub(crate) fn moving_occluders(&self, pass: &RenderPass) -> Option<Vec<OcclusionEllipsoid>> {
        let [world, light_space] = &self.bounds;
        let occluders: Vec<_> = pass.moving_occluders.iter().filter(|o| o.affects(world)).copied().collect();
        (!occluders.is_empty() || pass.moving_shadow.may_shade(light_space)).then_some(occluders)
    }

    /// Writes the display values in the shadow of moving objects and under `occluders`, except eights of pixels for
    /// which `is_covered` holds. Without `occluders`, no moving object takes light.
    pub(crate) fn relight(
        &self,
        pass: &RenderPass,
        occluders: Option<&[OcclusionEllipsoid]>,
        is_covered: impl Fn(usize) -> bool,
        display: &mut TileDisplay,
    ) {
        let tone_mapper = &pass.scene.tone_mapper;
        for first in (0..TILE_PIXELS).step_by(LANES).filter(|first| !is_covered(*first)) {
            let mut values = self.display.load(first);
            let Some(occluders) = occluders else {
                display.store(first, values);
                continue;
            };
            let (p, n) = (self.p.load(first), self.n.load(first));
            let at = pass.in_light_space(p);
            let key = pass.scene.illumination.key_visibility(&at, &n, pass.moving_shadow);
            // No object has the index −1: the surfaces stand still, the occluders do not.
            let sky = sky_visibility(occluders, p, n, f32x8::splat(-1.0));
            if (key.simd_lt(f32x8::ONE) | sky.simd_lt(f32x8::ONE)).any() {
                let (direct, ambient) = (self.direct.load(first), self.ambient.load(first));
                // The change is computed from the mean radiance and added to the antialiased display value.
                let change =
                    tone_mapper.display(direct * key + ambient * sky) - tone_mapper.display(direct + ambient);
                values = (values + change).map(|c| c.fast_max(f32x8::ZERO).fast_min(f32x8::splat(255.0)));
            }
            display.store(first, values);
        }
    }
}

impl ShadingSink for BackgroundTile {
    fn add(
        &mut self,
        pass: &RenderPass,
        radiance: DirectAndAmbient,
        surface: Option<LitSurface>,
        targets: &PixelTargets,
    ) {
        let display = pass.scene.tone_mapper.display(radiance.direct + radiance.ambient).to_arrays();
        let (direct, ambient) = (radiance.direct.to_arrays(), radiance.ambient.to_arrays());
        let surface = surface.map(|LitSurface { points, .. }| [points.p.to_arrays(), points.n.to_arrays()]);
        targets.for_each(|lane, pixel, share| {
            for c in 0..3 {
                self.display.0[c][pixel] += share * display[c][lane];
                self.direct.0[c][pixel] += share * direct[c][lane];
                self.ambient.0[c][pixel] += share * ambient[c][lane];
            }
            if let Some([p, n]) = surface.as_ref().filter(|_| share > self.max_share[pixel]) {
                for c in 0..3 {
                    (self.p.0[c][pixel], self.n.0[c][pixel]) = (p[c][lane], n[c][lane]);
                }
                self.max_share[pixel] = share;
            }
        });
    }
}
