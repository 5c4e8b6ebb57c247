//! Typed indices: confusing a triangle with a corner does not compile.

use std::fmt;
use std::ops::{Index, IndexMut};

macro_rules! index_type {
    ($(#[$doc:meta])* $name:ident, $letter:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// Stands for "no such element"; never a valid index.
            pub const NONE: Self = Self(u32::MAX);

            /// The index as an array subscript.
            #[inline]
            pub const fn index(self) -> usize {
                self.0 as usize
            }

            /// Whether this is a real index and not [`Self::NONE`].
            #[inline]
            pub const fn is_some(self) -> bool {
                self.0 != u32::MAX
            }

            /// Whether this is [`Self::NONE`].
            #[inline]
            pub const fn is_none(self) -> bool {
                self.0 == u32::MAX
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                if self.is_none() {
                    write!(f, concat!($letter, "-"))
                } else {
                    write!(f, concat!($letter, "{}"), self.0)
                }
            }
        }
    };
}

index_type!(
    /// A vertex.
    Vertex,
    "v"
);
index_type!(
    /// A triangle; its corners are `4t`, `4t + 1`, `4t + 2`.
    Triangle,
    "t"
);
index_type!(
    /// A corner: one triangle at one of its vertices. It also names the edge opposite to it.
    Corner,
    "c"
);

impl Corner {
    /// The next corner of the same triangle, counter-clockwise.
    #[inline]
    pub const fn next(self) -> Corner {
        // 0, 1, 2 become 1, 2, 0: a table of two bits each.
        Corner(self.0 & !3 | 0b00_10_01 >> (2 * (self.0 & 3)) & 3)
    }

    /// The previous corner of the same triangle, the one after the next.
    #[inline]
    pub const fn prev(self) -> Corner {
        Corner(self.0 & !3 | 0b01_00_10 >> (2 * (self.0 & 3)) & 3)
    }

    /// The triangle this corner belongs to.
    #[inline]
    pub const fn triangle(self) -> Triangle {
        Triangle(self.0 >> 2)
    }

    /// Which corner of its triangle it is: 0, 1 or 2.
    #[inline]
    pub const fn place(self) -> usize {
        (self.0 & 3) as usize
    }
}

impl Triangle {
    /// The corner `4t + k`, for `k` in `0..3`. (Four numbers a triangle make divisions by three shifts; the fourth is not used.)
    #[inline]
    pub const fn corner(self, k: u32) -> Corner {
        Corner(self.0 << 2 | k)
    }

    /// The three corners, counter-clockwise.
    #[inline]
    pub const fn corners(self) -> [Corner; 3] {
        [self.corner(0), self.corner(1), self.corner(2)]
    }
}

/// A value for each corner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CornerMap<T>(pub Vec<[T; 3]>);

impl<T> Default for CornerMap<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> CornerMap<T> {
    /// All corners, triangle by triangle.
    pub fn corners(&self) -> impl DoubleEndedIterator<Item = Corner> + use<T> {
        (0..self.0.len() as u32).flat_map(|t| Triangle(t).corners())
    }
}

impl<T: Copy> CornerMap<T> {
    /// The same value for each corner of so many triangles.
    pub fn new(value: T, triangles: usize) -> Self {
        Self(vec![[value; 3]; triangles])
    }
}

impl<T> Index<Corner> for CornerMap<T> {
    type Output = T;

    #[inline]
    fn index(&self, c: Corner) -> &T {
        &self.0[c.triangle().index()][c.place()]
    }
}

impl<T> IndexMut<Corner> for CornerMap<T> {
    #[inline]
    fn index_mut(&mut self, c: Corner) -> &mut T {
        &mut self.0[c.triangle().index()][c.place()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_follow_each_other() {
        for t in [0, 1, 7, (1 << 30) - 2].map(Triangle) {
            let [a, b, c] = t.corners();
            assert_eq!([a.next(), b.next(), c.next()], [b, c, a]);
            assert_eq!([a.prev(), b.prev(), c.prev()], [c, a, b]);
            assert!([a, b, c].iter().all(|c| c.triangle() == t && c.is_some()));
        }
    }
}
