//! Draws images: poses the objects, updates the shadows, then rasterises and shades tile by tile.

pub(crate) mod background;
pub(crate) mod interpolate;
pub(crate) mod pass;
pub(crate) mod tile;
pub(crate) mod visibility;

use background::{BackgroundTile, CachedBackground};
use interpolate::PixelRays;
use pass::RenderPass;
use tile::{TileDisplay, TileRect, TileResolver, TileSamples};
use visibility::{Occluders, choose_levels, draw_moving_shadows, enclosing_object, instances, pose_objects};

use crate::{
    geometry::{Pose, Vec3},
    scene::{Camera, CameraMount},
    sensing::camera::{
        CameraError, FrameView, RenderScene, RenderedImage,
        lens::Lens,
        raster::binning::{TILE_EDGE, TileBins},
        scene::{pose::PosedMesh, render_scene::SceneId},
        shade::shadow::ShadowMap,
    },
};

/// Draws images of a [`RenderScene`] as cameras see it.
///
/// A renderer keeps working memory between images. It also caches the moving shadows of the last state, which all
/// cameras share, and the background (all fixed objects) of every camera that is fixed in the world. Neither changes
/// depth or segmentation; with a cached background, colours of relit pixels differ from a full rendering by rounding.
/// A renderer may be used with several scenes, but keeps the cache of one.
#[derive(Debug, Default)]
pub struct Renderer {
    /// World-space levels of detail of the moving objects.
    poses: Vec<Vec<PosedMesh>>,
    bins: TileBins,
    moving_shadow: Option<MovingShadow>,
    backgrounds: Vec<CachedBackground>,
    is_uncached: bool,
}

/// The shadow map of the moving objects in one state.
#[derive(Debug)]
struct MovingShadow {
    scene: SceneId,
    nodes: Vec<Vec<Vec3>>,
    rigid: Vec<Pose>,
    links: Vec<Vec<Pose>>,
    map: ShadowMap,
}

impl MovingShadow {
    fn new(scene: &RenderScene) -> Self {
        Self {
            scene: scene.id.clone(),
            nodes: Vec::new(),
            rigid: Vec::new(),
            links: Vec::new(),
            map: ShadowMap::new(&scene.lighting),
        }
    }

    fn shows(&self, view: &FrameView) -> bool {
        self.nodes == view.nodes && self.rigid == view.rigid && self.links == view.links
    }

    fn draw(&mut self, scene: &RenderScene, view: &FrameView, poses: &[Vec<PosedMesh>]) {
        view.nodes.clone_into(&mut self.nodes);
        view.rigid.clone_into(&mut self.rigid);
        view.links.clone_into(&mut self.links);
        draw_moving_shadows(scene, poses, &mut self.map);
    }
}

impl Renderer {
    /// A renderer that caches no backgrounds: each image is drawn from scratch.
    pub fn without_cache() -> Self {
        Self { is_uncached: true, ..Self::default() }
    }

    /// Draws the image that `camera` sees of `scene` in the state `view`.
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
        let lens = Lens::new(camera, view.hand_w)?;
        // Taken out, so that an error below leaves no shadow whose poses are half updated.
        let known = self.moving_shadow.take().filter(|shadow| shadow.scene == scene.id);
        let is_same_state = known.as_ref().is_some_and(|shadow| shadow.shows(view));
        let bounds = pose_objects(scene, view, is_same_state, &mut self.poses)?;
        let levels = choose_levels(scene, view, &lens, &bounds, &mut self.poses)?;
        let inside = enclosing_object(scene, &lens, &bounds, &self.poses);
        let mut moving_shadow = known.unwrap_or_else(|| MovingShadow::new(scene));
        if !is_same_state {
            moving_shadow.draw(scene, view, &self.poses);
        }
        let occluders = Occluders::new(scene, &bounds);
        let pass = RenderPass {
            scene,
            lens: &lens,
            rays: PixelRays::new(&lens),
            instances: &instances(scene, &self.poses, &levels),
            fixed_occluders: &occluders.fixed,
            moving_occluders: &occluders.moving,
            moving_shadow: &moving_shadow.map,
        };
        let mut image = if self.is_uncached || camera.mount != CameraMount::World {
            draw_all(&pass, &mut self.bins)
        } else {
            let known = self.backgrounds.iter().position(|b| b.scene == scene.id && b.camera == *camera);
            let index = known.unwrap_or_else(|| {
                self.backgrounds.retain(|b| b.scene == scene.id);
                self.backgrounds.push(draw_background(&pass, camera, &mut self.bins));
                self.backgrounds.len() - 1
            });
            draw_over_background(&pass, &self.backgrounds[index], &mut self.bins)
        };
        self.moving_shadow = Some(moving_shadow);
        image.inside = inside;
        Ok(image)
    }
}

fn blank_image(lens: &Lens) -> RenderedImage {
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

fn blank_samples(lens: &Lens) -> TileSamples {
    TileSamples::new(TILE_EDGE, TILE_EDGE, 1.0 / lens.far, true)
}

/// Draws all objects, without a cached background.
fn draw_all(pass: &RenderPass, bins: &mut TileBins) -> RenderedImage {
    bins.clear(pass.lens);
    pass.bin_objects(false, bins);
    pass.bin_objects(true, bins);
    bins.sort();
    let (mut image, mut display) = (blank_image(pass.lens), TileDisplay::new());
    let (mut samples, mut triangles) = (blank_samples(pass.lens), Vec::new());
    for tile in 0..bins.tile_counts().iter().product() {
        let rect = TileRect::new(tile, bins, pass);
        samples.clear(1.0 / pass.lens.far);
        if rect.collect_visible(bins, &mut triangles) {
            rect.draw_single(&triangles[0], pass, &mut samples, &mut display, &mut image);
        } else {
            rect.rasterize(&triangles, &mut samples);
            TileResolver::new(pass, rect, &samples).run(false, &mut display, &mut image);
        }
        rect.write(&display, &mut image);
    }
    image
}

/// Draws the fixed objects.
fn draw_background(pass: &RenderPass, camera: &Camera, bins: &mut TileBins) -> CachedBackground {
    bins.clear(pass.lens);
    pass.bin_objects(false, bins);
    bins.sort();
    let (mut image, mut display) = (blank_image(pass.lens), TileDisplay::new());
    let (mut samples, mut triangles) = (blank_samples(pass.lens), Vec::new());
    let mut tiles = Vec::new();
    for tile in 0..bins.tile_counts().iter().product() {
        let rect = TileRect::new(tile, bins, pass);
        samples.clear(1.0 / pass.lens.far);
        rect.collect_visible(bins, &mut triangles);
        rect.rasterize(&triangles, &mut samples);
        let mut background = BackgroundTile::new();
        TileResolver::new(pass, rect, &samples).run(false, &mut background, &mut image);
        background.finish(pass, &samples);
        background.copy_display(&mut display);
        rect.write(&display, &mut image);
        tiles.push(background);
    }
    CachedBackground { scene: pass.scene.id.clone(), camera: camera.clone(), tiles, image }
}

/// Draws the moving objects over a background.
fn draw_over_background(
    pass: &RenderPass,
    background: &CachedBackground,
    bins: &mut TileBins,
) -> RenderedImage {
    bins.clear(pass.lens);
    pass.bin_objects(true, bins);
    bins.sort();
    let (mut image, mut display) = (background.image.clone(), TileDisplay::new());
    let (mut samples, mut triangles) = (blank_samples(pass.lens), Vec::new());
    for (tile, fixed) in background.tiles.iter().enumerate() {
        let occlusion = fixed.moving_occlusion(pass);
        let is_occupied = bins.is_occupied(tile);
        if !is_occupied && occlusion.is_none() {
            continue;
        }
        let rect = TileRect::new(tile, bins, pass);
        if is_occupied {
            samples.clone_from(&fixed.samples);
            rect.collect_visible(bins, &mut triangles);
            rect.rasterize(&triangles, &mut samples);
            let mut resolver = TileResolver::new(pass, rect, &samples);
            fixed.relight(pass, &occlusion, |first| resolver.is_all_moving(first), &mut display);
            resolver.run(true, &mut display, &mut image);
        } else {
            fixed.relight(pass, &occlusion, |_| false, &mut display);
        }
        rect.write(&display, &mut image);
    }
    image
}
