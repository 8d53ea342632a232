//! A tile of a picture: samples are drawn, then each surface that a pixel shows is lit once.

use wide::u32x8;

use super::{
    Picture,
    lanes::{F8, LANES, STEPS, V8},
    pass::Pass,
    raster::{NONE, SAMPLES, Samples, place},
    screen::{Screen, TILE},
    shade::Points,
    surface::{Batch, Drawn, MOVING, Patch, thing_of},
};

/// Pixels of a tile.
pub(super) const PIXELS: usize = TILE * TILE;

/// Where eight points go: pixels of the tile and shares of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    pub pixel: [u32; LANES],
    pub share: [f32; LANES],
    pub count: usize,
}

impl Goal {
    fn row(first: usize) -> Self {
        let pixel = std::array::from_fn(|lane| (first + lane) as u32);
        Self { pixel, share: [1.0; LANES], count: LANES }
    }

    fn one(pixel: usize, share: f32) -> Self {
        Self { pixel: [pixel as u32; LANES], share: [share; LANES], count: 1 }
    }

    /// Pixels and shares.
    pub fn each(&self) -> impl Iterator<Item = (usize, usize, f32)> {
        (0..self.count).map(|lane| (lane, self.pixel[lane] as usize % PIXELS, self.share[lane]))
    }
}

/// Takes what pixels show.
pub(super) trait Sink {
    /// Points of surfaces.
    fn points(&mut self, pass: &Pass, points: &Points, goal: &Goal);
    /// Nothing: radiance of the sky.
    fn nothing(&mut self, pass: &Pass, radiance: V8, goal: &Goal);
    /// A pixel begins anew.
    fn begin(&mut self, pixel: usize);
}

/// Display values of a tile, by channel.
pub(super) struct Display(pub Box<[[f32; PIXELS]; 3]>);

impl Display {
    pub fn add(&mut self, display: V8, goal: &Goal) {
        for (all, own) in self.0.iter_mut().zip(display.to_arrays()) {
            goal.each().for_each(|(lane, pixel, share)| all[pixel] += share * own[lane]);
        }
    }
}

impl Sink for Display {
    fn points(&mut self, pass: &Pass, points: &Points, goal: &Goal) {
        let (key, open) = pass.under_moving(points);
        self.add(pass.stage.tone.display(pass.under_fixed(points).dimmed(key, open)), goal);
    }

    fn nothing(&mut self, pass: &Pass, radiance: V8, goal: &Goal) {
        self.add(pass.stage.tone.display(radiance), goal);
    }

    fn begin(&mut self, pixel: usize) {
        self.0.iter_mut().for_each(|channel| channel[pixel] = 0.0);
    }
}

/// A tile's place in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    tile: usize,
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

impl Window {
    pub fn of(tile: usize, screen: &Screen, pass: &Pass) -> Self {
        let columns = screen.tiles()[0];
        let (x, y) = (tile % columns * TILE, tile / columns * TILE);
        let (width, height) = ((pass.lens.width - x).min(TILE), (pass.lens.height - y).min(TILE));
        Self { tile, x, y, width, height }
    }

    /// Draws the triangles of the tile.
    pub fn draw(&self, screen: &Screen, samples: &mut Samples<SAMPLES>) {
        let origin = [self.x as f32, self.y as f32];
        screen.of_tile(self.tile).for_each(|(at, id)| samples.draw::<true>(at, origin, id));
    }

    /// Writes display values into the picture.
    pub fn write(&self, display: &Display, picture: &mut Picture) {
        for y in 0..self.height {
            let at = 3 * ((self.y + y) * picture.width + self.x);
            let row = &mut picture.rgb[at..at + 3 * self.width];
            for (block, bytes) in row.chunks_mut(3 * LANES).enumerate() {
                let first = y * TILE + block * LANES;
                let channel = |c: usize| {
                    let values = display.0[c][first..].first_chunk::<LANES>().copied().unwrap_or_default();
                    super::lanes::whole(F8::new(values) + F8::splat(0.5))
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
pub(super) struct Resolver<'a, 'p> {
    pass: &'p Pass<'a>,
    window: Window,
    samples: &'p Samples<SAMPLES>,
    /// All triangles that the samples may show.
    screens: &'p [&'p Screen],
    /// The triangle that was met last.
    patch: Option<Patch<'a>>,
    batch: Batch<'a>,
}

impl<'a, 'p> Resolver<'a, 'p> {
    pub fn new(
        pass: &'p Pass<'a>,
        window: Window,
        samples: &'p Samples<SAMPLES>,
        screens: &'p [&'p Screen],
    ) -> Self {
        Self { pass, window, samples, screens, patch: None, batch: Batch::default() }
    }

    /// Every pixel, or only those that show something that moves, also into the picture's depths and objects.
    pub fn run(&mut self, only_moving: bool, sink: &mut impl Sink, picture: &mut Picture) {
        for y in 0..self.window.height {
            for x in (0..self.window.width).step_by(LANES) {
                let rows = self.ids(x, y);
                let [a, b, c, d] = rows.map(u32x8::new);
                let all = (1 << (self.window.width - x).min(LANES)) - 1;
                let wanted = if only_moving {
                    ((a | b | c | d) & u32x8::splat(MOVING)).to_bitmask() & all
                } else {
                    all
                };
                if wanted == 0 {
                    continue;
                }
                let one = a.simd_eq(b) & a.simd_eq(c) & a.simd_eq(d) & a.simd_eq(u32x8::splat(rows[0][0]));
                self.depths((x, y), wanted, picture);
                if one.all() && wanted == all {
                    self.row(rows[0][0], (x, y), sink);
                    let at = (self.window.y + y) * picture.width + self.window.x + x;
                    let end = at + (self.window.width - x).min(LANES);
                    picture.segmentation[at..end].fill(self.pass.object(rows[0][0]));
                    continue;
                }
                for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
                    self.pixel(rows.map(|row| row[lane]), (x + lane, y), sink, picture);
                }
            }
        }
        self.flush(sink);
    }

    fn ids(&self, x: usize, y: usize) -> [[u32; LANES]; SAMPLES] {
        let stride = self.samples.stride();
        std::array::from_fn(|row| {
            let at = (SAMPLES * y + row) * stride + x;
            self.samples.id[at..].first_chunk::<LANES>().copied().unwrap_or([NONE; LANES])
        })
    }

    /// Depths of pixels that show one thing: the mean of the reciprocals is that in the middle.
    fn depths(&self, (x, y): (usize, usize), wanted: u32, picture: &mut Picture) {
        let stride = self.samples.stride();
        let row = |row: usize| {
            let at = (SAMPLES * y + row) * stride + x;
            F8::new(self.samples.w[at..].first_chunk::<LANES>().copied().unwrap_or_default())
        };
        let depths = (F8::splat(SAMPLES as f32) / ((row(0) + row(1)) + (row(2) + row(3)))).to_array();
        let at = (self.window.y + y) * picture.width + self.window.x + x;
        let end = at + (self.window.width - x).min(LANES);
        for (lane, depth) in picture.depth[at..end].iter_mut().enumerate() {
            if wanted >> lane & 1 == 1 {
                *depth = depths[lane];
            }
        }
    }

    fn patch(&mut self, id: u32) -> Option<&Patch<'a>> {
        if self.patch.as_ref().is_none_or(|patch| patch.id != id) {
            let drawn: &Drawn<'a> = self.pass.drawn.get(thing_of(id))?.as_ref()?;
            self.patch = Some(Patch::new(drawn, &self.pass.rays, id));
        }
        self.patch.as_ref()
    }

    /// Eight pixels wholly covered by one triangle.
    fn row(&mut self, id: u32, (x, y): (usize, usize), sink: &mut impl Sink) {
        let goal = Goal::row(y * TILE + x);
        goal.each().for_each(|(_, pixel, _)| sink.begin(pixel));
        let (px, py) = ((self.window.x + x) as f32 + 0.5, (self.window.y + y) as f32 + 0.5);
        let (pass, rays) = (self.pass, self.pass.rays);
        if id == NONE {
            sink.nothing(pass, pass.nothing(F8::splat(px) + STEPS, F8::splat(py)), &goal);
        } else if let Some(patch) = self.patch(id) {
            sink.points(pass, &patch.row(&rays, px, py), &goal);
        }
    }

    /// One pixel: its surfaces and their shares.
    fn pixel(
        &mut self,
        ids: [u32; SAMPLES],
        (x, y): (usize, usize),
        sink: &mut impl Sink,
        picture: &mut Picture,
    ) {
        let pixel = y * TILE + x;
        sink.begin(pixel);
        let at = (self.window.y + y) * picture.width + self.window.x + x;
        if ids[0] == ids[1] && ids[0] == ids[2] && ids[0] == ids[3] {
            picture.segmentation[at] = self.pass.object(ids[0]);
            self.part(ids[0], (x as f32 + 0.5, y as f32 + 0.5), (pixel, 1.0), sink);
            return;
        }
        let surfaces = ids.map(|id| self.pass.surface(id));
        for i in 0..SAMPLES {
            if surfaces[..i].contains(&surfaces[i]) {
                continue;
            }
            let own = || (0..SAMPLES).filter(|&j| surfaces[j] == surfaces[i]);
            let share = 1.0 / own().count() as f32;
            let middle = [0, 1].map(|axis| own().map(|j| place::<SAMPLES>(j)[axis]).sum::<f32>() * share);
            let away = |j: usize| {
                let [u, v] = place::<SAMPLES>(j);
                (u - middle[0]) * (u - middle[0]) + (v - middle[1]) * (v - middle[1])
            };
            let nearest = own().fold(i, |best, j| if away(j) < away(best) { j } else { best });
            let at = (x as f32 + middle[0], y as f32 + middle[1]);
            self.part(ids[nearest], at, (pixel, own().count() as f32 / SAMPLES as f32), sink);
        }
        (picture.depth[at], picture.segmentation[at]) = self.front(ids, surfaces.map(|s| s.0), (x, y));
    }

    /// A share of a pixel that shows triangle `id` at (x, y).
    fn part(&mut self, id: u32, (x, y): (f32, f32), (pixel, share): (usize, f32), sink: &mut impl Sink) {
        let (x, y) = (self.window.x as f32 + x, self.window.y as f32 + y);
        if id == NONE {
            let radiance = self.pass.nothing(F8::splat(x), F8::splat(y));
            sink.nothing(self.pass, radiance, &Goal::one(pixel, share));
            return;
        }
        let mut batch = std::mem::take(&mut self.batch);
        if let Some(patch) = self.patch(id) {
            patch.put(&mut batch, x, y);
            (batch.pixel[batch.count], batch.share[batch.count]) = (pixel as u32, share);
            batch.count += 1;
        }
        self.batch = batch;
        if self.batch.count == LANES {
            self.flush(sink);
        }
    }

    fn flush(&mut self, sink: &mut impl Sink) {
        let Batch { count, pixel, share, .. } = self.batch;
        if count > 0 {
            sink.points(self.pass, &self.batch.points(&self.pass.rays), &Goal { pixel, share, count });
            self.batch.count = 0;
        }
    }

    /// Depth and object of a pixel of several surfaces: those of the thing with most samples in it; of two with two
    /// samples each, the one in its middle.
    fn front(&self, ids: [u32; SAMPLES], things: [usize; SAMPLES], (x, y): (usize, usize)) -> (f32, u16) {
        let stride = self.samples.stride();
        let w: [f32; SAMPLES] = std::array::from_fn(|row| self.samples.w[(SAMPLES * y + row) * stride + x]);
        let votes = |i: usize| things.iter().filter(|t| **t == things[i]).count();
        let most = (0..SAMPLES).map(votes).max().unwrap_or(0);
        let leading = |i: &usize| votes(*i) == most;
        let near = (0..SAMPLES).filter(leading).fold(None, |best: Option<usize>, i| {
            if best.is_some_and(|b| w[b] >= w[i]) { best } else { Some(i) }
        });
        let mut best = near.unwrap_or(0);
        if let Some(other) = (0..SAMPLES).filter(leading).find(|&i| things[i] != things[best]) {
            let middle = [(self.window.x + x) as f32 + 0.5, (self.window.y + y) as f32 + 0.5];
            let own = |id| thing_of(id) == things[best];
            if !self.screens.iter().any(|screen| screen.covers(self.window.tile, middle, own)) {
                best = other;
            }
        }
        if ids[best] == NONE {
            return (f32::INFINITY, 0);
        }
        let own = (0..SAMPLES).filter(|&i| things[i] == things[best]);
        (votes(best) as f32 / own.map(|i| w[i]).sum::<f32>(), self.pass.object(ids[best]))
    }
}
