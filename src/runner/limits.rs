//! Deformation limits of the objects of an episode.
//!
//! A limit is looked up for every soft object that the scene of an episode has, by the name of its asset and the
//! fingerprint of the asset as its file defines it. A layout or shift that changes stiffness, density, friction, colour
//! or scale leaves the limit valid ([`Object::departure`]). An instance with another stable strain has a limit of its
//! own, read off the press of the asset.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use crate::{config::RunConfig, error::RunError, observer::Observer, stored_scripts::StoredScripts};
use softvt_common::{digest::sha256_hex, episode_id::EpisodeIndex, files, parallel::lock, text::counted};
use softvt_evaluation::{
    instance::{InstanceFactors, InstancePresses},
    safety::{DeformationLimit, NOMINAL_KAPPA},
    thresholds::ThresholdFile,
};
use softvt_scene::{Body, Object, Scene};

/// Folders above a script in which its calibration files are searched, the script's own included.
const MAX_PARENT_FOLDERS: usize = 3;

/// The calibration files of a script. Each is read when an object first needs it.
pub(crate) struct CalibrationFiles {
    script: PathBuf,
    stored: Option<Arc<StoredScripts>>,
    read: Mutex<BTreeMap<String, Option<Arc<CalibrationFile>>>>,
    /// Messages about missing limits that were told.
    reported: Mutex<BTreeSet<String>>,
    observer: Arc<dyn Observer>,
}

#[derive(Debug)]
struct CalibrationFile {
    /// Path below a project folder.
    relative_path: String,
    /// Path as messages show it.
    path: String,
    sha256: String,
    text: String,
    thresholds: ThresholdFile,
}

impl CalibrationFile {
    /// Limit of an object: that of its asset, and with a stable strain of its own that of the instance.
    fn limit(&self, object: &Object) -> Option<DeformationLimit> {
        let name = &object.nominal.name;
        let of_asset = self.thresholds.limit(name)?;
        let strain = object.strain_factor().unwrap_or(1.0);
        if strain == 1.0 {
            return Some(of_asset);
        }
        let factors = InstanceFactors {
            scale: object.scale,
            youngs: object.youngs_factor().unwrap_or(1.0),
            strain,
            ..InstanceFactors::NOMINAL
        };
        InstancePresses::new(self.thresholds.envelopes.get(name)?, of_asset.kappa).limit(&factors)
    }
}

/// Limits of the soft objects of one scene.
#[derive(Debug, Default)]
pub(crate) struct SceneLimits {
    /// By name of the object in the scene.
    pub by_object: BTreeMap<String, DeformationLimit>,
    /// Names of the assets of all soft objects.
    assets: BTreeSet<String>,
    /// One message per object without a limit.
    missing: Vec<String>,
}

impl CalibrationFiles {
    /// The files above a script, or those of a stored run.
    pub(crate) fn new(config: &RunConfig) -> Self {
        Self {
            script: config.file.clone(),
            stored: config.stored_scripts.clone(),
            read: Mutex::default(),
            reported: Mutex::default(),
            observer: config.observer.clone(),
        }
    }

    /// Limits of the soft objects of a scene. `targets` are the objects that the task moves.
    pub(crate) fn limits_of(&self, scene: &Scene, targets: &[&str]) -> Result<SceneLimits, RunError> {
        let mut found = SceneLimits::default();
        for object in scene.objects.iter().filter(|object| matches!(object.asset.body, Body::Soft(_))) {
            found.assets.insert(object.nominal.name.clone());
            match self.limit_of(object, targets.contains(&object.name.as_str()))? {
                Ok(limit) => drop(found.by_object.insert(object.name.clone(), limit)),
                Err(message) => found.missing.push(message),
            }
        }
        Ok(found)
    }

    /// The limit of an object, or the message with the remedy if it has none.
    fn limit_of(
        &self,
        object: &Object,
        is_target: bool,
    ) -> Result<Result<DeformationLimit, String>, RunError> {
        let asset = &object.nominal;
        let name = &asset.name;
        let effect = match is_target {
            true => "its episodes cannot be judged safe",
            false => "harm to it cannot be judged (others_ok is null)",
        };
        let remedy = format!("{effect}; calibrate it: softvt scripts/calibrate.lua --asset {name}");
        let Some(file) = self.file(name)? else {
            return Ok(Err(format!("{name} is not calibrated (no {}): {remedy}", relative_path(name))));
        };
        let path = &file.path;
        Ok(match (file.thresholds.fingerprints.get(name), object.departure()) {
            (calibrated, _) if calibrated != Some(&asset.fingerprint()) => Err(format!(
                "{path} was computed for a different version of {name:?} (its shape, material or friction differ): {remedy}"
            )),
            (_, Some(change)) => Err(format!(
                "no limit for object {:?}: it has {change} of asset {name:?}, which makes it another object: {effect}; \
                 define an asset of its own and calibrate it",
                object.name
            )),
            (_, None) => file.limit(object).ok_or_else(|| {
                format!("{path} has no limit for {name:?}, since no row of its sweep is stable: {remedy}")
            }),
        })
    }

    /// The calibration file of an asset, if there is one.
    fn file(&self, asset: &str) -> Result<Option<Arc<CalibrationFile>>, RunError> {
        let mut read = lock(&self.read);
        if let Some(known) = read.get(asset) {
            return Ok(known.clone());
        }
        let relative_path = relative_path(asset);
        let file = self
            .find(&relative_path)?
            .map(|ProjectFile { text, path }| -> Result<_, RunError> {
                let thresholds = ThresholdFile::parse(&text, &path)?;
                let sha256 = sha256_hex(&text);
                Ok(Arc::new(CalibrationFile { relative_path, path, sha256, text, thresholds }))
            })
            .transpose()?;
        read.insert(asset.to_owned(), file.clone());
        Ok(file)
    }

    fn find(&self, relative_path: &str) -> Result<Option<ProjectFile>, RunError> {
        let Some(stored) = &self.stored else { return find_file(&self.script, relative_path) };
        let path = || format!("{relative_path} (of the run)");
        Ok(stored.calibration(relative_path).map(|text| ProjectFile { text: text.to_owned(), path: path() }))
    }

    /// The files that have been read, by their path below a project folder.
    pub(crate) fn texts(&self) -> BTreeMap<String, String> {
        let read = lock(&self.read);
        let files = read.values().flatten();
        files.map(|file| (file.relative_path.clone(), file.text.clone())).collect()
    }

    /// Tells the messages of a scene about missing limits, each once per run.
    pub(crate) fn report(&self, index: EpisodeIndex, limits: &SceneLimits) {
        for message in &limits.missing {
            self.report_once(message, &format!("{index}: {message}"));
        }
    }

    /// Tells `text`, which has a message, unless the message was told before.
    fn report_once(&self, message: &str, text: &str) {
        if lock(&self.reported).insert(message.to_owned()) {
            self.observer.notice(text);
        }
    }
}

fn relative_path(asset: &str) -> String {
    format!("assets/calibration/{asset}.json")
}

#[derive(Debug, Default)]
pub(crate) struct LimitScan {
    scenes: usize,
    assets: BTreeSet<String>,
    /// Messages about missing limits, with the scenes concerned.
    missing: BTreeMap<String, Vec<EpisodeIndex>>,
}

impl LimitScan {
    pub(crate) fn add(&mut self, index: EpisodeIndex, limits: SceneLimits) {
        self.scenes += 1;
        self.assets.extend(limits.assets);
        for message in limits.missing.into_iter().collect::<BTreeSet<_>>() {
            self.missing.entry(message).or_default().push(index);
        }
    }

    /// Tells each missing limit, and the episodes concerned unless all are.
    pub(crate) fn report(&self, files: &CalibrationFiles) {
        for (message, scenes) in &self.missing {
            let others = match scenes.len() - 1 {
                0 => String::new(),
                others => format!(" and {}", counted(others, "other episode")),
            };
            match scenes.len() == self.scenes {
                true => files.report_once(message, message),
                false => files.report_once(message, &format!("{}{others}: {message}", scenes[0])),
            }
        }
    }

    /// The calibrations of the assets that were found.
    pub(crate) fn calibrations(&self, files: &CalibrationFiles) -> Calibrations {
        let mut found = Calibrations::default();
        let read = lock(&files.read);
        for asset in &self.assets {
            let file = read.get(asset).and_then(Option::as_ref);
            let limit = file.and_then(|file| file.thresholds.limit(asset));
            found.tau_pct.insert(asset.clone(), limit.map(|limit| limit.tau_pct()));
            if let Some(file) = file {
                found.sources.insert(file.relative_path.clone(), file.sha256.clone());
                found.merged.merge(file.thresholds.clone());
            }
        }
        found
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Calibrations {
    /// τ by asset, %; `None` without a calibration.
    pub tau_pct: BTreeMap<String, Option<f64>>,
    /// SHA-256 of the calibration files, by path below a project folder.
    pub sources: BTreeMap<String, String>,
    /// All of them, merged into a file in the format of SoftVTBench.
    pub merged: ThresholdFile,
}

impl Default for Calibrations {
    fn default() -> Self {
        let generated_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
        let merged = ThresholdFile::new(NOMINAL_KAPPA, Vec::new(), generated_by);
        Self { tau_pct: BTreeMap::new(), sources: BTreeMap::new(), merged }
    }
}

/// A file of a project, with its path as messages show it.
struct ProjectFile {
    text: String,
    path: String,
}

/// Reads a file from the folders above the script, the working folder or the embedded library, in this order.
fn find_file(script: &Path, relative_path: &str) -> Result<Option<ProjectFile>, RunError> {
    let parents = script.parent().into_iter().flat_map(Path::ancestors).take(MAX_PARENT_FOLDERS);
    for root in parents.chain([Path::new("")]) {
        let path = root.join(relative_path);
        if path.is_file() {
            return Ok(Some(ProjectFile {
                text: files::read_text(&path)?,
                path: path.display().to_string(),
            }));
        }
    }
    let embedded = softvt_script::embedded(relative_path).and_then(|bytes| std::str::from_utf8(bytes).ok());
    Ok(embedded
        .map(|text| ProjectFile { text: text.to_owned(), path: format!("{relative_path} (embedded)") }))
}
