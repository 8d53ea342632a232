use super::*;
use softvt_geometry::{Pose, Vec3};
use softvt_physics::joints;
use softvt_rollout::{AssetCache, Simulation};
use softvt_scene::{JointMotion, Scene};

/// A chest with one drawer on the given joint, and further parts.
fn chest(joint: &str, more: &str) -> String {
    format!(
        "local box = softvt.shape.box {{ size = {{ 0.1, 0.1, 0.03 }} }}\n\
         local chest = softvt.asset {{ name = 'chest', shape = box:grounded(), body = softvt.articulated {{ parts = {{\n\
         {{ name = 'drawer', shape = box:translate(0, 0, 0.05), density = 500,\n\
         joint = {joint} }},\n{more}\n}} }} }}\n"
    )
}

const SLIDER: &str = "softvt.slider { axis = { 0, -2, 0 }, lower = 0, upper = 0.1, friction = 1 }";

/// A suite of a chest placed with `place`.
fn suite(chest: &str, place: &str) -> String {
    format!(
        "{chest}local ball = softvt.asset {{ name = 'ball', shape = softvt.shape.sphere {{ radius = 0.02 }}:grounded(), body = softvt.rigid {{ density = 300 }} }}\n\
         local layout = softvt.layout('one', function(scene)\n\
         {place} scene:add {{ name = 'marble', asset = ball, at = {{ 0.5, 0 }} }}\nend)\n\
         return softvt.suite {{ name = 'test', object_type = 'rigid', tasks_differ_in = 'spatial', tasks = {{ softvt.task {{\n\
         prompt = 'p', layout = layout, goal = softvt.on {{ object = 'marble', target = 'chest.drawer' }} }} }} }}"
    )
}

fn open(text: &str) -> Result<Scene, String> {
    let project = Project::new(&[("x.lua", text)]);
    let loaded = project.load("x.lua", &[]).map_err(|e| e.message)?;
    super::open(&loaded, &episode_id(0, 1)).map(|e| e.scene).map_err(|e| project.shorten(e))
}

#[test]
fn thin_walls_are_refused_at_the_placement() {
    let thin = chest(SLIDER, "")
        .replace("shape = box:translate(0, 0, 0.05)", "shape = box:shell(0.0015):translate(0, 0, 0.05)");
    let scene = open(&suite(&thin, "scene:add { name = 'chest', asset = chest, at = { 0, 0 } }")).unwrap();
    let built = Simulation::new(Arc::new(scene), &Default::default(), &AssetCache::default());
    let message = built.expect_err("too thin").to_string();
    let expected = "9: asset chest: part drawer: its walls are about 1.6 mm thick, expected at least 4 mm";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn scene_and_physics_agree_on_part_poses() {
    let more = "{ name = 'door', parent = 'drawer', shape = box:translate(0, 0, 0.1), density = 300,\n\
                joint = softvt.hinge { axis = { 1, 0, 2 }, origin = { 0.05, 0.02, 0.1 }, lower = -1, upper = 1 } },\n\
                { name = 'knob', parent = 'door', shape = box:translate(0, 0, 0.15), density = 300,\n\
                joint = softvt.hinge { axis = { 0, 1, 0 }, origin = { 0, -0.02, 0.15 }, lower = 0.2, upper = 1 } }";
    let place = "scene:add { name = 'chest', asset = chest, at = { 0.1, 0.2 }, yaw = 0.7, joints = { drawer = 0.05, door = 0.6 } }";
    let scene = open(&suite(&chest(SLIDER, more), place)).unwrap();
    let object = scene.objects[0].clone();
    assert_eq!(object.joints, [0.05, 0.6, 0.2], "the knob starts at its nearest limit");
    assert_eq!(object.asset.parts()[1].joint.motion, JointMotion::Turn);
    let placed = softvt_scene::part_poses(object.asset.parts(), &object.joints);
    let sim = Simulation::new(Arc::new(scene), &Default::default(), &AssetCache::default());
    let sim = sim.expect("builds");
    let names: Vec<&str> = sim.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["chest", "chest.drawer", "chest.door", "chest.knob", "marble"]);
    for ((part, _), pose) in sim.parts(0).zip(placed) {
        let (ours, theirs): (Pose, Pose) = (sim.pose(part), object.pose_w * pose);
        let gap = (ours.to_homogeneous() - theirs.to_homogeneous()).amax();
        assert!(gap < 1e-12, "{}: {gap}", part.name);
    }
    let tree = &sim.world.articulations()[0];
    let weight = joints::potential_energy(tree.tree(), tree.poses(), &-Vec3::z());
    let parts = sim.parts(0).map(|(part, _)| sim.centre(part).z);
    let expected: f64 = parts.zip([500.0, 300.0, 300.0]).map(|(z, density)| z * density * 3e-4).sum();
    assert!((weight - expected).abs() < 1e-9, "{weight} {expected}");
}
