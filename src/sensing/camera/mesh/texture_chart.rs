//! Large flat faces with patterns, and parts of curved ones with fine print: a few triangles each and a texture with a chain of halved copies (Williams, Pyramidal
//! Parametrics, 1983), baked from the pattern on the face itself.

use std::sync::OnceLock;

use wide::{bytemuck::cast, i32x8, u32x8};

use crate::sensing::camera::{
    V3,
    mesh::render_mesh::{Lod, accumulate, split},
    mesh::uv_atlas::{self, CurvedChart},
    shade::pattern::{self, MaterialSample},
    simd::{F8, LANES, V8, rough_log2},
};
use crate::{geometry::mesh::Mesh, scene::Visual};

/// Meshes of more triangles than this are not treated as a few facets.
const MOST_TRIANGLES: usize = 160;
/// Facets smaller than this across need no texture, m.
const LEAST_SIZE: f64 = 0.1;
/// Most texels along an edge, and the finest they get, m.
const MOST_TEXELS: f32 = 1536.0;
const FINEST: f32 = 0.8e-3;
/// Texels of surfaces with text, m.
pub(crate) const PRINT: f32 = 0.3e-3;
/// Texels across the finest feature of a pattern: no more are needed.
const TEXELS_A_FEATURE: f32 = 8.0;

/// A face: axes of its texture in the object frame and the texture.
#[derive(Clone, Debug)]
pub(crate) struct TextureChart {
    origin: V3,
    /// Unit axes.
    u: V3,
    v: V3,
    n: V3,
    /// Edge of a texel, m.
    texel: f32,
    size: [usize; 2],
    ground: Ground,
    /// Painted when it is first looked at: undersides never are.
    mips: OnceLock<Vec<Image>>,
}

/// What a texture is painted from.
#[derive(Clone, Debug)]
enum Ground {
    /// A flat face of one look.
    Flat(Visual),
    /// A part of a curved surface.
    CurvedChart(CurvedChart),
}

/// Texels as bytes: square roots of the albedo (so that dark colours have steps as fine as bright ones) and roughness.
/// The last row and column are there twice, so that every texel has neighbours.
#[derive(Clone, Debug)]
struct Image {
    size: [usize; 2],
    texels: Vec<u32>,
}

/// Whether a mesh is a few flat faces that are big, or printed.
pub(crate) fn worth_it(mesh: &Mesh, printed: bool) -> bool {
    mesh.triangles.len() <= MOST_TRIANGLES && (printed || mesh.area().sqrt() > LEAST_SIZE)
}

/// Each triangle pair or triangle of one plane and material becomes a facet.
pub(crate) fn bake(mesh: &Mesh, materials: &[u16], visuals: &[Visual]) -> (Lod, Vec<TextureChart>) {
    let points: Vec<V3> = mesh.vertices.iter().map(|v| v.cast()).collect();
    let (of, triangles) = split(&points, &mesh.triangles);
    let positions: Vec<V3> = of.iter().map(|&v| points[v as usize]).collect();
    let mut normals = vec![V3::zeros(); positions.len()];
    accumulate(&positions, &triangles, &mut normals);
    let mut planes: Vec<(V3, f32, u16, Vec<V3>)> = Vec::new();
    let mut facets_of = Vec::new();
    for (t, &material) in triangles.iter().zip(materials) {
        let corners = t.map(|v| positions[v as usize]);
        let n = (corners[1] - corners[0])
            .cross(&(corners[2] - corners[0]))
            .try_normalize(0.0)
            .unwrap_or_else(V3::z);
        let offset = n.dot(&corners[0]);
        let known = planes
            .iter()
            .position(|p| p.2 == material && p.0.dot(&n) > 0.99999 && (p.1 - offset).abs() < 1e-4);
        let index = known.unwrap_or_else(|| {
            planes.push((n, offset, material, Vec::new()));
            planes.len() - 1
        });
        planes[index].3.extend(corners);
        facets_of.push(index as u32);
    }
    let facets: Vec<TextureChart> =
        planes.iter().map(|(n, _, m, corners)| TextureChart::of(n, corners, &visuals[*m as usize])).collect();
    let looks = vec![
        MaterialSample { albedo: V3::zeros(), roughness: 1.0, metalness: 0.0, open: 1.0 };
        positions.len()
    ];
    let places = triangles.iter().zip(&facets_of).map(|(t, &facet)| {
        let facet: &TextureChart = &facets[facet as usize];
        t.map(|v| facet.place(&positions[v as usize]))
    });
    let mut level = Lod {
        places: places.collect(),
        patches: facets_of.clone(),
        positions,
        normals,
        looks,
        triangles,
        facets: facets_of,
        embedding: Vec::new(),
        spacing: FINEST,
        plain: false,
        flaw: 0.0,
    };
    // Metalness does not vary over a facet.
    for (t, &m) in level.triangles.iter().zip(materials) {
        t.iter().for_each(|&v| level.looks[v as usize].metalness = visuals[m as usize].metalness as f32);
    }
    (level, facets)
}

impl TextureChart {
    fn of(n: &V3, corners: &[V3], visual: &Visual) -> Self {
        let least = if pattern::printed(visual) { PRINT } else { FINEST };
        let texel = |size: f32| least.max(pattern::finest(visual).min(size) / TEXELS_A_FEATURE);
        Self::over(n, corners, texel, Ground::Flat(visual.clone()))
    }

    /// Part of a curved surface that faces mostly along the unit vector `n`, seen along that, with texels of edge `texel`, m.
    pub(crate) fn curved(n: &V3, corners: &[V3], texel: f32, curved: CurvedChart) -> Self {
        Self::over(n, corners, |_| texel, Ground::CurvedChart(curved))
    }

    /// `texel` gives the edge of a texel on a face of a size, m.
    fn over(n: &V3, corners: &[V3], texel: impl Fn(f32) -> f32, ground: Ground) -> Self {
        let u = if n.x.abs() < 0.9 { V3::x() } else { V3::y() };
        let u = (u - n * u.dot(n)).normalize();
        let v = n.cross(&u);
        let span = |axis: &V3| {
            corners.iter().map(|c| c.dot(axis)).fold([f32::MAX, f32::MIN], |b, x| [b[0].min(x), b[1].max(x)])
        };
        let ([u0, u1], [v0, v1]) = (span(&u), span(&v));
        let longest = (u1 - u0).max(v1 - v0);
        let texel = texel(longest).max(longest / MOST_TEXELS);
        let origin = u * u0 + v * v0 + n * corners[0].dot(n);
        let size = [u1 - u0, v1 - v0].map(|x| (x / texel).ceil().max(1.0) as usize);
        Self { origin, u, v, n: *n, texel, size, ground, mips: OnceLock::new() }
    }

    /// Place of a point of the object frame, texels of the finest copy.
    pub(crate) fn place(&self, p: &V3) -> [f32; 2] {
        let d = p - self.origin;
        [d.dot(&self.u) / self.texel, d.dot(&self.v) / self.texel]
    }

    fn paint(&self) -> Vec<Image> {
        let [width, height] = self.size;
        let look = |visual: &Visual, i: usize| {
            let [x, y] = [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5];
            let p = self.origin + (self.u * x + self.v * y) * self.texel;
            pattern::look(visual, &p, &self.n, self.texel).0.painted()
        };
        let mut fine: Vec<[f32; 4]> = match &self.ground {
            Ground::Flat(visual) => (0..width * height).map(|i| look(visual, i)).collect(),
            Ground::CurvedChart(curved) => uv_atlas::paint(curved, self.size, self.texel, |p| self.place(p)),
        };
        let mut size = self.size;
        let mut mips = vec![Image::of(&fine, size)];
        while size[0].max(size[1]) > 1 {
            (fine, size) = halved(&fine, size);
            mips.push(Image::of(&fine, size));
        }
        mips
    }

    /// Albedo and roughness at places (texels), averaged over about `footprint`, m.
    pub(crate) fn sample(&self, [u, v]: [F8; 2], footprint: F8) -> (V8, F8) {
        let mips = self.mips.get_or_init(|| self.paint());
        let last = F8::splat((mips.len() - 1) as f32);
        let texels = footprint * F8::splat(1.0 / self.texel);
        let level = rough_log2(texels.fast_max(F8::ONE)).fast_max(F8::ZERO).fast_min(last);
        let levels = level.to_array();
        let low = levels.into_iter().fold(f32::MAX, f32::min) as usize;
        let high = levels.into_iter().fold(0.0, f32::max).ceil() as usize;
        let mut sum = [F8::ZERO; 4];
        for (k, image) in mips.iter().enumerate().take(high + 1).skip(low) {
            let weight = (F8::ONE - (level - F8::splat(k as f32)).abs()).fast_max(F8::ZERO);
            let scale = F8::splat(1.0 / (1_u32 << k) as f32);
            let values = image.at(u * scale, v * scale);
            (0..4).for_each(|c| sum[c] += weight * values[c]);
        }
        let [x, y, z, roughness] = sum;
        (V8 { x: x * x, y: y * y, z: z * z }, roughness)
    }
}

/// Half the size, each texel the mean of up to four.
fn halved(texels: &[[f32; 4]], from: [usize; 2]) -> (Vec<[f32; 4]>, [usize; 2]) {
    let [width, height] = from.map(|n| n.div_ceil(2));
    let texel = |i: usize| {
        let (x, y) = (2 * (i % width), 2 * (i / width));
        let (x1, y1) = ((x + 1).min(from[0] - 1), (y + 1).min(from[1] - 1));
        let four = [(x, y), (x1, y), (x, y1), (x1, y1)].map(|(x, y)| texels[x + from[0] * y]);
        std::array::from_fn(|c| 0.25 * four.iter().map(|t| t[c]).sum::<f32>())
    };
    ((0..width * height).map(texel).collect(), [width, height])
}

impl Image {
    fn of(texels: &[[f32; 4]], size: [usize; 2]) -> Self {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u32;
        let stride = size[0] + 1;
        let packed = (0..stride * (size[1] + 1)).map(|i| {
            let (x, y) = ((i % stride).min(size[0] - 1), (i / stride).min(size[1] - 1));
            let [r, g, b, roughness] = texels[x + size[0] * y];
            byte(r.sqrt()) | byte(g.sqrt()) << 8 | byte(b.sqrt()) << 16 | byte(roughness) << 24
        });
        Self { size, texels: packed.collect() }
    }

    /// Bilinear, clamped at the edges; (u, v) in texels. Values 0..=1 of the four bytes.
    #[inline(always)]
    fn at(&self, u: F8, v: F8) -> [F8; 4] {
        let clamped = |x: F8, most: usize| {
            (x - F8::splat(0.5)).fast_max(F8::ZERO).fast_min(F8::splat((most - 1) as f32))
        };
        let (x, y) = (clamped(u, self.size[0]), clamped(v, self.size[1]));
        let (i, j) = (x.fast_trunc_int(), y.fast_trunc_int());
        let stride = self.size[0] + 1;
        let first: [u32; LANES] = cast(j * i32x8::splat(stride as i32) + i);
        let mut corners = [[0_u32; LANES]; 4];
        for (lane, &first) in first.iter().enumerate() {
            let rows = self.texels.get(first as usize..first as usize + stride + 2);
            let rows = rows.unwrap_or_default();
            if let (Some(top), Some(bottom)) = (rows.first_chunk::<2>(), rows.last_chunk::<2>()) {
                (corners[0][lane], corners[1][lane]) = (top[0], top[1]);
                (corners[2][lane], corners[3][lane]) = (bottom[0], bottom[1]);
            }
        }
        let fraction = |x: F8, i: i32x8| -> u32x8 {
            cast(((x - F8::from_i32x8(i)) * F8::splat(256.0)).fast_trunc_int())
        };
        blend(corners.map(u32x8::new), fraction(x, i), fraction(y, j))
    }
}

/// Mixes four texels by fractions in 256ths, two bytes at a time.
#[inline(always)]
fn blend(corners: [u32x8; 4], x: u32x8, y: u32x8) -> [F8; 4] {
    let both = (x * y) >> 8;
    let weights = [u32x8::splat(256) - x - y + both, x - both, y - both, both];
    let mask = u32x8::splat(0x00FF_00FF);
    let (mut even, mut odd) = (u32x8::ZERO, u32x8::ZERO);
    for (texel, weight) in corners.into_iter().zip(weights) {
        even += (texel & mask) * weight;
        odd += ((texel >> 8) & mask) * weight;
    }
    let value = |x: u32x8| F8::from_i32x8(cast(x)) * F8::splat(1.0 / 65_280.0);
    let low = u32x8::splat(0xFFFF);
    [value(even & low), value(odd & low), value(even >> 16), value(odd >> 16)]
}
