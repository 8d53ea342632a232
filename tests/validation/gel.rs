//! The gel under a ball, against an independent axisymmetric finite-element solution of the same layer (flat, 4 mm
//! thick, ν 0.475, μ 0.145 MPa, bonded below; a rigid ball of 4 mm).

use softvt::{
    geometry::Vec3,
    robot::{PadSurface, tactile::TactileSpec},
    sensing::tactile::{Gel, GelField, GelScratch, PadWrench, SkinMesh, TactileContact},
};

/// Radius of the ball, m.
const BALL: f64 = 4e-3;

/// A press of the reference.
#[derive(Clone, Copy)]
pub struct Reference {
    /// Force, N.
    pub force: f64,
    /// Depth, m.
    pub depth: f64,
    /// Largest outward motion of the surface, m.
    pub outward: f64,
}

const fn reference(force: f64, depth: f64, outward: f64) -> Reference {
    Reference { force, depth, outward }
}

/// The reference's presses.
pub const PRESSES: [Reference; 4] = [
    reference(0.056109, 1e-4, 1.827e-6),
    reference(0.250, 2.5e-4, 7.9e-6),
    reference(0.81625, 5e-4, 2.5267e-5),
    reference(2.82, 1e-3, 8.1e-5),
];

/// Offsets of the ball from the middle of the grid, m: on a corner, on a middle and between.
pub const OFFSETS: [[f64; 2]; 4] = [[0.0, 0.0], [2e-4, 2e-4], [1e-4, 0.5e-4], [2e-4, 0.0]];

/// Tolerance of the depth of a ball against the reference.
pub fn depth_bound(depth: f64) -> f64 {
    if depth < 2e-4 { 0.05 } else { 0.10 }
}

/// A pad with a flat surface.
pub const FLAT: PadSurface = PadSurface {
    length: 25.25e-3,
    width: 20.75e-3,
    corner: 1.5e-3,
    thickness: 4e-3,
    radius_x: 1e6,
    radius_y: 1e6,
};

/// A gel with a flat surface on the default grid.
pub fn flat_gel() -> Gel {
    Gel::new(&TactileSpec::default(), FLAT).expect("default numbers")
}

/// Surface of a rigid body in the frame of the pad.
pub struct Skin {
    pub vertices: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Skin {
    /// The surface of this height (m) over a square of 24 mm.
    pub fn graph(height: impl Fn(f64, f64) -> f64) -> Self {
        let (n, half) = (240_u32, 12e-3);
        let along = |i: u32| -half + 2.0 * half * f64::from(i) / f64::from(n);
        let points = (0..=n).flat_map(|j| (0..=n).map(move |i| (along(i), along(j))));
        let corner = |i: u32, j: u32| j * (n + 1) + i;
        let triangles = (0..n * n).flat_map(|c| {
            let (i, j) = (c % n, c / n);
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, c, b], [a, d, c]]
        });
        Self {
            vertices: points.map(|(x, y)| Vec3::new(x, y, height(x, y))).collect(),
            triangles: triangles.collect(),
        }
    }
}

/// The ball pressed by `force` (N) at a place.
pub fn press(gel: &Gel, at: [f64; 2], force: f64) -> GelField {
    let skin = Skin::graph(|x, y| ((x - at[0]).powi(2) + (y - at[1]).powi(2)) / (2.0 * BALL));
    let skins = [SkinMesh { vertices: &skin.vertices, triangles: &skin.triangles }];
    let wrench = PadWrench::new(force, [0.0; 2], 0.0, [0.0; 2]);
    let contact = TactileContact { wrench, points: &[], skins: &skins, substrate: None };
    GelField::solve(gel, &contact, &mut GelScratch::default()).expect("a good contact").expect("a force")
}

/// Mean radial motion of the surface on a circle about the middle, m.
pub fn outward(gel: &Gel, field: &GelField, radius: f64) -> f64 {
    let directions = 16;
    let at = |i: i32| {
        let phi = std::f64::consts::TAU * f64::from(i) / f64::from(directions);
        let u = field.displacement_at(gel, radius * phi.cos(), radius * phi.sin());
        u[0] * phi.cos() + u[1] * phi.sin()
    };
    (0..directions).map(at).sum::<f64>() / f64::from(directions)
}

/// The largest of it, m.
pub fn outward_peak(gel: &Gel, field: &GelField) -> f64 {
    (8..40).map(|i| outward(gel, field, f64::from(i) * 2e-4)).fold(f64::MIN, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pressed_ball_goes_as_deep_as_the_reference_wherever_it_lies_on_the_grid() {
        let gel = flat_gel();
        for at in OFFSETS {
            for Reference { force, depth, .. } in PRESSES {
                let error = press(&gel, at, force).approach / depth - 1.0;
                assert!(error.abs() < depth_bound(depth), "{force} N at {at:?}: {:+.1} %", 100.0 * error);
            }
        }
    }

    #[test]
    fn the_surface_moves_outwards_around_a_press_as_in_the_reference() {
        let gel = flat_gel();
        for Reference { force, outward: peak, .. } in PRESSES {
            let found = outward_peak(&gel, &press(&gel, [0.0; 2], force));
            assert!((found / peak - 1.0).abs() < 0.10, "{force} N: {found:e}, reference {peak:e}");
        }
        let (field, peak) = (press(&gel, [0.0; 2], 0.81625), 2.5267e-5);
        for (r, u) in
            [(2e-3, 1.1979e-5), (3e-3, 2.1946e-5), (4e-3, 2.5176e-5), (6e-3, 2.1524e-5), (8e-3, 1.4997e-5)]
        {
            let found = outward(&gel, &field, r);
            assert!((found - u).abs() < 0.10 * peak, "r {r}: {found:e}, reference {u:e}");
        }
    }
}
