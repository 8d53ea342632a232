//! Experts: Lua coroutines that get the true state and yield one command per control step.

use std::sync::{Arc, Mutex};

use mlua::{Function, Lua, MultiValue, Table, Thread, Value, chunk::ChunkMode};

use super::{
    expert_input::{ExpertCommand, ExpertInput, ExpertView, ObjectView, TrackingErrorMonitor},
    pose::LuaPose,
    touch::{FingerReadings, fingers},
};
use crate::{
    parallel::lock,
    robot::{Obstacle, clearance, gripper::MAX_WIDTH},
    scene::Body,
    script::{
        schema::{
            ApiObject, Range, Type, class,
            object::{MEASURED, arguments, fixed_list},
            output, record,
        },
        vm::{
            base_library,
            error::fail,
            library::embedded,
            value::{describe, number, sorted_pairs},
        },
    },
    text::unknown_name,
};

/// Access of an expert to the tactile sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FingerAccess {
    None,
    /// `arm:tactile` returns readings.
    Readings,
    /// In addition, `arm:grasp` closes until the readings show a firm grasp.
    Servo,
}

type SharedReadings = Arc<Mutex<Option<FingerReadings>>>;
type SharedView = Arc<Mutex<Option<ExpertView>>>;

/// An expert as a coroutine of any virtual machine.
pub(crate) struct Coroutine {
    function: Function,
    view: SharedView,
    access: FingerAccess,
    readings: SharedReadings,
    /// True if the expert needs finger readings at the next control step.
    pub wants_readings: bool,
    thread: Option<Thread>,
    /// Reason given to `arm:give_up`, after which the expert is not resumed.
    pub gave_up: Option<String>,
}

/// Longest reason for giving up that is kept, characters.
const MAX_REASON_CHARS: usize = 300;

impl Coroutine {
    pub(crate) fn new(function: Function, access: FingerAccess) -> Self {
        let (view, readings) = (Arc::default(), Arc::default());
        Self { function, view, access, readings, wants_readings: false, thread: None, gave_up: None }
    }

    /// Sets the finger readings of the next control step.
    pub(crate) fn set_readings(&mut self, readings: Option<FingerReadings>) {
        *lock(&self.readings) = readings;
    }

    /// Returns the next command, or an error if the arm could not follow the last one.
    pub(crate) fn next_command(
        &mut self,
        lua: &Lua,
        input: ExpertInput,
        monitor: &mut TrackingErrorMonitor,
    ) -> mlua::Result<Option<ExpertCommand>> {
        if let Some(complaint) = input.complaint {
            return Err(self.refuse(lua, &complaint));
        }
        let command = self.step(lua, &input.view)?;
        if let Some(command) = &command {
            monitor.command_b = Some(command.pose_b);
        }
        Ok(command)
    }

    /// Resumes the expert with `view` and returns its next command; `None` at its end.
    pub(crate) fn step(&mut self, lua: &Lua, view: &ExpertView) -> mlua::Result<Option<ExpertCommand>> {
        if self.gave_up.is_some() {
            return Ok(None);
        }
        *lock(&self.view) = Some(view.clone());
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
            self.gave_up = Some(reason.chars().take(MAX_REASON_CHARS).collect());
            return Ok(None);
        }
        self.wants_readings = values.next().is_some_and(|value| value.as_boolean() == Some(true));
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

    /// Raises `complaint` where the script waits for the next control step, and returns the error.
    pub(crate) fn refuse(&mut self, lua: &Lua, complaint: &str) -> mlua::Error {
        let is_over = self.gave_up.is_some();
        let waiting = self.thread.as_ref().filter(|thread| !is_over && thread.is_resumable());
        let raised = waiting.and_then(|thread| thread.resume::<MultiValue>(complaint).err());
        // A script that is over, or that catches errors, has no line to show.
        raised.unwrap_or_else(|| fail(lua, complaint))
    }

    fn resume(&mut self, lua: &Lua) -> mlua::Result<MultiValue> {
        match &self.thread {
            Some(thread) if thread.is_resumable() => thread.resume(()),
            Some(_) => Ok(MultiValue::new()),
            None => {
                let host = lua.create_userdata(MeasuredArm(self.view.clone()))?;
                let arm = arm(lua, &host, finger_access(lua, self.access, &self.readings)?)?;
                let thread = lua.create_thread(self.function.clone())?;
                let scene = lua.create_userdata(LuaView(self.view.clone()))?;
                self.thread.insert(thread).resume((arm, scene))
            }
        }
    }
}

/// Makes the arm, whose methods are in the embedded library.
fn arm(lua: &Lua, host: &mlua::AnyUserData, fingers: Table) -> mlua::Result<Table> {
    let servo: Table = library_chunk(lua, "servo")?.call(())?;
    library_chunk(lua, "arm")?.call((host, checks(lua)?, servo, fingers))
}

/// A file of the library's own Lua code, out of the reach of scripts.
fn library_chunk(lua: &Lua, name: &str) -> mlua::Result<mlua::chunk::Chunk<'static>> {
    let text = embedded(&format!("scripts/softvt/{name}.lua"))
        .ok_or_else(|| fail(lua, format!("the embedded library has no {name}")))?;
    let chunk = lua.load(text).set_name(format!("=softvt.{name}")).set_mode(ChunkMode::Text);
    Ok(chunk.set_environment(base_library(lua)?))
}

/// The tactile sensors for the arm's Lua code.
fn finger_access(lua: &Lua, access: FingerAccess, readings: &SharedReadings) -> mlua::Result<Table> {
    let table = lua.create_table()?;
    table.set("servo", access == FingerAccess::Servo)?;
    table.set("available", access != FingerAccess::None)?;
    let readings = readings.clone();
    let latest = move |lua: &Lua, ()| lock(&readings).clone().map(|latest| fingers(lua, &latest)).transpose();
    table.set("readings", lua.create_function(latest)?)?;
    Ok(table)
}

/// Checks for the arm's Lua code; errors are at the expert's line.
fn checks(lua: &Lua) -> mlua::Result<Table> {
    let class = MeasuredArm::CLASS;
    let checks = lua.create_table()?;
    let check_arguments = move |lua: &Lua, (name, values): (String, MultiValue)| match class
        .methods
        .iter()
        .find(|signature| signature.name == name)
    {
        Some(signature) => arguments(lua, &format!("arm:{name}"), signature, values),
        None => Err(fail(lua, format!("arm: the method {name:?} is not declared"))),
    };
    checks.set("arguments", lua.create_function(check_arguments)?)?;
    let missing_self_error = move |lua: &Lua, (name, first): (String, Value)| -> mlua::Result<()> {
        Err(class.missing_self_error(lua, &name, &first))
    };
    checks.set("missing_self_error", lua.create_function(missing_self_error)?)?;
    checks.set("options", lua.create_function(options)?)?;
    let unknown_key = move |lua: &Lua, key: Value| -> mlua::Result<()> {
        match &key {
            Value::String(key) => Err(class.unknown_key_error(lua, "arm", &key.to_string_lossy())),
            other => {
                let got = describe(other);
                Err(fail(lua, format!("arm: expected the name of a field or method, got {got}")))
            }
        }
    };
    checks.set("unknown", lua.create_function(unknown_key)?)?;
    let refuse = |lua: &Lua, complaint: String| -> mlua::Result<()> { Err(fail(lua, complaint)) };
    checks.set("refuse", lua.create_function(refuse)?)?;
    Ok(checks)
}

/// Fills the given options into the defaults. A closure is in 0..1, any other option a rate above 0.
fn options(lua: &Lua, (label, given, defaults): (String, Value, Table)) -> mlua::Result<Table> {
    let given = match given {
        Value::Nil => return Ok(defaults),
        Value::Table(given) => given,
        other => {
            return Err(fail(lua, format!("{label}: expected a table of options, got {}", describe(&other))));
        }
    };
    let known: Vec<String> =
        sorted_pairs(&defaults).iter().filter_map(|(key, _)| key.to_string().ok()).collect();
    for (key, value) in sorted_pairs(&given) {
        let Value::String(key) = &key else {
            return Err(fail(lua, format!("{label}: expected names of options, got {}", describe(&key))));
        };
        let key = key.to_string_lossy();
        if !known.contains(&key) {
            let message = unknown_name("option", &key, known.iter().map(String::as_str));
            return Err(fail(lua, format!("{label}: {message}")));
        }
        let range = if key == "closure" { Range::closed(0.0, 1.0) } else { Range::POSITIVE };
        match number(&value).filter(|n| range.holds(*n)) {
            Some(n) => defaults.set(key, n)?,
            None => {
                let (words, got) = (range.describe(), describe(&value));
                return Err(fail(lua, format!("{label}: {key}: expected a number{words}, got {got}")));
            }
        }
    }
    Ok(defaults)
}

fn with_view<R>(
    lua: &Lua,
    view: &SharedView,
    read: impl FnOnce(&ExpertView) -> mlua::Result<R>,
) -> mlua::Result<R> {
    match &*lock(view) {
        Some(view) => read(view),
        None => Err(fail(lua, "the expert has not started yet")),
    }
}

const CLOSURE: Type = Type::Number("", Range::closed(0.0, 1.0));
const MOTION: Type = Type::Table("{speed: number?, turn: number?, closure: number?}");
const RATE: Type = Type::Table("{rate: number?}");

/// The measurements of the arm. Commanded values are kept by the arm's Lua code, from these on.
#[derive(Clone)]
pub(crate) struct MeasuredArm(SharedView);

class! {
    /// The robot arm as an expert controls it. Each motion takes as many control steps as it needs.
    MeasuredArm: "softvt.Arm" {
        label(_) { "arm".to_owned() }
        fields {
            /// Measured pose of the tool centre point.
            pose: "softvt.Pose" {
                get(lua, this) {
                    let pose = with_view(lua, &this.0, |view| Ok(LuaPose(view.base_w * view.tcp_b)))?;
                    Value::UserData(lua.create_userdata(pose)?)
                }
            }
            /// Last commanded pose.
            target: "softvt.Pose" {
                get(lua, this) {
                    let pose = with_view(lua, &this.0, |view| Ok(LuaPose(view.base_w * view.tcp_b)))?;
                    Value::UserData(lua.create_userdata(pose)?)
                }
            }
            /// Last commanded closure: 0 is open, 1 is closed.
            closure: "number" { get(lua, this) { with_view(lua, &this.0, |view| Ok(view.closure))? } }
            /// True from a call of grasp to the next call of release or open.
            gripping: "boolean" { get(_, _) { false } }
            /// Measured distance of the gels, m.
            width: "number" { get(lua, this) { with_view(lua, &this.0, |view| Ok(view.width_m))? } }
            /// Normal force on the left and the right pad, N.
            force: "number[]" {
                get(lua, this) { fixed_list(lua, with_view(lua, &this.0, |view| Ok(view.pad_force_n))?, MEASURED)? }
            }
            /// Time since the start, s.
            time: "number" { get(lua, this) { with_view(lua, &this.0, |view| Ok(view.time_s))? } }
            /// Length of a control step, s.
            dt: "number" { get(lua, this) { with_view(lua, &this.0, |view| Ok(view.dt_s))? } }
        }
        lua_methods {
            /// Sends one command and returns at the next control step.
            fn command(pose: LuaPose, closure: f64 = CLOSURE) -> [];
            /// Moves along a straight line with a smooth speed profile. Options: speed (at most, m/s, default 0.25), turn
            /// (at most, rad/s, default 1.5), closure (reached at the end; by default it stays).
            fn move_to(pose: LuaPose, options: Option<Table> = MOTION) -> [];
            /// Moves by an offset in the world frame, m, with the options of move_to.
            fn move_by(offset: [f64; 3] = Type::Vector(3, "m"), options: Option<Table> = MOTION) -> [];
            /// Closes or opens to a closure. Option: rate (1/s, default 0.5; 1 is the whole stroke in a second).
            fn close_to(closure: f64 = CLOSURE, options: Option<Table> = RATE) -> [];
            /// Closes on an object. A binary gripper, which is either open or closed, closes here and not in close_to. A
            /// tactile servo closes until both fingers show a firm grasp, whatever closure is given.
            fn grasp(closure: f64 = CLOSURE, options: Option<Table> = RATE) -> [];
            /// Releases an object by opening to options.closure, by default wide.
            fn release(options: Option<Table> = Type::Table("{rate: number?, closure: number?}")) -> [];
            /// Opens the gripper.
            fn open(options: Option<Table> = RATE) -> [];
            /// Returns the present readings of the tactile sensors; the first call waits for a control step. Available in
            /// simulation:drive and under --policy tactile-servo.
            fn tactile() -> ["softvt.Fingers"];
            /// Holds the last command for a time.
            fn wait(seconds: f64 = Type::Number("s", Range::closed(0.0, 600.0))) -> [];
            /// Ends the expert. The last command stays, and the episode's record and the results contain the reason.
            fn give_up(reason: String) -> [];
        }
    }
}

record! {
    /// The hand of a clearance query, and the objects it may touch.
    ClearanceSpec: "softvt.Clearance" as "scene:clearance" {
        /// Distance of the gels.
        width: f64 = Type::Number("m", Range::closed(0.0, MAX_WIDTH)) => Number(MAX_WIDTH);
        /// Scene names of objects that it may touch.
        ignore: Option<Vec<String>>;
    }
}

/// Distances beyond this are reported as this, m.
const MAX_CLEARANCE: f64 = 0.2;

/// `softvt.View`.
#[derive(Clone)]
pub(crate) struct LuaView(SharedView);

class! {
    /// The true state of the scene at this control step, as an expert gets it.
    LuaView: "softvt.View" {
        label(_) { "scene".to_owned() }
        methods {
            /// Returns the state of an object.
            fn object(lua, this, name: String) -> ["softvt.ObjectState"] {
                with_view(lua, &this.0, |view| object_state(lua, find(lua, "object", &view.objects, &name)?))?
            }
            /// Returns the state of a part of an articulated object.
            fn part(lua, this, object: String, part: String) -> ["softvt.ObjectState"] {
                with_view(lua, &this.0, |view| {
                    let whole = find(lua, "object", &view.objects, &object)?;
                    object_state(lua, find(lua, "part", &whole.parts, &part)?)
                })?
            }
            /// Returns the states of all objects, in the order of the scene.
            fn objects(lua, this) -> ["softvt.ObjectState[]"] {
                with_view(lua, &this.0, |view| {
                    let states = view.objects.iter().map(|object| object_state(lua, object));
                    lua.create_sequence_from(states.collect::<mlua::Result<Vec<_>>>()?)
                })?
            }
            /// Returns the distance between a hand at a pose and the nearest object, m, and the name of that object. The
            /// distance is at most 0.2 and negative inside.
            fn clearance(lua, this, pose: LuaPose, options: ClearanceSpec) -> ["number", "string?"] {
                with_view(lua, &this.0, |view| clearance_of(lua, view, &pose, &options))?
            }
        }
    }
}

fn clearance_of(
    lua: &Lua,
    view: &ExpertView,
    pose: &LuaPose,
    spec: &ClearanceSpec,
) -> mlua::Result<(f64, Option<String>)> {
    let ignored = spec.ignore.as_deref().unwrap_or_default();
    let known = || view.objects.iter().map(|object| object.name.as_str());
    if let Some(name) = ignored.iter().find(|name| !known().any(|other| other == name.as_str())) {
        return Err(fail(lua, format!("scene:clearance: ignore: {}", unknown_name("object", name, known()))));
    }
    let has_contact =
        |object: &&ObjectView| object.asset.body != Body::Scenery && !ignored.contains(&object.name);
    let objects: Vec<&ObjectView> = view
        .objects
        .iter()
        .filter(has_contact)
        .flat_map(|object| std::iter::once(object).chain(&object.parts))
        .collect();
    let obstacles: Vec<Obstacle<'_>> = objects
        .iter()
        .map(|object| Obstacle { pose_w: object.pose_w, shape: &object.asset.shape, bounds: object.bounds })
        .collect();
    let found = clearance(&pose.0, spec.width, &obstacles, MAX_CLEARANCE);
    Ok((found.distance, found.nearest.map(|index| objects[index].name.clone())))
}

fn find<'a>(lua: &Lua, what: &str, all: &'a [ObjectView], name: &str) -> mlua::Result<&'a ObjectView> {
    let names = all.iter().map(|object| object.name.as_str());
    let found = all.iter().find(|object| object.name == name);
    found.ok_or_else(|| fail(lua, format!("scene: {}", unknown_name(what, name, names))))
}

output! {
    /// The true state of an object at one moment.
    fn object_state(lua, object: &ObjectView) -> "softvt.ObjectState" as "object" {
        /// Name in the scene.
        name: "string" = object.name.as_str();
        /// Name of its asset.
        asset: "string" = object.asset.name.as_str();
        /// Centre of its bounding box, world frame, m.
        xyz: "number[]" = lua.create_sequence_from(object.centre_w.iter().copied())?;
        /// Edge lengths of its bounding box at rest, m.
        size: "number[]" = lua.create_sequence_from(object.bounds.size().iter().copied())?;
        /// Rotation about the vertical, rad.
        yaw: "number" = object.yaw;
        /// Numbers of its asset for experts.
        hints: "table<string, number>" = lua.create_table_from(
            object.asset.hints.iter().map(|(name, value)| (name.as_str(), *value))
        )?;
        /// Joint value of a part, m or rad.
        joint: "number?" = object.joint;
        /// Joint values of an articulated object by part, m or rad.
        joints: "table<string, number>" = lua.create_table_from(
            object.parts.iter().map(|part| (part.name.as_str(), part.joint))
        )?;
        /// Parts of an articulated object by name.
        parts: "table<string, softvt.ObjectState>" = lua.create_table_from(
            object.parts.iter()
                .map(|part| Ok((part.name.as_str(), object_state(lua, part)?)))
                .collect::<mlua::Result<Vec<_>>>()?
        )?;
    }
}
