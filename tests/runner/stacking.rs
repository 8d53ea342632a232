//! The option `stack` of the expert `pick_place`: objects are placed centred, and stand when the hand leaves them.

use crate::support::Project;

#[test]
fn objects_that_are_placed_for_stacking_are_centred() {
    let project = Project::of("towers.lua");
    let records = project.run("x.lua").out("run").finish().results.swap_remove(0).records;
    assert_eq!(records.len(), 4);
    for record in records {
        let offset_mm = record.stats.notes["offset_mm"];
        assert!(record.verdict.goal, "{record:?}");
        match record.header.id.task {
            0 => assert!(offset_mm < 0.2, "{offset_mm} mm"),
            _ => assert!(offset_mm > 0.2, "without the option: {offset_mm} mm"),
        }
    }
}
