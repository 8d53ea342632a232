//! Objects that settle otherwise than they are modelled: the expert grips them as they lie.

use crate::support::Project;

#[test]
fn an_object_that_settles_tilted_is_gripped_as_it_lies() {
    for record in Project::of("tilted.lua").run("x.lua").records() {
        assert!(record.verdict.goal, "{record:#?}");
    }
}
