//! Tokens of Rust source text: words and punctuation with their lines; comments and literals left out.

/// Part of a source text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Token {
    /// Identifier, keyword or number.
    Word(String),
    /// `::`
    Path,
    /// Any other character.
    Mark(char),
}

impl Token {
    /// Whether it is this word.
    pub(super) fn is(&self, word: &str) -> bool {
        matches!(self, Self::Word(own) if own == word)
    }
}

/// Tokens of a text with their lines, counted from 1.
pub(super) fn tokens(text: &str) -> Vec<(Token, usize)> {
    let chars: Vec<char> = text.chars().collect();
    let mut found = Vec::new();
    let (mut at, mut line) = (0, 1);
    while at < chars.len() {
        let end = skipped(&chars, at).unwrap_or(at);
        if end > at {
            line += chars[at..end].iter().filter(|c| **c == '\n').count();
            at = end;
            continue;
        }
        let c = chars[at];
        if is_word(c) {
            let end = (at..chars.len()).find(|&k| !is_word(chars[k])).unwrap_or(chars.len());
            found.push((Token::Word(chars[at..end].iter().collect()), line));
            at = end;
        } else if c == ':' && chars.get(at + 1) == Some(&':') {
            found.push((Token::Path, line));
            at += 2;
        } else {
            if !c.is_whitespace() {
                found.push((Token::Mark(c), line));
            }
            line += usize::from(c == '\n');
            at += 1;
        }
    }
    found
}

fn is_word(c: char) -> bool {
    c == '_' || c.is_alphanumeric()
}

/// End of the comment or literal that begins at a character; none where there is none.
fn skipped(chars: &[char], at: usize) -> Option<usize> {
    let next = |k: usize| chars.get(at + k).copied();
    match (chars[at], next(1)) {
        ('/', Some('/')) => Some((at..chars.len()).find(|&k| chars[k] == '\n').unwrap_or(chars.len())),
        ('/', Some('*')) => Some(block_comment_end(chars, at)),
        ('"', _) => Some(string_end(chars, at + 1)),
        ('\'', Some('\\')) => {
            // The escaped character may be a quote itself.
            let close = (at + 3..chars.len()).find(|&k| chars[k] == '\'');
            Some(close.map_or(chars.len(), |k| k + 1))
        }
        ('\'', Some(_)) if next(2) == Some('\'') => Some(at + 3),
        ('r' | 'b' | 'c', _) if at == 0 || !is_word(chars[at - 1]) => prefixed_string_end(chars, at),
        _ => None,
    }
}

fn block_comment_end(chars: &[char], mut at: usize) -> usize {
    let mut depth = 0;
    while at < chars.len() {
        match (chars[at], chars.get(at + 1)) {
            ('/', Some('*')) => (depth, at) = (depth + 1, at + 2),
            ('*', Some('/')) => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            break;
        }
    }
    at.min(chars.len())
}

fn string_end(chars: &[char], mut at: usize) -> usize {
    while at < chars.len() {
        match chars[at] {
            '\\' => at += 2,
            '"' => return at + 1,
            _ => at += 1,
        }
    }
    chars.len()
}

/// End of a string with a prefix (r"…", r#"…"#, b"…", br"…", c"…"); none where a word begins.
fn prefixed_string_end(chars: &[char], at: usize) -> Option<usize> {
    let open = (at..chars.len().min(at + 3)).find(|&k| !matches!(chars[k], 'r' | 'b' | 'c'))?;
    let raw = chars[at..open].contains(&'r');
    let hashes = chars[open..].iter().take_while(|c| **c == '#').count();
    if open == at || chars.get(open + hashes) != Some(&'"') || hashes > 0 && !raw {
        return None;
    }
    let first = open + hashes + 1;
    if !raw {
        return Some(string_end(chars, first));
    }
    let closes = |&k: &usize| chars[k] == '"' && chars[k + 1..].iter().take(hashes).all(|c| *c == '#');
    Some((first..chars.len()).find(closes).map_or(chars.len(), |k| k + 1 + hashes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(String, usize)> {
        let word = |(token, line)| match token {
            Token::Word(word) => Some((word, line)),
            _ => None,
        };
        tokens(text).into_iter().filter_map(word).collect()
    }

    #[test]
    fn comments_and_literals_are_left_out_and_lines_are_counted() {
        let text =
            "a // b\n/* c /* d */\n e */ f \"g \\\" h\n\" i r#\"j \" k\"# l 'm' '\\'' 'n b\"o\" r#p br\"\" q";
        let expected = [("a", 1), ("f", 3), ("i", 4), ("l", 4), ("n", 4), ("r", 4), ("p", 4), ("q", 4)];
        assert_eq!(words(text), expected.map(|(word, line)| (word.to_string(), line)));
    }
}
