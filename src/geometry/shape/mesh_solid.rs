//! Solids bounded by a triangle mesh. Distances and rays use the bounding volume hierarchy of parry.

use parry3d_f64::{
    query::{PointQuery, Ray, RayCast},
    shape::{TriMesh, TriMeshFlags},
};
use serde::{Serialize, Serializer};
use sha2::{Digest, Sha256};

use super::combine::SignedDistance;
use crate::{
    Vec3,
    mesh::{Mesh, MeshError},
    parry::{from_parry, to_parry},
};

/// A closed, outward-oriented mesh with a bounding volume hierarchy.
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
        write!(f, "MeshSolid({} triangles)", self.mesh.triangles.len())
    }
}

// Text holds the hash of the surface: fingerprints of assets need no more. A binary format holds all of it.
impl Serialize for MeshSolid {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            return serializer.serialize_str(&digest(&self.mesh));
        }
        self.mesh.serialize(serializer)
    }
}

/// SHA-256 of the vertices of a mesh, rounded to a nanometre, and of its triangles.
fn digest(mesh: &Mesh) -> String {
    let mut hash = Sha256::new();
    let coordinates = mesh.vertices.iter().flat_map(|v| v.iter());
    coordinates.for_each(|x| hash.update(((x * 1e9).round() as i64).to_le_bytes()));
    mesh.triangles.iter().flatten().for_each(|corner| hash.update(corner.to_le_bytes()));
    format!("{:x}", hash.finalize())
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

    /// The closed mesh, triangles oriented outwards.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Exact signed distance; the sign is that of angle-weighted pseudo-normals (Baerentzen & Aanaes 2005).
    pub(super) fn signed_distance(&self, p: &Vec3) -> SignedDistance {
        let (projection, _) = self.tree.project_local_point_and_get_feature(to_parry(p));
        let arm = p - from_parry(projection.point);
        let length = arm.norm();
        let sign = if projection.is_inside { -1.0 } else { 1.0 };
        if length > 1e-9 {
            return SignedDistance::new(sign * length, arm * (sign / length));
        }
        SignedDistance::new(sign * length, self.face_normal(p))
    }

    /// Normal of the face at a surface point, where the distance vector vanishes.
    fn face_normal(&self, p: &Vec3) -> Vec3 {
        use parry3d_f64::query::PointQueryWithLocation;
        let (_, (face, _)) = self.tree.project_local_point_and_get_location(to_parry(p), false);
        let [a, b, c] = self.mesh.triangles[face as usize].map(|v| self.mesh.vertices[v as usize]);
        (b - a).cross(&(c - a)).normalize()
    }

    pub(super) fn ray(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<f64> {
        if self.signed_distance(origin).distance < 0.0 {
            return Some(0.0);
        }
        self.tree.cast_local_ray(&Ray::new(to_parry(origin), to_parry(direction)), max, false)
    }
}
