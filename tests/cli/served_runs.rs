//! `softvt serve --out`: what is printed of recorded runs, exit codes, and flags.
#![cfg(unix)]

use std::fs;

use softvt::{episode_id::EpisodeIndex, policy::Action, runs::actions};

use crate::{
    serve::Server,
    support::{
        Project, Small,
        client::{Client, get, step},
    },
};

/// Flags of all servers: the actions of a recorded run have continuous closures.
const FLAGS: &str = "--profile vision --gripper continuous";

/// Two episodes of 12 steps, and a run of the random policy, whose actions clients repeat.
fn project() -> Project {
    let project = Small { task: "budget_steps = 12", ..Small::default() }.project();
    project.succeeds("x.lua --policy random --episodes 2 --out random");
    project
}

fn serve(project: &Project, words: &str) -> Server {
    Server::start(project, &format!("{FLAGS} {words}"))
}

/// The recorded actions of an episode of the random policy, in the encoding of the profile.
fn recorded(project: &Project, episode: u32) -> Vec<[f64; 7]> {
    let path = actions::path(&project.path("random"), EpisodeIndex { task: 0, episode });
    actions::read(&path).expect("actions").into_iter().map(Action::to_array).collect()
}

/// Runs an episode with the actions of the random policy. Returns whether it was recorded.
fn run_episode(project: &Project, client: &mut Client, episode: u32) -> bool {
    client.reset(episode.into());
    client.is_recorded(&recorded(project, episode))
}

#[test]
fn the_end_of_a_recording_server_is_reported() {
    let project = project();
    let server = serve(&project, "--episodes 2 --out served --name mine");
    let (mut client, _) = server.client();
    assert!(run_episode(&project, &mut client, 1));
    let output = server.interrupt();
    let kept = "interrupted; 1 of 2 episodes are in served; continue with --resume --out served\n";
    assert!(output.code == 130 && output.err.ends_with(kept), "{}", output.err);
    assert!(output.err.contains("one [1/2] task 0 episode 1: ○ goal missed"), "{}", output.err);
    assert!(output.out.contains("mine") && output.out.contains("Safety"), "a table: {}", output.out);
    let reported = project.succeeds("report served --out report");
    assert!(reported.err.contains("served is not finished: it has 1 of 2 episodes"), "{}", reported.err);
    assert!(project.succeeds("replay served 0/1").out.contains("byte-identical"));

    let mut server = serve(&project, "--episodes 2 --out served --name mine --resume --until-stdin-closes");
    assert!(run_episode(&project, &mut server.client().0, 0));
    server.process.close_stdin();
    let output = server.process.wait();
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.err.ends_with("softvt: 2 of 2 episodes are in served\n"), "{}", output.err);
    let server = serve(&project, "--episodes 2 --out served --name mine --resume");
    let output = server.interrupt();
    assert!(output.err.ends_with("interrupted; 2 of 2 episodes are in served\n"), "{}", output.err);
    let compared = project.succeeds("compare random served");
    assert!(compared.out.contains("random → mine · 2 paired episodes"), "{}", compared.out);
}

#[test]
fn a_server_that_cannot_write_ends() {
    let project = project();
    let server = serve(&project, "--episodes 2 --out served");
    let (mut client, _) = server.client();
    assert!(run_episode(&project, &mut client, 1));
    fs::remove_dir_all(project.path("served/actions")).expect("removed");
    project.write("served/actions", b"a file in place of the folder");
    client.reset(0);
    let answer = client.ask(&step(&recorded(&project, 0)));
    let message = get(&answer, "error").as_str().expect("an error");
    assert!(message.contains("cannot be recorded") && message.contains("actions"), "{message}");
    let output = server.process.wait();
    assert_eq!(output.code, 2, "{}", output.err);
    assert!(output.err.ends_with("\n1 of 2 episodes are in served\n"), "{}", output.err);
    assert_eq!(project.lines("served/episodes.jsonl").len(), 1, "no line without its files");
}

#[test]
fn folders_that_do_not_fit_are_refused() {
    let project = project();
    let server = serve(&project, "--episodes 2 --out served");
    assert!(run_episode(&project, &mut server.client().0, 0));
    let busy = project.refusal(&format!("serve x.lua --port 0 {FLAGS} --episodes 2 --out served --resume"));
    assert!(busy.contains("another softvt process is using served"), "{busy}");
    server.interrupt();
    let again = project.refusal(&format!("serve x.lua --port 0 {FLAGS} --out served"));
    assert!(again.contains("served already holds a run (run.json): resume it, or"), "{again}");
    let output = serve(&project, "--out empty").interrupt();
    assert!(output.err.ends_with("interrupted; no episode was recorded\n"), "{}", output.err);
    assert!(!project.path("empty").exists() && output.out.is_empty(), "{}", output.out);
}
