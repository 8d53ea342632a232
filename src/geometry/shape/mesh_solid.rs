//! Solids bounded by a triangle mesh, with parry's bounding volume hierarchy for distances and rays.

use parry3d_f64::{
    query::{PointQuery, Ray, RayCast},
    shape::{TriMesh, TriMeshFlags},
};
use sha2::{Digest, Sha256};

use crate::geometry::{
    Vec3,
    mesh::{Mesh, MeshError},
    parry::{from_parry, to_parry},
};

/// A closed mesh with what makes distances to it fast.
#[derive(Clone)]
pub struct MeshSolid {
    mesh: Mesh,
    tree: TriMesh,
}

impl PartialEq for MeshSolid {
    fn eq(&self, other: &Self) -> bool {
        self.mesh == other.mesh
    }
}

impl std::fmt::Debug for MeshSolid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Mesh { vertices, triangles, .. } = &self.mesh;
        write!(
            f,
            "MeshSolid({} vertices, {} triangles, {})",
            vertices.len(),
            triangles.len(),
            digest(&self.mesh)
        )
    }
}

/// SHA-256 of a mesh's corners, to a nanometre, and triangles.
fn digest(mesh: &Mesh) -> String {
    let mut hash = Sha256::new();
    let coordinates = mesh.vertices.iter().flat_map(|v| v.iter());
    coordinates.for_each(|x| hash.update(((x * 1e9).round() as i64).to_le_bytes()));
    mesh.triangles.iter().flatten().for_each(|corner| hash.update(corner.to_le_bytes()));
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

impl MeshSolid {
    pub(super) fn new(mesh: Mesh) -> Result<Self, MeshError> {
        mesh.validate()?;
        let mut mesh = mesh.welded();
        mesh.validate()?;
        mesh.validate_closed()?;
        let volume = mesh.volume();
        if volume < 0.0 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            mesh.uvs.iter_mut().for_each(|t| t.swap(1, 2));
        }
        if volume.abs() < 1e-6 * mesh.area().powf(1.5) {
            return Err(MeshError::Flat);
        }
        let points = mesh.vertices.iter().map(to_parry).collect();
        let tree = TriMesh::with_flags(points, mesh.triangles.clone(), TriMeshFlags::ORIENTED)
            .map_err(|_| MeshError::Empty)?;
        Ok(Self { mesh, tree })
    }

    /// The mesh, closed and facing outwards.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Exact signed distance (sign by angle-weighted pseudo-normals, Baerentzen & Aanaes 2005) and its gradient.
    pub(super) fn distance_and_normal(&self, p: &Vec3) -> (f64, Vec3) {
        let (projection, _) = self.tree.project_local_point_and_get_feature(to_parry(p));
        let arm = p - from_parry(projection.point);
        let length = arm.norm();
        let sign = if projection.is_inside { -1.0 } else { 1.0 };
        if length > 1e-9 {
            return (sign * length, arm * (sign / length));
        }
        (sign * length, self.face_normal(p))
    }

    /// Normal of the face under a point of the surface, where the distance has no direction.
    fn face_normal(&self, p: &Vec3) -> Vec3 {
        use parry3d_f64::query::PointQueryWithLocation;
        let (_, (face, _)) = self.tree.project_local_point_and_get_location(to_parry(p), false);
        let [a, b, c] = self.mesh.triangles[face as usize].map(|v| self.mesh.vertices[v as usize]);
        (b - a).cross(&(c - a)).normalize()
    }

    pub(super) fn ray(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<f64> {
        if self.distance_and_normal(origin).0 < 0.0 {
            return Some(0.0);
        }
        self.tree.cast_local_ray(&Ray::new(to_parry(origin), to_parry(direction)), max, false)
    }
}
