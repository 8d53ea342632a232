//! Cached images of the fixed objects for cameras that do not move. Only pixels that moving objects shadow
//! or occlude are relit.

use super::{
    pass::RenderPass,
    tile::{PixelTargets, ShadingSink, TILE_PIXELS, TileDisplay, TileSamples},
};
use crate::{
    scene::Camera,
    sensing::camera::{
        RenderedImage,
        math::V3,
        scene::render_scene::SceneId,
        shade::{
            occlusion::{OcclusionEllipsoid, sky_visibility},
            shading::SurfaceSamples,
            shadow::LightSpaceBounds,
        },
        simd::{LANES, Vec3x8, f32x8},
    },
};

/// The background of one scene for one camera.
#[derive(Debug)]
pub(crate) struct CachedBackground {
    pub(crate) scene: SceneId,
    pub(crate) camera: Camera,
    pub(crate) tiles: Vec<BackgroundTile>,
    pub(crate) image: RenderedImage,
}

/// Three values per pixel of a tile, by channel.
type Channels = [Vec<f32>; 3];

/// The fixed objects in one tile.
#[derive(Clone, Debug)]
pub(crate) struct BackgroundTile {
    /// Mean display values, 0..=255.
    display: Channels,
    /// Mean radiance from the key light.
    direct: Channels,
    /// Mean radiance from the sky.
    ambient: Channels,
    /// Position of the surface with the greatest share of the pixel, world, m.
    p: Channels,
    /// Unit normal of that surface; zero in the background.
    n: Channels,
    /// Share of the pixel that this surface has; emptied by [`finish`](Self::finish).
    max_share: Vec<f32>,
    bounds: Option<TileBounds>,
    pub(crate) samples: TileSamples,
}

/// Bounds of all surface points of a tile.
#[derive(Clone, Copy, Debug)]
struct TileBounds {
    /// Lowest and highest corner, world.
    world: [V3; 2],
    light_space: LightSpaceBounds,
}

/// Moving objects that may take light from a tile.
pub(crate) struct MovingOcclusion {
    may_shadow: bool,
    occluders: Vec<OcclusionEllipsoid>,
}

impl MovingOcclusion {
    const NONE: Self = Self { may_shadow: false, occluders: Vec::new() };

    pub(crate) fn is_none(&self) -> bool {
        !self.may_shadow && self.occluders.is_empty()
    }
}

fn zeros() -> Channels {
    std::array::from_fn(|_| vec![0.0; TILE_PIXELS])
}

/// Loads eight pixels from `first` on.
fn load(channels: &Channels, first: usize) -> Vec3x8 {
    let lanes = |c: usize| channels[c][first..].first_chunk::<LANES>().copied().unwrap_or_default();
    Vec3x8::from_arrays(&[lanes(0), lanes(1), lanes(2)])
}

impl BackgroundTile {
    pub(crate) fn new() -> Self {
        Self {
            display: zeros(),
            direct: zeros(),
            ambient: zeros(),
            p: zeros(),
            n: zeros(),
            max_share: vec![0.0; TILE_PIXELS],
            bounds: None,
            samples: TileSamples::default(),
        }
    }

    /// Stores the samples and computes the bounds. To be called after all surfaces are added.
    pub(crate) fn finish(&mut self, pass: &RenderPass, samples: &TileSamples) {
        self.samples = samples.clone();
        self.max_share = Vec::new();
        for i in (0..TILE_PIXELS).filter(|&i| (0..3).any(|c| self.n[c][i] != 0.0)) {
            let p = V3::new(self.p[0][i], self.p[1][i], self.p[2][i]);
            let at = pass.moving_shadow.project(Vec3x8::splat(&p));
            let [u, v, height] = [at.u, at.v, at.height_above_ground].map(|x| x.to_array()[0]);
            let point = TileBounds {
                world: [p, p],
                light_space: LightSpaceBounds { low: [u, v], high: [u, v], min_height: height },
            };
            self.bounds = Some(self.bounds.map_or(point, |bounds| bounds.union(&point)));
        }
    }

    /// Finds the moving objects that may take light from this tile.
    pub(crate) fn moving_occlusion(&self, pass: &RenderPass) -> MovingOcclusion {
        let Some(bounds) = &self.bounds else { return MovingOcclusion::NONE };
        MovingOcclusion {
            may_shadow: pass.moving_shadow.may_shade(&bounds.light_space),
            occluders: pass.moving_occluders.iter().filter(|o| o.affects(&bounds.world)).copied().collect(),
        }
    }

    /// Writes the display values without moving objects.
    pub(crate) fn copy_display(&self, display: &mut TileDisplay) {
        for first in (0..TILE_PIXELS).step_by(LANES) {
            display.set_row(first, load(&self.display, first));
        }
    }

    /// Writes the display values under `occlusion`, except eights of pixels for which `is_covered` holds.
    pub(crate) fn relight(
        &self,
        pass: &RenderPass,
        occlusion: &MovingOcclusion,
        is_covered: impl Fn(usize) -> bool,
        display: &mut TileDisplay,
    ) {
        let tone_mapper = &pass.scene.tone_mapper;
        for first in (0..TILE_PIXELS).step_by(LANES).filter(|first| !is_covered(*first)) {
            let mut values = load(&self.display, first);
            if occlusion.is_none() {
                display.set_row(first, values);
                continue;
            }
            let (p, n) = (load(&self.p, first), load(&self.n, first));
            let key = if occlusion.may_shadow {
                pass.scene.illumination.key_visibility(p, &n, pass.moving_shadow)
            } else {
                f32x8::ONE
            };
            // No object has the index −1: the surfaces are fixed, the occluders are not.
            let sky = sky_visibility(&occlusion.occluders, p, n, f32x8::splat(-1.0));
            if (key.simd_lt(f32x8::ONE) | sky.simd_lt(f32x8::ONE)).any() {
                let (direct, ambient) = (load(&self.direct, first), load(&self.ambient, first));
                // The change is computed from the mean radiance and added to the antialiased display value.
                let change =
                    tone_mapper.display(direct * key + ambient * sky) - tone_mapper.display(direct + ambient);
                values = (values + change).map(|c| c.fast_max(f32x8::ZERO).fast_min(f32x8::splat(255.0)));
            }
            display.set_row(first, values);
        }
    }
}

impl TileBounds {
    fn union(&self, other: &Self) -> Self {
        let (a, b) = (&self.light_space, &other.light_space);
        Self {
            world: [self.world[0].inf(&other.world[0]), self.world[1].sup(&other.world[1])],
            light_space: LightSpaceBounds {
                low: std::array::from_fn(|i| a.low[i].min(b.low[i])),
                high: std::array::from_fn(|i| a.high[i].max(b.high[i])),
                min_height: a.min_height.min(b.min_height),
            },
        }
    }
}

impl ShadingSink for BackgroundTile {
    fn begin_pixel(&mut self, _pixel: usize) {}

    fn add_surface(&mut self, pass: &RenderPass, samples: &SurfaceSamples, targets: &PixelTargets) {
        let radiance = pass.shade_under_fixed(samples);
        let display = pass.scene.tone_mapper.display(radiance.direct + radiance.ambient).to_arrays();
        let (direct, ambient) = (radiance.direct.to_arrays(), radiance.ambient.to_arrays());
        let (p, n) = (samples.p.to_arrays(), samples.n.to_arrays());
        for target in targets.lanes() {
            let (lane, pixel, share) = (target.lane, target.pixel, target.share);
            let is_largest = share > self.max_share[pixel];
            for c in 0..3 {
                self.display[c][pixel] += share * display[c][lane];
                self.direct[c][pixel] += share * direct[c][lane];
                self.ambient[c][pixel] += share * ambient[c][lane];
                if is_largest {
                    (self.p[c][pixel], self.n[c][pixel]) = (p[c][lane], n[c][lane]);
                }
            }
            self.max_share[pixel] = self.max_share[pixel].max(share);
        }
    }

    fn add_background(&mut self, pass: &RenderPass, radiance: Vec3x8, targets: &PixelTargets) {
        let display = pass.scene.tone_mapper.display(radiance).to_arrays();
        let radiance = radiance.to_arrays();
        for target in targets.lanes() {
            let (lane, pixel, share) = (target.lane, target.pixel, target.share);
            for c in 0..3 {
                self.display[c][pixel] += share * display[c][lane];
                self.ambient[c][pixel] += share * radiance[c][lane];
            }
        }
    }
}
