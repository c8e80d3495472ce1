//! Progress on standard error: a bar per stage on a terminal, a line per stage elsewhere.

use crate::terminal::notify;
use indicatif::{ProgressBar, ProgressStyle};
use palpate_fem::Progress;
use palpate_reproduce::StageProgress;
use std::io::IsTerminal;
use std::time::Instant;

/// Progress of recording: a bar per stage, and its time when it is done.
pub struct Bars {
    bar: Option<ProgressBar>,
    stage: Option<(String, Instant)>,
    interactive: bool,
}

impl Bars {
    /// Shows nothing until a stage begins.
    pub fn new() -> Self {
        Self { bar: None, stage: None, interactive: std::io::stderr().is_terminal() }
    }

    /// Counter of the current stage for other threads.
    pub fn counter(&self) -> impl Fn(usize) + Sync + use<> {
        let bar = self.bar.clone();
        move |units| {
            if let Some(bar) = &bar {
                bar.inc(units as u64);
            }
        }
    }

    /// Ends the last stage.
    pub fn finish(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if let Some((stage, since)) = self.stage.take() {
            notify(&format!("  {stage:<24} {:>7.2} s", since.elapsed().as_secs_f64()));
        }
    }
}

impl StageProgress for Bars {
    fn finish(&mut self) {
        self.finish();
    }

    fn counter(&self) -> Box<dyn Fn(usize) + Sync> {
        Box::new(self.counter())
    }
}

impl Progress for Bars {
    fn begin(&mut self, stage: &str, total: u64) {
        self.finish();
        self.stage = Some((stage.to_string(), Instant::now()));
        if self.interactive {
            let style = ProgressStyle::with_template("  {msg:<24} {bar:30} {pos}/{len}, {eta} left");
            let bar = ProgressBar::new(total);
            if let Ok(style) = style {
                bar.set_style(style);
            }
            bar.set_message(stage.to_string());
            bar.enable_steady_tick(std::time::Duration::from_millis(200));
            self.bar = Some(bar);
        }
    }

    fn advance(&mut self, units: u64) {
        if let Some(bar) = &self.bar {
            bar.inc(units);
        }
    }

    fn warn(&mut self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| notify(&format!("warning: {text}"))),
            None => notify(&format!("warning: {text}")),
        }
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

/// Bar of a count on a terminal, without a line when it is done.
pub struct CountBar {
    bar: ProgressBar,
    template: &'static str,
    pending: u64,
}

/// Units between two updates of a [`CountBar`].
const UPDATE_INTERVAL: u64 = 256;

impl CountBar {
    /// Bar of steps.
    pub fn steps() -> Self {
        Self::new("{wide_bar} {pos}/{len} steps, {eta} left")
    }

    /// Bar with a template of [`indicatif`].
    pub fn new(template: &'static str) -> Self {
        Self { bar: ProgressBar::hidden(), template, pending: 0 }
    }
}

impl Progress for CountBar {
    fn begin(&mut self, stage: &str, total: u64) {
        self.bar.finish_and_clear();
        self.pending = 0;
        if std::io::stderr().is_terminal() {
            self.bar = ProgressBar::new(total);
            if let Ok(style) = ProgressStyle::with_template(self.template) {
                self.bar.set_style(style);
            }
            self.bar.set_message(stage.to_string());
        }
    }

    fn advance(&mut self, units: u64) {
        self.pending += units;
        let (position, length) = (self.bar.position() + self.pending, self.bar.length().unwrap_or(0));
        if self.pending >= UPDATE_INTERVAL || length < 10 * UPDATE_INTERVAL {
            self.bar.set_position(position);
            self.pending = 0;
        }
    }

    fn warn(&mut self, text: &str) {
        self.bar.suspend(|| notify(&format!("warning: {text}")));
    }
}

impl Drop for CountBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
