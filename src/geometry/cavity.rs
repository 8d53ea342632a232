//! The cavity of a container: the space in which its shape holds water.

use super::{Aabb, Vec3, shape::Shape, union_find::UnionFind};

/// Cells of the grid along the longest side of a shape.
const CELLS: f64 = 64.0;
/// Volume of a pool, as a share of the largest, below which it is a dent of the surface and not part of the cavity.
const MIN_SHARE: f64 = 0.1;

/// Box around the cavity of an upright shape (z up), object frame: the space in which the shape holds water, from wall
/// to wall and from the floor to the top of the shape. `None` if the shape holds none.
///
/// A cell of a grid holds water if it is free, cannot be left sideways at its own height, and has solid or water below.
/// Gaps narrower than a cell, 1/64 of the longest side, count as closed.
///
/// ```
/// use softvt_geometry::{Vec3, cavity::cavity, shape::Shape};
///
/// let cuboid = |size: [f64; 3], z| Shape::cuboid(Vec3::from(size)).translated(Vec3::z() * z);
/// let tray = cuboid([0.2, 0.1, 0.05], 0.025).subtract(cuboid([0.18, 0.08, 0.05], 0.035));
/// let space = cavity(&tray).expect("a cavity");
/// assert!((space.min - Vec3::new(-0.09, -0.04, 0.01)).norm() < 1e-9);
/// assert!((space.max - Vec3::new(0.09, 0.04, 0.05)).norm() < 1e-9);
/// assert_eq!(cavity(&tray.rotated(softvt_geometry::Quat::from_axis_angle(&Vec3::x_axis(), 3.1416))), None);
/// ```
pub fn cavity(shape: &Shape) -> Option<Aabb> {
    let bounds = shape.bounds();
    let grid = Grid::new(&bounds)?;
    let free: Vec<bool> =
        (0..grid.len()).map(|cell| shape.distance(&grid.centre(cell)) > 0.5 * grid.edge).collect();
    let mut held = vec![false; grid.len()];
    for z in 0..grid.count[2] {
        hold_slice(&grid, &free, &mut held, z);
    }
    let pools = pools(&grid, &held);
    let largest = pools.iter().map(Vec::len).max()?;
    let cells = pools.iter().filter(|pool| pool.len() as f64 >= MIN_SHARE * largest as f64).flatten();
    let [nx, ny, _] = grid.count;
    // A cell that holds water is neither at a side nor at the bottom.
    let borders = |cell: &&usize| {
        [**cell - 1, **cell + 1, **cell - nx, **cell + nx, **cell - nx * ny].iter().any(|&next| !free[next])
    };
    // The largest free ball about a cell reaches to the nearest wall.
    let balls = cells.filter(borders).map(|&cell| {
        let (centre, radius) = (grid.centre(cell), shape.distance_and_normal(&grid.centre(cell)).0);
        Aabb { min: centre, max: centre }.loosened(radius)
    });
    let space = balls.reduce(|a, b| a.merged(&b))?;
    let max = Vec3::new(space.max.x.min(bounds.max.x), space.max.y.min(bounds.max.y), bounds.max.z);
    Some(Aabb { min: space.min.sup(&bounds.min), max })
}

/// A grid of cubic cells over a box.
struct Grid {
    min: Vec3,
    edge: f64,
    count: [usize; 3],
}

impl Grid {
    fn new(bounds: &Aabb) -> Option<Self> {
        let size = bounds.size();
        let edge = size.max() / CELLS;
        if !(edge > 0.0 && edge.is_finite()) {
            return None;
        }
        let count = [size.x, size.y, size.z].map(|side| (side / edge).ceil().max(1.0) as usize);
        // Centred, so that a symmetric shape has a symmetric grid.
        let half = 0.5 * edge * Vec3::new(count[0] as f64, count[1] as f64, count[2] as f64);
        Some(Self { min: bounds.centre() - half, edge, count })
    }

    fn len(&self) -> usize {
        self.count.iter().product()
    }

    fn slice_len(&self) -> usize {
        self.count[0] * self.count[1]
    }

    fn centre(&self, cell: usize) -> Vec3 {
        let [nx, ny, _] = self.count;
        let index = Vec3::new((cell % nx) as f64, (cell / nx % ny) as f64, (cell / (nx * ny)) as f64);
        self.min + self.edge * index.add_scalar(0.5)
    }

    fn is_at_side(&self, cell: usize) -> bool {
        let [nx, ny, _] = self.count;
        let (x, y) = (cell % nx, cell / nx % ny);
        x == 0 || x + 1 == nx || y == 0 || y + 1 == ny
    }

    /// The neighbours of a cell in +x and +y, if they exist.
    fn next_in_slice(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let [nx, ny, _] = self.count;
        let (x, y) = (cell % nx, cell / nx % ny);
        [(x + 1 < nx).then_some(cell + 1), (y + 1 < ny).then_some(cell + nx)].into_iter().flatten()
    }
}

/// Marks the cells of slice `z` that hold water; the slices below are marked already.
fn hold_slice(grid: &Grid, free: &[bool], held: &mut [bool], z: usize) {
    let (start, len) = (z * grid.slice_len(), grid.slice_len());
    let mut areas = UnionFind::new(len);
    for cell in (start..start + len).filter(|&cell| free[cell]) {
        for next in grid.next_in_slice(cell).filter(|&next| free[next]) {
            areas.union(cell - start, next - start);
        }
    }
    let mut leaks = vec![false; len];
    for cell in (start..start + len).filter(|&cell| free[cell]) {
        let rests = z > 0 && (!free[cell - len] || held[cell - len]);
        if grid.is_at_side(cell) || !rests {
            leaks[areas.find(cell - start)] = true;
        }
    }
    for cell in (start..start + len).filter(|&cell| free[cell]) {
        held[cell] = !leaks[areas.find(cell - start)];
    }
}

/// The connected pools of the cells that hold water.
fn pools(grid: &Grid, held: &[bool]) -> Vec<Vec<usize>> {
    let mut sets = UnionFind::new(held.len());
    for cell in (0..held.len()).filter(|&cell| held[cell]) {
        let above = Some(cell + grid.slice_len()).filter(|above| *above < held.len());
        for next in grid.next_in_slice(cell).chain(above).filter(|&next| held[next]) {
            sets.union(cell, next);
        }
    }
    let mut pools = std::collections::BTreeMap::<usize, Vec<usize>>::new();
    for cell in (0..held.len()).filter(|&cell| held[cell]) {
        pools.entry(sets.find(cell)).or_default().push(cell);
    }
    pools.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Quat;

    fn cuboid(size: [f64; 3], at: [f64; 3]) -> Shape {
        Shape::cuboid(Vec3::from(size)).translated(Vec3::from(at))
    }

    /// 140 × 140 × 100 mm, with walls of 10 mm.
    fn cup() -> Shape {
        cuboid([0.14, 0.14, 0.1], [0.0, 0.0, 0.05]).subtract(cuboid([0.12, 0.12, 0.1], [0.0, 0.0, 0.062]))
    }

    fn turned(shape: Shape, angle: f64) -> Shape {
        shape.rotated(Quat::from_axis_angle(&Vec3::x_axis(), angle))
    }

    #[test]
    fn only_an_upright_cup_has_a_cavity() {
        let space = cavity(&cup()).expect("a cavity");
        assert!((space.min - Vec3::new(-0.06, -0.06, 0.012)).norm() < 1e-9, "{space:?}");
        assert!((space.max - Vec3::new(0.06, 0.06, 0.1)).norm() < 1e-9, "{space:?}");
        assert_eq!(cavity(&turned(cup(), std::f64::consts::PI)), None, "upside down");
        assert_eq!(cavity(&turned(cup(), 0.5 * std::f64::consts::PI)), None, "on its side");
    }

    #[test]
    fn blocks_rings_and_leaking_trays_hold_nothing() {
        assert_eq!(cavity(&cuboid([0.1, 0.1, 0.1], [0.0; 3])), None);
        assert_eq!(cavity(&Shape::Torus { major: 0.05, minor: 0.01 }), None);
        let hole = cuboid([0.01, 0.01, 0.1], [0.02, 0.02, 0.0]);
        assert_eq!(cavity(&cup().subtract(hole)), None, "a hole of 10 mm in the floor");
        let open = cuboid([0.1, 0.2, 0.2], [0.0, 0.1, 0.112]);
        assert_eq!(cavity(&cup().subtract(open)), None, "one wall is missing");
    }

    #[test]
    fn a_dent_beside_the_cavity_does_not_widen_it() {
        let dent = cuboid([0.01, 0.01, 0.01], [0.08, 0.0, 0.1]);
        let ledge = cuboid([0.04, 0.04, 0.1], [0.08, 0.0, 0.05]);
        let space = cavity(&cup().union(ledge.subtract(dent))).expect("a cavity");
        assert!((space.max.x - 0.06).abs() < 1e-9, "{space:?}");
    }

    #[test]
    fn a_bowl_and_a_jar_are_measured_from_wall_to_wall() {
        let ball = |radius| Shape::Sphere { radius };
        let half = ball(0.06).subtract(ball(0.055)).subtract(cuboid([0.2; 3], [0.0, 0.0, 0.1]));
        let bowl = cavity(&half).expect("a cavity");
        assert!((bowl.max.x - 0.055).abs() < 1e-3 && (bowl.min.z + 0.055).abs() < 1e-4, "{bowl:?}");
        // With a neck narrower than the body.
        let jar = ball(0.06).subtract(ball(0.055)).subtract(cuboid([0.05, 0.05, 0.1], [0.0, 0.0, 0.06]));
        assert!((cavity(&jar).expect("a cavity").max.x - 0.055).abs() < 1e-4);
    }
}
