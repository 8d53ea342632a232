//! A collider as other rigid colliders meet it: convex pieces where its shape is made of them, samples of its skin and its
//! distance field otherwise; or a compliant skin, which is felt where it is sampled.

use std::sync::OnceLock;

use super::manifold::{
    ContactPoint, Piece, SkinSamples, field::Skin, gel::gel_vs_shape, manifold, pieces, skin_samples,
};
use crate::geometry::{Aabb, Pose, Vec3, shape::Shape};

/// What rigid solids need to find their contact points.
#[derive(Debug)]
pub enum Solid {
    /// A hard shape.
    Hard(Box<Hard>),
    /// A compliant skin: it meets hard shapes at its samples, and other skins not at all.
    Gel(Vec<GelSample>),
}

/// A hard shape with what is derived from it.
#[derive(Debug)]
pub struct Hard {
    shape: Shape,
    pieces: Option<Vec<(Piece, Pose)>>,
    /// Chosen when first needed: it takes some milliseconds, and most colliders never meet a general shape.
    samples: OnceLock<SkinSamples>,
    /// The same: that of a displaced shape takes a search.
    bounds: OnceLock<Aabb>,
}

/// A material point of a compliant skin, in the collider's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GelSample {
    /// Where it is, m.
    pub p: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Area that it stands for, m².
    pub area: f64,
}

/// Says which pieces (or whose samples) a contact point belongs to, within a pair of solids.
pub type Part = u32;

impl Solid {
    /// The solid of a shape.
    pub fn new(shape: &Shape) -> Self {
        Self::Hard(Box::new(Hard {
            shape: shape.clone(),
            pieces: pieces(shape),
            samples: OnceLock::new(),
            bounds: OnceLock::new(),
        }))
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
        match (self, other) {
            (Self::Hard(mine), Self::Hard(theirs)) => mine.meet(pose, theirs, other_pose, margin, out),
            (Self::Gel(gel), Self::Hard(hard)) => {
                gel_vs_shape(gel, pose, hard.field(), other_pose, margin, &mut found);
                out.extend(found.drain(..).map(|point| (0, point)));
            }
            (Self::Hard(hard), Self::Gel(gel)) => {
                gel_vs_shape(gel, other_pose, hard.field(), pose, margin, &mut found);
                out.extend(found.drain(..).map(|point| (0, ContactPoint { n_w: -point.n_w, ..point })));
            }
            (Self::Gel(_), Self::Gel(_)) => {}
        }
    }
}

impl Solid {
    /// How far the deepest point of two hard solids is under the other's surface, m; 0 if they do not overlap. Compliant
    /// skins are not looked at.
    pub fn depth(&self, pose: &Pose, other: &Self, other_pose: &Pose) -> f64 {
        let (Self::Hard(mine), Self::Hard(theirs)) = (self, other) else { return 0.0 };
        let mut found = Vec::new();
        mine.meet(pose, theirs, other_pose, 0.0, &mut found);
        found.iter().map(|(_, point)| -point.phi).fold(mine.seed_depth(pose, theirs, other_pose), f64::max)
    }
}

impl Hard {
    /// Depth of the deepest place of either skin in the other's field, m. Pieces need none: their manifold is exact.
    fn seed_depth(&self, pose: &Pose, other: &Self, other_pose: &Pose) -> f64 {
        if self.pieces.is_some() && other.pieces.is_some() {
            return 0.0;
        }
        let deepest = |skin: &Self, from: &Pose, into: &Self, frame: &Pose| {
            let to = frame.inv_mul(from);
            let depth = |p: &Vec3| -into.shape.distance(&(to * nalgebra::Point3::from(*p)).coords);
            skin.samples().seeds.iter().map(depth).fold(0.0, f64::max)
        };
        deepest(self, pose, other, other_pose).max(deepest(other, other_pose, self, pose))
    }

    fn field(&self) -> (&Shape, &Aabb) {
        (&self.shape, self.bounds.get_or_init(|| self.shape.bounds()))
    }

    fn samples(&self) -> &SkinSamples {
        self.samples.get_or_init(|| skin_samples(&self.shape))
    }

    fn meet(
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
        let mine = Skin::new((self.samples(), &self.shape), pose, other.field(), other_pose);
        let theirs = Skin::new((other.samples(), &other.shape), other_pose, self.field(), pose);
        // What is smooth on one body carries only where neither has points that do.
        mine.fixed(margin, &mut found);
        let first = found.len();
        flip(&mut found);
        theirs.fixed(margin, &mut found);
        let second = found.len();
        flip(&mut found);
        mine.lowest(margin, &mut found);
        let third = found.len();
        flip(&mut found);
        theirs.lowest(margin, &mut found);
        flip(&mut found);
        let is_theirs = |i: usize| (first..second).contains(&i) || i >= third;
        out.extend(found.drain(..).enumerate().map(|(i, point)| (Part::from(is_theirs(i)), point)));
    }
}

/// Turns the normals around.
fn flip(points: &mut [ContactPoint]) {
    points.iter_mut().for_each(|point| point.n_w = -point.n_w);
}
