//! Metrics of suites: values, where they appear, and refused declarations.

use insta::assert_snapshot;
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
fn a_metric_that_fails_ends_the_run_and_says_where() {
    let returned = [("0 / 0", "NaN"), ("'x'", "\"x\""), ("{}", "a table"), ("true", "true")];
    for (value, got) in returned {
        let metric = format!("softvt.metric {{ name = 'm', of = function() return {value} end }}");
        let expected = format!("x.lua:9: the metric \"m\" returned {got}; return a finite number");
        let message = project(&metric).run("x.lua").error();
        assert!(message.contains(&expected), "{message}");
    }
    let drawn = "softvt.metric { name = 'm', of = function() return math.random() end }";
    let message = project(drawn).run("x.lua").error();
    assert!(message.contains("x.lua:9: math.random in a function of the state"), "{message}");
    let unknown = |body: &str, expected: &str| {
        let metric = format!("softvt.metric {{ name = 'm', of = function(_, step) {body} end }}");
        let message = project(&metric).run("x.lua").error();
        assert!(message.contains(expected), "{message}");
    };
    unknown("return step.pad_forces_n", "step: unknown key \"pad_forces_n\"; did you mean \"pad_force_n\"?");
    unknown("return step.objects[1].d", "step.objects: unknown key \"d\"; there are name, ");
}

#[test]
fn a_metric_without_values_is_told() {
    let metric = "softvt.metric { name = 'never', of = function(_, step) return step.objects[1].nodes end }";
    let result = project(metric).run("x.lua").finish().result();
    assert_eq!(result.records[0].stats.metrics["never"], None);
    assert_eq!(result.summary.scores.metrics["never"].n, 0);
}

#[test]
fn wrong_metrics_are_refused() {
    let refusal = |metrics: &str| project(metrics).run("x.lua").error();
    let metric = |fields: &str| format!("softvt.metric {{ {fields} }}");
    let good = metric("name = 'm', of = function() end");
    assert_snapshot!(refusal(&format!("{good}, {good}")), @r#"x.lua:9: suite.metrics[2]: "m" is there already; give each once"#);
    assert_snapshot!(refusal(&metric("name = 'm', over = 'sum', of = function() end")), @r#"x.lua:9: metric.over: expected one of "last", "max", "min", "mean", got "sum""#);
    for name in ["safety", "goal", "d_peak", "tau", "privileged", "steps", "attempts", "seed", "outcome"] {
        let message = refusal(&metric(&format!("name = '{name}', of = function() end")));
        assert_eq!(
            message,
            format!("x.lua:9: metric.name: {name:?} is a field of every record; give another name")
        );
    }
    assert_snapshot!(refusal(&metric("name = 'm'")), @"x.lua:9: metric.of: missing; expected a function, fun(scene: softvt.SceneState, step: table): number?");
    assert_snapshot!(refusal("function() end"), @"x.lua:9: suite.metrics[1]: expected the result of softvt.metric{…}, got a function");
}
