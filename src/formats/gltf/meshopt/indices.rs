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

const TABLE: usize = 16;
const TAIL: usize = 4;
