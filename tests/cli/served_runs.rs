//! `softvt serve --out`: which episodes of clients are recorded, and the run folders that they leave.
#![cfg(unix)]

use std::fs;

use rmpv::Value;
use softvt::{episode_id::EpisodeIndex, policy::Action, report::actions};

use crate::{
    serve::{Client, Server, array, get, map, of},
    support::{Project, Small},
};

/// Flags of all servers: the actions of a recorded run have continuous closures.
const FLAGS: &str = "--profile vision --gripper continuous";

/// Two episodes of 12 steps, and a run of the random policy, whose actions clients repeat.
fn project() -> Project {
    let project = Small { task: "budget_steps = 12", ..Small::default() }.project();
    project.succeeds("x.lua --policy random --episodes 3 --out random");
    project
}

fn serve(project: &Project, words: &str) -> Server {
    Server::start(project, &format!("{FLAGS} {words}"))
}

/// The recorded actions of an episode, in the encoding of the profile.
fn recorded(project: &Project, run: &str, episode: u32) -> Vec<[f64; 7]> {
    let path = actions::path(&project.path(run), EpisodeIndex { task: 0, episode });
    actions::read(&path).expect("actions").into_iter().map(Action::to_array).collect()
}

fn reset(client: &mut Client, episode: u64, others: &[(&str, Value)]) -> Value {
    let fields = [("type", "reset".into()), ("task", 0.into()), ("episode", episode.into())];
    let answer = client.ask(&map(&[&fields, others].concat()));
    assert_eq!(get(&answer, "type").as_str(), Some("reset"), "{answer}");
    answer
}

/// Executes actions, and returns `info`.
fn step(client: &mut Client, actions: &[[f64; 7]]) -> Value {
    let request = [("type", "step".into()), ("actions", array(&[actions.len(), 7], &actions.concat()))];
    let answer = client.ask(&map(&request));
    assert_eq!(get(&answer, "type").as_str(), Some("step"), "{answer}");
    get(&answer, "info").clone()
}

/// True if the episode that these actions end was recorded.
fn is_recorded(client: &mut Client, actions: &[[f64; 7]]) -> bool {
    get(&step(client, actions), "recorded").as_bool().expect("the episode is over")
}

/// Runs an episode with the actions of the random policy. Returns whether it was recorded.
fn run_episode(project: &Project, client: &mut Client, episode: u32) -> bool {
    reset(client, episode.into(), &[]);
    is_recorded(client, &recorded(project, "random", episode))
}

/// A file of a run without the name of its policy.
fn without_policy(project: &Project, path: &str, policy: &str) -> String {
    project
        .text(path)
        .replace(&format!("\"policy\":\"{policy}\""), "")
        .replace(&format!("\"policy\": \"{policy}\""), "")
}

#[test]
fn a_served_run_equals_a_run_of_the_same_actions() {
    let project = project();
    let server = serve(&project, "--episodes 2 --out served");
    let (mut first, hello) = server.client();
    assert_eq!(get(&hello, "records").as_bool(), Some(true));
    let suite = &get(&hello, "suites").as_array().expect("a list")[0];
    assert_eq!(get(suite, "episodes").as_u64(), Some(2), "of the run");
    let (mut second, _) = server.client();
    assert!(run_episode(&project, &mut second, 1), "in any order");
    assert!(!project.path("served/summary.json").exists(), "the run is not finished");
    // One action at a time: what the client observes meanwhile changes nothing.
    reset(&mut first, 0, &[]);
    let actions = recorded(&project, "random", 0);
    for action in &actions[..11] {
        let info = step(&mut first, &[*action]);
        assert!(info.as_map().expect("a map").iter().all(|(key, _)| key.as_str() != Some("recorded")));
    }
    assert!(is_recorded(&mut first, &actions[11..]));
    assert!(project.path("served/summary.json").exists(), "written with the last episode");
    let output = server.interrupt();
    assert_eq!(output.code, 130, "{}", output.err);
    assert!(output.out.contains("client") && output.out.contains("Safety"), "a table: {}", output.out);
    assert!(output.err.contains("one [1/2] task 0 episode 1: failed"), "{}", output.err);
    assert!(output.err.ends_with("interrupted; 2 of 2 episodes are in served\n"), "{}", output.err);
    assert!(!output.err.contains("will not be recorded"), "{}", output.err);

    project.succeeds("x.lua --policy random --episodes 2 --out two");
    let repeated = project.succeeds("x.lua --policy two --episodes 2 --out repeated");
    assert_eq!(output.out.replace("client", "replay"), repeated.out, "the table");
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
fn a_served_run_is_replayed_compared_and_reported() {
    let project = project();
    let server = serve(&project, "--episodes 3 --out served --name mine --seed 0");
    let (mut client, _) = server.client();
    for episode in [2, 0] {
        assert!(run_episode(&project, &mut client, episode));
    }
    let output = server.interrupt();
    let kept = "interrupted; 2 of 3 episodes are in served; continue with --resume --out served\n";
    assert!(output.err.ends_with(kept), "{}", output.err);
    assert!(output.out.contains("mine"), "{}", output.out);
    assert!(!project.path("served/summary.json").exists(), "a part of a run has no summary");
    let episodes: Vec<_> =
        project.lines("served/episodes.jsonl").iter().map(|line| line["episode"].clone()).collect();
    assert_eq!(episodes, [0, 2], "sorted");
    for episode in [0, 2] {
        let replayed = project.succeeds(&format!("replay served 0/{episode}"));
        assert!(replayed.out.contains("byte-identical"), "{}", replayed.out);
    }
    let reported = project.succeeds("report served --out report");
    assert!(reported.err.contains("served is not finished: it has 2 of 3 episodes"), "{}", reported.err);
    let compared = project.succeeds("compare random served");
    assert!(compared.out.contains("random → mine · 2 paired episodes"), "{}", compared.out);
    let viewed = "softvt view x.lua --task 0 --policy served --out seen";
    assert!(project.text("report/report.html").contains(viewed), "a command that repeats the actions");
    // The last episode, by a server that resumes the run.
    let server = serve(&project, "--episodes 3 --out served --name mine --resume");
    let (mut client, _) = server.client();
    assert!(!run_episode(&project, &mut client, 0), "an episode that is already recorded");
    assert!(run_episode(&project, &mut client, 1));
    server.interrupt();
    assert!(!project.succeeds("report served --out report").err.contains("not finished"));
    assert_eq!(
        without_policy(&project, "served/episodes.jsonl", "mine"),
        without_policy(&project, "random/episodes.jsonl", "random"),
        "an interruption leaves no trace"
    );
}

#[test]
fn only_the_first_attempt_at_an_episode_is_recorded() {
    let project = project();
    let server = serve(&project, "--episodes 3 --out served");
    let (mut client, _) = server.client();
    let actions = recorded(&project, "random", 0);
    let other: Vec<[f64; 7]> = recorded(&project, "random", 1);
    // A reset without an action uses nothing up, and neither does an episode of another seed or split.
    reset(&mut client, 0, &[]);
    for others in [("seed", Value::from(7)), ("split", Value::from("demonstration"))] {
        reset(&mut client, 0, &[others]);
        assert!(!is_recorded(&mut client, &actions));
    }
    reset(&mut client, 5, &[]);
    assert!(!is_recorded(&mut client, &actions), "beyond the episodes of the run");
    reset(&mut client, 0, &[]);
    assert!(is_recorded(&mut client, &actions));
    reset(&mut client, 0, &[]);
    assert!(!is_recorded(&mut client, &other), "a second try");
    // A client that leaves an episode before its end.
    reset(&mut client, 1, &[]);
    step(&mut client, &other[..3]);
    assert!(!run_episode(&project, &mut client, 1), "after a reset in the middle");
    reset(&mut client, 2, &[]);
    step(&mut client, &other[..3]);
    drop(client);
    // The server notices when it reads from the connection.
    std::thread::sleep(std::time::Duration::from_millis(1500));
    assert!(!run_episode(&project, &mut server.client().0, 2), "after a lost connection");
    let output = server.interrupt();
    for episode in [1, 2] {
        let message =
            format!("one: task 0 episode {episode} will not be recorded: its client left it before its end");
        assert_eq!(output.err.matches(&message).count(), 1, "{}", output.err);
    }
    assert!(output.err.contains("1 of 3 episodes are in served"), "{}", output.err);
    let lines = project.lines("served/episodes.jsonl");
    assert_eq!(lines.len(), 1);
    assert_eq!(lines[0]["actions_sha256"], project.lines("random/episodes.jsonl")[0]["actions_sha256"]);
    // An operator may give a lost episode another chance.
    let server = serve(&project, "--episodes 3 --out served --resume");
    assert!(run_episode(&project, &mut server.client().0, 1));
}

#[test]
fn an_episode_to_which_a_client_returned_is_not_recorded() {
    let project = project();
    let server = serve(&project, "--episodes 3 --out served");
    let (mut client, _) = server.client();
    let actions = recorded(&project, "random", 0);
    let restore = |client: &mut Client, state: Value| {
        let answer = client.ask(&map(&[("type", "set_state".into()), ("state", state)]));
        assert_eq!(get(&answer, "type").as_str(), Some("set_state"), "{answer}");
    };
    let state = |client: &mut Client| get(&client.ask(&of("get_state")), "state").clone();
    // Reading states is no search. Returning to the start before the first action is a reset.
    reset(&mut client, 0, &[]);
    let start = state(&mut client);
    restore(&mut client, start);
    step(&mut client, &actions[..3]);
    state(&mut client);
    assert!(is_recorded(&mut client, &actions[3..]));
    // The same client goes back.
    reset(&mut client, 1, &[]);
    step(&mut client, &actions[..3]);
    let middle = state(&mut client);
    step(&mut client, &actions[3..5]);
    restore(&mut client, middle);
    assert!(!is_recorded(&mut client, &actions[3..]));
    assert!(!run_episode(&project, &mut client, 1));
    // Another client looks ahead.
    reset(&mut client, 2, &[]);
    step(&mut client, &actions[..3]);
    let middle = state(&mut client);
    let (mut scout, _) = server.client();
    restore(&mut scout, middle);
    assert!(!is_recorded(&mut client, &actions[3..]));
    let output = server.interrupt();
    for episode in [1, 2] {
        let message =
            format!("task 0 episode {episode} will not be recorded: a client restored a state of it");
        assert_eq!(output.err.matches(&message).count(), 1, "{}", output.err);
    }
    assert!(!output.err.contains("left it before its end"), "{}", output.err);
    assert_eq!(project.lines("served/episodes.jsonl").len(), 1);
}

#[test]
fn nobody_practises_beside_an_open_attempt() {
    let project = project();
    let mut server = serve(&project, "--episodes 2 --out served --until-stdin-closes");
    let actions = recorded(&project, "random", 0);
    let (mut client, _) = server.client();
    let (mut scout, _) = server.client();
    reset(&mut scout, 0, &[]);
    reset(&mut client, 0, &[]);
    step(&mut client, &actions[..3]);
    let request = [("type", "step".into()), ("actions", array(&[1, 7], &actions[0]))];
    let answer = scout.ask(&map(&request));
    assert_eq!(
        get(&answer, "error").as_str(),
        Some(
            "step: task 0, episode 0 is being recorded for another client; step it when that client is done, or another \
             episode"
        )
    );
    // The scout may run another episode meanwhile, and this one afterwards.
    assert!(run_episode(&project, &mut scout, 1));
    assert!(is_recorded(&mut client, &actions[3..]));
    assert!(!run_episode(&project, &mut scout, 0));
    server.close_stdin();
    let output = server.wait();
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.err.ends_with("softvt: 2 of 2 episodes are in served\n"), "{}", output.err);
}

#[test]
fn shards_of_several_servers_are_merged() {
    let project = project();
    for shard in 1..=2_u32 {
        let words = format!("--episodes 3 --shard {shard}/2 --out part{shard}");
        let server = serve(&project, &words);
        let (mut client, _) = server.client();
        let all: Vec<bool> = (0..3).map(|episode| run_episode(&project, &mut client, episode)).collect();
        assert_eq!(all, [shard == 1, shard == 2, shard == 1]);
    }
    project.succeeds("merge whole part1 part2");
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
    let server = serve(&project, "--task 0 --privileged --out both");
    let (mut client, _) = server.client();
    reset(&mut client, 0, &[("suite", "two".into())]);
    let info = step(&mut client, &recorded(&project, "random", 0));
    assert_eq!(get(&info, "recorded").as_bool(), Some(true));
    let output = server.interrupt();
    assert!(output.err.contains("interrupted; 1 of 2 episodes are in both; continue with"), "{}", output.err);
    assert!(!project.path("both/one").exists(), "a folder without an episode is removed");
    assert_eq!(project.json("both/two/run.json")["suite"], "two");
    let line = &project.lines("both/two/episodes.jsonl")[0];
    assert_eq!((&line["suite"], &line["privileged"]), (&"two".into(), &true.into()));
    assert!(project.path("both/two/summary.json").exists(), "this suite has all of its episodes");
}

#[test]
fn a_server_that_cannot_write_ends() {
    let project = project();
    let server = serve(&project, "--episodes 2 --out served");
    let (mut client, _) = server.client();
    assert!(run_episode(&project, &mut client, 1));
    fs::remove_dir_all(project.path("served/actions")).expect("removed");
    project.write("served/actions", b"a file in place of the folder");
    reset(&mut client, 0, &[]);
    let actions = recorded(&project, "random", 0);
    let request = [("type", "step".into()), ("actions", array(&[12, 7], &actions.concat()))];
    let answer = client.ask(&map(&request));
    let message = get(&answer, "error").as_str().expect("an error");
    assert!(message.contains("cannot be recorded") && message.contains("actions"), "{message}");
    let output = server.wait();
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.err.ends_with("\n1 of 2 episodes are in served\n"), "{}", output.err);
    assert_eq!(project.lines("served/episodes.jsonl").len(), 1, "no line without its files");
}

#[test]
fn folders_and_flags_that_do_not_fit_are_refused() {
    let project = project();
    let server = serve(&project, "--episodes 2 --out served");
    assert!(run_episode(&project, &mut server.client().0, 0));
    let busy = project.refusal(
        "serve x.lua --port 0 --profile vision --gripper continuous --episodes 2 --out served --resume",
    );
    assert!(busy.contains("another softvt process is using served"), "{busy}");
    server.interrupt();
    project.write("foreign/notes.txt", b"x");
    let before = project.text("served/run.json");
    for (words, expected) in [
        ("--out served", "served already holds a run (run.json): resume it with --resume"),
        ("--out foreign", "foreign is not empty and holds no run (it contains notes.txt)"),
        ("--out served --resume", "episodes: 2 before, 1 now"),
        ("--out served --resume --episodes 2 --name other", "belongs to another run"),
        ("--out served --resume --episodes 2 --seed 1", "belongs to another run"),
        (
            "--out served --resume --episodes 2 --split demonstration",
            "split: \"validation\" before, \"demonstration\" now",
        ),
        ("--out served --resume --episodes 2 --privileged", "belongs to another run"),
        ("--resume", "--out <DIR>"),
        ("--episodes 2", "--episodes: applies to the run in --out; add --out DIR, or leave it out"),
        ("--shard 1/2", "--shard: applies to the run in --out"),
        ("--name mine", "--name: applies to the run in --out"),
        ("--task 7", "--task 7: suite one has no such task"),
    ] {
        let message = project.refusal(&format!("serve x.lua --port 0 {FLAGS} {words}"));
        assert!(message.contains(expected), "{words}: {message}");
    }
    let message = project.refusal("serve x.lua --port 0 --profile libero --out served --resume --episodes 2");
    assert!(message.contains("served/run.json belongs to another run: gripper"), "{message}");
    assert_eq!(project.text("served/run.json"), before);
    let output = serve(&project, "--out empty").interrupt();
    assert!(output.err.ends_with("interrupted; no episode was recorded\n"), "{}", output.err);
    assert!(!project.path("empty").exists() && output.out.is_empty(), "{}", output.out);
}
