//! SurfaceSamples of triangles that pixels show, with everything that their light depends on.

use crate::geometry::Vec3;
use crate::sensing::camera::{
    V3,
    lens::Lens,
    mesh::render_mesh::Lod,
    mesh::texture_chart::TextureChart,
    scene::pose::PosedMesh,
    shade::shading::SurfaceSamples,
    simd::{F8, LANES, STEPS, V8},
};

/// Bits of a triangle's number that count triangles; those above count things.
pub(crate) const TRIANGLE_BITS: u32 = 21;
/// Set in the numbers of triangles of moving things.
pub(crate) const MOVING: u32 = 1 << 31;

/// Number of the thing that a triangle belongs to.
pub(crate) fn thing_of(id: u32) -> usize {
    ((id & !MOVING) >> TRIANGLE_BITS) as usize
}

/// Index of a triangle in its level.
pub(crate) fn triangle_of(id: u32) -> usize {
    (id & ((1 << TRIANGLE_BITS) - 1)) as usize
}

/// A thing at the level and in the place that it is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshInstance<'a> {
    pub level: &'a Lod,
    pub posed: &'a PosedMesh,
    pub facets: &'a [TextureChart],
}

/// PixelRays through pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelRays {
    pub eye: V3,
    /// Through the top left of the image, and its change a pixel to the right and down.
    pub rays: [V3; 3],
    /// Width of a pixel at unit depth.
    pixel: f32,
}

impl PixelRays {
    pub(crate) fn new(lens: &Lens) -> Self {
        Self { eye: lens.eye, rays: lens.rays(), pixel: 1.0 / lens.focal }
    }

    /// The ray through (x, y).
    #[inline(always)]
    fn through(&self, x: f32, y: f32) -> Vec3 {
        let [base, right, down] = self.rays.map(|ray| ray.cast::<f64>());
        base + right * f64::from(x) + down * f64::from(y)
    }

    /// z components of unit vectors along the rays through eight pixels from (x, y) on.
    pub(crate) fn up(&self, x: F8, y: F8) -> F8 {
        let [base, right, down] = self.rays.each_ref().map(V8::splat);
        (base + right * x + down * y).unit().z
    }
}

/// A triangle ready to be met by rays.
#[derive(Clone, Copy)]
pub(crate) struct TriangleInterpolator<'a> {
    pub id: u32,
    thing: f32,
    /// For each corner the vector whose product with a ray tells how much that leans to the corner (to be divided by the
    /// sum of all): the volumes that rays span with the opposite edges, which also hold for triangles that reach behind the
    /// camera (Olano & Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997).
    lean: [Vec3; 3],
    /// Corners from the eye, and their normals.
    p: [V3; 3],
    n: [V3; 3],
    /// Albedo, roughness, metalness, openness of the corners.
    looks: [[f32; 6]; 3],
    facet: Option<(&'a TextureChart, [[f32; 2]; 3])>,
}

impl<'a> TriangleInterpolator<'a> {
    pub(crate) fn new(drawn: &MeshInstance<'a>, rays: &PixelRays, id: u32) -> Self {
        let number = triangle_of(id);
        let corners = drawn.level.triangles[number].map(|v| v as usize);
        let p = corners.map(|v| drawn.posed.positions[v] - rays.eye);
        let wide = p.map(|p| p.cast::<f64>());
        let across = [wide[1].cross(&wide[2]), wide[2].cross(&wide[0]), wide[0].cross(&wide[1])];
        let [i, j, k] = corners;
        let (looks, normals) = (&drawn.level.looks, &drawn.posed.normals);
        let facet = drawn.level.facets.get(number).map(|&facet| {
            let place = drawn.level.places[number];
            (&drawn.facets[facet as usize], place)
        });
        Self {
            id,
            thing: thing_of(id) as f32,
            lean: across,
            p,
            n: [normals[i], normals[j], normals[k]],
            looks: [looks[i].numbers(), looks[j].numbers(), looks[k].numbers()],
            facet,
        }
    }

    /// Eight pixels from (x, y) (their middles) to the right, all of which this triangle covers.
    pub(crate) fn row(&self, rays: &PixelRays, x: f32, y: f32) -> SurfaceSamples {
        let [first, right] = [rays.through(x, y), rays.rays[1].cast()];
        let lean =
            self.lean.map(|n| F8::splat(n.dot(&first) as f32) + F8::splat(n.dot(&right) as f32) * STEPS);
        let scale = F8::ONE / (lean[0] + lean[1] + lean[2]);
        let w = lean.map(|l| l * scale);
        let mix3 =
            |of: &[V3; 3]| V8::splat(&of[0]) * w[0] + V8::splat(&of[1]) * w[1] + V8::splat(&of[2]) * w[2];
        let mix = |of: [f32; 3]| F8::splat(of[0]) * w[0] + F8::splat(of[1]) * w[1] + F8::splat(of[2]) * w[2];
        let from_eye = mix3(&self.p);
        let n = mix3(&self.n).unit();
        let look = |i: usize| mix(self.looks.map(|look| look[i]));
        let (albedo, roughness) = match &self.facet {
            Some((facet, at)) => {
                let place = [0, 1].map(|axis| mix(at.map(|a| a[axis])));
                facet.sample(place, footprint(from_eye, n, rays))
            }
            None => (V8 { x: look(0), y: look(1), z: look(2) }, look(3)),
        };
        SurfaceSamples {
            p: from_eye + V8::splat(&rays.eye),
            n,
            albedo,
            roughness,
            metalness: look(4),
            open: look(5),
            thing: F8::splat(self.thing),
        }
    }

    /// Adds the point that the ray through (x, y) meets, or the nearest of the triangle.
    pub(crate) fn put(&self, batch: &mut ShadingBatch<'a>, rays: &PixelRays, x: f32, y: f32) {
        let ray = rays.through(x, y);
        let lean = self.lean.map(|n| n.dot(&ray));
        let sum = lean[0] + lean[1] + lean[2];
        let w = if sum == 0.0 { [1.0 / 3.0; 3] } else { lean.map(|l| (l / sum).max(0.0) as f32) };
        let scale = 1.0 / (w[0] + w[1] + w[2]);
        let w = w.map(|w| w * scale);
        let lane = batch.count;
        let mix3 = |of: &[V3; 3]| of[0] * w[0] + of[1] * w[1] + of[2] * w[2];
        let (p, n) = (mix3(&self.p), mix3(&self.n));
        for axis in 0..3 {
            batch.p[axis][lane] = p[axis];
            batch.n[axis][lane] = n[axis];
        }
        for i in 0..6 {
            batch.looks[i][lane] =
                self.looks[0][i] * w[0] + self.looks[1][i] * w[1] + self.looks[2][i] * w[2];
        }
        batch.thing[lane] = self.thing;
        batch.facets[lane] = self.facet.as_ref().map(|(facet, at)| {
            for (axis, lanes) in batch.place.iter_mut().enumerate() {
                lanes[lane] = at[0][axis] * w[0] + at[1][axis] * w[1] + at[2][axis] * w[2];
            }
            *facet
        });
    }
}

/// A pixel's width on surfaces at `from_eye`: the geometric mean of both directions.
#[inline(always)]
fn footprint(from_eye: V8, n: V8, rays: &PixelRays) -> F8 {
    let distance2 = from_eye.dot(from_eye).fast_max(F8::splat(1e-12));
    let distance = distance2.sqrt();
    let cosine = (n.dot(from_eye).abs() / distance).fast_max(F8::splat(0.05));
    distance * F8::splat(rays.pixel) / cosine.sqrt()
}

/// SurfaceSamples gathered one by one.
#[derive(Clone, Default)]
pub(crate) struct ShadingBatch<'a> {
    pub count: usize,
    /// Pixel of the tile that each belongs to, and its share of it.
    pub pixel: [u32; LANES],
    pub share: [f32; LANES],
    p: [[f32; LANES]; 3],
    n: [[f32; LANES]; 3],
    looks: [[f32; LANES]; 6],
    thing: [f32; LANES],
    place: [[f32; LANES]; 2],
    facets: [Option<&'a TextureChart>; LANES],
}

impl ShadingBatch<'_> {
    /// The points; those beyond `count` are old ones.
    pub(crate) fn points(&self, rays: &PixelRays) -> SurfaceSamples {
        let from_eye = V8::from_arrays(&self.p);
        let n = V8::from_arrays(&self.n).unit();
        let look = |i: usize| F8::new(self.looks[i]);
        let mut points = SurfaceSamples {
            p: from_eye + V8::splat(&rays.eye),
            n,
            albedo: V8 { x: look(0), y: look(1), z: look(2) },
            roughness: look(3),
            metalness: look(4),
            open: look(5),
            thing: F8::new(self.thing),
        };
        let of_lane = |lane: usize| self.facets[lane].map_or(std::ptr::null(), |f| f as *const TextureChart);
        for lane in 0..self.count {
            let Some(facet) = self.facets[lane] else { continue };
            if (0..lane).any(|before| of_lane(before) == of_lane(lane)) {
                continue;
            }
            let own = std::array::from_fn(|other| if of_lane(other) == of_lane(lane) { 1.0 } else { 0.0 });
            let own = F8::new(own).simd_gt(F8::ZERO);
            // Lanes of other things look where this one does.
            let here = |values: &[f32; LANES]| own.select(F8::new(*values), F8::splat(values[lane]));
            let width = footprint(from_eye, n, rays);
            let width = own.select(width, F8::splat(width.to_array()[lane]));
            let (albedo, roughness) = facet.sample([here(&self.place[0]), here(&self.place[1])], width);
            points.albedo = albedo.or(own, points.albedo);
            points.roughness = own.select(roughness, points.roughness);
        }
        points
    }
}
