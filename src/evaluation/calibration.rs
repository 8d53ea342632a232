//! Safe interaction envelope of an asset: from the width that just holds it to the width that deforms it by τ.
//!
//! Widths are measured between the apexes of the gels, forces per pad at rest. `softvt scripts/calibrate.lua` runs both
//! scans, by one of two protocols:
//!
//! - [`SweepProtocol::Press`], a press test of the object alone. D_ref is D at the widest press at which 5 % of the
//!   body's volume has a compressive strain beyond the material's *stable strain*, interpolated between two rows of the
//!   sweep. A sweep that ends earlier is *censored*: D_ref is then the largest stable D, a lower bound.
//! - [`SweepProtocol::Hand`], the sweep of SoftVTBench (appendix C.3) with the robot's hand: D_ref is the largest D of
//!   a stable squeeze.
//!
//! The loose end of the envelope is the widest width at which every hold trial held, down to the narrowest one tried.
//! The tight end is the widest width at which D reaches τ = κ·D_ref, in the sweep or in the hold trials: a carried
//! object also deforms by its weight. If D passes τ in every hold trial, the tight end is that of the sweep; the
//! carried D of the envelope is then above τ.

use serde::{Deserialize, Serialize};

use super::{
    instance::VariantSweep,
    safety::{DeformationLimit, round_to_six_decimals},
};

/// Exclusive lower bound of det F in a stable squeeze.
const MIN_DET_F: f64 = 0.1;
/// Exclusive upper bound of the node speed at rest after a stable squeeze, m/s.
const MAX_NODE_SPEED_M_S: f64 = 0.005;
/// Exclusive upper bound of the slip in a stable squeeze, mm.
const MAX_SLIP_MM: f64 = 2.0;
/// Smallest extent of a safe window, mm: the accuracy of its loose end.
const MIN_EXTENT_MM: f64 = 0.02;

/// Tool that squeezes the object in the sweep of a calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SweepProtocol {
    /// A press test of the object alone, up to the stable strain of its material.
    #[default]
    Press,
    /// Squeezes by the robot's hand, up to the largest stable deformation.
    Hand,
}

/// Hold trials at one width.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HoldRow {
    /// Width, mm.
    pub width_mm: f64,
    /// Commanded closure, 0 (open) to 1 (closed); only for the robot's hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closure: Option<f64>,
    /// Number of trials at this width.
    pub trials: u32,
    /// Number of trials that held without slip or drop.
    pub held: u32,
    /// Largest slip over the trials, mm.
    pub slip_mm: f64,
    /// Largest D over the trials, from the first contact to the end of the hold, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_peak_pct: Option<f64>,
}

impl HoldRow {
    /// True if the object was held in every trial; false without a trial.
    pub fn all_held(&self) -> bool {
        self.trials > 0 && self.held == self.trials
    }
}

/// Squeeze at one width of the compression sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRow {
    /// Width, mm.
    pub width_mm: f64,
    /// Commanded closure, 0 (open) to 1 (closed); only for the robot's hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closure: Option<f64>,
    /// D at rest in the press, peak D with the robot's hand, %.
    pub d_pct: f64,
    /// The same by SoftVTBench's definition of D, %; for its files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_v1_pct: Option<f64>,
    /// Mean normal force per pad at rest, N.
    pub force_n: f64,
    /// Compressive strain that 95 % of the volume stays below; only in the press.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain_p95: Option<f64>,
    /// Smallest det F over all Gauss points and steps.
    pub min_det_f: f64,
    /// Largest node speed over the observation window at rest, m/s.
    pub node_speed_m_s: f64,
    /// True if both pads touched at rest.
    pub both_pads: bool,
    /// Slip while squeezing, mm.
    pub slip_mm: f64,
    /// True if the squeeze counts for D_ref.
    pub stable: bool,
}

impl SweepRow {
    /// Reason why the squeeze is not stable; `None` if both pads touch, no element is nearly inverted, no node moves at
    /// rest and the object does not slip, within the bounds of this module. `stable` is not read. A squeeze with a
    /// number that is not finite is not stable.
    pub fn instability(&self) -> Option<&'static str> {
        // A value that is not a number is within no bound.
        let is_intact = self.min_det_f > MIN_DET_F;
        let is_at_rest = self.node_speed_m_s < MAX_NODE_SPEED_M_S;
        let is_held = self.slip_mm < MAX_SLIP_MM;
        if !self.both_pads {
            Some("a pad does not touch the object")
        } else if !(self.d_pct.is_finite() && self.strain_p95.is_none_or(f64::is_finite)) {
            Some("the deformation cannot be measured")
        } else if !is_intact {
            Some("an element is nearly inverted")
        } else if !is_at_rest {
            Some("the object does not come to rest")
        } else if !is_held {
            Some("the object slips out of the pads")
        } else {
            None
        }
    }
}

/// One end of the safe window of an asset. Its width is unknown if the scans do not reach it, its force also if the
/// sweep does not reach its width.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WindowEnd {
    /// Width between the gels, mm.
    pub width_mm: Option<f64>,
    /// Force per pad, N.
    pub force_n: Option<f64>,
}

/// Safe window of an asset: from the loose end, up to which friction holds it, to the tight end, at which D reaches τ.
/// The window of an instance is an [`InstanceWindow`](super::instance::InstanceWindow).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "StoredWindow", into = "StoredWindow")]
pub struct SafeWindow {
    /// The widest width at which every trial held.
    pub loose: WindowEnd,
    /// The widest width at which D reaches τ, pressed or carried.
    pub tight: WindowEnd,
}

impl SafeWindow {
    /// Extent of the window, mm; `None` if it is below 0.02 mm or an end is unknown.
    pub fn extent_mm(&self) -> Option<f64> {
        let extent = self.loose.width_mm? - self.tight.width_mm?;
        (extent >= MIN_EXTENT_MM).then_some(extent)
    }
}

/// The window in calibration files.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct StoredWindow {
    width_lower_mm: Option<f64>,
    width_at_tau_mm: Option<f64>,
    force_lower_n: Option<f64>,
    force_at_tau_n: Option<f64>,
}

impl From<StoredWindow> for SafeWindow {
    fn from(stored: StoredWindow) -> Self {
        Self {
            loose: WindowEnd { width_mm: stored.width_lower_mm, force_n: stored.force_lower_n },
            tight: WindowEnd { width_mm: stored.width_at_tau_mm, force_n: stored.force_at_tau_n },
        }
    }
}

impl From<SafeWindow> for StoredWindow {
    fn from(SafeWindow { loose, tight }: SafeWindow) -> Self {
        Self {
            width_lower_mm: loose.width_mm,
            width_at_tau_mm: tight.width_mm,
            force_lower_n: loose.force_n,
            force_at_tau_n: tight.force_n,
        }
    }
}

/// Measurements of a calibration, from which an [`Envelope`] follows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationMeasurements {
    /// Tool of the sweep.
    pub protocol: SweepProtocol,
    /// Stable strain of the material; `None` if it states no limit, and for the robot's hand.
    pub stable_strain: Option<f64>,
    /// Why the sweep ended, if its last row does not tell.
    pub ended: Option<String>,
    /// Hold trials, in any order.
    pub holds: Vec<HoldRow>,
    /// Compression sweep, in any order.
    pub sweep: Vec<SweepRow>,
    /// Presses at other sizes and stiffnesses.
    pub variants: Vec<VariantSweep>,
}

/// Envelope of an asset, with the rows it was computed from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Envelope {
    /// Tool of the sweep.
    pub protocol: SweepProtocol,
    /// Stable strain of the material: the smaller of its collapse and damage strain.
    pub stable_strain: Option<f64>,
    /// Why the sweep ended before the stable strain; null if it did not. D_ref is then a lower bound.
    pub censored: Option<String>,
    /// D_ref, %; null without a stable squeeze.
    pub d_ref_pct: Option<f64>,
    /// D_ref by SoftVTBench's definition of D, at the same width, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub d_ref_v1_pct: Option<f64>,
    /// Width at D_ref, mm.
    pub width_at_d_ref_mm: Option<f64>,
    /// Widest width at which both pads touched, mm.
    pub width_contact_mm: Option<f64>,
    /// Smallest peak D of the object while it was carried, over the widths at which every trial held, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carried_d_pct: Option<f64>,
    /// Window of safe widths and forces.
    pub window: SafeWindow,
    /// Hold trials, by decreasing width.
    pub holds: Vec<HoldRow>,
    /// Compression sweep, by decreasing width.
    pub sweep: Vec<SweepRow>,
    /// Presses at other sizes and stiffnesses, for the limits and windows of instances ([`super::instance`]).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub variants: Vec<VariantSweep>,
}

/// D_ref of a sweep, with its width.
struct Reference {
    d_pct: f64,
    d_v1_pct: Option<f64>,
    width_mm: f64,
}

impl Envelope {
    /// Sorts the rows by width and computes the bounds.
    pub fn new(scans: CalibrationMeasurements, kappa: f64) -> Self {
        let CalibrationMeasurements { protocol, stable_strain, ended, mut holds, mut sweep, variants } =
            scans;
        holds.sort_by(|a, b| b.width_mm.total_cmp(&a.width_mm));
        sweep.sort_by(|a, b| b.width_mm.total_cmp(&a.width_mm));
        let at_strain = stable_strain.and_then(|strain| reference_at_strain(&sweep, strain));
        let censored = match (protocol, &at_strain) {
            (SweepProtocol::Press, None) => {
                Some(ended.unwrap_or_else(|| reason_of_end(&sweep, stable_strain)))
            }
            (SweepProtocol::Press, Some(_)) | (SweepProtocol::Hand, _) => None,
        };
        let starts_beyond = protocol == SweepProtocol::Press && is_beyond(sweep.first(), stable_strain);
        let reference = at_strain.or_else(|| largest_stable(&sweep).filter(|_| !starts_beyond));
        let limit = reference.as_ref().and_then(|found| limit_of(found.d_pct, kappa));
        let end = |width_mm: Option<f64>| {
            let force_n = width_mm.and_then(|width| force_at(&sweep, width));
            WindowEnd { width_mm, force_n }
        };
        let tight_mm = limit.and_then(|limit| {
            let ends = [pressed_end(&sweep, limit.tau_pct()), carried_end(&holds, limit.tau_pct())];
            ends.into_iter().flatten().reduce(f64::max).map(round_to_six_decimals)
        });
        Self {
            protocol,
            stable_strain,
            censored,
            d_ref_pct: limit.map(|limit| limit.d_ref_pct),
            d_ref_v1_pct: reference.as_ref().and_then(|found| found.d_v1_pct).map(round_to_six_decimals),
            width_at_d_ref_mm: reference.map(|found| round_to_six_decimals(found.width_mm)),
            width_contact_mm: sweep.iter().find(|row| row.both_pads).map(|row| row.width_mm),
            carried_d_pct: carried(&holds)
                .map(|point| point.d_pct)
                .reduce(f64::min)
                .map(round_to_six_decimals),
            window: SafeWindow { loose: end(loose_end(&holds)), tight: end(tight_mm) },
            holds,
            sweep,
            variants,
        }
    }

    /// The envelope that follows from the rows of this one, of which those that are not
    /// [intact](SweepRow::instability) are not stable.
    pub fn recomputed(&self, kappa: f64) -> Self {
        let Self { protocol, stable_strain, censored, holds, sweep, variants, .. } = self.clone();
        let is_stable = |row: &SweepRow| row.stable && row.instability().is_none();
        let sweep = sweep.into_iter().map(|row| SweepRow { stable: is_stable(&row), ..row }).collect();
        Self::new(
            CalibrationMeasurements { protocol, stable_strain, ended: censored, holds, sweep, variants },
            kappa,
        )
    }

    /// True if D of the carried object passes τ at every width.
    pub fn exceeds_when_carried(&self, limit: DeformationLimit) -> bool {
        self.carried_d_pct.is_some_and(|d_pct| d_pct > limit.tau_pct())
    }

    /// Deformation limit τ = κ·D_ref; `None` without a stable squeeze.
    pub fn limit(&self, kappa: f64) -> Option<DeformationLimit> {
        limit_of(self.d_ref_pct?, kappa)
    }
}

fn limit_of(d_pct: f64, kappa: f64) -> Option<DeformationLimit> {
    let d_ref_pct = round_to_six_decimals(d_pct);
    (d_ref_pct > 0.0).then_some(DeformationLimit { d_ref_pct, kappa })
}

/// D at which the 95th percentile of the strain reaches `strain`, linear between two stable rows. `None` if no stable
/// row reaches it, or the row before it is not stable.
fn reference_at_strain(sweep: &[SweepRow], strain: f64) -> Option<Reference> {
    let reached = sweep.iter().position(|row| row.strain_p95.is_some_and(|p95| p95 >= strain))?;
    let (before, after) = (sweep.get(reached.checked_sub(1)?)?, &sweep[reached]);
    if !(before.stable && after.stable) {
        return None;
    }
    let (low, high) = (before.strain_p95?, after.strain_p95?);
    let share = if high > low { (strain - low) / (high - low) } else { 1.0 };
    let between = |from: f64, to: f64| from + share * (to - from);
    Some(Reference {
        d_pct: between(before.d_pct, after.d_pct),
        d_v1_pct: before.d_v1_pct.zip(after.d_v1_pct).map(|(from, to)| between(from, to)),
        width_mm: between(before.width_mm, after.width_mm),
    })
}

/// The stable row with the largest D.
fn largest_stable(sweep: &[SweepRow]) -> Option<Reference> {
    let stable = sweep.iter().filter(|row| row.stable && row.d_pct.is_finite());
    let largest = stable.max_by(|a, b| a.d_pct.total_cmp(&b.d_pct))?;
    Some(Reference { d_pct: largest.d_pct, d_v1_pct: largest.d_v1_pct, width_mm: largest.width_mm })
}

/// True if 5 % of the volume is beyond the stable strain in a row.
fn is_beyond(row: Option<&SweepRow>, stable_strain: Option<f64>) -> bool {
    let strains = row.and_then(|row| row.strain_p95).zip(stable_strain);
    strains.is_some_and(|(p95, strain)| p95 >= strain)
}

fn reason_of_end(sweep: &[SweepRow], stable_strain: Option<f64>) -> String {
    if is_beyond(sweep.first(), stable_strain) {
        return "5 % of the volume is beyond the stable strain before the pads touch".to_owned();
    }
    let last = sweep.last().and_then(SweepRow::instability);
    let default = match stable_strain {
        Some(_) => "the sweep ended before the stable strain",
        None => "the material states no collapse_strain",
    };
    last.unwrap_or(default).to_owned()
}

/// Narrowest run of widths at which every trial held: its widest width. `None` if trials failed at the narrowest one.
fn loose_end(holds: &[HoldRow]) -> Option<f64> {
    let held = holds.iter().rev().take_while(|row| row.all_held());
    held.last().map(|row| row.width_mm)
}

/// A width with the D measured there.
#[derive(Clone, Copy)]
struct Point {
    width_mm: f64,
    d_pct: f64,
}

/// Width between two points at which D is `d_pct`, linear.
fn width_between(wide: Point, narrow: Point, d_pct: f64) -> f64 {
    let rise = narrow.d_pct - wide.d_pct;
    let share = if rise > 0.0 { (d_pct - wide.d_pct) / rise } else { 0.0 };
    wide.width_mm + share * (narrow.width_mm - wide.width_mm)
}

/// Width at which D of the press first reaches `d_pct`; `sweep` by decreasing width. `None` if the first row is above
/// it or no row reaches it.
fn pressed_end(sweep: &[SweepRow], d_pct: f64) -> Option<f64> {
    let points: Vec<_> = sweep.iter().map(|row| Point { width_mm: row.width_mm, d_pct: row.d_pct }).collect();
    let pair = points.windows(2).find(|pair| pair[0].d_pct <= d_pct && pair[1].d_pct >= d_pct)?;
    Some(width_between(pair[0], pair[1], d_pct))
}

/// Peak D of the object while it was carried, at the widths at which every trial held.
fn carried(holds: &[HoldRow]) -> impl Iterator<Item = Point> {
    let held = holds.iter().filter(|row| row.all_held());
    held.filter_map(|row| Some(Point { width_mm: row.width_mm, d_pct: row.d_peak_pct? }))
}

/// Width below which the peak D of the carried object is above `d_pct`; `holds` by decreasing width. `None` if it is so
/// at no width or at every width.
fn carried_end(holds: &[HoldRow], d_pct: f64) -> Option<f64> {
    let points: Vec<_> = carried(holds).collect();
    points.last().filter(|narrowest| narrowest.d_pct > d_pct)?;
    let pair = points.windows(2).rev().find(|pair| pair[0].d_pct <= d_pct)?;
    Some(width_between(pair[0], pair[1], d_pct))
}

/// Force per pad at a width in N, to six decimals, linear between the rows; `sweep` by decreasing width. `None`
/// outside of the sweep.
pub fn force_at(sweep: &[SweepRow], width_mm: f64) -> Option<f64> {
    sweep.windows(2).find(|pair| pair[0].width_mm >= width_mm && pair[1].width_mm <= width_mm).map(|pair| {
        let step = pair[0].width_mm - pair[1].width_mm;
        let share = if step > 0.0 { (pair[0].width_mm - width_mm) / step } else { 0.0 };
        round_to_six_decimals(pair[0].force_n + share * (pair[1].force_n - pair[0].force_n))
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn hold(width_mm: f64, held: u32) -> HoldRow {
        HoldRow { width_mm, closure: None, trials: 5, held, slip_mm: 0.1, d_peak_pct: None }
    }

    /// A squeeze from 50 mm, with a strain of a tenth of D.
    pub(crate) fn squeeze(width_mm: f64, d_pct: f64, stable: bool) -> SweepRow {
        SweepRow {
            width_mm,
            closure: None,
            d_pct,
            d_v1_pct: Some(1.2 * d_pct),
            force_n: 0.5 * (50.0 - width_mm),
            strain_p95: Some(0.1 * d_pct),
            min_det_f: 0.6,
            node_speed_m_s: 1e-4,
            both_pads: true,
            slip_mm: 0.0,
            stable,
        }
    }

    /// A press test of an object 50 mm wide that reaches its stable strain of 0.3 at 44.5 mm, and holds from
    /// `lower` on.
    pub(crate) fn scans(lower: f64) -> CalibrationMeasurements {
        let holds = [49.0, 48.0, 47.0, 46.0].map(|width| hold(width, if width <= lower { 5 } else { 2 }));
        let sweep = vec![
            squeeze(50.0, 0.0, true),
            squeeze(48.0, 1.0, true),
            squeeze(46.0, 2.0, true),
            squeeze(44.0, 10.0 / 3.0, true),
        ];
        CalibrationMeasurements {
            stable_strain: Some(0.3),
            holds: holds.into(),
            sweep,
            ..CalibrationMeasurements::default()
        }
    }

    #[test]
    fn the_reference_is_interpolated_where_the_strain_reaches_the_stable_strain() {
        let envelope = Envelope::new(scans(48.0), 0.5);
        assert_eq!((envelope.d_ref_pct, envelope.d_ref_v1_pct), (Some(3.0), Some(3.6)));
        assert!((envelope.width_at_d_ref_mm.unwrap() - 44.5).abs() < 1e-12);
        assert_eq!(envelope.censored, None);
        let window = envelope.window;
        assert_eq!((window.loose.width_mm, window.tight.width_mm), (Some(48.0), Some(47.0)));
        assert_eq!((window.loose.force_n, window.tight.force_n), (Some(1.0), Some(1.5)));
        assert_eq!((window.extent_mm(), envelope.width_contact_mm), (Some(1.0), Some(50.0)));
    }

    #[test]
    fn a_sweep_that_ends_before_the_stable_strain_is_censored_with_its_reason() {
        let reason = |change: &dyn Fn(&mut CalibrationMeasurements)| {
            let mut scans = scans(48.0);
            change(&mut scans);
            let envelope = Envelope::new(scans, 0.5);
            (envelope.censored.unwrap_or_default(), envelope.d_ref_pct)
        };
        let unrest = reason(&|scans| {
            (scans.sweep[3].stable, scans.sweep[3].node_speed_m_s) = (false, 0.1);
        });
        assert_eq!(unrest, ("the object does not come to rest".into(), Some(2.0)));
        let short = reason(&|scans| scans.sweep.truncate(3));
        assert_eq!(short, ("the sweep ended before the stable strain".into(), Some(2.0)));
        let told = reason(&|scans| (scans.sweep.pop(), scans.ended = Some("inverted".into())).1);
        assert_eq!(told.0, "inverted");
        let collapsed = reason(&|scans| scans.sweep[0].strain_p95 = Some(0.4));
        assert_eq!(
            collapsed,
            ("5 % of the volume is beyond the stable strain before the pads touch".into(), None)
        );
        let nameless = reason(&|scans| scans.stable_strain = None);
        assert_eq!(nameless.0, "the material states no collapse_strain");
        let hand = reason(&|scans| (scans.protocol, scans.stable_strain) = (SweepProtocol::Hand, None));
        assert_eq!(hand, (String::new(), Some(3.333333)), "the hand's D_ref is its largest stable D");
    }

    #[test]
    fn the_loose_end_is_above_no_width_at_which_a_trial_failed() {
        let lower = |holds: Vec<HoldRow>| {
            Envelope::new(CalibrationMeasurements { holds, ..scans(48.0) }, 0.5).window.loose.width_mm
        };
        assert_eq!(lower(vec![hold(47.0, 5), hold(49.0, 5), hold(48.0, 4)]), Some(47.0));
        assert_eq!(lower(vec![hold(47.0, 4), hold(48.0, 5)]), None);
        assert_eq!(lower(vec![]), None);
    }

    #[test]
    fn the_tight_end_is_where_the_carried_object_reaches_the_limit_if_that_is_wider() {
        let tight = |d_at_47: f64| {
            let carried = |width, d| HoldRow { d_peak_pct: Some(d), ..hold(width, 5) };
            let holds = vec![carried(47.0, d_at_47), carried(48.0, 1.1), carried(49.0, 0.7)];
            Envelope::new(CalibrationMeasurements { holds, ..scans(48.0) }, 0.5)
                .window
                .tight
                .width_mm
                .unwrap()
        };
        // τ is 1.5 %, which the sweep reaches at 47 mm.
        assert!((tight(1.9) - 47.5).abs() < 1e-12);
        assert!((tight(1.4) - 47.0).abs() < 1e-12);
        let above = HoldRow { d_peak_pct: Some(1.6), ..hold(48.0, 5) };
        let heavy = Envelope::new(CalibrationMeasurements { holds: vec![above], ..scans(48.0) }, 0.5);
        assert_eq!(heavy.window.tight.width_mm, Some(47.0), "the tight end of the sweep");
        assert_eq!(heavy.carried_d_pct, Some(1.6));
        assert!(heavy.exceeds_when_carried(heavy.limit(0.5).unwrap()));
    }

    #[test]
    fn an_envelope_whose_ends_have_crossed_has_no_extent() {
        let envelope = Envelope::new(scans(46.0), 0.5);
        assert_eq!((envelope.window.loose.width_mm, envelope.window.extent_mm()), (Some(46.0), None));
        let extent = |tight| {
            let end = |width| WindowEnd { width_mm: Some(width), force_n: None };
            SafeWindow { loose: end(47.0), tight: end(tight) }.extent_mm()
        };
        assert_eq!((extent(46.99), extent(46.5)), (None, Some(0.5)), "an extent below the accuracy");
        let none = Envelope::new(
            CalibrationMeasurements { sweep: vec![squeeze(49.0, 1.0, false)], ..scans(48.0) },
            0.5,
        );
        assert_eq!((none.d_ref_pct, none.window.tight.width_mm, none.limit(0.5)), (None, None, None));
    }

    #[test]
    fn every_criterion_of_stability_counts() {
        let row = squeeze(40.0, 1.0, false);
        assert_eq!(row.instability(), None);
        for bad in [
            SweepRow { min_det_f: 0.1, ..row.clone() },
            SweepRow { min_det_f: f64::NAN, ..row.clone() },
            SweepRow { node_speed_m_s: 0.005, ..row.clone() },
            SweepRow { both_pads: false, ..row.clone() },
            SweepRow { slip_mm: 2.0, ..row.clone() },
            SweepRow { d_pct: f64::NAN, ..row.clone() },
        ] {
            assert!(bad.instability().is_some(), "{bad:?}");
        }
    }
}
