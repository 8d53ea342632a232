//! The senses: the gel under a ball, and pictures against the pinhole.

use crate::{
    camera, gel,
    page::{Report, header, heading, percent},
};

pub fn gel_under_a_ball(report: &mut Report) {
    heading(
        "Gel",
        "A rigid ball of 4 mm pressed on the gel's flat layer (4 mm, μ 0.145 MPa, ν 0.475) on the default grid of 0.4 mm, at four \
         offsets from it, against an independent axisymmetric finite-element solution: depth for the force, and the largest \
         outward motion of the surface.",
    );
    header("force N | depth mm, reference | found |  | outward µm, reference | found | ");
    let gel = gel::flat_gel();
    let (mut shallow, mut deep, mut outwards) = (Vec::new(), Vec::new(), Vec::new());
    for of in gel::PRESSES {
        let depths = gel::OFFSETS.map(|at| gel::press(&gel, at, of.force).approach);
        let (least, most) = depths.iter().fold((f64::MAX, f64::MIN), |(a, b), &d| (a.min(d), b.max(d)));
        let errors = [least, most].map(|d| d / of.depth - 1.0);
        let worst = if errors[0].abs() > errors[1].abs() { errors[0] } else { errors[1] };
        let peak = gel::outward_peak(&gel, &gel::press(&gel, [0.0; 2], of.force));
        if of.depth < 2e-4 {
            shallow.push(worst)
        } else {
            deep.push(worst)
        }
        outwards.push(peak / of.outward - 1.0);
        let ([least_mm, most_mm], [outward_um, peak_um]) =
            ([least, most].map(|d| 1e3 * d), [of.outward, peak].map(|x| 1e6 * x));
        let depth = format!("{} | {least_mm:.4} to {most_mm:.4} | {}", 1e3 * of.depth, percent(worst));
        let outward = percent(peak / of.outward - 1.0);
        row!("{} | {depth} | {outward_um:.2} | {peak_um:.2} | {outward}", of.force);
    }
    report.claim("gel: depth for the force at 0.1 mm", shallow, gel::depth_bound(1e-4));
    report.claim("gel: depth for the force beyond", deep, gel::depth_bound(1e-3));
    report.claim("gel: outward motion", outwards, 0.10);
}

pub fn cameras(report: &mut Report) {
    heading("Camera", "Pictures of 224 × 224 pixels against the pinhole in closed form.");
    let ([radius, centre], corners, depth) = (camera::silhouette(), camera::corners(), camera::depth());
    println!(
        "Ball of 0.2 m at 1 m: radius of its silhouette off by {radius:.3} px, its centre by {centre:.3} px."
    );
    let worst = corners.iter().copied().fold(0.0, f64::max);
    println!("Checkerboard of 0.1 m at 1 m: corners off by {worst:.3} px at most.");
    println!("A plane that passes behind the camera: depth up to 1 m off by {:.4} mm at most.", 1e3 * depth);
    report.claim("camera: silhouette, px", [radius, centre], 0.1);
    report.claim("camera: corners of a checkerboard, px", corners, 0.1);
    report.claim("camera: depth, m", [depth], 1e-4);
}
