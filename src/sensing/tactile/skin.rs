//! The fine skins that press on a gel: made once for each kind of thing, placed over the pad at every frame.

use crate::{
    geometry::{Pose, Vec3, shape::Shape, skin, voxel::VoxelMesh},
    sensing::camera,
};

/// Edge of the cells from which a skin is made, m: seeds and ridges of a millimetre show, and a picture's field is solved
/// on 0.4 mm.
const CELL: f64 = 8e-4;
/// Cells along the longest edge at most; a table is as flat with few.
const MOST_CELLS: f64 = 160.0;
/// Nodes and weights of a vertex of a soft body.
type Embedded = ([u32; 8], [f64; 8]);

/// A skin in the frame of its object at rest.
#[derive(Clone, Debug)]
pub struct Skin {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// For soft bodies only.
    embedding: Vec<Embedded>,
}

impl Skin {
    /// The skin of a shape.
    pub fn of_shape(shape: &Shape) -> Self {
        let cell = CELL.max(shape.bounds().size().max() / MOST_CELLS);
        let mesh = camera::flat_faces(shape).unwrap_or_else(|| skin::skin(shape, cell).mesh);
        Self { vertices: mesh.vertices, triangles: mesh.triangles, embedding: Vec::new() }
    }

    /// The same, moved by the nodes of a soft body; `None` if part of it lies more than two voxels outside of `mesh`.
    pub fn embedded(mut self, mesh: &VoxelMesh) -> Option<Self> {
        let place = |p: &Vec3| {
            let at = mesh.locate(p)?;
            Some((mesh.elements[at.element as usize], at.weights()))
        };
        self.embedding = self.vertices.iter().map(place).collect::<Option<_>>()?;
        Some(self)
    }

    /// Triangles, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Vertices where the object's frame is at `pose`.
    pub fn rigid(&self, pose: &Pose, out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.vertices.iter().map(|v| (pose * nalgebra::Point3::from(*v)).coords));
    }

    /// Vertices of an embedded skin with the body's nodes at `nodes`, seen from a frame: `to` is the world in it.
    pub fn soft(&self, nodes: &[Vec3], to: &Pose, out: &mut Vec<Vec3>) {
        out.clear();
        let (turn, shift) = (to.rotation.to_rotation_matrix().into_inner(), to.translation.vector);
        out.extend(self.embedding.iter().map(|(ids, weights)| {
            let at = ids.iter().zip(weights).fold(Vec3::zeros(), |sum, (&id, w)| sum + nodes[id as usize] * *w);
            turn * at + shift
        }));
    }
}
