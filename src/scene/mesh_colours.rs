//! Colours of a surface that come from a mesh file: its materials and their images.

use std::{fmt, sync::Arc};

use serde::{Serialize, Serializer};
use sha2::{Digest, Sha256};

use super::visual::Visual;
use softvt_common::text::hex;
use softvt_geometry::{
    Vec3,
    shape::{MeshSolid, Shape},
};

/// Colours of the meshes in a shape, by position on its surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshColours {
    /// The shape whose meshes have colours, object frame.
    pub shape: Arc<Shape>,
    /// Materials of its meshes.
    pub meshes: Vec<ColouredMesh>,
}

/// Materials of a mesh.
#[derive(Clone, Debug)]
pub struct ColouredMesh {
    /// The mesh, as part of a shape.
    pub solid: Arc<MeshSolid>,
    /// Index of the material of each triangle of `solid`.
    pub material_ids: Arc<[u16]>,
    /// Materials, by the indices of `material_ids`.
    pub materials: Arc<[MeshMaterial]>,
}

impl PartialEq for ColouredMesh {
    fn eq(&self, other: &Self) -> bool {
        let own = (&self.material_ids, &self.materials);
        Arc::ptr_eq(&self.solid, &other.solid) && own == (&other.material_ids, &other.materials)
    }
}

// The solid is part of the shape.
impl Serialize for ColouredMesh {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&*self.solid.mesh().uvs, &*self.material_ids, &*self.materials).serialize(serializer)
    }
}

/// A material of a mesh file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshMaterial {
    /// Colour, linear RGB, by which that of the image is multiplied.
    pub albedo: [f64; 3],
    /// Image over the texture coordinates of the mesh.
    pub image: Option<Arc<SurfaceImage>>,
}

/// An image on a surface, with smaller copies for the view from afar (a mip map).
pub struct SurfaceImage {
    levels: Vec<Level>,
    sha256: String,
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    /// Linear RGB, rows from the top.
    texels: Vec<[f32; 3]>,
}

impl SurfaceImage {
    /// Largest width and height, pixels.
    pub const MAX_EDGE: u32 = 4096;

    /// Memory of an image of this size, bytes.
    pub fn bytes(width: u32, height: u32) -> usize {
        // The smaller copies add a third.
        width as usize * height as usize * size_of::<[f32; 3]>() * 4 / 3
    }

    /// An image from sRGB bytes, rows from the top. A size that does not fit the number of bytes gives an image of the
    /// rows that are complete.
    pub fn new(width: u32, rgb: &[u8]) -> Self {
        let width = (width as usize).max(1);
        let linear: Vec<f32> = (0..=255_u8).map(decode_srgb).collect();
        let texels: Vec<[f32; 3]> =
            rgb.as_chunks::<3>().0.iter().map(|pixel| pixel.map(|byte| linear[usize::from(byte)])).collect();
        let mut hash = Sha256::new();
        hash.update((width as u64).to_le_bytes());
        hash.update(rgb);
        let mut levels = vec![Level { width, height: texels.len() / width, texels }];
        while let Some(smaller) = levels.last().and_then(Level::halved) {
            levels.push(smaller);
        }
        Self { levels, sha256: hex(&hash.finalize()) }
    }

    /// Colour at texture coordinates (v grows from the bottom of the image, which repeats), averaged over a square of
    /// edge `footprint`, in widths of the image; linear RGB.
    pub fn sample(&self, [u, v]: [f64; 2], footprint: f64) -> [f32; 3] {
        let texels = footprint * self.levels[0].width as f64;
        let level =
            (0..self.levels.len() - 1).take_while(|level| f64::from(2_u32 << level) <= texels).count();
        self.levels[level].bilinear([u, 1.0 - v])
    }
}

impl Level {
    fn halved(&self) -> Option<Self> {
        if self.width < 2 || self.height < 2 {
            return None;
        }
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |at: usize| {
            let (x, y) = (2 * (at % width), 2 * (at / width));
            let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
            let sum = four.map(|(x, y)| self.texels[y * self.width + x]);
            [0, 1, 2].map(|c| 0.25 * sum.iter().map(|texel| texel[c]).sum::<f32>())
        };
        Some(Self { width, height, texels: (0..width * height).map(mean).collect() })
    }

    fn bilinear(&self, [u, v]: [f64; 2]) -> [f32; 3] {
        // Within a tile neighbours end at its border, since most images do not continue on the other side.
        let place = |t: f64, count: usize| {
            let tile = if (0.0..=1.0).contains(&t) { 0.0 } else { t.floor() };
            let at = ((t - tile) * count as f64 - 0.5).clamp(0.0, (count - 1) as f64);
            let first = at.floor();
            ([first as usize, (first as usize + 1).min(count - 1)], (at - first) as f32)
        };
        let ((x, right), (y, down)) = (place(u, self.width), place(v, self.height));
        let texel = |x: usize, y: usize| self.texels[y * self.width + x];
        [0, 1, 2].map(|c| {
            let row = |y: usize| texel(x[0], y)[c] * (1.0 - right) + texel(x[1], y)[c] * right;
            row(y[0]) * (1.0 - down) + row(y[1]) * down
        })
    }
}

/// Linear value of a byte in sRGB (IEC 61966-2-1).
fn decode_srgb(byte: u8) -> f32 {
    let value = f64::from(byte) / 255.0;
    let linear = if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
    linear as f32
}

impl MeshColours {
    /// Colour at a point on or near the surface, averaged over about `spacing` (m) along it, linear RGB. Where the
    /// surface is not that of a coloured mesh, it is the colour of a [`Visual`] by default.
    pub fn at(&self, p_o: &Vec3, spacing: f64) -> [f32; 3] {
        self.of_mesh(p_o, spacing).unwrap_or_else(|| Visual::default().albedo.map(|x| x as f32))
    }

    fn of_mesh(&self, p_o: &Vec3, spacing: f64) -> Option<[f32; 3]> {
        let found = self.shape.mesh_point(p_o)?;
        let mesh = self.meshes.iter().find(|mesh| std::ptr::eq(&*mesh.solid, found.solid))?;
        let id = mesh.material_ids.get(found.triangle)?;
        let MeshMaterial { albedo, image } = mesh.materials.get(usize::from(*id))?;
        let albedo = albedo.map(|x| x as f32);
        let (Some(image), Some(uv)) = (image, found.uv) else { return Some(albedo) };
        let [r, g, b] = image.sample(uv, spacing * found.uv_per_m);
        Some([r * albedo[0], g * albedo[1], b * albedo[2]])
    }
}

impl fmt::Debug for SurfaceImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SurfaceImage({} × {})", self.levels[0].width, self.levels[0].height)
    }
}

impl PartialEq for SurfaceImage {
    fn eq(&self, other: &Self) -> bool {
        self.sha256 == other.sha256
    }
}

impl Serialize for SurfaceImage {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.sha256)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::mesh::Mesh;

    #[test]
    fn parts_without_colours_are_grey() {
        let mesh = Mesh {
            vertices: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Into::into).to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            uvs: Vec::new(),
        };
        let Ok(Shape::Mesh(solid)) = Shape::from_mesh(mesh) else { panic!("a solid") };
        let far = Shape::Sphere { radius: 0.1 }.translated(Vec3::new(5.0, 0.0, 0.0));
        let shape = Arc::new(Shape::Mesh(solid.clone()).union(far));
        let materials = vec![MeshMaterial { albedo: [1.0, 0.5, 0.0], image: None }].into();
        let mesh = ColouredMesh { solid, material_ids: vec![0; 4].into(), materials };
        let colours = MeshColours { shape, meshes: vec![mesh] };
        assert_eq!(colours.at(&Vec3::new(0.2, 0.2, 0.0), 1e-3), [1.0, 0.5, 0.0]);
        assert_eq!(colours.at(&Vec3::new(5.0, 0.0, 0.1), 1e-3), [0.7; 3], "the sphere");
    }

    #[test]
    fn images_are_sampled_between_texels_repeat_and_are_averaged_from_afar() {
        // Left black and right white above, all white below.
        let rgb: Vec<u8> = [0, 255, 255, 255].into_iter().flat_map(|grey| [grey; 3]).collect();
        let image = SurfaceImage::new(2, &rgb);
        let grey = |uv, footprint| image.sample(uv, footprint)[0];
        assert_eq!(
            (grey([0.25, 0.75], 0.1), grey([0.75, 0.75], 0.1), grey([0.25, 0.25], 0.1)),
            (0.0, 1.0, 1.0)
        );
        assert_eq!(grey([-0.75, 2.75], 0.1), 0.0, "it repeats");
        assert!((grey([0.5, 0.75], 0.1) - 0.5).abs() < 1e-6);
        assert!((grey([0.25, 0.75], 5.0) - 0.75).abs() < 1e-6, "the mean of all");
        assert!((decode_srgb(188) - 0.5).abs() < 0.01);
    }
}
