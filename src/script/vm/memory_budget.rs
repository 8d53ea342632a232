//! Memory of host objects (pictures, shapes, masks, worlds), which the machine's own limit does not see.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use mlua::Lua;

use crate::script::vm::{fail, shared};

/// Bytes that the pictures, shapes and masks of one machine may take together.
const MOST_OBJECTS: usize = 512 << 20;
/// The same of its worlds and simulations: one body of 32 voxels along its edge takes half of it.
const MOST_WORLDS: usize = 4 << 30;

/// What the host objects of one kind take in one machine, bytes.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    used: Arc<AtomicUsize>,
    most: usize,
    of: &'static str,
}

/// The budgets of one machine.
#[derive(Clone, Debug)]
pub(crate) struct Budgets {
    objects: Budget,
    worlds: Budget,
}

impl Default for Budgets {
    fn default() -> Self {
        let budget = |most, of| Budget { used: Arc::default(), most, of };
        Self {
            objects: budget(MOST_OBJECTS, "pictures, shapes and masks; keep fewer or smaller ones"),
            worlds: budget(
                MOST_WORLDS,
                "worlds and simulations; keep fewer, or give bodies a lower resolution",
            ),
        }
    }
}

/// A share of a budget, given back when it is dropped.
#[derive(Debug)]
pub(crate) struct Held {
    used: Arc<AtomicUsize>,
    bytes: usize,
}

impl Drop for Held {
    fn drop(&mut self) {
        self.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl Budget {
    fn hold(&self, lua: &Lua, bytes: usize) -> mlua::Result<Held> {
        let fits = || self.used.load(Ordering::Relaxed).saturating_add(bytes) <= self.most;
        if !fits() {
            lua.gc_collect()?;
        }
        if !fits() {
            let Self { most, of, .. } = self;
            return Err(fail(lua, format!("the script holds more than {} MiB of {of}", most >> 20)));
        }
        self.used.fetch_add(bytes, Ordering::Relaxed);
        Ok(Held { used: self.used.clone(), bytes })
    }
}

/// Takes `bytes` for a picture, shape or mask; what the script has dropped is collected first where they do not fit.
///
/// # Errors
/// If there are not so many left, at the script's line.
pub(crate) fn hold(lua: &Lua, bytes: usize) -> mlua::Result<Held> {
    shared(lua)?.budgets.objects.hold(lua, bytes)
}

/// The same for what is in a world.
///
/// # Errors
/// As [`hold`].
pub(crate) fn hold_in_world(lua: &Lua, bytes: usize) -> mlua::Result<Held> {
    shared(lua)?.budgets.worlds.hold(lua, bytes)
}
