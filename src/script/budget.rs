//! Memory of host objects (pictures, shapes, masks), which the machine's own limit does not see.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use mlua::Lua;

use super::sandbox::{fail, shared};

/// Bytes that the host objects of one machine may take together.
const MOST_BYTES: usize = 512 << 20;

/// What the host objects of one machine take, bytes.
#[derive(Clone, Debug, Default)]
pub(super) struct Budget(Arc<AtomicUsize>);

/// A share of a budget, given back when it is dropped.
#[derive(Debug)]
pub(super) struct Held {
    budget: Budget,
    bytes: usize,
}

impl Drop for Held {
    fn drop(&mut self) {
        self.budget.0.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// Takes `bytes` of the machine's budget; what the script has dropped is collected first where they do not fit.
///
/// # Errors
/// If there are not so many left, at the script's line.
pub(super) fn hold(lua: &Lua, bytes: usize) -> mlua::Result<Held> {
    let budget = shared(lua)?.budget.clone();
    let fits = || budget.0.load(Ordering::Relaxed).saturating_add(bytes) <= MOST_BYTES;
    if !fits() {
        lua.gc_collect()?;
    }
    if !fits() {
        let most = MOST_BYTES >> 20;
        return Err(fail(
            lua,
            format!(
                "the script holds more than {most} MiB of pictures, shapes and masks; keep fewer or smaller ones"
            ),
        ));
    }
    budget.0.fetch_add(bytes, Ordering::Relaxed);
    Ok(Held { budget: budget.clone(), bytes })
}
