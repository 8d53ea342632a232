//! Illumination on points of surfaces, eight at once.

use crate::scene::Lighting;
use crate::sensing::camera::{
    V3,
    shade::shadow::ShadowMap,
    simd::{F8, V8, exp2},
};

/// SurfaceSamples of surfaces that are looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceSamples {
    /// World, m.
    pub p: V8,
    /// Unit normals, world.
    pub n: V8,
    /// Linear RGB.
    pub albedo: V8,
    pub roughness: F8,
    pub metalness: F8,
    /// Share of the sky that is not hidden by the object itself.
    pub open: F8,
    /// Numbers of the things.
    pub thing: F8,
}

/// The light that reaches the eye from points, linear RGB: from the key light, and from everywhere else.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DirectAndAmbient {
    pub direct: V8,
    pub ambient: V8,
}

impl DirectAndAmbient {
    /// With shares of both reaching the points.
    #[inline(always)]
    pub(crate) fn dimmed(&self, direct: F8, ambient: F8) -> V8 {
        self.direct * direct + self.ambient * ambient
    }
}

/// The light of a stage, ready for use.
#[derive(Clone, Debug)]
pub(crate) struct Illumination {
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
            widening: 0.5 * lighting.key.softness_rad as f32,
        }
    }

    /// From the horizon to the zenith or the ground.
    #[inline(always)]
    fn towards(&self, up: F8, share: F8) -> V8 {
        let horizon = V8::splat(&self.horizon);
        let above = up.simd_gt(F8::ZERO);
        let end = V8::splat(&self.zenith).or(above, V8::splat(&self.ground));
        horizon + (end - horizon) * share
    }

    /// The sky in directions (unit z components `up`).
    #[inline(always)]
    pub(crate) fn sky(&self, up: F8) -> V8 {
        self.towards(up, up.abs().fast_min(F8::ONE).sqrt())
    }

    /// Irradiance from the sky over π on surfaces whose normals' z components are `up`.
    #[inline(always)]
    fn fill(&self, up: F8) -> V8 {
        self.towards(up, up.abs())
    }

    /// Illumination from points towards `to_eye` (unit), before anything else shades it.
    ///
    /// Lambert and GGX with Smith's height-correlated masking (Walter et al., Microfacet Models for Refraction, 2007;
    /// Heitz, Understanding the Masking-Shadowing Function, JCGT 2014) and Schlick's Fresnel term; the sky's reflection
    /// by Karis's fit (Physically Based Shading on Mobile, 2014).
    #[inline(always)]
    pub(crate) fn split(&self, s: &SurfaceSamples, to_eye: V8) -> DirectAndAmbient {
        let one = F8::ONE;
        let n_v = s.n.dot(to_eye).fast_max(F8::splat(0.02));
        let diffuse = s.albedo * (one - s.metalness);
        let f0 = (s.albedo * s.metalness).map(|c| c + F8::splat(0.04) * (one - s.metalness));
        let mirror = s.n.z * (F8::splat(2.0) * s.n.dot(to_eye)) - to_eye.z;
        let seen = self.sky(mirror) * (one - s.roughness) + self.fill(mirror) * s.roughness;
        let (scale, bias) = reflected(s.roughness, n_v);
        let ambient = diffuse.times(self.fill(s.n.z)) + f0.map(|c| c * scale + bias).times(seen);
        DirectAndAmbient { direct: self.direct(s, to_eye, diffuse, f0), ambient: ambient * s.open }
    }

    /// The key light's part.
    #[inline(always)]
    fn direct(&self, s: &SurfaceSamples, to_eye: V8, diffuse: V8, f0: V8) -> V8 {
        let (one, half_one) = (F8::ONE, F8::splat(0.5));
        let to_key = V8::splat(&self.to_key);
        let n_v = s.n.dot(to_eye).fast_max(F8::splat(0.02));
        let n_l = s.n.dot(to_key).fast_max(F8::ZERO);
        // Both angles with the half vector h = eye + key from its square, 2 + 2 eye · key, without making it of unit length.
        let half2 = (F8::splat(2.0) + F8::splat(2.0) * to_eye.dot(to_key)).fast_max(F8::splat(1e-6));
        let n_h = (s.n.dot(to_eye) + s.n.dot(to_key)).fast_max(F8::ZERO);
        let l_h = (half2 * F8::splat(0.25)).fast_min(one).sqrt();
        let alpha = (s.roughness * s.roughness + F8::splat(self.widening)).fast_max(F8::splat(0.02));
        let alpha = alpha.fast_min(one);
        let a2 = alpha * alpha;
        let d = (n_h * n_h).fast_min(half2) * (a2 - one) + half2;
        let masked = n_l * (n_v * n_v * (one - a2) + a2).sqrt() + n_v * (n_l * n_l * (one - a2) + a2).sqrt();
        let grazing = (one - l_h) * (one - l_h);
        let grazing = grazing * grazing * (one - l_h);
        // D V F with the light's irradiance π times its strength; D over the fourth power of the half vector's length.
        let strength = a2 * half_one * half2 * half2 / (d * d * masked);
        let specular = f0.map(|c| (c + (one - c) * grazing) * strength);
        (diffuse + specular).times(V8::splat(&self.key)) * n_l
    }

    /// What of the key light casters leave at points.
    #[inline(always)]
    pub(crate) fn unshadowed(&self, p: V8, n: &V8, map: &ShadowMap) -> F8 {
        map.light(&map.places(p), n, self.lit(n))
    }

    /// The same by two maps: a fine one where it reaches, and a wide one, if there is any, elsewhere.
    #[inline(always)]
    pub(crate) fn unshadowed_afar(&self, p: V8, n: &V8, fine: &ShadowMap, wide: Option<&ShadowMap>) -> F8 {
        let (at, lit) = (fine.places(p), self.lit(n));
        let near = fine.light(&at, n, lit);
        let beyond = lit & !fine.inside(&at);
        match wide {
            Some(wide) if beyond.any() => near * wide.light(&wide.places(p), n, beyond),
            _ => near,
        }
    }

    /// Which surfaces face the key light.
    #[inline(always)]
    fn lit(&self, n: &V8) -> F8 {
        n.dot(V8::splat(&self.to_key)).simd_gt(F8::ZERO)
    }
}

/// Factor of the reflectance at normal incidence, and what is added to it.
#[inline(always)]
fn reflected(roughness: F8, n_v: F8) -> (F8, F8) {
    let linear = |a: f32, b: f32| F8::splat(a) + F8::splat(b) * roughness;
    let r = linear(1.0, -1.0);
    // 0.001 to the power of 0.93 n_v.
    let fall = exp2(n_v * F8::splat(-9.268_2)).fast_min(r * r);
    let a004 = fall * r + linear(0.0425, -0.0275);
    let scale = linear(1.04, -0.572) - F8::splat(1.04) * a004;
    let bias = linear(-0.04, 0.022) + F8::splat(1.04) * a004;
    (scale, bias.fast_max(F8::ZERO))
}

/// Something that hides part of the sky from what is near: an ellipsoid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OcclusionEllipsoid {
    /// RenderObject it stands for; it hides nothing from itself.
    pub thing: usize,
    centre: V3,
    radii: V3,
    /// Square of the distance at which it is forgotten.
    reach2: f32,
}

impl OcclusionEllipsoid {
    /// That of a box, world.
    pub(crate) fn of_bounds(thing: usize, [low, high]: &[V3; 2]) -> Self {
        let radii = ((high - low) * 0.5).add_scalar(1e-4);
        let reach = 2.6 * radii.max();
        Self { thing, centre: (low + high) * 0.5, radii, reach2: reach * reach }
    }

    /// Whether it hides sky from anything in a box.
    pub(crate) fn reaches(&self, [low, high]: &[V3; 2]) -> bool {
        let nearest = self.centre.sup(low).inf(high);
        (nearest - self.centre).norm_squared() < self.reach2
    }
}

/// Share of the sky that blobs leave open at `p` on surfaces of normals `n` (Quilez, Sphere Ambient Occlusion, 2006, in
/// the space in which the ellipsoid is a ball). `own` is the thing each point belongs to.
#[inline(always)]
pub(crate) fn open_sky(blobs: &[OcclusionEllipsoid], p: V8, n: V8, own: F8) -> F8 {
    let mut open = F8::ONE;
    for blob in blobs {
        let d = V8::splat(&blob.centre) - p;
        let d2 = d.dot(d);
        let near = d2.simd_lt(F8::splat(blob.reach2)) & own.simd_ne(F8::splat(blob.thing as f32));
        if !near.any() {
            continue;
        }
        let q = d.times(V8::splat(&blob.radii.map(|r| 1.0 / r)));
        let normal = n.times(V8::splat(&blob.radii));
        let (q2, n2) = (q.dot(q), normal.dot(normal));
        let cosine = (normal.dot(q) / (q2 * n2).fast_max(F8::splat(1e-18)).sqrt()).fast_max(F8::ZERO);
        let fade = F8::ONE - d2 * F8::splat(1.0 / blob.reach2);
        let hidden = F8::splat(0.75) * cosine * fade / q2.fast_max(F8::ONE);
        open *= F8::ONE - (near & hidden);
    }
    open
}
