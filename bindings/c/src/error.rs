//! Status codes, and the text of what failed.

use palpate_scene::{SceneError, SceneErrorKind};
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Kind of a failure.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Success.
    Ok = 0,
    /// A null pointer, a number that counts beyond the scene's parts, or text that is not UTF-8.
    InvalidArgument = 1,
    /// The operating system refused to read a file.
    Io = 2,
    /// The scene file is no TOML, or has an unknown, missing or doubled key, or a value of a wrong type.
    Syntax = 3,
    /// Something required is missing.
    Missing = 4,
    /// A number is out of its range.
    OutOfRange = 5,
    /// A word is none of those that are allowed, or names nothing in the scene.
    UnknownValue = 6,
    /// A name is taken, or has characters that names cannot have.
    Name = 7,
    /// Keys exclude one another.
    Conflict = 8,
    /// A recording cannot be read.
    Recording = 9,
    /// A table of impulse responses cannot be used.
    Table = 10,
    /// A mesh cannot be read, used or recorded.
    Mesh = 11,
    /// A motion path cannot be read.
    Path = 12,
    /// A held point is off the surface, fixed, or held twice.
    Grasp = 13,
    /// No virtual coupling is stable.
    Coupling = 14,
    /// The runtime refuses the model.
    Model = 15,
    /// A device cannot be used.
    Device = 16,
    /// A bug of palpate: please report it with the message.
    Panic = 17,
}

/// Length of a message with its end [bytes].
const MESSAGE_LENGTH: usize = 1024;

/// Failure with its message.
#[repr(C)]
pub struct Error {
    /// Kind.
    pub status: Status,
    /// Line in the scene file, from 1; 0 where it is not known.
    pub line: u32,
    /// Message for people, UTF-8, with file and line where they are known; it ends with 0, and is cut where it is longer.
    pub message: [c_char; 1024],
}

/// Failure on its way to the caller.
#[derive(Debug)]
pub(crate) struct Failure {
    status: Status,
    line: usize,
    message: String,
}

impl Failure {
    /// Argument that cannot be used.
    pub fn argument(message: impl Into<String>) -> Self {
        Self { status: Status::InvalidArgument, line: 0, message: message.into() }
    }

    /// Bug of palpate.
    pub fn panic(text: &str) -> Self {
        Self { status: Status::Panic, line: 0, message: format!("bug of palpate: {text}") }
    }
}

impl From<palpate::Error> for Failure {
    fn from(error: palpate::Error) -> Self {
        Self { status: Status::Grasp, line: 0, message: error.to_string() }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        let status = match error.kind {
            SceneErrorKind::Io => Status::Io,
            SceneErrorKind::Syntax => Status::Syntax,
            SceneErrorKind::Missing => Status::Missing,
            SceneErrorKind::OutOfRange => Status::OutOfRange,
            SceneErrorKind::UnknownValue => Status::UnknownValue,
            SceneErrorKind::Name => Status::Name,
            SceneErrorKind::Conflict => Status::Conflict,
            SceneErrorKind::Recording => Status::Recording,
            SceneErrorKind::Table => Status::Table,
            SceneErrorKind::Mesh | SceneErrorKind::Record => Status::Mesh,
            SceneErrorKind::Path => Status::Path,
            SceneErrorKind::Grasp => Status::Grasp,
            SceneErrorKind::Coupling => Status::Coupling,
            SceneErrorKind::Device => Status::Device,
            // Kinds to come are told as the most general one.
            _ => Status::Model,
        };
        Self { status, line: error.line.unwrap_or(0), message: error.to_string() }
    }
}

impl Error {
    fn of(failure: &Failure) -> Self {
        let mut message = [0; MESSAGE_LENGTH];
        let mut end = failure.message.len().min(MESSAGE_LENGTH - 1);
        while !failure.message.is_char_boundary(end) {
            end -= 1;
        }
        for (out, byte) in message.iter_mut().zip(&failure.message.as_bytes()[..end]) {
            *out = *byte as c_char;
        }
        Self { status: failure.status, line: u32::try_from(failure.line).unwrap_or(u32::MAX), message }
    }
}

/// Runs the body of a function of the interface; a panic does not go through its caller.
///
/// # Safety
/// `error` can be written, or is null. What it points to may be uninitialised.
pub(crate) unsafe fn checked(error: *mut Error, body: impl FnOnce() -> Result<(), Failure>) -> Status {
    let result = catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a text");
        Err(Failure::panic(text))
    });
    match result {
        Ok(()) => Status::Ok,
        Err(failure) => {
            if !error.is_null() {
                // SAFETY: as promised by the caller.
                unsafe { error.write(Error::of(&failure)) };
            }
            failure.status
        }
    }
}

/// Writes a result.
///
/// # Safety
/// `to` can be written, or is null. What it points to may be uninitialised.
pub(crate) unsafe fn put<T>(to: *mut T, value: T) -> Result<(), Failure> {
    if to.is_null() {
        return Err(Failure::argument("the place for the result is null"));
    }
    // SAFETY: not null, and as promised by the caller.
    unsafe { to.write(value) };
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(error: &Error) -> String {
        let bytes = error.message.iter().map(|byte| *byte as u8).take_while(|byte| *byte != 0);
        String::from_utf8(bytes.collect()).expect("UTF-8")
    }

    #[test]
    fn a_panic_becomes_a_status_and_long_messages_are_cut_between_characters() {
        let mut error = Error::of(&Failure::argument(""));
        let mut checked = |body: fn() -> Result<(), Failure>| {
            // SAFETY: an error of this function.
            let status = unsafe { checked(&raw mut error, body) };
            (status, text(&error))
        };
        let bug = "bug of palpate: number 7".to_string();
        assert_eq!(checked(|| panic!("number {}", 7)), (Status::Panic, bug));
        let long = || Err(Failure::argument("µ".repeat(MESSAGE_LENGTH)));
        let cut = "µ".repeat((MESSAGE_LENGTH - 1) / 2);
        assert_eq!(checked(long), (Status::InvalidArgument, cut));
    }
}
