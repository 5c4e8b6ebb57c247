//! Chapter 6.5: decisions mixed of several models.

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

/// mixed(w, m).
pub fn read<const N: usize>(
    code: &mut Code,
    weights: &mut [i64; N],
    models: [&mut Model; N],
) -> Result<bool> {
    let stretched: Vec<i64> = models.iter().map(|m| stretch(m.zero())).collect();
    let sum: i64 = weights.iter().zip(&stretched).map(|(weight, x)| weight * x).sum();
    let zero = squash(sum >> 16);
    let bit = code.decide(zero as u64)?;
    let error = if bit { 0 } else { 65536 } - zero;
    for (weight, x) in weights.iter_mut().zip(stretched) {
        *weight = (*weight + ((error * x + 8192) >> 14)).clamp(-262_143, 262_143);
    }
    models.into_iter().for_each(|m| m.learn(bit));
    Ok(bit)
}

#[test]
fn the_ends_of_the_curve() {
    assert_eq!([-9999, -2048, 0, 2047, 9999].map(squash), [32, 32, 32768, 65504, 65504]);
    assert_eq!([32, 1000, 16384, 32768, 49152, 65504].map(stretch), [-1901, -1074, -283, 1, 285, 2047]);
}

#[test]
fn the_example_of_the_chapter() {
    let mut models = [Model::known(squash(16 * 24)), Model::FRESH, Model::known(squash(16 * -11))];
    let mut weights = [20480, 22528, 36864];
    let mut code = Code::start(&[0x78]);
    let zeros = |models: &[Model; 3]| models.each_ref().map(Model::zero);
    let rows = [
        ([53581, 32768, 22074], [20480, 22528, 36864], false),
        ([55170, 54591, 27864], [21217, 22530, 36526], true),
        ([48683, 32767, 24589], [19973, 21340, 36750], true),
        ([43562, 23414, 22004], [19415, 21340, 37015], false),
    ];
    for (before, weighed, bit) in rows {
        assert_eq!((zeros(&models), weights), (before, weighed));
        let [x, y, z] = &mut models;
        assert_eq!(read(&mut code, &mut weights, [x, y, z]), Ok(bit));
    }
    assert_eq!((zeros(&models), weights), ([45651, 32767, 26147], [19837, 20982, 36595]));
    code.end().unwrap();
}
