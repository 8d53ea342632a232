//! Instances of a calibrated asset: limit and safe window of an object that differs from it in size, material and
//! surface.
//!
//! D, widths over the size, and forces over Young's modulus and the square of the size depend on the strain alone for a
//! linear elastic body. They are read off the press of the asset ([`Envelope::sweep`]). Two things add to that: the
//! pads keep their size and yield in series with the body. The calibration therefore also presses the asset at other
//! sizes and stiffnesses ([`Envelope::variants`]), and the ratio of each reading to that of the asset is interpolated
//! in size and in the logarithm of stiffness, independently.
//!
//! The loose end carries the weight: its force is that of the asset times weight over friction. The tight end is the
//! force at which the press leaves to the carried object what its weight adds to D. The two add as perpendicular
//! vectors do.

use serde::{Deserialize, Serialize};

use super::{
    calibration::{Envelope, SafeWindow, SweepRow},
    safety::{DeformationLimit, round_to_six_decimals},
};

/// Ratios of the properties of an object to those of its asset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceFactors {
    /// Factor on the size.
    pub scale: f64,
    /// Factor on Young's modulus.
    pub youngs: f64,
    /// Factor on the density.
    pub density: f64,
    /// Factor on the stable strain.
    pub strain: f64,
    /// Friction of object and pads over that of the calibration.
    pub friction: f64,
}

impl InstanceFactors {
    /// Factors of the asset itself.
    pub const NOMINAL: Self = Self { scale: 1.0, youngs: 1.0, density: 1.0, strain: 1.0, friction: 1.0 };
}

/// Press of an asset at another size and stiffness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariantSweep {
    /// Factor on the size.
    pub scale: f64,
    /// Factor on Young's modulus.
    pub youngs_factor: f64,
    /// Rows by decreasing width.
    pub rows: Vec<VariantSweepRow>,
}

/// One row of a [`VariantSweep`], as in [`SweepRow`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariantSweepRow {
    /// Width, mm.
    pub width_mm: f64,
    /// D at rest, %.
    pub d_pct: f64,
    /// Mean normal force per pad at rest, N.
    pub force_n: f64,
    /// Compressive strain that 95 % of the volume stays below.
    pub strain_p95: f64,
}

/// A grip at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripAtRest {
    /// Distance of the gels, m.
    pub width_m: f64,
    /// Force per pad, N.
    pub force_n: f64,
}

/// Safe window of an instance, from its loose to its tight end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceWindow {
    /// The loosest grip that holds.
    pub loose: GripAtRest,
    /// The tightest grip whose carried object stays within τ; equal to `loose` if none does.
    pub tight: GripAtRest,
    /// Distance of the gels at first contact, m.
    pub contact_m: f64,
    /// D that the weight of the carried object causes, over τ.
    pub carried: f64,
    /// τ of the instance, %.
    pub tau_pct: f64,
}

impl InstanceWindow {
    /// Force of the tight end over that of the loose end.
    pub fn ratio(&self) -> f64 {
        self.tight.force_n / self.loose.force_n
    }
}

/// Quantities of a press that are equal for all sizes and stiffnesses of a linear elastic body.
#[derive(Clone, Copy)]
enum Quantity {
    Strain,
    D,
    /// Force over Young's modulus and the square of the size, relative to the asset, N.
    Force,
    /// Width over the size, mm.
    Width,
}

/// One press in such quantities, by decreasing width.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
struct Curve {
    rows: Vec<VariantSweepRow>,
}

impl Curve {
    fn new(rows: impl Iterator<Item = VariantSweepRow>, scale: f64, youngs: f64) -> Self {
        let reduced = |row: VariantSweepRow| VariantSweepRow {
            width_mm: row.width_mm / scale,
            force_n: row.force_n / (youngs * scale * scale),
            ..row
        };
        Self { rows: rows.map(reduced).collect() }
    }

    /// The value of `wanted` where `given` first reaches `at`, linear between rows and along the first or
    /// last two beyond them.
    fn read(&self, wanted: Quantity, given: Quantity, at: f64) -> Option<f64> {
        let of = |row: &VariantSweepRow, quantity| match quantity {
            Quantity::Strain => row.strain_p95,
            Quantity::D => row.d_pct,
            Quantity::Force => row.force_n,
            Quantity::Width => row.width_mm,
        };
        let reached = self.rows.iter().position(|row| of(row, given) >= at).unwrap_or(self.rows.len());
        let after = reached.clamp(1, self.rows.len().checked_sub(1)?.max(1));
        let (low, high) = (self.rows.get(after - 1)?, self.rows.get(after)?);
        let rise = of(high, given) - of(low, given);
        let share = if rise > 0.0 { (at - of(low, given)) / rise } else { 1.0 };
        Some(of(low, wanted) + share * (of(high, wanted) - of(low, wanted)))
    }
}

/// The presses of an asset, for the readings of its instances.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct InstancePresses {
    /// Limit of the asset.
    limit: Option<DeformationLimit>,
    /// Stable strain of the asset; `None` if its press ended earlier.
    stable_strain: Option<f64>,
    /// Smallest peak D of the asset while it was carried, %.
    carried_d_pct: f64,
    width_contact_mm: Option<f64>,
    window: SafeWindow,
    nominal: Curve,
    /// At other sizes and nominal stiffness, by increasing size.
    sizes: Vec<(f64, Curve)>,
    /// At nominal size and other stiffnesses, by increasing stiffness.
    stiffnesses: Vec<(f64, Curve)>,
}

impl InstancePresses {
    /// The instances of an asset with this envelope, for limits of `kappa` times D_ref.
    pub fn new(envelope: &Envelope, kappa: f64) -> Self {
        let row = |row: &SweepRow| {
            let strain_p95 = row.strain_p95?;
            Some(VariantSweepRow {
                width_mm: row.width_mm,
                d_pct: row.d_pct,
                force_n: row.force_n,
                strain_p95,
            })
        };
        let stable = envelope.sweep.iter().filter(|row| row.stable);
        let variant =
            |sweep: &VariantSweep| Curve::new(sweep.rows.iter().copied(), sweep.scale, sweep.youngs_factor);
        let (mut nominal, mut sizes, mut stiffnesses) = (None, Vec::new(), Vec::new());
        for sweep in &envelope.variants {
            match (sweep.scale == 1.0, sweep.youngs_factor == 1.0) {
                (true, true) => nominal = Some(variant(sweep)),
                (_, true) => sizes.push((sweep.scale, variant(sweep))),
                (_, false) => stiffnesses.push((sweep.youngs_factor, variant(sweep))),
            }
        }
        for list in [&mut sizes, &mut stiffnesses] {
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        Self {
            limit: envelope.limit(kappa),
            stable_strain: envelope.stable_strain.filter(|_| envelope.censored.is_none()),
            carried_d_pct: envelope.carried_d_pct.unwrap_or(0.0),
            width_contact_mm: envelope.width_contact_mm,
            window: envelope.window,
            // The same press in finer steps, if there is one.
            nominal: nominal.unwrap_or_else(|| Curve::new(stable.filter_map(row), 1.0, 1.0)),
            sizes,
            stiffnesses,
        }
    }

    /// Limit of an instance: κ times D of the press in which 5 % of its volume reach its own stable strain. `None`
    /// without the rows of a press.
    pub fn limit(&self, factors: &InstanceFactors) -> Option<DeformationLimit> {
        let nominal = self.limit?;
        let Some(stable) = self.stable_strain else { return Some(nominal) };
        let at = |strain| self.reading(factors, |curve| curve.read(Quantity::D, Quantity::Strain, strain));
        let own = at(stable * factors.strain)?;
        // The reading of the asset itself is its D_ref.
        let same = self.nominal.read(Quantity::D, Quantity::Strain, stable)?;
        let d_ref_pct = round_to_six_decimals(nominal.d_ref_pct * own / same);
        Some(DeformationLimit { d_ref_pct, ..nominal })
    }

    /// Safe window of an instance; `None` if the asset has none.
    pub fn window(&self, factors: &InstanceFactors) -> Option<InstanceWindow> {
        self.window.extent_mm()?;
        let InstanceFactors { scale, youngs, density, friction, .. } = *factors;
        let (force_lower, width_at_tau) = (self.window.loose.force_n?, self.window.tight.width_mm?);
        let force_unit = youngs * scale * scale;
        let loose_n = force_lower * density * scale.powi(3) / friction;
        let tau = self.limit(factors)?.tau_pct();
        let nominal_tau = self.limit?.tau_pct();
        // An asset whose carried D exceeds τ at every width has the window of the press alone.
        let nominal_carried = self.carried_d_pct / nominal_tau;
        let nominal_carried = if nominal_carried < 1.0 { nominal_carried } else { 0.0 };
        let carried = nominal_carried * (nominal_tau / tau) * density * scale / youngs;
        // D of the press that is left to the nominal object is that at the tight end of its window.
        let pressed = self.nominal_d_at(width_at_tau)?;
        let left = ((1.0 - carried * carried) / (1.0 - nominal_carried * nominal_carried)).max(0.0).sqrt();
        let d_tight = pressed * (tau / nominal_tau) * left;
        let width_at = |force_n: f64| {
            let reduced = force_n / force_unit;
            self.reading(factors, |curve| curve.read(Quantity::Width, Quantity::Force, reduced))
        };
        let force_at = |d: f64| self.reading(factors, |curve| curve.read(Quantity::Force, Quantity::D, d));
        let grip = |force_n: f64| Some(GripAtRest { width_m: 1e-3 * scale * width_at(force_n)?, force_n });
        let loose = grip(loose_n)?;
        let tight_n = if left > 0.0 { force_unit * force_at(d_tight)? } else { 0.0 };
        let tight = if tight_n > loose_n { grip(tight_n)? } else { loose };
        let contact_m = 1e-3 * scale * self.width_contact_mm?;
        Some(InstanceWindow { loose, tight, contact_m, carried, tau_pct: tau })
    }

    /// D of the asset at a width between the gels, mm.
    fn nominal_d_at(&self, width_mm: f64) -> Option<f64> {
        let rows = &self.nominal.rows;
        let pair =
            rows.windows(2).find(|pair| pair[0].width_mm >= width_mm && pair[1].width_mm <= width_mm)?;
        let share =
            (pair[0].width_mm - width_mm) / (pair[0].width_mm - pair[1].width_mm).max(f64::MIN_POSITIVE);
        Some(pair[0].d_pct + share * (pair[1].d_pct - pair[0].d_pct))
    }

    /// A reading for an instance: that of the asset, times its relative change by size and by stiffness.
    fn reading(&self, factors: &InstanceFactors, read: impl Fn(&Curve) -> Option<f64>) -> Option<f64> {
        let nominal = read(&self.nominal)?;
        let change = |list: &[(f64, Curve)], at: f64, axis: fn(f64) -> f64| -> Option<f64> {
            let mut points = vec![(axis(1.0), 1.0)];
            for (factor, curve) in list {
                points.push((axis(*factor), read(curve)? / nominal));
            }
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            Some(piecewise_linear(&points, axis(at)))
        };
        let by_size = change(&self.sizes, factors.scale, |scale| scale)?;
        let by_stiffness = change(&self.stiffnesses, factors.youngs, f64::ln)?;
        Some(nominal * by_size * by_stiffness)
    }
}

/// The presses by which instances of an asset are drawn: those of its first calibration. Later ones do not change them,
/// so that a seed gives the same instances whatever the solver and the mesh.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawReference {
    /// Fingerprint of the asset without its mesh.
    pub object: String,
    /// Presses of the asset and of its variants.
    pub presses: InstancePresses,
}

/// Value at `x` between points by increasing x; that of the nearest end beyond them.
fn piecewise_linear(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.iter().position(|point| point.0 >= x).unwrap_or(points.len());
    match (after.checked_sub(1).and_then(|before| points.get(before)), points.get(after)) {
        (Some(low), Some(high)) => low.1 + (x - low.0) / (high.0 - low.0) * (high.1 - low.1),
        (Some(end), None) | (None, Some(end)) => end.1,
        (None, None) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{
        CalibrationMeasurements, HoldRow,
        tests::{hold, squeeze},
    };

    /// A press in which D, strain and force grow linearly with the indentation of a body of 50 mm.
    fn rows(scale: f64, youngs: f64, stiffening: f64) -> Vec<VariantSweepRow> {
        let row = |step: u32| {
            let indentation = f64::from(step);
            VariantSweepRow {
                width_mm: scale * (50.0 - indentation),
                d_pct: stiffening * indentation,
                force_n: youngs * scale * scale * indentation,
                strain_p95: 0.01 * indentation,
            }
        };
        (0..=10).map(row).collect()
    }

    fn envelope(variants: Vec<VariantSweep>) -> Envelope {
        let sweep = rows(1.0, 1.0, 1.0).into_iter().map(|row| {
            let VariantSweepRow { width_mm, d_pct, force_n, strain_p95 } = row;
            SweepRow { force_n, strain_p95: Some(strain_p95), ..squeeze(width_mm, d_pct, true) }
        });
        let holds = vec![hold(49.0, 5), HoldRow { d_peak_pct: Some(1.0), ..hold(48.0, 5) }];
        let scans = CalibrationMeasurements {
            stable_strain: Some(0.1),
            holds,
            sweep: sweep.collect(),
            variants,
            ..CalibrationMeasurements::default()
        };
        Envelope::new(scans, 0.5)
    }

    fn model(variants: Vec<VariantSweep>) -> InstancePresses {
        InstancePresses::new(&envelope(variants), 0.5)
    }

    fn near(value: f64, expected: f64) -> bool {
        (value / expected - 1.0).abs() < 1e-9
    }

    #[test]
    fn the_asset_itself_has_its_own_limit_and_window() {
        let (envelope, model) = (envelope(Vec::new()), model(Vec::new()));
        assert_eq!(model.limit(&InstanceFactors::NOMINAL), envelope.limit(0.5));
        let window = model.window(&InstanceFactors::NOMINAL).expect("calibrated");
        let stored = envelope.window;
        assert!(near(1e3 * window.loose.width_m, stored.loose.width_mm.unwrap()), "{window:?}");
        assert!(near(1e3 * window.tight.width_m, stored.tight.width_mm.unwrap()), "{window:?}");
        assert!(near(window.loose.force_n, stored.loose.force_n.unwrap()), "{window:?}");
        assert!(near(window.tight.force_n, stored.tight.force_n.unwrap()), "{window:?}");
        assert!(near(window.carried, 0.2), "1 % of 5 %");
    }

    #[test]
    fn forces_follow_stiffness_size_weight_and_friction() {
        let model = model(Vec::new());
        let of = |factors| model.window(&factors).expect("calibrated");
        let nominal = of(InstanceFactors::NOMINAL);
        let heavy = of(InstanceFactors { density: 2.0, friction: 0.5, ..InstanceFactors::NOMINAL });
        assert!(near(heavy.loose.force_n, 4.0 * nominal.loose.force_n));
        let left = |carried: f64| (1.0 - carried * carried).sqrt();
        assert!(near(heavy.tight.force_n / nominal.tight.force_n, left(0.4) / left(0.2)));
        let stiff = of(InstanceFactors { youngs: 2.0, ..InstanceFactors::NOMINAL });
        assert!(near(stiff.tight.force_n / nominal.tight.force_n, 2.0 * left(0.1) / left(0.2)));
        let stale = of(InstanceFactors { strain: 0.5, ..InstanceFactors::NOMINAL });
        assert!(near(stale.tau_pct, 2.5) && near(stale.carried, 0.4), "{stale:?}");
        assert!(near(stale.tight.force_n / nominal.tight.force_n, 0.5 * left(0.4) / left(0.2)));
        let large = of(InstanceFactors { scale: 1.1, ..InstanceFactors::NOMINAL });
        assert!(near(large.loose.force_n / nominal.loose.force_n, 1.1f64.powi(3)));
    }

    #[test]
    fn an_instance_that_no_grip_carries_has_an_empty_window() {
        let heavy = InstanceFactors { density: 100.0, ..InstanceFactors::NOMINAL };
        let window = model(Vec::new()).window(&heavy).expect("calibrated");
        assert_eq!((window.loose, window.ratio()), (window.tight, 1.0));
        assert!(window.carried > 1.0);
    }

    #[test]
    fn readings_are_interpolated_between_the_presses_of_variants() {
        let variant = |scale, youngs_factor, stiffening| VariantSweep {
            scale,
            youngs_factor,
            rows: rows(scale, youngs_factor, stiffening),
        };
        let model = model(vec![variant(0.8, 1.0, 1.2), variant(1.2, 1.0, 0.9), variant(1.0, 10.0, 1.1)]);
        let d_ref = |scale, youngs, strain| {
            let factors = InstanceFactors { scale, youngs, strain, ..InstanceFactors::NOMINAL };
            model.limit(&factors).expect("calibrated").d_ref_pct
        };
        assert_eq!(d_ref(1.0, 1.0, 1.0), 10.0);
        assert_eq!((d_ref(0.8, 1.0, 1.0), d_ref(0.9, 1.0, 1.0), d_ref(1.1, 1.0, 1.0)), (12.0, 11.0, 9.5));
        assert_eq!(
            (d_ref(1.0, 10f64.sqrt(), 0.5), d_ref(0.5, 1.0, 1.0)),
            (5.25, 12.0),
            "the nearest end beyond"
        );
        assert_eq!(d_ref(0.8, 10.0, 1.0), 13.2);
    }
}
