//! Typed identifiers of the objects in a [`World`](super::World).
//!
//! Every `World::add_*` returns the identifier of what it added. Identifiers are dense indices in order of insertion
//! and objects are never removed, so one stays valid for the life of its world and of every clone of it. They index
//! the lists of a [`WorldSnapshot`](super::world::WorldSnapshot) as well ([`SoftId::index`]).

macro_rules! typed_id {
    ($(#[$doc:meta])* $name:ident $(, $body:ident)?) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(u32);

        impl $name {
            /// The identifier of the object that was added to its world after `index` others of its type.
            pub const fn new(index: usize) -> Self {
                Self(index as u32)
            }

            /// Position in the list of its type, counted from 0.
            pub const fn index(self) -> usize {
                self.0 as usize
            }
        }

        $(impl From<$name> for BodyId {
            fn from(id: $name) -> Self {
                Self::$body(id)
            }
        })?
    };
}

typed_id! {
    /// A finite-element soft body.
    SoftId, Soft
}
typed_id! {
    /// A free rigid body.
    RigidId, Rigid
}
typed_id! {
    /// An articulation: a fixed-base tree of links and joints.
    ArticulationId
}
typed_id! {
    /// A kinematic frame, whose motion is prescribed.
    KinematicId, Kinematic
}
typed_id! {
    /// Index of a collider in its world.
    ColliderId
}
typed_id! {
    /// Nodes of a soft body that are bonded to another body.
    AttachmentId
}

/// A link of an articulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LinkId {
    /// Articulation that has the link.
    pub articulation: ArticulationId,
    /// Index of the link in its tree, which is also that of the joint that carries it.
    pub index: usize,
}

/// Any body, or the world itself: the parent of a collider, of a camera or of a render mesh, and the body
/// of a scene object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BodyId {
    /// The world: it never moves.
    #[default]
    World,
    /// A frame that is moved from outside.
    Kinematic(KinematicId),
    /// A soft body, by its nodes.
    Soft(SoftId),
    /// A free rigid body, by its object frame.
    Rigid(RigidId),
    /// A link, by its link frame.
    Link(LinkId),
}

impl BodyId {
    /// True for soft bodies and free rigid bodies, which nothing but contact and gravity moves.
    pub const fn is_free(self) -> bool {
        matches!(self, Self::Soft(_) | Self::Rigid(_))
    }

    /// The soft body, if it is one.
    pub const fn soft(self) -> Option<SoftId> {
        match self {
            Self::Soft(id) => Some(id),
            _ => None,
        }
    }
}

impl From<LinkId> for BodyId {
    fn from(id: LinkId) -> Self {
        Self::Link(id)
    }
}

/// The other side of a contact. A soft body touches with its own surface, everything else with colliders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContactPartner {
    /// A collider of any body but a soft one.
    Collider(ColliderId),
    /// The surface of a soft body.
    Soft(SoftId),
}

impl From<ColliderId> for ContactPartner {
    fn from(id: ColliderId) -> Self {
        Self::Collider(id)
    }
}

impl From<SoftId> for ContactPartner {
    fn from(id: SoftId) -> Self {
        Self::Soft(id)
    }
}
