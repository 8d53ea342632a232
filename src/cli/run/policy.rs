//! The policy of a run: its flags, the policy with its files read, and the controllers of the episodes.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use clap::{Args, ValueEnum, value_parser};

use crate::{error::CliError, run::recorded_runs::RecordedRuns};
use softvt_benchmark::{Teacher, seed::RandomStream};
use softvt_common::cancel;
use softvt_common::text;
use softvt_dataset::layout::is_dataset;
use softvt_policy::{
    Policy, SensorStreams, TaskBrief, builtin,
    builtin::RecordedPolicy,
    profile::{GripCode, PROFILES, Profile},
    remote::{PolicyConnections, PolicyServer, Protocol, RemotePolicy},
};
use softvt_rollout::{ChunkedPolicy, Controller};
use softvt_script::{EpisodeSetup, ExpertController, GripController, GripMode, PolicyFile, load_profile};

/// Environment variable with the key of a policy server. A flag would show it to other users of the machine.
const API_KEY: &str = "SOFTVT_API_KEY";
/// Actions executed from each chunk of a policy server, unless `--replan` is given.
const DEFAULT_REPLAN: usize = 10;
/// Timeout of a policy server, unless `--policy-timeout` is given.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(60);
/// Name of the clients of `softvt serve` in results, unless `--name` is given.
const CLIENT: &str = "client";
/// Profile of a policy server unless `--profile` names another.
const DEFAULT_PROFILE: &str = "visuo_tactile";

// The policy, and how it is connected. A doc comment would replace the description of the commands.
#[derive(Args, Clone, Debug)]
pub(crate) struct PolicyArgs {
    /// Policy that controls the robot: a name (softvt list policies), a Lua file, a server such as ws://host:8000, or a run folder whose actions are repeated [default: expert; softvt record: the suite's teacher]
    #[arg(long, value_name = "POLICY", value_parser = parse_policy)]
    policy: Option<PolicyArg>,
    /// Observations and action encoding of a policy server: a name (softvt list profiles) or a Lua file [default: visuo_tactile]
    #[arg(long, value_name = "PROFILE", value_parser = parse_profile)]
    profile: Option<String>,
    /// Protocol of a policy server [default: openpi]
    #[arg(long, value_name = "PROTOCOL")]
    protocol: Option<Protocol>,
    /// Grip code, the meaning of an action's gripper value, in place of that of the profile or the Lua policy: docs/policies.md
    #[arg(long, value_name = "CODE")]
    gripper: Option<GripCode>,
    /// Actions executed from each predicted chunk [default: 10 for servers]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..))]
    replan: Option<u16>,
    /// Timeout in seconds, for connecting and for each reply [default: 60]
    #[arg(long, value_name = "SECONDS", value_parser = parse_timeout)]
    policy_timeout: Option<Duration>,
    /// Policy name shown in the results
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    name: Option<String>,
}

impl PolicyArgs {
    /// The grip code that exports of a recording use. Policies that are neither servers nor in Lua have none of their own.
    pub(crate) fn take_export_code(&mut self) -> Option<GripCode> {
        let has_code = matches!(self.policy, Some(PolicyArg::Server(_) | PolicyArg::Lua(_)));
        if has_code { self.gripper } else { self.gripper.take() }
    }

    /// The policy that is loaded.
    fn policy(&self) -> PolicyArg {
        self.policy.clone().unwrap_or(PolicyArg::Builtin(BuiltinPolicy::Expert))
    }

    /// These arguments for a suite of a teacher, which `--policy` replaces.
    pub(crate) fn taught_by(&self, teacher: Teacher) -> Self {
        let builtin = match teacher {
            Teacher::Expert => BuiltinPolicy::Expert,
            Teacher::TactileServo => BuiltinPolicy::TactileServo,
        };
        Self { policy: Some(self.policy.clone().unwrap_or(PolicyArg::Builtin(builtin))), ..self.clone() }
    }
}

/// Value of `--policy`.
#[derive(Clone, Debug, PartialEq, Eq)]
enum PolicyArg {
    Builtin(BuiltinPolicy),
    /// A policy in Lua.
    Lua(PathBuf),
    /// The address of a policy server.
    Server(String),
    /// A run folder, or a folder that contains run folders.
    Run(PathBuf),
}

/// Policies that need no file. `softvt list policies` prints their descriptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BuiltinPolicy {
    /// the scripted expert of the task (privileged: it has access to ground-truth state)
    Expert,
    /// the same expert with a gripper that is either open or closed (privileged)
    ExpertBinary,
    /// the same expert, feeling in the tactile markers how firmly it must hold (privileged)
    TactileServo,
    /// the same expert without touch: one closure per kind of object (privileged)
    FixedClosure,
    /// the same expert without touch: the best closure for the size of the object (privileged)
    SizeSeen,
    /// the same expert without touch: the best indentation after first contact (privileged)
    ContactDepth,
    /// the same expert without touch: the best force per kind of object (privileged)
    OneForce,
    /// the same expert without touch: the best force for all objects of the suite (privileged)
    OneForceForAll,
    /// the same expert without touch: reads the width and the force of the finger drives (privileged)
    Drives,
    /// the same expert without touch: lifts, looks whether the object follows, and closes further (privileged)
    LookRetry,
    /// holds still with the gripper open
    Noop,
    /// moves at random
    Random,
}

impl BuiltinPolicy {
    /// Names and descriptions of all.
    pub(crate) fn descriptions() -> impl Iterator<Item = (String, String)> {
        let values = Self::value_variants().iter().filter_map(Self::to_possible_value);
        values.map(|value| {
            (value.get_name().to_owned(), value.get_help().map(ToString::to_string).unwrap_or_default())
        })
    }

    /// Name, as `--policy` takes it.
    fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// How the gripper is controlled, for scripted experts, which have access to ground-truth state.
    fn grip_mode(self) -> Option<GripMode> {
        Some(match self {
            Self::Expert => GripMode::Commanded,
            Self::ExpertBinary => GripMode::Binary,
            Self::TactileServo => GripMode::TactileServo,
            Self::FixedClosure => GripMode::Controller(GripController::FixedClosure),
            Self::SizeSeen => GripMode::Controller(GripController::SizeSeen),
            Self::ContactDepth => GripMode::Controller(GripController::ContactDepth),
            Self::OneForce => GripMode::Controller(GripController::OneForce),
            Self::OneForceForAll => GripMode::Controller(GripController::OneForceForAll),
            Self::Drives => GripMode::Controller(GripController::Drives),
            Self::LookRetry => GripMode::Controller(GripController::LookRetry),
            Self::Noop | Self::Random => return None,
        })
    }
}

impl PolicyArg {
    /// As it was typed.
    fn word(&self) -> String {
        match self {
            Self::Builtin(policy) => policy.name(),
            Self::Lua(path) | Self::Run(path) => path.display().to_string(),
            Self::Server(url) => url.clone(),
        }
    }
}

fn parse_policy(word: &str) -> Result<PolicyArg, String> {
    if let Ok(policy) = BuiltinPolicy::from_str(word, false) {
        return Ok(PolicyArg::Builtin(policy));
    }
    Ok(match word {
        address if address.contains("://") => PolicyArg::Server(address.to_owned()),
        file if file.ends_with(".lua") => PolicyArg::Lua(file.into()),
        data if is_dataset(Path::new(data)) => {
            return Err(format!(
                "{data} is a dataset, not a policy; to simulate its demonstrations again: softvt replay {data} 0/0 for \
                 one, softvt dataset check {data} --replay all for all; for demonstrations of another simulator: softvt \
                 dataset import SUITE.lua FILE.hdf5 --out DIR"
            ));
        }
        folder if Path::new(folder).is_dir() => PolicyArg::Run(folder.into()),
        other => {
            let known: Vec<String> = BuiltinPolicy::descriptions().map(|(name, _)| name).collect();
            let hint = suggestion(other, known.iter().map(String::as_str));
            return Err(format!(
                "expected {}, a Lua file such as my_policy.lua, a server such as ws://host:8000, or a run folder{hint}",
                known.join(", ")
            ));
        }
    })
}

fn parse_profile(word: &str) -> Result<String, String> {
    let known = PROFILES.map(|(name, _)| name);
    if word.ends_with(".lua") || known.contains(&word) {
        return Ok(word.to_owned());
    }
    let hint = suggestion(word, known.into_iter());
    Err(format!("[possible values: {}, or a Lua file such as my_profile.lua]{hint}", known.join(", ")))
}

/// Returns the end of a message that suggests the closest known name; empty if none is close.
fn suggestion<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> String {
    text::suggest(word, known).map_or(String::new(), |name| format!("; did you mean {name}?"))
}

fn parse_timeout(word: &str) -> Result<Duration, String> {
    let seconds = word.parse().ok().filter(|seconds| (0.01..=86_400.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "expected seconds in 0.01..86400".to_owned())
}

fn parse_name(word: &str) -> Result<String, String> {
    let is_valid = !word.trim().is_empty() && word.len() <= 80 && !word.chars().any(char::is_control);
    if is_valid { Ok(word.to_owned()) } else { Err("expected a name of 1 to 80 characters".to_owned()) }
}

/// Makes the controller of an episode.
pub(crate) type ControllerFactory =
    Box<dyn Fn(EpisodeSetup, TaskBrief) -> Result<Box<dyn Controller>, CliError> + Sync>;

#[derive(Clone, Debug)]
enum PolicyKind {
    Builtin(BuiltinPolicy),
    Lua(Arc<PolicyFile>),
    Server(Arc<PolicyServer>),
    /// Repeats the actions of recorded runs.
    Recorded(Arc<RecordedRuns>),
    /// A client of `softvt serve`, with the encoding of its observations and actions.
    Client(Arc<Profile>),
    /// The actions come from elsewhere: a dataset or a single recorded episode.
    External,
}

/// The sensors that the file of a policy declares.
#[derive(Clone, Debug)]
pub(crate) struct DeclaredStreams {
    /// Source location of the declaration.
    pub place: String,
    pub streams: SensorStreams,
}

/// A loaded policy.
#[derive(Clone, Debug)]
pub(crate) struct PolicyConfig {
    kind: PolicyKind,
    /// The name that results show.
    pub name: String,
    /// Actions executed from each chunk, for policies that predict chunks.
    pub replan: Option<usize>,
    /// Grip code of the actions, if the profile, the file or the command line states one.
    pub gripper: Option<GripCode>,
    /// File of a policy in Lua, as messages name it.
    pub file: Option<String>,
    /// SHA-256 of the files of the policy or of its profile, by name.
    pub sources: BTreeMap<String, String>,
    pub declared: Option<DeclaredStreams>,
    /// True if the policy has access to ground-truth state, or to limits or materials of objects.
    pub privileged: bool,
}

impl Default for PolicyConfig {
    /// The scripted experts of the tasks.
    fn default() -> Self {
        Self::new(PolicyKind::Builtin(BuiltinPolicy::Expert), BuiltinPolicy::Expert.name())
    }
}

impl PolicyConfig {
    fn new(kind: PolicyKind, name: String) -> Self {
        let privileged = matches!(kind, PolicyKind::Builtin(policy) if policy.grip_mode().is_some());
        Self {
            kind,
            name,
            replan: None,
            gripper: None,
            file: None,
            sources: BTreeMap::new(),
            declared: None,
            privileged,
        }
    }

    /// Loads the policy that the arguments select.
    ///
    /// # Errors
    /// A file that is not valid, a folder without a run, or a flag that has no effect on this policy.
    pub(crate) fn load(args: &PolicyArgs) -> Result<Self, CliError> {
        refuse_flags_without_effect(args)?;
        let replan = args.replan.map(usize::from);
        let mut policy = match &args.policy() {
            PolicyArg::Builtin(policy) => Self::new(PolicyKind::Builtin(*policy), policy.name()),
            PolicyArg::Lua(path) => {
                let file = PolicyFile::load(path)?;
                let place = format!("{}: policy.observes", file.observes_at);
                Self {
                    name: file.name.clone(),
                    replan: replan.or(file.replan),
                    gripper: args.gripper.or(file.gripper),
                    file: Some(file.sources.main.clone()),
                    sources: file.sources.bundle.hashes(),
                    declared: Some(DeclaredStreams { place, streams: file.streams.clone() }),
                    privileged: file.privileged,
                    kind: PolicyKind::Lua(Arc::new(file)),
                }
            }
            PolicyArg::Server(url) => {
                let (profile, sources) = load_profile_of(args)?;
                let profile_name = args.profile.as_deref().unwrap_or(DEFAULT_PROFILE);
                if profile.observe_every_step && args.protocol == Some(Protocol::VlaEval) {
                    return Err(CliError::input(format!(
                        "--profile {profile_name}: observe_every_step needs --protocol openpi; in vla-eval's protocol every \
                         observation is a request for actions"
                    )));
                }
                let declared = declared_streams(args, &profile);
                Self {
                    name: profile.name.clone(),
                    replan: replan.or(Some(DEFAULT_REPLAN)),
                    gripper: Some(profile.actions.gripper.code),
                    file: None,
                    sources,
                    declared: Some(declared),
                    privileged: false,
                    kind: PolicyKind::Server(Arc::new(PolicyServer {
                        url: url.clone(),
                        protocol: args.protocol.unwrap_or_default(),
                        profile,
                        timeout: args.policy_timeout.unwrap_or(DEFAULT_TIMEOUT),
                        api_key: std::env::var(API_KEY).ok(),
                        cancel: &cancel::FLAG,
                    })),
                }
            }
            PolicyArg::Run(dir) => {
                Self::new(PolicyKind::Recorded(Arc::new(RecordedRuns::load(dir)?)), "replay".to_owned())
            }
        };
        if let Some(name) = &args.name {
            policy.name.clone_from(name);
        }
        Ok(policy)
    }

    /// The built-in policy of a name.
    ///
    /// # Errors
    /// No policy has the name; the message is a fragment.
    pub(crate) fn builtin(name: &str) -> Result<Self, String> {
        let known: Vec<String> = BuiltinPolicy::descriptions().map(|(name, _)| name).collect();
        let policy = BuiltinPolicy::from_str(name, false).map_err(|_| {
            let hint = suggestion(name, known.iter().map(String::as_str));
            format!("expected {}, got {name:?}{hint}", known.join(", "))
        })?;
        Ok(Self::new(PolicyKind::Builtin(policy), policy.name()))
    }

    /// The clients of `softvt serve`. `privileged` clients receive the true state.
    ///
    /// # Errors
    /// A file that is not a valid profile.
    pub(crate) fn client(args: &PolicyArgs, privileged: bool) -> Result<Self, CliError> {
        let (profile, sources) = load_profile_of(args)?;
        Ok(Self {
            name: args.name.clone().unwrap_or_else(|| CLIENT.to_owned()),
            replan: None,
            gripper: Some(profile.actions.gripper.code),
            file: None,
            sources,
            declared: Some(declared_streams(args, &profile)),
            privileged,
            kind: PolicyKind::Client(Arc::new(profile)),
        })
    }

    /// Actions that come from elsewhere, under a name such as `replay`.
    pub(crate) fn external(name: &str) -> Self {
        Self::new(PolicyKind::External, name.to_owned())
    }

    /// How a scripted expert controls the gripper. `None` for other policies.
    pub(crate) fn expert(&self) -> Option<GripMode> {
        match self.kind {
            PolicyKind::Builtin(policy) => policy.grip_mode(),
            _ => None,
        }
    }

    /// The server of the policy, if it has one.
    pub(crate) fn server(&self) -> Option<&PolicyServer> {
        match &self.kind {
            PolicyKind::Server(server) => Some(server),
            _ => None,
        }
    }

    /// True for the clients of `softvt serve`.
    pub(crate) fn is_client(&self) -> bool {
        matches!(self.kind, PolicyKind::Client(_))
    }

    /// Encoding of the observations and actions of a policy in another program.
    pub(crate) fn profile(&self) -> Option<&Profile> {
        match &self.kind {
            PolicyKind::Server(server) => Some(&server.profile),
            PolicyKind::Client(profile) => Some(profile),
            _ => None,
        }
    }

    /// The recorded runs whose actions the policy repeats.
    pub(crate) fn recorded(&self) -> Option<&RecordedRuns> {
        match &self.kind {
            PolicyKind::Recorded(runs) => Some(runs),
            _ => None,
        }
    }

    /// A factory of controllers for the episodes of a suite; `connections` lead to its server.
    pub(crate) fn controller_factory(
        &self,
        connections: Option<Arc<PolicyConnections>>,
        suite: &str,
        is_rigid_twin: bool,
    ) -> ControllerFactory {
        let (kind, suite) = (self.kind.clone(), suite.to_owned());
        let (replan, gripper) = (self.replan.unwrap_or(usize::MAX), self.gripper);
        Box::new(move |opened, brief| {
            let chunked = |policy: Box<dyn Policy>, replan| -> Box<dyn Controller> {
                Box::new(ChunkedPolicy::new(policy, brief.clone(), replan))
            };
            Ok(match (&kind, &connections) {
                (PolicyKind::Server(_), Some(connections)) => {
                    chunked(Box::new(RemotePolicy::new(connections.clone())), replan)
                }
                (PolicyKind::Recorded(runs), _) => {
                    let actions = runs.actions(&suite, is_rigid_twin, &brief)?;
                    chunked(Box::new(RecordedPolicy::from_actions(&actions, None)), 1)
                }
                (PolicyKind::Lua(file), _) => {
                    let policy = file.start(&opened.seed, gripper)?;
                    chunked(Box::new(policy), replan)
                }
                (PolicyKind::Builtin(BuiltinPolicy::Noop), _) => {
                    chunked(Box::<builtin::NoopPolicy>::default(), 1)
                }
                (PolicyKind::Builtin(BuiltinPolicy::Random), _) => {
                    let seed = rand::RngCore::next_u64(&mut opened.seed.stream(RandomStream::Script));
                    chunked(Box::new(builtin::RandomPolicy::new(seed)), 1)
                }
                (PolicyKind::Builtin(expert), _) => {
                    let mode = expert.grip_mode().unwrap_or(GripMode::Commanded);
                    Box::new(expert_controller(opened, mode)?)
                }
                // The provider of the actions replaces this factory.
                (PolicyKind::External | PolicyKind::Client(_) | PolicyKind::Server(_), _) => {
                    chunked(Box::new(RecordedPolicy::new(Vec::new(), None)), 1)
                }
            })
        })
    }
}

/// The sensors that a profile observes.
fn declared_streams(args: &PolicyArgs, profile: &Profile) -> DeclaredStreams {
    let name = args.profile.as_deref().unwrap_or(DEFAULT_PROFILE);
    DeclaredStreams { place: format!("--profile {name}: inputs"), streams: profile.streams() }
}

/// Starts the expert of a task.
///
/// # Errors
/// The task has none, or its script fails.
pub(crate) fn expert_controller(opened: EpisodeSetup, mode: GripMode) -> Result<ExpertController, CliError> {
    opened.expert(mode).ok_or_else(|| CliError::input("the task has no expert"))
}

/// Loads the profile that the arguments select, with SHA-256 of its files by name.
///
/// # Errors
/// A file that is not a valid profile.
pub(crate) fn load_profile_of(args: &PolicyArgs) -> Result<(Profile, BTreeMap<String, String>), CliError> {
    let name = args.profile.as_deref().unwrap_or(DEFAULT_PROFILE);
    let (mut profile, sources) = match Profile::named(name) {
        Some(profile) => (profile, BTreeMap::new()),
        None => load_profile(Path::new(name))?,
    };
    if let Some(code) = args.gripper {
        let values = profile.actions.gripper.with_code(code).ok_or_else(|| {
            CliError::input(format!(
                "--gripper {}: --profile {name} has grip forces, and no values for open and closed",
                code.name()
            ))
        })?;
        profile.actions.gripper = values;
    }
    Ok((profile, sources))
}

/// Refuses flags that the selected policy would ignore.
fn refuse_flags_without_effect(args: &PolicyArgs) -> Result<(), CliError> {
    let policy = args.policy();
    let is_server = matches!(policy, PolicyArg::Server(_));
    let is_lua = matches!(policy, PolicyArg::Lua(_));
    let flags = [
        ("--profile", args.profile.is_some() && !is_server),
        ("--protocol", args.protocol.is_some() && !is_server),
        ("--gripper", args.gripper.is_some() && !is_server && !is_lua),
        ("--policy-timeout", args.policy_timeout.is_some() && !is_server),
        ("--replan", args.replan.is_some() && !is_server && !is_lua),
    ];
    let Some((flag, _)) = flags.into_iter().find(|(_, is_ignored)| *is_ignored) else { return Ok(()) };
    let of_both = ["--replan", "--gripper"].contains(&flag);
    let kinds = if of_both { "policy servers and Lua policies" } else { "policy servers" };
    let policy = policy.word();
    Err(CliError::input(format!("{flag}: applies to {kinds} only; --policy {policy} ignores it")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(policy: PolicyArg) -> PolicyArgs {
        PolicyArgs {
            policy: Some(policy),
            name: None,
            profile: None,
            protocol: None,
            replan: None,
            gripper: None,
            policy_timeout: None,
        }
    }

    #[test]
    fn built_in_policies_have_the_names_that_are_listed() {
        for (name, _) in BuiltinPolicy::descriptions() {
            let policy = PolicyConfig::load(&args(parse_policy(&name).unwrap())).unwrap();
            assert_eq!(policy.name, name);
            assert_eq!(policy.privileged, !["noop", "random"].contains(&name.as_str()));
            if let Some(GripMode::Controller(controller)) = policy.expert() {
                assert_eq!(controller.name(), name, "experts read the name of the policy");
            }
        }
    }

    #[test]
    fn the_form_of_a_word_decides_what_kind_of_policy_it_is() {
        assert_eq!(parse_policy("ws://x:1"), Ok(PolicyArg::Server("ws://x:1".into())));
        assert_eq!(parse_policy("a/b.lua"), Ok(PolicyArg::Lua("a/b.lua".into())));
        assert_eq!(parse_policy("."), Ok(PolicyArg::Run(".".into())));
        assert!(parse_policy("exprt").unwrap_err().ends_with("did you mean expert?"));
        assert!(parse_profile("visoin").unwrap_err().ends_with("did you mean vision?"));
        for (name, about) in BuiltinPolicy::descriptions() {
            assert_eq!(parse_policy(&name).unwrap().word(), name);
            assert!(!about.is_empty());
        }
    }

    #[test]
    fn flags_without_effect_are_refused() {
        let message = |args: PolicyArgs| PolicyConfig::load(&args).unwrap_err().message;
        let noop = || args(PolicyArg::Builtin(BuiltinPolicy::Noop));
        let servo = PolicyArg::Builtin(BuiltinPolicy::TactileServo);
        assert_eq!(
            message(PolicyArgs { replan: Some(3), ..noop() }),
            "--replan: applies to policy servers and Lua policies only; --policy noop ignores it"
        );
        assert_eq!(
            message(PolicyArgs { gripper: Some(GripCode::Binary), ..noop() }),
            "--gripper: applies to policy servers and Lua policies only; --policy noop ignores it"
        );
        for (flag, args) in [
            ("--profile", PolicyArgs { profile: Some("vision".into()), ..noop() }),
            ("--protocol", PolicyArgs { protocol: Some(Protocol::VlaEval), ..noop() }),
            ("--policy-timeout", PolicyArgs { policy_timeout: Some(DEFAULT_TIMEOUT), ..args(servo) }),
        ] {
            assert!(message(args).starts_with(&format!("{flag}: applies to policy servers only")));
        }
    }
}
