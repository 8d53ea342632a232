//! What is drawn of a thing: triangles with normals and baked looks, in the object frame at rest.

use std::{collections::BTreeMap, sync::Arc};

use crate::sensing::camera::{
    CameraError, V3,
    mesh::lathe_mesh::lathed,
    mesh::primitive_mesh,
    mesh::simplify::decimated,
    mesh::texture_chart::{self, PRINT, TextureChart},
    mesh::uv_atlas::{self, SurfaceMaterial},
    render::interpolate::TRIANGLE_BITS,
    render::visibility::FLAW_PIXELS,
    shade::pattern::{self, MaterialSample},
};
use crate::{
    geometry::{
        Vec3, basis_from_reference,
        mesh::Mesh,
        shape::{Polygon, Shape},
        surface_mesh::SurfaceMesh,
        union_find::UnionFind,
        voxel::{Embedding, VoxelMesh},
    },
    scene::Visual,
};

/// Faces that meet at more than this angle (cosine) meet at an edge; others are one smooth surface.
const CREASE: f32 = 0.8;
/// Cells of a skin along the longest edge, from near views to far ones; the last also throws shadows.
const CELLS: [f64; 4] = [64.0, 40.0, 26.0, 16.0];
/// How far fewer triangles of a rigid thing may be from all of them, in the spacing of their vertices.
const STRAIGHT: f32 = 0.025;
/// Triangles with patterns are cut until their edges are shorter than this share of the longest extent.
const FINEST_CUT: f64 = 1.0 / 48.0;
/// Most triangles that cutting may make.
const MOST_CUT: usize = 120_000;

/// Triangles to draw. Vertices are split at creases.
#[derive(Clone, Debug)]
pub(crate) struct Lod {
    pub positions: Vec<V3>,
    pub normals: Vec<V3>,
    pub looks: Vec<MaterialSample>,
    pub triangles: Vec<[u32; 3]>,
    /// TextureChart of each triangle, or empty if there are none.
    pub facets: Vec<u32>,
    /// Places of each triangle's corners in its facet.
    pub places: Vec<[[f32; 2]; 3]>,
    /// Number of the smooth patch that each triangle belongs to.
    pub patches: Vec<u32>,
    /// Nodes and weights of each vertex of a soft thing.
    pub embedding: Vec<([u32; 8], [f32; 8])>,
    /// Mean length of the edges, m.
    pub spacing: f32,
    /// Whether all of it looks alike but for its shape.
    pub plain: bool,
    /// How far it is from the shape that it stands for, m.
    pub flaw: f32,
}

/// The drawn form of one kind of thing, to be shared by all its instances.
#[derive(Clone, Debug)]
pub struct RenderMesh {
    pub(crate) levels: Vec<Lod>,
    pub(crate) facets: Vec<TextureChart>,
}

impl RenderMesh {
    /// The drawn form of a shape; `visuals` by its material ids.
    ///
    /// # Errors
    /// If the shape has no surface or a material id has no visual.
    pub fn of_shape(name: &str, shape: &Shape, visuals: &[Visual]) -> Result<Self, CameraError> {
        if let Some(mesh) = flat_faces(shape) {
            return Self::of_mesh(name, &mesh, &[], visuals);
        }
        let mut model = Self::of_levels(name, shape, visuals, primitive_mesh::triangles)?;
        // What is printed lies on its triangles as they are.
        if model.facets.is_empty() {
            model.levels.iter_mut().for_each(|level| *level = decimated(level, STRAIGHT * level.spacing));
        }
        Ok(model)
    }

    /// The same with flat faces in small triangles too, for bodies that bend.
    ///
    /// # Errors
    /// As [`RenderMesh::of_shape`].
    pub fn of_skin(name: &str, shape: &Shape, visuals: &[Visual]) -> Result<Self, CameraError> {
        Self::of_levels(name, shape, visuals, |_, _| None)
    }

    /// `known` gives the triangles of printed shapes, which need no small ones, if it can.
    fn of_levels(
        name: &str,
        shape: &Shape,
        visuals: &[Visual],
        known: impl Fn(&Shape, f64) -> Option<Mesh>,
    ) -> Result<Self, CameraError> {
        let longest = shape.bounds().size().max();
        let (mut levels, mut facets) = (Vec::new(), Vec::new());
        let cloth = visuals
            .iter()
            .any(pattern::printed)
            .then(|| Arc::new(SurfaceMaterial { shape: shape.clone(), visuals: visuals.to_vec() }));
        for cells in CELLS {
            let cell = longest / cells;
            let exact = cloth.as_ref().and_then(|_| known(shape, cell));
            let (mesh, materials) =
                exact.map_or_else(|| triangles(shape, cell), |mesh| materials_of(mesh, shape));
            check(name, &mesh, &materials, visuals)?;
            let mut level = bake(&mesh, &materials, visuals, cell as f32, Some(shape));
            let texel = PRINT * (CELLS[0] / cells) as f32;
            if let Some(cloth) = &cloth {
                uv_atlas::wrap(&mut level, &mut facets, cloth, texel);
            }
            if !levels.is_empty() && level.plain {
                // Print needs a texel a pixel.
                let least = if cloth.is_some() { FLAW_PIXELS * texel } else { 0.0 };
                level.flaw = flaw(&mesh, shape, cell).max(least);
            }
            levels.push(level);
            if matches!(shape, Shape::Mesh(_)) {
                break;
            }
        }
        Ok(Self { levels, facets })
    }

    /// The drawn form of triangles, closed or not, seen from their counter-clockwise side. `materials` is the visual of
    /// each triangle, or empty for the first. Normals are computed; patterns need no texture coordinates, since they
    /// are functions of the object frame.
    ///
    /// # Errors
    /// If the mesh is empty, not finite, or names a vertex or visual that is not there.
    pub fn of_mesh(
        name: &str,
        mesh: &Mesh,
        materials: &[u16],
        visuals: &[Visual],
    ) -> Result<Self, CameraError> {
        let materials = if materials.is_empty() { vec![0; mesh.triangles.len()] } else { materials.to_vec() };
        check(name, mesh, &materials, visuals)?;
        let mesh =
            Mesh { vertices: mesh.vertices.clone(), triangles: mesh.triangles.clone(), uvs: Vec::new() };
        let patterned = materials.iter().any(|&m| !visuals[m as usize].layers.is_empty());
        let longest = extent(&mesh.vertices).max();
        if patterned && texture_chart::worth_it(&mesh, visuals.iter().any(pattern::printed)) {
            let (level, facets) = texture_chart::bake(&mesh, &materials, visuals);
            return Ok(Self { levels: vec![level], facets });
        }
        let (mesh, materials, edge) =
            if patterned { cut(mesh, materials, longest * FINEST_CUT) } else { (mesh, materials, longest) };
        let spacing = edge.min(longest) as f32;
        Ok(Self { levels: vec![bake(&mesh, &materials, visuals, spacing, None)], facets: Vec::new() })
    }

    /// The same, moved by the nodes of a soft body.
    ///
    /// # Errors
    /// If part of the surface lies more than two voxels outside of the mesh.
    pub fn embedded(mut self, name: &str, mesh: &VoxelMesh) -> Result<Self, CameraError> {
        for level in &mut self.levels {
            let place = |p: &V3| {
                let at: Embedding = mesh.locate(&p.cast())?;
                Some((mesh.elements[at.element as usize], at.weights().map(|w| w as f32)))
            };
            let places: Option<Vec<_>> = level.positions.iter().map(place).collect();
            level.embedding = places.ok_or_else(|| CameraError::RenderMesh {
                name: name.to_owned(),
                reason: "its surface lies outside of its voxel mesh; build both from one shape".to_owned(),
            })?;
        }
        Ok(self)
    }

    /// How many triangles the finest level has.
    pub fn triangles(&self) -> usize {
        self.levels.first().map_or(0, |level| level.triangles.len())
    }
}

pub(crate) fn check(
    name: &str,
    mesh: &Mesh,
    materials: &[u16],
    visuals: &[Visual],
) -> Result<(), CameraError> {
    let wrong = |reason: String| Err(CameraError::RenderMesh { name: name.to_owned(), reason });
    if let Err(error) = mesh.validate() {
        return wrong(error.to_string());
    }
    if mesh.triangles.len() >= 1 << TRIANGLE_BITS {
        let most = (1 << TRIANGLE_BITS) - 1;
        return wrong(format!(
            "{} triangles; at most {most} can be drawn, simplify it",
            mesh.triangles.len()
        ));
    }
    if materials.len() != mesh.triangles.len() {
        return wrong(format!(
            "{} material ids for {} triangles; give one a triangle",
            materials.len(),
            mesh.triangles.len()
        ));
    }
    match materials.iter().find(|&&m| m as usize >= visuals.len()) {
        Some(m) => wrong(format!("material {m} has no visual; there are {} (from 0)", visuals.len())),
        None => Ok(()),
    }
}

fn extent(points: &[Vec3]) -> Vec3 {
    let low = points.iter().fold(Vec3::repeat(f64::MAX), |b, p| b.inf(p));
    points.iter().fold(Vec3::repeat(f64::MIN), |b, p| b.sup(p)) - low
}

/// The triangles of a box, wherever it is placed, or of several; `None` for other shapes, whose surfaces are curved.
pub fn flat_faces(shape: &Shape) -> Option<Mesh> {
    match shape {
        Shape::Box { half } => Some(box_mesh(half)),
        Shape::Placed { shape, pose } => {
            let mut mesh = flat_faces(shape)?;
            mesh.vertices
                .iter_mut()
                .for_each(|v| *v = pose * nalgebra::Point3::from(*v) - nalgebra::Point3::origin());
            Some(mesh)
        }
        Shape::Union(parts) => {
            let mut whole = Mesh { vertices: Vec::new(), triangles: Vec::new(), uvs: Vec::new() };
            for part in parts {
                let mesh = flat_faces(part)?;
                let first = whole.vertices.len() as u32;
                whole.vertices.extend(mesh.vertices);
                whole.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
            }
            Some(whole)
        }
        _ => None,
    }
}

/// Triangles about `cell` (m) wide on a shape, and their materials.
fn triangles(shape: &Shape, cell: f64) -> (Mesh, Vec<u16>) {
    let Some(profile) = revolved(shape) else {
        let skin = SurfaceMesh::from_shape(shape, cell);
        return (skin.mesh, skin.materials);
    };
    materials_of(lathed(profile, cell), shape)
}

/// A mesh with the materials that a shape has there.
fn materials_of(mesh: Mesh, shape: &Shape) -> (Mesh, Vec<u16>) {
    let middle = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]).iter().sum::<Vec3>() / 3.0;
    let materials = mesh.triangles.iter().map(|t| shape.material(&middle(t))).collect();
    (mesh, materials)
}

/// The profile of a shape that is one of revolution where it stands, painted or not.
fn revolved(shape: &Shape) -> Option<&Polygon> {
    match shape {
        Shape::Lathe(profile) => Some(profile),
        Shape::Paint { shape, .. } => revolved(shape),
        _ => None,
    }
}

/// A box about the origin with these half extents, m.
pub fn box_mesh(half: &Vec3) -> Mesh {
    let corner =
        |c: usize| Vec3::from_fn(|axis, _| if c >> axis & 1 == 1 { half[axis] } else { -half[axis] });
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    Mesh { vertices: (0..8).map(corner).collect(), triangles, uvs: Vec::new() }
}

/// Cuts the longest edges of triangles in halves, both neighbours alike, until none is longer than `edge` or there are
/// many triangles. Also returns the edge reached.
fn cut(mut mesh: Mesh, mut materials: Vec<u16>, edge: f64) -> (Mesh, Vec<u16>, f64) {
    let mut reached = edge;
    loop {
        let length = |a: u32, b: u32| (mesh.vertices[a as usize] - mesh.vertices[b as usize]).norm();
        let long = |t: &[u32; 3]| (0..3).any(|i| length(t[i], t[(i + 1) % 3]) > edge);
        if !mesh.triangles.iter().any(long) {
            return (mesh, materials, reached);
        }
        if 4 * mesh.triangles.len() > MOST_CUT {
            reached =
                mesh.triangles.iter().map(|t| length(t[0], t[1])).sum::<f64>() / mesh.triangles.len() as f64;
            return (mesh, materials, reached);
        }
        let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
        for t in &mesh.triangles {
            let [ab, bc, ca] = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    mesh.vertices.push(0.5 * (mesh.vertices[a as usize] + mesh.vertices[b as usize]));
                    mesh.vertices.len() as u32 - 1
                })
            });
            triangles.extend([[t[0], ab, ca], [ab, t[1], bc], [ca, bc, t[2]], [ab, bc, ca]]);
        }
        mesh.triangles = triangles;
        materials = materials.iter().flat_map(|&m| [m; 4]).collect();
    }
}

/// How far the middles of triangles are from the surface that they stand for, m: root of the mean square. What lies deeper
/// than a cell is hidden by another part.
fn flaw(mesh: &Mesh, shape: &Shape, cell: f64) -> f32 {
    let middle = |t: &[u32; 3]| t.iter().map(|&v| mesh.vertices[v as usize]).sum::<Vec3>() / 3.0;
    let gaps = mesh.triangles.iter().map(|t| shape.distance(&middle(t))).filter(|gap| gap.abs() < cell);
    let squares: f64 = gaps.map(|gap| gap * gap).sum();
    (squares / mesh.triangles.len().max(1) as f64).sqrt() as f32
}

/// Splits vertices at creases, evaluates looks at them and raises their drawn relief.
pub(crate) fn bake(
    mesh: &Mesh,
    materials: &[u16],
    visuals: &[Visual],
    spacing: f32,
    shape: Option<&Shape>,
) -> Lod {
    let points: Vec<V3> = mesh.vertices.iter().map(|v| v.cast()).collect();
    let (of, triangles) = split(&points, &mesh.triangles);
    let mut positions: Vec<V3> = of.iter().map(|&v| points[v as usize]).collect();
    let mut normals = vec![V3::zeros(); of.len()];
    accumulate(&positions, &triangles, &mut normals);
    // Material of a vertex: the blend over the triangles around it, by their number.
    let mut around: Vec<Vec<u16>> = vec![Vec::new(); of.len()];
    for (t, &m) in triangles.iter().zip(materials) {
        t.iter().for_each(|&v| around[v as usize].push(m));
    }
    let mut looks = Vec::with_capacity(of.len());
    let mut raised = vec![0.0; of.len()];
    let mut known: BTreeMap<u32, (MaterialSample, f32)> = BTreeMap::new();
    let reach = 0.12 * extent(&mesh.vertices).max();
    for (i, p) in positions.iter().enumerate() {
        let normal = normals[i];
        let (look, height) = *known.entry(of[i]).or_insert_with(|| {
            let border = around[i].iter().any(|&m| m != around[i][0]);
            let materials = match shape {
                Some(shape) if border => materials_near(shape, p, &normal, spacing),
                _ => around[i].clone(),
            };
            let (mut look, height) = blend(&materials, visuals, (p, &normal), spacing);
            look.open = shape.map_or(1.0, |shape| openness(shape, p, &normal, reach));
            (look, height)
        });
        looks.push(look);
        raised[i] = height;
    }
    if raised.iter().any(|&h| h != 0.0) {
        positions.iter_mut().zip(&normals).zip(&raised).for_each(|((p, n), h)| *p += n * *h);
        accumulate(&positions, &triangles, &mut normals);
    }
    let same = |a: &MaterialSample, b: &MaterialSample| {
        a.albedo == b.albedo && a.roughness == b.roughness && a.metalness == b.metalness
    };
    Lod {
        plain: looks.iter().all(|look| same(look, &looks[0])),
        flaw: 0.0,
        patches: patches(&triangles, positions.len()),
        positions,
        normals,
        looks,
        triangles,
        facets: Vec::new(),
        places: Vec::new(),
        embedding: Vec::new(),
        spacing,
    }
}

/// Material ids at points spread evenly over the surface around `p`, a little farther than half the way to the next
/// vertices: their shares change smoothly across a border, whatever the triangles there look like.
fn materials_near(shape: &Shape, p: &V3, n: &V3, spacing: f32) -> Vec<u16> {
    const STEPS: i32 = 2;
    let side = if n.z.abs() < 0.9 { V3::z() } else { V3::x() };
    let [u, v] = basis_from_reference(n, &side);
    let step = 0.7 * spacing / STEPS as f32;
    let at = |i: i32, j: i32| p + u * (i as f32 * step) + v * (j as f32 * step);
    (-STEPS..=STEPS)
        .flat_map(|i| (-STEPS..=STEPS).map(move |j| at(i, j)))
        .map(|q| shape.material(&q.cast()))
        .collect()
}

fn blend(materials: &[u16], visuals: &[Visual], (p, n): (&V3, &V3), spacing: f32) -> (MaterialSample, f32) {
    let mut sum: Option<(MaterialSample, f32)> = None;
    let share = 1.0 / materials.len().max(1) as f32;
    let mut sorted = materials.to_vec();
    sorted.sort_unstable();
    for run in sorted.chunk_by(|a, b| a == b) {
        let (look, height) = pattern::look(&visuals[run[0] as usize], p, n, spacing);
        let part = share * run.len() as f32;
        let scaled = MaterialSample {
            albedo: look.albedo * part,
            roughness: look.roughness * part,
            metalness: look.metalness * part,
            open: 1.0,
        };
        sum = Some(match sum {
            None => (scaled, height * part),
            Some((s, h)) => (
                MaterialSample {
                    albedo: s.albedo + scaled.albedo,
                    roughness: s.roughness + scaled.roughness,
                    metalness: s.metalness + scaled.metalness,
                    open: 1.0,
                },
                h + height * part,
            ),
        });
    }
    sum.unwrap_or_else(|| pattern::look(&Visual::default(), p, n, spacing))
}

/// Share of the sky that the object itself leaves open, from its distance field along the normal (Evans, Fast
/// Approximations for Global Illumination on Dynamic Scenes, SIGGRAPH course 2006).
fn openness(shape: &Shape, p: &V3, n: &V3, reach: f64) -> f32 {
    let (p, n): (Vec3, Vec3) = (p.cast(), n.cast());
    let hidden: f64 = (1..=4)
        .map(|i| {
            let h = reach * f64::from(i) / 4.0;
            (1.0 - shape.distance(&(p + n * h)) / h).clamp(0.0, 1.0) * 0.5_f64.powi(i)
        })
        .sum();
    (1.0 - 1.1 * hidden).clamp(0.15, 1.0) as f32
}

/// One vertex for each smooth group of triangles around each vertex: the vertex each came from, and the triangles.
pub(crate) fn split(points: &[V3], triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[u32; 3]>) {
    let facing: Vec<V3> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(V3::z)
        })
        .collect();
    let mut corners: Vec<Vec<(u32, u8)>> = vec![Vec::new(); points.len()];
    for (t, triangle) in triangles.iter().enumerate() {
        (0..3).for_each(|i| corners[triangle[i] as usize].push((t as u32, i as u8)));
    }
    let (mut of, mut out) = (Vec::new(), triangles.to_vec());
    for (v, corners) in corners.iter().enumerate() {
        let mut group: Vec<usize> = (0..corners.len()).collect();
        for i in 0..corners.len() {
            for j in 0..i {
                let alike = facing[corners[i].0 as usize].dot(&facing[corners[j].0 as usize]) > CREASE;
                if alike && group[i] != group[j] {
                    let (from, to) = (group[i].max(group[j]), group[i].min(group[j]));
                    group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
                }
            }
        }
        let mut made: BTreeMap<usize, u32> = BTreeMap::new();
        for (group, &(t, i)) in group.iter().zip(corners) {
            let index = *made.entry(*group).or_insert_with(|| {
                of.push(v as u32);
                of.len() as u32 - 1
            });
            out[t as usize][i as usize] = index;
        }
    }
    (of, out)
}

/// Numbers the sets of triangles that hang together by vertices.
fn patches(triangles: &[[u32; 3]], vertices: usize) -> Vec<u32> {
    let mut connected = UnionFind::new(vertices);
    for &[a, b, c] in triangles {
        connected.union(a as usize, b as usize);
        connected.union(a as usize, c as usize);
    }
    triangles.iter().map(|t| connected.find(t[0] as usize) as u32).collect()
}

/// Unit normals of vertices: the sum of the area normals of the triangles around.
pub(crate) fn accumulate(positions: &[V3], triangles: &[[u32; 3]], normals: &mut [V3]) {
    normals.fill(V3::zeros());
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let area = (b - a).cross(&(c - a));
        t.iter().for_each(|&v| normals[v as usize] += area);
    }
    for n in normals {
        let length = n.norm();
        *n = if length > 0.0 { *n / length } else { V3::z() };
    }
}
