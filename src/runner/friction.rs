//! Warnings about changes of friction that another surface hides: a pair of surfaces takes the larger coefficient.

use std::collections::BTreeSet;

use crate::suite_run::SuiteRun;
use softvt_benchmark::Task;
use softvt_common::text::{format_number, significant};
use softvt_scene::{Body, Object};
use softvt_script::EpisodeSetup;

/// Warnings about the variation and the shifts of an episode, where the friction that they set has no effect.
pub(crate) fn friction_warnings(run: &SuiteRun, task: &Task, setup: &EpisodeSetup) -> BTreeSet<String> {
    let of_variation =
        setup.nominal.objects.iter().filter_map(|object| variation_warning(run, setup, object));
    let targets = task.targets();
    let shifted = setup.scene.objects.iter().filter(|object| targets.contains(&object.name.as_str()));
    let of_shifts = shifted.filter_map(|object| {
        let before = setup.nominal.objects.iter().find(|other| other.name == object.name)?;
        shift_warning(run, before, object)
    });
    of_variation.chain(of_shifts).collect()
}

/// Warnings about friction that the layout sets without effect.
pub(crate) fn layout_friction_warnings(run: &SuiteRun, setup: &EpisodeSetup) -> BTreeSet<String> {
    setup.nominal.objects.iter().filter_map(|object| layout_warning(run, setup, object)).collect()
}

/// Coefficients that differ by less are equal.
const ROUNDING: f64 = 1e-9;

/// End of each warning: how to make a surface slippery.
const FIX: &str = "that of an asset with coated = true, or with a coating, counts in every pair";

/// Name of the surfaces of [`least_of_supports`] in warnings.
const SUPPORTS: &str = "pads and tables";

/// Smallest static coefficient of the pads and of the fixed objects, which hold and carry free ones.
fn least_of_supports(run: &SuiteRun, setup: &EpisodeSetup) -> f64 {
    let is_fixed = |object: &&Object| matches!(object.asset.body, Body::Static | Body::Articulated(_));
    let fixed = setup.nominal.objects.iter().filter(is_fixed);
    fixed.map(|object| object.asset.friction.static_mu).fold(run.settings.robot.pads.static_mu, f64::min)
}

/// A warning about shifts that lower the friction of a target, where the coefficient of the pads was larger before.
fn shift_warning(run: &SuiteRun, before: &Object, after: &Object) -> Option<String> {
    let [was, is] = [before, after].map(|object| object.asset.friction.static_mu);
    let pads = run.settings.robot.pads.static_mu;
    let hidden = after.asset.hidden_friction(is, pads, "the pads");
    let hidden = hidden.filter(|_| is < was && was <= pads + ROUNDING)?;
    let shifts = || run.config.shifts.iter();
    let named = shifts().any(|shift| shift.name == "friction");
    let shifts: Vec<String> = shifts()
        .filter(|shift| !named || shift.name == "friction")
        .map(|shift| format!("{}={}", shift.name, format_number(shift.value)))
        .collect();
    Some(format!(
        "shift {}: grips of {} are no looser with its static_mu of {}, since {hidden}; {FIX}",
        shifts.join(", "),
        after.name,
        significant(is, 3)
    ))
}

/// Factor of the variation on the friction of an object.
fn factor_of(setup: &EpisodeSetup, object: &Object) -> f64 {
    let drawn = setup.variation.as_ref().and_then(|drawn| drawn.objects.get(&object.name));
    drawn.map_or(1.0, |drawn| drawn.friction_factor)
}

/// A warning about a variation of friction of which no factor has an effect on an object.
fn variation_warning(run: &SuiteRun, setup: &EpisodeSetup, object: &Object) -> Option<String> {
    let ranges = run.suite.vary.as_ref()?;
    setup.variation.as_ref()?.objects.get(&object.name)?;
    let in_layout = object.asset.friction.static_mu / factor_of(setup, object);
    let [lowest, highest] = [ranges.friction.min, ranges.friction.max].map(|factor| factor * in_layout);
    let others = least_of_supports(run, setup);
    let reason = object.asset.hidden_friction(lowest, others, SUPPORTS)?;
    let is_hidden = lowest < in_layout - ROUNDING && highest.max(in_layout) <= others + ROUNDING;
    is_hidden.then(|| {
        format!(
            "variation {}: its factors on friction give objects a static_mu in {}..{}, and {reason}; {FIX}",
            ranges.name,
            significant(lowest, 3),
            significant(highest, 3)
        )
    })
}

/// A warning about the friction that the layout gives to an object.
fn layout_warning(run: &SuiteRun, setup: &EpisodeSetup, object: &Object) -> Option<String> {
    let in_layout = object.asset.friction.static_mu / factor_of(setup, object);
    let is_changed = (in_layout - object.nominal.friction.static_mu).abs() > ROUNDING;
    let others = least_of_supports(run, setup);
    let hidden = object.asset.hidden_friction(in_layout, others, SUPPORTS).filter(|_| is_changed)?;
    Some(format!(
        "object {}: its static_mu is {}, and {hidden}; {FIX}",
        object.name,
        significant(in_layout, 3)
    ))
}
