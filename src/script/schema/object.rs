//! Objects of the host in Lua: their declarations, and the one place where fields are read and written.

use mlua::{
    FromLua, IntoLua, Lua, MetaMethod, MultiValue, Table, UserData, UserDataFields, UserDataMethods, Value,
};

use super::{
    Type,
    check::checked,
    function::{Signature, arguments},
};
use crate::vm::{error::fail, list::LuaList, value::describe};
use softvt_common::text::unknown_name;
use softvt_geometry::Vec3;

/// A class of objects or of tables that scripts receive: the part that stubs, reference and messages need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Class {
    pub name: &'static str,
    pub doc: &'static str,
    pub fields: fn() -> Vec<LuaField>,
    pub methods: &'static [Signature],
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct LuaField {
    pub name: &'static str,
    pub access: Access,
    pub doc: &'static str,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Access {
    /// Read-only, with its LuaCATS type, and how to change it instead.
    Read(&'static str, Option<&'static str>),
    Write(Type),
}

impl Class {
    /// `camera` of `softvt.Camera`.
    pub(crate) fn short_name(&self) -> &'static str {
        self.name.rsplit('.').next().unwrap_or(self.name)
    }

    /// The error for a name that is neither a field nor a method.
    fn unknown_key_error(&self, lua: &Lua, label: &str, key: &str) -> mlua::Error {
        let fields = (self.fields)();
        let keys = fields.iter().map(|field| field.name).chain(self.methods.iter().map(|method| method.name));
        match keys.clone().next() {
            Some(_) => fail!(lua, "{label}: {}", unknown_name("key", key, keys)),
            None => fail!(lua, "{label}: has no key {key:?}"),
        }
    }

    /// The error for a method called without its object: most often a point was written for a colon.
    pub(crate) fn missing_self_error(&self, lua: &Lua, method: &str, first: &Value) -> mlua::Error {
        let (short, got) = (self.short_name().to_lowercase(), describe(first));
        fail!(lua, "{short}:{method}: got {got}; call it as {short}:{method}(…)")
    }
}

pub(crate) enum FieldValue {
    Value(Value),
    /// Numbers that scripts may write one by one, if the field is writable.
    Numbers(Vec<f64>),
    /// A list that cannot be written, and how to change it instead.
    ReadOnly(Table, &'static str),
}

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

impl<T: ApiObject> IntoFieldValue for T {
    fn into_field_value(self, lua: &Lua) -> mlua::Result<FieldValue> {
        self.into_lua(lua).map(FieldValue::Value)
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

plain_field_values! { f64, Option<f64>, usize, u32, bool, &str, String, Option<String>, Value, Table, Option<Table> }

/// A list that cannot be written; `hint` says how to change it instead.
pub(crate) fn read_only_list<T: IntoLua>(
    lua: &Lua,
    entries: impl IntoIterator<Item = T>,
    hint: &'static str,
) -> mlua::Result<FieldValue> {
    Ok(FieldValue::ReadOnly(lua.create_sequence_from(entries)?, hint))
}

/// Hint for lists of measured values.
pub(crate) const MEASURED: &str = "it is measured";

/// The object that a value holds. Arguments are checked before, so that another value is an error
/// of the interface itself.
pub(crate) fn object_of<T: ApiObject>(lua: &Lua, value: &Value) -> mlua::Result<T> {
    let object = value.as_userdata().and_then(|data| data.borrow::<T>().ok().map(|object| object.clone()));
    object.ok_or_else(|| fail!(lua, "expected a {}, got {}", T::NAME, describe(value)))
}

pub(crate) type Getter<T> = fn(&Lua, &T) -> mlua::Result<FieldValue>;
pub(crate) type Setter<T> = fn(&Lua, &T, Value) -> mlua::Result<()>;
pub(crate) type Method<T> = fn(&Lua, &T, MultiValue) -> mlua::Result<MultiValue>;

/// A field of the objects of a class.
pub(crate) struct ObjectField<T: 'static> {
    pub field: LuaField,
    pub get: Getter<T>,
    /// `None` for a read-only one.
    pub set: Option<Setter<T>>,
}

/// All fields of a class.
pub(crate) fn fields_of<T: ApiObject>() -> Vec<LuaField> {
    T::FIELDS.iter().map(|known| known.field).chain(T::declared()).collect()
}

/// An object that scripts hold: a cheap handle. Declared by [`class!`].
pub(crate) trait ApiObject: Clone + Send + Sync + UserData + FromLua + 'static {
    /// Name of the class, on which types in its own description may depend.
    const NAME: &'static str;
    const CLASS: &'static Class;
    /// Fields that are not declared elsewhere.
    const FIELDS: &'static [ObjectField<Self>];
    /// One per method of the class that is not implemented in Lua.
    const METHODS: &'static [Method<Self>];

    /// Name in messages: `scene:camera("wrist")`.
    fn label(&self) -> String;

    /// Fields that are read-only and declared elsewhere, such as the streams of the robot.
    fn declared() -> Vec<LuaField> {
        Vec::new()
    }

    /// Value of a field that is declared elsewhere.
    fn declared_field(&self, _: &Lua, _: &str) -> mlua::Result<Option<FieldValue>> {
        Ok(None)
    }

    fn text(&self) -> String {
        Self::NAME.to_owned()
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
///             name: "LuaCATS type" or "how to change it instead" { get(lua, this) { … } }
///         }
///         declared list_of_fields { get(lua, this, name) { … } }           // read-only, declared elsewhere
///         writable {
///             /// Documentation.
///             name: Type::… => path.to.field;                  // of the target of RustType::read and RustType::change
///             name: Type::… => { get(lua, this) { … } set(lua, this, value: RustType) { … } }
///         }
///         methods {
///             /// Documentation.
///             fn name(lua, this, argument: RustType = Type::…) -> ["LuaCATS type"] { … }
///             /// Documentation of the method and of the table, whose fields the body uses by name.
///             fn name(lua, this) takes spec "softvt.Table" { … as in record! … } -> ["LuaCATS type"] { … }
///         }
///         lua_methods {                              // implemented in Lua, with arguments checked by `arguments`
///             /// Documentation.
///             fn name(argument: RustType) -> ["LuaCATS type"];
///         }
///     }
/// }
/// ```
///
/// Bodies may use `?` on [`mlua::Result`]. Numbers of read-only fields are read-only lists.
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
            $(declared $declared:path {
                get($declared_lua:pat_param, $declared_this:pat_param, $declared_name:pat_param) $declared_get:block
            })?
            $(writable {$(
                $(#[doc = $write_doc:literal])+
                $write:ident : $write_type:expr => $($($path:ident).+ ;)? $({
                    get($get_lua:pat_param, $get_this:pat_param) $get:block
                    set($set_lua:pat_param, $set_this:pat_param, $value:ident : $value_type:ty) $set:block
                })?
            )*})?
            $(methods {$(
                $(#[doc = $method_doc:literal])+
                fn $method:ident($method_lua:pat_param, $method_this:pat_param $(, $arg:ident : $arg_type:ty $(= $arg_lua:expr)?)*)
                    $(takes $table:ident $table_class:literal $table_fields:tt)?
                    -> [$($return:literal),*] $body:block
            )*})?
            $(lua_methods {$(
                $(#[doc = $lua_method_doc:literal])+
                fn $lua_method:ident($($lua_arg:ident : $lua_arg_type:ty $(= $lua_arg_lua:expr)?),*)
                    -> [$($lua_return:literal),*];
            )*})?
        }
    ) => {
        impl $crate::schema::ApiObject for $object {
            const NAME: &'static str = $class;
            const CLASS: &'static $crate::schema::Class = &$crate::schema::Class {
                name: Self::NAME,
                doc: concat!($($doc),+),
                fields: $crate::schema::object::fields_of::<Self>,
                methods: &[
                    $($($crate::schema::function::signature!(
                        [$($method_doc)*] $method($($arg : $arg_type $(= $arg_lua)?),*)
                        $(takes $table $table_class $table_fields)?
                        -> [$($return),*]
                    ),)*)?
                    $($($crate::schema::function::signature!(
                        [$($lua_method_doc)+] $lua_method($($lua_arg : $lua_arg_type $(= $lua_arg_lua)?),*)
                        -> [$($lua_return),*]
                    ),)*)?
                ],
            };
            const FIELDS: &'static [$crate::schema::object::ObjectField<Self>] = &[
                $($($crate::schema::object::ObjectField {
                    field: $crate::schema::object::LuaField {
                        name: stringify!($read),
                        access: $crate::schema::object::Access::Read(
                            $read_type,
                            $crate::schema::convert::first!($(Some($hint),)? None),
                        ),
                        doc: concat!($($read_doc),+),
                    },
                    get: |state, object| {
                        let ($read_lua, $read_this) = (state, object);
                        $crate::schema::object::IntoFieldValue::into_field_value($read_get, state)
                    },
                    set: None,
                },)*)?
                $($($crate::schema::object::ObjectField {
                    field: $crate::schema::object::LuaField {
                        name: stringify!($write),
                        access: $crate::schema::object::Access::Write($write_type),
                        doc: concat!($($write_doc),+),
                    },
                    get: |state, object| {
                        $({
                            let value = object.read(|target| target $(.$path)+);
                            $crate::schema::object::IntoFieldValue::into_field_value(value, state)
                        })?
                        $({
                            let ($get_lua, $get_this) = (state, object);
                            $crate::schema::object::IntoFieldValue::into_field_value($get, state)
                        })?
                    },
                    set: Some(|state, object, value| {
                        $(
                            let value = $crate::schema::LuaType::from_checked(value, state)?;
                            object.change(state, |target| target $(.$path)+ = value);
                        )?
                        $(
                            let $value: $value_type = $crate::schema::LuaType::from_checked(value, state)?;
                            let ($set_lua, $set_this) = (state, object);
                            $set
                        )?
                        Ok(())
                    }),
                },)*)?
            ];
            const METHODS: &'static [$crate::schema::object::Method<Self>] = &[
                $($(|state, object, values| {
                    $crate::schema::function::bind_arguments! {
                        (values, state)
                        $($arg : $arg_type),*
                        $(; takes $table $table_fields)?
                    }
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

            $(
                fn declared() -> Vec<$crate::schema::object::LuaField> {
                    $declared()
                }

                fn declared_field(
                    &self,
                    lua: &mlua::Lua,
                    name: &str,
                ) -> mlua::Result<Option<$crate::schema::object::FieldValue>> {
                    let ($declared_lua, $declared_this, $declared_name) = (lua, self, name);
                    Ok($declared_get)
                }
            )?
        }

        impl mlua::FromLua for $object {
            fn from_lua(value: mlua::Value, lua: &mlua::Lua) -> mlua::Result<Self> {
                $crate::schema::object::object_of(lua, &value)
            }
        }

        impl mlua::UserData for $object {
            fn add_fields<F: mlua::UserDataFields<Self>>(fields: &mut F) {
                $crate::schema::object::add_fields::<Self, F>(fields);
            }

            fn add_methods<M: mlua::UserDataMethods<Self>>(methods: &mut M) {
                $crate::schema::object::add_methods(methods);
            }
        }
    };
}
pub(crate) use class;

pub(crate) fn add_fields<T: ApiObject, F: UserDataFields<T>>(fields: &mut F) {
    fields.add_meta_field(MetaMethod::Type, T::NAME);
}

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

fn name_of<T: ApiObject>(lua: &Lua, this: &T, key: &Value) -> mlua::Result<String> {
    match key {
        Value::String(name) => Ok(name.to_string_lossy()),
        other => Err(fail!(lua, "{}: expected the name of a field, got {}", this.label(), describe(other))),
    }
}

fn field<T: ApiObject>(name: &str) -> Option<&'static ObjectField<T>> {
    T::FIELDS.iter().find(|known| known.field.name == name)
}

fn read<T: ApiObject>(lua: &Lua, this: &T, key: &Value) -> mlua::Result<Value> {
    let name = name_of(lua, this, key)?;
    let field = field::<T>(&name);
    let value = match field {
        Some(field) => Some((field.get)(lua, this)?),
        None => this.declared_field(lua, &name)?,
    };
    let label = || format!("{}.{name}", this.label());
    let list = match value.ok_or_else(|| T::CLASS.unknown_key_error(lua, &this.label(), &name))? {
        FieldValue::Value(value) => return Ok(value),
        FieldValue::ReadOnly(entries, hint) => LuaList::read_only(label(), entries, hint),
        FieldValue::Numbers(numbers) => match field.filter(|field| field.set.is_some()) {
            None => {
                let hint = match field.map(|field| field.field.access) {
                    Some(Access::Read(_, Some(hint))) => hint,
                    _ => MEASURED,
                };
                LuaList::read_only(label(), lua.create_sequence_from(numbers)?, hint)
            }
            Some(field) => {
                let (reader, writer) = (this.clone(), this.clone());
                let get = move |lua: &Lua| match (field.get)(lua, &reader)? {
                    FieldValue::Numbers(numbers) => Ok(numbers),
                    FieldValue::Value(_) | FieldValue::ReadOnly(..) => Ok(Vec::new()),
                };
                let set = move |lua: &Lua, value: &Value| write_field(lua, &writer, field, value);
                LuaList::live(label(), Box::new(get), Box::new(set))
            }
        },
    };
    lua.create_userdata(list).map(Value::UserData)
}

fn write<T: ApiObject>(lua: &Lua, this: &T, key: &Value, value: &Value) -> mlua::Result<()> {
    let label = this.label();
    let name = name_of(lua, this, key)?;
    if let Some(field) = field::<T>(&name) {
        return write_field(lua, this, field, value);
    }
    if T::declared().iter().any(|known| known.name == name) {
        bail!(lua, "{label}.{name}: is read-only");
    }
    if T::CLASS.methods.iter().any(|method| method.name == name) {
        bail!(lua, "{label}.{name}: is a method and cannot be written; call it as {label}:{name}(…)");
    }
    let names = T::FIELDS.iter().filter(|known| known.set.is_some()).map(|known| known.field.name);
    Err(match names.clone().next() {
        Some(_) => fail!(lua, "{label}: {}", unknown_name("key", &name, names)),
        None => fail!(lua, "{label}: has no key {name:?} and no writable ones"),
    })
}

/// Checks a value and passes it to the setter of a field.
fn write_field<T: ApiObject>(lua: &Lua, this: &T, field: &ObjectField<T>, value: &Value) -> mlua::Result<()> {
    let label = format!("{}.{}", this.label(), field.field.name);
    match (&field.field.access, field.set) {
        (Access::Write(ty), Some(set)) => {
            let value = checked(lua, &label, |checker| checker.value(ty, value));
            set(lua, this, value.map_err(|error| fail(lua, error.describe(&label)))?)
        }
        (Access::Read(_, Some(hint)), _) => Err(fail!(lua, "{label}: cannot be replaced; {hint}")),
        _ => Err(fail!(lua, "{label}: is read-only")),
    }
}
