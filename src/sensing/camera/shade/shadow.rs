//! Soft shadows of the key light: a map of the heights nearest to it, and a filter as wide as the penumbra (Fernando,
//! Percentage-Closer Soft Shadows, SIGGRAPH sketches 2005). Most points are known to be lit or dark from the greatest and
//! least heights around them, and are not filtered at all.

use wide::i32x8;

use crate::sensing::camera::{
    V3,
    raster::sample_buffer::SampleBuffer,
    simd::{F8, LANES, STEPS, V8},
};
use crate::{geometry::basis_from_reference, scene::Lighting};

/// Texels along an edge of the part of the map in which shadows fall.
const INNER: usize = 768;
/// Texels around it that the filter reaches into.
const MARGIN: usize = 16;
/// Texels along an edge of the map.
const EDGE: usize = INNER + 2 * MARGIN;
/// Texels along an edge of the tiles that know the range of heights around them.
const TILE: usize = 1 << TILE_BITS;
const TILE_BITS: i32 = 3;
const TILES: usize = EDGE / TILE;
/// Tiles to each side that the range covers: as far as the filter reaches.
const AROUND: usize = 1;
/// A surface is in the shadow of what is farther off it than this, m: casters are drawn with fewer triangles than what they
/// throw shadows on.
const OFFSET: f32 = 2e-3;
/// Normals are off by as much as this, rad: what rises above the surface no more than that explains is the surface itself.
const BENT: f32 = 0.1;
/// Illumination that falls in flatter than this (cosine) is treated as if it did not.
const LEAST_COSINE: f32 = 0.02;
/// Rise of a surface beyond which its tilt says nothing about what is above it.
const STEEPEST: f32 = 1.5;
/// Widest filter and reach of the search for what casts the shadow, texels to each side: two vectors across.
const WIDEST: f32 = 7.4;
/// Narrowest filter, texels to each side.
const NARROWEST: f32 = 1.5;
/// Widest filter of one vector across, texels to each side.
const ONE_VECTOR: f32 = 3.4;
/// Eight points on a line of so many texels are filtered at these places only: the filter is smooth between them.
const RUN: f32 = 4.0;
/// On a line of so many, these places tell whether all see the whole light, or none of it.
const LONG_RUN: f32 = 7.0;
const NODES: [usize; 4] = [0, 2, 5, 7];
/// How far points of a run are beside their even places, texels, and how much their normals differ (cosine).
const UNEVEN: f32 = 0.3;
const FLAT: f32 = 0.998;
/// Illumination that comes in flatter than this (sine) is treated as if it did not.
const LEVELLEST: f32 = 0.15;
/// Heights below all.
const EMPTY: f32 = -1e9;

/// Shadow map of a set of casters.
#[derive(Clone, Debug)]
pub(crate) struct ShadowMap {
    axes: [V3; 3],
    centre: V3,
    texels_per_metre: f32,
    tangent: f32,
    /// Rise of level ground a texel along each axis, m. Heights above it tell what can darken something: what is farther
    /// along the light is always higher above it too, and level ground never stands above itself.
    lean: [f32; 2],
    heights: SampleBuffer<1>,
    /// Least and greatest height above level ground in and around each tile.
    ranges: Vec<[f32; 2]>,
    /// Working memory.
    own: Vec<[f32; 2]>,
    places: Vec<[f32; 3]>,
}

/// Places of eight points: texels, height towards the light, and that above level ground, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places {
    pub u: F8,
    pub v: F8,
    pub height: F8,
    pub level: F8,
}

impl ShadowMap {
    /// An empty map for a light, of the ball in which shadows are fine.
    pub(crate) fn new(lighting: &Lighting) -> Self {
        Self::around(lighting, lighting.shadow_radius_m as f32)
    }

    /// An empty map of all around the middle of that ball up to `radius`, m.
    pub(crate) fn around(lighting: &Lighting, radius: f32) -> Self {
        let up: V3 = lighting.key.direction_w.normalize().cast();
        let side = if up.z.abs() < 0.99 { V3::z() } else { V3::x() };
        let [u, v] = basis_from_reference(&up, &side);
        let axes = [u, v, up];
        let texels_per_metre = INNER as f32 / (2.0 * radius);
        let steep = up.z.signum() * up.z.abs().max(LEVELLEST) * texels_per_metre;
        Self {
            axes,
            lean: [-axes[0].z / steep, -axes[1].z / steep],
            centre: lighting.shadow_centre_w.cast(),
            texels_per_metre,
            tangent: lighting.key.softness_rad.tan() as f32,
            heights: SampleBuffer::new(EDGE, EDGE, EMPTY, false),
            ranges: vec![[EMPTY; 2]; TILES * TILES],
            own: vec![[EMPTY; 2]; TILES * TILES],
            places: Vec::new(),
        }
    }

    /// Takes all casters away.
    pub(crate) fn clear(&mut self) {
        self.heights.clear(EMPTY);
    }

    fn place(&self, p_w: &V3) -> [f32; 3] {
        let d = p_w - self.centre;
        let at = |axis: usize| d.dot(&self.axes[axis]) * self.texels_per_metre + 0.5 * EDGE as f32;
        [at(0), at(1), d.dot(&self.axes[2])]
    }

    /// Places of points, world.
    #[inline(always)]
    pub(crate) fn places(&self, p_w: V8) -> Places {
        let d = p_w - V8::splat(&self.centre);
        let [scale, middle] = [self.texels_per_metre, 0.5 * EDGE as f32].map(F8::splat);
        let u = d.dot(V8::splat(&self.axes[0])) * scale + middle;
        let v = d.dot(V8::splat(&self.axes[1])) * scale + middle;
        let height = d.dot(V8::splat(&self.axes[2]));
        let level = height - (u * F8::splat(self.lean[0]) + v * F8::splat(self.lean[1]));
        Places { u, v, height, level }
    }

    /// Adds casters.
    pub(crate) fn draw(&mut self, positions: &[V3], triangles: &[[u32; 3]]) {
        let mut places = std::mem::take(&mut self.places);
        places.clear();
        places.extend(positions.iter().map(|p| self.place(p)));
        for t in triangles {
            // Faces towards the light only: u × v points to it, so that they run the positive way.
            let at @ [a, b, c] = t.map(|v| places[v as usize]);
            if (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]) > 0.0 {
                self.heights.draw::<false>(&at, [0.0; 2], 0);
            }
        }
        self.places = places;
    }

    /// To be called when all casters are drawn.
    pub(crate) fn finish(&mut self) {
        self.own.fill([EMPTY; 2]);
        self.ranges.fill([EMPTY; 2]);
        let [from, to] = self.heights.touched;
        if from >= to {
            return;
        }
        let stride = self.heights.stride();
        for row in from / TILE..to.div_ceil(TILE) {
            for column in 0..TILES {
                let (mut low, mut high) = (F8::splat(f32::MAX), F8::splat(EMPTY));
                for y in row * TILE..(row + 1) * TILE {
                    let at = y * stride + column * TILE;
                    let Some(texels) = self.heights.w[at..].first_chunk::<TILE>() else { continue };
                    let u = STEPS + F8::splat((column * TILE) as f32 + 0.5);
                    let ground = u * F8::splat(self.lean[0]) + F8::splat(self.lean[1] * (y as f32 + 0.5));
                    let level = F8::new(*texels) - ground;
                    (low, high) = (low.fast_min(level), high.fast_max(level));
                }
                let least = low.to_array().into_iter().fold(f32::MAX, f32::min);
                let most = high.to_array().into_iter().fold(EMPTY, f32::max);
                self.own[row * TILES + column] = [least, most];
            }
        }
        let span = |i: usize| i.saturating_sub(AROUND)..(i + AROUND + 1).min(TILES);
        let join = |a: [f32; 2], b: &[f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let rows = (from / TILE).saturating_sub(AROUND)..(to.div_ceil(TILE) + AROUND).min(TILES);
        for y in rows {
            let mut column_ranges = [[f32::MAX, EMPTY]; TILES];
            for row in span(y) {
                let line = &self.own[row * TILES..(row + 1) * TILES];
                column_ranges.iter_mut().zip(line).for_each(|(all, own)| *all = join(*all, own));
            }
            for x in 0..TILES {
                self.ranges[y * TILES + x] = column_ranges[span(x)].iter().fold([f32::MAX, EMPTY], join);
            }
        }
    }

    /// Whether a shadow can fall on anything at least as high as `least` above level ground between two corners, texels.
    pub(crate) fn may_shade(&self, from: [f32; 2], to: [f32; 2], least: f32) -> bool {
        let tile = |x: f32| (x.max(0.0) as usize / TILE).min(TILES - 1);
        let columns = tile(from[0])..tile(to[0]) + 1;
        (tile(from[1])..tile(to[1]) + 1)
            .any(|y| self.ranges[y * TILES..][columns.clone()].iter().any(|range| range[1] > least + OFFSET))
    }

    /// Which points the map knows something about.
    #[inline(always)]
    pub(crate) fn inside(&self, at: &Places) -> F8 {
        let (low, high) = (F8::splat(MARGIN as f32), F8::splat((MARGIN + INNER) as f32));
        at.u.simd_ge(low) & at.v.simd_ge(low) & at.u.simd_lt(high) & at.v.simd_lt(high)
    }

    /// Shares of the light that reach eight points of normals `n`, of those in `wanted`; 1 for others.
    #[inline(always)]
    pub(crate) fn light(&self, at: &Places, n: &V8, wanted: F8) -> F8 {
        let inside = (self.inside(at) & wanted).to_bitmask();
        let [first, last] = self.heights.touched;
        if inside == 0 || first >= last {
            return F8::ONE;
        }
        let tile = |x: F8| {
            (x.fast_max(F8::ZERO).fast_min(F8::splat((EDGE - 1) as f32))).fast_trunc_int() >> TILE_BITS
        };
        let tiles = (tile(at.v) * i32x8::splat(TILES as i32) + tile(at.u)).to_array();
        let ranges = tiles.map(|i| self.ranges[i as usize % (TILES * TILES)]);
        let most = F8::new(ranges.map(|[_, most]| most));
        let near = most.simd_gt(at.level + F8::splat(OFFSET)).to_bitmask() & inside;
        if near == 0 { F8::ONE } else { self.filtered(at, n, near, &ranges) }
    }

    /// The shares of the points `near` something higher, by the ranges of heights around them.
    #[inline(never)]
    fn filtered(&self, at: &Places, n: &V8, near: u32, ranges: &[[f32; 2]; LANES]) -> F8 {
        let surfaces = Surfaces::new(self, at, n);
        let level = at.level.to_array();
        let one = |i: usize| surfaces.filter(self, i).share(ranges[i].map(|end| end - level[i]));
        let length = if near == 0xFF { surfaces.run() } else { f32::MAX };
        if length > LONG_RUN {
            return F8::new(std::array::from_fn(|i| if near >> i & 1 == 1 { one(i) } else { 1.0 }));
        }
        let known @ [a, b, c, d] = NODES.map(one);
        // What is narrower than the gaps is still seen from beside it: no filter is narrower than they are.
        if known == [0.0; 4] || known == [1.0; 4] {
            return F8::splat(a);
        }
        if length > RUN { F8::new([a, one(1), b, one(3), one(4), c, one(6), d]) } else { run_of(known) }
    }
}

/// Values of a run of eight from those at [`NODES`]: the cubic through them.
fn run_of(known: [f32; 4]) -> F8 {
    let nodes = NODES.map(|node| F8::splat(node as f32));
    let mut sum = F8::ZERO;
    for (i, value) in known.into_iter().enumerate() {
        let mut term = F8::splat(value);
        for j in (0..NODES.len()).filter(|&j| j != i) {
            term *= (STEPS - nodes[j]) * F8::splat(1.0 / (NODES[i] as f32 - NODES[j] as f32));
        }
        sum += term;
    }
    sum.fast_max(F8::ZERO).fast_min(F8::ONE)
}

/// What is around one point.
///
/// A thing hides light that comes to a point from within the lamp's cone only: what is farther away to the side than its
/// height times the lamp's width does not count, so that a surface that rises beside the point does not darken it.
struct Filter<'a> {
    map: &'a ShadowMap,
    place: [f32; 3],
    /// Rise of the surface itself a texel along each axis, m.
    slope: [f32; 2],
    /// The same, but not steeper than heights can be told from.
    tilt: [f32; 2],
    /// What is not higher than this above the surface is the surface, m.
    bias: f32,
    /// Half the width of the lamp's cone a metre, texels.
    cone: f32,
}

/// Eight points and what the surfaces around them are, as in [`Filter`].
struct Surfaces {
    place: [F8; 3],
    normal: V8,
    slope: [[f32; LANES]; 2],
    tilt: [[f32; LANES]; 2],
    bias: [f32; LANES],
}

impl Surfaces {
    fn new(map: &ShadowMap, at: &Places, n: &V8) -> Self {
        let along = |axis: usize| n.dot(V8::splat(&map.axes[axis]));
        let inverse = F8::ONE / along(2).fast_max(F8::splat(LEAST_COSINE));
        let texel = F8::splat(1.0 / map.texels_per_metre);
        let slope = [0, 1].map(|axis| -along(axis) * inverse * texel);
        let most = F8::splat(STEEPEST) * texel;
        let bent = F8::splat(NARROWEST * BENT) * texel * inverse * inverse;
        Self {
            place: [at.u, at.v, at.height],
            normal: *n,
            slope: slope.map(F8::to_array),
            tilt: slope.map(|rise| rise.fast_max(-most).fast_min(most).to_array()),
            bias: (F8::splat(OFFSET) * inverse + bent).to_array(),
        }
    }

    fn filter<'a>(&self, map: &'a ShadowMap, i: usize) -> Filter<'a> {
        Filter {
            map,
            place: self.place.map(|x| x.to_array()[i]),
            slope: self.slope.map(|rise| rise[i]),
            tilt: self.tilt.map(|rise| rise[i]),
            bias: self.bias[i],
            cone: map.tangent * map.texels_per_metre,
        }
    }

    /// Length of the line along which the points lie evenly on a flat surface, texels; endless if they do not.
    fn run(&self) -> f32 {
        let [u, v, _] = self.place;
        let spans = [u, v].map(|x| {
            let [first, .., last] = x.to_array();
            let line = F8::splat(first) + STEPS * F8::splat((last - first) / (LANES - 1) as f32);
            let even = (x - line).abs().simd_lt(F8::splat(UNEVEN)).all();
            if even { (last - first).abs() } else { f32::MAX }
        });
        let first = V3::from(self.normal.to_arrays().map(|axis| axis[0]));
        // Heights follow the plane through the first point.
        let rise = |axis: usize| {
            let from = F8::splat(self.place[axis].to_array()[0]);
            (self.place[axis] - from) * F8::splat(self.slope[axis][0])
        };
        let plane = F8::splat(self.place[2].to_array()[0]) + rise(0) + rise(1);
        let on_plane = (self.place[2] - plane).abs().simd_lt(F8::splat(OFFSET)).all();
        let flat = self.normal.dot(V8::splat(&first)).simd_gt(F8::splat(FLAT)).all();
        if flat && on_plane { spans[0].max(spans[1]) } else { f32::MAX }
    }
}

impl Filter<'_> {
    /// Share of the light, 0..=1; what is around is higher above level ground than the point by numbers of a range, m.
    fn share(&self, [least, most]: [f32; 2]) -> f32 {
        let both = |of: fn(&Self, usize) -> f32| of(self, 0) + of(self, 1);
        let steepest = both(|f, axis| f.slope[axis].abs() + f.map.lean[axis].abs());
        if least > self.bias + steepest * WIDEST {
            return 0.0;
        }
        let uneven = both(|f, axis| (f.map.lean[axis] - f.tilt[axis]).abs());
        let reach = (NARROWEST + (most + uneven * WIDEST) * self.cone).clamp(NARROWEST, WIDEST);
        let [open, hidden, above] = match reach {
            ..=ONE_VECTOR => self.sums::<1, 1, true>(reach),
            _ => self.sums::<2, 2, true>(reach),
        };
        if hidden <= 0.0 {
            return 1.0;
        }
        if open <= 0.0 {
            return 0.0;
        }
        let width = (above / hidden * self.cone).clamp(NARROWEST, reach);
        let [open, hidden, _] = match width {
            ..=ONE_VECTOR => self.sums::<1, 1, false>(width),
            _ => self.sums::<2, 2, false>(width),
        };
        if hidden <= 0.0 { 1.0 } else { open / (open + hidden) }
    }

    /// Weights of what lets light through and of what hides it within `radius` texels, and the latter's weighted height
    /// above the surface; of every `STEP`th row, and as wide as `CHUNKS` vectors. A `SEARCH` weighs what hides light by the
    /// cone alone, so that it does not matter how far it reaches.
    #[inline(always)]
    fn sums<const CHUNKS: usize, const STEP: usize, const SEARCH: bool>(&self, radius: f32) -> [f32; 3] {
        let [u, v, height] = self.place;
        let first = (u - radius) as usize;
        let (from, to) = ((v - radius) as usize, (v + radius) as usize + 1);
        let inverse2 = 1.0 / (radius * radius);
        let across: [F8; CHUNKS] =
            std::array::from_fn(|c| STEPS + F8::splat((first + c * LANES) as f32 + 0.5 - u));
        let across2 = across.map(|d| d * d);
        // A paraboloid's worth of weight: softer than a box, and still separable.
        let weights = across2.map(|d2| (F8::ONE - d2 * F8::splat(inverse2)).fast_max(F8::ZERO));
        let rise = across.map(|d| d * F8::splat(self.slope[0]));
        let tilt = across.map(|d| d * F8::splat(self.tilt[0]) + F8::splat(height));
        let limit = F8::splat(height + self.bias);
        let [cone, narrowest] = [self.cone, NARROWEST].map(F8::splat);
        let widest = F8::splat(if SEARCH { radius } else { f32::MAX });
        let (mut open, mut hidden, mut above) = (F8::ZERO, F8::ZERO, F8::ZERO);
        let stride = self.map.heights.stride();
        for row in (from.div_ceil(STEP) * STEP..to).step_by(STEP) {
            let d = row as f32 + 0.5 - v;
            let share = F8::splat((1.0 - d * d * inverse2).max(0.0));
            let [row_rise, row_tilt, d2] = [self.slope[1] * d, self.tilt[1] * d, d * d].map(F8::splat);
            let texels = self.map.heights.w.get(row * stride + first..).unwrap_or_default();
            for (c, texels) in texels.as_chunks::<LANES>().0.iter().take(CHUNKS).enumerate() {
                let heights = F8::new(*texels);
                let weight = weights[c] * share;
                let higher = heights.simd_gt(limit + (rise[c] + row_rise).fast_max(F8::ZERO));
                open += weight & !higher;
                let rise = heights - tilt[c] - row_tilt;
                let reach = (rise * cone + narrowest).fast_min(widest);
                // Whole for all that is as high as what it was sought by, and fading to the cone's border.
                let within = (reach * reach - across2[c] - d2) * F8::splat(1.0 / (NARROWEST * NARROWEST));
                let within = higher & within.fast_max(F8::ZERO).fast_min(F8::ONE);
                if SEARCH {
                    hidden += within;
                    above += within * rise;
                } else {
                    hidden += weight * within;
                }
            }
        }
        [open, hidden, above].map(sum)
    }
}

/// In one order on every machine.
fn sum(x: F8) -> f32 {
    let [a, b, c, d, e, f, g, h] = x.to_array();
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}
