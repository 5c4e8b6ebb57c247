//! Which vertex of the result stands for each vertex of the input: what levels are interpolated by.

/// No vertex: whatever had it has gone.
pub const NO_VERTEX: u32 = u32::MAX;

/// Kept step by step, a step as large as the mesh is at its time, so that all of them take no more than a few times the input.
#[derive(Debug, Default)]
pub(super) struct Parents {
    /// For each step and number before it the number after it.
    steps: Vec<Vec<u32>>,
    /// In this step, for each vertex that has been merged into another one, that one; else itself.
    into: Vec<u32>,
}

impl Parents {
    /// Of so many vertices.
    pub(super) fn new(vertices: usize) -> Self {
        Self { steps: Vec::new(), into: (0..vertices as u32).collect() }
    }

    /// Two vertices are one.
    pub(super) fn merge(&mut self, source: u32, target: u32) {
        self.into[source as usize] = target;
    }

    /// A step ends: vertices have new numbers, or [`NO_VERTEX`].
    pub(super) fn renumber(&mut self, count: usize, number: impl Fn(u32) -> u32) {
        let mut into = std::mem::take(&mut self.into);
        for v in 0..into.len() as u32 {
            let mut root = v;
            while into[root as usize] != root {
                root = into[root as usize];
            }
            // All on the way know it from now on.
            let mut at = v;
            while at != root {
                at = std::mem::replace(&mut into[at as usize], root);
            }
        }
        into.iter_mut().for_each(|root| *root = number(*root));
        self.steps.push(into);
        self.into = (0..count as u32).collect();
    }

    /// For each vertex of the first step the number after the last.
    pub(super) fn finish(self) -> Vec<u32> {
        let mut steps = self.steps.into_iter().rev();
        let last = steps.next().unwrap_or_default();
        steps.fold(last, |after, mut step| {
            for v in &mut step {
                *v = after.get(*v as usize).copied().unwrap_or(NO_VERTEX);
            }
            step
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_follow_each_other() {
        let mut parents = Parents::new(6);
        // 0 into 1 into 2; 5 goes.
        parents.merge(0, 1);
        parents.merge(1, 2);
        parents.renumber(3, |v| [9, 9, 0, 1, 2, NO_VERTEX][v as usize]);
        parents.merge(2, 0);
        parents.renumber(2, |v| [1, 0, 9][v as usize]);
        assert_eq!(parents.finish(), [1, 1, 1, 0, 1, NO_VERTEX]);
        assert!(Parents::new(3).finish().is_empty());
    }
}
