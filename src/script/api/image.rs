//! Images: to view, measure and compose.

use std::sync::{Arc, Mutex};

use image::{Rgb, RgbImage, imageops};
use mlua::{Lua, LuaString, Value};

use crate::{
    schema::{Range, Type, class, functions},
    vm::memory_budget::{Reservation, reserve},
};
use softvt_common::{parallel::lock, text::format_number};
use softvt_media::canvas::Canvas;
use softvt_sensing::camera::resize;

/// Largest edge of an image that a script may make, pixels.
const MAX_EDGE: f64 = 8192.0;
const EDGE: Type = Type::Integer(Range::closed(1.0, MAX_EDGE));
const PIXEL: Type = Type::Integer(Range::closed(0.0, MAX_EDGE));
const REGION: Type = Type::vector(4, "x, y, width, height in pixels");
/// Position of text or of an image that is pasted, pixels.
const OFFSET: Range = Range::closed(-1e5, 1e5);
const SRGB: Type = Type::vector(3, "sRGB of 0 to 255");

#[derive(Clone, Debug)]
pub(crate) struct LuaImage(Arc<Mutex<ImageContent>>);

#[derive(Debug)]
struct ImageContent {
    image: RgbImage,
    _reserved: Reservation,
}

impl LuaImage {
    pub(crate) fn new(lua: &Lua, image: RgbImage) -> mlua::Result<Self> {
        let reserved = reserve(lua, image.as_raw().len())?;
        Ok(Self(Arc::new(Mutex::new(ImageContent { image, _reserved: reserved }))))
    }

    fn paste(&self, other: &Self, x: f64, y: f64) {
        // An image pasted on itself is copied first: it cannot be read while it is written.
        let source = lock(&other.0).image.clone();
        imageops::replace(&mut lock(&self.0).image, &source, x.round() as i64, y.round() as i64);
    }
}

/// A copy of the image that a value is, if it is one.
pub(crate) fn image_of(value: &Value) -> Option<RgbImage> {
    value.as_userdata()?.borrow::<LuaImage>().ok().map(|image| lock(&image.0).image.clone())
}

fn srgb(colour: [f64; 3]) -> [u8; 3] {
    colour.map(|c| c.clamp(0.0, 255.0).round() as u8)
}

/// A part of an image, pixels.
#[derive(Clone, Copy)]
struct ImageRegion {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

/// Checks a region x, y, width, height of an image; the whole image by default.
fn part(lua: &Lua, method: &str, image: &RgbImage, region: Option<[f64; 4]>) -> mlua::Result<ImageRegion> {
    let (width, height) = image.dimensions();
    let Some(region) = region else { return Ok(ImageRegion { x: 0, y: 0, width, height }) };
    let [x, y, w, h] = region.map(|n| n as u32);
    let is_whole = region.iter().all(|n| n.fract() == 0.0 && (0.0..=MAX_EDGE).contains(n));
    if is_whole && w > 0 && h > 0 && x + w <= width && y + h <= height {
        return Ok(ImageRegion { x, y, width: w, height: h });
    }
    let got = region.map(format_number).join(", ");
    let message = format!("expected x, y, width, height within {width} × {height} pixels, got {{{got}}}");
    Err(fail!(lua, "image:{method}: region: {message}"))
}

functions! {
    FUNCTIONS {
        /// Returns an image of one colour: `softvt.image { width = 640, height = 480, colour = { 255, 255, 255 } }`.
        fn image(lua) takes spec "softvt.NewImage" {
            /// Width, pixels.
            width: u32 = EDGE;
            /// Height, pixels.
            height: u32 = EDGE;
            /// Colour of every pixel.
            colour: [f64; 3] = SRGB;
        } -> ["softvt.Image"] {
            LuaImage::new(lua, RgbImage::from_pixel(width, height, Rgb(srgb(colour))))?
        }
    }
}

class! {
    /// An image of 8-bit sRGB pixels. Regions are x, y, width, height in pixels from the top left.
    LuaImage: "softvt.Image" {
        label(_) { "image".to_owned() }
        text(this) {
            let (width, height) = lock(&this.0).image.dimensions();
            format!("softvt.Image({width} × {height})")
        }
        fields {
            /// Width, pixels.
            width: "integer" { get(_, this) { lock(&this.0).image.width() } }
            /// Height, pixels.
            height: "integer" { get(_, this) { lock(&this.0).image.height() } }
        }
        methods {
            /// Returns the mean red, green and blue of a region, or of the whole image, 0..255.
            fn mean(lua, this, region: Option<[f64; 4]> = REGION) -> ["number[]"] {
                let image = &lock(&this.0).image;
                let part = part(lua, "mean", image, region)?;
                let mut sum = [0_u64; 3];
                for row in part.y..part.y + part.height {
                    for column in part.x..part.x + part.width {
                        let pixel = image.get_pixel(column, row);
                        (0..3).for_each(|c| sum[c] += u64::from(pixel[c]));
                    }
                }
                let count = f64::from(part.width) * f64::from(part.height);
                lua.create_sequence_from(sum.map(|s| s as f64 / count))?
            }
            /// Returns red, green and blue of a pixel, 0..255; the top left pixel is 0, 0.
            fn pixel(lua, this, x: u32 = PIXEL, y: u32 = PIXEL) -> ["number[]"] {
                let image = &lock(&this.0).image;
                let Some(pixel) = image.get_pixel_checked(x, y) else {
                    let (width, height) = image.dimensions();
                    let message = format!("expected a pixel of {width} × {height}, got {x}, {y}; the first is 0, 0");
                    bail!(lua, "image:pixel: {message}");
                };
                lua.create_sequence_from(pixel.0)?
            }
            /// Returns a region as an image of its own.
            fn crop(lua, this, region: [f64; 4] = REGION) -> ["softvt.Image"] {
                let image = &lock(&this.0).image;
                let ImageRegion { x, y, width, height } = part(lua, "crop", image, Some(region))?;
                LuaImage::new(lua, imageops::crop_imm(image, x, y, width, height).to_image())?
            }
            /// Returns the image in another size.
            fn resize(lua, this, width: u32 = EDGE, height: u32 = EDGE) -> ["softvt.Image"] {
                LuaImage::new(lua, resize(&lock(&this.0).image, width, height))?
            }
            /// Copies another image onto this one, with its top left pixel at x, y.
            fn paste(_, this, other: LuaImage, x: f64 = Type::Number("pixels", OFFSET), y: f64 = Type::Number("pixels", OFFSET)) -> [] { this.paste(&other, x, y) }
            /// Writes a line of text on the image.
            fn text(_, this, text: LuaString = Type::Line) takes style "softvt.Text" {
                /// Left end of its baseline, from the top left.
                at: [f64; 2] = Type::Vector(2, "pixels", OFFSET);
                /// Height of the letters.
                size: f32 = Type::Number("pixels", Range::closed(4.0, 200.0)) => Number(18.0);
                /// Colour of the letters.
                colour: [f64; 3] = SRGB;
            } -> [] {
                let image = &mut lock(&this.0).image;
                let mut canvas = Canvas::from_image(image);
                canvas.write(&text.to_string_lossy(), at[0] as f32, at[1] as f32, size, srgb(colour));
                *image = canvas.to_image();
            }
        }
    }
}
