//! Rigid bodies on a gel pad of the solver, and the surface of the gel that the tactile sensor finds from it, against
//! the elastic layer that both are (`tests/reference/layer.py`).

use std::f64::consts::{PI, TAU};

use softvt::{
    geometry::{Mat3, Pose, Vec3, shape::Shape},
    physics::{
        ArticulationId, BodyId, ColliderId, LinkId, PhysicsParams, World,
        contact::Friction,
        joints::{JointKind, JointTree, Link},
        world::{ContactPatch, JointDrive},
    },
    robot::{PadSurface, tactile::GelSpec},
    sensing::tactile::{Gel, GelField, GelScratch, PadWrench, SkinMesh, TactileContact},
};

use crate::gel::{FLAT, Skin, flat_gel};

/// Stiffness of rigid discs on the layer.
#[derive(Clone, Copy, Debug)]
pub struct DiscStiffness {
    /// Radius, m.
    pub radius: f64,
    /// Of a frictionless press, N/m.
    pub normal: f64,
    /// Of a motion along the surface, stuck, N/m.
    pub sideways: f64,
    /// Of a turn about the normal, stuck, N m/rad.
    pub twist: f64,
}

const fn disc(radius: f64, normal: f64, sideways: f64, twist: f64) -> DiscStiffness {
    DiscStiffness { radius, normal, sideways, twist }
}

/// The reference's discs.
pub const DISCS: [DiscStiffness; 5] = [
    disc(2e-3, 4148.0, 1919.0, 6.33e-3),
    disc(3e-3, 8382.0, 3177.0, 2.15e-2),
    disc(4e-3, 14700.0, 4667.0, 5.28e-2),
    disc(6e-3, 34440.0, 8262.0, 0.192),
    disc(8e-3, 65630.0, 12740.0, 0.497),
];

/// Contact radius (m) and force times the radius of the ball (N m) of the reference's balls.
const BALLS: [(f64, f64); 9] = [
    (1e-3, 6.576e-4),
    (1.5e-3, 2.304e-3),
    (2e-3, 6.116e-3),
    (2.5e-3, 1.243e-2),
    (3e-3, 2.378e-2),
    (3.5e-3, 3.972e-2),
    (4e-3, 6.443e-2),
    (4.5e-3, 9.798e-2),
    (5e-3, 0.1457),
];

/// Radius of the contact of a ball of this radius (m) under a force (N), m: the reference's, as a power of the force
/// between its rows and below the first.
pub fn contact_radius(ball: f64, force: f64) -> f64 {
    let of = force * ball;
    let above = BALLS.iter().position(|row| row.1 > of).unwrap_or(BALLS.len() - 1).max(1);
    let (low, high) = (BALLS[above - 1], BALLS[above]);
    low.0 * (of / low.1).powf((high.0 / low.0).ln() / (high.1 / low.1).ln())
}

/// A rigid body on rails above a pad, which moves along z and x and turns about z.
pub struct Punch {
    pub world: World,
    pub pad: ColliderId,
    rails: ArticulationId,
}

impl Punch {
    /// A punch of this shape, whose lowest point is at the origin, that touches a pad with this friction, at this many
    /// steps per second.
    pub fn new(shape: &Shape, pad: PadSurface, friction: f64, rate: f64) -> Self {
        let params = PhysicsParams { dt: 1.0 / rate, sleeping: false, ..PhysicsParams::default() };
        let mut world = World::new(params, Vec3::zeros());
        let friction = Friction { static_mu: friction, dynamic_mu: friction, coated: true };
        let pad =
            pad.collider("pad", BodyId::World, Pose::identity(), friction, &pad.layer(&GelSpec::default()));
        let pad = world.add_collider(pad);
        let link = |name: &str, parent, kind| Link {
            name: name.to_owned(),
            parent,
            placement: Pose::identity(),
            kind,
            mass: 0.1,
            com: Vec3::zeros(),
            inertia: Mat3::identity() * 1e-4,
            lower: -10.0,
            upper: 10.0,
            velocity_limit: f64::INFINITY,
            effort_limit: f64::INFINITY,
            friction: 0.0,
            damping: 0.0,
        };
        let links = vec![
            link("z", None, JointKind::Prismatic(Vec3::z_axis())),
            link("x", Some(0), JointKind::Prismatic(Vec3::x_axis())),
            link("turn", Some(1), JointKind::Revolute(Vec3::z_axis())),
        ];
        let tree = JointTree { links, base_w: Pose::identity() };
        let drive =
            |kp| Some(JointDrive { kp, kd: 0.01 * kp, target: 0.0, target_velocity: 0.0, effort: 1e9 });
        let drives = vec![drive(1e7), drive(1e7), drive(1e4)];
        let rails = world.add_articulation("rails", tree, &[0.0; 3], drives, false);
        world.add_shape(
            "punch",
            LinkId { articulation: rails, index: 2 },
            Pose::identity(),
            shape,
            Friction::NONE,
        );
        Self { world, pad, rails }
    }

    /// Moves to a depth (m), a way along x (m) and an angle (rad), in this time, s.
    pub fn move_to(&mut self, target: [f64; 3], seconds: f64) {
        let steps = (seconds / self.world.params.dt).round().max(1.0) as usize;
        let start: Vec<f64> = self.drives().iter().flatten().map(|drive| drive.target).collect();
        let target = [-target[0], target[1], target[2]];
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            for (k, drive) in
                self.world.articulation_mut(self.rails).drives_mut().iter_mut().flatten().enumerate()
            {
                drive.target = start[k] + share * (target[k] - start[k]);
            }
            self.world.step().expect("a step");
        }
    }

    fn drives(&mut self) -> &mut [Option<JointDrive>] {
        self.world.articulation_mut(self.rails).drives_mut()
    }

    /// Contact of the pad.
    pub fn patch(&self) -> ContactPatch {
        self.world.patch(self.pad)
    }

    /// Force and moment on the pad.
    pub fn wrench(&self) -> PadWrench {
        PadWrench::from_patch(&self.patch())
    }

    /// Surface of the gel under the punch, which has this skin.
    pub fn field(&self, gel: &Gel, skin: &Skin) -> GelField {
        let patch = self.patch();
        let skins = [SkinMesh { vertices: &skin.vertices, triangles: &skin.triangles }];
        let wrench = PadWrench::from_patch(&patch);
        let contact = TactileContact { wrench, points: &patch.points, skins: &skins, substrate: None };
        GelField::solve(gel, &contact, &mut GelScratch::default()).expect("a good contact").expect("a force")
    }
}

/// A disc of this radius, m.
fn cylinder(radius: f64) -> Shape {
    Shape::Cylinder { radius, half_height: 5e-3 }.translated(Vec3::new(0.0, 0.0, 5e-3))
}

/// Depth of the presses of discs (m), and their motions along x (m) and about z (rad).
const PRESS: [f64; 3] = [1e-4, 1e-4, 0.02];
/// Friction at which nothing slips.
const STUCK: f64 = 100.0;

/// Stiffness of a disc in the solver at this many steps per second.
pub fn measured(radius: f64, rate: f64) -> DiscStiffness {
    let [depth, way, angle] = PRESS;
    let pressed = |friction: f64, way: f64, angle: f64| {
        let mut punch = Punch::new(&cylinder(radius), FLAT, friction, rate);
        for target in [[depth, 0.0, 0.0], [depth, way, angle]] {
            punch.move_to(target, 0.5);
            punch.move_to(target, 1.0);
        }
        punch.wrench()
    };
    DiscStiffness {
        radius,
        normal: pressed(0.0, 0.0, 0.0).normal() / depth,
        sideways: pressed(STUCK, way, 0.0).force.x / way,
        twist: pressed(STUCK, 0.0, angle).moment.z / angle,
    }
}

/// Share of a motion of a stuck disc that the surface of the gel follows at half of its radius, sideways and in a
/// twist.
pub fn followed(radius: f64) -> [f64; 2] {
    let ([depth, way, angle], gel) = (PRESS, flat_gel());
    let rim = |k: u32| {
        Vec3::new(radius * (TAU * f64::from(k) / 64.0).cos(), radius * (TAU * f64::from(k) / 64.0).sin(), 0.0)
    };
    let skin = Skin {
        vertices: [Vec3::zeros()].into_iter().chain((0..64).map(rim)).collect(),
        triangles: (0..64).map(|k| [0, 1 + (k + 1) % 64, 1 + k]).collect(),
    };
    let r = 0.5 * radius;
    let moved = |way: f64, angle: f64| {
        let mut punch = Punch::new(&cylinder(radius), FLAT, STUCK, 60.0);
        let fields = [[depth, 0.0, 0.0], [depth, way, angle]].map(|target| {
            punch.move_to(target, 0.5);
            punch.move_to(target, 1.0);
            punch.field(&gel, &skin)
        });
        // Mean over the points to the right, above, to the left and below.
        let at = |field: &GelField, k: u32| {
            let (sin, cos) = (0.25 * TAU * f64::from(k)).sin_cos();
            let [x, y, _] = field.displacement_at(&gel, r * cos, r * sin);
            if way > 0.0 { x / way } else { (cos * y - sin * x) / (angle * r) }
        };
        (0..4).map(|k| (at(&fields[1], k) - at(&fields[0], k)) / 4.0).sum()
    };
    [moved(way, 0.0), moved(0.0, angle)]
}

/// A ball that is pressed and sheared.
#[derive(Clone, Copy, Debug)]
pub struct PartialSlip {
    /// Shear force over the largest that friction holds.
    pub load: f64,
    /// Radius of what sticks over that of the contact: by the reference, in the solver, and in the surface of the gel.
    pub stick: [f64; 3],
    /// Share of the ball's motion that the gel follows in the middle and at the rim of the contact.
    pub followed: [f64; 2],
}

/// A ball of this radius (m) that is pressed by 0.5 mm and then moved along x in steps, at this many steps per second.
pub fn partial_slip(radius: f64, rate: f64) -> Vec<PartialSlip> {
    const FRICTION: f64 = 1.5;
    const DEPTH: f64 = 5e-4;
    // A point or cell slips if its shear is within this share of the bound.
    const SLIPS: f64 = 0.95;
    let gel = flat_gel();
    let skin = Skin::graph(|x, y| (x * x + y * y) / (2.0 * radius));
    let ball = Shape::Sphere { radius }.translated(Vec3::new(0.0, 0.0, radius));
    let mut punch = Punch::new(&ball, FLAT, FRICTION, rate);
    punch.move_to([DEPTH, 0.0, 0.0], 1.0);
    punch.move_to([DEPTH, 0.0, 0.0], 1.0);
    let still = punch.field(&gel, &skin);
    let rim = contact_radius(radius, punch.wrench().normal());
    let shares = (1..=6).map(|k| {
        let way = 1.5e-4 * f64::from(k);
        punch.move_to([DEPTH, way, 0.0], 0.5);
        punch.move_to([DEPTH, way, 0.0], 0.25);
        let (patch, wrench, field) = (punch.patch(), punch.wrench(), punch.field(&gel, &skin));
        let load = wrench.force.x / (FRICTION * wrench.normal());
        let contact = contact_radius(radius, wrench.normal());
        let radius_of = |area: f64| (area / PI).sqrt() / contact;
        let sticks = |p: f64, t: f64| p > 0.0 && t < SLIPS * FRICTION * p;
        let points = patch.points.iter().filter(|at| sticks(at.pressure, at.shear_p.norm()));
        let cells = (0..field.pressure.len())
            .filter(|&c| sticks(field.pressure[c], field.shear[0][c].hypot(field.shear[1][c])));
        let reference = contact_radius(radius, wrench.normal() * (1.0 - load)) / contact;
        let solver = radius_of(points.map(|at| at.area).sum());
        let surface = radius_of(cells.count() as f64 * gel.cell * gel.cell);
        let followed =
            |y: f64| (field.displacement_at(&gel, 0.0, y)[0] - still.displacement_at(&gel, 0.0, y)[0]) / way;
        PartialSlip { load, stick: [reference, solver, surface], followed: [0.0, rim].map(followed) }
    });
    shares.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discs_are_as_stiff_on_a_pad_as_on_the_layer() {
        for of in DISCS {
            for rate in [60.0, 240.0] {
                let found = measured(of.radius, rate);
                for (found, of) in [(found.normal, of.normal), (found.sideways, of.sideways)] {
                    assert!((found / of - 1.0).abs() < 0.05, "{rate} Hz, {of:?}: {found:?}");
                }
                assert!((found.twist / of.twist - 1.0).abs() < 0.14, "{rate} Hz, {of:?}: {found:?}");
            }
        }
    }

    #[test]
    fn the_gel_follows_what_sticks_to_it() {
        for DiscStiffness { radius, .. } in DISCS {
            let [sideways, twist] = followed(radius);
            assert!((0.95..1.15).contains(&sideways), "{radius} m: {sideways}");
            assert!((0.95..1.45).contains(&twist), "{radius} m: {twist}");
        }
    }

    #[test]
    fn a_sheared_ball_sticks_in_the_middle_and_slips_around_it() {
        for (radius, rate) in [(0.02, 60.0), (0.02, 240.0), (0.04, 60.0)] {
            for row in partial_slip(radius, rate) {
                assert!((0.0..0.8).contains(&row.load), "{radius} m, {rate} Hz: {row:?}");
                let [reference, solver, surface] = row.stick;
                assert!((solver / reference - 1.0).abs() < 0.12, "{radius} m, {rate} Hz: {row:?}");
                assert!((surface / reference - 1.0).abs() < 0.25, "{radius} m, {rate} Hz: {row:?}");
                let [middle, rim] = row.followed;
                assert!((0.95..1.15).contains(&middle) && rim < 0.62, "{radius} m, {rate} Hz: {row:?}");
            }
        }
    }
}
