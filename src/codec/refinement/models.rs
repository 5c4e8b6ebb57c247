//! What the decisions of refinements are coded under, and what is known of them beforehand (spec §5.5).

use super::priors;
use crate::codec::context::{ANGLES, BENDS, REACHES, Shape, reach};
use crate::codec::extents::{CLASSES, LENGTHS, Length};
use crate::codec::position::PositionModels;
use crate::codec::vector::Vector;
use crate::codec::vector::exponent;
use crate::entropy::{Bit, BitCoder, Mixer, Outcomes, mix};

/// The models of refinements. They start afresh with each segment (spec §5.2).
#[derive(Clone, Debug)]
pub struct SegmentModels {
    pub(super) split: SplitModels,
    pub(super) flip: FlipModels,
    pub(super) face: Bit,
    pub(super) attach: Bit,
    pub(super) position: PositionModels,
    pub(in crate::codec) precision: [Bit; 3],
}

impl Default for SegmentModels {
    fn default() -> Self {
        Self::new(false)
    }
}

impl SegmentModels {
    /// Fresh models. Rich ones mix six for each split and flip.
    pub fn new(rich: bool) -> Self {
        Self {
            split: SplitModels { rich: rich.then(|| Box::new(RichSplits::NEW)), ..SplitModels::NEW },
            flip: FlipModels { rich: rich.then(|| Box::new(RichFlips::NEW)), ..FlipModels::NEW },
            face: Bit::NEW,
            attach: Bit::NEW,
            position: PositionModels::default(),
            precision: [Bit::NEW; 3],
        }
    }

    /// Fresh models of the same kind.
    pub fn afresh(&self) -> Self {
        Self::new(self.are_rich())
    }

    /// Whether they are rich.
    pub(super) fn are_rich(&self) -> bool {
        self.split.rich.is_some()
    }
}

/// Places for how many sides are closed: more than there are, so that any three bits make one.
const CLOSED: usize = 8;
// Two triangles, of which neither is in a star, have two further edges each.
const _: () = assert!(2 * 2 < CLOSED);
// An index is masked where it is known to be within its list: the mask then changes nothing, and spares the check.
const _: () = assert!(CLASSES.is_power_of_two() && LENGTHS.is_power_of_two() && ANGLES.is_power_of_two());

/// Of *split?*, by whether it is a boundary edge, how many sides are closed, and how long it is: beside those round it, or by
/// itself. Where the edges of a level are of one length, as in a scan, the second tells more; where the level is graded, the
/// first. Each level says which it goes by. Rich models mix.
#[derive(Clone, Debug)]
pub struct SplitModels {
    lengths: Lengths,
    by_itself: Bit,
    rich: Option<Box<RichSplits>>,
    trial: Option<Box<Trial>>,
}

#[derive(Clone, Debug)]
struct Lengths {
    beside: [[[Bit; CLASSES]; CLOSED]; 2],
    alone: [[[Bit; LENGTHS]; CLOSED]; 2],
}

impl Lengths {
    const NEW: Self = Self { beside: priors::beside(), alone: [[[Bit::NEW; LENGTHS]; CLOSED]; 2] };

    #[inline]
    fn both(&mut self, kind: usize, closed: usize, length: Length) -> [&mut Bit; 2] {
        [
            &mut self.beside[kind][closed][usize::from(length.beside) & (CLASSES - 1)],
            &mut self.alone[kind][closed][usize::from(length.alone) & (LENGTHS - 1)],
        ]
    }
}

/// What a writer tries: both lengths, all along, and what each would have cost in the last levels.
#[derive(Clone, Debug)]
struct Trial {
    lengths: Lengths,
    /// In units of 1/256 bit.
    costs: [u64; 2],
}

impl Trial {
    fn count(&mut self, kind: usize, closed: usize, length: Length, bit: bool) {
        for (model, cost) in self.lengths.both(kind, closed, length).into_iter().zip(&mut self.costs) {
            *cost += u64::from(model.cost(bit));
            model.learn(bit);
        }
    }
}

/// Mixed: one that knows the angles too, the length by itself, one by how many edges the vertices round it have together, and one by how many
/// each has; one by how long the four other sides are, and one by how far the vertices opposite to it are from its middle.
#[derive(Clone, Debug)]
struct RichSplits {
    angles: [[[[Bit; CLASSES]; ANGLES / 2]; CLOSED]; 2],
    valences: [[[Bit; 16]; 16]; 16],
    each: [Bit; VALENCES.pow(4)],
    sides: [[[Bit; SIZES.pow(4)]; CLOSED]; 2],
    heights: [[[[Bit; CLASSES / 2]; SIZES.pow(2)]; CLOSED]; 2],
    by_closed: [[Mixer<6>; CLOSED]; 2],
    by_valence: [[Mixer<6>; 16]; 16],
    by_length: [Mixer<6>; CLASSES],
    outcomes: [[Outcomes; CLOSED]; 2],
}

/// Classes of how many edges a vertex has, from 3 on.
const VALENCES: usize = 7;
/// Classes of a squared length over that of the edge, octaves from 1/8 on.
const SIZES: usize = 6;

/// What rich models know of an edge that may be split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Round {
    /// Below [`ANGLES`].
    angle: u8,
    /// Classes of how many edges its ends have together, and the vertices opposite to it; below 10 each.
    ends: u8,
    far: u8,
    /// Of how many edges each has, below [`VALENCES`]^4.
    each: u16,
    /// Of the sides of its triangles, below [`SIZES`]^4, and of how far their tips are from its middle, below [`SIZES`]^2.
    sides: u16,
    heights: u8,
}

impl Round {
    /// Of no edge.
    pub const NONE: Self = Self { angle: 0, ends: 0, far: 0, each: 0, sides: 0, heights: 0 };

    /// Of an edge a–b with this angle and its vertices opposite, l and r: where a, b, l and r are, and how many edges they have. Of a boundary
    /// edge l is r.
    #[inline]
    pub fn new(angle: u8, at: [Vector; 4], edges: [i32; 4], is_boundary: bool) -> Self {
        let class = |edges: i32| (edges - 8).clamp(0, 9) as u8;
        let [a, b, l, r] = at;
        let square = (b - a).dot(b - a).max(1.0);
        let size =
            |v: Vector, least: i32| (exponent(v.dot(v) / square) - least).clamp(0, SIZES as i32 - 1) as u16;
        let height = |tip: Vector| size((a - tip) + (b - tip), -1);
        let sides = [[a - l, b - l], [a - r, b - r]].map(|of| pair(of.map(|side| size(side, -3)), SIZES));
        let each = [[edges[0], edges[1]], [edges[2], edges[3]]];
        let each =
            each.map(|of| pair(of.map(|edges| (edges - 3).clamp(0, VALENCES as i32 - 1) as u16), VALENCES));
        Self {
            angle,
            ends: class(edges[0] + edges[1]),
            far: if is_boundary { 0 } else { class(edges[2] + edges[3]) },
            each: each[0] * VALENCES.pow(2) as u16 + each[1],
            sides: sides[0] * SIZES.pow(2) as u16 + sides[1],
            heights: pair([height(l), height(r)], SIZES) as u8,
        }
    }
}

/// Two classes in either order, of so many, as one.
#[inline]
fn pair([x, y]: [u16; 2], classes: usize) -> u16 {
    x.min(y) * classes as u16 + x.max(y)
}

impl SplitModels {
    const NEW: Self = Self { lengths: Lengths::NEW, by_itself: Bit::NEW, rich: None, trial: None };

    /// Codes whether a level goes by how long an edge is by itself. A writer takes what would have been better before.
    pub fn choose<C: BitCoder>(&mut self, coder: &mut C) -> bool {
        if self.rich.is_some() {
            return false;
        }
        let mut known = false;
        if C::ENCODES {
            let fresh = || Box::new(Trial { lengths: Lengths::NEW, costs: [0; 2] });
            let costs = &mut self.trial.get_or_insert_with(fresh).costs;
            known = costs[1] < costs[0];
            *costs = costs.map(|cost| cost / 2);
        }
        coder.bit(&mut self.by_itself, || known)
    }

    /// Codes whether an edge is split.
    #[inline]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        is_boundary: bool,
        closed: u8,
        (length, by_itself, round): (Length, bool, Round),
        known: impl FnOnce() -> bool,
    ) -> bool {
        let (kind, closed) = (usize::from(is_boundary), usize::from(closed) & (CLOSED - 1));
        let [beside, alone] = self.lengths.both(kind, closed, length);
        if let Some(rich) = &mut self.rich {
            let class = usize::from(length.beside) & (CLASSES - 1);
            let angles = &mut rich.angles[kind][closed][usize::from(round.angle) / 2 % (ANGLES / 2)][class];
            let (ends, far) = (usize::from(round.ends) & 15, usize::from(round.far) & 15);
            let models = [
                angles,
                alone,
                &mut rich.valences[ends][far][class / 2],
                &mut rich.each[usize::from(round.each) % VALENCES.pow(4)],
                &mut rich.sides[kind][closed][usize::from(round.sides) % SIZES.pow(4)],
                &mut rich.heights[kind][closed][usize::from(round.heights) % SIZES.pow(2)][class / 2],
            ];
            let mixers = [
                &mut rich.by_closed[kind][closed],
                &mut rich.by_valence[ends][far],
                &mut rich.by_length[class],
            ];
            return mix::mixed(coder, mixers, &mut rich.outcomes[kind][closed], models, known);
        }
        let bit = coder.bit(if by_itself { alone } else { beside }, known);
        if C::ENCODES
            && let Some(trial) = &mut self.trial
        {
            trial.count(kind, closed, length, bit);
        }
        bit
    }
}

impl RichSplits {
    const NEW: Self = Self {
        angles: priors::angles(),
        valences: priors::split_valences(),
        each: [Bit::NEW; VALENCES.pow(4)],
        sides: [[[Bit::NEW; SIZES.pow(4)]; CLOSED]; 2],
        heights: [[[[Bit::NEW; CLASSES / 2]; SIZES.pow(2)]; CLOSED]; 2],
        by_closed: [[Mixer::ALIKE; CLOSED]; 2],
        by_valence: [[Mixer::ALIKE; 16]; 16],
        by_length: [Mixer::ALIKE; CLASSES],
        outcomes: [[Outcomes::NEW; CLOSED]; 2],
    };
}

/// What is known of a link edge p–q, between v and r, beyond its shape.
#[derive(Clone, Copy, Debug)]
pub struct Ring {
    /// How many flips there were before in this star.
    pub flips: usize,
    /// How many of the two edges beyond lead nowhere or to a star.
    pub closed: u8,
    /// How many edges p and q have, and how many r.
    pub ends: [i32; 2],
    pub far: i32,
    /// 1 where p is an end of the edge that was split, 2 where q is, 0 where neither is.
    pub end: usize,
}

/// Of *flip?*, by how many edges its vertices have, how far from Delaunay it is, and where in the star: in a mesh of rows the diagonals
/// all lie the same way, so the edges that are flipped stand at the same place of each star. Rich models mix.
#[derive(Clone, Debug)]
pub struct FlipModels {
    shape: [[[[Bit; ANGLES / 4]; 4]; 4]; 8],
    rich: Option<Box<RichFlips>>,
}

/// Mixed: one that knows the angle better, one that knows how far the flipped edge reaches, one by how many edges the vertices have and one that
/// tells p and q apart; and two that know, as the plain one does, how many more edges p and q have than v and r.
#[derive(Clone, Debug)]
struct RichFlips {
    shape: [[[Bit; ANGLES]; 8]; 4],
    reach: [[[[Bit; ANGLES / 2]; 16]; 4]; 4],
    valences: [[[Bit; 4]; 8]; 16],
    each: [[[Bit; 4]; 8]; VALENCES.pow(2)],
    excess_reach: [[[Bit; ANGLES / 4]; 16]; 8],
    excess_bend: [[[[Bit; 8]; 8]; 4]; 4],
    by_flips: [[Mixer<6>; 4]; 4],
    by_excess: [Mixer<6>; 8],
    by_reach: [[Mixer<6>; 16]; 4],
    outcomes: [Outcomes; 4],
}

impl FlipModels {
    const NEW: Self = Self { shape: priors::shape(), rich: None };

    /// Codes whether a link edge is flipped. `cells` are those of v, p, q and r, for rich models.
    #[inline]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        shape: Shape,
        ring: Ring,
        cells: impl FnOnce() -> [Vector; 4],
        known: impl FnOnce() -> bool,
    ) -> bool {
        let (bend, angle) = (usize::from(shape.bend) & 7, usize::from(shape.angle) & (ANGLES - 1));
        let flips = ring.flips.min(3);
        let ends = ring.ends[0] + ring.ends[1];
        // A flip takes an edge from p and q each, and gives one to r, as those before gave to v.
        let excess = (ends - ring.far - ring.flips as i32 - 2).clamp(0, priors::EXCESSES - 1) as usize;
        if let Some(rich) = &mut self.rich {
            let closed = usize::from(ring.closed.min(2));
            let both = (ends - 6).clamp(0, priors::ENDS - 1) as usize;
            let far = (ring.far - 3).clamp(0, 7) as usize;
            let each = ring.ends.map(|edges| (edges - 3).clamp(0, VALENCES as i32 - 1) as u16);
            let (end, [v, p, q, r]) = (ring.end & 3, cells());
            let reach = reach(v, p, q, r) & 15;
            let models = [
                &mut rich.shape[end][bend][angle],
                &mut rich.reach[flips][closed][reach][angle / 2],
                &mut rich.valences[both][far][flips],
                &mut rich.each[usize::from(pair(each, VALENCES))][far][flips],
                &mut rich.excess_reach[excess][reach][angle / 4],
                &mut rich.excess_bend[flips][closed][excess][bend],
            ];
            let mixers = [
                &mut rich.by_flips[flips][closed],
                &mut rich.by_excess[excess],
                &mut rich.by_reach[end][reach],
            ];
            return mix::mixed(coder, mixers, &mut rich.outcomes[flips], models, known);
        }
        let model = &mut self.shape[excess][ring.end & 3][flips][angle / 4];
        coder.bit(model, known)
    }
}

impl RichFlips {
    const NEW: Self = Self {
        shape: priors::rich_shape(),
        reach: priors::reach(),
        valences: priors::flip_valences(),
        each: [[[Bit::NEW; 4]; 8]; VALENCES.pow(2)],
        excess_reach: [[[Bit::NEW; ANGLES / 4]; 16]; 8],
        excess_bend: [[[[Bit::NEW; 8]; 8]; 4]; 4],
        by_flips: [[Mixer::ALIKE; 4]; 4],
        by_excess: [Mixer::ALIKE; 8],
        by_reach: [[Mixer::ALIKE; 16]; 4],
        outcomes: [Outcomes::NEW; 4],
    };
}
const _: () = assert!(BENDS <= 8 && REACHES <= 16);

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::entropy::RangeEncoder;

    /// A level whose edges are split by one of their lengths, whatever the other: the next level goes by that one.
    #[test]
    fn the_length_that_tells_more_is_chosen() {
        for better in [false, true] {
            let mut split = SplitModels::NEW;
            let mut coder = RangeEncoder::default();
            assert!(!split.choose(&mut coder), "nothing is known of it at first");
            for k in 0..1000 {
                let (x, y) = ((k % 7) as u8, (k / 7 % 5) as u8);
                let length = Length { beside: 5 + x, alone: 60 + y };
                let is_split = if better { y < 2 } else { x < 3 };
                split.code(&mut coder, false, 0, (length, false, Round::NONE), || is_split);
            }
            assert_eq!(split.choose(&mut coder), better);
        }
    }

    /// What rich models know makes decisions cheap that look alike to others: here, a split by the angle, a flip by r's edges.
    #[test]
    fn rich_models_know_more() {
        let bits = |rich: bool| {
            let mut models = SegmentModels::new(rich);
            let mut coder = RangeEncoder::default();
            models.split.choose(&mut coder);
            for k in 0..1000 {
                let round =
                    Round::new(if k % 3 == 0 { 4 } else { 25 }, [Vector::default(); 4], [6; 4], false);
                let length = (Length { beside: 10, alone: 60 }, false, round);
                models.split.code(&mut coder, false, 0, length, || k % 3 == 0);
                let more = i32::from(k % 3 == 0);
                let ring = Ring { flips: 0, closed: 0, ends: [6, 6 + more], far: 6 + more, end: 0 };
                let cells = || [Vector::default(); 4];
                models.flip.code(&mut coder, Shape { angle: 16, bend: 0 }, ring, cells, || k % 3 == 0);
            }
            coder.bits()
        };
        let (plain, rich) = (bits(false), bits(true));
        assert!(plain > 1800.0 && rich < 300.0, "{plain} and {rich}");
    }

    /// A mesh of rows, whose stars all flip the edge that starts at an end of the one split, and then no other.
    #[test]
    fn flips_are_told_by_their_place_in_the_star() {
        let mut models = SegmentModels::default();
        let mut coder = RangeEncoder::default();
        for k in 0..1000 {
            let (end, flips) = (1 + k % 2, k / 2 % 2);
            let ring = Ring { flips, closed: 0, ends: [6, 6 + flips as i32], far: 6, end };
            let cells = || [Vector::default(); 4];
            let is_flipped = end == 1 && flips == 0;
            models.flip.code(&mut coder, Shape { angle: 16, bend: 0 }, ring, cells, || is_flipped);
        }
        assert!(coder.bits() < 100.0, "{}", coder.bits());
    }

    /// Before anything is learnt, edges that are far from Delaunay and have many edges at their ends are expected to be flipped, and
    /// others not.
    #[test]
    fn fresh_models_expect_the_usual() {
        let flip = FlipModels::NEW;
        assert!(flip.shape[7][0][0][0].zero() < 1 << 13 && flip.shape[2][0][0][7].zero() > 65000);
        let split = SplitModels::NEW;
        let chance = |class: usize| split.lengths.beside[0][0][class].zero();
        assert!(chance(14) < chance(10) && chance(10) < chance(5));
    }
}
