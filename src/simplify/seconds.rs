//! Where the time of a simplification goes, as the paper's Table 1 tells it.

use std::time::Instant;

/// Seconds spent in each routine. What happens once a vertex is timed every 64th time and scaled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Assigning quadrics.
    pub assign: f64,
    /// Spreading the classes of parity levels.
    pub classes: f64,
    /// Computing E(v) of all vertices whose star has changed, at the beginning of each level.
    pub cost: f64,
    /// Choosing: random vertices or the priority queue, and all that is not told apart here.
    pub choose: f64,
    /// Planning the flips of the vertices chosen.
    pub plan: f64,
    /// Flips, welds and removals, with the history and the quadrics handed on.
    pub remove: f64,
    /// Following which triangle covers which removed vertex.
    pub cover: f64,
    /// Measuring the error of each level.
    pub measure: f64,
}

impl Seconds {
    /// All of them.
    pub fn total(&self) -> f64 {
        self.parts().iter().map(|(_, seconds)| seconds).sum()
    }

    /// Each routine's name and seconds, in the order in which they run.
    pub fn parts(&self) -> [(&'static str, f64); 8] {
        [
            ("assign quadrics", self.assign),
            ("spread classes", self.classes),
            ("compute E(v)", self.cost),
            ("choose", self.choose),
            ("plan flips", self.plan),
            ("flip, weld, remove", self.remove),
            ("follow covering", self.cover),
            ("measure levels", self.measure),
        ]
    }
}

/// Measures [`Seconds`].
#[derive(Debug, Default)]
pub struct Stopwatch {
    /// So far.
    pub seconds: Seconds,
    costs: u64,
    removals: u64,
    last: Option<Instant>,
}

impl Stopwatch {
    /// Times the assignment of quadrics.
    pub fn assign<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (result, seconds) = timed(work);
        self.seconds.assign += seconds;
        result
    }

    /// Before the computation of one cost.
    #[inline]
    pub fn begin_cost(&mut self) {
        self.last = self.costs.is_multiple_of(EVERY).then(Instant::now);
        self.costs += 1;
    }

    /// After it.
    #[inline]
    pub fn end_cost(&mut self) {
        self.seconds.cost += self.lap();
        self.last = None;
    }

    /// Before the plan of a removal.
    pub fn begin_removal(&mut self) {
        self.last = self.removals.is_multiple_of(EVERY).then(Instant::now);
        self.removals += 1;
    }

    /// After it.
    pub fn planned(&mut self) {
        self.seconds.plan += self.lap();
    }

    /// After the removal itself.
    pub fn removed(&mut self) {
        self.seconds.remove += self.lap();
    }

    /// After the covering.
    pub fn covered(&mut self) {
        self.seconds.cover += self.lap();
        self.last = None;
    }

    /// What is left of a total goes to the choice.
    pub fn finish(mut self, total: f64) -> Seconds {
        self.seconds.choose = (total - self.seconds.total()).max(0.0);
        self.seconds
    }

    fn lap(&mut self) -> f64 {
        let Some(last) = self.last else { return 0.0 };
        let now = Instant::now();
        self.last = Some(now);
        (now - last).as_secs_f64() * EVERY as f64
    }
}

/// The result of some work and its seconds.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

/// One removal in so many is timed.
const EVERY: u64 = 64;
