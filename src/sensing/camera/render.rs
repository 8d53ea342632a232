//! One picture: pose, shadows, samples, shading.

use super::{
    CameraError, FrameView, Picture, Stage,
    background::Background,
    frame::{blobs, check_outside, choose_levels, draw_shadows, pose_all},
    lens::{Lens, Seen},
    pass::{Pass, Which},
    pose::Posed,
    raster::Samples,
    shade::Light,
    shadow::ShadowMap,
    tone::Tone,
};
use crate::scene::{Camera, CameraMount};

/// Working memory of a renderer, kept from picture to picture; also the backgrounds of cameras that do not move.
#[derive(Debug, Default)]
pub struct Scratch {
    /// World forms of the levels of moving things.
    poses: Vec<Vec<Posed>>,
    projected: Vec<Seen>,
    samples: Samples,
    shadow: Option<(u64, ShadowMap)>,
    backgrounds: Vec<Background>,
    /// Whether backgrounds are not kept.
    uncached: bool,
}

impl Scratch {
    /// Working memory that keeps no backgrounds: each picture is drawn from nothing.
    pub fn uncached() -> Self {
        Self { uncached: true, ..Self::default() }
    }
}

/// Draws what `camera` sees of `stage` in the state `view`.
///
/// # Errors
/// A number of the camera out of range, a camera inside a thing, a state without a body that is drawn.
pub fn render(
    stage: &Stage,
    view: &FrameView,
    camera: &Camera,
    scratch: &mut Scratch,
) -> Result<Picture, CameraError> {
    let lens = Lens::new(camera, view)?;
    let bounds = pose_all(stage, view, &mut scratch.poses)?;
    let levels = choose_levels(stage, view, &lens, &bounds, &mut scratch.poses)?;
    check_outside(stage, camera, &lens, &bounds, &scratch.poses)?;
    let mut shadow = match scratch.shadow.take() {
        Some((key, map)) if key == stage.key => map,
        _ => ShadowMap::new(&stage.lighting),
    };
    draw_shadows(stage, &scratch.poses, &mut shadow);
    let (light, tone) = (Light::new(&stage.lighting), Tone::new(stage.lighting.exposure));
    let [fixed_blobs, moving_blobs] = blobs(stage, &bounds);
    let pass = Pass {
        stage,
        lens: &lens,
        levels: &levels,
        poses: &scratch.poses,
        light: &light,
        tone: &tone,
        fixed_blobs: &fixed_blobs,
        moving_blobs: &moving_blobs,
        moving_shadow: &shadow,
    };
    let (samples, projected) = (&mut scratch.samples, &mut scratch.projected);
    let picture = if scratch.uncached || camera.mount != CameraMount::World {
        pass.draw(Which::All, samples, projected, None);
        pass.shade_all(samples)
    } else {
        let known = scratch.backgrounds.iter().position(|b| b.stage == stage.key && b.camera == *camera);
        let index = known.unwrap_or_else(|| {
            scratch.backgrounds.retain(|b| b.stage == stage.key);
            scratch.backgrounds.push(pass.background(camera, projected));
            scratch.backgrounds.len() - 1
        });
        let background = &scratch.backgrounds[index];
        pass.draw(Which::Moving, samples, projected, Some(&background.samples.w));
        pass.shade_over(background, samples)
    };
    scratch.shadow = Some((stage.key, shadow));
    Ok(picture)
}
