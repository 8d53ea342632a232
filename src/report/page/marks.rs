//! Marks that the figures of the page share: places in percent of the width, so that text does not shrink on narrow
//! screens.

use maud::{Markup, html};

use softvt_evaluation::category::EpisodeCategory;

/// Coordinate at a fraction of the width.
pub(super) fn x(fraction: f64) -> String {
    format!("{:.2}%", 100.0 * fraction.clamp(0.0, 1.0))
}

pub(super) fn y(at: f64) -> String {
    format!("{at:.1}")
}

/// Vertical lines over the full height, at fractions of the width.
pub(super) fn vertical_lines(class: &str, at: impl Iterator<Item = f64>) -> Markup {
    html! { @for at in at { line class=(class) x1=(x(at)) x2=(x(at)) y1="0" y2="100%" {} } }
}

/// Class of the colour of a category.
pub(super) fn class(category: EpisodeCategory) -> &'static str {
    match category {
        EpisodeCategory::Safe => "safe",
        EpisodeCategory::OverLimit => "over",
        EpisodeCategory::Dropped | EpisodeCategory::Slipped => "dropped",
        EpisodeCategory::GoalMissed => "missed",
        EpisodeCategory::NotJudged | EpisodeCategory::Invalid => "invalid",
    }
}

/// An episode as a mark at a place.
pub(super) fn mark(category: EpisodeCategory, at: f64, height: f64) -> Markup {
    let class = class(category);
    html! {
        @match category {
            EpisodeCategory::OverLimit => {
                svg.cross x=(x(at)) y=(y(height)) width="1" height="1" aria-hidden="true" { path class=(class) d="M-3.5-3.5 3.5 3.5M-3.5 3.5 3.5-3.5" {} }
            }
            EpisodeCategory::Dropped | EpisodeCategory::Slipped => {
                svg.cross x=(x(at)) y=(y(height)) width="1" height="1" aria-hidden="true" { path class=(class) d="M0-4.5V4M-3 1 0 4 3 1" {} }
            }
            _ => { circle class=(class) cx=(x(at)) cy=(y(height)) r="3.6" {} }
        }
    }
}

/// Key of the categories that occur among some. Rigid objects have no limit to be within.
pub(super) fn legend(is_soft: bool, occurring: impl Fn(EpisodeCategory) -> bool) -> Markup {
    let name = |category: EpisodeCategory| match category {
        EpisodeCategory::Safe if !is_soft => "placed without a drop",
        category => category.name(),
    };
    html! {
        p.legend {
            @for category in EpisodeCategory::ALL.into_iter().filter(|category| occurring(*category)) {
                span.key {
                    svg.swatch width="12" height="12" aria-hidden="true" { (mark(category, 0.5, 6.0)) }
                    (name(category))
                }
            }
        }
    }
}
