//! What observers see: cheap copies of the state, and who touches whom.

use super::{Rigid, Soft, World, points::add_touch};
use crate::{
    geometry::{Pose, Vec3},
    physics::{
        contact::{Mover, Partner},
        solver::Point,
    },
};

/// An immutable copy of the state after a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Step, counted from 1.
    pub step: u64,
    /// Time, s.
    pub time: f64,
    /// Node positions of each soft body, m, world.
    pub nodes: Vec<Vec<Vec3>>,
    /// Object frames of the rigid bodies, world.
    pub rigid: Vec<Pose>,
    /// Joint coordinates of each tree.
    pub joints: Vec<Vec<f64>>,
    /// Link frames of each tree, world.
    pub links: Vec<Vec<Pose>>,
    /// Contacts of the colliders asked for.
    pub patches: Vec<ContactPatch>,
}

/// Everything that touches one collider, in the collider's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPatch {
    /// The collider.
    pub collider: usize,
    /// Its points with a normal impulse.
    pub points: Vec<PatchPoint>,
}

/// One touching sample.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchPoint {
    /// Soft body it belongs to.
    pub body: usize,
    /// Sample group (face or element) of that body.
    pub face: usize,
    /// Weights of the group's nodes.
    pub weights: [f64; 8],
    /// Position in the collider's frame, m.
    pub p_p: Vec3,
    /// Area it stands for, m², as far as the collider covers it.
    pub area: f64,
    /// Gap, m; negative is overlap.
    pub gap: f64,
    /// Normal traction, Pa.
    pub pressure: f64,
    /// Shear traction on the body in the collider's frame, Pa.
    pub shear_p: Vec3,
    /// Whether friction is at its bound.
    pub slipping: bool,
}

/// A free body of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Movable {
    /// A soft body, by index.
    Soft(usize),
    /// A free rigid body, by index.
    Rigid(usize),
}

/// What one collider or soft body does to one free body, summed over the patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Touch {
    /// Touching samples.
    pub samples: usize,
    /// Of those, samples at the friction bound.
    pub slipping: usize,
    /// Sum of the normal forces, N.
    pub normal_force: f64,
    /// Force on the body, N, world.
    pub force_w: Vec3,
    /// Sum of the friction bounds μ f_n in force, N: what the patch can hold.
    pub capacity: f64,
    /// Force-weighted mean distance that the anchors were dragged, m.
    pub travel: f64,
}

impl World {
    /// A copy of the state, with the contact patches of `colliders`.
    pub fn snapshot(&self, colliders: &[usize]) -> Frame {
        Frame {
            step: self.step,
            time: self.time(),
            nodes: self.soft.iter().map(|s| s.body.x.clone()).collect(),
            rigid: self.rigid.iter().map(|r| r.body.object_w()).collect(),
            joints: self.trees.iter().map(|t| t.state.q.as_slice().to_vec()).collect(),
            links: self.trees.iter().map(|t| t.poses.clone()).collect(),
            patches: colliders.iter().map(|&c| self.patch(c)).collect(),
        }
    }

    /// What touched a collider in the last step.
    pub fn patch(&self, collider: usize) -> ContactPatch {
        let dt = self.params.dt;
        let partner = Partner::Collider(collider).id();
        let rows = self.rows.iter().zip(&self.problem.points);
        let points = rows
            .filter(|(row, point)| row.partner == partner && point.normal_impulse > 0.0)
            .map(|(row, point)| {
                let pose = &self.moving[collider].pose;
                let rest = &self.soft[row.soft].body.rest;
                let area = rest.samples[row.candidate.sample].surface.area * row.candidate.coverage;
                PatchPoint {
                    body: row.soft,
                    face: row.candidate.group,
                    weights: point.weights_a,
                    p_p: pose.inverse_transform_point(&row.candidate.p.into()).coords,
                    area,
                    gap: point.gap,
                    pressure: point.normal_impulse / dt / area,
                    shear_p: pose.rotation.inverse_transform_vector(&point.shear_impulse) / dt / area,
                    slipping: point.slipping,
                }
            })
            .collect();
        ContactPatch { collider, points }
    }

    /// What `collider` did to soft body `soft` in the last step in which the body was awake.
    pub fn touch(&self, soft: usize, collider: usize) -> Touch {
        self.touch_by(soft, Partner::Collider(collider))
    }

    /// What `partner` did to soft body `soft` in the last step in which the body was awake.
    pub fn touch_by(&self, soft: usize, partner: Partner) -> Touch {
        self.touch_on(Movable::Soft(soft), partner)
    }

    /// What `partner` did to a body in the last step in which the body was awake.
    pub fn touch_on(&self, body: Movable, partner: Partner) -> Touch {
        let found = self.touches_on(body).iter().find(|(id, _)| *id == partner.id());
        found.map_or(Touch::default(), |(_, touch)| *touch)
    }

    /// All that touched a body in the last step in which it was awake, by [`Partner::id`].
    pub fn touches_on(&self, body: Movable) -> &[(u32, Touch)] {
        match body {
            Movable::Soft(index) => &self.soft[index].touches,
            Movable::Rigid(index) => &self.rigid[index].touches,
        }
    }

    /// Tells all bodies that are awake what touched them; a sleeping one keeps what it knew.
    pub(super) fn record_touches(&mut self) {
        self.soft.iter_mut().filter(|s| !s.asleep).for_each(|s| s.touches.clear());
        self.rigid.iter_mut().filter(|r| !r.asleep).for_each(|r| r.touches.clear());
        let dt = self.params.dt;
        let Self { soft, rigid, rows, problem, colliders, rigid_contacts, .. } = self;
        for (row, point) in rows.iter().zip(&problem.points).filter(|(_, point)| point.normal_impulse > 0.0) {
            let (partner, told) = (Partner::of(row.partner), (point, row.travel));
            let own = Partner::Soft(row.soft).id();
            soft[row.soft].told(row.partner, told, (1.0, dt));
            match partner {
                Partner::Soft(other) => soft[other].told(own, told, (-1.0, dt)),
                Partner::Collider(id) => {
                    if let Mover::Rigid(index) = colliders[id].mover {
                        rigid[index].told(own, told, (-1.0, dt));
                    }
                }
            }
        }
        for (pair, travel, point) in rigid_contacts.points(&problem.points[rows.len()..]) {
            for (side, other, sign) in [(pair.0, pair.1, 1.0), (pair.1, pair.0, -1.0)] {
                if let Mover::Rigid(index) = colliders[side].mover {
                    rigid[index].told(Partner::Collider(other).id(), (point, travel), (sign, dt));
                }
            }
        }
    }
}

impl Touch {
    /// Size of the force along the patch, N (exact where its normals agree).
    pub fn shear(&self) -> f64 {
        (self.force_w.norm_squared() - self.normal_force.powi(2)).max(0.0).sqrt()
    }
}

impl Soft {
    fn told(&mut self, partner: u32, point: (&Point, f64), side: (f64, f64)) {
        if !self.asleep {
            add_touch(&mut self.touches, partner, point, side);
        }
    }
}

impl Rigid {
    fn told(&mut self, partner: u32, point: (&Point, f64), side: (f64, f64)) {
        if !self.asleep {
            add_touch(&mut self.touches, partner, point, side);
        }
    }
}
