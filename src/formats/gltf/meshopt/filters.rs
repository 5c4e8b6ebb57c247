//! What vertices are turned back from, in binary32 as the specification of the extension has it.

/// Directions on an octahedron, in 8 bits; the fourth byte stays.
pub(super) fn octahedral_8(bytes: &mut [u8]) {
    for [x, y, z, _] in bytes.as_chunks_mut::<4>().0 {
        let [a, b, c] = octahedral([*x, *y, *z].map(|byte| f32::from(byte as i8)), 127.0);
        [*x, *y, *z] = [a, b, c].map(|number| number as i8 as u8);
    }
}

/// The same in 16 bits.
pub(super) fn octahedral_16(bytes: &mut [u8]) {
    each_16(bytes, |[x, y, z, w]| {
        let [a, b, c] = octahedral([x, y, z].map(|number| f32::from(number as i16)), 32_767.0);
        [a as u16, b as u16, c as u16, w]
    });
}

fn octahedral([x, y, one]: [f32; 3], most: f32) -> [i32; 3] {
    let z = one - x.abs() - y.abs();
    let below = z.min(0.0);
    let fold = |x: f32| if x >= 0.0 { x + below } else { x - below };
    let (x, y) = (fold(x), fold(y));
    let scale = most / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|x| rounded(x * scale))
}

/// Unit quaternions by their three smaller numbers; the lowest bits of the fourth place tell which was left out.
pub(super) fn quaternion(bytes: &mut [u8]) {
    each_16(bytes, |numbers| {
        let [x, y, z, told] = numbers.map(|number| number as i16);
        let [x, y, z] = [x, y, z].map(f32::from);
        let one = f32::from(told | 3);
        let w = (one * one * 2.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let scale = 32_767.0 / std::f32::consts::SQRT_2 / one;
        let mut turned = [w, x, y, z].map(|x| rounded(x * scale) as u16);
        turned.rotate_right(usize::from(told as u16 & 3));
        turned
    });
}

/// Floating-point numbers of an exponent and 24 bits.
pub(super) fn exponential(bytes: &mut [u8]) {
    for word in bytes.as_chunks_mut::<4>().0 {
        let number = i32::from_le_bytes(*word);
        let (mantissa, exponent) = (number << 8 >> 8, number >> 24);
        let power = f32::from_bits(((exponent + 127) as u32) << 23);
        *word = (power * mantissa as f32).to_le_bytes();
    }
}

/// Colours by luma and two differences, in 8 bits.
pub(super) fn color_8(bytes: &mut [u8]) {
    for word in bytes.as_chunks_mut::<4>().0 {
        let [y, co, cg, a] = *word;
        let [co, cg] = [co, cg].map(|number| i32::from(number as i8));
        *word = color([y.into(), co, cg, a.into()], 255.0).map(|number| number as u8);
    }
}

/// The same in 16 bits.
pub(super) fn color_16(bytes: &mut [u8]) {
    each_16(bytes, |[y, co, cg, a]| {
        let [co, cg] = [co, cg].map(|number| i32::from(number as i16));
        color([y.into(), co, cg, a.into()], 65_535.0).map(|number| number as u16)
    });
}

fn color([y, co, cg, a]: [i32; 4], most: f32) -> [i32; 4] {
    // All bits below the highest one of alpha, which tells how many there are.
    let mut ones = a;
    [1, 2, 4, 8].into_iter().for_each(|shift| ones |= ones >> shift);
    let alpha = (a << 1 & ones) | (a & 1);
    let scale = most / ones as f32;
    [y + co - cg, y + cg, y - co - cg, alpha].map(|x| (x as f32 * scale + 0.5) as i32)
}

/// To the nearest, halves away from zero; what is no number is 0.
fn rounded(x: f32) -> i32 {
    (x + if x >= 0.0 { 0.5 } else { -0.5 }) as i32
}

fn each_16(bytes: &mut [u8], turn: impl Fn([u16; 4]) -> [u16; 4]) {
    for bytes in bytes.as_chunks_mut::<8>().0 {
        let number = |k: usize| u16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]);
        let turned = turn([0, 1, 2, 3].map(number)).map(u16::to_le_bytes);
        bytes.copy_from_slice(turned.as_flattened());
    }
}
