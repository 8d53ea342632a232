//! Standard soft objects in a fully closed hand: flattened, but upright and at rest.

use crate::support::Project;

#[test]
fn standard_objects_neither_chatter_nor_turn_inside_out_in_a_shut_hand() {
    let rows = Project::of("shut_hand.lua").run("x.lua").rows();
    assert_eq!(rows.len(), 3);
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row:?}"));
        assert!(number("mm_s") < 5.0 && number("det_f") > 0.1 && number("force_n") > 10.0, "{row:?}");
    }
}
