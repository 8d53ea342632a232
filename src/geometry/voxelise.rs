//! Cutting a shape into the voxel hexahedral mesh of a soft body, and finding points in it.

use super::{
    Vec3, hex8,
    shape::{Shape, ShapeError},
    voxel::{Embedding, Fill, SUB, VoxelMesh},
};

/// How to cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoxelSpec {
    /// Voxels along the longest edge of the bounding box.
    pub resolution: usize,
}

/// Why a shape has no voxel mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// The shape itself cannot be.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The resolution is out of range.
    #[error("resolution is {0}; give 1 to {MAX_RESOLUTION} voxels along the longest edge")]
    Resolution(usize),
    /// Nothing is inside.
    #[error("the shape is empty: nothing of it is left; check what is subtracted or intersected")]
    Empty,
    /// Nothing is inside, or nothing that a voxel could see.
    #[error(
        "no point of a grid of {:.3} mm lies inside: the shape is empty (check what is subtracted or intersected) or \
         thinner than that (raise the resolution)",
        1e3 * .step
    )]
    Nothing {
        /// Spacing of the points that were tried, m.
        step: f64,
    },
}

/// Largest resolution: a million voxels for a cube.
pub const MAX_RESOLUTION: usize = 100;
/// A voxel exists from this filled share on.
const LEAST_FILL: f64 = 0.01;
/// How far outside of a voxel, in its edges, a point is still extrapolated rather than clamped.
const SLIVER: f64 = 0.3;

/// Cuts a shape into cubes of edge longest/resolution; the grid is centred on the bounding box and covers it.
///
/// # Errors
/// If the shape or the resolution cannot be, or the shape is empty.
pub fn voxel_mesh(shape: &Shape, spec: &VoxelSpec) -> Result<VoxelMesh, GeometryError> {
    shape.check()?;
    if !(1..=MAX_RESOLUTION).contains(&spec.resolution) {
        return Err(GeometryError::Resolution(spec.resolution));
    }
    let bounds = shape.bounds();
    let edge = bounds.size().max() / spec.resolution as f64;
    if !(edge > 0.0 && edge.is_finite()) {
        return Err(GeometryError::Empty);
    }
    // The slack keeps a size that is a whole number of edges from growing by a layer through rounding.
    let grid = std::array::from_fn(|axis| ((bounds.size()[axis] / edge - 1e-6).ceil() as usize).max(1));
    let origin = bounds.centre() - Vec3::from_fn(|axis, _| 0.5 * edge * grid[axis] as f64);
    let mut mesh = VoxelMesh {
        edge,
        nodes: Vec::new(),
        elements: Vec::new(),
        fill: Vec::new(),
        grid,
        origin,
        cell_element: vec![u32::MAX; grid.iter().product()],
    };
    for cell in 0..mesh.cell_element.len() {
        let fill = fill_of(shape, &(origin + grid_step(cell, grid) * edge), edge);
        if fill.fraction() >= LEAST_FILL {
            mesh.cell_element[cell] = mesh.fill.len() as u32;
            mesh.fill.push(fill);
        }
    }
    if mesh.fill.is_empty() {
        return Err(GeometryError::Nothing { step: edge / SUB as f64 });
    }
    number_nodes(&mut mesh);
    Ok(mesh)
}

/// Grid coordinates of a cell, x fastest.
fn grid_step(cell: usize, grid: [usize; 3]) -> Vec3 {
    Vec3::new((cell % grid[0]) as f64, (cell / grid[0] % grid[1]) as f64, (cell / grid[0] / grid[1]) as f64)
}

fn fill_of(shape: &Shape, corner: &Vec3, edge: f64) -> Fill {
    let middle = shape.distance(&(corner + Vec3::repeat(0.5 * edge)));
    // Farther than twice the half diagonal from the surface even a first-order distance leaves no doubt.
    if middle.abs() > 3.0_f64.sqrt() * edge {
        return if middle < 0.0 { Fill::full() } else { Fill::default() };
    }
    let mut fill = Fill::default();
    (0..SUB * SUB * SUB)
        .filter(|&cell| shape.distance(&(corner + Fill::centre(cell) * edge)) < 0.0)
        .for_each(|cell| fill.insert(cell));
    fill
}

/// Numbers the corners of existing voxels in x-fastest order.
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

impl VoxelMesh {
    /// Where a rest point sits: in the voxel that holds it, or in the nearest existing one up to two edges away.
    ///
    /// A point in a sliver too thin to have its own voxel is extrapolated from its neighbour (local coordinates up to 0.3
    /// outside of [0, 1]), so that its rest position is exact; farther away the coordinates are clamped.
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

    /// The rest position of a material point, object frame.
    pub fn rest_position(&self, at: &Embedding) -> Vec3 {
        let nodes = &self.elements[at.element as usize];
        at.weights().iter().zip(nodes).map(|(w, &node)| self.nodes[node as usize] * *w).sum()
    }

    /// The element in a cell of the grid, if the cell is in the grid and holds one.
    pub fn element_at(&self, cell: [i64; 3]) -> Option<u32> {
        let within = (0..3).all(|axis| (0..self.grid[axis] as i64).contains(&cell[axis]));
        let [i, j, k] = cell.map(|x| x as usize);
        within
            .then(|| self.cell_element[i + self.grid[0] * (j + self.grid[1] * k)])
            .filter(|&element| element != u32::MAX)
    }

    fn embed(&self, element: u32, cell: [i64; 3], at: &Vec3) -> Embedding {
        let local = Vec3::from_fn(|axis, _| (at[axis] - cell[axis] as f64).clamp(-SLIVER, 1.0 + SLIVER));
        Embedding { element, local }
    }
}
