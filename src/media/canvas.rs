//! A canvas for images, lines and text: captions and charts drawn on what sensors show.

use ab_glyph::{Font as _, FontRef, PxScale, ScaleFont, point};
use image::RgbImage;
use tiny_skia::{Color, Paint, PathBuilder, Pixmap, Rect, StrokeDash, Transform};

use super::{
    chart::FONT_SIZE,
    drawing::{Anchor, Element, Fill, Font, Place, Stroke, Symbol, Tone},
};

/// An opaque sRGB colour.
pub type Rgb8 = [u8; 3];

/// Size of titles, units.
const TITLE_SIZE: f32 = 12.0;
/// Dashes of the curves of a chart in turn, units; 0 is a solid line.
const DASHES: [f32; 4] = [0.0, 5.0, 1.5, 10.0];

#[derive(Clone, Copy, Debug)]
pub struct CanvasColours {
    pub ink: Rgb8,
    pub faint: Rgb8,
    pub safe: Rgb8,
    pub harm: Rgb8,
    pub ground: Rgb8,
}

impl CanvasColours {
    pub fn of(&self, tone: Tone) -> Rgb8 {
        match tone {
            Tone::Ink => self.ink,
            Tone::Faint => self.faint,
            Tone::Safe => self.safe,
            Tone::Harm => self.harm,
        }
    }
}

/// Pixels to draw on, with one typeface. Positions are in pixels from the top left.
pub struct Canvas {
    pixels: Pixmap,
    font: Option<FontRef<'static>>,
}

impl Canvas {
    pub fn new(width: u32, height: u32, background: Rgb8) -> Self {
        // Pixmaps cannot be empty or larger than memory allows; no caller asks for either.
        let pixels = Pixmap::new(width.max(1), height.max(1)).or_else(|| Pixmap::new(1, 1));
        let mut pixels = pixels.unwrap_or_else(|| unreachable!("one pixel always fits"));
        pixels.fill(opaque(background));
        Self { pixels, font: FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok() }
    }

    pub fn from_image(image: &RgbImage) -> Self {
        let mut canvas = Self::new(image.width(), image.height(), [0; 3]);
        canvas.place(image, 0, 0);
        canvas
    }

    /// Copies an image to (x, y), clipped at the edges.
    pub fn place(&mut self, image: &RgbImage, x: u32, y: u32) {
        let (width, skipped) = (4 * self.pixels.width() as usize, 4 * x as usize);
        let lines = self.pixels.data_mut().chunks_exact_mut(width).skip(y as usize);
        for (line, row) in lines.zip(image.chunks_exact(3 * image.width().max(1) as usize)) {
            let pixels = line.get_mut(skipped..).unwrap_or_default().as_chunks_mut::<4>().0;
            pixels
                .iter_mut()
                .zip(row.as_chunks::<3>().0)
                .for_each(|(pixel, &[r, g, b])| *pixel = [r, g, b, 255]);
        }
    }

    /// Fills a rectangle whose top left corner is (x, y).
    pub fn fill(&mut self, x: f32, y: f32, width: f32, height: f32, colour: Rgb8, opacity: f32) {
        let Some(rect) = Rect::from_xywh(x, y, width, height) else { return };
        let mut colour = opaque(colour);
        colour.set_alpha(opacity.clamp(0.0, 1.0));
        let mut paint = Paint::default();
        paint.set_color(colour);
        self.pixels.fill_rect(rect, &paint, Transform::identity(), None);
    }

    /// Draws elements with texts and lines in units of `unit` pixels.
    pub fn draw(&mut self, elements: &[Element], unit: f32, colours: &CanvasColours) {
        for element in elements {
            match element {
                Element::Line(places, stroke) => {
                    let (colour, width, dash) = match *stroke {
                        Stroke::Axis | Stroke::Grid => (colours.faint, 0.8, 0.0),
                        Stroke::Limit => (colours.harm, 1.2, 0.0),
                        Stroke::Guide => (colours.safe, 0.8, 0.0),
                        Stroke::Event => (colours.faint, 0.8, 2.0),
                        Stroke::Whisker => (colours.faint, 1.2, 0.0),
                        Stroke::Gap => (colours.harm, 2.0, 0.0),
                        Stroke::Curve { tone, dash } => (colours.of(tone), 1.6, DASHES[dash % DASHES.len()]),
                    };
                    let points: Vec<[f32; 2]> = places.iter().map(|Place { x, y }| [*x, *y]).collect();
                    self.line(&points, width * unit, dash * unit, colour);
                }
                Element::Area(area, fill) => {
                    let (colour, opacity) = match fill {
                        Fill::Band => (colours.safe, 0.15),
                        Fill::Bar => (colours.safe, 1.0),
                        Fill::Hatched | Fill::Harm => (colours.harm, 0.12),
                        Fill::Interval => (colours.ink, 0.07),
                    };
                    self.fill(area.left, area.top, area.width(), area.height(), colour, opacity);
                }
                Element::Symbol(Place { x, y }, Symbol { radius, tone, is_filled, .. }) => {
                    let opacity = if *is_filled { 1.0 } else { 0.5 };
                    self.fill(x - radius, y - radius, 2.0 * radius, 2.0 * radius, colours.of(*tone), opacity);
                }
                // The typeface has no letters that lie on their side.
                Element::Text { place, shift, anchor, font, text } => {
                    let (size, colour) = match font {
                        Font::Title => (TITLE_SIZE * unit, colours.ink),
                        Font::Name(tone) => (TITLE_SIZE * unit, colours.of(*tone)),
                        Font::Plain(tone) => (FONT_SIZE * unit, colours.of(*tone)),
                        Font::Upward => (FONT_SIZE * unit, colours.ink),
                        Font::Strong => (FONT_SIZE * unit, colours.harm),
                    };
                    let x = place.x + shift;
                    let x = match anchor {
                        Anchor::Start => x,
                        Anchor::Middle => x - 0.5 * self.text_width(text, size),
                        Anchor::End => x - self.text_width(text, size),
                    };
                    self.write(text, x, place.y, size, colour);
                }
                Element::Tag { place, shift, right, text } => {
                    let size = FONT_SIZE * unit;
                    let width = self.text_width(text, size);
                    let left = (place.x + shift).min(right - width);
                    self.fill(left, place.y, width, (FONT_SIZE + 3.0) * unit, colours.ground, 0.6);
                    self.write(text, left, place.y + size, size, colours.ink);
                }
            }
        }
    }

    /// Draws a line through points; `dash` is the length of its strokes and gaps, 0 for a solid line.
    pub fn line(&mut self, points: &[[f32; 2]], width: f32, dash: f32, colour: Rgb8) {
        let mut path = PathBuilder::new();
        for (i, &[x, y]) in points.iter().enumerate() {
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        let Some(path) = path.finish() else { return };
        let mut paint = Paint::default();
        paint.set_color(opaque(colour));
        paint.anti_alias = true;
        let dash = if dash > 0.0 { StrokeDash::new(vec![dash, dash], 0.0) } else { None };
        let stroke = tiny_skia::Stroke { width, dash, ..Default::default() };
        self.pixels.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    /// Writes a line of text that starts at x with its baseline at y. Returns the x coordinate of its end.
    pub fn write(&mut self, text: &str, x: f32, y: f32, size: f32, colour: Rgb8) -> f32 {
        let Some(font) = self.font.clone() else { return x };
        let scaled = font.as_scaled(PxScale::from(size));
        let mut pen = x;
        let mut previous = None;
        for letter in text.chars() {
            let id = font.glyph_id(letter);
            pen += previous.map_or(0.0, |previous| scaled.kern(previous, id));
            let glyph = id.with_scale_and_position(PxScale::from(size), point(pen, y));
            if let Some(outline) = font.outline_glyph(glyph) {
                let bounds = outline.px_bounds();
                outline.draw(|dx, dy, coverage| {
                    let (x, y) = (bounds.min.x as i64 + i64::from(dx), bounds.min.y as i64 + i64::from(dy));
                    self.blend(x, y, coverage, colour);
                });
            }
            pen += scaled.h_advance(id);
            previous = Some(id);
        }
        pen
    }

    /// Width of a line of text, pixels.
    pub fn text_width(&self, text: &str, size: f32) -> f32 {
        let Some(font) = &self.font else { return 0.0 };
        let scaled = font.as_scaled(PxScale::from(size));
        text.chars().map(|letter| scaled.h_advance(font.glyph_id(letter))).sum()
    }

    fn blend(&mut self, x: i64, y: i64, coverage: f32, colour: Rgb8) {
        let (width, height) = (i64::from(self.pixels.width()), i64::from(self.pixels.height()));
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return;
        }
        let at = 4 * (y * width + x) as usize;
        for (value, &colour) in self.pixels.data_mut()[at..at + 3].iter_mut().zip(&colour) {
            let old = f32::from(*value);
            *value = (old + coverage.clamp(0.0, 1.0) * (f32::from(colour) - old)).round() as u8;
        }
    }

    pub fn to_image(&self) -> RgbImage {
        let (width, height) = (self.pixels.width(), self.pixels.height());
        let rgb = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2]];
        let data = self.pixels.data().chunks_exact(4).flat_map(rgb).collect();
        RgbImage::from_raw(width, height, data).unwrap_or_default()
    }
}

fn opaque([r, g, b]: Rgb8) -> Color {
    Color::from_rgba8(r, g, b, 255)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_lines_and_images_appear_at_their_positions() {
        let mut canvas = Canvas::new(200, 60, [0, 0, 0]);
        let end = canvas.write("softvt", 10.0, 40.0, 24.0, [255, 255, 255]);
        assert!((end - 10.0 - canvas.text_width("softvt", 24.0)).abs() < 2.0);
        canvas.place(&RgbImage::from_pixel(30, 90, image::Rgb([9, 8, 7])), 180, 50);
        canvas.line(&[[100.0, 30.5], [150.0, 30.5]], 1.0, 0.0, [0, 255, 0]);
        let image = canvas.to_image();
        let is_lit = |from: u32, to: u32| (from..to).any(|x| (0..60).any(|y| image.get_pixel(x, y)[0] > 200));
        assert!(is_lit(10, end as u32) && !is_lit(0, 9) && !is_lit(end as u32 + 2, 200));
        assert_eq!(image.get_pixel(199, 59).0, [9, 8, 7], "clipped at the edge");
        assert_eq!(image.get_pixel(120, 30).0, [0, 255, 0]);
    }
}
