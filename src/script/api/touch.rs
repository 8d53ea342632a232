//! Touch in Lua: what a finger's sensor shows and what its markers say. The numbers come from [`MarkerFlow`].

use std::sync::Arc;

use mlua::{Lua, Table, UserDataMethods, Value};

use crate::script::{
    api::catalogue_classes::Class,
    api::catalogue_policy::{MARKERS, TOUCH},
    api::image::LuaImage,
    plan::options::strict,
    run::expert::Felt,
    schema::userdata::{Hosted, Read, hosted, method},
};
use crate::{
    policy::TactileFrame,
    sensing::tactile::{MarkerFlow, MarkerPositions, Markers},
};

const FINISHED: &str = "it is measured";

/// `softvt.Touch`: a finger at one control step.
#[derive(Clone)]
struct LuaTouch {
    felt: Felt,
    side: usize,
}

/// `softvt.Markers`.
#[derive(Clone)]
pub(crate) struct LuaMarkers {
    markers: Arc<Markers>,
    flow: Arc<MarkerFlow>,
}

impl LuaMarkers {
    /// The markers of one finger.
    pub(crate) fn new(markers: Markers) -> Self {
        Self { flow: Arc::new(MarkerFlow::of(&markers)), markers: Arc::new(markers) }
    }
}

/// Both fingers, as `{ left = softvt.Touch, right = softvt.Touch }`.
pub(crate) fn fingers(lua: &Lua, felt: &Felt) -> mlua::Result<Table> {
    let table = lua.create_table()?;
    for (side, name) in ["left", "right"].into_iter().enumerate() {
        table.set(name, LuaTouch { felt: felt.clone(), side })?;
    }
    strict(lua, "touch", table, ["left", "right"].map(str::to_owned).to_vec())
}

impl LuaTouch {
    fn frame(&self) -> &TactileFrame {
        &self.felt[self.side]
    }
}

impl Hosted for LuaTouch {
    fn class() -> &'static Class {
        &TOUCH
    }

    fn label(&self) -> String {
        "touch".into()
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        let frame = self.frame();
        let value = match key {
            "picture" => lua.create_userdata(LuaImage::new(lua, frame.image.clone())?)?,
            "change" => lua.create_userdata(LuaImage::new(lua, frame.change())?)?,
            _ => lua.create_userdata(LuaMarkers::new(frame.markers))?,
        };
        Ok(Read::Value(Value::UserData(value)))
    }

    fn methods<M: UserDataMethods<Self>>(_: &mut M) {}
}

/// Pairs of numbers as a list of lists.
fn pairs(lua: &Lua, pairs: impl Iterator<Item = [f64; 2]>) -> mlua::Result<Read> {
    let lists = pairs.map(|pair| lua.create_sequence_from(pair)).collect::<mlua::Result<Vec<_>>>()?;
    Ok(Read::Fixed(lua.create_sequence_from(lists)?, FINISHED.to_owned()))
}

fn places(places: &MarkerPositions) -> impl Iterator<Item = [f64; 2]> {
    places.iter().map(|place| place.map(f64::from))
}

impl Hosted for LuaMarkers {
    fn class() -> &'static Class {
        &MARKERS
    }

    fn label(&self) -> String {
        "markers".into()
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        match key {
            "initial" => pairs(lua, places(&self.markers.initial)),
            "present" => pairs(lua, places(&self.markers.current)),
            _ => pairs(lua, self.flow.displacements().iter().copied()),
        }
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "mean", |lua, this: &Self, ()| lua.create_sequence_from(this.flow.mean()));
        method(methods, "largest", |_, this: &Self, ()| Ok(this.flow.max_displacement()));
        method(methods, "press", |_, this: &Self, ()| Ok(this.flow.press()));
        method(methods, "drag", |_, this: &Self, ()| Ok(this.flow.drag()));
        method(methods, "divergence", |_, this: &Self, ()| Ok(this.flow.divergence()));
        method(methods, "twist", |_, this: &Self, ()| Ok(this.flow.twist()));
        method(methods, "shear", |lua, this: &Self, ()| lua.create_sequence_from(this.flow.shear()));
        method(methods, "moved", |lua, this: &Self, px: f64| lua.create_sequence_from(this.flow.moved(px)));
        method(methods, "area", |_, this: &Self, px: f64| Ok(this.flow.moved_share(px)));
    }
}

hosted!(LuaTouch, LuaMarkers);
