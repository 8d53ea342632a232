//! Interpolates the attributes of triangles at the surface points that pixels show.

use std::sync::Arc;

use crate::{
    geometry::Vec3,
    sensing::camera::{
        lens::Lens,
        math::{LANE_INDEX, LANES, V3, Vec3x8, f32x8},
        mesh::{lod::Lod, texture::TextureChart},
        raster::{object_index, triangle_index},
        scene::PosedMesh,
        shade::{
            pattern::{METALNESS, MaterialSample, SKY_VISIBILITY},
            shading::SurfaceSamples,
        },
    },
};

/// A mesh at one level of detail, posed in the world.
#[derive(Clone, Debug)]
pub(crate) struct MeshInstance<'a> {
    pub(crate) lod: &'a Lod,
    pub(crate) charts: &'a [TextureChart],
    pub(crate) posed: Arc<PosedMesh>,
}

/// A triangle prepared for interpolation.
#[derive(Clone, Copy)]
pub(crate) struct TriangleInterpolator<'a> {
    pub(crate) id: u32,
    object: f32,
    /// Products of a ray with these vectors are proportional to its barycentric coordinates: they are the volumes
    /// that the ray spans with the opposite edges. This also holds for triangles that reach behind the camera (Olano
    /// & Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997).
    barycentric: [Vec3; 3],
    /// Corners relative to the eye.
    p: [V3; 3],
    n: [V3; 3],
    materials: [MaterialSample; 3],
    texture: Option<CornerUvs<'a>>,
}

/// The chart of a triangle, and its corners in it.
#[derive(Clone, Copy)]
struct CornerUvs<'a> {
    chart: &'a TextureChart,
    uvs: [[f32; 2]; 3],
}

impl<'a> TriangleInterpolator<'a> {
    pub(crate) fn new(instance: &MeshInstance<'a>, lens: &Lens, id: u32) -> Self {
        let triangle = triangle_index(id);
        let corners = instance.lod.triangles[triangle].map(|v| v as usize);
        let p = corners.map(|v| instance.posed.positions[v] - lens.eye);
        let [a, b, c] = p.map(|p| p.cast::<f64>());
        let texture = instance.lod.chart_ids.get(triangle).map(|&chart| CornerUvs {
            chart: &instance.charts[chart as usize],
            uvs: instance.lod.uvs[triangle],
        });
        Self {
            id,
            object: object_index(id) as f32,
            barycentric: [b.cross(&c), c.cross(&a), a.cross(&b)],
            p,
            n: corners.map(|v| instance.posed.normals[v]),
            materials: corners.map(|v| instance.lod.materials[v]),
            texture,
        }
    }

    /// Surface points at eight pixels in a row, all of which this triangle covers; (x, y) is the centre of the first.
    pub(crate) fn row(&self, lens: &Lens, x: f32, y: f32) -> SurfaceSamples {
        let (first, right) = (lens.ray(x, y), lens.right.cast());
        let weights = self
            .barycentric
            .map(|b| f32x8::splat(b.dot(&first) as f32) + f32x8::splat(b.dot(&right) as f32) * LANE_INDEX);
        let scale = f32x8::ONE / (weights[0] + weights[1] + weights[2]);
        let w = weights.map(|weight| weight * scale);
        let mix3 = |of: &[V3; 3]| {
            Vec3x8::splat(&of[0]) * w[0] + Vec3x8::splat(&of[1]) * w[1] + Vec3x8::splat(&of[2]) * w[2]
        };
        let mix = |of: [f32; 3]| {
            f32x8::splat(of[0]) * w[0] + f32x8::splat(of[1]) * w[1] + f32x8::splat(of[2]) * w[2]
        };
        let from_eye = mix3(&self.p);
        let n = mix3(&self.n).normalized();
        let component = |i: usize| mix(self.materials.map(|material| material[i]));
        let (albedo, roughness) = match &self.texture {
            Some(CornerUvs { chart, uvs }) => {
                let uv = [0, 1].map(|axis| mix(uvs.map(|uv| uv[axis])));
                chart.sample(uv, pixel_footprint(from_eye, n, lens))
            }
            None => (Vec3x8 { x: component(0), y: component(1), z: component(2) }, component(3)),
        };
        SurfaceSamples {
            p: from_eye + Vec3x8::splat(&lens.eye),
            n,
            albedo,
            roughness,
            metalness: component(METALNESS),
            sky_visibility: component(SKY_VISIBILITY),
            object: f32x8::splat(self.object),
        }
    }

    /// Appends the point where the ray through (x, y) meets the triangle, or the nearest point of the triangle.
    pub(crate) fn push(&self, batch: &mut ShadingBatch<'a>, lens: &Lens, x: f32, y: f32) {
        let ray = lens.ray(x, y);
        let weights = self.barycentric.map(|b| b.dot(&ray));
        let sum = weights[0] + weights[1] + weights[2];
        let w = if sum == 0.0 { [1.0 / 3.0; 3] } else { weights.map(|w| (w / sum).max(0.0) as f32) };
        let scale = 1.0 / (w[0] + w[1] + w[2]);
        let w = w.map(|w| w * scale);
        let lane = batch.count;
        let mix3 = |of: &[V3; 3]| of[0] * w[0] + of[1] * w[1] + of[2] * w[2];
        let (p, n) = (mix3(&self.p), mix3(&self.n));
        for axis in 0..3 {
            batch.p[axis][lane] = p[axis];
            batch.n[axis][lane] = n[axis];
        }
        let [a, b, c] = &self.materials;
        for i in 0..a.len() {
            batch.materials[i][lane] = a[i] * w[0] + b[i] * w[1] + c[i] * w[2];
        }
        batch.object[lane] = self.object;
        batch.charts[lane] = self.texture.as_ref().map(|CornerUvs { chart, uvs }| {
            for (axis, lanes) in batch.uv.iter_mut().enumerate() {
                lanes[lane] = uvs[0][axis] * w[0] + uvs[1][axis] * w[1] + uvs[2][axis] * w[2];
            }
            *chart
        });
    }
}

/// Width of a pixel projected onto surfaces at `from_eye`, m: the geometric mean over both directions.
#[inline(always)]
fn pixel_footprint(from_eye: Vec3x8, n: Vec3x8, lens: &Lens) -> f32x8 {
    let distance2 = from_eye.dot(from_eye).fast_max(f32x8::splat(1e-12));
    let distance = distance2.sqrt();
    let cosine = (n.dot(from_eye).abs() / distance).fast_max(f32x8::splat(0.05));
    distance * f32x8::splat(1.0 / lens.focal) / cosine.sqrt()
}

/// Surface points of unrelated pixels, collected until eight can be shaded together.
#[derive(Clone, Default)]
pub(crate) struct ShadingBatch<'a> {
    pub(crate) count: usize,
    /// Pixel of the tile that each point contributes to.
    pub(crate) pixel: [u32; LANES],
    /// Fraction of the pixel that each point accounts for.
    pub(crate) share: [f32; LANES],
    /// Relative to the eye.
    p: [[f32; LANES]; 3],
    n: [[f32; LANES]; 3],
    materials: [[f32; LANES]; 6],
    object: [f32; LANES],
    uv: [[f32; LANES]; 2],
    charts: [Option<&'a TextureChart>; LANES],
}

impl ShadingBatch<'_> {
    /// Returns the points; lanes from `count` on hold leftovers.
    pub(crate) fn samples(&self, lens: &Lens) -> SurfaceSamples {
        let from_eye = Vec3x8::from_arrays(&self.p);
        let n = Vec3x8::from_arrays(&self.n).normalized();
        let component = |i: usize| f32x8::new(self.materials[i]);
        let mut samples = SurfaceSamples {
            p: from_eye + Vec3x8::splat(&lens.eye),
            n,
            albedo: Vec3x8 { x: component(0), y: component(1), z: component(2) },
            roughness: component(3),
            metalness: component(METALNESS),
            sky_visibility: component(SKY_VISIBILITY),
            object: f32x8::new(self.object),
        };
        let chart_of = |lane: usize| self.charts[lane].map_or(std::ptr::null(), |c| c as *const TextureChart);
        for lane in 0..self.count {
            let Some(chart) = self.charts[lane] else { continue };
            if (0..lane).any(|before| chart_of(before) == chart_of(lane)) {
                continue;
            }
            let shares_chart =
                std::array::from_fn(|other| if chart_of(other) == chart_of(lane) { 1.0 } else { 0.0 });
            let mask = f32x8::new(shares_chart).simd_gt(f32x8::ZERO);
            // Other lanes repeat this one, so that they read no other mip levels.
            let here = |values: &[f32; LANES]| mask.select(f32x8::new(*values), f32x8::splat(values[lane]));
            let footprint = pixel_footprint(from_eye, n, lens);
            let footprint = mask.select(footprint, f32x8::splat(footprint.to_array()[lane]));
            let (albedo, roughness) = chart.sample([here(&self.uv[0]), here(&self.uv[1])], footprint);
            samples.albedo = Vec3x8::select(mask, albedo, samples.albedo);
            samples.roughness = mask.select(roughness, samples.roughness);
        }
        samples
    }
}
