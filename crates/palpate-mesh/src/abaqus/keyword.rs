//! Keyword lines: a name, and parameters with or without a value.

/// Keyword line.
pub(super) struct Keyword {
    /// Name without its `*`, in upper case, with single blanks.
    pub name: String,
    /// Parameters in upper case, and their values.
    parameters: Vec<(String, String)>,
}

impl Keyword {
    /// Keyword of a line that begins with `*`.
    pub fn parse(text: &[u8]) -> Self {
        let text = String::from_utf8_lossy(text);
        let mut parts = text.trim_start_matches('*').split(',');
        let name: Vec<_> = parts.next().unwrap_or_default().split_whitespace().collect();
        let parameters = parts.map(|part| {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            (name.trim().to_ascii_uppercase(), value.trim().trim_matches('"').to_owned())
        });
        Self { name: name.join(" ").to_ascii_uppercase(), parameters: parameters.collect() }
    }

    /// Value of a parameter, unless it is empty.
    pub fn value(&self, name: &str) -> Option<&str> {
        let found = self.parameters.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str()).filter(|value| !value.is_empty())
    }

    /// Whether there is a parameter of this name.
    pub fn has(&self, name: &str) -> bool {
        self.parameters.iter().any(|(known, _)| known == name)
    }
}
