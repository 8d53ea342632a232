//! Tables that scripts receive.

use mlua::{Lua, Table, Value};

use crate::vm::value::describe;
use softvt_common::text::unknown_name;

/// Declares tables that scripts receive: the class for stubs and reference, and the function that fills such a table.
///
/// ```text
/// output! {
///     /// Documentation of the class.
///     fn name(lua, source: &Source) -> "softvt.Class" as "name in messages" {
///         /// Documentation of the field; a value of nil is absent.
///         field: "LuaCATS type" = value;
///     }
/// }
/// ```
///
/// The name of the function is also that of the module with the [`Class`]. Reading or writing another key is an error.
macro_rules! output {
    ($(
        $(#[doc = $doc:literal])+
        fn $name:ident($lua:ident $(, $arg:ident : $arg_type:ty)*) -> $class:literal as $label:literal {$(
            $(#[doc = $field_doc:literal])+
            $field:ident : $field_type:literal = $value:expr;
        )*}
    )+) => {$(
        $(#[doc = $doc])+
        pub(crate) fn $name($lua: &mlua::Lua $(, $arg: $arg_type)*) -> mlua::Result<mlua::Table> {
            let table = $lua.create_table()?;
            $(table.raw_set(stringify!($field), $value)?;)*
            $crate::schema::strict_table($lua, $label, table, vec![$(stringify!($field).to_owned()),*])
        }

        pub(crate) mod $name {
            pub(crate) static CLASS: $crate::schema::Class = $crate::schema::Class {
                name: $class,
                doc: concat!($($doc),+),
                fields: || vec![$($crate::schema::object::LuaField {
                    name: stringify!($field),
                    access: $crate::schema::object::Access::Read($field_type, None),
                    doc: concat!($($field_doc),+),
                }),*],
                methods: &[],
            };
        }
    )+};
}
pub(crate) use output;

/// Makes `table` refuse to be read and written by keys other than `names`.
pub(crate) fn strict_table(lua: &Lua, label: &str, table: Table, names: Vec<String>) -> mlua::Result<Table> {
    let meta = lua.create_table()?;
    let name = label.to_owned();
    let refuse = lua.create_function(move |lua, (table, key, value): (Table, Value, Value)| match &key {
        Value::String(key) if names.iter().any(|name| *name == key.to_string_lossy()) => {
            table.raw_set(key, value)?;
            Ok(Value::Nil)
        }
        Value::String(key) => {
            let known = names.iter().map(String::as_str);
            Err(fail!(lua, "{name}: {}", unknown_name("key", &key.to_string_lossy(), known)))
        }
        key => Err(fail!(lua, "{name}: expected a name as key, got {}", describe(key))),
    })?;
    // Lua asks the metatable only for keys without a value; reading a known one stores and returns nil.
    meta.set("__index", &refuse)?;
    meta.set("__newindex", refuse)?;
    meta.set("__metatable", label)?;
    table.set_metatable(Some(meta))?;
    Ok(table)
}
