//! Single-precision vectors of the renderer, one or eight at a time.
//!
//! Every eight-lane operation here rounds alike on every processor: no fused multiply-add, no reciprocal estimates and
//! no functions of the platform's math library. Images are therefore byte-identical across machines.

use wide::{bytemuck::cast, i32x8, u32x8};

pub(crate) use wide::f32x8;

use softvt_geometry::Pose;

/// A point, direction or linear RGB colour.
pub(crate) type V3 = nalgebra::Vector3<f32>;

/// True if no component of `pose` is infinite or NaN.
pub(crate) fn is_finite(pose: &Pose) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
}

/// The lower of two numbers. A comparison is one instruction, unlike `f32::min`.
pub(crate) fn lower(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The higher of two numbers, as [`lower`].
pub(crate) fn higher(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Lowest and highest corner of a bounding box.
pub(crate) type Bounds = [V3; 2];

/// Bounds of points; inverted without any.
pub(crate) fn bounds_of(points: impl IntoIterator<Item = V3>) -> Bounds {
    let [mut low, mut high] = [f32::MAX, f32::MIN].map(V3::repeat);
    for p in points {
        (low, high) = (low.zip_map(&p, lower), high.zip_map(&p, higher));
    }
    [low, high]
}

/// Number of points shaded at once.
pub(crate) const LANES: usize = 8;

/// The index of each lane: 0, 1, … 7.
pub(crate) const LANE_INDEX: f32x8 = f32x8::new([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);

/// Eight three-component vectors.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Vec3x8 {
    pub(crate) x: f32x8,
    pub(crate) y: f32x8,
    pub(crate) z: f32x8,
}

impl Vec3x8 {
    #[inline(always)]
    pub(crate) fn splat(v: &V3) -> Self {
        Self { x: f32x8::splat(v.x), y: f32x8::splat(v.y), z: f32x8::splat(v.z) }
    }

    /// Builds eight vectors from one array per component.
    #[inline(always)]
    pub(crate) fn from_arrays(components: &[[f32; LANES]; 3]) -> Self {
        Self { x: f32x8::new(components[0]), y: f32x8::new(components[1]), z: f32x8::new(components[2]) }
    }

    /// Returns one array per component.
    #[inline(always)]
    pub(crate) fn to_arrays(self) -> [[f32; LANES]; 3] {
        [self.x.to_array(), self.y.to_array(), self.z.to_array()]
    }

    #[inline(always)]
    pub(crate) fn dot(self, o: Self) -> f32x8 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub(crate) fn component_mul(self, o: Self) -> Self {
        Self { x: self.x * o.x, y: self.y * o.y, z: self.z * o.z }
    }

    /// Scales to unit length; zero stays zero.
    #[inline(always)]
    pub(crate) fn normalized(self) -> Self {
        let squared = self.dot(self).fast_max(f32x8::splat(1e-30));
        self * (f32x8::ONE / squared.sqrt())
    }

    /// Applies `f` to each component.
    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(f32x8) -> f32x8) -> Self {
        Self { x: f(self.x), y: f(self.y), z: f(self.z) }
    }

    /// Returns `if_set` in lanes whose mask is set, else `if_clear`.
    #[inline(always)]
    pub(crate) fn select(mask: f32x8, if_set: Self, if_clear: Self) -> Self {
        Self {
            x: mask.select(if_set.x, if_clear.x),
            y: mask.select(if_set.y, if_clear.y),
            z: mask.select(if_set.z, if_clear.z),
        }
    }
}

impl std::ops::Add for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl std::ops::Sub for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl std::ops::Mul<f32x8> for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, by: f32x8) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}

/// Base-2 logarithm of positive numbers, to about 0.01: accurate enough to choose a mip level.
#[inline(always)]
pub(crate) fn approx_log2(x: f32x8) -> f32x8 {
    let bits: i32x8 = cast(x);
    let exponent = f32x8::from_i32x8((bits >> 23) - i32x8::splat(127));
    let mantissa: f32x8 = cast((bits & i32x8::splat(0x007F_FFFF)) | i32x8::splat(0x3F80_0000));
    let m = mantissa - f32x8::ONE;
    // The quadratic through both ends of 1..2 with the smallest maximum error between them.
    exponent + m * (f32x8::splat(1.344) - f32x8::splat(0.344) * m)
}

/// 2 to the power of numbers in −60..=0, to a relative error of 1e-4.
#[inline(always)]
pub(crate) fn approx_exp2(x: f32x8) -> f32x8 {
    let integer = (x + f32x8::splat(60.0)).fast_trunc_int() - i32x8::splat(60);
    let f = x - f32x8::from_i32x8(integer);
    let power: f32x8 = cast((integer + i32x8::splat(127)) << 23);
    // The cubic that is exact at 0, 1/3, 2/3 and 1.
    let curve = f32x8::ONE
        + f * (f32x8::splat(0.695_984) + f * (f32x8::splat(0.224_996) + f * f32x8::splat(0.079_020)));
    power * curve
}

/// Rounds non-negative numbers down to integers.
#[inline(always)]
pub(crate) fn floor_to_u32(x: f32x8) -> [u32; LANES] {
    let integers: u32x8 = cast(x.fast_trunc_int());
    integers.to_array()
}

/// Sums the lanes in a fixed order, so that the result does not depend on the processor.
pub(crate) fn sum_lanes(x: f32x8) -> f32 {
    let [a, b, c, d, e, f, g, h] = x.to_array();
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn approximations_are_within_their_stated_errors() {
        for i in 0..2000_u16 {
            let x = 1.0 + f32::from(i) * 0.37;
            let log = approx_log2(f32x8::splat(x)).to_array()[3];
            assert!((log - x.log2()).abs() < 0.01, "log2 {x}: {log}");
            let y = -f32::from(i) * 0.005;
            let power = approx_exp2(f32x8::splat(y)).to_array()[5];
            assert!((power / y.exp2() - 1.0).abs() < 2e-4, "2^{y}: {power}");
        }
    }
}
