//! The policy of a run: its options, the policy with its files read, and the controllers of the episodes.

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
    sync::Arc,
    time::Duration,
};

use crate::{error::RunError, recorded_runs::RecordedRuns};
use softvt_benchmark::{Teacher, seed::RandomStream};
use softvt_common::cancel;
use softvt_common::text;
use softvt_dataset::layout::is_dataset;
use softvt_policy::{
    EpisodeBrief, Policy, SensorStreams, builtin,
    builtin::RecordedPolicy,
    profile::{GripCode, PROFILES, Profile},
    remote::{PolicyConnections, PolicyServer, RemotePolicy, ServerProtocol},
};
use softvt_rollout::{ChunkedPolicy, Controller};
use softvt_script::{BlindGrip, EpisodeSetup, ExpertController, ExpertGrip, PolicyFile, load_profile};

/// Environment variable with the key of a policy server. A flag would show it to other users of the machine.
const API_KEY: &str = "SOFTVT_API_KEY";
/// Actions executed from each chunk of a policy server, unless stated.
const DEFAULT_REPLAN: usize = 10;
/// Timeout of a policy server, unless stated.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(60);
/// Name of the clients of `softvt serve` in results, unless stated.
const CLIENT: &str = "client";
/// Profile of a policy server, unless stated.
const DEFAULT_PROFILE: &str = "visuo_tactile";

/// A policy that is not loaded yet, and how it is connected. By default, the expert of the task.
#[derive(Clone, Debug, Default)]
pub struct PolicyOptions {
    /// The policy.
    pub source: PolicySource,
    /// Observations and action encoding of a policy server: a name or a Lua file.
    pub profile: Option<String>,
    /// Protocol of a policy server.
    pub protocol: Option<ServerProtocol>,
    /// Grip code in place of that of the profile or the Lua policy.
    pub gripper: Option<GripCode>,
    /// Actions executed from each predicted chunk.
    pub replan: Option<u16>,
    /// Timeout for connecting and for each reply.
    pub timeout: Option<Duration>,
    /// Name in results.
    pub name: Option<String>,
}

impl PolicyOptions {
    /// A policy without options.
    pub fn new(source: PolicySource) -> Self {
        Self { source, ..Self::default() }
    }

    /// These options for each of several policies. A policy goes without those that act on others of them only; an
    /// option that acts on none is left to [`PolicyConfig::load`] to refuse.
    pub fn shared_by(&self, sources: &[PolicySource]) -> Vec<Self> {
        let of = |source: &PolicySource| Self { source: source.clone(), ..self.clone() };
        let acts_somewhere =
            |option: &str| sources.iter().any(|source| !of(source).without_effect().contains(&option));
        let shared = sources.iter().map(|source| {
            let mut options = of(source);
            for option in options.without_effect().into_iter().filter(|option| acts_somewhere(option)) {
                match option {
                    "profile" => options.profile = None,
                    "protocol" => options.protocol = None,
                    "gripper" => options.gripper = None,
                    "timeout" => options.timeout = None,
                    _ => options.replan = None,
                }
            }
            options
        });
        shared.collect()
    }

    /// Names of the options that the policy would ignore.
    fn without_effect(&self) -> Vec<&'static str> {
        let is_server = matches!(self.source, PolicySource::Server(_));
        let is_lua = matches!(self.source, PolicySource::Lua(_));
        let options = [
            ("profile", self.profile.is_some() && !is_server),
            ("protocol", self.protocol.is_some() && !is_server),
            ("gripper", self.gripper.is_some() && !is_server && !is_lua),
            ("timeout", self.timeout.is_some() && !is_server),
            ("replan", self.replan.is_some() && !is_server && !is_lua),
        ];
        options.into_iter().filter(|(_, is_ignored)| *is_ignored).map(|(option, _)| option).collect()
    }
}

/// Sources of policies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PolicySource {
    /// A policy that needs no file.
    Builtin(BuiltinPolicy),
    /// A policy in Lua.
    Lua(PathBuf),
    /// The address of a policy server.
    Server(String),
    /// A run folder whose actions are repeated, or a folder that contains run folders.
    Run(PathBuf),
}

impl Default for PolicySource {
    fn default() -> Self {
        Self::Builtin(BuiltinPolicy::Expert)
    }
}

impl From<Teacher> for PolicySource {
    fn from(teacher: Teacher) -> Self {
        Self::Builtin(match teacher {
            Teacher::Expert => BuiltinPolicy::Expert,
            Teacher::TactileServo => BuiltinPolicy::TactileServo,
        })
    }
}

/// Policies that need no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuiltinPolicy {
    /// The expert of the task.
    Expert,
    /// The expert with a hand that closes fully.
    ExpertBinary,
    /// The expert with a hand that feels how firmly it must hold.
    TactileServo,
    /// The expert with the grip of a controller that does not feel.
    Controlled(BlindGrip),
    /// A robot that holds still.
    Noop,
    /// Random actions.
    Random,
}

impl BuiltinPolicy {
    /// All, in the order in which they are listed.
    pub const ALL: [Self; 13] = [
        Self::Expert,
        Self::ExpertBinary,
        Self::TactileServo,
        Self::Controlled(BlindGrip::FixedClosure),
        Self::Controlled(BlindGrip::SizeSeen),
        Self::Controlled(BlindGrip::ContactDepth),
        Self::Controlled(BlindGrip::OneForce),
        Self::Controlled(BlindGrip::OneForceForAll),
        Self::Controlled(BlindGrip::Drives),
        Self::Controlled(BlindGrip::LookRetry),
        Self::Controlled(BlindGrip::Weigh),
        Self::Noop,
        Self::Random,
    ];

    /// The policy of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|policy| policy.name() == name)
    }

    /// The name that `--policy` takes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Expert => "expert",
            Self::ExpertBinary => "expert-binary",
            Self::TactileServo => "tactile-servo",
            Self::Controlled(controller) => controller.name(),
            Self::Noop => "noop",
            Self::Random => "random",
        }
    }

    /// Description, in one line.
    pub fn about(self) -> &'static str {
        match self {
            Self::Expert => {
                "the scripted expert of the task (privileged: it has access to ground-truth state)"
            }
            Self::ExpertBinary => "the same expert with a gripper that is either open or closed (privileged)",
            Self::TactileServo => {
                "the same expert, feeling in the tactile markers how firmly it must hold (privileged)"
            }
            Self::Controlled(controller) => match controller {
                BlindGrip::FixedClosure => {
                    "the same expert with one constant number: one closure per kind of object (privileged)"
                }
                BlindGrip::SizeSeen => {
                    "the same expert with one constant number: the best closure for the size of the object (privileged)"
                }
                BlindGrip::ContactDepth => {
                    "the same expert with one constant number: the best indentation after first contact (privileged)"
                }
                BlindGrip::OneForce => {
                    "the same expert with one constant number: the best force per kind of object (privileged)"
                }
                BlindGrip::OneForceForAll => {
                    "the same expert with one constant number: the best force for all objects of the suite (privileged)"
                }
                BlindGrip::Drives => {
                    "the same expert with one constant number: reads the width and the force of the finger drives (privileged)"
                }
                BlindGrip::LookRetry => {
                    "the same expert without touch: lifts, looks whether the object follows, and closes further (privileged)"
                }
                BlindGrip::Weigh => {
                    "the same expert without touch: lifts, weighs the object by the droop of the arm, and closes further (privileged)"
                }
            },
            Self::Noop => "holds still with the gripper open",
            Self::Random => "moves at random",
        }
    }

    /// How the gripper is controlled, for scripted experts, which have access to ground-truth state.
    fn grip_mode(self) -> Option<ExpertGrip> {
        Some(match self {
            Self::Expert => ExpertGrip::Commanded,
            Self::ExpertBinary => ExpertGrip::Binary,
            Self::TactileServo => ExpertGrip::TactileServo,
            Self::Controlled(controller) => ExpertGrip::Blind(controller),
            Self::Noop | Self::Random => return None,
        })
    }
}

impl PolicySource {
    /// As it was typed.
    pub fn word(&self) -> String {
        match self {
            Self::Builtin(policy) => policy.name().to_owned(),
            Self::Lua(path) | Self::Run(path) => path.display().to_string(),
            Self::Server(url) => url.clone(),
        }
    }
}

impl FromStr for PolicySource {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        if let Some(policy) = BuiltinPolicy::named(word) {
            return Ok(Self::Builtin(policy));
        }
        Ok(match word {
            address if address.contains("://") => Self::Server(address.to_owned()),
            file if file.ends_with(".lua") => Self::Lua(file.into()),
            data if is_dataset(Path::new(data)) => {
                return Err(format!(
                    "{data} is a dataset, not a policy; a replay simulates its demonstrations again, and an import executes \
                     those of another simulator"
                ));
            }
            folder if Path::new(folder).is_dir() => Self::Run(folder.into()),
            other => {
                let known = BuiltinPolicy::ALL.map(BuiltinPolicy::name);
                let is_address = other.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
                let hint = match is_address {
                    true => format!("; did you mean ws://{other}?"),
                    false => suggestion(other, known.into_iter()),
                };
                return Err(format!(
                    "expected {}, a Lua file such as my_policy.lua, a server such as ws://host:8000, or a run folder{hint}",
                    known.join(", ")
                ));
            }
        })
    }
}

/// Checks the name of a profile, or the end of the path of its file.
///
/// # Errors
/// The word is neither a known name nor the path of a Lua file. The message continues "invalid value".
pub fn parse_profile(word: &str) -> Result<String, String> {
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

/// Makes the controller of an episode.
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

/// Makes a policy for an episode.
type StartPolicy = dyn Fn(&EpisodeBrief) -> Box<dyn Policy> + Send + Sync;

/// A policy in Rust.
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
    /// Source location of the declaration.
    pub place: String,
    /// The declared sensors.
    pub streams: SensorStreams,
}

/// A loaded policy.
#[derive(Clone, Debug)]
pub struct PolicyConfig {
    kind: PolicyKind,
    /// The name that results show.
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

    /// A built-in policy.
    pub fn builtin(policy: BuiltinPolicy) -> Self {
        Self::new(PolicyKind::Builtin(policy), policy.name().to_owned())
    }

    /// Loads a policy.
    ///
    /// # Errors
    /// A file that is not valid, a folder without a run, or an option that has no effect on this policy.
    pub fn load(args: &PolicyOptions) -> Result<Self, RunError> {
        refuse_options_without_effect(args)?;
        let replan = args.replan.map(usize::from);
        let mut policy = match &args.source {
            PolicySource::Builtin(policy) => Self::builtin(*policy),
            PolicySource::Lua(path) => {
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
            PolicySource::Server(url) => {
                let profile = load_profile_of(args)?;
                let profile_name = args.profile.as_deref().unwrap_or(DEFAULT_PROFILE);
                if profile.observe_every_step && args.protocol == Some(ServerProtocol::VlaEval) {
                    let message = "observe_every_step needs the protocol openpi; in that of vla-eval every observation is a \
                                   request for actions";
                    return Err(RunError::of_setting("profile", profile_name, message));
                }
                let declared = declared_streams(args, &profile);
                Self {
                    name: profile.name.clone(),
                    replan: replan.or(Some(DEFAULT_REPLAN)),
                    gripper: Some(profile.actions.gripper.code),
                    file: None,
                    sources: BTreeMap::new(),
                    declared: Some(declared),
                    privileged: false,
                    kind: PolicyKind::Server(Arc::new(PolicyServer {
                        url: url.clone(),
                        protocol: args.protocol.unwrap_or_default(),
                        profile,
                        timeout: args.timeout.unwrap_or(DEFAULT_TIMEOUT),
                        api_key: std::env::var(API_KEY).ok(),
                        cancel: &cancel::WITH_PROCESS,
                    })),
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

    /// The built-in policy of a name.
    ///
    /// # Errors
    /// No policy has the name.
    pub fn named(name: &str) -> Result<Self, RunError> {
        BuiltinPolicy::named(name).map(Self::builtin).ok_or_else(|| {
            let known = BuiltinPolicy::ALL.map(BuiltinPolicy::name);
            let hint = suggestion(name, known.into_iter());
            RunError::input(format!("policy: expected {}, got {name:?}{hint}", known.join(", ")))
        })
    }

    /// A policy in Rust, under this name in the results. `start` makes it for each episode; of each chunk of actions,
    /// all are executed unless `replan` is set.
    ///
    /// # Errors
    /// A built-in policy has the name.
    pub fn of(
        name: &str,
        start: impl Fn(&EpisodeBrief) -> Box<dyn Policy> + Send + Sync + 'static,
    ) -> Result<Self, RunError> {
        if BuiltinPolicy::named(name).is_some() {
            return Err(RunError::input(format!(
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
        let profile = load_profile_of(args)?;
        Ok(Self {
            name: args.name.clone().unwrap_or_else(|| CLIENT.to_owned()),
            replan: None,
            gripper: Some(profile.actions.gripper.code),
            file: None,
            sources: BTreeMap::new(),
            declared: Some(declared_streams(args, &profile)),
            privileged,
            kind: PolicyKind::Client(Arc::new(profile)),
        })
    }

    /// Actions that come from elsewhere, under a name such as `replay`.
    pub fn external(name: &str) -> Self {
        Self::new(PolicyKind::External, name.to_owned())
    }

    /// How a scripted expert controls the gripper. `None` for other policies.
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

    /// The server of the policy, if it has one.
    pub(crate) fn server(&self) -> Option<&PolicyServer> {
        match &self.kind {
            PolicyKind::Server(server) => Some(server),
            _ => None,
        }
    }

    /// True for a policy whose answers need not be the same in another attempt at an episode: one in another program,
    /// or in Rust.
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

    /// True if the policy repeats the actions of recorded runs.
    pub(crate) fn is_recorded(&self) -> bool {
        self.recorded().is_some()
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
        self.server().map(|server| Arc::new(PolicyConnections::new(server.clone())))
    }

    /// Starts the policy for an episode, if it answers observations with chunks of actions.
    ///
    /// # Errors
    /// The script of a policy in Lua fails.
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

/// The sensors that a profile observes.
fn declared_streams(args: &PolicyOptions, profile: &Profile) -> DeclaredStreams {
    let name = args.profile.as_deref().unwrap_or(DEFAULT_PROFILE);
    DeclaredStreams { place: format!("profile {name}: inputs"), streams: profile.streams() }
}

/// Starts the expert of a task.
///
/// # Errors
/// The task has none, or its script fails.
pub fn expert_controller(opened: EpisodeSetup, mode: ExpertGrip) -> Result<ExpertController, RunError> {
    opened.expert(mode).ok_or_else(|| RunError::input("the task has no expert"))
}

/// Loads the profile that the arguments select.
///
/// # Errors
/// A file that is not a valid profile.
fn load_profile_of(args: &PolicyOptions) -> Result<Profile, RunError> {
    let name = args.profile.as_deref().unwrap_or(DEFAULT_PROFILE);
    let mut profile = match Profile::named(name) {
        Some(profile) => profile,
        None => load_profile(Path::new(name))?,
    };
    if let Some(code) = args.gripper {
        let values = profile.actions.gripper.with_code(code).ok_or_else(|| {
            let message = format!("the profile {name} has grip forces, and no values for open and closed");
            RunError::of_setting("gripper", code.name(), message)
        })?;
        profile.actions.gripper = values;
    }
    Ok(profile)
}

/// Refuses options that the policy would ignore.
fn refuse_options_without_effect(args: &PolicyOptions) -> Result<(), RunError> {
    let Some(option) = args.without_effect().first().copied() else { return Ok(()) };
    let of_both = ["replan", "gripper"].contains(&option);
    let kinds = if of_both { "policy servers and Lua policies" } else { "policy servers" };
    let policy = args.source.word();
    let message = format!("applies to {kinds} only; the policy {policy} ignores it");
    Err(RunError::of_setting(option, "", message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_runs::record::PRIVILEGED_POLICIES;

    #[test]
    fn built_in_policies_have_names_and_those_of_privileged_ones_are_listed() {
        for policy in BuiltinPolicy::ALL {
            let name = policy.name();
            assert_eq!(name.parse(), Ok(PolicySource::Builtin(policy)));
            assert_eq!(PolicySource::Builtin(policy).word(), name);
            let loaded = PolicyConfig::load(&PolicyOptions::new(PolicySource::Builtin(policy))).unwrap();
            assert_eq!(loaded.name, name);
            assert_eq!(loaded.privileged, PRIVILEGED_POLICIES.contains(&name), "{name}");
            assert!(!policy.about().is_empty());
        }
    }

    #[test]
    fn the_form_of_a_word_decides_what_kind_of_policy_it_is() {
        assert_eq!("ws://x:1".parse(), Ok(PolicySource::Server("ws://x:1".into())));
        assert_eq!("a/b.lua".parse(), Ok(PolicySource::Lua("a/b.lua".into())));
        assert_eq!(".".parse(), Ok(PolicySource::Run(".".into())));
        assert!("exprt".parse::<PolicySource>().unwrap_err().ends_with("did you mean expert?"));
        assert!(parse_profile("visoin").unwrap_err().ends_with("did you mean vision?"));
    }

    #[test]
    fn options_without_effect_are_refused() {
        let message = |options: PolicyOptions| PolicyConfig::load(&options).unwrap_err().to_string();
        let noop = || PolicyOptions::new(PolicySource::Builtin(BuiltinPolicy::Noop));
        let servo = || PolicyOptions::new(PolicySource::Builtin(BuiltinPolicy::TactileServo));
        assert_eq!(
            message(PolicyOptions { replan: Some(3), ..noop() }),
            "replan: applies to policy servers and Lua policies only; the policy noop ignores it"
        );
        assert_eq!(
            message(PolicyOptions { gripper: Some(GripCode::Binary), ..noop() }),
            "gripper: applies to policy servers and Lua policies only; the policy noop ignores it"
        );
        for (flag, options) in [
            ("profile", PolicyOptions { profile: Some("vision".into()), ..noop() }),
            ("protocol", PolicyOptions { protocol: Some(ServerProtocol::VlaEval), ..noop() }),
            ("timeout", PolicyOptions { timeout: Some(DEFAULT_TIMEOUT), ..servo() }),
        ] {
            assert!(message(options).starts_with(&format!("{flag}: applies to policy servers only")));
        }
    }

    #[test]
    fn several_policies_share_the_options_that_act_on_any_of_them() {
        let [noop, server] = ["noop", "ws://x:1"].map(|word| word.parse::<PolicySource>().unwrap());
        let options = PolicyOptions { replan: Some(3), profile: Some("vision".into()), ..Default::default() };
        let shared = options.shared_by(&[noop.clone(), server]);
        assert_eq!((shared[0].replan, &shared[0].profile), (None, &None));
        assert_eq!((shared[1].replan, shared[1].profile.as_deref()), (Some(3), Some("vision")));
        let ignored = options.shared_by(&[noop]);
        assert!(PolicyConfig::load(&ignored[0]).is_err(), "an option that acts on none is refused");
    }
}
