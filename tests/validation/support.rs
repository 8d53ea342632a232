//! The squeeze: a soft body on a table between two flat sharp pads that close, wait, lift and hold.
//!
//! x is the squeeze axis, z is up, the table is z = 0. The time line is that of `tests/reference/README.md` and of the
//! peers: 0.10 s of rest, closing at 40 mm/s a pad from 2 mm of clearance, 0.25 s of waiting, a lift of 1 s along a
//! quintic, and the hold.

use softvt::{
    evaluation::deformation::ReferenceShape,
    geometry::{Pose, Quat, Vec3, samples::SampleSpec, shape::Shape},
    physics::{
        BodyId, ColliderId, KinematicId, PhysicsParams, SoftId, World, contact::Friction,
        fem::ElasticMaterial, world::StepFailure,
    },
};

pub use crate::bodies::GRAVITY;
use crate::bodies::fem_model;

/// FemModel before the pads close, s.
const REST_S: f64 = 0.10;
/// Closing speed of each pad, m/s, and its clearance before, m.
const CLOSING: f64 = 0.040;
const CLEARANCE: f64 = 0.002;
/// Time between closing and lift, and of the lift, s.
const WAIT_S: f64 = 0.25;
pub const LIFT_S: f64 = 1.0;
/// Half the thickness of a pad, m.
const PAD_DEPTH: f64 = 0.005;

/// A body of the squeeze; round ones lie along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    Cube {
        size: f64,
    },
    Sphere {
        radius: f64,
    },
    /// `length` is the total one.
    Capsule {
        radius: f64,
        length: f64,
    },
    Cylinder {
        radius: f64,
        length: f64,
    },
}

impl Body {
    pub fn shape(&self) -> Shape {
        let lie = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
        match *self {
            Self::Cube { size } => Shape::cuboid(Vec3::repeat(size)),
            Self::Sphere { radius } => Shape::Sphere { radius },
            Self::Capsule { radius, length } => {
                Shape::Capsule { radius, half_length: 0.5 * length - radius }.rotated(lie)
            }
            Self::Cylinder { radius, length } => {
                Shape::Cylinder { radius, half_height: 0.5 * length }.rotated(lie)
            }
        }
    }

    /// Its width between the pads, which is also its height, m.
    pub fn width(&self) -> f64 {
        match *self {
            Self::Cube { size } => size,
            Self::Sphere { radius } | Self::Capsule { radius, .. } | Self::Cylinder { radius, .. } => {
                2.0 * radius
            }
        }
    }
}

/// One squeeze. SI units.
#[derive(Clone, Copy, Debug)]
pub struct Squeeze {
    pub body: Body,
    pub resolution: usize,
    pub youngs_pa: f64,
    pub poisson: f64,
    pub density: f64,
    /// Static and dynamic, of pads and table.
    pub friction: f64,
    pub beta: f64,
    pub average_acceleration: bool,
    pub dt: f64,
    pub pad: f64,
    /// Of the pads' centres from mid-height and mid-length, y and z.
    pub pad_offset: [f64; 2],
    pub gap: f64,
    pub lift: f64,
    pub hold_s: f64,
    /// True if there are gravity and a table from the start.
    pub grounded: bool,
}

impl Default for Squeeze {
    fn default() -> Self {
        Self {
            body: Body::Cube { size: 0.05 },
            resolution: 6,
            youngs_pa: 3e4,
            poisson: 0.4,
            density: 300.0,
            friction: 1.2,
            beta: 2e-3,
            average_acceleration: true,
            dt: 1.0 / 60.0,
            pad: 0.022,
            pad_offset: [0.0; 2],
            gap: 0.042,
            lift: 0.1,
            hold_s: 0.5,
            grounded: true,
        }
    }
}

impl Squeeze {
    /// The gap in millimetres.
    pub fn gap_mm(mut self, gap: f64) -> Self {
        self.gap = 1e-3 * gap;
        self
    }

    fn closing_s(&self) -> f64 {
        (0.5 * self.body.width() + CLEARANCE - 0.5 * self.gap) / CLOSING
    }

    pub fn lift_at(&self) -> f64 {
        REST_S + self.closing_s() + WAIT_S
    }

    /// Distance of each pad's face from the middle at time `t`, m.
    fn half_gap(&self, t: f64) -> f64 {
        0.5 * self.body.width() + CLEARANCE - CLOSING * (t - REST_S).clamp(0.0, self.closing_s())
    }
}

/// The quintic from 0 to 1 that starts and ends at rest.
pub fn quintic(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (-15.0 + 6.0 * s))
}

/// Measurements after a step.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    pub t: f64,
    /// From the rest shape, % of its diagonal.
    pub d_pct: f64,
    /// Of the centre of mass from its first place, in the hand's frame and in the world's, m.
    pub moved_h: Vec3,
    pub rise: f64,
    /// Mean of the two pads' normal forces, N, and sum of their friction bounds, N.
    pub force: f64,
    pub capacity: f64,
    pub min_det_f: f64,
    /// True if all samples of a pad are at their friction bound.
    pub sliding: bool,
}

/// A squeeze under way.
pub struct Scene {
    pub world: World,
    pub options: Squeeze,
    pads: [(KinematicId, ColliderId, f64); 2],
    reference: ReferenceShape,
    start: Vec3,
}

impl Scene {
    pub fn new(options: &Squeeze) -> Self {
        let shape = options.body.shape();
        let material =
            ElasticMaterial::new(options.youngs_pa, options.poisson, options.density).expect("valid");
        let rest = fem_model(&shape, material, options.resolution, &SampleSpec::default());
        let params = PhysicsParams {
            rayleigh_stiffness: options.beta,
            average_acceleration: options.average_acceleration,
            dt: options.dt,
            sleeping: false,
            ..PhysicsParams::default()
        };
        let mut world = World::new(params, Vec3::zeros());
        let friction = |mu: f64| Friction::new(mu, mu);
        let (smooth, rough) = (friction(0.0), friction(options.friction));
        let height = 0.5 * options.body.width();
        world.add_soft("body", rest.clone(), None, &Pose::translation(0.0, 0.0, height), smooth);
        if options.grounded {
            world.gravity = -GRAVITY * Vec3::z();
            let table = Shape::cuboid(Vec3::new(1.0, 1.0, 0.1));
            world.add_shape("table", BodyId::World, Pose::translation(0.0, 0.0, -0.05), &table, rough);
        }
        let size = Vec3::new(2.0 * PAD_DEPTH, options.pad, options.pad);
        let pads = [-1.0, 1.0].map(|side| {
            let frame = world.add_kinematic(pad_pose(options, side, 0.0, &Pose::identity()));
            let shape = Shape::cuboid(size);
            (frame, world.add_shape("pad", frame, Pose::identity(), &shape, rough), side)
        });
        let reference = ReferenceShape::new(&rest.mesh.nodes, &rest.mass).expect("a body with size");
        let start = world.soft_bodies()[0].state.centre();
        Self { world, options: *options, pads, reference, start }
    }

    /// One step towards the pads' place on the time line, with the hand at `hand` (identity: where it closes).
    pub fn step(&mut self, hand: &Pose) -> Result<Seen, StepFailure> {
        self.advance(hand)?;
        Ok(self.seen(hand))
    }

    /// The same without measurements.
    pub fn advance(&mut self, hand: &Pose) -> Result<(), StepFailure> {
        let t = self.world.time() + self.options.dt;
        for (frame, _, side) in self.pads {
            self.world.move_kinematic(frame, pad_pose(&self.options, side, t, hand));
        }
        self.world.step()
    }

    pub fn seen(&self, hand: &Pose) -> Seen {
        let soft = &self.world.soft_bodies()[0];
        let centre = soft.state.centre();
        let pivot = Vec3::z() * (0.5 * self.options.body.width());
        let local = |p: &Vec3| hand.rotation.inverse() * (p - pivot - hand.translation.vector);
        let touches = self.pads.map(|(_, collider, _)| self.world.contact(SoftId::new(0), collider));
        Seen {
            t: self.world.time(),
            d_pct: self.reference.measure(&soft.state.x).map_or(f64::NAN, |d| d.v1_rms_pct),
            moved_h: local(&centre) - (self.start - pivot),
            rise: (centre - self.start).z,
            force: 0.5 * (touches[0].normal_force + touches[1].normal_force),
            capacity: touches[0].friction_capacity + touches[1].friction_capacity,
            min_det_f: soft.state.min_det_f().det_f,
            sliding: touches.iter().any(|t| t.slipping_points == t.points),
        }
    }

    /// The body's weight under 9.81 m/s², N.
    pub fn weight(&self) -> f64 {
        self.world.soft_bodies()[0].state.model.total_mass() * GRAVITY
    }
}

/// The hand turns about the middle between the pads.
fn pad_pose(options: &Squeeze, side: f64, t: f64, hand: &Pose) -> Pose {
    let [y, z] = options.pad_offset;
    let pivot = Pose::translation(0.0, 0.0, 0.5 * options.body.width());
    let offset = Pose::translation(side * (options.half_gap(t) + PAD_DEPTH), y, z);
    Pose::from(hand.translation) * pivot * Pose::from_parts(Vec3::zeros().into(), hand.rotation) * offset
}

/// Results of a squeeze.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    pub holds: bool,
    pub creep_mm_per_s: f64,
    pub d_grip_pct: f64,
    pub d_hold_pct: f64,
    pub d_peak_pct: f64,
    /// Standard deviation of the force over the hold's last 0.3 s, relative to its mean.
    pub ripple: f64,
    pub force_grip_n: f64,
    pub force_hold_n: f64,
    pub min_det_f: f64,
    pub failure: Option<StepFailure>,
}

/// Runs a squeeze to its end or to its failure.
pub fn run(options: &Squeeze) -> Outcome {
    let mut scene = Scene::new(options);
    let end = options.lift_at() + LIFT_S + options.hold_s;
    let steps = (end / options.dt).round() as usize;
    let mut seen = Vec::with_capacity(steps);
    let mut failure = None;
    for step in 1..=steps {
        let t = step as f64 * options.dt;
        let hand = Pose::translation(0.0, 0.0, options.lift * quintic((t - options.lift_at()) / LIFT_S));
        match scene.step(&hand) {
            Ok(now) => seen.push(now),
            Err(error) => {
                failure = Some(error);
                break;
            }
        }
    }
    Outcome { failure, ..summarise(options, &seen) }
}

fn summarise(options: &Squeeze, seen: &[Seen]) -> Outcome {
    let lift_at = options.lift_at();
    let grip: Vec<&Seen> = seen.iter().filter(|s| s.t > lift_at - 0.05 && s.t <= lift_at + 1e-9).collect();
    let end = lift_at + LIFT_S + options.hold_s;
    let hold: Vec<&Seen> = seen.iter().filter(|s| s.t > end - 0.3).collect();
    let rise = seen.last().map_or(0.0, |s| s.rise);
    let creep = match (hold.first(), hold.last()) {
        (Some(a), Some(b)) if b.t > a.t => 1e3 * (a.rise - b.rise) / (b.t - a.t),
        _ => 0.0,
    };
    let force = mean(&hold, |s| s.force);
    Outcome {
        holds: rise > 0.8 * options.lift,
        creep_mm_per_s: creep,
        d_grip_pct: mean(&grip, |s| s.d_pct),
        d_hold_pct: mean(&hold, |s| s.d_pct),
        d_peak_pct: seen.iter().map(|s| s.d_pct).fold(0.0, f64::max),
        ripple: mean(&hold, |s| (s.force - force).powi(2)).sqrt() / force.max(f64::MIN_POSITIVE),
        force_grip_n: mean(&grip, |s| s.force),
        force_hold_n: force,
        min_det_f: seen.iter().map(|s| s.min_det_f).fold(f64::INFINITY, f64::min),
        ..Outcome::default()
    }
}

fn mean(seen: &[&Seen], value: impl Fn(&Seen) -> f64) -> f64 {
    seen.iter().map(|s| value(s)).sum::<f64>() / seen.len().max(1) as f64
}
