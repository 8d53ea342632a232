//! A grasp that ends by its force: the pads press with it on average, however heavy the object, however soft, and
//! wherever it stands between them.

use crate::support::Project;

#[test]
fn the_pads_press_with_the_force_of_a_grasp_on_average() {
    let rows = Project::of("grip_force.lua").run("x.lua").rows();
    let number =
        |row: usize, key: &str| rows[row][key].as_f64().unwrap_or_else(|| panic!("{key} in {rows:?}"));
    assert_eq!(rows.len(), 3);
    for row in 0..3 {
        assert!((number(row, "ratio") - 1.0).abs() < 0.04 && number(row, "most") < 1.06, "{rows:?}");
    }
    assert!(number(1, "unequal") > 0.1, "the table holds the object back: {rows:?}");
}
