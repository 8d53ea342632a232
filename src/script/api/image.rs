//! Pictures in Lua: to look at, to measure and to put together.

use std::sync::{Arc, Mutex};

use image::{Rgb, RgbImage, imageops};
use mlua::{Lua, Table, UserDataMethods, Value};

use crate::script::{
    api::catalogue_classes::Class,
    api::catalogue_world::NEW_IMAGE,
    api::classes_world::{IMAGE, MOST_EDGE},
    schema,
    schema::userdata::{Hosted, Read, hosted, method},
    vm::memory_budget::{Held, hold},
    vm::{fail, locked},
};
use crate::{report::video::Canvas, sensing::camera::resize};

/// Longest text that is written on a picture, bytes.
const MOST_TEXT: usize = 1000;

/// `softvt.Image`.
#[derive(Clone, Debug)]
pub(crate) struct LuaImage(Arc<Mutex<Kept>>);

/// A picture and its share of the machine's memory.
#[derive(Debug)]
struct Kept {
    picture: RgbImage,
    _held: Held,
}

impl LuaImage {
    /// Takes a picture into the machine.
    pub(crate) fn new(lua: &Lua, picture: RgbImage) -> mlua::Result<Self> {
        let held = hold(lua, picture.as_raw().len())?;
        Ok(Self(Arc::new(Mutex::new(Kept { picture, _held: held }))))
    }

    /// Makes a picture of this size where there is room for it, and for `more` bytes while it is made.
    fn made(
        lua: &Lua,
        (width, height): (u32, u32),
        more: usize,
        make: impl FnOnce() -> RgbImage,
    ) -> mlua::Result<Self> {
        let held = hold(lua, 3 * width as usize * height as usize)?;
        let _while_made = hold(lua, more)?;
        Ok(Self(Arc::new(Mutex::new(Kept { picture: make(), _held: held }))))
    }
}

/// Installs `softvt.image`.
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    let make = lua.create_function(|lua, value: Value| {
        let spec = schema::checked(lua, &NEW_IMAGE, &value)?;
        let (ground, size) = (ink(spec.get("colour")?), (spec.get("width")?, spec.get("height")?));
        LuaImage::made(lua, size, 0, || RgbImage::from_pixel(size.0, size.1, Rgb(ground)))
    })?;
    api.set("image", make)
}

/// A colour from numbers of 0 to 255.
fn ink(colour: [f64; 3]) -> [u8; 3] {
    colour.map(|c| c.clamp(0.0, 255.0).round() as u8)
}

/// The picture that a value is, if it is one.
pub(crate) fn picture(value: &Value) -> Option<RgbImage> {
    value.as_userdata()?.borrow::<LuaImage>().ok().map(|image| locked(&image.0).picture.clone())
}

/// A part of a picture: x, y, width, height; all of it if left out.
fn part(lua: &Lua, method: &str, picture: &RgbImage, region: Option<[f64; 4]>) -> mlua::Result<[u32; 4]> {
    let (width, height) = picture.dimensions();
    let Some(region) = region else { return Ok([0, 0, width, height]) };
    let [x, y, w, h] = region.map(|n| n as u32);
    let whole = region.iter().all(|n| n.fract() == 0.0 && (0.0..=MOST_EDGE).contains(n));
    if whole && w > 0 && h > 0 && x + w <= width && y + h <= height {
        return Ok([x, y, w, h]);
    }
    let [x, y, w, h] = region.map(crate::text::format_number);
    let message =
        format!("expected x, y, width, height within {width} × {height} pixels, got {{{x}, {y}, {w}, {h}}}");
    Err(fail(lua, format!("image:{method}: region: {message}")))
}

impl LuaImage {
    fn mean(&self, lua: &Lua, region: Option<[f64; 4]>) -> mlua::Result<[f64; 3]> {
        let picture = &locked(&self.0).picture;
        let [x, y, w, h] = part(lua, "mean", picture, region)?;
        let mut sum = [0_u64; 3];
        for row in y..y + h {
            for column in x..x + w {
                let pixel = picture.get_pixel(column, row);
                (0..3).for_each(|c| sum[c] += u64::from(pixel[c]));
            }
        }
        Ok(sum.map(|s| s as f64 / (f64::from(w) * f64::from(h))))
    }

    fn pixel(&self, lua: &Lua, x: u32, y: u32) -> mlua::Result<[u8; 3]> {
        let picture = &locked(&self.0).picture;
        let (width, height) = picture.dimensions();
        picture.get_pixel_checked(x, y).map(|pixel| pixel.0).ok_or_else(|| {
            let message = format!("expected a pixel of {width} × {height}, got {x}, {y}; the first is 0, 0");
            fail(lua, format!("image:pixel: {message}"))
        })
    }

    fn crop(&self, lua: &Lua, region: [f64; 4]) -> mlua::Result<Self> {
        let picture = &locked(&self.0).picture;
        let [x, y, w, h] = part(lua, "crop", picture, Some(region))?;
        Self::made(lua, (w, h), 0, || imageops::crop_imm(picture, x, y, w, h).to_image())
    }

    fn resized(&self, lua: &Lua, width: u32, height: u32) -> mlua::Result<Self> {
        let picture = &locked(&self.0).picture;
        // The picture on the way is as wide as the new one and as tall as the old one.
        let between = 3 * width as usize * picture.height() as usize;
        Self::made(lua, (width, height), between, || resize(picture, width, height))
    }

    fn paste(&self, other: &Self, x: f64, y: f64) {
        // Of itself a picture takes a copy first: it cannot be read while it is written.
        let (other, itself) = match Arc::ptr_eq(&self.0, &other.0) {
            true => (None, Some(locked(&self.0).picture.clone())),
            false => (Some(locked(&other.0)), None),
        };
        let source = other.as_ref().map(|kept| &kept.picture).or(itself.as_ref());
        if let Some(source) = source {
            imageops::replace(&mut locked(&self.0).picture, source, x.round() as i64, y.round() as i64);
        }
    }

    fn write_text(&self, lua: &Lua, text: &str, how: &Table) -> mlua::Result<()> {
        let [x, y]: [f64; 2] = how.get("at")?;
        if x.abs().max(y.abs()) > 1e5 {
            return Err(fail(lua, "image:text.at: expected pixels within ±100000".to_owned()));
        }
        if text.len() > MOST_TEXT {
            let message = format!("image:text: text: expected at most {MOST_TEXT} bytes, got {}", text.len());
            return Err(fail(lua, message));
        }
        let picture = &mut locked(&self.0).picture;
        // The canvas has four bytes a pixel, and gives a picture of three.
        let _while_written = hold(lua, 7 * picture.width() as usize * picture.height() as usize)?;
        let mut canvas = Canvas::from_image(picture);
        canvas.write(text, x as f32, y as f32, how.get("size")?, ink(how.get("colour")?));
        *picture = canvas.to_image();
        Ok(())
    }
}

impl Hosted for LuaImage {
    fn class() -> &'static Class {
        &IMAGE
    }

    fn label(&self) -> String {
        "image".into()
    }

    fn text(&self) -> String {
        let (width, height) = locked(&self.0).picture.dimensions();
        format!("softvt.Image({width} × {height})")
    }

    fn read(&self, _: &Lua, key: &str) -> mlua::Result<Read> {
        let (width, height) = locked(&self.0).picture.dimensions();
        Ok(Read::Value(Value::Integer(i64::from(if key == "width" { width } else { height }))))
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "mean", |lua, this: &Self, region: Option<[f64; 4]>| {
            lua.create_sequence_from(this.mean(lua, region)?)
        });
        method(methods, "pixel", |lua, this: &Self, (x, y): (u32, u32)| {
            lua.create_sequence_from(this.pixel(lua, x, y)?)
        });
        method(methods, "crop", |lua, this: &Self, region: [f64; 4]| this.crop(lua, region));
        method(methods, "resize", |lua, this: &Self, (width, height): (u32, u32)| {
            this.resized(lua, width, height)
        });
        method(methods, "paste", |_, this: &Self, (other, x, y): (mlua::UserDataRef<Self>, f64, f64)| {
            this.paste(&other, x, y);
            Ok(())
        });
        method(methods, "text", |lua, this: &Self, (text, how): (mlua::LuaString, Table)| {
            this.write_text(lua, &text.to_string_lossy(), &how)
        });
    }
}

hosted!(LuaImage);
