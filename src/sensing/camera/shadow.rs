//! Soft shadows of the key light: a map of the heights nearest to it, and a filter as wide as the penumbra (Fernando,
//! Percentage-Closer Soft Shadows, SIGGRAPH sketches 2005).

use super::{V3, raster::Samples};
use crate::scene::Lighting;

/// Texels along an edge of the map.
const EDGE: usize = 1024;
/// Texels along an edge of the tiles that know whether a shadow can be near.
const TILE: usize = 16;
const TILES: usize = EDGE / TILE;
/// A surface is in the shadow of what is higher by more than this, m.
const BIAS: f32 = 2.5e-3;
/// Step of the search for what casts the shadow, texels; two of them reach as far as the widest filter, so that there is
/// no seam where the search finds all dark or nothing.
const SEARCH: f32 = 6.0;
/// Widest filter, texels to each side.
const WIDEST: f32 = 12.0;
/// Heights below all.
const EMPTY: f32 = -1e9;

/// Shadow map of a set of casters.
#[derive(Clone, Debug)]
pub(super) struct ShadowMap {
    axes: [V3; 3],
    centre: V3,
    texels_per_metre: f32,
    tangent: f32,
    heights: Samples,
    /// Greatest height in and around each tile.
    tiles: Vec<f32>,
}

impl ShadowMap {
    /// An empty map for a light.
    pub fn new(lighting: &Lighting) -> Self {
        let up: V3 = lighting.key.direction_w.normalize().cast();
        let side = if up.z.abs() < 0.99 { V3::z() } else { V3::x() };
        let u = side.cross(&up).normalize();
        let mut map = Self {
            axes: [u, up.cross(&u), up],
            centre: lighting.shadow_centre_w.cast(),
            texels_per_metre: EDGE as f32 / (2.0 * lighting.shadow_radius_m as f32),
            tangent: lighting.key.softness_rad.tan() as f32,
            heights: Samples::default(),
            tiles: vec![EMPTY; TILES * TILES],
        };
        map.clear();
        map
    }

    pub fn clear(&mut self) {
        self.heights.reset(EDGE, EDGE, EMPTY, false);
    }

    /// Place of a point in the map: texels, and height towards the light, m.
    pub fn place(&self, p_w: &V3) -> [f32; 3] {
        let d = p_w - self.centre;
        let at = |axis: usize| d.dot(&self.axes[axis]) * self.texels_per_metre + 0.5 * EDGE as f32;
        [at(0), at(1), d.dot(&self.axes[2])]
    }

    /// Adds casters.
    pub fn draw(&mut self, positions: &[V3], triangles: &[[u32; 3]]) {
        let places: Vec<[f32; 3]> = positions.iter().map(|p| self.place(p)).collect();
        for t in triangles {
            // Faces towards the light only: u × v points to it, so that they run the positive way.
            self.heights.draw::<false>(t.map(|v| places[v as usize]), 1.0, 0, None);
        }
    }

    /// To be called when all casters are drawn.
    pub fn finish(&mut self) {
        self.tiles.fill(EMPTY);
        let [from, to] = self.heights.rows;
        let mut own = vec![EMPTY; TILES * TILES];
        for y in from..to {
            let row = &self.heights.w[y * EDGE..(y + 1) * EDGE];
            for (x, chunk) in row.chunks_exact(TILE).enumerate() {
                let highest = chunk.iter().copied().fold(EMPTY, f32::max);
                let tile = &mut own[y / TILE * TILES + x];
                *tile = tile.max(highest);
            }
        }
        if from >= to {
            return;
        }
        for y in (from / TILE).saturating_sub(1)..(to.div_ceil(TILE) + 1).min(TILES) {
            for x in 0..TILES {
                let (ys, xs) =
                    (y.saturating_sub(1)..(y + 2).min(TILES), x.saturating_sub(1)..(x + 2).min(TILES));
                let around = ys.flat_map(|y| xs.clone().map(move |x| y * TILES + x));
                self.tiles[y * TILES + x] = around.map(|i| own[i]).fold(EMPTY, f32::max);
            }
        }
    }

    /// Whether a shadow can fall on `place`.
    #[inline]
    pub fn may_shade(&self, place: &[f32; 3]) -> bool {
        let inside = |x: f32| x >= 0.0 && x < EDGE as f32;
        if !(inside(place[0]) && inside(place[1])) {
            return false;
        }
        self.tiles[place[1] as usize / TILE * TILES + place[0] as usize / TILE] > place[2] + BIAS
    }

    /// Share of the light that reaches `place` on a surface of normal `n`, 0..=1.
    pub fn light(&self, place: &[f32; 3], n: &V3) -> f32 {
        if !self.may_shade(place) {
            return 1.0;
        }
        // Where the surface itself would be, a texel away along each axis.
        let steep = (n.dot(&self.axes[2]) * self.texels_per_metre).max(0.1 * self.texels_per_metre);
        let slope = [-n.dot(&self.axes[0]) / steep, -n.dot(&self.axes[1]) / steep];
        let limit = |dx: f32, dy: f32| place[2] + BIAS + (slope[0] * dx + slope[1] * dy).max(0.0);
        let (mut above, mut count) = (0.0, 0);
        for j in -2..=2 {
            for i in -2..=2 {
                let (dx, dy) = (i as f32 * SEARCH, j as f32 * SEARCH);
                let height = self.height(place[0] + dx, place[1] + dy);
                if height > limit(dx, dy) {
                    above += height - place[2];
                    count += 1;
                }
            }
        }
        if count == 0 {
            return 1.0;
        }
        // Dark all around: well inside of the shadow.
        if count == 25 {
            return 0.0;
        }
        let radius = (above / count as f32 * self.tangent * self.texels_per_metre).clamp(1.2, WIDEST);
        let mut open = 0.0;
        for j in -2..=2 {
            for i in -2..=2 {
                let (dx, dy) = (i as f32 * radius * 0.5, j as f32 * radius * 0.5);
                open += self.open(place[0] + dx, place[1] + dy, limit(dx, dy));
            }
        }
        open / 25.0
    }

    fn height(&self, x: f32, y: f32) -> f32 {
        let index = |t: f32| (t.max(0.0) as usize).min(EDGE - 1);
        self.heights.w[index(y) * EDGE + index(x)]
    }

    /// Bilinear share of the four texels around (x, y) that are not above `limit`.
    fn open(&self, x: f32, y: f32, limit: f32) -> f32 {
        let (x, y) = ((x - 0.5).clamp(0.0, (EDGE - 2) as f32), (y - 0.5).clamp(0.0, (EDGE - 2) as f32));
        let (i, j) = (x as usize, y as usize);
        let (s, t) = (x - i as f32, y - j as f32);
        let free = |k: usize| if self.heights.w[k] > limit { 0.0 } else { 1.0 };
        let k = j * EDGE + i;
        let low = free(k) * (1.0 - s) + free(k + 1) * s;
        let high = free(k + EDGE) * (1.0 - s) + free(k + EDGE + 1) * s;
        low * (1.0 - t) + high * t
    }
}
