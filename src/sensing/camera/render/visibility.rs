//! Prepares the objects of a scene for one image: poses, levels of detail, shadows and occluders.

use super::interpolate::MeshInstance;
use crate::physics::BodyId;
use crate::sensing::camera::{
    CameraError,
    lens::Lens,
    math::V3,
    scene::{
        pose::PosedMesh,
        render_scene::{FrameView, RenderScene},
    },
    shade::{occlusion::OcclusionEllipsoid, shadow::ShadowMap},
};

/// Maximum extent of objects that occlude the sky for others, m; larger ones are floors and walls.
const MAX_OCCLUDER_EXTENT: f32 = 0.35;
/// Factor on the bounding radius in the frustum test: finer levels may exceed the coarsest one a little.
const BOUNDS_MARGIN: f32 = 1.1;

/// Lowest and highest corner of the bounding box of an object, world, m.
pub(crate) type Bounds = [V3; 2];

fn bounds_of(points: &[V3]) -> Bounds {
    points.iter().fold([V3::repeat(f32::MAX), V3::repeat(f32::MIN)], |b, p| [b[0].inf(p), b[1].sup(p)])
}

/// Poses the coarsest level of every moving object, unless `poses` are up to date. Returns the bounds of all objects.
pub(crate) fn pose_objects(
    scene: &RenderScene,
    view: &FrameView,
    is_up_to_date: bool,
    poses: &mut Vec<Vec<PosedMesh>>,
) -> Result<Vec<Bounds>, CameraError> {
    poses.resize_with(scene.objects.len(), Vec::new);
    let mut bounds = Vec::with_capacity(scene.objects.len());
    for ((object, fixed), posed) in scene.objects.iter().zip(&scene.fixed_meshes).zip(poses) {
        if let Some(fixed) = fixed.last() {
            bounds.push(bounds_of(&fixed.positions));
            continue;
        }
        let lods = &object.mesh.lods;
        let coarsest = lods.len() - 1;
        posed.resize_with(lods.len(), PosedMesh::default);
        if !is_up_to_date {
            posed[coarsest].update(object, &lods[coarsest], view)?;
        }
        bounds.push(bounds_of(&posed[coarsest].positions));
    }
    Ok(bounds)
}

/// Chooses the level of detail of each object, `None` if it is out of view, and poses it.
pub(crate) fn choose_levels(
    scene: &RenderScene,
    view: &FrameView,
    lens: &Lens,
    bounds: &[Bounds],
    poses: &mut [Vec<PosedMesh>],
) -> Result<Vec<Option<usize>>, CameraError> {
    let mut chosen = Vec::with_capacity(bounds.len());
    for (i, object) in scene.objects.iter().enumerate() {
        let [low, high] = bounds[i];
        let (centre, radius) = ((low + high) * 0.5, 0.5 * (high - low).norm());
        if !lens.may_see(&centre, BOUNDS_MARGIN * radius) {
            chosen.push(None);
            continue;
        }
        let nearest = (lens.depth(&centre) - radius).max(lens.near);
        let pixel = nearest / lens.focal;
        let lods = &object.mesh.lods;
        let level = lods.iter().rposition(|lod| lod.suffices(pixel)).unwrap_or(0);
        // The coarsest level is posed already.
        if scene.fixed_meshes[i].is_empty() && level + 1 < lods.len() {
            poses[i][level].update(object, &lods[level], view)?;
        }
        chosen.push(Some(level));
    }
    Ok(chosen)
}

fn posed_mesh<'a>(
    scene: &'a RenderScene,
    poses: &'a [Vec<PosedMesh>],
    object: usize,
    level: usize,
) -> &'a PosedMesh {
    scene.fixed_meshes[object].get(level).unwrap_or_else(|| &poses[object][level])
}

/// Returns the drawn form of each object at its level of detail.
pub(crate) fn instances<'a>(
    scene: &'a RenderScene,
    poses: &'a [Vec<PosedMesh>],
    levels: &[Option<usize>],
) -> Vec<Option<MeshInstance<'a>>> {
    let instance = |(i, level): (usize, &Option<usize>)| {
        let mesh = &scene.objects[i].mesh;
        let level = (*level)?;
        let posed = posed_mesh(scene, poses, i, level);
        Some(MeshInstance { lod: &mesh.lods[level], posed, charts: &mesh.charts })
    };
    levels.iter().enumerate().map(instance).collect()
}

/// Returns the name of the first object that contains the camera: one whose triangles subtend a solid angle of 4π
/// there (Van Oosterom & Strackee, 1983).
pub(crate) fn enclosing_object(
    scene: &RenderScene,
    lens: &Lens,
    bounds: &[Bounds],
    poses: &[Vec<PosedMesh>],
) -> Option<String> {
    for (i, object) in scene.objects.iter().enumerate() {
        let [low, high] = bounds[i];
        if (0..3).any(|axis| lens.eye[axis] < low[axis] || lens.eye[axis] > high[axis]) {
            continue;
        }
        let level = object.mesh.lods.len() - 1;
        let positions = &posed_mesh(scene, poses, i, level).positions;
        let mut angle = 0.0_f64;
        for t in &object.mesh.lods[level].triangles {
            let [a, b, c] = t.map(|v| (positions[v as usize] - lens.eye).cast::<f64>());
            let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
            let denominator = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            angle += 2.0 * a.dot(&b.cross(&c)).atan2(denominator);
        }
        // 4π inside and 0 outside, up to rounding.
        if angle.abs() > std::f64::consts::TAU {
            return Some(object.name.clone());
        }
    }
    None
}

/// Draws the shadow map of the moving objects.
pub(crate) fn draw_moving_shadows(scene: &RenderScene, poses: &[Vec<PosedMesh>], map: &mut ShadowMap) {
    map.clear();
    for (object, posed) in scene.objects.iter().zip(poses) {
        if let (true, Some(posed), Some(lod)) = (object.casts_shadow, posed.last(), object.mesh.lods.last()) {
            map.draw(&posed.positions, &lod.triangles);
        }
    }
    map.finish();
}

/// Objects that occlude the sky for others.
pub(crate) struct Occluders {
    pub(crate) fixed: Vec<OcclusionEllipsoid>,
    pub(crate) moving: Vec<OcclusionEllipsoid>,
}

impl Occluders {
    /// Selects the small objects that cast shadows, except links of articulations.
    pub(crate) fn new(scene: &RenderScene, bounds: &[Bounds]) -> Self {
        let mut occluders = Self { fixed: Vec::new(), moving: Vec::new() };
        for (i, (object, bounds)) in scene.objects.iter().zip(bounds).enumerate() {
            let is_link = matches!(object.body, BodyId::Link(_));
            let is_small = (bounds[1] - bounds[0]).max() < MAX_OCCLUDER_EXTENT;
            if object.casts_shadow && !is_link && is_small {
                let list = if object.is_moving() { &mut occluders.moving } else { &mut occluders.fixed };
                list.push(OcclusionEllipsoid::from_bounds(i, bounds));
            }
        }
        occluders
    }
}
