//! Levels of detail: triangles with baked materials, and their topology.

use std::collections::BTreeMap;

use crate::{
    geometry::union_find::UnionFind,
    sensing::camera::{math::V3, shade::pattern::MaterialSample},
};

/// Faces that meet at a larger angle than this (cosine) form a crease; others are one smooth surface.
const CREASE_COSINE: f32 = 0.8;
/// Maximum length of the edges of a coarse level with a pattern, pixels.
const MAX_EDGE_PIXELS: f32 = 1.7;
/// Maximum geometric error of a coarse level of uniform material, pixels.
pub(crate) const MAX_ERROR_PIXELS: f32 = 0.12;

/// A vertex as a weighted sum of the nodes of a soft body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeWeights {
    pub(crate) nodes: [u32; 8],
    pub(crate) weights: [f32; 8],
}

/// One level of detail of a [`RenderMesh`](super::render_mesh::RenderMesh), in the object frame at rest.
#[derive(Clone, Debug)]
pub(crate) struct Lod {
    /// Vertex positions, m. Vertices are duplicated at creases, so that each has one normal.
    pub(crate) positions: Vec<V3>,
    pub(crate) normals: Vec<V3>,
    /// Material of each vertex.
    pub(crate) materials: Vec<MaterialSample>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Texture chart of each triangle; empty if the level is not textured.
    pub(crate) chart_ids: Vec<u32>,
    /// Texture coordinates of each triangle's corners in its chart, texels.
    pub(crate) uvs: Vec<[[f32; 2]; 3]>,
    /// Smoothing group of each triangle: triangles of one group share vertices, groups meet at creases.
    pub(crate) smoothing_groups: Vec<u32>,
    /// Attachment of each vertex to a soft body; empty for rigid objects.
    pub(crate) embedding: Vec<NodeWeights>,
    /// Mean length of the edges, m.
    pub(crate) vertex_spacing: f32,
    /// True if the material is the same everywhere, or textured.
    pub(crate) is_uniform: bool,
    /// Root mean square distance from the exact shape, m.
    pub(crate) geometric_error: f32,
}

impl Lod {
    /// True if the level looks like finer ones where a pixel covers `pixel` metres.
    pub(crate) fn suffices(&self, pixel: f32) -> bool {
        self.vertex_spacing <= MAX_EDGE_PIXELS * pixel
            || self.is_uniform && self.geometric_error <= MAX_ERROR_PIXELS * pixel
    }
}

/// A mesh whose vertices are duplicated at creases.
pub(crate) struct CreasedMesh {
    /// The original vertex of each vertex.
    pub(crate) sources: Vec<u32>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Duplicates vertices at creases: one vertex for each smooth group of triangles around each original vertex.
pub(crate) fn split_at_creases(points: &[V3], triangles: &[[u32; 3]]) -> CreasedMesh {
    /// A triangle at a vertex, and which of its corners the vertex is.
    struct MeshCorner {
        triangle: u32,
        corner: u8,
    }
    let face_normals: Vec<V3> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(V3::z)
        })
        .collect();
    let mut corners: Vec<Vec<MeshCorner>> = points.iter().map(|_| Vec::new()).collect();
    for (t, triangle) in triangles.iter().enumerate() {
        for (i, &v) in triangle.iter().enumerate() {
            corners[v as usize].push(MeshCorner { triangle: t as u32, corner: i as u8 });
        }
    }
    let (mut sources, mut split) = (Vec::new(), triangles.to_vec());
    for (v, corners) in corners.iter().enumerate() {
        let normal = |i: usize| face_normals[corners[i].triangle as usize];
        let mut group: Vec<usize> = (0..corners.len()).collect();
        for i in 0..corners.len() {
            for j in 0..i {
                if normal(i).dot(&normal(j)) > CREASE_COSINE && group[i] != group[j] {
                    let (from, to) = (group[i].max(group[j]), group[i].min(group[j]));
                    group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
                }
            }
        }
        let mut vertex_of_group: BTreeMap<usize, u32> = BTreeMap::new();
        for (group, corner) in group.iter().zip(corners) {
            let vertex = *vertex_of_group.entry(*group).or_insert_with(|| {
                sources.push(v as u32);
                sources.len() as u32 - 1
            });
            split[corner.triangle as usize][corner.corner as usize] = vertex;
        }
    }
    CreasedMesh { sources, triangles: split }
}

/// Numbers the connected components of triangles that share vertices.
pub(crate) fn smoothing_groups(triangles: &[[u32; 3]], vertex_count: usize) -> Vec<u32> {
    let mut connected = UnionFind::new(vertex_count);
    for t in triangles {
        connected.union(t[0] as usize, t[1] as usize);
        connected.union(t[0] as usize, t[2] as usize);
    }
    triangles.iter().map(|t| connected.find(t[0] as usize) as u32).collect()
}

/// Computes unit vertex normals: the normalised sum of the area normals of the adjacent triangles.
pub(crate) fn compute_normals(positions: &[V3], triangles: &[[u32; 3]], normals: &mut [V3]) {
    normals.fill(V3::zeros());
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let area = (b - a).cross(&(c - a));
        t.iter().for_each(|&v| normals[v as usize] += area);
    }
    for n in normals {
        let length = n.norm();
        *n = if length > 0.0 { *n / length } else { V3::z() };
    }
}
