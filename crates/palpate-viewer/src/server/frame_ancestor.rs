//! Pages of others that may show the server's page in a frame, as sources of the policy `frame-ancestors` (W3C, Content Security Policy Level 3).

use std::fmt;
use std::str::FromStr;

/// Page that may show the server's page in a frame: an origin, `http://localhost:8888`, or with any port, `http://localhost:*`; or a scheme,
/// `vscode-webview:`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameAncestor(String);

impl FromStr for FrameAncestor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_source = match text.split_once(':') {
            Some((scheme, "")) => is_scheme(scheme),
            Some(("http" | "https", rest)) => rest.strip_prefix("//").is_some_and(is_host),
            _ => false,
        };
        let expected = "expected an origin, as http://localhost:8888 or http://localhost:*, or a scheme, as vscode-webview:";
        if is_source { Ok(Self(text.to_string())) } else { Err(format!("{text:?} is no origin: {expected}")) }
    }
}

impl fmt::Display for FrameAncestor {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Whether a text is a scheme; those of the web alone would be everybody.
fn is_scheme(text: &str) -> bool {
    let is_part = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "+.-".contains(c);
    text.starts_with(|c: char| c.is_ascii_lowercase())
        && text.chars().all(is_part)
        && !["http", "https", "ws", "wss"].contains(&text)
}

/// Whether a text is a host name or an IPv4 address, with or without a port.
fn is_host(text: &str) -> bool {
    let (host, port) = text.split_once(':').unwrap_or((text, "*"));
    let is_name =
        |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
    host.split('.').all(is_name) && (port == "*" || port.parse::<u16>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ancestor_is_an_origin_or_a_scheme() {
        for text in
            ["http://localhost:8888", "http://127.0.0.1:*", "https://hub.example.org", "vscode-webview:"]
        {
            assert_eq!(
                text.parse::<FrameAncestor>().map(|ancestor| ancestor.to_string()),
                Ok(text.to_string())
            );
        }
        for text in [
            "",
            "*",
            "https:",
            "http:",
            "http://",
            "localhost:8888",
            "'self'",
            "http://a b",
            "http://a; script-src *",
            "http://a,b",
            "http://a:99999",
            "http://a/path",
            "http://*",
            "ftp://a",
            "1a:",
            "data :",
            "http://a\r\nx: y",
        ] {
            assert!(text.parse::<FrameAncestor>().is_err(), "{text:?}");
        }
    }
}
