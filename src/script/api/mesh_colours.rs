//! Colours of mesh files: their materials and images, as colours of a shape.

use std::{io::Cursor, sync::Arc};

use image::{ImageReader, RgbImage, imageops::FilterType};
use mlua::Lua;

use crate::vm::memory_budget::{Reservation, reserve};
use softvt_geometry::{
    import::{ImportedColours, ImportedImage, ImportedMaterial},
    shape::{MeshSolid, Shape},
};
use softvt_scene::{ColouredMesh, MeshColours, MeshMaterial, SurfaceImage, Visual};

/// Colours of a mesh file, for an asset without visuals of its own.
#[derive(Debug)]
pub(crate) struct FileColours {
    mesh: ColouredMesh,
    roughness: Option<f64>,
    metalness: Option<f64>,
    _reserved: Reservation,
}

impl FileColours {
    /// The colours of a solid from what its file states; `None` without materials. `read` returns a file by its path
    /// from the folder of the mesh file.
    ///
    /// # Errors
    /// An image cannot be read, or does not fit into memory; the message names it.
    pub(crate) fn new(
        lua: &Lua,
        imported: ImportedColours,
        solid: &Arc<MeshSolid>,
        read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Option<Self>, String> {
        let ImportedColours { materials, material_ids } = imported;
        let Some(first) = materials.first() else { return Ok(None) };
        let (roughness, metalness) = (first.roughness, first.metalness);
        let mut bytes = 0;
        let materials = materials.iter().map(|material| {
            let image = image_of(material, read)?.map(|image| {
                bytes += SurfaceImage::bytes(image.width(), image.height());
                Arc::new(SurfaceImage::new(image.width(), image.as_raw()))
            });
            Ok(MeshMaterial { albedo: material.albedo, image })
        });
        let materials: Arc<[MeshMaterial]> = materials.collect::<Result<Vec<_>, String>>()?.into();
        let ids = solid.sources().iter().map(|triangle| material_ids.get(*triangle as usize).copied());
        let material_ids: Arc<[u16]> = ids.map(Option::unwrap_or_default).collect();
        let mesh = ColouredMesh { solid: solid.clone(), material_ids, materials };
        let reserved = reserve(lua, bytes).map_err(|error| error.to_string())?;
        Ok(Some(Self { mesh, roughness, metalness, _reserved: reserved }))
    }

    /// The visual of a shape that contains the meshes of `colours`.
    pub(crate) fn visual(colours: &[Arc<Self>], shape: &Shape) -> Option<Visual> {
        let first = colours.first()?;
        let plain = Visual::default();
        let meshes = colours.iter().map(|colours| colours.mesh.clone()).collect();
        Some(Visual {
            albedo: [1.0; 3],
            roughness: first.roughness.unwrap_or(plain.roughness),
            metalness: first.metalness.unwrap_or(plain.metalness),
            colours: Some(MeshColours { shape: Arc::new(shape.clone()), meshes }),
            ..plain
        })
    }
}

/// Largest width and height of an image that is kept, pixels: surfaces are drawn with fewer texels. Larger ones are
/// scaled down.
const KEPT_EDGE: u32 = 2048;

/// Decodes the image of a material.
fn image_of(
    material: &ImportedMaterial,
    read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<Option<RgbImage>, String> {
    let (name, bytes) = match &material.image {
        None => return Ok(None),
        Some(ImportedImage::File(path)) => (path.as_str(), read(path)?),
        Some(ImportedImage::Bytes(bytes)) => ("its image", bytes.clone()),
    };
    let unreadable = |error: &dyn std::fmt::Display| format!("{name}: {error}; give a PNG or JPEG file");
    let reader = || {
        let reader = ImageReader::new(Cursor::new(&bytes)).with_guessed_format();
        reader.map_err(|error| unreadable(&error))
    };
    let (width, height) = reader()?.into_dimensions().map_err(|error| unreadable(&error))?;
    let most = SurfaceImage::MAX_EDGE;
    if width > most || height > most {
        return Err(format!(
            "{name}: {width} × {height} pixels; at most {most} × {most} are drawn, scale it down"
        ));
    }
    let decoded = reader()?.decode().map_err(|error| unreadable(&error))?;
    let kept = match width.max(height) > KEPT_EDGE {
        true => decoded.resize(KEPT_EDGE, KEPT_EDGE, FilterType::Triangle),
        false => decoded,
    };
    Ok(Some(kept.to_rgb8()))
}
