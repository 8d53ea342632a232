//! Properties of rendered images. `tests/validation/camera.rs` compares them with a pinhole camera in closed form.

use std::sync::Arc;

use super::{
    math::{V3, Vec3x8, f32x8},
    shade::shadow::ShadowMap,
    *,
};
use softvt_common::disk_cache::DiskCache;
use softvt_geometry::{Pose, Quat, Vec3, mesh::Mesh, shape::Shape};
use softvt_physics::{BodyId, RigidId};
use softvt_scene::{
    Camera, CameraMount, ColouredMesh, Lighting, Mask, MeshColours, MeshMaterial, SurfaceImage, Visual,
    VisualLayer,
};

fn rigid(index: usize) -> BodyId {
    BodyId::Rigid(RigidId::new(index))
}

fn object(id: u16, mesh: RenderMesh, body: BodyId, pose_in_body: Pose) -> RenderObject {
    RenderObject {
        name: format!("object {id}"),
        segmentation_id: id,
        mesh: Arc::new(mesh),
        body,
        pose_in_body,
        casts_shadow: true,
    }
}

fn mesh(shape: &Shape, visual: Visual) -> RenderMesh {
    RenderMesh::from_shape("shape", shape, &[visual], &DiskCache::DISABLED).expect("a surface")
}

fn ball(id: u16, radius: f64, pose_w: Pose) -> RenderObject {
    object(id, mesh(&Shape::Sphere { radius }, Visual::default()), BodyId::World, pose_w)
}

fn checker(size_m: f64) -> Visual {
    let mask = Mask::Checker { size_m };
    Visual::plain([0.1; 3], 1.0, 0.0).with(VisualLayer {
        mask,
        albedo: [0.5; 3],
        roughness: 1.0,
        opacity: 1.0,
        relief_m: 0.0,
    })
}

/// A floor whose top is at z = 0.
fn ground(visual: Visual) -> RenderObject {
    let half = Vec3::new(1.0, 1.0, 0.1);
    let mut ground =
        object(1, mesh(&Shape::Box { half }, visual), BodyId::World, Pose::translation(0.0, 0.0, -0.1));
    ground.casts_shadow = false;
    ground
}

/// A camera at `eye` that looks at `target`; image up is as near to `up` as can be.
fn camera(eye: Vec3, target: Vec3, up: Vec3) -> Camera {
    let turn = Quat::face_towards(&(eye - target), &up);
    Camera { pose: Pose::from_parts(eye.into(), turn), ..Camera::third_person_table() }
}

fn above(height: f64) -> Camera {
    camera(Vec3::new(0.0, 0.0, height), Vec3::zeros(), Vec3::y())
}

fn scene(objects: Vec<RenderObject>) -> RenderScene {
    RenderScene::new(objects, Lighting::default()).expect("the default light is good")
}

fn draw(scene: &RenderScene, camera: &Camera) -> RenderedImage {
    Renderer::default().render(scene, &FrameView::default(), camera).expect("an image")
}

fn focal(camera: &Camera) -> f64 {
    0.5 * camera.height as f64 / (0.5 * camera.fovy_rad).tan()
}

#[test]
fn a_straight_outline_is_straight_in_the_segmentation() {
    // The right side of a box seen from straight above is one column, wherever it lies within a pixel.
    for shift in [0.0, 0.3, 0.5, 0.8] {
        let camera = above(1.0);
        let half = Vec3::new(0.1, 0.1, 0.01);
        let mesh = mesh(&Shape::Box { half }, Visual::default());
        let x = shift / focal(&camera);
        let scene = scene(vec![
            ground(Visual::default()),
            object(2, mesh, BodyId::World, Pose::translation(x, 0.0, 0.0)),
        ]);
        let image = draw(&scene, &camera);
        let rows = image.segmentation.chunks(224).filter(|row| row.contains(&2));
        let ends: Vec<_> = rows.map(|row| row.iter().rposition(|&s| s == 2)).collect();
        assert!(ends.len() > 50 && ends.iter().all(|end| *end == ends[0]), "{shift}: {ends:?}");
    }
}

/// A scene with a floor, a ball and a cube, and its camera.
fn still_life() -> (Vec<RenderObject>, Camera) {
    let cube =
        RenderMesh::from_mesh("cube", &box_mesh(&Vec3::repeat(0.05)), &[checker(0.02)], &DiskCache::DISABLED)
            .expect("a cube");
    let objects = vec![
        ground(checker(0.13)),
        ball(2, 0.06, Pose::translation(0.15, 0.05, 0.06)),
        object(3, cube, rigid(0), Pose::identity()),
    ];
    (objects, camera(Vec3::new(0.7, 0.0, 0.6), Vec3::zeros(), Vec3::z()))
}

fn cube_view(rigid: &[Pose]) -> FrameView<'_> {
    FrameView { rigid, ..FrameView::default() }
}

/// Draws without a cached background, as for a camera that may move: a hand stands still at the origin.
fn draw_uncached(scene: &RenderScene, rigid: &[Pose], camera: &Camera) -> RenderedImage {
    let camera = Camera { mount: CameraMount::Hand, ..camera.clone() };
    let view = FrameView { hand_w: Some(Pose::identity()), ..cube_view(rigid) };
    Renderer::default().render(scene, &view, &camera).expect("an image")
}

/// Mean difference of two rows of bytes.
fn difference(a: &[f64], b: &[u8]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - f64::from(*b)).abs()).sum::<f64>() / b.len() as f64
}

#[test]
fn images_of_colours_or_of_segmentation_alone_are_those_of_whole_images() {
    let (objects, fixed) = still_life();
    let scene = scene(objects);
    let rigid = [Pose::translation(-0.05, -0.1, 0.05)];
    // The last camera sees a part of the floor beyond its greatest distance.
    let moving = Camera { mount: CameraMount::Hand, ..fixed.clone() };
    let short = Camera { far_m: 0.95, ..moving.clone() };
    for camera in [&fixed, &moving, &short] {
        let view = FrameView { hand_w: Some(Pose::identity()), ..cube_view(&rigid) };
        // Renderers that have drawn another kind of image before, and fresh ones.
        let mut used = Renderer::default();
        for _ in 0..2 {
            let rgb = used.render_channels(&scene, &view, camera, Channels::Colours).expect("colours");
            let segmentation =
                used.render_channels(&scene, &view, camera, Channels::Centres).expect("segmentation");
            let whole = used.render(&scene, &view, camera).expect("an image");
            let alone = Renderer::default().render(&scene, &view, camera).expect("an image");
            assert_eq!(whole, alone);
            assert!(rgb.depth.is_empty() && rgb.segmentation.is_empty() && segmentation.rgb.is_empty());
            assert_eq!(rgb.rgb, whole.rgb);
            assert_eq!(segmentation.segmentation, whole.segmentation);
            assert_eq!(segmentation.depth, whole.depth);
        }
    }
}

#[test]
fn a_cached_background_does_not_change_the_image() {
    let (objects, camera) = still_life();
    let scene = scene(objects);
    let mut cached = Renderer::default();
    for height in [0.05, 0.2] {
        let rigid = [Pose::translation(-0.1, -0.1, height)];
        let a = cached.render(&scene, &cube_view(&rigid), &camera).expect("an image");
        let b = draw_uncached(&scene, &rigid, &camera);
        let once =
            Renderer::without_backgrounds().render(&scene, &cube_view(&rigid), &camera).expect("an image");
        assert!(once == a, "an image whose background is not kept has the same bytes");
        assert_eq!(a.segmentation, b.segmentation);
        assert_eq!(a.depth, b.depth);
        let mean = difference(&a.rgb.iter().map(|v| f64::from(*v)).collect::<Vec<_>>(), &b.rgb);
        assert!(mean < 0.05, "mean difference {mean} of 255");
    }
}

/// Mean over the area of each pixel of a smaller square image.
fn box_resized(rgb: &[u8], from: usize, to: usize) -> Vec<f64> {
    let scale = from as f64 / to as f64;
    let cover = |i: usize| {
        let (low, high) = (i as f64 * scale, (i + 1) as f64 * scale);
        (low as usize..(high.ceil() as usize).min(from))
            .map(move |k| (k, (high.min(k as f64 + 1.0) - low.max(k as f64)) / scale))
    };
    let mut out = Vec::with_capacity(3 * to * to);
    for y in 0..to {
        for x in 0..to {
            for c in 0..3 {
                let pixel = |(j, b): (usize, f64)| {
                    cover(x).map(|(i, a)| a * b * f64::from(rgb[3 * (j * from + i) + c])).sum::<f64>()
                };
                out.push(cover(y).map(pixel).sum());
            }
        }
    }
    out
}

#[test]
fn a_small_image_is_a_large_one_scaled_down() {
    let (objects, camera) = still_life();
    let scene = scene(objects);
    let rigid = [Pose::translation(-0.1, -0.1, 0.05)];
    let small = draw_uncached(&scene, &rigid, &camera);
    for edge in [512, 1024] {
        let camera = camera.clone().with_edge(edge);
        let large = draw_uncached(&scene, &rigid, &camera);
        let mean = difference(&box_resized(&large.rgb, edge, 224), &small.rgb);
        assert!(mean < 2.0, "{edge}: mean difference {mean} of 255");
    }
}

#[test]
fn objects_at_rest_look_as_moving_ones_do() {
    let (objects, camera) = still_life();
    let moving = scene(objects.clone());
    let at = |x: f64| [Pose::translation(x - 0.05, -0.1, 0.05)];
    let rest = RestState { rigid: at(0.0).to_vec(), ..RestState::default() };
    let resting =
        RenderScene::with_rest(objects, Lighting::default(), rest).expect("the default light is good");
    let (mut of_moving, mut of_resting) = (Renderer::default(), Renderer::default());
    let mut draw = |x: f64| {
        let rigid = at(x);
        let view = cube_view(&rigid);
        let expected = of_moving.render(&moving, &view, &camera).expect("an image");
        let image = of_resting.render(&resting, &view, &camera).expect("an image");
        assert_eq!(image.segmentation, expected.segmentation, "{x}");
        let mut depths = image.depth.iter().zip(&expected.depth);
        assert!(depths.all(|(a, b)| a == b || (a - b).abs() < 2e-6), "{x}");
        let expected: Vec<f64> = expected.rgb.iter().map(|&c| c.into()).collect();
        let difference = difference(&expected, &image.rgb);
        assert!(difference < 0.02, "{x}: {difference}");
        // The image does not depend on earlier ones.
        assert_eq!(Renderer::default().render(&resting, &view, &camera).expect("an image"), image, "{x}");
        image
    };
    let [still, rounded, moved, back] = [0.0, 5e-7, 0.02, 0.0].map(&mut draw);
    assert!(still == rounded && still == back && still.rgb != moved.rgb);
    // Hidden objects leave no shadow, whether they rest or not.
    let rigid = at(0.0);
    let hidden = FrameView { hidden_id: 3, ..cube_view(&rigid) };
    let [expected, image] = [(of_moving, &moving), (of_resting, &resting)]
        .map(|(mut renderer, scene)| renderer.render(scene, &hidden, &camera).expect("an image"));
    assert_eq!(image, expected);
}

#[test]
fn images_are_byte_identical_on_every_thread() {
    let (objects, camera) = still_life();
    let scene = scene(objects);
    let rigid = [Pose::translation(-0.1, -0.1, 0.05)];
    let shoot = || Renderer::default().render(&scene, &cube_view(&rigid), &camera).expect("an image");
    let here = shoot();
    std::thread::scope(|scope| {
        let there: Vec<_> = (0..3).map(|_| scope.spawn(shoot)).collect();
        there.into_iter().for_each(|t| assert_eq!(t.join().expect("no panic"), here));
    });
}

#[test]
fn a_shadow_lies_opposite_the_light() {
    let lighting = Lighting { shadow_centre_w: Vec3::zeros(), ..Lighting::default() };
    let camera = above(1.2);
    let with_ball = |height: Option<f64>| {
        let mut objects = vec![ground(Visual::default())];
        objects.extend(height.map(|h| ball(2, 0.04, Pose::translation(0.0, 0.0, h))));
        let scene = RenderScene::new(objects, lighting.clone()).expect("a scene");
        draw(&scene, &camera)
    };
    let (bare, shaded) = (with_ball(None), with_ball(Some(0.25)));
    let direction = lighting.key.direction_w;
    let foot = -direction * (0.25 / direction.z);
    let (mut weight, mut centre) = (0.0, [0.0; 2]);
    // The ball itself covers 12 pixels around the centre.
    let is_outside_ball = |i: &usize| (i % 224).abs_diff(112).max((i / 224).abs_diff(112)) > 16;
    for i in (0..224 * 224).filter(is_outside_ball) {
        let dark = f64::from(bare.rgb[3 * i]) - f64::from(shaded.rgb[3 * i]);
        let scale = 1.2 / focal(&camera);
        weight += dark;
        centre[0] += dark * ((i % 224) as f64 + 0.5 - 112.0) * scale;
        centre[1] -= dark * ((i / 224) as f64 + 0.5 - 112.0) * scale;
    }
    assert!(weight > 1000.0, "no shadow");
    let error = (centre[0] / weight - foot.x).hypot(centre[1] / weight - foot.y);
    assert!(error < 5e-3, "the shadow is off by {error} m");
}

/// An object as rigid body 0, whose shadow its coarsest level of detail casts.
fn lone(mesh: RenderMesh, casts_shadow: bool) -> Vec<RenderObject> {
    vec![RenderObject { casts_shadow, ..object(1, mesh, rigid(0), Pose::identity()) }]
}

#[test]
fn smooth_surfaces_do_not_shade_themselves_where_they_face_the_light() {
    let visuals = [Visual::plain([0.8; 3], 0.6, 0.0)];
    let solid = |shape: Shape| {
        RenderMesh::from_solids("solid", &[RenderSolid::new(shape, 3e-3, 0)], &visuals).expect("a solid")
    };
    let shape = |shape: &Shape| mesh(shape, visuals[0].clone());
    let tube = Shape::Cylinder { radius: 0.06, half_height: 0.15 };
    let ball = Shape::Sphere { radius: 0.1 };
    let slab = Shape::Box { half: Vec3::new(0.2, 0.2, 0.02) };
    let meshes = [solid(tube.clone()), solid(ball.clone()), shape(&tube), shape(&ball), shape(&slab)];
    let camera = camera(Vec3::new(0.8, 0.1, 0.5), Vec3::zeros(), Vec3::z());
    for direction in [[0.45, -0.55, 1.0], [0.1, -1.0, 0.06], [1.0, 0.02, 0.03], [0.0, 0.05, 1.0]] {
        let mut lighting = Lighting { shadow_centre_w: Vec3::zeros(), ..Lighting::default() };
        lighting.key.direction_w = direction.into();
        for (i, mesh) in meshes.iter().enumerate() {
            let draw = |casts_shadow: bool| {
                let scene =
                    RenderScene::new(lone(mesh.clone(), casts_shadow), lighting.clone()).expect("a scene");
                draw_uncached(&scene, &[Pose::identity()], &camera)
            };
            let (with, without) = (draw(true), draw(false));
            let apart = with.rgb.iter().zip(&without.rgb).map(|(a, b)| a.abs_diff(*b));
            let worst = apart.max().expect("pixels");
            assert!(worst <= 2, "mesh {i}, light {direction:?}: darker by {worst} of 255");
        }
    }
}

#[test]
fn a_penumbra_is_monotonic_and_centred_on_the_projected_edge() {
    let mut lighting = Lighting { shadow_centre_w: Vec3::zeros(), ..Lighting::default() };
    lighting.key.direction_w = Vec3::new(0.3, 0.4, 1.0);
    let mut map = ShadowMap::new(&lighting);
    let half = Vec3::new(0.05, 0.08, 0.06);
    let cube = box_mesh(&half);
    let turn = Quat::from_axis_angle(&Vec3::z_axis(), 0.3);
    let corners: Vec<V3> = cube.vertices.iter().map(|v| (turn * v + Vec3::z() * half.z).cast()).collect();
    map.draw(std::iter::once((corners.as_slice(), cube.triangles.as_slice())));
    let light = |p: [Vec3; 8]| {
        let at = std::array::from_fn(|axis| p.map(|p| p[axis] as f32));
        let n = Vec3x8::splat(&V3::z());
        map.visibility(&map.project(Vec3x8::from_arrays(&at)), &n, f32x8::ONE.simd_gt(f32x8::ZERO)).to_array()
    };
    // Across the shadow of the far upper edge, which is projected along the light.
    let across = turn * -Vec3::y();
    let edge = turn * Vec3::new(0.0, -half.y, 0.0) - lighting.key.direction_w * (2.0 * half.z);
    let edge = Vec3::new(edge.x, edge.y, 0.0);
    for along in [-0.02, -0.004, 0.01] {
        for step in [2e-4, 9e-4, 2e-3] {
            let count = (0.05 / step) as usize / 8 * 8;
            let from = -0.5 * step * count as f64;
            let place = |i: usize| edge + across * (from + step * i as f64) + turn * Vec3::x() * along;
            let shares: Vec<f32> = (0..count)
                .step_by(8)
                .flat_map(|first| light(std::array::from_fn(|lane| place(first + lane))))
                .collect();
            let [dark, .., bright] = shares[..] else { panic!("many points") };
            assert!(dark == 0.0 && bright == 1.0, "{along} {step}: from {dark} to {bright}");
            let worst = shares.windows(2).map(|w| w[0] - w[1]).fold(0.0, f32::max);
            assert!(worst < 0.02, "{along} {step}: darker by {worst} on the way out: {shares:?}");
            let middle = from + step * shares.iter().filter(|share| **share < 0.5).count() as f64;
            assert!(middle.abs() < 2.5e-3, "{along} {step}: the border is off by {middle} m");
        }
    }
}

/// The red channel at the pixel that shows a point of the world.
fn red(image: &RenderedImage, camera: &Camera, p: Vec3) -> i32 {
    let view = camera.pose.inverse_transform_point(&p.into()).coords;
    let pixel = |along: f64| (112.0 + focal(camera) * along / -view.z) as usize;
    i32::from(image.rgb[3 * (224 * pixel(-view.y) + pixel(view.x))])
}

#[test]
fn fixed_objects_cast_shadows_outside_the_fine_shadow_map() {
    // Light along −x, 45° downwards; a wall 1 m high at x = 3, and a roof 2 m wide above the origin.
    let mut lighting = Lighting { shadow_centre_w: Vec3::zeros(), ..Lighting::default() };
    (lighting.key.direction_w, lighting.key.softness_rad) = (Vec3::new(1.0, 0.0, 1.0), 0.01);
    let slab = |half: Vec3, at: Vec3| {
        object(
            1,
            mesh(&Shape::Box { half }, Visual::default()),
            BodyId::World,
            Pose::from_parts(at.into(), Quat::identity()),
        )
    };
    let floor = slab(Vec3::new(6.0, 3.0, 0.05), Vec3::new(0.0, 0.0, -0.05));
    let wall = slab(Vec3::new(0.02, 1.5, 0.5), Vec3::new(3.02, 0.0, 0.5));
    let roof = slab(Vec3::new(1.0, 1.0, 0.02), Vec3::new(0.0, 0.0, 2.0));
    let scene = RenderScene::new(vec![floor, wall, roof], lighting).expect("a scene");
    // From the side, below the roof, whose shadow is shifted by 2 m towards −x.
    let camera = camera(Vec3::new(0.0, -6.0, 1.5), Vec3::new(0.0, 0.0, 0.5), Vec3::z());
    let camera = Camera { fovy_rad: 1.2, ..camera };
    let image = draw(&scene, &camera);
    let at = |x: f64| red(&image, &camera, Vec3::new(x, 0.0, 0.0));
    let (open, behind_wall, under_roof) = (at(0.0), [at(2.9), at(2.3)], [at(-1.2), at(-2.0), at(-2.8)]);
    assert!(
        behind_wall.iter().chain(&under_roof).all(|dark| open - dark > 40),
        "{open} {behind_wall:?} {under_roof:?}"
    );
    for x in [1.5, -0.8, -3.3] {
        assert!((at(x) - open).abs() < 12, "the floor at x = {x} shows {}, not {open}", at(x));
    }
}

#[test]
fn image_right_of_the_third_person_camera_is_world_positive_y() {
    let floor = camera(Vec3::new(0.8966, 0.0, 0.65), Vec3::zeros(), Vec3::z());
    for camera in [Camera::third_person_table(), floor] {
        let at = |object, y| ball(object, 0.03, Pose::translation(0.0, y, 0.03));
        let image = draw(&scene(vec![at(1, -0.2), at(2, 0.2)]), &camera);
        let column = |object| image.segmentation.iter().position(|&s| s == object).expect("in sight") % 224;
        assert!(column(1) < 112 && column(2) > 112);
    }
}

#[test]
fn invalid_cameras_are_rejected_with_the_name_of_the_field() {
    let scene = scene(vec![ball(1, 0.1, Pose::identity())]);
    let good = above(1.0);
    let nowhere = Pose::translation(f64::NAN, 0.0, 0.0);
    let fovy = "fovy: expected 0.01 to 2.8 rad (0.6° to 160°), got ";
    for (camera, words) in [
        (Camera { width: 0, ..good.clone() }, "width: expected 1 to 4096 pixels, got 0"),
        (Camera { height: 100_000, ..good.clone() }, "height: expected 1 to 4096 pixels, got 100000"),
        (Camera { fovy_rad: 3.2, ..good.clone() }, fovy),
        (Camera { fovy_rad: f64::NAN, ..good.clone() }, fovy),
        (Camera { near_m: 0.0, ..good.clone() }, "near: expected at least 0.0001 m, got 0 m"),
        (Camera { far_m: 0.01, ..good.clone() }, "far: expected more than near (0.05 m), got 0.01 m"),
        (Camera { pose: nowhere, ..good.clone() }, "position: expected metres within ±1e6"),
        (Camera { mount: CameraMount::Hand, ..good.clone() }, "mount: expected a hand in the state"),
    ] {
        let error = Renderer::default().render(&scene, &FrameView::default(), &camera).expect_err(words);
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn a_camera_inside_an_object_reports_it_and_sees_through_it() {
    let marked = |ball: RenderObject| vec![ground(checker(0.1)), ball];
    let (here, away) = (Pose::translation(0.0, 0.0, 1.0), Pose::translation(9.0, 0.0, 1.0));
    let within = draw(&scene(marked(ball(2, 0.1, here))), &above(1.0));
    assert_eq!(within.inside.as_deref(), Some("object 2"));
    let without = draw(&scene(marked(ball(2, 0.1, away))), &above(1.0));
    assert_eq!(without.inside, None);
    assert_eq!((&within.depth, &within.segmentation), (&without.depth, &without.segmentation));
    assert!(within.rgb.iter().any(|c| *c > 60), "the image is black");
}

#[test]
fn cameras_are_validated_one_by_one_and_together() {
    let named = |name: &str, edge: usize| Camera { name: name.to_owned(), ..above(1.0).with_edge(edge) };
    assert!(check_cameras(&[named("a", 4096)]).is_ok());
    let (index, error) = check_cameras(&[named("a", 4096), named("b", 1)]).expect_err("too many pixels");
    assert_eq!(index, 1);
    assert!(
        error.to_string().starts_with("camera b: width and height: expected at most 16777216 pixels"),
        "{error}"
    );
    let many: Vec<Camera> = (0..65).map(|i| named(&i.to_string(), 1)).collect();
    let (_, error) = check_cameras(&many).expect_err("too many");
    assert!(error.to_string().contains("at most 64 cameras"), "{error}");
}

#[test]
fn invalid_meshes_states_and_lights_are_rejected() {
    let visuals = [Visual::default()];
    let empty =
        RenderMesh::from_mesh("egg", &Mesh::default(), &visuals, &DiskCache::DISABLED).expect_err("empty");
    assert!(empty.to_string().starts_with("egg cannot be drawn: the mesh is empty"), "{empty}");
    let painted = Shape::Sphere { radius: 0.1 }.painted(3, None);
    let unknown =
        RenderMesh::from_shape("egg", &painted, &visuals, &DiskCache::DISABLED).expect_err("no such visual");
    assert!(unknown.to_string().contains("material 3 has no visual; there are 1"), "{unknown}");
    let lost = scene(vec![RenderObject { body: rigid(4), ..ball(1, 0.1, Pose::identity()) }]);
    let error = Renderer::default().render(&lost, &FrameView::default(), &above(1.0)).expect_err("lost");
    assert!(error.to_string().contains("the state has no rigid body 4"), "{error}");
    let mut light = Lighting::default();
    light.key.direction_w = Vec3::zeros();
    let dark = RenderScene::new(Vec::new(), light).expect_err("no direction");
    assert!(dark.to_string().starts_with("light: direction: expected a direction"), "{dark}");
}

#[test]
fn a_mesh_shows_the_image_of_its_file_where_its_texture_coordinates_have_it() {
    // Seen from above, the left half of the image is red and the right half green.
    let size = 0.2;
    let mut mesh = box_mesh(&Vec3::repeat(0.5 * size));
    let uv = |v: u32| {
        let p = mesh.vertices[v as usize] / size;
        [p.x + 0.5, p.y + 0.5]
    };
    mesh.uvs = mesh.triangles.iter().map(|t| t.map(uv)).collect();
    let shape = Shape::from_mesh(mesh).expect("a cube").translated(Vec3::new(0.0, 0.0, 0.1));
    let Some(found) = shape.mesh_point(&Vec3::new(0.0, 0.0, 0.2)) else { panic!("a mesh") };
    assert!(found.uv.is_some_and(|uv| (uv[0] - 0.5).abs() < 1e-9) && (found.uv_per_m - 5.0).abs() < 1e-6);
    let Shape::Placed { shape: inner, .. } = &shape else { panic!("{shape:?}") };
    let Shape::Mesh(solid) = &**inner else { panic!("{inner:?}") };
    let pixels: Vec<u8> = (0..64).flat_map(|x| if x < 32 { [200, 20, 20] } else { [20, 200, 20] }).collect();
    let image = Some(Arc::new(SurfaceImage::new(64, &pixels.repeat(64))));
    let mesh = ColouredMesh {
        solid: solid.clone(),
        material_ids: vec![0; 12].into(),
        materials: vec![MeshMaterial { albedo: [1.0; 3], image }].into(),
    };
    let colours = MeshColours { shape: Arc::new(shape.clone()), meshes: vec![mesh] };
    let visual = Visual { colours: Some(colours), ..Visual::plain([1.0; 3], 1.0, 0.0) };
    let mesh = RenderMesh::from_shape("cube", &shape, &[visual], &DiskCache::DISABLED).expect("a cube");
    let camera = above(1.0);
    let image = draw(&scene(vec![object(1, mesh, BodyId::World, Pose::identity())]), &camera);
    let (centre, aside) = (camera.width / 2, (0.05 * focal(&camera) / 0.8) as usize);
    let pixel = |x: usize| {
        let at = 3 * (camera.height / 2 * camera.width + x);
        [0, 1, 2].map(|c| i32::from(image.rgb[at + c]))
    };
    let ([left_r, left_g, _], [right_r, right_g, _]) = (pixel(centre - aside), pixel(centre + aside));
    assert!(
        left_r > left_g + 60 && right_g > right_r + 60,
        "{:?} {:?}",
        pixel(centre - aside),
        pixel(centre + aside)
    );
}
