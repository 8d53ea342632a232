//! Noise and wear of the tactile sensors (settings `tactile.wear.*`), applied to finished readings.
//!
//! Offsets and dead markers belong to a finger and an episode; noise also to the physics step. All come from the sensor
//! stream of the episode, so a reading does not depend on when or how often it is computed.

use softvt_benchmark::seed::{
    EpisodeSeed, RandomStream, keyed_rng, standard_normal, uniform, uniform_integer,
};
use softvt_robot::Side;
use softvt_sensing::tactile::{TactileReading, WearSpec};

/// Seed of the noise and wear of an episode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WearSeed(i64);

impl WearSeed {
    /// The seed of an episode, from its sensor stream.
    pub fn new(seed: &EpisodeSeed) -> Self {
        Self(uniform_integer(&mut seed.stream(RandomStream::Sensor), i64::MIN, i64::MAX))
    }

    /// Applies noise and wear to the reading of a finger at a physics step. `untouched` is the image without a contact.
    pub(crate) fn apply(
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
        for (value, untouched) in reading.image.iter_mut().zip(untouched) {
            let untouched = f64::from(*untouched);
            let level = untouched + spec.gain * (f64::from(*value) - untouched);
            let jitter =
                if spec.image_noise > 0.0 { spec.image_noise * standard_normal(&mut noise) } else { 0.0 };
            *value = (level + jitter).round().clamp(0.0, 255.0) as u8;
        }
    }
}

#[cfg(test)]
mod tests {
    use softvt_sensing::tactile::{
        GelScratch, Markers, PadWrench, TactileContact, TactileSensor, TactileSpec,
    };

    use super::*;

    fn worn(spec: WearSpec, seed: i64, side: Side, step: u64) -> TactileReading {
        let sensor = TactileSensor::new(&TactileSpec::default()).expect("a sensor");
        let contact =
            TactileContact { wrench: PadWrench::default(), skins: &[], friction: 1.0, substrate: None };
        let mut reading = sensor.read(&contact, &mut GelScratch::default()).expect("a reading");
        for (marker, current) in reading.markers.current.iter_mut().enumerate() {
            current[0] += marker as f32;
        }
        WearSeed(seed).apply(&spec, side, step, &sensor.untouched_image, &mut reading);
        reading
    }

    fn displacements(markers: &Markers) -> Vec<f32> {
        markers.initial.iter().zip(&markers.current).map(|(from, to)| to[0] - from[0]).collect()
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
