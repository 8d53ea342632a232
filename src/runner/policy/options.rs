//! [`PolicyOptions`]: a policy that is not loaded yet, and how it is connected.

use std::{path::Path, time::Duration};

use super::source::{PolicySource, suggestion};
use crate::{effect::differing_fields, error::RunError};
use softvt_policy::{
    profile::{GripCode, PROFILES, Profile},
    remote::ServerProtocol,
};
use softvt_script::load_profile;

/// Profile of a policy server, unless stated.
const DEFAULT_PROFILE: &str = "visuo_tactile";

/// A policy that is not loaded yet, and how it is connected. By default, the expert of the task.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolicyOptions {
    pub policy: PolicySource,
    /// Observations and action encoding of a policy server: a name or a Lua file.
    pub profile: Option<String>,
    pub protocol: Option<ServerProtocol>,
    /// Grip code in place of that of the profile or the Lua policy.
    pub gripper: Option<GripCode>,
    /// Actions executed from each predicted chunk.
    pub replan: Option<u16>,
    /// Timeout for connecting and for each reply.
    pub timeout: Option<Duration>,
    pub name: Option<String>,
}

impl PolicyOptions {
    pub fn new(policy: PolicySource) -> Self {
        Self { policy, ..Self::default() }
    }

    /// The options that the policy reads; the others are at their defaults.
    fn read(&self) -> Self {
        let Self { policy, gripper, replan, name, .. } = self.clone();
        match policy {
            PolicySource::Server(_) => self.clone(),
            PolicySource::Lua(_) => Self { policy, gripper, replan, name, ..Self::default() },
            PolicySource::Builtin(_) | PolicySource::Run(_) => Self { policy, name, ..Self::default() },
        }
    }

    /// Names of the options in which others differ.
    pub fn differing(&self, others: &Self) -> Vec<&'static str> {
        differing_fields!(self, others, Self { policy, profile, protocol, gripper, replan, timeout, name })
    }

    pub(super) fn checked(&self) -> Result<Self, RunError> {
        let read = self.read();
        match self.differing(&read).first() {
            None => Ok(read),
            Some(option) => Err(no_effect(option, [&self.policy])),
        }
    }

    /// These options for each of several policies, as far as it reads them.
    pub fn shared_by(&self, policies: &[PolicySource]) -> Result<Vec<Self>, RunError> {
        let given = policies.iter().map(|policy| Self { policy: policy.clone(), ..self.clone() });
        let (mut read, mut unread): (Vec<Self>, Option<Vec<&str>>) = (Vec::new(), None);
        for options in given {
            let own = options.read();
            let of_policy = options.differing(&own);
            match &mut unread {
                Some(unread) => unread.retain(|option| of_policy.contains(option)),
                None => unread = Some(of_policy),
            }
            read.push(own);
        }
        match unread.iter().flatten().next() {
            None => Ok(read),
            Some(option) => Err(no_effect(option, policies)),
        }
    }

    pub(super) fn profile_name(&self) -> &str {
        self.profile.as_deref().unwrap_or(DEFAULT_PROFILE)
    }

    /// Loads the profile, with the grip code of the options.
    pub(super) fn load_profile(&self) -> Result<Profile, RunError> {
        let name = self.profile_name();
        let mut profile = match Profile::named(name) {
            Some(profile) => profile,
            None => load_profile(Path::new(name))?,
        };
        if let Some(code) = self.gripper {
            profile.actions.gripper = profile.actions.gripper.with_code(code).ok_or_else(|| {
                let message =
                    format!("the profile {name} has grip forces, and no values for open and closed");
                RunError::of_setting("gripper", code.name(), message)
            })?;
        }
        Ok(profile)
    }
}

/// An option that none of the policies reads.
fn no_effect<'a>(option: &'static str, policies: impl IntoIterator<Item = &'a PolicySource>) -> RunError {
    let words: Vec<String> = policies.into_iter().map(PolicySource::word).collect();
    RunError::of_setting(
        option,
        "",
        format!("has no effect on the policy {}; leave it out", words.join(", ")),
    )
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_that_no_policy_reads_is_refused() {
        let [noop, server] = ["noop", "ws://x:1"].map(|word| word.parse::<PolicySource>().unwrap());
        let options = PolicyOptions { replan: Some(3), profile: Some("vision".into()), ..Default::default() };
        let shared = options.shared_by(&[noop.clone(), server]).unwrap();
        assert_eq!((shared[0].replan, &shared[0].profile), (None, &None));
        assert_eq!((shared[1].replan, shared[1].profile.as_deref()), (Some(3), Some("vision")));
        let refused = options.shared_by(&[noop]).unwrap_err().to_string();
        assert_eq!(refused, "profile: has no effect on the policy noop; leave it out");
        let lua = PolicyOptions {
            timeout: Some(Duration::from_secs(1)),
            ..PolicyOptions::new("a.lua".parse().unwrap())
        };
        assert!(lua.checked().unwrap_err().to_string().starts_with("timeout: "));
        assert!(parse_profile("visoin").unwrap_err().ends_with("did you mean vision?"));
    }
}
