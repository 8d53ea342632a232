//! Peak deformation by object and policy.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    path::Path,
};

use maud::{Markup, html};

use super::{
    Thumbnails, breakable,
    images::{ByteBudget, DataImage, embed, relative_link},
    marks::class,
};
use crate::{cells::tau_range, run_summary::RunSummary, task_names::object_name, video::video_path};
use softvt_common::text::decimal;
use softvt_evaluation::category::EpisodeCategory;
use softvt_runs::{
    record::EpisodeRecord,
    summary::{GroupScores, TauRange},
};

/// Largest size of all pictures of objects, bytes before they are text.
const MAX_THUMBNAIL_BYTES: usize = 70_000;
/// Edge of a picture of an object on the page, pixels.
const THUMBNAIL_EDGE: u32 = 64;

/// One matrix per suite with soft objects.
pub(super) fn matrices(runs: &[RunSummary], thumbnails: &Thumbnails, out: &Path) -> Markup {
    let soft: Vec<&RunSummary> = runs.iter().filter(|run| run.is_soft()).collect();
    let mut budget = ByteBudget(MAX_THUMBNAIL_BYTES);
    let pictures: BTreeMap<&String, DataImage> =
        thumbnails.iter().filter_map(|(asset, image)| Some((asset, embed(image, &mut budget)?))).collect();
    html! {
        @for (i, of_suite) in soft.chunk_by(|a, b| a.summary.suite == b.summary.suite).enumerate() {
            (matrix(format_args!("matrix-{i}"), of_suite, &pictures, out))
        }
    }
}

fn matrix(
    id: fmt::Arguments,
    runs: &[&RunSummary],
    pictures: &BTreeMap<&String, DataImage>,
    out: &Path,
) -> Markup {
    let assets: BTreeSet<&String> = runs.iter().flat_map(|run| run.summary.by_asset.keys()).collect();
    // Instances of one asset may have different limits.
    let tau = |asset: &str| {
        let ranges = runs.iter().filter_map(|run| run.summary.by_asset.get(asset)?.scores.tau_range);
        tau_range(ranges.reduce(|a, b| TauRange { min: a.min.min(b.min), max: a.max.max(b.max) }))
    };
    html! {
        figure.table {
            div.scroll tabindex="0" role="group" aria-labelledby=(id) {
                table.matrix aria-labelledby=(id) {
                    thead {
                        tr {
                            th.text scope="col" { "Policy" }
                            @for asset in &assets {
                                th scope="col" { (picture(pictures.get(asset))) (object_name(asset)) span.interval { @if tau(asset).is_empty() { "no τ" } @else { "τ\u{a0}" (tau(asset)) "\u{a0}%" } } }
                            }
                        }
                    }
                    tbody {
                        @for run in runs {
                            tr {
                                th.text scope="row" { (breakable(&run.method)) }
                                @for asset in &assets { (cell(run, asset, out)) }
                            }
                        }
                    }
                }
            }
            figcaption id=(id) {
                (runs[0].summary.suite) ": the category of most failed episodes with their number and the largest peak D over τ among them; without a failure, the median of peak D over τ. Cells with a video link to it."
            }
        }
    }
}

/// The picture above the name of an object, which says what it shows.
fn picture(image: Option<&DataImage>) -> Markup {
    html! { @if let Some(image) = image { img src=(image.url) width=(THUMBNAIL_EDGE) height=(THUMBNAIL_EDGE) alt=""; } }
}

fn cell(run: &RunSummary, asset: &str, out: &Path) -> Markup {
    let Some(of_asset) = run.summary.by_asset.get(asset) else { return html! { td { "–" } } };
    let scores = &of_asset.scores;
    let worst = worst_category(scores);
    let shown = shown_episode(run, asset, worst);
    let ratio = match worst {
        EpisodeCategory::Safe => scores.d_over_tau.median,
        _ => shown.and_then(EpisodeRecord::d_over_tau),
    };
    let (n, failed, crushed) = (scores.episodes, scores.count(worst), scores.crushed_over_limit);
    let is_all = crushed == failed || worst != EpisodeCategory::OverLimit;
    let video =
        shown.and_then(|record| relative_link(out, &video_path(&run.run.dir, record.header.id.index())));
    let label = html! {
        @if worst != EpisodeCategory::Safe {
            span.nobreak aria-label=(worst.name()) role="img" { (worst.glyph()) " " @if n > 1 { (failed) "/" (n) " " } }
        }
        span.nobreak { (decimal(ratio, 2)) }
        @if crushed > 0 {
            br;
            span.nobreak { @if n > 1 { (crushed) @if is_all { " " } @else { " of them " } } "crushed" }
        }
    };
    html! {
        td class=(class(worst)) {
            @match video { Some(video) => a href=(video) { (label) }, None => (label) }
        }
    }
}

/// The category of most failed episodes; safe without one.
fn worst_category(scores: &GroupScores) -> EpisodeCategory {
    let failed = EpisodeCategory::ALL.into_iter().skip(1).filter(|category| scores.count(*category) > 0);
    failed.rev().max_by_key(|category| scores.count(*category)).unwrap_or(EpisodeCategory::Safe)
}

/// The episode of a category with the largest D/τ.
fn shown_episode<'a>(
    run: &'a RunSummary,
    asset: &str,
    category: EpisodeCategory,
) -> Option<&'a EpisodeRecord> {
    let records = run.run.records.iter().filter(|r| r.header.asset == asset && r.category() == category);
    let ratio = |record: &EpisodeRecord| record.d_over_tau().unwrap_or(0.0);
    records.max_by(|a, b| ratio(a).total_cmp(&ratio(b)))
}
