//! Voxel meshes of soft bodies: hexahedral elements on a regular grid, cut from a shape, and points embedded in them.
//!
//! Corners and shape functions of an element are those of [`hex8`].

use serde::{Deserialize, Serialize};

use super::{
    Aabb, Vec3,
    hex8::{self, QuadraturePoint},
    shape::{Shape, ShapeError},
};

/// Sub-cells of a voxel along each axis, on which its filled part is known.
pub const SUBCELLS: usize = 6;
/// Sub-cells of a voxel.
pub const CELLS_PER_VOXEL: usize = SUBCELLS * SUBCELLS * SUBCELLS;

/// Filled sub-cells of a voxel: bit `i + SUBCELLS (j + SUBCELLS k)` is set if the centre of the sub-cell
/// is inside the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct OccupancyMask(pub [u64; 4]);

impl OccupancyMask {
    /// The mask of the sub-cells for which `is_inside` is true.
    pub fn from_fn(is_inside: impl Fn(usize) -> bool) -> Self {
        let mut fill = Self::default();
        (0..CELLS_PER_VOXEL)
            .filter(|&cell| is_inside(cell))
            .for_each(|cell| fill.0[cell / 64] |= 1 << (cell % 64));
        fill
    }

    /// The mask of a voxel that is entirely inside.
    pub fn full() -> Self {
        Self::from_fn(|_| true)
    }

    /// True if sub-cell `cell` is inside.
    fn contains(&self, cell: usize) -> bool {
        self.0[cell / 64] >> (cell % 64) & 1 == 1
    }

    /// Filled share of the voxel, 0..=1.
    pub fn fraction(&self) -> f64 {
        self.count() as f64 / CELLS_PER_VOXEL as f64
    }

    /// Number of filled sub-cells.
    fn count(&self) -> u32 {
        self.0.iter().map(|w| w.count_ones()).sum()
    }

    /// Box around the filled sub-cells, local coordinates; `None` without any.
    pub(super) fn bounds(&self) -> Option<Aabb> {
        let centres: Vec<Vec3> = self.centres().collect();
        Aabb::from_points(&centres).map(|around| around.loosened(0.5 / SUBCELLS as f64))
    }

    /// Local coordinates `ξ ∈ [0, 1]³` of the centre of sub-cell `cell`.
    fn centre(cell: usize) -> Vec3 {
        let at = |i: usize| (i as f64 + 0.5) / SUBCELLS as f64;
        Vec3::new(at(cell % SUBCELLS), at(cell / SUBCELLS % SUBCELLS), at(cell / SUBCELLS / SUBCELLS))
    }

    /// Local coordinates of the centres of the filled sub-cells.
    pub fn centres(&self) -> impl Iterator<Item = Vec3> {
        (0..CELLS_PER_VOXEL).filter(|&cell| self.contains(cell)).map(Self::centre)
    }

    /// Quadrature over the filled part of a voxel of edge `h`: by 2×2×2 Gauss points in a full one, else by the
    /// centres of its filled sub-cells.
    pub fn quadrature(&self, h: f64) -> Vec<QuadraturePoint> {
        let volume = h.powi(3);
        if *self == Self::full() {
            return hex8::gauss_rule(volume).collect();
        }
        let weight = volume / CELLS_PER_VOXEL as f64;
        self.centres().map(|xi| QuadraturePoint { xi, weight }).collect()
    }
}

/// A mesh of equal cubes that covers a shape; nodes and elements in x-fastest order.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct VoxelMesh {
    /// Edge of the voxels, m.
    pub edge: f64,
    /// Rest positions of the nodes, object frame, m.
    pub nodes: Vec<Vec3>,
    /// Node indices of the eight corners of each element, in corner order.
    pub elements: Vec<[u32; 8]>,
    /// Filled part of each element.
    pub occupancy: Vec<OccupancyMask>,
    /// Number of grid cells along each axis.
    pub grid: [usize; 3],
    /// Lowest corner of the grid, object frame, m.
    pub origin: Vec3,
    /// Element index of each grid cell (x fastest); `u32::MAX` for empty cells.
    pub cell_element: Vec<u32>,
}

/// The fills of a mesh without repetitions.
#[derive(Clone, Debug)]
pub struct DistinctFills {
    /// Fills in the order of the elements that have them first.
    pub fills: Vec<OccupancyMask>,
    /// Index of the fill of each element.
    pub of_element: Vec<u32>,
}

/// Integral of the product of two fields over the filled part of a mesh, `∫ u v dV = Σ uᵀ M v` over its elements: what
/// finite elements call a consistent mass matrix, at unit density.
#[derive(Clone, Debug)]
pub struct VolumeProduct {
    /// Matrices of equal fills, m³.
    matrices: Vec<[[f64; 8]; 8]>,
    /// Node indices of each element with the index of its matrix.
    elements: Vec<([u32; 8], u32)>,
}

impl VolumeProduct {
    /// The product over the filled part of `mesh`.
    pub fn new(mesh: &VoxelMesh) -> Self {
        let DistinctFills { fills, of_element } = mesh.distinct_fills();
        let matrices = fills.iter().map(|fill| element_product(mesh.edge, fill)).collect();
        Self { matrices, elements: mesh.elements.iter().copied().zip(of_element).collect() }
    }

    /// Elements with their matrices, m³.
    pub fn elements(&self) -> impl Iterator<Item = (&[u32; 8], &[[f64; 8]; 8])> {
        self.elements.iter().map(|(nodes, kind)| (nodes, &self.matrices[*kind as usize]))
    }

    /// `M u` for the values of a field at `count` nodes.
    pub fn times(&self, count: usize, value: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        let mut product = vec![Vec3::zeros(); count];
        for (nodes, matrix) in self.elements() {
            for (&row, weights) in nodes.iter().zip(matrix) {
                for (&column, weight) in nodes.iter().zip(weights) {
                    product[row as usize] += value(column as usize) * *weight;
                }
            }
        }
        product
    }
}

/// `∫ N_a N_b dV` over the filled part of a voxel of edge `h`. The Gauss points of a full one make it exact.
fn element_product(h: f64, fill: &OccupancyMask) -> [[f64; 8]; 8] {
    let mut product = [[0.0; 8]; 8];
    for QuadraturePoint { xi, weight } in fill.quadrature(h) {
        let values = hex8::weights(&xi);
        for (row, a) in product.iter_mut().zip(values) {
            row.iter_mut().zip(values).for_each(|(sum, b)| *sum += weight * a * b);
        }
    }
    product
}

/// A material point, by its element and local coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Embedding {
    /// Index of the element in the mesh.
    pub element: u32,
    /// Local coordinates in the element, nominally in `[0, 1]³`.
    pub local: Vec3,
}

impl Embedding {
    /// Values of the shape functions of the element's eight corners.
    pub fn weights(&self) -> [f64; 8] {
        hex8::weights(&self.local)
    }
}

/// A quadrature point of the surface of a body.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct SurfaceSample {
    /// Material point in the voxel mesh.
    pub at: Embedding,
    /// Rest position, object frame.
    pub p_o: Vec3,
    /// Outward unit normal at rest, object frame.
    pub n_o: Vec3,
    /// Surface area that the sample represents, m².
    pub area: f64,
}

/// Resolution of a voxel mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoxelSpec {
    /// Voxels along the longest edge of the bounding box, 1..=[`MAX_RESOLUTION`].
    pub resolution: usize,
}

/// Failure to build a voxel mesh.
#[allow(missing_docs, reason = "the messages describe the variants")]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VoxelMeshError {
    #[error(transparent)]
    Shape(#[from] ShapeError),
    #[error("resolution is {0}; give 1 to {MAX_RESOLUTION} voxels along the longest edge")]
    Resolution(usize),
    #[error("the shape is empty; check its subtractions and intersections")]
    Empty,
    #[error(
        "no point of a grid of {:.3} mm lies inside: the shape is empty (check what is subtracted or intersected) or \
         thinner than that (raise the resolution)",
        1e3 * .step
    )]
    Nothing { step: f64 },
}

/// Largest resolution; a cube then has a million voxels.
pub const MAX_RESOLUTION: usize = 100;
/// Filled sub-cells from which a grid cell becomes an element: more than 1 % of the voxel.
const MIN_FILLED: u32 = 3;
/// Distance outside of a voxel, in edges, up to which its trilinear map is used. Beyond, embedded points are clamped,
/// and the map of a deformed body is continued linearly.
pub const MAX_EXTRAPOLATION: f64 = 0.3;

/// Builds the voxel mesh of a shape. The grid is centred on the bounding box and covers it; its edge is the longest
/// extent divided by the resolution. Cells that are less than 1 % filled are left out.
///
/// # Errors
/// If the shape or the resolution is invalid, or the shape is empty or thinner than the sub-cells.
///
/// ```
/// use softvt_geometry::{
///     shape::Shape,
///     voxel::{VoxelSpec, voxel_mesh},
/// };
///
/// let ball = Shape::Sphere { radius: 0.03 };
/// let mesh = voxel_mesh(&ball, &VoxelSpec { resolution: 6 })?;
/// let filled: f64 = mesh.occupancy.iter().map(|cell| cell.fraction()).sum();
/// let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.03_f64.powi(3);
/// assert!((filled * mesh.edge.powi(3) / exact - 1.0).abs() < 0.005);
/// # Ok::<(), softvt_geometry::voxel::VoxelMeshError>(())
/// ```
pub fn voxel_mesh(shape: &Shape, spec: &VoxelSpec) -> Result<VoxelMesh, VoxelMeshError> {
    voxel_mesh_within(shape, &shape.bounds(), spec)
}

/// As [`voxel_mesh`], of a shape whose tight bounds are known: the search for them can take as long as the mesh.
///
/// # Errors
/// As [`voxel_mesh`].
pub fn voxel_mesh_within(
    shape: &Shape,
    bounds: &Aabb,
    spec: &VoxelSpec,
) -> Result<VoxelMesh, VoxelMeshError> {
    let VoxelGrid { edge, grid, origin } = VoxelGrid::covering(shape, bounds, spec)?;
    let mut mesh = VoxelMesh {
        edge,
        nodes: Vec::new(),
        elements: Vec::new(),
        occupancy: Vec::new(),
        grid,
        origin,
        cell_element: vec![u32::MAX; grid.iter().product()],
    };
    for cell in 0..mesh.cell_element.len() {
        let fill = fill_of(shape, &(origin + grid_step(cell, grid) * edge), edge);
        if fill.count() >= MIN_FILLED {
            mesh.cell_element[cell] = mesh.occupancy.len() as u32;
            mesh.occupancy.push(fill);
        }
    }
    if mesh.occupancy.is_empty() {
        return Err(VoxelMeshError::Nothing { step: edge / SUBCELLS as f64 });
    }
    number_nodes(&mut mesh);
    Ok(mesh)
}

/// The grid of a voxel mesh.
pub(super) struct VoxelGrid {
    /// Edge of the cells, m.
    edge: f64,
    /// Number of cells along each axis.
    pub(super) grid: [usize; 3],
    /// Lowest corner, object frame, m.
    origin: Vec3,
}

impl VoxelGrid {
    /// The grid of [`voxel_mesh`].
    pub(super) fn covering(shape: &Shape, bounds: &Aabb, spec: &VoxelSpec) -> Result<Self, VoxelMeshError> {
        shape.validate()?;
        if !(1..=MAX_RESOLUTION).contains(&spec.resolution) {
            return Err(VoxelMeshError::Resolution(spec.resolution));
        }
        let edge = bounds.size().max() / spec.resolution as f64;
        if !(edge > 0.0 && edge.is_finite()) {
            return Err(VoxelMeshError::Empty);
        }
        // The tolerance avoids an extra layer through rounding if the size is a whole number of edges.
        let grid = std::array::from_fn(|axis| ((bounds.size()[axis] / edge - 1e-6).ceil() as usize).max(1));
        let origin = bounds.centre() - Vec3::from_fn(|axis, _| 0.5 * edge * grid[axis] as f64);
        Ok(Self { edge, grid, origin })
    }

    /// True for each cell, x fastest, that is an element of the mesh. Faster than making the mesh.
    pub(super) fn elements(&self, shape: &Shape) -> Vec<bool> {
        let cells = 0..self.grid.iter().product();
        cells
            .map(|cell| is_element(shape, &(self.origin + grid_step(cell, self.grid) * self.edge), self.edge))
            .collect()
    }
}

/// True if a voxel has enough filled sub-cells.
fn is_element(shape: &Shape, corner: &Vec3, edge: f64) -> bool {
    const HALF: usize = SUBCELLS / 2;
    // Of the centre of an eighth to those of its sub-cells; beyond twice that, its sign holds for all of them.
    let reach = 3.0_f64.sqrt() * (HALF as f64 - 1.0) / 2.0 / SUBCELLS as f64 * edge;
    let at = |step: [usize; 3], size: usize| {
        let size = size as f64 / SUBCELLS as f64;
        corner + Vec3::from_fn(|axis, _| (step[axis] as f64 + 0.5) * size) * edge
    };
    let filled_of_eighth = |eighth: usize| {
        let step = hex8::corner_index(eighth);
        let middle = shape.distance(&at(step, HALF));
        if middle.abs() > 2.0 * reach {
            return if middle < 0.0 { MIN_FILLED as usize } else { 0 };
        }
        let inside = (0..HALF.pow(3)).filter(|cell| {
            let within = [cell % HALF, cell / HALF % HALF, cell / HALF / HALF];
            shape.distance(&at(std::array::from_fn(|axis| HALF * step[axis] + within[axis]), 1)) < 0.0
        });
        inside.take(MIN_FILLED as usize).count()
    };
    sign_of_voxel(shape, corner, edge).unwrap_or_else(|| {
        let mut filled = 0;
        (0..8).any(|eighth| {
            filled += filled_of_eighth(eighth);
            filled >= MIN_FILLED as usize
        })
    })
}

/// Grid coordinates of a cell, x fastest.
fn grid_step(cell: usize, grid: [usize; 3]) -> Vec3 {
    Vec3::new((cell % grid[0]) as f64, (cell / grid[0] % grid[1]) as f64, (cell / grid[0] / grid[1]) as f64)
}

/// True for a voxel that is known to be inside, false for one outside, `None` near the surface.
fn sign_of_voxel(shape: &Shape, corner: &Vec3, edge: f64) -> Option<bool> {
    let middle = shape.distance(&(corner + Vec3::repeat(0.5 * edge)));
    // Beyond twice the half diagonal, the sign of the first-order distance holds for the whole voxel.
    (middle.abs() > 3.0_f64.sqrt() * edge).then_some(middle < 0.0)
}

fn fill_of(shape: &Shape, corner: &Vec3, edge: f64) -> OccupancyMask {
    match sign_of_voxel(shape, corner, edge) {
        Some(true) => OccupancyMask::full(),
        Some(false) => OccupancyMask::default(),
        None => OccupancyMask::from_fn(|cell| {
            shape.distance(&(corner + OccupancyMask::centre(cell) * edge)) < 0.0
        }),
    }
}

/// Numbers the corners of all elements in x-fastest order.
fn number_nodes(mesh: &mut VoxelMesh) {
    let [nx, ny, nz] = mesh.grid;
    let corner = |cell: usize, c: usize| {
        let [i, j, k] = hex8::corner_index(c);
        let (i, j, k) = (cell % nx + i, cell / nx % ny + j, cell / nx / ny + k);
        i + (nx + 1) * (j + (ny + 1) * k)
    };
    let cells: Vec<usize> =
        (0..mesh.cell_element.len()).filter(|&cell| mesh.cell_element[cell] != u32::MAX).collect();
    let mut number = vec![u32::MAX; (nx + 1) * (ny + 1) * (nz + 1)];
    for &cell in &cells {
        (0..8).for_each(|c| number[corner(cell, c)] = 0);
    }
    for (index, slot) in number.iter_mut().enumerate().filter(|(_, slot)| **slot == 0) {
        *slot = mesh.nodes.len() as u32;
        mesh.nodes.push(mesh.origin + grid_step(index, [nx + 1, ny + 1, nz + 1]) * mesh.edge);
    }
    mesh.elements = cells.iter().map(|&cell| std::array::from_fn(|c| number[corner(cell, c)])).collect();
}

impl SurfaceSample {
    /// The sample of the same surface at `scale` times the size.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        Self { p_o: self.p_o * scale, area: self.area * scale * scale, ..*self }
    }
}

impl VoxelMesh {
    /// The mesh of the same shape at `scale` times the size: as many voxels, filled alike.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        Self {
            edge: self.edge * scale,
            nodes: self.nodes.iter().map(|node| node * scale).collect(),
            origin: self.origin * scale,
            ..self.clone()
        }
    }

    /// The fills of the elements without repetitions, so that what depends on them alone is computed once for each.
    pub fn distinct_fills(&self) -> DistinctFills {
        let mut fills: Vec<OccupancyMask> = Vec::new();
        let index_of = |fill: &OccupancyMask| {
            let known = fills.iter().position(|known| known == fill);
            known.unwrap_or_else(|| {
                fills.push(*fill);
                fills.len() - 1
            }) as u32
        };
        let of_element = self.occupancy.iter().map(index_of).collect();
        DistinctFills { fills, of_element }
    }

    /// Embeds a rest point `p_o` (object frame, m) in the element that contains it, or in the nearest element up to two
    /// edges away; `None` without such a voxel.
    ///
    /// Points slightly outside of all elements (in slivers that are less than 1 % of a voxel) are extrapolated: local
    /// coordinates may leave [0, 1] by 0.3, which keeps the rest position exact. Farther away they are clamped.
    pub fn locate(&self, p_o: &Vec3) -> Option<Embedding> {
        let at = (p_o - self.origin) / self.edge;
        let home: [i64; 3] =
            std::array::from_fn(|axis| (at[axis].floor() as i64).clamp(0, self.grid[axis] as i64 - 1));
        if let Some(element) = self.element_at(home) {
            return Some(self.embed(element, home, &at));
        }
        let mut best: Option<(f64, u32, [i64; 3])> = None;
        for index in 0..125 {
            let cell = [home[0] + index % 5 - 2, home[1] + index / 5 % 5 - 2, home[2] + index / 25 - 2];
            let Some(element) = self.element_at(cell) else { continue };
            let gap = (0..3).map(|a| at[a] - at[a].clamp(cell[a] as f64, cell[a] as f64 + 1.0));
            let square = gap.map(|g| g * g).sum();
            if best.is_none_or(|(least, ..)| square < least) {
                best = Some((square, element, cell));
            }
        }
        best.map(|(_, element, cell)| self.embed(element, cell, &at))
    }

    /// Rest position of a material point, object frame, m.
    pub fn rest_position(&self, at: &Embedding) -> Vec3 {
        let nodes = &self.elements[at.element as usize];
        at.weights().iter().zip(nodes).map(|(w, &node)| self.nodes[node as usize] * *w).sum()
    }

    /// The element in a grid cell; `None` for empty cells and outside of the grid.
    pub fn element_at(&self, cell: [i64; 3]) -> Option<u32> {
        let within = (0..3).all(|axis| (0..self.grid[axis] as i64).contains(&cell[axis]));
        let [i, j, k] = cell.map(|x| x as usize);
        within
            .then(|| self.cell_element[i + self.grid[0] * (j + self.grid[1] * k)])
            .filter(|&element| element != u32::MAX)
    }

    fn embed(&self, element: u32, cell: [i64; 3], at: &Vec3) -> Embedding {
        let local = Vec3::from_fn(|axis, _| {
            (at[axis] - cell[axis] as f64).clamp(-MAX_EXTRAPOLATION, 1.0 + MAX_EXTRAPOLATION)
        });
        Embedding { element, local }
    }
}
