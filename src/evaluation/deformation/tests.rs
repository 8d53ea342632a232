use proptest::prelude::*;

use super::*;

/// A grid of n³ nodes over a cube of 60 mm, and the volumes of its nodes in voxels (a corner node has an eighth).
fn cube(n: usize) -> (Vec<Vec3>, Vec<f64>) {
    let (edge, last) = (0.06 / (n - 1) as f64, n - 1);
    let end = |i: usize| if i == 0 || i == last { 0.5 } else { 1.0 };
    let cells = (0..n * n * n).map(|i| [i % n, i / n % n, i / n / n]);
    let nodes = cells.clone().map(|c| Vec3::new(c[0] as f64, c[1] as f64, c[2] as f64) * edge).collect();
    (nodes, cells.map(|c| end(c[0]) * end(c[1]) * end(c[2])).collect())
}

fn reference() -> (ReferenceShape, Vec<Vec3>) {
    let (nodes, weights) = cube(7);
    (ReferenceShape::new(&nodes, &weights).unwrap(), nodes)
}

fn map(nodes: &[Vec3], f: impl Fn(&Vec3) -> Vec3) -> Vec<Vec3> {
    nodes.iter().map(f).collect()
}

/// Squeezed by ε along x, flowing out by (1 − ε)^−ν across.
fn squeezed(nodes: &[Vec3], eps: f64) -> Vec<Vec3> {
    let out = (1.0 - eps).powf(-0.4);
    map(nodes, |x| Vec3::new(x.x * (1.0 - eps), x.y * out, x.z * out))
}

#[test]
fn rigid_motion_is_not_a_deformation_also_at_half_a_turn() {
    let (reference, nodes) = reference();
    for axis in [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, -2.0, 3.0)] {
        for degrees in [0.0_f64, 1e-6, 90.0, 179.999_999, 180.0, 270.0] {
            let turn = Quat::from_axis_angle(&nalgebra::Unit::new_normalize(axis), degrees.to_radians());
            let moved = map(&nodes, |x| turn * x + Vec3::new(0.7, -0.3, 1.1));
            let d = reference.measure(&moved).unwrap();
            assert!(d.rms_pct < 1e-11 && d.v1_rms_pct < 1e-11 && d.max_pct < 1e-11, "{axis} {degrees} {d:?}");
            assert!(d.rotation.angle_to(&turn) < 1e-7, "{axis} {degrees}");
        }
    }
}

#[test]
fn a_deformation_does_not_depend_on_how_the_object_lies() {
    let (nodes, weights) = cube(7);
    for degrees in [0.0_f64, 10.0, 45.0, 90.0] {
        let turn = Quat::from_axis_angle(&Vec3::z_axis(), degrees.to_radians());
        let [lying, now] = [&nodes, &squeezed(&nodes, 0.1)].map(|x| map(x, |x| turn * x));
        let reference = ReferenceShape {
            diagonal_m: 0.06 * 3.0_f64.sqrt(),
            ..ReferenceShape::new(&lying, &weights).unwrap()
        };
        assert!((reference.measure(&now).unwrap().rms_pct - 2.0).abs() < 0.051, "{degrees}");
    }
}

#[test]
fn a_mirrored_body_is_deformed() {
    // Two different legs, so that no rotation undoes the mirror.
    let nodes = [Vec3::zeros(), Vec3::x() * 0.06, Vec3::y() * 0.03, Vec3::z() * 0.02];
    let reference = ReferenceShape::new(&nodes, &[1.0; 4]).unwrap();
    let d = reference.measure(&map(&nodes, |x| Vec3::new(x.x, x.y, -x.z))).unwrap();
    assert!(d.rms_pct > 1.0, "{d:?}");
    assert!((d.rotation.to_rotation_matrix().into_inner().determinant() - 1.0).abs() < 1e-12);
}

#[test]
fn published_values_of_a_7_cube_are_met() {
    let (reference, nodes) = reference();
    for (eps, uniform, volume) in [(0.1, 2.3, 2.0), (0.3, 7.1, 6.3), (0.5, 13.0, 11.5), (0.8, 29.0, 25.8)] {
        let d = reference.measure(&squeezed(&nodes, eps)).unwrap();
        assert!((d.v1_rms_pct - uniform).abs() < 0.051, "{eps}: {}", d.v1_rms_pct);
        assert!((d.rms_pct - volume).abs() < 0.051, "{eps}: {}", d.rms_pct);
    }
}

#[test]
fn collapse_to_a_point_has_its_closed_form() {
    let (reference, nodes) = reference();
    let d = reference.measure(&map(&nodes, |_| Vec3::new(0.5, 0.2, 0.1))).unwrap();
    // The variance of i = 0..6 is 4; three axes over a diagonal of 6√3. With halved ends it is 19/6.
    assert!((d.v1_rms_pct - 100.0 * 12.0_f64.sqrt() / 108.0_f64.sqrt()).abs() < 1e-10);
    assert!((d.rms_pct - 100.0 * (3.0 * 19.0 / 6.0_f64).sqrt() / 108.0_f64.sqrt()).abs() < 1e-10);
    assert!((d.v1_rms_pct - 33.3).abs() < 0.05 && (d.rms_pct - 29.7).abs() < 0.05);
    assert!((d.max_pct - 50.0).abs() < 1e-10);
}

#[test]
fn bad_input_is_refused_by_name() {
    let (reference, nodes) = reference();
    let refused = |n: &[Vec3], w: &[f64], words: &str| {
        let error = ReferenceShape::new(n, w).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refused(&nodes[..2], &[1.0; 2], "3 nodes, got 2");
    refused(&nodes[..4], &[1.0; 3], "4 nodes but 3 node weights");
    refused(&nodes[..3], &[1.0, -1.0, 1.0], "node weight 1 is -1");
    refused(&nodes[..3], &[0.0; 3], "node weight 0 is 0");
    refused(&[Vec3::x(); 4], &[1.0; 4], "has no size");
    assert!(reference.measure(&nodes[1..]).unwrap_err().to_string().contains("the measured body 342"));
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut broken = nodes.clone();
        broken[17].y = bad;
        let error = reference.measure(&broken).unwrap_err().to_string();
        assert!(error.starts_with("node 17 is not finite"), "{bad}: {error}");
    }
}

/// Kabsch by singular values, as in the released code: an independent reference.
fn rms_by_svd(rest: &[Vec3], now: &[Vec3]) -> f64 {
    let mean = |x: &[Vec3]| x.iter().sum::<Vec3>() / x.len() as f64;
    let (c, cc) = (mean(now), mean(rest));
    let h: Mat3 = now.iter().zip(rest).map(|(x, y)| (x - c) * (y - cc).transpose()).sum();
    let svd = nalgebra::SVD::new(nalgebra::DMatrix::from_column_slice(3, 3, h.as_slice()), true, true);
    let (u, vt) = (svd.u.unwrap(), svd.v_t.unwrap());
    let mut flip = nalgebra::DMatrix::identity(3, 3);
    let smallest = svd.singular_values.imin();
    flip[(smallest, smallest)] = (&u * &vt).determinant().signum();
    let r = Mat3::from_column_slice((u * flip * vt).as_slice());
    let sum: f64 = now.iter().zip(rest).map(|(x, y)| (x - c - r * (y - cc)).norm_squared()).sum();
    let Aabb { min: low, max: high } = Aabb::from_points(rest).unwrap();
    100.0 * (sum / rest.len() as f64).sqrt() / (high - low).norm()
}

proptest! {
    #[test]
    fn it_is_kabsch_and_invariant_to_rigid_motion(
        offsets in prop::collection::vec(-0.03..0.03_f64, 81),
        axis in prop::array::uniform3(-1.0..1.0_f64),
        angle in -3.2..3.2_f64,
        shift in prop::array::uniform3(-2.0..2.0_f64),
        mirrored in any::<bool>(),
    ) {
        let (rest, weights) = cube(3);
        let reference = ReferenceShape::new(&rest, &weights).unwrap();
        let noisy: Vec<Vec3> = rest
            .iter()
            .zip(offsets.chunks(3))
            .map(|(x, o)| x + Vec3::new(o[0], o[1], o[2]))
            .map(|x| if mirrored { Vec3::new(x.x, x.y, -x.z) } else { x })
            .collect();
        let turn = Quat::new(Vec3::from(axis) * angle);
        let moved = map(&noisy, |x| turn * x + Vec3::from(shift));
        let (a, b) = (reference.measure(&noisy).unwrap(), reference.measure(&moved).unwrap());
        prop_assert!((a.v1_rms_pct - rms_by_svd(&rest, &noisy)).abs() < 1e-9);
        prop_assert!((a.rms_pct - b.rms_pct).abs() < 1e-9);
        prop_assert!((a.v1_rms_pct - b.v1_rms_pct).abs() < 1e-9);
        prop_assert!(a.rms_pct <= a.max_pct);
    }
}
