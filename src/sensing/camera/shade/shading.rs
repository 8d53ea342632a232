//! Reflected light at surface points, eight at a time.

use super::shadow::{LightSpacePoints, ShadowMap};
use crate::camera::math::{V3, Vec3x8, approx_exp2, f32x8};
use softvt_scene::Lighting;

/// Eight surface points to be shaded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceSamples {
    /// Positions, world, m.
    pub(crate) p: Vec3x8,
    /// Unit normals, world.
    pub(crate) n: Vec3x8,
    /// Diffuse or metallic colour, linear RGB.
    pub(crate) albedo: Vec3x8,
    pub(crate) roughness: f32x8,
    pub(crate) metalness: f32x8,
    /// Fraction of the sky left visible by the object itself.
    pub(crate) sky_visibility: f32x8,
    /// Indices of the objects in the scene.
    pub(crate) object: f32x8,
}

impl SurfaceSamples {
    /// The colour of diffuse reflection: metals have none.
    #[inline(always)]
    pub(crate) fn diffuse_albedo(&self) -> Vec3x8 {
        self.albedo * (f32x8::ONE - self.metalness)
    }
}

/// Radiance towards the eye, linear RGB, by source: the key light and the sky.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DirectAndAmbient {
    pub(crate) direct: Vec3x8,
    pub(crate) ambient: Vec3x8,
}

/// Light towards the eye, linear RGB, apart from the diffuse albedo of the surface.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReflectedLight {
    /// Diffuse radiance of a white surface.
    pub(crate) diffuse: Vec3x8,
    /// Specular radiance, linear RGB.
    pub(crate) specular: Vec3x8,
}

impl ReflectedLight {
    #[inline(always)]
    pub(crate) fn radiance(&self, diffuse_albedo: Vec3x8) -> Vec3x8 {
        self.diffuse.component_mul(diffuse_albedo) + self.specular
    }
}

/// Light towards the eye by source: the key light and the sky.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBySource {
    pub(crate) direct: ReflectedLight,
    pub(crate) ambient: ReflectedLight,
}

impl LightBySource {
    /// Radiance of a surface of this diffuse albedo.
    #[inline(always)]
    pub(crate) fn radiance(&self, diffuse_albedo: Vec3x8) -> DirectAndAmbient {
        DirectAndAmbient {
            direct: self.direct.radiance(diffuse_albedo),
            ambient: self.ambient.radiance(diffuse_albedo),
        }
    }
}

impl std::ops::Add for ReflectedLight {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { diffuse: self.diffuse + o.diffuse, specular: self.specular + o.specular }
    }
}

impl std::ops::Mul<f32x8> for ReflectedLight {
    type Output = Self;
    #[inline(always)]
    fn mul(self, by: f32x8) -> Self {
        Self { diffuse: self.diffuse * by, specular: self.specular * by }
    }
}

/// The key light and the sky of a scene, converted for shading.
#[derive(Clone, Debug)]
pub(crate) struct Illumination {
    /// Unit vector towards the key light.
    to_key: V3,
    /// Colour of the key light times its strength.
    key: V3,
    zenith: V3,
    horizon: V3,
    ground: V3,
    /// Added to the squared roughness, so that highlights show the size of the lamp.
    roughness_offset: f32,
}

impl Illumination {
    pub(crate) fn new(lighting: &Lighting) -> Self {
        let scaled = |colour: [f64; 3], by: f64| V3::from(colour.map(|c| (c * by) as f32));
        let sky = &lighting.sky;
        Self {
            to_key: lighting.key.direction_w.normalize().cast(),
            key: scaled(lighting.key.colour, lighting.key.strength),
            zenith: scaled(sky.zenith, sky.strength),
            horizon: scaled(sky.horizon, sky.strength),
            ground: scaled(sky.ground, sky.strength),
            roughness_offset: 0.5 * lighting.key.softness_rad as f32,
        }
    }

    /// Interpolates from the horizon to the zenith where `z` is positive, else to the ground.
    #[inline(always)]
    fn sky_gradient(&self, z: f32x8, share: f32x8) -> Vec3x8 {
        let horizon = Vec3x8::splat(&self.horizon);
        let is_above = z.simd_gt(f32x8::ZERO);
        let end = Vec3x8::select(is_above, Vec3x8::splat(&self.zenith), Vec3x8::splat(&self.ground));
        horizon + (end - horizon) * share
    }

    /// Radiance of the sky in unit directions with this z component.
    #[inline(always)]
    pub(crate) fn sky_radiance(&self, z: f32x8) -> Vec3x8 {
        self.sky_gradient(z, z.abs().fast_min(f32x8::ONE).sqrt())
    }

    /// Irradiance from the sky, divided by π, on surfaces whose unit normal has this z component.
    #[inline(always)]
    fn sky_irradiance(&self, z: f32x8) -> Vec3x8 {
        self.sky_gradient(z, z.abs())
    }

    /// Light that surface points reflect towards `to_eye` (unit vectors), before shadows and occlusion by others.
    ///
    /// Lambert and GGX with Smith's height-correlated masking (Walter et al., Microfacet Models for Refraction, 2007;
    /// Heitz, Understanding the Masking-Shadowing Function, JCGT 2014) and Schlick's Fresnel term. The reflection of
    /// the sky uses Karis's fit (Physically Based Shading on Mobile, 2014).
    #[inline(always)]
    pub(crate) fn reflect(&self, s: &SurfaceSamples, to_eye: Vec3x8) -> LightBySource {
        let one = f32x8::ONE;
        let n_v = s.n.dot(to_eye).fast_max(f32x8::splat(0.02));
        let f0 = (s.albedo * s.metalness).map(|c| c + f32x8::splat(0.04) * (one - s.metalness));
        let reflect_z = s.n.z * (f32x8::splat(2.0) * s.n.dot(to_eye)) - to_eye.z;
        let reflected =
            self.sky_radiance(reflect_z) * (one - s.roughness) + self.sky_irradiance(reflect_z) * s.roughness;
        let [scale, bias] = environment_brdf(s.roughness, n_v);
        let ambient = ReflectedLight {
            diffuse: self.sky_irradiance(s.n.z),
            specular: f0.map(|c| c * scale + bias).component_mul(reflected),
        };
        LightBySource { direct: self.reflect_key(s, to_eye, f0), ambient: ambient * s.sky_visibility }
    }

    #[inline(always)]
    fn reflect_key(&self, s: &SurfaceSamples, to_eye: Vec3x8, f0: Vec3x8) -> ReflectedLight {
        let (one, one_half) = (f32x8::ONE, f32x8::splat(0.5));
        let to_key = Vec3x8::splat(&self.to_key);
        let n_v = s.n.dot(to_eye).fast_max(f32x8::splat(0.02));
        let n_l = s.n.dot(to_key).fast_max(f32x8::ZERO);
        // The half vector h = eye + key is not normalised: both angles follow from its squared length 2 + 2 eye · key.
        let half2 = (f32x8::splat(2.0) + f32x8::splat(2.0) * to_eye.dot(to_key)).fast_max(f32x8::splat(1e-6));
        let n_h = (s.n.dot(to_eye) + s.n.dot(to_key)).fast_max(f32x8::ZERO);
        let l_h = (half2 * f32x8::splat(0.25)).fast_min(one).sqrt();
        let alpha =
            (s.roughness * s.roughness + f32x8::splat(self.roughness_offset)).fast_max(f32x8::splat(0.02));
        let alpha = alpha.fast_min(one);
        let a2 = alpha * alpha;
        let d = (n_h * n_h).fast_min(half2) * (a2 - one) + half2;
        let masking = n_l * (n_v * n_v * (one - a2) + a2).sqrt() + n_v * (n_l * n_l * (one - a2) + a2).sqrt();
        let grazing = (one - l_h) * (one - l_h);
        let grazing = grazing * grazing * (one - l_h);
        // D V F for a light of irradiance π times its strength; D carries the fourth power of the half vector's length.
        let strength = a2 * one_half * half2 * half2 / (d * d * masking);
        let specular = f0.map(|c| (c + (one - c) * grazing) * strength);
        let diffuse = Vec3x8::splat(&self.key) * n_l;
        ReflectedLight { diffuse, specular: specular.component_mul(diffuse) }
    }

    /// Visible fraction of the key light at points of normals `n`, by one shadow map.
    #[inline(always)]
    pub(crate) fn key_visibility(&self, at: &LightSpacePoints, n: &Vec3x8, map: &ShadowMap) -> f32x8 {
        map.visibility(at, n, self.faces_key(n))
    }

    /// As [`key_visibility`](Self::key_visibility), by a fine map where it reaches and by a wide
    /// one, if any, elsewhere; `p` are the points in the world.
    #[inline(always)]
    pub(crate) fn key_visibility_cascaded(
        &self,
        p: Vec3x8,
        at: &LightSpacePoints,
        n: &Vec3x8,
        fine: &ShadowMap,
        wide: Option<&ShadowMap>,
    ) -> f32x8 {
        let faces_key = self.faces_key(n);
        let visibility = fine.visibility(at, n, faces_key);
        let is_beyond = faces_key & !at.is_inside;
        match wide {
            Some(wide) if is_beyond.any() => visibility * wide.visibility(&wide.project(p), n, is_beyond),
            _ => visibility,
        }
    }

    #[inline(always)]
    fn faces_key(&self, n: &Vec3x8) -> f32x8 {
        n.dot(Vec3x8::splat(&self.to_key)).simd_gt(f32x8::ZERO)
    }
}

/// Karis's fit of the preintegrated environment BRDF: scale and bias of the reflectance at normal incidence.
#[inline(always)]
fn environment_brdf(roughness: f32x8, n_v: f32x8) -> [f32x8; 2] {
    let linear = |a: f32, b: f32| f32x8::splat(a) + f32x8::splat(b) * roughness;
    let r = linear(1.0, -1.0);
    // 0.001 to the power of 0.93 n·v: close to the 2^(−9.28 n·v) of the fit.
    let fall = approx_exp2(n_v * f32x8::splat(-9.268_2)).fast_min(r * r);
    let a004 = fall * r + linear(0.0425, -0.0275);
    let scale = linear(1.04, -0.572) - f32x8::splat(1.04) * a004;
    let bias = linear(-0.04, 0.022) + f32x8::splat(1.04) * a004;
    [scale, bias.fast_max(f32x8::ZERO)]
}
