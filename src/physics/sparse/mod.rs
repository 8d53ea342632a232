//! Sparse symmetric positive definite systems of 3×3 blocks, factored down to a chosen trailing set.
//!
//! A multifrontal Cholesky (Duff & Reid 1983; Liu 1992) that eliminates every node except a *kept* set, whose Schur
//! complement is then the assembled root front: exactly what a contact solve on few nodes of a large body needs.
//! [`SymbolicFactor`] depends on the pattern and the kept set only; [`CholeskyFactor`] is refilled without allocating.

pub mod dense;
mod dissection;
mod numeric;
mod symbolic;

pub use numeric::{BlockMatrix, CholeskyFactor};
pub use symbolic::SymbolicFactor;
