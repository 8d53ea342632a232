//! Experiments: points that do not depend on each other, and results that are refused.

use insta::assert_snapshot;

use crate::support::Project;

fn experiment(fields: &str) -> Project {
    Project::new(&[(
        "x.lua",
        &format!("local count = 0\nreturn softvt.experiment {{ name = 'x', {fields} }}"),
    )])
}

fn problem(fields: &str) -> String {
    let project = experiment(fields);
    let (_, outcome) = project.run("x.lua").experiment();
    project.message(outcome)
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

#[test]
fn experiments_without_results_are_refused() {
    let run = "run = function(point) return { b = point.a } end";
    assert!(
        problem(&format!("grid = {{ a = {{}} }}, {run}"))
            .contains("experiment.grid.a: expected at least 1, got 0")
    );
    let points = format!("points = function() return {{ a = 1 }} end, {run}");
    assert!(problem(&points).contains("experiment.points: expected a list of at least one table"));
    let outside = "grid = { a = { 1 } }, run = function() return { a = 1 } end, finish = function() return { files = { ['/x.svg'] = 'x' } } end";
    assert!(
        problem(outside).contains("finish.files: \"/x.svg\" is no path within the folder; give one such as")
    );
    let misspelt = "grid = { a = { 1 } }, run = function(point) return { b = point.aa } end";
    assert_snapshot!(problem(misspelt), @r#"x.lua:2: point: unknown key "aa"; did you mean "a"? (point 0 {"a":1})"#);
    let listed = "points = function() return { { young = 1 }, { change = 2 } } end, run = function(p) return { b = p.change or p.youngs } end";
    assert_snapshot!(problem(listed), @r#"x.lua:2: point: unknown key "youngs"; did you mean "young"? (point 0 {"young":1})"#);
    assert_snapshot!(problem(&format!("grid = {{ a = {{ 1, 2, 1 }} }}, {run}")), @"x.lua:2: experiment.grid.a[3]: 1 is there already; give each once");
    assert_snapshot!(problem(&format!("grid = {{ a = {{ 1 }} }}, columns = {{ 'b', 'b' }}, {run}")), @r#"x.lua:2: experiment.columns[2]: "b" is there already; give each once"#);
    let columns = format!("grid = {{ a = {{ 1 }} }}, columns = {{ 'bb' }}, {run}");
    assert!(
        problem(&columns).contains(
            "experiment.columns: no row has any of them: unknown column \"bb\"; did you mean \"b\"?"
        )
    );
}

#[test]
fn a_world_that_is_invalid_makes_no_further_step() {
    let run = r#"function()
  local world = softvt.world {}
  local soft = softvt.soft { youngs_pa = 20, poisson = 0.4, density = 3000 }
  world:soft { shape = softvt.shape.box { size = { 0.05, 0.05, 0.05 } }, position = { 0, 0, 0.025 }, body = soft }
  world:static { shape = softvt.shape.box { size = { 1, 1, 0.1 } }, position = { 0, 0, -0.05 } }
  for _ = 1, 60 do world:step() end
  return { a = 1 }
end"#;
    let message = problem(&format!("grid = {{ a = {{ 1 }} }}, run = {run}"));
    assert!(message.contains("world:step: the world is invalid: "), "{message}");
}

#[test]
fn bodies_of_a_world_that_overlap_are_refused() {
    let world = |actions: &str| {
        let run = format!(
            r#"function()
  local world = softvt.world {{}}
  local soft = softvt.soft {{ youngs_pa = 2e4, poisson = 0.4, density = 300 }}
  local box = softvt.shape.box {{ size = {{ 0.04, 0.04, 0.04 }} }}
  local function body(name, x) world:soft {{ name = name, shape = box, position = {{ x, 0, 0.02 }}, body = soft }} end
  local function solid(name, x) return world:kinematic {{ name = name, shape = box, position = {{ x, 0, 0.02 }} }} end
  {actions}
  return {{ a = 1 }}
end"#
        );
        experiment(&format!("grid = {{ a = {{ 1 }} }}, run = {run}"))
    };
    let refused = |actions: &str| {
        let project = world(actions);
        let (_, outcome) = project.run("x.lua").experiment();
        project.message(outcome)
    };
    let overlap = refused("body('cube', 0) body('other', 0.03)");
    assert!(overlap.contains("\"cube\" and \"other\" overlap by 10 mm; move them apart"), "{overlap}");
    let overlap = refused("body('cube', 0)\n  world:step()\n  solid('pad', 0.03)");
    assert!(
        overlap.contains("x.lua:7: ") && overlap.contains("\"cube\" and \"pad\" overlap by"),
        "{overlap}"
    );
    // Contact carries a body along, however far a solid moves in a step.
    for free in ["0.5, 0, 0.02", "0.0401, 0.5, 0.5", "-0.2, 0, 0.02"] {
        let actions = format!("body('cube', 0) solid('pad', 0.0401):move_to {{ {free} }}\n  world:step()");
        assert_eq!(world(&actions).run("x.lua").rows().len(), 1, "{free}");
    }
}
