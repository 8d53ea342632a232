//! Conversion of a contact between two surfaces, of whatever bodies, to a contact point of the solver, and the
//! evolution of its tangential spring and of the elastic layers.

use super::{World, snapshot::ColliderPoint};
use crate::{
    contact::{Friction, LayerState, SurfaceStiffness},
    ids::{ColliderId, ContactPartner},
    solver::ContactPoint,
};
use softvt_geometry::Vec3;

/// Geometry and history of one contact between two surfaces.
pub(super) struct SurfaceContact {
    /// Position, m, world.
    pub p: Vec3,
    /// Unit normal, world.
    pub normal: Vec3,
    /// Gap, m; negative is overlap.
    pub gap: f64,
    /// Area that the point represents, m².
    pub area: f64,
    /// Stretch of the tangential spring, m, world; its part along the normal is ignored.
    pub stretch: Vec3,
    /// Motion of the rest position of the springs, m, world: of the surface that the normal points away from, less of
    /// the other.
    pub rest: Vec3,
    /// Normal impulse of the last step if it had been as long as this one, N s.
    pub previous_normal_impulse: f64,
    /// True if the two surfaces slide on each other.
    pub is_sliding: bool,
}

impl SurfaceContact {
    /// The solver's point for this contact, without node weights and drift velocity.
    pub(super) fn contact_point(&self, friction: &Friction, stiffness: &SurfaceStiffness) -> ContactPoint {
        let stretch = self.stretch - self.rest;
        ContactPoint {
            p: self.p,
            normal: self.normal,
            stiffness: stiffness.normal * self.area,
            shear_stiffness: stiffness.shear * self.area,
            gap: self.gap - self.normal.dot(&self.rest),
            offset: stretch - self.normal * self.normal.dot(&stretch),
            mu: if self.is_sliding { friction.dynamic_mu } else { friction.static_mu },
            previous_normal_impulse: self.previous_normal_impulse,
            ..ContactPoint::default()
        }
    }
}

/// Tangential spring of a solved point at the end of the step.
pub(super) struct SpringUpdate {
    /// Stretch if nothing had slipped, m, world.
    pub stretch: Vec3,
    /// Part of its length beyond what friction holds, which was slipped, m.
    pub slipped: f64,
}

impl SpringUpdate {
    pub(super) fn new(point: &ContactPoint, dt: f64) -> Self {
        let tangential = point.velocity - point.normal * point.normal.dot(&point.velocity);
        let stretch = point.offset + tangential * dt;
        if !point.is_slipping {
            return Self { stretch, slipped: 0.0 };
        }
        let allowed =
            point.mu * point.previous_normal_impulse / (dt * point.shear_stiffness).max(f64::MIN_POSITIVE);
        Self { stretch, slipped: (stretch.norm() - allowed).max(0.0) }
    }
}

impl World {
    /// Stiffness of a collider at a contact with this normal (world) that had a traction on the collider in the last
    /// step (Pa, world), and the motion of the rest position of its springs, m, world.
    pub(super) fn surface_at(
        &self,
        id: ColliderId,
        p_w: &Vec3,
        normal: &Vec3,
        traction: impl FnOnce() -> Vec3,
    ) -> (SurfaceStiffness, Vec3) {
        let Some(state) = &self.layers[id.index()] else {
            return (self.collider(id).stiffness, Vec3::zeros());
        };
        let traction = traction();
        let pose = &self.motions[id.index()].pose;
        let p_p = pose.inverse_transform_point(&(*p_w).into()).coords;
        let traction_p = pose.rotation.inverse_transform_vector(&traction);
        let moved = pose.rotation * state.moved_at(&p_p, &traction_p);
        let stiffness = state.stiffness_at(&p_p);
        (stiffness, moved - stiffness.compliance(&traction, normal))
    }

    /// Loads the elastic layers with the solved points, and finds their displacements.
    pub(super) fn update_layers(&mut self) {
        let mut layers = std::mem::take(&mut self.layers);
        layers.iter_mut().flatten().for_each(LayerState::clear);
        let mut load = |id: ColliderId, point: &ContactPoint, sign: f64| {
            let Some(state) = &mut layers[id.index()] else { return };
            let pose = &self.motions[id.index()].pose;
            let p_p = pose.inverse_transform_point(&point.p.into()).coords;
            let force = (point.normal * point.normal_impulse + point.shear_impulse) * (sign / self.params.dt);
            state.add(&p_p, &pose.rotation.inverse_transform_vector(&force));
        };
        let (soft, rigid) = self.problem.points.split_at(self.rows.len());
        for (row, point) in self.rows.iter().zip(soft).filter(|(_, point)| point.normal_impulse > 0.0) {
            if let ContactPartner::Collider(id) = row.partner {
                load(id, point, -1.0);
            }
        }
        for pressing in self.rigid_contacts.pressing(rigid) {
            load(pressing.key.a, pressing.point, 1.0);
            load(pressing.key.b, pressing.point, -1.0);
        }
        for ColliderPoint { collider, point, .. } in &self.resting {
            if let Some(state) = &mut layers[collider.index()]
                && self.are_resting(*collider, point.partner)
            {
                state.add(&point.p_p, &(-(point.normal_p * point.pressure + point.shear_p) * point.area));
            }
        }
        layers.iter_mut().flatten().for_each(LayerState::update);
        self.layers = layers;
    }
}

/// Share of a pair's normal force that is at the friction bound while the pair slides.
const SLIDING_SHARE: f64 = 0.97;

/// Pairs of surfaces that slide as a whole.
///
/// The points of a patch share a load by their stiffness, not by their pressure, so lightly loaded ones reach the
/// static bound before the patch does. If each of them then dropped to dynamic friction alone, its share would
/// overload the next, and a block would start to slide far below μ_s N. So dynamic friction begins for a pair when
/// (nearly) all of its force is at the bound, that is when the surfaces slide on each other, and ends when a step
/// leaves part of it inside the bound.
#[derive(Debug, Default)]
pub(super) struct SlidingPairs<K>(Vec<PairImpulse<K>>);

/// Normal impulses of a pair, N s.
#[derive(Debug)]
struct PairImpulse<K> {
    pair: K,
    total: f64,
    /// Of the points at the friction bound.
    slipping: f64,
}

impl<K: PartialEq + Copy> SlidingPairs<K> {
    /// Sums the points of each pair.
    pub(super) fn new<'a>(points: impl Iterator<Item = (K, &'a ContactPoint)>) -> Self {
        let mut sums: Vec<PairImpulse<K>> = Vec::new();
        for (pair, point) in points {
            // Points of a pair come in runs, so the last entry is nearly always the right one.
            let at = sums.iter().rposition(|known| known.pair == pair).unwrap_or_else(|| {
                sums.push(PairImpulse { pair, total: 0.0, slipping: 0.0 });
                sums.len() - 1
            });
            sums[at].total += point.normal_impulse;
            sums[at].slipping += if point.is_slipping { point.normal_impulse } else { 0.0 };
        }
        Self(sums)
    }

    /// True if a pair slides as a whole.
    pub(super) fn contains(&self, pair: K) -> bool {
        self.0.iter().any(|known| known.pair == pair && known.slipping >= SLIDING_SHARE * known.total)
    }
}
