//! The senses: the gel under a ball, and pictures against the pinhole.

use crate::{
    camera, gel, pad,
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

pub fn pads(report: &mut Report) {
    heading(
        "Pads",
        "Rigid discs on a flat pad of the solver, against the layer (`tests/reference/layer.py`): stiffness of a frictionless press, and \
         sideways and in a twist where they stick.",
    );
    header(
        "disc mm | steps/s | normal N/mm, layer | solver |  | sideways N/mm, layer | solver |  | twist N m/rad, layer | solver | ",
    );
    let (mut straight, mut twists) = (Vec::new(), Vec::new());
    for of in pad::DISCS {
        for rate in [60.0, 240.0] {
            let found = pad::measured(of.radius, rate);
            let cell = |of: f64, found: f64, unit: f64| {
                format!("{:.4} | {:.4} | {}", of / unit, found / unit, percent(found / of - 1.0))
            };
            straight.extend([found.normal / of.normal - 1.0, found.sideways / of.sideways - 1.0]);
            twists.push(found.twist / of.twist - 1.0);
            row!(
                "{} | {rate} | {} | {} | {}",
                1e3 * of.radius,
                cell(of.normal, found.normal, 1e3),
                cell(of.sideways, found.sideways, 1e3),
                cell(of.twist, found.twist, 1.0)
            );
        }
    }
    println!(
        "\nShare of the motion of these discs that the surface of the gel follows in the tactile sensor, at half of their radius while they \
         stick; the sensor's grid is too soft in twist for discs of few cells.\n"
    );
    header("disc mm | sideways % | twist %");
    let mut missing = Vec::new();
    for of in pad::DISCS {
        let followed = pad::followed(of.radius);
        missing.extend(followed.map(|share| (1.0 - share).max(0.0)));
        row!("{} | {:.0} | {:.0}", 1e3 * of.radius, 100.0 * followed[0], 100.0 * followed[1]);
    }
    println!(
        "\nBalls with the friction of the pads, 1.5, pressed in by 0.5 mm and then moved sideways, so that a ring slips around a middle that sticks. Radius \
         of the middle over that of the contact: of the layer (Cattaneo–Mindlin for a layer: Ciavarella 1998), in the solver, and in the \
         tactile sensor; and the share of the ball's motion that the gel follows in the middle and at the rim.\n"
    );
    header("ball mm | steps/s | shear over the largest | layer | solver |  | sensor |  | middle % | rim %");
    let (mut solver, mut sensor) = (Vec::new(), Vec::new());
    for (radius, rate) in [(0.02, 60.0), (0.02, 240.0), (0.04, 60.0)] {
        for found in pad::partial_slip(radius, rate) {
            let [of, inside, seen] = found.stick;
            let errors = [inside / of - 1.0, seen / of - 1.0];
            solver.push(errors[0]);
            sensor.push(errors[1]);
            let [middle, rim] = found.followed.map(|share| 100.0 * share);
            row!(
                "{} | {rate} | {:.2} | {of:.3} | {inside:.3} | {} | {seen:.3} | {} | {middle:.0} | {rim:.0}",
                1e3 * radius,
                found.load,
                percent(errors[0]),
                percent(errors[1])
            );
        }
    }
    report.claim("pad: stiffness of discs, normal and sideways", straight, 0.10);
    report.claim("pad: stiffness of discs in a twist", twists, 0.10);
    report.claim("gel: part of the motion of a disc that it does not follow", missing, 0.10);
    report.claim("pad: stick radius of a sheared ball", solver, 0.10);
    report.claim("gel: stick radius of a sheared ball", sensor, 0.10);
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
