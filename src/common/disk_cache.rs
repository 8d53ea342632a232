//! A cache on disk for values that follow from their inputs alone and take long to compute.
//!
//! An entry is a file, named after the SHA-256 of what the value was computed from, of this executable and of the
//! format. An entry therefore never becomes wrong, and several processes can share a folder: files are written under
//! another name and renamed, and their checksum, which covers the name, is verified when they are read. Whatever is
//! wrong with the folder, values are computed. Users who share one trust each other: a checksum is no signature.
//!
//! When all are too large, entries that were never read are removed before those that were, as in a segmented LRU cache
//! (Karedla, Love and Wherry, 1994): a run with hundreds of instances writes many values that no other run needs.
//!
//! Of the cache crates, databases are damaged or locked as a whole, and `cacache`, with a file per value, has no limit
//! of its size.

use std::{
    fs::{self, File, OpenOptions},
    hash::{BuildHasher, RandomState},
    io::{self, Read, Write},
    path::{Path, PathBuf},
    sync::{
        Arc, LazyLock, Mutex, OnceLock,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant, SystemTime},
};

use serde::{Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};

use crate::{parallel::lock, text::hex};

const FORMAT: u32 = 2;
const MAGIC: &[u8; 8] = b"softvt\x00\x02";
const EXTENSION: &str = "softvt";
const PARTIAL: &str = "part";
/// Largest entry that is written or read, bytes.
const MAX_ENTRY_BYTES: u64 = 256 << 20;
/// Values that are computed faster than this are not stored.
const MIN_TIME: Duration = Duration::from_millis(1);
/// Interval at which the time of the last use of an entry is updated.
const USE_INTERVAL: Duration = Duration::from_secs(60);
/// Age that a new entry begins with. Until it is read, it is removed before all that were read within this time.
const UNREAD_AGE: Duration = Duration::from_secs(24 * 3600);
/// Age from which an unfinished file belongs to a process that was killed.
const STALE_AGE: Duration = Duration::from_secs(3600);
/// Share of the limit that remains when entries are removed.
const KEPT_SHARE: f64 = 0.8;

static OF_PROCESS: OnceLock<DiskCache> = OnceLock::new();

/// Values on disk, by kind and inputs. Clones share the folder.
#[derive(Clone, Debug)]
pub struct DiskCache(Option<Arc<CacheFolder>>);

/// The cache of the process: that of [`DiskCache::share`], otherwise none.
impl Default for DiskCache {
    fn default() -> Self {
        OF_PROCESS.get().cloned().unwrap_or(Self::DISABLED)
    }
}

#[derive(Debug)]
struct CacheFolder {
    path: PathBuf,
    /// Largest size of all entries, bytes.
    limit: u64,
    /// Told at most once that the folder cannot be used.
    report: fn(&str),
    state: Mutex<FolderState>,
}

#[derive(Debug, Default)]
struct FolderState {
    /// Size of all entries, bytes; known from the first write on.
    size: Option<u64>,
    /// True once something could not be read or written: it was reported, and nothing is written any more.
    has_failed: bool,
}

/// Name of an entry: what it is, and the hash of everything it depends on.
#[derive(Clone, Debug, Serialize)]
pub struct CacheKey {
    kind: &'static str,
    hash: String,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CacheUsage {
    pub entries: usize,
    /// Their size, bytes.
    pub bytes: u64,
}

impl DiskCache {
    pub const DISABLED: Self = Self(None);

    /// A cache in a folder, which is created with the first entry. When the entries exceed `limit` bytes, those that
    /// were never read are removed, then the least recently used ones. `report` is called at most once, with why the
    /// folder cannot be used.
    pub fn new(folder: impl Into<PathBuf>, limit: u64, report: fn(&str)) -> Self {
        let state = Mutex::default();
        Self(Some(Arc::new(CacheFolder { path: folder.into(), limit, report, state })))
    }

    /// Makes this the cache of the process, which `DiskCache::default()` returns. Only the first call has an effect.
    pub fn share(self) {
        let _ = OF_PROCESS.set(self);
    }

    /// True if it is in use: not [disabled](Self::DISABLED), and nothing has failed.
    pub fn is_in_use(&self) -> bool {
        self.0.as_ref().is_some_and(|folder| !lock(&folder.state).has_failed) && code_version().is_some()
    }

    /// Key of a value of this kind; `inputs` is all it depends on except for the code. `None` if nothing is stored.
    pub fn key(&self, kind: &'static str, inputs: &impl Serialize) -> Option<CacheKey> {
        self.0.as_ref()?;
        let code = code_version()?;
        let inputs = postcard::to_allocvec(inputs).ok()?;
        let mut hash = Sha256::new();
        for part in [code.as_bytes(), kind.as_bytes(), &inputs] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
        Some(CacheKey { kind, hash: hex(&hash.finalize()[..16]) })
    }

    /// The value of these inputs: a stored one, otherwise that of `compute`, which is stored if that took long.
    pub fn get<V: Serialize + DeserializeOwned, E>(
        &self,
        kind: &'static str,
        inputs: &impl Serialize,
        compute: impl FnOnce() -> Result<V, E>,
    ) -> Result<V, E> {
        let Some(key) = self.key(kind, inputs) else { return compute() };
        if let Some(value) = self.read(&key) {
            return Ok(value);
        }
        let begin = Instant::now();
        let value = compute()?;
        if begin.elapsed() >= MIN_TIME {
            self.write(&key, &value);
        }
        Ok(value)
    }

    /// The stored value of a key. `None` without one, or if it is damaged.
    pub fn read<V: DeserializeOwned>(&self, key: &CacheKey) -> Option<V> {
        let folder = self.0.as_ref()?;
        match read_entry(&folder.path, &key.file_name()) {
            Ok(content) => postcard::from_bytes(&content?).ok(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => {
                folder.fail("read", &error);
                None
            }
        }
    }

    /// Stores a value, if the folder allows it.
    pub fn write(&self, key: &CacheKey, value: &impl Serialize) {
        let Some(folder) = &self.0 else { return };
        if lock(&folder.state).has_failed {
            return;
        }
        let Ok(content) = postcard::to_allocvec(value) else { return };
        let size = (MAGIC.len() + Sha256::output_size() + content.len()) as u64;
        if size > folder.limit.min(MAX_ENTRY_BYTES) {
            return;
        }
        match write_entry(&folder.path, &key.file_name(), &content) {
            Ok(()) => folder.keep_within_limit(size),
            Err(error) => folder.fail("write to", &error),
        }
    }
}

impl CacheKey {
    fn file_name(&self) -> String {
        format!("{}-{}.{EXTENSION}", self.kind, self.hash)
    }
}

impl CacheFolder {
    /// Reports the first failure; later ones are its consequences.
    fn fail(&self, action: &str, error: &io::Error) {
        if !std::mem::replace(&mut lock(&self.state).has_failed, true) {
            (self.report)(&format!("cannot {action} the cache folder {}: {error}", self.path.display()));
        }
    }

    /// Counts an entry of `size` bytes that was written, and removes the least recently used ones if all are too large.
    fn keep_within_limit(&self, size: u64) {
        let mut state = lock(&self.state);
        // The size of a folder that was just listed includes the entry.
        let total = match state.size {
            Some(before) => before + size,
            None => usage(&self.path).map_or(size, |usage| usage.bytes),
        };
        state.size = Some(total);
        if total <= self.limit {
            return;
        }
        let mut entries = list(&self.path).unwrap_or_default();
        entries.sort_by_key(|entry| entry.used);
        let mut left: u64 = entries.iter().map(|entry| entry.bytes).sum();
        for entry in entries {
            if left as f64 <= KEPT_SHARE * self.limit as f64 {
                break;
            }
            // Another process may have removed it.
            let _ = fs::remove_file(&entry.path);
            left -= entry.bytes;
        }
        state.size = Some(left);
    }
}

/// Version of the code that computes the values, identified by the executable, since the version of the package does
/// not change with every change of the code. `None` if the executable cannot be found.
fn code_version() -> Option<&'static str> {
    static VERSION: OnceLock<Option<String>> = OnceLock::new();
    let version = VERSION.get_or_init(|| {
        let file = std::env::current_exe().and_then(fs::metadata).ok()?;
        let age = file.modified().ok()?.duration_since(SystemTime::UNIX_EPOCH).ok()?;
        Some(format!(
            "{} {FORMAT} {} {} {} {}",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::OS,
            std::env::consts::ARCH,
            file.len(),
            age.as_nanos()
        ))
    });
    version.as_deref()
}

fn checksum(name: &str, content: &[u8]) -> [u8; 32] {
    Sha256::new().chain_update(name).chain_update(content).finalize().into()
}

/// The content of an entry; `None` if it is damaged, too large or no regular file.
fn read_entry(folder: &Path, name: &str) -> io::Result<Option<Vec<u8>>> {
    let path = folder.join(name);
    // Before it is opened: a pipe would wait for a writer.
    let metadata = fs::metadata(&path)?;
    if !metadata.is_file() || metadata.len() > MAX_ENTRY_BYTES {
        return Ok(None);
    }
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    (&mut file).take(MAX_ENTRY_BYTES).read_to_end(&mut bytes)?;
    if metadata.modified()?.elapsed().is_ok_and(|age| age > USE_INTERVAL) {
        // Another user's file keeps its time.
        let _ = file.set_modified(SystemTime::now());
    }
    let sound = || {
        let (sum, content) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<32>()?;
        (*sum == checksum(name, content)).then(|| content.to_vec())
    };
    Ok(sound())
}

/// Writes an entry under another name and renames it. It need not survive a power failure: its checksum would tell.
fn write_entry(folder: &Path, name: &str, content: &[u8]) -> io::Result<()> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    /// A random number: in two containers, processes can have equal ids.
    static PROCESS: LazyLock<u64> = LazyLock::new(|| RandomState::new().hash_one(std::process::id()));
    fs::create_dir_all(folder)?;
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let partial = folder.join(format!("{name}.{:016x}-{number}.{PARTIAL}", *PROCESS));
    let mut file = OpenOptions::new().write(true).create_new(true).open(&partial)?;
    let mut write = || {
        [MAGIC, &checksum(name, content)[..], content].iter().try_for_each(|part| file.write_all(part))?;
        fs::rename(&partial, folder.join(name))
    };
    write().inspect_err(|_| drop(fs::remove_file(&partial)))?;
    // Only now: an unfinished file of that age would be taken for one of a killed process.
    let _ = file.set_modified(SystemTime::now() - UNREAD_AGE);
    Ok(())
}

struct Entry {
    path: PathBuf,
    bytes: u64,
    used: SystemTime,
}

/// The entries of a folder. Removes what killed processes left.
fn list(folder: &Path) -> io::Result<Vec<Entry>> {
    let files = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound && !folder.is_symlink() => {
            return Ok(Vec::new());
        }
        files => files?,
    };
    let mut entries = Vec::new();
    for file in files {
        let path = file?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Others may remove files meanwhile.
        let Ok(metadata) = fs::symlink_metadata(&path) else { continue };
        if !metadata.is_file() {
            continue;
        }
        let used = metadata.modified()?;
        if is_entry(&name) {
            entries.push(Entry { path, bytes: metadata.len(), used });
        } else if is_partial(&name) && used.elapsed().is_ok_and(|age| age > STALE_AGE) {
            let _ = fs::remove_file(&path);
        }
    }
    Ok(entries)
}

/// True for the file name of an entry. A folder that the user names may hold other files too.
fn is_entry(name: &str) -> bool {
    let parts = name.strip_suffix(EXTENSION).and_then(|name| name.strip_suffix('.')?.rsplit_once('-'));
    parts.is_some_and(|(kind, hash)| {
        kind.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-')
            && hash.len() == 32
            && hash.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
    })
}

fn is_partial(name: &str) -> bool {
    let entry = name.strip_suffix(PARTIAL).and_then(|name| name.strip_suffix('.')?.rsplit_once('.'));
    entry.is_some_and(|(entry, _)| is_entry(entry))
}

/// Number and size of the values in a folder; none if it does not exist.
pub fn usage(folder: &Path) -> io::Result<CacheUsage> {
    let entries = list(folder)?;
    Ok(CacheUsage { entries: entries.len(), bytes: entries.iter().map(|entry| entry.bytes).sum() })
}

/// Removes all values of a folder, and returns what they were. Other files stay.
///
/// # Errors
/// The folder cannot be read, or a value cannot be removed; all others are removed.
pub fn clear(folder: &Path) -> io::Result<CacheUsage> {
    let mut removed = CacheUsage::default();
    let mut failure = None;
    for Entry { path, bytes, .. } in list(folder)? {
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => failure = Some(error),
            _ => removed = CacheUsage { entries: removed.entries + 1, bytes: removed.bytes + bytes },
        }
    }
    failure.map_or(Ok(removed), Err)
}

#[cfg(test)]
mod tests {
    use std::{convert::Infallible, sync::atomic::AtomicUsize, thread::sleep};

    use super::*;

    const LIMIT: u64 = 1 << 20;

    /// Twice a number, and how often it was computed.
    fn double(cache: &DiskCache, number: u64, count: &AtomicUsize) -> u64 {
        let Ok(value) = cache.get("double", &number, || {
            count.fetch_add(1, Ordering::Relaxed);
            sleep(2 * MIN_TIME);
            Ok::<_, Infallible>(2 * number)
        });
        value
    }

    fn silent(folder: &Path) -> DiskCache {
        DiskCache::new(folder, LIMIT, |message| panic!("{message}"))
    }

    fn only_file(folder: &Path) -> PathBuf {
        let files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect();
        assert_eq!(files.len(), 1, "{files:?}");
        files[0].clone()
    }

    #[test]
    fn a_value_is_computed_once_and_found_by_other_processes() {
        let (root, count) = (tempfile::tempdir().unwrap(), AtomicUsize::new(0));
        let folder = root.path().join("new/folder");
        for _ in 0..3 {
            // Each cache stands for a process.
            assert_eq!(double(&silent(&folder), 21, &count), 42);
        }
        assert_eq!(count.load(Ordering::Relaxed), 1);
        assert_eq!(usage(&folder).unwrap().entries, 1);
        assert_eq!(double(&silent(&folder), 4, &count), 8, "other inputs are another entry");
        assert_eq!(clear(&folder).unwrap().entries, 2);
        assert_eq!(double(&DiskCache::DISABLED, 21, &count), 42);
        assert!(silent(&folder).is_in_use() && !DiskCache::DISABLED.is_in_use());
        assert_eq!((count.load(Ordering::Relaxed), usage(&folder).unwrap()), (3, CacheUsage::default()));
    }

    #[test]
    fn a_damaged_entry_is_computed_again_and_replaced() {
        let (root, count) = (tempfile::tempdir().unwrap(), AtomicUsize::new(0));
        let value = || double(&silent(root.path()), 21, &count);
        value();
        let path = only_file(root.path());
        let sound = fs::read(&path).unwrap();
        let mut flipped = sound.clone();
        *flipped.last_mut().unwrap() ^= 1;
        let damages = [Vec::new(), sound[..sound.len() - 1].to_vec(), flipped, b"another file".to_vec()];
        for (index, damaged) in damages.into_iter().enumerate() {
            fs::write(&path, damaged).unwrap();
            assert_eq!(value(), 42);
            assert_eq!(count.load(Ordering::Relaxed), index + 2);
            assert_eq!(fs::read(only_file(root.path())).unwrap(), sound);
        }
    }

    #[test]
    fn the_content_of_another_entry_is_damaged() {
        let (root, count) = (tempfile::tempdir().unwrap(), AtomicUsize::new(0));
        let value = |number| double(&silent(root.path()), number, &count);
        value(21);
        let first = only_file(root.path());
        let content = fs::read(&first).unwrap();
        fs::remove_file(&first).unwrap();
        value(4);
        let second = only_file(root.path());
        fs::write(&second, &content).unwrap();
        assert_eq!((value(4), count.load(Ordering::Relaxed)), (8, 3));
        // Under the name of the other kind.
        let cache = silent(root.path());
        let half = cache.key("half", &21_u64).unwrap();
        fs::write(root.path().join(half.file_name()), &content).unwrap();
        assert_eq!(cache.read::<u64>(&half), None);
    }

    #[cfg(unix)]
    #[test]
    fn pipes_devices_and_files_of_any_length_are_not_read() {
        let (root, count) = (tempfile::tempdir().unwrap(), AtomicUsize::new(0));
        let value = || double(&silent(root.path()), 21, &count);
        value();
        let path = only_file(root.path());
        let replacements: [&dyn Fn(); 3] = [
            &|| {
                let made = std::process::Command::new("mkfifo").arg(&path).status().unwrap();
                assert!(made.success());
            },
            &|| std::os::unix::fs::symlink("/dev/zero", &path).unwrap(),
            &|| File::create(&path).unwrap().set_len(20 << 30).unwrap(),
        ];
        for (index, replace) in replacements.iter().enumerate() {
            fs::remove_file(&path).unwrap();
            replace();
            assert_eq!((value(), count.load(Ordering::Relaxed)), (42, index + 2));
            assert!(fs::symlink_metadata(only_file(root.path())).unwrap().is_file(), "it was replaced");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_used_is_reported_once() {
        static REPORTS: AtomicUsize = AtomicUsize::new(0);
        let root = tempfile::tempdir().unwrap();
        // A file in place of the folder: permissions do not stop an administrator.
        let folder = root.path().join("file");
        fs::write(&folder, "").unwrap();
        let cache = DiskCache::new(&folder, LIMIT, |message| {
            assert!(message.contains("file"), "{message}");
            REPORTS.fetch_add(1, Ordering::Relaxed);
        });
        let count = AtomicUsize::new(0);
        assert_eq!([1, 1, 2].map(|number| double(&cache, number, &count)), [2, 2, 4]);
        assert_eq!((count.load(Ordering::Relaxed), REPORTS.load(Ordering::Relaxed)), (3, 1));
        assert!(!cache.is_in_use());
    }

    #[test]
    fn the_least_recently_used_entries_are_removed_and_other_files_stay() {
        let root = tempfile::tempdir().unwrap();
        let cache = DiskCache::new(root.path(), 10_000, |message| panic!("{message}"));
        let other = root.path().join("notes-of-a-user.softvt");
        fs::write(&other, "notes").unwrap();
        let keys: Vec<CacheKey> = (0..12).map(|n| cache.key("block", &n).unwrap()).collect();
        let is_kept = |n: usize| root.path().join(keys[n].file_name()).exists();
        for (n, key) in keys[..10].iter().enumerate() {
            cache.write(key, &vec![7_u8; 900]);
            let path = root.path().join(key.file_name());
            let used = SystemTime::now() - (20 - n as u32) * USE_INTERVAL;
            File::open(path).unwrap().set_modified(used).unwrap();
        }
        assert!(cache.read::<Vec<u8>>(&keys[0]).is_some(), "now it is the most recently used one");
        cache.write(&keys[10], &vec![7_u8; 900]);
        let kept = usage(root.path()).unwrap();
        assert!(kept.bytes <= 8_000 && kept.entries == 8, "{kept:?}");
        assert!(is_kept(0) && is_kept(9) && !is_kept(1) && !is_kept(2));
        assert!(!is_kept(10), "it was never read");
        cache.write(&keys[11], &vec![7_u8; 20_000]);
        assert!(!is_kept(11), "larger than the whole cache");
        clear(root.path()).unwrap();
        assert_eq!(only_file(root.path()), other);
    }

    #[test]
    fn entries_that_were_never_read_are_removed_first() {
        let root = tempfile::tempdir().unwrap();
        let cache = DiskCache::new(root.path(), 10_000, |message| panic!("{message}"));
        let keys: Vec<CacheKey> = (0..40).map(|n| cache.key("block", &n).unwrap()).collect();
        for (number, key) in keys.iter().enumerate() {
            cache.write(key, &vec![7_u8; 900]);
            if number < 4 {
                assert!(cache.read::<Vec<u8>>(key).is_some());
            }
        }
        for key in &keys[..4] {
            assert!(cache.read::<Vec<u8>>(key).is_some(), "it was read, and 36 new ones were not");
        }
        assert!(usage(root.path()).unwrap().bytes <= 10_000);
    }

    #[test]
    fn only_regular_files_with_names_of_entries_are_counted_and_removed() {
        let (root, count) = (tempfile::tempdir().unwrap(), AtomicUsize::new(0));
        double(&silent(root.path()), 21, &count);
        let hash = "0123456789abcdef0123456789abcdef";
        fs::create_dir(root.path().join(format!("mesh-{hash}.softvt"))).unwrap();
        let mut others =
            vec![format!("mesh-{}.softvt", hash.to_uppercase()), format!("My photo-{hash}.softvt")];
        others.iter().for_each(|name| fs::write(root.path().join(name), "mine").unwrap());
        others.push(format!("mesh-{hash}.softvt"));
        assert_eq!(usage(root.path()).unwrap().entries, 1);
        assert_eq!(clear(root.path()).unwrap().entries, 1);
        assert!(others.iter().all(|name| root.path().join(name).exists()));
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 3);
    }

    #[test]
    fn what_a_killed_process_left_is_never_read_and_goes_with_time() {
        let root = tempfile::tempdir().unwrap();
        let cache = silent(root.path());
        let key = cache.key("double", &1_u64).unwrap();
        let left = root.path().join(format!("{}.123-0.{PARTIAL}", key.file_name()));
        fs::write(&left, "half").unwrap();
        assert!(cache.read::<u64>(&key).is_none());
        assert_eq!(usage(root.path()).unwrap().entries, 0);
        assert!(left.exists(), "its process may still write");
        File::open(&left).unwrap().set_modified(SystemTime::now() - 2 * STALE_AGE).unwrap();
        usage(root.path()).unwrap();
        assert!(!left.exists());
    }

    #[test]
    fn many_writers_of_one_entry_leave_a_sound_one() {
        let root = tempfile::tempdir().unwrap();
        let value: Vec<u64> = (0..50_000).collect();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    let cache = silent(root.path());
                    let key = cache.key("numbers", &0).unwrap();
                    for _ in 0..20 {
                        cache.write(&key, &value);
                        assert_eq!(cache.read::<Vec<u64>>(&key).as_ref(), Some(&value));
                    }
                });
            }
        });
        only_file(root.path());
    }
}
