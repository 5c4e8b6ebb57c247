//! What the decisions of refinements are coded under, and what is known of them beforehand (spec §5.5).

use crate::codec::context::ANGLES;
use crate::codec::extents::{CLASSES, LENGTHS, Length};
use crate::codec::position::PositionModels;
use crate::entropy::mix::squash;
use crate::entropy::{Bit, BitCoder, Mixer};

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
        Self {
            split: SplitModels::NEW,
            flip: FlipModels::NEW,
            face: Bit::NEW,
            attach: Bit::NEW,
            position: PositionModels::default(),
            precision: [Bit::NEW; 3],
        }
    }
}

/// Places for how many sides are closed: more than there are, so that any three bits make one.
const CLOSED: usize = 8;
// Two triangles, of which neither is in a star, have two further edges each.
const _: () = assert!(2 * 2 < CLOSED);
// An index is masked where it is known to be within its list: the mask then changes nothing, and spares the check.
const _: () = assert!(CLASSES.is_power_of_two() && LENGTHS.is_power_of_two());

/// Of *split?*, by whether it is a boundary edge and how many sides are closed. There are two: by how long the edge is beside those
/// round it, and by how long it is. Where edges of a level are of one length, as in a scan, the second knows more; where
/// the level is graded, the first.
#[derive(Clone, Debug)]
pub struct SplitModels {
    beside: [[[Bit; CLASSES]; CLOSED]; 2],
    alone: [[[Bit; LENGTHS]; CLOSED]; 2],
    mixers: [[Mixer<2>; CLOSED]; 2],
}

impl SplitModels {
    const NEW: Self = {
        let mut beside = [[[Bit::NEW; CLASSES]; CLOSED]; 2];
        let mut kind = 0;
        while kind < 2 {
            let mut closed = 0;
            while closed < SPLIT_BY_CLOSED[kind].len() {
                let mut class = 0;
                while class < SPLIT_BY_CLASS.len() {
                    beside[kind][closed][class] =
                        known(SPLIT_BY_CLOSED[kind][closed] + SPLIT_BY_CLASS[class]);
                    class += 1;
                }
                closed += 1;
            }
            kind += 1;
        }
        Self {
            beside,
            alone: [[[Bit::NEW; LENGTHS]; CLOSED]; 2],
            mixers: [[Mixer::new([1 << 15; 2]); CLOSED]; 2],
        }
    };

    /// Codes whether an edge is split.
    #[inline]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        is_boundary: bool,
        closed: u8,
        length: Length,
        known: impl FnOnce() -> bool,
    ) -> bool {
        let (kind, closed) = (usize::from(is_boundary), usize::from(closed) & (CLOSED - 1));
        let beside = &mut self.beside[kind][closed][usize::from(length.beside) & (CLASSES - 1)];
        let alone = &mut self.alone[kind][closed][usize::from(length.alone) & (LENGTHS - 1)];
        self.mixers[kind][closed].code(coder, [beside, alone], known)
    }
}

/// What is known of a link edge p–q, between v and r, beyond its shape.
#[derive(Clone, Copy, Debug)]
pub struct Ring {
    /// How many flips there were before in this star.
    pub flips: usize,
    /// How many of the two edges beyond lead nowhere or to a star.
    pub closed: u8,
    /// How many edges p and q have together, and how many r.
    pub ends: i32,
    pub far: i32,
}

/// Places for what is known of a link edge's shape, seven bits.
const SHAPES: usize = 1 << 7;

/// Of *flip?*. There are two: by the shape of what the edge divides, and by how many edges its vertices have. The mixers are by the
/// number of flips before and of edges closed beyond.
#[derive(Clone, Debug)]
pub struct FlipModels {
    shape: [Bit; SHAPES],
    valences: [[[Bit; 4]; 8]; 16],
    mixers: [[Mixer<2>; 4]; 4],
}

impl FlipModels {
    const NEW: Self = {
        let mut shape = [Bit::NEW; SHAPES];
        let mut place = 0;
        while place < FLIP_BY_BEND.len() * ANGLES {
            shape[place] = known(FLIP_BY_BEND[place / ANGLES] + FLIP_BY_ANGLE[place % ANGLES]);
            place += 1;
        }
        let mut valences = [[[Bit::NEW; 4]; 8]; 16];
        let mut ends = 0;
        while ends < FLIP_BY_ENDS.len() {
            let mut place = 0;
            while place < 8 * 4 {
                let (far, flips) = (place / 4, place % 4);
                valences[ends][far][flips] =
                    known(FLIP_BY_ENDS[ends] + FLIP_BY_FAR[far] + FLIP_BY_FLIPS[flips]);
                place += 1;
            }
            ends += 1;
        }
        Self { shape, valences, mixers: [[Mixer::new([45056; 2]); 4]; 4] }
    };

    /// Codes whether a link edge is flipped; its shape is what [`link_edges`](crate::codec::context::link_edges) tells.
    #[inline]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        shape: u8,
        ring: Ring,
        known: impl FnOnce() -> bool,
    ) -> bool {
        let flips = ring.flips.min(3);
        let ends = (ring.ends - 6).clamp(0, FLIP_BY_ENDS.len() as i32 - 1) as usize;
        let far = (ring.far - 3).clamp(0, 7) as usize;
        let shape = &mut self.shape[usize::from(shape) & (SHAPES - 1)];
        let valences = &mut self.valences[ends][far][flips];
        let mixer = &mut self.mixers[flips][usize::from(ring.closed.min(2))];
        mixer.code(coder, [shape, valences], known)
    }
}

/// A model that has learnt from six decisions, as it were, that the answer is no with this chance, stretched, in units of 1/16.
const fn known(stretched: i32) -> Bit {
    Bit::known(squash(16 * stretched), 6)
}

// What is known beforehand, the chance of a no. Fitted to the decisions of 21 meshes, scans, CAD, characters, generated ones, as sums of
// what each part of a context says; other meshes were used to see what it is good for.
const SPLIT_BY_CLOSED: [&[i32]; 2] = [&[15, 22, 31, 38, 20], &[14, 24, 41]];
const SPLIT_BY_CLASS: [i32; 20] =
    [15, 23, 26, 26, 25, 24, 23, 22, 18, 15, 11, 6, -4, -11, -17, -12, -12, -10, -1, 4];
const FLIP_BY_BEND: [i32; 5] = [11, 20, 25, 31, 13];
const FLIP_BY_ANGLE: [i32; ANGLES] = [-60, -56, -45, -38, -30, -20, -15, -11, -2, 10, 19, 29, 42, 56, 60, 61];
const FLIP_BY_ENDS: [i32; 12] = [6, 12, 46, 47, 40, 30, 21, 12, 2, -3, -6, -1];
const FLIP_BY_FAR: [i32; 8] = [-25, -14, -6, 11, 17, 21, 18, 12];
const FLIP_BY_FLIPS: [i32; 4] = [-5, 10, 35, 18];
