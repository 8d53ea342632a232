//! State of contact samples between steps: stick anchors, impulses, distance slipped.

use crate::ids::ContactPartner;
use softvt_geometry::Vec3;

/// State of one sample against one partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactRecord {
    /// The partner; `None` in an unused record.
    pub(crate) partner: Option<ContactPartner>,
    /// Step of the last contact. A record that is older than the previous step is stale.
    pub(crate) step: u64,
    /// Stick anchor in the partner's frame (for a soft partner its rest configuration), m.
    pub(crate) anchor: Vec3,
    /// Normal impulse of the last step, N s.
    pub(crate) normal_impulse: f64,
    /// Tangential impulse of the last step in the partner's frame, N s.
    pub(crate) shear_impulse: Vec3,
    /// True while the pair of surfaces slides, so that dynamic friction acts.
    pub(crate) is_sliding: bool,
    /// Distance by which the anchor was dragged since first contact, m.
    pub(crate) slip_distance: f64,
}

impl ContactRecord {
    const UNUSED: Self = Self {
        partner: None,
        step: 0,
        anchor: Vec3::new(0.0, 0.0, 0.0),
        normal_impulse: 0.0,
        shear_impulse: Vec3::new(0.0, 0.0, 0.0),
        is_sliding: false,
        slip_distance: 0.0,
    };

    /// The record of a first contact at `anchor`.
    pub(crate) fn first(partner: ContactPartner, anchor: Vec3) -> Self {
        Self { partner: Some(partner), anchor, ..Self::UNUSED }
    }
}

/// Records of all samples of one soft body, for two partners per sample. A contact is kept for one step after it ended.
#[derive(Clone, Debug)]
pub(crate) struct ContactHistory {
    records: Vec<[ContactRecord; 2]>,
}

impl ContactHistory {
    /// An empty history of a body with this many samples.
    pub(crate) fn new(samples: usize) -> Self {
        Self { records: vec![[ContactRecord::UNUSED; 2]; samples] }
    }

    /// The record of `sample` against `partner` at the beginning of `step`, unless it is stale.
    pub(crate) fn get(&self, sample: usize, partner: ContactPartner, step: u64) -> Option<&ContactRecord> {
        self.records[sample].iter().find(|record| record.partner == Some(partner) && record.step + 1 == step)
    }

    /// Stores `record`, replacing the partner's old one, a stale one, or the one of smaller impulse.
    pub(crate) fn put(&mut self, sample: usize, record: ContactRecord) {
        let records = &mut self.records[sample];
        let same = records.iter().position(|r| r.partner == record.partner);
        let stale = records.iter().position(|r| r.step + 1 < record.step);
        let weakest = if records[0].normal_impulse <= records[1].normal_impulse { 0 } else { 1 };
        records[same.or(stale).unwrap_or(weakest)] = record;
    }
}
