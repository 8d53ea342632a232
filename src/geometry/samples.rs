//! Quadrature points of the surface of a soft body, embedded in its voxel mesh.
//!
//! Boxes and prisms are sampled by regular grids per face and solids of revolution by rings, with exact areas; other
//! shapes by clustering the triangles of a fine surface mesh.

use std::collections::BTreeMap;

use super::{
    Quat, Vec3,
    shape::{Polygon, Shape},
    surface_mesh::surface_triangles,
    voxel::{SurfaceSample, VoxelMesh},
};

/// Density of surface samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleSpec {
    /// Mean spacing on surfaces that a gripper can reach (|n_z| ≤ 0.7), m.
    pub grasp_spacing: f64,
    /// Mean spacing on other surfaces, m.
    pub other_spacing: f64,
}

impl Default for SampleSpec {
    /// 0.75 mm on graspable surfaces and 2 mm on others.
    fn default() -> Self {
        Self { grasp_spacing: 0.75e-3, other_spacing: 2e-3 }
    }
}

impl SampleSpec {
    /// The spacing on a surface with this normal.
    fn spacing(&self, normal: &Vec3) -> f64 {
        if normal.z.abs() <= MAX_GRASP_NZ { self.grasp_spacing } else { self.other_spacing }
    }
}

/// Largest |n_z| of surfaces that a gripper with horizontal jaws can reach.
const MAX_GRASP_NZ: f64 = 0.7;

/// A sample before embedding.
struct Patch {
    p: Vec3,
    n: Vec3,
    area: f64,
}

/// Triangles of a surface mesh that are merged into one sample.
#[derive(Default)]
struct Cluster {
    moment: Vec3,
    normals: Vec3,
    area: f64,
    /// Area of the largest triangle.
    largest_area: f64,
    /// Centroid of the largest triangle.
    largest_centre: Vec3,
}

/// Largest distance of a sample from the surface, m.
const SURFACE_TOLERANCE: f64 = 1e-4;

impl Cluster {
    fn patch(&self, shape: &Shape) -> Patch {
        let middle = self.moment / self.area;
        let on_surface = |p: &Vec3| shape.distance(p).abs() < SURFACE_TOLERANCE;
        // In a concave edge the centroid may have no surface nearby; the largest triangle is on the surface.
        let p = shape.project(&middle, self.area.sqrt()).filter(on_surface).unwrap_or(self.largest_centre);
        Patch { p, n: self.normals.normalize(), area: self.area }
    }
}

/// Samples the surface of `shape` and embeds the samples in its voxel mesh `mesh`; sorted by element.
pub fn surface_samples(shape: &Shape, mesh: &VoxelMesh, spec: &SampleSpec) -> Vec<SurfaceSample> {
    let mut samples: Vec<SurfaceSample> = exact_patches(shape, &Quat::identity(), spec)
        .unwrap_or_else(|| clustered_patches(shape, spec))
        .into_iter()
        .filter_map(|Patch { p, n, area }| Some(SurfaceSample { at: mesh.locate(&p)?, p_o: p, n_o: n, area }))
        .collect();
    samples.sort_by_key(|sample| sample.at.element);
    samples
}

/// Patches of shapes with a closed form of their surface. `turn` is the rotation of the shape in the object frame.
fn exact_patches(shape: &Shape, turn: &Quat, spec: &SampleSpec) -> Option<Vec<Patch>> {
    match shape {
        Shape::Box { half } => Some(box_patches(half, turn, spec)),
        Shape::Prism { section, half_length } => Some(prism_patches(section, *half_length, turn, spec)),
        Shape::Placed { shape, pose } => {
            let patches = exact_patches(shape, &(turn * pose.rotation), spec)?;
            let moved = |Patch { p, n, area }| Patch {
                p: pose.rotation * p + pose.translation.vector,
                n: pose.rotation * n,
                area,
            };
            Some(patches.into_iter().map(moved).collect())
        }
        Shape::Paint { shape, .. } => exact_patches(shape, turn, spec),
        _ => Some(generatrices(shape)?.iter().flat_map(|piece| piece.revolve(turn, spec)).collect()),
    }
}

/// Clusters the triangles of a surface mesh by cells of the required spacing and by the axis direction that they
/// face, so that the sides of an edge are not mixed. The area of the mesh is preserved exactly.
fn clustered_patches(shape: &Shape, spec: &SampleSpec) -> Vec<Patch> {
    let (mesh, _) = surface_triangles(shape, spec.grasp_spacing.min(spec.other_spacing));
    let mut cells: BTreeMap<(usize, [i64; 3]), Cluster> = BTreeMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let normal_area = 0.5 * (b - a).cross(&(c - a));
        let area = normal_area.norm();
        if area <= 0.0 {
            continue;
        }
        let normal = normal_area / area;
        let centre = (a + b + c) / 3.0;
        let side = 2 * normal.iamax() + usize::from(normal[normal.iamax()] > 0.0);
        let cell = centre / spec.spacing(&normal);
        let key = (side, [cell.x, cell.y, cell.z].map(|x| x.floor() as i64));
        let cluster = cells.entry(key).or_default();
        if area > cluster.largest_area {
            (cluster.largest_area, cluster.largest_centre) = (area, centre);
        }
        cluster.moment += centre * area;
        cluster.normals += normal_area;
        cluster.area += area;
    }
    cells.into_values().map(|cluster| cluster.patch(shape)).collect()
}

fn box_patches(half: &Vec3, turn: &Quat, spec: &SampleSpec) -> Vec<Patch> {
    let mut patches = Vec::new();
    for side in 0..6 {
        let axis = side / 2;
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let n = Vec3::ith(axis, if side % 2 == 0 { -1.0 } else { 1.0 });
        let spacing = spec.spacing(&(turn * n));
        let count = |k: usize| (2.0 * half[k] / spacing - 1e-9).ceil().max(1.0);
        let (rows, columns) = (count(i), count(j));
        let area = 4.0 * half[i] * half[j] / (rows * columns);
        for index in 0..(rows * columns) as usize {
            let at = |k: usize, step: usize, of: f64| half[k] * ((2 * step + 1) as f64 / of - 1.0);
            let mut p = n * half[axis];
            p[i] = at(i, index % rows as usize, rows);
            p[j] = at(j, index / rows as usize, columns);
            patches.push(Patch { p, n, area });
        }
    }
    patches
}

/// Patches of a prism: regular grids on its walls, and grids clipped to the polygon on its ends.
fn prism_patches(section: &Polygon, half_length: f64, turn: &Quat, spec: &SampleSpec) -> Vec<Patch> {
    let mut patches = Vec::new();
    for (a, b) in section.walls() {
        let span = [b[0] - a[0], b[1] - a[1]];
        let length = span[0].hypot(span[1]);
        let n = Vec3::new(span[1], 0.0, -span[0]) / length;
        let spacing = spec.spacing(&(turn * n));
        let count = |edge: f64| (edge / spacing - 1e-9).ceil().max(1.0);
        let (rows, columns) = (count(length), count(2.0 * half_length));
        for index in 0..(rows * columns) as usize {
            let share = ((index % rows as usize) as f64 + 0.5) / rows;
            let y = half_length * (((2 * (index / rows as usize)) as f64 + 1.0) / columns - 1.0);
            let p = Vec3::new(a[0] + share * span[0], y, a[1] + share * span[1]);
            patches.push(Patch { p, n, area: length * 2.0 * half_length / (rows * columns) });
        }
    }
    for side in [-1.0, 1.0] {
        let n = Vec3::y() * side;
        let place =
            |([x, z], area): ([f64; 2], f64)| Patch { p: Vec3::new(x, side * half_length, z), n, area };
        patches.extend(section.cells(spec.spacing(&(turn * n))).into_iter().map(place));
    }
    patches
}

/// A piece of the generatrix (r, z) of a surface of revolution; the outside is to its right.
enum Generatrix {
    Line { from: [f64; 2], to: [f64; 2] },
    Arc { centre: [f64; 2], radius: f64, from: f64, to: f64 },
}

fn generatrices(shape: &Shape) -> Option<Vec<Generatrix>> {
    use std::f64::consts::{FRAC_PI_2, TAU};
    let lines = |profile: &Polygon| profile.walls().map(|(from, to)| Generatrix::Line { from, to }).collect();
    match shape {
        Shape::Sphere { radius } => {
            Some(vec![Generatrix::Arc { centre: [0.0; 2], radius: *radius, from: -FRAC_PI_2, to: FRAC_PI_2 }])
        }
        Shape::Capsule { radius, half_length } => {
            let (r, h) = (*radius, *half_length);
            let mut pieces =
                vec![Generatrix::Arc { centre: [0.0, -h], radius: r, from: -FRAC_PI_2, to: 0.0 }];
            if h > 0.0 {
                pieces.push(Generatrix::Line { from: [r, -h], to: [r, h] });
            }
            pieces.push(Generatrix::Arc { centre: [0.0, h], radius: r, from: 0.0, to: FRAC_PI_2 });
            Some(pieces)
        }
        Shape::Cylinder { radius, half_height } => {
            let (r, h) = (*radius, *half_height);
            let corners = [[0.0, -h], [r, -h], [r, h], [0.0, h]];
            Some(corners.windows(2).map(|c| Generatrix::Line { from: c[0], to: c[1] }).collect())
        }
        Shape::Torus { major, minor } => {
            Some(vec![Generatrix::Arc { centre: [*major, 0.0], radius: *minor, from: 0.0, to: TAU }])
        }
        Shape::Lathe(profile) => Some(lines(profile)),
        _ => None,
    }
}

impl Generatrix {
    fn length(&self) -> f64 {
        match self {
            Self::Line { from, to } => (to[0] - from[0]).hypot(to[1] - from[1]),
            Self::Arc { radius, from, to, .. } => radius * (to - from),
        }
    }

    /// Point and outward normal in (r, z) at a share 0..=1 of the length.
    fn at(&self, share: f64) -> ([f64; 2], [f64; 2]) {
        match self {
            Self::Line { from, to } => {
                let span = [to[0] - from[0], to[1] - from[1]];
                let length = self.length();
                (
                    [from[0] + share * span[0], from[1] + share * span[1]],
                    [span[1] / length, -span[0] / length],
                )
            }
            Self::Arc { centre, radius, from, to } => {
                let (sin, cos) = (from + share * (to - from)).sin_cos();
                ([centre[0] + radius * cos, centre[1] + radius * sin], [cos, sin])
            }
        }
    }

    /// Area per radian of revolution between two shares of the length (Pappus).
    fn area(&self, start: f64, end: f64) -> f64 {
        match self {
            Self::Line { .. } => {
                0.5 * (self.at(start).0[0] + self.at(end).0[0]) * (end - start) * self.length()
            }
            Self::Arc { centre, radius, from, to } => {
                let (a, b) = (from + start * (to - from), from + end * (to - from));
                radius * (centre[0] * (b - a) + radius * (b.sin() - a.sin()))
            }
        }
    }

    /// Divides the surface of revolution into coarse patches, and those that a gripper can reach into finer ones.
    fn revolve(&self, turn: &Quat, spec: &SampleSpec) -> Vec<Patch> {
        let mut patches = Vec::new();
        let bands = (self.length() / spec.other_spacing - 1e-9).ceil().max(1.0);
        for band in 0..bands as usize {
            let (start, end) = (band as f64 / bands, (band + 1) as f64 / bands);
            let radius =
                [start, 0.5 * (start + end), end].map(|s| self.at(s).0[0]).into_iter().fold(0.0, f64::max);
            let turnaround = std::f64::consts::TAU * radius;
            let sectors = 4.0 * (turnaround / (4.0 * spec.other_spacing) - 1e-9).ceil().max(1.0);
            let width = std::f64::consts::TAU / sectors;
            for sector in 0..sectors as usize {
                let corner = [start, sector as f64 * width];
                self.cut(corner, [end - start, width], turn, spec, &mut patches);
            }
        }
        patches
    }

    /// Divides one coarse patch, from `corner` by `size` in (share of length, angle), if it is graspable.
    fn cut(&self, corner: [f64; 2], size: [f64; 2], turn: &Quat, spec: &SampleSpec, out: &mut Vec<Patch>) {
        let middle = self.patch(corner, size);
        let spacing = spec.spacing(&(turn * middle.n));
        let width = size[1] * middle.p.x.hypot(middle.p.y);
        let count = |length: f64| (length / spacing - 1e-9).ceil().max(1.0);
        let (rows, columns) = (count(size[0] * self.length()), count(width));
        let fine = [size[0] / rows, size[1] / columns];
        for index in 0..(rows * columns) as usize {
            let (row, column) = ((index / columns as usize) as f64, (index % columns as usize) as f64);
            out.push(self.patch([corner[0] + row * fine[0], corner[1] + column * fine[1]], fine));
        }
    }

    fn patch(&self, corner: [f64; 2], size: [f64; 2]) -> Patch {
        let ([r, z], [nr, nz]) = self.at(corner[0] + 0.5 * size[0]);
        let (sin, cos) = (corner[1] + 0.5 * size[1]).sin_cos();
        Patch {
            p: Vec3::new(r * cos, r * sin, z),
            n: Vec3::new(nr * cos, nr * sin, nz),
            area: size[1] * self.area(corner[0], corner[0] + size[0]),
        }
    }
}
