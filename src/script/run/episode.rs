//! Episodes: the scene that a task's layout builds, and the task's expert.

use std::{collections::BTreeMap, sync::Arc};

use mlua::{FromLua, Function, Lua, Value};

use super::{
    expert::{ExpertController, ExpertGrip},
    predicate::{ScriptMetric, ScriptPredicate},
};
use crate::{
    api::{
        envelope::draw,
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
    range::RangeError,
    text::{AXIS_NAMES, format_number, unknown_name},
};
use softvt_geometry::{Aabb, Vec3};
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
    /// True if soft objects become rigid.
    pub rigid_twin: bool,
    /// Size of all camera images.
    pub cameras: CameraSettings,
}

/// An episode as its script describes it: the scene that the layout builds, and the expert of the task.
pub struct EpisodeSetup {
    /// Initial scene.
    pub scene: Scene,
    /// The same without the shifts; deformation limits are those of its objects.
    pub nominal: Scene,
    /// Changes of the layout's scene by the variation of the suite, if it varies.
    pub variation: Option<SceneVariation>,
    /// Instruction to the policy, which a shift may have changed.
    pub prompt: String,
    /// The same without the shifts.
    pub nominal_prompt: String,
    /// Functions that the goal asks for, in its order.
    pub predicates: Vec<Arc<dyn StatePredicate>>,
    /// Metrics of the suite.
    pub metrics: Vec<MeasuredMetric>,
    /// Source of its random streams.
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
    /// The suites of the plan, by name.
    suites: BTreeMap<String, Suite>,
    secret: Option<SecretSeed>,
}

impl SceneBuilder {
    /// Runs the sources of `loaded` in a new virtual machine.
    ///
    /// # Errors
    /// If the script fails.
    pub fn open(loaded: &LoadedScript) -> Result<Self, ScriptError> {
        let suites = loaded.plan.suites().iter().map(|suite| (suite.name.clone(), suite.clone()));
        let instance = Arc::new(loaded.sources.instance()?);
        Ok(Self { instance, suites: suites.collect(), secret: loaded.secret.clone() })
    }

    /// Builds the initial scene of an episode.
    ///
    /// # Errors
    /// As [`EpisodeSetup::open`].
    pub fn build(&self, id: &EpisodeId, changes: &SceneChanges) -> Result<EpisodeSetup, ScriptError> {
        let vm = &self.instance.vm;
        let FoundTask { suite, task } = self.instance.find_task(&id.suite, id.task)?;
        self.check_suite(&suite).map_err(|e| vm.explain(&e))?;
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
        let variation = varied.transpose().map_err(|error| vm.explain(&error))?;
        let mut nominal = lock(&current.scene).clone();
        let object = task.object_name(&vm.lua).map_err(|e| vm.explain(&e))?;
        let (_, predicates) = task.goal.plain(&vm.lua).map_err(|e| vm.explain(&e))?;
        let nominal_prompt = self.episode_prompt(&suite, &task, &current, &seed)?;
        current = current.for_task(&object, &nominal_prompt);
        let shifts = suite.shifts.as_slice();
        for ShiftValue { name, value } in &changes.shifts {
            let Some(shift) = shifts.iter().find(|shift| shift.name == *name) else {
                let names = shifts.iter().map(|shift| shift.name.as_str());
                return Err(ScriptError::new(vm.main(), unknown_shift(name, names)));
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
        check_names(&vm.lua, &task, &predicates, &scene, &nominal).map_err(|e| vm.explain(&e))?;
        check_workspace(&scene)
            .map_err(|what| vm.explain(&fail_at_key(&vm.lua, &task.layout.table, "build", what)))?;
        let largest = ranges.map_or(1.0, |ranges| ranges.size.max);
        check_width(&scene, &object, variation.as_ref(), largest)?;
        let (instance, expert) = (self.instance.clone(), task.expert.clone());
        let ranges = ranges.cloned();
        let instances = SuiteInstances::new(&vm.lua, &suite, ranges).map_err(|e| vm.explain(&e))?;
        let instances = Arc::new(instances);
        let predicate = |DeclaredPredicate { goal, function, .. }: DeclaredPredicate| {
            let predicate =
                ScriptPredicate { instance: instance.clone(), name: goal.describe(), function: function? };
            Some(Arc::new(predicate) as Arc<dyn StatePredicate>)
        };
        let predicates = predicates.into_iter().filter_map(predicate).collect();
        let metrics = suite.metrics.iter().map(|spec| MeasuredMetric {
            metric: spec.plain(),
            function: Arc::new(ScriptMetric {
                instance: instance.clone(),
                name: spec.name.clone(),
                function: spec.of.clone(),
            }),
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
        let message = format!(
            "suite {:?} differs from that of the plan, which the same file gave before; return the same suite each time that \
             the file runs",
            spec.name
        );
        Err(fail_at_key(lua, &spec.table, "tasks", message))
    }

    /// The prompt of an episode of this initial scene: that of the task, or what its function returns.
    fn episode_prompt(
        &self,
        suite: &SuiteSpec,
        task: &Constructed<TaskSpec>,
        current: &LuaScene,
        seed: &EpisodeSeed,
    ) -> Result<String, ScriptError> {
        let Some(function) = &task.episode_prompt else { return Ok(task.prompt.clone()) };
        let vm = &self.instance.vm;
        let wrong = |what: String| {
            vm.explain(&fail_at_key(
                &vm.lua,
                &task.table,
                "episode_prompt",
                format!("task.episode_prompt: {what}"),
            ))
        };
        let scene = lock(&current.scene).clone();
        let given = LuaScene::new(scene.clone());
        let rng = LuaRng::new(seed.clone(), RandomStream::Prompt);
        // What shifts draw must not depend on whether a prompt was drawn.
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
        let prompt = String::from_lua(checked, &vm.lua).map_err(|error| vm.explain(&error))?;
        // Spaces of clients list the characters of prompts.
        let is_known =
            |c: char| (' '..='~').contains(&c) || suite.tasks.iter().any(|task| task.prompt.contains(c));
        match prompt.chars().find(|c| !is_known(*c)) {
            _ if prompt.trim().is_empty() => Err(wrong("returned a blank text".to_owned())),
            Some(c) => Err(wrong(format!(
                "returned {prompt:?}, whose {c:?} is no printable character of ASCII, and in no prompt of the suite"
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
    ) -> Result<LuaScene, ScriptError> {
        let vm = &self.instance.vm;
        let wrong = |expected: &str| {
            vm.explain(&fail(&vm.lua, format!("shift.apply: expected {expected} to be returned")))
        };
        match &vm
            .call::<Value>(apply, (scene.clone(), value, LuaRng::new(seed.clone(), RandomStream::Script)))?
        {
            Value::Nil => Ok(scene),
            Value::UserData(data) => match data.borrow::<LuaScene>() {
                Ok(other) => Ok(other.clone()),
                Err(_) => Err(wrong("the scene")),
            },
            _ => Err(wrong("the scene or nothing")),
        }
    }
}

/// Draws and applies the variation of an episode.
///
/// # Errors
/// The scene has nothing that the variation changes, or no instance can be drawn.
fn vary(
    lua: &Lua,
    scene: &mut Scene,
    ranges: &VariationRanges,
    seed: &EpisodeSeed,
) -> mlua::Result<SceneVariation> {
    let drawn = draw(lua, |presses_of| ranges.draw(seed, scene, presses_of))?;
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
    drawn.apply(scene).map_err(|error| fail(lua, format!("{subject}: {error}")))?;
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
    let message = format!(
        "object {name:?} is {:.1} mm wide where fingers grasp it, at {} times the size of {}, and the gripper opens {:.0} mm; \
         give a smaller scale",
        1e3 * width,
        format_number((1e6 * scale).round() / 1e6),
        object.nominal.name,
        1e3 * MAX_WIDTH
    );
    Err(ScriptError::new(object.placed_at.as_str(), message))
}

/// Checks that the workspace is a box, and that the arm reaches it.
///
/// # Errors
/// What is wrong with it.
fn check_workspace(scene: &Scene) -> Result<(), String> {
    let Aabb { min, max } = scene.workspace;
    let corner = |p: &Vec3| {
        let [x, y, z] = [p.x, p.y, p.z].map(format_number);
        format!("{{ {x}, {y}, {z} }}")
    };
    if let Some(axis) = (0..3).find(|&i| min[i] >= max[i]) {
        return Err(format!(
            "scene.workspace_min {} is not below scene.workspace_max {} along {}",
            corner(&min),
            corner(&max),
            AXIS_NAMES[axis]
        ));
    }
    let base = scene.base_w.translation.vector;
    let distance = scene.workspace.distance(&Aabb { min: base, max: base });
    if distance <= panda::REACH {
        return Ok(());
    }
    Err(format!(
        "scene.base {} is {} m from the workspace, and the arm reaches {} m; move the base, or \
         scene.workspace_min and scene.workspace_max",
        corner(&base),
        format_number((1e3 * distance).round() / 1e3),
        format_number(panda::REACH)
    ))
}

/// Message about a shift that a suite does not declare.
fn unknown_shift<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match known.clone().next() {
        None => format!("unknown shift {name:?}; the suite declares none"),
        Some(_) => unknown_name("shift", name, known),
    }
}

/// The value of a shift is invalid.
#[allow(missing_docs)] // The messages say what the fields are.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShiftError {
    /// The suite declares no shift of this name.
    #[error("{}", unknown_shift(name, known.iter().map(String::as_str)))]
    Unknown { name: String, known: Vec<String> },
    /// The value is out of the declared range.
    #[error("shift {0}")]
    Value(#[from] RangeError),
}

/// Checks the value of a shift against those that a suite declares.
///
/// # Errors
/// If the shift is unknown or the value is out of its range; the message is a fragment.
pub fn check_shift(shifts: &[Shift], name: &str, value: f64) -> Result<(), ShiftError> {
    let Some(shift) = shifts.iter().find(|shift| shift.name == name) else {
        let known = shifts.iter().map(|shift| shift.name.clone()).collect();
        return Err(ShiftError::Unknown { name: name.to_owned(), known });
    };
    Ok(Range::between(shift.min, shift.max).check(name, value, &shift.unit)?)
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
            return Err(fail_at_key(lua, table, key, format!("task.goal.{key}: {what}")));
        }
    }
    if let Some(Err(what)) = task.object.as_ref().map(|name| movable_object(scene, name)) {
        return Err(fail_at_key(lua, &task.table, "object", format!("task.object: {what}")));
    }
    let limits = |name: &str| scene_names::joint(scene, name).ok().map(|joint| [joint.lower, joint.upper]);
    if let Some(conflict) = conflict(&task.goal.plain(lua)?.0.with_joint_ranges(&limits)) {
        let message = format!("task.goal: can never be met: {conflict}");
        return Err(fail_at_key(lua, &task.table, "goal", message));
    }
    task.expert.as_ref().map_or(Ok(()), |expert| check_expert(lua, expert, nominal))
}
