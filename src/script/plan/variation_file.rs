//! Variations in Lua: a file that returns `softvt.variation{…}`, as plain data.

use std::{collections::BTreeMap, path::Path};

use super::{LoadedScript, ScriptSources};
use crate::vm::{VmLimits, error::ScriptError};
use softvt_benchmark::{ObjectType, Plan, Suite, variation::VariationRanges};

/// File of the variation that `--vary` applies unless it names another.
pub const STANDARD_VARIATION: &str = "scripts/variations/standard.lua";

/// Reads the variation at `path`. Also returns the SHA-256 of every file that was read, by name.
///
/// # Errors
/// If the file cannot be read or does not return a valid variation; the message names file and line.
pub fn load_variation(path: &Path) -> Result<(VariationRanges, BTreeMap<String, String>), ScriptError> {
    let (sources, ranges) = ScriptSources::read(false, path, &[], &VmLimits::default(), |instance| {
        instance.expected_result("a variation's file").map(|made| made.spec)
    })?;
    Ok((ranges, sources.bundle.hashes()))
}

/// Message about a suite of rigid objects; a fragment.
pub(crate) fn no_soft_objects(suite: &str, variation: &str) -> String {
    format!(
        "suite {suite} has object_type = \"rigid\", and the variation {variation:?} changes soft objects; vary a suite of \
         soft objects"
    )
}

impl LoadedScript {
    /// Makes every suite vary within `ranges`.
    ///
    /// # Errors
    /// A suite varies already or has no soft objects, or the plan has no suites.
    pub fn vary(&mut self, ranges: &VariationRanges) -> Result<(), String> {
        let vary = |suite: &mut Suite| {
            let name = &suite.name;
            if let Some(own) = &suite.vary {
                return Err(format!(
                    "suite {name} varies already, by its own variation {:?}; vary another suite",
                    own.name
                ));
            }
            if suite.object_type == ObjectType::Rigid {
                return Err(no_soft_objects(name, &ranges.name));
            }
            suite.vary = Some(ranges.clone());
            Ok(())
        };
        match &mut self.plan {
            Plan::Suite(suite) => vary(suite),
            Plan::Suites { suites } | Plan::Conditions { suites, .. } => suites.iter_mut().try_for_each(vary),
            Plan::Experiment { .. } => Err("applies to suites, and this file is an experiment".to_owned()),
        }
    }
}
