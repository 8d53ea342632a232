//! Volumes, masses and calibration files.

use super::*;
use crate::Experiment;

/// The message of a script that raises its result.
fn message_of(text: &str) -> String {
    Project::new(&[("suites/x.lua", text)]).load("suites/x.lua", &[]).expect_err("it raises").message
}

#[test]
fn volume_and_mass_are_those_of_closed_forms() {
    let text = "local s = softvt.shape\n\
        local box, ball = s.box { size = { 0.1, 0.04, 0.03 } }, s.sphere { radius = 0.03 }\n\
        error(('%.6f %.6f'):format(1e6 * box:volume(), 1e6 * ball:grounded():volume()), 0)";
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 27.0;
    assert_eq!(message_of(text), format!("120.000000 {ball:.6}"));
    let chest = "local box = softvt.shape.box { size = { 0.1, 0.1, 0.03 } }
        local joint = softvt.slider { axis = { 0, -1, 0 }, lower = 0, upper = 0.1 }
        local function part(name, z, density) return { name = name, shape = box:translate(0, 0, z), density = density, joint = joint } end
        local parts = { part('low', 0.05, 500), part('high', 0.1, 1000) }
        local chest = softvt.asset { name = 'chest', shape = box:grounded(), body = softvt.articulated { parts = parts } }
        local block = softvt.asset { name = 'block', shape = box:grounded(), body = softvt.rigid { density = 100 } }
        local wall = softvt.asset { name = 'wall', shape = box:grounded(), body = softvt.static {} }
        local layout = softvt.layout('one', function(scene)
          for i, asset in ipairs { chest, block, wall } do scene:add { name = asset.name, asset = asset, at = { i, 0 } } end
          local chest, block, wall = scene.objects[1], scene.objects[2], scene.objects[3]
          for _, object in ipairs { chest, block, wall } do object:scale_mass(2) end
          local results = { chest:mass(), chest:mass 'low', block:mass(), tostring(wall:mass()) }
          for i = 1, 3 do results[i] = ('%.3f'):format(results[i]) end
          local ok, why = pcall(function() chest:mass 'lo' end)
          results[5] = tostring(why):match 'unknown.*'
          error(table.concat(results, ' '), 0)
        end)
        softvt.simulate { layout = layout }";
    assert_eq!(message_of(chest), "0.900 0.300 0.060 nil unknown part \"lo\"; did you mean \"low\"?");
}

#[test]
fn a_calibration_is_read_when_the_plan_is_made_and_no_later() {
    let library = "local c = softvt.calibration 'sphere'\n\
        error(('%s %.2f %s'):format(c.window.extent_mm > 1, c.tau, softvt.calibration 'nothing_like_it'), 0)";
    let text = message_of(library);
    assert!(text.starts_with("true ") && text.ends_with(" nil"), "{text}");
    let late = "local none = softvt.calibration 'absent'\n\
        return softvt.experiment { name = 'e', grid = { a = { 1 } }, run = function()\n\
        return { none = tostring(none), late = pcall(softvt.calibration, 'sphere') and 'given' or 'refused' } end }";
    let project = Project::new(&[("x.lua", late)]);
    let loaded = project.load("x.lua", &[]).expect("loads");
    // A file that was absent stays absent in later virtual machines, even if it exists by then.
    project.write("assets/calibration/absent.json", b"{}");
    let rows = Experiment::open(&loaded).expect("opens").run(0).expect("a row");
    assert_eq!(rows[0]["none"], "nil");
    let early = Experiment::open(&loaded).expect("opens");
    assert_eq!(early.run(0).expect("a row")[0]["late"], "refused", "requested too late");
}

#[test]
fn a_draw_reference_is_made_once_for_an_object() {
    let text = message_of(
        "local function ball(youngs, resolution)
          return softvt.asset { name = 'sphere', shape = require('assets.sphere').shape, body = softvt.soft {
            youngs_pa = youngs, poisson = 0.3, density = 300, resolution = resolution } }
        end
        local function made(asset, text) return softvt.draw_reference(asset, text) and 'made' or 'none' end
        local sphere, text = require 'assets.sphere', softvt.calibration 'sphere'.json
        local soft, fine = softvt.draw_reference(ball(5e3, 6), text), softvt.draw_reference(ball(5e3, 7), text)
        error(('%s %s'):format(made(sphere, text), soft == fine and made(ball(5e3, 6), text)), 0)",
    );
    assert_eq!(text, "none made");
}

#[test]
fn points_may_read_files_that_later_machines_then_hold() {
    let script = "return softvt.experiment { name = 'e',\n\
        points = function() return { { a = require('lib').value } } end,\n\
        run = function(point) return { a = point.a, again = require('lib').value } end }";
    let project = Project::new(&[("x.lua", script), ("lib.lua", "return { value = 7 }")]);
    let loaded = project.load("x.lua", &[]).expect("loads");
    let row = Experiment::open(&loaded).expect("opens").run(0).expect("a row");
    assert_eq!((row[0]["a"].as_i64(), row[0]["again"].as_i64()), (Some(7), Some(7)));
}

#[test]
fn a_main_file_with_the_name_of_a_module_can_require_it() {
    let main = "local shifts = require 'shifts'\nerror(shifts.soft[1].name, 0)";
    let project = Project::new(&[("suites/shifts.lua", main)]);
    assert_eq!(project.load("suites/shifts.lua", &[]).expect_err("it raises").message, "target_stiffness");
    let own = Project::new(&[
        ("suites/shifts.lua", "return 'the suite'"),
        ("scripts/shifts.lua", "return 'the module'"),
        ("suites/x.lua", "error(require 'shifts', 0)"),
    ]);
    assert_eq!(own.load("suites/x.lua", &[]).expect_err("it raises").message, "the module");
}
