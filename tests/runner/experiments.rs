//! Experiments: points that do not depend on each other, and drives by experts.

use crate::support::Project;

fn experiment(fields: &str) -> Project {
    Project::new(&[(
        "x.lua",
        &format!("local count = 0\nreturn softvt.experiment {{ name = 'x', {fields} }}"),
    )])
}

#[test]
fn variables_that_a_point_changes_do_not_reach_others() {
    let run = "function(point) count = count + point.a return { count = count } end";
    let project = experiment(&format!("grid = {{ a = {{ 1, 2, 3, 4 }} }}, run = {run}"));
    for threads in [1, 3] {
        let rows = project.run("x.lua").threads(threads).rows();
        let counts: Vec<Option<f64>> = rows.iter().map(|row| row["count"].as_f64()).collect();
        assert_eq!(counts, [1.0, 2.0, 3.0, 4.0].map(Some));
    }
}

#[test]
fn a_point_may_be_written_returned_and_lack_a_field() {
    let run = "run = function(p) p.c = p.b or 0 return p end";
    let rows = |points: &str| experiment(&format!("{points}, {run}")).run("x.lua").rows();
    let listed = rows("points = function() return { { a = 1 }, { a = 2, b = 3 } } end");
    assert_eq!((listed[0]["c"].as_f64(), listed[1]["c"].as_f64()), (Some(0.0), Some(3.0)));
    assert_eq!(rows("grid = { a = { 1 }, b = { 5 } }")[0]["c"].as_f64(), Some(5.0));
}

/// An experiment with a row for each `x`, which tells how a drive by an expert ended. `far` is a pose out of reach.
fn drive(x: &str, expert: &str) -> Project {
    experiment(&format!(
        "grid = {{ x = {{ {x} }} }}, run = function(point)
          local floor = softvt.asset {{ name = 'floor', shape = softvt.shape.box {{ size = {{ 1, 1, 0.1 }} }}, body = softvt.static {{}} }}
          local layout = softvt.layout('l', function(scene) scene:add {{ name = 'floor', asset = floor, position = {{ 0, 0, -0.05 }} }} end)
          local sim, far = softvt.simulate {{ layout = layout }}, softvt.pose {{ position = {{ 5, 0, 0.3 }} }}
          local run, ok, why = pcall(sim.drive, sim, function(arm)
            {expert}
          end)
          return {{ run = run, ok = ok == true, why = why or (run and '' or ok) }}
        end"
    ))
}

#[test]
fn a_script_that_catches_a_pose_out_of_reach_goes_on_with_its_next_command() {
    let project = drive(
        "'give up', 'wait', 'fail'",
        "pcall(arm.move_to, arm, far)
            if point.x == 'give up' then arm:give_up 'mine' elseif point.x == 'fail' then error('my error', 0) end
            arm:wait(0.2)",
    );
    let rows = project.run("x.lua").rows();
    let ended = |row: usize| (rows[row]["run"].as_bool(), rows[row]["ok"].as_bool());
    assert_eq!([ended(0), ended(1)], [(Some(true), Some(false)), (Some(true), Some(true))], "{rows:?}");
    assert_eq!(rows[0]["why"], "the expert gave up: mine");
    let error = rows[2]["why"].as_str().unwrap_or_default();
    assert!(ended(2).0 == Some(false) && error.ends_with("x.lua:8: my error"), "{rows:?}");
}

#[test]
fn a_pose_out_of_reach_ends_a_drive_with_the_reason() {
    let project = drive("5, 0.1", "arm:move_to(softvt.pose { position = { point.x, 0, 0.3 } })");
    let rows = project.run("x.lua").rows();
    assert_eq!([rows[0]["ok"].as_bool(), rows[1]["ok"].as_bool()], [Some(false), Some(true)]);
    let reason = project.relative(rows[0]["why"].as_str().expect("a reason"));
    assert!(
        reason.starts_with("the expert gave up: ")
            && reason
                .contains("x.lua:7: unreachable pose: the tool gets no nearer to (5.000, 0.000, 0.300) m"),
        "{reason}"
    );
}
