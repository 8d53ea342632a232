//! Triangle meshes and the solids they bound.

use std::{collections::BTreeMap, sync::Arc};

use parry3d_f64::{
    math::Vector,
    query::{PointQuery, Ray, RayCast},
    shape::{TriMesh, TriMeshFlags},
};

use sha2::{Digest, Sha256};

use super::{Vec3, shape::Shape};

/// A triangle mesh in the object frame, m.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Mesh {
    /// Corner positions.
    pub vertices: Vec<Vec3>,
    /// Corner indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the three corners of each triangle, or empty.
    pub uvs: Vec<[[f64; 2]; 3]>,
}

/// Why a mesh bounds no solid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No triangles.
    #[error("the mesh is empty: it has no triangles; export a closed surface")]
    Empty,
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a number; export the mesh again")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error(
        "triangle {triangle} names vertex {vertex}, but there are {vertices} vertices; export the mesh again"
    )]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// Edges with a triangle on one side only.
    #[error("the mesh is open: {edges} edges have a triangle on one side only; close its holes")]
    Open {
        /// How many.
        edges: usize,
    },
    /// Edges with more than two triangles, or two triangles that disagree on which side is out.
    #[error(
        "{edges} edges are shared by more than two triangles or by two of opposite orientation; make the surface a manifold with consistent normals"
    )]
    NonManifold {
        /// How many.
        edges: usize,
    },
    /// No volume.
    #[error("the mesh encloses no volume; export a solid, not a sheet")]
    Flat,
}

impl Mesh {
    /// Enclosed volume by the divergence theorem, m³; negative if the triangles face inwards.
    pub fn volume(&self) -> f64 {
        self.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| self.vertices[v as usize]);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// Surface area, m².
    pub fn area(&self) -> f64 {
        self.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| self.vertices[v as usize]);
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .sum()
    }

    /// Merges vertices at the same place and drops triangles that thereby vanish.
    pub fn welded(&self) -> Self {
        let mut index = BTreeMap::new();
        let mut out = Self::default();
        let key = |v: &Vec3| [v.x, v.y, v.z].map(|x| (x + 0.0).to_bits());
        let renamed: Vec<u32> = self
            .vertices
            .iter()
            .map(|v| {
                *index.entry(key(v)).or_insert_with(|| {
                    out.vertices.push(*v);
                    out.vertices.len() as u32 - 1
                })
            })
            .collect();
        for (index, triangle) in self.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|v| renamed[v as usize]);
            if a != b && b != c && c != a {
                out.triangles.push([a, b, c]);
                out.uvs.extend(self.uvs.get(index));
            }
        }
        out
    }

    /// Checks indices and coordinates.
    ///
    /// # Errors
    /// If the mesh is empty, a coordinate is not finite or a triangle names a missing vertex.
    pub fn check(&self) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(vertex) = self.vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        let vertices = self.vertices.len();
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|v| **v as usize >= vertices) {
                return Err(MeshError::Index { triangle, vertex, vertices });
            }
        }
        Ok(())
    }

    /// Checks that every edge is shared by exactly two triangles of like orientation.
    ///
    /// # Errors
    /// Counts the edges that are not.
    pub fn check_closed(&self) -> Result<(), MeshError> {
        let mut uses: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
        for t in &self.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                uses.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
            }
        }
        let open = uses.values().filter(|[up, down]| up + down == 1).count();
        if open > 0 {
            return Err(MeshError::Open { edges: open });
        }
        let odd = uses.values().filter(|directions| **directions != [1, 1]).count();
        if odd > 0 { Err(MeshError::NonManifold { edges: odd }) } else { Ok(()) }
    }

    /// The solid that the mesh bounds. Vertices at one place are merged; a mesh that is inside out is turned.
    ///
    /// # Errors
    /// If the mesh is empty, not finite, open, not manifold, or flat.
    pub fn into_shape(self) -> Result<Shape, MeshError> {
        Ok(Shape::Mesh(Arc::new(MeshSolid::new(self)?)))
    }
}

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
    fn new(mesh: Mesh) -> Result<Self, MeshError> {
        mesh.check()?;
        let mut mesh = mesh.welded();
        mesh.check()?;
        mesh.check_closed()?;
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

/// parry has its own vector type; it stays in this room.
pub(super) fn to_parry(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

fn from_parry(v: Vector) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}
