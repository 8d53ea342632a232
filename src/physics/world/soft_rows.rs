//! Rows between two soft bodies: the samples of each in the other's deformed rest field.

use super::{RowOf, World, assemble::REACH, points::Meeting};
use crate::{
    geometry::Vec3,
    physics::{
        contact::{Candidate, Partner, Pressing, Slot, SoftField, detect_soft, may_touch},
        solver::{Endpoint, Patch, Point},
    },
};

/// A sample of soft body `of` near soft body `on`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Press {
    of: usize,
    on: usize,
    pressing: Pressing,
}

impl World {
    /// Finds the samples of soft bodies that press on other soft bodies, and marks the nodes of both.
    pub(super) fn detect_pressing(&mut self) {
        self.pressing.clear();
        let limits = (self.params.dt, self.params.margin, REACH);
        let (mut found, mut marked) = (Vec::new(), Vec::new());
        for on in 0..self.soft.len() {
            let target = &self.soft[on];
            let Some(surface) = &target.surface else { continue };
            let mut field = None;
            for (of, soft) in self.soft.iter().enumerate() {
                let still = soft.asleep && target.asleep;
                if of == on || still || !may_touch(&soft.body, &target.body, limits) {
                    continue;
                }
                let field = field.get_or_insert_with(|| SoftField::new(&target.body, &**surface));
                found.clear();
                let nodes_on = &target.body.rest.mesh.elements;
                detect_soft(&soft.body, field, limits, &mut found, &mut |group, element| {
                    let group = &soft.body.rest.groups[group];
                    marked.extend(group.nodes[..group.count].iter().map(|&node| (of, node)));
                    marked.extend(nodes_on[element as usize].iter().map(|&node| (on, node)));
                });
                // The solver wants points of the same endpoints together.
                found.sort_by_key(|p| (p.group, p.felt.element));
                self.pressing.extend(found.iter().map(|&pressing| Press { of, on, pressing }));
            }
        }
        for (index, node) in marked {
            let soft = &mut self.soft[index];
            if !soft.asleep {
                soft.system.mark(node, soft.steps);
            }
        }
    }

    /// The patches and rows of what [`World::detect_pressing`] found.
    pub(super) fn pressing_patches(&mut self) {
        let pressing = std::mem::take(&mut self.pressing);
        let key = |p: &Press| (p.of, p.on, p.pressing.group, p.pressing.felt.element);
        for same in pressing.chunk_by(|a, b| key(a) == key(b)) {
            let first = self.problem.points.len();
            same.iter().for_each(|press| self.push_press(press));
            let Press { of, on, pressing } = same[0];
            let a = self.layout.soft[of].map(|block| self.nodes_of(of, pressing.group, block));
            let b = self.layout.soft[on].map(|block| self.element_of(on, pressing.felt.element, block));
            self.problem.patches.push(Patch {
                a: a.unwrap_or(Endpoint::Known),
                b: b.unwrap_or(Endpoint::Known),
                first,
                last: self.problem.points.len(),
            });
        }
        self.pressing = pressing;
    }

    fn element_of(&self, soft: usize, element: u32, block: usize) -> Endpoint {
        let soft = &self.soft[soft];
        let nodes = &soft.body.rest.mesh.elements[element as usize];
        Endpoint::Nodes { block, at: nodes.map(|node| 3 * soft.system.kept_index(node) as u32), count: 8 }
    }

    fn push_press(&mut self, press: &Press) {
        let (a, b) = (&self.soft[press.of], &self.soft[press.on]);
        let Pressing { group, sample, p, felt } = press.pressing;
        let partner = Partner::Soft(press.on).id();
        // The clock of a sleeping body stands still.
        let now = a.steps + u64::from(a.asleep);
        let slot = a.memory.get(sample, partner, now).copied();
        let held = slot.and_then(|slot| Some((slot, p - b.place_of(&slot.anchor)?)));
        let (slot, offset) = held.unwrap_or((Slot::fresh(partner, felt.surface_o), Vec3::zeros()));
        // Each surface is sampled, so each carries half, unless one has no field to press on.
        let share = if a.surface.is_some() { 0.5 } else { 1.0 };
        let data = &a.body.rest.samples[sample];
        let meeting = Meeting {
            p,
            normal: felt.normal,
            gap: felt.gap,
            area: data.surface.area * felt.coverage * share,
            stretch: offset,
            impulse: slot.impulse,
            sliding: slot.slipping,
        };
        let point = meeting.point(&a.friction.with(&b.friction), &a.layer.in_series(&b.layer));
        self.problem.points.push(Point { weights_a: data.weights, weights_b: felt.weights, ..point });
        let candidate =
            Candidate { group, sample, p, gap: felt.gap, normal: felt.normal, coverage: felt.coverage };
        let (soft, anchor, travel, pull) = (press.of, slot.anchor, slot.travel, felt.pull);
        self.rows.push(RowOf { soft, candidate, partner, anchor, travel, pull });
    }
}

impl super::Soft {
    /// Where a point given at rest (object frame, m) is now, world.
    fn place_of(&self, p_o: &Vec3) -> Option<Vec3> {
        let mesh = &self.body.rest.mesh;
        let at = mesh.locate(p_o)?;
        let nodes = &mesh.elements[at.element as usize];
        Some(at.weights().iter().zip(nodes).map(|(w, &node)| self.body.x[node as usize] * *w).sum())
    }
}
