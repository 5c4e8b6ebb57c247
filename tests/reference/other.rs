//! Chapter 15.2: vertices that are those of another mesh.

use super::container::{Result, demand};
use super::entropy::{Code, Model, Number};
use super::refinement::bit_length;

/// The other mesh, by its vertices in the order of its walk, and the models by which they are named.
pub struct Other<'a> {
    points: &'a [[i64; 3]],
    named: Vec<bool>,
    last: i64,
    before: usize,
    is_shared_first: [Model; 4],
    is_shared: [[Model; 16]; 4],
    difference: Number,
    rank: [Number; 16],
}

impl<'a> Other<'a> {
    pub fn fresh(points: &'a [[i64; 3]]) -> Self {
        Self {
            points,
            named: vec![false; points.len()],
            last: 0,
            before: 3,
            is_shared_first: [Model::FRESH; 4],
            is_shared: [[Model::FRESH; 16]; 4],
            difference: Number::FRESH,
            rank: [Number::FRESH; 16],
        }
    }

    /// Where a vertex is that is one of them; looked for at `prediction`, beyond an edge of some size if that is a parallelogram.
    pub fn cell(
        &mut self,
        code: &mut Code,
        prediction: [i64; 3],
        size: Option<i64>,
    ) -> Result<Option<[i64; 3]>> {
        let Some(m) = size else {
            let shared = code.read(&mut self.is_shared_first[self.before])?;
            if !self.told(shared) {
                return Ok(None);
            }
            let k = self.last + code.signed(&mut self.difference)?;
            return self.name(k).map(Some);
        };
        let b = bit_length(m) as i64;
        let g = (b + 1).min(24);
        let low = prediction.map(|x| (x - (1 << g) / 2) >> g);
        let is_near = |q: [i64; 3]| (0..3).all(|i| (q[i] >> g) - low[i] == 0 || (q[i] >> g) - low[i] == 1);
        let squares = |q: [i64; 3]| (0..3).map(|i| (q[i] - prediction[i]).pow(2)).sum::<i64>();
        let near = (0..self.points.len()).filter(|&k| !self.named[k] && is_near(self.points[k]));
        let mut candidates: Vec<(i64, usize)> = near.map(|k| (squares(self.points[k]), k)).collect();
        candidates.sort();
        let Some(&(least, _)) = candidates.first() else { return Ok(None) };
        let nearness = (2 * b + 5 - bit_length(least) as i64).clamp(0, 15);
        let shared = code.read(&mut self.is_shared[self.before][nearness as usize])?;
        if !self.told(shared) {
            return Ok(None);
        }
        let n = candidates.len();
        let r = code.unsigned(&mut self.rank[bit_length(n as i64).min(15)])?;
        demand(r < n as u64, "15.2: rank of a candidate")?;
        self.name(candidates[r as usize].1 as i64).map(Some)
    }

    fn told(&mut self, shared: bool) -> bool {
        self.before = 2 * (self.before & 1) + usize::from(shared);
        shared
    }

    fn name(&mut self, k: i64) -> Result<[i64; 3]> {
        let there = (0..self.points.len() as i64).contains(&k) && !self.named[k as usize];
        demand(there, "15.2: a vertex that cannot be named")?;
        self.named[k as usize] = true;
        self.last = k;
        Ok(self.points[k as usize])
    }
}
