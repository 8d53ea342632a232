//! Objects of the host in Lua: one place where arguments of methods are taken and where fields are read and written.
//!
//! Both go by the binding table, so that every wrong argument and every unknown field ends in the same kind of message.

use mlua::{
    FromLuaMulti, IntoLuaMulti, Lua, MetaMethod, MultiValue, Table, UserData, UserDataFields,
    UserDataMethods, Value,
};

use crate::script::{
    api::catalogue_classes::{CLASSES, Class, Signature},
    schema::{self, Field, Record, Type, checked, got, unknown},
    vm::fail,
    vm::list::LuaList,
};

/// What a field of an object holds.
pub(crate) enum Read {
    /// A value.
    Value(Value),
    /// Numbers that may be written one by one.
    Numbers(Vec<f64>),
    /// A list that may not, and what to do instead.
    Fixed(Table, String),
}

impl Read {
    /// A number that may be missing.
    pub(crate) fn optional(number: Option<f64>) -> Self {
        Self::Value(number.map_or(Value::Nil, Value::Number))
    }

    /// A number.
    pub(crate) fn number(number: f64) -> Self {
        Self::Value(Value::Number(number))
    }

    /// A text.
    pub(crate) fn text(lua: &Lua, text: &str) -> mlua::Result<Self> {
        lua.create_string(text).map(|text| Self::Value(Value::String(text)))
    }

    /// Numbers that belong together; `mend` says how they are changed.
    pub(crate) fn together(lua: &Lua, numbers: &[f64], mend: &str) -> mlua::Result<Self> {
        Ok(Self::Fixed(lua.create_sequence_from(numbers.iter().copied())?, mend.to_owned()))
    }
}

/// An object that scripts hold; a cheap handle.
pub(crate) trait Hosted: Clone + Send + Sync + 'static {
    /// Its entry in the binding table.
    fn class() -> &'static Class;

    /// How messages name it: `scene:camera("wrist")`.
    fn label(&self) -> String;

    /// How it looks as text.
    fn text(&self) -> String {
        Self::class().name.to_owned()
    }

    /// The field `key`, which the binding table knows.
    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        Err(no_field(lua, self, key))
    }

    /// Stores a checked value in the field `key`, which the binding table says may be written.
    fn write(&self, lua: &Lua, key: &str, _value: Value) -> mlua::Result<()> {
        Err(no_field(lua, self, key))
    }

    /// Adds its methods by [`method`].
    fn methods<M: UserDataMethods<Self>>(methods: &mut M)
    where
        Self: UserData;
}

/// Makes [`Hosted`] types known to Lua.
macro_rules! hosted {
    ($($type:ty),+) => {$(
        impl mlua::UserData for $type {
            fn add_fields<F: mlua::UserDataFields<Self>>(fields: &mut F) {
                $crate::script::schema::userdata::add_fields::<Self, F>(fields);
            }

            fn add_methods<M: mlua::UserDataMethods<Self>>(methods: &mut M) {
                $crate::script::schema::userdata::add_methods(methods);
            }
        }
    )+};
}
pub(crate) use hosted;

/// The name of the class.
pub(crate) fn add_fields<T: Hosted + UserData, F: UserDataFields<T>>(fields: &mut F) {
    fields.add_meta_field(MetaMethod::Type, T::class().name);
}

/// Reading, writing, text and methods.
pub(crate) fn add_methods<T: Hosted + UserData, M: UserDataMethods<T>>(methods: &mut M) {
    methods.add_meta_method(MetaMethod::ToString, |_, this, _: MultiValue| Ok(this.text()));
    methods.add_meta_method(MetaMethod::Index, |lua, this, key: Value| index(lua, this, &key));
    methods.add_meta_method(MetaMethod::NewIndex, |lua, this, (key, value): (Value, Value)| {
        set_index(lua, this, &key, &value)
    });
    T::methods(methods);
}

/// Adds a method whose arguments the binding table describes; `body` gets them checked. What the table does not name is
/// not added.
pub(crate) fn method<T, M, A, R>(
    methods: &mut M,
    name: &'static str,
    body: impl Fn(&Lua, &T, A) -> mlua::Result<R> + Send + 'static,
) where
    T: Hosted + UserData,
    M: UserDataMethods<T>,
    A: FromLuaMulti,
    R: IntoLuaMulti,
{
    let Some(signature) = T::class().methods.iter().find(|signature| signature.name == name) else { return };
    methods.add_function(name, move |lua, values: MultiValue| {
        let mut values = values.into_iter();
        let first = values.next().unwrap_or(Value::Nil);
        let Some(this) = first.as_userdata().and_then(|data| data.borrow::<T>().ok()) else {
            return Err(no_self(lua, T::class(), name, &first));
        };
        let taken = arguments(lua, &format!("{}:{name}", this.label()), signature, values)?;
        body(lua, &this, A::from_lua_multi(taken, lua)?)
    });
}

/// Adds a method `object:name{…}` whose one argument is the table that `record` describes.
pub(crate) fn changing<T, M, R>(
    methods: &mut M,
    name: &'static str,
    record: &'static Record,
    body: impl Fn(&Lua, &T, Table) -> mlua::Result<R> + Send + 'static,
) where
    T: Hosted + UserData,
    M: UserDataMethods<T>,
    R: IntoLuaMulti,
{
    methods.add_function(name, move |lua, values: MultiValue| {
        let mut values = values.into_iter();
        let first = values.next().unwrap_or(Value::Nil);
        let Some(this) = first.as_userdata().and_then(|data| data.borrow::<T>().ok()) else {
            return Err(no_self(lua, T::class(), name, &first));
        };
        let spec = checked(lua, record, &values.next().unwrap_or(Value::Nil))?;
        body(lua, &this, spec)
    });
}

/// A method without its object: most often a point was written for a colon.
pub(crate) fn no_self(lua: &Lua, class: &Class, name: &str, first: &Value) -> mlua::Error {
    let short = short(class);
    fail(
        lua,
        format!(
            "{short}:{name}: expected a {} before the colon, got {}; call it as {short}:{name}(…)",
            class.name,
            got(first)
        ),
    )
}

/// `camera` of `softvt.Camera`.
fn short(class: &Class) -> String {
    class.name.rsplit('.').next().unwrap_or(class.name).to_lowercase()
}

/// The arguments that `signature` asks for, checked, defaults of tables filled in; more of them are ignored, as in Lua.
pub(crate) fn arguments(
    lua: &Lua,
    place: &str,
    signature: &Signature,
    values: impl IntoIterator<Item = Value>,
) -> mlua::Result<MultiValue> {
    let mut values = values.into_iter();
    signature.params.iter().map(|(name, ty)| argument(lua, place, name, ty, values.next())).collect()
}

fn argument(lua: &Lua, place: &str, name: &str, ty: &Type, value: Option<Value>) -> mlua::Result<Value> {
    let value = match (value.unwrap_or(Value::Nil), name.ends_with('?'), ty) {
        (Value::Nil, true, Type::Nested(_)) => Value::Table(lua.create_table()?),
        (Value::Nil, true, _) => return Ok(Value::Nil),
        (value, ..) => value,
    };
    ty.check(lua, &value).map_err(|fault| match ty {
        // The keys of a table say enough.
        Type::Nested(_) => schema::fault_here(lua, place, &fault),
        _ => fail(lua, fault.words(&format!("{place}: {}", name.trim_end_matches('?')))),
    })
}

fn index<T: Hosted>(lua: &Lua, this: &T, key: &Value) -> mlua::Result<Value> {
    let name = known(lua, this, key)?;
    match this.read(lua, &name)? {
        Read::Value(value) => Ok(value),
        Read::Fixed(entries, mend) => {
            let list = LuaList::fixed(format!("{}.{name}", this.label()), entries, &mend);
            lua.create_userdata(list).map(Value::UserData)
        }
        Read::Numbers(_) => {
            let (reader, writer) = ((this.clone(), name.clone()), (this.clone(), name.clone()));
            let get = move |lua: &Lua| match reader.0.read(lua, &reader.1)? {
                Read::Numbers(numbers) => Ok(numbers),
                _ => Ok(Vec::new()),
            };
            let set = move |lua: &Lua, value: &Value| set_field(lua, &writer.0, &writer.1, value);
            let list = LuaList::live(format!("{}.{name}", this.label()), Box::new(get), Box::new(set));
            lua.create_userdata(list).map(Value::UserData)
        }
    }
}

/// The key as the name of a field.
fn known<T: Hosted>(lua: &Lua, this: &T, key: &Value) -> mlua::Result<String> {
    let Value::String(name) = key else {
        let what = format!("{}: expected the name of a field or method, got {}", this.label(), got(key));
        return Err(fail(lua, what));
    };
    let (name, class) = (name.to_string_lossy().to_string(), T::class());
    let is_field = class.fields.iter().any(|(field, ..)| *field == name)
        || class.written.iter().any(|field| field.name == name);
    if is_field { Ok(name) } else { Err(no_field(lua, this, &name)) }
}

/// A name that is neither a field nor a method.
fn no_field<T: Hosted>(lua: &Lua, this: &T, key: &str) -> mlua::Error {
    let class = T::class();
    let known = class.fields.iter().map(|(name, ..)| *name);
    let known = known.chain(class.written.iter().map(|field| field.name));
    let known = known.chain(class.methods.iter().map(|method| method.name));
    let said = match known.clone().next() {
        Some(_) => unknown("key", key, known),
        None => format!("has no key {key:?}"),
    };
    fail(lua, format!("{}: {said}", this.label()))
}

fn set_index<T: Hosted>(lua: &Lua, this: &T, key: &Value, value: &Value) -> mlua::Result<()> {
    let (label, class) = (this.label(), T::class());
    let name = match key {
        Value::String(name) => name.to_string_lossy().to_string(),
        _ => known(lua, this, key)?,
    };
    if class.written.iter().any(|field| field.name == name) {
        return set_field(lua, this, &name, value);
    }
    if class.methods.iter().any(|method| method.name == name) {
        return Err(fail(
            lua,
            format!("{label}.{name}: is a method and cannot be written; call it as {label}:{name}(…)"),
        ));
    }
    let Some((_, ty, _)) = class.fields.iter().find(|(field, ..)| *field == name) else {
        let names = class.written.iter().map(|field| field.name);
        return Err(match class.written.is_empty() {
            true => fail(lua, format!("{label}: has no key {name:?} and none that may be written")),
            false => fail(lua, format!("{label}: {}", unknown("key", &name, names))),
        });
    };
    let inner = CLASSES
        .iter()
        .find(|class| class.name == *ty)
        .and_then(|class| class.written.iter().find(|f| is_number(f)));
    Err(match inner {
        Some(Field { name: number, .. }) => fail(
            lua,
            format!(
                "{label}.{name}: cannot be replaced; its numbers are written one by one, as in {label}.{name}.{number} = …"
            ),
        ),
        None => fail(lua, format!("{label}.{name}: is only read")),
    })
}

fn is_number(field: &Field) -> bool {
    matches!(field.ty, Type::Number(..))
}

/// Checks a value by the binding table and hands it to the object.
fn set_field<T: Hosted>(lua: &Lua, this: &T, name: &str, value: &Value) -> mlua::Result<()> {
    let Some(field) = T::class().written.iter().find(|field| field.name == name) else {
        return Err(no_field(lua, this, name));
    };
    let label = format!("{}.{name}", this.label());
    let value = field.ty.check(lua, value).map_err(|fault| fail(lua, fault.words(&label)))?;
    this.write(lua, name, value)
}
