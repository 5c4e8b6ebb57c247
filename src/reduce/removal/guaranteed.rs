//! Vertices picked beforehand by their curvature: the guaranteed ones, of which no two are nearer to each other than N edges and which
//! always stay, and the auxiliary ones, at which others may end before they go themselves (Odaker and others 2016, 4 and 5.1).
//! Where the paper starts at one vertex, each component has a start here.

use crate::reduce::rings::Rings;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The vertices of a mesh and how bent the surface is at each.
pub(super) struct Bent<'a> {
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) rings: &'a Rings,
    pub(super) curvature: &'a [f64],
}

impl Bent<'_> {
    /// A flag for each vertex that always stays: the most bent one, then ever again the most bent of those that are exactly `spacing`
    /// edges from the nearest, until none is so far. `spacing` is 1 to 255.
    pub(super) fn guaranteed(&self, spacing: u8) -> Vec<bool> {
        let mut distances = vec![FAR; self.curvature.len()];
        let mut chosen = vec![false; self.curvature.len()];
        let mut heap = BinaryHeap::new();
        let (mut rim, mut next) = (Vec::new(), Vec::new());
        for start in self.by_curvature() {
            if distances[start as usize] == FAR {
                heap.push(self.rank(start));
                distances[start as usize] = u16::from(spacing);
            }
            while let Some((_, Reverse(v))) = heap.pop() {
                if distances[v as usize] != u16::from(spacing) {
                    continue;
                }
                chosen[v as usize] = true;
                distances[v as usize] = 0;
                rim.push(v);
                for distance in 1..=u16::from(spacing) {
                    for &v in &rim {
                        self.each_neighbour(v, |w| {
                            if distances[w as usize] > distance {
                                distances[w as usize] = distance;
                                next.push(w);
                                if distance == u16::from(spacing) {
                                    heap.push(self.rank(w));
                                }
                            }
                        });
                    }
                    rim.clear();
                    std::mem::swap(&mut rim, &mut next);
                }
                rim.clear();
            }
        }
        chosen
    }

    /// A flag for each auxiliary vertex: ever again the most bent of those that are near to a neighbour of a guaranteed or auxiliary one,
    /// but no neighbour themselves. So both together are as many as can be without two neighbours among them.
    pub(super) fn auxiliary(&self, guaranteed: &[bool]) -> Vec<bool> {
        let mut reached: Vec<bool> = guaranteed.to_vec();
        let mut waits = vec![false; guaranteed.len()];
        let mut auxiliary = vec![false; guaranteed.len()];
        let mut heap = BinaryHeap::new();
        let mut reach = |v: u32, reached: &mut [bool], heap: &mut BinaryHeap<_>| {
            self.each_neighbour(v, |w| {
                if !std::mem::replace(&mut reached[w as usize], true) {
                    self.each_neighbour(w, |x| {
                        if !reached[x as usize] && !std::mem::replace(&mut waits[x as usize], true) {
                            heap.push(self.rank(x));
                        }
                    });
                }
            });
        };
        for v in (0..guaranteed.len() as u32).filter(|&v| guaranteed[v as usize]) {
            reach(v, &mut reached, &mut heap);
        }
        while let Some((_, Reverse(v))) = heap.pop() {
            if !std::mem::replace(&mut reached[v as usize], true) {
                auxiliary[v as usize] = true;
                reach(v, &mut reached, &mut heap);
            }
        }
        auxiliary
    }

    /// The larger the earlier: by curvature, then by number.
    fn rank(&self, v: u32) -> (u64, Reverse<u32>) {
        // Numbers of one sign are in the order of their bits.
        (self.curvature[v as usize].to_bits(), Reverse(v))
    }

    fn by_curvature(&self) -> impl Iterator<Item = u32> {
        let mut all: Vec<(u64, Reverse<u32>)> =
            (0..self.curvature.len() as u32).map(|v| self.rank(v)).collect();
        all.sort_unstable_by(|a, b| b.cmp(a));
        all.into_iter().map(|(_, Reverse(v))| v)
    }

    fn each_neighbour(&self, v: u32, mut tell: impl FnMut(u32)) {
        for &t in self.rings.of(v) {
            self.triangles[t as usize].iter().filter(|&&w| w != v).for_each(|&w| tell(w));
        }
    }
}

const FAR: u16 = u16::MAX;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::shapes;
    use std::collections::VecDeque;

    /// Edges to the nearest of the chosen, by a search that knows nothing of how they were chosen.
    fn distances(bent: &Bent, chosen: &[bool]) -> Vec<u32> {
        let mut distances = vec![u32::MAX; chosen.len()];
        let mut queue: VecDeque<u32> = (0..chosen.len() as u32).filter(|&v| chosen[v as usize]).collect();
        queue.iter().for_each(|&v| distances[v as usize] = 0);
        while let Some(v) = queue.pop_front() {
            bent.each_neighbour(v, |w| {
                if distances[w as usize] == u32::MAX {
                    distances[w as usize] = distances[v as usize] + 1;
                    queue.push_back(w);
                }
            });
        }
        distances
    }

    #[test]
    fn they_are_so_far_apart_and_leave_no_gap() {
        for mesh in
            [shapes::torus(20, 13), shapes::grid(17, 12), shapes::two_components(), shapes::tetrahedron()]
        {
            let mut random = SplitMix64::new(3);
            let curvature: Vec<f64> = mesh.positions.iter().map(|_| (random.unit() * 9.0).floor()).collect();
            let mut rings = Rings::default();
            rings.rebuild(mesh.positions.len(), &mesh.triangles);
            let bent = Bent { triangles: &mesh.triangles, rings: &rings, curvature: &curvature };
            for spacing in [1, 2, 3, 4, 9, 255] {
                let chosen = bent.guaranteed(spacing);
                assert!(distances(&bent, &chosen).iter().all(|&d| d < u32::from(spacing)));
                for v in (0..chosen.len()).filter(|&v| chosen[v]) {
                    let mut others = chosen.clone();
                    others[v] = false;
                    assert!(distances(&bent, &others)[v] >= u32::from(spacing));
                }
                if spacing == 1 {
                    continue;
                }
                // No two neighbours, and everyone has one of them beside it.
                let auxiliary = bent.auxiliary(&chosen);
                let either: Vec<bool> = chosen.iter().zip(&auxiliary).map(|(a, b)| a | b).collect();
                for v in 0..either.len() as u32 {
                    let mut beside = false;
                    bent.each_neighbour(v, |w| beside |= either[w as usize]);
                    assert!(beside != either[v as usize]);
                }
            }
        }
    }

    #[test]
    fn the_most_bent_is_the_first() {
        let mesh = shapes::grid(6, 6);
        let mut curvature = vec![0.0; mesh.positions.len()];
        curvature[24] = 2.0;
        let mut rings = Rings::default();
        rings.rebuild(mesh.positions.len(), &mesh.triangles);
        let bent = Bent { triangles: &mesh.triangles, rings: &rings, curvature: &curvature };
        let chosen = bent.guaranteed(200);
        assert_eq!(chosen.iter().position(|&is| is), Some(24));
        assert_eq!(chosen.iter().filter(|&&is| is).count(), 1);
    }
}
