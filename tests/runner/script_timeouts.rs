//! A script that never ends. `softvt-script` tests other endless scripts, with a shorter limit.

use crate::support::Project;

#[test]
fn an_endless_script_is_stopped() {
    let message = Project::new(&[("x.lua", "while true do end")]).run("x.lua").error();
    assert_eq!(message, "x.lua:1: the script ran for more than 10 s; look for an endless loop");
}
