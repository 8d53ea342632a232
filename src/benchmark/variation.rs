//! Variation of the soft objects, the light and the cameras of a suite from episode to episode.

use std::{collections::BTreeMap, sync::Arc};

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::seed::{EpisodeSeed, RandomStream, uniform};
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};
use softvt_common::text::format_number;
use softvt_evaluation::instance::{InstanceFactors, InstancePresses};
use softvt_robot::spec::PadSpec;
use softvt_scene::{
    Asset, Body, CameraVariation, HiddenProperties, LightVariation, Object, ObjectVariation, Scene,
    SceneVariation,
};

/// Ends of the range of a factor; both are positive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FactorRange {
    pub min: f64,
    pub max: f64,
}

impl FactorRange {
    /// True if a factor is within the range, ends included.
    fn contains(self, factor: f64) -> bool {
        (self.min..=self.max).contains(&factor)
    }

    /// The range of a factor that changes nothing.
    pub const ONE: Self = Self { min: 1.0, max: 1.0 };

    fn uniform(self, rng: &mut ChaCha8Rng) -> f64 {
        self.min + (self.max - self.min) * uniform(rng)
    }

    /// Log-uniform: a half is as likely as a double.
    fn log_uniform(self, rng: &mut ChaCha8Rng) -> f64 {
        self.min * (self.max / self.min).powf(uniform(rng))
    }
}

/// Exponent of the stable strain over age: stale crumb is stiffer and cracks at a smaller strain. About 0.7 by the
/// measurements of Cornford, Axford and Elton (1964) and Scanlon, Sapirstein and Fahloul (2000).
const STALING_EXPONENT: f64 = 0.7;

/// Largest share of its limit that an instance may deform by its own weight when it is carried. Beyond it no
/// grip is reliably safe.
const MAX_CARRIED: f64 = 0.5;

/// Draws of an object before its ranges count as empty.
const MAX_DRAWS: u32 = 10_000;

/// Ranges of the properties of soft objects that do not show. All but `window_ratio` are drawn log-uniform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HiddenRanges {
    /// Relative density a of the foam: density ∝ a and Young's modulus ∝ a² (Gibson and Ashby, open cells).
    pub aeration: FactorRange,
    /// Age s: Young's modulus ∝ s, stable strain ∝ s^−0.7.
    pub staling: FactorRange,
    pub filling: FactorRange,
    /// Static friction of every pair with the object.
    pub coating: FactorRange,
    /// Kept instances: largest over smallest safe grip force, by the draw reference of the asset.
    pub window_ratio: FactorRange,
}

/// No instance within the ranges of a variation can be kept, or its window is unknown.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VariationError {
    #[error("has no soft object")]
    NoSoftObject,
    #[error("{0}")]
    NoInstance(String),
}

/// Presses of an asset from which its instances are drawn.
#[derive(Clone)]
pub struct DrawPresses {
    /// Presses of its draw reference, by which instances are kept.
    pub reference: Arc<InstancePresses>,
    /// Presses of its calibration, by which the windows of instances are stated.
    pub calibrated: Arc<InstancePresses>,
}

/// The presses of an asset, if it has both. Only variations with hidden properties ask.
pub type DrawPressLookup<'a> = dyn Fn(&Asset) -> Result<Option<DrawPresses>, VariationError> + 'a;

/// Ranges from which the objects, the light and the cameras of an episode are drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariationRanges {
    pub name: String,
    /// Size of a soft object, uniform.
    pub size: FactorRange,
    /// Young's modulus of a soft object, log-uniform.
    pub stiffness: FactorRange,
    /// Density of a soft object, log-uniform.
    pub density: FactorRange,
    /// Friction of a soft object, log-uniform.
    pub friction: FactorRange,
    /// Largest relative change of each colour channel of a soft object.
    pub colour: f64,
    /// Strength of lamp and sky, log-uniform.
    pub light: FactorRange,
    /// Largest displacement of a camera along each of its axes, m.
    #[serde(rename = "camera_offset_m")]
    pub camera_offset: f64,
    /// Largest rotation of a camera about each of its axes, rad.
    #[serde(rename = "camera_rotation_rad")]
    pub camera_rotation: f64,
    /// Properties that do not show.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hidden: Option<HiddenRanges>,
}

impl VariationRanges {
    /// True if every episode has the objects, the light and the cameras of its layout.
    pub fn changes_nothing(&self) -> bool {
        let Self { name: _, size, stiffness, density, friction, colour, light, hidden, .. } = self;
        [size, stiffness, density, friction, light].iter().all(|range| **range == FactorRange::ONE)
            && [*colour, self.camera_offset, self.camera_rotation] == [0.0; 3]
            && hidden.is_none()
    }

    /// Draws the variation of an episode. Each factor has a stream of its own, except stiffness, density and friction,
    /// which are drawn from that of the material. Soft objects are drawn in the order of the scene.
    ///
    /// With hidden properties, everything but size, colour and looks is drawn again until the window of the instance is
    /// within `window_ratio`, so that neither size nor colour depends on what is hidden. That window is by the draw
    /// reference of the asset: the calibration states a window and decides nothing.
    ///
    /// # Errors
    /// The scene has no soft object, or no instance can be kept.
    pub fn draw(
        &self,
        seed: &EpisodeSeed,
        scene: &Scene,
        presses_of: &DrawPressLookup<'_>,
    ) -> Result<SceneVariation, VariationError> {
        let mut streams = InstanceStreams::of(seed);
        let [mut colour, mut light, mut camera] =
            [RandomStream::Colour, RandomStream::Light, RandomStream::Camera]
                .map(|stream| seed.stream(stream));
        let mut objects = BTreeMap::new();
        for object in scene.objects.iter().filter(|object| SceneVariation::applies_to(&object.asset.body)) {
            let drawn = ObjectVariation {
                colour: std::array::from_fn(|_| 1.0 + around_zero(&mut colour, self.colour)),
                ..self.draw_instance(&mut streams, &object.nominal, &factors_in_layout(object), presses_of)?
            };
            objects.insert(object.name.clone(), drawn);
        }
        if objects.is_empty() {
            return Err(VariationError::NoSoftObject);
        }
        let mut cameras = BTreeMap::new();
        for moved in scene.cameras.iter().filter(|camera| SceneVariation::moves(camera.mount)) {
            let drawn = CameraVariation {
                offset_m: std::array::from_fn(|_| around_zero(&mut camera, self.camera_offset)),
                rotation_rad: std::array::from_fn(|_| around_zero(&mut camera, self.camera_rotation)),
            };
            cameras.insert(moved.name.clone(), drawn);
        }
        let light = LightVariation { strength: self.light.log_uniform(&mut light) };
        Ok(SceneVariation { objects, light, cameras })
    }

    /// Draws `count` instances of an asset as episodes do, from streams of their own that no episode uses: the
    /// statistics of the suite, for controllers that know these but not the instance.
    pub fn sample_instances(
        &self,
        suite: &str,
        asset: &Asset,
        count: u32,
        presses_of: &DrawPressLookup<'_>,
    ) -> Result<Vec<ObjectVariation>, VariationError> {
        let id = EpisodeId {
            suite: suite.into(),
            task: 0,
            episode: 0,
            base_seed: 0,
            split: EpisodeSplit::Experiment,
        };
        let mut streams = InstanceStreams::of(&EpisodeSeed::new(&id, &asset.name));
        // The lookup takes milliseconds.
        let presses = self.hidden.as_ref().map(|_| presses_of(asset)).transpose()?.flatten();
        let known = |_: &Asset| Ok(presses.clone());
        (0..count)
            .map(|_| self.draw_instance(&mut streams, asset, &InstanceFactors::NOMINAL, &known))
            .collect()
    }

    fn draw_instance(
        &self,
        streams: &mut InstanceStreams,
        asset: &Asset,
        layout: &InstanceFactors,
        presses_of: &DrawPressLookup<'_>,
    ) -> Result<ObjectVariation, VariationError> {
        let scale = self.size.uniform(&mut streams.size);
        let mut draw_material = || ObjectVariation {
            scale,
            youngs_factor: self.stiffness.log_uniform(&mut streams.material),
            density_factor: self.density.log_uniform(&mut streams.material),
            friction_factor: self.friction.log_uniform(&mut streams.material),
            colour: [1.0; 3],
            hidden: None,
        };
        let Some(ranges) = &self.hidden else { return Ok(draw_material()) };
        let (name, variation) = (&asset.name, &self.name);
        let no_window = || {
            VariationError::NoInstance(format!(
                "asset {name} has no calibrated window or no draw reference (assets/draws/{name}.json), by which the \
                 variation {variation:?} selects instances; calibrate it: softvt scripts/calibrate.lua --asset {name}"
            ))
        };
        let DrawPresses { reference, calibrated } = presses_of(asset)?.ok_or_else(no_window)?;
        for draws in 1..=MAX_DRAWS {
            let material = draw_material();
            let (drawn, mut hidden) = ranges.draw(&mut streams.hidden, material);
            if let Some(strain) = too_large(asset, hidden.strain_factor) {
                let strain = format_number(strain);
                return Err(VariationError::NoInstance(format!(
                    "variation {variation:?}: staling gives {name} a strain of {strain}, above 1; begin staling at 1"
                )));
            }
            let factors = InstanceFactors {
                scale: layout.scale * scale,
                youngs: layout.youngs * drawn.youngs_factor,
                density: layout.density * drawn.density_factor,
                strain: hidden.strain_factor,
                friction: hidden.coating / PadSpec::default().static_mu,
            };
            let window = reference.window(&factors).ok_or_else(no_window)?;
            if window.carried <= MAX_CARRIED && ranges.window_ratio.contains(window.ratio()) {
                let stated = calibrated.window(&factors).map_or(1.0, |window| window.ratio());
                (hidden.window_ratio, hidden.draws) = (stated, draws);
                return Ok(ObjectVariation { hidden: Some(hidden), ..drawn });
            }
        }
        let [min, max] = [ranges.window_ratio.min, ranges.window_ratio.max].map(format_number);
        Err(VariationError::NoInstance(format!(
            "variation {variation:?}: none of {MAX_DRAWS} instances of asset {name} has a safe window with a ratio of forces \
             in {min}..{max}; widen window_ratio, filling or coating"
        )))
    }
}

impl HiddenRanges {
    /// Draws the properties, and the material that they give to an instance of `material`.
    fn draw(&self, rng: &mut ChaCha8Rng, material: ObjectVariation) -> (ObjectVariation, HiddenProperties) {
        let hidden = HiddenProperties {
            aeration: self.aeration.log_uniform(rng),
            staling: self.staling.log_uniform(rng),
            strain_factor: 1.0,
            filling: self.filling.log_uniform(rng),
            coating: self.coating.log_uniform(rng),
            window_ratio: 1.0,
            draws: 1,
        };
        let drawn = ObjectVariation {
            youngs_factor: material.youngs_factor * hidden.aeration.powi(2) * hidden.staling,
            density_factor: material.density_factor * hidden.aeration * hidden.filling,
            ..material
        };
        (drawn, HiddenProperties { strain_factor: hidden.staling.powf(-STALING_EXPONENT), ..hidden })
    }
}

struct InstanceStreams {
    size: ChaCha8Rng,
    material: ChaCha8Rng,
    hidden: ChaCha8Rng,
}

impl InstanceStreams {
    fn of(seed: &EpisodeSeed) -> Self {
        let [size, material, hidden] = [RandomStream::Size, RandomStream::Material, RandomStream::Hidden]
            .map(|stream| seed.stream(stream));
        Self { size, material, hidden }
    }
}

fn factors_in_layout(object: &Object) -> InstanceFactors {
    InstanceFactors {
        scale: object.scale,
        youngs: object.youngs_factor().unwrap_or(1.0),
        density: object.density_factor().unwrap_or(1.0),
        ..InstanceFactors::NOMINAL
    }
}

/// A number in −most..most.
fn around_zero(rng: &mut ChaCha8Rng, most: f64) -> f64 {
    most * (2.0 * uniform(rng) - 1.0)
}

/// The strain of a material that `factor` makes larger than 1.
fn too_large(asset: &Asset, factor: f64) -> Option<f64> {
    let Body::Soft(material) = &asset.body else { return None };
    let strains = [material.collapse_strain, material.damage_strain];
    strains.into_iter().flatten().map(|strain| factor * strain).find(|strain| *strain > 1.0)
}
