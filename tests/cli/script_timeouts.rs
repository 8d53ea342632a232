//! A script that never returns from a library function ends with the process.

use crate::support::Project;

#[test]
fn a_library_function_that_does_not_return_ends_the_process() {
    let text = "return (('a'):rep(100000)):find(('.-'):rep(20) .. 'b')";
    assert_eq!(
        Project::new(&[("x.lua", text)]).refusal("x.lua"),
        "x.lua: the script called a library function that did not return within 10 s; look for a string pattern that never \
         comes to an end, or a huge repeat count"
    );
}
