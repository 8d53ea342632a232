//! What a divided step reports: the means over its time of what its parts report, and sums of counts.

use super::{BodyContact, ContactSummary, World, snapshot::ColliderPoint};
use crate::solver::SolverStats;
use softvt_geometry::Vec3;

/// Sums over the parts of a step, each times its share of the step; empty for a step that is not divided.
#[derive(Clone, Debug, Default)]
pub(super) struct StepMeans {
    stats: SolverStats,
    /// Contacts of the soft and then of the rigid bodies.
    contacts: Vec<Vec<BodyContact>>,
    /// Forces of the drives of all articulations.
    drive_forces: Vec<f64>,
    /// Forces of the attachments.
    attachment_forces: Vec<Vec3>,
    /// Points of all patches.
    points: Vec<ColliderPoint>,
}

impl StepMeans {
    pub(super) fn clear(&mut self) {
        self.stats = SolverStats::default();
        self.contacts.iter_mut().for_each(Vec::clear);
        self.drive_forces.clear();
        self.attachment_forces.clear();
        self.points.clear();
    }

    /// Adds the counts of a solve, also of one that was refused.
    pub(super) fn add_stats(&mut self, found: &SolverStats) {
        self.stats = SolverStats {
            newton_steps: self.stats.newton_steps + found.newton_steps,
            max_newton_steps: self.stats.max_newton_steps.max(found.max_newton_steps),
            factorizations: self.stats.factorizations + found.factorizations,
        };
    }

    /// The points at which colliders pressed.
    pub(super) fn points(&self) -> &[ColliderPoint] {
        &self.points
    }

    fn add_contacts<'a>(&mut self, parts: impl Iterator<Item = &'a Vec<BodyContact>>, share: f64) {
        for (sums, part) in self.contacts.iter_mut().zip(parts) {
            for BodyContact { partner, summary } in part {
                let at = sums.iter().position(|sum| sum.partner == *partner).unwrap_or_else(|| {
                    sums.push(BodyContact { partner: *partner, summary: ContactSummary::default() });
                    sums.len() - 1
                });
                sums[at].summary.add_part(summary, share);
            }
        }
    }

    fn add_points(&mut self, part: Vec<ColliderPoint>, share: f64) {
        // Parts have nearly the same points in the same order.
        let mut next = 0;
        for mut found in part {
            let is_same = |sum: &ColliderPoint| {
                (sum.collider, sum.key, sum.point.partner) == (found.collider, found.key, found.point.partner)
                    && sum.point.face == found.point.face
            };
            let same = (next..self.points.len()).chain(0..next).find(|&at| is_same(&self.points[at]));
            found.point.pressure *= share;
            found.point.shear_p *= share;
            if let Some(at) = same {
                let (sum, ratio) = (&self.points[at].point, self.points[at].point.area / found.point.area);
                found.point.pressure += sum.pressure * ratio;
                found.point.shear_p += sum.shear_p * ratio;
                self.points[at] = found;
                next = at + 1;
            } else {
                self.points.push(found);
            }
        }
    }
}

impl World {
    /// Adds what a part of the step reports.
    pub(super) fn add_part(&mut self, share: f64) {
        let mut means = std::mem::take(&mut self.means);
        means.add_stats(&self.stats);
        let soft = self.soft.iter().map(|soft| &soft.contacts);
        means.contacts.resize_with(self.soft.len() + self.rigid.len(), Vec::new);
        means.add_contacts(soft.chain(self.rigid.iter().map(|rigid| &rigid.contacts)), share);
        let forces = || self.articulations.iter().flat_map(|articulation| &articulation.drive_forces);
        means.drive_forces.resize(forces().count(), 0.0);
        means.drive_forces.iter_mut().zip(forces()).for_each(|(sum, force)| *sum += share * force);
        means.attachment_forces.resize(self.attachments.len(), Vec3::zeros());
        let forces = means.attachment_forces.iter_mut().zip(&self.attachments);
        forces.for_each(|(sum, attachment)| *sum += attachment.force_w * share);
        means.add_points(self.solved_points(|_, _| true), share);
        self.means = means;
    }

    /// Reports the means in place of what the last part found. What fell asleep keeps that.
    pub(super) fn report_means(&mut self) {
        let Self { means, soft, rigid, articulations, attachments, .. } = self;
        self.stats = means.stats;
        let soft = soft.iter_mut().map(|soft| (soft.sleep.is_asleep, &mut soft.contacts));
        let rigid = rigid.iter_mut().map(|rigid| (rigid.sleep.is_asleep, &mut rigid.contacts));
        for ((is_asleep, contacts), sums) in soft.chain(rigid).zip(&mut means.contacts) {
            if !is_asleep {
                std::mem::swap(contacts, sums);
            }
        }
        let forces = articulations.iter_mut().flat_map(|articulation| &mut articulation.drive_forces);
        forces.zip(&means.drive_forces).for_each(|(force, mean)| *force = *mean);
        for (attachment, mean) in attachments.iter_mut().zip(&means.attachment_forces) {
            if attachment.is_awake() {
                attachment.force_w = *mean;
            }
        }
    }
}
