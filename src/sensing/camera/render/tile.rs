//! Draws one tile of an image: rasterises its triangles, then shades each visible surface once per pixel.

use wide::u32x8;

use super::{
    interpolate::{ShadingBatch, TriangleInterpolator},
    pass::RenderPass,
};
use crate::sensing::camera::{
    RenderedImage,
    raster::{
        MOVING_FLAG, NO_TRIANGLE,
        binning::{TILE_EDGE, TileBins, TileTriangle},
        object_index,
        sample_buffer::{CENTRE_ROW, ROWS_PER_PIXEL, SAMPLE_OFFSETS, SampleBuffer},
    },
    shade::shading::SurfaceSamples,
    simd::{LANE_INDEX, LANES, Vec3x8, f32x8, floor_to_u32},
};

/// Number of pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE_EDGE * TILE_EDGE;

/// The samples of a tile.
pub(crate) type TileSamples = SampleBuffer<ROWS_PER_PIXEL>;

/// Pixels of a tile that eight lanes contribute to, and the share of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelTargets {
    pixel: [u32; LANES],
    share: [f32; LANES],
    count: usize,
    /// True if the lanes are whole pixels in a row.
    is_row: bool,
}

/// The target of one lane.
#[derive(Clone, Copy)]
pub(crate) struct LaneTarget {
    pub(crate) lane: usize,
    pub(crate) pixel: usize,
    pub(crate) share: f32,
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

    pub(crate) fn lanes(&self) -> impl Iterator<Item = LaneTarget> {
        (0..self.count).map(|lane| LaneTarget {
            lane,
            pixel: self.pixel[lane] as usize % TILE_PIXELS,
            share: self.share[lane],
        })
    }
}

/// Receives the surface points that the pixels of a tile show.
pub(crate) trait ShadingSink {
    /// Clears a pixel before its shares are added.
    fn begin_pixel(&mut self, pixel: usize);
    fn add_surface(&mut self, pass: &RenderPass, samples: &SurfaceSamples, targets: &PixelTargets);
    fn add_background(&mut self, pass: &RenderPass, radiance: Vec3x8, targets: &PixelTargets);
}

/// Display values of a tile, 0..=255, by channel.
pub(crate) struct TileDisplay(Box<[[f32; TILE_PIXELS]; 3]>);

impl TileDisplay {
    pub(crate) fn new() -> Self {
        Self(Box::new([[0.0; TILE_PIXELS]; 3]))
    }

    #[inline(always)]
    fn add(&mut self, display: Vec3x8, targets: &PixelTargets) {
        if targets.is_row {
            self.set_row(targets.pixel[0] as usize, display);
            return;
        }
        for (channel, values) in self.0.iter_mut().zip(display.to_arrays()) {
            targets.lanes().for_each(|t| channel[t.pixel] += t.share * values[t.lane]);
        }
    }

    /// Sets eight pixels from `first` on.
    #[inline(always)]
    pub(crate) fn set_row(&mut self, first: usize, display: Vec3x8) {
        for (channel, values) in self.0.iter_mut().zip(display.to_arrays()) {
            if let Some(pixels) = channel.get_mut(first..).and_then(|c| c.first_chunk_mut::<LANES>()) {
                *pixels = values;
            }
        }
    }
}

impl ShadingSink for TileDisplay {
    fn begin_pixel(&mut self, pixel: usize) {
        self.0.iter_mut().for_each(|channel| channel[pixel] = 0.0);
    }

    fn add_surface(&mut self, pass: &RenderPass, samples: &SurfaceSamples, targets: &PixelTargets) {
        let (key, sky) = pass.visibility_under_moving(samples);
        let radiance = pass.shade_under_fixed(samples).attenuated(key, sky);
        self.add(pass.scene.tone_mapper.display(radiance), targets);
    }

    fn add_background(&mut self, pass: &RenderPass, radiance: Vec3x8, targets: &PixelTargets) {
        self.add(pass.scene.tone_mapper.display(radiance), targets);
    }
}

/// The part of the image that a tile covers, pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileRect {
    tile: usize,
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

impl TileRect {
    pub(crate) fn new(tile: usize, bins: &TileBins, pass: &RenderPass) -> Self {
        let columns = bins.tile_counts()[0];
        let (x, y) = (tile % columns * TILE_EDGE, tile / columns * TILE_EDGE);
        let (width, height) = ((pass.lens.width - x).min(TILE_EDGE), (pass.lens.height - y).min(TILE_EDGE));
        Self { tile, x, y, width, height }
    }

    fn origin(&self) -> [f32; 2] {
        [self.x as f32, self.y as f32]
    }

    /// Collects the triangles of the tile that are not hidden. Returns true if a single one covers all of it.
    pub(crate) fn collect_visible(&self, bins: &TileBins, triangles: &mut Vec<TileTriangle>) -> bool {
        bins.collect_visible(self.tile, self.origin(), triangles)
    }

    /// Rasterises the triangles of the tile.
    pub(crate) fn rasterize(&self, triangles: &[TileTriangle], samples: &mut TileSamples) {
        triangles.iter().for_each(|t| samples.draw::<true>(&t.corners, self.origin(), t.id));
    }

    /// Draws a tile that a single triangle covers: only pixel centres are rasterised, for their depths.
    pub(crate) fn draw_single<'a>(
        &self,
        triangle: &TileTriangle,
        pass: &RenderPass<'a>,
        samples: &mut TileSamples,
        sink: &mut impl ShadingSink,
        image: &mut RenderedImage,
    ) {
        let id = triangle.id;
        samples.draw_rows::<true, CENTRE_ROW, ROWS_PER_PIXEL>(&triangle.corners, self.origin(), id);
        let mut resolver = TileResolver::new(pass, *self, samples);
        for y in 0..self.height {
            for x in (0..self.width).step_by(LANES) {
                resolver.write_centres(x, y, &[id; LANES], image);
                resolver.shade_row(id, x, y, sink);
            }
        }
    }

    /// Writes display values to the colours of the image.
    pub(crate) fn write(&self, display: &TileDisplay, image: &mut RenderedImage) {
        for y in 0..self.height {
            let at = 3 * ((self.y + y) * image.width + self.x);
            let row = &mut image.rgb[at..at + 3 * self.width];
            for (block, bytes) in row.chunks_mut(3 * LANES).enumerate() {
                let first = y * TILE_EDGE + block * LANES;
                let channel = |c: usize| {
                    let values = display.0[c][first..].first_chunk::<LANES>().copied().unwrap_or_default();
                    floor_to_u32(f32x8::new(values) + f32x8::splat(0.5))
                };
                let [r, g, b] = [channel(0), channel(1), channel(2)];
                let packed = pack_rgb(std::array::from_fn(|i| u64::from(r[i] | g[i] << 8 | b[i] << 16)));
                match <&mut [u8; 3 * LANES]>::try_from(&mut *bytes) {
                    Ok(block) => *block = packed,
                    Err(_) => bytes.copy_from_slice(&packed[..bytes.len()]),
                }
            }
        }
    }
}

/// Concatenates the lower three bytes of eight words.
fn pack_rgb(w: [u64; LANES]) -> [u8; 3 * LANES] {
    let words = [
        w[0] | w[1] << 24 | w[2] << 48,
        w[2] >> 16 | w[3] << 8 | w[4] << 32 | w[5] << 56,
        w[5] >> 8 | w[6] << 16 | w[7] << 40,
    ];
    let mut bytes = [0; 3 * LANES];
    bytes.chunks_exact_mut(8).zip(words).for_each(|(out, word)| out.copy_from_slice(&word.to_le_bytes()));
    bytes
}

/// Resolves the samples of a tile: finds the surfaces that each pixel shows and passes them to a sink.
pub(crate) struct TileResolver<'a, 'p> {
    pass: &'p RenderPass<'a>,
    rect: TileRect,
    samples: &'p TileSamples,
    /// The triangle that was interpolated last.
    last: Option<TriangleInterpolator<'a>>,
    batch: ShadingBatch<'a>,
}

impl<'a, 'p> TileResolver<'a, 'p> {
    pub(crate) fn new(pass: &'p RenderPass<'a>, rect: TileRect, samples: &'p TileSamples) -> Self {
        Self { pass, rect, samples, last: None, batch: ShadingBatch::default() }
    }

    /// Resolves all pixels, or only those that show a moving object. Depth and segmentation go to `image` directly.
    pub(crate) fn run(&mut self, only_moving: bool, sink: &mut impl ShadingSink, image: &mut RenderedImage) {
        for y in 0..self.rect.height {
            for x in (0..self.rect.width).step_by(LANES) {
                let rows = self.sample_ids(x, y);
                let ids = rows.map(u32x8::new);
                let all = (1 << (self.rect.width - x).min(LANES)) - 1;
                let any_moving = ids.iter().fold(u32x8::ZERO, |any, row| any | *row);
                let moving = (any_moving & u32x8::splat(MOVING_FLAG)).to_bitmask();
                let selected = if only_moving { moving & all } else { all };
                if selected == 0 {
                    continue;
                }
                self.write_centres(x, y, &rows[CENTRE_ROW], image);
                let first = u32x8::splat(rows[0][0]);
                let same = ids.iter().fold(u32x8::MAX, |same, row| same & row.simd_eq(first));
                if same.all() && selected == all {
                    self.shade_row(rows[0][0], x, y, sink);
                    continue;
                }
                for lane in (0..LANES).filter(|lane| selected >> lane & 1 == 1) {
                    self.shade_pixel(rows.map(|row| row[lane]), x + lane, y, sink);
                }
            }
        }
        self.flush(sink);
    }

    /// Triangle ids of the samples of eight pixels from (x, y) on, by sample row.
    fn sample_ids(&self, x: usize, y: usize) -> [[u32; LANES]; ROWS_PER_PIXEL] {
        let stride = self.samples.stride();
        std::array::from_fn(|row| {
            let at = (ROWS_PER_PIXEL * y + row) * stride + x;
            self.samples.ids[at..].first_chunk::<LANES>().copied().unwrap_or([NO_TRIANGLE; LANES])
        })
    }

    /// True if eight pixels from `first` on show moving objects only.
    pub(crate) fn is_all_moving(&self, first: usize) -> bool {
        let rows = self.sample_ids(first % TILE_EDGE, first / TILE_EDGE);
        let all = rows.iter().fold(u32x8::MAX, |all, row| all & u32x8::new(*row));
        (all & u32x8::splat(MOVING_FLAG)).to_bitmask() == 0xFF
    }

    /// Writes depth and segmentation of eight pixels from (x, y) on; `ids` are the triangles at their centres.
    fn write_centres(&self, x: usize, y: usize, ids: &[u32; LANES], image: &mut RenderedImage) {
        let from = (ROWS_PER_PIXEL * y + CENTRE_ROW) * self.samples.stride() + x;
        let w = f32x8::new(self.samples.w[from..].first_chunk::<LANES>().copied().unwrap_or_default());
        let depths = (f32x8::ONE / w).to_array();
        let at = (self.rect.y + y) * image.width + self.rect.x + x;
        let end = at + (self.rect.width - x).min(LANES);
        let pixels = image.depth[at..end].iter_mut().zip(&mut image.segmentation[at..end]);
        for ((depth, segmentation), (&id, own)) in pixels.zip(ids.iter().zip(depths)) {
            *depth = if id == NO_TRIANGLE { f32::INFINITY } else { own };
            *segmentation = self.pass.segmentation_id(id);
        }
    }

    /// Shades eight pixels from (x, y) on, all covered by one triangle.
    fn shade_row(&mut self, id: u32, x: usize, y: usize, sink: &mut impl ShadingSink) {
        let targets = PixelTargets::row(y * TILE_EDGE + x);
        let (px, py) = ((self.rect.x + x) as f32 + 0.5, (self.rect.y + y) as f32 + 0.5);
        let (pass, rays) = (self.pass, self.pass.rays);
        if id == NO_TRIANGLE {
            let radiance = pass.background_radiance(f32x8::splat(px) + LANE_INDEX, f32x8::splat(py));
            sink.add_background(pass, radiance, &targets);
        } else if let Some(triangle) = interpolator(&mut self.last, pass, id) {
            sink.add_surface(pass, &triangle.row(&rays, px, py), &targets);
        }
    }

    /// Shades a pixel: each surface once, at the mean position of its samples.
    fn shade_pixel(&mut self, ids: [u32; ROWS_PER_PIXEL], x: usize, y: usize, sink: &mut impl ShadingSink) {
        const COLOUR_ROWS: [usize; 4] = [0, 1, 3, 4];
        let pixel = y * TILE_EDGE + x;
        sink.begin_pixel(pixel);
        let position = |row: usize| [0, 1].map(|axis| [x, y][axis] as f32 + SAMPLE_OFFSETS[row][axis]);
        if COLOUR_ROWS.iter().all(|&row| ids[row] == ids[0]) {
            self.shade_share(ids[0], position(CENTRE_ROW), pixel, 1.0, sink);
            return;
        }
        let surfaces = ids.map(|id| self.pass.surface(id));
        for (i, first) in COLOUR_ROWS.into_iter().enumerate() {
            let members = || COLOUR_ROWS.into_iter().filter(|&row| surfaces[row] == surfaces[first]);
            let is_done = members().next() != Some(COLOUR_ROWS[i]);
            if is_done {
                continue;
            }
            let count = members().count() as f32;
            let mean = [0, 1].map(|axis| members().map(|row| position(row)[axis]).sum::<f32>() / count);
            let distance2 = |row: usize| {
                let [u, v] = position(row);
                (u - mean[0]) * (u - mean[0]) + (v - mean[1]) * (v - mean[1])
            };
            let nearest =
                members().fold(first, |best, row| if distance2(row) < distance2(best) { row } else { best });
            self.shade_share(ids[nearest], mean, pixel, 0.25 * count, sink);
        }
    }

    /// Shades a share of a pixel that shows triangle `id` at the position `[x, y]` of the tile.
    fn shade_share(
        &mut self,
        id: u32,
        [x, y]: [f32; 2],
        pixel: usize,
        share: f32,
        sink: &mut impl ShadingSink,
    ) {
        let (x, y) = (self.rect.x as f32 + x, self.rect.y as f32 + y);
        if id == NO_TRIANGLE {
            let radiance = self.pass.background_radiance(f32x8::splat(x), f32x8::splat(y));
            sink.add_background(self.pass, radiance, &PixelTargets::single(pixel, share));
            return;
        }
        if let Some(triangle) = interpolator(&mut self.last, self.pass, id) {
            let batch = &mut self.batch;
            triangle.push(batch, &self.pass.rays, x, y);
            (batch.pixel[batch.count], batch.share[batch.count]) = (pixel as u32, share);
            batch.count += 1;
        }
        if self.batch.count == LANES {
            self.flush(sink);
        }
    }

    /// Shades the collected points.
    fn flush(&mut self, sink: &mut impl ShadingSink) {
        let ShadingBatch { count, pixel, share, .. } = self.batch;
        if count > 0 {
            let targets = PixelTargets { pixel, share, count, is_row: false };
            sink.add_surface(self.pass, &self.batch.samples(&self.pass.rays), &targets);
            self.batch.count = 0;
        }
    }
}

/// Prepares triangle `id`, unless it is the last one. `None` if its object is out of view.
fn interpolator<'m, 'a>(
    last: &'m mut Option<TriangleInterpolator<'a>>,
    pass: &RenderPass<'a>,
    id: u32,
) -> Option<&'m TriangleInterpolator<'a>> {
    if last.as_ref().is_none_or(|triangle| triangle.id != id) {
        let instance = pass.instances.get(object_index(id))?.as_ref()?;
        *last = Some(TriangleInterpolator::new(instance, &pass.rays, id));
    }
    last.as_ref()
}
