//! Large flat faces with patterns: a few triangles each and a texture with a chain of halved copies (Williams, Pyramidal
//! Parametrics, 1983), baked from the pattern on the face itself.

use super::{
    V3,
    model::{Level, accumulate, split},
    pattern::{self, Look},
};
use crate::{geometry::mesh::Mesh, scene::Visual};

/// Meshes of more triangles than this are not treated as a few facets.
const MOST_TRIANGLES: usize = 160;
/// Facets smaller than this across need no texture, m.
const LEAST_SIZE: f64 = 0.1;
/// Most texels along an edge, and the finest they get, m.
const MOST_TEXELS: f32 = 1024.0;
const FINEST: f32 = 0.8e-3;

/// A flat face: axes of its texture in the object frame and the texture.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    origin: V3,
    /// Unit axes.
    u: V3,
    v: V3,
    /// Texels a metre.
    density: f32,
    mips: Vec<Image>,
}

#[derive(Clone, Debug)]
struct Image {
    width: usize,
    height: usize,
    /// Albedo and roughness.
    texels: Vec<[f32; 4]>,
}

/// Whether a mesh is a few big flat faces.
pub(super) fn worth_it(mesh: &Mesh) -> bool {
    mesh.triangles.len() <= MOST_TRIANGLES && mesh.area().sqrt() > LEAST_SIZE
}

/// Each triangle pair or triangle of one plane and material becomes a facet.
pub(super) fn bake(mesh: &Mesh, materials: &[u16], visuals: &[Visual]) -> (Level, Vec<Facet>) {
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
    let facets: Vec<Facet> =
        planes.iter().map(|(n, _, m, corners)| Facet::paint(n, corners, &visuals[*m as usize])).collect();
    let looks =
        vec![Look { albedo: V3::zeros(), roughness: 1.0, metalness: 0.0, open: 1.0 }; positions.len()];
    let mut level = Level {
        positions,
        normals,
        looks,
        triangles,
        facets: facets_of,
        embedding: Vec::new(),
        spacing: FINEST,
    };
    // Metalness does not vary over a facet.
    for (t, &m) in level.triangles.iter().zip(materials) {
        t.iter().for_each(|&v| level.looks[v as usize].metalness = visuals[m as usize].metalness as f32);
    }
    (level, facets)
}

impl Facet {
    fn paint(n: &V3, corners: &[V3], visual: &Visual) -> Self {
        let u = if n.x.abs() < 0.9 { V3::x() } else { V3::y() };
        let u = (u - n * u.dot(n)).normalize();
        let v = n.cross(&u);
        let span = |axis: &V3| {
            corners.iter().map(|c| c.dot(axis)).fold([f32::MAX, f32::MIN], |b, x| [b[0].min(x), b[1].max(x)])
        };
        let ([u0, u1], [v0, v1]) = (span(&u), span(&v));
        let texel = FINEST.max((u1 - u0).max(v1 - v0) / MOST_TEXELS);
        let origin = u * u0 + v * v0 + n * corners[0].dot(n);
        let [width, height] = [u1 - u0, v1 - v0].map(|x| (x / texel).ceil().max(1.0) as usize);
        let texels = (0..width * height)
            .map(|i| {
                let p =
                    origin + u * ((i % width) as f32 + 0.5) * texel + v * ((i / width) as f32 + 0.5) * texel;
                let look = pattern::look(visual, &p, n, texel).0;
                [look.albedo.x, look.albedo.y, look.albedo.z, look.roughness]
            })
            .collect();
        let mut mips = vec![Image { width, height, texels }];
        while let Some(last) = mips.last().filter(|image| image.width.max(image.height) > 1) {
            let next = last.halved();
            mips.push(next);
        }
        Self { origin, u, v, density: 1.0 / texel, mips }
    }

    /// Albedo and roughness at `p` (object frame), averaged over about `footprint`, m.
    pub fn sample(&self, p: &V3, footprint: f32) -> (V3, f32) {
        let d = p - self.origin;
        let level = (footprint * self.density).max(1.0).log2();
        let low = (level as usize).min(self.mips.len() - 1);
        let high = (low + 1).min(self.mips.len() - 1);
        let [u, v] = [d.dot(&self.u) * self.density, d.dot(&self.v) * self.density];
        let a = self.mips[low].at(u / (1 << low) as f32, v / (1 << low) as f32);
        let t = (level - low as f32).clamp(0.0, 1.0);
        let b = if t > 0.05 { self.mips[high].at(u / (1 << high) as f32, v / (1 << high) as f32) } else { a };
        let mixed: [f32; 4] = std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t);
        (V3::new(mixed[0], mixed[1], mixed[2]), mixed[3])
    }
}

impl Image {
    /// Half the size, each texel the mean of up to four.
    fn halved(&self) -> Self {
        let [width, height] = [self.width, self.height].map(|n| n.div_ceil(2));
        let texel = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let (x1, y1) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            let four = [(x, y), (x1, y), (x, y1), (x1, y1)].map(|(x, y)| self.texels[x + self.width * y]);
            std::array::from_fn(|c| 0.25 * four.iter().map(|t| t[c]).sum::<f32>())
        };
        Self { width, height, texels: (0..width * height).map(texel).collect() }
    }

    /// Bilinear, clamped at the edges; (u, v) in texels.
    fn at(&self, u: f32, v: f32) -> [f32; 4] {
        let x = (u - 0.5).clamp(0.0, (self.width - 1) as f32);
        let y = (v - 0.5).clamp(0.0, (self.height - 1) as f32);
        let (i, j) = (x as usize, y as usize);
        let (s, t) = (x - i as f32, y - j as f32);
        let row = |j: usize| {
            let a = self.texels[i + self.width * j];
            let b = self.texels[(i + 1).min(self.width - 1) + self.width * j];
            std::array::from_fn::<f32, 4, _>(|c| a[c] + (b[c] - a[c]) * s)
        };
        let (a, b) = (row(j), row((j + 1).min(self.height - 1)));
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
    }
}
