use softvt::geometry::{
    Pose, Vec3,
    samples::{SampleSpec, surface_samples},
    shape::Shape,
    voxelise::{VoxelSpec, voxel_mesh},
};
use softvt::physics::{
    Params, World,
    contact::*,
    fem::{Material, Rest},
};
use std::sync::Arc;

fn smooth(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (-15.0 + 6.0 * s))
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let get = |k: &str, d: f64| args.iter().position(|a| a == k).map_or(d, |i| args[i + 1].parse().unwrap());
    let gaps: Vec<f64> = args
        .iter()
        .position(|a| a == "--gap")
        .map_or(vec![42.0], |i| args[i + 1].split(',').map(|x| x.parse().unwrap()).collect());
    let res = get("--res", 6.0) as usize;
    let mu = get("--mu", 1.2);
    let dt = get("--dt", 1.0 / 60.0);
    let e = get("--e", 3e4);
    let spacing = get("--spacing", 0.75e-3);
    for gap in gaps {
        let shape = Shape::Box { half: Vec3::repeat(0.025) };
        let mesh = voxel_mesh(&shape, &VoxelSpec { resolution: res }).unwrap();
        let samples =
            surface_samples(&shape, &mesh, &SampleSpec { grasp_spacing: spacing, other_spacing: 2e-3 });
        let rest = Rest::new(mesh, Material { youngs_pa: e, poisson: 0.4, density: 300.0 }, 1.25e-4, samples);
        let mut world = World::new(
            Params { beta: 2e-3, sleeping: args.iter().any(|a| a == "--sleep"), dt, ..Params::default() },
            Vec3::new(0.0, 0.0, -9.81),
        );
        let fr = Friction { static_mu: mu, dynamic_mu: mu };
        let nothing = Friction { static_mu: 0.0, dynamic_mu: 0.0 };
        let body = world.add_soft("cube", rest.clone(), None, &Pose::translation(0.0, 0.0, 0.025), nothing);
        let layer = world.rigid_layer();
        let table = Shape::Box { half: Vec3::new(0.5, 0.5, 0.05) };
        world.add_collider(Collider::new(
            "table",
            (Mover::Static, Pose::translation(0.0, 0.0, -0.05)),
            Arc::new(table),
            fr,
            layer,
        ));
        let pad = Shape::Box { half: Vec3::new(0.005, 0.011, 0.011) };
        let mut k = vec![];
        let mut c = vec![];
        for side in [-1.0, 1.0] {
            let kin = world.add_kinematic(Pose::translation(side * (0.027 + 0.005), 0.0, 0.025));
            c.push(world.add_collider(Collider::new(
                "pad",
                (Mover::Kinematic(kin), Pose::identity()),
                Arc::new(pad.clone()),
                fr,
                layer,
            )));
            k.push((kin, side));
        }
        let (x0, x1) = (0.027, gap * 0.5e-3);
        let tc = (x0 - x1) / 0.04;
        let t_lift = 0.1 + tc + 0.25;
        let t_hold = t_lift + 1.0;
        let t_end = t_hold + 0.5;
        let start = std::time::Instant::now();
        let mut marks = vec![];
        let (mut newton, mut nmax, mut refills) = (0, 0, 0);
        let mut phase = 0;
        let mut failed = None;
        let mut fg = 0.0;
        while world.time() < t_end - 1e-9 {
            let t = world.time() + dt;
            let x = x0 - 0.04 * (t - 0.1).clamp(0.0, tc);
            let z = 0.1 * smooth(t - t_lift);
            for &(kin, side) in &k {
                world.move_kinematic(kin, Pose::translation(side * (x + 0.005), 0.0, 0.025 + z));
            }
            if let Err(e) = world.step() {
                failed = Some(e);
                break;
            }
            newton += world.stats.newton;
            nmax = nmax.max(world.stats.newton_max);
            if t < t_lift {
                fg = world.touch(body, c[0]).normal_force;
            }
            let p = if t < t_lift {
                0
            } else if t < t_hold {
                1
            } else {
                2
            };
            if p != phase {
                marks.push(start.elapsed().as_secs_f64());
                phase = p;
            }
            if args.iter().any(|a| a == "-v") {
                let tt = world.touch(body, c[0]);
                println!(
                    "{t:.3} newton {} F {:.4} n {} slip {} travel {:.4}mm z {:.3}mm det {:.3}",
                    world.stats.newton,
                    tt.normal_force,
                    tt.samples,
                    tt.slipping,
                    tt.travel * 1e3,
                    1e3 * (world.soft[0].body.centre().z - 0.025),
                    world.soft[0].min_det_f.0
                );
            }
        }
        let total = start.elapsed().as_secs_f64();
        let b = &world.soft[0].body;
        let t = world.touch(body, c[0]);
        refills += world.soft[0].refills();
        println!(
            "gap {gap} {failed:?} F_grip {fg:.4} F_hold {:.4} rise {:.3} mm detF {:.3} newton {newton} max {nmax} steps {} refills {refills} cpu/sim {:.4} phases {:?} n {} travel {:.4}",
            t.normal_force,
            1e3 * (b.centre().z - 0.025),
            world.soft[0].min_det_f.0,
            world.step,
            total / world.time(),
            marks,
            t.samples,
            1e3 * t.travel
        );
    }
}
