//! Compares images with a pinhole camera in closed form.

use std::sync::Arc;

use softvt::{
    disk_cache::DiskCache,
    geometry::{Pose, Quat, Vec3, shape::Shape},
    physics::BodyId,
    scene::{Camera, Lighting, Mask, Visual, VisualLayer},
    sensing::camera::{FrameView, RenderMesh, RenderObject, RenderScene, RenderedImage, Renderer},
};

/// Edge of the images, pixels.
const EDGE: usize = 224;

fn object(id: u16, shape: &Shape, visual: Visual, pose: Pose) -> RenderObject {
    let mesh = RenderMesh::from_shape("object", shape, &[visual], &DiskCache::DISABLED).expect("a surface");
    RenderObject {
        name: format!("object {id}"),
        segmentation_id: id,
        mesh: Arc::new(mesh),
        body: BodyId::World,
        pose_in_body: pose,
        casts_shadow: false,
    }
}

/// A floor whose top is at z = 0, object 1.
fn ground(visual: Visual) -> RenderObject {
    let half = Vec3::new(1.0, 1.0, 0.1);
    object(1, &Shape::Box { half }, visual, Pose::translation(0.0, 0.0, -0.1))
}

/// A camera at `eye` that looks at `target`; image up is as near to `up` as can be.
fn camera(eye: Vec3, target: Vec3, up: Vec3) -> Camera {
    let turn = Quat::face_towards(&(eye - target), &up);
    Camera { pose: Pose::from_parts(eye.into(), turn), ..Camera::third_person_table() }
}

fn above() -> Camera {
    camera(Vec3::z(), Vec3::zeros(), Vec3::y())
}

fn draw(objects: Vec<RenderObject>, camera: &Camera) -> RenderedImage {
    let scene = RenderScene::new(objects, Lighting::default()).expect("the default light is good");
    Renderer::default().render(&scene, &FrameView::default(), camera).expect("an image")
}

/// Focal length, pixels.
fn focal(camera: &Camera) -> f64 {
    0.5 * camera.height as f64 / (0.5 * camera.fovy_rad).tan()
}

/// A ball of 0.2 m seen from 1 m: errors of the radius and of the centre of its silhouette, pixels.
pub fn silhouette() -> [f64; 2] {
    let (camera, radius) = (above(), 0.2);
    let ball = object(7, &Shape::Sphere { radius }, Visual::default(), Pose::identity());
    let image = draw(vec![ball], &camera);
    let inside: Vec<usize> = (0..EDGE * EDGE).filter(|&i| image.segmentation[i] == 7).collect();
    let area = inside.len() as f64;
    let mean = |of: &dyn Fn(usize) -> usize| inside.iter().map(|&i| of(i) as f64 + 0.5).sum::<f64>() / area;
    let expected = focal(&camera) * radius / (1.0 - radius * radius).sqrt();
    let middle = 0.5 * EDGE as f64;
    let centre = (mean(&|i| i % EDGE) - middle).abs().max((mean(&|i| i / EDGE) - middle).abs());
    [((area / std::f64::consts::PI).sqrt() - expected).abs(), centre]
}

fn linear(byte: u8) -> f64 {
    let x = f64::from(byte) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Position of the ideal step from the first to the last value that has the same sum, pixels.
fn step(values: &[f64]) -> f64 {
    let (first, last) = (values[0], values[values.len() - 1]);
    values.iter().map(|v| (v - last) / (first - last)).sum()
}

/// Corners of a checkerboard of 0.1 m seen from 1 m: their errors, pixels.
pub fn corners() -> Vec<f64> {
    let layer = VisualLayer {
        mask: Mask::Checker { size_m: 0.1 },
        albedo: [0.5; 3],
        roughness: 1.0,
        opacity: 1.0,
        relief_m: 0.0,
    };
    let camera = above();
    let image = draw(vec![ground(Visual::plain([0.1; 3], 1.0, 0.0).with(layer))], &camera);
    let value = |x: usize, y: usize| linear(image.rgb[3 * (y * EDGE + x)]);
    let square = 0.1 * focal(&camera);
    let error = |corner: [i32; 2]| {
        let [ex, ey] = corner.map(|c| 0.5 * EDGE as f64 + square * f64::from(c));
        let reach = (0.4 * square) as usize;
        let (cx, cy, off) = (ex as usize, ey as usize, (0.5 * square) as usize);
        let row: Vec<f64> = (cx - reach..cx + reach).map(|x| value(x, cy - off)).collect();
        let column: Vec<f64> = (cy - reach..cy + reach).map(|y| value(cx - off, y)).collect();
        let found = [(cx - reach) as f64 + step(&row), (cy - reach) as f64 + step(&column)];
        (found[0] - ex).abs().max((found[1] - ey).abs())
    };
    [[-2, -1], [0, 0], [1, 2], [2, -2]].map(error).into()
}

/// A plane that passes behind the camera: the largest error of its depth up to 1 m, m.
pub fn depth() -> f64 {
    let eye = Vec3::new(0.0, -0.3, 0.25);
    let camera = Camera { fovy_rad: 1.8, ..camera(eye, Vec3::new(0.0, 0.1, 0.0), Vec3::z()) };
    let image = draw(vec![ground(Visual::default())], &camera);
    let (mut checked, mut worst) = (0, 0.0_f64);
    for i in 0..EDGE * EDGE {
        let slope = |at: usize| (at as f64 + 0.5 - 0.5 * EDGE as f64) / focal(&camera);
        let ray = camera.pose.rotation * Vec3::new(slope(i % EDGE), -slope(i / EDGE), -1.0);
        let depth = -eye.z / ray.z;
        let hit = eye + ray * depth;
        if depth > 0.0 && depth < 1.0 && hit.x.abs().max(hit.y.abs()) < 0.98 {
            assert_eq!(image.segmentation[i], 1, "pixel {i} shows no ground");
            worst = worst.max((f64::from(image.depth[i]) - depth).abs());
            checked += 1;
        }
    }
    assert!(checked > 10_000, "{checked} pixels of ground");
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_has_the_silhouette_of_the_pinhole_to_a_tenth_of_a_pixel() {
        assert!(silhouette().iter().all(|error| *error < 0.1), "{:?}", silhouette());
    }

    #[test]
    fn checkerboard_corners_lie_where_the_pinhole_puts_them_to_a_tenth_of_a_pixel() {
        assert!(corners().iter().all(|error| *error < 0.1), "{:?}", corners());
    }

    #[test]
    fn depth_is_that_of_the_plane_to_a_tenth_of_a_millimetre_also_where_it_passes_behind_the_camera() {
        assert!(depth() < 1e-4, "{:e}", depth());
    }
}
