//! Who may stay: as many connections as there are seats. Where all are taken, the one that has been idle for the longest time makes room.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};

/// All seats.
#[derive(Debug)]
pub struct Seats {
    free: Arc<Semaphore>,
    idle: Mutex<Idle>,
}

#[derive(Debug, Default)]
struct Idle {
    /// By when they became idle: the first has been so for the longest time.
    seats: BTreeMap<u64, (Instant, Arc<Notify>)>,
    next: u64,
}

/// The seat of a connection, until it is dropped.
#[derive(Debug)]
pub struct Seat {
    seats: Arc<Seats>,
    state: Mutex<State>,
    leave: Arc<Notify>,
    _permit: Option<OwnedSemaphorePermit>,
}

#[derive(Debug, Default)]
struct State {
    /// Requests whose answers are under way.
    answers: usize,
    /// Whether something waits to be sent.
    blocked: bool,
    /// Its place among the idle ones.
    idle: Option<u64>,
}

/// An answer under way, until it is dropped.
#[derive(Debug)]
pub struct Answer(Arc<Seat>);

impl Seats {
    /// So many, at least one.
    pub fn new(count: usize) -> Arc<Self> {
        let free = Arc::new(Semaphore::new(count.clamp(1, Semaphore::MAX_PERMITS)));
        Arc::new(Self { free, idle: Mutex::default() })
    }

    /// A seat, as soon as there is one. As long as there is none, those leave that have been idle for the longest time.
    pub async fn take(self: &Arc<Self>) -> Arc<Seat> {
        let permit = loop {
            tokio::select! {
                biased;
                permit = self.free.clone().acquire_owned() => break permit.ok(),
                () = self.make_room() => {}
            }
        };
        let seat =
            Seat { seats: self.clone(), state: Mutex::default(), leave: Arc::default(), _permit: permit };
        seat.change(|_| {});
        Arc::new(seat)
    }

    /// Bids the longest idle one leave, and gives it time to do so. Who has just come is not bidden: its request may be under way.
    async fn make_room(&self) {
        let first = {
            let mut idle = lock(&self.idle);
            idle.seats
                .first_entry()
                .filter(|entry| entry.get().0.elapsed() >= WELCOME)
                .map(|entry| entry.remove())
        };
        if let Some((_, leave)) = first {
            leave.notify_one();
        }
        tokio::time::sleep(PAUSE).await;
    }
}

impl Seat {
    /// A request has come.
    pub fn answer(self: &Arc<Self>) -> Answer {
        self.change(|state| state.answers += 1);
        Answer(self.clone())
    }

    /// Whether something waits to be sent.
    pub fn set_blocked(&self, blocked: bool) {
        self.change(|state| state.blocked = blocked);
    }

    /// Ready once it is to leave and is still idle.
    pub async fn bidden(&self) {
        loop {
            self.leave.notified().await;
            let mut state = lock(&self.state);
            if state.is_idle() {
                return;
            }
            // It was busy before it heard of it.
            state.idle = None;
        }
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        let mut state = lock(&self.state);
        change(&mut state);
        match (state.is_idle(), state.idle) {
            (true, None) => {
                let mut idle = lock(&self.seats.idle);
                let number = idle.next;
                idle.next += 1;
                idle.seats.insert(number, (Instant::now(), self.leave.clone()));
                state.idle = Some(number);
            }
            (false, Some(number)) => {
                lock(&self.seats.idle).seats.remove(&number);
                state.idle = None;
            }
            (true, Some(_)) | (false, None) => {}
        }
    }
}

impl State {
    fn is_idle(&self) -> bool {
        self.answers == 0 && !self.blocked
    }
}

impl Drop for Answer {
    fn drop(&mut self) {
        self.0.change(|state| state.answers = state.answers.saturating_sub(1));
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        if let Some(number) = lock(&self.state).idle.take() {
            lock(&self.seats.idle).seats.remove(&number);
        }
    }
}

/// Nothing panics while it is locked.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How long a connection that is idle may stay in any case.
const WELCOME: Duration = Duration::from_millis(50);
/// How long one that is bidden to leave may take before the next is.
const PAUSE: Duration = Duration::from_millis(2);

#[cfg(test)]
mod tests {
    use super::*;

    fn run(future: impl Future<Output = ()>) {
        tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(future);
    }

    /// Leaves when it is bidden.
    fn sit(seat: Arc<Seat>) -> tokio::task::JoinHandle<()> {
        tokio::spawn(async move { seat.bidden().await })
    }

    #[test]
    fn the_longest_idle_one_leaves_and_no_other() {
        run(async {
            let seats = Seats::new(3);
            let busy = seats.take().await;
            let answer = busy.answer();
            let (first, second) = (seats.take().await, seats.take().await);
            // The first speaks once more: now the second is the one that has waited longest.
            drop(first.answer());
            let [busy, first, second] = [busy, first, second].map(sit);
            tokio::time::sleep(WELCOME).await;
            let third = seats.take().await;
            second.await.unwrap();
            assert!(!first.is_finished() && !busy.is_finished());
            third.set_blocked(true);
            let fourth = seats.take().await;
            first.await.unwrap();
            assert!(!busy.is_finished());
            // Nobody is idle but the one that comes now: it waits until an answer has come to its end.
            let answers = [fourth.answer()];
            let waiting = tokio::spawn(async move { drop(seats.take().await) });
            tokio::time::sleep(4 * WELCOME).await;
            assert!(!waiting.is_finished() && !busy.is_finished());
            drop(answer);
            waiting.await.unwrap();
            busy.await.unwrap();
            drop((answers, third, fourth));
        });
    }
}
