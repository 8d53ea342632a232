//! Visuals in Lua: their values in the scene, and the messages about invalid tables.

use std::sync::Arc;

use super::{Project, SUITE, episode_id, open};
use softvt_scene::{Body, Mask, Visual};

fn with_visuals(visuals: &str) -> String {
    format!(
        "local mask = softvt.mask\nlocal asset = softvt.asset {{\n  name = \"bun\",\n  shape = softvt.shape.sphere {{ \
         radius = 0.03 }}:grounded(),\n  body = softvt.scenery {{}},\n  visuals = {visuals},\n}}\n"
    )
}

fn read(visuals: &str) -> Vec<Visual> {
    let text = SUITE.replace(
        "  scene:add { name = \"ball\", asset = ball,",
        "  scene:add { name = \"bun\", asset = asset, position = { 0, 0, 0 } }\n  scene:add { name = \"ball\", asset = ball,",
    );
    let project = Project::new(&[("suites/x.lua", &(with_visuals(visuals) + &text + "\nreturn suite()"))]);
    let loaded = project.load("suites/x.lua", &[]).unwrap();
    let scene = open(&loaded, &episode_id(0, 0)).unwrap().scene;
    assert_eq!(scene.objects[0].asset.body, Body::Scenery);
    scene.objects[0].asset.visuals.clone()
}

#[test]
fn layers_reach_the_scene_as_they_are_written() {
    let visuals = read(
        "{ { albedo = { 0.5, 0.4, 0.3 }, roughness = 0.2, layers = {
          { mask = mask.noise { size_m = 0.01, from = 0.6, to = 0.4, seed = 7 }, albedo = { 1, 1, 1 }, opacity = 0.5, relief_m = 1e-4 },
          { albedo = { 0, 0, 0 }, roughness = 0.9,
            mask = mask.facing { axis = 'x' }:intersect(mask.gradient { from_m = 0, to_m = 0.02 }):intersect(mask.weave { pitch_m = 1e-3 }:inverted()) },
          { albedo = { 0, 0, 0 } },
        } } }",
    );
    let [visual] = visuals.as_slice() else { panic!("one visual") };
    assert_eq!((visual.albedo, visual.roughness, visual.metalness), ([0.5, 0.4, 0.3], 0.2, 0.0));
    let [noise, both, whole] = visual.layers.as_slice() else { panic!("three layers") };
    assert_eq!(noise.mask, Mask::Noise { size_m: [0.01; 3], octaves: 3, from: 0.6, to: 0.4, seed: 7 });
    assert_eq!((noise.opacity, noise.relief_m, noise.roughness), (0.5, 1e-4, 0.6));
    let weave = Mask::Inverse { mask: Arc::new(Mask::Weave { pitch_m: 1e-3 }) };
    let masks = vec![
        Mask::Facing { axis: [1.0, 0.0, 0.0], from: 0.0, to: 1.0 },
        Mask::Gradient { axis: [0.0, 0.0, 1.0], from_m: 0.0, to_m: 0.02 },
        weave,
    ];
    let masks = masks.into_iter().map(Arc::new).collect();
    assert_eq!(both.mask, Mask::Product { masks });
    assert_eq!((&whole.mask, whole.opacity), (&Mask::Whole, 1.0));
}
