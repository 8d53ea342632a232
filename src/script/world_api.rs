//! Worlds in Lua: the mechanics alone, for experiments that squeeze, drop and push by hand.

use std::sync::{Arc, Mutex};

use mlua::{
    AnyUserData, Lua, MetaMethod, MultiValue, Table, UserData, UserDataFields, UserDataMethods, Value,
};

use super::{
    catalogue_world as records,
    deadline::Clock,
    sandbox::{fail, locked},
    schema::{self, Record},
    shapes::LuaShape,
    timing::Timing,
};
use crate::{
    evaluation::deformation::{Deformation, Reference},
    geometry::{Pose, Quat, Vec3},
    physics::{
        Params, World,
        contact::{Collider, Friction, Mover},
        fem::Rest,
        world::{StepFailure, Touch},
    },
    rollout::{soft_rest, stop},
    scene::SoftMaterial,
};

/// A world, its references and its timing.
struct Inner {
    world: World,
    references: Vec<Reference>,
    failed: Option<StepFailure>,
    newton: (u64, u32),
    timing: Timing,
    clock: Clock,
}

type Shared = Arc<Mutex<Inner>>;

/// Installs `softvt.world`.
pub(super) fn install(lua: &Lua, api: &Table, clock: &Clock) -> mlua::Result<()> {
    let clock = clock.clone();
    let make = lua.create_function(move |lua, value: Value| {
        let spec = checked(lua, &records::WORLD, "softvt.world", &value)?;
        let gravity: Option<[f64; 3]> = spec.get("gravity")?;
        let params = Params {
            dt: spec.get("dt")?,
            alpha: spec.get("alpha")?,
            beta: spec.get("beta_s")?,
            sleeping: spec.get("sleeping")?,
            ..Params::default()
        };
        let gravity = gravity.map_or(Vec3::new(0.0, 0.0, -9.81), Vec3::from);
        Ok(LuaWorld(Arc::new(Mutex::new(Inner {
            world: World::new(params, gravity),
            references: Vec::new(),
            failed: None,
            newton: (0, 0),
            timing: Timing::default(),
            clock: clock.clone(),
        }))))
    })?;
    api.set("world", make)
}

fn checked(lua: &Lua, record: &'static Record, label: &str, value: &Value) -> mlua::Result<Table> {
    let empty = lua.create_table()?;
    let table = match value {
        Value::Table(table) => table,
        Value::Nil => &empty,
        other => return Err(fail(lua, format!("{label}: expected a table, got {}", schema::got(other)))),
    };
    schema::check(lua, record, table).map_err(|fault| schema::fault_here(lua, label, &fault))
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
struct LuaWorld(Shared);

impl LuaWorld {
    fn soft(&self, lua: &Lua, value: &Value) -> mlua::Result<LuaBody> {
        let spec = checked(lua, &records::WORLD_SOFT, "world:soft", value)?;
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
        let rest: Arc<Rest> = {
            let _honest_work = inner.clock.pause();
            soft_rest(&name, &shape.0, &material).map_err(|e| fail(lua, format!("world:soft: {e}")))?
        };
        let reference = Reference::new(&rest.mesh.nodes, &rest.mass)
            .map_err(|e| fail(lua, format!("world:soft: {e}")))?;
        let friction = friction(&spec)?;
        let at = pose(spec.get("xyz")?, spec.get("turn")?);
        let index = inner.world.add_soft(&name, rest, Some(Arc::new(shape.0)), &at, friction);
        inner.references.push(reference);
        Ok(LuaBody { world: self.0.clone(), index })
    }

    fn solid(&self, lua: &Lua, label: &str, value: &Value, moves: bool) -> mlua::Result<LuaSolid> {
        let spec = checked(lua, &records::WORLD_SOLID, label, value)?;
        let shape: LuaShape = spec.get("shape")?;
        let at = pose(spec.get("xyz")?, spec.get("turn")?);
        let friction = friction(&spec)?;
        let name: String = spec.get("name")?;
        let world = &mut locked(&self.0).world;
        let layer = world.rigid_layer();
        let (kinematic, placed) = if moves {
            let index = world.add_kinematic(at);
            (Some(index), (Mover::Kinematic(index), Pose::identity()))
        } else {
            (None, (Mover::Static, at))
        };
        let collider = world.add_collider(Collider::new(&name, placed, Arc::new(shape.0), friction, layer));
        Ok(LuaSolid { world: self.0.clone(), kinematic, collider })
    }
}

impl UserData for LuaWorld {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.World");
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_method(MetaMethod::ToString, |_, _, ()| Ok("softvt.World"));
        methods.add_method("soft", |lua, this, value: Value| this.soft(lua, &value));
        methods.add_method("kinematic", |lua, this, value: Value| {
            this.solid(lua, "world:kinematic", &value, true)
        });
        methods
            .add_method("static", |lua, this, value: Value| this.solid(lua, "world:static", &value, false));
        methods.add_method("step", |lua, this, ()| step(lua, &mut locked(&this.0)));
        methods.add_method("time", |_, this, ()| Ok(locked(&this.0).world.time()));
        methods.add_method("newton", |_, this, ()| {
            let inner = locked(&this.0);
            Ok((inner.newton.0 as f64 / inner.world.step.max(1) as f64, inner.newton.1))
        });
        methods.add_method("energy", |_, this, ()| Ok(locked(&this.0).world.energy().total()));
        methods.add_method("phase", |_, this, name: String| {
            locked(&this.0).timing.phase(&name);
            Ok(())
        });
        methods.add_method("report_timing", |_, this, ()| {
            eprintln!("{}", locked(&this.0).timing);
            Ok(())
        });
    }
}

/// One step; true, or false and why the world is void from now on.
fn step(lua: &Lua, inner: &mut Inner) -> mlua::Result<MultiValue> {
    if stop::requested() {
        return Err(fail(lua, "interrupted"));
    }
    if inner.failed.is_none() {
        let _honest_work = inner.clock.pause();
        let dt = inner.world.params.dt;
        let Inner { world, timing, .. } = inner;
        if let Err(failure) = timing.measure(dt, || world.step()) {
            inner.failed = Some(failure);
        }
        inner.newton.0 += u64::from(inner.world.stats.newton);
        inner.newton.1 = inner.newton.1.max(inner.world.stats.newton_max);
    }
    let message = match &inner.failed {
        None => Value::Nil,
        Some(failure) => Value::String(lua.create_string(failure.to_string())?),
    };
    Ok(MultiValue::from_vec(vec![Value::Boolean(inner.failed.is_none()), message]))
}

/// `softvt.Body`.
struct LuaBody {
    world: Shared,
    index: usize,
}

impl LuaBody {
    fn touch(&self, lua: &Lua, solid: &AnyUserData) -> mlua::Result<Touch> {
        let wrong = || fail(lua, "expected a solid of this world (world:kinematic or world:static)");
        let solid = solid.borrow::<LuaSolid>().map_err(|_| wrong())?;
        if !Arc::ptr_eq(&solid.world, &self.world) {
            return Err(wrong());
        }
        Ok(locked(&self.world).world.touch(self.index, solid.collider))
    }

    fn deformation(&self, lua: &Lua) -> mlua::Result<Deformation> {
        let inner = locked(&self.world);
        let nodes = &inner.world.soft[self.index].body.x;
        inner.references[self.index].measure(nodes).map_err(|e| fail(lua, format!("body:deformation: {e}")))
    }

    fn set_reference(&self, lua: &Lua, which: &str) -> mlua::Result<()> {
        let mut inner = locked(&self.world);
        let body = &inner.world.soft[self.index].body;
        let nodes = match which {
            "rest" => &body.rest.mesh.nodes,
            "now" => &body.x,
            other => {
                return Err(fail(
                    lua,
                    format!("body:set_reference: expected \"rest\" or \"now\", got {other:?}"),
                ));
            }
        };
        let reference = Reference::new(nodes, &body.rest.mass).map_err(|e| fail(lua, e.to_string()))?;
        inner.references[self.index] = reference;
        Ok(())
    }
}

impl UserData for LuaBody {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.Body");
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        let list = |lua: &Lua, v: &Vec3| lua.create_sequence_from(v.iter().copied());
        methods.add_meta_method(MetaMethod::ToString, |_, _, ()| Ok("softvt.Body"));
        methods.add_method("centre", move |lua, this, ()| {
            list(lua, &locked(&this.world).world.soft[this.index].body.centre())
        });
        methods.add_method("velocity", move |lua, this, ()| {
            list(lua, &locked(&this.world).world.soft[this.index].body.velocity())
        });
        methods.add_method("speed", |_, this, ()| {
            Ok(locked(&this.world).world.soft[this.index].body.max_speed())
        });
        methods.add_method("mass", |_, this, ()| {
            Ok(locked(&this.world).world.soft[this.index].body.rest.total_mass())
        });
        methods.add_method("min_det_f", |_, this, ()| {
            Ok(locked(&this.world).world.soft[this.index].min_det_f.0)
        });
        methods.add_method("asleep", |_, this, ()| Ok(locked(&this.world).world.soft[this.index].asleep));
        methods.add_method("deformation", |lua, this, ()| {
            let d = this.deformation(lua)?;
            lua.create_table_from([
                ("rms_pct", d.rms_pct),
                ("weighted_pct", d.weighted_pct),
                ("max_pct", d.max_pct),
            ])
        });
        methods.add_method("extent", move |lua, this, ()| list(lua, &this.deformation(lua)?.bbox_m));
        methods.add_method("set_reference", |lua, this, which: String| this.set_reference(lua, &which));
        methods
            .add_method("force", |lua, this, solid: AnyUserData| Ok(this.touch(lua, &solid)?.normal_force));
        methods.add_method("shear", |lua, this, solid: AnyUserData| Ok(this.touch(lua, &solid)?.shear()));
        methods
            .add_method("travel", |lua, this, solid: AnyUserData| Ok(1e3 * this.touch(lua, &solid)?.travel));
        methods.add_method("slipping", |lua, this, solid: AnyUserData| {
            let touch = this.touch(lua, &solid)?;
            Ok(touch.slipping as f64 / touch.samples.max(1) as f64)
        });
    }
}

/// `softvt.Solid`.
struct LuaSolid {
    world: Shared,
    kinematic: Option<usize>,
    collider: usize,
}

impl UserData for LuaSolid {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.Solid");
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_method(MetaMethod::ToString, |_, _, ()| Ok("softvt.Solid"));
        methods.add_method("move_to", |lua, this, (xyz, turn): ([f64; 3], Option<[f64; 3]>)| {
            let Some(index) = this.kinematic else {
                return Err(fail(
                    lua,
                    "solid:move_to: a static solid cannot move; make it with world:kinematic",
                ));
            };
            if xyz.iter().chain(turn.iter().flatten()).any(|x| !x.is_finite()) {
                return Err(fail(lua, "solid:move_to: expected finite numbers"));
            }
            locked(&this.world).world.move_kinematic(index, pose(xyz, turn));
            Ok(())
        });
    }
}
