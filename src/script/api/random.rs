//! Named streams of random numbers: the `rng` that layouts get.

use std::sync::{Arc, Mutex};

use mlua::{Table, Value};
use rand_chacha::ChaCha8Rng;

use crate::schema::{Type, class};
use softvt_benchmark::seed::{self, EpisodeSeed, RandomStream};
use softvt_common::{parallel::lock, text::format_number};

#[derive(Clone)]
pub(crate) struct LuaRng {
    seed: EpisodeSeed,
    draws: Arc<Mutex<ChaCha8Rng>>,
}

impl LuaRng {
    pub(crate) fn new(seed: EpisodeSeed, stream: RandomStream) -> Self {
        Self { draws: Arc::new(Mutex::new(seed.stream(stream))), seed }
    }
}

class! {
    /// A named stream of random numbers, determined by suite, layout, episode, seed and split.
    LuaRng: "softvt.Rng" {
        label(_) { "rng".to_owned() }
        methods {
            /// Returns another stream, from its start. Draws from one stream do not change those from another.
            fn stream(_, this, name: String = Type::Choice(&[
                "layout", "arm", "material", "size", "colour", "light", "camera", "sensor", "expert", "script", "policy",
            ])) -> ["softvt.Rng"] {
                RandomStream::from_name(&name).map(|stream| LuaRng::new(this.seed.clone(), stream))
            }
            /// Returns a number uniformly distributed from low (included) to high (excluded).
            fn uniform(lua, this, low: f64, high: f64) -> ["number"] {
                if low > high {
                    let [low, high] = [low, high].map(format_number);
                    bail!(lua, "rng:uniform: the range {low}..{high} is empty; swap them");
                }
                low + (high - low) * seed::uniform(&mut lock(&this.draws))
            }
            /// Returns a normally distributed number; sigma is the standard deviation.
            fn normal(lua, this, mean: f64, sigma: f64) -> ["number"] {
                if sigma < 0.0 {
                    let sigma = format_number(sigma);
                    bail!(lua, "rng:normal: sigma: expected a number of 0 or more, got {sigma}");
                }
                mean + sigma * seed::standard_normal(&mut lock(&this.draws))
            }
            /// Returns a whole number from low to high, both included.
            fn int(lua, this, low: i64, high: i64) -> ["integer"] {
                if low > high {
                    bail!(lua, "rng:int: the range {low}..{high} is empty");
                }
                seed::uniform_integer(&mut lock(&this.draws), low, high)
            }
            /// Returns one entry of a list.
            fn choice(lua, this, list: Table = Type::List(&Type::Any)) -> ["any"] {
                if list.raw_len() == 0 {
                    bail!(lua, "rng:choice: the list is empty");
                }
                list.raw_get::<Value>(seed::uniform_integer(&mut lock(&this.draws), 1, list.raw_len() as i64))?
            }
            /// Returns a copy of a list in random order.
            fn shuffle(lua, this, list: Table = Type::List(&Type::Any)) -> ["any[]"] {
                let mut values: Vec<Value> = list.sequence_values().collect::<mlua::Result<_>>()?;
                for last in (1..values.len()).rev() {
                    values.swap(last, seed::uniform_integer(&mut lock(&this.draws), 0, last as i64) as usize);
                }
                lua.create_sequence_from(values)?
            }
        }
    }
}
