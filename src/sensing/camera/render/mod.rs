//! Draws images: poses the objects, updates the shadows, then rasterises and shades tile by tile.

pub(crate) mod background;
pub(crate) mod interpolate;
pub(crate) mod moving;
pub(crate) mod pass;
pub(crate) mod rows;
pub(crate) mod tile;

use background::{BackgroundTile, CachedBackground};
use moving::MovingObjects;
pub use pass::Channels;
use pass::{PosedObject, RenderPass};
use tile::{PreparedTriangles, TileDisplay, TileRect, TileResolver, is_all_moving};

use super::{
    error::CameraError,
    image::RenderedImage,
    lens::Lens,
    raster::{TileBins, TileSamples, TriangleBlock},
    scene::{FrameView, RenderScene},
    shade::occlusion::OcclusionEllipsoid,
};
use softvt_scene::{Camera, CameraMount};

/// Draws images of a [`RenderScene`] as cameras see it.
///
/// A renderer keeps working memory between images. It also caches the moving objects of the last state with their
/// shadows, which all cameras share, and the background of every camera fixed in the world: all objects that stand
/// still, fixed or [at rest](super::RestState). Neither changes segmentation, nor depth by more than 2 µm; with a
/// cached background, colours of relit pixels differ from a full rendering by rounding, and by the interpolation of
/// light between rows. A renderer may be used with several scenes, but keeps the cache of one.
#[derive(Debug, Default)]
pub struct Renderer {
    /// True if no background is kept.
    is_transient: bool,
    /// The scene of the caches.
    scene_id: Option<u64>,
    bins: TileBins,
    moving: Option<MovingObjects>,
    backgrounds: Vec<CachedBackground>,
}

impl Renderer {
    /// A renderer for single images: it keeps no backgrounds, which take some 130 bytes per pixel. Its images are
    /// byte-identical to the images of a renderer that keeps them.
    pub fn without_backgrounds() -> Self {
        Self { is_transient: true, ..Self::default() }
    }

    /// Draws the image that `camera` sees of `scene` in the state `view`: colour, depth and segmentation.
    ///
    /// The result depends on the arguments alone and is byte-identical on every machine.
    ///
    /// # Errors
    /// A setting of the camera is out of range, or the state lacks a body of the scene. A camera inside an object is
    /// not an error; see [`RenderedImage::inside`].
    pub fn render(
        &mut self,
        scene: &RenderScene,
        view: &FrameView,
        camera: &Camera,
    ) -> Result<RenderedImage, CameraError> {
        self.render_channels(scene, view, camera, Channels::All)
    }

    /// As [`render`](Self::render), but with some channels of the same image alone; the others are empty.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    pub fn render_channels(
        &mut self,
        scene: &RenderScene,
        view: &FrameView,
        camera: &Camera,
        channels: Channels,
    ) -> Result<RenderedImage, CameraError> {
        let lens = Lens::new(camera, view.hand_w)?;
        if self.scene_id != Some(scene.id) {
            *self = Self {
                is_transient: self.is_transient,
                scene_id: Some(scene.id),
                bins: std::mem::take(&mut self.bins),
                ..Self::default()
            };
        }
        let moving = self.moving.get_or_insert_with(|| MovingObjects::new(scene));
        moving.adopt(view);
        let is_still = scene.still_objects(view);
        let still_shadow = match channels.has_colours() {
            true => scene.still_shadow(&is_still)?,
            false => scene.fixed_shadow.clone(),
        };
        let posed = |index: usize| PosedObject::new(scene, index, is_still[index], view, &lens, moving);
        let objects = (0..scene.objects.len()).map(posed).collect::<Result<Vec<_>, _>>()?;
        if channels.has_colours() {
            moving.draw_shadow(view.hidden_id, &objects);
        }
        let occluders = |is_moving: bool| -> Vec<OcclusionEllipsoid> {
            let occluders =
                objects.iter().enumerate().filter(|(_, o)| o.is_occluder() && o.is_moving == is_moving);
            occluders.map(|(i, o)| OcclusionEllipsoid::from_bounds(i, &o.bounds)).collect()
        };
        let pass = RenderPass {
            scene,
            lens: &lens,
            objects: &objects,
            still_occluders: &occluders(false),
            moving_occluders: &occluders(true),
            still_shadow: &still_shadow,
            moving_shadow: moving.shadow(),
            channels,
        };
        let mut image = if camera.mount != CameraMount::World || !channels.has_colours() {
            draw_all(&pass, &mut self.bins)
        } else if self.is_transient {
            draw_by_tiles(&pass, &mut self.bins)
        } else {
            let shown: Vec<bool> = objects.iter().map(|o| !o.is_moving && !o.is_hidden).collect();
            self.backgrounds.retain(|known| known.camera != *camera || known.shown == shown);
            let known = self.backgrounds.iter().position(|background| background.camera == *camera);
            let index = known.unwrap_or_else(|| {
                let pass = RenderPass { channels: Channels::All, ..pass };
                self.backgrounds.push(draw_background(&pass, camera, shown, &mut self.bins));
                self.backgrounds.len() - 1
            });
            draw_over_background(&pass, &self.backgrounds[index], &mut self.bins)
        };
        image.inside =
            objects.iter().find(|o| !o.is_hidden && o.contains(&lens.eye)).map(|o| o.object.name.clone());
        Ok(image)
    }
}

fn blank_image(pass: &RenderPass) -> RenderedImage {
    let (width, height) = (pass.lens.width, pass.lens.height);
    let pixels = width * height;
    let colours = if pass.channels.has_colours() { pixels } else { 0 };
    let centres = if pass.channels.has_centres() { pixels } else { 0 };
    RenderedImage {
        width,
        height,
        rgb: vec![0; 3 * colours],
        depth: vec![0.0; centres],
        segmentation: vec![0; centres],
        inside: None,
    }
}

fn blank_samples(pass: &RenderPass) -> TileSamples {
    TileSamples::new(1.0 / pass.lens.far, pass.channels.has_colours(), pass.channels.has_centres())
}

/// Draws all objects, without a cached background.
fn draw_all(pass: &RenderPass, bins: &mut TileBins) -> RenderedImage {
    pass.bin(&[false, true], bins);
    let (mut image, mut display) = (blank_image(pass), TileDisplay::zeros());
    let (mut samples, mut blocks, mut prepared) =
        (blank_samples(pass), Vec::new(), PreparedTriangles::default());
    for (tile, rect) in TileRect::all(pass.lens).enumerate() {
        samples.clear(1.0 / pass.lens.far);
        let covering = bins.draw_tile(tile, rect.origin(), &mut samples, &mut blocks, true);
        let mut resolver = TileResolver::new(pass, rect, &samples, &mut display, &mut image, &mut prepared);
        match covering {
            _ if !pass.channels.has_colours() => resolver.run_centres(),
            Some(id) => resolver.run_covered(id),
            None => resolver.run(false),
        }
        if pass.channels.has_colours() {
            rect.write(&display, &mut image);
        }
    }
    image
}

/// Draws the objects that stand still.
fn draw_background(
    pass: &RenderPass,
    camera: &Camera,
    shown: Vec<bool>,
    bins: &mut TileBins,
) -> CachedBackground {
    pass.bin(&[false], bins);
    let (mut image, mut tiles) = (blank_image(pass), Vec::new());
    for (tile, rect) in TileRect::all(pass.lens).enumerate() {
        let background = draw_background_tile(pass, tile, rect, bins, &mut image);
        rect.write(&background.display, &mut image);
        tiles.push(background);
    }
    CachedBackground { camera: camera.clone(), shown, tiles, image }
}

fn draw_background_tile(
    pass: &RenderPass,
    tile: usize,
    rect: TileRect,
    bins: &TileBins,
    image: &mut RenderedImage,
) -> BackgroundTile {
    let mut samples = blank_samples(pass);
    bins.draw_tile(tile, rect.origin(), &mut samples, &mut Vec::new(), false);
    let mut background = BackgroundTile::new();
    let mut prepared = PreparedTriangles::default();
    TileResolver::new(pass, rect, &samples, &mut background, image, &mut prepared).run(false);
    background.finish(pass, samples);
    background
}

/// Draws the moving objects over a background.
fn draw_over_background(
    pass: &RenderPass,
    background: &CachedBackground,
    bins: &mut TileBins,
) -> RenderedImage {
    pass.bin(&[true], bins);
    let (mut image, mut working) = (blank_image(pass), TileWorkspace::new(pass));
    image.rgb.clone_from(&background.image.rgb);
    if pass.channels.has_centres() {
        image.depth.clone_from(&background.image.depth);
        image.segmentation.clone_from(&background.image.segmentation);
    }
    for (tile, (rect, still)) in TileRect::all(pass.lens).zip(&background.tiles).enumerate() {
        working.draw_over(pass, tile, rect, still, bins, &mut image);
    }
    image
}

/// Draws the objects that stand still, and the moving ones over them, tile by tile: the background of one tile is
/// kept at a time.
fn draw_by_tiles(pass: &RenderPass, still_bins: &mut TileBins) -> RenderedImage {
    let mut moving_bins = TileBins::default();
    pass.bin(&[false], still_bins);
    pass.bin(&[true], &mut moving_bins);
    let (mut image, mut working) = (blank_image(pass), TileWorkspace::new(pass));
    for (tile, rect) in TileRect::all(pass.lens).enumerate() {
        let still = draw_background_tile(pass, tile, rect, still_bins, &mut image);
        rect.write(&still.display, &mut image);
        working.draw_over(pass, tile, rect, &still, &moving_bins, &mut image);
    }
    image
}

/// Working memory for the moving objects in one tile.
struct TileWorkspace<'a> {
    samples: TileSamples,
    blocks: Vec<TriangleBlock>,
    display: TileDisplay,
    prepared: PreparedTriangles<'a>,
}

impl<'a> TileWorkspace<'a> {
    fn new(pass: &RenderPass) -> Self {
        Self {
            samples: blank_samples(pass),
            blocks: Vec::new(),
            display: TileDisplay::zeros(),
            prepared: PreparedTriangles::default(),
        }
    }

    /// Draws the moving objects of a tile over its background, which `image` shows already.
    fn draw_over(
        &mut self,
        pass: &RenderPass<'a>,
        tile: usize,
        rect: TileRect,
        still: &BackgroundTile,
        bins: &TileBins,
        image: &mut RenderedImage,
    ) {
        let Self { samples, blocks, display, prepared } = self;
        let occluders = still.moving_occluders(pass);
        if bins.is_occupied(tile) {
            samples.copy_rows(&still.samples, bins.rows(tile, rect.origin()[1]));
            bins.draw_tile(tile, rect.origin(), samples, blocks, false);
            still.relight(pass, occluders.as_deref(), |first| is_all_moving(samples, first), display);
            TileResolver::new(pass, rect, samples, display, image, prepared).run(true);
        } else if occluders.is_some() {
            still.relight(pass, occluders.as_deref(), |_| false, display);
        } else {
            return;
        }
        rect.write(display, image);
    }
}
