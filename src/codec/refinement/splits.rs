//! Whether edges are split: what that is told by, and what it is coded under (spec §5.5.2).

use super::priors;
use crate::codec::context::ANGLES;
use crate::codec::extents::{CLASSES, LENGTHS, Length};
use crate::codec::vector::{Vector, exponent};
use crate::entropy::{Bit, BitCoder, Mixer, Outcomes, mix};

/// Places for how many sides are closed: more than there are, so that any three bits make one.
const CLOSED: usize = 8;
// Two triangles, of which neither is in a star, have two further edges each.
const _: () = assert!(2 * 2 < CLOSED);
// An index is masked where it is known to be within its list: the mask then changes nothing, and spares the check.
const _: () = assert!(CLASSES.is_power_of_two() && LENGTHS.is_power_of_two() && ANGLES.is_power_of_two());

/// What *split?* is told by at a level, beside whether it is a boundary edge and how many sides are closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clue {
    /// How long the edge is beside those round it: tells most where the level is graded.
    #[default]
    Beside,
    /// How long it is by itself: where the edges of the level are of one length, as in a scan.
    Alone,
    /// How many edges its ends have and the vertices opposite to it: where vertices stand in rows, whose valences tell which went.
    Rows,
}

/// Of *split?*. Each level says which clue it goes by. Rich models mix.
#[derive(Clone, Debug)]
pub struct SplitModels {
    lengths: Lengths,
    /// From the first level on that goes by them.
    rows: Option<Box<RowModels>>,
    is_other: Bit,
    by_rows: Bit,
    rich: Option<Box<RichSplits>>,
    trial: Option<Box<Trial>>,
    /// What a writer has found for the level that begins.
    found: Option<Clue>,
}

/// By how many sides are closed, interior edges before those of the boundary, and edges of each vertex.
#[derive(Clone, Debug)]
struct RowModels([[Bit; VALENCES.pow(4)]; CLOSED]);

impl RowModels {
    fn fresh() -> Box<Self> {
        Box::new(Self([[Bit::NEW; VALENCES.pow(4)]; CLOSED]))
    }

    #[inline]
    fn of(&mut self, kind: usize, closed: usize, round: Round) -> &mut Bit {
        // A boundary edge has two other sides at most, and one inside four.
        &mut self.0[(closed + 5 * kind) & (CLOSED - 1)][usize::from(round.each) % VALENCES.pow(4)]
    }
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

/// What a writer tries: clues, all along, and what each would have cost in the last levels.
#[derive(Clone, Debug)]
struct Trial {
    lengths: Lengths,
    /// Where levels are tried before they are written.
    rows: Option<Box<RowModels>>,
    /// By clue, in units of 1/256 bit.
    costs: [u64; 3],
}

impl Trial {
    fn count(&mut self, kind: usize, closed: usize, length: Length, round: Round, bit: bool) {
        let rows = self.rows.as_mut().map(|rows| rows.of(kind, closed, round));
        let models = self.lengths.both(kind, closed, length).into_iter().chain(rows);
        for (model, cost) in models.zip(&mut self.costs) {
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
pub(super) const VALENCES: usize = 7;
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
        Self {
            angle,
            ends: class(edges[0] + edges[1]),
            far: if is_boundary { 0 } else { class(edges[2] + edges[3]) },
            sides: sides[0] * SIZES.pow(2) as u16 + sides[1],
            heights: pair([height(l), height(r)], SIZES) as u8,
            ..Self::of_edges(edges)
        }
    }

    /// Of an edge a–b, by how many edges a, b, l and r have alone.
    #[inline]
    pub fn of_edges([a, b, l, r]: [i32; 4]) -> Self {
        let [ends, far] = [[a, b], [l, r]].map(|of| pair(of.map(few), VALENCES));
        Self { each: ends * VALENCES.pow(2) as u16 + far, ..Self::NONE }
    }
}

/// A class of how many edges a vertex has, below [`VALENCES`].
#[inline]
pub(super) fn few(edges: i32) -> u16 {
    (edges - 3).clamp(0, VALENCES as i32 - 1) as u16
}

/// Two classes in either order, of so many, as one.
#[inline]
pub(super) fn pair([x, y]: [u16; 2], classes: usize) -> u16 {
    x.min(y) * classes as u16 + x.max(y)
}

impl SplitModels {
    const NEW: Self = Self {
        lengths: Lengths::NEW,
        rows: None,
        is_other: Bit::NEW,
        by_rows: Bit::NEW,
        rich: None,
        trial: None,
        found: None,
    };

    /// Fresh models.
    pub fn new(rich: bool) -> Self {
        Self { rich: rich.then(|| Box::new(RichSplits::NEW)), ..Self::NEW }
    }

    /// Whether they are rich.
    pub fn are_rich(&self) -> bool {
        self.rich.is_some()
    }

    /// Codes what a level goes by. A writer takes what it has found to be best, or of the lengths the one that would have been better before.
    pub fn choose<C: BitCoder>(&mut self, coder: &mut C) -> Clue {
        if self.rich.is_some() {
            return Clue::Beside;
        }
        let mut known = Clue::Beside;
        if C::ENCODES {
            known = self.found.take().unwrap_or_else(|| self.best_before());
        }
        if !coder.bit(&mut self.is_other, || known != Clue::Beside) {
            return Clue::Beside;
        }
        if !coder.bit(&mut self.by_rows, || known == Clue::Rows) {
            return Clue::Alone;
        }
        self.rows.get_or_insert_with(RowModels::fresh);
        Clue::Rows
    }

    fn best_before(&mut self) -> Clue {
        let fresh = || Box::new(Trial { lengths: Lengths::NEW, rows: None, costs: [0; 3] });
        let costs = &mut self.trial.get_or_insert_with(fresh).costs;
        let is_alone = costs[1] < costs[0];
        *costs = costs.map(|cost| cost / 2);
        if is_alone { Clue::Alone } else { Clue::Beside }
    }

    /// The same models, under which a writer tries a level: what would it have cost by each clue?
    #[cfg(feature = "encode")]
    pub fn on_trial(&self) -> Self {
        let rows = self.rows.clone().unwrap_or_else(RowModels::fresh);
        let trial = Trial { lengths: self.lengths.clone(), rows: Some(rows), costs: [0; 3] };
        Self { trial: Some(Box::new(trial)), found: Some(Clue::Beside), ..self.clone() }
    }

    /// The level that begins goes by what was best when it was `tried`.
    #[cfg(feature = "encode")]
    pub fn find(&mut self, tried: &Self) {
        let Some(trial) = &tried.trial else { return };
        let [beside, alone, rows] = trial.costs;
        self.found = Some(if rows < beside.min(alone) {
            Clue::Rows
        } else if alone < beside {
            Clue::Alone
        } else {
            Clue::Beside
        });
    }

    /// Whether a level that goes by this clue, or is tried, asks how many edges vertices have.
    #[inline]
    pub fn asks_for_rows(&self, clue: Clue) -> bool {
        clue == Clue::Rows || self.trial.as_ref().is_some_and(|trial| trial.rows.is_some())
    }

    /// Codes whether an edge is split.
    #[inline]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        is_boundary: bool,
        closed: u8,
        (length, clue, round): (Length, Clue, Round),
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
        let model = match (clue, &mut self.rows) {
            (Clue::Rows, Some(rows)) => rows.of(kind, closed, round),
            (Clue::Alone, _) => alone,
            _ => beside,
        };
        let bit = coder.bit(model, known);
        if C::ENCODES
            && let Some(trial) = &mut self.trial
        {
            trial.count(kind, closed, length, round, bit);
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

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::entropy::RangeEncoder;
    use std::collections::HashSet;

    /// A level whose edges are split by one of their lengths, whatever the other: the next level goes by that one.
    #[test]
    fn the_length_that_tells_more_is_chosen() {
        for better in [false, true] {
            let mut split = SplitModels::NEW;
            let mut coder = RangeEncoder::default();
            assert_eq!(split.choose(&mut coder), Clue::Beside, "nothing is known of it at first");
            for k in 0..1000 {
                let (x, y) = ((k % 7) as u8, (k / 7 % 5) as u8);
                let length = Length { beside: 5 + x, alone: 60 + y };
                let is_split = if better { y < 2 } else { x < 3 };
                split.code(&mut coder, false, 0, (length, Clue::Beside, Round::NONE), || is_split);
            }
            assert_eq!(split.choose(&mut coder), if better { Clue::Alone } else { Clue::Beside });
        }
    }

    /// A level whose edges are split by how many edges there are at their ends, by one of their lengths, or by the other: each is found by trying it,
    /// and a level that goes by it takes hardly a bit.
    #[test]
    fn what_tells_most_is_found_by_trying() {
        for clue in [Clue::Beside, Clue::Alone, Clue::Rows] {
            let decision = |k: usize| {
                let (x, y, z) = (k % 7, k / 7 % 5, k / 35 % 2);
                let length = Length { beside: 5 + x as u8, alone: 60 + y as u8 };
                let is_split = match clue {
                    Clue::Beside => x < 3,
                    Clue::Alone => y < 2,
                    Clue::Rows => z == 1,
                };
                (length, Round::of_edges([6, 6, 6 - 2 * z as i32, 6]), is_split)
            };
            let mut split = SplitModels::NEW;
            let mut tried = split.on_trial();
            let level = |split: &mut SplitModels| {
                let mut coder = RangeEncoder::default();
                let chosen = split.choose(&mut coder);
                for (length, round, is_split) in (0..1050).map(decision) {
                    split.code(&mut coder, false, 0, (length, chosen, round), || is_split);
                }
                (chosen, coder.bits())
            };
            level(&mut tried);
            split.find(&tried);
            let (chosen, bits) = level(&mut split);
            assert_eq!(chosen, clue);
            assert!(bits < 200.0, "{clue:?}: {bits}");
        }
    }

    /// Boundary edges and others are told apart, however many sides are closed.
    #[test]
    fn no_two_kinds_of_edges_share_a_model_of_rows() {
        let mut rows = RowModels::fresh();
        let mut seen = HashSet::new();
        for (kind, most) in [(0, 4), (1, 2)] {
            for closed in 0..=most {
                assert!(seen.insert(std::ptr::from_mut(rows.of(kind, closed, Round::NONE))));
            }
        }
    }

    #[test]
    fn fresh_models_expect_the_usual() {
        let split = SplitModels::NEW;
        let chance = |class: usize| split.lengths.beside[0][0][class].zero();
        assert!(chance(14) < chance(10) && chance(10) < chance(5));
    }
}
