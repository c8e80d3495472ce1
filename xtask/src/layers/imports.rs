//! Imports of a Rust source file: `use` declarations and paths, without those of `#[cfg(test)]` items.

use super::tokens::{Token, tokens};

/// A path that a source file names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Import {
    /// Inline modules of the file around it.
    pub(super) within: Vec<String>,
    /// Its segments, from `crate`, `self`, `super` or a name in scope.
    pub(super) path: Vec<String>,
    /// Name that it gets in its module; none for a path in code and for `*`.
    pub(super) name: Option<String>,
    /// Whether it is a re-export: `pub use`, with any visibility.
    pub(super) is_public: bool,
    /// Whether it stands in a `use` declaration.
    pub(super) is_use: bool,
    pub(super) line: usize,
}

/// Modules and imports of a file.
#[derive(Debug, Clone, Default)]
pub(super) struct Source {
    /// Modules with files of their own: the inline modules around, and the name.
    pub(super) files: Vec<(Vec<String>, String)>,
    /// Inline modules by their path in the file.
    pub(super) inline: Vec<Vec<String>>,
    pub(super) imports: Vec<Import>,
}

/// Read a source text.
pub(super) fn read(text: &str) -> Source {
    let mut reader = Reader {
        tokens: tokens(text),
        at: 0,
        within: Vec::new(),
        depths: Vec::new(),
        source: Source::default(),
    };
    reader.read();
    reader.source
}

struct Reader {
    tokens: Vec<(Token, usize)>,
    at: usize,
    /// Inline modules around, and the depth of braces at which each began.
    within: Vec<String>,
    depths: Vec<usize>,
    source: Source,
}

impl Reader {
    fn token(&self, ahead: usize) -> Option<&Token> {
        self.tokens.get(self.at + ahead).map(|(token, _)| token)
    }

    fn word(&self, ahead: usize) -> Option<&str> {
        match self.token(ahead) {
            Some(Token::Word(word)) => Some(word),
            _ => None,
        }
    }

    fn is_mark(&self, ahead: usize, mark: char) -> bool {
        self.token(ahead) == Some(&Token::Mark(mark))
    }

    fn read(&mut self) {
        let (mut depth, mut is_public) = (0_usize, false);
        while let Some(token) = self.token(0).cloned() {
            match token {
                Token::Mark('#') => {
                    if self.attribute() {
                        self.skip_item();
                    }
                    continue;
                }
                Token::Mark('{') => depth += 1,
                Token::Mark('}') => {
                    depth = depth.saturating_sub(1);
                    if self.depths.last() == Some(&depth) {
                        self.depths.pop();
                        self.within.pop();
                    }
                }
                Token::Word(word) if word == "pub" => {
                    is_public = true;
                    self.at += 1;
                    if self.is_mark(0, '(') {
                        self.skip_to_close();
                    }
                    continue;
                }
                Token::Word(word) if word == "use" => {
                    self.at += 1;
                    self.use_tree(&mut Vec::new(), is_public);
                    is_public = false;
                    continue;
                }
                Token::Word(word) if word == "mod" && self.word(1).is_some() => {
                    let name = self.word(1).unwrap_or_default().to_string();
                    if self.is_mark(2, ';') {
                        self.source.files.push((self.within.clone(), name));
                    } else if self.is_mark(2, '{') {
                        self.within.push(name);
                        self.depths.push(depth);
                        self.source.inline.push(self.within.clone());
                        depth += 1;
                        self.at += 2;
                    }
                }
                Token::Word(_) if self.token(1) == Some(&Token::Path) => {
                    self.path();
                    is_public = false;
                    continue;
                }
                _ => {}
            }
            is_public = false;
            self.at += 1;
        }
    }

    /// Pass an attribute. Says whether it is `#[cfg(test)]`.
    fn attribute(&mut self) -> bool {
        self.at += 1;
        if self.is_mark(0, '!') {
            self.at += 1;
        }
        if !self.is_mark(0, '[') {
            return false;
        }
        let from = self.at;
        self.skip_to_close();
        let inside = &self.tokens[from..self.at];
        inside.get(1).is_some_and(|(token, _)| token.is("cfg"))
            && inside.iter().any(|(token, _)| token.is("test"))
            && !inside.iter().any(|(token, _)| token.is("not"))
    }

    /// Pass an item: further attributes, then up to its semicolon or closing brace.
    fn skip_item(&mut self) {
        while self.is_mark(0, '#') {
            self.attribute();
        }
        let is_use =
            self.word(0) == Some("use") || self.word(0) == Some("pub") && self.word(1) == Some("use");
        while let Some(token) = self.token(0) {
            match token {
                Token::Mark(';') => {
                    self.at += 1;
                    return;
                }
                Token::Mark(open @ ('{' | '(' | '[')) => {
                    let ends = *open == '{' && !is_use;
                    self.skip_to_close();
                    if ends {
                        return;
                    }
                }
                _ => self.at += 1,
            }
        }
    }

    /// Pass a bracket and all that it holds.
    fn skip_to_close(&mut self) {
        let mut depth = 0_usize;
        while let Some(token) = self.token(0) {
            match token {
                Token::Mark('{' | '(' | '[') => depth += 1,
                Token::Mark('}' | ')' | ']') => depth = depth.saturating_sub(1),
                _ => {}
            }
            self.at += 1;
            if depth == 0 {
                return;
            }
        }
    }

    /// Read what follows a prefix in a `use` declaration, up to a comma, a closing brace or the semicolon.
    fn use_tree(&mut self, prefix: &mut Vec<String>, is_public: bool) {
        let length = prefix.len();
        let line = self.tokens.get(self.at).map_or(0, |(_, line)| *line);
        let mut name = None;
        let mut is_group = false;
        while let Some(token) = self.token(0).cloned() {
            match token {
                Token::Word(word) if word == "as" => {
                    name = self.word(1).map(str::to_string);
                    self.at += 2;
                    continue;
                }
                Token::Word(word) => prefix.push(word),
                Token::Mark('*') => prefix.push("*".into()),
                Token::Mark('{') => {
                    is_group = true;
                    self.at += 1;
                    while self.token(0).is_some() && !self.is_mark(0, '}') {
                        self.use_tree(prefix, is_public);
                        if self.is_mark(0, ',') {
                            self.at += 1;
                        }
                    }
                }
                Token::Path => {}
                Token::Mark(_) => break,
            }
            self.at += 1;
        }
        if !is_group && prefix.len() > length {
            if prefix.last().is_some_and(|last| last == "self") && prefix.len() > 1 {
                prefix.pop();
            }
            let last = prefix.last().filter(|last| *last != "*").cloned();
            self.push(prefix.clone(), name.or(last), is_public, true, line);
        }
        prefix.truncate(length);
    }

    /// Read a path in code.
    fn path(&mut self) {
        let line = self.tokens[self.at].1;
        let mut path = Vec::new();
        while let Some(word) = self.word(0) {
            path.push(word.to_string());
            self.at += 1;
            if self.token(0) != Some(&Token::Path) {
                break;
            }
            self.at += 1;
        }
        self.push(path, None, false, false, line);
    }

    fn push(&mut self, path: Vec<String>, name: Option<String>, is_public: bool, is_use: bool, line: usize) {
        let within = self.within.clone();
        self.source.imports.push(Import { within, path, name, is_public, is_use, line });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(source: &Source) -> Vec<String> {
        source.imports.iter().map(|import| import.path.join("::")).collect()
    }

    #[test]
    fn use_trees_and_paths_are_read_with_their_lines() {
        let text = "use crate::a::{self, B, c::{D as E, *}};\npub(crate) use super::f::G;\nfn h() { crate::i::j(); k::l::<M>(); }";
        let source = read(text);
        let expected = [
            "crate::a",
            "crate::a::B",
            "crate::a::c::D",
            "crate::a::c::*",
            "super::f::G",
            "crate::i::j",
            "k::l",
        ];
        assert_eq!(paths(&source), expected);
        let names: Vec<_> = source.imports.iter().map(|import| import.name.as_deref()).collect();
        assert_eq!(names, [Some("a"), Some("B"), Some("E"), None, Some("G"), None, None]);
        assert_eq!(source.imports[4].line, 2);
        assert!(source.imports[4].is_public && !source.imports[0].is_public);
    }

    #[test]
    fn items_for_tests_do_not_count_and_modules_are_known() {
        let text = "#[cfg(test)]\nmod tests { use crate::a; }\n#[cfg(test)]\nuse crate::b::{c};\n#[cfg(test)] #[allow(x)] fn d() { crate::e(); }\n\
                    mod f;\nmod g { use crate::h; mod i; }\nuse crate::j;";
        let source = read(text);
        assert_eq!(paths(&source), ["crate::h", "crate::j"]);
        assert_eq!(source.imports[0].within, ["g"]);
        assert_eq!(source.files, [(vec![], "f".to_string()), (vec!["g".to_string()], "i".to_string())]);
    }
}
