//! Access of a script to what an observation-only policy must not know: the limits and the materials of objects.
//!
//! Plans, experts and experiments have it. A policy declares it in the table that its file returns, which is known only
//! after the file has run. Until then access is granted and its first use is kept, as the error to raise without the
//! declaration.

use std::{
    path::Path,
    sync::{Arc, Mutex},
};

use mlua::Lua;

use super::{
    error::app_data,
    library::{FoundFile, SharedLibrary},
};
use softvt_common::parallel::lock;

/// The access of one virtual machine, as data of its Lua state.
#[derive(Clone)]
pub(crate) struct PrivilegedAccess(Arc<Mutex<Access>>);

enum Access {
    Granted,
    Refused,
    /// The script is a policy that has not declared itself yet. The error is that of its first access.
    Undeclared(Option<mlua::Error>),
}

impl PrivilegedAccess {
    pub(crate) fn granted() -> Self {
        Self(Arc::new(Mutex::new(Access::Granted)))
    }

    /// Begins to keep the first use, for a script that is a policy.
    pub(crate) fn expect_declaration(&self) {
        *lock(&self.0) = Access::Undeclared(None);
    }

    /// Grants or refuses further access, as the policy has declared.
    /// Without privilege the error is that of the first use before.
    pub(crate) fn declare(&self, is_privileged: bool) -> mlua::Result<()> {
        let decided = if is_privileged { Access::Granted } else { Access::Refused };
        match std::mem::replace(&mut *lock(&self.0), decided) {
            Access::Undeclared(Some(error)) if !is_privileged => Err(error),
            _ => Ok(()),
        }
    }
}

pub(crate) fn check_privilege(lua: &Lua, what: &str) -> mlua::Result<()> {
    let access = app_data::<PrivilegedAccess>(lua)?;
    let mut access = lock(&access.0);
    if matches!(*access, Access::Granted) {
        return Ok(());
    }
    let error = fail!(
        lua,
        "{what}: a policy has no access to limits and materials of objects; use its observations, or declare \
             privileged = true in softvt.policy{{…}}, which its results then state"
    );
    match &mut *access {
        Access::Granted => Ok(()),
        Access::Refused => Err(error),
        Access::Undeclared(first) => {
            first.get_or_insert(error);
            Ok(())
        }
    }
}

/// [`check_privilege`] of a module that a script requires, found in `file`.
pub(crate) fn check_module(lua: &Lua, name: &str, file: &FoundFile) -> mlua::Result<()> {
    // The comparison of contents reads other files, which plans need not wait for.
    let access = app_data::<PrivilegedAccess>(lua)?;
    if matches!(*lock(&access.0), Access::Granted) {
        return Ok(());
    }
    let library = app_data::<SharedLibrary>(lua)?;
    let is_hidden = lock(&library).is_hidden(file);
    if is_hidden { check_privilege(lua, &format!("require {name:?}")) } else { Ok(()) }
}

/// True if the Lua file at `path` has limits or materials of objects: assets, strains of materials, and the
/// experts that use them.
pub(crate) fn is_hidden_path(path: &Path) -> bool {
    let of_folder = |folder: &str| path.parent().is_some_and(|parent| parent.ends_with(folder));
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    of_folder("assets")
        || stem == Some("strain_sources")
        || of_folder("experts") && matches!(stem, Some("grasp" | "pick_place" | "blind_grips"))
}
