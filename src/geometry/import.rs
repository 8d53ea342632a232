//! Reading a user's own object: OBJ, STL and binary or self-contained glTF.

use std::io::Cursor;

use super::{
    Mat3, Vec3,
    mesh::{Mesh, MeshError},
};

/// How to read a mesh file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImportOptions {
    /// Metres in a unit of the file (1e-3 for a file in millimetres).
    pub scale: f64,
    /// Whether z is up in the file; otherwise y is, and the mesh is turned upright.
    pub z_up: bool,
}

/// File formats, by the usual extensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// STL, binary or ASCII.
    Stl,
    /// glTF 2.0, binary (GLB).
    Gltf,
}

/// Why a file is no mesh. The caller names the file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// The extension is not known.
    #[error("\"{0}\" is no known mesh format; give an .obj, .stl or .glb file")]
    Extension(String),
    /// The bytes do not parse.
    #[error("cannot be read as {format}: {reason}")]
    Unreadable {
        /// The format that was tried.
        format: &'static str,
        /// What the reader says.
        reason: String,
    },
    /// The scale is not positive.
    #[error("scale is {0}; give the metres in a unit of the file, above 0")]
    Scale(f64),
    /// A node of a glTF scene holds something that is not read.
    #[error("uses {0}; export plain triangles into one .glb file")]
    Unsupported(&'static str),
    /// What was read is no solid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

impl MeshFormat {
    /// The format that a file name's extension stands for.
    ///
    /// # Errors
    /// If it is none of `obj`, `stl`, `glb`.
    pub fn from_extension(extension: &str) -> Result<Self, ImportError> {
        match extension.to_ascii_lowercase().as_str() {
            "obj" => Ok(Self::Obj),
            "stl" => Ok(Self::Stl),
            "glb" => Ok(Self::Gltf),
            other => Err(ImportError::Extension(other.to_owned())),
        }
    }
}

/// Reads a mesh; all objects of the file become one. [`Mesh::into_shape`] makes a solid of it.
///
/// # Errors
/// If the bytes do not parse, or the mesh is empty, has coordinates that are not finite or indices that are wrong.
pub fn import(bytes: &[u8], format: MeshFormat, options: &ImportOptions) -> Result<Mesh, ImportError> {
    if !(options.scale > 0.0 && options.scale.is_finite()) {
        return Err(ImportError::Scale(options.scale));
    }
    let mut mesh = match format {
        MeshFormat::Obj => read_obj(bytes)?,
        MeshFormat::Stl => read_stl(bytes)?,
        MeshFormat::Gltf => read_gltf(bytes)?,
    };
    // Turning y up into z up is a quarter turn about x.
    let upright =
        if options.z_up { Mat3::identity() } else { Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0) };
    mesh.vertices.iter_mut().for_each(|v| *v = upright * *v * options.scale);
    mesh.validate()?;
    Ok(mesh)
}

fn read_obj(bytes: &[u8]) -> Result<Mesh, ImportError> {
    let unreadable = |reason: String| ImportError::Unreadable { format: "OBJ", reason };
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    // Materials are not ours to read: appearances are given in the recipe.
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials)
        .map_err(|error| unreadable(error.to_string()))?;
    let mut out = Mesh::default();
    let textured = models.iter().all(|model| !model.mesh.texcoords.is_empty());
    for tobj::Model { mesh, .. } in &models {
        let base = out.vertices.len() as u32;
        let place = |p: &[f32]| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
        out.vertices.extend(mesh.positions.chunks_exact(3).map(place));
        for t in mesh.indices.chunks_exact(3) {
            out.triangles.push([t[0] + base, t[1] + base, t[2] + base]);
            if textured {
                let uv = |v: u32| {
                    let at = 2 * v as usize;
                    [f64::from(mesh.texcoords[at]), f64::from(mesh.texcoords[at + 1])]
                };
                out.uvs.push([uv(t[0]), uv(t[1]), uv(t[2])]);
            }
        }
    }
    Ok(out)
}

fn read_stl(bytes: &[u8]) -> Result<Mesh, ImportError> {
    let read = stl_io::read_stl(&mut Cursor::new(bytes))
        .map_err(|error| ImportError::Unreadable { format: "STL", reason: error.to_string() })?;
    let place = |v: &stl_io::Vertex| Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]));
    Ok(Mesh {
        vertices: read.vertices.iter().map(place).collect(),
        triangles: read.faces.iter().map(|face| face.vertices.map(|v| v as u32)).collect(),
        uvs: Vec::new(),
    })
}

fn read_gltf(bytes: &[u8]) -> Result<Mesh, ImportError> {
    let file = gltf::Gltf::from_slice(bytes)
        .map_err(|error| ImportError::Unreadable { format: "GLB", reason: error.to_string() })?;
    let blob = file.blob.as_deref().ok_or(ImportError::Unsupported("buffers outside of the file"))?;
    let mut out = Mesh::default();
    let scene = file.default_scene().or_else(|| file.scenes().next());
    let identity = nalgebra::Matrix4::identity();
    for node in scene.iter().flat_map(gltf::Scene::nodes) {
        read_node(&node, &identity, blob, &mut out, 0)?;
    }
    if out.uvs.len() != out.triangles.len() {
        out.uvs.clear();
    }
    Ok(out)
}

/// Deeper scene trees are refused.
const DEEPEST: usize = 64;

fn read_node(
    node: &gltf::Node,
    parent: &nalgebra::Matrix4<f64>,
    blob: &[u8],
    out: &mut Mesh,
    depth: usize,
) -> Result<(), ImportError> {
    if depth > DEEPEST {
        return Err(ImportError::Unsupported("a scene tree more than 64 deep"));
    }
    let columns = node.transform().matrix();
    let pose = parent * nalgebra::Matrix4::from_fn(|row, column| f64::from(columns[column][row]));
    for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
        read_primitive(&primitive, &pose, blob, out)?;
    }
    node.children().try_for_each(|child| read_node(&child, &pose, blob, out, depth + 1))
}

fn read_primitive(
    primitive: &gltf::Primitive,
    pose: &nalgebra::Matrix4<f64>,
    blob: &[u8],
    out: &mut Mesh,
) -> Result<(), ImportError> {
    if primitive.mode() != gltf::mesh::Mode::Triangles {
        return Err(ImportError::Unsupported("points, lines or triangle strips"));
    }
    let reader = primitive.reader(|buffer| (buffer.index() == 0).then_some(blob));
    let positions =
        reader.read_positions().ok_or(ImportError::Unsupported("positions outside of the file"))?;
    let base = out.vertices.len() as u32;
    let place = |p: [f32; 3]| pose.transform_point(&nalgebra::Point3::from(p.map(f64::from))).coords;
    out.vertices.extend(positions.map(place));
    let added = out.vertices.len() as u32 - base;
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..added).collect(),
    };
    let uvs: Vec<[f64; 2]> = reader
        .read_tex_coords(0)
        .map_or_else(Vec::new, |uvs| uvs.into_f32().map(|uv| uv.map(f64::from)).collect());
    // A mirrored node turns its triangles inside out.
    let mirrored = pose.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
    for t in indices.chunks_exact(3) {
        let t = if mirrored { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] };
        out.triangles.push(t.map(|v| v.saturating_add(base)));
        if let [Some(a), Some(b), Some(c)] = t.map(|v| uvs.get(v as usize)) {
            out.uvs.push([*a, *b, *c]);
        }
    }
    Ok(())
}
