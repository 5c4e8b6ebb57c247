//! Noise that depends on its place and seed alone: white, smooth, and in octaves.

/// A number from -1 to 1 for a place and a purpose (the finalizer of SplitMix64: Steele, Lea, Flood 2014).
pub fn unit(seed: u64, i: u32, j: u32, purpose: u64) -> f64 {
    let mut z = (u64::from(i) << 32 | u64::from(j))
        .wrapping_add(seed.wrapping_mul(8).wrapping_add(purpose).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Three numbers from -1 to 1 for a vertex.
pub fn shift(seed: u64, vertex: usize) -> [f64; 3] {
    [0, 1, 2].map(|axis| unit(seed, vertex as u32, 0, axis))
}

/// Noise from -1 to 1, smooth between the points of the integer lattice; places may be negative.
pub fn plane(x: f64, y: f64, seed: u64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    // To i64 first: a negative number saturates at 0 where it is cast to u32.
    let at = |di: f64, dj: f64| unit(seed, (i + di) as i64 as u32, (j + dj) as i64 as u32, 4);
    let (s, t) = (fade(x - i), fade(y - j));
    mix(mix(at(0.0, 0.0), at(1.0, 0.0), s), mix(at(0.0, 1.0), at(1.0, 1.0), s), t)
}

/// The same in space: planes of noise, one a layer.
pub fn space([x, y, z]: [f64; 3], seed: u64) -> f64 {
    let k = z.floor();
    let layer = |dk: f64| plane(x, y, seed.wrapping_add(((k + dk) as i64 as u64).wrapping_mul(0x5851_f42d)));
    mix(layer(0.0), layer(1.0), fade(z - k))
}

/// Octaves of noise in space, each of twice the frequency and half the height; from -2 to 2.
pub fn octaves(place: [f64; 3], count: u32, seed: u64) -> f64 {
    let octave = |k: u32| {
        let frequency = f64::from(1u32 << k);
        space(place.map(|x| x * frequency), seed.wrapping_add(7 * u64::from(k))) / frequency
    };
    (0..count).map(octave).sum()
}

/// Ridges over the unit square: octaves of noise, bent upwards where it changes its sign.
pub fn ridges(x: f64, y: f64, seed: u64) -> f64 {
    let octave = |k: i32| {
        let (frequency, weight) = (4.0 * 2f64.powi(k), 0.12 * 0.5f64.powi(k));
        weight * (1.0 - plane(x * frequency, y * frequency, seed + 7 * k as u64).abs())
    };
    (0..6).map(octave).sum()
}

fn fade(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_and_of_both_signs() {
        let values: Vec<f64> =
            (0..2000).map(|k| octaves([f64::from(k) * 0.01 - 3.0, 0.3, 0.7], 1, 5)).collect();
        assert!(values.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 0.05));
        assert!(values.iter().any(|&x| x > 0.2) && values.iter().any(|&x| x < -0.2));
        assert_ne!(octaves([0.5; 3], 4, 1), octaves([0.5; 3], 4, 2));
    }
}
