//! Functions and methods in Lua: their declarations, and the one place where arguments are taken.

use mlua::{Lua, MultiValue, Table, Value};

use super::{FieldDefault, Type, check, error_at_key};
use crate::vm::{error::fail, value::describe};
use softvt_common::text::counted;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Signature {
    pub name: &'static str,
    pub params: &'static [Param],
    pub returns: &'static [&'static str],
    pub doc: &'static str,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Param {
    pub name: &'static str,
    pub ty: Type,
    pub presence: FieldDefault,
    pub checked: bool,
}

impl Param {
    pub(crate) fn is_optional(&self) -> bool {
        self.presence != FieldDefault::Required
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Function {
    pub signature: Signature,
    pub call: fn(&Lua, MultiValue) -> mlua::Result<MultiValue>,
}

impl Function {
    /// Stores the function in `table`; messages name it with `prefix`.
    pub(crate) fn install(&'static self, lua: &Lua, table: &Table, prefix: &'static str) -> mlua::Result<()> {
        let function = lua.create_function(move |lua, values: MultiValue| {
            let label = format!("{prefix}{}", self.signature.name);
            (self.call)(lua, arguments(lua, &label, &self.signature, values)?)
        })?;
        table.set(self.signature.name, function)
    }
}

impl Signature {
    /// The record of a function that takes one table and nothing else.
    pub(crate) fn record(&self) -> Option<&'static super::Record> {
        match self.params {
            [Param { ty: Type::Nested(record), checked: true, .. }] => Some(record),
            _ => None,
        }
    }
}

/// Checks the arguments of a call, and fills in the defaults of tables. Unlike in Lua, more arguments are an error.
pub(crate) fn arguments(
    lua: &Lua,
    label: &str,
    signature: &Signature,
    values: impl IntoIterator<Item = Value>,
) -> mlua::Result<MultiValue> {
    let mut values = values.into_iter().fuse();
    let checked = signature.params.iter().map(|param| {
        let value = match (values.next().unwrap_or(Value::Nil), param.presence) {
            (value, _) if !param.checked => return Ok(value),
            (Value::Nil, FieldDefault::Optional) => return Ok(Value::Nil),
            (Value::Nil, FieldDefault::Empty) => Value::Table(lua.create_table()?),
            (value, _) => value,
        };
        check::checked(lua, label, |checker| checker.value(&param.ty, &value)).map_err(|error| {
            match param.ty {
                // The keys of a table say enough.
                Type::Nested(_) => error_at_key(lua, label, &error),
                _ => fail(lua, error.describe(&format!("{label}: {}", param.name))),
            }
        })
    });
    let checked = checked.collect::<mlua::Result<MultiValue>>()?;
    match values.find(|value| !value.is_nil()) {
        None => Ok(checked),
        Some(surplus) => {
            let expected = counted(signature.params.len(), "argument");
            Err(fail!(lua, "{label}: expected {expected}, got {} as well", describe(&surplus)))
        }
    }
}

/// Declares variables for the checked arguments of a call: the parameters, and the fields of the table that comes last.
macro_rules! bind_arguments {
    (($values:ident, $lua:ident) $($arg:ident : $arg_type:ty),*) => {
        $crate::schema::function::bind_arguments! { @each ($values, $lua) $($arg : $arg_type,)* }
    };
    (@each ($values:ident, $lua:ident) $($arg:ident : $arg_type:ty,)*) => {
        let mut _values = $values.into_iter();
        $(
            let $arg: $arg_type = $crate::schema::LuaType::from_checked(
                _values.next().unwrap_or(mlua::Value::Nil), $lua
            )?;
        )*
    };
    (($values:ident, $lua:ident) $($arg:ident : $arg_type:ty),* ; takes $table:ident {$(
        $(#[doc = $field_doc:literal])+
        $field:ident : $type:ty $(= $field_lua:expr)? $(=> $presence:ident $(($default:expr))?)? ;
    )*}) => {
        $crate::schema::function::bind_arguments! {
            @each ($values, $lua) $($arg : $arg_type,)* $table : mlua::Table,
        }
        $(
            let $field: $type = $crate::schema::LuaType::from_checked(
                $table.raw_get(stringify!($field))?, $lua
            )?;
        )*
    };
}
pub(crate) use bind_arguments;

macro_rules! signature {
    (
        [$($doc:literal)*] $name:ident($($arg:ident : $arg_type:ty $(= $arg_lua:expr)?),*)
        $(takes $table:ident $class:literal $fields:tt)?
        -> [$($return:literal),*]
    ) => {{
        const DOC: &str = concat!($($doc),*);
        $crate::schema::Signature {
            name: stringify!($name),
            params: &[
                $($crate::schema::function::Param {
                    name: stringify!($arg),
                    ty: $crate::schema::convert::first!(
                        $($arg_lua,)? <$arg_type as $crate::schema::LuaType>::TYPE
                    ),
                    presence: <$arg_type as $crate::schema::LuaType>::PRESENCE,
                    checked: <$arg_type as $crate::schema::LuaType>::CHECKED,
                },)*
                $({
                    const RECORD: &$crate::schema::Record = &$crate::schema::Record {
                        label: stringify!($name),
                        class: $class,
                        kind: $class,
                        doc: DOC,
                        fields: $crate::schema::convert::fields! $fields,
                        relation: None,
                    };
                    $crate::schema::function::Param {
                        name: stringify!($table),
                        ty: $crate::schema::Type::Nested(RECORD),
                        presence: RECORD.presence(),
                        checked: true,
                    }
                },)?
            ],
            returns: &[$($return),*],
            doc: DOC,
        }
    }};
}
pub(crate) use signature;

/// Declares a list of functions of the `softvt` table: `functions! { LIST { /// Documentation. fn name(lua,
/// argument: RustType = Type::…) -> ["LuaCATS type"] { … } } }`. As the methods of [`class!`](super::class), a
/// function can take a table.
macro_rules! functions {
    ($list:ident {$(
        $(#[doc = $doc:literal])+
        fn $name:ident($lua:pat_param $(, $arg:ident : $arg_type:ty $(= $arg_lua:expr)?)*)
            $(takes $table:ident $class:literal $fields:tt)?
            -> [$($return:literal),*] $body:block
    )*}) => {
        pub(crate) static $list: &[$crate::schema::Function] = &[$($crate::schema::Function {
            signature: $crate::schema::function::signature!(
                [$($doc)*] $name($($arg : $arg_type $(= $arg_lua)?),*)
                $(takes $table $class $fields)?
                -> [$($return),*]
            ),
            call: |state, values| {
                $crate::schema::function::bind_arguments! {
                    (values, state)
                    $($arg : $arg_type),*
                    $(; takes $table $fields)?
                }
                let $lua = state;
                mlua::IntoLuaMulti::into_lua_multi($body, state)
            },
        }),*];
    };
}
pub(crate) use functions;
