//! Sorting what names vertices: by the first vertex into buckets, then each bucket. They are small, so this is nearly linear.

/// Sorts `items`, whose order goes first by the number that `bucket` tells, below `buckets`.
pub fn sort<T: Copy + Ord>(items: &mut Vec<T>, buckets: usize, bucket: impl Fn(&T) -> usize) {
    // Hardly used buckets would cost more than they save, in memory as well.
    let Some(&any) = items.first().filter(|_| buckets <= 2 * items.len()) else {
        items.sort_unstable();
        return;
    };
    let mut starts = vec![0u32; buckets + 1];
    for item in items.iter() {
        starts[bucket(item) + 1] += 1;
    }
    for k in 0..buckets {
        starts[k + 1] += starts[k];
    }
    let mut sorted = vec![any; items.len()];
    // Filling moves each start to the end of its bucket.
    for &item in items.iter() {
        let place = &mut starts[bucket(&item)];
        sorted[*place as usize] = item;
        *place += 1;
    }
    let mut first = 0;
    for &end in &starts[..buckets] {
        sorted[first..end as usize].sort_unstable();
        first = end as usize;
    }
    *items = sorted;
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn buckets_sort_as_sorting_does(mut items in prop::collection::vec((0..40u32, 0..5u32), 0..200)) {
            let mut expected = items.clone();
            expected.sort_unstable();
            sort(&mut items, 40, |item| item.0 as usize);
            prop_assert_eq!(items, expected);
        }
    }
}
