//! The vertices of the input, one after the other: what is next, one near the last, or a jump (spec §11.4).

use super::{NONE, Order};
use crate::codec::places::Places;
use crate::codec::whole::WholeError;
use crate::entropy::{Bit, BitCoder, NumberModel};

/// Returns for each instance its number in the input; `known` is what the writer knows.
pub fn code<C: BitCoder>(
    known: &Order,
    corners: &[[u32; 3]],
    instances: &[u32],
    coder: &mut C,
) -> Result<Vec<u32>, WholeError> {
    let order = if C::ENCODES { order_of(known, corners, instances) } else { Vec::new() };
    let mut state = State::new(corners, instances.len());
    let mut numbers = vec![NONE; instances.len()];
    let mut next = [[Bit::NEW; 3]; 3];
    let mut near = [[Bit::NEW; 3]; 3];
    let (mut s, mut r, mut previous) = (0, 0, None);
    for k in 0..instances.len() {
        let truth = order.get(k).map_or(0, |&instance| instance as usize);
        let p = previous.map_or(0, |v| state.places.below(v));
        let (instance, found) = if coder.bit(&mut next[s][r], || state.places.nth(p) == Some(truth)) {
            (state.places.nth(p), 0)
        } else {
            state.list_neighbours(previous, k);
            let is_near = || state.open.iter().any(|&w| w as usize == truth);
            if !state.open.is_empty() && coder.bit(&mut near[s][r], is_near) {
                (Some(state.neighbour(truth, coder)), 1)
            } else {
                (state.jump(p, truth, coder)?, 2)
            }
        };
        coder.check()?;
        let instance = instance.ok_or(WholeError::Range("a vertex is not among those that are left"))?;
        state.places.take(instance);
        numbers[instance] = k as u32;
        previous = Some(instance);
        (s, r) = (found, s);
    }
    Ok(numbers)
}

/// How far the list of vertices has come.
struct State<'a> {
    corners: &'a [[u32; 3]],
    stars: Stars,
    /// The instances that have no number yet.
    places: Places,
    /// Those of them that are neighbours of the last one.
    open: Vec<u32>,
    /// For each instance the number of the vertex whose neighbours it was last listed among.
    listed: Vec<u32>,
    pick: [[Bit; 8]; 8],
    jumps: NumberModel,
}

impl<'a> State<'a> {
    fn new(corners: &'a [[u32; 3]], instances: usize) -> Self {
        Self {
            corners,
            stars: Stars::new(corners, instances),
            places: Places::new(instances),
            open: Vec::new(),
            listed: vec![NONE; instances],
            pick: [[Bit::NEW; 8]; 8],
            jumps: NumberModel::default(),
        }
    }

    /// Lists the neighbours of `previous` that are left, for vertex `k`.
    fn list_neighbours(&mut self, previous: Option<usize>, k: usize) {
        self.open.clear();
        for &t in previous.map_or(&[][..], |v| self.stars.of(v)) {
            for w in self.corners[t as usize] {
                let new = std::mem::replace(&mut self.listed[w as usize], k as u32) != k as u32;
                if new && !self.places.is_taken(w as usize) {
                    self.open.push(w);
                }
            }
        }
    }

    /// One of the neighbours listed, of which there are some.
    fn neighbour<C: BitCoder>(&mut self, truth: usize, coder: &mut C) -> usize {
        let place = || self.open.iter().position(|&w| w as usize == truth).unwrap_or(0);
        let (mut i, wanted) = (0, if C::ENCODES { place() } else { 0 });
        let models = &mut self.pick[self.open.len().min(8) - 1];
        while i + 1 < self.open.len() && coder.bit(&mut models[i.min(7)], || i < wanted) {
            i += 1;
        }
        self.open[i] as usize
    }

    /// The instance so many places from the last one, of those that are left; `p` of them are below it.
    fn jump<C: BitCoder>(
        &mut self,
        p: usize,
        truth: usize,
        coder: &mut C,
    ) -> Result<Option<usize>, WholeError> {
        let jump = self.jumps.signed(coder, || (self.places.below(truth) as i64 - p as i64) as i32)?;
        let q = usize::try_from(p as i64 + i64::from(jump)).ok();
        Ok(q.and_then(|q| self.places.nth(q)))
    }
}

/// The triangles at each instance, in ascending order.
struct Stars {
    ends: Vec<u32>,
    triangles: Vec<u32>,
}

impl Stars {
    fn new(corners: &[[u32; 3]], instances: usize) -> Self {
        let mut ends = vec![0; instances + 1];
        corners.as_flattened().iter().for_each(|&v| ends[v as usize + 1] += 1);
        for k in 0..instances {
            ends[k + 1] += ends[k];
        }
        let mut triangles = vec![0; 3 * corners.len()];
        for (place, &v) in corners.as_flattened().iter().enumerate() {
            triangles[ends[v as usize] as usize] = place as u32 / 3;
            ends[v as usize] += 1;
        }
        Self { ends, triangles }
    }

    /// Filling has moved each start to the end.
    fn of(&self, v: usize) -> &[u32] {
        let start = if v == 0 { 0 } else { self.ends[v - 1] };
        &self.triangles[start as usize..self.ends[v] as usize]
    }
}

/// For each vertex of the input its instance, as the writer knows it.
fn order_of(known: &Order, corners: &[[u32; 3]], instances: &[u32]) -> Vec<u32> {
    let mut order = vec![NONE; instances.len()];
    let mut is_met = vec![false; instances.len()];
    for (&v, &instance) in known.triangles.as_flattened().iter().zip(corners.as_flattened()) {
        order[v as usize] = instance;
        is_met[instance as usize] = true;
    }
    // Those in no triangle are told apart by their vertex alone.
    let mut left: Vec<(u32, u32)> =
        (0..).zip(instances).filter(|&(i, _)| !is_met[i as usize]).map(|(i, &v)| (v, i)).collect();
    left.sort_unstable();
    let mut open: Vec<(u32, u32)> = (0..)
        .zip(&known.vertices)
        .filter(|&(v, _)| order[v as usize] == NONE)
        .map(|(v, &w)| (w, v))
        .collect();
    open.sort_unstable();
    for ((_, v), (_, instance)) in open.into_iter().zip(left) {
        order[v as usize] = instance;
    }
    order
}
