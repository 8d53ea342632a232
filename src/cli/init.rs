//! `softvt init`: editor stubs for a folder of scripts.

use std::path::Path;

use super::{Failure, files::make_folder, print};
use crate::{
    report::run_folder::replace,
    script::stubs::{LUARC, STUB_FILE, stubs},
};

/// Writes the stubs and the language server's settings into `dir`; an own `.luarc.json` is left alone.
///
/// # Errors
/// A file cannot be written.
pub fn run(dir: &Path) -> Result<(), Failure> {
    let stub = dir.join(STUB_FILE);
    let folder = stub.parent().unwrap_or(dir);
    make_folder(folder)?;
    replace(&stub, stubs()).map_err(Failure::input)?;
    print(&format!("wrote {}\n", stub.display()));
    let settings = dir.join(".luarc.json");
    if settings.exists() {
        print(&format!("left {} as it is\n", settings.display()));
    } else {
        replace(&settings, LUARC).map_err(Failure::input)?;
        print(&format!("wrote {}\n", settings.display()));
    }
    Ok(())
}
