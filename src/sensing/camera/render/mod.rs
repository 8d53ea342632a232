//! One picture: pose, shadows, samples, shading.

mod background;
pub(crate) mod interpolate;
pub(crate) mod pass;
pub(crate) mod tile;
pub(crate) mod visibility;

use crate::sensing::camera::{
    CameraError, FrameView, RenderScene, RenderedImage,
    lens::Lens,
    raster::binning::{TILE, TileBins},
    raster::sample_buffer::{ROWS, SampleBuffer},
    render::background::{BackgroundTile, CachedBackground},
    render::interpolate::PixelRays,
    render::pass::RenderPass,
    render::tile::{PIXELS, TileDisplay, TileRect, TileResolver, Triangles},
    render::visibility::{blobs, choose_levels, draw_shadows, drawn, inside_of, pose_all},
    scene::pose::PosedMesh,
    shade::shadow::ShadowMap,
};
use crate::{
    geometry::{Pose, Vec3},
    scene::{Camera, CameraMount},
};

/// Working memory of a renderer, kept from picture to picture; also the backgrounds of cameras that do not move.
#[derive(Debug, Default)]
pub struct Renderer {
    /// World forms of the levels of moving things.
    poses: Vec<Vec<PosedMesh>>,
    screen: TileBins,
    /// What throws the shadows of the state that was drawn last.
    shadow: Option<(Shown, ShadowMap)>,
    backgrounds: Vec<CachedBackground>,
    /// Whether backgrounds are not kept.
    uncached: bool,
}

impl Renderer {
    /// Working memory that keeps no backgrounds: each picture is drawn from nothing.
    pub fn without_cache() -> Self {
        Self { uncached: true, ..Self::default() }
    }
}

/// What a state was: all that moves.
#[derive(Clone, Debug, Default)]
struct Shown {
    stage: u64,
    nodes: Vec<Vec<Vec3>>,
    rigid: Vec<Pose>,
    links: Vec<Vec<Pose>>,
}

impl Shown {
    fn is(&self, view: &FrameView) -> bool {
        self.nodes == view.nodes && self.rigid == view.rigid && self.links == view.links
    }

    fn keep(&mut self, stage: u64, view: &FrameView) {
        self.stage = stage;
        view.nodes.clone_into(&mut self.nodes);
        view.rigid.clone_into(&mut self.rigid);
        view.links.clone_into(&mut self.links);
    }
}

impl Renderer {
    /// Draws what `camera` sees of `stage` in the state `view`.
    ///
    /// # Errors
    /// A number of the camera out of range, a state without a body that is drawn. A camera inside of a thing is none: see
    /// [`RenderedImage::inside`].
    pub fn render(
        &mut self,
        stage: &RenderScene,
        view: &FrameView,
        camera: &Camera,
    ) -> Result<RenderedImage, CameraError> {
        let lens = Lens::new(camera, view)?;
        // Cameras that look at one state share its shadows.
        let known = self.shadow.take().filter(|(shown, _)| shown.stage == stage.key);
        let same = known.as_ref().is_some_and(|(shown, _)| shown.is(view));
        let bounds = pose_all(stage, view, same, &mut self.poses)?;
        let levels = choose_levels(stage, view, &lens, &bounds, &mut self.poses)?;
        let inside = inside_of(stage, &lens, &bounds, &self.poses);
        let (mut shown, mut shadow) =
            known.unwrap_or_else(|| (Shown::default(), ShadowMap::new(&stage.lighting)));
        if !same {
            shown.keep(stage.key, view);
            draw_shadows(stage, &self.poses, &mut shadow);
        }
        let [fixed_blobs, moving_blobs] = blobs(stage, &bounds);
        let pass = RenderPass {
            stage,
            lens: &lens,
            rays: PixelRays::new(&lens),
            drawn: &drawn(stage, &self.poses, &levels),
            fixed_blobs: &fixed_blobs,
            moving_blobs: &moving_blobs,
            moving_shadow: &shadow,
        };
        let mut picture = if self.uncached || camera.mount != CameraMount::World {
            all(&pass, &mut self.screen)
        } else {
            let known = self.backgrounds.iter().position(|b| b.stage == stage.key && b.camera == *camera);
            let index = known.unwrap_or_else(|| {
                self.backgrounds.retain(|b| b.stage == stage.key);
                self.backgrounds.push(background(&pass, camera, &mut self.screen));
                self.backgrounds.len() - 1
            });
            over(&pass, &self.backgrounds[index], &mut self.screen)
        };
        self.shadow = Some((shown, shadow));
        picture.inside = inside;
        Ok(picture)
    }
}

fn empty_picture(lens: &Lens) -> RenderedImage {
    let (width, height) = (lens.width, lens.height);
    let pixels = width * height;
    RenderedImage {
        width,
        height,
        rgb: vec![0; 3 * pixels],
        depth: vec![0.0; pixels],
        segmentation: vec![0; pixels],
        inside: None,
    }
}

fn empty_display() -> TileDisplay {
    TileDisplay(Box::new([[0.0; PIXELS]; 3]))
}

fn empty_samples(lens: &Lens) -> SampleBuffer<ROWS> {
    SampleBuffer::new(TILE, TILE, 1.0 / lens.far, true)
}

/// Everything, drawn from nothing.
fn all(pass: &RenderPass, screen: &mut TileBins) -> RenderedImage {
    screen.clear(pass.lens);
    pass.show(false, screen);
    pass.show(true, screen);
    screen.sort();
    let (mut picture, mut display) = (empty_picture(pass.lens), empty_display());
    let (mut samples, mut triangles) = (empty_samples(pass.lens), Triangles::new());
    for tile in 0..screen.tiles().iter().product() {
        let window = TileRect::of(tile, screen, pass);
        samples.clear(1.0 / pass.lens.far);
        if window.visible(screen, &mut triangles) {
            window.draw_sole(&triangles[0], pass, &mut samples, (&mut display, &mut picture));
        } else {
            window.draw(&triangles, &mut samples);
            TileResolver::new(pass, window, &samples).run(false, &mut display, &mut picture);
        }
        window.write(&display, &mut picture);
    }
    picture
}

/// What is fixed.
fn background(pass: &RenderPass, camera: &Camera, screen: &mut TileBins) -> CachedBackground {
    screen.clear(pass.lens);
    pass.show(false, screen);
    screen.sort();
    let (mut picture, mut display) = (empty_picture(pass.lens), empty_display());
    let (mut samples, mut triangles) = (empty_samples(pass.lens), Triangles::new());
    let mut tiles = Vec::new();
    for tile in 0..screen.tiles().iter().product() {
        let window = TileRect::of(tile, screen, pass);
        samples.clear(1.0 / pass.lens.far);
        window.visible(screen, &mut triangles);
        window.draw(&triangles, &mut samples);
        let mut spots = BackgroundTile::new();
        TileResolver::new(pass, window, &samples).run(false, &mut spots, &mut picture);
        spots.finish(pass, &samples);
        spots.relight(pass, &(false, Vec::new()), |_| false, &mut display);
        window.write(&display, &mut picture);
        tiles.push(spots);
    }
    CachedBackground { stage: pass.stage.key, camera: camera.clone(), tiles, picture }
}

/// What moves, over a background.
fn over(pass: &RenderPass, background: &CachedBackground, screen: &mut TileBins) -> RenderedImage {
    screen.clear(pass.lens);
    pass.show(true, screen);
    screen.sort();
    let (mut picture, mut display) = (background.picture.clone(), empty_display());
    let (mut samples, mut triangles) = (empty_samples(pass.lens), Triangles::new());
    for (tile, spots) in background.tiles.iter().enumerate() {
        let hidden = spots.hidden_by(pass);
        let covered = screen.touches(tile);
        if !covered && !hidden.0 && hidden.1.is_empty() {
            continue;
        }
        let window = TileRect::of(tile, screen, pass);
        if covered {
            samples.clone_from(&spots.samples);
            window.visible(screen, &mut triangles);
            window.draw(&triangles, &mut samples);
            let mut resolver = TileResolver::new(pass, window, &samples);
            spots.relight(pass, &hidden, |first| resolver.moves(first), &mut display);
            resolver.run(true, &mut display, &mut picture);
        } else {
            spots.relight(pass, &hidden, |_| false, &mut display);
        }
        window.write(&display, &mut picture);
    }
    picture
}
