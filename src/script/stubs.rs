//! LuaCATS stubs and the Lua reference, generated from the declarations of the Lua interface.

use std::fmt::Write;

use serde_json::Value;

use super::{
    api::{self, goals::GoalSpec, shapes::SHAPES, tasks::SETTINGS_CLASS, visuals::MASKS},
    plan::options,
    schema::{
        Class, Field, FieldDefault, Function, Record, Signature, Type,
        function::Param,
        object::{Access, LuaField},
    },
};

use softvt_benchmark::settings::Settings;
use softvt_common::settings::Setting;

/// Name of the stub file that `softvt init` writes.
pub const STUB_FILE: &str = "library/softvt.d.lua";

/// Settings for Lua language servers: the folder of the stubs.
pub const LUARC: &str = "{\n  \"runtime.version\": \"Lua 5.4\",\n  \"workspace.library\": [\"library\"]\n}\n";

/// Functions of the table `softvt` that are not constructors.
fn functions() -> impl Iterator<Item = &'static Signature> {
    let declared = api::functions().chain(options::FUNCTIONS).map(|function| &function.signature);
    declared.chain([&api::SORTED])
}

/// Every table that a script may write: those of constructors, those that its functions return, and those that
/// functions and methods take, each followed by the tables nested in it.
fn records() -> Vec<&'static Record> {
    fn add(records: &mut Vec<&'static Record>, record: &'static Record) {
        if !records.iter().any(|known| known.class == record.class) {
            records.push(record);
            record.fields.iter().for_each(|field| add_nested(records, &field.ty));
        }
    }
    fn add_nested(records: &mut Vec<&'static Record>, ty: &Type) {
        match ty {
            Type::List(of) | Type::Distinct { of, .. } | Type::Map(of) => add_nested(records, of),
            Type::OneOf(types) => types.iter().for_each(|ty| add_nested(records, ty)),
            Type::Nested(record) => add(records, record),
            Type::Constructed(made) => made.iter().for_each(|record| add(records, record)),
            _ => {}
        }
    }
    let mut records = Vec::new();
    api::constructors()
        .chain(api::RETURNED_RECORDS.iter().copied())
        .for_each(|record| add(&mut records, record));
    let signatures = functions()
        .chain(SHAPES.iter().chain(MASKS).map(|function| &function.signature))
        .chain(api::CLASSES.iter().flat_map(|class| class.methods));
    signatures.flat_map(|signature| signature.params).for_each(|param| add_nested(&mut records, &param.ty));
    records
}

/// Alias of the classes of goals.
const GOAL: &str = "softvt.Goal";

fn goal_classes() -> String {
    classes(GoalSpec::RECORDS)
}

fn classes(records: &[&Record]) -> String {
    records.iter().map(|record| record.class).collect::<Vec<_>>().join("|")
}

fn lua_type(ty: &Type) -> String {
    match ty {
        Type::Number(..) => "number".into(),
        Type::Integer(_) => "integer".into(),
        Type::Text | Type::Line | Type::Name => "string".into(),
        Type::Boolean => "boolean".into(),
        Type::Vector(..) | Type::Interval(..) | Type::Direction([], _) | Type::Quaternion(_) => {
            "number[]".into()
        }
        Type::Direction(names, _) => format!("{}|number[]", lua_type(&Type::Choice(names))),
        Type::Choice(names) => names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join("|"),
        Type::Function(signature) | Type::Table(signature) => (*signature).into(),
        Type::List(of) => match of {
            Type::OneOf(_) | Type::Choice(_) | Type::Function(_) => format!("({})[]", lua_type(of)),
            of => format!("{}[]", lua_type(of)),
        },
        Type::Distinct { of, .. } => lua_type(&Type::List(of)),
        // Settings are the only table of tables of any values.
        Type::Map(Type::Map(Type::Any)) => SETTINGS_CLASS.into(),
        Type::Map(of) => format!("table<string, {}>", lua_type(of)),
        Type::Nested(record) => record.class.into(),
        Type::Constructed(records) => match classes(records) {
            all if all == goal_classes() => GOAL.into(),
            all => all,
        },
        Type::Object(class) => (*class).into(),
        Type::OneOf(types) => types.iter().map(lua_type).collect::<Vec<_>>().join("|"),
        Type::Any => "any".into(),
    }
}

/// The documentation of a value, with its range and default.
fn details(doc: &str, ty: &Type, presence: FieldDefault) -> String {
    let expected = match ty {
        Type::Number(..)
        | Type::Integer(_)
        | Type::Vector(..)
        | Type::Interval(..)
        | Type::Direction(..)
        | Type::Quaternion(_) => format!(" Expects {}.", ty.describe()),
        _ => String::new(),
    };
    let default = match presence {
        FieldDefault::Number(n) => format!(" Default {n}."),
        FieldDefault::Integer(n) => format!(" Default {n}."),
        FieldDefault::Text(text) => format!(" Default {text:?}."),
        FieldDefault::Boolean(flag) => format!(" Default {flag}."),
        FieldDefault::Required | FieldDefault::Optional | FieldDefault::Empty => String::new(),
    };
    format!("{}{expected}{default}", doc.trim())
}

fn field_details(field: &Field) -> String {
    details(field.doc, &field.ty, field.presence)
}

/// LuaCATS type and documentation of a class's field.
fn class_field(field: &LuaField) -> (String, String) {
    match &field.access {
        Access::Read(lua_type, _) => ((*lua_type).to_owned(), field.doc.trim().to_owned()),
        Access::Write(ty) => (lua_type(ty), details(field.doc, ty, FieldDefault::Required)),
    }
}

/// The stub file for language servers.
pub fn stubs() -> String {
    let mut out =
        String::from("---@meta softvt\n-- Generated from the declarations in src/script; do not edit.\n\n");
    for record in records() {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(out, "---{}\n---@class {}", record.doc.trim(), record.class);
        for field in record.fields {
            let mark = if field.presence == FieldDefault::Required { "" } else { "?" };
            let (ty, details) = (lua_type(&field.ty), field_details(field));
            let _ = writeln!(out, "---@field {}{mark} {ty} {details}", field.name);
        }
        out.push('\n');
    }
    let _ = writeln!(out, "---The goal of a task.\n---@alias {GOAL} {}\n", goal_classes());
    for SettingGroup { class, fields } in setting_groups(&Settings::list()) {
        let about = "Settings; those that are left out keep their values. docs/settings.md lists all.";
        let _ = writeln!(out, "---{about}\n---@class {class}");
        for SettingField { name, lua_type, details } in fields {
            let _ = writeln!(out, "---@field {name}? {lua_type}{details}");
        }
        out.push('\n');
    }
    for class in api::CLASSES {
        stub_class(&mut out, class);
    }
    out.push_str("---The softvt library.\nsoftvt = {}\n\n---Version of softvt.\n---@type string\nsoftvt.version = \"\"\n\n");
    for record in api::constructors() {
        let Record { doc, class, .. } = record;
        let _ = writeln!(out, "---{}\n---@param spec {class}\n---@return {class}", doc.trim());
        let _ = writeln!(out, "function softvt.{}(spec) end\n", record.constructor());
    }
    functions().for_each(|function| stub_function(&mut out, "softvt.", function));
    let mut group = |doc: &str, prefix: &str, functions: &'static [Function]| {
        let _ = writeln!(out, "---{doc}\n{} = {{}}\n", prefix.trim_end_matches('.'));
        for function in functions {
            out.push_str("---@nodiscard\n");
            stub_function(&mut out, prefix, &function.signature);
        }
    };
    group("Shapes, in metres.", "softvt.shape.", SHAPES);
    group("Masks: weights of the layers of a visual.", "softvt.mask.", MASKS);
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

struct SettingGroup {
    class: String,
    fields: Vec<SettingField>,
}

struct SettingField {
    name: String,
    lua_type: String,
    details: String,
}

/// The groups of settings, each before those inside of it.
fn setting_groups(settings: &[Setting]) -> Vec<SettingGroup> {
    let mut groups: Vec<SettingGroup> = Vec::new();
    for setting in settings {
        let (mut class, mut rest) = (SETTINGS_CLASS.to_owned(), setting.path.as_str());
        loop {
            let (name, inner) =
                rest.split_once('.').map_or((rest, None), |(name, inner)| (name, Some(inner)));
            let index = groups.iter().position(|group| group.class == class).unwrap_or_else(|| {
                groups.push(SettingGroup { class: class.clone(), fields: Vec::new() });
                groups.len() - 1
            });
            let fields = &mut groups[index].fields;
            let own = format!("{class}.{name}");
            let (lua_type, details) = match (inner, &setting.default) {
                (Some(_), _) => (own.clone(), String::new()),
                (None, Value::Bool(_)) => ("boolean".to_owned(), setting_details(setting)),
                // One of several models, by its name in the field `model`.
                (None, Value::String(_)) => ("table".to_owned(), setting_details(setting)),
                (None, _) => ("number".to_owned(), setting_details(setting)),
            };
            match fields.iter_mut().find(|field| field.name == name) {
                None => fields.push(SettingField { name: name.to_owned(), lua_type, details }),
                Some(model) if model.lua_type == "table" => {
                    model.lua_type.clone_from(&own);
                    let (name, lua_type) = ("model".to_owned(), "string".to_owned());
                    let details = " Name of the model; the constants are its own.".to_owned();
                    let fields = vec![SettingField { name, lua_type, details }];
                    groups.push(SettingGroup { class: own.clone(), fields });
                }
                Some(_) => {}
            }
            let Some(inner) = inner else { break };
            (class, rest) = (own, inner);
        }
    }
    groups
}

fn setting_details(setting: &Setting) -> String {
    let about = setting.about.trim_end_matches('.');
    format!(" {about}. Expects {}. Default {}.", setting.values, setting.default_text())
}

fn stub_class(out: &mut String, class: &Class) {
    let _ = writeln!(out, "---{}\n---@class {}", class.doc.trim(), class.name);
    for field in (class.fields)() {
        let (ty, doc) = class_field(&field);
        let _ = writeln!(out, "---@field {} {ty} {doc}", field.name);
    }
    let short = class.short_name();
    let _ = writeln!(out, "local {short} = {{}}\n");
    for method in class.methods {
        // A method that makes another value of its class changes nothing else.
        if method.returns == [class.name] {
            out.push_str("---@nodiscard\n");
        }
        stub_function(out, &format!("{short}:"), method);
    }
}

fn stub_function(out: &mut String, prefix: &str, function: &Signature) {
    let _ = writeln!(out, "---{}", function.doc.trim());
    for param in function.params {
        let mark = if param.is_optional() { "?" } else { "" };
        let _ = writeln!(out, "---@param {}{mark} {}", param.name, lua_type(&param.ty));
    }
    for ty in function.returns {
        let _ = writeln!(out, "---@return {ty}");
    }
    let names: Vec<_> = function.params.iter().map(|param| param.name).collect();
    let _ = writeln!(out, "function {prefix}{}({}) end\n", function.name, names.join(", "));
}

/// The reference page `docs/lua.md`.
pub fn reference() -> String {
    let mut out = String::from(INTRODUCTION);
    out.push_str("\n## Functions\n\n");
    for record in api::constructors() {
        let Record { doc, class, .. } = record;
        let _ = writeln!(out, "- `softvt.{}{{…}}`: {} See `{class}`.", record.constructor(), doc.trim());
    }
    functions().for_each(|function| reference_function(&mut out, "softvt.", function));
    SHAPES.iter().for_each(|function| reference_function(&mut out, "softvt.shape.", &function.signature));
    MASKS.iter().for_each(|function| reference_function(&mut out, "softvt.mask.", &function.signature));
    out.push_str("- `softvt.version`: version of softvt, a string.\n\n## Objects\n");
    for class in api::CLASSES {
        let _ = writeln!(out, "\n### {}\n\n{}\n", class.name, class.doc.trim());
        for field in (class.fields)() {
            let (ty, doc) = class_field(&field);
            let writable = if matches!(field.access, Access::Write(_)) { ", writable" } else { "" };
            let _ = writeln!(out, "- `{}` ({}{writable}): {doc}", field.name, cell(&ty));
        }
        class.methods.iter().for_each(|method| reference_function(&mut out, ":", method));
    }
    out.push_str("\n## Tables\n");
    for record in records() {
        let _ = writeln!(out, "\n### {}\n\n{}\n", record.class, record.doc.trim());
        if record.fields.is_empty() {
            out.push_str("It has no fields.\n");
            continue;
        }
        out.push_str("| field | type | required | meaning |\n|---|---|---|---|\n");
        for field in record.fields {
            let required = if field.presence == FieldDefault::Required { "yes" } else { "no" };
            let (ty, details) = (cell(&lua_type(&field.ty)), field_details(field));
            let _ = writeln!(out, "| `{}` | {ty} | {required} | {details} |", field.name);
        }
    }
    out
}

fn reference_function(out: &mut String, prefix: &str, function: &Signature) {
    let returns = match function.returns {
        [] => String::new(),
        types => format!(" → {}", cell(&types.join(", "))),
    };
    let name = function.name;
    let _ = match function.record() {
        Some(record) => {
            writeln!(out, "- `{prefix}{name}{{…}}`{returns}: {} See `{}`.", function.doc.trim(), record.class)
        }
        None => {
            let mark =
                |param: &Param| format!("{}{}", param.name, if param.is_optional() { "?" } else { "" });
            let names: Vec<_> = function.params.iter().map(mark).collect();
            writeln!(out, "- `{prefix}{name}({})`{returns}: {}", names.join(", "), function.doc.trim())
        }
    };
}

/// A type in a Markdown table or line, where a bar would end the cell.
fn cell(ty: &str) -> String {
    format!("`{}`", ty.replace('|', " or "))
}

const INTRODUCTION: &str = include_str!("lua_introduction.md");

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use super::*;

    /// Compares a committed file with the generated text, or writes it if SOFTVT_WRITE_DOCS is set.
    fn check_file(path: &str, generated: &str) {
        let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path);
        if std::env::var_os("SOFTVT_WRITE_DOCS").is_some() {
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(&file, generated).unwrap();
        }
        let committed = fs::read_to_string(&file).unwrap_or_default();
        assert!(committed == generated, "{path} differs from the declarations; run .ci/regenerate lua");
    }

    #[test]
    fn stubs_and_reference_are_up_to_date() {
        check_file(STUB_FILE, &stubs());
        check_file("docs/lua.md", &reference());
        check_file(".luarc.json", LUARC);
    }

    #[test]
    fn stubs_are_valid_lua() {
        let lua = mlua::Lua::new();
        lua.load(stubs()).exec().unwrap();
        let has = "local names = {} for name in pairs(softvt) do names[#names + 1] = name end return #names";
        let count: usize = lua.load(has).eval().unwrap();
        assert_eq!(count, api::constructors().count() + functions().count() + 3);
    }
}
