use super::rng;
use rand::Rng;

use crate::{
    Aabb, Vec3,
    import::{
        ImportedColours, ImportedImage, ImportedMaterial, MeshFormat, MeshImportError, MeshImportOptions,
        import, import_colours,
    },
    mesh::{Mesh, MeshError},
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
fn scale_and_up_axis_are_applied() {
    let tall = CUBE.replace(" 1 ", " 3 ").replace("v 0 3 3 ", "v 0 3 1");
    let tall = tall.lines().filter(|l| l.starts_with('f')).collect::<Vec<_>>().join("\n");
    let corners = "v 0 0 0\nv 1 0 0\nv 1 3 0\nv 0 3 0\nv 0 0 1\nv 1 0 1\nv 1 3 1\nv 0 3 1\n";
    let options = MeshImportOptions { scale: 1e-3, z_up: Some(false) };
    let mesh = import(format!("{corners}{tall}").as_bytes(), MeshFormat::Obj, &options).expect("a brick");
    let size = Aabb::from_points(&mesh.vertices).expect("corners").size();
    assert!((size - Vec3::new(1e-3, 1e-3, 3e-3)).norm() < 1e-15 && mesh.volume() > 0.0, "{size:?}");
}

#[test]
fn open_empty_flat_and_malformed_files_are_refused_with_a_reason() {
    let open = CUBE.rsplit_once("f 4").expect("a last face").0;
    let refusal =
        |text: &str| read_obj(text).and_then(|mesh| Ok(Shape::from_mesh(mesh)?)).expect_err("refused");
    assert_eq!(refusal(open), MeshImportError::Mesh(MeshError::Open { edges: 4 }));
    assert_eq!(
        refusal(open).to_string(),
        "the mesh is open: 4 edges have a triangle on one side only; close its holes"
    );
    assert_eq!(refusal("v 0 0 0\n"), MeshImportError::Mesh(MeshError::Empty));
    assert_eq!(
        refusal(&CUBE.replace("v 1 1 1", "v 1 nan 1")).to_string(),
        "cannot be read as OBJ: line 7 has a coordinate that is not a number"
    );
    let textured = CUBE.replace("f 4 3 2 1", "vt 0 0\nvt nan 0\nf 4/1 3/1 2/2 1/1");
    assert_eq!(refusal(&textured), MeshImportError::Mesh(MeshError::TextureNotFinite { triangle: 0 }));
    let sheet = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n";
    assert_eq!(refusal(sheet), MeshImportError::Mesh(MeshError::Flat));
    let twice = format!("{CUBE}f 4 3 2 1\n");
    assert!(matches!(refusal(&twice), MeshImportError::Mesh(MeshError::NonManifold { .. })));
    assert!(matches!(refusal("v a b c\n"), MeshImportError::Unreadable { format: "OBJ", .. }));
    let whole = stl(&read_obj(CUBE).expect("a cube"));
    for bytes in [&whole[..whole.len() - 1], &[&whole[..], &[0; 51]].concat()] {
        let refused = import(bytes, MeshFormat::Stl, &METRES).expect_err("another length");
        assert_eq!(refused, MeshImportError::Length { declared: whole.len(), actual: bytes.len() });
    }
    for format in [MeshFormat::Stl, MeshFormat::Gltf] {
        assert!(matches!(import(b"not a mesh", format, &METRES), Err(MeshImportError::Unreadable { .. })));
    }
    let cut_short = &glb(&read_obj(CUBE).expect("a cube"))[..200];
    assert!(import(cut_short, MeshFormat::Gltf, &METRES).is_err());
    assert_eq!(MeshFormat::from_extension("FBX"), Err(MeshImportError::Extension("fbx".into())));
    let millimetres = MeshImportOptions { scale: -1.0, z_up: None };
    assert_eq!(import(CUBE.as_bytes(), MeshFormat::Obj, &millimetres), Err(MeshImportError::Scale(-1.0)));
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
fn glb_accessors_of_other_types_and_outside_data_are_refused() {
    let cube = Glb::new(&read_obj(CUBE).expect("a cube"));
    let refused = [
        (r#""componentType":5125"#, r#""componentType":5126"#, "accessor indices is SCALAR of 32-bit floats"),
        (r#""componentType":5126"#, r#""componentType":5121"#, "accessor POSITION is VEC3 of unsigned bytes"),
        (r#""type":"VEC3""#, r#""type":"SCALAR""#, "accessor POSITION is SCALAR of 32-bit floats"),
        (
            r#""count":36,"type":"SCALAR""#,
            r#""count":12,"type":"VEC3""#,
            "accessor indices is VEC3 of unsigned 32-bit",
        ),
        (
            r#""count":36"#,
            r#""count":35"#,
            "accessor indices has 35 elements; glTF requires three per triangle",
        ),
        (r#""count":36"#, r#""count":39"#, "accessor indices lies outside of its buffer"),
        (r#""count":8"#, r#""count":4000000000"#, "accessor POSITION lies outside of its buffer"),
        (r#""count":8"#, r#""count":0"#, "accessor POSITION has no data"),
        (r#""count":8"#, r#""count":7"#, "accessor indices names vertex 7 of 7"),
        (
            r#""byteLength":96}"#,
            r#""byteStride":4,"byteLength":96}"#,
            "accessor POSITION has elements that overlap",
        ),
        (r#"[{"byteLength":"#, r#"[{"uri":"cube.bin","byteLength":"#, "uses buffers outside of the file"),
        (r#"[{"byteLength":"#, r#"[{"byteLength":1"#, "uses buffers outside of the file"),
    ];
    for (from, to, expected) in refused {
        let message = cube.refusal(from, to);
        assert!(message.contains(expected), "{from} -> {to}: {message}");
    }
    let mut longer = cube.bytes();
    let actual = longer.len() + 4;
    longer.extend([0; 4]);
    let declared = actual - 4;
    assert_eq!(import(&longer, MeshFormat::Gltf, &METRES), Err(MeshImportError::Length { declared, actual }));
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
fn materials_of_obj_files_are_those_of_their_mtl_files() {
    let coloured = CUBE
        .replace(
            "f 4 3 2 1",
            "mtllib cube.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl paper\nf 4/4 3/3 2/2 1/1",
        )
        .replace("f 5 6 7 8", "usemtl blue\nf 5 6 7 8");
    let mtl = "newmtl paper\nKd 0.8 0.8 0.8\nmap_Kd -bm 1 wood.png\nnewmtl blue\nKd 0 0.25 1\n";
    let read = |text: &'static str| {
        move |name: &str| match name {
            "cube.mtl" => Ok(text.as_bytes().to_vec()),
            other => Err(format!("no file {other}")),
        }
    };
    let colours = |text: &str, file: &dyn Fn(&str) -> Result<Vec<u8>, String>| {
        import_colours(text.as_bytes(), MeshFormat::Obj, file)
    };
    let ImportedColours { materials, material_ids } = colours(&coloured, &read(mtl)).expect("materials");
    assert_eq!(material_ids, [vec![0; 2], vec![1; 10]].concat());
    let image = Some(ImportedImage::File("wood.png".to_owned()));
    let paper = ImportedMaterial { albedo: [1.0; 3], image, ..ImportedMaterial::default() };
    let blue = ImportedMaterial { albedo: [0.0, 0.25, 1.0], ..ImportedMaterial::default() };
    assert_eq!(materials, [paper, blue, ImportedMaterial::default()]);
    let mesh = read_obj(&coloured).expect("a cube");
    assert_eq!(mesh.vertices.len(), read_obj(CUBE).expect("a cube").vertices.len() + 4, "seams of the image");
    assert_eq!((mesh.uvs.len(), mesh.uvs[0][0], mesh.uvs[11]), (12, [0.0, 1.0], [[0.0; 2]; 3]));
    assert_eq!(colours(CUBE, &read(mtl)), Ok(ImportedColours::default()), "no material file");
    let missing = colours(&coloured, &|name| Err(format!("no file {name}")));
    assert_eq!(missing, Err("no file cube.mtl".to_owned()));
    let unknown = coloured.replace("usemtl blue", "usemtl bleu");
    let error = "cube.mtl has no material bleu; add it there, or correct usemtl".to_owned();
    assert_eq!(colours(&unknown, &read(mtl)), Err(error));
    let late = format!("usemtl blue\n{coloured}");
    let error = "usemtl blue is above mtllib cube.mtl; move mtllib to the top".to_owned();
    assert_eq!(colours(&late, &read(mtl)), Err(error));
    let error = "usemtl blue: the file names no mtllib; add it, or remove usemtl".to_owned();
    assert_eq!(colours(&late.replace("mtllib", "#"), &read(mtl)), Err(error));
    let bytes = "newmtl paper\nKd 0 0 255\nnewmtl blue\nKd 0 0.25 1\n";
    let error = "material paper: Kd is 0 0 255; give shares of 1, such as 0.5 for 128 of 255".to_owned();
    assert_eq!(colours(&coloured, &read(bytes)), Err(error));
    let (named, long) = ("x".repeat(1000), "x".repeat(80));
    let error = colours(&coloured.replace("blue", &named), &read(mtl)).expect_err("unknown");
    assert!(error.contains(&format!("material {long}…;")), "{error}");
}

#[test]
fn no_line_of_an_mtl_file_panics_and_keywords_may_have_capitals() {
    let colours = |obj: &str, mtl: &str| {
        import_colours(obj.as_bytes(), MeshFormat::Obj, &|_| Ok(mtl.as_bytes().to_vec()))
            .map(|colours| colours.materials[0].albedo)
    };
    let obj = format!("mtllib c.mtl\nusemtl m\n{CUBE}");
    let kd = |text: &str| colours(&obj, &format!("newmtl m\n{text}\n"));
    assert_eq!(kd("Kd 0.5"), Ok([0.5; 3]), "a grey: green and blue are equal to red");
    for ignored in
        ["Ks 1", "Ka", "Ke 1 1", "Ns", "Ni x", "d", "illum", "map_Ks", "bump", "Tf xyz 1", "# Kd 1", "é"]
    {
        assert_eq!(kd(&format!("{ignored}\nKd 1 0 0")), Ok([1.0, 0.0, 0.0]), "{ignored}");
    }
    for (text, expected) in [
        ("Kd", "c.mtl line 2: Kd is \"\"; give three shares of 1, or one for a grey"),
        ("Kd 1 0", "c.mtl line 2: Kd is \"1 0\"; give three shares of 1, or one for a grey"),
        (
            "Kd spectral a.rfl",
            "c.mtl line 2: Kd is \"spectral a.rfl\"; give three shares of 1, or one for a grey",
        ),
        ("map_Kd", "c.mtl line 2: map_Kd names no image; add its file, or remove the line"),
        ("newmtl ", "c.mtl line 2: newmtl has no name; add it"),
    ] {
        assert_eq!(kd(text), Err(expected.to_owned()));
    }
    assert_eq!(
        colours(&obj, "Kd 1\nnewmtl m"),
        Err("c.mtl line 1: Kd is above newmtl; move it below".to_owned())
    );
    assert!(kd("Kd nan").expect_err("no share").contains("Kd is NaN NaN NaN; give shares of 1"));
    assert_eq!(colours(&obj, "\u{feff}NEWMTL\tm\n  KD 0 1 0\n"), Ok([0.0, 1.0, 0.0]));
    let capitals = obj.replace("mtllib ", "MTLLIB\t").replace("usemtl ", "USEMTL\t");
    assert_eq!(colours(&capitals, "newmtl m\nKd 0 1 0\n"), Ok([0.0, 1.0, 0.0]));
    let capitals = format!("\u{feff}{}", CUBE.replace('v', "V").replace('f', "F\t"));
    assert_eq!(read_obj(&capitals), read_obj(CUBE));
}

#[test]
fn an_image_needs_texture_coordinates_of_every_face_that_has_it() {
    let placed = CUBE.replace("f 4 3 2 1", "vt 0 0\nusemtl m\nf 4/1 3/1 2/1 1/1\nusemtl n");
    let colours = |obj: &str, mtl: &str| {
        let obj = format!("mtllib c.mtl\n{obj}");
        import_colours(obj.as_bytes(), MeshFormat::Obj, &|_| Ok(mtl.as_bytes().to_vec()))
    };
    let mtl = "newmtl m\nmap_Kd a.png\nnewmtl n\nKd 1 0 0\nnewmtl unused\nmap_Kd b.png\n";
    assert!(colours(&placed, mtl).is_ok(), "the other faces have no image");
    let error = "material m: map_Kd needs texture coordinates (vt), which a face of it lacks; unwrap the mesh, or remove \
                 map_Kd";
    for obj in [format!("usemtl m\n{CUBE}"), placed.replace("usemtl n\n", "")] {
        assert_eq!(colours(&obj, mtl), Err(error.to_owned()));
    }
    let gltf = textured_glb("\"baseColorTexture\":{\"index\":0}", "a.png");
    let gltf = Glb { json: gltf.json.replace(",\"TEXCOORD_0\":0", ""), ..gltf };
    assert_eq!(
        glb_colours(&gltf),
        Err("material 0: its image needs texture coordinates, but a mesh of it has no TEXCOORD_0; unwrap the mesh, or \
             remove the image"
            .to_owned())
    );
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
fn colours_of_vertices_are_refused_unless_they_change_nothing() {
    let coloured = |rgb: &str| {
        let lines = CUBE.lines().map(|line| match line.starts_with('v') {
            true => format!("{line} {rgb}\n"),
            false => format!("{line}\n"),
        });
        let obj: String = lines.collect();
        read_obj(&obj).expect("a cube");
        import_colours(obj.as_bytes(), MeshFormat::Obj, &|_| Err(String::new()))
    };
    assert_eq!(coloured("1 1 1"), Ok(ImportedColours::default()));
    assert!(coloured("1 0 0").expect_err("red").starts_with("it has colours of vertices (v x y z r g b)"));

    let partly = CUBE.lines().enumerate().map(|(index, line)| match index {
        1 => format!("{line} 1 0 0\n"),
        _ => format!("{line}\n"),
    });
    let error = read_obj(&partly.collect::<String>()).expect_err("one colour").to_string();
    assert!(
        error.contains("the vertex of line 2 has a colour (v x y z r g b), and that of line 1 has none"),
        "{error}"
    );

    let colours = |rgb: f32, component: &str| {
        let mut cube = Glb::new(&read_obj(CUBE).expect("a cube"));
        let start = cube.blob.len();
        cube.blob.extend(std::iter::repeat_n(rgb.to_le_bytes(), 24).flatten());
        let end = cube.blob.len();
        cube.json = cube
            .json
            .replace(&format!("\"byteLength\":{start}}}]"), &format!("\"byteLength\":{end}}}]"))
            .replace("}],\n            \"accessors\"", &format!("}},{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":96}}],\"accessors\""))
            .replace("\"SCALAR\"}]", &format!("\"SCALAR\"}},{{\"bufferView\":2,\"componentType\":{component},\"count\":8,\"type\":\"VEC3\"}}]"))
            .replace("\"POSITION\":0", "\"POSITION\":0,\"COLOR_0\":2");
        import(&cube.bytes(), MeshFormat::Gltf, &METRES).expect("a cube");
        glb_colours(&cube)
    };
    assert_eq!(colours(1.0, "5126"), Ok(ImportedColours::default()));
    for (rgb, component) in [(0.5, "5126"), (1.0, "5120")] {
        assert!(
            colours(rgb, component).expect_err("grey").starts_with("it has colours of vertices (COLOR_0)")
        );
    }
}

#[test]
fn colours_of_specular_glossiness_are_refused_without_a_base_colour() {
    let extended = |surface: &str| {
        let cube = textured_glb(surface, "a.png");
        let extension = "\"materials\":[{\"extensions\":{\"KHR_materials_pbrSpecularGlossiness\":{\"diffuseFactor\":[1,0,0,1]}},";
        let json = cube.json.replace("\"materials\":[{", extension);
        glb_colours(&Glb { json, ..cube }).map(|colours| colours.materials[0].albedo)
    };
    let error = extended("").expect_err("no base colour");
    assert!(
        error.starts_with("material 0: its colour is that of KHR_materials_pbrSpecularGlossiness"),
        "{error}"
    );
    assert_eq!(
        extended("\"baseColorFactor\":[0.5,0,0,1]"),
        Ok([0.5, 0.0, 0.0]),
        "the fallback that it states"
    );
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
    let mut cube = Glb::new(&read_obj(CUBE).expect("a cube"));
    let start = cube.blob.len();
    cube.blob.extend(b"picture!");
    cube.json = cube
        .json
        .replace(&format!("\"byteLength\":{start}}}]"), &format!("\"byteLength\":{}}}]", start + 8))
        .replace(
            "\"accessors\"",
            "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,1,1,1],\"metallicFactor\":0,\
             \"roughnessFactor\":0.25,\"baseColorTexture\":{\"index\":0}}}],\"textures\":[{\"source\":0}],\
             \"images\":[{\"bufferView\":2,\"mimeType\":\"image/png\"}],\"accessors\"",
        )
        .replace("\"POSITION\":0", "\"POSITION\":0,\"TEXCOORD_0\":2")
        .replace(
            "\"SCALAR\"}]",
            "\"SCALAR\"},{\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC2\"}]",
        )
        .replace("\"indices\":1}", "\"indices\":1,\"material\":0}");
    let views = cube.json.find("\"bufferViews\":[").expect("views") + "\"bufferViews\":[".len();
    let end = views + cube.json[views..].find(']').expect("its end");
    cube.json.insert_str(end, &format!(",{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":8}}"));
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

/// A cube with a material and an image beside the file.
fn textured_glb(surface: &str, uri: &str) -> Glb {
    let mut cube = Glb::new(&read_obj(CUBE).expect("a cube"));
    let materials = format!(
        "\"materials\":[{{\"pbrMetallicRoughness\":{{{surface}}}}}],\"textures\":[{{\"source\":0}}],\
         \"images\":[{{\"uri\":\"{uri}\"}}],\"accessors\""
    );
    cube.json = cube
        .json
        .replace("\"accessors\"", &materials)
        .replace("\"POSITION\":0", "\"POSITION\":0,\"TEXCOORD_0\":0")
        .replace("\"indices\":1}", "\"indices\":1,\"material\":0}");
    cube
}

fn glb_colours(cube: &Glb) -> Result<ImportedColours, String> {
    import_colours(&cube.bytes(), MeshFormat::Gltf, &|_| Err("no file is read".to_owned()))
}

#[test]
fn factors_that_multiply_a_texture_of_roughness_are_left_out() {
    let surface = |surface: &str| {
        let colours = glb_colours(&textured_glb(surface, "a.png")).expect("a material");
        (colours.materials[0].roughness, colours.materials[0].metalness)
    };
    assert_eq!(surface(""), (Some(1.0), Some(1.0)));
    assert_eq!(surface("\"metallicRoughnessTexture\":{\"index\":0}"), (None, None));
}

#[test]
fn addresses_of_gltf_images_are_decoded_and_data_is_not_printed() {
    let image = |uri: &str| {
        let colours = glb_colours(&textured_glb("\"baseColorTexture\":{\"index\":0}", uri));
        colours.map(|colours| colours.materials[0].image.clone())
    };
    assert_eq!(image("maps/dark%20oak.png"), Ok(Some(ImportedImage::File("maps/dark oak.png".to_owned()))));
    let error = image("data:image/png;base64,AAAA").expect_err("data");
    assert_eq!(
        error,
        "material 0: its image is a data URI, which is not supported; store it in the .glb file or beside it"
    );
    assert!(image("%ff.png").expect_err("bytes").contains("is not UTF-8 text"));
}

#[test]
fn other_texture_coordinates_of_gltf_images_are_refused() {
    let colours = |info: &str| {
        let mut cube = textured_glb(&format!("\"baseColorTexture\":{{\"index\":0{info}}}"), "a.png");
        cube.json = cube.json.replacen('{', "{\"extensionsUsed\":[\"KHR_texture_transform\"],", 1);
        (glb_colours(&cube), cube)
    };
    let transform = |inner: &str| format!(",\"extensions\":{{\"KHR_texture_transform\":{{{inner}}}}}");
    for (info, expected) in [
        (",\"texCoord\":1".to_owned(), "TEXCOORD_1"),
        (transform("\"texCoord\":2"), "TEXCOORD_2"),
        (transform("\"scale\":[2,2]"), "KHR_texture_transform"),
        (transform("\"offset\":[0.5,0]"), "KHR_texture_transform"),
    ] {
        let (found, mut cube) = colours(&info);
        let error = found.expect_err(&info);
        assert!(error.starts_with("material 0: its image ") && error.contains(expected), "{error}");
        cube.json = cube.json.replace(",\"material\":0", "");
        assert!(glb_colours(&cube).is_ok(), "no triangle has it");
    }
    assert!(colours(&transform("\"scale\":[1,1]")).0.is_ok(), "without effect");
}
