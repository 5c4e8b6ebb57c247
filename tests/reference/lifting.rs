//! Chapters 2.4 and 5.4.5: which cells a vertex may be in, and how a split moves the ends of its edge.

use super::container::{Result, demand};
use super::vector::{Vector, cross, dot, floor};

/// What the cells of a level's vertices hang on.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// b.
    pub bits: u32,
    /// s of the level.
    pub shift: u32,
    /// f.
    pub factor: u8,
}

impl Scale {
    /// Of a level with all its bits, in a file that lifts nothing.
    pub fn plain(bits: u32) -> Self {
        Self { bits, shift: 0, factor: 0 }
    }

    /// §2.4: whether a coordinate of a cell is on the lattice or in its margin.
    pub fn holds(self, x: i64) -> bool {
        let margin = if self.factor > 0 { (1 << (self.bits - 2)) >> self.shift } else { 0 };
        (-margin..(1 << (self.bits - self.shift)) + margin).contains(&x)
    }

    /// §5.4.5: by how many cells a, b and v move, given the lattice points of a, b, c, d and v.
    pub fn lift(self, points: [[i64; 3]; 5]) -> [i64; 3] {
        let [a, b, c, d, v] = points.map(|point| point.map(|x| x >> self.shift));
        let edge = Vector::between(a, b);
        let normal = cross(edge, Vector::between(d, c));
        let n = dot(normal, normal);
        if n == 0.0 {
            return [0; 3];
        }
        let h = dot(Vector::between(a, v) - edge * 0.5, normal);
        let Vector(t) = normal * ((h / n) * (f32::from(self.factor) * 0.015625));
        t.map(|x| floor(x + 0.5))
    }

    /// §5.4.5: a lattice point so many cells back.
    pub fn moved(self, point: [i64; 3], by: [i64; 3]) -> Result<[i64; 3]> {
        let point = [0, 1, 2].map(|k| point[k] - (by[k] << self.shift));
        demand(point.iter().all(|x| self.holds(x >> self.shift)), "5.4.5: off the lattice")?;
        Ok(point)
    }
}

/// §5.7.3.
#[test]
fn the_first_split_of_the_octahedron() {
    let [a, b, c, d, v] = [[20, 10, 9], [10, 21, 10], [9, 10, 18], [10, 10, 2], [17, 18, 10]];
    let by = |factor| Scale { bits: 8, shift: 0, factor }.lift([a, b, c, d, v]);
    assert_eq!([by(32), by(13)], [[1, 1, 0], [0, 0, 0]]);
    let scale = Scale { bits: 8, shift: 0, factor: 32 };
    let moved = [a, b, v].map(|point| scale.moved(point, by(32)).unwrap());
    assert_eq!(moved, [[19, 9, 9], [9, 20, 10], [16, 17, 10]]);
    // Back from there, as an encoder would find it.
    let [a, b, v] = moved;
    assert_eq!(scale.lift([a, b, c, d, v]), [1, 1, 0]);
    // The numbers of the text.
    let normal = cross(Vector::between([20, 10, 9], [10, 21, 10]), Vector([-1.0, 0.0, 16.0]));
    assert_eq!((normal.0, dot(normal, normal)), ([176.0, 159.0, 11.0], 56_378.0));
    let Vector(t) = normal * ((dot(Vector([2.0, 2.5, 0.5]), normal) / 56_378.0) * 0.5);
    assert_eq!(t, [1.178_474, 1.064_644_1, 0.073_654_62]);
}
