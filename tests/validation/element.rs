//! The element through the body's own forces: homogeneous strain, a bar, a cantilever, rigid motion.

use std::sync::Arc;

use softvt::{
    geometry::{
        Mat3, Pose, Vec3,
        shape::Shape,
        voxel::{VoxelSpec, voxel_mesh},
    },
    physics::fem::{ElasticMaterial, FemModel, FemState},
};

use crate::support::GRAVITY;

const YOUNGS: f64 = 3e4;
const POISSON: f64 = 0.4;

fn block(size: Vec3, resolution: usize, youngs_pa: f64, poisson: f64) -> FemState {
    let mesh = voxel_mesh(&Shape::cuboid(size), &VoxelSpec { resolution }).expect("a block");
    let material = ElasticMaterial::new(youngs_pa, poisson, 300.0).expect("valid");
    FemState::new(FemModel::new(mesh, material, size.product(), Vec::new()), &Pose::identity())
}

/// Puts every node at `place(rest)` and evaluates the forces.
fn deform(body: &mut FemState, place: impl Fn(&Vec3) -> Vec3) {
    let rest = body.model.clone();
    body.x.iter_mut().zip(&rest.mesh.nodes).for_each(|(x, p)| *x = place(p));
    body.update_elastic(0.0);
}

/// Homogeneous strain of 4³ voxels with a displacement gradient of up to 0.2 %: largest force on an inner node over the
/// largest on the boundary, and the relative error of the energy against `V (μ |ε|² + λ/2 tr²ε)`, ε = √(FᵀF) − I.
pub fn patch() -> (f64, f64) {
    let mut body = block(Vec3::repeat(0.05), 4, YOUNGS, POISSON);
    #[rustfmt::skip]
    let gradient = Mat3::new(
        1e-3, 2e-3, -1e-3,
        0.5e-3, -2e-3, 1e-3,
        1e-3, 0.0, 1.5e-3,
    );
    let f = Mat3::identity() + gradient;
    deform(&mut body, |p| f * p);
    let inner = |p: &Vec3| p.amax() < 0.025 - 1e-9;
    let largest = |inside: bool| {
        let nodes = body.model.mesh.nodes.iter().zip(&body.force);
        nodes.filter(|(p, _)| inner(p) == inside).map(|(_, f)| f.norm()).fold(0.0, f64::max)
    };
    let eigen = (f.transpose() * f).symmetric_eigen();
    let strain = eigen.eigenvalues.map(|l| l.sqrt() - 1.0);
    let material = body.model.material;
    let (lambda, mu) = (material.lame_lambda(), material.shear_modulus());
    let exact = 0.05f64.powi(3) * (mu * strain.norm_squared() + 0.5 * lambda * strain.sum().powi(2));
    (largest(true) / largest(false), body.elastic_energy / exact - 1.0)
}

/// A bar of `n` voxels across, stretched by 1 % and thinned by ν: recovered Young's modulus, Pa, from the end force,
/// and the largest side force over the largest end force, which is zero exactly if the bar's own ν is the given one.
pub fn bar(n: usize) -> (f64, f64) {
    let (length, side, strain) = (0.1, 0.02, 0.01);
    let mut body = block(Vec3::new(length, side, side), 5 * n, YOUNGS, POISSON);
    let thin = 1.0 - POISSON * strain;
    deform(&mut body, |p| p.component_mul(&Vec3::new(1.0 + strain, thin, thin)));
    let at_end = |p: &Vec3| p.x > 0.5 * length - 1e-9;
    let nodes = || body.model.mesh.nodes.iter().zip(&body.force);
    let pull: f64 = nodes().filter(|(p, _)| at_end(p)).map(|(_, f)| -f.x).sum();
    let largest = nodes().map(|(_, f)| f.x.abs()).fold(0.0, f64::max);
    let across = nodes().map(|(_, f)| f.yz().norm()).fold(0.0, f64::max);
    (pull / (side * side * strain), across / largest)
}

/// Tip deflection over Timoshenko's of a beam 100 × 20 × 20 mm under its own weight with `n` voxels across.
///
/// Timoshenko, *Phil. Mag.* 41 (1921), with Cowper's shear coefficient (*J. Appl. Mech.* 33, 1966).
pub fn cantilever(n: usize, poisson: f64) -> f64 {
    let (length, side, youngs, density) = (0.1, 0.02, 3e5, 300.0);
    let body = block(Vec3::new(length, side, side), 5 * n, youngs, poisson);
    let clamped = |p: &Vec3| p.x < -0.5 * length + 1e-9;
    let nodes = body.model.mesh.nodes.clone();
    let free: Arc<[bool]> = nodes.iter().map(|p| !clamped(p)).collect();
    let load: Vec<Vec3> = body.model.mass.iter().map(|m| Vec3::z() * (-GRAVITY * m)).collect();
    let u = solve_linear(body, &free, &load);
    let (sum, count) = nodes
        .iter()
        .zip(&u)
        .filter(|(p, _)| p.x > 0.5 * length - 1e-9)
        .fold((0.0, 0), |(sum, count), (_, u)| (sum - u.z, count + 1));
    let (area, inertia) = (side * side, side.powi(4) / 12.0);
    let q = density * GRAVITY * area;
    let kappa = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson);
    let shear = kappa * area * youngs / (2.0 * (1.0 + poisson));
    let exact = q * length.powi(4) / (8.0 * youngs * inertia) + q * length * length / (2.0 * shear);
    sum / f64::from(count) / exact
}

/// Small displacements under `load` with the nodes that are not `free` held: conjugate gradients, the stiffness taken
/// as the central difference of the body's forces at rest.
fn solve_linear(mut body: FemState, free: &[bool], load: &[Vec3]) -> Vec<Vec3> {
    let masked = |v: Vec<Vec3>| -> Vec<Vec3> {
        v.into_iter().zip(free).map(|(v, free)| if *free { v } else { Vec3::zeros() }).collect()
    };
    let rest = body.model.clone();
    let mut stiffness = |v: &[Vec3]| {
        let scale = 1e-6 * rest.mesh.edge / v.iter().map(|v| v.amax()).fold(f64::MIN_POSITIVE, f64::max);
        let mut side = |sign: f64| {
            let moved = rest.mesh.nodes.iter().zip(v).map(|(p, v)| p + v * (sign * scale));
            body.x.iter_mut().zip(moved).for_each(|(x, p)| *x = p);
            body.update_elastic(0.0);
            body.force.clone()
        };
        let (up, down) = (side(1.0), side(-1.0));
        masked(up.iter().zip(&down).map(|(u, d)| (d - u) / (2.0 * scale)).collect())
    };
    let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    let mut u = vec![Vec3::zeros(); load.len()];
    let mut r = masked(load.to_vec());
    let mut p = r.clone();
    let (mut rr, start) = (dot(&r, &r), dot(&r, &r));
    while rr > 1e-14 * start {
        let kp = stiffness(&p);
        let step = rr / dot(&p, &kp);
        u.iter_mut().zip(&p).for_each(|(u, p)| *u += p * step);
        r.iter_mut().zip(&kp).for_each(|(r, k)| *r -= k * step);
        let next = dot(&r, &r);
        p.iter_mut().zip(&r).for_each(|(p, r)| *p = r + *p * (next / rr));
        rr = next;
    }
    u
}

/// Largest node force of a sphere of resolution 6, with partly filled voxels, moved rigidly by `angle` rad about a skew
/// axis, over E h².
pub fn rigid_motion(angle: f64) -> f64 {
    let mesh = voxel_mesh(&Shape::Sphere { radius: 0.025 }, &VoxelSpec { resolution: 6 }).expect("a sphere");
    let scale = YOUNGS * mesh.edge * mesh.edge;
    let material = ElasticMaterial::new(YOUNGS, POISSON, 300.0).expect("valid");
    let mut body = FemState::new(FemModel::new(mesh, material, 6.5e-5, Vec::new()), &Pose::identity());
    let axis = nalgebra::Unit::new_normalize(Vec3::new(1.0, 2.0, -0.5));
    let turn = nalgebra::Rotation3::from_axis_angle(&axis, angle);
    deform(&mut body, |p| turn * p + Vec3::new(0.4, -0.2, 0.3));
    body.force.iter().map(|f| f.norm()).fold(0.0, f64::max) / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::rows;

    #[test]
    fn homogeneous_strain_leaves_inner_nodes_at_rest_and_stores_the_exact_energy() {
        let (inner, energy) = patch();
        assert!(inner < 1e-9 && energy.abs() < 1e-9, "inner {inner:e}, energy {energy:e}");
    }

    #[test]
    fn a_bar_gives_back_its_modulus_and_ratio() {
        for n in [2, 4] {
            let (youngs, across) = bar(n);
            assert!((youngs / YOUNGS - 1.0).abs() < 1e-9 && across < 1e-9, "E {youngs}, across {across:e}");
        }
    }

    #[test]
    fn a_cantilever_converges_to_timoshenko_and_equals_the_reference_at_each_refinement() {
        let reference = rows("elements");
        for poisson in [0.0, 0.3] {
            let mut last = 1.0;
            for n in [2_u32, 4, 8] {
                let row = reference
                    .iter()
                    .filter(|r| r.text("test") == "cantilever")
                    .find(|r| r.number("nu") == poisson && r.number("n_across") == f64::from(n))
                    .expect("a reference row");
                let ratio = cantilever(n as usize, poisson);
                assert!((ratio / row.number("ratio") - 1.0).abs() < 1e-4, "ν {poisson}, n {n}: {ratio}");
                assert!((ratio - 1.0).abs() < last, "ν {poisson}, n {n}: {ratio} is no nearer to 1");
                last = (ratio - 1.0).abs();
            }
            // A clamp that forbids the Poisson contraction stiffens the root; only ν = 0 is Timoshenko's beam exactly.
            assert!(last < if poisson == 0.0 { 0.005 } else { 0.02 }, "ν {poisson}: off by {last}");
        }
    }

    #[test]
    fn rigid_motion_gives_no_force_up_to_half_a_turn() {
        for angle in [0.3, 1.0, 2.5, std::f64::consts::PI] {
            let force = rigid_motion(angle);
            assert!(force < 1e-11, "at {angle} rad: {force:e}");
        }
    }
}
