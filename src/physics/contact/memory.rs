//! What contact samples remember between steps: stick anchors, last impulses, distance slipped.

use crate::geometry::Vec3;

/// Whom a contact sample touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// A collider, by id.
    Collider(usize),
    /// A soft body, by index.
    Soft(usize),
}

/// Ids from here on are soft bodies, counted from the top; `u32::MAX` is nobody.
const SOFT: u32 = 1 << 31;

impl Partner {
    /// The number under which contacts remember it.
    pub fn id(self) -> u32 {
        match self {
            Self::Collider(index) => index as u32,
            Self::Soft(index) => u32::MAX - 1 - index as u32,
        }
    }

    /// Whom a number stands for.
    pub fn of(id: u32) -> Self {
        if id < SOFT { Self::Collider(id as usize) } else { Self::Soft((u32::MAX - 1 - id) as usize) }
    }
}

/// Memory of one sample about one partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slot {
    /// The partner's [`Partner::id`]; `u32::MAX` if the slot is free.
    pub partner: u32,
    /// Step of the last contact; older than the last step means forgotten.
    pub step: u64,
    /// Stick anchor in the partner's frame (a soft partner's rest frame), m.
    pub anchor: Vec3,
    /// Normal impulse of the last step, N s.
    pub impulse: f64,
    /// Whether the pair of surfaces slides, so that dynamic friction acts.
    pub slipping: bool,
    /// How far the anchor has been dragged since first contact, m.
    pub travel: f64,
}

impl Slot {
    /// A first contact at `anchor`.
    pub fn fresh(partner: u32, anchor: Vec3) -> Self {
        Self { partner, step: 0, anchor, impulse: 0.0, slipping: false, travel: 0.0 }
    }
}

/// Memory of all samples of one body: two partners each. A contact is remembered for one step after it ended.
#[derive(Clone, Debug)]
pub struct Memory {
    slots: Vec<[Slot; 2]>,
}

impl Memory {
    /// No memory for `samples` samples.
    pub fn new(samples: usize) -> Self {
        Self { slots: vec![[Slot::fresh(u32::MAX, Vec3::zeros()); 2]; samples] }
    }

    /// What `sample` remembers of `partner` at the beginning of `step`.
    pub fn get(&self, sample: usize, partner: u32, step: u64) -> Option<&Slot> {
        self.slots[sample].iter().find(|slot| slot.partner == partner && slot.step + 1 == step)
    }

    /// Remembers `slot`, in place of the partner's old one, a forgotten one, or the weakest.
    pub fn put(&mut self, sample: usize, slot: Slot) {
        let slots = &mut self.slots[sample];
        let same = slots.iter().position(|s| s.partner == slot.partner);
        let stale = slots.iter().position(|s| s.step + 1 < slot.step);
        let weakest = if slots[0].impulse <= slots[1].impulse { 0 } else { 1 };
        slots[same.or(stale).unwrap_or(weakest)] = slot;
    }
}
