//! Metrics of suites: values, and where they appear.

use softvt::runner::SuiteResult;

use crate::support::{Project, Small};

/// The small suite with metrics, whose list is in one line.
fn project(metrics: &str) -> Project {
    let text =
        Small::default().text().replace("episodes = ", &format!("metrics = {{ {metrics} }}, episodes = "));
    assert!(text.contains("metrics ="));
    Project::new(&[("x.lua", &text)])
}

const STEPS: &str = r#"
softvt.metric { name = "count", of = function(_, step) return step.step end },
softvt.metric { name = "first", over = "min", of = function(_, step) return step.time_s end },
softvt.metric { name = "rest_m", over = "mean", of = function(scene) return scene:object("cube").centre[3] end },
softvt.metric { name = "force_n", over = "max", of = function(_, step) if step.pad_force_n[1] > 0 then return step.pad_force_n[1] end end },
"#;

#[test]
fn metrics_of_a_suite_are_in_records_and_summaries_and_change_nothing_else() {
    let plain = Project::new(&[("x.lua", &Small::default().text())]).run("x.lua").record();
    let project = project(&STEPS.replace('\n', " "));
    let SuiteResult { records, summary, .. } = project.run("x.lua").finish().result();
    let record = &records[0];
    assert_eq!(record.verdict, plain.verdict);
    assert_eq!(record.stats.state_hash, plain.stats.state_hash);
    let metrics = &record.stats.metrics;
    assert_eq!(metrics["count"], Some(f64::from(record.stats.steps)));
    assert_eq!(metrics["first"], Some(0.05));
    assert!((0.0..0.2).contains(&metrics["rest_m"].unwrap()), "{metrics:?}");
    assert_eq!(summary.scores.metrics["count"].mean, metrics["count"]);
    assert_eq!(summary.scores.metrics["force_n"].n, usize::from(metrics["force_n"].is_some()));
}

#[test]
fn a_metric_without_values_is_told() {
    let metric = "softvt.metric { name = 'never', of = function(_, step) return step.objects[1].nodes end }";
    let result = project(metric).run("x.lua").finish().result();
    assert_eq!(result.records[0].stats.metrics["never"], None);
    assert_eq!(result.summary.scores.metrics["never"].n, 0);
}
