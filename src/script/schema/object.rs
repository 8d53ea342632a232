//! Objects of the host in Lua, tables that it returns, and functions: their declarations, and the one place where arguments
//! are taken and fields are read and written.

use mlua::{IntoLua, Lua, MetaMethod, MultiValue, Table, UserData, UserDataFields, UserDataMethods, Value};

use super::{FieldDefault, Type, error_at_key, make};
use crate::{
    geometry::Vec3,
    script::vm::{error::fail, list::LuaList, value::describe},
    text::unknown_name,
};

/// A class of objects or of tables that scripts receive: the part that stubs, reference and messages need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Class {
    /// `softvt.Rng`.
    pub name: &'static str,
    pub doc: &'static str,
    pub fields: &'static [LuaField],
    pub methods: &'static [Signature],
}

/// A field of a class.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LuaField {
    pub name: &'static str,
    pub access: Access,
    pub doc: &'static str,
}

/// Use of a field by scripts.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Access {
    /// Read-only, with its LuaCATS type, and how to change it instead.
    Read(&'static str, Option<&'static str>),
    Write(Type),
}

/// A function or method.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Signature {
    pub name: &'static str,
    pub params: &'static [Param],
    /// LuaCATS types of the results.
    pub returns: &'static [&'static str],
    pub doc: &'static str,
}

/// A parameter; its argument is checked by its type.
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

impl Class {
    /// `camera` of `softvt.Camera`.
    pub(crate) fn short_name(&self) -> &'static str {
        self.name.rsplit('.').next().unwrap_or(self.name)
    }

    fn keys(&self) -> impl Iterator<Item = &'static str> + Clone + use<> {
        self.fields.iter().map(|field| field.name).chain(self.methods.iter().map(|method| method.name))
    }

    fn field(&self, name: &str) -> Option<usize> {
        self.fields.iter().position(|field| field.name == name)
    }

    /// The error for a name that is neither a field nor a method.
    pub(crate) fn unknown_key_error(&self, lua: &Lua, label: &str, key: &str) -> mlua::Error {
        match self.keys().next() {
            Some(_) => fail(lua, format!("{label}: {}", unknown_name("key", key, self.keys()))),
            None => fail(lua, format!("{label}: has no key {key:?}")),
        }
    }

    /// The error for a method called without its object: most often a point was written for a colon.
    pub(crate) fn missing_self_error(&self, lua: &Lua, method: &str, first: &Value) -> mlua::Error {
        let (short, got) = (self.short_name().to_lowercase(), describe(first));
        let message = format!(
            "{short}:{method}: expected a {} before the colon, got {got}; call it as {short}:{method}(…)",
            self.name
        );
        fail(lua, message)
    }
}

/// The value of a field of an object.
pub(crate) enum FieldValue {
    Value(Value),
    /// Numbers that scripts may write one by one.
    Numbers(Vec<f64>),
    /// A list that cannot be written, and how to change it instead.
    Fixed(Table, &'static str),
}

/// Results of getters.
pub(crate) trait IntoFieldValue {
    fn into_field_value(self, lua: &Lua) -> mlua::Result<FieldValue>;
}

impl IntoFieldValue for FieldValue {
    fn into_field_value(self, _: &Lua) -> mlua::Result<FieldValue> {
        Ok(self)
    }
}

impl IntoFieldValue for Vec3 {
    fn into_field_value(self, _: &Lua) -> mlua::Result<FieldValue> {
        Ok(FieldValue::Numbers(self.as_slice().to_vec()))
    }
}

impl<const N: usize> IntoFieldValue for [f64; N] {
    fn into_field_value(self, _: &Lua) -> mlua::Result<FieldValue> {
        Ok(FieldValue::Numbers(self.to_vec()))
    }
}

macro_rules! plain_field_values {
    ($($ty:ty),+) => { $(
        impl IntoFieldValue for $ty {
            fn into_field_value(self, lua: &Lua) -> mlua::Result<FieldValue> {
                self.into_lua(lua).map(FieldValue::Value)
            }
        }
    )+ };
}

plain_field_values!(f64, Option<f64>, usize, u32, bool, &str, String, Value, Table);

/// A list that cannot be written; `hint` says how to change it instead.
pub(crate) fn fixed_list<T: IntoLua>(
    lua: &Lua,
    entries: impl IntoIterator<Item = T>,
    hint: &'static str,
) -> mlua::Result<FieldValue> {
    Ok(FieldValue::Fixed(lua.create_sequence_from(entries)?, hint))
}

/// Hint of [`fixed_list`] for measured values.
pub(crate) const MEASURED: &str = "it is measured";

type Getter<T> = fn(&Lua, &T) -> mlua::Result<FieldValue>;
type Setter<T> = fn(&Lua, &T, Value) -> mlua::Result<()>;
type Body<T> = fn(&Lua, &T, MultiValue) -> mlua::Result<MultiValue>;

/// An object that scripts hold: a cheap handle. Declared by [`class!`].
pub(crate) trait ApiObject: Clone + Send + Sync + UserData + 'static {
    const CLASS: &'static Class;
    /// One per field of the class.
    const GETTERS: &'static [Getter<Self>];
    /// One per field of the class; `None` for those that are read-only.
    const SETTERS: &'static [Option<Setter<Self>>];
    /// One per method of the class that is not implemented in Lua.
    const METHODS: &'static [Body<Self>];

    /// Name in messages: `scene:camera("wrist")`.
    fn label(&self) -> String;

    /// Result of `tostring`.
    fn text(&self) -> String {
        Self::CLASS.name.to_owned()
    }
}

/// Declares a class of objects: the documentation, type and accessors of every field, and every method.
///
/// ```text
/// class! {
///     /// Documentation of the class.
///     RustType: "softvt.Class" {
///         label(this) { "name in messages".to_owned() }
///         text(this) { … }                                     // optional: the result of tostring
///         fields {                                             // read-only
///             /// Documentation.
///             name: "LuaCATS type" { get(lua, this) { … } }
///         }
///         writable {
///             /// Documentation.
///             name: Type::… { get(lua, this) { … } set(lua, this, value: RustType) { … } }
///         }
///         methods {
///             /// Documentation; of a method that takes one record, that of the record if left out.
///             fn name(lua, this, argument: RustType = Type::…) -> ["LuaCATS type"] { … }
///         }
///         lua_methods {                                        // implemented in Lua, with arguments checked by `arguments`
///             /// Documentation.
///             fn name(argument: RustType) -> ["LuaCATS type"];
///         }
///     }
/// }
/// ```
///
/// Bodies may use `?` on [`mlua::Result`].
macro_rules! class {
    (
        $(#[doc = $doc:literal])+
        $object:ty : $class:literal {
            label($label_this:pat_param) $label:block
            $(text($text_this:pat_param) $text:block)?
            $(fields {$(
                $(#[doc = $read_doc:literal])+
                $read:ident : $read_type:literal $(or $hint:literal)? {
                    get($read_lua:pat_param, $read_this:pat_param) $read_get:block
                }
            )*})?
            $(writable {$(
                $(#[doc = $write_doc:literal])+
                $write:ident : $write_type:expr => {
                    get($get_lua:pat_param, $get_this:pat_param) $get:block
                    set($set_lua:pat_param, $set_this:pat_param, $value:ident : $value_type:ty) $set:block
                }
            )*})?
            $(methods {$(
                $(#[doc = $method_doc:literal])*
                fn $method:ident($method_lua:pat_param, $method_this:pat_param $(, $arg:ident : $arg_type:ty $(= $arg_lua:expr)?)*)
                    -> [$($return:literal),*] $body:block
            )*})?
            $(lua_methods {$(
                $(#[doc = $lua_method_doc:literal])+
                fn $lua_method:ident($($lua_arg:ident : $lua_arg_type:ty $(= $lua_arg_lua:expr)?),*)
                    -> [$($lua_return:literal),*];
            )*})?
        }
    ) => {
        impl $crate::script::schema::ApiObject for $object {
            const CLASS: &'static $crate::script::schema::Class = &$crate::script::schema::Class {
                name: $class,
                doc: concat!($($doc),+),
                fields: &[
                    $($($crate::script::schema::object::LuaField {
                        name: stringify!($read),
                        access: $crate::script::schema::object::Access::Read(
                            $read_type,
                            $crate::script::schema::convert::first!($(Some($hint),)? None),
                        ),
                        doc: concat!($($read_doc),+),
                    },)*)?
                    $($($crate::script::schema::object::LuaField {
                        name: stringify!($write),
                        access: $crate::script::schema::object::Access::Write($write_type),
                        doc: concat!($($write_doc),+),
                    },)*)?
                ],
                methods: &[
                    $($($crate::script::schema::object::signature!(
                        [$($method_doc)*] $method($($arg : $arg_type $(= $arg_lua)?),*) -> [$($return),*]
                    ),)*)?
                    $($($crate::script::schema::object::signature!(
                        [$($lua_method_doc)+] $lua_method($($lua_arg : $lua_arg_type $(= $lua_arg_lua)?),*)
                            -> [$($lua_return),*]
                    ),)*)?
                ],
            };
            const GETTERS: &'static [fn(&mlua::Lua, &Self) -> mlua::Result<$crate::script::schema::FieldValue>] = &[
                $($(|state: &mlua::Lua, object: &Self| -> mlua::Result<$crate::script::schema::FieldValue> {
                    let ($read_lua, $read_this) = (state, object);
                    $crate::script::schema::object::IntoFieldValue::into_field_value($read_get, state)
                },)*)?
                $($(|state: &mlua::Lua, object: &Self| -> mlua::Result<$crate::script::schema::FieldValue> {
                    let ($get_lua, $get_this) = (state, object);
                    $crate::script::schema::object::IntoFieldValue::into_field_value($get, state)
                },)*)?
            ];
            const SETTERS: &'static [Option<fn(&mlua::Lua, &Self, mlua::Value) -> mlua::Result<()>>] = &[
                $($({ let _ = stringify!($read); None },)*)?
                $($(Some(|state: &mlua::Lua, object: &Self, value: mlua::Value| -> mlua::Result<()> {
                    let $value: $value_type = mlua::FromLua::from_lua(value, state)?;
                    let ($set_lua, $set_this) = (state, object);
                    $set
                    Ok(())
                }),)*)?
            ];
            const METHODS: &'static [fn(&mlua::Lua, &Self, mlua::MultiValue) -> mlua::Result<mlua::MultiValue>] = &[
                $($(|state: &mlua::Lua, object: &Self, values: mlua::MultiValue| -> mlua::Result<mlua::MultiValue> {
                    let ($($arg,)*): ($($arg_type,)*) = mlua::FromLuaMulti::from_lua_multi(values, state)?;
                    let ($method_lua, $method_this) = (state, object);
                    mlua::IntoLuaMulti::into_lua_multi($body, state)
                },)*)?
            ];

            fn label(&self) -> String {
                let $label_this = self;
                $label
            }

            $(fn text(&self) -> String {
                let $text_this = self;
                $text
            })?
        }

        impl mlua::UserData for $object {
            fn add_fields<F: mlua::UserDataFields<Self>>(fields: &mut F) {
                $crate::script::schema::object::add_fields::<Self, F>(fields);
            }

            fn add_methods<M: mlua::UserDataMethods<Self>>(methods: &mut M) {
                $crate::script::schema::object::add_methods(methods);
            }
        }
    };
}
pub(crate) use class;

/// The [`Signature`] of a function or method.
macro_rules! signature {
    ([$($doc:literal)*] $name:ident($($arg:ident : $arg_type:ty $(= $arg_lua:expr)?),*) -> [$($return:literal),*]) => {
        $crate::script::schema::Signature {
            name: stringify!($name),
            params: &[$($crate::script::schema::object::Param {
                name: stringify!($arg),
                ty: $crate::script::schema::convert::first!(
                    $($arg_lua,)? <$arg_type as $crate::script::schema::LuaType>::TYPE
                ),
                presence: <$arg_type as $crate::script::schema::LuaType>::PRESENCE,
                checked: <$arg_type as $crate::script::schema::LuaType>::CHECKED,
            }),*],
            returns: &[$($return),*],
            doc: concat!($($doc),*),
        }
    };
}
pub(crate) use signature;

/// A function of the `softvt` table.
#[derive(Clone, Copy)]
pub(crate) struct Function {
    pub signature: Signature,
    call: fn(&Lua, MultiValue) -> mlua::Result<MultiValue>,
}

impl Function {
    pub(crate) const fn new(
        signature: Signature,
        call: fn(&Lua, MultiValue) -> mlua::Result<MultiValue>,
    ) -> Self {
        Self { signature, call }
    }

    /// Stores the function in `table`; messages name it with `prefix`.
    pub(crate) fn install(&'static self, lua: &Lua, table: &Table, prefix: &'static str) -> mlua::Result<()> {
        let function = lua.create_function(move |lua, values: MultiValue| {
            // The record of a function that takes one names the function.
            let label = match self.signature.record() {
                Some(record) => record.label.to_owned(),
                None => format!("{prefix}{}", self.signature.name),
            };
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

    /// Its documentation, or that of its record.
    pub(crate) fn doc(&self) -> &'static str {
        match self.record() {
            Some(record) if self.doc.is_empty() => record.doc.trim(),
            _ => self.doc.trim(),
        }
    }
}

/// Declares a list of functions of the `softvt` table: `functions! { LIST { /// Documentation. fn name(lua, argument: RustType =
/// Type::…) -> ["LuaCATS type"] { … } } }`.
macro_rules! functions {
    ($list:ident {$(
        $(#[doc = $doc:literal])*
        fn $name:ident($lua:pat_param $(, $arg:ident : $arg_type:ty $(= $arg_lua:expr)?)*) -> [$($return:literal),*] $body:block
    )*}) => {
        pub(crate) static $list: &[$crate::script::schema::Function] = &[$($crate::script::schema::Function::new(
            $crate::script::schema::object::signature!(
                [$($doc)*] $name($($arg : $arg_type $(= $arg_lua)?),*) -> [$($return),*]
            ),
            |state: &mlua::Lua, values: mlua::MultiValue| -> mlua::Result<mlua::MultiValue> {
                let ($($arg,)*): ($($arg_type,)*) = mlua::FromLuaMulti::from_lua_multi(values, state)?;
                let $lua = state;
                mlua::IntoLuaMulti::into_lua_multi($body, state)
            },
        )),*];
    };
}
pub(crate) use functions;

/// A function `softvt.name{…}` that checks and marks a table.
#[derive(Clone, Copy)]
pub(crate) struct LuaConstructor {
    pub record: &'static super::Record,
    make: fn(&Lua, &'static super::Record, &Value) -> mlua::Result<Table>,
}

impl LuaConstructor {
    /// A constructor that only checks the fields of its record.
    pub(crate) const fn of(record: &'static super::Record) -> Self {
        Self { record, make }
    }

    /// A constructor that checks more than single fields.
    pub(crate) const fn with(
        record: &'static super::Record,
        make: fn(&Lua, &'static super::Record, &Value) -> mlua::Result<Table>,
    ) -> Self {
        Self { record, make }
    }

    /// `suite` of `softvt.suite`.
    pub(crate) fn name(&self) -> &'static str {
        self.record.kind.rsplit('.').next().unwrap_or(self.record.kind)
    }

    pub(crate) fn install(&self, lua: &Lua, table: &Table) -> mlua::Result<()> {
        let Self { record, make } = *self;
        table.set(self.name(), lua.create_function(move |lua, value: Value| make(lua, record, &value))?)
    }
}

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
    (
        $(#[doc = $doc:literal])+
        fn $name:ident($lua:ident $(, $arg:ident : $arg_type:ty)*) -> $class:literal as $label:literal {$(
            $(#[doc = $field_doc:literal])+
            $field:ident : $field_type:literal = $value:expr;
        )*}
    ) => {
        $(#[doc = $doc])+
        pub(crate) fn $name($lua: &mlua::Lua $(, $arg: $arg_type)*) -> mlua::Result<mlua::Table> {
            let table = $lua.create_table()?;
            $(table.raw_set(stringify!($field), $value)?;)*
            $crate::script::schema::strict_table($lua, $label, table, vec![$(stringify!($field).to_owned()),*])
        }

        pub(crate) mod $name {
            pub(crate) static CLASS: $crate::script::schema::Class = $crate::script::schema::Class {
                name: $class,
                doc: concat!($($doc),+),
                fields: &[$($crate::script::schema::object::LuaField {
                    name: stringify!($field),
                    access: $crate::script::schema::object::Access::Read($field_type, None),
                    doc: concat!($($field_doc),+),
                }),*],
                methods: &[],
            };
        }
    };
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
            Err(fail(lua, format!("{name}: {}", unknown_name("key", &key.to_string_lossy(), known))))
        }
        key => Err(fail(lua, format!("{name}: expected a name as key, got {}", describe(key)))),
    })?;
    // Lua asks the metatable only for keys without a value; reading a known one stores and returns nil.
    meta.set("__index", &refuse)?;
    meta.set("__newindex", refuse)?;
    meta.set("__metatable", label)?;
    table.set_metatable(Some(meta))?;
    Ok(table)
}

/// Sets the name of the class.
pub(crate) fn add_fields<T: ApiObject, F: UserDataFields<T>>(fields: &mut F) {
    fields.add_meta_field(MetaMethod::Type, T::CLASS.name);
}

/// Adds fields, methods and the text of an object.
pub(crate) fn add_methods<T: ApiObject, M: UserDataMethods<T>>(methods: &mut M) {
    methods.add_meta_method(MetaMethod::ToString, |_, this, _: MultiValue| Ok(this.text()));
    methods.add_meta_method(MetaMethod::Index, |lua, this, key: Value| read(lua, this, &key));
    methods.add_meta_method(MetaMethod::NewIndex, |lua, this, (key, value): (Value, Value)| {
        write(lua, this, &key, &value)
    });
    for (signature, body) in T::CLASS.methods.iter().zip(T::METHODS) {
        methods.add_function(signature.name, move |lua, values: MultiValue| {
            let mut values = values.into_iter();
            let first = values.next().unwrap_or(Value::Nil);
            let Some(this) = first.as_userdata().and_then(|data| data.borrow::<T>().ok()) else {
                return Err(T::CLASS.missing_self_error(lua, signature.name, &first));
            };
            let label = format!("{}:{}", this.label(), signature.name);
            body(lua, &this, arguments(lua, &label, signature, values)?)
        });
    }
}

/// Checks the arguments of a call, and fills in the defaults of tables; more arguments are ignored, as in Lua.
pub(crate) fn arguments(
    lua: &Lua,
    label: &str,
    signature: &Signature,
    values: impl IntoIterator<Item = Value>,
) -> mlua::Result<MultiValue> {
    let mut values = values.into_iter();
    let checked = signature.params.iter().map(|param| {
        let value = match (values.next().unwrap_or(Value::Nil), param.presence) {
            (value, _) if !param.checked => return Ok(value),
            (Value::Nil, FieldDefault::Optional) => return Ok(Value::Nil),
            (Value::Nil, FieldDefault::Empty) => Value::Table(lua.create_table()?),
            (value, _) => value,
        };
        param.ty.check(lua, &value).map_err(|error| match param.ty {
            // The keys of a table say enough.
            Type::Nested(_) => error_at_key(lua, label, &error),
            _ => fail(lua, error.describe(&format!("{label}: {}", param.name))),
        })
    });
    checked.collect()
}

/// The field or method name that a key is.
fn name_of<T: ApiObject>(lua: &Lua, this: &T, key: &Value) -> mlua::Result<String> {
    match key {
        Value::String(name) => Ok(name.to_string_lossy()),
        other => {
            let message =
                format!("{}: expected the name of a field or method, got {}", this.label(), describe(other));
            Err(fail(lua, message))
        }
    }
}

fn read<T: ApiObject>(lua: &Lua, this: &T, key: &Value) -> mlua::Result<Value> {
    let name = name_of(lua, this, key)?;
    let Some(index) = T::CLASS.field(&name) else {
        return Err(T::CLASS.unknown_key_error(lua, &this.label(), &name));
    };
    let get = T::GETTERS[index];
    let label = || format!("{}.{name}", this.label());
    let list = match get(lua, this)? {
        FieldValue::Value(value) => return Ok(value),
        FieldValue::Fixed(entries, hint) => LuaList::fixed(label(), entries, hint),
        FieldValue::Numbers(_) => {
            let (reader, writer) = (this.clone(), this.clone());
            let get = move |lua: &Lua| match get(lua, &reader)? {
                FieldValue::Numbers(numbers) => Ok(numbers),
                FieldValue::Value(_) | FieldValue::Fixed(..) => Ok(Vec::new()),
            };
            let set = move |lua: &Lua, value: &Value| write_field(lua, &writer, index, value);
            LuaList::live(label(), Box::new(get), Box::new(set))
        }
    };
    lua.create_userdata(list).map(Value::UserData)
}

fn write<T: ApiObject>(lua: &Lua, this: &T, key: &Value, value: &Value) -> mlua::Result<()> {
    let (label, class) = (this.label(), T::CLASS);
    let name = name_of(lua, this, key)?;
    if let Some(index) = class.field(&name) {
        return write_field(lua, this, index, value);
    }
    if class.methods.iter().any(|method| method.name == name) {
        let message =
            format!("{label}.{name}: is a method and cannot be written; call it as {label}:{name}(…)");
        return Err(fail(lua, message));
    }
    let writable = class.fields.iter().filter(|field| matches!(field.access, Access::Write(_)));
    let names = writable.map(|field| field.name);
    Err(match names.clone().next() {
        Some(_) => fail(lua, format!("{label}: {}", unknown_name("key", &name, names))),
        None => fail(lua, format!("{label}: has no key {name:?} and no writable ones")),
    })
}

/// Checks a value and passes it to the setter of a field.
fn write_field<T: ApiObject>(lua: &Lua, this: &T, index: usize, value: &Value) -> mlua::Result<()> {
    let field = &T::CLASS.fields[index];
    let label = format!("{}.{}", this.label(), field.name);
    match (&field.access, T::SETTERS[index]) {
        (Access::Write(ty), Some(set)) => {
            let value = ty.check(lua, value).map_err(|error| fail(lua, error.describe(&label)))?;
            set(lua, this, value)
        }
        (Access::Read(_, Some(hint)), _) => Err(fail(lua, format!("{label}: cannot be replaced; {hint}"))),
        (Access::Read(_, None), _) | (Access::Write(_), None) => {
            Err(fail(lua, format!("{label}: is read-only")))
        }
    }
}
