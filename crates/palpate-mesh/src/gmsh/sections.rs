//! Version, and the marks where sections begin and end.

use crate::error::MeshError;
use crate::scan::{Encoding, Scanner, quoted};

/// Supported versions of the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    /// MSH 1: text, no names.
    V1,
    /// MSH 2.2.
    V2,
    /// MSH 4.0: node numbers of 32 bits, and entities by tag and dimension.
    V40,
    /// MSH 4.1.
    V4,
}

impl Version {
    /// Name of the section with the nodes.
    pub fn nodes(self) -> &'static str {
        if self == Self::V1 { "NOD" } else { "Nodes" }
    }

    /// Name of the section with the elements.
    pub fn elements(self) -> &'static str {
        if self == Self::V1 { "ELM" } else { "Elements" }
    }

    /// Whether elements stand in blocks, one per entity of the section `$Entities`.
    pub fn has_entities(self) -> bool {
        self == Self::V40 || self == Self::V4
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::V1 => "1",
            Self::V2 => "2.2",
            Self::V40 => "4.0",
            Self::V4 => "4.1",
        }
    }
}

/// The section `$MeshFormat`, which MSH 1 lacks: `version file-type data-size`, and in a binary file the integer 1.
pub(super) fn read_format(scan: &mut Scanner) -> Result<Version, MeshError> {
    scan.skip_blank();
    while scan.peek() == b"$Comments" {
        scan.skip_past(b"$EndComments")?;
        scan.skip_blank();
    }
    if scan.peek() == b"$NOD" {
        return Ok(Version::V1);
    }
    scan.expect_word("$MeshFormat", "$MeshFormat, which a gmsh mesh begins with")?;
    scan.end_of_line()?;
    scan.skip_blank();
    let version = match scan.word_in_line() {
        b"2" | b"2.0" | b"2.1" | b"2.2" => Version::V2,
        b"4" | b"4.0" => Version::V40,
        b"4.1" => Version::V4,
        other => {
            return scan.fail(format!(
                "MSH version {} cannot be read, only 1, 2.2, 4.0 and 4.1: \
                 convert it with gmsh OLD.msh -save -format msh41 -o NEW.msh",
                quoted(other)
            ));
        }
    };
    let is_binary = match scan.word_in_line() {
        b"0" => false,
        b"1" => true,
        other => {
            let message = format!("file type {}, expected 0 or 1", quoted(other));
            return scan.fail(message);
        }
    };
    let data_size = scan.word_in_line();
    if data_size != b"8" {
        let message = format!("data size {}, expected 8", quoted(data_size));
        return scan.fail(message);
    }
    scan.end_of_line()?;
    if is_binary {
        scan.encoding = Encoding::LittleEndian;
        match scan.binary("the integer 1 in binary")? {
            [1, 0, 0, 0] => {}
            [0, 0, 0, 1] => scan.encoding = Encoding::BigEndian,
            other => {
                let message = format!("expected the integer 1 in binary, found bytes {other:?}");
                return scan.fail(message);
            }
        }
    }
    end_of_section(scan, "MeshFormat", "after the format")?;
    Ok(version)
}

/// The name of the section that begins here, without `$`; `None` at the end of the file.
pub(super) fn start_of_section<'a>(scan: &mut Scanner<'a>) -> Result<Option<&'a str>, MeshError> {
    let word = scan.word();
    if word.is_empty() {
        return Ok(None);
    }
    let name = std::str::from_utf8(word).ok();
    let name = name.and_then(|word| word.strip_prefix('$'));
    let Some(name) = name.filter(|name| !name.to_ascii_lowercase().starts_with("end")) else {
        let message = format!("expected a section such as $Nodes, found {}", quoted(word));
        return scan.fail(message);
    };
    scan.end_of_line()?;
    Ok(Some(name))
}

/// The end of a section; `after` is for the message.
pub(super) fn end_of_section(scan: &mut Scanner, name: &str, after: &str) -> Result<(), MeshError> {
    // MSH 1 shouts.
    let end = if name == "NOD" || name == "ELM" { format!("$END{name}") } else { format!("$End{name}") };
    scan.expect_word(&end, &format!("{end} {after}"))
}
