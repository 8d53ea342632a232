//! Textures of flat faces and of parts of curved surfaces.
//!
//! A chart maps surface points to texels by projection along one direction. Its texture is painted on first use from
//! the materials of the surface and filtered by a mip map (Williams, Pyramidal Parametrics, 1983).

use std::sync::{Arc, OnceLock};

use wide::{bytemuck::cast, i32x8, u32x8};

use crate::{
    geometry::shape::Shape,
    scene::Visual,
    sensing::camera::{
        math::V3,
        shade::pattern::{self, sample_visual},
        simd::{LANES, Vec3x8, approx_log2, f32x8},
    },
};

/// Maximum number of texels along an edge.
const MAX_TEXELS: f32 = 1536.0;
/// Minimum edge of a texel, m.
pub(crate) const MIN_TEXEL: f32 = 0.8e-3;
/// Edge of a texel on surfaces with text, m.
pub(crate) const TEXT_TEXEL: f32 = 0.3e-3;
/// Texels across the finest feature of a pattern.
const TEXELS_PER_FEATURE: f32 = 8.0;
/// Margin in texels painted around triangles: bilinear sampling reads neighbours.
const PAINT_MARGIN: f32 = 1.5;

/// Albedo (linear RGB) and roughness.
type Texel = [f32; 4];

/// A projected part of a surface and its texture.
#[derive(Clone, Debug)]
pub(crate) struct TextureChart {
    /// Corner of the texture in the object frame, m.
    origin: V3,
    /// Unit axes of the texture, and the direction of projection.
    u: V3,
    v: V3,
    n: V3,
    /// Edge of a texel, m.
    texel: f32,
    /// Width and height, texels.
    size: [usize; 2],
    source: ChartSource,
    /// Painted on first use, since many charts are never visible, e.g. undersides.
    mips: OnceLock<Vec<MipLevel>>,
}

/// Source of a texture.
#[derive(Clone, Debug)]
enum ChartSource {
    /// A flat face of one material.
    Flat(Visual),
    Curved(CurvedChart),
}

/// Materials of a curved surface, by position.
#[derive(Debug)]
pub(crate) struct SurfaceMaterial {
    pub(crate) shape: Shape,
    pub(crate) visuals: Vec<Visual>,
}

/// A vertex of a curved chart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChartVertex {
    pub(crate) position: V3,
    pub(crate) normal: V3,
}

/// A part of a curved surface.
#[derive(Clone, Debug)]
pub(crate) struct CurvedChart {
    pub(crate) material: Arc<SurfaceMaterial>,
    pub(crate) triangles: Vec<[ChartVertex; 3]>,
}

impl TextureChart {
    /// The chart of a flat face with unit normal `n` and these corners.
    pub(crate) fn flat(n: &V3, corners: &[V3], visual: &Visual) -> Self {
        let min_texel = if pattern::has_text(visual) { TEXT_TEXEL } else { MIN_TEXEL };
        let texel = |size: f32| min_texel.max(pattern::finest_feature(visual).min(size) / TEXELS_PER_FEATURE);
        Self::new(n, corners, texel, ChartSource::Flat(visual.clone()))
    }

    /// The chart of a curved part, projected along the unit vector `n`, with texels of edge `texel`, m.
    pub(crate) fn curved(n: &V3, texel: f32, curved: CurvedChart) -> Self {
        let corners: Vec<V3> = curved.triangles.iter().flatten().map(|vertex| vertex.position).collect();
        Self::new(n, &corners, |_| texel, ChartSource::Curved(curved))
    }

    /// `texel` returns the edge of a texel for a chart of a given size, both m.
    fn new(n: &V3, corners: &[V3], texel: impl Fn(f32) -> f32, source: ChartSource) -> Self {
        let u = if n.x.abs() < 0.9 { V3::x() } else { V3::y() };
        let u = (u - n * u.dot(n)).normalize();
        let v = n.cross(&u);
        let range = |axis: &V3| {
            corners.iter().map(|c| c.dot(axis)).fold([f32::MAX, f32::MIN], |b, x| [b[0].min(x), b[1].max(x)])
        };
        let ([u0, u1], [v0, v1]) = (range(&u), range(&v));
        let longest = (u1 - u0).max(v1 - v0);
        let texel = texel(longest).max(longest / MAX_TEXELS);
        let origin = u * u0 + v * v0 + n * corners[0].dot(n);
        let size = [u1 - u0, v1 - v0].map(|x| (x / texel).ceil().max(1.0) as usize);
        Self { origin, u, v, n: *n, texel, size, source, mips: OnceLock::new() }
    }

    /// Texture coordinates of a point of the object frame, texels.
    pub(crate) fn uv(&self, p: &V3) -> [f32; 2] {
        let d = p - self.origin;
        [d.dot(&self.u) / self.texel, d.dot(&self.v) / self.texel]
    }

    /// Albedo and roughness at texture coordinates `[u, v]`, averaged over about `footprint`, m (trilinear filtering).
    pub(crate) fn sample(&self, [u, v]: [f32x8; 2], footprint: f32x8) -> (Vec3x8, f32x8) {
        let mips = self.mips.get_or_init(|| self.paint());
        let coarsest = f32x8::splat((mips.len() - 1) as f32);
        let texels = footprint * f32x8::splat(1.0 / self.texel);
        let level = approx_log2(texels.fast_max(f32x8::ONE)).fast_max(f32x8::ZERO).fast_min(coarsest);
        let lanes = level.to_array();
        let low = lanes.into_iter().fold(f32::MAX, f32::min) as usize;
        let high = lanes.into_iter().fold(0.0, f32::max).ceil() as usize;
        let mut sum = [f32x8::ZERO; 4];
        for (k, mip) in mips.iter().enumerate().take(high + 1).skip(low) {
            let weight = (f32x8::ONE - (level - f32x8::splat(k as f32)).abs()).fast_max(f32x8::ZERO);
            let scale = f32x8::splat(1.0 / (1_u32 << k) as f32);
            let values = mip.sample(u * scale, v * scale);
            (0..4).for_each(|c| sum[c] += weight * values[c]);
        }
        // Textures hold square roots of the albedo.
        let [x, y, z, roughness] = sum;
        (Vec3x8 { x: x * x, y: y * y, z: z * z }, roughness)
    }

    fn paint(&self) -> Vec<MipLevel> {
        let [width, height] = self.size;
        let mut texels: Vec<Texel> = match &self.source {
            ChartSource::Flat(visual) => (0..width * height)
                .map(|i| {
                    let [x, y] = [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5];
                    let p = self.origin + (self.u * x + self.v * y) * self.texel;
                    sample_visual(visual, &p, &self.n, self.texel).material.texel()
                })
                .collect(),
            ChartSource::Curved(curved) => self.paint_curved(curved),
        };
        let mut size = self.size;
        let mut mips = vec![MipLevel::new(&texels, size)];
        while size[0].max(size[1]) > 1 {
            (texels, size) = halve(&texels, size);
            mips.push(MipLevel::new(&texels, size));
        }
        mips
    }

    fn paint_curved(&self, curved: &CurvedChart) -> Vec<Texel> {
        let mut points: Vec<Option<SurfacePoint>> = vec![None; self.size[0] * self.size[1]];
        for corners in &curved.triangles {
            project_triangle(corners, corners.map(|c| self.uv(&c.position)), self.size, &mut points);
        }
        let SurfaceMaterial { shape, visuals } = &*curved.material;
        let texel = |point: &SurfacePoint| {
            let p = &point.position;
            let id = if visuals.len() > 1 { shape.material(&p.cast()) as usize } else { 0 };
            let n = point.normal.try_normalize(0.0).unwrap_or_else(V3::z);
            let sample = match visuals.get(id) {
                Some(visual) => sample_visual(visual, p, &n, self.texel),
                None => sample_visual(&Visual::default(), p, &n, self.texel),
            };
            sample.material.texel()
        };
        fill_gaps(points.iter().map(|point| point.as_ref().map(texel)).collect(), self.size)
    }
}

/// The point of a surface that a texel shows.
#[derive(Clone, Debug)]
struct SurfacePoint {
    position: V3,
    normal: V3,
    /// Signed distance from the border of its triangle, texels, positive inside.
    inset: f32,
}

/// Enters the points of a triangle at the texels that it covers or nearly covers. Of several points, a texel keeps
/// the one with the greatest inset.
fn project_triangle(
    corners: &[ChartVertex; 3],
    uvs: [[f32; 2]; 3],
    size: [usize; 2],
    points: &mut [Option<SurfacePoint>],
) {
    let cross =
        |a: [f32; 2], b: [f32; 2], p: [f32; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let area = cross(uvs[0], uvs[1], uvs[2]);
    if area <= 0.0 {
        return;
    }
    let range = |axis: usize| {
        let [a, b, c] = uvs.map(|p| p[axis]);
        let (low, high) = (a.min(b).min(c) - PAINT_MARGIN, a.max(b).max(c) + PAINT_MARGIN);
        low.max(0.0) as usize..(high.max(0.0).ceil() as usize).min(size[axis])
    };
    for y in range(1) {
        for x in range(0) {
            let p = [x as f32 + 0.5, y as f32 + 0.5];
            let mut inset = f32::MAX;
            let barycentric: [f32; 3] = std::array::from_fn(|i| {
                let (a, b) = (uvs[(i + 1) % 3], uvs[(i + 2) % 3]);
                let area = cross(a, b, p);
                inset = inset.min(area / (b[0] - a[0]).hypot(b[1] - a[1]));
                area
            });
            let known = &mut points[y * size[0] + x];
            if inset > -PAINT_MARGIN && known.as_ref().is_none_or(|known| known.inset < inset) {
                let weights = barycentric.map(|w| w.max(0.0));
                let sum: f32 = weights.iter().sum();
                let interpolate =
                    |of: [V3; 3]| (of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2]) / sum;
                *known = Some(SurfacePoint {
                    position: interpolate(corners.map(|c| c.position)),
                    normal: interpolate(corners.map(|c| c.normal)),
                    inset,
                });
            }
        }
    }
}

/// Fills unpainted texels with the mean of their surroundings from coarser copies (pull-push; Gortler et al., The
/// Lumigraph, 1996), so that coarse mip levels are clean at the border of the chart.
fn fill_gaps(texels: Vec<Option<Texel>>, size: [usize; 2]) -> Vec<Texel> {
    if texels.iter().all(Option::is_some) || size == [1, 1] {
        return texels.into_iter().map(Option::unwrap_or_default).collect();
    }
    let half = size.map(|n| n.div_ceil(2));
    let mean = |i: usize| {
        let (x, y) = (2 * (i % half[0]), 2 * (i / half[0]));
        let block = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].into_iter();
        let painted: Vec<Texel> = block
            .filter(|&(x, y)| x < size[0] && y < size[1])
            .filter_map(|(x, y)| texels[y * size[0] + x])
            .collect();
        let share = 1.0 / painted.len().max(1) as f32;
        (!painted.is_empty())
            .then(|| std::array::from_fn(|c| painted.iter().map(|t| t[c]).sum::<f32>() * share))
    };
    let coarse = fill_gaps((0..half[0] * half[1]).map(mean).collect(), half);
    let parent = |i: usize| coarse[(i / size[0] / 2) * half[0] + i % size[0] / 2];
    texels.iter().enumerate().map(|(i, texel)| texel.unwrap_or_else(|| parent(i))).collect()
}

/// Halves the size of a texture; each texel is the mean of up to four.
fn halve(texels: &[Texel], size: [usize; 2]) -> (Vec<Texel>, [usize; 2]) {
    let [width, height] = size.map(|n| n.div_ceil(2));
    let texel = |i: usize| {
        let (x, y) = (2 * (i % width), 2 * (i / width));
        let (x1, y1) = ((x + 1).min(size[0] - 1), (y + 1).min(size[1] - 1));
        let block = [(x, y), (x1, y), (x, y1), (x1, y1)].map(|(x, y)| texels[x + size[0] * y]);
        std::array::from_fn(|c| 0.25 * block.iter().map(|t| t[c]).sum::<f32>())
    };
    ((0..width * height).map(texel).collect(), [width, height])
}

/// Texels packed to bytes: square roots of the albedo, which give dark colours finer steps, and roughness.
#[derive(Clone, Debug)]
struct MipLevel {
    size: [usize; 2],
    /// Row-major. The last row and column are duplicated, so that every texel has neighbours.
    texels: Vec<u32>,
}

impl MipLevel {
    fn new(texels: &[Texel], size: [usize; 2]) -> Self {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u32;
        let stride = size[0] + 1;
        let packed = (0..stride * (size[1] + 1)).map(|i| {
            let (x, y) = ((i % stride).min(size[0] - 1), (i / stride).min(size[1] - 1));
            let [r, g, b, roughness] = texels[x + size[0] * y];
            byte(r.sqrt()) | byte(g.sqrt()) << 8 | byte(b.sqrt()) << 16 | byte(roughness) << 24
        });
        Self { size, texels: packed.collect() }
    }

    /// Bilinear interpolation, clamped at the edges; (u, v) in texels. Returns the four bytes scaled to 0..=1.
    #[inline(always)]
    fn sample(&self, u: f32x8, v: f32x8) -> [f32x8; 4] {
        let clamped = |x: f32x8, count: usize| {
            (x - f32x8::splat(0.5)).fast_max(f32x8::ZERO).fast_min(f32x8::splat((count - 1) as f32))
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
        let fraction = |x: f32x8, i: i32x8| -> u32x8 {
            cast(((x - f32x8::from_i32x8(i)) * f32x8::splat(256.0)).fast_trunc_int())
        };
        blend_bytes(corners.map(u32x8::new), fraction(x, i), fraction(y, j))
    }
}

/// Blends four packed texels by fractions in 1/256, two bytes at a time.
#[inline(always)]
fn blend_bytes(corners: [u32x8; 4], x: u32x8, y: u32x8) -> [f32x8; 4] {
    let both = (x * y) >> 8;
    let weights = [u32x8::splat(256) - x - y + both, x - both, y - both, both];
    let mask = u32x8::splat(0x00FF_00FF);
    let (mut even, mut odd) = (u32x8::ZERO, u32x8::ZERO);
    for (texel, weight) in corners.into_iter().zip(weights) {
        even += (texel & mask) * weight;
        odd += ((texel >> 8) & mask) * weight;
    }
    let value = |x: u32x8| f32x8::from_i32x8(cast(x)) * f32x8::splat(1.0 / 65_280.0);
    let low = u32x8::splat(0xFFFF);
    [value(even & low), value(odd & low), value(even >> 16), value(odd >> 16)]
}
