//! Policies and profiles: the tables that their files return.

use mlua::{Function, Lua, Value};

use crate::schema::{LuaType, Range, Record, RecordType, Type, choice, record, record_of};
use softvt_policy::{
    GripHysteresis, RobotStream, SensorStreams, StatePart,
    decode::MAX_CHUNK_LEN,
    profile::{GripCode, MAX_FRAMES},
};
use softvt_robot::Side;
use softvt_sensing::tactile::{MarkerStyle, TactileMosaicLayout};

const STEP: Type = Type::Number("", Range { max: 10.0, ..Range::POSITIVE });

record! {
    /// A policy, as the file given to --policy returns it. Every episode has a virtual machine of its own, in which the
    /// file runs again; math.random is seeded by the episode.
    PolicySpec: "softvt.Policy" as "policy", constructor "softvt.policy" {
        /// Name in results, unless --name gives another.
        name: String = Type::Name;
        /// Observations of the policy.
        observes: ObservesSpec;
        /// Called when the episode begins.
        reset: Option<Function> = Type::Function("fun(task: softvt.EpisodeBrief)");
        /// Returns the action of this control step, or a list of actions for the next ones.
        act: Function = Type::Function("fun(obs: softvt.Observation): softvt.Action|softvt.Action[]");
        /// Number of actions of a list that are executed before act is called again, unless --replan gives
        /// another; all by default.
        replan: Option<usize> = Type::Integer(Range::closed(1.0, MAX_CHUNK_LEN as f64));
        /// Grip code, which says what the closure of an action commands, unless --gripper gives another: a closure
        /// (continuous); open, or above 0.5 closed with the whole effort (binary); open, or the width given just
        /// after closing (two-width). For force, actions have force. By default an action has closure, which is
        /// continuous, or force.
        gripper: Option<GripCode>;
        /// True to let the policy use limits and materials of objects: softvt.calibration, assets, and the modules
        /// strain_sources and experts. Its results say that it is privileged.
        privileged: bool => Boolean(false);
    }
    /// A command for one control step (0.05 s): a pose of the tool centre point in the robot's base frame, or positions
    /// of the arm's joints, and a closure or a grip force. Give either joints, or position with axis_angle or
    /// quaternion; and either closure or force.
    ActionSpec: "softvt.Action" as "action" {
        /// Position of the tool.
        position: Option<[f64; 3]> = Type::vector(3, "m, base frame");
        /// Orientation as axis-angle.
        axis_angle: Option<[f64; 3]> = Type::vector(3, "rad, base frame");
        /// Orientation of the tool, as quaternion.
        quaternion: Option<[f64; 4]> = Type::Quaternion("base frame");
        /// Positions of the arm's joints, from the base on.
        joints: Option<[f64; 7]> = Type::vector(7, "rad");
        /// Gripper closure: 0 is open, 1 is closed. The grip code of the policy says what it commands.
        closure: Option<f64> = Type::Number("", Range::closed(0.0, 1.0));
        /// Grip force at which closing stops, at most robot.gripper.effort; below 0 opens.
        force: Option<f64> = Type::Number("N", Range::ANY);
    }
    /// One entry of the observations that are sent to a policy server.
    InputSpec: "softvt.Input" as "profile.inputs" {
        /// Keys under which it is sent.
        keys: Vec<String> = Type::Distinct { of: &Type::Text, by: "", min: 1 };
        /// Content: the image of a camera, its depth (m), or the object at each pixel; numbers of the robot's state;
        /// the prompt; the mosaic of 8 tactile images of both fingers; the image of one finger; the initial and the
        /// last marker positions; the last true forces on the gels; the identity of the request, a map; a seed for
        /// policies that draw random numbers, equal whenever a run is repeated.
        source: InputKind;
        /// For camera, depth and segmentation: the camera's name in the scene.
        camera: Option<String> = Type::Name;
        /// For camera, depth and segmentation: true to rotate the image by 180°.
        half_turn: Option<bool>;
        /// For state: its parts in order, in m, rad, rad/s and N m, of 3 numbers (position, axis_angle), 4
        /// (quaternions), 7 (joints, joint_velocities, joint_torques), 2 (finger_pair) and 1. The sensed width
        /// has the steps and the offset of a real hand; the gap between the exact one and the commanded closure
        /// is the grip force.
        parts: Option<Vec<StatePart>> = Type::Distinct { of: &<StatePart as LuaType>::TYPE, by: "", min: 1 };
        /// Number of control steps in the entry, the present one last, along a first axis; not for prompt and
        /// tactile_image. By default the present step without that axis, and 8 steps of marker_motion and force. The
        /// start of an episode repeats its first step.
        frames: Option<usize> = Type::Integer(Range::closed(1.0, MAX_FRAMES as f64));
        /// For tactile and tactile_image: style in which the markers are drawn into the images; not drawn by default.
        markers: Option<MarkerStyle>;
        /// For tactile_image: the left finger above the right one (rows, the default) or left of it.
        layout: Option<TactileMosaicLayout>;
        /// For tactile: the finger.
        finger: Option<Side>;
    }
    /// The meaning of the numbers of an action: three of position, three of orientation (axis-angle), or seven joint
    /// positions, and one of the gripper; further ones are padding.
    ActionEncodingSpec: "softvt.ActionEncoding" as "profile.actions" {
        /// absolute: a pose in the base frame. delta: shares -1 to 1 of a step away from the tool's pose. delta_osc:
        /// the same, reduced to what robosuite's controller reaches within a control step. joints: positions of the
        /// seven joints of the arm, rad.
        pose: PoseKind;
        /// For delta and delta_osc: the step of a share of 1, m.
        translation_m: Option<f64> = STEP;
        /// For delta and delta_osc: the rotation of a share of 1, rad.
        rotation_rad: Option<f64> = STEP;
        /// Factors on the numbers before that of the gripper, six or seven, applied first.
        scale: Option<Vec<f64>> = Type::List(&Type::Number("", Range::ANY));
        /// Offsets added after that.
        offset: Option<Vec<f64>> = Type::List(&Type::Number("", Range::ANY));
        /// Length that an action must have, padding included; by default 7, or 8 for joints, or 32 as
        /// openpi's models pad them.
        length: Option<usize> = Type::Integer(Range::closed(7.0, 4096.0));
        /// The number of the gripper.
        gripper: GripperValuesSpec;
    }
    /// The number of the gripper, the last of an action without padding.
    GripperValuesSpec: "softvt.GripperValues" as "profile.actions.gripper" {
        /// Value that opens the gripper; not for code = "force".
        open: Option<f64>;
        /// Value that closes it; not for code = "force".
        closed: Option<f64>;
        /// Command of the value. continuous: a closure in proportion between open and closed, the default. binary:
        /// closed beyond the middle, else open. two-width: open, or the width that the answers give just after closing,
        /// held until one opens. force: a grip force in N at which closing stops; below 0 opens.
        code: Option<GripCode>;
        /// For code = "binary": limits at which the gripper closes and opens, instead of the middle.
        latch: Option<GripHysteresis>;
    }
    /// The messages of a policy server: the observations it gets and the meaning of its actions. The file given to
    /// --profile returns one.
    ProfileSpec: "softvt.Profile" as "profile", constructor "softvt.profile" {
        /// Name in results, unless --name gives another.
        name: String = Type::Name;
        /// Observations that are sent, in order.
        inputs: Vec<InputSpec> = Type::Distinct { of: InputSpec::REFERENCE, by: "", min: 1 };
        /// Meaning of the actions.
        actions: ActionEncodingSpec;
        /// True to send an observation in every control step, for policies with a history of their own. Those without a
        /// need for actions have wants_actions = false in the identity of the request; any reply answers them.
        observe_every_step: bool => Boolean(false);
    }
}

record! {
    /// The observations of a policy; nothing else is computed.
    ObservesSpec: "softvt.Observes" as "policy.observes" {
        /// Names of cameras of the scene.
        cameras: Vec<String> = Type::List(&Type::Name) => Empty;
        /// True to get the tactile images and markers of the fingers.
        tactile: bool => Boolean(false);
        /// True to get the commanded closure and the exact width, whose gap is the grip force: 1 mm per N. Without it,
        /// the width has the steps and the offset of a real hand.
        drives: bool => Boolean(false);
        /// True to get the true forces on the gels, which no real sensor gives; results then say force_observed.
        force: bool => Boolean(false);
    }
}

record_of! {
    /// Hysteresis of a binary gripper, in the unit of the gripper's number.
    GripHysteresis: "softvt.GripHysteresis" as "profile.actions.gripper.latch" {
        /// Value from which on, towards that of the closed gripper, an answer closes.
        close: f64;
        /// Value from which on, towards that of the open gripper, an answer opens.
        open: f64;
        /// Control steps for which a change is kept, whatever is answered.
        hold_steps: u32 = Type::Integer(Range::closed(0.0, 10_000.0)) => Integer(0);
    }
}

impl ObservesSpec {
    pub(crate) fn streams(&self) -> SensorStreams {
        let Self { cameras, tactile, force, drives: _ } = self;
        SensorStreams {
            cameras: cameras.clone(),
            tactile: *tactile,
            force: *force,
            ..SensorStreams::default()
        }
    }
}

choice! {
    /// The content of an input.
    enum InputKind {
        "camera" => Camera,
        "depth" => Depth,
        "segmentation" => Segmentation,
        "state" => State,
        "prompt" => Prompt,
        "tactile_image" => TactileImage,
        "tactile" => Tactile,
        "marker_motion" => MarkerMotion,
        "force" => Force,
        "query" => Query,
        "query_seed" => QuerySeed,
    }
}

choice! {
    GripCode { "continuous" => Continuous, "binary" => Binary, "two-width" => TwoWidth, "force" => Force }
}
choice! { MarkerStyle { "dots" => Dots, "arrows" => Arrows, "black_arrows" => BlackArrows } }
choice! { TactileMosaicLayout { "rows" => Rows, "columns" => Columns } }
impl LuaType for StatePart {
    const TYPE: Type = Type::Choice(RobotStream::PARTS);

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let name: String = lua.unpack(value)?;
        Self::named(&name).ok_or_else(|| fail!(lua, "unexpected {name:?}"))
    }
}

choice! {
    /// The meaning of the numbers of an action before that of the gripper.
    enum PoseKind {
        "absolute" => Absolute, "delta" => Delta, "delta_osc" => DeltaOsc, "joints" => Joints,
    }
}

pub(crate) static CONSTRUCTORS: &[&Record] = &[PolicySpec::RECORD, ProfileSpec::RECORD];
