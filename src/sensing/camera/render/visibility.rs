//! Before a picture is drawn: everything in its place, at the level of detail that it is seen at.

use crate::sensing::camera::{
    Attachment, CameraError, FrameView, RenderScene, V3, lens::Lens, mesh::render_mesh::Lod,
    render::interpolate::MeshInstance, scene::pose::PosedMesh, shade::shading::OcclusionEllipsoid,
    shade::shadow::ShadowMap,
};

/// A coarser level is used if its edges are at most this many pixels long, or if it is of one colour and at most this many
/// pixels from the shape that it stands for.
const COARSE_PIXELS: f32 = 1.7;
pub(crate) const FLAW_PIXELS: f32 = 0.12;
/// Things wider than this hide no sky from others, m: they are grounds and walls.
const WIDEST_BLOB: f32 = 0.35;

fn bounds_of(points: &[V3]) -> [V3; 2] {
    points.iter().fold([V3::repeat(f32::MAX), V3::repeat(f32::MIN)], |b, p| [b[0].inf(p), b[1].sup(p)])
}

/// Puts the coarsest level of every moving thing in its place, if it is not `placed` there; bounds of all things, world.
pub(crate) fn pose_all(
    stage: &RenderScene,
    view: &FrameView,
    placed: bool,
    poses: &mut Vec<Vec<PosedMesh>>,
) -> Result<Vec<[V3; 2]>, CameraError> {
    poses.resize_with(stage.objects.len(), Vec::new);
    let mut bounds = Vec::with_capacity(stage.objects.len());
    for ((thing, fixed), own) in stage.objects.iter().zip(&stage.fixed).zip(poses) {
        let last = thing.mesh.levels.len() - 1;
        if let Some(posed) = fixed.last() {
            bounds.push(bounds_of(&posed.positions));
            continue;
        }
        own.resize_with(thing.mesh.levels.len(), PosedMesh::default);
        if !placed {
            own[last].update(thing, &thing.mesh.levels[last], view)?;
        }
        bounds.push(bounds_of(&own[last].positions));
    }
    Ok(bounds)
}

/// The level that each thing is drawn at, put in its place.
pub(crate) fn choose_levels(
    stage: &RenderScene,
    view: &FrameView,
    lens: &Lens,
    bounds: &[[V3; 2]],
    poses: &mut [Vec<PosedMesh>],
) -> Result<Vec<Option<usize>>, CameraError> {
    let mut chosen = Vec::with_capacity(bounds.len());
    for (i, thing) in stage.objects.iter().enumerate() {
        let [low, high] = bounds[i];
        let (centre, radius) = ((low + high) * 0.5, 0.5 * (high - low).norm());
        if !lens.may_see(&centre, 1.1 * radius) {
            chosen.push(None);
            continue;
        }
        let nearest = (lens.depth(&centre) - radius).max(lens.near);
        let pixel = nearest / lens.focal;
        let levels = &thing.mesh.levels;
        let fine = |l: &Lod| l.spacing <= COARSE_PIXELS * pixel || l.plain && l.flaw <= FLAW_PIXELS * pixel;
        let level = levels.iter().rposition(fine).unwrap_or(0);
        if stage.fixed[i].is_empty() && level + 1 < levels.len() {
            poses[i][level].update(thing, &levels[level], view)?;
        }
        chosen.push(Some(level));
    }
    Ok(chosen)
}

/// A thing's vertices in the world.
fn posed<'a>(
    stage: &'a RenderScene,
    poses: &'a [Vec<PosedMesh>],
    thing: usize,
    level: usize,
) -> &'a PosedMesh {
    stage.fixed[thing].get(level).unwrap_or_else(|| &poses[thing][level])
}

/// What of each thing is drawn.
pub(crate) fn drawn<'a>(
    stage: &'a RenderScene,
    poses: &'a [Vec<PosedMesh>],
    levels: &[Option<usize>],
) -> Vec<Option<MeshInstance<'a>>> {
    let one = |(i, level): (usize, &Option<usize>)| {
        let model = &stage.objects[i].mesh;
        let level = (*level)?;
        Some(MeshInstance {
            level: &model.levels[level],
            posed: posed(stage, poses, i, level),
            facets: &model.facets,
        })
    };
    levels.iter().enumerate().map(one).collect()
}

/// The first thing that the camera is inside of: there the solid angles of the triangles around it (Van Oosterom & Strackee,
/// 1983) add up to a whole turn.
pub(crate) fn inside_of(
    stage: &RenderScene,
    lens: &Lens,
    bounds: &[[V3; 2]],
    poses: &[Vec<PosedMesh>],
) -> Option<String> {
    for (i, thing) in stage.objects.iter().enumerate() {
        let [low, high] = bounds[i];
        if (0..3).any(|axis| lens.eye[axis] < low[axis] || lens.eye[axis] > high[axis]) {
            continue;
        }
        let level = thing.mesh.levels.len() - 1;
        let positions = &posed(stage, poses, i, level).positions;
        let mut angle = 0.0_f64;
        for t in &thing.mesh.levels[level].triangles {
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
pub(crate) fn draw_shadows(stage: &RenderScene, poses: &[Vec<PosedMesh>], map: &mut ShadowMap) {
    map.clear();
    for (thing, own) in stage.objects.iter().zip(poses) {
        if let (true, Some(last), Some(level)) = (thing.casts_shadow, own.last(), thing.mesh.levels.last()) {
            map.draw(&last.positions, &level.triangles);
        }
    }
    map.finish();
}

/// What hides the sky: fixed, and moving.
pub(crate) fn blobs(stage: &RenderScene, bounds: &[[V3; 2]]) -> [Vec<OcclusionEllipsoid>; 2] {
    let mut all = [Vec::new(), Vec::new()];
    for (i, (thing, bounds)) in stage.objects.iter().zip(bounds).enumerate() {
        let link = matches!(thing.attachment, Attachment::Link { .. });
        if thing.casts_shadow && !link && (bounds[1] - bounds[0]).max() < WIDEST_BLOB {
            all[usize::from(!matches!(thing.attachment, Attachment::Fixed(_)))]
                .push(OcclusionEllipsoid::of_bounds(i, bounds));
        }
    }
    all
}
