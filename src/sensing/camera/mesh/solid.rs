//! Meshes composed of solids of one material each, meshed separately so that materials meet along clean lines.

use super::{
    bake::bake_vertices,
    lod::Lod,
    primitive_mesh::{append_visible, transform},
    render_mesh::{RenderMesh, check_mesh},
    simplify::simplify,
};
use crate::{
    geometry::{Pose, Vec3, mesh::Mesh, shape::Shape, surface_mesh::SurfaceMesh},
    scene::Visual,
    sensing::camera::CameraError,
};

/// Triangulation of a solid.
#[derive(Clone, Debug)]
pub enum Tessellation {
    /// By the surface mesher.
    Cells {
        /// Edge of its cells, m.
        cell_m: f64,
    },
    /// By a given mesh in the object frame; the shape is only used for distances.
    Mesh(Mesh),
}

/// A solid of one material, in the object frame.
#[derive(Clone, Debug)]
pub struct RenderSolid {
    /// Volume occupied by the solid.
    pub shape: Shape,
    /// Triangulation of its surface.
    pub tessellation: Tessellation,
    /// Index of its visual.
    pub visual: usize,
}

impl RenderSolid {
    /// A solid triangulated by the surface mesher with cells of edge `cell_m`, m.
    pub fn new(shape: Shape, cell_m: f64, visual: usize) -> Self {
        Self { shape, tessellation: Tessellation::Cells { cell_m }, visual }
    }

    /// A solid with a given mesh.
    pub fn with_mesh(shape: Shape, mesh: Mesh, visual: usize) -> Self {
        Self { shape, tessellation: Tessellation::Mesh(mesh), visual }
    }

    /// Moves the solid by `pose`.
    #[must_use]
    pub fn placed(mut self, pose: &Pose) -> Self {
        self.shape = self.shape.placed(*pose);
        if let Tessellation::Mesh(mesh) = &mut self.tessellation {
            transform(mesh, pose);
        }
        self
    }

    fn mesh(&self) -> Mesh {
        match &self.tessellation {
            Tessellation::Mesh(mesh) => mesh.clone(),
            Tessellation::Cells { cell_m } => SurfaceMesh::from_shape(&self.shape, *cell_m).mesh,
        }
    }
}

/// Geometric errors of the levels of detail, m: for large images, for small ones, and for distant views and shadows.
/// The last is below the depth bias of shadow maps, so that casters do not shade their own surface.
const LOD_ERRORS: [f32; 3] = [1e-4, 2.5e-4, 5e-4];
/// Vertex spacing in cells that counts for the choice of a level: surfaces of one colour need
/// fewer vertices than patterns.
const UNIFORM_SPACING: f64 = 0.16;
/// Minimum cell that counts for it, m: meshes given explicitly are fine enough for any view.
const MIN_CELL: f64 = 2e-3;
/// Vertices deeper than this inside another solid are invisible, m.
const HIDDEN_DEPTH: f64 = 1.5e-3;

impl RenderMesh {
    /// Builds the mesh of solids that may overlap; `visuals` are those that the solids index.
    ///
    /// # Errors
    /// A solid has no surface, or its visual does not exist.
    pub fn from_solids(name: &str, solids: &[RenderSolid], visuals: &[Visual]) -> Result<Self, CameraError> {
        let mut finer = combined_level(name, solids, visuals)?;
        let lods = LOD_ERRORS.map(|geometric_error| {
            finer = Lod { geometric_error, ..simplify(&finer, geometric_error) };
            finer.clone()
        });
        Ok(Self { lods: lods.into(), charts: Vec::new() })
    }
}

/// The finest level: all solids without the triangles that are inside others.
fn combined_level(name: &str, solids: &[RenderSolid], visuals: &[Visual]) -> Result<Lod, CameraError> {
    let union = Shape::Union(solids.iter().map(|solid| solid.shape.clone()).collect());
    let mut combined = Mesh::default();
    let mut material_ids = Vec::new();
    let mut max_cell = MIN_CELL;
    for (i, solid) in solids.iter().enumerate() {
        if let Tessellation::Cells { cell_m } = solid.tessellation {
            max_cell = max_cell.max(cell_m);
        }
        let mesh = solid.mesh();
        check_mesh(name, &mesh, &vec![solid.visual as u16; mesh.triangles.len()], visuals)?;
        append_visible(&mut combined, mesh, |v: &Vec3| {
            let mut others = solids.iter().enumerate().filter(|(j, _)| *j != i);
            others.any(|(_, other)| other.shape.distance(v) < -HIDDEN_DEPTH)
        });
        material_ids.resize(combined.triangles.len(), solid.visual as u16);
    }
    let spacing = (UNIFORM_SPACING * max_cell) as f32;
    // Solids share no vertices and are uniform each, so their materials do not limit simplification.
    Ok(Lod { is_uniform: true, ..bake_vertices(&combined, &material_ids, visuals, spacing, Some(&union)) })
}
