//! Fields of a configuration that a plan does not read.
//!
//! A plan takes a part of the configuration and has the rest at its default. A field in which the two differ has no
//! effect.

/// Names of the fields in which two values of a type differ. The fields after a semicolon are not compared; a field
/// that is in neither list does not compile.
macro_rules! differing_fields {
    ($one:expr, $other:expr, $type:ident { $($field:ident),+ $(; $($ignored:ident),+)? }) => {{
        let $type { $($field: _,)+ $($($ignored: _,)+)? } = $one;
        let fields = [$((stringify!($field), $one.$field != $other.$field)),+];
        fields.into_iter().filter(|(_, differs)| *differs).map(|(field, _)| field).collect::<Vec<&'static str>>()
    }};
}

pub(crate) use differing_fields;
