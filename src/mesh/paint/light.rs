//! Colours in sRGB and in linear light (IEC 61966-2-1).

use glam::Vec3;

use super::srgb_to_linear;

/// From sRGB to linear light.
pub(crate) fn from_srgb(colour: [u8; 3]) -> Vec3 {
    Vec3::from(colour.map(|x| srgb_to_linear(f32::from(x) / 255.0)))
}

/// From linear light to sRGB.
pub(crate) fn to_srgb(colour: Vec3) -> [u8; 3] {
    let encode = |x: f32| if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    colour.to_array().map(|x| (encode(x.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_and_back() {
        for x in 0..=255 {
            assert_eq!(to_srgb(from_srgb([x, 255 - x, 7])), [x, 255 - x, 7]);
        }
        assert_eq!(from_srgb([0, 255, 0]), Vec3::Y);
        // 0.5 in sRGB is 0.214 in linear light.
        assert!((from_srgb([127, 128, 0]).truncate() - 0.214).abs().max_element() < 0.003);
    }
}
