//! Vertices that are nearly equal: on one point of a lattice, or in a chain of vertices of which each is within a distance
//! of the next.
//!
//! Both are found by the positions alone, whatever the order of the vertices. For chains the vertices are parted by a tree of
//! boxes, halved across their longest sides, and only boxes within the distance of each other are looked at together.

use super::sets::Sets;
use crate::mesh::Lattice;

/// The sets of some different positions that have the same point of a lattice.
pub(super) fn on_lattice(positions: &[[f64; 3]], lattice: &Lattice) -> Sets {
    let key = |p: [f64; 3]| match lattice.point(p) {
        Some(q) => (false, q.map(|x| x as u32 as u64)),
        None => (true, p.map(f64::to_bits)),
    };
    let mut keys: Vec<_> = positions.iter().map(|&p| key(p)).zip(0..).collect();
    keys.sort_unstable();
    let mut sets = Sets::new(positions.len());
    for pair in keys.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        sets.unite(pair[0].1, pair[1].1);
    }
    sets
}

/// The sets of some different positions that chains join, each link at most `distance` long, which is above 0.
pub(super) fn within(positions: &[[f64; 3]], distance: f64) -> Sets {
    let sets = Sets::new(positions.len());
    let order = (0..positions.len() as u32).collect();
    let mut tree = Tree { positions, distance, order, nodes: Vec::new(), sets };
    if !positions.is_empty() {
        tree.build(0, positions.len());
    }
    tree.sets
}

/// Boxes of positions, and what has been joined so far.
struct Tree<'a> {
    positions: &'a [[f64; 3]],
    distance: f64,
    /// Positions by number, so that those of a box follow one another.
    order: Vec<u32>,
    nodes: Vec<Node>,
    sets: Sets,
}

/// A box that just holds its positions. Its first half follows it.
#[derive(Clone, Copy)]
struct Node {
    min: [f64; 3],
    max: [f64; 3],
    start: usize,
    end: usize,
    /// The second half; 0 where it is not parted.
    second: usize,
    /// Whether all its positions are within the distance of each other.
    is_small: bool,
}

impl Tree<'_> {
    /// Makes a box of this part of the order and joins what is to be joined in it; returns its number.
    fn build(&mut self, start: usize, end: usize) -> usize {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &v in &self.order[start..end] {
            let p = self.positions[v as usize];
            min = std::array::from_fn(|k| min[k].min(p[k]));
            max = std::array::from_fn(|k| max[k].max(p[k]));
        }
        let sides: [f64; 3] = std::array::from_fn(|k| max[k] - min[k]);
        let is_small = self.is_near(sides);
        let number = self.nodes.len();
        self.nodes.push(Node { min, max, start, end, second: 0, is_small });
        if is_small {
            for k in start + 1..end {
                self.sets.unite(self.order[start], self.order[k]);
            }
        }
        if end - start <= LEAF {
            if !is_small {
                self.join_leaf(number);
            }
            return number;
        }
        let longest = (0..3).fold(0, |longest, k| if sides[k] > sides[longest] { k } else { longest });
        let middle = (end - start) / 2;
        let positions = self.positions;
        // The whole position decides, so that the halves do not hang on the order of the input.
        let turned =
            |v: u32| -> [f64; 3] { std::array::from_fn(|k| positions[v as usize][(longest + k) % 3] + 0.0) };
        self.order[start..end].select_nth_unstable_by(middle, |&v, &w| {
            let order = turned(v).into_iter().zip(turned(w)).map(|(x, y)| x.total_cmp(&y));
            order.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        });
        let first = self.build(start, start + middle);
        let second = self.build(start + middle, end);
        self.nodes[number].second = second;
        if !is_small {
            self.join(first, second);
        }
        number
    }

    fn join_leaf(&mut self, leaf: usize) {
        let Node { start, end, .. } = self.nodes[leaf];
        for i in start..end {
            for j in start..i {
                if self.are_near(i, j) {
                    self.sets.unite(self.order[i], self.order[j]);
                }
            }
        }
    }

    /// Joins what is near in two boxes.
    fn join(&mut self, a: usize, b: usize) {
        if !self.is_near(self.gap(a, b)) {
            return;
        }
        let (x, y) = (self.nodes[a], self.nodes[b]);
        if x.is_small && y.is_small {
            let (v, w) = (self.order[x.start], self.order[y.start]);
            let mut visits = VISITS * (y.end - y.start + x.end - x.start);
            if !self.sets.are_one(v, w) && self.has_near(a, b, &mut visits) {
                self.sets.unite(v, w);
            }
            return;
        }
        match self.part(a, b) {
            Some([[a, b], [c, d]]) => {
                self.join(a, b);
                self.join(c, d);
            }
            None => {
                for i in x.start..x.end {
                    for j in y.start..y.end {
                        if self.are_near(i, j) {
                            self.sets.unite(self.order[i], self.order[j]);
                        }
                    }
                }
            }
        }
    }

    /// Whether any position of one box is near one of the other. After so many visits it is taken for granted.
    fn has_near(&self, a: usize, b: usize, visits: &mut usize) -> bool {
        if !self.is_near(self.gap(a, b)) {
            return false;
        }
        *visits -= 1;
        if *visits == 0 {
            return true;
        }
        let (x, y) = (self.nodes[a], self.nodes[b]);
        match self.part(a, b) {
            Some(halves) => {
                halves.iter().any(|&[a, b]| *visits > 0 && self.has_near(a, b, visits)) || *visits == 0
            }
            None => (x.start..x.end).any(|i| (y.start..y.end).any(|j| self.are_near(i, j))),
        }
    }

    /// Two pairs of boxes for one: the halves of the one with more positions that has some, with the other one.
    fn part(&self, a: usize, b: usize) -> Option<[[usize; 2]; 2]> {
        let (x, y) = (&self.nodes[a], &self.nodes[b]);
        match (x.second, y.second) {
            (0, 0) => None,
            (second, other) if other == 0 || second > 0 && x.end - x.start >= y.end - y.start => {
                Some([[a + 1, b], [second, b]])
            }
            (_, second) => Some([[a, b + 1], [a, second]]),
        }
    }

    /// How far two boxes lie apart along each axis.
    fn gap(&self, a: usize, b: usize) -> [f64; 3] {
        let (a, b) = (&self.nodes[a], &self.nodes[b]);
        std::array::from_fn(|k| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k]).max(0.0))
    }

    /// Whether two positions, by their places in the order, are within the distance.
    fn are_near(&self, i: usize, j: usize) -> bool {
        let [p, q] = [i, j].map(|k| self.positions[self.order[k] as usize]);
        self.is_near(std::array::from_fn(|k| (p[k] - q[k]).abs()))
    }

    /// Whether a difference is at most the distance. It grows with each part of the difference, rounding and all, so that boxes
    /// never contradict the positions in them.
    fn is_near(&self, difference: [f64; 3]) -> bool {
        difference.iter().map(|d| d / self.distance).fold(0.0, |sum, d| sum + d * d) <= 1.0
    }
}

/// Positions of a box that is not parted further.
const LEAF: usize = 8;
/// Pairs of boxes that are looked at, for each position of two boxes whose positions are within the distance of each other,
/// before both boxes are taken to be near: nobody can make it take quadratic time, and no link is longer than three times the
/// distance. Surfaces stay far below.
const VISITS: usize = 32;
