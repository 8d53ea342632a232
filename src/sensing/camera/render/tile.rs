//! A tile of a picture: samples are drawn, then each surface that a pixel shows is lit once.

use wide::u32x8;

use crate::sensing::camera::{
    RenderedImage,
    raster::binning::{TILE, TileBins},
    raster::sample_buffer::{MIDDLE, NONE, PLACES, ROWS, SampleBuffer},
    render::interpolate::{MOVING, ShadingBatch, TriangleInterpolator, thing_of},
    render::pass::RenderPass,
    shade::shading::SurfaceSamples,
    simd::{F8, LANES, STEPS, V8},
};

/// Pixels of a tile.
pub(crate) const PIXELS: usize = TILE * TILE;

/// Where eight points go: pixels of the tile and shares of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelTargets {
    pub pixel: [u32; LANES],
    pub share: [f32; LANES],
    pub count: usize,
    /// Whether these are whole pixels in a row.
    row: bool,
}

impl PixelTargets {
    #[inline(always)]
    fn row(first: usize) -> Self {
        let pixel = std::array::from_fn(|lane| (first + lane) as u32);
        Self { pixel, share: [1.0; LANES], count: LANES, row: true }
    }

    fn one(pixel: usize, share: f32) -> Self {
        Self { pixel: [pixel as u32; LANES], share: [share; LANES], count: 1, row: false }
    }

    /// Pixels and shares.
    pub(crate) fn each(&self) -> impl Iterator<Item = (usize, usize, f32)> {
        (0..self.count).map(|lane| (lane, self.pixel[lane] as usize % PIXELS, self.share[lane]))
    }
}

/// Takes what pixels show.
pub(crate) trait ShadingSink {
    /// SurfaceSamples of surfaces.
    fn points(&mut self, pass: &RenderPass, points: &SurfaceSamples, goal: &PixelTargets);
    /// Nothing: radiance of the sky.
    fn nothing(&mut self, pass: &RenderPass, radiance: V8, goal: &PixelTargets);
    /// A pixel that gets shares begins anew.
    fn begin(&mut self, pixel: usize);
}

/// TileDisplay values of a tile, by channel.
pub(crate) struct TileDisplay(pub Box<[[f32; PIXELS]; 3]>);

impl TileDisplay {
    #[inline(always)]
    fn add(&mut self, display: V8, goal: &PixelTargets) {
        if goal.row {
            self.set(goal.pixel[0] as usize, display);
            return;
        }
        for (all, own) in self.0.iter_mut().zip(display.to_arrays()) {
            goal.each().for_each(|(lane, pixel, share)| all[pixel] += share * own[lane]);
        }
    }
}

impl TileDisplay {
    /// Eight pixels from `first` on.
    #[inline(always)]
    pub(crate) fn set(&mut self, first: usize, display: V8) {
        for (all, own) in self.0.iter_mut().zip(display.to_arrays()) {
            if let Some(all) = all.get_mut(first..).and_then(|all| all.first_chunk_mut::<LANES>()) {
                *all = own;
            }
        }
    }
}

impl ShadingSink for TileDisplay {
    fn points(&mut self, pass: &RenderPass, points: &SurfaceSamples, goal: &PixelTargets) {
        let (key, open) = pass.under_moving(points);
        self.add(pass.stage.tone.display(pass.under_fixed(points).dimmed(key, open)), goal);
    }

    fn nothing(&mut self, pass: &RenderPass, radiance: V8, goal: &PixelTargets) {
        self.add(pass.stage.tone.display(radiance), goal);
    }

    fn begin(&mut self, pixel: usize) {
        self.0.iter_mut().for_each(|channel| channel[pixel] = 0.0);
    }
}

/// Numbers and corners of the triangles of a tile.
pub(crate) type Triangles = Vec<(u32, [[f32; 3]; 3])>;

/// A tile's place in the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileRect {
    tile: usize,
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

impl TileRect {
    pub(crate) fn of(tile: usize, screen: &TileBins, pass: &RenderPass) -> Self {
        let columns = screen.tiles()[0];
        let (x, y) = (tile % columns * TILE, tile / columns * TILE);
        let (width, height) = ((pass.lens.width - x).min(TILE), (pass.lens.height - y).min(TILE));
        Self { tile, x, y, width, height }
    }

    /// Draws the triangles of the tile.
    pub(crate) fn draw(&self, triangles: &Triangles, samples: &mut SampleBuffer<ROWS>) {
        triangles.iter().for_each(|(id, at)| samples.draw::<true>(at, self.origin(), *id));
    }

    /// The triangles of the tile that nothing hides wholly; true if one alone covers it.
    pub(crate) fn visible(&self, screen: &TileBins, triangles: &mut Triangles) -> bool {
        screen.visible(self.tile, self.origin(), triangles)
    }

    /// Lights a tile that shows one triangle only.
    pub(crate) fn draw_sole<'a>(
        &self,
        &(id, ref at): &(u32, [[f32; 3]; 3]),
        pass: &RenderPass<'a>,
        samples: &mut SampleBuffer<ROWS>,
        (sink, picture): (&mut impl ShadingSink, &mut RenderedImage),
    ) {
        samples.draw_rows::<true, MIDDLE, ROWS>(at, self.origin(), id);
        let mut resolver = TileResolver::new(pass, *self, samples);
        for y in 0..self.height {
            for x in (0..self.width).step_by(LANES) {
                resolver.middles((x, y), &[id; LANES], picture);
                resolver.row(id, (x, y), sink);
            }
        }
    }

    /// Place of its top left in the picture, pixels.
    fn origin(&self) -> [f32; 2] {
        [self.x as f32, self.y as f32]
    }

    /// Writes display values into the picture.
    pub(crate) fn write(&self, display: &TileDisplay, picture: &mut RenderedImage) {
        for y in 0..self.height {
            let at = 3 * ((self.y + y) * picture.width + self.x);
            let row = &mut picture.rgb[at..at + 3 * self.width];
            for (block, bytes) in row.chunks_mut(3 * LANES).enumerate() {
                let first = y * TILE + block * LANES;
                let channel = |c: usize| {
                    let values = display.0[c][first..].first_chunk::<LANES>().copied().unwrap_or_default();
                    crate::sensing::camera::simd::whole(F8::new(values) + F8::splat(0.5))
                };
                let [r, g, b] = [channel(0), channel(1), channel(2)];
                let packed = pack(std::array::from_fn(|i| u64::from(r[i] | g[i] << 8 | b[i] << 16)));
                match <&mut [u8; 3 * LANES]>::try_from(&mut *bytes) {
                    Ok(whole) => *whole = packed,
                    Err(_) => bytes.copy_from_slice(&packed[..bytes.len()]),
                }
            }
        }
    }
}

/// The lower three bytes of eight words in a row.
fn pack(w: [u64; LANES]) -> [u8; 3 * LANES] {
    let words = [
        w[0] | w[1] << 24 | w[2] << 48,
        w[2] >> 16 | w[3] << 8 | w[4] << 32 | w[5] << 56,
        w[5] >> 8 | w[6] << 16 | w[7] << 40,
    ];
    let mut out = [0; 3 * LANES];
    out.chunks_exact_mut(8).zip(words).for_each(|(out, word)| out.copy_from_slice(&word.to_le_bytes()));
    out
}

/// Lights what the samples of a tile show.
pub(crate) struct TileResolver<'a, 'p> {
    pass: &'p RenderPass<'a>,
    window: TileRect,
    samples: &'p SampleBuffer<ROWS>,
    /// The triangle that was met last.
    patch: Option<TriangleInterpolator<'a>>,
    batch: ShadingBatch<'a>,
}

impl<'a, 'p> TileResolver<'a, 'p> {
    pub(crate) fn new(pass: &'p RenderPass<'a>, window: TileRect, samples: &'p SampleBuffer<ROWS>) -> Self {
        Self { pass, window, samples, patch: None, batch: ShadingBatch::default() }
    }

    /// Every pixel, or only those that show something that moves, also into the picture's depths and objects.
    pub(crate) fn run(
        &mut self,
        only_moving: bool,
        sink: &mut impl ShadingSink,
        picture: &mut RenderedImage,
    ) {
        for y in 0..self.window.height {
            for x in (0..self.window.width).step_by(LANES) {
                let rows = self.ids(x, y);
                let ids = rows.map(u32x8::new);
                let all = (1 << (self.window.width - x).min(LANES)) - 1;
                let any = ids.iter().fold(u32x8::ZERO, |any, row| any | *row);
                let moving = (any & u32x8::splat(MOVING)).to_bitmask();
                let wanted = if only_moving { moving & all } else { all };
                if wanted == 0 {
                    continue;
                }
                self.middles((x, y), &rows[MIDDLE], picture);
                let first = u32x8::splat(rows[0][0]);
                let one = ids.iter().fold(u32x8::MAX, |one, row| one & row.simd_eq(first));
                if one.all() && wanted == all {
                    self.row(rows[0][0], (x, y), sink);
                    continue;
                }
                for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
                    self.pixel(rows.map(|row| row[lane]), (x + lane, y), sink);
                }
            }
        }
        self.flush(sink);
    }

    fn ids(&self, x: usize, y: usize) -> [[u32; LANES]; ROWS] {
        let stride = self.samples.stride();
        std::array::from_fn(|row| {
            let at = (ROWS * y + row) * stride + x;
            self.samples.id[at..].first_chunk::<LANES>().copied().unwrap_or([NONE; LANES])
        })
    }

    /// Whether all that eight pixels of the tile from one on show moves.
    pub(crate) fn moves(&self, first: usize) -> bool {
        let rows = self.ids(first % TILE, first / TILE);
        let all = rows.iter().fold(u32x8::MAX, |all, row| all & u32x8::new(*row));
        (all & u32x8::splat(MOVING)).to_bitmask() == 0xFF
    }

    /// Depths and objects of eight pixels: what their middles show.
    fn middles(&self, (x, y): (usize, usize), ids: &[u32; LANES], picture: &mut RenderedImage) {
        let from = (ROWS * y + MIDDLE) * self.samples.stride() + x;
        let w = F8::new(self.samples.w[from..].first_chunk::<LANES>().copied().unwrap_or_default());
        let depths = (F8::ONE / w).to_array();
        let at = (self.window.y + y) * picture.width + self.window.x + x;
        let end = at + (self.window.width - x).min(LANES);
        let pixels = picture.depth[at..end].iter_mut().zip(&mut picture.segmentation[at..end]);
        for ((depth, object), (id, own)) in pixels.zip(ids.iter().zip(depths)) {
            (*depth, *object) = if *id == NONE { (f32::INFINITY, 0) } else { (own, self.pass.object(*id)) };
        }
    }

    /// Eight pixels wholly covered by one triangle.
    fn row(&mut self, id: u32, (x, y): (usize, usize), sink: &mut impl ShadingSink) {
        let goal = PixelTargets::row(y * TILE + x);
        let (px, py) = ((self.window.x + x) as f32 + 0.5, (self.window.y + y) as f32 + 0.5);
        let (pass, rays) = (self.pass, self.pass.rays);
        if id == NONE {
            sink.nothing(pass, pass.nothing(F8::splat(px) + STEPS, F8::splat(py)), &goal);
        } else if let Some(patch) = known(&mut self.patch, pass, id) {
            sink.points(pass, &patch.row(&rays, px, py), &goal);
        }
    }

    /// One pixel: its surfaces and their shares.
    fn pixel(&mut self, ids: [u32; ROWS], (x, y): (usize, usize), sink: &mut impl ShadingSink) {
        const SHARING: [usize; 4] = [0, 1, 3, 4];
        let pixel = y * TILE + x;
        sink.begin(pixel);
        let place = |row: usize| [0, 1].map(|axis| [x, y][axis] as f32 + PLACES[row][axis]);
        if SHARING.iter().all(|&row| ids[row] == ids[0]) {
            self.part(ids[0], place(MIDDLE), (pixel, 1.0), sink);
            return;
        }
        let surfaces = ids.map(|id| self.pass.surface(id));
        for (i, first) in SHARING.into_iter().enumerate() {
            let own = || SHARING.into_iter().filter(|&row| surfaces[row] == surfaces[first]);
            if own().next() != Some(SHARING[i]) {
                continue;
            }
            let count = own().count() as f32;
            let middle = [0, 1].map(|axis| own().map(|row| place(row)[axis]).sum::<f32>() / count);
            let away = |row: usize| {
                let [u, v] = place(row);
                (u - middle[0]) * (u - middle[0]) + (v - middle[1]) * (v - middle[1])
            };
            let nearest = own().fold(first, |best, row| if away(row) < away(best) { row } else { best });
            self.part(ids[nearest], middle, (pixel, 0.25 * count), sink);
        }
    }

    /// A share of a pixel that shows triangle `id` at a place of the tile.
    fn part(&mut self, id: u32, [x, y]: [f32; 2], (pixel, share): (usize, f32), sink: &mut impl ShadingSink) {
        let (x, y) = (self.window.x as f32 + x, self.window.y as f32 + y);
        if id == NONE {
            let radiance = self.pass.nothing(F8::splat(x), F8::splat(y));
            sink.nothing(self.pass, radiance, &PixelTargets::one(pixel, share));
            return;
        }
        if let Some(patch) = known(&mut self.patch, self.pass, id) {
            let batch = &mut self.batch;
            patch.put(batch, &self.pass.rays, x, y);
            (batch.pixel[batch.count], batch.share[batch.count]) = (pixel as u32, share);
            batch.count += 1;
        }
        if self.batch.count == LANES {
            self.flush(sink);
        }
    }

    fn flush(&mut self, sink: &mut impl ShadingSink) {
        let ShadingBatch { count, pixel, share, .. } = self.batch;
        if count > 0 {
            sink.points(
                self.pass,
                &self.batch.points(&self.pass.rays),
                &PixelTargets { pixel, share, count, row: false },
            );
            self.batch.count = 0;
        }
    }
}

/// Triangle `id`, which may be the one that was met last.
fn known<'m, 'a>(
    last: &'m mut Option<TriangleInterpolator<'a>>,
    pass: &RenderPass<'a>,
    id: u32,
) -> Option<&'m TriangleInterpolator<'a>> {
    if last.as_ref().is_none_or(|patch| patch.id != id) {
        *last = Some(TriangleInterpolator::new(pass.drawn.get(thing_of(id))?.as_ref()?, &pass.rays, id));
    }
    last.as_ref()
}
