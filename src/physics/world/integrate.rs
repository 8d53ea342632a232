//! From the solution back to the state.

use super::{StepFailure, World, points::slid, sliding::Sliding};
use crate::{
    geometry::Vec3,
    physics::{contact::Slot, fem::spin, joints, rigid},
};

impl World {
    /// Takes over the velocities and moves everything.
    pub(super) fn integrate(&mut self) {
        let dt = self.params.dt;
        for (soft, block) in self.soft.iter_mut().zip(&self.layout.soft) {
            let Some(block) = block else { continue };
            let body = &mut soft.body;
            let block = &mut self.problem.blocks[*block];
            soft.system.complete(&block.v, &mut body.v);
            soft.system.give_back(std::mem::take(&mut block.matrix));
            spin::advance(body, dt);
            body.update_elastic();
            soft.min_det_f = body.min_det_f();
        }
        for (i, rigid) in self.rigid.iter_mut().enumerate() {
            let Some(block) = self.layout.rigid[i] else { continue };
            let v = &self.problem.blocks[block].v;
            let (linear, angular) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]));
            rigid::advance(&mut rigid.body, linear, angular, &self.layout.free_w[i], dt);
        }
        for (tree, block) in self.trees.iter_mut().zip(&self.layout.trees) {
            let Some(block) = block else { continue };
            tree.state.v.copy_from_slice(&self.problem.blocks[*block].v);
            tree.state.q.axpy(dt, &tree.state.v, 1.0);
            joints::forward_into(&tree.tree, tree.state.q.as_slice(), &mut tree.poses);
        }
        self.record_joints();
        self.kinematic.iter_mut().for_each(|k| k.pose = k.next);
    }

    /// Where dry friction holds the joints now, and drive forces: the first row of a driven joint is its drive.
    fn record_joints(&mut self) {
        for (tree, block) in self.trees.iter_mut().zip(&self.layout.trees) {
            let Some(block) = block else { continue };
            for ((bristle, link), q) in
                tree.bristles.iter_mut().zip(&tree.tree.links).zip(tree.state.q.iter())
            {
                let bend = link.friction / bristle.stiffness;
                bristle.from = bristle.from.clamp(q - bend, q + bend);
            }
            for (joint, drive) in tree.drives.iter_mut().enumerate() {
                let row = self.problem.scalars.iter().find(|r| r.block == *block && r.index == joint);
                if let (Some(drive), Some(row)) = (drive, row) {
                    drive.force = row.force;
                }
            }
        }
    }

    /// Updates anchors and impulses of the samples that had a row.
    pub(super) fn remember(&mut self) {
        let dt = self.params.dt;
        self.record_touches();
        let points = self.rows.iter().zip(&self.problem.points);
        let sliding = Sliding::of(points.clone().map(|(row, point)| (row.pair(), point)));
        for (row, point) in points {
            if point.normal_impulse <= 0.0 {
                continue;
            }
            let soft = &mut self.soft[row.soft];
            let mut slot = Slot {
                partner: row.partner,
                step: soft.steps,
                anchor: row.anchor,
                impulse: point.normal_impulse,
                slipping: sliding.slides(row.pair()),
                travel: row.travel,
            };
            let (stretch, excess) = slid(point, dt);
            if excess > 0.0 {
                slot.anchor += row.pull * (stretch.try_normalize(0.0).unwrap_or_default() * excess);
                slot.travel += excess;
            }
            soft.memory.put(row.candidate.sample, slot);
        }
    }

    /// Whether the state is still physics.
    pub(super) fn check(&mut self) -> Result<(), StepFailure> {
        let step = self.step;
        for soft in self.soft.iter_mut().filter(|s| !s.asleep) {
            if let Some(node) = soft.body.x.iter().position(|x| !x.iter().all(|c| c.is_finite())) {
                return Err(StepFailure::NotFinite { step, body: soft.name.clone(), node });
            }
            soft.inverted_for =
                if soft.min_det_f.0 <= 0.0 { soft.inverted_for + self.params.dt } else { 0.0 };
            if soft.inverted_for > self.params.inverted_after {
                let (body, element) = (soft.name.clone(), soft.min_det_f.1);
                return Err(StepFailure::Inverted {
                    step,
                    body,
                    element,
                    seconds: self.params.inverted_after,
                });
            }
        }
        self.check_bounds()
    }
}
