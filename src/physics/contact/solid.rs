//! A collider's shape as other rigid colliders meet it: convex pieces where it is made of them, samples of its skin and its
//! distance field otherwise.

use std::sync::OnceLock;

use super::manifold::{
    ContactPoint, Piece, SkinSamples, field::samples_vs_field, manifold, pieces, skin_samples,
};
use crate::geometry::{Pose, shape::Shape};

/// What rigid solids need to find their contact points.
#[derive(Debug)]
pub struct Solid {
    shape: Shape,
    pieces: Option<Vec<(Piece, Pose)>>,
    /// Chosen when first needed: it takes some milliseconds, and most colliders never meet a general shape.
    samples: OnceLock<SkinSamples>,
}

/// Says which pieces (or whose samples) a contact point belongs to, within a pair of solids.
pub type Part = u32;

impl Solid {
    /// The solid of a shape.
    pub fn new(shape: &Shape) -> Self {
        Self { shape: shape.clone(), pieces: pieces(shape), samples: OnceLock::new() }
    }

    fn samples(&self) -> &SkinSamples {
        self.samples.get_or_init(|| skin_samples(&self.shape))
    }

    /// Appends the contact points with `other` whose gap is below `margin` (m); normals point from this to the other.
    pub fn meet(
        &self,
        pose: &Pose,
        other: &Self,
        other_pose: &Pose,
        margin: f64,
        out: &mut Vec<(Part, ContactPoint)>,
    ) {
        let mut found = Vec::new();
        if let (Some(mine), Some(theirs)) = (&self.pieces, &other.pieces) {
            for (i, (a, frame_a)) in mine.iter().enumerate() {
                for (j, (b, frame_b)) in theirs.iter().enumerate() {
                    manifold(a, &(pose * frame_a), b, &(other_pose * frame_b), margin, &mut found);
                    let part = (i * theirs.len() + j) as Part;
                    out.extend(found.drain(..).map(|point| (part, point)));
                }
            }
            return;
        }
        samples_vs_field(self.samples(), &self.shape, pose, &other.shape, other_pose, margin, &mut found);
        out.extend(found.drain(..).map(|point| (0, point)));
        samples_vs_field(other.samples(), &other.shape, other_pose, &self.shape, pose, margin, &mut found);
        out.extend(found.drain(..).map(|point| (1, ContactPoint { n_w: -point.n_w, ..point })));
    }
}
