//! How large the tree of a shape is.

use super::Shape;

/// Size of a shape's tree, shared parts counted as often as they occur: what every walk of it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeSize {
    /// Shapes in it, itself included.
    pub nodes: usize,
    /// Shapes above one another, itself included.
    pub depth: usize,
    /// Primitives that one exact distance looks at, about: an intersection in an intersection is projected on anew at every
    /// step of the outer one.
    pub work: f64,
}

/// How often a combination looks at its parts near its surface: for itself, for the nearest one, and where that leads.
const LOOKS: f64 = 3.0;

impl Shape {
    /// The shapes that this one is made of.
    fn parts(&self) -> Vec<&Self> {
        match self {
            Self::Placed { shape, .. }
            | Self::Scaled { shape, .. }
            | Self::Rounded { shape, .. }
            | Self::Shell { shape, .. }
            | Self::Twist { shape, .. }
            | Self::Bend { shape, .. }
            | Self::Displace { shape, .. } => vec![shape],
            Self::Paint { shape, region, .. } => {
                [Some(shape), region.as_ref()].into_iter().flatten().map(AsRef::as_ref).collect()
            }
            Self::Subtract { from, cut } | Self::SmoothSubtract { from, cut, .. } => vec![from, cut],
            Self::Union(parts) | Self::Intersect(parts) | Self::SmoothUnion { parts, .. } => {
                parts.iter().collect()
            }
            Self::Box { .. }
            | Self::Sphere { .. }
            | Self::Ellipsoid { .. }
            | Self::Capsule { .. }
            | Self::Cylinder { .. }
            | Self::Torus { .. }
            | Self::Prism { .. }
            | Self::Lathe(_)
            | Self::Mesh(_) => Vec::new(),
        }
    }

    /// Size of its tree.
    pub fn tree_size(&self) -> TreeSize {
        let own = match self {
            Self::Displace { reliefs, .. } => reliefs.len().max(1),
            _ => 1,
        };
        let exact = matches!(self, Self::Union(_) | Self::Intersect(_) | Self::Subtract { .. });
        let sum = |sum: TreeSize, part: TreeSize| TreeSize {
            nodes: sum.nodes + part.nodes,
            depth: sum.depth.max(part.depth),
            work: sum.work + part.work,
        };
        let none = TreeSize { nodes: 0, depth: 0, work: 0.0 };
        let parts = self.parts().into_iter().map(Self::tree_size).fold(none, sum);
        let region = match self {
            Self::Paint { region: Some(region), .. } => region.tree_size().work,
            _ => 0.0,
        };
        TreeSize {
            nodes: parts.nodes + own,
            depth: parts.depth + 1,
            work: (parts.work - region).max(1.0) * if exact { LOOKS } else { 1.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn shared_parts_count_as_often_as_they_occur() {
        let size = |shape: &Shape| {
            let TreeSize { nodes, depth, .. } = shape.tree_size();
            (nodes, depth)
        };
        let ball = Shape::Sphere { radius: 0.01 };
        let pair = ball.clone().subtract(ball.clone());
        assert_eq!(size(&pair), (3, 2));
        let two = pair.clone().subtract(pair).painted(1, Some(ball.clone()));
        assert_eq!(size(&two), (9, 4));
        let row = (0..50).fold(ball.clone(), |row, _| row.union(ball.clone()));
        assert_eq!(size(&row), (52, 2));
        let moved = (0..50).fold(ball, |moved, _| moved.translated(Vec3::x()));
        assert_eq!(size(&moved), (2, 2));
    }

    #[test]
    fn cuts_in_cuts_multiply_and_one_cut_of_many_does_not() {
        let ball = Shape::Sphere { radius: 0.01 };
        let one_by_one = (0..10).fold(ball.clone(), |rest, _| rest.subtract(ball.clone()));
        let holes = (0..9).fold(ball.clone(), |holes, _| holes.union(ball.clone()));
        let at_once = ball.subtract(holes);
        assert!(one_by_one.tree_size().work > 3_f64.powi(10));
        assert!(at_once.tree_size().work < 100.0);
    }
}
