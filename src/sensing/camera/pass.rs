//! One picture of one state: what is drawn, and the light on it.

use super::{
    Mount, Stage,
    lanes::{F8, V8},
    lens::Lens,
    raster::NONE,
    screen::Screen,
    shade::{Blob, Points, Split, open_sky},
    shadow::ShadowMap,
    surface::{Drawn, MOVING, Rays, TRIANGLE_BITS, thing_of, triangle_of},
};

/// What a pass needs to know.
pub(super) struct Pass<'a> {
    pub stage: &'a Stage,
    pub lens: &'a Lens,
    pub rays: Rays,
    /// Each thing, or none if it is out of sight.
    pub drawn: &'a [Option<Drawn<'a>>],
    pub fixed_blobs: &'a [Blob],
    pub moving_blobs: &'a [Blob],
    pub moving_shadow: &'a ShadowMap,
}

impl Pass<'_> {
    /// Adds the triangles of the things that move, or of those that do not.
    pub(super) fn show(&self, moving: bool, screen: &mut Screen) {
        for (i, (thing, drawn)) in self.stage.things.iter().zip(self.drawn).enumerate() {
            let moves = !matches!(thing.mount, Mount::Fixed(_));
            if let Some(drawn) = drawn.as_ref().filter(|_| moves == moving) {
                let first = (i as u32) << TRIANGLE_BITS | if moving { MOVING } else { 0 };
                screen.add(self.lens, &drawn.posed.positions, &drawn.level.triangles, first);
            }
        }
    }

    /// Object number of a triangle; 0 for none.
    pub(super) fn object(&self, id: u32) -> u16 {
        if id == NONE { 0 } else { self.stage.things[thing_of(id)].object }
    }

    /// What tells surfaces apart that are not to be blended before they are lit.
    pub(super) fn surface(&self, id: u32) -> (usize, u32) {
        if id == NONE {
            return (usize::MAX, 0);
        }
        let thing = thing_of(id);
        let patch = self.drawn[thing].as_ref().map(|drawn| drawn.level.patches[triangle_of(id)]);
        (thing, patch.unwrap_or(0))
    }

    /// Light from points under what is fixed.
    #[inline(always)]
    pub(super) fn under_fixed(&self, points: &Points) -> Split {
        let to_eye = (V8::splat(&self.rays.eye) - points.p).unit();
        let light = &self.stage.light;
        let mut split = light.split(points, to_eye);
        let (fine, wide) = (&self.stage.fixed_shadow, self.stage.wide_shadow.as_ref());
        split.direct = split.direct * light.unshadowed_afar(points.p, &points.n, fine, wide);
        split.ambient = split.ambient * open_sky(self.fixed_blobs, points.p, points.n, points.thing);
        split
    }

    /// Shares of the key light and of the sky that what moves leaves at points.
    #[inline(always)]
    pub(super) fn under_moving(&self, points: &Points) -> (F8, F8) {
        let key = self.stage.light.unshadowed(points.p, &points.n, self.moving_shadow);
        (key, open_sky(self.moving_blobs, points.p, points.n, points.thing))
    }

    /// Radiance where nothing is, at eight pixels.
    pub(super) fn nothing(&self, x: F8, y: F8) -> V8 {
        self.stage.light.sky(self.rays.up(x, y))
    }
}
