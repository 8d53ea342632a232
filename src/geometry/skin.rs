//! The watertight triangle skin of a shape.
//!
//! Connectivity comes from naive surface nets (Gibson 1998); vertices are then placed by the quadric error of dual
//! contouring (Ju et al. 2002), so that sharp edges and corners stay sharp, and projected on the surface.

use fast_surface_nets::{SurfaceNetsBuffer, ndshape::RuntimeShape, surface_nets};

use super::{
    Mat3, Vec3,
    mesh::Mesh,
    shape::{Aabb, Shape},
    voxel::{Embedding, VoxelMesh},
};

/// A closed triangle mesh on the surface of a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Vertices, triangles (counter-clockwise seen from outside) and texture coordinates by triangle corner.
    pub mesh: Mesh,
    /// Outward unit normal at each vertex.
    pub normals: Vec<Vec3>,
    /// Material id of each triangle.
    pub materials: Vec<u16>,
}

/// Most grid points of a skin; a smaller cell is enlarged to fit (memory, not quality, is bounded).
const MOST_POINTS: f64 = 2e7;
/// Edge of the blocks of cells that are skipped together where they lie far from the surface.
const BLOCK: usize = 4;

/// The skin of `shape` with cells of edge `cell`, m. An imported mesh is its own skin.
///
/// The skin is empty only if the shape is, or if it is all thinner than a cell.
pub fn skin(shape: &Shape, cell: f64) -> Skin {
    if let Shape::Mesh(solid) = shape {
        return finish(shape, solid.mesh().clone());
    }
    let grid = Grid::over(&shape.reach(), cell);
    let values = grid.sample(shape);
    let mut buffer = SurfaceNetsBuffer::default();
    let top = grid.count.map(|n| n as u32 - 1);
    let array = RuntimeShape::<u32, 3>::new(grid.count.map(|n| n as u32));
    surface_nets(&values, &array, [0; 3], top, &mut buffer);
    let vertices =
        buffer.surface_points.iter().map(|at| grid.vertex(shape, at.map(|i| i as usize))).collect();
    let triangles = buffer.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    finish(shape, Mesh { vertices, triangles, uvs: Vec::new() })
}

impl Skin {
    /// Where each vertex sits in a voxel mesh; `None` if one is more than two voxels away from it.
    pub fn embed(&self, mesh: &VoxelMesh) -> Option<Vec<Embedding>> {
        self.mesh.vertices.iter().map(|v| mesh.locate(v)).collect()
    }
}

/// Adds normals, texture coordinates and materials.
fn finish(shape: &Shape, mut mesh: Mesh) -> Skin {
    let normals = mesh.vertices.iter().map(|v| shape.estimate(v).1).collect();
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    let materials =
        mesh.triangles.iter().map(|t| shape.material(&(corners(t).iter().sum::<Vec3>() / 3.0))).collect();
    if mesh.uvs.is_empty()
        && let Some(bounds) = Aabb::around(&mesh.vertices)
    {
        mesh.uvs = mesh.triangles.iter().map(|t| unwrap(&bounds, &corners(t))).collect();
    }
    Skin { mesh, normals, materials }
}

/// Spherical texture coordinates about the longest axis (z if there is none), after scaling the bounding box to a cube.
/// `u` may exceed 1 so that no triangle spans the seam.
fn unwrap(bounds: &Aabb, corners: &[Vec3; 3]) -> [[f64; 2]; 3] {
    let size = bounds.size();
    let pole = if size.max() > 1.25 * size.z { size.imax() } else { 2 };
    let (i, j) = ((pole + 1) % 3, (pole + 2) % 3);
    let mut uvs = corners.map(|corner| {
        let d = (corner - bounds.centre()).component_div(&size.add_scalar(1e-12));
        let latitude = d[pole].atan2(d[i].hypot(d[j])) / std::f64::consts::PI;
        [d[j].atan2(d[i]) / std::f64::consts::TAU + 0.5, latitude + 0.5]
    });
    let highest = uvs.iter().map(|uv| uv[0]).fold(0.0, f64::max);
    for uv in uvs.iter_mut().filter(|uv| highest - uv[0] > 0.5) {
        uv[0] += 1.0;
    }
    uvs
}

/// A regular lattice of points around a shape.
struct Grid {
    origin: Vec3,
    cell: f64,
    count: [usize; 3],
}

impl Grid {
    fn over(reach: &Aabb, cell: f64) -> Self {
        let size = reach.size().add_scalar(4.0 * cell);
        let cell = cell.max((size.product() / MOST_POINTS).cbrt());
        let count = std::array::from_fn(|axis| (reach.size()[axis] / cell).ceil() as usize + 5);
        let span = Vec3::from_fn(|axis, _| (count[axis] - 1) as f64 * cell);
        // An offset by an odd share keeps flat faces off the lattice, where signs would be a matter of rounding.
        let offset = Vec3::new(0.131, 0.173, 0.117) * cell;
        Self { origin: reach.centre() - 0.5 * span + offset, cell, count }
    }

    fn point(&self, at: [usize; 3]) -> Vec3 {
        self.origin + Vec3::from_fn(|axis, _| at[axis] as f64) * self.cell
    }

    /// Signed distance in cells at every point, x fastest; far from the surface only its sign counts.
    fn sample(&self, shape: &Shape) -> Vec<f32> {
        let [nx, ny, nz] = self.count;
        let mut values = vec![1.0_f32; nx * ny * nz];
        let half = 0.5 * (BLOCK - 1) as f64;
        let far = 2.0 * 3.0_f64.sqrt() * (half + 1.0) * self.cell;
        let blocks = self.count.map(|n| n.div_ceil(BLOCK));
        for block in 0..blocks.iter().product() {
            let start = [
                block % blocks[0] * BLOCK,
                block / blocks[0] % blocks[1] * BLOCK,
                block / blocks[0] / blocks[1] * BLOCK,
            ];
            let middle = shape.distance(&(self.point(start) + Vec3::repeat(half * self.cell)));
            for z in start[2]..(start[2] + BLOCK).min(nz) {
                for y in start[1]..(start[1] + BLOCK).min(ny) {
                    for x in start[0]..(start[0] + BLOCK).min(nx) {
                        let value =
                            if middle.abs() > far { middle } else { shape.distance(&self.point([x, y, z])) };
                        values[x + nx * (y + ny * z)] = (value / self.cell) as f32;
                    }
                }
            }
        }
        values
    }

    /// The vertex of the cell whose lowest corner is `at`: the point that best fits the tangent planes where the
    /// surface crosses the cell's edges.
    fn vertex(&self, shape: &Shape, at: [usize; 3]) -> Vec3 {
        let corner = |c: usize| self.point([at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2 & 1)]);
        let corners: [Vec3; 8] = std::array::from_fn(corner);
        let values = corners.map(|p| shape.distance(&p));
        let mut planes: Vec<(Vec3, Vec3)> = Vec::with_capacity(12);
        for (a, b) in (0..8).flat_map(|a: usize| [1, 2, 4].map(|bit| (a, a | bit))).filter(|(a, b)| a != b) {
            if (values[a] < 0.0) != (values[b] < 0.0) {
                let p = crossing(shape, (corners[a], values[a]), (corners[b], values[b]));
                planes.push((p, shape.estimate(&p).1));
            }
        }
        if planes.is_empty() {
            return 0.5 * (corners[0] + corners[7]);
        }
        let mean = planes.iter().map(|plane| plane.0).sum::<Vec3>() / planes.len() as f64;
        let sharp = planes.iter().any(|(_, n)| n.dot(&planes[0].1) < SHARP);
        if sharp {
            let fit = best_fit(&planes, mean);
            return fit.sup(&corners[0]).inf(&corners[7]);
        }
        shape.project(&mean, self.cell).unwrap_or(mean)
    }
}

/// Normals in a cell that differ by more than this cosine meet at an edge.
const SHARP: f64 = 0.8;

/// Where the surface crosses an edge between a point inside and one outside (regula falsi, Illinois variant).
fn crossing(shape: &Shape, mut a: (Vec3, f64), mut b: (Vec3, f64)) -> Vec3 {
    let mut p = a.0;
    for _ in 0..8 {
        p = a.0 + (b.0 - a.0) * (a.1 / (a.1 - b.1));
        let value = shape.distance(&p);
        if value.abs() < 1e-9 {
            break;
        }
        if (value < 0.0) == (a.1 < 0.0) {
            a = (p, value);
            b.1 *= 0.5;
        } else {
            b = (p, value);
            a.1 *= 0.5;
        }
    }
    p
}

/// Least squares of the distances to planes (point, normal), weakly held at `mean`; repeated so that the hold fades.
fn best_fit(planes: &[(Vec3, Vec3)], mean: Vec3) -> Vec3 {
    let hold = 0.05 * planes.len() as f64;
    let matrix = planes.iter().map(|(_, n)| n * n.transpose()).sum::<Mat3>() + Mat3::identity() * hold;
    let Some(inverse) = matrix.try_inverse() else { return mean };
    (0..6).fold(mean, |x, _| x + inverse * planes.iter().map(|(p, n)| n * n.dot(&(p - x))).sum::<Vec3>())
}
