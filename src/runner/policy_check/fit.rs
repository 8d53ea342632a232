//! One affine map per channel of the answers, by least squares: answer = scale · demonstration + offset.

use serde::Serialize;

use super::{
    sampling::DemoSamples,
    series::{DemoSeries, Form, Quantity, Timing},
};
use softvt_evaluation::statistics::mean;
use softvt_policy::profile::GripCode;
use softvt_robot::panda::ARM_DOFS;

/// Scales of answers that agree.
const AGREEING_SCALES: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// Largest share of the motion of the demonstrations that the fit may leave.
const RESIDUAL_SHARE: f64 = 0.87;
/// Standard deviation of a quantity below which it does not vary, in m, rad or closures.
const LEAST_VARIATION: f64 = 1e-4;
/// Share of the variance of an answer that another quantity must explain to be its source.
const EXPLAINED: f64 = 0.5;
/// Times by which the residual of another source, or of another timing, must be smaller.
const CLEARLY_BETTER: f64 = 2.0;
/// Standard errors within which a scale is not told from one that agrees.
const SCALE_ERRORS: f64 = 4.0;
/// Control steps per command that are considered; −1 for answers that are reversed in time.
const RATES: [f64; 15] =
    [0.5, 2.0, 0.25, 4.0, 1.0 / 3.0, 3.0, 2.0 / 3.0, 4.0 / 3.0, 0.2, 5.0, 0.4, 6.0, 0.125, 8.0, -1.0];
/// Commands that an answer needs to tell its rate.
const LEAST_COMMANDS: usize = 4;
/// Largest lag that is considered, control steps.
const MAX_LAG: i32 = 10;
/// Lag within which policies differ, control steps.
const AGREEING_LAG: i32 = 1;

struct Unit {
    name: &'static str,
    /// Offsets and residuals that are a matter of precision.
    offset: f64,
    residual: f64,
}

const METRE: Unit = Unit { name: "m", offset: 0.02, residual: 0.01 };
const RADIAN: Unit = Unit { name: "rad", offset: 0.087, residual: 0.105 };
const CLOSURE: Unit = Unit { name: "closure", offset: 0.25, residual: 0.25 };

/// The affine map from the demonstrations to one channel of the answers. Offset and residual are in the
/// unit of the channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelFit {
    pub channel: String,
    /// Quantity of the demonstrations that it follows best.
    pub source: String,
    /// Unit of the channel: m, rad, or the closure of the gripper.
    pub unit: &'static str,
    /// Scale of the answer; null if the demonstrations do not tell it.
    pub scale: Option<f64>,
    pub offset: f64,
    /// Control steps of the demonstrations per command; −1 if the answers are reversed in time.
    pub rate: f64,
    /// Control steps by which the answers are late.
    pub lag: i32,
    /// Root mean square of what the map leaves of the answers, divided by the scale if that is above 1.
    pub residual: f64,
    /// Root mean square of the motion of the demonstrations: from the observed pose, per axis.
    pub motion: f64,
    /// Names of the parameters that do not agree with the demonstrations.
    pub deviates: Vec<&'static str>,
}

/// A channel of the answers, and the quantities that it should have.
struct Channel {
    index: usize,
    name: String,
    unit: Unit,
    own: Vec<Quantity>,
}

#[derive(Clone, Copy, Debug)]
struct Reading {
    quantity: Quantity,
    form: Form,
    timing: Timing,
    is_own: bool,
}

#[derive(Clone, Copy, Debug)]
struct Fit {
    reading: Reading,
    scale: Option<f64>,
    scale_error: f64,
    offset: f64,
    residual: f64,
}

struct Comparison<'a> {
    demos: Vec<DemoSeries<'a>>,
    has_joints: bool,
    is_step: bool,
    grip_code: GripCode,
}

/// The fit of each channel; empty without answers.
pub(super) fn channel_fits(demos: &[DemoSamples]) -> Vec<ChannelFit> {
    let answered: Vec<&DemoSamples> = demos.iter().filter(|demo| !demo.steps.is_empty()).collect();
    let Some(first) = answered.first() else { return Vec::new() };
    let step = &first.steps[0];
    let comparison = Comparison {
        has_joints: step.answered.joints.is_some(),
        is_step: step.is_step,
        grip_code: first.grip_code,
        demos: answered.iter().map(|demo| DemoSeries::new(demo)).collect(),
    };
    comparison.channels().iter().filter_map(|channel| comparison.fit_channel(channel)).collect()
}

impl Comparison<'_> {
    fn channels(&self) -> Vec<Channel> {
        let motion = |index: usize| {
            let (own, unit) = match (self.has_joints, index) {
                (true, i) => (Quantity::Joint(i), RADIAN),
                (false, 0..3) => (Quantity::Position(index), METRE),
                (false, _) => (Quantity::AxisAngle(index - 3), RADIAN),
            };
            let shown = if self.is_step { self.displacement(index) } else { own };
            Channel { index, name: shown.name(), unit, own: vec![shown] }
        };
        let count = if self.has_joints { ARM_DOFS } else { 6 };
        let grip = match self.grip_code {
            GripCode::Binary => vec![Quantity::Closed],
            _ => vec![Quantity::Closure, Quantity::Closed],
        };
        let grip = Channel { index: count, name: "gripper".to_owned(), unit: CLOSURE, own: grip };
        (0..count).map(motion).chain([grip]).collect()
    }

    /// The displacement of a channel of the motion.
    fn displacement(&self, channel: usize) -> Quantity {
        match (self.has_joints, channel) {
            (true, i) => Quantity::JointShift(i),
            (false, 0..3) => Quantity::Shift(channel),
            (false, _) => Quantity::Turn(channel - 3),
        }
    }

    /// All meanings of a channel, its own first.
    fn readings(&self, channel: &Channel) -> Vec<Reading> {
        let reading = |quantity: Quantity, form: Form| Reading {
            quantity,
            form,
            timing: Timing::NONE,
            is_own: channel.own.contains(&quantity),
        };
        let axes = |of: fn(usize) -> Quantity, form: Form| (0..3).map(move |i| (of(i), form));
        let own = Reading { is_own: true, ..reading(self.displacement(channel.index), Form::Displaced) };
        let mut all = match channel.unit.name == CLOSURE.name {
            true => channel.own.iter().map(|own| reading(*own, Form::Plain)).collect(),
            false => vec![own],
        };
        let mut others: Vec<(Quantity, Form)> = Vec::new();
        if self.has_joints {
            others.extend((0..ARM_DOFS).map(|i| (Quantity::Joint(i), Form::Plain)));
            others.extend((0..ARM_DOFS).map(|i| (Quantity::JointShift(i), Form::Plain)));
        } else {
            others.extend(axes(Quantity::Position, Form::Plain));
            others.extend(axes(Quantity::AxisAngle, Form::Continuous));
            others.extend(axes(Quantity::AxisAngle, Form::Plain));
            others.extend(axes(Quantity::Euler, Form::Unwrapped));
            others.extend((0..4).map(|i| (Quantity::Quaternion(i), Form::Signed)));
            for form in [Form::Plain, Form::Displaced] {
                others.extend(axes(Quantity::Shift, form).chain(axes(Quantity::ToolShift, form)));
                others.extend(axes(Quantity::Turn, form).chain(axes(Quantity::ToolTurn, form)));
            }
        }
        others.extend([(Quantity::Closure, Form::Plain), (Quantity::Closed, Form::Plain)]);
        all.extend(others.into_iter().map(|(quantity, form)| reading(quantity, form)));
        all
    }

    /// The best fit of a channel; `None` if the demonstrations lack its quantity.
    fn fit_channel(&self, channel: &Channel) -> Option<ChannelFit> {
        let readings = self.readings(channel);
        // A share of the variation, so that rounding decides nothing.
        let floor = 0.02 * spread(&self.answered(readings[0].form, channel.index)) + 1e-9;
        let score = |fit: &Fit| {
            let is_timed = fit.reading.timing != Timing::NONE;
            let weight = |is_other: bool| if is_other { CLEARLY_BETTER } else { 1.0 };
            (fit.residual + floor) * weight(!fit.reading.is_own) * weight(is_timed)
        };
        let best_of = |fits: &mut dyn Iterator<Item = Fit>| {
            fits.fold(None, |best: Option<Fit>, fit| match best {
                Some(best) if score(&best) <= score(&fit) => Some(best),
                _ => Some(fit),
            })
        };
        let mut best = best_of(&mut readings.iter().filter_map(|reading| self.fit(channel, *reading)))?;
        let timings = [readings[0], best.reading]
            .into_iter()
            .flat_map(|reading| self.timings().into_iter().map(move |timing| Reading { timing, ..reading }));
        let timed = timings.filter_map(|reading| self.fit(channel, reading));
        best = best_of(&mut [best].into_iter().chain(timed))?;
        if best.reading.timing != Timing::NONE {
            let timing = best.reading.timing;
            let again = readings.iter().map(|reading| Reading { timing, ..*reading });
            best = best_of(&mut [best].into_iter().chain(again.filter_map(|r| self.fit(channel, r))))?;
        }
        Some(self.describe(channel, &best))
    }

    /// Timings other than one control step per command without a lag.
    fn timings(&self) -> Vec<Timing> {
        let lags = (1..=MAX_LAG).flat_map(|lag| [lag, -lag]).map(|lag| Timing { rate: 1.0, lag });
        let rates = RATES.into_iter().map(|rate| Timing { rate, lag: 0 });
        let longest = self.demos.iter().map(DemoSeries::longest_answer).max().unwrap_or(0);
        // Short answers do not tell their rate.
        lags.chain(rates.filter(|_| longest >= LEAST_COMMANDS)).collect()
    }

    fn answered(&self, form: Form, channel: usize) -> Vec<f64> {
        self.demos.iter().flat_map(|demo| demo.answered(form, channel)).collect()
    }

    /// The affine map of a reading. `None` if the reading is no meaning of the channel.
    fn fit(&self, channel: &Channel, reading: Reading) -> Option<Fit> {
        let Reading { quantity, form, timing, is_own } = reading;
        let source = self
            .demos
            .iter()
            .flat_map(|demo| (0..demo.steps.len()).map(move |now| demo.quantity(quantity, now, timing)));
        let answered = self.answered(form, channel.index);
        let total = answered.len();
        let (x, y): (Vec<f64>, Vec<f64>) =
            source.zip(answered).filter_map(|(source, answer)| Some((source?, answer))).unzip();
        if 2 * x.len() < total {
            return None;
        }
        let (n, mean_x, mean_y) = (x.len() as f64, mean(&x)?, mean(&y)?);
        let (spread_x, spread_y) = (spread(&x), spread(&y));
        let both = x.iter().zip(&y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum::<f64>() / n;
        let scale = both / spread_x.powi(2);
        let residual = (spread_y.powi(2) - scale * both).max(0.0).sqrt();
        let scale_error = residual / (n.sqrt() * spread_x);
        let is_plain = is_own && timing == Timing::NONE;
        if spread_x > LEAST_VARIATION && scale_error <= 0.5 * scale.abs().max(1.0) {
            let is_explained = residual < (1.0 - EXPLAINED).sqrt() * spread_y;
            let fit =
                Fit { reading, scale: Some(scale), scale_error, offset: mean_y - scale * mean_x, residual };
            return (is_explained || is_plain).then_some(fit);
        }
        let left: Vec<f64> = x.iter().zip(&y).map(|(x, y)| y - x).collect();
        let (offset, residual) = (mean_y - mean_x, spread(&left));
        is_plain.then_some(Fit { reading, scale: None, scale_error: 0.0, offset, residual })
    }

    /// Root mean square of the motion of the demonstrations in the channels of a unit.
    fn motion(&self, channel: &Channel) -> f64 {
        let of = |quantity: Quantity| -> Vec<f64> {
            let of_demo = |demo: &DemoSeries| -> Vec<f64> {
                (0..demo.steps.len()).filter_map(|now| demo.quantity(quantity, now, Timing::NONE)).collect()
            };
            self.demos.iter().flat_map(of_demo).collect()
        };
        let moved: Vec<f64> = match (channel.index, self.has_joints) {
            _ if channel.unit.name == CLOSURE.name => return spread(&of(Quantity::Closure)),
            (i, true) => of(Quantity::JointShift(i)),
            (0..3, false) => (0..3).map(Quantity::Shift).flat_map(of).collect(),
            (_, false) => (0..3).map(Quantity::Turn).flat_map(of).collect(),
        };
        mean(&moved.iter().map(|x| x * x).collect::<Vec<_>>()).unwrap_or(0.0).sqrt()
    }

    fn describe(&self, channel: &Channel, fit: &Fit) -> ChannelFit {
        let Fit { reading: Reading { quantity, form, timing, is_own }, scale, scale_error, offset, residual } =
            *fit;
        let unit = &channel.unit;
        let enlarged = scale.map_or(1.0, |scale| scale.abs().max(1.0));
        let (residual, motion) = (residual / enlarged, self.motion(channel));
        let agrees = |scale: f64| {
            let nearest = scale.clamp(*AGREEING_SCALES.start(), *AGREEING_SCALES.end());
            (scale - nearest).abs() <= SCALE_ERRORS * scale_error
        };
        let checks = [
            ("source", is_own),
            ("scale", scale.is_none_or(agrees)),
            ("offset", offset.abs() <= unit.offset * enlarged),
            ("rate", timing.rate == 1.0),
            ("lag", timing.lag.abs() <= AGREEING_LAG),
            ("residual", residual <= unit.residual.max(RESIDUAL_SHARE * motion)),
        ];
        let source = match (is_own, form) {
            (true, Form::Displaced) => channel.name.clone(),
            (false, Form::Displaced) if !self.is_step => format!("{} + {}", channel.name, quantity.name()),
            _ => quantity.name(),
        };
        ChannelFit {
            channel: channel.name.clone(),
            source,
            unit: unit.name,
            scale,
            offset,
            rate: timing.rate,
            lag: timing.lag,
            residual,
            motion,
            deviates: checks.into_iter().filter(|(_, agrees)| !agrees).map(|(name, _)| name).collect(),
        }
    }
}

fn spread(values: &[f64]) -> f64 {
    let center = mean(values).unwrap_or(0.0);
    mean(&values.iter().map(|x| (x - center).powi(2)).collect::<Vec<_>>()).unwrap_or(0.0).sqrt()
}
