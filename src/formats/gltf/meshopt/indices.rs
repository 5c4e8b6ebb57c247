//! Indices: triangles by edges and vertices met lately, or lists by their differences.

use super::take;

/// Unpacks `count` indices of triangles; nothing where the data are damaged or end early.
pub(super) fn triangles(packed: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut rest = packed;
    // Vertices met up to so many steps ago are named in half a byte; beyond that are neighbours of the last one named otherwise.
    let met = match take(&mut rest, 1)?.first()? {
        0xe0 => 15,
        0xe1 => 13,
        _ => return None,
    };
    let codes = take(&mut rest, count / 3)?;
    let (mut rest, table) = rest.split_at_checked(rest.len().checked_sub(TABLE)?)?;
    let mut edges = Ring([[u32::MAX; 2]; 16], 0);
    let mut vertices = Ring([u32::MAX; 16], 0);
    let (mut next, mut last) = (0u32, 0u32);
    let fresh = |next: &mut u32| {
        *next = next.wrapping_add(1);
        next.wrapping_sub(1)
    };
    let mut indices = Vec::with_capacity(count);
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            let [a, b] = edges.ago(high + 1);
            let c = match low {
                0 => fresh(&mut next),
                _ if low < met => vertices.ago(low + 1),
                13 | 14 => {
                    last = if low == 13 { last.wrapping_sub(1) } else { last.wrapping_add(1) };
                    last
                }
                _ => {
                    last = difference(&mut rest, last)?;
                    last
                }
            };
            if low == 0 || low >= met {
                vertices.push(c);
            }
            edges.push([c, b]);
            edges.push([a, c]);
            indices.extend([a, b, c]);
            continue;
        }
        let from_table = low < 14;
        let further = if from_table { table[usize::from(low)] } else { *take(&mut rest, 1)?.first()? };
        let (second, third) = (further >> 4, further & 15);
        if !from_table && further == 0 {
            next = 0;
        }
        let mut a = if low == 15 { 0 } else { fresh(&mut next) };
        let mut b = if second == 0 { fresh(&mut next) } else { vertices.ago(second) };
        let mut c = if third == 0 { fresh(&mut next) } else { vertices.ago(third) };
        if !from_table {
            for (vertex, is_told) in [(&mut a, low == 15), (&mut b, second == 15), (&mut c, third == 15)] {
                if is_told {
                    last = difference(&mut rest, last)?;
                    *vertex = last;
                }
            }
        }
        vertices.push(a);
        for (vertex, half) in [(b, second), (c, third)] {
            if half == 0 || half == 15 && !from_table {
                vertices.push(vertex);
            }
        }
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
        indices.extend([a, b, c]);
    }
    rest.is_empty().then_some(indices)
}

/// Packs indices of triangles, three each; some are turned round, with another corner first.
pub(super) fn pack(indices: &[u32]) -> Vec<u8> {
    let (mut codes, mut data) = (vec![0xe1], Vec::new());
    let mut edges = Ring([[u32::MAX; 2]; 16], 0);
    let mut vertices = Ring([u32::MAX; 16], 0);
    let (mut next, mut last) = (0u32, 0u32);
    let tell = |vertex: u32, last: &mut u32, data: &mut Vec<u8>| {
        let by = vertex.wrapping_sub(std::mem::replace(last, vertex));
        put((by << 1) ^ (by >> 31).wrapping_neg(), data);
    };
    for &[a, b, c] in indices.as_chunks::<3>().0 {
        let turns = [[a, b, c], [b, c, a], [c, a, b]];
        let known = turns.iter().filter_map(|turn| Some((edges.find([turn[0], turn[1]], 1..16)?, turn)));
        if let Some((ago, &[a, b, c])) = known.min() {
            let low = match vertices.find(c, 2..14) {
                _ if c == next => 0,
                Some(ago) => ago - 1,
                None if c == last.wrapping_sub(1) => 13,
                None if c == last.wrapping_add(1) => 14,
                None => 15,
            };
            codes.push((ago - 1) << 4 | low);
            match low {
                0 => next = next.wrapping_add(1),
                13 | 14 => last = c,
                15 => tell(c, &mut last, &mut data),
                _ => {}
            }
            if low == 0 || low >= 13 {
                vertices.push(c);
            }
            edges.push([c, b]);
            edges.push([a, c]);
            continue;
        }
        // Where one is new it is the first: two new ones behind one that is not would mean something else.
        let [a, b, c] = turns.into_iter().find(|turn| turn[0] == next).unwrap_or(turns[0]);
        let mut half = |vertex: u32| {
            if vertex == next {
                next = next.wrapping_add(1);
                return 0;
            }
            vertices.find(vertex, 1..15).unwrap_or(15)
        };
        let is_fresh = half(a) == 0;
        let (second, third) = (half(b), half(c));
        let further = second << 4 | third;
        match TABLE_OF_PAIRS.iter().take(14).position(|&pair| pair == further).filter(|_| is_fresh) {
            Some(at) => codes.push(0xf0 | at as u8),
            None => {
                codes.push(if is_fresh { 0xfe } else { 0xff });
                data.push(further);
            }
        }
        for (vertex, is_told) in [(a, !is_fresh), (b, second == 15), (c, third == 15)] {
            if is_told {
                tell(vertex, &mut last, &mut data);
            }
        }
        vertices.push(a);
        for (vertex, half) in [(b, second), (c, third)] {
            if half == 0 || half == 15 {
                vertices.push(vertex);
            }
        }
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
    }
    codes.extend(data);
    codes.extend(TABLE_OF_PAIRS);
    codes
}

/// Unpacks `count` indices of a list; nothing where the data are damaged or end early.
pub(super) fn sequence(packed: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut rest = packed;
    if !matches!(take(&mut rest, 1)?.first()?, 0xd0 | 0xd1) {
        return None;
    }
    let mut rest = rest.split_at_checked(rest.len().checked_sub(TAIL)?)?.0;
    let mut last = [0u32; 2];
    let mut indices = Vec::new();
    for _ in 0..count {
        let number = number(&mut rest)?;
        let last = &mut last[number as usize & 1];
        *last = last.wrapping_add(unzigzag(number >> 1));
        indices.push(*last);
    }
    rest.is_empty().then_some(indices)
}

/// The last 16 of some things.
struct Ring<T>([T; 16], u8);

impl<T: Copy> Ring<T> {
    fn push(&mut self, item: T) {
        self.0[usize::from(self.1 & 15)] = item;
        self.1 = self.1.wrapping_add(1);
    }

    /// The one that came so many pushes ago, the last one being 1.
    fn ago(&self, pushes: u8) -> T {
        self.0[usize::from(self.1.wrapping_sub(pushes) & 15)]
    }

    /// How many pushes ago one came, among some of the numbers of them.
    fn find(&self, item: T, mut pushes: std::ops::Range<u8>) -> Option<u8>
    where
        T: PartialEq,
    {
        pushes.find(|&pushes| self.ago(pushes) == item)
    }
}

fn difference(rest: &mut &[u8], last: u32) -> Option<u32> {
    number(rest).map(|number| last.wrapping_add(unzigzag(number)))
}

fn unzigzag(number: u32) -> u32 {
    (number & 1).wrapping_neg() ^ (number >> 1)
}

/// A number in bytes of seven bits, the lowest first, up to five.
fn number(rest: &mut &[u8]) -> Option<u32> {
    let mut number = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = *take(rest, 1)?.first()?;
        number |= u32::from(byte & 127) << shift;
        if byte < 128 {
            break;
        }
    }
    Some(number)
}

/// The inverse of [`number`].
fn put(mut number: u32, data: &mut Vec<u8>) {
    while number > 127 {
        data.push(number as u8 | 128);
        number >>= 7;
    }
    data.push(number as u8);
}

/// How second and third vertices come that follow a new one, where that is half a byte; the last two are not used. Every file has such a table of
/// its own; these are the pairs that meshoptimizer writes.
const TABLE_OF_PAIRS: [u8; TABLE] =
    [0x00, 0x76, 0x87, 0x56, 0x67, 0x78, 0xa9, 0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0, 0];
const TABLE: usize = 16;
const TAIL: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use proptest::prelude::*;

    /// Triangles with the least corner first.
    fn turned(indices: &[u32]) -> Vec<[u32; 3]> {
        let least =
            |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default();
        indices.as_chunks().0.iter().map(least).collect()
    }

    #[test]
    fn a_surface_takes_little_more_than_a_byte_a_triangle() {
        // So narrow that what a row has in common with the one before was met lately; vertices by when they come.
        let mesh = shapes::grid(5, 300);
        let mut numbers = std::collections::HashMap::new();
        let number = |v: &u32| {
            let next = numbers.len() as u32;
            *numbers.entry(*v).or_insert(next)
        };
        let indices: Vec<u32> = mesh.triangles.as_flattened().iter().map(number).collect();
        let packed = pack(&indices);
        assert_eq!(turned(&triangles(&packed, indices.len()).unwrap()), turned(&indices));
        assert!(packed.len() < mesh.triangles.len() * 6 / 5, "{} bytes", packed.len());
    }

    proptest! {
        #[test]
        fn what_is_packed_is_unpacked(
            indices in prop::collection::vec(prop_oneof![0u32..12, 0u32..100, any::<u32>()], 0..120), by in 1usize..40,
        ) {
            let mut indices = indices;
            // What is met again, and again in another order.
            let again: Vec<u32> = indices.iter().step_by(by).copied().collect();
            indices.extend(again);
            indices.truncate(indices.len() / 3 * 3);
            let back = triangles(&pack(&indices), indices.len());
            prop_assert_eq!(back.map(|back| turned(&back)), Some(turned(&indices)));
        }

        #[test]
        fn in_the_order_in_which_they_come(steps in prop::collection::vec(0u32..3, 1..200)) {
            // Mostly new vertices, with some of those before.
            let mut next = 0;
            let mut indices: Vec<u32> = steps.iter().map(|&step| if step == 0 { next / 2 } else { next += 1; next - 1 }).collect();
            indices.truncate(indices.len() / 3 * 3);
            let back = triangles(&pack(&indices), indices.len());
            prop_assert_eq!(back.map(|back| turned(&back)), Some(turned(&indices)));
        }
    }
}
