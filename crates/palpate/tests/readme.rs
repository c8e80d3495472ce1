//! READMEs of the repository and of the crate: their program is the example `hold`, and prints the stated number.

use std::process::Command;

const README: &str = include_str!("../../../README.md");
const CRATE_README: &str = include_str!("../README.md");

#[test]
fn the_readme_shows_the_example_as_it_is() {
    let example = include_str!("../examples/hold.rs");
    let (_, program) = example.split_once("\n\n").expect("a doc comment, then the program");
    assert!(README.contains(program.trim()), "README.md and examples/hold.rs differ");
    assert!(CRATE_README.contains(program.trim()), "crates/palpate/README.md and examples/hold.rs differ");
}

#[test]
fn the_program_prints_the_number_in_the_readme() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    // With the whole workspace, so that it is the build of the tests and not another one.
    let build =
        ["build", "--release", "--locked", "--workspace", "--example", "hold", "--message-format", "json"];
    let messages = Command::new(env!("CARGO"))
        .args(build)
        .current_dir(root)
        .output()
        .expect("cargo runs, since it runs this test");
    assert!(messages.status.success(), "{}", String::from_utf8_lossy(&messages.stderr));
    let program = String::from_utf8_lossy(&messages.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .find_map(|message| message["executable"].as_str().map(str::to_string))
        .expect("the example's program");
    let output = Command::new(program).current_dir(root).output().expect("the example runs");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for readme in [README, CRATE_README] {
        assert!(readme.contains(&format!("prints `{}`", printed.trim())), "it prints {printed}");
    }
}
