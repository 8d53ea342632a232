//! The control steps of the demonstrations that answers stand for.

use super::{
    agreement::{CLEARLY_BETTER, EXPLAINS, VectorPair, correlation, factor, mean},
    sampling::{AnswerSample, DemoSamples, StepSample},
};
use softvt_benchmark::CONTROL_HZ;
use softvt_geometry::Vec3;

/// Recorded control steps per command that are considered, besides one.
const RATES: [f64; 14] =
    [0.5, 2.0, 0.25, 4.0, 1.0 / 3.0, 3.0, 2.0 / 3.0, 4.0 / 3.0, 0.2, 5.0, 0.4, 6.0, 0.125, 8.0];
/// Control steps by which answers may be late or early that are considered. One is within what policies differ by.
const LAGS: std::ops::RangeInclusive<i32> = 2..=10;
/// Commands that an answer needs to tell its rate.
const LEAST_COMMANDS: usize = 4;
/// Mean error below which the order of an answer is not doubted, m.
const LEAST_ERROR_M: f64 = 5e-3;
/// Share of the recorded motion below which answers hold still.
const STILL: f64 = 0.3;

/// The control step of a demonstration, from that of the request on, that a command stands for.
#[derive(Clone, Copy, Debug)]
enum Phase {
    First,
    Last,
    Repeated,
    /// As many control steps later than commands should.
    Shifted(i32),
}

/// Commands that stand for other control steps than theirs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// Recorded control steps per command.
    rate: f64,
    phase: Phase,
}

/// What is wrong with the speed of answers.
#[derive(Clone, Debug)]
pub(super) struct TimingFinding {
    pub text: String,
    /// Other control steps than those of the commands; `None` if the answers hold the pose of the observation.
    pub stretch: Option<Stretch>,
}

/// A fit of the paths of answers.
#[derive(Clone, Copy, Debug)]
struct StretchFit {
    stretch: Stretch,
    error: f64,
    correlation: f64,
}

impl Stretch {
    const NONE: Self = Self { rate: 1.0, phase: Phase::First };

    const fn shifted(steps: i32) -> Self {
        Self { rate: 1.0, phase: Phase::Shifted(steps) }
    }

    fn steps(self, command: usize) -> f64 {
        let command = command as f64;
        match self.phase {
            Phase::First => self.rate * command,
            Phase::Last => self.rate * (command + 1.0) - 1.0,
            // Thirds are not exact.
            Phase::Repeated => (self.rate * command + 1e-9).floor(),
            Phase::Shifted(steps) => command + f64::from(steps),
        }
    }
}

/// Recorded positions of a demonstration, as answers count them.
struct RecordedPath {
    positions: Vec<Vec3>,
    /// True if `positions` are sums of displacements.
    are_sums: bool,
}

impl RecordedPath {
    fn of(demo: &DemoSamples) -> Self {
        let are_sums = demo.steps.iter().any(|s| s.is_step);
        let mut sum = Vec3::zeros();
        let position = |s: &StepSample| {
            sum += s.recorded.action.position_b - s.tool.position;
            if are_sums { sum } else { s.recorded.action.position_b }
        };
        Self { positions: demo.steps.iter().map(position).collect(), are_sums }
    }

    /// Position between two control steps; `None` after the last one.
    fn at(&self, step: f64) -> Option<Vec3> {
        if step < 0.0 && self.are_sums {
            return Some(Vec3::zeros());
        }
        let (whole, share) = (step.max(0.0).floor(), step.max(0.0).fract());
        let low = *self.positions.get(whole as usize)?;
        match share {
            0.0 => Some(low),
            _ => Some(low.lerp(self.positions.get(whole as usize + 1)?, share)),
        }
    }

    /// Displacement from the request to the control step of a command.
    fn displacement(&self, answer: &AnswerSample, steps: f64) -> Option<Vec3> {
        let start = if self.are_sums { self.at(answer.step as f64 - 1.0)? } else { answer.start };
        Some(self.at(answer.step as f64 + steps)? - start)
    }
}

/// Names answers whose last command comes first.
pub(super) fn explain_order(steps: &[StepSample]) -> Option<String> {
    let mut of_answer: Vec<&[StepSample]> = steps.chunk_by(|a, b| a.request_step == b.request_step).collect();
    of_answer.retain(|answer| answer.len() >= LEAST_COMMANDS && !answer[0].is_step);
    let distance = |recorded: &StepSample, answered: &StepSample| {
        (recorded.recorded.action.position_b - answered.answered.position_b).norm()
    };
    let pairs = || of_answer.iter().flat_map(|answer| answer.iter().zip(*answer));
    let reversed = || of_answer.iter().flat_map(|answer| answer.iter().zip(answer.iter().rev()));
    let before = mean(pairs().map(|(recorded, answered)| distance(recorded, answered)));
    let after = mean(reversed().map(|(recorded, answered)| distance(recorded, answered)));
    (before > LEAST_ERROR_M && after <= CLEARLY_BETTER * before).then(|| {
        format!(
            "order: the answers look reversed in time (error {:.1} mm as received, {:.1} mm so read): the first action of an answer is \
             that of the observation",
            1e3 * before,
            1e3 * after
        )
    })
}

fn pairs(demos: &[DemoSamples], least: usize, stretch: Stretch) -> Vec<VectorPair> {
    let mut all = Vec::new();
    for demo in demos {
        let path = RecordedPath::of(demo);
        for answer in demo.answers.iter().filter(|answer| answer.path.len() >= least) {
            for (command, position) in answer.path.iter().enumerate() {
                let recorded = path.displacement(answer, stretch.steps(command));
                let answered = position - answer.start;
                all.extend(recorded.map(|recorded| VectorPair { recorded, answered }));
            }
        }
    }
    all
}

fn error(pairs: &[VectorPair], factor: f64) -> f64 {
    mean(pairs.iter().map(|p| (p.answered - factor * p.recorded).norm()))
}

/// Names answers of another rate, and answers that hold still.
pub(super) fn explain_timing(demos: &[DemoSamples]) -> Option<TimingFinding> {
    let own = pairs(demos, 1, Stretch::NONE);
    let moved = mean(own.iter().map(|p| p.recorded.norm()));
    let still = mean(own.iter().map(|p| p.answered.norm()));
    let before = error(&own, 1.0);
    let is_short = moved > 0.002 && still <= STILL * moved && still <= CLEARLY_BETTER * before;
    // Short answers in the right direction are a matter of units.
    let holds = is_short && correlation(&own).is_none_or(|r| r < EXPLAINS);
    let best = best_stretch(demos);
    if holds && best.is_none_or(|fit| fit.error > 0.75 * still) {
        let (still, moved) = (1e3 * still, 1e3 * moved);
        return Some(TimingFinding {
            text: format!(
                "motion: the answers hold the pose of the observation: they lie {still:.1} mm from it in the mean, the \
                 recorded actions {moved:.1} mm: check what the policy was trained to predict, and that its answers are not \
                 those of a start or a fallback"
            ),
            stretch: None,
        });
    }
    let fit = best?;
    Some(TimingFinding { text: fit.words(before_of(demos)), stretch: Some(fit.stretch) })
}

impl StretchFit {
    /// What it says of the answers; `before` is their mean error at one control step per command, m.
    fn words(&self, before: f64) -> String {
        let Self { stretch: Stretch { rate, phase }, error, .. } = *self;
        let errors =
            |read: &str| format!("(mean error {:.1} mm {read}, {:.1} mm so read)", 1e3 * before, 1e3 * error);
        match phase {
            Phase::Shifted(steps) => format!(
                "time: the answers are {} control steps {} {}: the first action of an answer is that of the observation",
                steps.abs(),
                if steps > 0 { "early" } else { "late" },
                errors("as received")
            ),
            _ => format!(
                "rate: the answers advance {} control steps of the demonstrations per action {}: actions are executed at \
                 {CONTROL_HZ} Hz, these look like {} Hz: resample them",
                short(rate),
                errors("at one step per action"),
                short(f64::from(CONTROL_HZ) / rate)
            ),
        }
    }
}

fn short(x: f64) -> String {
    let text = format!("{x:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn before_of(demos: &[DemoSamples]) -> f64 {
    error(&pairs(demos, LEAST_COMMANDS, Stretch::NONE), 1.0)
}

/// The stretch that explains the paths of answers clearly better than none.
fn best_stretch(demos: &[DemoSamples]) -> Option<StretchFit> {
    let own = pairs(demos, LEAST_COMMANDS, Stretch::NONE);
    let before = error(&own, 1.0);
    if before < 1e-3 {
        return None;
    }
    let fit = |stretch: Stretch| {
        let pairs = pairs(demos, LEAST_COMMANDS, stretch);
        let correlation = correlation(&pairs).unwrap_or(0.0);
        StretchFit { stretch, error: error(&pairs, 1.0), correlation }
    };
    let phases =
        |rate: f64| [Phase::First, Phase::Last, Phase::Repeated].map(|phase| Stretch { rate, phase });
    let lags = LAGS.flat_map(|steps| [steps, -steps]).map(Stretch::shifted);
    let fits = RATES.into_iter().flat_map(phases).chain(lags).map(fit);
    let explained = fits.filter(|fit| fit.correlation >= EXPLAINS && fit.error <= CLEARLY_BETTER * before);
    let best = explained.min_by(|a, b| a.error.total_cmp(&b.error))?;
    // A longer displacement is a matter of units where answers are displacements, and one of the rate elsewhere.
    let scaled = error(&own, factor(&own).unwrap_or(1.0));
    let are_steps = demos.iter().flat_map(|demo| &demo.steps).any(|s| s.is_step);
    let share = if are_steps { 0.75 } else { 4.0 / 3.0 };
    (best.error <= share * scaled).then_some(best)
}

/// The steps with the recorded actions that their commands stand for.
pub(super) fn retimed(demos: &[DemoSamples], stretch: Stretch) -> Vec<StepSample> {
    let of_demo = |demo: &DemoSamples| -> Vec<StepSample> {
        let retimed = |s: &StepSample| {
            let steps = stretch.steps(s.step - s.request_step).round();
            let step = (s.request_step as f64 + steps).max(0.0) as usize;
            Some(StepSample { recorded: demo.steps.get(step)?.recorded, ..s.clone() })
        };
        demo.steps.iter().filter_map(retimed).collect()
    };
    demos.iter().flat_map(of_demo).collect()
}
