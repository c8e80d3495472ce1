//! Retired words: what stands in `xtask/retired_words.txt`, and where files still use them.

use regex::Regex;

/// A line, or one after such a line, with this text may use a retired word: it reads old files.
const OLD_SPELLING: &str = "old spelling";

/// Attributes that read old files.
const ALIASES: &[&str] = &["serde(alias", "alias = \""];

/// A retired word.
#[derive(Debug)]
struct Entry {
    /// Beginning of the paths that it is looked for in.
    below: String,
    regex: Regex,
    replacement: String,
}

/// Retired words with their replacements.
#[derive(Debug)]
pub(super) struct Retired {
    /// Of prose and identifiers alike, as lower-case words.
    words: Vec<Entry>,
    /// Of all files, as they are written.
    texts: Vec<Entry>,
    /// Of identifiers in code, as they are written.
    names: Vec<Entry>,
    /// Any of them, to pass most lines at once.
    any: [Regex; 3],
    /// Beginnings of paths that are not looked at.
    allowed: Vec<String>,
}

impl Retired {
    /// Parse the list: `word|text|name REGEX → REPLACEMENT`, `in PATH`, `allow PATH`, `#` comments.
    ///
    /// # Errors
    /// When a line is none of these, or its regular expression is not one.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let [mut words, mut texts, mut names] = [const { Vec::new() }; 3];
        let mut allowed = Vec::new();
        let mut below = String::new();
        for (at, line) in text.lines().enumerate() {
            let line = line.trim();
            let fail = |what: String| format!("{}:{}: {what}", super::RETIRED_WORDS, at + 1);
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if let Some(path) = line.strip_prefix("allow ") {
                allowed.push(path.trim().to_string());
                continue;
            }
            if let Some(path) = line.strip_prefix("in ") {
                below = if path.trim() == "." { String::new() } else { path.trim().to_string() };
                continue;
            }
            let (kind, rest) = line.split_once(' ').unwrap_or((line, ""));
            let Some((pattern, replacement)) = rest.split_once('→') else {
                return Err(fail(
                    "expected `word|text|name REGEX → REPLACEMENT`, `in PATH` or `allow PATH`".into(),
                ));
            };
            let list = match kind {
                "word" => &mut words,
                "text" => &mut texts,
                "name" => &mut names,
                _ => {
                    return Err(fail(format!(
                        "begins with {kind:?}, expected word, text, name, in or allow"
                    )));
                }
            };
            // ASCII boundaries: those of Unicode would cost seconds.
            let regex = Regex::new(&format!(r"(?-u:\b)(?:{})(?-u:\b)", pattern.trim()));
            let regex = regex.map_err(|error| fail(error.to_string()))?;
            list.push(Entry { below: below.clone(), regex, replacement: replacement.trim().to_string() });
        }
        let any = [&words, &texts, &names].map(|list| {
            let parts: Vec<_> = list.iter().map(|entry| entry.regex.as_str()).collect();
            Regex::new(&parts.join("|"))
        });
        let [Ok(any_word), Ok(any_text), Ok(any_name)] = any else {
            return Err("the retired words are too many".into());
        };
        Ok(Self { words, texts, names, any: [any_word, any_text, any_name], allowed })
    }

    /// Where a file uses retired words: in the first of each kind of a line.
    pub(super) fn found_in(&self, name: &str, text: &str) -> Vec<String> {
        if self.allowed.iter().any(|path| name.starts_with(path.as_str())) {
            return Vec::new();
        }
        let is_source = [".rs", ".ts"].iter().any(|ending| name.ends_with(ending));
        let mut found = Vec::new();
        let mut allows = false;
        for (at, line) in text.lines().enumerate() {
            let marked = line.to_lowercase().contains(OLD_SPELLING);
            let allowed = marked || allows || ALIASES.iter().any(|alias| line.contains(alias));
            allows = marked;
            if allowed {
                continue;
            }
            let of = |list: &[Entry], any: &Regex, text: &str| {
                if !any.is_match(text) {
                    return None;
                }
                let own = list.iter().filter(|entry| name.starts_with(&entry.below));
                let mut used = own.filter_map(|entry| Some((entry.regex.find(text)?, &entry.replacement)));
                used.next().map(|(used, replacement)| (used.as_str().to_string(), replacement.clone()))
            };
            let code = if is_source { line.split("//").next().unwrap_or_default() } else { "" };
            let found_here = [
                of(&self.words, &self.any[0], &spoken(line)),
                of(&self.texts, &self.any[1], line),
                of(&self.names, &self.any[2], code),
            ];
            for (used, replacement) in found_here.into_iter().flatten() {
                found.push(format!("{name}:{}: {used:?} → {replacement}", at + 1));
            }
        }
        found
    }
}

/// A line in lower case, with the words of identifiers apart.
fn spoken(line: &str) -> String {
    let mut out = String::with_capacity(line.len() + 16);
    let mut before = ' ';
    for c in line.chars() {
        if c == '_' {
            out.push(' ');
        } else {
            if c.is_uppercase() && before.is_lowercase() {
                out.push(' ');
            }
            out.extend(c.to_lowercase());
        }
        before = c;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &str = "# of a test\nword vicinity|vicinities → candidate cache\nword most places → max_contact_samples\n\
                        name Sight → SurfaceView\nallow docs/glossary.md\n\
                        in viewer/\nname dress → apply theme\ntext old_key → new_key\n";

    #[test]
    fn words_are_found_in_prose_and_identifiers_and_names_in_source_only() {
        let retired = Retired::parse(LIST).expect("a list");
        let text = "let vicinity_of = MostPlaces;\nuse Sight; // Sight\nlet dress = insight; // Sight\n";
        let expected = ["a.rs:1: \"vicinity\" → candidate cache", "a.rs:2: \"Sight\" → SurfaceView"];
        assert_eq!(retired.found_in("a.rs", text), expected);
        assert_eq!(
            retired.found_in("viewer/a.md", "old key, `old_key`"),
            ["viewer/a.md:1: \"old_key\" → new_key"]
        );
        assert_eq!(retired.found_in("viewer/a.ts", "dress()"), ["viewer/a.ts:1: \"dress\" → apply theme"]);
        assert_eq!(
            retired.found_in("a.md", "MostPlaces\nSight"),
            ["a.md:1: \"most places\" → max_contact_samples"]
        );
    }

    #[test]
    fn old_files_are_read_by_lines_that_say_so() {
        let retired = Retired::parse(LIST).expect("a list");
        let text = "#[serde(alias = \"most_places\")]\n// Old spelling, still read.\nmost_places = 48\n";
        assert!(retired.found_in("a.rs", text).is_empty());
        assert!(retired.found_in("docs/glossary.md", "vicinity").is_empty());
    }

    #[test]
    fn a_line_that_is_none_is_an_error() {
        let error = Retired::parse("\nwrod a → b").expect_err("no such kind");
        assert_eq!(
            error,
            "xtask/retired_words.txt:2: begins with \"wrod\", expected word, text, name, in or allow"
        );
        let error = Retired::parse("word a").expect_err("no replacement");
        let expected = "xtask/retired_words.txt:1: expected `word|text|name REGEX → REPLACEMENT`, `in PATH` or `allow PATH`";
        assert_eq!(error, expected);
    }
}
