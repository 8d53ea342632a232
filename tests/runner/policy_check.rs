//! Comparison of policies with demonstrations of a dataset.

use std::sync::Arc;

use softvt::runner::{
    PolicyConfig, PolicyOptions, RunError, SilentObserver,
    policy_check::{PolicyCheck, check_policy},
};

use super::dataset_recording::Recording;
use crate::support::{Project, SPATIAL_SOFT};

/// Holds the pose that it observes.
const HOLD: &str = "return softvt.policy { name = 'hold', act = function(seen) \
                    return { position = seen.position, axis_angle = seen.axis_angle, closure = 0 } end }";

#[test]
fn a_policy_that_holds_still_does_not_follow_the_demonstrations() {
    let project = Project::new(&[("hold.lua", HOLD)]);
    Recording::new(project.run(SPATIAL_SOFT).tasks(&[3]), 1, "data").with(|o| o.has_images = false).record();
    let check = |policy: &PolicyConfig| -> Result<PolicyCheck, RunError> {
        check_policy(policy, &project.path("data"), 1, &(Arc::new(SilentObserver) as _))
    };
    let refused = check(&PolicyConfig::named("noop").expect("built in")).err().map(|error| error.to_string());
    assert!(refused.is_some_and(|text| text.contains("only policy servers")), "of a built-in policy");
    let hold = project.path("hold.lua").to_string_lossy().parse().expect("a file");
    let hold = PolicyConfig::load(&PolicyOptions::new(hold)).unwrap_or_else(|error| panic!("{error}"));
    let held = check(&hold).unwrap_or_else(|error| panic!("{error}"));
    assert!(!held.agrees() && held.demonstrations == 1 && held.answers > 100, "{}", held.text());
    let x = &held.channels[0];
    assert!(x.channel == "x" && x.scale.is_some_and(|scale| scale.abs() < 1e-6), "{}", held.text());
    assert!(x.deviates == ["scale"] && held.text().contains("from the observed pose"), "{}", held.text());
}
