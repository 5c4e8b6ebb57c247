//! Chapters 13.1 and 13.2: the integers and the numbers of values.

use super::attribute::Attribute;

/// Of a corner, for each attribute: the bits of its numbers, where it has a value.
pub type Numbers = Vec<Option<Vec<u64>>>;

/// The integers of a value; none where there is none.
pub type Value = Option<Vec<i32>>;

/// §13.1.
pub fn integers(about: &Attribute) -> usize {
    match about.quantisation {
        2 => about.components - 1,
        3 if about.stored == 7 => 2 * about.components,
        _ => about.components,
    }
}

/// §13.2: the radius of octahedral coordinates.
pub fn radius(about: &Attribute) -> i64 {
    (1 << (about.bits - 1)) - 1
}

/// §13.2: unfold.
pub fn unfold(u: i64, v: i64, r: i64) -> [f64; 3] {
    let sign = |x: i64| if x < 0 { -1 } else { 1 };
    let (u, v) = (u.clamp(-r, r), v.clamp(-r, r));
    let w = r - u.abs() - v.abs();
    let (u, v) = if w < 0 { (sign(u) * (r - v.abs()), sign(v) * (r - u.abs())) } else { (u, v) };
    [u, v, w].map(|x| x as f64)
}

/// §13.2: the direction of octahedral coordinates.
pub fn direction(u: i64, v: i64, r: i64) -> [f64; 3] {
    let [x, y, z] = unfold(u, v, r);
    let length = ((x * x + y * y) + z * z).sqrt();
    [x / length, y / length, z / length]
}

/// §13.2: the bits of the number that raw integers are.
pub fn raw32(q: i32) -> u32 {
    if q < 0 { q as u32 ^ 0x7FFF_FFFF } else { q as u32 }
}

pub fn raw64([high, low]: [i32; 2]) -> u64 {
    let q = u64::from(high as u32) << 32 | u64::from(low as u32);
    if high < 0 { q ^ (u64::MAX >> 1) } else { q }
}

/// §13.2: the bits of the numbers of a value.
pub fn numbers(about: &Attribute, q: &[i32]) -> Vec<u64> {
    let real = |x: f64| if about.stored == 6 { u64::from((x as f32).to_bits()) } else { x.to_bits() };
    let low = [0xFF, 0xFFFF, u32::MAX];
    match about.quantisation {
        0 => q.iter().map(|&q| u64::from(q as u32 & low[usize::from(about.stored) / 2])).collect(),
        1 => (0..q.len()).map(|k| real(about.origin[k] + about.step * f64::from(q[k]))).collect(),
        2 => {
            let mut all = direction(q[0].into(), q[1].into(), radius(about)).to_vec();
            if let Some(&side) = q.get(2) {
                all.push(if side > 0 { -1.0 } else { 1.0 });
            }
            all.into_iter().map(real).collect()
        }
        _ if about.stored == 7 => q.chunks(2).map(|q| raw64([q[0], q[1]])).collect(),
        _ => q.iter().map(|&q| raw32(q).into()).collect(),
    }
}

pub fn minus(x: [f64; 3], y: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| x[k] - y[k])
}

/// §9.2, in binary64.
pub fn dot(x: [f64; 3], y: [f64; 3]) -> f64 {
    (x[0] * y[0] + x[1] * y[1]) + x[2] * y[2]
}

pub fn cross([x0, x1, x2]: [f64; 3], [y0, y1, y2]: [f64; 3]) -> [f64; 3] {
    [x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0]
}
