//! Overlaps of the closed pieces of a mesh, whose common part would count twice in volume and mass.

use std::collections::BTreeMap;

use parry3d_f64::{
    query::{PointQuery, Ray, RayCast},
    shape::{TriMesh, TriMeshFlags},
};

use super::{
    Aabb, Vec3,
    aabb::{GroupedAabb, overlapping_pairs},
    mesh::{Mesh, MeshError},
    parry::{from_parry, to_parry},
    union_find::UnionFind,
};

/// Share of an edge, and of the size of the mesh, within which a crossing is a touch.
const ROUNDING: f64 = 1e-6;

/// A closed piece of a mesh.
struct Piece {
    /// Its triangles, facing outwards.
    mesh: Mesh,
    bounds: Aabb,
    /// True if the triangles faced inwards: it is the wall of a cavity.
    is_cavity: bool,
    tree: TriMesh,
    /// Distance from the surface within which a point is on it, m.
    rounding: f64,
}

/// Location of a piece in another one.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Inside,
    Outside,
    Across,
}

impl Piece {
    /// `None` for a sheet, which has no volume to count twice.
    fn new(mut mesh: Mesh, rounding: f64) -> Option<Self> {
        if mesh.is_flat() {
            return None;
        }
        let is_cavity = mesh.volume() < 0.0;
        if is_cavity {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let bounds = Aabb::from_points(&mesh.vertices)?;
        let points = mesh.vertices.iter().map(to_parry).collect();
        let tree = TriMesh::with_flags(points, mesh.triangles.clone(), TriMeshFlags::ORIENTED).ok()?;
        Some(Self { mesh, bounds, is_cavity, tree, rounding })
    }

    /// Corners of a triangle, moved inwards by twice the rounding, and by as much from its edges: where surfaces
    /// coincide, they are inside of both pieces or of one.
    fn inset(&self, triangle: &[u32; 3]) -> [Vec3; 3] {
        let corners = triangle.map(|v| self.mesh.vertices[v as usize]);
        let [a, b, c] = corners;
        let edges = [(c - b).norm(), (a - c).norm(), (b - a).norm()];
        let (perimeter, normal) = (edges.iter().sum::<f64>(), (b - a).cross(&(c - a)));
        let incentre = (a * edges[0] + b * edges[1] + c * edges[2]) / perimeter;
        let share = (2.0 * self.rounding * perimeter / normal.norm()).min(0.5);
        let depth = normal.try_normalize(0.0).unwrap_or_default() * (2.0 * self.rounding);
        corners.map(|corner| corner + (incentre - corner) * share - depth)
    }

    /// Location of this piece in another one, from edges just below its surface.
    fn place_in(&self, other: &Self) -> Place {
        let (mut inside, mut outside) = (false, false);
        for triangle in &self.mesh.triangles {
            let corners = self.inset(triangle);
            let is_near = Aabb::from_points(&corners).is_some_and(|bounds| bounds.intersects(&other.bounds));
            if !is_near && outside {
                continue;
            }
            let mut note = |p: Vec3| {
                let found = match other.side(&p) {
                    Some(true) => &mut inside,
                    Some(false) => &mut outside,
                    None => return,
                };
                // Below an edge of a sharp angle it may have left this piece.
                *found = *found || self.side(&p) == Some(true);
            };
            for (i, from) in corners.into_iter().enumerate() {
                let along = corners[(i + 1) % 3] - from;
                let at = |share: f64| from + along * share;
                let hit_after = |share: f64| {
                    let ray = Ray::new(to_parry(&at(share)), to_parry(&along));
                    other.tree.cast_local_ray(&ray, 1.0 - share, false).map(|on| share + on)
                };
                let mut last = 0.0;
                while let Some(hit) = hit_after(last + ROUNDING) {
                    note(at(0.5 * (last + hit)));
                    last = hit;
                }
                // Edges without a hit are where the first one is.
                if last > 0.0 || i == 0 {
                    note(at(0.5 * (last + 1.0)));
                }
            }
            if inside && outside {
                return Place::Across;
            }
        }
        if inside { Place::Inside } else { Place::Outside }
    }

    /// True if a point is inside; `None` on the surface.
    fn side(&self, p: &Vec3) -> Option<bool> {
        if !self.bounds.loosened(self.rounding).contains(p) {
            return Some(false);
        }
        let found = self.tree.project_local_point(to_parry(p), false);
        let distance = (from_parry(found.point) - p).norm();
        (distance > self.rounding).then_some(found.is_inside)
    }
}

/// Checks that no point of space is inside of two pieces of a closed mesh, or of a cavity in nothing. Pieces share no
/// vertex. `mesh` faces outwards on the whole.
///
/// # Errors
/// [`MeshError::Overlap`] if one is.
pub(crate) fn check_pieces(mesh: &Mesh) -> Result<(), MeshError> {
    let mut sets = UnionFind::new(mesh.vertices.len());
    for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|v| v as usize)) {
        sets.union(a, b);
        sets.union(b, c);
    }
    let mut of_piece: BTreeMap<usize, Vec<[u32; 3]>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        of_piece.entry(sets.find(triangle[0] as usize)).or_default().push(*triangle);
    }
    if of_piece.len() < 2 {
        return Ok(());
    }
    let farthest = mesh.vertices.iter().map(|v| v.amax()).fold(0.0, f64::max);
    let piece = |triangles: Vec<_>| Piece::new(mesh.submesh(&triangles), ROUNDING * farthest);
    let pieces: Vec<Piece> = of_piece.into_values().filter_map(piece).collect();
    let boxes = pieces.iter().zip(0..).map(|(piece, group)| GroupedAabb { bounds: piece.bounds, group });
    let pairs = overlapping_pairs(&boxes.collect::<Vec<_>>());
    // Number of solids around each piece, minus that of cavities.
    let mut around = vec![0; pieces.len()];
    for (i, j) in pairs {
        let orders = [(i, j), (j, i)];
        let places = orders.map(|(inner, outer)| pieces[inner].place_in(&pieces[outer]));
        // A solid may touch a cavity from within, and a cavity a solid: the outer one then has points in the other.
        let touches = pieces[i].is_cavity != pieces[j].is_cavity && places.contains(&Place::Inside);
        if places.contains(&Place::Across) && !touches {
            return Err(MeshError::Overlap);
        }
        for ((inner, outer), _) in orders.into_iter().zip(places).filter(|(_, place)| *place == Place::Inside)
        {
            around[inner] += if pieces[outer].is_cavity { -1 } else { 1 };
        }
    }
    let is_odd = |(piece, around): (&Piece, &i32)| *around != i32::from(piece.is_cavity);
    if pieces.iter().zip(&around).any(is_odd) { Err(MeshError::Overlap) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with triangles that face outwards, or inwards.
    fn cuboid(centre: [f64; 3], size: [f64; 3], faces_inwards: bool) -> Mesh {
        let corner =
            |i: usize| Vec3::from_fn(|axis, _| centre[axis] + size[axis] * ((i >> axis & 1) as f64 - 0.5));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut triangles: Vec<[u32; 3]> =
            quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        if faces_inwards {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Mesh { vertices: (0..8).map(corner).collect(), triangles, uvs: Vec::new() }
    }

    fn check(parts: &[Mesh]) -> Result<(), MeshError> {
        let mut all = Mesh::default();
        for part in parts {
            let base = all.vertices.len() as u32;
            all.vertices.extend(&part.vertices);
            all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + base)));
        }
        let all = all.welded();
        assert!(all.validate_closed().is_ok() && all.volume() > 0.0);
        check_pieces(&all)
    }

    #[test]
    fn pieces_that_count_a_point_twice_are_refused_and_cavities_are_not() {
        let block = cuboid([0.0; 3], [0.04, 0.03, 0.03], false);
        let overlap = Err(MeshError::Overlap);
        assert_eq!(check(std::slice::from_ref(&block)), Ok(()));
        assert_eq!(check(&[block.clone(), cuboid([0.03, 0.0, 0.0], [0.04, 0.018, 0.018], false)]), overlap);
        let rod = cuboid([0.001, 0.001, 0.0], [0.01, 0.01, 0.1], false);
        assert_eq!(check(&[block.clone(), rod]), overlap, "no corner is inside of the other");
        assert_eq!(check(&[block.clone(), cuboid([0.0; 3], [0.03, 0.02, 0.02], false)]), overlap, "nested");
        let cavity = cuboid([0.0; 3], [0.03, 0.02, 0.02], true);
        assert_eq!(check(&[block.clone(), cavity.clone()]), Ok(()));
        let kernel = cuboid([0.0; 3], [0.01; 3], false);
        assert_eq!(check(&[block.clone(), cavity, kernel]), Ok(()), "a piece inside of the cavity");
        assert_eq!(
            check(&[block.clone(), cuboid([0.1, 0.0, 0.0], [0.01; 3], true)]),
            overlap,
            "a cavity in nothing"
        );
        assert_eq!(check(&[block.clone(), cuboid([0.05, 0.0, 0.0], [0.01; 3], false)]), Ok(()), "apart");
        assert_eq!(check(&[block, cuboid([0.001, 0.002, 0.02], [0.01; 3], false)]), Ok(()), "on its face");
    }

    /// Checks the answer for pieces, also when they are turned, so that coinciding sides differ by rounding.
    fn check_turned(what: &str, parts: &[Mesh], expected: Result<(), MeshError>) {
        let turn = nalgebra::Rotation3::from_scaled_axis(Vec3::new(0.3, 0.5, 0.7));
        let turned =
            |part: &Mesh| Mesh { vertices: part.vertices.iter().map(|p| turn * p).collect(), ..part.clone() };
        assert_eq!(check(parts), expected, "{what}");
        assert_eq!(check(&parts.iter().map(turned).collect::<Vec<_>>()), expected, "{what}, turned");
    }

    #[test]
    fn pieces_that_overlap_are_refused_where_their_sides_coincide() {
        let refused = |what: &str, one: Mesh, other: Mesh| {
            check_turned(what, &[one, other], Err(MeshError::Overlap));
        };
        let solid = |x: f64, size: [f64; 3]| cuboid([x, 0.0, 0.0], size, false);
        let cube = || solid(0.0, [0.02; 3]);
        refused("bars in line", solid(-0.01, [0.03, 0.02, 0.02]), solid(0.01, [0.03, 0.02, 0.02]));
        refused("a bar in a longer one", solid(0.0, [0.05, 0.02, 0.02]), solid(0.0, [0.03, 0.02, 0.02]));
        refused("a copy moved by 10 µm", cube(), solid(1e-5, [0.02; 3]));
        refused("a copy moved along the diagonal", cube(), cuboid([1e-5; 3], [0.02; 3], false));
        refused("bars across", solid(0.0, [0.1, 0.02, 0.02]), solid(0.0, [0.02, 0.1, 0.02]));
        refused("a corner of 10 µm", cube(), cuboid([0.01999; 3], [0.02; 3], false));
        refused("a slab of 10 µm", cube(), solid(0.01999, [0.02; 3]));
        refused("one side from within", cube(), solid(0.005, [0.01; 3]));
        refused("a bar across, flush at its ends", cube(), solid(0.0, [0.02, 0.01, 0.01]));
        let cavity = cuboid([0.0; 3], [0.01; 3], true);
        let larger = solid(0.0, [0.01002, 0.00998, 0.00998]);
        assert_eq!(
            check(&[cube(), cavity.clone(), larger]),
            Err(MeshError::Overlap),
            "a kernel 10 µm larger"
        );
        assert_eq!(
            check(&[cube(), cavity, solid(0.006, [0.01; 3])]),
            Err(MeshError::Overlap),
            "out of its cavity"
        );
    }

    #[test]
    fn pieces_that_touch_are_accepted() {
        let accepted = |what: &str, parts: &[Mesh]| check_turned(what, parts, Ok(()));
        let solid = |x: f64, size: [f64; 3]| cuboid([x, 0.0, 0.0], size, false);
        let cube = || solid(0.0, [0.02; 3]);
        accepted("a smaller face", &[cube(), solid(0.015, [0.01; 3])]);
        accepted("a longer face", &[cube(), solid(0.015, [0.01, 0.03, 0.02])]);
        accepted("faces that overlap in part", &[cube(), cuboid([0.02, 0.005, 0.005], [0.02; 3], false)]);
        accepted("rounded coordinates", &[cube(), solid(0.02 - 1e-9, [0.02, 0.015, 0.015])]);
        accepted("an edge on a face", &[cube(), cuboid([0.02, 0.02, 0.0], [0.02, 0.02, 0.01], false)]);
        let cavity = |x: f64, edge: f64| cuboid([x, 0.0, 0.0], [edge; 3], true);
        accepted("a cavity at a side", &[cube(), cavity(0.005, 0.01)]);
        accepted("a kernel at a side of its cavity", &[cube(), cavity(0.0, 0.01), solid(0.003, [0.004; 3])]);
        accepted("a kernel 10 µm smaller", &[cube(), cavity(0.0, 0.01), solid(0.0, [0.00998; 3])]);
    }
}
