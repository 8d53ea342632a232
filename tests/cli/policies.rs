//! Policies in Lua, recorded actions, the tactile servo, and the flags that go with them.

use std::net::TcpListener;

use crate::support::{Project, Small};

/// Twelve control steps of a cube on a floor.
fn project(policy: &str) -> Project {
    let project = Small { task: "budget_steps = 12", ..Small::default() }.project();
    project.write("p.lua", policy.as_bytes());
    project
}

/// A policy that moves at random, depending on its observation, in chunks of three.
const WANDERS: &str = "local n = 0
return softvt.policy { name = 'wanders', observes = { tactile = true, cameras = { 'wrist' } }, replan = 2,
  reset = function(task) n = task.episode end,
  act = function(obs)
    n = n + 1
    local light, list = obs:camera('wrist'):mean()[1] / 255, {}
    for i = 1, 3 do
      list[i] = { position = { obs.position[1] + 0.01 * math.random(), obs.position[2], obs.position[3] - 0.001 * n * light },
                  axis_angle = obs.axis_angle, closure = 0.1 * math.random() }
    end
    return list
  end }
";

#[test]
fn results_do_not_depend_on_threads_or_interruptions() {
    let project = project(WANDERS);
    let line = "x.lua --policy p.lua --episodes 3";
    project.succeeds(&format!("{line} --threads 1 --out one"));
    project.succeeds(&format!("{line} --threads 2 --out two"));
    // The state after a crash in the second episode.
    project.succeeds(&format!("{line} --threads 1 --out three"));
    let first = project.text("three/episodes.jsonl").lines().next().expect("a line").to_owned() + "\n";
    project.write("three/episodes.jsonl", first.as_bytes());
    std::fs::remove_file(project.path("three/summary.json")).expect("removed");
    project.succeeds(&format!("{line} --threads 2 --resume --out three"));
    for file in ["run.json", "episodes.jsonl", "summary.json"] {
        let one = project.text(&format!("one/{file}"));
        assert_eq!(one, project.text(&format!("two/{file}")), "{file} on two threads");
        assert_eq!(one, project.text(&format!("three/{file}")), "{file} resumed");
    }
    let info = project.json("one/run.json");
    assert_eq!((info["policy"].as_str(), info["privileged"].as_bool()), (Some("wanders"), Some(false)));
    assert_eq!((info["policy_file"].as_str(), info["replan"].as_u64()), (Some("p.lua"), Some(2)));
    assert!(info["sources"]["p.lua"].as_str().is_some_and(|hash| hash.len() == 64));
    assert!(project.succeeds("replay one 0/2").out.contains("byte-identical"));
    project.write("p.lua", WANDERS.replace("0.01", "0.02").as_bytes());
    let message = project.refusal(&format!("{line} --resume --out three"));
    assert!(message.contains("belongs to another run: sources.p.lua"), "{message}");
}

#[test]
fn policies_see_sensor_noise_that_does_not_depend_on_threads() {
    // It moves by the noise of the markers.
    let policy = project(
        "return softvt.policy { name = 'feels', observes = { tactile = true }, act = function(obs)
  local motion = obs.tactile.left.markers:mean()
  local p = obs.position
  return { position = { p[1] + 0.01 * motion[1], p[2], p[3] }, axis_angle = obs.axis_angle, closure = 0 }
end }
",
    );
    let line = "x.lua --policy p.lua --episodes 3";
    let noise = "--set tactile.wear.noise_px=0.1 --set tactile.wear.image_noise=1";
    policy.succeeds(&format!("{line} --threads 1 --out exact"));
    policy.succeeds(&format!("{line} --threads 1 --out off --set tactile.wear.noise_px=0"));
    policy.succeeds(&format!("{line} --threads 1 --out one {noise}"));
    policy.succeeds(&format!("{line} --threads 2 --out two {noise}"));
    policy.succeeds(&format!("{line} --threads 1 --out seeded --seed 1 {noise}"));
    let [exact, off, one, two, seeded] = ["exact", "off", "one", "two", "seeded"].map(|out| {
        std::fs::read(policy.path(&format!("{out}/actions/task_000/episode_00000.npy"))).expect("actions")
    });
    assert_eq!((&exact, &one), (&off, &two));
    assert!(one != exact && one != seeded);
    assert!(policy.succeeds("replay one 0/2").out.contains("byte-identical"));
}

#[test]
fn a_failing_policy_ends_the_run_and_keeps_finished_episodes() {
    let good = "return { position = obs.position, axis_angle = obs.axis_angle, closure = 0 }";
    for (bad, output) in [
        ("error 'lost'", "p.lua:3: lost"),
        ("return 7", "p.lua:2: policy.act: expected an action or a list of actions, got 7"),
        ("while true do end", "p.lua:3: the script ran for more than 5 s"),
    ] {
        let project = project(&format!(
            "local episode\nreturn softvt.policy {{ name = 'p', reset = function(t) episode = t.episode end, act = function(obs)\nif episode == 1 then {bad} end {good} end }}"
        ));
        let message = project.refusal("x.lua --policy p.lua --episodes 2 --threads 1 --out run");
        assert!(
            message.contains(output) && message.contains("1 of 2 episodes are in run"),
            "{bad}: {message}"
        );
        assert_eq!(project.lines("run/episodes.jsonl").len(), 1);
    }
}

#[test]
fn nan_actions_fail_only_their_episode() {
    let project = project(
        "local episode\nreturn softvt.policy { name = 'p', reset = function(t) episode = t.episode end, act = function(obs)\n\
         return { position = obs.position, axis_angle = obs.axis_angle, closure = episode == 0 and 0/0 or 0 } end }",
    );
    project.succeeds("x.lua --policy p.lua --episodes 2 --threads 1 --out run");
    let lines = project.lines("run/episodes.jsonl");
    assert_eq!(lines[0]["outcome"]["kind"], "error");
    assert!(
        lines[0]["outcome"]["message"].as_str().is_some_and(|m| m.contains("not finite")),
        "{}",
        lines[0]
    );
    assert_eq!(lines[1]["outcome"]["kind"], "budget");
    assert!(lines[1]["privileged"].is_null(), "it sees observations alone");
    assert_eq!(project.json("run/summary.json")["privileged"], false);
    assert!(project.json("run/softvtbench/summary.json")["privileged"].is_null());
    let only = project.softvt("x.lua --policy p.lua --episodes 1 --threads 1 --out only");
    assert_eq!(only.code, 3, "{}", only.err);
    assert!(
        only.err.contains("no episode is valid: the policy's actions were refused in 1 episode, first: "),
        "{}",
        only.err
    );
    assert!(only.out.contains("task 0 episode 0: invalid: the action"), "{}", only.out);
    project.succeeds("report only --out page");
    let page = project.text("page/report.html");
    assert!(page.contains("not finite") && !page.contains("dropped at"), "nothing was dropped");
}

#[test]
fn a_policy_that_declares_access_to_limits_is_marked_in_its_results() {
    let act = "act = function(obs) return { position = obs.position, axis_angle = obs.axis_angle, closure = 0 } end }";
    let knows = "local tau = softvt.calibration('cube').tau\n";
    let project = project(&format!("{knows}return softvt.policy {{ name = 'knows', {act}"));
    let message = project.refusal("x.lua --policy p.lua --out run");
    assert!(
        message.starts_with("p.lua:1: softvt.calibration: a policy has no access to limits"),
        "{message}"
    );
    assert!(!project.path("run").exists());
    let text = format!("{knows}return softvt.policy {{ name = 'knows', privileged = true, {act}");
    project.write("p.lua", text.as_bytes());
    project.succeeds("x.lua --policy p.lua --out run");
    for file in ["run.json", "summary.json", "softvtbench/summary.json"] {
        assert_eq!(project.json(&format!("run/{file}"))["privileged"], true, "{file}");
    }
    assert_eq!(project.lines("run/episodes.jsonl")[0]["privileged"], true);
    project.succeeds("x.lua --policy run --out again");
    let compared = project.succeeds("compare run again").out;
    assert!(compared.contains("knows (privileged)"), "{compared}");
}

#[test]
fn missing_cameras_are_reported_before_anything_runs() {
    let policy =
        "return softvt.policy { name = 'p', observes = { cameras = { 'sied' } }, act = function() end }";
    let project = project(policy);
    let message = project.refusal("x.lua --policy p.lua --out run");
    assert_eq!(
        message,
        "p.lua:1: policy.observes: unknown camera \"sied\"; there are third_person, wrist (scene of task 0)"
    );
    // Checked before any connection: there is no server at this address.
    let profile = "return softvt.profile { name = 'v', \
         inputs = { { keys = { 'a' }, source = 'camera', camera = 'wirst' } }, \
         actions = { pose = 'absolute', gripper = { open = 0, closed = 1 } } }";
    project.write("v.lua", profile.as_bytes());
    let message = project.refusal("x.lua --policy ws://127.0.0.1:1 --profile v.lua --out run");
    assert_eq!(
        message,
        "--profile v.lua: inputs: unknown camera \"wirst\"; did you mean \"wrist\"? (scene of task 0)"
    );
    assert!(!project.path("run").exists());
}

#[test]
fn recorded_actions_must_fit_the_run() {
    let project = project(WANDERS);
    project.succeeds("x.lua --policy p.lua --episodes 2 --out run");
    project.succeeds("x.lua --policy run --episodes 2 --out again");
    let (first, again) = (project.lines("run/episodes.jsonl"), project.lines("again/episodes.jsonl"));
    assert!(first.iter().zip(&again).all(|(a, b)| a["state_hash"] == b["state_hash"]), "the same motions");
    let info = project.json("again/run.json");
    assert_eq!((info["policy"].as_str(), info["replayed"]["run"].as_str()), (Some("replay"), Some("run")));
    assert!(info["replayed"]["sha256"].as_str().is_some_and(|hash| hash.len() == 64));
    // Repeating the actions of a privileged policy is privileged too.
    project.succeeds("x.lua --out seen");
    project.succeeds("x.lua --policy seen --out echo");
    assert_eq!(project.json("echo/run.json")["replayed"]["policy"], "expert");
    for of in [
        &project.json("echo/run.json"),
        &project.json("echo/summary.json"),
        &project.lines("echo/episodes.jsonl")[0],
    ] {
        assert_eq!(of["privileged"], true);
    }
    assert_eq!(info["privileged"], false);
    let refused = |words: &str, output: &str| {
        let message = project.refusal(&format!("x.lua --policy run {words} --out no"));
        assert!(message.contains(output), "{words}: {message}");
        assert!(!project.path("no").exists());
    };
    refused("--episodes 2 --seed 1", "--policy run: its seed is 0, that of this run 1");
    refused("--episodes 2 --twin rigid", "no run of suite one (rigid twin); available: one");
    refused("--episodes 4", "it lacks 2 of the 4 requested episodes: task 0 episode 2, task 0 episode 3");
    std::fs::remove_file(project.path("run/actions/task_000/episode_00001.npy")).expect("removed");
    refused("--episodes 2", "it lacks 1 of the 2 requested episodes: task 0 episode 1");
    let other = project.text("x.lua").replace("name = \"one\", object", "name = \"two\", object");
    project.write("x.lua", other.as_bytes());
    refused("--episodes 1", "no run of suite two; available: one");
}

#[test]
fn flags_without_effect_are_refused() {
    let project = project(WANDERS);
    project.write(
        "profile.lua",
        b"return softvt.profile { name = 'x',\n inputs = {}, actions = {\n pose = 'absolut' } }",
    );
    for (words, output) in [
        (
            "--policy noop --replan 3",
            "--replan: applies to policy servers and Lua policies only; --policy noop ignores it",
        ),
        ("--protocol vla-eval", "--protocol: applies to policy servers only; --policy expert ignores it"),
        ("--policy random --profile vision", "--profile: applies to policy servers only"),
        (
            "--policy noop --gripper binary",
            "--gripper: applies to policy servers and Lua policies only; --policy noop",
        ),
        ("--policy q.lua", "q.lua: no such file"),
        ("--policy profile.lua", "profile.lua:"),
        (
            "--policy ws://127.0.0.1:9 --profile profile.lua",
            "profile.lua:3: profile.actions.pose: expected one of",
        ),
        ("--policy ws://127.0.0.1:99999", "\"99999\" is not a port"),
        ("--policy ws://127.0.0.1:0", "\"0\" is not a port"),
        ("--policy ws://127.0.0.1:x", "--policy ws://127.0.0.1:x: "),
    ] {
        let message = project.refusal(&format!("x.lua {words} --out run"));
        assert!(message.contains(output), "{words}: {message}");
        assert!(!project.path("run").exists(), "{words}");
    }
    let message = project.refusal("p.lua");
    assert!(message.contains("which is not a plan; run softvt SUITE.lua --policy"), "{message}");
}

#[test]
fn profiles_in_lua_are_used_for_servers() {
    // There is no server: the profile is read, and only the connection fails.
    let free = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let project = project(WANDERS);
    let words =
        format!("x.lua --policy ws://{free} --policy-timeout 0.2 --profile scripts/profiles/libero.lua");
    let output = project.softvt(&words);
    assert_eq!(output.code, 3, "{}", output.err);
    assert!(output.err.contains("no policy server at"), "{}", output.err);
}

#[test]
fn policies_and_profiles_in_lua_are_listed() {
    let project = project(WANDERS);
    project.write("scripts/policies/mine.lua", b"-- Mine. It is good.\nreturn 1\n");
    let listed = |what: &str| project.succeeds(&format!("list {what}")).out;
    let policies = listed("policies");
    for name in ["tactile-servo", "scripts/policies/mine.lua", "scripts/policies/hold.lua"] {
        assert!(policies.contains(name), "{name}\n{policies}");
    }
    let mine = policies.lines().find(|line| line.starts_with("scripts/policies/mine.lua"));
    assert!(mine.is_some_and(|line| line.ends_with("  Mine")), "{policies}");
    for line in ["visuo_tactile", "scripts/profiles/libero.lua"] {
        assert!(listed("profiles").contains(line), "{line}\n{}", listed("profiles"));
    }
}

/// An expert that grasps the cube from above, closing fully without tactile feedback, and lifts it.
const GREEDY: &str = "local c = scene:object('cube').centre
    local at = softvt.pose { position = { c[1], c[2], 0.022 } }
    arm:move_to(at:translated { 0, 0, 0.05 }, { speed = 0.5 })
    arm:move_to(at, { speed = 0.25 }) arm:grasp(0.9, { rate = 0.6 })
    arm:move_by({ 0, 0, 0.06 }, { speed = 0.2 }) arm:wait(0.5)
    if scene:object('cube').centre[3] < 0.06 then arm:give_up('it did not come along') end";

#[test]
fn the_tactile_servo_stops_at_contact() {
    let project = Small { task: "budget_steps = 400", expert: GREEDY, ..Small::default() }.project();
    let mut d = Vec::new();
    for policy in ["expert", "tactile-servo"] {
        let output = project.succeeds(&format!("x.lua --policy {policy} --threads 1 --out {policy}"));
        let episode = &project.lines(&format!("{policy}/episodes.jsonl"))[0];
        assert!(episode["gave_up"].is_null(), "{policy} lifts it: {episode}\n{}", output.err);
        for file in ["run.json", "summary.json", "softvtbench/summary.json"] {
            assert_eq!(project.json(&format!("{policy}/{file}"))["privileged"], true, "{file}");
        }
        assert_eq!(episode["privileged"], true);
        d.push(episode["d_peak"].as_f64().expect("a number"));
    }
    assert!(d[1] < 0.2 * d[0], "D is {} % with commanded closures, {} % with the tactile servo", d[0], d[1]);
    assert!(project.succeeds("replay tactile-servo 0/0").out.contains("byte-identical"));
}

/// Peak force on a pad, N, as a policy lifts a cube of a material that starts below the hand.
fn peak_force_of_lifting(policy: &str, material: &'static str) -> f64 {
    let project = Small {
        shape: "softvt.shape.box { size = { 0.05, 0.05, 0.05 } }:grounded()",
        material,
        at: "at = { -0.187, -0.005 }",
        task: "budget_steps = 500",
        ..Small::default()
    }
    .project();
    let output = project.succeeds(&format!("x.lua --policy {policy} --threads 1 --out run"));
    let episode = &project.lines("run/episodes.jsonl")[0];
    assert_eq!(episode["failed_stage"], "carry", "{}", output.err);
    assert_eq!(episode["no_drop"], true, "{}", output.err);
    episode["peak_pad_force_n"].as_f64().expect("a number")
}

#[test]
fn a_policy_feels_how_firmly_it_must_hold() {
    let policy = "scripts/policies/feel_and_lift.lua";
    let light = peak_force_of_lifting(policy, "youngs_pa = 2e4, poisson = 0.3, density = 300");
    let heavy = peak_force_of_lifting(policy, "youngs_pa = 2e4, poisson = 0.3, density = 1800");
    // The force that holds the heavy cube at the friction of a sliding pad, 1.2. Contact alone takes about 0.4 N.
    let least = 0.05_f64.powi(3) * 1800.0 * 9.81 / (2.0 * 1.2);
    assert!(light < 0.6, "{light} N for a light cube");
    assert!((1.05..2.0).contains(&(heavy / least)), "{heavy} N for a heavy cube, which {least} N hold");
}

#[test]
fn arm_tactile_is_refused_where_it_is_not_available() {
    let project = Small { expert: "arm:tactile()", ..Small::default() }.project();
    let message = project.refusal("x.lua --out run");
    assert!(
        message.contains(
            "x.lua:12: arm:tactile: finger readings are available in simulation:drive and under --policy tactile-servo"
        ),
        "{message}"
    );
}

#[test]
fn a_policy_cannot_be_privileged_in_its_episodes_alone() {
    let body = "act = function(obs) print('granted: ' .. tostring((pcall(softvt.soft, { youngs_pa = 1e4, poisson = 0.3, density = 300 }))))
return { position = obs.position, axis_angle = obs.axis_angle, closure = 0 } end";
    // The message about a missing module differed between loading and episodes.
    let project = project(&format!(
        "local _, why = pcall(require, 'no_such_module')
local in_episode = tostring(why):find('was not loaded', 1, true) ~= nil
return softvt.policy {{ name = 'flip', privileged = in_episode, {body} }}"
    ));
    let output = project.succeeds("x.lua --policy p.lua --threads 1 --out run");
    assert!(output.err.contains("granted: false") && !output.err.contains("granted: true"), "{}", output.err);
    assert_eq!(project.json("run/run.json")["privileged"], false);
}
