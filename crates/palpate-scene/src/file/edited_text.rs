//! Text of a scene that was edited in place: its lines, and those of the file that they come from.

use toml::Table;

/// Text with lines that the file does not have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct EditedText {
    /// Text.
    pub text: String,
    /// Lines of the text that were added between others, from 1, in their order.
    pub added_lines: Vec<usize>,
}

impl EditedText {
    /// Text whose lines are those of the file, as far as it goes; none if it means another scene.
    pub fn same_lines(text: String, meaning: &Table) -> Option<Self> {
        let edited = Self { text, added_lines: Vec::new() };
        edited.is(meaning).then_some(edited)
    }

    /// Text of a scene that could not be edited in place.
    pub fn rewritten(scene: &Table) -> Self {
        Self { text: scene.to_string(), added_lines: Vec::new() }
    }

    /// Whether the text means a scene.
    pub fn is(&self, meaning: &Table) -> bool {
        self.text.parse::<Table>().is_ok_and(|own| own == *meaning)
    }

    /// Add a line after the one that a place is in.
    pub fn insert_after_line(&mut self, place: usize, line: &str) {
        let end = self.text[place..].find('\n').map_or(self.text.len(), |at| place + at);
        let added = 2 + self.text[..end].matches('\n').count();
        self.text.insert_str(end, &format!("\n{line}"));
        self.added_lines.iter_mut().filter(|own| **own >= added).for_each(|own| *own += 1);
        self.added_lines.push(added);
        self.added_lines.sort_unstable();
    }

    /// Line of the file that a line of the text is, or stands below, from 1.
    pub fn line_before(&self, line: usize) -> usize {
        line - self.added_lines.iter().filter(|added| **added <= line).count()
    }
}
