//! Attachments: nodes of a soft body that are bonded to the world, a kinematic frame, a rigid body or a link.
//!
//! A bond is a point of the contact problem without cut-offs: a stiff spring in all directions between a node and its
//! anchor on the other body. So both sides may move, and impulses on them are equal and opposite.

use std::ops::Range;

use super::World;
use crate::{
    fem::rigid_motion::RigidVelocity,
    ids::{AttachmentId, BodyId, SoftId},
    solver::{ContactCluster, ContactPoint, Endpoint},
};
use softvt_geometry::{Aabb, Vec3, shape::Shape};

/// Stiffness of a bond over E h, with Young's modulus E and the voxel edge h. The bonds of a clamp turn a beam of
/// length L by at most 4 h / (500 L) of its deflection.
const BOND_STIFFNESS: f64 = 500.0;
/// Distance outside of a region at which a node still belongs to it, relative to the voxel edge.
const ROUNDING: f64 = 1e-3;

/// Why a soft body cannot be attached.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AttachError {
    /// The other body is not in the world.
    #[error("{body} cannot be attached to {to:?}: this world has no such body")]
    Missing {
        /// Name of the soft body.
        body: String,
        /// The other body.
        to: BodyId,
    },
    /// The other body is the soft body itself.
    #[error("{body} cannot be attached to itself")]
    Itself {
        /// Name of the soft body.
        body: String,
    },
    /// The other body is soft.
    #[error("{body} cannot be attached to {to}, which is soft; attach it to a solid, a link or the world")]
    Soft {
        /// Name of the soft body.
        body: String,
        /// Name of the other body.
        to: String,
    },
    /// The region lies outside of the body.
    #[error(
        "the region lies outside of {body}; in the frame of its shape, the body is between {:?} and {:?} m",
        millimetres(&bounds.min), millimetres(&bounds.max)
    )]
    Outside {
        /// Name of the soft body.
        body: String,
        /// Bounds of its voxels at rest, m, in the frame of its shape.
        bounds: Aabb,
    },
    /// The region has no node in it.
    #[error(
        "the region holds no node of {body}; its voxels are {:.1} mm wide: the body has no material there, or the region is \
         too thin",
        1e3 * edge
    )]
    Empty {
        /// Name of the soft body.
        body: String,
        /// Edge of its voxels, m.
        edge: f64,
    },
}

/// Coordinates in metres, rounded to millimetres.
fn millimetres(p: &Vec3) -> [f64; 3] {
    [0, 1, 2].map(|axis| (1e3 * p[axis]).round() / 1e3 + 0.0)
}

/// A node and its place on the other body.
#[derive(Clone, Copy, Debug)]
struct Bond {
    node: u32,
    /// Position in the frame of the other body, m.
    anchor: Vec3,
}

/// Nodes of a soft body that are bonded to another body.
#[derive(Clone, Debug)]
pub struct Attachment {
    /// The soft body.
    pub soft: SoftId,
    /// The body that holds the nodes, and may be held by them.
    pub to: BodyId,
    /// Force of the other body on the soft one in the last step in which it was awake, N, world.
    pub force_w: Vec3,
    /// Ascending by node.
    bonds: Vec<Bond>,
    /// Sample groups with such a node, ascending.
    groups: Vec<usize>,
    /// Stiffness of each bond, N/m.
    stiffness: f64,
    /// Points of the bonds in the problem of the current step.
    points: Range<usize>,
}

impl Attachment {
    /// The bonded nodes, ascending.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        self.bonds.iter().map(|bond| bond.node as usize)
    }

    /// True if its soft body was awake in the last step.
    pub(super) fn is_awake(&self) -> bool {
        !self.points.is_empty()
    }

    /// True if it bonds this soft body to this other body.
    pub(super) fn is_between(&self, soft: SoftId, to: BodyId) -> bool {
        self.soft == soft && self.to == to
    }

    /// True if a sample group of the soft body has a bonded node: it does not collide with the other body.
    pub(super) fn has_group(&self, group: usize) -> bool {
        self.groups.binary_search(&group).is_ok()
    }
}

impl World {
    /// Bonds the nodes of a soft body whose place at rest is in `region` to another body, where they are now.
    ///
    /// The region is in the frame of the body's shape, so that it is the same part of the body however the body lies.
    /// It may be larger than the body. `to` is the world, a kinematic frame, a free rigid body or a link: what moves it
    /// moves the nodes, and their force acts on it. Where it is bonded, the body does not collide with the colliders of
    /// `to`. Bodies that are attached to each other sleep and wake together. Wakes all bodies.
    ///
    /// ```
    /// use softvt_geometry::{Vec3, shape::Shape};
    /// use softvt_physics::{BodyId, World, fem::ElasticMaterial, world::SoftBodyBuilder};
    ///
    /// let rubber = ElasticMaterial::new(3e5, 0.3, 1000.0)?;
    /// let beam = Shape::cuboid(Vec3::new(0.1, 0.02, 0.02));
    /// let mut world = World::with_gravity();
    /// let beam = world.insert(SoftBodyBuilder::new(beam, rubber).resolution(10))?;
    /// let end = Shape::cuboid(Vec3::new(0.02, 0.04, 0.04)).translated(Vec3::new(-0.05, 0.0, 0.0));
    /// let clamp = world.attach(beam, &end, BodyId::World)?;
    /// world.run(2.0)?;
    /// let weight = 9.81 * 0.04;
    /// assert!((world.attachment(clamp).force_w.z - weight).abs() < 1e-3 * weight);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// `to` is soft or not in this world, or the region holds no node of the body.
    pub fn attach(
        &mut self,
        soft: SoftId,
        region: &Shape,
        to: impl Into<BodyId>,
    ) -> Result<AttachmentId, AttachError> {
        let to = to.into();
        let body = self.soft(soft).name.clone();
        match to {
            BodyId::Soft(other) if other == soft => return Err(AttachError::Itself { body }),
            BodyId::Soft(other) if other.index() < self.soft.len() => {
                return Err(AttachError::Soft { body, to: self.soft(other).name.clone() });
            }
            _ if !self.has_solid(to) => return Err(AttachError::Missing { body, to }),
            _ => {}
        }
        let frame = self.pose(to);
        let state = &self.soft(soft).state;
        let mesh = &state.model.mesh;
        let held = (0..).zip(&mesh.nodes).zip(&state.x);
        let held = held.filter(|((_, rest), _)| region.distance(rest) <= ROUNDING * mesh.edge);
        let bonds: Vec<Bond> = held
            .map(|((node, _), x)| Bond { node, anchor: frame.inverse_transform_point(&(*x).into()).coords })
            .collect();
        if bonds.is_empty() {
            let bounds = Aabb::from_points(&mesh.nodes).filter(|own| !own.intersects(&region.loose_bounds()));
            return Err(match bounds {
                Some(bounds) => AttachError::Outside { body, bounds },
                None => AttachError::Empty { body, edge: mesh.edge },
            });
        }
        let is_held = |node: &u32| bonds.binary_search_by_key(node, |bond| bond.node).is_ok();
        let groups = state.model.groups.iter().enumerate();
        let groups = groups.filter(|(_, group)| group.nodes[..group.count].iter().any(is_held));
        let attachment = Attachment {
            soft,
            to,
            force_w: Vec3::zeros(),
            groups: groups.map(|(index, _)| index).collect(),
            stiffness: BOND_STIFFNESS * state.model.material.youngs_pa() * mesh.edge,
            points: 0..0,
            bonds,
        };
        self.attachments.push(attachment);
        self.update_assemblies();
        self.wake_all();
        Ok(AttachmentId::new(self.attachments.len() - 1))
    }

    /// Marks the attached nodes, which are always retained in the reduced systems.
    pub(super) fn mark_attached(&mut self) {
        for attachment in &self.attachments {
            let soft = &mut self.soft[attachment.soft.index()];
            if !soft.sleep.is_asleep {
                attachment.bonds.iter().for_each(|bond| soft.system.mark(bond.node, soft.steps_awake));
            }
        }
    }

    /// Adds the bonds of soft bodies that are awake to the problem, after all contacts.
    pub(super) fn add_bonds(&mut self) {
        let mut attachments = std::mem::take(&mut self.attachments);
        for attachment in &mut attachments {
            let first = self.problem.points.len();
            if let Some(block) = self.blocks.soft(attachment.soft) {
                self.push_bonds(attachment, block);
            }
            attachment.points = first..self.problem.points.len();
        }
        self.attachments = attachments;
    }

    fn push_bonds(&mut self, attachment: &Attachment, block: usize) {
        let Attachment { soft, to, stiffness, ref bonds, .. } = *attachment;
        let (b, pose) = (self.body_endpoint(to), self.pose(to));
        let carried = self.prescribed_motion(soft, to);
        for same in bonds.chunks(8) {
            let first = self.problem.points.len();
            let (mut at, body) = ([0; 8], &self.soft[soft.index()]);
            for (index, (at, bond)) in at.iter_mut().zip(same).enumerate() {
                *at = 3 * body.system.retained_index(bond.node) as u32;
                let p = body.state.x[bond.node as usize];
                let stretch = p - (pose * nalgebra::Point3::from(bond.anchor)).coords;
                let mut weights_a = [0.0; 8];
                weights_a[index] = 1.0;
                // Any normal will do, since both springs are equal.
                self.problem.points.push(ContactPoint {
                    weights_a,
                    p,
                    normal: Vec3::z(),
                    drift: carried.at(&p),
                    stiffness,
                    shear_stiffness: stiffness,
                    gap: stretch.z,
                    offset: Vec3::new(stretch.x, stretch.y, 0.0),
                    is_bonded: true,
                    ..ContactPoint::default()
                });
            }
            let a = Endpoint::Nodes { block, at, count: same.len() };
            self.problem.clusters.push(ContactCluster { a, b, first, last: self.problem.points.len() });
        }
    }

    /// Velocity of the nodes of a soft body that a body of prescribed motion carries along: that of a rigid body whose
    /// centre moves from its place on the frame to the one after the step. So the nodes end on the arc of their
    /// anchors.
    fn prescribed_motion(&self, soft: SoftId, to: BodyId) -> RigidVelocity {
        let (centre, dt) = (self.soft(soft).state.centre(), self.params.dt);
        let BodyId::Kinematic(id) = to else {
            return RigidVelocity { centre, linear: Vec3::zeros(), angular: Vec3::zeros() };
        };
        let frame = self.kinematic(id);
        let moved = frame.next * frame.pose.inverse_transform_point(&centre.into());
        let turn = frame.next.rotation * frame.pose.rotation.inverse();
        RigidVelocity { centre, linear: (moved.coords - centre) / dt, angular: turn.scaled_axis() / dt }
    }

    /// Sums up the solved forces of the bonds.
    pub(super) fn record_bonds(&mut self) {
        for attachment in self.attachments.iter_mut().filter(|attachment| attachment.is_awake()) {
            let points = self.problem.points[attachment.points.clone()].iter();
            let impulses = points.map(|point| point.normal * point.normal_impulse + point.shear_impulse);
            attachment.force_w = impulses.sum::<Vec3>() / self.params.dt;
        }
    }
}

#[cfg(test)]
mod tests;
