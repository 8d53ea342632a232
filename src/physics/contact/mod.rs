//! Surfaces in contact: colliders with their friction and stiffness. Their detection is internal.
//!
//! Soft bodies touch with the samples of their surface: colliders by `detect`, other soft bodies by `detect_soft`.
//! Colliders touch each other by `CollisionGeometry::find_contacts`: manifolds of rigid bodies. The contacts become
//! contact points of the solver in [`World`](super::World), and `ContactHistory` keeps their state between steps.

mod collider;
mod contact_history;
mod detect;
mod layer;
mod manifold;
mod soft_field;
mod solid;

pub use collider::{Collider, ContactSurface, Friction, SurfaceStiffness};
pub(crate) use contact_history::{ContactHistory, ContactRecord};
pub(crate) use detect::{BodyBounds, ColliderMotion, ContactCandidate, DetectionLimits, detect};
pub(crate) use layer::LayerState;
pub use layer::{ElasticLayer, LayerMaterial, LayerResponse};
pub(crate) use manifold::ManifoldPoint;
pub use manifold::SurfaceFeatures;
pub(crate) use soft_field::{DeformedSdf, SdfCandidate, detect_soft, may_touch};
pub(crate) use solid::ContactPairId;
pub use solid::{CollisionGeometry, GelSample};
