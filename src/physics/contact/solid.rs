//! A collider as other rigid colliders meet it: convex primitives where its shape is made of them, samples of its skin and its
//! distance field otherwise; or a compliant skin, which is felt where it is sampled.

use std::sync::OnceLock;

use super::manifold::{
    ManifoldPoint, Primitive, SkinSamples, field::Skin, gel::gel_vs_shape, manifold, primitives, skin_samples,
};
use crate::geometry::{Aabb, Pose, Vec3, shape::Shape};

/// What rigid solids need to find their contact points.
#[derive(Debug)]
pub enum CollisionGeometry {
    /// A hard shape.
    HardSolid(Box<HardSolid>),
    /// A compliant skin: it meets hard shapes at its samples, and other skins not at all.
    Gel(Vec<GelSample>),
}

/// A hard shape with what is derived from it.
#[derive(Debug)]
pub struct HardSolid {
    shape: Shape,
    primitives: Option<Vec<(Primitive, Pose)>>,
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

/// Says which primitives (or whose samples) a contact point belongs to, within a pair of solids.
pub type PairId = u32;

impl CollisionGeometry {
    /// The solid of a shape.
    pub fn new(shape: &Shape) -> Self {
        Self::HardSolid(Box::new(HardSolid {
            shape: shape.clone(),
            primitives: primitives(shape),
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
        out: &mut Vec<(PairId, ManifoldPoint)>,
    ) {
        let mut found = Vec::new();
        match (self, other) {
            (Self::HardSolid(mine), Self::HardSolid(theirs)) => {
                mine.meet(pose, theirs, other_pose, margin, out)
            }
            (Self::Gel(gel), Self::HardSolid(hard)) => {
                gel_vs_shape(gel, pose, hard.field(), other_pose, margin, &mut found);
                out.extend(found.drain(..).map(|point| (0, point)));
            }
            (Self::HardSolid(hard), Self::Gel(gel)) => {
                gel_vs_shape(gel, other_pose, hard.field(), pose, margin, &mut found);
                out.extend(found.drain(..).map(|point| (0, ManifoldPoint { n_w: -point.n_w, ..point })));
            }
            (Self::Gel(_), Self::Gel(_)) => {}
        }
    }
}

impl CollisionGeometry {
    /// How far the deepest point of two hard solids is under the other's surface, m; 0 if they do not overlap. Compliant
    /// skins are not looked at.
    pub fn depth(&self, pose: &Pose, other: &Self, other_pose: &Pose) -> f64 {
        let (Self::HardSolid(mine), Self::HardSolid(theirs)) = (self, other) else { return 0.0 };
        let mut found = Vec::new();
        mine.meet(pose, theirs, other_pose, 0.0, &mut found);
        found.iter().map(|(_, point)| -point.phi).fold(mine.seed_depth(pose, theirs, other_pose), f64::max)
    }
}

impl HardSolid {
    /// Depth of the deepest place of either skin in the other's field, m. Pieces need none: their manifold is exact.
    fn seed_depth(&self, pose: &Pose, other: &Self, other_pose: &Pose) -> f64 {
        if self.primitives.is_some() && other.primitives.is_some() {
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
        out: &mut Vec<(PairId, ManifoldPoint)>,
    ) {
        let mut found = Vec::new();
        if let (Some(mine), Some(theirs)) = (&self.primitives, &other.primitives) {
            for (i, (a, frame_a)) in mine.iter().enumerate() {
                for (j, (b, frame_b)) in theirs.iter().enumerate() {
                    manifold(a, &(pose * frame_a), b, &(other_pose * frame_b), margin, &mut found);
                    let part = (i * theirs.len() + j) as PairId;
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
        out.extend(found.drain(..).enumerate().map(|(i, point)| (PairId::from(is_theirs(i)), point)));
    }
}

/// Turns the normals around.
fn flip(points: &mut [ManifoldPoint]) {
    points.iter_mut().for_each(|point| point.n_w = -point.n_w);
}
