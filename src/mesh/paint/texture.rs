//! Pictures on a surface: looked at between texels, at the size at which they are seen.

use glam::Vec2;

use super::Image;

/// A picture, and halves of it: each of the next level is the mean of up to four pixels, in linear light (Williams 1983).
pub(crate) struct Texture {
    levels: Vec<Level>,
}

struct Level {
    width: usize,
    height: usize,
    /// Linear light and opacity.
    texels: Vec<[u16; 4]>,
}

impl Texture {
    /// Of a picture; `None` where it has not as many pixels as it tells, or none.
    pub(crate) fn new(image: &Image, decode: &[f32; 256]) -> Option<Self> {
        let (width, height) = (image.width as usize, image.height as usize);
        if width == 0 || height == 0 || width.checked_mul(height) != Some(image.pixels.len()) {
            return None;
        }
        let whole = |x: f32| (x * WHOLE).round() as u16;
        let [light, plain] = [
            |x: u8, decode: &[f32; 256]| decode[usize::from(x)],
            |x: u8, _: &[f32; 256]| f32::from(x) / 255.0,
        ]
        .map(|of| std::array::from_fn::<u16, 256, _>(|x| whole(of(x as u8, decode))));
        let texel = |&[r, g, b, a]: &[u8; 4]| {
            let [r, g, b] = [r, g, b].map(|x| light[usize::from(x)]);
            [r, g, b, plain[usize::from(a)]]
        };
        let mut levels = vec![Level { width, height, texels: image.pixels.iter().map(texel).collect() }];
        while let Some(next) = levels.last().and_then(Level::half) {
            levels.push(next);
        }
        Some(Self { levels })
    }

    /// The level of which a texel is about a sample, where a triangle takes so many of the picture's areas and so many samples.
    pub(crate) fn level(&self, of_picture: f64, samples: f64) -> usize {
        let [first, ..] = &self.levels[..] else { return 0 };
        let texels = of_picture * (first.width * first.height) as f64;
        let level = 0.5 * (texels / samples).log2();
        // Nothing lies on it where this is not a number.
        (level.round().max(0.0) as usize).min(self.levels.len() - 1)
    }

    /// The light and the opacity at a place, each 0 to 1; the picture goes on beyond its sides.
    pub(crate) fn at(&self, level: usize, place: Vec2) -> [f32; 4] {
        let level = &self.levels[level.min(self.levels.len() - 1)];
        let along = |x: f32, count: usize| {
            // What is not finite, or so far away that no place is left between numbers, is as good as 0.
            let x = if x.is_finite() { x.rem_euclid(1.0) } else { 0.0 };
            let x = x * count as f32 + count as f32 - 0.5;
            ((x as usize) % count, (x as usize + 1) % count, x.fract())
        };
        let (x0, x1, s) = along(place.x, level.width);
        let (y0, y1, t) = along(place.y, level.height);
        let of = |x: usize, y: usize, k: usize| f32::from(level.texels[y * level.width + x][k]);
        std::array::from_fn(|k| {
            let [above, below] = [y0, y1].map(|y| of(x0, y, k) + s * (of(x1, y, k) - of(x0, y, k)));
            (above + t * (below - above)) / WHOLE
        })
    }
}

impl Level {
    fn half(&self) -> Option<Self> {
        if self.width.max(self.height) == 1 {
            return None;
        }
        let [width, height] = [self.width, self.height].map(|side| side.div_ceil(2));
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let [right, below] = [(2 * x + 1).min(self.width - 1), (2 * y + 1).min(self.height - 1)];
                let four = [(2 * x, 2 * y), (right, 2 * y), (2 * x, below), (right, below)];
                let of = |k: usize| four.map(|(x, y)| u32::from(self.texels[y * self.width + x][k]));
                texels.push(std::array::from_fn(|k| ((of(k).iter().sum::<u32>() + 2) / 4) as u16));
            }
        }
        Some(Self { width, height, texels })
    }
}

const WHOLE: f32 = 65_535.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, pixels: &[[u8; 4]]) -> Texture {
        let image = Image { width, height: pixels.len() as u32 / width, pixels: pixels.to_vec() };
        Texture::new(&image, &std::array::from_fn(|x| x as f32 / 255.0)).unwrap()
    }

    const BLACK: [u8; 4] = [0, 0, 0, 255];
    const RED: [u8; 4] = [255, 0, 0, 255];

    #[test]
    fn texels_are_mixed_and_the_picture_goes_on() {
        let texture = texture(2, &[BLACK, RED]);
        let red = |x: f32| (100.0 * texture.at(0, Vec2::new(x, 0.3))[0]).round();
        assert_eq!([0.25, 0.75, 0.5, 0.0, 1.0, 0.375].map(red), [0.0, 100.0, 50.0, 50.0, 50.0, 25.0]);
        assert_eq!([-0.75, 7.75, 1e30, f32::NAN].map(red)[..2], [0.0, 100.0]);
    }

    #[test]
    fn halves_are_means() {
        let texture = texture(3, &[RED, RED, BLACK, RED, RED, RED, BLACK, BLACK, BLACK]);
        // 3 by 3, 2 by 2, 1.
        assert_eq!(texture.levels.len(), 3);
        let of = |at: usize| f32::from(texture.levels[1].texels[at][0]) / WHOLE;
        assert_eq!([0, 1, 2, 3].map(of), [1.0, 0.5, 0.0, 0.0].map(|x| (x * WHOLE).round() / WHOLE));
        assert_eq!([4.0, 9.0, 36.0, 1e9, 0.0].map(|samples| texture.level(1.0, samples)), [1, 0, 0, 0, 2]);
        assert_eq!((texture.level(1e9, 1.0), texture.level(0.0, 0.0)), (2, 0));
    }

    #[test]
    fn a_picture_without_its_pixels_is_none() {
        let of = |width, height, count| {
            Texture::new(&Image { width, height, pixels: vec![RED; count] }, &[0.0; 256]).is_none()
        };
        assert!(of(0, 4, 0) && of(2, 2, 3) && of(u32::MAX, u32::MAX, 1) && !of(2, 2, 4));
    }
}
