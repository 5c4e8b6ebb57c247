//! A bar on the terminal, once work takes longer than a moment.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Tells on standard error how far the work is; clears itself away when dropped.
pub struct Progress {
    shown: bool,
    start: Instant,
    stage: &'static str,
    bar: Option<ProgressBar>,
    /// Where the bar goes, and what it is the bar of, if there are several.
    among: Option<(MultiProgress, String)>,
}

impl Progress {
    /// Silent where wanted, and where standard error is no terminal.
    pub fn new(quiet: bool) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        Self { shown, start: Instant::now(), stage: "", bar: None, among: None }
    }

    /// `done` of `total` units of this stage are done.
    pub fn update(&mut self, stage: &'static str, done: u64, total: u64) {
        if !self.shown || self.start.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(total).with_style(style(match self.among {
                Some(_) => "{prefix:24!} {msg:>10} {wide_bar} {percent:>3} % ",
                None => "{msg:>10} {wide_bar} {percent:>3} %  {eta} left ",
            }));
            match &self.among {
                Some((bars, name)) => bars.insert_from_back(1, bar).with_prefix(name.clone()),
                None => bar,
            }
        });
        if stage != self.stage {
            self.stage = stage;
            bar.set_message(stage);
            bar.reset();
        }
        bar.set_length(total);
        bar.set_position(done.min(total));
    }

    /// Takes the bar away while `work` writes to the terminal.
    pub fn aside<T>(&self, work: impl FnOnce() -> T) -> T {
        match &self.bar {
            Some(bar) => bar.suspend(work),
            None => work(),
        }
    }
}

/// Bars for several pieces of work, and beneath them one for all.
pub struct Bars(Option<(MultiProgress, ProgressBar)>);

impl Bars {
    /// For so many pieces, called as `noun` says; silent as [`Progress::new`].
    pub fn new(quiet: bool, pieces: usize, noun: &'static str) -> Self {
        if quiet || !std::io::stderr().is_terminal() {
            return Self(None);
        }
        let bars = MultiProgress::new();
        let all = ProgressBar::new(pieces as u64)
            .with_style(style("{pos} of {len} {msg} {wide_bar} {elapsed} "))
            .with_message(noun);
        let all = bars.add(all);
        all.tick();
        Self(Some((bars, all)))
    }

    /// The bar of one piece.
    pub fn piece(&self, name: String) -> Progress {
        let mut progress = Progress::new(self.0.is_none());
        progress.among = self.0.as_ref().map(|(bars, _)| (bars.clone(), name));
        progress
    }

    /// One piece more is done.
    pub fn done(&self) {
        if let Some((_, all)) = &self.0 {
            all.inc(1);
        }
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        if let Some((_, all)) = &self.0 {
            all.finish_and_clear();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);
