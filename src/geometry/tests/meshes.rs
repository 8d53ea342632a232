use std::f64::consts::PI;

use super::{composite_shapes, euler, exact_shapes, lathe, random_unit, rng};
use crate::{
    Mat3, Pose, Quat, Vec3, hex8,
    mass::{MassProperties, mass_properties},
    samples::{SampleSpec, surface_samples},
    shape::{Axis, Shape},
    surface_mesh::SurfaceMesh,
    voxel::VoxelMesh,
    voxel::{VoxelMeshError, VoxelSpec, voxel_mesh},
};

fn voxelized(shape: &Shape, resolution: usize) -> VoxelMesh {
    voxel_mesh(shape, &VoxelSpec { resolution }).expect("a voxel mesh")
}

fn filled_volume(mesh: &VoxelMesh) -> f64 {
    mesh.occupancy.iter().map(|fill| fill.fraction()).sum::<f64>() * mesh.edge.powi(3)
}

#[test]
fn a_cube_at_resolution_six_has_343_nodes_and_full_voxels() {
    let mesh = voxelized(&Shape::cuboid(Vec3::repeat(0.056)), 6);
    assert_eq!((mesh.nodes.len(), mesh.elements.len(), mesh.grid), (343, 216, [6; 3]));
    assert!(mesh.occupancy.iter().all(|fill| fill.fraction() == 1.0));
    assert!((mesh.nodes[0] - Vec3::repeat(-0.028)).norm() < 1e-15);
    assert!((mesh.nodes[342] - Vec3::repeat(0.028)).norm() < 1e-15);
    for nodes in &mesh.elements {
        let corner = mesh.nodes[nodes[0] as usize];
        for (c, &node) in nodes.iter().enumerate() {
            let step = hex8::corner(c);
            assert!((mesh.nodes[node as usize] - corner - step * mesh.edge).norm() < 1e-15);
        }
    }
}

#[test]
fn a_lying_box_gets_whole_voxels_on_its_longest_edge_and_is_covered() {
    let mesh = voxelized(&Shape::cuboid(Vec3::new(0.120, 0.044, 0.038)), 6);
    assert_eq!(mesh.grid, [6, 3, 2]);
    assert!((mesh.edge - 0.02).abs() < 1e-15);
    // A face that cuts the sub-cells moves by up to half of one.
    let off = 0.5 * mesh.edge / 6.0;
    let bound = (1.0 + 2.0 * off / 0.044) * (1.0 + 2.0 * off / 0.038);
    let ratio = filled_volume(&mesh) / (0.120 * 0.044 * 0.038);
    assert!(ratio < bound && ratio > 1.0 / bound, "{ratio}");
}

#[test]
fn filled_volume_converges_to_the_volume() {
    let ball = Shape::Sphere { radius: 0.0285 };
    let exact = 4.0 / 3.0 * PI * 0.0285_f64.powi(3);
    let error = |resolution| (filled_volume(&voxelized(&ball, resolution)) / exact - 1.0).abs();
    assert!(error(6) < 5e-3 && error(18) < 5e-4, "{} {}", error(6), error(18));
}

#[test]
fn empty_and_invalid_shapes_have_no_voxel_mesh() {
    let ball = Shape::Sphere { radius: 0.01 };
    let nothing = ball.clone().subtract(Shape::Sphere { radius: 0.02 });
    let refused =
        |shape: &Shape, resolution| voxel_mesh(shape, &VoxelSpec { resolution }).expect_err("refused");
    assert_eq!(refused(&nothing, 6), VoxelMeshError::Empty);
    assert_eq!(refused(&ball, 0), VoxelMeshError::Resolution(0));
    assert!(matches!(refused(&Shape::Sphere { radius: f64::NAN }, 6), VoxelMeshError::Shape(_)));
}

#[test]
fn material_points_return_to_their_rest_position() {
    for (name, shape) in exact_shapes().into_iter().chain(composite_shapes()) {
        let mesh = voxelized(&shape, 6);
        let surface = SurfaceMesh::from_shape(&shape, 2e-3);
        for (vertex, at) in surface.mesh.vertices.iter().zip(surface.embed(&mesh).expect("near voxels")) {
            assert!((mesh.rest_position(&at) - vertex).norm() < 1e-12, "{name}: {vertex:?} {at:?}");
        }
    }
}

#[test]
fn surface_meshes_are_watertight_with_the_right_genus() {
    for (name, shape) in exact_shapes().into_iter().chain(composite_shapes()) {
        for cell in [1e-3, 1.7e-3] {
            let surface = SurfaceMesh::from_shape(&shape, cell);
            let mesh = &surface.mesh;
            assert_eq!(mesh.validate_closed(), Ok(()), "{name} at {cell}");
            assert!(mesh.volume() > 0.0, "{name}");
            let surfaces_less_holes = match name {
                "torus" | "box less box" => 0,
                "shell" => 4,
                _ => 2,
            };
            assert_eq!(euler(mesh), surfaces_less_holes, "{name} at {cell}");
            assert_eq!(
                (surface.normals.len(), surface.materials.len()),
                (mesh.vertices.len(), mesh.triangles.len())
            );
            let off = mesh.vertices.iter().map(|v| shape.distance(v).abs()).fold(0.0, f64::max);
            assert!(off < 0.15 * cell, "{name}: a vertex {off} m off the surface");
            let seamless = mesh.uvs.iter().all(|t| {
                let u = t.map(|uv| uv[0]);
                let at_a_pole = t.iter().any(|uv| !(0.05..0.95).contains(&uv[1]));
                at_a_pole || (0..3).all(|i| (u[i] - u[(i + 1) % 3]).abs() <= 0.5)
            });
            assert!(seamless && mesh.uvs.len() == mesh.triangles.len(), "{name}");
        }
    }
}

#[test]
fn surface_meshes_keep_sharp_edges() {
    let size = Vec3::new(0.05, 0.04, 0.03);
    let mesh = SurfaceMesh::from_shape(&Shape::cuboid(size), 1e-3).mesh;
    assert!((mesh.volume() / size.product() - 1.0).abs() < 1e-5, "{}", mesh.volume());
    let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    assert!((mesh.area() / area - 1.0).abs() < 1e-4, "{}", mesh.area() / area);
}

/// Checks area, spacing, embedding and closedness of a surface sampling.
fn check_samples(name: &str, shape: &Shape, exact_area: f64, tolerance: f64) {
    let mesh = voxelized(shape, 6);
    let spec = SampleSpec::default();
    let samples = surface_samples(shape, &mesh, &spec);
    let area: f64 = samples.iter().map(|s| s.area).sum();
    assert!((area / exact_area - 1.0).abs() < tolerance, "{name}: area {area} for {exact_area}");
    let vector: Vec3 = samples.iter().map(|s| s.n_o * s.area).sum();
    assert!(vector.norm() < 3e-3 * area, "{name}: {vector:?} is not closed");
    for (steep, spacing) in [(true, spec.grasp_spacing), (false, spec.other_spacing)] {
        let chosen: Vec<f64> =
            samples.iter().filter(|s| (s.n_o.z.abs() <= 0.7) == steep).map(|s| s.area).collect();
        let mean = (chosen.iter().sum::<f64>() / chosen.len().max(1) as f64).sqrt();
        assert!(mean <= spacing * (1.0 + 1e-9), "{name}: {mean} m apart where {spacing} is wanted");
    }
    for sample in &samples {
        assert!((sample.at.element as usize) < mesh.elements.len());
        assert!((mesh.rest_position(&sample.at) - sample.p_o).norm() < 1e-12, "{name}");
        assert!((sample.n_o.norm() - 1.0).abs() < 1e-9 && sample.area > 0.0);
    }
    assert!(samples.is_sorted_by_key(|sample| sample.at.element), "{name}");
}

#[test]
fn samples_sum_to_the_exact_area() {
    let (r, h) = (0.022, 0.017);
    check_samples("box", &Shape::cuboid(Vec3::repeat(0.056)), 6.0 * 0.056 * 0.056, 1e-12);
    check_samples("sphere", &Shape::Sphere { radius: r }, 4.0 * PI * r * r, 1e-12);
    let capsule = Shape::Capsule { radius: r, half_length: h };
    check_samples("capsule", &capsule, 4.0 * PI * r * (r + h), 1e-12);
    let lying = capsule.rotated(Quat::from_axis_angle(&Vec3::y_axis(), PI / 2.0));
    check_samples("lying capsule", &lying, 4.0 * PI * r * (r + h), 1e-12);
    let can = Shape::Cylinder { radius: r, half_height: h };
    check_samples("cylinder", &can, 2.0 * PI * r * (r + 2.0 * h), 1e-12);
    check_samples("torus", &Shape::Torus { major: 0.03, minor: 0.01 }, 4.0 * PI * PI * 0.03 * 0.01, 1e-12);
    // Side 30, 40, 50 mm, 20 mm deep.
    let prism = Shape::prism(vec![[0.0, 0.0], [0.03, 0.0], [0.0, 0.04]], 0.02).expect("a triangle");
    check_samples("prism", &prism, 0.03 * 0.04 + 0.12 * 0.02, 1e-9);
    let cone = lathe(vec![[0.0, 0.0], [0.03, 0.0], [0.0, 0.04]]);
    check_samples("cone", &cone, PI * 0.03 * (0.03 + 0.05), 1e-12);
}

#[test]
fn samples_of_composites_sum_to_the_area_of_a_fine_mesh() {
    for (name, shape) in composite_shapes() {
        check_samples(name, &shape, SurfaceMesh::from_shape(&shape, 0.5e-3).mesh.area(), 5e-3);
    }
}

#[test]
fn samples_of_a_box_are_symmetric() {
    let shape = Shape::cuboid(Vec3::repeat(0.056));
    let samples = surface_samples(&shape, &voxelized(&shape, 6), &SampleSpec::default());
    let moment: Vec3 = samples.iter().map(|s| s.p_o * s.area).sum();
    assert!(moment.norm() < 1e-15);
    let side = samples.iter().filter(|s| s.n_o.x == 1.0).count();
    assert_eq!((side, samples.len()), (75 * 75, 4 * 75 * 75 + 2 * 28 * 28));
}

#[test]
fn mass_properties_match_closed_forms_and_integration() {
    let near = |a: &Mat3, b: &Mat3, tolerance: f64| (a - b).abs().max() <= tolerance * b.abs().max();
    for (name, shape) in exact_shapes() {
        let exact = mass_properties(&shape, 300.0);
        let solid = Shape::from_mesh(SurfaceMesh::from_shape(&shape, 0.8e-3).mesh).expect("a solid");
        let integrated = mass_properties(&solid, 300.0);
        assert!((exact.mass / integrated.mass - 1.0).abs() < 3e-3, "{name}: {exact:?} {integrated:?}");
        assert!((exact.com - integrated.com).norm() < 3e-5, "{name}");
        assert!(near(&exact.inertia, &integrated.inertia, 5e-3), "{name}: {exact:?} {integrated:?}");
    }
    let cone = mass_properties(&lathe(vec![[0.0, 0.0], [0.03, 0.0], [0.0, 0.04]]), 1.0);
    let mass = PI * 0.03 * 0.03 * 0.04 / 3.0;
    assert!((cone.mass / mass - 1.0).abs() < 2e-3 && (cone.com.z - 0.01).abs() < 2e-5, "{cone:?}");
    assert!((cone.inertia[(2, 2)] / (0.3 * mass * 0.03 * 0.03) - 1.0).abs() < 3e-3, "{cone:?}");
}

/// A box that is open at the top, and its mass properties at 1 kg/m³ as the difference of two boxes.
fn tray(size: Vec3, wall: f64) -> (Shape, MassProperties) {
    let space = Vec3::new(size.x - 2.0 * wall, size.y - 2.0 * wall, size.z);
    let shape = Shape::cuboid(size).subtract(Shape::cuboid(space).translated(Vec3::z() * wall));
    let depth = size.z - wall;
    let (outer, removed) = (size.product(), space.x * space.y * depth);
    let mass = outer - removed;
    let com = Vec3::z() * (-removed * 0.5 * wall / mass);
    let about = |mass: f64, size: Vec3, offset: f64| {
        let s = size.component_mul(&size) / 12.0;
        let across = offset * offset;
        Vec3::new(s.y + s.z + across, s.z + s.x + across, s.x + s.y) * mass
    };
    let inertia =
        about(outer, size, com.z) - about(removed, Vec3::new(space.x, space.y, depth), 0.5 * wall - com.z);
    (shape, MassProperties { mass, com, inertia: Mat3::from_diagonal(&inertia) })
}

#[test]
fn thin_walls_have_the_mass_of_closed_forms() {
    let sizes = [([0.3, 0.3, 0.05], 2e-3), ([0.3, 0.3, 0.05], 2.5e-3), ([0.5, 0.5, 0.05], 4e-3)];
    for (size, wall) in sizes.into_iter().chain([([0.22, 0.16, 0.03], 2e-3), ([0.2, 0.2, 0.05], 5e-4)]) {
        let (shape, exact) = tray(Vec3::from(size), wall);
        for (name, turn) in
            [("along the axes", Quat::identity()), ("turned", Quat::from_euler_angles(0.4, 0.5, -0.9))]
        {
            // A difference of turned shapes, whose mass is not that of an upright one that is turned afterwards.
            let pose = Pose::from_parts(Vec3::zeros().into(), turn);
            let speck =
                Shape::cuboid(Vec3::repeat(1e-6)).translated(turn * Vec3::new(0.0, 0.0, -0.5 * size[2]));
            let found = mass_properties(&shape.clone().placed(pose).union(speck), 1.0);
            let label = format!("{size:?}, walls of {wall} m, {name}");
            assert!((found.mass / exact.mass - 1.0).abs() < 5e-3, "{label}: {} {}", found.mass, exact.mass);
            assert!(
                (found.com - turn * exact.com).norm() < 1e-3 * size[0],
                "{label}: {} {}",
                found.com,
                turn * exact.com
            );
            let r = turn.to_rotation_matrix();
            let expected = r * exact.inertia * r.transpose();
            let error = (found.inertia - expected).abs().max() / expected.abs().max();
            assert!(error < 1e-2, "{label}: inertia off by {error}");
        }
    }
}

#[test]
fn shells_pipes_boards_and_partitions_have_the_mass_of_closed_forms() {
    let mass = |shape: &Shape| mass_properties(shape, 1.0).mass;
    let cube = |edge: f64| Shape::cuboid(Vec3::repeat(edge));
    let cylinder = |radius: f64, half_height: f64| Shape::Cylinder { radius, half_height };
    let plate = Shape::cuboid(Vec3::new(0.3, 0.2, 2e-3));
    let block = cube(0.02).translated(Vec3::new(0.1, 0.0, 0.011));
    let partition = Shape::cuboid(Vec3::new(2e-3, 0.29, 0.04));
    let upper = Shape::cuboid(Vec3::repeat(0.3)).translated(Vec3::z() * 0.15);
    let (thick_tray, of_tray) = tray(Vec3::new(0.3, 0.3, 0.05), 5e-3);
    for (name, shape, expected) in [
        ("closed box", cube(0.3).subtract(cube(0.296)), 0.3_f64.powi(3) - 0.296_f64.powi(3)),
        (
            "pipe",
            cylinder(0.05, 0.15).subtract(cylinder(0.048, 0.2)),
            PI * (0.05_f64.powi(2) - 0.048_f64.powi(2)) * 0.3,
        ),
        ("board and block", plate.union(block), 0.3 * 0.2 * 2e-3 + 0.02_f64.powi(3)),
        (
            "half of a hollow ball",
            Shape::Sphere { radius: 0.12 }.subtract(Shape::Sphere { radius: 0.118 }).subtract(upper),
            2.0 / 3.0 * PI * (0.12_f64.powi(3) - 0.118_f64.powi(3)),
        ),
        // Its wall is seen from no side, and its edge from the top only.
        ("partition", thick_tray.union(partition), of_tray.mass + 2e-3 * 0.29 * 0.04),
    ] {
        let found = mass(&shape);
        assert!((found / expected - 1.0).abs() < 5e-3, "{name}: {found} {expected}");
    }
}

#[test]
fn mass_properties_transform_with_the_shape() {
    let turn = Quat::from_euler_angles(0.3, 0.5, -0.9);
    let pose = Pose::from_parts(Vec3::new(0.1, -0.2, 0.3).into(), turn);
    let brick = Shape::cuboid(Vec3::new(0.06, 0.04, 0.02));
    let (plain, moved) = (mass_properties(&brick, 500.0), mass_properties(&brick.placed(pose), 500.0));
    let mut rng = rng();
    for _ in 0..10 {
        let axis = random_unit(&mut rng);
        let there = turn * axis;
        let (a, b) = (axis.dot(&(plain.inertia * axis)), there.dot(&(moved.inertia * there)));
        assert!((a - b).abs() < 1e-15, "{a} {b}");
    }
    assert!((moved.com - Vec3::new(0.1, -0.2, 0.3)).norm() < 1e-15);
}

#[test]
fn twisting_keeps_the_volume_of_a_bar() {
    let bar = Shape::cuboid(Vec3::new(0.08, 0.02, 0.02));
    let twisted = mass_properties(&bar.clone().twisted(Axis::X, 20.0), 1.0).mass;
    assert!((twisted / mass_properties(&bar, 1.0).mass - 1.0).abs() < 3e-3);
}
