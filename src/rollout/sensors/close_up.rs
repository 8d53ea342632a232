//! Close-up pictures of one object for videos and reports; never an input of a policy.

use image::RgbImage;
use nalgebra::Point3;

use super::{SensingError, Sensors};
use crate::simulation::ObjectInstance;
use softvt_evaluation::deformation::ReferenceShape;
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_physics::{
    BodyId,
    fem::strain::node_strains,
    world::{ContactPatch, WorldSnapshot},
};
use softvt_scene::{Body, Camera, CameraMount, ROBOT_SEGMENTATION_ID};
use softvt_sensing::camera::{Channels, FrameView, RenderedImage};

#[derive(Clone, Copy, Debug)]
pub struct CloseUp<'a> {
    /// Width and height, pixels.
    pub edge: usize,
    /// The settled state, whose shape is outlined.
    pub settled: &'a WorldSnapshot,
}

/// Colours and opacities of what is drawn over a close-up, sRGB.
const ROBOT: Overlay = Overlay { colour: [150, 150, 156], opacity: 0.4 };
const ROBOT_OUTLINE: Overlay = Overlay { colour: [105, 105, 112], opacity: 0.6 };
const PATCH_OUTLINE: Overlay = Overlay { colour: [25, 25, 28], opacity: 0.9 };
const SETTLED_OUTLINE: Overlay = Overlay { colour: [72, 72, 78], opacity: 1.0 };

/// Distance from which a close-up sees what is not cut, m.
const WHOLE_NEAR: f64 = 0.01;
/// Step of depth between neighbouring pixels from which the robot has an edge there, m.
const DEPTH_EDGE: f32 = 8e-3;
/// Depth behind what a pixel shows up to which a contact point is visible, m: pads sink into what they hold.
const PATCH_DEPTH: f32 = 4e-3;

impl Sensors {
    /// Renders a close-up of the object `index` as people see best how it deforms: the skin of soft bodies coloured by
    /// their strain over the stable strain of their material, the robot translucent, the contact patches of the pads
    /// outlined in black, and the settled shape, from which D is measured, in grey.
    pub fn close_up(
        &mut self,
        frame: &WorldSnapshot,
        index: usize,
        CloseUp { edge, settled }: CloseUp,
    ) -> Result<RgbImage, SensingError> {
        let colours = |(body, x): (usize, &Vec<Vec3>)| {
            self.strain_ratios(body, x).into_iter().map(strain_colour).collect()
        };
        let colours: Vec<Vec<[f32; 3]>> = frame.nodes.iter().enumerate().map(colours).collect();
        let camera = self.near_camera(frame, index, edge, CLOSE_UP_DISTANCE);
        let mut image = self.without_robot(frame, &colours, &camera)?;
        // The robot is drawn whole where nothing is before it, and cut like the rest behind what was left out.
        let whole_camera = Camera { near_m: WHOLE_NEAR, ..camera.clone() };
        let whole = self.segmentation(frame, &whole_camera, 0)?;
        let cut = self.segmentation(frame, &camera, 0)?;
        let is_whole = |pixel: usize| whole.segmentation[pixel] == ROBOT_SEGMENTATION_ID;
        let is_robot =
            Mask::new(edge, |pixel| is_whole(pixel) || cut.segmentation[pixel] == ROBOT_SEGMENTATION_ID);
        let depth = |pixel: usize| if is_whole(pixel) { whole.depth[pixel] } else { cut.depth[pixel] };
        let has_edge = |a: usize, b: usize| (depth(a) - depth(b)).abs() > DEPTH_EDGE;
        let robot_edges = is_robot.outline(|a, b| is_robot.0[a] && is_robot.0[b] && has_edge(a, b));
        ROBOT.draw(&mut image.rgb, &is_robot);
        ROBOT_OUTLINE.draw(&mut image.rgb, &robot_edges);
        for (patch, pad_w) in frame.patches.iter().zip(self.pads_w(frame)) {
            PATCH_OUTLINE.draw(
                &mut image.rgb,
                &patch_mask(patch, &pad_w, &camera, &image.depth).outline(|_, _| false),
            );
        }
        if let Some(aligned) = self.aligned(frame, index, settled) {
            let seen = self.segmentation(&aligned, &camera, ROBOT_SEGMENTATION_ID)?;
            let own = index as u16 + 1;
            let is_settled = Mask::new(edge, |pixel| seen.segmentation[pixel] == own);
            SETTLED_OUTLINE.draw(&mut image.rgb, &is_settled.outline(|_, _| false));
        }
        Ok(image.into_rgb_image())
    }

    /// Renders the object `index` from nearby as it looks, without the robot.
    pub fn portrait(
        &mut self,
        frame: &WorldSnapshot,
        index: usize,
        edge: usize,
    ) -> Result<RgbImage, SensingError> {
        let camera = self.near_camera(frame, index, edge, PORTRAIT_DISTANCE);
        Ok(self.without_robot(frame, &[], &camera)?.into_rgb_image())
    }

    /// A camera that looks at an object from a distance in diagonals of its bounds, and does not see what is between,
    /// such as the wall of a basket.
    fn near_camera(&self, frame: &WorldSnapshot, index: usize, edge: usize, distance: f64) -> Camera {
        let object = &self.objects[index];
        let near_m = (distance - FOREGROUND) * object.bounds.size().norm();
        Camera { near_m, ..close_up_camera(object, frame, edge, distance) }
    }

    /// Renders what a camera with the hand at the world's origin sees, with colours at the nodes of soft bodies,
    /// if there are any.
    fn without_robot(
        &mut self,
        frame: &WorldSnapshot,
        colours: &[Vec<[f32; 3]>],
        camera: &Camera,
    ) -> Result<RenderedImage, SensingError> {
        let render_scene = self.built_scene()?;
        let view = FrameView {
            node_colours: colours,
            hidden_id: ROBOT_SEGMENTATION_ID,
            hand_w: Some(Pose::identity()),
            ..self.view(frame)
        };
        Ok(self.close_up_renderer.render(&render_scene, &view, camera)?)
    }

    /// Depth and segmentation of a close-up without what has the segmentation id `hidden_id`, if that is not 0.
    fn segmentation(
        &mut self,
        frame: &WorldSnapshot,
        camera: &Camera,
        hidden_id: u16,
    ) -> Result<RenderedImage, SensingError> {
        let render_scene = self.built_scene()?;
        let view = FrameView { hidden_id, hand_w: Some(Pose::identity()), ..self.view(frame) };
        Ok(self.close_up_renderer.render_channels(&render_scene, &view, camera, Channels::Centres)?)
    }

    /// The state `frame` with the soft object `index` in its settled shape, moved rigidly to where the object is now.
    /// `None` for other objects, and where no rigid motion can be found.
    fn aligned(&self, frame: &WorldSnapshot, index: usize, settled: &WorldSnapshot) -> Option<WorldSnapshot> {
        let BodyId::Soft(id) = self.objects[index].body else { return None };
        let (now, rest) = (frame.soft(id), settled.soft(id));
        let reference = ReferenceShape::new(rest, &vec![1.0; rest.len()]).ok()?;
        let rotation = reference.measure(now).ok()?.rotation;
        let mean = |nodes: &[Vec3]| nodes.iter().sum::<Vec3>() / nodes.len() as f64;
        let (from, to) = (mean(rest), mean(now));
        let mut aligned = frame.clone();
        aligned.nodes[id.index()] = rest.iter().map(|x| to + rotation * (x - from)).collect();
        Some(aligned)
    }

    /// Strain at the nodes of a soft body, at the positions `x`, over the stable strain of its material: above 1 the
    /// material has collapsed. Empty without a stable strain.
    pub fn strain_ratios(&self, body: usize, x: &[Vec3]) -> Vec<f64> {
        let is_body =
            |object: &&ObjectInstance| matches!(object.body, BodyId::Soft(id) if id.index() == body);
        let Some(object) = self.objects.iter().find(is_body) else { return Vec::new() };
        let (Some(model), Body::Soft(material)) = (&object.model, &object.asset.body) else {
            return Vec::new();
        };
        let Some(stable) = material.stable_strain() else { return Vec::new() };
        node_strains(model, x).into_iter().map(|strain| strain / stable).collect()
    }
}

/// A set of pixels of a square image, row by row.
struct Mask(Vec<bool>);

impl Mask {
    fn new(edge: usize, is_set: impl Fn(usize) -> bool) -> Self {
        Self((0..edge * edge).map(is_set).collect())
    }

    /// The pixels on both sides of the border of the set, and of the edges that `has_edge` says
    /// are between two neighbours.
    fn outline(&self, has_edge: impl Fn(usize, usize) -> bool) -> Self {
        let edge = self.0.len().isqrt();
        let mut outline = vec![false; self.0.len()];
        let mut join = |a: usize, b: usize| {
            if self.0[a] != self.0[b] || has_edge(a, b) {
                (outline[a], outline[b]) = (true, true);
            }
        };
        for y in 0..edge {
            for x in 0..edge {
                let pixel = y * edge + x;
                if x + 1 < edge {
                    join(pixel, pixel + 1);
                }
                if y + 1 < edge {
                    join(pixel, pixel + edge);
                }
            }
        }
        Self(outline)
    }
}

/// A colour drawn over an image, sRGB, and its opacity.
struct Overlay {
    colour: [u8; 3],
    opacity: f32,
}

impl Overlay {
    fn draw(&self, rgb: &mut [u8], mask: &Mask) {
        let pixels = rgb.as_chunks_mut::<3>().0.iter_mut().zip(&mask.0);
        for (pixel, _) in pixels.filter(|(_, is_set)| **is_set) {
            for (value, own) in pixel.iter_mut().zip(self.colour) {
                let (under, over) = (f32::from(*value), f32::from(own));
                *value = (under + (over - under) * self.opacity).round() as u8;
            }
        }
    }
}

/// The pixels of a contact patch that are not behind what the image shows.
fn patch_mask(patch: &ContactPatch, pad_w: &Pose, camera: &Camera, depth: &[f32]) -> Mask {
    let edge = camera.width;
    let mut mask = Mask::new(edge, |_| false);
    let focal = 0.5 * edge as f64 / (0.5 * camera.fovy_rad).tan();
    for point in &patch.points {
        let p = camera.pose.inverse_transform_point(&(pad_w * Point3::from(point.p_p)));
        // Pads nearer than the camera sees are cut away.
        if -p.z < camera.near_m {
            continue;
        }
        let scale = focal / -p.z;
        let centre = [0.5 * edge as f64 + scale * p.x, 0.5 * edge as f64 - scale * p.y];
        // A disc of the area that the point stands for, a little larger, so that neighbours join.
        let radius = scale * point.area.sqrt() * 0.75;
        let range =
            |at: f64| ((at - radius).max(0.0) as usize)..((at + radius + 1.0).max(0.0) as usize).min(edge);
        for y in range(centre[1]) {
            for x in range(centre[0]) {
                let (dx, dy) = (x as f64 + 0.5 - centre[0], y as f64 + 0.5 - centre[1]);
                let pixel = y * edge + x;
                let is_visible = -p.z < f64::from(depth[pixel] + PATCH_DEPTH);
                mask.0[pixel] |= dx * dx + dy * dy < radius * radius && is_visible;
            }
        }
    }
    mask
}

/// Direction from the object to the camera of a close-up, world.
const CLOSE_UP_FROM: [f64; 3] = [0.8, -0.45, 0.5];
/// Field of view of a close-up, rad, and its distance from the object, in diagonals of its bounds;
/// a portrait is closer.
const CLOSE_UP_FOVY: f64 = 0.5;
const CLOSE_UP_DISTANCE: f64 = 2.6;
const PORTRAIT_DISTANCE: f64 = 1.9;
/// Distance from the object, in diagonals of its bounds, beyond which a cut foreground ends.
const FOREGROUND: f64 = 0.55;

/// A camera that looks at an object from a distance in diagonals of its bounds, always along the same direction.
fn close_up_camera(object: &ObjectInstance, frame: &WorldSnapshot, edge: usize, distance: f64) -> Camera {
    let centre = match object.body {
        BodyId::Soft(id) => frame.soft(id).iter().sum::<Vec3>() / frame.soft(id).len().max(1) as f64,
        BodyId::Rigid(id) => (frame.rigid(id) * Point3::from(object.bounds.centre())).coords,
        BodyId::Link(id) => {
            let object_w = frame.link(id) * object.joint_frame_o().inverse();
            (object_w * Point3::from(object.bounds.centre())).coords
        }
        BodyId::World | BodyId::Kinematic(_) => {
            (object.start_w * Point3::from(object.bounds.centre())).coords
        }
    };
    let away = Vec3::from(CLOSE_UP_FROM).normalize();
    let eye = centre + away * (distance * object.bounds.size().norm());
    let pose = Pose::from_parts(eye.into(), Quat::face_towards(&away, &Vec3::z()));
    Camera {
        name: "close_up".to_owned(),
        // With the hand at the world's origin: a moving camera keeps no background.
        mount: CameraMount::Hand,
        pose,
        fovy_rad: CLOSE_UP_FOVY,
        near_m: WHOLE_NEAR,
        far_m: 10.0,
        width: edge,
        height: edge,
        set_at: None,
    }
}

/// Linear RGB of a strain over the stable strain: pale to orange up to 1, red beyond and nowhere else.
pub fn strain_colour(ratio: f64) -> [f32; 3] {
    const RAMP: [(f64, [f32; 3]); 4] = [
        (0.0, [0.88, 0.85, 0.79]),
        (0.3, [0.88, 0.85, 0.79]),
        (0.65, [0.91, 0.68, 0.16]),
        (1.0, [0.81, 0.28, 0.04]),
    ];
    if ratio > 1.0 {
        return [0.45, 0.02, 0.02];
    }
    let after = RAMP.iter().position(|(at, _)| *at >= ratio).unwrap_or(RAMP.len() - 1).max(1);
    let ((low, from), (high, to)) = (RAMP[after - 1], RAMP[after]);
    let share = ((ratio - low) / (high - low)).clamp(0.0, 1.0) as f32;
    std::array::from_fn(|channel| from[channel] + share * (to[channel] - from[channel]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mask from rows of `#` (set) and other letters.
    fn mask(rows: &[&str]) -> Mask {
        Mask(rows.iter().flat_map(|row| row.bytes().map(|letter| letter == b'#')).collect())
    }

    #[test]
    fn an_outline_has_both_sides_of_a_border_and_no_inner_pixels() {
        let square = mask(&["......", ".####.", ".####.", ".####.", ".####.", "......"]);
        let expected = mask(&[".####.", "######", "##..##", "##..##", "######", ".####."]);
        assert_eq!(square.outline(|_, _| false).0, expected.0);
        assert!(Mask::new(6, |_| true).outline(|_, _| false).0.iter().all(|is_set| !is_set));
        // An edge between the second and the third column of a full mask.
        let full = Mask::new(6, |_| true);
        let edge = full.outline(|a, b| (a % 6 < 2) != (b % 6 < 2));
        assert_eq!(edge.0, mask(&[".##..."; 6]).0);
    }

    #[test]
    fn strain_is_red_only_beyond_the_stable_strain() {
        let [red, green, _] = strain_colour(1.0);
        let beyond = strain_colour(1.001);
        assert!(green > 0.2 && red > beyond[0] && beyond[1] < 0.05, "{red} {green} {beyond:?}");
    }
}
