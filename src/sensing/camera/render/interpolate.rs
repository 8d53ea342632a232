//! Interpolates the attributes of triangles at the surface points that pixels show.

use std::sync::Arc;

use crate::camera::{
    lens::Lens,
    math::{LANE_INDEX, LANES, V3, Vec3x8, f32x8},
    mesh::{lod::Lod, texture::TextureChart},
    raster::{object_index, triangle_index},
    scene::PosedMesh,
    shade::{
        pattern::{METALNESS, ROUGHNESS, SKY_VISIBILITY},
        shading::SurfaceSamples,
    },
};
use softvt_geometry::Vec3;

/// A mesh at one level of detail, posed in the world.
#[derive(Clone, Debug)]
pub(crate) struct MeshInstance<'a> {
    pub(crate) lod: &'a Lod,
    pub(crate) posed: Arc<PosedMesh>,
}

/// Values that are interpolated over a triangle: position relative to the eye, normal, material, texture coordinates,
/// and two that make two vectors full.
const ATTRIBUTES: usize = 2 * LANES;
/// Index of the first component of the normal.
const NORMAL: usize = 3;
/// Index of the first component of the material.
const MATERIAL: usize = 6;
/// Index of the first texture coordinate.
const UV: usize = 12;

/// Surface points at eight neighbouring pixels.
pub(crate) struct RowSamples {
    pub(crate) points: SurfaceSamples,
    /// Width of a pixel projected onto the surface, m; zero without a texture.
    pub(crate) footprint: f32x8,
}

/// A triangle prepared for interpolation.
#[derive(Clone, Copy)]
pub(crate) struct TriangleInterpolator<'a> {
    pub(crate) id: u32,
    /// Products of a ray with these vectors are proportional to its barycentric coordinates: they are the volumes
    /// that the ray spans with the opposite edges. This also holds for triangles that reach behind the camera (Olano
    /// & Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997).
    barycentric: [Vec3; 3],
    corners: [[f32; ATTRIBUTES]; 3],
    chart: Option<&'a TextureChart>,
}

impl<'a> TriangleInterpolator<'a> {
    pub(crate) fn new(instance: &MeshInstance<'a>, lens: &Lens, id: u32) -> Self {
        let (lod, triangle) = (instance.lod, triangle_index(id));
        let corners: [[f32; ATTRIBUTES]; 3] = std::array::from_fn(|corner| {
            let v = lod.triangles[triangle][corner] as usize;
            let (p, n) = (instance.posed.positions[v] - lens.eye, instance.posed.normals[v]);
            let [r, g, b, roughness, metalness, sky]: [f32; 6] = lod.materials[v].into();
            let [r, g, b] = instance.posed.albedo.get(v).map_or([r, g, b], |albedo| (*albedo).into());
            let [u, v] = lod.uvs.get(triangle).map_or([0.0; 2], |uvs| uvs[corner]);
            [p.x, p.y, p.z, n.x, n.y, n.z, r, g, b, roughness, metalness, sky, u, v, 0.0, 0.0]
        });
        let [a, b, c] = corners.map(|corner| V3::new(corner[0], corner[1], corner[2]).cast::<f64>());
        Self {
            id,
            barycentric: [b.cross(&c), c.cross(&a), a.cross(&b)],
            corners,
            chart: lod
                .chart_ids
                .get(triangle)
                .filter(|_| instance.posed.albedo.is_empty())
                .map(|&chart| &lod.charts[chart as usize]),
        }
    }

    /// Surface points at eight neighbouring pixels, all of which this triangle covers, given the centre of the
    /// first.
    pub(crate) fn row(&self, lens: &Lens, centre: [f32; 2]) -> RowSamples {
        let w = self.row_weights(lens, centre);
        let attribute = |i: usize| self.attribute(&w, i);
        let mut points = surface_samples(attribute, f32x8::splat(object_index(self.id) as f32), lens);
        let mut footprint = f32x8::ZERO;
        if let Some(chart) = self.chart {
            footprint = pixel_footprint(attribute, points.n, lens);
            (points.albedo, points.roughness) = chart.sample([UV, UV + 1].map(attribute), footprint);
        }
        RowSamples { points, footprint }
    }

    /// Diffuse albedo and roughness at the points of [`row`](Self::row), given the width of a pixel there.
    #[inline(always)]
    pub(crate) fn row_material(&self, lens: &Lens, centre: [f32; 2], footprint: f32x8) -> (Vec3x8, f32x8) {
        let w = self.row_weights(lens, centre);
        let attribute = |i: usize| self.attribute(&w, i);
        let (albedo, roughness) = match self.chart {
            Some(chart) => chart.sample([UV, UV + 1].map(attribute), footprint),
            None => (vec3_attribute(attribute, MATERIAL), attribute(MATERIAL + ROUGHNESS)),
        };
        (albedo * (f32x8::ONE - attribute(MATERIAL + METALNESS)), roughness)
    }

    /// True if the specular reflection of the triangle has the colours of a texture, as metals have it.
    pub(crate) fn is_textured_metal(&self) -> bool {
        self.chart.is_some() && self.corners.iter().any(|corner| corner[MATERIAL + METALNESS] > 0.0)
    }

    /// Barycentric coordinates at eight neighbouring pixels; [x, y] is the centre of the first.
    #[inline(always)]
    fn row_weights(&self, lens: &Lens, [x, y]: [f32; 2]) -> [f32x8; 3] {
        let (first, right) = (lens.ray(x, y), lens.right.cast());
        let weights = self
            .barycentric
            .map(|b| f32x8::splat(b.dot(&first) as f32) + f32x8::splat(b.dot(&right) as f32) * LANE_INDEX);
        let scale = f32x8::ONE / (weights[0] + weights[1] + weights[2]);
        weights.map(|weight| weight * scale)
    }

    /// An attribute at points with these barycentric coordinates.
    #[inline(always)]
    fn attribute(&self, w: &[f32x8; 3], i: usize) -> f32x8 {
        let [a, b, c] = self.corners.map(|corner| f32x8::splat(corner[i]));
        a * w[0] + b * w[1] + c * w[2]
    }

    /// Barycentric coordinates of the point of the triangle that appears nearest to (x, y).
    fn nearest_weights(&self, lens: &Lens, x: f32, y: f32) -> [f32; 3] {
        let ray = lens.ray(x, y);
        let mut weights = self.barycentric.map(|b| b.dot(&ray));
        let sign = (weights[0] + weights[1] + weights[2]).signum();
        if weights.iter().any(|w| w * sign < 0.0) {
            // In the image, a weight is linear: it vanishes on an edge, and its gradient is normal to that edge.
            let axes: [Vec3; 2] = [lens.right.cast(), lens.down.cast()];
            let gradients = self.barycentric.map(|b| axes.map(|axis| b.dot(&axis)));
            // A square root rounds alike on every machine; `hypot` does not.
            let length = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
            let distance = |i: usize| -weights[i] * sign / length(gradients[i]).max(f64::MIN_POSITIVE);
            let edge = (1..3).fold(0, |most, i| if distance(i) > distance(most) { i } else { most });
            let [gx, gy] = gradients[edge];
            let step = weights[edge] / (gx * gx + gy * gy).max(f64::MIN_POSITIVE);
            let on_edge = ray - (axes[0] * gx + axes[1] * gy) * step;
            weights = self.barycentric.map(|b| b.dot(&on_edge));
            weights[edge] = 0.0;
        }
        let sum = weights[0] + weights[1] + weights[2];
        let w = if sum == 0.0 { [1.0 / 3.0; 3] } else { weights.map(|w| (w / sum).max(0.0) as f32) };
        let scale = 1.0 / (w[0] + w[1] + w[2]);
        w.map(|w| w * scale)
    }

    /// Appends the point where the ray through (x, y) meets the triangle, or the point of the triangle that appears
    /// nearest.
    pub(crate) fn push(&self, batch: &mut ShadingBatch<'a>, lens: &Lens, x: f32, y: f32) {
        let w = self.nearest_weights(lens, x, y);
        let ([a, b, c], lane) = (&self.corners, batch.count);
        let half = |of: &[f32; ATTRIBUTES], i: usize| f32x8::new(of.as_chunks::<LANES>().0[i]);
        let w = w.map(f32x8::splat);
        batch.attributes[lane] = [0, 1].map(|i| half(a, i) * w[0] + half(b, i) * w[1] + half(c, i) * w[2]);
        batch.object[lane] = object_index(self.id) as f32;
        batch.charts[lane] = self.chart;
    }
}

fn vec3_attribute(attribute: impl Fn(usize) -> f32x8, first: usize) -> Vec3x8 {
    Vec3x8 { x: attribute(first), y: attribute(first + 1), z: attribute(first + 2) }
}

/// Surface points with these attributes, without textures.
#[inline(always)]
fn surface_samples(attribute: impl Fn(usize) -> f32x8 + Copy, object: f32x8, lens: &Lens) -> SurfaceSamples {
    SurfaceSamples {
        p: vec3_attribute(attribute, 0) + Vec3x8::splat(&lens.eye),
        n: vec3_attribute(attribute, NORMAL).normalized(),
        albedo: vec3_attribute(attribute, MATERIAL),
        roughness: attribute(MATERIAL + ROUGHNESS),
        metalness: attribute(MATERIAL + METALNESS),
        sky_visibility: attribute(MATERIAL + SKY_VISIBILITY),
        object,
    }
}

/// Width of a pixel projected onto surfaces of normals `n`, m: the geometric mean over both directions.
#[inline(always)]
fn pixel_footprint(attribute: impl Fn(usize) -> f32x8, n: Vec3x8, lens: &Lens) -> f32x8 {
    let from_eye = vec3_attribute(attribute, 0);
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
    /// The two halves of the attributes of each point.
    attributes: [[f32x8; 2]; LANES],
    object: [f32; LANES],
    charts: [Option<&'a TextureChart>; LANES],
}

impl ShadingBatch<'_> {
    /// Returns the points; lanes from `count` on hold leftovers.
    pub(crate) fn samples(&self, lens: &Lens) -> SurfaceSamples {
        let halves = [0, 1].map(|half| f32x8::transpose(self.attributes.map(|point| point[half])));
        let attribute = |i: usize| halves[i / LANES][i % LANES];
        let mut samples = surface_samples(attribute, f32x8::new(self.object), lens);
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
            let here = |values: f32x8| mask.select(values, f32x8::splat(values.to_array()[lane]));
            let uv = [UV, UV + 1].map(|i| here(attribute(i)));
            let footprint = here(pixel_footprint(attribute, samples.n, lens));
            let (albedo, roughness) = chart.sample(uv, footprint);
            samples.albedo = Vec3x8::select(mask, albedo, samples.albedo);
            samples.roughness = mask.select(roughness, samples.roughness);
        }
        samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_scene::Camera;

    fn lens() -> Lens {
        Lens::new(&Camera { pose: softvt_geometry::Pose::identity(), ..Camera::third_person_table() }, None)
            .expect("a good camera")
    }

    /// A triangle whose corners appear at these pixels, 1 m in front of the camera.
    fn triangle(corners: [[f32; 2]; 3]) -> TriangleInterpolator<'static> {
        let lens = lens();
        let corners = corners.map(|[x, y]| {
            let ray: V3 = lens.ray(x, y).cast();
            let mut corner = [0.0; ATTRIBUTES];
            corner[..3].copy_from_slice(ray.as_slice());
            corner
        });
        let [a, b, c] = corners.map(|corner| V3::new(corner[0], corner[1], corner[2]).cast::<f64>());
        let barycentric = [b.cross(&c), c.cross(&a), a.cross(&b)];
        TriangleInterpolator { id: 0, barycentric, corners, chart: None }
    }

    #[test]
    fn a_pixel_next_to_a_sliver_shows_its_nearest_point_and_not_a_far_corner() {
        // Clamped barycentric coordinates of a point beside the middle are those of a point far along the sliver.
        let corners = [[60.0, 100.0], [160.0, 100.0], [150.0, 100.2]];
        let sliver = triangle(corners);
        for (x, y) in [(100.0, 99.0), (100.0, 101.0), (130.0, 98.0), (80.0, 103.0)] {
            let weights = sliver.nearest_weights(&lens(), x, y);
            let at = |axis: usize| (0..3).map(|i| weights[i] * corners[i][axis]).sum::<f32>();
            assert!((at(0) - x).abs() < 0.1, "({x}, {y}): the point shown is at {}", at(0));
            assert!((99.9..=100.3).contains(&at(1)), "({x}, {y}): the point shown is at {}", at(1));
            assert!(weights.iter().all(|w| *w >= 0.0), "{weights:?}");
        }
    }

    #[test]
    fn a_pixel_inside_a_triangle_shows_the_point_that_its_ray_meets() {
        let corners = [[40.0, 40.0], [160.0, 60.0], [90.0, 180.0]];
        let weights = triangle(corners).nearest_weights(&lens(), 97.0, 93.0);
        let at = [0, 1].map(|axis| (0..3).map(|i| weights[i] * corners[i][axis]).sum::<f32>());
        assert!((at[0] - 97.0).abs() < 1e-3 && (at[1] - 93.0).abs() < 1e-3, "{at:?}");
    }
}
