//! Comparison of a policy's answers with demonstrations: what is wrong with them is named, and nothing else.

use std::{
    path::Path,
    sync::{Arc, Mutex},
};

use softvt::{
    geometry::{Quat, Vec3},
    parallel::lock,
    policy::{
        ActionChunk, EpisodeBrief, Observation, Policy, PolicyError,
        profile::{ActionEncoding, Profile},
    },
    robot::rotation,
    runner::{
        PolicyConfig, SilentObserver,
        policy_check::{
            AnswerComparison, DemoSamples, PolicyCheck, RecordedStep, check_policy, recorded_steps,
        },
        replay::demos_of,
    },
};

use super::dataset_recording::Recording;
use crate::support::{Project, SPATIAL_SOFT};

/// Number of actions per answer.
const CHUNK: usize = 8;

/// A demonstration: its observations and what was recorded.
#[derive(Default)]
struct Demo {
    observations: Vec<Observation>,
    recorded: Vec<RecordedStep>,
    /// Steps of the profile libero that lead to the recorded poses.
    steps: Vec<[f64; 6]>,
}

/// A command of an answer that is asked for.
struct Asked<'a> {
    demo: &'a Demo,
    /// Control step of the request.
    step: usize,
    /// Place in the answer.
    index: usize,
}

impl Asked<'_> {
    fn at(&self, step: usize) -> &RecordedStep {
        &self.demo.recorded[step.min(self.demo.recorded.len() - 1)]
    }

    fn now(&self) -> &RecordedStep {
        self.at(self.step + self.index)
    }

    fn tool(&self) -> Vec3 {
        self.demo.observations[self.step].robot.ee_position_b
    }

    fn tool_orientation(&self) -> Quat {
        rotation::from_axis_angle(&self.demo.observations[self.step].robot.ee_axis_angle_b)
    }

    fn orientation(&self) -> Quat {
        rotation::from_axis_angle(&self.now().action.axis_angle_b)
    }

    /// A number of a normal distribution, the same for the same place.
    fn noise(&self, salt: usize) -> f64 {
        let mut state = ((self.step + self.index) * 64 + salt) as u64 + 1;
        let mut uniform = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut x = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            (x ^ x >> 31) as f64 / u64::MAX as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    fn noise_of(&self, salt: usize) -> Vec3 {
        Vec3::from_fn(|i, _| self.noise(salt + i))
    }
}

/// The numbers that a policy answers.
type Answer = fn(&Asked<'_>) -> Vec<f64>;
/// The same, of a policy with parameters.
type SharedAnswer = Arc<dyn Fn(&Asked<'_>) -> Vec<f64> + Send + Sync>;

fn row(position: Vec3, rotation: Vec3, grip: f64) -> Vec<f64> {
    position.iter().chain(rotation.iter()).copied().chain([grip]).collect()
}

fn pose(a: &Asked<'_>) -> Vec<f64> {
    a.now().action.to_array().to_vec()
}

fn at(a: &Asked<'_>, step: usize) -> Vec<f64> {
    a.at(step).action.to_array().to_vec()
}

/// The pose with another position.
fn moved(a: &Asked<'_>, change: impl Fn(Vec3) -> Vec3) -> Vec<f64> {
    let action = a.now().action;
    row(change(action.position_b), action.axis_angle_b, action.closure())
}

/// The pose with another rotation.
fn turned(a: &Asked<'_>, change: impl Fn(Quat) -> Vec3) -> Vec<f64> {
    let action = a.now().action;
    row(action.position_b, change(a.orientation()), action.closure())
}

/// The pose with another number of the gripper.
fn gripped(a: &Asked<'_>, change: impl Fn(f64) -> f64) -> Vec<f64> {
    let action = a.now().action;
    row(action.position_b, action.axis_angle_b, change(action.closure()))
}

fn step(a: &Asked<'_>, change: impl Fn([f64; 6]) -> [f64; 6]) -> Vec<f64> {
    let at = (a.step + a.index).min(a.demo.steps.len() - 1);
    let is_closed = a.now().action.closure() > 0.1;
    change(a.demo.steps[at]).into_iter().chain([if is_closed { 1.0 } else { -1.0 }]).collect()
}

fn joints(a: &Asked<'_>, change: impl Fn([f64; 7]) -> [f64; 7]) -> Vec<f64> {
    let recorded = a.now();
    let joints = change(recorded.joints.expect("joint positions"));
    joints.into_iter().chain([recorded.action.closure()]).collect()
}

/// Answers with changed recorded actions.
struct Faulty {
    demo: Arc<Demo>,
    encoding: ActionEncoding,
    step: usize,
    chunk: usize,
    answer: SharedAnswer,
}

impl Policy for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }

    fn act(&mut self, _: &Observation) -> Result<ActionChunk, PolicyError> {
        let asked = |index| Asked { demo: &self.demo, step: self.step, index };
        let rows = (0..self.chunk).map(|index| (self.answer)(&asked(index))).collect();
        self.step += self.chunk;
        ActionChunk::decode(rows, &self.encoding)
    }
}

/// Keeps the observations of demonstrations.
struct Witness {
    seen: Arc<Mutex<Vec<Vec<Observation>>>>,
}

impl Witness {
    fn see(&self, observation: &Observation) {
        lock(&self.seen).last_mut().expect("an episode").push(observation.clone());
    }
}

impl Policy for Witness {
    fn name(&self) -> &str {
        "witness"
    }

    fn reset(&mut self, _: &EpisodeBrief) -> Result<(), PolicyError> {
        lock(&self.seen).push(Vec::new());
        Ok(())
    }

    fn observes_every_step(&self) -> bool {
        true
    }

    fn observe(&mut self, observation: &Observation) -> Result<(), PolicyError> {
        self.see(observation);
        Ok(())
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        self.see(observation);
        let robot = &observation.robot;
        let held = softvt::policy::Action::new(robot.ee_position_b, robot.ee_axis_angle_b, 0.0);
        Ok(vec![held.into(); CHUNK].into())
    }
}

/// The steps of libero's controller that cover displacements: the inverse of its spring.
fn spring_steps(displacements: &[Vec3]) -> Vec<Vec3> {
    let (omega, t) = (150.0_f64.sqrt(), 0.05);
    let decay = (-omega * t).exp();
    let mut velocity = Vec3::zeros();
    let step = |moved: &Vec3| {
        let step = (moved - velocity * t * decay) / (1.0 - decay * (1.0 + omega * t));
        let slope = velocity - step * omega;
        velocity = (slope - (slope * t - step) * omega) * decay;
        step
    };
    displacements.iter().map(step).collect()
}

fn libero_steps(observations: &[Observation], recorded: &[RecordedStep]) -> Vec<[f64; 6]> {
    let pairs = || observations.iter().zip(recorded);
    let translations: Vec<Vec3> = pairs().map(|(o, r)| r.action.position_b - o.robot.ee_position_b).collect();
    let turn = |(o, r): (&Observation, &RecordedStep)| {
        let [from, to] =
            [o.robot.ee_axis_angle_b, r.action.axis_angle_b].map(|v| rotation::from_axis_angle(&v));
        rotation::error(&from, &to)
    };
    let turns: Vec<Vec3> = pairs().map(turn).collect();
    let numbers = |(l, a): (&Vec3, &Vec3)| {
        let (l, a) = (l / 0.05, a / 0.5);
        [l.x, l.y, l.z, a.x, a.y, a.z]
    };
    spring_steps(&translations).iter().zip(&spring_steps(&turns)).map(numbers).collect()
}

/// The demonstrations of a dataset. Returns what is said of a policy that holds still, as well.
fn demos(dataset: &Path) -> (Vec<Arc<Demo>>, PolicyCheck) {
    let seen: Arc<Mutex<Vec<Vec<Observation>>>> = Arc::default();
    let shared = seen.clone();
    let start = move |_: &_| -> Box<dyn Policy> { Box::new(Witness { seen: shared.clone() }) };
    let policy = PolicyConfig::of("witness", start).expect("a name");
    let check = check_policy(&policy, dataset, usize::MAX, &(Arc::new(SilentObserver) as _))
        .unwrap_or_else(|error| panic!("{error}"));
    let observations = std::mem::take(&mut *lock(&seen));
    let demos = demos_of(dataset).expect("a dataset");
    let demo = |(demo, observations): (_, Vec<Observation>)| {
        let recorded = recorded_steps(demo).expect("actions");
        let steps = libero_steps(&observations, &recorded);
        Arc::new(Demo { observations, recorded, steps })
    };
    (demos.iter().zip(observations).map(demo).collect(), check)
}

/// The demonstration with a hand that is tilted throughout: the inverse of the half turn of a straight hand is itself.
fn tilted(demo: &Demo) -> Arc<Demo> {
    let tilt = Quat::from_scaled_axis(Vec3::new(0.4, -0.3, 0.2));
    let turn = |v: &Vec3| rotation::axis_angle(&(rotation::from_axis_angle(v) * tilt));
    let (mut observations, mut recorded) = (demo.observations.clone(), demo.recorded.clone());
    for (o, r) in observations.iter_mut().zip(&mut recorded) {
        o.robot.ee_axis_angle_b = turn(&o.robot.ee_axis_angle_b);
        r.action.axis_angle_b = turn(&r.action.axis_angle_b);
    }
    Arc::new(Demo { observations, recorded, steps: Vec::new() })
}

fn check(demos: &[Arc<Demo>], profile: &str, answer: Answer) -> PolicyCheck {
    check_chunks(demos, profile, CHUNK, Arc::new(answer))
}

fn check_chunks(demos: &[Arc<Demo>], profile: &str, chunk: usize, answer: SharedAnswer) -> PolicyCheck {
    let encoding = Profile::named(profile).expect("a profile").actions;
    let samples = |demo: &Arc<Demo>| {
        let samples = Arc::new(Mutex::new(DemoSamples::default()));
        let (demo_of, encoding_of, answer) = (demo.clone(), encoding.clone(), answer.clone());
        let policy = Faulty { demo: demo_of, encoding: encoding_of, step: 0, chunk, answer };
        let (brief, shared) = (EpisodeBrief::default(), samples.clone());
        let mut comparison =
            AnswerComparison::new(Box::new(policy), brief, chunk, Some(encoding.clone()), shared);
        for (observation, recorded) in demo.observations.iter().zip(&demo.recorded) {
            if comparison.step(observation, *recorded).is_err() {
                // The samples hold the error.
                break;
            }
        }
        std::mem::take(&mut *lock(&samples))
    };
    PolicyCheck::of(&demos.iter().map(samples).collect::<Vec<_>>())
}

/// A fault, and parts of the only findings that it has.
struct Case {
    fault: &'static str,
    answer: Answer,
    expected: &'static [&'static str],
}

const fn case(fault: &'static str, expected: &'static [&'static str], answer: Answer) -> Case {
    Case { fault, answer, expected }
}

const POSITIONS: [Case; 24] = [
    case("none", &[], pose),
    case("numbers that are not finite", &["answers: demonstration 1, step 0: "], |_| vec![f64::NAN; 7]),
    case("reversed in time", &["order: the answers look reversed in time ("], |a| {
        at(a, a.step + CHUNK - 1 - a.index)
    }),
    case("five steps early", &["time: the answers are 5 control steps early ("], |a| {
        at(a, a.step + a.index + 5)
    }),
    case("ten steps late", &["time: the answers are 10 control steps late ("], |a| {
        at(a, (a.step + a.index).saturating_sub(10))
    }),
    case("noise of 5 mm, one step late, a tighter grip", &[], |a| {
        let action = a.at((a.step + a.index).saturating_sub(1)).action;
        let grip = (1.1 * action.closure()).min(1.0);
        row(action.position_b + 5e-3 * a.noise_of(0), action.axis_angle_b + 0.03 * a.noise_of(8), grip)
    }),
    case("x and y exchanged", &["(x, y, z) of the answers are (y, x, z)"], |a| {
        moved(a, |p| Vec3::new(p.y, p.x, p.z))
    }),
    case("x and y exchanged, noise", &["(x, y, z) of the answers are (y, x, z)"], |a| {
        moved(a, |p| Vec3::new(p.y, p.x, p.z) + 4e-3 * a.noise_of(0))
    }),
    case("y reversed", &["(x, y, z) of the answers are (x, −y, z)"], |a| {
        moved(a, |p| Vec3::new(p.x, -p.y, p.z))
    }),
    case("turned by 90° about z", &["(x, y, z) of the answers are (y, −x, z)"], |a| {
        moved(a, |p| Vec3::new(p.y, -p.x, p.z))
    }),
    case("the whole pose turned by 90° about z", &["(x, y, z) of the answers are (y, −x, z)"], |a| {
        let frame = Quat::from_scaled_axis(Vec3::z() * -std::f64::consts::FRAC_PI_2);
        row(
            frame * a.now().action.position_b,
            rotation::axis_angle(&(frame * a.orientation())),
            a.now().action.closure(),
        )
    }),
    case("displacements turned by 90°", &["(x, y, z) of the answers are (y, −x, z)"], |a| {
        let tool = a.tool();
        moved(a, |p| tool + Vec3::new((p - tool).y, -(p - tool).x, (p - tool).z))
    }),
    case("displacements in mm", &["these look like millimetres"], |a| {
        let tool = a.tool();
        moved(a, |p| tool + 1e3 * (p - tool))
    }),
    case("mm", &["positions in millimetres"], |a| moved(a, |p| 1e3 * p)),
    case("mm, noise", &["positions in millimetres"], |a| moved(a, |p| 1e3 * p + 4.0 * a.noise_of(0))),
    case("the world frame", &["off by the constant (-0.660, 0.000, 0.000) m"], |a| {
        moved(a, |p| p - Vec3::x() * 0.66)
    }),
    case("relative poses", &["poses: the answers are relative to the tool pose in the observation"], |a| {
        let turn = rotation::error(&a.tool_orientation(), &a.orientation());
        row(a.now().action.position_b - a.tool(), turn, a.now().action.closure())
    }),
    case(
        "relative poses, noise",
        &["poses: the answers are relative to the tool pose in the observation"],
        |a| {
            let turn = rotation::error(&a.tool_orientation(), &a.orientation());
            let noise = 2e-3 * a.noise_of(0);
            row(a.now().action.position_b - a.tool() + noise, turn, a.now().action.closure())
        },
    ),
    case("normalised positions", &["undo the normalisation of the actions"], |a| {
        moved(a, |p| (p - Vec3::new(0.5, 0.03, 0.2)).component_div(&Vec3::new(0.1, 0.17, 0.08)))
    }),
    case("one position", &["every answer commands the same position"], |a| {
        moved(a, |_| Vec3::new(0.4, 0.0, 0.2))
    }),
    case("the images are not seen", &["the answers do not follow the demonstrations"], |a| {
        let tool = a.tool();
        moved(a, |p| tool + 0.05 * (1e5 * p).map(f64::sin))
    }),
    case("repeated four times", &["these look like 80 Hz"], |a| at(a, a.step + a.index / 4)),
    case("every fourth action", &["these look like 5 Hz"], |a| at(a, a.step + 4 * a.index)),
    case("every second action, noise", &["these look like 10 Hz"], |a| {
        let action = a.at(a.step + 2 * a.index).action;
        row(action.position_b + 3e-3 * a.noise_of(0), action.axis_angle_b, action.closure())
    }),
];

const ROTATIONS: [Case; 13] = [
    case("degrees", &["axis-angle in degrees"], |a| {
        turned(a, |q| rotation::axis_angle(&q).map(f64::to_degrees))
    }),
    case("degrees, noise", &["axis-angle in degrees"], |a| {
        turned(a, |q| rotation::axis_angle(&q).map(f64::to_degrees) + 2.0 * a.noise_of(0))
    }),
    case("Euler angles", &["Euler angles about the fixed axes x, y, z, rad"], |a| {
        turned(a, |q| {
            let (x, y, z) = q.euler_angles();
            Vec3::new(x, y, z)
        })
    }),
    case("Euler angles in degrees", &["Euler angles about the fixed axes x, y, z, degrees"], |a| {
        turned(a, |q| {
            let (x, y, z) = q.euler_angles();
            Vec3::new(x, y, z).map(f64::to_degrees)
        })
    }),
    case("a quaternion x, y, z, w and no gripper", &["quaternions x, y, z, w"], |a| {
        let q = a.orientation();
        row(a.now().action.position_b, Vec3::new(q.i, q.j, q.k), q.w)
    }),
    case("a quaternion w, x, y, z and no gripper", &["quaternions w, x, y, z"], |a| {
        let q = a.orientation();
        row(a.now().action.position_b, Vec3::new(q.w, q.i, q.j), q.k)
    }),
    case("x, y, z of a quaternion", &["x, y, z of quaternions"], |a| turned(a, |q| q.imag())),
    case("transposed", &["inverse (transposed) rotations"], |a| {
        turned(a, |q| rotation::axis_angle(&q.inverse()))
    }),
    case("the frame of the flange", &["(0, 0, -45)° about (x, y, z) of the tool"], |a| {
        let flange = Quat::from_scaled_axis(Vec3::z() * -std::f64::consts::FRAC_PI_4);
        turned(a, |q| rotation::axis_angle(&(q * flange)))
    }),
    case("relative rotations", &["rotations relative to the tool pose in the observation"], |a| {
        turned(a, |q| rotation::error(&a.tool_orientation(), &q))
    }),
    case("mm and degrees", &["positions in millimetres", "axis-angle in degrees"], |a| {
        let action = a.now().action;
        row(1e3 * action.position_b, action.axis_angle_b.map(f64::to_degrees), action.closure())
    }),
    case("a held pose, noise", &["the answers hold the pose of the observation"], |a| {
        let turn = rotation::axis_angle(&a.tool_orientation());
        row(a.tool() + 3e-3 * a.noise_of(0), turn + 0.02 * a.noise_of(8), a.now().action.closure())
    }),
    case("a held pose", &["the answers hold the pose of the observation"], |a| {
        row(a.tool(), rotation::axis_angle(&a.tool_orientation()), a.now().action.closure())
    }),
];

const GRIPS: [Case; 11] = [
    case("inverted", &["gripper: the answers are inverted"], |a| gripped(a, |c| 1.0 - c)),
    case("0 to 255", &["gripper: the answers look like closures, 0 (open) to 255 (closed)"], |a| {
        gripped(a, |c| 255.0 * c)
    }),
    case("255 to 0", &["gripper: the answers look like openings, 255 (open) to 0 (closed)"], |a| {
        gripped(a, |c| 255.0 - 255.0 * c)
    }),
    case("percent", &["gripper: the answers look like closures, 0 (open) to 100 (closed)"], |a| {
        gripped(a, |c| 100.0 * c)
    }),
    case("−1 to 1", &["gripper: the answers look like closures, -1 (open) to 1 (closed)"], |a| {
        gripped(a, |c| 2.0 * c - 1.0)
    }),
    case("finger positions", &["gripper: the answers look like finger positions in m"], |a| {
        gripped(a, |c| 0.04 * (1.0 - c) + 1e-4 * a.noise(3))
    }),
    case("widths in mm", &["gripper: the answers look like widths in mm"], |a| {
        gripped(a, |c| 80.0 * (1.0 - c))
    }),
    case("inverted, mm", &["positions in millimetres", "gripper: the answers are inverted"], |a| {
        let action = a.now().action;
        row(1e3 * action.position_b, action.axis_angle_b, 1.0 - action.closure())
    }),
    case("every second action, 0 to 255", &["these look like 10 Hz", "0 (open) to 255 (closed)"], |a| {
        let action = a.at(a.step + 2 * a.index).action;
        row(action.position_b, action.axis_angle_b, 255.0 * action.closure())
    }),
    case("constant", &["gripper: every answer commands the same closure"], |a| gripped(a, |_| 0.2)),
    case("open or closed", &[], |a| gripped(a, |c| f64::from(u8::from(c > 0.1)))),
];

const STEPS: [Case; 14] = [
    case("none", &[], |a| step(a, |s| s)),
    case("noise", &[], |a| step(a, |s| std::array::from_fn(|i| s[i] * 1.1 + 0.1 * a.noise(i)))),
    case("x and y exchanged", &["translation: (x, y, z) of the answers are (y, x, z)"], |a| {
        step(a, |[x, y, z, u, v, w]| [y, x, z, u, v, w])
    }),
    case("y reversed", &["translation: (x, y, z) of the answers are (x, −y, z)"], |a| {
        step(a, |[x, y, z, u, v, w]| [x, -y, z, u, v, w])
    }),
    case("turned by 90°", &["translation: (x, y, z) of the answers are (y, −x, z)"], |a| {
        step(a, |[x, y, z, u, v, w]| [y, -x, z, u, v, w])
    }),
    case("50 times as long", &["translation: the answers are 50.0 times as long"], |a| {
        step(a, |[x, y, z, u, v, w]| [50.0 * x, 50.0 * y, 50.0 * z, u, v, w])
    }),
    case("metres", &["fractions of 0.05 m are expected, these look like metres"], |a| {
        step(a, |[x, y, z, u, v, w]| [0.05 * x, 0.05 * y, 0.05 * z, u, v, w])
    }),
    case("absolute poses", &["poses: the answers are absolute poses"], |a| {
        let action = a.now().action;
        let is_closed = action.closure() > 0.1;
        row(action.position_b, action.axis_angle_b, if is_closed { 1.0 } else { -1.0 })
    }),
    case("x and y exchanged, noise", &["translation: (x, y, z) of the answers are (y, x, z)"], |a| {
        step(a, |[x, y, z, u, v, w]| {
            let noise = 0.05 * a.noise_of(0);
            [y + noise.x, x + noise.y, z + noise.z, u, v, w]
        })
    }),
    case("every second action", &["these look like 10 Hz"], |a| {
        let of = |k: usize| a.demo.steps[(a.step + 2 * a.index + k).min(a.demo.steps.len() - 1)];
        let is_closed = a.at(a.step + 2 * a.index).action.closure() > 0.1;
        let sum: [f64; 6] = std::array::from_fn(|i| of(0)[i] + of(1)[i]);
        sum.into_iter().chain([if is_closed { 1.0 } else { -1.0 }]).collect()
    }),
    case("axes of the tool", &["translation: the answers move along the axes of the tool"], |a| {
        let tool =
            a.demo.observations[(a.step + a.index).min(a.demo.observations.len() - 1)].robot.ee_axis_angle_b;
        step(a, |[x, y, z, u, v, w]| {
            let l = rotation::from_axis_angle(&tool).inverse() * Vec3::new(x, y, z);
            [l.x, l.y, l.z, u, v, w]
        })
    }),
    case("no motion", &["the answers hold the pose of the observation"], |a| step(a, |_| [0.0; 6])),
    case("0 to 1", &["gripper: the answers look like closures, 0 (open) to 1 (closed)"], |a| {
        let mut numbers = step(a, |s| s);
        numbers[6] = 0.5 * (numbers[6] + 1.0);
        numbers
    }),
    case("inverted", &["gripper: the answers are inverted"], |a| {
        let mut numbers = step(a, |s| s);
        numbers[6] = -numbers[6];
        numbers
    }),
];

const JOINTS: [Case; 9] = [
    case("none", &[], |a| joints(a, |q| q)),
    case("noise", &[], |a| joints(a, |q| std::array::from_fn(|i| q[i] + 0.01 * a.noise(i)))),
    case("degrees", &["these look like degrees"], |a| joints(a, |q| q.map(f64::to_degrees))),
    case("a reversed joint", &["joints: joint 4 is reversed ("], |a| {
        joints(a, |q| std::array::from_fn(|i| if i == 3 { -q[i] } else { q[i] }))
    }),
    case("two exchanged", &["joint 2 is answered as joint 4, joint 4 is answered as joint 2"], |a| {
        joints(a, |[p, q, r, s, t, u, v]| [p, s, r, q, t, u, v])
    }),
    case("an offset", &["joints: joint 7 is off by the constant 45.0° ("], |a| {
        joints(a, |q| std::array::from_fn(|i| q[i] + if i == 6 { std::f64::consts::FRAC_PI_4 } else { 0.0 }))
    }),
    case("an offset, noise", &["joints: joint 7 is off by the constant 4"], |a| {
        let offset = |i| if i == 6 { std::f64::consts::FRAC_PI_4 } else { 0.0 };
        joints(a, |q| std::array::from_fn(|i| q[i] + offset(i) + 0.02 * a.noise(i)))
    }),
    case("relative", &["relative to the joint positions in the observation"], |a| {
        let measured = a.demo.observations[a.step].robot.joints;
        joints(a, |q| std::array::from_fn(|i| q[i] - measured[i]))
    }),
    case("every second action", &["these look like 10 Hz"], |a| {
        let recorded = a.at(a.step + 2 * a.index);
        recorded.joints.expect("joints").into_iter().chain([recorded.action.closure()]).collect()
    }),
];

const BINARY_GRIPS: [Case; 2] = [
    case("none", &[], |a| gripped(a, |closure| f64::from(u8::from(closure > 0.1)))),
    case("small closures", &["gripper: the grip code is binary, which closes above the middle"], |a| {
        gripped(a, |closure| 0.6 * closure)
    }),
];

/// Expects the findings of all cases of a table. Returns what is wrong with them.
fn wrong_findings(demos: &[Arc<Demo>], profile: &str, cases: &[Case]) -> String {
    let wrong = |Case { fault, answer, expected }: &Case| {
        let check = check(demos, profile, *answer);
        let is_named = check.findings.len() == expected.len()
            && expected.iter().zip(&check.findings).all(|(part, finding)| finding.contains(part));
        (!is_named).then(|| format!("{profile}, {fault}: expected {expected:?}\n{}\n", check.text()))
    };
    cases.iter().filter_map(wrong).collect()
}

/// All exchanged and reversed axes, with noise.
fn check_all_axes(demos: &[Arc<Demo>]) {
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for signs in 0..8 {
            let sign = move |i: usize| if signs >> i & 1 == 1 { -1.0 } else { 1.0 };
            let change = move |p: Vec3| Vec3::from_fn(|i, _| sign(i) * p[order[i]]);
            let answer: SharedAnswer = Arc::new(move |a| moved(a, |p| change(p) + 4e-3 * a.noise_of(0)));
            let name =
                |i: usize| format!("{}{}", if sign(i) < 0.0 { "−" } else { "" }, ["x", "y", "z"][order[i]]);
            let name = format!("of the answers are ({}, {}, {}) of", name(0), name(1), name(2));
            let found = check_chunks(demos, "visuo_tactile", CHUNK, answer).findings;
            match name.as_str() {
                "of the answers are (x, y, z) of" => assert_eq!(found, [""; 0]),
                _ => assert!(found.len() == 1 && found[0].contains(&name), "{name}: {found:#?}"),
            }
        }
    }
}

/// Policies that are right but for noise, whatever the length of their answers.
fn check_noise(demos: &[Arc<Demo>]) {
    for (chunk, seed) in
        [1, 2, 4, 10, 16, 50].into_iter().flat_map(|chunk| (0..8).map(move |seed| (chunk, seed)))
    {
        let absolute: SharedAnswer = Arc::new(move |a| {
            let (action, salt) = (a.now().action, 1000 * seed);
            let (position, rotation) = (5e-3 * a.noise_of(salt), 0.03 * a.noise_of(salt + 8));
            let grip = action.closure() * 0.9 + 0.02 * a.noise(salt + 16);
            row(action.position_b + position, action.axis_angle_b + rotation, grip)
        });
        let found = check_chunks(demos, "visuo_tactile", chunk, absolute);
        assert_eq!(found.findings, [""; 0], "{chunk} {seed}");
    }
}

#[test]
fn every_fault_has_the_finding_of_its_cause_alone() {
    let project = Project::new(&[]);
    Recording::new(project.run(SPATIAL_SOFT).tasks(&[3]), 1, "data").with(|o| o.has_images = false).record();
    let noop = PolicyConfig::named("noop").expect("built in");
    let refused = check_policy(&noop, &project.path("data"), 1, &(Arc::new(SilentObserver) as _));
    let message = refused.err().map(|error| error.to_string());
    assert!(message.is_some_and(|text| text.contains("only policy servers")), "of a built-in policy");

    let (demos, held) = demos(&project.path("data"));
    assert!(held.findings[0].contains("the answers hold the pose of the observation"), "{held:#?}");
    assert!(held.text().contains(&held.findings[0]) && held.demonstrations == 1);
    let same = check(&demos, "visuo_tactile", pose);
    assert!(same.translation.error.is_some_and(|error| error < 1e-9), "{same:?}");
    assert!(same.grip.correlation.is_some_and(|r| r > 0.999) && same.answers > 5, "{same:?}");
    let tilted: Vec<Arc<Demo>> = demos.iter().map(|demo| tilted(demo)).collect();
    let wrong = [
        wrong_findings(&demos, "visuo_tactile", &POSITIONS),
        wrong_findings(&tilted, "visuo_tactile", &ROTATIONS),
        wrong_findings(&demos, "visuo_tactile", &GRIPS),
        wrong_findings(&demos, "vision", &BINARY_GRIPS),
        wrong_findings(&demos, "libero", &STEPS),
        wrong_findings(&demos, "visuo_tactile_joints", &JOINTS),
    ]
    .concat();
    assert!(wrong.is_empty(), "{wrong}");
    check_all_axes(&demos);
    check_noise(&demos);
}
