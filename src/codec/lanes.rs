//! Four numbers in binary32 to a register, of x86-64, of WebAssembly, or of neither (spec §9.2).
//!
//! Every operation is rounded once: the results are the same bit for bit.

#[cfg(not(any(target_arch = "x86_64", target_feature = "simd128")))]
pub use portable::*;
#[cfg(target_feature = "simd128")]
pub use wasm::*;
#[cfg(target_arch = "x86_64")]
pub use x86::*;

/// Registers. What compilers make of arrays of four numbers is mostly four times as many instructions.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use safe_arch::*;

    pub type Lanes = m128;

    #[inline(always)]
    pub fn of_floats([a, b, c, d]: [f32; 4]) -> Lanes {
        set_reversed_m128(a, b, c, d)
    }

    #[inline(always)]
    pub fn of_integers([a, b, c, d]: [i32; 4]) -> Lanes {
        convert_to_m128_from_i32_m128i(set_i32_m128i(d, c, b, a))
    }

    #[inline(always)]
    pub fn floats(v: Lanes) -> [f32; 4] {
        v.to_array()
    }

    #[inline(always)]
    pub fn add(a: Lanes, b: Lanes) -> Lanes {
        add_m128(a, b)
    }

    #[inline(always)]
    pub fn sub(a: Lanes, b: Lanes) -> Lanes {
        sub_m128(a, b)
    }

    #[inline(always)]
    pub fn mul(a: Lanes, b: Lanes) -> Lanes {
        mul_m128(a, b)
    }

    #[inline(always)]
    pub fn div(a: Lanes, b: Lanes) -> Lanes {
        div_m128(a, b)
    }

    #[inline(always)]
    pub fn sqrt(a: Lanes) -> Lanes {
        sqrt_m128(a)
    }

    #[inline(always)]
    pub fn abs(a: Lanes) -> Lanes {
        bitand_m128(a, set_splat_m128(f32::from_bits(0x7FFF_FFFF)))
    }

    /// The larger one, where both are numbers.
    #[inline(always)]
    pub fn max(a: Lanes, b: Lanes) -> Lanes {
        max_m128(a, b)
    }

    /// The smaller one, where both are numbers.
    #[inline(always)]
    pub fn min(a: Lanes, b: Lanes) -> Lanes {
        min_m128(a, b)
    }

    /// x where a < b, else y.
    #[inline(always)]
    pub fn where_less(a: Lanes, b: Lanes, x: Lanes, y: Lanes) -> Lanes {
        let is_less = cmp_lt_mask_m128(a, b);
        bitor_m128(bitand_m128(is_less, x), bitandnot_m128(is_less, y))
    }

    /// [`truncate`] of each.
    #[inline(always)]
    pub fn truncated(a: Lanes) -> [i32; 4] {
        truncate_m128_to_m128i(a).into()
    }

    /// Lanes y, z, x and the fourth.
    #[inline(always)]
    pub fn turned(v: Lanes) -> Lanes {
        shuffle_abi_f32_all_m128::<0b11_00_10_01>(v, v)
    }

    /// The first, second and third lanes of four.
    #[inline(always)]
    pub fn transposed([mut a, mut b, mut c, mut d]: [Lanes; 4]) -> [Lanes; 3] {
        transpose_four_m128(&mut a, &mut b, &mut c, &mut d);
        [a, b, c]
    }

    /// The integer next to x towards zero, where it is a 31-bit number; else any.
    #[inline(always)]
    pub fn truncate(x: f32) -> i32 {
        get_i32_from_m128i_s(truncate_m128_to_m128i(set_m128_s(x)))
    }

    /// The integer next to x towards zero, where it is a 63-bit number; else any.
    #[inline(always)]
    pub fn truncate_long(x: f32) -> i64 {
        truncate_to_i64_m128d_s(set_m128d_s(f64::from(x)))
    }
}

/// Registers of WebAssembly, where they are switched on.
#[cfg(target_feature = "simd128")]
mod wasm {
    use std::arch::wasm32::*;

    pub type Lanes = v128;

    #[inline(always)]
    pub fn of_floats([a, b, c, d]: [f32; 4]) -> Lanes {
        f32x4(a, b, c, d)
    }

    #[inline(always)]
    pub fn of_integers([a, b, c, d]: [i32; 4]) -> Lanes {
        f32x4_convert_i32x4(i32x4(a, b, c, d))
    }

    #[inline(always)]
    pub fn floats(v: Lanes) -> [f32; 4] {
        [
            f32x4_extract_lane::<0>(v),
            f32x4_extract_lane::<1>(v),
            f32x4_extract_lane::<2>(v),
            f32x4_extract_lane::<3>(v),
        ]
    }

    #[inline(always)]
    pub fn add(a: Lanes, b: Lanes) -> Lanes {
        f32x4_add(a, b)
    }

    #[inline(always)]
    pub fn sub(a: Lanes, b: Lanes) -> Lanes {
        f32x4_sub(a, b)
    }

    #[inline(always)]
    pub fn mul(a: Lanes, b: Lanes) -> Lanes {
        f32x4_mul(a, b)
    }

    #[inline(always)]
    pub fn div(a: Lanes, b: Lanes) -> Lanes {
        f32x4_div(a, b)
    }

    #[inline(always)]
    pub fn sqrt(a: Lanes) -> Lanes {
        f32x4_sqrt(a)
    }

    #[inline(always)]
    pub fn abs(a: Lanes) -> Lanes {
        f32x4_abs(a)
    }

    #[inline(always)]
    pub fn max(a: Lanes, b: Lanes) -> Lanes {
        f32x4_pmax(a, b)
    }

    #[inline(always)]
    pub fn min(a: Lanes, b: Lanes) -> Lanes {
        f32x4_pmin(a, b)
    }

    #[inline(always)]
    pub fn where_less(a: Lanes, b: Lanes, x: Lanes, y: Lanes) -> Lanes {
        v128_bitselect(x, y, f32x4_lt(a, b))
    }

    #[inline(always)]
    pub fn truncated(a: Lanes) -> [i32; 4] {
        let a = i32x4_trunc_sat_f32x4(a);
        [
            i32x4_extract_lane::<0>(a),
            i32x4_extract_lane::<1>(a),
            i32x4_extract_lane::<2>(a),
            i32x4_extract_lane::<3>(a),
        ]
    }

    #[inline(always)]
    pub fn turned(v: Lanes) -> Lanes {
        i32x4_shuffle::<1, 2, 0, 3>(v, v)
    }

    #[inline(always)]
    pub fn transposed([a, b, c, d]: [Lanes; 4]) -> [Lanes; 3] {
        let [ab, cd] = [i32x4_shuffle::<0, 4, 1, 5>(a, b), i32x4_shuffle::<0, 4, 1, 5>(c, d)];
        let [ab_z, cd_z] = [i32x4_shuffle::<2, 6, 3, 7>(a, b), i32x4_shuffle::<2, 6, 3, 7>(c, d)];
        [
            i32x4_shuffle::<0, 1, 4, 5>(ab, cd),
            i32x4_shuffle::<2, 3, 6, 7>(ab, cd),
            i32x4_shuffle::<0, 1, 4, 5>(ab_z, cd_z),
        ]
    }

    #[inline(always)]
    pub fn truncate(x: f32) -> i32 {
        x as i32
    }

    #[inline(always)]
    pub fn truncate_long(x: f32) -> i64 {
        x as i64
    }
}

/// Arrays.
#[cfg(any(test, not(any(target_arch = "x86_64", target_feature = "simd128"))))]
mod portable {
    use std::array::from_fn;

    #[derive(Clone, Copy, Debug)]
    #[repr(align(16))]
    pub struct Lanes(pub [f32; 4]);

    #[inline(always)]
    pub fn of_floats(lanes: [f32; 4]) -> Lanes {
        Lanes(lanes)
    }

    #[inline(always)]
    pub fn of_integers(lanes: [i32; 4]) -> Lanes {
        Lanes(lanes.map(|x| x as f32))
    }

    #[inline(always)]
    pub fn floats(v: Lanes) -> [f32; 4] {
        v.0
    }

    #[inline(always)]
    pub fn add(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| a.0[i] + b.0[i]))
    }

    #[inline(always)]
    pub fn sub(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| a.0[i] - b.0[i]))
    }

    #[inline(always)]
    pub fn mul(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| a.0[i] * b.0[i]))
    }

    #[inline(always)]
    pub fn div(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| a.0[i] / b.0[i]))
    }

    #[inline(always)]
    pub fn sqrt(a: Lanes) -> Lanes {
        Lanes(a.0.map(f32::sqrt))
    }

    #[inline(always)]
    pub fn abs(a: Lanes) -> Lanes {
        Lanes(a.0.map(f32::abs))
    }

    #[inline(always)]
    pub fn max(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| if a.0[i] > b.0[i] { a.0[i] } else { b.0[i] }))
    }

    #[inline(always)]
    pub fn min(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| if a.0[i] < b.0[i] { a.0[i] } else { b.0[i] }))
    }

    #[inline(always)]
    pub fn where_less(a: Lanes, b: Lanes, x: Lanes, y: Lanes) -> Lanes {
        Lanes(from_fn(|i| if a.0[i] < b.0[i] { x.0[i] } else { y.0[i] }))
    }

    #[inline(always)]
    pub fn truncated(a: Lanes) -> [i32; 4] {
        a.0.map(|x| x as i32)
    }

    #[inline(always)]
    pub fn turned(v: Lanes) -> Lanes {
        let [x, y, z, w] = v.0;
        Lanes([y, z, x, w])
    }

    #[inline(always)]
    pub fn transposed(v: [Lanes; 4]) -> [Lanes; 3] {
        from_fn(|i| Lanes(v.map(|v| v.0[i])))
    }

    #[inline(always)]
    pub fn truncate(x: f32) -> i32 {
        x as i32
    }

    #[inline(always)]
    pub fn truncate_long(x: f32) -> i64 {
        x as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bits<const N: usize>(lanes: [f32; N]) -> [u32; N] {
        lanes.map(f32::to_bits)
    }

    fn same(a: Lanes, b: portable::Lanes) -> bool {
        bits(floats(a)) == bits(portable::floats(b))
    }

    proptest! {
        /// Whatever the machine has does what arrays do.
        #[test]
        fn registers_and_arrays_agree(cells in prop::array::uniform4(prop::array::uniform4(-(1i32 << 24)..1 << 24)), s in -1e9f32..1e9) {
            let a = cells.map(of_integers);
            let b = cells.map(portable::of_integers);
            prop_assert!(same(a[0], b[0]));
            prop_assert!(same(add(a[0], of_floats([s; 4])), portable::add(b[0], portable::of_floats([s; 4]))));
            prop_assert!(same(sub(a[1], a[2]), portable::sub(b[1], b[2])));
            prop_assert!(same(mul(a[1], a[2]), portable::mul(b[1], b[2])));
            prop_assert!(same(div(a[1], of_floats([s; 4])), portable::div(b[1], portable::of_floats([s; 4]))));
            prop_assert!(same(sqrt(abs(a[2])), portable::sqrt(portable::abs(b[2]))));
            prop_assert!(same(max(a[2], a[3]), portable::max(b[2], b[3])));
            prop_assert!(same(min(a[2], a[3]), portable::min(b[2], b[3])));
            prop_assert!(same(where_less(a[0], a[1], a[2], a[3]), portable::where_less(b[0], b[1], b[2], b[3])));
            prop_assert!(same(turned(a[3]), portable::turned(b[3])));
            for (x, y) in transposed(a).into_iter().zip(portable::transposed(b)) {
                prop_assert!(same(x, y));
            }
            prop_assert_eq!(truncated(div(a[1], of_floats([3.0; 4]))), portable::truncated(portable::div(b[1], portable::of_floats([3.0; 4]))));
            prop_assert_eq!(truncate(s), portable::truncate(s));
            prop_assert_eq!(truncate_long(s * s), portable::truncate_long(s * s));
        }
    }
}
