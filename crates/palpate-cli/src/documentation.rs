//! Programs of the pages, compiled and run by the doc tests.

/// Program of a page.
macro_rules! page {
    ($name:ident, $file:literal) => {
        #[doc = include_str!($file)]
        struct $name;
    };
}

page!(MyDevice, "../../../docs/my-device.md");
page!(Rust, "../../../docs/rust.md");
