//! Lua source files and data files: from the project's folders first, then from the library embedded in the binary.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::Read,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use include_dir::{Dir, include_dir};
use mlua::Lua;
use sha2::{Digest, Sha256};

use crate::script::vm::error::ScriptError;
use crate::text::suggest;

static SCRIPTS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/scripts");
static SUITES: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/suites");
static ASSETS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/assets");

/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// The content of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    pub bytes: Arc<[u8]>,
    /// Lower-case hexadecimal SHA-256 of the bytes.
    pub sha256: String,
}

impl Source {
    fn new(bytes: Vec<u8>) -> Self {
        let sha256 = sha256(&bytes);
        Self { bytes: bytes.into(), sha256 }
    }
}

/// Every file that a script has read. Episodes run on a bundle and never read the disk again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bundle {
    /// Files by their name in messages.
    pub files: BTreeMap<String, Source>,
    /// The file found for each module or data file that was requested.
    pub served: BTreeMap<String, String>,
    /// Data files that were requested and not found.
    pub absent: BTreeSet<String>,
}

/// SHA-256 in lower-case hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

impl Bundle {
    /// SHA-256 of every file by its name.
    pub fn hashes(&self) -> BTreeMap<String, String> {
        self.files.iter().map(|(name, source)| (name.clone(), source.sha256.clone())).collect()
    }
}

/// Finds files and keeps what it read.
#[derive(Debug)]
pub(crate) struct Library {
    roots: Vec<PathBuf>,
    /// The main file, which cannot be required as a module.
    main: PathBuf,
    bundle: Bundle,
    frozen: bool,
}

/// The library of a virtual machine.
pub(crate) fn of(lua: &Lua) -> mlua::Result<Arc<Mutex<Library>>> {
    let library = lua.app_data_ref::<Arc<Mutex<Library>>>().map(|library| library.clone());
    library.ok_or_else(|| mlua::Error::runtime("the virtual machine has no library"))
}

impl Library {
    /// Opens the library of the script at `main` and reads that file; also returns its name in messages.
    pub(crate) fn open(main: &Path) -> Result<(Self, String), ScriptError> {
        let name = display(main);
        let folder = match main.parent() {
            Some(parent) if parent != Path::new("") => parent.to_path_buf(),
            _ => PathBuf::from("."),
        };
        let above = match folder.as_path() == Path::new(".") {
            true => PathBuf::from(".."),
            false => match folder.parent() {
                Some(parent) if parent != Path::new("") => parent.to_path_buf(),
                _ => PathBuf::from("."),
            },
        };
        let mut roots = vec![folder, above, PathBuf::from(".")];
        let mut seen = Vec::new();
        roots.retain(|root| match root.canonicalize() {
            Ok(real) if !seen.contains(&real) => {
                seen.push(real);
                true
            }
            _ => false,
        });
        let source = read_main(main, &name)?;
        let mut bundle = Bundle::default();
        bundle.files.insert(name.clone(), Source::new(source));
        Ok((Self { roots, main: main.into(), bundle, frozen: false }, name))
    }

    /// A library of the files in `bundle` alone.
    pub(crate) fn frozen(bundle: Bundle) -> Self {
        Self { roots: Vec::new(), main: PathBuf::new(), bundle, frozen: true }
    }

    pub(crate) fn bundle(&self) -> &Bundle {
        &self.bundle
    }

    /// Names of the files read so far.
    pub(crate) fn names(&self) -> Vec<String> {
        self.bundle.files.keys().cloned().collect()
    }

    /// Text of a file that was read before.
    pub(crate) fn text(&self, file: &str) -> Result<String, ScriptError> {
        let source = self.bundle.files.get(file).ok_or_else(|| ScriptError::new(file, "was not read"))?;
        lua_text(file, &source.bytes)
    }

    /// Bytes of a file that was read before.
    pub(crate) fn bytes(&self, file: &str) -> Option<Arc<[u8]>> {
        self.bundle.files.get(file).map(|source| source.bytes.clone())
    }

    /// Finds the file of a module (`experts.pick_place`). The message of an error is a fragment without a position.
    pub(crate) fn module(&mut self, module: &str) -> Result<String, String> {
        let plain = |part: &str| {
            !part.is_empty() && part.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
        };
        if !module.split('.').all(plain) {
            return Err(format!(
                "require {module:?}: a module is named by words joined with dots, such as \"experts.pick_place\", \
                 and lies inside the project; paths are refused"
            ));
        }
        let path = format!("{}.lua", module.replace('.', "/"));
        self.find(module, None, &[format!("scripts/{path}"), format!("suites/{path}"), path.clone()]).map_err(
            |problem| match problem {
                Problem::Frozen => format!(
                    "require {module:?}: the module was not loaded when the plan was made; \
                     require it at the top of the file"
                ),
                Problem::Missing => format!(
                    "require {module:?}: no {path} in {} nor in the standard library{}",
                    self.places(),
                    self.close_module(module).map(|m| format!("; did you mean {m:?}?")).unwrap_or_default()
                ),
                Problem::Other(text) => format!("require {module:?}: {text}"),
            },
        )
    }

    /// Finds a data file (a mesh) by its relative path: next to the Lua file `requester` first, then below the roots.
    pub(crate) fn data(&mut self, path: &str, requester: Option<&str>) -> Result<String, String> {
        let inside =
            |part: &str| !part.is_empty() && part != "." && part != ".." && !part.contains(['\\', '\0', ':']);
        if !path.split('/').all(inside) {
            return Err(format!(
                "{path:?} leads out of the project; give a path inside of it without \"..\""
            ));
        }
        let folder = requester.map(|file| file.rsplit_once('/').map_or("", |(folder, _)| folder));
        let sibling =
            folder.map(|folder| if folder.is_empty() { path.to_owned() } else { format!("{folder}/{path}") });
        // No path holds a colon, so one folder's file is never taken for another's.
        let key = format!("{}:{path}", folder.unwrap_or_default());
        self.find(&key, sibling, &[path.to_string()]).map_err(|problem| match problem {
            Problem::Frozen => {
                format!("{path:?} was not read when the plan was made; build the shape in the file itself")
            }
            Problem::Missing => match requester {
                Some(requester) => format!("no file {path:?} next to {requester}, nor in {}", self.places()),
                None => format!("no file {path:?} in {}", self.places()),
            },
            Problem::Other(text) => text,
        })
    }

    /// Finds a data file by its path from the project's root; `None` if there is no such file.
    pub(crate) fn data_if_there(&mut self, path: &str) -> Result<Option<String>, String> {
        if self.bundle.absent.contains(path) {
            return Ok(None);
        }
        match self.find(path, None, &[path.to_string()]) {
            Ok(file) => Ok(Some(file)),
            Err(Problem::Missing) => {
                self.bundle.absent.insert(path.to_string());
                Ok(None)
            }
            Err(Problem::Frozen) => Err(format!(
                "{path:?} was not read when the plan was made; request it at the top of the file"
            )),
            Err(Problem::Other(text)) => Err(text),
        }
    }

    /// Finds the file of `key`: at the path `first`, else at the first of `candidates` below the roots, on disk or embedded.
    fn find(&mut self, key: &str, first: Option<String>, candidates: &[String]) -> Result<String, Problem> {
        if let Some(file) = self.bundle.served.get(key) {
            return Ok(file.clone());
        }
        if self.frozen {
            return Err(Problem::Frozen);
        }
        // The order of candidates counts more than that of roots: require "shifts" means scripts/shifts.lua, though
        // suites/shifts.lua may be nearer. A main file is never taken for the module of its name, which it may require.
        let on_disk = candidates.iter().flat_map(|c| self.roots.iter().map(move |root| root.join(c)));
        let main = self.main.canonicalize().ok();
        let other = |path: &PathBuf| main.is_none() || path.canonicalize().ok() != main;
        let on_disk = first.iter().map(PathBuf::from).chain(on_disk);
        let found = match on_disk.into_iter().find(|path| path.is_file() && other(path)) {
            Some(path) => (display(&path), self.read_inside(&path)?),
            None => {
                let all = first.iter().chain(candidates);
                let embedded = all.into_iter().find_map(|c| Some((c.clone(), embedded(c)?.to_vec())));
                embedded.ok_or(Problem::Missing)?
            }
        };
        self.bundle.served.insert(key.into(), found.0.clone());
        self.bundle.files.entry(found.0.clone()).or_insert_with(|| Source::new(found.1));
        Ok(found.0)
    }

    /// Reads a file unless it is a link that leads out of the roots.
    fn read_inside(&self, path: &Path) -> Result<Vec<u8>, Problem> {
        let real = path.canonicalize().map_err(|e| Problem::Other(format!("{}: {e}", display(path))))?;
        let inside =
            self.roots.iter().filter_map(|root| root.canonicalize().ok()).any(|root| real.starts_with(root));
        if !inside {
            return Err(Problem::Other(format!("{} is a link that leads out of the project", display(path))));
        }
        read(path).map_err(|e| Problem::Other(format!("{}: {e}", display(path))))
    }

    fn places(&self) -> String {
        let names: Vec<_> = self.roots.iter().map(|root| format!("{:?}", display(root))).collect();
        names.join(", ")
    }

    fn close_module(&self, module: &str) -> Option<String> {
        let mut names = Vec::new();
        for (dir, strip) in [(&SCRIPTS, true), (&SUITES, true), (&ASSETS, false)] {
            collect(dir, &mut names);
            if !strip {
                names.iter_mut().filter(|n| !n.contains('.')).for_each(|n| *n = format!("assets.{n}"));
            }
        }
        suggest(module, names.iter().map(String::as_str)).map(str::to_string)
    }
}

enum Problem {
    Frozen,
    Missing,
    Other(String),
}

fn collect(dir: &Dir<'_>, names: &mut Vec<String>) {
    for file in dir.files() {
        if let Some(stem) = file.path().to_str().and_then(|p| p.strip_suffix(".lua")) {
            names.push(stem.replace('/', "."));
        }
    }
    dir.dirs().for_each(|inner| collect(inner, names));
}

/// Text of a file of the embedded library by its path in the repository (`suites/…`, `scripts/…`, `assets/…`).
pub fn embedded(path: &str) -> Option<&'static [u8]> {
    let (tree, rest) = path.split_once('/')?;
    let dir = match tree {
        "scripts" => &SCRIPTS,
        "suites" => &SUITES,
        "assets" => &ASSETS,
        _ => return None,
    };
    dir.get_file(rest).map(include_dir::File::contents)
}

/// Paths of the embedded Lua files of a tree (`suites`, `scripts` or `assets`, or a folder of one), sorted.
pub fn embedded_scripts(tree: &str) -> Vec<String> {
    let (root, folder) = tree.split_once('/').map_or((tree, None), |(root, folder)| (root, Some(folder)));
    let whole = match root {
        "scripts" => &SCRIPTS,
        "suites" => &SUITES,
        "assets" => &ASSETS,
        _ => return Vec::new(),
    };
    let Some(dir) = folder.map_or(Some(whole), |folder| whole.get_dir(folder)) else { return Vec::new() };
    let mut names = Vec::new();
    collect(dir, &mut names);
    names.iter_mut().for_each(|name| *name = format!("{root}/{}.lua", name.replace('.', "/")));
    names.sort();
    names
}

fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // The size of a pipe or a device is only known once it is read.
    fs::File::open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > MAX_BYTES {
        true => Err(std::io::Error::other(format!("is larger than {} MiB", MAX_BYTES >> 20))),
        false => Ok(bytes),
    }
}

fn read_main(main: &Path, name: &str) -> Result<Vec<u8>, ScriptError> {
    if main.is_dir() {
        return Err(ScriptError::new(name, "is a folder, not a Lua file").hint("name a file inside of it"));
    }
    match read(main) {
        Ok(bytes) => Ok(bytes),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => match embedded(name) {
            Some(bytes) => Ok(bytes.to_vec()),
            None => Err(missing(main, name)),
        },
        Err(error) => Err(ScriptError::new(name, format!("cannot be read: {error}"))),
    }
}

fn missing(main: &Path, name: &str) -> ScriptError {
    let mut known: Vec<String> =
        ["scripts", "suites"].iter().flat_map(|tree| embedded_scripts(tree)).collect();
    let folder = main.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."));
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    known.extend(entries.map(|e| display(&e.path())).filter(|n| n.ends_with(".lua")));
    let error = ScriptError::new(name, "no such file");
    match suggest(name, known.iter().map(String::as_str)) {
        Some(close) => error.hint(format!("did you mean {close}?")),
        None => error.hint("give the path of a Lua file; `softvt list suites` shows the standard ones"),
    }
}

/// The source text of a file: UTF-8, not byte code, with a `#!` line turned into a comment.
pub(crate) fn lua_text(file: &str, bytes: &[u8]) -> Result<String, ScriptError> {
    if bytes.first() == Some(&0x1b) {
        return Err(ScriptError::new(file, "is compiled byte code; only Lua source text is run")
            .hint("give the .lua file that it was compiled from"));
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        ScriptError::new(file, "is not UTF-8 text").at(Some(line)).hint("save the file as UTF-8")
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    Ok(if text.starts_with("#!") { format!("--{text}") } else { text.to_string() })
}

/// A path in messages: as given, with forward slashes and no leading `./`.
fn display(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    match text.strip_prefix("./") {
        Some(rest) if !rest.is_empty() => rest.to_string(),
        _ => text,
    }
}
