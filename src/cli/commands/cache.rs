//! `softvt cache`: the folder in which derived data are kept.

use clap::Args;

use crate::{
    cache::{FOLDER, LIMIT, OFF, folder, is_off},
    error::CliError,
};
use softvt_common::{
    disk_cache::{CacheUsage, clear, usage},
    text::counted,
};

/// Show or clear the cache of meshes, textures and masses, which makes commands start faster
#[derive(Args, Debug)]
pub(crate) struct CacheArgs {
    /// Remove all entries
    #[arg(long)]
    clear: bool,
}

/// Prints what the cache contains, or what was removed.
pub(super) fn run(args: &CacheArgs) -> Result<(), CliError> {
    let Some(folder) = folder() else {
        let why = match is_off() {
            true => format!("{OFF} is set"),
            false => format!("there is no home folder; {FOLDER} names another one"),
        };
        return out!("the cache is off: {why}\n");
    };
    let place = folder.display();
    let of_folder = |error| CliError::input(format_args!("cannot use the cache folder {place}: {error}"));
    if args.clear {
        let CacheUsage { entries, bytes } = clear(&folder).map_err(of_folder)?;
        return out!("removed {}, {} MB, from {place}\n", counted(entries, "file"), megabytes(bytes));
    }
    let CacheUsage { entries, bytes } = usage(&folder).map_err(of_folder)?;
    out!(
        "folder   {place}\nentries  {entries}\nsize     {} MB\nlimit    {} MB\n",
        megabytes(bytes),
        megabytes(LIMIT)
    )
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / 1e6)
}
