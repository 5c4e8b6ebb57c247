//! Whether link edges are flipped: what is known of them, and what that is coded under (spec §5.5.3).

use super::priors;
use super::splits::{VALENCES, few, pair};
use crate::codec::context::{ANGLES, BENDS, REACHES, Shape, reach};
use crate::codec::vector::Vector;
use crate::entropy::{Bit, BitCoder, Mixer, Outcomes, mix};

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
    /// From the first level on whose flips are told by them.
    rows: Option<Box<RowModels>>,
    by_rows: Bit,
    rich: Option<Box<RichFlips>>,
    trial: Option<Box<Trial>>,
    /// What a writer has found for the level that begins.
    found: bool,
}

/// By how many edges p and q have, and r, flips before, and where in the star: where vertices stand in rows the valences tell what was done.
#[derive(Clone, Debug)]
struct RowModels([[[[Bit; 4]; 4]; 8]; VALENCES.pow(2)]);

impl RowModels {
    fn fresh() -> Box<Self> {
        Box::new(Self([[[[Bit::NEW; 4]; 4]; 8]; VALENCES.pow(2)]))
    }

    #[inline]
    fn of(&mut self, ring: Ring) -> &mut Bit {
        &mut self.0[ring.of_each()][ring.of_far()][ring.flips.min(3)][ring.end & 3]
    }
}

/// What a writer tries: what the flips of a level cost by the shape and by rows, in units of 1/256 bit.
#[derive(Clone, Debug)]
struct Trial {
    rows: Box<RowModels>,
    costs: [u64; 2],
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

impl Ring {
    /// A class of how many edges p and q each have, in either order.
    #[inline]
    fn of_each(self) -> usize {
        usize::from(pair(self.ends.map(few), VALENCES))
    }

    /// A class of how many r has.
    #[inline]
    fn of_far(self) -> usize {
        (self.far - 3).clamp(0, 7) as usize
    }
}

impl FlipModels {
    const NEW: Self =
        Self { shape: priors::shape(), rows: None, by_rows: Bit::NEW, rich: None, trial: None, found: false };

    /// Fresh models.
    pub fn new(rich: bool) -> Self {
        Self { rich: rich.then(|| Box::new(RichFlips::NEW)), ..Self::NEW }
    }

    /// Codes whether a level's flips are told by rows, too, where its splits are.
    pub fn choose<C: BitCoder>(&mut self, coder: &mut C) -> bool {
        let known = std::mem::take(&mut self.found);
        let by_rows = coder.bit(&mut self.by_rows, || known);
        if by_rows {
            self.rows.get_or_insert_with(RowModels::fresh);
        }
        by_rows
    }

    /// The same models, under which a writer tries a level.
    #[cfg(feature = "encode")]
    pub fn on_trial(&self) -> Self {
        let rows = self.rows.clone().unwrap_or_else(RowModels::fresh);
        Self { trial: Some(Box::new(Trial { rows, costs: [0; 2] })), ..self.clone() }
    }

    /// The level that begins goes by what was better when it was `tried`.
    #[cfg(feature = "encode")]
    pub fn find(&mut self, tried: &Self) {
        self.found = tried.trial.as_ref().is_some_and(|trial| trial.costs[1] < trial.costs[0]);
    }

    /// Codes whether a link edge is flipped. `cells` are those of v, p, q and r, for rich models.
    #[inline]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        shape: Shape,
        (ring, by_rows): (Ring, bool),
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
            let far = ring.of_far();
            let (end, [v, p, q, r]) = (ring.end & 3, cells());
            let reach = reach(v, p, q, r) & 15;
            let models = [
                &mut rich.shape[end][bend][angle],
                &mut rich.reach[flips][closed][reach][angle / 2],
                &mut rich.valences[both][far][flips],
                &mut rich.each[ring.of_each()][far][flips],
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
        if by_rows && let Some(rows) = &mut self.rows {
            return coder.bit(rows.of(ring), known);
        }
        let model = &mut self.shape[excess][ring.end & 3][flips][angle / 4];
        let before = *model;
        let bit = coder.bit(model, known);
        if C::ENCODES
            && let Some(trial) = &mut self.trial
        {
            let rows = trial.rows.of(ring);
            trial.costs[0] += u64::from(before.cost(bit));
            trial.costs[1] += u64::from(rows.cost(bit));
            rows.learn(bit);
        }
        bit
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

    /// A mesh of rows, whose stars all flip the edge that starts at an end of the one split, and then no other.
    #[test]
    fn flips_are_told_by_their_place_in_the_star() {
        let mut models = FlipModels::NEW;
        let mut coder = RangeEncoder::default();
        for k in 0..1000 {
            let (end, flips) = (1 + k % 2, k / 2 % 2);
            let ring = Ring { flips, closed: 0, ends: [6, 6 + flips as i32], far: 6, end };
            let cells = || [Vector::default(); 4];
            let is_flipped = end == 1 && flips == 0;
            models.code(&mut coder, Shape { angle: 16, bend: 0 }, (ring, false), cells, || is_flipped);
        }
        assert!(coder.bits() < 100.0, "{}", coder.bits());
    }

    /// Flips that are told by the angle alone, or by how many edges p has: either is found by trying, and taken.
    #[test]
    fn what_tells_more_is_found_by_trying() {
        for by_rows in [false, true] {
            let mut models = FlipModels::NEW;
            let mut tried = models.on_trial();
            let level = |models: &mut FlipModels| {
                let mut coder = RangeEncoder::default();
                let chosen = models.choose(&mut coder);
                for k in 0..1000 {
                    let (x, y) = (k % 3 == 0, k % 7 < 3);
                    let ring = Ring { flips: 0, closed: 0, ends: [8 - 2 * i32::from(x), 6], far: 5, end: 0 };
                    let shape = Shape { angle: if y { 4 } else { 28 }, bend: 0 };
                    let cells = || [Vector::default(); 4];
                    models.code(&mut coder, shape, (ring, chosen), cells, || if by_rows { x } else { y });
                }
                (chosen, coder.bits())
            };
            level(&mut tried);
            models.find(&tried);
            let (chosen, bits) = level(&mut models);
            assert_eq!(chosen, by_rows);
            assert!(bits < 100.0, "{bits}");
        }
    }

    /// Before anything is learnt, edges that are far from Delaunay and have many edges at their ends are expected to be flipped, and
    /// others not.
    #[test]
    fn fresh_models_expect_the_usual() {
        let flip = FlipModels::NEW;
        assert!(flip.shape[7][0][0][0].zero() < 1 << 13 && flip.shape[2][0][0][7].zero() > 65000);
    }
}
