//! Random numbers for scripts: `math.random` and the `rng` that a layout gets.

use std::sync::{Arc, Mutex, PoisonError};

use mlua::{Lua, MultiValue, Table, UserDataMethods, Value};
use rand_chacha::{ChaCha8Rng, rand_core::RngCore};

use crate::benchmark::seed::{self, EpisodeSeed, RandomStream};
use crate::script::{
    api::catalogue_classes::{self as classes, Class},
    schema::userdata::{Hosted, hosted, method},
    vm::{fail, locked},
};

/// The generator behind `math.random`, which the host reseeds between phases.
#[derive(Clone)]
pub(crate) struct MathRandom(Arc<Mutex<ChaCha8Rng>>);

impl MathRandom {
    /// Installs `math.random`, seeded alike in every machine so that loading a script twice gives the same plan.
    pub(crate) fn install(lua: &Lua) -> mlua::Result<Self> {
        let shared = Self(Arc::new(Mutex::new(seed::keyed_rng(&["softvt load"]))));
        let rng = shared.clone();
        let random = lua.create_function(move |lua, args: MultiValue| {
            let mut rng = rng.0.lock().unwrap_or_else(PoisonError::into_inner);
            draw(lua, &mut rng, &args)
        })?;
        lua.globals().get::<mlua::Table>("math")?.set("random", random)?;
        Ok(shared)
    }

    /// Goes on with `rng`.
    pub(crate) fn reseed(&self, rng: ChaCha8Rng) {
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

/// A named stream of random numbers, `rng` in scripts.
#[derive(Clone)]
pub(crate) struct Rng {
    seed: EpisodeSeed,
    draws: Arc<Mutex<ChaCha8Rng>>,
}

impl Rng {
    pub(crate) fn new(seed: EpisodeSeed, stream: RandomStream) -> Self {
        Self { draws: Arc::new(Mutex::new(seed.stream(stream))), seed }
    }
}

/// A draw that did not overflow.
fn finite(lua: &Lua, method: &str, value: f64) -> mlua::Result<f64> {
    match value.is_finite() {
        true => Ok(value),
        false => {
            Err(fail(lua, format!("rng:{method}: the range is too wide for a number; give smaller bounds")))
        }
    }
}

impl Hosted for Rng {
    fn class() -> &'static Class {
        &classes::RNG
    }

    fn label(&self) -> String {
        "rng".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "stream", |_, this: &Self, name: String| {
            let stream = RandomStream::ALL.into_iter().find(|stream| stream.name() == name);
            Ok(stream.map(|stream| Self::new(this.seed.clone(), stream)))
        });
        method(methods, "uniform", |lua, this: &Self, (low, high): (f64, f64)| {
            finite(lua, "uniform", low + (high - low) * seed::uniform(&mut locked(&this.draws)))
        });
        method(methods, "normal", |lua, this: &Self, (mean, deviation): (f64, f64)| {
            finite(lua, "normal", mean + deviation * seed::standard_normal(&mut locked(&this.draws)))
        });
        method(methods, "int", |lua, this: &Self, (low, high): (i64, i64)| match low <= high {
            true => Ok(seed::uniform_integer(&mut locked(&this.draws), low, high)),
            false => Err(fail(lua, format!("rng:int: the range {low}..{high} is empty"))),
        });
        method(methods, "choice", |lua, this: &Self, list: Table| match list.raw_len() {
            0 => Err(fail(lua, "rng:choice: the list is empty".to_string())),
            count => list.raw_get::<Value>(seed::uniform_integer(&mut locked(&this.draws), 1, count as i64)),
        });
        method(methods, "shuffle", |lua, this: &Self, list: Table| {
            let mut values: Vec<Value> = list.sequence_values().collect::<mlua::Result<_>>()?;
            for last in (1..values.len()).rev() {
                values.swap(last, seed::uniform_integer(&mut locked(&this.draws), 0, last as i64) as usize);
            }
            lua.create_sequence_from(values)
        });
    }
}

hosted!(Rng);
