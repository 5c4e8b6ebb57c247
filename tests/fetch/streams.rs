//! Streams of events: the same as the decoder's, no quicker than they are taken, gone when they are dropped.

use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::{Context, Poll};

use bytes::Bytes;
use futures_util::{StreamExt, TryStreamExt};
use tokio::io::{AsyncRead, ReadBuf};
use unweld::client::{RangeSource, Refinement, refine, refine_ranges, whole_file};
use unweld::container::{Contents, Measure, Want, plan, plan_from_keyframe};
use unweld::decoder::{Decoder, Event, Options, Until};
use unweld::mesh::IndexedMesh;
use unweld::{Error, Result};

use super::{coded, exact_and_ordered, in_an_order};

/// Bytes in pieces, each after having kept the reader waiting once; counts what was taken, and says when it is gone.
struct Slow {
    bytes: Vec<u8>,
    size: usize,
    waited: bool,
    taken: Arc<AtomicUsize>,
    gone: Arc<AtomicUsize>,
}

impl Slow {
    fn new(bytes: &[u8], size: usize) -> Self {
        Self { bytes: bytes.to_vec(), size, waited: false, taken: Arc::default(), gone: Arc::default() }
    }
}

impl AsyncRead for Slow {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<std::io::Result<()>> {
        self.waited = !self.waited;
        if self.waited {
            cx.waker().wake_by_ref();
            return Poll::Pending;
        }
        let start = self.taken.load(Ordering::SeqCst);
        let count = self.size.min(buffer.remaining()).min(self.bytes.len() - start);
        buffer.put_slice(&self.bytes[start..start + count]);
        self.taken.fetch_add(count, Ordering::SeqCst);
        Poll::Ready(Ok(()))
    }
}

impl Drop for Slow {
    fn drop(&mut self) {
        self.gone.fetch_add(1, Ordering::SeqCst);
    }
}

fn run<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(future)
}

fn all(events: &mut Refinement<'_>) -> Result<Vec<Event>> {
    run(events.try_collect())
}

/// What the decoder tells of bytes that are all there.
fn told(mut decoder: Decoder, bytes: &[u8]) -> Vec<Event> {
    decoder.push(bytes);
    std::iter::from_fn(|| decoder.poll().unwrap()).collect()
}

#[test]
fn events_are_those_of_the_decoder() {
    let (file, _) = coded(1);
    let expected = told(Decoder::new(Options::default()), &file);
    assert!(expected.len() > 20 && expected.last() == Some(&Event::End));
    for size in [1, 100, 1400, 1 << 20] {
        let mut events = refine(Slow::new(&file, size), Options::default());
        assert_eq!(all(&mut events).unwrap(), expected);
        assert!(run(events.next()).is_none(), "an end is an end");
        assert_eq!(events.decoder().level(), Some(0));
    }
}

#[test]
fn a_reader_is_dropped_where_decoding_stops() {
    let (file, contents) = coded(1);
    let reader = Slow::new(&file, 50);
    let (taken, gone) = (reader.taken.clone(), reader.gone.clone());
    let until = Until { level: 3, ..Until::default() };
    let mut events = refine(reader, Options { until, ..Options::default() });
    let last = all(&mut events).unwrap().pop();
    assert_eq!((last, gone.load(Ordering::SeqCst)), (Some(Event::Stopped), 1));
    let end = contents.bytes(contents.steps(3)).end as usize;
    assert!((end..end + 50).contains(&taken.load(Ordering::SeqCst)));
    let whole = unweld::decoder::decode(&file, Options { until, ..Options::default() }).unwrap();
    assert_eq!(events.decoder().assembled().unwrap(), whole.assembled().unwrap());
}

#[test]
fn nothing_is_read_ahead_and_dropping_cancels() {
    let (file, contents) = coded(1);
    let reader = Slow::new(&file, 10);
    let (taken, gone) = (reader.taken.clone(), reader.gone.clone());
    run(async {
        let mut events = refine(reader, Options::default());
        assert_eq!(taken.load(Ordering::SeqCst), 0, "nothing is done before it is asked for");
        while let Some(event) = events.next().await {
            if matches!(event.unwrap(), Event::Level { .. }) {
                break;
            }
        }
        tokio::task::yield_now().await;
        let base = contents.base_end() as usize;
        assert!((base..base + 10).contains(&taken.load(Ordering::SeqCst)), "what was taken waits for nobody");
        // Cancelled in the middle of a read.
        let waiting = events.next();
        tokio::select! {
            biased;
            _ = waiting => panic!("the reader keeps it waiting"),
            () = std::future::ready(()) => {}
        }
        assert_eq!(gone.load(Ordering::SeqCst), 0);
        drop(events);
        assert_eq!(gone.load(Ordering::SeqCst), 1);
    });
}

#[test]
fn a_read_that_was_given_up_is_taken_up_again() {
    let (file, _) = coded(1);
    let expected = told(Decoder::new(Options::default()), &file);
    let events = run(async {
        let mut stream = refine(Slow::new(&file, 333), Options::default());
        let mut events = Vec::new();
        loop {
            tokio::select! {
                biased;
                event = stream.next() => match event {
                    Some(event) => events.push(event.unwrap()),
                    None => return events,
                },
                () = std::future::ready(()) => {}
            }
        }
    });
    assert_eq!(events, expected);
}

#[test]
fn files_that_are_cut_off_damaged_or_too_long() {
    let (file, contents) = coded(1);
    let fault = |bytes: &[u8]| match all(&mut refine(Slow::new(bytes, 700), Options::default())) {
        Err(Error::Format(fault)) => fault.to_string(),
        other => panic!("{other:?}"),
    };
    let missing = format!("byte {}: the file is cut off: 5 bytes are missing (spec §3.1)", file.len() - 5);
    assert_eq!(fault(&file[..file.len() - 5]), missing);
    let mut damaged = file.clone();
    let atom = contents.atoms[4];
    damaged[atom.offset as usize] ^= 1;
    assert!(fault(&damaged).starts_with(&format!("byte {}: atom 4 (", atom.offset)));
    let long = [&file[..], b"xyz"].concat();
    assert_eq!(fault(&long), format!("byte {}: 3 bytes behind the last atom (spec §3.1)", file.len()));
    // After an error there is nothing.
    let mut events = refine(&damaged[..], Options::default());
    run(async {
        while events.next().await.is_some_and(|event| event.is_ok()) {}
        assert!(events.next().await.is_none());
    });
}

#[test]
fn a_reader_without_an_end() {
    let (file, _) = coded(1);
    let endless = tokio::io::AsyncReadExt::chain(&file[..], tokio::io::repeat(0));
    let error = all(&mut refine(endless, Options::default())).unwrap_err();
    assert!(error.to_string().contains("bytes behind the last atom"), "{error}");
    let noise = all(&mut refine(tokio::io::repeat(0), Options::default())).unwrap_err();
    assert_eq!(noise.to_string(), "byte 0: not a .uwm file (spec §3.2)");
}

/// A file in memory that gives small pieces, and remembers which bytes it was asked for.
struct Pieces(Bytes, usize, Arc<std::sync::Mutex<Vec<u64>>>);

impl RangeSource for Pieces {
    async fn read(&mut self, range: std::ops::Range<u64>) -> std::io::Result<Bytes> {
        let piece = self.0.read(range.start..range.end.min(range.start + self.1 as u64)).await?;
        self.2.lock().unwrap().extend(range.start..range.start + piece.len() as u64);
        Ok(piece)
    }
}

#[test]
fn a_plan_takes_its_bytes_and_no_others() {
    let (file, contents) = coded(1);
    let base = contents.base_level();
    let plans = [
        plan(&contents, Want::Level(base)),
        plan(&contents, Want::Level(3)),
        plan(&contents, Want::Triangles(900)),
        plan(&contents, Want::Bytes(file.len() as u64 / 3)),
        plan(&contents, Want::All),
        plan_from_keyframe(&contents, 2),
        plan_from_keyframe(&contents, 0),
        whole_file(&contents),
    ];
    for (plan, size) in plans.into_iter().zip([1, 17, 100, 1000, 64, 1 << 20, 5000, 999]) {
        let asked = Arc::default();
        let source = Pieces(file.clone().into(), size, Arc::clone(&asked));
        let wanted = plan.clone();
        let mut events = refine_ranges(source, move |_| Ok(wanted), Options::default());
        let told_here = all(&mut events).unwrap();
        assert_eq!(told_here[0], Event::Contents(contents.clone()));
        let mut decoder = Decoder::of_plan(contents.clone(), &plan, Options::default());
        for part in &plan.parts {
            decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
        }
        while decoder.poll().unwrap().is_some() {}
        assert_eq!(events.decoder().assembled().unwrap(), decoder.assembled().unwrap());
        let table = 0..contents.header.table_end();
        let parts = plan.parts.iter().map(|part| part.bytes.clone());
        let mut expected: Vec<u64> = std::iter::once(table).chain(parts).flatten().collect();
        let mut asked = asked.lock().unwrap().clone();
        if size < 2000 {
            // Behind the table and behind each part there may be the rest of a piece.
            asked.sort_unstable();
            asked.dedup();
            expected.sort_unstable();
            assert!(expected.iter().all(|at| asked.binary_search(at).is_ok()));
            assert!(asked.len() < expected.len() + 2 * size, "{} of {}", asked.len(), expected.len());
        }
    }
}

#[test]
fn an_exact_and_ordered_file_comes_whole() {
    let mesh = in_an_order();
    let file = exact_and_ordered(&mesh);
    let small = |measure| Want::Error(measure, 0.0);
    for want in [Want::All, Want::Level(0), small(Measure::Max), small(Measure::Rms), Want::Bytes(u64::MAX)] {
        let planner = move |contents: &Contents| Ok(plan(contents, want));
        let mut events = refine_ranges(Bytes::from(file.clone()), planner, Options::default());
        all(&mut events).unwrap();
        let back = events.decoder().assembled().unwrap();
        let bits =
            |mesh: &IndexedMesh| mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect::<Vec<_>>();
        assert!(bits(&back) == bits(&mesh) && back.triangles == mesh.triangles, "{want:?}");
        assert!(events.decoder().metadata().is_some());
    }
}

#[test]
fn what_the_planner_refuses() {
    let (file, _) = coded(1);
    let refuse = |_: &_| Err(Error::Parameter("no such thing".to_owned()));
    let error = all(&mut refine_ranges(Bytes::from(file), refuse, Options::default())).unwrap_err();
    assert_eq!(error.to_string(), "no such thing");
}

#[test]
fn a_table_that_promises_more_than_there_is() {
    let (file, contents) = coded(1);
    let asked = Arc::default();
    let half = file[..file.len() / 2].to_vec();
    let length = half.len();
    struct Short(Pieces);
    impl RangeSource for Short {
        async fn read(&mut self, range: std::ops::Range<u64>) -> std::io::Result<Bytes> {
            self.0.read(range).await
        }
        fn length(&self) -> Option<u64> {
            self.0.length().or(Some(self.0.0.len() as u64))
        }
    }
    let source = Short(Pieces(half.into(), 16, Arc::clone(&asked)));
    let events = all(&mut refine_ranges(source, |contents| Ok(whole_file(contents)), Options::default()));
    let missing = file.len() - length;
    let expected = format!("byte {length}: the file is cut off: {missing} bytes are missing (spec §3.1)");
    assert_eq!(events.unwrap_err().to_string(), expected);
    let most = contents.header.table_end() as usize + 16;
    assert!(asked.lock().unwrap().len() <= most, "no atom was asked for");
}
