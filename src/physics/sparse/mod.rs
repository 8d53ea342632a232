//! Sparse Cholesky factorization of 3×3 block systems down to a Schur complement on chosen nodes.
//!
//! A multifrontal Cholesky (Duff & Reid 1983; Liu 1992) that eliminates every node except a *retained* set. The Schur
//! complement of that set is then the assembled root front: a contact solve on the few retained nodes of a large body
//! needs exactly this matrix. [`SymbolicFactor`] depends on the pattern and the retained set only; [`CholeskyFactor`]
//! is refilled with new values without allocating.
//!
//! # Why not faer
//! Its sparse Cholesky solves the complete system, and offers no partial factorization that leaves a Schur complement
//! on chosen nodes. It also selects kernels by the SIMD features of the CPU at run time, so that the last bits of a
//! result could depend on the machine. Here all sums have a fixed order, and products are added by fused
//! multiply–add, which is exactly rounded everywhere.

pub(crate) mod dense;
mod dissection;
mod numeric;
mod symbolic;

pub(crate) use numeric::{BlockMatrix, CholeskyFactor};
pub(crate) use symbolic::SymbolicFactor;

/// A matrix that has no Cholesky factor. The computed part of the factor must not be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is not positive definite")]
pub(crate) struct NotPositiveDefinite;
