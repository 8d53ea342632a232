//! The safe interaction envelope: results of a calibration from its rows, and the windows of instances.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use mlua::{Lua, LuaSerdeExt, Table, Value};
use serde::de::DeserializeOwned;

use super::{
    assets::{AssetSpec, STRAIN},
    envelope_plot::envelope_plot,
    scene::COATING,
};
use crate::{
    schema::{Constructed, Range, Type, Unchecked, ValidationError, choice, functions, output},
    vm::{
        error::{app_data, fail},
        json::deserialize,
        library::{FoundFile, LibraryError, SharedLibrary, embedded},
        privilege::check_privilege,
    },
};
use softvt_benchmark::variation::{DrawPresses, VariationError, VariationRanges};
use softvt_common::parallel::lock;
use softvt_evaluation::{
    calibration::{
        CalibrationMeasurements, Envelope, HoldRow, SafeWindow, SweepProtocol, SweepRow, WindowEnd, force_at,
    },
    envelope_text::summary_text,
    instance::{DrawReference, GripAtRest, InstanceFactors, InstancePresses, InstanceWindow, VariantSweep},
    safety::DeformationLimit,
    thresholds::{ThresholdFile, sweep_jsonl},
};
use softvt_geometry::Vec3;
use softvt_robot::spec::PadSpec;
use softvt_rollout::AssetCache;
use softvt_scene::{Asset, HiddenProperties, LENGTH_HINT, ObjectVariation};

pub(crate) const MAX_SAMPLE: f64 = 10_000.0;
const FACTOR: Type = Type::Number("", Range::POSITIVE);

/// Calibrations by asset, as far as a virtual machine has read them.
#[derive(Clone, Default)]
pub(crate) struct CalibratedAssets(Arc<Mutex<BTreeMap<String, Option<CalibratedAsset>>>>);

#[derive(Clone)]
pub(crate) struct CalibratedAsset {
    /// Limits and windows of its instances.
    pub presses: Arc<InstancePresses>,
    fingerprint: Option<String>,
}

/// The calibration of an asset, read once per virtual machine; `None` if it has none.
pub(crate) fn calibrated_asset(lua: &Lua, asset: &str) -> mlua::Result<Option<CalibratedAsset>> {
    let assets = app_data::<CalibratedAssets>(lua)?;
    if let Some(known) = lock(&assets.0).get(asset) {
        return Ok(known.clone());
    }
    let found = calibration_file(lua, "softvt.grip_window", asset)?.and_then(|(_, file)| {
        let presses = Arc::new(presses_of(&file, asset)?);
        Some(CalibratedAsset { presses, fingerprint: file.fingerprints.get(asset).cloned() })
    });
    lock(&assets.0).insert(asset.to_owned(), found.clone());
    Ok(found)
}

fn presses_of(file: &ThresholdFile, asset: &str) -> Option<InstancePresses> {
    Some(InstancePresses::new(file.envelopes.get(asset)?, file.calibration.kappa))
}

fn reference_path(asset: &str) -> String {
    format!("assets/draws/{asset}.json")
}

/// The presses by which instances of an asset are drawn; `None` without a file of them for this object.
fn draw_reference(lua: &Lua, asset: &Asset) -> mlua::Result<Option<InstancePresses>> {
    let wrong = |error: String| fail!(lua, "asset {:?}: {error}", asset.name);
    let library = app_data::<SharedLibrary>(lua)?;
    let found = lock(&library).optional_data(&reference_path(&asset.name));
    let Some(FoundFile { name, bytes }) = found.map_err(|error| wrong(error.to_string()))? else {
        return Ok(None);
    };
    let file: DrawReference = serde_json::from_slice(&bytes)
        .map_err(|error| wrong(format!("{name}: not a draw reference: {error}; remove it and calibrate")))?;
    Ok((file.object == asset.object_fingerprint()).then_some(file.presses))
}

/// The presses by which instances of an asset are drawn and those by which their windows are stated.
pub(crate) fn draw_presses(lua: &Lua, asset: &Asset) -> Result<Option<DrawPresses>, VariationError> {
    let find = || -> mlua::Result<Option<DrawPresses>> {
        // A calibration of another version of the asset does not count, as for its limit.
        let fits = |found: &CalibratedAsset| {
            found.fingerprint.as_ref().is_none_or(|known| *known == asset.fingerprint())
        };
        let Some(found) = calibrated_asset(lua, &asset.name)?.filter(fits) else { return Ok(None) };
        let presses = |reference| DrawPresses { reference: Arc::new(reference), calibrated: found.presses };
        Ok(draw_reference(lua, asset)?.map(presses))
    };
    find().map_err(|error| VariationError::NoInstance(error.to_string()))
}

/// Draws `count` instances of an asset as the suite does; see [`VariationRanges::sample_instances`].
pub(crate) fn sample(
    lua: &Lua,
    suite: &str,
    ranges: Option<&VariationRanges>,
    asset: &Asset,
    count: u32,
) -> mlua::Result<Vec<Table>> {
    let size = app_data::<AssetCache>(lua)?.bounds(&asset.shape).size();
    let state = |drawn: Option<&ObjectVariation>| instance_state(lua, &Instance { asset, size, drawn });
    let Some(ranges) = ranges else { return (0..count).map(|_| state(None)).collect() };
    let drawn = ranges.sample_instances(suite, asset, count, &|asset| draw_presses(lua, asset));
    drawn.map_err(|error| fail(lua, error))?.iter().map(|one| state(Some(one))).collect()
}

/// An instance by what it differs in from its asset.
pub(crate) struct Instance<'a> {
    asset: &'a Asset,
    /// Edge lengths of the bounding box of the asset, m.
    size: Vec3,
    drawn: Option<&'a ObjectVariation>,
}

impl Instance<'_> {
    /// A factor of the draw; 1 for the asset itself.
    fn factor(&self, of: impl Fn(&ObjectVariation) -> f64) -> f64 {
        self.drawn.map_or(1.0, of)
    }

    fn hidden(&self) -> Option<HiddenProperties> {
        self.drawn?.hidden
    }
}

output! {
    /// An instance of an asset, with the fields that a grasp needs of an object.
    fn instance_state(lua, instance: &Instance<'_>) -> "softvt.InstanceState" as "instance" {
        /// Name of its asset.
        asset: "string" = instance.asset.name.as_str();
        /// Edge lengths of its bounding box at rest, m.
        size: "number[]" = lua.create_sequence_from((instance.size * instance.factor(|one| one.scale)).iter().copied())?;
        /// Size relative to that of its asset.
        scale: "number" = instance.factor(|one| one.scale);
        /// Young's modulus relative to that of its asset.
        youngs_factor: "number" = instance.factor(|one| one.youngs_factor);
        /// Density relative to that of its asset.
        density_factor: "number" = instance.factor(|one| one.density_factor);
        /// Stable strain relative to that of its asset.
        strain_factor: "number" = instance.hidden().map_or(1.0, |hidden| hidden.strain_factor);
        /// Static friction of its coating; nil without one.
        coating: "number?" = instance.hidden().map(|hidden| hidden.coating);
        /// Number of draws until an instance could be kept.
        draws: "integer" = instance.hidden().map_or(1, |hidden| hidden.draws);
        /// Numbers of its asset for experts, as those of an object.
        hints: "table<string, number>" = lua.create_table_from(instance.asset.hints.iter().map(|(name, value)| {
            let factor = if name.ends_with(LENGTH_HINT) { instance.factor(|one| one.scale) } else { 1.0 };
            (name.as_str(), factor * value)
        }))?;
    }
}

fn calibration_path(asset: &str) -> String {
    format!("assets/calibration/{asset}.json")
}

/// Finds the calibration and the draw reference of an asset, so that the episodes of the script have them. An asset
/// that is made during an episode has none unless they were found before.
pub(crate) fn find_calibration(lua: &Lua, asset: &str) -> Result<(), ValidationError> {
    let library = app_data::<SharedLibrary>(lua)?;
    for path in [calibration_path(asset), reference_path(asset)] {
        match lock(&library).optional_data(&path) {
            Ok(_) | Err(LibraryError::Late(_)) => {}
            Err(error) => return Err(ValidationError::new(error).inside("name")),
        }
    }
    Ok(())
}

/// Reads assets/calibration/<asset>.json; returns its path as messages show it and its content.
fn calibration_file(lua: &Lua, label: &str, asset: &str) -> mlua::Result<Option<(String, ThresholdFile)>> {
    let library = app_data::<SharedLibrary>(lua)?;
    let found =
        lock(&library).optional_data(&calibration_path(asset)).map_err(|e| fail!(lua, "{label}: {e}"))?;
    let Some(FoundFile { name: path, bytes }) = found else { return Ok(None) };
    // Every virtual machine reads the files; comparing the rows takes most of that time.
    let is_built_in = embedded(&calibration_path(asset)).is_some_and(|own| own == &bytes[..]);
    let parse = if is_built_in { ThresholdFile::parse_built_in } else { ThresholdFile::parse };
    let file = parse(&String::from_utf8_lossy(&bytes), &path).map_err(|e| fail!(lua, "{label}: {e}"))?;
    Ok(Some((path, file)))
}

const ROWS: Type = Type::List(&Type::Map(&Type::Any));

output! {
    /// One end of the safe window of an asset.
    fn window_end_table(lua, end: &WindowEnd) -> "softvt.WindowEnd" as "window end" {
        /// Width between the gels, mm; nil if the scans do not reach it.
        width_mm: "number?" = end.width_mm;
        /// Force per pad, N; nil if the sweep does not reach the width.
        force_n: "number?" = end.force_n;
    }
    /// The safe window of an asset.
    fn window_table(lua, window: &SafeWindow) -> "softvt.SafeWindow" as "window" {
        /// Loose end: the widest width at which every hold trial held.
        loose: "softvt.WindowEnd" = window_end_table(lua, &window.loose)?;
        /// Tight end: the widest width at which the deformation reaches τ, pressed or carried.
        tight: "softvt.WindowEnd" = window_end_table(lua, &window.tight)?;
        /// Extent of the window, mm; nil if it is empty.
        extent_mm: "number?" = window.extent_mm();
    }
    /// Results of a calibration.
    fn envelope_table(lua, asset: &str, envelope: &Envelope, file: &ThresholdFile) -> "softvt.Envelope" as "envelope" {
        /// Protocol of the sweep: "press" or "hand".
        protocol: "string" = lua.to_value(&envelope.protocol)?;
        /// Loose and tight end of the safe window.
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
        text: "string" = summary_text(asset, envelope, limit(envelope, file));
        /// A plot of deformation over width as SVG.
        plot: "string" = envelope_plot(asset, envelope, limit(envelope, file));
        /// The rows of the sweep as JSON lines.
        sweep: "string" = sweep_jsonl(asset, envelope);
        /// The calibration file as JSON text.
        json: "string" = file.to_text();
        /// The same as a table.
        table: "table" = lua.to_value(file)?;
    }
    /// A grip at rest.
    fn grip_table(lua, grip: &GripAtRest) -> "softvt.Grip" as "grip" {
        /// Distance of the gels, m.
        width: "number" = grip.width_m;
        /// Normal force per pad, N.
        force: "number" = grip.force_n;
    }
    /// The safe window of an instance.
    fn instance_window_table(lua, window: &InstanceWindow) -> "softvt.InstanceWindow" as "window" {
        /// The loosest grip that holds.
        loose: "softvt.Grip" = grip_table(lua, &window.loose)?;
        /// The tightest grip whose carried object stays within τ; that of the loose end if none does.
        tight: "softvt.Grip" = grip_table(lua, &window.tight)?;
        /// Distance of the gels at first contact, m.
        contact: "number" = window.contact_m;
        /// D that the weight of the carried object causes, as a share of τ.
        carried: "number" = window.carried;
        /// Deformation limit τ of the instance, %.
        tau: "number" = window.tau_pct;
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

choice! { SweepProtocol { "press" => Press, "hand" => Hand } }

functions! {
    FUNCTIONS {
        /// Returns the results of a calibration: the safe window, the deformation limit τ, and the files to write.
        fn envelope(lua) takes spec "softvt.EnvelopeSpec" {
            /// Name of the asset.
            asset: String = Type::Name;
            /// Protocol of the sweep.
            protocol: SweepProtocol => Text("press");
            /// Safety factor κ of the deformation limit τ = κ D_ref.
            kappa: f64 = Type::Number("", Range::closed(0.0, 1.0)) => Number(0.5);
            /// Stable strain of the material, at which 5 % of the volume ends the press.
            stable_strain: Option<f64> = STRAIN;
            /// Why the sweep ended, if its last row does not tell.
            ended: Option<String>;
            /// Fingerprint of the calibrated asset, as softvt.fingerprint returns it. Results for another object of
            /// that name then do not use the calibration.
            fingerprint: Option<String>;
            /// Rows width_mm, closure, trials, held, slip_mm, d_peak_pct of the scan for the loose end.
            holds: Value = ROWS;
            /// Rows width_mm, closure, d_pct, d_v1_pct, force_n, strain_p95, min_det_f, node_speed_m_s, both_pads,
            /// slip_mm, stable of the compression sweep.
            sweep: Value = ROWS;
            /// Presses at other sizes and stiffnesses: { scale, youngs_factor, rows }, with the rows width_mm, d_pct,
            /// force_n, strain_p95.
            variants: Value = ROWS => Empty;
        } -> ["softvt.Envelope"] {
            let holds: Vec<HoldRow> = rows(lua, "softvt.envelope: holds", &holds)?;
            let sweep: Vec<SweepRow> = rows(lua, "softvt.envelope: sweep", &sweep)?;
            let variants: Vec<VariantSweep> = rows(lua, "softvt.envelope: variants", &variants)?;
            let scans = CalibrationMeasurements { protocol, stable_strain, ended, holds, sweep, variants };
            let envelope = Envelope::new(scans, kappa);
            let made_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
            let mut file = ThresholdFile::new(kappa, vec![format!("{asset}.sweep.jsonl")], made_by)
                .measured_by(protocol);
            file.insert(&asset, envelope.clone());
            if let Some(fingerprint) = fingerprint {
                file.fingerprints.insert(asset.clone(), fingerprint);
            }
            envelope_table(lua, &asset, &envelope, &file)?
        }
        /// Returns the content of assets/calibration/<asset>.json as softvt.envelope does; nil if there
        /// is no such file.
        fn calibration(lua, asset: String = Type::Name) -> ["softvt.Envelope?"] {
            let label = "softvt.calibration";
            check_privilege(lua, label)?;
            match calibration_file(lua, label, &asset)? {
                None => None,
                Some((path, file)) => {
                    let Some(envelope) = file.envelopes.get(&asset) else {
                        bail!(lua, "{label}: {path} has no rows of {asset}; calibrate it again");
                    };
                    Some(envelope_table(lua, &asset, envelope, &file)?)
                }
            }
        }
        /// Returns the content of assets/draws/<asset>.json, the draw reference of an asset, from the JSON text of a
        /// calibration. Nil if the asset has such a file, which no calibration replaces, and without a window.
        fn draw_reference(lua, asset: Constructed<AssetSpec>, calibration: Unchecked = Type::Text) -> ["string?"] {
            let (label, asset) = ("softvt.draw_reference", asset.asset(lua)?);
            let text: String = deserialize(lua, label, &calibration.0)?;
            let file = ThresholdFile::parse(&text, "calibration").map_err(|e| fail!(lua, "{label}: {e}"))?;
            let of_calibration = presses_of(&file, &asset.name).filter(|found| found.window(&InstanceFactors::NOMINAL).is_some());
            match (draw_reference(lua, &asset)?, of_calibration) {
                (None, Some(presses)) => {
                    let reference = DrawReference { object: asset.object_fingerprint(), presses };
                    Some(serde_json::to_string(&reference).map_err(mlua::Error::external)? + "\n")
                }
                _ => None,
            }
        }
        /// Returns the safe window of an instance of a calibrated asset; nil without a window. Experts see the factors
        /// as fields of their objects.
        fn grip_window(lua) takes spec "softvt.Instance" {
            /// Name of the asset.
            asset: String = Type::Name;
            /// Factor on the size.
            scale: f64 = FACTOR => Number(1.0);
            /// Factor on Young's modulus.
            youngs_factor: f64 = FACTOR => Number(1.0);
            /// Factor on the density.
            density_factor: f64 = FACTOR => Number(1.0);
            /// Factor on the stable strain.
            strain_factor: f64 = FACTOR => Number(1.0);
            /// Static friction of its coating.
            coating: Option<f64> = COATING;
        } -> ["softvt.InstanceWindow?"] {
            check_privilege(lua, "softvt.grip_window")?;
            let friction = coating.map_or(1.0, |mu| mu / PadSpec::default().static_mu);
            let factors = InstanceFactors { scale, youngs: youngs_factor, density: density_factor, strain: strain_factor, friction };
            let found = calibrated_asset(lua, &asset)?.and_then(|asset| asset.presses.window(&factors));
            found.map(|window| instance_window_table(lua, &window)).transpose()?
        }
        /// Returns instances of an asset as the episodes of a suite draw them, from a random stream that no episode
        /// uses. Without a variation each is the asset itself.
        fn sample_instances(lua) takes spec "softvt.Sample" {
            /// Asset of the instances.
            asset: Constructed<AssetSpec>;
            /// Variation of the suite.
            variation: Option<Constructed<VariationRanges>>;
            /// Name of the suite; part of the seed.
            suite: String = Type::Name;
            /// Number of instances to draw.
            count: u32 = Type::Integer(Range::closed(1.0, MAX_SAMPLE));
        } -> ["softvt.InstanceState[]"] {
            check_privilege(lua, "softvt.sample_instances")?;
            sample(lua, &suite, variation.as_deref(), &asset.asset(lua)?, count)?
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
