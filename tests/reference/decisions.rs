//! Chapters 5.5.2 and 5.5.3: the models of splits and flips, and what is known beforehand.

use std::array;

use super::container::Result;
use super::contexts::{Flip, Split};
use super::entropy::{Code, Model};
use super::mix::{self, ALIKE, Outcomes, squash};

/// The models of splits, and the weights of those that are mixed.
pub struct Splits {
    beside: [[[Model; 20]; 5]; 2],
    alone: [[[Model; 199]; 5]; 2],
    /// By edges of each, as rich ones.
    rows: [[Vec<Model>; 5]; 2],
    other: Model,
    by_rows: Model,
    flips_by_rows: Model,
    rich: Option<RichSplits>,
}

/// What the splits of a level of plain models go by; where it is rows, whether its flips do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clue {
    Beside,
    Alone,
    Rows { flips: bool },
}

struct RichSplits {
    angles: [[[[Model; 20]; 16]; 5]; 2],
    valences: [[[Model; 10]; 10]; 10],
    each: Vec<Model>,
    sides: [[Vec<Model>; 5]; 2],
    heights: [[Vec<[Model; 10]>; 5]; 2],
    by_closed: [[[i64; 6]; 5]; 2],
    by_valence: [[[i64; 6]; 10]; 10],
    by_length: [[i64; 6]; 20],
    out: [[Outcomes; 5]; 2],
}

impl Splits {
    pub fn fresh(rich: bool) -> Self {
        let closed = [[15, 22, 31, 38, 20], [14, 24, 41, 0, 0]];
        let class = [15, 23, 26, 26, 25, 24, 23, 22, 18, 15, 11, 6, -4, -11, -17, -12, -12, -10, -1, 4];
        let beside = closed.map(|of_kind| of_kind.map(|y| class.map(|x| known(x + y))));
        let rich = rich.then(|| {
            let closed = [[10, 17, 26, 34, 16], [10, 18, 36, 0, 0]];
            let angle = [7, 7, 8, 7, 6, 5, 4, 5, 6, 6, 4, 3, 4, 8, 12, 7];
            let class = [10, 16, 20, 20, 21, 20, 21, 19, 17, 14, 11, 6, -4, -12, -17, -13, -14, -12, -3, 4];
            let ends = [38, 22, 23, 23, 20, 11, 4, 1, 3, 21];
            let far = [-3, 5, 6, 6, 6, 8, 11, 13, 13, 4];
            let half = [11, 22, 21, 20, 14, 7, -7, -15, -10, -3];
            RichSplits {
                angles: closed.map(|of_kind| of_kind.map(|x| angle.map(|y| class.map(|z| known(x + y + z))))),
                valences: ends.map(|x| far.map(|y| half.map(|z| known(x + y + z)))),
                each: vec![Model::FRESH; 7 * 7 * 7 * 7],
                sides: array::from_fn(|_| array::from_fn(|_| vec![Model::FRESH; 6 * 6 * 6 * 6])),
                heights: array::from_fn(|_| array::from_fn(|_| vec![[Model::FRESH; 10]; 6 * 6])),
                by_closed: [[ALIKE; 5]; 2],
                by_valence: [[ALIKE; 10]; 10],
                by_length: [ALIKE; 20],
                out: array::from_fn(|_| array::from_fn(|_| Outcomes::fresh())),
            }
        });
        let rows = array::from_fn(|_| array::from_fn(|_| vec![Model::FRESH; 7 * 7 * 7 * 7]));
        let alone = [[[Model::FRESH; 199]; 5]; 2];
        Self {
            beside,
            alone,
            rows,
            other: Model::FRESH,
            by_rows: Model::FRESH,
            flips_by_rows: Model::FRESH,
            rich,
        }
    }

    /// What a level goes by; rich models by all.
    pub fn choose(&mut self, code: &mut Code) -> Result<Clue> {
        Ok(if self.rich.is_some() || !code.read(&mut self.other)? {
            Clue::Beside
        } else if code.read(&mut self.by_rows)? {
            Clue::Rows { flips: code.read(&mut self.flips_by_rows)? }
        } else {
            Clue::Alone
        })
    }

    pub fn read(&mut self, code: &mut Code, at: Split, clue: Clue) -> Result<bool> {
        let few = |edges: i64| (edges - 3).clamp(0, 6) as usize;
        let [a, b, l, r] = at.looked.edges;
        let each = 49 * pair(few(a), few(b), 7) + pair(few(l), few(r), 7);
        let alone = &mut self.alone[at.kind][at.closed][at.length];
        let Some(rich) = &mut self.rich else {
            return code.read(match clue {
                Clue::Beside => &mut self.beside[at.kind][at.closed][at.class],
                Clue::Alone => alone,
                Clue::Rows { .. } => &mut self.rows[at.kind][at.closed][each],
            });
        };
        let angles = &mut rich.angles[at.kind][at.closed][at.looked.angle][at.class];
        let sum = |x: i64, y: i64| (x + y - 8).clamp(0, 9) as usize;
        let (ends, far) = (sum(a, b), if at.kind == 1 { 0 } else { sum(l, r) });
        let [al, bl, ar, br] = at.looked.sides;
        let sides = 36 * pair(al, bl, 6) + pair(ar, br, 6);
        let heights = pair(at.looked.heights[0], at.looked.heights[1], 6);
        let models = [
            angles,
            alone,
            &mut rich.valences[ends][far][at.class / 2],
            &mut rich.each[each],
            &mut rich.sides[at.kind][at.closed][sides],
            &mut rich.heights[at.kind][at.closed][heights][at.class / 2],
        ];
        let weights = [
            &mut rich.by_closed[at.kind][at.closed],
            &mut rich.by_valence[ends][far],
            &mut rich.by_length[at.class],
        ];
        mix::read(code, weights, &mut rich.out[at.kind][at.closed], models)
    }
}

/// Both, in either order, of so many.
fn pair(x: usize, y: usize, of: usize) -> usize {
    of * x.min(y) + x.max(y)
}

/// The models of flips, and the weights of those that are mixed.
pub struct Flips {
    shape: [[[[Model; 8]; 4]; 3]; 8],
    rows: Vec<[[[Model; 3]; 4]; 8]>,
    rich: Option<RichFlips>,
}

struct RichFlips {
    shape: [[[Model; 32]; 5]; 3],
    reach: [[[[Model; 16]; 12]; 3]; 4],
    valences: [[[Model; 4]; 8]; 12],
    each: [[[Model; 4]; 8]; 49],
    excess_reach: [[[Model; 8]; 12]; 8],
    excess_bend: [[[[Model; 5]; 8]; 3]; 4],
    by_flips: [[[i64; 6]; 3]; 4],
    by_excess: [[i64; 6]; 8],
    by_reach: [[[i64; 6]; 12]; 3],
    out: [Outcomes; 4],
}

impl Flips {
    pub fn fresh(rich: bool) -> Self {
        let excess = [36, 42, 39, 32, 25, 18, 9, -2];
        let angle = [-52, -37, -22, -10, 4, 21, 41, 50];
        let rich = rich.then(|| {
            let ends = [6, 12, 46, 47, 40, 30, 21, 12, 2, -3, -6, -1];
            let far = [-25, -14, -6, 11, 17, 21, 18, 12];
            let flips = [-5, 10, 35, 18];
            let bend = [12, 20, 25, 32, 14];
            let fine = [
                -66, -56, -60, -55, -49, -44, -40, -40, -33, -28, -23, -20, -17, -15, -13, -12, -6, 3, 6, 11,
                15, 19, 24, 32, 39, 43, 52, 58, 57, 62, 58, 59,
            ];
            let both = [[2, 4, 0], [14, 18, 17], [36, 34, 35], [13, 14, 15]];
            let reach = [19, 16, 11, 8, 6, -2, -5, -7, -3, 0, 5, 14];
            let angle = [-59, -59, -49, -41, -30, -19, -9, -6, 6, 18, 27, 36, 45, 50, 48, 47];
            RichFlips {
                shape: array::from_fn(|_| bend.map(|x| fine.map(|y| known(x + y)))),
                reach: both.map(|of_flips| of_flips.map(|x| reach.map(|y| angle.map(|z| known(x + y + z))))),
                valences: ends.map(|x| far.map(|y| flips.map(|z| known(x + y + z)))),
                each: [[[Model::FRESH; 4]; 8]; 49],
                excess_reach: [[[Model::FRESH; 8]; 12]; 8],
                excess_bend: [[[[Model::FRESH; 5]; 8]; 3]; 4],
                by_flips: [[ALIKE; 3]; 4],
                by_excess: [ALIKE; 8],
                by_reach: [[ALIKE; 12]; 3],
                out: array::from_fn(|_| Outcomes::fresh()),
            }
        });
        Self {
            shape: excess.map(|x| array::from_fn(|_| array::from_fn(|_| angle.map(|y| known(x + y))))),
            rows: vec![[[[Model::FRESH; 3]; 4]; 8]; 7 * 7],
            rich,
        }
    }

    pub fn read(&mut self, code: &mut Code, at: Flip, clue: Clue) -> Result<bool> {
        let [p, q, r] = at.valences;
        let excess = (p + q - r - at.flips as i64 - 2).clamp(0, 7) as usize;
        let flips = at.flips.min(3);
        let (ends, far) = ((p + q - 6).clamp(0, 11) as usize, (r - 3).clamp(0, 7) as usize);
        let few = |edges: i64| (edges - 3).clamp(0, 6) as usize;
        let each = pair(few(p), few(q), 7);
        let Some(rich) = &mut self.rich else {
            if clue == (Clue::Rows { flips: true }) {
                return code.read(&mut self.rows[each][far][flips][at.end]);
            }
            return code.read(&mut self.shape[excess][at.end][flips][at.angle / 4]);
        };
        let models = [
            &mut rich.shape[at.end][at.bend][at.angle],
            &mut rich.reach[flips][at.closed][at.reach][at.angle / 2],
            &mut rich.valences[ends][far][flips],
            &mut rich.each[each][far][flips],
            &mut rich.excess_reach[excess][at.reach][at.angle / 4],
            &mut rich.excess_bend[flips][at.closed][excess][at.bend],
        ];
        let weights = [
            &mut rich.by_flips[flips][at.closed],
            &mut rich.by_excess[excess],
            &mut rich.by_reach[at.end][at.reach],
        ];
        mix::read(code, weights, &mut rich.out[flips], models)
    }
}

/// known(x).
pub fn known(x: i64) -> Model {
    Model::known(squash(16 * x))
}
