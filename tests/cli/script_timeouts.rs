//! Scripts that never end. They run in parallel, since each takes the whole time limit.

use crate::support::{Project, refusal, run_command};

const LOOP: &str = "x.lua:1: the script ran for more than 10 s; look for an endless loop";
const STUCK: &str = "x.lua: the script called a library function that did not return within 10 s; look for a \
                     string pattern that never comes to an end, or a huge repeat count";

const CASES: [(&str, &str, &str); 4] = [
    ("a loop", "while true do end", LOOP),
    ("a loop inside of pcall", "while true do pcall(function() while true do end end) end", LOOP),
    (
        "a coroutine",
        "local co = coroutine.wrap(function() while true do coroutine.yield() end end) while true do co() end",
        LOOP,
    ),
    ("a pattern", "return (('a'):rep(100000)):find(('.-'):rep(20) .. 'b')", STUCK),
];

#[test]
fn endless_scripts_are_stopped() {
    std::thread::scope(|scope| {
        for (what, text, expected) in CASES {
            scope.spawn(move || {
                let project = Project::new(&[("x.lua", text)]);
                assert_eq!(refusal(run_command(project.command("x.lua")), what), expected, "{what}");
            });
        }
    });
}
