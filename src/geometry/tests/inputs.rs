//! Mesh files with errors, and what is read of others: `bad/`.

use std::path::Path;

use super::import::{CUBE, Glb, METRES, read_obj};
use crate::{
    import::{ImportedColours, MeshFormat, MeshImportError, import, import_colours},
    mesh::Mesh,
    shape::Shape,
};

#[path = "../../../tests/inputs/mod.rs"]
mod fixtures;

/// The text with the changes `FROM => TO` of an input. An empty FROM is the end.
fn changed(text: &str, changes: &str) -> String {
    let written = |text: &str| text.replace("\\n", "\n").replace("\\t", "\t").replace("\\0", "\0");
    changes.lines().fold(text.to_owned(), |text, line| {
        let (from, to) = line.split_once(" =>").expect("a change");
        let (from, to) = (written(from), written(to.trim_start_matches(' ')));
        if from.is_empty() { format!("{text}\n{to}\n") } else { text.replacen(&from, &to, 1) }
    })
}

fn solid(mesh: Result<Mesh, MeshImportError>) -> Result<String, MeshImportError> {
    let mesh = mesh?;
    let (volume, vertices) = ((1e9 * mesh.volume()).round() / 1e9, mesh.vertices.len());
    Shape::from_mesh(mesh)?;
    Ok(format!("a solid of {volume} m³ with {vertices} vertices"))
}

fn materials(colours: Result<ImportedColours, String>) -> Result<String, String> {
    let ImportedColours { materials, material_ids } = colours?;
    let of = |index: usize| material_ids.iter().filter(|id| usize::from(**id) == index).count();
    let lines = materials
        .iter()
        .enumerate()
        .map(|(index, material)| format!("{} triangles: {material:?}", of(index)));
    Ok(lines.collect::<Vec<_>>().join("\n"))
}

/// A cube with a material and an image in a file of its own.
fn textured() -> Glb {
    let materials = "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"texCoord\":0}}}],\
                     \"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"a.png\"}],\"accessors\"";
    let mut cube = Glb::new(&read_obj(CUBE).expect("a cube"));
    cube.json = cube
        .json
        .replacen('{', "{\"extensionsUsed\":[\"KHR_texture_transform\"],", 1)
        .replace("\"accessors\"", materials)
        .replace("\"POSITION\":0", "\"POSITION\":0,\"TEXCOORD_0\":0")
        .replace("\"indices\":1}", "\"indices\":1,\"material\":0}");
    cube
}

#[test]
fn mesh_files() {
    fixtures::check(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad"), |name, input| {
        let file = |index: usize| changed(&input.files[index].1, &input.shown);
        let glb = |cube: Glb| Glb { json: changed(&cube.json, &input.shown), ..cube }.bytes();
        let no_file = |name: &str| Err(format!("no file {name}"));
        let answer = match name {
            "obj" => {
                let colours = import_colours(file(0).as_bytes(), MeshFormat::Obj, &no_file);
                solid(read_obj(&file(0)))
                    .map_err(|error| error.to_string())
                    .and_then(|solid| colours.map(|_| solid))
            }
            "obj_files" => solid(read_obj(&input.text)).map_err(|error| error.to_string()),
            "obj_materials" => {
                let vertices = read_obj(&file(0)).map_or(0, |mesh| mesh.vertices.len());
                let materials = self::materials(import_colours(
                    file(0).as_bytes(),
                    MeshFormat::Obj,
                    &|name| match name {
                        "cube.mtl" => Ok(file(1).into_bytes()),
                        other => no_file(other),
                    },
                ));
                materials.map(|materials| format!("{vertices} vertices\n{materials}"))
            }
            "glb" => {
                let bytes = glb(Glb::new(&read_obj(CUBE).expect("a cube")));
                let solid =
                    solid(import(&bytes, MeshFormat::Gltf, &METRES)).map_err(|error| error.to_string());
                solid.and_then(|solid| import_colours(&bytes, MeshFormat::Gltf, &no_file).map(|_| solid))
            }
            "glb_materials" => materials(import_colours(&glb(textured()), MeshFormat::Gltf, &no_file)),
            other => panic!("no test reads {other}"),
        };
        answer.unwrap_or_else(|message| message)
    });
}
