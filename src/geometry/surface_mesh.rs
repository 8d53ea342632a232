//! Watertight triangle meshes of the surfaces of shapes.
//!
//! Connectivity comes from naive surface nets (Gibson 1998). Vertices are placed by the quadric error of dual
//! contouring (Ju et al. 2002), which preserves sharp edges and corners, and projected on the surface.

use std::collections::HashMap;

use fast_surface_nets::{SurfaceNetsBuffer, ndshape::RuntimeShape, surface_nets};

use super::{
    Aabb, Mat3, Vec3, hex8,
    mesh::Mesh,
    shape::{Shape, SignedDistance},
    voxel::{Embedding, VoxelMesh},
};

/// A closed triangle mesh of the surface of a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceMesh {
    /// Vertices, outward-oriented triangles, and texture coordinates per triangle corner.
    pub mesh: Mesh,
    /// Outward unit normal at each vertex.
    pub normals: Vec<Vec3>,
    /// Material id of each triangle.
    pub materials: Vec<u16>,
}

/// Largest number of grid points, which bounds the memory; smaller cells are enlarged to fit.
const MAX_POINTS: f64 = 2e7;
/// Edge, in cells, of the largest blocks that are skipped as a whole where they are far from the surface;
/// a power of two.
const BLOCK: usize = 4;
/// Largest number of passes that make the lattice well composed; a repair may invalidate neighbouring cells.
const MAX_PASSES: usize = 16;
/// Largest distance from the surface, in cells, of the linearly interpolated crossings of a smooth cell.
const LINEARITY_TOLERANCE: f64 = 0.03;
/// Smallest cosine between the normals in a smooth cell.
const SMOOTH_COSINE: f64 = 0.9;
/// Cosine between the normals in a cell below which they meet at a sharp edge.
const SHARP_COSINE: f64 = 0.8;
/// Largest distance of a fitted vertex from the surface, in cells.
const FIT_TOLERANCE: f64 = 0.1;

/// The triangles of [`SurfaceMesh::from_shape`] and the normals at their vertices, without
/// materials and texture coordinates.
pub(super) fn surface_triangles(shape: &Shape, cell: f64) -> (Mesh, Vec<Vec3>) {
    if let Shape::Mesh(solid) = shape {
        let mesh = solid.mesh().clone();
        let normals = mesh.vertices.iter().map(|v| shape.first_order(v).normal).collect();
        return (mesh, normals);
    }
    let grid = SamplingGrid::over(&shape.loose_bounds(), cell);
    let mut values = grid.sample(shape);
    grid.make_well_composed(&mut values);
    let mut buffer = SurfaceNetsBuffer::default();
    let top = grid.count.map(|n| n as u32 - 1);
    let array = RuntimeShape::<u32, 3>::new(grid.count.map(|n| n as u32));
    surface_nets(&values, &array, [0; 3], top, &mut buffer);
    let mut crossings = EdgeCrossings { shape, found: HashMap::new() };
    let mut vertex = |at: &[u32; 3]| grid.vertex(&mut crossings, &values, at.map(|i| i as usize));
    let vertices: Vec<Vec3> = buffer.surface_points.iter().map(&mut vertex).collect();
    let normals: Vec<Vec3> = vertices.iter().map(|v| shape.first_order(v).normal).collect();
    let triangles =
        buffer.indices.chunks_exact(6).flat_map(|quad| split(shape, &vertices, &normals, quad)).collect();
    (Mesh { vertices, triangles, uvs: Vec::new() }, normals)
}

impl SurfaceMesh {
    /// Triangulates the surface of `shape` with cells of edge `cell`, m. A mesh shape keeps its own triangles.
    ///
    /// Empty only if the shape is empty or thinner than a cell everywhere.
    pub fn from_shape(shape: &Shape, cell: f64) -> Self {
        let (mesh, normals) = surface_triangles(shape, cell);
        with_materials(shape, mesh, normals)
    }

    /// Embeds each vertex in a voxel mesh; `None` if a vertex is more than two voxels away from it.
    pub fn embed(&self, mesh: &VoxelMesh) -> Option<Vec<Embedding>> {
        self.mesh.vertices.iter().map(|v| mesh.locate(v)).collect()
    }
}

/// Adds texture coordinates and materials.
fn with_materials(shape: &Shape, mut mesh: Mesh, normals: Vec<Vec3>) -> SurfaceMesh {
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    let materials =
        mesh.triangles.iter().map(|t| shape.material(&(corners(t).iter().sum::<Vec3>() / 3.0))).collect();
    if mesh.uvs.is_empty()
        && let Some(bounds) = Aabb::from_points(&mesh.vertices)
    {
        mesh.uvs = mesh.triangles.iter().map(|t| unwrap(&bounds, &corners(t))).collect();
    }
    SurfaceMesh { mesh, normals, materials }
}

/// Splits a quad into two triangles. Surface nets split along the shorter diagonal, which may bridge a sharp edge.
/// If the normals differ, the diagonal with its midpoint nearer to the surface is used.
fn split(shape: &Shape, vertices: &[Vec3], normals: &[Vec3], quad: &[u32]) -> [[u32; 3]; 2] {
    let (first, second) = ([quad[0], quad[1], quad[2]], [quad[3], quad[4], quad[5]]);
    let at = |v: u32| &normals[v as usize];
    let flat = first.iter().chain(&second).all(|&v| at(v).dot(at(first[0])) >= SMOOTH_COSINE);
    let lone = |of: [u32; 3], other: [u32; 3]| (0..3).find(|&i| !other.contains(&of[i]));
    let (false, Some(i), Some(j)) = (flat, lone(first, second), lone(second, first)) else {
        return [first, second];
    };
    // Counter-clockwise around the quad: p, s, q, r.
    let (r, p, q, s) = (first[i], first[(i + 1) % 3], first[(i + 2) % 3], second[j]);
    let off = |a: u32, b: u32| shape.distance(&(0.5 * (vertices[a as usize] + vertices[b as usize]))).abs();
    if off(r, s) < off(p, q) { [[s, q, r], [s, r, p]] } else { [first, second] }
}

/// Spherical texture coordinates about the longest axis (z if the extents are similar), after scaling the bounding
/// box to a cube. `u` may exceed 1, so that no triangle spans the seam.
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
struct SamplingGrid {
    origin: Vec3,
    cell: f64,
    count: [usize; 3],
}

impl SamplingGrid {
    fn over(reach: &Aabb, cell: f64) -> Self {
        let size = reach.size().add_scalar(4.0 * cell);
        let cell = cell.max((size.product() / MAX_POINTS).cbrt());
        let count = std::array::from_fn(|axis| (reach.size()[axis] / cell).ceil() as usize + 5);
        let span = Vec3::from_fn(|axis, _| (count[axis] - 1) as f64 * cell);
        // The offset keeps flat faces off the lattice, where rounding would determine the sign of distances.
        let offset = Vec3::new(0.131, 0.173, 0.117) * cell;
        Self { origin: reach.centre() - 0.5 * span + offset, cell, count }
    }

    fn point(&self, at: [usize; 3]) -> Vec3 {
        self.origin + Vec3::from_fn(|axis, _| at[axis] as f64) * self.cell
    }

    /// Signed distance in cells at every point, x fastest; only its sign is valid far from the surface.
    fn sample(&self, shape: &Shape) -> Vec<f32> {
        let mut values = vec![1.0_f32; self.count.iter().product()];
        let blocks = self.count.map(|n| n.div_ceil(BLOCK));
        for block in 0..blocks.iter().product() {
            let start = [
                block % blocks[0] * BLOCK,
                block / blocks[0] % blocks[1] * BLOCK,
                block / blocks[0] / blocks[1] * BLOCK,
            ];
            self.sample_block(shape, start, BLOCK, &mut values);
        }
        values
    }

    /// Samples a cube of `edge` points from `start` on: as a whole where the surface is far, else by its eighths.
    fn sample_block(&self, shape: &Shape, start: [usize; 3], edge: usize, values: &mut [f32]) {
        let half = 0.5 * (edge - 1) as f64;
        let far = 2.0 * 3.0_f64.sqrt() * (half + 1.0) * self.cell;
        let middle = shape.distance(&(self.point(start) + Vec3::repeat(half * self.cell)));
        if edge > 1 && middle.abs() <= far {
            for eighth in 0..8 {
                let step = hex8::corner_index(eighth).map(|k| k * edge / 2);
                let first: [usize; 3] = std::array::from_fn(|axis| start[axis] + step[axis]);
                if (0..3).all(|axis| first[axis] < self.count[axis]) {
                    self.sample_block(shape, first, edge / 2, values);
                }
            }
            return;
        }
        let [nx, ny, _] = self.count;
        let range = |axis: usize| start[axis]..(start[axis] + edge).min(self.count[axis]);
        for z in range(2) {
            for y in range(1) {
                range(0).for_each(|x| values[x + nx * (y + ny * z)] = (middle / self.cell) as f32);
            }
        }
    }

    /// Removes features finer than the lattice that would make the surface touch itself. A set of lattice points
    /// is *well composed* (Latecki 1997) if no cell face is a checkerboard and no cell has only two opposite
    /// corners on one side; only then is the surface a manifold. Wherever this is violated, the point with the
    /// smallest distance changes sides.
    fn make_well_composed(&self, values: &mut [f32]) {
        let [nx, ny, nz] = self.count;
        let strides = [1, nx, nx * ny];
        for _ in 0..MAX_PASSES {
            let mut changed = false;
            for cell in (0..(nx - 1) * (ny - 1) * (nz - 1))
                .map(|c| c % (nx - 1) + nx * (c / (nx - 1) % (ny - 1) + ny * (c / (nx - 1) / (ny - 1))))
            {
                let corners: [usize; 8] = std::array::from_fn(|c| {
                    let step = hex8::corner_index(c);
                    cell + (0..3).map(|axis| step[axis] * strides[axis]).sum::<usize>()
                });
                let inside = corners.iter().filter(|&&c| values[c] < 0.0).count();
                if inside > 0 && inside < 8 {
                    changed |= repair_cell(&corners, inside, values);
                }
            }
            if !changed {
                return;
            }
        }
    }

    /// The vertex of the cell with lowest corner `at`. On a smooth surface it is the mean of the crossings
    /// with the cell's edges, projected on the surface; at a sharp edge, the point that best fits the tangent
    /// planes of the crossings.
    fn vertex(&self, crossings: &mut EdgeCrossings, values: &[f32], at: [usize; 3]) -> Vec3 {
        let [nx, ny, _] = self.count;
        let shape = crossings.shape;
        let corners: [GridPoint; 8] = std::array::from_fn(|c| {
            let [x, y, z] = std::array::from_fn(|axis| at[axis] + hex8::corner_index(c)[axis]);
            let index = x + nx * (y + ny * z);
            GridPoint { index, p: self.point([x, y, z]), value: f64::from(values[index]) }
        });
        let crossed: Vec<[GridPoint; 2]> = (0..8)
            .flat_map(|a: usize| [1, 2, 4].map(|bit| (a, a | bit)))
            .filter(|&(a, b)| a != b && (corners[a].value < 0.0) != (corners[b].value < 0.0))
            .map(|(a, b)| [a, b].map(|c| corners[c]))
            .collect();
        let mean = crossed.iter().map(linear_crossing).sum::<Vec3>() / crossed.len() as f64;
        let smooth = || shape.project(&mean, self.cell).unwrap_or(mean);
        let at_crossings: Vec<SignedDistance> = crossed.iter().map(|edge| crossings.linear(edge)).collect();
        let is_linear = at_crossings.iter().all(|at| at.distance.abs() <= LINEARITY_TOLERANCE * self.cell);
        if is_linear && are_parallel(at_crossings.iter().map(|at| at.normal), SMOOTH_COSINE) {
            return smooth();
        }
        // The field is not linear in this cell, so the crossings are found by bisection.
        let planes: Vec<TangentPlane> = crossed.iter().map(|edge| crossings.exact(edge)).collect();
        if are_parallel(planes.iter().map(|plane| plane.normal), SHARP_COSINE) {
            return smooth();
        }
        let fit = best_fit(&planes, mean).sup(&corners[0].p).inf(&corners[7].p);
        // Reject fits off the surface, as between the two sides of a wall thinner than a cell.
        if shape.distance(&fit).abs() < FIT_TOLERANCE * self.cell { fit } else { smooth() }
    }
}

/// A corner of a cell with its signed distance, in cells.
#[derive(Clone, Copy)]
struct GridPoint {
    /// Index in the lattice.
    index: usize,
    p: Vec3,
    value: f64,
}

/// The crossing of the surface with an edge, if the field is linear along it.
fn linear_crossing([a, b]: &[GridPoint; 2]) -> Vec3 {
    a.p + (b.p - a.p) * (a.value / (a.value - b.value))
}

/// Tangent plane of the surface at a point.
#[derive(Clone, Copy)]
struct TangentPlane {
    p: Vec3,
    normal: Vec3,
}

/// The surface along the edges of the lattice. Up to four cells share an edge; it is examined once.
struct EdgeCrossings<'a> {
    shape: &'a Shape,
    /// By the lattice indices of the ends.
    found: HashMap<[usize; 2], EdgeCrossing>,
}

/// The crossing of the surface with an edge, as far as it was computed.
struct EdgeCrossing {
    /// The field at the linear crossing.
    linear: SignedDistance,
    /// The tangent plane at the crossing itself, once a cell has asked for it.
    exact: Option<TangentPlane>,
}

impl EdgeCrossings<'_> {
    fn at(&mut self, edge: &[GridPoint; 2]) -> &mut EdgeCrossing {
        let shape = self.shape;
        self.found.entry(edge.map(|end| end.index)).or_insert_with(|| EdgeCrossing {
            linear: shape.first_order(&linear_crossing(edge)),
            exact: None,
        })
    }

    /// The field at the linear crossing of an edge.
    fn linear(&mut self, edge: &[GridPoint; 2]) -> SignedDistance {
        self.at(edge).linear
    }

    /// The tangent plane where the surface crosses an edge.
    fn exact(&mut self, edge: &[GridPoint; 2]) -> TangentPlane {
        let shape = self.shape;
        *self.at(edge).exact.get_or_insert_with(|| {
            let p = crossing(shape, edge[0].p, edge[1].p);
            TangentPlane { p, normal: shape.first_order(&p).normal }
        })
    }
}

/// True if the cosine between the first normal and every other is at least `cosine`.
fn are_parallel(mut normals: impl Iterator<Item = Vec3>, cosine: f64) -> bool {
    let Some(first) = normals.next() else { return true };
    normals.all(|normal| normal.dot(&first) >= cosine)
}

/// Repairs the first checkerboard face or pair of opposite corners of a cell; returns true if there was one.
fn repair_cell(corners: &[usize; 8], inside: usize, values: &mut [f32]) -> bool {
    let is_in = |c: usize| values[corners[c]] < 0.0;
    let face = (0..3).flat_map(|axis| [0, 1].map(|side| (axis, side))).find_map(|(axis, side)| {
        let (i, j) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let base = side << axis;
        let ring = [base, base | i, base | i | j, base | j];
        (is_in(ring[0]) == is_in(ring[2])
            && is_in(ring[1]) == is_in(ring[3])
            && is_in(ring[0]) != is_in(ring[1]))
        .then(|| ring.to_vec())
    });
    let opposite = || {
        let few = inside == 2;
        (inside == 2 || inside == 6)
            .then(|| (0..4).find(|&c| is_in(c) == few && is_in(7 - c) == few).map(|c| vec![c, 7 - c]))
            .flatten()
    };
    let Some(odd) = face.or_else(opposite) else { return false };
    let least =
        odd.into_iter().map(|c| corners[c]).min_by(|a, b| values[*a].abs().total_cmp(&values[*b].abs()));
    if let Some(point) = least {
        // An exact zero has no side: it becomes the smallest negative number.
        values[point] =
            if values[point] < 0.0 { -values[point] } else { -values[point].max(f32::MIN_POSITIVE) };
    }
    true
}

/// Crossing of the surface with the line between two points, by bisection; the midpoint if there is no crossing.
fn crossing(shape: &Shape, a: Vec3, b: Vec3) -> Vec3 {
    let inside_a = shape.distance(&a) < 0.0;
    if inside_a == (shape.distance(&b) < 0.0) {
        return 0.5 * (a + b);
    }
    let (mut low, mut high) = (a, b);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if (shape.distance(&middle) < 0.0) == inside_a {
            low = middle;
        } else {
            high = middle;
        }
    }
    // At the inner end the normal is that of a face even next to a sharp edge.
    if inside_a { low } else { high }
}

/// Least squares of the distances to the planes, regularised towards `mean`. Repetition removes the
/// bias of the regularisation.
fn best_fit(planes: &[TangentPlane], mean: Vec3) -> Vec3 {
    let regularisation = 0.01 * planes.len() as f64;
    let matrix = planes.iter().map(|plane| plane.normal * plane.normal.transpose()).sum::<Mat3>()
        + Mat3::identity() * regularisation;
    let Some(inverse) = matrix.try_inverse() else { return mean };
    let residual =
        |x: Vec3| planes.iter().map(|plane| plane.normal * plane.normal.dot(&(plane.p - x))).sum::<Vec3>();
    (0..8).fold(mean, |x, _| x + inverse * residual(x))
}
