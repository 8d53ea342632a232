//! Levels of detail: triangles with baked materials, and their topology.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::texture::TextureChart;
use crate::camera::{
    math::V3,
    shade::{
        occlusion::self_visibility,
        pattern::{METALNESS, MaterialSample, PatternPoint, SKY_VISIBILITY, VisualSample, sample_visual},
    },
};
use softvt_geometry::{Aabb, basis_from_reference, mesh::Mesh, shape::Shape, union_find::UnionFind};
use softvt_scene::Visual;

/// Faces that meet at a larger angle than this (cosine) form a crease; others are one smooth surface.
const CREASE_COSINE: f32 = 0.8;
/// Maximum length of the edges of a coarse level with a pattern, pixels.
const MAX_EDGE_PIXELS: f32 = 1.7;
/// Maximum geometric error of a coarse level that is uniform or textured, pixels.
const MAX_ERROR_PIXELS: f32 = 0.25;
/// Reach of ambient occlusion by the object itself, in longest extents of the object.
const OCCLUSION_REACH: f64 = 0.12;

/// A vertex as a weighted sum of the nodes of a soft body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeWeights {
    /// Indices of the nodes.
    pub nodes: [u32; 8],
    /// Their weights, of sum 1.
    pub weights: [f32; 8],
}

/// One level of detail of a [`RenderMesh`](super::render_mesh::RenderMesh), in the object frame at rest.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Lod {
    /// Vertex positions, m. Vertices are duplicated at creases, so that each has one normal.
    pub(crate) positions: Vec<V3>,
    pub(crate) normals: Vec<V3>,
    /// Material of each vertex.
    pub(crate) materials: Vec<MaterialSample>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Not stored, like the two fields below: [`parameterize`](super::texture::parameterize) makes them fast.
    #[serde(skip)]
    pub(crate) charts: Vec<TextureChart>,
    /// Index in `charts` of each triangle's chart; empty if the level is not textured.
    #[serde(skip)]
    pub(crate) chart_ids: Vec<u32>,
    /// Texture coordinates of each triangle's corners in its chart, texels.
    #[serde(skip)]
    pub(crate) uvs: Vec<[[f32; 2]; 3]>,
    /// Smoothing group of each triangle: triangles of one group share vertices, groups meet at creases.
    pub(crate) smoothing_groups: Vec<u32>,
    /// Attachment of each vertex to a soft body; empty for rigid objects.
    pub(crate) embedding: Vec<NodeWeights>,
    /// Normal of each vertex relative to its triangles, from which the normals of a soft body follow when it deforms;
    /// empty where they are the triangles'.
    pub(crate) relative_normals: Vec<RelativeNormal>,
    /// Mean length of the edges, m.
    pub(crate) vertex_spacing: f32,
    /// True if the material is the same everywhere, or textured.
    pub(crate) is_uniform: bool,
    /// Distance from the exact shape that few triangles exceed, m.
    pub(crate) geometric_error: f32,
    /// Height of the relief of the materials that a coarse level lacks, m.
    pub(crate) missing_relief: f32,
}

impl Lod {
    /// True if the level looks like finer ones where a pixel covers `pixel` metres.
    pub(crate) fn is_fine_enough(&self, pixel: f32) -> bool {
        self.vertex_spacing <= MAX_EDGE_PIXELS * pixel
            || self.is_uniform && self.geometric_error.max(self.missing_relief) <= MAX_ERROR_PIXELS * pixel
    }
}

/// A vertex normal relative to the normal of the adjacent triangles, which differs from the surface's where
/// triangles are of unequal size.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct RelativeNormal {
    /// A vertex of an adjacent triangle; the second axis of the frame points towards it.
    neighbour: u32,
    /// Components along the normal of the triangles and both axes of the frame in their plane.
    components: [f32; 3],
}

impl RelativeNormal {
    /// The normals of the vertices relative to `triangle_normals`, the [`vertex_normals`] at these positions.
    pub(crate) fn of_vertices(
        positions: &[V3],
        triangles: &[[u32; 3]],
        normals: &[V3],
        triangle_normals: &[V3],
    ) -> Vec<Self> {
        let mut neighbours: Vec<u32> = (0..).take(positions.len()).collect();
        for [a, b, c] in triangles {
            for (v, next) in [(a, b), (b, c), (c, a)] {
                neighbours[*v as usize] = *next;
            }
        }
        let relative = |(v, &neighbour): (usize, &u32)| {
            let edge = positions[neighbour as usize] - positions[v];
            let components = frame(&triangle_normals[v], &edge).map(|axis| axis.dot(&normals[v]));
            Self { neighbour, components }
        };
        neighbours.iter().enumerate().map(relative).collect()
    }

    /// The normal of vertex `v` where the vertices are at these positions.
    pub(crate) fn resolve(&self, v: usize, positions: &[V3], triangle_normals: &[V3]) -> V3 {
        let edge = positions[self.neighbour as usize] - positions[v];
        let [n, t, b] = frame(&triangle_normals[v], &edge);
        n * self.components[0] + t * self.components[1] + b * self.components[2]
    }
}

/// A right-handed orthonormal frame of first axis `n`, a unit vector. Its second axis is the part of `edge` normal to
/// `n`; without any, both other axes are zero.
fn frame(n: &V3, edge: &V3) -> [V3; 3] {
    let t = edge - n * edge.dot(n);
    let t = t.try_normalize(0.0).unwrap_or_else(V3::zeros);
    [*n, t, n.cross(&t)]
}

/// A mesh whose vertices are duplicated at creases: one vertex for each smooth group of triangles
/// around each original vertex.
pub(crate) struct CreasedMesh {
    /// The original vertex of each vertex.
    sources: Vec<u32>,
    pub(crate) positions: Vec<V3>,
    pub(crate) normals: Vec<V3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl CreasedMesh {
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let points: Vec<V3> = mesh.vertices.iter().map(|v| v.cast()).collect();
        let face_normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(V3::z)
        };
        let face_normals: Vec<V3> = mesh.triangles.iter().map(face_normal).collect();
        // Triangle and corner, for each corner at each vertex.
        let mut corners: Vec<Vec<[usize; 2]>> = vec![Vec::new(); points.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            triangle.iter().enumerate().for_each(|(i, &v)| corners[v as usize].push([t, i]));
        }
        let (mut sources, mut triangles) = (Vec::new(), mesh.triangles.clone());
        for (v, corners) in corners.iter().enumerate() {
            let normal = |i: usize| face_normals[corners[i][0]];
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
            for (group, &[triangle, corner]) in group.iter().zip(corners) {
                triangles[triangle][corner] = *vertex_of_group.entry(*group).or_insert_with(|| {
                    sources.push(v as u32);
                    sources.len() as u32 - 1
                });
            }
        }
        let positions: Vec<V3> = sources.iter().map(|&v| points[v as usize]).collect();
        let normals = vertex_normals(&positions, &triangles);
        Self { sources, positions, normals, triangles }
    }
}

/// Unit normals of vertices: the normalised sum of the area normals of the adjacent triangles.
pub(crate) fn vertex_normals(positions: &[V3], triangles: &[[u32; 3]]) -> Vec<V3> {
    let mut normals = vec![V3::zeros(); positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let area = (b - a).cross(&(c - a));
        t.iter().for_each(|&v| normals[v as usize] += area);
    }
    for n in &mut normals {
        let length = n.norm();
        *n = if length > 0.0 { *n / length } else { V3::z() };
    }
    normals
}

/// Builds a level of detail: splits vertices at creases, evaluates materials at them and raises their drawn relief.
///
/// `material_ids` are by triangle. Patterns are filtered to `spacing`, m. With a `shape`, materials blend
/// smoothly across their borders and ambient occlusion is baked in.
pub(crate) fn bake_vertices(
    mesh: &Mesh,
    material_ids: &[u16],
    visuals: &[Visual],
    spacing: f32,
    shape: Option<&Shape>,
) -> Lod {
    let CreasedMesh { sources, mut positions, mut normals, triangles } = CreasedMesh::new(mesh);
    let mut adjacent_ids: Vec<Vec<u16>> = vec![Vec::new(); sources.len()];
    for (t, &id) in triangles.iter().zip(material_ids) {
        t.iter().for_each(|&v| adjacent_ids[v as usize].push(id));
    }
    let reach = OCCLUSION_REACH * extent(mesh);
    // Copies of a vertex share its material, so that nothing changes along a crease.
    let mut first_copies: BTreeMap<u32, usize> = BTreeMap::new();
    (0..positions.len()).rev().for_each(|i| _ = first_copies.insert(sources[i], i));
    let point = |&i: &usize| PatternPoint { p: positions[i], n: normals[i] };
    let points: Vec<PatternPoint> = first_copies.values().map(point).collect();
    let ids = first_copies.values().map(|&i| {
        let ids = &adjacent_ids[i];
        match shape {
            Some(shape) if ids.iter().any(|&id| id != ids[0]) => {
                material_ids_near(shape, &positions[i], &normals[i], spacing)
            }
            _ => ids.clone(),
        }
    });
    let mut blended = blend_visuals(ids.collect(), visuals, &points, spacing);
    for (sample, PatternPoint { p, n }) in blended.iter_mut().zip(&points) {
        sample.material[SKY_VISIBILITY] = shape.map_or(1.0, |shape| self_visibility(shape, p, n, reach));
    }
    let by_source: BTreeMap<u32, VisualSample> = first_copies.into_keys().zip(blended).collect();
    let samples: Vec<VisualSample> = sources.iter().map(|source| by_source[source]).collect();
    if samples.iter().any(|sample| sample.relief != 0.0) {
        positions.iter_mut().zip(&normals).zip(&samples).for_each(|((p, n), s)| *p += n * s.relief);
        normals = vertex_normals(&positions, &triangles);
    }
    let mut connected = UnionFind::new(positions.len());
    for t in &triangles {
        connected.union(t[0] as usize, t[1] as usize);
        connected.union(t[0] as usize, t[2] as usize);
    }
    let materials: Vec<MaterialSample> = samples.iter().map(|sample| sample.material).collect();
    let is_same = |m: &MaterialSample| m.iter().zip(&materials[0]).take(METALNESS + 1).all(|(a, b)| a == b);
    Lod {
        is_uniform: materials.iter().all(is_same),
        smoothing_groups: triangles.iter().map(|t| connected.find(t[0] as usize) as u32).collect(),
        positions,
        normals,
        materials,
        triangles,
        vertex_spacing: spacing,
        ..Lod::default()
    }
}

/// Longest extent of a mesh along an axis, m.
pub(crate) fn extent(mesh: &Mesh) -> f64 {
    Aabb::from_points(&mesh.vertices).map_or(0.0, |bounds| bounds.size().max())
}

/// Material ids at points spread evenly over the surface around `p`, to a little more than half the distance to
/// adjacent vertices. Their proportions change smoothly across a border, however the triangles there are shaped.
fn material_ids_near(shape: &Shape, p: &V3, n: &V3, spacing: f32) -> Vec<u16> {
    const STEPS: i32 = 2;
    let reference = if n.z.abs() < 0.9 { V3::z() } else { V3::x() };
    let [u, v] = basis_from_reference(n, &reference);
    let step = 0.7 * spacing / STEPS as f32;
    let point = |i: i32, j: i32| p + u * (i as f32 * step) + v * (j as f32 * step);
    (-STEPS..=STEPS)
        .flat_map(|i| (-STEPS..=STEPS).map(move |j| point(i, j)))
        .map(|q| shape.material(&q.cast()))
        .collect()
}

/// The visuals of points, each averaged over the material ids of the point by how often each occurs.
fn blend_visuals(
    ids: Vec<Vec<u16>>,
    visuals: &[Visual],
    points: &[PatternPoint],
    spacing: f32,
) -> Vec<VisualSample> {
    // The points that show each material, and the share that it has there.
    let mut shown: BTreeMap<u16, Vec<(usize, f32)>> = BTreeMap::new();
    for (index, mut ids) in ids.into_iter().enumerate() {
        let share = 1.0 / ids.len() as f32;
        ids.sort_unstable();
        for run in ids.chunk_by(|a, b| a == b) {
            shown.entry(run[0]).or_default().push((index, share * run.len() as f32));
        }
    }
    let mut blends = vec![VisualSample { material: MaterialSample::zeros(), relief: 0.0 }; points.len()];
    for (id, shares) in shown {
        let at: Vec<PatternPoint> = shares.iter().map(|&(index, _)| points[index]).collect();
        sample_visual(&visuals[id as usize], &at, spacing, |point, sample| {
            let (index, weight) = shares[point];
            blends[index].material += sample.material * weight;
            blends[index].relief += sample.relief * weight;
        });
    }
    blends
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::mesh::simplify::simplify;
    use softvt_geometry::surface_mesh::SurfaceMesh;

    #[test]
    fn normals_of_a_simplified_ball_turn_with_it_and_stay_those_of_the_ball() {
        let mesh = SurfaceMesh::from_shape(&Shape::Sphere { radius: 0.05 }, 2e-3).mesh;
        let fine = bake_vertices(&mesh, &vec![0; mesh.triangles.len()], &[Visual::default()], 2e-3, None);
        let lod = simplify(&fine, 2e-4, f32::MAX);
        let of_triangles = vertex_normals(&lod.positions, &lod.triangles);
        let relative =
            RelativeNormal::of_vertices(&lod.positions, &lod.triangles, &lod.normals, &of_triangles);
        let turn = nalgebra::Rotation3::from_euler_angles(0.3_f32, -0.8, 2.0);
        let turned: Vec<V3> = lod.positions.iter().map(|p| turn * p).collect();
        let of_turned = vertex_normals(&turned, &lod.triangles);
        let (mut worst, mut worst_of_triangles) = (1.0_f32, 1.0_f32);
        for (v, (relative, p)) in relative.iter().zip(&turned).enumerate() {
            let radial = p.normalize();
            worst = worst.min(relative.resolve(v, &turned, &of_turned).dot(&radial));
            worst_of_triangles = worst_of_triangles.min(of_turned[v].dot(&radial));
        }
        assert!(worst > 0.9995, "{worst}");
        assert!(
            worst_of_triangles < worst,
            "those of the triangles alone are no better: {worst_of_triangles}"
        );
    }
}
