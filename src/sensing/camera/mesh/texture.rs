//! Textures of flat faces and of parts of curved surfaces.
//!
//! A chart maps surface points to texels by projection along one direction. The levels of its mip map (Williams,
//! Pyramidal Parametrics, 1983) consist of tiles, which are painted from the materials of the surface when they are
//! first seen: most of a floor or of an underside never is.
//!
//! Flat meshes get one chart per plane. A curved surface with patterns is divided into connected parts that face mostly
//! along one axis; projection along that axis stretches them by less than √3.

use std::{
    collections::BTreeMap,
    sync::{Arc, OnceLock},
};

use serde::{Deserialize, Serialize};
use wide::{bytemuck::cast, i32x8, u32x8};

use super::lod::{CreasedMesh, Lod};
use crate::camera::{
    math::{LANES, V3, Vec3x8, approx_log2, f32x8},
    shade::pattern::{self, METALNESS, MaterialSample, PatternPoint, sample_visual},
};
use softvt_geometry::{mesh::Mesh, shape::Shape, union_find::UnionFind};
use softvt_scene::Visual;

/// Maximum number of triangles of a mesh that is textured plane by plane.
const MAX_FLAT_TRIANGLES: usize = 160;
/// Minimum size (square root of the area) of a mesh without text that is textured, m.
const MIN_FLAT_SIZE: f64 = 0.1;

/// Maximum number of texels along an edge.
const MAX_TEXELS: f32 = 1536.0;
/// Minimum edge of a texel, m.
const MIN_TEXEL: f32 = 0.8e-3;
/// Edge of a texel on surfaces with text, m.
const TEXT_TEXEL: f32 = 0.3e-3;
/// Texels across the finest feature of a pattern.
const TEXELS_PER_FEATURE: f32 = 8.0;
/// Minimum number of texels across a chart at its coarsest level, if it has as many at the finest.
const MIN_TEXELS_ACROSS: usize = 4;
/// Finest level whose tiles are the means of 4 × 4 painted points per texel. Tiles of finer levels, which have more
/// texels, are the means of 2 × 2.
const FIRST_DENSE_LEVEL: usize = 4;
/// Level to whose texels patterns are filtered at most: layers of labels are thin, and a wider filter would let the
/// material below shine through.
const MAX_FILTER_LEVEL: usize = 1;
/// Margin in texels painted around triangles: bilinear sampling reads neighbours.
const PAINT_MARGIN: f32 = 1.5;

/// Edge of a texel that shows the details of a visual on a chart of this size, both m.
fn finest_texel(visual: &Visual, size: f32) -> f32 {
    let min_texel = if pattern::has_text(visual) { TEXT_TEXEL } else { MIN_TEXEL };
    min_texel.max(pattern::finest_feature(visual).min(size) / TEXELS_PER_FEATURE)
}

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
    source: ChartSource,
    /// From fine to coarse.
    levels: Vec<MipLevel>,
}

/// Source of a texture.
#[derive(Clone, Debug)]
enum ChartSource {
    /// A flat face of one material.
    Flat(Visual),
    /// Triangles of a curved surface.
    Curved { material: Arc<SurfaceMaterial>, triangles: Vec<[ChartVertex; 3]> },
}

/// Materials of a curved surface, by position.
#[derive(Debug)]
pub(crate) struct SurfaceMaterial {
    pub(crate) shape: Shape,
    pub(crate) visuals: Vec<Visual>,
}

/// A vertex of a curved chart.
#[derive(Clone, Copy, Debug)]
struct ChartVertex {
    position: V3,
    normal: V3,
}

/// True if a mesh has few faces, and they are large or have text: a texture is then cheaper than fine triangles.
pub(crate) fn suits_flat_charts(mesh: &Mesh, has_text: bool) -> bool {
    mesh.triangles.len() <= MAX_FLAT_TRIANGLES && (has_text || mesh.area().sqrt() > MIN_FLAT_SIZE)
}

/// Builds a level of detail with one chart for the triangles of each plane.
pub(crate) fn flat_charts(mesh: &Mesh, visual: &Visual) -> Lod {
    struct Plane {
        normal: V3,
        offset: f32,
        corners: Vec<V3>,
    }
    let CreasedMesh { positions, normals, triangles, .. } = CreasedMesh::new(mesh);
    let mut planes: Vec<Plane> = Vec::new();
    let mut chart_ids = Vec::new();
    for t in &triangles {
        let corners = t.map(|v| positions[v as usize]);
        let area = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let normal = area.try_normalize(0.0).unwrap_or_else(V3::z);
        let offset = normal.dot(&corners[0]);
        let known = planes
            .iter()
            .position(|plane| plane.normal.dot(&normal) > 0.99999 && (plane.offset - offset).abs() < 1e-4);
        let index = known.unwrap_or_else(|| {
            planes.push(Plane { normal, offset, corners: Vec::new() });
            planes.len() - 1
        });
        planes[index].corners.extend(corners);
        chart_ids.push(index as u32);
    }
    let texel = |size: f32| finest_texel(visual, size);
    let chart = |plane: &Plane| {
        TextureChart::new(&plane.normal, &plane.corners, texel, ChartSource::Flat(visual.clone()))
    };
    let charts: Vec<TextureChart> = planes.iter().map(chart).collect();
    // Albedo and roughness come from the texture; metalness does not vary over a chart.
    let mut material = MaterialSample::from([0.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
    material[METALNESS] = visual.metalness as f32;
    Lod {
        uvs: texture_coordinates(&positions, &triangles, &charts, &chart_ids),
        smoothing_groups: chart_ids.clone(),
        materials: vec![material; positions.len()],
        positions,
        normals,
        triangles,
        charts,
        chart_ids,
        vertex_spacing: MIN_TEXEL,
        ..Lod::default()
    }
}

/// Textures every triangle of a curved level.
///
/// The level then counts as uniform: its materials no longer require small triangles.
pub(crate) fn parameterize(lod: &mut Lod, material: &Arc<SurfaceMaterial>) {
    let texel =
        material.visuals.iter().map(|visual| finest_texel(visual, f32::MAX)).fold(MIN_TEXEL, f32::min);
    // The axis along which each triangle mostly faces, twice, plus 1 if it faces backwards.
    let face_direction = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| lod.positions[v as usize]);
        let n = (b - a).cross(&(c - a));
        2 * n.iamax() + usize::from(n[n.iamax()] < 0.0)
    };
    let directions: Vec<usize> = lod.triangles.iter().map(face_direction).collect();
    let mut connected = UnionFind::new(lod.triangles.len());
    // The first triangle of each direction at each vertex.
    let mut first_at = vec![[usize::MAX; 6]; lod.positions.len()];
    for (t, (corners, &direction)) in lod.triangles.iter().zip(&directions).enumerate() {
        for &v in corners {
            let first = &mut first_at[v as usize][direction];
            *first = t.min(*first);
            connected.union(*first, t);
        }
    }
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for t in 0..lod.triangles.len() {
        parts.entry(connected.find(t)).or_default().push(t);
    }
    let (mut charts, mut chart_ids) = (Vec::new(), vec![0; lod.triangles.len()]);
    for (first, part) in parts {
        let vertex =
            |v: u32| ChartVertex { position: lod.positions[v as usize], normal: lod.normals[v as usize] };
        part.iter().for_each(|&t| chart_ids[t] = charts.len() as u32);
        let triangles: Vec<_> = part.iter().map(|&t| lod.triangles[t].map(vertex)).collect();
        let corners: Vec<V3> = triangles.iter().flatten().map(|vertex| vertex.position).collect();
        let is_backwards = directions[first] % 2 == 1;
        let n = V3::ith(directions[first] / 2, if is_backwards { -1.0 } else { 1.0 });
        let source = ChartSource::Curved { material: material.clone(), triangles };
        charts.push(TextureChart::new(&n, &corners, |_| texel, source));
    }
    lod.uvs = texture_coordinates(&lod.positions, &lod.triangles, &charts, &chart_ids);
    (lod.charts, lod.chart_ids) = (charts, chart_ids);
    lod.is_uniform = true;
}

fn texture_coordinates(
    positions: &[V3],
    triangles: &[[u32; 3]],
    charts: &[TextureChart],
    chart_ids: &[u32],
) -> Vec<[[f32; 2]; 3]> {
    let of_triangle =
        |(t, &chart): (&[u32; 3], &u32)| t.map(|v| charts[chart as usize].uv(&positions[v as usize]));
    triangles.iter().zip(chart_ids).map(of_triangle).collect()
}

impl TextureChart {
    /// The chart of a surface with these corners, projected along the unit vector `n`. `texel` returns the edge of a
    /// texel for a chart of a given size, both m.
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
        // Narrow charts are not blended across until their border shows.
        let coarsest = (size[0].min(size[1]) / MIN_TEXELS_ACROSS).max(1).ilog2();
        let levels =
            (0..=coarsest).map(|level| MipLevel::new(size.map(|n| n.div_ceil(1 << level)))).collect();
        Self { origin, u, v, n: *n, texel, source, levels }
    }

    /// Texture coordinates of a point of the object frame, texels.
    fn uv(&self, p: &V3) -> [f32; 2] {
        let d = p - self.origin;
        [d.dot(&self.u) / self.texel, d.dot(&self.v) / self.texel]
    }

    /// Albedo and roughness at texture coordinates `[u, v]`, averaged over about `footprint`, m: bilinear in a level,
    /// and linear between levels in the half of the way between them (trilinear filtering in that half alone).
    pub(crate) fn sample(&self, [u, v]: [f32x8; 2], footprint: f32x8) -> (Vec3x8, f32x8) {
        let coarsest = f32x8::splat((self.levels.len() - 1) as f32);
        let texels = footprint * f32x8::splat(1.0 / self.texel);
        let level = approx_log2(texels.fast_max(f32x8::ONE)).fast_max(f32x8::ZERO).fast_min(coarsest);
        // A level contributes up to three quarters of the way to the next one.
        let reach = f32x8::splat(0.75);
        let low = extreme((level - reach).ceil().fast_max(f32x8::ZERO).fast_trunc_int(), i32::min);
        let high = extreme((level + reach).fast_trunc_int(), i32::max);
        let mut sum = [f32x8::ZERO; 4];
        for (k, mip) in (0..=high).zip(&self.levels).skip(low as usize) {
            let distance = (level - f32x8::splat(k as f32)).abs();
            let weight = f32x8::splat(1.5) - f32x8::splat(2.0) * distance;
            let weight = weight.fast_max(f32x8::ZERO).fast_min(f32x8::ONE);
            let scale = f32x8::splat(1.0 / (1_u32 << k) as f32);
            let values = mip.sample(u * scale, v * scale, |corner| self.paint(k as usize, corner));
            (0..4).for_each(|c| sum[c] += weight * values[c]);
        }
        let [x, y, z, roughness] = sum;
        (Vec3x8 { x, y, z }, roughness)
    }

    /// The tiles that have been painted.
    fn painted(&self) -> impl Iterator<Item = (TilePlace, &[u32])> {
        self.levels.iter().enumerate().flat_map(|(level, mip)| {
            let tiles = mip.tiles.iter().enumerate();
            tiles.filter_map(move |(index, tile)| Some((TilePlace { level, index }, &tile.get()?[..])))
        })
    }

    /// Paints the tile of a level whose first texel is `corner`.
    fn paint(&self, level: usize, corner: [usize; 2]) -> Box<Tile> {
        let finer = level.min(if level < FIRST_DENSE_LEVEL { 1 } else { 2 });
        let edge = |level: usize| self.texel * (1_u32 << level) as f32;
        let region = TexelRegion {
            texel: edge(level - finer),
            // A narrower filter would leave gaps between the painted points, and displace borders.
            filter: edge((level - finer).min(MAX_FILTER_LEVEL)),
            corner: corner.map(|at| at << finer),
            size: self.levels[level].tile_size(corner).map(|n| n << finer),
        };
        let mut texels = match &self.source {
            ChartSource::Flat(visual) => self.paint_flat(visual, &region),
            ChartSource::Curved { material, triangles } => self.paint_curved(material, triangles, &region),
        };
        let mut size = region.size;
        for _ in 0..finer {
            (texels, size) = halve(&texels, size);
        }
        let mut tile = Box::new([0; TILE_TEXELS]);
        for (row, texels) in tile.chunks_mut(TILE_STRIDE).zip(texels.chunks(size[0])) {
            row.iter_mut().zip(texels).for_each(|(packed, texel)| *packed = pack(texel));
        }
        tile
    }

    fn paint_flat(
        &self,
        visual: &Visual,
        &TexelRegion { texel, filter, corner, size: [width, height] }: &TexelRegion,
    ) -> Vec<Texel> {
        // Beyond its edges a face continues as at the edges.
        let last = self.levels[0].size.map(|count| count as f32 * self.texel / texel - 0.5);
        let point = |i: usize| {
            let at = [corner[0] + i % width, corner[1] + i / width];
            let [x, y] = [0, 1].map(|axis| (at[axis] as f32 + 0.5).min(last[axis]));
            PatternPoint { p: self.origin + (self.u * x + self.v * y) * texel, n: self.n }
        };
        let points: Vec<PatternPoint> = (0..width * height).map(point).collect();
        let mut texels = Vec::with_capacity(points.len());
        sample_visual(visual, &points, filter, |_, sample| texels.push(texel_of(&sample.material)));
        texels
    }

    fn paint_curved(
        &self,
        material: &SurfaceMaterial,
        triangles: &[[ChartVertex; 3]],
        &TexelRegion { texel, filter, corner, size }: &TexelRegion,
    ) -> Vec<Texel> {
        let mut points: Vec<Option<SurfacePoint>> = vec![None; size[0] * size[1]];
        let scale = self.texel / texel;
        for corners in triangles {
            let in_region = |uv: [f32; 2]| [0, 1].map(|axis| uv[axis] * scale - corner[axis] as f32);
            let uvs = corners.map(|c| in_region(self.uv(&c.position)));
            project_triangle(corners, uvs, size, &mut points);
        }
        let SurfaceMaterial { shape, visuals } = material;
        // The painted texels of each material.
        let mut shown: BTreeMap<usize, PaintedTexels> = BTreeMap::new();
        for (index, point) in points.iter().enumerate() {
            let Some(SurfacePoint { position, normal, .. }) = point else { continue };
            // Paint follows the surface, which triangles cut short.
            let on_surface = || shape.nearest_to_first_order(&position.cast());
            let id = if visuals.len() > 1 { shape.material(&on_surface()) as usize } else { 0 };
            let n = normal.try_normalize(0.0).unwrap_or_else(V3::z);
            let painted = shown.entry(id).or_default();
            painted.indices.push(index);
            painted.points.push(PatternPoint { p: *position, n });
        }
        let mut texels = vec![None; points.len()];
        let default = Visual::default();
        for (id, PaintedTexels { indices, points }) in shown {
            sample_visual(visuals.get(id).unwrap_or(&default), &points, filter, |point, sample| {
                texels[indices[point]] = Some(texel_of(&sample.material));
            });
        }
        fill_gaps(texels, size)
    }
}

/// A rectangle of texels of a chart.
struct TexelRegion {
    /// Edge of a texel, m.
    texel: f32,
    /// Size to which patterns are filtered, m.
    filter: f32,
    /// Column and row of the first texel.
    corner: [usize; 2],
    /// Width and height, texels.
    size: [usize; 2],
}

/// Texels that show a surface, and the points that they show.
#[derive(Default)]
struct PaintedTexels {
    indices: Vec<usize>,
    points: Vec<PatternPoint>,
}

/// The components of a material that textures store.
fn texel_of(material: &MaterialSample) -> Texel {
    std::array::from_fn(|i| material[i])
}

/// The point of a surface that a texel shows.
#[derive(Clone, Debug)]
struct SurfacePoint {
    position: V3,
    normal: V3,
    /// Signed distance from the border of its triangle, texels, positive inside.
    inset: f32,
}

/// Twice the signed area of a triangle.
fn twice_area([a, b, c]: [[f32; 2]; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The point of a triangle nearest to another point, as barycentric coordinates.
struct NearestPoint {
    weights: [f32; 3],
    /// Distance of the other point from the border of the triangle, positive inside.
    inset: f32,
}

impl NearestPoint {
    fn of_triangle(corners: [[f32; 2]; 3], p: [f32; 2]) -> Self {
        let area = twice_area(corners);
        let edge = |i: usize| [corners[(i + 1) % 3], corners[(i + 2) % 3]];
        let weights = [0, 1, 2].map(|i| twice_area([edge(i)[0], edge(i)[1], p]) / area);
        if weights.iter().all(|w| *w >= 0.0) {
            let height = |i: usize| {
                let [a, b] = edge(i);
                weights[i] * area / (b[0] - a[0]).hypot(b[1] - a[1])
            };
            return Self { weights, inset: height(0).min(height(1)).min(height(2)) };
        }
        let on_edge = |i: usize| {
            let [a, b] = edge(i);
            let (along, away) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
            let length2 = along[0] * along[0] + along[1] * along[1];
            let t = ((away[0] * along[0] + away[1] * along[1]) / length2).clamp(0.0, 1.0);
            let mut weights = [0.0; 3];
            (weights[(i + 1) % 3], weights[(i + 2) % 3]) = (1.0 - t, t);
            Self { weights, inset: -(away[0] - t * along[0]).hypot(away[1] - t * along[1]) }
        };
        let nearer = |a: Self, b: Self| if b.inset > a.inset { b } else { a };
        nearer(nearer(on_edge(0), on_edge(1)), on_edge(2))
    }
}

/// Enters the points of a triangle at the texels that it covers or nearly covers. Of several points, a texel keeps
/// the one with the greatest inset.
fn project_triangle(
    corners: &[ChartVertex; 3],
    uvs: [[f32; 2]; 3],
    size: [usize; 2],
    points: &mut [Option<SurfacePoint>],
) {
    if twice_area(uvs) <= 0.0 {
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
            let NearestPoint { weights: [a, b, c], inset } = NearestPoint::of_triangle(uvs, p);
            let known = &mut points[y * size[0] + x];
            if inset > -PAINT_MARGIN && known.as_ref().is_none_or(|known| known.inset < inset) {
                let interpolate = |of: [V3; 3]| of[0] * a + of[1] * b + of[2] * c;
                let chord = interpolate(corners.map(|c| c.position));
                // The mean of a triangle and of the tangent planes at its corners follows a curved surface to second
                // order (compare Boubekeur & Alexa, Phong Tessellation, SIGGRAPH Asia 2008).
                let tangent =
                    interpolate(corners.map(|c| chord + c.normal * c.normal.dot(&(c.position - chord))));
                *known = Some(SurfacePoint {
                    position: (chord + tangent) * 0.5,
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

/// Packs a texel to bytes: square roots of the albedo, which give dark colours finer steps, and roughness.
fn pack(&[r, g, b, roughness]: &Texel) -> u32 {
    let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u32;
    byte(r.sqrt()) | byte(g.sqrt()) << 8 | byte(b.sqrt()) << 16 | byte(roughness) << 24
}

/// Place of a tile in a chart.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct TilePlace {
    level: usize,
    /// Position in the tiles of its level.
    index: usize,
}

/// A painted tile of a textured surface.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PaintedTile {
    chart: usize,
    place: TilePlace,
    texels: Box<[u32]>,
}

/// The tiles of a surface that have been painted.
pub(crate) fn painted_tiles(charts: &[TextureChart]) -> Vec<PaintedTile> {
    let mut tiles = Vec::new();
    for (chart, painted) in charts.iter().map(TextureChart::painted).enumerate() {
        tiles.extend(painted.map(|(place, texels)| PaintedTile { chart, place, texels: texels.into() }));
    }
    tiles
}

/// Number of tiles of a surface that have been painted.
pub(crate) fn painted_count(charts: &[TextureChart]) -> usize {
    charts.iter().map(|chart| chart.painted().count()).sum()
}

/// Puts painted tiles where they belong, as if they had been seen.
pub(crate) fn restore_tiles(charts: &[TextureChart], tiles: Vec<PaintedTile>) {
    for PaintedTile { chart, place: TilePlace { level, index }, texels } in tiles {
        let level = charts.get(chart).and_then(|chart| chart.levels.get(level));
        if let Some(tile) = level.and_then(|level| level.tiles.get(index)) {
            texels.try_into().into_iter().for_each(|texels| _ = tile.set(texels));
        }
    }
}

/// Edge of a tile, texels.
const TILE: usize = 32;
/// Length of a row of a tile in memory: each tile also has the first row and column of the next ones, so that
/// all texels have neighbours.
const TILE_STRIDE: usize = TILE + 1;
const TILE_TEXELS: usize = TILE_STRIDE * TILE_STRIDE;

/// The packed texels of a tile, row by row; those beyond the level are 0.
type Tile = [u32; TILE_TEXELS];

/// The extreme value of eight, which are mostly equal. `of_two` is the lower or the higher of two.
#[inline(always)]
fn extreme(of: i32x8, of_two: impl Fn(i32, i32) -> i32) -> i32 {
    let lanes = of.to_array();
    let is_uniform = of.simd_eq(i32x8::splat(lanes[0])).all();
    if is_uniform { lanes[0] } else { lanes.into_iter().fold(lanes[0], of_two) }
}

/// A level of a mip map, in tiles of packed texels.
#[derive(Clone, Debug)]
struct MipLevel {
    /// Width and height, texels.
    size: [usize; 2],
    /// Indices of the last column and row.
    last: [f32; 2],
    /// Tiles in a row.
    tile_columns: i32,
    /// The tiles, row by row; empty until they are seen.
    tiles: Vec<OnceLock<Box<Tile>>>,
}

impl MipLevel {
    fn new(size: [usize; 2]) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        let last = size.map(|n| (n - 1) as f32);
        Self { size, last, tile_columns: columns as i32, tiles: vec![OnceLock::new(); columns * rows] }
    }

    /// Width and height of the tile whose first texel is `corner`, with the row and column of the next ones.
    fn tile_size(&self, corner: [usize; 2]) -> [usize; 2] {
        [0, 1].map(|axis| (self.size[axis] - corner[axis]).min(TILE) + 1)
    }

    /// Bilinear interpolation, clamped at the edges; (u, v) in texels. Returns albedo and roughness. `paint` makes the
    /// tile whose first texel it is given.
    #[inline(always)]
    fn sample(&self, u: f32x8, v: f32x8, paint: impl Fn([usize; 2]) -> Box<Tile>) -> [f32x8; 4] {
        let clamped =
            |x: f32x8, last: f32| (x - f32x8::HALF).fast_max(f32x8::ZERO).fast_min(f32x8::splat(last));
        let (x, y) = (clamped(u, self.last[0]), clamped(v, self.last[1]));
        let (i, j) = (x.fast_trunc_int(), y.fast_trunc_int());
        let tile_bits = const { TILE.ilog2() as i32 };
        let tiles = (j >> tile_bits) * i32x8::splat(self.tile_columns) + (i >> tile_bits);
        let is_one_tile = tiles.simd_eq(i32x8::splat(tiles.to_array()[0])).all();
        let within = i32x8::splat(TILE as i32 - 1);
        let at = ((j & within) * i32x8::splat(TILE_STRIDE as i32) + (i & within)).to_array();
        let mut corners = [[0_u32; LANES]; 4];
        let [i, j, tiles] = [i, j, tiles].map(i32x8::to_array);
        let mut read = |lanes: std::ops::Range<usize>| {
            let corner = [i, j].map(|at| at[lanes.start] as usize / TILE * TILE);
            let Some(tile) = self.tiles.get(tiles[lanes.start] as usize) else { return };
            let texels = tile.get_or_init(|| paint(corner));
            for lane in lanes {
                // The limit holds already; it is stated for the compiler.
                let first = (at[lane] as usize).min(TILE_TEXELS - TILE_STRIDE - 2);
                (corners[0][lane], corners[1][lane]) = (texels[first], texels[first + 1]);
                let below = first + TILE_STRIDE;
                (corners[2][lane], corners[3][lane]) = (texels[below], texels[below + 1]);
            }
        };
        // Neighbouring points mostly have one tile.
        if is_one_tile {
            read(0..LANES);
        } else {
            (0..LANES).for_each(|lane| read(lane..lane + 1));
        }
        let fraction = |x: f32x8, i: [i32; LANES]| x - f32x8::from_i32x8(i32x8::new(i));
        blend(corners.map(u32x8::new), fraction(x, i), fraction(y, j))
    }
}

/// Blends four packed texels, bilinearly at `x` and `y` in 0..=1. Albedos are blended themselves, not their stored
/// square roots: that would shift borders towards the lighter side.
#[inline(always)]
fn blend(corners: [u32x8; 4], x: f32x8, y: f32x8) -> [f32x8; 4] {
    let both = x * y;
    let weights = [f32x8::ONE - x - y + both, x - both, y - both, both];
    let mask = u32x8::splat(0xFF);
    let mut sum = [f32x8::ZERO; 4];
    for (texel, weight) in corners.into_iter().zip(weights) {
        let byte = |texel: u32x8| f32x8::from_i32x8(cast(texel & mask));
        let [r, g, b, roughness] = [byte(texel), byte(texel >> 8), byte(texel >> 16), byte(texel >> 24)];
        for (sum, value) in sum.iter_mut().zip([r * r, g * g, b * b, roughness]) {
            *sum += weight * value;
        }
    }
    let [r, g, b, roughness] = sum;
    let squared = f32x8::splat(1.0 / (255.0 * 255.0));
    [r * squared, g * squared, b * squared, roughness * f32x8::splat(1.0 / 255.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::RenderMesh;
    use softvt_common::disk_cache::DiskCache;
    use softvt_scene::{LabelLine, Mask, TextDecal, VisualLayer};

    /// A word facing +x, white on black.
    fn printed() -> Visual {
        let line = LabelLine {
            text: "soft".into(),
            height_m: 0.012,
            weight: 0.15,
            at: [0.03, 0.0, 0.0],
            facing: [1.0, 0.0, 0.0],
            ..LabelLine::default()
        };
        let mask = Mask::Text { decal: Arc::new(TextDecal::new(line)) };
        let layer = VisualLayer { mask, albedo: [1.0; 3], roughness: 0.5, opacity: 1.0, relief_m: 0.0 };
        Visual::plain([0.0; 3], 0.5, 0.0).with(layer)
    }

    fn ball() -> RenderMesh {
        RenderMesh::from_shape("ball", &Shape::Sphere { radius: 0.03 }, &[printed()], &DiskCache::DISABLED)
            .expect("a mesh")
    }

    #[test]
    fn every_triangle_of_every_level_has_valid_texture_coordinates_and_faces_its_chart() {
        let mesh = ball();
        for level in 0..mesh.level_count() {
            let lod = mesh.level(level).expect("a level");
            let count = lod.triangles.len();
            assert_eq!((lod.chart_ids.len(), lod.uvs.len()), (count, count));
            for uvs in &lod.uvs {
                let [a, b, c] = *uvs;
                let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                assert!(area > 0.0 && uvs.iter().flatten().all(|x| *x > -1e-3), "{uvs:?}");
            }
        }
        assert_eq!(mesh.level(0).expect("a level").charts.len(), 6, "a ball has six sides");
    }

    #[test]
    fn letters_finer_than_the_triangles_are_sampled_at_their_positions() {
        let mesh = ball();
        let lod = mesh.level(0).expect("a level");
        let mut counts = [0; 2];
        for (uvs, (t, &chart)) in lod.uvs.iter().zip(lod.triangles.iter().zip(&lod.chart_ids)) {
            let middle = t.iter().map(|&v| lod.positions[v as usize]).sum::<V3>() / 3.0;
            let mut expected = 0.0;
            let at = PatternPoint { p: middle, n: middle.normalize() };
            sample_visual(&printed(), &[at], 1e-3, |_, sample| expected = sample.material[0]);
            if (0.02..=0.98).contains(&expected) {
                continue;
            }
            let uv: [f32x8; 2] =
                std::array::from_fn(|i| f32x8::splat(uvs.iter().map(|p| p[i]).sum::<f32>() / 3.0));
            let found = lod.charts[chart as usize].sample(uv, f32x8::splat(1e-4)).0.x.to_array()[0];
            assert!((found - expected).abs() < 0.1, "{middle:?}: {found} for {expected}");
            counts[usize::from(expected > 0.5)] += 1;
        }
        assert!(counts[0] > 1000 && counts[1] > 20, "triangles off and on letters: {counts:?}");
    }

    #[test]
    fn seen_tiles_are_kept_and_equal_painted_ones() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = || DiskCache::new(folder.path(), 1 << 24, |problem| panic!("{problem}"));
        let shape = Shape::Sphere { radius: 0.03 };
        let mesh =
            |cache: &DiskCache| RenderMesh::from_shape("ball", &shape, &[printed()], cache).expect("a mesh");
        // Albedos along a line on the first chart of a level, and the number of tiles painted before they are sampled.
        let sample = |mesh: &RenderMesh, level: usize| {
            let charts = &mesh.level(level).expect("a level").charts;
            let known = painted_count(charts);
            let at = |k: u16| [f32x8::splat(0.7 * f32::from(k)), f32x8::splat(11.3)];
            let albedos: Vec<[f32; 8]> =
                (0..40).map(|k| charts[0].sample(at(k), f32x8::splat(1e-3)).0.x.to_array()).collect();
            (known, albedos)
        };
        let (uncached, first) = (mesh(&DiskCache::DISABLED), mesh(&cache()));
        for level in 0..first.level_count() {
            let (known, painted) = sample(&first, level);
            assert_eq!((known, &painted), (0, &sample(&uncached, level).1), "level {level}");
        }
        drop(first);
        let second = mesh(&cache());
        for level in 0..second.level_count() {
            let (known, painted) = sample(&second, level);
            assert!(known > 0, "level {level}");
            assert_eq!(painted, sample(&uncached, level).1, "level {level}");
        }
        let corners = |mesh: &RenderMesh| mesh.level(0).expect("a level").positions.clone();
        assert_eq!(corners(&second), corners(&uncached));
    }

    #[test]
    fn paint_lies_on_the_surface_and_not_on_the_chords_of_coarse_triangles() {
        // A quarter of a cylinder about y in one piece: its chord is 8.8 mm deep. A stripe of 6 mm runs where the
        // surface is 21.2 mm above the axis.
        let (radius, half) = (0.03_f32, 0.02_f32);
        let edge = radius * std::f32::consts::FRAC_1_SQRT_2;
        let corner = |x: f32, y: f32| ChartVertex {
            position: V3::new(x, y, edge),
            normal: V3::new(x, 0.0, edge).normalize(),
        };
        let [a, b, c, d] =
            [corner(-edge, -half), corner(edge, -half), corner(edge, half), corner(-edge, half)];
        let cylinder = Shape::Cylinder { radius: f64::from(radius), half_height: 0.1 };
        let turned = cylinder.placed(softvt_geometry::Pose::rotation(
            softvt_geometry::Vec3::x() * std::f64::consts::FRAC_PI_2,
        ));
        // Only the top, which no chord reaches, is white.
        let top = Shape::cuboid(softvt_geometry::Vec3::new(0.2, 0.2, 0.01))
            .translated(softvt_geometry::Vec3::z() * 0.031);
        let material = SurfaceMaterial {
            shape: turned.painted(1, Some(top)),
            visuals: vec![Visual::plain([0.0; 3], 0.5, 0.0), Visual::plain([1.0; 3], 0.5, 0.0)],
        };
        let triangles = vec![[a, b, c], [a, c, d]];
        let corners = [a, b, c, d].map(|vertex| vertex.position);
        let source = ChartSource::Curved { material: Arc::new(material), triangles };
        let chart = TextureChart::new(&V3::z(), &corners, |_| 5e-4, source);
        let albedo = |x: f32| {
            let uv = chart.uv(&V3::new(x, 0.0, edge)).map(f32x8::splat);
            chart.sample(uv, f32x8::splat(1e-4)).0.x.to_array()[0]
        };
        // The surface is higher than 26 mm within 15 mm of the middle.
        for (x, white) in [(0.0, 1.0), (0.01, 1.0), (-0.01, 1.0), (0.018, 0.0), (-0.018, 0.0)] {
            assert!((albedo(x) - white).abs() < 0.05, "{x}: {} for {white}", albedo(x));
        }
    }
}
