//! Judged runs: a secret seed whose hash is all that results and policies see.

use std::collections::BTreeSet;

use rmpv::Value;

use crate::{
    serve::Server,
    support::{
        Project, Run, Small, assert_contains,
        client::{get, map, reset},
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
fn the_hash_of_a_secret_seed_gives_other_draws_than_the_secret() {
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
    // The seed of the records is one of the hash: another run with it has other draws.
    let public = info["seed"].as_u64().expect("a number");
    assert_eq!(format!("{public:012x}"), hash[..12]);
    let open = states(run().seed(public).out("public"));
    let other = states(run().secret("other").out("foreign"));
    assert_eq!(one.len(), 4);
    assert!(one.is_disjoint(&open) && one.is_disjoint(&other), "{one:?} {open:?} {other:?}");

    assert_eq!(project.replay("one", "0/3", Some("secret")), Ok(None));
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
