//! Force and pressure as the solver knows them: the truth behind the pictures, for evaluators.

use super::{field::GelField, gel::Gel};
use crate::{geometry::Vec3, physics::world::ContactPatch, robot::PadSurface};

/// Force and moment on a gel about the apex, pad frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PadLoad {
    /// Force on the gel, N; a pressing body makes z negative.
    pub force: Vec3,
    /// Moment on the gel about the apex, N m.
    pub moment: Vec3,
}

impl PadLoad {
    /// A load of a normal force and a shear force (N) at (x, y) (m), and a twist about the normal there (N m).
    pub fn new(normal: f64, shear: [f64; 2], twist: f64, at: [f64; 2]) -> Self {
        let force = Vec3::new(shear[0], shear[1], -normal);
        let arm = Vec3::new(at[0], at[1], 0.0);
        Self { force, moment: arm.cross(&force) + Vec3::new(0.0, 0.0, twist) }
    }

    /// What the points of a pad's patch do to its gel.
    pub fn of_patch(patch: &ContactPatch) -> Self {
        patch.points.iter().fold(Self::default(), |sum, point| {
            let force = -(point.normal_p * point.pressure + point.shear_p) * point.area;
            Self { force: sum.force + force, moment: sum.moment + point.p_p.cross(&force) }
        })
    }

    /// Coefficient of friction that holds a patch: the mean over its points by their force; `None` without a force. It is
    /// that of the pair of pad and body (the larger of both), static or, while they slide, dynamic.
    pub fn friction_of(patch: &ContactPatch) -> Option<f64> {
        let sum = patch.points.iter().fold([0.0; 2], |[bound, force], point| {
            let normal = point.pressure * point.area;
            [bound + point.mu * normal, force + normal]
        });
        (sum[1] > 0.0).then(|| sum[0] / sum[1])
    }

    /// The sum of the tractions of a field, taken at the apex plane.
    pub fn of_field(gel: &Gel, field: &GelField) -> Self {
        let area = gel.cell * gel.cell;
        field.pressure.iter().enumerate().filter(|(_, p)| **p > 0.0).fold(Self::default(), |sum, (c, &p)| {
            let [x, y] = gel.centre(c);
            let force = Vec3::new(field.shear[0][c], field.shear[1][c], -p) * area;
            let moment = Vec3::new(x, y, 0.0).cross(&force);
            Self { force: sum.force + force, moment: sum.moment + moment }
        })
    }

    /// The pressing force, N; positive when pressed.
    pub fn normal(&self) -> f64 {
        -self.force.z
    }
}

/// Pressure and shear on a grid of taxels over the pad, rows from −y, each from −x.
#[derive(Clone, Debug, PartialEq)]
pub struct Taxels {
    /// Taxels along x and y.
    pub shape: [usize; 2],
    /// Edges of a taxel along x and y, m.
    pub size: [f64; 2],
    /// Pressure on the gel, Pa.
    pub pressure: Vec<f64>,
    /// Shear on the gel along x and y, Pa.
    pub shear: Vec<[f64; 2]>,
}

impl Taxels {
    /// `shape` taxels over `pad`, untouched; at least one along each axis.
    pub fn over(pad: &PadSurface, shape: [usize; 2]) -> Self {
        let shape = shape.map(|n| n.max(1));
        let size = [pad.length / shape[0] as f64, pad.width / shape[1] as f64];
        let count = shape[0] * shape[1];
        Self { shape, size, pressure: vec![0.0; count], shear: vec![[0.0; 2]; count] }
    }

    /// The solver's samples, each shared among the four taxels around it.
    pub fn of_patch(patch: &ContactPatch, pad: &PadSurface, shape: [usize; 2]) -> Self {
        let mut taxels = Self::over(pad, shape);
        for point in &patch.points {
            let shear = [-point.shear_p.x, -point.shear_p.y];
            taxels.add([point.p_p.x, point.p_p.y], point.area, point.pressure, shear);
        }
        taxels
    }

    /// The field's cells, each shared among the four taxels around it.
    pub fn of_field(gel: &Gel, field: &GelField, shape: [usize; 2]) -> Self {
        let mut taxels = Self::over(&gel.pad, shape);
        for (c, &p) in field.pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            taxels.add(gel.centre(c), gel.cell * gel.cell, p, [field.shear[0][c], field.shear[1][c]]);
        }
        taxels
    }

    /// Sum of the pressure, N.
    pub fn normal_force(&self) -> f64 {
        self.pressure.iter().sum::<f64>() * self.size[0] * self.size[1]
    }

    fn add(&mut self, at: [f64; 2], area: f64, pressure: f64, shear: [f64; 2]) {
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
    use crate::physics::{
        ColliderId, SoftId,
        world::{PatchPoint, SampleFace},
    };

    /// Two samples on a flat pad: 20 kPa on 1 mm² at x = 2 mm, 40 kPa on 1 mm² at y = −3 mm; friction drags the body
    /// along +x with 5 kPa at the first.
    fn patch() -> (ContactPatch, PadSurface) {
        let point = |x: f64, y: f64, pressure: f64, shear: f64| PatchPoint {
            partner: SoftId::new(0).into(),
            face: Some(SampleFace { group: 0, weights: [0.125; 8] }),
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
    fn a_patch_loads_the_gel_against_what_it_does_to_the_body() {
        let (patch, _) = patch();
        let load = PadLoad::of_patch(&patch);
        assert!((load.force - Vec3::new(-5e-3, 0.0, -0.06)).norm() < 1e-9, "{load:?}");
        // r × f: (2 mm, 0) × (−5 mN, 0, −20 mN) and (0, −3 mm) × (0, 0, −40 mN).
        assert!((load.moment - Vec3::new(1.2e-4, 4e-5, 0.0)).norm() < 1e-11, "{load:?}");
        assert!((load.normal() - 0.06).abs() < 1e-9);
    }

    #[test]
    fn bodies_of_different_friction_hold_a_patch_by_their_forces() {
        let (mut patch, _) = patch();
        patch.points[0].mu = 0.3;
        // 20 mN at 0.3 and 40 mN at 1.5.
        let mean = PadLoad::friction_of(&patch).expect("a force");
        assert!((mean - 1.1).abs() < 1e-12, "{mean}");
        patch.points.clear();
        assert_eq!(PadLoad::friction_of(&patch), None);
    }

    #[test]
    fn taxels_keep_the_sum_and_the_place_of_a_patch() {
        let (patch, pad) = patch();
        let taxels = Taxels::of_patch(&patch, &pad, [25, 20]);
        assert!((taxels.normal_force() - 0.06).abs() < 1e-12);
        let area = taxels.size[0] * taxels.size[1];
        let x = |t: usize| (t as f64 - 12.0) * taxels.size[0];
        let moment: f64 = taxels.pressure.iter().enumerate().map(|(t, p)| p * area * x(t % 25)).sum();
        assert!((moment - 2e-3 * 0.02).abs() < 1e-9, "{moment}");
        let shear: f64 = taxels.shear.iter().map(|s| s[0] * area).sum();
        assert!((shear + 5e-3).abs() < 1e-12, "{shear}");
    }
}
