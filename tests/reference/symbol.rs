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
    /// A bell round symbol 8.
    pub const FRESH: Self = {
        let weight = [1, 2, 3, 5, 8, 12, 18, 25, 30, 25, 18, 12, 8, 5, 3];
        let mut sums = [WHOLE; 16];
        let (mut i, mut sum) = (0, 0);
        while i < 15 {
            sum += weight[i];
            sums[i] = 757_921 * sum;
            i += 1;
        }
        Self { sums, count: 0 }
    };

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
    let mut model = Symbol::FRESH;
    let mut code = Code::start(&[0x7C, 0x03, 0x0D, 0xB4, 0x10]);
    let ends = |model: &Symbol| -> Vec<u64> { (0..16).map(|i| model.end(i)).collect() };
    let fresh = [
        186, 557, 1113, 2039, 3520, 5742, 9073, 13700, 19253, 23880, 27211, 29433, 30914, 31840, 32396, 32768,
    ];
    assert_eq!(ends(&model), fresh);
    let learnt = [
        (8, [174, 522, 1043, 1912, 3301, 5383, 8507, 12845, 20097, 24435, 27558, 29641, 31030, 31898, 32420]),
        (7, [163, 489, 978, 1792, 3095, 5047, 7975, 14089, 20888, 24955, 27883, 29836, 31138, 31952, 32441]),
        (15, [153, 459, 917, 1681, 2901, 4732, 7477, 13209, 19583, 23396, 26141, 27972, 29193, 29956, 30415]),
        (8, [143, 430, 860, 1576, 2720, 4437, 7010, 12384, 20407, 23981, 26555, 28272, 29416, 30132, 30562]),
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
        let mut model = Symbol::FRESH;
        for _ in 0..5000 {
            model.learn(s);
        }
        assert_eq!(model.end(15), 32768);
        let widths = (0..16).map(|i| model.end(i) - if i == 0 { 0 } else { model.end(i - 1) });
        assert!(widths.min() >= Some(1), "after {s} again and again");
    }
}
