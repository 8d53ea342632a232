//! One episode's own machine: the scene that its layout builds, and its expert.

use mlua::{Function, Lua, MultiValue, Table, Value};

use crate::script::{
    Loaded, ScriptError,
    api::scene::{LuaScene, empty_scene},
    plan::{Machine, find_task, reopen, sound_task},
    run::expert,
    schema::unknown,
    vm::origin::fail_at,
    vm::random::Rng,
    vm::{fail, locked},
};
use crate::{
    benchmark::{
        Shift,
        seed::{EpisodeSeed, RandomStream, Split},
    },
    scene::{Body, Scene},
    text::format_number,
};

/// Which episode.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeRequest {
    /// Name of the suite.
    pub suite: String,
    /// Index of the task in it.
    pub task: usize,
    /// Index of the episode in its split.
    pub episode: u64,
    /// Seed of the run.
    pub base_seed: u64,
    /// Which list of episodes.
    pub split: Split,
    /// Shifts to apply, in order, by name and value.
    pub shifts: Vec<(String, f64)>,
}

/// An episode that is ready to be simulated.
pub struct Episode {
    /// What it starts from.
    pub scene: Scene,
    /// The same before the shifts: limits are those of its objects.
    pub nominal: Scene,
    /// What its random streams come from.
    pub seed: EpisodeSeed,
    machine: Machine,
    expert: Option<Function>,
}

impl Episode {
    /// Runs the sources of `loaded` in a fresh machine, builds the scene and applies the shifts.
    ///
    /// # Errors
    /// If the suite, task or a shift is unknown, or the script fails.
    pub fn open(loaded: &Loaded, request: &EpisodeRequest) -> Result<Self, ScriptError> {
        let (machine, values) = reopen(loaded)?;
        let Start { scene, nominal, seed, expert } = start(&machine, &values, request)?;
        Ok(Self { scene, nominal, seed, machine, expert })
    }

    /// The expert of the task, ready to start; none if the task has none.
    ///
    /// # Errors
    /// If the machine cannot make a coroutine.
    pub fn expert(self) -> Result<Option<expert::Expert>, ScriptError> {
        let Some(function) = self.expert else { return Ok(None) };
        self.machine.vm.random.reseed(self.seed.stream(RandomStream::Expert));
        expert::Expert::start(self.machine, &function).map(Some)
    }
}

/// A machine that lays out one scene after another, of which none will be run: what a layout leaves behind in the machine
/// is seen by the next.
pub struct Scenes {
    machine: Machine,
    values: MultiValue,
}

impl Scenes {
    /// Runs the sources of `loaded` in a fresh machine.
    ///
    /// # Errors
    /// If the script fails.
    pub fn open(loaded: &Loaded) -> Result<Self, ScriptError> {
        let (machine, values) = reopen(loaded)?;
        Ok(Self { machine, values })
    }

    /// The scene that an episode starts from, before and after the shifts.
    ///
    /// # Errors
    /// As [`Episode::open`].
    pub fn of(&self, request: &EpisodeRequest) -> Result<(Scene, Scene), ScriptError> {
        let Start { scene, nominal, .. } = start(&self.machine, &self.values, request)?;
        Ok((nominal, scene))
    }
}

/// What an episode starts from.
struct Start {
    scene: Scene,
    nominal: Scene,
    seed: EpisodeSeed,
    expert: Option<Function>,
}

fn start(machine: &Machine, values: &MultiValue, request: &EpisodeRequest) -> Result<Start, ScriptError> {
    let (suite, task) = find_task(machine, values, &request.suite, request.task)?;
    let parts = read(machine, &task).map_err(|e| machine.vm.explain(&e))?;
    let seed = EpisodeSeed {
        suite: request.suite.clone(),
        layout: parts.layout,
        episode: request.episode,
        base: request.base_seed,
        split: request.split,
    };
    machine.vm.random.reseed(seed.stream(RandomStream::Script));
    let scene = LuaScene::new(empty_scene());
    let userdata = machine.vm.lua.create_userdata(scene.clone()).map_err(|e| machine.vm.explain(&e))?;
    machine.vm.call::<()>(&parts.build, (&userdata, Rng::new(seed.clone(), RandomStream::Layout)))?;
    let nominal = locked(&scene.scene).clone();
    let mut current = scene;
    for (name, value) in &request.shifts {
        let (apply, value) = find_shift(machine, &suite, name, *value)?;
        current = shifted(machine, &apply, current, value)?;
    }
    let scene = locked(&current.scene).clone();
    check_goal(&machine.vm.lua, &task, &scene).map_err(|e| machine.vm.explain(&e))?;
    Ok(Start { scene, nominal, seed, expert: parts.expert })
}

struct Parts {
    layout: String,
    build: Function,
    expert: Option<Function>,
}

fn read(machine: &Machine, task: &Table) -> mlua::Result<Parts> {
    sound_task(&machine.vm.lua, task)?;
    let layout: Table = task.get("layout")?;
    Ok(Parts { layout: layout.get("name")?, build: layout.get("build")?, expert: task.get("expert")? })
}

fn find_shift(
    machine: &Machine,
    suite: &Table,
    name: &str,
    value: f64,
) -> Result<(Function, f64), ScriptError> {
    let explain = |e: mlua::Error| machine.vm.explain(&e);
    let shifts: Option<Vec<Table>> = suite.get("shifts").map_err(explain)?;
    let mut names = Vec::new();
    for shift in shifts.unwrap_or_default() {
        let known: String = shift.get("name").map_err(explain)?;
        if known == name {
            return Ok((shift.get("apply").map_err(explain)?, value));
        }
        names.push(known);
    }
    let main = &machine.vm.shared.main;
    Err(match names.is_empty() {
        true => ScriptError::new(main, format!("unknown shift {name:?}; the suite declares none")),
        false => ScriptError::new(main, unknown("shift", name, names.iter().map(String::as_str))),
    })
}

/// The value of `--shift name=value`, checked against what the suite declares.
///
/// # Errors
/// If the shift is unknown or the value is out of its range; a fragment for people.
pub fn check_shift(shifts: &[Shift], name: &str, value: f64) -> Result<(), String> {
    let Some(shift) = shifts.iter().find(|shift| shift.name == name) else {
        return Err(match shifts.is_empty() {
            true => format!("unknown shift {name:?}; the suite declares none"),
            false => unknown("shift", name, shifts.iter().map(|shift| shift.name.as_str())),
        });
    };
    let range = crate::script::schema::Range {
        min: shift.min.unwrap_or(f64::NEG_INFINITY),
        max: shift.max.unwrap_or(f64::INFINITY),
        ..crate::script::schema::Range::ANY
    };
    match range.holds(value) {
        true => Ok(()),
        false => Err(format!(
            "shift {name}: expected a number{} ({}), got {}",
            range.words(),
            shift.unit,
            format_number(value)
        )),
    }
}

fn shifted(
    machine: &Machine,
    apply: &Function,
    scene: LuaScene,
    value: f64,
) -> Result<LuaScene, ScriptError> {
    let vm = &machine.vm;
    let result: Value = vm.call(apply, (scene.clone(), value))?;
    match &result {
        Value::Nil => Ok(scene),
        Value::UserData(data) => match data.borrow::<LuaScene>() {
            Ok(other) => Ok(other.clone()),
            Err(_) => Err(vm.explain(&fail(&vm.lua, "shift.apply: expected the scene to be returned"))),
        },
        _ => Err(vm.explain(&fail(&vm.lua, "shift.apply: expected the scene or nothing to be returned"))),
    }
}

/// A goal that names what is not there, or what cannot get anywhere, would never be reached.
fn check_goal(lua: &Lua, task: &Table, scene: &Scene) -> mlua::Result<()> {
    let goal: Table = task.get("goal")?;
    for key in ["object", "target"] {
        let name: String = goal.get(key)?;
        let wrong = |what: String| Err(fail_at(lua, &goal, key, format!("task.goal.{key}: {what}")));
        let mut known = scene.names();
        if key == "object" {
            // What is to be carried is no part of anything.
            known.retain(|name| !name.contains('.'));
        }
        if !known.contains(&name) {
            return wrong(unknown("object", &name, known.iter().map(String::as_str)));
        }
        let object = scene.objects.iter().find(|object| object.name == name);
        match (key, object.map(|object| &object.asset.body)) {
            ("object", Some(Body::Static | Body::Articulated(_) | Body::Scenery)) => {
                return wrong(format!(
                    "{name:?} never moves; name an object whose body is softvt.soft or softvt.rigid"
                ));
            }
            ("target", Some(Body::Scenery)) => {
                return wrong(format!(
                    "{name:?} is softvt.scenery, which nothing touches; name what can be reached"
                ));
            }
            _ => {}
        }
    }
    Ok(())
}
