//! Conversion of checked Lua values to Rust types, and the declaration of records.

use std::{collections::BTreeMap, fmt::Display, ops::Deref};

use mlua::{Function, Lua, Table, Value};

use super::{ApiObject, FieldDefault, Range, Record, Type, check::Checker};
use crate::vm::{source_map::fail_at_key, value::describe};
use softvt_geometry::Vec3;

/// A Rust type, perhaps of another crate, that checked Lua values convert to.
pub(crate) trait LuaType: Sized {
    /// The Lua type, where a declaration gives no narrower one.
    const TYPE: Type;
    /// The same, for lists and maps of it.
    const REFERENCE: &'static Type = &Self::TYPE;
    const PRESENCE: FieldDefault = FieldDefault::Required;
    /// False if a parameter of this type reaches the function as the script gave it.
    const CHECKED: bool = true;

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self>;
}

macro_rules! lua_types {
    ($($rust:ty => $ty:expr $(; [$($generic:tt)+])?),+ $(,)?) => {$(
        impl $(<$($generic)+>)? LuaType for $rust {
            const TYPE: Type = $ty;

            fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
                lua.unpack(value)
            }
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
    [f64; N] => Type::vector(N, ""); [const N: usize],
    T => Type::Object(T::NAME); [T: ApiObject],
}

impl LuaType for Vec3 {
    const TYPE: Type = Type::vector(3, "");

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        lua.unpack::<[f64; 3]>(value).map(Self::from)
    }
}

impl<T: LuaType> LuaType for Option<T> {
    const TYPE: Type = T::TYPE;
    const PRESENCE: FieldDefault = FieldDefault::Optional;

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        if value.is_nil() { Ok(None) } else { T::from_checked(value, lua).map(Some) }
    }
}

impl<T: LuaType> LuaType for Vec<T> {
    const TYPE: Type = Type::List(T::REFERENCE);

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        lua.unpack::<Table>(value)?.sequence_values().map(|item| T::from_checked(item?, lua)).collect()
    }
}

impl<T: LuaType> LuaType for BTreeMap<String, T> {
    const TYPE: Type = Type::Map(T::REFERENCE);

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let entry = |pair: mlua::Result<(String, Value)>| {
            let (key, value) = pair?;
            Ok((key, T::from_checked(value, lua)?))
        };
        lua.unpack::<Table>(value)?.pairs().map(entry).collect()
    }
}

/// An argument that the function checks itself.
pub(crate) struct Unchecked(pub Value);

impl LuaType for Unchecked {
    const TYPE: Type = Type::Any;
    const CHECKED: bool = false;

    fn from_checked(value: Value, _: &Lua) -> mlua::Result<Self> {
        Ok(Self(value))
    }
}

/// A struct with a [`Record`], declared by [`record!`] or [`record_of!`].
pub(crate) trait RecordType: LuaType {
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

impl<T: RecordType> Constructed<T> {
    /// An error about the field `key`, at its line in the call that made the table.
    pub(crate) fn invalid(&self, lua: &Lua, key: &str, message: impl Display) -> mlua::Error {
        fail_at_key(lua, &self.table, key, format_args!("{}.{key}: {message}", T::RECORD.label))
    }
}

impl<T> Deref for Constructed<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.spec
    }
}

impl<T: RecordType> LuaType for Constructed<T> {
    const TYPE: Type = Type::Constructed(T::RECORDS);

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let Value::Table(table) = &value else {
            bail!(lua, "expected {}{{…}}, got {}", T::RECORD.kind, describe(&value));
        };
        let checked = Checker::new(lua)
            .record(T::RECORD, table)
            .map_err(|error| fail!(lua, "{} (changed after it was made)", error.describe(T::RECORD.label)))?;
        Ok(Self { spec: T::from_checked(Value::Table(checked), lua)?, table: table.clone() })
    }
}

/// The first of the given expressions: what a declaration says, else a default.
macro_rules! first {
    ($first:expr $(, $rest:expr)* $(,)?) => {
        $first
    };
}
pub(crate) use first;

/// The result of a conversion from its converted fields: the struct with fields of these names, or what an expression
/// makes of them.
macro_rules! made {
    ($lua:ident [$($field:ident)*]) => { Ok(Self { $($field),* }) };
    ($lua:ident [$($field:ident)*] |$own:pat_param| $make:expr) => {{
        let $own = $lua;
        $make
    }};
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

/// Declares records, tables that scripts write.
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
/// ([`LuaType`]) and the [`Record`] by which tables are checked.
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
/// [`record!`]. The struct has fields of the same names, or `by |lua| …;` at the end makes it from the fields.
macro_rules! record_of {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident : $class:literal as $label:literal $(, constructor $kind:literal)? $(, relation $relation:ident($related:expr))? {$(
            $(#[doc = $field_doc:literal])+
            $field:ident : $rust:ty $(= $ty:expr)? $(=> $presence:ident $(($default:expr))?)? ;
        )*} $(by |$own:pat_param| $make:expr ;)?
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

        impl $crate::schema::LuaType for $name {
            const TYPE: $crate::schema::Type = $crate::schema::Type::Nested(
                <Self as $crate::schema::RecordType>::RECORD
            );
            const PRESENCE: $crate::schema::FieldDefault =
                <Self as $crate::schema::RecordType>::RECORD.presence();

            fn from_checked(value: mlua::Value, lua: &mlua::Lua) -> mlua::Result<Self> {
                let _table: mlua::Table = lua.unpack(value)?;
                $(let $field: $rust = $crate::schema::LuaType::from_checked(
                    _table.raw_get(stringify!($field))?, lua
                )?;)*
                $crate::schema::convert::made!(lua [$($field)*] $(|$own| $make)?)
            }
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

        impl $name {
            pub(crate) fn name(self) -> &'static str {
                match self { $(Self::$variant => $text),+ }
            }
        }

        $crate::schema::choice! { $name { $($text => $variant),+ } }
    };
    ($name:ty { $($text:literal => $variant:ident),+ $(,)? }) => {
        impl $crate::schema::LuaType for $name {
            const TYPE: $crate::schema::Type = $crate::schema::Type::Choice(&[$($text),+]);

            fn from_checked(value: mlua::Value, lua: &mlua::Lua) -> mlua::Result<Self> {
                let text: String = lua.unpack(value)?;
                match text.as_str() {
                    $($text => Ok(Self::$variant),)+
                    other => Err(fail!(lua, "unexpected {other:?}")),
                }
            }
        }

        impl $crate::schema::object::IntoFieldValue for $name {
            fn into_field_value(self, lua: &mlua::Lua) -> mlua::Result<$crate::schema::FieldValue> {
                match self { $(Self::$variant => $text,)+ }.into_field_value(lua)
            }
        }
    };
}
pub(crate) use choice;

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

        impl $crate::schema::LuaType for $name {
            const TYPE: $crate::schema::Type = $crate::schema::Type::Constructed(Self::RECORDS);

            fn from_checked(value: mlua::Value, lua: &mlua::Lua) -> mlua::Result<Self> {
                let table: mlua::Table = lua.unpack(value)?;
                $(
                    if $crate::schema::is_constructed(
                        lua, <$spec as $crate::schema::RecordType>::RECORD, &table
                    ) {
                        let checked = $crate::schema::LuaType::from_checked(mlua::Value::Table(table), lua);
                        return checked.map(Self::$variant);
                    }
                )+
                let expected = <Self as $crate::schema::LuaType>::TYPE.describe();
                Err(fail!(lua, "expected {expected}, got a table"))
            }
        }

        impl $name {
            pub(crate) const RECORDS: &'static [&'static $crate::schema::Record] = &[
                $(<$spec as $crate::schema::RecordType>::RECORD),+
            ];
        }

        impl $crate::schema::convert::HasTable for $name {
            fn table(&self) -> &mlua::Table {
                match self { $(Self::$variant(made) => &made.table,)+ }
            }
        }
    };
}
pub(crate) use one_of;
