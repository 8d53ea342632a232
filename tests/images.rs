//! Compares rendered images byte by byte with reviewed references in `tests/golden/camera`.
//!
//! After an intended change, regenerate the references with `.ci/regenerate golden-images` and look at them before
//! committing.

use std::{path::PathBuf, sync::Arc};

use softvt::{
    benchmark::{Plan, settings::Settings},
    disk_cache::DiskCache,
    episode_id::{EpisodeId, EpisodeSplit},
    geometry::{Pose, Quat, Vec3, shape::Shape},
    physics::BodyId,
    robot::tactile::TactileSpec,
    rollout::{AssetCache, Sensors, Simulation},
    scene::{Camera, Lighting, Mask, Visual, VisualLayer},
    script,
    sensing::camera::{FrameView, RenderMesh, RenderObject, RenderScene, RenderedImage, Renderer},
};

/// Compares an image with its reference, or writes the reference.
fn check(name: &str, rendered: RenderedImage) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden/camera").join(name);
    let image = rendered.into_rgb_image();
    if std::env::var_os("SOFTVT_WRITE_GOLDEN").is_some() {
        image.save(&path).expect("the folder can be written");
        return;
    }
    let reference =
        image::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgb8();
    assert_eq!(reference.dimensions(), image.dimensions(), "{name}");
    let differences = reference.as_raw().iter().zip(image.as_raw()).map(|(a, b)| a.abs_diff(*b));
    let (count, max) = differences.fold((0, 0), |(n, max), d| (n + usize::from(d > 0), max.max(d)));
    assert!(
        count == 0,
        "{name}: {count} bytes differ, by up to {max}; if intended, run .ci/regenerate golden-images and look at it"
    );
}

/// The first episode of the first task before anything moves: the layout alone, without mechanics.
#[test]
fn the_first_task_of_spatial_soft_matches_its_reference() {
    let suite = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("suites/spatial_soft.lua");
    let loaded = script::load(&suite, &[]).expect("the suite loads");
    let Plan::Suite(suite) = &loaded.plan else { panic!("it is a suite") };
    let id = EpisodeId {
        suite: suite.name.clone(),
        task: 0,
        episode: 0,
        base_seed: 0,
        split: EpisodeSplit::Validation,
    };
    let scene = script::EpisodeSetup::open(&loaded, &id, &script::SceneChanges::default())
        .expect("the suite opens")
        .scene;
    let sim = Simulation::new(Arc::new(scene), &Settings::default(), &AssetCache::default())
        .expect("the scene builds");
    let assets = AssetCache::default();
    let new_sensors = || Sensors::new(&sim, &TactileSpec::default(), &assets);
    let mut sensors = new_sensors();
    let frame = Sensors::frame(&sim);
    for name in ["third_person", "wrist"] {
        let camera = sensors.camera(name).expect("the scene has it").clone().with_edge(224);
        let image = sensors.render(&frame, &camera).expect("an image");
        assert_eq!(
            image,
            new_sensors().render(&frame, &camera).expect("an image"),
            "{name}: cameras of one renderer do not affect each other"
        );
        check(&format!("spatial_soft_{name}.png"), image);
    }
}

fn layer(mask: Mask, albedo: [f64; 3], relief_m: f64) -> VisualLayer {
    VisualLayer { mask, albedo, roughness: 0.5, opacity: 1.0, relief_m }
}

/// Eight balls: plastic and metal of two roughnesses each, and four patterns.
#[test]
fn materials_match_their_reference() {
    let noise = |octaves, from, to| Mask::Noise { size_m: [0.03; 3], octaves, from, to, seed: 5 };
    let visuals = [
        Visual::plain([0.72, 0.10, 0.08], 0.25, 0.0),
        Visual::plain([0.10, 0.30, 0.62], 0.9, 0.0),
        Visual::plain([0.92, 0.72, 0.34], 0.2, 1.0),
        Visual::plain([0.62, 0.62, 0.63], 0.55, 1.0),
        Visual::plain([0.8; 3], 0.6, 0.0).with(layer(Mask::Checker { size_m: 0.025 }, [0.05; 3], 0.0)),
        Visual::plain([0.86, 0.80, 0.66], 0.6, 0.0).with(layer(
            Mask::Stripes { axis: [0.0, 0.0, 1.0], pitch_m: 0.02, share: 0.4 },
            [0.55, 0.25, 0.08],
            8e-4,
        )),
        Visual::plain([0.70, 0.48, 0.26], 0.8, 0.0).with(layer(
            noise(4, 0.35, 0.75),
            [0.34, 0.17, 0.06],
            1e-3,
        )),
        Visual::plain([0.9; 3], 0.4, 0.0).with(layer(
            Mask::Specks { spacing_m: 0.012, radius_m: 2.5e-3, seed: 3 },
            [0.25, 0.12, 0.04],
            5e-4,
        )),
    ];
    let board =
        Visual::plain([0.42, 0.43, 0.45], 0.7, 0.0).with(layer(noise(3, 0.3, 0.8), [0.36, 0.37, 0.39], 0.0));
    let fixed = |name: String, segmentation_id, shape: &Shape, visual: Visual, at: [f64; 3]| RenderObject {
        mesh: Arc::new(
            RenderMesh::from_shape(&name, shape, &[visual], &DiskCache::DISABLED).expect("a surface"),
        ),
        name,
        segmentation_id,
        body: BodyId::World,
        pose_in_body: Pose::from_parts(Vec3::from(at).into(), Quat::identity()),
        casts_shadow: true,
    };
    let slab = Shape::Box { half: Vec3::new(0.6, 0.6, 0.02) };
    let mut objects = vec![fixed("board".to_owned(), 1, &slab, board, [0.0, 0.0, -0.02])];
    for (i, visual) in visuals.into_iter().enumerate() {
        let at = [if i < 4 { -0.08 } else { 0.08 }, 0.13 * (i % 4) as f64 - 0.195, 0.05];
        objects.push(fixed(format!("ball {i}"), i as u16 + 2, &Shape::Sphere { radius: 0.05 }, visual, at));
    }
    let eye = Vec3::new(0.75, 0.0, 0.55);
    let turn = Quat::face_towards(&(eye - Vec3::new(0.0, 0.0, 0.03)), &Vec3::z());
    let camera = Camera {
        pose: Pose::from_parts(eye.into(), turn),
        width: 288,
        height: 160,
        fovy_rad: 0.38,
        ..Camera::third_person_table()
    };
    let scene = RenderScene::new(objects, Lighting::default()).expect("good light");
    let image = Renderer::default().render(&scene, &FrameView::default(), &camera).expect("an image");
    check("materials.png", image);
}
