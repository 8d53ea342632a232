use rand::Rng;

use super::{composite_shapes, crate_with_low_sides, exact_shapes, lathe, random_unit, rng, wedge};
use crate::{
    Aabb, Vec3,
    mesh::Mesh,
    shape::{Axis, Polygon, Shape, ShapeError},
    surface_mesh::SurfaceMesh,
};

/// Largest relative error of `distance_and_normal` against parry's exact distance to a fine mesh (beyond the 40 µm that
/// the chords of the mesh may be off), over points up to 5 mm from the surface, and where it occurs.
fn largest_distance_error(shape: &Shape) -> (f64, Vec3) {
    let surface = SurfaceMesh::from_shape(shape, 0.8e-3);
    let truth = Shape::from_mesh(exact_surface(shape).unwrap_or_else(|| surface.mesh.clone()))
        .expect("a closed mesh");
    let mut rng = rng();
    let mut worst = (0.0, Vec3::zeros());
    for _ in 0..1500 {
        let start = surface.mesh.vertices[rng.random_range(0..surface.mesh.vertices.len())];
        let p = start + random_unit(&mut rng) * rng.random_range(0.0..5e-3);
        let (distance, normal) = shape.distance_and_normal(&p);
        assert!((normal.norm() - 1.0).abs() < 1e-9, "normal of {normal:?}");
        let exact = truth.distance(&p);
        let error = ((distance - exact).abs() - 4e-5).max(0.0) / exact.abs().max(1e-4);
        if error > worst.0 {
            worst = (error, p);
        }
    }
    worst
}

/// A revolved polygon with 1000 sectors; the sagitta of the chords is less than 0.5 µm.
fn revolved(corners: &[[f64; 2]]) -> Mesh {
    let sectors = 1000;
    let n = corners.len() as u32;
    let mut mesh = Mesh::default();
    for sector in 0..sectors {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(sector) / f64::from(sectors)).sin_cos();
        mesh.vertices.extend(corners.iter().map(|p| Vec3::new(p[0] * cos, p[0] * sin, p[1])));
        let (here, there) = (sector * n, (sector + 1) % sectors * n);
        for (i, j) in (0..n)
            .map(|i| (i, (i + 1) % n))
            .filter(|(i, j)| corners[*i as usize][0] > 0.0 || corners[*j as usize][0] > 0.0)
        {
            mesh.triangles.extend([[here + i, there + i, there + j], [here + i, there + j, here + j]]);
        }
    }
    mesh
}

/// The surface of a convex polygon (x, z), extruded along y.
fn hull(corners: &[[f64; 2]], half_length: f64) -> Mesh {
    let n = corners.len() as u32;
    let end = |y: f64| corners.iter().map(move |p| Vec3::new(p[0], y, p[1]));
    let mut triangles = Vec::new();
    for (i, j) in (0..n).map(|i| (i, (i + 1) % n)) {
        triangles.extend([[i, n + i, n + j], [i, n + j, j]]);
    }
    for i in 1..n - 1 {
        triangles.extend([[0, i, i + 1], [n, n + i + 1, n + i]]);
    }
    Mesh { vertices: end(-half_length).chain(end(half_length)).collect(), triangles, uvs: vec![] }
}

/// The surface of polyhedra and lathes, computed without distances; a surface mesh may bevel their edges.
fn exact_surface(shape: &Shape) -> Option<Mesh> {
    match shape {
        Shape::Box { half } => {
            let (x, z) = (half.x, half.z);
            Some(hull(&[[-x, -z], [x, -z], [x, z], [-x, z]], half.y))
        }
        Shape::Prism { section, half_length } => Some(hull(section.points(), *half_length)),
        Shape::Lathe(profile) => Some(revolved(profile.points())),
        Shape::Placed { shape, pose } => exact_surface(shape).map(|mut mesh| {
            mesh.vertices.iter_mut().for_each(|v| *v = pose.rotation * *v + pose.translation.vector);
            mesh
        }),
        _ => None,
    }
}

#[test]
fn distances_to_primitives_are_exact() {
    for (name, shape) in exact_shapes() {
        let (error, at) = largest_distance_error(&shape);
        println!("{name}: {:.4} %", 100.0 * error);
        assert!(error < 1e-3, "{name}: {error} at {at:?}");
    }
}

#[test]
fn distances_of_combinations_and_warps_are_within_five_percent() {
    let mut failed = Vec::new();
    let nested = ("crate", crate_with_low_sides());
    for (name, shape) in composite_shapes().into_iter().chain([nested]) {
        let (error, at) = largest_distance_error(&shape);
        println!("{name}: {:.2} % at {:?}", 100.0 * error, at.as_slice());
        if error > 0.05 {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "over 5 %: {failed:?}");
}

#[test]
fn normals_are_gradients_of_the_distance() {
    let mut rng = rng();
    for (name, shape) in exact_shapes().into_iter().chain(composite_shapes()) {
        let fine = SurfaceMesh::from_shape(&shape, 3e-3);
        for vertex in fine.mesh.vertices.iter().step_by(7) {
            let p = vertex + random_unit(&mut rng) * 2e-5;
            let (_, normal) = shape.distance_and_normal(&p);
            let step = 1e-6;
            let gradient = Vec3::from_fn(|axis, _| {
                let e = Vec3::ith(axis, step);
                (shape.distance_and_normal(&(p + e)).0 - shape.distance_and_normal(&(p - e)).0) / (2.0 * step)
            });
            // At an edge of the shape the gradient is undefined.
            let near_edge = [0, 1, 2].iter().any(|&axis| {
                let e = Vec3::ith(axis, 1e-4);
                let turned = |q: Vec3| shape.distance_and_normal(&q).1.dot(&normal) < 0.95;
                turned(p + e) || turned(p - e)
            });
            assert!(
                near_edge || (gradient - normal).norm() < 0.05,
                "{name} at {p:?}: {gradient:?} {normal:?}"
            );
        }
    }
}

#[test]
fn bounds_of_turned_and_composite_shapes_are_tight() {
    for (name, shape) in exact_shapes().into_iter().chain(composite_shapes()) {
        let bounds = shape.bounds();
        let mesh = exact_surface(&shape).unwrap_or_else(|| SurfaceMesh::from_shape(&shape, 0.7e-3).mesh);
        let found = Aabb::from_points(&mesh.vertices).expect("a mesh");
        let off = (bounds.min - found.min).abs().max().max((bounds.max - found.max).abs().max());
        assert!(off < 5e-5, "{name}: {off}");
        let outside = mesh.vertices.iter().map(|v| (v - v.sup(&bounds.min).inf(&bounds.max)).norm());
        let worst = outside.fold(0.0, f64::max);
        assert!(worst < 2e-6, "{name}: {worst}");
    }
}

#[test]
fn bounds_of_a_bent_bar_match_the_arc() {
    // A bar of half length a and half thickness t, bent on radius R, ends at angle a/R.
    let (half, thick, radius) = (0.04, 0.01, 0.08);
    let bar = Shape::cuboid(2.0 * Vec3::new(half, thick, thick)).bent(Axis::X, Axis::Z, 1.0 / radius);
    let bounds = bar.bounds();
    let angle: f64 = half / radius;
    assert!((bounds.max.x - (radius + thick) * angle.sin()).abs() < 2e-6, "{bounds:?}");
    assert!((bounds.min.z + thick).abs() < 2e-6, "{bounds:?}");
    assert!((bounds.max.z - (radius - (radius - thick) * angle.cos())).abs() < 2e-6, "{bounds:?}");
}

#[test]
fn coverage_is_continuous_as_a_sharp_edge_moves() {
    // Samples of a soft face at z = 0.3 mm under the top of a pad that slides along x.
    let pad = Shape::cuboid(Vec3::new(0.022, 0.022, 0.022));
    let spacing = 0.75e-3;
    let facing = -Vec3::z();
    let total = |offset: f64| -> f64 {
        (0..80 * 80)
            .map(|i| {
                let at = |k: i32| (f64::from(k) - 39.5) * spacing;
                let p = Vec3::new(at(i % 80) - offset, at(i / 80), 0.011 - 0.3e-3);
                let contact = pad.contact(&p, &facing, spacing);
                (-contact.gap).max(0.0) * contact.coverage * contact.normal.z * spacing * spacing
            })
            .sum()
    };
    let exact = 0.022 * 0.022 * 0.3e-3;
    for step in 0..20 {
        let volume = total(f64::from(step) * 1e-4);
        assert!((volume / exact - 1.0).abs() < 1e-9, "step {step}: {volume} for {exact}");
    }
}

#[test]
fn a_deep_sample_near_an_edge_contacts_the_face_that_it_faces() {
    let pad = Shape::cuboid(Vec3::new(0.022, 0.022, 0.022));
    let p = Vec3::new(0.011 - 0.5e-3, 0.0, 0.011 - 2e-3);
    let contact = pad.contact(&p, &-Vec3::z(), 0.75e-3);
    assert_eq!((contact.normal, contact.coverage), (Vec3::z(), 1.0));
    assert!((contact.gap + 2e-3).abs() < 1e-12);
    let can = Shape::Cylinder { radius: 0.011, half_height: 0.011 };
    let on_rim = can.contact(&Vec3::new(0.011, 0.0, 0.010), &-Vec3::z(), 0.75e-3);
    assert_eq!((on_rim.normal, on_rim.coverage), (Vec3::z(), 0.5));
}

#[test]
fn flush_parts_fully_cover_a_sample_on_their_seam() {
    let brick = Shape::cuboid(Vec3::new(0.02, 0.02, 0.02));
    let floor = brick
        .clone()
        .translated(Vec3::new(-0.01, 0.0, 0.0))
        .union(brick.translated(Vec3::new(0.01, 0.0, 0.0)));
    let contact = floor.contact(&Vec3::new(0.0, 0.0, 0.0099), &-Vec3::z(), 1e-3);
    assert!((contact.coverage - 1.0).abs() < 1e-12 && (contact.gap + 1e-4).abs() < 1e-12, "{contact:?}");
}

#[test]
fn materials_follow_parts_and_regions() {
    let cream = Shape::Sphere { radius: 0.01 }.painted(1, None).translated(Vec3::new(0.0, 0.0, 0.02));
    let bun = Shape::Sphere { radius: 0.02 }
        .painted(2, Some(Shape::cuboid(Vec3::new(0.1, 0.1, 0.02)).translated(Vec3::new(0.0, 0.0, -0.02))));
    let both = bun.smooth_union(cream, 0.004);
    assert_eq!(both.material(&Vec3::new(0.0, 0.0, 0.03)), 1);
    assert_eq!(both.material(&Vec3::new(0.0, 0.0, -0.02)), 2);
    assert_eq!(both.material(&Vec3::new(0.02, 0.0, 0.0)), 0);
}

#[test]
fn rays_hit_the_surface() {
    let ball = Shape::Sphere { radius: 0.03 }.translated(Vec3::new(0.1, 0.0, 0.0));
    let hit = ball.ray(&Vec3::zeros(), &Vec3::x(), 1.0).expect("a hit");
    assert!((hit - 0.07).abs() < 1e-6, "{hit}");
    assert_eq!(ball.ray(&Vec3::zeros(), &Vec3::y(), 1.0), None);
    assert_eq!(ball.ray(&Vec3::zeros(), &Vec3::x(), 0.05), None);
    let mesh = Shape::from_mesh(SurfaceMesh::from_shape(&ball, 1e-3).mesh).expect("a solid");
    let hit = mesh.ray(&Vec3::zeros(), &Vec3::x(), 1.0).expect("a hit");
    assert!((hit - 0.07).abs() < 2e-5, "{hit}");
}

#[test]
fn errors_name_the_invalid_number_and_a_hint() {
    let message = |shape: &Shape| shape.validate().expect_err("refused").to_string();
    assert_eq!(
        message(&Shape::Sphere { radius: -0.1 }),
        "sphere: radius is -0.1 m; give a finite length above 0"
    );
    assert!(message(&Shape::cuboid(Vec3::new(0.1, f64::NAN, 0.1))).starts_with("box: half extent is NaN m"));
    assert!(message(&Shape::Torus { major: 0.01, minor: 0.02 }).contains("major radius is 0.01"));
    assert!(message(&Shape::Union(vec![])).contains("no parts"));
    assert!(message(&wedge().bent(Axis::X, Axis::X, 1.0)).contains("another axis"));
    assert!(message(&wedge().scaled(Vec3::new(1.0, 0.0, 1.0))).contains("factor is 0"));
    let nested = Shape::Sphere { radius: 0.1 }.subtract(Shape::Sphere { radius: 0.0 }).twisted(Axis::Z, 1.0);
    assert!(message(&nested).starts_with("sphere: radius is 0"));
    let profile = |points: &[[f64; 2]]| Polygon::revolved(points.to_vec()).expect_err("refused");
    assert_eq!(profile(&[[0.0, 0.0], [1.0, 0.0]]), ShapeError::ProfileSize { corners: 2 });
    assert!(matches!(
        profile(&[[0.0, 0.0], [-1.0, 0.0], [0.0, 1.0]]),
        ShapeError::ProfilePoint { index: 1, .. }
    ));
    assert_eq!(profile(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), ShapeError::ProfileArea);
    assert_eq!(profile(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 3.0]]), ShapeError::ProfileCrossing);
    assert!(exact_shapes().into_iter().chain(composite_shapes()).all(|(_, shape)| shape.validate().is_ok()));
}

#[test]
fn polygons_may_be_given_in_either_direction() {
    let corners = vec![[0.0, 0.0], [0.05, 0.0], [0.05, 0.02], [0.0, 0.02]];
    let reversed = corners.iter().rev().copied().collect();
    let p = Vec3::new(0.04, 0.0, 0.019);
    let (distance, normal) = lathe(corners).distance_and_normal(&p);
    assert!((distance + 1e-3).abs() < 1e-12 && (normal - Vec3::z()).norm() < 1e-12);
    assert!((lathe(reversed).distance(&p) + 1e-3).abs() < 1e-12);
}
