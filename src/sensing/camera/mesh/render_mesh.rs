//! The drawn form of an object: levels of detail with baked materials.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    bake::{bake_vertices, extent},
    lathe_mesh::lathe_mesh,
    lod::{Lod, MAX_ERROR_PIXELS, NodeWeights},
    primitive_mesh::{flat_faces, primitive_mesh},
    simplify::simplify,
    texture_chart::{SurfaceMaterial, TEXT_TEXEL, TextureChart},
    uv_atlas::{flat_charts, parameterize, suits_flat_charts},
};
use crate::{
    geometry::{
        Vec3,
        mesh::Mesh,
        shape::{Polygon, Shape},
        surface_mesh::SurfaceMesh,
        voxel::{Embedding, VoxelMesh},
    },
    scene::Visual,
    sensing::camera::{CameraError, math::V3, raster::TRIANGLE_BITS, shade::pattern},
};

/// Cells along the longest edge of a shape, per level of detail. The coarsest level also casts shadows.
const CELLS: [f64; 4] = [64.0, 40.0, 26.0, 16.0];
/// Tolerance of the simplification of rigid shapes, in vertex spacings.
const SIMPLIFY_TOLERANCE: f32 = 0.025;
/// Maximum edge of triangles with patterns, in longest extents of the mesh.
const MAX_PATTERN_EDGE: f64 = 1.0 / 48.0;
/// Maximum number of triangles that subdivision creates.
const MAX_SUBDIVIDED_TRIANGLES: usize = 120_000;

/// Triangles and materials of one kind of object, shared by all its instances.
///
/// Materials are functions of the object frame. They are evaluated once, into vertices, or into textures for large
/// flat faces and for surfaces with text, and filtered to the spacing of the samples; small images therefore do not
/// alias. Coarser levels of detail are drawn where they look the same.
#[derive(Clone, Debug)]
pub struct RenderMesh {
    /// From fine to coarse; at least one.
    pub(crate) lods: Vec<Lod>,
    pub(crate) charts: Vec<TextureChart>,
}

impl RenderMesh {
    /// Builds the mesh of a rigid shape. `visuals` are indexed by its material ids; `name` appears in errors.
    ///
    /// # Errors
    /// The shape has no surface, or a material id has no visual.
    pub fn from_shape(name: &str, shape: &Shape, visuals: &[Visual]) -> Result<Self, CameraError> {
        if let Some(mesh) = flat_faces(shape) {
            return Self::from_mesh(name, &mesh, &[], visuals);
        }
        let mut mesh = Self::with_lods(name, shape, visuals, primitive_mesh)?;
        // Texture coordinates belong to the triangles as they are.
        if mesh.charts.is_empty() {
            for lod in &mut mesh.lods {
                *lod = simplify(lod, SIMPLIFY_TOLERANCE * lod.vertex_spacing);
            }
        }
        Ok(mesh)
    }

    /// Builds the mesh of a shape that will bend, with small triangles on flat faces too.
    ///
    /// # Errors
    /// As [`RenderMesh::from_shape`].
    pub fn from_deformable_shape(name: &str, shape: &Shape, visuals: &[Visual]) -> Result<Self, CameraError> {
        Self::with_lods(name, shape, visuals, |_, _| None)
    }

    /// `exact_mesh` triangulates shapes with text, which need no small triangles, if it can.
    fn with_lods(
        name: &str,
        shape: &Shape,
        visuals: &[Visual],
        exact_mesh: impl Fn(&Shape, f64) -> Option<Mesh>,
    ) -> Result<Self, CameraError> {
        let longest = shape.bounds().size().max();
        let (mut lods, mut charts) = (Vec::new(), Vec::new());
        let text_material = visuals
            .iter()
            .any(pattern::has_text)
            .then(|| Arc::new(SurfaceMaterial { shape: shape.clone(), visuals: visuals.to_vec() }));
        for cells in CELLS {
            let cell = longest / cells;
            let exact = text_material.as_ref().and_then(|_| exact_mesh(shape, cell));
            let (mesh, material_ids) = match exact {
                Some(mesh) => with_material_ids(mesh, shape),
                None => triangulate(shape, cell),
            };
            check_mesh(name, &mesh, &material_ids, visuals)?;
            let mut lod = bake_vertices(&mesh, &material_ids, visuals, cell as f32, Some(shape));
            let texel = TEXT_TEXEL * (CELLS[0] / cells) as f32;
            if let Some(material) = &text_material {
                parameterize(&mut lod, &mut charts, material, texel);
            }
            if !lods.is_empty() && lod.is_uniform {
                // With text, a coarse level also requires that its texels are no larger than a pixel.
                let min_error = if text_material.is_some() { MAX_ERROR_PIXELS * texel } else { 0.0 };
                lod.geometric_error = rms_error(&mesh, shape, cell).max(min_error);
            }
            lods.push(lod);
            if matches!(shape, Shape::Mesh(_)) {
                break;
            }
        }
        Ok(Self { lods, charts })
    }

    /// Builds the mesh of triangles, closed or not, which are visible from their counter-clockwise side.
    ///
    /// `material_ids` index the visual of each triangle; if empty, all have the first visual. Normals are computed. The
    /// texture coordinates of `mesh` are ignored, since patterns are functions of the object frame.
    ///
    /// # Errors
    /// The mesh is empty, not finite, or refers to a vertex or visual that does not exist.
    pub fn from_mesh(
        name: &str,
        mesh: &Mesh,
        material_ids: &[u16],
        visuals: &[Visual],
    ) -> Result<Self, CameraError> {
        let material_ids =
            if material_ids.is_empty() { vec![0; mesh.triangles.len()] } else { material_ids.to_vec() };
        check_mesh(name, mesh, &material_ids, visuals)?;
        let has_pattern = material_ids.iter().any(|&id| !visuals[id as usize].layers.is_empty());
        if has_pattern && suits_flat_charts(mesh, visuals.iter().any(pattern::has_text)) {
            let (lod, charts) = flat_charts(mesh, &material_ids, visuals);
            return Ok(Self { lods: vec![lod], charts });
        }
        let longest = extent(mesh);
        let mesh =
            Mesh { vertices: mesh.vertices.clone(), triangles: mesh.triangles.clone(), uvs: Vec::new() };
        let fine = if has_pattern {
            subdivide(mesh, material_ids, longest * MAX_PATTERN_EDGE)
        } else {
            SubdividedMesh { mesh, material_ids, edge: longest }
        };
        let spacing = fine.edge.min(longest) as f32;
        let lod = bake_vertices(&fine.mesh, &fine.material_ids, visuals, spacing, None);
        Ok(Self { lods: vec![lod], charts: Vec::new() })
    }

    /// Attaches the mesh to the nodes of a soft body.
    ///
    /// # Errors
    /// Part of the surface lies more than two voxels outside `voxels`.
    pub fn embedded_in(mut self, name: &str, voxels: &VoxelMesh) -> Result<Self, CameraError> {
        for lod in &mut self.lods {
            let attach = |p: &V3| {
                let at: Embedding = voxels.locate(&p.cast())?;
                Some(NodeWeights {
                    nodes: voxels.elements[at.element as usize],
                    weights: at.weights().map(|w| w as f32),
                })
            };
            let embedding: Option<Vec<_>> = lod.positions.iter().map(attach).collect();
            lod.embedding = embedding.ok_or_else(|| CameraError::Mesh {
                name: name.to_owned(),
                reason: "its surface lies outside of its voxel mesh; build both from one shape".to_owned(),
            })?;
        }
        Ok(self)
    }

    /// Number of triangles of the finest level.
    pub fn triangle_count(&self) -> usize {
        self.lods.first().map_or(0, |lod| lod.triangles.len())
    }
}

pub(crate) fn check_mesh(
    name: &str,
    mesh: &Mesh,
    material_ids: &[u16],
    visuals: &[Visual],
) -> Result<(), CameraError> {
    let fail = |reason: String| Err(CameraError::Mesh { name: name.to_owned(), reason });
    if let Err(error) = mesh.validate() {
        return fail(error.to_string());
    }
    let count = mesh.triangles.len();
    if count >= 1 << TRIANGLE_BITS {
        let max = (1 << TRIANGLE_BITS) - 1;
        return fail(format!("{count} triangles; at most {max} can be drawn, simplify it"));
    }
    if material_ids.len() != count {
        let ids = material_ids.len();
        return fail(format!("{ids} material ids for {count} triangles; give one per triangle"));
    }
    match material_ids.iter().find(|&&m| m as usize >= visuals.len()) {
        Some(m) => fail(format!("material {m} has no visual; there are {} (from 0)", visuals.len())),
        None => Ok(()),
    }
}

/// Triangulates a shape with edges about `cell` long, m. Returns the material id of each triangle, too.
fn triangulate(shape: &Shape, cell: f64) -> (Mesh, Vec<u16>) {
    match revolved_profile(shape) {
        Some(profile) => with_material_ids(lathe_mesh(profile, cell), shape),
        None => {
            let surface = SurfaceMesh::from_shape(shape, cell);
            (surface.mesh, surface.materials)
        }
    }
}

/// Evaluates the material of `shape` at the centroid of each triangle.
fn with_material_ids(mesh: Mesh, shape: &Shape) -> (Mesh, Vec<u16>) {
    let material_ids = mesh.triangles.iter().map(|t| shape.material(&centroid(&mesh, t))).collect();
    (mesh, material_ids)
}

fn centroid(mesh: &Mesh, triangle: &[u32; 3]) -> Vec3 {
    triangle.iter().map(|&v| mesh.vertices[v as usize]).sum::<Vec3>() / 3.0
}

/// The profile of a surface of revolution, painted or not.
fn revolved_profile(shape: &Shape) -> Option<&Polygon> {
    match shape {
        Shape::Lathe(profile) => Some(profile),
        Shape::Paint { shape, .. } => revolved_profile(shape),
        _ => None,
    }
}

struct SubdividedMesh {
    mesh: Mesh,
    material_ids: Vec<u16>,
    /// Length of the edges reached, m.
    edge: f64,
}

/// Divides every triangle into four until no edge is longer than `max_edge`, m, or the mesh becomes too large.
fn subdivide(mut mesh: Mesh, mut material_ids: Vec<u16>, max_edge: f64) -> SubdividedMesh {
    loop {
        let length = |a: u32, b: u32| (mesh.vertices[a as usize] - mesh.vertices[b as usize]).norm();
        let is_long = |t: &[u32; 3]| (0..3).any(|i| length(t[i], t[(i + 1) % 3]) > max_edge);
        if !mesh.triangles.iter().any(is_long) {
            return SubdividedMesh { mesh, material_ids, edge: max_edge };
        }
        if 4 * mesh.triangles.len() > MAX_SUBDIVIDED_TRIANGLES {
            let sum = mesh.triangles.iter().map(|t| length(t[0], t[1])).sum::<f64>();
            let edge = sum / mesh.triangles.len() as f64;
            return SubdividedMesh { mesh, material_ids, edge };
        }
        let mut midpoints: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
        for t in &mesh.triangles {
            let [ab, bc, ca] = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| {
                *midpoints.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    mesh.vertices.push(0.5 * (mesh.vertices[a as usize] + mesh.vertices[b as usize]));
                    mesh.vertices.len() as u32 - 1
                })
            });
            triangles.extend([[t[0], ab, ca], [ab, t[1], bc], [ca, bc, t[2]], [ab, bc, ca]]);
        }
        mesh.triangles = triangles;
        material_ids = material_ids.iter().flat_map(|&m| [m; 4]).collect();
    }
}

/// Root mean square distance of the centroids of triangles from the surface of `shape`, m. Centroids deeper than
/// `cell` are ignored: they are hidden by another part of the shape.
fn rms_error(mesh: &Mesh, shape: &Shape, cell: f64) -> f32 {
    let distances = mesh.triangles.iter().map(|t| shape.distance(&centroid(mesh, t)));
    let squares: f64 = distances.filter(|d| d.abs() < cell).map(|d| d * d).sum();
    (squares / mesh.triangles.len().max(1) as f64).sqrt() as f32
}
