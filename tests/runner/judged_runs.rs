//! Judged runs: a secret seed whose hash is all that results and policies see.

use std::collections::BTreeSet;

use rmpv::Value;

use crate::{
    serve::Server,
    support::{
        Project, Run, Small, assert_contains,
        client::{get, map, reset},
        files,
    },
};

const SECRET: &str = "correct horse battery staple";

/// A suite whose cube lies elsewhere in every episode, with two seed files and a policy that prints what it receives.
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

#[test]
fn results_hold_the_hash_of_the_seed_and_only_who_has_the_file_can_repeat_them() {
    let project = project();
    let run = || project.run("x.lua").policy("noop").episodes(4);
    let states = |run: Run| -> BTreeSet<String> {
        run.records().into_iter().map(|record| record.stats.state_hash).collect()
    };
    let one = states(run().threads(1).secret("secret").out("one"));
    run().threads(2).secret("secret").out("two").finish();
    assert_eq!(project.text("one/episodes.jsonl"), project.text("two/episodes.jsonl"));
    let info = project.json("one/run.json");
    let hash = info["seed_hash"].as_str().expect("a hash");
    assert_eq!(hash.len(), 64);
    for (path, bytes) in files(&project.path("one")) {
        assert!(!String::from_utf8_lossy(&bytes).contains(SECRET), "{path}");
    }
    // The seed of the records is one of the hash: another run with it has other draws.
    let public = info["seed"].as_u64().expect("a number");
    assert_eq!(format!("{public:012x}"), hash[..12]);
    let open = states(run().seed(public).out("public"));
    let other = states(run().secret("other").out("foreign"));
    assert_eq!(one.len(), 4);
    assert!(one.is_disjoint(&open) && one.is_disjoint(&other), "{one:?} {open:?} {other:?}");

    assert_contains(run().secret("other").resume().out("one").error(), "belongs to another run");
    run().secret("secret").resume().out("one").finish();
    project.compare("one", "two").expect("comparable");
    for run in ["foreign", "public"] {
        assert_contains(project.compare("one", run).expect_err(run), "seed hash");
    }

    assert_eq!(project.replay("one", "0/3", Some("secret")), Ok(None));
    let message = project.replay("one", "0/3", None).expect_err("a secret run");
    assert!(message.contains("was judged with a secret seed; give the file with that seed"), "{message}");
    let message = project.replay("one", "0/3", Some("other")).expect_err("another secret");
    assert!(message.starts_with("secret other: its hash is ") && message.contains(hash), "{message}");
    let message = project.replay("public", "0/3", Some("secret")).expect_err("a public run");
    assert!(message.contains("has no secret seed; leave it out"), "{message}");
    assert!(project.report(&["one"]).html.contains(&format!("secret, SHA-256 {hash}")));
}

#[test]
fn shards_of_a_judged_run_merge_if_they_have_one_seed() {
    let project = project();
    let run = |secret: &str| project.run("x.lua").policy("noop").episodes(4).secret(secret);
    run("secret").out("whole").finish();
    run("secret").shard("1/2").out("a").finish();
    run("secret").shard("2/2").out("b").finish();
    run("other").shard("2/2").out("c").finish();
    project.merge("merged", &["a", "b"]).expect("merged");
    assert_eq!(project.text("merged/episodes.jsonl"), project.text("whole/episodes.jsonl"));
    assert_eq!(project.json("merged/run.json")["seed_hash"], project.json("whole/run.json")["seed_hash"]);
    assert_contains(
        project.merge("wrong", &["a", "c"]).expect_err("another secret"),
        "a shard of another run",
    );
}

#[test]
fn a_lua_policy_is_not_told_which_episode_it_is_in() {
    let project = project();
    let run = || project.run("x.lua").policy("p.lua").episodes(2);
    run().secret("secret").finish();
    assert_contains(run().error(), "p.lua:2: ");
}

#[test]
fn clients_of_a_judged_server_cannot_choose_the_seed() {
    let project = project();
    let first = |run: Run| {
        let server = Server::start(&run);
        let (mut client, hello) = server.client();
        let answer = client.reset(1);
        let step = map(&[("type", "render".into()), ("camera", "third_person".into())]);
        assert!(get(&answer, "observation").is_map(), "{answer}");
        let image = client.ask(&step).to_string();
        let Value::Map(mut fields) = reset(1) else { panic!("a map") };
        fields.push(("seed".into(), 7.into()));
        let seeded = client.ask(&Value::Map(fields));
        (image, get(&hello, "seed").as_u64(), seeded.to_string())
    };
    let run = || project.run("x.lua").profile("vision");
    let (open, _, seeded) = first(run());
    assert!(!seeded.contains("secret"), "{seeded}");
    let (judged, seed, seeded) = first(run().secret("secret"));
    assert!(seeded.contains("the seed of this server is secret; leave it out"), "{seeded}");
    let (again, _, _) = first(run().secret("secret"));
    assert!(judged == again && judged != open);
    let (public, _, _) = first(run().seed(seed.expect("a seed")));
    assert_ne!(public, judged, "the seed that clients are told gives other draws");
}
