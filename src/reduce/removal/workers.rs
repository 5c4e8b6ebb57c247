//! One function for each of many indices, on one thread or several: each result has one owner, so that it does not matter which.

use crate::error::{Error, Result};
use crate::reduce::rings::Rings;
use crate::reduce::star::GONE;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Threads, or the caller's alone.
#[derive(Debug)]
pub(super) struct Workers(Option<ThreadPool>);

impl Workers {
    /// So many threads; 0: as many as there are processors.
    ///
    /// # Errors
    /// [`Error::Io`] where the system has none.
    pub(super) fn new(threads: usize) -> Result<Self> {
        if threads == 1 {
            return Ok(Self(None));
        }
        let built = ThreadPoolBuilder::new().num_threads(threads).build();
        Ok(Self(Some(built.map_err(|e| Error::Io(std::io::Error::other(e).into()))?)))
    }

    /// Calls a function with each element, its number and memory that a thread uses again.
    pub(super) fn each<T: Send, M: Default>(
        &self,
        items: &mut [T],
        work: impl Fn(u32, &mut T, &mut M) + Sync,
    ) {
        match &self.0 {
            None => {
                let mut memory = M::default();
                (0..).zip(items).for_each(|(k, item)| work(k, item, &mut memory));
            }
            Some(pool) => pool.install(|| {
                let numbered = items.par_iter_mut().enumerate().with_min_len(GRAIN);
                numbered.for_each_init(M::default, |memory, (k, item)| work(k as u32, item, memory));
            }),
        }
    }

    /// Calls a function with each number below `count`.
    pub(super) fn each_number<M: Default>(&self, count: usize, work: impl Fn(u32, &mut M) + Sync) {
        match &self.0 {
            None => {
                let mut memory = M::default();
                (0..count as u32).for_each(|k| work(k, &mut memory));
            }
            Some(pool) => pool.install(|| {
                let numbers = (0..count as u32).into_par_iter().with_min_len(GRAIN);
                numbers.for_each_init(M::default, |memory, k| work(k, memory));
            }),
        }
    }

    /// The results of a function of each number below `count` that are one, in order.
    pub(super) fn gather<T: Send>(
        &self,
        count: usize,
        pick: impl Fn(u32) -> Option<T> + Sync,
        into: &mut Vec<T>,
    ) {
        into.clear();
        match &self.0 {
            None => into.extend((0..count as u32).filter_map(pick)),
            Some(pool) => pool.install(|| {
                let parts: Vec<Vec<T>> = (0..count.div_ceil(GRAIN))
                    .into_par_iter()
                    .map(|part| {
                        (part * GRAIN..count.min((part + 1) * GRAIN)).filter_map(|k| pick(k as u32)).collect()
                    })
                    .collect();
                parts.into_iter().for_each(|mut part| into.append(&mut part));
            }),
        }
    }
}

impl Rings {
    /// As [`Rings::rebuild`], each thread for a part of the vertices.
    pub(super) fn rebuild_by(&mut self, workers: &Workers, vertices: usize, triangles: &[[u32; 3]]) {
        debug_assert!(!triangles.contains(&GONE));
        let Some(pool) = &workers.0 else { return self.rebuild(vertices, triangles) };
        self.starts.clear();
        self.starts.resize(vertices + 1, 0);
        let size = vertices.div_ceil(pool.current_num_threads()).max(1);
        pool.install(|| {
            self.starts[..vertices].par_chunks_mut(size).enumerate().for_each(|(part, counts)| {
                let first = part * size;
                for &v in triangles.as_flattened() {
                    if let Some(count) = (v as usize).checked_sub(first).and_then(|k| counts.get_mut(k)) {
                        *count += 1;
                    }
                }
            });
        });
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.triangles.clear();
        self.triangles.resize(sum as usize, 0);
        let mut rest = &mut self.triangles[..];
        let (mut parts, mut begin) = (Vec::new(), 0);
        for (part, starts) in self.starts[..vertices].chunks_mut(size).enumerate() {
            let end = starts.last().map_or(begin, |&end| end);
            let (own, others) = rest.split_at_mut((end - begin) as usize);
            parts.push((part * size, begin, starts, own));
            (rest, begin) = (others, end);
        }
        pool.install(|| {
            parts.into_par_iter().for_each(|(first, begin, starts, own)| {
                // From behind, so that each start sinks to its place and each ring ascends.
                for (t, triangle) in triangles.iter().enumerate().rev() {
                    for &v in triangle {
                        if let Some(start) = (v as usize).checked_sub(first).and_then(|k| starts.get_mut(k)) {
                            *start -= 1;
                            own[(*start - begin) as usize] = t as u32;
                        }
                    }
                }
            });
        });
    }
}

/// Indices that a thread takes at once.
const GRAIN: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn threads_make_the_same_rings() {
        let mesh = shapes::torus(23, 11);
        let mut expected = Rings::default();
        let vertices = mesh.positions.len() + 3;
        expected.rebuild(vertices, &mesh.triangles);
        for threads in [1, 2, 3, 8] {
            let workers = Workers::new(threads).unwrap();
            let mut rings = Rings::default();
            rings.rebuild_by(&workers, vertices, &mesh.triangles);
            for v in 0..vertices as u32 {
                assert_eq!(rings.of(v), expected.of(v));
            }
            rings.rebuild_by(&workers, 0, &[]);
            let mut some = Vec::new();
            workers.gather(5000, |k| (k % 3 == 1).then_some(k), &mut some);
            assert_eq!(some, (0..5000).filter(|k| k % 3 == 1).collect::<Vec<_>>());
        }
    }
}
