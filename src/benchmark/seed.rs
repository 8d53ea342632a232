//! Seeds: every random number of an episode comes from a named stream of its own.
//!
//! A stream is ChaCha8 keyed with the SHA-256 of its identifiers, so that an additional draw in one stream does
//! not change another, and an episode does not depend on other episodes.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{RngCore, SeedableRng},
};
use serde::Deserialize;
use sha2::{Digest, Sha256};

use softvt_common::{episode_id::EpisodeId, text::hex};

/// Its name in lower case is part of the seed, and used by scripts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RandomStream {
    Layout,
    /// Initial joint angles of the arm.
    Arm,
    /// Variation of materials: stiffness, density and friction.
    Material,
    Size,
    Colour,
    Light,
    Camera,
    Sensor,
    Expert,
    /// `math.random` outside of an expert and a policy.
    Script,
    Policy,
    /// Disturbance of the robot's motion.
    Disturbance,
    /// Properties of objects that do not show.
    Hidden,
    Prompt,
}

impl RandomStream {
    pub fn from_name(name: &str) -> Option<Self> {
        serde_json::from_value(name.into()).ok()
    }
}

/// Secret of a judged run: the draws of its episodes derive from it, and results hold a hash of it only.
#[derive(Clone, PartialEq, Eq)]
pub struct SecretSeed([u8; 32]);

/// Shows the hash, not the secret.
impl std::fmt::Debug for SecretSeed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SecretSeed({})", self.hash())
    }
}

impl SecretSeed {
    pub fn new(content: &[u8]) -> Self {
        Self(sha256(&[b"softvt secret seed", content]))
    }

    /// SHA-256 of the secret, for results.
    pub fn hash(&self) -> String {
        hex(&sha256(&[b"softvt seed hash", &self.0]))
    }

    /// The seed that results hold: the first 48 bits of the hash, which every reader of JSON represents exactly.
    pub fn public_seed(&self) -> u64 {
        let hash = sha256(&[b"softvt seed hash", &self.0]);
        hash[..6].iter().fold(0, |number, byte| (number << 8) | u64::from(*byte))
    }

    /// Name of an episode that reveals neither the episode nor its draws, 32 hexadecimal digits.
    pub fn episode_name(&self, suite: &str, task: usize, episode: u32) -> String {
        let (task, episode) = (task.to_string(), episode.to_string());
        let parts =
            [&b"softvt episode name"[..], &self.0, suite.as_bytes(), task.as_bytes(), episode.as_bytes()];
        hex(&sha256(&parts)[..16])
    }
}

/// SHA-256 of parts, each preceded by its length, so that different lists never collide.
fn sha256(parts: &[&[u8]]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize().into()
}

/// Source of the random streams of an episode: all values on which its initial state depends. Tasks that share a layout
/// share their initial states, except for the hidden properties of objects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EpisodeSeed {
    /// The episode. Hidden properties alone depend on its task, so that an attempt at one task of a mirrored pair does
    /// not reveal those of the other.
    pub id: EpisodeId,
    /// Name of the layout; the tasks of a mirrored pair share it.
    pub layout: String,
    pub secret: Option<SecretSeed>,
}

impl EpisodeSeed {
    pub fn new(id: &EpisodeId, layout: &str) -> Self {
        Self { id: id.clone(), layout: layout.to_owned(), secret: None }
    }

    pub fn with_secret(self, secret: Option<&SecretSeed>) -> Self {
        Self { secret: secret.cloned(), ..self }
    }

    pub fn stream(&self, stream: RandomStream) -> ChaCha8Rng {
        let EpisodeId { suite, task, episode, base_seed, split } = &self.id;
        let [task, episode, base_seed] = [task.to_string(), episode.to_string(), base_seed.to_string()];
        let name = format!("{stream:?}").to_lowercase();
        let mut parts =
            vec!["softvt episode", suite, &self.layout, &episode, &base_seed, split.name(), &name];
        if stream == RandomStream::Hidden {
            parts.push(&task);
        }
        let parts: Vec<&[u8]> = parts.into_iter().map(str::as_bytes).collect();
        match &self.secret {
            None => ChaCha8Rng::from_seed(sha256(&parts)),
            Some(SecretSeed(key)) => ChaCha8Rng::from_seed(sha256(&[&parts[..], &[&key[..]]].concat())),
        }
    }
}

/// Random generator keyed by the hash of `parts`. The hash includes their lengths, so that
/// different lists never collide.
pub fn keyed_rng(parts: &[&str]) -> ChaCha8Rng {
    ChaCha8Rng::from_seed(sha256(&parts.iter().map(|part| part.as_bytes()).collect::<Vec<_>>()))
}

/// Uniform in [0, 1), 53 bits.
pub fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Standard normal (Box and Muller, 1958).
pub fn standard_normal(rng: &mut ChaCha8Rng) -> f64 {
    // 1 − u lies in (0, 1], where the logarithm is finite.
    let radius = (-2.0 * (1.0 - uniform(rng)).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform(rng)).cos()
}

/// Fills `out` with roughly standard normal numbers, each from one number of the generator, for noise of many values:
/// a binomial number of 48 trials and a uniform one in between. Mean 0, variance 1, never beyond 7.1.
pub fn rough_normals(rng: &mut ChaCha8Rng, out: &mut [f64]) {
    // The second loop is vectorised, the first one cannot be.
    let mut numbers = [0; 64];
    for chunk in out.chunks_mut(numbers.len()) {
        let numbers = &mut numbers[..chunk.len()];
        numbers.iter_mut().for_each(|number| *number = rng.next_u64());
        chunk.iter_mut().zip(numbers).for_each(|(normal, bits)| *normal = rough_normal(*bits));
    }
}

fn rough_normal(bits: u64) -> f64 {
    let count = (bits >> 16).count_ones();
    let fraction = f64::from(bits as u16) / f64::from(u16::MAX);
    // Variances: 48 / 4 and 1 / 12.
    (f64::from(count) - 24.0 + fraction - 0.5) / (12.0f64 + 1.0 / 12.0).sqrt()
}

/// Uniform over the integers `low..=high`, without bias (rejection). `low` must not exceed `high`.
pub fn uniform_integer(rng: &mut ChaCha8Rng, low: i64, high: i64) -> i64 {
    let span = (high as u64).wrapping_sub(low as u64);
    if span == u64::MAX {
        return rng.next_u64() as i64;
    }
    let count = span + 1;
    let limit = u64::MAX - u64::MAX % count;
    loop {
        let draw = rng.next_u64();
        if draw < limit {
            return (low as u64).wrapping_add(draw % count) as i64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_common::episode_id::EpisodeSplit;

    fn seed() -> EpisodeSeed {
        let (suite, split) = ("s".to_owned(), EpisodeSplit::Validation);
        EpisodeSeed::new(&EpisodeId { suite, task: 1, episode: 3, base_seed: 7, split }, "l")
    }

    fn with(change: impl Fn(&mut EpisodeId)) -> EpisodeSeed {
        let mut seed = seed();
        change(&mut seed.id);
        seed
    }

    #[test]
    fn every_part_of_the_seed_moves_the_stream() {
        let first = |s: &EpisodeSeed, stream| s.stream(stream).next_u64();
        let base = first(&seed(), RandomStream::Layout);
        let others = [
            EpisodeSeed { layout: "".into(), ..with(|id| id.suite = "sl".into()) },
            with(|id| id.episode = 4),
            with(|id| id.base_seed = 8),
            with(|id| id.split = EpisodeSplit::Demonstration),
        ];
        assert!(others.iter().all(|other| first(other, RandomStream::Layout) != base));
        assert_ne!(first(&seed(), RandomStream::Arm), base);
        let other_task = with(|id| id.task = 2);
        assert_eq!(first(&other_task, RandomStream::Material), first(&seed(), RandomStream::Material));
        assert_ne!(first(&other_task, RandomStream::Hidden), first(&seed(), RandomStream::Hidden));
        assert_eq!(first(&seed(), RandomStream::Layout), base);
    }

    #[test]
    fn a_secret_moves_every_stream_and_its_hash_does_not_give_it_away() {
        let first =
            |secret: Option<&SecretSeed>| seed().with_secret(secret).stream(RandomStream::Size).next_u64();
        let [a, b] = [b"one".as_slice(), b"one\n"].map(SecretSeed::new);
        assert!(first(None) != first(Some(&a)) && first(Some(&a)) != first(Some(&b)));
        assert_eq!(first(Some(&a)), first(Some(&SecretSeed::new(b"one"))));
        assert!(a.hash() != b.hash() && a.public_seed() != b.public_seed() && a.public_seed() < 1 << 48);
        // The public seed does not give these draws.
        let public = with(|id| id.base_seed = a.public_seed());
        assert_ne!(public.stream(RandomStream::Size).next_u64(), first(Some(&a)));
        let names = [a.episode_name("s", 1, 2), a.episode_name("s", 12, 0), b.episode_name("s", 1, 2)];
        assert!(names[0] != names[1] && names[0] != names[2] && names[0].len() == 32);
        assert!(!format!("{a:?}").contains(&hex(&a.0)), "debug output is printed in panics");
    }

    #[test]
    fn normal_draws_have_mean_zero_and_variance_one() {
        let mut rough = vec![0.0; 20_000];
        rough_normals(&mut keyed_rng(&["test"]), &mut rough);
        let mut rng = keyed_rng(&["test"]);
        let standard = (0..20_000).map(|_| standard_normal(&mut rng)).collect();
        for draws in [standard, rough] {
            let mean = draws.iter().sum::<f64>() / draws.len() as f64;
            let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / draws.len() as f64;
            assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04, "{mean} {variance}");
            // Shares of a normal distribution below −2, −1, 1 and 2.
            for (limit, share) in [(-2.0, 0.0228), (-1.0, 0.1587), (1.0, 0.8413), (2.0, 0.9772)] {
                let below = draws.iter().filter(|draw| **draw < limit).count() as f64 / draws.len() as f64;
                assert!((below - share).abs() < 0.01, "{below} below {limit}");
            }
        }
    }

    #[test]
    fn rough_normals_do_not_depend_on_how_many_are_drawn_at_once() {
        let mut at_once = [0.0; 200];
        rough_normals(&mut keyed_rng(&["test"]), &mut at_once);
        let [mut rng, mut numbers] = [(), ()].map(|()| keyed_rng(&["test"]));
        for chunk in at_once.chunks(9) {
            let mut few = vec![0.0; chunk.len()];
            rough_normals(&mut rng, &mut few);
            assert_eq!(few, chunk);
            assert!(few.iter().all(|normal| *normal == rough_normal(numbers.next_u64())));
        }
    }

    #[test]
    fn integers_cover_their_range_evenly() {
        let mut rng = keyed_rng(&["integers"]);
        let mut counts = [0; 5];
        (0..50_000).for_each(|_| counts[(uniform_integer(&mut rng, -2, 2) + 2) as usize] += 1);
        assert!(counts.iter().all(|c| (9_600..10_400).contains(c)), "{counts:?}");
        assert_eq!(uniform_integer(&mut rng, i64::MIN, i64::MIN), i64::MIN);
    }
}
