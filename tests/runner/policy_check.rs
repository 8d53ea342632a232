//! Comparison of a policy's answers with demonstrations: the fit of each channel shows what is wrong in its numbers.

use std::{
    f64::consts::{FRAC_PI_2, FRAC_PI_4},
    path::Path,
    sync::{Arc, Mutex},
};

use softvt::{
    geometry::{Quat, Vec3},
    parallel::lock,
    policy::{
        Action, ActionChunk, EpisodeBrief, Observation, Policy, PolicyError,
        profile::{ActionEncoding, PoseEncoding, Profile},
    },
    robot::rotation,
    runner::{
        PolicyConfig, SilentObserver,
        policy_check::{
            AnswerComparison, ChannelFit, DemoSamples, PolicyCheck, RecordedStep, check_policy,
            recorded_steps,
        },
        replay::demos_of,
    },
};

use super::dataset_recording::Recording;
use crate::support::{Project, SPATIAL_SOFT};

/// Number of actions per answer.
const CHUNK: usize = 8;

/// A demonstration: its observations and its actions.
struct Demo {
    observations: Vec<Observation>,
    recorded: Vec<RecordedStep>,
}

/// A command of an answer that is asked for.
#[derive(Clone, Copy)]
struct Asked<'a> {
    demo: &'a Demo,
    /// Control step of the request.
    step: usize,
    /// Place in the answer.
    index: usize,
}

impl Asked<'_> {
    fn at(&self, step: usize) -> RecordedStep {
        self.demo.recorded[step.min(self.demo.recorded.len() - 1)]
    }

    fn action(&self) -> Action {
        self.at(self.step + self.index).action
    }

    fn orientation(&self) -> Quat {
        rotation::from_axis_angle(&self.action().axis_angle_b)
    }

    /// Position and orientation of the tool in the observation.
    fn tool(&self) -> (Vec3, Quat) {
        let robot = &self.demo.observations[self.step].robot;
        (robot.ee_position_b, rotation::from_axis_angle(&robot.ee_axis_angle_b))
    }

    /// Numbers of a distribution with the variance 1, the same for the same place.
    fn noise<const N: usize>(&self, salt: usize) -> [f64; N] {
        std::array::from_fn(|i| {
            let mut state = ((self.step + self.index) * 64 + salt + i) as u64 + 1;
            let mut uniform = || {
                state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
                let mut x = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
                (x ^ x >> 31) as f64 / u64::MAX as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        })
    }

    /// Displacement and closing in fractions of 5 cm and of 0.5 rad, as the encoding [`steps`] has them.
    fn fractions(&self) -> [f64; 7] {
        let at = (self.step + self.index).min(self.demo.recorded.len() - 1);
        let (action, robot) = (self.at(at).action, &self.demo.observations[at].robot);
        let from = rotation::from_axis_angle(&robot.ee_axis_angle_b);
        let turn = rotation::error(&from, &rotation::from_axis_angle(&action.axis_angle_b)) / 0.5;
        let shift = (action.position_b - robot.ee_position_b) / 0.05;
        let closing = if action.closure() > 0.1 { 1.0 } else { -1.0 };
        [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, closing]
    }
}

/// The numbers that a policy answers.
type Answer = fn(&Asked<'_>) -> Vec<f64>;

fn row(position: Vec3, rotation: Vec3, grip: f64) -> Vec<f64> {
    Action::new(position, rotation, grip).to_array().to_vec()
}

fn at(a: &Asked<'_>, step: usize) -> Vec<f64> {
    a.at(step).action.to_array().to_vec()
}

fn moved(a: &Asked<'_>, change: impl Fn(Vec3) -> Vec3) -> Vec<f64> {
    let action = a.action();
    row(change(action.position_b), action.axis_angle_b, action.closure())
}

fn turned(a: &Asked<'_>, change: impl Fn(Quat) -> Vec3) -> Vec<f64> {
    row(a.action().position_b, change(a.orientation()), a.action().closure())
}

fn gripped(a: &Asked<'_>, change: impl Fn(f64) -> f64) -> Vec<f64> {
    let action = a.action();
    row(action.position_b, action.axis_angle_b, change(action.closure()))
}

/// The fractions, each times a factor.
fn step(a: &Asked<'_>, factors: [f64; 7]) -> Vec<f64> {
    a.fractions().iter().zip(factors).map(|(fraction, factor)| fraction * factor).collect()
}

/// The recorded joints in an order, each times a factor.
fn joints(a: &Asked<'_>, order: [usize; 7], factors: [f64; 7]) -> Vec<f64> {
    let recorded = a.at(a.step + a.index).joints.expect("joint positions");
    let joints = order.into_iter().zip(factors).map(|(joint, factor)| factor * recorded[joint]);
    joints.chain([a.action().closure()]).collect()
}

/// Numbers plus a share of noise, but for the last one, of the gripper.
fn noisy(a: &Asked<'_>, mut numbers: Vec<f64>, share: f64) -> Vec<f64> {
    let noise = a.noise::<7>(0);
    let motion = numbers.len() - 1;
    numbers[..motion].iter_mut().zip(noise).for_each(|(number, noise)| *number += share * noise);
    numbers
}

/// Answers with changed recorded actions.
struct Faulty {
    demo: Arc<Demo>,
    encoding: ActionEncoding,
    step: usize,
    answer: Answer,
}

impl Policy for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }

    fn act(&mut self, _: &Observation) -> Result<ActionChunk, PolicyError> {
        let row = |index| (self.answer)(&Asked { demo: &self.demo, step: self.step, index });
        let rows = (0..CHUNK).map(row).collect();
        self.step += CHUNK;
        ActionChunk::decode(rows, &self.encoding)
    }
}

/// Holds the pose, and keeps the observations of demonstrations.
struct Witness {
    seen: Arc<Mutex<Vec<Vec<Observation>>>>,
}

impl Policy for Witness {
    fn name(&self) -> &str {
        "witness"
    }

    fn reset(&mut self, _: &EpisodeBrief) -> Result<(), PolicyError> {
        lock(&self.seen).push(Vec::new());
        Ok(())
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        lock(&self.seen).last_mut().expect("an episode").push(observation.clone());
        let robot = &observation.robot;
        Ok(Action::new(robot.ee_position_b, robot.ee_axis_angle_b, 0.0).into())
    }
}

/// The first demonstration of a dataset, and the check of a policy that holds still.
fn demonstration(dataset: &Path) -> (Demo, PolicyCheck) {
    let seen: Arc<Mutex<Vec<Vec<Observation>>>> = Arc::default();
    let shared = seen.clone();
    let start = move |_: &_| -> Box<dyn Policy> { Box::new(Witness { seen: shared.clone() }) };
    let policy = PolicyConfig::of("witness", start).expect("a name");
    let check = check_policy(&policy, dataset, 1, &(Arc::new(SilentObserver) as _))
        .unwrap_or_else(|error| panic!("{error}"));
    let recorded = recorded_steps(&demos_of(dataset).expect("a dataset")[0]).expect("actions");
    (Demo { observations: lock(&seen).remove(0), recorded }, check)
}

/// The demonstration with a hand that is tilted throughout: the inverse of the half turn of a straight hand is itself.
fn tilted(demo: &Demo) -> Demo {
    let tilt = Quat::from_scaled_axis(Vec3::new(0.4, -0.3, 0.2));
    let turn = |v: &Vec3| rotation::axis_angle(&(rotation::from_axis_angle(v) * tilt));
    let (mut observations, mut recorded) = (demo.observations.clone(), demo.recorded.clone());
    for (o, r) in observations.iter_mut().zip(&mut recorded) {
        o.robot.ee_axis_angle_b = turn(&o.robot.ee_axis_angle_b);
        r.action.axis_angle_b = turn(&r.action.axis_angle_b);
    }
    Demo { observations, recorded }
}

fn encoding(profile: &str) -> ActionEncoding {
    Profile::named(profile).expect("a profile").actions
}

/// Displacements in fractions of 5 cm and of 0.5 rad.
fn steps() -> ActionEncoding {
    let pose = PoseEncoding::Delta { translation_m: 0.05, rotation_rad: 0.5 };
    ActionEncoding { pose, ..encoding("libero") }
}

fn check(demo: &Arc<Demo>, encoding: &ActionEncoding, answer: Answer) -> PolicyCheck {
    let samples = Arc::new(Mutex::new(DemoSamples::default()));
    let policy = Faulty { demo: demo.clone(), encoding: encoding.clone(), step: 0, answer };
    let (brief, recorded) = (EpisodeBrief::default(), demo.recorded.clone());
    let encoding = Some(encoding.clone());
    let mut comparison =
        AnswerComparison::new(Box::new(policy), brief, CHUNK, encoding, recorded, samples.clone());
    // An error ends the comparison; the samples hold it.
    let _ = demo.observations.iter().try_for_each(|seen| comparison.compare_next(seen).map(drop));
    PolicyCheck::of(&[std::mem::take(&mut *lock(&samples))])
}

/// A fault, and what the table shows of it: the parameters of the channels that deviate, such as "x scale 1000". "x"
/// alone stands for a channel of which any parameter may deviate, "..." for any number of channels.
struct Case {
    fault: &'static str,
    shown: &'static str,
    answer: Answer,
}

const fn case(fault: &'static str, shown: &'static str, answer: Answer) -> Case {
    Case { fault, shown, answer }
}

const POSITIONS: [Case; 20] = [
    case("none", "", |a| at(a, a.step + a.index)),
    case("noise of 5 mm, one step late, a tighter grip", "", |a| {
        let action = a.at((a.step + a.index).saturating_sub(1)).action;
        let [x, y, z, rx, ry, rz, grip] = a.noise(0);
        let turn = action.axis_angle_b + 0.03 * Vec3::new(rx, ry, rz);
        row(action.position_b + 5e-3 * Vec3::new(x, y, z), turn, 1.1 * action.closure() + 0.02 * grip)
    }),
    case("reversed in time", "x rate -1, y rate -1, z rate -1, ...", |a| at(a, a.step + CHUNK - 1 - a.index)),
    case("five steps early", "x lag -5, y lag -5, z lag -5, gripper lag -5, ...", |a| {
        at(a, a.step + a.index + 5)
    }),
    case("ten steps late", "x lag 10, y lag 10, z lag 10, gripper lag 10, ...", |a| {
        at(a, (a.step + a.index).saturating_sub(10))
    }),
    case("80 Hz", "x rate 0.25, y rate 0.25, z rate 0.25, ...", |a| at(a, a.step + a.index / 4)),
    case("5 Hz", "x rate 4, y rate 4, z rate 4, ...", |a| at(a, a.step + 4 * a.index)),
    case("x and y exchanged", "x source y, y source x", |a| moved(a, |p| Vec3::new(p.y, p.x, p.z))),
    case("x and y exchanged, noise", "x source y, y source x", |a| {
        moved(a, |p| Vec3::new(p.y, p.x, p.z) + 4e-3 * Vec3::from(a.noise::<3>(0)))
    }),
    case("y reversed", "y scale -1", |a| moved(a, |p| Vec3::new(p.x, -p.y, p.z))),
    case("turned by 90°", "x source y, y source x, y scale -1", |a| moved(a, |p| Vec3::new(p.y, -p.x, p.z))),
    case("displacements turned by 90°", "x source x+Δy, y source y+Δx, y scale -1", |a| {
        let tool = a.tool().0;
        moved(a, |p| tool + Vec3::new((p - tool).y, -(p - tool).x, (p - tool).z))
    }),
    case("displacements in mm", "x scale 1000, y scale 1000, z scale 1000", |a| {
        let tool = a.tool().0;
        moved(a, |p| tool + 1e3 * (p - tool))
    }),
    case("mm", "x scale 1000, y scale 1000, z scale 1000", |a| moved(a, |p| 1e3 * p)),
    case("the world frame", "x offset -0.66", |a| moved(a, |p| p - Vec3::x() * 0.66)),
    case("relative poses", "x source Δx, y source Δy, z source Δz, rx, ry, rz", |a| {
        let (tool, orientation) = a.tool();
        let turn = rotation::error(&orientation, &a.orientation());
        row(a.action().position_b - tool, turn, a.action().closure())
    }),
    case("normalised positions", "x scale 10, x offset -5, y scale 5, z scale 20, z offset -4", |a| {
        moved(a, |p| (p - Vec3::new(0.5, 0.0, 0.2)).component_div(&Vec3::new(0.1, 0.2, 0.05)))
    }),
    case("one position", "x scale 0, x offset 0.4, y scale 0, z scale 0, z offset 0.2", |a| {
        moved(a, |_| Vec3::new(0.4, 0.0, 0.2))
    }),
    case("the images are not seen", "x, y, z", |a| {
        let tool = a.tool().0;
        moved(a, |p| tool + 0.05 * (1e5 * p).map(f64::sin))
    }),
    case("a held pose", "x scale 0, y scale 0, z scale 0, rx, ry, rz", |a| {
        let (tool, orientation) = a.tool();
        row(tool, rotation::axis_angle(&orientation), a.action().closure())
    }),
];

const ROTATIONS: [Case; 8] = [
    case("degrees", "rx scale 57.3, ry scale 57.3, rz scale 57.3", |a| {
        turned(a, |q| rotation::axis_angle(&q).map(f64::to_degrees))
    }),
    case("Euler angles in degrees", "rx source roll, ry source pitch, rz source yaw, rz scale 57.3", |a| {
        turned(a, |q| Vec3::from(<[f64; 3]>::from(q.euler_angles())).map(f64::to_degrees))
    }),
    case("a quaternion and no gripper", "rx source qx, ry source qy, rz source qz, gripper source qw", |a| {
        let q = a.orientation();
        row(a.action().position_b, Vec3::new(q.i, q.j, q.k), q.w)
    }),
    case("a quaternion, w first", "rx source qw, ry source qx, rz source qy, gripper source qz", |a| {
        let q = a.orientation();
        row(a.action().position_b, Vec3::new(q.w, q.i, q.j), q.k)
    }),
    case("transposed", "...", |a| turned(a, |q| rotation::axis_angle(&q.inverse()))),
    case("a hand turned by 90°", "rx, ry, rz", |a| {
        let hand = Quat::from_scaled_axis(Vec3::z() * FRAC_PI_2);
        turned(a, |q| rotation::axis_angle(&(q * hand)))
    }),
    case("relative rotations", "rx, ry, rz", |a| turned(a, |q| rotation::error(&a.tool().1, &q))),
    case(
        "mm and degrees",
        "x scale 1000, y scale 1000, z scale 1000, rx scale 57.3, ry scale 57.3, rz scale 57.3",
        |a| {
            let action = a.action();
            row(1e3 * action.position_b, action.axis_angle_b.map(f64::to_degrees), action.closure())
        },
    ),
];

const GRIPS: [Case; 8] = [
    case("inverted", "gripper scale -1, gripper offset 1", |a| gripped(a, |c| 1.0 - c)),
    case("0 to 255", "gripper scale 255", |a| gripped(a, |c| 255.0 * c)),
    case("255 to 0", "gripper scale -255, gripper offset 255", |a| gripped(a, |c| 255.0 - 255.0 * c)),
    case("−1 to 1", "gripper offset -1", |a| gripped(a, |c| 2.0 * c - 1.0)),
    case("finger positions", "gripper scale -0.04", |a| {
        gripped(a, |c| 0.04 * (1.0 - c) + 1e-4 * a.noise::<1>(3)[0])
    }),
    case("widths in mm", "gripper scale -80, gripper offset 80", |a| gripped(a, |c| 80.0 * (1.0 - c))),
    case("constant", "gripper scale 0", |a| gripped(a, |_| 0.2)),
    case("open or closed", "", |a| gripped(a, |c| f64::from(u8::from(c > 0.1)))),
];

const BINARY_GRIPS: [Case; 2] = [
    case("none", "", |a| gripped(a, |closure| f64::from(u8::from(closure > 0.1)))),
    case("small closures", "gripper source closure", |a| gripped(a, |closure| 0.6 * closure)),
];

const STEPS: [Case; 9] = [
    case("none", "", |a| step(a, [1.0; 7])),
    case("noise", "", |a| noisy(a, step(a, [1.1, 1.1, 1.1, 1.1, 1.1, 1.1, 1.0]), 0.1)),
    case("x and y exchanged", "Δx source Δy, Δy source Δx", |a| {
        let [x, y, rest @ ..] = a.fractions();
        [y, x].into_iter().chain(rest).collect()
    }),
    case("y reversed", "Δy scale -1", |a| step(a, [1.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0])),
    case("50 times as long", "Δx scale 50, Δy scale 50, Δz scale 50", |a| {
        step(a, [50.0, 50.0, 50.0, 1.0, 1.0, 1.0, 1.0])
    }),
    case("metres", "Δx scale 0.05, Δy scale 0.05, Δz scale 0.05", |a| {
        step(a, [0.05, 0.05, 0.05, 1.0, 1.0, 1.0, 1.0])
    }),
    case("absolute poses", "Δx source x, Δy source y, Δz source z, Δrx, Δry, Δrz", |a| {
        row(a.action().position_b, a.action().axis_angle_b, a.fractions()[6])
    }),
    case("no motion", "Δx scale 0, Δy scale 0, Δz scale 0, Δrx, Δry, Δrz", |a| {
        step(a, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    }),
    case("inverted grip", "gripper scale -1, gripper offset 1", |a| {
        step(a, [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, -1.0])
    }),
];

/// The joints in their order.
const ORDER: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];

const JOINTS: [Case; 6] = [
    case("noise", "", |a| noisy(a, joints(a, ORDER, [1.0; 7]), 0.01)),
    case("degrees", "q2 scale 57.3, q4 scale 57.3, q6 scale 57.3, q1, q3, q5, q7", |a| {
        joints(a, ORDER, [1.0_f64.to_degrees(); 7])
    }),
    case("a reversed joint", "q4 scale -1", |a| joints(a, ORDER, [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0])),
    case("two exchanged", "q2 source q4, q4 source q2", |a| joints(a, [0, 3, 2, 1, 4, 5, 6], [1.0; 7])),
    case("an offset", "q7 offset 0.785", |a| {
        let mut numbers = joints(a, ORDER, [1.0; 7]);
        numbers[6] += FRAC_PI_4;
        numbers
    }),
    case("relative", "q2 source Δq2, q4 source Δq4, q6 source Δq6, q1, q3, q5, q7", |a| {
        let measured = a.demo.observations[a.step].robot.joints;
        let recorded = joints(a, ORDER, [1.0; 7]);
        recorded.iter().zip(measured.into_iter().chain([0.0])).map(|(q, measured)| q - measured).collect()
    }),
];

/// True if a parameter of a fit has the expected value, to 3 %.
fn shows(fit: &ChannelFit, parameter: &str, value: &str) -> bool {
    let found = match parameter {
        "source" => return fit.source.replace(' ', "") == value,
        "scale" => fit.scale.unwrap_or(f64::NAN),
        "offset" => fit.offset,
        "rate" => fit.rate,
        "lag" => f64::from(fit.lag),
        other => panic!("no parameter {other}"),
    };
    let value: f64 = value.parse().expect("a number");
    (found - value).abs() <= 0.03 * value.abs().max(0.1)
}

/// The cases whose table shows something else than expected.
fn wrong_cases(demo: &Arc<Demo>, encoding: &ActionEncoding, cases: &[Case]) -> String {
    let wrong = |Case { fault, shown, answer }: &Case| {
        let check = check(demo, encoding, *answer);
        let parts = shown.split(", ").filter(|part| !part.is_empty());
        let named: Vec<Vec<&str>> =
            parts.clone().filter(|part| *part != "...").map(|part| part.split(' ').collect()).collect();
        let deviates = |fit: &&ChannelFit| !fit.deviates.is_empty();
        let is_named = |fit: &ChannelFit| named.iter().any(|part| part[0] == fit.channel);
        let has = |part: &Vec<&str>| {
            let fit = check.channels.iter().filter(deviates).find(|fit| fit.channel == part[0]);
            fit.is_some_and(|fit| part.get(1).is_none_or(|parameter| shows(fit, parameter, part[2])))
        };
        let has_others = check.channels.iter().filter(deviates).any(|fit| !is_named(fit));
        let is_right = named.iter().all(has)
            && (!has_others || shown.ends_with("..."))
            && check.agrees() == shown.is_empty();
        (!is_right).then(|| format!("{fault}: expected {shown:?}\n{}\n", check.text()))
    };
    cases.iter().filter_map(wrong).collect()
}

#[test]
fn the_table_shows_every_fault_in_its_numbers() {
    let project = Project::new(&[]);
    Recording::new(project.run(SPATIAL_SOFT).tasks(&[3]), 1, "data").with(|o| o.has_images = false).record();
    let noop = PolicyConfig::named("noop").expect("built in");
    let refused = check_policy(&noop, &project.path("data"), 1, &(Arc::new(SilentObserver) as _));
    let message = refused.err().map(|error| error.to_string());
    assert!(message.is_some_and(|text| text.contains("only policy servers")), "of a built-in policy");

    let (demo, held) = demonstration(&project.path("data"));
    assert!(!held.agrees() && held.answers > 100 && held.text().contains("deviates"), "{}", held.text());
    let (tilted, demo) = (Arc::new(tilted(&demo)), Arc::new(demo));
    let failed = check(&demo, &encoding("visuo_tactile"), |_| vec![f64::NAN; 7]);
    assert!(!failed.agrees() && failed.text().contains("demonstration 1, step 0: "), "{}", failed.text());
    let pose = encoding("visuo_tactile");
    let wrong = [
        wrong_cases(&demo, &pose, &POSITIONS),
        wrong_cases(&tilted, &pose, &ROTATIONS),
        wrong_cases(&demo, &pose, &GRIPS),
        wrong_cases(&demo, &encoding("vision"), &BINARY_GRIPS),
        wrong_cases(&demo, &steps(), &STEPS),
        wrong_cases(&demo, &encoding("visuo_tactile_joints"), &JOINTS),
    ]
    .concat();
    assert!(wrong.is_empty(), "{wrong}");
}
