//! Panics where memory has run out.
//!
//! faer panics where a matrix finds no memory. The standard library's hook then allocates for a backtrace under a lock, and where that fails, too,
//! its message about memory waits for the same lock for ever (`RUST_BACKTRACE=1`).

/// Memory in which a backtrace is made [bytes]: of the program's 40 MB, the tables of its symbols.
const BACKTRACE_BYTES: usize = 64 << 20;

/// Let panics without memory for a backtrace end the program at once, as a failed allocation does.
pub(crate) fn install() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if Vec::<u8>::new().try_reserve_exact(BACKTRACE_BYTES).is_err() {
            eprintln!("error: there is not enough memory");
            std::process::abort();
        }
        usual(panic);
    }));
}
