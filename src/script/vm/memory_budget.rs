//! Memory of host objects (images, shapes, masks, worlds), which Lua's own limit does not count.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use mlua::Lua;

use super::error::fail;

/// Bytes that the images, shapes and masks of one virtual machine may take together.
const MAX_OBJECT_BYTES: usize = 512 << 20;
/// The same for its worlds and simulations: one soft body of 32 voxels along its edge takes half of it.
const MAX_WORLD_BYTES: usize = 4 << 30;

/// Bytes used by the host objects of one kind.
#[derive(Clone, Debug)]
struct Budget {
    used: Arc<AtomicUsize>,
    limit: usize,
    /// The counted objects and how to use less memory, for messages.
    what: &'static str,
}

/// The budgets of one virtual machine.
#[derive(Clone, Debug)]
pub(crate) struct Budgets {
    objects: Budget,
    worlds: Budget,
}

impl Default for Budgets {
    fn default() -> Self {
        let budget = |limit, what| Budget { used: Arc::default(), limit, what };
        Self {
            objects: budget(MAX_OBJECT_BYTES, "images, shapes and masks; keep fewer or smaller ones"),
            worlds: budget(
                MAX_WORLD_BYTES,
                "worlds and simulations; keep fewer, or give bodies a lower resolution",
            ),
        }
    }
}

/// A share of a budget, released on drop.
#[derive(Debug)]
pub(crate) struct Reservation {
    used: Arc<AtomicUsize>,
    bytes: usize,
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl Budget {
    fn reserve(&self, lua: &Lua, bytes: usize) -> mlua::Result<Reservation> {
        let fits = || self.used.load(Ordering::Relaxed).saturating_add(bytes) <= self.limit;
        if !fits() {
            lua.gc_collect()?;
        }
        if !fits() {
            let Self { limit, what, .. } = self;
            return Err(fail(lua, format!("the script holds more than {} MiB of {what}", limit >> 20)));
        }
        self.used.fetch_add(bytes, Ordering::Relaxed);
        Ok(Reservation { used: self.used.clone(), bytes })
    }
}

fn budgets(lua: &Lua) -> mlua::Result<Budgets> {
    let budgets = lua.app_data_ref::<Budgets>().map(|budgets| budgets.clone());
    budgets.ok_or_else(|| mlua::Error::runtime("the virtual machine has no budgets"))
}

/// Reserves `bytes` for an image, shape or mask. If they do not fit, garbage is collected first.
///
/// # Errors
/// If the budget is used up, at the script's line.
pub(crate) fn reserve(lua: &Lua, bytes: usize) -> mlua::Result<Reservation> {
    budgets(lua)?.objects.reserve(lua, bytes)
}

/// Reserves `bytes` for the content of a world, as [`reserve`] does.
///
/// # Errors
/// As [`reserve`].
pub(crate) fn reserve_in_world(lua: &Lua, bytes: usize) -> mlua::Result<Reservation> {
    budgets(lua)?.worlds.reserve(lua, bytes)
}
