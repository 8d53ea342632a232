use super::*;
use crate::ScriptOptionValue;

const SCRIPT: &str = r#"
local opt = softvt.options {
  closure = { default = 0.5, unit = "1", min = 0, max = 1, help = "how far to close" },
  gap_mm = { default = { 48, 46 }, unit = "mm", min = 1 },
  count = { default = 3, integer = true },
  shape = { default = "cube", choices = { "cube", "sphere" } },
  sleep = { default = true },
}
return softvt.experiment {
  name = "e", options = opt, grid = { gap = opt.gap_mm },
  run = function(point, opt) return { gap = point.gap, closure = opt.closure, sleep = opt.sleep } end,
}
"#;

fn value(argv: &[&str], name: &str) -> ScriptOptionValue {
    let loaded = Project::new(&[("x.lua", SCRIPT)]).load("x.lua", argv).unwrap();
    loaded.options.into_iter().find(|option| option.name == name).unwrap().value
}

#[test]
fn both_spellings_of_a_value_are_read() {
    assert_eq!(value(&["--closure", "0.3"], "closure"), ScriptOptionValue::Number(0.3));
    assert_eq!(value(&["--closure=0.3"], "closure"), ScriptOptionValue::Number(0.3));
    assert_eq!(value(&[], "closure"), ScriptOptionValue::Number(0.5));
    assert_eq!(value(&["--gap-mm", "42,40"], "gap_mm"), ScriptOptionValue::Numbers(vec![42.0, 40.0]));
    assert_eq!(value(&["--gap_mm=42"], "gap_mm"), ScriptOptionValue::Numbers(vec![42.0]));
    assert_eq!(value(&["--no-sleep"], "sleep"), ScriptOptionValue::Flag(false));
    assert_eq!(value(&["--sleep=off"], "sleep"), ScriptOptionValue::Flag(false));
    assert_eq!(value(&["--shape", "sphere"], "shape"), ScriptOptionValue::Text("sphere".into()));
}

#[test]
fn rows_follow_the_grid_and_the_options() {
    let project = Project::new(&[("x.lua", SCRIPT)]);
    let loaded = project.load("x.lua", &["--gap-mm=42,40", "--closure=0.25"]).unwrap();
    let experiment = crate::Experiment::open(&loaded).unwrap();
    assert_eq!(experiment.len(), 2);
    let row = serde_json::to_string(&experiment.run(1).unwrap()).unwrap();
    assert_eq!(row, r#"[{"closure":0.25,"gap":40.0,"sleep":true}]"#);
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(48))]

    #[test]
    fn a_number_arrives_as_it_was_written(closure in 0.0f64..=1.0) {
        let arguments = [format!("--closure={closure}")];
        proptest::prop_assert_eq!(value(&[&arguments[0]], "closure"), ScriptOptionValue::Number(closure));
    }

    #[test]
    fn errors_of_any_arguments_and_any_text_name_the_file(
        words in proptest::collection::vec("[-=a-z0-9_ .,{}()\"\n]{0,24}", 0..4),
        text in "([a-z]{1,3}|[ =.,:(){}\\[\\]\"'#+-]|[0-9]|softvt|\n|return|function|end){0,20}",
    ) {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let result = Project::new(&[("x.lua", SCRIPT)]).load("x.lua", &words).map_err(|e| e.file);
        proptest::prop_assert!(result.is_ok() || result.is_err_and(|file| file.ends_with("x.lua")));
        let error = Project::new(&[("x.lua", &text)]).load("x.lua", &[]).expect_err("gibberish is not a plan");
        proptest::prop_assert!(error.file.ends_with("x.lua"), "{}", error);
    }
}
