//! Gel field against an independent axisymmetric finite-element solution of the same layer, and against its invariants.
//!
//! The reference is a sphere of 4 mm on a flat layer (4 mm, ν 0.475, μ 0.145 MPa). Depth and outward displacement of
//! the sphere are checked in `tests/validation/gel.rs`.

use super::{
    Gel, GelField, GelScratch, PadWrench, SkinMesh, SubstrateCompliance, TactileContact, TactileContactError,
};
use softvt_geometry::Vec3;
use softvt_physics::{
    ColliderId,
    world::{ContactPatch, PatchPoint},
};
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

/// Field of one skin pressed by `wrench`, with shear in proportion to the pressure.
pub(in super::super) fn pressed(gel: &Gel, skin: &TestSkin, wrench: PadWrench) -> GelField {
    let contact = TactileContact { wrench, skins: &[skin.mesh()], points: &[], substrate: None };
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

#[test]
fn the_tractions_integrate_to_the_solvers_wrench() {
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
        assert!(field.pressure.iter().all(|&p| p >= 0.0), "{wrench:?}");
        let taxels = field.taxels(&gel, [12, 10]);
        assert!((taxels.normal_force() - normal).abs() < 1e-9 * normal);
    }
}

#[test]
fn the_shear_is_distributed_as_that_of_the_solvers_points() {
    // All points press alike; those on the right are sheared, as if they stuck and the others slipped.
    let gel = gel(PadSurface::default());
    let skin = graph(8e-3, 2e-4, |_, _| 0.0);
    let point = |x: f64, shear: f64| PatchPoint {
        partner: ColliderId::new(0).into(),
        face: None,
        p_p: Vec3::new(x, 0.0, 0.0),
        area: 1e-6,
        gap: 0.0,
        normal_p: Vec3::z(),
        pressure: 1e6,
        shear_p: Vec3::new(-shear, 0.0, 0.0),
        mu: 1.5,
        is_slipping: false,
    };
    let points: Vec<PatchPoint> =
        (-5..=5).map(|k| point(1e-3 * f64::from(k), if k > 0 { 5e5 } else { 0.0 })).collect();
    let patch = ContactPatch { collider: ColliderId::new(0), points };
    let contact = TactileContact {
        wrench: PadWrench::from_patch(&patch),
        points: &patch.points,
        skins: &[skin.mesh()],
        substrate: None,
    };
    let field = GelField::solve(&gel, &contact, &mut GelScratch::default()).expect("good").expect("a force");
    let share = |x: f64| {
        let cells = (0..field.pressure.len()).filter(|&c| field.pressure[c] > 0.0);
        let near = cells.filter(|&c| gel.centre(c).y.abs() < 5e-4 && (gel.centre(c).x - x).abs() < 3e-4);
        let (shear, pressure) =
            near.fold((0.0, 0.0), |sum, c| (sum.0 + field.shear[0][c], sum.1 + field.pressure[c]));
        shear / pressure
    };
    assert!(share(3e-3) - share(-3e-3) > 0.4, "{} and {}", share(3e-3), share(-3e-3));
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
        points: &[],
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
    let run = |wrench| {
        let contact = TactileContact { wrench, points: &[], skins: &[], substrate: None };
        GelField::solve(&gel, &contact, &mut GelScratch::default())
    };
    assert!(run(PadWrench::default()).expect("no force").is_none());
    let pressed = PadWrench::new(1.0, [0.0; 2], 0.0, [0.0; 2]);
    let error = run(pressed).expect_err("no skin");
    assert_eq!(error, TactileContactError::NoSkin { force: 1.0 });
    assert!(run(PadWrench::new(f64::NAN, [0.0; 2], 0.0, [0.0; 2])).is_err());
}
