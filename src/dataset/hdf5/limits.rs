//! Limits on the structure of a file. A crafted file of a few kilobytes can state arrays and groups without end; they
//! are refused before memory is allocated for them.

use rust_hdf5::{H5Dataset, H5Group, Hdf5Error, LinkClass, StorageLayout};

/// Depth of groups below a demonstration.
const MAX_DEPTH: usize = 16;
/// Number of groups and datasets of a demonstration.
const MAX_NAMES: usize = 4096;
/// Number of axes of an array.
const MAX_RANK: usize = 8;
/// Size of an array in memory, and of one of its chunks.
const MAX_BYTES: usize = 1 << 31;
/// Number of chunks of an array.
const MAX_CHUNKS: usize = 1 << 20;

/// An object of the file that is not read.
pub(super) struct Refusal {
    /// Path below the group at which the search began.
    pub name: String,
    pub what: String,
}

/// Reason for which [`dataset_names`] stops.
pub(super) enum ListError {
    Refused(Refusal),
    Hdf5(Hdf5Error),
}

impl From<Hdf5Error> for ListError {
    fn from(error: Hdf5Error) -> Self {
        Self::Hdf5(error)
    }
}

/// Paths of all datasets below a group, relative to it.
///
/// # Errors
/// The file is damaged, or its groups are too deep, too many, or links.
pub(super) fn dataset_names(group: &H5Group) -> Result<Vec<String>, ListError> {
    let mut names = Vec::new();
    collect(group, "", 0, &mut 0, &mut names)?;
    Ok(names)
}

fn collect(
    group: &H5Group,
    above: &str,
    depth: usize,
    visited: &mut usize,
    names: &mut Vec<String>,
) -> Result<(), ListError> {
    let refuse = |name: String, what: String| Err(ListError::Refused(Refusal { name, what }));
    let (datasets, groups) = (group.dataset_names()?, group.group_names()?);
    *visited += datasets.len() + groups.len();
    if *visited > MAX_NAMES {
        let what = format!("the demonstration has more than {MAX_NAMES} groups and datasets");
        return refuse(above.trim_end_matches('/').to_owned(), what);
    }
    if depth > MAX_DEPTH {
        let what = format!("its groups are nested more than {MAX_DEPTH} deep");
        return refuse(above.trim_end_matches('/').to_owned(), what);
    }
    names.extend(datasets.iter().map(|name| format!("{above}{name}")));
    for name in groups {
        let path = format!("{above}{name}");
        if let Some(what) = link(group, &name) {
            return refuse(path, what);
        }
        collect(&group.group(&name)?, &format!("{path}/"), depth + 1, visited, names)?;
    }
    Ok(())
}

/// The object that `name` is a link to, as an error; `None` if it lies in `group` itself or is missing.
pub(super) fn link(group: &H5Group, name: &str) -> Option<String> {
    let target = match group.link_class(name) {
        Ok(LinkClass::Soft { path }) => path,
        Ok(LinkClass::External { file, path }) => format!("{path} in the file {file}"),
        Ok(LinkClass::UserDefined { link_type }) => {
            format!("an object of the user-defined class {link_type}")
        }
        // The library opens a group under the first path that leads to it.
        Ok(LinkClass::Hard) | Err(_) => {
            let opened = group.group(name).ok()?.name().to_owned();
            let own = format!("{}/{name}", group.name().trim_end_matches('/'));
            if opened == own {
                return None;
            }
            opened
        }
    };
    Some(format!("it is a link to {target}; expected the data itself"))
}

/// Reason for which an array is not read, if there is one.
pub(super) fn array_refusal(data: &H5Dataset) -> Result<Option<String>, Hdf5Error> {
    let elsewhere = "its numbers lie in other files; expected the data itself";
    if data.storage_layout()? == StorageLayout::Virtual {
        return Ok(Some(format!("it is a virtual array: {elsewhere}")));
    }
    if !data.external_files()?.is_empty() {
        return Ok(Some(elsewhere.to_owned()));
    }
    let shape = data.shape();
    if shape.len() > MAX_RANK {
        return Ok(Some(format!("it has {} axes; at most {MAX_RANK} are read", shape.len())));
    }
    if let Some(what) = size_refusal(&shape, data.element_size()) {
        return Ok(Some(what));
    }
    let Some(chunk) = data.chunk_dims() else { return Ok(None) };
    if product(&chunk, data.element_size()).is_none() {
        return Ok(Some(format!("its chunks of shape {chunk:?} are above 2 GiB")));
    }
    let chunks = shape.iter().zip(&chunk).map(|(length, per_chunk)| length.div_ceil((*per_chunk).max(1)));
    let count = chunks.fold(1, usize::saturating_mul);
    Ok((count > MAX_CHUNKS).then(|| format!("it has {count} chunks; at most {MAX_CHUNKS} are read")))
}

/// Reason for which an array of this shape, with elements of `bytes`, is not held in memory.
pub(super) fn size_refusal(shape: &[usize], bytes: usize) -> Option<String> {
    product(shape, bytes).is_none().then(|| format!("its shape {shape:?} is above 2 GiB"))
}

/// Size of an array in bytes; `None` above [`MAX_BYTES`].
fn product(shape: &[usize], bytes: usize) -> Option<usize> {
    let size = shape.iter().copied().fold(bytes.max(1), usize::saturating_mul);
    (size <= MAX_BYTES).then_some(size)
}
