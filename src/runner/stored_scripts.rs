//! The scripts and calibrations that a run was made from, kept in its folder, so that its episodes can be repeated when
//! the files have changed or are elsewhere.

use std::{
    collections::{BTreeMap, BTreeSet},
    error::Error,
    fs::File,
    io::{self, Read, Write},
    path::Path,
    sync::Arc,
};

use serde::{Deserialize, Serialize};
use softvt_common::{
    digest::sha256_hex,
    files::{self, FileError},
};
use softvt_runs::run_folder::{RUN, SCRIPTS};
use softvt_script::{LoadedScript, ScriptFiles};
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

use crate::error::RunError;

/// Entry that lists the other entries of the archive.
const INDEX: &str = "index.json";
/// Largest sum of the files of the archive, its index included, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// Largest index, bytes.
const MAX_INDEX_BYTES: u64 = 4 << 20;

/// The scripts and calibrations of a stored run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StoredScripts {
    main: String,
    scripts: ScriptFiles,
    /// Calibration files, by path below a project folder.
    calibrations: BTreeMap<String, String>,
}

#[derive(Serialize, Deserialize)]
struct Index {
    main: String,
    /// Entry of each script, by its name.
    files: BTreeMap<String, String>,
    served: BTreeMap<String, String>,
    absent: BTreeSet<String>,
    refused: BTreeMap<String, String>,
    hidden: BTreeSet<String>,
    /// Entry of each calibration file, by its path.
    calibrations: BTreeMap<String, String>,
}

impl StoredScripts {
    pub(crate) fn new(loaded: &LoadedScript, calibrations: BTreeMap<String, String>) -> Self {
        let scripts = (*loaded.sources.bundle).clone();
        Self { main: loaded.sources.main.clone(), scripts, calibrations }
    }

    /// Runs the main file with its options, and makes its plan.
    pub(crate) fn load(&self, options: &[String]) -> Result<LoadedScript, RunError> {
        Ok(softvt_script::load_files(&self.main, self.scripts.clone(), options)?)
    }

    /// A calibration file by its path below a project folder.
    pub(crate) fn calibration(&self, path: &str) -> Option<&str> {
        self.calibrations.get(path).map(String::as_str)
    }

    /// Writes the archive into a run folder, unless it is there.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), RunError> {
        let path = folder.join(SCRIPTS);
        if path.exists() {
            return Ok(());
        }
        let bytes = self.archive().map_err(|error| {
            RunError::input(format_args!("{}: the scripts cannot be packed: {error}", path.display()))
        })?;
        Ok(files::replace(&path, &bytes)?)
    }

    /// The bytes of the archive, which depend on the files alone.
    fn archive(&self) -> Result<Vec<u8>, Box<dyn Error>> {
        let mut entries: Vec<(String, &[u8])> = Vec::new();
        let mut add = |kind: &str, (name, bytes): (&String, _)| {
            let file = Path::new(name).file_name().map_or("file".into(), |name| name.to_string_lossy());
            let entry = format!("{kind}/{:03}-{file}", entries.len());
            entries.push((entry.clone(), bytes));
            (name.clone(), entry)
        };
        let files =
            self.scripts.files.iter().map(|(name, bytes)| add("scripts", (name, &bytes[..]))).collect();
        let texts = self.calibrations.iter().map(|(name, text)| add("calibration", (name, text.as_bytes())));
        let index = Index {
            main: self.main.clone(),
            calibrations: texts.collect(),
            files,
            served: self.scripts.served.clone(),
            absent: self.scripts.absent.clone(),
            refused: self.scripts.refused.clone(),
            hidden: self.scripts.hidden.clone(),
        };
        let index = serde_json::to_vec_pretty(&index)?;
        let sizes = entries.iter().map(|(_, bytes)| bytes.len() as u64);
        if sizes.sum::<u64>() + index.len() as u64 > MAX_BYTES || index.len() as u64 > MAX_INDEX_BYTES {
            return Err(too_large().into());
        }
        let mut zip = ZipWriter::new(io::Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
        for (name, bytes) in std::iter::once((INDEX.to_owned(), &index[..])).chain(entries) {
            zip.start_file(name, options)?;
            zip.write_all(bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    }

    /// Reads the archive of a run folder; `None` if it has none. `sources` are the SHA-256 of the files by their names,
    /// as `run.json` states them.
    pub(crate) fn read(
        folder: &Path,
        sources: &BTreeMap<String, String>,
    ) -> Result<Option<Arc<Self>>, RunError> {
        let path = folder.join(SCRIPTS);
        if !path.is_file() {
            return Ok(None);
        }
        let file = File::open(&path).map_err(FileError::io("read", &path))?;
        let read = || -> Result<Self, Box<dyn Error>> {
            let mut archive = ZipArchive::new(file)?;
            let mut left = MAX_BYTES;
            let mut entry = |name: &str, limit: u64| -> Result<Vec<u8>, Box<dyn Error>> {
                let mut bytes = Vec::new();
                let limit = limit.min(left);
                archive.by_name(name)?.take(limit + 1).read_to_end(&mut bytes)?;
                if bytes.len() as u64 > limit {
                    return Err(too_large().into());
                }
                left -= bytes.len() as u64;
                Ok(bytes)
            };
            let index: Index = serde_json::from_slice(&entry(INDEX, MAX_INDEX_BYTES)?)?;
            let mut file = |name: &str, of: &str| -> Result<Vec<u8>, Box<dyn Error>> {
                let bytes = entry(of, MAX_BYTES)?;
                match sources.get(name) == Some(&sha256_hex(&bytes)) {
                    true => Ok(bytes),
                    false => Err(format!("{name} in it is not that of {RUN}").into()),
                }
            };
            let mut scripts = ScriptFiles {
                served: index.served,
                absent: index.absent,
                refused: index.refused,
                hidden: index.hidden,
                ..ScriptFiles::default()
            };
            for (name, of) in index.files {
                let bytes = file(&name, &of)?;
                scripts.files.insert(name, bytes.into());
            }
            let mut calibrations = BTreeMap::new();
            // Calibrations of scenes that are no episodes of the run are not listed, and not used.
            for (name, of) in index.calibrations.into_iter().filter(|(name, _)| sources.contains_key(name)) {
                let text = String::from_utf8(file(&name, &of)?)?;
                calibrations.insert(name, text);
            }
            Ok(Self { main: index.main, scripts, calibrations })
        };
        let stored = read().map_err(|error| {
            let message = format!("{}: {error}; the archive is damaged, and without it", path.display());
            RunError::input(format_args!("{message} the scripts on the disk are used: remove it to do so"))
        })?;
        Ok(Some(Arc::new(stored)))
    }
}

fn too_large() -> String {
    format!("its files are larger than {} MiB together", MAX_BYTES >> 20)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_archive_comes_back_and_has_the_same_bytes_each_time() {
        let text = |text: &str| Arc::<[u8]>::from(text.as_bytes());
        let scripts = ScriptFiles {
            files: [
                ("/home/me/a.lua".to_owned(), text("return 1")),
                ("b/a.lua".to_owned(), text("return 2")),
            ]
            .into(),
            served: [("b.a".to_owned(), "b/a.lua".to_owned())].into(),
            absent: ["mesh.obj".to_owned()].into(),
            ..ScriptFiles::default()
        };
        let calibrations = [("assets/calibration/bun.json".to_owned(), "{}".to_owned())].into();
        let stored = StoredScripts { main: "/home/me/a.lua".to_owned(), scripts, calibrations };
        let mut sources = stored.scripts.hashes();
        sources.insert("assets/calibration/bun.json".to_owned(), sha256_hex("{}"));
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(StoredScripts::read(folder.path(), &sources).unwrap(), None);
        stored.write(folder.path()).unwrap();
        assert_eq!(*StoredScripts::read(folder.path(), &sources).unwrap().unwrap(), stored);
        assert_eq!(stored.archive().unwrap(), stored.archive().unwrap());
        for name in ["b/a.lua", "assets/calibration/bun.json"] {
            let mut others = sources.clone();
            others.insert(name.to_owned(), sha256_hex("easier"));
            let error = StoredScripts::read(folder.path(), &others).unwrap_err().to_string();
            assert!(error.contains(&format!("{name} in it is not that of run.json")), "{error}");
        }
        std::fs::write(folder.path().join(SCRIPTS), "no archive").unwrap();
        let error = StoredScripts::read(folder.path(), &sources).unwrap_err().to_string();
        assert!(error.contains("scripts.zip") && error.contains("damaged"), "{error}");
    }

    #[test]
    fn an_archive_of_many_large_files_is_refused_before_it_fills_the_memory() {
        let large = vec![0; 60 << 20];
        let (hash, names) = (sha256_hex(&large), (0..3000).map(|number| number.to_string()));
        let files: BTreeMap<String, &str> = names.map(|name| (name, "entry")).collect();
        let sources = files.keys().map(|name| (name.clone(), hash.clone())).collect();
        let index = json!({
            "main": "0", "files": files, "served": {}, "absent": [], "refused": {}, "hidden": [], "calibrations": {},
        });
        let folder = tempfile::tempdir().unwrap();
        let mut zip = ZipWriter::new(File::create(folder.path().join(SCRIPTS)).unwrap());
        for (name, content) in [(INDEX, index.to_string().as_bytes()), ("entry", &large)] {
            zip.start_file(name, SimpleFileOptions::default()).unwrap();
            zip.write_all(content).unwrap();
        }
        zip.finish().unwrap();
        let error = StoredScripts::read(folder.path(), &sources).unwrap_err().to_string();
        assert!(error.contains("larger than 256 MiB together"), "{error}");
    }
}
