//! Simulations: a settled scene with the robot, for calibrations and other experiments.

use std::sync::{Arc, Mutex};

use mlua::{Function, Lua, Table, Value};
use serde_json::Value as Json;

use super::{
    cameras::IMAGE_EDGE,
    experiment_input,
    expert::{Coroutine, FingerAccess},
    expert_input::{ExpertCommand, TrackingErrorMonitor, expert_view},
    image::LuaImage,
    index_of,
    observation::{FingerReadings, LuaMarkers, positions},
    random::LuaRng,
    scene::{LuaScene, empty_scene},
    tasks::{EXPERT, LayoutSpec, SETTINGS},
};
use crate::{
    schema::{Constructed, Range, Type, choice, class, functions, output},
    vm::{
        error::{SourceLine, app_data, current_line, fail_at},
        json::to_json,
        memory_budget::{Reservation, reserve_in_world},
        value::finite,
        watchdog::Clock,
    },
};
use softvt_benchmark::{
    seed::{EpisodeSeed, RandomStream},
    settings::{MODEL, Settings},
    steps_per_control,
};
use softvt_common::cancel;
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};
use softvt_common::parallel::lock;
use softvt_evaluation::deformation::{Deformation, ReferenceShape};
use softvt_geometry::{Pose, Vec3};
use softvt_physics::BodyId;
use softvt_robot::{Side, gripper::GripTarget, rotation};
use softvt_rollout::{ArmCommand, AssetCache, SensingError, SensorSeed, Sensors, Simulation};
use softvt_sensing::tactile::{MarkerStyle, PadWrench, TactileReading};

const EPISODE: Type = Type::Integer(Range::closed(0.0, 1e9));

/// Approximate memory of a simulation without its soft bodies: the robot, its sensors, fixed objects.
const BYTES_PER_SIMULATION: usize = 4 << 20;

choice! { Side { "left" => Left, "right" => Right } }

/// Reads a table of settings; `label` names it in messages, and `place` is its line.
pub(crate) fn settings(
    lua: &Lua,
    label: &str,
    table: Option<&Table>,
    place: Option<SourceLine>,
) -> mlua::Result<Settings> {
    let Some(table) = table else { return Ok(Settings::default()) };
    let data = to_json(lua, &Value::Table(table.clone()), label)?;
    Settings::default()
        .with_all(&leaves("", &data))
        .map_err(|error| fail_at(lua, place, format_args!("{label}: {error}")))
}

/// The single values and the models of settings, with their dotted paths.
fn leaves(path: &str, data: &Json) -> Vec<(String, String)> {
    match data {
        Json::Object(group) if !group.is_empty() && !group.contains_key(MODEL) => {
            let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
            group.iter().flat_map(|(key, value)| leaves(&below(key), value)).collect()
        }
        Json::Object(group) if group.is_empty() && path.is_empty() => Vec::new(),
        other => vec![(path.to_owned(), other.to_string())],
    }
}

/// The settings of a simulation: those of the script, then those of the run.
fn simulation_settings(lua: &Lua, table: Option<&Table>) -> mlua::Result<Settings> {
    const LABEL: &str = "softvt.simulate: settings";
    if table.is_some_and(|table| table.contains_key("criteria").unwrap_or(false)) {
        bail!(lua, "{LABEL}.criteria: a simulation judges no episodes; leave it out");
    }
    let own = settings(lua, LABEL, table, current_line(lua))?;
    experiment_input::simulation_settings(lua, &own)
        .map_err(|e| fail!(lua, "{LABEL}, with those of the run: {e}"))
}

struct ObjectMeasurements {
    settled: Option<ReferenceShape>,
    d_peak_pct: f64,
    d_peak_v1_pct: f64,
    start_z: f64,
}

/// A simulation with the measurements of its objects.
pub(crate) struct SimulationState {
    sim: Simulation,
    records: Vec<ObjectMeasurements>,
    physics_steps: u64,
    failed: Option<String>,
    clock: Clock,
    sensors: Sensors,
    _reserved: Reservation,
}

impl LuaSimulation {
    /// Builds the scene of a layout and lets it settle.
    fn new(lua: &Lua, layout: &LayoutSpec, seed: EpisodeSeed, settings: &Settings) -> mlua::Result<Self> {
        let scene = LuaScene::new(empty_scene());
        let sensor_seed = SensorSeed::new(&seed);
        layout.build.call::<()>((scene.clone(), LuaRng::new(seed, RandomStream::Layout)))?;
        let mut scene = lock(&scene.scene).clone();
        settings.cameras.apply(&mut scene.cameras);
        let scene = Arc::new(scene);
        let clock = app_data::<Clock>(lua)?;
        let _pause = clock.pause();
        let assets = app_data::<AssetCache>(lua)?;
        let mut sim =
            Simulation::new(scene, settings, &assets).map_err(|e| fail!(lua, "softvt.simulate: {e}"))?;
        let soft_bytes: usize = sim.world.soft_bodies().iter().map(|soft| soft.state.model.bytes()).sum();
        let reserved = reserve_in_world(lua, BYTES_PER_SIMULATION + soft_bytes)?;
        sim.settle().map_err(|e| {
            let place = e.place().map_or(String::new(), |place| format!("{place}: "));
            fail!(lua, "softvt.simulate: {place}{e}")
        })?;
        let records = sim.objects.iter().map(|object| ObjectMeasurements {
            settled: sim.present_shape(object),
            d_peak_pct: 0.0,
            d_peak_v1_pct: 0.0,
            start_z: sim.centre(object).z,
        });
        Ok(Self(Arc::new(Mutex::new(SimulationState {
            records: records.collect(),
            physics_steps: 0,
            failed: None,
            clock: clock.clone(),
            sensors: Sensors::new(&sim, &settings.tactile, &assets).with_seed(sensor_seed),
            sim,
            _reserved: reserved,
        }))))
    }
}

functions! {
    FUNCTIONS {
        /// Builds a scene with the robot and lets it settle. Deformation refers to the settled shapes.
        fn simulate(lua) takes spec "softvt.SimulateSpec" {
            /// Layout of the initial scene.
            layout: Constructed<LayoutSpec>;
            /// Part of the seed.
            suite: String => Text("experiment");
            /// Part of the seed.
            episode: u32 = EPISODE => Integer(0);
            /// Part of the seed; by default that of the run, --seed.
            seed: Option<u64> = EPISODE;
            /// Changed settings of physics, robot, tactile sensors and cameras (docs/settings.md): { physics = {…},
            /// robot = {…} }. Those of the command line, --set, take precedence in experiments.
            settings: Option<Table> = SETTINGS;
        } -> ["softvt.Simulation"] {
            let settings = simulation_settings(lua, settings.as_ref())?;
            let seed = seed.unwrap_or_else(|| experiment_input::base_seed(lua));
            let id = EpisodeId { suite, task: 0, episode, base_seed: seed, split: EpisodeSplit::Experiment };
            LuaSimulation::new(lua, &layout, EpisodeSeed::new(&id, &layout.name), &settings)?
        }
    }
}

impl SimulationState {
    fn time(&self) -> f64 {
        self.physics_steps as f64 * self.sim.world.params.dt
    }

    /// Makes one control step; returns false once the physics has failed.
    fn control_step(&mut self, command: Option<&ExpertCommand>) -> bool {
        if cancel::requested() {
            self.failed = Some("interrupted".into());
        }
        if let Some(ExpertCommand { pose_b, closure, .. }) = command {
            let arm = ArmCommand::pose(*pose_b);
            self.sim.robot.command(&mut self.sim.world, arm, GripTarget::Closure(*closure));
        }
        let _pause = self.clock.pause();
        for _ in 0..steps_per_control(self.sim.world.params.dt) {
            if self.failed.is_some() {
                return false;
            }
            self.physics_steps += 1;
            if let Err(failure) = self.sim.step() {
                self.failed = Some(failure.to_string());
                return false;
            }
            for index in 0..self.records.len() {
                if let Some(d) = self.deformation(index) {
                    let record = &mut self.records[index];
                    record.d_peak_pct = record.d_peak_pct.max(d.rms_pct);
                    record.d_peak_v1_pct = record.d_peak_v1_pct.max(d.v1_rms_pct);
                }
            }
        }
        true
    }

    fn deformation(&self, object: usize) -> Option<Deformation> {
        let BodyId::Soft(id) = self.sim.objects[object].body else { return None };
        let settled = self.records[object].settled.as_ref()?;
        settled.measure(&self.sim.world.soft(id).state.x).ok()
    }

    fn finger_readings(&mut self, lua: &Lua) -> mlua::Result<FingerReadings> {
        let frame = Sensors::frame(&self.sim);
        let readings = self.sensors.tactile_frames(&frame);
        readings.map(Arc::new).map_err(|e| fail!(lua, "arm:tactile: {e}"))
    }

    /// True, or false and the reason of a failure.
    fn outcome(&self) -> (bool, Option<String>) {
        (self.failed.is_none(), self.failed.clone())
    }
}

#[derive(Clone)]
pub(crate) struct LuaSimulation(Arc<Mutex<SimulationState>>);

impl LuaSimulation {
    fn drive(&self, lua: &Lua, expert: Function) -> mlua::Result<(bool, Option<String>)> {
        let mut expert = Coroutine::new(expert, FingerAccess::Readings);
        let mut monitor = TrackingErrorMonitor::default();
        loop {
            // The expert may call the simulation itself, so it must not be locked while the expert runs.
            let (view, complaint) = {
                let mut inner = lock(&self.0);
                let clock = inner.clock.clone();
                let _pause = clock.pause();
                let readings = expert.wants_readings.then(|| inner.finger_readings(lua)).transpose()?;
                expert.set_readings(readings);
                (expert_view(&inner.sim, inner.time()), monitor.complaint(&inner.sim))
            };
            let command = expert.next_command(lua, &view, complaint, &mut monitor)?;
            if !command.is_some_and(|command| lock(&self.0).control_step(Some(&command))) {
                break;
            }
        }
        match &expert.gave_up {
            Some(reason) => Ok((false, Some(format!("the expert gave up: {reason}")))),
            None => Ok(lock(&self.0).outcome()),
        }
    }

    fn render(
        &self,
        lua: &Lua,
        camera: &str,
        width: Option<usize>,
        height: Option<usize>,
    ) -> mlua::Result<LuaImage> {
        let wrong = |e: SensingError| fail!(lua, "simulation:render: {e}");
        let mut inner = lock(&self.0);
        let SimulationState { sim, sensors, clock, physics_steps, .. } = &mut *inner;
        let _pause = clock.pause();
        let mut camera = sensors.camera(camera).map_err(wrong)?.clone();
        camera.width = width.unwrap_or(camera.width);
        camera.height = height.unwrap_or(camera.height);
        let frame = Sensors::frame(sim);
        // A camera inside of an object is a mistake of the layout, unless something has moved since.
        let image = match *physics_steps {
            0 => sensors.render_unobstructed(&frame, &camera),
            _ => sensors.render(&frame, &camera),
        };
        LuaImage::new(lua, image.map_err(wrong)?.into_rgb_image())
    }

    fn tactile(&self, lua: &Lua, side: Side) -> mlua::Result<Table> {
        let mut inner = lock(&self.0);
        let SimulationState { sim, sensors, clock, .. } = &mut *inner;
        let _pause = clock.pause();
        let frame = Sensors::frame(sim);
        let reading =
            sensors.tactile_reading(&frame, side).map_err(|e| fail!(lua, "simulation:tactile: {e}"))?;
        let wrench = frame.patches.get(side as usize).map_or(PadWrench::default(), PadWrench::from_patch);
        tactile_table(lua, reading, wrench.force)
    }

    fn measure(&self, lua: &Lua, name: &str) -> mlua::Result<Table> {
        let inner = lock(&self.0);
        let _pause = inner.clock.pause();
        let names = inner.sim.objects.iter().map(|object| object.name.as_str());
        let index = index_of(lua, "simulation:measure", "object", names, name)?;
        measurements(lua, &inner, index)
    }
}

output! {
    /// The tactile sensor of a finger, with the true force on its gel; docs/tactile.md draws its frames.
    fn tactile_table(lua, reading: TactileReading, force: Vec3) -> "softvt.TactileReading" as "reading" {
        /// Colour image, 320 × 240.
        image: "softvt.Image" = LuaImage::new(lua, reading.image.clone())?;
        /// The image with its markers as dots.
        dots: "softvt.Image" = LuaImage::new(lua, reading.with_markers(MarkerStyle::Dots))?;
        /// The image with the displacements of its markers as lengthened arrows.
        arrows: "softvt.Image" = LuaImage::new(lua, reading.with_markers(MarkerStyle::Arrows))?;
        /// Positions of the 99 markers on the untouched gel, px, row by row.
        initial: "number[][]" = positions(lua, &reading.markers.initial)?;
        /// Their present positions, px.
        present: "number[][]" = positions(lua, &reading.markers.current)?;
        /// The markers with the measures of their displacements.
        markers: "softvt.Markers" = LuaMarkers::new(reading.markers);
        /// True force on the gel, N, pad frame: the vector sum over its contact points, friction included. A pressing
        /// body makes z negative.
        force: "number[]" = lua.create_sequence_from(force.iter().copied())?;
        /// Largest depth of the indentation, mm.
        depth_mm: "number" = reading.field.as_ref().map_or(0.0, |field| 1e3 * field.depth());
    }
    /// Measurements of an object. Fields that do not apply to it are nil.
    fn measurements(lua, inner: &SimulationState, index: usize) -> "softvt.Measurements" as "measurements" {
        /// Measured distance of the gels, m.
        width_m: "number?" = finite(inner.sim.robot.width(&inner.sim.world));
        /// Rise of the object's centre since settling, m.
        height_m: "number?" = finite(inner.sim.centre(inner.object(index)).z - inner.records[index].start_z);
        /// Speed; of a soft body that of its fastest node, m/s.
        speed: "number?" = finite(inner.sim.speed(inner.object(index)));
        /// Name of its asset.
        asset: "string" = inner.object(index).asset.name.as_str();
        /// Fingerprint of its asset.
        fingerprint: "string" = inner.object(index).asset.fingerprint();
        /// Joint value of a part, m or rad.
        joint: "number?" = inner.sim.joint(inner.object(index));
        /// Joint values of an articulated object by part, m or rad.
        joints: "table<string, number>" = lua.create_table_from(
            inner.sim.parts(index).map(|(instance, part)| (part.name.as_str(), inner.sim.joint(instance)))
        )?;
        /// Sum of the normal forces at the contact points of the left and the right gel pad on the object, N; see
        /// arm.force.
        pad_force: "number[]" = inner.sim.pad_normal_forces_on(inner.object(index)).to_vec();
        /// Distance that a movable object has slid on the left and the right pad, mm.
        slip_mm: "number[]?" = inner.pad_contacts(index).map(|pads| pads.map(|pad| 1e3 * pad.slip_distance).to_vec());
        /// Deformation D of a soft body, %.
        d_pct: "number?" = inner.deformation(index).map(|d| d.rms_pct);
        /// Largest D since settling, %.
        d_peak_pct: "number?" = inner.soft_body(index).map(|_| inner.records[index].d_peak_pct);
        /// The same by SoftVTBench's definition of D, %.
        d_peak_v1_pct: "number?" = inner.soft_body(index).map(|_| inner.records[index].d_peak_v1_pct);
        /// Minimum det F of a filled element of a soft body.
        min_det_f: "number?" = inner.soft_body(index).and_then(|body| finite(body.state.min_det_f().det_f));
        /// True if a soft body sleeps.
        asleep: "boolean?" = inner.soft_body(index).map(|body| body.is_asleep());
    }
}

impl SimulationState {
    fn object(&self, index: usize) -> &softvt_rollout::ObjectInstance {
        &self.sim.objects[index]
    }

    fn soft_body(&self, index: usize) -> Option<&softvt_physics::world::SoftBody> {
        match self.object(index).body {
            BodyId::Soft(id) => Some(self.sim.world.soft(id)),
            _ => None,
        }
    }

    /// Contacts of the left and the right pad with a movable object.
    fn pad_contacts(&self, index: usize) -> Option<[softvt_physics::world::ContactSummary; 2]> {
        let object = self.object(index);
        object.body.is_free().then(|| self.sim.pad_contacts(object))
    }

    fn tool_pose(&self) -> Pose {
        self.sim.robot.base_w * self.sim.robot.tool_b(&self.sim.world)
    }
}

class! {
    /// A settled scene with the robot.
    LuaSimulation: "softvt.Simulation" {
        label(_) { "simulation".to_owned() }
        methods {
            /// Runs an expert to its end. Returns false and the reason if it gave up, as for a pose out of reach,
            /// or the physics failed.
            fn drive(lua, this, expert: Function = EXPERT) -> ["boolean", "string?"] { this.drive(lua, expert)? }
            /// Holds the last command for a time. Returns false and the reason if the physics failed.
            fn wait(_, this, seconds: f64 = Type::Number("s", Range::closed(0.0, 600.0))) -> ["boolean", "string?"] {
                let mut inner = lock(&this.0);
                let until = inner.time() + seconds - 1e-9;
                while inner.time() < until && inner.control_step(None) {}
                inner.outcome()
            }
            /// Returns measurements of an object.
            fn measure(lua, this, object: String) -> ["softvt.Measurements"] { this.measure(lua, &object)? }
            /// Renders the image of a camera, by default third_person.
            fn render(lua, this) takes spec "softvt.Render" {
                /// A camera of the scene.
                camera: String = Type::Name => Text("third_person");
                /// Width, pixels; the camera's by default.
                width: Option<usize> = IMAGE_EDGE;
                /// Height, pixels; the camera's by default.
                height: Option<usize> = IMAGE_EDGE;
            } -> ["softvt.Image"] { this.render(lua, &camera, width, height)? }
            /// Returns the reading of a finger's tactile sensor, with the true force on its gel.
            fn tactile(lua, this, side: Side) -> ["softvt.TactileReading"] { this.tactile(lua, side)? }
            /// Returns the time since settling, s.
            fn time(_, this) -> ["number"] { lock(&this.0).time() }
            /// Returns the pose of the tool centre point in the world frame: position, m, and orientation as
            /// axis-angle, rad.
            fn tool(lua, this) -> ["number[]", "number[]"] {
                let tool = lock(&this.0).tool_pose();
                let list = |vector: Vec3| lua.create_sequence_from(vector.iter().copied());
                (list(tool.translation.vector)?, list(rotation::axis_angle(&tool.rotation))?)
            }
        }
    }
}
