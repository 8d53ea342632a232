//! Experts: Lua coroutines that get the true state and yield one command per control step.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use mlua::{Function, IntoLua, Lua, MultiValue, Table, Thread, Value, chunk::ChunkMode};

use super::{
    envelope::{MAX_SAMPLE, sample},
    expert_input::{ExpertCommand, ExpertView, ObjectView, SuiteInstances, TrackingErrorMonitor},
    index_of,
    observation::{FingerReadings, fingers},
    pose::LuaPose,
    tasks::SuiteSpec,
};
use crate::{
    schema::{ApiObject, Constructed, Range, Type, class, function::arguments, functions, output},
    vm::{
        base_library,
        error::{SourceLine, author_line, fail, fail_at, placed},
        explain,
        library::embedded,
        privilege::check_privilege,
        value::number,
    },
};
use softvt_common::{parallel::lock, text::unknown_name};
use softvt_geometry::Pose;
use softvt_robot::{GripperSpec, Obstacle, clearance, gripper::MAX_WIDTH, pads::CASE_HALF};
use softvt_scene::{Asset, Body, Object};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FingerAccess {
    None,
    /// `arm:tactile` returns readings.
    Readings,
    /// In addition, `arm:grasp` feels in the readings how firmly the object must be held.
    Servo,
}

type SharedNotes = Arc<Mutex<BTreeMap<String, f64>>>;
type SharedReadings = Arc<Mutex<Option<FingerReadings>>>;
type SharedView = Arc<Mutex<ExpertView>>;

fn defined_line(function: &Function) -> Option<SourceLine> {
    let info = function.info();
    let file = info.source?.strip_prefix('@')?.to_owned();
    Some(SourceLine { file, line: info.line_defined? })
}

/// `file:line` where a function of a script begins.
pub(crate) fn defined_at(function: &Function) -> String {
    defined_line(function).map_or("the script".to_owned(), |line| line.to_string())
}

/// An expert as a coroutine of any virtual machine.
pub(crate) struct Coroutine {
    function: Function,
    access: FingerAccess,
    readings: SharedReadings,
    notes: SharedNotes,
    /// True if the expert needs finger readings at the next control step.
    pub wants_readings: bool,
    /// The started coroutine, and the view that it reads.
    running: Option<(Thread, SharedView)>,
    /// Reason given to `arm:give_up`, after which the expert is not resumed.
    pub gave_up: Option<String>,
}

/// Largest number of notes in the record of an episode.
const MAX_NOTES: usize = 32;
/// Longest reason for giving up that is kept, characters.
const MAX_REASON_CHARS: usize = 300;

impl Coroutine {
    pub(crate) fn new(function: Function, access: FingerAccess) -> Self {
        let (readings, notes) = (Arc::default(), Arc::default());
        Self { function, access, readings, notes, wants_readings: false, running: None, gave_up: None }
    }

    /// Numbers that the expert noted for the record of its episode, by name.
    pub(crate) fn notes(&self) -> BTreeMap<String, f64> {
        lock(&self.notes).clone()
    }

    pub(crate) fn set_readings(&mut self, readings: Option<FingerReadings>) {
        *lock(&self.readings) = readings;
    }

    /// Returns the next command, given a complaint about the last one; `None` at the end, also of one that gave up.
    pub(crate) fn next_command(
        &mut self,
        lua: &Lua,
        view: &ExpertView,
        complaint: Option<String>,
        monitor: &mut TrackingErrorMonitor,
    ) -> mlua::Result<Option<ExpertCommand>> {
        let command = match complaint {
            Some(complaint) => self.refuse(lua, view, &complaint)?,
            None => self.step(lua, view)?,
        };
        if command.is_some() {
            monitor.command = command;
        }
        Ok(command)
    }

    /// Resumes the expert with `view` and returns its next command; `None` at its end.
    pub(crate) fn step(&mut self, lua: &Lua, view: &ExpertView) -> mlua::Result<Option<ExpertCommand>> {
        if self.gave_up.is_some() {
            return Ok(None);
        }
        let is_first = self.running.is_none();
        let values = self.resume(lua, view)?;
        if is_first && self.waiting().is_none() {
            let place = defined_at(&self.function);
            self.gave_up = Some(format!(
                "{place}: the expert ended without a command; it is called once and returns when the task is done"
            ));
        }
        self.read_command(lua, view, values)
    }

    /// Reads the command that the expert yielded; `None` at its end.
    fn read_command(
        &mut self,
        lua: &Lua,
        view: &ExpertView,
        values: MultiValue,
    ) -> mlua::Result<Option<ExpertCommand>> {
        if self.waiting().is_none() {
            return Ok(None);
        }
        let mut values = values.into_iter();
        let pose_of = |value: Value| value.as_userdata()?.borrow::<LuaPose>().ok().map(|pose| pose.0);
        let pose = values.next().and_then(pose_of);
        let closure = values.next().and_then(|value| number(&value));
        let gripping = values.next().and_then(|value| value.as_boolean());
        if let Some(reason) = values.next().and_then(|value| value.as_string().map(|s| s.to_string_lossy())) {
            self.gave_up = Some(reason.chars().take(MAX_REASON_CHARS).collect());
            return Ok(None);
        }
        self.wants_readings = values.next().is_some_and(|value| value.as_boolean() == Some(true));
        let goal_b = values.next().and_then(pose_of).map(|goal_w| view.base_w.inv_mul(&goal_w));
        match (pose, closure.filter(|closure| (0.0..=1.0).contains(closure)), gripping) {
            (Some(pose_w), Some(closure), Some(gripping)) => {
                Ok(Some(ExpertCommand { pose_b: view.base_w.inv_mul(&pose_w), closure, gripping, goal_b }))
            }
            _ => Err(fail_at(
                lua,
                defined_line(&self.function),
                "the expert yielded something that is not a command; use arm:command, arm:move_to, arm:wait … instead \
                 of coroutine.yield",
            )),
        }
    }

    /// The coroutine, if it waits for the next control step.
    fn waiting(&self) -> Option<&Thread> {
        self.running.as_ref().map(|(thread, _)| thread).filter(|thread| thread.is_resumable())
    }

    /// Raises `complaint` where the script waits, and returns the next command of a script that catches it. Any other
    /// script has given up, with `complaint` and its line as the reason.
    fn refuse(
        &mut self,
        lua: &Lua,
        view: &ExpertView,
        complaint: &str,
    ) -> mlua::Result<Option<ExpertCommand>> {
        if self.gave_up.is_some() {
            return Ok(None);
        }
        if let Some((_, shared)) = &self.running {
            *lock(shared) = view.clone();
        }
        let error = match self.raise(complaint) {
            Some(Ok(values)) => return self.read_command(lua, view, values),
            Some(Err(error)) => error,
            None => fail(lua, complaint),
        };
        let reason = explain(lua, &error)?.to_string();
        if !reason.contains(complaint) {
            return Err(error);
        }
        self.gave_up = Some(reason.chars().take(MAX_REASON_CHARS).collect());
        Ok(None)
    }

    /// Raises `complaint` where the script waits; `None` if it does not wait.
    pub(crate) fn raise(&self, complaint: &str) -> Option<mlua::Result<MultiValue>> {
        let waiting = self.waiting().filter(|_| self.gave_up.is_none())?;
        Some(waiting.resume(complaint).map_err(|error| placed(error, defined_line(&self.function))))
    }

    fn resume(&mut self, lua: &Lua, view: &ExpertView) -> mlua::Result<MultiValue> {
        let resumed = match &self.running {
            Some((thread, shared)) => {
                *lock(shared) = view.clone();
                if thread.is_resumable() { thread.resume(()) } else { Ok(MultiValue::new()) }
            }
            None => {
                let view = Arc::new(Mutex::new(view.clone()));
                let host = lua.create_userdata(MeasuredArm(view.clone()))?;
                let arm = arm(lua, &host, finger_access(lua, self.access, &self.readings)?, &self.notes)?;
                let thread = lua.create_thread(self.function.clone())?;
                let (thread, view) = self.running.insert((thread, view));
                thread.resume((arm, SceneState(view.clone())))
            }
        };
        resumed.map_err(|error| placed(error, defined_line(&self.function)))
    }
}

/// Makes the arm, whose methods are in the embedded library.
fn arm(lua: &Lua, host: &mlua::AnyUserData, fingers: Table, notes: &SharedNotes) -> mlua::Result<Table> {
    let servo: Table = library_chunk(lua, "servo")?.call(MAX_WIDTH)?;
    let notes = notes.clone();
    let note = lua.create_function(move |lua, (name, value)| {
        let mut notes = lock(&notes);
        notes.insert(name, value);
        if notes.len() > MAX_NOTES {
            bail!(lua, "arm:note: expected at most {MAX_NOTES} names; note fewer");
        }
        Ok(())
    })?;
    let reaches = lua.create_function(|_, (host, pose): (mlua::AnyUserData, LuaPose)| {
        let miss = host.borrow::<MeasuredArm>()?.read(|view| view.reach.miss(&view.base_w.inv_mul(&pose.0)));
        Ok((miss.is_none(), miss.map_or(0.0, |miss| miss.distance())))
    })?;
    library_chunk(lua, "arm")?.call((host, checks(lua)?, servo, fingers, note, reaches))
}

/// A file of the library's own Lua code, out of the reach of scripts.
fn library_chunk(lua: &Lua, name: &str) -> mlua::Result<mlua::chunk::Chunk<'static>> {
    let text = embedded(&format!("scripts/softvt/{name}.lua"))
        .ok_or_else(|| fail!(lua, "the embedded library has no {name}"))?;
    let chunk = lua.load(text).set_name(format!("=softvt.{name}")).set_mode(ChunkMode::Text);
    Ok(chunk.set_environment(base_library(lua)?))
}

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
    let check_arguments = move |lua: &Lua, (name, values): (String, MultiValue)| match class
        .methods
        .iter()
        .find(|signature| signature.name == name)
    {
        Some(signature) => arguments(lua, &format!("arm:{name}"), signature, values),
        None => Err(fail!(lua, "arm: the method {name:?} is not declared")),
    };
    let missing_self_error = move |lua: &Lua, (name, first): (String, Value)| -> mlua::Result<()> {
        Err(class.missing_self_error(lua, &name, &first))
    };
    let refuse = |lua: &Lua, complaint: String| -> mlua::Result<()> { Err(fail(lua, complaint)) };
    let checks = lua.create_table()?;
    checks.set("arguments", lua.create_function(check_arguments)?)?;
    checks.set("missing_self_error", lua.create_function(missing_self_error)?)?;
    checks.set("refuse", lua.create_function(refuse)?)?;
    Ok(checks)
}

const CLOSURE: Type = Type::Number("", Range::closed(0.0, 1.0));
/// Rate of the gripper, up to the speed of its fingers (robot.gripper.speed, 0.2 m/s each): faster commands would end
/// before the hand has moved. Below the lowest rate the whole stroke takes more than a quarter of an hour.
const RATE: Type = Type::Number("1/s", Range::closed(1e-3, 5.0));
/// Largest speed and angular speed of the tool, m/s and rad/s: four times the limits of the real arm (Franka
/// Control Interface documentation, Robot and interface specifications: Cartesian space limits). Above them, the
/// unit is likely wrong.
const MAX_SPEED: f64 = 6.8;
const MAX_ANGULAR_SPEED: f64 = 10.0;

#[expect(dead_code, reason = "the arm's Lua code reads the fields")]
mod options {
    use super::{CLOSURE, MAX_ANGULAR_SPEED, MAX_SPEED, MAX_WIDTH, RATE};
    use crate::schema::{Range, Type, record};

    record! {
        /// Options of a motion of the arm.
        MotionOptions: "softvt.MotionOptions" as "arm:move_to" {
            /// Largest speed of the tool.
            speed: f64 = Type::Number("m/s", Range::above(0.0, MAX_SPEED)) => Number(0.25);
            /// Largest angular speed of the tool.
            angular_speed: f64 = Type::Number("rad/s", Range::above(0.0, MAX_ANGULAR_SPEED)) => Number(1.5);
            /// Closure at the end; by default it stays.
            closure: Option<f64> = CLOSURE;
        }
        /// Options of closing and opening.
        RateOptions: "softvt.RateOptions" as "arm:close_to" {
            /// Rate of the gripper: 1 is the whole stroke in a second, 5 the speed of the fingers.
            rate: f64 = RATE => Number(0.5);
        }
        /// Options of closing on an object.
        GraspOptions: "softvt.GraspOptions" as "arm:grasp" {
            /// Rate of the gripper: 1 is the whole stroke in a second, 5 the speed of the fingers.
            rate: f64 = RATE => Number(0.5);
            /// Measured distance of the gels at which closing stops. A tactile servo ignores it.
            width: Option<f64> = Type::Number("m", Range::closed(0.0, MAX_WIDTH));
            /// Mean normal force per pad at which closing stops. A tactile servo ignores it.
            force: Option<f64> = Type::Number("N", Range::POSITIVE);
        }
        /// Options of releasing an object.
        ReleaseOptions: "softvt.ReleaseOptions" as "arm:release" {
            /// Rate of the gripper: 1 is the whole stroke in a second, 5 the speed of the fingers.
            rate: f64 = RATE => Number(0.5);
            /// Closure at the end.
            closure: f64 = CLOSURE => Number(0.0);
        }
    }
}
use options::{GraspOptions, MotionOptions, RateOptions, ReleaseOptions};

/// The measurements of the arm. Commanded values are kept by the arm's Lua code, from these on.
#[derive(Clone)]
pub(crate) struct MeasuredArm(SharedView);

impl MeasuredArm {
    fn read<T>(&self, read: impl FnOnce(&ExpertView) -> T) -> T {
        read(&lock(&self.0))
    }

    fn tool_pose(&self) -> LuaPose {
        self.read(|view| LuaPose(view.base_w * view.tcp_b))
    }
}

class! {
    /// The robot arm as an expert controls it. Each motion takes as many control steps as it needs.
    MeasuredArm: "softvt.Arm" {
        label(_) { "arm".to_owned() }
        fields {
            /// Measured pose of the tool centre point.
            pose: "softvt.Pose" { get(_, this) { this.tool_pose() } }
            /// Pose of the last command.
            target: "softvt.Pose" { get(_, this) { this.tool_pose() } }
            /// Last commanded closure: 0 is open, 1 is closed.
            closure: "number" { get(_, this) { this.read(|view| view.closure) } }
            /// True from a call of grasp to the next call of release or open.
            gripping: "boolean" { get(_, _) { false } }
            /// True under --policy tactile-servo, whose grasp closes by touch.
            feels: "boolean" { get(_, _) { false } }
            /// Measured distance of the gels, m.
            width: "number" { get(_, this) { this.read(|view| view.width_m) } }
            /// Largest distance of the gels, m.
            stroke: "number" { get(_, _) { MAX_WIDTH } }
            /// Stiffness of the drive of a finger, N/m (robot.gripper.kp).
            finger_stiffness: "number" { get(_, this) { this.read(|view| view.gripper.kp) } }
            /// Largest force of the drive of a finger, N (robot.gripper.effort).
            finger_effort: "number" { get(_, this) { this.read(|view| view.gripper.effort) } }
            /// Sum of the normal forces at all contact points of the left and the right gel pad, N, whatever touches
            /// it; forces on the cases of the fingers do not count. On the edge of a pad the normals are oblique, and
            /// the sum is larger than the pressing force, which is -sim:tactile(side).force[3].
            force: "number[]" { get(_, this) { this.read(|view| view.pad_force_n) } }
            /// Name of the controller that takes the place of the expert's own grip, such as "size-seen" under --policy
            /// size-seen (experts.blind_grips). nil under policies that have none.
            grip_controller: "string?" { get(_, this) { this.read(|view| view.grip_controller.map(str::to_owned)) } }
            /// With a grip_controller, which must not know the instance: the instances that the suite can
            /// draw. nil without.
            instances: "softvt.Instances?" {
                get(lua, this) {
                    let instances = this.read(|view| view.instances.clone());
                    instances.map(|instances| LuaInstances::new(instances, Some(this.0.clone()))).into_lua(lua)?
                }
            }
            /// Time since the start, s.
            time: "number" { get(_, this) { this.read(|view| view.time_s) } }
            /// Length of a control step, s.
            dt: "number" { get(_, this) { this.read(|view| view.dt_s) } }
        }
        lua_methods {
            /// Sends one command and returns at the next control step.
            fn command(pose: LuaPose, closure: f64 = CLOSURE) -> [];
            /// Moves along a straight line with a smooth speed profile.
            fn move_to(pose: LuaPose, options: MotionOptions) -> [];
            /// Moves by an offset in the world frame, m.
            fn move_by(offset: [f64; 3] = Type::vector(3, "m"), options: MotionOptions) -> [];
            /// Closes or opens to a closure.
            fn close_to(closure: f64 = CLOSURE, options: RateOptions) -> [];
            /// Closes on an object, to a closure or until the width or the force of the options is reached. A binary
            /// gripper, which is either open or closed, closes here and not in close_to. A tactile servo lifts the hand
            /// by a few millimetres, finds the least grip that holds, goes back down and closes to that grip and a
            /// margin, whatever closure is given.
            fn grasp(closure: f64 = CLOSURE, options: GraspOptions) -> [];
            /// Releases an object by opening, by default wide.
            fn release(options: ReleaseOptions) -> [];
            /// Opens the gripper to its full stroke.
            fn open(options: RateOptions) -> [];
            /// Returns the present readings of the tactile sensors; the first call waits for a control step. Available
            /// in simulation:drive and under --policy tactile-servo.
            fn tactile() -> ["softvt.Fingers"];
            /// Returns true if the arm gets to a pose from its present joint positions, to 1 mm and 0.01 rad, by the
            /// steps of inverse kinematics that a motion takes; else false and the distance at which it stops, m. It
            /// ignores obstacles. The distance may be 0 where only the angle is not reached.
            fn reaches(pose: LuaPose) -> ["boolean", "number"];
            /// Holds the last command for a time.
            fn wait(seconds: f64 = Type::Number("s", Range::closed(0.0, 600.0))) -> [];
            /// Notes a number, such as the width of a grip, in the episode's record and in the manifest of a dataset. A
            /// further note of the same name replaces it.
            fn note(name: String = Type::Name, value: f64 = Type::Number("", Range::ANY)) -> [];
            /// Ends the expert. The last command stays, and the episode's record and the results contain the reason.
            fn give_up(reason: String) -> [];
        }
    }
}

#[derive(Clone)]
pub(crate) struct LuaInstances {
    instances: Arc<SuiteInstances>,
    view: Option<SharedView>,
    /// Assets of the goals of the suite, once they are known.
    kinds: Arc<Mutex<Option<Vec<Arc<Asset>>>>>,
}

impl LuaInstances {
    fn new(instances: Arc<SuiteInstances>, view: Option<SharedView>) -> Self {
        Self { instances, view, kinds: Arc::default() }
    }

    fn kinds(&self) -> mlua::Result<Vec<Arc<Asset>>> {
        if let Some(kinds) = &*lock(&self.kinds) {
            return Ok(kinds.clone());
        }
        // The layouts are Lua: nothing is locked while they run.
        let kinds = self.instances.kinds()?;
        *lock(&self.kinds) = Some(kinds.clone());
        Ok(kinds)
    }

    /// The asset of an object of the scene or the kind of a name. `None` for a part, which has no asset of its own.
    fn asset(&self, lua: &Lua, name: &str) -> mlua::Result<Option<Arc<Asset>>> {
        if let Some(view) = &self.view {
            let view = lock(view);
            if let Some(object) = view.objects.iter().find(|object| object.name == name) {
                return Ok(object.placed.as_ref().map(|placed| placed.nominal.clone()));
            }
        }
        let kinds = self.kinds()?;
        let names = kinds.iter().map(|kind| kind.name.as_str());
        Ok(Some(kinds[index_of(lua, "instances:sample", "kind", names, name)?].clone()))
    }
}

class! {
    /// The instances that a suite can draw, for a controller that must not know which one it has.
    LuaInstances: "softvt.Instances" {
        label(_) { "instances".to_owned() }
        methods {
            /// Returns the names of the assets of the objects of all goals of the suite, each once.
            fn kinds(_, this) -> ["string[]"] {
                this.kinds()?.iter().map(|kind| kind.name.clone()).collect::<Vec<_>>()
            }
            /// Returns instances of the asset of an object in the scene, or of a kind, drawn as the suite draws
            /// them, from a random stream that no episode uses: the same in every episode. Without a variation each
            /// is the asset itself.
            fn sample(
                lua,
                this,
                object: String,
                count: u32 = Type::Integer(Range::closed(1.0, MAX_SAMPLE))
            ) -> ["softvt.InstanceState[]"] {
                let SuiteInstances { suite, ranges, .. } = &*this.instances;
                match this.asset(lua, &object)? {
                    Some(asset) => sample(lua, suite, ranges.as_ref(), &asset, count)?,
                    None => Vec::new(),
                }
            }
        }
    }
}

functions! {
    FUNCTIONS {
        /// Returns measures of the standard hand: stroke is the largest distance of the gels, m; case_across is half of
        /// the thickness of a finger's sensor case across the finger, m; case_below is its extent below the tool
        /// centre point, m; finger_stiffness is that of the drive of a finger, N/m, which for the robot of a run is
        /// arm.finger_stiffness.
        fn hand(lua) -> ["table<string, number>"] {
            lua.create_table_from([
                ("stroke", MAX_WIDTH),
                ("case_across", CASE_HALF.x),
                ("case_below", CASE_HALF.z),
                ("finger_stiffness", GripperSpec::default().kp),
            ])?
        }
        /// Returns the instances that a suite can draw, by its own variation.
        fn instances(lua, suite: Constructed<SuiteSpec>) -> ["softvt.Instances"] {
            check_privilege(lua, "softvt.instances")?;
            let ranges = suite.vary.as_deref().cloned();
            LuaInstances::new(Arc::new(SuiteInstances::new(lua, &suite, ranges)?), None)
        }
    }
}

/// Distances beyond this are reported as this, m.
const MAX_CLEARANCE: f64 = 0.2;

#[derive(Clone)]
pub(crate) struct SceneState(SharedView);

impl SceneState {
    pub(crate) fn new(view: ExpertView) -> Self {
        Self(Arc::new(Mutex::new(view)))
    }
}

class! {
    /// The true state of the scene at this control step, as an expert gets it.
    SceneState: "softvt.SceneState" {
        label(_) { "scene".to_owned() }
        methods {
            /// Returns the state of an object.
            fn object(lua, this, name: String) -> ["softvt.ObjectState"] {
                object_state(lua, find(lua, "scene", "object", &lock(&this.0).objects, &name)?)?
            }
            /// Returns the state of a part of an articulated object.
            fn part(lua, this, object: String, part: String) -> ["softvt.ObjectState"] {
                let view = lock(&this.0);
                let whole = find(lua, "scene", "object", &view.objects, &object)?;
                if whole.parts.is_empty() {
                    return Err(fail_at(lua, author_line(lua), format_args!("scene: {object} has no parts, which softvt.articulated has")));
                }
                object_state(lua, find(lua, "scene", "part", &whole.parts, &part)?)?
            }
            /// Returns the states of all objects, in the order of the scene.
            fn objects(lua, this) -> ["softvt.ObjectState[]"] {
                let view = lock(&this.0);
                let states = view.objects.iter().map(|object| object_state(lua, object));
                lua.create_sequence_from(states.collect::<mlua::Result<Vec<_>>>()?)?
            }
            /// Returns the distance between a hand at a pose and the nearest object, m, and the name of that object.
            /// The distance is at most 0.2 and negative inside.
            fn clearance(lua, this, pose: LuaPose) takes options "softvt.Clearance" {
                /// Distance of the gels.
                width: f64 = Type::Number("m", Range::closed(0.0, MAX_WIDTH)) => Number(MAX_WIDTH);
                /// Scene names of objects that it may touch.
                ignore: Vec<String> => Empty;
            } -> ["number", "string?"] {
                let view = lock(&this.0);
                for name in &ignore {
                    find(lua, "scene:clearance: ignore", "object", &view.objects, name)?;
                }
                clearance_of(&view, &pose.0, width, &ignore)
            }
        }
    }
}

/// The clearance of a hand and the name of the nearest object.
fn clearance_of(view: &ExpertView, hand_w: &Pose, width: f64, ignore: &[String]) -> (f64, Option<String>) {
    let objects: Vec<&ObjectView> = view
        .objects
        .iter()
        .filter(|object| object.asset.body != Body::Scenery && !ignore.contains(&object.name))
        .flat_map(|object| std::iter::once(object).chain(&object.parts))
        .collect();
    let obstacles: Vec<Obstacle<'_>> = objects
        .iter()
        .map(|object| Obstacle { pose_w: object.pose_w, shape: &object.asset.shape, bounds: object.bounds })
        .collect();
    let found = clearance(hand_w, width, &obstacles, MAX_CLEARANCE);
    (found.distance, found.nearest.map(|index| objects[index].name.clone()))
}

fn find<'a>(
    lua: &Lua,
    label: &str,
    what: &str,
    all: &'a [ObjectView],
    name: &str,
) -> mlua::Result<&'a ObjectView> {
    let names = all.iter().map(|object| object.name.as_str());
    all.iter().find(|object| object.name == name).ok_or_else(|| {
        // Of the script's author, also where an expert of the library looks for it.
        fail_at(lua, author_line(lua), format_args!("{label}: {}", unknown_name(what, name, names)))
    })
}

output! {
    /// The true state of an object at one moment.
    fn object_state(lua, object: &ObjectView) -> "softvt.ObjectState" as "object" {
        /// Name in the scene.
        name: "string" = object.name.as_str();
        /// Name of its asset.
        asset: "string" = object.asset.name.as_str();
        /// Centre of its bounding box, world frame, m.
        centre: "number[]" = lua.create_sequence_from(object.centre_w.iter().copied())?;
        /// Edge lengths of its bounding box at rest, m: along the axes of its shape, or, if it has tilted by 5° or more
        /// while it settled, of the upright box about it as it lay then, longer horizontal side first.
        size: "number[]" = lua.create_sequence_from(object.size.iter().copied())?;
        /// Size relative to that of its asset. `size` and hints in metres are those of the object itself.
        scale: "number" = object.placed.as_ref().map_or(1.0, |placed| placed.scale);
        /// Young's modulus relative to that of its asset; nil unless soft.
        youngs_factor: "number?" = object.placed.as_ref().and_then(Object::youngs_factor);
        /// Density relative to that of its asset; nil unless soft or rigid.
        density_factor: "number?" = object.placed.as_ref().and_then(Object::density_factor);
        /// Stable strain relative to that of its asset; nil unless soft.
        strain_factor: "number?" = object.placed.as_ref().and_then(Object::strain_factor);
        /// Static friction of its coating, which is that of every pair with it; nil without one.
        coating: "number?" = object.placed.as_ref().and_then(Object::coating);
        /// Rotation of its bounding box about the vertical, rad.
        yaw: "number" = object.yaw;
        /// Numbers of its asset for experts; those whose names end in _m are lengths and follow the scale.
        hints: "table<string, number>" = lua.create_table_from(
            object.asset.hints.iter().map(|(name, value)| (name.as_str(), *value))
        )?;
        /// Frame of its shape: the origin of an object is below its centre, at its lowest point.
        pose: "softvt.Pose" = LuaPose(object.pose_w);
        /// Joint value of a part, m or rad; nil for a whole object, as are the next three.
        joint: "number?" = object.joint.map(|joint| joint.value);
        /// Lowest and highest value of its joint, m or rad.
        joint_range: "number[]?" = object.joint.map(|joint| joint.range.to_vec());
        /// Direction in which the value of a slider grows, or the axis about which that of a hinge does; world frame.
        joint_axis: "number[]?" = object.joint.map(|joint| joint.axis_w.as_slice().to_vec());
        /// A point of the axis of a hinge, world frame, m.
        joint_origin: "number[]?" = object.joint.map(|joint| joint.origin_w.as_slice().to_vec());
        /// Joint values of an articulated object by part, m or rad.
        joints: "table<string, number>" = lua.create_table_from(
            object.parts.iter().map(|part| (part.name.as_str(), part.joint.map(|joint| joint.value)))
        )?;
        /// Parts of an articulated object by name.
        parts: "table<string, softvt.ObjectState>" = lua.create_table_from(
            object.parts.iter()
                .map(|part| Ok((part.name.as_str(), object_state(lua, part)?)))
                .collect::<mlua::Result<Vec<_>>>()?
        )?;
    }
}
