//! Objects that settle otherwise than they are modelled: the expert grips them as they lie, the check tells them.

use crate::support::{Project, Small};

/// A cone of a shallow flank, with its axis along y: it rolls onto its flank.
const CONE: &str = "softvt.shape.lathe { corners = { { 0, 0 }, { 0.017, 0 }, { 0.003, 0.04 }, { 0, 0.04 } } }\
                    :rotate { axis = 'x', angle = math.rad(90) }:grounded()";
/// A berry that stands on its tip, and falls over.
const BERRY: &str = "softvt.shape.lathe { corners = { { 0, 0 }, { 0.002, 0 }, { 0.014, 0.02 }, { 0.012, 0.03 }, \
                     { 0, 0.034 } } }:round(0.001):grounded()";
/// An egg on its thin end.
const EGG: &str = "softvt.shape.ellipsoid { size = { 0.036, 0.036, 0.052 } }:rotate { axis = 'x', angle = 0.3 }\
                   :grounded()";

/// A task that puts an object of this shape on a plate, with the standard expert.
fn placing(shape: &str) -> String {
    format!(
        r#"local pick_place, plate, table_top = require "experts.pick_place", require "assets.plate", require "assets.table"
local thing = softvt.asset {{ name = "thing", shape = {shape},
  body = softvt.soft {{ youngs_pa = 1e5, poisson = 0.4, density = 500, damage_strain = 0.15 }} }}
local layout = softvt.layout("one", function(scene, rng)
  scene:add {{ name = "table", asset = table_top, position = {{ 0, 0, 0 }} }}
  scene:add {{ name = "plate", asset = plate, at = {{ 0.04, 0.12 }} }}
  scene:add {{ name = "thing", asset = thing, at = {{ -0.04, -0.12 }}, yaw = 0.4 }}
end)
return softvt.suite {{ name = "tilted", object_type = "deformable", tasks_differ_in = "object", episodes = 1, tasks = {{
  softvt.task {{ prompt = "place it", layout = layout, goal = softvt.on {{ object = "thing", target = "plate" }},
    expert = pick_place {{ object = "thing", target = "plate" }} }} }} }}
"#
    )
}

#[test]
fn an_object_that_settles_tilted_is_gripped_as_it_lies() {
    for shape in [CONE, BERRY, EGG] {
        let project = Project::new(&[("x.lua", &placing(shape))]);
        let finished = project.run("x.lua").out("run").finish();
        let messages = finished.messages.clone();
        assert!(finished.result().records[0].verdict.goal, "{shape}: {messages}");
    }
}

#[test]
fn an_expert_without_room_names_what_is_in_its_way() {
    let wall = "scene:add { name = 'fence', asset = softvt.asset { name = 'fence', body = softvt.static {},\n\
                shape = softvt.shape.box { size = { 0.09, 0.09, 0.12 } }:subtract(softvt.shape.box \
                { size = { 0.05, 0.05, 1 } }):grounded() }, at = { -0.04, -0.12 } }\nend)";
    let block = "softvt.shape.box { size = { 0.03, 0.03, 0.03 } }:grounded()";
    let project = Project::new(&[("x.lua", &placing(block).replacen("end)", wall, 1))]);
    let messages = project.run("x.lua").out("run").finish().messages;
    let reason = "gave up: thing leaves no clearance for the hand: fence is ";
    assert!(messages.contains(reason) && messages.contains(" mm in its way (3 attempts)"), "{messages}");
}

#[test]
fn the_check_tells_objects_that_tilt_fall_over_or_do_not_come_to_rest() {
    let told = |shape: &'static str| Small { shape, ..Small::default() }.project().run("x.lua").check();
    let said = |shape| told(shape).expect("valid").join("\n");
    assert!(said(CONE).contains("object cube: it tilts by 19° while it settles; "), "{}", said(CONE));
    assert!(said(BERRY).contains("object cube: it falls over by "), "{}", said(BERRY));
    let upright = said(Small::default().shape);
    assert!(!upright.contains("settles"), "{upright}");
    let rolling = "local ramp = softvt.asset { name = 'ramp', shape = softvt.shape.box { size = { 8, 1, 0.05 } }\
                   :rotate { axis = 'y', angle = 0.1 }, body = softvt.static {} }\n\
                   scene:add { name = 'ramp', asset = ramp, position = { 0, 1.2, 0.6 } }\n\
                   scene:add { name = 'ball', asset = softvt.asset { name = 'ball', body = softvt.rigid { density = 500 },\n\
                   shape = softvt.shape.sphere { radius = 0.01 }:grounded() }, at = { 0, 1.2 }, on = 'ramp' }\nend)";
    let text = Small::default().text().replacen("end)", rolling, 1);
    let project = Project::new(&[("x.lua", &text)]);
    let message = project.message(project.run("x.lua").check());
    assert!(message.contains("layout one, episode 0: object ball still moves at "), "{message}");
    // The speed is that of the ball, and not of a lever of a larger object: it has rolled for three seconds.
    let speed =
        message.split("moves at ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
    let rolled = 5.0 / 7.0 * 9.81 * 0.1_f64.sin() * 3.0 * 1e3;
    assert!(speed.is_some_and(|speed| speed > rolled && speed < 2.5 * rolled), "{message}: {rolled}");
}
