//! Surfaces of bodies as they press on a gel: finer than the collision geometry, created once per asset and placed
//! over the pad at every frame.

use std::{collections::BTreeMap, convert::Infallible};

use crate::camera;
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::{Mat3, Pose, Vec3, shape::Shape, surface_mesh::SurfaceMesh, voxel::VoxelMesh};

/// Edge of the cells from which a skin is extracted, m: fine enough for seeds and ridges of a millimetre, with the
/// field of the gel solved on 0.4 mm.
const CELL: f64 = 8e-4;
/// Largest number of cells along the longest edge, for large objects such as tables.
const MAX_CELLS: f64 = 160.0;
/// Position of vertices too far from the pad to matter, m, pad frame: above it.
const FAR_AWAY: Vec3 = Vec3::new(0.0, 0.0, 1.0);
/// Half extents of the box about the apex outside which vertices do not matter, m.
const NEAR_BOX: Vec3 = Vec3::new(0.018, 0.016, 0.010);

/// Surface of an object at rest, in its frame, that can be placed over a pad.
#[derive(Clone, Debug)]
pub struct TactileSkin {
    /// Vertex indices of the triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    vertices: Vec<Vec3>,
    /// For soft bodies only.
    embedding: Option<SplineEmbedding>,
}

/// Motion of a skin with the nodes of a soft body: quadratic B-splines over the voxel grid (de Boor, *A Practical
/// Guide to Splines*, 1978), whose slope runs linearly from the mean slope of one voxel to that of the next.
///
/// Trilinear weights would break the slope at every face, and a tactile image shows nothing but slopes. Linear
/// motions are exact; waves of four voxels keep three quarters of their height.
#[derive(Clone, Debug)]
struct SplineEmbedding {
    elements: Vec<[u32; 8]>,
    /// Voxels around each node.
    voxels_of_node: Vec<Vec<u32>>,
    /// Edge of a voxel, m.
    edge: f64,
    /// Nodes at rest, m.
    rest: Vec<Vec3>,
    ghosts: Vec<GhostPoint>,
    /// Vertices in each voxel.
    vertices_of_voxel: Vec<Vec<EmbeddedVertex>>,
}

/// Grid point next to the body that is not a node itself.
#[derive(Clone, Debug)]
struct GhostPoint {
    /// Position at rest, m.
    rest: Vec3,
    /// Nodes next to it.
    nodes: Vec<u32>,
}

/// Vertex of the skin with the 27 points (nodes, then ghost points) that move it.
#[derive(Clone, Debug)]
struct EmbeddedVertex {
    vertex: u32,
    points: [u32; 27],
    weights: [f64; 27],
}

impl TactileSkin {
    /// Skin of a rigid shape. Flat faces keep their few triangles. Other surfaces are kept in `cache`.
    pub fn from_shape(shape: &Shape, cache: &DiskCache) -> Self {
        match camera::flat_faces(shape) {
            Some(mesh) => Self { vertices: mesh.vertices, triangles: mesh.triangles, embedding: None },
            None => Self::sampled(shape, cache),
        }
    }

    /// Skin of a soft body with the voxel mesh `mesh`, with small triangles on flat faces too. `None` if part of the
    /// shape lies more than two voxels outside the mesh.
    pub fn from_soft(shape: &Shape, mesh: &VoxelMesh, cache: &DiskCache) -> Option<Self> {
        let mut skin = Self::sampled(shape, cache);
        skin.embedding = Some(SplineEmbedding::new(&skin.vertices, mesh)?);
        Some(skin)
    }

    fn sampled(shape: &Shape, cache: &DiskCache) -> Self {
        let cell = || CELL.max(shape.bounds().size().max() / MAX_CELLS);
        let sample = || Ok::<_, Infallible>(SurfaceMesh::from_shape(shape, cell()).mesh);
        let Ok(mesh) = cache.get("skin", shape, sample);
        Self { vertices: mesh.vertices, triangles: mesh.triangles, embedding: None }
    }

    /// Writes the vertices of a rigid skin whose object frame is at `pose` (for a pad: in the pad frame).
    pub fn place_rigid(&self, pose: &Pose, out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.vertices.iter().map(|v| (pose * nalgebra::Point3::from(*v)).coords));
    }

    /// Writes the vertices of an embedded skin in the pad frame, with the body's nodes at `nodes` (world) and the
    /// pose `w_p` of the world in the pad frame. Vertices too far from the pad to matter are put far above it.
    pub fn place_soft(&self, nodes: &[Vec3], w_p: &Pose, out: &mut Vec<Vec3>) {
        out.clear();
        out.resize(self.vertices.len(), FAR_AWAY);
        let Some(embedding) = &self.embedding else { return };
        let x_p = nodes.iter().map(|x| (w_p * nalgebra::Point3::from(*x)).coords).collect();
        let points = embedding.points(x_p);
        let voxels = embedding.elements.iter().zip(&embedding.vertices_of_voxel);
        for (ids, vertices) in voxels.filter(|(_, vertices)| !vertices.is_empty()) {
            let corners = ids.map(|id| points[id as usize]);
            let low = corners.iter().fold(Vec3::repeat(f64::MAX), |b, x| b.inf(x));
            let high = corners.iter().fold(Vec3::repeat(f64::MIN), |b, x| b.sup(x));
            if (0..3).any(|i| low[i] > NEAR_BOX[i] || high[i] < -NEAR_BOX[i]) {
                continue;
            }
            for embedded in vertices {
                let weighted = embedded.points.iter().zip(&embedded.weights);
                out[embedded.vertex as usize] =
                    weighted.fold(Vec3::zeros(), |sum, (&point, w)| sum + points[point as usize] * *w);
            }
        }
    }
}

impl SplineEmbedding {
    fn new(vertices: &[Vec3], mesh: &VoxelMesh) -> Option<Self> {
        let key = |p: &Vec3| -> [i64; 3] {
            std::array::from_fn(|i| ((p[i] - mesh.origin[i]) / mesh.edge).round() as i64)
        };
        let mut known: BTreeMap<[i64; 3], u32> =
            mesh.nodes.iter().enumerate().map(|(node, p)| (key(p), node as u32)).collect();
        let mut ghosts: Vec<GhostPoint> = Vec::new();
        for (node, p) in mesh.nodes.iter().enumerate() {
            for step in neighbour_steps() {
                let at: [i64; 3] = std::array::from_fn(|i| key(p)[i] + step[i]);
                let next = (mesh.nodes.len() + ghosts.len()) as u32;
                let id = *known.entry(at).or_insert(next);
                if id == next {
                    let rest = p + Vec3::from(step.map(|s| s as f64)) * mesh.edge;
                    ghosts.push(GhostPoint { rest, nodes: Vec::new() });
                }
                if let Some(ghost) = (id as usize).checked_sub(mesh.nodes.len()) {
                    ghosts[ghost].nodes.push(node as u32);
                }
            }
        }
        let mut vertices_of_voxel = vec![Vec::new(); mesh.elements.len()];
        for (index, p) in vertices.iter().enumerate() {
            let at = mesh.locate(p)?;
            let home = key(&mesh.nodes[mesh.elements[at.element as usize][0] as usize]);
            // The corner of the voxel, 0 or 1 along each axis, to which the point is nearest.
            let nearest: [i64; 3] = std::array::from_fn(|i| i64::from(at.local[i] >= 0.5));
            let along: [[f64; 3]; 3] = std::array::from_fn(|i| {
                let d = (at.local[i] - nearest[i] as f64).clamp(-0.5, 0.5);
                [0.5 * (0.5 - d).powi(2), 0.75 - d * d, 0.5 * (0.5 + d).powi(2)]
            });
            let weights = std::array::from_fn(|c| along[0][c % 3] * along[1][c / 3 % 3] * along[2][c / 9]);
            let points = neighbour_steps().map(|step| {
                let place = std::array::from_fn(|i| home[i] + nearest[i] + step[i]);
                known.get(&place).copied().unwrap_or_default()
            });
            let embedded = EmbeddedVertex { vertex: index as u32, points, weights };
            vertices_of_voxel[at.element as usize].push(embedded);
        }
        let mut voxels_of_node = vec![Vec::new(); mesh.nodes.len()];
        for (element, nodes) in mesh.elements.iter().enumerate() {
            nodes.iter().for_each(|&node| voxels_of_node[node as usize].push(element as u32));
        }
        let (elements, rest) = (mesh.elements.clone(), mesh.nodes.clone());
        Some(Self { elements, voxels_of_node, edge: mesh.edge, rest, ghosts, vertices_of_voxel })
    }

    /// Appends the ghost points to the nodes `x`, moved by the mean deformation gradient about the nodes next to them.
    fn points(&self, mut x: Vec<Vec3>) -> Vec<Vec3> {
        let of_elements: Vec<Mat3> = self.elements.iter().map(|ids| self.gradient(ids, &x)).collect();
        let at_node = |node: usize| {
            let voxels = &self.voxels_of_node[node];
            let sum = voxels.iter().fold(Mat3::zeros(), |sum, &e| sum + of_elements[e as usize]);
            sum / voxels.len().max(1) as f64
        };
        let at_nodes: Vec<Mat3> = (0..self.rest.len()).map(at_node).collect();
        for GhostPoint { rest, nodes } in &self.ghosts {
            let carried =
                nodes.iter().map(|&n| x[n as usize] + at_nodes[n as usize] * (rest - self.rest[n as usize]));
            let sum: Vec3 = carried.sum();
            x.push(sum / nodes.len().max(1) as f64);
        }
        x
    }

    /// Mean deformation gradient of a voxel: differences between opposite faces.
    fn gradient(&self, ids: &[u32; 8], x: &[Vec3]) -> Mat3 {
        let along = |axis: usize| {
            let sum = (0..8).fold(Vec3::zeros(), |sum, c| {
                let corner = x[ids[c] as usize];
                if c >> axis & 1 == 1 { sum + corner } else { sum - corner }
            });
            sum / (4.0 * self.edge)
        };
        Mat3::from_columns(&[along(0), along(1), along(2)])
    }
}

/// Steps to a grid point and its 26 neighbours, x fastest.
fn neighbour_steps() -> [[i64; 3]; 27] {
    std::array::from_fn(|c| [c as i64 % 3 - 1, c as i64 / 3 % 3 - 1, c as i64 / 9 - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::{
        Quat,
        voxel::{VoxelSpec, voxel_mesh},
    };

    fn ball() -> (TactileSkin, VoxelMesh) {
        let shape = Shape::Sphere { radius: 0.02 };
        let mesh = voxel_mesh(&shape, &VoxelSpec { resolution: 6 }).expect("a ball");
        (TactileSkin::from_soft(&shape, &mesh, &DiskCache::DISABLED).expect("inside"), mesh)
    }

    #[test]
    fn every_linear_motion_is_exact() {
        let (skin, mesh) = ball();
        let f = Mat3::new(1.02, 0.1, 0.0, -0.05, 0.9, 0.02, 0.03, 0.0, 1.1);
        let pose =
            Pose::from_parts(Vec3::new(0.002, 0.001, -0.015).into(), Quat::from_euler_angles(0.1, 0.2, 0.3));
        let nodes: Vec<Vec3> = mesh.nodes.iter().map(|x| f * x).collect();
        let mut out = Vec::new();
        skin.place_soft(&nodes, &pose, &mut out);
        let near = |p: &Vec3| (0..3).all(|i| p[i].abs() < NEAR_BOX[i]);
        let expected: Vec<Vec3> =
            skin.vertices.iter().map(|v| (pose * nalgebra::Point3::from(f * v)).coords).collect();
        let worst = out.iter().zip(&expected).filter(|(_, e)| near(e)).map(|(o, e)| (o - e).norm());
        let (count, worst) = worst.fold((0, 0.0_f64), |(n, w), x| (n + 1, w.max(x)));
        assert!(count > 500 && worst < 1e-15, "{count} {worst}");
    }

    #[test]
    fn a_bent_body_has_no_creases() {
        let (skin, mesh) = ball();
        // Bent along x: z grows with the square of x. Trilinear weights would turn its slope into steps.
        let curvature = 8.0;
        let bend = |x: &Vec3| x + Vec3::new(0.0, 0.0, 0.5 * curvature * x.x * x.x);
        let nodes: Vec<Vec3> = mesh.nodes.iter().map(bend).collect();
        let pose = Pose::translation(0.0, 0.0, -0.015);
        let mut out = Vec::new();
        skin.place_soft(&nodes, &pose, &mut out);
        // Slopes along short edges of the skin against those of the bent ball.
        let step = |a: u32, b: u32| {
            let [p, q] = [a, b].map(|v| skin.vertices[v as usize]);
            let [x, y] = [a, b].map(|v| out[v as usize]);
            let true_rise = (bend(&q) - bend(&p)).z;
            ((y - x).z - true_rise).abs() / (q - p).norm()
        };
        let inside = |v: u32| (0..3).all(|i| out[v as usize][i].abs() < 0.8 * NEAR_BOX[i]);
        let edges = skin.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2])]);
        let worst =
            edges.filter(|&(a, b)| inside(a) && inside(b)).map(|(a, b)| step(a, b)).fold(0.0, f64::max);
        // Trilinear weights are wrong by half the change of slope over a voxel, 0.027.
        assert!(worst < 0.2 * 0.5 * curvature * mesh.edge, "{worst} of {}", 0.5 * curvature * mesh.edge);
    }
}
