//! Models put together of plainly coloured solids, each with its own mesh, so that colours meet in clean lines.

use crate::sensing::camera::{
    CameraError, RenderMesh,
    mesh::render_mesh::{Lod, bake, check},
    mesh::simplify::decimated,
};
use crate::{
    geometry::{Pose, mesh::Mesh, shape::Shape, surface_mesh::SurfaceMesh},
    scene::Visual,
};

/// How a solid becomes triangles.
#[derive(Clone, Debug)]
pub enum Tessellation {
    /// As the skin of its shape.
    Skin {
        /// Edge of the cells, m.
        cell_m: f64,
    },
    /// As these, in the object frame; the shape only says where it is.
    Mesh(Mesh),
}

/// A solid of one look.
#[derive(Clone, Debug)]
pub struct RenderSolid {
    /// Its shape, in the object frame.
    pub shape: Shape,
    /// How it becomes triangles.
    pub form: Tessellation,
    /// Number of its look.
    pub visual: usize,
}

impl RenderSolid {
    /// A solid of look number `visual`, meshed with cells of edge `cell_m`, m.
    pub fn new(shape: Shape, cell_m: f64, visual: usize) -> Self {
        Self { shape, form: Tessellation::Skin { cell_m }, visual }
    }

    /// A solid of look number `visual` with a mesh of its own.
    pub fn of_mesh(shape: Shape, mesh: Mesh, visual: usize) -> Self {
        Self { shape, form: Tessellation::Mesh(mesh), visual }
    }

    /// The solid moved.
    #[must_use]
    pub fn placed(mut self, pose: &Pose) -> Self {
        self.shape = self.shape.placed(*pose);
        if let Tessellation::Mesh(mesh) = &mut self.form {
            mesh.vertices.iter_mut().for_each(|v| *v = pose.transform_point(&(*v).into()).coords);
        }
        self
    }

    fn triangles(&self) -> Mesh {
        match &self.form {
            Tessellation::Mesh(mesh) => mesh.clone(),
            Tessellation::Skin { cell_m } => SurfaceMesh::from_shape(&self.shape, *cell_m).mesh,
        }
    }
}

/// How far the levels may be from what is meshed, m: for large pictures, for small ones, and for shadows and far views. What
/// throws shadows must not stand out of what they fall on by as much as shadow maps leave between them.
const FLAWS: [f32; 3] = [1e-4, 2.5e-4, 5e-4];
/// Smooth one-coloured surfaces look right with edges of so many times what patterns need: this share of a cell counts
/// as the level's spacing.
const PLAIN: f64 = 0.16;
/// What lies deeper than this inside of another solid is never seen, m.
const HIDDEN: f64 = 1.5e-3;

impl RenderMesh {
    /// The drawn form of solids that may reach into each other; `visuals` by their numbers.
    ///
    /// # Errors
    /// If a solid has no surface or its look is not there.
    pub fn of_solids(name: &str, solids: &[RenderSolid], visuals: &[Visual]) -> Result<Self, CameraError> {
        let whole = Shape::Union(solids.iter().map(|solid| solid.shape.clone()).collect());
        let mut finer = level(name, solids, visuals, &whole)?;
        let levels = FLAWS.map(|flaw| {
            finer = Lod { flaw, ..decimated(&finer, flaw) };
            finer.clone()
        });
        Ok(Self { levels: levels.into(), facets: Vec::new() })
    }
}

fn level(name: &str, solids: &[RenderSolid], visuals: &[Visual], whole: &Shape) -> Result<Lod, CameraError> {
    let mut all = Mesh { vertices: Vec::new(), triangles: Vec::new(), uvs: Vec::new() };
    let mut materials = Vec::new();
    // Of solids with meshes of their own alone: fine enough for any view.
    let mut largest = 2e-3_f64;
    for (i, solid) in solids.iter().enumerate() {
        if let Tessellation::Skin { cell_m } = solid.form {
            largest = largest.max(cell_m);
        }
        let mesh = solid.triangles();
        check(name, &mesh, &vec![solid.visual as u16; mesh.triangles.len()], visuals)?;
        let first = all.vertices.len() as u32;
        let hidden: Vec<bool> = mesh
            .vertices
            .iter()
            .map(|v| {
                let others = solids.iter().enumerate().filter(|(j, _)| *j != i);
                others.into_iter().any(|(_, other)| other.shape.distance(v) < -HIDDEN)
            })
            .collect();
        let seen = mesh.triangles.iter().filter(|t| !t.iter().all(|&v| hidden[v as usize]));
        all.triangles.extend(seen.map(|t| t.map(|v| v + first)));
        materials.resize(all.triangles.len(), solid.visual as u16);
        all.vertices.extend(mesh.vertices);
    }
    // Each solid is of one look, and shares no vertex with another.
    Ok(Lod { plain: true, ..bake(&all, &materials, visuals, (PLAIN * largest) as f32, Some(whole)) })
}
