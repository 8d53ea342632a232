//! Binary glTF 2.0. Accessors are validated before the readers of the `gltf` crate run, which panic on types that the
//! specification does not allow and reinterpret others.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use gltf::{
    Accessor, Semantic,
    accessor::{DataType, Dimensions},
    buffer::Source,
    mesh::Mode,
    texture,
};

use super::{ImportedColours, ImportedImage, ImportedMaterial, MeshImportError, check_size, plain_id};
use crate::mesh::Mesh;

type Transform = nalgebra::Matrix4<f64>;

/// Largest depth of a scene tree, which bounds the recursion.
const MAX_DEPTH: usize = 64;
/// Largest number of nodes of a scene, each counted once per parent that is visited.
const MAX_NODES: usize = 10_000;
/// Ends of the names of extensions whose vertices are not read, and the way to do without.
const UNREAD: [(&str, &str); 4] = [
    ("_draco_mesh_compression", DECODE),
    ("_meshopt_compression", DECODE),
    ("_mesh_quantization", DECODE),
    ("_mesh_gpu_instancing", "export each instance as a node of its own"),
];
const DECODE: &str = "decode it with the command: npx @gltf-transform/cli dequantize in.glb out.glb";
/// Size of the header of a GLB file and the offset of its declared length, bytes.
const HEADER_BYTES: usize = 12;
const LENGTH_OFFSET: usize = 8;

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, MeshImportError> {
    check_length(bytes)?;
    let unreadable =
        |error: gltf::Error| MeshImportError::Unreadable { format: "GLB", reason: error.to_string() };
    let gltf::Gltf { document, blob } =
        gltf::Gltf::from_slice_without_validation(bytes).map_err(unreadable)?;
    for extension in document.extensions_used().chain(document.extensions_required()) {
        if let Some((_, fix)) = UNREAD.iter().find(|(end, _)| extension.ends_with(end)) {
            return Err(MeshImportError::Extended { extension: extension.to_owned(), fix });
        }
    }
    let file = gltf::Document::from_json(document.into_json()).map_err(unreadable)?;
    let outside = MeshImportError::Unsupported("buffers outside of the file");
    let blob = blob.as_deref().unwrap_or_default();
    let is_inside =
        |buffer: gltf::Buffer| matches!(buffer.source(), Source::Bin) && buffer.length() <= blob.len();
    if !file.buffers().all(is_inside) {
        return Err(outside);
    }
    let mut reader = Reader { blob, mesh: Mesh::default(), has_uvs: false, nodes: 0 };
    let scene = file.default_scene().or_else(|| file.scenes().next());
    for node in scene.iter().flat_map(gltf::Scene::nodes) {
        reader.add_node(&node, &Transform::identity(), 0)?;
    }
    let mut mesh = reader.mesh;
    if !reader.has_uvs {
        mesh.uvs.clear();
    }
    Ok(mesh)
}

/// The materials of a file that [`read`] accepts, and those of its triangles.
pub(super) fn colours(bytes: &[u8]) -> Result<ImportedColours, String> {
    let file = gltf::Gltf::from_slice(bytes).map_err(|error| error.to_string())?;
    let blob = file.blob.as_deref().unwrap_or_default();
    let plain = plain_id(file.materials().len())?;
    let mut surfaces = Surfaces { blob, plain, ..Surfaces::default() };
    let scene = file.default_scene().or_else(|| file.scenes().next());
    scene.iter().flat_map(gltf::Scene::nodes).try_for_each(|node| surfaces.add_node(&node))?;
    if plain == 0 {
        return Ok(ImportedColours::default());
    }
    let Surfaces { material_ids, unplaced, .. } = surfaces;
    let used: BTreeSet<u16> = material_ids.iter().copied().collect();
    let mut images = Images { blob, known: BTreeMap::new() };
    let materials = (0..plain).zip(file.materials()).map(|(id, material)| {
        let read = match (used.contains(&id), unplaced.contains(&id)) {
            (false, _) => Ok(ImportedMaterial::default()),
            (true, true) if material.pbr_metallic_roughness().base_color_texture().is_some() => Err(format!(
                "its image needs texture coordinates, but a mesh of it has no {TEXCOORD}; unwrap the mesh, or remove \
                 the image"
            )),
            _ => material_of(&material, &mut images),
        };
        read.map_err(|error| format!("material {id}: {error}"))
    });
    let mut materials = materials.collect::<Result<Vec<_>, String>>()?;
    materials.push(ImportedMaterial::default());
    Ok(ImportedColours { materials, material_ids })
}

/// Materials of the primitives of a scene.
#[derive(Default)]
struct Surfaces<'a> {
    blob: &'a [u8],
    /// Index of the material of primitives that name none.
    plain: u16,
    /// The material of each triangle, in the order of [`Reader::add_node`].
    material_ids: Vec<u16>,
    /// Materials of primitives without texture coordinates.
    unplaced: BTreeSet<u16>,
}

impl Surfaces<'_> {
    fn add_node(&mut self, node: &gltf::Node) -> Result<(), String> {
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            let positions = || primitive.get(&Semantic::Positions);
            let corners = primitive.indices().or_else(positions).map_or(0, |accessor| accessor.count());
            let id = primitive.material().index().map_or(self.plain, |index| index as u16);
            self.material_ids.extend(std::iter::repeat_n(id, corners / 3));
            if primitive.get(&Semantic::TexCoords(0)).is_none() {
                self.unplaced.insert(id);
            }
            if !self.is_white(&primitive) {
                return Err("it has colours of vertices (COLOR_0), which are not drawn; store them in materials or in \
                            an image, or remove them"
                    .to_owned());
            }
        }
        node.children().try_for_each(|child| self.add_node(&child))
    }

    /// True if the colours of the vertices, which multiply those of the material, change nothing.
    fn is_white(&self, primitive: &gltf::Primitive) -> bool {
        let Some(accessor) = primitive.get(&Semantic::Colors(0)) else { return true };
        // The reader of the crate panics on other types.
        if !is_colour(&accessor) || check_layout(0, "COLOR_0", &accessor).is_err() {
            return false;
        }
        let colours = primitive.reader(|_| Some(self.blob)).read_colors(0);
        colours.is_some_and(|colours| colours.into_rgb_f32().all(|rgb| rgb == [1.0; 3]))
    }
}

fn material_of(material: &gltf::Material, images: &mut Images) -> Result<ImportedMaterial, String> {
    let surface = material.pbr_metallic_roughness();
    let factors = surface.base_color_factor();
    let has_base_colour = factors != [1.0; 4] || surface.base_color_texture().is_some();
    if material.pbr_specular_glossiness().is_some() && !has_base_colour {
        return Err("its colour is that of KHR_materials_pbrSpecularGlossiness, which is not supported; export a base \
                    colour (pbrMetallicRoughness)"
            .to_owned());
    }
    let [r, g, b, _] = factors.map(|x| f64::from(x).clamp(0.0, 1.0));
    // With a texture the factors multiply its values, which are not read; both are 1 by default.
    let is_textured = surface.metallic_roughness_texture().is_some();
    let factor = |x: f32| (!is_textured).then_some(f64::from(x).clamp(0.0, 1.0));
    Ok(ImportedMaterial {
        albedo: [r, g, b],
        roughness: factor(surface.roughness_factor()),
        metalness: factor(surface.metallic_factor()),
        image: surface.base_color_texture().map(|info| images.of(&info)).transpose()?,
    })
}

/// The images of a file, each copied once.
struct Images<'a> {
    blob: &'a [u8],
    /// Images copied before, by index.
    known: BTreeMap<usize, ImportedImage>,
}

impl Images<'_> {
    /// The image of a base colour.
    fn of(&mut self, info: &texture::Info) -> Result<ImportedImage, String> {
        let transform = info.texture_transform();
        let set = transform.as_ref().and_then(|t| t.tex_coord()).unwrap_or(info.tex_coord());
        if set != 0 {
            return Err(format!(
                "its image has the texture coordinates TEXCOORD_{set}, but only {TEXCOORD} is read; export one set of \
                 coordinates"
            ));
        }
        let is_identity = |t: &texture::TextureTransform| {
            (t.offset(), t.rotation(), t.scale()) == ([0.0; 2], 0.0, [1.0; 2])
        };
        if transform.is_some_and(|t| !is_identity(&t)) {
            return Err("its image is placed by KHR_texture_transform, which is not supported; apply the transform to \
                        the texture coordinates"
                .to_owned());
        }
        let image = info.texture().source();
        if let Some(known) = self.known.get(&image.index()) {
            return Ok(known.clone());
        }
        let read = match image.source() {
            gltf::image::Source::Uri { uri, .. } => ImportedImage::File(decoded_path(uri)?),
            gltf::image::Source::View { view, .. } => {
                let end = view.offset().saturating_add(view.length());
                let bytes = self.blob.get(view.offset()..end);
                let bytes = bytes.ok_or("its image lies outside of the file; export the mesh again")?;
                ImportedImage::Bytes(Arc::from(bytes))
            }
        };
        self.known.insert(image.index(), read.clone());
        Ok(read)
    }
}

/// The path that a relative URI names.
fn decoded_path(uri: &str) -> Result<String, String> {
    if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        return Err(
            "its image is a data URI, which is not supported; store it in the .glb file or beside it"
                .to_owned(),
        );
    }
    let path = urlencoding::decode(uri);
    Ok(path.map_err(|_| "the name of its image is not UTF-8 text; rename the image")?.into_owned())
}

/// Compares the length in the header with that of the file. Without a header of glTF the crate says what is wrong.
fn check_length(bytes: &[u8]) -> Result<(), MeshImportError> {
    let Some(header) = bytes.get(..HEADER_BYTES).filter(|header| header.starts_with(b"glTF")) else {
        return Err(MeshImportError::Unreadable { format: "GLB", reason: "it has no glTF header".into() });
    };
    let declared =
        header[LENGTH_OFFSET..].iter().rev().fold(0, |length, &byte| length << 8 | usize::from(byte));
    let actual = bytes.len();
    if declared == actual { Ok(()) } else { Err(MeshImportError::Length { declared, actual }) }
}

/// The mesh of the nodes so far.
struct Reader<'a> {
    blob: &'a [u8],
    mesh: Mesh,
    /// True if a primitive has texture coordinates; those of others are 0.
    has_uvs: bool,
    nodes: usize,
}

impl Reader<'_> {
    fn add_node(
        &mut self,
        node: &gltf::Node,
        parent: &Transform,
        depth: usize,
    ) -> Result<(), MeshImportError> {
        if depth > MAX_DEPTH {
            return Err(MeshImportError::Unsupported("a scene tree more than 64 deep"));
        }
        self.nodes += 1;
        if self.nodes > MAX_NODES {
            return Err(MeshImportError::TooLarge { what: "nodes", limit: MAX_NODES });
        }
        let columns = node.transform().matrix();
        let pose = parent * Transform::from_fn(|row, column| f64::from(columns[column][row]));
        if let Some(mesh) = node.mesh() {
            let is_morphed = mesh.primitives().any(|primitive| primitive.morph_targets().next().is_some());
            let weights = node.weights().or(mesh.weights()).unwrap_or_default();
            if let Some(&weight) = weights.iter().find(|weight| is_morphed && **weight != 0.0) {
                return Err(MeshImportError::Morphed { mesh: mesh.index(), weight });
            }
            let mut primitives = mesh.primitives();
            primitives.try_for_each(|primitive| self.add_primitive(&primitive, mesh.index(), &pose))?;
        }
        node.children().try_for_each(|child| self.add_node(&child, &pose, depth + 1))
    }

    fn add_primitive(
        &mut self,
        primitive: &gltf::Primitive,
        mesh: usize,
        pose: &Transform,
    ) -> Result<(), MeshImportError> {
        if primitive.mode() != Mode::Triangles {
            return Err(MeshImportError::Unsupported("points, lines or triangle strips"));
        }
        let attributes = Attributes::check(primitive, mesh)?;
        let corners = attributes.indices.unwrap_or(attributes.positions);
        let (vertices, triangles) = (self.mesh.vertices.len(), self.mesh.triangles.len());
        check_size(vertices.saturating_add(attributes.positions), triangles.saturating_add(corners / 3))?;
        let outside =
            |attribute| accessor_error(mesh, attribute, "lies outside of its buffer", "data in the file");
        let blob = self.blob;
        let reader = primitive.reader(|_| Some(blob));
        let positions = reader.read_positions().ok_or_else(|| outside(POSITION))?;
        let place = |p: [f32; 3]| pose.transform_point(&nalgebra::Point3::from(p.map(f64::from))).coords;
        self.mesh.vertices.extend(positions.map(place));
        let indices: Vec<u32> = match attributes.indices {
            Some(_) => reader.read_indices().ok_or_else(|| outside(INDICES))?.into_u32().collect(),
            None => (0..attributes.positions as u32).collect(),
        };
        if let Some(index) = indices.iter().find(|index| **index as usize >= attributes.positions) {
            let found = format!("names vertex {index} of {}", attributes.positions);
            return Err(accessor_error(mesh, INDICES, &found, "indices below the number of vertices"));
        }
        let uvs: Vec<[f64; 2]> = match attributes.uvs {
            true => {
                let uvs = reader.read_tex_coords(0).ok_or_else(|| outside(TEXCOORD))?;
                self.has_uvs = true;
                // glTF counts from the top of the image.
                uvs.into_f32().map(|[u, v]| [f64::from(u), 1.0 - f64::from(v)]).collect()
            }
            false => Vec::new(),
        };
        // A mirroring transform reverses the orientation of triangles.
        let mirrored = pose.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for t in indices.chunks_exact(3) {
            let t = if mirrored { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] };
            self.mesh.triangles.push(t.map(|v| v + vertices as u32));
            self.mesh.uvs.push(t.map(|v| uvs.get(v as usize).copied().unwrap_or_default()));
        }
        Ok(())
    }
}

const POSITION: &str = "POSITION";
const INDICES: &str = "indices";
const TEXCOORD: &str = "TEXCOORD_0";

/// Number of elements of the accessors of a primitive, whose types have been checked.
struct Attributes {
    positions: usize,
    indices: Option<usize>,
    /// True if the primitive has texture coordinates.
    uvs: bool,
}

impl Attributes {
    fn check(primitive: &gltf::Primitive, mesh: usize) -> Result<Self, MeshImportError> {
        let positions = primitive.get(&Semantic::Positions).ok_or_else(|| {
            accessor_error(mesh, POSITION, "is missing", "positions of type VEC3 of 32-bit floats")
        })?;
        let check = |attribute, accessor: &Accessor, allowed: fn(&Accessor) -> bool, required| {
            if !allowed(accessor) {
                let found = format!("is {}", type_name(accessor));
                return Err(accessor_error(mesh, attribute, &found, required));
            }
            check_layout(mesh, attribute, accessor)
        };
        check(POSITION, &positions, is_position, "VEC3 of 32-bit floats")?;
        let indices = primitive.indices();
        if let Some(indices) = &indices {
            check(INDICES, indices, is_index, "SCALAR of unsigned integers")?;
        }
        let uvs = primitive.get(&Semantic::TexCoords(0));
        if let Some(uvs) = &uvs {
            check(TEXCOORD, uvs, is_texture_coordinate, "VEC2 of floats or unsigned integers")?;
        }
        let corners = indices.as_ref().unwrap_or(&positions).count();
        if !corners.is_multiple_of(3) {
            let attribute = if indices.is_some() { INDICES } else { POSITION };
            let found = format!("has {corners} elements");
            return Err(accessor_error(mesh, attribute, &found, "three per triangle"));
        }
        Ok(Self {
            positions: positions.count(),
            indices: indices.map(|indices| indices.count()),
            uvs: uvs.is_some(),
        })
    }
}

fn is_position(accessor: &Accessor) -> bool {
    (accessor.dimensions(), accessor.data_type()) == (Dimensions::Vec3, DataType::F32)
}

fn is_index(accessor: &Accessor) -> bool {
    accessor.dimensions() == Dimensions::Scalar
        && matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32)
}

fn is_texture_coordinate(accessor: &Accessor) -> bool {
    accessor.dimensions() == Dimensions::Vec2
        && matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::F32)
}

fn is_colour(accessor: &Accessor) -> bool {
    matches!(accessor.dimensions(), Dimensions::Vec3 | Dimensions::Vec4)
        && matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::F32)
}

/// Refuses what the reader of the crate computes with unchecked arithmetic: no elements, elements that overlap, and
/// offsets beyond the file.
fn check_layout(mesh: usize, attribute: &'static str, accessor: &Accessor) -> Result<(), MeshImportError> {
    if accessor.sparse().is_some() {
        return Err(MeshImportError::Unsupported("sparse accessors"));
    }
    let error = |found: &str, required| Err(accessor_error(mesh, attribute, found, required));
    let (Some(view), 1..) = (accessor.view(), accessor.count()) else {
        return error("has no data", "at least one element in the file");
    };
    let stride = view.stride().unwrap_or(accessor.size());
    if stride < accessor.size() {
        return error("has elements that overlap", "a byteStride of at least one element");
    }
    let end = stride
        .checked_mul(accessor.count() - 1)
        .and_then(|start| start.checked_add(accessor.offset())?.checked_add(accessor.size()));
    let view_end = view.offset().checked_add(view.length());
    match (end, view_end) {
        (Some(end), Some(view_end)) if end <= view.length() && view_end <= view.buffer().length() => Ok(()),
        _ => error("lies outside of its buffer", "data in the file"),
    }
}

/// Type of an accessor in the words of the specification.
fn type_name(accessor: &Accessor) -> String {
    let component = match accessor.data_type() {
        DataType::I8 => "signed bytes",
        DataType::U8 => "unsigned bytes",
        DataType::I16 => "signed 16-bit integers",
        DataType::U16 => "unsigned 16-bit integers",
        DataType::U32 => "unsigned 32-bit integers",
        DataType::F32 => "32-bit floats",
    };
    let dimensions = match accessor.dimensions() {
        Dimensions::Scalar => "SCALAR",
        Dimensions::Vec2 => "VEC2",
        Dimensions::Vec3 => "VEC3",
        Dimensions::Vec4 => "VEC4",
        Dimensions::Mat2 => "MAT2",
        Dimensions::Mat3 => "MAT3",
        Dimensions::Mat4 => "MAT4",
    };
    format!("{dimensions} of {component}")
}

fn accessor_error(
    mesh: usize,
    attribute: &'static str,
    found: &str,
    required: &'static str,
) -> MeshImportError {
    MeshImportError::Accessor { mesh, attribute, found: found.to_owned(), required }
}
