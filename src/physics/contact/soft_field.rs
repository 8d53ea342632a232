//! The rest field of a soft body, read through its deformation by the samples of another.
//!
//! A point of space is mapped back into the deformed voxel grid (the inverse of the trilinear map, by Newton's method,
//! walking from voxel to voxel), the field is read at the rest point, and gap and normal are pushed forward with the
//! deformation gradient F there: n ∝ F⁻ᵀ n₀ and φ = φ₀ / |F⁻ᵀ n₀| (normals and level sets under a map: Bonet & Wood,
//! Nonlinear Continuum Mechanics for Finite Element Analysis, 2008, §4.10).

use super::collider::Surface;
use crate::{
    geometry::{Aabb, Mat3, Vec3, hex8, voxel::Embedding},
    physics::fem::SoftBody,
};

/// How far outside of a voxel, in its edges, the trilinear map is still used; farther away it goes on linearly.
const BEYOND: f64 = 0.3;
/// Voxels that a search may walk through.
const MOST_WALKS: usize = 64;
/// Newton iterations in one voxel; undeformed it takes one.
const MOST_NEWTON: usize = 8;

/// A soft body's surface as it is now.
pub struct SoftField<'a> {
    body: &'a SoftBody,
    surface: &'a dyn Surface,
    centre_w: Vec3,
    centre_o: Vec3,
}

/// What a sample feels of a soft body.
#[derive(Clone, Copy, Debug)]
pub struct Felt {
    /// Gap, m; negative inside.
    pub gap: f64,
    /// Outward normal, world.
    pub normal: Vec3,
    /// Share of the sample's patch that the surface covers.
    pub coverage: f64,
    /// The element that carries the place.
    pub element: u32,
    /// Weights of its eight nodes.
    pub weights: [f64; 8],
    /// The place of the surface under the sample, at rest, object frame.
    pub surface_o: Vec3,
    /// F⁻¹: takes small vectors of the world to rest.
    pub pull: Mat3,
}

/// Where a point of the world is in the body.
struct Place {
    at: Embedding,
    rest: Vec3,
    pull: Mat3,
}

impl<'a> SoftField<'a> {
    /// The field of `body`, whose surface at rest is `surface`.
    pub fn new(body: &'a SoftBody, surface: &'a dyn Surface) -> Self {
        let mesh = &body.rest.mesh;
        let mean = |points: &[Vec3]| points.iter().sum::<Vec3>() / points.len().max(1) as f64;
        Self { body, surface, centre_w: mean(&body.x), centre_o: mean(&mesh.nodes) }
    }

    /// What a square sample of edge `spacing` (m) at `p` feels whose own outward normal is `facing` (world). `None` if it
    /// looks the way the surface does, or nothing is in front of it.
    pub fn feel(&self, p: &Vec3, facing: &Vec3, spacing: f64) -> Option<Felt> {
        let place = self.place(p)?;
        let facing_o = place.pull.try_inverse()?.tr_mul(facing).try_normalize(0.0)?;
        let contact = self.surface.contact(&place.rest, &facing_o, spacing);
        let pushed = place.pull.tr_mul(&contact.normal);
        let stretch = pushed.norm();
        let normal = pushed / stretch;
        (contact.coverage > 0.0 && facing.dot(&normal) <= 0.3).then(|| Felt {
            gap: contact.phi / stretch,
            normal,
            coverage: contact.coverage,
            element: place.at.element,
            weights: place.at.weights(),
            surface_o: place.rest - contact.normal * contact.phi,
            pull: place.pull,
        })
    }

    /// The element and local coordinates (within [`BEYOND`]) of a world point, and its linearly continued rest position.
    fn place(&self, p: &Vec3) -> Option<Place> {
        let mesh = &self.body.rest.mesh;
        let guess = self.body.frame.tr_mul(&(p - self.centre_w)) + self.centre_o;
        let mut element = mesh.locate(&guess).map_or_else(|| self.nearest(p), |at| at.element);
        for _ in 0..MOST_WALKS {
            let (local, step, jacobian) = self.invert(element, p)?;
            match self.neighbour(element, &(local + step)) {
                Some(next) => element = next,
                None => {
                    let at = Embedding { element, local };
                    let pull = jacobian.try_inverse()? * mesh.edge;
                    return Some(Place { rest: mesh.rest_position(&at) + step * mesh.edge, at, pull });
                }
            }
        }
        None
    }

    /// Local coordinates of `p` in an element, clamped to [`BEYOND`]; what is left to go, linearly; and ∂x/∂ξ there.
    fn invert(&self, element: u32, p: &Vec3) -> Option<(Vec3, Vec3, Mat3)> {
        let nodes = &self.body.rest.mesh.elements[element as usize];
        let corners: [Vec3; 8] = nodes.map(|node| self.body.x[node as usize]);
        let mut local = Vec3::repeat(0.5);
        for iteration in 1.. {
            let (x, jacobian) = trilinear(&corners, &local);
            // An element that is inside out has no inverse worth using: its rotation stands in.
            let jacobian = if jacobian.determinant() > 0.0 {
                jacobian
            } else {
                self.body.rotation[element as usize] * self.body.rest.mesh.edge
            };
            let step = jacobian.try_inverse()? * (p - x);
            let next = (local + step).map(|c| c.clamp(-BEYOND, 1.0 + BEYOND));
            if (next - local).norm() < 1e-10 || iteration == MOST_NEWTON {
                return Some((local, step, jacobian));
            }
            local = next;
        }
        None
    }

    /// The existing neighbour across the side through which `local` leaves the element farthest, if it leaves.
    fn neighbour(&self, element: u32, local: &Vec3) -> Option<u32> {
        let mesh = &self.body.rest.mesh;
        let low = mesh.nodes[mesh.elements[element as usize][0] as usize];
        let cell = (low - mesh.origin) / mesh.edge;
        let mut best: Option<(f64, u32)> = None;
        for axis in 0..3 {
            let excess = (-local[axis]).max(local[axis] - 1.0);
            if excess <= 1e-9 || best.is_some_and(|(most, _)| excess <= most) {
                continue;
            }
            let mut to: [i64; 3] = std::array::from_fn(|a| cell[a].round() as i64);
            to[axis] += if local[axis] < 0.0 { -1 } else { 1 };
            best = mesh.element_at(to).map(|next| (excess, next)).or(best);
        }
        best.map(|(_, next)| next)
    }

    /// The element whose middle is nearest to a world point.
    fn nearest(&self, p: &Vec3) -> u32 {
        let middle = |nodes: &[u32; 8]| nodes.iter().map(|&n| self.body.x[n as usize]).sum::<Vec3>() / 8.0;
        let elements = self.body.rest.mesh.elements.iter().enumerate();
        elements
            .map(|(e, nodes)| ((middle(nodes) - p).norm_squared(), e as u32))
            .fold((f64::INFINITY, 0), |best, found| if found.0 < best.0 { found } else { best })
            .1
    }
}

/// The trilinear map and its derivative.
fn trilinear(corners: &[Vec3; 8], local: &Vec3) -> (Vec3, Mat3) {
    let (mut x, mut jacobian) = (Vec3::zeros(), Mat3::zeros());
    let (weights, gradients) = (hex8::weights(local), hex8::gradients(local, 1.0));
    for ((corner, weight), gradient) in corners.iter().zip(weights).zip(gradients) {
        x += corner * weight;
        jacobian += corner * gradient.transpose();
    }
    (x, jacobian)
}

/// A sample of one soft body near the surface of another, at the start of the step.
#[derive(Clone, Copy, Debug)]
pub struct Pressing {
    /// Sample group of the first body.
    pub group: usize,
    /// Sample of the first body.
    pub sample: usize,
    /// Where the sample is, m, world.
    pub p: Vec3,
    /// What it feels of the second body.
    pub felt: Felt,
}

/// Steps of approach within which a sample gets a row.
const AHEAD: f64 = 1.5;

/// Step (s), margin and reach (m) of a search.
type Limits = (f64, f64, f64);

/// How far a point of speed up to `speed` is looked for, m.
fn look(speed: f64, (dt, margin, reach): Limits) -> f64 {
    reach.max(margin).max(AHEAD * dt * speed)
}

/// Whether two bodies are close or fast enough for their samples to be worth a look.
pub fn may_touch(a: &SoftBody, b: &SoftBody, limits: Limits) -> bool {
    let (Some(box_a), Some(box_b)) = (Aabb::from_points(&a.x), Aabb::from_points(&b.x)) else { return false };
    box_a.loosened(look(a.max_speed() + b.max_speed(), limits)).intersects(&box_b)
}

/// Collects the samples of `body` that press on `field` or will, and calls `near` with the group and element of every
/// sample within the reach of it, so that their nodes can be kept before they are needed.
pub fn detect_soft(
    body: &SoftBody,
    field: &SoftField,
    limits: Limits,
    out: &mut Vec<Pressing>,
    near: &mut dyn FnMut(usize, u32),
) {
    let Some(around) = Aabb::from_points(&field.body.x) else { return };
    let field_speed = field.body.max_speed();
    for (index, group) in body.rest.groups.iter().enumerate() {
        let nodes = &group.nodes[..group.count];
        let speed = nodes.iter().map(|&n| body.v[n as usize].norm()).fold(0.0, f64::max) + field_speed;
        let wide = around.loosened(look(speed, limits));
        let Some(span) = Aabb::from_points(nodes.iter().map(|&n| &body.x[n as usize])) else { continue };
        if !wide.intersects(&span) {
            continue;
        }
        for sample in group.first..group.last {
            let Some((pressing, speed)) = press(body, field, &wide, (index, sample)) else { continue };
            let (dt, margin, reach) = limits;
            let ahead = margin.max(AHEAD * dt * speed);
            if pressing.felt.gap < ahead.max(reach) {
                near(index, pressing.felt.element);
            }
            if pressing.felt.gap < ahead {
                out.push(pressing);
            }
        }
    }
}

/// What one sample feels, and its speed against the place that it feels (m/s).
fn press(
    body: &SoftBody,
    field: &SoftField,
    wide: &Aabb,
    (group, sample): (usize, usize),
) -> Option<(Pressing, f64)> {
    let nodes = &body.rest.groups[group].nodes[..body.rest.groups[group].count];
    let data = &body.rest.samples[sample];
    let p = weighted(&body.x, nodes, &data.weights);
    if !wide.contains(&p) {
        return None;
    }
    let facing = body.rotation[data.surface.at.element as usize] * data.surface.n_o;
    let felt = field.feel(&p, &facing, data.surface.area.sqrt())?;
    let carrier = &field.body.rest.mesh.elements[felt.element as usize];
    let approach = weighted(&body.v, nodes, &data.weights) - weighted(&field.body.v, carrier, &felt.weights);
    Some((Pressing { group, sample, p, felt }, approach.norm()))
}

fn weighted(values: &[Vec3], nodes: &[u32], weights: &[f64; 8]) -> Vec3 {
    nodes.iter().zip(weights).map(|(&node, w)| values[node as usize] * *w).sum()
}
