//! Experiments: points that do not depend on each other, and results that are refused.

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
fn experiments_without_results_are_refused() {
    let run = "run = function(point) return { b = point.a } end";
    assert!(
        problem(&format!("grid = {{ a = {{}} }}, {run}"))
            .contains("experiment.grid.a: expected at least one value")
    );
    let points = format!("points = function() return {{ a = 1 }} end, {run}");
    assert!(problem(&points).contains("experiment.points: expected a list of at least one table"));
    let misspelt = "grid = { a = { 1 } }, run = function(point) return { b = point.aa } end";
    assert!(problem(misspelt).contains("experiment.run: no point returned a row"));
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
