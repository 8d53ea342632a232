//! The safe interaction envelope in Lua: what a calibration makes of its rows.

use mlua::{Lua, LuaSerdeExt, Table, Value};

use crate::script::{
    api::catalogue_world::ENVELOPE,
    api::sim::read,
    schema::{self, Type},
    vm::{fail, locked, shared},
};
use crate::{
    evaluation::{
        calibration::{self, Envelope, HoldRow, StabilityCriteria, SweepRow},
        envelope_plot::plot,
        thresholds::ThresholdFile,
    },
    report::softvtbench_files::sweep_jsonl,
};

/// Installs `softvt.envelope`, `softvt.calibration` and `softvt.stable`.
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    api.set("envelope", lua.create_function(|lua, value: Value| envelope(lua, &value))?)?;
    api.set("calibration", lua.create_function(|lua, asset: Value| calibration(lua, &asset))?)?;
    let stable = |lua: &Lua, row: Value| {
        let row: SweepRow = read(lua, "softvt.stable", &row)?;
        Ok(StabilityCriteria::default().accepts(&row))
    };
    api.set("stable", lua.create_function(stable)?)
}

fn envelope(lua: &Lua, value: &Value) -> mlua::Result<Table> {
    let spec = schema::checked(lua, &ENVELOPE, value)?;
    let asset: String = spec.get("asset")?;
    let kappa: f64 = spec.get("kappa")?;
    let holds: Vec<HoldRow> = read(lua, "softvt.envelope: holds", &spec.get("holds")?)?;
    let sweep: Vec<SweepRow> = read(lua, "softvt.envelope: sweep", &spec.get("sweep")?)?;
    let envelope = Envelope::new(holds, sweep, kappa);
    let made_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
    let mut file = ThresholdFile::new(kappa, vec![format!("{asset}.sweep.jsonl")], made_by);
    file.insert(&asset, envelope.clone());
    if let Some(fingerprint) = spec.get::<Option<String>>("fingerprint")? {
        file.fingerprints.insert(asset.clone(), fingerprint);
    }
    told(lua, &asset, &envelope, &file)
}

/// What the calibration file of an asset says; nil if there is none.
fn calibration(lua: &Lua, asset: &Value) -> mlua::Result<Option<Table>> {
    let label = "softvt.calibration";
    let asset =
        Type::Name.check(lua, asset).map_err(|fault| fail(lua, fault.words(&format!("{label}: asset"))))?;
    let asset: String = lua.unpack(asset)?;
    let bytes = {
        let shared = shared(lua)?;
        let mut library = locked(&shared.library);
        let path = format!("assets/calibration/{asset}.json");
        let found = library.data_if_there(&path).map_err(|e| fail(lua, format!("{label}: {e}")))?;
        found.and_then(|file| Some((library.bytes(&file)?, file)))
    };
    let Some((bytes, path)) = bytes else { return Ok(None) };
    let file = ThresholdFile::parse(&String::from_utf8_lossy(&bytes), &path)
        .map_err(|e| fail(lua, format!("{label}: {e}")))?;
    match file.envelopes.get(&asset) {
        Some(envelope) => told(lua, &asset, envelope, &file).map(Some),
        None => Err(fail(lua, format!("{label}: {path} has no rows of {asset}; calibrate it again"))),
    }
}

/// An envelope as scripts see it.
fn told(lua: &Lua, asset: &str, envelope: &Envelope, file: &ThresholdFile) -> mlua::Result<Table> {
    let limit = calibration::deformation_limit(&envelope.sweep, file.calibration.kappa);
    let result = lua.create_table()?;
    result.set("lower", envelope.closure_lower)?;
    result.set("closure_at_tau", envelope.closure_at_tau)?;
    result.set("safe_window", envelope.has_safe_window())?;
    result.set("tau", limit.map(|l| l.tau_pct()))?;
    result.set("d_ref", limit.map(|l| l.d_ref_pct))?;
    result.set("text", plot(asset, envelope, limit))?;
    result.set("sweep", sweep_jsonl(asset, envelope))?;
    result.set("json", file.to_text())?;
    result.set("table", lua.to_value(file)?)?;
    Ok(result)
}
