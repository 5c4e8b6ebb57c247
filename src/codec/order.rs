//! The order of the input's vertices and triangles (spec §11).

use super::places::Places;
use super::residue::{Residue, ResidueError, Whole, spend};
use super::walk::Walk;
use crate::entropy::{Bit, BitCoder, NumberModel, RangeDecoder};
use crate::limits::Budget;
use crate::mesh::{Corner, CornerTable, IndexedMesh};
use crate::refine::ProgressiveMesh;

/// The lists of the input.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Order {
    /// For each vertex of the input its vertex of the whole, copies of the correction included.
    pub vertices: Vec<u32>,
    /// The triangles of the input, by its vertices.
    pub triangles: Vec<[u32; 3]>,
}

/// Which triangle of the whole a triangle of the input is: its place, and at which corner of that it begins, 0 to 2.
pub type Origin = (u32, u32);

const NONE: u32 = u32::MAX;

impl Order {
    /// Writes the order of `whole`, which is level 0, `mesh`, with its residue and the copies of its correction: `count`
    /// vertices. `origins` tells of each triangle of the input which one it is.
    #[cfg(feature = "encode")]
    pub fn encode(
        &self,
        mesh: &ProgressiveMesh,
        residue: &Residue,
        whole: &Whole,
        count: usize,
        origins: &[Origin],
    ) -> Result<Vec<u8>, ResidueError> {
        let mut coder = crate::entropy::RangeEncoder::default();
        let budget = &mut Budget::new(crate::limits::Limits { memory: u64::MAX, work: u64::MAX });
        let surface = Surface::new(mesh, residue);
        self.clone().code(&surface, whole, count, origins, &mut coder, budget)?;
        Ok(coder.finish())
    }

    /// Reads the order of `whole`; see [`Order::encode`].
    ///
    /// # Errors
    /// [`ResidueError`]; memory grows with what has been read.
    pub fn decode(
        bytes: &[u8],
        mesh: &ProgressiveMesh,
        residue: &Residue,
        whole: &Whole,
        count: usize,
        budget: &mut Budget,
    ) -> Result<Self, ResidueError> {
        let mut coder = RangeDecoder::new(bytes);
        let triangles = whole.triangles.len();
        budget.take_memory(triangles, BYTES_A_TRIANGLE).map_err(ResidueError::Limit)?;
        budget.take_memory(count, BYTES_A_VERTEX).map_err(ResidueError::Limit)?;
        budget.take_work(WORK_AN_ITEM * (triangles + count) as u64).map_err(ResidueError::Limit)?;
        let mut order = Self::default();
        order.code(&Surface::new(mesh, residue), whole, count, &[], &mut coder, budget)?;
        coder.finish()?;
        budget.give_memory(triangles, BYTES_A_TRIANGLE - BYTES_KEPT);
        budget.give_memory(count, BYTES_A_VERTEX - BYTES_KEPT);
        Ok(order)
    }

    /// The input's lists, of the whole with its positions.
    pub fn apply(&self, whole: &IndexedMesh) -> IndexedMesh {
        let positions = self.vertices.iter().map(|&v| whole.positions[v as usize]).collect();
        IndexedMesh::new(positions, self.triangles.clone())
    }

    fn code<C: BitCoder>(
        &mut self,
        surface: &Surface,
        whole: &Whole,
        count: usize,
        origins: &[Origin],
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), ResidueError> {
        let mut corners = code_triangles(surface, whole, origins, coder)?;
        let instances = self.code_instances(&mut corners, count, coder, budget)?;
        let numbers = self.code_vertices(&corners, &instances, coder)?;
        self.vertices.resize(instances.len(), 0);
        for (&v, &number) in instances.iter().zip(&numbers) {
            self.vertices[number as usize] = v;
        }
        for triangle in &mut corners {
            *triangle = triangle.map(|instance| numbers[instance as usize]);
        }
        self.triangles = corners;
        Ok(())
    }

    /// Turns the corners from vertices of the whole, of which there are `count`, to instances; of these returns the vertices.
    fn code_instances<C: BitCoder>(
        &self,
        corners: &mut [[u32; 3]],
        count: usize,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<Vec<u32>, ResidueError> {
        let range = ResidueError::Range;
        let more = NumberModel::default().unsigned(coder, || (self.vertices.len() - count) as u32)?;
        if more == 0 {
            return Ok(single_instances(corners, count));
        }
        let wanted = count + more as usize;
        budget.take_memory(count, BYTES_OF_INSTANCES).map_err(ResidueError::Limit)?;
        let mut instances =
            Instances { vertices: Vec::new(), of: vec![Vec::new(); count], now: vec![0; count] };
        let mut fresh = [[Bit::NEW; 3]; 2];
        let mut other = [Bit::NEW; 3];
        let mut choices = NumberModel::default();
        let mut last = true;
        // What the writer knows: the instance of each vertex of the input, once it is met.
        let mut known = vec![NONE; self.vertices.len()];
        for (place, corner) in corners.as_flattened_mut().iter_mut().enumerate() {
            let truth = self.triangles.get(place / 3).map_or(0, |t| t[place % 3] as usize);
            let known = known.get_mut(truth);
            let wants = known.as_deref().copied().unwrap_or(NONE);
            let v = *corner as usize;
            let n = instances.of[v].len();
            if n == 0 {
                instances.add(v);
            } else {
                last = coder.bit(&mut fresh[usize::from(last)][n.min(3) - 1], || wants == NONE);
                if last {
                    spend(budget, instances.vertices.len())?;
                    instances.add(v);
                } else if n > 1 {
                    let now = instances.now[v] as usize;
                    if coder.bit(&mut other[n.min(4) - 2], || instances.of[v][now] != wants) {
                        let mut k = 0;
                        if n > 2 {
                            k = choices.unsigned(coder, || {
                                let at = instances.of[v].partition_point(|&instance| instance < wants);
                                (n - 1 - at - usize::from(at < now)) as u32
                            })? as usize;
                        }
                        if k > n - 2 {
                            return Err(range("a corner names an instance of a vertex that does not exist"));
                        }
                        k = n - 1 - k;
                        instances.now[v] = (k - usize::from(k <= now)) as u32;
                    }
                }
                coder.check()?;
            }
            *corner = instances.of[v][instances.now[v] as usize];
            if let Some(known) = known {
                *known = *corner;
            }
        }
        (0..count)
            .filter(|&v| instances.of[v].is_empty())
            .collect::<Vec<_>>()
            .into_iter()
            .for_each(|v| instances.add(v));
        if instances.vertices.len() > wanted {
            return Err(range("there are more instances of vertices than vertices"));
        }
        // Vertices that no triangle has, beside others in the same place.
        let mut spare: Vec<u32> = Vec::new();
        if C::ENCODES {
            let mut lacking = vec![0i64; count];
            self.vertices.iter().for_each(|&v| lacking[v as usize] += 1);
            instances.vertices.iter().for_each(|&v| lacking[v as usize] -= 1);
            spare = (0..).zip(lacking).flat_map(|(v, n)| std::iter::repeat_n(v, n.max(0) as usize)).collect();
        }
        let (mut steps, mut v) = (NumberModel::default(), 0u32);
        let mut spare = spare.into_iter();
        for k in 0..wanted - instances.vertices.len() {
            spend(budget, k)?;
            let step = steps.unsigned(coder, || spare.next().map_or(0, |next| next - v))?;
            v = v
                .checked_add(step)
                .filter(|&v| (v as usize) < count)
                .ok_or(range("there is no such vertex"))?;
            coder.check()?;
            instances.add(v as usize);
        }
        budget.give_memory(count, BYTES_OF_INSTANCES);
        Ok(instances.vertices)
    }

    /// Returns for each instance its number in the input.
    fn code_vertices<C: BitCoder>(
        &self,
        corners: &[[u32; 3]],
        instances: &[u32],
        coder: &mut C,
    ) -> Result<Vec<u32>, ResidueError> {
        let stars = Stars::new(corners, instances.len());
        let order = if C::ENCODES { self.order_of(corners, instances) } else { Vec::new() };
        let mut places = Places::new(instances.len());
        let mut numbers = vec![NONE; instances.len()];
        let mut models = [[[Bit::NEW; 3]; 3]; 2];
        let mut pick = [[Bit::NEW; 8]; 8];
        let mut jumps = NumberModel::default();
        let (mut s, mut r, mut previous) = (0, 0, None);
        let mut open: Vec<u32> = Vec::new();
        // For each instance the number of the vertex whose neighbours it was last listed among.
        let mut listed = vec![NONE; instances.len()];
        for k in 0..instances.len() {
            let truth = order.get(k).map_or(0, |&instance| instance as usize);
            let p = previous.map_or(0, |v| places.below(v));
            let is_next = coder.bit(&mut models[0][s][r], || places.nth(p) == Some(truth));
            let mut instance = if is_next { places.nth(p) } else { None };
            let mut found = 0;
            if !is_next {
                open.clear();
                for &t in previous.map_or(&[][..], |v| stars.of(v)) {
                    for w in corners[t as usize] {
                        let new = std::mem::replace(&mut listed[w as usize], k as u32) != k as u32;
                        if new && !places.is_taken(w as usize) {
                            open.push(w);
                        }
                    }
                }
                let among = || open.iter().position(|&w| w as usize == truth);
                if !open.is_empty() && coder.bit(&mut models[1][s][r], || among().is_some()) {
                    let (mut i, wanted) = (0, if C::ENCODES { among().unwrap_or(0) } else { 0 });
                    let models = &mut pick[open.len().min(8) - 1];
                    while i + 1 < open.len() && coder.bit(&mut models[i.min(7)], || i < wanted) {
                        i += 1;
                    }
                    (instance, found) = (Some(open[i] as usize), 1);
                } else {
                    let jump = jumps.signed(coder, || (places.below(truth) as i64 - p as i64) as i32)?;
                    let q = p as i64 + i64::from(jump);
                    (instance, found) = (usize::try_from(q).ok().and_then(|q| places.nth(q)), 2);
                }
            }
            coder.check()?;
            let instance =
                instance.ok_or(ResidueError::Range("a vertex is not among those that are left"))?;
            places.take(instance);
            numbers[instance] = k as u32;
            previous = Some(instance);
            (s, r) = (found, s);
        }
        Ok(numbers)
    }

    /// For each vertex of the input its instance, as the writer knows it.
    fn order_of(&self, corners: &[[u32; 3]], instances: &[u32]) -> Vec<u32> {
        let mut order = vec![NONE; instances.len()];
        let mut is_met = vec![false; instances.len()];
        for (&v, &instance) in self.triangles.as_flattened().iter().zip(corners.as_flattened()) {
            order[v as usize] = instance;
            is_met[instance as usize] = true;
        }
        // Those in no triangle are told apart by their vertex alone.
        let mut left: Vec<(u32, u32)> =
            (0..).zip(instances).filter(|&(i, _)| !is_met[i as usize]).map(|(i, &v)| (v, i)).collect();
        left.sort_unstable();
        let mut open: Vec<(u32, u32)> = (0..)
            .zip(&self.vertices)
            .filter(|&(v, _)| order[v as usize] == NONE)
            .map(|(v, &w)| (w, v))
            .collect();
        open.sort_unstable();
        for ((_, v), (_, instance)) in open.into_iter().zip(left) {
            order[v as usize] = instance;
        }
        order
    }
}

/// The instances where each vertex has one: as [`Order::code_instances`], with nothing to be told.
fn single_instances(corners: &mut [[u32; 3]], count: usize) -> Vec<u32> {
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
    /// For each vertex of the whole its instances.
    of: Vec<Vec<u32>>,
    /// Which of them was used last.
    now: Vec<u32>,
}

impl Instances {
    fn add(&mut self, v: usize) {
        self.now[v] = self.of[v].len() as u32;
        self.of[v].push(self.vertices.len() as u32);
        self.vertices.push(v as u32);
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

/// The triangles of the walk as the whole has them.
struct Surface<'a> {
    table: &'a CornerTable,
    residue: &'a Residue,
    walk: Walk,
    /// For each triangle of the table its place.
    place: Vec<u32>,
}

impl<'a> Surface<'a> {
    fn new(mesh: &'a ProgressiveMesh, residue: &'a Residue) -> Self {
        let walk = Walk::new(&mesh.table, &mesh.roots);
        let mut place = vec![NONE; mesh.table.slots()];
        for (k, c) in walk.triangles.iter().enumerate() {
            place[c.triangle().index()] = k as u32;
        }
        Self { table: &mesh.table, residue, walk, place }
    }

    /// The place across the edge that corner `i` faces, and the corner there that faces it too; corners as the whole has them.
    fn across(&self, place: usize, i: usize) -> Option<(usize, usize)> {
        let corner = self.corners(place)?[i];
        let facing = self.table.opposite(corner);
        if facing.is_none() {
            return None;
        }
        let other = self.place[facing.triangle().index()] as usize;
        let corner = self.corners(other)?.iter().position(|&c| c == facing)?;
        Some((other, corner))
    }

    fn corners(&self, place: usize) -> Option<[Corner; 3]> {
        let &c = self.walk.triangles.get(place)?;
        let [next, prev] = [c.next(), c.prev()];
        Some(if self.residue.is_flipped(place) { [c, prev, next] } else { [c, next, prev] })
    }
}

/// The models of triangles.
struct Models {
    near: [[Bit; 5]; 5],
    ages: Vec<NumberModel>,
    which: [[[Bit; 2]; 8]; 4],
    turn: [[[Bit; 2]; 3]; 3],
    jump: [Bit; 2],
    jumps: NumberModel,
}

/// Codes the triangles of the input, by vertices of the whole.
fn code_triangles<C: BitCoder>(
    surface: &Surface,
    whole: &Whole,
    origins: &[Origin],
    coder: &mut C,
) -> Result<Vec<[u32; 3]>, ResidueError> {
    let range = ResidueError::Range;
    let mut models = Models {
        near: [[Bit::NEW; 5]; 5],
        ages: vec![NumberModel::default(); 5],
        which: [[[Bit::NEW; 2]; 8]; 4],
        turn: [[[Bit::NEW; 2]; 3]; 3],
        jump: [Bit::NEW; 2],
        jumps: NumberModel::default(),
    };
    let count = whole.triangles.len();
    let mut places = Places::new(count);
    let mut read: Vec<Origin> = Vec::with_capacity(count);
    // What the writer knows: when each place was taken.
    let mut when = vec![NONE; if C::ENCODES { count } else { 0 }];
    let mut triangles = Vec::with_capacity(count);
    let (mut s, mut r) = (0, 0);
    for t in 0..count {
        let truth = origins.get(t).copied().unwrap_or_default();
        let p = read.last().map_or(0, |&(place, _)| places.below(place as usize));
        let way =
            if C::ENCODES { Way::choose(surface, truth, &when, &read, &places, p) } else { Way::default() };
        let (place, first, found);
        if t > 0 && coder.bit(&mut models.near[s][r], || way.is_near) {
            let age = models.ages[s].unsigned(coder, || way.age)? as usize;
            let &(from, turn) = t
                .checked_sub(age + 1)
                .and_then(|o| read.get(o))
                .ok_or(range("a triangle is named that has not been read"))?;
            let beyond: [_; 3] = std::array::from_fn(|i| {
                let across = surface.across(from as usize, (i + turn as usize) % 3);
                across.filter(|&(place, _)| !places.is_taken(place))
            });
            let mask = (0..3).fold(0, |mask, i| mask | usize::from(beyond[i].is_some()) << i);
            let mut open = (0..3).filter(|&i| beyond[i].is_some()).peekable();
            let mut i = open.next().ok_or(range("a triangle has no neighbour that is left"))?;
            for model in &mut models.which[age.min(3)][mask] {
                if open.peek().is_none() || !coder.bit(model, || i != way.edge) {
                    break;
                }
                i = open.next().unwrap_or(i);
            }
            let (there, facing) = beyond[i].ok_or(range("a triangle has no such neighbour"))?;
            let x = three(&mut models.turn[age.min(2)][i], coder, || (facing + 3 - truth.1 as usize) % 3);
            (place, first) = (there, (facing + 3 - x) % 3);
            found = 1 + 3.min(usize::BITS - age.leading_zeros()) as usize;
        } else {
            let jump = models.jumps.signed(coder, || way.jump)?;
            let k = usize::try_from(p as i64 + i64::from(jump)).ok();
            place =
                k.and_then(|k| places.nth(k)).ok_or(range("a triangle is not among those that are left"))?;
            let in_walk = place < surface.walk.triangles.len();
            first = if in_walk { three(&mut models.jump, coder, || truth.1 as usize) } else { 0 };
            found = 0;
        }
        coder.check()?;
        places.take(place);
        if let Some(when) = when.get_mut(place) {
            *when = t as u32;
        }
        read.push((place as u32, first as u32));
        let mut triangle = whole.triangles[place];
        triangle.rotate_left(first);
        triangles.push(triangle);
        (s, r) = (found, s);
    }
    Ok(triangles)
}

/// A number of 0 to 2.
fn three<C: BitCoder>(models: &mut [Bit; 2], coder: &mut C, known: impl Fn() -> usize) -> usize {
    if coder.bit(&mut models[0], || known() > 0) {
        1 + usize::from(coder.bit(&mut models[1], || known() > 1))
    } else {
        0
    }
}

/// How the writer names the next triangle.
#[derive(Default)]
struct Way {
    is_near: bool,
    age: u32,
    /// The corner, as the input has them, that faces the edge to cross.
    edge: usize,
    jump: i32,
}

impl Way {
    /// Over the edge of the youngest neighbour, unless a jump is shorter.
    fn choose(
        surface: &Surface,
        truth: Origin,
        when: &[u32],
        read: &[Origin],
        places: &Places,
        p: usize,
    ) -> Self {
        let place = truth.0 as usize;
        let jump = (places.below(place) as i64 - p as i64) as i32;
        let neighbours = (0..3).filter_map(|i| surface.across(place, i)).filter(|&(o, _)| when[o] != NONE);
        let Some((o, facing)) = neighbours.max_by_key(|&(o, _)| when[o]) else {
            return Self { jump, ..Self::default() };
        };
        let age = read.len() as u32 - 1 - when[o];
        let bits = |x: u32| u32::BITS - x.leading_zeros();
        let is_near = bits(age) < bits(jump.unsigned_abs());
        let first = read[when[o] as usize].1 as usize;
        Self { is_near, age, edge: (facing + 3 - first) % 3, jump }
    }
}

/// Memory for a triangle and for a vertex while an order is read, and what is kept of it.
const BYTES_A_TRIANGLE: usize = 48;
const BYTES_A_VERTEX: usize = 32;
const BYTES_KEPT: usize = 12;
/// Memory for a vertex that may have several instances.
const BYTES_OF_INSTANCES: usize = 80;
/// Units of work for one.
const WORK_AN_ITEM: u64 = 64;
