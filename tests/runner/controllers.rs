//! The order of the reference controllers: what a suite needs of a grip, by arithmetic and by episodes.

use crate::support::Project;

/// Controllers that keep one number constant.
const CONSTANT: [&str; 6] =
    ["fixed-closure", "size-seen", "contact-depth", "one-force", "one-force-for-all", "drives"];

/// Mean over the kinds of a suite by column of `scripts/blind_bounds.lua`.
fn bounds(suite: &str) -> impl Fn(&str) -> f64 {
    let project = Project::new(&[]);
    let options = format!("--suite={suite} --instances=60");
    let rows = project.run("scripts/blind_bounds.lua").options(&options).rows();
    assert!(rows.len() >= 5, "{rows:?}");
    move |column: &str| {
        let values =
            rows.iter().map(|row| row[column].as_f64().unwrap_or_else(|| panic!("{column}: {row:?}")));
        values.sum::<f64>() / rows.len() as f64
    }
}

#[test]
fn the_varied_suite_needs_the_size_and_the_hidden_ones_a_trial_by_arithmetic() {
    let varied = bounds("object_varied");
    assert!(varied("fixed-closure") < 60.0 && varied("size-seen") > 95.0, "the size suffices");
    for suite in ["object_hidden", "spatial_hidden"] {
        let hidden = bounds(suite);
        for controller in CONSTANT {
            let share = hidden(controller);
            assert!(share < 60.0, "{suite}: {controller} is safe for {share:.1} % of the instances");
        }
        // The least force is known to 7 %, and the narrowest windows end a little above the grip.
        assert!(hidden("felt") > 85.0, "{suite}: {:.1} %", hidden("felt"));
        assert!((1.25..=1.5).contains(&hidden("force_ratio")), "{suite}: {}", hidden("force_ratio"));
        assert!((1.0..100.0).contains(&hidden("kept_pct")), "{suite}: {}", hidden("kept_pct"));
    }
}

#[test]
#[ignore = "nightly"]
fn no_constant_number_is_safe_where_a_grip_has_to_be_found_by_trial() {
    // The first episode of each task of Object-Hidden, of which each has another object.
    let count = 10;
    let safe_episodes = |policy: &str| {
        let project = Project::new(&[]);
        let records = project.run("suites/object_hidden.lua").episodes(1).policy(policy).records();
        assert_eq!(records.len(), count);
        records.iter().filter(|record| record.verdict.safety).count()
    };
    let [expert, servo, binary] = ["expert", "tactile-servo", "expert-binary"].map(safe_episodes);
    assert!(
        expert >= 9 && servo >= 8 && binary == 0,
        "expert {expert}, tactile-servo {servo}, binary {binary}"
    );
    let tried: [usize; 2] = ["look-retry", "weigh"].map(safe_episodes);
    assert!(tried[0] + tried[1] >= 14, "look-retry and weigh are safe in {tried:?} episodes");
    let constant = ["size-seen", "contact-depth", "one-force"].map(safe_episodes);
    assert!(constant.iter().all(|safe| *safe < servo.min(expert)), "{constant:?}, tactile-servo {servo}");
    assert!(constant.iter().sum::<usize>() <= 18, "a constant number is safe in {constant:?} episodes");
}
