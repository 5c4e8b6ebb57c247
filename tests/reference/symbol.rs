//! Chapter 6.4: symbols.

use super::container::Result;
use super::entropy::{Code, Part};

/// W.
const WHOLE: i64 = 32752 * 4096;

/// A symbol model.
#[derive(Clone, Copy)]
pub struct Symbol {
    sums: [i64; 16],
    count: u32,
}

impl Symbol {
    /// bell(variance, offset).
    pub fn bell(variance: i64, offset: i64) -> Self {
        let spread = 5 * variance;
        let weight = |i: i64| {
            let d = 12 * (i - 8) + offset;
            let near = 1024 * spread / (spread + d * d);
            near * near * near / 1024 + 100
        };
        let sum = |n: i64| (0..n).map(weight).sum::<i64>();
        let sums = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
        Self { sums: sums.map(|i| WHOLE * sum(i + 1) / sum(16)), count: 48 }
    }

    /// end(i).
    fn end(&self, i: usize) -> u64 {
        (self.sums[i] >> 12) as u64 + i as u64 + 1
    }

    fn learn(&mut self, s: usize) {
        let rate = match self.count {
            0..24 => 4,
            24..48 => 5,
            48..128 => 6,
            _ => 7,
        };
        for (i, sum) in self.sums.iter_mut().enumerate() {
            let target = if i < s { 0 } else { WHOLE };
            *sum += (target - *sum) >> rate;
        }
        self.count += 1;
    }
}

impl Code<'_> {
    /// symbol(S).
    pub fn symbol(&mut self, model: &mut Symbol) -> Result<usize> {
        let value = self.value(1 << 15);
        let met = (0..16).filter(|&i| model.end(i) <= value).count();
        let s = self.answer(met as u64, 8).min(15) as usize;
        let start = if s == 0 { 0 } else { model.end(s - 1) };
        self.take(Part { parts: 1 << 15, start, end: (s < 15).then(|| model.end(s)) }, s as u64)?;
        model.learn(s);
        Ok(s)
    }
}

#[test]
fn the_example_of_the_chapter() {
    let mut model = Symbol::bell(418, 0);
    let mut code = Code::start(&[0x79, 0x6B, 0xFB, 0xCC, 0x14, 0x08]);
    let ends = |model: &Symbol| -> Vec<u64> { (0..16).map(|i| model.end(i)).collect() };
    let fresh =
        [47, 136, 311, 677, 1469, 3199, 6731, 12732, 20083, 26084, 29616, 31346, 32138, 32504, 32679, 32768];
    assert_eq!(ends(&model), fresh);
    let learnt = [
        (8, [47, 134, 306, 666, 1446, 3149, 6626, 12533, 20281, 26188, 29665, 31368, 32148, 32508, 32681]),
        (7, [46, 132, 302, 656, 1424, 3100, 6523, 12849, 20476, 26291, 29714, 31390, 32157, 32512, 32682]),
        (15, [45, 129, 297, 646, 1402, 3051, 6421, 12648, 20156, 25880, 29250, 30899, 31655, 32004, 32172]),
        (8, [45, 127, 292, 636, 1380, 3004, 6321, 12451, 20353, 25988, 29305, 30929, 31673, 32016, 32181]),
    ];
    for (expected, after) in learnt {
        assert_eq!(code.symbol(&mut model), Ok(expected));
        assert_eq!(ends(&model)[..15], after);
        assert_eq!(model.end(15), 32768);
    }
    assert_eq!(code.bits(5), Ok(31));
    assert_eq!(code.bits(16), Ok(1000));
    assert_eq!(code.even(), Ok(true));
    assert_eq!(code.asked(), 8);
    code.end().unwrap();
}

#[test]
fn no_symbol_is_ever_lost() {
    for s in 0..16 {
        let mut model = Symbol::bell(24, 4);
        for _ in 0..5000 {
            model.learn(s);
        }
        assert_eq!(model.end(15), 32768);
        let widths = (0..16).map(|i| model.end(i) - if i == 0 { 0 } else { model.end(i - 1) });
        assert!(widths.min() >= Some(1), "after {s} again and again");
    }
}
