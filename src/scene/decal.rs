//! Lines of text printed on surfaces: their place and style, and their rasterised glyphs.

use std::sync::OnceLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont, point};
use serde::Serialize;
use softvt_geometry::Vec3;

/// Typeface of a text decal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Typeface {
    /// Ubuntu Light, without serifs.
    #[default]
    Sans,
    /// Hack, monospaced.
    Mono,
}

/// A line of text with its place and style, in the object frame at rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LabelLine {
    /// Text, at most [`MAX_LETTERS`] characters.
    pub text: String,
    /// Typeface of all letters.
    pub typeface: Typeface,
    /// Height of a capital letter, m.
    pub height_m: f64,
    /// Widening of the strokes, relative to the height of a capital letter, 0..=0.25.
    pub weight: f64,
    /// Centre of the line, m.
    pub at: [f64; 3],
    /// Outward direction of the printed surface, any length. The top of the letters points to +z, or to +y if the line
    /// faces up or down.
    pub facing: [f64; 3],
    /// Rotation of the line on its surface, rad, counter-clockwise as seen by the reader.
    pub turn: f64,
    /// Radius of the cylinder about the z axis onto which the line is wrapped, m; `None` for a flat line.
    pub wrap_m: Option<f64>,
}

/// Largest number of characters of a line.
pub const MAX_LETTERS: usize = 64;
/// Height of a capital letter in the raster, texels.
const CAPITAL: f32 = 44.0;
/// Empty texels around the line.
const MARGIN: usize = 2;

/// A line of text with its raster, which is computed at the first use.
#[derive(Debug, Default, Serialize)]
pub struct TextDecal {
    /// Text, place and style.
    pub line: LabelLine,
    #[serde(skip)]
    coverage: OnceLock<GlyphCoverage>,
}

impl PartialEq for TextDecal {
    fn eq(&self, other: &Self) -> bool {
        self.line == other.line
    }
}

impl TextDecal {
    /// Creates a decal; the glyphs are rasterised later.
    pub fn new(line: LabelLine) -> Self {
        Self { line, coverage: OnceLock::new() }
    }

    /// The glyphs, rasterised at the first call.
    pub fn coverage(&self) -> &GlyphCoverage {
        self.coverage.get_or_init(|| GlyphCoverage::rasterize(&self.line))
    }
}

impl LabelLine {
    /// The first character that the typeface cannot show.
    pub fn unsupported_char(&self) -> Option<char> {
        let font = font(self.typeface)?;
        self.text.chars().find(|&letter| letter.is_control() || font.glyph_id(letter).0 == 0)
    }

    /// Length of the line without the margins of its raster, m.
    pub fn length_m(&self) -> f64 {
        let Some(font) = font(self.typeface) else { return 0.0 };
        f64::from(place_letters(self, &font, 0.0, |_, _| ()) / CAPITAL) * self.height_m
    }

    /// Direction of the top of the letters before [`Self::turn`], object frame; `facing` is the unit vector of
    /// [`Self::facing`].
    pub fn up(&self, facing: &Vec3) -> Vec3 {
        let head = if facing.z.abs() > 0.999 { Vec3::y() } else { Vec3::z() };
        (head - facing * facing.dot(&head)).normalize()
    }
}

fn font(typeface: Typeface) -> Option<FontRef<'static>> {
    let bytes = match typeface {
        Typeface::Sans => epaint_default_fonts::UBUNTU_LIGHT,
        Typeface::Mono => epaint_default_fonts::HACK_REGULAR,
    };
    FontRef::try_from_slice(bytes).ok()
}

/// Coverage of a line's area by glyphs, as a summed-area table (Crow, Summed-Area Tables for Texture Mapping, 1984):
/// the mean over any rectangle takes four lookups.
#[derive(Debug, Default)]
pub struct GlyphCoverage {
    size: [usize; 2],
    /// Row by row, one row and one column more than texels.
    sums: Vec<f64>,
    /// Texels per metre of the surface.
    scale: f64,
    /// Row at half the height of a capital letter, texels.
    middle: f64,
}

impl GlyphCoverage {
    fn rasterize(line: &LabelLine) -> Self {
        let Some(font) = font(line.typeface) else { return Self::default() };
        let em = scale_of(&font);
        let thick = line.weight as f32 * CAPITAL;
        let scaled = font.as_scaled(em);
        let mut glyphs = Vec::new();
        let baseline = MARGIN as f32 + thick + scaled.ascent();
        let across = place_letters(line, &font, MARGIN as f32 + thick, |id, across| {
            glyphs.push(id.with_scale_and_position(em, point(across, baseline)));
        });
        let width = (across + thick).ceil() as usize + MARGIN;
        let height = (baseline + thick - scaled.descent()).ceil() as usize + MARGIN;
        let mut cover = vec![0.0_f32; width * height];
        for outline in glyphs.into_iter().filter_map(|glyph| font.outline_glyph(glyph)) {
            let low = outline.px_bounds().min;
            outline.draw(|x, y, share| {
                let [x, y] = [low.x + x as f32, low.y + y as f32];
                let inside = x >= 0.0 && y >= 0.0 && (x as usize) < width && (y as usize) < height;
                if inside {
                    let texel = &mut cover[y as usize * width + x as usize];
                    *texel = texel.max(share);
                }
            });
        }
        let cover = thickened(&cover, [width, height], thick);
        Self {
            sums: sums(&cover, [width, height]),
            size: [width, height],
            scale: f64::from(CAPITAL) / line.height_m,
            middle: f64::from(baseline - 0.5 * CAPITAL),
        }
    }

    /// Share of a square covered by glyphs, 0..=1. The square has edge `width` (m); its centre is `right` and `up`
    /// (m) from the centre of the line.
    pub fn share(&self, right: f64, up: f64, width: f64) -> f64 {
        if self.sums.is_empty() {
            return 0.0;
        }
        let [columns, rows] = self.size.map(|n| n as f64);
        let x = 0.5 * columns + right * self.scale;
        let y = self.middle - up * self.scale;
        let half = (0.5 * width * self.scale).max(0.5);
        if x + half <= 0.0 || y + half <= 0.0 || x - half >= columns || y - half >= rows {
            return 0.0;
        }
        let sum = self.sum(x + half, y + half) + self.sum(x - half, y - half)
            - self.sum(x + half, y - half)
            - self.sum(x - half, y + half);
        (sum / (4.0 * half * half)).clamp(0.0, 1.0)
    }

    /// Length of the line including its margins, m.
    pub fn length_m(&self) -> f64 {
        self.size[0] as f64 / self.scale.max(1e-9)
    }

    /// Sum over all texels above and to the left of (x, y), interpolated bilinearly.
    fn sum(&self, x: f64, y: f64) -> f64 {
        let [columns, rows] = self.size;
        let (x, y) = (x.clamp(0.0, columns as f64), y.clamp(0.0, rows as f64));
        let (i, j) = ((x as usize).min(columns.saturating_sub(1)), (y as usize).min(rows.saturating_sub(1)));
        let (u, v) = (x - i as f64, y - j as f64);
        let at = |i: usize, j: usize| self.sums[j * (columns + 1) + i];
        let top = at(i, j) * (1.0 - u) + at(i + 1, j) * u;
        let bottom = at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u;
        top * (1.0 - v) + bottom * v
    }
}

/// Scale at which a capital letter has its height in the raster.
fn scale_of(font: &FontRef) -> PxScale {
    PxScale::from(CAPITAL / capital(font))
}

/// Calls `place` with each letter of a line and the place where it begins, texels, from `start` on. Returns
/// where the line ends.
fn place_letters(line: &LabelLine, font: &FontRef, start: f32, mut place: impl FnMut(GlyphId, f32)) -> f32 {
    let scaled = font.as_scaled(scale_of(font));
    let thick = line.weight as f32 * CAPITAL;
    let (mut across, mut previous) = (start, None);
    for letter in line.text.chars() {
        let id = font.glyph_id(letter);
        across += previous.map_or(0.0, |previous| scaled.kern(previous, id) + thick);
        place(id, across);
        across += scaled.h_advance(id);
        previous = Some(id);
    }
    across
}

/// Height of a capital letter, in ems.
fn capital(font: &FontRef) -> f32 {
    let outline = font.outline_glyph(font.glyph_id('H').with_scale(PxScale::from(100.0)));
    outline.map_or(0.7, |outline| outline.px_bounds().height() / 100.0)
}

/// Dilates the strokes by half of `thick` texels on either side.
fn thickened(cover: &[f32], [width, height]: [usize; 2], thick: f32) -> Vec<f32> {
    let radius = 0.5 * thick;
    let reach = radius.ceil() as isize;
    let mut out = vec![0.0_f32; cover.len()];
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            // The centre has full weight even if the dilation is thinner than a texel.
            let away = (dx as f32).hypot(dy as f32);
            let share = if away == 0.0 { 1.0 } else { (radius + 0.5 - away).clamp(0.0, 1.0) };
            if share == 0.0 {
                continue;
            }
            let span = |n: usize, d: isize| (-d).max(0) as usize..(n as isize - d.max(0)).max(0) as usize;
            for y in span(height, dy) {
                for x in span(width, dx) {
                    let from = (y as isize + dy) as usize * width + (x as isize + dx) as usize;
                    let texel = &mut out[y * width + x];
                    *texel = texel.max(share * cover[from]);
                }
            }
        }
    }
    out
}

/// The summed-area table of a raster.
fn sums(cover: &[f32], [width, height]: [usize; 2]) -> Vec<f64> {
    let stride = width + 1;
    let mut sums = vec![0.0; stride * (height + 1)];
    for y in 0..height {
        let mut row = 0.0;
        for x in 0..width {
            row += f64::from(cover[y * width + x]);
            sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + row;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    fn letters(text: &str, weight: f64) -> TextDecal {
        TextDecal::new(LabelLine { text: text.into(), height_m: 0.01, weight, ..LabelLine::default() })
    }

    #[test]
    fn a_capital_letter_has_its_height_and_is_vertically_centred() {
        let decal = letters("H", 0.0);
        let lit = |up: f64| (-20..=20).any(|i| decal.coverage().share(f64::from(i) * 2e-4, up, 1e-4) > 0.5);
        assert!(lit(0.0) && lit(0.0047) && lit(-0.0047));
        assert!(!lit(0.0053) && !lit(-0.0053));
    }

    #[test]
    fn text_runs_to_the_right_and_is_centred() {
        let decal = letters("l.", 0.1);
        let left = decal.coverage().share(-1.5e-3, 0.002, 2e-3);
        let right = decal.coverage().share(1.5e-3, 0.002, 2e-3);
        assert!(left > 3.0 * right, "the l is left of the stop: {left} {right}");
    }

    #[test]
    fn the_length_of_a_line_is_that_of_its_raster_without_margins() {
        let decal = letters("softvt", 0.1);
        let margins = decal.coverage().length_m() - decal.line.length_m();
        assert!((0.0..0.004).contains(&margins), "{margins}");
    }

    #[test]
    fn mean_coverage_is_independent_of_the_size_of_the_squares() {
        let decal = letters("softvt", 0.08);
        let ink = |width: f64| {
            let steps = (0.08 / width) as i32;
            let at = |i: i32| (f64::from(i) + 0.5) * width - 0.04;
            let all = (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j)));
            all.map(|(i, j)| decal.coverage().share(at(i), at(j), width)).sum::<f64>() * width * width
        };
        let fine = ink(2.5e-4);
        assert!(fine > 1e-5, "{fine} m²");
        for width in [1e-3, 4e-3, 1.6e-2] {
            assert!((ink(width) / fine - 1.0).abs() < 1e-6, "{width}: {} of {fine}", ink(width));
        }
        assert!(
            fine > 1.2 * letters("softvt", 0.0).coverage().share(0.0, 0.0, 0.08) * 0.0064,
            "wider strokes"
        );
    }

    #[test]
    fn a_character_missing_from_the_typeface_is_found() {
        let line = |text: &str| LabelLine { text: text.into(), ..LabelLine::default() };
        assert_eq!(line("Käse & Öl").unsupported_char(), None);
        assert_eq!(line("ab漢").unsupported_char(), Some('漢'));
        assert_eq!(line("a\nb").unsupported_char(), Some('\n'));
    }
}
