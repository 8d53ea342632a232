//! Policies of a run: the arguments with their files read, and the controllers of the episodes.

use std::{collections::BTreeMap, path::Path, sync::Arc, time::Duration};

use crate::{
    benchmark::seed::RandomStream,
    cli::{
        args::{DEFAULT_PROFILE, GripMode, GripperArg, PolicyArg, PolicyArgs, ProtocolArg},
        error::CliError,
        run::recorded_policy::RecordedRuns,
    },
    policy::{
        ChunkedPolicy, Policy, PolicyError, SensorStreams, TaskBrief, builtin,
        builtin::RecordedPolicy,
        profile::Profile,
        remote::{PolicyConnections, PolicyServer, Protocol, RemotePolicy},
    },
    rollout::{Controller, cancel},
    script::{EpisodeSetup, ExpertController, PolicyFile, load_profile},
};

/// Environment variable with the key of a policy server. A flag would show it to other users of the machine.
const API_KEY: &str = "SOFTVT_API_KEY";
/// Actions executed from each chunk of a policy server, unless `--replan` is given.
const DEFAULT_REPLAN: usize = 10;
/// Timeout of a policy server, unless `--policy-timeout` is given.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(60);

/// Makes the controller of an episode.
pub(crate) type ControllerFactory =
    Box<dyn Fn(EpisodeSetup, TaskBrief) -> Result<Box<dyn Controller>, CliError> + Sync>;

/// Configuration of a policy server.
#[derive(Debug)]
pub(crate) struct RemotePolicyConfig {
    pub url: String,
    pub protocol: Protocol,
    pub profile: Profile,
    /// The profile as `--profile` names it.
    pub profile_name: String,
    /// SHA-256 of the files of the profile, by name.
    pub sources: BTreeMap<String, String>,
    /// Actions executed from each chunk.
    pub replan: usize,
    pub timeout: Duration,
}

#[derive(Clone, Debug)]
pub(crate) enum PolicyKind {
    Expert(GripMode),
    Noop,
    Random,
    /// A policy in Lua, and the actions executed from each chunk if that is limited.
    Lua {
        file: Arc<PolicyFile>,
        replan: Option<usize>,
    },
    Server(Arc<RemotePolicyConfig>),
    /// Repeats the actions of recorded runs.
    Recorded(Arc<RecordedRuns>),
    /// The actions come from elsewhere: a client, a dataset or a single recorded episode.
    External,
}

/// A policy under the name that results show.
#[derive(Clone, Debug)]
pub(crate) struct PolicyConfig {
    kind: PolicyKind,
    name: String,
}

impl PolicyConfig {
    /// Loads the policy that the arguments select.
    ///
    /// # Errors
    /// A file that is not valid, a folder without a run, or a flag that has no effect on this policy.
    pub(crate) fn load(args: &PolicyArgs) -> Result<Self, CliError> {
        refuse_flags_without_effect(args)?;
        let (kind, name) = match &args.policy {
            PolicyArg::Expert(mode) => (PolicyKind::Expert(*mode), args.policy.word()),
            PolicyArg::Noop => (PolicyKind::Noop, args.policy.word()),
            PolicyArg::Random => (PolicyKind::Random, args.policy.word()),
            PolicyArg::Lua(path) => {
                let file = PolicyFile::load(path).map_err(CliError::input)?;
                let replan = args.replan.map(usize::from).or(file.replan);
                let name = file.name.clone();
                (PolicyKind::Lua { file: Arc::new(file), replan }, name)
            }
            PolicyArg::Server(url) => {
                let (profile, sources) = load_profile_of(args)?;
                let name = profile.name.clone();
                let server = RemotePolicyConfig {
                    url: url.clone(),
                    protocol: match args.protocol {
                        Some(ProtocolArg::VlaEval) => Protocol::VlaEval,
                        Some(ProtocolArg::Openpi) | None => Protocol::Openpi,
                    },
                    profile,
                    profile_name: args.profile.clone().unwrap_or_else(|| DEFAULT_PROFILE.to_owned()),
                    sources,
                    replan: args.replan.map_or(DEFAULT_REPLAN, usize::from),
                    timeout: args.policy_timeout.unwrap_or(DEFAULT_TIMEOUT),
                };
                (PolicyKind::Server(Arc::new(server)), name)
            }
            PolicyArg::Run(dir) => {
                (PolicyKind::Recorded(Arc::new(RecordedRuns::load(dir)?)), "replay".to_owned())
            }
        };
        Ok(Self { kind, name: args.name.clone().unwrap_or(name) })
    }

    /// The scripted experts of the tasks.
    pub(crate) fn expert() -> Self {
        let mode = GripMode::Commanded;
        Self { kind: PolicyKind::Expert(mode), name: mode.policy_name().to_owned() }
    }

    /// Actions that come from elsewhere, under a name such as `replay`.
    pub(crate) fn external(name: &str) -> Self {
        Self { kind: PolicyKind::External, name: name.to_owned() }
    }

    /// The name that results show.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Gripper control of the experts. `None` for other policies.
    pub(crate) fn grip_mode(&self) -> Option<GripMode> {
        match self.kind {
            PolicyKind::Expert(mode) => Some(mode),
            _ => None,
        }
    }

    /// True if the policy has access to ground-truth state.
    pub(crate) fn is_privileged(&self) -> bool {
        self.grip_mode().is_some()
    }

    pub(crate) fn is_remote(&self) -> bool {
        matches!(self.kind, PolicyKind::Server(_))
    }

    /// Profile of a policy server.
    pub(crate) fn profile(&self) -> Option<&Profile> {
        match &self.kind {
            PolicyKind::Server(server) => Some(&server.profile),
            _ => None,
        }
    }

    /// The sensors that a policy declares, and the source location of the declaration.
    pub(crate) fn declared_streams(&self) -> Option<(String, SensorStreams)> {
        match &self.kind {
            PolicyKind::Server(server) => {
                Some((format!("--profile {}: inputs", server.profile_name), server.profile.streams()))
            }
            PolicyKind::Lua { file, .. } => {
                Some((format!("{}: policy.observes", file.observes_at), file.streams.clone()))
            }
            _ => None,
        }
    }

    /// Actions executed from each chunk, for policies that predict chunks.
    pub(crate) fn replan(&self) -> Option<usize> {
        match &self.kind {
            PolicyKind::Server(server) => Some(server.replan),
            PolicyKind::Lua { replan, .. } => *replan,
            _ => None,
        }
    }

    /// File of a policy in Lua, as messages name it.
    pub(crate) fn file(&self) -> Option<&str> {
        match &self.kind {
            PolicyKind::Lua { file, .. } => Some(&file.main),
            _ => None,
        }
    }

    /// SHA-256 of the files of the policy or of its profile, by name.
    pub(crate) fn sources(&self) -> BTreeMap<String, String> {
        match &self.kind {
            PolicyKind::Lua { file, .. } => file.hashes(),
            PolicyKind::Server(server) => server.sources.clone(),
            _ => BTreeMap::new(),
        }
    }

    /// The recorded runs whose actions the policy repeats.
    pub(crate) fn recorded(&self) -> Option<&RecordedRuns> {
        match &self.kind {
            PolicyKind::Recorded(runs) => Some(runs),
            _ => None,
        }
    }

    /// Connections to the policy server, if there is one. Nothing is connected yet.
    pub(crate) fn connections(&self) -> Option<Arc<PolicyConnections>> {
        let PolicyKind::Server(server) = &self.kind else { return None };
        Some(Arc::new(PolicyConnections::new(PolicyServer {
            url: server.url.clone(),
            protocol: server.protocol,
            profile: server.profile.clone(),
            timeout: server.timeout,
            api_key: std::env::var(API_KEY).ok(),
            cancel: &cancel::FLAG,
        })))
    }

    /// A factory of controllers for the episodes of a suite; `connections` are those of [`Self::connections`].
    pub(crate) fn controller_factory(
        &self,
        connections: Option<Arc<PolicyConnections>>,
        suite: &str,
        is_rigid_twin: bool,
    ) -> ControllerFactory {
        let (kind, suite) = (self.kind.clone(), suite.to_owned());
        Box::new(move |opened, brief| {
            let chunked = |policy: Box<dyn Policy>, replan| -> Box<dyn Controller> {
                Box::new(ChunkedPolicy::new(policy, brief.clone(), replan))
            };
            Ok(match (&kind, &connections) {
                (PolicyKind::Server(server), Some(connections)) => {
                    chunked(Box::new(RemotePolicy::new(connections.clone())), server.replan)
                }
                (PolicyKind::Recorded(runs), _) => {
                    let actions = runs.actions(&suite, is_rigid_twin, &brief)?;
                    chunked(Box::new(RecordedPolicy::from_actions(&actions, None)), 1)
                }
                (PolicyKind::Lua { file, replan }, _) => {
                    let policy = file.start(&opened.seed).map_err(CliError::input)?;
                    chunked(Box::new(policy), replan.unwrap_or(usize::MAX))
                }
                (PolicyKind::Noop, _) => chunked(Box::<builtin::NoopPolicy>::default(), 1),
                (PolicyKind::Random, _) => {
                    let seed = rand::RngCore::next_u64(&mut opened.seed.stream(RandomStream::Script));
                    chunked(Box::new(builtin::RandomPolicy::new(seed)), 1)
                }
                (PolicyKind::Expert(mode), _) => Box::new(expert_controller(opened, *mode)?),
                // Whoever provides the actions replaces this factory.
                (PolicyKind::External | PolicyKind::Server(_), _) => {
                    chunked(Box::new(RecordedPolicy::new(Vec::new(), None)), 1)
                }
            })
        })
    }
}

/// Starts the expert of a task.
///
/// # Errors
/// The task has none, or its script fails.
pub(crate) fn expert_controller(opened: EpisodeSetup, mode: GripMode) -> Result<ExpertController, CliError> {
    let expert = opened.expert();
    let expert = expert.ok_or_else(|| CliError::input("the task has no expert"))?;
    Ok(match mode {
        GripMode::TactileServo => ExpertController::servo(expert),
        GripMode::Commanded | GripMode::Binary => ExpertController::new(expert, mode == GripMode::Binary),
    })
}

/// Loads the profile that the arguments select, with SHA-256 of its files by name.
///
/// # Errors
/// A file that is not a valid profile.
pub(crate) fn load_profile_of(args: &PolicyArgs) -> Result<(Profile, BTreeMap<String, String>), CliError> {
    let name = args.profile.as_deref().unwrap_or(DEFAULT_PROFILE);
    let (mut profile, sources) = match Profile::named(name) {
        Some(profile) => (profile, BTreeMap::new()),
        None => load_profile(Path::new(name)).map_err(CliError::input)?,
    };
    if let Some(mode) = args.gripper {
        profile.actions.gripper.binary = mode == GripperArg::Binary;
    }
    Ok((profile, sources))
}

/// Refuses flags that the selected policy would ignore.
fn refuse_flags_without_effect(args: &PolicyArgs) -> Result<(), CliError> {
    let is_server = matches!(args.policy, PolicyArg::Server(_));
    let is_lua = matches!(args.policy, PolicyArg::Lua(_));
    let flags = [
        ("--profile", args.profile.is_some() && !is_server),
        ("--protocol", args.protocol.is_some() && !is_server),
        ("--gripper", args.gripper.is_some() && !is_server),
        ("--policy-timeout", args.policy_timeout.is_some() && !is_server),
        ("--replan", args.replan.is_some() && !is_server && !is_lua),
    ];
    let Some((flag, _)) = flags.into_iter().find(|(_, is_ignored)| *is_ignored) else { return Ok(()) };
    let kinds = if flag == "--replan" { "policy servers and Lua policies" } else { "policy servers" };
    let policy = args.policy.word();
    Err(CliError::input(format!("{flag}: applies to {kinds} only; --policy {policy} ignores it")))
}

/// Converts the error of a policy server.
pub(crate) fn policy_failure(error: PolicyError) -> CliError {
    match error {
        PolicyError::Interrupted => CliError::interrupted("interrupted"),
        PolicyError::Address(message) => CliError::input(message),
        other => CliError::policy(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::POLICIES;

    fn args(policy: PolicyArg) -> PolicyArgs {
        PolicyArgs {
            policy,
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
        use GripMode::{Binary, Commanded, TactileServo};
        let experts = [Commanded, Binary, TactileServo].map(PolicyArg::Expert);
        let specs = experts.into_iter().chain([PolicyArg::Noop, PolicyArg::Random]);
        for ((name, _), spec) in POLICIES.into_iter().zip(specs) {
            let policy = PolicyConfig::load(&args(spec)).unwrap();
            assert_eq!(policy.name(), name);
            assert_eq!(policy.is_privileged(), name.starts_with("expert") || name == "tactile-servo");
        }
    }

    #[test]
    fn flags_without_effect_are_refused() {
        let message = |args: PolicyArgs| PolicyConfig::load(&args).unwrap_err().message;
        let noop = || args(PolicyArg::Noop);
        let servo = PolicyArg::Expert(GripMode::TactileServo);
        assert_eq!(
            message(PolicyArgs { replan: Some(3), ..noop() }),
            "--replan: applies to policy servers and Lua policies only; --policy noop ignores it"
        );
        for (flag, args) in [
            ("--profile", PolicyArgs { profile: Some("vision".into()), ..noop() }),
            ("--protocol", PolicyArgs { protocol: Some(ProtocolArg::VlaEval), ..noop() }),
            (
                "--gripper",
                PolicyArgs { gripper: Some(GripperArg::Binary), ..args(PolicyArg::Lua("x.lua".into())) },
            ),
            ("--policy-timeout", PolicyArgs { policy_timeout: Some(DEFAULT_TIMEOUT), ..args(servo) }),
        ] {
            assert!(message(args).starts_with(&format!("{flag}: applies to policy servers only")));
        }
    }
}
