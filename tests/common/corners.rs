//! Meshes by what is at their corners, however they are numbered.

/// So many triangles by what their corners have, each from its least corner on, sorted: equal for meshes that are numbered otherwise.
pub fn from_least<C: Ord + Clone>(count: usize, corner: impl Fn(usize, usize) -> C) -> Vec<[C; 3]> {
    let rotated = |t: usize| {
        let [a, b, c] = [0, 1, 2].map(|k| corner(t, k));
        let turns = [[a.clone(), b.clone(), c.clone()], [b.clone(), c.clone(), a.clone()], [c, a, b]];
        turns.into_iter().min().unwrap()
    };
    let mut all: Vec<_> = (0..count).map(rotated).collect();
    all.sort();
    all
}
