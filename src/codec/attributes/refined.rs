//! What is told of attributes behind operations: which corners of their links part, and the wedges of their vertices (spec §13.9).

use super::owed::{Operation, Owed, TOGETHER};
use super::ring::Ring;
use super::round::{CornerModels, RoundModels, Vicinity, take_room};
use super::values::Around;
use super::{Attributes, Known};
use crate::codec::refinement::known;
use crate::codec::whole::WholeError;
use crate::entropy::{Bit, BitCoder};
use crate::limits::Budget;
use crate::mesh::{Corner, Vertex};
use crate::refine::wedges::{Carried, ring_of};
use crate::refine::{ProgressiveMesh, Site};

/// Models of what is told of attributes behind operations.
#[derive(Debug)]
pub struct RefinedModels {
    /// Whether a corner of the link parts, by how many spokes part the wedges at their far end: none, one, more.
    parts: [Bit; 3],
    /// Whether those of one vertex do, by whether it is an end of the edge split, and on how many sides another wedge is beyond.
    part: [[Bit; 3]; 2],
    /// Whether both of them do, likewise.
    both: [Bit; 2],
    /// Whether it is the second that is another now, likewise: by whether another wedge is beyond the first alone, the second alone, or
    /// else.
    second: [[Bit; 3]; 2],
    /// Whether it has the wedge beyond.
    beyond: Bit,
    link: Vec<CornerModels>,
    round: RoundModels,
    owed: Owed,
    /// What is round the vertices of those owed.
    rings: Vec<Ring>,
    seats: Vec<Seat>,
    ring: Ring,
}

impl RefinedModels {
    /// Whether all that there is of operations has been told.
    pub fn owe_nothing(&self) -> bool {
        self.owed.operations.is_empty()
    }
}

/// A vertex of the link: its corners before and behind the spoke, which may part. At the ends of an open star there is but one.
#[derive(Clone, Copy, Debug)]
struct Seat {
    corners: [Corner; 2],
    /// The corners next to them, outside the star, where these have other wedges.
    beyond: [Corner; 2],
    /// Whether the edge split ends there.
    is_end: bool,
}

/// What seldom happens.
const SELDOM: Bit = known(64);

impl Seat {
    fn others(&self) -> usize {
        self.beyond.iter().filter(|c| c.is_some()).count()
    }
}

impl Attributes {
    /// Bytes that [`Attributes::models`] take.
    pub fn model_bytes(&self) -> usize {
        size_of::<RefinedModels>()
            + 2 * RoundModels::bytes(&self.columns)
            + Owed::BYTES
            + TOGETHER * Ring::BYTES
    }

    /// Models for what follows.
    pub fn models(&self) -> RefinedModels {
        RefinedModels {
            parts: [Bit::NEW; 3],
            part: [[Bit::NEW; 3], [SELDOM; 3]],
            both: [SELDOM; 2],
            second: [[Bit::NEW; 3]; 2],
            beyond: Bit::NEW,
            link: self.columns.iter().map(CornerModels::new).collect(),
            round: RoundModels::new(&self.columns),
            owed: Owed::default(),
            rings: Vec::new(),
            seats: Vec::new(),
            ring: Ring::default(),
        }
    }

    /// An operation has been carried out, which inserted `v`. What there is of it is told by [`Attributes::refine`], behind [`TOGETHER`]
    /// operations at most; until then wedges may be those before it.
    #[inline]
    pub fn carry(
        &mut self,
        models: &mut RefinedModels,
        mesh: &ProgressiveMesh,
        v: Vertex,
        operation: &Carried,
    ) {
        if self.alive.is_empty() {
            self.wedges.carry(&mesh.table, operation);
        } else {
            models.owed.push(&mut self.wedges, &mesh.table, v, operation);
        }
    }

    /// Codes what there is of the operations carried out since the last time. Their stars are what they were then: no other operation of a
    /// level touches a triangle of them.
    ///
    /// # Errors
    /// [`WholeError`].
    pub fn refine<C: BitCoder, K: Known>(
        &mut self,
        models: &mut RefinedModels,
        mesh: &ProgressiveMesh,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let mut owed = std::mem::take(&mut models.owed);
        let mut rings = std::mem::take(&mut models.rings);
        let alive = std::mem::take(&mut self.alive);
        owed.carry(&mut self.wedges, &mesh.table);
        rings.resize_with(owed.operations.len().max(rings.len()), Ring::default);
        // All at once: what has to be waited for is waited for together.
        for (operation, ring) in owed.operations.iter().zip(&mut rings) {
            ring_of(&mesh.table, operation.vertex, operation.site, operation.first, &mut ring.corners);
            ring.look(&Around { mesh, wedges: &self.wedges });
            for &k in &alive {
                for beside in &ring.beside {
                    self.columns[k].prefetch(beside.wedge);
                    models.round.columns[k].prefetch(beside.wedge);
                }
            }
        }
        let outcome = owed.operations.iter().zip(&mut rings).try_for_each(|(operation, ring)| {
            let Operation { vertex, site, .. } = *operation;
            self.refine_one(models, &alive, mesh, (vertex, site), ring, coder, known, budget)?;
            Ok(coder.check()?)
        });
        owed.clear();
        (models.owed, models.rings, self.alive) = (owed, rings, alive);
        self.count = self.wedges.count();
        outcome
    }

    #[expect(clippy::too_many_arguments)]
    fn refine_one<C: BitCoder, K: Known>(
        &mut self,
        models: &mut RefinedModels,
        alive: &[usize],
        mesh: &ProgressiveMesh,
        (vertex, site): (Vertex, Site),
        ring: &mut Ring,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let is_boundary = mesh.table.is_boundary(vertex);
        let mut parted = self.parted(ring, alive, is_boundary);
        if self.part(models, alive, mesh, site, &ring.corners, parted, coder, known, budget)? {
            ring.look(&Around { mesh, wedges: &self.wedges });
            parted = self.parted(ring, alive, is_boundary);
        }
        let vicinity = Vicinity { mesh, born: alive, old: &[], is_boundary };
        self.round(&mut models.round, vicinity, ring, |_| true, Some(parted), coder, known, budget)
    }

    /// How many of the spokes of a star part the wedges at their far end.
    #[inline]
    fn parted(&self, ring: &Ring, alive: &[usize], is_boundary: bool) -> usize {
        ring.parted(is_boundary, |a, b| self.are_alike(a, b, alive))
    }

    /// Corners of the link that are others than carried. `parted` is how many spokes part the wedges at their far end, as carried; returned
    /// is whether any has parted.
    #[expect(clippy::too_many_arguments)]
    fn part<C: BitCoder, K: Known>(
        &mut self,
        models: &mut RefinedModels,
        alive: &[usize],
        mesh: &ProgressiveMesh,
        site: Site,
        corners: &[Corner],
        parted: usize,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<bool, WholeError> {
        let mut seats = std::mem::take(&mut models.seats);
        if C::ENCODES {
            self.seats(alive, mesh, site, corners, &mut seats);
        }
        // A writer looks at what the corners beside hold, which all are of the same mesh.
        let differs = |c: Corner| {
            let carried = self.wedges.of(c);
            let label = known.label(c);
            alive.iter().any(|&k| self.columns[k].value(carried) != known.value(k, label))
        };
        let parts = |seat: &Seat| seat.corners.iter().any(|&c| c.is_some() && differs(c));
        let any = coder.bit(&mut models.parts[parted.min(2)], || seats.iter().any(parts));
        if any {
            if !C::ENCODES {
                self.seats(alive, mesh, site, corners, &mut seats);
            }
            let truths: Vec<[bool; 2]> = if C::ENCODES {
                seats.iter().map(|seat| seat.corners.map(|c| c.is_some() && differs(c))).collect()
            } else {
                vec![[false; 2]; seats.len()]
            };
            for (seat, truth) in seats.iter().zip(truths) {
                let end = usize::from(seat.is_end);
                if !coder.bit(&mut models.part[end][seat.others()], || truth[0] || truth[1]) {
                    continue;
                }
                let [first, second] = seat.corners.map(|c| c.is_some());
                let parts = if !(first && second) {
                    [first, second]
                } else if coder.bit(&mut models.both[end], || truth[0] && truth[1]) {
                    [true; 2]
                } else {
                    let context = match seat.beyond.map(|c| c.is_some()) {
                        [true, false] => 0,
                        [false, true] => 1,
                        _ => 2,
                    };
                    let is_second = coder.bit(&mut models.second[end][context], || truth[1]);
                    [!is_second, is_second]
                };
                for side in (0..2).filter(|&side| parts[side]) {
                    self.renew(models, alive, mesh, seat, side, coder, known, budget)?;
                    coder.check()?;
                }
            }
        }
        models.seats = seats;
        Ok(any)
    }

    /// A corner of the link gets another wedge than the one carried.
    #[expect(clippy::too_many_arguments)]
    fn renew<C: BitCoder, K: Known>(
        &mut self,
        models: &mut RefinedModels,
        alive: &[usize],
        mesh: &ProgressiveMesh,
        seat: &Seat,
        side: usize,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let (c, beyond) = (seat.corners[side], seat.beyond[side]);
        let label = if C::ENCODES { known.label(c) } else { 0 };
        if beyond.is_some() {
            let there = self.wedges.of(beyond);
            let is_it = || alive.iter().all(|&k| self.columns[k].value(there) == known.value(k, label));
            if coder.bit(&mut models.beyond, is_it) {
                self.wedges.assign(c, there);
                return Ok(());
            }
        }
        take_room(budget, self.wedges.count(), &self.columns)?;
        let (wedge, carried) = (self.wedges.count(), self.wedges.of(c));
        let around = Around { mesh, wedges: &self.wedges };
        let RefinedModels { link, ring, .. } = models;
        ring.corners.clear();
        ring.corners.push(c);
        ring.look(&around);
        for &k in alive {
            let (models, column) = (&mut link[k], &mut self.columns[k]);
            models.code(coder, &around, ring, column, wedge, Some(carried), known.value(k, label))?;
        }
        self.wedges.append(&[c]);
        Ok(())
    }

    /// Where corners of the link may part.
    fn seats(
        &self,
        alive: &[usize],
        mesh: &ProgressiveMesh,
        site: Site,
        corners: &[Corner],
        seats: &mut Vec<Seat>,
    ) {
        let table = &mesh.table;
        seats.clear();
        // The corner at the same vertex beyond the link edge of a triangle of the star, where it has other values.
        let other = |c: Corner, beyond: Corner| {
            let is_alike = || self.are_alike(self.wedges.of(beyond), self.wedges.of(c), alive);
            if beyond.is_some() && !is_alike() { beyond } else { Corner::NONE }
        };
        let before = |c: Corner| {
            let o = table.opposite(c);
            (c.prev(), other(c.prev(), if o.is_some() { o.next() } else { Corner::NONE }))
        };
        let behind = |c: Corner| {
            let o = table.opposite(c);
            (c.next(), other(c.next(), if o.is_some() { o.prev() } else { Corner::NONE }))
        };
        let ends = match site {
            Site::Edge(a, b) => [a, b],
            _ => [Vertex::NONE; 2],
        };
        let Some(&last) = corners.last() else { return };
        let is_open = table.swing(last).is_none();
        let none = (Corner::NONE, Corner::NONE);
        let mut at = if is_open { none } else { before(last) };
        let mut seat = |(x, beyond_x): (Corner, Corner), (y, beyond_y): (Corner, Corner)| {
            let is_end = ends.contains(&table.vertex(if y.is_some() { y } else { x }));
            seats.push(Seat { corners: [x, y], beyond: [beyond_x, beyond_y], is_end });
        };
        for &c in corners {
            seat(at, behind(c));
            at = before(c);
        }
        if is_open {
            seat(at, none);
        }
    }
}
