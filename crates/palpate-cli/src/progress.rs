//! Progress of long work on standard error: a bar per stage on a terminal, a line per stage elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use palpate_fem::progress::Progress;
use std::io::IsTerminal;
use std::time::Instant;

/// Bars of offline work.
pub struct Bars {
    bar: Option<ProgressBar>,
    stage: Option<(String, Instant)>,
    interactive: bool,
}

impl Bars {
    /// Nothing is shown until a stage begins.
    pub fn new() -> Self {
        Self { bar: None, stage: None, interactive: std::io::stderr().is_terminal() }
    }

    /// Counts units of the present stage from any thread.
    pub fn counter(&self) -> impl Fn(usize) + Sync + use<> {
        let bar = self.bar.clone();
        move |units| {
            if let Some(bar) = &bar {
                bar.inc(units as u64);
            }
        }
    }

    /// The last stage is done.
    pub fn finish(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if let Some((stage, since)) = self.stage.take() {
            crate::tell(&format!("  {stage:<24} {:>7.2} s", since.elapsed().as_secs_f64()));
        }
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

    fn remark(&mut self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| crate::tell(&format!("warning: {text}"))),
            None => crate::tell(&format!("warning: {text}")),
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

/// Progress without remarks: where the paper's linear elements are what is wanted.
pub struct WithoutRemarks<'a>(pub &'a mut dyn Progress);

impl Progress for WithoutRemarks<'_> {
    fn begin(&mut self, stage: &str, total: u64) {
        self.0.begin(stage, total);
    }
    fn advance(&mut self, units: u64) {
        self.0.advance(units);
    }
    fn remark(&mut self, _text: &str) {}
}
