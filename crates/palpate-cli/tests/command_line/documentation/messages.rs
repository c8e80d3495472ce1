//! Messages of the viewer's protocol: JSON with comments.

use super::blocks;
use serde_json::{Deserializer, Value};

/// JSON without its comments.
fn without_comments(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let (mut in_text, mut escaped, mut end) = (false, false, line.len());
        for (at, c) in line.char_indices() {
            match c {
                '/' if !in_text && line[at..].starts_with("//") => {
                    end = at;
                    break;
                }
                '"' if !escaped => in_text = !in_text,
                _ => {}
            }
            escaped = c == '\\' && !escaped;
        }
        out += &line[..end];
        out.push('\n');
    }
    out
}

#[test]
fn messages_of_the_protocol_are_json_and_those_of_pages_are_understood() {
    let mut count = 0;
    for block in blocks("jsonc") {
        let messages = Deserializer::from_str(&without_comments(&block.text))
            .into_iter::<Value>()
            .collect::<Result<Vec<_>, _>>()
            .unwrap_or_else(|error| panic!("{}: {error}", block.place()));
        count += messages.len();
        // What pages send begins with a press; the rest comes from the server.
        if messages.first().is_some_and(|first| first["type"] == "press") {
            for message in messages {
                assert!(palpate_viewer::decodes(&message.to_string()), "{}: {message}", block.place());
            }
        }
    }
    assert!(count >= 15, "{count} messages");
}
