//! Draws one tile of an image: rasterises its triangles, then shades each visible surface once per pixel.

use wide::u32x8;

use super::{
    interpolate::{RowSamples, ShadingBatch, TriangleInterpolator},
    pass::{LitSurface, RenderPass, Visibility},
    rows::{ShadedRows, is_close, is_near, mix, mix_vectors, shade_rows},
};
use crate::camera::{
    image::RenderedImage,
    lens::Lens,
    math::{LANE_INDEX, LANES, Vec3x8, f32x8, floor_to_u32},
    raster::{
        MOVING_FLAG, NO_TRIANGLE, SAMPLE_OFFSETS, SAMPLES_PER_PIXEL, TILE_EDGE, TileSamples, object_index,
    },
    shade::shading::{DirectAndAmbient, LightBySource, ReflectedLight},
};

/// Maximum difference of roughness at which specular light is interpolated between rows.
const MAX_ROUGHNESS_DEVIATION: f32 = 0.04;

/// Some samples of a pixel.
#[derive(Clone, Copy)]
struct SampleGroup {
    /// Their mean position within the pixel.
    mean: [f32; 2],
    /// The one that is nearest to it.
    nearest: usize,
}

/// All groups of samples, by the bit mask of their members.
const SAMPLE_GROUPS: [SampleGroup; 1 << SAMPLES_PER_PIXEL] = {
    let mut groups = [SampleGroup { mean: [0.0; 2], nearest: 0 }; 1 << SAMPLES_PER_PIXEL];
    let mut members = 1;
    while members < groups.len() {
        let (mut mean, mut count) = ([0.0, 0.0], 0.0);
        let mut sample = 0;
        while sample < SAMPLES_PER_PIXEL {
            if members >> sample & 1 == 1 {
                mean = [mean[0] + SAMPLE_OFFSETS[sample][0], mean[1] + SAMPLE_OFFSETS[sample][1]];
                count += 1.0;
            }
            sample += 1;
        }
        mean = [mean[0] / count, mean[1] / count];
        let (mut nearest, mut least, mut sample) = (0, f32::MAX, 0);
        while sample < SAMPLES_PER_PIXEL {
            let [u, v] = SAMPLE_OFFSETS[sample];
            let distance2 = (u - mean[0]) * (u - mean[0]) + (v - mean[1]) * (v - mean[1]);
            if members >> sample & 1 == 1 && distance2 < least {
                (nearest, least) = (sample, distance2);
            }
            sample += 1;
        }
        groups[members] = SampleGroup { mean, nearest };
        members += 1;
    }
    groups
};

/// Number of pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE_EDGE * TILE_EDGE;

/// Pixels of a tile that eight lanes contribute to, and the share of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelTargets {
    pixel: [u32; LANES],
    share: [f32; LANES],
    count: usize,
    /// True if the lanes are whole pixels in a row.
    is_row: bool,
}

impl PixelTargets {
    #[inline(always)]
    fn row(first: usize) -> Self {
        let pixel = std::array::from_fn(|lane| (first + lane) as u32);
        Self { pixel, share: [1.0; LANES], count: LANES, is_row: true }
    }

    fn single(pixel: usize, share: f32) -> Self {
        Self { pixel: [pixel as u32; LANES], share: [share; LANES], count: 1, is_row: false }
    }

    /// Calls `add` with the lane, the pixel and its share for each target.
    #[inline(always)]
    pub(crate) fn for_each(&self, mut add: impl FnMut(usize, usize, f32)) {
        (0..self.count).for_each(|lane| add(lane, self.pixel[lane] as usize % TILE_PIXELS, self.share[lane]));
    }
}

/// Rows of eight pixels of a tile, one below the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowRun {
    /// The first pixel of the first row.
    first: usize,
    /// Position of its centre in the image, pixels.
    centre: [f32; 2],
    count: usize,
}

impl RowRun {
    /// The first pixel of a row.
    fn pixel(&self, row: usize) -> usize {
        self.first + row * TILE_EDGE
    }

    /// Position of the centre of the first pixel of a row in the image, pixels.
    fn position(&self, row: usize) -> [f32; 2] {
        [self.centre[0], self.centre[1] + row as f32]
    }
}

/// Receives the light that the pixels of a tile show.
pub(crate) trait ShadingSink {
    /// Clears a pixel before its shares are added.
    fn begin_pixel(&mut self, _pixel: usize) {}

    /// Adds radiance under still objects alone to pixels; `surface` are the points that it comes from,
    /// `None` for the background.
    fn add(
        &mut self,
        pass: &RenderPass,
        radiance: DirectAndAmbient,
        surface: Option<LitSurface>,
        targets: &PixelTargets,
    );

    /// Adds rows that one triangle covers.
    fn add_rows(&mut self, pass: &RenderPass, triangle: &TriangleInterpolator, run: &RowRun) {
        for row in 0..run.count {
            let points = triangle.row(pass.lens, run.position(row)).points;
            let surface = LitSurface { points: &points, at: &pass.in_light_space(points.p) };
            self.add(pass, pass.shade(&surface), Some(surface), &PixelTargets::row(run.pixel(row)));
        }
    }
}

/// Three values per pixel of a tile, by channel.
#[derive(Clone, Debug)]
pub(crate) struct TileChannels(pub(crate) [Vec<f32>; 3]);

impl TileChannels {
    pub(crate) fn zeros() -> Self {
        Self(std::array::from_fn(|_| vec![0.0; TILE_PIXELS]))
    }

    /// Returns eight pixels from `first` on.
    #[inline(always)]
    pub(crate) fn load(&self, first: usize) -> Vec3x8 {
        let lanes = |c: usize| self.0[c][first..].first_chunk::<LANES>().copied().unwrap_or_default();
        Vec3x8::from_arrays(&[lanes(0), lanes(1), lanes(2)])
    }

    /// Sets eight pixels from `first` on.
    #[inline(always)]
    pub(crate) fn store(&mut self, first: usize, values: Vec3x8) {
        for (channel, values) in self.0.iter_mut().zip(values.to_arrays()) {
            if let Some(pixels) = channel.get_mut(first..).and_then(|c| c.first_chunk_mut::<LANES>()) {
                *pixels = values;
            }
        }
    }
}

/// Display values of a tile, 0..=255.
pub(crate) type TileDisplay = TileChannels;

impl ShadingSink for TileDisplay {
    fn begin_pixel(&mut self, pixel: usize) {
        self.0.iter_mut().for_each(|channel| channel[pixel] = 0.0);
    }

    #[inline(always)]
    fn add(
        &mut self,
        pass: &RenderPass,
        radiance: DirectAndAmbient,
        surface: Option<LitSurface>,
        targets: &PixelTargets,
    ) {
        let radiance = surface.map_or(radiance.ambient, |surface| {
            let Visibility { key, sky } = pass.moving_visibility(&surface);
            radiance.direct * key + radiance.ambient * sky
        });
        let display = pass.scene.tone_mapper.display(radiance);
        if targets.is_row {
            self.store(targets.pixel[0] as usize, display);
            return;
        }
        for (channel, values) in self.0.iter_mut().zip(display.to_arrays()) {
            targets.for_each(|lane, pixel, share| channel[pixel] += share * values[lane]);
        }
    }

    fn add_rows(&mut self, pass: &RenderPass, triangle: &TriangleInterpolator, run: &RowRun) {
        shade_rows(&mut TriangleRows { pass, triangle, run, display: self }, run.count);
    }
}

/// Rows of a triangle.
struct TriangleRows<'r, 'p, 'a> {
    pass: &'r RenderPass<'p>,
    triangle: &'r TriangleInterpolator<'a>,
    run: &'r RowRun,
    display: &'r mut TileDisplay,
}

/// The light in a row of a triangle.
struct TriangleLight {
    reflected: ReflectedLight,
    roughness: f32x8,
    /// As in [`RowSamples`].
    footprint: f32x8,
    /// Columns and rows of the points in the fine shadow maps, texels.
    texels: [f32x8; 2],
}

impl TriangleRows<'_, '_, '_> {
    fn store(&mut self, row: usize, radiance: Vec3x8) {
        self.display.store(self.run.pixel(row), self.pass.scene.tone_mapper.display(radiance));
    }
}

impl ShadedRows for TriangleRows<'_, '_, '_> {
    type Light = TriangleLight;

    fn evaluate(&mut self, row: usize) -> TriangleLight {
        let RowSamples { points, footprint } = self.triangle.row(self.pass.lens, self.run.position(row));
        let at = self.pass.in_light_space(points.p);
        let surface = LitSurface { points: &points, at: &at };
        let LightBySource { direct, ambient } = self.pass.light(&surface);
        let Visibility { key, sky } = self.pass.moving_visibility(&surface);
        let reflected = direct * key + ambient * sky;
        self.store(row, reflected.radiance(points.diffuse_albedo()));
        TriangleLight { reflected, roughness: points.roughness, footprint, texels: [at.u, at.v] }
    }

    fn is_linear(start: &TriangleLight, middle: &TriangleLight, end: &TriangleLight, share: f32) -> bool {
        let is_close_in = |of: fn(&ReflectedLight) -> &Vec3x8| {
            let [a, b] = [start, end].map(|light| of(&light.reflected));
            is_close(of(&middle.reflected), &mix_vectors(a, b, share))
        };
        is_near(&start.texels, &end.texels)
            && is_close_in(|light| &light.diffuse)
            && is_close_in(|light| &light.specular)
    }

    fn interpolate(&mut self, row: usize, start: &TriangleLight, end: &TriangleLight, share: f32) {
        if self.triangle.is_textured_metal() {
            self.evaluate(row);
            return;
        }
        let footprint = mix(start.footprint, end.footprint, share);
        let (albedo, roughness) =
            self.triangle.row_material(self.pass.lens, self.run.position(row), footprint);
        let deviation = (roughness - mix(start.roughness, end.roughness, share)).abs();
        if deviation.simd_gt(f32x8::splat(MAX_ROUGHNESS_DEVIATION)).any() {
            self.evaluate(row);
            return;
        }
        let reflected = ReflectedLight {
            diffuse: mix_vectors(&start.reflected.diffuse, &end.reflected.diffuse, share),
            specular: mix_vectors(&start.reflected.specular, &end.reflected.specular, share),
        };
        self.store(row, reflected.radiance(albedo));
    }
}

/// The part of the image that a tile covers, pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileRect {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

impl TileRect {
    /// The tiles of an image, row by row.
    pub(crate) fn all(lens: &Lens) -> impl Iterator<Item = Self> {
        let [width, height] = [lens.width, lens.height];
        let columns = move || (0..width).step_by(TILE_EDGE);
        let rows = (0..height).step_by(TILE_EDGE);
        rows.flat_map(move |y| {
            columns().map(move |x| Self {
                x,
                y,
                width: (width - x).min(TILE_EDGE),
                height: (height - y).min(TILE_EDGE),
            })
        })
    }

    /// Position of the top left corner.
    pub(crate) fn origin(&self) -> [f32; 2] {
        [self.x as f32, self.y as f32]
    }

    /// Writes display values to the colours of the image.
    pub(crate) fn write(&self, display: &TileDisplay, image: &mut RenderedImage) {
        for y in 0..self.height {
            let at = 3 * ((self.y + y) * image.width + self.x);
            let row = &mut image.rgb[at..at + 3 * self.width];
            for (block, bytes) in row.chunks_mut(3 * LANES).enumerate() {
                let first = y * TILE_EDGE + block * LANES;
                let Vec3x8 { x, y, z } = display.load(first);
                let channels = [x, y, z].map(|values| floor_to_u32(values + f32x8::splat(0.5)));
                for (lane, pixel) in bytes.chunks_exact_mut(3).enumerate() {
                    (0..3).for_each(|c| pixel[c] = channels[c][lane] as u8);
                }
            }
        }
    }
}

/// Rows of eight pixels, one below the other, that one triangle covers.
struct CoveredRows {
    id: u32,
    from: usize,
    /// The end of the last one.
    to: usize,
}

/// Resolves the samples of a tile: finds the surfaces that each pixel shows and passes them to a sink.
pub(crate) struct TileResolver<'a, 'p, S> {
    pass: &'p RenderPass<'a>,
    rect: TileRect,
    samples: &'p TileSamples,
    sink: &'p mut S,
    /// Receives depth and segmentation.
    image: &'p mut RenderedImage,
    prepared: &'p mut PreparedTriangles<'a>,
}

impl<'a, 'p, S: ShadingSink> TileResolver<'a, 'p, S> {
    pub(crate) fn new(
        pass: &'p RenderPass<'a>,
        rect: TileRect,
        samples: &'p TileSamples,
        sink: &'p mut S,
        image: &'p mut RenderedImage,
        prepared: &'p mut PreparedTriangles<'a>,
    ) -> Self {
        Self { pass, rect, samples, sink, image, prepared }
    }

    /// Resolves all pixels, or only those that show a moving object; of the others, the samples need not be set. Depth
    /// and segmentation go to `image` directly.
    pub(crate) fn run(&mut self, only_moving: bool) {
        let rows = if only_moving { self.samples.rows() } else { 0..TILE_EDGE };
        for x in (0..self.rect.width).step_by(LANES) {
            let all = (1 << (self.rect.width - x).min(LANES)) - 1;
            let mut covered = CoveredRows { id: NO_TRIANGLE, from: 0, to: 0 };
            for y in rows.start..rows.end.min(self.rect.height) {
                let samples = self.samples.colour_ids(x, y);
                let colours = if only_moving { moving_pixels(&samples) & all } else { all };
                let mut centres = all;
                if self.samples.has_centres() {
                    let (ids, w) = self.samples.centres(x, y);
                    if only_moving {
                        centres &= moving_bits(&ids) | colours;
                    }
                    if centres != 0 {
                        self.write_centres(x, y, &ids, w);
                    }
                }
                if colours == 0 {
                    continue;
                }
                if colours == all && is_uniform(&samples) {
                    if (covered.id, covered.to) != (samples[0], y) {
                        self.shade_covered(&covered, x);
                        covered = CoveredRows { id: samples[0], from: y, to: y };
                    }
                    covered.to = y + 1;
                    continue;
                }
                let pixels = samples.as_chunks::<SAMPLES_PER_PIXEL>().0;
                for (lane, ids) in pixels.iter().enumerate().filter(|(lane, _)| colours >> lane & 1 == 1) {
                    self.shade_pixel(*ids, x + lane, y);
                }
            }
            self.shade_covered(&covered, x);
        }
        self.flush();
    }

    /// Writes depth and segmentation alone.
    pub(crate) fn run_centres(&mut self) {
        for y in 0..self.rect.height {
            for x in (0..self.rect.width).step_by(LANES) {
                let (ids, w) = self.samples.centres(x, y);
                self.write_centres(x, y, &ids, w);
            }
        }
    }

    /// Shades all pixels of a tile that triangle `id` covers wholly; only the samples at their centres are read.
    pub(crate) fn run_covered(&mut self, id: u32) {
        if self.samples.has_centres() {
            self.run_centres();
        }
        for x in (0..self.rect.width).step_by(LANES) {
            self.shade_covered(&CoveredRows { id, from: 0, to: self.rect.height }, x);
        }
    }

    /// Writes depth and segmentation of eight pixels from (x, y) on; `ids` are the triangles at their centres, and
    /// `w` the reciprocal depths.
    fn write_centres(&mut self, x: usize, y: usize, ids: &[u32; LANES], w: f32x8) {
        let depths = (f32x8::ONE / w).to_array();
        let at = (self.rect.y + y) * self.image.width + self.rect.x + x;
        let end = at + (self.rect.width - x).min(LANES);
        let pixels = self.image.depth[at..end].iter_mut().zip(&mut self.image.segmentation[at..end]);
        for ((depth, segmentation), (&id, own)) in pixels.zip(ids.iter().zip(depths)) {
            *depth = if id == NO_TRIANGLE { f32::INFINITY } else { own };
            *segmentation = self.pass.segmentation_id(id);
        }
    }

    /// Shades rows of eight pixels from column `x` on.
    fn shade_covered(&mut self, &CoveredRows { id, from, to }: &CoveredRows, x: usize) {
        let run = RowRun {
            first: from * TILE_EDGE + x,
            centre: [(self.rect.x + x) as f32 + 0.5, (self.rect.y + from) as f32 + 0.5],
            count: to - from,
        };
        if id == NO_TRIANGLE {
            for row in 0..run.count {
                let [px, py] = run.position(row);
                let targets = PixelTargets::row(run.pixel(row));
                self.shade_background(f32x8::splat(px) + LANE_INDEX, f32x8::splat(py), &targets);
            }
        } else if let Some(triangle) = interpolator(&mut self.prepared.recent, self.pass, id) {
            self.sink.add_rows(self.pass, triangle, &run);
        }
    }

    /// Shades the background at eight points (x, y) of the self.image.
    fn shade_background(&mut self, x: f32x8, y: f32x8, targets: &PixelTargets) {
        let ambient = self.pass.scene.illumination.sky_radiance(self.pass.lens.ray_direction_z(x, y));
        self.sink.add(self.pass, DirectAndAmbient { ambient, ..Default::default() }, None, targets);
    }

    /// Shades a pixel: each surface once, at the mean position of its samples.
    fn shade_pixel(&mut self, ids: [u32; SAMPLES_PER_PIXEL], x: usize, y: usize) {
        let pixel = y * TILE_EDGE + x;
        self.sink.begin_pixel(pixel);
        if ids == [ids[0]; SAMPLES_PER_PIXEL] {
            self.shade_share(ids[0], [x, y].map(|at| at as f32 + 0.5), pixel, 1.0);
            return;
        }
        let mut surfaces = [None; SAMPLES_PER_PIXEL];
        for sample in 0..SAMPLES_PER_PIXEL {
            let before = (0..sample).find(|&before| ids[before] == ids[sample]);
            surfaces[sample] =
                before.map_or_else(|| self.pass.surface(ids[sample]), |before| surfaces[before]);
        }
        let mut left = (1_usize << SAMPLES_PER_PIXEL) - 1;
        while left != 0 {
            let first = left.trailing_zeros() as usize;
            let is_member = |sample: usize| usize::from(surfaces[sample] == surfaces[first]) << sample;
            let members =
                left & (0..SAMPLES_PER_PIXEL).fold(0, |members, sample| members | is_member(sample));
            left &= !members;
            let SampleGroup { mean: [u, v], nearest } = SAMPLE_GROUPS[members];
            let share = members.count_ones() as f32 / SAMPLES_PER_PIXEL as f32;
            self.shade_share(ids[nearest], [x as f32 + u, y as f32 + v], pixel, share);
        }
    }

    /// Shades a share of a pixel that shows triangle `id` at the position `[x, y]` of the tile.
    fn shade_share(&mut self, id: u32, [x, y]: [f32; 2], pixel: usize, share: f32) {
        let (x, y) = (self.rect.x as f32 + x, self.rect.y as f32 + y);
        if id == NO_TRIANGLE {
            let targets = PixelTargets::single(pixel, share);
            self.shade_background(f32x8::splat(x), f32x8::splat(y), &targets);
            return;
        }
        if let Some(triangle) = interpolator(&mut self.prepared.recent, self.pass, id) {
            let batch = &mut self.prepared.batch;
            triangle.push(batch, x, y);
            (batch.pixel[batch.count], batch.share[batch.count]) = (pixel as u32, share);
            batch.count += 1;
        }
        if self.prepared.batch.count == LANES {
            self.flush();
        }
    }

    /// Shades the collected points.
    fn flush(&mut self) {
        let ShadingBatch { count, pixel, share, .. } = self.prepared.batch;
        if count > 0 {
            let targets = PixelTargets { pixel, share, count, is_row: false };
            let points = self.prepared.batch.samples(self.pass.lens);
            let surface = LitSurface { points: &points, at: &self.pass.in_light_space(points.p) };
            self.sink.add(self.pass, self.pass.shade(&surface), Some(surface), &targets);
            self.prepared.batch.count = 0;
        }
    }
}

/// Bit mask of the ids of moving objects.
#[inline(always)]
fn moving_bits(ids: &[u32; LANES]) -> u32 {
    // The flag is the sign bit, of which the mask is made.
    const { assert!(MOVING_FLAG == 1 << 31) };
    u32x8::new(*ids).to_bitmask()
}

/// Bit mask of the pixels of which any sample shows a moving object.
#[inline(always)]
fn moving_pixels(samples: &[u32; SAMPLES_PER_PIXEL * LANES]) -> u32 {
    let chunks = samples.as_chunks::<LANES>().0;
    let bits =
        (0..).zip(chunks).fold(0, |bits, (chunk, ids)| bits | moving_bits(ids) << (chunk * LANES as u32));
    (0..LANES as u32).fold(0, |pixels, pixel| {
        pixels | u32::from(bits >> (pixel * SAMPLES_PER_PIXEL as u32) & 0xF != 0) << pixel
    })
}

/// True if all samples show one triangle.
#[inline(always)]
fn is_uniform(samples: &[u32; SAMPLES_PER_PIXEL * LANES]) -> bool {
    let first = u32x8::splat(samples[0]);
    let chunks = samples.as_chunks::<LANES>().0.iter();
    chunks.fold(u32x8::MAX, |same, ids| same & u32x8::new(*ids).simd_eq(first)).all()
}

/// True if eight pixels from `first` on show moving objects only.
pub(crate) fn is_all_moving(samples: &TileSamples, first: usize) -> bool {
    let (x, y) = (first % TILE_EDGE, first / TILE_EDGE);
    let ids = samples.colour_ids(x, y);
    samples.rows().contains(&y) && ids.as_chunks::<LANES>().0.iter().all(|ids| moving_bits(ids) == 0xFF)
}

/// Number of prepared triangles that are kept: neighbouring pixels alternate between a few.
const RECENT: usize = 32;

/// Prepared triangles, by the last bits of their ids.
type RecentTriangles<'a> = [Option<TriangleInterpolator<'a>>; RECENT];

/// Triangles and points that are prepared for shading, kept from tile to tile of an image.
#[derive(Default)]
pub(crate) struct PreparedTriangles<'a> {
    recent: RecentTriangles<'a>,
    /// Pixels that wait for shading; empty between tiles.
    batch: ShadingBatch<'a>,
}

/// Prepares triangle `id`, unless it is known. `None` if its object is out of view.
fn interpolator<'m, 'a>(
    recent: &'m mut RecentTriangles<'a>,
    pass: &RenderPass<'a>,
    id: u32,
) -> Option<&'m TriangleInterpolator<'a>> {
    let known = &mut recent[id as usize % RECENT];
    if known.as_ref().is_none_or(|triangle| triangle.id != id) {
        let instance = pass.objects.get(object_index(id))?.drawn.as_ref()?;
        *known = Some(TriangleInterpolator::new(instance, pass.lens, id));
    }
    known.as_ref()
}
