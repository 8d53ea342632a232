//! Import of triangle meshes from OBJ, STL and binary glTF (GLB) files.

mod glb;
mod obj;
mod polygon;
mod stl;
mod text;

use std::sync::Arc;

use super::{
    Mat3,
    mesh::{Mesh, MeshError},
};

/// Unit and orientation of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshImportOptions {
    /// Length of the unit of the file, m (1e-3 for a file in millimetres); positive.
    pub scale: f64,
    /// True if z is up in the file, and false if y is, so that the mesh is rotated. `None`: y for glTF, which says so,
    /// and z for other formats.
    pub z_up: Option<bool>,
}

/// Formats of mesh files that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ, `.obj`.
    Obj,
    /// Binary or ASCII STL, `.stl`.
    Stl,
    /// Binary glTF 2.0, `.glb`.
    Gltf,
}

/// Failure to import a mesh. The caller adds the name of the file.
#[allow(missing_docs, reason = "the messages describe the variants")]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshImportError {
    #[error("\"{0}\" is not a supported mesh format; give an .obj, .stl or .glb file")]
    Extension(String),
    #[error("cannot be read as {format}: {reason}")]
    Unreadable { format: &'static str, reason: String },
    #[error("scale is {0}; give the length of the unit of the file in metres, above 0")]
    Scale(f64),
    #[error("uses {0}; export plain triangles into one .glb file")]
    Unsupported(&'static str),
    #[error("uses {extension}; {fix}")]
    Extended { extension: String, fix: &'static str },
    #[error(
        "mesh {mesh} has a morph target of weight {weight}, which is not applied; apply the shape keys, and export it again"
    )]
    Morphed { mesh: usize, weight: f32 },
    #[error("the header declares {declared} bytes, but the file has {actual}; export it again")]
    Length { declared: usize, actual: usize },
    #[error("mesh {mesh}: accessor {attribute} {found}; glTF requires {required}; export the mesh again")]
    Accessor { mesh: usize, attribute: &'static str, found: String, required: &'static str },
    #[error("has more than {limit} {what}; simplify the mesh")]
    TooLarge { what: &'static str, limit: usize },
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

impl MeshFormat {
    /// Returns the format of a file name extension, in upper or lower case.
    ///
    /// # Errors
    /// If the extension is not `obj`, `stl` or `glb`.
    pub fn from_extension(extension: &str) -> Result<Self, MeshImportError> {
        match extension.to_ascii_lowercase().as_str() {
            "obj" => Ok(Self::Obj),
            "stl" => Ok(Self::Stl),
            "glb" => Ok(Self::Gltf),
            "gltf" => Err(MeshImportError::Extended {
                extension: "files beside it (.gltf)".to_owned(),
                fix: "pack it with the command: npx @gltf-transform/cli copy in.gltf out.glb",
            }),
            other => Err(MeshImportError::Extension(other.to_owned())),
        }
    }
}

/// Largest number of triangles of a mesh; those of a glTF mesh count once per node that contains it.
pub const MAX_TRIANGLES: usize = 2_000_000;
/// Largest number of vertices of a mesh.
pub const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;

/// The colours that a mesh file states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportedColours {
    /// The materials; empty if the file has none.
    pub materials: Vec<ImportedMaterial>,
    /// Index of the material of each triangle.
    pub material_ids: Vec<u16>,
}

/// A material of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedMaterial {
    /// Colour, linear RGB, 0..=1, by which that of the image is multiplied.
    pub albedo: [f64; 3],
    /// Roughness, 0..=1, if the file states it.
    pub roughness: Option<f64>,
    /// Metalness, 0..=1, if the file states it.
    pub metalness: Option<f64>,
    /// Image of the colour, PNG or JPEG.
    pub image: Option<ImportedImage>,
}

impl Default for ImportedMaterial {
    fn default() -> Self {
        Self { albedo: [0.7; 3], roughness: None, metalness: None, image: None }
    }
}

/// Source of an image of a material.
#[derive(Clone, Debug, PartialEq)]
pub enum ImportedImage {
    /// A file, by its path from the folder of the mesh file.
    File(String),
    /// Its bytes, which materials of the same image share.
    Bytes(Arc<[u8]>),
}

/// Reads the colours of a mesh file. `read_file` returns a file by its path from the folder of the mesh file.
///
/// The materials of OBJ files are those of their MTL files: the colour `Kd`, or the image `map_Kd` in its place. Those
/// of glTF files have their base colours, multiplied by the image that they name; those that no triangle has are left
/// plain. STL files have none.
///
/// # Errors
/// A file that the mesh file names cannot be read, a material is unknown or states what is not supported, an
/// image has no texture coordinates, vertices have colours, or there are too many materials; the message names
/// the file or the material.
pub fn import_colours(
    bytes: &[u8],
    format: MeshFormat,
    read_file: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<ImportedColours, String> {
    match format {
        MeshFormat::Obj => obj::colours(bytes, read_file),
        MeshFormat::Stl => Ok(ImportedColours::default()),
        MeshFormat::Gltf => glb::colours(bytes),
    }
}

/// Reads a mesh from the bytes of a file, in metres with z up. All objects of the file are merged into one mesh; of a
/// glTF file those of its default scene, or else of its first.
///
/// Lines, points and curves of OBJ files are ignored. Text is UTF-8, UTF-16 with a byte order mark, or else Latin-1.
/// A binary STL file whose count of triangles is too small is read to its end.
///
/// [`import_colours`] reads its materials. [`Shape::from_mesh`](super::shape::Shape::from_mesh) turns a closed
/// mesh into a solid.
///
/// # Errors
/// If the bytes do not parse, the mesh is empty or larger than the limits, or a coordinate or an index is invalid.
pub fn import(
    bytes: &[u8],
    format: MeshFormat,
    options: &MeshImportOptions,
) -> Result<Mesh, MeshImportError> {
    if !(options.scale > 0.0 && options.scale.is_finite()) {
        return Err(MeshImportError::Scale(options.scale));
    }
    let mut mesh = match format {
        MeshFormat::Obj => obj::read(bytes)?,
        MeshFormat::Stl => stl::read(bytes)?,
        MeshFormat::Gltf => glb::read(bytes)?,
    };
    check_size(mesh.vertices.len(), mesh.triangles.len())?;
    let is_z_up = options.z_up.unwrap_or(format != MeshFormat::Gltf);
    // From y up to z up: a quarter turn about x.
    let upright =
        if is_z_up { Mat3::identity() } else { Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0) };
    mesh.vertices.iter_mut().for_each(|v| *v = upright * *v * options.scale);
    mesh.validate()?;
    Ok(mesh)
}

fn check_size(vertices: usize, triangles: usize) -> Result<(), MeshImportError> {
    let check = |what, count, limit| {
        if count > limit { Err(MeshImportError::TooLarge { what, limit }) } else { Ok(()) }
    };
    check("triangles", triangles, MAX_TRIANGLES)?;
    check("vertices", vertices, MAX_VERTICES)
}

/// The name of a file or material for a message.
fn shortened(name: &str) -> String {
    const MOST: usize = 80;
    let cut = if name.chars().nth(MOST).is_some() { "…" } else { "" };
    name.chars().take(MOST).chain(cut.chars()).collect()
}

/// Index of the plain material after the `count` materials of a file.
fn plain_id(count: usize) -> Result<u16, String> {
    let most = u16::MAX;
    u16::try_from(count).map_err(|_| format!("has {count} materials; at most {most} are drawn, merge some"))
}
