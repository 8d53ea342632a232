//! Touch: images and markers of the tactile sensors. The measures of markers come from [`MarkerFlow`].

use std::sync::Arc;

use mlua::{Lua, Table};

use super::image::LuaImage;
use crate::{
    policy::TactileFrame,
    script::schema::{
        FieldValue, Range, Type, class,
        object::{MEASURED, fixed_list},
        output,
    },
    sensing::tactile::{MarkerFlow, MarkerPositions, Markers},
};

/// Tactile frames of the left and the right finger at one control step.
pub(crate) type FingerReadings = Arc<[TactileFrame; 2]>;

const PIXELS: Type = Type::Number("px", Range::closed(0.0, 1e3));

/// `softvt.Touch`: a finger at one control step.
#[derive(Clone)]
pub(crate) struct LuaTouch {
    readings: FingerReadings,
    finger: usize,
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
        Self { flow: Arc::new(MarkerFlow::new(&markers)), markers: Arc::new(markers) }
    }
}

output! {
    /// The tactile sensors of both fingers at one control step.
    fn fingers(lua, readings: &FingerReadings) -> "softvt.Fingers" as "touch" {
        /// The left finger.
        left: "softvt.Touch" = LuaTouch { readings: readings.clone(), finger: 0 };
        /// The right finger.
        right: "softvt.Touch" = LuaTouch { readings: readings.clone(), finger: 1 };
    }
}

class! {
    /// The tactile sensor of a finger at one control step; docs/tactile.md draws its frames.
    LuaTouch: "softvt.Touch" {
        label(_) { "touch".to_owned() }
        fields {
            /// Colour image, 320 × 240.
            image: "softvt.Image" {
                get(lua, this) { userdata(lua, LuaImage::new(lua, this.readings[this.finger].image.clone())?)? }
            }
            /// Absolute difference of every channel from the image of the untouched gel.
            difference: "softvt.Image" {
                get(lua, this) { userdata(lua, LuaImage::new(lua, this.readings[this.finger].change())?)? }
            }
            /// The 11 × 9 markers.
            markers: "softvt.Markers" {
                get(lua, this) { userdata(lua, LuaMarkers::new(this.readings[this.finger].markers))? }
            }
        }
    }
}

fn userdata<T: mlua::UserData + Send + Sync + 'static>(lua: &Lua, value: T) -> mlua::Result<FieldValue> {
    lua.create_userdata(value).map(|data| FieldValue::Value(mlua::Value::UserData(data)))
}

/// Marker positions as a list of lists.
pub(crate) fn positions(lua: &Lua, places: &MarkerPositions) -> mlua::Result<Table> {
    lua.create_sequence_from(places.iter().map(|place| place.map(f64::from).to_vec()))
}

class! {
    /// The 99 markers of a finger, row by row, in px of its image: x to the right (towards the hand), y down. 1 px is
    /// 0.063 mm.
    LuaMarkers: "softvt.Markers" {
        label(_) { "markers".to_owned() }
        fields {
            /// Positions on the untouched gel.
            initial: "number[][]" { get(lua, this) { FieldValue::Fixed(positions(lua, &this.markers.initial)?, MEASURED) } }
            /// Present positions.
            present: "number[][]" { get(lua, this) { FieldValue::Fixed(positions(lua, &this.markers.current)?, MEASURED) } }
            /// Displacements.
            motion: "number[][]" {
                get(lua, this) { fixed_list(lua, this.flow.displacements.iter().map(|u| vec![u.x, u.y]), MEASURED)? }
            }
        }
        methods {
            /// Returns the mean displacement along x and y, which grows with shear along the gel's surface.
            fn mean(lua, this) -> ["number[]"] { lua.create_sequence_from(this.flow.mean())? }
            /// Returns the length of the longest displacement.
            fn largest(_, this) -> ["number"] { this.flow.max_displacement() }
            /// Returns the root mean square of the displacements without their mean and twist. It grows with the normal
            /// force: about 0.3 px per newton on round dough and rigid objects, less on flat and soft ones.
            fn press(_, this) -> ["number"] { this.flow.press() }
            /// Returns the mean displacement towards the fingertip or across, as of an object that slips out of the grasp;
            /// 0 if it is pushed in.
            fn drag(_, this) -> ["number"] { this.flow.drag() }
            /// Returns the trace of the displacement gradient; positive where an indentation pushes the markers outwards.
            fn divergence(_, this) -> ["number"] { this.flow.divergence() }
            /// Returns the rotation of the markers, rad; positive is clockwise in the image.
            fn twist(_, this) -> ["number"] { this.flow.twist() }
            /// Returns the pure shear of the markers: stretch along x against y, and along the diagonal x = y.
            fn shear(lua, this) -> ["number[]"] { lua.create_sequence_from(this.flow.shear())? }
            /// Returns the contact mask: true for markers displaced by more than px.
            fn moved(lua, this, px: f64 = PIXELS) -> ["boolean[]"] { lua.create_sequence_from(this.flow.moved(px))? }
            /// Returns the share of markers displaced by more than px; the whole image is 20.3 × 15.2 mm.
            fn area(_, this, px: f64 = PIXELS) -> ["number"] { this.flow.moved_share(px) }
        }
    }
}
