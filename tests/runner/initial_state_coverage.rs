//! Initial states cover their ranges, and are equal for both tasks of a mirrored pair.

use std::{path::Path, sync::Arc};

use softvt::{
    benchmark::{Plan, settings::Settings},
    episode_id::{EpisodeId, EpisodeSplit},
    rollout::{AssetCache, Simulation, state_hash},
    scene::Scene,
    script::{self, EpisodeSetup, LoadedScript, SceneChanges},
};

use crate::support::SPATIAL_SOFT;

const LAYOUTS: u64 = 40;
/// Positions of the two instances in the first layout, m, and the initial posture of the arm, rad.
const PLACES: [(&str, f64, f64); 2] = [("left", -0.05, -0.19), ("right", -0.05, 0.19)];

fn loaded() -> LoadedScript {
    script::load(Path::new(SPATIAL_SOFT), &[]).expect("the suite loads")
}

fn scene(loaded: &LoadedScript, task: usize, episode: u32, base_seed: u64) -> Scene {
    let id = EpisodeId {
        suite: "spatial_soft".to_owned(),
        task,
        episode,
        base_seed,
        split: EpisodeSplit::Validation,
    };
    EpisodeSetup::open(loaded, &id, &SceneChanges::default()).expect("the episode opens").scene
}

/// Position offsets (m) and yaw angles (rad) of both instances, and joint angles, over many layouts.
struct Spread {
    offsets: [Vec<f64>; 2],
    turns: Vec<f64>,
    joints: Vec<[f64; 7]>,
}

impl Spread {
    fn measure() -> Self {
        let loaded = loaded();
        let mut spread = Self { offsets: Default::default(), turns: Vec::new(), joints: Vec::new() };
        for seed in 0..LAYOUTS {
            let scene = scene(&loaded, 0, 0, seed);
            for (name, x, y) in PLACES {
                let object = scene.objects.iter().find(|o| o.name == name).expect("an instance");
                spread.offsets[0].push(object.pose_w.translation.x - x);
                spread.offsets[1].push(object.pose_w.translation.y - y);
                spread.turns.push(object.pose_w.rotation.euler_angles().2);
            }
            spread.joints.push(scene.start_q);
        }
        spread
    }

    /// Standard deviation of the joint angles, each about its own mean, rad.
    fn sigma(&self) -> f64 {
        let n = self.joints.len() as f64;
        let variance = |joint: usize| {
            let mean = self.joints.iter().map(|q| q[joint]).sum::<f64>() / n;
            self.joints.iter().map(|q| (q[joint] - mean).powi(2)).sum::<f64>() / (n - 1.0)
        };
        ((0..7).map(variance).sum::<f64>() / 7.0).sqrt()
    }

    /// The sample with all offsets scaled by `share`.
    fn scaled(&self, share: f64) -> Self {
        let all = |list: &Vec<f64>| list.iter().map(|x| x * share).collect();
        let mean =
            |joint: usize| self.joints.iter().map(|q| q[joint]).sum::<f64>() / self.joints.len() as f64;
        let about = |q: &[f64; 7]| std::array::from_fn(|i| mean(i) + share * (q[i] - mean(i)));
        Self {
            offsets: [all(&self.offsets[0]), all(&self.offsets[1])],
            turns: all(&self.turns),
            joints: self.joints.iter().map(about).collect(),
        }
    }

    fn is_as_promised(&self) -> bool {
        let [x, y] = &self.offsets;
        spans(x, 0.018, 0.020)
            && spans(y, 0.018, 0.020)
            && spans(&self.turns, 27f64.to_radians(), 30f64.to_radians())
            && (0.016..=0.024).contains(&self.sigma())
    }
}

/// True if both extremes reach `least` and neither exceeds `most`.
fn spans(values: &[f64], least: f64, most: f64) -> bool {
    let (low, high) = values.iter().fold((0f64, 0f64), |(low, high), v| (low.min(*v), high.max(*v)));
    low <= -least && high >= least && low >= -most - 1e-12 && high <= most + 1e-12
}

#[test]
fn start_states_spread_over_20_mm_30_degrees_and_a_fiftieth_of_a_radian() {
    let spread = Spread::measure();
    let ends = |v: &[f64]| v.iter().fold((0f64, 0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    assert!(
        spread.is_as_promised(),
        "x {:?} y {:?} m, turn {:?} rad, σ {} rad",
        ends(&spread.offsets[0]),
        ends(&spread.offsets[1]),
        ends(&spread.turns),
        spread.sigma()
    );
    // The criterion must reject other distributions.
    assert!(!spread.scaled(0.75).is_as_promised());
    assert!(!spread.scaled(1.25).is_as_promised());
}

#[test]
fn both_tasks_of_a_mirrored_pair_settle_to_byte_identical_states() {
    let loaded = loaded();
    let Plan::Suite(suite) = &loaded.plan else { panic!("a suite") };
    let cache = AssetCache::default();
    let Settings { physics, robot, .. } = Settings::default();
    let settled = |scene: Scene| {
        let mut sim = Simulation::new(Arc::new(scene), &physics, &robot, &cache).expect("built");
        sim.settle().expect("settled");
        state_hash(&sim)
    };
    let mut seen = Vec::new();
    for pair in suite.tasks.chunks(2) {
        assert_eq!(pair[0].layout, pair[1].layout);
        assert_ne!(pair[0].object, pair[1].object, "the tasks differ in what is asked for");
        let [first, second] = [0, 1].map(|i| settled(scene(&loaded, pair[i].id, 3, 11)));
        assert_eq!(first, second, "tasks {} and {}", pair[0].id, pair[1].id);
        assert!(!seen.contains(&first), "two pairs with one state");
        seen.push(first);
    }
    assert_eq!(seen.len(), 5);
}
