//! Judged runs: a secret seed whose hash is all that results and policies see.

use std::{fs, path::Path};

use crate::{
    serve::{Server, get, map},
    support::{Project, Small},
};

const SECRET: &str = "correct horse battery staple";

/// A suite whose cube lies elsewhere in every episode, with two seed files and a policy that tells what it is told.
fn project() -> Project {
    let small =
        Small { task: "budget_steps = 3", at: "at = { rng:uniform(-0.05, 0.05), 0.1 }", ..Small::default() };
    let text = small.text().replacen("function(scene)", "function(scene, rng)", 1);
    let project = Project::new(&[("x.lua", &text)]);
    project.write("secret", SECRET.as_bytes());
    project.write("other", format!("{SECRET}\n").as_bytes());
    project.write(
        "p.lua",
        b"return softvt.policy { name = 'p', reset = function(task)
  assert(task.suite == nil and task.task == nil and task.episode == nil and task.prompt == 'wait')
  assert(#task.id == 32 and not task.id:find '[^0-9a-f]')
end,
act = function(obs) return { position = obs.position, axis_angle = obs.axis_angle, closure = 0 } end }
",
    );
    project
}

/// All text in a folder.
fn contents(folder: &Path) -> String {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries
        .map(|path| match path.is_dir() {
            true => contents(&path),
            false => String::from_utf8_lossy(&fs::read(&path).expect("a file")).into_owned(),
        })
        .collect()
}

#[test]
fn results_hold_the_hash_of_the_seed_and_only_who_has_the_file_can_repeat_them() {
    let project = project();
    let line = "x.lua --policy noop --episodes 4";
    project.succeeds(&format!("{line} --threads 1 --seed-file secret --out one"));
    project.succeeds(&format!("{line} --threads 2 --seed-file secret --out two"));
    assert_eq!(project.text("one/episodes.jsonl"), project.text("two/episodes.jsonl"));
    let info = project.json("one/run.json");
    let hash = info["seed_hash"].as_str().expect("a hash");
    assert_eq!(hash.len(), 64);
    assert!(!contents(&project.path("one")).contains(SECRET));
    // The seed of the records is one of the hash: another run with it has other draws.
    let public = info["seed"].as_u64().expect("a number");
    assert_eq!(format!("{public:012x}"), hash[..12]);
    let states = |out: &str| -> Vec<String> {
        project
            .lines(&format!("{out}/episodes.jsonl"))
            .iter()
            .map(|line| line["state_hash"].to_string())
            .collect()
    };
    project.succeeds(&format!("{line} --seed {public} --out public"));
    project.succeeds(&format!("{line} --seed-file other --out foreign"));
    let [one, open, other] = ["one", "public", "foreign"].map(states);
    assert!(
        one.iter().all(|state| !open.contains(state) && !other.contains(state)),
        "{one:?} {open:?} {other:?}"
    );

    let message = project.refusal(&format!("{line} --seed-file other --resume --out one"));
    assert!(message.contains("belongs to another run"), "{message}");
    project.succeeds(&format!("{line} --seed-file secret --resume --out one"));
    for (files, expected) in
        [("one two", None), ("one foreign", Some("seed hash")), ("one public", Some("seed hash"))]
    {
        let compared = project.softvt(&format!("compare {files}"));
        match expected {
            None => assert_eq!(compared.code, 0, "{}", compared.err),
            Some(words) => {
                assert!(compared.code == 2 && compared.err.contains(words), "{files}: {}", compared.err)
            }
        }
    }

    let replayed = project.succeeds("replay one 0/3 --seed-file secret").out;
    assert!(replayed.contains("byte-identical"), "{replayed}");
    let message = project.refusal("replay one 0/3");
    assert!(message.contains("was judged with a secret seed; add --seed-file FILE"), "{message}");
    let message = project.refusal("replay one 0/3 --seed-file other");
    assert!(message.starts_with("--seed-file other: its hash is ") && message.contains(hash), "{message}");
    let message = project.refusal("replay public 0/3 --seed-file secret");
    assert!(message.contains("has no secret seed; leave it out"), "{message}");
    project.succeeds("report one --out page");
    assert!(project.text("page/report.html").contains(&format!("secret, SHA-256 {hash}")));
}

#[test]
fn shards_of_a_judged_run_merge_if_they_have_one_seed() {
    let project = project();
    let line = "x.lua --policy noop --episodes 4 --seed-file";
    project.succeeds(&format!("{line} secret --out whole"));
    project.succeeds(&format!("{line} secret --shard 1/2 --out a"));
    project.succeeds(&format!("{line} secret --shard 2/2 --out b"));
    project.succeeds(&format!("{line} other --shard 2/2 --out c"));
    project.succeeds("merge merged a b");
    assert_eq!(project.text("merged/episodes.jsonl"), project.text("whole/episodes.jsonl"));
    assert_eq!(project.json("merged/run.json")["seed_hash"], project.json("whole/run.json")["seed_hash"]);
    let message = project.refusal("merge wrong a c");
    assert!(message.contains("a shard of another run"), "{message}");
}

#[test]
fn a_lua_policy_is_not_told_which_episode_it_is_in() {
    let project = project();
    project.succeeds("x.lua --policy p.lua --episodes 2 --seed-file secret --out run");
    let message = project.refusal("x.lua --policy p.lua --episodes 2 --out open");
    assert!(message.contains("p.lua:2: "), "{message}");
}

#[test]
fn clients_of_a_judged_server_cannot_choose_the_seed() {
    let project = project();
    let first = |words: &str| {
        let server = Server::start(&project, words);
        let (mut client, hello) = server.client();
        let reset = [("type", "reset".into()), ("task", 0.into()), ("episode", 1.into())];
        let answer = client.ask(&map(&reset));
        let step = map(&[("type", "render".into()), ("camera", "third_person".into())]);
        assert!(get(&answer, "observation").is_map(), "{answer}");
        let image = client.ask(&step).to_string();
        let seeded = client.ask(&map(&[&reset[..], &[("seed", 7.into())]].concat()));
        (image, get(&hello, "seed").as_u64(), seeded.to_string())
    };
    let (open, _, seeded) = first("--profile vision");
    assert!(!seeded.contains("secret"), "{seeded}");
    let (judged, seed, seeded) = first("--profile vision --seed-file secret");
    assert!(seeded.contains("the seed of this server is secret; leave it out"), "{seeded}");
    let (again, _, _) = first("--profile vision --seed-file secret");
    assert!(judged == again && judged != open);
    let (public, _, _) = first(&format!("--profile vision --seed {}", seed.expect("a seed")));
    assert_ne!(public, judged, "the seed that clients are told gives other draws");
}

#[test]
fn seed_files_that_are_no_secret_are_refused() {
    let project = project();
    project.write("empty", b"");
    project.write("short", b"42");
    for (words, expected) in [
        (
            "x.lua --seed-file none",
            "--seed-file none: there is no such file; write one, for example: head -c 32 ",
        ),
        ("x.lua --seed-file empty", "--seed-file empty: the file is empty; write one"),
        ("x.lua --seed-file .", "--seed-file .: "),
        ("x.lua --seed-file secret --seed 1", "cannot be used with"),
        ("record x.lua --seed-file secret --out d", "--seed-file: demonstrations are public"),
        ("replay x 0 --seed-file none", "--seed-file none: there is no such file"),
        ("scripts/rest_check.lua --seed-file secret", "--seed-file: applies to "),
    ] {
        let output = project.softvt(words);
        assert_eq!(output.code, 2, "{words}");
        assert!(output.err.contains(expected), "{words}: {}", output.err);
    }
    let warned = project.succeeds("x.lua --policy noop --seed-file short --out run").err;
    assert!(warned.contains("2 bytes may be guessed from their hash"), "{warned}");
}
