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

/// What presses on a collider at one point.
#[derive(Clone, Debug, PartialEq)]
pub enum Presser {
    /// A sample of a soft body.
    Soft {
        /// Index of the body.
        body: usize,
        /// Sample group (face or element) of that body.
        face: usize,
        /// Weights of the group's nodes.
        weights: [f64; 8],
    },
    /// Another collider: of a rigid body, a link or the world.
    Solid {
        /// Its index.
        collider: usize,
    },
}

/// One touching point: a sample of a soft body, or of the gel that a hard one presses on.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchPoint {
    /// What presses there.
    pub by: Presser,
    /// Position in the collider's frame, m.
    pub p_p: Vec3,
    /// Area it stands for, m², as far as the collider covers it.
    pub area: f64,
    /// Gap, m; negative is overlap.
    pub gap: f64,
    /// Unit normal out of the collider, in its frame.
    pub normal_p: Vec3,
    /// Normal traction, Pa.
    pub pressure: f64,
    /// Shear traction on what presses, in the collider's frame, Pa.
    pub shear_p: Vec3,
    /// Coefficient of friction of the pair in this step: its dynamic one if the two slide on each other, else its static.
    pub mu: f64,
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
        let partner = Partner::Collider(collider).id();
        let (soft, solid) = self.problem.points.split_at(self.rows.len().min(self.problem.points.len()));
        let rows = self.rows.iter().zip(soft);
        let mut points: Vec<PatchPoint> = rows
            .filter(|(row, point)| row.partner == partner && point.normal_impulse > 0.0)
            .map(|(row, point)| {
                let rest = &self.soft[row.soft].body.rest;
                let area = rest.samples[row.candidate.sample].surface.area * row.candidate.coverage;
                let (body, face, weights) = (row.soft, row.candidate.group, point.weights_a);
                self.patch_point(collider, Presser::Soft { body, face, weights }, (point, 1.0), area)
            })
            .collect();
        for ((a, b), _, point) in self.rigid_contacts.points(solid) {
            let (other, sign) = match collider {
                own if own == a => (b, -1.0),
                own if own == b => (a, 1.0),
                _ => continue,
            };
            let layer = self.colliders[a].layer.in_series(&self.colliders[b].layer);
            let by = Presser::Solid { collider: other };
            points.push(self.patch_point(collider, by, (point, sign), point.stiffness / layer.normal));
        }
        ContactPatch { collider, points }
    }

    /// A solved point as the collider's patch tells it; `sign` is 1 if its impulse is that on what presses.
    fn patch_point(
        &self,
        collider: usize,
        by: Presser,
        (point, sign): (&Point, f64),
        area: f64,
    ) -> PatchPoint {
        let pose = &self.moving[collider].pose;
        let share = self.params.dt * area;
        PatchPoint {
            by,
            p_p: pose.inverse_transform_point(&point.p.into()).coords,
            area,
            gap: point.gap,
            normal_p: pose.rotation.inverse_transform_vector(&point.normal) * sign,
            pressure: point.normal_impulse / share,
            shear_p: pose.rotation.inverse_transform_vector(&point.shear_impulse) * (sign / share),
            mu: point.mu,
            slipping: point.slipping,
        }
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
