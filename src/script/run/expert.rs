//! Experts: Lua coroutines that see the true state and give one command a control step.

use std::sync::{Arc, Mutex};

use mlua::{Function, Lua, MultiValue, Table, Thread, UserDataMethods, Value, chunk::ChunkMode};

use crate::script::{
    ScriptError,
    api::catalogue_classes::{self as classes, Class},
    api::pose::LuaPose,
    api::touch as touch_api,
    plan::Machine,
    schema::userdata::{self as host, Hosted, Read, hosted, method},
    schema::{self, number, unknown},
    vm::library::embedded,
    vm::{base, fail, locked},
};
use crate::{
    geometry::{Aabb, Pose, Vec3},
    policy::TactileFrame,
    robot::{Obstacle, clearance, gripper::MAX_WIDTH},
    scene::{Asset, Body},
};

/// What an expert may know of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectView {
    /// Name in the scene.
    pub name: String,
    /// Its asset.
    pub asset: Arc<Asset>,
    /// Object frame in the world.
    pub pose_w: Pose,
    /// Bounds of its shape at rest, object frame.
    pub bounds: Aabb,
    /// Middle of its bounding box, world frame, m.
    pub centre_w: Vec3,
    /// Turn about the vertical, rad.
    pub yaw: f64,
    /// Joint value of a part, m or rad.
    pub joint: Option<f64>,
    /// Its parts by name.
    pub parts: Vec<ObjectView>,
}

/// What an expert may know at a control step: the true state, copied.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpertView {
    /// Time since the start, s.
    pub time_s: f64,
    /// Length of a control step, s.
    pub dt_s: f64,
    /// Robot base in the world.
    pub base_w: Pose,
    /// Tool centre point in the robot base frame.
    pub tcp_b: Pose,
    /// Distance of the pads, m.
    pub width_m: f64,
    /// Closure commanded last, 0 open to 1 shut.
    pub closure: f64,
    /// Normal force on the left and right pad, N.
    pub pad_force_n: [f64; 2],
    /// The objects, in the order of the scene.
    pub objects: Vec<ObjectView>,
}

/// What an expert wants next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpertCommand {
    /// Tool centre point in the robot base frame.
    pub pose_b: Pose,
    /// Closure, 0 open to 1 shut.
    pub closure: f64,
    /// Whether the gripper is meant to hold something: what a binary gripper would be told.
    pub gripping: bool,
}

/// A running expert in a machine of its own.
pub struct Expert {
    machine: Machine,
    run: Coroutine,
}

/// What fingers feel at one control step, left and right.
pub type Felt = Arc<[TactileFrame; 2]>;

/// How an expert closes on things.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grip {
    /// As far as it says.
    #[default]
    Told,
    /// Until the fingers feel that they hold something.
    Servo,
}

impl Expert {
    pub(crate) fn start(machine: Machine, function: &Function) -> Result<Self, ScriptError> {
        let run = Coroutine::new(function.clone(), Hands { grip: Grip::Told, feel: false });
        Ok(Self { machine, run })
    }

    /// The same expert, which has not begun yet, as a tactile servo.
    pub(crate) fn into_servo(mut self) -> Self {
        self.run.hands = Hands { grip: Grip::Servo, feel: true };
        self
    }

    /// Whether it wants to know what the fingers feel at the next control step.
    pub fn feels(&self) -> bool {
        self.run.feels
    }

    /// What the fingers feel at the next control step, if that is known.
    pub fn feel(&mut self, felt: Option<Felt>) {
        self.run.feel(felt);
    }

    /// Lets the expert see `view` and gives its next command; none once it is done.
    ///
    /// # Errors
    /// If the expert fails, takes too long, or yields something else than a command.
    pub fn step(&mut self, view: &ExpertView) -> Result<Option<ExpertCommand>, ScriptError> {
        let vm = &self.machine.vm;
        let _deadline = vm.call_deadline();
        self.run.step(&vm.lua, view).map_err(|e| vm.explain(&e))
    }

    /// Why the expert gave up, if it did.
    pub fn gave_up(&self) -> Option<&str> {
        self.run.gave_up.as_deref()
    }

    /// Ends the expert with an error that says `complaint` at the line of the command that it gave last.
    pub fn refuse(&mut self, complaint: &str) -> ScriptError {
        let vm = &self.machine.vm;
        let _deadline = vm.call_deadline();
        vm.explain(&self.run.refuse(&vm.lua, complaint))
    }
}

/// What an expert's hands can do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hands {
    /// How they close.
    pub grip: Grip,
    /// Whether what the fingers feel can be had.
    pub feel: bool,
}

/// An expert as a coroutine of any machine.
pub(crate) struct Coroutine {
    function: Function,
    view: Shared,
    hands: Hands,
    felt: Arc<Mutex<Option<Felt>>>,
    /// Whether it wants to know what the fingers feel at the next control step.
    pub feels: bool,
    thread: Option<Thread>,
    /// The reason that it gave to `arm:give_up`, after which it is not resumed.
    pub gave_up: Option<String>,
}

/// Characters that are kept of the reason for giving up.
const LONGEST_REASON: usize = 300;

impl Coroutine {
    pub(crate) fn new(function: Function, hands: Hands) -> Self {
        let (view, felt) = (Arc::default(), Arc::default());
        Self { function, view, hands, felt, feels: false, thread: None, gave_up: None }
    }

    /// What the fingers feel at the next control step, if that is known.
    pub(crate) fn feel(&mut self, felt: Option<Felt>) {
        *locked(&self.felt) = felt;
    }

    /// Lets the expert see `view` and gives its next command; none once it is done.
    pub(crate) fn step(&mut self, lua: &Lua, view: &ExpertView) -> mlua::Result<Option<ExpertCommand>> {
        if self.gave_up.is_some() {
            return Ok(None);
        }
        *locked(&self.view) = Some(view.clone());
        let values = self.resume(lua)?;
        if self.thread.as_ref().is_none_or(|thread| !thread.is_resumable()) {
            return Ok(None);
        }
        let mut values = values.into_iter();
        let pose =
            values.next().and_then(|value| value.as_userdata()?.borrow::<LuaPose>().ok().map(|pose| pose.0));
        let closure = values.next().and_then(|value| number(&value));
        let gripping = values.next().and_then(|value| value.as_boolean());
        if let Some(reason) = values.next().and_then(|value| value.as_string().map(|s| s.to_string_lossy())) {
            self.gave_up = Some(reason.chars().take(LONGEST_REASON).collect());
            return Ok(None);
        }
        self.feels = values.next().is_some_and(|value| value.as_boolean() == Some(true));
        match (pose, closure.filter(|closure| (0.0..=1.0).contains(closure)), gripping) {
            (Some(pose_w), Some(closure), Some(gripping)) => {
                Ok(Some(ExpertCommand { pose_b: view.base_w.inv_mul(&pose_w), closure, gripping }))
            }
            _ => Err(fail(
                lua,
                "the expert yielded something that is not a command; use arm:command, arm:move_to, arm:wait … instead \
                 of coroutine.yield",
            )),
        }
    }

    /// The error that `complaint` raises in the script where it waits for the next control step.
    pub(crate) fn refuse(&mut self, lua: &Lua, complaint: &str) -> mlua::Error {
        let over = self.gave_up.is_some();
        let waiting = self.thread.as_ref().filter(|thread| !over && thread.is_resumable());
        let raised = waiting.and_then(|thread| thread.resume::<MultiValue>(complaint).err());
        // A script that is over, or that catches errors, has no line to show.
        raised.unwrap_or_else(|| fail(lua, complaint))
    }

    fn resume(&mut self, lua: &Lua) -> mlua::Result<MultiValue> {
        match &self.thread {
            Some(thread) if thread.is_resumable() => thread.resume(()),
            Some(_) => Ok(MultiValue::new()),
            None => {
                let host = lua.create_userdata(Host(self.view.clone()))?;
                let arm = arm(lua, &host, fingers(lua, self.hands, &self.felt)?)?;
                let thread = lua.create_thread(self.function.clone())?;
                let scene = lua.create_userdata(View(self.view.clone()))?;
                self.thread.insert(thread).resume((arm, scene))
            }
        }
    }
}

/// The arm's Lua side, from the embedded library.
fn arm(lua: &Lua, host: &mlua::AnyUserData, fingers: Table) -> mlua::Result<Table> {
    let servo: Table = own_chunk(lua, "servo")?.call(())?;
    own_chunk(lua, "arm")?.call((host, checks(lua)?, servo, fingers))
}

/// A file of the library's own Lua, out of the reach of scripts.
fn own_chunk(lua: &Lua, name: &str) -> mlua::Result<mlua::chunk::Chunk<'static>> {
    let text = embedded(&format!("scripts/softvt/{name}.lua"))
        .ok_or_else(|| fail(lua, format!("the embedded library has no {name}")))?;
    let chunk = lua.load(text).set_name(format!("=softvt.{name}")).set_mode(ChunkMode::Text);
    Ok(chunk.set_environment(base(lua)?))
}

/// What the fingers are for, and what they feel now.
fn fingers(lua: &Lua, hands: Hands, felt: &Arc<Mutex<Option<Felt>>>) -> mlua::Result<Table> {
    let table = lua.create_table()?;
    table.set("servo", hands.grip == Grip::Servo)?;
    table.set("feel", hands.feel)?;
    let felt = felt.clone();
    let now =
        move |lua: &Lua, ()| locked(&felt).clone().map(|felt| touch_api::fingers(lua, &felt)).transpose();
    table.set("felt", lua.create_function(now)?)?;
    Ok(table)
}

/// Checks for the arm's Lua side; errors stand at the expert's own line.
fn checks(lua: &Lua) -> mlua::Result<Table> {
    let checks = lua.create_table()?;
    let arguments = |lua: &Lua, (name, values): (String, MultiValue)| match classes::ARM
        .methods
        .iter()
        .find(|signature| signature.name == name)
    {
        Some(signature) => host::arguments(lua, &format!("arm:{name}"), signature, values),
        None => Err(fail(lua, format!("arm: there is no {name:?}"))),
    };
    checks.set("arguments", lua.create_function(arguments)?)?;
    let no_self = |lua: &Lua, (name, first): (String, Value)| -> mlua::Result<()> {
        Err(host::no_self(lua, &classes::ARM, &name, &first))
    };
    checks.set("no_self", lua.create_function(no_self)?)?;
    checks.set("options", lua.create_function(options)?)?;
    let unknown_key = |lua: &Lua, key: Value| -> mlua::Result<()> {
        let Value::String(key) = &key else {
            let what = format!("arm: expected the name of a field or method, got {}", schema::got(&key));
            return Err(fail(lua, what));
        };
        let fields = classes::ARM.fields.iter().map(|(name, ..)| *name);
        let known = fields.chain(classes::ARM.methods.iter().map(|method| method.name));
        Err(fail(lua, format!("arm: {}", unknown("key", &key.to_string_lossy(), known))))
    };
    checks.set("unknown", lua.create_function(unknown_key)?)?;
    let complain = |lua: &Lua, complaint: String| -> mlua::Result<()> { Err(fail(lua, complaint)) };
    checks.set("refuse", lua.create_function(complain)?)?;
    Ok(checks)
}

/// Numbers by name over their defaults; closure may be 0, the others are rates and must be above it.
fn options(lua: &Lua, (label, given, defaults): (String, Value, Table)) -> mlua::Result<Table> {
    let given = match given {
        Value::Nil => return Ok(defaults),
        Value::Table(given) => given,
        other => {
            return Err(fail(
                lua,
                format!("{label}: expected a table of options, got {}", schema::got(&other)),
            ));
        }
    };
    let known: Vec<String> =
        schema::sorted_pairs(&defaults).iter().filter_map(|(key, _)| key.to_string().ok()).collect();
    for (key, value) in schema::sorted_pairs(&given) {
        let Value::String(key) = &key else {
            return Err(fail(lua, format!("{label}: expected names of options, got {}", schema::got(&key))));
        };
        let key = key.to_string_lossy().to_string();
        if !known.contains(&key) {
            return Err(fail(
                lua,
                format!("{label}: {}", unknown("option", &key, known.iter().map(String::as_str))),
            ));
        }
        let range = if key == "closure" { schema::Range::closed(0.0, 1.0) } else { schema::Range::POSITIVE };
        match number(&value).filter(|n| range.holds(*n)) {
            Some(n) => defaults.set(key, n)?,
            None => {
                let got = schema::got(&value);
                return Err(fail(
                    lua,
                    format!("{label}: {key}: expected a number{}, got {got}", range.words()),
                ));
            }
        }
    }
    Ok(defaults)
}

type Shared = Arc<Mutex<Option<ExpertView>>>;

fn with<R>(lua: &Lua, view: &Shared, read: impl FnOnce(&ExpertView) -> mlua::Result<R>) -> mlua::Result<R> {
    match &*locked(view) {
        Some(view) => read(view),
        None => Err(fail(lua, "the expert has not been shown anything yet")),
    }
}

/// The arm's measurements: the fields of `softvt.Arm` that are not its own.
#[derive(Clone)]
struct Host(Shared);

impl Hosted for Host {
    fn class() -> &'static Class {
        &classes::ARM
    }

    fn label(&self) -> String {
        "arm".into()
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        with(lua, &self.0, |view| {
            Ok(match key {
                "pose" => {
                    let pose = LuaPose(view.base_w * view.tcp_b);
                    Read::Value(Value::UserData(lua.create_userdata(pose)?))
                }
                "width" => Read::number(view.width_m),
                "closure" => Read::number(view.closure),
                "time" => Read::number(view.time_s),
                "dt" => Read::number(view.dt_s),
                _ => Read::together(lua, &view.pad_force_n, "it is measured")?,
            })
        })
    }

    fn methods<M: UserDataMethods<Self>>(_: &mut M) {}
}

/// `softvt.View`: the scene as an expert sees it.
#[derive(Clone)]
struct View(Shared);

impl Hosted for View {
    fn class() -> &'static Class {
        &classes::VIEW
    }

    fn label(&self) -> String {
        "scene".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "object", |lua, this: &Self, name: String| {
            with(lua, &this.0, |view| seen(lua, find(lua, "object", &view.objects, &name)?))
        });
        method(methods, "part", |lua, this: &Self, (object, part): (String, String)| {
            with(lua, &this.0, |view| {
                let whole = find(lua, "object", &view.objects, &object)?;
                seen(lua, find(lua, "part", &whole.parts, &part)?)
            })
        });
        method(methods, "clearance", room);
        method(methods, "objects", |lua, this: &Self, ()| {
            with(lua, &this.0, |view| {
                let tables = view.objects.iter().map(|object| seen(lua, object));
                lua.create_sequence_from(tables.collect::<mlua::Result<Vec<_>>>()?)
            })
        });
    }
}

hosted!(Host, View);

/// Distances of the hand from things are told apart up to this, m.
const FAR: f64 = 0.2;

/// Metres between a hand at `pose` and the nearest thing that is not to be ignored, and its name.
fn room(
    lua: &Lua,
    this: &View,
    (pose, options): (LuaPose, Option<Table>),
) -> mlua::Result<(f64, Option<String>)> {
    let (width, ignored): (f64, Vec<String>) = match options {
        Some(options) => (options.get("width")?, options.get::<Option<_>>("ignore")?.unwrap_or_default()),
        None => (MAX_WIDTH, Vec::new()),
    };
    with(lua, &this.0, |view| {
        let known = || view.objects.iter().map(|object| object.name.as_str());
        if let Some(name) = ignored.iter().find(|name| !known().any(|other| other == name.as_str())) {
            return Err(fail(lua, format!("scene:clearance: ignore: {}", unknown("object", name, known()))));
        }
        let solid =
            |object: &&ObjectView| object.asset.body != Body::Scenery && !ignored.contains(&object.name);
        let objects: Vec<&ObjectView> = view
            .objects
            .iter()
            .filter(solid)
            .flat_map(|object| std::iter::once(object).chain(&object.parts))
            .collect();
        let obstacles: Vec<Obstacle<'_>> = objects
            .iter()
            .map(|o| Obstacle { pose_w: o.pose_w, shape: &o.asset.shape, bounds: o.bounds })
            .collect();
        let found = clearance(&pose.0, width, &obstacles, FAR);
        Ok((found.distance, found.nearest.map(|index| objects[index].name.clone())))
    })
}

fn find<'a>(lua: &Lua, what: &str, all: &'a [ObjectView], name: &str) -> mlua::Result<&'a ObjectView> {
    let names = all.iter().map(|object| object.name.as_str());
    let found = all.iter().find(|object| object.name == name);
    found.ok_or_else(|| fail(lua, format!("scene: {}", unknown(what, name, names))))
}

fn seen(lua: &Lua, object: &ObjectView) -> mlua::Result<Table> {
    let table = lua.create_table()?;
    table.set("name", object.name.as_str())?;
    table.set("asset", object.asset.name.as_str())?;
    table.set("xyz", lua.create_sequence_from(object.centre_w.iter().copied())?)?;
    table.set("size", lua.create_sequence_from(object.bounds.size().iter().copied())?)?;
    table.set("yaw", object.yaw)?;
    let hints = object.asset.hints.iter().map(|(name, value)| (name.as_str(), *value));
    table.set("hints", lua.create_table_from(hints)?)?;
    table.set("joint", object.joint)?;
    let values = object.parts.iter().map(|part| (part.name.as_str(), part.joint));
    table.set("joints", lua.create_table_from(values)?)?;
    let parts = object.parts.iter().map(|part| Ok((part.name.as_str(), seen(lua, part)?)));
    table.set("parts", lua.create_table_from(parts.collect::<mlua::Result<Vec<_>>>()?)?)?;
    let names = ["name", "asset", "xyz", "size", "yaw", "hints", "joint", "joints", "parts"];
    let names = names.map(str::to_string).to_vec();
    crate::script::plan::options::strict(lua, "object", table, names)
}
