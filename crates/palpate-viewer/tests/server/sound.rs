//! Sound of a live scene for the pages that ask for it.

use super::client::TestServer;
use palpate_sound::CEILING;
use palpate_testkit::{free_block, half_extent};

/// Messages among which a block comes, if any does: frames come at 60 Hz, blocks at 200 Hz, status twice a second.
const MESSAGES: usize = 60;

#[test]
fn a_page_that_asks_hears_what_is_struck_and_others_hear_nothing() {
    let served = TestServer::live();
    let (mut page, mut other) = (served.page(), served.page());
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation") as u32;
    assert_eq!(page.sound(MESSAGES), None, "nobody has asked");
    page.send(r#"{"type":"sound","on":true}"#);
    // A finger pushes the body from the left.
    let low = -half_extent(&free_block(), 0);
    let at = |x: f64| format!("[{x:?},0.001,-0.001]");
    let start = low - 0.15 * free_block().surface.radius();
    page.send(&format!(r#"{{"type":"press","pointer":3,"mode":"touch","position":{}}}"#, at(start)));
    page.send(&format!(r#"{{"type":"move","pointers":[{{"pointer":3,"position":{}}}]}}"#, at(low + 0.005)));
    let mut heard = 0.0_f32;
    let mut samples = 0;
    for _ in 0..150 {
        let (of, rate, block) = page.sound(MESSAGES).expect("a block");
        assert_eq!((of, rate), (generation, 48_000));
        samples += block.len();
        heard = block.iter().fold(heard, |largest, sample| largest.max(sample.abs()));
    }
    assert!(heard > 1e-9 && f64::from(heard) <= CEILING && samples > 4800, "{heard} {samples}");
    assert_eq!(other.sound(MESSAGES), None, "it has not asked");
    // In slow motion frequencies would be wrong.
    page.send(r#"{"type":"slow_motion","slowdown":10}"#);
    while page.sound(MESSAGES).is_some() {}
    page.send(r#"{"type":"slow_motion","slowdown":1}"#);
    assert!(page.sound(MESSAGES).is_some(), "it goes on");
    page.send(r#"{"type":"sound","on":false}"#);
    while page.sound(MESSAGES).is_some() {}
}

#[test]
fn a_new_scene_sounds_for_pages_that_listen() {
    let served = TestServer::live();
    let mut page = served.page();
    let first = page.wait("scene")["generation"].as_u64().expect("a generation") as u32;
    page.send(r#"{"type":"sound","on":true}"#);
    assert_eq!(page.sound(MESSAGES).map(|(of, ..)| of), Some(first));
    page.send(r#"{"type":"reset"}"#);
    let later = (0..200).filter_map(|_| page.sound(MESSAGES)).find(|(of, ..)| *of > first);
    assert!(later.is_some(), "the scene that was reset");
}
