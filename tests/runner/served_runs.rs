//! Recording servers: which episodes of clients are recorded, and the run folders that they leave.

use std::fs;

use rmpv::Value;
use softvt::{
    episode_id::{EpisodeIndex, EpisodeSplit},
    policy::{Action, profile::GripCode},
    report::{styled_text::TerminalFormat, terminal},
    runs::{actions, summary::SuiteSummary},
};

use crate::{
    serve::{Access, Server, of},
    support::{
        Project, Run, Small, assert_contains,
        client::{Client, get, map, reset, step},
    },
};

/// Three episodes of 12 steps, and a run of the random policy, whose actions clients repeat.
fn project() -> Project {
    let project = Small { task: "budget_steps = 12", ..Small::default() }.project();
    project.run("x.lua").policy("random").episodes(3).out("random").finish();
    project
}

/// A run of clients. The actions of a recorded run have continuous closures.
fn served<'a>(project: &'a Project, episodes: u32, out: &str) -> Run<'a> {
    project.run("x.lua").profile("vision").gripper(GripCode::Continuous).episodes(episodes).out(out)
}

/// A run by clients of another name.
fn named<'a>(run: Run<'a>, name: &str) -> Run<'a> {
    run.with_policy(|policy| policy.name = Some(name.to_owned()))
}

/// The recorded actions of an episode, in the encoding of the profile.
fn recorded(project: &Project, run: &str, episode: u32) -> Vec<[f64; 7]> {
    let path = actions::path(&project.path(run), EpisodeIndex { task: 0, episode });
    actions::read(&path).expect("actions").into_iter().map(Action::to_array).collect()
}

/// Starts an episode with other fields of the request.
fn reset_with(client: &mut Client, episode: u64, (field, value): (&str, Value)) {
    let Value::Map(mut fields) = reset(episode) else { panic!("a map") };
    fields.push((field.into(), value));
    let answer = client.ask(&Value::Map(fields));
    assert_eq!(get(&answer, "type").as_str(), Some("reset"), "{answer}");
}

/// Runs an episode with the actions of the random policy. Returns whether it was recorded.
fn run_episode(project: &Project, client: &mut Client, episode: u32) -> bool {
    client.reset(episode.into());
    client.is_recorded(&recorded(project, "random", episode))
}

/// A file of a run without the name of its policy and the mark of recorded actions.
fn without_policy(project: &Project, path: &str, policy: &str) -> String {
    let digest = |line: &str| {
        line.split_once(",\"record_sha256\"").map_or(line, |(record, _)| record).to_owned() + "\n"
    };
    project
        .text(path)
        .lines()
        .map(digest)
        .collect::<String>()
        .replace(&format!("\"policy\":\"{policy}\""), "")
        .replace(&format!("\"policy\": \"{policy}\""), "")
        .replace("\"replayed\":true,", "")
        .replace("  \"replayed\": true,\n", "")
}

#[test]
fn a_served_run_equals_a_run_of_the_same_actions() {
    let project = project();
    let server = Server::start(&served(&project, 2, "served"));
    let (mut first, hello) = server.client();
    assert_eq!(get(&hello, "records").as_bool(), Some(true));
    let suite = &get(&hello, "suites").as_array().expect("a list")[0];
    assert_eq!(get(suite, "episodes").as_u64(), Some(2), "of the run");
    let (mut second, _) = server.client();
    assert!(run_episode(&project, &mut second, 1), "in any order");
    assert!(!project.path("served/summary.json").exists(), "the run is not finished");
    // One action at a time: what the client observes meanwhile changes nothing.
    first.reset(0);
    let actions = recorded(&project, "random", 0);
    for action in &actions[..11] {
        let answer = first.step(&[*action]);
        let info = get(&answer, "info").as_map().expect("a map");
        assert!(info.iter().all(|(key, _)| key.as_str() != Some("recorded")));
    }
    assert!(first.is_recorded(&actions[11..]));
    assert!(project.path("served/summary.json").exists(), "written with the last episode");
    let (summaries, messages) = server.finish();
    assert_contains(&messages, "one [1/2] task 0 episode 1: ○ goal missed");
    assert!(!messages.contains("will not be recorded"), "{messages}");

    project.run("x.lua").policy("random").episodes(2).out("two").finish();
    let repeated = project.run("x.lua").policy("two").episodes(2).out("repeated").finish().result();
    assert!(repeated.summary.replayed, "the only other difference");
    let unmarked = SuiteSummary { replayed: false, ..repeated.summary };
    let table = terminal::table(&summaries[0], TerminalFormat::PLAIN.with_details());
    assert!(table.contains("client") && table.contains("Safety"), "{table}");
    assert_eq!(
        table.replace("client", "replay"),
        terminal::table(&unmarked, TerminalFormat::PLAIN.with_details()),
        "the table"
    );
    for file in ["episodes.jsonl", "summary.json"] {
        let served = without_policy(&project, &format!("served/{file}"), "client");
        assert_eq!(served, without_policy(&project, &format!("repeated/{file}"), "replay"), "{file}");
    }
    for file in
        ["actions/task_000/episode_00001.npy", "softvtbench/thresholds.json", "softvtbench/summary.json"]
    {
        let read = |run: &str| fs::read(project.path(&format!("{run}/{file}"))).expect(file);
        assert_eq!(read("served"), read("repeated"), "{file}");
    }
    let manifest = project.json("served/run.json");
    assert_eq!((&manifest["policy"], &manifest["split"]), (&"client".into(), &"validation".into()));
    assert_eq!(
        (&manifest["profile"]["name"], &manifest["gripper"]),
        (&"vision".into(), &"continuous".into())
    );
}

#[test]
fn a_served_run_that_is_resumed_equals_one_of_the_same_actions() {
    let project = project();
    let mine = || named(served(&project, 3, "served"), "mine");
    let server = Server::start(&mine());
    let (mut client, _) = server.client();
    for episode in [2, 0] {
        assert!(run_episode(&project, &mut client, episode));
    }
    let (summaries, _) = server.finish();
    assert_eq!((summaries[0].policy.as_str(), summaries[0].scores.episodes), ("mine", 2));
    assert!(!project.path("served/summary.json").exists(), "a part of a run has no summary");
    let stored = project.stored("served").expect("a run").swap_remove(0);
    let episodes: Vec<u32> = stored.records.iter().map(|record| record.header.id.episode).collect();
    assert_eq!(episodes, [0, 2], "sorted");
    assert!(project.is_reproduced("served", "0/0") && project.is_reproduced("served", "0/2"));
    // The last episode, by a server that resumes the run.
    let server = Server::start(&mine().resume());
    let (mut client, _) = server.client();
    assert!(!run_episode(&project, &mut client, 0), "an episode that is already recorded");
    assert!(run_episode(&project, &mut client, 1));
    server.finish();
    assert_eq!(
        without_policy(&project, "served/episodes.jsonl", "mine"),
        without_policy(&project, "random/episodes.jsonl", "random"),
        "an interruption leaves no trace"
    );
}

#[test]
fn only_the_first_attempt_at_an_episode_is_recorded() {
    let project = project();
    let server = Server::start(&served(&project, 3, "served"));
    let (mut client, _) = server.client();
    let actions = recorded(&project, "random", 0);
    let other: Vec<[f64; 7]> = recorded(&project, "random", 1);
    // A reset without an action uses nothing up, and neither does an episode of another seed or split.
    client.reset(0);
    for others in [("seed", Value::from(7)), ("split", Value::from("demonstration"))] {
        reset_with(&mut client, 0, others);
        assert!(!client.is_recorded(&actions));
    }
    client.reset(5);
    assert!(!client.is_recorded(&actions), "beyond the episodes of the run");
    client.reset(0);
    assert!(client.is_recorded(&actions));
    client.reset(0);
    assert!(!client.is_recorded(&other), "a second try");
    // A client that leaves an episode before its end.
    client.reset(1);
    client.step(&other[..3]);
    assert!(!run_episode(&project, &mut client, 1), "after a reset in the middle");
    client.reset(2);
    client.step(&other[..3]);
    drop(client);
    let lost = |episode: u32| {
        format!("one: task 0 episode {episode} will not be recorded: its client left it before its end")
    };
    server.wait_for(&lost(2));
    assert!(!run_episode(&project, &mut server.client().0, 2), "after a lost connection");
    let (summaries, messages) = server.finish();
    for episode in [1, 2] {
        assert_eq!(messages.matches(&lost(episode)).count(), 1, "{messages}");
    }
    assert_eq!(summaries[0].scores.episodes, 1);
    let lines = project.lines("served/episodes.jsonl");
    assert_eq!(lines.len(), 1);
    assert_eq!(lines[0]["actions_sha256"], project.lines("random/episodes.jsonl")[0]["actions_sha256"]);
    // An operator may give a lost episode another chance.
    let server = Server::start(&served(&project, 3, "served").resume());
    assert!(run_episode(&project, &mut server.client().0, 1));
    let (summaries, _) = server.finish();
    let attempts = |line: &serde_json::Value| line["attempts"].as_u64();
    let lines = project.lines("served/episodes.jsonl");
    assert_eq!(lines.iter().map(attempts).collect::<Vec<_>>(), [None, Some(2)], "and the record says so");
    assert_eq!(summaries[0].repeated_episodes.len(), 1);
    assert!(project.is_reproduced("served", "0/1"));
}

#[test]
fn an_episode_that_can_be_recorded_is_rendered_only_as_the_profile_observes_it() {
    let project = project();
    let server = Server::start(&served(&project, 2, "served"));
    let (mut client, _) = server.client();
    let actions = recorded(&project, "random", 0);
    let render = |camera: &str, edge: Option<u64>| {
        let size = edge.map(Value::from).unwrap_or(Value::Nil);
        map(&[
            ("type", "render".into()),
            ("camera", camera.into()),
            ("width", size.clone()),
            ("height", size),
        ])
    };
    let check = |client: &mut Client| {
        for (camera, edge) in [("left", None), ("wrist", Some(1400)), ("third_person", Some(64))] {
            let message = client.refused(&render(camera, edge));
            let expected = format!(
                "render: {camera}: the profile vision does not observe it in this size, and the episode can be recorded"
            );
            assert!(message.starts_with(&expected), "{message}");
        }
        let answer = client.ask(&render("wrist", None));
        assert_eq!(get(&answer, "type").as_str(), Some("render"), "{answer}");
    };
    client.reset(0);
    check(&mut client);
    client.step(&actions[..3]);
    check(&mut client);
    assert!(client.is_recorded(&actions[3..]));
    for (camera, edge) in [("left", None), ("wrist", Some(100))] {
        assert_eq!(get(&client.ask(&render(camera, edge)), "type").as_str(), Some("render"), "it is over");
    }
    client.reset(5);
    assert_eq!(get(&client.ask(&render("left", None)), "type").as_str(), Some("render"), "not of the run");
}

#[test]
fn an_episode_to_which_a_client_returned_is_not_recorded() {
    let project = project();
    let server = Server::start(&served(&project, 3, "served"));
    let (mut client, _) = server.client();
    let actions = recorded(&project, "random", 0);
    let restore = |client: &mut Client, state: Value| {
        let answer = client.ask(&map(&[("type", "set_state".into()), ("state", state)]));
        assert_eq!(get(&answer, "type").as_str(), Some("set_state"), "{answer}");
    };
    let state = |client: &mut Client| get(&client.ask(&of("get_state")), "state").clone();
    // Reading states is no search. Returning to the start before the first action is a reset.
    client.reset(0);
    let start = state(&mut client);
    restore(&mut client, start);
    client.step(&actions[..3]);
    state(&mut client);
    assert!(client.is_recorded(&actions[3..]));
    // The same client goes back.
    client.reset(1);
    client.step(&actions[..3]);
    let middle = state(&mut client);
    client.step(&actions[3..5]);
    restore(&mut client, middle);
    assert!(!client.is_recorded(&actions[3..]));
    assert!(!run_episode(&project, &mut client, 1));
    let (_, messages) = server.finish();
    let message = "task 0 episode 1 will not be recorded: a client restored a state of it";
    assert_eq!(messages.matches(message).count(), 1, "{messages}");
    assert!(!messages.contains("left it before its end"), "{messages}");
    assert_eq!(project.lines("served/episodes.jsonl").len(), 1);
}

#[test]
fn nobody_practises_beside_an_open_attempt() {
    let project = project();
    let server = Server::start(&served(&project, 2, "served"));
    let actions = recorded(&project, "random", 0);
    let (mut client, _) = server.client();
    let (mut scout, _) = server.client();
    scout.reset(0);
    client.reset(0);
    client.step(&actions[..3]);
    let refused = |request: &str| {
        format!(
            "{request}: task 0, episode 0 is being recorded for another client; use it when that client is done, or \
             another episode"
        )
    };
    assert_eq!(scout.refused(&step(&actions[..1])), refused("step"));
    let state = get(&client.ask(&of("get_state")), "state").clone();
    let ahead = map(&[("type", "set_state".into()), ("state", state)]);
    assert_eq!(scout.refused(&ahead), refused("set_state"));
    // The scout may run another episode meanwhile, and this one afterwards.
    assert!(run_episode(&project, &mut scout, 1));
    assert!(client.is_recorded(&actions[3..]));
    assert!(!run_episode(&project, &mut scout, 0));
    let (summaries, _) = server.finish();
    assert_eq!(summaries[0].scores.episodes, 2);
}

#[test]
fn shards_of_several_servers_are_merged() {
    let project = project();
    for shard in 1..=2_u32 {
        let run = served(&project, 3, &format!("part{shard}")).shard(&format!("{shard}/2"));
        let server = Server::start(&run);
        let (mut client, _) = server.client();
        let all: Vec<bool> = (0..3).map(|episode| run_episode(&project, &mut client, episode)).collect();
        assert_eq!(all, [shard == 1, shard == 2, shard == 1]);
        server.finish();
    }
    project.merge("whole", &["part1", "part2"]).expect("merged");
    assert_eq!(
        without_policy(&project, "whole/episodes.jsonl", "client"),
        without_policy(&project, "random/episodes.jsonl", "random")
    );
}

#[test]
fn every_suite_of_a_list_has_its_folder() {
    let text = Small { task: "budget_steps = 12", ..Small::default() }.text();
    let text = text.replace(
        "return softvt.suite { name = \"one\"",
        "local function suite(name) return softvt.suite { name = name",
    );
    let project = project();
    project.write("x.lua", format!("{text}end\nreturn {{ suite(\"one\"), suite(\"two\") }}\n").as_bytes());
    let run = project.run("x.lua").profile("vision").gripper(GripCode::Continuous).tasks(&[0]).out("both");
    let server = Server::with(&run, Access { is_privileged: true, ..Access::default() });
    let (mut client, _) = server.client();
    reset_with(&mut client, 0, ("suite", "two".into()));
    assert!(client.is_recorded(&recorded(&project, "random", 0)));
    let (summaries, _) = server.finish();
    assert_eq!(summaries.len(), 1);
    assert!(!project.path("both/one").exists(), "a folder without an episode is removed");
    assert_eq!(project.json("both/two/run.json")["suite"], "two");
    let line = &project.lines("both/two/episodes.jsonl")[0];
    assert_eq!((&line["suite"], &line["privileged"]), (&"two".into(), &true.into()));
    assert!(project.path("both/two/summary.json").exists(), "this suite has all of its episodes");
}

#[test]
fn folders_that_do_not_fit_are_refused() {
    let project = project();
    let server = Server::start(&served(&project, 2, "served"));
    assert!(run_episode(&project, &mut server.client().0, 0));
    server.finish();
    project.write("foreign/notes.txt", b"x");
    let before = project.text("served/run.json");
    let resumed = || served(&project, 2, "served").resume();
    let open = Access::default;
    let by_libero = project.run("x.lua").profile("libero").episodes(2).out("served").resume();
    for (run, access, expected) in [
        (
            served(&project, 2, "foreign"),
            open(),
            "foreign is not empty and holds no run (it contains notes.txt)",
        ),
        (served(&project, 1, "served").resume(), open(), "episodes: 2 before, 1 now"),
        (named(resumed(), "other"), open(), "belongs to another run"),
        (resumed().seed(1), open(), "belongs to another run"),
        (
            resumed(),
            Access { split: EpisodeSplit::Demonstration, ..open() },
            "split: \"validation\" before, \"demonstration\" now",
        ),
        (resumed(), Access { is_privileged: true, ..open() }, "belongs to another run"),
        (by_libero, open(), "served/run.json belongs to another run: gripper"),
    ] {
        assert_contains(Server::try_start(&run, access).err().expect(expected), expected);
    }
    assert_eq!(project.text("served/run.json"), before);
    let (summaries, _) = Server::start(&served(&project, 2, "empty")).finish();
    assert!(!project.path("empty").exists() && summaries.is_empty());
}
