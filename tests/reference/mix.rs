//! Chapter 6.5: decisions mixed of several models.

use std::array;
use std::sync::OnceLock;

use super::container::Result;
use super::entropy::{Code, Model};

const CURVE: [i64; 17] =
    [22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768];

/// squash(x).
pub fn squash(x: i64) -> i64 {
    let curve = |i: i64| if i <= 16 { CURVE[i as usize] } else { 65536 - CURVE[32 - i as usize] };
    let place = x.clamp(-2048, 2047) + 2048;
    let (i, part) = (place / 128, place % 128);
    ((curve(i) * (128 - part) + curve(i + 1) * part + 64) >> 7).clamp(32, 65504)
}

/// stretch(zero).
pub fn stretch(zero: i64) -> i64 {
    static TABLE: OnceLock<Vec<i64>> = OnceLock::new();
    let least = |n: i64| (-2048..2047).find(|&x| squash(x) >= 16 * n + 8).unwrap_or(2047);
    TABLE.get_or_init(|| (0..4096).map(least).collect())[zero as usize / 16]
}

/// Weights before anything is learnt.
pub const ALIKE: [i64; 6] = [13107; 6];

/// What came of decisions that were thought so likely.
#[derive(Clone)]
pub struct Outcomes([Model; 17]);

impl Outcomes {
    pub fn fresh() -> Self {
        Self(array::from_fn(|i| Model::known_from(squash(256 * i as i64 - 2048), 4)))
    }
}

/// mixed(w, out, m).
pub fn read(
    code: &mut Code,
    weights: [&mut [i64; 6]; 3],
    Outcomes(out): &mut Outcomes,
    models: [&mut Model; 6],
) -> Result<bool> {
    let x = models.each_ref().map(|m| stretch(m.zero()));
    let sum = |w: &[i64; 6]| w.iter().zip(x).map(|(weight, x)| weight * x).sum::<i64>();
    let said = weights.each_ref().map(|w| (sum(w) >> 16).clamp(-2048, 2047));
    let place = said.iter().sum::<i64>().div_euclid(3) + 2048;
    let (i, part) = ((place / 256) as usize, place % 256);
    let turned_out = (out[i].zero() * (256 - part) + out[i + 1].zero() * part) >> 8;
    let zero = (squash(place - 2048) + turned_out + 1) >> 1;
    let bit = code.decide(zero as u64)?;
    for (w, said) in weights.into_iter().zip(said) {
        let error = if bit { 0 } else { 65536 } - squash(said);
        for (weight, x) in w.iter_mut().zip(x) {
            *weight = (*weight + ((error * x + 8192) >> 14)).clamp(-262_143, 262_143);
        }
    }
    out[i + usize::from(part >= 128)].learn(bit);
    models.into_iter().for_each(|m| m.learn_up_to(bit, 30));
    Ok(bit)
}

#[test]
fn the_ends_of_the_curve() {
    assert_eq!([-9999, -2048, 0, 2047, 9999].map(squash), [32, 32, 32768, 65504, 65504]);
    assert_eq!([32, 1000, 16384, 32768, 49152, 65504].map(stretch), [-1901, -1074, -283, 1, 285, 2047]);
}

#[test]
fn the_example_of_the_chapter() {
    let known = |x: i64| Model::known(squash(16 * x));
    let mut models = [known(24), Model::FRESH, known(-11), known(8), Model::FRESH, Model::FRESH];
    let (mut weights, mut out) = ([ALIKE; 3], Outcomes::fresh());
    let mut code = Code::start(&[0x78]);
    let rows = [
        ([53581, 32768, 22074, 40793, 32768, 32768], [13107; 6], false),
        ([55170, 54591, 27864, 44087, 54591, 54591], [13777, 13109, 12800, 13330, 13109, 13109], true),
        ([48683, 32767, 24589, 38904, 32767, 32767], [12382, 11775, 13051, 12726, 11775, 11775], false),
        ([50453, 42120, 28895, 41703, 42120, 42120], [12884, 11775, 12813, 12905, 11775, 11775], false),
    ];
    for (before, weighed, bit) in rows {
        assert_eq!((models.each_ref().map(Model::zero), weights), (before, [weighed; 3]));
        let [u, v, w] = &mut weights;
        assert_eq!(read(&mut code, [u, v, w], &mut out, models.each_mut()), Ok(bit));
    }
    let after = ([51886, 47316, 32381, 43969, 47316, 47316], [13324, 11988, 12728, 13108, 11988, 11988]);
    assert_eq!((models.each_ref().map(Model::zero), weights[0]), after);
    code.end().unwrap();
}
