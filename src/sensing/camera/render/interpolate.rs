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
    barycentric: [V3; 3],
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
        Self {
            id,
            barycentric: barycentric(&corners),
            corners,
            chart: lod
                .chart_ids
                .get(triangle)
                .filter(|_| instance.posed.albedo.is_empty())
                .map(|&chart| &lod.charts[chart as usize]),
        }
    }

    /// Surface points at eight neighbouring pixels, all of which this triangle covers, given the centre of the first.
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
        let first = lens.ray(x, y);
        let weights = self
            .barycentric
            .map(|b| f32x8::splat(b.dot(&first)) + f32x8::splat(b.dot(&lens.right)) * LANE_INDEX);
        let scale = f32x8::ONE / (weights[0] + weights[1] + weights[2]);
        weights.map(|weight| weight * scale)
    }

    /// An attribute at points with these barycentric coordinates.
    #[inline(always)]
    fn attribute(&self, w: &[f32x8; 3], i: usize) -> f32x8 {
        let [a, b, c] = self.corners.map(|corner| f32x8::splat(corner[i]));
        a * w[0] + b * w[1] + c * w[2]
    }

    /// Appends the point where the ray through (x, y) meets the triangle, or the point of the
    /// triangle that appears nearest.
    pub(crate) fn push(&self, batch: &mut ShadingBatch<'a>, x: f32, y: f32) {
        let lane = batch.count;
        (batch.x[lane], batch.y[lane]) = (x, y);
        for (of_batch, own) in batch.barycentric.iter_mut().zip(&self.barycentric) {
            of_batch.iter_mut().zip(own.iter()).for_each(|(lanes, component)| lanes[lane] = *component);
        }
        batch.corners[lane] = self.corners;
        batch.object[lane] = object_index(self.id) as f32;
        batch.charts[lane] = self.chart;
    }
}

/// Barycentric coordinates of the points of eight triangles that appear nearest to (x, y), given the vectors of
/// [`TriangleInterpolator::barycentric`].
fn nearest_weights(barycentric: &[Vec3x8; 3], lens: &Lens, x: f32x8, y: f32x8) -> [f32x8; 3] {
    let axes = [&lens.right, &lens.down].map(Vec3x8::splat);
    let rays = lens.rays(x, y);
    let weights = barycentric.map(|b| b.dot(rays));
    let is_negative = (weights[0] + weights[1] + weights[2]).simd_lt(f32x8::ZERO);
    let mut weights = weights.map(|w| is_negative.select(-w, w));
    let is_beyond = |w: f32x8| w.simd_lt(f32x8::ZERO);
    let is_outside = is_beyond(weights[0]) | is_beyond(weights[1]) | is_beyond(weights[2]);
    if is_outside.any() {
        // In the image, a weight is linear: it vanishes on an edge, and its gradient is normal to that edge.
        let gradients = barycentric.map(|b| {
            let [u, v] = axes.map(|axis| b.dot(axis));
            let [u, v] = [u, v].map(|g| is_negative.select(-g, g));
            EdgeGradient { u, v, squared: (u * u + v * v).fast_max(f32x8::splat(f32::MIN_POSITIVE)) }
        });
        let distance = |i: usize| -weights[i] / gradients[i].squared.sqrt();
        let (mut farthest, mut edge) = (distance(0), f32x8::ZERO);
        let (mut gradient, mut weight) = (gradients[0], weights[0]);
        for i in 1..3 {
            let is_farther = distance(i).simd_gt(farthest);
            farthest = is_farther.select(distance(i), farthest);
            edge = is_farther.select(f32x8::splat(i as f32), edge);
            gradient = EdgeGradient {
                u: is_farther.select(gradients[i].u, gradient.u),
                v: is_farther.select(gradients[i].v, gradient.v),
                squared: is_farther.select(gradients[i].squared, gradient.squared),
            };
            weight = is_farther.select(weights[i], weight);
        }
        let step = weight / gradient.squared;
        for (i, of_edge) in gradients.iter().enumerate() {
            let on_edge = weights[i] - step * (of_edge.u * gradient.u + of_edge.v * gradient.v);
            let on_edge = edge.simd_eq(f32x8::splat(i as f32)).select(f32x8::ZERO, on_edge);
            weights[i] = is_outside.select(on_edge, weights[i]).fast_max(f32x8::ZERO);
        }
    }
    let sum = weights[0] + weights[1] + weights[2];
    let is_flat = !sum.simd_gt(f32x8::ZERO);
    let scale = f32x8::ONE / sum;
    weights.map(|w| is_flat.select(f32x8::splat(1.0 / 3.0), w * scale))
}

/// The gradient of a barycentric coordinate in the image, per pixel.
#[derive(Clone, Copy)]
struct EdgeGradient {
    u: f32x8,
    v: f32x8,
    /// The square of its length.
    squared: f32x8,
}

/// The vectors whose products with a ray are proportional to its barycentric coordinates in the triangle.
fn barycentric(corners: &[[f32; ATTRIBUTES]; 3]) -> [V3; 3] {
    let [a, b, c] = corners.map(|corner| V3::new(corner[0], corner[1], corner[2]));
    // One factor is an edge: products of two corners would lose the digits of a small triangle.
    [b.cross(&(c - b)), c.cross(&(a - c)), a.cross(&(b - a))]
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
    /// Position of each point in the image, pixels.
    x: [f32; LANES],
    y: [f32; LANES],
    /// Of the triangle of each point, as in [`TriangleInterpolator`].
    barycentric: [[[f32; LANES]; 3]; 3],
    corners: [[[f32; ATTRIBUTES]; 3]; LANES],
    object: [f32; LANES],
    charts: [Option<&'a TextureChart>; LANES],
}

impl ShadingBatch<'_> {
    /// Returns the points; lanes from `count` on hold leftovers.
    pub(crate) fn samples(&self, lens: &Lens) -> SurfaceSamples {
        let barycentric = self.barycentric.each_ref().map(Vec3x8::from_arrays);
        let weights = nearest_weights(&barycentric, lens, f32x8::new(self.x), f32x8::new(self.y));
        let weights = weights.map(f32x8::to_array);
        let half = |half: usize, lane: usize| {
            let [a, b, c] = self.corners[lane].map(|corner| f32x8::new(corner.as_chunks().0[half]));
            let [wa, wb, wc] = weights.map(|w| f32x8::splat(w[lane]));
            a * wa + b * wb + c * wc
        };
        let halves = [0, 1].map(|i| f32x8::transpose(std::array::from_fn(|lane| half(i, lane))));
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
            let ray = lens.ray(x, y);
            let mut corner = [0.0; ATTRIBUTES];
            corner[..3].copy_from_slice(ray.as_slice());
            corner
        });
        TriangleInterpolator { id: 0, barycentric: barycentric(&corners), corners, chart: None }
    }

    /// Barycentric coordinates of the point of a triangle that appears nearest to (x, y).
    fn nearest(triangle: &TriangleInterpolator, x: f32, y: f32) -> [f32; 3] {
        let barycentric = triangle.barycentric.each_ref().map(Vec3x8::splat);
        nearest_weights(&barycentric, &lens(), f32x8::splat(x), f32x8::splat(y)).map(|w| w.to_array()[0])
    }

    #[test]
    fn a_pixel_next_to_a_sliver_shows_its_nearest_point_and_not_a_far_corner() {
        // Clamped barycentric coordinates of a point off the middle line belong to a point far along the sliver.
        let corners = [[60.0, 100.0], [160.0, 100.0], [150.0, 100.2]];
        let sliver = triangle(corners);
        for (x, y) in [(100.0, 99.0), (100.0, 101.0), (130.0, 98.0), (80.0, 103.0)] {
            let weights = nearest(&sliver, x, y);
            let at = |axis: usize| (0..3).map(|i| weights[i] * corners[i][axis]).sum::<f32>();
            assert!((at(0) - x).abs() < 0.1, "({x}, {y}): the point shown is at {}", at(0));
            assert!((99.9..=100.3).contains(&at(1)), "({x}, {y}): the point shown is at {}", at(1));
            assert!(weights.iter().all(|w| *w >= 0.0), "{weights:?}");
        }
    }

    #[test]
    fn a_pixel_inside_a_triangle_shows_the_point_that_its_ray_meets() {
        let corners = [[40.0, 40.0], [160.0, 60.0], [90.0, 180.0]];
        let weights = nearest(&triangle(corners), 97.0, 93.0);
        let at = [0, 1].map(|axis| (0..3).map(|i| weights[i] * corners[i][axis]).sum::<f32>());
        assert!((at[0] - 97.0).abs() < 1e-3 && (at[1] - 93.0).abs() < 1e-3, "{at:?}");
    }
}
