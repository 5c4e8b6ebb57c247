//! Disjoint sets.

/// Sets of the numbers from 0 on, each alone at first.
pub(super) struct Sets {
    /// Another number of the same set, or the number itself: then it stands for the set.
    parent: Vec<u32>,
}

impl Sets {
    /// So many numbers.
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// The number that stands for the set.
    pub fn find(&mut self, mut v: u32) -> u32 {
        while self.parent[v as usize] != v {
            // Each number on the way is hung one step higher.
            let above = self.parent[self.parent[v as usize] as usize];
            self.parent[v as usize] = above;
            v = above;
        }
        v
    }

    /// Makes one set of two; the least number stands for it.
    pub fn unite(&mut self, v: u32, w: u32) {
        let (v, w) = (self.find(v), self.find(w));
        self.parent[v.max(w) as usize] = v.min(w);
    }

    /// Whether two numbers are in one set.
    pub fn are_one(&mut self, v: u32, w: u32) -> bool {
        self.find(v) == self.find(w)
    }

    /// How many sets there are.
    pub fn count(&self) -> usize {
        (0..).zip(&self.parent).filter(|&(v, &parent)| v == parent).count()
    }
}
