//! Tables of a scene file read into structs, with errors that have their place. Every type is read from the parser's values by one small function:
//! serde's visitors would take three times the code, which browsers load.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;
use toml::de::{DeArray, DeFloat, DeInteger, DeTable, DeValue};

/// Value of the file with its place.
pub(super) type TomlValue<'a> = Spanned<DeValue<'a>>;

/// Error of a file with its place.
pub(super) struct ReadError {
    pub message: String,
    pub span: Option<Range<usize>>,
    /// Key that is unknown, missing or doubled.
    pub key: Option<String>,
}

pub(super) type ReadResult<T> = Result<T, Box<ReadError>>;

/// Type that is read from a value of the file.
pub(super) trait FromValue: Sized {
    fn from_value(value: &TomlValue) -> ReadResult<Self>;

    /// Value of a key that the file leaves out; none if it must be there.
    fn missing() -> Option<Self> {
        None
    }
}

/// Reads a text as a table.
pub(super) fn read_file_text<T: FromValue>(text: &str) -> ReadResult<T> {
    let root = DeTable::parse(text).map_err(|error| ReadError {
        message: error.message().into(),
        span: error.span(),
        key: None,
    })?;
    T::from_value(&Spanned::new(root.span(), DeValue::Table(root.into_inner())))
}

/// Error at a value.
pub(super) fn refuse<T>(value: &TomlValue, message: impl Display) -> ReadResult<T> {
    Err(Box::new(ReadError { message: message.to_string(), span: Some(value.span()), key: None }))
}

/// Error of a value of another type than `expected`.
#[inline(never)]
pub(super) fn wrong_type<T>(value: &TomlValue, expected: &str) -> ReadResult<T> {
    let found = match value.get_ref() {
        DeValue::String(text) => format!("string {text:?}"),
        DeValue::Integer(number) => format!("integer `{number}`"),
        DeValue::Float(number) => format!("floating point `{number}`"),
        DeValue::Boolean(is) => format!("boolean `{is}`"),
        DeValue::Datetime(_) => "date".into(),
        DeValue::Array(_) => "sequence".into(),
        DeValue::Table(_) => "table".into(),
    };
    refuse(value, format!("invalid type: {found}, expected {expected}"))
}

/// Key of a table, with its spelling in earlier versions.
pub(super) struct Key {
    pub name: &'static str,
    pub retired: Option<&'static str>,
}

/// Values of a table in the order of its keys.
pub(super) struct Entry<'a> {
    table: &'a TomlValue<'a>,
    values: std::vec::IntoIter<(&'static str, Option<&'a TomlValue<'a>>)>,
}

impl<'a> Entry<'a> {
    /// Values of the keys; refuses keys that are not listed.
    #[inline(never)]
    pub fn new(value: &'a TomlValue<'a>, keys: &'static [Key]) -> ReadResult<Self> {
        let DeValue::Table(table) = value.get_ref() else { return wrong_type(value, "a table") };
        let is_known = |name: &str| keys.iter().any(|key| key.name == name || key.retired == Some(name));
        if let Some(unknown) = table.keys().find(|name| !is_known(name.get_ref())) {
            let listed: Vec<String> = keys.iter().map(|key| format!("`{}`", key.name)).collect();
            let listed = match &listed[..] {
                [_] | [_, _] => listed.join(" or "),
                _ => format!("one of {}", listed.join(", ")),
            };
            let key = unknown.get_ref().to_string();
            let message = format!("unknown field `{key}`, expected {listed}");
            return Err(Box::new(ReadError { message, span: Some(unknown.span()), key: Some(key) }));
        }
        let mut values = Vec::new();
        for Key { name, retired } in keys {
            let former = retired.and_then(|retired| table.get_key_value(retired));
            let own = table.get(*name);
            if let (Some((place, _)), Some(_)) = (former, own) {
                let (message, key) = (format!("duplicate field `{name}`"), Some((*name).to_string()));
                return Err(Box::new(ReadError { message, span: Some(place.span()), key }));
            }
            values.push((*name, own.or(former.map(|(_, value)| value))));
        }
        Ok(Self { table: value, values: values.into_iter() })
    }

    /// Value of the next key.
    pub fn read<T: FromValue>(&mut self) -> ReadResult<T> {
        match self.values.next() {
            Some((_, Some(value))) => T::from_value(value),
            Some((name, None)) => T::missing().ok_or_else(|| self.missing(name)),
            None => Err(self.missing("")),
        }
    }

    #[inline(never)]
    fn missing(&self, key: &str) -> Box<ReadError> {
        let message = format!("missing field `{key}`");
        Box::new(ReadError { message, span: Some(self.table.span()), key: Some(key.into()) })
    }
}

/// Structs of tables. A field has the key of its name, or another one after `=`; an alias is its spelling in earlier versions.
macro_rules! entries {
    ($($(#[$about:meta])* $entry:ident {
        $($field:ident $(= $key:literal)? $((alias = $retired:literal))?: $type:ty,)*
    })*) => {$(
        $(#[$about])*
        pub(super) struct $entry {
            $(pub $field: $type,)*
        }

        impl FromValue for $entry {
            fn from_value(value: &TomlValue) -> ReadResult<Self> {
                const KEYS: &[Key] = &[$(Key {
                    name: [$($key,)? stringify!($field)][0],
                    retired: [$(Some($retired),)? None][0],
                },)*];
                let mut entry = Entry::new(value, KEYS)?;
                Ok(Self { $($field: entry.read()?,)* })
            }
        }
    )*};
}
pub(super) use entries;

impl<T: FromValue> FromValue for Option<T> {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        T::from_value(value).map(Some)
    }

    fn missing() -> Option<Self> {
        Some(None)
    }
}

impl<T: FromValue> FromValue for Spanned<T> {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        Ok(Self::new(value.span(), T::from_value(value)?))
    }
}

impl<T: FromValue> FromValue for Vec<T> {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        array(value)?.iter().map(T::from_value).collect()
    }

    fn missing() -> Option<Self> {
        Some(Self::new())
    }
}

/// Values of an array.
fn array<'a>(value: &'a TomlValue) -> ReadResult<&'a DeArray<'a>> {
    match value.get_ref() {
        DeValue::Array(values) => Ok(values),
        _ => wrong_type(value, "a sequence"),
    }
}

/// Table of any keys.
impl<T: FromValue> FromValue for BTreeMap<String, T> {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        let DeValue::Table(table) = value.get_ref() else { return wrong_type(value, "a table") };
        table.iter().map(|(key, value)| Ok((key.get_ref().to_string(), T::from_value(value)?))).collect()
    }
}

impl FromValue for bool {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        match value.get_ref() {
            DeValue::Boolean(is) => Ok(*is),
            _ => wrong_type(value, "a boolean"),
        }
    }
}

impl FromValue for String {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text.to_string()),
            _ => wrong_type(value, "a string"),
        }
    }
}

impl FromValue for PathBuf {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        String::from_value(value).map(Self::from)
    }
}

impl FromValue for i64 {
    #[inline(never)]
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        let DeValue::Integer(number) = value.get_ref() else { return wrong_type(value, "a whole number") };
        whole_number(number).map_or_else(|| refuse(value, "integer number overflowed"), Ok)
    }
}

impl FromValue for f64 {
    #[inline(never)]
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        match value.get_ref() {
            DeValue::Integer(number) => match whole_number(number) {
                Some(number) => Ok(number as f64),
                None => refuse(value, "integer number overflowed"),
            },
            DeValue::Float(number) => match decimal_number(number) {
                Some(number) => Ok(number),
                None => refuse(value, "floating-point number overflowed"),
            },
            _ => wrong_type(value, "a number"),
        }
    }
}

pub(super) fn whole_number(number: &DeInteger) -> Option<i64> {
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// Number that is infinite only if the file says so.
pub(super) fn decimal_number(number: &DeFloat) -> Option<f64> {
    let text = number.as_str();
    text.parse().ok().filter(|number: &f64| !number.is_infinite() || text.contains("inf"))
}
