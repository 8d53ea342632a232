//! Collision geometry of a collider: how it meets other colliders.
//!
//! A rigid shape is either composed of convex primitives, whose manifolds are exact, or general: then its surface
//! features are tested in the other's distance field. A compliant skin (the gel of a tactile sensor) meets rigid
//! shapes at its samples.

use std::sync::{LazyLock, OnceLock};

use super::manifold::{ManifoldPoint, SurfaceFeatures, field::SurfaceInSdf, manifold, primitives};
use softvt_geometry::{
    Aabb, Pose, Vec3,
    convex::{Placed, Primitive},
    shape::Shape,
};

/// Geometry of a collider for contact with other colliders, in the collider's frame.
#[derive(Debug)]
pub enum CollisionGeometry {
    /// A rigid shape with its features.
    Rigid(Box<RigidShape>),
    /// A compliant skin: it meets rigid shapes at its samples, and no other skin.
    Gel(Vec<GelSample>),
}

/// A rigid shape and the data derived from it.
#[derive(Debug)]
pub struct RigidShape {
    shape: Shape,
    primitives: Option<Vec<Placed<Primitive>>>,
    /// Computed on first use: it takes milliseconds, and most colliders never meet a general shape.
    features: LazyLock<SurfaceFeatures, Box<dyn FnOnce() -> SurfaceFeatures + Send>>,
    /// Computed on first use, since the bounds of a displaced shape take a search.
    bounds: OnceLock<Aabb>,
}

/// A material point of a compliant skin, in the collider's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GelSample {
    /// Position, m.
    pub p: Vec3,
    /// Unit normal, out of the body.
    pub normal: Vec3,
    /// Area that it represents, m².
    pub area: f64,
}

/// The pair of primitives that a contact point belongs to, or, for general shapes, the body whose
/// surface feature it is.
pub(crate) type ContactPairId = u32;

/// A skin sample with a larger cosine between its normal and the shape's has the shape behind it.
const MAX_FACING_COSINE: f64 = 0.3;

impl CollisionGeometry {
    /// The geometry of a rigid shape.
    pub fn new(shape: &Shape) -> Self {
        let own = shape.clone();
        Self::with_features(shape, move || SurfaceFeatures::of(&own))
    }

    /// The geometry of a rigid shape whose `features`, those of [`SurfaceFeatures::of`], are computed on first use.
    pub fn with_features(shape: &Shape, features: impl FnOnce() -> SurfaceFeatures + Send + 'static) -> Self {
        Self::Rigid(Box::new(RigidShape {
            shape: shape.clone(),
            primitives: primitives(shape),
            features: LazyLock::new(Box::new(features)),
            bounds: OnceLock::new(),
        }))
    }

    /// Appends the contact points of `a` and `b` whose gap is below `margin` (m). Normals point from `a` to `b`.
    pub(crate) fn find_contacts(
        a: Placed<&Self>,
        b: Placed<&Self>,
        margin: f64,
        out: &mut Vec<(ContactPairId, ManifoldPoint)>,
    ) {
        match (a.shape, b.shape) {
            (Self::Rigid(shape_a), Self::Rigid(shape_b)) => {
                shape_a.find_contacts(&a.pose, shape_b, &b.pose, margin, out);
            }
            (Self::Gel(gel), Self::Rigid(rigid)) => {
                out.extend(rigid.gel_contacts(&b.pose, gel, &a.pose, margin).map(|point| (0, point)));
            }
            (Self::Rigid(rigid), Self::Gel(gel)) => {
                let points = rigid.gel_contacts(&a.pose, gel, &b.pose, margin);
                out.extend(points.map(|point| (0, ManifoldPoint { normal_w: -point.normal_w, ..point })));
            }
            (Self::Gel(_), Self::Gel(_)) => {}
        }
    }

    /// Depth of the deepest point of two rigid shapes under the other's surface, m; 0 if they do not overlap.
    /// Compliant skins are ignored.
    pub fn depth(a: Placed<&Self>, b: Placed<&Self>) -> f64 {
        let (Self::Rigid(shape_a), Self::Rigid(shape_b)) = (a.shape, b.shape) else { return 0.0 };
        let mut found = Vec::new();
        shape_a.find_contacts(&a.pose, shape_b, &b.pose, 0.0, &mut found);
        let seeds = shape_a.seed_depth(&a.pose, shape_b, &b.pose);
        found.iter().map(|(_, point)| -point.gap).fold(seeds, f64::max)
    }
}

impl RigidShape {
    /// Depth of the deepest surface seed of either shape in the other's field, m; 0 for primitives,
    /// whose manifold is exact.
    fn seed_depth(&self, pose: &Pose, other: &Self, other_pose: &Pose) -> f64 {
        if self.primitives.is_some() && other.primitives.is_some() {
            return 0.0;
        }
        let deepest = |surface: &Self, from: &Pose, into: &Self, frame: &Pose| {
            let to = frame.inv_mul(from);
            let seeds = surface.features().seeds.iter().map(|p| (to * nalgebra::Point3::from(*p)).coords);
            let inside = seeds.filter(|p| into.bounds().contains(p));
            inside.map(|p| -into.shape.distance(&p)).fold(0.0, f64::max)
        };
        deepest(self, pose, other, other_pose).max(deepest(other, other_pose, self, pose))
    }

    fn bounds(&self) -> &Aabb {
        self.bounds.get_or_init(|| self.shape.bounds())
    }

    fn features(&self) -> &SurfaceFeatures {
        &self.features
    }

    fn find_contacts(
        &self,
        pose: &Pose,
        other: &Self,
        other_pose: &Pose,
        margin: f64,
        out: &mut Vec<(ContactPairId, ManifoldPoint)>,
    ) {
        let mut found = Vec::new();
        if let (Some(own), Some(others)) = (&self.primitives, &other.primitives) {
            let moved = |part: &Placed<Primitive>, pose: &Pose| Placed { pose: pose * part.pose, ..*part };
            for (i, a) in own.iter().enumerate() {
                for (j, b) in others.iter().enumerate() {
                    manifold(&moved(a, pose), &moved(b, other_pose), margin, &mut found);
                    let pair = (i * others.len() + j) as ContactPairId;
                    out.extend(found.drain(..).map(|point| (pair, point)));
                }
            }
            return;
        }
        let own = self.in_field_of(pose, other, other_pose);
        let theirs = other.in_field_of(other_pose, self, pose);
        // Smooth parts carry only where neither surface has features that do, so features of both come first. Normals
        // are flipped in between, so that the points found so far agree with those being added.
        own.fixed(margin, &mut found);
        let first = found.len();
        flip_normals(&mut found);
        theirs.fixed(margin, &mut found);
        let second = found.len();
        flip_normals(&mut found);
        own.lowest(margin, &mut found);
        let third = found.len();
        flip_normals(&mut found);
        theirs.lowest(margin, &mut found);
        flip_normals(&mut found);
        let is_theirs = |i: usize| (first..second).contains(&i) || i >= third;
        out.extend(found.drain(..).enumerate().map(|(i, point)| (ContactPairId::from(is_theirs(i)), point)));
    }

    fn in_field_of<'a>(&'a self, pose: &Pose, other: &'a Self, other_pose: &'a Pose) -> SurfaceInSdf<'a> {
        SurfaceInSdf::new(self.features(), &self.shape, pose, &other.shape, other.bounds(), other_pose)
    }

    /// Contact points of a compliant skin at `gel_pose` with this shape whose gap is below `margin` (m).
    ///
    /// A point at each sample, compressed by the depth of the sample in the shape. A sample at a sharp edge of the
    /// shape counts with its covered share. Normals point from the skin to the shape.
    fn gel_contacts(
        &self,
        pose: &Pose,
        gel: &[GelSample],
        gel_pose: &Pose,
        margin: f64,
    ) -> impl Iterator<Item = ManifoldPoint> {
        let gel_in_shape = pose.inv_mul(gel_pose);
        let bounds = self.bounds();
        gel.iter().zip(0..).filter_map(move |(sample, feature)| {
            let p = (gel_in_shape * nalgebra::Point3::from(sample.p)).coords;
            // A sample beyond an edge may still cover it with half of its area.
            let reach = margin + 0.5 * sample.area.sqrt();
            if !bounds.loosened(reach).contains(&p) {
                return None;
            }
            let facing = gel_in_shape.rotation * sample.normal;
            let contact = self.shape.contact(&p, &facing, sample.area.sqrt());
            let is_behind = facing.dot(&contact.normal) > MAX_FACING_COSINE;
            if contact.gap >= margin || contact.coverage <= 0.0 || is_behind {
                return None;
            }
            Some(ManifoldPoint {
                position_w: (pose * nalgebra::Point3::from(p - contact.normal * (0.5 * contact.gap))).coords,
                normal_w: -(pose.rotation * contact.normal),
                gap: contact.gap,
                area: sample.area * contact.coverage,
                feature,
            })
        })
    }
}

fn flip_normals(points: &mut [ManifoldPoint]) {
    points.iter_mut().for_each(|point| point.normal_w = -point.normal_w);
}
