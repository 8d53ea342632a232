use super::rng;
use rand::Rng;

use crate::{
    Vec3,
    import::{
        ImportedColours, ImportedImage, ImportedMaterial, MeshFormat, MeshImportError, MeshImportOptions,
        import, import_colours,
    },
    mesh::Mesh,
    shape::Shape,
    surface_mesh::SurfaceMesh,
};

pub(super) const METRES: MeshImportOptions = MeshImportOptions { scale: 1.0, z_up: Some(true) };

/// A unit cube from the origin, with outward-oriented quads.
pub(super) const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

pub(super) fn read_obj(text: &str) -> Result<Mesh, MeshImportError> {
    import(text.as_bytes(), MeshFormat::Obj, &METRES)
}

/// The bytes of a binary STL file.
pub(super) fn stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in &mesh.triangles {
        bytes.extend([0; 12]);
        for x in t.iter().flat_map(|&v| mesh.vertices[v as usize].iter().copied().collect::<Vec<f64>>()) {
            bytes.extend((x as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// A binary glTF file, whose JSON a test may change.
pub(super) struct Glb {
    pub(super) json: String,
    pub(super) blob: Vec<u8>,
}

impl Glb {
    /// One node, translated by (1, 0, 0).
    pub(super) fn new(mesh: &Mesh) -> Self {
        let mut blob = Vec::new();
        mesh.vertices.iter().flat_map(|v| v.iter()).for_each(|x| blob.extend((*x as f32).to_le_bytes()));
        let start = blob.len();
        mesh.triangles.iter().flatten().for_each(|v| blob.extend(v.to_le_bytes()));
        let (count, corners) = (mesh.vertices.len(), 3 * mesh.triangles.len());
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
            "nodes":[{{"mesh":0,"translation":[1,0,0]}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "buffers":[{{"byteLength":{total}}}],
            "bufferViews":[{{"buffer":0,"byteLength":{start}}},{{"buffer":0,"byteOffset":{start},"byteLength":{rest}}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
            {{"bufferView":1,"componentType":5125,"count":{corners},"type":"SCALAR"}}]}}"#,
            total = blob.len(),
            rest = blob.len() - start,
        );
        Self { json, blob }
    }

    /// The file with further bytes in a view of their own (2), which an accessor (2) of `accessor` may read.
    fn with_view(mut self, bytes: &[u8], accessor: &str) -> Self {
        let start = self.blob.len();
        self.blob.extend(bytes);
        let length = bytes.len();
        self.json = self
            .json
            .replace(&format!("\"byteLength\":{start}}}]"), &format!("\"byteLength\":{}}}]", self.blob.len()))
            .replace(
                "}],\n            \"accessors\"",
                &format!("}},{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{length}}}],\"accessors\""),
            )
            .replace("\"SCALAR\"}]", &format!("\"SCALAR\"}},{{{accessor}}}]"));
        self
    }

    /// The bytes of the file.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let Self { json, blob } = self;
        let padding = (4 - json.len() % 4) % 4;
        let json_length = json.len() + padding;
        let mut bytes = b"glTF".to_vec();
        let total = 12 + 8 + json_length + 8 + blob.len();
        for word in [2, total as u32, json_length as u32] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(b"JSON");
        bytes.extend(json.as_bytes());
        bytes.extend(std::iter::repeat_n(b' ', padding));
        bytes.extend((blob.len() as u32).to_le_bytes());
        bytes.extend(b"BIN\0");
        bytes.extend(blob);
        bytes
    }

    /// The message that refuses the file after one change of its JSON.
    pub(super) fn refusal(&self, from: &str, to: &str) -> String {
        assert!(self.json.contains(from), "{from}");
        let changed = Self { json: self.json.replacen(from, to, 1), blob: self.blob.clone() };
        import(&changed.bytes(), MeshFormat::Gltf, &METRES).expect_err(to).to_string()
    }
}

fn glb(mesh: &Mesh) -> Vec<u8> {
    Glb::new(mesh).bytes()
}

#[test]
fn every_format_reads_the_same_cube() {
    let cube = read_obj(CUBE).expect("a cube");
    let from_stl = import(&stl(&cube), MeshFormat::Stl, &METRES).expect("a cube");
    let from_glb = import(&glb(&cube), MeshFormat::Gltf, &METRES).expect("a cube");
    for (name, mesh, centre) in [("obj", cube, 0.5), ("stl", from_stl, 0.5), ("glb", from_glb, 1.5)] {
        assert!((mesh.volume() - 1.0).abs() < 1e-12, "{name}");
        let shape = Shape::from_mesh(mesh).expect("a solid");
        let bounds = shape.bounds();
        assert_eq!((bounds.size(), bounds.centre().x), (Vec3::repeat(1.0), centre), "{name}");
        assert!((shape.distance(&bounds.centre()) + 0.5).abs() < 1e-12, "{name}");
        let (outside, normal) = shape.distance_and_normal(&(bounds.centre() + Vec3::new(0.0, 0.0, 0.7)));
        assert!((outside - 0.2).abs() < 1e-12 && (normal - Vec3::z()).norm() < 1e-9, "{name}");
    }
}

#[test]
fn files_of_another_length_or_format_are_refused() {
    let cube = read_obj(CUBE).expect("a cube");
    let stl = stl(&cube);
    for bytes in [&stl[..stl.len() - 1], &[&stl[..], &[0; 51]].concat()] {
        let refused = import(bytes, MeshFormat::Stl, &METRES);
        assert_eq!(refused, Err(MeshImportError::Length { declared: stl.len(), actual: bytes.len() }));
    }
    let glb = glb(&cube);
    let longer = import(&[&glb[..], &[0; 4]].concat(), MeshFormat::Gltf, &METRES);
    assert_eq!(longer, Err(MeshImportError::Length { declared: glb.len(), actual: glb.len() + 4 }));
    assert!(import(&glb[..200], MeshFormat::Gltf, &METRES).is_err());
    for format in [MeshFormat::Stl, MeshFormat::Gltf] {
        assert!(matches!(import(b"not a mesh", format, &METRES), Err(MeshImportError::Unreadable { .. })));
    }
    assert_eq!(MeshFormat::from_extension("FBX"), Err(MeshImportError::Extension("fbx".into())));
    let text = MeshFormat::from_extension("gltf").expect_err("text").to_string();
    assert!(text.ends_with("npx @gltf-transform/cli copy in.gltf out.glb"), "{text}");
    let mirrored = MeshImportOptions { scale: -1.0, z_up: None };
    assert_eq!(import(CUBE.as_bytes(), MeshFormat::Obj, &mirrored), Err(MeshImportError::Scale(-1.0)));
}

#[test]
fn a_mesh_that_is_inside_out_is_inverted() {
    let mut cube = read_obj(CUBE).expect("a cube");
    cube.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(cube.volume() < 0.0);
    let shape = Shape::from_mesh(cube).expect("a solid");
    assert!((shape.distance(&Vec3::repeat(0.5)) + 0.5).abs() < 1e-12);
}

#[test]
fn distances_to_an_imported_mesh_match_its_source_shape() {
    let shape = Shape::Torus { major: 0.025, minor: 0.01 };
    let mesh =
        import(&stl(&SurfaceMesh::from_shape(&shape, 1e-3).mesh), MeshFormat::Stl, &METRES).expect("a mesh");
    let imported = Shape::from_mesh(mesh).expect("a solid");
    let mut rng = rng();
    for _ in 0..500 {
        let p = Vec3::from_fn(|_, _| rng.random_range(-0.04..0.04));
        let (a, b) = (shape.distance_and_normal(&p).0, imported.distance_and_normal(&p).0);
        // The sagitta of 1 mm chords on a radius of 10 mm is 12 µm.
        assert!((a - b).abs() < 2e-5, "{a} {b} at {p:?}");
    }
    assert!(matches!(imported, Shape::Mesh(_)));
}

#[test]
fn a_small_glb_that_expands_without_bound_is_refused_by_its_limit() {
    let cube = read_obj(CUBE).expect("a cube");
    // Each node is twice a child of the one before: 2^40 visits.
    let doubled: Vec<String> = (1..40).map(|next| format!(r#"{{"children":[{next},{next}]}}"#)).collect();
    let nodes = format!("{},{{\"mesh\":0}}", doubled.join(","));
    let message = Glb::new(&cube).refusal(r#"{"mesh":0,"translation":[1,0,0]}"#, &nodes);
    assert_eq!(message, "has more than 10000 nodes; simplify the mesh");
    // 9000 nodes with a mesh of 300 triangles.
    let triangles = cube.triangles.iter().copied().cycle().take(300).collect();
    let children: Vec<String> = (1..=9000).map(|child| child.to_string()).collect();
    let nodes =
        format!(r#"{{"children":[{}]}},{}"#, children.join(","), vec![r#"{"mesh":0}"#; 9000].join(","));
    let repeated = Glb::new(&Mesh { triangles, ..cube });
    let message = repeated.refusal(r#"{"mesh":0,"translation":[1,0,0]}"#, &nodes);
    assert_eq!(message, "has more than 2000000 triangles; simplify the mesh");
}

#[test]
fn texture_coordinates_are_those_of_their_corners_where_others_have_none() {
    let corners = "vt 0.5 0.25\nvt 1 0\nvt 1 1\nvt 0 1\n";
    for faces in ["f 4/1 3/2 2/3 1/4", "f 4/-4 3/-3 2/-2 1/-1", "vn 0 0 1\nf 4/1/1 3/2/1 2/3/1 1/4/1"] {
        let last = format!("{}{corners}{faces}\n", CUBE.replace("f 4 3 2 1\n", ""));
        let mesh = read_obj(&last).expect("a cube");
        assert_eq!(mesh.uvs[0], [[0.0; 2]; 3], "{faces}");
        assert_eq!(mesh.uvs[10], [[0.5, 0.25], [1.0, 0.0], [1.0, 1.0]], "{faces}");
    }
}

#[test]
fn colours_of_vertices_of_gltf_files_are_refused_unless_they_are_white() {
    let colours = |rgb: f32, component: &str| {
        let colours: Vec<u8> = std::iter::repeat_n(rgb.to_le_bytes(), 24).flatten().collect();
        let accessor =
            format!("\"bufferView\":2,\"componentType\":{component},\"count\":8,\"type\":\"VEC3\"");
        let mut cube = Glb::new(&read_obj(CUBE).expect("a cube")).with_view(&colours, &accessor);
        cube.json = cube.json.replace("\"POSITION\":0", "\"POSITION\":0,\"COLOR_0\":2");
        import(&cube.bytes(), MeshFormat::Gltf, &METRES).expect("a cube");
        import_colours(&cube.bytes(), MeshFormat::Gltf, &|_| Err(String::new()))
    };
    assert_eq!(colours(1.0, "5126"), Ok(ImportedColours::default()));
    for (rgb, component) in [(0.5, "5126"), (1.0, "5120")] {
        assert!(
            colours(rgb, component).expect_err("grey").starts_with("it has colours of vertices (COLOR_0)")
        );
    }
}

#[test]
fn more_materials_than_indices_are_refused() {
    let mtl: String = (0..=u16::MAX).map(|i| format!("newmtl m{i}\n")).collect();
    let most = mtl.strip_suffix("newmtl m65535\n").expect("the last").to_owned();
    let text = format!("mtllib c.mtl\nusemtl m1\n{CUBE}");
    let read =
        |mtl: String| import_colours(text.as_bytes(), MeshFormat::Obj, &|_| Ok(mtl.clone().into_bytes()));
    let refusal = Err("has 65536 materials; at most 65535 are drawn, merge some".to_owned());
    assert_eq!(read(mtl), refusal);
    assert_eq!(read(most).map(|colours| colours.material_ids), Ok(vec![1; 12]));
    let mut cube = Glb::new(&read_obj(CUBE).expect("a cube"));
    let materials = format!("\"materials\":[{}],\"accessors\"", vec!["{}"; 65536].join(","));
    cube.json = cube.json.replace("\"accessors\"", &materials);
    assert_eq!(import_colours(&cube.bytes(), MeshFormat::Gltf, &|_| Err(String::new())), refusal);
}

#[test]
fn materials_of_gltf_files_have_embedded_images() {
    let uvs = "\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC2\"";
    let mut cube = Glb::new(&read_obj(CUBE).expect("a cube")).with_view(b"picture!", uvs);
    cube.json = cube
        .json
        .replace(
            "\"accessors\"",
            "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,1,1,1],\"metallicFactor\":0,\
             \"roughnessFactor\":0.25,\"baseColorTexture\":{\"index\":0}}}],\"textures\":[{\"source\":0}],\
             \"images\":[{\"bufferView\":2,\"mimeType\":\"image/png\"}],\"accessors\"",
        )
        .replace("\"POSITION\":0", "\"POSITION\":0,\"TEXCOORD_0\":2")
        .replace("\"indices\":1}", "\"indices\":1,\"material\":0}");
    let read = |_: &str| Err("no file is read".to_owned());
    let ImportedColours { materials, material_ids } =
        import_colours(&cube.bytes(), MeshFormat::Gltf, &read).expect("materials");
    assert_eq!(material_ids, [0; 12]);
    let image = Some(ImportedImage::Bytes(b"picture!".as_slice().into()));
    let expected =
        ImportedMaterial { albedo: [0.5, 1.0, 1.0], roughness: Some(0.25), metalness: Some(0.0), image };
    assert_eq!(materials[0], expected);
    import(&cube.bytes(), MeshFormat::Gltf, &METRES).expect("a cube");
}
