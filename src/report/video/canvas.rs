//! A canvas for panels, lines and words.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use image::{RgbImage, imageops};
use tiny_skia::{Color, Paint, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform};

/// Opaque colour, sRGB.
pub type Ink = [u8; 3];

/// Pixels, and the one typeface that is written on them.
pub struct Canvas {
    pixels: Pixmap,
    font: Option<FontRef<'static>>,
}

impl Canvas {
    /// An empty canvas, at least one pixel large.
    pub fn new(width: u32, height: u32, ground: Ink) -> Self {
        // A canvas of no size cannot be; no caller asks for one.
        let pixels = Pixmap::new(width.max(1), height.max(1)).or_else(|| Pixmap::new(1, 1));
        let mut pixels = pixels.unwrap_or_else(|| unreachable!("one pixel always fits"));
        pixels.fill(colour(ground));
        Self { pixels, font: FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok() }
    }

    /// A canvas with a picture on it.
    pub fn of(picture: &RgbImage) -> Self {
        let mut canvas = Self::new(picture.width(), picture.height(), [0; 3]);
        canvas.place(picture, 0, 0);
        canvas
    }

    /// Puts a picture at (x, y).
    pub fn place(&mut self, picture: &RgbImage, x: u32, y: u32) {
        let width = self.pixels.width() as usize;
        let height = self.pixels.height();
        let data = self.pixels.data_mut();
        for (row, line) in picture.rows().enumerate().take((height.saturating_sub(y)) as usize) {
            let start = (y as usize + row) * width + x as usize;
            let room = width.saturating_sub(x as usize);
            for (at, pixel) in line.enumerate().take(room) {
                let into = 4 * (start + at);
                data[into..into + 3].copy_from_slice(&pixel.0);
                data[into + 3] = 255;
            }
        }
    }

    /// Puts a picture at (x, y), resized.
    pub fn place_resized(&mut self, picture: &RgbImage, (x, y): (u32, u32), (width, height): (u32, u32)) {
        let resized = imageops::resize(picture, width, height, imageops::FilterType::CatmullRom);
        self.place(&resized, x, y);
    }

    /// A filled rectangle.
    pub fn fill(&mut self, [x, y, width, height]: [f32; 4], ink: Ink, opacity: f32) {
        let Some(rect) = Rect::from_xywh(x, y, width, height) else { return };
        let mut paint = Paint::default();
        let mut shade = colour(ink);
        shade.set_alpha(opacity.clamp(0.0, 1.0));
        paint.set_color(shade);
        self.pixels.fill_rect(rect, &paint, Transform::identity(), None);
    }

    /// A line through points; `dash` is the length of its strokes and gaps, 0 for none.
    pub fn line(&mut self, points: &[[f32; 2]], width: f32, dash: f32, ink: Ink) {
        let mut path = PathBuilder::new();
        for (i, &[x, y]) in points.iter().enumerate() {
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        let Some(path) = path.finish() else { return };
        let mut paint = Paint::default();
        paint.set_color(colour(ink));
        paint.anti_alias = true;
        let dash = if dash > 0.0 { StrokeDash::new(vec![dash, dash], 0.0) } else { None };
        let stroke = Stroke { width, dash, ..Stroke::default() };
        self.pixels.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    /// Writes a line of text with its baseline at y; returns where it ends.
    pub fn write(&mut self, text: &str, (x, y): (f32, f32), size: f32, ink: Ink) -> f32 {
        let Some(font) = self.font.clone() else { return x };
        let scaled = font.as_scaled(PxScale::from(size));
        let mut at = x;
        let mut previous = None;
        for letter in text.chars() {
            let id = font.glyph_id(letter);
            at += previous.map_or(0.0, |previous| scaled.kern(previous, id));
            let glyph = id.with_scale_and_position(PxScale::from(size), point(at, y));
            if let Some(outline) = font.outline_glyph(glyph) {
                let bounds = outline.px_bounds();
                outline.draw(|dx, dy, cover| {
                    self.blend(
                        bounds.min.x as i64 + i64::from(dx),
                        bounds.min.y as i64 + i64::from(dy),
                        cover,
                        ink,
                    );
                });
            }
            at += scaled.h_advance(id);
            previous = Some(id);
        }
        at
    }

    /// Width of a line of text, pixels.
    pub fn width_of(&self, text: &str, size: f32) -> f32 {
        let Some(font) = &self.font else { return 0.0 };
        let scaled = font.as_scaled(PxScale::from(size));
        text.chars().map(|letter| scaled.h_advance(font.glyph_id(letter))).sum()
    }

    fn blend(&mut self, x: i64, y: i64, cover: f32, ink: Ink) {
        let (width, height) = (i64::from(self.pixels.width()), i64::from(self.pixels.height()));
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return;
        }
        let at = 4 * (y * width + x) as usize;
        for (value, &ink) in self.pixels.data_mut()[at..at + 3].iter_mut().zip(&ink) {
            let old = f32::from(*value);
            *value = (old + cover.clamp(0.0, 1.0) * (f32::from(ink) - old)).round() as u8;
        }
    }

    /// The picture.
    pub fn picture(&self) -> RgbImage {
        let (width, height) = (self.pixels.width(), self.pixels.height());
        let data =
            self.pixels.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        RgbImage::from_raw(width, height, data).unwrap_or_default()
    }
}

fn colour([r, g, b]: Ink) -> Color {
    Color::from_rgba8(r, g, b, 255)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_lines_and_pictures_land_where_they_are_put() {
        let mut canvas = Canvas::new(200, 60, [0, 0, 0]);
        let end = canvas.write("softvt", (10.0, 40.0), 24.0, [255, 255, 255]);
        assert!((end - 10.0 - canvas.width_of("softvt", 24.0)).abs() < 2.0);
        canvas.place(&RgbImage::from_pixel(30, 90, image::Rgb([9, 8, 7])), 180, 50);
        canvas.line(&[[100.0, 30.5], [150.0, 30.5]], 1.0, 0.0, [0, 255, 0]);
        let picture = canvas.picture();
        let lit = |from: u32, to: u32| (from..to).any(|x| (0..60).any(|y| picture.get_pixel(x, y)[0] > 200));
        assert!(lit(10, end as u32) && !lit(0, 9) && !lit(end as u32 + 2, 200));
        assert_eq!(picture.get_pixel(199, 59).0, [9, 8, 7], "cut off at the edge");
        assert_eq!(picture.get_pixel(120, 30).0, [0, 255, 0]);
    }
}
