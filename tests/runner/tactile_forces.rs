//! Tactile readings of a grasp: zero before it, gravity after lifting, and no drift in between.

use softvt::script::ExperimentRow;

use crate::support::Project;

/// Grips a block at a closure, lifts and holds it. Returns rows of both fingers at each stage.
const HOLD: &str = r#"local block = softvt.asset {
  name = "block", shape = softvt.shape.box { size = { 0.06, 0.04, 0.05 } }:grounded(), body = BODY,
}
local floor = softvt.asset { name = "floor", shape = softvt.shape.box { size = { 1, 1, 0.05 } }:translate(0, 0, -0.025), body = softvt.static {} }
local layout = softvt.layout("held", function(scene)
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "block", asset = block, at = { 0, 0 } }
end)
return softvt.experiment {
  name = "hold",
  grid = { closure = { CLOSURE } },
  run = function(point)
    local sim, rows = softvt.simulate { layout = layout, settings = SETTINGS }, {}
    local function note(when)
      for _, side in ipairs { "left", "right" } do
        local felt, x, y, most = sim:tactile(side), 0, 0, 0
        for i, from in ipairs(felt.initial) do
          local dx, dy = felt.present[i][1] - from[1], felt.present[i][2] - from[2]
          x, y, most = x + dx / 99, y + dy / 99, math.max(most, math.abs(dx), math.abs(dy))
        end
        rows[#rows + 1] = { when = when, side = side, x = x, y = y, most = most, force = felt.force, mean = felt.image:mean(), depth_mm = felt.depth_mm }
      end
    end
    note "open"
    assert(sim:drive(function(arm)
      local at = softvt.pose { position = { 0, 0, 0.027 } }
      arm:move_to(at:translated { 0, 0, 0.08 })
      arm:move_to(at)
      arm:close_to(point.closure)
      arm:wait(0.5)
    end))
    note "gripped"
    assert(sim:drive(function(arm) arm:move_by({ 0, 0, 0.08 }, { speed = 0.1 }) arm:wait(0.5) end))
    note "lifted"
    assert(sim:wait(2))
    note "held"
    return rows
  end,
}
"#;

fn rows(body: &str, closure: &str, settings: &str) -> Vec<ExperimentRow> {
    let text = HOLD.replace("BODY", body).replace("CLOSURE", closure).replace("SETTINGS", settings);
    Project::new(&[("hold.lua", &text)]).run("hold.lua").rows()
}

fn number(row: &ExperimentRow, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row:?}"))
}

/// Rows of a stage, left and right.
fn stage<'a>(rows: &'a [ExperimentRow], when: &str) -> [&'a ExperimentRow; 2] {
    let of: Vec<&ExperimentRow> = rows.iter().filter(|row| row["when"] == when).collect();
    [of[0], of[1]]
}

fn check(rows: &[ExperimentRow], weight_n: f64) {
    for row in stage(rows, "open") {
        assert_eq!((number(row, "most"), number(row, "depth_mm")), (0.0, 0.0), "nothing touches: {row:?}");
    }
    let (gripped, lifted, held) = (stage(rows, "gripped"), stage(rows, "lifted"), stage(rows, "held"));
    let mut carried = 0.0;
    for side in 0..2 {
        assert!(number(gripped[side], "depth_mm") > 0.01 && number(gripped[side], "most") > 0.1);
        let pull = |row: &ExperimentRow| row["force"][0].as_f64().expect("a number");
        carried -= pull(held[side]);
        // Gravity acts along the fingers towards their tips: to the left in both images.
        let moved = number(lifted[side], "x") - number(gripped[side], "x");
        let pulled = pull(lifted[side]) - pull(gripped[side]);
        assert!(pulled < -0.2 * weight_n && moved < 0.3 * pulled, "{moved} px for {pulled} N");
        for key in ["x", "y", "most"] {
            let drift = number(held[side], key) - number(lifted[side], key);
            assert!(drift.abs() < 0.005, "{key} drifts by {drift} px in two seconds");
        }
    }
    assert!((carried / weight_n - 1.0).abs() < 0.01, "{carried} N of {weight_n} N");
}

#[test]
fn rigid_blocks_press_without_drift() {
    let rows = rows("softvt.rigid { density = 1700 }", "0.53", "nil");
    check(&rows, 0.06 * 0.04 * 0.05 * 1700.0 * 9.81);
}

#[test]
fn soft_blocks_press_without_drift() {
    let rows = rows("softvt.soft { youngs_pa = 8e4, poisson = 0.35, density = 900 }", "0.58", "nil");
    check(&rows, 0.06 * 0.04 * 0.05 * 900.0 * 9.81);
}

#[test]
fn the_sensors_model_pitch_and_gel_are_settings() {
    let settings = "{ tactile = { markers = { model = \"fots\" }, view = { pitch = 5e-5 }, gel = { shear_modulus = 3e5 } } }";
    let stiff = rows("softvt.rigid { density = 1700 }", "0.53", settings);
    let plain = rows("softvt.rigid { density = 1700 }", "0.53", "nil");
    let (stiff, plain) = (stage(&stiff, "held")[0].clone(), stage(&plain, "held")[0].clone());
    assert!(number(&stiff, "depth_mm") < 0.9 * number(&plain, "depth_mm"));
    assert!(stiff["x"] != plain["x"] && stiff["mean"] != plain["mean"]);
    let refusal = |settings: &str| {
        let text = HOLD.replace("BODY", "softvt.rigid { density = 1700 }").replace("CLOSURE", "0.53");
        let (_, outcome) =
            Project::new(&[("hold.lua", &text.replace("SETTINGS", settings))]).run("hold.lua").experiment();
        outcome.expect_err(settings)
    };
    let unknown = refusal("{ tactile = { optics = { model = \"photon\" } } }");
    assert!(
        unknown.contains("photon") && unknown.contains("`polynomial`") && unknown.contains("hold.lua:"),
        "{unknown}"
    );
    let pitch = refusal("{ tactile = { view = { pitch = 0 } } }");
    assert!(pitch.contains("tactile.view.pitch: expected a number in 0.00001..0.0002 (m)"), "{pitch}");
    let tables = refusal("{ tactile = { optics = { model = \"taxim\", tables = \"nowhere\" } } }");
    assert!(tables.contains("nowhere"), "{tables}");
    let shadows = "{ tactile = { shadows = true, optics = { model = \"taxim\", tables = \"nowhere\" } } }";
    let shadows = refusal(shadows);
    assert!(shadows.contains("tactile.shadows: expected false with the model \"taxim\""), "{shadows}");
}
