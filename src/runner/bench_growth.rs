//! Growth of the cost with the nodes of a soft body, with the number of bodies, with threads, and with the pixels of an
//! image.

use std::sync::Arc;

use cpu_time::ThreadTime;

use super::{
    bench_rates::{all_streams, fastest, first_episode, observations_per_s, suite_of, time_episode},
    config::RunConfig,
    error::RunError,
};
use softvt_common::{
    cancel,
    table::{Column, Table},
    text::decimal,
};
use softvt_geometry::{Pose, Vec3, shape::Shape};
use softvt_media::{
    axis::Axis,
    chart::{Chart, ChartPoint, Curve, Layout, Margins, Mark, SINGLE_CURVE},
    drawing::Symbol,
};
use softvt_physics::{KinematicId, PhysicsParams, World, contact::Friction, fem::ElasticMaterial};
use softvt_rollout::{AssetCache, Sensors, Simulation, soft_model};
use softvt_scene::SoftMaterial;
use softvt_script::{EpisodeSetup, LoadedScript, SceneChanges};

/// Voxels along an edge of the squeezed cube.
const RESOLUTIONS: [usize; 5] = [4, 6, 9, 12, 16];
/// Numbers of cubes that are squeezed at the same time.
const COUNTS: [usize; 5] = [1, 2, 4, 8, 16];
/// Voxels along an edge of each of several cubes.
const RESOLUTION: usize = 6;
/// Edges of the images, pixels.
const EDGES: [usize; 6] = [64, 112, 224, 448, 768, 1024];
/// Images of each size, of which the fastest counts.
const IMAGES: usize = 5;

/// Growth of a cost with a size.
#[derive(Clone, Debug)]
pub struct GrowthCurve {
    pub size: &'static str,
    /// The measured quantity, with its unit.
    pub cost: &'static str,
    /// Measurements, by increasing size.
    pub points: Vec<GrowthPoint>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowthPoint {
    pub size: f64,
    pub cost: f64,
}

impl GrowthCurve {
    /// The power of the size with which the cost grows, by its first and last point. `None` for fewer than two.
    pub fn exponent(&self) -> Option<f64> {
        let (first, last) = (self.points.first()?, self.points.last()?);
        (last.size > first.size).then(|| (last.cost / first.cost).ln() / (last.size / first.size).ln())
    }

    /// The cost and its power.
    fn title(&self) -> String {
        let power = self.exponent().map_or_else(String::new, |power| format!(", power {power:.2}"));
        format!("{}{power}", self.cost)
    }
}

/// The curves as text, one row per measurement.
pub fn table(curves: &[GrowthCurve]) -> String {
    let of_curve = |curve: &GrowthCurve| {
        let size = Column::number(curve.size, |point: &GrowthPoint| point.size.to_string());
        let cost = Column::number(curve.title(), |point: &GrowthPoint| decimal(Some(point.cost), 3));
        Table::new(&curve.points, [size, cost]).text()
    };
    curves.iter().map(of_curve).collect::<Vec<_>>().join("\n")
}

/// Measures all curves on this machine; images and threads in the first task of the suite `script`, with up to
/// `threads` episodes at a time. `on_stage` receives the name of each measurement.
///
/// # Errors
/// The suite cannot be loaded or run, a squeeze does not converge, or a request to stop.
pub fn measure(
    script: &str,
    threads: usize,
    mut on_stage: impl FnMut(&str),
) -> Result<Vec<GrowthCurve>, RunError> {
    let loaded = RunConfig::of(script).load()?.script;
    on_stage("nodes");
    let nodes = |&resolution: &usize| {
        let cost = squeeze(1, resolution)?;
        Ok(GrowthPoint { size: (resolution + 1).pow(3) as f64, cost })
    };
    let nodes = RESOLUTIONS.iter().map(nodes).collect::<Result<_, RunError>>()?;
    on_stage("soft bodies");
    let bodies = |&count: &usize| Ok(GrowthPoint { size: count as f64, cost: squeeze(count, RESOLUTION)? });
    let bodies = COUNTS.iter().map(bodies).collect::<Result<_, RunError>>()?;
    on_stage("threads");
    let assets = AssetCache::default();
    time_episode(&loaded, &all_streams(), &assets)?;
    let mut of_threads = Vec::new();
    for count in std::iter::successors(Some(1), |count| Some(2 * count)).take_while(|count| *count <= threads)
    {
        let cost = fastest(|| observations_per_s(&loaded, count, &assets))?;
        of_threads.push(GrowthPoint { size: count as f64, cost });
    }
    on_stage("pixels");
    let pixels = draw(&loaded)?;
    let per_second = "CPU s per simulated s";
    Ok(vec![
        GrowthCurve { size: "nodes", cost: per_second, points: nodes },
        GrowthCurve { size: "soft bodies of 343 nodes", cost: per_second, points: bodies },
        GrowthCurve { size: "threads", cost: "observations per s", points: of_threads },
        GrowthCurve { size: "pixels", cost: "CPU ms per image", points: pixels },
    ])
}

/// CPU time per simulated time of `count` cubes side by side, each squeezed by a fifth between two plates.
fn squeeze(count: usize, resolution: usize) -> Result<f64, RunError> {
    const EDGE: f64 = 0.05;
    const THICKNESS: f64 = 0.01;
    const PITCH: f64 = 0.2;
    const DEPTH: f64 = 0.01;
    const TIME: f64 = 0.5;
    let elastic = ElasticMaterial::new(3e4, 0.4, 300.0).map_err(RunError::input)?;
    let material = SoftMaterial {
        elastic,
        resolution,
        grasp_spacing: 2.5e-3,
        collapse_strain: None,
        damage_strain: None,
    };
    let cube = Shape::Box { half: Vec3::repeat(0.5 * EDGE) };
    let model = soft_model("specimen", &cube, &material).map_err(RunError::input)?;
    let plate = Shape::Box { half: Vec3::new(0.5 * THICKNESS, 0.011, 0.011) };
    let mut world = World::new(PhysicsParams::default(), Vec3::zeros());
    let pose = |side: f64, depth: f64, row: usize| {
        Pose::translation(side * (0.5 * (EDGE + THICKNESS) - depth), PITCH * row as f64, 0.0)
    };
    let mut plates: Vec<(KinematicId, f64, usize)> = Vec::new();
    for row in 0..count {
        let at = Pose::translation(0.0, PITCH * row as f64, 0.0);
        world.add_soft("specimen", model.clone(), None, &at, Friction::default());
        for side in [-1.0, 1.0] {
            let frame = world.add_kinematic(pose(side, 0.0, row));
            world.add_shape("jaw", frame, Pose::identity(), &plate, Friction::default());
            plates.push((frame, side, row));
        }
    }
    let steps = (TIME / world.params.dt).round() as usize;
    let begin = ThreadTime::now();
    for step in 1..=steps {
        if cancel::requested() {
            return Err(RunError::interrupted("interrupted"));
        }
        let depth = DEPTH * 0.5 * step as f64 / steps as f64;
        plates.iter().for_each(|&(frame, side, row)| world.move_kinematic(frame, pose(side, depth, row)));
        world.step().map_err(RunError::input)?;
    }
    Ok(begin.elapsed().as_secs_f64() / world.time())
}

/// CPU time of images of the third-person camera by their number of pixels; nothing is kept between them but textures.
fn draw(loaded: &LoadedScript) -> Result<Vec<GrowthPoint>, RunError> {
    let suite = suite_of(loaded)?;
    let opened = EpisodeSetup::open(loaded, &first_episode(suite), &SceneChanges::default())
        .map_err(RunError::input)?;
    let settings = &suite.settings;
    let scene = Arc::new(opened.scene);
    let assets = AssetCache::default();
    let mut sim = Simulation::new(scene, settings, &assets).map_err(RunError::input)?;
    sim.settle().map_err(RunError::input)?;
    let mut sensors = Sensors::new(&sim, &settings.tactile, &assets);
    let (frame, camera) =
        (Sensors::frame(&sim), sensors.camera("third_person").map_err(RunError::input)?.clone());
    let mut points = Vec::new();
    for edge in EDGES {
        let camera = camera.clone().with_edge(edge);
        // The first one paints textures.
        sensors.render_once(&frame, &camera).map_err(RunError::input)?;
        let mut fastest = f64::INFINITY;
        for _ in 0..IMAGES {
            let begin = ThreadTime::now();
            sensors.render_once(&frame, &camera).map_err(RunError::input)?;
            fastest = begin.elapsed().as_secs_f64().min(fastest);
        }
        points.push(GrowthPoint { size: (edge * edge) as f64, cost: 1e3 * fastest });
    }
    Ok(points)
}

/// Panels of the curves, two side by side.
const PANELS: Layout = Layout {
    columns: 2,
    panel: [320.0, 240.0],
    margins: Margins { left: 52.0, top: 26.0, right: 14.0, bottom: 40.0 },
    shared: None,
    unit: 1.0,
};

/// The curves as SVG, with the exponents of their powers.
pub fn plot(curves: &[GrowthCurve]) -> String {
    let panel = |curve: &GrowthCurve| {
        let point = |p: &GrowthPoint| ChartPoint { x: p.size, y: p.cost, symbol: Some(Symbol::DOT) };
        let points = curve.points.iter().map(point).collect();
        Chart {
            title: curve.title(),
            x: Axis::decades(curve.size, curve.points.iter().map(|point| point.size)).with_grid(),
            y: Axis::decades("", curve.points.iter().map(|point| point.cost)).with_grid(),
            marks: vec![Mark::Curve(Curve { points, stroke: Some(SINGLE_CURVE), ..Curve::default() })],
        }
    };
    let charts: Vec<Chart> = curves.iter().map(panel).collect();
    let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
    PANELS.svg(&titles.join("; "), &charts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_a_line_with_its_exponent() {
        let points =
            (1..=4).map(|n| GrowthPoint { size: f64::from(n), cost: 0.5 * f64::from(n * n) }).collect();
        let curve = GrowthCurve { size: "nodes", cost: "CPU s", points };
        assert!((curve.exponent().expect("two points") - 2.0).abs() < 1e-12);
        let svg = plot(&[curve.clone(), curve]);
        assert_eq!(svg.matches("<circle").count(), 8);
        assert!(svg.contains("CPU s, power 2.00") && svg.contains(">nodes<"), "{svg}");
        let alone =
            GrowthCurve { size: "threads", cost: "rate", points: vec![GrowthPoint { size: 1.0, cost: 3.0 }] };
        assert_eq!(alone.exponent(), None);
    }
}
