//! Points of the plane that come and go, and whether some lie in a triangle: a k-d tree (Bentley 1975).

use robust::{Coord, orient2d};

/// The points that are in the way, of some that are known beforehand.
pub(super) struct Obstacles<'a> {
    points: &'a [Coord<f64>],
    /// All points, those of a leaf together.
    order: Vec<u32>,
    /// Node k has the children 2k + 1 and 2k + 2.
    nodes: Vec<Node>,
    /// The leaf of each point.
    leaf: Vec<u32>,
    is_there: Vec<bool>,
}

#[derive(Clone, Copy)]
struct Node {
    min: Coord<f64>,
    max: Coord<f64>,
    /// How many of its points are there.
    count: u32,
    /// Where its points are in the order.
    start: u32,
    end: u32,
}

impl<'a> Obstacles<'a> {
    /// None of these points is there yet.
    pub(super) fn new(points: &'a [Coord<f64>]) -> Self {
        let leaves = points.len().div_ceil(LEAF).next_power_of_two();
        let empty = Node { min: ORIGIN, max: ORIGIN, count: 0, start: 0, end: 0 };
        let mut obstacles = Self {
            points,
            order: (0..points.len() as u32).collect(),
            nodes: vec![empty; 2 * leaves - 1],
            leaf: vec![0; points.len()],
            is_there: vec![false; points.len()],
        };
        obstacles.build(0, 0, points.len());
        obstacles
    }

    fn build(&mut self, node: usize, start: usize, end: usize) {
        let mine = &mut self.order[start..end];
        let at = |k: &u32| self.points[*k as usize];
        let (mut min, mut max) = mine.first().map(|k| (at(k), at(k))).unwrap_or((ORIGIN, ORIGIN));
        for p in mine.iter().map(at) {
            min = Coord { x: min.x.min(p.x), y: min.y.min(p.y) };
            max = Coord { x: max.x.max(p.x), y: max.y.max(p.y) };
        }
        self.nodes[node] = Node { min, max, count: 0, start: start as u32, end: end as u32 };
        if 2 * node + 1 >= self.nodes.len() {
            mine.iter().for_each(|&k| self.leaf[k as usize] = node as u32);
            return;
        }
        let half = mine.len() / 2;
        if half > 0 {
            if max.x - min.x > max.y - min.y {
                mine.select_nth_unstable_by(half, |a, b| at(a).x.total_cmp(&at(b).x));
            } else {
                mine.select_nth_unstable_by(half, |a, b| at(a).y.total_cmp(&at(b).y));
            }
        }
        self.build(2 * node + 1, start, start + half);
        self.build(2 * node + 2, start + half, end);
    }

    /// Says whether a point is there.
    pub(super) fn set(&mut self, point: u32, there: bool) {
        if std::mem::replace(&mut self.is_there[point as usize], there) == there {
            return;
        }
        let mut node = self.leaf[point as usize] as usize;
        loop {
            let count = &mut self.nodes[node].count;
            *count = if there { *count + 1 } else { *count - 1 };
            if node == 0 {
                return;
            }
            node = (node - 1) / 2;
        }
    }

    /// Whether `found` says so of any point that is there in or near a triangle, which goes round counter-clockwise. `work` is debited;
    /// when it is used up, the answer is yes.
    pub(super) fn any(&self, triangle: [Coord<f64>; 3], found: impl Fn(u32) -> bool, work: &mut u64) -> bool {
        let mut stack = vec![0];
        while let Some(node) = stack.pop() {
            if *work == 0 {
                return true;
            }
            *work -= 1;
            if self.nodes[node].count == 0 || self.nodes[node].misses(triangle) {
                continue;
            }
            if 2 * node + 1 < self.nodes.len() {
                stack.extend([2 * node + 1, 2 * node + 2]);
                continue;
            }
            let mine = &self.order[self.nodes[node].start as usize..self.nodes[node].end as usize];
            if mine.iter().any(|&k| self.is_there[k as usize] && found(k)) {
                return true;
            }
        }
        false
    }
}

impl Node {
    /// Whether the node's box lies on the far side of one of the triangle's edges.
    fn misses(&self, [a, b, c]: [Coord<f64>; 3]) -> bool {
        let Self { min, max, .. } = *self;
        let beyond = |of: fn(&Coord<f64>) -> f64, min: f64, max: f64| {
            let [a, b, c] = [of(&a), of(&b), of(&c)];
            a.max(b).max(c) < min || a.min(b).min(c) > max
        };
        let right_of = |from: Coord<f64>, to: Coord<f64>| {
            // The corner of the box that is farthest to the left.
            let x = if to.y > from.y { min.x } else { max.x };
            let y = if to.x > from.x { max.y } else { min.y };
            orient2d(from, to, Coord { x, y }) < 0.0
        };
        beyond(|p| p.x, min.x, max.x)
            || beyond(|p| p.y, min.y, max.y)
            || right_of(a, b)
            || right_of(b, c)
            || right_of(c, a)
    }
}

/// Most points of a leaf.
const LEAF: usize = 8;

const ORIGIN: Coord<f64> = Coord { x: 0.0, y: 0.0 };
