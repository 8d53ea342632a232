//! Episodes: the scene that a task's layout builds, and the task's expert.

use std::{collections::BTreeMap, sync::Arc};

use mlua::{FromLua, Function, Lua, Value};

use super::{
    expert::{ExpertController, ExpertGrip},
    predicate::SceneFunction,
};
use crate::{
    api::{
        envelope::draw_presses,
        expert_input::SuiteInstances,
        goals::DeclaredPredicate,
        random::LuaRng,
        scene::{LuaScene, empty_scene},
        scene_names::{self, check_expert, movable_object},
        tasks::{SuiteSpec, TaskSpec},
    },
    plan::{self, FoundTask, LoadedScript, ScriptInstance},
    schema::{Constructed, Range, Type, UnusualNumbers},
    vm::{
        error::{ScriptError, fail},
        source_map::fail_at_key,
    },
};
use softvt_benchmark::{
    Shift, ShiftValue, Suite,
    goal_conflict::conflict,
    seed::{EpisodeSeed, RandomStream, SecretSeed},
    variation::{VariationError, VariationRanges},
};
use softvt_common::episode_id::EpisodeId;
use softvt_common::{
    parallel::lock,
    text::{AXIS_NAMES, format_number, unknown_name},
};
use softvt_geometry::Aabb;
use softvt_robot::{gripper::MAX_WIDTH, panda};
use softvt_rollout::{MeasuredMetric, StatePredicate};
use softvt_scene::{CameraSettings, Scene, SceneVariation};

/// Rounding of lengths, m, and of the numbers of quaternions.
const ROUNDING: f64 = 1e-9;

/// Changes of a scene between its layout and the start of an episode, applied in the order of the fields. The variation
/// comes before them: limits and initial states are those of the varied scene.
#[derive(Clone, Debug, Default)]
pub struct SceneChanges {
    /// Shifts by name and value, in the order in which they apply.
    pub shifts: Vec<ShiftValue>,
    pub rigid_twin: bool,
    pub cameras: CameraSettings,
}

/// An episode as its script describes it: the scene that the layout builds, and the expert of the task.
pub struct EpisodeSetup {
    pub scene: Scene,
    /// The same without the shifts; deformation limits are those of its objects.
    pub nominal: Scene,
    /// Changes of the layout's scene by the variation of the suite, if it varies.
    pub variation: Option<SceneVariation>,
    /// Instruction to the policy, which a shift may have changed.
    pub prompt: String,
    /// The same without the shifts.
    pub nominal_prompt: String,
    pub predicates: Vec<Arc<dyn StatePredicate>>,
    pub metrics: Vec<MeasuredMetric>,
    pub seed: EpisodeSeed,
    instance: Arc<ScriptInstance>,
    expert: Option<Function>,
    instances: Arc<SuiteInstances>,
}

impl EpisodeSetup {
    /// Runs the sources of `loaded` in a new virtual machine, builds the scene and applies the changes.
    ///
    /// # Errors
    /// If the suite, the task or a shift is unknown, or the script fails.
    pub fn open(loaded: &LoadedScript, id: &EpisodeId, changes: &SceneChanges) -> Result<Self, ScriptError> {
        SceneBuilder::open(loaded)?.build(id, changes)
    }

    /// True if the shifts change the scene or the prompt. Rounding of camera poses does not count,
    /// nor do source locations.
    pub fn is_shifted(&self) -> bool {
        let mut scene = self.scene.clone();
        for (camera, nominal) in scene.cameras.iter_mut().zip(&self.nominal.cameras) {
            camera.set_at.clone_from(&nominal.set_at);
            let offset = camera.pose.translation.vector - nominal.pose.translation.vector;
            let turn = camera.pose.rotation.coords - nominal.pose.rotation.coords;
            if offset.norm().max(turn.norm()) < ROUNDING {
                camera.pose = nominal.pose;
            }
        }
        for (object, nominal) in scene.objects.iter_mut().zip(&self.nominal.objects) {
            object.placed_at.clone_from(&nominal.placed_at);
        }
        self.prompt != self.nominal_prompt || scene != self.nominal
    }

    /// Messages about numbers of the script outside of their usual range, with file and line.
    pub fn unusual_numbers(&self) -> Vec<String> {
        UnusualNumbers::of(&self.instance.vm.lua)
    }

    /// The controller that runs the expert of the task; `None` if the task has no expert.
    pub fn expert(self, mode: ExpertGrip) -> Option<ExpertController> {
        let function = self.expert?;
        self.instance.vm.random.reseed(self.seed.stream(RandomStream::Expert));
        Some(ExpertController::new(self.instance, function, mode, self.instances))
    }
}

/// Builds the scenes of several episodes in one virtual machine, for looks at them without a simulation. Global state
/// that one layout changes is seen by the next.
pub struct SceneBuilder {
    instance: Arc<ScriptInstance>,
    suites: BTreeMap<String, Suite>,
    secret: Option<SecretSeed>,
}

impl SceneBuilder {
    /// Runs the sources of `loaded` in a new virtual machine.
    pub fn open(loaded: &LoadedScript) -> Result<Self, ScriptError> {
        let suites = loaded.plan.suites().iter().map(|suite| (suite.name.clone(), suite.clone()));
        let instance = Arc::new(loaded.sources.instance()?);
        Ok(Self { instance, suites: suites.collect(), secret: loaded.secret.clone() })
    }

    pub fn build(&self, id: &EpisodeId, changes: &SceneChanges) -> Result<EpisodeSetup, ScriptError> {
        self.try_build(id, changes).map_err(|e| self.instance.vm.explain(&e))
    }

    fn try_build(&self, id: &EpisodeId, changes: &SceneChanges) -> mlua::Result<EpisodeSetup> {
        let vm = &self.instance.vm;
        let FoundTask { suite, task } = self.instance.find_task(&id.suite, id.task)?;
        self.check_suite(&suite)?;
        let ranges = self.suites.get(&id.suite).and_then(|suite| suite.vary.as_ref());
        // A twin has the initial states of the suite whose twin it is.
        let seed_id = EpisodeId { suite: suite.twin_of.as_ref().unwrap_or(&id.suite).clone(), ..id.clone() };
        let seed = EpisodeSeed::new(&seed_id, &task.layout.name).with_secret(self.secret.as_ref());
        vm.random.reseed(seed.stream(RandomStream::Script));
        let mut current = LuaScene::new(empty_scene());
        let rng = LuaRng::new(seed.clone(), RandomStream::Layout);
        vm.call::<()>(&task.layout.build, (current.clone(), rng))?;
        check_materials(&lock(&current.scene))?;
        let varied = ranges.map(|ranges| vary(&vm.lua, &mut lock(&current.scene), ranges, &seed));
        let variation = varied.transpose()?;
        let mut nominal = lock(&current.scene).clone();
        let object = task.object_name(&vm.lua)?;
        let (_, predicates) = task.goal.plain(&vm.lua)?;
        let nominal_prompt = self.episode_prompt(&suite, &task, &current, &seed)?;
        current = current.for_task(&object, &nominal_prompt);
        let shifts = suite.shifts.as_slice();
        for ShiftValue { name, value } in &changes.shifts {
            let Some(shift) = shifts.iter().find(|shift| shift.name == *name) else {
                let names = shifts.iter().map(|shift| shift.name.as_str());
                return Err(ScriptError::new(vm.main(), unknown_shift(name, names)).into());
            };
            current = self.shifted(&shift.apply, current, *value, &seed)?;
        }
        let prompt = current.prompt().unwrap_or_else(|| nominal_prompt.clone());
        let mut scene = lock(&current.scene).clone();
        if suite.twin_of.is_some() || changes.rigid_twin {
            (scene, nominal) = (scene.rigid_twin(), nominal.rigid_twin());
        }
        for scene in [&mut scene, &mut nominal] {
            changes.cameras.apply(&mut scene.cameras);
        }
        check_names(&vm.lua, &task, &predicates, &scene, &nominal)?;
        check_workspace(&scene).map_err(|what| fail_at_key(&vm.lua, &task.layout.table, "build", what))?;
        let largest = ranges.map_or(1.0, |ranges| ranges.size.max);
        check_width(&scene, &object, variation.as_ref(), largest)?;
        let (instance, expert) = (self.instance.clone(), task.expert.clone());
        let instances = Arc::new(SuiteInstances::new(&vm.lua, &suite, ranges.cloned())?);
        let scene_function = |name: String, function: Function| {
            Arc::new(SceneFunction { instance: self.instance.clone(), name, function })
        };
        let predicates = predicates.into_iter().filter_map(|DeclaredPredicate { goal, function, .. }| {
            Some(scene_function(goal.describe(), function?) as Arc<dyn StatePredicate>)
        });
        let predicates = predicates.collect();
        let metrics = suite.metrics.iter().map(|spec| MeasuredMetric {
            metric: spec.plain(),
            function: scene_function(spec.name.clone(), spec.of.clone()),
        });
        let metrics = metrics.collect();
        Ok(EpisodeSetup {
            scene,
            nominal,
            variation,
            prompt,
            nominal_prompt,
            predicates,
            metrics,
            seed,
            instance,
            expert,
            instances,
        })
    }

    /// Checks that the script declares the suite of the plan again.
    fn check_suite(&self, spec: &Constructed<SuiteSpec>) -> mlua::Result<()> {
        let lua = &self.instance.vm.lua;
        let again = plan::suite(lua, spec)?;
        // The variation may be that of the command line.
        let is_same = |planned: &Suite| *planned == Suite { vary: planned.vary.clone(), ..again.clone() };
        if self.suites.get(&spec.name).is_some_and(is_same) {
            return Ok(());
        }
        let what = "differs from that of the plan, which the same file gave before; return the same suite each time that \
                    the file runs";
        Err(fail_at_key(lua, &spec.table, "tasks", format_args!("suite {:?} {what}", spec.name)))
    }

    /// The prompt of an episode of this initial scene: that of the task, or what its function returns.
    fn episode_prompt(
        &self,
        suite: &SuiteSpec,
        task: &Constructed<TaskSpec>,
        current: &LuaScene,
        seed: &EpisodeSeed,
    ) -> mlua::Result<String> {
        let Some(function) = &task.episode_prompt else { return Ok(task.prompt.clone()) };
        let vm = &self.instance.vm;
        let wrong = |what: String| task.invalid(&vm.lua, "episode_prompt", what);
        let scene = lock(&current.scene).clone();
        let given = LuaScene::new(scene.clone());
        let rng = LuaRng::new(seed.clone(), RandomStream::Prompt);
        // Draws of shifts must not depend on a drawn prompt.
        let before = vm.random.replace(seed.stream(RandomStream::Prompt));
        let prompt = vm.call::<Value>(function, (given.clone(), rng));
        vm.random.reseed(before);
        let prompt = prompt?;
        // A script may have kept the scene of the layout.
        if *lock(&given.scene) != scene || *lock(&current.scene) != scene {
            return Err(wrong("changed the scene; change it in the layout".to_owned()));
        }
        let checked =
            Type::Text.check(&vm.lua, &prompt).map_err(|error| wrong(error.describe("what it returned")))?;
        let prompt = String::from_lua(checked, &vm.lua)?;
        // Spaces of clients list the characters of prompts.
        let is_known =
            |c: char| (' '..='~').contains(&c) || suite.tasks.iter().any(|task| task.prompt.contains(c));
        match prompt.chars().find(|c| !is_known(*c)) {
            _ if prompt.trim().is_empty() => Err(wrong("returned a blank text".to_owned())),
            Some(c) => Err(wrong(format!(
                "returned {prompt:?}, whose {c:?} is neither ASCII nor in a prompt of the suite"
            ))),
            None => Ok(prompt),
        }
    }

    /// The result of a shift's function: a scene, or nothing if it changed the given one.
    fn shifted(
        &self,
        apply: &Function,
        scene: LuaScene,
        value: f64,
        seed: &EpisodeSeed,
    ) -> mlua::Result<LuaScene> {
        let vm = &self.instance.vm;
        let wrong = |expected| fail!(&vm.lua, "shift.apply: expected {expected} to be returned");
        let rng = LuaRng::new(seed.clone(), RandomStream::Script);
        match &vm.call::<Value>(apply, (scene.clone(), value, rng))? {
            Value::Nil => Ok(scene),
            Value::UserData(data) => match data.borrow::<LuaScene>() {
                Ok(other) => Ok(other.clone()),
                Err(_) => Err(wrong("the scene")),
            },
            _ => Err(wrong("the scene or nothing")),
        }
    }
}

fn vary(
    lua: &Lua,
    scene: &mut Scene,
    ranges: &VariationRanges,
    seed: &EpisodeSeed,
) -> mlua::Result<SceneVariation> {
    let drawn = ranges.draw(seed, scene, &|asset| draw_presses(lua, asset));
    let subject = format!("layout {:?} of suite {:?}", seed.layout, seed.id.suite);
    let drawn = drawn.map_err(|error| {
        fail(lua, match error {
            VariationError::NoSoftObject => format!(
                "{subject} {error}, and the variation {:?} changes soft objects; vary a suite of soft objects",
                ranges.name
            ),
            _ => format!("{subject}: {error}"),
        })
    })?;
    drawn.apply(scene).map_err(|error| fail!(lua, "{subject}: {error}"))?;
    Ok(drawn)
}

/// Factors by which a layout may change the material of an object: those that a variation may draw.
const MATERIAL_FACTORS: Range = Range::closed(0.1, 10.0);

/// Checks the materials that the layout has changed. Limits of D stay those of the asset, and records have the factors
/// of shifts and variations alone.
fn check_materials(scene: &Scene) -> Result<(), ScriptError> {
    for object in &scene.objects {
        let factors = [("youngs_pa", object.youngs_factor()), ("density", object.density_factor())];
        for (key, factor) in factors {
            let Some(factor) = factor.filter(|factor| !MATERIAL_FACTORS.contains(*factor)) else { continue };
            let message = format!(
                "object.{key}: the layout gives {:?} {} times the {key} of its asset {:?}, expected{}; declare an asset of \
                 that material, or a shift",
                object.name,
                format_number(factor),
                object.nominal.name,
                MATERIAL_FACTORS.describe()
            );
            return Err(ScriptError::new(object.placed_at.as_str(), message));
        }
    }
    Ok(())
}

/// Checks that an object that was scaled fits between the fingers. `largest` is the largest factor that the variation
/// can draw: a suite of which one episode in ten cannot be solved is not valid.
fn check_width(
    scene: &Scene,
    name: &str,
    variation: Option<&SceneVariation>,
    largest: f64,
) -> Result<(), ScriptError> {
    let Some(object) = scene.objects.iter().find(|object| object.name == name) else { return Ok(()) };
    let drawn = variation.and_then(|variation| variation.objects.get(name)).map_or(1.0, |drawn| drawn.scale);
    let scale = if drawn == 1.0 { object.scale } else { object.scale / drawn * largest };
    if scale == 1.0 {
        return Ok(());
    }
    let width = object.nominal.grasp_width() * scale;
    if width < MAX_WIDTH {
        return Ok(());
    }
    let (width, most, scale) = (1e3 * width, 1e3 * MAX_WIDTH, format_number((1e6 * scale).round() / 1e6));
    let message = format!(
        "object {name:?} is {width:.1} mm wide where fingers grasp it, at a scale of {scale}, and the gripper opens {most:.0} mm"
    );
    Err(ScriptError::new(object.placed_at.as_str(), message))
}

/// Checks that the workspace is a box, and that the arm reaches it.
fn check_workspace(scene: &Scene) -> Result<(), String> {
    let Aabb { min, max } = scene.workspace;
    if let Some(axis) = (0..3).find(|&i| min[i] >= max[i]) {
        return Err(format!(
            "scene.workspace_min is not below scene.workspace_max along {}, {} and {}",
            AXIS_NAMES[axis], min[axis], max[axis]
        ));
    }
    let base = scene.base_w.translation.vector;
    let distance = scene.workspace.distance(&Aabb { min: base, max: base });
    if distance <= panda::REACH {
        return Ok(());
    }
    let (distance, reach) = (format_number((1e3 * distance).round() / 1e3), panda::REACH);
    Err(format!(
        "scene.base is {distance} m from the workspace, and the arm reaches {reach} m; move one of them"
    ))
}

/// Message about a shift that a suite does not declare.
fn unknown_shift<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match known.clone().next() {
        None => format!("unknown shift {name:?}; the suite declares none"),
        Some(_) => unknown_name("shift", name, known),
    }
}

/// Checks the value of a shift against those that a suite declares. The error is a fragment.
///
/// # Errors
/// If the shift is unknown or the value is out of its range; the message is a fragment.
pub fn check_shift(shifts: &[Shift], name: &str, value: f64) -> Result<(), String> {
    let Some(shift) = shifts.iter().find(|shift| shift.name == name) else {
        return Err(unknown_shift(name, shifts.iter().map(|shift| shift.name.as_str())));
    };
    let checked = Range::between(shift.min, shift.max).check(name, value, &shift.unit);
    checked.map_err(|error| format!("shift {error}"))
}

/// Checks that a scene has the objects and joints that a task names, and that its goal can hold with the ranges of
/// these joints. `nominal` is the scene without the shifts.
fn check_names(
    lua: &Lua,
    task: &Constructed<TaskSpec>,
    predicates: &[DeclaredPredicate],
    scene: &Scene,
    nominal: &Scene,
) -> mlua::Result<()> {
    for predicate in predicates {
        let DeclaredPredicate { goal, table, .. } = predicate;
        let named = [
            ("object", goal.object().map(|name| movable_object(scene, name))),
            ("target", goal.target().map(|name| scene_names::touchable(scene, name))),
            ("joint", goal.joint().map(|name| scene_names::joint(scene, name).map(drop))),
        ];
        for (field, found) in named {
            let Some(Err(what)) = found else { continue };
            let key = predicate.field(field);
            return Err(fail_at_key(lua, table, key, format_args!("task.goal.{key}: {what}")));
        }
    }
    if let Some(Err(what)) = task.object.as_ref().map(|name| movable_object(scene, name)) {
        return Err(task.invalid(lua, "object", what));
    }
    let limits = |name: &str| scene_names::joint(scene, name).ok().map(|joint| [joint.lower, joint.upper]);
    if let Some(conflict) = conflict(&task.goal.plain(lua)?.0.with_joint_ranges(&limits)) {
        return Err(task.invalid(lua, "goal", format_args!("can never be met: {conflict}")));
    }
    task.expert.as_ref().map_or(Ok(()), |expert| check_expert(lua, expert, nominal))
}
