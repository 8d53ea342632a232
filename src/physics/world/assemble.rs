//! From the state of the world to one convex problem: blocks, frames, patches, rows.

use super::{RowOf, StepFailure, World, points::Meeting};
use crate::{
    geometry::{Pose, Vec3},
    physics::{
        contact::{Mover, Moving, Partner, Slot, Whereabouts, detect},
        fem::system::StepCoefficients,
        joints,
        rigid::free_spin,
        solver::{Block, Endpoint, Patch, Point, Scalar, Screw},
    },
};

/// Distance at which a group's nodes are kept, so that a contact does not change the factor when it begins, m.
pub(super) const REACH: f64 = 2.5e-3;
/// Stiffness and damping of joint stops, relative to the joint's inertia over a step.
const STOP_RATE: f64 = 0.5;
/// The same of the stops and the dry friction of joints without a drive, which nothing but these holds.
const FIRM_RATE: f64 = 50.0;

/// Which block belongs to what.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    pub soft: Vec<Option<usize>>,
    pub rigid: Vec<Option<usize>>,
    pub trees: Vec<Option<usize>>,
    pub momentum: Vec<Vec3>,
    pub free_w: Vec<crate::physics::rigid::FreeSpin>,
    screws: Vec<(Mover, usize)>,
}

impl World {
    /// Where every collider is and how its mover moves.
    pub(super) fn place_colliders(&mut self) {
        let moving = self.colliders.iter().map(|c| self.moving_of(c.mover, &c.pose_in_mover)).collect();
        self.moving = moving;
    }

    fn moving_of(&self, mover: Mover, offset: &Pose) -> Moving {
        let still = |pose: Pose| Moving {
            pose: pose * offset,
            linear: Vec3::zeros(),
            angular: Vec3::zeros(),
            origin: pose.translation.vector,
        };
        match mover {
            Mover::Static => still(Pose::identity()),
            Mover::Kinematic(index) => {
                let k = &self.kinematic[index];
                let dt = self.params.dt;
                Moving {
                    linear: (k.next.translation.vector - k.pose.translation.vector) / dt,
                    angular: (k.next.rotation * k.pose.rotation.inverse()).scaled_axis() / dt,
                    ..still(k.pose)
                }
            }
            Mover::Rigid(index) => {
                let body = &self.rigid[index].body;
                let pose = body.object_w();
                Moving {
                    pose: pose * offset,
                    linear: body.v,
                    angular: body.w,
                    origin: body.pose_w.translation.vector,
                }
            }
            Mover::Link { tree, link } => {
                let tree = &self.trees[tree];
                let velocities = joints::velocities(&tree.tree, &tree.poses, tree.state.v.as_slice());
                Moving {
                    linear: velocities[link].linear,
                    angular: velocities[link].angular,
                    ..still(tree.poses[link])
                }
            }
        }
    }

    /// Fills the candidate list and marks the nodes that must stay in the reduced systems.
    pub(super) fn detect(&mut self) {
        self.candidates.clear();
        let (mut found, mut whereabouts) = (Vec::new(), Whereabouts::default());
        for (index, soft) in self.soft.iter_mut().enumerate().filter(|(_, s)| !s.asleep) {
            soft.steps += 1;
            let (system, body, step) = (&mut soft.system, &soft.body, soft.steps);
            whereabouts.look(body);
            for (id, collider) in self.colliders.iter().enumerate() {
                found.clear();
                let limits = (self.params.dt, self.params.margin, REACH);
                detect((body, &whereabouts), collider, &self.moving[id], limits, &mut found, &mut |group| {
                    let group = &body.rest.groups[group];
                    group.nodes[..group.count].iter().for_each(|&node| system.mark(node, step));
                });
                for c in &found {
                    let group = &body.rest.groups[c.group];
                    group.nodes[..group.count].iter().for_each(|&node| system.mark(node, step));
                }
                self.candidates.extend(found.iter().map(|c| (index, id, *c)));
            }
        }
    }

    /// Builds the problem of this step.
    pub(super) fn assemble(&mut self) -> Result<(), StepFailure> {
        self.problem.clear(self.params.dt, self.params.tau);
        self.rows.clear();
        self.layout.screws.clear();
        self.soft_blocks()?;
        self.rigid_blocks();
        self.tree_blocks();
        self.soft_patches();
        self.pressing_patches();
        self.rigid_patches();
        Ok(())
    }

    fn soft_blocks(&mut self) -> Result<(), StepFailure> {
        let c = StepCoefficients { dt: self.params.dt, alpha: self.params.alpha, beta: self.params.beta };
        self.layout.soft.clear();
        for (index, soft) in self.soft.iter_mut().enumerate() {
            if soft.asleep {
                self.layout.soft.push(None);
                continue;
            }
            let body = &soft.body;
            if !soft.system.prepare(body, &c, soft.steps) {
                return Err(StepFailure::Indefinite { step: self.step, body: soft.name.clone() });
            }
            let momentum = &mut self.layout.momentum;
            momentum.clear();
            momentum.extend(
                (0..body.x.len())
                    .map(|n| (body.v[n] + self.gravity * c.dt) * body.rest.mass[n] + body.force[n] * c.dt),
            );
            let dim = 3 * soft.system.kept().len();
            let identity = (index as u64) << 40 | soft.system.kept_version();
            let matrix = soft.system.lend_matrix();
            let mut block = Block { dim, matrix, rhs: vec![0.0; dim], v: vec![0.0; dim], identity };
            soft.system.reduce(momentum, &mut block.rhs);
            for (i, &node) in soft.system.kept().iter().enumerate() {
                block.v[3 * i..3 * i + 3].copy_from_slice(body.v[node as usize].as_slice());
            }
            self.layout.soft.push(Some(self.problem.blocks.len()));
            self.problem.blocks.push(block);
        }
        Ok(())
    }

    fn rigid_blocks(&mut self) {
        self.layout.rigid.clear();
        self.layout.free_w.clear();
        let dt = self.params.dt;
        for rigid in &self.rigid {
            let body = &rigid.body;
            let spin = free_spin(body, dt);
            self.layout.free_w.push(spin);
            if rigid.asleep {
                self.layout.rigid.push(None);
                continue;
            }
            let inertia = body.inertia_w();
            let mut matrix = vec![0.0; 36];
            (0..3).for_each(|i| matrix[7 * i] = body.mass);
            for (r, c) in (0..9).map(|e| (e % 3, e / 3)) {
                matrix[(3 + c) * 6 + 3 + r] = inertia[(r, c)];
            }
            let linear = (body.v + self.gravity * dt) * body.mass;
            let angular = inertia * spin.end_w;
            let stack = |a: &Vec3, b: &Vec3| [a.as_slice(), b.as_slice()].concat();
            self.layout.rigid.push(Some(self.problem.blocks.len()));
            self.problem.blocks.push(Block {
                dim: 6,
                matrix,
                rhs: stack(&linear, &angular),
                v: stack(&body.v, &body.w),
                identity: 1 << 60 | self.layout.rigid.len() as u64,
            });
        }
    }

    fn tree_blocks(&mut self) {
        self.layout.trees.clear();
        let dt = self.params.dt;
        for tree in &mut self.trees {
            if tree.asleep {
                self.layout.trees.push(None);
                continue;
            }
            let n = tree.tree.dofs();
            let mut mass = nalgebra::DMatrix::zeros(n, n);
            joints::mass_matrix_into(&tree.tree, &tree.poses, &mut tree.scratch, &mut mass);
            let gravity = if tree.gravity { self.gravity } else { Vec3::zeros() };
            let bias = joints::bias(&tree.tree, &tree.poses, tree.state.v.as_slice(), &gravity);
            let rhs = &mass * &tree.state.v - bias * dt;
            let block = self.problem.blocks.len();
            for (i, link) in tree.tree.links.iter().enumerate() {
                mass[(i, i)] += dt * link.damping;
                tree.bristles[i].stiffness = FIRM_RATE * mass[(i, i)] / (dt * dt);
                self.problem.scalars.extend(joint_rows(tree, i, block, mass[(i, i)], dt));
            }
            self.layout.trees.push(Some(block));
            self.problem.blocks.push(Block {
                dim: n,
                matrix: mass.as_slice().to_vec(),
                rhs: rhs.as_slice().to_vec(),
                v: tree.state.v.as_slice().to_vec(),
                identity: 1 << 61 | self.layout.trees.len() as u64,
            });
        }
    }

    /// Rows between soft bodies and colliders.
    fn soft_patches(&mut self) {
        let candidates = std::mem::take(&mut self.candidates);
        let mut at = 0;
        while at < candidates.len() {
            let (soft, id, first) = candidates[at];
            let end = at
                + candidates[at..]
                    .iter()
                    .take_while(|c| (c.0, c.1, c.2.group) == (soft, id, first.group))
                    .count();
            let Some(block) = self.layout.soft[soft] else { break };
            let (a, b) =
                (self.nodes_of(soft, first.group, block), self.endpoint_of(self.colliders[id].mover));
            let start = self.problem.points.len();
            for (_, _, candidate) in &candidates[at..end] {
                self.push_row(soft, id, candidate, &b);
            }
            self.problem.patches.push(Patch { a, b, first: start, last: self.problem.points.len() });
            at = end;
        }
        self.candidates = candidates;
    }

    pub(super) fn nodes_of(&self, soft: usize, group: usize, block: usize) -> Endpoint {
        let soft = &self.soft[soft];
        let group = &soft.body.rest.groups[group];
        let mut at = [0; 8];
        for (at, &node) in at.iter_mut().zip(&group.nodes[..group.count]) {
            *at = 3 * soft.system.kept_index(node) as u32;
        }
        Endpoint::Nodes { block, at, count: group.count }
    }

    /// The endpoint of a mover; its frame is registered on first use.
    pub(super) fn endpoint_of(&mut self, mover: Mover) -> Endpoint {
        let (block, jacobian, origin) = match mover {
            Mover::Static | Mover::Kinematic(_) => return Endpoint::Known,
            _ if self.layout.screws.iter().any(|(m, _)| *m == mover) => {
                let found = self.layout.screws.iter().find(|(m, _)| *m == mover);
                return found.map_or(Endpoint::Known, |(_, screw)| Endpoint::Screw(*screw));
            }
            Mover::Rigid(index) => {
                let Some(block) = self.layout.rigid[index] else { return Endpoint::Known };
                let identity = (0..36).map(|e| if e % 7 == 0 { 1.0 } else { 0.0 }).collect();
                (block, identity, self.rigid[index].body.pose_w.translation.vector)
            }
            Mover::Link { tree, link } => {
                let Some(block) = self.layout.trees[tree] else { return Endpoint::Known };
                let t = &self.trees[tree];
                let jacobian = joints::jacobian(&t.tree, &t.poses, link).as_slice().to_vec();
                (block, jacobian, t.poses[link].translation.vector)
            }
        };
        self.layout.screws.push((mover, self.problem.screws.len()));
        self.problem.screws.push(Screw { block, jacobian, origin });
        Endpoint::Screw(self.problem.screws.len() - 1)
    }

    fn push_row(&mut self, soft: usize, id: usize, candidate: &super::Candidate, b: &Endpoint) {
        let (body, collider, moving) = (&self.soft[soft], &self.colliders[id], &self.moving[id]);
        let sample = &body.body.rest.samples[candidate.sample];
        let local = moving.pose.inverse_transform_point(&candidate.p.into()).coords;
        let partner = Partner::Collider(id).id();
        let slot = body
            .memory
            .get(candidate.sample, partner, body.steps)
            .copied()
            .unwrap_or(Slot::fresh(partner, local));
        let anchor_w = (moving.pose * nalgebra::Point3::from(slot.anchor)).coords;
        let meeting = Meeting {
            p: candidate.p,
            normal: candidate.normal,
            gap: candidate.gap,
            area: sample.surface.area * candidate.coverage,
            stretch: candidate.p - anchor_w,
            impulse: slot.impulse,
            sliding: slot.slipping,
        };
        let known = *b == Endpoint::Known;
        let point =
            meeting.point(&collider.friction.with(&body.friction), &collider.layer.in_series(&body.layer));
        self.problem.points.push(Point {
            weights_a: sample.weights,
            drift: if known { moving.velocity(&candidate.p) } else { Vec3::zeros() },
            ..point
        });
        self.rows.push(RowOf {
            soft,
            candidate: *candidate,
            partner,
            anchor: slot.anchor,
            travel: slot.travel,
            pull: moving.pose.rotation.inverse().to_rotation_matrix().into_inner(),
        });
    }
}

/// Drive, stops, speed limit and dry friction of one joint; `inertia` is its diagonal of the mass matrix.
fn joint_rows(
    tree: &super::Articulation,
    joint: usize,
    block: usize,
    inertia: f64,
    dt: f64,
) -> impl Iterator<Item = Scalar> {
    let link = &tree.tree.links[joint];
    let (q, v) = (tree.state.q[joint], tree.state.v[joint]);
    let row = |stiffness: f64, damping: f64, error: f64, target_velocity: f64, range: (f64, f64)| Scalar {
        block,
        index: joint,
        stiffness,
        damping,
        error,
        target_velocity,
        range,
        force: 0.0,
    };
    let drive =
        tree.drives[joint].map(|d| row(d.kp, d.kd, d.target - q, d.target_velocity, (-d.effort, d.effort)));
    // A stop answers within about two steps whatever the inertia: k dt² and c dt are of the order of it.
    let rate = if drive.is_some() { STOP_RATE } else { FIRM_RATE };
    let (k, c) = (rate * inertia / (dt * dt), STOP_RATE * inertia / dt);
    // What has no drive may be struck within the step.
    let near = |distance: f64| {
        drive.is_none() || distance < 2.0 * v.abs() * dt + 0.02 * (link.upper - link.lower).min(1.0)
    };
    let low = near(q - link.lower).then(|| row(k, 0.0, link.lower - q, 0.0, (0.0, f64::INFINITY)));
    let high = near(link.upper - q).then(|| row(k, 0.0, link.upper - q, 0.0, (f64::NEG_INFINITY, 0.0)));
    let fast = v.abs() > 0.5 * link.velocity_limit && link.velocity_limit.is_finite();
    let limit = link.velocity_limit;
    let brake_up = fast.then(|| row(0.0, 10.0 * c, 0.0, limit, (f64::NEG_INFINITY, 0.0)));
    let brake_down = fast.then(|| row(0.0, 10.0 * c, 0.0, -limit, (0.0, f64::INFINITY)));
    let bristle = &tree.bristles[joint];
    let dry = (link.friction > 0.0)
        .then(|| row(bristle.stiffness, 0.0, bristle.from - q, 0.0, (-link.friction, link.friction)));
    [drive, low, high, brake_up, brake_down, dry].into_iter().flatten()
}
