//! Policies in Lua and the tactile servo.

use softvt::{evaluation::stage::TaskStage, policy::builtin::NoopPolicy, runner::PolicyConfig};

use crate::support::{Project, Small, assert_contains};

const WANDERS: &str = include_str!("../data/wanders.lua");

/// Twelve control steps of a cube on a floor.
fn policy_project(policy: &str) -> Project {
    let project = Small { task: "budget_steps = 12", ..Small::default() }.project();
    project.write("p.lua", policy.as_bytes());
    project
}

#[test]
fn a_policy_in_rust_has_no_name_of_a_built_in_one() {
    let of =
        |name| PolicyConfig::of(name, |_| Box::<NoopPolicy>::default()).map(drop).map_err(|e| e.to_string());
    assert_eq!(of("mine"), Ok(()));
    assert_eq!(
        of("expert"),
        Err("policy: \"expert\" is a built-in policy; give yours another name".to_owned())
    );
}

#[test]
fn results_do_not_depend_on_threads_or_interruptions() {
    let project = policy_project(WANDERS);
    let run = || project.run("x.lua").policy("p.lua").episodes(3);
    run().threads(1).out("one").finish();
    run().threads(2).out("two").finish();
    // The state after a crash in the second episode.
    run().threads(1).out("three").finish();
    let first = project.text("three/episodes.jsonl").lines().next().expect("a line").to_owned() + "\n";
    project.write("three/episodes.jsonl", first.as_bytes());
    std::fs::remove_file(project.path("three/summary.json")).expect("removed");
    assert_eq!(run().threads(2).resume().out("three").records().len(), 3);
    for file in ["run.json", "episodes.jsonl", "summary.json"] {
        let one = project.text(&format!("one/{file}"));
        assert_eq!(one, project.text(&format!("two/{file}")), "{file} on two threads");
        assert_eq!(one, project.text(&format!("three/{file}")), "{file} resumed");
    }
    let info = project.json("one/run.json");
    assert_eq!((info["policy"].as_str(), info["privileged"].as_bool()), (Some("wanders"), Some(false)));
    let file = info["policy_file"].as_str().expect("a path");
    assert_eq!((project.relative(file).as_str(), info["replan"].as_u64()), ("p.lua", Some(2)));
    assert!(info["sources"][file].as_str().is_some_and(|hash| hash.len() == 64));
    assert!(project.is_reproduced("one", "0/2"));
    project.write("p.lua", WANDERS.replace("0.01", "0.02").as_bytes());
    assert_contains(run().resume().out("three").error(), "belongs to another run: sources.p.lua");
}

#[test]
fn policies_see_sensor_noise_that_does_not_depend_on_threads() {
    // It moves by the noise of the markers.
    let policy = policy_project(
        "return softvt.policy { name = 'feels', observes = { tactile = true }, act = function(obs)
  local motion = obs.tactile.left.markers:mean()
  local p = obs.position
  return { position = { p[1] + 0.01 * motion[1], p[2], p[3] }, axis_angle = obs.axis_angle, closure = 0 }
end }
",
    );
    let run = || policy.run("x.lua").policy("p.lua").episodes(3).threads(1);
    let noisy = || run().set("tactile.wear.noise_px", 0.1).set("tactile.wear.image_noise", 1);
    run().out("exact").finish();
    run().set("tactile.wear.noise_px", 0).out("off").finish();
    noisy().out("one").finish();
    noisy().threads(2).out("two").finish();
    noisy().seed(1).out("seeded").finish();
    let [exact, off, one, two, seeded] = ["exact", "off", "one", "two", "seeded"].map(|out| {
        std::fs::read(policy.path(&format!("{out}/actions/task_000/episode_00000.npy"))).expect("actions")
    });
    assert_eq!((&exact, &one), (&off, &two));
    assert!(one != exact && one != seeded);
    assert!(policy.is_reproduced("one", "0/2"));
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
    let project = Small { task: "budget_steps = 240", expert: GREEDY, ..Small::default() }.project();
    let mut d = Vec::new();
    for policy in ["expert", "tactile-servo"] {
        let episode = project.run("x.lua").policy(policy).threads(1).out(policy).record();
        assert!(episode.stats.gave_up.is_none(), "{policy} lifts it: {episode:?}");
        for file in ["run.json", "summary.json", "softvtbench/summary.json"] {
            assert_eq!(project.json(&format!("{policy}/{file}"))["privileged"], true, "{file}");
        }
        assert!(episode.header.privileged);
        d.push(episode.verdict.object().d_peak.expect("a number"));
    }
    assert!(d[1] < 0.2 * d[0], "D is {} % with commanded closures, {} % with the tactile servo", d[0], d[1]);
    assert!(project.is_reproduced("tactile-servo", "0/0"));
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
    let verdict = project.run("x.lua").policy(policy).threads(1).record().verdict;
    assert_eq!((verdict.failed_stage, verdict.no_drop), (Some(TaskStage::Carry), true), "{verdict:?}");
    verdict.object().peak_pad_force_n
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
