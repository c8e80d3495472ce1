//! Pictures of a log, drawn by the viewer's page in a browser without a window.

use crate::Failure;
use crate::log_shows::ShownLog;
use indicatif::{ProgressBar, ProgressStyle};
use palpate_viewer::{RenderJob, RenderRequest, ServedContent, Server, Settings};
use std::io::IsTerminal;
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A browser that has drawn nothing for so long does not work.
const PATIENCE: Duration = Duration::from_secs(120);

/// Between two looks at the browser.
const LOOK: Duration = Duration::from_millis(100);

/// What a picture is given to: its number, counted from 0, and the PNG.
pub type TakePicture<'a> = &'a mut dyn FnMut(u64, Vec<u8>) -> Result<(), Failure>;

/// Compute a log again and draw what is wished for, in its order, until it is done or `stop` is set.
pub fn draw(
    log: ShownLog,
    wish: RenderRequest,
    browser: &Path,
    stop: &AtomicBool,
    take: TakePicture,
) -> Result<(), Failure> {
    let show = log.show.clone();
    log.make(stop)?;
    let (pictures, arrived) = channel();
    let settings = Settings { listen: (Ipv4Addr::LOCALHOST, 0).into(), token: None };
    let server = Server::bind(&settings).map_err(Failure)?;
    let address = format!("http://{}/", server.address().map_err(Failure)?);
    let done = AtomicBool::new(false);
    let (size, count) = ((wish.width, wish.height), wish.frames.len() as u64);
    std::thread::scope(|scope| {
        let serving =
            scope.spawn(|| server.run(ServedContent::Render(show, RenderJob { wish, pictures }), &done));
        let drawn = Browser::open(browser, &address, size)
            .and_then(|mut browser| collect(&mut browser, &arrived, count, stop, take));
        done.store(true, Ordering::Release);
        let served = serving.join().map_err(|_| Failure("the server has ended by a bug".into()));
        drawn.and_then(|()| served?.map_err(Failure))
    })
}

/// Whether a program is there.
pub fn runs(program: impl AsRef<Path>) -> bool {
    let quiet = |option: &str| {
        let mut command = Command::new(program.as_ref());
        command.arg(option).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    quiet("--version") || quiet("-version")
}

/// The browser that was named, or the first known one that is there.
pub fn find_browser(given: Option<&Path>) -> Result<PathBuf, Failure> {
    let known = ["chromium", "chromium-browser", "google-chrome", "chrome"].map(PathBuf::from);
    match given {
        Some(given) if runs(given) => Ok(given.to_path_buf()),
        Some(given) => Err(Failure(format!("the browser {} can't be started", given.display()))),
        None => known.into_iter().find(|program| runs(program)).ok_or_else(|| {
            Failure(
                "pictures are drawn by a browser, and there is none: install chromium (apt install chromium), or name one with --browser"
                    .into(),
            )
        }),
    }
}

/// A browser without a window; it ends with this.
struct Browser {
    child: Child,
    _profile: TempDir,
}

impl Browser {
    fn open(program: &Path, address: &str, (width, height): (u32, u32)) -> Result<Self, Failure> {
        let profile =
            TempDir::new().map_err(|e| Failure(format!("cannot make a folder for the browser: {e}")))?;
        let mut command = Command::new(program);
        // Drawn by software, the same bytes on every machine with the same browser.
        command
            .args(["--headless", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
            .args(["--hide-scrollbars", "--force-device-scale-factor=1", "--no-first-run", "--disable-sync"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-quic"])
            .args(["--disable-background-timer-throttling", "--disable-renderer-backgrounding"])
            // As root it has no sandbox; it shows nothing but our own page.
            .arg("--no-sandbox")
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("--window-size={width},{height}"))
            .arg("--remote-debugging-port=0")
            .arg(address)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let child = command
            .spawn()
            .map_err(|e| Failure(format!("the browser {} can't be started: {e}", program.display())))?;
        Ok(Self { child, _profile: profile })
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Take the pictures as they arrive, in their order.
fn collect(
    browser: &mut Browser,
    arrived: &Receiver<(u64, Vec<u8>)>,
    count: u64,
    stop: &AtomicBool,
    take: TakePicture,
) -> Result<(), Failure> {
    let bar = if std::io::stderr().is_terminal() { ProgressBar::new(count) } else { ProgressBar::hidden() };
    if let Ok(style) = ProgressStyle::with_template("{wide_bar} {pos}/{len} pictures, {eta} left") {
        bar.set_style(style);
    }
    let mut drawn = 0;
    let mut last = Instant::now();
    while drawn < count {
        if stop.load(Ordering::Relaxed) {
            return Err(Failure(format!("interrupted: {drawn} pictures are drawn")));
        }
        match arrived.recv_timeout(LOOK) {
            Ok((number, png)) => {
                if number != drawn || !png.starts_with(b"\x89PNG") {
                    return Err(Failure(format!("the browser sent no picture {drawn}")));
                }
                take(number, png)?;
                drawn += 1;
                last = Instant::now();
                bar.inc(1);
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                if let Ok(Some(status)) = browser.child.try_wait() {
                    return Err(Failure(format!(
                        "the browser has ended ({status}) before all pictures were drawn"
                    )));
                }
                if last.elapsed() > PATIENCE {
                    return Err(Failure(format!(
                        "the browser has drawn nothing for {} s: it may lack WebGL 2; try another with --browser",
                        PATIENCE.as_secs()
                    )));
                }
            }
        }
    }
    bar.finish_and_clear();
    Ok(())
}
