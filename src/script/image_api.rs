//! Pictures in Lua: to look at, to measure and to put together.

use std::{
    io::Cursor,
    sync::atomic::{AtomicUsize, Ordering},
};

use image::{
    ImageFormat, Rgb, RgbImage,
    imageops::{self, FilterType},
};
use mlua::{Lua, MetaMethod, Table, UserData, UserDataFields, UserDataMethods, Value};

use super::{
    catalogue_world::{NEW_IMAGE, TEXT},
    sandbox::fail,
    schema,
};
use crate::report::film::Canvas;

/// Largest edge of a picture that a script may make, pixels.
const MOST_EDGE: f64 = 8192.0;
/// Bytes that all pictures of scripts may take together; the machine's own limit does not see them.
const MOST_BYTES: usize = 1 << 29;
/// Bytes that they take.
static HELD: AtomicUsize = AtomicUsize::new(0);

/// `softvt.Image`.
#[derive(Debug)]
pub(super) struct LuaImage(RgbImage);

impl LuaImage {
    /// Takes a picture into the machine.
    pub fn new(lua: &Lua, picture: RgbImage) -> mlua::Result<Self> {
        let bytes = picture.as_raw().len();
        if HELD.load(Ordering::Relaxed) + bytes > MOST_BYTES {
            lua.gc_collect()?;
        }
        if HELD.fetch_add(bytes, Ordering::Relaxed) + bytes > MOST_BYTES {
            HELD.fetch_sub(bytes, Ordering::Relaxed);
            let message =
                format!("the script holds more than {} MB of pictures; keep fewer", MOST_BYTES >> 20);
            return Err(fail(lua, message));
        }
        Ok(Self(picture))
    }
}

impl Drop for LuaImage {
    fn drop(&mut self) {
        HELD.fetch_sub(self.0.as_raw().len(), Ordering::Relaxed);
    }
}

/// Installs `softvt.image`.
pub(super) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    let make = lua.create_function(|lua, value: Value| {
        let Value::Table(table) = &value else {
            return Err(fail(lua, format!("softvt.image: expected a table, got {}", schema::got(&value))));
        };
        let spec = schema::check(lua, &NEW_IMAGE, table)
            .map_err(|fault| schema::fault_here(lua, "softvt.image", &fault))?;
        let ground = ink(spec.get("colour")?);
        LuaImage::new(lua, RgbImage::from_pixel(spec.get("width")?, spec.get("height")?, Rgb(ground)))
    })?;
    api.set("image", make)
}

/// A colour from numbers of 0 to 255.
fn ink(colour: [f64; 3]) -> [u8; 3] {
    colour.map(|c| c.clamp(0.0, 255.0).round() as u8)
}

/// The picture that a value is, if it is one.
pub(super) fn picture(value: &Value) -> Option<RgbImage> {
    value.as_userdata()?.borrow::<LuaImage>().ok().map(|image| image.0.clone())
}

/// A picture as a PNG file.
pub(super) fn png(picture: &RgbImage) -> Result<Vec<u8>, image::ImageError> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

impl LuaImage {
    /// A part of the picture: x, y, width, height; all of it if left out.
    fn region(&self, lua: &Lua, region: Option<[f64; 4]>) -> mlua::Result<[u32; 4]> {
        let (width, height) = self.0.dimensions();
        let Some(region) = region else { return Ok([0, 0, width, height]) };
        let [x, y, w, h] = region.map(|n| n as u32);
        let whole = region.iter().all(|n| n.fract() == 0.0 && (0.0..=MOST_EDGE).contains(n));
        if whole && w > 0 && h > 0 && x + w <= width && y + h <= height {
            return Ok([x, y, w, h]);
        }
        let message =
            format!("expected x, y, width, height within {width} × {height} pixels, got {region:?}");
        Err(fail(lua, format!("image: {message}")))
    }

    fn mean(&self, lua: &Lua, region: Option<[f64; 4]>) -> mlua::Result<[f64; 3]> {
        let [x, y, w, h] = self.region(lua, region)?;
        let mut sum = [0_u64; 3];
        for row in y..y + h {
            for column in x..x + w {
                let pixel = self.0.get_pixel(column, row);
                (0..3).for_each(|c| sum[c] += u64::from(pixel[c]));
            }
        }
        Ok(sum.map(|s| s as f64 / f64::from(w * h)))
    }

    fn resized(&self, lua: &Lua, width: f64, height: f64) -> mlua::Result<Self> {
        let fits = |n: f64| n.fract() == 0.0 && (1.0..=MOST_EDGE).contains(&n);
        if !fits(width) || !fits(height) {
            let message =
                format!("expected whole numbers of pixels in 1..{MOST_EDGE}, got {width} × {height}");
            return Err(fail(lua, format!("image:resize: {message}")));
        }
        Self::new(lua, imageops::resize(&self.0, width as u32, height as u32, FilterType::Triangle))
    }

    fn text(&mut self, lua: &Lua, text: &str, options: &Table) -> mlua::Result<()> {
        let spec = schema::check(lua, &TEXT, options)
            .map_err(|fault| schema::fault_here(lua, "image:text", &fault))?;
        let [x, y]: [f64; 2] = spec.get("at")?;
        let mut canvas = Canvas::of(&self.0);
        canvas.write(text, (x as f32, y as f32), spec.get("size")?, ink(spec.get("colour")?));
        self.0 = canvas.picture();
        Ok(())
    }
}

impl UserData for LuaImage {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.Image");
        fields.add_field_method_get("width", |_, this| Ok(this.0.width()));
        fields.add_field_method_get("height", |_, this| Ok(this.0.height()));
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_method(MetaMethod::ToString, |_, this, ()| {
            Ok(format!("softvt.Image({} × {})", this.0.width(), this.0.height()))
        });
        methods.add_method("mean", |lua, this, region: Option<[f64; 4]>| {
            lua.create_sequence_from(this.mean(lua, region)?)
        });
        methods.add_method("crop", |lua, this, region: [f64; 4]| {
            let [x, y, w, h] = this.region(lua, Some(region))?;
            Self::new(lua, imageops::crop_imm(&this.0, x, y, w, h).to_image())
        });
        methods
            .add_method("resize", |lua, this, (width, height): (f64, f64)| this.resized(lua, width, height));
        methods.add_method_mut("paste", |_, this, (other, x, y): (mlua::UserDataRef<Self>, f64, f64)| {
            imageops::replace(&mut this.0, &other.0, x.round() as i64, y.round() as i64);
            Ok(())
        });
        methods.add_method_mut("text", |lua, this, (text, options): (String, Table)| {
            this.text(lua, &text, &options)
        });
    }
}
