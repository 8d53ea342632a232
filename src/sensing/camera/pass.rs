//! Samples and shading of one picture.

use super::{
    Mount, Picture, Stage, V3,
    background::{Background, Spot},
    frame::posed,
    lens::{Lens, SUB, Seen},
    model::Level,
    pattern::Look,
    pose::Posed,
    raster::{NONE, Samples},
    shade::{Blob, Fragment, Light, Split, open_sky},
    shadow::ShadowMap,
    tone::{self, Tone},
};
use crate::scene::Camera;

/// Bits of a sample's number that count triangles; the others count things.
const TRIANGLE_BITS: u32 = 22;
/// No thing hides nothing from itself.
const NO_THING: usize = usize::MAX;

/// Which things a pass draws.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Which {
    All,
    Fixed,
    Moving,
}

impl Which {
    pub fn takes(self, mount: &Mount) -> bool {
        let fixed = matches!(mount, Mount::Fixed(_));
        match self {
            Self::All => true,
            Self::Fixed => fixed,
            Self::Moving => !fixed,
        }
    }
}

/// What a pass needs to know.
pub(super) struct Pass<'a> {
    pub stage: &'a Stage,
    pub lens: &'a Lens,
    /// Level of each thing, or none if it is out of sight.
    pub levels: &'a [Option<usize>],
    pub poses: &'a [Vec<Posed>],
    pub light: &'a Light,
    pub tone: &'a Tone,
    pub fixed_blobs: &'a [Blob],
    pub moving_blobs: &'a [Blob],
    pub moving_shadow: &'a ShadowMap,
}

impl Pass<'_> {
    fn level(&self, thing: usize) -> Option<(&Level, &Posed)> {
        let level = self.levels[thing]?;
        Some((&self.stage.things[thing].model.levels[level], posed(self.stage, self.poses, thing, level)))
    }

    /// Rasterises things into `samples`, where nothing of `before` is nearer.
    pub fn draw(
        &self,
        which: Which,
        samples: &mut Samples,
        projected: &mut Vec<Seen>,
        before: Option<&[f32]>,
    ) {
        samples.reset(SUB * self.lens.width, SUB * self.lens.height, 1.0 / self.lens.far, true);
        for (i, thing) in self.stage.things.iter().enumerate().filter(|(_, t)| which.takes(&t.mount)) {
            let Some((level, posed)) = self.level(i) else { continue };
            debug_assert!(thing.model.levels.len() > self.levels[i].unwrap_or(0));
            projected.clear();
            projected.extend(posed.positions.iter().map(|p| self.lens.see(p)));
            for (number, t) in level.triangles.iter().enumerate() {
                let id = (i as u32) << TRIANGLE_BITS | number as u32;
                self.draw_triangle(&t.map(|v| projected[v as usize]), id, samples, before);
            }
        }
    }

    /// Draws a triangle; what is before the near plane is cut off.
    fn draw_triangle(&self, corners: &[Seen; 3], id: u32, samples: &mut Samples, before: Option<&[f32]>) {
        let at = |s: &Seen| [s.x, s.y, s.w];
        let ahead = |s: &Seen| -s.view.z >= self.lens.near;
        match corners.iter().filter(|s| ahead(s)).count() {
            0 => {}
            3 => samples.draw::<true>(corners.each_ref().map(at), -1.0, id, before),
            _ => {
                // Sutherland & Hodgman 1974, one plane: three or four corners remain.
                let mut kept: Vec<Seen> = Vec::with_capacity(4);
                for i in 0..3 {
                    let (a, b) = (&corners[i], &corners[(i + 1) % 3]);
                    if ahead(a) {
                        kept.push(*a);
                    }
                    if ahead(a) != ahead(b) {
                        let t = (-self.lens.near - a.view.z) / (b.view.z - a.view.z);
                        kept.push(self.lens.project(a.view + (b.view - a.view) * t));
                    }
                }
                for i in 2..kept.len() {
                    let part = [at(&kept[0]), at(&kept[i - 1]), at(&kept[i])];
                    samples.draw::<true>(part, -1.0, id, before);
                }
            }
        }
    }

    /// The point of triangle `id` that the ray through (x, y) (pixels) meets.
    fn fragment(&self, id: u32, x: f32, y: f32) -> Option<(usize, Fragment)> {
        let thing = (id >> TRIANGLE_BITS) as usize;
        let number = (id & ((1 << TRIANGLE_BITS) - 1)) as usize;
        let (level, posed) = self.level(thing)?;
        let corners = level.triangles[number];
        let [a, b, c] = corners.map(|v| posed.positions[v as usize] - self.lens.eye);
        let ray = self.lens.ray(x, y);
        let (e1, e2) = (b - a, c - a);
        let face = e1.cross(&e2);
        let facing = face.dot(&ray);
        // A triangle seen edge-on is met at its middle.
        let steady = facing.abs() > 1e-6 * face.norm() * ray.norm();
        let q = if steady { ray * (face.dot(&a) / facing) - a } else { (e1 + e2) / 3.0 };
        let scale = 1.0 / face.norm_squared().max(1e-30);
        let s = (q.cross(&e2).dot(&face) * scale).clamp(0.0, 1.0);
        let t = (e1.cross(&q).dot(&face) * scale).clamp(0.0, 1.0 - s);
        let [w0, w1, w2] = [1.0 - s - t, s, t];
        let mix = |a: &V3, b: &V3, c: &V3| a * w0 + b * w1 + c * w2;
        let [i, j, k] = corners.map(|v| v as usize);
        let n = mix(&posed.normals[i], &posed.normals[j], &posed.normals[k]);
        let looks = corners.map(|v| &level.looks[v as usize]);
        let mut look = Look {
            albedo: mix(&looks[0].albedo, &looks[1].albedo, &looks[2].albedo),
            roughness: looks[0].roughness * w0 + looks[1].roughness * w1 + looks[2].roughness * w2,
            metalness: looks[0].metalness,
            open: looks[0].open * w0 + looks[1].open * w1 + looks[2].open * w2,
        };
        let p = a + e1 * s + e2 * t;
        if let Some(facet) = level.facets.get(number) {
            let p_o = mix(&level.positions[i], &level.positions[j], &level.positions[k]);
            // A pixel's width on the surface: geometric mean of both directions.
            let cosine = (facing.abs() / (face.norm() * ray.norm())).max(0.05);
            let footprint = p.norm() / (self.lens.focal * cosine.sqrt());
            let texture = &self.stage.things[thing].model.facets[*facet as usize];
            (look.albedo, look.roughness) = texture.sample(&p_o, footprint);
        }
        Some((thing, Fragment { p: p + self.lens.eye, n: n / n.norm().max(1e-12), look }))
    }

    /// Light from a fragment under what is fixed.
    fn under_fixed(&self, thing: usize, f: &Fragment) -> Split {
        let to_eye = (self.lens.eye - f.p).normalize();
        let mut split = self.light.split(f, &to_eye);
        split.direct *= self.light.unshadowed(f, &self.stage.fixed_shadow);
        split.ambient *= open_sky(self.fixed_blobs, &f.p, &f.n, thing);
        split
    }

    /// Shares of the key light and of the sky that what moves leaves at a fragment.
    fn under_moving(&self, thing: usize, f: &Fragment) -> (f32, f32) {
        let key = self.light.unshadowed(f, self.moving_shadow);
        (key, open_sky(self.moving_blobs, &f.p, &f.n, thing))
    }

    /// Radiance where nothing is, at (x, y) pixels.
    fn nothing(&self, x: f32, y: f32) -> V3 {
        self.light.sky(self.lens.ray(x, y).normalize().z)
    }

    /// The runs of equal numbers among the samples of a pixel: number, share, middle.
    fn runs(&self, samples: &Samples, x: usize, y: usize, mut each: impl FnMut(u32, f32, f32, f32)) {
        let width = samples.width;
        let first = SUB * y * width + SUB * x;
        let at = [first, first + 1, first + width, first + width + 1];
        let ids = at.map(|i| samples.id[i]);
        if ids[0] == ids[1] && ids[0] == ids[2] && ids[0] == ids[3] {
            each(ids[0], 1.0, x as f32 + 0.5, y as f32 + 0.5);
            return;
        }
        for i in 0..4 {
            if ids[..i].contains(&ids[i]) {
                continue;
            }
            let (mut count, mut dx, mut dy) = (0.0, 0.0, 0.0);
            for j in (i..4).filter(|&j| ids[j] == ids[i]) {
                count += 1.0;
                dx += if j & 1 == 1 { 0.75 } else { 0.25 };
                dy += if j & 2 == 2 { 0.75 } else { 0.25 };
            }
            each(ids[i], 0.25 * count, x as f32 + dx / count, y as f32 + dy / count);
        }
    }

    /// Depth and object of a pixel: those of the thing with most samples in it.
    fn geometry(&self, samples: &Samples, (x, y): (usize, usize), parity: usize) -> (f32, u16) {
        let corner = SUB * y * samples.width + SUB * x;
        let at = [corner, corner + 1, corner + samples.width, corner + samples.width + 1];
        let thing = |i: usize| {
            if samples.id[i] == NONE { NO_THING } else { (samples.id[i] >> TRIANGLE_BITS) as usize }
        };
        let things = at.map(thing);
        let votes = things.map(|t| things.iter().filter(|o| **o == t).count());
        // Two against two: one side on every other pixel, so that outlines do not lean.
        let first = if parity & 1 == 0 { 0 } else { 3 };
        let best = (0..4).fold(first, |b, i| if votes[i] > votes[b] { i } else { b });
        if things[best] == NO_THING {
            return (f32::INFINITY, 0);
        }
        let own = (0..4).filter(|&i| things[i] == things[best]);
        let w = own.map(|i| samples.w[at[i]]).sum::<f32>() / votes[best] as f32;
        (1.0 / w, self.stage.things[things[best]].object)
    }

    fn empty_picture(&self) -> Picture {
        let (width, height) = (self.lens.width, self.lens.height);
        let pixels = width * height;
        Picture {
            width,
            height,
            rgb: Vec::with_capacity(3 * pixels),
            depth: Vec::with_capacity(pixels),
            segmentation: Vec::with_capacity(pixels),
        }
    }

    /// Shades every pixel.
    pub fn shade_all(&self, samples: &Samples) -> Picture {
        let mut picture = self.empty_picture();
        for y in 0..self.lens.height {
            for x in 0..self.lens.width {
                let mut display = V3::zeros();
                self.runs(samples, x, y, |id, share, px, py| {
                    display += self.display(id, px, py) * share;
                });
                picture.rgb.extend(display.iter().map(|&d| tone::byte(d)));
                let (depth, object) = self.geometry(samples, (x, y), x + y);
                picture.depth.push(depth);
                picture.segmentation.push(object);
            }
        }
        picture
    }

    /// Display value of triangle `id` at (x, y), pixels.
    fn display(&self, id: u32, x: f32, y: f32) -> V3 {
        let hit = if id == NONE { None } else { self.fragment(id, x, y) };
        self.tone.display(&match hit {
            None => self.nothing(x, y),
            Some((thing, f)) => self.under_fixed(thing, &f).dimmed(self.under_moving(thing, &f)),
        })
    }

    /// Draws what is fixed.
    pub fn background(&self, camera: &Camera, projected: &mut Vec<Seen>) -> Background {
        let mut samples = Samples::default();
        self.draw(Which::Fixed, &mut samples, projected, None);
        let mut picture = self.empty_picture();
        let mut spots = Vec::with_capacity(self.lens.width * self.lens.height);
        for y in 0..self.lens.height {
            for x in 0..self.lens.width {
                let spot = self.spot(&samples, x, y);
                picture.rgb.extend(spot.display.iter().map(|&d| tone::byte(d)));
                spots.push(spot);
                let (depth, object) = self.geometry(&samples, (x, y), x + y);
                picture.depth.push(depth);
                picture.segmentation.push(object);
            }
        }
        Background { stage: self.stage.key, camera: camera.clone(), samples, spots, picture }
    }

    fn spot(&self, samples: &Samples, x: usize, y: usize) -> Spot {
        let outside = [-1.0; 3];
        let (p, n) = (V3::zeros(), V3::zeros());
        let mut spot = Spot { p, n, place: outside, split: Split::BLACK, display: V3::zeros() };
        let mut most = 0.0;
        self.runs(samples, x, y, |id, share, px, py| {
            let hit = if id == NONE { None } else { self.fragment(id, px, py) };
            let split = match &hit {
                None => Split { direct: V3::zeros(), ambient: self.nothing(px, py) },
                Some((thing, f)) => self.under_fixed(*thing, f),
            };
            spot.display += self.tone.display(&split.dimmed((1.0, 1.0))) * share;
            spot.split.direct += split.direct * share;
            spot.split.ambient += split.ambient * share;
            if let Some((_, f)) = hit.filter(|_| share > most) {
                most = share;
                (spot.p, spot.n, spot.place) = (f.p, f.n, self.moving_shadow.place(&f.p));
            }
        });
        spot
    }

    /// Display value of a background pixel under what moves; `None` if that changes nothing.
    fn relit(&self, spot: &Spot) -> Option<V3> {
        let open = open_sky(self.moving_blobs, &spot.p, &spot.n, NO_THING);
        let key = if spot.split.direct != V3::zeros() && self.moving_shadow.may_shade(&spot.place) {
            self.moving_shadow.light(&spot.place, &spot.n)
        } else {
            1.0
        };
        if key == 1.0 && open == 1.0 || spot.n == V3::zeros() {
            return None;
        }
        let change = self.tone.display(&spot.split.dimmed((key, open)))
            - self.tone.display(&spot.split.dimmed((1.0, 1.0)));
        Some((spot.display + change).map(|d| d.clamp(0.0, 255.0)))
    }

    /// Shades what moves over a background.
    pub fn shade_over(&self, background: &Background, samples: &Samples) -> Picture {
        let mut picture = background.picture.clone();
        let mut merged =
            Samples { width: SUB, height: SUB, w: vec![0.0; 4], id: vec![NONE; 4], rows: [0, SUB] };
        for y in 0..self.lens.height {
            let rows = samples.rows[0] < SUB * (y + 1) && samples.rows[1] > SUB * y;
            for x in 0..self.lens.width {
                let pixel = y * self.lens.width + x;
                let spot = &background.spots[pixel];
                let first = SUB * y * samples.width + SUB * x;
                let at = [first, first + 1, first + samples.width, first + samples.width + 1];
                if !rows || at.iter().all(|&i| samples.id[i] == NONE) {
                    if let Some(display) = self.relit(spot) {
                        (0..3).for_each(|c| picture.rgb[3 * pixel + c] = tone::byte(display[c]));
                    }
                    continue;
                }
                let mut display = V3::zeros();
                self.runs(samples, x, y, |id, share, px, py| {
                    let value = if id == NONE {
                        self.relit(spot).unwrap_or(spot.display)
                    } else {
                        self.display(id, px, py)
                    };
                    display += value * share;
                });
                (0..3).for_each(|c| picture.rgb[3 * pixel + c] = tone::byte(display[c]));
                for (k, &i) in at.iter().enumerate() {
                    let moving = samples.id[i] != NONE;
                    let from = if moving { samples } else { &background.samples };
                    (merged.id[k], merged.w[k]) = (from.id[i], from.w[i]);
                }
                (picture.depth[pixel], picture.segmentation[pixel]) = self.geometry(&merged, (0, 0), x + y);
            }
        }
        picture
    }
}
