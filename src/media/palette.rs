//! Colours of all outputs: those of verdicts, of Okabe and Ito's palette, and those of axes and text.
//!
//! docs/looks.md states what each colour and mark means. `report/page/page.css` and the page of `softvt watch` have the
//! same numbers.

/// A colour on light and on dark ground, as CSS has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour {
    pub light: &'static str,
    pub dark: &'static str,
}

const fn colour(light: &'static str, dark: &'static str) -> Colour {
    Colour { light, dark }
}

/// Safe, and the curve of a plot with one curve.
pub const SAFE: Colour = colour("#0072b2", "#56b4e9");
pub const OVER_LIMIT: Colour = colour("#d55e00", "#ff8a3d");
pub const DROPPED: Colour = colour("#cc79a7", "#cc79a7");
/// Goal missed, invalid, and marks next to the main ones.
pub const FAINT: Colour = colour("#6b7280", "#9aa1ab");
pub const INK: Colour = colour("#1c2024", "#e6e8eb");
pub const RULE: Colour = colour("#d5d9de", "#3a4047");
pub const GROUND: Colour = colour("#ffffff", "#16181b");
