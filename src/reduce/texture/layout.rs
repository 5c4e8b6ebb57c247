//! Where texture triangles lie in a map: halves of squares whose sides are powers of two.
//!
//! Each square has two of them, the hypotenuses in its middle, with room round both: along its sides a gutter, between the hypotenuses twice as
//! much. So squares fill a map without a gap, laid along a Z curve from the largest to the smallest, and no triangle's texels, nor those that
//! a look at it between texels mixes with them, are another's. Sides of a triangle have as many texels as their square without the gutters.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;

/// The places of all triangles of a mesh.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// Texels a row, and rows: powers of two, the first of them as large as the second, or twice as large.
    pub sides: [u32; 2],
    pub places: Vec<Place>,
    pub gutter: u32,
}

/// The place of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// The first texel of its square.
    pub square: [u32; 2],
    /// The binary logarithm of the square's side.
    pub log: u8,
    /// Whether its right angle is at the square's last texel, not at the first.
    pub is_upper: bool,
    /// Which of the triangle's corners has the right angle.
    pub right: u8,
}

impl Layout {
    /// For at most so many texels: as many for each triangle as its area is worth. `gutter` texels are left round each triangle.
    ///
    /// # Errors
    /// [`Error::Parameter`] where there are not enough texels.
    pub(super) fn new(mesh: &IndexedMesh, texels: u64, gutter: u32) -> Result<Self> {
        let count = mesh.triangles.len();
        let least = (1..LARGEST).find(|&log| edge_texels(log, gutter) >= 2).unwrap_or(LARGEST);
        let needed = (count.div_ceil(2) as u64).saturating_mul(area(least)).checked_next_power_of_two();
        let most = texels.checked_ilog2().unwrap_or(0).min(MOST);
        if needed.is_none_or(|needed| needed > 1 << most) {
            let wanted = needed.filter(|needed| *needed <= 1 << MOST);
            let what = match wanted {
                Some(needed) => format!("{needed} texels at least"),
                None => format!("more than the {} texels that there can be", 1u64 << MOST),
            };
            return Err(Error::Parameter(format!(
                "{texels} texels are too few: a map of {count} triangles takes {what}"
            )));
        }
        let logs = grown(mesh, least, most, 1 << most);
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_by_key(|&t| (Reverse(logs[t as usize]), t));
        let mut places = vec![Place { square: [0; 2], log: 0, is_upper: false, right: 0 }; count];
        let (mut next, mut open): (u64, Option<Place>) = (0, None);
        for t in order {
            let t = t as usize;
            let place = match open.take().filter(|open| open.log == logs[t]) {
                Some(lower) => Place { is_upper: true, ..lower },
                None => {
                    let square = [next, next >> 1].map(even_bits);
                    next += area(logs[t]);
                    let lower = Place { square, log: logs[t], is_upper: false, right: 0 };
                    open = Some(lower);
                    lower
                }
            };
            places[t] = Place { right: right(mesh, t), ..place };
        }
        let log = next.next_power_of_two().ilog2();
        Ok(Self { sides: [1 << log.div_ceil(2), 1 << (log / 2)], places, gutter })
    }

    /// How many texels lie along each side of a triangle: two at least.
    pub(super) fn edge_texels(&self, place: &Place) -> u32 {
        edge_texels(place.log, self.gutter)
    }

    /// The texel so many steps from the one with the right angle to the next corner and to the previous one: not more together than the sides
    /// have.
    pub(super) fn texel(&self, place: &Place, steps: [u32; 2]) -> [u32; 2] {
        let last = (1u32 << place.log) - 1;
        let in_square = steps.map(|s| if place.is_upper { last - self.gutter - s } else { self.gutter + s });
        [0, 1].map(|k| place.square[k] + in_square[k])
    }

    /// All texels of a triangle's half of its square, and the steps to the one of the triangle that is nearest to each.
    pub(super) fn half(&self, place: &Place) -> impl Iterator<Item = ([u32; 2], [u32; 2])> + '_ {
        let Place { square, log, is_upper, .. } = *place;
        let side = 1u32 << log;
        let most = i64::from(self.edge_texels(place)) - 1;
        let gutter = i64::from(self.gutter);
        let rows = u32::from(is_upper)..side;
        rows.flat_map(move |y| {
            let columns = if is_upper { side - y..side } else { 0..side - y };
            columns.map(move |x| {
                let steps = [x, y].map(|at| {
                    let at = if is_upper { side - 1 - at } else { at };
                    i64::from(at) - gutter
                });
                ([square[0] + x, square[1] + y], nearest(steps, most))
            })
        })
    }
}

/// The texel of a triangle of so many steps a side that is nearest to a texel beside it.
fn nearest(steps: [i64; 2], most: i64) -> [u32; 2] {
    let [u, v] = steps.map(|step| step.max(0));
    if u + v <= most {
        return [u as u32, v as u32];
    }
    // Straight to the hypotenuse, or along it to its end.
    let [u, v] = steps;
    let u = ((u - v + most).div_euclid(2)).clamp(0, most);
    [u as u32, (most - u) as u32]
}

/// Texels along the sides of a triangle in a square.
fn edge_texels(log: u8, gutter: u32) -> u32 {
    1u32.checked_shl(log.into()).unwrap_or(0).saturating_sub(gutter.saturating_mul(4).max(1))
}

/// Texels of a square.
fn area(log: u8) -> u64 {
    1 << (2 * log)
}

/// The binary logarithms of the squares' sides: one step after the other for the triangle whose texels stand for the largest areas, as long as
/// all fit into so many texels.
fn grown(mesh: &IndexedMesh, least: u8, most: u32, texels: u64) -> Vec<u8> {
    let mut logs = vec![least; mesh.triangles.len()];
    let mut counts = [0u64; 32];
    counts[usize::from(least)] = logs.len() as u64;
    let mut used = (logs.len() as u64).div_ceil(2) * area(least);
    // Numbers above 0 are in the order of their bits.
    let scale = mesh.diagonal().recip();
    let mut heap: BinaryHeap<(u64, Reverse<u32>)> = (0..logs.len() as u32)
        .filter_map(|t| {
            let [a, b, c] =
                mesh.triangles[t as usize].map(|v| DVec3::from(mesh.positions[v as usize]) * scale);
            let area = (b - a).cross(c - a).length();
            (area > 0.0 && area.is_finite()).then(|| (area.to_bits(), Reverse(t)))
        })
        .collect();
    while let Some((bits, Reverse(t))) = heap.pop() {
        let log = logs[t as usize];
        let of = |counts: &[u64; 32], log: u8| counts[usize::from(log)].div_ceil(2) * area(log);
        let before = of(&counts, log) + of(&counts, log + 1);
        counts[usize::from(log)] -= 1;
        counts[usize::from(log) + 1] += 1;
        let after = used - before + of(&counts, log) + of(&counts, log + 1);
        if after > texels || u32::from(log) + 1 > most / 2 {
            counts[usize::from(log)] += 1;
            counts[usize::from(log) + 1] -= 1;
            continue;
        }
        used = after;
        logs[t as usize] = log + 1;
        heap.push(((f64::from_bits(bits) / 4.0).to_bits(), Reverse(t)));
    }
    logs
}

/// The corner opposite to the longest side.
fn right(mesh: &IndexedMesh, t: usize) -> u8 {
    let p = mesh.triangles[t].map(|v| DVec3::from(mesh.positions[v as usize]));
    let opposite = |k: usize| p[(k + 1) % 3].distance_squared(p[(k + 2) % 3]);
    (0..3u8).fold(0, |best, k| if opposite(k.into()) > opposite(best.into()) { k } else { best })
}

/// Every second bit of a number, from the lowest on (Morton 1966).
fn even_bits(x: u64) -> u32 {
    let mut x = x & 0x5555_5555_5555_5555;
    for (shift, mask) in [
        (1, 0x3333_3333_3333_3333),
        (2, 0x0f0f_0f0f_0f0f_0f0f),
        (4, 0x00ff_00ff_00ff_00ff),
        (8, 0x0000_ffff_0000_ffff),
        (16, 0x0000_0000_ffff_ffff),
    ] {
        x = (x | x >> shift) & mask;
    }
    x as u32
}

/// More than the binary logarithm of the side of any square.
const LARGEST: u8 = 31;
/// The binary logarithm of the most texels of a map: 32,768 a side.
const MOST: u32 = 30;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use proptest::prelude::*;

    prop_compose! {
        /// Triangles of all sizes and shapes, degenerate ones too.
        fn meshes()(
            places in prop::collection::vec((0u32..7, -8i32..8, -8i32..8, -8i32..8), 3..20),
            corners in prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..40),
        ) -> IndexedMesh {
            let positions: Vec<[f64; 3]> =
                places.iter().map(|&(log, x, y, z)| [x, y, z].map(|x| f64::from(x) * f64::from(1 << log))).collect();
            let count = positions.len();
            IndexedMesh::new(positions, corners.iter().map(|t| t.map(|v| v.index(count) as u32)).collect())
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// By painting: each texel of a triangle is its own, with all round it as far as the gutter goes.
        #[test]
        fn no_texel_is_in_two_triangles(mesh in meshes(), gutter in 0u32..4, log in 13u32..15) {
            let layout = Layout::new(&mesh, 1 << log, gutter).unwrap();
            let [width, height] = layout.sides.map(|side| side as usize);
            prop_assert!(width * height <= 1 << log && (width == height || width == 2 * height));
            let mut owners = vec![None; width * height];
            for (t, place) in layout.places.iter().enumerate() {
                for ([x, y], _) in layout.half(place) {
                    let owner = &mut owners[y as usize * width + x as usize];
                    prop_assert_eq!(owner.replace(t), None);
                }
            }
            for (t, place) in layout.places.iter().enumerate() {
                let count = layout.edge_texels(place);
                prop_assert!(count >= 2);
                for (j, i) in (0..count).flat_map(|j| (0..count - j).map(move |i| (j, i))) {
                    let at = layout.texel(place, [i, j]);
                    for (dx, dy) in (0..=2 * gutter).flat_map(|dx| (0..=2 * gutter).map(move |dy| (dx, dy))) {
                        let [x, y] = [at[0] + dx - gutter, at[1] + dy - gutter].map(|at| at as usize);
                        // The gutter's far corners at the hypotenuse are not looked at.
                        let beyond = if place.is_upper { 4 * gutter - dx - dy } else { dx + dy };
                        if beyond < 4 * gutter.max(1) {
                            prop_assert_eq!(owners[y * width + x], Some(t));
                        }
                    }
                }
            }
        }

        /// By looking at all of them.
        #[test]
        fn the_gutter_has_the_nearest_texel(u in -9i64..20, v in -9i64..20, most in 1i64..12) {
            let found = nearest([u, v], most).map(i64::from);
            let off = |[i, j]: [i64; 2]| (i - u).pow(2) + (j - v).pow(2);
            let all = (0..=most).flat_map(|j| (0..=most - j).map(move |i| [i, j]));
            prop_assert!(found[0] + found[1] <= most && found.iter().all(|&i| i >= 0));
            prop_assert_eq!(off(found), all.map(off).min().unwrap());
        }
    }

    #[test]
    fn larger_triangles_have_more_texels_and_too_few_are_refused() {
        let mesh = shapes::sphere(3);
        let count = mesh.triangles.len() as u64;
        // Two triangles a square of 8 x 8; the number is to be a power of two.
        let least = (count / 2 * 64).next_power_of_two();
        let [width, height] = Layout::new(&mesh, least, 1).unwrap().sides.map(u64::from);
        assert_eq!(width * height, least);
        let error = Layout::new(&mesh, least - 1, 1).unwrap_err().to_string();
        let told = format!(
            "{} texels are too few: a map of {count} triangles takes {least} texels at least",
            least - 1
        );
        assert!(error.contains(&told), "{error}");
        let error = Layout::new(&mesh, u64::MAX, 1 << 20).unwrap_err().to_string();
        assert!(error.contains("more than the 1073741824 texels that there can be"), "{error}");
        let tall = IndexedMesh::new(
            vec![[0.0; 3], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
            vec![[0, 4, 3], [1, 2, 0], [0, 0, 1]],
        );
        let layout = Layout::new(&tall, 1 << 14, 1).unwrap();
        let logs: Vec<u8> = layout.places.iter().map(|place| place.log).collect();
        assert!(logs[1] == 6 && logs[0] > 3 && logs[2] == 3, "{logs:?}");
        assert_eq!((layout.places[1].right, layout.edge_texels(&layout.places[1])), (2, 60));
    }
}
