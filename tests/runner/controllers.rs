//! The order of the reference controllers: what a suite needs of a grip, by arithmetic and by episodes.

use crate::support::Project;

/// Controllers that keep one number constant.
const CONSTANT: [&str; 6] =
    ["fixed-closure", "size-seen", "contact-depth", "one-force", "one-force-for-all", "drives"];

/// Mean over the kinds of a suite by column of `scripts/blind_bounds.lua`.
fn bounds(suite: &str) -> impl Fn(&str) -> f64 {
    let project = Project::new(&[]);
    let options = format!("--suite={suite} --instances=200");
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

/// Compares the controllers on the first episode of tasks of Object-Hidden, of which each has another object.
fn compare_controllers(tasks: &[usize]) {
    let safe_episodes = |policy: &str| {
        let project = Project::new(&[]);
        let run = project.run("suites/object_hidden.lua").tasks(tasks).episodes(1).policy(policy);
        let episodes = run.records();
        assert_eq!(episodes.len(), tasks.len());
        episodes.iter().filter(|episode| episode.verdict.safety).count()
    };
    let count = tasks.len();
    let [expert, servo, binary] = ["expert", "tactile-servo", "expert-binary"].map(safe_episodes);
    assert!(10 * expert >= 9 * count, "the expert is safe in {expert} of {count} episodes");
    assert!(10 * servo >= 8 * count, "tactile-servo is safe in {servo} of {count} episodes");
    let tried: usize = ["look-retry", "weigh"].map(safe_episodes).iter().sum();
    assert!(
        10 * tried >= 7 * 2 * count,
        "look-retry and weigh are safe in {tried} of {} episodes",
        2 * count
    );
    assert_eq!(binary, 0, "a hand that closes fully is safe in {binary} of {count} episodes");
    let mut total = 0;
    for policy in ["size-seen", "contact-depth", "one-force"] {
        let safe = safe_episodes(policy);
        assert!(
            safe < servo.min(expert),
            "{policy} is safe in {safe} of {count} episodes, tactile-servo in {servo}"
        );
        total += safe;
    }
    assert!(
        10 * total <= 6 * 3 * count,
        "controllers with a constant number are safe in {total} of {} episodes",
        3 * count
    );
}

#[test]
fn no_constant_number_is_safe_where_a_grip_has_to_be_found_by_trial() {
    compare_controllers(&[2, 6]);
}

#[test]
#[ignore = "takes a minute; .ci/nightly runs it"]
fn the_same_holds_for_all_objects() {
    compare_controllers(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
}

#[test]
fn bounds_of_suites_that_have_none_are_refused() {
    let project = Project::new(&[]);
    let refusal = |options: &str| {
        let (_, outcome) = project.run("scripts/blind_bounds.lua").options(options).experiment();
        outcome.expect_err("no bounds")
    };
    let message = refusal("--suite=object_rigid");
    assert!(message.contains("no goal object of these suites has a calibrated window"), "{message}");
    let message = refusal("--suite=all");
    assert!(message.contains("suites/all.lua returns a list of suites"), "{message}");
}
