//! Synthetic policies with one fault each: the fit of each channel shows it in its numbers.

use std::{
    f64::consts::{FRAC_PI_2, FRAC_PI_4},
    sync::{Arc, Mutex},
};

use super::{AnswerComparison, ChannelFit, DemoSamples, PolicyCheck, RecordedStep};
use softvt_common::parallel::lock;
use softvt_geometry::{Quat, Vec3};
use softvt_policy::{
    Action, ActionChunk, EpisodeBrief, Observation, Policy, PolicyError, RobotState,
    profile::{ActionEncoding, PoseEncoding, Profile},
};
use softvt_robot::rotation;

const CHUNK: usize = 8;
const STEPS: usize = 160;

/// Position of the tool at a control step.
fn position(step: usize) -> Vec3 {
    let t = step as f64;
    Vec3::new(0.5 + 0.1 * (0.07 * t).sin(), 0.12 * (0.11 * t + 1.0).sin(), 0.2 + 0.06 * (0.09 * t).cos())
}

/// Orientation of the tool: a hand that points down, tilted and turned.
fn orientation(step: usize) -> Quat {
    let t = step as f64;
    let turn = Vec3::new(0.4 * (0.06 * t).sin(), 0.3 * (0.08 * t + 2.0).sin(), 0.5 * (0.05 * t + 1.0).sin());
    Quat::from_scaled_axis(turn) * rotation::from_axis_angle(&rotation::POINTING_DOWN)
}

fn joint_positions(step: usize) -> [f64; 7] {
    let (t, mean) = (step as f64, |i: f64| 0.3 * i - 1.0);
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|i| mean(i) + 0.4 * ((0.05 + 0.01 * i) * t + i).sin())
}

/// The recorded action of a control step: the state of the next one, with a hand that closes and opens again.
fn recorded(step: usize) -> RecordedStep {
    let step = step.min(STEPS - 1);
    let closure = if step < 120 { 0.5 * ((step as f64 - 40.0) / 20.0).clamp(0.0, 1.0) } else { 0.0 };
    let action = Action::new(position(step + 1), rotation::axis_angle(&orientation(step + 1)), closure);
    RecordedStep { action, joints: Some(joint_positions(step + 1)) }
}

fn observation(step: usize) -> Observation {
    let robot = RobotState {
        ee_position_b: position(step),
        ee_axis_angle_b: rotation::axis_angle(&orientation(step)),
        joints: joint_positions(step),
        ..RobotState::default()
    };
    Observation { time_s: 0.05 * step as f64, robot, ..Observation::default() }
}

/// The numbers that a policy answers to the observation of a control step, for another control step.
type Answer = fn(usize, usize) -> Vec<f64>;

/// Numbers that look random, with the variance 1.
fn noise<const N: usize>(step: usize) -> [f64; N] {
    std::array::from_fn(|i| 2.0_f64.sqrt() * (1e4 * (step * 8 + i + 1) as f64).sin())
}

fn action(step: usize) -> Action {
    recorded(step).action
}

fn row(position: Vec3, rotation: Vec3, grip: f64) -> Vec<f64> {
    Action::new(position, rotation, grip).to_array().to_vec()
}

/// The recorded action with another position, rotation or closure.
fn moved(step: usize, change: impl Fn(Vec3) -> Vec3) -> Vec<f64> {
    row(change(action(step).position_b), action(step).axis_angle_b, action(step).closure())
}

fn turned(step: usize, change: impl Fn(Quat) -> Vec3) -> Vec<f64> {
    let q = rotation::from_axis_angle(&action(step).axis_angle_b);
    row(action(step).position_b, change(q), action(step).closure())
}

fn gripped(step: usize, change: impl Fn(f64) -> f64) -> Vec<f64> {
    row(action(step).position_b, action(step).axis_angle_b, change(action(step).closure()))
}

/// Displacement in fractions of 5 cm and of 0.5 rad, and open or closed as −1 or 1; each times a factor.
fn displaced(step: usize, factors: [f64; 7]) -> Vec<f64> {
    let q = rotation::from_axis_angle(&action(step).axis_angle_b);
    let shift = (action(step).position_b - position(step)) / 0.05;
    let turn = rotation::error(&orientation(step), &q) / 0.5;
    let numbers = row(shift, turn, if action(step).closure() > 0.25 { 1.0 } else { -1.0 });
    numbers.iter().zip(factors).map(|(number, factor)| number * factor).collect()
}

/// The recorded joints in an order, each times a factor, and the closure.
fn joints(step: usize, order: [usize; 7], factors: [f64; 7]) -> Vec<f64> {
    let positions = recorded(step).joints.expect("joint positions");
    let numbers = order.into_iter().zip(factors).map(|(joint, factor)| factor * positions[joint]);
    numbers.chain([action(step).closure()]).collect()
}

/// Numbers plus a share of noise, but for that of the gripper.
fn noisy(step: usize, mut numbers: Vec<f64>, share: f64) -> Vec<f64> {
    let motion = numbers.len() - 1;
    numbers[..motion].iter_mut().zip(noise::<7>(step)).for_each(|(number, noise)| *number += share * noise);
    numbers
}

/// Answers with changed recorded actions.
struct Faulty {
    encoding: ActionEncoding,
    step: usize,
    answer: Answer,
}

impl Policy for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }

    fn act(&mut self, _: &Observation) -> Result<ActionChunk, PolicyError> {
        let rows: Vec<_> =
            (self.step..self.step + CHUNK).map(|step| (self.answer)(self.step, step)).collect();
        self.step += CHUNK;
        ActionChunk::decode(rows, &self.encoding)
    }
}

fn encoding(profile: &str) -> ActionEncoding {
    Profile::named(profile).expect("a profile").actions
}

fn check(encoding: &ActionEncoding, answer: Answer) -> PolicyCheck {
    let samples = Arc::new(Mutex::new(DemoSamples::default()));
    let policy = Box::new(Faulty { encoding: encoding.clone(), step: 0, answer });
    let (brief, steps) = (EpisodeBrief::default(), (0..STEPS).map(recorded).collect());
    let encoding = Some(encoding.clone());
    let mut comparison = AnswerComparison::new(policy, brief, CHUNK, encoding, steps, samples.clone());
    // An error ends the comparison; the samples hold it.
    let _ = (0..STEPS).try_for_each(|step| comparison.compare_next(&observation(step)).map(drop));
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

const POSITIONS: [Case; 17] = [
    case("none", "", |_, to| moved(to, |p| p)),
    case("noise of 5 mm, one step late, a tighter grip", "", |_, to| {
        let [x, y, z, rx, ry, rz, grip] = noise(to);
        let action = action(to.saturating_sub(1));
        let turn = action.axis_angle_b + 0.03 * Vec3::new(rx, ry, rz);
        row(action.position_b + 5e-3 * Vec3::new(x, y, z), turn, 1.1 * action.closure() + 0.02 * grip)
    }),
    case("reversed in time", "x rate -1, y rate -1, z rate -1, rx rate -1, ...", |from, to| {
        moved(2 * from + CHUNK - 1 - to, |p| p)
    }),
    case("five steps early", "x lag -5, z lag -5, rx lag -5, gripper lag -5, ...", |_, to| {
        moved(to + 5, |p| p)
    }),
    case("ten steps late", "x lag 10, z lag 10, rx lag 10, gripper lag 10, ...", |_, to| {
        moved(to.saturating_sub(10), |p| p)
    }),
    case("5 Hz", "x rate 4, y rate 4, z rate 4, ...", |from, to| moved(from + 4 * (to - from), |p| p)),
    case("x and y exchanged, noise", "x source y, y source x", |_, to| {
        moved(to, |p| Vec3::new(p.y, p.x, p.z) + 4e-3 * Vec3::from(noise::<3>(to)))
    }),
    case("y reversed", "y scale -1", |_, to| moved(to, |p| Vec3::new(p.x, -p.y, p.z))),
    case("turned by 90°", "x source y, y source x, y scale -1", |_, to| {
        moved(to, |p| Vec3::new(p.y, -p.x, p.z))
    }),
    case("displacements turned by 90°", "x source x+Δy, y source y+Δx, y scale -1", |from, to| {
        let tool = position(from);
        moved(to, |p| tool + Vec3::new((p - tool).y, -(p - tool).x, (p - tool).z))
    }),
    case("mm", "x scale 1000, y scale 1000, z scale 1000", |_, to| moved(to, |p| 1e3 * p)),
    case("the world frame", "x offset -0.66", |_, to| moved(to, |p| p - Vec3::x() * 0.66)),
    case("relative poses", "x source Δx, z source Δz, rx source Δrx, rz source Δrz, ...", |from, to| {
        let q = rotation::from_axis_angle(&action(to).axis_angle_b);
        let turn = rotation::error(&orientation(from), &q);
        row(action(to).position_b - position(from), turn, action(to).closure())
    }),
    case("normalised", "x scale 10, x offset -5, y scale 5, z scale 20, z offset -4", |_, to| {
        moved(to, |p| (p - Vec3::new(0.5, 0.0, 0.2)).component_div(&Vec3::new(0.1, 0.2, 0.05)))
    }),
    case("one position", "x scale 0, x offset 0.4, y scale 0, z scale 0, z offset 0.2", |_, to| {
        moved(to, |_| Vec3::new(0.4, 0.0, 0.2))
    }),
    case("the images are not seen", "x, y, z", |from, to| {
        moved(to, |_| position(from) + 0.07 * Vec3::from(noise::<3>(to)))
    }),
    case("a held pose", "x scale 0, y scale 0, z scale 0, rx scale 0, ry scale 0, rz scale 0", |from, to| {
        row(position(from), rotation::axis_angle(&orientation(from)), action(to).closure())
    }),
];

const ROTATIONS: [Case; 6] = [
    case("degrees", "rx scale 57.3, ry scale 57.3, rz scale 57.3", |_, to| {
        turned(to, |q| rotation::axis_angle(&q).map(f64::to_degrees))
    }),
    case(
        "Euler angles in degrees",
        "rx source roll, ry source pitch, rz source yaw, rz scale 57.3",
        |_, to| turned(to, |q| Vec3::from(<[f64; 3]>::from(q.euler_angles())).map(f64::to_degrees)),
    ),
    case(
        "a quaternion and no gripper",
        "rx source qx, ry source qy, rz source qz, gripper source qw",
        |_, to| {
            let q = rotation::from_axis_angle(&action(to).axis_angle_b);
            row(action(to).position_b, Vec3::new(q.i, q.j, q.k), q.w)
        },
    ),
    case("inverse rotations", "...", |_, to| turned(to, |q| rotation::axis_angle(&q.inverse()))),
    case("a hand turned by 90°", "...", |_, to| {
        turned(to, |q| rotation::axis_angle(&(q * Quat::from_scaled_axis(Vec3::z() * FRAC_PI_2))))
    }),
    case("mm and degrees", "x scale 1000, y, z, rx scale 57.3, ry, rz", |_, to| {
        let (position, turn) = (1e3 * action(to).position_b, action(to).axis_angle_b.map(f64::to_degrees));
        row(position, turn, action(to).closure())
    }),
];

const GRIPS: [Case; 7] = [
    case("inverted", "gripper scale -1, gripper offset 1", |_, to| gripped(to, |c| 1.0 - c)),
    case("255 to 0", "gripper scale -255, gripper offset 255", |_, to| gripped(to, |c| 255.0 - 255.0 * c)),
    case("−1 to 1", "gripper offset -1", |_, to| gripped(to, |c| 2.0 * c - 1.0)),
    case("finger positions", "gripper scale -0.04", |_, to| {
        gripped(to, |c| 0.04 * (1.0 - c) + 1e-4 * noise::<1>(to)[0])
    }),
    case("widths in mm", "gripper scale -80, gripper offset 80", |_, to| gripped(to, |c| 80.0 * (1.0 - c))),
    case("constant", "gripper scale 0", |_, to| gripped(to, |_| 0.2)),
    case("open or closed", "", |_, to| gripped(to, |c| f64::from(u8::from(c > 0.25)))),
];

const BINARY_GRIPS: [Case; 2] = [
    case("none", "", |_, to| gripped(to, |closure| f64::from(u8::from(closure > 0.25)))),
    case("small closures", "gripper source closure", |_, to| gripped(to, |closure| 0.6 * closure)),
];

const DISPLACEMENTS: [Case; 6] = [
    case("none", "", |_, to| displaced(to, [1.0; 7])),
    case("noise", "", |_, to| noisy(to, displaced(to, [1.1, 1.1, 1.1, 1.1, 1.1, 1.1, 1.0]), 0.05)),
    case("50 times as long", "Δx scale 50, Δy scale 50, Δz scale 50", |_, to| {
        displaced(to, [50.0, 50.0, 50.0, 1.0, 1.0, 1.0, 1.0])
    }),
    case("metres", "Δx scale 0.05, Δy scale 0.05, Δz scale 0.05", |_, to| {
        displaced(to, [0.05, 0.05, 0.05, 1.0, 1.0, 1.0, 1.0])
    }),
    case("absolute poses", "Δx source x, Δy source y, Δz source z, Δrx, Δry, Δrz", |_, to| {
        row(action(to).position_b, action(to).axis_angle_b, displaced(to, [1.0; 7])[6])
    }),
    case(
        "no motion",
        "Δx scale 0, Δy scale 0, Δz scale 0, Δrx scale 0, Δry scale 0, Δrz scale 0",
        |_, to| displaced(to, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    ),
];

/// The joints in their order.
const ORDER: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];

const JOINTS: [Case; 6] = [
    case("noise", "", |_, to| noisy(to, joints(to, ORDER, [1.0; 7]), 0.01)),
    case("degrees", "q1 scale 57.3, q2 scale 57.3, q3, q4, q5, q6, q7 scale 57.3", |_, to| {
        joints(to, ORDER, [1.0_f64.to_degrees(); 7])
    }),
    case("a reversed joint", "q4 scale -1", |_, to| joints(to, ORDER, [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0])),
    case("two exchanged", "q2 source q4, q4 source q2", |_, to| joints(to, [0, 3, 2, 1, 4, 5, 6], [1.0; 7])),
    case("an offset", "q7 offset 0.785", |_, to| {
        let mut numbers = joints(to, ORDER, [1.0; 7]);
        numbers[6] += FRAC_PI_4;
        numbers
    }),
    case("relative", "q1 source Δq1, q2 source Δq2, q3, q4, q5, q6, q7 source Δq7", |from, to| {
        let measured = joint_positions(from).into_iter().chain([0.0]);
        joints(to, ORDER, [1.0; 7]).iter().zip(measured).map(|(q, measured)| q - measured).collect()
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
fn wrong_cases(encoding: &ActionEncoding, cases: &[Case]) -> String {
    let wrong = |Case { fault, shown, answer }: &Case| {
        let check = check(encoding, *answer);
        let parts = shown.split(", ").filter(|part| !part.is_empty() && *part != "...");
        let named: Vec<Vec<&str>> = parts.map(|part| part.split(' ').collect()).collect();
        let deviating: Vec<&ChannelFit> =
            check.channels.iter().filter(|fit| !fit.deviates.is_empty()).collect();
        let has = |part: &Vec<&str>| {
            let fit = deviating.iter().find(|fit| fit.channel == part[0]);
            fit.is_some_and(|fit| part.get(1).is_none_or(|parameter| shows(fit, parameter, part[2])))
        };
        let is_named = |fit: &&ChannelFit| named.iter().any(|part| part[0] == fit.channel);
        let is_right = named.iter().all(has)
            && (shown.ends_with("...") || deviating.iter().all(is_named))
            && check.agrees() == shown.is_empty();
        (!is_right).then(|| format!("{fault}: expected {shown:?}\n{}\n", check.text()))
    };
    cases.iter().filter_map(wrong).collect()
}

#[test]
fn the_table_shows_every_fault_in_its_numbers() {
    let (pose, libero) = (encoding("visuo_tactile"), encoding("libero"));
    let delta = PoseEncoding::Delta { translation_m: 0.05, rotation_rad: 0.5 };
    let wrong = [
        wrong_cases(&pose, &POSITIONS),
        wrong_cases(&pose, &ROTATIONS),
        wrong_cases(&pose, &GRIPS),
        wrong_cases(&encoding("vision"), &BINARY_GRIPS),
        wrong_cases(&ActionEncoding { pose: delta, ..libero }, &DISPLACEMENTS),
        wrong_cases(&encoding("visuo_tactile_joints"), &JOINTS),
    ]
    .concat();
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn a_failure_of_the_policy_is_told() {
    let failed = check(&encoding("visuo_tactile"), |_, _| vec![f64::NAN; 7]);
    let text = failed.text();
    assert!(!failed.agrees() && text.contains("failed at demonstration 1, step 0: "), "{text}");
}
