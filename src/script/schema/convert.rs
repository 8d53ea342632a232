//! Conversion of checked Lua values to Rust types, and the declaration of records.

use std::{collections::BTreeMap, ops::Deref};

use mlua::{Function, Lua, Table, Value};

use super::{ApiObject, FieldDefault, Range, Record, Type, check::check};
use crate::vm::{error::fail, value::describe};
use softvt_geometry::Vec3;

/// Conversion of a checked Lua value. Unlike [`mlua::FromLua`], it can be implemented for types of other crates.
pub(crate) trait FromChecked: Sized {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self>;
}

/// A Rust type that checked Lua values convert to.
pub(crate) trait LuaType: FromChecked {
    /// The Lua type, where a declaration gives no narrower one.
    const TYPE: Type;
    /// The same, for lists and maps of it.
    const REFERENCE: &'static Type = &Self::TYPE;
    /// The value where none is given.
    const PRESENCE: FieldDefault = FieldDefault::Required;
    /// False if a parameter of this type reaches the function as the script gave it.
    const CHECKED: bool = true;
}

macro_rules! lua_types {
    ($($rust:ty => $ty:expr),+ $(,)?) => {$(
        impl FromChecked for $rust {
            fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
                lua.unpack(value)
            }
        }

        impl LuaType for $rust {
            const TYPE: Type = $ty;
        }
    )+};
}

lua_types! {
    f32 => Type::Number("", Range::ANY),
    f64 => Type::Number("", Range::ANY),
    i64 => Type::Integer(Range::ANY),
    i32 => Type::Integer(Range::closed(i32::MIN as f64, i32::MAX as f64)),
    u16 => Type::Integer(Range::closed(0.0, u16::MAX as f64)),
    u32 => Type::Integer(Range::closed(0.0, u32::MAX as f64)),
    u64 => Type::Integer(Range::NOT_NEGATIVE),
    usize => Type::Integer(Range::NOT_NEGATIVE),
    bool => Type::Boolean,
    String => Type::Text,
    mlua::LuaString => Type::Line,
    Function => Type::Function("fun()"),
    Table => Type::Table("table"),
    Value => Type::Any,
}

impl FromChecked for Vec3 {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        lua.unpack::<[f64; 3]>(value).map(Self::from)
    }
}

impl<const N: usize> FromChecked for [f64; N] {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        lua.unpack(value)
    }
}

impl<const N: usize> LuaType for [f64; N] {
    const TYPE: Type = Type::vector(N, "");
}

impl<T: ApiObject> FromChecked for T {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        lua.unpack(value)
    }
}

impl<T: ApiObject> LuaType for T {
    const TYPE: Type = Type::Object(T::NAME);
}

impl<T: FromChecked> FromChecked for Option<T> {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        if value.is_nil() { Ok(None) } else { T::from_checked(value, lua).map(Some) }
    }
}

impl<T: LuaType> LuaType for Option<T> {
    const TYPE: Type = T::TYPE;
    const PRESENCE: FieldDefault = FieldDefault::Optional;
}

impl<T: FromChecked> FromChecked for Vec<T> {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        lua.unpack::<Table>(value)?.sequence_values().map(|item| T::from_checked(item?, lua)).collect()
    }
}

impl<T: LuaType> LuaType for Vec<T> {
    const TYPE: Type = Type::List(T::REFERENCE);
}

impl<T: FromChecked> FromChecked for BTreeMap<String, T> {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let entry = |pair: mlua::Result<(String, Value)>| {
            let (key, value) = pair?;
            Ok((key, T::from_checked(value, lua)?))
        };
        lua.unpack::<Table>(value)?.pairs().map(entry).collect()
    }
}

impl<T: LuaType> LuaType for BTreeMap<String, T> {
    const TYPE: Type = Type::Map(T::REFERENCE);
}

/// An argument that the function checks itself.
pub(crate) struct Unchecked(pub Value);

impl FromChecked for Unchecked {
    fn from_checked(value: Value, _: &Lua) -> mlua::Result<Self> {
        Ok(Self(value))
    }
}

impl LuaType for Unchecked {
    const TYPE: Type = Type::Any;
    const CHECKED: bool = false;
}

/// A struct with a [`Record`], declared by [`record!`] or [`record_of!`].
pub(crate) trait RecordType: FromChecked {
    const RECORD: &'static Record;
    const RECORDS: &'static [&'static Record] = &[Self::RECORD];
}

/// A table that the constructor of `T` made. Reading one checks it again, since a script may have written to it.
#[derive(Clone, Debug)]
pub(crate) struct Constructed<T> {
    pub spec: T,
    /// The table itself, for messages about the place where it was made and for its identity.
    pub table: Table,
}

impl<T> Deref for Constructed<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.spec
    }
}

impl<T: RecordType> FromChecked for Constructed<T> {
    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let Value::Table(table) = &value else {
            return Err(fail(lua, format!("expected {}{{…}}, got {}", T::RECORD.kind, describe(&value))));
        };
        let checked = check(lua, T::RECORD, table).map_err(|error| {
            fail(lua, format!("{} (changed after it was made)", error.describe(T::RECORD.label)))
        })?;
        Ok(Self { spec: T::from_checked(Value::Table(checked), lua)?, table: table.clone() })
    }
}

impl<T: RecordType> LuaType for Constructed<T> {
    const TYPE: Type = Type::Constructed(T::RECORDS);
}

/// The first of the given expressions: what a declaration says, else a default.
macro_rules! first {
    ($first:expr $(, $rest:expr)* $(,)?) => {
        $first
    };
}
pub(crate) use first;

/// The result of a conversion from its converted fields: the struct with fields of these names, or what a
/// function makes of them.
macro_rules! made {
    ($lua:ident [$($field:ident)*]) => { Ok(Self { $($field),* }) };
    ($lua:ident [$($field:ident)*] $make:expr) => { $make($lua, $($field),*) };
}
pub(crate) use made;

/// The list of [`Field`](super::Field)s that a declaration describes.
macro_rules! fields {
    ($(
        $(#[doc = $doc:literal])+
        $field:ident : $rust:ty $(= $ty:expr)? $(=> $presence:ident $(($default:expr))?)? ;
    )*) => {
        &[$($crate::schema::Field {
            name: stringify!($field),
            ty: $crate::schema::convert::first!(
                $($ty,)? <$rust as $crate::schema::LuaType>::TYPE
            ),
            presence: $crate::schema::convert::first!(
                $($crate::schema::FieldDefault::$presence $(($default))?,)?
                <$rust as $crate::schema::LuaType>::PRESENCE
            ),
            doc: concat!($($doc),+),
        }),*]
    };
}
pub(crate) use fields;

/// Declares records.
///
/// ```text
/// record! {
///     /// Documentation of the record, for Rust, stubs and reference alike.
///     Name: "softvt.Class" as "label in messages", constructor "softvt.name", relation Increasing(&["a", "b"]) {
///         /// Documentation of the field.
///         field: RustType = Type::Number("m", Range::POSITIVE) => Number(1.0);
///     }
/// }
/// ```
///
/// The Lua type may be left out where [`LuaType`] of the Rust type says enough, and so may the default: an `Option` may
/// then be absent, and a nested record of which every field has a default. Constructor and
/// [`Relation`](super::Relation) are optional. Gives the struct with its conversion from a checked table
/// ([`FromChecked`]) and the [`Record`] by which tables are checked.
macro_rules! record {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident : $class:literal as $label:literal $(, constructor $kind:literal)? $(, relation $relation:ident($related:expr))? {$(
            $(#[doc = $field_doc:literal])+
            $field:ident : $rust:ty $(= $ty:expr)? $(=> $presence:ident $(($default:expr))?)? ;
        )*}
    )+) => {$(
        $(#[doc = $doc])+
        #[derive(Clone, Debug)]
        pub(crate) struct $name {
            $( $(#[doc = $field_doc])+ pub(crate) $field: $rust, )*
        }

        $crate::schema::record_of! {
            $(#[doc = $doc])+
            $name: $class as $label $(, constructor $kind)? $(, relation $relation($related))? {$(
                $(#[doc = $field_doc])+
                $field: $rust $(= $ty)? $(=> $presence $(($default))?)? ;
            )*}
        }
    )+};
}
pub(crate) use record;

/// Declares records whose struct is already defined: scripts then write such a struct as a table. The syntax is that of
/// [`record!`]. The struct has fields of the same names, or `by make;` at the end names the function that makes it from
/// the interpreter and the fields.
macro_rules! record_of {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident : $class:literal as $label:literal $(, constructor $kind:literal)? $(, relation $relation:ident($related:expr))? {$(
            $(#[doc = $field_doc:literal])+
            $field:ident : $rust:ty $(= $ty:expr)? $(=> $presence:ident $(($default:expr))?)? ;
        )*} $(by $make:expr ;)?
    )+) => {$(
        impl $crate::schema::RecordType for $name {
            const RECORD: &'static $crate::schema::Record = &$crate::schema::Record {
                label: $label,
                class: $class,
                kind: $crate::schema::convert::first!($($kind,)? $class),
                doc: concat!($($doc),+),
                fields: $crate::schema::convert::fields! {$(
                    $(#[doc = $field_doc])+
                    $field: $rust $(= $ty)? $(=> $presence $(($default))?)? ;
                )*},
                relation: $crate::schema::convert::first!(
                    $(Some($crate::schema::Relation::$relation($related)),)? None
                ),
            };
        }

        impl $crate::schema::FromChecked for $name {
            fn from_checked(value: mlua::Value, lua: &mlua::Lua) -> mlua::Result<Self> {
                let _table: mlua::Table = lua.unpack(value)?;
                $(let $field: $rust = $crate::schema::FromChecked::from_checked(
                    _table.raw_get(stringify!($field))?, lua
                )?;)*
                $crate::schema::convert::made!(lua [$($field)*] $($make)?)
            }
        }

        impl $crate::schema::LuaType for $name {
            const TYPE: $crate::schema::Type = $crate::schema::Type::Nested(
                <Self as $crate::schema::RecordType>::RECORD
            );
            const PRESENCE: $crate::schema::FieldDefault =
                <Self as $crate::schema::RecordType>::RECORD.presence();
        }
    )+};
}
pub(crate) use record_of;

/// Declares the strings that stand for the values of an enum: `choice! { Axis { "x" => X, … } }`. `enum Axis` instead
/// of `Axis` defines the enum too.
macro_rules! choice {
    ($(#[doc = $doc:literal])+ enum $name:ident { $($text:literal => $variant:ident),+ $(,)? }) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum $name { $($variant),+ }

        $crate::schema::choice! { $name { $($text => $variant),+ } }
    };
    ($name:ty { $($text:literal => $variant:ident),+ $(,)? }) => {
        impl $crate::schema::FromChecked for $name {
            fn from_checked(value: mlua::Value, lua: &mlua::Lua) -> mlua::Result<Self> {
                let text: String = lua.unpack(value)?;
                match text.as_str() {
                    $($text => Ok(Self::$variant),)+
                    other => Err($crate::vm::error::fail(lua, format!("unexpected {other:?}"))),
                }
            }
        }

        impl $crate::schema::LuaType for $name {
            const TYPE: $crate::schema::Type =
                $crate::schema::Type::Choice(&[$($text),+]);
        }

        impl $crate::schema::object::IntoFieldValue for $name {
            fn into_field_value(self, lua: &mlua::Lua) -> mlua::Result<$crate::schema::FieldValue> {
                match self { $(Self::$variant => $text,)+ }.into_field_value(lua)
            }
        }
    };
}
pub(crate) use choice;

/// A value that a constructor made.
pub(crate) trait HasTable {
    /// The table itself, for messages about the place where it was made.
    fn table(&self) -> &Table;
}

/// Declares an enum of tables that different constructors make: `one_of! { Goal { On(OnSpec), Inside(InsideSpec) } }`.
macro_rules! one_of {
    ($(#[doc = $doc:literal])* $name:ident { $($variant:ident($spec:ty)),+ $(,)? }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug)]
        pub(crate) enum $name {
            $($variant($crate::schema::Constructed<$spec>)),+
        }

        impl $crate::schema::FromChecked for $name {
            fn from_checked(value: mlua::Value, lua: &mlua::Lua) -> mlua::Result<Self> {
                let table: mlua::Table = lua.unpack(value)?;
                $(
                    if $crate::schema::is_constructed(
                        lua, <$spec as $crate::schema::RecordType>::RECORD, &table
                    ) {
                        let checked = $crate::schema::FromChecked::from_checked(mlua::Value::Table(table), lua);
                        return checked.map(Self::$variant);
                    }
                )+
                let expected = <Self as $crate::schema::LuaType>::TYPE.describe();
                Err($crate::vm::error::fail(lua, format!("expected {expected}, got a table")))
            }
        }

        impl $name {
            /// Records of the constructors.
            pub(crate) const RECORDS: &'static [&'static $crate::schema::Record] = &[
                $(<$spec as $crate::schema::RecordType>::RECORD),+
            ];
        }

        impl $crate::schema::convert::HasTable for $name {
            fn table(&self) -> &mlua::Table {
                match self { $(Self::$variant(made) => &made.table,)+ }
            }
        }

        impl $crate::schema::LuaType for $name {
            const TYPE: $crate::schema::Type = $crate::schema::Type::Constructed(Self::RECORDS);
        }
    };
}
pub(crate) use one_of;
