//! Token of the server: who has it gets in.

use crate::error::TokenError;
use form_urlencoded::byte_serialize;
use std::fmt;

/// Length of a generated token [bytes]: 128 bits.
const GENERATED_BYTES: usize = 16;

/// Shortest given token [characters]: 64 bits even of random hexadecimal digits.
const MIN_CHARACTERS: usize = 16;

/// Token that a client must know.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

impl Token {
    /// Token from a text, without surrounding white space.
    ///
    /// # Errors
    /// If it is so short that it could be guessed.
    pub fn new(text: &str) -> Result<Self, TokenError> {
        let text = text.trim();
        let characters = text.chars().count();
        if characters < MIN_CHARACTERS {
            return Err(TokenError::Short { characters, least: MIN_CHARACTERS });
        }
        Ok(Self(text.to_string()))
    }

    /// Random token of 128 bits, as hexadecimal digits.
    ///
    /// # Errors
    /// If the operating system gives no random numbers.
    pub fn generate() -> Result<Self, TokenError> {
        let mut bytes = [0; GENERATED_BYTES];
        getrandom::fill(&mut bytes).map_err(|error| TokenError::NoRandomness(error.to_string()))?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Query of an address, `token=…`, percent-encoded.
    pub fn query(&self) -> String {
        byte_serialize(self.0.as_bytes()).fold("token=".into(), |query, part| query + part)
    }

    /// Hash of the token.
    pub(super) fn hash(&self) -> TokenHash {
        TokenHash::of(&self.0)
    }
}

/// Hash of a token; equality takes the same time wherever two differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TokenHash(blake3::Hash);

impl TokenHash {
    /// Hash of a text.
    pub fn of(text: &str) -> Self {
        Self(blake3::hash(text.as_bytes()))
    }

    /// Hash of the token in a query, decoded.
    pub fn of_query(query: &str) -> Option<Self> {
        let mut pairs = form_urlencoded::parse(query.as_bytes());
        pairs.find(|(key, _)| key == "token").map(|(_, value)| Self::of(&value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_read_from_the_query_that_it_is_printed_in() {
        for text in ["0123456789abcdef", "a&b#c=d%20+ ü/?;:@\"", "token=token=token="] {
            let token = Token::new(text).expect("long enough");
            let query = token.query();
            assert!(query.is_ascii() && !query[6..].contains(['&', '#', '=', ' ', '"']), "{query}");
            assert_eq!(TokenHash::of_query(&query), Some(token.hash()), "{query}");
            assert_eq!(TokenHash::of_query(&format!("from=0&{query}&count=1")), Some(token.hash()));
        }
        assert_eq!(TokenHash::of_query("from=0"), None);
        assert_eq!(format!("{:?}", Token::new("0123456789abcdef")), "Ok(Token(…))");
    }

    #[test]
    fn generated_tokens_have_128_bits_and_short_ones_are_refused() {
        let (one, two) = (Token::generate().expect("random"), Token::generate().expect("random"));
        assert!(one != two && one.0.len() == 32 && one.0.bytes().all(|digit| digit.is_ascii_hexdigit()));
        let short = Token::new(" 123456789abcdef\n").expect_err("15 characters").to_string();
        assert_eq!(
            short,
            "the token has 15 characters, expected 16 or more: random hexadecimal digits have 4 bits each, and 64 bits can't be \
             guessed; `openssl rand -hex 16` makes a good one"
        );
    }
}
