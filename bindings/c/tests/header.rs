//! The header is that of the code.

use std::path::Path;

/// Comments without the marks of Rust's documentation.
fn for_c(header: &str) -> String {
    let line = |line: &str| -> Option<String> {
        let comment = line.trim_start().strip_prefix("// ");
        if comment == Some("# Safety") {
            return None;
        }
        let mut text = line.to_string();
        if comment.is_some() {
            while let Some((link, end)) =
                text.find("](").and_then(|link| Some((link, link + text[link..].find(')')?)))
            {
                text.replace_range(link + 1..=end, "");
            }
            text = text.replace("[`", "").replace("`]", "").replace('`', "");
        }
        Some(text + "\n")
    };
    header.lines().filter_map(line).collect()
}

#[test]
fn the_header_is_what_the_code_says() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).expect("a configuration");
    let bindings = cbindgen::generate_with_config(folder, config).expect("a header");
    let mut text = Vec::new();
    bindings.write(&mut text);
    let text = for_c(&String::from_utf8(text).expect("text"));
    let header = folder.join("include/palpate.h");
    if std::env::var_os("UPDATE_HEADER").is_some() {
        std::fs::write(&header, &text).expect("a writable folder");
    }
    let committed = std::fs::read_to_string(&header).unwrap_or_default();
    assert!(
        committed == text,
        "include/palpate.h is old: UPDATE_HEADER=1 cargo test -p palpate-c --test header"
    );
    for name in ["palpate_scene_load", "palpate_state_step", "PALPATE_ABI_VERSION 1", "PALPATE_STATUS_OK = 0"]
    {
        assert!(text.contains(name), "{name} is missing:\n{text}");
    }
}
