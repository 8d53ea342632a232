//! Triangle meshes: volume, area, welding and validation.

use std::collections::BTreeMap;

use rstar::{RTree, primitives::GeomWithData};
use serde::{Deserialize, Serialize};

use super::{Vec3, union_find::UnionFind};

/// Bits of a position, equal for equal positions.
fn position_key(v: &Vec3) -> [u64; 3] {
    [v.x, v.y, v.z].map(|x| (x + 0.0).to_bits())
}

/// A triangle mesh with vertices and triangles by index.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Mesh {
    /// Vertex positions, object frame, m.
    pub vertices: Vec<Vec3>,
    /// Vertex indices of each triangle, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the three corners of each triangle, or empty.
    pub uvs: Vec<[[f64; 2]; 3]>,
}

/// Reason why a mesh does not bound a solid.
#[allow(missing_docs, reason = "the messages describe the variants")]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    #[error("the mesh is empty: it has no triangles; export a closed surface")]
    Empty,
    #[error("vertex {vertex} has a coordinate that is not a number; export the mesh again")]
    NotFinite { vertex: usize },
    #[error("triangle {triangle} has a texture coordinate that is not a number; export the mesh again")]
    TextureNotFinite { triangle: usize },
    #[error(
        "triangle {triangle} names vertex {vertex}, but there are {vertices} vertices; export the mesh again"
    )]
    Index { triangle: usize, vertex: u32, vertices: usize },
    #[error("the mesh is open: {edges} edges have a triangle on one side only; close its holes")]
    Open { edges: usize },
    #[error(
        "{edges} edges are shared by more than two triangles or by two of opposite orientation; make the surface a manifold with consistent normals"
    )]
    NonManifold { edges: usize },
    #[error("the mesh encloses no volume; export a solid, not a sheet")]
    Flat,
    #[error(
        "closed pieces of the mesh overlap, so that their common part would count twice; join them (a boolean union), and export it again"
    )]
    Overlap,
}

impl Mesh {
    /// Enclosed volume by the divergence theorem, m³; negative if the triangles face inwards.
    pub fn volume(&self) -> f64 {
        self.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| self.vertices[v as usize]);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// Surface area, m².
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|t| self.triangle_area(t)).sum()
    }

    /// True if it encloses no volume.
    pub(crate) fn is_flat(&self) -> bool {
        self.volume().abs() < 1e-6 * self.area().powf(1.5)
    }

    /// Area of a triangle between three vertices of the mesh, m².
    pub fn triangle_area(&self, triangle: &[u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|v| self.vertices[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    /// Moves vertices that are at most `distance` (m) apart, also by way of others, to the first of them.
    pub(crate) fn snapped(&self, distance: f64) -> Self {
        let mut first = BTreeMap::new();
        let of_position = |(index, v): (usize, &Vec3)| *first.entry(position_key(v)).or_insert(index);
        let firsts: Vec<usize> = self.vertices.iter().enumerate().map(of_position).collect();
        let points = first.into_values().map(|index| {
            let v = self.vertices[index];
            GeomWithData::new([v.x, v.y, v.z], index)
        });
        let tree = RTree::bulk_load(points.collect());
        let mut sets = UnionFind::new(self.vertices.len());
        for point in &tree {
            for near in tree.locate_within_distance(*point.geom(), distance * distance) {
                sets.union(point.data, near.data);
            }
        }
        let vertices = firsts.into_iter().map(|index| self.vertices[sets.find(index)]).collect();
        Self { vertices, ..self.clone() }
    }

    /// Merges vertices with equal positions and removes triangles that become degenerate.
    pub fn welded(&self) -> Self {
        self.welded_keeping().0
    }

    /// As [`welded`](Self::welded), with the indices of the triangles that were kept.
    pub(crate) fn welded_keeping(&self) -> (Self, Vec<u32>) {
        let mut kept = Vec::with_capacity(self.triangles.len());
        let mut index = BTreeMap::new();
        let mut out = Self::default();
        let renamed: Vec<u32> = self
            .vertices
            .iter()
            .map(|v| {
                *index.entry(position_key(v)).or_insert_with(|| {
                    out.vertices.push(*v);
                    out.vertices.len() as u32 - 1
                })
            })
            .collect();
        for (index, triangle) in self.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|v| renamed[v as usize]);
            if a != b && b != c && c != a {
                out.triangles.push([a, b, c]);
                out.uvs.extend(self.uvs.get(index));
                kept.push(index as u32);
            }
        }
        (out, kept)
    }

    /// Some of the triangles with their vertices, without texture coordinates.
    pub(crate) fn submesh(&self, triangles: &[[u32; 3]]) -> Self {
        let (mut renamed, mut vertices) = (BTreeMap::new(), Vec::new());
        let mut rename = |v: u32| {
            *renamed.entry(v).or_insert_with(|| {
                vertices.push(self.vertices[v as usize]);
                vertices.len() as u32 - 1
            })
        };
        let triangles = triangles.iter().map(|t| t.map(&mut rename)).collect();
        Self { vertices, triangles, uvs: Vec::new() }
    }

    /// Validates indices and coordinates.
    ///
    /// # Errors
    /// If the mesh has no triangles, a coordinate of a vertex or a texture is not finite or an index is out of range.
    pub fn validate(&self) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(vertex) = self.vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        let is_infinite = |uvs: &[[f64; 2]; 3]| uvs.iter().flatten().any(|x| !x.is_finite());
        if let Some(triangle) = self.uvs.iter().position(is_infinite) {
            return Err(MeshError::TextureNotFinite { triangle });
        }
        let vertices = self.vertices.len();
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|v| **v as usize >= vertices) {
                return Err(MeshError::Index { triangle, vertex, vertices });
            }
        }
        Ok(())
    }

    /// Validates that every edge is shared by exactly two triangles of consistent orientation.
    ///
    /// # Errors
    /// The number of edges that are not.
    pub fn validate_closed(&self) -> Result<(), MeshError> {
        let mut uses: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
        for t in &self.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                uses.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
            }
        }
        let open = uses.values().filter(|[up, down]| up + down == 1).count();
        if open > 0 {
            return Err(MeshError::Open { edges: open });
        }
        let odd = uses.values().filter(|directions| **directions != [1, 1]).count();
        if odd > 0 { Err(MeshError::NonManifold { edges: odd }) } else { Ok(()) }
    }
}
