//! The safe interaction envelope: results of a calibration from its rows.

use mlua::{Lua, LuaSerdeExt, Value};
use serde::de::DeserializeOwned;

use super::assets::STRAIN;
use crate::{
    schema::{Range, Type, Unchecked, choice, functions, output},
    vm::{
        error::{app_data, fail},
        json::deserialize,
        library::{FoundFile, SharedLibrary},
        privilege::check_privilege,
    },
};
use softvt_common::parallel::lock;
use softvt_evaluation::{
    calibration::{Envelope, HoldRow, Protocol, SafeWindow, Scans, SweepRow, force_at},
    envelope_plot::{plot, three_lines},
    safety::DeformationLimit,
    thresholds::{ThresholdFile, sweep_jsonl},
};

/// Type of a list of rows.
const ROWS: Type = Type::List(&Type::Map(&Type::Any));

output! {
    /// The safe window of an object. An end is nil if the scans do not reach it.
    fn window_table(lua, window: &SafeWindow) -> "softvt.SafeWindow" as "window" {
        /// Loose end: the widest width between the gels at which every hold trial held, mm.
        width_lower_mm: "number?" = window.width_lower_mm;
        /// Tight end: the widest width at which the deformation reaches τ, pressed or carried, mm.
        width_at_tau_mm: "number?" = window.width_at_tau_mm;
        /// Force per pad at the loose end, N.
        force_lower_n: "number?" = window.force_lower_n;
        /// Force per pad at the tight end, N.
        force_at_tau_n: "number?" = window.force_at_tau_n;
        /// Extent of the window, mm; nil if it is empty.
        extent_mm: "number?" = window.extent_mm();
    }
}

output! {
    /// Results of a calibration.
    fn envelope_table(lua, asset: &str, envelope: &Envelope, file: &ThresholdFile) -> "softvt.Envelope" as "envelope" {
        /// Protocol: "press" or "hand".
        protocol: "string" = lua.to_value(&envelope.protocol)?;
        /// The safe window.
        window: "softvt.SafeWindow" = window_table(lua, &envelope.window)?;
        /// Widest width at which both pads touched, mm.
        width_contact_mm: "number?" = envelope.width_contact_mm;
        /// Width at D_ref, mm.
        width_at_d_ref_mm: "number?" = envelope.width_at_d_ref_mm;
        /// Deformation limit τ, %.
        tau: "number?" = limit(envelope, file).map(|limit| limit.tau_pct());
        /// Reference deformation D_ref, %.
        d_ref: "number?" = envelope.d_ref_pct;
        /// Smallest peak deformation of the object while it was carried in a hold trial, %.
        carried_d: "number?" = envelope.carried_d_pct;
        /// Stable strain of the material.
        stable_strain: "number?" = envelope.stable_strain;
        /// Why the sweep ended before the stable strain; nil if it did not.
        censored: "string?" = envelope.censored.as_deref();
        /// The envelope in three lines.
        text: "string" = three_lines(asset, envelope, limit(envelope, file));
        /// A plot of deformation over width as SVG.
        plot: "string" = plot(asset, envelope, limit(envelope, file));
        /// The rows of the sweep as JSON lines.
        sweep: "string" = sweep_jsonl(asset, envelope);
        /// The calibration file as JSON text.
        json: "string" = file.to_text();
        /// The same as a table.
        table: "table" = lua.to_value(file)?;
    }
}

fn limit(envelope: &Envelope, file: &ThresholdFile) -> Option<DeformationLimit> {
    envelope.limit(file.calibration.kappa)
}

/// Reads a list of rows. An empty table is an empty list.
fn rows<T: DeserializeOwned>(lua: &Lua, label: &str, value: &Value) -> mlua::Result<Vec<T>> {
    match value {
        Value::Table(table) if table.is_empty() => Ok(Vec::new()),
        value => deserialize(lua, label, value),
    }
}

choice! { Protocol { "press" => Press, "hand" => Hand } }

functions! {
    FUNCTIONS {
        /// Returns the results of a calibration: the safe window, the deformation limit τ, and the files to write.
        fn envelope(lua) takes spec "softvt.EnvelopeSpec" {
            /// Name of the asset.
            asset: String = Type::Name;
            /// Protocol by which the rows were measured.
            protocol: Protocol => Text("press");
            /// Safety factor κ of the deformation limit τ = κ D_ref.
            kappa: f64 = Type::Number("", Range::closed(0.0, 1.0)) => Number(0.5);
            /// Stable strain of the material, at which 5 % of the volume ends the press.
            stable_strain: Option<f64> = STRAIN;
            /// Why the sweep ended, if its last row does not tell.
            ended: Option<String>;
            /// Fingerprint of the calibrated asset, as softvt.fingerprint returns it. Results for another object of that
            /// name then do not use the calibration.
            fingerprint: Option<String>;
            /// Rows width_mm, closure, trials, held, slip_mm, d_peak_pct of the scan for the loose end.
            holds: Value = ROWS;
            /// Rows width_mm, closure, d_pct, force_n, strain_p95, min_det_f, node_speed_m_s, both_pads, slip_mm, stable
            /// of the compression sweep.
            sweep: Value = ROWS;
        } -> ["softvt.Envelope"] {
            let holds: Vec<HoldRow> = rows(lua, "softvt.envelope: holds", &holds)?;
            let sweep: Vec<SweepRow> = rows(lua, "softvt.envelope: sweep", &sweep)?;
            let envelope = Envelope::new(Scans { protocol, stable_strain, ended, holds, sweep }, kappa);
            let made_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
            let mut file = ThresholdFile::new(kappa, vec![format!("{asset}.sweep.jsonl")], made_by)
                .measured_by(protocol);
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
            row.instability().is_none()
        }
        /// Returns the force per pad (N) at a width (mm), linear between the rows of a compression sweep by decreasing
        /// width; nil outside of the sweep.
        fn force_at(lua, sweep: Unchecked = ROWS, width_mm: f64 = Type::Number("mm", Range::closed(0.0, 1000.0))) -> ["number?"] {
            force_at(&rows::<SweepRow>(lua, "softvt.force_at", &sweep.0)?, width_mm)
        }
    }
}
