//! Gel field against an independent axisymmetric finite-element solution of the same layer, and against its invariants.
//!
//! The reference is a sphere of 4 mm on a flat layer (4 mm, ν 0.475, μ 0.145 MPa), and shear and twist of a stuck
//! disc of 1.5 mm. Depth and outward displacement of the sphere are checked in `tests/validation/gel.rs`.

use super::{
    Gel, GelField, GelScratch, PadWrench, SkinMesh, SubstrateCompliance, TactileContact, TactileContactError,
    cubic_taps,
    gel_field::surface_displacement,
    tangential_contact::{TangentialSolution, solve_tangential_contact},
};
use softvt_geometry::Vec3;
use softvt_robot::PadSurface;
use softvt_robot::tactile::{GelSpec, TactileSpec};

/// Vertices and triangles of a skin in the pad frame.
pub(in super::super) struct TestSkin {
    pub(in super::super) vertices: Vec<Vec3>,
    pub(in super::super) triangles: Vec<[u32; 3]>,
}

impl TestSkin {
    pub(in super::super) fn mesh(&self) -> SkinMesh<'_> {
        SkinMesh { vertices: &self.vertices, triangles: &self.triangles }
    }
}

/// Radius of the sphere, m.
const SPHERE: f64 = 4e-3;

fn flat() -> PadSurface {
    PadSurface { radius_x: 1e6, radius_y: 1e6, ..PadSurface::default() }
}

fn gel(pad: PadSurface) -> Gel {
    Gel::new(&TactileSpec::default(), pad).expect("default numbers")
}

/// Graph z = f(x, y), facing the pad, as triangles of edge `step` over a square of half width `half`.
pub(in super::super) fn graph(half: f64, step: f64, f: impl Fn(f64, f64) -> f64) -> TestSkin {
    let n = (2.0 * half / step).ceil() as u32;
    let at = |i: u32| -half + 2.0 * half * f64::from(i) / f64::from(n);
    let vertices = (0..=n).flat_map(|j| (0..=n).map(move |i| (at(i), at(j))));
    let vertices = vertices.map(|(x, y)| Vec3::new(x, y, f(x, y))).collect();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, c, b], [a, d, c]]
        })
        .collect();
    TestSkin { vertices, triangles }
}

fn sphere(at: [f64; 2]) -> TestSkin {
    graph(12e-3, 1e-4, |x, y| {
        let r2 = (x - at[0]).powi(2) + (y - at[1]).powi(2);
        r2 / (2.0 * SPHERE)
    })
}

/// Field of one skin pressed by `wrench`, with friction 1.5.
pub(in super::super) fn pressed(gel: &Gel, skin: &TestSkin, wrench: PadWrench) -> GelField {
    let contact = TactileContact { wrench, skins: &[skin.mesh()], friction: 1.5, substrate: None };
    GelField::solve(gel, &contact, &mut GelScratch::default()).expect("a good contact").expect("a force")
}

#[test]
fn the_surface_bulges_around_a_press_as_in_the_reference() {
    let gel = gel(flat());
    let field = pressed(&gel, &sphere([0.0; 2]), PadWrench::new(0.81625, [0.0; 2], 0.0, [0.0; 2]));
    for (r, u) in
        [(0.0, -0.5e-3), (1e-3, -0.373e-3), (2e-3, -0.084e-3), (3e-3, -0.01244e-3), (5e-3, 0.01029e-3)]
    {
        let found = field.displacement_at(&gel, r, 0.0)[2];
        assert!((found - u).abs() < 0.05 * 0.5e-3, "r {r}: {found:e}, reference {u:e}");
    }
}

/// Stuck disc of radius 1.5 mm under a tangential load, and the tangential displacement at a point.
fn disc(gel: &Gel, load: Vec3) -> (TangentialSolution, impl Fn(f64, f64) -> [f64; 2]) {
    let is_inside = |c: usize| {
        let centre = gel.centre(c);
        centre.x.hypot(centre.y) < 1.5e-3
    };
    let pressure: Vec<f32> =
        (0..gel.columns * gel.rows).map(|c| if is_inside(c) { 1e5 } else { 0.0 }).collect();
    let mut scratch = GelScratch::default();
    scratch.fit(gel);
    let solution = solve_tangential_contact(gel, &pressure, &load, 1e6, &mut scratch);
    let zeros = vec![0.0; pressure.len()];
    let u = surface_displacement(gel, &zeros, &solution.traction, &mut scratch);
    let (columns, rows, cell) = (gel.columns, gel.rows, gel.cell);
    let at = move |x: f64, y: f64| {
        let tx = cubic_taps(x / cell + 0.5 * (columns - 1) as f64);
        let ty = cubic_taps(y / cell + 0.5 * (rows - 1) as f64);
        [0, 1].map(|d| {
            let row = |b: usize| {
                let from = (ty.first + b as isize) as usize * columns + tx.first as usize;
                (0..4).map(|a| tx.weights[a] * f64::from(u[d][from + a])).sum::<f64>()
            };
            (0..4).map(|b| ty.weights[b] * row(b)).sum()
        })
    };
    (solution, at)
}

fn fine() -> Gel {
    let mut spec = TactileSpec::default();
    spec.gel.cell = 1e-4;
    Gel::new(&spec, flat()).expect("good numbers")
}

#[test]
fn a_sheared_disc_moves_its_surroundings_as_in_the_reference() {
    let gel = fine();
    let (solution, u) = disc(&gel, Vec3::new(1.3513814, 0.0, 0.0));
    assert!((solution.motion.x / 1e-3 - 1.0).abs() < 0.02, "stiffness: moved {:e}", solution.motion.x);
    for (r, along, across) in
        [(2e-3, 0.585012, 0.34868), (4e-3, 0.225487, 0.059259), (6e-3, 0.123558, 0.013237)]
    {
        assert!((u(r, 0.0)[0] / 1e-3 - along).abs() < 0.03, "along, r {r}: {:e}", u(r, 0.0)[0]);
        assert!((u(0.0, r)[0] / 1e-3 - across).abs() < 0.03, "across, r {r}: {:e}", u(0.0, r)[0]);
    }
}

#[test]
fn a_twisted_disc_moves_its_surroundings_as_in_the_reference_and_antisymmetrically() {
    let gel = fine();
    let (solution, u) = disc(&gel, Vec3::new(0.0, 0.0, 2.6354775e-3));
    assert!((solution.motion.angle - 1.0).abs() < 0.02, "stiffness: turned {}", solution.motion.angle);
    for (r, turn) in [(2e-3, 0.444175), (3e-3, 0.16291), (4e-3, 0.080892), (6e-3, 0.026719)] {
        let found = u(r, 0.0)[1] / 1e-3;
        assert!((found - turn).abs() < 0.05 * 1.5, "r {r}: {found}, reference {turn}");
        let opposite = u(-r, 0.0)[1] / 1e-3;
        assert!((found + opposite).abs() < 1e-4, "r {r}: {found} and {opposite}");
    }
}

#[test]
fn the_tractions_integrate_to_the_solvers_wrench_within_friction() {
    let gel = gel(PadSurface::default());
    let ridges = graph(12e-3, 2e-4, |x, y| 3e-4 * (1.0 - (x * 2000.0).cos()) + 0.01 * x + y * y / 0.2);
    for (normal, shear, twist) in
        [(2.0, [0.0, 0.0], 0.0), (0.3, [0.3, -0.2], 4e-4), (12.0, [-3.0, 8.0], -2e-2)]
    {
        let wrench = PadWrench::new(normal, shear, twist, [0.0; 2]);
        let field = pressed(&gel, &ridges, wrench);
        let found = field.wrench(&gel);
        assert!((found.force - wrench.force).norm() < 1e-9 * normal, "{found:?} {wrench:?}");
        assert!((found.moment.z - wrench.moment.z).abs() < 1e-12, "{found:?} {wrench:?}");
        for c in 0..field.pressure.len() {
            let size = field.shear[0][c].hypot(field.shear[1][c]);
            let bound = 1.5 * field.friction_excess * field.pressure[c];
            assert!(field.pressure[c] >= 0.0 && size <= 1.06 * bound + 1.0, "cell {c}: {size} {bound}");
        }
        let taxels = field.taxels(&gel, [12, 10]);
        assert!((taxels.normal_force() - normal).abs() < 1e-9 * normal);
    }
}

#[test]
fn a_load_within_friction_is_held_and_one_beyond_it_slips() {
    let gel = gel(PadSurface::default());
    let skin = graph(3e-3, 2e-4, |_, _| 0.0);
    let skins = [skin.mesh()];
    let field = |shear: f64, friction: f64| {
        let wrench = PadWrench::new(2.0, [-shear, 0.0], 0.0, [0.0; 2]);
        let contact = TactileContact { wrench, skins: &skins, friction, substrate: None };
        GelField::solve(&gel, &contact, &mut GelScratch::default()).expect("a good contact").expect("a force")
    };
    let slips = |field: &GelField, mu: f64| {
        let cells = (0..field.pressure.len()).filter(|&c| field.pressure[c] > 0.0);
        let (all, at_bound) = cells.fold((0, 0), |(all, at_bound), c| {
            let size = field.shear[0][c].hypot(field.shear[1][c]);
            (all + 1, at_bound + i32::from(size > 0.99 * mu * field.pressure[c]))
        });
        f64::from(at_bound) / f64::from(all)
    };
    // 3.5 N of shear under 2 N: a rough body (μ 2) holds it, the pad's own 1.5 would not.
    let (rough, pad) = (field(3.5, 2.0), field(3.5, 1.5));
    assert!(rough.friction_excess == 1.0 && pad.friction_excess > 1.1, "{}", pad.friction_excess);
    // 2.3 N: both hold, but on the smoother one more of the rim slips, and the body moves farther.
    let (rough, pad) = (field(2.3, 2.0), field(2.3, 1.5));
    assert_eq!([rough.friction_excess, pad.friction_excess], [1.0, 1.0]);
    let (few, many) = (slips(&rough, 2.0), slips(&pad, 1.5));
    assert!(many > few + 0.05 && pad.stick_motion.x < rough.stick_motion.x, "{few} {many}");
    // Without friction there is no shear to hold.
    let smooth = field(0.0, 0.0);
    assert!(smooth.friction_excess == 1.0 && smooth.shear[0].iter().all(|&t| t.abs() < 1e-6));
}

#[test]
fn ridges_stand_out_in_the_touched_surface() {
    let gel = gel(PadSurface::default());
    let ridges = graph(12e-3, 1e-4, |x, _| 2e-4 * (1.0 - (x * std::f64::consts::TAU / 3e-3).cos()));
    let field = pressed(&gel, &ridges, PadWrench::new(3.0, [0.0; 2], 0.0, [0.0; 2]));
    let (crest, valley) =
        (field.displacement_at(&gel, 0.0, 0.0)[2], field.displacement_at(&gel, 1.5e-3, 0.0)[2]);
    assert!(valley - crest > 5e-5, "crest {crest:e}, valley {valley:e}");
}

#[test]
fn the_field_does_not_depend_on_earlier_uses_of_the_scratch() {
    let gel = gel(PadSurface::default());
    let skin = sphere([1e-3, -5e-4]);
    let skins = [skin.mesh()];
    let contact = |f, substrate| TactileContact {
        wrench: PadWrench::new(f, [0.1 * f, 0.0], 0.0, [0.0; 2]),
        skins: &skins,
        friction: 1.5,
        substrate,
    };
    let body = Some(SubstrateCompliance { modulus: 1e5, resolved: 8e-3 });
    let solve = |gel: &Gel, contact: &TactileContact, scratch: &mut GelScratch| {
        let field = GelField::solve(gel, contact, scratch).expect("good").expect("touch");
        (field.pressure, field.displacement)
    };
    let soft =
        TactileSpec { gel: GelSpec { shear_modulus: 5e4, ..GelSpec::default() }, ..TactileSpec::default() };
    let soft = Gel::new(&soft, PadSurface::default()).expect("good numbers");
    let mut used = GelScratch::default();
    for (gel, f, substrate) in [(&gel, 3.0, None), (&gel, 1.0, None), (&gel, 1.0, body), (&soft, 1.0, body)] {
        let contact = contact(f, substrate);
        assert_eq!(solve(gel, &contact, &mut used), solve(gel, &contact, &mut GelScratch::default()));
    }
}

#[test]
fn bad_contacts_are_named_and_no_force_is_no_contact() {
    let gel = gel(PadSurface::default());
    let run = |wrench, friction| {
        let contact = TactileContact { wrench, skins: &[], friction, substrate: None };
        GelField::solve(&gel, &contact, &mut GelScratch::default())
    };
    assert!(run(PadWrench::default(), 1.5).expect("no force").is_none());
    let pressed = PadWrench::new(1.0, [0.0; 2], 0.0, [0.0; 2]);
    let error = run(pressed, 1.5).expect_err("no skin");
    assert_eq!(error, TactileContactError::NoSkin { force: 1.0 });
    assert!(run(PadWrench::new(f64::NAN, [0.0; 2], 0.0, [0.0; 2]), 1.5).is_err());
    let message = run(pressed, -0.1).expect_err("no friction").to_string();
    assert_eq!(message, "the pad's friction is -0.1; expected a finite number of at least 0");
}
