//! [`RunChanges`]: what a run changes of its suite.

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::ShiftValue;
use softvt_common::{digest::sha256_hex, text::significant};

/// Changes of a run to its suite, and the seed of its draws. Each field is the value of one flag and, under its name,
/// a key of `run.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunChanges {
    /// Options of the script as they were typed.
    pub arguments: Vec<String>,
    pub shifts: Vec<ShiftValue>,
    /// Changed settings by path and value.
    pub set: Vec<(String, String)>,
    /// The twin of the suite that is run in its place.
    pub twin: Option<Twin>,
    /// File with the ranges within which the episodes vary, in place of those of the suite.
    pub vary: Option<String>,
    /// Base seed; the public one of a judged run.
    pub seed: u64,
    pub seed_hash: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Twin {
    Rigid,
}

impl RunChanges {
    pub fn is_rigid_twin(&self) -> bool {
        self.twin == Some(Twin::Rigid)
    }

    /// Name of a suite in results. It has a suffix if `vary` or the rigid twin changes the objects, whose places stay.
    pub fn suite_name(&self, suite: &str) -> String {
        let varied = if self.vary.is_some() { "_varied" } else { "" };
        let twin = if self.is_rigid_twin() { "_rigid_twin" } else { "" };
        format!("{suite}{varied}{twin}")
    }

    /// Shifts and settings as tables name them, such as `mass=2`; values have three digits.
    pub fn assignments(&self) -> Vec<String> {
        let shift = |ShiftValue { name, value }: &ShiftValue| format!("{name}={}", significant(*value, 3));
        self.shifts.iter().map(shift).chain(self.set_words()).collect()
    }

    fn shift_words(&self) -> impl Iterator<Item = String> {
        // As in run.json.
        self.shifts.iter().map(|ShiftValue { name, value }| format!("{name}={}", json!(value)))
    }

    fn set_words(&self) -> impl Iterator<Item = String> {
        self.set.iter().map(|(path, value)| format!("{path}={value}"))
    }

    /// The flags that state the changes, word by word, without the options of the script. The file of a secret is
    /// `FILE`.
    pub fn flags(&self) -> Vec<String> {
        // The value of this flag follows an equals sign.
        let mut words: Vec<String> = self.vary.iter().map(|file| format!("--vary={file}")).collect();
        words.extend(self.is_rigid_twin().then(|| "--rigid-twin".to_owned()));
        let mut add = |flag: &str, value: String| words.extend([flag.to_owned(), value]);
        match self.seed_hash {
            Some(_) => add("--seed-file", "FILE".to_owned()),
            None if self.seed > 0 => add("--seed", self.seed.to_string()),
            None => {}
        }
        self.shift_words().for_each(|word| add("--shift", word));
        self.set_words().for_each(|word| add("--set", word));
        words
    }

    /// SHA-256 of the changes. A public seed is no part of it, since each episode is named with its own.
    pub fn hash(&self) -> String {
        let all = json!(Self { seed: 0, ..self.clone() });
        sha256_hex(all.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changes() -> RunChanges {
        RunChanges {
            arguments: vec!["--size=2".into()],
            shifts: vec![ShiftValue { name: "mass".into(), value: 2.0 }],
            set: vec![("robot.gripper.effort".into(), "20".into())],
            twin: Some(Twin::Rigid),
            vary: Some("ranges.lua".into()),
            seed: 3,
            seed_hash: None,
        }
    }

    #[test]
    fn flags_state_every_change_and_nothing_else() {
        let stated = "--vary=ranges.lua --rigid-twin --seed 3 --shift mass=2.0 --set robot.gripper.effort=20";
        assert_eq!(changes().flags().join(" "), stated);
        assert_eq!(
            RunChanges { seed_hash: Some("ab".into()), ..Default::default() }.flags(),
            ["--seed-file", "FILE"]
        );
        assert!(RunChanges::default().flags().is_empty());
    }

    #[test]
    fn a_third_has_three_digits_in_tables_and_all_in_flags() {
        let shifts = vec![ShiftValue { name: "light".into(), value: 4.0 / 3.0 }];
        let changes = RunChanges { shifts, ..Default::default() };
        assert_eq!(changes.assignments(), ["light=1.33"]);
        assert_eq!(changes.flags(), ["--shift", "light=1.3333333333333333"]);
    }

    #[test]
    fn the_hash_depends_on_every_change_but_the_public_seed() {
        let hash = |change: fn(&mut RunChanges)| {
            let mut changed = changes();
            change(&mut changed);
            changed.hash()
        };
        let same = changes().hash();
        assert_eq!(hash(|changes| changes.seed = 4), same);
        let others: [fn(&mut RunChanges); 6] = [
            |changes| changes.arguments.clear(),
            |changes| changes.shifts.clear(),
            |changes| changes.set.clear(),
            |changes| changes.twin = None,
            |changes| changes.vary = None,
            |changes| changes.seed_hash = Some("ab".into()),
        ];
        assert!(others.into_iter().all(|change| hash(change) != same));
    }
}
