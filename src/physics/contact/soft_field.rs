//! Contact of a soft body's samples with another soft body: the signed distance field of a deformed surface.
//!
//! The field is known at rest only. So a point of space is mapped back into the undeformed voxel grid (the
//! inverse of the trilinear map, by Newton's method, walking from voxel to voxel), the field is evaluated at that
//! rest position, and gap and normal are pushed forward with the deformation gradient F there: n ∝ F⁻ᵀ n₀ and φ =
//! φ₀ / |F⁻ᵀ n₀| (normals and level sets under a map: Bonet & Wood, Nonlinear Continuum Mechanics for Finite
//! Element Analysis, 2008, §4.10).

use super::{collider::ContactSurface, detect::DetectionLimits};
use crate::fem::FemState;
use softvt_geometry::{
    Aabb, Mat3, Vec3, hex8,
    voxel::{Embedding, MAX_EXTRAPOLATION},
};

/// Largest number of voxels that a search visits.
const MAX_VISITED_VOXELS: usize = 64;
/// Newton iterations in one voxel; an undeformed one takes a single iteration.
const MAX_NEWTON: usize = 8;

/// Signed distance field of a soft body's surface in its current state.
pub(crate) struct DeformedSdf<'a> {
    body: &'a FemState,
    surface: &'a dyn ContactSurface,
    centre_w: Vec3,
    centre_o: Vec3,
}

/// Contact of a sample with the field of a soft body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SdfContact {
    /// Gap, m; negative inside.
    pub(crate) gap: f64,
    /// Outward normal, world.
    pub(crate) normal: Vec3,
    /// Covered share of the sample's area, 0..=1.
    pub(crate) coverage: f64,
    /// The element in which the sample lies.
    pub(crate) element: u32,
    /// Weights of its eight nodes.
    pub(crate) weights: [f64; 8],
    /// The surface point under the sample, in the rest configuration, object frame, m.
    pub(crate) surface_o: Vec3,
    /// F⁻¹: maps small vectors of the world to the rest configuration.
    pub(crate) inverse_gradient: Mat3,
}

/// A point of the world mapped to the rest configuration of the body.
struct RestPoint {
    at: Embedding,
    p_o: Vec3,
    inverse_gradient: Mat3,
}

impl<'a> DeformedSdf<'a> {
    /// The field of `body`, whose surface at rest is `surface`.
    pub(crate) fn new(body: &'a FemState, surface: &'a dyn ContactSurface) -> Self {
        let mesh = &body.model.mesh;
        let mean = |points: &[Vec3]| points.iter().sum::<Vec3>() / points.len().max(1) as f64;
        Self { body, surface, centre_w: mean(&body.x), centre_o: mean(&mesh.nodes) }
    }

    /// Contact of a square sample of edge `spacing` (m) at `p` with outward normal `facing` (world). `None` if the
    /// surface faces the same way, or does not cover the sample.
    pub(crate) fn contact(&self, p: &Vec3, facing: &Vec3, spacing: f64) -> Option<SdfContact> {
        let point = self.map_to_rest(p)?;
        let facing_o = point.inverse_gradient.try_inverse()?.tr_mul(facing).try_normalize(0.0)?;
        let contact = self.surface.contact(&point.p_o, &facing_o, spacing);
        let pushed = point.inverse_gradient.tr_mul(&contact.normal);
        let stretch = pushed.norm();
        let normal = pushed / stretch;
        (contact.coverage > 0.0 && facing.dot(&normal) <= 0.3).then(|| SdfContact {
            gap: contact.gap / stretch,
            normal,
            coverage: contact.coverage,
            element: point.at.element,
            weights: point.at.weights(),
            surface_o: point.p_o - contact.normal * contact.gap,
            inverse_gradient: point.inverse_gradient,
        })
    }

    /// The element and local coordinates (within [`MAX_EXTRAPOLATION`]) of a world point, and its rest position,
    /// which is continued linearly beyond.
    fn map_to_rest(&self, p: &Vec3) -> Option<RestPoint> {
        let mesh = &self.body.model.mesh;
        let guess = self.body.frame.tr_mul(&(p - self.centre_w)) + self.centre_o;
        let mut element = mesh.locate(&guess).map_or_else(|| self.nearest_element(p), |at| at.element);
        for _ in 0..MAX_VISITED_VOXELS {
            let (local, step, jacobian) = self.invert(element, p)?;
            match self.neighbour(element, &(local + step)) {
                Some(next) => element = next,
                None => {
                    let at = Embedding { element, local };
                    let inverse_gradient = jacobian.try_inverse()? * mesh.edge;
                    let p_o = mesh.rest_position(&at) + step * mesh.edge;
                    return Some(RestPoint { p_o, at, inverse_gradient });
                }
            }
        }
        None
    }

    /// Local coordinates of `p` in an element, clamped to [`MAX_EXTRAPOLATION`]; the linear step
    /// that remains; and ∂x/∂ξ.
    fn invert(&self, element: u32, p: &Vec3) -> Option<(Vec3, Vec3, Mat3)> {
        let nodes = &self.body.model.mesh.elements[element as usize];
        let corners: [Vec3; 8] = nodes.map(|node| self.body.x[node as usize]);
        let mut local = Vec3::repeat(0.5);
        for iteration in 1.. {
            let (x, jacobian) = trilinear(&corners, &local);
            // The map of an inverted element has no useful inverse; the element's rotation replaces it.
            let jacobian = if jacobian.determinant() > 0.0 {
                jacobian
            } else {
                self.body.rotation[element as usize] * self.body.model.mesh.edge
            };
            let step = jacobian.try_inverse()? * (p - x);
            let next = (local + step).map(|c| c.clamp(-MAX_EXTRAPOLATION, 1.0 + MAX_EXTRAPOLATION));
            if (next - local).norm() < 1e-10 || iteration == MAX_NEWTON {
                return Some((local, step, jacobian));
            }
            local = next;
        }
        None
    }

    /// The neighbour across the side that `local` exceeds most, if it leaves the element and there is one.
    fn neighbour(&self, element: u32, local: &Vec3) -> Option<u32> {
        let mesh = &self.body.model.mesh;
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

    /// The element whose centre is nearest to a world point.
    fn nearest_element(&self, p: &Vec3) -> u32 {
        let middle = |nodes: &[u32; 8]| nodes.iter().map(|&n| self.body.x[n as usize]).sum::<Vec3>() / 8.0;
        let elements = self.body.model.mesh.elements.iter().enumerate();
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
pub(crate) struct SdfCandidate {
    /// Sample group of the first body.
    pub(crate) group: usize,
    /// Sample of the first body.
    pub(crate) sample: usize,
    /// Position of the sample, m, world.
    pub(crate) p: Vec3,
    /// Contact with the second body's field.
    pub(crate) contact: SdfContact,
}

/// Distance within which a sample of this spacing (m) and of speed up to `speed` (m/s) is tested, m. It may cover a
/// face from half a spacing beyond its edge.
fn search_distance(speed: f64, spacing: f64, limits: DetectionLimits) -> f64 {
    limits.reach.max(limits.margin).max(limits.approach_distance(speed)) + 0.5 * spacing
}

/// True if two bodies are close or fast enough for [`detect_soft`] to find anything.
pub(crate) fn may_touch(a: &FemState, b: &FemState, limits: DetectionLimits) -> bool {
    let (Some(box_a), Some(box_b)) = (Aabb::from_points(&a.x), Aabb::from_points(&b.x)) else { return false };
    let distance = search_distance(a.max_speed() + b.max_speed(), a.model.max_spacing(), limits);
    box_a.loosened(distance).intersects(&box_b)
}

/// Collects the samples of `body` that press on `field`, or will within the step, into `out`.
///
/// Calls `near` with the group and element of every sample within reach of the field, so that their nodes are
/// retained before the contact begins.
pub(crate) fn detect_soft(
    body: &FemState,
    field: &DeformedSdf,
    limits: DetectionLimits,
    out: &mut Vec<SdfCandidate>,
    near: &mut dyn FnMut(usize, u32),
) {
    let Some(around) = Aabb::from_points(&field.body.x) else { return };
    let field_speed = field.body.max_speed();
    for (index, group) in body.model.groups.iter().enumerate() {
        let nodes = &group.nodes[..group.count];
        let speed = nodes.iter().map(|&n| body.v[n as usize].norm()).fold(0.0, f64::max) + field_speed;
        let search_box = around.loosened(search_distance(speed, group.spacing, limits));
        let Some(group_box) = Aabb::from_points(nodes.iter().map(|&n| &body.x[n as usize])) else { continue };
        if !search_box.intersects(&group_box) {
            continue;
        }
        for sample in group.first..group.last {
            let Some((candidate, approach_speed)) = test_sample(body, field, &search_box, index, sample)
            else {
                continue;
            };
            let contact_distance = limits.margin.max(limits.approach_distance(approach_speed));
            if candidate.contact.gap < contact_distance.max(limits.reach) {
                near(index, candidate.contact.element);
            }
            if candidate.contact.gap < contact_distance {
                out.push(candidate);
            }
        }
    }
}

/// The contact of one sample, and its speed towards the field's surface there, m/s.
fn test_sample(
    body: &FemState,
    field: &DeformedSdf,
    search_box: &Aabb,
    group: usize,
    sample: usize,
) -> Option<(SdfCandidate, f64)> {
    let nodes = &body.model.groups[group].nodes[..body.model.groups[group].count];
    let data = &body.model.samples[sample];
    let p = weighted(&body.x, nodes, &data.weights);
    if !search_box.contains(&p) {
        return None;
    }
    let facing = body.rotation[data.surface.at.element as usize] * data.surface.n_o;
    let contact = field.contact(&p, &facing, data.surface.area.sqrt())?;
    let element = &field.body.model.mesh.elements[contact.element as usize];
    let velocity =
        weighted(&body.v, nodes, &data.weights) - weighted(&field.body.v, element, &contact.weights);
    let approach_speed = -velocity.dot(&contact.normal);
    Some((SdfCandidate { group, sample, p, contact }, approach_speed))
}

fn weighted(values: &[Vec3], nodes: &[u32], weights: &[f64; 8]) -> Vec3 {
    nodes.iter().zip(weights).map(|(&node, w)| values[node as usize] * *w).sum()
}
