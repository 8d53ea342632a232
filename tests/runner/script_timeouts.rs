//! Scripts that never end. They run in parallel, since each takes the whole time limit.

use crate::support::Project;

const CASES: [(&str, &str); 3] = [
    ("a loop", "while true do end"),
    ("a loop inside of pcall", "while true do pcall(function() while true do end end) end"),
    (
        "a coroutine",
        "local co = coroutine.wrap(function() while true do coroutine.yield() end end) while true do co() end",
    ),
];

#[test]
fn endless_scripts_are_stopped() {
    std::thread::scope(|scope| {
        for (what, text) in CASES {
            scope.spawn(move || {
                let message = Project::new(&[("x.lua", text)]).run("x.lua").error();
                let expected = "x.lua:1: the script ran for more than 10 s; look for an endless loop";
                assert_eq!(message, expected, "{what}");
            });
        }
    });
}
