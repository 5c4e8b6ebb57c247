//! A bar on the terminal, once work takes longer than a moment.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Tells on standard error how far the work is; clears itself away when dropped.
pub struct Progress {
    shown: bool,
    start: Instant,
    stage: &'static str,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Silent where wanted, and where standard error is no terminal.
    pub fn new(quiet: bool) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        Self { shown, start: Instant::now(), stage: "", bar: None }
    }

    /// `done` of `total` units of this stage are done.
    pub fn update(&mut self, stage: &'static str, done: u64, total: u64) {
        if !self.shown || self.start.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            ProgressBar::new(total).with_style(
                ProgressStyle::with_template("{msg:>10} {wide_bar} {percent:>3} %  {eta} left ")
                    .unwrap_or_else(|_| ProgressStyle::default_bar()),
            )
        });
        if stage != self.stage {
            self.stage = stage;
            bar.set_message(stage);
            bar.reset();
        }
        bar.set_length(total);
        bar.set_position(done.min(total));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);
