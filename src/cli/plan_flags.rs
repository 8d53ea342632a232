//! Decides which flags act on which kinds of plan. A flag that would do nothing is refused.

use std::fmt;

use crate::{
    args::Request,
    error::{CliError, flag_of},
};
use softvt_benchmark::{ObjectType, Plan};

/// Kind of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlanKind {
    Suite,
    Suites,
    Conditions,
    Experiment,
}

use PlanKind::{Conditions, Experiment, Suite, Suites};

impl PlanKind {
    pub(crate) fn of(plan: &Plan) -> Self {
        match plan {
            Plan::Suite(_) => Suite,
            Plan::Suites { .. } => Suites,
            Plan::Conditions { .. } => Conditions,
            Plan::Experiment { .. } => Experiment,
        }
    }

    /// Name of plans of this kind.
    fn plural(self) -> &'static str {
        match self {
            Suite => "suites",
            Suites => "lists of suites",
            Conditions => "conditions",
            Experiment => "experiments",
        }
    }
}

impl fmt::Display for PlanKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Suite => "a suite",
            Suites => "a list of suites",
            Conditions => "a set of conditions",
            Experiment => "an experiment",
        })
    }
}

const ALL: &[PlanKind] = &[Suite, Suites, Conditions, Experiment];
/// Plans that run episodes.
const EPISODES: &[PlanKind] = &[Suite, Suites, Conditions];
const SUITES: &[PlanKind] = &[Suite, Suites];

/// The command without a name: `softvt FILE.lua`.
pub(crate) const RUN: &str = "softvt";
/// The commands that take plans of all kinds. The others refuse plans of other kinds than theirs, and flags without
/// effect in `args.rs` and `parse.rs`.
const COMMANDS: [&str; 2] = [RUN, "check"];

/// Flags, and the kinds of plan on which they act.
struct Effect {
    /// Identifiers of the flags, as clap has them: the names of the fields of the arguments.
    flags: &'static [&'static str],
    acts_on: &'static [PlanKind],
}

/// Every flag of the [`COMMANDS`].
static EFFECTS: [Effect; 3] = [
    Effect { flags: &["seed", "settings", "threads", "out", "resume", "json", "details"], acts_on: ALL },
    Effect {
        flags: &[
            "shifts",
            "rigid_twin",
            "vary",
            "seed_file",
            "policy",
            "profile",
            "protocol",
            "gripper",
            "replan",
            "policy_timeout",
            "name",
            "tasks",
            "episodes",
            "selected_episodes",
            "shard",
            "trace",
            "video",
            "mcap",
        ],
        acts_on: EPISODES,
    },
    Effect { flags: &["requirements"], acts_on: SUITES },
];

/// The kinds of plan on which a flag of the [`COMMANDS`] acts. `None` if the table above lacks it.
fn acts_on(flag: &str) -> Option<&'static [PlanKind]> {
    EFFECTS.iter().find(|effect| effect.flags.contains(&flag)).map(|effect| effect.acts_on)
}

/// True if a command takes plans of this kind.
fn takes(command: &str, kind: PlanKind) -> bool {
    match command {
        "view" => kind == Suite,
        _ => COMMANDS.contains(&command) || SUITES.contains(&kind),
    }
}

/// Refuses flags that would do nothing for the plan of the script.
///
/// # Errors
/// The first such flag.
pub(crate) fn check(command: &str, request: &Request, plan: &Plan) -> Result<(), CliError> {
    let (kind, config) = (PlanKind::of(plan), &request.config);
    // A command that takes no plan of this kind says so itself.
    if !takes(command, kind) {
        return Ok(());
    }
    let refused = |id: &&String| acts_on(id).is_some_and(|kinds| !kinds.contains(&kind));
    if let Some(id) = request.given.iter().filter(|_| COMMANDS.contains(&command)).find(refused) {
        let kinds: Vec<&str> = acts_on(id).unwrap_or_default().iter().map(|kind| kind.plural()).collect();
        let (flag, kinds) = (flag_of(id), kinds.join(", "));
        let message = format!("{flag}: applies to {kinds}, and this file is {kind}; leave it out");
        return Err(config.error(message).into());
    }
    let all_rigid = plan.suites().iter().all(|suite| suite.object_type == ObjectType::Rigid);
    if config.rigid_twin && all_rigid {
        let message = "--rigid-twin: the objects of this suite are rigid already; leave it out";
        return Err(config.error(message).into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{
        error::Exit,
        parse::{clap_command, parse},
    };

    /// A valid value of each flag that does not act on all plans.
    const SAMPLES: &[(&str, &str)] = &[
        ("seed_file", "--seed-file Cargo.toml"),
        ("shifts", "--shift mass=2"),
        ("rigid_twin", "--rigid-twin"),
        ("vary", "--vary"),
        ("policy", "--policy noop"),
        ("protocol", "--protocol openpi"),
        ("replan", "--replan 2"),
        ("policy_timeout", "--policy-timeout 2"),
        ("name", "--name other"),
        ("profile", "--profile vision"),
        ("gripper", "--gripper binary"),
        ("tasks", "--task 0"),
        ("episodes", "--episodes 1"),
        ("selected_episodes", "--episode 1"),
        ("trace", "--trace"),
        ("video", "--video"),
        ("mcap", "--mcap"),
        ("shard", "--shard 1/2"),
        ("requirements", "--require safety>=0"),
    ];

    const PLANS: [(PlanKind, &str); 2] = [
        (
            Conditions,
            "return softvt.conditions { name = 'c', suites = { require 'suites.object_soft' }, conditions = { { name = 'x' } } }",
        ),
        (
            Experiment,
            "return softvt.experiment { name = 'e', grid = { x = { 1 } }, run = function() return {} end }",
        ),
    ];

    /// The flags of a command.
    fn flags(command: &str) -> Vec<String> {
        let root = clap_command();
        let command = root.find_subcommand(command).unwrap_or(&root);
        let named = command.get_arguments().filter(|arg| arg.get_long().is_some());
        named
            .map(|arg| arg.get_id().to_string())
            .filter(|id| !["help", "version"].contains(&id.as_str()))
            .collect()
    }

    #[test]
    fn every_flag_is_in_the_table() {
        let root = clap_command();
        let takes_plan = |command: &&clap::Command| command.get_arguments().any(|arg| arg.get_id() == "file");
        let names: Vec<&str> =
            root.get_subcommands().filter(takes_plan).map(clap::Command::get_name).collect();
        assert_eq!(
            names,
            ["check", "view", "watch", "record", "serve"],
            "say in `takes` which plans a new command takes"
        );
        for command in COMMANDS {
            for flag in flags(command) {
                assert!(
                    acts_on(&flag).is_some(),
                    "{command}: say in plan_flags.rs on which plans {flag} acts"
                );
            }
        }
        for flag in EFFECTS.iter().flat_map(|effect| effect.flags) {
            assert!(flags(RUN).iter().any(|known| known == flag), "there is no flag {flag}");
        }
    }

    #[test]
    fn a_flag_without_effect_is_refused_for_every_kind_of_plan() {
        let root = tempfile::tempdir().expect("a folder");
        let (script, out) = (root.path().join("plan.lua"), root.path().join("out").display().to_string());
        for (kind, plan) in PLANS {
            fs::write(&script, plan).expect("written");
            for command in COMMANDS {
                let known = flags(command);
                let acts = |flag: &str| acts_on(flag).is_some_and(|kinds| kinds.contains(&kind));
                for flag in known.iter().filter(|flag| !acts(flag)) {
                    let sample = SAMPLES.iter().find(|(known, _)| known == flag);
                    let (_, sample) = sample.unwrap_or_else(|| panic!("give a sample of the flag {flag}"));
                    let name = command.trim_start_matches(RUN);
                    let line = format!("softvt {name} {} {sample}", script.display());
                    let words: Vec<String> =
                        line.split_whitespace().map(|word| word.replace("OUT", &out)).collect();
                    let refused =
                        parse(&words).and_then(|command| command.map_or(Ok(()), |command| command.run()));
                    let error = refused.expect_err(sample);
                    let long = sample.split_whitespace().next().unwrap_or_default();
                    assert_eq!(error.exit, Exit::Input, "{line}: {}", error.message);
                    let (flag, kind) = (format!("{long}: applies to "), format!("this file is {kind}"));
                    assert!(
                        error.message.contains(&flag) && error.message.contains(&kind),
                        "{}",
                        error.message
                    );
                }
            }
        }
        assert!(!root.path().join("out").exists(), "a refused command writes nothing");
    }
}
