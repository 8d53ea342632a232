//! How large the tree of a shape is.

use super::Shape;

/// Size of a shape's tree, shared parts counted as often as they occur: what every walk of it costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TreeSize {
    /// Shapes in it, itself included.
    pub nodes: usize,
    /// Shapes above one another, itself included.
    pub depth: usize,
}

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
            Self::Union(parts) | Self::Intersect(parts) | Self::SmoothUnion { parts, .. } => parts.iter().collect(),
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
        let parts = self.parts().into_iter().map(Self::tree_size);
        let (nodes, depth) = parts.fold((own, 0), |(nodes, depth), part| (nodes + part.nodes, depth.max(part.depth)));
        TreeSize { nodes, depth: depth + 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn shared_parts_count_as_often_as_they_occur() {
        let ball = Shape::Sphere { radius: 0.01 };
        let pair = ball.clone().subtract(ball.clone());
        assert_eq!(pair.tree_size(), TreeSize { nodes: 3, depth: 2 });
        let two = pair.clone().subtract(pair).painted(1, Some(ball.clone()));
        assert_eq!(two.tree_size(), TreeSize { nodes: 9, depth: 4 });
        let row = (0..50).fold(ball.clone(), |row, _| row.union(ball.clone()));
        assert_eq!(row.tree_size(), TreeSize { nodes: 52, depth: 2 });
        let moved = (0..50).fold(ball, |moved, _| moved.translated(Vec3::x()));
        assert_eq!(moved.tree_size(), TreeSize { nodes: 2, depth: 2 });
    }
}
