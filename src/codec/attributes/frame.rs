//! Octahedral coordinates round an expected direction (spec §13.5).

/// Octahedral coordinates mirrored and turned such that those of an expected direction lie in the inner diamond, in its first quadrant:
/// directions near it have coordinates near its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    radius: i32,
    inverted: bool,
    turns: u32,
}

impl Frame {
    /// The frame of an expected direction.
    pub(super) fn new(expected: [i32; 2], radius: i32) -> Self {
        let inverted = expected[0].abs() + expected[1].abs() > radius;
        let [u, v] = if inverted { inverse(expected, radius) } else { expected };
        let turns = match (u >= 0, v >= 0) {
            (true, true) => 0,
            (false, true) => 1,
            (false, false) => 2,
            (true, false) => 3,
        };
        Self { radius, inverted, turns }
    }

    /// Coordinates in the frame.
    pub(super) fn enter(&self, q: [i32; 2]) -> [i32; 2] {
        turned(if self.inverted { inverse(q, self.radius) } else { q }, self.turns)
    }

    /// Coordinates from those in the frame; `None` where these are none.
    pub(super) fn leave(&self, q: [i32; 2]) -> Option<[i32; 2]> {
        if q.iter().any(|x| !(-self.radius..=self.radius).contains(x)) {
            return None;
        }
        let q = turned(q, (4 - self.turns) % 4);
        Some(if self.inverted { inverse(q, self.radius) } else { q })
    }
}

/// The direction mirrored at the plane of the first two axes.
fn inverse([u, v]: [i32; 2], radius: i32) -> [i32; 2] {
    let sign = |x: i32| if x < 0 { -1 } else { 1 };
    [sign(u) * (radius - v.abs()), sign(v) * (radius - u.abs())]
}

/// Quarter turns clockwise.
fn turned([u, v]: [i32; 2], turns: u32) -> [i32; 2] {
    match turns {
        0 => [u, v],
        1 => [v, -u],
        2 => [-u, -v],
        _ => [-v, u],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::quantise;

    /// All directions, in the frames of all.
    #[test]
    fn directions_come_back() {
        for radius in [1, 3, 7] {
            let all = || (-radius..=radius).flat_map(|u| (-radius..=radius).map(move |v| [u, v]));
            for expected in all() {
                let frame = Frame::new(expected, radius);
                let [u, v] = frame.enter(expected);
                assert!(u >= 0 && v >= 0 && u + v <= radius, "{expected:?} is at {u} {v}");
                for q in all().filter(|&q| quantise::canonical(q, radius) == q) {
                    assert_eq!(frame.leave(frame.enter(q)), Some(q), "{expected:?} {q:?}");
                }
            }
        }
    }
}
