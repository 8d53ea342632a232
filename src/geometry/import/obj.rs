//! Wavefront OBJ, and the colours of its MTL files.
//!
//! The crate `tobj` would need the text rewritten: it cuts concave polygons as fans, makes faces of polylines, assigns
//! texture coordinates and colours to the wrong vertices where some have none, and names no lines.

use std::collections::{BTreeMap, HashMap};

use super::{
    ImportedColours, ImportedImage, ImportedMaterial, MeshImportError, plain_id, polygon, shortened,
    text::{decoded, numbered_lines},
};
use crate::{Vec3, mesh::Mesh};

/// A corner of a face: indices of its position, texture coordinates and normal.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    position: usize,
    uv: Option<usize>,
    normal: Option<usize>,
}

impl Corner {
    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`, with indices from 1, or below 0 from the last element so far.
    fn parse(text: &str, positions: usize, uvs: usize, normals: usize) -> Option<Self> {
        let mut parts = text.split('/').map(|part| (!part.is_empty()).then(|| part.parse::<isize>()));
        let mut next = |count: usize| match parts.next().flatten() {
            None => Some(None),
            Some(Ok(index)) if index < 0 => count.checked_add_signed(index).map(Some),
            Some(index) => usize::try_from(index.ok()? - 1).ok().map(Some),
        };
        Some(Self { position: next(positions)??, uv: next(uvs)?, normal: next(normals)? })
    }
}

struct Face {
    line: usize,
    corners: Vec<Corner>,
    /// Number of objects and groups that begin above it.
    group: usize,
    /// Index of the `usemtl` above it.
    used: Option<usize>,
}

/// A line `usemtl`.
struct MaterialUse {
    /// Empty for faces without a material.
    name: String,
    /// Number of MTL files that are named above it.
    libraries: usize,
}

#[derive(Default)]
struct Obj {
    positions: Vec<Vec3>,
    /// True for each vertex that has a colour other than white.
    is_coloured: Vec<bool>,
    uvs: Vec<[f64; 2]>,
    /// Faces of three or more corners.
    faces: Vec<Face>,
    /// Paths of MTL files.
    libraries: Vec<String>,
    uses: Vec<MaterialUse>,
}

impl Obj {
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let text = decoded(bytes)?;
        let mut obj = Self::default();
        let (mut normals, mut group) = (0, 0);
        for (line, row) in numbered_lines(&text) {
            let (keyword, rest) = keyword_and_rest(&row);
            let words = || rest.split('#').next().unwrap_or_default().split_whitespace();
            let numbers =
                || words().map(|word| word.parse().ok()).collect::<Option<Vec<f32>>>().unwrap_or_default();
            match keyword.to_ascii_lowercase().as_str() {
                "v" => {
                    let numbers = numbers();
                    let (position, rest) = numbers
                        .split_first_chunk::<3>()
                        .ok_or_else(|| format!("line {line}: v needs three numbers"))?;
                    let weight = if let [weight] = rest { *weight } else { 1.0 };
                    let position = position.map(|x| f64::from(x / weight));
                    if !position.iter().all(|x| x.is_finite()) {
                        return Err(format!("line {line}: v is not finite, or its weight is 0"));
                    }
                    obj.positions.push(Vec3::from(position));
                    obj.is_coloured.push(rest.len() >= 3 && rest[..3] != [1.0; 3]);
                }
                "vt" => match numbers()[..] {
                    [u, v, ..] => obj.uvs.push([u, v].map(f64::from)),
                    _ => return Err(format!("line {line}: vt needs two numbers")),
                },
                "vn" => normals += 1,
                "f" => {
                    let corner = |text| {
                        Corner::parse(text, obj.positions.len(), obj.uvs.len(), normals)
                            .ok_or_else(|| format!("line {line}: {text:?} is not a corner of a face"))
                    };
                    let corners = words().map(corner).collect::<Result<Vec<_>, _>>()?;
                    if corners.len() > 2 {
                        obj.faces.push(Face { line, corners, group, used: obj.uses.len().checked_sub(1) });
                    }
                }
                "o" | "g" => group += 1,
                "mtllib" => obj.libraries.push(rest.to_owned()),
                "usemtl" => {
                    obj.uses.push(MaterialUse { name: rest.to_owned(), libraries: obj.libraries.len() });
                }
                _ => {}
            }
        }
        let (positions, uvs) = (obj.positions.len(), obj.uvs.len());
        let is_there = |c: &Corner| c.position < positions && c.uv.is_none_or(|uv| uv < uvs || uvs == 0);
        match obj.faces.iter().find(|face| !face.corners.iter().all(is_there)) {
            Some(Face { line, .. }) => Err(format!("line {line}: a corner of the face is not in the file")),
            None => Ok(obj),
        }
    }

    /// Texture coordinates of a corner.
    fn uv(&self, corner: &Corner) -> Option<[f64; 2]> {
        self.uvs.get(corner.uv?).copied()
    }

    /// The triangles of a face, by indices of its corners.
    fn triangles(&self, face: &Face) -> Vec<[usize; 3]> {
        let corners: Vec<Vec3> = face.corners.iter().map(|corner| self.positions[corner.position]).collect();
        polygon::triangles(&corners)
    }
}

fn keyword_and_rest(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim_start()))
}

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, MeshImportError> {
    let obj = Obj::parse(bytes).map_err(|reason| MeshImportError::Unreadable { format: "OBJ", reason })?;
    let has_uvs = obj.faces.iter().flat_map(|face| &face.corners).any(|corner| obj.uv(corner).is_some());
    let mut mesh = Mesh::default();
    // Vertices are numbered by their first use in an object or group.
    let (mut known, mut group) = (HashMap::new(), 0);
    for face in &obj.faces {
        if face.group != group {
            known.clear();
            group = face.group;
        }
        let mut vertex = |corner: &Corner| {
            *known.entry(*corner).or_insert_with(|| {
                mesh.vertices.push(obj.positions[corner.position]);
                mesh.vertices.len() as u32 - 1
            })
        };
        let vertices: Vec<u32> = face.corners.iter().map(&mut vertex).collect();
        for corners in obj.triangles(face) {
            mesh.triangles.push(corners.map(|corner| vertices[corner]));
            if has_uvs {
                mesh.uvs.push(corners.map(|corner| obj.uv(&face.corners[corner]).unwrap_or_default()));
            }
        }
    }
    Ok(mesh)
}

pub(super) fn colours(
    bytes: &[u8],
    read_file: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<ImportedColours, String> {
    let obj = Obj::parse(bytes)?;
    let mut materials = Vec::new();
    // By name and index of the MTL file.
    let mut ids = BTreeMap::new();
    for (library, path) in obj.libraries.iter().enumerate() {
        for material in read_materials(path, &read_file(path)?)? {
            ids.insert((material.name.clone(), library), materials.len() as u16);
            materials.push(material);
        }
    }
    let plain = plain_id(materials.len())?;
    let id = |used: &MaterialUse| {
        let mut above = ids.range((used.name.clone(), 0)..(used.name.clone(), used.libraries));
        match above.next_back() {
            Some((_, id)) => Ok(*id),
            None if used.name.is_empty() => Ok(plain),
            None => Err(format!(
                "usemtl {}: no MTL file that is named above it (mtllib) has this material; add it there, or correct \
                 usemtl",
                shortened(&used.name)
            )),
        }
    };
    let used = obj.uses.iter().map(id).collect::<Result<Vec<u16>, String>>()?;
    let mut material_ids = Vec::new();
    for face in &obj.faces {
        let id = face.used.map_or(plain, |index| used[index]);
        match materials.get(usize::from(id)).filter(|material| material.image.is_some()) {
            Some(material) if face.corners.iter().any(|corner| obj.uv(corner).is_none()) => {
                return Err(format!(
                    "material {}: map_Kd needs texture coordinates (vt), which a face of it lacks; unwrap the mesh, or \
                     remove map_Kd",
                    shortened(&material.name)
                ));
            }
            // An image has them already.
            None if face.corners.iter().any(|corner| obj.is_coloured[corner.position]) => {
                return Err("it has colours of vertices (v x y z r g b), which are not drawn; store them in materials \
                            or in an image, or remove them"
                    .to_owned());
            }
            _ => material_ids.extend(std::iter::repeat_n(id, obj.triangles(face).len())),
        }
    }
    if materials.is_empty() {
        return Ok(ImportedColours::default());
    }
    let mut materials = materials.into_iter().map(MtlMaterial::import).collect::<Result<Vec<_>, _>>()?;
    materials.push(ImportedMaterial::default());
    Ok(ImportedColours { materials, material_ids })
}

/// A material of an MTL file, of which name, `Kd` and `map_Kd` matter.
#[derive(Default)]
struct MtlMaterial {
    name: String,
    colour: Option<String>,
    image: Option<String>,
}

impl MtlMaterial {
    fn import(self) -> Result<ImportedMaterial, String> {
        let plain = ImportedMaterial::default();
        // Exporters write a grey in addition to an image.
        let albedo = match (&self.image, &self.colour) {
            (Some(_), _) => [1.0; 3],
            (None, None) => plain.albedo,
            (None, Some(words)) => {
                let numbers: Option<Vec<f32>> =
                    words.split_whitespace().map(|word| word.parse().ok()).collect();
                let colour = match numbers.as_deref() {
                    Some(&[grey]) => Some([grey; 3]),
                    Some(&[r, g, b]) => Some([r, g, b]),
                    _ => None,
                };
                let colour = colour.filter(|colour| colour.iter().all(|x| (0.0..=1.0).contains(x)));
                let wrong = || {
                    let (name, words) = (shortened(&self.name), shortened(words));
                    format!("material {name}: Kd is {words:?}; give three shares of 1, or one for a grey")
                };
                colour.ok_or_else(wrong)?.map(f64::from)
            }
        };
        Ok(ImportedMaterial { albedo, image: self.image.map(ImportedImage::File), ..plain })
    }
}

/// Reads the materials of the MTL file `path`.
fn read_materials(path: &str, bytes: &[u8]) -> Result<Vec<MtlMaterial>, String> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let text = decoded(bytes).map_err(|error| format!("{}: {error}", shortened(path)))?;
    for (number, line) in numbered_lines(&text) {
        let (keyword, rest) = keyword_and_rest(&line);
        let kind = keyword.to_ascii_lowercase();
        if !matches!(kind.as_str(), "newmtl" | "kd" | "map_kd") {
            continue;
        }
        if rest.is_empty() {
            return Err(format!("{} line {number}: {keyword} has no value; add it", shortened(path)));
        }
        match (kind.as_str(), materials.last_mut()) {
            ("newmtl", _) => materials.push(MtlMaterial { name: rest.to_owned(), ..MtlMaterial::default() }),
            ("kd", Some(material)) => material.colour = Some(rest.to_owned()),
            (_, Some(material)) => {
                // Options before the name, such as "-bm 1", are not followed.
                let name =
                    if rest.starts_with('-') { rest.split_whitespace().next_back() } else { Some(rest) };
                material.image = name.map(|name| name.trim().to_owned());
            }
            (_, None) => {
                let path = shortened(path);
                return Err(format!("{path} line {number}: {keyword} is above newmtl; move it below"));
            }
        }
    }
    Ok(materials)
}
