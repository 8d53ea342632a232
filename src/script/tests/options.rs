use super::*;
use crate::ScriptOptionValue;

const SCRIPT: &str = r#"
local opt = softvt.options {
  closure = { default = 0.5, unit = "1", min = 0, max = 1, help = "how far to close" },
  gap_mm = { default = { 48, 46 }, unit = "mm", min = 1 },
}
return softvt.experiment {
  name = "e", options = opt, grid = { gap = opt.gap_mm }, run = function(point) return { gap = point.gap } end,
}
"#;

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(48))]

    #[test]
    fn a_number_arrives_as_it_was_written(closure in 0.0f64..=1.0) {
        let arguments = [format!("--closure={closure}")];
        let loaded = Project::new(&[("x.lua", SCRIPT)]).load("x.lua", &[&arguments[0]]).unwrap();
        let option = loaded.options.iter().find(|option| option.name == "closure").unwrap();
        proptest::prop_assert_eq!(&option.value, &ScriptOptionValue::Number(closure));
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
