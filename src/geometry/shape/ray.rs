//! Ray casts by sphere tracing (Hart 1996, "Sphere tracing").

use super::{Shape, Vec3};

/// A step never exceeds this share of the distance: composite distances may be a little too large.
const SAFETY: f64 = 0.8;
/// A point this near is on the surface, m.
const HIT: f64 = 1e-7;

impl Shape {
    /// Distance along the unit vector `direction_o` from `origin_o` to the first surface point, if within `max` m.
    /// A ray that starts inside hits at 0.
    pub fn ray(&self, origin_o: &Vec3, direction_o: &Vec3, max: f64) -> Option<f64> {
        if let Self::Mesh(solid) = self {
            return solid.ray(origin_o, direction_o, max);
        }
        let mut travelled = 0.0;
        for _ in 0..512 {
            let distance = self.distance(&(origin_o + direction_o * travelled));
            if distance < HIT {
                return Some(travelled);
            }
            travelled += distance * SAFETY;
            if travelled > max {
                return None;
            }
        }
        None
    }
}
