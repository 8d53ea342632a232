//! Colours of mesh files: their materials and images, as colours of a shape.

use std::{
    collections::BTreeMap,
    io::{self, Cursor},
    sync::Arc,
};

use image::{ImageReader, Limits};
use softvt_common::{disk_cache::DiskCache, text::shortened};
use softvt_geometry::{
    import::{ImportedColours, ImportedImage},
    shape::{MeshSolid, Shape},
};
use softvt_scene::{ColouredMesh, MeshColours, MeshMaterial, SurfaceImage, Visual};
use softvt_sensing::camera::resize;

/// Colours of a mesh file, for an asset without visuals of its own.
#[derive(Debug)]
pub(crate) struct FileColours {
    mesh: ColouredMesh,
    roughness: Option<f64>,
    metalness: Option<f64>,
    /// Memory of its images, bytes.
    pub bytes: usize,
}

impl FileColours {
    /// The colours of a solid from what its file states; `None` without materials. Roughness and metalness are those of
    /// the material of the largest area. `read` returns a file by its path from the folder of the mesh file.
    pub(crate) fn new(
        imported: ImportedColours,
        solid: &Arc<MeshSolid>,
        read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Option<Self>, String> {
        let ImportedColours { materials, material_ids } = imported;
        if materials.is_empty() {
            return Ok(None);
        }
        let ids = solid.sources().iter().map(|triangle| material_ids.get(*triangle as usize).copied());
        let material_ids: Arc<[u16]> = ids.map(Option::unwrap_or_default).collect();
        let areas = material_areas(solid, &material_ids);
        let by_area = areas.iter().rev().max_by(|a, b| a.1.total_cmp(b.1));
        let main = by_area.and_then(|(id, _)| materials.get(usize::from(*id)));
        let (roughness, metalness) = main.map_or((None, None), |main| (main.roughness, main.metalness));
        let mut images = Images { read, decoded: BTreeMap::new(), bytes: 0 };
        let materials = materials.iter().enumerate().map(|(id, material)| {
            let is_used = u16::try_from(id).is_ok_and(|id| areas.contains_key(&id));
            let image =
                material.image.as_ref().filter(|_| is_used).map(|image| images.of(image)).transpose()?;
            Ok(MeshMaterial { albedo: material.albedo, image })
        });
        let materials: Arc<[MeshMaterial]> = materials.collect::<Result<Vec<_>, String>>()?.into();
        let mesh = ColouredMesh { solid: solid.clone(), material_ids, materials };
        Ok(Some(Self { mesh, roughness, metalness, bytes: images.bytes }))
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

/// Area of each material that a triangle of a solid has, m².
fn material_areas(solid: &MeshSolid, material_ids: &[u16]) -> BTreeMap<u16, f64> {
    let mesh = solid.mesh();
    let mut areas = BTreeMap::new();
    for (triangle, id) in mesh.triangles.iter().zip(material_ids) {
        *areas.entry(*id).or_default() += mesh.triangle_area(triangle);
    }
    areas
}

/// Longest path of a file that a mesh file names, bytes.
const MAX_PATH: usize = 255;
/// Longest path in a message, characters.
const SHOWN_PATH: usize = 80;

/// The path of the file `name`, which `mesh_file` states as a path from its own folder.
pub(crate) fn path_beside(mesh_file: &str, name: &str) -> Result<String, String> {
    let shown = shortened(name, SHOWN_PATH);
    let name = name.replace('\\', "/");
    let refused = |reason: &str| {
        Err(format!("{shown:?} {reason}; name the file by its path from the folder of the mesh file"))
    };
    let is_drive = |name: &str| name.as_bytes().get(1) == Some(&b':');
    if name.starts_with('/') || is_drive(&name) {
        return refused("is an absolute path");
    }
    if name.contains(':') {
        return refused("is an address");
    }
    if name.len() > MAX_PATH {
        return Err(format!("{shown:?} is a path of more than {MAX_PATH} bytes; rename the file"));
    }
    let folder = mesh_file.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut parts = Vec::new();
    for part in folder.split('/').chain(name.split('/')) {
        match part {
            "" | "." => {}
            ".." if parts.pop().is_none() => return refused("leads out of the project"),
            ".." => {}
            _ => parts.push(part),
        }
    }
    Ok(parts.join("/"))
}

/// Largest width and height of an image that is kept, pixels: surfaces are drawn with fewer texels. Larger
/// ones are scaled down.
const KEPT_EDGE: u32 = 2048;

/// Memory of the images of one mesh file, bytes.
const MAX_IMAGE_BYTES: usize = 256 << 20;

/// Memory for the metadata of an image, bytes. A larger colour profile is ignored.
const MAX_METADATA_BYTES: u64 = 8 << 20;

/// A reader of an image of up to so many pixels, of 8 bytes at most.
fn reader(bytes: &[u8], pixels: u64) -> io::Result<ImageReader<Cursor<&[u8]>>> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(8 * pixels + MAX_METADATA_BYTES);
    reader.limits(limits);
    Ok(reader)
}

/// The images of a mesh file, each decoded once.
struct Images<'a> {
    read: &'a dyn Fn(&str) -> Result<Vec<u8>, String>,
    /// By path, or by the address of their bytes.
    decoded: BTreeMap<(&'a str, *const u8), Arc<SurfaceImage>>,
    /// Memory of those so far.
    bytes: usize,
}

impl<'a> Images<'a> {
    fn of(&mut self, image: &'a ImportedImage) -> Result<Arc<SurfaceImage>, String> {
        let key = match image {
            ImportedImage::File(path) => (path.as_str(), std::ptr::null()),
            ImportedImage::Bytes(bytes) => ("", bytes.as_ptr()),
        };
        if let Some(known) = self.decoded.get(&key) {
            return Ok(known.clone());
        }
        let decoded = match image {
            ImportedImage::File(path) => self.decode(&shortened(path, SHOWN_PATH), &(self.read)(path)?)?,
            ImportedImage::Bytes(bytes) => self.decode("an image in the file", bytes)?,
        };
        Ok(self.decoded.entry(key).or_insert(Arc::new(decoded)).clone())
    }

    fn decode(&mut self, name: &str, bytes: &[u8]) -> Result<SurfaceImage, String> {
        let unreadable = |error: &dyn std::fmt::Display| format!("{name}: {error}; give a PNG or JPEG file");
        let reader = |pixels: u64| reader(bytes, pixels).map_err(|error| unreadable(&error));
        let (width, height) = reader(0)?.into_dimensions().map_err(|error| unreadable(&error))?;
        let most = SurfaceImage::MAX_EDGE;
        if width > most || height > most {
            return Err(format!(
                "{name}: {width} × {height} pixels; at most {most} × {most} are drawn, scale it down"
            ));
        }
        // Before it is decoded, which takes little more for one image at a time.
        let longest = width.max(height);
        let kept = |edge: u32| (edge * KEPT_EDGE).div_ceil(longest.max(KEPT_EDGE));
        self.bytes += SurfaceImage::bytes(kept(width), kept(height));
        if self.bytes > MAX_IMAGE_BYTES {
            let limit = MAX_IMAGE_BYTES >> 20;
            return Err(format!(
                "{name}: the images of the file take more than {limit} MiB; scale them down"
            ));
        }
        let pixels = u64::from(width) * u64::from(height);
        let decode = || -> Result<_, String> {
            Ok(reader(pixels)?.decode().map_err(|error| unreadable(&error))?.into_rgb8())
        };
        if longest <= KEPT_EDGE {
            return Ok(SurfaceImage::new(width, &decode()?));
        }
        let (width, height) = (kept(width), kept(height));
        let reduce = || Ok::<_, String>(resize(&decode()?, width, height).into_raw());
        let pixels = DiskCache::default().get("image", &bytes, reduce)?;
        Ok(SurfaceImage::new(width, &pixels))
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use image::{
        ExtendedColorType, ImageDecoder, ImageEncoder, ImageFormat, RgbImage, codecs::png::PngEncoder,
    };

    use super::*;
    use softvt_geometry::{import::ImportedMaterial, mesh::Mesh};

    /// A tetrahedron, whose last face is the largest.
    fn tetrahedron() -> Arc<MeshSolid> {
        let mesh = Mesh {
            vertices: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Into::into).to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            uvs: Vec::new(),
        };
        let Ok(Shape::Mesh(solid)) = Shape::from_mesh(mesh) else { panic!("a solid") };
        solid
    }

    fn png(edge: u32) -> Vec<u8> {
        let mut png = Cursor::new(Vec::new());
        RgbImage::new(edge, edge).write_to(&mut png, ImageFormat::Png).expect("a PNG file");
        png.into_inner()
    }

    fn textured(path: &str, roughness: f64) -> ImportedMaterial {
        let image = Some(ImportedImage::File(path.to_owned()));
        ImportedMaterial { image, roughness: Some(roughness), ..ImportedMaterial::default() }
    }

    #[test]
    fn a_colour_profile_is_unpacked_within_a_limit() {
        let profile = |size: usize| {
            let mut png = Vec::new();
            let mut encoder = PngEncoder::new(&mut png);
            encoder.set_icc_profile(vec![0; size]).expect("PNG has profiles");
            encoder.write_image(&[0; 12], 2, 2, ExtendedColorType::Rgb8).expect("a PNG file");
            let mut decoder = reader(&png, 4).expect("PNG").into_decoder().expect("a decoder");
            decoder.icc_profile().expect("read").map(|profile| profile.len())
        };
        assert_eq!([1000, 64 << 20].map(profile), [Some(1000), None]);
    }

    #[test]
    fn an_image_is_decoded_once_and_only_if_a_triangle_has_it() {
        let materials = vec![textured("unused.png", 0.1), textured("a.png", 0.2), textured("a.png", 0.3)];
        let imported = ImportedColours { materials, material_ids: vec![1, 1, 1, 2] };
        let requests = RefCell::new(Vec::new());
        let read = |path: &str| {
            requests.borrow_mut().push(path.to_owned());
            Ok(png(4))
        };
        let colours = FileColours::new(imported, &tetrahedron(), &read).expect("an image");
        let FileColours { mesh, roughness, .. } = colours.expect("materials");
        assert_eq!(requests.into_inner(), ["a.png"]);
        let [None, Some(a), Some(b)] = [0, 1, 2].map(|id| mesh.materials[id].image.clone()) else {
            panic!("{:?}", mesh.materials)
        };
        assert!(Arc::ptr_eq(&a, &b));
        assert_eq!(roughness, Some(0.2), "three faces of area 1/2 each against one of 0.87");
    }

    #[test]
    fn a_large_image_is_kept_at_the_largest_edge() {
        let imported = |edge| {
            let read = move |_: &str| Ok(png(edge));
            let imported =
                ImportedColours { materials: vec![textured("a.png", 0.5)], material_ids: vec![0; 4] };
            let colours = FileColours::new(imported, &tetrahedron(), &read).expect("an image");
            format!("{:?}", colours.expect("materials").mesh.materials[0].image)
        };
        for (edge, kept) in [(KEPT_EDGE, KEPT_EDGE), (KEPT_EDGE + 1, KEPT_EDGE), (4096, KEPT_EDGE)] {
            assert_eq!(imported(edge), format!("Some(SurfaceImage({kept} × {kept}))"));
        }
    }

    #[test]
    fn the_roughness_is_that_of_the_largest_area() {
        let imported = |material_ids| ImportedColours {
            materials: [0.1, 0.2, 0.3]
                .map(|roughness| ImportedMaterial {
                    roughness: Some(roughness),
                    ..ImportedMaterial::default()
                })
                .to_vec(),
            material_ids,
        };
        let read = |path: &str| Err(path.to_owned());
        let roughness = |ids: [u16; 4]| {
            let colours = FileColours::new(imported(ids.to_vec()), &tetrahedron(), &read);
            colours.expect("no image").expect("materials").roughness
        };
        assert_eq!(roughness([1, 1, 2, 2]), Some(0.3));
        assert_eq!(roughness([1, 0, 2, 2]), Some(0.3));
        assert_eq!(roughness([2, 1, 2, 1]), Some(0.2), "the largest face");
    }

    #[test]
    fn an_image_that_cannot_be_read_or_fit_is_refused() {
        let one = ImportedColours { materials: vec![textured("a.png", 0.5)], material_ids: vec![0; 4] };
        // Its pixels are missing.
        let cut = |_: &str| Ok(png(64).into_iter().take(60).collect());
        let error = FileColours::new(one, &tetrahedron(), &cut).expect_err("cut off");
        assert!(error.starts_with("a.png: ") && error.ends_with("give a PNG or JPEG file"), "{error}");
        let mut images = Images { read: &cut, decoded: BTreeMap::new(), bytes: MAX_IMAGE_BYTES - 1000 };
        let error = images.decode("b.png", &png(64)).expect_err("full");
        assert_eq!(error, "b.png: the images of the file take more than 256 MiB; scale them down");
    }
}
