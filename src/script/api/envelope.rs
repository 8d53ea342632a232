//! The safe interaction envelope: results of a calibration from its rows.

use mlua::{LuaSerdeExt, Value};

use crate::{
    schema::{Range, Type, Unchecked, functions, output},
    vm::{
        error::{app_data, fail},
        json::deserialize,
        library::{FoundFile, SharedLibrary},
        privilege::check_privilege,
    },
};
use softvt_common::parallel::lock;
use softvt_evaluation::{
    calibration::{self, Envelope, HoldRow, SweepRow},
    envelope_plot::plot,
    safety::DeformationLimit,
    thresholds::{ThresholdFile, sweep_jsonl},
};

/// Type of a list of rows.
const ROWS: Type = Type::List(&Type::Map(&Type::Any));

output! {
    /// Results of a calibration.
    fn envelope_table(lua, asset: &str, envelope: &Envelope, file: &ThresholdFile) -> "softvt.Envelope" as "envelope" {
        /// Smallest closure that holds the object.
        lower: "number?" = envelope.closure_lower;
        /// Closure at which the deformation reaches τ.
        closure_at_tau: "number?" = envelope.closure_at_tau;
        /// True if the lower bound is below closure_at_tau.
        safe_window: "boolean" = envelope.has_safe_window();
        /// Deformation limit τ, %.
        tau: "number?" = limit(envelope, file).map(|limit| limit.tau_pct());
        /// Largest stable deformation D_ref, %.
        d_ref: "number?" = limit(envelope, file).map(|limit| limit.d_ref_pct);
        /// A plot of deformation over closure as text.
        text: "string" = plot(asset, envelope, limit(envelope, file));
        /// The rows of the sweep as JSON lines.
        sweep: "string" = sweep_jsonl(asset, envelope);
        /// The calibration file as JSON text.
        json: "string" = file.to_text();
        /// The same as a table.
        table: "table" = lua.to_value(file)?;
    }
}

fn limit(envelope: &Envelope, file: &ThresholdFile) -> Option<DeformationLimit> {
    calibration::deformation_limit(&envelope.sweep, file.calibration.kappa)
}

functions! {
    FUNCTIONS {
        /// Returns the results of a calibration: the lower bound of closure, the deformation limit τ, and the files to write.
        fn envelope(lua) takes spec "softvt.EnvelopeSpec" {
            /// Name of the asset.
            asset: String = Type::Name;
            /// Safety factor κ of the deformation limit τ = κ D_ref.
            kappa: f64 = Type::Number("", Range::closed(0.0, 1.0)) => Number(0.5);
            /// Fingerprint of the calibrated asset, as simulation:measure returns it. Results for another object of that
            /// name then do not use the calibration.
            fingerprint: Option<String>;
            /// Rows closure, trials, held, slip_mm, d_peak_pct of the scan for the lower bound.
            holds: Value = ROWS;
            /// Rows closure, gripper_width_mm, d_peak_pct, force_n, min_det_f, node_speed_m_s, both_pads, slip_mm, stable
            /// of the compression sweep.
            sweep: Value = ROWS;
        } -> ["softvt.Envelope"] {
            let holds: Vec<HoldRow> = deserialize(lua, "softvt.envelope: holds", &holds)?;
            let sweep: Vec<SweepRow> = deserialize(lua, "softvt.envelope: sweep", &sweep)?;
            let envelope = Envelope::new(holds, sweep, kappa);
            let made_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
            let mut file = ThresholdFile::new(kappa, vec![format!("{asset}.sweep.jsonl")], made_by);
            file.insert(&asset, envelope.clone());
            if let Some(fingerprint) = fingerprint {
                file.fingerprints.insert(asset.clone(), fingerprint);
            }
            envelope_table(lua, &asset, &envelope, &file)?
        }
        /// Returns the content of assets/calibration/<asset>.json as softvt.envelope does; nil if there is no such file.
        fn calibration(lua, asset: String = Type::Name) -> ["softvt.Envelope?"] {
            let label = "softvt.calibration";
            check_privilege(lua, label)?;
            let path = format!("assets/calibration/{asset}.json");
            let library = app_data::<SharedLibrary>(lua)?;
            let found = lock(&library).optional_data(&path);
            match found.map_err(|e| fail(lua, format!("{label}: {e}")))? {
                None => None,
                Some(FoundFile { name: path, bytes }) => {
                    let file = ThresholdFile::parse(&String::from_utf8_lossy(&bytes), &path)
                        .map_err(|e| fail(lua, format!("{label}: {e}")))?;
                    let Some(envelope) = file.envelopes.get(&asset) else {
                        let message = format!("{label}: {path} has no rows of {asset}; calibrate it again");
                        return Err(fail(lua, message));
                    };
                    Some(envelope_table(lua, &asset, envelope, &file)?)
                }
            }
        }
        /// Returns true if a row of a compression sweep is a stable squeeze.
        fn stable(lua, row: Unchecked = Type::Table("table")) -> ["boolean"] {
            let row: SweepRow = deserialize(lua, "softvt.stable", &row.0)?;
            row.meets_criteria()
        }
    }
}
