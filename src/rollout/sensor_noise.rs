//! Errors of the sensors: noise and wear of the tactile sensors (settings `tactile.wear.*`), and those of the measured
//! gripper width (`robot.width_sensor.*`), applied to exact readings.
//!
//! Constant errors belong to a finger and an episode; noise also to the physics step. All come from the sensor stream
//! of the episode, so a reading does not depend on when or how often it is computed.

use softvt_benchmark::seed::{
    EpisodeSeed, RandomStream, keyed_rng, rough_normals, standard_normal, uniform, uniform_integer,
};
use softvt_robot::tactile::WearSpec;
use softvt_robot::{Side, WidthSensorSpec, gripper::MAX_WIDTH};
use softvt_sensing::tactile::TactileReading;

/// Number of colour values whose noise is drawn at once.
const NOISE_CHUNK: usize = 256;

/// Seed of the sensor errors of an episode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorSeed(i64);

impl SensorSeed {
    /// The seed of an episode, from its sensor stream.
    pub fn new(seed: &EpisodeSeed) -> Self {
        Self(uniform_integer(&mut seed.stream(RandomStream::Sensor), i64::MIN, i64::MAX))
    }

    /// Gripper width as the sensor measures it at a physics step, m. `width` is exact.
    pub fn sensed_width(self, spec: &WidthSensorSpec, width: f64, step: u64) -> f64 {
        let WidthSensorSpec { resolution, offset, noise } = *spec;
        let (seed, step) = (self.0.to_string(), step.to_string());
        let normal = |parts: &[&str]| standard_normal(&mut keyed_rng(parts));
        let mut sensed = width;
        if offset > 0.0 {
            sensed += offset * normal(&["softvt width offset", &seed]);
        }
        if noise > 0.0 {
            sensed += noise * normal(&["softvt width noise", &seed, &step]);
        }
        if resolution > 0.0 {
            sensed = (sensed / resolution).round() * resolution;
        }
        if sensed == width { width } else { sensed.clamp(0.0, MAX_WIDTH) }
    }

    /// Applies noise and wear to the reading of a finger at a physics step. `untouched` is the image without a contact.
    pub(crate) fn apply_wear(
        self,
        spec: &WearSpec,
        side: Side,
        step: u64,
        untouched: &[u8],
        reading: &mut TactileReading,
    ) {
        if *spec == WearSpec::default() {
            return;
        }
        let (seed, side, step) = (self.0.to_string(), side.index().to_string(), step.to_string());
        let mut constant = keyed_rng(&["softvt tactile wear", &seed, &side]);
        let mut noise = keyed_rng(&["softvt tactile noise", &seed, &side, &step]);
        let markers = &mut reading.markers;
        for (initial, current) in markers.initial.iter().zip(&mut markers.current) {
            let is_dead = uniform(&mut constant) < spec.dead_share;
            for axis in 0..2 {
                let offset = spec.offset_px * standard_normal(&mut constant);
                let jitter = spec.noise_px * standard_normal(&mut noise);
                let displacement = if is_dead { 0.0 } else { f64::from(current[axis] - initial[axis]) };
                current[axis] =
                    (f64::from(initial[axis]) + spec.gain * displacement + offset + jitter) as f32;
            }
        }
        if spec.gain == 1.0 && spec.image_noise == 0.0 {
            return;
        }
        let mut noise = keyed_rng(&["softvt tactile image noise", &seed, &side, &step]);
        let mut normals = [0.0; NOISE_CHUNK];
        let chunks = reading.image.chunks_mut(NOISE_CHUNK).zip(untouched.chunks(NOISE_CHUNK));
        for (values, untouched) in chunks {
            let normals = &mut normals[..values.len()];
            rough_normals(&mut noise, normals);
            for ((value, untouched), normal) in values.iter_mut().zip(untouched).zip(normals) {
                let untouched = f64::from(*untouched);
                let level = untouched + spec.gain * (f64::from(*value) - untouched);
                *value = (level + spec.image_noise * *normal).round().clamp(0.0, 255.0) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use softvt_robot::tactile::TactileSpec;
    use softvt_sensing::tactile::{GelScratch, Markers, PadWrench, TactileContact, TactileSensor};

    use super::*;

    fn worn(spec: WearSpec, seed: i64, side: Side, step: u64) -> TactileReading {
        let sensor = TactileSensor::new(&TactileSpec::default()).expect("a sensor");
        let contact =
            TactileContact { wrench: PadWrench::default(), skins: &[], points: &[], substrate: None };
        let mut reading = sensor.read(&contact, &mut GelScratch::default()).expect("a reading");
        for (marker, current) in reading.markers.current.iter_mut().enumerate() {
            current[0] += marker as f32;
        }
        SensorSeed(seed).apply_wear(&spec, side, step, &sensor.untouched_image, &mut reading);
        reading
    }

    fn displacements(markers: &Markers) -> Vec<f32> {
        markers.initial.iter().zip(&markers.current).map(|(from, to)| to[0] - from[0]).collect()
    }

    /// Standard deviation of numbers with mean 0, and the mean product of neighbours relative to its square.
    fn deviation(numbers: &[f64]) -> [f64; 2] {
        let square = numbers.iter().map(|x| x * x).sum::<f64>() / numbers.len() as f64;
        let neighbours = numbers.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
        [square.sqrt(), neighbours / (numbers.len() - 1) as f64 / square]
    }

    #[test]
    fn noise_has_its_standard_deviation_and_no_memory() {
        let spec = WearSpec { noise_px: 0.1, image_noise: 3.0, ..WearSpec::default() };
        let plain = worn(WearSpec::default(), 1, Side::Left, 0);
        let mut steps = Vec::new();
        for step in 0..20 {
            let noisy = worn(spec, 1, Side::Left, step);
            let pairs = noisy.markers.current.iter().zip(&plain.markers.current);
            let noise: Vec<f64> =
                pairs.flat_map(|(a, b)| [0, 1].map(|axis| f64::from(a[axis] - b[axis]))).collect();
            let grey = noisy.image.iter().zip(plain.image.iter());
            let grey: Vec<f64> = grey.map(|(a, b)| f64::from(*a) - f64::from(*b)).collect();
            let [level, _] = deviation(&grey);
            // Rounding adds a variance of 1/12.
            assert!((level - (9.0f64 + 1.0 / 12.0).sqrt()).abs() < 0.03, "{level}");
            steps.push(noise);
        }
        // One marker after the other at a step, and each marker from step to step.
        let by_step = steps.concat();
        let by_marker: Vec<f64> = (0..198).flat_map(|at| steps.iter().map(move |step| step[at])).collect();
        for [deviation, memory] in [deviation(&by_step), deviation(&by_marker)] {
            assert!((deviation - 0.1).abs() < 0.005 && memory.abs() < 0.05, "{deviation} {memory}");
        }
    }

    #[test]
    fn noise_of_the_image_leaves_the_markers_alone_and_the_other_way_round() {
        let of = |noise_px, image_noise| {
            worn(WearSpec { noise_px, image_noise, ..WearSpec::default() }, 1, Side::Left, 5)
        };
        assert_eq!(of(0.1, 0.0).markers.current, of(0.1, 3.0).markers.current);
        assert_eq!(of(0.0, 3.0).image, of(0.1, 3.0).image);
        assert_eq!(of(0.1, 0.0).image, of(0.0, 0.0).image);
    }

    #[test]
    fn the_sensed_width_has_steps_and_an_offset_per_episode() {
        let spec = WidthSensorSpec::default();
        let sensed = |seed, width, step| SensorSeed(seed).sensed_width(&spec, width, step);
        for (seed, width) in [(1, 0.0123), (2, 0.0405), (3, 0.0799)] {
            let steps = sensed(seed, width, 7) / spec.resolution;
            assert!((steps - steps.round()).abs() < 1e-9 && (sensed(seed, width, 7) - width).abs() < 2e-3);
            assert_eq!(sensed(seed, width, 7), sensed(seed, width, 8), "a width at rest does not flicker");
        }
        let errors: Vec<f64> = (0..2000).map(|seed| sensed(seed, 0.04, 0) - 0.04).collect();
        // A step of 0.4 mm adds a variance of 0.4² / 12.
        let expected = (2.5e-4f64.powi(2) + 4e-4f64.powi(2) / 12.0).sqrt();
        assert!((deviation(&errors)[0] / expected - 1.0).abs() < 0.06, "{}", deviation(&errors)[0]);
    }

    #[test]
    fn width_noise_is_new_in_every_step_and_off_is_exact() {
        let spec = WidthSensorSpec { resolution: 0.0, offset: 0.0, noise: 1e-4 };
        let errors: Vec<f64> =
            (0..2000).map(|step| SensorSeed(1).sensed_width(&spec, 0.04, step) - 0.04).collect();
        let [deviation, memory] = deviation(&errors);
        assert!((deviation - 1e-4).abs() < 5e-6 && memory.abs() < 0.07, "{deviation} {memory}");
        let off = WidthSensorSpec { noise: 0.0, ..spec };
        for width in [-1e-5, 0.0123456789, 0.0801] {
            assert_eq!(SensorSeed(1).sensed_width(&off, width, 3), width);
        }
    }

    #[test]
    fn each_kind_of_wear_acts_and_is_reproducible() {
        let plain = worn(WearSpec::default(), 1, Side::Left, 5);
        assert_eq!(displacements(&plain.markers)[98], 98.0);
        let halved = worn(WearSpec { gain: 0.5, ..WearSpec::default() }, 1, Side::Left, 5);
        assert!((displacements(&halved.markers)[98] - 49.0).abs() < 1e-3);
        let dead = worn(WearSpec { dead_share: 0.3, ..WearSpec::default() }, 1, Side::Left, 5);
        let still = displacements(&dead.markers).iter().skip(1).filter(|d| **d == 0.0).count();
        assert!((15..45).contains(&still), "{still} of 99");
        for spec in [
            WearSpec { noise_px: 0.5, ..WearSpec::default() },
            WearSpec { offset_px: 0.5, ..WearSpec::default() },
        ] {
            let once = worn(spec, 1, Side::Left, 5).markers.current;
            assert_eq!(once, worn(spec, 1, Side::Left, 5).markers.current);
            assert_ne!(once, plain.markers.current);
            assert_ne!(once, worn(spec, 2, Side::Left, 5).markers.current);
            assert_ne!(once, worn(spec, 1, Side::Right, 5).markers.current);
            assert_eq!(once == worn(spec, 1, Side::Left, 6).markers.current, spec.noise_px == 0.0);
        }
        let noisy = worn(WearSpec { image_noise: 3.0, ..WearSpec::default() }, 1, Side::Left, 5);
        assert_ne!(noisy.image, plain.image);
        assert_eq!(noisy.markers.current, plain.markers.current);
    }
}
