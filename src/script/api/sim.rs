//! Simulations in Lua: a settled scene with the robot, for calibrations and other experiments.

use std::sync::{Arc, Mutex};

use mlua::{Function, IntoLuaMulti, Lua, MultiValue, Table, UserDataMethods, Value};
use serde::de::DeserializeOwned;

use crate::script::{
    api::catalogue::LAYOUT,
    api::catalogue_classes::Class,
    api::catalogue_world::SIMULATE,
    api::classes_world::SIMULATION,
    api::image::LuaImage,
    api::scene::{LuaScene, empty_scene},
    api::touch::LuaMarkers,
    run::controller::{Glance, Planner, next},
    run::expert::{Coroutine, ExpertCommand, ExpertView, Felt, Grip, Hands},
    run::reachability::Lag,
    schema::userdata::{Hosted, hosted, method},
    schema::{self, finite},
    vm::json::json,
    vm::memory_budget::{Held, hold_in_world},
    vm::random::Rng,
    vm::watchdog::Clock,
    vm::{fail, locked},
};
use crate::{
    benchmark::{
        control::steps_per_control,
        seed::{EpisodeSeed, RandomStream, Split},
        settings::Settings,
    },
    evaluation::deformation::ReferenceShape,
    geometry::Pose,
    physics::BodyId,
    robot::{Side, rotation},
    rollout::{AssetCache, SensingError, SensorAssets, SensorSuite, Simulation, cancel},
    sensing::tactile::{MarkerPositions, MarkerStyle, PadWrench},
};

/// Physics with the robot, and what was seen of it.
struct Inner {
    sim: Simulation,
    /// Settled shape, peak D and height of each object.
    watched: Vec<Watched>,
    physics_steps: u64,
    failed: Option<String>,
    clock: Clock,
    senses: SensorSuite,
    _held: Held,
}

/// About what a simulation takes besides its soft bodies: the robot, its sensors, fixed things, bytes.
const BYTES_A_SIMULATION: usize = 4 << 20;

struct Watched {
    reference: Option<ReferenceShape>,
    d_peak: f64,
    start_z: f64,
}

/// Installs `softvt.simulate` and `softvt.settings`.
pub(crate) fn install(lua: &Lua, api: &Table, clock: &Clock) -> mlua::Result<()> {
    let clock = clock.clone();
    let (cache, looks) = (AssetCache::default(), SensorAssets::default());
    let make =
        lua.create_function(move |lua, value: Value| simulate(lua, &value, &clock, (&cache, &looks)))?;
    api.set("simulate", make)
}

/// A table as settings.
pub(crate) fn settings(lua: &Lua, label: &str, table: Option<Table>) -> mlua::Result<Settings> {
    let Some(table) = table else { return Ok(Settings::default()) };
    let settings: Settings = read(lua, label, &Value::Table(table))?;
    settings.check().map_err(|e| fail(lua, format!("{label}: {e}")))?;
    Ok(settings)
}

/// Lua data as a Rust type, in words for people.
pub(crate) fn read<T: DeserializeOwned>(lua: &Lua, label: &str, value: &Value) -> mlua::Result<T> {
    serde_json::from_value(json(lua, value, label)?).map_err(|error| {
        let text = error.to_string();
        let kinds = [
            ("floating point ", ""),
            ("expected f64", "expected a number"),
            ("expected u32", "expected a whole number"),
            ("expected u64", "expected a whole number"),
            ("expected usize", "expected a whole number"),
            ("expected a sequence", "expected a list"),
            ("expected a map", "expected a table"),
            ("invalid type: map", "invalid type: a table"),
            ("invalid type: sequence", "invalid type: a list"),
        ];
        let text = kinds.iter().fold(text, |text, (rust, people)| text.replace(rust, people));
        let text = text
            .split_once("expected struct ")
            .map_or(text.clone(), |(before, _)| format!("{before}expected a table"));
        fail(lua, format!("{label}: {text}"))
    })
}

fn simulate(
    lua: &Lua,
    value: &Value,
    clock: &Clock,
    (cache, looks): (&AssetCache, &SensorAssets),
) -> mlua::Result<LuaSimulation> {
    let spec = schema::checked(lua, &SIMULATE, value)?;
    let settings = settings(lua, "softvt.simulate: settings", spec.get("settings")?)?;
    let layout: Table = spec.get("layout")?;
    schema::still_sound(lua, &LAYOUT, &layout)?;
    let seed = EpisodeSeed {
        suite: spec.get("suite")?,
        layout: layout.get("name")?,
        episode: spec.get("episode")?,
        base: spec.get("seed")?,
        split: Split::Experiment,
    };
    let scene = LuaScene::new(empty_scene());
    layout.get::<Function>("build")?.call::<()>((scene.clone(), Rng::new(seed, RandomStream::Layout)))?;
    let scene = Arc::new(locked(&scene.scene).clone());
    let _honest_work = clock.pause();
    let mut sim = Simulation::new(scene, &settings.physics, &settings.robot, cache)
        .map_err(|e| fail(lua, format!("softvt.simulate: {e}")))?;
    let soft: usize = sim.world.soft_bodies().iter().map(|soft| soft.state.model.bytes()).sum();
    let held = hold_in_world(lua, BYTES_A_SIMULATION + soft)?;
    sim.settle().map_err(|e| {
        let place = e.place().map_or(String::new(), |place| format!("{place}: "));
        fail(lua, format!("softvt.simulate: {place}{e}"))
    })?;
    let watched = sim
        .objects
        .iter()
        .map(|object| Watched {
            reference: match object.body {
                BodyId::Soft(i) => {
                    let body = &sim.world.soft(i).state;
                    ReferenceShape::new(&body.x, &body.model.mass).ok()
                }
                _ => None,
            },
            d_peak: 0.0,
            start_z: sim.centre(object).z,
        })
        .collect();
    let senses = SensorSuite::new(&sim, &settings.tactile, looks);
    let inner =
        Inner { sim, watched, physics_steps: 0, failed: None, clock: clock.clone(), senses, _held: held };
    Ok(LuaSimulation(Arc::new(Mutex::new(inner))))
}

impl Inner {
    fn time(&self) -> f64 {
        self.physics_steps as f64 * self.sim.world.params.dt
    }

    /// One control step; false once the physics has failed.
    fn control_step(&mut self, command: Option<(&Pose, f64)>) -> bool {
        if cancel::requested() {
            self.failed = Some("interrupted".into());
        }
        if let Some((pose_b, closure)) = command {
            self.sim.robot.command(&mut self.sim.world, pose_b, closure);
        }
        let _honest_work = self.clock.pause();
        for _ in 0..steps_per_control(self.sim.world.params.dt) {
            if self.failed.is_some() {
                return false;
            }
            self.physics_steps += 1;
            if let Err(failure) = self.sim.step() {
                self.failed = Some(failure.to_string());
                return false;
            }
            self.watch();
        }
        true
    }

    /// What the fingers feel now.
    fn touch(&mut self, lua: &Lua) -> mlua::Result<Felt> {
        let frame = SensorSuite::frame(&self.sim);
        let felt = self.senses.tactile_frames(&frame);
        felt.map(Arc::new).map_err(|e| fail(lua, format!("arm:feel: {e}")))
    }

    fn watch(&mut self) {
        for (index, watched) in self.watched.iter_mut().enumerate() {
            if let Some(d) = deformation(&self.sim, index, &watched.reference) {
                watched.d_peak = watched.d_peak.max(d);
            }
        }
    }

    fn outcome(&self, lua: &Lua) -> mlua::Result<MultiValue> {
        let message = match &self.failed {
            None => Value::Nil,
            Some(message) => Value::String(lua.create_string(message)?),
        };
        Ok(MultiValue::from_vec(vec![Value::Boolean(self.failed.is_none()), message]))
    }
}

fn deformation(sim: &Simulation, object: usize, reference: &Option<ReferenceShape>) -> Option<f64> {
    let BodyId::Soft(index) = sim.objects[object].body else { return None };
    reference.as_ref()?.measure(&sim.world.soft(index).state.x).ok().map(|d| d.rms_pct)
}

/// An expert that runs in the machine that drives it.
struct Bound<'a> {
    run: Coroutine,
    lua: &'a Lua,
}

impl Planner for Bound<'_> {
    type Error = mlua::Error;

    fn step(&mut self, view: &ExpertView) -> mlua::Result<Option<ExpertCommand>> {
        self.run.step(self.lua, view)
    }

    fn refuse(&mut self, complaint: &str) -> mlua::Error {
        self.run.refuse(self.lua, complaint)
    }
}

/// `softvt.Simulation`.
#[derive(Clone)]
struct LuaSimulation(Arc<Mutex<Inner>>);

impl LuaSimulation {
    /// Runs an expert to its end.
    fn drive(&self, lua: &Lua, expert: Function) -> mlua::Result<MultiValue> {
        let hands = Hands { grip: Grip::Told, feel: true };
        let (mut expert, mut lag) = (Bound { run: Coroutine::new(expert, hands), lua }, Lag::default());
        loop {
            // The expert itself may look at the simulation, so it is not held while the expert runs.
            let glance = {
                let mut inner = locked(&self.0);
                let _honest_work = inner.clock.pause();
                let felt = expert.run.feels.then(|| inner.touch(lua)).transpose()?;
                expert.run.feel(felt);
                Glance::new(&inner.sim, inner.time(), &mut lag)
            };
            let Some(command) = next(&mut expert, glance, &mut lag)? else { break };
            if !locked(&self.0).control_step(Some((&command.pose_b, command.closure))) {
                break;
            }
        }
        if let Some(reason) = &expert.run.gave_up {
            return (false, format!("the expert gave up: {reason}")).into_lua_multi(lua);
        }
        locked(&self.0).outcome(lua)
    }

    fn wait(&self, lua: &Lua, seconds: f64) -> mlua::Result<MultiValue> {
        let mut inner = locked(&self.0);
        let until = inner.time() + seconds - 1e-9;
        while inner.time() < until && inner.control_step(None) {}
        inner.outcome(lua)
    }

    /// What a camera sees.
    fn see(&self, lua: &Lua, spec: &Table) -> mlua::Result<LuaImage> {
        let wrong = |e: SensingError| fail(lua, format!("simulation:see: {e}"));
        let mut inner = locked(&self.0);
        let Inner { sim, senses, clock, physics_steps, .. } = &mut *inner;
        let _honest_work = clock.pause();
        let mut camera = senses.camera(&spec.get::<String>("camera")?).map_err(wrong)?.clone();
        camera.width = spec.get::<Option<usize>>("width")?.unwrap_or(camera.width);
        camera.height = spec.get::<Option<usize>>("height")?.unwrap_or(camera.height);
        let frame = SensorSuite::frame(sim);
        // Before anything has moved, only whoever wrote the layout can have put the camera inside of something.
        let seen = if *physics_steps == 0 {
            senses.render_unobstructed(&frame, &camera)
        } else {
            senses.render(&frame, &camera)
        };
        LuaImage::new(lua, seen.map_err(wrong)?.into_rgb_image())
    }

    /// What a finger feels.
    fn feel(&self, lua: &Lua, side: &str) -> mlua::Result<Table> {
        let (index, side) = if side == "left" { (0, Side::Left) } else { (1, Side::Right) };
        let mut inner = locked(&self.0);
        let Inner { sim, senses, clock, .. } = &mut *inner;
        let _honest_work = clock.pause();
        let frame = SensorSuite::frame(sim);
        let felt =
            senses.tactile_reading(&frame, side).map_err(|e| fail(lua, format!("simulation:feel: {e}")))?;
        let places = |places: &MarkerPositions| lua.create_sequence_from(places.iter().map(|p| p.to_vec()));
        let table = lua.create_table()?;
        table.set("picture", LuaImage::new(lua, felt.image.clone())?)?;
        table.set("dots", LuaImage::new(lua, felt.with_markers(MarkerStyle::Dots))?)?;
        table.set("arrows", LuaImage::new(lua, felt.with_markers(MarkerStyle::Arrows))?)?;
        table.set("initial", places(&felt.markers.initial)?)?;
        table.set("present", places(&felt.markers.current)?)?;
        let load = frame.patches.get(index).map_or(PadWrench::default(), PadWrench::from_patch);
        table.set("markers", LuaMarkers::new(felt.markers))?;
        table.set("force", lua.create_sequence_from(load.force.iter().copied())?)?;
        table.set("depth_mm", felt.field.as_ref().map_or(0.0, |field| 1e3 * field.depth()))?;
        Ok(table)
    }

    fn watch(&self, lua: &Lua, name: &str) -> mlua::Result<Table> {
        let inner = locked(&self.0);
        let _honest_work = inner.clock.pause();
        let sim = &inner.sim;
        let names = sim.objects.iter().map(|o| o.name.as_str());
        let index = sim.objects.iter().position(|o| o.name == name);
        let Some(index) = index else {
            return Err(fail(lua, format!("simulation:watch: {}", schema::unknown("object", name, names))));
        };
        let (object, watched) = (&sim.objects[index], &inner.watched[index]);
        let table = lua.create_table()?;
        table.set("width_m", finite(sim.robot.width(&sim.world)))?;
        table.set("height_m", finite(sim.centre(object).z - watched.start_z))?;
        table.set("speed", finite(sim.speed(object)))?;
        table.set("asset", object.asset.name.as_str())?;
        table.set("fingerprint", object.asset.fingerprint())?;
        table.set("joint", sim.joint(object))?;
        let joints = sim.parts(index).map(|(handle, part)| (part.name.as_str(), sim.joint(handle)));
        table.set("joints", lua.create_table_from(joints)?)?;
        if object.body.is_free() {
            let touch = sim.pad_contacts(object);
            table.set("pad_force", lua.create_sequence_from(touch.map(|t| t.normal_force))?)?;
            table.set("slip_mm", lua.create_sequence_from(touch.map(|t| 1e3 * t.travel))?)?;
        }
        if let BodyId::Soft(soft) = object.body {
            let body = sim.world.soft(soft);
            table.set("d_pct", deformation(sim, index, &watched.reference))?;
            table.set("d_peak_pct", watched.d_peak)?;
            table.set("min_det_f", finite(body.min_det_f().det_f))?;
            table.set("asleep", body.is_asleep())?;
        }
        Ok(table)
    }
}

impl Hosted for LuaSimulation {
    fn class() -> &'static Class {
        &SIMULATION
    }

    fn label(&self) -> String {
        "simulation".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "drive", |lua, this: &Self, expert: Function| this.drive(lua, expert));
        method(methods, "wait", |lua, this: &Self, seconds: f64| this.wait(lua, seconds));
        method(methods, "watch", |lua, this: &Self, name: String| this.watch(lua, &name));
        method(methods, "see", |lua, this: &Self, spec: Table| this.see(lua, &spec));
        method(methods, "feel", |lua, this: &Self, side: String| this.feel(lua, &side));
        method(methods, "time", |_, this: &Self, ()| Ok(locked(&this.0).time()));
        method(methods, "tool", |lua, this: &Self, ()| {
            let inner = locked(&this.0);
            let tool = inner.sim.robot.base_w * inner.sim.robot.tool_b(&inner.sim.world);
            let turn = rotation::axis_angle(&tool.rotation);
            Ok((
                lua.create_sequence_from(tool.translation.vector.iter().copied())?,
                lua.create_sequence_from(turn.iter().copied())?,
            ))
        });
    }
}

hosted!(LuaSimulation);
