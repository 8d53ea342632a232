//! Memory of host objects (images, shapes, worlds), which Lua's own limit does not count.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use mlua::Lua;

use super::error::app_data;

/// Bytes that the images and shapes of one virtual machine may take together, and one more while it is made. Masks are
/// small: Lua's own limit suffices.
const MAX_OBJECT_BYTES: usize = 512 << 20;
/// The same for its worlds and simulations: one soft body of 32 voxels along its edge takes half of it.
const MAX_WORLD_BYTES: usize = 4 << 30;

/// Bytes that the host objects of one virtual machine use.
#[derive(Clone, Debug, Default)]
pub(crate) struct MemoryUse {
    objects: Arc<AtomicUsize>,
    worlds: Arc<AtomicUsize>,
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

/// Reserves `bytes` for an image or shape. If they do not fit, garbage is collected first.
pub(crate) fn reserve(lua: &Lua, bytes: usize) -> mlua::Result<Reservation> {
    let used = app_data::<MemoryUse>(lua)?.objects;
    reserve_within(MAX_OBJECT_BYTES, used, lua, bytes, "images and shapes; keep fewer or smaller ones")
}

/// Reserves `bytes` for the content of a world, as [`reserve`] does.
pub(crate) fn reserve_in_world(lua: &Lua, bytes: usize) -> mlua::Result<Reservation> {
    let used = app_data::<MemoryUse>(lua)?.worlds;
    let objects = "worlds and simulations; keep fewer, or give bodies a lower resolution";
    reserve_within(MAX_WORLD_BYTES, used, lua, bytes, objects)
}

/// `objects` names the counted objects and says how to use less memory.
fn reserve_within(
    limit: usize,
    used: Arc<AtomicUsize>,
    lua: &Lua,
    bytes: usize,
    objects: &str,
) -> mlua::Result<Reservation> {
    let fits = || used.load(Ordering::Relaxed).saturating_add(bytes) <= limit;
    if !fits() {
        lua.gc_collect()?;
    }
    if !fits() {
        bail!(lua, "the script holds more than {} MiB of {objects}", limit >> 20);
    }
    used.fetch_add(bytes, Ordering::Relaxed);
    Ok(Reservation { used, bytes })
}
