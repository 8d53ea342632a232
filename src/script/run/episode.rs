//! Episodes: the scene that a task's layout builds, and the task's expert.

use mlua::{Function, Lua, MultiValue, Value};

use crate::{
    benchmark::{
        Shift, ShiftValue,
        seed::{EpisodeSeed, RandomStream},
    },
    evaluation::episode_id::EpisodeId,
    parallel::lock,
    scene::{Body, Scene},
    script::{
        api::{
            random::LuaRng,
            scene::{LuaScene, empty_scene},
            tasks::{GoalSpec, SuiteSpec},
        },
        plan::{LoadedScript, ScriptInstance, find_task, reopen},
        run::expert::Expert,
        schema::{Constructed, HasTable, Range},
        vm::{
            error::{ScriptError, fail},
            source_map::fail_at_key,
        },
    },
    text::{format_number, unknown_name},
};

/// An episode as its script describes it: the scene that the layout builds, and the expert of the task.
pub struct EpisodeSetup {
    /// Initial scene.
    pub scene: Scene,
    /// Initial scene before the shifts; deformation limits are those of its objects.
    pub nominal: Scene,
    /// Source of its random streams.
    pub seed: EpisodeSeed,
    instance: ScriptInstance,
    expert: Option<Function>,
}

impl EpisodeSetup {
    /// Runs the sources of `loaded` in a new virtual machine, builds the scene and applies the shifts in
    /// order.
    ///
    /// # Errors
    /// If the suite, the task or a shift is unknown, or the script fails.
    pub fn open(loaded: &LoadedScript, id: &EpisodeId, shifts: &[ShiftValue]) -> Result<Self, ScriptError> {
        let (instance, values) = reopen(loaded)?;
        let Start { scene, nominal, seed, expert } = start(&instance, &values, id, shifts)?;
        Ok(Self { scene, nominal, seed, instance, expert })
    }

    /// The expert of the task, ready to start; `None` if the task has no expert.
    pub fn expert(self) -> Option<Expert> {
        let function = self.expert?;
        self.instance.vm.random.reseed(self.seed.stream(RandomStream::Expert));
        Some(Expert::start(self.instance, &function))
    }
}

/// Builds many scenes in one virtual machine, for checks without a simulation. Global state that one layout changes is
/// seen by the next.
pub struct Scenes {
    instance: ScriptInstance,
    values: MultiValue,
}

impl Scenes {
    /// Runs the sources of `loaded` in a new virtual machine.
    ///
    /// # Errors
    /// If the script fails.
    pub fn open(loaded: &LoadedScript) -> Result<Self, ScriptError> {
        let (instance, values) = reopen(loaded)?;
        Ok(Self { instance, values })
    }

    /// The initial scene of an episode, before and after the shifts.
    ///
    /// # Errors
    /// As [`EpisodeSetup::open`].
    pub fn of(&self, id: &EpisodeId, shifts: &[ShiftValue]) -> Result<(Scene, Scene), ScriptError> {
        let Start { scene, nominal, .. } = start(&self.instance, &self.values, id, shifts)?;
        Ok((nominal, scene))
    }
}

/// Initial state of an episode.
struct Start {
    scene: Scene,
    nominal: Scene,
    seed: EpisodeSeed,
    expert: Option<Function>,
}

fn start(
    instance: &ScriptInstance,
    values: &MultiValue,
    id: &EpisodeId,
    shifts: &[ShiftValue],
) -> Result<Start, ScriptError> {
    let vm = &instance.vm;
    let (suite, task) = find_task(instance, values, &id.suite, id.task)?;
    let seed = EpisodeSeed::new(id, &task.layout.name);
    vm.random.reseed(seed.stream(RandomStream::Script));
    let scene = LuaScene::new(empty_scene());
    let userdata = vm.lua.create_userdata(scene.clone()).map_err(|e| vm.explain(&e))?;
    vm.call::<()>(&task.layout.build, (&userdata, LuaRng::new(seed.clone(), RandomStream::Layout)))?;
    let nominal = lock(&scene.scene).clone();
    let mut current = scene;
    for ShiftValue { name, value } in shifts {
        let apply = find_shift(instance, &suite, name)?;
        current = apply_shift(instance, &apply, current, *value)?;
    }
    let scene = lock(&current.scene).clone();
    check_goal(&vm.lua, &task.goal, &scene).map_err(|e| vm.explain(&e))?;
    Ok(Start { scene, nominal, seed, expert: task.expert.clone() })
}

/// Message about a shift that a suite does not declare.
fn unknown_shift<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match known.clone().next() {
        None => format!("unknown shift {name:?}; the suite declares none"),
        Some(_) => unknown_name("shift", name, known),
    }
}

/// The function of a shift.
fn find_shift(
    instance: &ScriptInstance,
    suite: &Constructed<SuiteSpec>,
    name: &str,
) -> Result<Function, ScriptError> {
    let shifts = suite.shifts.as_deref().unwrap_or_default();
    match shifts.iter().find(|shift| shift.name == name) {
        Some(shift) => Ok(shift.apply.clone()),
        None => {
            let names = shifts.iter().map(|shift| shift.name.as_str());
            Err(ScriptError::new(instance.vm.main(), unknown_shift(name, names)))
        }
    }
}

/// Checks the value of `--shift name=value` against the declared shifts of a suite.
///
/// # Errors
/// If the shift is unknown or the value is out of its range; the message is a fragment.
pub fn check_shift(shifts: &[Shift], name: &str, value: f64) -> Result<(), String> {
    let Some(shift) = shifts.iter().find(|shift| shift.name == name) else {
        return Err(unknown_shift(name, shifts.iter().map(|shift| shift.name.as_str())));
    };
    let range = Range::between(shift.min, shift.max);
    match range.holds(value) {
        true => Ok(()),
        false => Err(format!(
            "shift {name}: expected a number{} ({}), got {}",
            range.describe(),
            shift.unit,
            format_number(value)
        )),
    }
}

fn apply_shift(
    instance: &ScriptInstance,
    apply: &Function,
    scene: LuaScene,
    value: f64,
) -> Result<LuaScene, ScriptError> {
    let vm = &instance.vm;
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

/// Checks that the object and the target of a goal exist, and that the object can move.
fn check_goal(lua: &Lua, goal: &GoalSpec, scene: &Scene) -> mlua::Result<()> {
    for (key, name) in [("object", goal.object()), ("target", goal.target())] {
        let wrong =
            |what: String| Err(fail_at_key(lua, goal.table(), key, format!("task.goal.{key}: {what}")));
        let mut known = scene.names();
        if key == "object" {
            // Parts of objects cannot be carried.
            known.retain(|name| !name.contains('.'));
        }
        if !known.iter().any(|known| known == name) {
            return wrong(unknown_name("object", name, known.iter().map(String::as_str)));
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
                    "{name:?} is softvt.scenery, which has no contact; name an object that has"
                ));
            }
            _ => {}
        }
    }
    Ok(())
}
