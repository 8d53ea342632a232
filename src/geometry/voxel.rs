//! The voxel hexahedral mesh of a soft body and what is embedded in it: plain data.
//!
//! Corner `c` of a voxel sits at `(c & 1, c >> 1 & 1, c >> 2 & 1)` in voxel edges from its lowest corner, and its
//! trilinear weight at local coordinates `ξ ∈ [0, 1]³` is the product over axes of `ξ` or `1 − ξ`.

use super::{Vec3, hex8};

/// Sub-points of a voxel along one axis; a voxel's filled part is known on `SUB³` cells.
pub const SUB: usize = 6;

/// Which of the `SUB³` sub-cells of a voxel lie inside the body: bit `i + SUB (j + SUB k)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Fill(pub [u64; 4]);

impl Fill {
    /// A voxel that lies wholly inside.
    pub fn full() -> Self {
        let mut fill = Self::default();
        (0..SUB * SUB * SUB).for_each(|cell| fill.insert(cell));
        fill
    }

    /// Marks sub-cell `cell` as inside.
    pub fn insert(&mut self, cell: usize) {
        self.0[cell / 64] |= 1 << (cell % 64);
    }

    /// Whether sub-cell `cell` is inside.
    pub fn contains(&self, cell: usize) -> bool {
        self.0[cell / 64] >> (cell % 64) & 1 == 1
    }

    /// The share of the voxel that is inside, 0..=1.
    pub fn fraction(&self) -> f64 {
        self.0.iter().map(|w| w.count_ones()).sum::<u32>() as f64 / (SUB * SUB * SUB) as f64
    }

    /// Local coordinates `ξ ∈ [0, 1]³` of the centre of sub-cell `cell`.
    pub fn centre(cell: usize) -> Vec3 {
        let at = |i: usize| (i as f64 + 0.5) / SUB as f64;
        Vec3::new(at(cell % SUB), at(cell / SUB % SUB), at(cell / SUB / SUB))
    }
}

/// A mesh of equal cubes over a body; nodes and elements in x-fastest order.
#[derive(Clone, Debug)]
pub struct VoxelMesh {
    /// Edge of a voxel, m.
    pub edge: f64,
    /// Rest positions of the nodes, object frame.
    pub nodes: Vec<Vec3>,
    /// Node indices of the eight corners of each voxel, in corner order.
    pub elements: Vec<[u32; 8]>,
    /// Filled part of each voxel.
    pub fill: Vec<Fill>,
    /// Number of voxels along each axis of the grid the mesh was cut from.
    pub grid: [usize; 3],
    /// Lowest corner of that grid, object frame.
    pub origin: Vec3,
    /// Element index at each grid cell (x fastest), `u32::MAX` where there is none.
    pub cell_element: Vec<u32>,
}

/// A material point of the body: where it sits in the voxel mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Embedding {
    /// Element index.
    pub element: u32,
    /// Local coordinates in the element, `[0, 1]³`.
    pub local: Vec3,
}

impl Embedding {
    /// Trilinear weights of the element's eight corners.
    pub fn weights(&self) -> [f64; 8] {
        hex8::weights(&self.local)
    }
}

/// A fixed quadrature point of the body's surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSample {
    /// Where it sits in the voxel mesh.
    pub at: Embedding,
    /// Rest position, object frame.
    pub p_o: Vec3,
    /// Outward unit normal at rest, object frame.
    pub n_o: Vec3,
    /// Surface area it stands for, m².
    pub area: f64,
}
