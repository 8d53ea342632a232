//! Lua source files and data files: from the project's folders first, then from the library embedded in the binary.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::{Arc, LazyLock, Mutex},
};

use include_dir::{Dir, include_dir};

use super::{
    error::{ScriptError, SourceLine},
    privilege::is_hidden_path,
};
use softvt_common::{digest::sha256_hex, text::suggest};

/// Contents of the embedded files by their paths in the repository.
static EMBEDDED: LazyLock<BTreeMap<String, &'static [u8]>> = LazyLock::new(|| {
    static FOLDERS: [(&str, Dir<'_>); 3] = [
        ("scripts", include_dir!("$CARGO_MANIFEST_DIR/../../scripts")),
        ("suites", include_dir!("$CARGO_MANIFEST_DIR/../../suites")),
        ("assets", include_dir!("$CARGO_MANIFEST_DIR/../../assets")),
    ];
    fn collect(root: &str, dir: &'static Dir<'_>, files: &mut BTreeMap<String, &'static [u8]>) {
        for file in dir.files() {
            files.insert(format!("{root}/{}", display(file.path())), file.contents());
        }
        dir.dirs().for_each(|inner| collect(root, inner, files));
    }
    let mut files = BTreeMap::new();
    FOLDERS.iter().for_each(|(root, dir)| collect(root, dir, &mut files));
    files
});

/// The embedded scripts with limits or materials of objects.
static HIDDEN: LazyLock<BTreeMap<&str, &[u8]>> = LazyLock::new(|| {
    let hidden = EMBEDDED.iter().filter(|(path, _)| is_script(path) && is_hidden_path(Path::new(path)));
    hidden.map(|(path, bytes)| (path.as_str(), *bytes)).collect()
});

fn is_script(path: &str) -> bool {
    path.ends_with(".lua")
}

/// Requests that may fail in one script.
const MAX_REFUSED: usize = 1000;

/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Every file that a script has read. Episodes run on a bundle and never read the disk again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScriptFiles {
    /// Contents of the files by their name in messages.
    pub files: BTreeMap<String, Arc<[u8]>>,
    /// The file found for each module or data file that was requested.
    pub served: BTreeMap<String, String>,
    pub absent: BTreeSet<String>,
    /// Messages about the modules and data files that could not be used. An episode repeats them, so that a script
    /// cannot tell an episode from the run that made its plan.
    pub refused: BTreeMap<String, String>,
    /// Names of the modules with limits or materials of objects, of those that a policy requested.
    pub hidden: BTreeSet<String>,
}

impl ScriptFiles {
    /// SHA-256 of every file by its name.
    pub fn hashes(&self) -> BTreeMap<String, String> {
        self.files.iter().map(|(name, bytes)| (name.clone(), sha256_hex(bytes))).collect()
    }
}

/// A module or data file cannot be used. The text is a fragment without a position.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LibraryError {
    #[error("{0}")]
    Late(String),
    #[error("{0}")]
    Missing(String),
    #[error("{0}")]
    Refused(String),
}

#[derive(Clone, Debug)]
pub(crate) struct FoundFile {
    pub name: String,
    pub bytes: Arc<[u8]>,
}

/// The library that a virtual machine reads from.
pub(crate) type SharedLibrary = Arc<Mutex<Library>>;

#[derive(Debug)]
pub(crate) struct Library {
    roots: Vec<PathBuf>,
    /// The main file, which cannot be required as a module.
    main: PathBuf,
    pub bundle: ScriptFiles,
    is_frozen: bool,
}

impl Library {
    /// Opens the library of the script at `main` and reads that file; also returns its name in messages.
    pub(crate) fn open(main: &Path) -> Result<(Self, String), ScriptError> {
        let name = display(main);
        let folder = folder_of(main);
        let above = if folder == Path::new(".") { PathBuf::from("..") } else { folder_of(&folder) };
        let mut roots = vec![folder, above, PathBuf::from(".")];
        let mut seen = BTreeSet::new();
        roots.retain(|root| root.canonicalize().is_ok_and(|real| seen.insert(real)));
        let mut bundle = ScriptFiles::default();
        bundle.files.insert(name.clone(), read_main(main, &name)?.into());
        Ok((Self { roots, main: main.into(), bundle, is_frozen: false }, name))
    }

    /// A library of the files in `bundle` alone.
    pub(crate) fn frozen(bundle: ScriptFiles) -> Self {
        Self { roots: Vec::new(), main: PathBuf::new(), bundle, is_frozen: true }
    }

    pub(crate) fn text(&self, file: &str) -> Result<String, ScriptError> {
        match self.bundle.files.get(file) {
            Some(bytes) => lua_text(file, bytes),
            None => Err(ScriptError::new(file, "was not read")),
        }
    }

    pub(crate) fn module(&mut self, module: &str) -> Result<FoundFile, LibraryError> {
        self.repeatable(module, |library| library.find_module(module))
    }

    /// The result of `find`, or the message with which the same request failed before.
    fn repeatable<T>(
        &mut self,
        key: &str,
        find: impl FnOnce(&mut Self) -> Result<T, LibraryError>,
    ) -> Result<T, LibraryError> {
        if let Some(message) = self.bundle.refused.get(key) {
            return Err(LibraryError::Refused(message.clone()));
        }
        if self.bundle.refused.len() >= MAX_REFUSED && !self.bundle.served.contains_key(key) {
            let many = format!(
                "{key:?}: more than {MAX_REFUSED} modules and files were requested that are not there"
            );
            return Err(LibraryError::Refused(many));
        }
        let found = find(self);
        if let Err(error) = &found
            && !self.is_frozen
        {
            self.bundle.refused.insert(key.into(), error.to_string());
        }
        found
    }

    fn find_module(&mut self, module: &str) -> Result<FoundFile, LibraryError> {
        let is_plain = |part: &str| {
            !part.is_empty() && part.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
        };
        let refused = |message: String| LibraryError::Refused(format!("require {module:?}: {message}"));
        if !module.split('.').all(is_plain) {
            return Err(refused(
                "a module is named by words joined with dots, such as \"experts.pick_place\", and lies inside the \
                 project; paths are refused"
                    .to_owned(),
            ));
        }
        let path = format!("{}.lua", module.replace('.', "/"));
        let candidates = [format!("scripts/{path}"), format!("suites/{path}"), path.clone()];
        let found = self.find(module, None, &candidates, "require it at the top of the file");
        found.map_err(|error| refused(error.to_string()))?.ok_or_else(|| {
            let mut names: Vec<String> =
                ["scripts", "suites", "assets"].into_iter().flat_map(module_names).collect();
            names.extend(self.modules_beside(&path));
            let close = suggest(module, names.iter().map(String::as_str));
            let suggestion = close.map_or(String::new(), |close| format!("; did you mean {close:?}?"));
            let roots = self.root_names();
            refused(format!("no {path} in {roots} nor in the standard library{suggestion}"))
        })
    }

    /// True if a module has limits or materials of objects: by its path, and by its content, since a link or a copy
    /// may have any name.
    pub(crate) fn is_hidden(&mut self, file: &FoundFile) -> bool {
        if self.is_frozen || self.bundle.hidden.contains(&file.name) {
            return self.bundle.hidden.contains(&file.name);
        }
        let path = Path::new(&file.name);
        let is_hidden = is_hidden_path(path)
            || path.canonicalize().is_ok_and(|real| is_hidden_path(&real))
            || self.is_copy_of_hidden(&file.bytes);
        if is_hidden {
            self.bundle.hidden.insert(file.name.clone());
        }
        is_hidden
    }

    /// True if a hidden file of the embedded library or below the roots has this content.
    fn is_copy_of_hidden(&self, bytes: &[u8]) -> bool {
        if HIDDEN.values().any(|hidden| *hidden == bytes) {
            return true;
        }
        let is_same = |path: PathBuf| {
            fs::metadata(&path).is_ok_and(|file| file.len() == bytes.len() as u64)
                && read(&path).is_ok_and(|other| other == bytes)
        };
        self.roots.iter().any(|root| {
            let assets = fs::read_dir(root.join("assets")).into_iter().flatten().flatten();
            let assets = assets.map(|entry| entry.path());
            assets.chain(HIDDEN.keys().map(|path| root.join(path))).any(is_same)
        })
    }

    /// Finds a data file (a mesh) by its relative path: next to the Lua file `requester` first, then below the roots.
    pub(crate) fn data(&mut self, path: &str, requester: Option<&str>) -> Result<FoundFile, LibraryError> {
        if !is_inside(path) {
            let message =
                format!("{path:?} leads out of the project; give a path inside of it without \"..\"");
            return Err(LibraryError::Refused(message));
        }
        let folder = requester.map(|file| file.rsplit_once('/').map_or("", |(folder, _)| folder));
        let sibling =
            folder.map(|folder| if folder.is_empty() { path.to_owned() } else { format!("{folder}/{path}") });
        // No path holds a colon, so one folder's file is never taken for another's.
        let key = format!("{}:{path}", folder.unwrap_or_default());
        self.repeatable(&key, |library| {
            let hint = "build the shape in the file itself";
            library.find(&key, sibling, &[path.to_string()], hint)?.ok_or_else(|| {
                let next_to = requester.map_or(String::new(), |file| format!("next to {file}, nor "));
                LibraryError::Missing(format!("no file {path:?} {next_to}in {}", library.root_names()))
            })
        })
    }

    /// Finds a data file by its path from the project's root; `None` if there is no such file.
    pub(crate) fn optional_data(&mut self, path: &str) -> Result<Option<FoundFile>, LibraryError> {
        if self.bundle.absent.contains(path) {
            return Ok(None);
        }
        let hint = "request it at the top of the file";
        let found = self.repeatable(path, |library| library.find(path, None, &[path.to_string()], hint))?;
        if found.is_none() {
            self.bundle.absent.insert(path.to_string());
        }
        Ok(found)
    }

    /// Finds the file of `key`: at the path `first`, else at the first of `candidates` below the roots, on disk or
    /// embedded. `hint` is the advice for a file that a frozen library has not read before.
    fn find(
        &mut self,
        key: &str,
        first: Option<String>,
        candidates: &[String],
        hint: &str,
    ) -> Result<Option<FoundFile>, LibraryError> {
        if let Some(name) = self.bundle.served.get(key) {
            let bytes = self.bundle.files.get(name).cloned().unwrap_or_default();
            return Ok(Some(FoundFile { name: name.clone(), bytes }));
        }
        if self.is_frozen {
            let path = candidates.last().map_or(key, String::as_str);
            return Err(LibraryError::Late(format!("{path:?} was not read when the plan was made; {hint}")));
        }
        // The order of candidates counts more than that of roots: require "shifts" means scripts/shifts.lua, though
        // suites/shifts.lua may be nearer. A main file is never taken for the module of its name, which it may require.
        let on_disk = candidates.iter().flat_map(|c| self.roots.iter().map(move |root| root.join(c)));
        let main = self.main.canonicalize().ok();
        let is_other = |path: &PathBuf| main.is_none() || path.canonicalize().ok() != main;
        let mut on_disk = first.iter().map(PathBuf::from).chain(on_disk);
        let (name, bytes) = match on_disk.find(|path| path.is_file() && is_other(path)) {
            Some(path) => (display(&path), self.read_inside(&path)?),
            None => {
                let mut all = first.iter().chain(candidates);
                let Some(found) = all.find_map(|path| Some((path.clone(), embedded(path)?.to_vec()))) else {
                    return Ok(None);
                };
                found
            }
        };
        self.bundle.served.insert(key.into(), name.clone());
        let bytes = self.bundle.files.entry(name.clone()).or_insert_with(|| bytes.into()).clone();
        Ok(Some(FoundFile { name, bytes }))
    }

    /// Reads a file unless it is a link that leads out of the roots.
    fn read_inside(&self, path: &Path) -> Result<Vec<u8>, LibraryError> {
        let error = |error: io::Error| LibraryError::Refused(format!("{}: {error}", display(path)));
        let real = path.canonicalize().map_err(error)?;
        let is_inside = |root: &PathBuf| root.canonicalize().is_ok_and(|root| real.starts_with(root));
        if !self.roots.iter().any(is_inside) {
            let message = format!("{} is a link that leads out of the project", display(path));
            return Err(LibraryError::Refused(message));
        }
        read(path).map_err(error)
    }

    /// Names of the modules of the project in the folder of a module's `path`.
    fn modules_beside(&self, path: &str) -> Vec<String> {
        let folder = Path::new(path).parent().unwrap_or(Path::new(""));
        let entries = self
            .roots
            .iter()
            .flat_map(|root| fs::read_dir(root.join(folder)).into_iter().flatten().flatten());
        let files = entries.map(|entry| folder.join(entry.file_name()));
        let scripts = files.filter(|file| file.extension().is_some_and(|extension| extension == "lua"));
        let mut names: Vec<String> =
            scripts.map(|file| display(&file.with_extension("")).replace('/', ".")).collect();
        names.sort();
        names
    }

    fn root_names(&self) -> String {
        let names: Vec<_> = self.roots.iter().map(|root| format!("{:?}", display(root))).collect();
        names.join(", ")
    }
}

/// True for a relative path with forward slashes that leads into its folder.
pub(crate) fn is_inside(path: &str) -> bool {
    path.split('/').all(|part| !matches!(part, "" | "." | "..") && !part.contains(['\\', '\0', ':']))
}

/// The folder of a path; `.` if the path has none.
fn folder_of(path: &Path) -> PathBuf {
    path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new(".")).to_path_buf()
}

/// Content of a file of the embedded library by its path in the repository (`suites/…`, `scripts/…`, `assets/…`).
pub fn embedded(path: &str) -> Option<&'static [u8]> {
    EMBEDDED.get(path).copied()
}

/// Paths of the embedded Lua files of a tree (`suites`, `scripts` or `assets`, or a folder of one), sorted.
pub fn embedded_scripts(tree: &str) -> Vec<String> {
    let folder = format!("{tree}/");
    EMBEDDED.keys().filter(|path| path.starts_with(&folder) && is_script(path)).cloned().collect()
}

/// Names by which the embedded Lua files of a tree are required.
fn module_names(tree: &str) -> Vec<String> {
    let name = |path: &String| {
        let path = path.trim_end_matches(".lua");
        path.strip_prefix("scripts/").or(path.strip_prefix("suites/")).unwrap_or(path).replace('/', ".")
    };
    embedded_scripts(tree).iter().map(name).collect()
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    // Opening a named pipe would wait for a writer.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("is a pipe or a device, not a file"));
    }
    let mut bytes = Vec::new();
    // The file may grow while it is read.
    fs::File::open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > MAX_BYTES {
        true => Err(io::Error::other(format!("is larger than {} MiB", MAX_BYTES >> 20))),
        false => Ok(bytes),
    }
}

fn read_main(main: &Path, name: &str) -> Result<Vec<u8>, ScriptError> {
    if main.is_dir() {
        let hint = match main.join("run.json").is_file() {
            true => "it is a run folder, which softvt report, watch and compare take",
            false => "name a file inside of it",
        };
        return Err(ScriptError::new(name, "is a folder, not a Lua file").hint(hint));
    }
    match read(main) {
        Ok(bytes) => Ok(bytes),
        Err(error) if error.kind() == io::ErrorKind::NotFound => match embedded(name) {
            Some(bytes) => Ok(bytes.to_vec()),
            None => Err(missing(main, name)),
        },
        Err(error) => Err(ScriptError::new(name, format!("cannot be read: {error}"))),
    }
}

fn missing(main: &Path, name: &str) -> ScriptError {
    let mut known: Vec<String> =
        ["scripts", "suites"].iter().flat_map(|tree| embedded_scripts(tree)).collect();
    let folders = [folder_of(main), Path::new("suites").to_owned()];
    let entries = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
    known.extend(entries.map(|e| display(&e.path())).filter(|n| is_script(n)));
    let error = ScriptError::new(name, "no such file");
    // Folders and endings are alike, and would make distant names close.
    let stem = |path: &str| Path::new(path).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let stems: Vec<String> = known.iter().filter_map(|path| stem(path)).collect();
    let close = suggest(&stem(name).unwrap_or_default(), stems.iter().map(String::as_str));
    // Of several, that of the suites.
    match close.and_then(|close| known.iter().filter(|path| stem(path).as_deref() == Some(close)).max()) {
        Some(close) => error.hint(format!("did you mean {close}?")),
        None => error.hint("give the path of a Lua file; the standard suites are in suites/"),
    }
}

/// The source text of a file: UTF-8, not byte code, with a `#!` line turned into a comment.
pub(crate) fn lua_text(file: &str, bytes: &[u8]) -> Result<String, ScriptError> {
    if bytes.first() == Some(&0x1b) {
        let error = ScriptError::new(file, "is compiled byte code; only Lua source text is run");
        return Err(error.hint("give the .lua file that it was compiled from"));
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        let place = SourceLine { file: file.to_owned(), line };
        ScriptError::new(file, "is not UTF-8 text").at(Some(place)).hint("save the file as UTF-8")
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
