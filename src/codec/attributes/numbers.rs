//! The numbers that integers of a value stand for, as far as prediction needs them (spec §13.4).

use crate::mesh::Attribute;
use crate::mesh::attributes::{Kind, Quantisation, Stored, quantise};

/// Most integers a value: two for each number.
pub(super) const MOST: usize = 2 * Attribute::MAX_COMPONENTS;

/// Integers of a value; those beyond its kind's are 0.
pub(super) type Integers = [i32; MOST];
/// A number for each component.
pub(super) type Numbers = [f64; Attribute::MAX_COMPONENTS];

/// How integers and numbers of a kind go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scale {
    /// The number is the integer.
    Same,
    /// The integer is the bits of a binary32, in order.
    Short,
    /// Two integers are those of a binary64.
    Long,
}

impl Scale {
    pub(super) fn of(kind: &Kind) -> Self {
        match (&kind.quantisation, kind.stored) {
            (Quantisation::Raw, Stored::F64) => Self::Long,
            (Quantisation::Raw, _) => Self::Short,
            _ => Self::Same,
        }
    }

    /// The numbers of a value.
    pub(super) fn numbers(self, value: &[i32]) -> Numbers {
        let mut numbers = [0.0; Attribute::MAX_COMPONENTS];
        let pairs = value.chunks_exact(2);
        match self {
            Self::Same => numbers.iter_mut().zip(value).for_each(|(x, &q)| *x = q.into()),
            Self::Short => numbers.iter_mut().zip(value).for_each(|(x, &q)| *x = quantise::short(q).into()),
            Self::Long => numbers.iter_mut().zip(pairs).for_each(|(x, q)| *x = quantise::long([q[0], q[1]])),
        }
        numbers
    }

    /// Component `k` of a value; 0 where it has none.
    #[inline]
    pub(super) fn number(self, value: &[i32], k: usize) -> f64 {
        let at = |k: usize| value.get(k).copied().unwrap_or(0);
        match self {
            Self::Same => at(k).into(),
            Self::Short => quantise::short(at(k)).into(),
            Self::Long => quantise::long([at(2 * k), at(2 * k + 1)]),
        }
    }

    /// Sets the integers of component `k` to those next to `x`; changes nothing where that is no finite number.
    pub(super) fn round(self, k: usize, x: f64, value: &mut Integers) {
        if !x.is_finite() {
            return;
        }
        match self {
            Self::Same => value[k] = (x + 0.5).floor() as i32,
            Self::Short => value[k] = quantise::ordered((x as f32).to_bits()),
            Self::Long => value[2 * k..2 * k + 2]
                .copy_from_slice(&quantise::halves(quantise::ordered_long(x.to_bits()))),
        }
    }

    /// How many components so many integers are.
    pub(super) fn components(self, integers: usize) -> usize {
        let count = if self == Self::Long { integers / 2 } else { integers };
        count.min(Attribute::MAX_COMPONENTS)
    }
}
