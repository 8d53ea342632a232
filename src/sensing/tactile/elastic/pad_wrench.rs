//! Force and pressure on a pad as the solver computes them: ground truth for the images, and for evaluation.

use softvt_geometry::Vec3;
use softvt_physics::world::ContactPatch;
use softvt_robot::PadSurface;

/// Force on a gel and its moment about the apex, pad frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PadWrench {
    /// Force on the gel, N; z is negative when a body presses.
    pub force: Vec3,
    /// Moment on the gel about the apex, N m.
    pub moment: Vec3,
}

impl PadWrench {
    /// Wrench of a normal force and a shear force (N) at (x, y) (m) on the apex plane, and a twist about the normal
    /// there (N m). A positive `normal` presses.
    pub fn new(normal: f64, shear: [f64; 2], twist: f64, at: [f64; 2]) -> Self {
        let force = Vec3::new(shear[0], shear[1], -normal);
        let arm = Vec3::new(at[0], at[1], 0.0);
        Self { force, moment: arm.cross(&force) + Vec3::new(0.0, 0.0, twist) }
    }

    /// Sum of the forces on the gel at the points of a contact patch.
    pub fn from_patch(patch: &ContactPatch) -> Self {
        patch.points.iter().fold(Self::default(), |sum, point| {
            sum.plus(&point.p_p, -(point.normal_p * point.pressure + point.shear_p) * point.area)
        })
    }

    /// This wrench and a further force at a point.
    pub(super) fn plus(self, p_p: &Vec3, force: Vec3) -> Self {
        Self { force: self.force + force, moment: self.moment + p_p.cross(&force) }
    }

    /// Pressing force, N; positive when pressed.
    pub fn normal(&self) -> f64 {
        -self.force.z
    }
}

/// Pressure and shear on a grid of taxels over the pad: row by row from −y to +y, each row from −x to +x.
#[derive(Clone, Debug, PartialEq)]
pub struct Taxels {
    /// Number of taxels along x and y.
    pub shape: [usize; 2],
    /// Edge lengths of a taxel along x and y, m.
    pub size: [f64; 2],
    /// Pressure on the gel, Pa.
    pub pressure: Vec<f64>,
    /// Shear on the gel along x and y, Pa.
    pub shear: Vec<[f64; 2]>,
}

impl Taxels {
    /// Taxels over `pad` without a contact; at least one along each axis.
    pub fn empty(pad: &PadSurface, shape: [usize; 2]) -> Self {
        let shape = shape.map(|n| n.max(1));
        let size = [pad.length / shape[0] as f64, pad.width / shape[1] as f64];
        let count = shape[0] * shape[1];
        Self { shape, size, pressure: vec![0.0; count], shear: vec![[0.0; 2]; count] }
    }

    /// Taxels of the points of a contact patch, each distributed bilinearly over the four taxels around it.
    pub fn from_patch(patch: &ContactPatch, pad: &PadSurface, shape: [usize; 2]) -> Self {
        let mut taxels = Self::empty(pad, shape);
        for point in &patch.points {
            let shear = [-point.shear_p.x, -point.shear_p.y];
            taxels.add([point.p_p.x, point.p_p.y], point.area, point.pressure, shear);
        }
        taxels
    }

    /// Normal force: pressure integrated over the pad, N.
    pub fn normal_force(&self) -> f64 {
        self.pressure.iter().sum::<f64>() * self.size[0] * self.size[1]
    }

    /// Distributes pressure and shear (Pa) on an `area` (m²) at a point over the four taxels around it.
    pub(super) fn add(&mut self, at: [f64; 2], area: f64, pressure: f64, shear: [f64; 2]) {
        let share = area / (self.size[0] * self.size[1]);
        let [x, y] = [0, 1].map(|a| {
            let last = (self.shape[a] - 1) as f64;
            (at[a] / self.size[a] + 0.5 * last).clamp(0.0, last)
        });
        for (i, wx) in [(x.floor(), 1.0 - x.fract()), (x.ceil(), x.fract())] {
            for (j, wy) in [(y.floor(), 1.0 - y.fract()), (y.ceil(), y.fract())] {
                let taxel = j as usize * self.shape[0] + i as usize;
                let weight = share * wx * wy;
                self.pressure[taxel] += weight * pressure;
                self.shear[taxel] = [0, 1].map(|a| self.shear[taxel][a] + weight * shear[a]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_physics::{
        ColliderId, SoftId,
        world::{PatchPoint, SampleSupport},
    };

    /// Two samples on a flat pad: 20 kPa on 1 mm² at x = 2 mm, 40 kPa on 1 mm² at y = −3 mm; friction drags the body
    /// along +x with 5 kPa at the first.
    fn patch() -> (ContactPatch, PadSurface) {
        let point = |x: f64, y: f64, pressure: f64, shear: f64| PatchPoint {
            partner: SoftId::new(0).into(),
            face: Some(SampleSupport { group: 0, weights: [0.125; 8] }),
            p_p: Vec3::new(x, y, 0.0),
            area: 1e-6,
            gap: 0.0,
            normal_p: Vec3::z(),
            pressure,
            shear_p: Vec3::new(shear, 0.0, 0.0),
            mu: 1.5,
            is_slipping: false,
        };
        let points = vec![point(2e-3, 0.0, 2e4, 5e3), point(0.0, -3e-3, 4e4, 0.0)];
        let flat = PadSurface { radius_x: 1e9, radius_y: 1e9, ..PadSurface::default() };
        (ContactPatch { collider: ColliderId::new(0), points }, flat)
    }

    #[test]
    fn the_wrench_on_the_gel_is_the_reaction_to_that_on_the_body() {
        let (patch, _) = patch();
        let wrench = PadWrench::from_patch(&patch);
        assert!((wrench.force - Vec3::new(-5e-3, 0.0, -0.06)).norm() < 1e-9, "{wrench:?}");
        // r × f: (2 mm, 0) × (−5 mN, 0, −20 mN) and (0, −3 mm) × (0, 0, −40 mN).
        assert!((wrench.moment - Vec3::new(1.2e-4, 4e-5, 0.0)).norm() < 1e-11, "{wrench:?}");
        assert!((wrench.normal() - 0.06).abs() < 1e-9);
    }

    #[test]
    fn taxels_preserve_the_sum_and_the_centre_of_a_patch() {
        let (patch, pad) = patch();
        let taxels = Taxels::from_patch(&patch, &pad, [25, 20]);
        assert!((taxels.normal_force() - 0.06).abs() < 1e-12);
        let area = taxels.size[0] * taxels.size[1];
        let x = |t: usize| (t as f64 - 12.0) * taxels.size[0];
        let moment: f64 = taxels.pressure.iter().enumerate().map(|(t, p)| p * area * x(t % 25)).sum();
        assert!((moment - 2e-3 * 0.02).abs() < 1e-9, "{moment}");
        let shear: f64 = taxels.shear.iter().map(|s| s[0] * area).sum();
        assert!((shear + 5e-3).abs() < 1e-12, "{shear}");
    }
}
