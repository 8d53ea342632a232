//! The lists of conditions that are shipped.

use std::path::Path;

use crate::support::{Project, files};

/// The shipped files that return conditions, by their paths in the repository.
fn shipped() -> Vec<String> {
    let in_folder = |folder: &'static str| {
        let found = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)).into_iter();
        let has_conditions =
            |(_, bytes): &(String, Vec<u8>)| String::from_utf8_lossy(bytes).contains("softvt.conditions {");
        found.filter(has_conditions).map(move |(path, _)| format!("{folder}/{path}"))
    };
    ["suites", "scripts"].into_iter().flat_map(in_folder).filter(|path| path.ends_with(".lua")).collect()
}

#[test]
fn every_shipped_list_of_conditions_can_be_checked() {
    let files = shipped();
    assert!(files.len() >= 2 && files.contains(&"suites/shifts.lua".to_owned()), "{files:?}");
    let project = Project::new(&[]);
    for file in files {
        // The names of all lists that the file knows.
        let declared = project.run(&file).load().expect("valid").script.options;
        let lists = declared.iter().find(|option| option.name == "conditions");
        let option = lists.map_or(String::new(), |lists| format!("--conditions={}", lists.choices.join(",")));
        assert!(file != "suites/shifts.lua" || option.contains("perturbations"), "{option}");
        let checked = project.run(&file).options(&option).check_conditions();
        checked.unwrap_or_else(|message| panic!("{file} {option}\n{message}"));
    }
    // The option of suites/shifts.lua names all lists of scripts/shifts.lua.
    project.write(
        "all.lua",
        b"for key, list in pairs(require 'shifts') do
  local is_list = #list > 0 and not rawget(list[1], 'apply')
  assert(not is_list or key == 'conditions' or key == 'all_objects' or key == 'perturbations', key)
end
return softvt.experiment { name = 'all', grid = { a = { 1 } }, run = function() return {} end }",
    );
    project.run("all.lua").load().expect("no other list");
}
