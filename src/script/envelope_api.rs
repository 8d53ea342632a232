//! The safe interaction envelope in Lua: what a calibration makes of its rows.

use mlua::{Lua, LuaSerdeExt, Table, Value};

use super::{catalogue_world::ENVELOPE, schema, sim_api::read};
use crate::{
    evaluation::{
        calibration::{self, Envelope, HoldRow, StableRule, SweepRow},
        thresholds::Thresholds,
    },
    report::{envelope::plot, interchange::sweep_jsonl},
};

/// Installs `softvt.envelope` and `softvt.stable`.
pub(super) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    api.set("envelope", lua.create_function(|lua, value: Value| envelope(lua, &value))?)?;
    let stable = |lua: &Lua, row: Value| {
        let row: SweepRow = read(lua, "softvt.stable", &row)?;
        Ok(StableRule::default().accepts(&row))
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
    let limit = calibration::limit(&envelope.sweep, kappa);
    let made_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
    let mut file = Thresholds::new(kappa, vec![format!("{asset}.sweep.jsonl")], made_by);
    let result = lua.create_table()?;
    result.set("lower", envelope.closure_lower)?;
    result.set("closure_at_tau", envelope.closure_at_tau)?;
    result.set("safe_window", envelope.has_safe_window())?;
    result.set("tau", limit.map(|l| l.tau_pct()))?;
    result.set("d_ref", limit.map(|l| l.d_ref_pct))?;
    result.set("text", plot(&asset, &envelope, limit))?;
    result.set("sweep", sweep_jsonl(&asset, &envelope))?;
    file.insert(&asset, envelope);
    if let Some(fingerprint) = spec.get::<Option<String>>("fingerprint")? {
        file.fingerprints.insert(asset, fingerprint);
    }
    result.set("json", file.to_text())?;
    result.set("table", lua.to_value(&file)?)?;
    Ok(result)
}
