//! LuaCATS stubs and the Lua reference, made from the binding table.

use std::fmt::Write;

use crate::script::{
    api::catalogue::{CONSTRUCTORS, LAYOUT, PLAIN},
    api::catalogue_classes::{CLASSES, Class, FUNCTIONS, SHAPE, Signature},
    api::catalogue_shapes::{MASK, MESH, METHODS, SHAPES},
    api::catalogue_visuals::{MASK_CLASS, MASKS},
    schema::{Field, Presence, Record, Type},
};

/// Name of the stub file that `softvt init` writes.
pub const STUB_FILE: &str = "library/softvt.d.lua";

/// Settings for Lua language servers: where the stubs are.
pub const LUARC: &str = "{\n  \"runtime.version\": \"Lua 5.4\",\n  \"workspace.library\": [\"library\"]\n}\n";

/// Every constructor that takes one table.
fn constructors() -> impl Iterator<Item = (&'static str, &'static Record)> {
    CONSTRUCTORS.iter().chain(crate::script::api::catalogue_policy::CONSTRUCTORS).copied()
}

/// Every table that a script may write, in order.
fn records() -> impl Iterator<Item = &'static Record> {
    let made = constructors().map(|(_, record)| record);
    let shapes = SHAPES.iter().chain(METHODS).map(|(_, record)| *record);
    made.chain([&LAYOUT])
        .chain(PLAIN.iter().copied())
        .chain(crate::script::api::catalogue_world::RECORDS.iter().copied())
        .chain(crate::script::api::catalogue_policy::PLAIN.iter().copied())
        .chain(shapes)
        .chain([&MASK, &MESH])
        .chain(MASKS.iter().map(|(_, record)| *record))
}

/// The type as LuaCATS writes it.
fn lua_type(ty: &Type) -> String {
    match ty {
        Type::Number(..) => "number".into(),
        Type::Integer(_) => "integer".into(),
        Type::Text | Type::Line | Type::Name => "string".into(),
        Type::Boolean => "boolean".into(),
        Type::Vector(..) | Type::Colour => "number[]".into(),
        Type::Choice(names) => names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join("|"),
        Type::Function(signature) | Type::Table(signature) => (*signature).into(),
        Type::List(of) => match of {
            Type::OneOf(_) | Type::Choice(_) | Type::Function(_) => format!("({})[]", lua_type(of)),
            of => format!("{}[]", lua_type(of)),
        },
        Type::Map(of) => format!("table<string, {}>", lua_type(of)),
        Type::Nested(record) => record.class.into(),
        Type::Made(records) => records.iter().map(|record| record.class).collect::<Vec<_>>().join("|"),
        Type::Object(class) => (*class).into(),
        Type::OneOf(types) => types.iter().map(lua_type).collect::<Vec<_>>().join("|"),
        Type::Any => "any".into(),
    }
}

/// What is taken and what holds by default, for people.
fn details(field: &Field) -> String {
    let taken = match field.ty {
        Type::Number(..) | Type::Integer(_) | Type::Vector(..) | Type::Colour => {
            format!(" Expects {}.", field.ty.words())
        }
        _ => String::new(),
    };
    let default = match field.presence {
        Presence::Number(n) => format!(" Default {n}."),
        Presence::Integer(n) => format!(" Default {n}."),
        Presence::Text(text) => format!(" Default {text:?}."),
        Presence::Boolean(flag) => format!(" Default {flag}."),
        Presence::Required | Presence::Optional | Presence::Empty => String::new(),
    };
    format!("{}{taken}{default}", field.doc)
}

/// The stub file for language servers.
pub fn stubs() -> String {
    let mut out = String::from("---@meta softvt\n-- Generated from the binding table; do not edit.\n\n");
    for record in records() {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(out, "---{}\n---@class {}", record.doc, record.class);
        for field in record.fields {
            let mark = if field.presence == Presence::Required { "" } else { "?" };
            let _ =
                writeln!(out, "---@field {}{mark} {} {}", field.name, lua_type(&field.ty), details(field));
        }
        out.push('\n');
    }
    stub_class(&mut out, &SHAPE);
    for (name, record) in METHODS {
        let _ = writeln!(out, "---{}\n---@param spec {}\n---@return softvt.Shape", record.doc, record.class);
        let _ = writeln!(out, "function Shape:{name}(spec) end\n");
    }
    for class in [&MASK_CLASS].into_iter().chain(CLASSES.iter().copied()) {
        stub_class(&mut out, class);
    }
    out.push_str("---The softvt library.\nsoftvt = {}\n\n---Version of softvt.\n---@type string\nsoftvt.version = \"\"\n\n");
    for (name, record) in constructors() {
        let _ =
            writeln!(out, "---{}\n---@param spec {}\n---@return {}", record.doc, record.class, record.class);
        let _ = writeln!(out, "function softvt.{name}(spec) end\n");
    }
    for function in FUNCTIONS {
        stub_function(&mut out, "softvt.", function);
    }
    out.push_str("---Shapes, in metres.\nsoftvt.shape = {}\n\n");
    for (name, record) in SHAPES {
        let _ = writeln!(out, "---{}\n---@param spec {}\n---@return softvt.Shape", record.doc, record.class);
        let _ = writeln!(out, "function softvt.shape.{name}(spec) end\n");
    }
    out.push_str("---Masks: where a layer of a visual is.\nsoftvt.mask = {}\n\n");
    for (name, record) in MASKS {
        let _ = writeln!(out, "---{}\n---@param spec {}\n---@return softvt.Mask", record.doc, record.class);
        let _ = writeln!(out, "function softvt.mask.{name}(spec) end\n");
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

fn stub_class(out: &mut String, class: &Class) {
    let _ = writeln!(out, "---{}\n---@class {}", class.doc, class.name);
    for (name, ty, doc) in class.fields {
        let _ = writeln!(out, "---@field {name} {ty} {doc}");
    }
    for field in class.written {
        let _ = writeln!(out, "---@field {} {} {}", field.name, lua_type(&field.ty), details(field));
    }
    let short = class.name.rsplit('.').next().unwrap_or(class.name);
    let _ = writeln!(out, "local {short} = {{}}\n");
    for method in class.methods {
        stub_function(out, &format!("{short}:"), method);
    }
}

fn stub_function(out: &mut String, prefix: &str, function: &Signature) {
    let _ = writeln!(out, "---{}", function.doc);
    for (name, ty) in function.params {
        let _ = writeln!(out, "---@param {name} {}", lua_type(ty));
    }
    for ty in function.returns {
        let _ = writeln!(out, "---@return {ty}");
    }
    let names: Vec<_> = function.params.iter().map(|(name, _)| name.trim_end_matches('?')).collect();
    let _ = writeln!(out, "function {prefix}{}({}) end\n", function.name, names.join(", "));
}

/// The reference page `docs/lua.md`.
pub fn reference() -> String {
    let mut out = String::from(INTRODUCTION);
    out.push_str("\n## Functions\n\n");
    for (name, record) in constructors() {
        let _ = writeln!(out, "- `softvt.{name}{{…}}`: {} See `{}`.", record.doc, record.class);
    }
    functions(&mut out, "softvt.", FUNCTIONS);
    for (name, record) in SHAPES {
        let _ = writeln!(out, "- `softvt.shape.{name}{{…}}`: {} See `{}`.", record.doc, record.class);
    }
    for (name, record) in MASKS {
        let _ = writeln!(out, "- `softvt.mask.{name}{{…}}`: {} See `{}`.", record.doc, record.class);
    }
    out.push_str("- `softvt.version`: version of softvt, a string.\n\n## Objects\n");
    for class in [&SHAPE, &MASK_CLASS].into_iter().chain(CLASSES.iter().copied()) {
        let _ = writeln!(out, "\n### {}\n\n{}\n", class.name, class.doc);
        for (name, ty, doc) in class.fields {
            let _ = writeln!(out, "- `{name}` ({}): {doc}", cell(ty));
        }
        for field in class.written {
            let _ = writeln!(
                out,
                "- `{}` ({}, writable): {}",
                field.name,
                cell(&lua_type(&field.ty)),
                details(field)
            );
        }
        functions(&mut out, ":", class.methods);
        if class.name == SHAPE.name {
            for (name, record) in METHODS {
                let _ = writeln!(out, "- `:{name}{{…}}`: {} See `{}`.", record.doc, record.class);
            }
        }
    }
    out.push_str("\n## Tables\n");
    for record in records() {
        let _ = writeln!(out, "\n### {}\n\n{}\n", record.class, record.doc);
        if record.fields.is_empty() {
            out.push_str("It has no fields.\n");
            continue;
        }
        out.push_str("| field | type | needed | meaning |\n|---|---|---|---|\n");
        for field in record.fields {
            let needed = if field.presence == Presence::Required { "yes" } else { "no" };
            let ty = cell(&lua_type(&field.ty));
            let _ = writeln!(out, "| `{}` | {ty} | {needed} | {} |", field.name, details(field));
        }
    }
    out
}

fn functions(out: &mut String, prefix: &str, list: &[Signature]) {
    for function in list {
        let names: Vec<_> = function.params.iter().map(|(name, _)| *name).collect();
        let gives = match function.returns {
            [] => String::new(),
            types => format!(" → {}", cell(&types.join(", "))),
        };
        let _ = writeln!(out, "- `{prefix}{}({})`{gives}: {}", function.name, names.join(", "), function.doc);
    }
}

/// A type inside of a Markdown table or line: the bar would end the cell.
fn cell(ty: &str) -> String {
    format!("`{}`", ty.replace('|', " or "))
}

const INTRODUCTION: &str = "# The Lua surface

<!-- Generated from the binding table; to write it anew: SOFTVT_WRITE_DOCS=1 cargo test --release --lib script::stubs -->

A Lua file returns a plan: a suite, a list of suites, or an experiment; `softvt FILE.lua` does what it says. A file behind
`--policy` returns a policy, one behind `--profile` a profile (docs/policies.md). Every table
is checked when it is built: a wrong type, a value out of range or an unknown key is an error with file and line.
Everything is in SI units, in the world frame (z up) unless it says otherwise.

Scripts are Lua 5.4 in a sandbox: `coroutine`, `math`, `string`, `table` and `utf8`, without `io`, `os`, `debug`,
`package` and byte code. `require \"a.b\"` looks for `scripts/a/b.lua`, `suites/a/b.lua` and `a/b.lua` in the script's
folder, the folder above and the current one, then in the library inside the binary. `math.random` is seeded by the run.
`pairs` goes through numbers, strings and booleans in order; other keys, and `next`, have no promised order. `tostring`
gives the kind of a table or function, never an address. `print` writes to standard error, up to 1 MiB. Memory and time
are limited: 256 MiB of Lua values, 512 MiB of pictures, shapes and masks, shapes of at most 2000 parts, masks of 200.

A list that belongs to an object (`scene.base`, `look.albedo`, `scene.objects`) is the object's own and no copy: what is
written to it is checked and holds at once, and a list that cannot be written says what to do instead. What a method
gives, and a table that a script made, are the script's. Unknown fields are errors everywhere. `pcall` gives messages as
strings.
";

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use super::*;

    /// Compares a committed file with what the table gives, or writes it where the environment asks for that.
    fn same(path: &str, generated: &str) {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        if std::env::var_os("SOFTVT_WRITE_DOCS").is_some() {
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(&file, generated).unwrap();
        }
        let committed = fs::read_to_string(&file).unwrap_or_default();
        assert!(
            committed == generated,
            "{path} differs from the binding table; run SOFTVT_WRITE_DOCS=1 cargo test --lib script::stubs"
        );
    }

    #[test]
    fn the_committed_stubs_and_reference_come_from_the_binding_table() {
        same(STUB_FILE, &stubs());
        same("docs/lua.md", &reference());
        same(".luarc.json", LUARC);
    }

    #[test]
    fn the_stubs_are_lua() {
        let lua = mlua::Lua::new();
        lua.load(stubs()).exec().unwrap();
        let has = "local names = {} for name in pairs(softvt) do names[#names + 1] = name end return #names";
        let count: usize = lua.load(has).eval().unwrap();
        assert_eq!(count, constructors().count() + FUNCTIONS.len() + 3);
    }

    #[test]
    fn the_machine_offers_just_what_the_table_says() {
        let text = "local names = {} for name in pairs(softvt) do names[#names + 1] = name end\n\
                    for name in pairs(softvt.mask) do names[#names + 1] = 'mask.' .. name end\n\
                    for name in pairs(softvt.shape) do names[#names + 1] = 'shape.' .. name end\n\
                    error(table.concat(names, ' '), 0)";
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("x.lua"), text).unwrap();
        let error = crate::script::load(&folder.path().join("x.lua"), &[]).unwrap_err();
        let mut names: Vec<String> = error.message.split(' ').map(str::to_string).collect();
        let mut table: Vec<String> = ["version".to_string(), "shape".into(), "mask".into()].into();
        table.extend(constructors().map(|(name, _)| name.to_string()));
        table.extend(FUNCTIONS.iter().map(|function| function.name.to_string()));
        table.extend(SHAPES.iter().map(|(name, _)| format!("shape.{name}")));
        table.extend(MASKS.iter().map(|(name, _)| format!("mask.{name}")));
        names.sort();
        table.sort();
        assert_eq!(names, table);
    }
}
