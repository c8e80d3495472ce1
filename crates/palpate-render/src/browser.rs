//! Images of a log, drawn by the viewer's page in a headless browser.

use crate::error::RenderError;
use crate::log_frames::LogFramePlayer;
use palpate_export::TemporaryFolder;
use palpate_scene::Progress;
use palpate_viewer::{RenderJob, RenderRequest, ServedContent, Server, Settings};
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Time without an image after which the browser is given up.
const TIMEOUT: Duration = Duration::from_secs(120);

/// Interval of checks whether the browser still runs.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Consumer of images: number, from 0, and PNG.
pub type ImageSink<'a> = &'a mut dyn FnMut(u64, Vec<u8>) -> Result<(), RenderError>;

/// Computes the frames of a log and renders the requested ones, in their order.
///
/// # Errors
/// When the log cannot be replayed, the browser does not work, `sink` fails, or `stop` is set.
pub fn render_log(
    log: LogFramePlayer,
    request: RenderRequest,
    browser: &Path,
    stop: &AtomicBool,
    progress: &mut dyn Progress,
    sink: ImageSink,
) -> Result<(), RenderError> {
    let frames = log.frames.clone();
    log.compute(stop, progress)?;
    let (sender, images) = channel();
    let settings = Settings::new((Ipv4Addr::LOCALHOST, 0).into());
    let server = Server::bind(&settings)?;
    let address = format!("http://{}/", server.address()?);
    let done = AtomicBool::new(false);
    let (size, count) = ((request.width, request.height), request.frames.len() as u64);
    std::thread::scope(|scope| {
        let serving = scope.spawn(|| {
            server.run(ServedContent::Render(frames, RenderJob { request, images: sender }), &done, &|_| {})
        });
        let drawn = Browser::open(browser, &address, size)
            .and_then(|mut browser| collect(&mut browser, (&images, count), stop, progress, sink));
        done.store(true, Ordering::Release);
        let served = serving.join().map_err(|_| RenderError::ServerPanic);
        drawn.and_then(|()| Ok(served??))
    })
}

/// Whether a program can be started.
pub fn program_runs(program: impl AsRef<Path>) -> bool {
    let quiet = |option: &str| {
        let mut command = Command::new(program.as_ref());
        command.arg(option).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    quiet("--version") || quiet("-version")
}

/// Given browser, or the first of those that are known.
///
/// # Errors
/// When it cannot be started, or there is none.
pub fn find_browser(given: Option<&Path>) -> Result<PathBuf, RenderError> {
    let known = ["chromium", "chromium-browser", "google-chrome", "chrome"].map(PathBuf::from);
    match given {
        Some(given) if program_runs(given) => Ok(given.to_path_buf()),
        Some(given) => Err(RenderError::BrowserStart { path: given.to_path_buf(), reason: None }),
        None => known.into_iter().find(|program| program_runs(program)).ok_or(RenderError::NoBrowser),
    }
}

/// Headless browser, ended on drop.
struct Browser {
    child: Child,
    _profile: TemporaryFolder,
}

impl Browser {
    fn open(program: &Path, address: &str, (width, height): (u32, u32)) -> Result<Self, RenderError> {
        let profile = TemporaryFolder::new().map_err(RenderError::TemporaryFolder)?;
        let mut command = Command::new(program);
        // Software rendering gives the same bytes on every machine with the same browser.
        command
            .args(["--headless", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
            .args(["--hide-scrollbars", "--force-device-scale-factor=1", "--no-first-run", "--disable-sync"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-quic"])
            .args(["--disable-background-timer-throttling", "--disable-renderer-backgrounding"])
            // There is no sandbox for root; the browser opens nothing but our own page.
            .arg("--no-sandbox")
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("--window-size={width},{height}"))
            .arg("--remote-debugging-port=0")
            .arg(address)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let failed = |error| RenderError::BrowserStart { path: program.to_path_buf(), reason: Some(error) };
        let child = command.spawn().map_err(failed)?;
        Ok(Self { child, _profile: profile })
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Hands on the images as they arrive, and checks their order.
fn collect(
    browser: &mut Browser,
    (images, count): (&Receiver<(u64, Vec<u8>)>, u64),
    stop: &AtomicBool,
    progress: &mut dyn Progress,
    sink: ImageSink,
) -> Result<(), RenderError> {
    progress.begin("pictures", count);
    let mut drawn = 0;
    let mut last = Instant::now();
    while drawn < count {
        if stop.load(Ordering::Relaxed) {
            return Err(RenderError::Interrupted(drawn));
        }
        match images.recv_timeout(POLL_INTERVAL) {
            Ok((number, png)) => {
                if number != drawn || !png.starts_with(b"\x89PNG") {
                    return Err(RenderError::Browser(format!("the browser sent no picture {drawn}")));
                }
                sink(number, png)?;
                drawn += 1;
                last = Instant::now();
                progress.advance(1);
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                if let Ok(Some(status)) = browser.child.try_wait() {
                    return Err(RenderError::Browser(format!(
                        "the browser has ended ({status}) before all pictures were drawn"
                    )));
                }
                if last.elapsed() > TIMEOUT {
                    return Err(RenderError::BrowserTimeout { seconds: TIMEOUT.as_secs() });
                }
            }
        }
    }
    Ok(())
}
