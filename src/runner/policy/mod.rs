//! The policy of a run: where it comes from, its options, the policy with its files read, and the controllers of the
//! episodes.

mod options;
mod source;

use std::{collections::BTreeMap, fmt, sync::Arc, time::Duration};

use self::source::suggestion;
pub use self::{
    options::{PolicyOptions, parse_profile},
    source::{BuiltinPolicy, PolicySource},
};
use crate::{error::RunError, recorded_runs::RecordedRuns};
use softvt_benchmark::seed::RandomStream;
use softvt_common::cancel;
use softvt_policy::{
    EpisodeBrief, Policy, SensorStreams, builtin,
    builtin::RecordedPolicy,
    profile::{GripCode, Profile},
    remote::{PolicyConnections, PolicyServer, RemotePolicy, ServerProtocol},
};
use softvt_rollout::{ChunkedPolicy, Controller};
use softvt_script::{EpisodeSetup, ExpertController, ExpertGrip, PolicyFile};

/// Environment variable with the key of a policy server. A flag would show it to other users of the machine.
const API_KEY: &str = "SOFTVT_API_KEY";
/// Actions executed from each chunk of a policy server, unless stated.
const DEFAULT_REPLAN: usize = 10;
/// Timeout of a policy server, unless stated.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(60);
/// Name of the clients of `softvt serve` in results, unless stated.
const CLIENT: &str = "client";

pub type ControllerFactory =
    Box<dyn Fn(EpisodeSetup, EpisodeBrief) -> Result<Box<dyn Controller>, RunError> + Send + Sync>;

#[derive(Clone, Debug)]
enum PolicyKind {
    Builtin(BuiltinPolicy),
    Lua(Arc<PolicyFile>),
    Server(Arc<PolicyServer>),
    /// Repeats the actions of recorded runs.
    Recorded(Arc<RecordedRuns>),
    Rust(RustPolicy),
    /// A client of `softvt serve`, with the encoding of its observations and actions.
    Client(Arc<Profile>),
    /// The actions come from elsewhere: a dataset or a single recorded episode.
    External,
}

type StartPolicy = dyn Fn(&EpisodeBrief) -> Box<dyn Policy> + Send + Sync;

#[derive(Clone)]
struct RustPolicy(Arc<StartPolicy>);

impl fmt::Debug for RustPolicy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RustPolicy")
    }
}

/// The sensors that the file of a policy declares.
#[derive(Clone, Debug)]
pub struct DeclaredStreams {
    pub place: String,
    pub streams: SensorStreams,
}

#[derive(Clone, Debug)]
pub struct PolicyConfig {
    kind: PolicyKind,
    pub name: String,
    /// Actions executed from each chunk, for policies that predict chunks.
    pub replan: Option<usize>,
    /// Grip code of the actions, if the profile, the file or the command line states one.
    pub gripper: Option<GripCode>,
    /// File of a policy in Lua, as messages name it.
    pub file: Option<String>,
    /// SHA-256 of the files of the policy, by name. A profile is a part of results as a whole, wherever its file lies.
    pub sources: BTreeMap<String, String>,
    /// Sensors that the file of the policy declares.
    pub declared: Option<DeclaredStreams>,
    /// True if the policy has access to ground-truth state, or to limits or materials of objects.
    pub privileged: bool,
}

impl Default for PolicyConfig {
    /// The scripted experts of the tasks.
    fn default() -> Self {
        Self::builtin(BuiltinPolicy::Expert)
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

    /// A policy in another program, with its profile.
    fn of_profile(kind: PolicyKind, name: String, options: &PolicyOptions, profile: &Profile) -> Self {
        let place = format!("profile {}: inputs", options.profile_name());
        Self {
            gripper: Some(profile.actions.gripper.code),
            declared: Some(DeclaredStreams { place, streams: profile.streams() }),
            ..Self::new(kind, name)
        }
    }

    pub fn builtin(policy: BuiltinPolicy) -> Self {
        Self::new(PolicyKind::Builtin(policy), policy.name().to_owned())
    }

    /// # Errors
    /// A file that is not valid, a folder without a run, or an option that has no effect on this policy.
    pub fn load(args: &PolicyOptions) -> Result<Self, RunError> {
        let args = &args.checked()?;
        let replan = args.replan.map(usize::from);
        let mut policy = match &args.policy {
            PolicySource::Builtin(policy) => Self::builtin(*policy),
            PolicySource::Lua(path) => {
                let file = Arc::new(PolicyFile::load(path)?);
                let place = format!("{}: policy.observes", file.observes_at);
                Self {
                    replan: replan.or(file.replan),
                    gripper: args.gripper.or(file.gripper),
                    file: Some(file.sources.main.clone()),
                    sources: file.sources.bundle.hashes(),
                    declared: Some(DeclaredStreams { place, streams: file.streams.clone() }),
                    privileged: file.privileged,
                    ..Self::new(PolicyKind::Lua(file.clone()), file.name.clone())
                }
            }
            PolicySource::Server(url) => {
                let profile = args.load_profile()?;
                if profile.observe_every_step && args.protocol == Some(ServerProtocol::VlaEval) {
                    let message = "observe_every_step needs the protocol openpi; in that of vla-eval every observation is a \
                                   request for actions";
                    return Err(RunError::of_setting("profile", args.profile_name(), message));
                }
                let name = profile.name.clone();
                let server = PolicyServer {
                    url: url.clone(),
                    protocol: args.protocol.unwrap_or_default(),
                    profile: profile.clone(),
                    timeout: args.timeout.unwrap_or(DEFAULT_TIMEOUT),
                    api_key: std::env::var(API_KEY).ok(),
                    cancel: &cancel::WITH_PROCESS,
                };
                let replan = replan.or(Some(DEFAULT_REPLAN));
                Self {
                    replan,
                    ..Self::of_profile(PolicyKind::Server(Arc::new(server)), name, args, &profile)
                }
            }
            PolicySource::Run(dir) => {
                Self::new(PolicyKind::Recorded(Arc::new(RecordedRuns::load(dir)?)), "replay".to_owned())
            }
        };
        if let Some(name) = &args.name {
            policy.name.clone_from(name);
        }
        Ok(policy)
    }

    pub fn named(name: &str) -> Result<Self, RunError> {
        BuiltinPolicy::named(name).map(Self::builtin).ok_or_else(|| {
            let hint = suggestion(name, BuiltinPolicy::all().map(BuiltinPolicy::name));
            RunError::input(format_args!("policy: expected {}, got {name:?}{hint}", BuiltinPolicy::names()))
        })
    }

    /// A policy in Rust, under this name in the results. `start` makes it for each episode; of each chunk of actions,
    /// all are executed unless `replan` is set.
    pub fn of(
        name: &str,
        start: impl Fn(&EpisodeBrief) -> Box<dyn Policy> + Send + Sync + 'static,
    ) -> Result<Self, RunError> {
        if BuiltinPolicy::named(name).is_some() {
            return Err(RunError::input(format_args!(
                "policy: {name:?} is a built-in policy; give yours another name"
            )));
        }
        Ok(Self::new(PolicyKind::Rust(RustPolicy(Arc::new(start))), name.to_owned()))
    }

    /// The clients of `softvt serve`. `privileged` clients receive the true state.
    ///
    /// # Errors
    /// A file that is not a valid profile.
    pub fn client(args: &PolicyOptions, privileged: bool) -> Result<Self, RunError> {
        let profile = args.load_profile()?;
        let name = args.name.clone().unwrap_or_else(|| CLIENT.to_owned());
        let kind = PolicyKind::Client(Arc::new(profile.clone()));
        Ok(Self { privileged, ..Self::of_profile(kind, name, args, &profile) })
    }

    /// Actions that come from elsewhere, under a name such as `replay`.
    pub fn external(name: &str) -> Self {
        Self::new(PolicyKind::External, name.to_owned())
    }

    /// Grip control of a scripted expert. `None` for other policies.
    pub fn expert(&self) -> Option<ExpertGrip> {
        match self.kind {
            PolicyKind::Builtin(policy) => policy.grip_mode(),
            _ => None,
        }
    }

    /// True for a grip that keeps one number constant, by what shows of an object.
    pub fn is_blind_bound(&self) -> bool {
        matches!(self.expert(), Some(ExpertGrip::Blind(grip)) if grip.is_constant_number())
    }

    /// True for a policy whose answers need not be the same in another attempt at an episode: one in another
    /// program, or in Rust.
    pub(crate) fn is_outside(&self) -> bool {
        matches!(self.kind, PolicyKind::Server(_) | PolicyKind::Client(_) | PolicyKind::Rust(_))
    }

    /// True for the clients of `softvt serve`.
    pub(crate) fn is_client(&self) -> bool {
        matches!(self.kind, PolicyKind::Client(_))
    }

    /// Encoding of the observations and actions of a policy in another program.
    pub fn profile(&self) -> Option<&Profile> {
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

    /// Connections to the server of the policy, if it has one. They are opened on demand.
    pub(crate) fn connections(&self) -> Option<Arc<PolicyConnections>> {
        match &self.kind {
            PolicyKind::Server(server) => Some(Arc::new(PolicyConnections::new((**server).clone()))),
            _ => None,
        }
    }

    /// Starts the policy for an episode, if it answers observations with chunks of actions.
    pub(crate) fn start(
        &self,
        connections: Option<&Arc<PolicyConnections>>,
        opened: &EpisodeSetup,
        brief: &EpisodeBrief,
    ) -> Result<Option<Box<dyn Policy>>, RunError> {
        Ok(match (&self.kind, connections) {
            (PolicyKind::Server(_), Some(connections)) => {
                Some(Box::new(RemotePolicy::new(connections.clone())))
            }
            (PolicyKind::Rust(start), _) => Some(start.0(brief)),
            (PolicyKind::Lua(file), _) => Some(Box::new(file.start(&opened.seed, self.gripper)?)),
            _ => None,
        })
    }

    /// A factory of controllers for the episodes of a suite; `connections` lead to its server.
    pub(crate) fn controller_factory(
        &self,
        connections: Option<Arc<PolicyConnections>>,
        suite: &str,
        is_rigid_twin: bool,
    ) -> ControllerFactory {
        let (policy, suite) = (self.clone(), suite.to_owned());
        let replan = self.replan.unwrap_or(usize::MAX);
        Box::new(move |opened, brief| {
            let chunked = |policy: Box<dyn Policy>, replan| -> Box<dyn Controller> {
                Box::new(ChunkedPolicy::new(policy, brief.clone(), replan))
            };
            if let Some(started) = policy.start(connections.as_ref(), &opened, &brief)? {
                return Ok(chunked(started, replan));
            }
            Ok(match &policy.kind {
                PolicyKind::Recorded(runs) => {
                    let actions = runs.actions(&suite, is_rigid_twin, &brief)?;
                    chunked(Box::new(RecordedPolicy::from_actions(&actions, None)), 1)
                }
                PolicyKind::Builtin(BuiltinPolicy::Noop) => chunked(Box::<builtin::NoopPolicy>::default(), 1),
                PolicyKind::Builtin(BuiltinPolicy::Random) => {
                    let seed = rand::RngCore::next_u64(&mut opened.seed.stream(RandomStream::Script));
                    chunked(Box::new(builtin::RandomPolicy::new(seed)), 1)
                }
                PolicyKind::Builtin(expert) => {
                    let mode = expert.grip_mode().unwrap_or(ExpertGrip::Commanded);
                    Box::new(expert_controller(opened, mode)?)
                }
                // The provider of the actions replaces this factory.
                PolicyKind::External
                | PolicyKind::Client(_)
                | PolicyKind::Server(_)
                | PolicyKind::Lua(_)
                | PolicyKind::Rust(_) => chunked(Box::new(RecordedPolicy::new(Vec::new(), None)), 1),
            })
        })
    }
}

/// # Errors
/// The task has none, or its script fails.
pub fn expert_controller(opened: EpisodeSetup, mode: ExpertGrip) -> Result<ExpertController, RunError> {
    opened.expert(mode).ok_or_else(|| RunError::input("the task has no expert"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_runs::record::PRIVILEGED_POLICIES;

    #[test]
    fn built_in_policies_have_names_and_those_of_privileged_ones_are_listed() {
        for policy in BuiltinPolicy::all() {
            let name = policy.name();
            let loaded = PolicyConfig::load(&PolicyOptions::new(PolicySource::Builtin(policy))).unwrap();
            assert_eq!(loaded.name, name);
            assert_eq!(loaded.privileged, PRIVILEGED_POLICIES.contains(&name), "{name}");
            assert!(!policy.about().is_empty());
        }
    }
}
