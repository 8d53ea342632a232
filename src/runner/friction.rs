//! Warnings about changes of friction that another surface hides: a pair of surfaces takes the larger coefficient.

use std::collections::BTreeSet;

use crate::suite_run::SuiteRun;
use softvt_benchmark::Task;
use softvt_common::text::{format_number, significant};
use softvt_physics::contact::Friction;
use softvt_scene::Object;
use softvt_script::EpisodeSetup;

/// What has no effect.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum HiddenFriction {
    /// All of a change of the run.
    Whole,
    /// A part of a change, also one by the layout.
    Part,
}

/// Warnings about friction that the layout, the variation or the shifts of an episode set and another surface hides.
pub(crate) fn friction_warnings(
    run: &SuiteRun,
    task: &Task,
    setup: &EpisodeSetup,
    hidden: HiddenFriction,
) -> BTreeSet<String> {
    let nominal = setup.nominal.objects.iter();
    let mut all: BTreeSet<String> =
        nominal.clone().filter_map(|object| variation_warning(run, setup, object, hidden)).collect();
    if hidden == HiddenFriction::Part {
        all.extend(nominal.clone().filter_map(|object| layout_warning(setup, object)));
    }
    let targets = task.targets();
    let shifted = setup.scene.objects.iter().filter(|object| targets.contains(&object.name.as_str()));
    all.extend(shifted.filter_map(|object| {
        let before = setup.nominal.objects.iter().find(|other| other.name == object.name)?;
        shift_warning(run, before, object)
    }));
    all
}

/// Rounding of coefficients.
const ROUNDING: f64 = 1e-9;

/// The fix of all of them.
const FIX: &str = "that of an asset with coated = true, or with a coating, counts in every pair";

/// A warning about the friction of a target that the shifts lower below that of the pads.
fn shift_warning(run: &SuiteRun, before: &Object, after: &Object) -> Option<String> {
    let (pads, own) = (&run.settings.robot.pads, after.asset.friction.static_mu);
    let pads = Friction::new(pads.static_mu, pads.dynamic_mu);
    let hidden = after.asset.hidden_friction(own, &pads, "the pads");
    let hidden = hidden.filter(|_| own < before.asset.friction.static_mu)?;
    let shifts: Vec<String> = run
        .config
        .shifts
        .iter()
        .map(|shift| format!("{}={}", shift.name, format_number(shift.value)))
        .collect();
    Some(format!(
        "shift {}: grips of {} are no looser with its static_mu of {}, since {hidden}; {FIX}",
        shifts.join(", "),
        after.name,
        significant(own, 3)
    ))
}

/// Factor of the variation on the friction of an object.
fn factor_of(setup: &EpisodeSetup, object: &Object) -> f64 {
    let drawn = setup.variation.as_ref().and_then(|drawn| drawn.objects.get(&object.name));
    drawn.map_or(1.0, |drawn| drawn.friction_factor)
}

/// A warning about factors on the friction of an object that have no effect.
fn variation_warning(
    run: &SuiteRun,
    setup: &EpisodeSetup,
    object: &Object,
    hidden: HiddenFriction,
) -> Option<String> {
    let ranges = run.suite.vary.as_ref()?;
    setup.variation.as_ref()?.objects.get(&object.name)?;
    let (asset, others) = (&object.asset, Friction::STANDARD);
    let in_layout = asset.friction.static_mu / factor_of(setup, object);
    let [lowest, highest] = [ranges.friction.min, ranges.friction.max].map(|factor| factor * in_layout);
    let reason = asset.hidden_friction(lowest, &others, "tables and pads");
    let reason = reason.filter(|_| lowest < in_layout)?;
    let is_hidden = match hidden {
        HiddenFriction::Whole => highest < others.static_mu + ROUNDING,
        HiddenFriction::Part => true,
    };
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
fn layout_warning(setup: &EpisodeSetup, object: &Object) -> Option<String> {
    let in_layout = object.asset.friction.static_mu / factor_of(setup, object);
    let is_changed = (in_layout - object.nominal.friction.static_mu).abs() > ROUNDING;
    let hidden = object.asset.hidden_friction(in_layout, &Friction::STANDARD, "tables and pads");
    let hidden = hidden.filter(|_| is_changed)?;
    Some(format!(
        "object {}: its static_mu is {}, and {hidden}; {FIX}",
        object.name,
        significant(in_layout, 3)
    ))
}
