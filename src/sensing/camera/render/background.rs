//! What does not move, seen by a camera that does not move either: drawn once, then only re-lit where something new hides
//! its light.

use crate::scene::Camera;
use crate::sensing::camera::{
    RenderedImage, V3,
    raster::sample_buffer::{ROWS, SampleBuffer},
    render::pass::RenderPass,
    render::tile::{PIXELS, PixelTargets, ShadingSink, TileDisplay},
    shade::shading::{OcclusionEllipsoid, SurfaceSamples, open_sky},
    simd::{F8, LANES, V8},
};

/// The background of one stage for one camera.
#[derive(Debug)]
pub(crate) struct CachedBackground {
    pub stage: u64,
    pub camera: Camera,
    pub tiles: Vec<BackgroundTile>,
    pub picture: RenderedImage,
}

/// What the pixels of a tile of the background show, by channel.
#[derive(Clone, Debug)]
pub(crate) struct BackgroundTile {
    /// Mean display value, 0..=255.
    display: [Vec<f32>; 3],
    /// Mean light from the key light and from the sky.
    direct: [Vec<f32>; 3],
    ambient: [Vec<f32>; 3],
    /// World, m, of the surface with the greatest share.
    p: [Vec<f32>; 3],
    /// Its unit normal; zero where nothing is.
    n: [Vec<f32>; 3],
    /// Greatest share so far.
    most: Vec<f32>,
    /// Box around all points, and what it is in the shadow maps: least and greatest texel, least height.
    bounds: [V3; 2],
    texels: [[f32; 2]; 2],
    least: f32,
    /// Reciprocal depths and numbers of triangles.
    pub samples: SampleBuffer<ROWS>,
}

fn channels() -> [Vec<f32>; 3] {
    std::array::from_fn(|_| vec![0.0; PIXELS])
}

fn eight(of: &[Vec<f32>; 3], first: usize) -> V8 {
    let one = |c: usize| of[c][first..].first_chunk::<LANES>().copied().unwrap_or_default();
    V8::from_arrays(&[one(0), one(1), one(2)])
}

impl BackgroundTile {
    pub(crate) fn new() -> Self {
        Self {
            display: channels(),
            direct: channels(),
            ambient: channels(),
            p: channels(),
            n: channels(),
            most: vec![0.0; PIXELS],
            bounds: [V3::repeat(f32::MAX), V3::repeat(f32::MIN)],
            texels: [[f32::MAX; 2], [f32::MIN; 2]],
            least: f32::MAX,
            samples: SampleBuffer::default(),
        }
    }

    /// To be called when all is drawn; keeps the samples.
    pub(crate) fn finish(&mut self, pass: &RenderPass, samples: &SampleBuffer<ROWS>) {
        self.samples = samples.clone();
        self.most = Vec::new();
        for i in (0..PIXELS).filter(|&i| (0..3).any(|c| self.n[c][i] != 0.0)) {
            let p = V3::new(self.p[0][i], self.p[1][i], self.p[2][i]);
            self.bounds = [self.bounds[0].inf(&p), self.bounds[1].sup(&p)];
            let at = pass.moving_shadow.places(V8::splat(&p));
            let (u, v) = (at.u.to_array()[0], at.v.to_array()[0]);
            self.texels = [
                [self.texels[0][0].min(u), self.texels[0][1].min(v)],
                [self.texels[1][0].max(u), self.texels[1][1].max(v)],
            ];
            self.least = self.least.min(at.level.to_array()[0]);
        }
    }

    /// Whether what moves takes light from any of it, and the blobs that do.
    pub(crate) fn hidden_by(&self, pass: &RenderPass) -> (bool, Vec<OcclusionEllipsoid>) {
        if self.least == f32::MAX {
            return (false, Vec::new());
        }
        let blobs = pass.moving_blobs.iter().filter(|blob| blob.reaches(&self.bounds)).copied();
        (pass.moving_shadow.may_shade(self.texels[0], self.texels[1], self.least), blobs.collect())
    }

    /// TileDisplay values under what moves, but for eights of pixels of which `skipped` says that they are covered by it.
    pub(crate) fn relight(
        &self,
        pass: &RenderPass,
        (shaded, blobs): &(bool, Vec<OcclusionEllipsoid>),
        skipped: impl Fn(usize) -> bool,
        display: &mut TileDisplay,
    ) {
        let tone = &pass.stage.tone;
        for first in (0..PIXELS).step_by(LANES).filter(|first| !skipped(*first)) {
            let mut shown = eight(&self.display, first);
            if !shaded && blobs.is_empty() {
                display.set(first, shown);
                continue;
            }
            let (p, n) = (eight(&self.p, first), eight(&self.n, first));
            let key = if *shaded { pass.stage.light.unshadowed(p, &n, pass.moving_shadow) } else { F8::ONE };
            let open = open_sky(blobs, p, n, F8::splat(-1.0));
            if (key.simd_lt(F8::ONE) | open.simd_lt(F8::ONE)).any() {
                let (direct, ambient) = (eight(&self.direct, first), eight(&self.ambient, first));
                let change = tone.display(direct * key + ambient * open) - tone.display(direct + ambient);
                shown = (shown + change).map(|c| c.fast_max(F8::ZERO).fast_min(F8::splat(255.0)));
            }
            display.set(first, shown);
        }
    }
}

impl ShadingSink for BackgroundTile {
    fn points(&mut self, pass: &RenderPass, points: &SurfaceSamples, goal: &PixelTargets) {
        let split = pass.under_fixed(points);
        let display = pass.stage.tone.display(split.direct + split.ambient).to_arrays();
        let (direct, ambient) = (split.direct.to_arrays(), split.ambient.to_arrays());
        let (p, n) = (points.p.to_arrays(), points.n.to_arrays());
        for (lane, pixel, share) in goal.each() {
            let first = share > self.most[pixel];
            for c in 0..3 {
                self.display[c][pixel] += share * display[c][lane];
                self.direct[c][pixel] += share * direct[c][lane];
                self.ambient[c][pixel] += share * ambient[c][lane];
                if first {
                    (self.p[c][pixel], self.n[c][pixel]) = (p[c][lane], n[c][lane]);
                }
            }
            self.most[pixel] = self.most[pixel].max(share);
        }
    }

    fn nothing(&mut self, pass: &RenderPass, radiance: V8, goal: &PixelTargets) {
        let display = pass.stage.tone.display(radiance).to_arrays();
        let radiance = radiance.to_arrays();
        for (lane, pixel, share) in goal.each() {
            for c in 0..3 {
                self.display[c][pixel] += share * display[c][lane];
                self.ambient[c][pixel] += share * radiance[c][lane];
            }
        }
    }

    fn begin(&mut self, _pixel: usize) {}
}
