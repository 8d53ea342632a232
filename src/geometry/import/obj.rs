//! Wavefront OBJ, by the crate `tobj`, and the colours of its MTL files. Those are read here: the crate panics on
//! colours of fewer than three numbers, and fails on lines that state no colour.

use std::{cell::RefCell, collections::BTreeSet, io::Cursor};

use super::{
    ImportedColours, ImportedImage, ImportedMaterial, MeshImportError, plain_id, polygon, shortened,
    text::{decoded, numbered_lines},
};
use crate::{Vec3, mesh::Mesh};

// The crate cuts polygons as fans, which is right for convex ones only.
const OBJ_OPTIONS: tobj::LoadOptions =
    tobj::LoadOptions { single_index: true, triangulate: false, ignore_points: true, ignore_lines: true };

pub(super) fn colours(
    bytes: &[u8],
    read_file: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<ImportedColours, String> {
    let problem = RefCell::new(None);
    let libraries = RefCell::new(Vec::new());
    let load = |path: &std::path::Path| {
        let path = path.to_string_lossy();
        let read = read_file(&path).and_then(|bytes| read_materials(&path, &bytes));
        let materials = read.map_err(|error| {
            problem.borrow_mut().get_or_insert(error);
            tobj::LoadError::MaterialParseError
        })?;
        let names = materials.iter().map(|material| material.name.clone()).collect();
        let ids = materials.iter().zip(0..).map(|(material, id)| (material.name.clone(), id)).collect();
        libraries.borrow_mut().push(MaterialLibrary { path: path.into_owned(), names });
        Ok((materials, ids))
    };
    let text = normalised(bytes)?;
    let loaded = tobj::load_obj_buf(&mut Cursor::new(&text), &OBJ_OPTIONS, load);
    let (models, materials) = loaded.map_err(|error| error.to_string())?;
    if let Some(problem) = problem.into_inner() {
        return Err(problem);
    }
    check_material_names(&text, &libraries.into_inner())?;
    // Without any material file this is an error of the library.
    let materials = materials.unwrap_or_default();
    models.iter().try_for_each(|model| check_drawn(&model.mesh, &materials))?;
    let mut materials: Vec<ImportedMaterial> =
        materials.into_iter().map(material_of_mtl).collect::<Result<_, String>>()?;
    if materials.is_empty() {
        return Ok(ImportedColours::default());
    }
    let plain = plain_id(materials.len())?;
    materials.push(ImportedMaterial::default());
    let ids = models.iter().flat_map(|model| {
        let id = model.mesh.material_id.map_or(plain, |id| id as u16);
        std::iter::repeat_n(id, triangles(&model.mesh).len())
    });
    Ok(ImportedColours { material_ids: ids.collect(), materials })
}

/// Refuses colours of vertices, and an image without texture coordinates, of the faces of one material.
fn check_drawn(mesh: &tobj::Mesh, materials: &[tobj::Material]) -> Result<(), String> {
    let textured = mesh.material_id.and_then(|id| materials.get(id)).filter(|m| m.diffuse_texture.is_some());
    match textured {
        Some(material) if !all_placed(mesh) => Err(format!(
            "material {}: map_Kd needs texture coordinates (vt), which a face of it lacks; unwrap the mesh, or remove \
             map_Kd",
            shortened(&material.name)
        )),
        // An image has them already, and white ones change nothing.
        None if mesh.vertex_color.iter().any(|x| *x != 1.0) => {
            Err("it has colours of vertices (v x y z r g b), which are not drawn; store them in materials or in an \
                 image, or remove them"
                .to_owned())
        }
        _ => Ok(()),
    }
}

/// True if all vertices have texture coordinates.
fn all_placed(mesh: &tobj::Mesh) -> bool {
    mesh.texcoords.len() / 2 == mesh.positions.len() / 3
}

/// An MTL file that an OBJ file names.
struct MaterialLibrary {
    path: String,
    names: BTreeSet<String>,
}

/// Refuses materials that no library above their use has, of a file with `libraries` in order.
fn check_material_names(obj: &str, libraries: &[MaterialLibrary]) -> Result<(), String> {
    let mut known = 0;
    for line in obj.lines() {
        let name = || line.trim().split_once(' ').map_or("", |(_, name)| name.trim());
        match line.split_whitespace().next() {
            Some("mtllib") => known += 1,
            Some("usemtl") if name() != NO_MATERIAL => {
                let has = |library: &MaterialLibrary| library.names.contains(name());
                if libraries.iter().take(known).any(has) {
                    continue;
                }
                let name = shortened(name());
                if let Some(later) = libraries.iter().find(|library| has(library)) {
                    let path = shortened(&later.path);
                    return Err(format!("usemtl {name} is above mtllib {path}; move mtllib to the top"));
                }
                return Err(match libraries.last() {
                    Some(last) => {
                        let path = shortened(&last.path);
                        format!("{path} has no material {name}; add it there, or correct usemtl")
                    }
                    None => format!("usemtl {name}: the file names no mtllib; add it, or remove usemtl"),
                });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Name in place of that of `usemtl` without one. No text has it.
const NO_MATERIAL: &str = "\0";

/// The text of an OBJ file for the crate, which knows keywords in lower case before a space, and lines that
/// neither go on in the next one nor end in a comment. Lines keep their numbers. Polylines, of which it would make
/// faces, are left out.
fn normalised(bytes: &[u8]) -> Result<String, String> {
    let mut text = String::with_capacity(bytes.len());
    let decoded = decoded(bytes)?;
    let mut written = 0;
    for (number, line) in numbered_lines(&decoded) {
        text.extend(std::iter::repeat_n('\n', number - 1 - written));
        let (keyword, rest) = keyword_and_rest(&line);
        let keyword = keyword.to_ascii_lowercase();
        let rest = match &*keyword {
            "l" => "",
            "v" | "vt" | "vn" | "f" => rest.split('#').next().unwrap_or_default(),
            "usemtl" if rest.is_empty() => NO_MATERIAL,
            _ => rest,
        };
        let keyword = if keyword == "l" { "" } else { &keyword };
        text.extend([keyword, " ", rest, "\n"]);
        written = number;
    }
    Ok(text)
}

/// Refuses a file that gives only some vertices colours (v x y z r g b): the crate takes those of others.
fn check_vertex_colours(text: &str) -> Result<(), String> {
    let vertices = text.lines().zip(1..).filter_map(|(line, number)| {
        let mut words = line.split_whitespace();
        (words.next() == Some("v")).then(|| (number, words.count() >= 6))
    });
    let mut vertices = vertices.peekable();
    let Some(&(first, has_colour)) = vertices.peek() else { return Ok(()) };
    let Some((other, _)) = vertices.find(|(_, has)| *has != has_colour) else { return Ok(()) };
    let (with, without): (usize, usize) = if has_colour { (first, other) } else { (other, first) };
    Err(format!(
        "the vertex of line {with} has a colour (v x y z r g b), and that of line {without} has none; remove the colours \
         of vertices, and store them in materials or in an image"
    ))
}

/// The text of an OBJ file whose corners without texture coordinates are given (0, 0).
fn with_coordinates_everywhere(text: &str) -> String {
    let corner = |corner: &str| {
        let mut parts = corner.split('/');
        let mut next = || parts.next().unwrap_or_default();
        let (vertex, placed, normal) = (next(), next(), next());
        let placed = match placed.parse::<i64>() {
            Ok(index) if index > 0 => index.saturating_add(1).to_string(),
            Ok(index) => index.to_string(),
            Err(_) => "1".to_owned(),
        };
        format!(" {vertex}/{placed}/{normal}")
    };
    let mut all = "vt 0 0\n".to_owned();
    for line in text.lines() {
        match line.strip_prefix("f ") {
            Some(corners) => {
                all.extend(std::iter::once("f".to_owned()).chain(corners.split_whitespace().map(corner)))
            }
            None => all.push_str(line),
        }
        all.push('\n');
    }
    all
}

fn keyword_and_rest(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim_start()))
}

/// The materials of the MTL file `path`, of which names, `Kd` and `map_Kd` matter.
fn read_materials(path: &str, bytes: &[u8]) -> Result<Vec<tobj::Material>, String> {
    let mut materials: Vec<tobj::Material> = Vec::new();
    let text = decoded(bytes).map_err(|error| format!("{}: {error}", shortened(path)))?;
    for (number, line) in numbered_lines(&text) {
        let (keyword, rest) = keyword_and_rest(&line);
        let refuse = |problem: &str| Err(format!("{} line {number}: {problem}", shortened(path)));
        match (keyword.to_ascii_lowercase().as_str(), materials.last_mut()) {
            ("newmtl", _) if rest.is_empty() => return refuse("newmtl has no name; add it"),
            ("newmtl", _) => {
                materials.push(tobj::Material { name: rest.to_owned(), ..tobj::Material::default() });
            }
            ("kd" | "map_kd", None) => return refuse(&format!("{keyword} is above newmtl; move it below")),
            ("kd", Some(material)) => match colour(rest) {
                Some(colour) => material.diffuse = Some(colour),
                None => {
                    let rest = shortened(rest);
                    return refuse(&format!("Kd is {rest:?}; give three shares of 1, or one for a grey"));
                }
            },
            ("map_kd", _) if rest.is_empty() => {
                return refuse("map_Kd names no image; add its file, or remove the line");
            }
            ("map_kd", Some(material)) => material.diffuse_texture = Some(rest.to_owned()),
            _ => {}
        }
    }
    Ok(materials)
}

/// Red, green and blue of a colour; a single number is all of them.
fn colour(words: &str) -> Option<[f32; 3]> {
    let numbers: Vec<f32> = words.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    match numbers[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

fn material_of_mtl(material: tobj::Material) -> Result<ImportedMaterial, String> {
    // Options before the name, such as "-bm 1", are not followed.
    let image = material.diffuse_texture.map(|text| match text.starts_with('-') {
        true => text.split_whitespace().next_back().unwrap_or_default().to_owned(),
        false => text.trim().to_owned(),
    });
    let plain = ImportedMaterial::default();
    let albedo = match (&image, material.diffuse) {
        // Exporters write a grey in addition to an image.
        (Some(_), _) => [1.0; 3],
        (None, Some(colour)) if colour.iter().all(|x| (0.0..=1.0).contains(x)) => colour.map(f64::from),
        (None, Some([r, g, b])) => {
            let name = shortened(&material.name);
            return Err(format!(
                "material {name}: Kd is {r} {g} {b}; give shares of 1, such as 0.5 for 128 of 255"
            ));
        }
        (None, None) => plain.albedo,
    };
    Ok(ImportedMaterial { albedo, image: image.map(ImportedImage::File), ..plain })
}

/// The triangles of the faces of a mesh, by indices of its vertices.
fn triangles(mesh: &tobj::Mesh) -> Vec<[u32; 3]> {
    if mesh.face_arities.is_empty() {
        return mesh.indices.as_chunks().0.to_vec();
    }
    let mut rest = &*mesh.indices;
    let mut triangles = Vec::new();
    for count in &mesh.face_arities {
        let (face, others) = rest.split_at(*count as usize);
        let corners: Vec<Vec3> = face.iter().map(|vertex| position(mesh, *vertex)).collect();
        triangles.extend(polygon::triangles(&corners).into_iter().map(|t| t.map(|corner| face[corner])));
        rest = others;
    }
    triangles
}

fn position(mesh: &tobj::Mesh, vertex: u32) -> Vec3 {
    let at = 3 * vertex as usize;
    Vec3::from_fn(|axis, _| f64::from(mesh.positions[at + axis]))
}

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, MeshImportError> {
    let unreadable = |reason: String| MeshImportError::Unreadable { format: "OBJ", reason };
    // Materials split meshes, which would change the order of vertices: [`colours`] reads them separately.
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let try_load = |text: &str| tobj::load_obj_buf(&mut Cursor::new(text), &OBJ_OPTIONS, no_materials);
    let load = |text: &str| {
        try_load(text).map(|(models, _)| models).map_err(|error| {
            // The crate does not say where: the first line that makes the text fail.
            let ends: Vec<usize> = text.match_indices('\n').map(|(end, _)| end).collect();
            let line = ends.partition_point(|end| try_load(&text[..*end]).is_ok()) + 1;
            unreadable(format!("line {line}: {error}"))
        })
    };
    let text = normalised(bytes).map_err(unreadable)?;
    check_vertex_colours(&text).map_err(unreadable)?;
    let mut models = load(&text)?;
    // The crate lists the coordinates of those that have some, without telling which.
    if models.iter().any(|model| !model.mesh.texcoords.is_empty() && !all_placed(&model.mesh)) {
        models = load(&with_coordinates_everywhere(&text))?;
    }
    // The reader numbers vertices by their first use.
    let is_bad = |line: &str| {
        let mut words = line.split_whitespace();
        let is_number = |word: &str| word.parse::<f64>().is_ok_and(f64::is_finite);
        words.next() == Some("v") && !words.take(3).all(is_number)
    };
    if let Some(at) = text.lines().position(is_bad) {
        return Err(unreadable(format!("line {} has a coordinate that is not a number", at + 1)));
    }
    let mut out = Mesh::default();
    let textured = models.iter().any(|model| !model.mesh.texcoords.is_empty());
    for tobj::Model { mesh, .. } in &models {
        let base = out.vertices.len() as u32;
        out.vertices.extend((0..mesh.positions.len() as u32 / 3).map(|vertex| position(mesh, vertex)));
        for t in triangles(mesh) {
            out.triangles.push(t.map(|vertex| vertex + base));
            if textured {
                let uv = |v: u32| {
                    let at = 2 * v as usize;
                    mesh.texcoords.get(at..at + 2).map_or([0.0; 2], |uv| [uv[0], uv[1]].map(f64::from))
                };
                out.uvs.push([uv(t[0]), uv(t[1]), uv(t[2])]);
            }
        }
    }
    Ok(out)
}
