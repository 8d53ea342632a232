//! Threshold files: SoftVTBench's fields, and ours beside them.

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};

use super::{
    calibration::{self, Envelope},
    deformation::METRIC_ID,
    safety::{Limit, six_decimals},
};

/// The layout of the file.
pub const SCHEMA_VERSION: u32 = 1;
/// The protocol whose thresholds these are.
pub const PROTOCOL_ID: &str = "softvtbench-v1";
/// The only way of calibrating that counts.
pub const METHOD: &str = "compression_sweep";

/// Why a threshold file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ThresholdError {
    /// It cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is not the JSON expected.
    #[error("{path}: not a threshold file: {source}")]
    Json {
        /// The file.
        path: String,
        /// What is wrong and where.
        source: serde_json::Error,
    },
    /// A field says that these are other thresholds than ours.
    #[error("{path}: {field} is {got}, expected {expected}: calibrate the asset again")]
    Other {
        /// The file.
        path: String,
        /// The field.
        field: &'static str,
        /// What it says.
        got: String,
        /// What it should say.
        expected: String,
    },
    /// A number is out of range.
    #[error("{path}: thresholds.{asset}.{field} is {value}, expected {expected}")]
    Range {
        /// The file.
        path: String,
        /// The asset.
        asset: String,
        /// The field.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        expected: &'static str,
    },
}

/// How the thresholds were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Always [`METHOD`].
    pub method: String,
    /// In words.
    pub definition: String,
    /// Nominal κ.
    pub kappa: f64,
    /// Where the sweep rows are.
    pub sources: Vec<String>,
    /// What made the file; a time stamp in released files, a version in ours, so that a rerun makes the same bytes.
    pub generated_at: String,
}

/// One asset's threshold, % of the bounding-box diagonal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    /// τ = κ·D_ref.
    pub tau: f64,
    /// Largest stable D.
    pub d_ref: f64,
    /// κ.
    pub kappa: f64,
    /// Stable rows of the sweep.
    pub n_stable_trials: u32,
}

/// A threshold file, of one asset or of many.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// [`PROTOCOL_ID`].
    pub protocol_id: String,
    /// [`METRIC_ID`].
    pub metric_id: String,
    /// How they were found.
    pub calibration: Calibration,
    /// By asset.
    pub thresholds: BTreeMap<String, Threshold>,
    /// Ours: the envelope of each asset with its rows; absent in released files.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub envelopes: BTreeMap<String, Envelope>,
    /// Ours: what was calibrated, by asset ([`crate::scene::Asset::fingerprint`]); absent in released files.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub fingerprints: BTreeMap<String, String>,
}

impl Thresholds {
    /// A file without assets yet. `generated_at` says what made it; `sources` where the sweep rows are.
    pub fn new(kappa: f64, sources: Vec<String>, generated_at: String) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            protocol_id: PROTOCOL_ID.into(),
            metric_id: METRIC_ID.into(),
            calibration: Calibration {
                method: METHOD.into(),
                definition: "tau_o = kappa * max_stable_d_peak".into(),
                kappa,
                sources,
                generated_at,
            },
            thresholds: BTreeMap::new(),
            envelopes: BTreeMap::new(),
            fingerprints: BTreeMap::new(),
        }
    }

    /// Adds an asset's envelope, and its threshold if its sweep gives one; says whether it did.
    pub fn insert(&mut self, asset: &str, envelope: Envelope) -> bool {
        let limit = calibration::limit(&envelope.sweep, self.calibration.kappa);
        if let Some(limit) = limit {
            let stable = envelope.sweep.iter().filter(|row| row.stable).count();
            let threshold = Threshold {
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

    /// Takes over the assets of another file; those of the same name are replaced.
    pub fn merge(&mut self, other: Self) {
        self.thresholds.extend(other.thresholds);
        self.envelopes.extend(other.envelopes);
        self.fingerprints.extend(other.fingerprints);
        self.calibration.sources.extend(other.calibration.sources);
    }

    /// The limit of `asset`, if it is calibrated.
    pub fn limit(&self, asset: &str) -> Option<Limit> {
        self.thresholds.get(asset).map(|t| Limit { d_ref_pct: t.d_ref, kappa: t.kappa })
    }

    /// Reads the text of a threshold file; `path` names it in errors.
    ///
    /// # Errors
    /// Not JSON, another metric, protocol, schema or method, or numbers out of range.
    pub fn parse(text: &str, path: &str) -> Result<Self, ThresholdError> {
        let json = |source| ThresholdError::Json { path: path.into(), source };
        let value: serde_json::Value = serde_json::from_str(text).map_err(json)?;
        // Before the rest: a file of another metric should say so, not that some field is missing.
        if let Some(metric) = value.get("metric_id").and_then(|m| m.as_str()) {
            same(path, "metric_id", metric, METRIC_ID)?;
        }
        let file: Self = serde_json::from_value(value).map_err(json)?;
        file.check(path)?;
        Ok(file)
    }

    /// Reads a threshold file.
    ///
    /// # Errors
    /// As [`Thresholds::parse`], or the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, ThresholdError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|source| ThresholdError::Io { path: name.clone(), source })?;
        Self::parse(&text, &name)
    }

    /// The file's text: indented, one final newline, at most six decimals in thresholds.
    pub fn to_text(&self) -> String {
        format!("{:#}\n", serde_json::json!(self))
    }

    fn check(&self, path: &str) -> Result<(), ThresholdError> {
        if self.schema_version != SCHEMA_VERSION {
            let got = self.schema_version.to_string();
            return same(path, "schema_version", &got, &SCHEMA_VERSION.to_string());
        }
        same(path, "protocol_id", &self.protocol_id, PROTOCOL_ID)?;
        same(path, "metric_id", &self.metric_id, METRIC_ID)?;
        same(path, "calibration.method", &self.calibration.method, METHOD)?;
        self.thresholds.iter().try_for_each(|(asset, threshold)| threshold.check(path, asset))
    }
}

impl Threshold {
    fn check(&self, path: &str, asset: &str) -> Result<(), ThresholdError> {
        let range = |field, value, expected| {
            Err(ThresholdError::Range { path: path.into(), asset: asset.into(), field, value, expected })
        };
        if !(self.d_ref.is_finite() && self.d_ref > 0.0) {
            return range("d_ref", self.d_ref, "a positive percentage");
        }
        if !(self.kappa > 0.0 && self.kappa <= 1.0) {
            return range("kappa", self.kappa, "a share in 0..1, above 0");
        }
        // Released files round κ·D_ref after the product, so the last decimal may differ.
        if (self.tau - six_decimals(self.kappa * self.d_ref)).abs() > 1.5e-6 {
            return range("tau", self.tau, "kappa times d_ref");
        }
        Ok(())
    }
}

fn same(path: &str, field: &'static str, got: &str, expected: &str) -> Result<(), ThresholdError> {
    if got == expected {
        return Ok(());
    }
    Err(ThresholdError::Other {
        path: path.into(),
        field,
        got: format!("{got:?}"),
        expected: format!("{expected:?}"),
    })
}

#[cfg(test)]
mod tests {
    use super::super::calibration::tests::{hold, squeeze};
    use super::*;

    fn file() -> Thresholds {
        let mut file = Thresholds::new(0.5, vec!["sweep.jsonl".into()], "softvt".into());
        let sweep = vec![squeeze(0.3, 0.1, true), squeeze(0.4, 1.0 / 3.0, true), squeeze(0.5, 4.0, false)];
        assert!(file.insert("bun", Envelope::new(vec![hold(0.3, 5)], sweep, 0.5)));
        file
    }

    #[test]
    fn a_file_comes_back_as_written_with_six_decimals() {
        let file = file();
        let text = file.to_text();
        assert!(text.contains("\"d_ref\": 0.333333,") && text.contains("\"tau\": 0.166667,"), "{text}");
        assert_eq!(Thresholds::parse(&text, "bun.json").unwrap(), file);
        assert_eq!(file.limit("bun").unwrap().tau_pct(), 0.166667);
        assert_eq!(file.limit("bread"), None);
        assert_eq!(file.thresholds["bun"].n_stable_trials, 2);
    }

    #[test]
    fn a_released_file_without_envelopes_is_read() {
        let text = r#"{"schema_version":1,"protocol_id":"softvtbench-v1",
            "metric_id":"fem_rms_rigid_aligned_bbox_pct_v1","metric":"in words",
            "calibration":{"method":"compression_sweep","definition":"d","kappa":0.5,"sources":[],
            "generated_at":"2026-07-19T14:47:17Z"},
            "thresholds":{"soft_a":{"tau":1.179545,"d_ref":2.359091,"kappa":0.5,"n_stable_trials":16}}}"#;
        let file = Thresholds::parse(text, "released.json").unwrap();
        assert_eq!(file.limit("soft_a"), Some(Limit { d_ref_pct: 2.359091, kappa: 0.5 }));
    }

    #[test]
    fn another_metric_method_or_number_is_refused_by_name() {
        let text = file().to_text();
        let refused = |from: &str, to: &str| {
            Thresholds::parse(&text.replace(from, to), "bun.json").unwrap_err().to_string()
        };
        assert_eq!(
            refused(METRIC_ID, "raw_displacement"),
            format!(
                "bun.json: metric_id is \"raw_displacement\", expected \"{METRIC_ID}\": calibrate the asset again"
            )
        );
        assert!(
            refused(METHOD, "expert_demos").starts_with("bun.json: calibration.method is \"expert_demos\"")
        );
        assert!(refused("\"schema_version\": 1", "\"schema_version\": 2").contains("schema_version"));
        assert!(refused("0.166667", "0.3").contains("thresholds.bun.tau is 0.3"));
        assert!(refused("\"d_ref\": 0.333333", "\"d_ref\": -1").contains("thresholds.bun.d_ref is -1"));
        assert!(refused("{", "").contains("not a threshold file"));
        let missing = Thresholds::read(Path::new("/nowhere/bun.json")).unwrap_err().to_string();
        assert!(missing.starts_with("/nowhere/bun.json: "), "{missing}");
    }

    #[test]
    fn merging_gathers_assets_and_a_hopeless_sweep_gives_no_threshold() {
        let mut all = file();
        let mut other = Thresholds::new(0.5, vec![], "softvt".into());
        assert!(!other.insert("mush", Envelope::new(vec![], vec![squeeze(0.3, 1.0, false)], 0.5)));
        all.merge(other);
        assert_eq!(all.thresholds.len(), 1);
        assert_eq!(all.envelopes.keys().collect::<Vec<_>>(), ["bun", "mush"]);
    }
}
