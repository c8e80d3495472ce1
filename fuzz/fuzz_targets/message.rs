//! Messages of pages, and datagrams and greetings of links.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    palpate_haptics::decodes_link_message(bytes);
    if let Ok(text) = std::str::from_utf8(bytes) {
        palpate_viewer::decodes(text);
    }
});
