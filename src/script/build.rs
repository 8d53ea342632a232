//! Rebuilds when an embedded script or asset changes, which the embedding macro cannot ask for.

fn main() {
    for tree in ["scripts", "suites", "assets"] {
        println!("cargo:rerun-if-changed=../../{tree}");
    }
}
