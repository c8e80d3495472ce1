//! Texts in a drawing: how wide they are, where they break, how lengths are written.
//!
//! A font is 13 units high; which one the reader has is not known, so widths are those of a wide one.

use super::escape;

/// Height of a line of text.
pub const LINE: f64 = 19.0;

/// Which point of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// Its left end.
    Start,
    /// Its middle.
    Middle,
    /// Its right end.
    End,
}

/// A `<text>` element of a class, at a place on its baseline.
pub fn text(class: &str, anchor: Anchor, (x, baseline): (f64, f64), content: &str) -> String {
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    let anchor = match anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    };
    format!("<text{class}{anchor} x=\"{}\" y=\"{}\">{}</text>\n", short(x), short(baseline), escape(content))
}

/// About the width of a text.
pub fn width(text: &str) -> f64 {
    let advance = |c: char| match c {
        'f' | 'i' | 'j' | 'l' | 'r' | 't' | 'I' | ' ' | '.' | ',' | ':' | ';' | '\'' | '(' | ')' | '['
        | ']' => 5.3,
        '⁰' | '¹' | '²' | '³' | '⁴' | '⁵' | '⁶' | '⁷' | '⁸' | '⁹' | '⁻' => 5.6,
        'm' | 'w' | 'M' | 'W' | '×' | '−' | '→' | '%' | '@' => 12.7,
        _ if c.is_uppercase() => 9.6,
        _ => 8.3,
    };
    text.chars().map(advance).sum()
}

/// A text in lines of at most a width, broken between words.
pub fn wrapped(text: &str, widest: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(line) + width(" ") + width(word) <= widest => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A length with at most one decimal.
pub fn short(length: f64) -> String {
    // Adding 0 turns −0 into 0.
    format!("{}", (length * 10.0).round() / 10.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words_only() {
        assert_eq!(wrapped("one two  three", width("one two")), ["one two", "three"]);
        assert_eq!(wrapped("incompressible", 10.0), ["incompressible"]);
        assert!(wrapped("  ", 100.0).is_empty());
    }

    #[test]
    fn lengths_have_one_decimal_at_most() {
        assert_eq!([12.0, 0.25, -0.01, 99.96].map(short), ["12", "0.3", "0", "100"]);
    }

    #[test]
    fn texts_are_escaped() {
        let drawn = text("label", Anchor::End, (1.0, 2.0), "a < b");
        assert_eq!(drawn, "<text class=\"label\" text-anchor=\"end\" x=\"1\" y=\"2\">a &lt; b</text>\n");
    }
}
