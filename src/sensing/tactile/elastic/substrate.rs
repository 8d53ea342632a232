//! Compliance of a soft body that presses on the gel.

/// Compliance of a soft body in waves too short for its finite elements: an elastic half space for waves shorter than
/// `resolved`. Longer waves are in the deformed surface already. (Johnson, *Contact Mechanics*, 1985, §4.2.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubstrateCompliance {
    /// Plane-strain modulus E/(1 − ν²) of the body, Pa.
    pub modulus: f64,
    /// Shortest wavelength that the body's mesh resolves, m.
    pub resolved: f64,
}

impl SubstrateCompliance {
    /// Adds the body's compliance, in series, to the spectrum of a gel's compliance, which is divided by the `size` of
    /// the transform; `wave_numbers` are by entry, 1/m.
    pub(super) fn add_to(&self, compliance: &mut [f32], wave_numbers: &[f32], size: usize) {
        let resolved_k = std::f64::consts::TAU / self.resolved;
        for (total, &k) in compliance.iter_mut().zip(wave_numbers) {
            let k = f64::from(k).max(1e-3);
            let unresolved = 1.0 - (-(k / resolved_k).powi(2)).exp();
            *total += (2.0 * unresolved / (self.modulus * k) / size as f64) as f32;
        }
    }
}
