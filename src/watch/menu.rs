//! Suites, tasks and policies that pages may select.

use std::iter;

use crate::{stage::Selection, teleop::TELEOP};
use softvt_benchmark::{Suite, Task};
use softvt_common::text;
use softvt_runner::BuiltinPolicy;

/// The suites and the names of the policies of a program; without any, before its script is loaded.
#[derive(Debug, Default)]
pub(crate) struct Menu {
    suites: Vec<Suite>,
    policies: Vec<String>,
}

impl Menu {
    /// The suites of a script, with the policy `given` and the built-in ones.
    pub(crate) fn new(suites: &[Suite], given: &str) -> Self {
        Self { suites: suites.to_vec(), policies: policies(given) }
    }

    /// A message about a suite, task or policy that is unknown.
    pub(crate) fn problem(&self, selection: &Selection) -> Option<String> {
        let policy = unknown_policy(&self.policies, &selection.policy);
        let has_suites = !self.suites.is_empty();
        policy.or_else(|| has_suites.then(|| find_task(&self.suites, selection).err())?)
    }
}

/// Names of the policies that are offered: `given`, the built-in ones, and `teleop`.
pub(crate) fn policies(given: &str) -> Vec<String> {
    let others = BuiltinPolicy::all().map(BuiltinPolicy::name).chain([TELEOP]);
    let others = others.filter(|name| *name != given);
    iter::once(given.to_owned()).chain(others.map(str::to_owned)).collect()
}

/// A message about a name that no policy has; an empty one is that of the configuration.
pub(crate) fn unknown_policy(policies: &[String], name: &str) -> Option<String> {
    let is_known = name.is_empty() || policies.is_empty() || policies.iter().any(|known| known == name);
    (!is_known).then(|| text::unknown_name("policy", name, policies.iter().map(String::as_str)))
}

/// The selected task, of the first suite if none is named.
pub(crate) fn find_task<'a>(
    suites: &'a [Suite],
    selection: &Selection,
) -> Result<(&'a Suite, &'a Task), String> {
    let Selection { suite: name, task: id, .. } = selection;
    let Some(suite) = suites.iter().find(|suite| name.is_empty() || suite.name == *name) else {
        return Err(match suites {
            [] => "it has no suite to watch; name a file that returns softvt.suite or a list of suites"
                .to_owned(),
            _ => text::unknown_name("suite", name, suites.iter().map(|suite| suite.name.as_str())),
        });
    };
    let task = suite.tasks.iter().find(|task| task.id == *id).ok_or_else(|| {
        let last = suite.tasks.len().saturating_sub(1);
        format!("{} has no task {id}; its tasks are 0 to {last}", suite.name)
    })?;
    Ok((suite, task))
}
