//! The drawn form of an object: levels of detail with baked materials.

use std::{
    collections::BTreeMap,
    sync::{Arc, LazyLock, OnceLock},
};

use super::{
    lod::{Lod, NodeWeights, RelativeNormal, bake_vertices, extent, vertex_normals},
    primitive::{append_visible, flat_faces, primitive_mesh, transform},
    simplify::simplify,
    texture::{
        SurfaceMaterial, flat_charts, painted_count, painted_tiles, parameterize, restore_tiles,
        suits_flat_charts,
    },
};
use crate::camera::{error::CameraError, math::V3, raster::TRIANGLE_BITS, shade::pattern};
use softvt_common::disk_cache::{CacheKey, DiskCache};
use softvt_geometry::{
    Pose, Vec3,
    mesh::Mesh,
    shape::Shape,
    surface_mesh::SurfaceMesh,
    voxel::{Embedding, VoxelMesh},
    walls::wall_below,
};
use softvt_scene::{Visual, VisualLayer};

/// Cells along the longest edge of a shape, per level of detail. Neighbours differ by a factor of about 1.25, so that
/// the level that is drawn is seldom much finer than the image needs.
const CELLS: [f64; 9] = [64.0, 50.0, 40.0, 32.0, 26.0, 20.0, 16.0, 12.5, 10.0];
/// Tolerance of the simplification of shapes, in vertex spacings.
const SIMPLIFY_TOLERANCE: f32 = 0.05;
/// Maximum edge of the triangles of a simplified soft shape, in voxels of its body: straight
/// edges follow its deformation.
const MAX_SOFT_EDGE: f64 = 1.0 / 3.0;
/// Maximum edge of triangles with patterns, in longest extents of the mesh.
const MAX_PATTERN_EDGE: f64 = 1.0 / 48.0;
/// Maximum number of triangles that subdivision creates.
const MAX_SUBDIVIDED_TRIANGLES: usize = 120_000;
/// Geometric errors of the levels of detail of solids, m: from large images to distant views and shadows.
const LOD_ERRORS: [f32; 7] = [1e-4, 1.5e-4, 2.2e-4, 3.2e-4, 4.7e-4, 6.8e-4, MAX_CASTER_ERROR];
/// Maximum geometric error of the levels of detail that cast shadows, m: half the depth bias of shadow maps, so that
/// casters do not shade their own surface.
const MAX_CASTER_ERROR: f32 = 1e-3;
/// Vertex spacing in cells that counts for the choice of a level: surfaces of one colour need
/// fewer vertices than patterns.
const UNIFORM_SPACING: f64 = 0.16;
/// Minimum cell that counts for it, m: meshes given explicitly are fine enough for any view.
const MIN_CELL: f64 = 2e-3;
/// Share of triangles that may be farther from the surface than the geometric error of their level: a groove, which
/// takes little of the surface, counts.
const ERROR_SHARE: f64 = 0.02;
/// Depth inside a shape from which a vertex belongs to a hidden part of it, m: corners of visible parts
/// are rounded by less.
const HIDDEN_CORNER_DEPTH: f64 = 3e-4;
/// Vertices deeper than this inside another solid are invisible, m.
const HIDDEN_DEPTH: f64 = 1.5e-3;

/// Triangles and materials of one kind of object, shared by all its instances.
///
/// Materials are functions of the object frame. They are evaluated once, into vertices, or into textures for surfaces
/// with patterns or several materials, and filtered to the spacing of the samples; small images therefore do not alias.
/// Coarser levels of detail are drawn where they look the same; the levels of shapes are built on first use.
#[derive(Clone, Debug)]
pub struct RenderMesh {
    levels: LevelChain,
    /// The levels of a soft shape before simplification, for viewers that show the colours of vertices.
    full_levels: Option<LevelChain>,
}

/// Levels of detail from fine to coarse; at least one.
#[derive(Clone, Debug)]
pub(crate) struct LevelChain(Vec<Arc<LazyLevel>>);

/// A level of detail that is built on first use: finer ones take longer and are seen from nearby only.
type LazyLevel = LazyLock<
    Result<KeptLevel, CameraError>,
    Box<dyn FnOnce() -> Result<KeptLevel, CameraError> + Send + Sync>,
>;

fn lazy_level(
    build: impl FnOnce() -> Result<KeptLevel, CameraError> + Send + Sync + 'static,
) -> Arc<LazyLevel> {
    Arc::new(LazyLock::new(Box::new(build)))
}

/// A level of detail whose painted tiles are stored when it is dropped: only then it is known which of them are seen.
#[derive(Debug)]
struct KeptLevel {
    lod: Lod,
    store: Option<TileStore>,
}

/// Place of the painted tiles of a level in storage.
#[derive(Debug)]
struct TileStore {
    cache: DiskCache,
    key: CacheKey,
    /// Number of tiles that are stored.
    count: usize,
}

impl KeptLevel {
    /// A level with the tiles that are stored under `key`, if it is textured.
    fn new(lod: Lod, cache: &DiskCache, key: Option<&CacheKey>) -> Self {
        let key = key.filter(|_| !lod.charts.is_empty()).and_then(|key| cache.key("tiles", key));
        let store = key.map(|key| {
            let tiles = cache.read(&key).unwrap_or_default();
            restore_tiles(&lod.charts, tiles);
            TileStore { cache: cache.clone(), key, count: painted_count(&lod.charts) }
        });
        Self { lod, store }
    }
}

impl Drop for KeptLevel {
    fn drop(&mut self) {
        if let Some(TileStore { cache, key, count }) = &self.store
            && painted_count(&self.lod.charts) > *count
        {
            cache.write(key, &painted_tiles(&self.lod.charts));
        }
    }
}

impl RenderMesh {
    /// Builds the mesh of a rigid shape. `visuals` are indexed by its material ids; `name` appears in errors. What
    /// takes long is kept in `cache`.
    ///
    /// # Errors
    /// The shape has no surface, or a material id has no visual.
    pub fn from_shape(
        name: &str,
        shape: &Shape,
        visuals: &[Visual],
        cache: &DiskCache,
    ) -> Result<Self, CameraError> {
        if let Some(mesh) = flat_faces(shape) {
            return Self::from_mesh(name, &mesh, visuals, cache);
        }
        Self::with_lazy_levels(ShapeSurface::new(name, shape, visuals, None, cache))
    }

    /// Builds the mesh of the shape of a soft body, attached to the nodes of `voxels`, with small triangles
    /// on flat faces too.
    ///
    /// # Errors
    /// As [`RenderMesh::from_shape`]; or part of the surface lies more than two voxels outside `voxels`.
    pub fn from_soft_shape(
        name: &str,
        shape: &Shape,
        visuals: &[Visual],
        voxels: &VoxelMesh,
        cache: &DiskCache,
    ) -> Result<Self, CameraError> {
        Self::with_lazy_levels(ShapeSurface::new(name, shape, visuals, Some(voxels.clone()), cache))
    }

    /// Builds the level that casts shadows, which every image needs, and leaves finer ones for later.
    fn with_lazy_levels(surface: ShapeSurface) -> Result<Self, CameraError> {
        let cells = surface.cells();
        let (is_soft, surface) = (surface.voxels.is_some(), Arc::new(surface));
        let chain = |is_simplified: bool| {
            let level = |(index, &cells): (usize, &f64)| {
                let surface = surface.clone();
                lazy_level(move || surface.level(cells, index == 0, is_simplified))
            };
            LevelChain(cells.iter().enumerate().map(level).collect())
        };
        let mesh = Self { levels: chain(true), full_levels: is_soft.then(|| chain(false)) };
        mesh.caster()?;
        Ok(mesh)
    }

    /// The mesh with these levels, from fine to coarse.
    pub(crate) fn from_levels(levels: impl IntoIterator<Item = Lod>) -> Self {
        Self::from_kept(levels.into_iter().map(|lod| KeptLevel { lod, store: None }))
    }

    fn from_kept(levels: impl IntoIterator<Item = KeptLevel>) -> Self {
        let levels = levels.into_iter().map(|kept| {
            let level = lazy_level(move || Ok(kept));
            LazyLock::force(&level);
            level
        });
        Self { levels: LevelChain(levels.collect()), full_levels: None }
    }

    /// Number of levels of detail.
    pub(crate) fn level_count(&self) -> usize {
        self.levels.0.len()
    }

    /// A level of detail; 0 is the finest.
    pub(crate) fn level(&self, index: usize) -> Result<&Lod, CameraError> {
        self.levels.get(index)
    }

    /// Index of the level that casts shadows and stands for the object where its extent matters only.
    pub(crate) fn caster(&self) -> Result<usize, CameraError> {
        self.coarsest_where(|lod| lod.geometric_error <= MAX_CASTER_ERROR)
    }

    /// Index of the coarsest level that is good enough, or of the finest one.
    pub(crate) fn coarsest_where(&self, is_good: impl Fn(&Lod) -> bool) -> Result<usize, CameraError> {
        self.levels.coarsest_where(is_good)
    }

    /// The coarsest level that looks like the finest one where a pixel covers `pixel` metres. Soft
    /// shapes are not simplified.
    pub(crate) fn full_level(&self, pixel: f32) -> Result<&Lod, CameraError> {
        let levels = self.full_levels.as_ref().unwrap_or(&self.levels);
        levels.get(levels.coarsest_where(|lod| lod.is_fine_enough(pixel))?)
    }

    /// Builds the mesh of triangles, closed or not, which are visible from their counter-clockwise side.
    ///
    /// They have the first of `visuals`, a function of the object frame: the texture coordinates of `mesh` are ignored.
    ///
    /// # Errors
    /// The mesh is empty, not finite, or refers to a vertex that does not exist; or there are no visuals.
    pub fn from_mesh(
        name: &str,
        mesh: &Mesh,
        visuals: &[Visual],
        cache: &DiskCache,
    ) -> Result<Self, CameraError> {
        check_mesh(name, mesh, &[0], visuals)?;
        let key = cache.key("mesh", &(mesh, visuals));
        let mut mesh = mesh.clone();
        let mut edge = extent(&mesh);
        let has_pattern = !visuals[0].is_uniform();
        let lod = if has_pattern && suits_flat_charts(&mesh, visuals.iter().any(pattern::has_text)) {
            flat_charts(&mesh, &visuals[0])
        } else {
            if has_pattern {
                edge = edge.min(subdivide(&mut mesh, edge * MAX_PATTERN_EDGE));
            }
            bake_vertices(&mesh, &vec![0; mesh.triangles.len()], visuals, edge as f32, None)
        };
        Ok(Self::from_kept([KeptLevel::new(lod, cache, key.as_ref())]))
    }

    /// Builds the mesh of solids that may overlap; `visuals` are those that the solids index. They are meshed
    /// separately, so that their materials meet along clean lines.
    ///
    /// # Errors
    /// A solid has no surface, or its visual does not exist.
    pub(crate) fn from_solids(
        name: &str,
        solids: &[RenderSolid],
        visuals: &[Visual],
    ) -> Result<Self, CameraError> {
        let union = Shape::Union(solids.iter().map(|solid| solid.shape.clone()).collect());
        let mut combined = Mesh::default();
        let mut material_ids = Vec::new();
        for (i, solid) in solids.iter().enumerate() {
            check_mesh(name, &solid.mesh, &[solid.visual as u16], visuals)?;
            append_visible(&mut combined, solid.mesh.clone(), |v: &Vec3| {
                let mut others = solids.iter().enumerate().filter(|(j, _)| *j != i);
                others.any(|(_, other)| other.shape.distance(v) < -HIDDEN_DEPTH)
            });
            material_ids.resize(combined.triangles.len(), solid.visual as u16);
        }
        let max_cell = solids.iter().map(|solid| solid.cell_m).fold(MIN_CELL, f64::max);
        let spacing = (UNIFORM_SPACING * max_cell) as f32;
        let mut full = bake_vertices(&combined, &material_ids, visuals, spacing, Some(&union));
        // Solids share no vertices and are uniform each, so their materials do not limit simplification.
        full.is_uniform = true;
        Ok(Self::from_levels(simplified_levels(&full)))
    }

    /// The mesh with coarser levels of detail, for a mesh of one level that is uniform and not textured.
    ///
    /// # Errors
    /// The mesh cannot be built.
    pub(crate) fn with_coarser_levels(&self) -> Result<Self, CameraError> {
        let full = self.level(0)?;
        Ok(Self::from_levels(std::iter::once(full.clone()).chain(simplified_levels(full))))
    }
}

/// Levels of detail of the [`LOD_ERRORS`].
fn simplified_levels(full: &Lod) -> [Lod; LOD_ERRORS.len()] {
    let mut finer = full.clone();
    LOD_ERRORS.map(|geometric_error| {
        finer = Lod { geometric_error, ..simplify(&finer, geometric_error, f32::MAX) };
        finer.clone()
    })
}

impl LevelChain {
    fn get(&self, index: usize) -> Result<&Lod, CameraError> {
        self.0[index].as_ref().as_ref().map(|level| &level.lod).map_err(Clone::clone)
    }

    fn coarsest_where(&self, is_good: impl Fn(&Lod) -> bool) -> Result<usize, CameraError> {
        for index in (1..self.0.len()).rev() {
            if is_good(self.get(index)?) {
                return Ok(index);
            }
        }
        Ok(0)
    }
}

/// The surface of a shape, from which levels of detail are built.
#[derive(Debug)]
struct ShapeSurface {
    /// Name of the object, for error messages.
    name: String,
    material: Arc<SurfaceMaterial>,
    /// Data of the vertices for each visual; of a textured surface, those that textures do not contain.
    baked: Vec<Visual>,
    is_textured: bool,
    /// Nodes of the soft body that the surface belongs to, if any.
    voxels: Option<VoxelMesh>,
    cache: DiskCache,
    /// Key of shape, visuals and voxels.
    key: Option<CacheKey>,
    longest_edge: OnceLock<f64>,
}

impl ShapeSurface {
    fn new(
        name: &str,
        shape: &Shape,
        visuals: &[Visual],
        voxels: Option<VoxelMesh>,
        cache: &DiskCache,
    ) -> Self {
        let is_textured = visuals.len() > 1 || visuals.iter().any(|visual| !visual.is_uniform());
        let baked = |v: &Visual| if is_textured { without_colours(v) } else { v.clone() };
        Self {
            name: name.to_owned(),
            material: Arc::new(SurfaceMaterial { shape: shape.clone(), visuals: visuals.to_vec() }),
            baked: visuals.iter().map(baked).collect(),
            is_textured,
            key: cache.key("surface", &(shape, visuals, &voxels)),
            voxels,
            cache: cache.clone(),
            longest_edge: OnceLock::new(),
        }
    }

    /// Longest edge of the bounds of the shape, m.
    fn longest_edge(&self) -> f64 {
        *self.longest_edge.get_or_init(|| self.material.shape.bounds().size().max())
    }

    /// The level of detail with `cells` along the longest edge.
    fn level(&self, cells: f64, is_finest: bool, is_simplified: bool) -> Result<KeptLevel, CameraError> {
        let inputs = (&self.key, cells, is_finest, is_simplified);
        let mut lod =
            self.cache.get("level", &inputs, || self.build_level(cells, is_finest, is_simplified))?;
        if self.is_textured {
            parameterize(&mut lod, &self.material);
        }
        Ok(KeptLevel::new(lod, &self.cache, self.cache.key("level", &inputs).as_ref()))
    }

    /// Builds a level of detail without its textures.
    fn build_level(&self, cells: f64, is_finest: bool, is_simplified: bool) -> Result<Lod, CameraError> {
        let SurfaceMaterial { shape, visuals } = &*self.material;
        let cell = self.longest_edge() / cells;
        let mesh = self.triangulate(cell);
        let mut material_ids: Vec<u16> =
            mesh.triangles.iter().map(|t| shape.material(&centroid(&mesh, t))).collect();
        check_mesh(&self.name, &mesh, &material_ids, visuals)?;
        if self.baked.iter().all(|visual| *visual == self.baked[0]) {
            material_ids.fill(0);
        }
        let mut lod = bake_vertices(&mesh, &material_ids, &self.baked, cell as f32, Some(shape));
        if !is_finest && (lod.is_uniform || self.is_textured) {
            lod.geometric_error = geometric_error(&mesh, shape);
            lod.missing_relief = self.relief();
        }
        if is_simplified {
            let max_edge =
                self.voxels.as_ref().map_or(f32::MAX, |voxels| (MAX_SOFT_EDGE * voxels.edge) as f32);
            lod = simplify(&lod, SIMPLIFY_TOLERANCE * lod.vertex_spacing, max_edge);
            if self.voxels.is_some() {
                let of_triangles = vertex_normals(&lod.positions, &lod.triangles);
                lod.relative_normals =
                    RelativeNormal::of_vertices(&lod.positions, &lod.triangles, &lod.normals, &of_triangles);
            }
        }
        self.embed(lod)
    }

    /// Cells along the longest edge of the shape, per level of detail. A shape with walls that the finest level would
    /// miss has one level with cells that are as small.
    fn cells(&self) -> Vec<f64> {
        let shape = &self.material.shape;
        // A mesh has its own triangles at every level.
        if matches!(shape, Shape::Mesh(_)) {
            return vec![CELLS[0]];
        }
        let key = self.cache.key("wall", &self.key);
        let wall = key.as_ref().and_then(|key| self.cache.read(key)).unwrap_or_else(|| {
            let cell = self.longest_edge() / CELLS[0];
            let is_meshed = self.primitives(cell).is_none();
            let wall = is_meshed.then(|| wall_below(shape, cell)).flatten();
            // Kept however fast it was found: for many shapes that takes about the time from which on values are kept.
            key.iter().for_each(|key| self.cache.write(key, &wall));
            wall
        });
        wall.map_or(CELLS.to_vec(), |wall| vec![self.longest_edge() / wall])
    }

    fn triangulate(&self, cell: f64) -> Mesh {
        self.primitives(cell).unwrap_or_else(|| SurfaceMesh::from_shape(&self.material.shape, cell).mesh)
    }

    /// The mesh of a shape that is made of primitives, where it is better than the surface mesher's.
    fn primitives(&self, cell: f64) -> Option<Mesh> {
        let shape = &self.material.shape;
        // Textured faces of rigid shapes need no small triangles.
        let prefers_primitives = is_revolved(shape) || self.voxels.is_none() && self.is_textured;
        prefers_primitives.then(|| primitive_mesh(shape, cell)).flatten()
    }

    /// Height of the highest relief, m.
    fn relief(&self) -> f32 {
        let layers = self.baked.iter().flat_map(|visual| &visual.layers);
        layers.map(|layer| layer.relief_m.abs()).fold(0.0, f64::max) as f32
    }

    /// Attaches a level to the nodes of the soft body.
    fn embed(&self, lod: Lod) -> Result<Lod, CameraError> {
        let Some(voxels) = &self.voxels else { return Ok(lod) };
        let attach = |p: &V3| {
            let at: Embedding = voxels.locate(&p.cast())?;
            Some(NodeWeights {
                nodes: voxels.elements[at.element as usize],
                weights: at.weights().map(|w| w as f32),
            })
        };
        let embedding: Option<Vec<_>> = lod.positions.iter().map(attach).collect();
        let outside = || CameraError::Mesh {
            name: self.name.clone(),
            reason: "its surface lies outside of its voxel mesh; build both from one shape".to_owned(),
        };
        Ok(Lod { embedding: embedding.ok_or_else(outside)?, ..lod })
    }
}

/// A solid of one material, in the object frame.
#[derive(Clone, Debug)]
pub(crate) struct RenderSolid {
    /// Volume occupied by the solid.
    pub(crate) shape: Shape,
    pub(crate) mesh: Mesh,
    /// Edge of the cells of the surface mesher, m; 0 for an explicit mesh.
    cell_m: f64,
    /// Index of its visual.
    visual: usize,
}

impl RenderSolid {
    /// A solid triangulated by the surface mesher with cells of edge `cell_m`, m.
    pub(crate) fn new(shape: Shape, cell_m: f64, visual: usize) -> Self {
        let mesh = SurfaceMesh::from_shape(&shape, cell_m).mesh;
        Self { mesh, shape, cell_m, visual }
    }

    /// A solid with a given mesh.
    pub(crate) fn with_mesh(shape: Shape, mesh: Mesh, visual: usize) -> Self {
        Self { shape, mesh, cell_m: 0.0, visual }
    }

    /// Moves the solid by `pose`.
    #[must_use]
    pub(crate) fn placed(mut self, pose: &Pose) -> Self {
        self.shape = self.shape.placed(*pose);
        transform(&mut self.mesh, pose);
        self
    }
}

/// A visual whose colours a texture holds: its metalness and relief.
fn without_colours(visual: &Visual) -> Visual {
    let (albedo, roughness) = ([0.0; 3], 1.0);
    let raised = visual.layers.iter().filter(|layer| layer.relief_m != 0.0);
    let layers = raised.map(|layer| VisualLayer { albedo, roughness, ..layer.clone() }).collect();
    Visual { albedo, roughness, layers, colours: None, ..visual.clone() }
}

fn check_mesh(name: &str, mesh: &Mesh, material_ids: &[u16], visuals: &[Visual]) -> Result<(), CameraError> {
    let fail = |reason: String| Err(CameraError::Mesh { name: name.to_owned(), reason });
    if let Err(error) = mesh.validate() {
        return fail(error.to_string());
    }
    let count = mesh.triangles.len();
    if count >= 1 << TRIANGLE_BITS {
        let max = (1 << TRIANGLE_BITS) - 1;
        return fail(format!("{count} triangles; at most {max} can be drawn, simplify it"));
    }
    match material_ids.iter().find(|&&m| m as usize >= visuals.len()) {
        Some(m) => fail(format!("material {m} has no visual; there are {} (from 0)", visuals.len())),
        None => Ok(()),
    }
}

fn centroid(mesh: &Mesh, triangle: &[u32; 3]) -> Vec3 {
    triangle.iter().map(|&v| mesh.vertices[v as usize]).sum::<Vec3>() / 3.0
}

/// True for a surface of revolution, painted or not.
fn is_revolved(shape: &Shape) -> bool {
    match shape {
        Shape::Lathe(_) => true,
        Shape::Paint { shape, .. } => is_revolved(shape),
        _ => false,
    }
}

/// Divides every triangle into four until no edge is longer than `max_edge`, m, or the mesh becomes too large. Returns
/// the length of the edges reached, m.
fn subdivide(mesh: &mut Mesh, max_edge: f64) -> f64 {
    loop {
        let length = |a: u32, b: u32| (mesh.vertices[a as usize] - mesh.vertices[b as usize]).norm();
        let is_long = |t: &[u32; 3]| (0..3).any(|i| length(t[i], t[(i + 1) % 3]) > max_edge);
        if !mesh.triangles.iter().any(is_long) {
            return max_edge;
        }
        if 4 * mesh.triangles.len() > MAX_SUBDIVIDED_TRIANGLES {
            let sum = mesh.triangles.iter().map(|t| length(t[0], t[1])).sum::<f64>();
            return sum / mesh.triangles.len() as f64;
        }
        let mut midpoints: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
        for t in &mesh.triangles {
            let [ab, bc, ca] = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| {
                *midpoints.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    mesh.vertices.push(0.5 * (mesh.vertices[a as usize] + mesh.vertices[b as usize]));
                    mesh.vertices.len() as u32 - 1
                })
            });
            triangles.extend([[t[0], ab, ca], [ab, t[1], bc], [ca, bc, t[2]], [ab, bc, ca]]);
        }
        mesh.triangles = triangles;
    }
}

/// Distance from the surface of `shape` that a few of the centroids of triangles exceed ([`ERROR_SHARE`]), m. Triangles
/// with a corner inside the shape do not count: they are hidden by another part of it.
fn geometric_error(mesh: &Mesh, shape: &Shape) -> f32 {
    let is_hidden: Vec<bool> =
        mesh.vertices.iter().map(|v| shape.distance(v) < -HIDDEN_CORNER_DEPTH).collect();
    let seen = mesh.triangles.iter().filter(|t| t.iter().all(|&v| !is_hidden[v as usize]));
    let mut distances: Vec<f64> = seen.map(|t| shape.distance(&centroid(mesh, t)).abs()).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let rank = ((1.0 - ERROR_SHARE) * distances.len() as f64) as usize;
    distances.get(rank).copied().unwrap_or(0.0) as f32
}
