//! Logs that were cut: by a kill, a power cut or a full disk, at any byte.

use super::logs::{names, write_log};
use super::scenes::model;
use palpate::{DeviceMode, State, step};
use palpate_haptics::log::{LogReader, Recovered, WrittenLog, recover};
use palpate_testkit::largest_allocation;
use std::io::{Cursor, Error, Seek, SeekFrom, Write};

/// Steps of a log of several chunks.
const STEPS: u64 = 4000;

/// Distances of the bytes at which logs are cut, and disks are full: primes, so that no pattern of the file is met.
const CUT_STRIDE: usize = 9973;
const FULL_STRIDE: usize = 30_011;

fn log() -> Vec<u8> {
    let model = model(1, 300.0);
    let written =
        write_log(Cursor::new(Vec::new()), State::new(&model), &model, STEPS).expect("a log in memory");
    assert_eq!((written.steps, written.failure), (STEPS, None));
    written.sink.into_inner()
}

/// Number of steps of a log, or its error. Every step that it counts can be read.
fn steps_of(bytes: &[u8]) -> Result<u64, String> {
    let reader = LogReader::new(bytes).map_err(|error| error.to_string())?;
    let mut count = 0;
    for logged in reader.logged_steps() {
        count += 1;
        assert_eq!(logged.expect("a step").step, count);
    }
    assert_eq!(count, reader.step_count());
    assert_eq!(reader.metadata().expect("facts")["scene"], "a.toml");
    assert_eq!(reader.files().expect("files"), [("a.toml".to_string(), b"step = 1".to_vec())]);
    Ok(count)
}

#[test]
fn a_log_that_is_cut_at_any_byte_is_read_up_to_its_last_whole_chunk() {
    let bytes = log();
    let (mut known, mut counts) = (0, Vec::new());
    for end in (0..bytes.len()).step_by(CUT_STRIDE).chain(bytes.len() - 9..bytes.len()) {
        let cut = &bytes[..end];
        let found = match steps_of(cut) {
            Ok(steps) => steps,
            Err(error) if end < 8 => {
                assert_eq!(error, "the log can't be read: Bad magic number");
                0
            }
            Err(error) => {
                assert_eq!(
                    error, "the log ends before its first whole step: nothing of it can be read",
                    "{end}"
                );
                0
            }
        };
        assert!(found >= known, "{found} steps of {end} bytes, {known} of fewer");
        if found > known {
            counts.push(found);
        }
        known = found;
        // A power cut leaves zeros, or what was on the disk before.
        for tail in [[0_u8; 64], *b"PALPSAFETENSOR__PALPSAFETENSOR__PALPSAFETENSOR__PALPSAFETENSOR__"] {
            if found > 0 && end < bytes.len() - 200 {
                assert_eq!(steps_of(&[cut, &tail].concat()), Ok(found), "{end}");
            }
        }
    }
    assert!(counts.len() >= 3 && counts.last() == Some(&STEPS), "{counts:?}");
    assert!(!LogReader::new(&bytes).expect("a log").is_cut());
}

#[test]
fn what_is_read_of_a_cut_log_repeats_bit_for_bit() {
    let bytes = log();
    let reader = LogReader::new(&bytes[..bytes.len() * 2 / 3]).expect("a cut log");
    assert!(reader.is_cut());
    let model = model(1, 300.0);
    let mut state = State::new(&model);
    for logged in reader.logged_steps() {
        let logged = logged.expect("a step");
        let input = logged.input(&names(), &[DeviceMode::Touch]).expect("an input");
        step(&model, &mut state, &input);
        assert_eq!(logged.first_difference(&names(), state.output()), None, "step {}", logged.step);
    }
}

#[test]
fn a_recovered_log_is_whole_and_has_every_step_that_could_be_read() {
    let bytes = log();
    let whole = steps_of(&bytes).expect("a log");
    for end in [bytes.len() / 3, bytes.len() / 2, bytes.len() - 20] {
        let cut = &bytes[..end];
        let readable = steps_of(cut).expect("a cut log");
        let (recovered, sink) = recover(cut, Cursor::new(Vec::new())).expect("recovered");
        let lost_bytes = recovered.lost_bytes;
        assert_eq!(recovered, Recovered { steps: readable, lost_bytes });
        assert!(lost_bytes < end && readable <= whole, "{recovered:?}");
        let made = sink.into_inner();
        let reader = LogReader::new(&made).expect("a whole log");
        assert!(!reader.is_cut());
        assert_eq!(steps_of(&made), Ok(readable));
        let before = LogReader::new(cut).expect("a cut log");
        assert_eq!(reader.start(&names()).expect("a start"), before.start(&names()).expect("a start"));
        for (now, then) in reader.logged_steps().zip(before.logged_steps()) {
            assert_eq!(format!("{:?}", now.expect("a step")), format!("{:?}", then.expect("a step")));
        }
    }
    let error = |bytes: &[u8]| recover(bytes, Cursor::new(Vec::new())).expect_err("a refusal").to_string();
    assert_eq!(error(&bytes), "the log is whole: there is nothing to recover");
    assert_eq!(error(&bytes[..1000]), "the log ends before its first whole step: nothing of it can be read");
    assert_eq!(error(b"t,x,y,z\n"), "the log can't be read: Bad magic number");
}

#[test]
fn a_damaged_chunk_ends_what_is_recovered() {
    let mut bytes = log();
    let whole = steps_of(&bytes).expect("a log");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x55;
    let reader = LogReader::new(&bytes).expect("its summary is whole");
    let read = reader.logged_steps().take_while(Result::is_ok).count() as u64;
    assert!(reader.logged_steps().any(|step| step.is_err()), "the damage is told");
    let (recovered, sink) = recover(&bytes, Cursor::new(Vec::new())).expect("recovered");
    assert_eq!(recovered.steps, read);
    assert!(recovered.steps < whole && steps_of(&sink.into_inner()) == Ok(read), "{recovered:?}");
}

#[test]
fn outsized_lengths_are_refused_without_taking_memory_for_them() {
    let bytes = log();
    // The first record after the magic is the header: its length becomes 2⁶² bytes.
    let mut outsized = bytes[..bytes.len() / 2].to_vec();
    outsized[9..17].copy_from_slice(&(1_u64 << 62).to_le_bytes());
    assert_eq!(
        steps_of(&outsized),
        Err("the log ends before its first whole step: nothing of it can be read".to_string())
    );
}

/// Disk with room for so many bytes; it takes a part of what does not fit, as disks do.
struct Disk(Cursor<Vec<u8>>, usize);

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let room = self.1 - self.0.get_ref().len();
        if room == 0 {
            return Err(Error::other("no room is left"));
        }
        self.0.write(&bytes[..bytes.len().min(room)])
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn a_disk_that_is_full_at_any_byte_keeps_the_steps_that_are_reported() {
    let model = model(1, 300.0);
    let whole = log().len();
    let mut counts = Vec::new();
    for room in (0..whole).step_by(FULL_STRIDE) {
        let disk = Disk(Cursor::new(Vec::new()), room);
        match write_log(disk, State::new(&model), &model, STEPS) {
            Err(error) => {
                assert!(error.to_string().ends_with("no room is left"), "{room}: {error}");
            }
            Ok(WrittenLog { steps, sink, failure }) => {
                let error = failure.expect("it does not fit").to_string();
                assert!(
                    error.starts_with("cannot write the log: ") && error.ends_with("no room is left"),
                    "{error}"
                );
                // A chunk may be whole whose index did not fit.
                let readable = steps_of(&sink.0.into_inner()).unwrap_or(0);
                assert!(
                    steps <= readable && readable < steps + 1000,
                    "{steps}, {readable} with room for {room}"
                );
                counts.push(readable);
            }
        }
    }
    assert!(counts.iter().any(|steps| (1..STEPS).contains(steps)), "{counts:?}");
}

#[test]
fn texts_that_claim_to_be_longer_than_the_file_take_no_memory() {
    let whole = log();
    // Every place where the file names the scene's file: its attachment, and the indices of the summary.
    let places: Vec<usize> =
        whole.windows(6).enumerate().filter(|(_, text)| text == b"a.toml").map(|(at, _)| at).collect();
    assert!(places.len() >= 3, "{places:?}");
    largest_allocation();
    for at in places {
        let mut damaged = whole.clone();
        damaged[at - 4..at].copy_from_slice(&0xf000_0000_u32.to_le_bytes());
        let read = LogReader::new(&damaged[..]).and_then(|log| log.files().and(log.metadata()));
        if let Err(error) = read {
            let text = error.to_string();
            assert!(
                text == "the log can't be read: Unexpected end of file"
                    || text == "the log ends before its first whole step: nothing of it can be read",
                "{text}"
            );
        }
    }
    let largest = largest_allocation();
    assert!(largest < 64 << 20, "{largest}");
}

/// Reads the parts of a log, and its first steps. Whether it could be read does not matter.
fn read_all(bytes: &[u8]) {
    if let Ok(log) = LogReader::new(bytes) {
        let _ = (log.metadata(), log.files(), log.logged_steps().take(3).count());
    }
}

#[test]
fn records_cut_at_any_byte_are_refused() {
    let whole = log();
    let mut start = 8;
    while start < whole.len() - 8 {
        let content = start + 9;
        let length = usize::from_le_bytes(whole[start + 1..content].try_into().expect("8 bytes"));
        // The fields of a chunk end before its messages. Three bytes less than its checksum are what the parser panics at.
        for kept in (0..length.min(200)).step_by(3) {
            let mut damaged = whole[..content + kept].to_vec();
            damaged[start + 1..content].copy_from_slice(&kept.to_le_bytes());
            damaged.extend_from_slice(&whole[content + length..]);
            read_all(&damaged);
        }
        start = content + length;
    }
}

/// MCAP record.
fn record(opcode: u8, content: &[&[u8]]) -> Vec<u8> {
    let content = content.concat();
    [&[opcode][..], &content.len().to_le_bytes(), &content].concat()
}

#[test]
fn a_summary_within_an_attachment_is_none() {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    let claims_too_much = record(0x0d, &[&[0; 16], &0xf000_0000_u32.to_le_bytes()]);
    let length = claims_too_much.len().to_le_bytes();
    let attachment = record(0x09, &[&[0; 24], &length, &claims_too_much, &[0; 4]]);
    let start = [MAGIC, &record(0x01, &[&[0; 8]]), &attachment].concat();
    let place = start.len() - 4 - claims_too_much.len();
    let file = [&start, &record(0x02, &[&place.to_le_bytes(), &[0; 12]])[..], MAGIC].concat();
    largest_allocation();
    let error = LogReader::new(&file[..]).err().expect("it has no summary").to_string();
    assert_eq!(error, "the log ends before its first whole step: nothing of it can be read");
    let largest = largest_allocation();
    assert!(largest < 64 << 20, "{largest}");
}

#[test]
fn a_record_longer_than_its_chunk_is_an_error() {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    // A message of 60 bytes in a chunk of 20, without compression or checksum; what follows would fill it.
    let message = [&[0x05][..], &60_u64.to_le_bytes(), &[0; 11]].concat();
    let length = (message.len() as u64).to_le_bytes();
    let chunk = record(0x06, &[&[0; 16], &length, &[0; 4], &[0; 4], &length, &message]);
    let file = [MAGIC, &record(0x01, &[&[0; 8]]), &chunk, &record(0x0f, &[&[0; 4]]), &[0; 100]].concat();
    let error = LogReader::new(&file[..]).err().expect("it has no step").to_string();
    assert_eq!(error, "the log ends before its first whole step: nothing of it can be read");
}
