//! What a joint tree is: plain data and its check.

use nalgebra::{DVector, Unit};

use crate::geometry::{Mat3, Pose, Vec3};

/// How a link moves against its parent, about or along a unit axis given in the joint frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// Turns about the axis; the coordinate is an angle, rad.
    Revolute(Unit<Vec3>),
    /// Slides along the axis; the coordinate is a length, m.
    Prismatic(Unit<Vec3>),
}

impl JointKind {
    /// The motion of the link frame in the joint frame at coordinate `q` (rad or m).
    pub fn motion(&self, q: f64) -> Pose {
        match self {
            Self::Revolute(axis) => {
                Pose::from_parts(Vec3::zeros().into(), crate::geometry::Quat::from_axis_angle(axis, q))
            }
            Self::Prismatic(axis) => Pose::translation(axis.x * q, axis.y * q, axis.z * q),
        }
    }
}

/// A rigid link and the joint that carries it. The link frame is the joint frame moved by the joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Name, for messages.
    pub name: String,
    /// Index of the link that carries it; `None` for one that hangs on the base. Always below the own index.
    pub parent: Option<usize>,
    /// Joint frame in the parent's link frame (in the base frame if there is no parent).
    pub placement: Pose,
    /// How it moves.
    pub kind: JointKind,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub com: Vec3,
    /// Inertia tensor about the centre of mass, axes of the link frame, kg m².
    pub inertia: Mat3,
    /// Lowest joint coordinate, rad or m.
    pub lower: f64,
    /// Highest joint coordinate, rad or m.
    pub upper: f64,
    /// Largest joint speed, rad/s or m/s.
    pub velocity_limit: f64,
    /// Largest drive effort, N m or N.
    pub effort_limit: f64,
    /// Coulomb friction of the joint, N m or N.
    pub friction: f64,
    /// Viscous damping of the joint, N m s/rad or N s/m.
    pub damping: f64,
}

impl Link {
    /// Welds a further body to the link: `mass` in kg, `com` in m and `inertia` about it in kg m², both in `frame`,
    /// which is given in the link frame. Parallel-axis theorem (any mechanics text, e.g. Goldstein, Classical
    /// Mechanics, 1980, §5-3).
    pub fn weld(&mut self, mass: f64, com: &Vec3, inertia: &Mat3, frame: &Pose) {
        let turn = frame.rotation.to_rotation_matrix();
        let com = frame.transform_point(&(*com).into()).coords;
        let total = self.mass + mass;
        let mean = (self.com * self.mass + com * mass) / total;
        self.inertia += point_inertia(self.mass, &(self.com - mean))
            + turn.matrix() * inertia * turn.matrix().transpose()
            + point_inertia(mass, &(com - mean));
        self.mass = total;
        self.com = mean;
    }
}

/// Inertia about the origin of a point mass at `r`, kg m².
pub(super) fn point_inertia(mass: f64, r: &Vec3) -> Mat3 {
    (Mat3::identity() * r.norm_squared() - r * r.transpose()) * mass
}

/// A fixed-base tree of links, one joint each; degree of freedom `i` is link `i`'s joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointTree {
    /// The links; a parent comes before its children.
    pub links: Vec<Link>,
    /// Base frame in the world.
    pub base_w: Pose,
}

impl JointTree {
    /// Degrees of freedom.
    pub fn dofs(&self) -> usize {
        self.links.len()
    }

    /// Checks order, mass properties and limits.
    ///
    /// # Errors
    /// Names the first link that no mechanism could have, and what is wrong with it.
    pub fn validate(&self) -> Result<(), JointTreeError> {
        for (index, link) in self.links.iter().enumerate() {
            let wrong = |what: String| Err(JointTreeError { link: link.name.clone(), what });
            if let Some(parent) = link.parent.filter(|&parent| parent >= index) {
                return wrong(format!("its parent has index {parent}, but parents come before link {index}"));
            }
            if !(link.mass > 0.0 && link.mass.is_finite()) {
                return wrong(format!("mass is {} kg, expected a positive number", link.mass));
            }
            if let Some(what) = inertia_fault(&link.inertia) {
                return wrong(what);
            }
            if link.lower > link.upper || link.lower.is_nan() || link.upper.is_nan() {
                return wrong(format!(
                    "lower limit {} lies above the upper limit {}",
                    link.lower, link.upper
                ));
            }
            let bounds = [link.velocity_limit, link.effort_limit, link.friction, link.damping];
            if bounds.iter().any(|bound| bound.is_nan() || *bound < 0.0) {
                return wrong(format!("a limit, friction or damping is negative: {bounds:?}"));
            }
        }
        Ok(())
    }
}

/// Why no rigid body has this inertia tensor, if none has: its principal moments must be positive and none may
/// exceed the sum of the other two (Traversaro et al., Identification of fully physical consistent inertial
/// parameters, IROS 2016).
fn inertia_fault(inertia: &Mat3) -> Option<String> {
    if !(inertia - inertia.transpose()).iter().all(|gap| gap.abs() <= 1e-12 * inertia.norm()) {
        return Some("inertia tensor is not symmetric".into());
    }
    let moments = inertia.symmetric_eigenvalues();
    let possible = moments.min() > 0.0 && moments.sum() - moments.max() >= moments.max() * (1.0 - 1e-9);
    (!possible).then(|| {
        format!(
            "principal moments {:.3e}, {:.3e}, {:.3e} kg m² belong to no body: each must be positive and at most \
             the sum of the others",
            moments[0], moments[1], moments[2]
        )
    })
}

/// A link that no mechanism could have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("link {link}: {what}")]
pub struct JointTreeError {
    /// The link's name.
    pub link: String,
    /// What is wrong and what was expected.
    pub what: String,
}

/// Joint coordinates and speeds of a tree.
#[derive(Clone, Debug, PartialEq)]
pub struct JointState {
    /// Joint coordinates, rad or m.
    pub q: DVector<f64>,
    /// Joint speeds, rad/s or m/s.
    pub v: DVector<f64>,
}

impl JointState {
    /// At rest with coordinates `q`.
    pub fn at_rest(q: &[f64]) -> Self {
        Self { q: DVector::from_column_slice(q), v: DVector::zeros(q.len()) }
    }
}
