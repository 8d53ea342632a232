//! Variations in Lua: a file that returns `softvt.variation{…}`, as plain data.

use std::{collections::BTreeMap, path::Path};

use super::{LoadedScript, ScriptKind, ScriptSources};
use crate::{
    api::tasks::VariationSpec,
    vm::{VmLimits, error::ScriptError},
};
use softvt_benchmark::{ObjectType, Plan, Suite, variation::VariationRanges};

/// File of the variation that `--vary` applies unless it names another.
pub const STANDARD_VARIATION: &str = "scripts/variations/standard.lua";

/// Reads the variation at `path`. Also returns the SHA-256 of every file that was read, by name.
///
/// # Errors
/// If the file cannot be read or does not return a valid variation; the message names file and line.
pub fn load_variation(path: &Path) -> Result<(VariationRanges, BTreeMap<String, String>), ScriptError> {
    let (sources, ranges) =
        ScriptSources::read(ScriptKind::Plan, path, &[], &VmLimits::default(), |instance| {
            let spec = instance.expected_result::<VariationSpec>("a variation's file");
            spec.map(|spec| spec.ranges()).map_err(|e| instance.vm.explain(&e))
        })?;
    Ok((ranges, sources.bundle.hashes()))
}

/// A plan cannot be varied.
#[allow(missing_docs)] // The messages say what the fields are.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanVariationError {
    /// It has no suite.
    #[error("applies to suites, and this file is an experiment")]
    Experiment,
    /// A suite varies already.
    #[error("suite {suite} varies already, by its own variation {variation:?}; vary another suite")]
    Varied { suite: String, variation: String },
    /// A suite has no soft objects.
    #[error("{}", no_soft_objects(suite, variation))]
    Rigid { suite: String, variation: String },
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
    pub fn vary(&mut self, ranges: &VariationRanges) -> Result<(), PlanVariationError> {
        let vary = |suite: &mut Suite| {
            let (name, variation) = (suite.name.clone(), ranges.name.clone());
            if let Some(own) = &suite.vary {
                return Err(PlanVariationError::Varied { suite: name, variation: own.name.clone() });
            }
            if suite.object_type == ObjectType::Rigid {
                return Err(PlanVariationError::Rigid { suite: name, variation });
            }
            suite.vary = Some(ranges.clone());
            Ok(())
        };
        match &mut self.plan {
            Plan::Suite(suite) => vary(suite),
            Plan::Suites { suites } | Plan::Conditions { suites, .. } => suites.iter_mut().try_for_each(vary),
            Plan::Experiment { .. } => Err(PlanVariationError::Experiment),
        }
    }
}
