//! `math.random`, seeded by the run.

use std::sync::{Arc, Mutex};

use mlua::{Lua, MultiValue, Value};
use rand_chacha::{ChaCha8Rng, rand_core::RngCore};

use super::error::fail;
use crate::{benchmark::seed, parallel::lock};

/// The generator of `math.random`, which the host reseeds between phases.
#[derive(Clone)]
pub(crate) struct MathRandom(Arc<Mutex<ChaCha8Rng>>);

impl MathRandom {
    /// Installs `math.random` with the same seed in every virtual machine, so that loading a script twice gives the same
    /// plan.
    pub(crate) fn install(lua: &Lua) -> mlua::Result<Self> {
        let shared = Self(Arc::new(Mutex::new(seed::keyed_rng(&["softvt load"]))));
        let rng = shared.clone();
        let random = lua.create_function(move |lua, args: MultiValue| {
            let mut rng = lock(&rng.0);
            draw(lua, &mut rng, &args)
        })?;
        lua.globals().get::<mlua::Table>("math")?.set("random", random)?;
        Ok(shared)
    }

    /// Continues with the numbers of `rng`.
    pub(crate) fn reseed(&self, rng: ChaCha8Rng) {
        *lock(&self.0) = rng;
    }
}

/// `math.random()`, `math.random(m)`, `math.random(m, n)` as in Lua 5.4.
fn draw(lua: &Lua, rng: &mut ChaCha8Rng, args: &MultiValue) -> mlua::Result<Value> {
    let bound = |value: &Value| {
        lua.coerce_integer(value.clone())?
            .ok_or_else(|| fail(lua, "math.random: bounds are integers".to_string()))
    };
    let (low, high) = match (args.front(), args.get(1)) {
        (None, _) => return Ok(Value::Number(seed::uniform(rng))),
        (Some(high), None) => (1, bound(high)?),
        (Some(low), Some(high)) => (bound(low)?, bound(high)?),
    };
    if args.len() == 1 && high == 0 {
        return Ok(Value::Integer(rng.next_u64() as i64));
    }
    if low > high {
        return Err(fail(lua, format!("math.random: the range {low}..{high} is empty")));
    }
    Ok(Value::Integer(seed::uniform_integer(rng, low, high)))
}
