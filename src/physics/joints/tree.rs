//! Data of a joint tree, and its validation.

use nalgebra::{DVector, Unit};

use softvt_geometry::{Mat3, Pose, Vec3};

/// Type of a joint: motion about or along a unit axis given in the joint frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// Rotation about the axis; the coordinate is an angle, rad.
    Revolute(Unit<Vec3>),
    /// Translation along the axis; the coordinate is a length, m.
    Prismatic(Unit<Vec3>),
}

impl JointKind {
    /// Pose of the link frame in the joint frame at coordinate `q` (rad or m).
    pub fn motion(&self, q: f64) -> Pose {
        match self {
            Self::Revolute(axis) => {
                Pose::from_parts(Vec3::zeros().into(), softvt_geometry::Quat::from_axis_angle(axis, q))
            }
            Self::Prismatic(axis) => Pose::translation(axis.x * q, axis.y * q, axis.z * q),
        }
    }
}

/// A rigid link and the joint that connects it to its parent. The link frame is the joint frame moved by the joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Name, for messages.
    pub name: String,
    /// Index of the parent link, always below the own index; `None` for a link on the base.
    pub parent: Option<usize>,
    /// Joint frame in the parent's link frame (in the base frame if there is no parent).
    pub placement: Pose,
    /// Type of the joint.
    pub kind: JointKind,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub com: Vec3,
    /// Inertia tensor about the centre of mass, axes of the link frame, kg m².
    pub inertia: Mat3,
    /// Lower limit of the joint coordinate, rad or m.
    pub lower: f64,
    /// Upper limit of the joint coordinate, rad or m.
    pub upper: f64,
    /// Limit of the joint speed, rad/s or m/s; may be infinite.
    pub velocity_limit: f64,
    /// Limit of the drive effort, N m or N.
    pub effort_limit: f64,
    /// Coulomb friction of the joint, N m or N.
    pub friction: f64,
    /// Viscous damping coefficient of the joint, N m s/rad or N s/m.
    pub damping: f64,
}

impl Link {
    /// Adds a rigidly attached body of `mass` (kg), with the centre of mass `com` (m) and the inertia about it (kg
    /// m²) given in `frame`, which is a pose in the link frame. By the parallel-axis theorem (e.g. Goldstein,
    /// Classical Mechanics, 1980, §5-3).
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

/// A fixed-base tree of links with one joint each. Degree of freedom `i` is the joint of link `i`.
#[derive(Clone, Debug, PartialEq)]
pub struct JointTree {
    /// The links; parents precede their children.
    pub links: Vec<Link>,
    /// Base frame in the world.
    pub base_w: Pose,
}

impl JointTree {
    /// Number of degrees of freedom.
    pub fn dofs(&self) -> usize {
        self.links.len()
    }

    /// Checks the order of the links, their mass properties and their limits.
    ///
    /// # Errors
    /// The first invalid link.
    pub fn validate(&self) -> Result<(), JointTreeError> {
        for (index, link) in self.links.iter().enumerate() {
            let wrong = |what: String| Err(JointTreeError { link: link.name.clone(), what });
            if let Some(parent) = link.parent.filter(|&parent| parent >= index) {
                return wrong(format!(
                    "its parent has index {parent}, but parents must precede link {index}"
                ));
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

/// The reason why an inertia tensor is not physical, if it is not. Its principal moments must be positive, and
/// none may exceed the sum of the other two (Traversaro et al., Identification of fully physical consistent
/// inertial parameters, IROS 2016).
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

/// An invalid link of a joint tree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("link {link}: {what}")]
pub struct JointTreeError {
    /// Name of the link.
    pub link: String,
    /// The invalid value, and the expected one.
    pub what: String,
}

/// Joint coordinates and speeds of a joint tree.
#[derive(Clone, Debug, PartialEq)]
pub struct JointState {
    /// Joint coordinates, rad or m.
    pub q: DVector<f64>,
    /// Joint speeds, rad/s or m/s.
    pub v: DVector<f64>,
}

impl JointState {
    /// A state at rest at the coordinates `q`.
    pub fn at_rest(q: &[f64]) -> Self {
        Self { q: DVector::from_column_slice(q), v: DVector::zeros(q.len()) }
    }
}
