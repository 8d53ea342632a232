//! Solids bounded by a triangle mesh. Distances and rays use the bounding volume hierarchy of parry.

use parry3d_f64::{
    query::{PointQuery, Ray, RayCast},
    shape::{TriMesh, TriMeshFlags},
};
use serde::{Serialize, Serializer};
use sha2::{Digest, Sha256};

use super::combine::SignedDistance;
use crate::{
    Aabb, Vec3,
    mesh::{Mesh, MeshError},
    mesh_overlap::check_pieces,
    parry::{from_parry, to_parry},
};

/// A closed, outward-oriented mesh with a bounding volume hierarchy.
#[derive(Clone)]
pub struct MeshSolid {
    mesh: Mesh,
    /// Index of each triangle in the mesh that it was made from.
    sources: Vec<u32>,
    tree: TriMesh,
}

/// The point of a mesh nearest to a point of space.
#[derive(Clone, Copy, Debug)]
pub struct MeshPoint<'a> {
    /// The mesh on which the point lies.
    pub solid: &'a MeshSolid,
    /// Index of the triangle.
    pub triangle: usize,
    /// Texture coordinates, if the mesh has them.
    pub uv: Option<[f64; 2]>,
    /// Change of the texture coordinates per metre along the triangle; 0 without coordinates.
    pub uv_per_m: f64,
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

/// Distances within which the vertices of an open mesh are one, in diagonals of its bounding box: files without
/// indices round each corner of a triangle by itself. The least that closes the mesh spoils the fewest small triangles.
const WELDING: [f64; 2] = [1e-8, 1e-6];

/// A mesh with one vertex at each place, and the indices of the triangles that were kept.
fn welded(mesh: &Mesh) -> (Mesh, Vec<u32>) {
    let diagonal = Aabb::from_points(&mesh.vertices).map_or(0.0, |bounds| bounds.size().norm());
    let mut welded = mesh.welded_keeping();
    for distance in WELDING {
        if !matches!(welded.0.validate_closed(), Err(MeshError::Open { .. })) {
            break;
        }
        welded = mesh.snapped(distance * diagonal).welded_keeping();
    }
    welded
}

impl MeshSolid {
    pub(super) fn new(mesh: Mesh) -> Result<Self, MeshError> {
        mesh.validate()?;
        let (mut mesh, sources) = welded(&mesh);
        mesh.validate()?;
        mesh.validate_closed()?;
        let volume = mesh.volume();
        if volume < 0.0 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            mesh.uvs.iter_mut().for_each(|t| t.swap(1, 2));
        }
        if mesh.is_flat() {
            return Err(MeshError::Flat);
        }
        check_pieces(&mesh)?;
        let points = mesh.vertices.iter().map(to_parry).collect();
        let tree = TriMesh::with_flags(points, mesh.triangles.clone(), TriMeshFlags::ORIENTED)
            .map_err(|_| MeshError::Empty)?;
        Ok(Self { mesh, sources, tree })
    }

    /// Index of each triangle in the mesh that the solid was made from.
    pub fn sources(&self) -> &[u32] {
        &self.sources
    }

    /// The point of the surface nearest to `p`.
    pub(super) fn nearest(&self, p: &Vec3) -> MeshPoint<'_> {
        use parry3d_f64::query::PointQueryWithLocation;
        let (_, (face, location)) = self.tree.project_local_point_and_get_location(to_parry(p), false);
        let triangle = face as usize;
        let corners = self.mesh.triangles[triangle].map(|v| self.mesh.vertices[v as usize]);
        let uvs = self.mesh.uvs.get(triangle);
        let weights = location.barycentric_coordinates();
        let uv = uvs.zip(weights).map(|(uvs, weights)| {
            [0, 1].map(|axis| uvs.iter().zip(weights).map(|(uv, weight)| uv[axis] * weight).sum())
        });
        let area = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).norm();
        let uv_area = uvs
            .map_or(0.0, |[a, b, c]| ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs());
        let uv_per_m = if area > 0.0 { (uv_area / area).sqrt() } else { 0.0 };
        MeshPoint { solid: self, triangle, uv, uv_per_m }
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
