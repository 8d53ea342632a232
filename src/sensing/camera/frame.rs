//! Before a picture is drawn: everything in its place, at the level of detail that it is seen at.

use super::{
    CameraError, FrameView, Mount, Stage, V3, lens::Lens, model::Level, pose::Posed, shade::Blob,
    shadow::ShadowMap, surface::Drawn,
};

/// A coarser level is used if its edges are at most this many pixels long, or if it is of one colour and at most this many
/// pixels from the shape that it stands for.
const COARSE_PIXELS: f32 = 1.7;
pub(super) const FLAW_PIXELS: f32 = 0.12;
/// Things wider than this hide no sky from others, m: they are grounds and walls.
const WIDEST_BLOB: f32 = 0.35;

fn bounds_of(points: &[V3]) -> [V3; 2] {
    points.iter().fold([V3::repeat(f32::MAX), V3::repeat(f32::MIN)], |b, p| [b[0].inf(p), b[1].sup(p)])
}

/// Puts the coarsest level of every moving thing in its place, if it is not `placed` there; bounds of all things, world.
pub(super) fn pose_all(
    stage: &Stage,
    view: &FrameView,
    placed: bool,
    poses: &mut Vec<Vec<Posed>>,
) -> Result<Vec<[V3; 2]>, CameraError> {
    poses.resize_with(stage.things.len(), Vec::new);
    let mut bounds = Vec::with_capacity(stage.things.len());
    for ((thing, fixed), own) in stage.things.iter().zip(&stage.fixed).zip(poses) {
        let last = thing.model.levels.len() - 1;
        if let Some(posed) = fixed.last() {
            bounds.push(bounds_of(&posed.positions));
            continue;
        }
        own.resize_with(thing.model.levels.len(), Posed::default);
        if !placed {
            own[last].update(thing, &thing.model.levels[last], view)?;
        }
        bounds.push(bounds_of(&own[last].positions));
    }
    Ok(bounds)
}

/// The level that each thing is drawn at, put in its place.
pub(super) fn choose_levels(
    stage: &Stage,
    view: &FrameView,
    lens: &Lens,
    bounds: &[[V3; 2]],
    poses: &mut [Vec<Posed>],
) -> Result<Vec<Option<usize>>, CameraError> {
    let mut chosen = Vec::with_capacity(bounds.len());
    for (i, thing) in stage.things.iter().enumerate() {
        let [low, high] = bounds[i];
        let (centre, radius) = ((low + high) * 0.5, 0.5 * (high - low).norm());
        if !lens.may_see(&centre, 1.1 * radius) {
            chosen.push(None);
            continue;
        }
        let nearest = (lens.depth(&centre) - radius).max(lens.near);
        let pixel = nearest / lens.focal;
        let levels = &thing.model.levels;
        let fine = |l: &Level| l.spacing <= COARSE_PIXELS * pixel || l.plain && l.flaw <= FLAW_PIXELS * pixel;
        let level = levels.iter().rposition(fine).unwrap_or(0);
        if stage.fixed[i].is_empty() && level + 1 < levels.len() {
            poses[i][level].update(thing, &levels[level], view)?;
        }
        chosen.push(Some(level));
    }
    Ok(chosen)
}

/// A thing's vertices in the world.
fn posed<'a>(stage: &'a Stage, poses: &'a [Vec<Posed>], thing: usize, level: usize) -> &'a Posed {
    stage.fixed[thing].get(level).unwrap_or_else(|| &poses[thing][level])
}

/// What of each thing is drawn.
pub(super) fn drawn<'a>(
    stage: &'a Stage,
    poses: &'a [Vec<Posed>],
    levels: &[Option<usize>],
) -> Vec<Option<Drawn<'a>>> {
    let one = |(i, level): (usize, &Option<usize>)| {
        let model = &stage.things[i].model;
        let level = (*level)?;
        Some(Drawn {
            level: &model.levels[level],
            posed: posed(stage, poses, i, level),
            facets: &model.facets,
        })
    };
    levels.iter().enumerate().map(one).collect()
}

/// The first thing that the camera is inside of: there the solid angles of the triangles around it (Van Oosterom & Strackee,
/// 1983) add up to a whole turn.
pub(super) fn inside_of(
    stage: &Stage,
    lens: &Lens,
    bounds: &[[V3; 2]],
    poses: &[Vec<Posed>],
) -> Option<String> {
    for (i, thing) in stage.things.iter().enumerate() {
        let [low, high] = bounds[i];
        if (0..3).any(|axis| lens.eye[axis] < low[axis] || lens.eye[axis] > high[axis]) {
            continue;
        }
        let level = thing.model.levels.len() - 1;
        let positions = &posed(stage, poses, i, level).positions;
        let mut angle = 0.0_f64;
        for t in &thing.model.levels[level].triangles {
            let [a, b, c] = t.map(|v| (positions[v as usize] - lens.eye).cast::<f64>());
            let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
            let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            angle += 2.0 * a.dot(&b.cross(&c)).atan2(below);
        }
        if angle.abs() > std::f64::consts::TAU {
            return Some(thing.name.clone());
        }
    }
    None
}

/// The shadow map of what moves.
pub(super) fn draw_shadows(stage: &Stage, poses: &[Vec<Posed>], map: &mut ShadowMap) {
    map.clear();
    for (thing, own) in stage.things.iter().zip(poses) {
        if let (true, Some(last), Some(level)) = (thing.casts_shadow, own.last(), thing.model.levels.last()) {
            map.draw(&last.positions, &level.triangles);
        }
    }
    map.finish();
}

/// What hides the sky: fixed, and moving.
pub(super) fn blobs(stage: &Stage, bounds: &[[V3; 2]]) -> [Vec<Blob>; 2] {
    let mut all = [Vec::new(), Vec::new()];
    for (i, (thing, bounds)) in stage.things.iter().zip(bounds).enumerate() {
        let link = matches!(thing.mount, Mount::Link { .. });
        if thing.casts_shadow && !link && (bounds[1] - bounds[0]).max() < WIDEST_BLOB {
            all[usize::from(!matches!(thing.mount, Mount::Fixed(_)))].push(Blob::of_bounds(i, bounds));
        }
    }
    all
}
