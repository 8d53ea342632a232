//! Update of the state from the solved velocities.

use super::World;
use crate::{fem::rigid_motion, joints, rigid};
use softvt_geometry::Vec3;

impl World {
    /// Sets the velocities at the end of the step and moves everything.
    pub(super) fn integrate(&mut self) {
        let dt = self.params.dt;
        for (soft, block) in self.soft.iter_mut().zip(&self.blocks.soft) {
            let Some(block) = block else { continue };
            let body = &mut soft.state;
            let block = &mut self.problem.blocks[*block];
            soft.system.complete(&block.v, &mut body.v);
            soft.system.return_matrix(std::mem::take(&mut block.matrix));
            rigid_motion::advance(body, dt);
            body.update_elastic();
            soft.min_det_f = body.min_det_f();
        }
        for (i, rigid) in self.rigid.iter_mut().enumerate() {
            let Some(block) = self.blocks.rigid[i] else { continue };
            let v = &self.problem.blocks[block].v;
            let (linear, angular) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]));
            rigid::advance(&mut rigid.state, linear, angular, &self.blocks.free_spins[i], dt);
        }
        for (articulation, block) in self.articulations.iter_mut().zip(&self.blocks.articulations) {
            let Some(block) = block else { continue };
            let state = &mut articulation.state;
            state.v.copy_from_slice(&self.problem.blocks[*block].v);
            state.q.axpy(dt, &state.v, 1.0);
            articulation.poses = joints::forward(&articulation.tree, state.q.as_slice());
        }
        self.record_joint_forces();
        self.kinematic.iter_mut().for_each(|k| k.pose = k.next);
    }

    /// Updates the anchors of dry friction and the forces of drives.
    fn record_joint_forces(&mut self) {
        for (articulation, block) in self.articulations.iter_mut().zip(&self.blocks.articulations) {
            let Some(block) = block else { continue };
            let joints = articulation.friction.iter_mut().zip(&articulation.tree.links);
            for ((friction, link), q) in joints.zip(articulation.state.q.iter()) {
                let stretch = link.friction / friction.stiffness;
                friction.anchor = friction.anchor.clamp(q - stretch, q + stretch);
            }
            for (joint, drive) in articulation.drives.iter_mut().enumerate() {
                // The first constraint of a driven joint is its drive.
                let constraint =
                    self.problem.constraints.iter().find(|c| c.block == *block && c.index == joint);
                if let (Some(drive), Some(constraint)) = (drive, constraint) {
                    drive.force = constraint.force;
                }
            }
        }
    }
}
