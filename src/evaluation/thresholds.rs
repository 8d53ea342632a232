//! Threshold files: τ and D_ref per asset, as JSON with the fields of SoftVTBench and some of our own.
//!
//! A file holds one asset (`assets/calibration/*.json`) or many. [`ThresholdFile::released`] is the file of
//! SoftVTBench's scorer (`softvtbench/` of a run), of version 1 of the layout and of SoftVTBench's definition of D. Its
//! limits hold for no other D.

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{
    calibration::{Envelope, SweepProtocol},
    deformation::{METRIC_ID, V1_METRIC_ID},
    safety::{DeformationLimit, round_to_six_decimals},
};

/// Version of the file layout.
pub const SCHEMA_VERSION: u32 = 2;
/// Version of released SoftVTBench files, and of the files in `softvtbench/` of a run.
pub const RELEASED_SCHEMA_VERSION: u32 = 1;
/// Benchmark protocol that the thresholds belong to.
pub const PROTOCOL_ID: &str = "softvtbench-v1";
/// The only calibration method that is accepted.
pub const METHOD: &str = "compression_sweep";
/// Differences of results from those of their rows that rounding to six decimals explains, relative to 1.
const ROUNDING: f64 = 1.5e-6;

/// A threshold file cannot be used. The text names the file and the value at fault.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct ThresholdError {
    path: String,
    problem: String,
}

/// Provenance of the thresholds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationInfo {
    /// Always [`METHOD`].
    pub method: String,
    /// Tool of the sweep; absent in released files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub protocol: Option<SweepProtocol>,
    /// Definition of τ in words.
    pub definition: String,
    /// κ of the benchmark, the share of D_ref that is allowed.
    pub kappa: f64,
    /// Files with the sweep rows.
    pub sources: Vec<String>,
    /// Time stamp in released files; version of softvt in ours, so that a rerun writes the same bytes.
    pub generated_at: String,
}

/// Threshold of one asset, % of the bounding-box diagonal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssetThreshold {
    /// τ = κ·D_ref.
    pub tau: f64,
    /// Reference deformation D_ref of the sweep.
    pub d_ref: f64,
    /// Share of D_ref that is allowed.
    pub kappa: f64,
    /// Number of stable rows of the sweep.
    pub n_stable_trials: u32,
}

/// Definition of τ, and that of files with several κ or protocols.
const DEFINITION: &str = "tau_o = kappa * d_ref";
const MIXED_DEFINITION: &str = "tau_o = kappa_o * d_ref_o, with kappa and protocol of each asset";

/// Contents of a threshold file, of one asset or many.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThresholdFile {
    /// [`SCHEMA_VERSION`], or [`RELEASED_SCHEMA_VERSION`] without envelopes.
    pub schema_version: u32,
    /// Must be [`PROTOCOL_ID`].
    pub protocol_id: String,
    /// [`METRIC_ID`], or [`V1_METRIC_ID`] in released files.
    pub metric_id: String,
    /// Provenance of the thresholds.
    pub calibration: CalibrationInfo,
    /// Thresholds by name of the asset.
    pub thresholds: BTreeMap<String, AssetThreshold>,
    /// Envelope of each asset with its rows; absent in released files.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub envelopes: BTreeMap<String, Envelope>,
    /// Fingerprint of each calibrated asset, a hash of its mechanical properties; absent in released files.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub fingerprints: BTreeMap<String, String>,
}

impl ThresholdFile {
    /// File without assets. `sources` are the files with the sweep rows; `generated_at` as in [`CalibrationInfo`].
    pub fn new(kappa: f64, sources: Vec<String>, generated_at: String) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            protocol_id: PROTOCOL_ID.into(),
            metric_id: METRIC_ID.into(),
            calibration: CalibrationInfo {
                method: METHOD.into(),
                protocol: None,
                definition: DEFINITION.into(),
                kappa,
                sources,
                generated_at,
            },
            thresholds: BTreeMap::new(),
            envelopes: BTreeMap::new(),
            fingerprints: BTreeMap::new(),
        }
    }

    /// The same file, of assets that were calibrated by `protocol`.
    pub fn measured_by(mut self, protocol: SweepProtocol) -> Self {
        let definition = match protocol {
            SweepProtocol::Press => "tau_o = kappa * d at which 5 % of the volume passes the stable strain",
            SweepProtocol::Hand => "tau_o = kappa * max_stable_d_peak",
        };
        (self.calibration.protocol, self.calibration.definition) = (Some(protocol), definition.into());
        self
    }

    /// Adds the envelope of an asset, and its threshold if the sweep gives one. Returns true if it does.
    pub fn insert(&mut self, asset: &str, envelope: Envelope) -> bool {
        let limit = envelope.limit(self.calibration.kappa);
        if let Some(limit) = limit {
            let stable = envelope.sweep.iter().filter(|row| row.stable).count();
            let threshold = AssetThreshold {
                tau: limit.tau_pct(),
                d_ref: limit.d_ref_pct,
                kappa: limit.kappa,
                n_stable_trials: stable as u32,
            };
            self.thresholds.insert(asset.into(), threshold);
        }
        self.envelopes.insert(asset.into(), envelope);
        limit.is_some()
    }

    /// Adds the assets of another file; assets of the same name are replaced. An empty file takes over how the other
    /// was calibrated; κ and protocol of files that differ are those of each asset.
    pub fn merge(&mut self, other: Self) {
        let CalibrationInfo { protocol, definition, kappa, .. } = &mut self.calibration;
        let theirs = &other.calibration;
        if self.envelopes.is_empty() && self.thresholds.is_empty() {
            (*protocol, *kappa) = (theirs.protocol, theirs.kappa);
            definition.clone_from(&theirs.definition);
        } else if (*protocol, &*definition, *kappa) != (theirs.protocol, &theirs.definition, theirs.kappa) {
            *protocol = None;
            *definition = MIXED_DEFINITION.into();
        }
        self.thresholds.extend(other.thresholds);
        self.envelopes.extend(other.envelopes);
        self.fingerprints.extend(other.fingerprints);
        self.calibration.sources.extend(other.calibration.sources);
    }

    /// The same in the layout of SoftVTBench, with limits on its D. Assets without one are left out.
    pub fn released(&self) -> Self {
        let threshold = |(asset, ours): (&String, &AssetThreshold)| {
            let limit = self.v1_limit(asset)?;
            let (tau, d_ref) = (limit.tau_pct(), limit.d_ref_pct);
            Some((asset.clone(), AssetThreshold { tau, d_ref, ..ours.clone() }))
        };
        Self {
            schema_version: RELEASED_SCHEMA_VERSION,
            metric_id: V1_METRIC_ID.into(),
            calibration: CalibrationInfo { protocol: None, ..self.calibration.clone() },
            thresholds: self.thresholds.iter().filter_map(threshold).collect(),
            envelopes: BTreeMap::new(),
            ..self.clone()
        }
    }

    /// Deformation limit of `asset`, if it is calibrated.
    pub fn limit(&self, asset: &str) -> Option<DeformationLimit> {
        self.thresholds.get(asset).map(|t| DeformationLimit { d_ref_pct: t.d_ref, kappa: t.kappa })
    }

    /// Limit of `asset` on D of SoftVTBench's definition, if it is calibrated: it ends at the same width.
    pub fn v1_limit(&self, asset: &str) -> Option<DeformationLimit> {
        let d_ref_pct = self.envelopes.get(asset)?.d_ref_v1_pct?;
        self.thresholds.get(asset).map(|t| DeformationLimit { d_ref_pct, kappa: t.kappa })
    }

    /// Parses the text of a threshold file; `path` names it in errors.
    ///
    /// # Errors
    /// Invalid JSON, another metric, protocol, schema or method, numbers out of range, or limits and windows that do
    /// not follow from the rows of the file.
    pub fn parse(text: &str, path: &str) -> Result<Self, ThresholdError> {
        let file = Self::parse_built_in(text, path)?;
        file.check_rows(path)?;
        Ok(file)
    }

    /// As [`ThresholdFile::parse`], for a file that the binary contains: its rows are not compared.
    ///
    /// # Errors
    /// As [`ThresholdFile::parse`].
    pub fn parse_built_in(text: &str, path: &str) -> Result<Self, ThresholdError> {
        Self::parse_as(text, path, METRIC_ID, SCHEMA_VERSION)
    }

    fn parse_as(
        text: &str,
        path: &str,
        metric_id: &str,
        schema_version: u32,
    ) -> Result<Self, ThresholdError> {
        let refuse = |problem: String| ThresholdError { path: path.into(), problem };
        let invalid = |error: serde_json::Error| refuse(format!("not a threshold file: {error}"));
        let value: Value = serde_json::from_str(text).map_err(invalid)?;
        // First of all: for a file of another metric the error should say that, not that some field is missing.
        let expected = [
            ("metric_id", json!(metric_id)),
            ("schema_version", json!(schema_version)),
            ("protocol_id", json!(PROTOCOL_ID)),
            ("calibration.method", json!(METHOD)),
        ];
        for (field, expected) in expected {
            let got = value.pointer(&format!("/{}", field.replace('.', "/")));
            if let Some(got) = got.filter(|got| **got != expected) {
                let problem = format!("{field} is {got}, expected {expected}: calibrate the asset again");
                return Err(refuse(problem));
            }
        }
        let file: Self = serde_json::from_value(value).map_err(invalid)?;
        let problem =
            |(asset, of): (&String, &AssetThreshold)| Some(format!("thresholds.{asset}.{}", of.problem()?));
        file.thresholds.iter().find_map(problem).map_or(Ok(file), |problem| Err(refuse(problem)))
    }

    /// Reads a file of [`ThresholdFile::released`].
    ///
    /// # Errors
    /// As [`ThresholdFile::parse`], or the file cannot be read.
    pub fn read_released(path: &Path) -> Result<Self, ThresholdError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|error| ThresholdError { path: name.clone(), problem: error.to_string() })?;
        Self::parse_as(&text, &name, V1_METRIC_ID, RELEASED_SCHEMA_VERSION)
    }

    /// Text of the file: indented JSON with a final newline, thresholds with at most six decimals.
    pub fn to_text(&self) -> String {
        format!("{:#}\n", json!(self))
    }

    /// Checks that limits and windows are those that follow from the rows.
    fn check_rows(&self, path: &str) -> Result<(), ThresholdError> {
        let mut computed = Self { thresholds: BTreeMap::new(), envelopes: BTreeMap::new(), ..self.clone() };
        for (asset, envelope) in &self.envelopes {
            computed.calibration.kappa =
                self.thresholds.get(asset).map_or(self.calibration.kappa, |own| own.kappa);
            computed.insert(asset, envelope.recomputed(computed.calibration.kappa));
        }
        let results = |file: &Self| json!({ "thresholds": file.thresholds, "envelopes": file.envelopes });
        let Some((field, stated, computed)) = first_difference(&results(self), &results(&computed)) else {
            return Ok(());
        };
        let problem = format!(
            "{field} is {stated}, and the rows of its sweep and hold trials give {computed}: calibrate the asset again"
        );
        Err(ThresholdError { path: path.into(), problem })
    }
}

/// The first value in which two documents differ by more than rounding: its path, and both values.
fn first_difference(a: &Value, b: &Value) -> Option<(String, Value, Value)> {
    let entries = |value: &Value| -> BTreeMap<String, Value> {
        let fields = value.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone()));
        let items = value.as_array().into_iter().flatten().enumerate();
        fields.chain(items.map(|(at, value)| (at.to_string(), value.clone()))).collect()
    };
    if let Some((x, y)) = a.as_f64().zip(b.as_f64()) {
        let is_rounding = (x - y).abs() <= ROUNDING * (1.0 + y.abs());
        return (!is_rounding).then(|| (String::new(), a.clone(), b.clone()));
    }
    let (own, other) = (entries(a), entries(b));
    if own.is_empty() || other.is_empty() {
        return (a != b).then(|| (String::new(), a.clone(), b.clone()));
    }
    own.keys().chain(other.keys()).find_map(|key| {
        let of = |entries: &BTreeMap<String, Value>| entries.get(key).cloned().unwrap_or_default();
        let (path, x, y) = first_difference(&of(&own), &of(&other))?;
        Some((if path.is_empty() { key.clone() } else { format!("{key}.{path}") }, x, y))
    })
}

impl AssetThreshold {
    /// The field with a value out of range, that value, and what is expected.
    fn problem(&self) -> Option<String> {
        let Self { tau, d_ref, kappa, n_stable_trials } = *self;
        let fields = [
            ("d_ref", d_ref, d_ref.is_finite() && d_ref > 0.0, "a positive percentage"),
            ("kappa", kappa, kappa > 0.0 && kappa <= 1.0, "a share in 0..1, above 0"),
            // Released files round κ·D_ref after the product, so the last decimal may differ.
            ("tau", tau, (tau - round_to_six_decimals(kappa * d_ref)).abs() <= 1.5e-6, "kappa times d_ref"),
            // D_ref is the largest D of a stable squeeze, so without one it does not exist.
            ("n_stable_trials", f64::from(n_stable_trials), n_stable_trials > 0, "at least 1"),
        ];
        let (field, value, _, expected) = fields.into_iter().find(|(_, _, is_valid, _)| !is_valid)?;
        Some(format!("{field} is {value}, expected {expected}"))
    }
}

/// `<asset>.sweep.jsonl`: the sweep rows of an asset in the fields of SoftVTBench's sweeps, and more: `d_peak` is D of
/// its definition, `d_pct` the scored one. `closure` is the commanded one of the robot's hand, 0 open and 1 closed; in
/// SoftVTBench's files it is the opening, 1 open and 0 closed.
pub fn sweep_jsonl(asset: &str, envelope: &Envelope) -> String {
    let rows = envelope.sweep.iter().enumerate().map(|(level, row)| {
        json!({
            "asset": asset,
            "level": level,
            "gripper_width_mm": row.width_mm,
            "closure": row.closure,
            "d_peak": row.d_v1_pct,
            "d_pct": row.d_pct,
            "force_n": row.force_n,
            "strain_p95": row.strain_p95,
            "stable": row.stable,
        })
    });
    rows.map(|row| format!("{row}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::super::calibration::{
        CalibrationMeasurements,
        tests::{hold, squeeze},
    };
    use super::*;

    fn file() -> ThresholdFile {
        let mut file = ThresholdFile::new(0.5, vec!["sweep.jsonl".into()], "softvt".into())
            .measured_by(SweepProtocol::Hand);
        let sweep = vec![squeeze(48.0, 0.1, true), squeeze(47.0, 1.0 / 3.0, true), squeeze(46.0, 4.0, false)];
        let scans = CalibrationMeasurements {
            protocol: SweepProtocol::Hand,
            holds: vec![hold(48.0, 5)],
            sweep,
            ..CalibrationMeasurements::default()
        };
        assert!(file.insert("bun", Envelope::new(scans, 0.5)));
        file
    }

    #[test]
    fn a_file_is_read_as_written_with_six_decimals() {
        let file = file();
        let text = file.to_text();
        assert!(text.contains("\"d_ref\": 0.333333,") && text.contains("\"tau\": 0.166667,"), "{text}");
        assert_eq!(ThresholdFile::parse(&text, "bun.json").unwrap(), file);
        assert_eq!(file.limit("bun").unwrap().tau_pct(), 0.166667);
        assert_eq!(file.limit("bread"), None);
        assert_eq!(file.thresholds["bun"].n_stable_trials, 2);
    }

    #[test]
    fn another_metric_method_or_number_is_refused_by_name() {
        let text = file().to_text();
        let refused = |from: &str, to: &str| {
            ThresholdFile::parse(&text.replace(from, to), "bun.json").unwrap_err().to_string()
        };
        for (from, to, message) in [
            (METRIC_ID, "raw_displacement", "metric_id is \"raw_displacement\", expected \""),
            (METHOD, "expert_demos", "calibration.method is \"expert_demos\""),
            ("\"schema_version\": 2", "\"schema_version\": 3", "schema_version is 3"),
            ("\"schema_version\": 2", "\"schema_version\": 1", "expected 2: calibrate the asset again"),
            ("0.166667", "0.3", "thresholds.bun.tau is 0.3"),
            ("\"d_ref\": 0.333333", "\"d_ref\": -1", "thresholds.bun.d_ref is -1"),
            ("\"n_stable_trials\": 2", "\"n_stable_trials\": 0", "n_stable_trials is 0"),
            ("{", "", "not a threshold file"),
        ] {
            let found = refused(from, to);
            assert!(found.starts_with("bun.json: ") && found.contains(message), "{found}");
        }
        let missing = ThresholdFile::read_released(Path::new("/nowhere/bun.json")).unwrap_err().to_string();
        assert!(missing.starts_with("/nowhere/bun.json: "), "{missing}");
    }

    #[test]
    fn a_file_whose_limits_do_not_follow_from_its_rows_is_refused() {
        let refused = |change: &dyn Fn(&mut ThresholdFile)| {
            let mut file = file();
            change(&mut file);
            ThresholdFile::parse(&file.to_text(), "bun.json")
                .map_or_else(|e| e.to_string(), |_| String::new())
        };
        assert_eq!(refused(&|_| ()), "");
        let loosened = refused(&|file| {
            let bun = file.thresholds.get_mut("bun").unwrap();
            (bun.tau, bun.d_ref) = (5.0, 10.0);
            file.envelopes.get_mut("bun").unwrap().d_ref_pct = Some(10.0);
        });
        assert_eq!(
            loosened,
            "bun.json: envelopes.bun.d_ref_pct is 10.0, and the rows of its sweep and hold trials give 0.333333: calibrate \
             the asset again"
        );
        let limit = refused(&|file| file.thresholds.get_mut("bun").unwrap().n_stable_trials = 7);
        assert!(limit.contains("thresholds.bun.n_stable_trials is 7, and the rows"), "{limit}");
        let window = refused(&|file| {
            file.envelopes.get_mut("bun").unwrap().window.tight.width_mm = Some(40.0);
        });
        assert!(window.contains("envelopes.bun.window.width_at_tau_mm is 40.0"), "{window}");
        let unstable = refused(&|file| file.envelopes.get_mut("bun").unwrap().sweep[1].min_det_f = 0.05);
        assert!(unstable.contains("envelopes.bun.d_ref_pct is 0.333333"), "{unstable}");
        let rows = refused(&|file| file.envelopes.clear());
        assert!(rows.contains("bun.json: thresholds is {\"bun\":"), "{rows}");
    }

    #[test]
    fn merging_collects_assets_and_an_unstable_sweep_gives_no_threshold() {
        let mut all = file();
        let mut other = ThresholdFile::new(0.5, vec![], "softvt".into());
        let scans = CalibrationMeasurements {
            sweep: vec![squeeze(48.0, 1.0, false)],
            ..CalibrationMeasurements::default()
        };
        assert!(!other.insert("mush", Envelope::new(scans, 0.5)));
        all.merge(other);
        assert_eq!(all.thresholds.len(), 1);
        assert_eq!(all.envelopes.keys().collect::<Vec<_>>(), ["bun", "mush"]);
        assert_eq!(all.calibration.definition, MIXED_DEFINITION, "of another κ");
        let mut copy = ThresholdFile::new(0.9, vec![], "softvt".into());
        copy.merge(file());
        assert_eq!((copy.calibration.kappa, copy.calibration.protocol), (0.5, file().calibration.protocol));
    }

    #[test]
    fn the_released_file_has_its_limits_on_the_d_of_softvtbench() {
        let released = file().released();
        let text = released.to_text();
        assert!(!text.contains("envelopes") && !text.contains("protocol\":"), "{text}");
        let (bun, limit) = (&released.thresholds["bun"], file().v1_limit("bun").unwrap());
        assert_eq!((bun.d_ref, bun.tau, limit.tau_pct()), (0.4, 0.2, 0.2));
        let refused = ThresholdFile::parse(&text, "thresholds.json").unwrap_err().to_string();
        assert!(refused.starts_with(&format!("thresholds.json: metric_id is {V1_METRIC_ID:?}")), "{refused}");
        assert_eq!(
            ThresholdFile::parse_as(&text, "thresholds.json", V1_METRIC_ID, RELEASED_SCHEMA_VERSION).unwrap(),
            released
        );
    }

    #[test]
    fn sweep_rows_never_turn_the_closure_round() {
        let mut envelope = file().envelopes["bun"].clone();
        envelope.sweep[0].closure = Some(0.4);
        let rows: Vec<serde_json::Value> =
            sweep_jsonl("bun", &envelope).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!((&rows[0]["closure"], &rows[0]["gripper_width_mm"]), (&0.4.into(), &48.0.into()));
        assert!(rows[1]["closure"].is_null());
    }
}
