//! Surfaces of bodies as they press on a gel: finer than the collision geometry, created once per asset and placed
//! over the pad at every frame.

use std::{borrow::Cow, collections::BTreeMap, convert::Infallible, ops::Range};

use wide::f64x4;

use super::SkinMesh;
use crate::camera;
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::{Mat3, Pose, Vec3, shape::Shape, surface_mesh::SurfaceMesh, voxel::VoxelMesh};

/// Edge of the cells from which a skin is extracted, m: fine enough for seeds and ridges of a millimetre, with the
/// field of the gel solved on 0.4 mm.
const CELL: f64 = 8e-4;
/// Largest number of cells along the longest edge, for large objects such as tables.
const MAX_CELLS: f64 = 160.0;
/// Index of vertices too far from the pad to matter.
const UNUSED: u32 = u32::MAX;
/// Half extents of the box about the apex outside which vertices do not matter, m.
const NEAR_BOX: Vec3 = Vec3::new(0.018, 0.016, 0.010);

/// Surface of an object at rest, in its frame, that can be placed over a pad.
#[derive(Clone, Debug)]
pub struct TactileSkin {
    /// Vertex indices of the triangles, counter-clockwise seen from outside.
    triangles: Vec<[u32; 3]>,
    vertices: Vec<Vec3>,
    /// For soft bodies only.
    embedding: Option<SplineEmbedding>,
}

/// A skin over a pad: of a soft body, the part of it that is near the pad.
#[derive(Clone, Debug)]
pub struct PlacedSkin<'a> {
    /// Vertices, m, pad frame.
    vertices: Vec<Vec3>,
    /// Vertex indices of the triangles.
    triangles: Cow<'a, [[u32; 3]]>,
}

impl PlacedSkin<'_> {
    /// The mesh that presses on the gel.
    pub fn mesh(&self) -> SkinMesh<'_> {
        SkinMesh { vertices: &self.vertices, triangles: &self.triangles }
    }
}

/// Motion of a skin with the nodes of a soft body: quadratic B-splines over the voxel grid (de Boor, *A Practical
/// Guide to Splines*, 1978), whose slope runs linearly from the mean slope of one voxel to the mean slope of the next.
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
    /// The voxels with vertices of the skin.
    voxels: Vec<SkinVoxel>,
}

/// Grid point next to the body that is not a node itself.
#[derive(Clone, Debug)]
struct GhostPoint {
    /// Position at rest, m.
    rest: Vec3,
    /// Nodes next to it.
    nodes: Vec<u32>,
}

/// The part of a skin in one voxel.
#[derive(Clone, Debug)]
struct SkinVoxel {
    /// Nodes of the voxel.
    nodes: [u32; 8],
    octants: Vec<SkinOctant>,
    /// Range of the triangles whose first vertex lies in the voxel.
    triangles: Range<usize>,
}

/// The part of a skin nearest to one corner of a voxel: the same points move all its vertices.
#[derive(Clone, Debug, Default)]
struct SkinOctant {
    /// Nodes, then ghost points: the corner and its neighbours, x fastest.
    points: [u32; 27],
    vertices: Vec<EmbeddedVertex>,
}

/// Vertex of the skin with the weights of the points along each axis.
#[derive(Clone, Debug)]
struct EmbeddedVertex {
    vertex: u32,
    weights: [[f64; 3]; 3],
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
        skin.embedding = Some(SplineEmbedding::new(&skin.vertices, &mut skin.triangles, mesh)?);
        Some(skin)
    }

    fn sampled(shape: &Shape, cache: &DiskCache) -> Self {
        let cell = || CELL.max(shape.bounds().size().max() / MAX_CELLS);
        let sample = || Ok::<_, Infallible>(SurfaceMesh::from_shape(shape, cell()).mesh);
        let Ok(mesh) = cache.get("skin", shape, sample);
        Self { vertices: mesh.vertices, triangles: mesh.triangles, embedding: None }
    }

    /// The rigid skin with its object frame at `pose`, in the pad frame.
    pub fn place_rigid(&self, pose: &Pose) -> PlacedSkin<'_> {
        let vertices = self.vertices.iter().map(|v| (pose * nalgebra::Point3::from(*v)).coords).collect();
        PlacedSkin { vertices, triangles: Cow::Borrowed(&self.triangles) }
    }

    /// The embedded skin with the body's nodes at `nodes` (world) and the pose `w_p` of the world in the pad frame,
    /// without triangles too far from the pad to matter.
    pub fn place_soft(&self, nodes: &[Vec3], w_p: &Pose) -> PlacedSkin<'_> {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        if let Some(embedding) = &self.embedding {
            let points = nodes.iter().map(|x| (w_p * nalgebra::Point3::from(*x)).coords).collect();
            let points = embedding.points(points);
            let near: Vec<_> = embedding.voxels.iter().filter(|voxel| voxel.is_near(&points)).collect();
            let mut new_index = vec![UNUSED; self.vertices.len()];
            for octant in near.iter().flat_map(|voxel| &voxel.octants) {
                octant.place(&points, |vertex, position| {
                    new_index[vertex as usize] = vertices.len() as u32;
                    vertices.push(position);
                });
            }
            let of_near = near.iter().flat_map(|voxel| &self.triangles[voxel.triangles.clone()]);
            let renumbered = of_near.map(|t| t.map(|v| new_index[v as usize]));
            triangles.extend(renumbered.filter(|t| !t.contains(&UNUSED)));
        }
        PlacedSkin { vertices, triangles: Cow::Owned(triangles) }
    }
}

impl SkinVoxel {
    /// True unless the voxel is too far from the pad to matter.
    fn is_near(&self, points: &[Vec3]) -> bool {
        let corners = || self.nodes.iter().map(|&node| &points[node as usize]);
        let low = corners().fold(Vec3::repeat(f64::MAX), |b, x| b.inf(x));
        let high = corners().fold(Vec3::repeat(f64::MIN), |b, x| b.sup(x));
        (0..3).all(|i| low[i] <= NEAR_BOX[i] && high[i] >= -NEAR_BOX[i])
    }
}

impl SkinOctant {
    /// Calls `add` with each vertex and its position.
    fn place(&self, points: &[Vec3], mut add: impl FnMut(u32, Vec3)) {
        // Four lanes, of which three are used.
        let points = self.points.map(|id| points[id as usize]).map(|p| f64x4::new([p.x, p.y, p.z, 0.0]));
        let weighted = |[a, b, c]: [f64x4; 3], w: &[f64; 3]| {
            a * f64x4::splat(w[0]) + b * f64x4::splat(w[1]) + c * f64x4::splat(w[2])
        };
        for EmbeddedVertex { vertex, weights: [along_x, along_y, along_z] } in &self.vertices {
            let line = |i: usize| weighted([points[3 * i], points[3 * i + 1], points[3 * i + 2]], along_x);
            let plane = |i: usize| weighted([line(3 * i), line(3 * i + 1), line(3 * i + 2)], along_y);
            let [x, y, z, _] = weighted([plane(0), plane(1), plane(2)], along_z).to_array();
            add(*vertex, Vec3::new(x, y, z));
        }
    }
}

impl SplineEmbedding {
    /// Embeds vertices, and sorts the triangles by the voxels of their first vertices.
    fn new(vertices: &[Vec3], triangles: &mut [[u32; 3]], mesh: &VoxelMesh) -> Option<Self> {
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
        // By voxel and corner.
        let mut octants: BTreeMap<u32, [SkinOctant; 8]> = BTreeMap::new();
        let mut voxel_of_vertex = Vec::with_capacity(vertices.len());
        for (index, p) in vertices.iter().enumerate() {
            let at = mesh.locate(p)?;
            let home = key(&mesh.nodes[mesh.elements[at.element as usize][0] as usize]);
            // The corner of the voxel, 0 or 1 along each axis, to which the point is nearest.
            let nearest: [i64; 3] = std::array::from_fn(|i| i64::from(at.local[i] >= 0.5));
            let weights: [[f64; 3]; 3] = std::array::from_fn(|i| {
                let d = (at.local[i] - nearest[i] as f64).clamp(-0.5, 0.5);
                [0.5 * (0.5 - d).powi(2), 0.75 - d * d, 0.5 * (0.5 + d).powi(2)]
            });
            let octant = &mut octants.entry(at.element).or_default()
                [(nearest[0] + 2 * nearest[1] + 4 * nearest[2]) as usize];
            if octant.vertices.is_empty() {
                octant.points = neighbour_steps().map(|step| {
                    let place = std::array::from_fn(|i| home[i] + nearest[i] + step[i]);
                    known.get(&place).copied().unwrap_or_default()
                });
            }
            octant.vertices.push(EmbeddedVertex { vertex: index as u32, weights });
            voxel_of_vertex.push(at.element);
        }
        let voxel_of = |triangle: &[u32; 3]| voxel_of_vertex[triangle[0] as usize];
        triangles.sort_by_key(voxel_of);
        let voxels = octants.into_iter().map(|(element, octants)| {
            let [from, to] =
                [element, element + 1].map(|end| triangles.partition_point(|t| voxel_of(t) < end));
            SkinVoxel {
                nodes: mesh.elements[element as usize],
                octants: octants.into_iter().filter(|octant| !octant.vertices.is_empty()).collect(),
                triangles: from..to,
            }
        });
        let voxels = voxels.collect();
        let mut voxels_of_node = vec![Vec::new(); mesh.nodes.len()];
        for (element, nodes) in mesh.elements.iter().enumerate() {
            nodes.iter().for_each(|&node| voxels_of_node[node as usize].push(element as u32));
        }
        let (elements, rest) = (mesh.elements.clone(), mesh.nodes.clone());
        Some(Self { elements, voxels_of_node, edge: mesh.edge, rest, ghosts, voxels })
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

    /// A ball that is near a pad as a whole where its centre is at the origin.
    fn ball() -> (TactileSkin, VoxelMesh) {
        let shape = Shape::Sphere { radius: 0.008 };
        let mesh = voxel_mesh(&shape, &VoxelSpec { resolution: 6 }).expect("a ball");
        (TactileSkin::from_soft(&shape, &mesh, &DiskCache::DISABLED).expect("inside"), mesh)
    }

    #[test]
    fn every_linear_motion_is_exact() {
        let (skin, mesh) = ball();
        let f = Mat3::new(1.02, 0.1, 0.0, -0.05, 0.9, 0.02, 0.03, 0.0, 1.1);
        let pose =
            Pose::from_parts(Vec3::new(0.002, 0.001, -0.001).into(), Quat::from_euler_angles(0.1, 0.2, 0.3));
        let nodes: Vec<Vec3> = mesh.nodes.iter().map(|x| f * x).collect();
        let [rest, moved] = [(&mesh.nodes, Pose::identity()), (&nodes, pose)]
            .map(|(nodes, pose)| skin.place_soft(nodes, &pose).vertices);
        assert_eq!([rest.len(), moved.len()], [skin.vertices.len(); 2]);
        assert!(rest.len() > 1000, "{} vertices", rest.len());
        for (rest, moved) in rest.iter().zip(&moved) {
            let expected = (pose * nalgebra::Point3::from(f * rest)).coords;
            assert!((moved - expected).norm() < 1e-15, "{moved} and {expected}");
        }
        // At rest, the vertices are the surface's, in another order.
        let sorted = |vertices: &[Vec3]| {
            let mut rounded: Vec<_> =
                vertices.iter().map(|v| [v.x, v.y, v.z].map(|x| (1e9 * x).round())).collect();
            rounded.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
            rounded
        };
        assert_eq!(sorted(&rest), sorted(&skin.vertices));
    }

    #[test]
    fn a_bent_body_has_no_creases() {
        // A lens that is near the pad as a whole, with voxels several times as large as the cells of the skin.
        let shape = Shape::Ellipsoid { radii: Vec3::new(0.018, 0.016, 0.012) };
        let mesh = voxel_mesh(&shape, &VoxelSpec { resolution: 6 }).expect("a lens");
        let skin = TactileSkin::from_soft(&shape, &mesh, &DiskCache::DISABLED).expect("inside");
        // Bent along x: z grows with the square of x. Trilinear weights would turn its slope into steps.
        let curvature = 8.0;
        let bend = |x: &Vec3| x + Vec3::new(0.0, 0.0, 0.5 * curvature * x.x * x.x);
        let nodes: Vec<Vec3> = mesh.nodes.iter().map(bend).collect();
        let rest = skin.place_soft(&mesh.nodes, &Pose::identity());
        let bent = skin.place_soft(&nodes, &Pose::identity());
        assert_eq!(rest.triangles, bent.triangles);
        // Slopes along short edges of the skin against the bent ball's.
        let step = |a: u32, b: u32| {
            let [p, q] = [a, b].map(|v| rest.vertices[v as usize]);
            let [x, y] = [a, b].map(|v| bent.vertices[v as usize]);
            let true_rise = (bend(&q) - bend(&p)).z;
            ((y - x).z - true_rise).abs() / (q - p).norm()
        };
        let edges = bent.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2])]);
        // Away from the rim, where the mesh ends.
        let is_inner = |v: u32| {
            let p = &rest.vertices[v as usize];
            p.x.abs() < 0.013 && p.y.abs() < 0.01 && p.z > 0.004
        };
        let worst =
            edges.filter(|&(a, b)| is_inner(a) && is_inner(b)).map(|(a, b)| step(a, b)).fold(0.0, f64::max);
        // Trilinear weights are wrong by half the change of slope over a voxel, 0.024.
        assert!(worst < 0.2 * 0.5 * curvature * mesh.edge, "{worst} of {}", 0.5 * curvature * mesh.edge);
    }

    #[test]
    fn only_the_part_of_a_body_near_the_pad_is_placed() {
        let (skin, mesh) = ball();
        let place = |z: f64| skin.place_soft(&mesh.nodes, &Pose::translation(0.0, 0.0, z));
        assert!(place(0.03).vertices.is_empty() && place(0.03).triangles.is_empty());
        let placed = place(0.012);
        assert!(
            (100..skin.vertices.len() - 100).contains(&placed.vertices.len()),
            "{}",
            placed.vertices.len()
        );
        assert!(placed.triangles.iter().flatten().all(|&v| (v as usize) < placed.vertices.len()));
        // All triangles within the box are there.
        let is_near = |v: &u32| skin.vertices[*v as usize].z + 0.012 < NEAR_BOX.z;
        let near = skin.triangles.iter().filter(|t| t.iter().all(is_near)).count();
        let is_near = |v: &u32| placed.vertices[*v as usize].z < NEAR_BOX.z;
        assert_eq!(placed.triangles.iter().filter(|t| t.iter().all(is_near)).count(), near);
    }
}
