//! Decides which flags act on which kinds of plan. A flag that would do nothing is refused.

use std::fmt;

use crate::{args::Request, error::CliError};
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

/// The kinds of plan on which flags of commands act.
struct Decision {
    commands: &'static [&'static str],
    /// Identifiers of the flags, as clap has them: the names of the fields of the arguments.
    flags: &'static [&'static str],
    /// Empty for flags that are always refused.
    acts_on: &'static [PlanKind],
}

const ALL: &[PlanKind] = &[Suite, Suites, Conditions, Experiment];
/// Plans that run episodes.
const EPISODES: &[PlanKind] = &[Suite, Suites, Conditions];
const SUITES: &[PlanKind] = &[Suite, Suites];

/// The command without a name: `softvt FILE.lua`.
pub(crate) const RUN: &str = "softvt";
const POLICY_SERVER: &[&str] = &["policy", "protocol", "replan", "policy_timeout", "name"];
const SCENE: &[&str] = &["seed", "settings", "shifts", "twin", "vary"];

/// Every flag of every command that loads a plan. `check` accepts what a run accepts and validates it; the other
/// commands refuse plans of other kinds as such.
static DECISIONS: &[Decision] = &[
    Decision { commands: &[RUN, "check"], flags: &["seed", "settings"], acts_on: ALL },
    Decision {
        commands: &[RUN, "check"],
        flags: &["shifts", "twin", "vary", "seed_file"],
        acts_on: EPISODES,
    },
    Decision { commands: &["view"], flags: &["seed_file"], acts_on: &[Suite] },
    Decision { commands: &["serve"], flags: &["seed_file"], acts_on: SUITES },
    // Demonstrations are public: what is learned from them is judged elsewhere.
    Decision { commands: &["record", "dataset import"], flags: &["seed_file"], acts_on: &[] },
    Decision { commands: &[RUN, "check"], flags: POLICY_SERVER, acts_on: EPISODES },
    Decision { commands: &[RUN, "check"], flags: &["profile", "gripper"], acts_on: EPISODES },
    Decision { commands: &[RUN], flags: &["threads", "out", "json"], acts_on: ALL },
    Decision {
        commands: &[RUN],
        flags: &["tasks", "episodes", "trace", "video", "resume", "shard"],
        acts_on: EPISODES,
    },
    Decision { commands: &[RUN], flags: &["requirements"], acts_on: SUITES },
    Decision { commands: &["view"], flags: SCENE, acts_on: &[Suite] },
    Decision { commands: &["view"], flags: POLICY_SERVER, acts_on: &[Suite] },
    Decision {
        commands: &["view"],
        flags: &["profile", "gripper", "task", "episode", "native", "out"],
        acts_on: &[Suite],
    },
    Decision { commands: &["record", "serve", "dataset import"], flags: SCENE, acts_on: SUITES },
    Decision { commands: &["record"], flags: POLICY_SERVER, acts_on: SUITES },
    Decision { commands: &["record"], flags: &["profile", "gripper", "demos"], acts_on: SUITES },
    Decision {
        commands: &["record", "dataset import"],
        flags: &["tasks", "attempts", "out", "images", "no_privileged", "threads", "resume"],
        acts_on: SUITES,
    },
    Decision { commands: &["dataset import"], flags: &["layout"], acts_on: SUITES },
    Decision {
        commands: &["serve"],
        flags: &["policy", "protocol", "replan", "policy_timeout"],
        acts_on: &[],
    },
    Decision {
        commands: &["serve"],
        flags: &[
            "profile",
            "gripper",
            "host",
            "port",
            "threads",
            "split",
            "privileged",
            "token",
            "until_stdin_closes",
        ],
        acts_on: SUITES,
    },
    Decision {
        commands: &["serve"],
        flags: &["name", "tasks", "episodes", "shard", "out", "resume"],
        acts_on: SUITES,
    },
];

/// The kinds of plan on which a flag of a command acts. `None` if that is undecided.
fn acts_on(command: &str, flag: &str) -> Option<&'static [PlanKind]> {
    let decision = DECISIONS
        .iter()
        .find(|decision| decision.commands.contains(&command) && decision.flags.contains(&flag))?;
    Some(decision.acts_on)
}

/// True if some flag of a command acts on plans of this kind.
fn accepts(command: &str, kind: PlanKind) -> bool {
    DECISIONS.iter().any(|decision| decision.commands.contains(&command) && decision.acts_on.contains(&kind))
}

/// A flag on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct GivenFlag {
    /// Identifier in clap.
    pub id: String,
    /// As it is typed, without the two dashes.
    pub long: String,
}

/// Refuses flags that would do nothing for the plan of the script.
///
/// # Errors
/// The first such flag.
pub(crate) fn check(command: &str, request: &Request, plan: &Plan) -> Result<(), CliError> {
    let (kind, config) = (PlanKind::of(plan), &request.config);
    // A command that accepts no plan of this kind says so itself.
    if !accepts(command, kind) {
        return Ok(());
    }
    for flag in request.given() {
        let acts_on = acts_on(command, &flag.id).unwrap_or_default();
        if !acts_on.contains(&kind) {
            let kinds: Vec<&str> = acts_on.iter().map(|kind| kind.plural()).collect();
            let kinds = if kinds.is_empty() { "no plan".to_owned() } else { kinds.join(", ") };
            let message =
                format!("--{}: applies to {kinds}, and this file is {kind}; leave it out", flag.long);
            return Err(config.error(message).into());
        }
    }
    let suites = plan.suites();
    if config.rigid_twin && suites.iter().all(|suite| suite.object_type == ObjectType::Rigid) {
        return Err(config.error("--twin: the objects of this suite are rigid already; leave it out").into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, fs, path::Path};

    use clap::Command;

    use super::*;
    use crate::{
        error::Exit,
        parse::{clap_command, parse},
    };

    /// A valid value of a flag, with the flags that it requires.
    const SAMPLES: &[(&str, &str)] = &[
        ("seed", "--seed 1"),
        ("seed_file", "--seed-file Cargo.toml"),
        ("settings", "--set physics.sleeping=false"),
        ("shifts", "--shift mass=2"),
        ("twin", "--twin rigid"),
        ("vary", "--vary"),
        ("policy", "--policy noop"),
        ("protocol", "--protocol openpi"),
        ("replan", "--replan 2"),
        ("policy_timeout", "--policy-timeout 2"),
        ("name", "--name other"),
        ("profile", "--profile vision"),
        ("gripper", "--gripper binary"),
        ("threads", "--threads 1"),
        ("out", "--out OUT"),
        ("json", "--json"),
        ("tasks", "--task 0"),
        ("task", "--task 0"),
        ("episodes", "--episodes 1"),
        ("episode", "--episode 0"),
        ("trace", "--trace"),
        ("video", "--video"),
        ("resume", "--resume --out OUT"),
        ("shard", "--shard 1/2"),
        ("requirements", "--require safety>=0"),
        ("native", "--native"),
        ("demos", "--demos 1"),
        ("attempts", "--attempts 1"),
        ("images", "--images video"),
        ("no_privileged", "--no-privileged"),
        ("layout", "--layout"),
        ("host", "--host 127.0.0.1"),
        ("port", "--port 0"),
        ("split", "--split validation"),
        ("privileged", "--privileged"),
        ("token", "--token secret"),
        ("until_stdin_closes", "--until-stdin-closes"),
    ];

    const SUITE: &str = r#"local box = softvt.asset { name = "box", shape = softvt.shape.box { size = { 0.1, 0.1, 0.02 } }:grounded(), body = softvt.static {} }
local layout = softvt.layout("one", function(scene)
  scene:add { name = "a", asset = box, position = { 0, 0, 0 } }
  scene:add { name = "b", asset = box, position = { 0, 0.3, 0 } }
end)
local task = softvt.task { prompt = "wait", layout = layout, goal = softvt.on { object = "a", target = "b" }, budget_steps = 1 }
local suite = softvt.suite { name = "one", object_type = "deformable", variation = "object", episodes = 1, tasks = { task } }
"#;

    const PLANS: [(PlanKind, &str); 4] = [
        (Suite, "return suite"),
        (Suites, "return { suite }"),
        (
            Conditions,
            "return softvt.conditions { name = 'c', suites = { suite }, conditions = { { name = 'x' } } }",
        ),
        (
            Experiment,
            "return softvt.experiment { name = 'e', grid = { x = { 1 } }, run = function() return {} end }",
        ),
    ];

    /// The commands that load a plan, with their flags.
    fn commands_with_plans() -> Vec<(String, Vec<String>)> {
        fn collect(name: &str, command: &Command, found: &mut Vec<(String, Vec<String>)>) {
            let arguments: Vec<_> = command.get_arguments().collect();
            if arguments.iter().any(|arg| arg.get_id() == "file") {
                let flags = arguments.iter().filter(|arg| arg.get_long().is_some());
                let flags = flags.map(|arg| arg.get_id().to_string());
                found.push((
                    name.to_owned(),
                    flags.filter(|id| !["help", "version"].contains(&id.as_str())).collect(),
                ));
            }
            for subcommand in command.get_subcommands() {
                let path = if name == RUN { String::new() } else { format!("{name} ") };
                collect(&(path + subcommand.get_name()), subcommand, found);
            }
        }
        let mut found = Vec::new();
        collect(RUN, &clap_command(), &mut found);
        found
    }

    #[test]
    fn every_flag_has_a_decision_and_every_decision_a_flag() {
        let commands = commands_with_plans();
        assert!(commands.len() >= 6, "{commands:?}");
        let mut decided = BTreeSet::new();
        for (command, flags) in &commands {
            for flag in flags {
                assert!(
                    acts_on(command, flag).is_some(),
                    "softvt {command}: decide in plan_flags.rs on which plans the flag {flag} acts"
                );
                decided.insert((command.as_str(), flag.as_str()));
            }
        }
        for decision in DECISIONS {
            for command in decision.commands {
                for flag in decision.flags {
                    assert!(decided.contains(&(*command, *flag)), "{command} has no flag {flag}");
                }
            }
        }
    }

    /// Runs a command in this process. `script` is the file of the plan, and what it writes goes to `root`.
    fn run(command: &str, script: &Path, sample: &str, root: &Path) -> Result<(), CliError> {
        let required = match command {
            "view" | "record" | "dataset import" if !sample.contains("--out") => " --out OUT",
            _ => "",
        };
        let files = if command == "dataset import" { " absent.hdf5" } else { "" };
        let command = if command == RUN { String::new() } else { format!("{command} ") };
        let line = format!("softvt {command}{} {sample}{required}{files}", script.display());
        let out = root.join("out").display().to_string();
        let words: Vec<String> = line.split_whitespace().map(|word| word.replace("OUT", &out)).collect();
        parse(&words)?.map_or(Ok(()), |command| command.run())
    }

    #[test]
    fn a_flag_without_effect_is_refused_for_every_kind_of_plan() {
        let root = tempfile::tempdir().expect("a folder");
        for (kind, plan) in PLANS {
            let script = root.path().join("plan.lua");
            fs::write(&script, format!("{SUITE}{plan}\n")).expect("written");
            for (command, flags) in commands_with_plans() {
                for flag in flags {
                    let sample = SAMPLES.iter().find(|(known, _)| *known == flag);
                    let (_, sample) = sample.unwrap_or_else(|| panic!("give a sample of the flag {flag}"));
                    if acts_on(&command, &flag).is_some_and(|kinds| kinds.contains(&kind)) {
                        continue;
                    }
                    let error = run(&command, &script, sample, root.path()).expect_err(&flag);
                    let message = &error.message;
                    assert_eq!(error.exit, Exit::Input, "{command} {sample}: {message}");
                    let long = sample.split_whitespace().next().unwrap_or_default();
                    let is_clear = match (acts_on(&command, &flag), accepts(&command, kind)) {
                        (Some([]), _) => message.starts_with(&format!("{long}: ")),
                        (_, true) => {
                            message.contains(&format!("{long}: ")) && message.contains(&kind.to_string())
                        }
                        (_, false) => {
                            message.contains(&format!("softvt {command} needs a "))
                                || message.contains(&format!("{long}: applies to "))
                        }
                    };
                    assert!(is_clear, "{command} {sample}: {message}");
                }
            }
        }
        assert!(!root.path().join("out").exists(), "a refused command writes nothing");
    }
}
