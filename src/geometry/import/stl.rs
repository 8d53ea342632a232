//! STL, binary and ASCII. The crate `stl_io` reads the first solid of a text only.

use super::{MeshImportError, text};
use crate::{Vec3, mesh::Mesh};

/// Bytes before the triangles of a binary file, the last four of which count them, and of a triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;
/// Bytes of the normal of a triangle, before its corners.
const NORMAL: usize = 12;

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, MeshImportError> {
    // The count of a binary file, less than 2^24, ends in a zero byte, which text does not have.
    let is_text = text::is_utf16(bytes) || !bytes.iter().take(HEADER).any(|byte| *byte == 0);
    let vertices = if is_text {
        read_text(bytes).map_err(|reason| MeshImportError::Unreadable { format: "STL", reason })?
    } else {
        read_binary(bytes)?
    };
    let corners = 0..vertices.len() as u32;
    let triangles = corners.step_by(3).map(|first| [first, first + 1, first + 2]).collect();
    Ok(Mesh { vertices, triangles, uvs: Vec::new() })
}

/// The corners of the triangles of all solids. Normals are ignored.
fn read_text(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    let text = text::decoded(bytes)?.to_ascii_lowercase();
    let mut vertices = Vec::new();
    let mut is_stl = false;
    for (line, number) in text.lines().zip(1..) {
        let mut words = line.split_whitespace().take_while(|word| !word.starts_with(['#', ';', '!', '/']));
        while let Some(word) = words.next() {
            is_stl |= matches!(word, "solid" | "facet" | "vertex");
            match word {
                // A name follows.
                "solid" | "endsolid" => break,
                "vertex" => {
                    let mut next = || words.next()?.parse().ok().filter(|x: &f64| x.is_finite());
                    let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
                        return Err(format!("line {number}: vertex needs three numbers; export it again"));
                    };
                    vertices.push(Vec3::new(x, y, z));
                }
                "endfacet" | "facet" if !vertices.len().is_multiple_of(3) => {
                    return Err(format!(
                        "line {number}: the facet above has not three vertices; export triangles"
                    ));
                }
                _ => {}
            }
        }
    }
    match (is_stl, vertices.len() % 3) {
        (false, _) => Err("it neither begins with \"solid\" nor has the header of a binary file".to_owned()),
        (true, 0) => Ok(vertices),
        _ => Err("it ends within a facet; export it again".to_owned()),
    }
}

/// The corners of the triangles. Writers that do not know their count leave it 0 or too small.
fn read_binary(bytes: &[u8]) -> Result<Vec<Vec3>, MeshImportError> {
    let Some((header, rest)) = bytes.split_first_chunk::<HEADER>() else {
        let reason = "it is shorter than the header of a binary file".to_owned();
        return Err(MeshImportError::Unreadable { format: "STL", reason });
    };
    let count = header.last_chunk().map_or(0, |count| u32::from_le_bytes(*count) as usize);
    let (triangles, left_over) = rest.as_chunks::<TRIANGLE>();
    if count > triangles.len() || count < triangles.len() && !left_over.is_empty() {
        let declared = count.saturating_mul(TRIANGLE).saturating_add(HEADER);
        return Err(MeshImportError::Length { declared, actual: bytes.len() });
    }
    let number = |bytes: &[u8; 4]| f64::from(f32::from_le_bytes(*bytes));
    let corners = triangles.iter().flat_map(|triangle| triangle[NORMAL..].as_chunks().0.as_chunks::<3>().0);
    Ok(corners.map(|corner| Vec3::from(corner.each_ref().map(number))).collect())
}
