//! Worlds: the mechanics alone, for experiments that squeeze, drop and push without a robot.

use std::{
    fmt,
    sync::{Arc, Mutex},
    time::Duration,
};

use cpu_time::ThreadTime;
use mlua::{Lua, Value};

use super::{assets::STRAIN, experiment_input, shapes::LuaShape};
use crate::{
    schema::{ApiObject, Constructed, LuaType, Range, Type, class, functions, output, record},
    vm::{
        error::{app_data, fail, fail_at, library_is_running},
        memory_budget::{Reservation, reserve_in_world},
        value::finite,
        watchdog::Clock,
    },
};
use softvt_common::{
    cancel,
    parallel::lock,
    text::{format_number, significant},
};
use softvt_evaluation::deformation::{Deformation, ReferenceShape};
use softvt_geometry::{Pose, Quat, Vec3, shape::Shape};
use softvt_physics::{
    AttachmentId, BodyId, ColliderId, ContactPartner, KinematicId, PhysicsParams, SoftId, World,
    contact::Friction,
    fem::{FemState, StrainLimits, StrainMeter},
    world::{ContactSummary, Penetration, SoftBody, StepFailure},
};
use softvt_robot::{PadSpec, pads::PadSurface, tactile::GelSpec};
use softvt_rollout::{MAX_OVERLAP, SettledBox, soft_model};
use softvt_scene::SoftMaterial;

/// Approximate memory of a world and of one of its solids.
const BYTES_PER_WORLD: usize = 16 << 10;
const BYTES_PER_SOLID: usize = 4 << 10;
/// Memory of an attachment per node of its body, at most.
const BYTES_PER_NODE: usize = 64;

const POSITION: Type = Type::vector(3, "m");
/// Largest length over which strains are averaged, voxels.
const LARGEST_LENGTH: f64 = 8.0;
const AVERAGED: Type = Type::Number("m", Range::closed(1e-4, 0.1));
const PERCENT: Type = Type::Number("%", Range::closed(0.0, 100.0));
const AXIS_ANGLE: Type = Type::vector(3, "rad");

record! {
    /// A solid that moves as prescribed (kinematic) or never (static).
    WorldSolidSpec: "softvt.WorldSolid" as "world:solid" {
        /// Name of the solid in messages.
        name: String => Text("solid");
        /// Shape of the solid.
        shape: LuaShape;
        /// Friction of its surface.
        friction: Friction;
        /// Position of its frame.
        position: [f64; 3] = POSITION;
        /// Orientation; none by default.
        axis_angle: Option<[f64; 3]> = AXIS_ANGLE;
    }
}

/// The other side of an attachment.
#[derive(Clone)]
enum Holder {
    World,
    Solid(LuaSolid),
}

impl LuaType for Holder {
    const TYPE: Type = Type::OneOf(&[Type::Object(LuaSolid::NAME), Type::Choice(&["world"])]);

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        if value.is_string() { Ok(Self::World) } else { lua.unpack(value).map(Self::Solid) }
    }
}

record! {
    /// A gel pad of the robot on a rigid carrier that solid:move_to moves.
    WorldGelPadSpec: "softvt.WorldGelPad" as "world:gel_pad" {
        /// Name of the pad in messages.
        name: String => Text("gel pad");
        /// Position of its apex.
        position: [f64; 3] = POSITION;
        /// Orientation. Without one, the gel faces +x and its long side is vertical.
        axis_angle: Option<[f64; 3]> = AXIS_ANGLE;
    }
}

output! {
    /// Deformation of a body against its reference shape, in percent of the diagonal of its bounding box
    /// along its own axes.
    fn deformation_table(lua, deformation: &Deformation) -> "softvt.Deformation" as "deformation" {
        /// D: root mean square of the displacement over the volume.
        rms_pct: "number" = deformation.rms_pct;
        /// Largest displacement of a node.
        max_pct: "number" = deformation.max_pct;
        /// D as SoftVTBench's released code defines it: all nodes alike, the box along the axes of the world.
        v1_rms_pct: "number" = deformation.v1_rms_pct;
    }
}

/// CPU and simulated time of a named phase of an experiment.
#[derive(Debug)]
struct Phase {
    name: String,
    cpu: Duration,
    simulated_s: f64,
}

/// CPU time by phase, for standard error; never part of a result.
#[derive(Debug, Default)]
struct Timing {
    phases: Vec<Phase>,
}

impl Timing {
    fn start(&mut self, name: &str) {
        self.phases.push(Phase { name: name.to_owned(), cpu: Duration::ZERO, simulated_s: 0.0 });
    }

    /// Runs a step of `dt` (s) and adds its time to the present phase.
    fn measure<R>(&mut self, dt: f64, work: impl FnOnce() -> R) -> R {
        let start = ThreadTime::now();
        let result = work();
        if self.phases.is_empty() {
            self.start("run");
        }
        if let Some(phase) = self.phases.last_mut() {
            phase.cpu += start.elapsed();
            phase.simulated_s += dt;
        }
        result
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rate = |cpu: Duration, simulated_s: f64| cpu.as_secs_f64() / simulated_s.max(f64::MIN_POSITIVE);
        let cpu = self.phases.iter().map(|phase| phase.cpu).sum();
        let simulated_s = self.phases.iter().map(|phase| phase.simulated_s).sum();
        let parts = self.phases.iter();
        let parts = parts.map(|phase| format!("{} {:.3}", phase.name, rate(phase.cpu, phase.simulated_s)));
        let parts = parts.collect::<Vec<_>>().join(", ");
        write!(f, "cpu_s_per_sim_s: {:.3} ({parts})", rate(cpu, simulated_s))
    }
}

/// A soft body with the measures of its deformation.
struct MeasuredBody {
    shape: Shape,
    reference: ReferenceShape,
    strain: StrainMeter,
    stable_strain: Option<f64>,
}

struct Inner {
    world: World,
    /// Soft bodies by their index in the world.
    bodies: Vec<MeasuredBody>,
    failed: Option<StepFailure>,
    newton_total: u64,
    newton_max: u32,
    timing: Timing,
    clock: Clock,
    reserved: Vec<Reservation>,
}

impl Inner {
    /// Refuses a body or solid that has been added where it overlaps another.
    fn refuse_overlap(&mut self, lua: &Lua, added: ContactPartner) -> mlua::Result<()> {
        let found = self.world.penetrations(MAX_OVERLAP);
        // Surfaces of soft bodies are compared undeformed.
        let is_known = |penetration: &&Penetration| {
            let is_soft = penetration.bodies.iter().all(|body| matches!(body, ContactPartner::Soft(_)));
            penetration.bodies.contains(&added) && !(is_soft && self.world.time() > 0.0)
        };
        let mut found = found.iter().filter(is_known);
        let Some(penetration) = found.next() else { return Ok(()) };
        let [first, second] = penetration.bodies.map(|body| self.world.partner_name(body));
        let depth = significant(1e3 * penetration.depth, 3);
        Err(fail!(lua, "{first:?} and {second:?} overlap by {depth} mm; move them apart"))
    }
}

type SharedWorld = Arc<Mutex<Inner>>;

fn pose(position: [f64; 3], axis_angle: Option<[f64; 3]>) -> Pose {
    let rotation = axis_angle.map_or(Quat::identity(), |turn| Quat::from_scaled_axis(Vec3::from(turn)));
    Pose::from_parts(Vec3::from(position).into(), rotation)
}

/// Pad frame on a carrier whose x axis is the direction in which the gel faces and whose z axis is along its long side.
fn gel_pose_on_carrier() -> Pose {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // Half a turn about the bisector of x and z exchanges the two axes.
    let turn = Quat::new_unchecked(nalgebra::Quaternion::new(0.0, half, 0.0, half));
    Pose::from_parts(Vec3::zeros().into(), turn)
}

functions! {
    FUNCTIONS {
        /// Returns an empty world: soft bodies among fixed or prescribed solids, without a robot. Settings of the
        /// command line, --set physics.…, take precedence in experiments.
        fn world(lua) takes spec "softvt.WorldSpec" {
            /// Time step: the setting physics.dt, with its default and range.
            dt: Option<f64> = Type::Number("s", Range::ANY);
            /// Mass-proportional Rayleigh damping: the setting physics.rayleigh_mass.
            rayleigh_mass: Option<f64> = Type::Number("1/s", Range::ANY);
            /// Stiffness-proportional Rayleigh damping: the setting physics.rayleigh_stiffness.
            rayleigh_stiffness: Option<f64> = Type::Number("s", Range::ANY);
            /// True for average acceleration: the setting physics.average_acceleration.
            average_acceleration: Option<bool>;
            /// Gravity; {0, 0, -9.81} by default.
            gravity: Option<[f64; 3]> = Type::vector(3, "m/s²");
            /// True if bodies at rest fall asleep: the setting physics.sleeping.
            sleeping: Option<bool>;
        } -> ["softvt.World"] {
            let default = PhysicsParams::default();
            let params = PhysicsParams {
                dt: dt.unwrap_or(default.dt),
                rayleigh_mass: rayleigh_mass.unwrap_or(default.rayleigh_mass),
                rayleigh_stiffness: rayleigh_stiffness.unwrap_or(default.rayleigh_stiffness),
                average_acceleration: average_acceleration.unwrap_or(default.average_acceleration),
                sleeping: sleeping.unwrap_or(default.sleeping),
                ..default
            };
            let params = experiment_input::world_params(lua, params)
                .map_err(|e| fail!(lua, "softvt.world, with the settings of the run: {e}"))?;
            let gravity = gravity.map_or(softvt_physics::STANDARD_GRAVITY, Vec3::from);
            LuaWorld(Arc::new(Mutex::new(Inner {
                world: World::new(params, gravity),
                bodies: Vec::new(),
                failed: None,
                newton_total: 0,
                newton_max: 0,
                timing: Timing::default(),
                clock: app_data(lua)?,
                reserved: vec![reserve_in_world(lua, BYTES_PER_WORLD)?],
            })))
        }
    }
}

#[derive(Clone)]
pub(crate) struct LuaWorld(SharedWorld);

impl LuaWorld {
    fn add_soft(
        &self,
        lua: &Lua,
        name: &str,
        shape: &LuaShape,
        body: &SoftMaterial,
        friction: Friction,
        pose: Pose,
    ) -> mlua::Result<LuaBody> {
        let wrong = |error: &dyn fmt::Display| {
            let message = format!("world:soft: {error}");
            // A standard script that presses an asset has no fault: the file of the asset is named.
            match shape.made_at().filter(|_| library_is_running(lua)) {
                Some(line) => fail_at(lua, Some(line.clone()), message),
                None => fail(lua, message),
            }
        };
        let shape = shape.shape();
        let mut inner = lock(&self.0);
        let model = {
            let _pause = inner.clock.pause();
            soft_model(name, shape, &body.refined(inner.world.params.mesh_refinement))
                .map_err(|e| wrong(&e))?
        };
        let reserved = reserve_in_world(lua, model.bytes())?;
        let (mesh, diagonal_m) = (&model.mesh, shape.bounds().size().norm());
        let reference = ReferenceShape::of_mesh(&mesh.nodes, mesh, diagonal_m).map_err(|e| wrong(&e))?;
        let strain = StrainMeter::new(&model, StrainLimits::default());
        let id = inner.world.add_soft(name, model, Some(Arc::new(shape.clone())), &pose, friction);
        let (shape, stable_strain) = (shape.clone(), body.stable_strain());
        inner.bodies.push(MeasuredBody { shape, reference, strain, stable_strain });
        inner.reserved.push(reserved);
        inner.refuse_overlap(lua, id.into())?;
        Ok(LuaBody { world: self.0.clone(), id })
    }

    /// Adds a solid of so many bytes at a pose, on a carrier if it is kinematic. `add` gets its parent, and its pose on
    /// that.
    fn add_solid(
        &self,
        lua: &Lua,
        bytes: usize,
        at: Pose,
        is_kinematic: bool,
        add: impl FnOnce(&mut World, BodyId, Pose) -> ColliderId,
    ) -> mlua::Result<LuaSolid> {
        let reserved = reserve_in_world(lua, BYTES_PER_SOLID + bytes)?;
        let mut inner = lock(&self.0);
        inner.reserved.push(reserved);
        let kinematic = is_kinematic.then(|| inner.world.add_kinematic(at));
        let collider = match kinematic {
            Some(id) => add(&mut inner.world, BodyId::Kinematic(id), Pose::identity()),
            None => add(&mut inner.world, BodyId::World, at),
        };
        inner.refuse_overlap(lua, collider.into())?;
        Ok(LuaSolid { world: self.0.clone(), kinematic, collider })
    }

    fn add_shape(&self, lua: &Lua, spec: &WorldSolidSpec, is_kinematic: bool) -> mlua::Result<LuaSolid> {
        let WorldSolidSpec { name, shape, friction, position, axis_angle } = spec;
        self.add_solid(
            lua,
            shape.bytes(),
            pose(*position, *axis_angle),
            is_kinematic,
            |world, parent, pose| world.add_shape(name, parent, pose, shape.shape(), *friction),
        )
    }

    fn add_gel_pad(&self, lua: &Lua, spec: &WorldGelPadSpec) -> mlua::Result<LuaSolid> {
        let law = PadSpec::default();
        let friction = Friction::new(law.static_mu, law.dynamic_mu);
        self.add_solid(lua, 0, pose(spec.position, spec.axis_angle), true, |world, parent, _| {
            let (pad, gel) = (PadSurface::default(), GelSpec::default());
            let layer = pad.layer(&gel);
            world.add_collider(pad.collider(&spec.name, parent, gel_pose_on_carrier(), friction, &layer))
        })
    }

    fn attach(
        &self,
        lua: &Lua,
        body: &LuaBody,
        region: &LuaShape,
        to: &Holder,
    ) -> mlua::Result<LuaAttachment> {
        let (to, other) = match to {
            Holder::World => (BodyId::World, None),
            Holder::Solid(solid) => {
                (solid.kinematic.map_or(BodyId::World, BodyId::Kinematic), Some(&solid.world))
            }
        };
        for (key, world) in [("body", Some(&body.world)), ("to", other)] {
            if world.is_some_and(|world| !Arc::ptr_eq(world, &self.0)) {
                bail!(lua, "world:attach.{key}: expected an object of this world, got one of another");
            }
        }
        let (mut inner, body) = (lock(&self.0), body.id);
        let nodes = inner.world.soft(body).state.model.mesh.nodes.len();
        inner.reserved.push(reserve_in_world(lua, BYTES_PER_NODE * nodes)?);
        let attached = inner.world.attach(body, region.shape(), to);
        let id = attached.map_err(|e| fail!(lua, "world:attach: {e}"))?;
        Ok(LuaAttachment { world: self.0.clone(), id })
    }

    /// Makes one step; returns true, or false and the reason why the state of the world is invalid.
    fn step(&self, lua: &Lua) -> mlua::Result<(bool, Option<String>)> {
        if cancel::requested() {
            bail!(lua, "interrupted");
        }
        let inner = &mut *lock(&self.0);
        if let Some(failure) = &inner.failed {
            bail!(lua, "world:step: the world is invalid: {failure}; stop where world:step returns false");
        }
        let _pause = inner.clock.pause();
        let Inner { world, timing, .. } = inner;
        let dt = world.params.dt;
        inner.failed = timing.measure(dt, || world.step()).err();
        let stats = inner.world.solver_stats();
        inner.newton_total += u64::from(stats.newton_steps);
        inner.newton_max = inner.newton_max.max(stats.max_newton_steps);
        Ok((inner.failed.is_none(), inner.failed.as_ref().map(StepFailure::to_string)))
    }
}

class! {
    /// The mechanics alone: soft bodies among solids that are fixed or move as prescribed.
    LuaWorld: "softvt.World" {
        label(_) { "world".to_owned() }
        methods {
            /// Adds a soft body. A body that overlaps another or a solid by more than 1 mm is an error.
            fn soft(lua, this) takes spec "softvt.WorldSoft" {
                /// Name of the body in messages.
                name: String => Text("body");
                /// Shape of the body at rest.
                shape: LuaShape;
                /// Material of the body.
                body: Constructed<SoftMaterial>;
                /// Friction of its surface.
                friction: Friction;
                /// Position of its frame.
                position: [f64; 3] = POSITION;
                /// Orientation; none by default.
                axis_angle: Option<[f64; 3]> = AXIS_ANGLE;
            } -> ["softvt.Body"] {
                this.add_soft(lua, &name, &shape, &body, friction, pose(position, axis_angle))?
            }
            /// Adds a solid that solid:move_to moves.
            fn kinematic(lua, this, spec: WorldSolidSpec) -> ["softvt.Solid"] { this.add_shape(lua, &spec, true)? }
            /// Adds a solid that never moves.
            fn static(lua, this, spec: WorldSolidSpec) -> ["softvt.Solid"] { this.add_shape(lua, &spec, false)? }
            /// Adds a gel pad of the robot, with the shape and the default contact law of its fingers, on a carrier
            /// that solid:move_to moves. Its frame is at the apex of the gel, which faces along x.
            fn gel_pad(lua, this, spec: WorldGelPadSpec) -> ["softvt.Solid"] { this.add_gel_pad(lua, &spec)? }
            /// Holds a part of a soft body on a solid or in the world, where it is now. What moves the solid moves the
            /// part. Where it is held, the body does not touch the solid.
            fn attach(lua, this) takes spec "softvt.WorldAttach" {
                /// The soft body.
                body: LuaBody;
                /// The part, in the frame of the shape of the body. It may be larger than the body.
                region: LuaShape;
                /// The solid that holds the part, or "world".
                to: Holder;
            } -> ["softvt.Attachment"] { this.attach(lua, &body, &region, &to)? }
            /// Makes one time step. Returns false and the reason if the state is invalid then; a further
            /// step is an error.
            fn step(lua, this) -> ["boolean", "string?"] { this.step(lua)? }
            /// Returns the time step, s.
            fn dt(_, this) -> ["number"] { lock(&this.0).world.params.dt }
            /// Returns the simulated time, s.
            fn time(_, this) -> ["number"] { lock(&this.0).world.time() }
            /// Returns the mean and the largest number of Newton iterations per step.
            fn newton(_, this) -> ["number", "integer"] {
                let inner = lock(&this.0);
                (inner.newton_total as f64 / inner.world.step_count().max(1) as f64, inner.newton_max)
            }
            /// Returns the sum of kinetic, elastic and potential energy, J.
            fn energy(_, this) -> ["number"] { lock(&this.0).world.energy().total() }
            /// Starts a phase: CPU time of later steps counts for it.
            fn phase(_, this, name: String) -> [] { lock(&this.0).timing.start(&name) }
            /// Prints CPU time per simulated time, by phase, to standard error.
            fn report_timing(_, this) -> [] { softvt_common::text::eprint_line(&lock(&this.0).timing.to_string()) }
        }
    }
}

#[derive(Clone)]
pub(crate) struct LuaBody {
    world: SharedWorld,
    id: SoftId,
}

impl LuaBody {
    fn read<T>(&self, read: impl FnOnce(&SoftBody) -> T) -> T {
        read(lock(&self.world).world.soft(self.id))
    }

    fn strain<T>(&self, read: impl FnOnce(&StrainMeter, &FemState) -> T) -> T {
        let inner = lock(&self.world);
        read(&inner.bodies[self.id.index()].strain, &inner.world.soft(self.id).state)
    }

    fn contact(&self, lua: &Lua, method: &str, solid: &LuaSolid) -> mlua::Result<ContactSummary> {
        if !Arc::ptr_eq(&solid.world, &self.world) {
            bail!(lua, "body:{method}: solid: expected a solid of the body's own world");
        }
        Ok(lock(&self.world).world.contact(self.id, solid.collider))
    }

    fn deformation(&self, lua: &Lua) -> mlua::Result<Deformation> {
        let inner = lock(&self.world);
        let nodes = &inner.world.soft(self.id).state.x;
        let deformation = inner.bodies[self.id.index()].reference.measure(nodes);
        deformation.map_err(|e| fail!(lua, "body:deformation: {e}"))
    }
}

fn list(lua: &Lua, vector: &Vec3) -> mlua::Result<mlua::Table> {
    lua.create_sequence_from(vector.iter().copied())
}

output! {
    /// The upright box, along its narrowest side, about a soft body that has tilted.
    fn lying_table(lua, frame_w: &Pose, settled: &SettledBox) -> "softvt.Lying" as "lying" {
        /// Angle between the vertical and the z axis of its shape, rad.
        tilt: "number" = settled.tilt;
        /// Centre of the box, m.
        centre: "number[]" = list(lua, &(frame_w * nalgebra::Point3::from(settled.bounds.centre())).coords)?;
        /// Edge lengths of the box, longer horizontal side first, m.
        size: "number[]" = list(lua, &settled.bounds.size())?;
        /// Rotation of the box about the vertical, rad.
        yaw: "number" = frame_w.rotation.euler_angles().2;
    }
}

class! {
    /// A soft body of a world.
    LuaBody: "softvt.Body" {
        label(_) { "body".to_owned() }
        methods {
            /// Returns the centre of mass, m.
            fn centre(lua, this) -> ["number[]"] { list(lua, &this.read(|body| body.state.centre()))? }
            /// Returns the velocity of the centre of mass, m/s.
            fn velocity(lua, this) -> ["number[]"] { list(lua, &this.read(|body| body.state.velocity()))? }
            /// Returns the speed of the fastest node, m/s.
            fn speed(_, this) -> ["number"] { this.read(|body| body.state.max_speed()) }
            /// Returns the mass, kg.
            fn mass(_, this) -> ["number"] { this.read(|body| body.state.model.total_mass()) }
            /// Returns the least det F of a filled element: 0 or less is inverted, nil if no element is filled.
            fn min_det_f(_, this) -> ["number?"] { finite(this.read(|body| body.state.min_det_f().det_f)) }
            /// Returns true if the body sleeps.
            fn asleep(_, this) -> ["boolean"] { this.read(SoftBody::is_asleep) }
            /// Returns the deformation against the reference shape.
            fn deformation(lua, this) -> ["softvt.Deformation"] { deformation_table(lua, &this.deformation(lua)?)? }
            /// Returns the strain up to which its material is stable and undamaged: the smaller of collapse_strain and
            /// damage_strain; nil if it states none.
            fn stable_strain(_, this) -> ["number?"] { lock(&this.world).bodies[this.id.index()].stable_strain }
            /// Returns the compressive strain that `percent` of the volume stays below: 1 − σ_min(F) at the Gauss
            /// points, weighted by volume. 95 is usual; a number between 0 and 1 is most likely a share, and an error.
            /// With a `length`, of 1 to 8 voxels, the strain of a point is its average within that distance.
            fn strain_percentile(lua, this, percent: f64 = PERCENT, length: Option<f64> = AVERAGED) -> ["number"] {
                if percent > 0.0 && percent < 1.0 {
                    let (given, meant) = (format_number(percent), significant(100.0 * percent, 6));
                    bail!(lua, "body:strain_percentile: expected percent, got {given}; did you mean {meant}?");
                }
                let edge = this.read(|body| body.state.model.mesh.edge);
                // The slack is for a length of whole voxels.
                let is_averaged = |length: &f64| (1.0 - 1e-9..=LARGEST_LENGTH).contains(&(length / edge));
                if let Some(length) = length.filter(|length| !is_averaged(length)) {
                    let (length, edge) = (significant(1e3 * length, 3), significant(1e3 * edge, 3));
                    bail!(
                        lua,
                        "body:strain_percentile: length: expected 1 to {LARGEST_LENGTH} voxels of {edge} mm, got {length} mm; change the resolution of the body"
                    );
                }
                let (tail, length) = (1.0 - percent / 100.0, length.unwrap_or(0.0));
                let strain = this.strain(|meter, state| meter.percentile(state, tail, length));
                finite(strain).ok_or_else(|| fail!(lua, "body:strain_percentile: the body has no finite strain"))?
            }
            /// Returns the share of the volume, %, with a compressive strain above `strain`.
            fn volume_beyond_pct(_, this, strain: f64 = STRAIN) -> ["number"] {
                100.0 * this.strain(|meter, state| meter.share_beyond(state, strain))
            }
            /// Returns how the body lies if it has tilted by 5° or more from its modelled shape, else nil.
            fn lying(lua, this) -> ["softvt.Lying?"] {
                let inner = lock(&this.world);
                let (state, shape) = (&inner.world.soft(this.id).state, &inner.bodies[this.id.index()].shape);
                let (pose, _pause) = (state.mean_pose(), inner.clock.pause());
                let settled = SettledBox::new(shape, &pose, Some(state));
                settled.map(|settled| lying_table(lua, &(pose * settled.frame_o), &settled)).transpose()?
            }
            /// Returns the size of the bounding box of the nodes, m.
            fn extent(lua, this) -> ["number[]"] { list(lua, &this.deformation(lua)?.bbox_m)? }
            /// Sets the reference shape of deformation: the rest shape (at the start) or the present one.
            fn set_reference(lua, this, which: String = Type::Choice(&["rest", "now"])) -> [] {
                let mut inner = lock(&this.world);
                let Inner { world, bodies, .. } = &mut *inner;
                let (state, reference) = (&world.soft(this.id).state, &mut bodies[this.id.index()].reference);
                let mesh = &state.model.mesh;
                let nodes = if which == "rest" { &mesh.nodes } else { &state.x };
                let renewed = ReferenceShape::of_mesh(nodes, mesh, reference.diagonal_m());
                *reference = renewed.map_err(|e| fail(lua, e.to_string()))?;
            }
            /// Returns the normal force of a solid on the body, N.
            fn force(lua, this, solid: LuaSolid) -> ["number"] { this.contact(lua, "force", &solid)?.normal_force }
            /// Returns the tangential force of a solid on the body, N.
            fn shear(lua, this, solid: LuaSolid) -> ["number"] { this.contact(lua, "shear", &solid)?.shear() }
            /// Returns the distance that the contact patch has slid on a solid, mm.
            fn slip_mm(lua, this, solid: LuaSolid) -> ["number"] { 1e3 * this.contact(lua, "slip_mm", &solid)?.slip_distance }
            /// Returns the share of the contact patch's samples that slip, 0..1.
            fn slipping(lua, this, solid: LuaSolid) -> ["number"] {
                let contact = this.contact(lua, "slipping", &solid)?;
                contact.slipping_points as f64 / contact.points.max(1) as f64
            }
        }
    }
}

#[derive(Clone)]
pub(crate) struct LuaAttachment {
    world: SharedWorld,
    id: AttachmentId,
}

class! {
    /// A part of a soft body that a solid or the world holds.
    LuaAttachment: "softvt.Attachment" {
        label(_) { "attachment".to_owned() }
        methods {
            /// Returns the force that holds the body, N, in the world frame.
            fn force(lua, this) -> ["number[]"] { list(lua, &lock(&this.world).world.attachment(this.id).force_w)? }
            /// Returns the number of nodes that are held.
            fn nodes(_, this) -> ["integer"] { lock(&this.world).world.attachment(this.id).nodes().count() }
        }
    }
}

#[derive(Clone)]
pub(crate) struct LuaSolid {
    world: SharedWorld,
    kinematic: Option<KinematicId>,
    collider: ColliderId,
}

class! {
    /// A solid of a world.
    LuaSolid: "softvt.Solid" {
        label(_) { "solid".to_owned() }
        methods {
            /// Prescribes the pose after the next step: position, m, and orientation as axis-angle, rad (none by
            /// default).
            fn move_to(lua, this, position: [f64; 3] = POSITION, axis_angle: Option<[f64; 3]> = AXIS_ANGLE) -> [] {
                let Some(id) = this.kinematic else {
                    bail!(lua, "solid:move_to: a static solid cannot move; make it with world:kinematic");
                };
                lock(&this.world).world.move_kinematic(id, pose(position, axis_angle));
            }
        }
    }
}
