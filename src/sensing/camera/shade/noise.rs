//! Integer-hash noise: the same bytes on every machine.

/// Three hashed words of three words (`pcg3d` of Jarzynski & Olano, Hash Functions for GPU Rendering, JCGT 9(3), 2020).
pub(crate) fn hash(mut v: [u32; 3]) -> [u32; 3] {
    let mix = |v: &mut [u32; 3]| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[2]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
    };
    v = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    v
}

/// Three numbers in 0..1 that belong to a cell of the lattice.
pub(crate) fn of_cell(cell: [i32; 3], seed: u32) -> [f32; 3] {
    let word = |i: usize, salt: u32| (cell[i] as u32).wrapping_add(seed.wrapping_mul(salt));
    let words = hash([word(0, 0x9E37_79B9), word(1, 0x85EB_CA6B), word(2, 0xC2B2_AE35)]);
    words.map(|w| (w >> 8) as f32 * (1.0 / 16_777_216.0))
}

/// Smooth noise of unit feature size, 0..=1, mean 0.5: lattice values blended by quintics (Perlin, Improving Noise, 2002).
pub(crate) fn value(p: [f32; 3], seed: u32) -> f32 {
    let cell = p.map(|x| x.floor() as i32);
    let f: [f32; 3] = std::array::from_fn(|i| p[i] - cell[i] as f32);
    let s = f.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let at = |c: usize| {
        of_cell(std::array::from_fn(|axis| cell[axis].wrapping_add((c >> axis & 1) as i32)), seed)[0]
    };
    let blend = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let along_x: [f32; 4] = std::array::from_fn(|i| blend(at(2 * i), at(2 * i + 1), s[0]));
    blend(blend(along_x[0], along_x[1], s[1]), blend(along_x[2], along_x[3], s[1]), s[2])
}

/// Sum of octaves of [`value`], each half the size and weight of the one before, 0..=1. Octaves finer than `finest`
/// (in units of the coarsest feature) fade into their mean, so that nothing is finer than what is drawn.
pub(crate) fn fractal(p: [f32; 3], octaves: u32, finest: f32, seed: u32) -> f32 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for octave in 0..octaves {
        let scale = (1_u32 << octave) as f32;
        let weight = 1.0 / scale;
        let kept = (2.0 - 2.0 * finest * scale).clamp(0.0, 1.0);
        let noise =
            if kept > 0.0 { value(p.map(|x| x * scale), seed.wrapping_add(octave)) - 0.5 } else { 0.0 };
        sum += weight * kept * noise;
        weights += weight;
    }
    // The sum of independent octaves is narrower than one of them; the factor restores about the same spread.
    (0.5 + 1.5 * sum / weights).clamp(0.0, 1.0)
}
