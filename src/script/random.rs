//! Random numbers for scripts: `math.random` and the `rng` that a layout gets.

use std::sync::{Arc, Mutex, PoisonError};

use mlua::{Lua, MultiValue, UserData, UserDataMethods, Value};
use rand_chacha::{ChaCha8Rng, rand_core::RngCore};

use super::sandbox::fail;
use crate::benchmark::seed::{self, EpisodeSeed, Stream};

/// The generator behind `math.random`, which the host reseeds between phases.
#[derive(Clone)]
pub(super) struct MathRandom(Arc<Mutex<ChaCha8Rng>>);

impl MathRandom {
    /// Installs `math.random`, seeded alike in every machine so that loading a script twice gives the same plan.
    pub fn install(lua: &Lua) -> mlua::Result<Self> {
        let shared = Self(Arc::new(Mutex::new(seed::keyed(&["softvt load"]))));
        let rng = shared.clone();
        let random = lua.create_function(move |lua, args: MultiValue| {
            let mut rng = rng.0.lock().unwrap_or_else(PoisonError::into_inner);
            draw(lua, &mut rng, &args)
        })?;
        lua.globals().get::<mlua::Table>("math")?.set("random", random)?;
        Ok(shared)
    }

    /// Goes on with `rng`.
    pub fn reseed(&self, rng: ChaCha8Rng) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = rng;
    }
}

/// `math.random()`, `math.random(m)`, `math.random(m, n)` as in Lua 5.4.
fn draw(lua: &Lua, rng: &mut ChaCha8Rng, args: &MultiValue) -> mlua::Result<Value> {
    let bound = |value: &Value| {
        lua.coerce_integer(value.clone())?
            .ok_or_else(|| fail(lua, "math.random: bounds are integers".to_string()))
    };
    let (low, high) = match (args.front(), args.get(1)) {
        (None, _) => return Ok(Value::Number(seed::unit(rng))),
        (Some(high), None) => (1, bound(high)?),
        (Some(low), Some(high)) => (bound(low)?, bound(high)?),
    };
    if args.len() == 1 && high == 0 {
        return Ok(Value::Integer(rng.next_u64() as i64));
    }
    if low > high {
        return Err(fail(lua, format!("math.random: the range {low}..{high} is empty")));
    }
    Ok(Value::Integer(seed::integer(rng, low, high)))
}

/// A named stream of random numbers, `rng` in scripts.
pub(super) struct Rng {
    seed: EpisodeSeed,
    draws: ChaCha8Rng,
}

impl Rng {
    pub fn new(seed: EpisodeSeed, stream: Stream) -> Self {
        Self { draws: seed.stream(stream), seed }
    }
}

fn finite(lua: &Lua, method: &str, name: &str, value: f64) -> mlua::Result<f64> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(fail(lua, format!("rng:{method}: {name} must be finite, got {value}"))),
    }
}

impl UserData for Rng {
    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_method("stream", |lua, this, name: String| {
            match Stream::ALL.into_iter().find(|stream| stream.name() == name) {
                Some(stream) => Ok(Self::new(this.seed.clone(), stream)),
                None => {
                    let names = Stream::ALL.map(Stream::name).join(", ");
                    Err(fail(lua, format!("rng:stream: no stream {name:?}; there are {names}")))
                }
            }
        });
        methods.add_method_mut("uniform", |lua, this, (low, high): (f64, f64)| {
            let (low, high) = (finite(lua, "uniform", "a", low)?, finite(lua, "uniform", "b", high)?);
            Ok(low + (high - low) * seed::unit(&mut this.draws))
        });
        methods.add_method_mut("normal", |lua, this, (mean, deviation): (f64, f64)| {
            let (mean, deviation) =
                (finite(lua, "normal", "mean", mean)?, finite(lua, "normal", "sigma", deviation)?);
            Ok(mean + deviation * seed::normal(&mut this.draws))
        });
        methods.add_method_mut("int", |lua, this, (low, high): (i64, i64)| match low <= high {
            true => Ok(seed::integer(&mut this.draws, low, high)),
            false => Err(fail(lua, format!("rng:int: the range {low}..{high} is empty"))),
        });
        methods.add_method_mut("choice", |lua, this, list: mlua::Table| match list.raw_len() {
            0 => Err(fail(lua, "rng:choice: the list is empty".to_string())),
            count => list.get::<Value>(seed::integer(&mut this.draws, 1, count as i64)),
        });
        methods.add_method_mut("shuffle", |lua, this, list: mlua::Table| {
            let mut values: Vec<Value> = list.sequence_values().collect::<mlua::Result<_>>()?;
            for last in (1..values.len()).rev() {
                values.swap(last, seed::integer(&mut this.draws, 0, last as i64) as usize);
            }
            lua.create_sequence_from(values)
        });
    }
}
