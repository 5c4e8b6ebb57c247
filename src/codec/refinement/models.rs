//! What the decisions of refinements are coded under (spec §5.5).

use super::flips::FlipModels;
use super::splits::{Clue, SplitModels};
use crate::codec::position::PositionModels;
use crate::entropy::{Bit, BitCoder};

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
            split: SplitModels::new(rich),
            flip: FlipModels::new(rich),
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

    /// The same models, under which a writer tries a level: what would its splits cost by each clue? Rich models go by none.
    #[cfg(feature = "encode")]
    pub fn on_trial(&self) -> Option<Self> {
        let on_trial = || Self { split: self.split.on_trial(), flip: self.flip.on_trial(), ..self.clone() };
        (!self.are_rich()).then(on_trial)
    }

    /// The level that begins goes by what was best when it was `tried`.
    #[cfg(feature = "encode")]
    pub fn find(&mut self, tried: &Self) {
        self.split.find(&tried.split);
        self.flip.find(&tried.flip);
    }

    /// Codes what the splits of a level go by, and whether its flips are told by rows.
    pub(super) fn choose<C: BitCoder>(&mut self, coder: &mut C) -> (Clue, bool) {
        let clue = self.split.choose(coder);
        (clue, clue == Clue::Rows && self.flip.choose(coder))
    }

    /// Whether they are rich.
    pub(super) fn are_rich(&self) -> bool {
        self.split.are_rich()
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::codec::context::Shape;
    use crate::codec::extents::Length;
    use crate::codec::refinement::flips::Ring;
    use crate::codec::refinement::splits::Round;
    use crate::codec::vector::Vector;
    use crate::entropy::RangeEncoder;

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
                let length = (Length { beside: 10, alone: 60 }, Clue::Beside, round);
                models.split.code(&mut coder, false, 0, length, || k % 3 == 0);
                let more = i32::from(k % 3 == 0);
                let ring = Ring { flips: 0, closed: 0, ends: [6, 6 + more], far: 6 + more, end: 0 };
                let cells = || [Vector::default(); 4];
                models
                    .flip
                    .code(&mut coder, Shape { angle: 16, bend: 0 }, (ring, false), cells, || k % 3 == 0);
            }
            coder.bits()
        };
        let (plain, rich) = (bits(false), bits(true));
        assert!(plain > 1800.0 && rich < 300.0, "{plain} and {rich}");
    }
}
