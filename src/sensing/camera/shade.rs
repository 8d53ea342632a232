//! Light on a point of a surface.

use std::f32::consts::PI;

use super::{V3, pattern::Look, shadow::ShadowMap};
use crate::scene::Lighting;

/// A point of a surface that is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fragment {
    /// World, m.
    pub p: V3,
    /// Unit normal, world.
    pub n: V3,
    pub look: Look,
}

/// The light that reaches the eye from a point, linear RGB: from the key light, and from everywhere else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub direct: V3,
    pub ambient: V3,
}

impl Split {
    pub const BLACK: Self = Self { direct: V3::new(0.0, 0.0, 0.0), ambient: V3::new(0.0, 0.0, 0.0) };

    /// With shares of both reaching the point.
    pub fn dimmed(&self, (direct, ambient): (f32, f32)) -> V3 {
        self.direct * direct + self.ambient * ambient
    }
}

/// The light of a stage, ready for use.
#[derive(Clone, Debug)]
pub(super) struct Light {
    /// Unit vector to the key light.
    to_key: V3,
    /// Colour times strength.
    key: V3,
    zenith: V3,
    horizon: V3,
    ground: V3,
    /// Added to GGX's width for the size of the lamp.
    widening: f32,
}

impl Light {
    pub fn new(lighting: &Lighting) -> Self {
        let scaled = |colour: [f64; 3], by: f64| V3::from(colour.map(|c| (c * by) as f32));
        let sky = &lighting.sky;
        Self {
            to_key: lighting.key.direction_w.normalize().cast(),
            key: scaled(lighting.key.colour, lighting.key.strength),
            zenith: scaled(sky.zenith, sky.strength),
            horizon: scaled(sky.horizon, sky.strength),
            ground: scaled(sky.ground, sky.strength),
            widening: 0.5 * lighting.key.softness_rad as f32,
        }
    }

    /// The sky in a direction (unit z component `up`).
    pub fn sky(&self, up: f32) -> V3 {
        let end = if up > 0.0 { self.zenith } else { self.ground };
        self.horizon + (end - self.horizon) * up.abs().min(1.0).sqrt()
    }

    /// Irradiance from the sky over π on a surface whose normal's z component is `up`.
    fn fill(&self, up: f32) -> V3 {
        let end = if up > 0.0 { self.zenith } else { self.ground };
        self.horizon + (end - self.horizon) * up.abs()
    }

    /// Light from a fragment towards `to_eye` (unit), before anything else shades it.
    ///
    /// Lambert and GGX with Smith's height-correlated masking (Walter et al., Microfacet Models for Refraction, 2007;
    /// Heitz, Understanding the Masking-Shadowing Function, JCGT 2014) and Schlick's Fresnel term; the sky's reflection
    /// by Karis's fit (Physically Based Shading on Mobile, 2014).
    pub fn split(&self, f: &Fragment, to_eye: &V3) -> Split {
        let look = &f.look;
        let n_v = f.n.dot(to_eye).max(0.02);
        let n_l = f.n.dot(&self.to_key).max(0.0);
        let diffuse = look.albedo * (1.0 - look.metalness);
        let f0 = V3::repeat(0.04 * (1.0 - look.metalness)) + look.albedo * look.metalness;
        let mut direct = V3::zeros();
        if n_l > 0.0 {
            let half = (to_eye + self.to_key).normalize();
            let (n_h, l_h) = (f.n.dot(&half).clamp(0.0, 1.0), half.dot(&self.to_key).clamp(0.0, 1.0));
            let alpha = (look.roughness * look.roughness + self.widening).clamp(0.02, 1.0);
            let a2 = alpha * alpha;
            let d = n_h * n_h * (a2 - 1.0) + 1.0;
            let masked =
                n_l * (n_v * n_v * (1.0 - a2) + a2).sqrt() + n_v * (n_l * n_l * (1.0 - a2) + a2).sqrt();
            let grazing = (1.0 - l_h) * (1.0 - l_h);
            let fresnel = f0 + (V3::repeat(1.0) - f0) * (grazing * grazing * (1.0 - l_h));
            // D V F with the light's irradiance π times its strength.
            let specular = fresnel * (a2 / (PI * d * d) * 0.5 / masked * PI);
            direct = (diffuse + specular).component_mul(&self.key) * n_l;
        }
        let mirror = f.n * (2.0 * f.n.dot(to_eye)) - to_eye;
        let fill = self.fill(f.n.z);
        let seen = self.sky(mirror.z) * (1.0 - look.roughness) + self.fill(mirror.z) * look.roughness;
        let ambient = (diffuse.component_mul(&fill)
            + reflected(&f0, look.roughness, n_v).component_mul(&seen))
            * look.open;
        Split { direct, ambient }
    }

    /// What of the key light casters leave at a fragment.
    pub fn unshadowed(&self, f: &Fragment, map: &ShadowMap) -> f32 {
        if f.n.dot(&self.to_key) <= 0.0 { 1.0 } else { map.light(&map.place(&f.p), &f.n) }
    }
}

fn reflected(f0: &V3, roughness: f32, n_v: f32) -> V3 {
    let r =
        [1.0 - roughness, 0.0425 - 0.0275 * roughness, 1.04 - 0.572 * roughness, 0.022 * roughness - 0.04];
    let fall = (0.001_f32).powf(n_v * 0.93).min(r[0] * r[0]);
    let a004 = fall * r[0] + r[1];
    let (scale, bias) = (-1.04 * a004 + r[2], 1.04 * a004 + r[3]);
    f0 * scale + V3::repeat(bias.max(0.0))
}

/// Something that hides part of the sky from what is near: an ellipsoid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blob {
    /// Thing it stands for; it hides nothing from itself.
    pub thing: usize,
    centre: V3,
    radii: V3,
    /// Square of the distance at which it is forgotten.
    reach2: f32,
}

impl Blob {
    /// That of a box, world.
    pub fn of_bounds(thing: usize, [low, high]: &[V3; 2]) -> Self {
        let radii = ((high - low) * 0.5).add_scalar(1e-4);
        let reach = 2.6 * radii.max();
        Self { thing, centre: (low + high) * 0.5, radii, reach2: reach * reach }
    }
}

/// Share of the sky that blobs leave open at `p` on a surface of normal `n` (Quilez, Sphere Ambient Occlusion, 2006, in
/// the space in which the ellipsoid is a ball).
#[inline]
pub(super) fn open_sky(blobs: &[Blob], p: &V3, n: &V3, own: usize) -> f32 {
    let mut open = 1.0;
    for blob in blobs {
        let d = blob.centre - p;
        let d2 = d.norm_squared();
        if d2 > blob.reach2 || blob.thing == own {
            continue;
        }
        let q = d.component_div(&blob.radii);
        let normal = n.component_mul(&blob.radii);
        let distance2 = q.norm_squared().max(1.0);
        let cosine = (normal.dot(&q) / (normal.norm() * q.norm()).max(1e-9)).max(0.0);
        let fade = 1.0 - d2 / blob.reach2;
        open *= 1.0 - 0.75 * cosine / distance2 * fade;
    }
    open
}
