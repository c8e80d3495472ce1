//! READMEs of the repository and of the crate: their program is the example `hold`, and prints the stated number.

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
    let output = std::process::Command::new(env!("CARGO"))
        .args(["run", "--release", "--quiet", "--locked", "--package", "palpate", "--example", "hold"])
        .current_dir(root)
        .output()
        .expect("cargo runs, since it runs this test");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for readme in [README, CRATE_README] {
        assert!(readme.contains(&format!("prints `{}`", printed.trim())), "it prints {printed}");
    }
}
