//! A set of places from which one after the other is taken: which is the k-th left, and how many are left below one.

/// The places below some number that have not been taken. All takes time log n (Fenwick 1994).
#[derive(Debug)]
pub struct Places {
    /// At place k, counted from 1, how many are left of those from k - (lowest bit of k) to k - 1.
    sums: Vec<u32>,
    taken: bitvec::vec::BitVec,
    left: usize,
}

impl Places {
    /// All places below `count`.
    pub fn new(count: usize) -> Self {
        let lowest_bit = |k: usize| 1u32 << k.trailing_zeros();
        Self {
            sums: (1..=count).map(lowest_bit).collect(),
            taken: bitvec::vec::BitVec::repeat(false, count),
            left: count,
        }
    }

    /// Whether `place` has been taken.
    pub fn is_taken(&self, place: usize) -> bool {
        self.taken[place]
    }

    /// How many are left below `place`.
    pub fn below(&self, place: usize) -> usize {
        let (mut k, mut sum) = (place, 0);
        while k > 0 {
            sum += self.sums[k - 1] as usize;
            k &= k - 1;
        }
        sum
    }

    /// The `k`-th of those that are left, counted from 0, if there are so many.
    pub fn nth(&self, mut k: usize) -> Option<usize> {
        if k >= self.left {
            return None;
        }
        let (mut place, mut step) = (0, self.sums.len().checked_ilog2().map_or(0, |bits| 1 << bits));
        while step > 0 {
            if let Some(&sum) = self.sums.get(place + step - 1).filter(|&&sum| sum as usize <= k) {
                k -= sum as usize;
                place += step;
            }
            step >>= 1;
        }
        Some(place)
    }

    /// Takes a place that is left.
    pub fn take(&mut self, place: usize) {
        debug_assert!(!self.taken[place]);
        self.taken.set(place, true);
        self.left -= 1;
        let mut k = place + 1;
        while let Some(sum) = self.sums.get_mut(k - 1) {
            *sum -= 1;
            k += k & k.wrapping_neg();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn as_a_list_would(count in 1..60usize, takes in prop::collection::vec(any::<prop::sample::Index>(), 0..60)) {
            let mut places = Places::new(count);
            let mut list: Vec<usize> = (0..count).collect();
            for take in takes {
                for k in 0..=count {
                    prop_assert_eq!(places.nth(k), list.get(k).copied());
                    prop_assert_eq!(places.below(k), list.iter().filter(|&&place| place < k).count());
                }
                if list.is_empty() {
                    break;
                }
                let place = list.remove(take.index(list.len()));
                places.take(place);
                prop_assert!(places.is_taken(place));
            }
        }
    }
}
