//! Which vertices of the input are one in the whole: the instances of a vertex, in the order in which corners meet them (spec §11.3).

use super::{NONE, Order};
use crate::codec::whole::{WholeError, spend};
use crate::entropy::{Bit, BitCoder, NumberModel};
use crate::limits::Budget;

/// Turns the corners from vertices of the whole, of which there are `count`, to instances; of these returns the vertices. `known`
/// is what the writer knows.
pub fn code<C: BitCoder>(
    known: &Order,
    corners: &mut [[u32; 3]],
    count: usize,
    coder: &mut C,
    budget: &mut Budget,
) -> Result<Vec<u32>, WholeError> {
    let more = NumberModel::default().unsigned(coder, || (known.vertices.len() - count) as u32)?;
    if more == 0 {
        return Ok(one_each(corners, count));
    }
    budget.take_memory(count, BYTES_A_VERTEX)?;
    let mut instances = Instances::new(count, count + more as usize);
    code_corners(known, corners, &mut instances, coder, budget)?;
    for v in 0..count {
        if instances.of[v].is_empty() {
            instances.add(v);
        }
    }
    if instances.vertices.len() > instances.wanted {
        return Err(WholeError::Range("there are more instances of vertices than vertices"));
    }
    code_spare(known, &mut instances, coder, budget)?;
    budget.give_memory(count, BYTES_A_VERTEX);
    Ok(instances.vertices)
}

/// The instances at the corners, one corner after the other.
fn code_corners<C: BitCoder>(
    order: &Order,
    corners: &mut [[u32; 3]],
    instances: &mut Instances,
    coder: &mut C,
    budget: &mut Budget,
) -> Result<(), WholeError> {
    let mut fresh = [[Bit::NEW; 3]; 2];
    let mut other = [Bit::NEW; 3];
    let mut choices = NumberModel::default();
    let mut last = true;
    // What the writer knows: the instance of each vertex of the input, once it is met.
    let mut known = vec![NONE; order.vertices.len()];
    for (place, corner) in corners.as_flattened_mut().iter_mut().enumerate() {
        let truth = order.triangles.get(place / 3).map_or(0, |t| t[place % 3] as usize);
        let known = known.get_mut(truth);
        let wants = known.as_deref().copied().unwrap_or(NONE);
        let v = *corner as usize;
        let n = instances.of[v].len();
        if n == 0 {
            instances.add(v);
        } else {
            last = coder.bit(&mut fresh[usize::from(last)][n.min(3) - 1], || wants == NONE);
            if last {
                instances.add_further(v, budget)?;
            } else if n > 1 && coder.bit(&mut other[n.min(4) - 2], || instances.at(v) != wants) {
                let k = if n > 2 { choices.unsigned(coder, || instances.choice(v, wants))? } else { 0 };
                instances.choose(v, k)?;
            }
            coder.check()?;
        }
        *corner = instances.at(v);
        if let Some(known) = known {
            *known = *corner;
        }
    }
    Ok(())
}

/// Vertices that no triangle has, beside others in the same place.
fn code_spare<C: BitCoder>(
    order: &Order,
    instances: &mut Instances,
    coder: &mut C,
    budget: &mut Budget,
) -> Result<(), WholeError> {
    let count = instances.of.len();
    let mut spare: Vec<u32> = Vec::new();
    if C::ENCODES {
        let mut lacking = vec![0i64; count];
        order.vertices.iter().for_each(|&v| lacking[v as usize] += 1);
        instances.vertices.iter().for_each(|&v| lacking[v as usize] -= 1);
        spare = (0..).zip(lacking).flat_map(|(v, n)| std::iter::repeat_n(v, n.max(0) as usize)).collect();
    }
    let (mut steps, mut v) = (NumberModel::default(), 0u32);
    let mut spare = spare.into_iter();
    while instances.vertices.len() < instances.wanted {
        let step = steps.unsigned(coder, || spare.next().map_or(0, |next| next - v))?;
        let next = v.checked_add(step).filter(|&v| (v as usize) < count);
        v = next.ok_or(WholeError::Range("there is no such vertex"))?;
        coder.check()?;
        instances.add_further(v as usize, budget)?;
    }
    Ok(())
}

/// The instances where each vertex has one: as [`code`], with nothing to be told.
fn one_each(corners: &mut [[u32; 3]], count: usize) -> Vec<u32> {
    let mut instance = vec![NONE; count];
    let mut vertices = Vec::with_capacity(count);
    let mut met = |v: u32| {
        let instance = &mut instance[v as usize];
        if *instance == NONE {
            *instance = vertices.len() as u32;
            vertices.push(v);
        }
        *instance
    };
    corners.as_flattened_mut().iter_mut().for_each(|corner| *corner = met(*corner));
    (0..count as u32).for_each(|v| {
        met(v);
    });
    vertices
}

/// The vertices of the input, as they are met.
struct Instances {
    /// Their vertices of the whole.
    vertices: Vec<u32>,
    /// How many there must be in the end.
    wanted: usize,
    /// For each vertex of the whole its instances, ascending.
    of: Vec<Vec<u32>>,
    /// Which of them was used last.
    now: Vec<u32>,
    /// How many are not the first of their vertex.
    further: usize,
}

impl Instances {
    fn new(count: usize, wanted: usize) -> Self {
        Self { vertices: Vec::new(), wanted, of: vec![Vec::new(); count], now: vec![0; count], further: 0 }
    }

    fn add(&mut self, v: usize) {
        self.now[v] = self.of[v].len() as u32;
        self.of[v].push(self.vertices.len() as u32);
        self.vertices.push(v as u32);
    }

    /// Adds one that is not the first of its vertex: the budget does not know of it yet.
    fn add_further(&mut self, v: usize, budget: &mut Budget) -> Result<(), WholeError> {
        spend(budget, self.further)?;
        self.further += 1;
        self.add(v);
        Ok(())
    }

    /// The instance of `v` that was used last.
    fn at(&self, v: usize) -> u32 {
        self.of[v][self.now[v] as usize]
    }

    /// By which number the writer names one of three or more, other than the last: the youngest is 0.
    fn choice(&self, v: usize, wants: u32) -> u32 {
        let (of, now) = (&self.of[v], self.now[v] as usize);
        let at = of.partition_point(|&instance| instance < wants);
        (of.len() - 1 - at - usize::from(at < now)) as u32
    }

    /// The counterpart of [`Instances::choice`].
    fn choose(&mut self, v: usize, k: u32) -> Result<(), WholeError> {
        let (n, k, now) = (self.of[v].len(), k as usize, self.now[v] as usize);
        if k > n - 2 {
            return Err(WholeError::Range("a corner names an instance of a vertex that does not exist"));
        }
        let at = n - 1 - k;
        self.now[v] = (at - usize::from(at <= now)) as u32;
        Ok(())
    }
}

/// Memory for a vertex that may have several instances.
const BYTES_A_VERTEX: usize = 80;
