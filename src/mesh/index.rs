//! Typed indices: confusing a triangle with a corner does not compile.

use std::fmt;

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
    /// A triangle; its corners are `3t`, `3t + 1`, `3t + 2`.
    Triangle,
    "t"
);
index_type!(
    /// A corner: one triangle at one of its vertices. It also names the edge opposite to it.
    Corner,
    "c"
);

impl Corner {
    /// The next corner of the same triangle, counter-clockwise: `3 * floor(c/3) + (c+1) mod 3`.
    #[inline]
    pub const fn next(self) -> Corner {
        // Arithmetic, since a branch here is taken at random.
        let up = self.0 + 1;
        Corner(up - 3 * up.is_multiple_of(3) as u32)
    }

    /// The previous corner of the same triangle: `3 * floor(c/3) + (c+2) mod 3`.
    #[inline]
    pub const fn prev(self) -> Corner {
        Corner(self.0 + 3 * self.0.is_multiple_of(3) as u32 - 1)
    }

    /// The triangle this corner belongs to.
    #[inline]
    pub const fn triangle(self) -> Triangle {
        Triangle(self.0 / 3)
    }
}

impl Triangle {
    /// The corner `3t + k`, for `k` in `0..3`.
    #[inline]
    pub const fn corner(self, k: u32) -> Corner {
        Corner(self.0 * 3 + k)
    }

    /// The three corners, counter-clockwise.
    #[inline]
    pub const fn corners(self) -> [Corner; 3] {
        [self.corner(0), self.corner(1), self.corner(2)]
    }
}
