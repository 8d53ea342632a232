//! Worlds in Lua: the mechanics alone, for experiments that squeeze, drop and push by hand.

use std::sync::{Arc, Mutex};

use mlua::{Lua, MultiValue, Table, UserDataMethods, UserDataRef, Value};

use crate::script::{
    api::catalogue_classes::Class,
    api::catalogue_world as records,
    api::classes_world as classes,
    api::shapes::LuaShape,
    run::timing::Timing,
    schema::userdata::{Hosted, hosted, method},
    schema::{self, finite},
    vm::memory_budget::{Held, hold_in_world},
    vm::watchdog::Clock,
    vm::{fail, locked},
};
use crate::{
    evaluation::deformation::{Deformation, ReferenceShape},
    geometry::{Pose, Quat, Vec3},
    physics::{
        BodyId, ColliderId, KinematicId, PhysicsParams, SoftId, World,
        contact::Friction,
        fem::FemModel,
        world::{ContactSummary, StepFailure},
    },
    rollout::{cancel, soft_model},
    scene::SoftMaterial,
};

/// A world, its references and its timing.
struct Inner {
    world: World,
    references: Vec<ReferenceShape>,
    failed: Option<StepFailure>,
    newton: (u64, u32),
    timing: Timing,
    clock: Clock,
    /// What it takes of the machine's budget.
    held: Vec<Held>,
}

/// About what a world and one of its solids take themselves, bytes.
const BYTES_A_WORLD: usize = 16 << 10;
const BYTES_A_SOLID: usize = 4 << 10;

type Shared = Arc<Mutex<Inner>>;

/// Installs `softvt.world`.
pub(crate) fn install(lua: &Lua, api: &Table, clock: &Clock) -> mlua::Result<()> {
    let clock = clock.clone();
    let make = lua.create_function(move |lua, value: Value| {
        let given = if value.is_nil() { Value::Table(lua.create_table()?) } else { value };
        let spec = schema::checked(lua, &records::WORLD, &given)?;
        let gravity: Option<[f64; 3]> = spec.get("gravity")?;
        let params = PhysicsParams {
            dt: spec.get("dt")?,
            rayleigh_mass: spec.get("alpha")?,
            rayleigh_stiffness: spec.get("beta_s")?,
            sleeping: spec.get("sleeping")?,
            ..PhysicsParams::default()
        };
        let gravity = gravity.map_or(Vec3::new(0.0, 0.0, -9.81), Vec3::from);
        Ok(LuaWorld(Arc::new(Mutex::new(Inner {
            world: World::new(params, gravity),
            references: Vec::new(),
            failed: None,
            newton: (0, 0),
            timing: Timing::default(),
            clock: clock.clone(),
            held: vec![hold_in_world(lua, BYTES_A_WORLD)?],
        }))))
    })?;
    api.set("world", make)
}

fn friction(spec: &Table) -> mlua::Result<Friction> {
    let table: Table = spec.get("friction")?;
    Ok(Friction { static_mu: table.get("static_mu")?, dynamic_mu: table.get("dynamic_mu")? })
}

fn pose(xyz: [f64; 3], turn: Option<[f64; 3]>) -> Pose {
    let turn = turn.map_or(Quat::identity(), |turn| Quat::from_scaled_axis(Vec3::from(turn)));
    Pose::from_parts(Vec3::from(xyz).into(), turn)
}

/// `softvt.World`.
#[derive(Clone)]
struct LuaWorld(Shared);

impl LuaWorld {
    fn soft(&self, lua: &Lua, spec: &Table) -> mlua::Result<LuaBody> {
        let shape: LuaShape = spec.get("shape")?;
        let material = SoftMaterial {
            youngs_pa: spec.get("youngs_pa")?,
            poisson: spec.get("poisson")?,
            density: spec.get("density")?,
            resolution: spec.get("resolution")?,
            grasp_spacing: spec.get("grasp_spacing")?,
        };
        let name: String = spec.get("name")?;
        let mut inner = locked(&self.0);
        let rest: Arc<FemModel> = {
            let _honest_work = inner.clock.pause();
            soft_model(&name, shape.shape(), &material).map_err(|e| fail(lua, format!("world:soft: {e}")))?
        };
        let held = hold_in_world(lua, rest.bytes())?;
        let reference = ReferenceShape::new(&rest.mesh.nodes, &rest.mass)
            .map_err(|e| fail(lua, format!("world:soft: {e}")))?;
        let friction = friction(spec)?;
        let at = pose(spec.get("xyz")?, spec.get("turn")?);
        let id = inner.world.add_soft(&name, rest, Some(Arc::new(shape.shape().clone())), &at, friction);
        inner.references.push(reference);
        inner.held.push(held);
        Ok(LuaBody { world: self.0.clone(), id })
    }

    fn solid(&self, lua: &Lua, spec: &Table, moves: bool) -> mlua::Result<LuaSolid> {
        let shape: LuaShape = spec.get("shape")?;
        let at = pose(spec.get("xyz")?, spec.get("turn")?);
        let friction = friction(spec)?;
        let name: String = spec.get("name")?;
        let held = hold_in_world(lua, BYTES_A_SOLID + shape.bytes())?;
        let mut inner = locked(&self.0);
        inner.held.push(held);
        let world = &mut inner.world;
        let kinematic = moves.then(|| world.add_kinematic(at));
        let (parent, pose) = match kinematic {
            Some(id) => (BodyId::Kinematic(id), Pose::identity()),
            None => (BodyId::World, at),
        };
        let collider = world.add_shape(&name, parent, pose, shape.shape(), friction);
        Ok(LuaSolid { world: self.0.clone(), kinematic, collider })
    }
}

impl Hosted for LuaWorld {
    fn class() -> &'static Class {
        &classes::WORLD
    }

    fn label(&self) -> String {
        "world".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "soft", |lua, this: &Self, spec: Table| this.soft(lua, &spec));
        method(methods, "kinematic", |lua, this: &Self, spec: Table| this.solid(lua, &spec, true));
        method(methods, "static", |lua, this: &Self, spec: Table| this.solid(lua, &spec, false));
        method(methods, "step", |lua, this: &Self, ()| step(lua, &mut locked(&this.0)));
        method(methods, "time", |_, this: &Self, ()| Ok(locked(&this.0).world.time()));
        method(methods, "newton", |_, this: &Self, ()| {
            let inner = locked(&this.0);
            Ok((inner.newton.0 as f64 / inner.world.step_count().max(1) as f64, inner.newton.1))
        });
        method(methods, "energy", |_, this: &Self, ()| Ok(locked(&this.0).world.energy().total()));
        method(methods, "phase", |_, this: &Self, name: String| {
            locked(&this.0).timing.phase(&name);
            Ok(())
        });
        method(methods, "report_timing", |_, this: &Self, ()| {
            crate::text::eprint_line(&locked(&this.0).timing.to_string());
            Ok(())
        });
    }
}

/// One step; true, or false and why the world is void from now on.
fn step(lua: &Lua, inner: &mut Inner) -> mlua::Result<MultiValue> {
    if cancel::requested() {
        return Err(fail(lua, "interrupted"));
    }
    if inner.failed.is_none() {
        let _honest_work = inner.clock.pause();
        let dt = inner.world.params.dt;
        let Inner { world, timing, .. } = inner;
        if let Err(failure) = timing.measure(dt, || world.step()) {
            inner.failed = Some(failure);
        }
        inner.newton.0 += u64::from(inner.world.stats().newton_steps);
        inner.newton.1 = inner.newton.1.max(inner.world.stats().max_newton_steps);
    }
    let message = match &inner.failed {
        None => Value::Nil,
        Some(failure) => Value::String(lua.create_string(failure.to_string())?),
    };
    Ok(MultiValue::from_vec(vec![Value::Boolean(inner.failed.is_none()), message]))
}

/// `softvt.Body`.
#[derive(Clone)]
struct LuaBody {
    world: Shared,
    id: SoftId,
}

impl LuaBody {
    fn touch(&self, lua: &Lua, method: &str, solid: &LuaSolid) -> mlua::Result<ContactSummary> {
        if !Arc::ptr_eq(&solid.world, &self.world) {
            return Err(fail(lua, format!("body:{method}: solid: expected a solid of the body's own world")));
        }
        Ok(locked(&self.world).world.contact(self.id, solid.collider))
    }

    fn deformation(&self, lua: &Lua) -> mlua::Result<Deformation> {
        let inner = locked(&self.world);
        let nodes = &inner.world.soft(self.id).state.x;
        inner.references[self.id.index()]
            .measure(nodes)
            .map_err(|e| fail(lua, format!("body:deformation: {e}")))
    }

    fn set_reference(&self, lua: &Lua, which: &str) -> mlua::Result<()> {
        let mut inner = locked(&self.world);
        let body = &inner.world.soft(self.id).state;
        let nodes = if which == "rest" { &body.model.mesh.nodes } else { &body.x };
        let reference = ReferenceShape::new(nodes, &body.model.mass).map_err(|e| fail(lua, e.to_string()))?;
        inner.references[self.id.index()] = reference;
        Ok(())
    }
}

impl Hosted for LuaBody {
    fn class() -> &'static Class {
        &classes::BODY
    }

    fn label(&self) -> String {
        "body".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        let list = |lua: &Lua, v: &Vec3| lua.create_sequence_from(v.iter().copied());
        method(methods, "centre", move |lua, this: &Self, ()| {
            list(lua, &locked(&this.world).world.soft(this.id).state.centre())
        });
        method(methods, "velocity", move |lua, this: &Self, ()| {
            list(lua, &locked(&this.world).world.soft(this.id).state.velocity())
        });
        method(methods, "speed", |_, this: &Self, ()| {
            Ok(locked(&this.world).world.soft(this.id).state.max_speed())
        });
        method(methods, "mass", |_, this: &Self, ()| {
            Ok(locked(&this.world).world.soft(this.id).state.model.total_mass())
        });
        method(methods, "min_det_f", |_, this: &Self, ()| {
            Ok(finite(locked(&this.world).world.soft(this.id).min_det_f().det_f))
        });
        method(methods, "asleep", |_, this: &Self, ()| {
            Ok(locked(&this.world).world.soft(this.id).is_asleep())
        });
        method(methods, "deformation", |lua, this: &Self, ()| {
            let d = this.deformation(lua)?;
            lua.create_table_from([
                ("rms_pct", d.rms_pct),
                ("weighted_pct", d.weighted_pct),
                ("max_pct", d.max_pct),
            ])
        });
        method(methods, "extent", move |lua, this: &Self, ()| list(lua, &this.deformation(lua)?.bbox_m));
        method(methods, "set_reference", |lua, this: &Self, which: String| this.set_reference(lua, &which));
        touches(methods);
    }
}

/// Methods of a body that say how a solid touches it.
fn touches<M: UserDataMethods<LuaBody>>(methods: &mut M) {
    type Of = UserDataRef<LuaSolid>;
    method(methods, "force", |lua, this: &LuaBody, solid: Of| {
        Ok(this.touch(lua, "force", &solid)?.normal_force)
    });
    method(methods, "shear", |lua, this: &LuaBody, solid: Of| Ok(this.touch(lua, "shear", &solid)?.shear()));
    method(methods, "travel", |lua, this: &LuaBody, solid: Of| {
        Ok(1e3 * this.touch(lua, "travel", &solid)?.travel)
    });
    method(methods, "slipping", |lua, this: &LuaBody, solid: Of| {
        let touch = this.touch(lua, "slipping", &solid)?;
        Ok(touch.slipping_points as f64 / touch.points.max(1) as f64)
    });
}

/// `softvt.Solid`.
#[derive(Clone)]
struct LuaSolid {
    world: Shared,
    kinematic: Option<KinematicId>,
    collider: ColliderId,
}

impl Hosted for LuaSolid {
    fn class() -> &'static Class {
        &classes::SOLID
    }

    fn label(&self) -> String {
        "solid".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "move_to", |lua, this: &Self, (xyz, turn): ([f64; 3], Option<[f64; 3]>)| {
            let Some(id) = this.kinematic else {
                return Err(fail(
                    lua,
                    "solid:move_to: a static solid cannot move; make it with world:kinematic",
                ));
            };
            locked(&this.world).world.move_kinematic(id, pose(xyz, turn));
            Ok(())
        });
    }
}

hosted!(LuaWorld, LuaBody, LuaSolid);
