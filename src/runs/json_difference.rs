//! The first difference of two documents, in words.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::{Value, json};

use softvt_common::text::shortened;

/// Longest value that a message shows in full, in characters.
const MAX_SHOWN_CHARS: usize = 80;

/// Describes the first difference of two documents: its path and both values.
pub fn json_difference(before: &impl Serialize, now: &impl Serialize) -> Option<String> {
    difference("", &json!(before), &json!(now))
}

fn difference(path: &str, before: &Value, now: &Value) -> Option<String> {
    let inner = |key: &str, before: Option<&Value>, now: Option<&Value>| {
        let path = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        difference(&path, before.unwrap_or(&Value::Null), now.unwrap_or(&Value::Null))
    };
    match (before, now) {
        (Value::Object(a), Value::Object(b)) => {
            let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            keys.into_iter().find_map(|key| inner(key, a.get(key), b.get(key)))
        }
        (Value::Array(a), Value::Array(b)) => {
            (0..a.len().max(b.len())).find_map(|at| inner(&at.to_string(), a.get(at), b.get(at)))
        }
        _ if before == now => None,
        // Two SHA-256 tell a reader nothing.
        (Value::String(a), Value::String(b)) if (a.len(), b.len()) == (64, 64) => {
            Some(format!("{path}: has changed"))
        }
        _ => {
            let [before, now] = [before, now].map(|value| shortened(&value.to_string(), MAX_SHOWN_CHARS));
            Some(format!("{path}: {before} before, {now} now"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_named_by_its_path() {
        let a = json!({ "seed": 0, "settings": { "physics": { "dt": 0.0166 } }, "shifts": [["mass", 2]] });
        assert_eq!(json_difference(&a, &a), None);
        let changed = |key: &str, value: Value| {
            let mut b = a.clone();
            b[key] = value;
            json_difference(&a, &b).unwrap()
        };
        let settings = json!({ "physics": { "dt": 0.01 } });
        assert_eq!(changed("settings", settings), "settings.physics.dt: 0.0166 before, 0.01 now");
        assert_eq!(changed("shifts", json!([["mass", 3]])), "shifts.0.1: 2 before, 3 now");
        assert_eq!(changed("shifts", json!([])), "shifts.0: [\"mass\",2] before, null now");
        let hashes = [json!(["a".repeat(64)]), json!(["b".repeat(64)])];
        assert_eq!(json_difference(&hashes[0], &hashes[1]).unwrap(), "0: has changed");
        assert!(changed("seed", json!("x".repeat(300))).chars().count() < 120);
    }
}
