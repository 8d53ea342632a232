//! Contact detection: colliders, contact samples of soft bodies, manifolds of rigid bodies, and the state that
//! contacts keep between steps.
//!
//! Soft bodies touch with the samples of their surface: colliders by [`detect`], other soft bodies by
//! [`detect_soft`]. Colliders touch each other by [`CollisionGeometry::find_contacts`]. The contacts become contact points of
//! the solver in [`World`](super::World).

mod collider;
mod contact_history;
mod detect;
pub mod manifold;
mod soft_field;
mod solid;

pub use collider::{Collider, ContactSurface, Friction, SurfaceStiffness};
pub use contact_history::{ContactHistory, ContactRecord};
pub use detect::{BodyBounds, ColliderMotion, ContactCandidate, DetectionLimits, detect};
pub use manifold::{ManifoldPoint, SurfaceFeatures};
pub use soft_field::{DeformedSdf, SdfCandidate, SdfContact, detect_soft, may_touch};
pub use solid::{CollisionGeometry, ContactPairId, GelSample};
