//! Replacement selection (Knuth, The Art of Computer Programming, vol. 3, 5.4.1): nearly sorted runs from a heap of constant size.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

/// A contraction that waits: of the vertex `source` into `target`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    /// What it costs, no NaN.
    pub(super) cost: f64,
    pub(super) source: u32,
    pub(super) target: u32,
}

/// A heap that gives back the cheapest of what it holds, but what is cheaper than the last one given back belongs to the next run.
#[derive(Debug)]
pub(super) struct Selection {
    heap: BinaryHeap<Entry>,
    size: usize,
    /// The run of what was given back last.
    run: u32,
}

impl Selection {
    /// An empty heap of `size` records, at least one.
    pub(super) fn new(size: usize) -> Self {
        Self { heap: BinaryHeap::with_capacity(size.max(1)), size: size.max(1), run: 0 }
    }

    /// Takes a record, and gives one back if there is no more room.
    pub(super) fn replace(&mut self, record: Record) -> Option<Record> {
        if self.heap.len() < self.size {
            self.heap.push(Entry { run: self.run, record });
            return None;
        }
        let mut root = self.heap.peek_mut()?;
        let out = *root;
        self.run = out.run;
        let later = record.cost < out.record.cost;
        *root = Entry { run: out.run + u32::from(later), record };
        Some(out.record)
    }

    /// Gives back one of the records that are left.
    pub(super) fn pop(&mut self) -> Option<Record> {
        let out = PeekMut::pop(self.heap.peek_mut()?);
        self.run = out.run;
        Some(out.record)
    }
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    run: u32,
    record: Record,
}

impl Ord for Entry {
    /// The least is the greatest, as the standard heap has it on top; equal costs in the order of their sources.
    fn cmp(&self, other: &Self) -> Ordering {
        let cost = || other.record.cost.total_cmp(&self.record.cost);
        other.run.cmp(&self.run).then_with(cost).then_with(|| other.record.source.cmp(&self.record.source))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The form of the paper of 2006: one array, whose first part is the heap of the current run and whose tail that of the next.
    struct InArray {
        costs: Vec<Option<f64>>,
        /// Records of the current run, at the front.
        current: usize,
        last: f64,
    }

    impl InArray {
        fn new(size: usize) -> Self {
            Self { costs: vec![None; size], current: 0, last: f64::NEG_INFINITY }
        }

        fn is_before(a: Option<f64>, b: Option<f64>) -> bool {
            match (a, b) {
                (Some(a), Some(b)) => a < b,
                (a, _) => a.is_none(),
            }
        }

        fn sift(&mut self, mut at: usize, end: usize) {
            loop {
                let children = [2 * at + 1, 2 * at + 2].into_iter().filter(|&child| child < end);
                let least =
                    children.reduce(|x, y| if Self::is_before(self.costs[y], self.costs[x]) { y } else { x });
                match least {
                    Some(child) if Self::is_before(self.costs[child], self.costs[at]) => {
                        self.costs.swap(child, at);
                        at = child;
                    }
                    _ => return,
                }
            }
        }

        /// Takes a cost and gives back the root; at first these are nulls.
        fn replace(&mut self, cost: Option<f64>) -> Option<f64> {
            if self.current == 0 {
                self.current = self.costs.len();
            }
            let out = self.costs[0];
            self.last = out.unwrap_or(f64::NEG_INFINITY);
            // What comes while nulls are there waits for the first run.
            let later = out.is_none() || cost.is_none_or(|cost| cost < self.last || cost.is_infinite());
            if later {
                self.current -= 1;
                let end = self.current;
                self.costs[0] = self.costs[end];
                self.costs[end] = cost;
                self.sift(0, end);
                self.sift(end, self.costs.len());
            } else {
                self.costs[0] = cost;
                self.sift(0, self.current);
            }
            out
        }
    }

    fn record(cost: f64, source: u32) -> Record {
        Record { cost, source, target: 0 }
    }

    proptest! {
        #[test]
        fn both_forms_give_the_same_costs(costs in prop::collection::vec(0u32..50, 0..200), size in 1usize..20) {
            let mut selection = Selection::new(size);
            let mut found: Vec<f64> = Vec::new();
            for (source, &cost) in (0..).zip(&costs) {
                found.extend(selection.replace(record(cost.into(), source)).map(|r| r.cost));
            }
            found.extend(std::iter::from_fn(|| selection.pop()).map(|r| r.cost));
            let mut in_array = InArray::new(size);
            let all = costs.iter().map(|&cost| Some(f64::from(cost)));
            // Records that the paper puts in at the end, with the largest cost, in the next run.
            let end = std::iter::repeat_n(Some(f64::INFINITY), 2 * size);
            let expected: Vec<f64> = all.chain(end).filter_map(|cost| in_array.replace(cost)).filter(|c| c.is_finite()).collect();
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn what_is_less_than_the_heap_out_of_order_comes_out_sorted(mut costs in prop::collection::vec(0u32..1000, 0..200), size in 1usize..20) {
            costs.sort_unstable();
            // Each moves by less than the size of the heap.
            for part in costs.chunks_mut(size) {
                part.reverse();
            }
            let mut selection = Selection::new(size);
            let mut found: Vec<f64> = Vec::new();
            for (source, &cost) in (0..).zip(&costs) {
                found.extend(selection.replace(record(cost.into(), source)).map(|r| r.cost));
            }
            found.extend(std::iter::from_fn(|| selection.pop()).map(|r| r.cost));
            prop_assert_eq!(found.len(), costs.len());
            prop_assert!(found.is_sorted());
        }
    }
}
