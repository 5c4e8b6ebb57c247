//! Points spread over a surface, and how far another surface is from them.

use glam::DVec3;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use super::frame::Frame;
use super::search::TriangleSearch;
use super::{Sampling, SurfaceDistance};
use crate::mesh::indexed::IndexedMesh;
use crate::mesh::random::SplitMix64;

/// A mesh with at least one triangle, ready to be measured and to be measured from.
pub(super) struct Surface {
    search: TriangleSearch,
    /// Twice the area of all triangles up to and with each, in the order of the search.
    areas: Vec<f64>,
    /// The vertices that triangles use, each once, in that order.
    vertices: Vec<DVec3>,
}

impl Surface {
    pub(super) fn new(mesh: &IndexedMesh, frame: &Frame, threads: NonZeroUsize) -> Self {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|&p| frame.inside(p)).collect();
        let (search, order) = TriangleSearch::new(&positions, &mesh.triangles, threads);
        let twice_area = |&[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).length();
        let sums = search.triangles().iter().map(twice_area).scan(0.0, |sum, area| {
            *sum += area;
            Some(*sum)
        });
        let areas = sums.collect();
        let mut seen = vec![false; positions.len()];
        let corners = order.iter().flat_map(|&t| mesh.triangles[t as usize]);
        let first = corners.filter(|&v| !std::mem::replace(&mut seen[v as usize], true));
        let vertices = first.map(|v| positions[v as usize]).collect();
        Self { search, areas, vertices }
    }

    /// Points that [`Surface::distance`] measures.
    pub(super) fn points(&self, sampling: &Sampling) -> u64 {
        self.samples(sampling).saturating_add(self.vertices.len() as u64)
    }

    /// How far this is from `to`; `progress` is told how many points are done.
    pub(super) fn distance(
        &self,
        to: &Self,
        sampling: &Sampling,
        progress: &mut dyn FnMut(u64),
    ) -> SurfaceDistance {
        let samples = self.samples(sampling);
        let mut seeds = SplitMix64::new(sampling.seed);
        let phase = seeds.unit();
        let seeds: Vec<u64> = (0..CHUNKS).map(|_| seeds.next_u64()).collect();
        let work = |chunk: usize| {
            let mut probe = Probe { search: &to.search, near: 0 };
            let mut random = SplitMix64::new(seeds[chunk]);
            let mut area = Tally::default();
            self.spread(share(samples, chunk), samples, phase, |[a, b, c]| {
                let (u, v) = (random.unit(), random.unit());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                area.add(probe.distance(a + (b - a) * u + (c - a) * v));
            });
            let mut vertices = Tally::default();
            let Range { start, end } = share(self.vertices.len() as u64, chunk);
            for &p in &self.vertices[start as usize..end as usize] {
                vertices.add(probe.distance(p));
            }
            [area, vertices]
        };
        let mut done = 0;
        let tallies = in_chunks(sampling.threads, work, |[area, vertices]| {
            done += area.count + vertices.count;
            progress(done);
        });
        let [area, vertices] = [0, 1].map(|k| tallies.iter().fold(Tally::default(), |sum, t| sum.and(&t[k])));
        let average = if area.count > 0 { &area } else { &vertices };
        SurfaceDistance {
            mean: average.sum / average.count as f64,
            rms: (average.sum_of_squares / average.count as f64).sqrt(),
            max: area.max.max(vertices.max),
            samples: area.count,
            vertices: vertices.count,
        }
    }

    /// Points on the area: none where there is no area.
    fn samples(&self, sampling: &Sampling) -> u64 {
        if self.area() > 0.0 && self.area().is_finite() { sampling.samples } else { 0 }
    }

    fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// Names the triangle of each of the samples in `range`: sample k of n lies where the share (k + phase) / n of the area
    /// is reached, so that the counts of triangles are their shares, rounded up or down.
    fn spread(&self, range: Range<u64>, samples: u64, phase: f64, mut of_sample: impl FnMut([DVec3; 3])) {
        let place = |k: u64| (k as f64 + phase) / samples as f64 * self.area();
        let last = self.areas.len() - 1;
        let mut t = self.areas.partition_point(|&sum| sum <= place(range.start)).min(last);
        for k in range {
            while t < last && self.areas[t] <= place(k) {
                t += 1;
            }
            of_sample(self.search.triangles()[t]);
        }
    }
}

/// Asks for the distances of one point after another. Successive points are near each other: the triangle nearest to the
/// last one bounds the search.
struct Probe<'s> {
    search: &'s TriangleSearch,
    near: u32,
}

impl Probe<'_> {
    fn distance(&mut self, p: DVec3) -> f64 {
        let (distance, near) = self.search.nearest(p, self.near);
        self.near = near;
        distance
    }
}

#[derive(Clone, Copy, Default)]
struct Tally {
    count: u64,
    sum: f64,
    sum_of_squares: f64,
    max: f64,
}

impl Tally {
    fn add(&mut self, distance: f64) {
        self.count += 1;
        self.sum += distance;
        self.sum_of_squares += distance * distance;
        self.max = self.max.max(distance);
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            count: self.count + other.count,
            sum: self.sum + other.sum,
            sum_of_squares: self.sum_of_squares + other.sum_of_squares,
            max: self.max.max(other.max),
        }
    }
}

/// The part of `n` things that belongs to a chunk.
fn share(n: u64, chunk: usize) -> Range<u64> {
    let end = |chunk: usize| (u128::from(n) * chunk as u128 / CHUNKS as u128) as u64;
    end(chunk)..end(chunk + 1)
}

/// What `work` makes of each chunk, in their order, whichever thread did it. This thread works too, and has `heard` of
/// all results; where the system gives no further threads, it goes on with fewer.
fn in_chunks<T: Copy + Default + Send>(
    threads: NonZeroUsize,
    work: impl Fn(usize) -> T + Sync,
    mut heard: impl FnMut(&T),
) -> Vec<T> {
    let mut results = vec![T::default(); CHUNKS];
    let next = AtomicUsize::new(0);
    let take = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&chunk| chunk < CHUNKS);
    let (sender, receiver) = mpsc::channel();
    let mut keep = |(chunk, result): (usize, T)| {
        heard(&result);
        results[chunk] = result;
    };
    thread::scope(|scope| {
        for _ in 1..threads.get().min(CHUNKS) {
            let (sender, take, work) = (sender.clone(), &take, &work);
            let helper = move || {
                while let Some(chunk) = take() {
                    // The receiver lives as long as the scope.
                    let _ = sender.send((chunk, work(chunk)));
                }
            };
            if thread::Builder::new().spawn_scoped(scope, helper).is_err() {
                break;
            }
        }
        drop(sender);
        while let Some(chunk) = take() {
            keep((chunk, work(chunk)));
            receiver.try_iter().for_each(&mut keep);
        }
        receiver.iter().for_each(&mut keep);
    });
    results
}

/// Parts that the points are measured in. Each has random numbers of its own, so that threads do not matter; more
/// threads than this are of no use.
const CHUNKS: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn surface(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Surface {
        let mesh = IndexedMesh::new(positions, triangles);
        let frame = Frame::over(&mesh, &mesh).unwrap();
        Surface::new(&mesh, &frame, NonZeroUsize::MIN)
    }

    proptest! {
        /// Right triangles with legs 1 and `h`, side by side: of n samples each gets its share of the area, rounded up or down,
        /// in however many runs they are taken; one without area gets none.
        #[test]
        fn every_triangle_gets_its_share(
            heights in prop::collection::vec(0u32..20, 1..40), samples in 1u64..2000, phase in 0.0..1.0, cut in 0.0..1.0,
        ) {
            let total: u32 = heights.iter().sum();
            prop_assume!(total > 0);
            let corners = |(k, &h): (usize, &u32)| {
                let x = 2.0 * k as f64;
                [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, f64::from(h), 0.0]]
            };
            let positions = heights.iter().enumerate().flat_map(corners).collect();
            let triangles = (0..heights.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let surface = surface(positions, triangles);
            let mut counts = vec![0u64; heights.len()];
            let cut = (samples as f64 * cut) as u64;
            for range in [0..cut, cut..samples] {
                surface.spread(range, samples, phase, |corners| {
                    let of_sample = surface.search.triangles().iter().position(|&t| t == corners);
                    counts[of_sample.unwrap()] += 1;
                });
            }
            prop_assert_eq!(counts.iter().sum::<u64>(), samples);
            let mut before = 0.0;
            for (count, sum) in counts.iter().zip(&surface.areas) {
                let share = (sum - before) / surface.area() * samples as f64;
                prop_assert!((*count as f64 - share).abs() < 1.0 + 1e-6, "{} for {}", count, share);
                before = *sum;
            }
        }

        #[test]
        fn shares_are_all_of_it(n: u64) {
            prop_assert_eq!(share(n, 0).start, 0);
            prop_assert_eq!(share(n, CHUNKS - 1).end, n);
            for chunk in 1..CHUNKS {
                prop_assert_eq!(share(n, chunk - 1).end, share(n, chunk).start);
            }
        }
    }

    #[test]
    fn chunks_come_in_order_and_all_are_heard_of() {
        for threads in [1, 2, 7, 5000] {
            let mut sum = 0;
            let found = in_chunks(NonZeroUsize::new(threads).unwrap(), |chunk| chunk * chunk, |&n| sum += n);
            assert!(found.iter().enumerate().all(|(chunk, &n)| n == chunk * chunk));
            // The sum of the first n squares is n (n + 1) (2 n + 1) / 6.
            assert_eq!(sum, (CHUNKS - 1) * CHUNKS * (2 * CHUNKS - 1) / 6);
        }
    }

    #[test]
    fn vertices_count_once_and_only_where_used() {
        let positions = vec![[0.0; 3], [9.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        let surface = surface(positions, vec![[0, 2, 3], [2, 4, 3], [2, 4, 3]]);
        assert_eq!((surface.vertices.len(), surface.search.triangles().len()), (4, 3));
    }
}
