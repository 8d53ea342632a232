//! Eight points at once. Only operations that every machine rounds alike are used: no fused multiply-add, no reciprocal
//! estimates, no functions of the platform's library.

use wide::{bytemuck::cast, f32x8, i32x8, u32x8};

use crate::sensing::camera::V3;

/// Eight numbers.
pub(crate) type F8 = f32x8;

/// How many points are shaded at once.
pub(crate) const LANES: usize = 8;

/// 0, 1, … 7.
pub(crate) const STEPS: F8 = F8::new([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);

/// Eight vectors.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct V8 {
    pub x: F8,
    pub y: F8,
    pub z: F8,
}

impl V8 {
    #[inline(always)]
    pub(crate) fn splat(v: &V3) -> Self {
        Self { x: F8::splat(v.x), y: F8::splat(v.y), z: F8::splat(v.z) }
    }

    #[inline(always)]
    pub(crate) fn from_arrays(of: &[[f32; LANES]; 3]) -> Self {
        Self { x: F8::new(of[0]), y: F8::new(of[1]), z: F8::new(of[2]) }
    }

    #[inline(always)]
    pub(crate) fn to_arrays(self) -> [[f32; LANES]; 3] {
        [self.x.to_array(), self.y.to_array(), self.z.to_array()]
    }

    #[inline(always)]
    pub(crate) fn dot(self, o: Self) -> F8 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub(crate) fn times(self, o: Self) -> Self {
        Self { x: self.x * o.x, y: self.y * o.y, z: self.z * o.z }
    }

    /// Of unit length; zero stays zero.
    #[inline(always)]
    pub(crate) fn unit(self) -> Self {
        let squared = self.dot(self).fast_max(F8::splat(1e-30));
        self * (F8::ONE / squared.sqrt())
    }

    #[inline(always)]
    pub(crate) fn map(self, each: impl Fn(F8) -> F8) -> Self {
        Self { x: each(self.x), y: each(self.y), z: each(self.z) }
    }

    /// `self` where the mask is set, else `other`.
    #[inline(always)]
    pub(crate) fn or(self, mask: F8, other: Self) -> Self {
        Self {
            x: mask.select(self.x, other.x),
            y: mask.select(self.y, other.y),
            z: mask.select(self.z, other.z),
        }
    }
}

impl std::ops::Add for V8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl std::ops::Sub for V8 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl std::ops::Mul<F8> for V8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, by: F8) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}

/// Base-2 logarithm of positive numbers to about 0.01: enough to choose among copies of a texture.
#[inline(always)]
pub(crate) fn rough_log2(x: F8) -> F8 {
    let bits: i32x8 = cast(x);
    let exponent = F8::from_i32x8((bits >> 23) - i32x8::splat(127));
    let mantissa: F8 = cast((bits & i32x8::splat(0x007F_FFFF)) | i32x8::splat(0x3F80_0000));
    // Quadratic through the ends of 1..2 with the least error between them.
    exponent + (mantissa - F8::ONE) * (F8::splat(1.344) - F8::splat(0.344) * (mantissa - F8::ONE))
}

/// 2 to the power of numbers in −60..=0, to 1e-4 of the value.
#[inline(always)]
pub(crate) fn exp2(x: F8) -> F8 {
    let whole = (x + F8::splat(60.0)).fast_trunc_int() - i32x8::splat(60);
    let f = x - F8::from_i32x8(whole);
    let power: F8 = cast((whole + i32x8::splat(127)) << 23);
    // Cubic with the right values at 0, 1/3, 2/3 and 1.
    let curve = F8::ONE + f * (F8::splat(0.695_984) + f * (F8::splat(0.224_996) + f * F8::splat(0.079_020)));
    power * curve
}

/// Whole numbers at or below numbers that are not negative.
#[inline(always)]
pub(crate) fn whole(x: F8) -> [u32; LANES] {
    let whole: u32x8 = cast(x.fast_trunc_int());
    whole.to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_and_powers_are_as_good_as_they_say() {
        for i in 0..2000_u16 {
            let x = 1.0 + f32::from(i) * 0.37;
            let log = rough_log2(F8::splat(x)).to_array()[3];
            assert!((log - x.log2()).abs() < 0.01, "log2 {x}: {log}");
            let y = -f32::from(i) * 0.005;
            let power = exp2(F8::splat(y)).to_array()[5];
            assert!((power / y.exp2() - 1.0).abs() < 2e-4, "2^{y}: {power}");
        }
    }
}
