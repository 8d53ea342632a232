//! Noise from integer hashes, so that its bytes are the same on every machine.

/// Hashes three words to three words (`pcg3d` of Jarzynski & Olano, Hash Functions for GPU Rendering, JCGT 9(3), 2020).
fn pcg3d(mut v: [u32; 3]) -> [u32; 3] {
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

/// Returns three pseudo-random numbers in 0..1 for a cell of the integer lattice.
pub(crate) fn cell_random(cell: [i32; 3], seed: u32) -> [f32; 3] {
    let word = |i: usize, salt: u32| (cell[i] as u32).wrapping_add(seed.wrapping_mul(salt));
    let words = pcg3d([word(0, 0x9E37_79B9), word(1, 0x85EB_CA6B), word(2, 0xC2B2_AE35)]);
    words.map(|w| (w >> 8) as f32 * (1.0 / 16_777_216.0))
}

/// Value noise with features of unit size, 0..=1, mean 0.5: lattice values blended by quintics
/// (Perlin, Improving Noise, 2002).
fn value_noise(p: [f32; 3], seed: u32) -> f32 {
    let cell = p.map(|x| x.floor() as i32);
    let f: [f32; 3] = std::array::from_fn(|i| p[i] - cell[i] as f32);
    let s = f.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let corner = |c: usize| {
        let lattice = std::array::from_fn(|axis| cell[axis].wrapping_add((c >> axis & 1) as i32));
        cell_random(lattice, seed)[0]
    };
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let along_x: [f32; 4] = std::array::from_fn(|i| lerp(corner(2 * i), corner(2 * i + 1), s[0]));
    lerp(lerp(along_x[0], along_x[1], s[1]), lerp(along_x[2], along_x[3], s[1]), s[2])
}

/// Sums octaves of value noise, each half the size and weight of the previous one, 0..=1.
///
/// Octaves finer than `filter_width` (in units of the coarsest feature) fade to their mean, which prevents aliasing.
pub(crate) fn fractal_noise(p: [f32; 3], octaves: u32, filter_width: f32, seed: u32) -> f32 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for octave in 0..octaves {
        let scale = (1_u32 << octave) as f32;
        let weight = 1.0 / scale;
        let fade = (2.0 - 2.0 * filter_width * scale).clamp(0.0, 1.0);
        let noise =
            if fade > 0.0 { value_noise(p.map(|x| x * scale), seed.wrapping_add(octave)) - 0.5 } else { 0.0 };
        sum += weight * fade * noise;
        weights += weight;
    }
    // A sum of independent octaves varies less than one of them; the factor restores about the same spread.
    (0.5 + 1.5 * sum / weights).clamp(0.0, 1.0)
}
