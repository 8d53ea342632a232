//! The cache of this process: its folder by environment variables, and its limit.

use std::{env, ffi::OsString, path::PathBuf};

use etcetera::BaseStrategy;

use softvt_common::disk_cache::DiskCache;

/// Environment variable with the folder.
pub(crate) const FOLDER: &str = "SOFTVT_CACHE_DIR";
/// Environment variable that switches the cache off.
pub(crate) const OFF: &str = "SOFTVT_NO_CACHE";
/// Largest size of the cache, bytes.
pub(crate) const LIMIT: u64 = 1 << 30;

/// The folder of the cache, by default the platform's for the user. `None` if it is switched off, or if there
/// is no home folder.
pub(crate) fn folder() -> Option<PathBuf> {
    if is_off() {
        return None;
    }
    let of_user = || Some(etcetera::base_strategy::choose_native_strategy().ok()?.cache_dir().join("softvt"));
    variable(FOLDER).map(PathBuf::from).or_else(of_user)
}

/// True if the user has switched the cache off.
pub(crate) fn is_off() -> bool {
    variable(OFF).is_some()
}

pub(crate) fn share() {
    if let Some(folder) = folder() {
        let report = |problem: &str| {
            notice!(
                "warning: {problem}; results are the same, but each start computes everything anew; set {FOLDER} to another \
                 folder, or {OFF}=1"
            );
        };
        DiskCache::new(folder, LIMIT, report).share();
    }
}

fn variable(name: &str) -> Option<OsString> {
    env::var_os(name).filter(|value| !value.is_empty())
}
