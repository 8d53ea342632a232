//! Disjoint sets (union–find) with path halving.
//!
//! The representative of a set is its least element, whatever the order of the unions, so that numberings derived
//! from representatives are deterministic.

/// A partition of `0..len` into disjoint sets.
#[derive(Clone, Debug)]
pub struct UnionFind {
    parent: Vec<usize>,
}

impl UnionFind {
    /// `len` sets of one element each.
    pub fn new(len: usize) -> Self {
        Self { parent: (0..len).collect() }
    }

    /// The least element of the set that contains `element`.
    ///
    /// # Panics
    /// If `element` is not below the number of elements.
    pub fn find(&mut self, mut element: usize) -> usize {
        while self.parent[element] != element {
            self.parent[element] = self.parent[self.parent[element]];
            element = self.parent[element];
        }
        element
    }

    /// Merges the sets of `a` and `b`.
    ///
    /// # Panics
    /// If `a` or `b` is not below the number of elements.
    pub fn union(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_representative_is_the_least_element_whatever_the_order() {
        for pairs in [[(1, 2), (2, 4), (5, 3)], [(4, 2), (3, 5), (2, 1)]] {
            let mut sets = UnionFind::new(6);
            pairs.into_iter().for_each(|(a, b)| sets.union(a, b));
            assert_eq!([0, 1, 2, 3, 4, 5].map(|i| sets.find(i)), [0, 1, 1, 3, 1, 3]);
        }
    }
}
