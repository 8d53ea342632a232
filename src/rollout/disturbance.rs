//! Disturbance of the robot's motion (settings `robot.disturbance.*`).

use rand_chacha::ChaCha8Rng;

use softvt_benchmark::{
    CONTROL_DT,
    seed::{EpisodeSeed, RandomStream, standard_normal},
};
use softvt_geometry::{Pose, Vec3};
use softvt_robot::{DisturbanceSpec, rotation};

/// The offset of the executed poses in an episode.
#[derive(Clone)]
pub(crate) struct Disturbance {
    spec: DisturbanceSpec,
    rng: ChaCha8Rng,
    /// Offsets in standard deviations: position, rotation.
    offset: [Vec3; 2],
}

impl Disturbance {
    /// An episode begins without an offset.
    pub(crate) fn new(spec: &DisturbanceSpec, seed: &EpisodeSeed) -> Self {
        Self { spec: spec.clone(), rng: seed.stream(RandomStream::Disturbance), offset: [Vec3::zeros(); 2] }
    }

    /// The pose that is executed in the next control step for a commanded one, base frame. The position moves along the
    /// axes of the base, the rotation is about them.
    pub(crate) fn apply(&mut self, pose_b: &Pose) -> Pose {
        let DisturbanceSpec { position, rotation: angle, duration } = self.spec;
        if position == 0.0 && angle == 0.0 {
            return *pose_b;
        }
        // The exact update of a process dx = −x/T dt + √(2/T) dW over a control step.
        let kept = (-CONTROL_DT / duration).exp();
        let fresh = (1.0 - kept * kept).sqrt();
        for value in self.offset.iter_mut().flat_map(Vec3::iter_mut) {
            *value = kept * *value + fresh * standard_normal(&mut self.rng);
        }
        let [moved, turned] = [position * self.offset[0], angle * self.offset[1]];
        Pose::from_parts(
            (pose_b.translation.vector + moved).into(),
            rotation::from_axis_angle(&turned) * pose_b.rotation,
        )
    }
}

#[cfg(test)]
mod tests {
    use softvt_common::episode_id::{EpisodeId, EpisodeSplit};

    use super::*;

    fn disturbance(spec: &DisturbanceSpec, episode: u32) -> Disturbance {
        let id =
            EpisodeId { suite: "s".into(), task: 0, episode, base_seed: 0, split: EpisodeSplit::Validation };
        Disturbance::new(spec, &EpisodeSeed::new(&id, "l"))
    }

    #[test]
    fn the_offset_has_its_deviation_and_correlation() {
        let spec = DisturbanceSpec { position: 0.003, rotation: 0.02, duration: 0.5 };
        let mut process = disturbance(&spec, 0);
        let commanded = Pose::from_parts(
            Vec3::new(0.5, 0.1, 0.3).into(),
            rotation::from_axis_angle(&Vec3::new(3.1, 0.0, 0.0)),
        );
        let offsets: Vec<[f64; 2]> = (0..100_000)
            .map(|_| {
                let executed = process.apply(&commanded);
                let turned = rotation::axis_angle(&(executed.rotation * commanded.rotation.inverse()));
                [executed.translation.vector.y - 0.1, turned.z]
            })
            .collect();
        let lag = (spec.duration / CONTROL_DT).round() as usize;
        for (axis, deviation) in [spec.position, spec.rotation].into_iter().enumerate() {
            let values: Vec<f64> = offsets.iter().map(|offset| offset[axis] / deviation).collect();
            let mean_of =
                |products: &mut dyn Iterator<Item = f64>| products.sum::<f64>() / values.len() as f64;
            assert!(mean_of(&mut values.iter().copied()).abs() < 0.05);
            assert!((mean_of(&mut values.iter().map(|v| v * v)) - 1.0).abs() < 0.05);
            let correlation = mean_of(&mut values.iter().zip(&values[lag..]).map(|(a, b)| a * b));
            assert!((correlation - (-1.0_f64).exp()).abs() < 0.05, "{correlation}");
        }
    }

    #[test]
    fn it_is_off_by_default_and_differs_between_episodes() {
        let pose = Pose::translation(0.5, 0.0, 0.3);
        assert_eq!(disturbance(&DisturbanceSpec::default(), 0).apply(&pose), pose);
        let spec = DisturbanceSpec { position: 0.003, ..DisturbanceSpec::default() };
        assert_eq!(disturbance(&spec, 1).apply(&pose), disturbance(&spec, 1).apply(&pose));
        assert_ne!(disturbance(&spec, 1).apply(&pose), disturbance(&spec, 2).apply(&pose));
    }
}
