//! Assembly of the convex problem of a step from the state of the world: velocity blocks, frame Jacobians,
//! contacts and joint constraints.

use std::collections::HashMap;

use super::{
    Articulation, StepFailure, World,
    substeps::{mass_ratio, step_coefficients},
};
use crate::{
    contact::ColliderMotion,
    fem::rigid_motion::RigidVelocity,
    ids::{ArticulationId, BodyId, ColliderId, LinkId, RigidId, SoftId},
    joints,
    rigid::{TorqueFreeRotation, torque_free_rotation},
    solver::{BlockIdentity, Endpoint, FrameJacobian, ScalarConstraint, VelocityBlock},
    sparse::NotPositiveDefinite,
};
use softvt_geometry::{Pose, Vec3};

/// Distance to a surface within which a group's nodes are retained in the reduced system, m. The factor then does not
/// change when a contact begins. Each retained node adds to every step of the solver, so this is little more than the
/// gaps that open and close while bodies rest.
pub(super) const RETAIN_DISTANCE: f64 = 1e-3;
/// Stiffness and damping of joint stops, relative to the joint's inertia over a step.
const STOP_RATE: f64 = 0.5;
/// The same for the stops and the dry friction of joints without a drive, which have no other resistance.
const FIRM_RATE: f64 = 50.0;

/// Velocity block of each body in the current problem; `None` for one that sleeps.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockMap {
    pub soft: Vec<Option<usize>>,
    /// Rigid part of the motion of each soft body that is solved for its deviation from it; see
    /// [`World::add_soft_blocks`].
    pub rigid_parts: Vec<Option<RigidVelocity>>,
    /// Rigid motion of each assembly in flight, whose bodies are solved for their deviations from it.
    pub flights: Vec<Option<RigidVelocity>>,
    pub rigid: Vec<Option<usize>>,
    pub articulations: Vec<Option<usize>>,
    /// Torque-free rotation of each rigid body in this step.
    pub torque_free_rotations: Vec<TorqueFreeRotation>,
    momentum: Vec<Vec3>,
    /// Index of the Jacobian of each rigid body and link that is in contact.
    frames: HashMap<BodyId, usize>,
}

impl BlockMap {
    pub(super) fn soft(&self, id: SoftId) -> Option<usize> {
        self.soft[id.index()]
    }

    /// Rigid motion of the flight of an assembly.
    pub(super) fn flight(&self, assembly: Option<usize>) -> Option<RigidVelocity> {
        self.flights[assembly?]
    }
}

impl World {
    /// Updates pose and velocity of every collider.
    pub(super) fn update_collider_motions(&mut self) {
        let motions = self.colliders.iter().map(|c| self.collider_motion(c.parent, &c.pose_in_parent));
        self.motions = motions.collect();
    }

    fn collider_motion(&self, parent: BodyId, offset: &Pose) -> ColliderMotion {
        let at_rest = |pose: Pose| ColliderMotion {
            pose: pose * offset,
            linear: Vec3::zeros(),
            angular: Vec3::zeros(),
            origin: pose.translation.vector,
        };
        match parent {
            // `add_collider` accepts no soft body as parent.
            BodyId::World | BodyId::Soft(_) => at_rest(Pose::identity()),
            BodyId::Kinematic(id) => {
                let k = self.kinematic(id);
                let dt = self.params.dt;
                ColliderMotion {
                    linear: (k.next.translation.vector - k.pose.translation.vector) / dt,
                    angular: (k.next.rotation * k.pose.rotation.inverse()).scaled_axis() / dt,
                    ..at_rest(k.pose)
                }
            }
            BodyId::Rigid(id) => {
                let body = &self.rigid(id).state;
                ColliderMotion {
                    pose: body.object_w() * offset,
                    linear: body.v,
                    angular: body.w,
                    origin: body.pose_w.translation.vector,
                }
            }
            BodyId::Link(id) => {
                let Articulation { tree, poses, state, .. } = self.articulation(id.articulation);
                let velocities = joints::velocities(tree, poses, state.v.as_slice());
                ColliderMotion {
                    linear: velocities[id.index].linear,
                    angular: velocities[id.index].angular,
                    ..at_rest(poses[id.index])
                }
            }
        }
    }

    /// Builds the problem of this step.
    pub(super) fn assemble(&mut self) -> Result<(), StepFailure> {
        self.problem.clear(self.params.dt, self.params.dissipation_time);
        self.rows.clear();
        self.blocks.frames.clear();
        self.find_rigid_pairs();
        self.find_flights();
        self.add_soft_blocks()?;
        self.add_rigid_blocks();
        self.add_articulation_blocks();
        self.add_soft_collider_contacts();
        self.add_soft_soft_contacts();
        self.add_rigid_contacts();
        self.add_bonds();
        Ok(())
    }

    /// Adds the velocity system `A v = b` of each soft body.
    ///
    /// The tangent `K = Σ R K₀ Rᵀ` in `A` has the rotations of the *rest* shape as null directions. On the rotation of
    /// a strained body it acts as a brake. So a body without contact is solved for its deviation `w = v − v_r` from the
    /// rigid motion `v_r` with the momenta of `b`: `A w = b − (1 + α dt) M v_r`. What momenta `w` still has through `K`
    /// are removed ([`World::integrate`]), so linear and angular momentum are exact for any strain and any age of the
    /// factor. Bodies that are attached to each other, and otherwise touch nothing, are solved for their deviations
    /// from a common rigid motion. In contact, the brake is a force that the contacts balance, and that is zero at
    /// rest.
    fn add_soft_blocks(&mut self) -> Result<(), StepFailure> {
        let mass_ratio = mass_ratio(&self.params, self.last_dt);
        self.blocks.soft.clear();
        self.blocks.rigid_parts.clear();
        for (index, soft) in self.soft.iter_mut().enumerate() {
            if soft.sleep.is_asleep {
                self.blocks.soft.push(None);
                self.blocks.rigid_parts.push(None);
                continue;
            }
            let body = &soft.state;
            let c = step_coefficients(&self.params, self.last_dt, &body.model);
            soft.system.update(body, &c, soft.steps_awake).map_err(|NotPositiveDefinite| {
                StepFailure::Indefinite { step: self.step, body: soft.name.clone() }
            })?;
            let momentum = &mut self.blocks.momentum;
            momentum.clear();
            momentum.extend((0..body.x.len()).map(|n| {
                (body.v[n] * mass_ratio + self.gravity * c.dt) * body.model.mass[n] + body.force[n] * c.dt
            }));
            let rigid_part = match soft.assembly {
                Some(assembly) => self.blocks.flights[assembly],
                None if self.candidates.involves(SoftId::new(index)) => None,
                None => {
                    let undamped = momentum.iter().map(|p| p / c.mass);
                    Some(RigidVelocity::with_momenta(body, undamped))
                }
            };
            if c.start > 0.0 || (rigid_part.is_none() && c.rigid > 0.0) {
                let own = || RigidVelocity::with_momenta(body, body.momenta());
                let rigid = rigid_part.unwrap_or_else(own);
                let in_flight = rigid_part.is_some();
                soft.system.add_tangent(
                    body,
                    &c,
                    |v, x| match in_flight {
                        true => (v - rigid.at(x)) * c.start,
                        false => v * c.start + rigid.at(x) * c.rigid,
                    },
                    momentum,
                );
            }
            if let Some(rigid) = &rigid_part {
                for ((p, x), m) in momentum.iter_mut().zip(&body.x).zip(&body.model.mass) {
                    *p -= rigid.at(x) * (c.mass * m);
                }
            }
            let dim = 3 * soft.system.retained().len();
            let id = BodyId::Soft(SoftId::new(index));
            let identity = BlockIdentity { body: id, version: soft.system.retained_version() };
            let matrix = soft.system.take_matrix();
            let (rhs, v) = (vec![0.0; dim], vec![0.0; dim]);
            let mut block = VelocityBlock { dim, matrix, rhs, v, identity, ..VelocityBlock::default() };
            soft.system.reduce(momentum, &mut block.rhs);
            for (i, &node) in soft.system.retained().iter().enumerate() {
                let node = node as usize;
                let v = body.v[node] - rigid_part.map_or(Vec3::zeros(), |rigid| rigid.at(&body.x[node]));
                block.v[3 * i..3 * i + 3].copy_from_slice(v.as_slice());
            }
            self.blocks.rigid_parts.push(rigid_part);
            self.blocks.soft.push(Some(self.problem.blocks.len()));
            self.problem.blocks.push(block);
        }
        Ok(())
    }

    fn add_rigid_blocks(&mut self) {
        self.blocks.rigid.clear();
        self.blocks.torque_free_rotations.clear();
        let (dt, mass_ratio) = (self.params.dt, mass_ratio(&self.params, self.last_dt));
        for (index, rigid) in self.rigid.iter().enumerate() {
            let body = &rigid.state;
            let spin = torque_free_rotation(body, dt);
            self.blocks.torque_free_rotations.push(spin);
            if rigid.sleep.is_asleep {
                self.blocks.rigid.push(None);
                continue;
            }
            let (mass, inertia) = (body.mass * mass_ratio, body.inertia_w() * mass_ratio);
            let mut matrix = vec![0.0; 36];
            (0..3).for_each(|i| matrix[7 * i] = mass);
            for (r, c) in (0..9).map(|e| (e % 3, e / 3)) {
                matrix[(3 + c) * 6 + 3 + r] = inertia[(r, c)];
            }
            // In flight, the common rotation of the bodies includes that of this one without torque.
            let (v, w, end_w) = match self.blocks.flight(rigid.assembly) {
                Some(flight) => {
                    let w = body.w - flight.angular;
                    (body.v - flight.at(&body.pose_w.translation.vector), w, w)
                }
                None => (body.v, body.w, spin.end_w),
            };
            let linear = (v * mass_ratio + self.gravity * dt) * body.mass;
            let angular = inertia * end_w;
            let stack = |a: &Vec3, b: &Vec3| [a.as_slice(), b.as_slice()].concat();
            self.blocks.rigid.push(Some(self.problem.blocks.len()));
            self.problem.blocks.push(VelocityBlock {
                dim: 6,
                matrix,
                rhs: stack(&linear, &angular),
                v: stack(&v, &w),
                identity: BlockIdentity { body: BodyId::Rigid(RigidId::new(index)), version: 0 },
                ..VelocityBlock::default()
            });
        }
    }

    fn add_articulation_blocks(&mut self) {
        self.blocks.articulations.clear();
        let (dt, mass_ratio) = (self.params.dt, mass_ratio(&self.params, self.last_dt));
        let share = self.part_share();
        for (index, articulation) in self.articulations.iter_mut().enumerate() {
            let root = LinkId { articulation: ArticulationId::new(index), index: 0 };
            if articulation.sleep.is_asleep {
                self.blocks.articulations.push(None);
                continue;
            }
            let Articulation { tree, poses, state, .. } = articulation;
            let n = tree.dofs();
            let mut mass = joints::mass_matrix(tree, poses) * mass_ratio;
            let gravity = if articulation.has_gravity { self.gravity } else { Vec3::zeros() };
            let bias = joints::bias(tree, poses, state.v.as_slice(), &gravity);
            let rhs = &mass * &state.v - bias * dt;
            let block = self.problem.blocks.len();
            for i in 0..n {
                let damping = dt * articulation.tree.links[i].damping;
                let stiffness = FIRM_RATE * (mass[(i, i)] / mass_ratio + damping) / (dt * dt);
                articulation.friction[i].set_stiffness(stiffness, dt, articulation.state.q[i]);
                mass[(i, i)] += damping;
                let constraints = joint_constraints(articulation, i, block, mass[(i, i)], dt, share);
                self.problem.constraints.extend(constraints);
            }
            self.blocks.articulations.push(Some(block));
            self.problem.blocks.push(VelocityBlock {
                dim: n,
                matrix: mass.as_slice().to_vec(),
                rhs: rhs.as_slice().to_vec(),
                v: articulation.state.v.as_slice().to_vec(),
                identity: BlockIdentity { body: BodyId::Link(root), version: 0 },
                ..VelocityBlock::default()
            });
        }
    }

    /// The endpoint of a sample group of a soft body.
    pub(super) fn group_endpoint(&self, soft: SoftId, group: usize, block: usize) -> Endpoint {
        let soft = self.soft(soft);
        let group = &soft.state.model.groups[group];
        let mut at = [0; 8];
        for (at, &node) in at.iter_mut().zip(&group.nodes[..group.count]) {
            *at = 3 * soft.system.retained_index(node) as u32;
        }
        Endpoint::Nodes { block, at, count: group.count }
    }

    /// The endpoint of an element of a soft body.
    pub(super) fn element_endpoint(&self, soft: SoftId, element: u32, block: usize) -> Endpoint {
        let soft = self.soft(soft);
        let nodes = &soft.state.model.mesh.elements[element as usize];
        let at = nodes.map(|node| 3 * soft.system.retained_index(node) as u32);
        Endpoint::Nodes { block, at, count: 8 }
    }

    /// The endpoint of a rigid body or link; its Jacobian is added to the problem on first use. `Known` for what
    /// sleeps or has a prescribed motion.
    pub(super) fn body_endpoint(&mut self, body: BodyId) -> Endpoint {
        if let Some(&frame) = self.blocks.frames.get(&body) {
            return Endpoint::Frame(frame);
        }
        let (block, jacobian, origin) = match body {
            BodyId::World | BodyId::Kinematic(_) | BodyId::Soft(_) => return Endpoint::Known,
            BodyId::Rigid(id) => {
                let Some(block) = self.blocks.rigid[id.index()] else { return Endpoint::Known };
                let identity = (0..36).map(|e| if e % 7 == 0 { 1.0 } else { 0.0 }).collect();
                (block, identity, self.rigid(id).state.pose_w.translation.vector)
            }
            BodyId::Link(id) => {
                let block = self.blocks.articulations[id.articulation.index()];
                let Some(block) = block else { return Endpoint::Known };
                let Articulation { tree, poses, .. } = self.articulation(id.articulation);
                let jacobian = joints::jacobian(tree, poses, id.index).as_slice().to_vec();
                (block, jacobian, poses[id.index].translation.vector)
            }
        };
        let frame = self.problem.frames.len();
        self.problem.frames.push(FrameJacobian { block, jacobian, origin });
        self.blocks.frames.insert(body, frame);
        Endpoint::Frame(frame)
    }

    /// True if the motion of a body is known before the solve, because it is prescribed or the body sleeps.
    pub(super) fn is_known(&self, body: BodyId) -> bool {
        match body {
            BodyId::World | BodyId::Kinematic(_) => true,
            BodyId::Soft(id) => self.soft(id).is_asleep(),
            BodyId::Rigid(id) => self.rigid(id).is_asleep(),
            BodyId::Link(id) => self.articulation(id.articulation).is_asleep(),
        }
    }

    /// Identifiers of all colliders.
    pub(super) fn collider_ids(&self) -> impl Iterator<Item = ColliderId> + use<> {
        (0..self.colliders.len()).map(ColliderId::new)
    }

    /// Identifiers of all rigid bodies.
    pub(super) fn rigid_ids(&self) -> impl Iterator<Item = RigidId> + use<> {
        (0..self.rigid.len()).map(RigidId::new)
    }

    /// Identifiers of all soft bodies.
    pub(super) fn soft_ids(&self) -> impl Iterator<Item = SoftId> + use<> {
        (0..self.soft.len()).map(SoftId::new)
    }
}

/// Drive, stops, speed limit and dry friction of one joint; `inertia` is its diagonal entry of the mass matrix, and
/// `dt` a share of the whole step.
fn joint_constraints(
    articulation: &Articulation,
    joint: usize,
    block: usize,
    inertia: f64,
    dt: f64,
    share: f64,
) -> impl Iterator<Item = ScalarConstraint> + use<> {
    let link = &articulation.tree.links[joint];
    let (q, v) = (articulation.state.q[joint], articulation.state.v[joint]);
    let free = ScalarConstraint::free(block, joint);
    let pushes_up = ScalarConstraint { min_force: 0.0, ..free };
    let pushes_down = ScalarConstraint { max_force: 0.0, ..free };
    let drive = articulation.drives[joint].map(|drive| drive.constraint(block, joint, q));
    // Stops bring a joint to rest within about two steps whatever its inertia: k dt² and c dt are of the order of it.
    let rate = if drive.is_some() { STOP_RATE } else { FIRM_RATE };
    let (k, c) = (rate * inertia / (dt * dt), STOP_RATE * inertia / dt);
    // A joint without a drive may be struck within the step, so its stops are always present.
    let is_near = |distance: f64| {
        drive.is_none() || distance < 2.0 * v.abs() * dt + 0.02 * (link.upper - link.lower).min(1.0)
    };
    // A joint that a load has pressed beyond its stop returns within the time of a whole step: within that of a part,
    // it would be thrown.
    let lower = is_near(q - link.lower).then_some(ScalarConstraint {
        stiffness: k,
        error: (link.lower - q).min(share * (link.lower - q)),
        ..pushes_up
    });
    let upper = is_near(link.upper - q).then_some(ScalarConstraint {
        stiffness: k,
        error: (link.upper - q).max(share * (link.upper - q)),
        ..pushes_down
    });
    let limit = link.velocity_limit;
    let is_fast = v.abs() > 0.5 * limit && limit.is_finite();
    let brake_up =
        is_fast.then_some(ScalarConstraint { damping: 10.0 * c, target_velocity: limit, ..pushes_down });
    let brake_down =
        is_fast.then_some(ScalarConstraint { damping: 10.0 * c, target_velocity: -limit, ..pushes_up });
    let friction = articulation.friction[joint];
    let dry = (link.friction > 0.0).then(|| ScalarConstraint {
        stiffness: friction.stiffness,
        error: friction.anchor - q,
        min_force: -link.friction,
        max_force: link.friction,
        ..free
    });
    [drive, lower, upper, brake_up, brake_down, dry].into_iter().flatten()
}
